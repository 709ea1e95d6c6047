//! What a log can tell about the parameters of a model.

use dynid_model::EffortModel;

use super::PreflightError;
use super::rows::TrialRows;
use super::samples::Samples;
use super::wiring::Wiring;
use dynid_estimate::linear::ols;

/// Condition number from which on a regressor counts as singular.
const SINGULAR: f64 = 1e12;

/// Excitation of the base parameters by a log.
#[derive(Debug, Clone, PartialEq)]
pub struct Excitation {
    /// Condition number of the weighted regressor with unit columns; infinite from 1e12 on, where rounding decides.
    pub condition: f64,
    /// Base parameters that the log excites at all.
    pub excited: usize,
    /// Per base parameter: standard deviation for a model that errs by a tenth of the effort, in the parameter's unit; `None` if
    /// it is not excited.
    pub std: Vec<Option<f64>>,
}

/// Excitation by a log whose joints are in the order of a model's outputs.
///
/// # Errors
/// [`PreflightError`] if a regressor is not finite.
pub fn excitation(
    model: &dyn EffortModel,
    shape: &[f64],
    kept: &[usize],
    samples: &Samples,
    wiring: &Wiring,
) -> Result<Excitation, PreflightError> {
    let rows = TrialRows::new(model, shape, kept, samples, wiring)?;
    let solution = ols(&rows.weighted(wiring));
    let covariance = solution.unit_covariance();
    let mut std = vec![None; kept.len()];
    for (k, column) in solution.kept.iter().enumerate() {
        std[*column] = Some(covariance[(k, k)].max(0.0).sqrt());
    }
    let condition = Some(solution.condition_scaled).filter(|c| *c < SINGULAR).unwrap_or(f64::INFINITY);
    Ok(Excitation { condition, excited: solution.kept.len(), std })
}
