//! `dynid predict`.

use std::fmt::Write;

use dynid::Estimate;
use dynid::io::{ReadOptions, states};
use dynid::logs::as_logged;
use dynid::model::EffortModel;
use dynid::predict::efforts;
use dynid::robot::model_state_joints;

use crate::args::PredictArgs;
use crate::message::{Failure, data, note};
use crate::outputs;

pub(crate) fn run(args: &PredictArgs) -> Result<u8, Failure> {
    if let Some(out) = &args.out {
        outputs::check_files(&[("--out", out)], &[&args.estimate, &args.states])?;
    }
    let estimate = Estimate::read(&args.estimate)?;
    let split = args.split.of();
    let model = estimate.effort_model(&args.estimate, split)?;
    let joints = model_state_joints(&model);
    let states =
        states::read_with_channels(&args.states, &joints, model.channels(), &ReadOptions::default())?;
    let effort = as_logged(&model, efforts(&model, &estimate.values(split), &states)?);
    match &args.out {
        None => data(&csv_text(&estimate.joints, &effort))?,
        Some(path) => {
            dynid::io::csv::write(path, &header(&estimate.joints), &effort)?;
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
