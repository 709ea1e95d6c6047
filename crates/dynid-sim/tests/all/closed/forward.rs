//! Accelerations are those that the drive efforts of inverse dynamics come from.

use dynid_model::closed::ClosedDynamics;
use dynid_model::{ClosedModel, EffortModel, MotionBlock, RobotModel, TreeModel};
use dynid_sim::{ClosedPlant, ForwardError, Plant, SimError};

use super::{at, bare, dynamics_at, robot, rough, worst};

/// Largest relative differences of accelerations and of determined multipliers.
fn round_trip(plant: &ClosedPlant, [q, v, a]: &[Vec<f64>; 3]) -> [f64; 2] {
    let mut dynamics = dynamics_at(plant, q);
    let (dq, ddq) = dynamics.motion(v, a);
    let mut work = plant.workspace();
    let effort = plant.drive_effort(&mut dynamics, (&dq, &ddq), &[], &mut work).unwrap();
    let mut found = vec![0.0; dq.len()];
    let positions = dynamics.pose().positions().to_vec();
    plant.acceleration((&positions, &dq), &effort.drives, &[], &mut work, &mut found).unwrap();
    let determined = |values: Vec<f64>| -> Vec<f64> {
        let known = plant.machine().is_determined();
        values.into_iter().zip(known).filter(|(_, known)| *known).map(|(x, _)| x).collect()
    };
    let multipliers = determined(plant.multipliers(&work));
    [worst(&found, &ddq), worst(&multipliers, &determined(effort.multipliers))]
}

#[test]
fn accelerations_are_those_of_the_efforts() {
    for (name, variant) in [
        ("fourbar", None),
        ("fourbar", Some("spatial")),
        ("fourbar", Some("coupler_as_distance")),
        ("fivebar", None),
        ("delta", None),
        ("stewart", None),
    ] {
        let Some(machine) = robot(name, variant, None) else { return };
        let mut largest = [0.0_f64; 2];
        for plant in [bare(machine.clone()), rough(machine, 1.0, 1e-2)] {
            for seed in 0..20 {
                let found = round_trip(&plant, &at(plant.machine(), 0.15, f64::from(seed)));
                largest = [largest[0].max(found[0]), largest[1].max(found[1])];
            }
        }
        println!("{name} {variant:?}: accelerations {:.1e}, multipliers {:.1e}", largest[0], largest[1]);
        assert!(largest[0] < 1e-10 && largest[1] < 1e-9, "{name} {variant:?}: {largest:?}");
    }
}

/// The effort model of estimation gives the same efforts.
#[test]
fn efforts_are_those_of_the_effort_model() {
    for name in ["fourbar", "fivebar", "delta", "stewart"] {
        let Some(machine) = robot(name, None, None) else { return };
        let plant = rough(machine, 1.0, 1e-2);
        let [q, v, a] = at(plant.machine(), 0.1, 0.5);
        let motion = MotionBlock { sign_width: 1e-2, ..MotionBlock::plain(1, &q, &v, &a) };
        let mut expected = vec![0.0; plant.drives()];
        plant.model().efforts(&motion, plant.shape(), plant.linear(), 1, &mut expected);
        let mut dynamics = dynamics_at(&plant, &q);
        let (dq, ddq) = dynamics.motion(&v, &a);
        let mut work = plant.workspace();
        let found = plant.drive_effort(&mut dynamics, (&dq, &ddq), &[], &mut work).unwrap().drives;
        assert!(worst(&found, &expected) < 1e-12, "{name}: {found:?} {expected:?}");
    }
}

/// A leaf of the tree without mass makes the mass matrix singular, not the motion.
#[test]
fn bodies_may_be_without_mass_as_long_as_every_motion_moves_some() {
    for (name, massless) in [("fourbar", &[2][..]), ("fivebar", &[3]), ("stewart", &[2, 5])] {
        let Some(machine) = robot(name, None, None) else { return };
        let plant = bare(machine.clone());
        let mut linear = plant.linear().to_vec();
        massless.iter().for_each(|b| linear[10 * b..10 * b + 10].fill(0.0));
        let plant = plant.with_linear(linear).unwrap();
        let [found, multipliers] = round_trip(&plant, &at(plant.machine(), 0.1, 1.0));
        assert!(found < 1e-10 && multipliers < 1e-9, "{name}: {found:e} {multipliers:e}");
    }
    let Some(machine) = robot("fivebar", None, None) else { return };
    let plant = bare(machine);
    let mut linear = vec![0.0; plant.linear().len()];
    // One body's mass moves with one of two free motions, at right angles to the other.
    linear[9] = 0.1;
    let plant = plant.with_linear(linear).unwrap();
    let state = plant.state(&plant.machine().home_independent(), &[0.3, 0.2]).unwrap();
    let mut ddq = vec![0.0; state.dq.len()];
    let fault = plant
        .acceleration((&state.q, &state.dq), &[0.0; 2], &[], &mut plant.workspace(), &mut ddq)
        .unwrap_err();
    println!("{fault}");
    assert!(matches!(fault, ForwardError::NoInertia { .. }));
}

/// More drives than free motions, and coordinates of the platform in place of drives.
#[test]
fn drives_and_coordinates_may_be_any() {
    let Some(over) = robot("fivebar", None, Some(&["left_crank", "right_crank", "left_distal"])) else {
        return;
    };
    assert!(super::is_over_actuated(&over));
    let plant = rough(over, 1.0, 1e-2);
    let [found, multipliers] = round_trip(&plant, &at(plant.machine(), 0.2, 2.0));
    assert!(found < 1e-10 && multipliers < 1e-9, "{found:e} {multipliers:e}");

    let Some(machine) = robot("fivebar", None, None) else { return };
    let task = machine.clone().with_independent(&["left_crank".into(), "left_distal".into()]).unwrap();
    let (by_drives, by_task) = (bare(machine), bare(task));
    assert_eq!(by_task.machine().independent(), by_drives.machine().independent());
    let state = by_drives.state(&by_drives.machine().home_independent(), &[1.0, -0.5]).unwrap();
    let accelerations = |plant: &ClosedPlant| {
        let mut ddq = vec![0.0; state.dq.len()];
        let (at, mut work) = ((&state.q[..], &state.dq[..]), plant.workspace());
        plant.acceleration(at, &[0.4, -0.2], &[], &mut work, &mut ddq).unwrap();
        ddq
    };
    assert!(worst(&accelerations(&by_task), &accelerations(&by_drives)) < 1e-12);
}

/// At a pose where the drive loses control the mechanism still accelerates, from both sides alike.
#[test]
fn poses_where_drives_lose_control_are_passed() {
    let Some(machine) = robot("fourbar", None, Some(&["rocker"])) else { return };
    let plant = bare(machine.clone());
    let Some(by_crank) = robot("fourbar", None, None) else { return };
    let crank = by_crank.mechanism().joint_index("crank").unwrap();
    // Crank and coupler in one line: the rocker stands still while the crank turns.
    let (ground, straight, rocker) = (0.4_f64, 0.35 + 0.12, 0.3_f64);
    let angle =
        ((ground * ground + straight * straight - rocker * rocker) / (2.0 * ground * straight)).acos();
    let mut dynamics = ClosedDynamics::new(by_crank.clone());
    dynamics.reach(&[angle]).unwrap();
    let (dq, _) = dynamics.motion(&[2.0], &[0.0]);
    let rate = machine.driven()[0];
    assert!(dq[rate].abs() < 1e-7 && dq[crank].abs() > 1.0, "{dq:?}");
    let mut found = vec![0.0; dq.len()];
    let at = (dynamics.pose().positions(), &dq[..]);
    plant.acceleration(at, &[0.7], &[], &mut plant.workspace(), &mut found).unwrap();
    let mut expected = vec![0.0; dq.len()];
    bare(by_crank).acceleration(at, &[0.0], &[], &mut plant.workspace(), &mut expected).unwrap();
    // Without control the drive has no say either.
    assert!(worst(&found, &expected) < 1e-6, "{found:?} {expected:?}");
}

#[test]
fn plants_of_the_wrong_kind_are_refused() {
    let Some(machine) = robot("fourbar", None, None) else { return };
    let tree = || TreeModel::new(machine.mechanism().clone(), Vec::new());
    let linear = machine.mechanism().inertia_vector();
    let open = ClosedPlant::new(RobotModel::from(tree()), linear.clone(), vec![], 1e-3).unwrap_err();
    assert_eq!(open, SimError::NoLoops);
    let closed = RobotModel::from(ClosedModel::new(tree(), machine.clone()));
    assert_eq!(Plant::new(closed, linear, vec![], 1e-3).unwrap_err(), SimError::ClosedMechanism);
}
