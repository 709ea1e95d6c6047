//! What simulated joints do.

use dynid_servo::{
    Chain, Free, Hold, Limited, LoadOf, Rollout, Scheme, ServoJoint, ServoLog, ServoValues, Term,
};

use crate::arm::{PERIOD, arm};

fn run(joints: Vec<ServoJoint>, command: Vec<Vec<f64>>, scheme: Scheme) -> Vec<[f64; 2]> {
    let mechanism = arm(1.0);
    let time: Vec<f64> = (0..command[0].len()).map(|k| k as f64 * PERIOD).collect();
    let log = ServoLog::new("motion", time, command.clone(), command);
    let values = ServoValues { joints, inertias: mechanism.inertia_vector() };
    let chains = Chain::all(&mechanism);
    let mut out = Vec::new();
    let count = Rollout::new(&chains[0], scheme, &[])
        .run(&values, &log, |row| out.push([row.reading[0], row.reading[1]]))
        .unwrap();
    assert_eq!(count.unsettled, 0);
    out
}

fn joint() -> ServoJoint {
    ServoJoint::default()
        .with(Term::PositionGain, 30.0)
        .with(Term::VelocityGain, 1.5)
        .with(Term::RotorInertia, 0.02)
        .with(Term::Coulomb, 0.5)
}

#[test]
fn a_joint_under_load_holds_exactly() {
    // A step, then a hold of two seconds under gravity.
    let command: Vec<f64> = (0..600).map(|k| if k < 100 { 0.0 } else { 0.4 }).collect();
    let held = run(vec![joint(), joint()], vec![command.clone(), command], Scheme::default());
    for (j, (from, to)) in held[400].into_iter().zip(held[599]).enumerate() {
        assert_eq!(from, to, "joint {j} creeps");
        // Friction holds it off the command, which a drive without integral part does not mind.
        assert!((to - 0.4).abs() > 1e-3, "joint {j}: {to}");
    }
}

#[test]
fn sticking_is_the_limit_of_a_narrow_sign() {
    let wave = |k: usize| 0.6 * (k as f64 * PERIOD * 4.0).sin();
    let command: Vec<f64> = (0..800).map(wave).collect();
    let joints = vec![joint().with(Term::Stiction, 0.1), joint().with(Term::LoadFriction, 0.1)];
    // With signs of the end of a step, as the smooth one has them.
    let scheme = |sign_width| Scheme { sign_width, middle: false, load: LoadOf::Bodies, ..Scheme::default() };
    let sticks = run(joints.clone(), vec![command.clone(), command.clone()], scheme(0.0));
    let mut last = f64::INFINITY;
    for width in [1e-2, 1e-3, 1e-4] {
        let smooth = run(joints.clone(), vec![command.clone(), command.clone()], scheme(width));
        let worst = sticks.iter().zip(&smooth).flat_map(|(a, b)| [(a[0] - b[0]).abs(), (a[1] - b[1]).abs()]);
        let worst = worst.fold(0.0, f64::max);
        assert!(worst < last, "{width}: {worst} after {last}");
        last = worst;
    }
    assert!(last < 1e-4, "{last}");
}

/// Errors of steps against steps a fortieth as long, rms over both joints.
fn errors(steps: &[f64], middle: bool, joints: &[ServoJoint], load: LoadOf) -> Vec<f64> {
    let wave = |k: usize, rate: f64| 0.8 * (k as f64 * PERIOD * rate).sin();
    let command: Vec<Vec<f64>> = [5.0, 8.0].map(|rate| (0..800).map(|k| wave(k, rate)).collect()).into();
    let with = |step_s, middle| {
        run(joints.to_vec(), command.clone(), Scheme { step_s, middle, load, ..Scheme::default() })
    };
    let fine = with(steps[steps.len() - 1] / 40.0, true);
    let rms = |rows: Vec<[f64; 2]>| {
        let squares = rows.iter().zip(&fine).map(|(a, b)| (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2));
        (squares.sum::<f64>() / rows.len() as f64).sqrt()
    };
    steps.iter().map(|h| rms(with(*h, middle))).collect()
}

#[test]
fn steps_are_of_second_order_where_joints_turn_and_rest() {
    let steps = [PERIOD, PERIOD / 2.0, PERIOD / 4.0, PERIOD / 8.0];
    for load in [LoadOf::Bodies, LoadOf::Drive] {
        let turns = joint().with(Term::Viscous, 0.3).with(Term::Coulomb, 0.05).with(Term::LoadFriction, 0.02);
        let sticks = joint().with(Term::Viscous, 0.3).with(Term::Stiction, 0.2).with(Term::LoadFriction, 0.1);
        for joint in [turns, joint(), sticks] {
            let joints = [joint.clone(), joint];
            let (found, first) = (errors(&steps, true, &joints, load), errors(&steps, false, &joints, load));
            // An eighth of the step: a 64th of the error.
            assert!(found[3] < found[0] / 50.0, "{load:?}: {found:?}");
            assert!(found[0] < 0.5 * first[0] && found[3] < first[3] / 15.0, "{load:?}: {found:?} {first:?}");
        }
    }
}

#[test]
fn a_limit_of_voltage_leaves_the_back_emf_alone() {
    let command = vec![vec![1.0; 200]; 2];
    let limited = |limited| {
        let mut joint = joint().with(Term::EffortLimit, 6.0);
        joint.limited = limited;
        let mut log = ServoLog::new(
            "step",
            (0..200).map(|k| k as f64 * PERIOD).collect(),
            command.clone(),
            command.clone(),
        );
        log.start = Some(vec![0.0, 0.0]);
        let mechanism = arm(1.0);
        let values = ServoValues { joints: vec![joint.clone(), joint], inertias: mechanism.inertia_vector() };
        let chains = Chain::all(&mechanism);
        let mut fastest = 0.0_f64;
        Rollout::new(&chains[0], Scheme::default(), &[])
            .run(&values, &log, |row| fastest = fastest.max(row.velocity[0].abs()))
            .unwrap();
        fastest
    };
    // Both push with 6 N m; behind a limited voltage the damping still slows the joint.
    assert!(limited(Limited::Proportional) < 0.95 * limited(Limited::Whole));
}

#[test]
fn a_held_command_and_a_line_differ_by_half_a_period() {
    let wave = |k: usize| 0.4 * (k as f64 * PERIOD * 3.0).sin();
    let command: Vec<f64> = (0..600).map(wave).collect();
    let with = |hold, delay: f64| {
        let joint = joint().with(Term::Delay, delay);
        run(
            vec![joint.clone(), joint],
            vec![command.clone(), command.clone()],
            Scheme { hold, ..Scheme::default() },
        )
    };
    let line = with(Hold::Line, 0.01 + 0.5 * PERIOD);
    let held = with(Hold::Held, 0.01);
    let worst = line.iter().zip(&held).map(|(a, b)| (a[0] - b[0]).abs()).fold(0.0, f64::max);
    assert!(worst < 2e-4, "{worst}");
}

#[test]
fn a_mirrored_encoder_gives_mirrored_readings() {
    let wave = |k: usize| 0.4 * (k as f64 * PERIOD * 3.0).sin() + 0.2;
    let command: Vec<f64> = (0..400).map(wave).collect();
    let mirrored: Vec<f64> = command.iter().map(|u| 0.3 - u).collect();
    let plain = run(vec![joint(), joint()], vec![command.clone(), command.clone()], Scheme::default());
    let mut turned = joint().with(Term::Zero, 0.3);
    turned.direction = -1.0;
    let other = run(vec![turned, joint()], vec![mirrored, command], Scheme::default());
    for (a, b) in plain.iter().zip(&other) {
        assert!((0.3 - b[0] - a[0]).abs() < 1e-12 && (b[1] - a[1]).abs() < 1e-12);
    }
}

#[test]
fn slopes_of_joints_that_turn_agree_with_differences() {
    let wave = |k: usize, rate: f64| 0.8 * (k as f64 * PERIOD * rate).sin();
    let command: Vec<Vec<f64>> = [5.0, 8.0].map(|rate| (0..500).map(|k| wave(k, rate)).collect()).into();
    let mechanism = arm(1.0);
    let time: Vec<f64> = (0..500).map(|k| k as f64 * PERIOD).collect();
    let log = ServoLog::new("motion", time, command.clone(), command);
    let turns = joint()
        .with(Term::Viscous, 0.3)
        .with(Term::Coulomb, 0.05)
        .with(Term::Stiction, 0.02)
        .with(Term::LoadFriction, 0.02)
        .with(Term::Delay, 0.011);
    let chains = Chain::all(&mechanism);
    let terms = [
        Term::PositionGain,
        Term::VelocityGain,
        Term::RotorInertia,
        Term::Viscous,
        Term::Coulomb,
        Term::Stiction,
        Term::StribeckVelocity,
        Term::LoadFriction,
        Term::Offset,
        Term::Zero,
        Term::Delay,
    ];
    let mut free: Vec<Free> = terms.iter().flat_map(|t| (0..2).map(|j| Free::term(*t, [j]))).collect();
    free.push(Free::inertia(10));
    let values = ServoValues { joints: vec![turns.clone(), turns], inertias: mechanism.inertia_vector() };
    let p = free.len();
    for load in [LoadOf::Bodies, LoadOf::Drive] {
        let scheme = Scheme { load, ..Scheme::default() };
        let readings = |values: &ServoValues| {
            let mut out = Vec::new();
            let mut see = |row: dynid_servo::SimulatedRow<'_>| out.extend_from_slice(row.reading);
            Rollout::new(&chains[0], scheme, &[]).run(values, &log, &mut see).unwrap();
            out
        };
        let mut slopes = Vec::new();
        let mut see = |row: dynid_servo::SimulatedRow<'_>| slopes.extend_from_slice(row.by_parameter);
        Rollout::new(&chains[0], scheme, &free).run(&values, &log, &mut see).unwrap();
        let at = values.gather(&free);
        for (c, f) in free.iter().enumerate() {
            let h = 1e-5 * at[c].abs().max(1e-2);
            let moved = |side: f64| {
                let mut x = at.clone();
                x[c] += side * h;
                readings(&values.with(&free, &x))
            };
            let (up, down) = (moved(1.0), moved(-1.0));
            let of = |k: usize| (slopes[k * p + c], (up[k] - down[k]) / (2.0 * h));
            let size = (0..up.len()).map(|k| of(k).1.abs()).fold(0.0, f64::max);
            let worst = (0..up.len()).map(|k| (of(k).0 - of(k).1).abs()).fold(0.0, f64::max);
            // The inertia that a joint alone moves is taken for known where it turns.
            let moves = matches!(f.as_term(), None | Some(Term::RotorInertia));
            let most = if moves { 1e-3 } else { 1e-4 };
            assert!(worst <= most * size, "{load:?} {:?}: {worst} of {size}", f.target);
        }
    }
}
