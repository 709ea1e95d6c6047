//! Friction that follows reactions: the forces that press on joints, and how they change with the parameters.

use super::ClosedModel;
use super::expand::Expanded;
use super::reactions::{Reaction, ReactionShares, Reactions};
use crate::dynamics::MotionBlock;
use crate::effort_model::{EffortModel, RegressorBlock};
use crate::element::{reaction_channel, weight_channel};

/// Some components of one force, which press together.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadGroup {
    /// Components; their Euclidean length counts.
    pub components: Vec<Reaction>,
    /// Factor: 1 for the force itself, a radius (m) for its moment of friction about a pin.
    pub factor: f64,
}

/// What presses on a joint with [`ReactionFriction`](crate::element::ReactionFriction):
/// `F = Σ factor · ‖components‖` and the steady `F_w = constant + Σ factor · parameter`.
#[derive(Clone, Debug, PartialEq)]
pub struct JointLoad {
    /// Rate of the tree.
    pub rate: usize,
    /// The reaction.
    pub reactions: Vec<LoadGroup>,
    /// Linear parameters (columns) in the steady force, and their factors.
    pub weight: Vec<(usize, f64)>,
    /// Steady force that depends on no parameter, N or N m.
    pub constant: f64,
}

/// Parameters at which loads are taken.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadReference {
    /// Linear parameters.
    pub linear: Vec<f64>,
    /// Shape parameters.
    pub shape: Vec<f64>,
    /// Whether the regressor tells how friction changes with the loads' own parameters (Gauss-Newton): its columns are
    /// then the derivatives of the effort at the reference, its offset what makes up for that there; of friction that acts on
    /// its own loads (in joints without drive) only the first round counts, which leaves a few per cent of its share.
    /// Otherwise loads are frozen.
    pub linearised: bool,
}

/// Fault of loads.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LoadError {
    /// No friction at the joint that follows a reaction, or none to feed it.
    #[error("joint `{joint}`: {fault}")]
    Joint {
        /// Joint.
        joint: String,
        /// What is wrong.
        fault: &'static str,
    },
    /// A length that does not fit, or a number that is not finite.
    #[error("{what}: expected {expected}, found {found}")]
    Value {
        /// Name of the value.
        what: &'static str,
        /// What it should be.
        expected: String,
        /// What it is.
        found: String,
    },
}

/// Relative change of loads at which friction that acts on its own loads is settled.
const SETTLED: f64 = 1e-12;
const ROUNDS: usize = 50;

#[derive(Debug)]
pub(super) struct Loads {
    joints: Vec<JointLoad>,
    reference: LoadReference,
    reactions: Reactions,
    /// Columns of the coefficients of every joint's friction.
    coefficients: Vec<Vec<usize>>,
    channels: Vec<[String; 2]>,
    /// Some friction changes reactions that loads depend on.
    acts_on_itself: bool,
}

impl Loads {
    fn new(
        model: &ClosedModel,
        joints: Vec<JointLoad>,
        reference: LoadReference,
    ) -> Result<Loads, LoadError> {
        let (tree, machine) = (&model.tree, &model.machine);
        let names = tree.joints();
        let fault = |rate: usize, fault| LoadError::Joint { joint: names[rate].name.clone(), fault };
        let length = |what, expected: usize, found: usize| LoadError::Value {
            what,
            expected: expected.to_string(),
            found: found.to_string(),
        };
        let table = tree.parameters();
        let (linear, shape) = (table.linear.len(), table.shape.len());
        if reference.linear.len() != linear {
            return Err(length("linear parameters of the reference", linear, reference.linear.len()));
        }
        if reference.shape.len() != shape {
            return Err(length("shape parameters of the reference", shape, reference.shape.len()));
        }
        let mut coefficients = Vec::new();
        for (k, load) in joints.iter().enumerate() {
            if joints[..k].iter().any(|other| other.rate == load.rate) {
                return Err(fault(load.rate, "expected one load, found two"));
            }
            let Some(friction) = tree.reaction_frictions().find(|f| f.element.law.rate == load.rate) else {
                return Err(fault(load.rate, "a load, but no friction that follows a reaction"));
            };
            coefficients.push(friction.columns);
            let numbers = load.weight.iter().map(|w| w.1).chain(load.reactions.iter().map(|g| g.factor));
            if let Some(x) = numbers.chain([load.constant]).find(|x| !x.is_finite() || *x < 0.0) {
                return Err(LoadError::Value {
                    what: "factor of a load",
                    expected: "a finite number, not negative".to_owned(),
                    found: x.to_string(),
                });
            }
        }
        for friction in tree.reaction_frictions() {
            if joints.iter().all(|load| load.rate != friction.element.law.rate) {
                return Err(fault(
                    friction.element.law.rate,
                    "friction that follows a reaction, but no load",
                ));
            }
        }
        let list: Vec<Reaction> =
            joints.iter().flat_map(|j| &j.reactions).flat_map(|g| g.components.iter().copied()).collect();
        let channels = joints.iter().map(|j| {
            let name = &names[j.rate].name;
            [reaction_channel(name), weight_channel(name)]
        });
        let absorbed =
            |rate: &usize| machine.driven().contains(rate) && machine.driven().len() == machine.mobility();
        Ok(Loads {
            acts_on_itself: joints.iter().any(|j| !j.reactions.is_empty() && !absorbed(&j.rate)),
            channels: channels.collect(),
            reactions: model.reactions(&list),
            coefficients,
            reference,
            joints,
        })
    }
}

impl Loads {
    pub(super) fn is_linearised(&self) -> bool {
        self.reference.linearised
    }
}

impl ClosedModel {
    /// Feeds friction that follows reactions with the loads on its joints, taken at given parameters.
    ///
    /// Every [`ReactionFriction`](crate::element::ReactionFriction) of the tree needs its load. Friction in joints without
    /// drive changes the reactions that it follows; it is then found by iteration for every block.
    ///
    /// # Errors
    /// [`LoadError`].
    ///
    /// # Panics
    /// If a reaction or a column does not exist.
    pub fn with_loads(mut self, joints: Vec<JointLoad>, reference: LoadReference) -> Result<Self, LoadError> {
        let loads = Loads::new(&self, joints, reference)?;
        self.feed(loads);
        Ok(self)
    }

    pub(super) fn feed(&mut self, loads: Loads) {
        let own = |name: &String| loads.channels.iter().flatten().any(|c| c == name);
        self.channels = self.tree.channels().iter().filter(|c| !own(c)).cloned().collect();
        self.loads = Some(loads);
    }

    /// Returns the model with its loads at other parameters.
    ///
    /// # Errors
    /// [`LoadError::Value`] for a wrong length.
    pub fn with_load_reference(mut self, reference: LoadReference) -> Result<Self, LoadError> {
        match self.loads.take() {
            None => Ok(self),
            Some(loads) => self.with_loads(loads.joints, reference),
        }
    }

    /// Loads on joints whose friction follows them; none without [`ClosedModel::with_loads`].
    pub fn loads(&self) -> &[JointLoad] {
        self.loads.as_ref().map_or(&[], |l| &l.joints)
    }

    /// Forces `F` and `F_w` of every load over a block, at the parameters of the reference, and the largest relative change
    /// in the last round of an iteration (0 without one).
    pub fn load_forces(&self, motion: &MotionBlock<'_>) -> (Vec<[Vec<f64>; 2]>, f64) {
        let pressed = self.pressed(motion);
        (pressed.forces, pressed.change)
    }

    /// Motion of all joints, and the forces on them.
    pub(super) fn prepared(&self, motion: &MotionBlock<'_>) -> (Expanded, Pressed<'_>) {
        let Some(loads) = &self.loads else { return (self.expand(motion), Pressed::nothing()) };
        let (expanded, shares) = self.expand_reactions(motion, &loads.reactions);
        let pressed = self.press(loads, motion, &expanded, &shares);
        (expanded, pressed)
    }

    /// The forces alone.
    pub(super) fn pressed(&self, motion: &MotionBlock<'_>) -> Pressed<'_> {
        if self.loads.is_some() { self.prepared(motion).1 } else { Pressed::nothing() }
    }

    fn press<'a>(
        &self,
        loads: &'a Loads,
        motion: &MotionBlock<'_>,
        expanded: &Expanded,
        shares: &ReactionShares<'_>,
    ) -> Pressed<'a> {
        let n = motion.samples;
        let LoadReference { linear, shape, linearised } = &loads.reference;
        let weight = |j: &JointLoad| {
            let steady: f64 = j.weight.iter().map(|(column, factor)| factor * linear[*column]).sum();
            vec![(j.constant + steady).max(0.0); n]
        };
        let forces = loads.joints.iter().map(|j| [vec![0.0; n], weight(j)]).collect();
        let mut pressed = Pressed { loads: Some(loads), forces, gradients: Vec::new(), change: 0.0 };
        let mut tree = vec![0.0; self.machine.mechanism().rates() * n];
        let mut values = vec![vec![0.0; n]; loads.reactions.list().len()];
        for _ in 0..ROUNDS {
            expanded.with_block(motion, &pressed.channels(), |block| {
                self.tree.efforts(block, shape, linear, n, &mut tree);
            });
            for (k, to) in values.iter_mut().enumerate() {
                shares.values(k, &tree, linear, to);
            }
            pressed.change = pressed.take(&values);
            if !loads.acts_on_itself || pressed.change <= SETTLED {
                break;
            }
        }
        if *linearised {
            let mut regressor = RegressorBlock::new(self.tree.layout().clone(), n);
            let mut rows = RegressorBlock::new(loads.reactions.layout().clone(), n);
            expanded.with_block(motion, &pressed.channels(), |block| {
                self.tree.regressor(block, shape, &mut regressor);
            });
            shares.regressor(&regressor, &mut rows);
            pressed.gradients = gradients(loads, &values, &rows);
        }
        pressed
    }
}

/// Forces on the joints over a block.
pub(super) struct Pressed<'a> {
    loads: Option<&'a Loads>,
    /// `F` and `F_w` of every joint.
    forces: Vec<[Vec<f64>; 2]>,
    /// `∂F/∂parameter` of every joint, and its columns; empty unless linearised.
    gradients: Vec<Vec<(usize, Vec<f64>)>>,
    change: f64,
}

impl Pressed<'_> {
    fn nothing() -> Self {
        Pressed { loads: None, forces: Vec::new(), gradients: Vec::new(), change: 0.0 }
    }

    /// Channels that elements read.
    pub(super) fn channels(&self) -> Vec<(&str, &[f64])> {
        let names = self.loads.into_iter().flat_map(|l| l.channels.iter().flatten());
        let forces = self.forces.iter().flatten();
        names.zip(forces).map(|(name, force)| (name.as_str(), force.as_slice())).collect()
    }

    /// Takes values of all components; largest change relative to the largest force.
    fn take(&mut self, values: &[Vec<f64>]) -> f64 {
        let Some(loads) = self.loads else { return 0.0 };
        let (mut change, mut largest) = (0.0_f64, 0.0_f64);
        let mut first = 0;
        for (joint, [force, _]) in loads.joints.iter().zip(&mut self.forces) {
            for (s, force) in force.iter_mut().enumerate() {
                let mut sum = 0.0;
                let mut at = first;
                for group in &joint.reactions {
                    sum += group.factor * length(values, (at, group.components.len()), s);
                    at += group.components.len();
                }
                if sum.is_finite() {
                    change = change.max((sum - *force).abs());
                    largest = largest.max(sum);
                }
                *force = sum;
            }
            first += joint.reactions.iter().map(|g| g.components.len()).sum::<usize>();
        }
        if largest > 0.0 { change / largest } else { 0.0 }
    }

    /// Adds to a regressor how friction changes with the parameters of its loads.
    pub(super) fn linearise(
        &self,
        model: &ClosedModel,
        motion: &MotionBlock<'_>,
        expanded: &Expanded,
        out: &mut RegressorBlock,
    ) {
        let Some(loads) = self.loads else { return };
        let LoadReference { linear, shape, linearised } = &loads.reference;
        if !linearised {
            return;
        }
        let n = motion.samples;
        for (k, load) in loads.joints.iter().enumerate() {
            let Some(friction) = model.tree.reaction_frictions().find(|f| f.element.law.rate == load.rate)
            else {
                continue;
            };
            let shape = &shape[friction.shape.clone()];
            let mu: Vec<f64> = loads.coefficients[k].iter().map(|c| linear[*c]).collect();
            let speeds = &expanded.dq[load.rate * n..][..n];
            let per_force: Vec<[f64; 2]> =
                speeds.iter().map(|v| friction.element.per_force(motion, *v, shape, &mu)).collect();
            let mut add = |column: usize, values: &dyn Fn(usize) -> f64| {
                for output in 0..model.outputs.len() {
                    let share = expanded.share(output, load.rate);
                    let Ok(place) = model.fold.layout.columns(output).binary_search(&column) else {
                        continue;
                    };
                    let change: Vec<f64> = (0..n).map(|s| share[s] * values(s)).collect();
                    let factor = linear[column];
                    out.column_mut(output, place).iter_mut().zip(&change).for_each(|(t, x)| *t += x);
                    out.offset_mut(output).iter_mut().zip(&change).for_each(|(t, x)| *t -= factor * x);
                }
            };
            for (column, gradient) in &self.gradients[k] {
                add(*column, &|s| per_force[s][0] * gradient[s]);
            }
            for (column, factor) in &load.weight {
                add(*column, &|s| per_force[s][1] * factor);
            }
        }
    }
}

fn length(values: &[Vec<f64>], (first, count): (usize, usize), sample: usize) -> f64 {
    match count {
        1 => values[first][sample].abs(),
        _ => values[first..first + count].iter().map(|v| v[sample] * v[sample]).sum::<f64>().sqrt(),
    }
}

/// `∂F/∂parameter = Σ factor Σ_c (ρ_c/‖ρ‖) ∂ρ_c/∂parameter`, per joint and column.
fn gradients(loads: &Loads, values: &[Vec<f64>], rows: &RegressorBlock) -> Vec<Vec<(usize, Vec<f64>)>> {
    let mut first = 0;
    let mut out = Vec::with_capacity(loads.joints.len());
    for joint in &loads.joints {
        let mut columns: Vec<(usize, Vec<f64>)> = Vec::new();
        for group in &joint.reactions {
            let count = group.components.len();
            for k in first..first + count {
                for (c, column) in rows.layout().columns(k).iter().enumerate() {
                    let place = match columns.iter().position(|(own, _)| own == column) {
                        Some(place) => place,
                        None => {
                            columns.push((*column, vec![0.0; rows.samples()]));
                            columns.len() - 1
                        }
                    };
                    for (s, (to, entry)) in columns[place].1.iter_mut().zip(rows.column(k, c)).enumerate() {
                        let whole = length(values, (first, count), s);
                        let direction = if whole > 0.0 { values[k][s] / whole } else { 0.0 };
                        *to += group.factor * direction * entry;
                    }
                }
            }
            first += count;
        }
        out.push(columns);
    }
    out
}
