//! A first configuration for a robot and its logs: what is found out is written with its reason, what is not is asked or left
//! open.

mod columns;
mod question;
mod text;
mod toml_text;

use std::path::{Path, PathBuf};

use dynid_logs::MappingSpec;

use crate::config::{Config, LogConfig};
use crate::log::Log;
use crate::robot::{Robot, RobotOptions};
use crate::{Error, logs};

pub use question::Question;

/// Most questions about one log.
const MOST_QUESTIONS: usize = 12;
/// Shortest record of which a part is kept for validation, s.
const SHORTEST_TO_SPLIT: f64 = 8.0;
/// Part of the only log that is identified from.
const TRAINING_SHARE: f64 = 0.8;

/// What a configuration is drafted from.
#[derive(Debug, Clone)]
pub struct DraftSettings {
    /// Robot file.
    pub robot: PathBuf,
    /// Logs, at least one; of several the last one is kept for validation.
    pub logs: Vec<PathBuf>,
    /// What is known of their columns.
    pub columns: MappingSpec,
    /// Folder that the configuration will be in, which paths in it are relative to. Default: paths stay as they are given.
    pub folder: Option<PathBuf>,
}

/// A drafted configuration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Draft {
    /// The configuration, a TOML text.
    pub text: String,
    /// What has to be filled in, each with its line as it stands in the text; empty: the configuration is complete.
    pub open: Vec<Question>,
    /// What was found out, in words.
    pub found: Vec<String>,
}

/// Drafts a configuration. `ask` is given what the logs do not tell, and gives the answer, or `None` to leave it open.
///
/// A complete draft was read back: its robot and its logs can be loaded as it says.
///
/// # Errors
/// Robot files and logs that cannot be read.
pub fn draft(
    settings: &DraftSettings,
    ask: &mut dyn FnMut(&Question) -> Option<String>,
) -> Result<Draft, Error> {
    let robot = Robot::load(&settings.robot, &RobotOptions::default())?;
    let Some(first) = settings.logs.first() else {
        return Err(Error::setting("log", "at least one log", "none"));
    };
    let mut reading = Reading {
        spec: settings.columns.clone(),
        trial: settings.columns.clone(),
        open: Vec::new(),
        degrees: None,
    };
    let loaded = reading.of_log(first, &robot, ask)?;
    let mut found = Vec::new();
    if let Some(loaded) = &loaded {
        found
            .extend(loaded.source.notes.iter().map(|n| format!("{}: {} ({})", n.setting, n.value, n.reason)));
    }
    for other in settings.logs[1..].iter().filter(|_| loaded.is_some()) {
        logs::load_as_it_is(&entry(other), &robot.axes, &reading.trial, None)?;
    }
    let text = text::write(settings, &robot, &reading, loaded.as_ref());
    if reading.open.is_empty() {
        read_back(&text, settings, &robot)?;
    }
    Ok(Draft { text, open: reading.open, found })
}

/// Loads everything as a configuration says.
fn read_back(text: &str, settings: &DraftSettings, robot: &Robot) -> Result<(), Error> {
    let config = Config::parse(text, "the configuration")?;
    for log in config.log.iter().chain(&config.validation) {
        let folder = settings.folder.clone().unwrap_or_default();
        let log = LogConfig { path: folder.join(&log.path), ..log.clone() };
        logs::load_as_it_is(&log, &robot.axes, &config.columns, None)?;
    }
    Ok(())
}

fn entry(path: &Path) -> LogConfig {
    LogConfig { path: path.to_owned(), ..LogConfig::default() }
}

/// What is known of the columns, and what is open.
pub(crate) struct Reading {
    /// As the configuration will say.
    pub(crate) spec: MappingSpec,
    /// With stand-ins for what is open, so that the rest can be found out.
    pub(crate) trial: MappingSpec,
    pub(crate) open: Vec<Question>,
    /// Why positions are taken for degrees, if they are.
    pub(crate) degrees: Option<String>,
}

impl Reading {
    /// States positions in degrees, and velocities in what agrees with them.
    fn in_degrees(&mut self, loaded: &Log, reason: String) {
        let (position, velocity) = columns::in_degrees(loaded);
        for spec in [&mut self.spec, &mut self.trial] {
            spec.position = Some(position.clone());
            if velocity.is_some() {
                spec.velocity.clone_from(&velocity);
            }
        }
        self.degrees = Some(reason);
    }

    /// Reads a log, asking for what it takes; `None`: it cannot be read before something is filled in.
    fn of_log(
        &mut self,
        path: &Path,
        robot: &Robot,
        ask: &mut dyn FnMut(&Question) -> Option<String>,
    ) -> Result<Option<Log>, Error> {
        for _ in 0..MOST_QUESTIONS {
            let error = match logs::load_as_it_is(&entry(path), &robot.axes, &self.trial, None) {
                Ok(loaded) => match crate::log::degrees(&loaded, &robot.axes) {
                    Some(error) if self.degrees.is_none() => {
                        self.in_degrees(&loaded, error.to_string());
                        continue;
                    }
                    _ => return Ok(Some(loaded)),
                },
                Err(error) => error,
            };
            if question::settle(&error, &mut self.spec) {
                question::settle(&error, &mut self.trial);
                continue;
            }
            let Some(question) = Question::about(&error, robot) else { return Err(error) };
            match ask(&question).filter(|answer| !answer.trim().is_empty()) {
                Some(answer) => {
                    if !(question.take(&answer, &mut self.spec) && question.take(&answer, &mut self.trial)) {
                        return Err(Error::setting(&question.key, &question.expected, answer.trim()));
                    }
                }
                None => {
                    let goes_on = question.stand_in(&mut self.trial);
                    self.open.push(question);
                    if !goes_on {
                        return Ok(None);
                    }
                }
            }
        }
        Ok(None)
    }
}
