//! The door: lengths and times.

use crate::data::DesignReport;
use crate::error::ReportError;
use crate::page::lengths::{length, per_joint, time};

pub(in crate::page) fn check(data: &DesignReport) -> Result<(), ReportError> {
    if let Some(picture) = &data.picture {
        crate::page::picture::check(picture)?;
    }
    let Some(trajectory) = &data.trajectory else { return Ok(()) };
    time("trajectory", &trajectory.time_s)?;
    if let Some(found) = trajectory.recorded_s
        && !(found[0].is_finite() && found[1].is_finite() && found[0] <= found[1])
    {
        return Err(ReportError::Recorded { found });
    }
    per_joint("motion", trajectory.joints.len(), data.joints.len())?;
    let samples = trajectory.time_s.len();
    for (joint, motion) in data.joints.iter().zip(&trajectory.joints) {
        for (what, found) in [
            ("position", Some(&motion.q)),
            ("velocity", Some(&motion.dq)),
            ("acceleration", Some(&motion.ddq)),
            ("jerk", motion.jerk.as_ref()),
            ("effort", motion.effort.as_ref()),
        ] {
            let place = || format!("joint {:?}, {what}", joint.name);
            found.map_or(Ok(()), |values| length(&place(), values.len(), samples))?;
        }
    }
    for frame in &trajectory.frames {
        length(&format!("path of frame {:?}", frame.name), frame.xyz_m.len(), samples)?;
    }
    Ok(())
}
