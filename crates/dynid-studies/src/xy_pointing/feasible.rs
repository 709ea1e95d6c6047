//! Row j: bodies that can exist.

use dynid::estimators::Mat;
use dynid::estimators::consistent::{
    ConsistentEstimate, LinkPrior, Problem, ScalarPrior, Settings as Consistency, estimate,
};
use dynid::estimators::distribution::chi_squared_quantile;
use dynid::estimators::rank::numerical_rank;
use dynid::model::Inertia;
use dynid::model::inertia::PARAMETERS_PER_BODY;
use serde_json::json;

use super::data::{Data, factor};
use super::parameters::STANDARD;
use super::pointing::Pointing;
use super::search::{Searched, Searches};
use super::{JOINTS, fault};
use crate::{Row, StudyError};

/// How much heavier than the system the prior bodies are: feasibility must come from the data, not from the truth.
const PRIOR_SCALE: f64 = 1.3;

/// Seeds whose link 2 could exist.
fn possible(searched: &Searched) -> usize {
    searched.parameters().filter(|p| p.standard()[1].physical_fault().is_none()).count()
}

/// General links from the noisy torque, constrained to bodies that can exist; rank of what the torque shows.
fn nearest(
    pointing: &Pointing,
    data: &Data,
    torque: &[f64],
    noise: f64,
) -> Result<(ConsistentEstimate, usize), StudyError> {
    let columns = data.standard_columns();
    let factor = factor(&columns, torque)?.scaled(1.0 / noise);
    let bodies = pointing.mechanism().bodies();
    let links = (0..JOINTS).map(|k| LinkPrior {
        name: bodies[k].name.clone(),
        first_column: PARAMETERS_PER_BODY * k,
        prior: Inertia(bodies[k].inertia.0.map(|x| PRIOR_SCALE * x)),
    });
    let scalars = (0..JOINTS).map(|k| ScalarPrior {
        name: format!("friction {}", k + 1),
        column: STANDARD + k,
        prior: 1.0,
        scale: 1.0,
        nonnegative: true,
    });
    let r: Mat = factor.r_matrix();
    let problem = Problem {
        r,
        z: factor.z(),
        links: links.collect(),
        scalars: scalars.collect(),
        bounds: Vec::new(),
        equalities: Vec::new(),
        prior_std: vec![1.0; columns.len()],
    };
    let found = estimate(&problem, &Consistency::default()).map_err(fault)?;
    Ok((found, numerical_rank(&factor).rank))
}

pub(super) fn row(
    pointing: &Pointing,
    data: &Data,
    searches: &Searches,
    noise: f64,
) -> Result<Row, StudyError> {
    let pairs = [&searches.clean, &searches.noisy];
    let clearance = pairs.map(|p| possible(&p.clearance));
    let ideal = pairs.map(|p| possible(&p.ideal));
    let (found, rank) = nearest(pointing, data, &searches.torque, noise)?;
    let physical = found.x[..STANDARD]
        .chunks_exact(PARAMETERS_PER_BODY)
        .all(|ten| Inertia(std::array::from_fn(|k| ten[k])).physical_fault().is_none());
    let limit = chi_squared_quantile(0.95, rank as f64).unwrap_or(0.0);
    let seeds = searches.clean.clearance.results.len();
    Ok(Row::new(
        "j",
        "Bodies that can exist: the paper's search does not ask for them; the toolkit's estimate of general links does, at a price \
         that noise explains",
        "both links feasible; χ² up by less than its 95 % quantile for the parameters that torques show",
        json!({ "seeds": seeds, "possible_clearance": clearance, "possible_ideal": ideal, "feasible": physical,
                "price": found.price(), "limit": limit, "rank": rank }),
        format!(
            "link 2 of the search could exist on {} and {} of {seeds} seeds with the clearance model, {} and {} with the ideal one \
             (without, with noise); ours {}, χ² up by {:.2} of at most {limit:.1}",
            clearance[0],
            clearance[1],
            ideal[0],
            ideal[1],
            if physical { "feasible" } else { "not feasible" },
            found.price(),
        ),
        physical && found.price() < limit,
    ))
}
