//! The mechanism with ideal joints or with clearance, as the paper's model sees it.

use std::sync::Arc;

use dynid::estimators::{Factor, FactorBuilder};
use dynid::model::inertia::PARAMETERS_PER_BODY;
use dynid::model::{Description, EffortModel, Inertia, Mechanism, MotionBlock, RegressorBlock, RobotModel};
use dynid::{Robot, RobotOptions};

use super::parameters::{PARAMETERS, Parameters, STANDARD, THETA};
use super::{JOINTS, fault};
use crate::StudyError;
use dynid::model::BaseParameters;

/// A tree with two links that turn.
#[derive(Debug, Clone)]
pub(super) struct Pointing {
    pub(super) model: Arc<RobotModel>,
    /// Bodies that are links; the rate of the same number turns each.
    pub(super) links: [usize; JOINTS],
}

/// The robot file's description.
pub(super) fn description() -> Result<Description, StudyError> {
    let robot = Robot::parse(
        include_str!("../../../../robots/xy-pointing.toml"),
        "robots/xy-pointing.toml".as_ref(),
        &RobotOptions::default(),
    )?;
    Ok(robot.file.description)
}

impl Pointing {
    /// The links of `names` in a description, every joint with one coordinate.
    pub(super) fn new(description: &Description, names: [&str; JOINTS]) -> Result<Self, StudyError> {
        let mechanism = description.build().map_err(fault)?;
        let body = |name: &str| {
            let found = mechanism.bodies().iter().position(|b| b.joint.name == name);
            found.ok_or_else(|| fault(format!("no joint `{name}`")))
        };
        let links = [body(names[0])?, body(names[1])?];
        Ok(Pointing { model: Arc::new(RobotModel::new(mechanism, Vec::new())), links })
    }

    /// The robot file as it is.
    pub(super) fn ideal() -> Result<Self, StudyError> {
        Self::new(&description()?, ["j1", "j2"])
    }

    pub(super) fn mechanism(&self) -> &Mechanism {
        self.model.mechanism()
    }

    /// From axis 1 to axis 2, m.
    pub(super) fn length(&self) -> f64 {
        let [first, second] = self.links;
        let between = &self.mechanism().bodies()[first + 1..=second];
        between.iter().map(|b| b.joint.placement.translation.norm()).sum()
    }

    /// All standard parameters of the tree from those of both links.
    pub(super) fn linear(&self, links: &[f64; STANDARD]) -> Vec<f64> {
        let mut linear = vec![0.0; self.model.layout().parameters()];
        for (own, body) in links.chunks_exact(PARAMETERS_PER_BODY).zip(self.links) {
            linear[PARAMETERS_PER_BODY * body..][..PARAMETERS_PER_BODY].copy_from_slice(own);
        }
        linear
    }

    /// Linear parameters of the model from the paper's parameters.
    pub(super) fn linear_of(&self, parameters: &Parameters) -> Vec<f64> {
        let mut links = [0.0; STANDARD];
        for (own, Inertia(values)) in links.chunks_exact_mut(PARAMETERS_PER_BODY).zip(parameters.standard()) {
            own.copy_from_slice(&values);
        }
        self.linear(&links)
    }

    /// Efforts of all rates, rate `r`, sample `s` at `[r * samples + s]`.
    pub(super) fn efforts(&self, motion: &MotionBlock<'_>, linear: &[f64]) -> Vec<f64> {
        let mut effort = vec![0.0; self.model.outputs().len() * motion.samples];
        self.model.efforts(motion, &[], linear, motion.samples, &mut effort);
        effort
    }

    /// Columns of `θ` in the torques of both joints: of joint 1 at all samples, then of joint 2.
    pub(super) fn theta_columns(&self, motion: &MotionBlock<'_>) -> Vec<Vec<f64>> {
        self.columns(motion, &THETA)
    }

    /// Columns of all standard parameters of both links.
    pub(super) fn standard_columns(&self, motion: &MotionBlock<'_>) -> Vec<Vec<f64>> {
        let each: [[usize; 1]; STANDARD] = std::array::from_fn(|k| [k]);
        self.columns(motion, &each.each_ref().map(|k| &k[..]))
    }

    /// Sums of columns of standard parameters.
    fn columns(&self, motion: &MotionBlock<'_>, sums: &[&[usize]]) -> Vec<Vec<f64>> {
        let mut rows = RegressorBlock::new(self.model.layout().clone(), motion.samples);
        self.model.regressor(motion, &[], &mut rows);
        let column = |standard: &&[usize]| {
            let mut links = [0.0; STANDARD];
            standard.iter().for_each(|k| links[*k] = 1.0);
            let linear = self.linear(&links);
            self.links.iter().flat_map(|rate| rows.effort(*rate, &linear)).collect()
        };
        sums.iter().map(column).collect()
    }

    /// Triangle of the Jacobian of the torques with respect to the paper's parameters.
    pub(super) fn jacobian(&self, motion: &MotionBlock<'_>, at: &Parameters) -> Result<Factor, StudyError> {
        let (theta, chain) = (self.theta_columns(motion), at.theta_jacobian());
        let rows = JOINTS * motion.samples;
        let mut columns = vec![0.0; PARAMETERS * rows];
        for (parameter, column) in columns.chunks_exact_mut(rows).enumerate() {
            for (theta, slope) in theta.iter().zip(&chain) {
                column.iter_mut().zip(theta).for_each(|(x, w)| *x += slope[parameter] * w);
            }
        }
        let mut builder = FactorBuilder::new(PARAMETERS);
        builder.push_block(&columns, rows, &vec![0.0; rows]).map_err(fault)?;
        Ok(builder.finish())
    }
}

/// Whether a base parameter holds any of the combinations `θ` of the paper's parameters.
pub(super) fn acting(pointing: &Pointing, base: &BaseParameters) -> Vec<bool> {
    let mut acts = vec![false; base.len()];
    for standard in THETA {
        let mut links = [0.0; STANDARD];
        standard.iter().for_each(|k| links[*k] = 1.0);
        let values = base.values(&pointing.linear(&links));
        acts.iter_mut().zip(values).for_each(|(acts, value)| *acts |= value != 0.0);
    }
    acts
}
