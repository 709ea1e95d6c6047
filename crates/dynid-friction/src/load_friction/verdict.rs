//! What the value of every parameter rests on.

use super::bounded::bounds_reached;
use super::error::LoadFrictionError;
use super::identifiability::{CombinationValue, Identifiability};
use super::problem::Problem;
use dynid_estimate::separable::Bound;
use dynid_linalg::Mat;
use dynid_search::Bounds;

/// Entries of the regrouping below this share of the largest are rounding.
const NEGLIGIBLE: f64 = 1e-8;
/// Remainder of a scaled unit vector, after projection on directions taken so far, that is none.
const DEPENDENT: f64 = 1e-6;

/// What a value rests on.
#[derive(Debug, Clone, PartialEq)]
pub enum Verdict {
    /// The data determine it by itself.
    Determined {
        /// Standard deviation; `None` without a row to spare.
        std: Option<f64>,
    },
    /// The data determine sums that contain it, not the value itself, which the path of the fit, a bound or a preference
    /// has chosen.
    OnlyInCombination {
        /// The determined sum in which it weighs most, as `(parameter, factor)`; empty if there is none.
        terms: Vec<(usize, f64)>,
        /// Value of that sum and its standard deviation.
        sum: CombinationValue,
    },
    /// The parameter has no effect on the efforts in this model: the value is the start.
    NotEstimated,
    /// The value lies at a bound: the data ask for more than the bound allows, or leave it free. No standard deviation.
    AtBound {
        /// Which.
        bound: Bound,
    },
}

/// One verdict per parameter, in the order of `θ`. What the rows determine is judged without bounds.
///
/// # Errors
/// Bounds of another number of parameters.
pub fn verdicts(
    problem: &Problem,
    bounds: &Bounds,
    found: &Identifiability,
) -> Result<Vec<Verdict>, LoadFrictionError> {
    super::error::same_size("bounds", problem.parameters(), bounds.dimensions())?;
    let at_bound = bounds_reached(problem, bounds, found.theta());
    let sums = determined_sums(found);
    let deviations = found.standard_deviations();
    (0..problem.parameters())
        .map(|k| match at_bound[k] {
            _ if !found.acts[k] => Ok(Verdict::NotEstimated),
            Some(bound) => Ok(Verdict::AtBound { bound }),
            None if found.determined[k] => Ok(Verdict::Determined { std: deviations[k] }),
            None => in_combination(found, &sums, k),
        })
        .collect()
}

fn in_combination(found: &Identifiability, sums: &Mat, k: usize) -> Result<Verdict, LoadFrictionError> {
    let n = found.scales.len();
    let weight = |i: usize, j: usize| (sums[(i, j)] * found.scales[j]).abs();
    let share = |i: usize| weight(i, k) / (0..n).map(|j| weight(i, j)).sum::<f64>();
    let best = (0..sums.nrows())
        .filter(|i| sums[(*i, k)] != 0.0)
        .fold(None, |best: Option<usize>, i| best.filter(|b| share(*b) >= share(i)).or(Some(i)));
    let factors: Vec<f64> = (0..n).map(|j| best.map_or(0.0, |i| sums[(i, j)])).collect();
    let terms = factors.iter().copied().enumerate().filter(|(_, f)| *f != 0.0).collect();
    Ok(Verdict::OnlyInCombination { terms, sum: found.combination(&factors)? })
}

/// A basis of the sums that no null direction changes, each with few terms: `θ_j + Σ_d K_jd θ_d` for parameters `j` and
/// those `d` that carry the null directions (as many as these). One row per sum, its own parameter with the factor 1.
fn determined_sums(found: &Identifiability) -> Mat {
    let null = found.scaled_null_space();
    let (n, free) = (null.nrows(), null.ncols());
    let carriers = carriers(&null);
    if carriers.len() < free {
        return Mat::zeros(0, n);
    }
    let block = Mat::from_fn(free, free, |i, j| null[(carriers[i], j)]);
    // Null vectors with the unit matrix at their carriers: Z Z_c⁻¹.
    let inverse = block.lu().inverse();
    let echelon = &null * &inverse;
    let others: Vec<usize> = (0..n).filter(|k| !carriers.contains(k) && found.acts[*k]).collect();
    let mut sums = Mat::zeros(others.len(), n);
    for (i, &k) in others.iter().enumerate() {
        sums[(i, k)] = 1.0;
        for (j, &d) in carriers.iter().enumerate() {
            let scaled = echelon[(k, j)];
            if scaled.abs() > NEGLIGIBLE {
                sums[(i, d)] = -scaled * found.scales[k] / found.scales[d];
            }
        }
    }
    sums
}

/// Rows of an orthonormal null space that are independent, the longest remainder first.
fn carriers(null: &Mat) -> Vec<usize> {
    let (n, free) = (null.nrows(), null.ncols());
    let mut rest: Vec<Vec<f64>> = (0..n).map(|k| (0..free).map(|i| null[(k, i)]).collect()).collect();
    let length = |row: &[f64]| row.iter().map(|v| v * v).sum::<f64>().sqrt();
    let mut taken = Vec::new();
    while taken.len() < free {
        let longest = (0..n).filter(|k| !taken.contains(k)).fold((0.0, None), |best, k| {
            let size = length(&rest[k]);
            if size > best.0 { (size, Some(k)) } else { best }
        });
        let (size, Some(k)) = longest else { break };
        if size < DEPENDENT {
            break;
        }
        let unit: Vec<f64> = rest[k].iter().map(|v| v / size).collect();
        for row in &mut rest {
            let along: f64 = row.iter().zip(&unit).map(|(a, b)| a * b).sum();
            row.iter_mut().zip(&unit).for_each(|(r, u)| *r -= along * u);
        }
        taken.push(k);
    }
    taken
}
