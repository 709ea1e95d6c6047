//! The plain difference of two fits, with and without a payload.

use dynid_estimate::linear::{LinearEstimate, LinearMethod, LinearSettings, estimate, explain_difference};
use dynid_linalg::Mat;
use dynid_model::Inertia;
use dynid_rows::conditioning::ReducedGroup;
use serde::{Deserialize, Serialize};

use super::body::about_com;
use crate::pipeline::Identification;

/// A payload from the difference of two fits of the robot, one to the logs that carry it and one to those that carry
/// nothing: a check only, since its variance is larger and nothing keeps the body possible
/// ([`explain_difference`], with the columns of the regrouping that belong to the link).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Difference {
    /// Mass, kg.
    pub mass: f64,
    /// Standard deviation of the mass, kg.
    pub mass_std: f64,
    /// Centre of mass in the joint frame of the link, m.
    pub com: [f64; 3],
    /// Whether a body could have the ten parameters found.
    pub feasible: bool,
}

/// `carries`: per training log, whether it carries the payload; `None`: another one, which counts on neither side.
pub(super) fn difference(
    id: &Identification,
    regrouping: &Mat,
    body: usize,
    carries: &[Option<bool>],
) -> Option<Difference> {
    let own = id.model.log_columns();
    let robot: Vec<usize> = (0..id.base.len()).filter(|k| !own.contains(&id.base.kept[*k])).collect();
    let fit = |loaded: bool| -> Option<LinearEstimate> {
        let side = id.fit().reduced.iter().filter(|group| carries[group.log] == Some(loaded));
        let groups: Vec<ReducedGroup> = side.map(|group| group.within(&robot)).collect();
        estimate(&groups, None, id.base.len(), &LinearMethod::Wls, &LinearSettings::default()).ok()
    };
    let (with, without) = (fit(true)?, fit(false)?);
    let map = Mat::from_fn(id.base.len(), 10, |i, j| regrouping[(i, 10 * body + j)]);
    // Blocks that are long enough for the residuals leave too few per side for an inflation of its own.
    let found = explain_difference([&with, &without], [id.fitted.inflation; 2], &map)?;
    let phi = Inertia(std::array::from_fn(|j| found.x[j]));
    let about = about_com(&phi);
    let (mass, mass_std) = (phi.mass(), found.covariance[(0, 0)].sqrt());
    let com = [about[1], about[2], about[3]];
    // Two fits to the same rows differ by nothing, of which there is no centre.
    let told = [mass, mass_std].into_iter().chain(com).all(f64::is_finite);
    told.then(|| Difference { mass, mass_std, com, feasible: phi.physical_fault().is_none() })
}
