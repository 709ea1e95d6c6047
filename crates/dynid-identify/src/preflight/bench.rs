//! What it takes a model to find: whose columns these are, the direction of gravity, excitation.

use dynid_model::{BaseParameters, BaseSettings, EffortModel, Mechanism, RobotModel};
use dynid_motion::{JointSignals, Log, UniformLog};
use rayon::prelude::*;

use crate::elements::ElementPlan;
use crate::finding::{FindingId, Findings, Severity};
use crate::log::LARGEST_POSITION;
use crate::prior::{self, Prior};
use crate::robot::Robot;
use crate::settings::Settings;
use crate::structure::stated_values;
use crate::{Error, advice};

/// Share of the farthest travel of a joint of its kind below which a joint stands still: more than degrees taken for radians
/// make of it.
const STILL: f64 = 1e-3;
/// Travel up to which a turning joint that a controller holds may be pushed about by the others, rad, and as a share of the farthest travel.
const PUSHED: (f64, f64) = (0.01, 0.01);
/// Share of the efforts' power (root) left unexplained above which a model explains too little to judge by.
pub(super) const UNEXPLAINED: f64 = 0.5;

/// A robot as trial models need it.
#[derive(Debug)]
pub struct Bench {
    pub(super) model: RobotModel,
    pub(super) shape: Vec<f64>,
    pub(super) base: BaseParameters,
    pub(super) regrouping: dynid_linalg::Mat,
    pub(super) slides: Vec<bool>,
    stated: Vec<Option<f64>>,
    pub(super) gravity: [f64; 3],
    /// Delay as stated, samples.
    pub(super) stated_delay: f64,
    robot: String,
    pub(super) known_effort_scale: bool,
}

impl Bench {
    /// With the elements of the configuration, or the usual ones.
    pub fn new(settings: &Settings, robot: &Robot) -> Result<Bench, Error> {
        Bench::with(&ElementPlan::of_run(settings, robot, |rate| robot.is_driven(rate))?, settings, robot)
    }

    /// With the elements of a plan.
    pub fn with(plan: &ElementPlan, settings: &Settings, robot: &Robot) -> Result<Bench, Error> {
        let model = plan.model(&robot.mechanism)?;
        let shape = model.parameters().shape_start();
        let base = BaseParameters::of_model(&model, &shape, &BaseSettings::default());
        Ok(Bench {
            regrouping: advice::regrouping(&base),
            slides: robot.axes.iter().map(|a| a.slides).collect(),
            stated: stated_values(&model, plan),
            gravity: robot.file.description.gravity,
            stated_delay: settings.conditioning.delay_samples.unwrap_or(0.0),
            robot: robot.path.display().to_string(),
            known_effort_scale: settings.known_effort_scale,
            model,
            shape,
            base,
        })
    }

    /// Names of the outputs.
    pub fn names(&self) -> Vec<String> {
        self.model.outputs().iter().map(|o| o.name.clone()).collect()
    }

    /// Whether a drive acts on a joint; on one that the model does not know, it may.
    pub(super) fn drives(&self, joint: &str) -> bool {
        let output = self.model.outputs().iter().position(|o| o.name == joint);
        output.is_none_or(|o| !self.model.is_undriven(o))
    }

    /// The tree of joints; `None` where loops tie its branches together.
    pub(super) fn tree(&self) -> Option<&Mechanism> {
        self.model.closed().is_none().then(|| self.model.mechanism())
    }

    /// Number of base parameters.
    pub(super) fn parameters(&self) -> usize {
        self.base.len()
    }

    /// Brings the joints of a log into the order of the outputs.
    pub(super) fn order(&self, log: &mut UniformLog) {
        let names = self.names();
        log.joints.retain(|j| names.contains(&j.name));
        log.joints.sort_by_key(|j| names.iter().position(|n| *n == j.name));
    }

    /// Joints that stand still in a log.
    pub(super) fn idle(&self, log: &Log, out: &mut Findings<'_>) -> Vec<String> {
        let names = self.names();
        let slides = |name: &str| names.iter().position(|n| n == name).is_some_and(|j| self.slides[j]);
        let travel = |joint: &JointSignals| {
            let within = joint.position.iter().filter(|q| q.abs() <= LARGEST_POSITION);
            let (low, high) =
                within.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), q| (a.min(*q), b.max(*q)));
            (high - low).max(0.0)
        };
        let seen: Vec<(f64, bool)> = log.joints().par_iter().map(|j| (travel(j), j.moves())).collect();
        let mut idle = Vec::new();
        for (joint, (own, moves)) in log.joints().iter().zip(&seen) {
            let alike = log.joints().iter().zip(&seen);
            let alike = alike.filter(|(other, _)| slides(&other.name) == slides(&joint.name));
            let (own, largest) = (*own, alike.map(|(_, (travel, _))| *travel).fold(0.0, f64::max));
            let evidence = if !moves {
                "the position does not leave its resolution and noise".to_owned()
            } else if own < STILL * largest || !slides(&joint.name) && own < PUSHED.0.min(PUSHED.1 * largest)
            {
                let unit = if slides(&joint.name) { "m" } else { "rad" };
                format!(
                    "the position moves by {own:.1e} {unit}, that of another joint by {largest:.1e} {unit}"
                )
            } else {
                continue;
            };
            idle.push(joint.name.clone());
            if joint.effort_is_constant() && !joint.effort.is_empty() && self.drives(&joint.name) {
                let evidence = format!(
                    "{evidence}, and its effort is {} in every row: something else than its drive holds it, such as a brake, and its rows do not \
                     count",
                    joint.effort[0]
                );
                let remedy = "nothing, if other logs move this joint; else log its effort, or hold it: `NAME = POSITION` under `[locked]`";
                out.add(FindingId::IdleJoint, Severity::Warning, Some(&joint.name), evidence, remedy);
            } else if !joint.effort_is_constant() {
                let remedy = "friction, drive and most inertias of this joint cannot be seen in this log; add one in which it moves";
                out.add(FindingId::IdleJoint, Severity::Warning, Some(&joint.name), evidence, remedy);
            }
        }
        idle
    }

    /// Why this robot's columns are not tried in other ways, if they are not.
    pub(super) fn refusal(&self, log: &UniformLog) -> Option<String> {
        if let Some(missing) =
            self.model.channels().iter().find(|c| !log.channels.iter().any(|have| have.name == **c))
        {
            return Some(format!("an element reads the channel `{missing}`, which the log does not hold"));
        }
        if self.model.closed().is_some() {
            return Some("positions of a mechanism with loops cannot be exchanged one by one".to_owned());
        }
        if !self.model.coordinates().is_empty() {
            return Some("motors behind springs are measured beside their joints".to_owned());
        }
        if log.joints.iter().any(|j| j.position.iter().any(|q| q.abs() > LARGEST_POSITION)) {
            return Some("positions are beyond what any joint reaches".to_owned());
        }
        if log.joints.iter().any(|j| j.effort_is_constant()) {
            return Some("an effort never changes".to_owned());
        }
        None
    }

    pub(super) fn prior(&self, log: &UniformLog) -> Result<Prior, Error> {
        let largest = |e: &[f64]| e.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let sizes: Vec<f64> = log.joints.iter().map(|j| largest(&j.effort)).collect();
        Ok(prior::of(&self.model, &self.stated, &sizes, &self.robot)?)
    }
}
