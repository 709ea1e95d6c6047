//! One log by a recipe: its factors, or why there are none, as bytes that travel.

use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use dynid_files::digest::sha256;
use dynid_identify::log::Log;
use dynid_identify::reduction::{LogFacts, Origin, ReducedLog, Reducer};
use dynid_identify::settings::{LogSettings, labels};
use dynid_logs::MappingSpec;

use super::failure::Failure;
use super::manifest::Entry;
use crate::Error;
use crate::config::{LogConfig, MotorSide};
use crate::reduce::{Recipe, reduce_log};

/// Raised whenever the bits of a reduction change, so that factors of before are made anew.
pub const NUMERICS: u32 = 1;

/// How log files are read.
#[derive(Debug, Clone, Default)]
pub struct StoreReading {
    /// Columns.
    pub columns: MappingSpec,
    /// Where efforts are those of motors.
    pub motor_side: Option<MotorSide>,
}

impl StoreReading {
    /// As the logs that taught the recipe were read.
    pub fn of(recipe: &Recipe) -> StoreReading {
        let reading = recipe.reading.clone();
        StoreReading { columns: reading.columns, motor_side: reading.motor_side }
    }
}

/// What was made of a log.
#[derive(Debug, Clone, PartialEq)]
pub enum Made {
    /// Its factors.
    Factors(Box<ReducedLog>),
    /// Why there are none.
    Failure(Failure),
}

/// Reduces single logs by a recipe; keeps nothing and writes nothing.
///
/// The same content, name, origin, recipe and reading give the same bytes, wherever the file lies.
#[derive(Debug)]
pub struct LogReducer {
    reducer: Reducer,
    recipe_sha256: String,
    reading: StoreReading,
    /// What enters every id beside log and origin.
    salt: String,
}

impl LogReducer {
    /// `reading`: how files are read, see [`StoreReading::of`].
    ///
    /// # Errors
    /// As [`Recipe::reducer`].
    pub fn new(recipe: Recipe, reading: StoreReading) -> Result<LogReducer, Error> {
        let recipe_sha256 = recipe.hash();
        // Settings as text: the same for the same settings, whatever order they were given in.
        let side =
            serde_json::to_string(&reading.motor_side).unwrap_or_else(|e| unreachable!("plain data: {e}"));
        let columns =
            serde_json::to_string(&reading.columns).unwrap_or_else(|e| unreachable!("plain data: {e}"));
        let salt = format!("{recipe_sha256}\n{NUMERICS}\n{}\n{columns}\n{side}\n", env!("CARGO_PKG_VERSION"));
        Ok(LogReducer { reducer: recipe.reducer()?, recipe_sha256, reading, salt })
    }

    /// The recipe.
    pub fn recipe(&self) -> &Recipe {
        self.reducer.recipe()
    }

    /// The reducer behind it, whose robot logs are read for.
    pub fn reducer(&self) -> &Reducer {
        &self.reducer
    }

    /// Reads and reduces the file of an entry. A log that cannot be reduced is a result.
    pub fn file(&self, entry: &Entry) -> Made {
        match self.id(entry) {
            Ok(id) => self.identified(entry, id),
            Err(failure) => Made::Failure(*failure),
        }
    }

    /// Reduces a log that was read or never was a file; `log`: what reading it gave. A log that cannot be reduced is a result, and so is one that
    /// could not be read.
    pub fn log(&self, name: &str, origin: &Origin, log: Result<Log, Error>) -> Made {
        match log {
            Ok(log) => {
                let id = self.salted(&content(&log), origin);
                self.made(name, origin, id, || self.named(name, log))
            }
            Err(error) => Made::Failure(Failure::of(name, &origin.robot, &error)),
        }
    }

    /// What was made of a log as bytes: a factor file whose recipe lies beside it, or the JSON of a [`Failure`].
    pub fn to_bytes(&self, made: &Made) -> Vec<u8> {
        match made {
            Made::Factors(log) => log.to_bytes(&self.recipe_sha256),
            Made::Failure(failure) => failure.to_json().into_bytes(),
        }
    }

    /// Reads the factors of a log; `name` stands in messages.
    pub(super) fn read(&self, bytes: &[u8], name: &str) -> Result<ReducedLog, Error> {
        Ok(ReducedLog::from_bytes(bytes, name, (self.recipe(), &self.recipe_sha256))?)
    }

    /// Which log an entry is: by the bytes of its file, its origin, the recipe, how it is read, and the version of the numerics.
    pub(super) fn id(&self, entry: &Entry) -> Result<String, Box<Failure>> {
        let file = dynid_files::FileMember::of(&entry.path);
        let unreadable = |source| {
            let error = Error::Read { file: entry.log.clone().into(), source };
            Box::new(Failure::of(&entry.log, &entry.origin.robot, &error))
        };
        let hash = match file.path.is_dir() {
            true => folder_digest(&file.path),
            false => dynid_files::digest::sha256_of_file(&file.path),
        };
        let hash = hash.map_err(unreadable)?;
        let source = match file.member {
            Some(member) => format!("{hash}#{member}"),
            None => hash,
        };
        Ok(self.salted(&source, &entry.origin))
    }

    /// Reduces the file of an entry whose id is known, under the name that is stated: the same bytes wherever the file lies.
    pub(super) fn identified(&self, entry: &Entry, id: String) -> Made {
        // From the root, so that a message which names it is told from one that says something else.
        let path = std::path::absolute(&entry.path).unwrap_or_else(|_| entry.path.clone());
        let told = Names::new(&path, &entry.log);
        let read = || {
            let settings = LogSettings::default();
            let label = labels(std::iter::once((&settings, entry.log.as_str()))).pop();
            let config = LogConfig { path: path.clone(), name: label, ..LogConfig::default() };
            let StoreReading { columns, motor_side } = &self.reading;
            let mut log = reduce_log(&self.reducer, &config, columns, motor_side.as_ref())?;
            told.of_facts(&mut log.facts);
            Ok(log)
        };
        match self.made(&entry.log, &entry.origin, id, read) {
            Made::Failure(failure) => {
                let (message, hint) = (told.of(&failure.message), failure.hint.map(|hint| told.of(&hint)));
                Made::Failure(Failure { message, hint, ..failure })
            }
            made => made,
        }
    }

    fn salted(&self, source: &str, origin: &Origin) -> String {
        let origin = serde_json::to_string(origin).unwrap_or_else(|e| unreachable!("plain data: {e}"));
        sha256(format!("{source}\n{origin}\n{}", self.salt).as_bytes())[..ID].to_owned()
    }

    fn made(
        &self,
        name: &str,
        origin: &Origin,
        id: String,
        reduce: impl FnOnce() -> Result<ReducedLog, Error>,
    ) -> Made {
        // One log of a million must not end the work on all others, whatever is wrong with it. Nothing is changed by what is left half done.
        let failure = match catch_unwind(AssertUnwindSafe(reduce)) {
            Ok(Ok(log)) => {
                // Halves tell how far what logs carry scatters.
                let mut log = log.in_blocks(if self.reducer.recipe().payload().is_some() { 2 } else { 1 });
                log.facts.origin = Some(origin.clone());
                log.facts.id = Some(id);
                return Made::Factors(Box::new(log));
            }
            Ok(Err(error)) => Failure::of(name, &origin.robot, &error),
            Err(_) => Failure::internal(name, &origin.robot),
        };
        Made::Failure(Failure { id: Some(id), ..failure })
    }

    fn named(&self, name: &str, mut log: Log) -> Result<ReducedLog, Error> {
        let (time, joints, channels) = log.log.into_parts();
        log.log = dynid_motion::Log::new(name, time, joints, channels)?;
        log.settings.name = None;
        log.source.inputs.iter_mut().for_each(|input| name.clone_into(&mut input.path));
        self.reducer.reduce(log)
    }
}

/// The path of a log and the name that stands for it.
struct Names {
    path: String,
    file: String,
    log: String,
    short: String,
}

impl Names {
    fn new(path: &Path, log: &str) -> Names {
        let file =
            |path: &Path| path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        Names {
            path: path.display().to_string(),
            file: format!("{}: ", file(path)),
            log: log.to_owned(),
            short: format!("{}: ", file(Path::new(log))),
        }
    }

    /// A message with the name in place of the path.
    fn of(&self, text: &str) -> String {
        let text = text.replace(&self.path, &self.log);
        text.strip_prefix(&self.file).map(|rest| format!("{}{rest}", self.short)).unwrap_or(text)
    }

    fn of_facts(&self, facts: &mut LogFacts) {
        facts.log.name.clone_from(&self.log);
        facts.inputs.iter_mut().for_each(|input| input.path.clone_from(&self.log));
        for caution in &mut facts.cautions {
            (caution.message, caution.remedy) = (self.of(&caution.message), self.of(&caution.remedy));
        }
        for finding in &mut facts.findings {
            (finding.evidence, finding.remedy) = (self.of(&finding.evidence), self.of(&finding.remedy));
        }
    }
}

/// Digits of an id.
const ID: usize = 32;

/// Whether a text is an id: it may name a file.
pub(super) fn is_id(text: &str) -> bool {
    text.len() == ID && text.bytes().all(|b| matches!(b, b'0'..=b'9' | b'a'..=b'f'))
}

/// Hash of the signals of a log and of what was stated with them.
fn content(log: &Log) -> String {
    let mut bytes = b"signals\n".to_vec();
    let mut signal = |name: &str, values: &[f64]| {
        bytes.extend(format!("{} {name}{}\n", name.len(), values.len()).as_bytes());
        values.iter().for_each(|x| bytes.extend(x.to_le_bytes()));
    };
    signal("time", log.log.time());
    for joint in log.log.joints() {
        signal(&joint.name, &joint.position);
        signal("velocity", joint.velocity.as_deref().unwrap_or_default());
        signal("effort", &joint.effort);
    }
    log.log.channels().iter().for_each(|channel| signal(&channel.name, &channel.values));
    let settings = LogSettings { name: None, ..log.settings.clone() };
    bytes.extend(
        serde_json::to_string(&settings).unwrap_or_else(|e| unreachable!("plain data: {e}")).as_bytes(),
    );
    sha256(&bytes)
}

/// Hash of names, sizes and times of the files of a dataset: weaker than one of their bytes, which may be many.
fn folder_digest(folder: &Path) -> std::io::Result<String> {
    let mut out = Vec::new();
    let mut left: Vec<PathBuf> = vec![folder.to_owned()];
    while let Some(next) = left.pop() {
        for entry in fs::read_dir(next)? {
            let path = entry?.path();
            let about = fs::metadata(&path)?;
            if about.is_dir() {
                left.push(path);
            } else {
                let name = path.strip_prefix(folder).unwrap_or(&path).display().to_string();
                out.push(format!("{name} {} {:?}", about.len(), about.modified()?));
            }
        }
    }
    out.sort();
    Ok(sha256(out.join("\n").as_bytes()))
}
