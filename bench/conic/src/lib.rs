//! Consistent estimates by the conic solver `clarabel`: a second opinion on `dynid_estimate::consistent`.
//!
//! Posed here from the definition of the problem, with no code of that module: `min t` such that `‖(R ξ - q, ρ)‖ ≤ t`, links positive semidefinite, scalars and bounds on half-lines: the objective is
//! `t²`. A quadratic objective instead loses digits, since its gap is measured against `‖z‖²`.

use clarabel::algebra::CscMatrix;
pub use clarabel::solver::SolverStatus;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, SupportedConeT};

use dynid_estimate::consistent::{Form, Margin, Problem, Settings};
use dynid_linalg::Mat;
use dynid_model::Inertia;
use dynid_model::symmetric::{Square, cholesky, congruence, identity, lower_inverse, trace};

/// Entries of the upper triangle of an `n × n` matrix, column by column.
fn triangle(n: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..n).flat_map(|j| (0..=j).map(move |i| (i, j)))
}

/// The upper triangle, entries off the diagonal times `√2`.
fn svec<const N: usize>(s: &Square<N>) -> Vec<f64> {
    triangle(N).map(|(i, j)| if i == j { s[i][i] } else { std::f64::consts::SQRT_2 * s[i][j] }).collect()
}

fn unit(i: usize, j: usize) -> Square<4> {
    let mut e = [[0.0; 4]; 4];
    let entry = if i == j { 1.0 } else { std::f64::consts::FRAC_1_SQRT_2 };
    (e[i][j], e[j][i]) = (entry, entry);
    e
}

/// Problem in the conic solver's form, `A y + s = b` with `y = (t, ξ)` and `s` in a product of cones.
#[derive(Debug)]
pub struct Conic {
    a: CscMatrix<f64>,
    b: Vec<f64>,
    cones: Vec<SupportedConeT<f64>>,
    /// `x = T ξ`.
    unwhiten: Mat,
}

/// What the conic solver says.
#[derive(Debug)]
pub struct Answer {
    /// How it ended; `AlmostSolved` is within 5e-5 by its own measure.
    pub status: SolverStatus,
    /// Parameters, consistent up to the solver's tolerance only.
    pub x: Vec<f64>,
    /// Objective that its multipliers prove to be a lower bound, up to its tolerance.
    pub dual: f64,
    /// Iterations.
    pub iterations: u32,
}

/// Rows of `A` and `b`.
#[derive(Default)]
struct Rows {
    row: Vec<usize>,
    column: Vec<usize>,
    value: Vec<f64>,
    b: Vec<f64>,
}

impl Rows {
    /// `s = b - Σ a y`.
    fn push(&mut self, a: impl IntoIterator<Item = (usize, f64)>, b: f64) {
        for (column, value) in a.into_iter().filter(|(_, value)| *value != 0.0) {
            self.row.push(self.b.len());
            self.column.push(column);
            self.value.push(value);
        }
        self.b.push(b);
    }

    fn append(&mut self, mut other: Rows) {
        self.row.extend(other.row.iter().map(|row| row + self.b.len()));
        self.column.append(&mut other.column);
        self.value.append(&mut other.value);
        self.b.append(&mut other.b);
    }

    /// `s = svec(Σ_j ξ_j E_j - margin 1)` with unknowns from `first`.
    fn push_matrix<const N: usize>(&mut self, first: usize, basis: &[Square<N>], margin: f64) {
        let columns: Vec<Vec<f64>> = basis.iter().map(svec).collect();
        for (k, one) in svec(&identity::<N>()).into_iter().enumerate() {
            self.push(columns.iter().enumerate().map(|(j, c)| (1 + first + j, -c[k])), -margin * one);
        }
    }

    /// `s = (t, R ξ - q, ρ)` with `‖(R ξ - q, ρ)‖² = ‖r T ξ - z‖² + pull² ‖ξ - prior‖²` by QR of the stack.
    fn push_objective(&mut self, problem: &Problem, pull: f64, unwhiten: &Mat, prior: &[f64]) {
        let (m, p) = (problem.z.len(), problem.columns());
        let whitened = &problem.r * unwhiten;
        let stack = Mat::from_fn(m + p, p, |i, j| match i.checked_sub(m) {
            None => whitened[(i, j)],
            Some(k) if k == j => pull,
            Some(_) => 0.0,
        });
        let side = Mat::from_fn(m + p, 1, |i, _| if i < m { problem.z[i] } else { pull * prior[i - m] });
        let qr = stack.qr();
        let (q, r) = (qr.q(), qr.r());
        let seen = q.transpose() * &side;
        self.push([(0, -1.0)], 0.0);
        for i in 0..p {
            self.push((i..p).map(|j| (1 + j, -r[(i, j)])), -seen[(i, 0)]);
        }
        self.push([], (&side - &q * &seen).norm_l2());
    }
}

impl Conic {
    /// Poses the problem.
    ///
    /// # Panics
    /// Unless the margin is relative and the entropic weight zero (no semidefinite programme otherwise), sizes agree and
    /// priors are bodies.
    pub fn new(problem: &Problem, settings: &Settings) -> Self {
        let Margin::Relative(margin) = settings.margin else { panic!("expected a relative margin") };
        assert_eq!(settings.entropic_weight, 0.0, "entropic weight");
        let p = problem.columns();
        let mut unwhiten = Mat::zeros(p, p);
        let mut prior = vec![0.0; p];
        let mut links = Rows::default();
        for link in &problem.links {
            let first = link.first_column;
            let l = cholesky(&link.prior.pseudo_inertia()).expect("priors are bodies");
            let units: Vec<Square<4>> = triangle(4).map(|(i, j)| unit(i, j)).collect();
            let bodies: Vec<Inertia> =
                units.iter().map(|e| Inertia::from_pseudo_inertia(&congruence(&l, e))).collect();
            for (k, (e, body)) in units.iter().zip(&bodies).enumerate() {
                (0..10).for_each(|i| unwhiten[(first + i, first + k)] = body.0[i]);
                // The prior is the unit matrix.
                prior[first + k] = trace(e);
            }
            match settings.form {
                Form::PseudoInertia => links.push_matrix(first, &units, margin),
                Form::SpatialInertia => {
                    let back = lower_inverse(&cholesky(&link.prior.spatial_inertia()).expect("a body"));
                    let white = |body: &Inertia| congruence(&back, &body.spatial_inertia());
                    links.push_matrix::<6>(first, &bodies.iter().map(white).collect::<Vec<_>>(), margin);
                }
            }
        }
        for scalar in &problem.scalars {
            unwhiten[(scalar.column, scalar.column)] = scalar.scale;
            prior[scalar.column] = scalar.prior / scalar.scale;
        }

        let mut rows = Rows::default();
        rows.push_objective(problem, settings.prior_weight.sqrt(), &unwhiten, &prior);
        let objective = rows.b.len();
        for scalar in problem.scalars.iter().filter(|s| s.nonnegative) {
            rows.push([(1 + scalar.column, -1.0)], -margin);
        }
        for bound in &problem.bounds {
            let along = |j: usize| bound.terms.iter().map(|(c, f)| f * unwhiten[(*c, j)]).sum::<f64>();
            let factors: Vec<f64> = (0..p).map(along).collect();
            let length = factors.iter().map(|f| f * f).sum::<f64>().sqrt();
            rows.push(factors.iter().enumerate().map(|(j, f)| (1 + j, f / length)), bound.upper / length);
        }
        let half_lines = rows.b.len() - objective;
        rows.append(links);

        let size = match settings.form {
            Form::PseudoInertia => 4,
            Form::SpatialInertia => 6,
        };
        let mut cones =
            vec![SupportedConeT::SecondOrderConeT(objective), SupportedConeT::NonnegativeConeT(half_lines)];
        cones.resize(2 + problem.links.len(), SupportedConeT::PSDTriangleConeT(size));
        let a = CscMatrix::new_from_triplets(rows.b.len(), p + 1, rows.row, rows.column, rows.value);
        Conic { a, b: rows.b, cones, unwhiten }
    }

    /// Runs the solver with one tolerance for gap and feasibility.
    pub fn solve(&self, tolerance: f64) -> Answer {
        let n = self.a.n;
        let settings = DefaultSettings {
            verbose: false,
            tol_gap_abs: tolerance,
            tol_gap_rel: tolerance,
            tol_feas: tolerance,
            // Dense matrices of size 4 or 6 have nothing to decompose.
            chordal_decomposition_enable: false,
            ..DefaultSettings::default()
        };
        let mut cost = vec![0.0; n];
        cost[0] = 1.0;
        let quadratic = CscMatrix::zeros((n, n));
        let mut solver = DefaultSolver::new(&quadratic, &cost, &self.a, &self.b, &self.cones, settings)
            .expect("the sizes agree");
        solver.solve();
        let found = &solver.solution;
        let xi = Mat::from_fn(n - 1, 1, |k, _| found.x[k + 1]);
        let x = &self.unwhiten * &xi;
        Answer {
            status: found.status,
            x: (0..n - 1).map(|k| x[(k, 0)]).collect(),
            dual: found.obj_val_dual.max(0.0).powi(2),
            iterations: found.iterations,
        }
    }
}
