//! The effort model of a robot, open or closed, with ideal joints or journals in bearings, its parameters tied or not.

mod tied;

use std::borrow::Cow;
use std::sync::Arc;

use crate::closed_model::{ClosedModel, LoadError, LoadReference};
use crate::coordinate::Coordinate;
use crate::description::Limits;
use crate::dynamics::{MotionAdjoint, MotionBlock};
use crate::effort_model::{EffortModel, History, Output, RegressorBlock, RegressorLayout};
use crate::element::{ClearanceContact, ElasticTransmission, JetMotion, JointElement, JointInfo, Payload};
use crate::journal_model::JournalModel;
use crate::mechanism::Mechanism;
use crate::parameter::{Parameter, ParameterTable};
use crate::random_motion::RandomMotion;
use crate::ties::{TieError, Ties};
use crate::tree_model::{FrictionPassivity, KnownElement, TreeModel};
use dynid_algebra::scalar::Jet;
use tied::Tied;

/// Rigid bodies and joint elements of a robot: a tree, or a tree whose loops are closed.
///
/// Outputs are all rates of a tree, the drives of a closed mechanism. What is said of *rates* here counts outputs.
///
/// With [ties](RobotModel::with_ties) parameters that follow from others stay in the table and in every vector of parameters, but
/// have no column: efforts take them from the free ones, whatever stands in their place.
#[derive(Debug)]
pub struct RobotModel {
    kind: Kind,
    tied: Option<Box<Tied>>,
}

#[derive(Debug)]
#[expect(clippy::large_enum_variant, reason = "a program has few models")]
enum Kind {
    /// A tree.
    Tree(TreeModel),
    /// A tree with closed loops, or one whose joints have friction that follows reactions.
    Closed(ClosedModel),
    /// A tree whose journals move in their bearings.
    Journals(JournalModel),
}

impl From<TreeModel> for RobotModel {
    fn from(tree: TreeModel) -> Self {
        RobotModel { kind: Kind::Tree(tree), tied: None }
    }
}

impl From<ClosedModel> for RobotModel {
    fn from(closed: ClosedModel) -> Self {
        RobotModel { kind: Kind::Closed(closed), tied: None }
    }
}

impl From<JournalModel> for RobotModel {
    fn from(journals: JournalModel) -> Self {
        RobotModel { kind: Kind::Journals(journals), tied: None }
    }
}

impl RobotModel {
    /// A tree; see [`TreeModel::new`].
    ///
    /// # Panics
    /// Panics as [`TreeModel::new`] does.
    pub fn new(mechanism: Mechanism, elements: Vec<Box<dyn JointElement>>) -> Self {
        TreeModel::new(mechanism, elements).into()
    }

    /// A tree with coordinates that no body moves with; see [`TreeModel::with_coordinates`].
    ///
    /// # Panics
    /// Panics as [`TreeModel::with_coordinates`] does.
    pub fn with_coordinates(
        mechanism: Mechanism,
        coordinates: Vec<Coordinate>,
        elements: Vec<Box<dyn JointElement>>,
    ) -> Self {
        TreeModel::with_coordinates(mechanism, coordinates, elements).into()
    }

    /// The model of the tree, loops left open, journals centred in their bearings.
    pub fn tree(&self) -> &TreeModel {
        match &self.kind {
            Kind::Tree(tree) => tree,
            Kind::Closed(closed) => closed.tree(),
            Kind::Journals(journals) => journals.ideal(),
        }
    }

    /// The model with its loops, if it has some.
    pub fn closed(&self) -> Option<&ClosedModel> {
        self.with_reactions().filter(|closed| closed.machine().conditions() > 0)
    }

    /// The model that knows the reactions inside the mechanism: with loops, or with friction that follows reactions.
    pub fn with_reactions(&self) -> Option<&ClosedModel> {
        match &self.kind {
            Kind::Tree(_) | Kind::Journals(_) => None,
            Kind::Closed(closed) => Some(closed),
        }
    }

    /// The model whose journals move in their bearings, if it is one.
    pub fn journals(&self) -> Option<&JournalModel> {
        match &self.kind {
            Kind::Tree(_) | Kind::Closed(_) => None,
            Kind::Journals(journals) => Some(journals),
        }
    }

    /// Loads over a block, taken at the reference, N or N m: those that friction follows, or forces on journals; none where no load
    /// matters.
    ///
    /// # Panics
    /// Panics as [`EffortModel::efforts`] does.
    pub fn loads(&self, motion: &MotionBlock<'_>) -> Vec<Vec<f64>> {
        match &self.kind {
            Kind::Tree(_) => Vec::new(),
            Kind::Closed(closed) => closed.load_forces(motion).0.into_iter().flatten().collect(),
            Kind::Journals(journals) => journals.forces(motion),
        }
    }

    /// Returns the model with its loads at other parameters: those that its friction follows, or those on its journals; as it is where
    /// no load matters.
    ///
    /// # Errors
    /// [`LoadError::Value`] for a wrong length.
    pub fn with_load_reference(self, mut reference: LoadReference) -> Result<Self, LoadError> {
        if let Some(ties) = self.ties()
            && reference.linear.len() == self.parameters().linear.len()
            && reference.shape.len() == self.parameters().shape.len()
        {
            ties.complete(&mut reference.linear);
            ties.complete_shape(&mut reference.shape);
        }
        let kind = match self.kind {
            Kind::Tree(tree) => Kind::Tree(tree),
            Kind::Closed(closed) => Kind::Closed(closed.with_load_reference(reference)?),
            Kind::Journals(journals) => Kind::Journals(journals.with_reference(reference)?),
        };
        Ok(RobotModel { kind, ..self })
    }

    /// Returns the model with parameters that follow from others. Shape parameters that follow have bounds that coincide, so that no
    /// search moves them; those that they follow have the bounds that all allow.
    ///
    /// # Errors
    /// [`TieError::KnownShaped`], [`TieError::ShapeRange`].
    ///
    /// # Panics
    /// If a tie names a place that is not in the table.
    pub fn with_ties(mut self, ties: Ties) -> Result<Self, TieError> {
        if ties.is_empty() {
            return Ok(RobotModel { tied: None, ..self });
        }
        let ranges = shape_ranges(self.parameters(), &ties)?;
        let start: Vec<f64> = (self.parameters().shape_start().iter())
            .zip(&ranges)
            .map(|(x, (lower, upper))| x.clamp(*lower, *upper))
            .collect();
        self = self.map_tree(|tree| tree.with_shape_ranges(&ranges));
        self.tied = Some(Box::new(Tied::new(self.model(), ties)?));
        Ok(self.with_shape(&start))
    }

    /// Ties of the parameters, if there are some.
    pub fn ties(&self) -> Option<&Ties> {
        self.tied.as_ref().map(|tied| &tied.ties)
    }

    /// Sets all linear parameters that follow from others.
    ///
    /// # Panics
    /// If `linear` is too short.
    pub fn complete(&self, linear: &mut [f64]) {
        self.ties().into_iter().for_each(|ties| ties.complete(linear));
    }

    /// All linear parameters, those that follow from others as they do.
    fn completed<'a>(&self, linear: &'a [f64]) -> Cow<'a, [f64]> {
        match self.ties() {
            Some(ties) if !ties.linear().is_empty() => {
                let mut own = linear.to_vec();
                ties.complete(&mut own);
                Cow::Owned(own)
            }
            _ => Cow::Borrowed(linear),
        }
    }

    /// All shape parameters, those that follow from others as they do.
    fn whole_shape<'a>(&self, shape: &'a [f64]) -> Cow<'a, [f64]> {
        match self.ties() {
            Some(ties) if !ties.shape().is_empty() => {
                let mut own = shape.to_vec();
                ties.complete_shape(&mut own);
                Cow::Owned(own)
            }
            _ => Cow::Borrowed(shape),
        }
    }

    fn map_tree(self, change: impl FnOnce(TreeModel) -> TreeModel) -> Self {
        let kind = match self.kind {
            Kind::Tree(tree) => Kind::Tree(change(tree)),
            Kind::Closed(closed) => Kind::Closed(closed.map_tree(change)),
            Kind::Journals(journals) => Kind::Journals(journals.map_ideal(change)),
        };
        RobotModel { kind, ..self }
    }

    /// Rate of the tree that an output is the effort of.
    ///
    /// # Panics
    /// If there is no such output.
    pub fn tree_rate(&self, output: usize) -> usize {
        match &self.kind {
            Kind::Tree(_) | Kind::Journals(_) => output,
            Kind::Closed(closed) => closed.machine().driven()[output],
        }
    }

    /// The mechanism; of a closed one its tree.
    pub fn mechanism(&self) -> &Mechanism {
        self.tree().mechanism()
    }

    /// Coordinates without bodies, the last of the rates.
    pub fn coordinates(&self) -> &[Coordinate] {
        self.tree().coordinates()
    }

    /// Limits of the joint or coordinate of an output.
    ///
    /// # Panics
    /// If there is no such output.
    pub fn limits(&self, rate: usize) -> Limits {
        self.tree().limits(self.tree_rate(rate))
    }

    /// Returns the model with other values of its shape parameters; see [`TreeModel::with_shape`]. Loads of a closed model stay
    /// at their reference.
    ///
    /// # Panics
    /// If there is not one value per shape parameter.
    #[must_use]
    pub fn with_shape(self, values: &[f64]) -> Self {
        let values = self.whole_shape(values).into_owned();
        let held: Vec<usize> =
            self.ties().map_or_else(Vec::new, |ties| ties.shape().iter().map(|d| d.index).collect());
        self.map_tree(|tree| tree.with_shape(&values).with_held_shapes(&held))
    }

    /// Returns the model with known elements; see [`TreeModel::with_known`].
    ///
    /// # Panics
    /// Panics as [`TreeModel::with_known`] does.
    #[must_use]
    pub fn with_known(self, known: Vec<KnownElement>) -> Self {
        self.map_tree(|tree| tree.with_known(known))
    }

    /// Returns the model with linear parameters of any sign where `is_free` says so; see [`TreeModel::with_free_sign`].
    #[must_use]
    pub fn with_free_sign(self, is_free: impl Fn(&Parameter) -> bool) -> Self {
        self.map_tree(|tree| tree.with_free_sign(is_free))
    }

    /// Joints (and coordinates without bodies) of the outputs.
    pub fn joints(&self) -> &[JointInfo] {
        match &self.kind {
            Kind::Tree(tree) => tree.joints(),
            Kind::Closed(closed) => closed.joints(),
            Kind::Journals(journals) => journals.ideal().joints(),
        }
    }

    /// Whether part of the effort is known.
    pub fn has_known_elements(&self) -> bool {
        self.tree().has_known_elements()
    }

    /// See [`TreeModel::clearances`].
    pub fn clearances(&self) -> impl Iterator<Item = &ClearanceContact> {
        self.tree().clearances()
    }

    /// See [`TreeModel::clearance_contacts`].
    ///
    /// # Panics
    /// Panics as the function of [`TreeModel`] does.
    pub fn clearance_contacts(&self, linear: &[f64]) -> Vec<(&ClearanceContact, [f64; 3])> {
        self.tree().clearance_contacts(&self.completed(linear))
    }

    /// See [`TreeModel::payloads`].
    pub fn payloads(&self) -> impl Iterator<Item = (&Payload, usize)> {
        self.tree().payloads()
    }

    /// See [`TreeModel::log_columns`].
    pub fn log_columns(&self) -> std::ops::Range<usize> {
        self.tree().log_columns()
    }

    /// See [`TreeModel::elastic_motor`].
    pub fn elastic_motor(&self, link: usize) -> Option<(usize, f64)> {
        self.tree().elastic_motor(link)
    }

    /// See [`TreeModel::elastic_link`].
    pub fn elastic_link(&self, motor: usize) -> Option<(usize, f64)> {
        self.tree().elastic_link(motor)
    }

    /// See [`TreeModel::elastic_transmissions`].
    ///
    /// # Panics
    /// Panics as the function of [`TreeModel`] does.
    pub fn elastic_transmissions(&self, linear: &[f64]) -> Vec<(&ElasticTransmission, Vec<f64>)> {
        self.tree().elastic_transmissions(&self.completed(linear))
    }

    /// See [`TreeModel::element_jets`].
    ///
    /// # Errors
    /// Fails as the function of [`TreeModel`] does.
    ///
    /// # Panics
    /// Panics as the function of [`TreeModel`] does.
    pub fn element_jets(
        &self,
        motion: &JetMotion<'_>,
        shape: &[f64],
        linear: &[f64],
        wanted: impl Fn(usize) -> bool,
        effort: &mut [Jet],
    ) -> Result<(), String> {
        let (shape, linear) = (self.whole_shape(shape), self.completed(linear));
        self.tree().element_jets(motion, &shape, &linear, wanted, effort)
    }

    /// Passivity of the friction of an output's joint; see [`TreeModel::friction_passivity`].
    ///
    /// # Panics
    /// Panics as the function of [`TreeModel`] does.
    pub fn friction_passivity(
        &self,
        rate: usize,
        shape: &[f64],
        linear: &[f64],
        range: (f64, f64),
        held: &[(&str, f64)],
    ) -> FrictionPassivity {
        let (shape, linear) = (self.whole_shape(shape), self.completed(linear));
        self.tree().friction_passivity(self.tree_rate(rate), &shape, &linear, range, held)
    }

    /// Columns of the friction of an output's joint over a motion of the tree; see [`TreeModel::friction_columns`].
    ///
    /// # Panics
    /// Panics as the function of [`TreeModel`] does.
    pub fn friction_columns(
        &self,
        rate: usize,
        shape: &[f64],
        motion: &MotionBlock<'_>,
    ) -> Vec<(usize, Vec<f64>)> {
        self.tree().friction_columns(self.tree_rate(rate), &self.whole_shape(shape), motion)
    }

    /// Friction of an output's joint over velocities; see [`TreeModel::friction_effort`].
    ///
    /// # Panics
    /// Panics as the function of [`TreeModel`] does.
    pub fn friction_effort(
        &self,
        rate: usize,
        shape: &[f64],
        linear: &[f64],
        velocities: &[f64],
        held: &[(&str, f64)],
    ) -> Vec<f64> {
        let (shape, linear) = (self.whole_shape(shape), self.completed(linear));
        self.tree().friction_effort(self.tree_rate(rate), &shape, &linear, velocities, held)
    }

    fn model(&self) -> &dyn EffortModel {
        match &self.kind {
            Kind::Tree(tree) => tree,
            Kind::Closed(closed) => closed,
            Kind::Journals(journals) => journals,
        }
    }
}

impl EffortModel for RobotModel {
    fn outputs(&self) -> &[Output] {
        self.model().outputs()
    }

    fn parameters(&self) -> &ParameterTable {
        self.tree().parameters()
    }

    fn layout(&self) -> &Arc<RegressorLayout> {
        self.tied.as_ref().map_or_else(|| self.model().layout(), |tied| &tied.layout)
    }

    fn channels(&self) -> &[String] {
        self.model().channels()
    }

    fn signals(&self) -> &[String] {
        self.model().signals()
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
        self.model().remember(motion, step_s, &self.whole_shape(shape), history, stride, out);
    }

    fn random_motion(&self, samples: usize, seed: u64) -> RandomMotion {
        self.model().random_motion(samples, seed)
    }

    fn dimensions(&self) -> (usize, usize) {
        self.model().dimensions()
    }

    fn travels(&self) -> &[f64] {
        self.model().travels()
    }

    fn is_undriven(&self, output: usize) -> bool {
        self.model().is_undriven(output)
    }

    fn reversal_speeds(&self, output: usize) -> Vec<Vec<(usize, f64)>> {
        self.model().reversal_speeds(output)
    }

    fn regressor(&self, motion: &MotionBlock<'_>, shape: &[f64], out: &mut RegressorBlock) {
        match &self.tied {
            None => self.model().regressor(motion, shape, out),
            Some(tied) => tied.regressor(self.model(), motion, &self.whole_shape(shape), out),
        }
    }

    fn shaped_columns(&self) -> &[(usize, usize)] {
        self.tied.as_ref().map_or_else(|| self.model().shaped_columns(), |tied| &tied.shaped)
    }

    fn shape_dependence(&self) -> &[(usize, usize)] {
        self.tied.as_ref().map_or_else(|| self.model().shape_dependence(), |tied| &tied.dependence)
    }

    fn shaped(
        &self,
        motion: &MotionBlock<'_>,
        shape: &[f64],
        stride: usize,
        values: &mut [f64],
        derivatives: &mut [f64],
    ) {
        match &self.tied {
            None => self.model().shaped(motion, shape, stride, values, derivatives),
            Some(tied) => {
                tied.shaped(self.model(), motion, &self.whole_shape(shape), stride, values, derivatives);
            }
        }
    }

    fn efforts(
        &self,
        motion: &MotionBlock<'_>,
        shape: &[f64],
        linear: &[f64],
        stride: usize,
        effort: &mut [f64],
    ) {
        let (shape, linear) = (self.whole_shape(shape), self.completed(linear));
        self.model().efforts(motion, &shape, &linear, stride, effort);
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
        let (shape, linear) = (self.whole_shape(shape), self.completed(linear));
        self.model().effort_adjoint(motion, &shape, &linear, stride, weights, out);
    }

    fn regressor_adjoint(
        &self,
        motion: &MotionBlock<'_>,
        shape: &[f64],
        weights: &RegressorBlock,
        out: &mut MotionAdjoint,
    ) {
        match &self.tied {
            None => self.model().regressor_adjoint(motion, shape, weights, out),
            Some(tied) => {
                let weights = tied.spread(self.model(), weights);
                self.model().regressor_adjoint(motion, &self.whole_shape(shape), &weights, out);
            }
        }
    }
}

/// Bounds of shape parameters, those of free ones with what follows from them within its own.
fn shape_ranges(table: &ParameterTable, ties: &Ties) -> Result<Vec<(f64, f64)>, TieError> {
    let mut ranges: Vec<(f64, f64)> = table.shape.iter().map(|s| (s.lower, s.upper)).collect();
    for dependent in ties.shape() {
        let own = &table.shape[dependent.index];
        let fault =
            |(lower, upper): (f64, f64)| TieError::ShapeRange { parameter: own.name.clone(), lower, upper };
        match dependent.multiple() {
            None => {
                let left = (own.lower.max(dependent.constant), own.upper.min(dependent.constant));
                if left.0 > left.1 {
                    return Err(fault(left));
                }
            }
            Some((free, factor)) => {
                let (a, b) = (own.lower / factor, own.upper / factor);
                let range = &mut ranges[free];
                *range = (range.0.max(a.min(b)), range.1.min(a.max(b)));
                if range.0 > range.1 {
                    return Err(fault(*range));
                }
            }
        }
    }
    Ok(ranges)
}
