//! `dynid predict`.

use std::fmt::Write;
use std::path::Path;

use dynid::logs::as_logged;
use dynid::predict::{efforts, read_states};
use dynid::{Error, Estimate};

use crate::args::PredictArgs;
use crate::message::{Failure, data, note};
use crate::outputs;

pub(crate) fn run(args: &PredictArgs) -> Result<u8, Failure> {
    let out: Vec<(&str, &Path)> = args.out.iter().map(|out| ("--out", out.as_path())).collect();
    let set = outputs::prepare_files(&out, &[&args.estimate, &args.states])?;
    let estimate = Estimate::read(&args.estimate)?;
    let split = args.split.of();
    let model = estimate.effort_model(&args.estimate, split)?;
    let states = read_states(&args.states, &model, estimate.provenance.reading.as_ref()).map_err(
        |error| match error {
            Error::Columns { file, source } => {
                Error::RecordedColumns { file, estimate: args.estimate.display().to_string(), source }
            }
            other => other,
        },
    )?;
    let effort = as_logged(&model, efforts(&model, &estimate.values(split), &states)?);
    match &args.out {
        None => data(&csv_text(&estimate.joints, &effort))?,
        Some(path) => {
            dynid::io::csv::write(set.staged(0), &header(&estimate.joints), &effort)?;
            set.publish()?;
            note(&format!("{} rows written to {}", states.rows, path.display()));
        }
    }
    Ok(0)
}

fn header(joints: &[String]) -> Vec<String> {
    joints.iter().map(|j| format!("effort_{j}")).collect()
}

/// Efforts as CSV, one row per state.
pub(super) fn csv_text(joints: &[String], effort: &[Vec<f64>]) -> String {
    let mut out = header(joints).join(",");
    out.push('\n');
    for row in 0..effort.first().map_or(0, Vec::len) {
        for (k, column) in effort.iter().enumerate() {
            let _ = write!(out, "{}{}", if k > 0 { "," } else { "" }, column[row]);
        }
        out.push('\n');
    }
    out
}
