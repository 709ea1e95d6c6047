//! Published trajectories under the limits of their robots.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use crate::problems;
use crate::support::*;
use dynid_excitation::criterion::{Criterion, Measure};
use dynid_excitation::*;

fn condition(problem: &Problem, coefficients: &[Vec<f64>], samples: usize) -> f64 {
    let triangle = information(problem, coefficients, samples);
    Criterion::raw(Measure::Condition).value(&triangle).unwrap().exp()
}

fn close(found: f64, wanted: f64) {
    assert!((found / wanted - 1.0).abs() <= 1e-6, "{found} against {wanted}");
}

#[test]
fn indy7_reference() {
    let Some(golden) = reference("golden/indy7_trajectory.json") else { return };
    let problem = problems::indy7(false).unwrap();
    // Velocity amplitudes.
    let plain = |row: Vec<f64>| -> Vec<f64> {
        let rate = |k: usize| problem.base * ((k - 1) % 5 + 1) as f64;
        let sign = |k: usize| if k > 5 { -1.0 } else { 1.0 };
        let scaled = |(k, x): (usize, f64)| if k == 0 { x } else { sign(k) * x / rate(k) };
        row.into_iter().enumerate().map(scaled).collect()
    };
    let coefficients: Vec<Vec<f64>> = rows(&golden["coefficients"]).into_iter().map(plain).collect();
    close(condition(&problem, &coefficients, 1000), golden["cond_W_58"].as_f64().unwrap());
    // Within all its limits, distances included.
    let broken = limit_points(&problem, &coefficients, 10_000, 1e-4);
    assert!(broken.is_empty(), "{broken:?}");
}

#[test]
fn er16_reference_and_the_published_table() {
    let Some(golden) = reference("golden/er16_trajectory.json") else { return };
    let problem = problems::er16(false).unwrap();
    let own = rows(&golden["reference"]["coefficients"]);
    close(condition(&problem, &own, 2000), golden["reference"]["cond_phi15"].as_f64().unwrap());
    let broken = limit_points(&problem, &own, 10_000, 1e-3);
    assert!(broken.is_empty(), "{broken:?}");

    let table = rows(&golden["appendix_a1"]);
    for case in golden["appendix_evaluations"].as_array().unwrap() {
        let order = case["order"].as_str().unwrap();
        let pick: Vec<usize> = match order {
            "q0,a1..a5,b1..b5" => (0..11).collect(),
            "a1..a5,b1..b5,q0" => std::iter::once(10).chain(0..10).collect(),
            "a1,b1,..,a5,b5,q0" => {
                std::iter::once(10).chain((0..5).map(|k| 2 * k)).chain((0..5).map(|k| 2 * k + 1)).collect()
            }
            "q0,a1,b1,..,a5,b5" => {
                std::iter::once(0).chain((0..5).map(|k| 2 * k + 1)).chain((1..=5).map(|k| 2 * k)).collect()
            }
            other => panic!("order {other}"),
        };
        let coefficients: Vec<Vec<f64>> =
            table.iter().map(|row| pick.iter().map(|k| row[*k]).collect()).collect();
        close(condition(&problem, &coefficients, 2000), case["cond_phi15"].as_f64().unwrap());
        // None of the readings keeps the limits: the excess is that of the golden extremes.
        let broken = limit_points(&problem, &coefficients, 2000, 0.0);
        for (kind, key) in
            [(LimitKind::Velocity, "max_abs_qd_deg"), (LimitKind::Acceleration, "max_abs_qdd_deg")]
        {
            for (joint, extreme) in numbers(&case[key]).into_iter().enumerate() {
                let limits = &problem.limits[joint];
                let limit = if kind == LimitKind::Velocity { limits.velocity } else { limits.acceleration };
                let excess = extreme.to_radians() / limit - 1.0;
                let name = format!("j{}", joint + 1);
                let found = broken.iter().find(|p| p.kind == kind && p.subject == name).map(|p| p.excess);
                match found {
                    Some(found) => assert!((found - excess).abs() < 1e-6, "{name}: {found} against {excess}"),
                    None => assert!(excess <= 1e-9, "{name} {kind} by {excess} is not told"),
                }
            }
        }
        assert!(broken.iter().any(|p| p.kind == LimitKind::Acceleration), "{order}: {broken:?}");
        println!("{order}:");
        broken.iter().for_each(|p| println!("    {} of {} by {:.1} %", p.kind, p.subject, 100.0 * p.excess));
    }
}
