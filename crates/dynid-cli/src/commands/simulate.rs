//! `dynid simulate`.

use std::path::{Path, PathBuf};

use dynid::sim::clearance::ContactEventKind;
use dynid::simulate::{
    ClearanceSummary, ExperimentSummary, FleetTable, SimulateMode, SimulateSettings, SimulatedLog,
    VirtualFleet, VirtualLog, simulate, simulate_drives,
};
use dynid_terminal::message::{Failure, Notes, json};
use dynid_terminal::outputs::{self, Outputs, is_stdout};
use dynid_terminal::progress::Progress;

use super::{demand_stdout, load_robot};
use crate::args::{RobotArgs, SimulateArgs};

/// Columns of efforts; joints without a drive have none.
const EFFORT: &str = "tau";
/// Columns of efforts of drives that nobody measures.
const DRIVE_EFFORT: &str = "tau_drive";

pub(crate) fn run(args: &SimulateArgs) -> Result<u8, Failure> {
    let settings = settings(args)?;
    if settings.fleet.is_some() {
        return fleet(args, &settings);
    }
    let files: Vec<(&str, &Path)> =
        [("--out", Some(&args.out)), ("--clean", args.clean.as_ref()), ("--truth", args.truth.as_ref())]
            .into_iter()
            .filter_map(|(argument, path)| Some((argument, path?.as_path())))
            .collect();
    let inputs: Vec<&Path> = std::iter::once(&args.robot.robot)
        .chain(&args.config)
        .chain(&args.follow)
        .chain(&args.drives)
        .map(PathBuf::as_path)
        .collect();
    let set = outputs::prepare_files(&files, &inputs, args.force)?;
    demand_stdout(args.print, &set)?;
    let progress = Progress::new(args.print.quiet);
    let log = if settings.drives.is_some() {
        progress.doing("simulating");
        told(args, &settings)?
    } else {
        let robot = load_robot(&args.robot)?;
        progress.doing("simulating");
        simulate(&robot, &settings)?
    };
    drop(progress);
    let mut signals = vec![("q", &log.position), (EFFORT, &log.effort)];
    if let Some(velocity) = &log.velocity {
        signals.insert(1, ("dq", velocity));
    }
    if let Some(command) = &log.command {
        signals.insert(0, ("cmd", command));
    }
    write(&set, 0, &log, &signals, &log.channels)?;
    if args.clean.is_some() {
        let [q, dq, ddq, tau] = &log.clean;
        let mut signals = vec![("q", q), ("dq", dq), ("ddq", ddq), (EFFORT, tau)];
        if log.command.is_some() {
            signals = vec![("q", q), ("dq", dq), (DRIVE_EFFORT, tau)];
        }
        write(&set, 1, &log, &signals, &log.clean_channels)?;
    }
    if args.truth.is_some() {
        set.write(files.len() - 1, truth(&log)?.as_bytes())?;
    }
    set.publish()?;
    if args.print.json {
        json(&summary(&log, args))?;
    }
    tell(&log, &args.out, Notes::new(args.print.quiet));
    Ok(0)
}

/// A log of drives that are told positions.
fn told(args: &SimulateArgs, settings: &SimulateSettings) -> Result<SimulatedLog, Failure> {
    let RobotArgs { robot, floating_base, couple_mimics, lock, gravity } = &args.robot;
    if *floating_base || *couple_mimics {
        return Err(Failure::Usage(
            "--drives: expected neither --floating-base nor --couple-mimics beside it".to_owned(),
            "the base is held where the robot file puts it, and mimic joints follow their leaders",
        ));
    }
    Ok(simulate_drives(robot, &lock.iter().cloned().collect(), *gravity, settings)?)
}

/// Settings of the configuration, those of the command line over them.
fn settings(args: &SimulateArgs) -> Result<SimulateSettings, Failure> {
    let mut settings = match &args.config {
        None => SimulateSettings::default(),
        Some(path) => read_settings(path)?,
    };
    if args.closed_loop {
        settings.mode = SimulateMode::ClosedLoop;
    }
    if args.follow.is_some() {
        settings.follow.clone_from(&args.follow);
    }
    if args.drives.is_some() {
        settings.drives.clone_from(&args.drives);
    }
    settings.duration_s = args.duration.unwrap_or(settings.duration_s);
    settings.rate_hz = args.rate_hz.unwrap_or(settings.rate_hz);
    settings.effort_noise = args.effort_noise.unwrap_or(settings.effort_noise);
    settings.encoder_bits = args.encoder_bits.unwrap_or(settings.encoder_bits);
    settings.seed = args.seed.unwrap_or(settings.seed);
    settings.journal_noise = args.journal_noise.unwrap_or(settings.journal_noise);
    if let Some((robots, logs)) = args.fleet {
        settings.fleet = Some(FleetTable { robots, logs, ..settings.fleet.unwrap_or_default() });
    }
    Ok(settings)
}

/// Writes the logs of a virtual fleet, their manifest and the truth.
fn fleet(args: &SimulateArgs, settings: &SimulateSettings) -> Result<u8, Failure> {
    if args.clean.is_some() || args.truth.is_some() {
        return Err(Failure::Usage(
            "--clean and --truth: expected one log beside them, found a fleet".to_owned(),
            "the truth of a fleet is `truth.json` in the folder of --out",
        ));
    }
    let inputs: Vec<&Path> = std::iter::once(&args.robot.robot)
        .chain(&args.config)
        .chain(&args.follow)
        .map(PathBuf::as_path)
        .collect();
    let robot = load_robot(&args.robot)?;
    let virtual_fleet = VirtualFleet::new(&robot, settings)?;
    let about: Vec<VirtualLog> = (0..virtual_fleet.len()).map(|k| virtual_fleet.about(k)).collect();
    let mut files = vec![args.out.join("manifest.csv"), args.out.join("truth.json")];
    files.extend(about.iter().map(|log| args.out.join("logs").join(&log.file)));
    let set = outputs::prepare_folder(&files, &inputs, args.force)?;
    let progress = Progress::new(args.print.quiet);
    for (k, log) in about.iter().enumerate() {
        progress.counted(k, about.len(), log.file.clone());
        let made = virtual_fleet.log(&robot, k)?;
        let signals = [("q", &made.position), (EFFORT, &made.effort)];
        write(&set, 2 + k, &made, &signals, &made.channels)?;
    }
    drop(progress);
    let mut manifest = "log,robot,start".to_owned()
        + if about.iter().all(|log| log.temperature.is_some()) { ",temperature\n" } else { "\n" };
    for log in &about {
        let temperature = log.temperature.map_or_else(String::new, |t| format!(",{t}"));
        manifest += &format!("logs/{},{},{}{temperature}\n", log.file, log.robot, log.start_s);
    }
    set.write(0, manifest.as_bytes())?;
    let truth = serde_json::json!({
        "schema": "dynid-fleet-truth/1",
        "type": virtual_fleet.nominal.iter().cloned().collect::<std::collections::BTreeMap<String, f64>>(),
        "changes": virtual_fleet.changes,
        "outliers": virtual_fleet.outliers,
        "logs": about,
    });
    let text = serde_json::to_string_pretty(&truth).map_err(|e| Failure::Output(e.into()))? + "\n";
    set.write(1, text.as_bytes())?;
    set.publish()?;
    let told = serde_json::json!({ "folder": args.out.display().to_string(), "logs": about.len(), "changes": virtual_fleet.changes });
    if args.print.json {
        json(&told)?;
    }
    let notes = Notes::new(args.print.quiet);
    notes.tell(&format!(
        "{} logs written to {}, with manifest.csv and truth.json",
        about.len(),
        args.out.display()
    ));
    Ok(0)
}

/// What was simulated, for programs.
fn summary(log: &SimulatedLog, args: &SimulateArgs) -> serde_json::Value {
    serde_json::json!({
        "log": args.out.display().to_string(),
        "samples": log.time.len(),
        "joints": log.joints,
        "warnings": log.warnings,
        "experiment": log.experiment.as_ref().map(in_json),
        "clearance": log.clearance.as_ref().map(clearance_in_json),
    })
}

/// Tells what was simulated, and what is not as one would expect.
fn tell(log: &SimulatedLog, out: &Path, notes: Notes) {
    let place = if is_stdout(out) { "standard output".into() } else { out.to_string_lossy() };
    notes.tell(&format!("{} samples of {} joints written to {place}", log.time.len(), log.joints.len()));
    if let Some(e) = log.experiment.as_ref().filter(|e| e.saturated_ticks > 0) {
        notes.tell(&format!(
            "efforts were cut off at their limits at {} of {} control ticks",
            e.saturated_ticks, e.ticks
        ));
    }
    notes.warnings(&log.warnings);
    if let Some(clearance) = &log.clearance {
        in_words(clearance).iter().for_each(|line| notes.tell(line));
    }
}

/// True parameters as JSON.
fn truth(log: &SimulatedLog) -> Result<String, Failure> {
    let mut truth: serde_json::Map<String, serde_json::Value> =
        log.truth.iter().map(|(n, v)| (n.clone(), (*v).into())).collect();
    truth.insert("schema".to_owned(), "dynid-truth/1".into());
    if let Some(experiment) = &log.experiment {
        truth.insert("experiment".to_owned(), in_json(experiment));
    }
    if let Some(clearance) = &log.clearance {
        truth.insert("clearance".to_owned(), clearance_in_json(clearance));
    }
    let text = serde_json::to_string_pretty(&truth).map_err(|e| Failure::Output(e.into()))?;
    Ok(text + "\n")
}

fn read_settings(path: &Path) -> Result<SimulateSettings, Failure> {
    let text = dynid::io::input::read_text(path)
        .map_err(|source| dynid::Error::Read { file: path.to_owned(), source })?;
    let mut settings = SimulateSettings::parse(&text, &path.display().to_string())?;
    let folder = path.parent().unwrap_or(Path::new(""));
    settings.follow = settings.follow.map(|f| folder.join(f));
    settings.drives = settings.drives.map(|f| folder.join(f));
    Ok(settings)
}

fn in_json(experiment: &ExperimentSummary) -> serde_json::Value {
    let ExperimentSummary { energy, integration, ripple, .. } = experiment;
    serde_json::json!({
        "imperfections": experiment.imperfections,
        "sign_width": experiment.sign_width,
        "ripple": ripple.iter().map(|r| [r.amplitude, r.cycles, r.phase]).collect::<Vec<_>>(),
        "ticks": experiment.ticks,
        "saturated_ticks": experiment.saturated_ticks,
        "dropped_rows": experiment.dropped_rows,
        "integration_steps": integration.accepted,
        "rejected_steps": integration.rejected,
        "energy_before_J": [energy.before.kinetic, energy.before.potential],
        "energy_after_J": [energy.after.kinetic, energy.after.potential],
        "drive_work_J": energy.drive_work,
        "element_work_J": energy.element_work,
        "energy_residual_J": energy.residual(),
    })
}

/// What journals did, a line each, and where the energy went.
fn in_words(c: &ClearanceSummary) -> Vec<String> {
    let journal = |j: &dynid::simulate::JournalSummary| {
        format!(
            "{}: in contact {:.2} % of the time ({} onsets, {} losses), penetration up to {:.3} µm, normal force up to {:.1} N, \
             friction moment {:.3e} N m rms",
            j.joint,
            100.0 * j.contact_share,
            j.onsets,
            j.losses,
            1e6 * j.largest_penetration,
            j.largest_normal_force,
            j.friction_moment_rms
        )
    };
    let e = &c.energy;
    let energy = format!(
        "energy of bodies and contacts, J: drives {:.4e}, gained by bodies {:.4e} and contacts {:.1e}, lost to damping {:.1e} and \
         bearing friction {:.4e}, unbalanced {} of what was exchanged",
        e.drives,
        e.bodies,
        e.contacts,
        e.damping,
        e.friction,
        e.relative_error().map_or_else(|| "nothing".to_owned(), |x| format!("{x:.1e}"))
    );
    c.journals.iter().map(journal).chain([energy]).collect()
}

fn clearance_in_json(c: &ClearanceSummary) -> serde_json::Value {
    let journals = c.journals.iter().enumerate().map(|(k, j)| {
        let events = c.events.iter().filter(|e| e.joint == k).map(|e| match e.kind {
            ContactEventKind::Onset(speed) => serde_json::json!({ "time": e.time, "onset_speed": speed }),
            ContactEventKind::Loss => serde_json::json!({ "time": e.time, "loss": true }),
        });
        serde_json::json!({
            "joint": j.joint,
            "contact_share": j.contact_share,
            "onsets": j.onsets,
            "losses": j.losses,
            "largest_penetration": j.largest_penetration,
            "largest_normal_force": j.largest_normal_force,
            "friction_moment_rms": j.friction_moment_rms,
            "events": events.collect::<Vec<_>>(),
        })
    });
    let e = &c.energy;
    serde_json::json!({
        "settle_s": c.settle_s,
        "journals": journals.collect::<Vec<_>>(),
        "swing_hz": c.swing_hz,
        "needed_rate_hz": c.needed_rate_hz,
        "drive_work_J": e.drives,
        "bodies_gain_J": e.bodies,
        "contacts_gain_J": e.contacts,
        "damping_loss_J": e.damping,
        "friction_loss_J": e.friction,
        "energy_residual_J": e.unbalanced(),
        "energy_relative_error": e.relative_error(),
        "integration_steps": c.count.steps,
        "rejected_steps": c.count.repeated,
    })
}

fn write(
    set: &Outputs,
    number: usize,
    log: &SimulatedLog,
    signals: &[(&str, &Vec<Vec<f64>>)],
    channels: &[(String, Vec<f64>)],
) -> Result<(), Failure> {
    let mut header = vec!["t".to_owned()];
    let mut columns: Vec<&[f64]> = vec![&log.time];
    for (name, signal) in signals {
        for (k, (joint, values)) in log.joints.iter().zip(*signal).enumerate() {
            if *name == EFFORT && log.undriven[k] {
                continue;
            }
            header.push(format!("{name}_{joint}"));
            columns.push(values);
        }
    }
    for (name, values) in channels {
        header.push(name.clone());
        columns.push(values);
    }
    set.write_table(number, &header, &columns)
}
