//! Instrumental variables through the pipeline: simulated arms in closed loop, and the recorded EMPS.

#![expect(clippy::unwrap_used, reason = "a test may stop, and says what it measured")]

use std::path::Path;

use dynid::estimate::Estimate;
use dynid::estimators::instruments::{ExogeneityVerdict, IterationEnd};
use dynid::estimators::linear::LinearMethod;
use dynid::io::csv;
use dynid::model::EffortModel;
use dynid::simulate::{SimulateSettings, SimulatedLog, simulate};
use dynid::{Config, Robot, RobotOptions, Run, identify};

use crate::support::{data, emps_robot, write_log};

/// An elbow arm of three joints.
const ARM: &str = r#"
schema = 1
name = "arm"
gravity = [0, 0, -9.81]
dh = "modified"
[defaults]
elements = ["coulomb", "viscous"]
[element.j1]
coulomb = { effort = 6.0 }
viscous = { coefficient = 9.0 }
[element.j2]
coulomb = { effort = 8.0 }
viscous = { coefficient = 12.0 }
[element.j3]
coulomb = { effort = 4.0 }
viscous = { coefficient = 5.0 }
[[joint]]
name = "j1"
a = 0.0
alpha = 0.0
d = 0.4
offset = 0.0
limits = { position = [-3, 3], velocity = 3, effort = 2000.0 }
phi = [10.0, 0.0, 0.0, 0.0, 0.3, 0.0, 0.0, 0.3, 0.0, 0.2]
[[joint]]
name = "j2"
a = 0.1
alpha = "-90deg"
d = 0.0
offset = 0.0
limits = { position = [-2, 2], velocity = 3, effort = 2000.0 }
phi = [12.0, 2.4, 0.1, 0.2, 0.2, 0.01, 0.02, 1.1, 0.0, 1.1]
[[joint]]
name = "j3"
a = 0.5
alpha = 0.0
d = 0.0
offset = 0.0
limits = { position = [-2, 2], velocity = 3, effort = 2000.0 }
phi = [6.0, 0.9, 0.3, 0.05, 0.1, 0.01, 0.01, 0.3, 0.0, 0.35]
"#;

const TRAJECTORY: &str = r#"{"schema": "dynid-trajectory/1", "form": "plain", "base_frequency_rad_s": 0.6283185307179586, "periods": 3,
"joints": [
 {"name": "j1", "q0": 0.1, "a": [0.3, -0.2, 0.15, 0.1, -0.08], "b": [0.2, 0.1, -0.1, 0.06, 0.05]},
 {"name": "j2", "q0": -0.4, "a": [0.2, 0.25, -0.1, 0.08, 0.07], "b": [-0.2, 0.1, 0.12, -0.08, 0.04]},
 {"name": "j3", "q0": 0.6, "a": [-0.3, 0.2, 0.2, -0.1, 0.06], "b": [0.1, -0.2, 0.1, 0.1, -0.06]}]}"#;

/// Gains of the loop, and its rate.
const LOOP: &str = "position_gain = [2500, 3000, 700]\nvelocity_gain = [120, 150, 35]\nrate_hz = 500\n";

pub(super) fn log_of(folder: &Path, seed: u64, encoder_noise: f64) -> SimulatedLog {
    std::fs::write(folder.join("arm.toml"), ARM).unwrap();
    std::fs::write(folder.join("motion.json"), TRAJECTORY).unwrap();
    let robot = Robot::load(&folder.join("arm.toml"), &RobotOptions::default()).unwrap();
    let text = format!(
        "mode = \"closed_loop\"\nfollow = {:?}\nrate_hz = 500\nseed = {seed}\neffort_noise = 0.005\nencoder_bits = 0\n\
         delay_samples = 0\n[control]\nfeed_forward = false\n{LOOP}[imperfections]\nencoder_noise = {encoder_noise}\n\
         ripple_share = 0\noutlier_share = 0\ndropped_share = 0\nclock_jitter_s = 0\n",
        folder.join("motion.json")
    );
    simulate(&robot, &SimulateSettings::parse(&text, "test").unwrap()).unwrap()
}

/// A kernel that lets noise of the positions through; a command held over a sample leads the motion by half of it.
pub(super) fn config(folder: &Path, method: &str, instruments: &str) -> Config {
    let text = format!(
        "robot = {:?}\n[conditioning]\nkernel_hz = 30\nstate_hz = 75\ndelay_samples = 0.5\n[elements]\nfriction = \"given\"\n\
         [estimator]\nmethod = \"{method}\"\n{instruments}[[log]]\npath = {:?}\n",
        folder.join("arm.toml"),
        folder.join("log.csv"),
    );
    Config::parse(&text, "test").unwrap()
}

pub(super) fn instruments(folder: &Path) -> String {
    format!("[instruments]\ntrajectory = {:?}\n{LOOP}", folder.join("motion.json"))
}

pub(super) fn truth_of(id: &Run, log: &SimulatedLog) -> Vec<f64> {
    let table = id.model.parameters();
    let mut values = vec![0.0; table.linear.len()];
    for (name, value) in &log.truth {
        values[table.column(name).unwrap()] = *value;
    }
    id.base.values(&values)
}

#[test]
fn bias_of_an_arm_in_closed_loop_falls_to_a_fifth() {
    const SEEDS: u64 = 1;
    let folder = tempfile::tempdir().unwrap();
    let mut sums: Vec<[f64; 2]> = Vec::new();
    let mut names = Vec::new();
    for seed in 1..=SEEDS {
        let log = log_of(folder.path(), seed, 3e-4);
        write_log(&log, &folder.path().join("log.csv"));
        let config = config(folder.path(), "iv", &instruments(folder.path()));
        let id = identify(&config, &mut |_| {}).unwrap();
        let truth = truth_of(&id, &log);
        let comparison = id.comparison.as_ref().unwrap();
        let found = comparison.exogeneity.as_ref().unwrap();
        let run = id.simulations.as_ref().unwrap();
        println!(
            "seed {seed}: {} rounds ({:?}), strength {:.2}, p {:.1e}, {} blocks, worst {:.1} limits",
            run.rounds,
            run.end,
            found.least_cosine,
            found.robust.map_or(f64::NAN, |t| t.p_value),
            found.blocks,
            found.worst().unwrap().ratio()
        );
        let conditioning = id.conditioning.as_ref().unwrap();
        println!("share of samples left by masks: {:.2?}", conditioning.usable);
        assert!(conditioning.mask.iter().all(Option::is_some));
        assert!(run.succeeded() && run.rounds <= 10);
        assert_eq!(found.verdict, ExogeneityVerdict::Material);
        sums.resize(truth.len(), [0.0; 2]);
        let std = id.standard_deviations();
        names = found
            .effects
            .iter()
            .map(|e| {
                let k = e.column;
                sums[k][0] += (e.least_squares - truth[k]) / SEEDS as f64;
                sums[k][1] += (id.fit().x[k] - truth[k]) / SEEDS as f64;
                let name = id.model.parameters().linear[id.base.kept[k]].name.clone();
                (k, name, truth[k], e.std, std[k].0.unwrap())
            })
            .collect();
        if seed == 1 {
            let estimate = id.estimate();
            check_record(&id, &estimate);
        }
    }
    let mut squares = [0.0; 2];
    for (k, name, truth, std, own) in &names {
        let [ls, iv] = sums[*k];
        println!(
            "{name}: {truth:.4}, least squares {ls:+.4} (std {:.4}), instruments {iv:+.4} (std {own:.4})",
            std.0
        );
        // Biases of different units count in parts of what instruments scatter by.
        squares[0] += (ls / own).powi(2);
        squares[1] += (iv / own).powi(2);
    }
    let ratio = (squares[0] / squares[1]).sqrt();
    println!(
        "mean error over {SEEDS} logs, all parameters: least squares {ratio:.1} times that of instruments"
    );
    assert!(ratio >= 5.0);
}

fn check_record(id: &Run, estimate: &Estimate) {
    let record = estimate.exogeneity.as_ref().unwrap();
    assert_eq!(record.verdict.word(), "material");
    assert_eq!(record.parameters.len(), estimate.base_parameters.len());
    assert_eq!(record.fit.as_ref().unwrap().end.word(), "settled");
    assert!(record.p_value.unwrap() < 0.05);
    let checks = &estimate.verdict.checks;
    let status = |name: &str| checks.iter().find(|c| c.name.word() == name).unwrap().status.word();
    assert_eq!((status("instruments"), status("closed-loop bias")), ("ok", "ok"));
    assert!(id.report(estimate).unwrap().contains("closed-loop bias"));
    let text = serde_json::to_string(estimate).unwrap();
    let again: Estimate = serde_json::from_str(&text).unwrap();
    assert_eq!(again.exogeneity.unwrap().parameters.len(), record.parameters.len());
}

/// A pendulum in a position loop, its reference in the log.
pub(super) struct Pendulum {
    folder: tempfile::TempDir,
}

impl Pendulum {
    const ROBOT: &str = r#"
schema = 1
name = "pendulum"
gravity = [0, 0, -9.81]
dh = "modified"
[defaults]
elements = ["coulomb", "viscous"]
[element.j1]
coulomb = { effort = 0.4 }
viscous = { coefficient = 0.3 }
[[joint]]
name = "j1"
a = 0.0
alpha = "-90deg"
d = 0.0
offset = 0.0
limits = { position = [-3, 3], velocity = 8, effort = 200.0 }
phi = [2.0, 0.3, 0.02, 0.0, 0.01, 0.0, 0.0, 0.06, 0.0, 0.06]
"#;
    const MOTION: &str = r#"{"schema": "dynid-trajectory/1", "form": "plain", "base_frequency_rad_s": 0.8975979010256552, "periods": 3,
"joints": [{"name": "j1", "q0": 0.1, "a": [0.4, -0.2, 0.15], "b": [0.2, 0.1, -0.1]}]}"#;
    pub(super) const LOOP: &str = "position_gain = [80]\nvelocity_gain = [4]\nrate_hz = 500\n";

    pub(super) fn new(encoder_noise: f64) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("robot.toml"), Self::ROBOT).unwrap();
        std::fs::write(at("motion.json"), Self::MOTION).unwrap();
        let robot = Robot::load(&at("robot.toml"), &RobotOptions::default()).unwrap();
        let text = format!(
            "mode = \"closed_loop\"\nfollow = {:?}\nrate_hz = 500\neffort_noise = 0.005\nencoder_bits = 0\ndelay_samples = 0\n\
             [control]\nfeed_forward = false\n{}[imperfections]\nencoder_noise = {encoder_noise}\nripple_share = 0\n\
             outlier_share = 0\ndropped_share = 0\nclock_jitter_s = 0\n",
            at("motion.json"),
            Self::LOOP
        );
        let log = simulate(&robot, &SimulateSettings::parse(&text, "test").unwrap()).unwrap();
        let wanted: Vec<f64> = log.time.iter().map(|t| 100.0 * Self::wanted(*t)).collect();
        let header = ["t", "q_j1", "tau_j1", "goal1"].map(str::to_owned);
        let columns: [&[f64]; 4] = [&log.time, &log.position[0], &log.effort[0], &wanted];
        csv::write(at("log.csv"), &header, &columns).unwrap();
        Pendulum { folder }
    }

    fn wanted(t: f64) -> f64 {
        let w = 0.897_597_901_025_655_2 * t;
        let (a, b) = ([0.4, -0.2, 0.15], [0.2, 0.1, -0.1]);
        let harmonic = |k: usize| {
            let (s, c) = ((k + 1) as f64 * w).sin_cos();
            a[k] * s + b[k] * c
        };
        0.1 + (0..3).map(harmonic).sum::<f64>()
    }

    fn config(&self, more: &str) -> Result<Config, String> {
        self.config_of_log(more, "")
    }

    fn config_of_log(&self, more: &str, log: &str) -> Result<Config, String> {
        let text = format!(
            "robot = {:?}\n{more}\n[[log]]\npath = {:?}\n{log}\n",
            self.folder.path().join("robot.toml"),
            self.folder.path().join("log.csv")
        );
        Config::parse(&text, "test").map_err(|e| e.to_string())
    }

    pub(super) fn identify(&self, more: &str) -> (Config, Run) {
        let config = self.config(more).unwrap();
        let id = identify(&config, &mut |_| {}).unwrap();
        (config, id)
    }
}

pub(super) fn check_of<'a>(estimate: &'a Estimate, name: &str) -> &'a dynid::estimate::CheckResult {
    estimate.verdict.checks.iter().find(|c| c.name.word() == name).unwrap()
}

const GIVEN: &str = "[elements]\nfriction = \"given\"\n";
const WIDE: &str = "[conditioning]\nkernel_hz = 60\nstate_hz = 150\ndelay_samples = 0.5\nreversal_mask = 0\n";

#[test]
fn columns_of_the_reference_serve_as_its_trajectory_file_does() {
    let pendulum = Pendulum::new(1e-4);
    let table = |reference: &str| {
        format!("{GIVEN}{WIDE}[estimator]\nmethod = \"iv\"\n[instruments]\n{reference}\n{}", Pendulum::LOOP)
    };
    let file = format!("trajectory = {:?}", pendulum.folder.path().join("motion.json"));
    let (_, by_file) = pendulum.identify(&table(&file));
    let (config, by_columns) = pendulum.identify(&table("reference = \"goal{}\"\nreference_scale = 0.01"));
    assert_eq!(by_columns.simulations.as_ref().unwrap().end, IterationEnd::Settled);
    for (a, b) in by_file.fit().x.iter().zip(&by_columns.fit().x) {
        assert!((a - b).abs() < 1e-4 * a.abs(), "{a} {b}");
    }
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let again = alone.install(|| identify(&config, &mut |_| {}).unwrap());
    assert_eq!(
        (&again.fit().x, &again.comparison),
        (&by_columns.fit().x, &by_columns.comparison),
        "same bits"
    );
    let estimate = by_columns.estimate();
    assert_eq!(estimate.provenance.settings["instruments"]["reference"], "goal{}");
}

/// The log's own trajectory as reference, states from its Fourier series; friction with a shape parameter, which is searched, then
/// linearised for the fit and unfolded for simulations; feed-forward of the identified model.
#[test]
fn periodic_logs_and_friction_with_shapes_are_simulated_too() {
    let pendulum = Pendulum::new(2e-5);
    let iv = |friction: &str, table: &str| {
        format!(
            "[elements]\nfriction = \"{friction}\"\n[estimator]\nmethod = \"iv\"\n[instruments]\n{table}\n{}",
            Pendulum::LOOP
        )
    };
    let file = format!("trajectory = {:?}", pendulum.folder.path().join("motion.json"));
    let config = pendulum.config_of_log(&iv("given", ""), &file).unwrap();
    let periodic = identify(&config, &mut |_| {}).unwrap();
    assert!(periodic.logs[0].periodic.is_some());
    let columns = "reference = [\"goal1\"]\nreference_scale = 0.01\n";
    let fed = format!("{columns}feed_forward = true\nnominal = \"identified\"\n");
    let (_, forward) = pendulum.identify(&iv("given", &fed));
    let (_, shaped) = pendulum.identify(&iv("arctangent", columns));
    assert!(shaped.shapes.is_some());
    for (name, id) in [("periodic", &periodic), ("feed-forward", &forward), ("shaped", &shaped)] {
        let run = id.simulations.as_ref().unwrap();
        let inertia = id.base.kept.iter().position(|c| id.model.parameters().linear[*c].name == "link1.Izz");
        let found = id.fit().x[inertia.unwrap()];
        println!(
            "{name}: {} rounds, {:?}, strength {:.2?}, inertia {found:.4}",
            run.rounds, run.end, run.strength
        );
        assert!(run.succeeded() && run.strength.unwrap().1 > 0.5, "{name}: {run:?}");
        assert!((found - 0.06).abs() < 0.002, "{name}: {found}");
    }
}

#[test]
fn least_squares_is_warned_of_a_material_bias_and_of_nothing_else() {
    let noisy = Pendulum::new(3e-4);
    let table =
        format!("[instruments]\nreference = \"goal{{}}\"\nreference_scale = 0.01\n{}", Pendulum::LOOP);
    let (config, id) = noisy.identify(&format!("{GIVEN}{WIDE}{table}"));
    let estimate = id.estimate();
    let (check, record) = (check_of(&estimate, "closed-loop bias"), estimate.exogeneity.as_ref().unwrap());
    println!("{}", check.meaning);
    assert_eq!((check.status.word(), record.verdict.word()), ("warn", "material"));
    assert!(check.meaning.contains("method = \"iv\"") && record.fit.is_none());
    assert_eq!(identify(&config, &mut |_| {}).unwrap().comparison, id.comparison, "the same bits");

    // The same motion with a good encoder, conditioned as usual.
    let fine = Pendulum::new(2e-6);
    let (_, id) = fine.identify(&format!("{GIVEN}{table}"));
    let estimate = id.estimate();
    let check = check_of(&estimate, "closed-loop bias");
    println!("{}", check.meaning);
    assert_eq!(check.status.word(), "ok");
    assert!(["harmless", "exogenous"].contains(&estimate.exogeneity.unwrap().verdict.word()));

    let (_, id) = fine.identify(GIVEN);
    let estimate = id.estimate();
    assert!(id.comparison.is_none() && !serde_json::to_string(&estimate).unwrap().contains("exogeneity"));
    assert!(estimate.verdict.checks.iter().all(|c| c.name.word() != "closed-loop bias"));
}

#[test]
fn a_simulation_that_diverges_is_told_and_least_squares_stays() {
    let pendulum = Pendulum::new(1e-4);
    let table = "[instruments]\nreference = \"goal{}\"\nreference_scale = 0.01\nrate_hz = 500\nposition_gain = [80]\n";
    for (gain, found) in
        [("velocity_gain = [4]\neffort_limit = [0.2]\n", true), ("velocity_gain = [400]\n", false)]
    {
        let (_, id) = pendulum.identify(&format!("{GIVEN}{WIDE}[estimator]\nmethod = \"iv\"\n{table}{gain}"));
        let run = id.simulations.as_ref().unwrap();
        assert!(!run.succeeded() && matches!(run.end, IterationEnd::Diverged { .. }), "{run:?}");
        assert_eq!(id.fit().method, LinearMethod::Wls);
        let estimate = id.estimate();
        let check = check_of(&estimate, "instruments");
        println!("{}", check.meaning);
        assert_eq!((check.status.word(), estimate.verdict.status.word()), ("fail", "fail"));
        let record = estimate.exogeneity.as_ref().unwrap();
        assert_eq!(
            (record.verdict.word(), record.fit.as_ref().unwrap().end.word()),
            ("diverged", "diverged")
        );
        assert!(!found || record.distance.unwrap() > 0.5);
        assert!(id.report(&estimate).unwrap().contains("closed-loop bias"));
    }
}

#[test]
fn what_is_missing_or_contradictory_is_named() {
    let pendulum = Pendulum::new(1e-4);
    let refused = |more: &str, words: &[&str]| {
        let message = match pendulum.config(more) {
            Ok(config) => identify(&config, &mut |_| {}).unwrap_err().to_string(),
            Err(message) => message,
        };
        assert!(words.iter().all(|w| message.contains(w)), "{message}");
    };
    refused("[estimator]\nmethod = \"iv\"", &["instruments", "reference and controller"]);
    refused("[instruments]\nrate_hz = 500", &["instruments.reference", "trajectory", "neither"]);
    refused("[instruments]\nreference = \"target{}\"", &["target1", "reference_j1"]);
    refused(
        "[instruments]\nreference = [\"goal1\", \"goal2\"]",
        &["instruments.reference", "1 columns", "2"],
    );
    refused("[instruments]\nreference = { j7 = \"goal1\" }", &["j7"]);
    refused("[instruments]\nsettled = -1.0", &["instruments.settled", "-1"]);
    refused("[instruments]\nfeed_forward = true\nreference_velocity = false", &["reference_velocity"]);
    refused(
        "[instruments]\nreference = \"goal{}\"\nreference_scale = 0.01\nposition_gain = [1, 2]",
        &["position gain", "expected 1", "found 2"],
    );
    refused("[instruments]\ncontroler = 1", &["controler"]);
}

/// The benchmark's loop: a proportional position loop around a velocity loop on the measured velocity; gains and drive gain are those
/// of the data's README.
const EMPS_LOOP: &str = r#"
[instruments]
reference = ["qg"]
reference_velocity = false
rate_hz = 1000
position_gain = [1370698.6]
velocity_gain = [8557.426]
effort_limit = [351.5]
"#;

pub(super) fn emps(robot: &Path, method: &str, route: &str) -> Option<Run> {
    let data = data()?;
    let text = format!(
        "robot = {robot:?}\n[columns]\nposition = [\"qm\"]\neffort = {{ columns = [\"vir\"], scale = 35.15065188 }}\n[elements]\n\
         default = [\"coulomb\", \"viscous\", \"offset\"]\nfriction = \"given\"\n{route}\n[estimator]\nmethod = \"{method}\"\n{EMPS_LOOP}\n\
         [[log]]\npath = {:?}\n",
        data.join("emps/emps_identification.csv.gz")
    );
    Some(identify(&Config::parse(&text, "emps").unwrap(), &mut |_| {}).unwrap())
}

/// Published IDIM-LS values and their standard deviations.
pub(super) const EMPS: [(&str, f64, f64); 4] = [
    ("carriage.m", 95.1089, 0.1085),
    ("x.fv", 203.5034, 1.1460),
    ("x.fc", 20.3935, 0.1012),
    ("x.fo", -3.1648, 0.0444),
];

/// A fine encoder and a low cut-off: least squares has next to no bias, and instruments say so.
#[test]
fn instruments_of_the_recorded_emps_agree_with_least_squares_and_with_the_published_values() {
    let robot = emps_robot();
    let textbook = "[conditioning]\nroute = \"textbook\"\nkernel_hz = 100\ndecimation = 10\nparallel_filter = true\n\
                    filter_effort = false\ntrim_s = 0.049\nremove_spikes = false\n";
    for (name, route) in [("textbook route", textbook), ("compact route", "")] {
        let Some(ls) = emps(robot.path(), "ols", route) else { return };
        let iv = emps(robot.path(), "iv", route).unwrap();
        let run = iv.simulations.as_ref().unwrap();
        let found = ls.comparison.as_ref().unwrap().exogeneity.as_ref().unwrap();
        println!(
            "{name}: {} rounds ({:?}), strength {:.3}; p {:.2e}, naive {:.2e}, {:?}, {} blocks, V/W {:.4?}",
            run.rounds,
            run.end,
            run.strength.unwrap().1,
            found.robust.map_or(f64::NAN, |t| t.p_value),
            found.naive.map_or(f64::NAN, |t| t.p_value),
            found.verdict,
            found.blocks,
            found.unexplained
        );
        assert_eq!((&run.end, found.verdict), (&IterationEnd::Settled, ExogeneityVerdict::Harmless));
        assert!(run.strength.unwrap().1 > 0.99);
        let at = |id: &Run, name: &str| {
            let column = id.model.parameters().column(name).unwrap();
            let k = id.base.kept.binary_search(&column).unwrap();
            (id.fit().x[k], id.standard_deviations()[k].0.unwrap())
        };
        for (name, published, deviation) in EMPS {
            let ((l, ls_std), (v, iv_std)) = (at(&ls, name), at(&iv, name));
            println!(
                "  {name}: least squares {l:.4} ± {ls_std:.4}, instruments {v:.4} ± {iv_std:.4}, published {published} ± {deviation}"
            );
            // The two methods agree to a tenth of a per cent, both with the published values within the deviations of either.
            assert!((l - v).abs() <= 1e-3 * l.abs(), "{l} {v}");
            assert!((v - published).abs() <= deviation.max(iv_std), "{v} {published}");
        }
    }
}
