//! Physically consistent standard parameters of a robot, and what consistency costs.

use dynid_estimate::conditioning::ReducedGroup;
use dynid_estimate::consistent::{
    Bound, ConsistentEstimate, Form, LinkPrior, Problem, ProblemError, ScalarPrior, Settings, Status,
    estimate,
};
use dynid_estimate::folds::FoldSettings;
use dynid_estimate::held_out::{Comparison, compare};
use dynid_estimate::linear::ols;
use dynid_estimate::{Factor, Mat};
use dynid_model::{BaseParameters, EffortModel, RobotModel};

use crate::Error;
use crate::bounds;
use crate::config::{Config, Consistency, PriorDistance};
use crate::fitting::Fitted;
use crate::prior::Prior;

/// Index of the unconstrained estimate in [`Consistent::held_out`].
pub const UNCONSTRAINED: usize = 0;
/// Index of the consistent estimate in [`Consistent::held_out`].
pub const CONSISTENT: usize = 1;

/// Standard parameters of all links and elements.
#[derive(Debug, Clone)]
pub struct Consistent {
    /// The estimate; `None` if no consistency was asked for.
    pub estimate: Option<ConsistentEstimate>,
    /// Weight of the distance from the prior in use.
    pub prior_weight: f64,
    /// How much of the estimate's price is due to that weight, in residual variances.
    pub price_of_prior: f64,
    /// Errors of the unconstrained and the consistent estimate on the same held-out folds of the training logs.
    pub held_out: Comparison,
    /// Standard parameters without constraints: base values as identified, split as near as possible to the prior.
    pub unconstrained: Vec<f64>,
    /// Standard parameters to use.
    pub values: Vec<f64>,
}

impl Consistent {
    /// Whether a constraint changed the estimate.
    pub fn constrained(&self) -> bool {
        self.estimate.as_ref().is_some_and(|e| e.status != Status::Unconstrained)
    }
}

/// Estimates consistent standard parameters from a fit in base columns.
///
/// # Errors
/// [`Error::Consistency`], [`Error::UnknownLink`], [`Error::UnknownParameter`].
pub(crate) fn consistent(
    config: &Config,
    model: &RobotModel,
    base: &BaseParameters,
    regrouping: &Mat<f64>,
    prior: &Prior,
    fitted: &Fitted,
    groups: &[ReducedGroup],
) -> Result<Consistent, Error> {
    let solution = &fitted.estimate.solution;
    let prior_base = base.values(&prior.values);
    // Base parameters that the logs do not excite keep the prior's value.
    let mut beta = prior_base.clone();
    for c in &solution.kept {
        beta[*c] = fitted.estimate.x[*c];
    }
    let unconstrained = base.nearest(&beta, &prior.values, &prior.std);
    let linear = |training: &Factor| -> Vec<f64> {
        let change = ols(&training.centred(&prior_base)).x;
        change.iter().zip(&prior_base).map(|(d, b)| d + b).collect()
    };
    let weights = fitted.estimate.weights();
    let folds = FoldSettings::default();
    let settings = settings(config);
    let Some(settings) = settings else {
        let held_out = compare(groups, &weights, base.len(), &folds, &[&linear]);
        return Ok(Consistent {
            estimate: None,
            prior_weight: 0.0,
            price_of_prior: 0.0,
            held_out,
            values: unconstrained.clone(),
            unconstrained,
        });
    };
    let bounds = bounds::rows(&config.bound, model)?;
    let problem = |factor: &Factor| problem(model, regrouping, factor, prior, &bounds);
    let whole = problem(&fitted.estimate.factor);
    let (found, settings, pull) = match config.estimator.prior_weight {
        Some(_) => (estimate(&whole, &settings)?, settings, 0.0),
        None => {
            let chance = fitted.inflation * solution.kept.len() as f64;
            pulled(&whole, &settings, fitted.inflation, PULL * chance)?
        }
    };
    let constrained = |training: &Factor| -> Vec<f64> {
        // The whole problem was feasible and bounds do not depend on data, so that no fold can fail.
        estimate(&problem(training), &settings).map_or_else(|_| linear(training), |e| base.values(&e.x))
    };
    let both: [&dynid_estimate::held_out::Estimator<'_>; 2] =
        if found.status == Status::Unconstrained { [&linear, &linear] } else { [&linear, &constrained] };
    let held_out = compare(groups, &weights, base.len(), &folds, &both);
    let weight =
        if settings.entropic_weight > 0.0 { settings.entropic_weight } else { settings.prior_weight };
    Ok(Consistent {
        values: found.x.clone(),
        estimate: Some(found),
        prior_weight: weight,
        price_of_prior: pull,
        held_out,
        unconstrained,
    })
}

/// The pull towards the prior may raise the weighted residual by this share of what noise takes up, `κ` per base parameter.
const PULL: f64 = 0.1;
/// Weights between the least and that of a Gaussian prior, on a logarithmic scale, are narrowed down to this ratio.
const RATIO: f64 = 2.0;

/// The estimate as near to the prior as noise allows: the largest prior weight, up to that of a Gaussian prior (`κ`), which
/// raises the fit by no more than `budget`.
///
/// With the least weight, an active constraint lets unseen masses grow without limit for the sake of changes of fit far
/// below noise. Returns the settings found and the rise of the fit.
fn pulled(
    problem: &Problem,
    settings: &Settings,
    inflation: f64,
    budget: f64,
) -> Result<(ConsistentEstimate, Settings, f64), ProblemError> {
    let with = |weight: f64| match settings.entropic_weight > 0.0 {
        true => Settings { entropic_weight: weight, ..settings.clone() },
        false => Settings { prior_weight: weight, ..settings.clone() },
    };
    let (mut low, mut high) = (Settings::default().prior_weight, inflation.max(1.0));
    let mut best = estimate(problem, &with(low))?;
    let least = best.fit;
    let strongest = estimate(problem, &with(high))?;
    if strongest.fit <= least + budget {
        return Ok((strongest.clone(), with(high), strongest.fit - least));
    }
    while high > RATIO * low {
        let middle = (low * high).sqrt();
        let found = estimate(problem, &with(middle))?;
        if found.fit <= least + budget {
            (low, best) = (middle, found);
        } else {
            high = middle;
        }
    }
    let rise = best.fit - least;
    Ok((best, with(low), rise))
}

fn settings(config: &Config) -> Option<Settings> {
    let form = match config.estimator.consistency {
        Consistency::PseudoInertia => Form::PseudoInertia,
        Consistency::SpatialInertia => Form::SpatialInertia,
        Consistency::None => return None,
    };
    let weight = config.estimator.prior_weight;
    let defaults = Settings { form, ..Settings::default() };
    Some(match config.estimator.prior {
        PriorDistance::Quadratic => {
            Settings { prior_weight: weight.unwrap_or(defaults.prior_weight), ..defaults }
        }
        PriorDistance::Entropic => Settings { entropic_weight: weight.unwrap_or(1.0), ..defaults },
    })
}

/// `R = R_β K` in standard columns with the priors of links and elements.
fn problem(
    model: &RobotModel,
    regrouping: &Mat<f64>,
    factor: &Factor,
    prior: &Prior,
    bounds: &[Bound],
) -> Problem {
    let bodies = model.mechanism().bodies();
    let links = bodies
        .iter()
        .zip(&prior.bodies)
        .enumerate()
        .map(|(b, (body, prior))| LinkPrior {
            name: body.name.clone(),
            first_column: 10 * b,
            prior: prior.inertia,
        })
        .collect();
    let mut bounds = bounds.to_vec();
    let mut scalars = Vec::new();
    for (column, p) in model.parameters().linear.iter().enumerate().skip(10 * bodies.len()) {
        scalars.push(ScalarPrior {
            name: p.name.clone(),
            column,
            prior: prior.values[column],
            scale: prior.std[column],
            nonnegative: p.lower == Some(0.0),
        });
        let limit = |side: &str, factor: f64, value: f64| Bound {
            name: format!("`{}` {side} {value} {} (its element)", p.name, p.unit),
            terms: vec![(column, factor)],
            upper: factor * value,
        };
        bounds.extend(p.lower.filter(|l| *l != 0.0).map(|l| limit("≥", -1.0, l)));
        bounds.extend(p.upper.map(|u| limit("≤", 1.0, u)));
    }
    Problem { r: factor.r_matrix() * regrouping, z: factor.z(), links, scalars, bounds }
}
