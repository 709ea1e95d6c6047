//! `dynid predict`.

use std::path::Path;

use dynid::io::{ReadOptions, csv};
use dynid::log::as_logged;
use dynid::model::EffortModel as _;
use dynid::predict::{efforts, read_states};
use dynid::{Error, Estimate};
use dynid_terminal::message::{Failure, Notes, data, json};
use dynid_terminal::outputs;
use dynid_terminal::progress::Progress;

use crate::args::PredictArgs;

pub(crate) fn run(args: &PredictArgs) -> Result<u8, Failure> {
    let out: Vec<(&str, &Path)> = args.out.iter().map(|out| ("--out", out.as_path())).collect();
    let set = outputs::prepare_files(&out, &[&args.estimate, &args.states], args.force)?;
    let estimate = Estimate::read(&args.estimate)?;
    let split = args.split.of();
    let options = ReadOptions { rows: args.rows, ..ReadOptions::default() };
    let progress = Progress::new(args.quiet);
    progress.doing("predicting");
    let model = estimate.effort_model(&args.estimate, split)?;
    let states = read_states(&args.states, &options, &model, estimate.provenance.reading.as_ref()).map_err(
        |error| match error {
            Error::Columns { file, source } => {
                Error::RecordedColumns { file, estimate: args.estimate.display().to_string(), source }
            }
            other => other,
        },
    )?;
    if states.time.is_none() && !model.signals().is_empty() {
        Notes::new(args.quiet).tell(
            "friction of this model remembers the motion, and the table has no column `t` that ascends: it is taken in its steady state",
        );
    }
    let effort = as_logged(&model, efforts(&model, &estimate.values(split), &states)?);
    drop(progress);
    match &args.out {
        None if args.json => json(&efforts_in_json(&estimate.joints, &effort))?,
        None => data(&csv_text(&estimate.joints, &effort)?)?,
        Some(path) => {
            set.write_table(0, &header(&estimate.joints), &effort)?;
            if !set.publish()?.is_empty() {
                let notes = Notes::new(args.quiet);
                notes.tell(&format!("{} rows written to {}", states.rows, path.display()));
            }
        }
    }
    Ok(0)
}

fn header(joints: &[String]) -> Vec<String> {
    joints.iter().map(|j| format!("effort_{j}")).collect()
}

/// Efforts as CSV, one row per state.
pub(super) fn csv_text(joints: &[String], effort: &[Vec<f64>]) -> Result<String, Failure> {
    Ok(csv::text("standard output", &header(joints), effort)?)
}

/// Joints, and their efforts state by state.
fn efforts_in_json(joints: &[String], effort: &[Vec<f64>]) -> serde_json::Value {
    let states = effort.first().map_or(0, Vec::len);
    let rows: Vec<Vec<f64>> = (0..states).map(|s| effort.iter().map(|e| e[s]).collect()).collect();
    serde_json::json!({ "joints": joints, "effort": rows })
}
