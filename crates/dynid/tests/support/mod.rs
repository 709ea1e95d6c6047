//! What the tests on recorded and simulated logs share.

use std::path::PathBuf;

use dynid::Config;
use dynid::agreement::{Agreement, Alignment, compare};
use dynid::estimators::conditioning::prepare;
use dynid::identify::{Identification, identify};

/// Folder of shared data, or `None` with a note.
pub(crate) fn data() -> Option<PathBuf> {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    if path.is_dir() {
        return Some(path);
    }
    println!("skipped: ../shared not present");
    None
}

/// Identifies by a configuration in which `{data}` stands for the data folder.
pub(crate) fn run(text: &str) -> Option<(Config, Identification)> {
    let data = data()?;
    let config = Config::parse(&text.replace("{data}", &data.display().to_string()), "test").unwrap();
    let identification = identify(&config, |_| {}).unwrap();
    Some((config, identification))
}

/// Agreement on the first validation log through a filter of the given cut-off.
pub(crate) fn on_validation(config: &Config, id: &Identification, filter_hz: f64) -> Agreement {
    let log = dynid::logs::load(
        &config.validation[0],
        &id.robot.mechanism,
        &config.columns,
        config.motor_side.as_ref(),
    )
    .unwrap();
    let prepared = prepare(&log.log, &id.model, &id.settings).unwrap();
    let alignment = Alignment {
        state_hz: id.state_hz,
        delay_samples: id.delay_samples,
        delay_rate_hz: id.delay_rate_hz,
        filter_hz,
    };
    compare(&id.model, id.values(), &prepared, &alignment, &id.settings).unwrap()
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
