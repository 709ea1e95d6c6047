//! Simulated arms whose numbers are known.

use dynid_servo::identify::{GroupKind, ServoVerdict, identify};
use dynid_servo::{Addition, Choice, LoadOf, Scheme, ServoJoint, ServoSettings, Shared, Term};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::arm::{PERIOD, arm, drives, held, log, machines, share};

/// What is known of the arm's drives: their velocity gains.
fn settings(joints: &[ServoJoint], law: &[Addition]) -> ServoSettings {
    let mut settings = ServoSettings::new(joints.len());
    for (known, joint) in settings.joints.iter_mut().zip(joints) {
        known.set(Term::VelocityGain, joint.get(Term::VelocityGain));
    }
    settings.own_gains = true;
    settings.delay = Shared::All;
    settings.load = LoadOf::Bodies;
    settings.zero_std = 0.5;
    settings.choice = Choice::Given(law.to_vec());
    settings
}

fn scheme(step_s: f64) -> Scheme {
    Scheme { step_s: step_s * (1.0 + 1e-6), load: LoadOf::Bodies, ..Scheme::default() }
}

#[test]
fn intervals_hold_where_the_model_is_exact() {
    let mechanism = arm(1.0);
    let mut count = Vec::new();
    let mut worst = 0.0_f64;
    for seed in 0..machines() as u64 {
        let truth = drives(&mut ChaCha8Rng::seed_from_u64(seed));
        let log = log(&mechanism, &truth, scheme(PERIOD), 2400, seed);
        let mut settings = settings(&truth, &[Addition::Zero]);
        settings.step_s = Some(PERIOD * 1.01);
        let found = identify(&mechanism, &[log], &settings).unwrap();
        worst = worst.max(found.misfit);
        held(&found, &truth, &mut count);
        assert!(found.groups.iter().all(|g| g.kind != GroupKind::Scale), "{:?}", found.groups);
    }
    println!("{count:?} {:.3} worst misfit {worst:.3}", share(&count));
    assert!(worst <= 1.1, "{worst}");
    assert!(share(&count) >= 0.9, "{count:?}");
}

#[test]
fn intervals_hold_where_the_truth_has_more_friction_than_the_law() {
    let mechanism = arm(1.0);
    let mut count = Vec::new();
    for seed in 0..machines() as u64 {
        let mut truth = drives(&mut ChaCha8Rng::seed_from_u64(seed));
        for joint in &mut truth {
            joint.set(Term::Stiction, 0.5 * joint.get(Term::Coulomb));
            joint.set(Term::StribeckVelocity, 0.1);
            joint.set(Term::LoadFriction, 0.08);
        }
        let log = log(&mechanism, &truth, scheme(PERIOD / 4.0), 2400, seed);
        let found = identify(&mechanism, &[log], &settings(&truth, &[Addition::Zero])).unwrap();
        assert!(found.misfit > 1.3, "{}", found.misfit);
        held(&found, &truth, &mut count);
    }
    // Coulomb friction of another law is another number.
    count.retain(|(term, ..)| *term != Term::Coulomb);
    println!("{count:?} {:.3}", share(&count));
    assert!(share(&count) >= 0.9, "{count:?}");
}

#[test]
fn friction_that_is_there_is_found_on_held_out_folds() {
    let mechanism = arm(1.0);
    let mut truth = drives(&mut ChaCha8Rng::seed_from_u64(7));
    truth.iter_mut().for_each(|j| j.set(Term::Zero, 0.0));
    for joint in &mut truth {
        joint.set(Term::LoadFriction, 0.15);
    }
    let logs: Vec<_> = (0..3).map(|seed| log(&mechanism, &truth, scheme(PERIOD), 1600, seed)).collect();
    let settings = ServoSettings::clone(&settings(&truth, &[]));
    let found = identify(&mechanism, &logs, &with_choice(settings)).unwrap();
    assert!(found.additions.contains(&Addition::Load), "{:?} {:?}", found.additions, found.trials);
    for p in found.parameters.iter().filter(|p| p.free.as_term() == Some(Term::LoadFriction)) {
        assert!((p.value - 0.15).abs() < 0.01, "{p:?}");
    }
}

fn with_choice(mut settings: ServoSettings) -> ServoSettings {
    settings.choice = Choice::HeldOut;
    settings
}

#[test]
fn light_links_leave_one_scale_open_and_their_ratios_known() {
    let mechanism = arm(1e-3);
    let truth = drives(&mut ChaCha8Rng::seed_from_u64(3));
    let log = log(&mechanism, &truth, scheme(PERIOD), 4000, 3);
    let mut settings = settings(&truth, &[]);
    settings.joints.iter_mut().zip(&truth).for_each(|(known, j)| {
        known.set(Term::Zero, j.get(Term::Zero));
        // A velocity gain in N m s/rad would pin the scale: it is a part of the viscous friction here.
        known.set(Term::VelocityGain, 0.0);
    });
    settings.step_s = Some(PERIOD * 1.01);
    let found = identify(&mechanism, &[log], &settings).unwrap();
    // What is told is the share of the known bodies: the interval reaches farther up than down, and holds the truth.
    let gain = &found.parameters[0];
    assert_eq!(gain.free.as_term(), Some(Term::PositionGain));
    let (lower, upper) = gain.interval.unwrap();
    assert!(upper - gain.value > 1.02 * (gain.value - lower), "{gain:?}");
    assert!((lower..=upper).contains(&truth[0].get(Term::PositionGain)), "{gain:?}");
    for (joint, true_joint) in truth.iter().enumerate() {
        let of = |term: Term| {
            found
                .parameters
                .iter()
                .position(|p| p.free.as_term() == Some(term) && p.free.joints() == [joint])
                .unwrap()
        };
        let scale = found.groups.iter().find(|g| g.members.contains(&of(Term::PositionGain)));
        let scale = scale.unwrap_or_else(|| panic!("joint {joint}: {:?}", found.groups));
        assert_eq!(scale.kind, GroupKind::Scale);
        for term in [Term::RotorInertia, Term::Coulomb, Term::Viscous] {
            assert!(scale.members.contains(&of(term)), "joint {joint} {term}: {:?}", found.groups);
            let (ratio, half) = found.parameters[of(term)].per_gain.unwrap();
            let damping = if term == Term::Viscous { true_joint.get(Term::VelocityGain) } else { 0.0 };
            let true_ratio = (true_joint.get(term) + damping) / true_joint.get(Term::PositionGain);
            println!("joint {joint} {term} {ratio} ± {half} truth {true_ratio}");
            assert!((ratio / true_ratio - 1.0).abs() < 0.02, "joint {joint} {term}: {ratio} {true_ratio}");
        }
    }
}

#[test]
fn a_bound_has_no_interval() {
    let mechanism = arm(1.0);
    let mut truth = drives(&mut ChaCha8Rng::seed_from_u64(11));
    truth.iter_mut().for_each(|j| {
        j.set(Term::Zero, 0.0);
        j.set(Term::Delay, 0.0);
    });
    // Readings that are written a sample late look like a negative delay.
    let mut log = log(&mechanism, &truth, scheme(PERIOD), 2000, 11);
    for position in &mut log.position {
        position.rotate_left(1);
        let last = position.len() - 1;
        position[last] = position[last - 1];
    }
    let found = identify(&mechanism, &[log], &settings(&truth, &[])).unwrap();
    let delay = found.parameters.iter().find(|p| p.free.as_term() == Some(Term::Delay)).unwrap();
    assert_eq!((delay.value, delay.verdict, delay.half_width), (0.0, ServoVerdict::AtBound, None));
}

#[test]
fn directions_that_gravity_tells_are_found() {
    let mechanism = arm(1.0);
    let mut truth = drives(&mut ChaCha8Rng::seed_from_u64(5));
    truth[1].direction = -1.0;
    let log = log(&mechanism, &truth, scheme(PERIOD), 2400, 5);
    let mut settings = settings(&truth, &[Addition::Zero]);
    settings.find_direction = vec![true; 2];
    settings.step_s = Some(PERIOD * 1.01);
    let found = identify(&mechanism, &[log], &settings).unwrap();
    assert_eq!(found.values.joints.iter().map(|j| j.direction).collect::<Vec<_>>(), [1.0, -1.0]);
    assert!(found.directions.iter().all(|d| d.other > 2.0), "{:?}", found.directions);
    assert!(found.misfit < 1.1, "{}", found.misfit);
}

#[test]
fn spikes_of_readings_and_efforts_change_nothing() {
    let mechanism = arm(1.0);
    let truth = drives(&mut ChaCha8Rng::seed_from_u64(9));
    let good = crate::arm::log_with_efforts(
        &mechanism,
        &truth,
        scheme(PERIOD),
        (2000, 9),
        (dynid_servo::Channel::Effort, dynid_servo::EffortAt::Drive, 0.05),
    );
    let mut spiked = good.clone();
    for row in (50..2000).step_by(97) {
        spiked.position[0][row] = 0.0;
        spiked.position[1][row + 3] += 3.0;
        spiked.effort[0][row + 7] = 300.0;
    }
    // The step of the encoder is that of good readings.
    spiked.resolution = vec![0.0; 2];
    let found = spiked.leave_out_spikes().unwrap();
    assert_eq!(found, [(0, 20), (1, 21)]);
    assert_eq!(spiked.resolution, good.resolution);
    let settings = settings(&truth, &[Addition::Zero]);
    let with = identify(&mechanism, &[spiked], &settings).unwrap();
    let without = identify(&mechanism, &[good], &settings).unwrap();
    assert!(with.misfit < 1.1, "{}", with.misfit);
    let outliers: usize = with.outliers.iter().map(|o| o.rows).sum();
    assert!((19..=24).contains(&outliers), "{:?}", with.outliers);
    assert!(without.outliers.iter().map(|o| o.rows).sum::<usize>() <= 2, "{:?}", without.outliers);
    for (a, b) in with.parameters.iter().zip(&without.parameters) {
        let half = a.half_width.unwrap_or(f64::INFINITY);
        assert!((a.value - b.value).abs() < half, "{a:?} {b:?}");
    }
}

#[test]
fn single_rows_between_gaps_of_the_clock_are_passed_over() {
    let mechanism = arm(1.0);
    let truth = drives(&mut ChaCha8Rng::seed_from_u64(9));
    let mut log = crate::arm::log_with_efforts(
        &mechanism,
        &truth,
        scheme(PERIOD),
        (2000, 9),
        (dynid_servo::Channel::Effort, dynid_servo::EffortAt::Drive, 0.05),
    );
    // Two gaps with one row between them.
    log.time[1000..].iter_mut().for_each(|t| *t += 0.5);
    log.time[1001..].iter_mut().for_each(|t| *t += 0.5);
    log.breaks = vec![1000, 1001];
    let found = identify(&mechanism, &[log], &settings(&truth, &[Addition::Zero])).unwrap();
    assert!(found.rms.iter().all(|x| x.is_finite()) && found.efforts.iter().all(|e| e.rms.is_finite()));
    assert!(found.step_share.is_finite());
}
