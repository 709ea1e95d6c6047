//! Whether the data see a shape parameter: the loss over its range, all others fitted anew.

use super::levenberg::{Stops, search};
use super::limit::Bound;
use super::problem::SeparableProblem;
use super::projection::Projection;
use super::scale::SearchBox;
use rayon::prelude::*;

/// Iterations per point of a profile; neighbours start from each other's ends.
const MOST_ITERATIONS: usize = 20;
/// Fall of the loss, as a share of the rise that counts, at which a point of a profile is done.
const DONE: f64 = 0.01;

/// Rise, in parts of what counts, beyond which a profile goes no further.
const ENOUGH: f64 = 4.0;

/// What the data say about a shape parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ShapeVerdict {
    /// The loss rises towards both bounds.
    Seen,
    /// The loss is flat towards one bound: an interval that ends there.
    OneSided {
        /// Lower end.
        lower: f64,
        /// Upper end.
        upper: f64,
    },
    /// The loss is flat between the bounds: the value is the start, held there while the others were fitted, if
    /// [`super::SeparableSettings::hold_unseen`].
    NotSeen,
    /// Held: the bounds coincide.
    Held,
    /// Not judged: no finite bounds, or no profile asked for.
    NotJudged,
}

/// Evidence about one shape parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct ShapeFinding {
    /// Verdict.
    pub verdict: ShapeVerdict,
    /// `(value, (rss - least rss)/σ̂²)` between the bounds, ascending, to either side as far as the loss rises to four times what counts; the
    /// estimate is among the points.
    pub profile: Vec<(f64, f64)>,
    /// The bound at which the estimate lies, if it does.
    pub at_bound: Option<Bound>,
    /// The simpler model that this bound means, where there is one.
    pub limit: Option<&'static str>,
}

/// The minimum whose surroundings are looked at.
pub(super) struct Minimum<'a> {
    pub(super) projection: &'a Projection<'a>,
    pub(super) bounds: &'a SearchBox,
    pub(super) u: &'a [f64],
    pub(super) rss: f64,
    pub(super) held: &'a [bool],
    /// `σ̂²` of the weighted residuals.
    pub(super) variance: f64,
    /// Rise in units of it that counts as seen.
    pub(super) rise: f64,
    pub(super) points: usize,
}

impl Minimum<'_> {
    /// Findings of all shape parameters; those that were seen `before` stay.
    pub(super) fn findings(
        &self,
        problem: &dyn SeparableProblem,
        before: Option<&[ShapeFinding]>,
    ) -> Vec<ShapeFinding> {
        let stays = |k: usize| before.map(|all| &all[k]).filter(|f| f.verdict != ShapeVerdict::NotSeen);
        let finding = |k: usize| stays(k).cloned().unwrap_or_else(|| self.finding(problem, k));
        (0..self.u.len()).into_par_iter().map(finding).collect()
    }

    fn finding(&self, problem: &dyn SeparableProblem, k: usize) -> ShapeFinding {
        let (lower, upper) = (self.bounds.lower[k], self.bounds.upper[k]);
        let at_bound = match self.u[k] {
            _ if lower == upper => None,
            u if u <= lower => Some(Bound::Lower),
            u if u >= upper => Some(Bound::Upper),
            _ => None,
        };
        let limit = at_bound.and_then(|b| problem.limit(k, b));
        let plain = |verdict| ShapeFinding { verdict, profile: Vec::new(), at_bound, limit };
        if lower == upper {
            return plain(ShapeVerdict::Held);
        }
        if self.points == 0 || self.held[k] || !self.bounds.is_finite(k) {
            return plain(ShapeVerdict::NotJudged);
        }
        let profile = self.profile(k);
        let least = profile.iter().map(|p| p.1).fold(f64::INFINITY, f64::min);
        let profile: Vec<(f64, f64)> =
            profile.into_iter().map(|(u, rss)| (u, (rss - least) / self.variance)).collect();
        let verdict = self.verdict(k, &profile);
        let natural = |u: f64| self.natural(k, u);
        let profile = profile.into_iter().map(|(u, rise)| (natural(u), rise)).collect();
        ShapeFinding { verdict, profile, at_bound, limit }
    }

    fn natural(&self, k: usize, u: f64) -> f64 {
        let mut all = self.u.to_vec();
        all[k] = u;
        self.bounds.natural(&all)[k]
    }

    /// `(u_k, rss)` on a grid between the bounds and at the minimum, from the minimum outwards on either side until the loss has risen
    /// enough. A point at which the model is not finite counts as infinitely bad.
    fn profile(&self, k: usize) -> Vec<(f64, f64)> {
        let (lower, upper) = (self.bounds.lower[k], self.bounds.upper[k]);
        let last = (self.points.max(2) - 1) as f64;
        let grid: Vec<f64> = (0..self.points.max(2))
            .map(|i| if i as f64 == last { upper } else { lower + (upper - lower) * i as f64 / last })
            .collect();
        let mut held = self.held.to_vec();
        held[k] = true;
        let stops = Stops {
            iterations: MOST_ITERATIONS,
            step: 1e-4,
            gradient: 1e-8,
            fall: DONE * self.rise * self.variance,
            relative_fall: 0.0,
        };
        let walk = |points: Vec<f64>| {
            let mut u = self.u.to_vec();
            let visit = |value: f64| {
                u[k] = value;
                match search(self.projection, self.bounds, &u, &held, stops) {
                    Some(found) => {
                        u.clone_from(&found.u);
                        (value, found.point.rss)
                    }
                    None => (value, f64::INFINITY),
                }
            };
            let mut out = Vec::with_capacity(points.len());
            for point in points.into_iter().map(visit) {
                out.push(point);
                if point.1 - self.rss > ENOUGH * self.rise * self.variance {
                    break;
                }
            }
            out
        };
        let below: Vec<f64> = grid.iter().rev().copied().filter(|g| *g < self.u[k]).collect();
        let above: Vec<f64> = grid.iter().copied().filter(|g| *g > self.u[k]).collect();
        let (mut profile, above) = rayon::join(|| walk(below), || walk(above));
        profile.reverse();
        profile.push((self.u[k], self.rss));
        profile.extend(above);
        profile
    }

    /// Walks from the minimum to where the rise counts, on either side.
    fn verdict(&self, k: usize, profile: &[(f64, f64)]) -> ShapeVerdict {
        let own = profile.iter().position(|p| p.0 == self.u[k]).unwrap_or(0);
        let below = crossing(profile[..=own].iter().rev(), self.rise);
        let above = crossing(profile[own..].iter(), self.rise);
        let natural = |u: f64| self.natural(k, u);
        match (below, above) {
            (Some(_), Some(_)) => ShapeVerdict::Seen,
            (None, None) => ShapeVerdict::NotSeen,
            (Some(below), None) => {
                ShapeVerdict::OneSided { lower: natural(below), upper: natural(self.bounds.upper[k]) }
            }
            (None, Some(above)) => {
                ShapeVerdict::OneSided { lower: natural(self.bounds.lower[k]), upper: natural(above) }
            }
        }
    }
}

/// Where the rise is first reached, between points as of a parabola's root.
fn crossing<'a>(mut points: impl Iterator<Item = &'a (f64, f64)>, rise: f64) -> Option<f64> {
    let mut before = *points.next()?;
    for point in points {
        if point.1 >= rise {
            let (a, b) = (before.1.max(0.0).sqrt(), point.1.sqrt());
            let share = if b > a && b.is_finite() { (rise.sqrt() - a) / (b - a) } else { 1.0 };
            return Some(before.0 + share.clamp(0.0, 1.0) * (point.0 - before.0));
        }
        before = *point;
    }
    None
}
