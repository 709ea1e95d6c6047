//! Friction that follows reactions: accelerations, forces and friction of one instant.

use dynid_model::closed::ClosedMechanism;
use dynid_model::element::{JointElement, ReactionFriction, RotorInertia, ShapeSetting, Stribeck};
use dynid_model::*;
use dynid_sim::*;

use super::{at, dynamics_at, robot, worst};

/// Friction of pins that forces along x and y press on, at all joints of the tree; `radius` in m.
fn pins(machine: ClosedMechanism, radius: f64, falls: bool, width: f64) -> ClosedPlant {
    let rates = machine.mechanism().rates();
    let mut elements: Vec<Box<dyn JointElement>> = Vec::new();
    let mut linear = machine.mechanism().inertia_vector();
    let mut loads = Vec::new();
    for rate in (0..rates).filter(|r| !machine.floats(*r)) {
        let law = Stribeck {
            vs: ShapeSetting { start: 0.5, lower: 0.1, upper: 2.0, held: false },
            ..Stribeck::new(rate)
        };
        elements.push(Box::new(ReactionFriction { law, falls, viscous: falls }));
        linear.push(0.3);
        if falls {
            linear.extend([0.45, 0.02]);
        }
        let component =
            |component| Reaction::Joint { body: machine.mechanism().rate_bodies()[rate], component };
        loads.push(JointLoad {
            rate,
            reactions: vec![LoadGroup { components: vec![component(0), component(1)], factor: radius }],
            weight: Vec::new(),
            constant: 0.01,
        });
    }
    elements.push(Box::new(RotorInertia { rate: machine.driven()[0] }));
    linear.push(0.01);
    let tree = TreeModel::new(machine.mechanism().clone(), elements);
    let shape = tree.parameters().shape_start();
    let reference = LoadReference { linear: linear.clone(), shape: shape.clone(), linearised: false };
    let closed = ClosedModel::new(tree, machine).with_loads(loads, reference).unwrap();
    ClosedPlant::new(RobotModel::from(closed), linear, shape, width).unwrap()
}

#[test]
fn accelerations_forces_and_friction_go_together() {
    for (name, radius) in [("fourbar", 0.01), ("fivebar", 0.01), ("delta", 0.005), ("stewart", 0.005)] {
        for falls in [false, true] {
            let Some(machine) = robot(name, None, None) else { return };
            let plant = pins(machine, radius, falls, 1e-2);
            let mut work = plant.workspace();
            let mut largest = [0.0_f64; 3];
            for seed in 0..20 {
                let [q, v, a] = at(plant.machine(), 0.1, f64::from(seed));
                let mut dynamics = dynamics_at(&plant, &q);
                let (dq, ddq) = dynamics.motion(&v, &a);
                let effort = plant.drive_effort(&mut dynamics, (&dq, &ddq), &[], &mut work).unwrap();
                let forces = plant.load_forces(&work).to_vec();
                let motion = MotionBlock { sign_width: 1e-2, ..MotionBlock::plain(1, &q, &v, &a) };
                let mut expected = vec![0.0; plant.drives()];
                plant.model().efforts(&motion, plant.shape(), plant.linear(), 1, &mut expected);
                let mut found = vec![0.0; dq.len()];
                let positions = dynamics.pose().positions().to_vec();
                plant.acceleration((&positions, &dq), &effort.drives, &[], &mut work, &mut found).unwrap();
                let rounds = [
                    worst(&effort.drives, &expected),
                    worst(&found, &ddq),
                    worst(plant.load_forces(&work), &forces),
                ];
                largest.iter_mut().zip(rounds).for_each(|(m, x)| *m = m.max(x));
            }
            println!(
                "{name}: efforts {:.1e}, accelerations {:.1e}, forces {:.1e}",
                largest[0], largest[1], largest[2]
            );
            assert!(largest[0] < 1e-10 && largest[1] < 1e-9 && largest[2] < 1e-9, "{name}: {largest:?}");
        }
    }
}

/// Efforts of drives over a whole experiment are those of the motion, and friction takes what energy is missing.
#[test]
fn inverse_dynamics_of_simulated_motion_gives_the_efforts_back() {
    let Some(machine) = robot("fourbar", None, None) else { return };
    let mut plant = pins(machine.clone(), 0.01, true, 1e-3);
    let nominal = pins(machine, 0.01, true, 1e-3);
    let home = nominal.machine().home_independent()[0];
    let reference = |t: f64| {
        let (s, c) = (4.0 * t).sin_cos();
        vec![[home + 0.6 * s, 2.4 * c, -9.6 * s]]
    };
    let settings = ExperimentSettings {
        duration_s: 1.0,
        imperfections: Imperfections::none(),
        ..ExperimentSettings::default()
    };
    let found = run_closed(&mut plant, &nominal, &reference, &settings).unwrap();
    let log = &found.log;
    let rows = log.time.len();
    let motion = MotionBlock {
        sign_width: 1e-3,
        ..MotionBlock::plain(rows, &log.truth.q[0], &log.truth.dq[0], &log.truth.ddq[0])
    };
    let mut expected = vec![0.0; rows];
    plant.model().efforts(&motion, plant.shape(), plant.linear(), rows, &mut expected);
    let wrong = worst(&log.truth.effort[0], &expected);
    let missing = found.energy.residual().abs() / found.energy.drive_work.abs();
    println!("efforts off by {wrong:.1e}, energy {missing:.1e}, {:?}", found.integration);
    assert!(wrong < 1e-9 && missing < 1e-6 && found.energy.element_work > 0.0);
}

/// Pins as thick as the links: the rocker cannot be turned by its pins any more.
#[test]
fn friction_that_locks_itself_is_named() {
    let Some(machine) = robot("fourbar", None, None) else { return };
    let mut faults = 0;
    for radius in [0.02, 0.1, 0.5, 2.0] {
        let plant = pins(machine.clone(), radius, false, 1e-2);
        let mut work = plant.workspace();
        for seed in 0..20 {
            let [q, v, _] = at(plant.machine(), 0.1, f64::from(seed));
            let state = plant.state(&q, &v).unwrap();
            let mut ddq = vec![0.0; 3];
            match plant.acceleration((&state.q, &state.dq), &[5.0], &[], &mut work, &mut ddq) {
                Ok(()) => {
                    // Whatever was found satisfies friction and forces together.
                    let mut dynamics = dynamics_at(&plant, &q);
                    let forces = plant.load_forces(&work).to_vec();
                    let found = plant.drive_effort(&mut dynamics, (&state.dq, &ddq), &[], &mut work);
                    let effort = found.unwrap().drives;
                    let same = worst(plant.load_forces(&work), &forces) < 1e-6;
                    assert!(!same || (effort[0] - 5.0).abs() < 1e-6, "{radius}: {effort:?}");
                }
                Err(fault) => {
                    assert!(matches!(&fault, ForwardError::SelfLocking { joint } if !joint.is_empty()));
                    if faults == 0 {
                        println!("radius {radius}: {fault}");
                    }
                    faults += 1;
                }
            }
        }
    }
    println!("{faults} of 80 states locked");
    assert!(faults > 0);
}
