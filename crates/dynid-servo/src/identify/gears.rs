//! Gears that give way, where they are to be found.

use std::collections::BTreeSet;
use std::f64::consts::TAU;

use rayon::prelude::*;

use super::{Folds, HALVINGS, Work};
use crate::chain::{Chain, Equation};
use crate::fit::{Evaluation, Fitted, GaussNewton, fit};
use crate::free::{Free, ServoValues};
use crate::log::ServoLog;
use crate::rollout::Lost;
use crate::settings::Addition;
use crate::term::Term;

/// Frequencies at which a link may swing on its gear while its motor stands: the lowest, Hz, and the ratio of those that are tried. The loss has a valley for every
/// frequency that the motion holds, which is narrower where a gear is damped less.
const LOWEST_HZ: f64 = 1.0;
const RATIO: f64 = 1.3;

/// Least rotor of a gear that gives way, over the inertia of its link: what the fit would make of none is a motor that friction alone holds.
const LEAST_ROTOR: f64 = 1e-3;

/// Damping of a gear, over the critical one, from which a fit begins.
const FIRST_DAMPING: f64 = 0.1;

/// Backlashes from which a fit begins, rad or m.
const BACKLASHES: [f64; 2] = [1e-3, 8e-3];

/// Valleys from which a fit begins.
const VALLEYS: usize = 3;

/// Rounds per joint at most.
const ROUNDS: usize = 3;

/// Time constants of a link on its gear until the beginning of a rollout is forgotten, and the share of a log that may go by until then.
const FORGOTTEN: f64 = 3.0;
const MOST_FORGOTTEN: f64 = 0.2;

/// Least gain of the sum of squares that takes a gear, or another valley of it.
const LEAST_ELASTIC_GAIN: f64 = 0.005;

/// Least standard deviation of a reading.
const LEAST_STD: f64 = 1e-12;

/// A joint whose gear may give way.
struct Candidate {
    joint: usize,
    /// Inertia that the joint moves.
    inertia: f64,
    /// Compliances from which a fit may begin, stiffer ones first.
    starts: Vec<f64>,
    /// Terms of the gear that are free.
    free: Vec<Free>,
}

impl Candidate {
    /// The joint's rotor.
    fn rotor(&self) -> Free {
        let free = Free::term(Term::RotorInertia, [self.joint]);
        Free { lower: LEAST_ROTOR * self.inertia, ..free }
    }

    fn has(&self, term: Term) -> bool {
        self.free.iter().any(|f| f.as_term() == Some(term))
    }

    fn begin(&self, values: &ServoValues, compliance: f64, backlash: f64) -> ServoValues {
        let mut out = values.clone();
        let joint = &mut out.joints[self.joint];
        joint.set(Term::Compliance, compliance);
        if self.has(Term::GearDamping) {
            joint.set(Term::GearDamping, 2.0 * FIRST_DAMPING * (self.inertia / compliance).sqrt());
        }
        if self.has(Term::Backlash) {
            joint.set(Term::Backlash, backlash);
        }
        out
    }
}

/// What the search of one gear found.
struct Found {
    loss: f64,
    values: ServoValues,
    evaluations: usize,
}

impl Work<'_> {
    /// Finds gears that give way, in rounds: of every joint the frequency at which its link swings is looked for over all that the rows can show, with all other numbers
    /// as they are, and fitted with the joint's own friction and rotor from the best ones. The joint that gains most is taken, and all numbers are fitted, until none gains.
    /// Then the others are taken too, one by one: a gear that counts for stiff would make those about it softer than they are.
    pub(super) fn find_gears(
        &mut self,
        laws: &BTreeSet<Addition>,
        fitted: &mut Fitted,
        folds: &mut Folds,
        sigma: &[f64],
    ) -> Result<(), Lost> {
        let candidates: Vec<Candidate> = self.candidates(&fitted.values);
        if candidates.is_empty() {
            return Ok(());
        }
        let mut values = fitted.values.clone();
        // What is known to give way does so in any case.
        let mut taken: Vec<bool> =
            candidates.iter().map(|c| values.joints[c.joint].get(Term::Compliance) > 0.0).collect();
        for (c, _) in candidates.iter().zip(&taken).filter(|(_, taken)| **taken) {
            let compliance = values.joints[c.joint].get(Term::Compliance);
            values = c.begin(&values, compliance, BACKLASHES[0]);
        }
        // Gears that would make the simulation get lost stay as they are.
        let mut left = taken.clone();
        for _ in 0..ROUNDS * candidates.len() {
            self.forget_starts(&values);
            let evaluation = Evaluation::new(&self.problem(&[], self.scheme), &values, sigma, false)?;
            let own: Vec<f64> =
                evaluation.variances(&|_| true).iter().map(|s| s.sqrt().max(LEAST_STD)).collect();
            let without = evaluation.loss(&own, &|_| true);
            let found: Vec<Option<Found>> =
                candidates.par_iter().map(|c| self.find_gear(c, &values, &own)).collect();
            self.evaluations += found.iter().flatten().map(|f| f.evaluations).sum::<usize>();
            let loss = |k: usize| found[k].as_ref().map_or(f64::INFINITY, |f| f.loss);
            let best = |of: &dyn Fn(usize) -> bool| {
                (0..candidates.len()).filter(|k| of(*k)).min_by(|a, b| loss(*a).total_cmp(&loss(*b)))
            };
            let gains = |k: usize| loss(k) < (1.0 - LEAST_ELASTIC_GAIN) * without;
            let Some(next) = best(&|k| gains(k) && (taken[k] || !left[k])).or_else(|| best(&|k| !left[k]))
            else {
                break;
            };
            left[next] = true;
            let c = &candidates[next];
            let stiffest = c.begin(&values, c.starts[0], BACKLASHES[0]);
            let starts = found[next].iter().map(|f| &f.values);
            let more = starts
                .chain(Some(&stiffest).filter(|_| !taken[next]))
                .any(|start| self.take(&candidates, next, &mut taken, laws, (start, &mut values)));
            if !more && taken[next] {
                break;
            }
        }
        self.forget_starts(&values);
        self.gears = free_of(&candidates, &taken);
        let free = self.free(laws);
        *fitted = self.refit(&free, &values, self.scheme, &GaussNewton::default())?;
        *folds = self.held_out(&free, fitted, sigma);
        Ok(())
    }

    /// Sums begin when links have come to rest on their gears: a rollout takes them for wound by the weight of the bodies alone, which they are not
    /// where a log begins in the midst of a motion, and no encoder tells how they swing.
    pub(super) fn forget_starts(&mut self, values: &ServoValues) {
        let mut slowest = 0.0_f64;
        for chain in self.chains {
            for (at, j) in chain.joints.iter().enumerate() {
                let joint = &values.joints[*j];
                if joint.get(Term::Compliance) > 0.0 {
                    let damping = joint.get(Term::GearDamping);
                    slowest = slowest.max(2.0 * self.inertia(chain, at, values) / damping);
                }
            }
        }
        for (log, least) in self.logs.iter_mut().zip(&self.settle_s) {
            let span = log.time.last().zip(log.time.first()).map_or(0.0, |(b, a)| b - a);
            log.settle_s = least.max((FORGOTTEN * slowest).min(MOST_FORGOTTEN * span));
        }
    }

    /// Steps that follow links on gears that are known, a radian of their swinging at most, as far as halvings go: longer ones get lost between flanks.
    pub(super) fn follow_gears(&mut self, values: &ServoValues) {
        let mut fastest = 0.0_f64;
        for chain in self.chains {
            for (at, j) in chain.joints.iter().enumerate() {
                let compliance = values.joints[*j].get(Term::Compliance);
                if compliance > 0.0 {
                    fastest = fastest.max((compliance * self.inertia(chain, at, values)).sqrt().recip());
                }
            }
        }
        for _ in 0..HALVINGS {
            if self.settings.step_s.is_none() && fastest * self.scheme.step_s > 1.0 {
                self.scheme.step_s *= 0.5;
            }
        }
    }

    /// Takes a gear and fits all numbers; `false`, and nothing is changed, if the simulation gets lost, as others may have moved since its own fit.
    fn take(
        &mut self,
        candidates: &[Candidate],
        k: usize,
        taken: &mut [bool],
        laws: &BTreeSet<Addition>,
        (start, values): (&ServoValues, &mut ServoValues),
    ) -> bool {
        let short = GaussNewton { evaluations: 15, tolerance: 1e-3, ..GaussNewton::default() };
        let mut with = taken.to_vec();
        with[k] = true;
        let before = std::mem::replace(&mut self.gears, free_of(candidates, &with));
        match self.refit(&self.free(laws), start, self.scheme, &short) {
            Ok(fitted) => {
                *values = fitted.values;
                taken[k] = true;
                true
            }
            Err(_) => {
                self.gears = before;
                false
            }
        }
    }

    /// The best fit of one joint's gear, friction and rotor, from frequencies about which the loss has valleys.
    fn find_gear(&self, candidate: &Candidate, values: &ServoValues, sigma: &[f64]) -> Option<Found> {
        let problem = self.problem(&[], self.scheme);
        let loss = |values: &ServoValues| {
            let evaluation = Evaluation::new(&problem, values, sigma, false);
            evaluation.map_or(f64::INFINITY, |e| e.loss(sigma, &|_| true))
        };
        let backlashes = if candidate.has(Term::Backlash) { &BACKLASHES[..] } else { &BACKLASHES[..1] };
        let (mut valleys, mut evaluations) = (Vec::new(), 0);
        for backlash in backlashes {
            let start = |c: &f64| candidate.begin(values, *c, *backlash);
            let starts: Vec<ServoValues> = candidate.starts.iter().map(start).collect();
            let losses: Vec<f64> = starts.iter().map(loss).collect();
            evaluations += losses.len();
            let at = |k: usize| losses.get(k).copied().unwrap_or(f64::INFINITY);
            for (k, start) in starts.into_iter().enumerate() {
                if at(k).is_finite() && at(k) <= at(k.wrapping_sub(1)) && at(k) <= at(k + 1) {
                    valleys.push((at(k), start));
                }
            }
        }
        valleys.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut free = vec![candidate.rotor()];
        free.extend([Term::Viscous, Term::Coulomb].map(|t| Free::term(t, [candidate.joint])));
        free.extend(candidate.free.iter().cloned());
        let short = GaussNewton { evaluations: 15, tolerance: 1e-3, reweighted: 0 };
        let mut best: Option<(f64, ServoValues)> = None;
        for (_, start) in valleys.into_iter().take(VALLEYS * backlashes.len()) {
            let problem = self.problem(&free, self.scheme);
            let Ok(fitted) = fit(&problem, &start, &short, &|_| true) else { continue };
            evaluations += fitted.evaluations;
            let loss = fitted.evaluation.loss(sigma, &|_| true);
            if best.as_ref().is_none_or(|b| loss < b.0) {
                best = Some((loss, fitted.values));
            }
        }
        best.map(|(loss, values)| Found { loss, values, evaluations })
    }

    fn candidates(&self, values: &ServoValues) -> Vec<Candidate> {
        // Above half the rate of the rows nothing can be told.
        let highest = 0.5 / self.logs.iter().map(ServoLog::period).fold(f64::INFINITY, f64::min);
        let mut out = Vec::new();
        for chain in self.chains {
            for (at, joint) in chain.joints.iter().enumerate() {
                let finds = |t: &Term| {
                    self.settings.find.contains(t) && !self.settings.known_gear[*joint].contains(t)
                };
                let own = [Term::Compliance, Term::GearDamping, Term::Backlash].into_iter().filter(finds);
                let known = values.joints[*joint].get(Term::Compliance);
                let inertia = self.inertia(chain, at, values);
                let compliance = |hz: f64| 1.0 / (inertia * (TAU * hz) * (TAU * hz));
                let (least, most) = (compliance(highest), compliance(0.5 * LOWEST_HZ));
                let gear = |term: Term| {
                    let free = Free::term(term, [*joint]);
                    match term {
                        Term::Compliance => Free { lower: least, upper: most, ..free },
                        // Critical where the link swings as fast as the rows can show: with more a gear is stiff.
                        Term::GearDamping => Free { upper: 2.0 * (inertia / least).sqrt(), ..free },
                        _ => free,
                    }
                };
                let free: Vec<Free> = own.map(gear).collect();
                let starts: Vec<f64> = if finds(&Term::Compliance) {
                    let count = ((highest / LOWEST_HZ).ln() / RATIO.ln()).floor() as i32;
                    (1..=count).map(|k| compliance(highest / RATIO.powi(k))).collect()
                } else {
                    vec![known]
                };
                // Not a gear that is stiff and is not asked whether it is, nor one of rows too slow to show any.
                if !free.is_empty() && starts.first().is_some_and(|c| *c > 0.0) {
                    out.push(Candidate { joint: *joint, inertia, starts, free });
                }
            }
        }
        out
    }

    /// Inertia that a joint of a chain moves in the middle of the logs' positions.
    fn inertia(&self, chain: &Chain, at: usize, values: &ServoValues) -> f64 {
        let n = chain.len();
        let middle = |j: &usize| {
            let readings = self.logs.iter().flat_map(|log| &log.position[*j]);
            let (sum, count) = readings.fold((0.0, 0.0), |(s, c), x| (s + x, c + 1.0));
            values.joints[*j].position(sum / count)
        };
        let q: Vec<f64> = chain.joints.iter().map(middle).collect();
        let mut equation = Equation::new(chain, &values.inertias);
        equation.values(&q, &vec![0.0; n]);
        // A joint that moves no inertia has no link to swing.
        equation.mass[at * n + at].max(f64::MIN_POSITIVE)
    }
}

fn free_of(candidates: &[Candidate], taken: &[bool]) -> Vec<Free> {
    let of = candidates.iter().zip(taken).filter(|(_, taken)| **taken);
    of.flat_map(|(c, _)| [c.rotor()].into_iter().chain(c.free.iter().cloned())).collect()
}
