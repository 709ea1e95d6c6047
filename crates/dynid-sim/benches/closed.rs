//! Time per evaluation of accelerations of closed mechanisms, and per step back to the closed poses.

use divan::{Bencher, black_box};
use dynid_model::closed::{ClosedMechanism, ClosureDescription, Condition, CutKind, LinkFrame};
use dynid_model::element::{Coulomb, JointElement, RotorInertia, Viscous};
use dynid_model::*;
use dynid_sim::{ClosedIntegrator, ClosedPlant, PlantState, Stepping};

fn main() {
    divan::main();
}

fn add(
    d: &mut Description,
    name: &str,
    parent: &str,
    kind: JointKind,
    xyz: [f64; 3],
    axis: [f64; 3],
    mass: f64,
) {
    let com = Vec3([0.1, 0.02, 0.05]);
    let about_com = Mat3::from_rows([[0.01, 0.0, 0.0], [0.0, 0.012, 0.001], [0.0, 0.001, 0.008]]);
    let inertia = (mass > 0.0).then(|| Inertia::from_com(mass, com, &about_com));
    d.links.push(LinkDescription { name: name.into(), inertia });
    d.joints.push(JointDescription {
        name: name.into(),
        parent: parent.into(),
        child: name.into(),
        kind,
        placement: Placement::from_xyz_rpy(xyz, [0.0; 3]),
        axis,
        limits: Limits::default(),
        mimic: None,
    });
}

fn frame(link: &str, xyz: [f64; 3]) -> LinkFrame {
    LinkFrame { link: link.into(), placement: Placement::from_xyz_rpy(xyz, [0.0; 3]) }
}

fn ground(gravity: [f64; 3]) -> Description {
    let mut d = Description::new("bench");
    d.gravity = gravity;
    d.links.push(LinkDescription { name: "ground".into(), inertia: None });
    d
}

fn fourbar() -> ClosedMechanism {
    let mut d = ground([0.0, -9.81, 0.0]);
    let z = [0.0, 0.0, 1.0];
    add(&mut d, "crank", "ground", JointKind::Revolute, [0.0; 3], z, 0.8);
    add(&mut d, "coupler", "crank", JointKind::Revolute, [0.12, 0.0, 0.0], z, 1.1);
    add(&mut d, "rocker", "ground", JointKind::Revolute, [0.4, 0.0, 0.0], z, 0.9);
    let (a, b) = (frame("coupler", [0.35, 0.0, 0.0]), frame("rocker", [0.3, 0.0, 0.0]));
    let condition = Condition::Joint { kind: CutKind::PlanarRevolute, a, b };
    let home = [("crank", 0.6), ("coupler", 0.117), ("rocker", 1.695)];
    let home: Vec<(String, Vec<f64>)> = home.iter().map(|(n, q)| ((*n).into(), vec![*q])).collect();
    let closures = vec![ClosureDescription { name: "pin".into(), condition }];
    let mechanism = d.build().expect("the four-bar is sound");
    ClosedMechanism::new(mechanism, closures, Some(&["crank".into()]), &home).expect("the four-bar closes")
}

/// Six legs with universal joints at the ground, sliding rods, and ball joints at a floating platform.
fn stewart() -> ClosedMechanism {
    let mut d = ground([0.0, 0.0, -9.81]);
    let (mut closures, mut home, mut driven) = (Vec::new(), Vec::new(), Vec::new());
    let height = 0.8;
    add(&mut d, "platform", "ground", JointKind::Floating, [0.0; 3], [0.0, 0.0, 1.0], 9.5);
    home.push(("platform".to_owned(), vec![0.0, 0.0, height, 0.0, 0.0, 0.0, 1.0]));
    for k in 0..6 {
        let pair = f64::from(k / 2) * std::f64::consts::TAU / 3.0;
        let side = if k % 2 == 0 { -1.0 } else { 1.0 };
        let point = |radius: f64, angle: f64| [radius * angle.cos(), radius * angle.sin(), 0.0];
        let foot = point(0.6, pair + side * 0.2);
        let ball = point(0.35, pair + side * 0.8);
        let [cross, cylinder, rod] = ["cross", "cylinder", "rod"].map(|n| format!("{n}{k}"));
        add(&mut d, &cross, "ground", JointKind::Revolute, foot, [1.0, 0.0, 0.0], 0.0);
        add(&mut d, &cylinder, &cross, JointKind::Revolute, [0.0; 3], [0.0, 1.0, 0.0], 2.4);
        add(&mut d, &rod, &cylinder, JointKind::Prismatic, [0.0; 3], [0.0, 0.0, 1.0], 1.1);
        let leg = [ball[0] - foot[0], ball[1] - foot[1], height];
        let length = leg.iter().map(|x| x * x).sum::<f64>().sqrt();
        home.push((cross, vec![(-leg[1]).atan2(leg[2])]));
        home.push((cylinder, vec![(leg[0] / length).asin()]));
        home.push((rod.clone(), vec![length]));
        let (a, b) = (frame(&rod, [0.0; 3]), frame("platform", ball));
        let condition = Condition::Joint { kind: CutKind::Spherical, a, b };
        closures.push(ClosureDescription { name: format!("ball{k}"), condition });
        driven.push(rod);
    }
    let mechanism = d.build().expect("the platform is sound");
    ClosedMechanism::new(mechanism, closures, Some(&driven), &home).expect("the platform closes")
}

/// Rotors at the drives, friction at all joints that do not float.
fn plant(machine: ClosedMechanism) -> (ClosedPlant, PlantState) {
    let mut elements: Vec<Box<dyn JointElement>> = Vec::new();
    let mut linear = machine.mechanism().inertia_vector();
    for rate in (0..machine.mechanism().rates()).filter(|r| !machine.floats(*r)) {
        elements.push(Box::new(Coulomb { rate }));
        elements.push(Box::new(Viscous { rate }));
        linear.extend([0.05, 0.02]);
    }
    for rate in machine.driven() {
        elements.push(Box::new(RotorInertia { rate: *rate }));
        linear.push(0.02);
    }
    let tree = TreeModel::new(machine.mechanism().clone(), elements);
    let model = RobotModel::from(ClosedModel::new(tree, machine));
    let plant = ClosedPlant::new(model, linear, vec![], 1e-3).expect("parameters fit");
    let rates = vec![0.1; plant.machine().mobility()];
    let state = plant.state(&plant.machine().home_independent(), &rates).expect("home is reached");
    (plant, state)
}

fn machine(name: &str) -> (ClosedPlant, PlantState) {
    plant(if name == "fourbar" { fourbar() } else { stewart() })
}

const MACHINES: [&str; 2] = ["fourbar", "stewart"];

#[divan::bench(args = MACHINES)]
fn acceleration(bencher: Bencher<'_, '_>, name: &str) {
    let (plant, state) = machine(name);
    let (mut work, mut ddq) = (plant.workspace(), vec![0.0; state.dq.len()]);
    let drive = vec![0.5; plant.drives()];
    bencher.bench_local(|| {
        let at = (&state.q[..], &state.dq[..]);
        plant.acceleration(black_box(at), &drive, &[], &mut work, &mut ddq).expect("the mechanism moves");
        black_box(&ddq);
    });
}

#[divan::bench(args = MACHINES)]
fn settle(bencher: Bencher<'_, '_>, name: &str) {
    let (plant, state) = machine(name);
    let mut work = plant.workspace();
    bencher.bench_local(|| {
        let (mut q, mut dq) = (state.q.clone(), state.dq.clone());
        q[0] += 1e-8;
        plant.settle(black_box(&mut q), &mut dq, &mut work).expect("the mechanism closes");
    });
}

/// A millisecond under control of the error.
#[divan::bench(args = MACHINES)]
fn millisecond(bencher: Bencher<'_, '_>, name: &str) {
    let (plant, state) = machine(name);
    let stepping = Stepping::Controlled { tolerance: 1e-9 };
    let mut integrator = ClosedIntegrator::new(&plant, stepping).expect("a sound tolerance");
    let drive = vec![0.5; plant.drives()];
    bencher.bench_local(|| {
        let mut now = state.clone();
        integrator.advance(black_box(&mut now), &drive, &[], 0.0, 1e-3).expect("the mechanism moves");
    });
}
