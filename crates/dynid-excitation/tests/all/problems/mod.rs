//! Design problems of the acceptance table.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]
#![allow(dead_code, unreachable_pub, reason = "a benchmark uses a part of it")]

use std::sync::Arc;

use dynid_excitation::constraint::{
    Capsule, CapsulePairs, Capsules, CartesianLimits, EffortLimits, FramePoint, PathConstraint, Region,
};
use dynid_excitation::criterion::{Criterion, Measure};
use dynid_excitation::*;
use dynid_model::element::{Coulomb, JointElement, Offset, RotorInertia, Viscous};
use dynid_model::*;
use serde_json::Value;

use crate::plain_urdf::ur10 as ur10_mechanism;
use crate::support::{limits, mechanism, numbers, reference};

const PI: f64 = std::f64::consts::PI;

/// A robot whose base columns are designed for, with nominal values of all its parameters.
pub struct Robot {
    pub model: Arc<RobotModel>,
    pub nominal: Vec<f64>,
    pub base: BaseParameters,
}

impl Robot {
    /// `rotors`: inertias of drives of joints from the first on; `friction`: Coulomb, viscous and offset per joint.
    pub fn new(mechanism: &Mechanism, rotors: &[(usize, f64)], friction: &[[f64; 3]]) -> Self {
        let mut elements: Vec<Box<dyn JointElement>> = Vec::new();
        let rotor = |r: &(usize, f64)| Box::new(RotorInertia { rate: r.0 }) as Box<dyn JointElement>;
        elements.extend(rotors.iter().map(rotor));
        let joints = 0..friction.len();
        elements.extend(joints.clone().map(|rate| Box::new(Coulomb { rate }) as Box<dyn JointElement>));
        elements.extend(joints.clone().map(|rate| Box::new(Viscous { rate }) as Box<dyn JointElement>));
        elements.extend(joints.map(|rate| Box::new(Offset { rate }) as Box<dyn JointElement>));
        let model = RobotModel::new(mechanism.clone(), elements);
        let mut nominal = model.parameters().prior();
        let first = nominal.len() - rotors.len() - 3 * friction.len();
        for (k, rotor) in rotors.iter().enumerate() {
            nominal[first + k] = rotor.1;
        }
        for (j, values) in friction.iter().enumerate() {
            for (k, value) in values.iter().enumerate() {
                nominal[first + rotors.len() + k * friction.len() + j] = *value;
            }
        }
        let base = BaseParameters::of(&model, &model.mechanism().clone(), &[], &BaseSettings::default());
        Robot { model: Arc::new(model), nominal, base }
    }

    pub fn columns(&self) -> Box<RobotExcitation> {
        Box::new(RobotExcitation::new(self.model.clone(), Vec::new(), &self.base, Some(&self.nominal)))
    }

    pub fn efforts(&self, limits: &[f64]) -> Box<dyn PathConstraint> {
        let limits: Vec<Option<f64>> = limits.iter().copied().map(Some).collect();
        Box::new(EffortLimits::new(self.model.clone(), Vec::new(), self.nominal.clone(), &limits).unwrap())
    }

    /// All base columns, raw condition number, 5 harmonics of 0.05 Hz, 100 samples.
    pub fn problem(&self, limits: Vec<MotionLimits>) -> Problem {
        Problem {
            coordinates: self.model.mechanism().rate_names(),
            limits,
            constraints: Vec::new(),
            base: 0.1 * PI,
            harmonics: 5,
            start: StartConditions::default(),
            criterion: Criterion::raw(Measure::Condition),
            output_weights: vec![1.0; self.model.outputs().len()],
            effective_samples: 1000.0,
            prior: None,
            sign_width: DEFAULT_SIGN_WIDTH,
            samples: 100,
            model: self.columns(),
        }
    }
}

/// Indy7 with its drives, friction linear in the velocity beyond Coulomb's, at values of its size class.
pub fn indy7_robot(data: &Value) -> Robot {
    let phi = numbers(&data["truth"]["phi_standard"]);
    let rotors: Vec<(usize, f64)> = (2..6).map(|j| (j, phi[11 * j + 10])).collect();
    let joints = data["friction"]["joints"].as_array().unwrap();
    let friction: Vec<[f64; 3]> =
        joints.iter().map(|j| [j["Fc"].as_f64().unwrap(), 0.7 * j["Fc"].as_f64().unwrap(), 0.2]).collect();
    Robot::new(&mechanism(data), &rotors, &friction)
}

/// Indy7, 58 columns, with effort limits and distances.
pub fn indy7(rest: bool) -> Option<Problem> {
    let data = reference("robots/indy7.json")?;
    let robot = indy7_robot(&data);
    let number = |key: &str| data["workspace"][key].as_f64().unwrap();
    let mut distances = Vec::new();
    for link in ["link4", "link5", "link6"] {
        let point = FramePoint { frame: link.into(), position: Vec3::zero() };
        let floor = Region::HalfSpace { normal: Vec3([0.0, 0.0, 1.0]), offset: number("z_min") };
        let column = Region::OutsideOrAboveColumn {
            center: [0.0; 2],
            radius: number("column_radius"),
            height: number("column_height"),
        };
        distances.extend([(point.clone(), floor), (point, column)]);
    }
    let mut problem = robot.problem(limits(&data));
    problem.start.rest = rest;
    problem.constraints.push(robot.efforts(&numbers(&data["limits"]["tau_max"])));
    problem.constraints.push(Box::new(CartesianLimits::new(robot.model.mechanism(), &distances).unwrap()));
    Some(problem)
}

/// Indy7 with the noise of its efforts known.
pub fn indy7_weighted(measure: Measure) -> Option<Problem> {
    let noise = [0.6, 0.8, 0.4, 0.2, 0.2, 0.2];
    let mut problem = indy7(false)?;
    problem.output_weights = noise.iter().map(|s| 1.0 / s).collect();
    problem.criterion = Criterion::raw(measure);
    Some(problem)
}

/// ER-16 joints 1 to 3 with torque and wrist limits. The torque limit knows friction linear in the velocity beyond
/// Coulomb's, of the size of the published curves with an arctangent at 0.5 rad/s: the recorded figures were made with this
/// stand-in.
pub fn er16(friction_columns: bool) -> Option<Problem> {
    let data = reference("robots/er16.json")?;
    let mechanism = mechanism(&data);
    let nominal = Robot::new(&mechanism, &[], &[[45.0, 8.0, 0.7], [60.0, 10.0, 53.3], [30.0, 4.3, -3.4]]);
    let plain = Robot::new(&mechanism, &[], &[]);
    let wrist = FramePoint {
        frame: "link3".into(),
        position: Vec3(numbers(&data["wrist_centre_in_frame3"]).try_into().unwrap()),
    };
    let floor = Region::HalfSpace { normal: Vec3([0.0, 0.0, 1.0]), offset: 0.2 };
    let axis = Region::OutsideCylinder { center: [0.0; 2], radius: 0.34 };
    let distances = [(wrist.clone(), floor), (wrist, axis)];
    let mut problem = if friction_columns { &nominal } else { &plain }.problem(limits(&data));
    problem.constraints.push(nominal.efforts(&numbers(&data["limits"]["tau_max"])));
    problem.constraints.push(Box::new(CartesianLimits::new(&mechanism, &distances).unwrap()));
    Some(problem)
}

/// UR10 in the ranges and efforts of its file, 2 rad/s, 20 rad/s², 10 s; `apart`: links are kept from each other.
pub fn ur10(apart: bool) -> Option<Problem> {
    let mechanism = ur10_mechanism()?;
    let robot = Robot::new(&mechanism, &[], &[]);
    let joints: Vec<Limits> = mechanism.bodies().iter().map(|b| b.joint.limits).collect();
    let limits: Vec<MotionLimits> = joints
        .iter()
        .map(|l| MotionLimits {
            position: l.position.unwrap(),
            velocity: 2.0,
            acceleration: 20.0,
            jerk: f64::INFINITY,
        })
        .collect();
    let ranges: Vec<(f64, f64)> = limits.iter().map(|l| l.position).collect();
    let mut problem = robot.problem(limits);
    problem.base = 0.2 * PI;
    let efforts: Vec<f64> = joints.iter().map(|l| l.effort.unwrap()).collect();
    problem.constraints.push(robot.efforts(&efforts));
    if apart {
        let capsules = ur10_capsules(&mechanism);
        problem
            .constraints
            .push(Box::new(Capsules::new(&mechanism, &capsules, &CapsulePairs::All, &ranges).unwrap()));
    }
    Some(problem)
}

/// A pedestal, upper arm, forearm and the three wrist bodies as capsules from joint to joint.
fn ur10_capsules(mechanism: &Mechanism) -> Vec<Capsule> {
    let bodies = mechanism.bodies();
    let mut capsules = vec![Capsule {
        frame: mechanism.base_link().into(),
        ends: [Vec3::zero(), Vec3([0.0, 0.0, 0.05])],
        radius: 0.08,
    }];
    for (b, body) in bodies.iter().enumerate() {
        let next = bodies.iter().find(|c| c.parent == Some(b));
        let end = next.map_or(Vec3([0.0, 0.05, 0.0]), |c| c.joint.placement.translation);
        capsules.push(Capsule { frame: body.name.clone(), ends: [Vec3::zero(), end], radius: 0.05 });
    }
    capsules
}

/// A gantry of two slides that carries an elbow arm of two turning joints.
pub fn gantry_robot() -> Robot {
    let mut d = Description::new("gantry");
    d.links.push(LinkDescription { name: "base".into(), inertia: None });
    let slide = JointKind::Prismatic;
    let turn = JointKind::Revolute;
    let joints = [
        (slide, Placement::identity(), [1.0, 0.0, 0.0], 40.0),
        (slide, Placement::translate(0.0, 0.1, 0.3), [0.0, 0.0, 1.0], 20.0),
        (turn, Placement::translate(0.1, 0.0, 0.0), [0.0, 1.0, 0.0], 8.0),
        (turn, Placement::translate(0.4, 0.0, 0.0), [0.3, 1.0, 0.0], 4.0),
    ];
    for (k, (kind, placement, axis, mass)) in joints.into_iter().enumerate() {
        let tensor = Mat3::from_rows([[0.02, 0.001, 0.0], [0.001, 0.1, 0.0], [0.0, 0.0, 0.1]]);
        d.links.push(LinkDescription {
            name: format!("link{}", k + 1),
            inertia: Some(Inertia::from_com(mass, Vec3([0.2, 0.01, 0.02]), &tensor)),
        });
        d.joints.push(JointDescription {
            name: format!("j{}", k + 1),
            parent: if k == 0 { "base".into() } else { format!("link{k}") },
            child: format!("link{}", k + 1),
            kind,
            placement,
            axis,
            limits: Limits::default(),
            mimic: None,
        });
    }
    let mechanism = d.build().unwrap();
    let friction = [[60.0, 80.0, 1.0], [40.0, 50.0, -2.0], [3.0, 2.0, 0.1], [1.0, 1.0, 0.2]];
    Robot::new(&mechanism, &[], &friction)
}

/// The gantry with jerk limits.
pub fn gantry() -> Problem {
    let robot = gantry_robot();
    let limit = |range: f64, velocity: f64, acceleration: f64, jerk: f64| MotionLimits {
        position: (-0.4 * range, 0.6 * range),
        velocity,
        acceleration,
        jerk,
    };
    let mut problem = robot.problem(vec![
        limit(2.0, 0.6, 1.5, 4.0),
        limit(0.8, 0.4, 1.0, 3.0),
        limit(4.0, 2.0, 5.0, 15.0),
        limit(5.0, 2.5, 8.0, 25.0),
    ]);
    problem.base = 0.2 * PI;
    problem.criterion = Criterion::unit_norm(Measure::Condition);
    problem.constraints.push(robot.efforts(&[250.0, 450.0, 45.0, 16.0]));
    problem
}
