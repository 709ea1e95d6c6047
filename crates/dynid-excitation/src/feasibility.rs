//! When no motion keeps all limits: which one is in the way.

use crate::constraint::ConstraintKind;
use crate::grid::{Grid, LimitId, LimitValues, SidedRow};
use crate::optimiser::{NearRow, Point, Program, Row, Settings, minimise};
use crate::parametrisation::Parametrisation;
use crate::problem::Problem;
use crate::start::{draw, generator, shrunk};

/// What a limit limits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LimitKind {
    /// Position of a coordinate.
    Position,
    /// Velocity of a coordinate.
    Velocity,
    /// Acceleration of a coordinate.
    Acceleration,
    /// Jerk of a coordinate.
    Jerk,
    /// Position of a coordinate behind the loop that follows its command.
    FollowedPosition,
    /// Velocity of such a coordinate.
    FollowedVelocity,
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
            LimitKind::FollowedPosition => f.write_str("position behind the drive"),
            LimitKind::FollowedVelocity => f.write_str("velocity behind the drive"),
            LimitKind::Path(ConstraintKind::Effort) => f.write_str("effort"),
            LimitKind::Path(ConstraintKind::HalfSpace) => f.write_str("distance from a plane"),
            LimitKind::Path(ConstraintKind::Box) => f.write_str("box"),
            LimitKind::Path(ConstraintKind::Cylinder) => f.write_str("distance from a cylinder"),
            LimitKind::Path(ConstraintKind::Column) => f.write_str("distance from the column"),
            LimitKind::Path(ConstraintKind::Capsule) => f.write_str("distance of bodies"),
            LimitKind::Path(ConstraintKind::OwnLinks) => f.write_str("distance of own links"),
            LimitKind::Path(ConstraintKind::Floor) => f.write_str("height above the floor"),
            LimitKind::Path(ConstraintKind::Mounting) => f.write_str("distance from the mounting plane"),
            LimitKind::Path(ConstraintKind::JointPosition) => f.write_str("position"),
            LimitKind::Path(ConstraintKind::JointRate) => f.write_str("velocity"),
            LimitKind::Path(ConstraintKind::JointAcceleration) => f.write_str("acceleration"),
            LimitKind::Path(ConstraintKind::Singularity) => f.write_str("distance from singular poses"),
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
    /// What one such unit is: size and unit; of coordinates their limit itself.
    pub scale: Option<(f64, &'static str)>,
}

/// A limit without which all others can be met.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Blame {
    /// What is limited.
    pub kind: LimitKind,
    /// Whose limit it is: coordinate, joint, frame or pair; `None`: no single one, but all of the kind together.
    pub subject: Option<String>,
}

impl std::fmt::Display for Blame {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match &self.subject {
            Some(subject) => write!(f, "{} of {subject}", self.kind),
            None => write!(f, "{}", self.kind),
        }
    }
}

/// Limits that contradict each other, or the start pose.
#[derive(Debug, Clone, PartialEq)]
pub struct Infeasible {
    /// What stays violated by the motion that comes closest, worst first; one entry per limit. Empty if limits can be met,
    /// but only by motion so small that no start was found.
    pub violations: Vec<LimitPoint>,
    /// The least that can be dropped for the others to be met: one limit of one subject, or one kind of limit, if either
    /// is enough. Empty with a start pose that is outside already.
    pub blamed: Option<Blame>,
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
        LimitId::Followed { coordinate, derivative } => {
            let kind = [LimitKind::FollowedPosition, LimitKind::FollowedVelocity];
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
        let excess = limit.excess(sample);
        if excess <= least {
            continue;
        }
        let (kind, subject) = describe(problem, limit.id);
        let scale = match limit.id {
            LimitId::Coordinate { .. } | LimitId::Followed { .. } => None,
            LimitId::Path { constraint, row } => {
                let row = &problem.constraints[constraint].rows()[row];
                Some((row.scale, row.unit))
            }
        };
        let point = LimitPoint { kind, subject, time: grid.basis.times()[sample], excess, scale };
        // Several rows may be of one limit: parts of the same two links.
        match points.iter_mut().find(|p| p.kind == point.kind && p.subject == point.subject) {
            Some(known) if known.excess < excess => *known = point,
            Some(_) => {}
            None => points.push(point),
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
/// Most single limits that are tried as the one to blame.
const SINGLE_SUSPECTS: usize = 4;
const ROUNDS: usize = 20;
/// Residuals below this count as none.
const RESIDUAL: f64 = 1e-8;

/// Finds out which limits cannot be met.
pub(crate) fn diagnose(problem: &Problem, map: &Parametrisation, seed: u64) -> Infeasible {
    let grid = Grid::search(problem, map, problem.samples);
    let (z, sum) = closest(&grid, seed, None);
    if sum < RESIDUAL {
        return Infeasible { violations: Vec::new(), blamed: None, at_start: false };
    }
    let values = grid.values(&z);
    let mut violations = worst_points(problem, &grid, &values, 0.0);
    let largest = violations.first().map_or(0.0, |v| v.excess);
    violations.retain(|v| v.excess >= 0.5 * largest);
    let blamed = suspects(problem, &values, &violations)
        .into_iter()
        .find(|suspect| closest(&grid, seed, Some(suspect)).1 < RESIDUAL);
    Infeasible { violations, blamed, at_start: false }
}

/// What may be to blame: single limits that stay violated most, then their kinds, then all other kinds.
fn suspects(problem: &Problem, values: &LimitValues, violations: &[LimitPoint]) -> Vec<Blame> {
    let single = |v: &LimitPoint| Blame { kind: v.kind, subject: Some(v.subject.clone()) };
    let mut suspects: Vec<Blame> = violations.iter().take(SINGLE_SUSPECTS).map(single).collect();
    let of_limits = values.limits.iter().map(|l| describe(problem, l.id).0);
    for kind in violations.iter().map(|v| v.kind).chain(of_limits) {
        let blame = Blame { kind, subject: None };
        if !suspects.contains(&blame) {
            suspects.push(blame);
        }
    }
    suspects
}

/// The motion with the least sum of squared excesses over several starts, and half that sum.
fn closest(grid: &Grid<'_>, seed: u64, without: Option<&Blame>) -> (Vec<f64>, f64) {
    let mut best: Option<(Vec<f64>, f64)> = None;
    for k in 0..STARTS {
        // Ever slower motions: what binds most tightly is often met best near standstill, far from a random motion.
        let z = shrunk(grid, &draw(grid, &mut generator(seed + k)), 0.2_f64.powi(k as i32));
        let Some((z, sum)) = approach(grid, z, without) else { continue };
        if best.as_ref().is_none_or(|b| sum < b.1) {
            best = Some((z, sum));
        }
        if best.as_ref().is_some_and(|b| b.1 < RESIDUAL) {
            break;
        }
    }
    best.unwrap_or_else(|| (vec![0.0; grid.map.unknowns()], f64::INFINITY))
}

/// Minimises half the sum of squared excesses, which spans many orders of magnitude on its way: in rounds, each in units of
/// what the last one left.
fn approach(grid: &Grid<'_>, mut z: Vec<f64>, without: Option<&Blame>) -> Option<(Vec<f64>, f64)> {
    let settings = Settings { iterations: 60, radius: 0.5, stall: 1e-3, deadline: None };
    let mut excess = Excess { grid, without, unit: 1.0 };
    let mut sum = excess.evaluate(&z)?.objective;
    for _ in 0..ROUNDS {
        if sum < RESIDUAL {
            break;
        }
        excess.unit = sum;
        let outcome = minimise(&mut excess, z, None, settings)?;
        z = outcome.z;
        sum *= outcome.point.objective;
        if outcome.point.objective > 0.9 {
            break;
        }
    }
    Some((z, sum))
}

/// Half the sum of squared excesses in some unit, with no limits of its own.
struct Excess<'a> {
    grid: &'a Grid<'a>,
    unit: f64,
    without: Option<&'a Blame>,
}

impl Excess<'_> {
    fn counts(&self, id: LimitId) -> bool {
        self.without.is_none_or(|blame| {
            let (kind, subject) = describe(self.grid.problem, id);
            kind != blame.kind || blame.subject.as_ref().is_some_and(|s| *s != subject)
        })
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
        objective /= self.unit;
        objective.is_finite().then_some(Point { objective, violation: 0.0 })
    }

    fn gradient(&mut self, z: &[f64]) -> Option<Vec<f64>> {
        let values = self.grid.values(z);
        let rows = self.grid.linearised(&values, 0.0, |l, s| self.counts(l.id) && l.excess(s) > 0.0);
        let mut gradient = vec![0.0; self.unknowns()];
        for NearRow { row, .. } in rows {
            // A violated row has a negative bound, its excess with the sign turned.
            for (g, x) in gradient[row.first..].iter_mut().zip(&row.values) {
                *g -= row.bound * x / self.unit;
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
