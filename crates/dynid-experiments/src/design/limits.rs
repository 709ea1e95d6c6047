//! Limits of a design: joints, efforts, space, bodies kept apart.

use std::sync::Arc;

use dynid_config::joint_limits::StatedLimits;
use dynid_excitation::MotionLimits;
use dynid_excitation::constraint::{
    CartesianLimits, EffortLimits, FramePoint, OfAllJoints, PathConstraint, Region,
};
use dynid_identify::Error;
use dynid_identify::robot::Robot;
use dynid_model::{ClosedModel, EffortModel, RobotModel, Vec3};

use super::DesignError;
use super::config::{DesignConfig, LimitsConfig};
use super::loops;
use super::safety::{Drawn, Safety, given_capsules, safety};

pub(super) fn joint_limits(
    robot: &Robot,
    config: &DesignConfig,
    joints: &[String],
    assumptions: &mut Vec<String>,
) -> Result<Vec<MotionLimits>, Error> {
    let LimitsConfig { position, velocity, acceleration, jerk, share, .. } = &config.limits;
    let stated = StatedLimits { position, velocity, acceleration, jerk, share: *share };
    let owners = robot.mechanism.rate_bodies();
    let bodies: Vec<usize> = loops::coordinates(robot).into_iter().map(|rate| owners[rate]).collect();
    dynid_config::joint_limits::joint_limits(robot, &bodies, joints, &stated, assumptions)
}

pub(super) fn effort_limits(
    robot: &Robot,
    config: &DesignConfig,
    joints: &[String],
) -> Result<Vec<Option<f64>>, Error> {
    let given = config.limits.effort.positive("limits.effort", joints)?;
    let (owners, rates) = (robot.mechanism.rate_bodies(), loops::coordinates(robot));
    let stated = |k: usize| {
        let limit = robot.mechanism.bodies()[owners[rates[k]]].joint.limits.effort;
        limit.filter(|e| *e > 0.0 && e.is_finite()).map(|e| config.limits.share * e)
    };
    Ok(given.into_iter().enumerate().map(|(k, g)| g.or_else(|| stated(k))).collect())
}

/// What the limits along a path are of.
pub(super) struct Kept<'a> {
    pub(super) limits: &'a [MotionLimits],
    pub(super) effort_limits: &'a [Option<f64>],
    /// Poses of all joints, of mechanisms with loops.
    pub(super) poses: Option<&'a Arc<ClosedModel>>,
}

/// Limits along the path, and what of them is kept by default.
pub(super) fn constraints(
    robot: &Robot,
    config: &DesignConfig,
    model: &Arc<RobotModel>,
    nominal: Option<&[f64]>,
    kept: &Kept<'_>,
    assumptions: &mut Vec<String>,
) -> Result<(Vec<Box<dyn PathConstraint>>, Safety), Error> {
    let Kept { effort_limits, limits, poses } = *kept;
    let mechanism = model.mechanism();
    let mut out: Vec<Box<dyn PathConstraint>> = Vec::new();
    if config.limits.efforts && effort_limits.iter().any(Option::is_some) {
        match nominal {
            Some(nominal) => out.push(Box::new(
                EffortLimits::new(
                    model.clone(),
                    model.parameters().shape_start(),
                    nominal.to_vec(),
                    effort_limits,
                )
                .map_err(DesignError::from)?,
            )),
            None => assumptions.push("effort limits cannot be kept without inertias".to_owned()),
        }
    }
    // What follows limits places of links, which all joints tell.
    let mut places: Vec<Box<dyn PathConstraint>> = Vec::new();
    let regions = regions(config);
    if !regions.is_empty() {
        places.push(Box::new(CartesianLimits::new(mechanism, &regions).map_err(DesignError::from)?));
    }
    let ranges = loops::ranges(robot, limits);
    places.extend(given_capsules(config, mechanism, &ranges, assumptions)?);
    let closed = poses.map(Arc::as_ref);
    let mut safety = safety(robot, config, &Drawn { mechanism, ranges: &ranges, closed })?;
    places.append(&mut safety.constraints);
    assumptions.append(&mut safety.assumptions);
    match poses {
        None => out.append(&mut places),
        Some(poses) => {
            out.extend(loops::constraints(robot, config, poses)?);
            for own in places {
                out.push(Box::new(OfAllJoints::new(poses.clone(), own).map_err(DesignError::from)?));
            }
        }
    }
    Ok((out, safety))
}

/// Regions that points must stay in.
pub(super) fn regions(config: &DesignConfig) -> Vec<(FramePoint, Region)> {
    let mut out = Vec::new();
    for keep in &config.keep {
        let mut regions = Vec::new();
        if let Some(height) = keep.above {
            regions.push(Region::HalfSpace { normal: Vec3([0.0, 0.0, 1.0]), offset: height });
        }
        if let Some(h) = keep.half_space {
            regions.push(Region::HalfSpace { normal: Vec3(h.normal), offset: h.offset });
        }
        if let Some(b) = keep.inside {
            regions.push(Region::InsideBox { lower: Vec3(b.lower), upper: Vec3(b.upper) });
        }
        if let Some(c) = keep.outside_cylinder {
            regions.push(Region::OutsideCylinder { center: c.center, radius: c.radius });
        }
        if let Some(c) = keep.outside_column {
            let (center, radius, height) = (c.center, c.radius, c.height);
            regions.push(Region::OutsideOrAboveColumn { center, radius, height });
        }
        for frame in &keep.frames {
            for region in &regions {
                out.push((FramePoint { frame: frame.clone(), position: Vec3(keep.point) }, *region));
            }
        }
    }
    out
}
