//! `dynid servo`.

use std::path::{Path, PathBuf};

use dynid::record::Outcome;
use dynid::servo::{
    BodyParameterRecord, ServoBodyRecord, ServoConfig, ServoEffortRecord, ServoFile, ServoFiles,
    ServoParameterRecord, identify_servo,
};
use dynid::settings::PerJoint;
use dynid_terminal::message::{Failure, Notes, data};
use dynid_terminal::outputs;
use dynid_terminal::progress::Progress;

use super::table;
use crate::args::ServoArgs;

const DEFAULT_OUT: &str = "dynid-servo";

pub(crate) fn run(args: &ServoArgs) -> Result<u8, Failure> {
    let config = configuration(args)?;
    let out = config.out.clone().unwrap_or_else(|| PathBuf::from(DEFAULT_OUT));
    let names = ServoFiles::names(&config.robot)?;
    let files: Vec<PathBuf> = ["servo.json", "report.html"]
        .iter()
        .map(|n| out.join(n))
        .chain(names.iter().map(|n| out.join(n)))
        .collect();
    let logs = config.log.iter().chain(&config.validation).map(|l| l.path.as_path());
    let inputs: Vec<&Path> = logs.chain([args.input.as_path(), &config.robot]).collect();
    let set = outputs::prepare_folder(&files, &inputs, args.force)?;
    let progress = Progress::new(args.print.quiet);
    let found = identify_servo(&config, &mut |step| progress.servo(step))?;
    let others = found.files()?;
    let file = found.file(&config, &others.notes);
    let report = found.report(&file)?;
    drop(progress);

    let text = file.to_json();
    set.write(0, text.as_bytes())?;
    set.write(1, report.as_bytes())?;
    for (number, (_, text)) in others.files.iter().enumerate() {
        set.write(number + 2, text.as_bytes())?;
    }
    let written = set.publish()?;
    let notes = Notes::new(args.print.quiet);
    notes.warnings(&file.warnings);
    data(&if args.print.json { text } else { summary(&file) })?;
    notes.written(&written);
    Ok(u8::from(file.status == Outcome::Fail))
}

fn configuration(args: &ServoArgs) -> Result<ServoConfig, Failure> {
    let mut config = if args.log.is_empty() {
        ServoConfig::read(&args.input)?
    } else {
        let mut config = ServoConfig::of(args.input.clone(), &args.log, &args.validate);
        config.lock = args.lock.iter().cloned().collect();
        config.servo.position_gain = args.position_gain.map_or_else(PerJoint::default, PerJoint::All);
        config.servo.velocity_gain = args.velocity_gain.map_or_else(PerJoint::default, PerJoint::All);
        config
    };
    if args.out.is_some() {
        config.out.clone_from(&args.out);
    }
    Ok(config)
}

fn summary(file: &ServoFile) -> String {
    let rows: Vec<Vec<String>> = file.parameters.iter().map(row).collect();
    let head = ["parameter", "joints", "value", "from", "to", "unit", "verdict"];
    let mut out = table::aligned(&head, &rows);
    if !file.bodies.is_empty() {
        let head = ["link", "body", "file", "value", "from", "to", "unit", "told"];
        let rows: Vec<Vec<String>> = file.bodies.iter().flat_map(body).collect();
        out += "\n";
        out += &table::aligned(&head, &rows);
    }
    for group in &file.groups {
        out += &format!(
            "\nknown together only ({}): {}\n  {}\n",
            group.kind,
            group.members.join("; "),
            group.remedy
        );
    }
    let per_joint =
        |values: &[f64]| -> String { values.iter().map(|x| format!(" {:.2}", 1e3 * x)).collect() };
    out += &format!("\nRMS over whole rollouts, mrad or mm:{}\n", per_joint(&file.fit.rms));
    out += &format!("command as prediction:{}\n", per_joint(&file.fit.command_rms));
    if let Some(rms) = &file.fit.robot_file_rms {
        out += &format!("robot file as it came:{}\n", per_joint(rms));
    }
    if !file.fit.efforts.is_empty() {
        let head = ["joint", "measured", "verdict", "RMS", "unit", "explained, %", "size"];
        let rows: Vec<Vec<String>> = file.fit.efforts.iter().map(effort).collect();
        out += "\n";
        out += &table::aligned(&head, &rows);
    }
    for log in &file.validation {
        let rms: Vec<f64> = log.rms.iter().map(|x| x.unwrap_or(f64::NAN)).collect();
        out +=
            &format!("validation {}:{}; command{}\n", log.log, per_joint(&rms), per_joint(&log.command_rms));
    }
    out + &format!("\n{}: {}\n", file.status, file.headline)
}

/// Mass and centre of a body; all parameters are in the files.
fn body(body: &ServoBodyRecord) -> Vec<Vec<String>> {
    let row = |p: &BodyParameterRecord| {
        vec![
            body.link.clone(),
            p.name.clone(),
            table::number(Some(p.file)),
            table::number(Some(p.value)),
            table::number(p.interval.map(|i| i.0)),
            table::number(p.interval.map(|i| i.1)),
            p.unit.clone(),
            if p.told { "yes" } else { "no" }.to_owned(),
        ]
    };
    body.parameters.iter().take(4).map(row).collect()
}

fn effort(e: &ServoEffortRecord) -> Vec<String> {
    vec![
        e.joint.clone(),
        e.channel.clone(),
        e.verdict.to_string(),
        table::number(e.rms),
        e.unit.clone(),
        table::number(Some(100.0 * e.explained)),
        table::number(e.ratio),
    ]
}

fn row(p: &ServoParameterRecord) -> Vec<String> {
    vec![
        p.term.clone(),
        p.joints.join(","),
        table::number(Some(p.value)),
        table::number(p.interval.map(|i| i.0)),
        table::number(p.interval.map(|i| i.1)),
        p.unit.clone(),
        p.verdict.to_string(),
    ]
}
