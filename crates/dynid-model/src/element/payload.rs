//! Bodies that some logs carry: payloads.

use super::gated::{gate, payload_channel};
use super::{ElementColumns, ElementWeights, JointElement, JointInfo};
use crate::dynamics::{Dynamics, MotionAdjoint, MotionBlock, Slots};
use crate::mechanism::{Mechanism, ancestor_rates};
use crate::parameter::{Owner, Parameter};
use dynid_algebra::inertia::{Inertia, PARAMETER_NAMES, PARAMETER_UNITS};

/// A body of unknown inertia fixed to a link wherever the channel [`payload_channel`] is 1: the columns of that link's
/// standard parameters once more, times the channel.
///
/// Parameters `<name>.m` .. `<name>.Izz`, about the joint frame of the link in the axes of the robot file, symbols
/// `m[name]`, `mx[name]` ..
#[derive(Debug)]
pub struct Payload {
    name: String,
    body: usize,
    /// Which of the ten parameters are unknown, ascending.
    unknown: Vec<usize>,
    rated_mass: f64,
    rates: Vec<usize>,
    dynamics: Dynamics,
    slots: Slots,
}

/// Mass that an unknown payload is thought to have at most, where nothing is said, kg.
const RATED_MASS: f64 = 5.0;

impl Payload {
    /// A payload on a body of a mechanism, all ten parameters unknown.
    ///
    /// # Panics
    /// If there is no such body, or the mechanism couples joints.
    pub fn new(mechanism: &Mechanism, body: usize, name: &str) -> Self {
        Self::with_unknown(mechanism, body, name, (0..10).collect())
    }

    /// A payload of which some parameters are zero or [known](KnownLoad). `unknown`: places of the others, ascending.
    ///
    /// # Panics
    /// Panics as [`Payload::new`] does; if a place is above 9.
    pub fn with_unknown(mechanism: &Mechanism, body: usize, name: &str, unknown: Vec<usize>) -> Self {
        check(mechanism, body);
        assert!(unknown.iter().all(|k| *k < 10), "places of a payload {unknown:?}");
        let rates = ancestor_rates(mechanism, body);
        let dynamics = Dynamics::new(mechanism);
        // What belongs to other bodies goes to a place behind that nobody reads.
        let own = |rate: usize, of: usize| rates.iter().position(|r| of == body && *r == rate);
        let slots = Slots::new(&dynamics, |rate, of| 10 * own(rate, of).unwrap_or(rates.len()));
        Payload { name: name.to_owned(), body, unknown, rated_mass: RATED_MASS, rates, dynamics, slots }
    }

    /// Returns the payload with another largest mass thought possible, kg (5 by default): for priors, it bounds nothing.
    #[must_use]
    pub fn with_rated_mass(self, rated_mass: f64) -> Self {
        Payload { rated_mass, ..self }
    }

    /// Largest mass thought possible, kg.
    pub fn rated_mass(&self) -> f64 {
        self.rated_mass
    }

    /// Name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The body that carries it.
    pub fn body(&self) -> usize {
        self.body
    }

    /// Whether all ten parameters are unknown.
    pub fn is_whole(&self) -> bool {
        self.unknown.len() == 10
    }
}

fn check(mechanism: &Mechanism, body: usize) {
    assert!(body < mechanism.bodies().len(), "a payload on body {body} of {}", mechanism.bodies().len());
    assert!(mechanism.follows().is_none(), "a mechanism that couples joints");
}

impl JointElement for Payload {
    fn rates(&self) -> Vec<usize> {
        self.rates.clone()
    }
    fn parameters(&self, _: &[JointInfo]) -> Vec<Parameter> {
        let of = |k: &usize| Parameter {
            name: format!("{}.{}", self.name, PARAMETER_NAMES[*k]),
            symbol: format!("{}[{}]", PARAMETER_NAMES[*k], self.name),
            unit: PARAMETER_UNITS[*k],
            owner: Owner::Link(self.name.clone()),
            prior: None,
            lower: (*k == 0).then_some(0.0),
            upper: None,
            fold_first: false,
        };
        self.unknown.iter().map(of).collect()
    }
    fn entries(&self) -> Vec<(usize, usize)> {
        let row = |rate: &usize| (0..self.unknown.len()).map(|k| (*rate, k)).collect::<Vec<_>>();
        self.rates.iter().flat_map(row).collect()
    }
    fn channels(&self, _: &[JointInfo]) -> Vec<String> {
        vec![payload_channel(&self.name)]
    }
    fn is_of_logs(&self) -> bool {
        true
    }
    fn payload(&self) -> Option<&Payload> {
        Some(self)
    }
    fn fill(&self, _: &[JointInfo], motion: &MotionBlock<'_>, _: &[f64], out: &mut ElementColumns<'_>) {
        let n = motion.samples;
        let gate = gate(motion, &payload_channel(&self.name));
        let mounted = gate.iter().any(|g| *g != 0.0);
        let mut rows = vec![0.0; if mounted { 10 * (self.rates.len() + 1) * n } else { 0 }];
        if mounted {
            self.dynamics.regressor_block(motion, &self.slots, n, &mut rows);
        }
        for (entry, (row, k)) in self.places().enumerate() {
            let column = out.column(entry);
            if !mounted {
                column.fill(0.0);
                continue;
            }
            for ((to, x), g) in column.iter_mut().zip(&rows[(10 * row + k) * n..]).zip(gate) {
                *to = g * x;
            }
        }
    }
    fn adjoint(
        &self,
        _: &[JointInfo],
        motion: &MotionBlock<'_>,
        _: &[f64],
        weights: &ElementWeights<'_>,
        out: &mut MotionAdjoint,
    ) {
        let n = motion.samples;
        let gate = gate(motion, &payload_channel(&self.name));
        let mut data = vec![0.0; 10 * (self.rates.len() + 1) * n];
        for (entry, (row, k)) in self.places().enumerate() {
            let to = &mut data[(10 * row + k) * n..][..n];
            for ((t, w), g) in to.iter_mut().zip(weights.column(entry)).zip(gate) {
                *t = w * g;
            }
        }
        self.dynamics.regressor_adjoint_block(motion, &self.slots, n, &data, out);
    }
}

impl Payload {
    /// Row and place among the ten parameters of every entry.
    fn places(&self) -> impl Iterator<Item = (usize, usize)> {
        (0..self.rates.len()).flat_map(|row| self.unknown.iter().map(move |k| (row, *k)))
    }
}

/// A known body fixed to a link wherever the channel [`payload_channel`] is 1, seen by efforts of unknown scale: per joint
/// one column, the effort `w_L` that the body asks for (N m or N), times `<joint>.h`.
///
/// Where efforts are logged as currents `i = (W x + w_L)/g`, `h = 1/g` is the inverse of the drive gain:
/// the noisy current stays on the left-hand side.
#[derive(Debug)]
pub struct KnownLoad {
    name: String,
    rates: Vec<usize>,
    dynamics: Dynamics,
    inertias: Vec<f64>,
}

impl KnownLoad {
    /// A known body on a body of a mechanism. `load`: its inertia about the joint frame of the link.
    ///
    /// # Panics
    /// Panics as [`Payload::new`] does.
    pub fn new(mechanism: &Mechanism, body: usize, name: &str, load: &Inertia) -> Self {
        check(mechanism, body);
        let mut inertias = vec![0.0; mechanism.inertial_parameters()];
        inertias[10 * body..10 * body + 10].copy_from_slice(&load.0);
        let rates = ancestor_rates(mechanism, body);
        KnownLoad { name: name.to_owned(), rates, dynamics: Dynamics::new(mechanism), inertias }
    }
}

impl JointElement for KnownLoad {
    fn rates(&self) -> Vec<usize> {
        self.rates.clone()
    }
    fn parameters(&self, joints: &[JointInfo]) -> Vec<Parameter> {
        let of = |rate: &usize| Parameter {
            fold_first: true,
            ..joints[*rate].parameter("h", ["A/(N m)", "A/N"], None)
        };
        self.rates.iter().map(of).collect()
    }
    fn entries(&self) -> Vec<(usize, usize)> {
        self.rates.iter().copied().enumerate().map(|(k, rate)| (rate, k)).collect()
    }
    fn channels(&self, _: &[JointInfo]) -> Vec<String> {
        vec![payload_channel(&self.name)]
    }
    fn is_of_logs(&self) -> bool {
        true
    }
    fn fill(&self, _: &[JointInfo], motion: &MotionBlock<'_>, _: &[f64], out: &mut ElementColumns<'_>) {
        let n = motion.samples;
        let gate = gate(motion, &payload_channel(&self.name));
        let mut efforts = vec![0.0; self.dynamics.rates() * n];
        if gate.iter().any(|g| *g != 0.0) {
            self.dynamics.inverse_dynamics_block(motion, &self.inertias, n, &mut efforts);
        }
        for (entry, rate) in self.rates.iter().enumerate() {
            for ((to, e), g) in out.column(entry).iter_mut().zip(&efforts[rate * n..]).zip(gate) {
                *to = g * e;
            }
        }
    }
    fn adjoint(
        &self,
        _: &[JointInfo],
        motion: &MotionBlock<'_>,
        _: &[f64],
        weights: &ElementWeights<'_>,
        out: &mut MotionAdjoint,
    ) {
        let n = motion.samples;
        let gate = gate(motion, &payload_channel(&self.name));
        let mut by_effort = vec![0.0; self.dynamics.rates() * n];
        for (entry, rate) in self.rates.iter().enumerate() {
            let to = &mut by_effort[rate * n..][..n];
            for ((t, w), g) in to.iter_mut().zip(weights.column(entry)).zip(gate) {
                *t = w * g;
            }
        }
        self.dynamics.effort_adjoint_block(motion, &self.inertias, n, &by_effort, out);
    }
}
