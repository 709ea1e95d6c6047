//! What is wrong with the clock and the motion of logs.

use dynid_model::{EffortModel, RobotModel};
use dynid_rows::conditioning::PreparedLog;

use crate::caution::{self, Caution};
use crate::input_record::short_name;

/// Sample rate below which a log of a robot is suspected of another unit of time, Hz.
const SLOWEST_HZ: f64 = 10.0;

/// Deviation from a Fourier series, in parts of the position noise, above which a motion does not repeat.
const REPEATS: f64 = 2.0;

/// What is wrong with the clock and the motion of logs.
pub(crate) fn log_cautions(model: &RobotModel, logs: &[PreparedLog]) -> Vec<Caution> {
    let mut out = Vec::new();
    for log in logs {
        let name = short_name(&log.name);
        let mut add =
            |message: String, remedy: String| out.push(Caution::warn(caution::LOG, message, remedy));
        if log.rate_hz < SLOWEST_HZ {
            add(
                format!(
                    "{name}: a sample rate of {} Hz: if the time column is in milliseconds, say so (unit \"ms\"), or state `rate_hz`",
                    log.rate_hz
                ),
                "`time = { column = \"t\", unit = \"ms\" }` or `rate_hz = 500` under `[columns]`".to_owned(),
            );
        }
        if log.clock.dropped > 0 {
            add(
                format!(
                    "{name}: {} rows dropped because their time does not advance (first: row {})",
                    log.clock.dropped,
                    log.clock.first_dropped.unwrap_or(0) + 1
                ),
                "nothing if rows were written twice; else state the rate in place of the clock: `rate_hz = 500` under `[columns]`"
                    .to_owned(),
            );
        }
        if !log.clock.gaps.is_empty() {
            add(
                format!(
                    "{name}: {} gaps in the clock, {} grid samples unusable",
                    log.clock.gaps.len(),
                    log.clock.unusable
                ),
                "record without losing rows, or take a stretch without gaps: `part = [0.0, 0.5]` in the `[[log]]`"
                    .to_owned(),
            );
        }
        // Of a mean over periods that differ, the motion is none that the robot made, nor the effort that of it.
        for (output, ratio) in log.averaged.iter().flat_map(|m| m.scatter_ratio.iter().enumerate()) {
            if let Some(ratio) = ratio.filter(|r| *r > REPEATS) {
                add(
                    format!(
                        "{name}: periods of joint `{}` were averaged that differ by {ratio:.1} times the noise of its positions: the mean is no motion \
                         of the robot, and its efforts are not those of the mean",
                        model.outputs()[output].name
                    ),
                    "cut approach and return off by `part` or `rows` of the `[[log]]`, state the right `period_s`, or leave out `average_periods`"
                        .to_owned(),
                );
            }
        }
        for (output, ratio) in log.periodic.iter().flat_map(|m| m.residual_ratio.iter().enumerate()) {
            if let Some(ratio) = ratio.filter(|r| *r > REPEATS) {
                add(
                    format!(
                        "{name}: joint `{}` does not repeat after the stated period: positions lie {ratio:.1} times their noise off the mean period; leave out `trajectory` and `period_s` for this log",
                        model.outputs()[output].name
                    ),
                    "leave out `trajectory` and `period_s` of the `[[log]]`".to_owned(),
                );
            }
        }
        for (output, _) in log.held.iter().enumerate().filter(|(_, held)| **held) {
            let (joint, effort) = (&model.outputs()[output].name, log.effort[output][0]);
            add(
                format!(
                    "{name}: joint `{joint}` does not move, and its effort is {effort} in every row: something else than its drive holds it, such as a \
                     brake, and its rows do not count"
                ),
                "nothing, if that is so; else log the effort of the joint".to_owned(),
            );
        }
    }
    // What some logs do not move others may.
    for (output, of_joint) in model.outputs().iter().enumerate() {
        let joint = &of_joint.name;
        if !logs.is_empty() && logs.iter().all(|log| !log.moves[output]) {
            let message = match logs {
                [log] => format!("{}: joint `{joint}` does not move", short_name(&log.name)),
                _ => format!("joint `{joint}` does not move in any of the logs"),
            };
            let remedy = format!(
                "record a motion of it (`dynid design` gives one), or hold it: `{joint} = 0.0` under `[locked]`, at the position that it has"
            );
            out.push(Caution::warn(caution::LOG, message, remedy));
        }
    }
    out
}
