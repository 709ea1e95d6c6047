//! The closed form of the three-slider mechanism, held to golden numbers, and its friction: rows B1, B3, B4, B6, B12 of
//! the acceptance table.
#![expect(clippy::unwrap_used, reason = "in tests a panic is the report")]

use crate::golden::{load, number, vector};
use crate::prr3_machine::{
    GRAVITY, Pose, TRAJECTORY, TRUTH, base_matrix, bounds, circle, efforts, experiment, inverse_kinematics,
    null_directions, record, reference, rows, sampled,
};
use dynid_friction::load_friction::{
    DriveRows, LoadFrictionError, Model, Problem, Record, Settings, Verdict, verdicts,
};
use dynid_linalg::Mat;
use serde_json::Value;

#[track_caller]
fn near(what: &str, found: f64, expected: f64, tolerance: &Value) {
    let allowed = number(&tolerance["abs"]) + number(&tolerance["rel"]) * expected.abs();
    assert!((found - expected).abs() <= allowed, "{what}: {found} against {expected}");
}

fn pose(state: &Value) -> Pose {
    let of = |key: &str| <[f64; 3]>::try_from(vector(&state[key])).unwrap();
    Pose { q: of("pose"), dq: of("pose_d"), ddq: of("pose_dd") }
}

fn times(rows: &[f64], phi: &[f64]) -> f64 {
    rows.iter().zip(phi).map(|(a, b)| a * b).sum()
}

#[test]
fn dynamics_are_those_of_the_golden_states() {
    let Some(golden) = load("prr3_inverse_dynamics.json") else { return };
    for state in golden["states"].as_array().unwrap() {
        let tolerance = &golden["tolerance"];
        let (pose, phi) = (pose(state), vector(&state["phi"]));
        let (all, kinematics) = (rows(&pose, number(&state["g"])), inverse_kinematics(&pose));
        for (key, found) in [("q", kinematics.q), ("qd", kinematics.dq), ("qdd", kinematics.ddq)] {
            vector(&state[key]).iter().zip(found).for_each(|(e, f)| near(key, f, *e, tolerance));
        }
        for (i, e) in vector(&state["tau_frictionless"]).iter().enumerate() {
            near("effort", times(&all.regressor[i], &phi), *e, tolerance);
        }
        for (i, e) in vector(&state["lambda_"]).iter().enumerate() {
            near("multiplier", times(&all.multipliers[i], &phi), *e, tolerance);
        }
        for (i, row) in state["regressor"].as_array().unwrap().iter().enumerate() {
            vector(row).iter().zip(all.regressor[i]).for_each(|(e, f)| near("regressor", f, *e, tolerance));
        }
    }
}

#[test]
fn the_reference_trajectory_is_the_golden_one() {
    let Some(golden) = load("prr3_trajectory.json") else { return };
    let tolerance = &golden["tolerance"];
    for (row, expected) in TRAJECTORY.iter().zip(golden["coefficients"].as_array().unwrap()) {
        assert_eq!(row.to_vec(), vector(expected));
    }
    let record = record(&sampled(reference, 400), 0.0);
    let clean = efforts(&record, 0.0, 0);
    for sample in golden["samples"].as_array().unwrap() {
        let t = number(&sample["t"]);
        let at = reference(t);
        let kinematics = inverse_kinematics(&at);
        vector(&sample["pose"]).iter().zip(at.q).for_each(|(e, f)| near("pose", f, *e, tolerance));
        for (i, clean) in clean.iter().enumerate() {
            near("slider", kinematics.q[i], vector(&sample["sliders"])[i], tolerance);
            near("speed", kinematics.dq[i], vector(&sample["slider_v"])[i], tolerance);
            // The first sample is at rest: its friction has no sign.
            if kinematics.dq[i].abs() < 1e-6 {
                continue;
            }
            let effort = clean[(t / 0.01).round() as usize];
            near("effort", effort, vector(&sample["tau"])[i], tolerance);
        }
    }
    // Friction is more than half of the force of every slider.
    let problem = Problem::new(record, &clean, Settings::default()).unwrap();
    for (i, drive) in problem.predict(&TRUTH).unwrap().drives.iter().enumerate() {
        let rms = |v: &[f64]| (v.iter().map(|x| x * x).sum::<f64>() / v.len() as f64).sqrt();
        let frictionless = vector(&golden["tau_frictionless_rms"])[i];
        assert!((rms(&drive.frictionless) - frictionless).abs() < 0.01 * frictionless);
        let share = rms(&drive.friction) / rms(&drive.effort);
        println!("slider {i}: friction {:.1} N, {share:.3} of the force", rms(&drive.friction));
        assert!(share > 0.5, "slider {i}: {share}");
    }
}

/// B3.
#[test]
fn friction_is_that_of_the_golden_states() {
    let Some(golden) = load("prr3_friction.json") else { return };
    let tolerance = &golden["tolerance"];
    assert_eq!(vector(&golden["theta"]), TRUTH);
    for state in golden["states"].as_array().unwrap() {
        let record = record(&[pose(state)], 0.0);
        let effort = vec![vec![0.0]; 3];
        for (model, key) in [(Model::Stribeck, "tau_stribeck"), (Model::CoulombViscous, "tau_cv")] {
            let settings = Settings { model, ..Settings::default() };
            let problem = Problem::new(record.clone(), &effort, settings).unwrap();
            for (i, drive) in problem.predict(&TRUTH).unwrap().drives.iter().enumerate() {
                near("frictionless", drive.frictionless[0], vector(&state["tau_frictionless"])[i], tolerance);
                near("normal force", drive.normal[0], vector(&state["normal_z"])[i].abs(), tolerance);
                near("weight", drive.constant_normal, vector(&state["normal_y"])[i], tolerance);
                near(key, drive.effort[0], vector(&state[key])[i], tolerance);
            }
        }
    }
}

/// B6.
#[test]
fn fifteen_of_seventeen_parameters_are_identifiable() {
    let record = record(&sampled(reference, 400), 0.0);
    for drive in record.drives() {
        for direction in null_directions() {
            for matrix in std::iter::once(&drive.regressor).chain(&drive.reactions) {
                for i in 0..matrix.nrows() {
                    let row: Vec<f64> = (0..13).map(|k| matrix[(i, k)]).collect();
                    assert!(times(&row, &direction).abs() < 1e-9, "row {i}");
                }
            }
        }
    }
    let clean = efforts(&record, 0.0, 0);
    let problem = Problem::new(record.clone(), &clean, Settings::default()).unwrap();
    let found = problem.identifiability(&TRUTH, None).unwrap();
    assert_eq!((found.rank, found.null_directions.ncols()), (15, 2));
    assert!(found.gap.unwrap() > 1e6, "gap {:?}", found.gap);
    let friction_alone = (0..17).map(|k| k >= 13).collect::<Vec<_>>();
    assert_eq!(found.determined, friction_alone);
    // Without friction nine remain.
    let no_friction: Vec<f64> = TRUTH[..13].iter().copied().chain([0.0, 0.0, 0.0, 0.02]).collect();
    let bare = record
        .drives()
        .iter()
        .map(|d| DriveRows { reactions: Vec::new(), weight: Vec::new(), ..d.clone() })
        .collect();
    let bare = Problem::new(Record::new(bare).unwrap(), &clean, Settings::default()).unwrap();
    let inertial = bare.identifiability(&no_friction, None).unwrap();
    assert_eq!(inertial.rank, 9 + 1, "nine inertial combinations and f_v");
    let base = inertial.combinations(&base_matrix()).unwrap();
    assert!(base.iter().all(|b| b.determined));

    let Some(golden) = load("prr3_identifiability.json") else { return };
    let tolerance = number(&golden["tolerance_rel"]);
    let expected = vector(&golden["relative_scaled_singular_values_17"]);
    for (k, (value, golden)) in found.singular_values.iter().zip(&expected).take(15).enumerate() {
        let share = value / golden - 1.0;
        println!("singular value {k}: {value:.5} ({:+.2} %)", 100.0 * share);
        assert!(share.abs() <= tolerance, "singular value {k}: {share}");
    }
    let base = found.combinations(&base_matrix()).unwrap();
    for (b, e) in base.iter().zip(vector(&golden["base_values_at_table1_estimates"])) {
        assert!(b.determined && (b.value - e).abs() < 1e-9, "{b:?} against {e}");
    }
}

#[test]
fn the_jacobian_is_the_derivative_of_the_efforts() {
    for model in [Model::Stribeck, Model::CoulombViscous, Model::Constant] {
        for (exponent, g) in [(1.0, 0.0), (1.7, GRAVITY)] {
            let record = record(&sampled(reference, 150), g);
            let zero = vec![vec![0.0; 150]; 3];
            let settings = Settings { model, exponent, ..Settings::default() };
            // Away from kinks: a step of the differences must not change a sign.
            let problem = Problem::new(record, &zero, settings).unwrap();
            let problem = problem.without_small_reactions(&TRUTH[..13], 0.01).unwrap();
            let exact = problem.jacobian(&TRUTH).unwrap();
            for k in 0..17 {
                let h = 1e-5 * TRUTH[k];
                let at = |sign: f64| {
                    let mut theta = TRUTH;
                    theta[k] += sign * h;
                    problem.residuals(&theta).unwrap()
                };
                let (up, down) = (at(1.0), at(-1.0));
                let size = (0..problem.rows()).map(|i| exact[(i, k)].abs()).fold(1.0, f64::max);
                for i in 0..problem.rows() {
                    let difference = (down[i] - up[i]) / (2.0 * h);
                    let off = (exact[(i, k)] - difference).abs();
                    assert!(
                        off < 1e-6 * size,
                        "{model:?}, row {i}, column {k}: {} {difference}",
                        exact[(i, k)]
                    );
                }
            }
        }
    }
}

#[test]
fn samples_at_rest_and_at_kinks_are_left_out() {
    let problem = experiment(Model::Stribeck, 0.0, 0);
    // The trajectory starts at rest.
    assert!((0..3).all(|j| !problem.used_samples(j).contains(&0)));
    let rows = problem.rows();
    let thinned = problem.clone().without_small_reactions(&TRUTH[..13], 0.01).unwrap();
    let left_out = rows - thinned.rows();
    assert!((1..rows / 20).contains(&left_out), "{left_out} left out");
    let residuals = thinned.residuals(&TRUTH).unwrap();
    assert!(residuals.iter().all(|r| r.abs() < 1e-11));
}

#[test]
fn frozen_normal_forces_are_carried_to_another_record() {
    let problem = experiment(Model::Constant, 0.0, 0);
    let means = problem.mean_normal_forces(&TRUTH[..13]).unwrap();
    let other = record(&sampled(circle, 50), 0.0);
    let elsewhere = problem.predict_on(&other, &TRUTH).unwrap();
    for (drive, mean) in elsewhere.drives.iter().zip(&means) {
        assert!(drive.normal.iter().all(|n| n == mean));
    }
    let stribeck = experiment(Model::Stribeck, 0.0, 0).predict_on(&other, &TRUTH).unwrap();
    assert_eq!(stribeck.rms_error(&efforts(&other, 0.0, 0)).unwrap(), Some(0.0));
}

#[test]
fn faults_are_named() {
    let rows = |speed: f64| DriveRows {
        regressor: Mat::from_fn(4, 2, |i, k| (i + k) as f64),
        reactions: vec![Mat::from_fn(4, 2, |i, _| i as f64)],
        weight: vec![1.0, 1.0],
        speed: vec![speed; 4],
    };
    let make = |drive| Record::new(vec![drive]);
    assert_eq!(Record::new(Vec::new()).unwrap_err(), LoadFrictionError::NoDrives);
    let short = DriveRows { weight: vec![1.0], ..rows(1.0) };
    assert!(make(short).unwrap_err().to_string().contains("weight of drive 0: expected 2, found 1"));
    let broken = DriveRows { speed: vec![1.0, f64::NAN, 1.0, 1.0], ..rows(1.0) };
    assert!(make(broken).unwrap_err().to_string().contains("speed, drive 0, sample 1"));
    let still = Problem::new(make(rows(1e-9)).unwrap(), &[vec![0.0; 4]], Settings::default());
    assert_eq!(still.unwrap_err(), LoadFrictionError::NoSamples { samples: 4 });
    let problem = Problem::new(make(rows(1.0)).unwrap(), &[vec![0.0; 4]], Settings::default()).unwrap();
    assert!(problem.residuals(&[1.0; 5]).unwrap_err().to_string().contains("expected 6, found 5"));
    let no_speed = problem.residuals(&[1.0, 1.0, 0.1, 1.0, 0.1, 0.0]).unwrap_err().to_string();
    assert!(no_speed.contains("Stribeck speed: expected a positive number"), "{no_speed}");
}

#[test]
fn every_parameter_gets_a_verdict() {
    for (model, acting) in [(Model::Stribeck, 17), (Model::CoulombViscous, 15)] {
        let problem = experiment(model, 2.0, 1);
        let mut theta = TRUTH;
        theta[9] = bounds().upper()[9];
        let found = problem.identifiability(&theta, None).unwrap();
        let all = verdicts(&problem, &bounds(), &found).unwrap();
        for (k, verdict) in all.iter().enumerate() {
            match verdict {
                Verdict::AtBound { .. } => assert_eq!(k, 9),
                Verdict::NotEstimated => assert!(k >= acting),
                Verdict::Determined { std } => {
                    assert!((13..acting).contains(&k) && std.unwrap() > 0.0, "{k}: {verdict:?}");
                }
                Verdict::OnlyInCombination { terms, sum } => {
                    assert!(k < 13 && k != 9);
                    assert!(sum.determined && sum.std.unwrap() > 0.0, "{k}: {verdict:?}");
                    assert!(terms.len() > 1 && terms.iter().any(|(j, f)| *j == k && *f != 0.0));
                    let value: f64 = terms.iter().map(|(j, f)| f * theta[*j]).sum();
                    assert!((value - sum.value).abs() < 1e-9 * value.abs().max(1.0));
                }
            }
        }
    }
}
