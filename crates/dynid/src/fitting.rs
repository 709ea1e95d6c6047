//! The linear fit of a run: method, weights, covariance.

use dynid_estimate::conditioning::{
    Conditioning, ConditioningSettings, LogRows, PreparedLog, textbook_rows,
};
use dynid_estimate::covariance::{MIN_BLOCKS, output_inflation, variance_inflation};
use dynid_estimate::identifiability::VisibleSpace;
use dynid_estimate::linear::{
    LinearEstimate, LinearMethod, LinearSettings, TlsNoise, VarianceSharing, estimate,
};
use dynid_estimate::rows::{RowSource, reduce_rows};
use dynid_estimate::{Factor, Mat};
use dynid_model::{BaseParameters, EffortModel, RobotModel};

use crate::Error;
use crate::bounds;
use crate::config::{Config, EstimatorConfig, Method, Variances};
use crate::prior::Prior;

/// Joints whose variance inflation differs by more than this are deflated one by one.
const UNEQUAL: f64 = 2.0;

/// The fit of the base parameters with what its residuals say about its precision.
#[derive(Debug)]
pub struct Fitted {
    /// The estimate in base columns.
    pub estimate: LinearEstimate,
    /// Covariance for white residuals, of the kept columns.
    pub white: Mat<f64>,
    /// Jackknife covariance over time blocks, if there are enough of them.
    pub jackknife: Option<Mat<f64>>,
    /// Variance inflation `κ`: by how much coloured residuals inflate the variances that white ones would give.
    pub inflation: f64,
    /// The same joint by joint, where it can be told.
    pub inflation_per_output: Vec<Option<f64>>,
    /// Weighted factor of all base columns, deflated by `κ` (joint by joint where joints differ).
    pub information: Factor,
}

impl Fitted {
    /// The covariance to report: jackknife, or for too few blocks that of white residuals.
    pub fn covariance(&self) -> &Mat<f64> {
        self.jackknife.as_ref().unwrap_or(&self.white)
    }
}

/// Rows of the final fit, whichever the route.
pub(crate) fn rows<'a>(
    config: &Config,
    model: &'a RobotModel,
    kept: &[usize],
    logs: &'a [PreparedLog],
    conditioning: Option<&Conditioning>,
    settings: &ConditioningSettings,
) -> Result<Box<dyn RowSource + 'a>, Error> {
    Ok(match conditioning {
        Some(found) => Box::new(LogRows::new(model, &[], kept, logs, found, settings)?),
        None => Box::new(textbook_rows(model, &[], kept, logs, &config.textbook_route(), settings)?),
    })
}

/// Fits the base parameters.
///
/// # Errors
/// [`Error::TooShort`], [`Error::Linear`], [`Error::UnknownParameter`].
pub(crate) fn fit(
    config: &Config,
    model: &RobotModel,
    base: &BaseParameters,
    prior: &Prior,
    space: &VisibleSpace,
    source: &dyn RowSource,
) -> Result<(Fitted, Vec<dynid_estimate::conditioning::ReducedGroup>), Error> {
    let groups = reduce_rows(source).map_err(|e| conditioning_fault(source, e))?;
    let rows: usize = groups.iter().map(|g| g.rows()).sum();
    if rows <= base.len() {
        return Err(Error::TooShort {
            file: config.log[0].path.display().to_string(),
            message: format!(
                "{rows} usable rows for {} parameters, expected more rows than parameters",
                base.len()
            ),
        });
    }
    let method = method(&config.estimator, model, base, prior, space)?;
    let settings = LinearSettings {
        sharing: match config.estimator.variances {
            Variances::Group => VarianceSharing::Group,
            Variances::JointAndLog => VarianceSharing::JointAndLog,
            Variances::Joint => VarianceSharing::Joint,
        },
        ..LinearSettings::default()
    };
    let estimate = estimate(&groups, Some(source), base.len(), &method, &settings)?;
    let white = estimate.model_covariance();
    let jackknife = (estimate.blocks.len() >= MIN_BLOCKS)
        .then(|| estimate.jackknife())
        .flatten()
        .map(|j| j.covariance);
    let inflation =
        jackknife.as_ref().and_then(|v| variance_inflation(v, &white)).unwrap_or(1.0);
    let per_output = output_inflation(&estimate.reduced, &estimate.weights(), &estimate.x);
    let information = information(&estimate, inflation, &per_output);
    Ok((
        Fitted { white, jackknife, inflation, inflation_per_output: per_output, information, estimate },
        groups,
    ))
}

fn conditioning_fault(source: &dyn RowSource, e: dynid_estimate::rows::RowsError) -> Error {
    let output = source.groups()[e.group].output;
    Error::Conditioning(dynid_estimate::conditioning::ConditioningError::Rows { output, source: e.source })
}

fn method(
    config: &EstimatorConfig,
    model: &RobotModel,
    base: &BaseParameters,
    prior: &Prior,
    space: &VisibleSpace,
) -> Result<LinearMethod, Error> {
    Ok(match config.method {
        Method::Ols => LinearMethod::Ols,
        Method::Wls => LinearMethod::Wls,
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
                    found: format!("{}, which is folded into others", model.parameters().linear[column].name),
                })?;
                columns[kept] = *noise;
            }
            LinearMethod::Tls(TlsNoise { columns, effort: config.effort_noise.unwrap_or(1.0) })
        }
    })
}

/// The weighted factor with every joint's rows deflated by its variance inflation.
fn information(estimate: &LinearEstimate, inflation: f64, per_output: &[Option<f64>]) -> Factor {
    let known: Vec<f64> = per_output.iter().flatten().copied().collect();
    let least = known.iter().copied().fold(f64::INFINITY, f64::min);
    let most = known.iter().copied().fold(1.0, f64::max);
    if known.len() < 2 || most <= UNEQUAL * least {
        return estimate.factor.scaled(1.0 / inflation.sqrt());
    }
    // Joint by joint, scaled so that together they make up the inflation found for all.
    let mean = known.iter().sum::<f64>() / known.len() as f64;
    let total = estimate.x.len();
    let parts: Vec<Factor> = estimate
        .reduced
        .iter()
        .zip(estimate.weights())
        .map(|(group, weight)| {
            let own = (per_output[group.output].unwrap_or(mean) * inflation / mean).max(1.0);
            group.merged(total).scaled(weight / own.sqrt())
        })
        .collect();
    Factor::merge(&parts.iter().collect::<Vec<_>>())
}
