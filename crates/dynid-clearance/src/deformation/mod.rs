//! Compliance of joints from the deformation that encoders on both sides of their gears show.
//!
//! Rows, all at the same instants: *sum rows* `e = S β + ε` (effort of the motors, spring torque eliminated) and per elastic
//! joint a *deformation row*
//!
//! ```text
//! δ = c T + N b + ν,   T = L β
//! ```
//!
//! with the compliance `c = 1/k` (rad/(N m)), the load `T` behind the spring and nuisances `N`: zeros of the logs, the lag
//! between the encoders (column `q̇`), hysteresis (`sign q̇`). Noise sits on the left of both, so each row may be weighted by its own
//! residual. A row `0 = T - k δ` must not: `(λβ, λk)` leaves the residual `λr`, and a fit that re-estimates its variance ends at zero
//! with any encoder. [`Verdict`] tells such fits by their loads, compared with those of the sum rows.
//!
//! [`fit`] starts with two steps (β from the sum rows alone, then δ on `T`), which is instrumental variables with the load of
//! the efforts as instrument, and goes on to maximum likelihood over all rows (errors in variables; Fuller 1987).

mod fit;
mod solve;
mod spread;
mod verdict;

pub use fit::fit;
pub use verdict::{Evidence, Verdict, judge};

/// Rows of one motor's effort.
#[derive(Debug, Clone)]
pub struct SumRows {
    /// `S`: `p` columns of `n` values.
    pub regressor: Vec<Vec<f64>>,
    /// `e`: `n` values, N m (N).
    pub effort: Vec<f64>,
}

/// Rows of one joint's deformation.
#[derive(Debug, Clone)]
pub struct DeformationRows {
    /// `L`: `p` columns of `n` values, `T = L β` in N m (N).
    pub load: Vec<Vec<f64>>,
    /// `N`: columns of `n` values.
    pub nuisances: Vec<Vec<f64>>,
    /// Columns of an error of the encoders that comes once per turn, `sin q` and `cos q`; not part of the fit, but of its check.
    pub once_per_turn: Vec<Vec<f64>>,
    /// `δ`: `n` values, rad (m).
    pub deformation: Vec<f64>,
}

/// Everything that a fit looks at.
#[derive(Debug, Clone)]
pub struct Rows {
    /// Parameters `β`.
    pub parameters: usize,
    /// One entry per motor.
    pub sums: Vec<SumRows>,
    /// One entry per elastic joint.
    pub joints: Vec<DeformationRows>,
    /// What is known of `β` beforehand: mean and standard deviation per parameter; empty if nothing is.
    pub prior: Vec<(f64, f64)>,
}

impl Rows {
    /// Instants `n`.
    pub fn samples(&self) -> usize {
        self.sums.first().map_or(0, |s| s.effort.len())
    }
}

/// How spreads are formed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Settings {
    /// Lag of the Bartlett window in rows, to cover 0.4 s or more (Newey & West 1987). Default 20.
    pub lag: usize,
    /// Blocks of time that the jackknife leaves out in turn. Default 10.
    pub blocks: usize,
}

impl Default for Settings {
    fn default() -> Self {
        Settings { lag: 20, blocks: 10 }
    }
}

/// Coefficients of one deformation row.
#[derive(Debug, Clone, PartialEq)]
pub struct Coefficients {
    /// `c`, rad/(N m).
    pub compliance: f64,
    /// `b`, in the order of the columns.
    pub nuisances: Vec<f64>,
    /// Standard deviations of `c` and `b` that hold with correlated residuals (Bartlett window).
    pub std: Vec<f64>,
    /// RMS residual of the row, rad.
    pub rms: f64,
    /// Load `T`, N m.
    pub load: Vec<f64>,
    /// Standard deviation of the load after projection on the nuisances, N m.
    pub load_alone: f64,
}

/// One fit of all rows.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// `β`.
    pub parameters: Vec<f64>,
    /// RMS residual per sum row, N m.
    pub rms: Vec<f64>,
    /// Per elastic joint.
    pub joints: Vec<Coefficients>,
}

/// Outcome of [`fit`].
#[derive(Debug, Clone, PartialEq)]
pub struct Deformation {
    /// β from the sum rows, then the deformation on its load.
    pub two_step: Fit,
    /// All rows together; the two steps where these did not converge.
    pub likelihood: Fit,
    /// Whether the likelihood's iteration settled.
    pub converged: bool,
    /// Per joint: standard deviations of `c` and the nuisances by leaving out blocks of time.
    pub jackknife: Vec<Vec<f64>>,
    /// Per joint: compliance with errors once per turn among the nuisances; `None` where these columns leave no load.
    pub once_per_turn: Vec<Option<f64>>,
    /// Per joint: standard deviation of `c` that covers correlated residuals and errors once per turn:
    /// `√(max(HAC, jackknife)² + (c_e - c)²)`.
    pub std_total: Vec<f64>,
}

/// Why rows cannot be fitted.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DeformationError {
    /// Columns of different length, or a number that is not finite.
    #[error("deformation rows: expected {expected}")]
    Rows {
        /// What was expected.
        expected: &'static str,
    },
    /// The iteration of the weights of the sum rows did not settle.
    #[error("deformation rows: a row of motor efforts is fitted exactly, which leaves it without a weight")]
    Exact,
}
