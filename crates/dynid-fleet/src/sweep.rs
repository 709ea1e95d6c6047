//! Once up and once down the fleet at given variances: generalised least squares by QR, and every deviation.
//!
//! Rows of a log `y = R_ff (f + b + c + Γ u) + R_fβ β + e` know of its deviation `c ~ N(0, D_c)`, whose variance goes into
//! `S = 1 + R_ff D_c R_ffᵀ`. Whitened by the Cholesky factor of `S` they hold the robot's parameters alone. The rows of all logs of a robot
//! are split at `f` and whitened alike for its deviation `b`; what is left, of all robots, is an ordinary factor of the type's parameters
//! `θ = (f, Γ, β)`. Nothing is inverted but `S ⪰ 1`, so columns that a log does not excite do no harm.
//!
//! Source: Lindley and Smith 1972, Harville 1977, Laird and Ware 1982.

use dynid_linalg::triangular::{inverse, solve_lower_in_place};
use dynid_linalg::{AsView, Mat, View};
use rayon::prelude::*;

use crate::data::FleetError;
use crate::split::Splits;
use crate::spread::Variances;
use crate::tree;
use crate::triangle::{behind, corner, head, of_stacked, squares, times, triangle};

/// A pivot below this share of its column's norm says that no log tells the column.
const EXCITED: f64 = 1e-10;

/// The fleet at given variances.
#[derive(Debug)]
pub(crate) struct Sweep<'a> {
    pub(crate) splits: &'a Splits,
    pub(crate) variances: &'a Variances,
    /// Per log: whitened rows `[f | β | z]`.
    pub(crate) logs: Vec<Mat>,
    /// Per robot: whitened rows `[f | Γ | β | z]`; empty without logs.
    robots: Vec<Mat>,
    /// Per robot with logs, by key: what it says of the type, `[[R, z], [0, ρ]]`.
    pub(crate) factors: Vec<(u64, Mat)>,
    /// `(f, Γ, β)`.
    pub(crate) theta: Vec<f64>,
    /// `(R_θᵀ R_θ)⁻¹`.
    pub(crate) covariance: Mat,
    /// Minus twice the restricted log likelihood, but for what no variance changes.
    pub(crate) m2l: f64,
}

/// A deviation that is told in part by its prior.
pub(crate) struct Deviation {
    /// Mean.
    pub(crate) mean: Vec<f64>,
    /// `D - M_f D`: its covariance where the parameters above it are known.
    pub(crate) given: Mat,
    /// `M C Mᵀ`: what their own uncertainty adds.
    pub(crate) added: Mat,
}

impl Deviation {
    /// Variance of a coordinate.
    pub(crate) fn variance(&self, k: usize) -> f64 {
        self.given[(k, k)] + self.added[(k, k)]
    }
}

/// What is known of a robot.
pub(crate) struct RobotState {
    /// Its deviation `b`.
    pub(crate) deviation: Deviation,
    /// `(f + b, Γ, β)`.
    pub(crate) values: Vec<f64>,
    /// Their covariance.
    pub(crate) covariance: Mat,
}

impl<'a> Sweep<'a> {
    /// # Errors
    /// [`FleetError::NotExcited`], [`FleetError::Confounded`].
    pub(crate) fn new(
        splits: &'a Splits,
        variances: &'a Variances,
        prior: Option<&Mat>,
    ) -> Result<Self, FleetError> {
        let up =
            |(k, log): (usize, &crate::split::LogSplit)| whitened(&log.top, splits.q, &variances.of_log(k));
        let (logs, of_logs): (Vec<Mat>, Vec<f64>) = splits.logs.par_iter().enumerate().map(up).unzip();
        let robots: Vec<(Mat, Mat, f64)> =
            (0..splits.by_robot.len()).into_par_iter().map(|r| robot(splits, variances, &logs, r)).collect();
        let of_robots: f64 = splits.robots.iter().map(|(_, r)| robots[*r].2).sum();
        let of_logs: f64 = splits.ordered.iter().map(|k| of_logs[*k]).sum();
        let (tops, mut factors): (Vec<Mat>, Vec<Mat>) =
            robots.into_iter().map(|(top, factor, _)| (top, factor)).unzip();
        let factors: Vec<(u64, Mat)> = splits
            .robots
            .iter()
            .map(|(key, r)| (*key, std::mem::replace(&mut factors[*r], Mat::zeros(0, 0))))
            .collect();
        let parts: Vec<(u64, &Mat)> = factors.iter().map(|(key, factor)| (*key, factor)).collect();
        let width = splits.parameters() + 1;
        let merged = tree::merge(&parts).unwrap_or_else(|| Mat::zeros(0, width));
        let merged = prior.map_or_else(|| merged.clone(), |prior| triangle(&[prior.view(), merged.view()]));
        let factor = head(&merged, width);
        let p = width - 1;
        check_excited(splits, &factor)?;
        let r = Mat::from_fn(p, p, |i, j| factor[(i, j)]);
        let root = inverse(&r);
        let z: Vec<f64> = (0..p).map(|i| factor[(i, p)]).collect();
        let theta = times(&root, &z);
        let covariance = root.view() * root.transpose();
        let logdet: f64 = (0..p).map(|i| 2.0 * factor[(i, i)].ln()).sum();
        let m2l = of_logs + of_robots + logdet + squares([factor[(p, p)]]);
        Ok(Sweep { splits, variances, logs, robots: tops, factors, theta, covariance, m2l })
    }

    /// What is known of a robot with logs.
    pub(crate) fn robot(&self, r: usize) -> RobotState {
        let p = self.theta.len();
        let (deviation, map) = deviation(
            self.robots[r].view(),
            (self.splits.q, 0),
            &self.variances.of_robot(r),
            &self.theta,
            &self.covariance,
        );
        let mut values = self.theta.clone();
        values.iter_mut().zip(&deviation.mean).for_each(|(x, b)| *x += b);
        // A C Aᵀ with A = 1 - E M, and the robot's own variance.
        let q = self.splits.q;
        let mut covariance = self.covariance.clone();
        for i in 0..p {
            for j in 0..q {
                covariance[(j, i)] -= map[(j, i)];
                covariance[(i, j)] -= map[(j, i)];
            }
        }
        for i in 0..q {
            for j in 0..q {
                covariance[(i, j)] += deviation.added[(i, j)] + deviation.given[(i, j)];
            }
        }
        RobotState { deviation, values, covariance }
    }

    /// The deviation of a log from its robot.
    pub(crate) fn log(&self, k: usize, robot: &RobotState) -> Deviation {
        let rows = self.splits.with_slopes(&self.logs[k], &self.splits.logs[k].covariates);
        deviation(
            rows.view(),
            (self.splits.q, 0),
            &self.variances.of_log(k),
            &robot.values,
            &robot.covariance,
        )
        .0
    }

    /// How errors of the parameters of its robot are in the values `f + b + Γ u + c` of a log's coordinates (`q × p`), and the covariance of these
    /// values where the robot's are known.
    pub(crate) fn errors_of_log(&self, k: usize) -> (Mat, Mat) {
        let q = self.splits.q;
        let covariates = &self.splits.logs[k].covariates;
        let rows = self.splits.with_slopes(&self.logs[k], covariates);
        let Response { map, given, .. } =
            Response::of(rows.view(), (q, 0), self.theta.len(), &self.variances.of_log(k));
        let own = |i: usize, j: usize| match j {
            _ if j < q => f64::from(j == i),
            _ if j < q + q * covariates.len() => f64::from((j - q) % q == i) * covariates[(j - q) / q],
            _ => 0.0,
        };
        (Mat::from_fn(q, self.theta.len(), |i, j| own(i, j) - map[(i, j)]), given)
    }

    /// How errors of the parameters of the type are in the deviation of a robot, with the other sign (`q × p`), and the covariance of the deviation
    /// where the type is known.
    pub(crate) fn errors_of_robot(&self, r: usize) -> (Mat, Mat) {
        let Response { map, given, .. } = Response::of(
            self.robots[r].view(),
            (self.splits.q, 0),
            self.theta.len(),
            &self.variances.of_robot(r),
        );
        (map, given)
    }

    /// Largest information on every coordinate that one robot has, and one log.
    pub(crate) fn information(&self) -> (Vec<f64>, Vec<f64>) {
        let largest = |rows: &[Mat]| {
            let of = |k: usize| {
                rows.iter().filter(|m| m.nrows() > 0).map(|m| m.col_squares(k)).fold(0.0, f64::max)
            };
            (0..self.splits.q).map(of).collect()
        };
        (largest(&self.robots), largest(&self.logs))
    }
}

/// `C⁻¹ [R_ff ...]` with `S = 1 + R_ff D R_ffᵀ = C Cᵀ`, and `ln |S|`.
pub(crate) fn whitened(top: &Mat, q: usize, variances: &[f64]) -> (Mat, f64) {
    let n = top.nrows();
    let scaled = Mat::from_fn(n, q, |i, j| top[(i, j)] * variances[j].sqrt());
    let mut s = scaled.view() * scaled.transpose();
    for i in 0..n {
        s[(i, i)] += 1.0;
    }
    // At least the unit matrix: positive definite.
    let Some(factor) = s.cholesky() else { unreachable!("1 + A Aᵀ of finite numbers") };
    let mut rows = top.clone();
    solve_lower_in_place(&factor.lower(), &mut rows);
    let lower = factor.lower();
    (rows, (0..n).map(|i| 2.0 * lower[(i, i)].ln()).sum())
}

/// Whitened rows of a robot, what it says of the type, and its share of the logarithm of the determinants.
fn robot(splits: &Splits, variances: &Variances, logs: &[Mat], r: usize) -> (Mat, Mat, f64) {
    let (q, p) = (splits.q, splits.parameters());
    let of_robot = &splits.by_robot[r];
    let Some(lower) = &splits.lower[r] else { return (Mat::zeros(0, p + 1), Mat::zeros(0, p + 1), 0.0) };
    let mut stacked = Mat::zeros(of_robot.len() * q, p + 1);
    for (at, k) in of_robot.iter().enumerate() {
        stacked.set_rows(at * q, &splits.with_slopes(&logs[*k], &splits.logs[*k].covariates));
    }
    let all = of_stacked(stacked);
    let (top, logdet) = whitened(&head(&all, q), q, &variances.of_robot(r));
    let below = behind(&corner(&all, q, q), q);
    let shared = behind(lower, p + 1 - lower.ncols());
    let factor = triangle(&[top.view(), below.view(), shared.view()]);
    (top, factor, logdet)
}

/// How a deviation follows from rows `[f | ... | z]` that were whitened with its variances `D` in them.
struct Response {
    /// `K = D R_ffᵀ S⁻¹` of the rows before they were whitened.
    gain: Mat,
    /// `M`, by which the deviation follows errors of the parameters above it with the other sign.
    map: Mat,
    /// `D - M_f D`: covariance of the deviation where these are known.
    given: Mat,
}

impl Response {
    /// `first`: column of the first of `p` parameters, with the effort behind them; columns of the deviation are the first `q`.
    fn of(rows: View<'_>, (q, first): (usize, usize), p: usize, variances: &[f64]) -> Response {
        let gain = Mat::from_fn(q, rows.nrows(), |i, j| variances[i] * rows[(j, i)]);
        let map = gain.view() * rows.columns(first..first + p);
        let own = if first == 0 { map.columns(0..q).to_mat() } else { gain.view() * rows.columns(0..q) };
        let given = Mat::from_fn(q, q, |i, j| {
            let prior = if i == j { variances[i] } else { 0.0 };
            prior - 0.5 * (own[(i, j)] * variances[j] + own[(j, i)] * variances[i])
        });
        Response { gain, map, given }
    }
}

/// Posterior of a deviation with variances `D` from whitened rows `[f | ... | z]`, and `M C`.
///
/// `first`: column of the first of the parameters `x`, with the effort behind them; columns of the deviation are the first `q`.
pub(crate) fn deviation(
    rows: View<'_>,
    (q, first): (usize, usize),
    variances: &[f64],
    x: &[f64],
    covariance: &Mat,
) -> (Deviation, Mat) {
    let p = x.len();
    let fitted = times(&rows.columns(first..first + p), x);
    let residual: Vec<f64> = (0..rows.nrows()).map(|i| rows[(i, first + p)] - fitted[i]).collect();
    let Response { gain, map, given } = Response::of(rows, (q, first), p, variances);
    let mean = gain.times(&residual);
    let followed = map.view() * covariance;
    let added = followed.view() * map.transpose();
    (Deviation { mean, given, added }, followed)
}

/// Every column of the type has a pivot worth the name.
fn check_excited(splits: &Splits, factor: &Mat) -> Result<(), FleetError> {
    let slopes = splits.q * splits.covariates;
    let (mut columns, mut confounded) = (Vec::new(), None);
    for j in 0..splits.parameters() {
        let norm = factor.col_norm(j);
        if factor[(j, j)] > EXCITED * norm && norm.is_finite() && norm > 0.0 {
            continue;
        }
        match j {
            _ if j < splits.q => columns.push(splits.order[j]),
            _ if j < splits.q + slopes => confounded = Some((j - splits.q) / splits.q),
            _ => columns.push(splits.order[j - slopes]),
        }
    }
    columns.sort_unstable();
    match (columns.is_empty(), confounded) {
        (false, _) => Err(FleetError::NotExcited { columns }),
        (true, Some(covariate)) => Err(FleetError::Confounded { covariate }),
        (true, None) => Ok(()),
    }
}
