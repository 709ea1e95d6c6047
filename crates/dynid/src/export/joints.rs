//! Which identified element has a place in which format.

use dynid_io::mjcf::JointParameters;
use dynid_model::{EffortModel, Owner, RobotModel};

use super::Identified;
use crate::friction::KnownFriction;
use crate::friction::model::ViscousModel;

/// A file format.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Format {
    Urdf,
    Mjcf,
}

impl Format {
    pub(super) fn name(self) -> &'static str {
        match self {
            Format::Urdf => "URDF",
            Format::Mjcf => "MJCF",
        }
    }
}

/// What a format states about the joints.
pub(super) struct JointValues {
    /// Per joint that has friction or a rotor that the format has a place for.
    pub(super) joints: Vec<JointParameters>,
    /// Linear parameters of the model with everything zero that the format does not state.
    pub(super) values: Vec<f64>,
    /// In words.
    pub(super) notes: Vec<String>,
}

/// Splits the values of a model into what a format states and what it leaves out.
///
/// `fc`, `fv` become friction and damping, of asymmetric friction the means of both directions; `Ia` is armature in
/// MJCF and has no place in URDF. Negative values, which simulators refuse, are stated as 0. Stribeck friction becomes the
/// Coulomb friction that it falls to, and so do bristles.
///
/// Of known friction the file states Coulomb friction and a linear viscous coefficient, each with its error; viscous friction
/// that saturates has no place in it, and neither has the error beside it.
pub(super) fn split(identified: &Identified<'_>, format: Format) -> JointValues {
    let Identified { model, values, known_friction, .. } = *identified;
    let table = model.parameters();
    let bodies = 10 * model.mechanism().bodies().len();
    let mut kept = values[..bodies].to_vec();
    kept.resize(values.len(), 0.0);
    let mut out = JointValues { joints: Vec::new(), values: kept, notes: Vec::new() };
    for (rate, joint) in model.joints().iter().enumerate() {
        if model.elastic_link(rate).is_some() {
            continue;
        }
        let column = |symbol: &str| table.column(&format!("{}.{symbol}", joint.name));
        let law = known_friction.iter().find(|law| law.joint == joint.name);
        let mut state = |symbol: &str, what: &str, unit_of: usize, value: f64| {
            if value < 0.0 {
                out.notes.push(format!(
                    "{what} of `{}` is negative ({value:.4e} {}), which simulators refuse: written as 0, so the effort of the file lacks it",
                    joint.name, table.linear[unit_of].unit
                ));
            }
            let value = value.max(0.0);
            for direction in ["", "p", "n"] {
                if let Some(c) = column(&format!("{symbol}{direction}")) {
                    out.values[c] = value;
                }
            }
            value
        };
        let mut friction = |symbol: &str, what: &str, known: Known| {
            let single = column(symbol);
            let both = column(&format!("{symbol}p")).zip(column(&format!("{symbol}n")));
            let total = |own: f64| match known {
                Known::Part(part) => part + own,
                Known::NoPlace => 0.0,
            };
            match (single, both) {
                (Some(c), _) => Some(state(symbol, what, c, total(values[c]))),
                (None, Some((p, n))) => Some(state(symbol, what, p, total(0.5 * (values[p] + values[n])))),
                (None, None) => None,
            }
        };
        let friction_loss =
            friction("fc", "Coulomb friction", Known::Part(law.map_or(0.0, |law| law.coulomb)));
        let damping = friction("fv", "viscous friction", viscous(law));
        let armature = match format {
            Format::Mjcf => friction("Ia", "rotor inertia", Known::Part(0.0)),
            Format::Urdf => None,
        };
        out.notes.extend(law.and_then(|law| known_left_out(law, format, friction_loss, damping)));
        // Stribeck friction whose static friction equals Coulomb friction is Coulomb friction.
        if let (Some(fixed), Some(coulomb)) = (column("fs"), friction_loss) {
            out.values[fixed] = coulomb;
        }
        if friction_loss.or(damping).or(armature).is_some() {
            out.joints.push(JointParameters {
                joint: joint.name.clone(),
                damping: damping.unwrap_or(0.0),
                friction_loss: friction_loss.unwrap_or(0.0),
                armature: armature.unwrap_or(0.0),
            });
        }
    }
    out.notes.extend(left_out(model, values, format));
    out
}

/// What known friction adds to a coefficient of a file.
#[derive(Clone, Copy)]
enum Known {
    Part(f64),
    /// Friction of a form that the file has no place for.
    NoPlace,
}

fn viscous(law: Option<&KnownFriction>) -> Known {
    match law.and_then(|law| law.viscous) {
        None => Known::Part(0.0),
        Some(ViscousModel::Linear { coefficient }) => Known::Part(coefficient),
        Some(ViscousModel::Exponential(_)) => Known::NoPlace,
    }
}

/// Parts of known friction that a file lacks, in words. `friction_loss`, `damping`: what it states.
fn known_left_out(
    law: &KnownFriction,
    format: Format,
    friction_loss: Option<f64>,
    damping: Option<f64>,
) -> Option<String> {
    let mut parts = Vec::new();
    if friction_loss.is_none() {
        parts.push("Coulomb friction (the model has no `coulomb` for its error)");
    }
    match (law.viscous, damping) {
        (Some(ViscousModel::Exponential(_)), _) => {
            parts.push("viscous friction, which saturates, with its error")
        }
        (Some(ViscousModel::Linear { .. }), None) => {
            parts.push("viscous friction (the model has no `viscous` for its error)");
        }
        _ => {}
    }
    if law.slipping_bristle().is_some() {
        parts.push("bristles");
    }
    if law.static_.is_some_and(|fixed| fixed != law.coulomb) {
        parts.push("rise towards rest");
    }
    (!parts.is_empty()).then(|| {
        format!(
            "left out of the known friction of `{}` in {}: {}",
            law.joint,
            format.name(),
            parts.join(", ")
        )
    })
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
            Some("fvs") => "viscous friction that fades with speed",
            Some("fc" | "fv") => continue,
            Some("fcp" | "fcn" | "fvp" | "fvn") => "difference of friction between the directions",
            Some("Ia") if format == Format::Mjcf => continue,
            Some("Ia") => "rotor inertia (armature in MJCF)",
            Some("fo") => "offset",
            Some("fs") => "rise of Stribeck friction towards rest",
            Some("sigma1") => "bristles and the rise of their friction towards rest",
            Some("sigma2" | "sigma2_slope") => "viscous friction that saturates and depends on temperature",
            Some("fa") => "arctangent friction",
            Some("ft") => "tanh friction",
            Some("fg" | "fl") => "sigmoid friction",
            Some("fp") => "power-law friction",
            Some("fva") => "difference of friction between the directions",
            Some("mu") => "friction that grows with the load",
            Some("k" | "kq0") => "spring",
            Some("ca" | "cb") => "cyclic effort",
            Some("K") => "drive gain",
            _ => "coupling and other elements",
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
