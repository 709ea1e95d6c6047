//! What acts at a joint besides rigid bodies.
//!
//! Efforts count on the drive's side of the balance: `effort of the drive = rigid bodies + Σ elements`, so friction is
//! positive for positive speed. `s(v)` is the sign with `s(0) = 0`.

mod balancer;
mod channel;
mod clearance;
mod compliance;
mod cyclic;
mod drive;
mod elastic;
mod external_load;
mod formula;
mod friction;
mod gated;
mod jets;
mod law;
pub mod laws;
mod linearised;
mod log_scaled;
mod payload;
mod registry;
mod rotor;
mod shape;
mod transmission;

use channel::temperature_of;
pub use channel::{current_channel, is_temperature, temperature_channel};
pub use clearance::{ClearanceContact, FrictionLine, JournalContact, JournalMotion, impact_speed_signal};
pub use compliance::Spring;
pub use cyclic::Cyclic;
pub use drive::DriveGain;
pub use elastic::{CubicFit, CubicSpring, ElasticDoubt, ElasticTransmission, PiecewiseFit, PiecewiseSpring};
pub use external_load::{ExternalLoad, load_channel};
pub use formula::{FormulaFault, FormulaLaw, FormulaLawFault, FormulaTerms, RESERVED, kept};
pub use friction::{
    Arctangent, AsymmetricFriction, Coulomb, ExponentialViscous, FollowingFriction, JournalFriction,
    LoadFriction, LuGre, MaxwellSlip, Offset, PowerLaw, ReactionFriction, Sigmoid, SigmoidOffset, SlipSpring,
    Stribeck, StribeckViscous, TanhFriction, Viscous, ViscousMagnitude, journal_moment_channel,
    reaction_channel, weight_channel,
};
pub use gated::{Gated, is_gate, log_channel, payload_channel};
pub use jets::JetMotion;
pub use law::{AtJoint, LinearTerm, ShapeScale, ShapeTerm, Velocity, VelocityLaw, units};
pub use linearised::{Linearised, change_name};
pub use log_scaled::{LogScaled, ScaledPart, scale_name};
pub use payload::{KnownLoad, Payload};
pub use registry::{
    Candidate, ElementKind, ElementRegistry, OptionTerm, OptionValue, Placement, RegistryFault, StatedTerm,
};
pub use rotor::RotorInertia;
pub use shape::{ShapeFault, ShapeSetting};
pub use transmission::{CoupledWrist, Transmission};

use crate::coordinate::Coordinate;
use crate::description::JointKind;
use crate::dynamics::{MotionAdjoint, MotionBlock};
use crate::mechanism::Mechanism;
use crate::parameter::{Owner, Parameter, ShapeParameter};
use dynid_algebra::scalar::Jet;
pub use dynid_algebra::scalar::sign;

/// An output as elements see it.
#[derive(Debug, Clone, PartialEq)]
pub struct JointInfo {
    /// Joint name.
    pub name: String,
    /// Number in joint order, from 1.
    pub number: usize,
    /// Index in the position vector.
    pub position: usize,
    /// The joint slides instead of turning.
    pub slides: bool,
}

impl JointInfo {
    /// Outputs of a mechanism and of coordinates that no body moves with, the latter last.
    ///
    /// # Panics
    /// If two share a name.
    pub fn of(mechanism: &Mechanism, coordinates: &[Coordinate]) -> Vec<JointInfo> {
        let owners = mechanism.rate_bodies();
        let names = mechanism.rate_names();
        let mut position = 0;
        let mut last = usize::MAX;
        let mut out = Vec::with_capacity(names.len());
        for (k, name) in names.into_iter().enumerate() {
            let joint = &mechanism.bodies()[owners[k]].joint;
            if owners[k] != last {
                position = out
                    .last()
                    .map_or(0, |j: &JointInfo| j.position + mechanism.bodies()[last].joint.positions());
                last = owners[k];
            }
            out.push(JointInfo { name, number: k + 1, position, slides: joint.kind == JointKind::Prismatic });
        }
        for (k, coordinate) in coordinates.iter().enumerate() {
            let Coordinate { name, slides, .. } = coordinate.clone();
            assert!(out.iter().all(|j| j.name != name), "two coordinates named `{name}`");
            out.push(JointInfo { number: out.len() + 1, position: mechanism.positions() + k, name, slides });
        }
        out
    }

    /// A linear parameter of this joint. `units`: for joints that turn and for joints that slide.
    pub fn parameter(&self, symbol: &str, units: [&'static str; 2], lower: Option<f64>) -> Parameter {
        Parameter {
            name: format!("{}.{symbol}", self.name),
            symbol: format!("{symbol}{}", self.number),
            unit: units[usize::from(self.slides)],
            owner: Owner::Joint(self.name.clone()),
            prior: None,
            lower,
            upper: None,
            fold_first: false,
        }
    }
}

/// Columns that an element fills, one per entry of [`JointElement::entries`].
#[derive(Debug)]
pub struct ElementColumns<'a> {
    pub(crate) data: &'a mut [f64],
    pub(crate) slots: &'a [usize],
    pub(crate) stride: usize,
    pub(crate) samples: usize,
}

impl ElementColumns<'_> {
    /// The column of an entry, one number per sample.
    pub fn column(&mut self, entry: usize) -> &mut [f64] {
        &mut self.data[self.slots[entry] * self.stride..][..self.samples]
    }

    /// The columns of the entries from `first` on.
    ///
    /// # Panics
    /// If two of them are the same column.
    pub fn columns<const N: usize>(&mut self, first: usize) -> [&mut [f64]; N] {
        let range = |entry: usize| {
            let begin = self.slots[entry] * self.stride;
            begin..begin + self.samples
        };
        match self.data.get_disjoint_mut(std::array::from_fn(|k| range(first + k))) {
            Ok(columns) => columns,
            Err(fault) => panic!("columns from {first} on: {fault}"),
        }
    }

    /// Fills the column of an entry from one signal.
    pub fn map(&mut self, entry: usize, signal: &[f64], f: impl Fn(f64) -> f64) {
        for (to, x) in self.column(entry).iter_mut().zip(signal) {
            *to = f(*x);
        }
    }
}

/// Weights of the columns that an element fills, one column per entry of [`JointElement::entries`].
#[derive(Debug)]
pub struct ElementWeights<'a> {
    pub(crate) data: &'a [f64],
    pub(crate) slots: &'a [usize],
    pub(crate) stride: usize,
    pub(crate) samples: usize,
}

impl ElementWeights<'_> {
    /// Weights of an entry, one number per sample.
    pub fn column(&self, entry: usize) -> &[f64] {
        &self.data[self.slots[entry] * self.stride..][..self.samples]
    }

    /// Adds `weight · f'(x)` of one entry to the derivatives by its signal: `to[coordinate * samples + s]`.
    fn add(
        &self,
        entry: usize,
        coordinate: usize,
        signal: &[f64],
        derivative: impl Fn(f64) -> f64,
        to: &mut [f64],
    ) {
        let to = &mut to[coordinate * self.samples..][..self.samples];
        for ((t, w), x) in to.iter_mut().zip(self.column(entry)).zip(signal) {
            *t += w * derivative(*x);
        }
    }
}

/// An element that acts on one or more joints, linear in most of its parameters.
pub trait JointElement: std::fmt::Debug + Send + Sync {
    /// Rates that it acts on.
    fn rates(&self) -> Vec<usize>;
    /// Linear parameters. `joints`: one per rate of the mechanism.
    fn parameters(&self, joints: &[JointInfo]) -> Vec<Parameter>;
    /// Shape parameters that are free, in the order of the element's shape vector; none by default.
    fn shape(&self, _joints: &[JointInfo]) -> Vec<ShapeParameter> {
        Vec::new()
    }
    /// Which of its linear parameters act on which rate: `(rate, parameter)`.
    fn entries(&self) -> Vec<(usize, usize)>;
    /// Whether the effort is friction: of a single rate, whose velocity alone it depends on. False by default.
    fn is_friction(&self) -> bool {
        false
    }
    /// The effort of every entry is friction of the rate that it acts on, whatever else it depends on (loads, temperatures,
    /// factors of logs). By default: [`JointElement::is_friction`].
    fn opposes_motion(&self) -> bool {
        self.is_friction()
    }
    /// Whether the effort depends on the position of the joint alone: no friction, whatever the motion. False by default.
    fn is_of_position(&self) -> bool {
        false
    }
    /// Extra channels that it reads.
    fn channels(&self, _joints: &[JointInfo]) -> Vec<String> {
        Vec::new()
    }
    /// Names of the signals that it forms from the motion before ([`JointElement::remember`]); its columns read them as
    /// channels. None by default.
    fn signals(&self, _joints: &[JointInfo]) -> Vec<String> {
        Vec::new()
    }
    /// Forms the samples of its signals over a block, `out[signal][sample]`, and takes its state to the end of the block.
    ///
    /// `step_s`: time between samples. `state`: empty at the start of a record; afterwards what the block before left.
    fn remember(
        &self,
        _joints: &[JointInfo],
        _motion: &MotionBlock<'_>,
        _step_s: f64,
        _shape: &[f64],
        _state: &mut Vec<f64>,
        _out: &mut [&mut [f64]],
    ) {
    }
    /// Combinations `Σ factor · rate`, besides single rates, whose sign the element takes.
    fn reversal_speeds(&self) -> Vec<Vec<(usize, f64)>> {
        Vec::new()
    }
    /// The elastic transmission that it is, if it is one; none by default.
    fn elastic(&self) -> Option<&ElasticTransmission> {
        None
    }
    /// The friction that follows a reaction, if it is one; none by default.
    fn reaction_friction(&self) -> Option<FollowingFriction<'_>> {
        None
    }
    /// The contact of a joint with clearance that it is, if it is one; none by default.
    fn clearance(&self) -> Option<&ClearanceContact> {
        None
    }
    /// The payload that it is, if it is one; none by default.
    fn payload(&self) -> Option<&Payload> {
        None
    }
    /// The elements with a factor of some logs that it is, if it is such; none by default.
    fn scaled(&self) -> Option<&LogScaled> {
        None
    }
    /// Whether the linear parameters are of single logs: without [gate](is_gate) it has no effort. False by default.
    fn is_of_logs(&self) -> bool {
        false
    }
    /// Fills the columns of all entries.
    fn fill(
        &self,
        joints: &[JointInfo],
        motion: &MotionBlock<'_>,
        shape: &[f64],
        out: &mut ElementColumns<'_>,
    );
    /// Fills the columns of all entries at one instant with their time derivatives; false, having filled nothing that
    /// counts, if the element does not offer them or a channel is missing. Not offered by default.
    fn jets(&self, _joints: &[JointInfo], _motion: &JetMotion<'_>, _shape: &[f64], _out: &mut [Jet]) -> bool {
        false
    }
    /// Which columns change with which shape parameter: `(entry, shape parameter)`, each pair once; none by default.
    fn shape_entries(&self) -> Vec<(usize, usize)> {
        Vec::new()
    }
    /// Fills the derivative of an entry's column by a shape parameter, one column per pair of
    /// [`JointElement::shape_entries`].
    fn shape_derivatives(
        &self,
        _joints: &[JointInfo],
        _motion: &MotionBlock<'_>,
        _shape: &[f64],
        _out: &mut ElementColumns<'_>,
    ) {
    }
    /// Both of [`JointElement::fill`] and [`JointElement::shape_derivatives`], for elements that get one with the other.
    fn fill_with_derivatives(
        &self,
        joints: &[JointInfo],
        motion: &MotionBlock<'_>,
        shape: &[f64],
        values: &mut ElementColumns<'_>,
        derivatives: &mut ElementColumns<'_>,
    ) {
        self.fill(joints, motion, shape, values);
        self.shape_derivatives(joints, motion, shape, derivatives);
    }
    /// Adds to `out` the derivatives of `Σ weights ∘ shape derivatives` with respect to the motion, one column of weights
    /// per pair of [`JointElement::shape_entries`]; kinks as in [`JointElement::adjoint`].
    fn shape_adjoint(
        &self,
        _joints: &[JointInfo],
        _motion: &MotionBlock<'_>,
        _shape: &[f64],
        _weights: &ElementWeights<'_>,
        _out: &mut MotionAdjoint,
    ) {
    }
    /// Adds to `out` the derivatives of `Σ weights ∘ columns` with respect to the motion. Extra channels are held; where a
    /// column has a kink, the mean of both sides counts.
    fn adjoint(
        &self,
        joints: &[JointInfo],
        motion: &MotionBlock<'_>,
        shape: &[f64],
        weights: &ElementWeights<'_>,
        out: &mut MotionAdjoint,
    );
}
