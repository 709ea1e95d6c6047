//! The mechanism, and its motions as records of everything that is linear in Table 1.

use std::sync::Arc;

use dynid::estimators::Mat;
use dynid::estimators::load_friction::{DriveRows, Record};
use dynid::model::closed::ClosedMechanism;
use dynid::model::inertia::PARAMETERS_PER_BODY;
use dynid::model::{
    ClosedModel, Description, EffortModel, JointMotion, MotionBlock, Reaction, RegressorBlock, TreeModel,
};
use dynid::motion::trajectory::Sampled;
use dynid::{Robot, RobotOptions};

use super::fault;
use super::settings::Settings;
use crate::StudyError;

pub(super) const SLIDERS: usize = 3;

/// Which way the plane of the mechanism lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Plane {
    /// The machine as published: weight rests on the guideway, out of the plane.
    Horizontal,
    /// Gravity against the axis y: the weight is part of the reactions.
    Vertical,
}

/// What motions are told by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Coordinates {
    /// Pose of the platform.
    Platform,
    /// Positions of the sliders, which encoders measure.
    Sliders,
}

/// The mechanism with the platform's pose as coordinates.
#[derive(Debug)]
pub(super) struct Machine {
    pub(super) model: Arc<ClosedModel>,
    /// The robot file's: coordinates are the sliders.
    pub(super) by_sliders: Arc<ClosedMechanism>,
    slider_model: ClosedModel,
    pub(super) description: Description,
    /// For every parameter of Table 1 all linear parameters of the model.
    pub(super) ties: Vec<Vec<f64>>,
    /// Force of the guideway on every slider, along y.
    upward: Vec<Reaction>,
    /// Per slider: share of every parameter in its weight.
    weights: Vec<Vec<f64>>,
    gravity: f64,
}

impl Machine {
    pub(super) fn new(settings: &Settings) -> Result<Self, StudyError> {
        let robot = Robot::parse(
            include_str!("../../../../robots/prr3.toml"),
            "robots/prr3.toml".as_ref(),
            &RobotOptions::default(),
        )?;
        let by_sliders = robot.closed.clone().ok_or_else(|| fault("no loops"))?;
        let closed = by_sliders.as_ref().clone().with_independent(&settings.platform).map_err(fault)?;
        let tree = || TreeModel::new(closed.mechanism().clone(), Vec::new());
        let slider_model = ClosedModel::new(tree(), by_sliders.clone());
        let model = Arc::new(ClosedModel::new(tree(), closed.clone()));
        let body = |joint: &String| model.machine().mechanism().joint_index(joint).map_err(fault);
        let mut ties = Vec::new();
        for parameter in &settings.parameter {
            let mut tie = vec![0.0; model.layout().parameters()];
            for (joint, place) in &parameter.of {
                tie[PARAMETERS_PER_BODY * body(joint)? + place] = 1.0;
            }
            ties.push(tie);
        }
        let weight = |shares: &Vec<(String, f64)>| {
            let mut row = vec![0.0; settings.parameter.len()];
            for (name, share) in shares {
                row[settings.place(name)?] = *share;
            }
            Ok(row)
        };
        let owners = model.machine().mechanism().rate_bodies();
        let along_y = |rate: &usize| Reaction::Joint { body: owners[*rate], component: 1 };
        let upward = model.machine().driven().iter().map(along_y).collect();
        Ok(Machine {
            upward,
            slider_model,
            weights: settings.weight.iter().map(weight).collect::<Result<_, StudyError>>()?,
            description: robot.file.description,
            gravity: settings.gravity,
            by_sliders,
            ties,
            model,
        })
    }

    /// Standard parameters of all bodies; what Table 1 does not name is zero.
    pub(super) fn linear(&self, parameters: &[f64]) -> Vec<f64> {
        let mut linear = vec![0.0; self.model.layout().parameters()];
        for (tie, value) in self.ties.iter().zip(parameters) {
            linear.iter_mut().zip(tie).for_each(|(l, t)| *l += t * value);
        }
        linear
    }

    /// Acceleration of gravity along the axes, of `samples` samples.
    pub(super) fn gravity(&self, plane: Plane, samples: usize) -> Vec<f64> {
        let axis = match plane {
            Plane::Horizontal => 2,
            Plane::Vertical => 1,
        };
        (0..3 * samples).map(|k| if k / samples == axis { -self.gravity } else { 0.0 }).collect()
    }

    /// Motion of all joints.
    pub(super) fn joints(&self, motion: &Sampled) -> JointMotion {
        self.model.joint_motion(&block(motion))
    }

    /// m/s².
    pub(super) fn gravity_size(&self) -> f64 {
        self.gravity
    }

    /// Rates of the sliders.
    pub(super) fn driven(&self) -> &[usize] {
        self.model.machine().driven()
    }

    /// Efforts and reactions along a motion of the platform, linear in Table 1.
    pub(super) fn record(&self, motion: &Sampled, plane: Plane) -> Result<Record, StudyError> {
        self.record_of(motion, Coordinates::Platform, plane)
    }

    /// The record of a motion in given coordinates.
    pub(super) fn record_of(
        &self,
        motion: &Sampled,
        coordinates: Coordinates,
        plane: Plane,
    ) -> Result<Record, StudyError> {
        let model = match coordinates {
            Coordinates::Platform => self.model.as_ref(),
            Coordinates::Sliders => &self.slider_model,
        };
        let samples = motion.samples();
        let gravity = self.gravity(plane, samples);
        let mut block = block(motion);
        block.gravity = Some(&gravity);
        let reactions = model.reactions(&self.upward);
        let mut effort = RegressorBlock::new(model.layout().clone(), samples);
        let mut reaction = RegressorBlock::new(reactions.layout().clone(), samples);
        model.reaction_regressor(&block, &[], &reactions, &mut effort, &mut reaction);
        let joints = model.joint_motion(&block);
        let columns = |of: &RegressorBlock, output: usize| {
            let tied: Vec<Vec<f64>> = self.ties.iter().map(|tie| of.effort(output, tie)).collect();
            Mat::from_fn(samples, tied.len(), |s, k| tied[k][s])
        };
        let drive = |(slider, rate): (usize, &usize)| DriveRows {
            regressor: columns(&effort, slider),
            reactions: vec![columns(&reaction, slider)],
            weight: match plane {
                Plane::Horizontal => self.weights[slider].iter().map(|w| self.gravity * w).collect(),
                Plane::Vertical => Vec::new(),
            },
            speed: joints.dq[rate * samples..][..samples].to_vec(),
        };
        Record::new(self.driven().iter().enumerate().map(drive).collect()).map_err(fault)
    }
}

pub(super) fn block(motion: &Sampled) -> MotionBlock<'_> {
    MotionBlock::plain(motion.samples(), &motion.q, &motion.dq, &motion.ddq)
}
