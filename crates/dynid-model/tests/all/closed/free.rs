//! Conditions and free motions where coordinates need not be closed, and finite displacements.

use dynid_model::closed::{ClosedDynamics, ClosedMechanism};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{Parts, robot, spec};
use crate::golden::check_close;

fn product(rows: &[f64], x: &[f64]) -> Vec<f64> {
    rows.chunks_exact(x.len()).map(|r| r.iter().zip(x).map(|(a, b)| a * b).sum()).collect()
}

fn near_home(machine: &ClosedMechanism, spread: f64, seed: u64) -> (Vec<f64>, Vec<f64>) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut draw = |scale: f64| -> Vec<f64> {
        machine.rate_scales().iter().map(|s| scale / s * rng.random_range(-1.0..1.0)).collect()
    };
    let (step, dq) = (draw(spread), draw(1.0));
    let mut q = machine.home().to_vec();
    machine.displace(&mut q, &step);
    (q, dq)
}

#[test]
fn free_motions_are_all_that_the_conditions_allow() {
    for (name, variant) in [
        ("fourbar", None),
        ("fourbar", Some("spatial")),
        ("fivebar", None),
        ("delta", None),
        ("stewart", None),
    ] {
        let Some(file) = spec(&format!("robots/{name}.json")) else { return };
        let machine = Parts::new(&file, variant).close();
        let (n, d) = (machine.mechanism().rates(), machine.mobility());
        let mut free = machine.free_motions();
        for (spread, seed) in [(0.0, 1), (0.03, 2), (0.1, 3)] {
            let (q, dq) = near_home(&machine, spread, seed);
            machine.free_at(&mut free, &q);
            for k in 0..d {
                let column: Vec<f64> = (0..n).map(|r| free.basis()[r * d + k]).collect();
                // Off the manifold rows that repeat each other on it need not.
                let determined = machine.is_determined();
                for (row, x) in product(free.jacobian(), &column).iter().enumerate() {
                    assert!(x.abs() < 1e-13 || !determined[row], "{name}: J Z = {x:e}");
                }
                for other in 0..d {
                    let dot: f64 = (0..n)
                        .map(|r| column[r] * free.basis()[r * d + other] * machine.rate_scales()[r].powi(2))
                        .sum();
                    assert!((dot - f64::from(u8::from(other == k))).abs() < 1e-13);
                }
            }
            machine.bias_at(&mut free, &dq);
            let mut x = vec![0.0; n];
            free.shortest(&product(free.jacobian(), &dq), &mut x);
            let (image, back) = (product(free.jacobian(), &dq), product(free.jacobian(), &x));
            check_close(&back, &image, 1e-13, 1e-12, &format!("{name}: J x"));
            let multipliers: Vec<f64> = (0..machine.conditions()).map(|k| 1.0 + k as f64).collect();
            let effort: Vec<f64> = (0..n)
                .map(|r| multipliers.iter().enumerate().map(|(k, l)| free.jacobian()[k * n + r] * l).sum())
                .collect();
            let mut found = vec![0.0; multipliers.len()];
            free.multipliers(&effort, &mut found);
            for ((f, e), determined) in found.iter().zip(&multipliers).zip(machine.is_determined()) {
                assert!(!determined || (f - e).abs() < 1e-9 * e, "{name}: multipliers {f} {e}");
            }
        }
    }
}

/// Residuals and their rates along a path of displacements, off the closed poses.
#[test]
fn jacobian_and_bias_are_derivatives_off_closed_poses() {
    for name in ["fivebar", "delta", "stewart"] {
        let Some(parts) = robot(name) else { return };
        let machine = parts.close();
        let n = machine.mechanism().rates();
        let (q, dq) = near_home(&machine, 0.1, 7);
        let mut free = machine.free_motions();
        // A path with constant rates: displacements by steps much shorter than what differences resolve.
        let h = 1e-4;
        let mut residual = Vec::new();
        for sign in [-1.0, 0.0, 1.0] {
            let mut at = q.clone();
            for _ in 0..64 {
                machine.displace(&mut at, &dq.iter().map(|v| sign * v * h / 64.0).collect::<Vec<_>>());
            }
            machine.free_at(&mut free, &at);
            residual.push(free.residual().to_vec());
        }
        machine.free_at(&mut free, &q);
        machine.bias_at(&mut free, &dq);
        let first: Vec<f64> =
            residual[2].iter().zip(&residual[0]).map(|(a, b)| (a - b) / (2.0 * h)).collect();
        check_close(&first, &product(free.jacobian(), &dq), 1e-6, 0.0, &format!("{name}: rates"));
        assert_eq!(free.jacobian().len(), n * machine.conditions());
        let rates = |sign: f64| {
            let mut at = q.clone();
            for _ in 0..64 {
                machine.displace(&mut at, &dq.iter().map(|v| sign * v * h / 64.0).collect::<Vec<_>>());
            }
            let mut free = machine.free_motions();
            machine.free_at(&mut free, &at);
            product(free.jacobian(), &dq)
        };
        let second: Vec<f64> = rates(1.0).iter().zip(rates(-1.0)).map(|(a, b)| (a - b) / (2.0 * h)).collect();
        check_close(&second, free.bias(), 2e-4, 0.0, &format!("{name}: bias"));
    }
}

/// On closed poses `Z` spans what the velocity map of the drives spans.
#[test]
fn free_motions_are_those_of_the_drives() {
    for name in ["fourbar", "fivebar", "delta", "stewart"] {
        let Some(parts) = robot(name) else { return };
        let machine = parts.close();
        let d = machine.mobility();
        let mut dynamics = ClosedDynamics::new(machine.clone());
        let rates: Vec<f64> = (0..d).map(|k| 0.3 + 0.1 * k as f64).collect();
        let (dq, _) = dynamics.motion(&rates, &vec![0.0; d]);
        let free = machine.free_motions();
        let along: Vec<f64> = (0..d)
            .map(|k| {
                dq.iter()
                    .enumerate()
                    .map(|(r, v)| v * free.basis()[r * d + k] * machine.rate_scales()[r].powi(2))
                    .sum()
            })
            .collect();
        check_close(&product(free.basis(), &along), &dq, 1e-13, 1e-11, name);
    }
}
