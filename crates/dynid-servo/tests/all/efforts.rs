//! Measured efforts and currents beside positions.

use dynid_servo::identify::{EffortUse, EffortVerdict, GroupKind, ServoIdentification, identify};
use dynid_servo::{
    Addition, Chain, Channel, Choice, EffortAt, Free, LoadOf, Rollout, Scheme, ServoJoint, ServoLog,
    ServoSettings, ServoValues, Shared, Simulated, Term,
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::arm::{PERIOD, arm, drives, held, log, log_with_efforts};

fn scheme() -> Scheme {
    Scheme { step_s: PERIOD * (1.0 + 1e-6), load: LoadOf::Bodies, ..Scheme::default() }
}

/// Nothing known of the drives, not even their velocity gains.
fn settings(law: &[Addition]) -> ServoSettings {
    let mut settings = ServoSettings::new(2);
    settings.own_gains = true;
    settings.delay = Shared::All;
    settings.load = LoadOf::Bodies;
    settings.choice = Choice::Given(law.to_vec());
    settings
}

fn truth(seed: u64) -> Vec<ServoJoint> {
    let mut truth = drives(&mut ChaCha8Rng::seed_from_u64(seed));
    for (k, joint) in truth.iter_mut().enumerate() {
        joint.set(Term::Zero, 0.0);
        joint.set(Term::EffortZero, 0.1 * (k as f64 - 0.4));
        joint.set(Term::CurrentZero, 0.05 * (k as f64 - 0.4));
        joint.set(Term::TorqueConstant, 1.7 + 0.6 * k as f64);
        joint.set(Term::EffortDelay, 0.7 * PERIOD);
    }
    truth
}

/// Machines of the statistical tests: few by default, `DYNID_MACHINES` of them where they are to be counted.
fn machines() -> u64 {
    std::env::var("DYNID_MACHINES").ok().and_then(|n| n.parse().ok()).unwrap_or(4)
}

/// Intervals of 95 % hold, as far as so few machines can say.
fn assert_holds(count: &[(Term, usize, usize)]) {
    let (hits, of) = count.iter().fold((0, 0), |(h, o), (_, hits, of)| (h + hits, o + of));
    assert!(hits as f64 >= 0.88 * of as f64, "{hits} of {of}: {count:?}");
}

fn half_width(found: &ServoIdentification, term: Term, joint: usize) -> f64 {
    let is = |p: &&dynid_servo::identify::ServoParameter| {
        p.free.as_term() == Some(term) && p.free.joints().contains(&joint)
    };
    found.parameters.iter().find(is).and_then(|p| p.half_width).unwrap_or(f64::INFINITY)
}

fn verdicts(found: &ServoIdentification) -> Vec<EffortVerdict> {
    found.efforts.iter().map(|e: &EffortUse| e.verdict).collect()
}

const TAKEN: EffortVerdict = EffortVerdict::Taken;

#[test]
fn efforts_of_light_links_settle_the_scale_and_part_the_velocity_gain_from_friction() {
    let mechanism = arm(1e-3);
    let mut count = Vec::new();
    for seed in 0..machines() {
        let truth = truth(seed);
        let log = log_with_efforts(
            &mechanism,
            &truth,
            scheme(),
            (2400, seed),
            (Channel::Effort, EffortAt::Drive, 0.05),
        );
        let found = identify(&mechanism, &[log], &settings(&[])).unwrap();
        assert_eq!(verdicts(&found), [TAKEN; 2], "{:?}", found.efforts);
        held(&found, &truth, &mut count);
        assert!(found.groups.iter().all(|g| g.kind != GroupKind::Scale), "{:?}", found.groups);
        for joint in 0..2 {
            for term in [Term::PositionGain, Term::VelocityGain, Term::RotorInertia, Term::Coulomb] {
                let value = found.values.joints[joint].get(term);
                let relative = half_width(&found, term, joint) / value;
                assert!(relative < 0.1, "{term} of joint {joint}: {value} to {relative}");
            }
        }
        for e in &found.efforts {
            assert!((e.rms / 0.05 - 1.0).abs() < 0.1, "{e:?}");
        }
    }
    println!("{count:?}");
    assert_holds(&count);
}

#[test]
fn torque_current_and_encoder_only_logs_of_one_robot_make_one_estimate() {
    let mechanism = arm(1.0);
    let mut count = Vec::new();
    for seed in 0..machines().div_ceil(2) {
        let truth = truth(seed);
        let with = |channel, noise, more: u64| {
            let at = (channel, EffortAt::Drive, noise);
            log_with_efforts(&mechanism, &truth, scheme(), (1600, seed + more), at)
        };
        let fine = Scheme { step_s: PERIOD / 16.0, ..scheme() };
        let logs = [
            with(Channel::Effort, 0.1, 100),
            with(Channel::Current, 0.05, 200),
            log(&mechanism, &truth, fine, 1600, seed + 300),
        ];
        let found = identify(&mechanism, &logs, &settings(&[])).unwrap();
        assert_eq!(verdicts(&found), [TAKEN; 4], "{:?}", found.efforts);
        held(&found, &truth, &mut count);
        let mut bare: Vec<ServoLog> = logs.to_vec();
        for log in &mut bare {
            log.effort.clear();
            log.current.clear();
        }
        let alone = identify(&mechanism, &bare, &settings(&[])).unwrap();
        assert!(alone.efforts.is_empty());
        for (joint, true_joint) in truth.iter().enumerate() {
            let constant = found.values.joints[joint].get(Term::TorqueConstant);
            let true_constant = true_joint.get(Term::TorqueConstant);
            assert!((constant / true_constant - 1.0).abs() < 0.01, "{constant} {true_constant}");
            // Positions of heavy links tell the gain by themselves; no less is known with efforts.
            let width = |f: &ServoIdentification| half_width(f, Term::PositionGain, joint);
            assert!(width(&found) < 1.1 * width(&alone), "{} {}", width(&found), width(&alone));
        }
    }
    println!("{count:?}");
    assert_holds(&count);
}

#[test]
fn efforts_between_gear_and_link_are_those_of_the_bodies() {
    let mechanism = arm(1.0);
    let truth = truth(4);
    let log =
        log_with_efforts(&mechanism, &truth, scheme(), (2400, 4), (Channel::Effort, EffortAt::Link, 0.02));
    let mut settings = settings(&[]);
    settings.effort_at = EffortAt::Link;
    settings.joints.iter_mut().zip(&truth).for_each(|(known, joint)| {
        known.set(Term::VelocityGain, joint.get(Term::VelocityGain));
    });
    let found = identify(&mechanism, std::slice::from_ref(&log), &settings).unwrap();
    assert_eq!(verdicts(&found), [TAKEN; 2]);
    assert!(found.efforts.iter().all(|e| (e.rms / 0.02 - 1.0).abs() < 0.1), "{:?}", found.efforts);
    let mut count = Vec::new();
    held(&found, &truth, &mut count);
    let misses: usize = count.iter().map(|(_, hits, of)| of - hits).sum();
    assert!(misses <= 1, "{count:?}");
    // Taken for those of the drives, they lack rotor and friction, and it shows.
    settings.effort_at = EffortAt::Drive;
    let wrong = identify(&mechanism, &[log], &settings).unwrap();
    let worst = wrong.efforts.iter().map(|e| e.rms).fold(0.0, f64::max);
    assert!(worst > 0.1, "{:?}", wrong.efforts);
}

#[test]
fn what_is_no_effort_is_left_out_and_a_wrong_unit_is_told() {
    let mechanism = arm(1.0);
    let truth = truth(5);
    let good =
        log_with_efforts(&mechanism, &truth, scheme(), (2000, 5), (Channel::Effort, EffortAt::Drive, 0.05));
    let with = |change: &dyn Fn(f64) -> f64| {
        let mut log = good.clone();
        log.effort[0].iter_mut().for_each(|e| *e = change(*e));
        identify(&mechanism, &[log], &settings(&[])).unwrap()
    };
    let right = with(&|e| e);
    assert_eq!(verdicts(&right), [TAKEN; 2], "{:?}", right.efforts);
    // A register without a sign, and one with the other sign.
    let unsigned = with(&f64::abs);
    assert_eq!(verdicts(&unsigned), [EffortVerdict::Unsigned, TAKEN], "{:?}", unsigned.efforts);
    let turned = with(&|e| -e);
    assert_eq!(verdicts(&turned), [EffortVerdict::Against, TAKEN], "{:?}", turned.efforts);
    // What is left out moves nothing but what it would have told.
    let gain = |f: &ServoIdentification| f.values.joints[1].get(Term::PositionGain);
    assert!((gain(&unsigned) / gain(&right) - 1.0).abs() < 0.01);
    let mut short = good.clone();
    short.effort[1].pop();
    let error = identify(&mechanism, &[short], &settings(&[])).unwrap_err();
    assert_eq!(error.to_string(), "log 5: effort: expected 2000 rows, found 1999");
    // Behind a gear of 30 that nobody thought of.
    let wrong = with(&|e| e / 30.0);
    let ratio = wrong.efforts[0].ratio.unwrap();
    assert_eq!(verdicts(&wrong), [EffortVerdict::OtherSize, TAKEN], "{:?}", wrong.efforts);
    assert!((30.0 * ratio - 1.0).abs() < 0.1, "{:?}", wrong.efforts);
}

#[test]
fn slopes_of_efforts_are_those_of_differences() {
    let mechanism = arm(1.0);
    let truth = truth(6);
    let terms = [
        Term::PositionGain,
        Term::VelocityGain,
        Term::RotorInertia,
        Term::Viscous,
        Term::Coulomb,
        Term::Delay,
        Term::EffortDelay,
    ];
    let free: Vec<Free> = terms.iter().flat_map(|term| (0..2).map(|j| Free::term(*term, [j]))).collect();
    let chains = Chain::all(&mechanism);
    for at in [EffortAt::Drive, EffortAt::Link] {
        let asked = log_with_efforts(&mechanism, &truth, scheme(), (120, 6), (Channel::Effort, at, 0.0));
        let scheme = Scheme { effort_at: at, sign_width: 0.05, ..scheme() };
        let run = |joints: &[ServoJoint], free: &[Free]| {
            let values = ServoValues { joints: joints.to_vec(), inertias: mechanism.inertia_vector() };
            let mut out = Vec::new();
            let mut slopes = Vec::new();
            Rollout::new(&chains[0], scheme, free)
                .run_with_efforts(&values, &asked, |seen| {
                    if let Simulated::Effort(seen) = seen {
                        out.push(seen.effort);
                        slopes.push(seen.by_parameter.to_vec());
                    }
                })
                .unwrap();
            (out, slopes)
        };
        let (_, slopes) = run(&truth, &free);
        for (c, f) in free.iter().enumerate() {
            let (term, j) = (f.as_term().unwrap(), f.joints()[0]);
            let step = 1e-6 * truth[j].get(term).abs().max(1e-3);
            let moved = |side: f64| {
                let mut joints = truth.clone();
                joints[j].set(term, truth[j].get(term) + side * step);
                run(&joints, &[]).0
            };
            let (up, down) = (moved(1.0), moved(-1.0));
            let largest = slopes.iter().map(|s| s[c].abs()).fold(0.0, f64::max);
            // At the corners of the lines between steps a delay has two slopes.
            let mut misses: Vec<f64> = slopes
                .iter()
                .zip(up.iter().zip(&down))
                .map(|(s, (a, b))| ((a - b) / (2.0 * step) - s[c]).abs() / largest)
                .collect();
            misses.sort_by(f64::total_cmp);
            let worst = misses[misses.len() - 1 - misses.len() / 50];
            assert!(largest > 0.0 && worst < 1e-4, "{at:?} {term} of joint {j}: {worst}");
        }
    }
}
