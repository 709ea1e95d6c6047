//! Changes of single robots with time: steps and ramps against the scatter between logs, with covariates beside them.

mod history;
mod pattern;
mod series;

use rayon::prelude::*;

use crate::data::{Fleet, FleetError};
use crate::fit::FleetFit;
use crate::noise::median;
use crate::outliers::largest_discovery;
use crate::sweep::Sweep;
use history::Logs;
use pattern::{AS_GOOD, ONSET_STEP, mean_onset, of_background};
use series::Background;

pub use pattern::{Candidate, Pattern, candidates, patterns, probability};
pub use series::Series;

/// The median of `χ²` with one degree of freedom.
const MEDIAN: f64 = 0.454_936_423_119_572_7;
/// A change of this evidence `λ = g² hᵀQh` is found.
const FOUND: f64 = 36.0;
/// Step and ramp whose statistics are nearer than this are both named.
const ALIKE: f64 = 4.0;
/// Weights of logs are renewed this often at most ...
const REWEIGHTED: usize = 30;
/// ... until the misfit falls by less than this.
const SETTLED: f64 = 0.02;
/// Patterns are tried again with the weights beside the strongest so often at most ...
const ROUNDS: usize = 5;
/// ... where its statistic is larger than this.
const WORTH: f64 = 6.0;
/// So many joints that change alike at once point to what acts on all of them.
const TOGETHER: usize = 4;

/// How changes are looked for.
#[derive(Debug, Clone, PartialEq)]
pub struct DriftSettings {
    /// Share of the robots with a change that may have none: false discovery rate (Benjamini and Hochberg 1995).
    pub false_discoveries: f64,
    /// A robot with fewer logs has no history.
    pub least_logs: usize,
    /// Most changes of one robot.
    pub most_changes: usize,
    /// Steps of different robots within this time are one event, s.
    pub event_s: f64,
    /// ... where they are this share of the robots at least, and three.
    pub event_share: f64,
}

impl Default for DriftSettings {
    fn default() -> Self {
        DriftSettings {
            false_discoveries: 0.05,
            least_logs: 6,
            most_changes: 6,
            event_s: 3.0 * 86_400.0,
            event_share: 0.1,
        }
    }
}

/// Which pattern a change follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// At once.
    Step,
    /// Evenly from a time on.
    Ramp,
    /// Either: the other one explains the logs nearly as well.
    Either,
}

/// A change of a parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Change {
    /// Index of the coordinate.
    pub coordinate: usize,
    /// Which pattern it follows.
    pub kind: Kind,
    /// Whether the better one is a step.
    pub step: bool,
    /// How much the parameter has changed at the last log.
    pub size: f64,
    /// Standard deviation of that, where the pattern is right.
    pub sd: f64,
    /// How much minus twice the logarithm of the likelihood falls by it.
    pub evidence: f64,
    /// Probability of that in a robot without a change, for this coordinate.
    pub p: f64,
    /// When: the middle between the logs of a step, the onset of a ramp; s on the axis of the fleet.
    pub time_s: f64,
    /// Times that explain the logs as well.
    pub from_s: f64,
    /// The last of them.
    pub to_s: f64,
    /// Coordinates of the same kind that change alike by the same pattern, this one among them: many point to temperature or supply.
    pub together: usize,
}

/// What was found of a robot.
#[derive(Debug, Clone, PartialEq)]
pub enum History {
    /// Too few logs for a history.
    TooShort {
        /// Logs there are.
        logs: usize,
    },
    /// Nothing that the rate of false discoveries allows to be named.
    Unchanged {
        /// Probability of the largest statistic in a robot without a change.
        p: f64,
    },
    /// Changes, largest evidence first.
    Changed {
        /// Probability of the first in a robot without a change.
        p: f64,
        /// The changes.
        changes: Vec<Change>,
    },
}

/// History of a robot.
#[derive(Debug, Clone, PartialEq)]
pub struct RobotHistory {
    /// What was found.
    pub history: History,
    /// Per coordinate: the smallest step at the middle of the logs that would have been found; infinite where logs do not tell it.
    pub detectable: Vec<f64>,
    /// Per coordinate: largest statistic of a pattern.
    pub statistics: Vec<f64>,
    /// Per log in the order of time: index among the fleet's.
    pub logs: Vec<usize>,
}

/// Steps of many robots at once.
#[derive(Debug, Clone, PartialEq)]
pub struct SiteEvent {
    /// First date, s.
    pub from_s: f64,
    /// Last date, s.
    pub to_s: f64,
    /// Robots.
    pub robots: Vec<usize>,
}

/// Changes of a fleet.
#[derive(Debug, Clone, PartialEq)]
pub struct Drift {
    /// Per robot.
    pub robots: Vec<RobotHistory>,
    /// Per covariate and coordinate: variance of the robots' own slopes about the fleet's.
    pub slope_variances: Vec<Vec<f64>>,
    /// Probability up to which a robot is named.
    pub threshold: f64,
    /// Steps of many robots at once.
    pub events: Vec<SiteEvent>,
}

/// Looks for changes in every robot.
///
/// Every series is tested with the full information on all its coordinates and with the scatter between logs by Student's t; what covariates
/// could explain is no evidence.
///
/// # Errors
/// As [`crate::fit()`].
pub fn drift(fleet: &Fleet, fit: &FleetFit, settings: &DriftSettings) -> Result<Drift, FleetError> {
    let sweep = Sweep::new(&fit.splits, &fit.robust, fit.prior.as_ref())?;
    let times: Vec<f64> = fleet.logs.iter().map(|log| log.time_s).collect();
    let logs = |r| Logs::of(&sweep, fit.freedom, &times, r);
    let slope_variances = slope_variances((0..fleet.robots.len()).into_par_iter().map(logs), fit, settings);
    let precision: Vec<Vec<f64>> = (slope_variances.iter().zip(&fit.slopes))
        .map(|(of, slopes)| {
            of.iter()
                .zip(slopes)
                .map(|(v, slope)| v.max(1e-8 * slope * slope).max(f64::MIN_POSITIVE).recip())
                .collect()
        })
        .collect();
    let tests = |r| Tests { logs: logs(r), precision: &precision, found: Vec::new() };
    let first = |r| {
        let tests = tests(r);
        tests.told(settings).then(|| tests.best(tests.logs.weights()))
    };
    let best: Vec<Option<Best>> = (0..fleet.robots.len()).into_par_iter().map(first).collect();
    let p = |(r, best): (usize, &Option<Best>)| Some(tests(r).p(best.as_ref()?.evidence));
    let p: Vec<f64> = best.iter().enumerate().filter_map(p).collect();
    let tested = p.len();
    let threshold = largest_discovery(p, tested, settings.false_discoveries);
    let told = |(r, best)| tests(r).history(fleet, best, threshold, settings);
    let robots: Vec<RobotHistory> = best.into_par_iter().enumerate().map(told).collect();
    let events = events(&robots, settings);
    Ok(Drift { robots, slope_variances, threshold, events })
}

/// Patterns of a robot beside those that were found before.
struct Best {
    /// The logs with the weights that they have beside the strongest pattern.
    series: Series,
    weights: Vec<Vec<f64>>,
    /// Coordinate of the strongest pattern.
    coordinate: usize,
    /// The pattern, by those weights.
    candidate: Candidate,
    /// `Λ`: how much the misfit falls by it, weights renewed on either side.
    evidence: f64,
    /// Per coordinate: the largest statistic of a pattern.
    statistics: Vec<f64>,
}

/// Tests of one robot.
struct Tests<'a> {
    logs: Logs<'a>,
    precision: &'a [Vec<f64>],
    found: Vec<(usize, Vec<f64>)>,
}

impl Tests<'_> {
    fn told(&self, settings: &DriftSettings) -> bool {
        self.logs.index.len() >= settings.least_logs && self.logs.span_s > 0.0 && self.logs.watched() > 0
    }

    /// `p` of the evidence for one coordinate of several: Bonferroni over them.
    fn p(&self, evidence: f64) -> f64 {
        let single = probability(evidence.max(0.0), self.logs.index.len());
        (self.logs.watched() as f64 * single).min(1.0)
    }

    /// Weights of the logs beside patterns, from some to start with, and the misfit that is left.
    fn settled(&self, found: &[(usize, Vec<f64>)], mut weights: Vec<Vec<f64>>) -> (Vec<Vec<f64>>, f64) {
        let mut misfit = f64::INFINITY;
        for _ in 0..REWEIGHTED {
            let series = self.logs.series(&weights);
            let background = Background::new(&series, self.precision, found.to_vec());
            let now = self.logs.misfit(&background, &weights);
            if misfit - now < SETTLED {
                return (weights, now.min(misfit));
            }
            misfit = now;
            weights = self.logs.reweighted(&background, &weights);
        }
        (weights, misfit)
    }

    /// The strongest candidate by weights that are given, its coordinate, and the largest statistic of every coordinate.
    fn strongest(&self, series: &Series) -> (usize, Candidate, Vec<f64>) {
        let background = Background::new(series, self.precision, self.found.clone());
        let patterns = patterns(series);
        let best = |k| {
            let all = of_background(&background, series, k, &patterns).into_iter();
            all.max_by(|a, b| a.statistic.total_cmp(&b.statistic))
        };
        let candidates: Vec<Candidate> = (0..self.logs.coordinates()).filter_map(best).collect();
        let statistics: Vec<f64> = candidates.iter().map(|c| c.statistic).collect();
        let watched = (0..candidates.len()).filter(|k| self.logs.is_watched(*k));
        let k = watched.max_by(|a, b| statistics[*a].total_cmp(&statistics[*b])).unwrap_or(0);
        (k, candidates[k], statistics)
    }

    /// The strongest pattern with the weights that logs have beside it.
    ///
    /// A change widens the scatter of the logs behind it, so that weights found without it hide it: they are found again beside the
    /// strongest pattern, until it stays. The evidence is the difference of misfits that both have weights of their own, as logs that are
    /// trusted again on one side only would make a change of any two of them.
    fn best(&self, weights: Vec<Vec<f64>>) -> Best {
        let (weights, without) = self.settled(&self.found, weights);
        let mut series = self.logs.series(&weights);
        let (mut coordinate, mut candidate, statistics) = self.strongest(&series);
        let mut best = Best {
            series: series.clone(),
            weights: weights.clone(),
            coordinate,
            candidate,
            evidence: candidate.statistic,
            statistics,
        };
        if candidate.statistic < WORTH {
            return best;
        }
        for round in 0..ROUNDS {
            let mut found = self.found.clone();
            found.push((coordinate, candidate.pattern.values(&series.times)));
            let (beside, with) = self.settled(&found, weights.clone());
            series = self.logs.series(&beside);
            let (k, next, statistics) = self.strongest(&series);
            let evidence = without - with;
            if round == 0 || evidence > best.evidence {
                let own = of_background(
                    &Background::new(&series, self.precision, self.found.clone()),
                    &series,
                    coordinate,
                    &[candidate.pattern],
                );
                best = Best {
                    series: series.clone(),
                    weights: beside,
                    coordinate,
                    candidate: own[0],
                    evidence,
                    statistics,
                };
            }
            if (k, next.pattern) == (coordinate, candidate.pattern) {
                break;
            }
            (coordinate, candidate) = (k, next);
        }
        best
    }

    fn history(
        mut self,
        fleet: &Fleet,
        best: Option<Best>,
        threshold: f64,
        settings: &DriftSettings,
    ) -> RobotHistory {
        let logs = self.logs.index.clone();
        let Some(mut best) = best else {
            let history = match self.logs.watched() {
                0 => History::Unchanged { p: 1.0 },
                _ => History::TooShort { logs: logs.len() },
            };
            return RobotHistory { history, detectable: Vec::new(), statistics: Vec::new(), logs };
        };
        let series = self.logs.series(&self.logs.weights());
        let background = Background::new(&series, self.precision, Vec::new());
        let middle = [Pattern::Step { first: logs.len() / 2 }];
        let detectable = (0..self.logs.coordinates())
            .map(|k| FOUND.sqrt() * of_background(&background, &series, k, &middle)[0].sd)
            .collect();
        let statistics = best.statistics.clone();
        let p = self.p(best.evidence);
        if p > threshold {
            return RobotHistory { history: History::Unchanged { p }, detectable, statistics, logs };
        }
        let mut changes = Vec::new();
        while changes.len() < settings.most_changes && self.p(best.evidence) <= threshold {
            let (change, pattern) = self.change(fleet, &best);
            changes.push(change);
            self.found.push((best.coordinate, pattern.values(&best.series.times)));
            best = self.best(best.weights);
        }
        RobotHistory { history: History::Changed { p, changes }, detectable, statistics, logs }
    }

    /// A change told from its candidates, and its pattern: a ramp begins at the mean of the onsets by their likelihood, since the likeliest one
    /// scatters more (and lies at either end where little is told).
    fn change(&self, fleet: &Fleet, found: &Best) -> (Change, Pattern) {
        let Best { series, coordinate: k, candidate: best, evidence, .. } = found;
        let (k, mut best) = (*k, *best);
        let background = Background::new(series, self.precision, self.found.clone());
        let all = of_background(&background, series, k, &patterns(series));
        if let Some(onset) = mean_onset(&all).filter(|_| !best.pattern.is_step()) {
            best = of_background(&background, series, k, &[Pattern::Ramp { onset }])[0];
        }
        let largest = |step: bool| {
            let of = all.iter().filter(|c| c.pattern.is_step() == step).map(|c| c.statistic);
            of.fold(0.0, f64::max)
        };
        let (steps, ramps) = (largest(true), largest(false));
        let step = best.pattern.is_step();
        let kind = match step {
            _ if (steps - ramps).abs() < ALIKE => Kind::Either,
            true => Kind::Step,
            false => Kind::Ramp,
        };
        let times = &series.times;
        // Either kind names dates of both.
        let largest = if step { steps } else { ramps };
        let as_good = |c: &&Candidate| {
            c.statistic > largest - AS_GOOD && (kind == Kind::Either || c.pattern.is_step() == step)
        };
        let interval = |pattern: Pattern| match pattern {
            Pattern::Step { first } => (times[first - 1], times[first]),
            // Between two onsets that were tried nothing is known.
            Pattern::Ramp { onset } => ((onset - 0.5 * ONSET_STEP).max(0.0), onset + 0.5 * ONSET_STEP),
        };
        let spans: Vec<(f64, f64)> = all.iter().filter(as_good).map(|c| interval(c.pattern)).collect();
        let on_axis = |t: f64| self.logs.first_s + self.logs.span_s * t;
        let (time, rise) = match best.pattern {
            Pattern::Step { first } => (0.5 * (times[first - 1] + times[first]), 1.0),
            Pattern::Ramp { onset } => (onset, 1.0 - onset),
        };
        let alike = |other: &usize| {
            let same = fleet.varying[*other].kind == fleet.varying[k].kind;
            let told = same.then(|| of_background(&background, series, *other, &[best.pattern]));
            told.is_some_and(|told| told[0].statistic > 4.0 && told[0].size * best.size > 0.0)
        };
        let change = Change {
            coordinate: k,
            kind,
            step,
            size: best.size * rise,
            sd: best.sd * rise,
            evidence: *evidence,
            p: self.p(*evidence),
            time_s: on_axis(time),
            from_s: on_axis(spans.iter().map(|s| s.0).fold(time, f64::min)),
            to_s: on_axis(spans.iter().map(|s| s.1).fold(time, f64::max)),
            together: (0..self.logs.coordinates()).filter(alike).count(),
        };
        (change, best.pattern)
    }
}

impl Change {
    /// Whether so many joints change alike at once that what acts on all of them is the nearer cause: temperature, lubricant or supply.
    pub fn of_all_joints(&self) -> bool {
        self.together >= TOGETHER
    }
}

/// Variances of the robots' slopes, by moments: the median of what is seen less what estimation adds, at most the fleet's slope squared.
fn slope_variances<'a>(
    robots: impl ParallelIterator<Item = Logs<'a>>,
    fit: &FleetFit,
    settings: &DriftSettings,
) -> Vec<Vec<f64>> {
    let covariates = fit.slopes.len();
    let q = fit.slopes.first().map_or(0, Vec::len);
    // Slopes of single robots that nothing holds but a prior ten times as wide as the fleet's slope.
    let loose: Vec<Vec<f64>> = (fit.slopes.iter().zip(&fit.slope_sds))
        .map(|(of, sds)| {
            of.iter().zip(sds).map(|(g, sd)| (10.0 * g.abs().max(*sd)).powi(2).recip()).collect()
        })
        .collect();
    let seen: Vec<Vec<Vec<(f64, f64)>>> = robots
        .filter(|logs| covariates > 0 && logs.index.len() >= settings.least_logs)
        .map(|logs| {
            let series = logs.series(&logs.weights());
            let background = Background::new(&series, &loose, Vec::new());
            (0..covariates).map(|c| background.slopes(c)).collect()
        })
        .collect();
    let variance = |c: usize, k: usize| {
        let squares = median(seen.iter().map(|of| of[c][k].0.powi(2)).collect()) / MEDIAN;
        let added = median(seen.iter().map(|of| of[c][k].1).collect());
        (squares - added).clamp(0.0, fit.slopes[c][k].powi(2))
    };
    (0..covariates).map(|c| (0..q).map(|k| variance(c, k)).collect()).collect()
}

/// Times within which so many robots step that the cause is not in the robots.
fn events(robots: &[RobotHistory], settings: &DriftSettings) -> Vec<SiteEvent> {
    let told = robots.iter().filter(|r| !matches!(r.history, History::TooShort { .. })).count();
    let least = (settings.event_share * told as f64).ceil().max(3.0) as usize;
    let mut steps: Vec<(f64, usize)> = Vec::new();
    for (r, robot) in robots.iter().enumerate() {
        if let History::Changed { changes, .. } = &robot.history {
            steps.extend(changes.iter().filter(|c| c.step).map(|c| (c.time_s, r)));
        }
    }
    steps.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut out = Vec::new();
    let mut start = 0;
    while start < steps.len() {
        let end = start
            + steps[start..].iter().take_while(|(t, _)| *t <= steps[start].0 + settings.event_s).count();
        let mut of_event: Vec<usize> = steps[start..end].iter().map(|(_, r)| *r).collect();
        of_event.sort_unstable();
        of_event.dedup();
        if of_event.len() >= least {
            out.push(SiteEvent { from_s: steps[start].0, to_s: steps[end - 1].0, robots: of_event });
            start = end;
        } else {
            start += 1;
        }
    }
    out
}
