//! Greedy search over friction shapes, joint by joint.

use std::collections::BTreeMap;

use dynid_linalg::Mat;
use rayon::prelude::*;

use super::losses::{Losses, RowsOf};
use super::{JointFriction, ShapeTrial};
use crate::conditioning::base_prior::BasePrior;
use crate::conditioning::friction_shape::{FrictionShape, ShapeKind};
use crate::conditioning::gram::{Group, Normal, rss, solve};
use crate::conditioning::trial::{BlockSums, Trial};
use crate::conditioning::{Conditioning, ConditioningSettings};

/// A candidate that keeps less than this part of its sum of squares beside the other columns is one of them.
const COLLINEAR: f64 = 1e-6;
/// Fewest standard errors that a gain must be of, however much its kind is expected.
const LEAST_SIGMAS: f64 = 0.3;
/// Standard errors from which on the whole share of the loss must be gained.
const FULL_SIGMAS: f64 = 1.4;
/// Rounds in which joints without a shape are asked for one.
const ROUNDS: usize = 3;
/// Rounds in which every shape may be replaced by a better one.
const REPLACEMENTS: usize = 2;

/// Rungs and shapes of a fit.
#[derive(Debug, Clone)]
struct Fit {
    rung: Vec<usize>,
    /// Per output: places in its library.
    shapes: Vec<Vec<usize>>,
}

/// A candidate on held-out blocks.
struct Scored {
    place: usize,
    losses: Losses,
}

pub(super) struct Search<'a> {
    trial: &'a Trial,
    library: &'a [Vec<FrictionShape>],
    /// Per output: place of the viscous friction among its columns, which [`ShapeKind::Power`] stands in place of.
    viscous: &'a [Option<usize>],
    prior: Option<&'a BasePrior>,
    settings: &'a ConditioningSettings,
    /// Per output: the rung without mask beyond reversal itself.
    lowest: Vec<usize>,
    /// Rungs chosen before.
    before: Vec<usize>,
    /// Per output and rung in use.
    sums: BTreeMap<(usize, usize), BlockSums>,
    fit: Fit,
}

impl<'a> Search<'a> {
    pub(super) fn new(
        trial: &'a Trial,
        library: &'a [Vec<FrictionShape>],
        viscous: &'a [Option<usize>],
        prior: Option<&'a BasePrior>,
        choices: &Conditioning,
        settings: &'a ConditioningSettings,
    ) -> Self {
        let outputs = trial.outputs();
        let first_rung = usize::from(settings.reversal_mask.is_none_or(|level| level >= 0.0));
        let lowest: Vec<usize> =
            (0..outputs).map(|j| trial.allowed(j, first_rung, settings.least_usable)).collect();
        let mut keys: Vec<(usize, usize)> =
            (0..outputs).flat_map(|j| [(j, choices.rung[j]), (j, lowest[j]), (j, 0)]).collect();
        keys.sort_unstable();
        keys.dedup();
        let sums = keys
            .into_par_iter()
            .map(|(j, rung)| ((j, rung), trial.block_sums(j, rung, choices.delay.samples)))
            .collect();
        let fit = Fit { rung: choices.rung.clone(), shapes: vec![Vec::new(); outputs] };
        Search { trial, library, viscous, prior, settings, lowest, before: choices.rung.clone(), sums, fit }
    }

    /// Rungs of all outputs and the chosen places in their libraries.
    pub(super) fn into_parts(self) -> (Vec<usize>, Vec<Vec<usize>>) {
        (self.fit.rung, self.fit.shapes)
    }

    pub(super) fn run(&mut self) -> Vec<JointFriction> {
        let outputs = self.trial.outputs();
        for shapes in 1..=2 {
            // What other joints took lowers the bar, so joints are asked until none takes one more.
            for _ in 0..ROUNDS {
                let before = self.fit.shapes.clone();
                for output in 0..outputs {
                    if self.worth_trying(output) {
                        self.extend(output, shapes);
                    }
                }
                if self.fit.shapes == before {
                    break;
                }
            }
            for _ in 0..REPLACEMENTS {
                let before = self.fit.shapes.clone();
                for output in 0..outputs {
                    for shape in self.fit.shapes[output].clone() {
                        self.replace(output, shape);
                    }
                }
                if self.fit.shapes == before {
                    break;
                }
            }
        }
        (0..outputs).map(|output| self.report(output)).collect()
    }

    fn blocks(&self, output: usize) -> usize {
        self.sums[&(output, self.lowest[output])].scored.iter().filter(|g| g.rows > 0.0).count()
    }

    fn worth_trying(&self, output: usize) -> bool {
        !self.library[output].is_empty() && self.blocks(output) >= self.settings.friction.least_blocks
    }

    /// Standard errors and share of the loss that a shape must gain beside the others of an output.
    ///
    /// Joints of one machine have drives of one make: a kind that others have is likely, one that none has is one of many that
    /// were tried. The bar is where a gain of so many standard errors, `exp(z²/2)` in likelihood, meets the odds against it.
    fn bar(&self, base: &Fit, output: usize, kind: ShapeKind) -> (f64, f64) {
        let friction = &self.settings.friction;
        if kind != ShapeKind::MaxwellSlip && self.curves(base, output) > 0 {
            return friction.second;
        }
        let outputs = 0..self.trial.outputs();
        let others = outputs.filter(|other| *other != output && self.worth_trying(*other)).count() as f64;
        let with = self.others_with(base, output, kind) as f64;
        let (a, b, c) = friction.expected;
        let odds = (others - with + a) / (b * with + c);
        let sigmas = (2.0 * odds.ln()).max(0.0).sqrt().max(LEAST_SIGMAS);
        let share = if kind == ShapeKind::MaxwellSlip { friction.spring } else { friction.first };
        (sigmas, share * (sigmas / FULL_SIGMAS).min(1.0))
    }

    /// Shapes of an output over speed: all but springs.
    fn curves(&self, fit: &Fit, output: usize) -> usize {
        let library = &self.library[output];
        fit.shapes[output].iter().filter(|s| library[**s].kind != ShapeKind::MaxwellSlip).count()
    }

    /// How many other outputs have a kind of shape.
    fn others_with(&self, base: &Fit, output: usize, kind: ShapeKind) -> usize {
        let has = |other: &usize| base.shapes[*other].iter().any(|s| self.library[*other][*s].kind == kind);
        (0..self.trial.outputs()).filter(|other| *other != output && has(other)).count()
    }

    /// The candidate of least loss among those that pass; one whose kind more of the other joints have, where the loss does not speak
    /// against it by a standard error.
    fn best(&self, base: &Fit, output: usize, from: &Losses, tried: Vec<Scored>) -> Option<Scored> {
        let kind = |t: &Scored| self.library[output][t.place].kind;
        let passes = |t: &Scored| {
            from.falls(&t.losses, self.bar(base, output, kind(t)), self.judged_on(output, kind(t)))
        };
        let mut passing: Vec<Scored> = tried.into_iter().filter(passes).collect();
        passing.sort_by(|a, b| a.losses.mean().total_cmp(&b.losses.mean()));
        let first = passing.first()?;
        let others = |t: &Scored| self.others_with(base, output, kind(t));
        let own = others(first);
        let common = passing
            .iter()
            .enumerate()
            .filter(|(_, t)| others(t) > own && !t.losses.falls(&first.losses, (1.0, 0.0), RowsOf::Motion));
        let place = common.rev().max_by_key(|(_, t)| others(t)).map_or(0, |(place, _)| place);
        Some(passing.swap_remove(place))
    }

    /// Rows that a kind must gain in.
    fn judged_on(&self, output: usize, kind: ShapeKind) -> RowsOf {
        match kind {
            ShapeKind::MaxwellSlip => RowsOf::Reversals,
            // Rows without a mask hold reversals, and of a joint that rests for long above all rest, where more friction at low speed is
            // more error.
            _ if self.trial.rests(output) => RowsOf::MotionAlone,
            _ => RowsOf::Motion,
        }
    }

    /// Adds the best candidate to an output if it passes; a spring alone where it has so many shapes over speed as it may.
    fn extend(&mut self, output: usize, most: usize) {
        let base = self.with_low_speeds(output);
        let (from, mut tried) = self.candidates(&base, output);
        if self.curves(&base, output) >= most {
            tried.retain(|t| self.library[output][t.place].kind == ShapeKind::MaxwellSlip);
        }
        let best = self.best(&base, output, &from, tried);
        if let Some(best) = best {
            self.fit = self.with(&base, output, best.place);
        }
    }

    /// Puts the best candidate in the place of a shape, or drops it where none passes any more.
    fn replace(&mut self, output: usize, current: usize) {
        let mut base = self.fit.clone();
        base.shapes[output].retain(|s| *s != current);
        base.rung[output] = self.rung_of(&base, output);
        let (from, mut tried) = self.candidates(&base, output);
        if !tried.iter().any(|t| t.place == current) {
            let variances = self.variances(&base);
            let losses = self.losses(&self.with(&base, output, current), output, &variances);
            tried.push(Scored { place: current, losses });
        }
        let best = self.best(&base, output, &from, tried);
        self.fit = match best {
            Some(best) => self.with(&base, output, best.place),
            None => base,
        };
        if self.fit.shapes[output].is_empty() {
            self.fit.rung[output] = self.before[output];
        }
    }

    /// Gains of what was chosen, and of the best that was not.
    fn report(&self, output: usize) -> JointFriction {
        let blocks = self.blocks(output);
        if !self.worth_trying(output) {
            return JointFriction { blocks, ..JointFriction::default() };
        }
        let trial = |place: usize, from: &Losses, to: &Losses| {
            let rows = self.judged_on(output, self.library[output][place].kind);
            let (gain, standard_error) = from.share_of_fall(to, rows);
            ShapeTrial { shape: self.library[output][place], gain, standard_error }
        };
        let chosen = self.with_low_speeds(output);
        let (from, tried) = self.candidates(&chosen, output);
        let accepted = chosen.shapes[output]
            .iter()
            .map(|place| {
                let mut base = chosen.clone();
                base.shapes[output].retain(|s| s != place);
                base.rung[output] = self.rung_of(&base, output);
                let variances = self.variances(&base);
                trial(*place, &self.losses(&base, output, &variances), &from)
            })
            .collect();
        let mut rejected: Vec<ShapeTrial> = Vec::new();
        for candidate in tried {
            let candidate = trial(candidate.place, &from, &candidate.losses);
            match rejected.iter_mut().find(|r| r.shape.kind == candidate.shape.kind) {
                Some(of_kind) if of_kind.gain >= candidate.gain => {}
                Some(of_kind) => *of_kind = candidate,
                None => rejected.push(candidate),
            }
        }
        JointFriction { accepted, rejected, blocks, mask_without_spring: None }
    }

    /// The present fit with low speeds of one output in its rows.
    fn with_low_speeds(&self, output: usize) -> Fit {
        let mut fit = self.fit.clone();
        fit.rung[output] = self.rung_of(&fit, output);
        fit
    }

    /// The rung of an output with shapes: low speeds, and with a spring reversals, which it is all about. Of a joint that rests for long those rows are
    /// rest above all, where friction has any value left from before: a fit with them would be worse where the joint moves.
    fn rung_of(&self, fit: &Fit, output: usize) -> usize {
        let springs =
            fit.shapes[output].iter().any(|s| self.library[output][*s].kind == ShapeKind::MaxwellSlip);
        if springs && !self.trial.rests(output) { 0 } else { self.lowest[output] }
    }

    fn with(&self, base: &Fit, output: usize, place: usize) -> Fit {
        let mut fit = base.clone();
        fit.shapes[output].push(place);
        fit.rung[output] = self.rung_of(&fit, output);
        fit
    }

    /// Held-out losses of an output without and with the best candidates of every kind that is not present.
    fn candidates(&self, base: &Fit, output: usize) -> (Losses, Vec<Scored>) {
        let variances = self.variances(base);
        let from = self.losses(base, output, &variances);
        let mut ranked = self.gains(base, output, &variances);
        ranked.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        // The best of every kind first: neighbours in a grid say the same thing.
        let kind = |place: usize| self.library[output][place].kind;
        let mut places: Vec<usize> = Vec::new();
        for (place, _) in &ranked {
            if !places.iter().any(|p| kind(*p) == kind(*place)) {
                places.push(*place);
            }
        }
        let others: Vec<usize> = ranked.iter().map(|r| r.0).filter(|p| !places.contains(p)).collect();
        places.extend(others);
        places.truncate(self.settings.friction.tried);
        let tried = places
            .into_iter()
            .map(|place| Scored {
                place,
                losses: self.losses(&self.with(base, output, place), output, &variances),
            })
            .collect();
        (from, tried)
    }

    /// Fall of the weighted loss on all rows with each candidate of an output alone, the variances held.
    fn gains(&self, base: &Fit, output: usize, variances: &[f64]) -> Vec<(usize, f64)> {
        let is_spring = |c: &usize| self.library[output][*c].kind == ShapeKind::MaxwellSlip;
        let (springs, others): (Vec<usize>, Vec<usize>) =
            (0..self.library[output].len()).partition(|c| is_spring(c));
        let mut found = self.gains_of(&others, base, output, variances);
        if !springs.is_empty() {
            let mut over_reversals = base.clone();
            over_reversals.rung[output] = 0;
            found.extend(self.gains_of(&springs, &over_reversals, output, variances));
        }
        found
    }

    /// As [`Search::gains`], of some candidates.
    fn gains_of(&self, among: &[usize], base: &Fit, output: usize, variances: &[f64]) -> Vec<(usize, f64)> {
        let library = &self.library[output];
        let present = &base.shapes[output];
        let candidates: Vec<usize> = (among.iter().copied())
            .filter(|c| !present.iter().any(|p| library[*p].kind.excludes(library[*c].kind)))
            .filter(|c| library[*c].kind != ShapeKind::Power || self.viscous[output].is_some())
            .collect();
        let (replacing, candidates): (Vec<usize>, Vec<usize>) =
            candidates.into_iter().partition(|c| library[*c].kind == ShapeKind::Power);
        let before = self.weighted_loss(base, variances);
        let mut found: Vec<(usize, f64)> = (replacing.into_par_iter())
            .filter_map(|c| Some((c, before? - self.weighted_loss(&self.with(base, output, c), variances)?)))
            .filter(|(_, gain)| *gain > 0.0)
            .collect();
        let (mut groups, unknowns) = self.groups(base, None);
        let scales = self.trial.scales_hz.len();
        let columns: Vec<usize> = present.iter().chain(&candidates).copied().collect();
        let sums = &self.sums[&(output, base.rung[output])];
        for (group, gram) in groups[output * scales..(output + 1) * scales].iter_mut().zip(&sums.all) {
            group.gram = gram.selected(&self.columns(output, &columns));
            group.unknowns.extend(unknowns..unknowns + candidates.len());
        }
        let normal = self.normal(&groups, unknowns + candidates.len(), variances);
        let scale = normal.scale();
        let Some(factor) = normal.unit(unknowns, &scale) else { return found };
        let unit = |i: usize, k: usize| scale[i] * scale[unknowns + k] * normal.matrix[(i, unknowns + k)];
        let cross = Mat::from_fn(unknowns, candidates.len(), unit);
        let solved = factor.solve(&cross);
        let x = factor.solve(&Mat::from_fn(unknowns, 1, |i, _| scale[i] * normal.rhs[(i, 0)]));
        let gain = |k: usize| -> Option<f64> {
            let c = unknowns + k;
            let rest = 1.0 - (0..unknowns).map(|i| cross[(i, k)] * solved[(i, k)]).sum::<f64>();
            let slope =
                scale[c] * normal.rhs[(c, 0)] - (0..unknowns).map(|i| cross[(i, k)] * x[(i, 0)]).sum::<f64>();
            // A falling tanh would be friction that drives; what falls from rest is for Stribeck, what rises for tanh.
            let allowed = library[candidates[k]].kind == ShapeKind::ViscousMagnitude || slope > 0.0;
            (allowed && scale[c] > 0.0 && rest > COLLINEAR).then(|| slope * slope / rest)
        };
        found.extend(candidates.iter().enumerate().filter_map(|(k, c)| Some((*c, gain(k)?))));
        found
    }

    /// Least weighted loss of a fit on all rows, up to a constant; `None` where its friction that is a power would drive.
    fn weighted_loss(&self, fit: &Fit, variances: &[f64]) -> Option<f64> {
        let (groups, unknowns) = self.groups(fit, None);
        let normal = self.normal(&groups, unknowns, variances);
        let x = normal.solve()?;
        let mut place = self.trial.columns.total;
        for (output, shapes) in fit.shapes.iter().enumerate() {
            for shape in shapes {
                if self.library[output][*shape].kind == ShapeKind::Power && x[place] < 0.0 {
                    return None;
                }
                place += 1;
            }
        }
        Some(-x.iter().enumerate().map(|(k, x)| x * normal.rhs[(k, 0)]).sum::<f64>())
    }

    /// Losses of an output: logarithm of the mean square residual in every time block, fitted without that block.
    fn losses(&self, fit: &Fit, output: usize, variances: &[f64]) -> Losses {
        let columns = self.columns(output, &fit.shapes[output]);
        let rungs = [self.lowest[output], 0].map(|rung| &self.sums[&(output, rung)].scored);
        let per_block: Vec<[f64; 2]> = (0..rungs[0].len())
            .into_par_iter()
            .filter(|fold| rungs[0][*fold].rows > 0.0)
            .map(|fold| {
                let (groups, unknowns) = self.groups(fit, Some(fold));
                let x = self.normal(&groups, unknowns, variances).solve();
                let x = x.unwrap_or_else(|| vec![0.0; unknowns]);
                let own = &groups[output * self.trial.scales_hz.len()].unknowns;
                rungs.map(|scored| {
                    let mean_square =
                        rss(&scored[fold].selected(&columns), own, &x) / scored[fold].rows.max(1.0);
                    mean_square.max(f64::MIN_POSITIVE).ln()
                })
            })
            .collect();
        Losses {
            off_reversal: per_block.iter().map(|l| l[0]).collect(),
            anywhere: per_block.iter().map(|l| l[1]).collect(),
        }
    }

    fn normal(&self, groups: &[Group], unknowns: usize, variances: &[f64]) -> Normal {
        let mut normal = Normal::new(groups, unknowns, variances);
        if let Some(prior) = self.prior {
            normal.add_prior(prior);
        }
        normal
    }

    fn variances(&self, fit: &Fit) -> Vec<f64> {
        let (groups, unknowns) = self.groups(fit, None);
        solve(&groups, unknowns, 3).1
    }

    /// Columns of an output with some shapes, the effort last.
    fn columns(&self, output: usize, shapes: &[usize]) -> Vec<usize> {
        let own = self.trial.columns.global[output].len();
        let effort = own + self.library[output].len();
        let model = (0..own).filter(|k| !self.is_replaced(output, shapes, *k));
        model.chain(shapes.iter().map(|s| own + s)).chain([effort]).collect()
    }

    /// Whether a shape stands in place of a column of the model.
    fn is_replaced(&self, output: usize, shapes: &[usize], column: usize) -> bool {
        let replaces = |s: &usize| self.library[output][*s].kind == ShapeKind::Power;
        self.viscous[output] == Some(column) && shapes.iter().any(replaces)
    }

    /// Rows of a fit, scale by scale for every output, and its number of unknowns.
    fn groups(&self, fit: &Fit, without: Option<usize>) -> (Vec<Group>, usize) {
        let mut groups = Vec::new();
        let mut unknowns = self.trial.columns.total;
        for (output, shapes) in fit.shapes.iter().enumerate() {
            let of_model = self.trial.columns.global[output].iter().enumerate();
            let mut own: Vec<usize> = of_model
                .filter(|(place, _)| !self.is_replaced(output, shapes, *place))
                .map(|(_, unknown)| *unknown)
                .collect();
            own.extend(unknowns..unknowns + shapes.len());
            unknowns += shapes.len();
            let columns = self.columns(output, shapes);
            let sums = &self.sums[&(output, fit.rung[output])];
            let grams = without.map_or(&sums.all, |fold| &sums.without[fold]);
            groups.extend(grams.iter().map(|g| Group { gram: g.selected(&columns), unknowns: own.clone() }));
        }
        (groups, unknowns)
    }
}
