//! Efforts against those of stated inertias.

use dynid_model::EffortModel;

use super::PreflightError;
use super::rows::{deviation, reduce, regressor};
use super::samples::Samples;
use super::wiring::Wiring;
use crate::conditioning::KeptColumns;
use dynid_estimate::linear::{LinearSolution, ols};
use dynid_factor::factor::Factor;

/// Efforts of a joint against those that stated inertias ask for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AgainstStated {
    /// Logged over stated, friction and other elements taken apart.
    pub ratio: f64,
    /// Share of the effort's variance that stated inertias so scaled leave unexplained.
    pub unexplained: f64,
    /// Share of the effort's variance that elements alone leave unexplained.
    pub elements_alone: f64,
}

/// Compares efforts with those of stated inertias, `y = ratio W_bodies x + W_elements e`, joint by joint; `None` where stated
/// inertias ask for no effort or the logged one never changes. `bodies`: number of inertial columns, the first of the
/// model; `values`: one per linear parameter.
///
/// # Errors
/// [`PreflightError`] if a regressor is not finite.
pub fn against_stated(
    model: &dyn EffortModel,
    shape: &[f64],
    samples: &Samples,
    wiring: &Wiring,
    bodies: usize,
    values: &[f64],
) -> Result<Vec<Option<AgainstStated>>, PreflightError> {
    let elements: Vec<usize> = (bodies..values.len()).collect();
    let columns = KeptColumns::new(model, &elements);
    let block = regressor(model, shape, samples, wiring);
    let mut rigid = values.to_vec();
    rigid[bodies..].fill(0.0);
    (0..samples.joints.len())
        .map(|output| {
            let source = wiring.effort[output];
            let logged = &samples.joints[source.joint].effort;
            let effort: Vec<f64> = logged.iter().map(|e| source.factor * e).collect();
            let stated = block.effort(output, &rigid);
            let beside: [&[f64]; 2] = [&stated, &effort];
            let parts = reduce(&block, &columns, samples, &wiring.position, output, &beside, 1)?;
            let Some(part) = parts.into_iter().next().filter(|p| p.rows() > 0) else { return Ok(None) };
            let power = part.rows() as f64 * deviation(&effort).powi(2);
            let own = columns.local[output].len();
            let with = fit(&part, own + 1, own + 1);
            let without = fit(&part, own, own + 1);
            let found = AgainstStated {
                ratio: with.x[own],
                unexplained: with.rss / power,
                elements_alone: without.rss / power,
            };
            Ok((power > 0.0 && with.kept.contains(&own)).then_some(found))
        })
        .collect()
}

/// Least squares of column `effort` on the first `columns`.
fn fit(part: &Factor, columns: usize, effort: usize) -> LinearSolution {
    ols(&with_effort(part, columns, effort))
}

/// The first `columns` with column `effort` as their effort.
pub(crate) fn with_effort(part: &Factor, columns: usize, effort: usize) -> Factor {
    let height = part.height();
    let entry = |i: usize, k: usize| if i < height { part.r(i, k) } else { 0.0 };
    let below = (columns..height).map(|i| part.r(i, effort).powi(2)).sum::<f64>().sqrt();
    let at = |i: usize, k: usize| if k < columns { entry(i, k) } else { entry(i, effort) };
    Factor::from_triangle(columns, at, below, part.rows())
}
