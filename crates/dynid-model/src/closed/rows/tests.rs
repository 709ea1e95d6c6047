//! Jacobian and bias against time derivatives that are carried through the residuals.

use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;
use crate::description::{Description, JointDescription, JointKind, Limits, LinkDescription};
use dynid_algebra::scalar::Jet;
use dynid_algebra::spatial::Placement;

fn numbers<const N: usize>(rng: &mut impl Rng) -> [f64; N] {
    std::array::from_fn(|_| rng.random_range(-1.0..=1.0))
}

fn placement(rng: &mut impl Rng) -> Placement {
    Placement::from_xyz_rpy(numbers(rng), numbers::<3>(rng).map(|x| 3.0 * x))
}

/// Joints of all kinds on any link before them; joint `k` moves link `l<k>`.
fn tree(joints: usize, rng: &mut impl Rng) -> Mechanism {
    let mut d = Description::new("tree");
    d.links.push(LinkDescription { name: "l0".into(), inertia: None });
    for k in 1..=joints {
        let axis = match rng.random_range(0..3) {
            0 => numbers(rng),
            axis => std::array::from_fn(|i| if i == axis { -1.0 } else { 0.0 }),
        };
        d.links.push(LinkDescription { name: format!("l{k}"), inertia: None });
        d.joints.push(JointDescription {
            name: format!("j{k}"),
            parent: format!("l{}", if rng.random_bool(0.6) { k - 1 } else { rng.random_range(0..k) }),
            child: format!("l{k}"),
            kind: match rng.random_range(0..6) {
                0 | 1 => JointKind::Revolute,
                2 => JointKind::Continuous,
                3 => JointKind::Prismatic,
                4 => JointKind::Helical { pitch: numbers::<1>(rng)[0] },
                _ => JointKind::Floating,
            },
            placement: placement(rng),
            axis,
            limits: Limits::default(),
            mimic: None,
        });
    }
    d.build().unwrap()
}

/// Positions with their first two derivatives, at given rates and accelerations.
fn jets(mechanism: &Mechanism, q: &[f64], dq: &[f64], ddq: &[f64]) -> Vec<Jet> {
    let mut out = vec![Jet::default(); q.len()];
    for body in mechanism.bodies() {
        let (position, rate) = (body.position, body.rate);
        if body.joint.kind != JointKind::Floating {
            out[position] = Jet::new([q[position], dq[rate], ddq[rate]]);
            continue;
        }
        let of = |x: &[f64]| {
            [Vec3([x[rate], x[rate + 1], x[rate + 2]]), Vec3([x[rate + 3], x[rate + 4], x[rate + 5]])]
        };
        let ([v, omega], [dv, domega]) = (of(dq), of(ddq));
        let quaternion: [f64; 4] = std::array::from_fn(|k| q[position + 3 + k]);
        let first = half_product(quaternion, omega);
        let (turned, bent) = (half_product(first, omega), half_product(quaternion, domega));
        for k in 0..4 {
            out[position + 3 + k] = Jet::new([quaternion[k], first[k], turned[k] + bent[k]]);
        }
        let (velocity, acceleration) = (rotated(quaternion, v), rotated(quaternion, omega.cross(v) + dv));
        for k in 0..3 {
            out[position + k] = Jet::new([q[position + k], velocity.0[k], acceleration.0[k]]);
        }
    }
    out
}

/// `½ p ⊗ (ω, 0)`.
fn half_product([x, y, z, w]: [f64; 4], omega: Vec3<f64>) -> [f64; 4] {
    let v = Vec3([x, y, z]);
    let vector = (omega.scale(w) + v.cross(omega)).scale(0.5).0;
    [vector[0], vector[1], vector[2], -0.5 * v.dot(omega)]
}

fn rotated([x, y, z, w]: [f64; 4], v: Vec3<f64>) -> Vec3<f64> {
    let u = Vec3([x, y, z]);
    let t = u.cross(v).scale(2.0);
    v + t.scale(w) + u.cross(t)
}

fn closure(
    kind: Option<CutKind>,
    joints: usize,
    mechanism: &Mechanism,
    rng: &mut impl Rng,
) -> ClosureDescription {
    let condition = match kind {
        Some(kind) => {
            let a = rng.random_range(0..=joints);
            let b = (a + rng.random_range(1..=joints)) % (joints + 1);
            let mut end = |k: usize| LinkFrame { link: format!("l{k}"), placement: placement(rng) };
            Condition::Joint { kind, a: end(a), b: end(b) }
        }
        None => {
            let single = mechanism.bodies().iter().filter(|b| b.joint.rates() == 1);
            let terms = single.map(|b| (b.joint.name.clone(), numbers::<1>(rng)[0])).collect();
            Condition::Coordinates { terms, constant: 0.3 }
        }
    };
    ClosureDescription { name: "c".into(), condition }
}

#[test]
fn jacobian_and_bias_are_derivatives_of_the_residuals_on_and_off_the_manifold() {
    let kinds = [
        Some(CutKind::Spherical),
        Some(CutKind::PlanarRevolute),
        Some(CutKind::Revolute),
        Some(CutKind::Universal),
        Some(CutKind::Cylindrical),
        Some(CutKind::Prismatic),
        Some(CutKind::PlanarPrismatic),
        Some(CutKind::Fixed),
        Some(CutKind::Distance { length: 0.7 }),
        None,
    ];
    let mut worst = [0.0_f64; 2];
    for kind in kinds {
        for seed in 0..100 {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let rng = &mut rng;
            let joints = rng.random_range(1..8);
            let mechanism = tree(joints, rng);
            if kind.is_none() && mechanism.bodies().iter().all(|b| b.joint.rates() > 1) {
                continue;
            }
            let tree = Tree::new(&mechanism);
            let closures = [closure(kind, joints, &mechanism, rng)];
            let rows = Rows::new(&tree, &mechanism, &closures).unwrap();
            let (n, m) = (tree.rates, rows.len());
            assert_eq!(m, kind.map_or(1, CutKind::rows));

            let mut q: Vec<f64> = (0..tree.positions).map(|_| 2.0 * numbers::<1>(rng)[0]).collect();
            for body in mechanism.bodies().iter().filter(|b| b.joint.rates() == 6) {
                let quaternion = &mut q[body.position + 3..body.position + 7];
                let norm = quaternion.iter().map(|x| x * x).sum::<f64>().sqrt();
                quaternion.iter_mut().for_each(|x| *x /= norm);
            }
            let [dq, ddq] = [2.0, 5.0].map(|s| (0..n).map(|_| s * numbers::<1>(rng)[0]).collect::<Vec<_>>());

            let moving = jets(&mechanism, &q, &dq, &ddq);
            let mut world = World::<Jet>::new(&tree);
            world.place(&tree, &moving);
            let (mut jet, mut unused) = (vec![Jet::default(); m], vec![Jet::default(); m * n]);
            rows.evaluate(&world, &moving, &mut jet, &mut unused);

            let mut world = World::<f64>::new(&tree);
            world.place(&tree, &q);
            let (mut residual, mut jacobian, mut bias) = (vec![0.0; m], vec![0.0; m * n], vec![0.0; m]);
            rows.evaluate(&world, &q, &mut residual, &mut jacobian);
            world.drift(&tree, &dq);
            rows.bias(&world, &mut bias);
            for row in 0..m {
                let entries = &jacobian[row * n..(row + 1) * n];
                let terms = |x: &[f64]| entries.iter().zip(x).map(|(j, x)| j * x).collect::<Vec<_>>();
                let largest = |terms: &[f64]| terms.iter().fold(1.0_f64, |m, x| m.max(x.abs()));
                let (by_rates, by_accelerations) = (terms(&dq), terms(&ddq));
                let [value, first, second] = jet[row].derivatives();
                assert!((value - residual[row]).abs() <= 1e-13 * largest(&[value]), "{kind:?} {seed}");
                let fault = (by_rates.iter().sum::<f64>() - first).abs() / largest(&by_rates);
                worst[0] = worst[0].max(fault);
                // Products of rates are what the bias is made of.
                let size = largest(&by_accelerations).max(bias[row].abs()).max(largest(&by_rates).powi(2));
                let fault_2 = (by_accelerations.iter().sum::<f64>() + bias[row] - second).abs() / size;
                worst[1] = worst[1].max(fault_2);
                assert!(fault < 1e-12 && fault_2 < 1e-12, "{kind:?} {seed} row {row}: {fault:e} {fault_2:e}");
            }
        }
    }
    println!("first {:.1e}, second {:.1e}", worst[0], worst[1]);
}
