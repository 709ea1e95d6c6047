//! Friction that follows reactions: the forces that press on joints, and how they change with the parameters.

use std::sync::Arc;

use super::ClosedModel;
use super::expand::Expanded;
use super::fold::Fold;
use super::paths::Path;
use super::reactions::{Reaction, ReactionShares, Reactions};
use crate::closed::factor::Factor;
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
    /// then the derivatives of the effort at the reference, its offset what makes up for that there. Otherwise loads are
    /// frozen.
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
/// Largest such change, per sample, of what counts as a number: friction of which more comes back as load than it was does
/// not settle, it locks.
const LOCKED: f64 = 1e-9;
const ROUNDS: usize = 50;

#[derive(Debug)]
pub(super) struct Loads {
    joints: Vec<JointLoad>,
    reference: LoadReference,
    reactions: Arc<Reactions>,
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
            let Some(friction) = tree.reaction_frictions().find(|f| f.rate() == load.rate) else {
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
            if joints.iter().all(|load| load.rate != friction.rate()) {
                return Err(fault(friction.rate(), "friction that follows a reaction, but no load"));
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
            reactions: Arc::new(model.reactions(&list)),
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

    /// Columns that act on friction through loads, of the loads on some rates; of all loads where they act on each other.
    fn columns(&self, feels: impl Fn(usize) -> bool) -> Vec<usize> {
        let mut out = Vec::new();
        let mut first = 0;
        for load in &self.joints {
            let count: usize = load.reactions.iter().map(|g| g.components.len()).sum();
            if self.acts_on_itself || feels(load.rate) {
                (first..first + count)
                    .for_each(|k| out.extend_from_slice(self.reactions.layout().columns(k)));
                out.extend(load.weight.iter().map(|w| w.0));
            }
            first += count;
        }
        out
    }
}

impl ClosedModel {
    /// Feeds friction that follows reactions with the loads on its joints, taken at given parameters.
    ///
    /// Every [`ReactionFriction`](crate::element::ReactionFriction) of the tree needs its load. Friction in joints without
    /// drive changes the reactions that it follows; it is then found by iteration for every block. Where that does not settle
    /// (friction locks the joint) forces, and efforts, are not numbers.
    ///
    /// # Errors
    /// [`LoadError`].
    ///
    /// # Panics
    /// If a reaction or a column does not exist.
    pub fn with_loads(mut self, joints: Vec<JointLoad>, reference: LoadReference) -> Result<Self, LoadError> {
        let loads = Loads::new(&self, joints, reference)?;
        self.paths = Arc::default();
        self.feed(loads);
        Ok(self)
    }

    pub(super) fn feed(&mut self, loads: Loads) {
        let own = |name: &String| loads.channels.iter().flatten().any(|c| c == name);
        self.channels = self.tree.channels().iter().filter(|c| !own(c)).cloned().collect();
        let further = |output: usize| match loads.is_linearised() {
            true => {
                let felt: Vec<usize> = self.fold.rates(output).collect();
                loads.columns(|rate| felt.contains(&rate))
            }
            false => Vec::new(),
        };
        let further: Vec<Vec<usize>> = (0..self.outputs.len()).map(further).collect();
        self.fold = Fold::new(&self.tree, &self.machine, &further);
        self.loads = Some(loads);
    }

    /// Returns the model with its loads at other parameters.
    ///
    /// # Errors
    /// [`LoadError::Value`] for a wrong length.
    pub fn with_load_reference(mut self, reference: LoadReference) -> Result<Self, LoadError> {
        match self.loads.take() {
            None => Ok(self),
            Some(loads) => {
                // The same reactions: what is known of motions stays.
                let loads = Loads::new(&self, loads.joints, reference)?;
                self.feed(loads);
                Ok(self)
            }
        }
    }

    /// Loads on joints whose friction follows them; none without [`ClosedModel::with_loads`].
    pub fn loads(&self) -> &[JointLoad] {
        self.loads.as_ref().map_or(&[], |l| &l.joints)
    }

    /// Forces `F` and `F_w` of every load over a block, at the parameters of the reference, and the largest relative change
    /// in the last round of an iteration (0 without one).
    pub fn load_forces(&self, motion: &MotionBlock<'_>) -> (Vec<[Vec<f64>; 2]>, f64) {
        let pressed = self.prepared(motion).1;
        (pressed.forces, pressed.change)
    }

    /// Motion of all joints, and the forces on them.
    pub(super) fn prepared(&self, motion: &MotionBlock<'_>) -> (Arc<Path>, Pressed<'_>) {
        self.prepared_with(motion, false)
    }

    /// Motion of all joints, the forces on them, and how they change with the parameters if the model tells.
    pub(super) fn prepared_linearised(&self, motion: &MotionBlock<'_>) -> (Arc<Path>, Pressed<'_>) {
        self.prepared_with(motion, true)
    }

    fn prepared_with(&self, motion: &MotionBlock<'_>, changes: bool) -> (Arc<Path>, Pressed<'_>) {
        let path = self.paths.of(motion, self.machine.mobility(), || match &self.loads {
            None => Path { expanded: self.expand(motion), shares: None },
            Some(loads) => {
                let (expanded, shares) = self.expand_reactions(motion, &loads.reactions);
                Path { expanded, shares: Some(shares) }
            }
        });
        let pressed = match (&self.loads, &path.shares) {
            (Some(loads), Some(shares)) => self.press(loads, motion, (&path.expanded, shares), changes),
            _ => Pressed::nothing(),
        };
        (path, pressed)
    }

    /// The forces alone.
    pub(super) fn pressed(&self, motion: &MotionBlock<'_>) -> Pressed<'_> {
        if self.loads.is_some() { self.prepared_linearised(motion).1 } else { Pressed::nothing() }
    }

    fn press<'a>(
        &self,
        loads: &'a Loads,
        motion: &MotionBlock<'_>,
        (expanded, shares): (&Expanded, &ReactionShares),
        changes: bool,
    ) -> Pressed<'a> {
        let n = motion.samples;
        let LoadReference { linear, shape, linearised } = &loads.reference;
        let weight = |j: &JointLoad| {
            let steady: f64 = j.weight.iter().map(|(column, factor)| factor * linear[*column]).sum();
            vec![(j.constant + steady).max(0.0); n]
        };
        let forces = loads.joints.iter().map(|j| [vec![0.0; n], weight(j)]).collect();
        let nothing = Gradients::default();
        let mut pressed =
            Pressed { loads: Some(loads), forces, slopes: Vec::new(), gradients: nothing, change: 0.0 };
        let mut tree = vec![0.0; self.machine.mechanism().rates() * n];
        let mut values = vec![vec![0.0; n]; loads.reactions.list().len()];
        for round in 1..=ROUNDS {
            expanded.with_block(motion, &pressed.channels(), |block| {
                self.tree.efforts(block, shape, linear, n, &mut tree);
            });
            for (k, to) in values.iter_mut().enumerate() {
                shares.values(k, &tree, linear, to);
            }
            pressed.change = pressed.take(&values, round == ROUNDS);
            if !loads.acts_on_itself || pressed.change <= SETTLED {
                break;
            }
        }
        if *linearised && changes {
            let mut regressor = RegressorBlock::new(self.tree.layout().clone(), n);
            let mut rows = RegressorBlock::new(loads.reactions.layout().clone(), n);
            expanded.with_block(motion, &pressed.channels(), |block| {
                self.tree.regressor(block, shape, &mut regressor);
            });
            shares.regressor(&regressor, &mut rows);
            pressed.slopes = self.slopes(loads, motion, expanded);
            pressed.gradients = Gradients::of(loads, &values, &rows, (shares, &pressed.slopes));
        }
        pressed
    }
}

impl ClosedModel {
    /// Friction per unit of `F` and of `F_w` of every load, per sample.
    fn slopes(&self, loads: &Loads, motion: &MotionBlock<'_>, expanded: &Expanded) -> Vec<Vec<[f64; 2]>> {
        let LoadReference { linear, shape, .. } = &loads.reference;
        let of = |(load, columns): (&JointLoad, &Vec<usize>)| {
            let Some(friction) = self.tree.reaction_frictions().find(|f| f.rate() == load.rate) else {
                unreachable!("every load has its friction");
            };
            let mu: Vec<f64> = columns.iter().map(|c| linear[*c]).collect();
            let speeds = &expanded.dq[load.rate * motion.samples..][..motion.samples];
            let shape = friction.shape(shape);
            speeds.iter().map(|v| friction.element.law.per_force(motion, *v, shape, &mu)).collect()
        };
        loads.joints.iter().zip(&loads.coefficients).map(of).collect()
    }
}

/// Forces on the joints over a block.
pub(super) struct Pressed<'a> {
    loads: Option<&'a Loads>,
    /// `F` and `F_w` of every joint.
    forces: Vec<[Vec<f64>; 2]>,
    /// Friction per unit of them; empty unless linearised.
    slopes: Vec<Vec<[f64; 2]>>,
    gradients: Gradients,
    change: f64,
}

impl Pressed<'_> {
    fn nothing() -> Self {
        let (slopes, gradients) = (Vec::new(), Gradients::default());
        Pressed { loads: None, forces: Vec::new(), slopes, gradients, change: 0.0 }
    }

    /// Channels that elements read.
    pub(super) fn channels(&self) -> Vec<(&str, &[f64])> {
        let names = self.loads.into_iter().flat_map(|l| l.channels.iter().flatten());
        let forces = self.forces.iter().flatten();
        names.zip(forces).map(|(name, force)| (name.as_str(), force.as_slice())).collect()
    }

    /// Takes values of all components; largest change relative to the largest force. In the `last` round what has not settled
    /// becomes no number.
    fn take(&mut self, values: &[Vec<f64>], last: bool) -> f64 {
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
                let moved = (sum - *force).abs();
                if sum.is_finite() {
                    change = change.max(moved);
                    largest = largest.max(sum);
                }
                *force = if last && loads.acts_on_itself && moved > LOCKED * sum { f64::NAN } else { sum };
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
        if !loads.is_linearised() {
            return;
        }
        let (n, linear) = (motion.samples, &loads.reference.linear);
        let mut change = vec![0.0; n];
        for (k, load) in loads.joints.iter().enumerate() {
            let slopes = &self.slopes[k];
            let mut add = |column: usize, values: &dyn Fn(usize) -> f64| {
                for output in 0..model.outputs.len() {
                    let Ok(place) = model.fold.layout.columns(output).binary_search(&column) else {
                        // Loads on other drives alone.
                        continue;
                    };
                    let share = expanded.share(output, load.rate);
                    change.iter_mut().enumerate().for_each(|(s, x)| *x = share[s] * values(s));
                    let factor = linear[column];
                    out.column_mut(output, place).iter_mut().zip(&change).for_each(|(t, x)| *t += x);
                    out.offset_mut(output).iter_mut().zip(&change).for_each(|(t, x)| *t -= factor * x);
                }
            };
            for (c, column) in self.gradients.columns.iter().enumerate() {
                let gradient = self.gradients.of_load(k, c, n);
                add(*column, &|s| slopes[s][0] * gradient[s]);
            }
            for (column, factor) in &load.weight {
                add(*column, &|s| slopes[s][1] * factor);
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

/// How forces `F` on joints change with the parameters.
#[derive(Default)]
struct Gradients {
    /// Columns that some force depends on.
    columns: Vec<usize>,
    /// `∂F/∂parameter`, `[(load * columns + column) * samples + s]`.
    data: Vec<f64>,
}

impl Gradients {
    /// `∂F_i/∂π = A_iπ + Σ_j B_ij ∂F_j/∂π`, so `∂F/∂π = (1 - B)⁻¹ A`. `A` follows from the reactions at given friction,
    /// `ρ/‖ρ‖ · ∂ρ/∂π`, that of friction by steady forces included; `B_ij` is the part of a unit of `F_j` that comes back through
    /// its friction as load on `i`.
    fn of(
        loads: &Loads,
        values: &[Vec<f64>],
        rows: &RegressorBlock,
        (shares, slopes): (&ReactionShares, &[Vec<[f64; 2]>]),
    ) -> Gradients {
        let (n, count) = (rows.samples(), loads.joints.len());
        let mut columns = loads.columns(|_| true);
        columns.sort_unstable();
        columns.dedup();
        let place = |column: &usize| columns.partition_point(|own| own < column);
        let width = columns.len();
        let mut data = vec![0.0; count * width * n];
        let mut back = vec![0.0; count * count * n];
        let mut direction = vec![0.0; n];
        let mut first = 0;
        for (i, joint) in loads.joints.iter().enumerate() {
            for group in &joint.reactions {
                let components = group.components.len();
                for k in first..first + components {
                    for (s, to) in direction.iter_mut().enumerate() {
                        let whole = length(values, (first, components), s);
                        *to = if whole > 0.0 { group.factor * values[k][s] / whole } else { 0.0 };
                    }
                    for (c, column) in rows.layout().columns(k).iter().enumerate() {
                        let to = data[(i * width + place(column)) * n..][..n].iter_mut();
                        to.zip(&direction).zip(rows.column(k, c)).for_each(|((to, d), x)| *to += d * x);
                    }
                    if !loads.acts_on_itself {
                        continue;
                    }
                    for (j, other) in loads.joints.iter().enumerate() {
                        let share = shares.share(k, other.rate);
                        for (s, to) in back[(i * count + j) * n..][..n].iter_mut().enumerate() {
                            *to += direction[s] * share[s] * slopes[j][s][0];
                        }
                        for (column, factor) in &other.weight {
                            let to = &mut data[(i * width + place(column)) * n..][..n];
                            for (s, to) in to.iter_mut().enumerate() {
                                *to += direction[s] * share[s] * slopes[j][s][1] * factor;
                            }
                        }
                    }
                }
                first += components;
            }
        }
        let mut out = Gradients { columns, data };
        if loads.acts_on_itself {
            out.take_back(count, n, &back);
        }
        out
    }

    /// Solves `(1 - B) x = A` in place, sample by sample.
    fn take_back(&mut self, count: usize, samples: usize, back: &[f64]) {
        let width = self.columns.len();
        let (mut factor, mut right) = (Factor::default(), vec![0.0; count * width]);
        let mut solution = right.clone();
        for s in 0..samples {
            let one = |i: usize, j: usize| if i == j { 1.0 } else { 0.0 };
            factor.factor(count, count, |i, j| one(i, j) - back[(i * count + j) * samples + s]);
            right.iter_mut().zip(self.data.iter().skip(s).step_by(samples)).for_each(|(to, x)| *to = *x);
            factor.solve_many(width, &right, &mut solution);
            self.data.iter_mut().skip(s).step_by(samples).zip(&solution).for_each(|(to, x)| *to = *x);
        }
    }

    fn of_load(&self, load: usize, column: usize, samples: usize) -> &[f64] {
        &self.data[(load * self.columns.len() + column) * samples..][..samples]
    }
}
