//! Loops between any links of random trees: sound or refused, never a panic.

use dynid_model::closed::*;
use dynid_model::*;
use rand::{Rng, RngExt};

use crate::random_tree::{generator, inertia, motion, numbers, placement, tree};

fn kind(rng: &mut impl Rng) -> CutKind {
    match rng.random_range(0..9) {
        0 => CutKind::Spherical,
        1 => CutKind::PlanarRevolute,
        2 => CutKind::Revolute,
        3 => CutKind::Universal,
        4 => CutKind::Cylindrical,
        5 => CutKind::Prismatic,
        6 => CutKind::PlanarPrismatic,
        7 => CutKind::Fixed,
        _ => CutKind::Distance { length: 0.5 + numbers::<1>(rng)[0] },
    }
}

/// Any condition; mostly one that is met where the bodies are.
fn condition(rng: &mut impl Rng, mechanism: &Mechanism, at: &[Placement], joints: usize) -> Condition {
    if rng.random_range(0..6) == 0 {
        let mut term = || (format!("j{}", rng.random_range(1..=joints)), numbers::<1>(rng)[0]);
        return Condition::Coordinates { terms: vec![term(), term()], constant: numbers::<1>(rng)[0] };
    }
    let end = |rng: &mut _| LinkFrame { link: link(rng, joints), placement: placement(rng) };
    let (kind, a, mut b) = (kind(rng), end(rng), end(rng));
    if rng.random_bool(0.8) {
        let world = |link: &str| {
            let frame = mechanism.frame(link).unwrap();
            frame.body.map_or(frame.placement, |k| at[k].then(&frame.placement))
        };
        let away = match kind {
            CutKind::Distance { length } => Placement::translate(length, 0.0, 0.0),
            _ => Placement::identity(),
        };
        let meeting = world(&a.link).then(&a.placement).then(&away);
        b.placement = world(&b.link).inverse().then(&meeting);
    }
    Condition::Joint { kind, a, b }
}

fn link(rng: &mut impl Rng, joints: usize) -> String {
    format!("l{}", rng.random_range(0..=joints))
}

#[test]
fn loops_on_random_trees_are_closed_or_refused() {
    let (mut closed, mut reached, mut faults) = (0, 0, std::collections::BTreeMap::<String, usize>::new());
    for seed in 0..600 {
        let mut rng = generator(5000 + seed);
        let rng = &mut rng;
        let joints = rng.random_range(2..7);
        let mut description = tree(joints, seed);
        if rng.random_bool(0.1) {
            description.links[1].inertia = Some(inertia(rng));
        }
        let mechanism = description.build().unwrap();
        let state = motion(&mechanism, seed);
        let dynamics = Dynamics::new(&mechanism);
        let at = dynamics.forward_kinematics(&state.q, &mut dynamics.workspace());
        let count = rng.random_range(1..4);
        let closures = (0..count)
            .map(|k| ClosureDescription {
                name: format!("c{k}"),
                condition: condition(rng, &mechanism, &at, joints),
            })
            .collect();
        let names: Vec<String> =
            (0..rng.random_range(1..4)).map(|_| format!("j{}", rng.random_range(1..=joints))).collect();
        let driven = rng.random_bool(0.3).then_some(names.as_slice());
        let home: Vec<(String, Vec<f64>)> = mechanism
            .bodies()
            .iter()
            .filter(|_| rng.random_bool(0.95))
            .map(|b| (b.joint.name.clone(), state.q[b.position..b.position + b.joint.positions()].to_vec()))
            .collect();
        let machine = match ClosedMechanism::new(mechanism, closures, driven, &home) {
            Ok(machine) => machine,
            Err(fault) => {
                assert!(!fault.to_string().contains("NaN"), "{fault}");
                let name = format!("{fault:?}");
                *faults.entry(name.split([' ', '(']).next().unwrap().to_owned()).or_default() += 1;
                continue;
            }
        };
        closed += 1;
        let phi = machine.mechanism().inertia_vector();
        let home = machine.home_independent();
        let d = machine.mobility();
        let mut dynamics = ClosedDynamics::new(machine);
        for step in 0..5 {
            let target: Vec<f64> =
                home.iter().map(|h| h + 0.1 * f64::from(step) * numbers::<1>(rng)[0]).collect();
            if dynamics.reach(&target).is_err() {
                continue;
            }
            reached += 1;
            let (rates, accelerations) =
                ((0..d).map(|_| numbers::<1>(rng)[0]).collect::<Vec<_>>(), vec![1.0; d]);
            let (dq, ddq) = dynamics.motion(&rates, &accelerations);
            let found = dynamics.inverse_dynamics((&dq, &ddq), None, &phi);
            let numbers = found.drives.iter().chain(&found.multipliers).chain(&dq).chain(&ddq);
            assert!(numbers.into_iter().all(|x| x.is_finite()), "seed {seed}: {found:?}");
            assert!(dynamics.pose().residual().iter().all(|r| r.abs() < 1e-9), "seed {seed}");
        }
    }
    println!("{closed} closed, {reached} poses, {faults:?}");
    assert!(closed > 60 && reached > 3 * closed, "{closed} {reached} {faults:?}");
}
