//! What the tests on recorded and simulated logs share.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::path::{Path, PathBuf};

use dynid::Config;
use dynid::agreement::{Agreement, Alignment, compare};
use dynid::estimators::conditioning::prepare;
use dynid::io::csv;
use dynid::model::{EffortModel, Parameter};
use dynid::simulate::SimulatedLog;
use dynid::trust::ParameterTrust;
use dynid::{Identification, Run, identify};

/// An arm of two joints without elements.
pub(crate) const ARM: &str = r#"schema = 1
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
"#;

/// Panda with torque sensors, later 30 % kept back.
pub(crate) const PANDA: &str = r#"
robot = "{data}/panda-gaz2019/panda_kinematics.urdf"
[elements]
default = ["coulomb", "viscous", "offset"]
[[log]]
path = "{data}/panda-gaz2019/exciting_trajectory.csv.gz"
part = [0.0, 0.7]
[[validation]]
path = "{data}/panda-gaz2019/exciting_trajectory.csv.gz"
part = [0.7, 1.0]
"#;

/// Staubli TX40 with its coupled wrist: motor-side log, later 40 % kept back.
pub(crate) const TX40: &str = r#"
robot = "{data}/staubli-tx40/tx40.urdf"
[columns]
rate_hz = 5000
position = "qm{}"
effort = { columns = "im{}" }
[motor_side]
matrix = [
  [32.0, 0, 0, 0, 0, 0], [0, 32.0, 0, 0, 0, 0], [0, 0, 45.0, 0, 0, 0],
  [0, 0, 0, -48.0, 0, 0], [0, 0, 0, 0, 45.0, 0], [0, 0, 0, 0, 32.0, 32.0],
]
offset = [0, -1.5707963267948966, 1.5707963267948966, 0, 0, 0]
[[coupling]]
motors = ["m5", "m6"]
joints = ["joint_5", "joint_6"]
matrix = [[45.0, 0.0], [32.0, 32.0]]
form = "columns"
[[log]]
path = "{data}/staubli-tx40/motor_log.csv.gz"
part = [0.0, 0.6]
[[validation]]
path = "{data}/staubli-tx40/motor_log.csv.gz"
part = [0.6, 1.0]
"#;

/// UR10e of Innopolis: currents with published gains, two runs, a third kept back.
pub(crate) const UR10E: &str = r#"
robot = "{data}/ur10e-innopolis/ur10e.urdf"
[columns]
effort = { columns = "i{}", unit = "A", scale = [14.87, 13.26, 11.13, 10.62, 11.03, 11.47] }
[[log]]
path = "{data}/ur10e-innopolis/20_02_10-30sec_12harm.csv.gz"
rows = [635, 3510]
[[log]]
path = "{data}/ur10e-innopolis/20_02_12-50sec_12harm.csv.gz"
rows = [355, 5090]
[[validation]]
path = "{data}/ur10e-innopolis/20_02_12-40sec_12harm.csv.gz"
rows = [500, 4460]
"#;

/// UR10 of the University of Salerno, later 30 % kept back.
pub(crate) const UR10: &str = r#"
robot = "{data}/ur10-unisa/ur10_kinematics.urdf"
[[log]]
path = "{data}/ur10-unisa/exciting_trajectory.csv.gz"
part = [0.0, 0.7]
[[validation]]
path = "{data}/ur10-unisa/exciting_trajectory.csv.gz"
part = [0.7, 1.0]
"#;

/// How many 95 % intervals of standard parameters hold the truth of a virtual log, of how many.
pub(crate) fn inside(id: &Identification, log: &SimulatedLog) -> (usize, usize) {
    let table = &id.model.parameters().linear;
    let of = |(p, trust): (&Parameter, &ParameterTrust)| {
        let truth = log.truth.iter().find(|(name, _)| *name == p.name)?.1;
        let (low, high) = trust.interval?;
        Some(usize::from(low <= truth && truth <= high))
    };
    let held: Vec<usize> = table.iter().zip(&id.trust.parameters).filter_map(of).collect();
    (held.iter().sum(), held.len())
}

/// Folder of shared data; without it the test is skipped.
pub(crate) fn data() -> Option<PathBuf> {
    dynid_testing::shared("data")
}

/// Identifies by a configuration in which `{data}` stands for the data folder.
pub(crate) fn run(text: &str) -> Option<(Config, Run)> {
    let data = data()?;
    let config = Config::parse(&text.replace("{data}", &data.display().to_string()), "test").unwrap();
    let identification = identify(&config, &mut |_| {}).unwrap();
    Some((config, identification))
}

/// Agreement on the first validation log through a filter of the given cut-off.
pub(crate) fn on_validation(config: &Config, id: &Run, filter_hz: f64) -> Agreement {
    let log =
        dynid::logs::load(&config.validation[0], &id.robot.axes, &config.columns, config.motor_side.as_ref())
            .unwrap();
    let prepared = prepare(&log.log, &id.model, &id.conditioning_settings).unwrap();
    let alignment = Alignment {
        state_hz: id.state_hz,
        delay_samples: id.delay_samples,
        delay_rate_hz: id.delay_rate_hz,
        filter_hz,
    };
    let (model, values) = id.identified_model();
    compare(model, values, &prepared, &alignment, &id.conditioning_settings).unwrap()
}

/// Geometric mean of ratios.
pub(crate) fn geometric_mean(ratios: impl Iterator<Item = f64>) -> f64 {
    let logs: Vec<f64> = ratios.map(f64::ln).collect();
    (logs.iter().sum::<f64>() / logs.len() as f64).exp()
}

/// RMS per joint.
pub(crate) fn rms(fit: &dynid::estimators::metrics::Fit) -> Vec<f64> {
    fit.channels.iter().map(|c| c.rms.unwrap()).collect()
}

/// Robot file of the EMPS, a carriage on a screw.
pub(crate) fn emps_robot() -> tempfile::NamedTempFile {
    let file = tempfile::Builder::new().suffix(".toml").tempfile().unwrap();
    let text = r#"
schema = 1
name = "emps"
body = [{ name = "carriage", parent = "ground", joint = { name = "x", kind = "prismatic", axis = [1, 0, 0] } }]
"#;
    std::fs::write(file.path(), text).unwrap();
    file
}

/// Writes positions and efforts of a virtual log, columns `t`, `q_<joint>` and `tau_<joint>`.
pub(crate) fn write_log(log: &SimulatedLog, path: &Path) {
    let mut header = vec!["t".to_owned()];
    let mut columns: Vec<&[f64]> = vec![&log.time];
    for (prefix, signals) in [("q", &log.position), ("tau", &log.effort)] {
        header.extend(log.joints.iter().map(|j| format!("{prefix}_{j}")));
        columns.extend(signals.iter().map(Vec::as_slice));
    }
    csv::write(path, &header, &columns).unwrap();
}
