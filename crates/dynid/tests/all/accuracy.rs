//! Accuracy against the clean truth of simulated closed-loop logs, from robot file and log alone.
//!
//! Metric M2 of the data's README: RMS over joints of (RMS of true effort minus prediction at the true states where
//! |dq| > 0.02) relative to the RMS of the true effort.

#![expect(clippy::unwrap_used, clippy::print_stdout, reason = "a test may stop, and says what it measured")]

use crate::support::{data, run};
use dynid::estimators::conditioning::ShapeKind;
use dynid::io::{ReadOptions, csv};
use dynid::model::EffortModel;
use dynid::predict::efforts;

struct Found {
    fourier: f64,
    p2p: f64,
    delay: f64,
    /// Kinds of friction shapes, joint after joint.
    shapes: Vec<ShapeKind>,
}

fn identify(log: &str) -> Option<Found> {
    let text = r#"
robot = "{data}/oracles/logs/{log}/nominal.urdf"
[[log]]
path = "{data}/oracles/logs/{log}/train.csv.gz"
"#;
    let (_, id) = run(&text.replace("{log}", log))?;
    let m2 = |name: &str| {
        let path = data().unwrap().join(format!("oracles/logs/{log}/{name}_clean.csv.gz"));
        let table = csv::read(&path, &ReadOptions::default()).unwrap();
        let joints = id.robot.state_joints();
        let states = dynid::io::states::from_table(&table, &joints).unwrap();
        let (model, values) = id.identified_model();
        let predicted = efforts(model, values, &states).unwrap();
        let mut sum = 0.0;
        for (j, predicted) in predicted.iter().enumerate() {
            let truth = table.column(&format!("tau{}", j + 1)).unwrap();
            let moving: Vec<usize> =
                (0..table.rows).filter(|s| states.velocity[j][*s].abs() > 0.02).collect();
            let error =
                moving.iter().map(|s| (truth[*s] - predicted[*s]).powi(2)).sum::<f64>() / moving.len() as f64;
            let scale = truth.iter().map(|t| t * t).sum::<f64>() / table.rows as f64;
            sum += error / scale;
        }
        (sum / id.model.outputs().len() as f64).sqrt()
    };
    let shapes = id.friction.iter().flat_map(|j| j.accepted.iter().map(|t| t.shape.kind)).collect();
    let found = Found { fourier: m2("valid_fourier"), p2p: m2("valid_p2p"), delay: id.delay_samples, shapes };
    println!("{log}: M2 {:.6} / {:.6}, delay {:.3}", found.fourier, found.p2p, found.delay);
    Some(found)
}

#[test]
fn ur5_500_hz() {
    let Some(found) = identify("ur5_dev") else { return };
    assert!(found.fourier <= 1.3 * 0.00095 && found.p2p <= 1.3 * 0.00102);
    assert!((found.delay - 0.5).abs() <= 0.1);
    assert_eq!(found.shapes, []);
}

#[test]
fn ur5_1000_hz() {
    let Some(found) = identify("ur5_1k") else { return };
    assert!(found.fourier <= 1.3 * 0.00027 && found.p2p <= 1.3 * 0.00030);
    assert!((found.delay - 0.5).abs() <= 0.1);
    assert_eq!(found.shapes, []);
}

/// Stribeck friction in the log, linear friction in the robot file.
#[test]
fn iiwa_250_hz() {
    let Some(found) = identify("iiwa_250") else { return };
    assert!(found.fourier <= 1.5 * 0.0060 && found.p2p <= 1.5 * 0.0068);
    assert!((found.delay - 1.5).abs() <= 0.1);
    assert_eq!(found.shapes, [ShapeKind::Stribeck; 7]);
}
