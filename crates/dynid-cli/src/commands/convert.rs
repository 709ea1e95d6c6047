//! `dynid convert`.

use std::path::{Path, PathBuf};

use dynid::config::{Config, LogConfig};
use dynid::convert::convert;
use dynid::io::MappingSpec;
use dynid::io::table_file::TableFormat;
use dynid::{Robot, RobotOptions};
use dynid_terminal::message::{Failure, Notes};
use dynid_terminal::outputs;
use dynid_terminal::progress::Progress;

use super::apply_log_args;
use crate::args::ConvertArgs;

pub(crate) fn run(args: &ConvertArgs) -> Result<u8, Failure> {
    let inputs: Vec<&Path> = [Some(&args.log), args.robot.as_ref(), args.config.as_ref()]
        .into_iter()
        .flatten()
        .map(PathBuf::as_path)
        .collect();
    match TableFormat::of(&args.out) {
        None => {
            let text =
                format!("OUT: expected .csv, .csv.gz, .parquet, .npz or .mcap, found {}", args.out.display());
            return Err(Failure::Usage(text, "the end of the name says which format to write"));
        }
        Some(TableFormat::Mcap) if args.robot.is_none() => {
            let text = "expected a robot, whose joint states .mcap holds, found none".to_owned();
            return Err(Failure::Usage(text, "add --robot ROBOT, or write another format"));
        }
        Some(_) => {}
    }
    let set = outputs::prepare_files(&[("OUT", args.out.as_path())], &inputs, args.force)?;
    let mut columns = match &args.config {
        Some(path) => Config::read_for_stream(path)?.columns,
        None => MappingSpec { allow_no_effort: true, ..MappingSpec::default() },
    };
    apply_log_args(&mut columns, &args.columns);
    let robot = args.robot.as_ref().map(|path| Robot::load(path, &RobotOptions::default())).transpose()?;
    let log = LogConfig { path: args.log.clone(), rows: args.rows, ..LogConfig::default() };
    let progress = Progress::new(args.quiet);
    progress.doing("reading");
    let converted = convert(&log, &columns, robot.as_ref())?;
    progress.doing("writing");
    converted.write(set.staged(0)).map_err(dynid::Error::from)?;
    drop(progress);
    let notes = Notes::new(args.quiet);
    for note in &converted.notes {
        notes.tell(&format!("{}: {} ({})", note.setting, note.value, note.reason));
    }
    notes.tell(&format!("{} rows, {} columns", converted.rows(), converted.names.len()));
    notes.written(&set.publish()?);
    Ok(0)
}
