//! `dynid friction`.

use std::path::{Path, PathBuf};

use dynid::friction::model::{FrictionModel, JointFrictionModel, ViscousModel};
use dynid::friction::{FrictionConfig, identify_friction};

use super::table;
use crate::args::FrictionTestArgs;
use crate::message::{Failure, data, note};
use crate::outputs;
use crate::progress::Progress;

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
    let set = outputs::prepare_folder(&files, &inputs)?;
    let progress = Progress::new(args.quiet);
    let found = identify_friction(&config, &mut |step| progress.friction(step))?;
    let model = found.model(&config)?;
    let report = found.report(&model)?;
    drop(progress);

    let text = model.to_json();
    set.write(0, text.as_bytes())?;
    set.write(1, report.as_bytes())?;
    set.publish()?;
    let failed = model.verdict.status == "fail";
    if !args.quiet {
        summary(&model);
        files.iter().for_each(|file| note(&format!("written: {}", file.display())));
    } else if failed {
        note(&verdict(&model));
    }
    if args.json {
        data(&text)?;
    }
    Ok(u8::from(failed))
}

fn summary(model: &FrictionModel) {
    for warning in &model.warnings {
        note(&format!("warning: {warning}"));
    }
    let rows: Vec<Vec<String>> = model.joints.iter().map(row).collect();
    let head =
        ["joint", "status", "points", "F_c", "F_s", "v_s", "viscous", "RMS", "error, %", "sigma0", "sigma1"];
    note(table::aligned(&head, &rows).trim_end());
    for joint in &model.joints {
        for text in &joint.notes {
            note(&format!("{}: {text}", joint.joint));
        }
    }
    note(&format!("\n{}", verdict(model)));
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
        joint.status.clone(),
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

fn verdict(model: &FrictionModel) -> String {
    format!("{}: {}", model.verdict.status, model.verdict.headline)
}
