//! The simulated arm: robot file, true friction, and models with the friction that an estimate assumes.

use std::sync::Arc;

use dynid::friction::KnownFriction;
use dynid::friction::model::{BristleModel, ExponentialModel, ViscousModel};
use dynid::model::element::{Coulomb, Cyclic, JointElement, Offset, RotorInertia, ShapeSetting, Viscous};
use dynid::model::{BaseParameters, BaseSettings, EffortModel, Mechanism, RobotModel};
use dynid::sim::Plant;
use dynid::{Robot, RobotOptions};

use super::settings::{Friction, Settings};
use super::{JOINTS, fault};
use crate::StudyError;

/// Speed over which the simulation smooths the sign of velocities in the viscous law, rad/s. Bristles need none.
const SIGN_WIDTH: f64 = 1e-4;

/// The arm and its truth.
#[derive(Debug)]
pub(super) struct Indy7 {
    pub(super) mechanism: Mechanism,
    /// Bristles, viscous friction of temperature and rotors.
    pub(super) model: Arc<RobotModel>,
    /// True linear parameters of [`Self::model`]; it has no free shape.
    pub(super) linear: Vec<f64>,
    /// True standard parameters: ten per link, then the rotor inertias.
    pub(super) standard: Vec<f64>,
    /// Base parameters of links and rotors.
    inertial: BaseParameters,
    /// Place of each row of Table A1 among them.
    order: Vec<usize>,
}

/// Inertial rows of Table A1 by the parameter that stands for each.
pub(super) const TABLE_A1: [&str; 40] = [
    "Izz1", "Ixx2", "Ixy2", "Ixz2", "Iyz2", "Izz2", "mx2", "my2", "Ixx3", "Ixy3", "Ixz3", "Iyz3", "Izz3",
    "mx3", "my3", "Ia3", "Ixx4", "Ixy4", "Ixz4", "Iyz4", "Izz4", "mx4", "my4", "Ia4", "Ixx5", "Ixy5", "Ixz5",
    "Iyz5", "Izz5", "mx5", "my5", "Ia5", "Ixx6", "Ixy6", "Ixz6", "Iyz6", "Izz6", "mx6", "my6", "Ia6",
];

/// The arm with all joints but one at rest in the upright pose.
#[derive(Debug)]
pub(super) struct SingleJoint {
    pub(super) name: String,
    pub(super) model: Arc<RobotModel>,
    pub(super) linear: Vec<f64>,
}

impl SingleJoint {
    pub(super) fn new(settings: &Settings, arm: &Indy7, joint: usize) -> Result<Self, StudyError> {
        let names = arm.mechanism.rate_names();
        let others = names.iter().enumerate().filter(|(j, _)| *j != joint);
        let options = RobotOptions {
            locked: others.map(|(_, name)| (name.clone(), 0.0)).collect(),
            ..RobotOptions::default()
        };
        let mechanism = load(&options)?.mechanism;
        let mut linear = mechanism.inertia_vector();
        let mut elements: Vec<Box<dyn JointElement>> = Vec::new();
        for known in settings.friction[joint].known(&names[joint], settings.thermal.valid).elements(0) {
            elements.push(known.element);
            linear.extend(known.linear);
        }
        elements.push(Box::new(RotorInertia { rate: 0 }));
        linear.push(arm.standard[10 * JOINTS + joint]);
        let model = Arc::new(RobotModel::new(mechanism, elements));
        Ok(SingleJoint { name: names[joint].clone(), model, linear })
    }

    pub(super) fn plant(&self) -> Result<Plant, StudyError> {
        Ok(Plant::new(self.model.clone(), self.linear.clone(), Vec::new(), SIGN_WIDTH)?)
    }

    /// All that turns with the joint in the upright pose, rotor included, kg m².
    pub(super) fn inertia(&self) -> Result<f64, StudyError> {
        let plant = self.plant()?;
        Ok(plant.mass_matrix(&[0.0], &mut plant.workspace())[0])
    }
}

fn load(options: &RobotOptions) -> Result<Robot, StudyError> {
    let text = include_str!("../../../../robots/indy7.toml");
    Ok(Robot::parse(text, "robots/indy7.toml".as_ref(), options)?)
}

impl Indy7 {
    pub(super) fn new(settings: &Settings) -> Result<Self, StudyError> {
        let robot = load(&RobotOptions::default())?;
        let mechanism = robot.mechanism.clone();
        let rotor = |name: &str| {
            let stated = robot
                .elements
                .settings
                .iter()
                .find(|s| s.joint == name && s.element == "rotor" && s.key == "inertia");
            match stated.map(|s| &s.value) {
                Some(dynid::io::SettingValue::Number(x)) => Ok(*x),
                _ => Err(StudyError::Data {
                    file: "robots/indy7.toml",
                    message: format!("joint `{name}` states no rotor inertia"),
                }),
            }
        };
        let names = mechanism.rate_names();
        let mut rotors = [0.0; JOINTS];
        for (to, name) in rotors.iter_mut().zip(&names) {
            *to = rotor(name)?;
        }
        let mut elements: Vec<Box<dyn JointElement>> = Vec::new();
        let mut linear = mechanism.inertia_vector();
        for (rate, (friction, name)) in settings.friction.iter().zip(&names).enumerate() {
            for known in friction.known(name, settings.thermal.valid).elements(rate) {
                elements.push(known.element);
                linear.extend(known.linear);
            }
            elements.push(Box::new(RotorInertia { rate }));
            linear.push(rotors[rate]);
        }
        let model = Arc::new(RobotModel::new(mechanism.clone(), elements));
        let standard = mechanism.inertia_vector().into_iter().chain(rotors).collect();
        let rigid = rigid(&mechanism);
        let inertial = BaseParameters::of(&rigid, &mechanism, &[], &BaseSettings::default());
        let table = &rigid.parameters().linear;
        let place = |name: &&str| inertial.kept.iter().position(|c| table[*c].symbol == **name);
        let order: Vec<usize> = TABLE_A1.iter().filter_map(place).collect();
        if order.len() != TABLE_A1.len() || inertial.len() != order.len() {
            return Err(fault("the base parameters are not those of Table A1"));
        }
        Ok(Indy7 { mechanism, model, linear, standard, inertial, order })
    }

    /// Base values of standard parameters (ten per link, then rotor inertias) in the order of Table A1.
    pub(super) fn base_values(&self, standard: &[f64]) -> Vec<f64> {
        let values = self.inertial.values(standard);
        self.order.iter().map(|k| values[*k]).collect()
    }

    pub(super) fn plant(&self) -> Result<Plant, StudyError> {
        Ok(Plant::new(self.model.clone(), self.linear.clone(), Vec::new(), SIGN_WIDTH)?)
    }

    /// Rigid bodies and rotors, with Coulomb, viscous and offset columns: the regression of the paper, in which they stand
    /// for the friction or for its errors.
    pub(super) fn regression(&self) -> RobotModel {
        self.regression_with(&Cycles::default())
    }

    /// The regression model with torque ripple of given orders.
    pub(super) fn regression_with(&self, cycles: &Cycles) -> RobotModel {
        let mut elements: Vec<Box<dyn JointElement>> = Vec::new();
        for (rate, orders) in cycles.iter().enumerate() {
            elements.push(Box::new(RotorInertia { rate }));
            elements.push(Box::new(Coulomb { rate }));
            elements.push(Box::new(Viscous { rate }));
            elements.push(Box::new(Offset { rate }));
            elements.extend(ripple(rate, orders));
        }
        RobotModel::new(self.mechanism.clone(), elements)
    }
}

/// Torque ripple of given orders at a joint.
pub(super) fn ripple(rate: usize, orders: &[u32]) -> Vec<Box<dyn JointElement>> {
    let order = |n: &u32| -> Box<dyn JointElement> {
        Box::new(Cyclic::torque(rate, ShapeSetting::held(f64::from(*n))))
    };
    orders.iter().map(order).collect()
}

/// Links and rotors alone.
pub(super) fn rigid(mechanism: &Mechanism) -> RobotModel {
    let rotors = (0..JOINTS).map(|rate| -> Box<dyn JointElement> { Box::new(RotorInertia { rate }) });
    RobotModel::new(mechanism.clone(), rotors.collect())
}

impl Friction {
    /// Friction of a joint with these values; `valid`: temperatures for which it holds.
    pub(super) fn known(&self, joint: &str, valid: [f64; 2]) -> KnownFriction {
        KnownFriction {
            joint: joint.to_owned(),
            coulomb: self.coulomb,
            static_: Some(self.fixed),
            stribeck_speed: Some(self.stribeck_speed),
            stribeck_exponent: None,
            viscous: Some(ViscousModel::Exponential(ExponentialModel {
                reference_temperature: 0.0,
                sigma2: self.sigma2[0],
                sigma2_slope: self.sigma2[1],
                sigma3: self.sigma3[0],
                sigma3_slope: self.sigma3[1],
                sigma4: self.sigma4[0],
                sigma4_slope: self.sigma4[1],
            })),
            bristle: Some(BristleModel { sigma0: self.sigma0, sigma1: self.sigma1, prior: false }),
            temperature_range: Some(valid),
            temperature: None,
        }
    }

    /// Steady friction at a speed (rad/s) and a temperature, N m.
    pub(super) fn steady(&self, v: f64, temperature: f64) -> f64 {
        let line = |[value, slope]: [f64; 2]| value + slope * temperature;
        let falling = (-(v / self.stribeck_speed).powi(2)).exp();
        let viscous = line(self.sigma2) * -(-(line(self.sigma3) * v).powf(line(self.sigma4))).exp_m1();
        self.coulomb + (self.fixed - self.coulomb) * falling + viscous
    }
}

/// Per joint, repetitions per turn of the torque ripple that is modelled.
pub(super) type Cycles = [Vec<u32>; JOINTS];
