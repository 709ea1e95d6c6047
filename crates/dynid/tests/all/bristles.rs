//! Bristles and viscous friction of temperature, simulated, identified from one log, and exported.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::path::Path;

use dynid::io::csv;
use dynid::simulate::{SimulateSettings, simulate};
use dynid::{Config, Error, Robot, RobotOptions, identify};

const ARM: &str = r#"schema = 1
name = "arm"
dh = "modified"
[[joint]]
name = "j1"
alpha = "-90deg"
d = 0.3
limits = { position = [-2.0, 2.0], velocity = 3.0, effort = 200.0 }
phi = [3.0, 0.6, 0.03, 0.0, 0.06, -0.006, 0.0, 0.17, 0.0, 0.18]
[[joint]]
name = "j2"
a = 0.35
limits = { position = [-2.0, 2.0], velocity = 3.0, effort = 200.0 }
phi = [1.5, 0.225, 0.01, 0.0, 0.03, -0.0015, 0.0, 0.06, 0.0, 0.06]
[defaults]
elements = ["lugre", "exponential_viscous", "offset"]
"#;

/// Friction of both joints; shape parameters as stated.
fn robot(rho: f64, vs: f64, sigma3: f64, sigma4: f64) -> String {
    let friction = format!(
        "lugre = {{ coulomb = 4.0, sigma1 = 60.0, kappa = 900, rho = {rho}, vs = {vs} }}\n\
         exponential_viscous = {{ sigma2 = 9.0, sigma2_slope = -0.12, sigma3 = {sigma3}, sigma4 = {sigma4}, \
         reference_temperature = 30 }}\n"
    );
    format!("{ARM}[element.j1]\n{friction}[element.j2]\n{friction}")
}

/// A log in which both joints warm up from 22 to 34 °C.
fn write_log(folder: &Path) {
    std::fs::write(folder.join("truth.toml"), robot(1.3, 0.06, 1.2, 0.8)).unwrap();
    let truth = Robot::load(&folder.join("truth.toml"), &RobotOptions::default()).unwrap();
    let settings = "mode = \"closed_loop\"\nduration_s = 30.0\nrate_hz = 500\nseed = 3\neffort_noise = 0.01\n\
         [channels]\ntemperature_j1 = [[0.0, 22.0], [30.0, 34.0]]\ntemperature_j2 = [[0.0, 22.0], [30.0, 34.0]]\n";
    let log = simulate(&truth, &SimulateSettings::parse(settings, "simulation").unwrap()).unwrap();
    let mut header = vec!["t".to_owned()];
    let mut columns: Vec<&[f64]> = vec![&log.time];
    for (prefix, signals) in [("q", &log.position), ("tau", &log.effort)] {
        header.extend(log.joints.iter().map(|j| format!("{prefix}_{j}")));
        columns.extend(signals.iter().map(Vec::as_slice));
    }
    csv::write(folder.join("cold.csv"), &header, &columns).unwrap();
    // Kelvins, which the configuration does not say.
    let kelvins: Vec<Vec<f64>> =
        log.channels.iter().map(|(_, t)| t.iter().map(|t| t + 273.15).collect()).collect();
    let mut in_kelvins = (header.clone(), columns.clone());
    header.extend(log.channels.iter().map(|(name, _)| name.clone()));
    columns.extend(log.channels.iter().map(|(_, values)| values.as_slice()));
    csv::write(folder.join("log.csv"), &header, &columns).unwrap();
    in_kelvins.0.extend(["temp_j1".to_owned(), "temp_j2".to_owned()]);
    in_kelvins.1.extend(kelvins.iter().map(Vec::as_slice));
    csv::write(folder.join("kelvin.csv"), &in_kelvins.0, &in_kelvins.1).unwrap();
}

fn run(folder: &Path, more: &str) -> Config {
    let path = folder.join("run.toml");
    std::fs::write(&path, format!("robot = \"robot.toml\"\n{more}")).unwrap();
    Config::read(&path).unwrap()
}

#[test]
fn a_log_of_a_warming_arm_tells_its_friction() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write_log(folder);
    // Starts off the truth; the stiffness of the bristles is held where it is.
    std::fs::write(folder.join("robot.toml"), robot(1.5, 0.1, 1.0, 1.0)).unwrap();
    let config = run(folder, "[[log]]\npath = \"log.csv\"\n");
    let found = identify(&config, &mut |_| {}).unwrap();
    let estimate = found.estimate();
    let shape = |name: &str| estimate.shape_parameters.iter().find(|p| p.name == name).unwrap().value;
    let linear = |name: &str| estimate.parameters.iter().find(|p| p.name == name).unwrap().value;
    for joint in ["j1", "j2"] {
        for (name, value, truth, within) in [
            ("rho", shape(&format!("{joint}.rho")), 1.3, 0.1),
            ("vs", shape(&format!("{joint}.vs")), 0.06, 0.15),
            ("fc", linear(&format!("{joint}.fc")), 4.0, 0.05),
            // The line's slope in a span of twelve kelvins.
            ("sigma2_slope", linear(&format!("{joint}.sigma2_slope")), -0.12, 0.25),
        ] {
            assert!((value / truth - 1.0).abs() < within, "{joint}.{name}: {value}, truth {truth}");
        }
    }
    let error = estimate.fit.filtered.relative_error.unwrap();
    assert!(error < 3.0, "{error} %");

    // Without temperatures: the joint's channel is named, and what to do.
    let missing = identify(&run(folder, "[[log]]\npath = \"cold.csv\"\n"), &mut |_| {}).unwrap_err();
    assert!(missing.to_string().contains("temperature_j1"), "{missing}");
    assert!(missing.hint().unwrap().contains("temperature = 30"), "{:?}", missing.hint());
    let kelvin = identify(&run(folder, "[[log]]\npath = \"kelvin.csv\"\n"), &mut |_| {}).unwrap_err();
    assert!(matches!(kelvin, Error::Temperature { row: 1, .. }), "{kelvin}");
    assert!(kelvin.hint().unwrap().contains("unit"), "{:?}", kelvin.hint());
}
