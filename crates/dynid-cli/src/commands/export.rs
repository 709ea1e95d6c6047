//! `dynid export`.

use std::path::{Path, PathBuf};

use dynid::config::{Config, LogConfig};
use dynid::estimate::{EXPORT_LOSS_LIMIT, Estimate, FileFit};
use dynid::export::{CheckStates, Exported, IdentifiedRobot, RobotExport, Source, json};
use dynid::io::FileMember;
use dynid::io::MappingSpec;
use dynid_terminal::message::{Failure, Notes, json as print_json, note};
use dynid_terminal::outputs::{self, is_stdout, marked_toml, marked_xml};
use dynid_terminal::progress::Progress;

use super::run::plain;
use super::{apply_log_args, demand_stdout, table};
use crate::args::ExportArgs;

pub(crate) fn run(args: &ExportArgs) -> Result<u8, Failure> {
    let notes = Notes::new(args.print.quiet);
    let mut outputs: Vec<(&str, &Path)> =
        [("--urdf", &args.urdf), ("--mjcf", &args.mjcf), ("--model", &args.model)]
            .into_iter()
            .filter_map(|(argument, path)| Some((argument, path.as_deref()?)))
            .collect();
    if outputs.is_empty() {
        return Err(Failure::Usage(
            "nothing to write: expected at least one of --urdf, --mjcf, --model".to_owned(),
            "for example `dynid export dynid-out/estimate.json --urdf robot.urdf`",
        ));
    }
    if let Some(flag) = args.columns.given().filter(|_| args.log.is_empty()) {
        return Err(Failure::Usage(
            format!("{flag}: expected --log beside it, found none"),
            "it says how a log is read; leave it out",
        ));
    }
    let estimate = Estimate::read(&args.estimate)?;
    let robot = robot_file(args, &estimate)?;
    let inputs: Vec<&Path> = [&args.estimate, &robot]
        .into_iter()
        .chain(&args.log)
        .chain(&args.config)
        .map(PathBuf::as_path)
        .collect();
    let source = Source::read(&robot)?;
    let progress = Progress::new(args.print.quiet);
    progress.doing("reading");
    let identified = dynid::export::IdentifiedRobot::of(&estimate, &args.estimate)?;
    let states = states(args, &estimate, &identified)?;
    let changed = match estimate.robot_file() {
        Some(record) => source.sha256() != Some(record.sha256.as_str()),
        None => false,
    };
    let mut export = RobotExport::new(identified.identified(), &source)?;
    if args.log.is_empty() {
        export = export.with_projections(&estimate.exported.projections);
    }
    if !args.allow_unphysical {
        export.require_physical()?;
    }
    progress.doing("writing and reading back");
    let exported = outputs
        .iter()
        .map(|(argument, path)| {
            let exported = match *argument {
                "--urdf" => export.urdf(&states),
                "--mjcf" => export.mjcf(&states),
                _ => json(&identified.identified(), &states),
            };
            Ok(Made { argument, path, exported: exported? })
        })
        .collect::<Result<Vec<_>, Failure>>()?;
    // Loops stand beside the URDF, which has no place for them.
    let beside = args.urdf.as_ref().filter(|urdf| !is_stdout(urdf)).map(|u| u.with_extension("loops.toml"));
    let models = outputs.len();
    outputs.extend(beside.iter().map(|path| ("--urdf", path.as_path())));
    // Files that an MJCF includes keep their names.
    let included = included(args, &exported)?;
    let more = outputs.len();
    outputs.extend(included.iter().map(|(path, _)| ("--mjcf", path.as_path())));
    let set = outputs::prepare_files(&outputs, &inputs, args.force)?;
    demand_stdout(args.print, &set)?;
    for (number, made) in exported.iter().enumerate() {
        let text = match made.argument {
            "--model" => made.exported.text.clone(),
            _ => marked_xml(&made.exported.text),
        };
        set.write(number, text.as_bytes())?;
    }
    for (number, (_, text)) in included.iter().enumerate() {
        set.write(more + number, marked_xml(text).as_bytes())?;
    }
    let name = args.urdf.as_ref().and_then(|urdf| urdf.file_name());
    let loops = name.and_then(|name| export.loops(&name.to_string_lossy()));
    match (&loops, &beside) {
        (Some(loops), Some(_)) => set.write(models, marked_toml(loops).as_bytes())?,
        (Some(_), None) => {
            return Err(Failure::Usage(
                "--urdf: loops need a file beside the URDF, found `-`".to_owned(),
                "name a file: --urdf robot.urdf",
            ));
        }
        (None, _) => {}
    }
    drop(progress);
    set.publish()?;
    if changed {
        notes.tell(&format!("warning: {} has changed since it was identified", robot.display()));
    }
    for fault in export.faults() {
        notes
            .tell(&format!("warning: link `{}` {}: simulators refuse such a robot", fault.link, fault.fault));
    }
    for (path, _) in &included {
        notes.tell(&format!("written: {} (included)", path.display()));
    }
    if let (Some(path), Some(_)) = (&beside, &loops) {
        notes.tell(&format!("written: {} (its loops)", path.display()));
    }
    for made in &exported {
        made.tell(&states, notes);
        loss(&estimate, made.argument, notes);
    }
    if args.print.json {
        let files: Vec<_> = exported.iter().map(Made::record).collect();
        print_json(&serde_json::json!({
            "files": files,
            "read_back_over": states.describe(),
            "judged": estimate.exported.judged(),
        }))?;
    }
    Ok(0)
}

/// Files that an exported MJCF includes and that change with it: where they go, and their texts.
fn included(args: &ExportArgs, exported: &[Made<'_>]) -> Result<Vec<(PathBuf, String)>, Failure> {
    let folder = args.mjcf.as_ref().filter(|mjcf| !is_stdout(mjcf)).and_then(|mjcf| mjcf.parent());
    let texts = exported.iter().flat_map(|made| &made.exported.included);
    let place = |(name, text): &(String, String)| match folder {
        Some(folder) => Ok((folder.join(name), text.clone())),
        None => Err(Failure::Usage(
            format!("--mjcf: `{name}`, which the robot includes, changes as well, found `-`"),
            "name a file: --mjcf robot.xml",
        )),
    };
    texts.map(place).collect()
}

/// A file that was made.
struct Made<'a> {
    argument: &'a str,
    path: &'a Path,
    exported: Exported,
}

impl Made<'_> {
    fn tell(&self, states: &CheckStates, notes: Notes) {
        let place =
            if is_stdout(self.path) { "standard output".to_owned() } else { self.path.display().to_string() };
        notes.tell(&format!(
            "written: {place} (read back: effort within {:.1e} over {})",
            self.exported.difference,
            states.describe()
        ));
        tell_notes(&self.exported, notes);
    }

    fn record(&self) -> serde_json::Value {
        serde_json::json!({
            "file": self.path.display().to_string(),
            "format": self.argument.trim_start_matches('-'),
            "read_back_difference": self.exported.difference,
            "notes": self.exported.notes,
        })
    }
}

/// Tells what `identify` did with its robot file, of a format (`--urdf`, `--mjcf`).
pub(super) fn tell(
    path: &Path,
    exported: &Result<Exported, dynid::Error>,
    format: &str,
    estimate: &Estimate,
    notes: Notes,
) {
    match exported {
        Ok(exported) => {
            tell_notes(exported, notes);
            loss(estimate, format, notes);
        }
        // A file that is missing is told in any case.
        Err(reason) => note(&format!("not written: {}: {reason}", path.display())),
    }
}

fn tell_notes(exported: &Exported, notes: Notes) {
    exported.notes.iter().for_each(|line| notes.tell(&format!("  {line}")));
}

/// Tells what a file (`--urdf`, `--mjcf`) loses of the identified model, on the log that files were judged on.
fn loss(estimate: &Estimate, argument: &str, notes: Notes) {
    let Some(log) = estimate.exported.judged() else { return };
    let (format, alone, with_rotor): (_, _, Option<&FileFit>) = match argument {
        "--mjcf" => ("MJCF", &log.mjcf, None),
        "--urdf" if log.urdf == log.mjcf => ("URDF", &log.urdf, None),
        "--urdf" => ("URDF", &log.urdf, Some(&log.mjcf)),
        _ => return,
    };
    let percent = |x: Option<f64>| table::number(x);
    let fits = estimate.validation.iter().find(|f| f.log == log.log);
    let model = fits.map_or(&estimate.fit.filtered, |f| &f.filtered).relative_error;
    let rotor = with_rotor.map_or_else(String::new, |fit| {
        format!(", {} % with the rotor inertias added", percent(fit.relative_error))
    });
    notes.tell(&format!(
        "  the {format} predicts {} with an error of {} % of the effort{rotor}, the identified model with {} %",
        log.log,
        percent(alone.relative_error),
        percent(model)
    ));
    notes.tell(&table::loss(&estimate.joints, alone, with_rotor));
    for (fit, what) in [(Some(alone), ""), (with_rotor, " with the rotor inertias added")] {
        let Some(fit) = fit else { continue };
        let pairs = estimate.joints.iter().zip(&fit.loss_percent);
        let above: Vec<String> = pairs
            .filter_map(|(joint, lost)| Some((joint, lost.filter(|l| *l > EXPORT_LOSS_LIMIT)?)))
            .map(|(joint, lost)| format!("{joint} ({lost:.1} %)"))
            .collect();
        if !above.is_empty() {
            notes.tell(&format!(
                "  warning: the {format}{what} loses more than {EXPORT_LOSS_LIMIT} % of the effort of {}: it is not the model that was judged; the JSON of `dynid export --model` is",
                above.join(", ")
            ));
        }
    }
}

fn robot_file(args: &ExportArgs, estimate: &Estimate) -> Result<PathBuf, Failure> {
    const HINT: &str = "say where it is: --robot FILE";
    if let Some(path) = &args.robot {
        return Ok(path.clone());
    }
    let Some(record) = estimate.robot_file() else {
        let text = format!("{}: names no robot file", args.estimate.display());
        return Err(Failure::Usage(text, HINT));
    };
    let path = PathBuf::from(&record.path);
    if !FileMember::of(&path).path.is_file() {
        let text = format!("{}: robot file `{}` is not there", args.estimate.display(), record.path);
        return Err(Failure::Usage(text, HINT));
    }
    Ok(path)
}

fn states(
    args: &ExportArgs,
    estimate: &Estimate,
    identified: &IdentifiedRobot,
) -> Result<CheckStates, Failure> {
    let model = identified.identified().model;
    if args.log.is_empty() {
        return Ok(CheckStates::random(model));
    }
    let (mut columns, motor_side) = match &args.config {
        None => (MappingSpec::default(), None),
        Some(path) => {
            let config = Config::read(path)?;
            (config.columns, config.motor_side)
        }
    };
    apply_log_args(&mut columns, &args.columns);
    let logs: Vec<LogConfig> =
        args.log.iter().map(|path| LogConfig { rows: args.rows, ..plain(path) }).collect();
    Ok(dynid::export::read_states(model, estimate.model.state_hz, &logs, &columns, motor_side.as_ref())?)
}
