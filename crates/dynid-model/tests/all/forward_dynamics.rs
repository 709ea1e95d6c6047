//! Forward dynamics undoes inverse dynamics, on all trees and over all numbers.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use crate::random_tree::{check_close, effort, generator, motion, numbers, tree};
use dynid_model::scalar::Dual;
use dynid_model::*;

const TREES: u64 = 120;

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |m, x| m.max(x.abs()))
}

/// Trees of 1 to 9 joints, of all kinds of joints.
fn trees() -> impl Iterator<Item = (u64, Mechanism)> {
    (0..TREES).map(|seed| (seed, tree(1 + seed as usize % 9, seed).build().unwrap()))
}

fn accelerations(
    mechanism: &Mechanism,
    (q, dq): (&[f64], &[f64]),
    effort: &[f64],
    added: AddedInertia<'_, f64>,
) -> Result<Vec<f64>, NotPositive> {
    let dynamics = Dynamics::new(mechanism);
    let mut ddq = vec![0.0; dynamics.rates()];
    let state = LoadedState { q, dq, effort, gravity: None };
    dynamics.forward_dynamics(
        &state,
        &mechanism.inertia_vector(),
        added,
        &mut dynamics.forward_workspace(),
        &mut ddq,
    )?;
    Ok(ddq)
}

/// A positive number per rate, and a positive definite matrix.
fn added_inertia(n: usize, seed: u64) -> (Vec<f64>, Vec<f64>) {
    let mut rng = generator(seed + 900);
    let diagonal: Vec<f64> = (0..n).map(|_| 1.0 + numbers::<1>(&mut rng)[0]).collect();
    let root: Vec<f64> = (0..n * n).map(|_| numbers::<1>(&mut rng)[0]).collect();
    let product = |i: usize, j: usize| (0..n).map(|k| root[i * n + k] * root[j * n + k]).sum::<f64>();
    let full = (0..n * n).map(|k| product(k / n, k % n)).collect();
    (diagonal, full)
}

#[test]
fn forward_dynamics_of_inverse_dynamics_is_the_acceleration() {
    for (seed, mechanism) in trees() {
        let (n, m) = (mechanism.rates(), motion(&mechanism, seed));
        let rigid = effort(&mechanism, &m);
        let (diagonal, full) = added_inertia(n, seed);
        let check = |more: Vec<f64>, added: AddedInertia<'_, f64>, what: &str| {
            let effort: Vec<f64> = rigid.iter().zip(&more).map(|(r, e)| r + e).collect();
            let found = accelerations(&mechanism, (&m.q, &m.dq), &effort, added).unwrap();
            check_close(&found, &m.ddq, 1e-10 * largest(&m.ddq), &format!("tree {seed}, {what}"));
        };
        check(vec![0.0; n], AddedInertia::None, "bodies");
        let more = diagonal.iter().zip(&m.ddq).map(|(d, a)| d * a).collect();
        check(more, AddedInertia::Diagonal(&diagonal), "rotors");
        let more = full.chunks_exact(n).map(|r| r.iter().zip(&m.ddq).map(|(d, a)| d * a).sum()).collect();
        check(more, AddedInertia::Full(&full), "shared motors");
    }
}

#[test]
fn both_ways_to_the_acceleration_agree() {
    for (seed, mechanism) in trees() {
        let (n, m) = (mechanism.rates(), motion(&mechanism, seed));
        let (diagonal, _) = added_inertia(n, seed);
        let mut matrix = vec![0.0; n * n];
        diagonal.iter().enumerate().for_each(|(k, d)| matrix[k * (n + 1)] = *d);
        let effort: Vec<f64> = numbers::<60>(&mut generator(seed)).iter().cycle().take(n).copied().collect();
        let of = |added| accelerations(&mechanism, (&m.q, &m.dq), &effort, added).unwrap();
        let (recursive, dense) = (of(AddedInertia::Diagonal(&diagonal)), of(AddedInertia::Full(&matrix)));
        check_close(&recursive, &dense, 1e-10 * largest(&dense), &format!("tree {seed}"));
    }
}

#[test]
fn mobility_is_the_acceleration_per_effort() {
    for (seed, mechanism) in trees() {
        let (n, m) = (mechanism.rates(), motion(&mechanism, seed));
        let (diagonal, _) = added_inertia(n, seed);
        let (dynamics, phi, still) = (Dynamics::new(&mechanism), mechanism.inertia_vector(), vec![0.0; n]);
        for rate in 0..n {
            let of =
                |added: &[f64]| dynamics.mobility(&m.q, &phi, AddedInertia::Diagonal(added), rate).unwrap();
            let mut effort = still.clone();
            let with = |effort: &[f64]| {
                let added = AddedInertia::Diagonal(&diagonal);
                accelerations(&mechanism, (&m.q, &still), effort, added).unwrap()[rate]
            };
            let falls = with(&effort);
            effort[rate] = 1.0;
            let found = of(&diagonal);
            let wanted = with(&effort) - falls;
            assert!(
                (found / wanted - 1.0).abs() < 1e-9 * (1.0 + falls.abs() / wanted),
                "tree {seed}, rate {rate}"
            );
            // One more inertia at the rate itself (Sherman and Morrison 1950).
            let mut more = diagonal.clone();
            more[rate] += 0.7;
            assert!(
                (of(&more) / (found / (1.0 + 0.7 * found)) - 1.0).abs() < 1e-9,
                "tree {seed}, rate {rate}"
            );
        }
    }
}

#[test]
fn coupled_joints_follow_their_leaders() {
    for seed in 0..TREES {
        let mut d = tree(6, seed);
        let single: Vec<usize> = (0..6).filter(|k| d.joints[*k].kind != JointKind::Floating).collect();
        if single.len() < 4 {
            continue;
        }
        let leader = format!("j{}", single[2] + 1);
        d.joints[single[1]].mimic = Some(Mimic { of: leader, ratio: -0.5, offset: 0.3 });
        d.couple_mimics = true;
        let mechanism = d.build().unwrap();
        let m = motion(&mechanism, seed);
        let effort = effort(&mechanism, &m);
        let (diagonal, _) = added_inertia(mechanism.rates(), seed);
        let loaded: Vec<f64> =
            effort.iter().zip(diagonal.iter().zip(&m.ddq)).map(|(e, (d, a))| e + d * a).collect();
        let found =
            accelerations(&mechanism, (&m.q, &m.dq), &loaded, AddedInertia::Diagonal(&diagonal)).unwrap();
        check_close(&found, &m.ddq, 1e-10 * largest(&m.ddq), &format!("tree {seed}"));
    }
}

/// Over dual numbers: `∂q̈ = M⁻¹ (∂τ - ∂ID)` with the derivative of inverse dynamics along the same direction.
#[test]
fn dual_numbers_carry_the_derivative_of_the_acceleration() {
    for (seed, mechanism) in trees() {
        let (n, m, along) = (mechanism.rates(), motion(&mechanism, seed), motion(&mechanism, seed + 1000));
        let (dynamics, phi) = (Dynamics::new(&mechanism), mechanism.inertia_vector());
        let dual = |v: &[f64], d: &[f64]| -> Vec<Dual<1>> {
            v.iter().zip(d).map(|(v, d)| Dual { value: *v, derivative: [*d] }).collect()
        };
        let (q, dq, phi_dual) =
            (dual(&m.q, &along.q), dual(&m.dq, &along.dq), dual(&phi, &vec![0.0; phi.len()]));
        let still = vec![0.0; n];
        let mut effort_of_motion = vec![Dual { value: 0.0, derivative: [0.0] }; n];
        let state = State { q: &q, dq: &dq, ddq: &dual(&m.ddq, &still), gravity: None };
        dynamics.inverse_dynamics(&state, &phi_dual, &mut dynamics.workspace(), &mut effort_of_motion);

        let values: Vec<f64> = effort_of_motion.iter().map(|e| e.value).collect();
        let state = LoadedState { q: &q, dq: &dq, effort: &dual(&values, &along.ddq), gravity: None };
        let mut found = vec![Dual { value: 0.0, derivative: [0.0] }; n];
        let mut work = dynamics.forward_workspace();
        dynamics.forward_dynamics(&state, &phi_dual, AddedInertia::None, &mut work, &mut found).unwrap();

        let mass = dynamics.mass_matrix(&m.q, &phi, &mut dynamics.workspace());
        let scale = largest(&mass) * found.iter().fold(0.0, |s: f64, a| s.max(a.derivative[0].abs()));
        let product: Vec<f64> = mass
            .chunks_exact(n)
            .map(|row| row.iter().zip(&found).map(|(m, a)| m * a.derivative[0]).sum())
            .collect();
        let expected: Vec<f64> =
            along.ddq.iter().zip(&effort_of_motion).map(|(t, e)| t - e.derivative[0]).collect();
        let tolerance = 1e-11 * (scale + largest(&expected));
        check_close(&product, &expected, tolerance, &format!("tree {seed}"));
    }
}

#[test]
fn a_joint_without_inertia_is_named() {
    let mut d = tree(3, 5);
    d.joints.iter_mut().for_each(|j| j.kind = JointKind::Revolute);
    d.links[3].inertia = None;
    d.joints[2].parent = "l2".into();
    let mechanism = d.build().unwrap();
    let m = motion(&mechanism, 1);
    let of = |added| accelerations(&mechanism, (&m.q, &m.dq), &[1.0; 3], added);
    assert_eq!(of(AddedInertia::None), Err(NotPositive { rate: 2 }));
    assert_eq!(of(AddedInertia::Full(&[0.0; 9])), Err(NotPositive { rate: 2 }));
    assert!(of(AddedInertia::Diagonal(&[0.0, 0.0, 0.1])).is_ok());
}
