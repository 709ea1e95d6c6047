//! A planar arm of two joints in a vertical plane, and logs of it.

use std::f64::consts::TAU;

use dynid_model::{
    Description, Inertia, JointDescription, JointKind, LinkDescription, Mat3, Mechanism, Placement, Vec3,
};
use dynid_servo::identify::ServoIdentification;
use dynid_servo::{
    Chain, Channel, EffortAt, Rollout, Scheme, ServoJoint, ServoLog, ServoValues, Simulated, Term,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// The arm; its masses times a factor.
pub(crate) fn arm(factor: f64) -> Mechanism {
    let mut robot = Description::new("arm");
    robot.links.push(LinkDescription { name: "base".into(), inertia: None });
    let bodies = [(1.2, 0.15, 0.01, [1.0, 0.0, 0.0]), (0.8, 0.12, 0.005, [0.0, 0.0, 0.0])];
    for (i, (mass, centre, inertia, _)) in bodies.into_iter().enumerate() {
        let tensor = Mat3::from_rows([[0.001, 0.0, 0.0], [0.0, inertia, 0.0], [0.0, 0.0, inertia]]) * factor;
        let name = format!("link{}", i + 1);
        robot.links.push(LinkDescription {
            name: name.clone(),
            inertia: Some(Inertia::from_com(factor * mass, Vec3([centre, 0.0, 0.0]), &tensor)),
        });
        let placement = match i {
            // The axis lies, so that gravity acts.
            0 => Placement::rotate([1.0, 0.0, 0.0], TAU / 4.0),
            _ => Placement::translate(0.3, 0.0, 0.0),
        };
        robot.joints.push(JointDescription {
            name: format!("joint{}", i + 1),
            parent: if i == 0 { "base".to_owned() } else { "link1".to_owned() },
            child: name,
            kind: JointKind::Revolute,
            placement,
            axis: [0.0, 0.0, 1.0],
            limits: Default::default(),
            mimic: None,
        });
    }
    robot.build().unwrap()
}

/// Drives whose numbers lie about nominal ones by factors of up to `e^0.4`.
pub(crate) fn drives(random: &mut ChaCha8Rng) -> Vec<ServoJoint> {
    let delay = random.random_range(0.3..3.7) * PERIOD;
    let nominal = [(30.0, 1.5, 0.02, 0.3, 0.4), (20.0, 1.0, 0.01, 0.15, 0.2)];
    nominal
        .into_iter()
        .map(|(kp, kd, rotor, viscous, coulomb)| {
            let mut about = |x: f64| x * random.random_range(-0.4..0.4_f64).exp();
            let (kp, rotor, viscous, coulomb) = (about(kp), about(rotor), about(viscous), about(coulomb));
            ServoJoint::default()
                .with(Term::PositionGain, kp)
                .with(Term::VelocityGain, kd)
                .with(Term::RotorInertia, rotor)
                .with(Term::Viscous, viscous)
                .with(Term::Coulomb, coulomb)
                .with(Term::Zero, random.random_range(-0.05..0.05))
                .with(Term::Delay, delay)
        })
        .collect()
}

/// Time between rows, s.
pub(crate) const PERIOD: f64 = 0.005;

/// Step of an encoder of 12 bits.
pub(crate) const STEP: f64 = TAU / 4096.0;

/// Commands about a posture: sums of sinusoids from 0.1 to 5 Hz with random phases, and a pause.
pub(crate) fn commands(random: &mut ChaCha8Rng, rows: usize, posture: &[f64]) -> Vec<Vec<f64>> {
    posture
        .iter()
        .map(|middle| {
            let waves: Vec<[f64; 3]> = [0.13, 0.31, 0.7, 1.3, 2.7, 4.6]
                .iter()
                .map(|f| {
                    [f * random.random_range(0.8..1.2), 0.5 / (1.0 + 2.0 * f), random.random_range(0.0..TAU)]
                })
                .collect();
            let value = |t: f64| {
                let sum: f64 = waves.iter().map(|[f, a, p]| a * (TAU * f * t + p).sin()).sum();
                sum + middle
            };
            // One pause of a second in the middle.
            let time = |k: usize| {
                let t = k as f64 * PERIOD;
                let half = 0.5 * rows as f64 * PERIOD;
                if t < half { t } else { (t - 1.0).max(half) }
            };
            (0..rows).map(|k| value(time(k))).collect()
        })
        .collect()
}

/// A log of a simulated arm, rounded by its encoders.
pub(crate) fn log(
    mechanism: &Mechanism,
    joints: &[ServoJoint],
    scheme: Scheme,
    rows: usize,
    seed: u64,
) -> ServoLog {
    log_about(&[-0.6, 0.8], mechanism, (joints, &mechanism.inertia_vector()), scheme, (rows, seed))
}

/// A log of a simulated robot that moves about a posture, rounded by its encoders.
pub(crate) fn log_about(
    posture: &[f64],
    mechanism: &Mechanism,
    (joints, inertias): (&[ServoJoint], &[f64]),
    scheme: Scheme,
    (rows, seed): (usize, u64),
) -> ServoLog {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let command = commands(&mut random, rows, posture);
    let time: Vec<f64> = (0..rows).map(|k| k as f64 * PERIOD).collect();
    let values = ServoValues { joints: joints.to_vec(), inertias: inertias.to_vec() };
    let mut log = ServoLog::new(format!("log {seed}"), time, command.clone(), command.clone());
    log.start = Some(command.iter().map(|c| c[0]).collect());
    let mut position = vec![Vec::new(); joints.len()];
    for chain in Chain::all(mechanism) {
        Rollout::new(&chain, scheme, &[])
            .run(&values, &log, |row| {
                for (j, x) in chain.joints.iter().zip(row.reading) {
                    position[*j].push((x / STEP).round() * STEP);
                }
            })
            .unwrap();
    }
    let start = log.start.take();
    let mut log = ServoLog::new(log.name, log.time, command, position);
    log.start = start;
    log
}

/// The same motion with what a channel of efforts measures of it, with noise of this standard deviation; the drives' own steps of `scheme` are
/// taken sixteen times finer, so that an effort is that of its instant.
pub(crate) fn log_with_efforts(
    mechanism: &Mechanism,
    joints: &[ServoJoint],
    scheme: Scheme,
    (rows, seed): (usize, u64),
    (channel, at, noise): (Channel, EffortAt, f64),
) -> ServoLog {
    let fine = Scheme { step_s: scheme.step_s / 16.0, effort_at: at, effort_span_s: 1e-3 * PERIOD, ..scheme };
    let mut log = log(mechanism, joints, fine, rows, seed);
    let mut asked = log.clone();
    asked.effort = log.position.clone();
    let values = ServoValues { joints: joints.to_vec(), inertias: mechanism.inertia_vector() };
    let mut efforts = vec![vec![0.0; rows]; 2];
    Rollout::new(&Chain::all(mechanism)[0], fine, &[])
        .run_with_efforts(&values, &asked, |seen| {
            if let Simulated::Effort(seen) = seen {
                efforts[seen.joint][seen.row] = seen.effort;
            }
        })
        .unwrap();
    let mut random = ChaCha8Rng::seed_from_u64(seed + 1000);
    // Sum of twelve uniform numbers: normal enough.
    let mut normal = || (0..12).map(|_| random.random_range(-0.5..0.5_f64)).sum::<f64>();
    for (joint, effort) in joints.iter().zip(&mut efforts) {
        for e in effort {
            *e = match channel {
                Channel::Current => {
                    joint.direction * *e / joint.get(Term::TorqueConstant)
                        + joint.get(Term::CurrentZero)
                        + noise * normal()
                }
                _ => joint.direction * *e + joint.get(Term::EffortZero) + noise * normal(),
            };
        }
    }
    if channel == Channel::Current {
        log.current = efforts;
    } else {
        log.effort = efforts;
    }
    log
}

/// Intervals that hold the truth, of all, by term.
pub(crate) fn held(found: &ServoIdentification, truth: &[ServoJoint], count: &mut Vec<(Term, usize, usize)>) {
    for p in &found.parameters {
        let (Some(half), Some(term)) = (p.half_width, p.free.as_term()) else { continue };
        let inside = usize::from((p.value - truth[p.free.joints()[0]].get(term)).abs() <= half);
        match count.iter_mut().find(|(t, ..)| *t == term) {
            Some((_, hits, of)) => (*hits, *of) = (*hits + inside, *of + 1),
            None => count.push((term, inside, 1)),
        }
    }
}

/// Machines of the statistical tests: few by default, `DYNID_MACHINES` of them where they are to be counted.
pub(crate) fn machines() -> usize {
    std::env::var("DYNID_MACHINES").ok().and_then(|n| n.parse().ok()).unwrap_or(12)
}

/// Share of the intervals that hold.
pub(crate) fn share(count: &[(Term, usize, usize)]) -> f64 {
    let (hits, of) = count.iter().fold((0, 0), |(h, o), (_, hits, of)| (h + hits, o + of));
    hits as f64 / of as f64
}
