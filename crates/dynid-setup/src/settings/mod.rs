//! How logs are identified: elements, conditioning, estimator, bounds, closed loop.

mod closed_loop;
mod conditioning;
mod effect;
mod estimator;
mod friction;
mod given;
pub mod lists;
mod log_terms;
mod search;

use std::collections::BTreeMap;

use dynid_robots::{CouplingSpec, LawSpec, TieFault, TieSpec};
use serde::Serialize;

use dynid_estimate::linear::OwnEstimator;

use crate::Error;
use crate::commands::RunFiles;
pub use crate::known_friction::FrictionErrors;
use crate::known_friction::KnownLaws;
pub use crate::per_joint::{PerJoint, known};
pub use closed_loop::{ClosedLoop, NominalModel};
pub use conditioning::{ConditioningConfig, Route, SmoothingKind};
pub use effect::{check_log_effect, serde_name};
pub use estimator::{
    BoundConfig, Consistency, EstimatorConfig, Method, PriorDistance, ShapeConfig, Variances,
};
pub use friction::Friction;
pub use given::{Given, refuse};
pub use log_terms::{LogSettings, MASSES, Own, PayloadConfig, RATED_MASS, labels};
pub use search::{SearchConfig, SearchLoss, SearchOver};

/// Settings of an identification. All have defaults: `Settings::default()` is what `dynid identify` does without a configuration.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Settings {
    /// Seed of everything random (states of the structural analysis). Default 1.
    pub seed: Option<u64>,
    /// Elements of joints.
    pub elements: Elements,
    /// Laws of friction that are stated by formulas, besides those of the robot; lists of elements name them.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub law: BTreeMap<String, LawSpec>,
    /// Couplings of joints, besides those of the robot.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub couplings: Vec<CouplingSpec>,
    /// Parameters that are known, or multiples or sums of others, besides those of the robot.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub tie: Vec<TieSpec>,
    /// Conditioning.
    pub conditioning: ConditioningConfig,
    /// The size of the efforts is right, whatever the robot file, its effort limits and other arms say of it: the pre-flight then
    /// tells the difference without a warning. Default false.
    pub known_effort_scale: bool,
    /// Masses that were weighed, kg, by the name of the payload or link: the identified ones against them tell the scale of the efforts. They
    /// are no prior. Default: none.
    pub known_mass: BTreeMap<String, f64>,
    /// What the pre-flight of the training logs may do. Default `refuse`.
    pub preflight: Preflight,
    /// Estimator.
    pub estimator: EstimatorConfig,
    /// A linear estimator of the program's own, in place of `estimator.method`. Default: none.
    #[serde(skip_serializing_if = "Option::is_none", serialize_with = "name_of_own")]
    pub own_estimator: Option<OwnEstimator>,
    /// Closed loop of the logs, for instrumental variables and the test of least squares against them. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub closed_loop: Option<ClosedLoop>,
    /// Bounds on masses, centres of mass and parameters.
    pub bound: Vec<BoundConfig>,
    /// Columns to keep as base parameters where there is a choice, by name (`link2.Izz`) or symbol (`Izz2`).
    pub preferred: Vec<String>,
    /// Elastic joints without torque sensors are taken as stiff ones, read at their motors, even where rows of links and motors bear a stiffness
    /// out; their stiffness is that of their deformation. A recipe for factors of logs needs it. Default false.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub stiff_joints: bool,
    /// Bodies that some logs carry.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub payload: Vec<PayloadConfig>,
    /// Files behind robot, logs and settings, named in the commands that remedies give.
    #[serde(skip)]
    pub files: RunFiles,
}

/// An own estimator as settings record it: by its name.
fn name_of_own<S: serde::Serializer>(own: &Option<OwnEstimator>, to: S) -> Result<S::Ok, S::Error> {
    own.as_ref().map(OwnEstimator::name).serialize(to)
}

/// Elements at joints.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Elements {
    /// For every joint about which nothing else is said.
    pub default: Option<Vec<String>>,
    /// For single joints.
    pub joint: BTreeMap<String, Vec<String>>,
    /// Friction in place of that of the lists, or shapes found beside it. Default `auto`.
    pub friction: Friction,
    /// Friction whose laws are known: their efforts are taken off, and what remains of Coulomb and viscous friction and offset of these
    /// joints are errors of the laws. Shapes are then found at other joints alone. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub known: Option<KnownLaws>,
    /// Joints with clearance. Default: their journals move in their bearings.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub clearance: Option<Clearance>,
}

/// Joints whose robot file states clearance.
#[derive(Debug, Clone, Copy, serde::Deserialize, Serialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub enum Clearance {
    /// Journals move in their bearings, as probes say or as their loads press them, and rub there ([`dynid_model::JournalModel`]).
    Journals,
    /// Joints are ideal; their friction elements carry that of the bearings.
    Ideal,
}

/// What an identification does about what its pre-flight finds.
#[derive(Debug, Clone, Copy, Default, serde::Deserialize, Serialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub enum Preflight {
    /// Refuses logs of which nonsense would come; warns of the rest.
    #[default]
    Refuse,
    /// Warns.
    Warn,
    /// Is not made.
    Off,
}

impl Settings {
    /// Returns the settings with a change: `Settings::default().with(|s| s.seed = Some(7))`.
    #[must_use]
    pub fn with(mut self, change: impl FnOnce(&mut Settings)) -> Settings {
        change(&mut self);
        self
    }

    /// Checks that every number makes sense, whatever robot and logs.
    ///
    /// # Errors
    /// [`Error::Setting`], [`Error::Coupling`].
    pub fn check(&self) -> Result<(), Error> {
        self.conditioning.check()?;
        for coupling in &self.couplings {
            if !coupling.matrix.iter().flatten().all(|x| x.is_finite()) {
                return Err(Error::Coupling {
                    joints: coupling.joints.join(", "),
                    fault: format!("expected finite numbers in the matrix, found {:?}", coupling.matrix),
                });
            }
        }
        for tie in &self.tie {
            let key = |e: &TieFault| format!("tie{}{}", if e.key.is_empty() { "" } else { "." }, e.key);
            tie.check().map_err(|e| Error::setting(&key(&e), e.expected, &e.found))?;
        }
        self.check_payloads()?;
        self.check_estimator()?;
        self.closed_loop.iter().try_for_each(ClosedLoop::check)
    }
}
