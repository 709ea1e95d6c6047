//! What the log of a designed trajectory will tell.

use dynid_linalg::Mat;

use crate::criterion::{inverse, singular_values};
use crate::evaluation::{information, limit_points};
use crate::feasibility::LimitPoint;
use crate::model::ColumnInfo;
use crate::problem::Problem;
use crate::random::random_trajectory;

/// Forecast of one parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct ColumnForecast {
    /// Name.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Predicted standard deviation.
    pub std: f64,
    /// Nominal value, if known.
    pub nominal: Option<f64>,
    /// Standard deviation in shares of the nominal value, if that is known and not zero.
    pub relative_std: Option<f64>,
}

/// Two parameters that the log will hardly tell apart.
#[derive(Debug, Clone, PartialEq)]
pub struct ConfoundedPair {
    /// Names.
    pub names: [String; 2],
    /// Correlation of their estimates.
    pub correlation: f64,
}

/// What random motion within the same limits would give.
#[derive(Debug, Clone, PartialEq)]
pub struct RandomComparison {
    /// Random trajectories that were found.
    pub trajectories: usize,
    /// Arithmetic mean over parameters of `std(random) / std(designed)`, median over the trajectories.
    pub mean_ratio: f64,
    /// Geometric mean likewise.
    pub geometric_ratio: f64,
    /// Median condition number.
    pub condition: f64,
}

/// What a trajectory promises.
#[derive(Debug, Clone, PartialEq)]
pub struct Forecast {
    /// Condition number of the weighted columns in SI units.
    pub condition: f64,
    /// Condition number of columns of unit length.
    pub condition_unit_norm: f64,
    /// Largest and smallest singular value of the weighted matrix.
    pub singular_values: (f64, f64),
    /// Every parameter.
    pub columns: Vec<ColumnForecast>,
    /// Pairs whose correlation is above 0.95 in size, worst first.
    pub confounded: Vec<ConfoundedPair>,
    /// Parameters that carry 90 % of the direction that is seen least (columns of unit length), with their shares.
    pub weakest: Vec<(String, f64)>,
    /// Limits that act, with the instants nearest to them.
    pub active: Vec<LimitPoint>,
    /// Against random motion; `None` if no random motion keeps the limits.
    pub random: Option<RandomComparison>,
}

/// Correlation above which two parameters count as confounded.
const CONFOUNDED: f64 = 0.95;
/// Share of the weakest direction that is named.
const NAMED_SHARE: f64 = 0.9;
/// A limit acts if it is used to this share.
const ACTIVE: f64 = 0.999;
const RANDOM_TRAJECTORIES: u64 = 10;
/// Seed of the random trajectories, far from those of starts.
const RANDOM_SEED: u64 = 1 << 40;

/// Forecast for a trajectory with coefficients `[q0, a.., b..]` per coordinate. `None` if its matrix is singular.
///
/// # Panics
/// If the coefficients do not fit the problem.
pub fn forecast(problem: &Problem, coefficients: &[Vec<f64>], samples: usize) -> Option<Forecast> {
    let of = |coefficients: &[Vec<f64>]| Some(information(problem, coefficients, samples));
    forecast_by(problem, coefficients, samples, problem.model.columns(), &of)
}

/// [`forecast`] with the triangles of motions from elsewhere, such as a simulation of what the search takes for linear; `columns` are theirs.
///
/// `None` if that of the trajectory is singular or there is none. `samples` are those at which limits are looked at.
pub fn forecast_by(
    problem: &Problem,
    coefficients: &[Vec<f64>],
    samples: usize,
    columns: &[ColumnInfo],
    triangle_of: &dyn Fn(&[Vec<f64>]) -> Option<Mat>,
) -> Option<Forecast> {
    let triangle = triangle_of(coefficients)?;
    let inverse = inverse(&triangle)?;
    let stds = deviations(&inverse);
    if stds.iter().any(|s| !s.is_finite()) {
        return None;
    }
    let (sigma, _) = singular_values(&triangle, false)?;
    let n = triangle.ncols();
    let lengths: Vec<f64> = (0..n).map(|j| triangle.col_norm(j)).collect();
    let scaled = Mat::from_fn(n, n, |i, j| triangle[(i, j)] / lengths[j]);
    let (scaled_sigma, v) = singular_values(&scaled, true)?;
    let columns: Vec<ColumnForecast> = columns
        .iter()
        .zip(&stds)
        .map(|(info, std)| ColumnForecast {
            name: info.name.clone(),
            unit: info.unit.clone(),
            std: *std,
            nominal: info.nominal,
            relative_std: info.nominal.filter(|x| *x != 0.0).map(|x| std / x.abs()),
        })
        .collect();
    Some(Forecast {
        condition: sigma[0] / sigma[n - 1],
        condition_unit_norm: scaled_sigma[0] / scaled_sigma[n - 1],
        singular_values: (sigma[0], sigma[n - 1]),
        confounded: confounded(&inverse, &stds, &columns),
        weakest: weakest(v.col(n - 1), &columns),
        active: limit_points(problem, coefficients, samples, ACTIVE - 1.0),
        random: random_comparison(problem, &stds, triangle_of),
        columns,
    })
}

/// Square roots of the diagonal of `R⁻¹R⁻ᵀ`.
fn deviations(inverse: &Mat) -> Vec<f64> {
    let n = inverse.nrows();
    (0..n).map(|i| (i..n).map(|j| inverse[(i, j)].powi(2)).sum::<f64>().sqrt()).collect()
}

fn confounded(inverse: &Mat, stds: &[f64], columns: &[ColumnForecast]) -> Vec<ConfoundedPair> {
    let covariance = inverse * inverse.transpose();
    let mut pairs = Vec::new();
    for a in 0..stds.len() {
        for b in a + 1..stds.len() {
            let correlation = covariance[(a, b)] / (stds[a] * stds[b]);
            if correlation.abs() > CONFOUNDED {
                let names = [columns[a].name.clone(), columns[b].name.clone()];
                pairs.push(ConfoundedPair { names, correlation });
            }
        }
    }
    pairs.sort_by(|a, b| b.correlation.abs().total_cmp(&a.correlation.abs()));
    pairs
}

fn weakest(direction: &[f64], columns: &[ColumnForecast]) -> Vec<(String, f64)> {
    let mut shares: Vec<(usize, f64)> = direction.iter().map(|x| x * x).enumerate().collect();
    shares.sort_by(|a, b| b.1.total_cmp(&a.1));
    let mut sum = 0.0;
    let mut named = Vec::new();
    for (k, share) in shares {
        if sum >= NAMED_SHARE {
            break;
        }
        sum += share;
        named.push((columns[k].name.clone(), share));
    }
    named
}

fn random_comparison(
    problem: &Problem,
    designed: &[f64],
    triangle_of: &dyn Fn(&[Vec<f64>]) -> Option<Mat>,
) -> Option<RandomComparison> {
    let (mut mean, mut geometric, mut condition) = (Vec::new(), Vec::new(), Vec::new());
    for k in 0..RANDOM_TRAJECTORIES {
        let Some(coefficients) = random_trajectory(problem, RANDOM_SEED + k) else { continue };
        let Some(triangle) = triangle_of(&coefficients) else { continue };
        let Some(inverse) = inverse(&triangle) else { continue };
        let ratios: Vec<f64> = deviations(&inverse).iter().zip(designed).map(|(r, d)| r / d).collect();
        let n = ratios.len() as f64;
        mean.push(ratios.iter().sum::<f64>() / n);
        geometric.push((ratios.iter().map(|r| r.ln()).sum::<f64>() / n).exp());
        if let Some((sigma, _)) = singular_values(&triangle, false) {
            condition.push(sigma[0] / sigma[sigma.len() - 1]);
        }
    }
    (!mean.is_empty()).then(|| RandomComparison {
        trajectories: mean.len(),
        mean_ratio: median(mean),
        geometric_ratio: median(geometric),
        condition: median(condition),
    })
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    match values.len() {
        0 => f64::NAN,
        n if n % 2 == 1 => values[n / 2],
        n => 0.5 * (values[n / 2 - 1] + values[n / 2]),
    }
}
