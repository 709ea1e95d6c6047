//! `dynid backlash`.

use dynid::backlash::{BacklashVerdict, JointBacklash, backlash};
use dynid::config::{Config, LogConfig};
use dynid::estimate::Estimate;

use super::apply_log_args;
use crate::args::BacklashArgs;
use crate::message::{Failure, data, json};

pub(crate) fn run(args: &BacklashArgs) -> Result<u8, Failure> {
    let estimate = Estimate::read(&args.estimate)?;
    let config = args.config.as_deref().map(Config::read).transpose()?;
    let stated = config.as_ref().map(Config::training_logs).unwrap_or_default();
    let (mut columns, motor_side) =
        config.map_or_else(Default::default, |config| (config.columns, config.motor_side));
    apply_log_args(&mut columns, &args.columns);
    let named =
        |path: &std::path::PathBuf| LogConfig { path: path.clone(), rows: args.rows, ..LogConfig::default() };
    let logs: Vec<LogConfig> =
        if args.log.is_empty() { stated } else { args.log.iter().map(named).collect() };
    let found = backlash((&estimate, &args.estimate), &logs, &columns, motor_side.as_ref())?;
    if args.json {
        json(&found)?;
        return Ok(0);
    }
    let mut out = String::new();
    for log in &found {
        out.push_str(&format!("{} ({:.0} Hz)\n", log.log, log.rate_hz));
        let width = log.joints.iter().map(|j| j.joint.len()).max().unwrap_or(0);
        for joint in &log.joints {
            out.push_str(&format!("  {:width$}  {}\n", joint.joint, text(joint)));
        }
    }
    data(&out)?;
    Ok(0)
}

/// An angle in milliradians, a length in micrometres.
fn size(value: f64, unit: &str) -> String {
    if unit == "m" { format!("{:.3} µm", 1e6 * value) } else { format!("{:.3} mrad", 1e3 * value) }
}

fn text(of: &JointBacklash) -> String {
    let elsewhere = of.elsewhere.map_or_else(
        || "the load is too uncertain to compare with others".to_owned(),
        |e| format!("{e:.1} at other loads"),
    );
    let evidence = format!("evidence {:.1}, {elsewhere}, {} crossings", of.evidence, of.crossings);
    let ruled_out = match of.would_show {
        Some(gap) => format!("gaps from {} on would have shown", size(gap, of.unit)),
        None => "this log rules out no gap".to_owned(),
    };
    match (of.verdict, of.gap, of.interval) {
        (BacklashVerdict::Found, Some(gap), Some((low, high))) => format!(
            "gap {} ({} to {}); {evidence}",
            size(gap, of.unit),
            size(low, of.unit),
            size(high, of.unit)
        ),
        (BacklashVerdict::NoCrossings, ..) => {
            "nothing can be said: the load hardly changes its sign away from reversals".to_owned()
        }
        (BacklashVerdict::TooShort, ..) => {
            "nothing can be said: too few samples away from reversals".to_owned()
        }
        (BacklashVerdict::AtRest, ..) => "at rest".to_owned(),
        _ => format!("no gap found; {ruled_out}; {evidence}"),
    }
}
