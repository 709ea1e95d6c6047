//! Small convex programs: a quadratic under linear and planar-body constraints, by a logarithmic barrier.

use dynid_linalg::Mat;

/// Growth of the weight of the objective from one centre to the next.
const GROWTH: f64 = 10.0;
/// Newton steps per centre.
const STEPS: usize = 60;
/// Newton decrement below which a centre is reached.
const CENTRED: f64 = 1e-10;
/// Slack below which a point counts as strictly inside.
const INSIDE: f64 = -1e-9;

/// `constant + factors · x`.
#[derive(Debug, Clone)]
pub(super) struct Affine {
    pub(super) constant: f64,
    pub(super) factors: Vec<f64>,
}

impl Affine {
    fn at(&self, x: &[f64]) -> f64 {
        self.constant + self.factors.iter().zip(x).map(|(f, x)| f * x).sum::<f64>()
    }

    fn is_constant(&self) -> bool {
        self.factors.iter().all(|f| *f == 0.0)
    }
}

/// What must hold, and by how much a slack of 1 relaxes each part.
#[derive(Debug, Clone)]
pub(super) enum Constraint {
    /// `value >= 0`.
    Positive { value: Affine, unit: f64 },
    /// `inertia · mass >= Σ moment²`, `mass >= 0`: moment of inertia about the centre of mass.
    Body { inertia: Affine, mass: Affine, moments: Vec<Affine>, units: (f64, f64) },
}

/// Value, gradient and Hessian of a term.
type Term = (f64, Vec<f64>, Mat);

impl Constraint {
    /// Whether it says nothing about `x`; then whether it holds.
    pub(super) fn settled(&self) -> Option<bool> {
        match self {
            Constraint::Positive { value, .. } => value.is_constant().then_some(value.constant >= 0.0),
            Constraint::Body { inertia, mass, moments, .. } => {
                let fixed =
                    inertia.is_constant() && mass.is_constant() && moments.iter().all(Affine::is_constant);
                let square: f64 = moments.iter().map(|h| h.constant * h.constant).sum();
                fixed.then_some(mass.constant >= 0.0 && inertia.constant * mass.constant >= square)
            }
        }
    }

    fn degree(&self) -> f64 {
        match self {
            Constraint::Positive { .. } => 1.0,
            Constraint::Body { .. } => 2.0,
        }
    }

    /// The constraint with a slack as last variable.
    fn relaxed(&self) -> Constraint {
        let with = |a: &Affine, unit: f64| {
            let mut factors = a.factors.clone();
            factors.push(unit);
            Affine { constant: a.constant, factors }
        };
        match self {
            Constraint::Positive { value, unit } => {
                Constraint::Positive { value: with(value, *unit), unit: *unit }
            }
            Constraint::Body { inertia, mass, moments, units } => Constraint::Body {
                inertia: with(inertia, units.0),
                mass: with(mass, units.1),
                moments: moments.iter().map(|h| with(h, 0.0)).collect(),
                units: *units,
            },
        }
    }

    /// `-ln` of what must be positive; `None` outside.
    fn barrier(&self, x: &[f64]) -> Option<f64> {
        match self {
            Constraint::Positive { value, .. } => {
                let f = value.at(x);
                (f > 0.0).then(|| -f.ln())
            }
            Constraint::Body { inertia, mass, moments, .. } => {
                let (u, m) = (inertia.at(x), mass.at(x));
                let d = u * m - moments.iter().map(|h| h.at(x).powi(2)).sum::<f64>();
                (m > 0.0 && d > 0.0).then(|| -d.ln())
            }
        }
    }

    fn add_to(&self, x: &[f64], (value, gradient, hessian): &mut Term) {
        let Some(barrier) = self.barrier(x) else {
            *value = f64::INFINITY;
            return;
        };
        *value += barrier;
        let n = x.len();
        let mut outer = |a: &[f64], b: &[f64], factor: f64| {
            for j in 0..n {
                for i in 0..n {
                    hessian[(i, j)] += factor * a[i] * b[j];
                }
            }
        };
        match self {
            Constraint::Positive { value, .. } => {
                let f = value.at(x);
                outer(&value.factors, &value.factors, 1.0 / (f * f));
                gradient.iter_mut().zip(&value.factors).for_each(|(g, b)| *g -= b / f);
            }
            Constraint::Body { inertia, mass, moments, .. } => {
                let (u, m) = (inertia.at(x), mass.at(x));
                let d = u * m - moments.iter().map(|h| h.at(x).powi(2)).sum::<f64>();
                let mut slope = vec![0.0; n];
                for (k, s) in slope.iter_mut().enumerate() {
                    *s = m * inertia.factors[k] + u * mass.factors[k]
                        - 2.0 * moments.iter().map(|h| h.at(x) * h.factors[k]).sum::<f64>();
                }
                outer(&slope, &slope, 1.0 / (d * d));
                outer(&inertia.factors, &mass.factors, -1.0 / d);
                outer(&mass.factors, &inertia.factors, -1.0 / d);
                moments.iter().for_each(|h| outer(&h.factors, &h.factors, 2.0 / d));
                gradient.iter_mut().zip(&slope).for_each(|(g, s)| *g -= s / d);
            }
        }
    }
}

/// `min ½ xᵀ H x + g · x`, `H` positive definite, under constraints.
#[derive(Debug, Clone)]
pub(super) struct Program {
    pub(super) hessian: Mat,
    pub(super) gradient: Vec<f64>,
    pub(super) constraints: Vec<Constraint>,
}

/// End of a program.
#[derive(Debug, Clone)]
pub(super) struct Optimum {
    /// Strictly inside all constraints.
    pub(super) x: Vec<f64>,
    /// The objective is at most this much above its least value, up to rounding.
    pub(super) gap: f64,
}

impl Program {
    /// The optimum to an objective within `tolerance`, or the least slack if no point is strictly inside.
    pub(super) fn solve(mut self, tolerance: f64) -> Result<Optimum, f64> {
        if self.constraints.iter().any(|c| c.settled() == Some(false)) {
            return Err(f64::INFINITY);
        }
        self.constraints.retain(|c| c.settled().is_none());
        if self.gradient.is_empty() {
            return Ok(Optimum { x: Vec::new(), gap: 0.0 });
        }
        let x = self.inside()?;
        Ok(self.follow(x, tolerance, |_| false))
    }

    fn degree(&self) -> f64 {
        self.constraints.iter().map(Constraint::degree).sum::<f64>().max(1.0)
    }

    /// A point strictly inside: the least slack with which all constraints hold, sought until it is negative.
    fn inside(&self) -> Result<Vec<f64>, f64> {
        let n = self.gradient.len();
        let origin = vec![0.0; n];
        if self.constraints.iter().all(|c| c.barrier(&origin).is_some()) {
            return Ok(origin);
        }
        let mut gradient = vec![0.0; n + 1];
        gradient[n] = 1.0;
        let relaxed = Program {
            // A faint pull to the origin keeps directions without a constraint where they are.
            hessian: Mat::from_fn(n + 1, n + 1, |i, j| if i == j { 1e-8 } else { 0.0 }),
            gradient,
            constraints: self.constraints.iter().map(Constraint::relaxed).collect(),
        };
        let mut start = vec![0.0; n + 1];
        start[n] = 1.0;
        while relaxed.constraints.iter().any(|c| c.barrier(&start).is_none()) {
            start[n] *= 2.0;
            if !start[n].is_finite() {
                return Err(f64::INFINITY);
            }
        }
        let found = relaxed.follow(start, 1e-10, |x| x[n] < INSIDE);
        let slack = found.x[n];
        if slack < INSIDE { Ok(found.x[..n].to_vec()) } else { Err(slack) }
    }

    /// Centres with growing weight of the objective, until the gap is small or `done`.
    fn follow(&self, mut x: Vec<f64>, tolerance: f64, done: impl Fn(&[f64]) -> bool) -> Optimum {
        let degree = self.degree();
        let mut weight = 1.0;
        loop {
            for _ in 0..STEPS {
                if !self.step(&mut x, weight) || done(&x) {
                    break;
                }
            }
            let gap = degree / weight;
            if gap <= tolerance || done(&x) {
                return Optimum { x, gap };
            }
            weight *= GROWTH;
        }
    }

    fn value(&self, x: &[f64], weight: f64) -> f64 {
        let barrier: f64 = self.constraints.iter().map(|c| c.barrier(x).unwrap_or(f64::INFINITY)).sum();
        let mut objective = 0.0;
        for j in 0..x.len() {
            let row: f64 = (0..x.len()).map(|i| self.hessian[(i, j)] * x[i]).sum();
            objective += x[j] * (0.5 * row + self.gradient[j]);
        }
        weight * objective + barrier
    }

    /// A damped Newton step; false at the centre, or where rounding allows none.
    fn step(&self, x: &mut Vec<f64>, weight: f64) -> bool {
        let n = x.len();
        let mut term: Term = (0.0, vec![0.0; n], &self.hessian * weight);
        for i in 0..n {
            let row: f64 = (0..n).map(|j| self.hessian[(i, j)] * x[j]).sum();
            term.1[i] = weight * (row + self.gradient[i]);
        }
        self.constraints.iter().for_each(|c| c.add_to(x, &mut term));
        let (_, gradient, hessian) = term;
        let Some(factor) = hessian.cholesky() else { return false };
        let step = factor.solve(&Mat::from_fn(n, 1, |i, _| -gradient[i]));
        let decrement: f64 = -(0..n).map(|i| gradient[i] * step[(i, 0)]).sum::<f64>();
        if decrement.is_nan() || decrement <= CENTRED {
            return false;
        }
        let from = self.value(x, weight);
        let mut share = 1.0;
        while share > 1e-10 {
            let next: Vec<f64> = (0..n).map(|i| x[i] + share * step[(i, 0)]).collect();
            if self.value(&next, weight) <= from - 1e-4 * share * decrement {
                *x = next;
                return true;
            }
            share *= 0.5;
        }
        false
    }
}
