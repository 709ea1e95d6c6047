//! Ordinary and weighted least squares of the Indy7 against golden numbers, through the effort model and the reduction.

#![expect(clippy::unwrap_used, reason = "a test may stop")]

use std::path::PathBuf;

use dynid::estimators::linear::{WlsSettings, ols, wls};
use dynid::estimators::{Factor, FactorBuilder};
use dynid::model::element::{Coulomb, JointElement, Offset, RotorInertia, Viscous};
use dynid::model::{BaseParameters, BaseSettings, EffortModel, MotionBlock, RegressorBlock, RobotModel};
use dynid_testing::golden;
use serde_json::Value;

fn matrix(value: &Value) -> Vec<Vec<f64>> {
    let row = |r: &Value| r.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect();
    value.as_array().unwrap().iter().map(row).collect()
}

#[test]
fn indy7_least_squares() {
    let Some(g) = golden("indy7_least_squares.json") else { return };
    let Some(base_golden) = golden("indy7_base.json") else { return };
    let robot = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../robots/indy7.toml");
    let mechanism = dynid::Robot::load(&robot, &dynid::RobotOptions::default()).unwrap().mechanism;
    let mut elements: Vec<Box<dyn JointElement>> = Vec::new();
    for rate in 0..6 {
        elements.push(Box::new(RotorInertia { rate }));
        elements.push(Box::new(Coulomb { rate }));
        elements.push(Box::new(Viscous { rate }));
        elements.push(Box::new(Offset { rate }));
    }
    let model = RobotModel::new(mechanism, elements);
    let base = BaseParameters::of(&model, model.mechanism(), &[], &BaseSettings::default());
    assert_eq!(base.len(), 58);
    let table = &model.parameters().linear;
    // Golden order: 40 inertial ones, then the 6 Coulomb, 6 viscous and 6 offset columns.
    let mut order: Vec<String> = base_golden["independent"]
        .as_array()
        .unwrap()
        .iter()
        .map(|s| s.as_str().unwrap().to_owned())
        .collect();
    for symbol in ["fc", "fv", "fo"] {
        order.extend((1..=6).map(|j| format!("{symbol}{j}")));
    }
    let position = |symbol: &String| base.kept.iter().position(|c| table[*c].symbol == *symbol).unwrap();
    let order: Vec<usize> = order.iter().map(position).collect();

    let flat = |key: &str| -> Vec<f64> {
        let rows = matrix(&g[key]);
        (0..6).flat_map(|j| rows.iter().map(move |r| r[j]).collect::<Vec<_>>()).collect()
    };
    let (q, dq, ddq, tau) = (flat("q"), flat("qd"), flat("qdd"), flat("tau"));
    let n = q.len() / 6;
    let motion = MotionBlock::plain(n, &q, &dq, &ddq);
    let mut block = RegressorBlock::new(model.layout().clone(), n);
    model.regressor(&motion, &[], &mut block);
    let factors: Vec<Factor> = (0..6)
        .map(|output| {
            let mut builder = FactorBuilder::new(base.len());
            for s in 0..n {
                let mut row = vec![0.0; base.len()];
                for (k, column) in model.layout().columns(output).iter().enumerate() {
                    if let Ok(i) = base.kept.binary_search(column) {
                        row[i] = block.column(output, k)[s];
                    }
                }
                builder.push_row(&row, tau[output * n + s]).unwrap();
            }
            builder.finish()
        })
        .collect();
    let golden =
        |key: &str| -> Vec<f64> { g[key].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect() };
    let check = |x: &[f64], expected: &[f64], what: &str| {
        let scale = expected.iter().fold(0.0_f64, |m, e| m.max(e.abs()));
        for (k, (i, e)) in order.iter().zip(expected).enumerate() {
            assert!((x[*i] - e).abs() <= 1e-7 * scale, "{what}[{k}]: {} against {e}", x[*i]);
        }
    };
    let merged = Factor::merge(&factors.iter().collect::<Vec<_>>());
    let plain = ols(&merged);
    check(&plain.x, &golden("ols"), "ols");
    let rss = g["ols_rss"].as_f64().unwrap();
    assert!((plain.rss / rss - 1.0).abs() < 1e-7);
    let condition = g["cond_W"].as_f64().unwrap();
    assert!((plain.condition / condition - 1.0).abs() < 1e-6, "{} {condition}", plain.condition);

    // The golden estimate reweights once, with sigma_i² = rss_i / (M - 58/6) of the unweighted solution.
    let weighted: Vec<Factor> =
        factors.iter().map(|f| f.scaled(1.0 / (f.rss(&plain.x) / (n as f64 - 58.0 / 6.0)).sqrt())).collect();
    let once = ols(&Factor::merge(&weighted.iter().collect::<Vec<_>>()));
    check(&once.x, &golden("wls"), "wls");

    // Iterated to convergence it stays near: the same variances to a few per cent.
    let iterated = wls(&factors, &WlsSettings::default());
    assert!(iterated.converged);
    let difference: f64 = iterated.solution.x.iter().zip(&once.x).map(|(a, b)| (a - b).powi(2)).sum();
    assert!(difference.sqrt() < 0.05, "{difference}");
}
