//! A mechanism with closures, and which of its coordinates are driven and independent.

use super::closure::ClosureDescription;
use super::error::ClosedWarning;
use super::rows::Rows;
use crate::dynamics::tree::Tree;
use crate::mechanism::Mechanism;

/// A tree with closures, checked and with a closed home position.
///
/// Poses are sought from the home position on, which thereby chooses among the ways to assemble the mechanism.
#[derive(Clone, Debug)]
pub struct ClosedMechanism {
    pub(super) mechanism: Mechanism,
    pub(super) closures: Vec<ClosureDescription>,
    pub(super) tree: Tree,
    pub(super) rows: Rows,
    /// Length `L_c` that makes angles comparable to lengths, m.
    pub(super) length: f64,
    /// Factor of every row, and of every coordinate, that makes both lengths.
    pub(super) row_scale: Vec<f64>,
    pub(super) rate_scale: Vec<f64>,
    pub(super) driven: Vec<usize>,
    pub(super) independent: Vec<usize>,
    /// All other rates, ascending.
    pub(super) dependent: Vec<usize>,
    /// Position entry of every rate; for floating joints that of the joint.
    pub(super) position_of: Vec<usize>,
    /// Whether a rate belongs to a joint that floats.
    pub(super) floats: Vec<bool>,
    pub(super) home: Vec<f64>,
    /// Rows that decide on the assembly mode: as many as there are dependent coordinates.
    pub(super) mode_rows: Vec<usize>,
    pub(super) mode: f64,
    pub(super) undetermined: Vec<bool>,
    pub(super) warnings: Vec<ClosedWarning>,
    pub(super) least_measure: f64,
}

impl ClosedMechanism {
    /// Refuses poses whose [measure of singularity](super::Singularity) is below `least`. Default: 1e-4.
    #[must_use]
    pub fn with_least_measure(mut self, least: f64) -> Self {
        self.least_measure = least;
        self
    }

    /// The measure of singularity below which poses are refused.
    pub fn least_measure(&self) -> f64 {
        self.least_measure
    }

    /// The tree.
    pub fn mechanism(&self) -> &Mechanism {
        &self.mechanism
    }

    /// Returns the closures on another tree with the same joints: other inertias or another gravity.
    ///
    /// # Panics
    /// If the joints differ.
    #[must_use]
    pub fn with_mechanism(mut self, mechanism: Mechanism) -> Self {
        let joints = |m: &Mechanism| -> Vec<_> { m.bodies().iter().map(|b| b.joint.clone()).collect() };
        assert_eq!(joints(&mechanism), joints(&self.mechanism), "joints of another mechanism");
        self.mechanism = mechanism;
        self
    }

    /// The closures.
    pub fn closures(&self) -> &[ClosureDescription] {
        &self.closures
    }

    /// Number of conditions, which is the number of multipliers.
    pub fn conditions(&self) -> usize {
        self.rows.len()
    }

    /// For every condition: the index of its closure.
    pub fn condition_closures(&self) -> &[usize] {
        &self.rows.owner
    }

    /// For every condition: whether poses and efforts determine its multiplier. Where conditions repeat each other,
    /// some multipliers are those of least norm.
    pub fn is_determined(&self) -> Vec<bool> {
        self.undetermined.iter().map(|u| !u).collect()
    }

    /// Number of free motions.
    pub fn mobility(&self) -> usize {
        self.independent.len()
    }

    /// Rates of the tree that drives act on, in the order stated.
    pub fn driven(&self) -> &[usize] {
        &self.driven
    }

    /// Rates of the tree that the others follow from.
    pub fn independent(&self) -> &[usize] {
        &self.independent
    }

    /// Rates of the tree that follow from the independent ones.
    pub fn dependent(&self) -> &[usize] {
        &self.dependent
    }

    /// Whether drives are the independent coordinates, one for one.
    pub fn drives_are_independent(&self) -> bool {
        self.driven == self.independent
    }

    /// A closed pose: positions of all joints.
    pub fn home(&self) -> &[f64] {
        &self.home
    }

    /// The home pose joint by joint, as [`ClosedMechanism::new`] takes it.
    pub fn home_by_joint(&self) -> Vec<(String, Vec<f64>)> {
        let own = |b: &crate::mechanism::Body| {
            (b.joint.name.clone(), self.home[b.position..b.position + b.joint.positions()].to_vec())
        };
        self.mechanism.bodies().iter().map(own).collect()
    }

    /// Names of the driven joints.
    pub fn driven_names(&self) -> Vec<String> {
        let names = self.mechanism.rate_names();
        self.driven.iter().map(|r| names[*r].clone()).collect()
    }

    /// Positions of the independent coordinates at home.
    pub fn home_independent(&self) -> Vec<f64> {
        self.independent.iter().map(|r| self.home[self.position_of[*r]]).collect()
    }

    /// What makes the change of every rate a length: 1, or `L_c` (m) where it turns.
    pub fn rate_scales(&self) -> &[f64] {
        &self.rate_scale
    }

    /// Whether a rate belongs to a joint that floats.
    pub fn floats(&self, rate: usize) -> bool {
        self.floats[rate]
    }

    /// Position entry of a rate: its own, or the first of the seven of a floating joint.
    pub fn position_of(&self, rate: usize) -> usize {
        self.position_of[rate]
    }

    /// Oddities that were found.
    pub fn warnings(&self) -> &[ClosedWarning] {
        &self.warnings
    }
}

/// Equal if all follows from the same statements.
impl PartialEq for ClosedMechanism {
    fn eq(&self, other: &Self) -> bool {
        self.mechanism == other.mechanism
            && self.closures == other.closures
            && self.driven == other.driven
            && self.independent == other.independent
            && self.home == other.home
            && self.least_measure == other.least_measure
    }
}
