//! Faults that a record shows by itself.

use dynid_motion::clock::{ClockSettings, uniform};
use dynid_motion::faults::{Run, clipped, frozen_effort, frozen_position, outliers, repeated};
use dynid_motion::signal::{quantum, rms};
use dynid_motion::spikes::{self, SpikeSettings};
use dynid_motion::{ClockReport, JointSignals, Log, UniformLog};
use rayon::prelude::*;

use crate::Error;
use crate::finding::{FindingId, Findings, Fix, Severity};
use crate::log::LARGEST_POSITION;

/// Jitter that is worth a word, samples.
const JITTER: f64 = 0.05;
/// Jitter beyond which a clock is a warning, samples.
const ROUGH: f64 = 0.3;
/// Share of rows that repeat the row before from which on a log was made by holding a slower one.
const HELD: f64 = 0.1;
/// Share of repeating rows that is worth a word.
const SOME: f64 = 0.002;
/// Share of a record that stays the same for too long from which on its resolution is to blame.
const COARSE: f64 = 0.1;
/// Share of its rms speed at which a joint counts as moving.
const AT_SPEED: f64 = 0.3;
/// Resolution steps by which a joint that moves goes at least while a signal hangs.
const MOVED: f64 = 10.0;
/// Most ranges that a configuration is to leave out.
const MOST_RANGES: usize = 200;

/// Looks at clock, repetitions, frozen and cut-off signals; gives the log on its grid without spikes. `rows`: data row of every row; `driven`:
/// whether a drive acts on a joint.
pub(super) fn examine(
    log: &Log,
    rows: &[usize],
    driven: impl Fn(&str) -> bool,
    out: &mut Findings<'_>,
) -> Result<UniformLog, Error> {
    repetitions(log, rows, out);
    let rate_hz = median_rate(log);
    let shown: Vec<_> = log
        .joints()
        .par_iter()
        .map(|joint| {
            let effort = &joint.effort;
            let position = frozen_position(&joint.position, rate_hz);
            match effort.is_empty() || joint.effort_is_constant() {
                true => (position, Vec::new(), Vec::new()),
                false => (position, frozen_effort(effort, rate_hz), clipped(effort)),
            }
        })
        .collect();
    for (joint, (frozen, mut hanging, clipped)) in log.joints().iter().zip(shown) {
        let name = Some(joint.name.as_str());
        if !frozen.is_empty() {
            let evidence = format!(
                "the position stops changing within one sample, at speed: {}",
                runs(&frozen, rows, rate_hz)
            );
            out.add(FindingId::FrozenSignal, Severity::Warning, name, evidence, LEAVE_OUT).fixes =
                leave_out(&frozen, rows);
        }
        if joint.effort.is_empty() {
            continue;
        }
        if joint.effort_is_constant() {
            // Where no drive acts there is no effort; where nothing moves, a brake may hold.
            if driven(&joint.name) && joint.moves() {
                let evidence = format!("the effort is {} in every row", joint.effort[0]);
                out.add(
                    FindingId::FrozenSignal,
                    Severity::Error,
                    name,
                    evidence,
                    "log the effort of this joint",
                );
            }
            continue;
        }
        hanging.retain(|run| moves_during(log, run));
        let frozen = hanging;
        let hung: usize = frozen.iter().map(|r| r.length).sum();
        if hung as f64 > COARSE * joint.effort.len() as f64 {
            let mut values: Vec<f64> = joint.effort.clone();
            values.sort_by(f64::total_cmp);
            values.dedup();
            let evidence = format!(
                "the effort takes {} values in {} rows and keeps them for up to {} rows while the robot moves",
                values.len(),
                joint.effort.len(),
                frozen.iter().map(|r| r.length).max().unwrap_or(0)
            );
            let remedy = "little is to be learned about this joint: its effort hardly exceeds the resolution of its sensor";
            out.add(FindingId::CoarseSignal, Severity::Warning, name, evidence, remedy);
        } else if !frozen.is_empty() {
            let evidence = format!(
                "the effort stays exactly the same for longer than its other samples let one expect: {}",
                runs(&frozen, rows, rate_hz)
            );
            out.add(FindingId::FrozenSignal, Severity::Warning, name, evidence, LEAVE_OUT).fixes =
                leave_out(&frozen, rows);
        }
        for flat in clipped {
            let evidence = format!(
                "the effort stays exactly at its {} {:.4} for {} samples in {} runs",
                if flat.level > 0.0 { "largest value" } else { "smallest value" },
                flat.level,
                flat.samples(),
                flat.runs.len()
            );
            let remedy = "leave these rows out: the true effort is larger than the log says; a slower trajectory keeps within the drive's limit";
            out.add(FindingId::Saturation, Severity::Warning, name, evidence, remedy).fixes =
                leave_out(&flat.runs, rows);
        }
    }
    let within = far(log, rows, out);
    let log = within.as_ref().unwrap_or(log);
    outlying(log, rows, out);
    let mut on_grid =
        uniform(log, &ClockSettings::default()).map_err(dynid_rows::conditioning::ConditioningError::from)?;
    clock(&on_grid.report, rows, out);
    let removed: Vec<_> = on_grid
        .joints
        .par_iter_mut()
        .map(|joint| {
            let position = spikes::remove(&mut joint.position, &SpikeSettings::position());
            (position, spikes::remove(&mut joint.effort, &SpikeSettings::default()))
        })
        .collect();
    for (joint, (position, effort)) in on_grid.joints.iter().zip(removed) {
        let name = joint.name.clone();
        for (what, found) in [("position", position), ("effort", effort)] {
            let found = found.map_err(dynid_rows::conditioning::ConditioningError::from)?;
            let count = found.flagged.len();
            // Of a joint at rest the flicker of its last digit stands out; single positions are found above.
            if count == 0 || what == "position" {
                continue;
            }
            let evidence = format!(
                "{count} single samples of the {what} stand out of their neighbours (the first at {:.3} s)",
                on_grid.start + found.flagged[0] as f64 / on_grid.rate_hz
            );
            match found.removed {
                true => out.add(
                    FindingId::Spikes,
                    Severity::Info,
                    Some(&name),
                    evidence,
                    "nothing: they are replaced by the running median",
                ),
                false => out.add(
                    FindingId::Spikes,
                    Severity::Warning,
                    Some(&name),
                    evidence + ", too many to be replaced",
                    "mend the sensor or its connection; until then a robust estimator (`--estimator tukey`) gives them no weight",
                ),
            };
        }
    }
    Ok(on_grid)
}

/// Whether a joint goes on at a fair share of its speed during a run.
fn moves_during(log: &Log, run: &Run) -> bool {
    log.joints().iter().filter(|j| j.moves()).any(|j| {
        let there = &j.position[run.first..run.first + run.length];
        let (low, high) =
            there.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
        let steps: Vec<f64> = j.position.windows(2).map(|w| w[1] - w[0]).collect();
        high - low > (AT_SPEED * rms(&steps) * run.length as f64).max(MOVED * quantum(&j.position))
    })
}

/// Single positions off their neighbours.
fn outlying(log: &Log, rows: &[usize], out: &mut Findings<'_>) {
    let of_joint = |joint: &JointSignals| -> Vec<Run> {
        let found = if joint.moves() { outliers(&joint.position) } else { Vec::new() };
        let near = found.into_iter().filter(|k| joint.position[*k].abs() <= LARGEST_POSITION);
        near.map(|first| Run { first, length: 1 }).collect()
    };
    let wrong: Vec<Vec<Run>> = log.joints().par_iter().map(of_joint).collect();
    for (joint, wrong) in log.joints().iter().zip(wrong) {
        let Some(first) = wrong.first() else { continue };
        let evidence = format!(
            "{} single positions are off the line between their neighbours (first: row {})",
            wrong.len(),
            rows[first.first]
        );
        out.add(FindingId::Spikes, Severity::Warning, Some(&joint.name), evidence, LEAVE_OUT).fixes =
            leave_out(&wrong, rows);
    }
}

/// Positions that no joint reaches; gives the log with the neighbours' in their place where they are few.
fn far(log: &Log, rows: &[usize], out: &mut Findings<'_>) -> Option<Log> {
    let reach = |x: &f64| x.abs() <= LARGEST_POSITION;
    if log.joints().iter().all(|joint| joint.position.iter().all(reach)) {
        return None;
    }
    let mut joints = log.joints().to_vec();
    let mut replaced = false;
    for joint in &mut joints {
        let wrong: Vec<Run> = (0..log.rows())
            .filter(|k| joint.position[*k].abs() > LARGEST_POSITION)
            .map(|first| Run { first, length: 1 })
            .collect();
        let Some(first) = wrong.first() else { continue };
        let evidence = format!(
            "{} of {} positions are beyond {LARGEST_POSITION:e} rad or m (row {}: {:e})",
            wrong.len(),
            log.rows(),
            rows[first.first],
            joint.position[first.first]
        );
        let few = wrong.len() < log.rows() / 100 && wrong.len() <= MOST_RANGES;
        let remedy =
            if few { LEAVE_OUT } else { "state the scale of the position: encoder counts are no angles" };
        out.add(FindingId::PositionRange, Severity::Error, Some(&joint.name), evidence, remedy).fixes =
            if few { leave_out(&wrong, rows) } else { Vec::new() };
        if few {
            replaced = true;
            take_neighbours(&mut joint.position, &wrong);
        }
    }
    if !replaced {
        return None;
    }
    Log::new(log.name(), log.time().to_vec(), joints, log.channels().to_vec()).ok()
}

/// Puts the nearest good value before, or else after, in the place of wrong ones.
fn take_neighbours(values: &mut [f64], wrong: &[Run]) {
    let is_wrong = |k: usize| wrong.iter().any(|r| r.first == k);
    let Some(first_good) = (0..values.len()).find(|k| !is_wrong(*k)) else { return };
    for run in wrong {
        let k = run.first;
        values[k] = if k < first_good { values[first_good] } else { values[k - 1] };
    }
}

const LEAVE_OUT: &str = "leave these rows out; what borders on them is not used either";

fn repetitions(log: &Log, rows: &[usize], out: &mut Findings<'_>) {
    let found = repeated(log);
    if found.share() < SOME {
        return;
    }
    let evidence = format!(
        "{} of {} rows in which a joint moves repeat the row before in every position and effort (first: row {})",
        found.rows.len(),
        found.examined,
        rows[found.rows[0]]
    );
    let severity = if found.share() > HELD { Severity::Warning } else { Severity::Info };
    let remedy = "drop these rows; if the log was written faster than the drives answer, log at their rate";
    out.add(FindingId::DuplicateSamples, severity, None, evidence, remedy).fixes = vec![Fix::DropRepeated];
}

fn clock(report: &ClockReport, rows: &[usize], out: &mut Findings<'_>) {
    if report.dropped > 0 {
        let evidence = format!(
            "{} of {} rows have a time that is not after every earlier one (first: row {})",
            report.dropped,
            report.rows,
            rows[report.first_dropped.unwrap_or(0)]
        );
        let remedy = "nothing: such rows are dropped; see why the logger writes them";
        out.add(FindingId::ClockBackwards, Severity::Info, None, evidence, remedy);
    }
    if report.jitter > JITTER {
        let severity = if report.jitter > ROUGH { Severity::Warning } else { Severity::Info };
        let evidence = format!(
            "steps of the clock vary by {:.0} % of a sample at {:.4} Hz (standard deviation)",
            100.0 * report.jitter,
            report.rate_hz
        );
        let remedy = if report.jitter > ROUGH {
            "the log is resampled on a uniform grid; log the time at which the joints were read, not the time of writing"
        } else {
            "nothing: the log is resampled on a uniform grid"
        };
        out.add(FindingId::ClockJitter, severity, None, evidence, remedy);
    }
    if let Some(longest) = report.gaps.iter().max_by(|a, b| a.duration.total_cmp(&b.duration)) {
        let total: f64 = report.gaps.iter().map(|g| g.duration).sum();
        let evidence = format!(
            "{} gaps of {:.3} s together; the longest, {:.3} s, after row {} ({:.3} s)",
            report.gaps.len(),
            total,
            longest.duration,
            rows[longest.row],
            longest.start
        );
        let remedy = "nothing: samples in gaps and what borders on them are not used; avoid gaps where the motion matters";
        out.add(FindingId::ClockGap, Severity::Warning, None, evidence, remedy);
    }
}

/// Rows per second by the median step.
fn median_rate(log: &Log) -> f64 {
    let steps: Vec<f64> = log.time().windows(2).map(|w| w[1] - w[0]).filter(|s| *s > 0.0).collect();
    dynid_motion::median::median(&steps).map_or(1.0, |s| 1.0 / s)
}

fn runs(list: &[Run], rows: &[usize], rate_hz: f64) -> String {
    let samples: usize = list.iter().map(|r| r.length).sum();
    let first = list[0];
    format!(
        "{} times, {} samples ({:.3} s) together, first at row {} for {} samples",
        list.len(),
        samples,
        samples as f64 / rate_hz,
        rows[first.first],
        first.length
    )
}

fn leave_out(list: &[Run], rows: &[usize]) -> Vec<Fix> {
    if list.len() > MOST_RANGES {
        return Vec::new();
    }
    let range = |r: &Run| (rows[r.first], rows[r.first + r.length - 1]);
    vec![Fix::LeaveOut(list.iter().map(range).collect())]
}
