//! `dynid friction`.

use std::path::{Path, PathBuf};

use dynid::friction::model::{FrictionModel, JointFrictionModel, ViscousModel};
use dynid::friction::{FrictionConfig, identify_friction};
use dynid::record::Outcome;
use dynid_terminal::message::{Failure, Notes, data};
use dynid_terminal::outputs;
use dynid_terminal::progress::Progress;

use super::table;
use crate::args::FrictionTestArgs;

const DEFAULT_OUT: &str = "dynid-friction";

pub(crate) fn run(args: &FrictionTestArgs) -> Result<u8, Failure> {
    let mut config = FrictionConfig::read(&args.input)?;
    if args.out.is_some() {
        config.out.clone_from(&args.out);
    }
    let out = config.out.clone().unwrap_or_else(|| PathBuf::from(DEFAULT_OUT));
    let files = ["friction.json", "report.html"].map(|name| out.join(name));
    let logs = config.log.iter().map(|l| l.path.as_path());
    let slow = config.presliding.iter().map(|l| l.path.as_path());
    let inputs: Vec<&Path> = logs.chain(slow).chain([args.input.as_path(), &config.robot]).collect();
    let set = outputs::prepare_folder(&files, &inputs, args.force)?;
    let progress = Progress::new(args.print.quiet);
    let found = identify_friction(&config, &mut |step| progress.friction(step))?;
    let model = found.model(&config)?;
    let report = found.report(&model)?;
    drop(progress);

    let text = model.to_json();
    set.write(0, text.as_bytes())?;
    set.write(1, report.as_bytes())?;
    let written = set.publish()?;
    let notes = Notes::new(args.print.quiet);
    notes.warnings(&model.warnings);
    data(&if args.print.json { text } else { summary(&model) })?;
    notes.written(&written);
    Ok(u8::from(model.verdict.status == Outcome::Fail))
}

fn summary(model: &FrictionModel) -> String {
    let rows: Vec<Vec<String>> = model.joints.iter().map(row).collect();
    let head =
        ["joint", "status", "points", "F_c", "F_s", "v_s", "viscous", "RMS", "error, %", "sigma0", "sigma1"];
    let mut out = table::aligned(&head, &rows);
    for joint in &model.joints {
        for text in &joint.notes {
            out += &format!("{}: {text}\n", joint.joint);
        }
    }
    out + &format!("\n{}: {}\n", model.verdict.status, model.verdict.headline)
}

fn row(joint: &JointFrictionModel) -> Vec<String> {
    let viscous = match joint.viscous {
        None => "-".to_owned(),
        Some(ViscousModel::Linear { coefficient }) => table::number(Some(coefficient)),
        Some(ViscousModel::Exponential(v)) => {
            format!("{} (1 - exp(-({:.3} v)^{:.3}))", table::number(Some(v.sigma2)), v.sigma3, v.sigma4)
        }
    };
    let points = if joint.samples > 0 { joint.samples } else { joint.points.len() };
    vec![
        joint.joint.clone(),
        joint.status.to_string(),
        points.to_string(),
        table::number(joint.coulomb),
        table::number(joint.static_),
        table::number(joint.stribeck_speed),
        viscous,
        table::number(joint.residual_rms),
        table::number(joint.largest_error.map(|e| 100.0 * e)),
        table::number(joint.bristle.map(|b| b.sigma0)),
        table::number(joint.bristle.map(|b| b.sigma1)),
    ]
}
