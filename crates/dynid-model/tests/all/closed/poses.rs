//! Poses: Newton's method, continuation, assembly modes, singular poses.

use dynid_model::ClosedModel;
use dynid_model::TreeModel;
use dynid_model::closed::{ClosedMechanism, ClosedWarning, PoseError};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::model::Motion;
use crate::golden::check_close;
use crate::robots::{Robot, robot};

const ALL: [&str; 5] = ["fourbar", "fivebar", "prr3", "delta", "stewart"];

/// Home with every dependent coordinate off by 0.1 (rad, m); a floating joint by 0.1 along and about its axes.
fn off(machine: &ClosedMechanism, rng: &mut ChaCha8Rng) -> Vec<f64> {
    let mut q = machine.home().to_vec();
    let mut sign = || if rng.random_bool(0.5) { 0.1 } else { -0.1 };
    for body in machine.mechanism().bodies() {
        if machine.independent().contains(&body.rate) {
            continue;
        }
        if body.joint.rates() == 1 {
            q[body.position] += sign();
            continue;
        }
        let at = &mut q[body.position..body.position + 7];
        at[..3].iter_mut().for_each(|x| *x += sign());
        // A turn by 0.1 rad about a diagonal.
        let axis = [sign(), sign(), sign()].map(|s| s.signum() / 3.0_f64.sqrt());
        let (s, c) = 0.05_f64.sin_cos();
        let [x, y, z, w] = [at[3], at[4], at[5], at[6]];
        let [a, b, d] = axis.map(|u| u * s);
        at[3..].copy_from_slice(&[
            w * a + x * c + y * d - z * b,
            w * b - x * d + y * c + z * a,
            w * d + x * b - y * a + z * c,
            w * c - x * a - y * b - z * d,
        ]);
    }
    q
}

#[test]
fn a_start_next_to_home_closes_in_a_few_steps() {
    for name in ALL {
        let stated = robot(name);
        let machine = stated.close();
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut most = 0;
        for _ in 0..20 {
            let q = off(&machine, &mut rng);
            let mut work = machine.workspace();
            machine.take(&mut work, &q).unwrap();
            most = most.max(work.iterations());
            check_close(work.positions(), machine.home(), 1e-9, 0.0, name);

            let home =
                machine.mechanism().bodies().iter().map(|b| {
                    (b.joint.name.clone(), q[b.position..b.position + b.joint.positions()].to_vec())
                });
            let moved = Robot { home: home.collect(), ..stated.clone() }.close();
            check_close(moved.home(), machine.home(), 1e-9, 0.0, name);
            assert!(matches!(moved.warnings(), [ClosedWarning::HomeMoved { .. }]), "{:?}", moved.warnings());
        }
        println!("{name}: {most} steps");
        assert!(most <= 6, "{name}: {most}");
    }
}

#[test]
fn a_path_takes_two_steps_a_sample_at_most() {
    for name in ALL {
        let machine = robot(name).close();
        let model = ClosedModel::new(TreeModel::new(machine.mechanism().clone(), Vec::new()), machine);
        let home = model.machine().home_independent();
        let mut motion = Motion { samples: 1000, q: Vec::new(), dq: Vec::new(), ddq: Vec::new() };
        let swing = match name {
            "prr3" => 0.015,
            "stewart" => 0.04,
            "fivebar" => 0.15,
            _ => 0.3,
        };
        for (k, at) in home.iter().enumerate() {
            let omega = 2.0 + 0.4 * k as f64;
            motion.q.extend((0..1000).map(|s| at + swing * (omega * 0.01 * f64::from(s)).sin()));
        }
        motion.dq = vec![0.0; motion.q.len()];
        motion.ddq = motion.dq.clone();
        let mut counts = [0; 13];
        let mut gap = 0.0_f64;
        let visit = |_: usize, pose: &dynid_model::closed::PoseWorkspace| {
            counts[pose.iterations()] += 1;
            gap = pose.residual().iter().fold(gap, |m, x| m.max(x.abs()));
        };
        model.follow(&motion.block(), visit).unwrap();
        println!("{name}: samples by steps {counts:?}, residual {gap:e}");
        assert_eq!(counts[3..].iter().sum::<usize>(), 0, "{name}: {counts:?}");
        assert!(gap < 1e-12);
    }
}

#[test]
fn a_large_step_leads_where_small_ones_do() {
    for (name, way) in
        [("fourbar", 3.0), ("fivebar", -0.8), ("prr3", 0.05), ("delta", 0.5), ("stewart", 0.08)]
    {
        let machine = robot(name).close();
        let home = machine.home_independent();
        let at = |share: f64| -> Vec<f64> {
            let factor = |k: usize| 1.0 - 0.4 * k as f64 / home.len() as f64;
            home.iter().enumerate().map(|(k, h)| h + share * way * factor(k)).collect()
        };
        let (mut jump, mut walk) = (machine.workspace(), machine.workspace());
        machine.reach(&mut jump, &at(1.0)).unwrap();
        (1..=500).for_each(|k| machine.reach(&mut walk, &at(f64::from(k) / 500.0)).unwrap());
        check_close(jump.positions(), walk.positions(), 1e-10, 0.0, name);
        // And back.
        machine.reach(&mut jump, &home).unwrap();
        check_close(jump.positions(), machine.home(), 1e-10, 0.0, name);
    }
}

#[test]
fn a_pose_of_the_other_assembly_is_refused() {
    let machine = robot("fourbar").close();
    let mut work = machine.workspace();
    // The pin mirrored about the line from the crank's end to the rocker's pivot.
    let [crank, coupler, rocker] = machine.home() else { panic!("three coordinates") };
    let (x, y) = (0.12 * crank.cos(), 0.12 * crank.sin());
    let line = (-y).atan2(0.4 - x);
    let mirrored = [*crank, 2.0 * line - (crank + coupler) - crank, 2.0 * line - rocker];
    assert_eq!(machine.take(&mut work, &mirrored), Err(PoseError::OtherMode));
    assert_eq!(
        PoseError::OtherMode.to_string(),
        "the pose belongs to another assembly mode than the home position"
    );
    // A workspace that was refused a pose finds its way back.
    machine.go_home(&mut work);
    machine.reach(&mut work, &[1.0]).unwrap();
}

#[test]
fn poses_out_of_reach_name_the_loop() {
    let machine = robot("fivebar").close();
    let mut work = machine.workspace();
    let fault = machine.reach(&mut work, &[3.1, 0.0]).unwrap_err();
    let PoseError::OutOfReach { closure, gap } = &fault else { panic!("{fault:?}") };
    assert_eq!(closure, "tool_pin");
    assert!(gap.ends_with("mm"), "{gap}");
    assert!(fault.to_string().starts_with("the loops cannot close: `tool_pin` keeps a gap of "), "{fault}");
    // It stays where it was.
    assert_eq!(work.positions(), machine.home());
    assert!(work.residual().iter().all(|r| r.abs() < 1e-12));
    let fault = machine.reach(&mut work, &[f64::NAN, 0.8]).unwrap_err();
    assert_eq!(fault, PoseError::NotFinite { joint: "left_crank".into() });

    let model = robot("fivebar").model();
    let motion =
        Motion { samples: 3, q: vec![2.2, 3.1, 2.2, 0.8, 0.0, 0.8], dq: vec![0.1; 6], ddq: vec![0.1; 6] };
    let fault = model.follow(&motion.block(), |_, _| ()).unwrap_err();
    assert_eq!(fault.sample, 1);
    assert!(fault.to_string().starts_with("sample 1: the loops cannot close"), "{fault}");
}

/// Rocker driven: dead centres where crank and coupler are in line.
#[test]
fn dead_centres_are_singular() {
    let by_crank = robot("fourbar");
    let machine = by_crank.close();
    let mut work = machine.workspace();
    machine.reach(&mut work, &[1.8]).unwrap();
    let names = ["crank", "coupler", "rocker"].map(String::from);
    let home = names.into_iter().zip(work.positions().iter().map(|x| vec![*x])).collect();
    let by_rocker = Robot { driven: vec!["rocker".into()], home, ..by_crank };
    let machine = by_rocker.close();
    let dead = |reach: f64| (((reach * reach) - 0.16 - 0.09) / 0.24_f64).acos();
    for dead in [dead(0.12 + 0.35), dead(0.35 - 0.12)] {
        let inwards = (machine.home_independent()[0] - dead).signum();
        let measure = |by: f64| {
            let mut work = machine.workspace();
            machine.reach(&mut work, &[dead + inwards * by]).map(|()| machine.singularity(&work).measure)
        };
        // The measure falls with the root of the distance.
        let (far, near) = (measure(1e-4).unwrap(), measure(1e-6).unwrap());
        println!("dead centre {dead}: measures {far:e} {near:e}");
        assert!((far / near - 10.0).abs() < 0.5);
        let fault = measure(1e-11).unwrap_err();
        let PoseError::Singular { measure: found, least, motion } = &fault else { panic!("{fault:?}") };
        assert!(*found < 1e-4 && *least == 1e-4);
        assert!(motion.0.iter().any(|(name, _)| name == "crank"), "{motion}");
        assert!(fault.to_string().contains("with the independent joints held, "), "{fault}");
        let beyond = measure(-1e-3).unwrap_err();
        assert!(matches!(beyond, PoseError::OutOfReach { .. } | PoseError::Singular { .. }), "{beyond:?}");
        // A stricter machine refuses earlier.
        let strict = machine.clone().with_least_measure(2.0 * near);
        let mut work = strict.workspace();
        let fault = strict.reach(&mut work, &[dead + inwards * 1e-6]).unwrap_err();
        assert!(matches!(fault, PoseError::Singular { .. }), "{fault:?}");
    }
}
