//! Gears that give way.

use dynid_servo::identify::{ServoIdentification, identify};
use dynid_servo::{
    Addition, Chain, Choice, EncoderAt, Free, Hold, LoadOf, Rollout, Scheme, ServoJoint, ServoLog,
    ServoSettings, ServoValues, Term,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::arm::{PERIOD, arm, drives, held, log as log_of, machines, share};

const ROWS: usize = 600;

fn joint(encoder: EncoderAt) -> ServoJoint {
    let mut joint = ServoJoint::default()
        .with(Term::PositionGain, 30.0)
        .with(Term::VelocityGain, 1.5)
        .with(Term::RotorInertia, 0.02)
        .with(Term::Viscous, 0.2)
        .with(Term::Coulomb, 0.3)
        .with(Term::LoadFriction, 0.05)
        .with(Term::Delay, 0.6 * PERIOD)
        .with(Term::Zero, 0.03)
        .with(Term::Compliance, 4e-3)
        .with(Term::GearDamping, 0.15)
        .with(Term::Backlash, 3e-3);
    joint.encoder = encoder;
    if encoder == EncoderAt::Link {
        // A drive that reads its link through a spring needs damping at the motor, and a stiffer spring.
        joint.set(Term::VelocityGain, 0.3);
        joint.set(Term::Viscous, 1.4);
        joint.set(Term::Compliance, 1e-3);
    }
    joint
}

/// The same without friction of the sign and without backlash.
fn smooth(encoder: EncoderAt) -> ServoJoint {
    joint(encoder).with(Term::Coulomb, 0.0).with(Term::LoadFriction, 0.0).with(Term::Backlash, 0.0)
}

fn log() -> ServoLog {
    let wave = |k: usize, rate: f64| {
        0.5 * (k as f64 * PERIOD * rate).sin() + 0.1 * (k as f64 * PERIOD * 3.1 * rate).sin()
    };
    let command: Vec<Vec<f64>> = [3.0, 5.0].map(|rate| (0..ROWS).map(|k| wave(k, rate)).collect()).into();
    let time = (0..ROWS).map(|k| k as f64 * PERIOD).collect();
    let mut log = ServoLog::new("gears", time, command.clone(), command);
    log.start = Some(vec![0.0; 2]);
    log
}

fn readings(joints: &[ServoJoint], inertias: Vec<f64>, scheme: Scheme) -> Vec<[f64; 2]> {
    let mechanism = arm(1.0);
    let values = ServoValues { joints: joints.to_vec(), inertias };
    let mut out = Vec::new();
    let chains = Chain::all(&mechanism);
    let count = Rollout::new(&chains[0], scheme, &[])
        .run(&values, &log(), |row| out.push([row.reading[0], row.reading[1]]))
        .unwrap();
    assert_eq!(count.unsettled, 0);
    out
}

fn rms(a: &[[f64; 2]], b: &[[f64; 2]]) -> f64 {
    let squares = a.iter().zip(b).map(|(a, b)| (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2));
    (squares.sum::<f64>() / a.len() as f64).sqrt()
}

#[test]
fn sensitivities_are_differences() {
    let terms = [
        (Term::Compliance, 1e-6),
        (Term::GearDamping, 1e-4),
        (Term::PositionGain, 1e-3),
        (Term::VelocityGain, 1e-4),
        (Term::RotorInertia, 1e-5),
        (Term::Viscous, 1e-4),
        (Term::Delay, 1e-6),
        (Term::Coulomb, 1e-5),
        (Term::LoadFriction, 1e-6),
    ];
    let mechanism = arm(1.0);
    let chains = Chain::all(&mechanism);
    for encoder in [EncoderAt::Motor, EncoderAt::Link] {
        for load in [LoadOf::Bodies, LoadOf::Drive] {
            // Flanks and joints that come to rest have kinks, of which differences see another side.
            let scheme = Scheme { sign_width: 0.1, load, ..Scheme::default() };
            let joints = vec![joint(encoder).with(Term::Backlash, 0.0); 2];
            let mut free: Vec<Free> =
                terms.iter().flat_map(|(t, _)| (0..2).map(|j| Free::term(*t, [j]))).collect();
            free.extend([1, 9, 11, 19].map(Free::inertia));
            let step = |k: usize| terms.get(k / 2).map_or(1e-5, |(_, s)| *s);
            let values = ServoValues { joints, inertias: mechanism.inertia_vector() };
            let p = free.len();
            let mut slopes = Vec::new();
            Rollout::new(&chains[0], scheme, &free)
                .run(&values, &log(), |row| slopes.push(row.by_parameter.to_vec()))
                .unwrap();
            for (k, f) in free.iter().enumerate() {
                let at = |side: f64| {
                    let mut values = values.clone();
                    values.set(f, values.get(f) + side * step(k));
                    readings(&values.joints, values.inertias, scheme)
                };
                let (up, down) = (at(1.0), at(-1.0));
                let differences: Vec<f64> = up
                    .iter()
                    .zip(&down)
                    .flat_map(|(u, d)| (0..2).map(move |j| (u[j] - d[j]) / (2.0 * step(k))))
                    .collect();
                let largest = differences.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
                let own = slopes.iter().flat_map(|s| (0..2).map(move |j| s[j * p + k]));
                let worst = differences.iter().zip(own).fold(0.0_f64, |m, (d, s)| m.max((d - s).abs()));
                assert!(
                    worst < 1e-4 * largest,
                    "{encoder:?} {load:?} {:?}: {worst:e} of {largest:e}",
                    f.target
                );
            }
        }
    }
}

#[test]
fn a_stiffer_gear_ends_in_none() {
    let inertias = arm(1.0).inertia_vector();
    for encoder in [EncoderAt::Motor, EncoderAt::Link] {
        let with = |compliance: f64| {
            let joint = smooth(encoder).with(Term::Compliance, compliance);
            readings(
                &[joint.clone(), joint],
                inertias.clone(),
                Scheme { step_s: PERIOD / 8.0, ..Scheme::default() },
            )
        };
        let stiff = with(0.0);
        let apart: Vec<f64> = [1e-3, 1e-4, 1e-5, 1e-6].map(|c| rms(&with(c), &stiff)).into();
        assert!(apart.windows(2).all(|w| w[1] < 0.2 * w[0]), "{encoder:?}: {apart:?}");
        assert!(apart[3] < 2e-3 * apart[0], "{encoder:?}: {apart:?}");
    }
}

#[test]
fn steps_are_of_second_order() {
    let inertias = arm(1.0).inertia_vector();
    for encoder in [EncoderAt::Motor, EncoderAt::Link] {
        let joint = smooth(encoder);
        let with = |h: f64| {
            readings(
                &[joint.clone(), joint.clone()],
                inertias.clone(),
                Scheme { step_s: h, ..Scheme::default() },
            )
        };
        let fine = with(PERIOD / 128.0);
        let errors = [2.0, 4.0, 8.0].map(|cuts| rms(&with(PERIOD / cuts), &fine));
        assert!(errors[2] < errors[0] / 9.0, "{encoder:?}: {errors:?}");
    }
}

/// Links and motors of the arm, `[q1, q2, θ1, θ2]`, by equations written out and steps of Runge and Kutta.
fn written_out(joint: &ServoJoint, log: &ServoLog) -> Vec<[f64; 2]> {
    const STEPS: usize = 400;
    let (m, c, i, length, g) = ([1.2, 0.8], [0.15, 0.12], [0.01, 0.005], 0.3, 9.81);
    let (k, d, half) =
        (1.0 / joint.get(Term::Compliance), joint.get(Term::GearDamping), 0.5 * joint.get(Term::Backlash));
    let gear = |lead: f64, rate: f64| match lead {
        x if x >= half => k * (x - half) + d * rate,
        x if x <= -half => k * (x + half) + d * rate,
        _ => 0.0,
    };
    let gravity = |q: &[f64]| {
        let second = g * m[1] * c[1] * (q[0] + q[1]).cos();
        [g * (m[0] * c[0] + m[1] * length) * q[0].cos() + second, second]
    };
    let slope = |command: [f64; 2], y: &[f64; 8]| -> [f64; 8] {
        let (q, o, v, w) = ([y[0], y[1]], [y[2], y[3]], [y[4], y[5]], [y[6], y[7]]);
        let carried: [f64; 2] = std::array::from_fn(|j| gear(o[j] - q[j], w[j] - v[j]));
        let cross = m[1] * length * c[1];
        let m22 = i[1] + m[1] * c[1] * c[1];
        let m12 = m22 + cross * q[1].cos();
        let m11 = i[0] + m[0] * c[0] * c[0] + m[1] * length * length + m22 + 2.0 * cross * q[1].cos();
        let h = cross * q[1].sin();
        let weight = gravity(&q);
        let f1 = carried[0] + h * (2.0 * v[0] + v[1]) * v[1] - weight[0];
        let f2 = carried[1] - h * v[0] * v[0] - weight[1];
        let determinant = m11 * m22 - m12 * m12;
        let mut out = [0.0; 8];
        (out[4], out[5]) = ((m22 * f1 - m12 * f2) / determinant, (m11 * f2 - m12 * f1) / determinant);
        for j in 0..2 {
            let (at, rate) = if joint.encoder == EncoderAt::Motor { (o[j], w[j]) } else { (q[j], v[j]) };
            let drive =
                joint.get(Term::PositionGain) * (command[j] - at) - joint.get(Term::VelocityGain) * rate;
            out[6 + j] =
                (drive - joint.get(Term::Viscous) * w[j] - carried[j]) / joint.get(Term::RotorInertia);
            (out[j], out[2 + j]) = (v[j], w[j]);
        }
        out
    };
    let mut y = [0.0; 8];
    let sides: [usize; 2] = if joint.encoder == EncoderAt::Motor { [0, 1] } else { [2, 3] };
    let weight = gravity(&[0.0, 0.0]);
    for j in 0..2 {
        let lead = weight[j] / k + half;
        y[sides[j]] = if joint.encoder == EncoderAt::Motor { -lead } else { lead };
    }
    let read = |y: &[f64; 8]| if joint.encoder == EncoderAt::Motor { [y[2], y[3]] } else { [y[0], y[1]] };
    let mut out = vec![read(&y)];
    for row in 1..ROWS {
        let (from, to) = (log.time[row - 1], log.time[row]);
        let h = (to - from) / STEPS as f64;
        for step in 0..STEPS {
            let command = |share: f64| -> [f64; 2] {
                let share = (step as f64 + share) / STEPS as f64;
                std::array::from_fn(|j| {
                    log.command[j][row - 1] + share * (log.command[j][row] - log.command[j][row - 1])
                })
            };
            let at = |y: &[f64; 8], k: &[f64; 8], x: f64| -> [f64; 8] {
                std::array::from_fn(|i| y[i] + x * h * k[i])
            };
            let k1 = slope(command(0.0), &y);
            let k2 = slope(command(0.5), &at(&y, &k1, 0.5));
            let k3 = slope(command(0.5), &at(&y, &k2, 0.5));
            let k4 = slope(command(1.0), &at(&y, &k3, 1.0));
            y = std::array::from_fn(|i| y[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]));
        }
        out.push(read(&y));
    }
    out
}

#[test]
fn motion_is_that_of_the_written_out_equations() {
    let inertias = arm(1.0).inertia_vector();
    for encoder in [EncoderAt::Motor, EncoderAt::Link] {
        for backlash in [0.0, 3e-3] {
            let joint =
                smooth(encoder).with(Term::Backlash, backlash).with(Term::Delay, 0.0).with(Term::Zero, 0.0);
            let wanted = written_out(&joint, &log());
            let scheme = Scheme { step_s: PERIOD / 64.0, hold: Hold::Line, ..Scheme::default() };
            let found = readings(&[joint.clone(), joint], inertias.clone(), scheme);
            let stiff =
                smooth(encoder).with(Term::Delay, 0.0).with(Term::Zero, 0.0).with(Term::Compliance, 0.0);
            let stiff = readings(&[stiff.clone(), stiff], inertias.clone(), scheme);
            let (error, effect) = (rms(&found, &wanted), rms(&stiff, &wanted));
            println!("{encoder:?} {backlash}: {error:e} of {effect:e}");
            assert!(error < 1e-3 * effect, "{encoder:?} {backlash}: {error:e} of {effect:e}");
        }
    }
}

/// A machine and what a run of its log finds; `gears`: compliance, damping and backlash of the joints.
fn found(
    seed: u64,
    encoder: EncoderAt,
    gears: [[f64; 3]; 2],
    find: &[Term],
) -> (ServoIdentification, Vec<ServoJoint>) {
    let mechanism = arm(1.0);
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut truth = drives(&mut random);
    for (joint, values) in truth.iter_mut().zip(gears) {
        for (term, value) in [Term::Compliance, Term::GearDamping, Term::Backlash].into_iter().zip(values) {
            joint.set(term, value * random.random_range(-0.4..0.4_f64).exp());
        }
        joint.encoder = encoder;
        if encoder == EncoderAt::Link {
            joint.set(Term::VelocityGain, 0.3);
            joint.set(Term::Viscous, 1.4);
        }
    }
    let scheme = Scheme { step_s: PERIOD / 16.0, ..Scheme::default() };
    let logs = [log_of(&mechanism, &truth, scheme, 2400, seed)];
    let mut settings = ServoSettings::new(2);
    settings.own_gains = true;
    settings.find = find.to_vec();
    settings.choice = Choice::Given(vec![Addition::Zero]);
    for (known, truth) in settings.joints.iter_mut().zip(&truth) {
        known.set(Term::VelocityGain, truth.get(Term::VelocityGain));
        known.encoder = encoder;
    }
    (identify(&mechanism, &logs, &settings).unwrap(), truth)
}

/// Arms whose gears give way by numbers about nominal ones: links swing at 6 and 13 Hz, or at 20 where a drive reads its link.
#[test]
fn gears_are_found_within_their_intervals() {
    let asked = [Term::Compliance, Term::GearDamping];
    let cases = [
        (EncoderAt::Motor, [[4e-3, 0.8, 0.0], [8e-3, 0.15, 0.0]], &asked[..]),
        (EncoderAt::Link, [[1e-3, 0.8, 0.0], [3e-3, 0.15, 0.0]], &asked[..]),
        (
            EncoderAt::Motor,
            [[4e-3, 0.8, 6e-3], [8e-3, 0.15, 6e-3]],
            &[Term::Compliance, Term::GearDamping, Term::Backlash],
        ),
        (
            EncoderAt::Link,
            [[1e-3, 0.8, 6e-3], [3e-3, 0.15, 6e-3]],
            &[Term::Compliance, Term::GearDamping, Term::Backlash],
        ),
    ];
    let machines = machines() / 6;
    let mut all = Vec::new();
    for (encoder, gears, find) in cases {
        let (mut count, mut elastic) = (Vec::new(), 0);
        for seed in 0..machines as u64 {
            let (found, truth) = found(seed, encoder, gears, find);
            elastic += found.values.joints.iter().filter(|j| j.get(Term::Compliance) > 0.0).count();
            held(&found, &truth, &mut count);
        }
        println!("{encoder:?} {count:?} elastic {elastic} of {}; {:.3}", 2 * machines, share(&count));
        assert!(elastic as f64 > 1.9 * machines as f64, "{encoder:?}: {elastic}");
        all.extend(count);
    }
    assert!(share(&all) > 0.9, "{all:?}");
}

#[test]
fn stiff_gears_are_not_told_from_stiff_ones() {
    let machines = machines() / 3;
    let (mut told, mut most) = (0, 0.0_f64);
    for seed in 0..machines as u64 {
        let asked = [Term::Compliance, Term::GearDamping];
        let (found, _) = found(seed, EncoderAt::Motor, [[0.0; 3]; 2], &asked);
        assert!(found.misfit < 1.1, "{}", found.misfit);
        for p in found.parameters.iter().filter(|p| p.free.as_term() == Some(Term::Compliance)) {
            println!("{seed} {:?} {:e} {:?} {:?}", p.free.joints(), p.value, p.interval, p.verdict);
            most = most.max(p.interval.map_or(p.value, |(_, upper)| upper));
            told += usize::from(p.interval.is_some_and(|(lower, _)| lower > p.free.lower));
        }
    }
    println!("{told} of {} told, at most {most:e}", 2 * machines);
    assert!(told as f64 <= 0.05 * 2.0 * machines as f64 + 1.0, "{told}");
}

/// Rows that come twice a second show no link that swings.
#[test]
fn rows_too_slow_for_any_gear_leave_them_stiff() {
    let mechanism = arm(1.0);
    let rows = 120;
    let time: Vec<f64> = (0..rows).map(|k| 0.5 * k as f64).collect();
    let wave = |rate: f64| time.iter().map(|t| 0.3 * (rate * t).sin()).collect::<Vec<f64>>();
    let command = vec![wave(0.5), wave(0.7)];
    let mut log = ServoLog::new("slow", time.clone(), command.clone(), command.clone());
    log.start = Some(vec![0.0; 2]);
    let joints = vec![joint(EncoderAt::Motor).with(Term::Compliance, 0.0); 2];
    let values = ServoValues { joints: joints.clone(), inertias: mechanism.inertia_vector() };
    let mut position = vec![Vec::new(); 2];
    Rollout::new(&Chain::all(&mechanism)[0], Scheme { step_s: 1e-3, ..Scheme::default() }, &[])
        .run(&values, &log, |row| {
            (0..2).for_each(|j| position[j].push((row.reading[j] / 1e-3).round() * 1e-3))
        })
        .unwrap();
    let log = ServoLog::new("slow", time, command, position);
    let mut settings = ServoSettings::new(2);
    settings.find = vec![Term::Compliance, Term::GearDamping];
    let found = identify(&mechanism, &[log], &settings).unwrap();
    assert!(found.values.joints.iter().all(|j| j.get(Term::Compliance) == 0.0));
}

/// Gears whose links swing far faster than rows come: steps of a row get lost between the flanks, and shorter ones are taken.
#[test]
fn stiff_gears_with_backlash_take_shorter_steps_than_rows() {
    let mechanism = arm(1.0);
    let (mut lost, mut worst) = (0, 0.0_f64);
    for seed in 0..2 {
        let mut truth = drives(&mut ChaCha8Rng::seed_from_u64(seed));
        for joint in &mut truth {
            joint.set(Term::Compliance, 5e-5);
            joint.set(Term::GearDamping, 4.0);
            joint.set(Term::Backlash, 0.01);
        }
        let scheme = Scheme { step_s: PERIOD / 128.0, ..Scheme::default() };
        let logs = [log_of(&mechanism, &truth, scheme, 1600, seed)];
        let mut settings = ServoSettings::new(2);
        settings.own_gains = true;
        settings.choice = Choice::Given(vec![Addition::Zero]);
        for (known, truth) in settings.joints.iter_mut().zip(&truth) {
            for term in [Term::VelocityGain, Term::Compliance, Term::GearDamping, Term::Backlash] {
                known.set(term, truth.get(term));
            }
        }
        let found = identify(&mechanism, &logs, &settings).unwrap();
        worst = worst.max(found.misfit);
        settings.step_s = Some(1.1 * PERIOD);
        lost += usize::from(identify(&mechanism, &logs, &settings).is_err());
    }
    println!("{lost} lost, worst misfit {worst}");
    assert!(lost > 0 && worst < 1.3, "{lost} {worst}");
}
