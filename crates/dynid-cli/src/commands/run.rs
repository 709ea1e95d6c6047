//! The configuration of a run: a file, or a robot file with logs.

use std::path::{Path, PathBuf};

use dynid::config::{Config, LogConfig, is_configuration};
use dynid_terminal::message::{Failure, Notes};

/// The logs of the command line.
pub(super) struct GivenLogs<'a> {
    /// In place of those of a configuration.
    pub(super) paths: &'a [PathBuf],
    /// First and last data row of every training log.
    pub(super) rows: Option<(usize, usize)>,
}

/// The configuration `input`, its logs replaced by those given; or one of the robot file `input` and these logs.
///
/// # Errors
/// Bad input; a robot file without logs.
pub(super) fn configuration(input: &Path, logs: &GivenLogs<'_>, notes: Notes) -> Result<Config, Failure> {
    let mut config = match (is_configuration(input), logs.paths) {
        (true, []) => Config::read(input)?,
        (true, paths) => {
            let mut config = Config::read_for_stream(input)?;
            replace(&mut config, paths, notes);
            config.find_logs()?;
            config
        }
        (false, []) => return Err(without_logs(input)),
        (false, paths) => Config {
            robot: input.to_owned(),
            log: paths.iter().map(|p| plain(p)).collect(),
            ..Config::default()
        },
    };
    if logs.rows.is_some() {
        config.log.iter_mut().for_each(|log| log.rows = logs.rows);
    }
    Ok(config)
}

/// Puts logs in the place of those of a configuration, and tells what goes with these.
pub(super) fn replace(config: &mut Config, paths: &[PathBuf], notes: Notes) {
    let own: Vec<String> = config
        .log
        .iter()
        .filter(|log| **log != plain(&log.path))
        .map(|log| log.path.display().to_string())
        .collect();
    if !own.is_empty() {
        notes.tell(&format!(
            "note: --log takes the place of the logs of the configuration; what it states of {} alone does not count",
            own.join(", ")
        ));
    }
    config.log = paths.iter().map(|path| plain(path)).collect();
}

/// A log of which nothing is said but where it is.
pub(super) fn plain(path: &Path) -> LogConfig {
    LogConfig { path: path.to_owned(), ..LogConfig::default() }
}

/// What is wrong with a file that is no configuration where no logs are given.
fn without_logs(input: &Path) -> Failure {
    match (dynid::io::robot::read(input), Config::read(input)) {
        (Err(_), Err(error)) => error.into(),
        _ => Failure::Usage(
            format!("{}: expected a configuration, found a robot file without --log", input.display()),
            "add --log LOG, or give a configuration",
        ),
    }
}
