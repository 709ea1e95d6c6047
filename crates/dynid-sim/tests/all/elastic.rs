//! Elastic joints, forward and inverse: against each other, against Runge and Kutta, and back to their parameters.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::f64::consts::{FRAC_PI_2, TAU};

use crate::arm::arm;
use dynid_model::element::{
    Coulomb, CubicSpring, Cyclic, ElasticTransmission, ExternalLoad, JointElement, LuGre, RotorInertia,
    ShapeSetting, Transmission, Viscous,
};
use dynid_model::*;
use dynid_sim::*;
use rand::RngExt;
use rand_distr::StandardNormal;

// The HIT joint: link 0, motor 1, neither with a body.
const RATIO: f64 = 290.0;
const SPRING: CubicSpring = CubicSpring { k1: 396_500.0, k2: 1.336e11 };
const J_IN: f64 = 1.2e-3;
const J_OUT: f64 = 25.0;
const B_IN: f64 = 0.035;
const C_IN: f64 = 0.135;
const B_OUT: f64 = 635.663;
const C_OUT: f64 = 30.96;
const CYCLIC: [f64; 2] = [7.73, 9.18];

fn joint_model() -> RobotModel {
    let elements: Vec<Box<dyn JointElement>> = vec![
        Box::new(ElasticTransmission::new(0, 1, RATIO)),
        Box::new(RotorInertia { rate: 0 }),
        Box::new(RotorInertia { rate: 1 }),
        Box::new(Viscous { rate: 0 }),
        Box::new(Viscous { rate: 1 }),
        Box::new(Coulomb { rate: 0 }),
        Box::new(Coulomb { rate: 1 }),
        Box::new(Cyclic::torque(0, ShapeSetting::held(1.0))),
    ];
    let brake = KnownElement {
        element: Box::new(ExternalLoad { rate: 0, brake: true }),
        linear: vec![1.0],
        shape: vec![],
    };
    let coordinates = vec![Coordinate::turning("link"), Coordinate::turning("motor")];
    RobotModel::with_coordinates(Mechanism::without_bodies("joint"), coordinates, elements)
        .with_known(vec![brake])
}

fn joint_values() -> Vec<f64> {
    vec![SPRING.k1, SPRING.k2, J_OUT, J_IN, B_OUT, B_IN, C_OUT, C_IN, CYCLIC[0], CYCLIC[1]]
}

/// The brake with two derivatives.
fn brake(t: f64) -> [f64; 3] {
    let w = TAU / 14.0;
    let (s, c) = (w * t).sin_cos();
    [650.0 - 550.0 * c, 550.0 * w * s, 550.0 * w * w * c]
}

/// A cruise that speeds up and slows down without a reversal, with four derivatives.
fn cruise(t: f64) -> LinkMotion {
    let (v, size, w): (f64, f64, f64) = (0.02, 0.004, 2.0);
    let mut link: LinkMotion =
        std::array::from_fn(|k| size * w.powi(k as i32) * (w * t + FRAC_PI_2 * k as f64).sin());
    link[0] += v * t;
    link[1] += v;
    link
}

/// The torques of the joint by hand.
#[test]
fn inverse_of_one_joint_is_the_closed_form() {
    let (model, values) = (joint_model(), joint_values());
    let inverse = ElasticInverse::new(&model, &values, &[], 0.0).unwrap();
    assert_eq!(inverse.links(), [0]);
    for k in 0..140 {
        let t = 0.1 * f64::from(k);
        let (link, load) = (cruise(t), brake(t));
        let [q, v, a, jerk, _] = link;
        let found = inverse.at(&[link], &[load]).unwrap();
        let torque = J_OUT * a + B_OUT * v + C_OUT + CYCLIC[0] * q.cos() + CYCLIC[1] * q.sin() + load[0];
        let rate = J_OUT * jerk + B_OUT * a + (CYCLIC[1] * q.cos() - CYCLIC[0] * q.sin()) * v + load[1];
        let deformation = SPRING.deformation(torque).unwrap();
        let speed = RATIO * (v + rate / SPRING.stiffness(deformation));
        let close = |found: f64, expected: f64, what: &str| {
            assert!((found - expected).abs() <= 1e-12 * expected.abs(), "{what} at {t}: {found} {expected}");
        };
        close(found.torque[0][0], torque, "torque");
        close(found.torque[0][1], rate, "rate of torque");
        close(found.deformation[0][0], deformation, "deformation");
        close(found.q[1], RATIO * (q + deformation), "motor");
        close(found.dq[1], speed, "speed of the motor");
        let effort = J_IN * found.ddq[1] + B_IN * speed + C_IN + torque / RATIO;
        // Rounding of positions counts in the spring: k2 Δ² some times k1 of it.
        assert!((found.effort[1] - effort).abs() <= 1e-9, "{} {effort}", found.effort[1]);
        assert!(found.effort[0].abs() <= 1e-9 * RATIO, "{}", found.effort[0]);
    }
}

/// An arm of three joints, of which the second and the third are elastic: motors `m2`, `m3` are rates 3 and 4.
const ARM_RATIOS: [f64; 2] = [100.0, 80.0];

fn elastic_arm() -> (RobotModel, Vec<f64>) {
    let mut elements: Vec<Box<dyn JointElement>> = vec![
        Box::new(ElasticTransmission::new(1, 3, ARM_RATIOS[0])),
        Box::new(ElasticTransmission::new(2, 4, ARM_RATIOS[1])),
    ];
    let mechanism = arm();
    let mut values = mechanism.inertia_vector();
    values.extend([3000.0, 2e8, 1000.0, 1e8]);
    for (rate, coulomb, viscous) in
        [(0, 1.5, 2.0), (1, 0.8, 1.2), (2, 0.4, 0.9), (3, 0.02, 8e-4), (4, 0.015, 6e-4)]
    {
        elements.push(Box::new(Coulomb { rate }));
        elements.push(Box::new(Viscous { rate }));
        values.extend([coulomb, viscous]);
    }
    for (rate, inertia) in [(0, 0.4), (3, 1.5e-4), (4, 0.8e-4)] {
        elements.push(Box::new(RotorInertia { rate }));
        values.push(inertia);
    }
    let motors = vec![Coordinate::turning("m2"), Coordinate::turning("m3")];
    (RobotModel::with_coordinates(mechanism, motors, elements), values)
}

fn swing(joint: usize, t: f64) -> LinkMotion {
    let mut link = [0.0; 5];
    for (harmonic, size) in [(1.0, 0.5), (2.0, 0.25), (3.0, 0.12)] {
        let (w, phase) = (harmonic * (1.1 + 0.3 * joint as f64), 0.9 * joint as f64 + 2.0 * harmonic);
        for (k, x) in link.iter_mut().enumerate() {
            *x += size * w.powi(k as i32) * (w * t + phase + FRAC_PI_2 * k as f64).sin();
        }
    }
    link
}

fn swings(t: f64) -> Vec<LinkMotion> {
    (0..3).map(|j| swing(j, t)).collect()
}

#[test]
fn fourier_series_have_four_derivatives() {
    let series = dynid_motion::trajectory::Fourier::plain(1.3, 0.2, vec![0.4, -0.1], vec![0.3, 0.2]).unwrap();
    let link = fourier_link(&series);
    let (t, h) = (0.7, 1e-4);
    let here = link(t);
    assert_eq!([here[0], here[1]], [series.at(t).position, series.at(t).velocity]);
    for (order, value) in here.iter().enumerate().skip(1) {
        let slope = (link(t + h)[order - 1] - link(t - h)[order - 1]) / (2.0 * h);
        assert!((value - slope).abs() < 1e-6 * value.abs().max(1.0), "{order}: {value} {slope}");
    }
}

/// Motors are where their springs say, with rates and accelerations that are derivatives of it, and links feel no drive.
#[test]
fn inverse_of_an_arm_is_consistent() {
    let (model, values) = elastic_arm();
    let inverse = ElasticInverse::new(&model, &values, &[], 0.3).unwrap();
    assert_eq!(inverse.links(), [0, 1, 2]);
    for t in [0.2, 1.0, 3.3, 5.9] {
        let h = 1e-4;
        let [below, here, above] = [t - h, t, t + h].map(|t| inverse.at(&swings(t), &[]).unwrap());
        for motor in [3, 4] {
            let speed = (above.q[motor] - below.q[motor]) / (2.0 * h);
            let acceleration = (above.dq[motor] - below.dq[motor]) / (2.0 * h);
            // Third derivatives of some 1e4 times h²/6, and rounding over h.
            assert!((here.dq[motor] - speed).abs() < 1e-4, "{t}: {} {speed}", here.dq[motor]);
            assert!((here.ddq[motor] - acceleration).abs() < 1e-3, "{t}: {} {acceleration}", here.ddq[motor]);
        }
        assert!(here.effort[1].abs() < 1e-9 && here.effort[2].abs() < 1e-9, "{:?}", here.effort);
        // A rigid arm needs the same torques behind its gears.
        let mut rigid = vec![0.0; 3];
        let state = State { q: &here.q[..3], dq: &here.dq[..3], ddq: &here.ddq[..3], gravity: None };
        let dynamics = Dynamics::new(model.mechanism());
        dynamics.inverse_dynamics(&state, &values[..30], &mut dynamics.workspace(), &mut rigid);
        for (k, joint) in [1, 2].into_iter().enumerate() {
            let v = here.dq[joint];
            let column =
                |name: &str| values[model.parameters().column(&format!("j{}.{name}", joint + 1)).unwrap()];
            let torque = rigid[joint] + column("fc") * (v / 0.3).tanh() + column("fv") * v;
            assert!((here.torque[k][0] - torque).abs() < 1e-11);
        }
    }
}

#[test]
fn what_cannot_be_inverted_is_told() {
    let model = |elements: Vec<Box<dyn JointElement>>| {
        let coordinates = vec![Coordinate::turning("link"), Coordinate::turning("motor")];
        RobotModel::with_coordinates(Mechanism::without_bodies("joint"), coordinates, elements)
    };
    let damped =
        model(vec![Box::new(ElasticTransmission { damping: true, ..ElasticTransmission::new(0, 1, 10.0) })]);
    let found = ElasticInverse::new(&damped, &[1.0, 1.0, 0.5], &[], 0.0);
    assert!(matches!(found, Err(SimError::Setting { name: "damping of a transmission", .. })), "{found:?}");
    assert!(ElasticInverse::new(&damped, &[1.0, 1.0, 0.0], &[], 0.0).is_ok());
    let twice: [Box<dyn JointElement>; 2] =
        [(); 2].map(|()| Box::new(ElasticTransmission::new(0, 1, 10.0)) as _);
    let twice = model(twice.into());
    assert!(matches!(
        ElasticInverse::new(&twice, &[1.0; 4], &[], 0.0),
        Err(SimError::Setting { name: "link", .. })
    ));
    let bristles: [Box<dyn JointElement>; 2] =
        [Box::new(ElasticTransmission::new(0, 1, 10.0)), Box::new(LuGre::new(0))];
    let bristles = model(bristles.into());
    let inverse = ElasticInverse::new(&bristles, &[1.0; 4], &[1.3, 0.1], 0.0).unwrap();
    let found = inverse.at(&[[0.0; 5]], &[]);
    assert_eq!(found, Err(SimError::NoTimeDerivatives { parameter: "link.fc".into() }));
    let soft: [Box<dyn JointElement>; 2] =
        [Box::new(ElasticTransmission::new(0, 1, 10.0)), Box::new(RotorInertia { rate: 0 })];
    let soft = model(soft.into());
    let inverse = ElasticInverse::new(&soft, &[3.0, -4.0, 1.0], &[], 0.0).unwrap();
    assert!(inverse.at(&[[0.0, 0.0, 0.9, 0.0, 0.0]], &[]).is_ok());
    let found = inverse.at(&[[0.0, 0.0, 1.1, 0.0, 0.0]], &[]);
    assert_eq!(found, Err(SimError::Overloaded { joint: "link".into(), torque: 1.1 }));
    // Forwards, a motor needs a rotor.
    let found = Plant::new(soft, vec![1.0, 0.0, 1.0], vec![], 1e-3);
    assert!(matches!(found, Err(SimError::NoInertia { ref name }) if name == "motor"), "{found:?}");
}

/// The joint's own equations of motion.
fn joint_rates([q, theta, v, w]: [f64; 4], effort: f64, load: f64, width: f64) -> [f64; 4] {
    let torque = SPRING.torque(theta / RATIO - q);
    let out = B_OUT * v + (C_OUT + load) * (v / width).tanh() + CYCLIC[0] * q.cos() + CYCLIC[1] * q.sin();
    let input = B_IN * w + C_IN * (w / width).tanh();
    [v, w, (torque - out) / J_OUT, (effort - input - torque / RATIO) / J_IN]
}

fn runge_kutta(x: [f64; 4], h: f64, rates: impl Fn([f64; 4]) -> [f64; 4]) -> [f64; 4] {
    let ahead = |k: [f64; 4], h: f64| std::array::from_fn(|i| x[i] + h * k[i]);
    let k1 = rates(x);
    let k2 = rates(ahead(k1, 0.5 * h));
    let k3 = rates(ahead(k2, 0.5 * h));
    let k4 = rates(ahead(k3, h));
    std::array::from_fn(|i| x[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]))
}

const WIDTH: f64 = 1e-4;

fn joint_plant() -> Plant {
    Plant::new(joint_model(), joint_values(), vec![], WIDTH).unwrap()
}

fn state(x: [f64; 4]) -> PlantState {
    let [q, theta, v, w] = x;
    let history = History::default();
    PlantState { q: vec![q, theta], dq: vec![v, w], history, drive_work: 0.0, element_work: 0.0 }
}

/// On the cruise at 0, by the inverse.
fn start() -> [f64; 4] {
    let (model, values) = (joint_model(), joint_values());
    let found =
        ElasticInverse::new(&model, &values, &[], 0.0).unwrap().at(&[cruise(0.0)], &[brake(0.0)]).unwrap();
    [found.q[0], found.q[1], found.dq[0], found.dq[1]]
}

/// A speed loop on the motor, held between ticks of a millisecond; the brake is held too.
#[test]
fn forward_simulation_agrees_with_runge_and_kutta() {
    let plant = joint_plant();
    // Enough for the brake, so that nothing stops.
    let loop_effort = |t: f64, w: f64| {
        0.35 + (brake(t)[0] + 45.0) / RATIO + 0.05 * (RATIO * 0.02 * (1.0 + 0.3 * (3.0 * t).sin()) - w)
    };
    let (tick, ticks) = (1e-3, 2000);
    let reference = |steps: u32| {
        let mut x = start();
        for k in 0..ticks {
            let t = tick * f64::from(k);
            let (effort, load) = (loop_effort(t, x[3]), brake(t)[0]);
            for _ in 0..steps {
                x = runge_kutta(x, tick / f64::from(steps), |x| joint_rates(x, effort, load, WIDTH));
            }
        }
        x
    };
    let (coarse, fine) = (reference(50), reference(100));
    let apart = |a: [f64; 4], b: [f64; 4]| [0, 1, 2, 3].map(|i| (a[i] - b[i]).abs());
    let own = apart(coarse, fine);
    let errors = [1e-6, 1e-8, 1e-10].map(|tolerance| {
        let mut integrator = Integrator::new(&plant, tolerance).unwrap();
        let mut s = state(start());
        for k in 0..ticks {
            let t = tick * f64::from(k);
            let effort = loop_effort(t, s.dq[1]);
            integrator.advance(&mut s, &[0.0, effort], &[brake(t)[0]], t, tick).unwrap();
        }
        apart([s.q[0], s.q[1], s.dq[0], s.dq[1]], fine)
    });
    let deformation = fine[1] / RATIO - fine[0];
    println!("deformation {deformation:.3e} rad; Runge-Kutta with itself {own:?}; ours {errors:?}");
    assert!(own[0] < 1e-12 && own[1] < 1e-9);
    assert!(errors[1][0] < 1e-3 * deformation && errors[2][0] < 1e-6 * deformation, "{errors:?}");
    assert!(errors[2][1] < RATIO * 1e-6 * deformation, "{errors:?}");
}

/// Steps of equal size: the error falls with their third power.
#[test]
fn integration_of_an_elastic_joint_is_of_order_three() {
    let plant = joint_plant();
    let seconds = 0.4;
    // Strung more than the load needs, so that it swings.
    let mut from = start();
    from[1] += 0.02;
    let (effort, load) = (1.2, 100.0);
    let mut fine = from;
    for _ in 0..40_000 {
        fine = runge_kutta(fine, seconds / 40_000.0, |x| joint_rates(x, effort, load, WIDTH));
    }
    let errors = [400_u32, 800, 1600, 3200].map(|steps| {
        let mut integrator = Integrator::new(&plant, 1e-2).unwrap();
        let mut s = state(from);
        let h = seconds / f64::from(steps);
        for k in 0..steps {
            integrator.advance(&mut s, &[0.0, effort], &[load], h * f64::from(k), h).unwrap();
        }
        assert_eq!(integrator.count().accepted, steps as usize, "one step an interval");
        (s.q[0] - fine[0]).abs()
    });
    let orders: Vec<f64> = errors.windows(2).map(|e| (e[0] / e[1]).log2()).collect();
    println!("errors {errors:?}, orders {orders:.2?}");
    assert!(orders.iter().all(|o| *o > 2.8), "{orders:?}");
}

#[test]
fn energy_of_an_elastic_joint_balances() {
    let plant = joint_plant();
    for (tolerance, most) in [(1e-6, 1e-6), (1e-9, 1e-8)] {
        let mut s = state(start());
        let mut work = plant.workspace();
        let energy = |s: &PlantState, work: &mut _| plant.energy(&s.q, &s.dq, work).kinetic;
        let (before, spring) = (energy(&s, &mut work), plant.spring_energy(&s.q));
        let mut integrator = Integrator::new(&plant, tolerance).unwrap();
        for k in 0..2000 {
            let t = 1e-3 * f64::from(k);
            integrator.advance(&mut s, &[0.0, 1.2 + 0.5 * (7.0 * t).sin()], &[brake(t)[0]], t, 1e-3).unwrap();
        }
        let missing = energy(&s, &mut work) - before - (s.drive_work - s.element_work);
        let stored = plant.spring_energy(&s.q) - spring;
        println!(
            "{tolerance:e}: {missing:.1e} J of {:.2} J missing, {stored:.3} J in the spring",
            s.drive_work
        );
        assert!(missing.abs() < most * s.drive_work.abs());
        assert!(stored.abs() > 1e3 * missing.abs() && stored < s.element_work);
    }
}

/// Along the motion of the inverse, with its efforts fed forward: the forward simulation stays on it, the better the faster
/// its drive's effort is renewed.
#[test]
fn experiment_follows_the_inverse_simulation() {
    let (model, values) = (joint_model(), joint_values());
    let profile =
        Profile::new((0..=4000).map(|k| 1e-3 * f64::from(k)).map(|t| (t, brake(t)[0])).collect()).unwrap();
    let inverse = ElasticInverse::new(&model, &values, &[], 0.0).unwrap();
    let errors = [1000.0, 4000.0].map(|rate_hz| {
        let reference = |t: f64| inverse.at(&[cruise(t)], &[brake(t)]).unwrap().wanted();
        let settings = ExperimentSettings {
            duration_s: 3.0,
            log_rate_hz: 500.0,
            tolerance: 1e-10,
            // Without the lag of a filter on the velocity.
            control: ControlSettings { rate_hz, velocity_cutoff_hz: 1e6, ..Default::default() },
            imperfections: Imperfections::none(),
            channels: vec![profile.clone()],
            ..Default::default()
        };
        let result = run(&mut joint_plant(), &joint_plant(), &reference, &settings).unwrap();
        assert!(result.energy.residual().abs() < 1e-7 * result.energy.drive_work.abs());
        assert!(result.log.truth.effort[0].iter().all(|e| *e == 0.0), "the link has no drive");
        let mut worst = [0.0_f64; 3];
        for (row, t) in result.log.time.iter().enumerate() {
            let wanted = inverse.at(&[cruise(*t)], &[brake(*t)]).unwrap();
            let [link, motor] = [0, 1].map(|c| result.log.truth.q[c][row]);
            worst[0] = worst[0].max((link - wanted.q[0]).abs());
            worst[1] = worst[1].max((motor / RATIO - link - wanted.deformation[0][0]).abs());
            worst[2] = worst[2].max((result.log.truth.effort[1][row] - wanted.effort[1]).abs());
        }
        worst
    });
    println!("link (rad), deformation (rad), motor effort (N m) off by {errors:?}");
    for (coarse, fine) in errors[0].iter().zip(&errors[1]) {
        // Efforts are held from the tick on: half a tick late, which is of first order.
        let ratio = coarse / fine;
        assert!((3.0..6.0).contains(&ratio), "{ratio}");
    }
}

/// Accelerations under the drives' efforts are those that need these efforts, also where motors share inertia with each
/// other and with a joint.
#[test]
fn accelerations_of_motors_and_joints_go_with_the_efforts() {
    let (_, values) = elastic_arm();
    let mut elements: Vec<Box<dyn JointElement>> = vec![
        Box::new(ElasticTransmission { damping: true, ..ElasticTransmission::new(1, 3, ARM_RATIOS[0]) }),
        Box::new(ElasticTransmission::new(2, 4, ARM_RATIOS[1])),
        Box::new(Transmission {
            joints: vec![0, 3, 4],
            matrix: vec![vec![0.0, 1.0, 0.4], vec![2.0, 0.3, 1.0]],
            motors: vec!["a".into(), "b".into()],
        }),
    ];
    let mut linear = values[..30].to_vec();
    linear.extend([6000.0, 4e7, 3.0, 2500.0, 9e7, 2e-4, 0.01, 1e-3, 1e-4, 0.02, 2e-3]);
    for shared in [true, false] {
        let motors = vec![Coordinate::turning("m2"), Coordinate::turning("m3")];
        let model = RobotModel::with_coordinates(arm(), motors, elements);
        let plant = Plant::new(model, linear.clone(), vec![], 1e-3).unwrap();
        let mut work = plant.workspace();
        let (q, dq) = ([0.3, -0.7, 0.4, -70.2, 32.5], [0.5, -0.2, 0.8, -15.0, 70.0]);
        let drive = [3.0, 0.0, 0.0, 0.6, -0.3];
        let mut ddq = [0.0; 5];
        plant.acceleration((&q, &dq), &drive, &[], &mut work, &mut ddq).unwrap();
        let back = plant.drive_effort([&q, &dq, &ddq], &[], &mut work);
        for (found, expected) in back.iter().zip(&drive) {
            assert!((found - expected).abs() < 1e-11, "shared {shared}: {back:?}");
        }
        let mass = plant.mass_matrix(&q, &mut work);
        assert!((0..5).all(|i| (0..5).all(|j| (mass[5 * i + j] - mass[5 * j + i]).abs() < 1e-14)));
        assert_eq!(mass[3] != 0.0, shared, "joint 1 and motor 2");
        // The same with a rotor each.
        elements = vec![
            Box::new(ElasticTransmission { damping: true, ..ElasticTransmission::new(1, 3, ARM_RATIOS[0]) }),
            Box::new(ElasticTransmission::new(2, 4, ARM_RATIOS[1])),
            Box::new(RotorInertia { rate: 3 }),
            Box::new(RotorInertia { rate: 4 }),
        ];
        linear.truncate(35);
        linear.extend([1.5e-4, 0.8e-4]);
    }
}

/// Upper triangle of a QR factorisation of `[A b]`, columns given one after the other.
fn triangle(mut columns: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    let rows = columns[0].len();
    for k in 0..columns.len() {
        let (done, rest) = columns.split_at_mut(k + 1);
        let pivot = &mut done[k];
        let length = pivot[k..].iter().map(|x| x * x).sum::<f64>().sqrt().copysign(pivot[k]);
        let mut mirror = pivot[k..].to_vec();
        mirror[0] += length;
        let square: f64 = mirror.iter().map(|x| x * x).sum();
        for column in rest {
            let along: f64 = mirror.iter().zip(&column[k..]).map(|(a, b)| a * b).sum::<f64>() * 2.0 / square;
            column[k..].iter_mut().zip(&mirror).for_each(|(c, m)| *c -= along * m);
        }
        pivot[k] = -length;
        pivot[k + 1..rows].fill(0.0);
    }
    columns
}

/// Least squares: solution and the rows of `R⁻¹`, whose lengths are standard deviations for noise of unit size.
fn least_squares(columns: &[Vec<f64>], effort: &[f64]) -> (Vec<f64>, Vec<Vec<f64>>) {
    let n = columns.len();
    let length = |c: &Vec<f64>| c.iter().map(|x| x * x).sum::<f64>().sqrt();
    let scales: Vec<f64> = columns.iter().map(length).collect();
    let mut all: Vec<Vec<f64>> =
        columns.iter().zip(&scales).map(|(c, s)| c.iter().map(|x| x / s).collect()).collect();
    all.push(effort.to_vec());
    let r = triangle(all);
    let solve = |mut right: Vec<f64>| {
        for i in (0..n).rev() {
            let sum: f64 = (i + 1..n).map(|j| r[j][i] * right[j]).sum();
            right[i] = (right[i] - sum) / r[i][i];
        }
        right.iter().zip(&scales).map(|(x, s)| x / s).collect::<Vec<f64>>()
    };
    let unit = |k: usize| (0..n).map(|i| f64::from(u8::from(i == k))).collect();
    let inverse: Vec<Vec<f64>> = (0..n).map(|k| solve(unit(k))).collect();
    let rows = (0..n).map(|i| inverse.iter().map(|c| c[i]).collect()).collect();
    (solve(r[n][..n].to_vec()), rows)
}

/// An elastic arm under its controller, and its parameters from motions and efforts of links and motors together.
#[test]
fn an_elastic_arm_is_identified_from_motors_and_links() {
    let (model, values) = elastic_arm();
    let width = 1e-2;
    let mut plant = Plant::new(model, values.clone(), vec![], width).unwrap();
    let nominal = Plant::new(elastic_arm().0, wrong_model(&values, 0.05, 3), vec![], width).unwrap();
    let (inverted, wrong) = (elastic_arm().0, nominal.linear().to_vec());
    let inverse = ElasticInverse::new(&inverted, &wrong, &[], width).unwrap();
    let reference = |t: f64| inverse.at(&swings(t), &[]).unwrap().wanted();
    let settings = ExperimentSettings {
        duration_s: 12.0,
        log_rate_hz: 250.0,
        imperfections: Imperfections::none(),
        ..Default::default()
    };
    let result = run(&mut plant, &nominal, &reference, &settings).unwrap();
    assert!(result.energy.residual().abs() < 1e-6 * result.energy.drive_work.abs());
    let truth = &result.log.truth;
    let rows = truth.q[0].len();
    let tracking =
        truth.q[1].iter().zip(&result.log.time).fold(0.0_f64, |m, (q, t)| m.max((q - swing(1, *t)[0]).abs()));

    let (q, dq, ddq) = (truth.q.concat(), truth.dq.concat(), truth.ddq.concat());
    let motion = MotionBlock { sign_width: width, ..MotionBlock::plain(rows, &q, &dq, &ddq) };
    let model = plant.model();
    let mut block = RegressorBlock::new(model.layout().clone(), rows);
    model.regressor(&motion, &[], &mut block);
    let base = BaseParameters::of(model, model.mechanism(), &[], &BaseSettings::default());
    let expected = base.values(&values);
    assert!(base.len() > 30 && base.gap.ratio() > 1e8, "{} {:?}", base.len(), base.gap);
    // Standard deviations of efforts: measured at drives, unmodelled loads at links.
    let noise = [0.3, 0.5, 0.3, 0.005, 0.003];
    let mut columns = vec![vec![0.0; 5 * rows]; base.len()];
    let mut effort = Vec::with_capacity(5 * rows);
    for (o, sd) in noise.iter().enumerate() {
        effort.extend(truth.effort[o].iter().map(|e| e / sd));
        for (k, column) in model.layout().columns(o).iter().enumerate() {
            let Ok(place) = base.kept.binary_search(column) else { continue };
            let to = &mut columns[place][o * rows..][..rows];
            to.iter_mut().zip(block.column(o, k)).for_each(|(t, w)| *t = w / sd);
        }
    }

    let name = |k: usize| model.parameters().linear[base.kept[k]].name.clone();
    let (clean, inverse) = least_squares(&columns, &effort);
    let norm = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>().sqrt();
    // The truth leaves what rounding leaves of the efforts; no more than its length, times rows of R⁻¹, reaches a parameter.
    let mut left = effort.clone();
    for (column, x) in columns.iter().zip(&expected) {
        left.iter_mut().zip(column).for_each(|(l, c)| *l -= c * x);
    }
    let largest = columns.iter().zip(&expected).map(|(c, x)| norm(c) * x.abs()).fold(0.0, f64::max);
    let rounding = 10.0 * base.len() as f64 * f64::EPSILON * largest;
    let mut worst = 0.0_f64;
    for k in 0..base.len() {
        let error = (clean[k] - expected[k]).abs();
        worst = worst.max(error / norm(&inverse[k]));
        assert!(
            error <= norm(&inverse[k]) * (norm(&left) + rounding),
            "{}: {} {}",
            name(k),
            clean[k],
            expected[k]
        );
    }
    println!(
        "tracking {tracking:.1e} rad; {} parameters; truth leaves {:.1e} of {:.1e}; clean: worst error {worst:.1e} standard deviations",
        base.len(),
        norm(&left),
        norm(&effort)
    );

    let mut rng = streams::generator(7, streams::Cause::Effort);
    let noisy: Vec<f64> = effort.iter().map(|e| e + rng.sample::<f64, _>(StandardNormal)).collect();
    let (found, inverse) = least_squares(&columns, &noisy);
    let mut square = 0.0;
    for k in 0..base.len() {
        let sd = norm(&inverse[k]);
        let z = (found[k] - expected[k]) / sd;
        square += z * z;
        // One in 3e5 lies beyond 4.5 deviations.
        assert!(z.abs() < 4.5, "{}: {} ± {sd} for {}", name(k), found[k], expected[k]);
        if ["k1", "k2", "Ia"].iter().any(|s| name(k).ends_with(s)) {
            println!("{}: {:.5e} ± {sd:.1e} for {:.5e}", name(k), found[k], expected[k]);
        }
    }
    let mean = square / base.len() as f64;
    println!("mean square of errors over deviations {mean:.2}");
    assert!((0.3..2.5).contains(&mean), "{mean}");
    // The springs are seen.
    for symbol in ["j2.k1", "j2.k2", "j3.k1", "j3.k2"] {
        let k = (0..base.len()).find(|k| name(*k) == symbol).unwrap();
        assert!(norm(&inverse[k]) < 0.05 * expected[k], "{symbol}");
    }
}
