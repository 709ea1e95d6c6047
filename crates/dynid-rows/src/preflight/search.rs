//! The search for what a log is to be read by.

use std::borrow::Cow;

use rayon::prelude::*;

use super::samples::Samples;
use super::trial::Trial;
use super::wiring::{Rewiring, Wiring};
use super::{PreflightError, hypotheses};
use dynid_factor::factor::Factor;

/// A position beyond this is suspected to be in degrees, rad: a little over a turn.
const MORE_THAN_A_TURN: f64 = 6.5;
/// A position that stays below this is suspected to have been taken for degrees, rad.
const HARDLY_MOVES: f64 = 0.3;
/// Factors of an effort that are tried.
const SCALES: [f64; 6] = [1e-3, 1e-2, 1e-1, 1e1, 1e2, 1e3];
/// A difference counts if the misfit falls to at most this share ...
const SHARE: f64 = 0.6;
/// ... and by at least this much: natural logarithms of odds, twice.
const LEAST_GAIN: f64 = 40.0;
/// The size of all efforts together is only in question where this share of them (root mean square) is left unexplained.
const UNEXPLAINED: f64 = 0.2;
/// Robots with more joints have neighbours exchanged only.
const FEW: usize = 12;
/// Explanations are alike up to this multiple of the best one's misfit, or this difference ...
const ALIKE: (f64, f64) = (2.0, 10.0);
/// ... and a simpler one takes the place of the best up to these.
const SIMPLER: (f64, f64) = (1.3, 5.0);

/// A difference that was found, with what it does.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// The difference.
    pub change: Rewiring,
    /// Misfit before.
    pub before: f64,
    /// Misfit after.
    pub after: f64,
    /// Other differences that explain the log nearly as well.
    pub alternatives: Vec<(Rewiring, f64)>,
}

/// Outcome of [`Trial::search`].
#[derive(Debug, Clone, PartialEq)]
pub struct WiringSearch {
    /// The wiring found.
    pub wiring: Wiring,
    /// Differences from the log, in the order found; none if it is as it should be.
    pub found: Vec<Found>,
    /// Misfit of the log as it is.
    pub as_logged: f64,
    /// What the log as it is would leave if parameters were any numbers, not those of bodies that can exist near the prior.
    pub unrestrained: f64,
    /// Misfit that explaining nothing at all would have.
    pub nothing: f64,
}

impl WiringSearch {
    /// Misfit of the wiring found.
    pub fn misfit(&self) -> f64 {
        self.found.last().map_or(self.as_logged, |f| f.after)
    }
}

impl Trial<'_> {
    /// Looks for what the log may be read by instead: columns that stand for other joints, count the other way, from another zero or in
    /// another unit, gravity along another axis, a clock in another unit, efforts of another time.
    ///
    /// One difference after another is taken, as long as the least misfit falls to 60 % and by 40. Of those that do nearly as well, the
    /// simplest is taken; the others are named. `scales`: whether factors of efforts are tried.
    ///
    /// # Errors
    /// [`PreflightError`] where the regressor of the log as it is is not finite.
    pub fn search(&self, scales: bool) -> Result<WiringSearch, PreflightError> {
        let joints = self.samples.joints.len();
        let mut wiring = Wiring { delay_s: self.delay_s, ..Wiring::identity(joints) };
        let factor = {
            let samples = self.samples_at(self.delay_s).unwrap_or(Cow::Borrowed(self.samples));
            self.rows(&samples, &wiring)?.weighted(&wiring)
        };
        let (as_logged, nothing) = (self.misfit(&factor), factor.effort_norm().powi(2));
        let unrestrained = factor.rho().powi(2);
        let mut found: Vec<Found> = Vec::new();
        let mut now = as_logged;
        for _ in 0..2 * joints.max(2) {
            if now <= LEAST_GAIN {
                break;
            }
            let Some(samples) = self.samples_at(wiring.delay_s) else { break };
            let rows = self.rows(&samples, &wiring)?;
            let unexplained = now > UNEXPLAINED * UNEXPLAINED * nothing;
            let mut moves = self.candidates(&wiring, scales, unexplained);
            moves.extend(hypotheses::of(self, &samples, &wiring)?);
            // What any parameters leave more than this of does not count, however they are restrained.
            let most = now - LEAST_GAIN;
            let misfit = |factor: &Factor| match factor.rho().powi(2) > most {
                true => f64::INFINITY,
                false => self.misfit(factor),
            };
            let misfit_of = |samples: &Samples, wiring: &Wiring| {
                self.rows(samples, wiring).map_or(f64::INFINITY, |rows| misfit(&rows.weighted(wiring)))
            };
            let tried: Vec<f64> = moves
                .par_iter()
                .map(|change| {
                    let changed = wiring.with(change, self.slides);
                    let same_motion = Wiring { effort: wiring.effort.clone(), ..changed.clone() } == wiring;
                    if same_motion {
                        misfit(&rows.weighted(&changed))
                    } else if changed.delay_s == wiring.delay_s {
                        misfit_of(&samples, &changed)
                    } else {
                        let moved = self.samples_at(changed.delay_s);
                        moved.map_or(f64::INFINITY, |samples| misfit_of(&samples, &changed))
                    }
                })
                .collect();
            let best = tried.iter().copied().fold(f64::INFINITY, f64::min);
            if best > SHARE * now || now - best < LEAST_GAIN {
                break;
            }
            let within = |(times, gain): (f64, f64)| (times * best).max(best + gain).min(now - LEAST_GAIN);
            let simpler = within(SIMPLER);
            let order = |a: &usize, b: &usize| {
                moves[*a].cost().cmp(&moves[*b].cost()).then(tried[*a].total_cmp(&tried[*b]))
            };
            let chosen = (0..moves.len()).filter(|k| tried[*k] <= simpler).min_by(order);
            let Some(chosen) = chosen else { break };
            let (change, after) = (&moves[chosen], tried[chosen]);
            let next = wiring.with(change, self.slides);
            let alike = within(ALIKE);
            let alternatives = moves
                .iter()
                .zip(&tried)
                .filter(|(other, misfit)| {
                    **misfit <= alike && !other.is_like(change) && wiring.with(other, self.slides) != next
                })
                .map(|(other, misfit)| (other.clone(), *misfit))
                .collect();
            found.push(Found { change: change.clone(), before: now, after, alternatives });
            wiring = next;
            now = after;
        }
        self.drop_refuted(&mut found, now);
        Ok(WiringSearch { wiring, found, as_logged, unrestrained, nothing })
    }

    /// Drops alternatives of earlier differences that do not explain the log together with the later ones.
    fn drop_refuted(&self, found: &mut [Found], least: f64) {
        let start = Wiring { delay_s: self.delay_s, ..Wiring::identity(self.samples.joints.len()) };
        let changes: Vec<Rewiring> = found.iter().map(|f| f.change.clone()).collect();
        for (step, found) in found.iter_mut().enumerate().take(changes.len().saturating_sub(1)) {
            found.alternatives.retain(|(other, _)| {
                let taken = |k: usize| if k == step { other } else { &changes[k] };
                let wiring = (0..changes.len()).fold(start.clone(), |w, k| w.with(taken(k), self.slides));
                let samples = self.samples_at(wiring.delay_s);
                let misfit = samples.map_or(f64::INFINITY, |s| self.misfit_of(&s, &wiring));
                !changes.contains(other) && misfit <= (ALIKE.0 * least).max(least + ALIKE.1)
            });
        }
    }

    /// Differences to try from a wiring, simple ones first. `scales`: whether factors of efforts are tried; `unexplained`: whether the
    /// wiring explains little.
    fn candidates(&self, wiring: &Wiring, scales: bool, unexplained: bool) -> Vec<Rewiring> {
        let n = self.samples.joints.len();
        let largest = |j: usize| {
            let source = wiring.position[j];
            let of = self.samples.joints[source.joint].position.iter();
            of.fold(0.0_f64, |m, x| m.max((source.factor * x + source.offset).abs()))
        };
        let turning: Vec<usize> = (0..n).filter(|j| !self.slides[*j]).collect();
        // What stands still says next to nothing about whose column it is.
        let moves = |j: &usize| self.samples.joints[wiring.position[*j].joint].moves;
        let moving: Vec<usize> = (0..n).filter(moves).collect();
        let mut out: Vec<Rewiring> = moving.iter().copied().map(Rewiring::EffortSign).collect();
        if n > 1 {
            out.push(Rewiring::AllEffortSigns);
        }
        out.extend(moving.iter().copied().map(Rewiring::PositionSign));
        out.extend(moving.iter().copied().map(Rewiring::BothSigns));
        for (suspect, factor) in [
            (turning.iter().any(|j| largest(*j) > MORE_THAN_A_TURN), 1f64.to_radians()),
            (turning.iter().all(|j| largest(*j) < HARDLY_MOVES), 1f64.to_degrees()),
        ] {
            if suspect && turning.len() > 1 {
                out.push(Rewiring::AllPositionUnits(factor));
            }
        }
        for j in turning {
            if largest(j) > MORE_THAN_A_TURN {
                out.push(Rewiring::PositionUnit(j, 1f64.to_radians()));
            } else if largest(j) < HARDLY_MOVES {
                out.push(Rewiring::PositionUnit(j, 1f64.to_degrees()));
            }
        }
        // Within what a prior of bodies bears, no log tells the size of all efforts together.
        if scales && unexplained {
            out.extend(SCALES.map(Rewiring::AllEffortScales));
        }
        // That of the only joint that moves is the prior's alone to tell.
        if scales && moving.len() > 1 {
            out.extend(moving.iter().flat_map(|j| SCALES.map(|s| Rewiring::EffortScale(*j, s))));
        }
        let farthest = if n > FEW { 1 } else { n };
        for (k, &a) in moving.iter().enumerate() {
            for &b in moving[k + 1..].iter().take(farthest) {
                out.extend([
                    Rewiring::EffortSwap(a, b),
                    Rewiring::PositionSwap(a, b),
                    Rewiring::JointSwap(a, b),
                ]);
            }
        }
        if moving.len() > 2 {
            let orders = [
                (0..n).rev().collect::<Vec<_>>(),
                (0..n).map(|k| (k + 1) % n).collect(),
                (0..n).map(|k| (k + n - 1) % n).collect(),
            ];
            for order in orders {
                out.push(Rewiring::EffortOrder(order.clone()));
                out.push(Rewiring::PositionOrder(order.clone()));
                out.push(Rewiring::JointOrder(order));
            }
        }
        out
    }
}
