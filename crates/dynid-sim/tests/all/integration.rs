//! Integrated motion against closed forms, conservation of energy, and itself at finer tolerance.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use crate::arm::{arm, plant, slider};
use dynid_model::History;
use dynid_model::element::{
    Coulomb, JointElement, LuGre, RotorInertia, ShapeSetting, Spring, Transmission, Viscous,
};
use dynid_sim::{Integrator, Plant, PlantState, SimError};

fn start(q: &[f64], dq: &[f64]) -> PlantState {
    let history = History::default();
    PlantState { q: q.to_vec(), dq: dq.to_vec(), history, drive_work: 0.0, element_work: 0.0 }
}

/// Runs in intervals of a millisecond, as a controller would.
fn run(plant: &Plant, state: &mut PlantState, drive: &[f64], seconds: f64, tolerance: f64) -> usize {
    let mut integrator = Integrator::new(plant, tolerance).unwrap();
    for k in 0..(seconds * 1000.0).round() as usize {
        integrator.advance(state, drive, &[], 1e-3 * k as f64, 1e-3).unwrap();
    }
    integrator.count().accepted + integrator.count().rejected
}

/// A mass thrown on a rough floor stops where `v²/(2 F/m)` says and stays; pushed harder than friction it goes on.
#[test]
fn a_mass_on_a_rough_floor_stops_and_starts_as_coulomb_says() {
    let (mass, friction) = (2.0, 3.0);
    for (width, most_steps) in [(1e-3, 1300), (1e-4, 1300), (1e-5, 1400)] {
        let floor = slider(mass, vec![Box::new(Coulomb { rate: 0 })], &[friction], width);
        let mut state = start(&[0.0], &[0.3]);
        let mut steps = run(&floor, &mut state, &[0.0], 0.5, 1e-8);
        let stop = 0.3 * 0.3 / (2.0 * friction / mass);
        let missed = (state.q[0] - stop).abs();
        // Between rest and a few widths the friction is less than all of it.
        assert!(missed < 3.0 * width * 0.2 + 1e-8, "width {width}: off by {missed:e}");
        // Pushed by two thirds of the friction it creeps at most at `width · artanh(2/3)`.
        steps += run(&floor, &mut state, &[2.0], 0.5, 1e-8);
        assert!((state.q[0] - stop).abs() < missed + 0.5 * 0.81 * width);
        let (from, mut moving) = (state.q[0], start(&state.q, &[0.0]));
        // Pushed by twice the friction: uniform acceleration.
        run(&floor, &mut moving, &[6.0], 0.2, 1e-8);
        let expected = 0.5 * (6.0 - friction) / mass * 0.2 * 0.2;
        let late = (moving.q[0] - from - expected).abs();
        println!(
            "width {width:e}: stops {missed:.1e} m off, starts {late:.1e} m off, {steps} steps in 1000 intervals"
        );
        assert!(late < 2.0 * width * 0.2);
        assert!(steps < most_steps, "width {width}: {steps} steps");
    }
}

/// `m q̈ + c q̇ + k q = 0` far too stiff for the interval: the slow motion stays, the fast mode is gone.
#[test]
fn stiff_springs_and_dampers_need_no_small_steps() {
    // Overdamped: time constants of about 1e-7 s and 0.1 s.
    let (mass, damper, spring) = (1.0, 1e7, 1e8);
    let elements: Vec<Box<dyn JointElement>> =
        vec![Box::new(Viscous { rate: 0 }), Box::new(Spring { rate: 0 })];
    let stiff = slider(mass, elements, &[damper, spring, 0.0], 1e-3);
    let mut state = start(&[0.1], &[0.0]);
    let transient = run(&stiff, &mut state, &[0.0], 0.01, 1e-8);
    let steps = run(&stiff, &mut state, &[0.0], 0.09, 1e-8);
    let root = (damper * damper - 4.0 * spring * mass).sqrt();
    let slow = -2.0 * spring / (damper + root);
    let expected = 0.1 * (0.1 * slow).exp();
    println!("{transient} and {steps} steps; {:e} against {expected:e}", state.q[0]);
    // An explicit method would need a step per 3e-7 s: 3e5 of them.
    assert!((state.q[0] - expected).abs() < 1e-7 && transient + steps < 1000);
}

#[test]
fn a_light_spring_swings_as_its_closed_form() {
    let (mass, spring) = (0.5, 200.0);
    let swing = slider(mass, vec![Box::new(Spring { rate: 0 })], &[spring, 0.0], 1e-3);
    let omega = f64::sqrt(spring / mass);
    let errors = [1e-6, 1e-8, 1e-10].map(|tolerance| {
        let mut state = start(&[0.2], &[0.0]);
        run(&swing, &mut state, &[0.0], 2.0, tolerance);
        (state.q[0] - 0.2 * (2.0 * omega).cos()).abs()
    });
    println!("errors after 6 periods: {errors:?}");
    assert!(errors[0] < 1e-4 && errors[2] < 1e-2 * errors[0] && errors[2] < 1e-7);
}

/// Work of the drives less work of the elements is the change of energy, with rotors, shared motors, friction.
#[test]
fn energy_balances() {
    let elements: Vec<Box<dyn JointElement>> = vec![
        Box::new(RotorInertia { rate: 0 }),
        Box::new(Coulomb { rate: 0 }),
        Box::new(Viscous { rate: 1 }),
        Box::new(Transmission {
            joints: vec![1, 2],
            matrix: vec![vec![20.0, 0.0], vec![15.0, 15.0]],
            motors: vec!["m1".into(), "m2".into()],
        }),
    ];
    let values = [0.3, 1.5, 2.0, 1e-3, 0.02, 1e-4, 5e-4, 0.01, 2e-4];
    let machine = plant(arm(), elements, &values, 1e-3);
    for (tolerance, most) in [(1e-6, 1e-5), (1e-9, 1e-8)] {
        let mut state = start(&[0.3, -0.8, 0.5], &[0.0, 1.0, -2.0]);
        let mut work = machine.workspace();
        let energy = |s: &PlantState, work: &mut _| {
            let e = machine.energy(&s.q, &s.dq, work);
            e.kinetic + e.potential
        };
        let before = energy(&state, &mut work);
        run(&machine, &mut state, &[4.0, -12.0, 3.0], 1.0, tolerance);
        let change = energy(&state, &mut work) - before;
        let missing = change - (state.drive_work - state.element_work);
        let scale = state.drive_work.abs() + state.element_work.abs();
        println!("tolerance {tolerance:e}: {missing:.2e} J of {scale:.2} J missing");
        assert!(missing.abs() < most * scale);
    }
}

/// Errors shrink with the tolerance towards one limit.
#[test]
fn a_falling_arm_converges() {
    let falling = plant(arm(), vec![], &[], 1e-3);
    let at = |tolerance: f64| {
        let mut state = start(&[0.3, -0.8, 0.5], &[1.0, 1.0, -2.0]);
        run(&falling, &mut state, &[0.0; 3], 1.0, tolerance);
        state.q
    };
    let limit = at(1e-13);
    let error = |q: Vec<f64>| q.iter().zip(&limit).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
    let errors = [1e-6, 1e-9, 1e-12].map(|t| error(at(t)));
    println!("{errors:?}");
    assert!(errors[1] < 1e-5 && errors[2] < 1e-2 * errors[1]);
}

#[test]
fn motion_that_runs_away_is_an_error_with_its_time() {
    let running = slider(1e-12, vec![Box::new(Viscous { rate: 0 })], &[-1e3], 1e-3);
    let mut integrator = Integrator::new(&running, 1e-9).unwrap();
    let found = integrator.advance(&mut start(&[0.0], &[1.0]), &[0.0], &[], 2.0, 1e-3);
    assert!(
        matches!(found, Err(SimError::TooFast { time, .. }) if (2.0..2.001).contains(&time)),
        "{found:?}"
    );
}

/// Bristles under a mass: `m v' = F - (σ0 z + σ1 z' + σ2 v)`, by a Runge-Kutta method with steps of a microsecond.
fn bristles_by_runge_kutta(force: f64, seconds: f64) -> [f64; 2] {
    let rate = |[_, v, z]: [f64; 3]| {
        let g = FC + (FS - FC) * (-(v / VS).powi(2)).exp();
        let bend = v - S0 * v.abs() * z / g;
        [v, (force - S0 * z - S1 * bend - S2 * v) / MASS, bend]
    };
    let h = 1e-6;
    let mut x = [0.0; 3];
    for _ in 0..(seconds / h).round() as usize {
        let at = |k: [f64; 3], h: f64| std::array::from_fn(|i| x[i] + h * k[i]);
        let k1 = rate(x);
        let k2 = rate(at(k1, 0.5 * h));
        let k3 = rate(at(k2, 0.5 * h));
        let k4 = rate(at(k3, h));
        x = std::array::from_fn(|i| x[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]));
    }
    [x[0], x[1]]
}

const MASS: f64 = 2.0;
const FC: f64 = 2.5;
const FS: f64 = 3.25;
const VS: f64 = 0.05;
const S0: f64 = 1820.0;
const S1: f64 = 105.0;
const S2: f64 = 8.0;

#[test]
fn bristles_stick_creep_and_break_away() {
    let held = ShapeSetting::held;
    let law = LuGre { rate: 0, kappa: held(S0 / FC), rho: held(FS / FC), vs: held(VS), delta: held(2.0) };
    let elements: Vec<Box<dyn JointElement>> = vec![Box::new(law), Box::new(Viscous { rate: 0 })];
    let floor = slider(MASS, elements, &[FC, S1, S2], 1e-4);
    // Held by the bristles, and pushed beyond what they can hold.
    for force in [2.0, 6.0] {
        let [x, v] = bristles_by_runge_kutta(force, 0.5);
        let errors = [500.0, 1000.0, 4000.0].map(|rate| {
            let mut state = start(&[0.0], &[0.0]);
            let mut integrator = Integrator::new(&floor, 1e-6).unwrap();
            for k in 0..(0.5 * rate) as usize {
                integrator.advance(&mut state, &[force], &[], k as f64 / rate, 1.0 / rate).unwrap();
            }
            [(state.q[0] - x).abs(), (state.dq[0] - v).abs()]
        });
        println!("{force} N: {x:e} m, {v:e} m/s; errors {errors:?}");
        assert!((x < 2e-3) == (force < FS), "{force} N: {x}");
        assert!(errors[1][0] <= 1e-3 * x && errors[2][0] <= 1e-4 * x, "{force} N: {errors:?}");
        assert!(errors[2][1] <= 1e-3 * v.abs().max(1e-3), "{force} N: {errors:?}");
    }
}
