//! Do 95 % intervals hold the truth in 95 % of the logs of a filtered six-joint arm?
//!
//! By default a few logs are simulated, enough to notice a wrong interval. The full count
//! takes some minutes:
//!
//! `cargo test --release -p dynid-estimate --test all calibration:: -- --ignored --nocapture`
#![expect(clippy::unwrap_used, clippy::print_stdout, reason = "in tests a panic is the report")]

use crate::arm::{Arm, CUT_OFF_HZ, JOINTS, RATE_HZ};
use dynid_estimate::covariance::variance_inflation;
use dynid_estimate::distribution::t_quantile;
use dynid_estimate::linear::{LinearMethod, LinearSettings, estimate, row_scores};
use dynid_estimate::whiteness::{InBandSettings, raw_in_band_whiteness};
use dynid_factor::rows::reduce_rows;
use dynid_linalg::Mat;
use rayon::prelude::*;

/// Shares of true base parameters inside their 95 % interval, and the mean variance inflation.
#[derive(Debug, Default, Clone, Copy)]
struct Coverage {
    plain: f64,
    jackknife: f64,
    sandwich: f64,
    hac: f64,
    inflation: f64,
}

fn one(arm: &Arm, seed: u64, tau: f64) -> [f64; 5] {
    let rows = arm.log(seed, tau);
    let groups = reduce_rows(&rows).unwrap();
    let p = arm.truth.len();
    let found = estimate(&groups, None, p, &LinearMethod::Wls, &LinearSettings::default()).unwrap();
    assert!(found.solution.dropped.is_empty() && found.converged);
    let by_blocks = t_quantile(0.975, found.blocks.len() as f64 - 1.0).unwrap();
    let inside = |v: &Mat, quantile: f64| {
        let held = (0..p).filter(|&i| (found.x[i] - arm.truth[i]).abs() <= quantile * v[(i, i)].sqrt());
        held.count() as f64 / p as f64
    };
    let plain = found.model_covariance();
    let jackknife = found.jackknife().unwrap().covariance;
    let hac = row_scores(&rows, &found).unwrap().covariance(&found, &[RATE_HZ], CUT_OFF_HZ).unwrap();
    [
        inside(&plain, 1.96),
        inside(&jackknife, by_blocks),
        inside(&found.block_sandwich().unwrap(), by_blocks),
        inside(&hac, 1.96),
        variance_inflation(&jackknife, &plain).unwrap(),
    ]
}

fn coverage(arm: &Arm, logs: u64, tau: f64) -> Coverage {
    let found: Vec<[f64; 5]> = (0..logs).into_par_iter().map(|seed| one(arm, seed, tau)).collect();
    let mean = |k: usize| found.iter().map(|f| f[k]).sum::<f64>() / logs as f64;
    let [plain, jackknife, sandwich, hac, inflation] = [0, 1, 2, 3, 4].map(mean);
    Coverage { plain, jackknife, sandwich, hac, inflation }
}

fn check(seconds: f64, logs: u64) {
    let arm = Arm::new(seconds);
    let (white, coloured) = (coverage(&arm, logs, 0.0), coverage(&arm, logs, 0.1));
    println!("{logs} logs of {seconds} s, {} base parameters", arm.truth.len());
    println!("white:    {white:.3?}");
    println!("coloured: {coloured:.3?}");
    assert!((0.93..=0.97).contains(&white.jackknife), "white: {white:?}");
    assert!((0.90..=0.98).contains(&coloured.jackknife), "coloured: {coloured:?}");
    for found in [white, coloured] {
        // Second opinions: better than plain C, known to fall short of the jackknife.
        assert!(found.sandwich > found.plain && found.hac > found.plain, "{found:?}");
    }
    assert!(coloured.inflation > 2.0 * white.inflation, "{white:?}, {coloured:?}");
    assert!(white.plain < 0.93 && coloured.plain < 0.80, "plain C ought to fail: {white:?}, {coloured:?}");
}

#[test]
fn intervals_of_a_few_logs_hold_the_truth() {
    check(30.0, 50);
}

/// Raw residuals of a fit lack what its parameters took up; the in-band test must not mistake that for colour.
#[test]
fn raw_residuals_of_a_fit_are_judged_fairly() {
    let arm = Arm::new(30.0);
    let share = |tau: f64| {
        const LOGS: u64 = 40;
        let rejected: usize = (0..LOGS)
            .into_par_iter()
            .map(|seed| {
                let groups = reduce_rows(&arm.log(seed, tau)).unwrap();
                let p = arm.truth.len();
                let found =
                    estimate(&groups, None, p, &LinearMethod::Wls, &LinearSettings::default()).unwrap();
                let rejects = |joint: &usize| {
                    let residual = arm.raw_residual(*joint, seed, tau, &found.x);
                    let settings = InBandSettings::default();
                    raw_in_band_whiteness(&residual, RATE_HZ, CUT_OFF_HZ, &settings).unwrap().rejected()
                };
                (0..JOINTS).filter(rejects).count()
            })
            .sum();
        rejected as f64 / (LOGS * JOINTS as u64) as f64
    };
    let (null, power) = (share(0.0), share(0.05));
    println!("raw in-band whiteness after a fit: null {null:.3}, power {power:.3}");
    assert!(null <= 0.07 && power >= 0.90, "null {null}, power {power}");
}

/// The full count of logs, at both lengths.
#[test]
#[ignore = "takes some minutes; the ordinary run does fewer logs"]
fn intervals_of_a_thousand_logs_hold_the_truth() {
    check(60.0, 1000);
    check(20.0, 1000);
}
