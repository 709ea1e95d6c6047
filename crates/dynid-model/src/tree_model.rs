//! The effort model of a robot: rigid bodies and joint elements.

mod adjoint;
mod clearance;
mod elastic;
mod elements;
mod friction_columns;
mod history;
mod known;
mod passivity;
mod payload;
mod reaction_friction;
mod shaped;

use std::sync::Arc;

use crate::coordinate::Coordinate;
use crate::description::{JointKind, Limits};
use crate::dynamics::{Dynamics, MotionAdjoint, MotionBlock, Slots};
use crate::effort_model::{EffortModel, History, Output, RegressorBlock, RegressorLayout};
use crate::element::{ElementColumns, JointElement, JointInfo};
use crate::mechanism::{Mechanism, ancestor_rates};
use crate::parameter::{Owner, Parameter, ParameterTable};
use crate::random_motion::RandomMotion;
use dynid_algebra::inertia::{PARAMETER_NAMES, PARAMETER_UNITS};
pub use known::KnownElement;
use known::PlacedKnown;
pub use passivity::{FrictionPassivity, Passivity};
use shaped::Shaped;

#[derive(Debug)]
struct PlacedElement {
    element: Box<dyn JointElement>,
    /// Slot of every entry.
    slots: Vec<usize>,
    /// Rate and parameter column of every entry.
    entries: Vec<(usize, usize)>,
    /// `0..entries.len()`: slots where only the element's own entries are stored.
    entry_numbers: Vec<usize>,
    /// First of its shape parameters.
    first_shape: usize,
    shapes: usize,
    /// How many signals it remembers.
    signals: usize,
}

/// Joint-level regressor of a mechanism with coupled joints, folded into coordinates afterwards.
#[derive(Debug)]
struct CoupledRegressor {
    dynamics: Dynamics,
    slots: Slots,
    slot_count: usize,
    /// `(joint slot, slot, ratio)` of the first of ten entries.
    folds: Vec<(usize, usize, f64)>,
}

/// Rigid bodies of a [`Mechanism`] plus elements at its joints.
///
/// Columns: ten standard parameters per body in file order, then the elements' parameters in the order given.
///
/// Positions, rates and outputs: those of the mechanism, then one of each per [`Coordinate`] without bodies.
#[derive(Debug)]
pub struct TreeModel {
    mechanism: Mechanism,
    coordinates: Vec<Coordinate>,
    travels: Vec<f64>,
    dynamics: Dynamics,
    joints: Vec<JointInfo>,
    outputs: Vec<Output>,
    parameters: ParameterTable,
    layout: Arc<RegressorLayout>,
    slots: Slots,
    coupled: Option<CoupledRegressor>,
    elements: Vec<PlacedElement>,
    shaped: Shaped,
    channels: Vec<String>,
    known: Vec<PlacedKnown>,
    signals: Vec<String>,
}

impl TreeModel {
    /// Combines a mechanism with joint elements.
    ///
    /// # Panics
    /// If an element names a rate that the mechanism does not have.
    pub fn new(mechanism: Mechanism, elements: Vec<Box<dyn JointElement>>) -> Self {
        Self::with_coordinates(mechanism, Vec::new(), elements)
    }

    /// Combines a mechanism with coordinates that no body moves with, and with elements at both: motors behind elastic
    /// transmissions. Coordinate `k` has the position `mechanism.positions() + k` and the rate `mechanism.rates() + k`.
    ///
    /// The mechanism may be one [without bodies](Mechanism::without_bodies).
    ///
    /// # Panics
    /// If an element names a rate that there is not, two coordinates or joints share a name, or an elastic transmission has
    /// one rate for motor and link or a ratio that is 0 or not finite.
    pub fn with_coordinates(
        mechanism: Mechanism,
        coordinates: Vec<Coordinate>,
        elements: Vec<Box<dyn JointElement>>,
    ) -> Self {
        let dynamics = Dynamics::new(&mechanism);
        let joints = JointInfo::of(&mechanism, &coordinates);
        let own_units = coordinates.iter().map(Coordinate::effort_unit);
        let outputs: Vec<Output> = joints
            .iter()
            .zip(mechanism.effort_units().into_iter().chain(own_units))
            .map(|(joint, unit)| Output { name: joint.name.clone(), unit })
            .collect();

        let acting = acting_bodies(&mechanism);
        let mut linear = inertial_parameters(&mechanism);
        let mut columns: Vec<Vec<usize>> =
            acting.iter().map(|bodies| bodies.iter().flat_map(|b| 10 * b..10 * b + 10).collect()).collect();
        columns.resize(joints.len(), Vec::new());
        let mut shape = Vec::new();
        let mut channels: Vec<String> = Vec::new();
        let mut first_column = Vec::with_capacity(elements.len());
        let mut first_shape = Vec::with_capacity(elements.len());
        for element in &elements {
            first_column.push(linear.len());
            first_shape.push(shape.len());
            for (rate, parameter) in element.entries() {
                assert!(rate < columns.len(), "element acts on rate {rate} of {}", columns.len());
                columns[rate].push(linear.len() + parameter);
            }
            linear.extend(element.parameters(&joints));
            shape.extend(element.shape(&joints));
            for channel in element.channels(&joints) {
                if !channels.contains(&channel) {
                    channels.push(channel);
                }
            }
        }
        let layout = Arc::new(RegressorLayout::new(columns, linear.len()));
        let first_slot = |rate: usize, body: usize| {
            layout
                .slot(rate, 10 * body)
                .unwrap_or_else(|| unreachable!("body {body} does not act on rate {rate}"))
        };
        let (slots, coupled) = match mechanism.follows() {
            None => (Slots::new(&dynamics, first_slot), None),
            Some(_) => {
                let coupled = CoupledRegressor::new(&mechanism, first_slot);
                (Slots::new(&dynamics, |_, _| 0), Some(coupled))
            }
        };
        let travels = travels(&elements, mechanism.rates(), coordinates.len());
        let elements: Vec<PlacedElement> = elements
            .into_iter()
            .enumerate()
            .map(|(k, element)| {
                let entries: Vec<(usize, usize)> = element
                    .entries()
                    .iter()
                    .map(|(rate, parameter)| (*rate, first_column[k] + parameter))
                    .collect();
                let slots = entries.iter().filter_map(|(rate, column)| layout.slot(*rate, *column)).collect();
                let shapes = element.shape(&joints).len();
                PlacedElement {
                    signals: element.signals(&joints).len(),
                    element,
                    slots,
                    entry_numbers: (0..entries.len()).collect(),
                    entries,
                    first_shape: first_shape[k],
                    shapes,
                }
            })
            .collect();
        let mut model = TreeModel {
            shaped: Shaped::new(&elements),
            dynamics,
            joints,
            outputs,
            parameters: ParameterTable { linear, shape },
            layout,
            slots,
            coupled,
            elements,
            channels,
            known: Vec::new(),
            signals: Vec::new(),
            coordinates,
            travels,
            mechanism,
        };
        model.signals = model.signal_names();
        model
    }

    /// The mechanism.
    pub fn mechanism(&self) -> &Mechanism {
        &self.mechanism
    }

    /// Coordinates without bodies, the last of the rates.
    pub fn coordinates(&self) -> &[Coordinate] {
        &self.coordinates
    }

    /// Limits of the joint or coordinate of a rate.
    ///
    /// # Panics
    /// If there is no such rate.
    pub fn limits(&self, rate: usize) -> Limits {
        match rate.checked_sub(self.mechanism.rates()) {
            Some(own) => self.coordinates[own].limits,
            None => self.mechanism.bodies()[self.mechanism.rate_bodies()[rate]].joint.limits,
        }
    }

    /// Returns the model with other values of its shape parameters: those that hold wherever nothing else is said
    /// ([`ParameterTable::shape_start`]).
    ///
    /// # Panics
    /// If there is not one value per shape parameter.
    #[must_use]
    pub fn with_shape(mut self, values: &[f64]) -> Self {
        assert_eq!(values.len(), self.parameters.shape.len(), "length of shape");
        for (parameter, value) in self.parameters.shape.iter_mut().zip(values) {
            parameter.start = *value;
        }
        self
    }

    /// Returns the model with other bounds of its shape parameters, one pair each.
    #[must_use]
    pub(crate) fn with_shape_ranges(mut self, ranges: &[(f64, f64)]) -> Self {
        for (parameter, range) in self.parameters.shape.iter_mut().zip(ranges) {
            (parameter.lower, parameter.upper) = *range;
        }
        self
    }

    /// Returns the model with shape parameters that no search moves: both bounds are the value.
    #[must_use]
    pub(crate) fn with_held_shapes(mut self, held: &[usize]) -> Self {
        for k in held {
            let parameter = &mut self.parameters.shape[*k];
            (parameter.lower, parameter.upper) = (parameter.start, parameter.start);
        }
        self
    }

    /// Joints and coordinates as elements see them, one per rate.
    pub fn joints(&self) -> &[JointInfo] {
        &self.joints
    }

    fn fill_elements(&self, motion: &MotionBlock<'_>, shape: &[f64], out: &mut RegressorBlock) {
        assert_eq!(shape.len(), self.parameters.shape.len(), "length of shape");
        let stride = out.stride();
        for placed in &self.elements {
            let mut columns = ElementColumns {
                data: out.data_mut(),
                slots: &placed.slots,
                stride,
                samples: motion.samples,
            };
            placed.element.fill(&self.joints, motion, placed.shape(shape), &mut columns);
        }
    }
}

impl EffortModel for TreeModel {
    fn outputs(&self) -> &[Output] {
        &self.outputs
    }

    fn parameters(&self) -> &ParameterTable {
        &self.parameters
    }

    fn layout(&self) -> &Arc<RegressorLayout> {
        &self.layout
    }

    fn channels(&self) -> &[String] {
        &self.channels
    }

    fn signals(&self) -> &[String] {
        &self.signals
    }

    fn remember(
        &self,
        motion: &MotionBlock<'_>,
        step_s: f64,
        shape: &[f64],
        history: &mut History,
        stride: usize,
        out: &mut [f64],
    ) {
        self.form_signals(motion, step_s, shape, history, stride, out);
    }

    /// Random motion as [`RandomMotion::of`] makes it.
    fn random_motion(&self, samples: usize, seed: u64) -> RandomMotion {
        RandomMotion::of(self, &self.mechanism, samples, seed)
    }

    fn dimensions(&self) -> (usize, usize) {
        let own = self.coordinates.len();
        (self.mechanism.positions() + own, self.mechanism.rates() + own)
    }

    fn travels(&self) -> &[f64] {
        &self.travels
    }

    /// Links with bodies behind an elastic transmission, whose drive acts on the motor's row, and translations of journals
    /// in their bearings.
    fn is_undriven(&self, output: usize) -> bool {
        let behind = output < self.mechanism.rates() && self.elastic_motor(output).is_some();
        behind || self.clearances().any(|contact| contact.translations.contains(&output))
    }

    fn reversal_speeds(&self, output: usize) -> Vec<Vec<(usize, f64)>> {
        let mut speeds = vec![vec![(output, 1.0)]];
        for placed in &self.elements {
            for speed in placed.element.reversal_speeds() {
                if speed.iter().any(|(rate, _)| *rate == output) {
                    speeds.push(speed);
                }
            }
        }
        speeds
    }

    fn regressor(&self, motion: &MotionBlock<'_>, shape: &[f64], out: &mut RegressorBlock) {
        assert_eq!(shape.len(), self.parameters.shape.len(), "length of shape");
        out.start(&self.layout, motion.samples);
        let stride = out.stride();
        match &self.coupled {
            None => self.dynamics.regressor_block(motion, &self.slots, stride, out.data_mut()),
            Some(coupled) => coupled.fill(&self.mechanism, motion, &self.layout, out),
        }
        self.fill_elements(motion, shape, out);
        self.fill_known(motion, out);
    }

    fn shaped_columns(&self) -> &[(usize, usize)] {
        &self.shaped.columns
    }

    fn shape_dependence(&self) -> &[(usize, usize)] {
        &self.shaped.dependence
    }

    fn shaped(
        &self,
        motion: &MotionBlock<'_>,
        shape: &[f64],
        stride: usize,
        values: &mut [f64],
        derivatives: &mut [f64],
    ) {
        self.fill_shaped(motion, shape, stride, values, derivatives);
    }

    fn efforts(
        &self,
        motion: &MotionBlock<'_>,
        shape: &[f64],
        linear: &[f64],
        stride: usize,
        effort: &mut [f64],
    ) {
        self.block_efforts(motion, shape, linear, stride, effort);
    }

    fn effort_adjoint(
        &self,
        motion: &MotionBlock<'_>,
        shape: &[f64],
        linear: &[f64],
        stride: usize,
        weights: &[f64],
        out: &mut MotionAdjoint,
    ) {
        self.block_effort_adjoint(motion, shape, linear, (stride, weights), out);
    }

    fn regressor_adjoint(
        &self,
        motion: &MotionBlock<'_>,
        shape: &[f64],
        weights: &RegressorBlock,
        out: &mut MotionAdjoint,
    ) {
        self.block_regressor_adjoint(motion, shape, weights, out);
    }
}

impl CoupledRegressor {
    fn new(mechanism: &Mechanism, first_slot: impl Fn(usize, usize) -> usize) -> Self {
        let follows = mechanism.follows().unwrap_or(&[]);
        let dynamics = Dynamics::new(mechanism).uncoupled();
        let mut folds = Vec::new();
        let mut first = std::collections::HashMap::new();
        for (body, _) in mechanism.bodies().iter().enumerate() {
            for rate in ancestor_rates(mechanism, body) {
                let joint_slot = 10 * folds.len();
                first.insert((rate, body), joint_slot);
                let f = follows[rate];
                folds.push((joint_slot, first_slot(f.coordinate, body), f.ratio));
            }
        }
        let slots = Slots::new(&dynamics, |rate, body| first[&(rate, body)]);
        CoupledRegressor { dynamics, slots, slot_count: 10 * folds.len(), folds }
    }

    /// Hands on the motion of all joints, packed without gaps.
    fn with_joint_motion<T>(
        &self,
        mechanism: &Mechanism,
        motion: &MotionBlock<'_>,
        work: impl FnOnce(&MotionBlock<'_>) -> T,
    ) -> T {
        let n = motion.samples;
        let joint = mechanism.expand_block(motion);
        let gravity: Option<Vec<f64>> = motion
            .gravity
            .map(|g| (0..3).flat_map(|c| g[c * motion.stride..][..n].iter().copied()).collect());
        work(&MotionBlock {
            samples: n,
            stride: n,
            q: &joint[0],
            dq: &joint[1],
            ddq: &joint[2],
            gravity: gravity.as_deref(),
            channels: &[],
            sign_width: 0.0,
        })
    }

    fn fill(
        &self,
        mechanism: &Mechanism,
        motion: &MotionBlock<'_>,
        layout: &RegressorLayout,
        out: &mut RegressorBlock,
    ) {
        let n = motion.samples;
        let mut rows = vec![0.0; self.slot_count * n];
        self.with_joint_motion(mechanism, motion, |block| {
            self.dynamics.regressor_block(block, &self.slots, n, &mut rows);
        });
        for output in 0..layout.outputs() {
            let first = layout.first_slot(output);
            for slot in first..first + layout.columns(output).len() {
                out.slot_mut(slot).fill(0.0);
            }
        }
        for (from, to, ratio) in &self.folds {
            for c in 0..10 {
                for (t, v) in out.slot_mut(to + c).iter_mut().zip(&rows[(from + c) * n..]) {
                    *t += ratio * v;
                }
            }
        }
    }
}

/// How far each coordinate without bodies travels per travel of a joint.
fn travels(elements: &[Box<dyn JointElement>], first_rate: usize, count: usize) -> Vec<f64> {
    let mut travels = vec![1.0; count];
    for e in elements.iter().filter_map(|e| e.elastic()) {
        assert!(e.link != e.motor && e.ratio.is_finite() && e.ratio != 0.0, "elastic transmission {e:?}");
        if let Some(travel) = e.motor.checked_sub(first_rate).and_then(|k| travels.get_mut(k)) {
            *travel = e.ratio;
        }
    }
    travels
}

/// For every coordinate, the bodies that it moves, in file order.
fn acting_bodies(mechanism: &Mechanism) -> Vec<Vec<usize>> {
    let mut acting = vec![Vec::new(); mechanism.rates()];
    for body in 0..mechanism.bodies().len() {
        for rate in ancestor_rates(mechanism, body) {
            let coordinate = mechanism.follows().map_or(rate, |f| f[rate].coordinate);
            if acting[coordinate].last() != Some(&body) {
                acting[coordinate].push(body);
            }
        }
    }
    acting
}

fn inertial_parameters(mechanism: &Mechanism) -> Vec<Parameter> {
    let mut out = Vec::with_capacity(mechanism.inertial_parameters());
    for (b, body) in mechanism.bodies().iter().enumerate() {
        let number = b + 1;
        let axis = body.joint.axis.0;
        let along = (0..3).max_by(|i, j| axis[*i].abs().total_cmp(&axis[*j].abs())).unwrap_or(2);
        // With the axis along z this folds Iyy, mz and m, the textbook choice for modified DH frames.
        let folded = match body.joint.kind {
            JointKind::Prismatic | JointKind::Floating => [usize::MAX; 3],
            _ => [0, 1 + along, [4, 7, 9][(along + 2) % 3]],
        };
        for c in 0..10 {
            out.push(Parameter {
                name: format!("{}.{}", body.name, PARAMETER_NAMES[c]),
                symbol: format!("{}{number}", PARAMETER_NAMES[c]),
                unit: PARAMETER_UNITS[c],
                owner: Owner::Link(body.name.clone()),
                prior: body.stated.then_some(body.inertia.0[c]),
                lower: (c == 0).then_some(0.0),
                upper: None,
                fold_first: folded.contains(&c),
            });
        }
    }
    out
}
