//! Shape parameters of a run: found by separable least squares, then linearised, so that the final fit, its covariance and
//! all that follows know of them.

use dynid_estimate::separable::{
    Bound, SeparableEstimate, SeparableSettings, ShapeFinding, ShapeVerdict, StartReport, fit,
};
use dynid_model::element::{JointElement, Linearised, change_name};
use dynid_model::{EffortModel, LoadReference, RobotModel};
use dynid_record::ShapeVerdict as Recorded;
use dynid_rows::conditioning::{Conditioning, RefineError, ShapedRows};

use crate::Error;
use crate::elements::ElementPlan;
use crate::problem::Problem;

/// Share of a shape parameter that a search stops at where little is left to find: the linearised model takes another step.
const ROUGH_STEP: f64 = 1e-5;

/// Shape parameters found from logs.
#[derive(Debug)]
pub struct ShapeFit {
    /// The nonlinear model with the values found.
    pub model: RobotModel,
    /// The linear parameters that go with them, about which the model is linearised.
    pub linear: Vec<f64>,
    /// What the data say about each.
    pub findings: Vec<ShapeFinding>,
    /// What other starts of the search reached.
    pub starts: StartReport,
}

/// Where a search of shape parameters starts.
#[derive(Debug)]
pub(crate) enum Start {
    /// Where the elements say.
    Stated,
    /// So, and from nowhere else: all values are the best of grids on held-out blocks.
    Chosen,
    /// From values.
    From(Vec<f64>),
    /// From values, and from nowhere else, without a look at what the logs say about each.
    Near(Vec<f64>),
    /// So, where a model without some of the parameters was looked at already: what logs say about the others stays, and those that it held
    /// are held. Parameters without a finding count as seen.
    Beside(Vec<f64>, Vec<Option<ShapeFinding>>),
}

/// Finds the shape parameters of a problem's model on its conditioned logs.
pub(crate) fn find(problem: &Problem, choices: &Conditioning, start: &Start) -> Result<ShapeFit, Error> {
    let Problem { model, structure, logs, settings, .. } = problem;
    let shape = match start {
        Start::Stated | Start::Chosen => model.parameters().shape_start(),
        Start::From(values) | Start::Near(values) | Start::Beside(values, _) => values.clone(),
    };
    let defaults = SeparableSettings::default();
    let seed = settings.seed.unwrap_or(1);
    let separable = match start {
        Start::Near(_) => SeparableSettings { seed, starts: 1, profile_points: 0, ..defaults },
        Start::Beside(..) => {
            let step_tolerance = ROUGH_STEP;
            SeparableSettings { seed, starts: 1, profile_points: 0, step_tolerance, ..defaults }
        }
        Start::Chosen => SeparableSettings {
            seed,
            search: settings.estimator.shape.search(seed)?,
            starts: settings.estimator.shape.starts.unwrap_or(1),
            ..defaults
        },
        Start::Stated | Start::From(_) => SeparableSettings {
            seed,
            search: settings.estimator.shape.search(seed)?,
            starts: settings.estimator.shape.starts.unwrap_or(defaults.starts),
            ..defaults
        },
    };
    let (base, conditioning) = (&structure.base, settings.conditioning_settings());
    let known: &[Option<ShapeFinding>] = if let Start::Beside(_, known) = start { known } else { &[] };
    let held: Vec<bool> = (0..shape.len())
        .map(|k| known.get(k).is_some_and(|k| k.as_ref().is_some_and(|k| !is_free(k))))
        .collect();
    let rows = ShapedRows::new(model, &shape, &base.kept, logs, choices, &conditioning)?.holding(&held);
    let mut found: SeparableEstimate = fit(&rows, &separable).map_err(RefineError::from)?;
    drop(rows);
    for (finding, known) in found.findings.iter_mut().zip(known) {
        match known {
            Some(known) => *finding = known.clone(),
            None => finding.verdict = ShapeVerdict::Seen,
        }
    }
    let mut linear = base.expanded(&found.linear);
    let fitted = model;
    fitted.complete(&mut linear);
    let model = problem.plan.tied_model(&problem.robot.mechanism)?.with_shape(&found.shape);
    Ok(ShapeFit { model, linear, findings: found.findings, starts: found.starts })
}

impl ShapeFit {
    /// What the data say about a shape parameter, one that follows from another as about that.
    pub(crate) fn finding(&self, shape: usize) -> &ShapeFinding {
        let tied = self.model.ties().and_then(|ties| ties.of_shape(shape)?.multiple());
        &self.findings[tied.map_or(shape, |(k, _)| k)]
    }

    /// Which shape parameters a linearised model may change.
    pub(crate) fn free(&self) -> Vec<bool> {
        (0..self.findings.len()).map(|k| is_free(self.finding(k))).collect()
    }
}

/// Whether a linearised model may change a shape parameter: not if the logs do not see it or it lies at a bound, since a
/// step would then have no evidence or lead out of its range.
pub(crate) fn is_free(finding: &ShapeFinding) -> bool {
    !matches!(finding.verdict, ShapeVerdict::NotSeen | ShapeVerdict::Held) && finding.at_bound.is_none()
}

/// The model of a plan, linearised about its shape parameters and the given linear parameters: every shape parameter
/// that is `free` becomes a linear one, the change from its value; the others stay.
///
/// # Errors
/// Fails as [`ElementPlan::build`] does.
///
/// # Panics
/// If `linear` is not one value per linear parameter of `model`, `free` not one per shape parameter, or `model` is not of
/// this plan.
pub fn linearised(
    plan: &ElementPlan,
    model: &RobotModel,
    linear: &[f64],
    free: &[bool],
) -> Result<RobotModel, Error> {
    plan.tied(linearised_whole(plan, model, linear, free)?)
}

/// [`linearised`] without the ties of the plan.
pub(crate) fn linearised_whole(
    plan: &ElementPlan,
    model: &RobotModel,
    linear: &[f64],
    free: &[bool],
) -> Result<RobotModel, Error> {
    assert_eq!(free.len(), model.parameters().shape.len(), "length of free");
    assert_eq!(linear.len(), model.parameters().linear.len(), "length of linear");
    let (mechanism, joints) = (model.mechanism(), model.tree().joints());
    let shape = model.parameters().shape_start();
    let (mut shape, mut free) = (shape.as_slice(), free);
    let mut linear = &linear[mechanism.inertial_parameters()..];
    let mut elements: Vec<Box<dyn JointElement>> = Vec::new();
    for element in plan.build(mechanism)? {
        let own_shape = take(&mut shape, element.shape(joints).len());
        let own_linear = take(&mut linear, element.parameters(joints).len());
        let own_free = take(&mut free, own_shape.len());
        elements.push(match own_shape {
            [] => element,
            _ => Box::new(Linearised::new(
                element,
                joints,
                own_shape.to_vec(),
                own_linear.to_vec(),
                own_free.to_vec(),
            )),
        });
    }
    plan.complete(mechanism, elements)
}

fn take<'a, T>(rest: &mut &'a [T], count: usize) -> &'a [T] {
    let (own, others) = rest.split_at(count);
    *rest = others;
    own
}

/// Parameters of a linearised model taken apart again.
#[derive(Debug, Clone, PartialEq)]
pub struct Unfolded {
    /// Linear parameters of the nonlinear model.
    pub linear: Vec<f64>,
    /// Shape parameters of the nonlinear model: where the model was linearised, plus the changes, within their bounds.
    pub shape: Vec<f64>,
}

/// Values of the nonlinear model from those of the linearised one.
///
/// # Panics
/// If `values` is not one value per linear parameter of `linearised`.
pub fn unfold(model: &RobotModel, linearised: &RobotModel, values: &[f64]) -> Unfolded {
    let table = linearised.parameters();
    assert_eq!(values.len(), table.linear.len(), "length of values");
    let shape = &model.parameters().shape;
    let change = |name: &str| table.column(&change_name(name)).map_or(0.0, |c| values[c]);
    let mut shape: Vec<f64> =
        shape.iter().map(|s| (s.start + change(&s.name)).clamp(s.lower, s.upper)).collect();
    if let Some(ties) = model.ties() {
        ties.complete_shape(&mut shape);
    }
    Unfolded { shape, linear: kept_columns(model, linearised).map(|c| values[c]).collect() }
}

/// The nonlinear model of a plan and its linear parameters that `values` of the fit's model stand for; `None` if that is not
/// linearised, nor its parameters tied. Loads of friction are those at these parameters.
pub(crate) fn nonlinear(
    plan: &ElementPlan,
    linearised: &RobotModel,
    found: Option<&ShapeFit>,
    values: &[f64],
) -> Result<Option<(RobotModel, Vec<f64>)>, Error> {
    let unfolded = match found {
        Some(found) => unfold(&found.model, linearised, values),
        None if plan.follows_loads() || linearised.ties().is_some() => {
            let shape = linearised.parameters().shape_start();
            Unfolded { linear: values.to_vec(), shape }
        }
        None => return Ok(None),
    };
    let Unfolded { linear, shape } = unfolded;
    let model = plan.model(linearised.mechanism())?.with_shape(&shape);
    let reference = LoadReference { linear: linear.clone(), shape, linearised: false };
    let model = model
        .with_load_reference(reference)
        .unwrap_or_else(|e| unreachable!("parameters of the plan's model: {e}"));
    Ok(Some((model, linear)))
}

/// Columns of the linearised model that the nonlinear one has too, in its order.
pub(crate) fn kept_columns<'a>(
    model: &'a RobotModel,
    linearised: &'a RobotModel,
) -> impl Iterator<Item = usize> + 'a {
    let names: Vec<String> = model.parameters().shape.iter().map(|s| change_name(&s.name)).collect();
    let table = &linearised.parameters().linear;
    (0..table.len()).filter(move |c| !names.contains(&table[*c].name))
}

/// Name of the shape parameter whose change a linear parameter is.
pub(crate) fn of_change(name: &str) -> Option<&str> {
    name.strip_suffix(change_name("").as_str())
}

/// Verdict as recorded, and the interval of one that is bounded on one side.
pub(crate) fn verdict(found: Option<ShapeVerdict>) -> (Recorded, Option<(f64, f64)>) {
    match found {
        Some(ShapeVerdict::Seen) => (Recorded::SeenInData, None),
        Some(ShapeVerdict::OneSided { lower, upper }) => (Recorded::OneSided, Some((lower, upper))),
        Some(ShapeVerdict::NotSeen) => (Recorded::NotSeen, None),
        Some(ShapeVerdict::Held | ShapeVerdict::NotJudged) | None => (Recorded::Given, None),
    }
}

/// Why, in words. `searched`: the route searches shape parameters.
pub(crate) fn reason(finding: Option<&ShapeFinding>, searched: bool) -> Option<String> {
    let Some(finding) = finding else {
        return (!searched)
            .then(|| "the textbook route does not search it: it is held at its start".to_owned());
    };
    match (finding.verdict, finding.at_bound) {
        (ShapeVerdict::NotSeen, _) => {
            Some("any value within its range fits these logs alike: it is held at its start".to_owned())
        }
        (_, Some(bound)) => {
            let side = match bound {
                Bound::Lower => "lower",
                Bound::Upper => "upper",
            };
            let limit = finding.limit.map_or_else(String::new, |l| format!(": the law is then {l}"));
            Some(format!("at its {side} bound{limit}"))
        }
        (ShapeVerdict::OneSided { .. }, None) => Some("the logs bound it on one side only".to_owned()),
        _ => None,
    }
}
