//! Integrated motion: energy, loops that stay closed, order, floating platforms, singular poses of drives.

use dynid_model::closed::FreeMotions;
use dynid_model::element::{JointElement, LuGre, ShapeSetting};
use dynid_model::{ClosedModel, EffortModel, RobotModel, TreeModel};
use dynid_sim::{ClosedIntegrator, ClosedPlant, PlantState, Stepping};

use super::{at, bare, dynamics_at, robot, rough, worst};

const CONTROLLED: Stepping = Stepping::Controlled { tolerance: 1e-9 };

fn energy(plant: &ClosedPlant, state: &PlantState) -> f64 {
    let found = plant.energy(&state.q, &state.dq, &mut plant.workspace());
    found.kinetic + found.potential
}

/// Moves on under constant efforts in intervals of 10 ms; `visit` sees the state after each.
fn run(
    plant: &ClosedPlant,
    state: &mut PlantState,
    drive: &[f64],
    seconds: f64,
    stepping: Stepping,
    mut visit: impl FnMut(&PlantState),
) -> usize {
    let mut integrator = ClosedIntegrator::new(plant, stepping).unwrap();
    for k in 0..(seconds * 100.0).round() as usize {
        integrator.advance(state, drive, &[], 0.01 * k as f64, 0.01).unwrap();
        visit(state);
    }
    let count = integrator.count();
    count.accepted + count.rejected
}

/// Gap of the loops, m, and speed of residuals that should stand still.
fn openness(plant: &ClosedPlant, free: &mut FreeMotions, state: &PlantState) -> [f64; 2] {
    plant.machine().free_at(free, &state.q);
    let speed = free
        .jacobian()
        .chunks_exact(state.dq.len())
        .map(|row| row.iter().zip(&state.dq).map(|(j, v)| j * v).sum::<f64>().abs());
    [free.gap(), speed.fold(0.0, f64::max)]
}

/// The energy of 10 s of a swinging four-bar.
#[test]
fn a_swinging_fourbar_keeps_its_energy_and_its_loop() {
    let Some(machine) = robot("fourbar", None, None) else { return };
    let plant = bare(machine);
    for stepping in [Stepping::RungeKutta4 { step: 1e-3 }, CONTROLLED] {
        let mut state = plant.state(&plant.machine().home_independent(), &[0.0]).unwrap();
        let mut free = plant.machine().free_motions();
        let before = energy(&plant, &state);
        let (mut lowest, mut open, mut error) = (f64::INFINITY, [0.0_f64; 2], 0.0_f64);
        let steps = run(&plant, &mut state, &[0.0], 10.0, stepping, |s| {
            let found = openness(&plant, &mut free, s);
            open = [open[0].max(found[0]), open[1].max(found[1])];
            error = error.max((energy(&plant, s) - before).abs());
            let kinetic = plant.energy(&s.q, &s.dq, &mut plant.workspace()).kinetic;
            lowest = lowest.min(before - kinetic);
        });
        // The swing is the largest kinetic energy.
        let scale = before - lowest;
        println!(
            "{stepping:?}: energy {:.1e} of {scale:.3} J, gap {:.1e} m, its rate {:.1e} m/s, {steps} steps",
            error / scale,
            open[0],
            open[1]
        );
        assert!(scale > 1.0 && error < 1e-6 * scale && open[0] < 1e-12 && open[1] < 1e-12);
    }
}

/// Errors of the classical method fall with the fourth power of the step, also where joints float.
#[test]
fn the_order_is_four_also_with_floating_platforms() {
    for (name, seconds, speed) in [("fivebar", 0.2, 1.0), ("delta", 0.1, 1.0), ("stewart", 0.1, 0.2)] {
        let Some(machine) = robot(name, None, None) else { return };
        let plant = bare(machine);
        let [_, v, _] = at(plant.machine(), 0.0, 1.0);
        let v: Vec<f64> = v.iter().map(|v| speed * v).collect();
        let start = plant.state(&plant.machine().home_independent(), &v).unwrap();
        let drive = vec![0.3; plant.drives()];
        let end = |stepping| {
            let mut state = start.clone();
            run(&plant, &mut state, &drive, seconds, stepping, |_| ());
            [state.q, state.dq].concat()
        };
        let fine = end(Stepping::RungeKutta4 { step: 0.01 / 16.0 });
        let errors = [0.01, 0.005, 0.0025].map(|step| worst(&end(Stepping::RungeKutta4 { step }), &fine));
        let orders = [(errors[0] / errors[1]).log2(), (errors[1] / errors[2]).log2()];
        let controlled = worst(&end(Stepping::Controlled { tolerance: 1e-10 }), &fine);
        println!("{name}: errors {errors:?}, orders {orders:.2?}; controlled {controlled:.1e}");
        assert!(orders.iter().all(|o| *o > 3.5), "{name}: orders {orders:?}");
        assert!(controlled < 1e-7, "{name}: {controlled:e}");
    }
}

/// Work of drives less that of friction, at passive joints too, is the change of energy.
#[test]
fn energy_balances_with_friction_at_passive_joints() {
    for (name, effort, scale) in [("fourbar", 3.0, 0.3), ("delta", 1.5, 0.1), ("stewart", 30.0, 0.3)] {
        let Some(machine) = robot(name, None, None) else { return };
        let plant = rough(machine, scale, 1e-3);
        let mut state = plant.state(&plant.machine().home_independent(), &vec![0.0; plant.drives()]).unwrap();
        let drive: Vec<f64> = (0..plant.drives()).map(|k| effort * (1.0 + k as f64).cos()).collect();
        let before = energy(&plant, &state);
        let mut free = plant.machine().free_motions();
        let mut open = 0.0_f64;
        let steps = run(&plant, &mut state, &drive, 0.3, CONTROLLED, |s| {
            open = open.max(openness(&plant, &mut free, s)[0]);
        });
        let missing = energy(&plant, &state) - before - (state.drive_work - state.element_work);
        let size = state.drive_work.abs() + state.element_work.abs();
        println!("{name}: {missing:.1e} of {size:.3} J missing, gap {open:.1e}, {steps} steps");
        assert!(state.element_work > 1e-3 * size && missing.abs() < 1e-6 * size && open < 1e-12);
    }
}

/// A crank that turns through both dead centres of a driven rocker moves as if it were driven itself.
#[test]
fn motion_goes_through_poses_where_the_drive_loses_control() {
    let Some(by_rocker) = robot("fourbar", None, Some(&["rocker"])) else { return };
    let Some(by_crank) = robot("fourbar", None, None) else { return };
    let start = bare(by_crank.clone()).state(&by_crank.home_independent(), &[12.0]).unwrap();
    let ends = [by_rocker, by_crank].map(|machine| {
        let plant = bare(machine);
        let mut state = start.clone();
        run(&plant, &mut state, &[0.0], 2.0, CONTROLLED, |_| ());
        state.q
    });
    println!("crank from {:.2} to {:.2} rad", start.q[0], ends[0][0]);
    assert!((ends[0][0] - start.q[0]).abs() > 2.0 * std::f64::consts::TAU);
    assert!(worst(&ends[0], &ends[1]) < 1e-9, "{ends:?}");
}

/// Repeated conditions change nothing of the motion.
#[test]
fn redundant_rows_move_alike() {
    let Some(plain) = robot("fourbar", None, None) else { return };
    let Some(spatial) = robot("fourbar", Some("spatial"), None) else { return };
    let ends = [plain, spatial].map(|machine| {
        let plant = rough(machine, 0.1, 1e-3);
        let mut state = plant.state(&plant.machine().home_independent(), &[1.0]).unwrap();
        run(&plant, &mut state, &[0.5], 1.0, CONTROLLED, |_| ());
        state.q
    });
    assert!(worst(&ends[0], &ends[1]) < 1e-9, "{ends:?}");
}

/// Bristles at passive joints hold and creep as with tiny steps of the classical method.
#[test]
fn bristles_at_passive_joints_converge() {
    let Some(machine) = robot("fourbar", None, None) else { return };
    let held = ShapeSetting::held;
    let mut elements: Vec<Box<dyn JointElement>> = Vec::new();
    let mut linear = machine.mechanism().inertia_vector();
    for rate in 0..3 {
        let law = LuGre { rate, kappa: held(500.0), rho: held(1.3), vs: held(0.2), delta: held(2.0) };
        elements.push(Box::new(law));
        linear.extend([0.4, 0.5]);
    }
    let tree = TreeModel::new(machine.mechanism().clone(), elements);
    let model = RobotModel::from(ClosedModel::new(tree, machine));
    let plant = ClosedPlant::new(model, linear, vec![], 1e-3).unwrap();
    let start = plant.state(&plant.machine().home_independent(), &[0.0]).unwrap();
    let mut dynamics = dynamics_at(&plant, &plant.machine().home_independent());
    let (still, mut work) = (vec![0.0; 3], plant.workspace());
    let resting = vec![0.0; plant.model().signals().len()];
    let weight = plant.drive_effort(&mut dynamics, (&still, &still), &resting, &mut work).unwrap().drives[0];
    // From rest: beside the weight, an effort that bristles hold, and one that they do not.
    for effort in [0.2, 5.0] {
        let end = |stepping: Stepping| {
            let mut state = start.clone();
            run(&plant, &mut state, &[weight + effort], 0.2, stepping, |_| ());
            [state.q, state.dq].concat()
        };
        let fine = end(Stepping::RungeKutta4 { step: 2e-5 });
        let errors = [1e-6, 1e-9].map(|tolerance| worst(&end(Stepping::Controlled { tolerance }), &fine));
        let moved = fine[0] - start.q[0];
        println!("{effort} N m more than the weight: crank moves {moved:.1e} rad, errors {errors:?}");
        assert!((moved.abs() < 1e-2) == (effort < 1.0), "{moved}");
        assert!(errors[0] < 1e-3 && errors[1] < 1e-6 && errors[1] < 0.1 * errors[0], "{errors:?}");
    }
}
