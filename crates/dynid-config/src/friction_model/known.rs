//! Friction of a friction file, as an identification takes it for known.

use std::path::Path;

use dynid_identify::Error;
use dynid_identify::known_friction::{KnownFriction, KnownLaws};
use dynid_identify::settings::{FrictionErrors, PerJoint};

use super::{FrictionModel, FrictionStatus, JointFrictionModel};

/// Friction of a joint of a friction file; `None` without a law that may be used.
pub fn known_friction(law: &JointFrictionModel) -> Option<KnownFriction> {
    (law.status != FrictionStatus::Invalid).then_some(())?;
    Some(KnownFriction {
        joint: law.joint.clone(),
        coulomb: law.coulomb?,
        static_: law.static_,
        stribeck_speed: law.stribeck_speed,
        stribeck_exponent: law.stribeck_exponent,
        viscous: law.viscous,
        bristle: law.bristle,
        temperature_range: law.temperature_range,
        temperature: None,
    })
}

/// Laws of a friction file, with what a configuration says of them: whether their errors count, and the temperature.
///
/// # Errors
/// Fails as [`FrictionModel::load`] does.
pub fn known_laws(file: &Path, errors: FrictionErrors, temperature: PerJoint) -> Result<KnownLaws, Error> {
    let (model, source) = FrictionModel::load_source(file)?;
    Ok(KnownLaws {
        laws: model.joints.iter().filter_map(known_friction).collect(),
        stated: model.joints.iter().map(|j| j.joint.clone()).collect(),
        source,
        errors,
        temperature,
    })
}
