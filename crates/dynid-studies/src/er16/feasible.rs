//! Row f: bodies that can exist.

use dynid::estimators::Mat;
use dynid::estimators::consistent::{LinkPrior, Problem, ScalarPrior, Settings, estimate};
use dynid::model::{EffortModel, Inertia};
use serde_json::json;

use super::arm::{Arm, JOINTS};
use super::measurement::Measurement;
use super::separable::{Identified, identify_weighted, objective_of};
use crate::{Row, StudyError};

/// How much heavier than the robot file the prior bodies are: feasibility must come from the data, not from the truth.
const PRIOR_SCALE: f64 = 1.3;

/// Inertial parameters nearest to the separable estimate, in its own metric, among bodies with a mass distribution.
pub(super) fn row(arm: &Arm, data: &Measurement) -> Result<Row, StudyError> {
    let found = identify_weighted(arm, data)?;
    let free = objective_of(arm, data, &found.unknowns);
    let fault = |message: String| StudyError::Data { file: "er16", message };
    let problem =
        problem(arm, &found).ok_or_else(|| fault("no covariance of the separable estimate".into()))?;
    let consistent = estimate(&problem, &Settings::default()).map_err(|e| fault(e.to_string()))?;
    let values = &consistent.x;
    let linear = &values[..arm.linear.len()];
    let physical = linear[..10 * JOINTS]
        .chunks_exact(10)
        .all(|ten| Inertia(std::array::from_fn(|k| ten[k])).physical_fault().is_none());
    let mut shape = found.estimate.shape.clone();
    for (k, change) in found.estimate.active.iter().zip(&values[arm.linear.len()..]) {
        shape[*k] += change;
    }
    let unknowns = arm.unknowns(&arm.base.values(linear), &shape);
    let objective = objective_of(arm, data, &unknowns);
    Ok(Row::new(
        "f",
        "A physically feasible inertial part: bodies with a mass distribution, prior bodies 30 % too heavy",
        "every link feasible, objective at most 1 % above that of the free estimate",
        json!({ "feasible": physical, "objective": objective, "free": free, "price": consistent.price() }),
        format!(
            "{}; {objective:.3} against {free:.3} N m, χ² up by {:.2}",
            if physical { "feasible" } else { "not feasible" },
            consistent.price()
        ),
        physical && objective <= 1.01 * free,
    ))
}

/// Standard parameters, friction, and changes of the slopes; rows are those of the linearised separable fit.
fn problem(arm: &Arm, found: &Identified) -> Option<Problem> {
    let fit = found.estimate.linearised.as_ref()?;
    let (base, linear, shapes) = (arm.base.len(), arm.linear.len(), found.estimate.active.len());
    let columns = linear + shapes;
    let mut regrouping = Mat::<f64>::zeros(base + shapes, columns);
    for column in 0..linear {
        let mut unit = vec![0.0; linear];
        unit[column] = 1.0;
        for (row, value) in arm.base.values(&unit).into_iter().enumerate() {
            regrouping[(row, column)] = value;
        }
    }
    for k in 0..shapes {
        regrouping[(base + k, linear + k)] = 1.0;
    }
    let bodies = arm.mechanism.bodies();
    let links: Vec<LinkPrior> = bodies
        .iter()
        .enumerate()
        .map(|(b, body)| LinkPrior {
            name: body.name.clone(),
            first_column: 10 * b,
            prior: Inertia(body.inertia.0.map(|x| PRIOR_SCALE * x)),
        })
        .collect();
    let table = &arm.model.parameters().linear;
    let scalars = (10 * JOINTS..columns)
        .map(|column| ScalarPrior {
            name: table.get(column).map_or_else(|| format!("slope {}", column - linear), |p| p.name.clone()),
            column,
            prior: 0.0,
            scale: if column < linear { 50.0 } else { 10.0 },
            nonnegative: false,
        })
        .collect();
    let mut prior_std: Vec<f64> = links
        .iter()
        .flat_map(|l| l.prior.0.iter().map(|x| (0.5 * x.abs()).max(0.1)).collect::<Vec<_>>())
        .collect();
    prior_std.resize(linear, 50.0);
    prior_std.resize(columns, 10.0);
    Some(Problem {
        r: fit.factor.r_matrix() * regrouping,
        z: fit.factor.z(),
        links,
        scalars,
        bounds: Vec::new(),
        prior_std,
    })
}
