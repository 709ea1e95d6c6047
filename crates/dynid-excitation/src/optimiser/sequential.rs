//! Sequential quadratic programming with damped BFGS and an elastic quadratic program on near-active rows.
//!
//! Source: Powell 1978 (damping), Shanno & Phua 1978 (first scale of the curvature),
//! Nocedal & Wright 2006 section 3.5 (step lengths by interpolation).

use std::time::Instant;

use super::quadratic::{Elastic, Failure, Minimum, QuadraticProgram, Row};

/// A problem `min c(z)` subject to rows, evaluated where asked.
pub(crate) trait Program {
    /// Names a row that is not linear, so that its gradient can be asked for at another point.
    type Id: Copy;
    /// Number of unknowns.
    fn unknowns(&self) -> usize;
    /// Objective and largest violation; `None` where the objective is not defined.
    fn evaluate(&mut self, z: &[f64]) -> Option<Point>;
    /// Gradient of the objective.
    fn gradient(&mut self, z: &[f64]) -> Option<Vec<f64>>;
    /// Linearised rows whose value is within `distance` of their bound.
    fn near_rows(&mut self, z: &[f64], distance: f64) -> Vec<NearRow<Self::Id>>;
    /// Bounds of rows that are not linear at `z`, by name.
    fn curved_bounds(&mut self, z: &[f64], ids: &[Self::Id]) -> Vec<f64>;
    /// Linearised rows at `z` that are not linear, by name.
    fn curved_rows(&mut self, z: &[f64], ids: &[Self::Id]) -> Vec<Row>;
}

/// Objective and largest violation of the rows at a point.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Point {
    pub(crate) objective: f64,
    pub(crate) violation: f64,
}

/// A linearised row: `values · p ≤ bound`.
#[derive(Debug, Clone)]
pub(crate) struct NearRow<Id> {
    pub(crate) row: Row,
    /// `None`: the row is linear.
    pub(crate) curved: Option<Id>,
}

/// Settings of a run.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Settings {
    pub(crate) iterations: usize,
    /// Trust box at the start.
    pub(crate) radius: f64,
    /// Progress below this counts as none; four such iterations in a row end the run.
    pub(crate) stall: f64,
    /// No iteration begins after this.
    pub(crate) deadline: Option<Instant>,
}

/// How a run ended.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Outcome {
    pub(crate) z: Vec<f64>,
    /// At `z`.
    pub(crate) point: Point,
    /// What was learned about second derivatives, for a run of a similar program.
    pub(crate) curvature: Curvature,
}

/// Distance of rows that enter the quadratic program, at a trust box of zero size.
const NEAR: f64 = 0.5;
/// Largest such distance: steps are much shorter than a large trust box, and rows cost time.
const FARTHEST: f64 = 0.75;
const LEAST_RADIUS: f64 = 0.02;
const LARGEST_RADIUS: f64 = 2.0;
const ARMIJO: f64 = 1e-4;
const STALLED_ITERATIONS: usize = 4;
const FEASIBLE: f64 = 1e-4;
/// Violation that steps may lead to, if there was less before.
const LARGEST_VIOLATION: f64 = 0.05;
/// Price of the elastic variable at the start, and where raising it ends.
const LEAST_PRICE: f64 = 10.0;
const LARGEST_PRICE: f64 = 1e5;
/// Bounds of the first estimate of second derivatives.
const LEAST_CURVATURE: f64 = 0.01;
const LARGEST_CURVATURE: f64 = 1e3;

/// Minimises from `z`, `curvature`: of an earlier run of a similar program. `None` if the objective is not defined at the
/// start.
pub(crate) fn minimise<P: Program>(
    program: &mut P,
    z: Vec<f64>,
    curvature: Option<Curvature>,
    settings: Settings,
) -> Option<Outcome> {
    let n = program.unknowns();
    let mut z = z;
    let mut point = program.evaluate(&z)?;
    let mut gradient = program.gradient(&z)?;
    let mut hessian = curvature.unwrap_or_else(|| Curvature::new(n));
    let mut radius = settings.radius;
    let mut weight: f64 = 0.0;
    let mut price = LEAST_PRICE;
    let mut stalled = 0;
    let mut failures = 0;
    let mut iterations = 0;
    let is_over = || settings.deadline.is_some_and(|deadline| Instant::now() >= deadline);
    while iterations < settings.iterations && stalled < STALLED_ITERATIONS && failures < 4 && !is_over() {
        iterations += 1;
        let near = program.near_rows(&z, (NEAR * (1.0 + radius)).min(FARTHEST));
        let (mut rows, curved): (Vec<Row>, Vec<Option<P::Id>>) =
            near.into_iter().map(|r| (r.row, r.curved)).unzip();
        let regular = hessian.regular();
        let step = Step { hessian: &regular, gradient: &gradient, radius };
        let Ok(minimum) = step.solve(&rows, point.violation, &mut price) else {
            radius *= 0.5;
            failures += 1;
            hessian.reset();
            continue;
        };
        // The sum of multipliers is the least weight with which the merit function is exact.
        weight = weight.max(1.2 * minimum.multipliers.iter().sum::<f64>());
        let slope = dot(&gradient, &minimum.step) - weight * point.violation;
        let merit = point.objective + weight * point.violation;
        let acceptable = |at: Point, length: f64| {
            let decrease = ARMIJO * length * slope.min(0.0);
            let better = at.objective + weight * at.violation <= merit + decrease;
            better && at.violation <= (0.9 * point.violation).max(LARGEST_VIOLATION)
        };

        let mut length = 1.0;
        let mut cuts = 0;
        let accepted = loop {
            let trial = moved(&z, &minimum.step, length);
            let at = program.evaluate(&trial);
            if let Some(at) = at
                && acceptable(at, length)
            {
                break Some((trial, at));
            }
            // A full step that curved constraints spoil: once more, with their curvature along the step.
            if cuts == 0 && at.is_some_and(|at| at.violation > point.violation.max(1e-6)) {
                bend(program, &curved, &minimum.step, &trial, &mut rows);
                if let Ok(corrected) = step.solve(&rows, point.violation, &mut price) {
                    let trial = moved(&z, &corrected.step, 1.0);
                    if let Some(at) = program.evaluate(&trial)
                        && acceptable(at, 1.0)
                    {
                        break Some((trial, at));
                    }
                }
            }
            cuts += 1;
            length *= shortened(at.map(|at| at.objective + weight * at.violation - merit), slope * length);
            if cuts > 7 {
                break None;
            }
        };
        let Some((next, at)) = accepted else {
            failures += 1;
            radius = (0.3 * radius).max(0.1 * LEAST_RADIUS);
            hessian.reset();
            // What the last trial left behind belongs to another point.
            program.evaluate(&z)?;
            continue;
        };
        failures = 0;
        radius = match cuts {
            0 => (1.5 * radius).min(LARGEST_RADIUS),
            1 => radius,
            _ => (0.6 * radius).max(LEAST_RADIUS),
        };
        let Some(next_gradient) = program.gradient(&next) else { break };
        let taken: Vec<f64> = next.iter().zip(&z).map(|(a, b)| a - b).collect();
        let mut change: Vec<f64> = next_gradient.iter().zip(&gradient).map(|(a, b)| a - b).collect();
        add_curvature_of_rows(program, &rows, &curved, &minimum.multipliers, &next, &mut change);
        hessian.update(&taken, change);
        let progress = (at.objective - point.objective).abs();
        stalled = if progress < settings.stall && at.violation < FEASIBLE { stalled + 1 } else { 0 };
        (z, point, gradient) = (next, at, next_gradient);
    }
    Some(Outcome { z, point, curvature: hessian })
}

/// Share of a step that is tried next: where the parabola through the rise of the merit at its end and its slope at its
/// start is least.
fn shortened(rise: Option<f64>, slope: f64) -> f64 {
    let least = rise.map_or(f64::NAN, |rise| -0.5 * slope / (rise - slope));
    if slope < 0.0 && least.is_finite() { least.clamp(0.1, 0.5) } else { 0.4 }
}

fn moved(z: &[f64], step: &[f64], length: f64) -> Vec<f64> {
    z.iter().zip(step).map(|(x, p)| x + length * p).collect()
}

/// The quadratic program of one iteration.
struct Step<'a> {
    hessian: &'a [f64],
    gradient: &'a [f64],
    radius: f64,
}

impl Step<'_> {
    /// Solves with the elastic variable as cheap as it may be: rows must be met to half of the present violation, unless
    /// no price achieves that within the trust box.
    fn solve(&self, rows: &[Row], violation: f64, price: &mut f64) -> Result<Minimum, Failure> {
        loop {
            let minimum = QuadraticProgram {
                hessian: self.hessian,
                gradient: self.gradient,
                rows,
                radius: self.radius,
                elastic: Some(Elastic { linear: *price, quadratic: 1e-4 }),
            }
            .solve()?;
            if minimum.elastic <= 0.5 * violation + 1e-9 || *price >= LARGEST_PRICE {
                return Ok(minimum);
            }
            *price *= 10.0;
        }
    }
}

/// Second-order correction: bounds of curved rows moved by what linearisation missed at the trial point.
fn bend<P: Program>(
    program: &mut P,
    curved: &[Option<P::Id>],
    step: &[f64],
    trial: &[f64],
    rows: &mut [Row],
) {
    let (places, ids): (Vec<usize>, Vec<P::Id>) =
        curved.iter().enumerate().filter_map(|(k, id)| id.map(|id| (k, id))).unzip();
    for (place, bound) in places.into_iter().zip(program.curved_bounds(trial, &ids)) {
        let row = &mut rows[place];
        row.bound = bound + dot(&row.values, &step[row.first..]);
    }
}

/// Adds `Σ λ (∇y(z⁺) - ∇y(z))` of rows that are not linear: the rest of the change of the Lagrangian's gradient.
fn add_curvature_of_rows<P: Program>(
    program: &mut P,
    rows: &[Row],
    curved: &[Option<P::Id>],
    multipliers: &[f64],
    next: &[f64],
    change: &mut [f64],
) {
    let acting: Vec<(P::Id, &Row, f64)> = rows
        .iter()
        .zip(curved)
        .zip(multipliers)
        .filter(|(_, u)| **u > 0.0)
        .filter_map(|((row, id), u)| id.map(|id| (id, row, *u)))
        .collect();
    if acting.is_empty() {
        return;
    }
    let ids: Vec<P::Id> = acting.iter().map(|c| c.0).collect();
    for ((_, before, multiplier), after) in acting.iter().zip(program.curved_rows(next, &ids)) {
        for (k, x) in after.values.iter().enumerate() {
            change[after.first + k] += multiplier * x;
        }
        for (k, x) in before.values.iter().enumerate() {
            change[before.first + k] -= multiplier * x;
        }
    }
}

/// Approximate second derivatives of the Lagrangian, kept positive definite.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Curvature {
    n: usize,
    matrix: Vec<f64>,
    /// Nothing was learned yet.
    fresh: bool,
}

impl Curvature {
    fn new(n: usize) -> Self {
        let mut curvature = Curvature { n, matrix: vec![0.0; n * n], fresh: true };
        curvature.reset();
        curvature
    }

    fn reset(&mut self) {
        self.set_scale(0.1);
        self.fresh = true;
    }

    fn set_scale(&mut self, scale: f64) {
        self.matrix.fill(0.0);
        for i in 0..self.n {
            self.matrix[i * self.n + i] = scale;
        }
    }

    fn regular(&self) -> Vec<f64> {
        let mut matrix = self.matrix.clone();
        for i in 0..self.n {
            matrix[i * self.n + i] += 1e-6;
        }
        matrix
    }

    /// BFGS update with Powell's damping.
    fn update(&mut self, step: &[f64], mut change: Vec<f64>) {
        let n = self.n;
        if self.fresh {
            // Directions of which nothing is known yet bend like the first step: steps along them would be too long.
            let scale = dot(&change, &change) / dot(step, &change);
            if scale > 0.0 && scale.is_finite() {
                self.set_scale(scale.clamp(LEAST_CURVATURE, LARGEST_CURVATURE));
            }
            self.fresh = false;
        }
        let image: Vec<f64> = self.matrix.chunks_exact(n).map(|row| dot(row, step)).collect();
        let bend = dot(step, &image);
        if bend <= 0.0 {
            return;
        }
        let along = dot(step, &change);
        if along < 0.2 * bend {
            let theta = 0.8 * bend / (bend - along);
            for (c, b) in change.iter_mut().zip(&image) {
                *c = theta * *c + (1.0 - theta) * b;
            }
        }
        let along = dot(step, &change);
        if !(along > 0.0 && along.is_finite()) {
            return;
        }
        for i in 0..n {
            let (c, b) = (change[i] / along, image[i] / bend);
            for ((m, cj), bj) in self.matrix[i * n..(i + 1) * n].iter_mut().zip(&change).zip(&image) {
                *m += c * cj - b * bj;
            }
        }
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rosenbrock's valley inside the disc of radius² 1.5 (the second derivative of the disc matters).
    struct Valley;

    impl Program for Valley {
        type Id = ();
        fn unknowns(&self) -> usize {
            2
        }
        fn evaluate(&mut self, z: &[f64]) -> Option<Point> {
            let objective = (1.0 - z[0]).powi(2) + 10.0 * (z[1] - z[0] * z[0]).powi(2);
            let disc = z[0] * z[0] + z[1] * z[1] - 1.5;
            Some(Point { objective, violation: disc.max(0.0) })
        }
        fn gradient(&mut self, z: &[f64]) -> Option<Vec<f64>> {
            let bend = z[1] - z[0] * z[0];
            Some(vec![-2.0 * (1.0 - z[0]) - 40.0 * z[0] * bend, 20.0 * bend])
        }
        fn near_rows(&mut self, z: &[f64], _: f64) -> Vec<NearRow<()>> {
            self.curved_rows(z, &[()]).into_iter().map(|row| NearRow { row, curved: Some(()) }).collect()
        }
        fn curved_bounds(&mut self, z: &[f64], _: &[()]) -> Vec<f64> {
            vec![1.5 - z[0] * z[0] - z[1] * z[1]]
        }
        fn curved_rows(&mut self, z: &[f64], ids: &[()]) -> Vec<Row> {
            let bound = self.curved_bounds(z, ids)[0];
            vec![Row { first: 0, values: vec![2.0 * z[0], 2.0 * z[1]], bound }]
        }
    }

    #[test]
    fn a_curved_constraint_is_met_at_the_optimum() {
        let settings = Settings { iterations: 100, radius: 0.5, stall: 2e-4, deadline: None };
        let outcome = minimise(&mut Valley, vec![-1.0, 0.5], None, settings).unwrap();
        // From the stationarity conditions of the same problem, solved by bisection on the circle.
        let on_circle = |angle: f64| {
            let (s, c) = angle.sin_cos();
            let r = 1.5f64.sqrt();
            (1.0 - r * c).powi(2) + 10.0 * (r * s - r * r * c * c).powi(2)
        };
        let best = (0..200_000)
            .map(|k| on_circle(std::f64::consts::TAU * f64::from(k) / 200_000.0))
            .fold(f64::INFINITY, f64::min);
        assert!((outcome.point.objective - best).abs() < 2e-3, "{outcome:?} {best}");
        assert!(outcome.point.violation < 1e-4, "{outcome:?}");
    }
}
