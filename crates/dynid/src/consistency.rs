//! Physically consistent standard parameters of a robot, and what consistency costs.

use dynid_estimate::conditioning::ReducedGroup;
use dynid_estimate::consistent::{
    Bound, ConsistentEstimate, Form, LinkPrior, Problem, ScalarPrior, Settings, Status, estimate,
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
        return Ok(Consistent { estimate: None, held_out, values: unconstrained.clone(), unconstrained });
    };
    let bounds = bounds::rows(&config.bound, model)?;
    let problem = |factor: &Factor| problem(model, regrouping, factor, prior, &bounds);
    let found = estimate(&problem(&fitted.estimate.factor), &settings)?;
    let constrained = |training: &Factor| -> Vec<f64> {
        // The whole problem was feasible and bounds do not depend on data, so that no fold can fail.
        estimate(&problem(training), &settings).map_or_else(|_| linear(training), |e| base.values(&e.x))
    };
    let both: [&dynid_estimate::held_out::Estimator<'_>; 2] =
        if found.status == Status::Unconstrained { [&linear, &linear] } else { [&linear, &constrained] };
    let held_out = compare(groups, &weights, base.len(), &folds, &both);
    Ok(Consistent { values: found.x.clone(), estimate: Some(found), held_out, unconstrained })
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
        PriorDistance::Quadratic => Settings { prior_weight: weight.unwrap_or(defaults.prior_weight), ..defaults },
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
        .map(|(b, (body, prior))| LinkPrior { name: body.name.clone(), first_column: 10 * b, prior: prior.inertia })
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
