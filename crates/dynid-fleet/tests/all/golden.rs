//! Against a prototype written elsewhere: `spec/golden/fleet_mixed.json`, `fleet_drift.json`.

use dynid_estimate::distribution::chi_squared_exceedance;
use dynid_factor::Factor;
use dynid_fleet::drift::{Pattern, Series, candidates, probability};
use dynid_fleet::{
    ChannelFactor, Coordinate, Fleet, FleetLog, Noise, VarianceSettings, Variances, fit_at, tree,
    variances_at,
};
use dynid_linalg::Mat;
use serde_json::Value;

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

fn list(value: &Value) -> Vec<f64> {
    value.as_array().expect("a list").iter().map(number).collect()
}

fn matrix(value: &Value) -> Mat {
    let rows: Vec<Vec<f64>> = value.as_array().expect("rows").iter().map(list).collect();
    Mat::from_fn(rows.len(), rows[0].len(), |i, j| rows[i][j])
}

#[track_caller]
fn close(found: &[f64], expected: &[f64], tolerance: f64, what: &str) {
    assert_eq!(found.len(), expected.len(), "{what}");
    let scale = expected.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    for (f, e) in found.iter().zip(expected) {
        assert!((f - e).abs() <= tolerance * scale, "{what}: {found:?} against {expected:?}");
    }
}

#[track_caller]
fn close_matrix(found: &Mat, expected: &Value, tolerance: f64, what: &str) {
    let expected = matrix(expected);
    let flat = |m: &Mat| m.col_iter().flat_map(<[f64]>::to_vec).collect::<Vec<f64>>();
    close(&flat(found), &flat(&expected), tolerance, what);
}

fn fleet(golden: &Value) -> (Fleet, Noise) {
    let rows = golden["rows"].as_u64().expect("rows") as usize;
    let log = |(k, log): (usize, &Value)| {
        let channel = |(channel, joint): (usize, &Value)| {
            let columns: Vec<usize> = list(&joint["columns"]).iter().map(|c| *c as usize).collect();
            let a = matrix(&joint["A"]);
            let p = columns.len();
            let factor = Factor::from_triangle(p, |i, j| a[(i, j)], a[(p, p)], rows);
            ChannelFactor { channel, columns, factor }
        };
        let channels = log["joints"].as_array().expect("joints").iter().enumerate().map(channel).collect();
        FleetLog {
            robot: number(&log["robot"]) as usize,
            key: k as u64,
            time_s: k as f64,
            covariates: Vec::new(),
            channels,
        }
    };
    let logs = golden["factors"].as_array().expect("factors").iter().enumerate().map(log).collect();
    let coordinate =
        |column| Coordinate { column, between_robots: true, between_logs: true, watched: true, kind: column };
    let fleet = Fleet {
        columns: 4,
        channels: 2,
        robots: (0..5).collect(),
        covariates: 0,
        varying: vec![coordinate(0), coordinate(1)],
        logs,
    };
    let variances: Vec<Vec<f64>> = golden["sigma2"].as_array().expect("variances").iter().map(list).collect();
    (fleet, Noise { ranks: vec![4, 2], variances, colours: list(&golden["kappa"]) })
}

#[test]
fn the_mixed_model_agrees() {
    let Some(golden) = dynid_testing::golden("fleet_mixed.json") else { return };
    let (fleet, noise) = fleet(&golden);
    let given = |of: &Value| Variances::new(list(&of["D_b"]), list(&of["D_c"]), (5, fleet.logs.len()));
    let fixed = &golden["fixed"];
    let fit = fit_at(&fleet, noise.clone(), given(fixed)).expect("fits");
    close(&fit.values, &list(&fixed["theta"]), 1e-10, "theta");
    close_matrix(&fit.covariance, &fixed["C"], 1e-10, "C");
    close(&[fit.m2l], &[number(&fixed["m2l"])], 1e-10, "m2l");
    for (r, robot) in fit.robots.iter().enumerate() {
        let robot = robot.as_ref().expect("has logs");
        close(&robot.deviation, &list(&fixed["b"][r]), 1e-9, "b");
        let sd: Vec<f64> = (0..2).map(|k| number(&fixed["V_b"][r][k][k]).sqrt()).collect();
        close(&robot.deviation_sd, &sd, 1e-9, "sd of b");
    }
    for (k, log) in fit.logs.iter().enumerate() {
        close(&log.deviation, &list(&fixed["c"][k]), 1e-9, "c");
        let sd: Vec<f64> = (0..2).map(|j| number(&fixed["V_c"][k][j][j]).sqrt()).collect();
        close(&log.deviation_sd, &sd, 1e-9, "sd of c");
    }
}

#[test]
fn variances_agree() {
    let Some(golden) = dynid_testing::golden("fleet_mixed.json") else { return };
    let (fleet, noise) = fleet(&golden);
    let start =
        Variances::new(list(&golden["fixed"]["D_b"]), list(&golden["fixed"]["D_c"]), (5, fleet.logs.len()));
    let plain = |passes| VarianceSettings {
        passes,
        few: 0,
        accelerated: false,
        tolerance: 0.0,
        ..VarianceSettings::default()
    };
    for (k, expected) in golden["em_path"].as_array().expect("steps").iter().enumerate() {
        let (found, _) = variances_at(&fleet, &noise, &start, &plain(k + 1)).expect("steps");
        close(&found.robots, &list(&expected["D_b"]), 1e-9, "D_b");
        close(&found.logs, &list(&expected["D_c"]), 1e-9, "D_c");
    }
    let reml = &golden["reml"];
    let fine = VarianceSettings { passes: 5000, few: 0, tolerance: 1e-9, ..VarianceSettings::default() };
    let (found, settled) = variances_at(&fleet, &noise, &start, &fine).expect("settles");
    println!("{settled:?}");
    let robots = list(&reml["D_b"]);
    close(&found.robots, &robots, 1e-5, "D_b");
    close(&found.logs, &list(&reml["D_c"]), 1e-5, "D_c");
    let fit = fit_at(&fleet, noise, found).expect("fits");
    close(&fit.values, &list(&reml["theta"]), 1e-6, "theta");
    close_matrix(&fit.jackknife.clone().expect("robots"), &golden["jackknife"], 1e-5, "jackknife");
    let new = fit.new_robot();
    close(&new.values, &list(&golden["new_robot"]["x"]), 1e-6, "new robot");
    close_matrix(&new.covariance, &golden["new_robot"]["C"], 1e-5, "new robot");
}

#[test]
fn the_tree_agrees_in_any_order() {
    let Some(golden) = dynid_testing::golden("fleet_drift.json") else { return };
    let tree_of = &golden["tree"];
    let keys: Vec<u64> = list(&tree_of["keys"]).iter().map(|k| *k as u64).collect();
    let matrices: Vec<Mat> = tree_of["matrices"].as_array().expect("matrices").iter().map(matrix).collect();
    let parts: Vec<(u64, &Mat)> = keys.iter().copied().zip(&matrices).collect();
    close_matrix(&tree::merge(&parts).expect("parts"), &tree_of["merged"], 1e-12, "merged");
    assert!(tree::merge(&[]).is_none());
}

/// One coordinate of one robot: values with variances, and a covariate whose slope differs from the fleet's.
#[test]
fn patterns_of_change_agree() {
    let Some(golden) = dynid_testing::golden("fleet_drift.json") else { return };
    let (times, covariate, y, v) =
        (list(&golden["t"]), list(&golden["T"]), list(&golden["y"]), list(&golden["v"]));
    let g = number(&golden["g"]);
    let information: Vec<Mat> = v.iter().map(|v| Mat::from_fn(1, 1, |_, _| 1.0 / v)).collect();
    let moment = (0..y.len()).map(|l| vec![(y[l] - g * covariate[l]) / v[l]]).collect();
    let covariates = covariate.iter().map(|t| vec![*t]).collect();
    let series = Series { times, covariates, information, moment };
    let precision = vec![vec![1.0 / number(&golden["sT"])]];
    let stated = golden["candidates"].as_array().expect("candidates");
    let pattern = |c: &Value| match c["first_after"].as_u64() {
        Some(first) => Pattern::Step { first: first as usize },
        None => Pattern::Ramp { onset: number(&c["onset"]) },
    };
    let patterns: Vec<Pattern> = stated.iter().map(pattern).collect();
    let found = candidates(&series, &precision, 0, &patterns);
    for (found, stated) in found.iter().zip(stated) {
        let expected = [&stated["size"], &stated["sd"], &stated["stat"]].map(number);
        close(&[found.size, found.sd, found.statistic], &expected, 1e-8, "candidate");
    }
    let best =
        (0..found.len()).max_by(|a, b| found[*a].statistic.total_cmp(&found[*b].statistic)).expect("some");
    assert_eq!(best as u64, golden["best"].as_u64().expect("a number"));
    // The prototype pays six times for the search, we pay for the number of logs.
    let single = chi_squared_exceedance(found[best].statistic, 1.0).expect("a probability");
    close(&[6.0 * single], &[number(&golden["p"])], 1e-8, "p");
    let ours = probability(found[best].statistic, series.len());
    close(&[ours], &[1.4 * 14.0_f64.ln().powi(2) * single], 1e-12, "p for 14 logs");
}
