//! Which identified element has a place in which format.

use dynid_model::{EffortModel, Owner, RobotModel};
use dynid_robots::mjcf::JointParameters;

use super::Identified;
use super::projection::FrictionProjection;

/// A file format.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Format {
    Urdf,
    Mjcf,
}

impl Format {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Format::Urdf => "URDF",
            Format::Mjcf => "MJCF",
        }
    }
}

/// What a format states about the joints.
pub(crate) struct JointValues {
    /// Per joint that has friction, a rotor or a spring that the format has a place for.
    pub(crate) joints: Vec<JointParameters>,
    /// In words.
    pub(crate) notes: Vec<String>,
}

/// What a format states of a model's joints.
///
/// `fc`, `fv` become friction and damping, of asymmetric friction the means of both directions; friction of other forms is
/// stated as its projection (`projected`). `Ia` is armature in MJCF and has no place in URDF, nor has a spring. Negative values, which simulators
/// refuse, are stated as 0.
pub(crate) fn split(
    identified: &Identified<'_>,
    format: Format,
    projected: &[FrictionProjection],
) -> JointValues {
    let Identified { model, values, .. } = *identified;
    let table = model.parameters();
    let mut out = JointValues { joints: Vec::new(), notes: Vec::new() };
    let (mut rotors, mut offsets) = (Vec::new(), Vec::new());
    for (rate, joint) in model.joints().iter().enumerate() {
        if model.elastic_link(rate).is_some() {
            continue;
        }
        let column = |symbol: &str| table.column(&format!("{}.{symbol}", joint.name));
        let mut state = |symbol: &str, what: &str| {
            let single = column(symbol);
            let both = column(&format!("{symbol}p")).zip(column(&format!("{symbol}n")));
            let (at, value) = match (single, both) {
                (Some(c), _) => (c, values[c]),
                (None, Some((p, n))) => (p, 0.5 * (values[p] + values[n])),
                (None, None) => return None,
            };
            if value < 0.0 {
                out.notes.push(format!(
                    "{what} of `{}` is negative ({value:.4e} {}), which simulators refuse: written as 0, so the effort of the file lacks it",
                    joint.name, table.linear[at].unit
                ));
            }
            Some(value.max(0.0))
        };
        let projection = projected.iter().find(|p| p.joint == joint.name);
        let (friction_loss, damping) = match projection {
            Some(p) => (Some(p.friction_loss), Some(p.damping)),
            None => (state("fc", "Coulomb friction"), state("fv", "viscous friction")),
        };
        let rotor = projection.and_then(|p| p.rotor_inertia).or_else(|| state("Ia", "rotor inertia"));
        // A file states where the spring is at rest, not the effort that it has at zero.
        let stiffness = if format == Format::Mjcf { state("k", "stiffness of the spring") } else { None };
        let spring_reference = match (stiffness, column("kq0")) {
            (Some(k), Some(c)) if k > 0.0 => values[c] / k,
            _ => 0.0,
        };
        let armature = if format == Format::Mjcf { rotor } else { None };
        if let (Format::Urdf, Some(rotor)) = (format, rotor) {
            let unit = if joint.slides { "kg" } else { "kg m²" };
            rotors.push(format!("{} {rotor:.4} {unit}", joint.name));
        }
        if let Some(c) = column("fo")
            && values[c] != 0.0
        {
            offsets.push(format!("{} {:.4} {}", joint.name, values[c], table.linear[c].unit));
        }
        if let Some(p) = projection {
            let units = if joint.slides { ["N", "N s/m"] } else { ["N m", "N m s/rad"] };
            out.notes.push(format!(
                "friction of `{}` has a form that {} has no place for: stated as friction {:.4} {} and damping {:.4} {}, least squares over {}",
                joint.name, format.name(), p.friction_loss, units[0], p.damping, units[1], p.states
            ));
        }
        if friction_loss.or(damping).or(armature).or(stiffness).is_some() {
            out.joints.push(JointParameters {
                joint: joint.name.clone(),
                damping: damping.unwrap_or(0.0),
                friction_loss: friction_loss.unwrap_or(0.0),
                armature: armature.unwrap_or(0.0),
                stiffness: stiffness.unwrap_or(0.0),
                spring_reference,
                sticks: false,
                gear: None,
            });
        }
    }
    if !rotors.is_empty() {
        out.notes.push(format!(
            "left out, URDF has no place for it: rotor inertia; add it where the simulator has an armature: {}",
            rotors.join(", ")
        ));
    }
    if !offsets.is_empty() {
        out.notes.push(format!(
            "left out, {} has no place for it: offset (the zero of a sensor, or a constant load): {}",
            format.name(),
            offsets.join(", ")
        ));
    }
    out.notes.extend(left_out(model, values, format));
    out
}

/// What a format has no place for, one line per kind of element.
fn left_out(model: &RobotModel, values: &[f64], format: Format) -> Vec<String> {
    let bodies = 10 * model.mechanism().bodies().len();
    let joints = model.joints().iter().enumerate();
    let motors: Vec<&str> = joints
        .filter(|(rate, _)| model.elastic_link(*rate).is_some())
        .map(|(_, j)| j.name.as_str())
        .collect();
    let mut kinds: Vec<(&str, Vec<&str>)> = Vec::new();
    for (parameter, value) in model.parameters().linear.iter().zip(values).skip(bodies) {
        let Owner::Joint(joint) = &parameter.owner else { continue };
        // Couplings name their parameters by motors.
        let own = parameter.name.strip_prefix(joint.as_str()).and_then(|s| s.strip_prefix('.'));
        let motor = motors.contains(&joint.as_str());
        let kind = match own {
            _ if motor => "friction and rotor of motors behind springs",
            Some("k1" | "k2" | "d") => "elasticity",
            Some("load") => "external load",
            Some("fcp" | "fcn" | "fvp" | "fvn") => "difference of friction between the directions",
            Some("k" | "kq0") if format == Format::Mjcf => continue,
            Some("k" | "kq0") => "spring",
            Some("ca" | "cb") => "cyclic effort",
            Some("K") => "drive gain",
            Some("bk" | "bf") => "gravity compensator",
            Some(_) if model.tree().is_of_position(&parameter.name) => "law of the position",
            // Rotors are told one by one, other friction is projected.
            Some(_) => continue,
            None => "coupling",
        };
        if *value == 0.0 {
            continue;
        }
        match kinds.iter_mut().find(|(k, _)| *k == kind) {
            Some((_, joints)) if joints.last() == Some(&joint.as_str()) => {}
            Some((_, joints)) => joints.push(joint),
            None => kinds.push((kind, vec![joint])),
        }
    }
    kinds
        .into_iter()
        .map(|(kind, joints)| {
            format!("left out, {} has no place for it: {kind} of {}", format.name(), joints.join(", "))
        })
        .collect()
}
