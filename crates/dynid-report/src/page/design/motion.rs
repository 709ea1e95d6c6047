//! Plots of the joints' motion.

use serde::Serialize;

use crate::data::{DesignJoint, DesignReport, JointMotion};
use crate::error::ReportError;
use crate::number::shortest;
use crate::page::script_data::script_json;
use crate::series::{Quantity, drawn_limits, motion_payload};

#[derive(Debug, Serialize)]
pub(super) struct MotionView<'a> {
    joints: Vec<JointPlots<'a>>,
    /// JSON for the script element.
    json: String,
    /// Samples behind each pair of drawn points.
    bucket: Option<usize>,
    /// There is an approach or a return.
    shaded: bool,
    effort: bool,
}

#[derive(Debug, Serialize)]
struct JointPlots<'a> {
    name: &'a str,
    panels: Vec<PanelView>,
}

#[derive(Debug, Serialize)]
struct PanelView {
    /// Index in the script's data.
    index: usize,
    quantity: &'static str,
    unit: String,
    /// The limits in words; empty without any.
    limits: String,
    /// Samples not drawn because they are not finite.
    missing: usize,
}

/// `None` if there is nothing to draw.
pub(super) fn motion(data: &DesignReport) -> Result<Option<MotionView<'_>>, ReportError> {
    let Some(trajectory) = data.trajectory.as_ref().filter(|t| !t.time_s.is_empty() && !t.joints.is_empty())
    else {
        return Ok(None);
    };
    let mut quantities = Vec::new();
    let mut joints = Vec::new();
    for (joint, motion) in data.joints.iter().zip(&trajectory.joints) {
        let mut panels = Vec::new();
        for (quantity, unit) in joint_quantities(joint, motion) {
            panels.push(PanelView {
                index: quantities.len(),
                quantity: quantity.name,
                limits: limits_in_words(&quantity),
                missing: quantity.samples.iter().filter(|v| !v.is_finite()).count(),
                unit,
            });
            quantities.push(quantity);
        }
        joints.push(JointPlots { name: &joint.name, panels });
    }
    let payload = motion_payload(&trajectory.time_s, trajectory.recorded_s, &quantities);
    Ok(Some(MotionView {
        joints,
        json: script_json(&payload)?,
        bucket: payload.bucket,
        shaded: payload.shaded(),
        effort: trajectory.joints.iter().any(|j| j.effort.is_some()),
    }))
}

fn joint_quantities<'a>(joint: &'a DesignJoint, motion: &'a JointMotion) -> Vec<(Quantity<'a>, String)> {
    let both = |limit: Option<f64>| [limit.map(|v| -v), limit];
    let rate = |power: &str| format!("{}/s{power}", joint.unit);
    [
        ("position", Some(&motion.q), [joint.position_low, joint.position_high], joint.unit.clone()),
        ("velocity", Some(&motion.dq), both(joint.velocity), rate("")),
        ("acceleration", Some(&motion.ddq), both(joint.acceleration), rate("^2")),
        ("jerk", motion.jerk.as_ref(), both(joint.jerk), rate("^3")),
        ("effort", motion.effort.as_ref(), both(joint.effort), joint.effort_unit.clone()),
    ]
    .into_iter()
    .filter_map(|(name, samples, limits, unit)| {
        Some((Quantity { joint: &joint.name, name, samples: samples?, limits }, unit))
    })
    .collect()
}

fn limits_in_words(quantity: &Quantity<'_>) -> String {
    let words = match quantity.limits {
        [None, None] => return String::new(),
        [Some(low), Some(high)] if low == -high => format!("limit ±{}", shortest(high)),
        [Some(low), Some(high)] => format!("limits {} and {}", shortest(low), shortest(high)),
        [Some(low), None] => format!("limit {} below", shortest(low)),
        [None, Some(high)] => format!("limit {} above", shortest(high)),
    };
    let drawn = drawn_limits(quantity.samples, quantity.limits);
    let all = quantity.limits.iter().zip(drawn).all(|(limit, drawn)| limit.is_none() || drawn.is_some());
    if all { words } else { words + ", too far to be drawn" }
}
