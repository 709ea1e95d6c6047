//! Strictly convex quadratic programs by the dual active-set method (Goldfarb & Idnani 1983).
//!
//! The method starts at the unconstrained minimum and adds violated constraints one by one, so it needs no feasible
//! start and costs little when few constraints act, which is the case here: tens of active among hundreds of rows.

/// A constraint `values · p[first..] ≤ bound` (`+ s` where an elastic variable is in use).
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Row {
    pub(crate) first: usize,
    pub(crate) values: Vec<f64>,
    pub(crate) bound: f64,
}

/// One shared elastic variable `s ≥ 0` that relaxes all rows at the price `linear s + ½ quadratic s²`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Elastic {
    pub(crate) linear: f64,
    pub(crate) quadratic: f64,
}

/// Minimise `½ pᵀ B p + g·p` subject to rows and `|p_i| ≤ radius`.
pub(crate) struct QuadraticProgram<'a> {
    /// `B`, symmetric positive definite, row-major.
    pub(crate) hessian: &'a [f64],
    pub(crate) gradient: &'a [f64],
    pub(crate) rows: &'a [Row],
    pub(crate) radius: f64,
    pub(crate) elastic: Option<Elastic>,
}

/// A minimum.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Minimum {
    pub(crate) step: Vec<f64>,
    /// One per row, ≥ 0.
    pub(crate) multipliers: Vec<f64>,
    pub(crate) elastic: f64,
}

/// Why there is no minimum.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Failure {
    /// `B` is not positive definite.
    Indefinite,
    /// Constraints contradict each other.
    Infeasible,
    /// Rounding kept the method from ending.
    Stalled,
}

impl QuadraticProgram<'_> {
    pub(crate) fn solve(&self) -> Result<Minimum, Failure> {
        let free = self.gradient.len();
        let n = free + usize::from(self.elastic.is_some());
        let mut solver = DualMethod::new(self, n)?;
        solver.run()?;
        let m = self.rows.len();
        let mut multipliers = vec![0.0; m];
        for (constraint, u) in solver.active.iter().zip(&solver.multipliers) {
            if *constraint < m {
                multipliers[*constraint] = *u;
            }
        }
        let elastic = if self.elastic.is_some() { solver.x[free] } else { 0.0 };
        solver.x.truncate(free);
        Ok(Minimum { step: solver.x, multipliers, elastic })
    }
}

/// Constraints are written `a·x ≥ b` and numbered: rows, lower box sides, upper box sides, `s ≥ 0`.
struct DualMethod<'a> {
    program: &'a QuadraticProgram<'a>,
    n: usize,
    x: Vec<f64>,
    /// `J = L⁻ᵀ Q`, column after column.
    j: Vec<f64>,
    /// Upper triangle of the active constraints, column after column, stride `n`.
    r: Vec<f64>,
    active: Vec<usize>,
    is_active: Vec<bool>,
    multipliers: Vec<f64>,
    norms: Vec<f64>,
}

impl<'a> DualMethod<'a> {
    fn new(program: &'a QuadraticProgram<'a>, n: usize) -> Result<Self, Failure> {
        let free = program.gradient.len();
        let mut h = vec![0.0; n * n];
        for i in 0..free {
            h[i * n..i * n + free].copy_from_slice(&program.hessian[i * free..(i + 1) * free]);
        }
        let mut g = program.gradient.to_vec();
        if let Some(elastic) = program.elastic {
            h[n * n - 1] = elastic.quadratic;
            g.push(elastic.linear);
        }
        let l = cholesky(h, n).ok_or(Failure::Indefinite)?;
        let j = inverse_transposed(&l, n);
        // x = -J Jᵀ g
        let mut x = vec![0.0; n];
        for column in j.chunks_exact(n) {
            let along = dot(column, &g);
            axpy(-along, column, &mut x);
        }
        let norms = program.rows.iter().map(|r| dot(&r.values, &r.values).sqrt()).collect();
        let constraints = program.rows.len() + 2 * free + usize::from(program.elastic.is_some());
        Ok(DualMethod {
            program,
            n,
            x,
            j,
            r: vec![0.0; n * n],
            active: Vec::with_capacity(n),
            is_active: vec![false; constraints],
            multipliers: Vec::with_capacity(n + 1),
            norms,
        })
    }

    fn free(&self) -> usize {
        self.program.gradient.len()
    }

    /// `a·x - b` of a constraint.
    fn slack(&self, constraint: usize) -> f64 {
        let (m, free) = (self.program.rows.len(), self.free());
        if let Some(row) = self.program.rows.get(constraint) {
            let relaxed = if self.program.elastic.is_some() { self.x[free] } else { 0.0 };
            return row.bound + relaxed - dot(&row.values, &self.x[row.first..]);
        }
        let side = constraint - m;
        if side < free {
            self.x[side] + self.program.radius
        } else if side < 2 * free {
            self.program.radius - self.x[side - free]
        } else {
            self.x[free]
        }
    }

    /// `Jᵀ a` of a constraint.
    fn transformed(&self, constraint: usize) -> Vec<f64> {
        let (m, free, n) = (self.program.rows.len(), self.free(), self.n);
        let columns = self.j.chunks_exact(n);
        if let Some(row) = self.program.rows.get(constraint) {
            let end = row.first + row.values.len();
            let elastic = self.program.elastic.is_some();
            return columns
                .map(|c| (if elastic { c[free] } else { 0.0 }) - dot(&row.values, &c[row.first..end]))
                .collect();
        }
        let side = constraint - m;
        if side < free {
            columns.map(|c| c[side]).collect()
        } else if side < 2 * free {
            columns.map(|c| -c[side - free]).collect()
        } else {
            columns.map(|c| c[free]).collect()
        }
    }

    /// Slack in units of the row's length if the constraint is violated.
    fn violation(&self, constraint: usize) -> Option<f64> {
        if self.is_active[constraint] {
            return None;
        }
        let length = self.norms.get(constraint).map_or(1.0, |norm| norm.max(1e-9));
        let slack = self.slack(constraint) / length;
        (slack < -1e-10).then_some(slack)
    }

    /// Takes the constraint that is violated most among `candidates` and leaves those that are violated now.
    fn most_violated(&self, candidates: &mut Vec<usize>) -> Option<usize> {
        let mut worst = (0.0, None);
        candidates.retain(|constraint| {
            let slack = self.violation(*constraint);
            if let Some(slack) = slack
                && slack < worst.0
            {
                worst = (slack, Some(*constraint));
            }
            slack.is_some()
        });
        worst.1
    }

    fn run(&mut self) -> Result<(), Failure> {
        // Few constraints are ever violated: all are looked at only when those that were have been met.
        let mut candidates = Vec::new();
        for _ in 0..20 * (self.n + 10) {
            let mut worst = self.most_violated(&mut candidates);
            if worst.is_none() {
                candidates.extend(0..self.is_active.len());
                worst = self.most_violated(&mut candidates);
            }
            match worst {
                None => return Ok(()),
                Some(constraint) => self.enforce(constraint)?,
            }
        }
        Err(Failure::Stalled)
    }

    /// Moves along the dual until a constraint holds, dropping those that stand in the way.
    fn enforce(&mut self, constraint: usize) -> Result<(), Failure> {
        let n = self.n;
        let mut multiplier = 0.0;
        for _ in 0..=2 * n {
            let q = self.active.len();
            let d = self.transformed(constraint);
            let curvature = dot(&d[q..], &d[q..]);
            let scale = curvature + dot(&d[..q], &d[..q]);
            let mut z = vec![0.0; n];
            for (k, column) in self.j.chunks_exact(n).enumerate().skip(q) {
                axpy(d[k], column, &mut z);
            }
            let r = self.solve_triangle(&d[..q]);
            let (mut dual_step, mut blocking) = (f64::INFINITY, None);
            for (k, (u, r)) in self.multipliers.iter().zip(&r).enumerate() {
                if *r > 0.0 && u / r < dual_step {
                    (dual_step, blocking) = (u / r, Some(k));
                }
            }
            let independent = curvature > 1e-14 * scale;
            let primal_step = if independent { -self.slack(constraint) / curvature } else { f64::INFINITY };
            let step = dual_step.min(primal_step);
            if !step.is_finite() {
                return Err(Failure::Infeasible);
            }
            for (u, r) in self.multipliers.iter_mut().zip(&r) {
                *u -= step * r;
            }
            multiplier += step;
            if independent {
                axpy(step, &z, &mut self.x);
            }
            if primal_step <= dual_step {
                self.add(constraint, multiplier, d, z);
                return Ok(());
            }
            match blocking {
                Some(k) => self.drop_active(k),
                None => return Err(Failure::Stalled),
            }
        }
        Err(Failure::Stalled)
    }

    fn solve_triangle(&self, d: &[f64]) -> Vec<f64> {
        let mut r = d.to_vec();
        for k in (0..r.len()).rev() {
            r[k] /= self.r[k * self.n + k];
            let x = r[k];
            axpy(-x, &self.r[k * self.n..][..k], &mut r);
        }
        r
    }

    /// Adds a constraint with `d = Jᵀ a` and `image = J₂ d₂`, the part of columns that are not in use: a reflection of these
    /// columns brings `d₂` onto the first of them.
    fn add(&mut self, constraint: usize, multiplier: f64, mut d: Vec<f64>, mut image: Vec<f64>) {
        let (n, q) = (self.n, self.active.len());
        let length = dot(&d[q..], &d[q..]).sqrt();
        let turned = -length.copysign(d[q]);
        // Reflector v = d₂ - turned e₁; its half square is length (length + |d_q|).
        axpy(-turned, &self.j[q * n..(q + 1) * n], &mut image);
        let half_square = length * (length + d[q].abs());
        d[q] -= turned;
        for (column, v) in self.j[q * n..].chunks_exact_mut(n).zip(&d[q..]) {
            axpy(-v / half_square, &image, column);
        }
        d[q] = turned;
        self.r[q * n..q * n + q + 1].copy_from_slice(&d[..=q]);
        self.active.push(constraint);
        self.is_active[constraint] = true;
        self.multipliers.push(multiplier);
    }

    fn drop_active(&mut self, k: usize) {
        let n = self.n;
        self.is_active[self.active[k]] = false;
        self.active.remove(k);
        self.multipliers.remove(k);
        let q = self.active.len();
        for column in k..q {
            self.r.copy_within((column + 1) * n..(column + 1) * n + column + 2, column * n);
        }
        for row in k..q {
            let (c, s, length) = rotation(self.r[row * n + row], self.r[row * n + row + 1]);
            self.r[row * n + row] = length;
            for column in row + 1..q {
                let at = column * n + row;
                let (a, b) = (self.r[at], self.r[at + 1]);
                self.r[at] = c * a + s * b;
                self.r[at + 1] = c * b - s * a;
            }
            self.rotate_columns(row, c, s);
        }
    }

    /// Turns columns `k` and `k + 1` of `J`.
    fn rotate_columns(&mut self, k: usize, c: f64, s: f64) {
        let (left, right) = self.j[k * self.n..(k + 2) * self.n].split_at_mut(self.n);
        for (a, b) in left.iter_mut().zip(right) {
            (*a, *b) = (c * *a + s * *b, c * *b - s * *a);
        }
    }
}

/// `c`, `s`, length with `c a + s b = length`, `c b - s a = 0`.
fn rotation(a: f64, b: f64) -> (f64, f64, f64) {
    let length = (a * a + b * b).sqrt();
    if length == 0.0 { (1.0, 0.0, 0.0) } else { (a / length, b / length, length) }
}

/// Partial sums side by side: one sum in order would wait for itself.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let length = a.len().min(b.len());
    let (a, b) = (a[..length].chunks_exact(8), b[..length].chunks_exact(8));
    let rest: f64 = a.remainder().iter().zip(b.remainder()).map(|(x, y)| x * y).sum();
    for (a, b) in a.zip(b) {
        for k in 0..8 {
            sums[k] += a[k] * b[k];
        }
    }
    sums.iter().sum::<f64>() + rest
}

fn axpy(factor: f64, x: &[f64], y: &mut [f64]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y += factor * x;
    }
}

/// Lower triangle `L` of `H = L Lᵀ`, row-major.
fn cholesky(mut h: Vec<f64>, n: usize) -> Option<Vec<f64>> {
    for i in 0..n {
        for k in 0..=i {
            let (above, below) = h.split_at(i * n);
            let sum = if k == i {
                below[i] - dot(&below[..i], &below[..i])
            } else {
                below[k] - dot(&below[..k], &above[k * n..k * n + k])
            };
            if k == i {
                if !(sum > 0.0 && sum.is_finite()) {
                    return None;
                }
                h[i * n + i] = sum.sqrt();
            } else {
                h[i * n + k] = sum / h[k * n + k];
            }
        }
    }
    Some(h)
}

/// `L⁻ᵀ`, column after column: column `k` is row `k` of `L⁻¹`.
fn inverse_transposed(l: &[f64], n: usize) -> Vec<f64> {
    let mut inverse = vec![0.0; n * n];
    for i in 0..n {
        let (done, rest) = inverse.split_at_mut(i * n);
        let row = &mut rest[..n];
        row[i] = 1.0;
        for k in 0..i {
            axpy(-l[i * n + k], &done[k * n..k * n + k + 1], row);
        }
        let pivot = 1.0 / l[i * n + i];
        row[..=i].iter_mut().for_each(|x| *x *= pivot);
    }
    inverse
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// Largest violation of the conditions of optimality.
    fn fault(program: &QuadraticProgram<'_>, minimum: &Minimum) -> f64 {
        let n = program.gradient.len();
        let p = &minimum.step;
        let mut slope = program.gradient.to_vec();
        for (s, row) in slope.iter_mut().zip(program.hessian.chunks_exact(n)) {
            *s += dot(row, p);
        }
        let mut worst: f64 = 0.0;
        let mut price = 0.0;
        for (row, u) in program.rows.iter().zip(&minimum.multipliers) {
            let slack = row.bound + minimum.elastic - dot(&row.values, &p[row.first..]);
            worst = worst.max(-slack).max(-u).max((u * slack).abs());
            price += u;
            axpy(*u, &row.values, &mut slope[row.first..]);
        }
        for (s, x) in slope.iter().zip(p) {
            // What is left must be a multiplier of an active box side.
            let at_box = (x.abs() - program.radius).abs() < 1e-9 && s * x <= 0.0;
            worst = worst.max(x.abs() - program.radius).max(if at_box { 0.0 } else { s.abs() });
        }
        if let Some(e) = program.elastic {
            let slope = e.linear + e.quadratic * minimum.elastic - price;
            worst = worst.max(-slope).max((slope * minimum.elastic).abs()).max(-minimum.elastic);
        }
        worst
    }

    #[test]
    fn random_programs_end_at_points_that_meet_the_conditions_of_optimality() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        for case in 0..300 {
            let n = 1 + case % 20;
            let root: Vec<f64> = (0..n * n).map(|_| rng.random_range(-1.0..=1.0)).collect();
            let mut hessian = vec![0.0; n * n];
            for i in 0..n {
                for j in 0..n {
                    hessian[i * n + j] = dot(&root[i * n..(i + 1) * n], &root[j * n..(j + 1) * n]);
                }
                hessian[i * n + i] += 0.01;
            }
            let gradient: Vec<f64> = (0..n).map(|_| rng.random_range(-2.0..=2.0)).collect();
            let rows: Vec<Row> = (0..3 * n)
                .map(|_| {
                    let first = rng.random_range(0..n);
                    let length = rng.random_range(1..=n - first);
                    Row {
                        first,
                        values: (0..length).map(|_| rng.random_range(-1.0..=1.0)).collect(),
                        bound: rng.random_range(-0.2..=0.5),
                    }
                })
                .collect();
            let program = QuadraticProgram {
                hessian: &hessian,
                gradient: &gradient,
                rows: &rows,
                radius: 0.8,
                elastic: Some(Elastic { linear: 10.0, quadratic: 1e-4 }),
            };
            let minimum = program.solve().unwrap();
            let worst = fault(&program, &minimum);
            assert!(worst < 1e-7, "case {case}: {worst:e}");
        }
    }

    #[test]
    fn contradictions_and_indefinite_matrices_are_told() {
        let rows = [
            Row { first: 0, values: vec![1.0], bound: -0.5 },
            Row { first: 0, values: vec![-1.0], bound: -0.5 },
        ];
        let mut program =
            QuadraticProgram { hessian: &[1.0], gradient: &[0.0], rows: &rows, radius: 1.0, elastic: None };
        assert_eq!(program.solve(), Err(Failure::Infeasible));
        program.elastic = Some(Elastic { linear: 10.0, quadratic: 1e-4 });
        let minimum = program.solve().unwrap();
        assert!((minimum.elastic - 0.5).abs() < 1e-9, "{minimum:?}");
        program.hessian = &[-1.0];
        assert_eq!(program.solve(), Err(Failure::Indefinite));
    }
}
