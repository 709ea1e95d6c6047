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
use crate::prior::{Origin, Prior};
use crate::problem::Problem;
use crate::settings::{Consistency, EstimatorConfig, PriorDistance};
use crate::structure::Structure;
use crate::{Error, shape};

/// Index of the unconstrained estimate in [`Consistent::held_out`].
pub const UNCONSTRAINED: usize = 0;

/// Weights of the prior that are tried, as shares of that of a Gaussian prior, strongest first.
const LADDER: [f64; 6] = [1.0, 1e-1, 1e-2, 1e-4, 1e-6, 1e-8];
/// Rungs that are tried in any case.
const STRONG: usize = 3;
/// The strongest prior is taken whose mean squared held-out error is within this share of the least.
const TOLERANCE: f64 = 0.005;

/// A weight of the prior with what it does on held-out folds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PriorTrial {
    /// How the distance is measured.
    pub distance: PriorDistance,
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
    /// Distances from the prior and their weights that were tried; one if both are settled.
    pub prior_trials: Vec<PriorTrial>,
    /// Index of the one in use.
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
/// changes of fit far below noise. Of both ways to measure it from bodies that the robot file states, the one with the
/// least held-out error is taken: bodies that are wrong by a factor are near in the entropic one.
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
    let problem = |factor: &Factor, distance: PriorDistance| {
        let mut problem = problem(model, regrouping, factor, prior, bounds);
        if distance == PriorDistance::Entropic {
            without_bodies(&mut problem);
        }
        problem
    };
    let settings = |(distance, weight): (PriorDistance, f64)| match distance {
        PriorDistance::Quadratic => {
            bodies::Settings { form, gaussian_weight: weight, ..bodies::Settings::default() }
        }
        PriorDistance::Entropic => bodies::Settings {
            form,
            entropic_weight: weight,
            gaussian_weight: weight,
            ..bodies::Settings::default()
        },
    };
    // What was invented is near to nothing, and so is a payload that is to be found.
    let stated = prior.payloads.is_empty()
        && prior.states_bodies()
        && prior.bodies.iter().all(|body| body.origin == Origin::Stated);
    let (strong, weak) = trials(estimator, form, stated, fitted.inflation_in_time);
    let whole =
        |trial: (PriorDistance, f64)| estimate(&problem(&fitted.estimate.factor, trial.0), &settings(trial));
    // Before the folds, so that contradictory bounds are found once and named.
    let first = whole(strong[0])?;
    let constrained = |trial: &(PriorDistance, f64)| -> Box<Estimator<'_>> {
        let (distance, settings) = (trial.0, settings(*trial));
        // The whole problem was feasible and bounds do not depend on data, so that no fold can fail.
        Box::new(move |training: &Factor| {
            estimate(&problem(training, distance), &settings)
                .map_or_else(|_| linear(training), |e| base.values(&e.x))
        })
    };
    let on_folds =
        |estimators: &[&Estimator<'_>]| compare(&groups, training, &weights, base.len(), &folds, estimators);
    let first_of_all: Vec<Box<Estimator<'_>>> = strong.iter().map(constrained).collect();
    let mut all: Vec<&Estimator<'_>> = vec![&linear];
    all.extend(first_of_all.iter().map(AsRef::as_ref));
    let mut held_out = on_folds(&all);
    let judged = |held_out: &Comparison, trials: &[(PriorDistance, f64)]| -> Vec<PriorTrial> {
        let loss = |k: usize| held_out.loss(1 + k, UNCONSTRAINED);
        let each = trials.iter().enumerate();
        each.map(|(k, (distance, weight))| PriorTrial { distance: *distance, weight: *weight, loss: loss(k) })
            .collect()
    };
    let mut prior_trials = judged(&held_out, &strong);
    if let Some(distance) = falling(&prior_trials).filter(|_| !weak.is_empty()) {
        let further: Vec<(PriorDistance, f64)> = weak.iter().map(|weight| (distance, *weight)).collect();
        let weaker: Vec<Box<Estimator<'_>>> = further.iter().map(constrained).collect();
        held_out.append(on_folds(&weaker.iter().map(AsRef::as_ref).collect::<Vec<_>>()));
        prior_trials = judged(&held_out, &[strong, further].concat());
    }
    let chosen = chosen(&prior_trials);
    let mut found = match chosen {
        0 => first,
        _ => whole((prior_trials[chosen].distance, prior_trials[chosen].weight))?,
    };
    // The equalities hold to rounding; what goes out holds them to the bit.
    model.complete(&mut found.x);
    Ok(Consistent {
        values: found.x.clone(),
        estimate: Some(found),
        prior_trials,
        chosen,
        held_out,
        unconstrained,
    })
}

/// Takes bodies out of the squared distance: the entropic one is of bodies alone, and what is known of rotors, friction and offsets counts beside
/// it.
fn without_bodies(problem: &mut bodies::Problem) {
    for link in &problem.links {
        let own = link.first_column..link.first_column + PARAMETERS_PER_BODY;
        problem.prior_std[own].fill(f64::INFINITY);
    }
}

/// Distances and weights to try first, by distance, strongest first; weights to try further where the weakest of these is best.
/// `stated`: whether the robot file states all bodies, and no payload is to be found.
fn trials(
    estimator: &EstimatorConfig,
    form: Form,
    stated: bool,
    inflation: f64,
) -> (Vec<(PriorDistance, f64)>, Vec<f64>) {
    if let Some(weight) = estimator.prior_weight {
        return (vec![(estimator.prior.unwrap_or(PriorDistance::Quadratic), weight)], Vec::new());
    }
    let distances = match (estimator.prior, form) {
        (Some(distance), _) => vec![distance],
        (None, Form::PseudoInertia) if stated => vec![PriorDistance::Quadratic, PriorDistance::Entropic],
        (None, _) => vec![PriorDistance::Quadratic],
    };
    let weights = |shares: &[f64]| -> Vec<f64> { shares.iter().map(|share| share * inflation).collect() };
    let strong = weights(&LADDER[..STRONG]);
    let strong = distances.iter().flat_map(|distance| strong.iter().map(|weight| (*distance, *weight)));
    (strong.collect(), weights(&LADDER[STRONG..]))
}

/// The trial with the least held-out error; `None` where nothing is held out.
fn least(trials: &[PriorTrial]) -> Option<usize> {
    let held_out = trials.iter().enumerate().filter_map(|(k, trial)| trial.loss.map(|loss| (k, loss)));
    held_out.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(k, _)| k)
}

/// The distance with the least held-out error, if that of its weakest weight is less than that of the weight before by more than counts.
fn falling(trials: &[PriorTrial]) -> Option<PriorDistance> {
    let best = least(trials)?;
    let of_best: Vec<&PriorTrial> = trials.iter().filter(|t| t.distance == trials[best].distance).collect();
    let [.., before, last] = of_best[..] else { return None };
    let falls = (1.0 + TOLERANCE) * last.loss? < before.loss?;
    falls.then_some(last.distance)
}

/// Of the distance with the least held-out error the strongest weight that is nearly as good; the first where nothing is held out.
fn chosen(trials: &[PriorTrial]) -> usize {
    let Some(best) = least(trials) else { return 0 };
    let (distance, loss) = (trials[best].distance, trials[best].loss);
    let limit = loss.map(|loss| (1.0 + TOLERANCE) * loss);
    let alike = |t: &PriorTrial| t.distance == distance && t.loss <= limit;
    trials.iter().position(alike).unwrap_or(best)
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

#[cfg(test)]
mod tests {
    use super::*;

    fn trials(quadratic: &[f64], entropic: &[f64]) -> Vec<PriorTrial> {
        let of = |distance: PriorDistance, losses: &[f64]| -> Vec<PriorTrial> {
            let ladder = losses.iter().zip(LADDER);
            ladder.map(|(loss, weight)| PriorTrial { distance, weight, loss: Some(*loss) }).collect()
        };
        [of(PriorDistance::Quadratic, quadratic), of(PriorDistance::Entropic, entropic)].concat()
    }

    #[test]
    fn the_strongest_weight_of_the_better_distance_is_taken() {
        // The least is the second of the entropic distance, the first is within half a per cent of it.
        assert_eq!(chosen(&trials(&[0.95, 0.92, 0.93], &[0.903, 0.900, 0.91])), 3);
        assert_eq!(chosen(&trials(&[0.95, 0.90, 0.93], &[0.97, 0.91, 0.92])), 1);
        let none = trials(&[1.0], &[1.0]).into_iter().map(|t| PriorTrial { loss: None, ..t });
        assert_eq!(chosen(&none.collect::<Vec<_>>()), 0, "nothing was held out");
    }

    #[test]
    fn weaker_weights_are_tried_where_the_error_still_falls() {
        let falls = |quadratic: &[f64], entropic: &[f64]| falling(&trials(quadratic, entropic));
        assert_eq!(falls(&[0.9, 0.8, 0.7], &[0.9, 0.8, 0.75]), Some(PriorDistance::Quadratic));
        assert_eq!(falls(&[0.9, 0.8, 0.7], &[0.9, 0.8, 0.65]), Some(PriorDistance::Entropic));
        assert_eq!(falls(&[0.9, 0.8, 0.799], &[0.9, 0.8, 0.85]), None, "by less than counts");
        assert_eq!(falls(&[0.9, 0.7, 0.8], &[0.9, 0.8, 0.75]), None, "the least lies before");
        assert_eq!(falls(&[0.9], &[]), None);
    }

    #[test]
    fn what_is_stated_is_not_chosen() {
        let of = |prior: Option<PriorDistance>, prior_weight: Option<f64>, form: Form| {
            let (strong, weak) = super::trials(
                &EstimatorConfig { prior, prior_weight, ..EstimatorConfig::default() },
                form,
                true,
                2.0,
            );
            (strong, weak.len())
        };
        let (quadratic, entropic) = (PriorDistance::Quadratic, PriorDistance::Entropic);
        assert_eq!(of(None, Some(5.0), Form::PseudoInertia), (vec![(quadratic, 5.0)], 0));
        assert_eq!(of(Some(entropic), Some(5.0), Form::PseudoInertia), (vec![(entropic, 5.0)], 0));
        let ladder =
            |d: PriorDistance| LADDER[..STRONG].iter().map(|share| (d, 2.0 * share)).collect::<Vec<_>>();
        assert_eq!(of(Some(entropic), None, Form::PseudoInertia), (ladder(entropic), LADDER.len() - STRONG));
        assert_eq!(of(None, None, Form::SpatialInertia).0, ladder(quadratic));
        let invented = super::trials(&EstimatorConfig::default(), Form::PseudoInertia, false, 2.0);
        assert_eq!(invented.0, ladder(quadratic));
        assert_eq!(of(None, None, Form::PseudoInertia).0, [ladder(quadratic), ladder(entropic)].concat());
    }
}
