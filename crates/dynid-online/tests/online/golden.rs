//! `estimation_rls.json`, `hit_forgetting.json`, `hit_rls.json`.

use crate::stream::{check_close, plain};
use dynid_online::{
    BlockWindow, Estimator, Forgetting, RowNoise, RowWindow, SquareRoot, average_run_length, cusum_threshold,
    error_driven_factor,
};
use dynid_testing::golden as load;
use serde_json::Value;

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

fn vector(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(number).collect()
}

fn matrix(value: &Value) -> Vec<Vec<f64>> {
    value.as_array().unwrap().iter().map(vector).collect()
}

fn information(root: &SquareRoot) -> Vec<f64> {
    let p = root.columns();
    let entry = |i: usize, j: usize| (0..p).map(|k| root.r(k, i) * root.r(k, j)).sum();
    (0..p * p).map(|k| entry(k / p, k % p)).collect()
}

#[test]
fn recursive_estimates_match() {
    let Some(g) = load("estimation_rls.json") else { return };
    let phi: Vec<Vec<f64>> =
        g["Phi"].as_array().unwrap().iter().map(|sample| matrix(sample).concat()).collect();
    let effort = matrix(&g["y"]);
    let tolerance = number(&g["tolerance_rel"]);
    let lambda = g["lambda"]["lambda"].as_f64().unwrap_or(0.95);
    let cases = [
        ("lambda", Forgetting::Constant { lambda }),
        ("directional", Forgetting::Directional { lambda, tolerance: 1e-6 }),
    ];
    for (name, forgetting) in cases {
        let mut estimator = Estimator::new(plain(3, 2, forgetting)).unwrap();
        for (k, expected) in matrix(&g[name]["x"]).iter().enumerate() {
            let rows = if name == "directional" && k >= 20 { 1 } else { 2 };
            let std = [0.1, 0.1];
            estimator.step(&phi[k][..3 * rows], &effort[k][..rows], RowNoise::Std(&std[..rows])).unwrap();
            check_close(&format!("{name} {k}"), estimator.x(), expected, tolerance);
        }
        let expected = matrix(&g[name]["information"]).concat();
        check_close(name, &information(estimator.information()), &expected, tolerance);
    }
}

#[test]
fn windows_match() {
    let Some(g) = load("estimation_rls.json") else { return };
    let phi: Vec<Vec<Vec<f64>>> = g["Phi"].as_array().unwrap().iter().map(matrix).collect();
    let effort = matrix(&g["y"]);
    let expected = matrix(&g["window_5"]);
    let mut blocks = BlockWindow::new(SquareRoot::new(3), 1, 5, 2);
    let mut rows = RowWindow::new(SquareRoot::new(3), 1, 5, 2);
    for (k, (phi, effort)) in phi.iter().zip(&effort).enumerate() {
        let both: Vec<f64> =
            phi.iter().zip(effort).flat_map(|(f, y)| [f[0], f[1], f[2], *y].map(|v| v / 0.1)).collect();
        blocks.push(&both);
        rows.push(&both);
        if k >= 5 {
            for total in [blocks.total(), rows.total()] {
                let mut x = [0.0; 3];
                assert!(total.solve(&mut x));
                check_close(&format!("window {k}"), &x, &expected[k - 5], 1e-8);
            }
        }
    }
}

#[test]
fn thresholds_match() {
    let Some(g) = load("estimation_rls.json") else { return };
    for case in g["cusum"].as_array().unwrap() {
        let (m, kappa, arl) =
            (case["m"].as_u64().unwrap() as usize, number(&case["kappa"]), number(&case["arl"]));
        let h = cusum_threshold(m, kappa, arl);
        let expected = number(&case["h"]);
        println!("m {m} kappa {kappa} arl {arl}: h {h} against {expected}");
        assert!((h / expected - 1.0).abs() < 0.01, "{h} against {expected}");
        assert!((average_run_length(m, kappa, h) / arl - 1.0).abs() < 1e-5);
    }
}

#[test]
fn published_forgetting_matches() {
    let Some(g) = load("hit_forgetting.json") else { return };
    let (alpha, beta) = (number(&g["alpha"]), number(&g["beta"]));
    for (error, expected) in vector(&g["relative_error"]).iter().zip(vector(&g["lam"])) {
        assert!((error_driven_factor(*error, alpha, beta) - expected).abs() <= number(&g["tolerance_abs"]));
    }
}

/// The two recursions of `hit_rls.json` carried out with 60 digits, after steps 10, 30 and 59.
const VARIABLE: [[f64; 6]; 3] = [
    [
        431455.73097501264,
        125721639368.42198,
        0.03561925149678492,
        0.04781203204156215,
        466.603920683173,
        60.7926947795604,
    ],
    [
        381662.1825186764,
        136786294599.03531,
        0.03532907418004956,
        0.17204593572092486,
        541.3052117358046,
        22.138347657540375,
    ],
    [
        398362.8289730935,
        133298259196.91243,
        0.034458333267643464,
        0.13440774033722092,
        611.671723992411,
        32.998446479504736,
    ],
];
const CONSTANT: [[f64; 6]; 3] = [
    [
        431512.0129293524,
        125701273413.25473,
        0.03562634651747082,
        0.04761496443628625,
        466.6201030175144,
        60.81964422959215,
    ],
    [
        381751.61242811946,
        136758861010.27922,
        0.03532913854615028,
        0.17185426748269164,
        541.4216416634594,
        22.1875821805476,
    ],
    [
        398395.4697079509,
        133286028076.31277,
        0.034459663652616546,
        0.13434112228598916,
        611.6192772221364,
        33.01539083075992,
    ],
];

/// The reference file comes from the covariance recursion in double precision, which starts at `P = 1e6` and
/// sees rows of squared size 4e5 (parameters in units): its own rounding is `ε P φ² = 9e-5`. The square root
/// is held to 1e-11 against exact arithmetic.
#[test]
fn harmonic_drive_sequences_match() {
    let Some(g) = load("hit_rls.json") else { return };
    let units = vector(&g["units"]);
    let (alpha, beta, floor) = (number(&g["alpha"]), number(&g["beta"]), number(&g["floor"]));
    let ratio = 290.0;
    let cases = [
        ("variable", Forgetting::ErrorDriven { alpha, beta, floor }, VARIABLE),
        ("lambda_1", Forgetting::None, CONSTANT),
    ];
    for (name, forgetting, exact) in cases {
        let mut settings = plain(6, 2, forgetting);
        settings.scale.clone_from(&units);
        settings.prior_std = units.iter().map(|u| 1e3 * u).collect();
        let mut estimator = Estimator::new(settings).unwrap();
        let rows = g["rows"].as_array().unwrap();
        for (k, (row, expected)) in rows.iter().zip(g[name].as_array().unwrap()).enumerate() {
            let value = |key: &str| number(&row[key]);
            let (d, motor, joint) = (value("dtheta"), value("theta_in_d"), value("theta_out_d"));
            let phi = [
                [d, d.powi(3), ratio * motor, ratio * motor.signum(), 0.0, 0.0],
                [d, d.powi(3), 0.0, 0.0, -joint, -joint.signum()],
            ];
            let step = estimator
                .step(phi.as_flattened(), &[value("y1"), value("y2")], RowNoise::Std(&[1.0, 1.0]))
                .unwrap();
            if k >= g["compare_from_step"].as_u64().unwrap() as usize {
                assert!((step.lambda - number(&expected["lam"])).abs() < 1e-6, "{name} {k}");
                check_close(&format!("{name} {k}"), estimator.x(), &vector(&expected["theta"]), 9e-5);
            }
            if let Some(place) = [10, 30, 59].iter().position(|step| *step == k) {
                check_close(&format!("{name} {k}"), estimator.x(), &exact[place], 1e-11);
            }
        }
    }
}
