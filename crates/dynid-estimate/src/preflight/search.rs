//! The search for the wiring that a log was made with.

use dynid_model::EffortModel;
use rayon::prelude::*;

use super::rows::TrialRows;
use super::samples::Samples;
use super::wiring::{Rewiring, Wiring};
use crate::consistent::{Problem, Settings, estimate};
use crate::factor::{Factor, FactorError};

/// A position beyond this is suspected to be in degrees, rad: a little over a turn.
const MORE_THAN_A_TURN: f64 = 6.5;
/// A position that stays below this is suspected to have been taken for degrees, rad.
const HARDLY_MOVES: f64 = 0.3;
/// Factors of an effort that are tried.
const SCALES: [f64; 6] = [1e-3, 1e-2, 1e-1, 1e1, 1e2, 1e3];
/// A difference counts if the misfit falls to at most this share ...
const SHARE: f64 = 0.6;
/// ... and by at least this much: natural logarithms of odds, twice.
const LEAST_GAIN: f64 = 60.0;
/// Robots with more joints have neighbours exchanged only.
const FEW: usize = 12;
/// Explanations whose misfit lies this close to the best one's, as a share of what it gained, are named beside it.
const ALIKE: f64 = 0.05;

/// What a trial is made with.
pub struct Trial<'a> {
    /// The model, with friction at its joints.
    pub model: &'a dyn EffortModel,
    /// Its shape parameters.
    pub shape: &'a [f64],
    /// Its base columns, ascending.
    pub kept: &'a [usize],
    /// Samples.
    pub samples: &'a Samples,
    /// Per joint, whether it slides.
    pub slides: &'a [bool],
    /// From the weighted factor of the base columns to the problem in standard columns, with its prior.
    pub problem: &'a (dyn Fn(&Factor) -> Problem + Sync),
    /// Weight of the prior, of that of a Gaussian prior.
    pub prior_weight: f64,
}

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
    fn rows(&self, wiring: &Wiring) -> Result<TrialRows, FactorError> {
        TrialRows::new(self.model, self.shape, self.kept, self.samples, &wiring.position, false)
    }

    /// How badly bodies that can exist, with friction that takes energy, explain efforts: `min ‖R x - z‖² + ρ²` plus the
    /// distance from the prior. Infinite where there is no such estimate.
    pub(super) fn misfit(&self, factor: &Factor) -> f64 {
        let settings = Settings { gaussian_weight: self.prior_weight, ..Settings::default() };
        match estimate(&(self.problem)(factor), &settings) {
            Ok(found) => found.objective + factor.rho().powi(2),
            Err(_) => f64::INFINITY,
        }
    }

    /// Misfit of the log as it is, and of explaining nothing.
    ///
    /// # Errors
    /// [`FactorError`] where the regressor is not finite.
    pub fn as_logged(&self) -> Result<(f64, f64), FactorError> {
        let wiring = Wiring::identity(self.samples.joints.len());
        let factor = self.rows(&wiring)?.weighted(&wiring);
        Ok((self.misfit(&factor), factor.effort_norm().powi(2)))
    }

    /// Looks for columns that stand for other joints, count the other way or have another unit.
    ///
    /// One difference after another is taken, always the one whose misfit is least, as long as the misfit falls to 60 % and
    /// by 60. `scales`: whether factors of efforts are tried.
    ///
    /// # Errors
    /// [`FactorError`] where the regressor of the log as it is is not finite.
    pub fn search(&self, scales: bool) -> Result<WiringSearch, FactorError> {
        let joints = self.samples.joints.len();
        let mut wiring = Wiring::identity(joints);
        let mut rows = self.rows(&wiring)?;
        let factor = rows.weighted(&wiring);
        let (as_logged, nothing) = (self.misfit(&factor), factor.effort_norm().powi(2));
        let mut found: Vec<Found> = Vec::new();
        let mut now = as_logged;
        for _ in 0..2 * joints.max(2) {
            let moves = self.candidates(&wiring, scales);
            let tried: Vec<(usize, f64)> = (0..moves.len())
                .into_par_iter()
                .map(|k| {
                    let changed = wiring.with(&moves[k], self.slides);
                    let misfit = if changed.position == wiring.position {
                        self.misfit(&rows.weighted(&changed))
                    } else {
                        let rows = self.rows(&changed);
                        rows.map_or(f64::INFINITY, |r| self.misfit(&r.weighted(&changed)))
                    };
                    (k, misfit)
                })
                .collect();
            let Some((best, after)) = tried.iter().copied().min_by(|a, b| a.1.total_cmp(&b.1)) else { break };
            if after > SHARE * now || now - after < LEAST_GAIN {
                break;
            }
            let close = |misfit: f64| misfit <= after + ALIKE * (now - after);
            let alternatives = tried
                .iter()
                .filter(|(k, misfit)| *k != best && close(*misfit))
                .map(|(k, misfit)| (moves[*k].clone(), *misfit))
                .collect();
            wiring = wiring.with(&moves[best], self.slides);
            rows = self.rows(&wiring)?;
            found.push(Found { change: moves[best].clone(), before: now, after, alternatives });
            now = after;
        }
        Ok(WiringSearch { wiring, found, as_logged, nothing })
    }

    /// Differences to try from a wiring, simple ones first.
    fn candidates(&self, wiring: &Wiring, scales: bool) -> Vec<Rewiring> {
        let n = self.samples.joints.len();
        let largest = |j: usize| {
            let source = wiring.position[j];
            let of = self.samples.joints[source.joint].position.iter();
            of.fold(0.0_f64, |m, x| m.max((source.factor * x).abs()))
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
        // That of all efforts together, and of the only joint that moves, is the prior's alone to tell.
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
