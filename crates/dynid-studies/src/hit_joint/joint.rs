//! The joint: two coordinates without bodies, the link with its torque sensor and the motor.

use dynid::model::element::{
    Coulomb, Cyclic, ElasticTransmission, ExternalLoad, JointElement, RotorInertia, ShapeSetting,
    StribeckViscous, TanhFriction, Viscous,
};
use dynid::model::{Coordinate, KnownElement, Mechanism, RobotModel};

use super::Values;
use super::settings::Settings;

/// Rate of the link; its effort is the negative reading of the torque sensor.
pub(super) const LINK: usize = 0;
/// Rate of the motor.
pub(super) const MOTOR: usize = 1;

/// Which damping a model to be identified has: the paper's Tables I, II, III.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Damping {
    None,
    Coulomb,
    Full,
    /// With a torque once a turn of the link.
    Cyclic,
}

fn joint(elements: Vec<Box<dyn JointElement>>) -> RobotModel {
    let coordinates = vec![Coordinate::turning("link"), Coordinate::turning("motor")];
    RobotModel::with_coordinates(Mechanism::without_bodies("joint"), coordinates, elements)
}

fn transmission(settings: &Settings) -> Box<dyn JointElement> {
    Box::new(ElasticTransmission::new(LINK, MOTOR, settings.ratio))
}

fn damping(damping: Damping) -> Vec<Box<dyn JointElement>> {
    let mut elements: Vec<Box<dyn JointElement>> = Vec::new();
    for rate in [MOTOR, LINK] {
        if matches!(damping, Damping::Full | Damping::Cyclic) {
            elements.push(Box::new(Viscous { rate }));
        }
        if damping != Damping::None {
            elements.push(Box::new(Coulomb { rate }));
        }
    }
    if damping == Damping::Cyclic {
        elements.push(Box::new(Cyclic::torque(LINK, ShapeSetting::held(1.0))));
    }
    elements
}

/// The model to be identified; columns `k1, k2`, then viscous and Coulomb friction of motor and link as far as the model has
/// them, then the torque once a turn. `rotor`: torque of the rotor's inertia counts as known.
pub(super) fn identified(settings: &Settings, with: Damping, rotor: bool) -> RobotModel {
    let mut elements = vec![transmission(settings)];
    elements.extend(damping(with));
    let model = joint(elements);
    if !rotor {
        return model;
    }
    let element = Box::new(RotorInertia { rate: MOTOR });
    model.with_known(vec![KnownElement {
        element,
        linear: vec![settings.chosen.motor_inertia],
        shape: vec![],
    }])
}

/// What a simulated joint has besides the six parameters.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Extras {
    /// Input friction with the terms that the paper's Eq. 22 lost.
    pub(super) full_friction: bool,
    /// Torque once a turn.
    pub(super) cyclic: bool,
}

/// Friction and torque that a joint has besides the six parameters, with their values.
fn extra_elements(settings: &Settings, extras: Extras) -> (Vec<Box<dyn JointElement>>, Vec<f64>) {
    let full = &settings.full;
    let mut elements: Vec<Box<dyn JointElement>> = Vec::new();
    let mut linear = Vec::new();
    if extras.cyclic {
        elements.push(Box::new(Cyclic::torque(LINK, ShapeSetting::held(1.0))));
        let (sine, cosine) = full.cyclic_phase.sin_cos();
        linear.extend([full.cyclic * sine, full.cyclic * cosine]);
    }
    if extras.full_friction {
        elements.push(Box::new(TanhFriction { rate: MOTOR, w: ShapeSetting::held(full.tanh_speed) }));
        elements.push(Box::new(StribeckViscous {
            rate: MOTOR,
            vs: ShapeSetting::held(full.fading_speed),
            delta: ShapeSetting::held(1.0),
        }));
        linear.extend([full.tanh, full.fading]);
    }
    (elements, linear)
}

/// The joint to be simulated, with inertias and brake, and its parameters.
pub(super) fn simulated(settings: &Settings, values: &Values, extras: Extras) -> (RobotModel, Vec<f64>) {
    let mut elements = vec![transmission(settings)];
    elements.extend(damping(Damping::Full));
    elements.push(Box::new(RotorInertia { rate: LINK }));
    elements.push(Box::new(RotorInertia { rate: MOTOR }));
    let mut linear = values.to_vec();
    linear.extend([settings.chosen.link_inertia, settings.chosen.motor_inertia]);
    let (more, of_more) = extra_elements(settings, extras);
    elements.extend(more);
    linear.extend(of_more);
    let brake = KnownElement {
        element: Box::new(ExternalLoad { rate: LINK, brake: true }),
        linear: vec![1.0],
        shape: vec![],
    };
    (joint(elements).with_known(vec![brake]), linear)
}

/// All that acts on either side but the spring, the inertias and the brake: friction with the terms that the paper's Eq. 22
/// lost, and the torque once a turn.
pub(super) fn without_spring(settings: &Settings) -> (RobotModel, Vec<f64>) {
    let (more, of_more) = extra_elements(settings, Extras { full_friction: true, cyclic: true });
    let mut elements = damping(Damping::Full);
    elements.extend(more);
    let mut linear = settings.truth.values()[2..].to_vec();
    linear.extend(of_more);
    (joint(elements), linear)
}
