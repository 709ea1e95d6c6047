//! The linear estimator that settings ask for.

use dynid_estimate::identifiability::VisibleSpace;
use dynid_estimate::linear::{LinearMethod, TlsNoise};
use dynid_model::{BaseParameters, EffortModel, RobotModel};

use crate::prior::Prior;
use crate::settings::{Method, Settings};
use crate::{Error, bounds};

/// The linear estimator that a run asks for.
///
/// # Errors
/// [`Error::UnknownParameter`], [`Error::Setting`].
pub(crate) fn method(
    settings: &Settings,
    model: &RobotModel,
    base: &BaseParameters,
    prior: &Prior,
    space: &VisibleSpace,
) -> Result<LinearMethod, Error> {
    if let Some(own) = &settings.own_estimator {
        return Ok(LinearMethod::Own(own.clone()));
    }
    let config = &settings.estimator;
    Ok(match config.method {
        Method::Ols => LinearMethod::Ols,
        // Simulations start from weighted least squares.
        Method::Wls | Method::Iv | Method::Didim | Method::Cloe => LinearMethod::Wls,
        Method::Huber => LinearMethod::Huber,
        Method::Tukey => LinearMethod::Tukey,
        Method::Ridge => LinearMethod::Ridge {
            prior: base.values(&prior.values),
            scale: space.base_std().to_vec(),
            kappa: config.ridge_weight.unwrap_or(1.0),
        },
        Method::Tls => {
            let mut columns = vec![0.0; base.len()];
            for (name, noise) in &config.column_noise {
                let column = bounds::parameter(name, model)?;
                let kept = base.kept.binary_search(&column).map_err(|_| Error::Setting {
                    name: format!("column_noise.{name}"),
                    expected: "the name of a base parameter".to_owned(),
                    found: format!(
                        "{}, which acts only together with others or not at all",
                        model.parameters().linear[column].name
                    ),
                })?;
                columns[kept] = *noise;
            }
            LinearMethod::Tls(TlsNoise { columns, effort: config.effort_noise.unwrap_or(1.0) })
        }
    })
}
