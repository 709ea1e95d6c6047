//! Parameters that a fit is free to choose.

use crate::joint::ServoJoint;
use crate::term::Term;

/// What a free parameter is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Target {
    /// A term that these joints share.
    Term {
        /// The term.
        term: Term,
        /// Joints of the robot.
        joints: Vec<usize>,
    },
    /// A standard inertial parameter of the robot, by its place in
    /// [`Mechanism::inertia_vector`](dynid_model::Mechanism::inertia_vector). Of regrouped parameters the one that stands for them.
    Inertia(usize),
}

/// A free parameter with what is known of it beforehand.
#[derive(Debug, Clone, PartialEq)]
pub struct Free {
    /// What it is.
    pub target: Target,
    /// Least value.
    pub lower: f64,
    /// Greatest value.
    pub upper: f64,
    /// Value and standard deviation known beforehand.
    pub prior: Option<(f64, f64)>,
}

impl Free {
    /// A term of some joints within what physics allows.
    pub fn term(term: Term, joints: impl IntoIterator<Item = usize>) -> Self {
        let (lower, upper) = term.range();
        Free {
            target: Target::Term { term, joints: joints.into_iter().collect() },
            lower,
            upper,
            prior: None,
        }
    }

    /// An inertial parameter without bounds.
    pub fn inertia(entry: usize) -> Self {
        Free { target: Target::Inertia(entry), lower: f64::NEG_INFINITY, upper: f64::INFINITY, prior: None }
    }

    /// Returns the parameter with a value known beforehand.
    #[must_use]
    pub fn known(mut self, value: f64, std: f64) -> Self {
        self.prior = Some((value, std));
        self
    }

    /// The term, if it is one.
    pub fn as_term(&self) -> Option<Term> {
        match &self.target {
            Target::Term { term, .. } => Some(*term),
            Target::Inertia(_) => None,
        }
    }

    /// Joints that have the parameter; none for inertias.
    pub fn joints(&self) -> &[usize] {
        match &self.target {
            Target::Term { joints, .. } => joints,
            Target::Inertia(_) => &[],
        }
    }
}

/// All numbers of a robot behind its drives.
#[derive(Debug, Clone, PartialEq)]
pub struct ServoValues {
    /// Joints in the order of the mechanism's rates.
    pub joints: Vec<ServoJoint>,
    /// Standard inertial parameters.
    pub inertias: Vec<f64>,
}

impl ServoValues {
    /// Value of a free parameter: for a shared one that of its first joint.
    pub fn get(&self, free: &Free) -> f64 {
        match &free.target {
            Target::Term { term, joints } => joints.first().map_or(0.0, |j| self.joints[*j].get(*term)),
            Target::Inertia(entry) => self.inertias[*entry],
        }
    }

    /// Sets a free parameter.
    pub fn set(&mut self, free: &Free, value: f64) {
        match &free.target {
            Target::Term { term, joints } => joints.iter().for_each(|j| self.joints[*j].set(*term, value)),
            Target::Inertia(entry) => self.inertias[*entry] = value,
        }
    }

    /// Values of free parameters.
    pub fn gather(&self, free: &[Free]) -> Vec<f64> {
        free.iter().map(|f| self.get(f)).collect()
    }

    /// Returns the numbers with other values of free parameters.
    #[must_use]
    pub fn with(&self, free: &[Free], values: &[f64]) -> ServoValues {
        let mut out = self.clone();
        for (f, value) in free.iter().zip(values) {
            out.set(f, *value);
        }
        out
    }
}
