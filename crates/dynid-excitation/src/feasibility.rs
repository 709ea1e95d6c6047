//! When no motion keeps all limits: which one is in the way (spec/excitation.md section 6.6).

use crate::constraint::ConstraintKind;
use crate::grid::{Grid, LimitId, LimitValues, SidedRow};
use crate::optimiser::{NearRow, Point, Program, Row, Settings, minimise};
use crate::parametrisation::Parametrisation;
use crate::problem::Problem;
use crate::start::{draw, generator};

/// What a limit limits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LimitKind {
    /// Position of a coordinate.
    Position,
    /// Its velocity.
    Velocity,
    /// Its acceleration.
    Acceleration,
    /// Its jerk.
    Jerk,
    /// A path constraint.
    Path(ConstraintKind),
}

impl std::fmt::Display for LimitKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            LimitKind::Position => f.write_str("position"),
            LimitKind::Velocity => f.write_str("velocity"),
            LimitKind::Acceleration => f.write_str("acceleration"),
            LimitKind::Jerk => f.write_str("jerk"),
            LimitKind::Path(ConstraintKind::Effort) => f.write_str("effort"),
            LimitKind::Path(ConstraintKind::HalfSpace) => f.write_str("distance from a plane"),
            LimitKind::Path(ConstraintKind::Box) => f.write_str("box"),
            LimitKind::Path(ConstraintKind::Cylinder) => f.write_str("distance from a cylinder"),
            LimitKind::Path(ConstraintKind::Column) => f.write_str("distance from the column"),
            LimitKind::Path(ConstraintKind::Capsule) => f.write_str("distance of bodies"),
        }
    }
}

/// A limit that is broken or touched.
#[derive(Debug, Clone, PartialEq)]
pub struct LimitPoint {
    /// What is limited.
    pub kind: LimitKind,
    /// Whose: coordinate, joint, frame or pair.
    pub subject: String,
    /// When, s after the start of the period.
    pub time: f64,
    /// Value over the limit: excess in units of the limit; at most 0 if it holds.
    pub excess: f64,
}

/// Limits that contradict each other, or the start pose.
#[derive(Debug, Clone, PartialEq)]
pub struct Infeasible {
    /// What stays violated by the motion that comes closest, worst first; one entry per limit.
    pub violations: Vec<LimitPoint>,
    /// The single kind of limit without which the others can be met, if there is one.
    pub blamed: Option<LimitKind>,
    /// The start pose itself, at rest, is outside.
    pub at_start: bool,
}

/// Kind and subject of a limit.
pub(crate) fn describe(problem: &Problem, id: LimitId) -> (LimitKind, String) {
    match id {
        LimitId::Coordinate { coordinate, derivative } => {
            let kind = [LimitKind::Position, LimitKind::Velocity, LimitKind::Acceleration, LimitKind::Jerk];
            (kind[derivative], problem.coordinates[coordinate].clone())
        }
        LimitId::Path { constraint, row } => {
            let row = &problem.constraints[constraint].rows()[row];
            (LimitKind::Path(row.kind), row.subject.clone())
        }
    }
}

/// For every limit its worst instant, limits whose excess is above `least`, worst first.
pub(crate) fn worst_points(
    problem: &Problem,
    grid: &Grid<'_>,
    values: &LimitValues,
    least: f64,
) -> Vec<LimitPoint> {
    let mut points: Vec<LimitPoint> = Vec::new();
    for limit in &values.limits {
        let worst = (0..values.motion.samples).max_by(|a, b| limit.excess(*a).total_cmp(&limit.excess(*b)));
        let Some(sample) = worst else { continue };
        if limit.excess(sample) > least {
            let (kind, subject) = describe(problem, limit.id);
            points.push(LimitPoint {
                kind,
                subject,
                time: grid.basis.times()[sample],
                excess: limit.excess(sample),
            });
        }
    }
    points.sort_by(|a, b| b.excess.total_cmp(&a.excess));
    points
}

/// Limits that the start pose breaks at rest; nothing without a start pose.
pub(crate) fn violated_at_start(problem: &Problem, map: &Parametrisation) -> Vec<LimitPoint> {
    if problem.start.pose.is_none() {
        return Vec::new();
    }
    let grid = Grid::at_times(problem, map, vec![0.0]);
    let values = grid.values(&vec![0.0; map.unknowns()]);
    worst_points(problem, &grid, &values, 1e-9)
}

const STARTS: u64 = 4;
/// Residuals below this count as none.
const RESIDUAL: f64 = 1e-8;

/// Finds out which limits cannot be met.
pub(crate) fn diagnose(problem: &Problem, map: &Parametrisation, seed: u64) -> Infeasible {
    let grid = Grid::search(problem, map, problem.samples);
    let (z, _) = closest(&grid, seed, None);
    let values = grid.values(&z);
    let mut violations = worst_points(problem, &grid, &values, 0.0);
    let largest = violations.first().map_or(0.0, |v| v.excess);
    violations.retain(|v| v.excess >= 0.5 * largest);
    let mut kinds: Vec<LimitKind> = Vec::new();
    for limit in &values.limits {
        let (kind, _) = describe(problem, limit.id);
        if !kinds.contains(&kind) {
            kinds.push(kind);
        }
    }
    // Suspects first: kinds that stay violated.
    kinds.sort_by_key(|k| violations.iter().position(|v| v.kind == *k).unwrap_or(usize::MAX));
    let blamed = kinds.into_iter().find(|kind| closest(&grid, seed, Some(*kind)).1 < RESIDUAL);
    Infeasible { violations, blamed, at_start: false }
}

/// The motion with the least sum of squared excesses over several starts, and half that sum.
fn closest(grid: &Grid<'_>, seed: u64, without: Option<LimitKind>) -> (Vec<f64>, f64) {
    let mut best: Option<(Vec<f64>, f64)> = None;
    for k in 0..STARTS {
        let z = draw(grid, &mut generator(seed + k));
        let mut excess = Excess { grid, without };
        let settings = Settings { iterations: 200, radius: 0.5, stall: 1e-3 * RESIDUAL };
        let Some(outcome) = minimise(&mut excess, z, None, settings) else { continue };
        if best.as_ref().is_none_or(|b| outcome.point.objective < b.1) {
            best = Some((outcome.z, outcome.point.objective));
        }
        if best.as_ref().is_some_and(|b| b.1 < RESIDUAL) {
            break;
        }
    }
    best.unwrap_or_else(|| (vec![0.0; grid.map.unknowns()], f64::INFINITY))
}

/// Half the sum of squared excesses, with no limits of its own.
struct Excess<'a> {
    grid: &'a Grid<'a>,
    without: Option<LimitKind>,
}

impl Excess<'_> {
    fn counts(&self, id: LimitId) -> bool {
        self.without.is_none_or(|kind| describe(self.grid.problem, id).0 != kind)
    }
}

impl Program for Excess<'_> {
    type Id = SidedRow;

    fn unknowns(&self) -> usize {
        self.grid.map.unknowns()
    }

    fn evaluate(&mut self, z: &[f64]) -> Option<Point> {
        let values = self.grid.values(z);
        let mut objective = 0.0;
        for limit in values.limits.iter().filter(|l| self.counts(l.id)) {
            for sample in 0..values.motion.samples {
                objective += 0.5 * limit.excess(sample).max(0.0).powi(2);
            }
        }
        objective.is_finite().then_some(Point { objective, violation: 0.0 })
    }

    fn gradient(&mut self, z: &[f64]) -> Option<Vec<f64>> {
        let values = self.grid.values(z);
        let rows = self.grid.linearised(&values, 0.0, |l, s| self.counts(l.id) && l.excess(s) > 0.0);
        let mut gradient = vec![0.0; self.unknowns()];
        for NearRow { row, .. } in rows {
            // A violated row has a negative bound, its excess with the sign turned.
            for (g, x) in gradient[row.first..].iter_mut().zip(&row.values) {
                *g -= row.bound * x;
            }
        }
        Some(gradient)
    }

    fn near_rows(&mut self, _: &[f64], _: f64) -> Vec<NearRow<SidedRow>> {
        Vec::new()
    }

    fn curved_bounds(&mut self, _: &[f64], _: &[SidedRow]) -> Vec<f64> {
        Vec::new()
    }

    fn curved_rows(&mut self, _: &[f64], _: &[SidedRow]) -> Vec<Row> {
        Vec::new()
    }
}
