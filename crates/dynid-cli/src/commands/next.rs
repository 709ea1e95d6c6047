//! `dynid next`.

use std::path::{Path, PathBuf};

use dynid::design::next::{IntervalRecord, NextRecord, NextSettings, next};
use dynid::record::Outcome;
use dynid_terminal::message::{Failure, Notes, data};
use dynid_terminal::outputs;
use dynid_terminal::progress::Progress;

use super::design::{MotionFiles, designed};
use super::table;
use crate::args::{DesignedArgs, NextArgs};

const DEFAULT_OUT: &str = "dynid-next";

pub(crate) fn run(args: &NextArgs) -> Result<u8, Failure> {
    let mut config = designed(&args.input, &args.designed)?;
    config.trajectory.period_s = args.period.or(config.trajectory.period_s);
    config.check()?;
    if args.out.is_some() {
        config.out.clone_from(&args.out);
    }
    let out = config.out.clone().unwrap_or_else(|| PathBuf::from(DEFAULT_OUT));
    let DesignedArgs { force, print, .. } = &args.designed;
    let files = MotionFiles::new(&out, "next.json", &args.designed);
    let factors = args.after.iter().map(PathBuf::as_path);
    let inputs: Vec<&Path> = factors.clone().chain([args.input.as_path(), &config.robot]).collect();
    let set = outputs::prepare_folder(&files.all, &inputs, *force)?;
    let progress = Progress::new(print.quiet);
    progress.doing("reading");
    let earlier = dynid::reduce::read_all(factors)?;
    let settings = NextSettings { wanted: args.want.clone(), longest_s: args.longest };
    let run = next(&config, &settings, &earlier, &mut |step| progress.design(step))?;
    let record = run.record()?;
    let report = run.report(&record)?;
    drop(progress);

    let designed = run.design.as_ref().and_then(|design| design.outcome.as_ref().ok());
    let text = serde_json::to_string_pretty(&record).map_err(|e| Failure::Output(e.into()))? + "\n";
    let all = files.write(&set, designed.map(|designed| &designed.motion), &text, &report)?;
    let written = set.publish()?;
    let notes = Notes::new(print.quiet);
    notes.warnings(&record.verdict.warnings);
    data(&if print.json { text } else { summary(&record) })?;
    notes.written(&written);
    if designed.is_some() {
        notes.tell("record it, and identify from all logs together: what is wanted is then judged on the logs themselves");
    }
    Ok(u8::from(record.verdict.status == Outcome::Fail || !all))
}

/// Parameters that the summary shows.
const SHOWN: usize = 20;

/// Intervals today, as wanted and after the motion, and the verdict last.
fn summary(record: &NextRecord) -> String {
    let mut out = Vec::new();
    let row = |p: &IntervalRecord| {
        let width = |w: Option<f64>| table::number(w);
        vec![
            p.name.clone(),
            table::number(Some(p.value)),
            width(p.half_width),
            width(p.wanted_half_width),
            width(p.half_width_after),
            p.unit.clone(),
            p.state.map_or_else(String::new, |state| state.to_string()),
        ]
    };
    let rows: Vec<Vec<String>> = record.wanted.iter().take(SHOWN).map(row).collect();
    let header = ["parameter", "value", "± today", "± wanted", "± after", "unit", "state"];
    out.push(table::aligned(&header, &rows).trim_end().to_owned());
    if record.wanted.len() > SHOWN {
        out.push(format!(".. and {} more in next.json", record.wanted.len() - SHOWN));
    }
    for p in &record.wanted {
        out.extend(p.combination.iter().map(|seen| format!("{}: {seen}", p.name)));
    }
    if !record.tried.is_empty() {
        let tried = record.tried.iter().map(|t| match t.needed_s {
            Some(needed) => format!("{needed:.1} s up to {} Hz", table::number(Some(t.highest_hz))),
            None => format!("no length up to {} Hz", table::number(Some(t.highest_hz))),
        });
        out.push(format!("\ntime needed by speed of motion: {}", tried.collect::<Vec<_>>().join(", ")));
    }
    out.push(format!("\n{}: {}\n", record.verdict.status, record.verdict.headline));
    out.join("\n")
}
