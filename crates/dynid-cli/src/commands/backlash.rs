//! `dynid backlash`.

use dynid::backlash::{BacklashVerdict, JointBacklash, backlash};
use dynid::estimate::Estimate;
use dynid_terminal::message::{Failure, data, json};
use dynid_terminal::progress::Progress;

use super::Reading;
use crate::args::BacklashArgs;

pub(crate) fn run(args: &BacklashArgs) -> Result<u8, Failure> {
    let estimate = Estimate::read(&args.estimate)?;
    let reading = Reading::of(&args.reading, &estimate, &args.estimate)?;
    let logs = match args.log.is_empty() {
        true => reading.stated.clone(),
        false => args.log.iter().map(|path| reading.log(path)).collect(),
    };
    let motor_side = reading.motor_side.as_ref();
    let progress = Progress::new(args.print.quiet);
    progress.doing("weighing gaps against none");
    let found = backlash((&estimate, &args.estimate), &logs, &reading.columns, motor_side)
        .map_err(|e| reading.named(e))?;
    drop(progress);
    if args.print.json {
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
