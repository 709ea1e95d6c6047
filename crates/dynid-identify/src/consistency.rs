//! Physically consistent standard parameters of a robot, and what consistency costs.

use dynid_estimate::consistent::{
    self as bodies, Bound, ConsistentEstimate, Equality, Form, LinkPrior, ScalarPrior, estimate,
};
use dynid_estimate::folds::FoldSettings;
use dynid_estimate::held_out::{Comparison, Estimator, compare};
use dynid_estimate::identifiability::{excited_regrouping, posterior};
use dynid_estimate::linear::ols_values;
use dynid_factor::Factor;
use dynid_linalg::Mat;
use dynid_model::inertia::PARAMETERS_PER_BODY;
use dynid_model::ties::Dependent;
use dynid_model::{EffortModel, RobotModel, Ties};
use dynid_rows::conditioning::ReducedGroup;

use crate::fitting::Fitted;
use crate::prior::Prior;
use crate::problem::Problem;
use crate::settings::{Consistency, PriorDistance};
use crate::structure::Structure;
use crate::{Error, shape};

/// Index of the unconstrained estimate in [`Consistent::held_out`].
pub const UNCONSTRAINED: usize = 0;

/// Weights of the prior that are tried, as shares of that of a Gaussian prior, strongest first.
const LADDER: [f64; 6] = [1.0, 1e-1, 1e-2, 1e-4, 1e-6, 1e-8];
/// The strongest prior is taken whose mean squared held-out error is within this share of the least.
const TOLERANCE: f64 = 0.005;

/// A weight of the prior with what it does on held-out folds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PriorTrial {
    /// Weight: residual variances per squared whitened unit, or per nat.
    pub weight: f64,
    /// Mean over joints of the squared held-out error, relative to that without constraints; `None` without folds.
    pub loss: Option<f64>,
}

/// Standard parameters of all links and elements.
#[derive(Debug, Clone)]
pub struct Consistent {
    /// The estimate; `None` if no consistency was asked for.
    pub estimate: Option<ConsistentEstimate>,
    /// Weights of the distance from the prior that were tried; one if it was given.
    pub prior_trials: Vec<PriorTrial>,
    /// Index of the weight in use.
    pub chosen: usize,
    /// Errors of the unconstrained and of the consistent estimates (one per trial) on the same held-out folds of the
    /// training logs.
    pub held_out: Comparison,
    /// Standard parameters without constraints: base values as fitted, split as near as possible to the prior.
    pub unconstrained: Vec<f64>,
    /// Standard parameters of bodies that can exist; the same as [`Self::unconstrained`] if no consistency was asked for.
    pub values: Vec<f64>,
}

impl Consistent {
    /// Whether the estimate differs from the unconstrained one by more than its split.
    pub fn constrained(&self) -> bool {
        self.estimate.as_ref().is_some_and(|e| e.price() > 0.0)
    }

    /// Index of the consistent estimate in [`Self::held_out`].
    pub fn consistent(&self) -> usize {
        if self.estimate.is_some() { 1 + self.chosen } else { UNCONSTRAINED }
    }
}

/// Estimates consistent standard parameters from a fit in base columns.
///
/// The distance from the prior decides what the data do not see. Its weight is the largest, up to that of a Gaussian prior
/// (`κ`), that held-out folds do not speak against: with a vanishing one, unseen masses grow without limit for the sake of
/// changes of fit far below noise.
///
/// # Errors
/// [`Error::Consistency`].
pub(crate) fn consistent(
    asked: &Problem,
    fitted: &Fitted,
    groups: &[ReducedGroup],
) -> Result<Consistent, Error> {
    let Problem { model, structure: Structure { base, regrouping, prior, bounds, .. }, .. } = asked;
    let estimator = &asked.settings.estimator;
    let prior_base = base.values(&prior.values);
    let linear = |training: &Factor| -> Vec<f64> {
        // Base parameters that a fold does not excite keep the prior's value.
        let (change, _) = ols_values(&training.centred(&prior_base));
        change.iter().zip(&prior_base).map(|(d, b)| d + b).collect()
    };
    let mut unconstrained = unconstrained(regrouping, prior, fitted)
        .unwrap_or_else(|| base.nearest(&linear(&fitted.estimate.factor), &prior.values, &prior.std));
    model.complete(&mut unconstrained);
    let weights = fitted.estimate.weights();
    let training = &fitted.estimate.reduced;
    let groups: Vec<ReducedGroup> = groups.iter().map(|g| g.coarsened(fitted.merged_blocks)).collect();
    let folds = FoldSettings::default();
    let Some(form) = form(estimator.consistency) else {
        let held_out = compare(&groups, training, &weights, base.len(), &folds, &[&linear]);
        let values = unconstrained.clone();
        return Ok(Consistent {
            estimate: None,
            prior_trials: Vec::new(),
            chosen: 0,
            held_out,
            unconstrained,
            values,
        });
    };
    let problem = |factor: &Factor| problem(model, regrouping, factor, prior, bounds);
    let trials: Vec<f64> = match estimator.prior_weight {
        Some(weight) => vec![weight],
        None => LADDER.iter().map(|share| share * fitted.inflation_in_time).collect(),
    };
    let settings: Vec<bodies::Settings> = trials
        .iter()
        .map(|weight| match estimator.prior {
            PriorDistance::Quadratic => {
                bodies::Settings { form, gaussian_weight: *weight, ..bodies::Settings::default() }
            }
            PriorDistance::Entropic => {
                bodies::Settings { form, entropic_weight: *weight, ..bodies::Settings::default() }
            }
        })
        .collect();
    let whole = problem(&fitted.estimate.factor);
    // Before the folds, so that contradictory bounds are found once and named.
    let first = estimate(&whole, &settings[0])?;
    let constrained: Vec<Box<Estimator<'_>>> = settings
        .iter()
        .map(|settings| {
            // The whole problem was feasible and bounds do not depend on data, so that no fold can fail.
            let solve = |training: &Factor| {
                estimate(&problem(training), settings)
                    .map_or_else(|_| linear(training), |e| base.values(&e.x))
            };
            Box::new(solve) as Box<Estimator<'_>>
        })
        .collect();
    let mut all: Vec<&Estimator<'_>> = vec![&linear];
    all.extend(constrained.iter().map(AsRef::as_ref));
    let held_out = compare(&groups, training, &weights, base.len(), &folds, &all);
    let losses: Vec<Option<f64>> = (0..trials.len()).map(|k| held_out.loss(1 + k, UNCONSTRAINED)).collect();
    let least = losses.iter().flatten().copied().fold(f64::INFINITY, f64::min);
    let chosen = losses.iter().position(|l| l.is_none_or(|l| l <= (1.0 + TOLERANCE) * least)).unwrap_or(0);
    let mut found = if chosen == 0 { first } else { estimate(&whole, &settings[chosen])? };
    // The equalities hold to rounding; what goes out holds them to the bit.
    model.complete(&mut found.x);
    Ok(Consistent {
        values: found.x.clone(),
        estimate: Some(found),
        prior_trials: trials
            .into_iter()
            .zip(losses)
            .map(|(weight, loss)| PriorTrial { weight, loss })
            .collect(),
        chosen,
        held_out,
        unconstrained,
    })
}

/// Base values as fitted, split as near as possible to the prior in units of its standard deviations.
fn unconstrained(regrouping: &Mat, prior: &Prior, fitted: &Fitted) -> Option<Vec<f64>> {
    let fit = &fitted.estimate;
    let excited = excited_regrouping(&fit.factor, &fit.solution.kept, regrouping);
    let split =
        posterior(&excited, &fit.kept_x(), &fitted.white, 0.0, &fitted.white, &prior.values, &prior.std);
    split.map(|p| p.mean)
}

/// The form of a consistency; `None` without.
pub fn form(consistency: Consistency) -> Option<Form> {
    match consistency {
        Consistency::PseudoInertia => Some(Form::PseudoInertia),
        Consistency::SpatialInertia => Some(Form::SpatialInertia),
        Consistency::None => None,
    }
}

/// `R = R_β K` in standard columns with the priors of links and elements.
pub fn problem(
    model: &RobotModel,
    regrouping: &Mat,
    factor: &Factor,
    prior: &Prior,
    bounds: &[Bound],
) -> bodies::Problem {
    let bodies = model.mechanism().bodies();
    let payloads = prior.payloads.iter().map(|p| LinkPrior {
        name: p.name.clone(),
        first_column: p.first_column,
        prior: p.inertia,
    });
    let of_payload = |column: usize| {
        prior.payloads.iter().any(|p| (p.first_column..p.first_column + 10).contains(&column))
    };
    let ties = model.ties();
    let own_body: Vec<bool> =
        (0..bodies.len()).map(|b| !ties.is_some_and(|ties| ties.body_follows(b))).collect();
    let links = bodies
        .iter()
        .zip(&prior.bodies)
        .enumerate()
        .filter(|(b, _)| own_body[*b])
        .map(|(b, (body, prior))| LinkPrior {
            name: body.name.clone(),
            first_column: 10 * b,
            prior: prior.inertia,
        })
        .chain(payloads)
        .collect();
    // A lower limit that the user states takes the place of zero.
    let stated = |column: usize| bounds.iter().any(|b| b.terms[..] == [(column, -1.0)]);
    let above_zero: Vec<bool> = (0..model.parameters().linear.len()).map(|c| !stated(c)).collect();
    let mut bounds = bounds.to_vec();
    let mut scalars = Vec::new();
    let table = &model.parameters().linear;
    let of_body = |column: usize| own_body.get(column / PARAMETERS_PER_BODY).copied().unwrap_or(false);
    for (column, p) in table.iter().enumerate().filter(|(c, _)| !of_payload(*c) && !of_body(*c)) {
        let dependent = ties.and_then(|ties| ties.of_column(column));
        // What a parameter follows from keeps it where it belongs.
        let kept = dependent.is_some_and(|d| match d.terms[..] {
            [] => d.constant >= 0.0,
            [(_, factor)] => factor > 0.0 && d.constant >= 0.0,
            _ => column < PARAMETERS_PER_BODY * bodies.len(),
        });
        scalars.push(ScalarPrior {
            name: p.name.clone(),
            column,
            prior: prior.values[column],
            scale: prior.std[column],
            nonnegative: p.lower == Some(0.0) && above_zero[column] && !kept,
        });
        if dependent.is_some_and(|d| d.terms.len() < 2) {
            continue;
        }
        let limit = |side: &str, factor: f64, value: f64| Bound {
            name: match shape::of_change(&p.name) {
                Some(name) => {
                    format!("range of `{name}`, its {} end", if factor > 0.0 { "upper" } else { "lower" })
                }
                None => format!("`{}` {side} {value} {} (its element)", p.name, p.unit),
            },
            terms: vec![(column, factor)],
            upper: factor * value,
        };
        bounds.extend(p.lower.filter(|l| *l != 0.0).map(|l| limit("≥", -1.0, l)));
        bounds.extend(p.upper.map(|u| limit("≤", 1.0, u)));
    }
    bodies::Problem {
        r: factor.r_matrix() * regrouping,
        z: factor.z(),
        links,
        scalars,
        bounds,
        equalities: equalities(model),
        prior_std: (prior.std.iter().enumerate())
            .map(|(column, std)| match ties.and_then(|ties| ties.of_column(column)) {
                // What is known of it is what is known of the one that it follows from.
                Some(d) if d.terms.len() < 2 => f64::INFINITY,
                _ => *std,
            })
            .collect(),
    }
}

/// Ties of the model as the solver of consistent estimates has them.
fn equalities(model: &RobotModel) -> Vec<Equality> {
    let of = |d: &Dependent| Equality {
        name: Ties::words(d, model.parameters()),
        terms: std::iter::once((d.index, 1.0)).chain(d.terms.iter().map(|(k, f)| (*k, -f))).collect(),
        value: d.constant,
    };
    model.ties().into_iter().flat_map(|ties| ties.linear()).map(of).collect()
}
