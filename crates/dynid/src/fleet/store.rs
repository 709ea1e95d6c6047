//! A folder of factors, one file per log.
//!
//! | file | |
//! |---|---|
//! | `recipe.factors` | the recipe, a factor file without logs |
//! | `ab/abcd….factors` | a log that was reduced |
//! | `ab/abcd….failed.json` | a log that could not be, and why |
//!
//! Names follow from what goes in: the bytes of the log, its origin, the recipe, how columns are read, and the version of the numerics. What is
//! there is not made again; files appear whole or not at all; so that any number of processes may fill a folder, be killed, and begin again.

use std::fs;
use std::path::{Path, PathBuf};

use dynid_identify::reduction::{ReducedLog, Reducer, Reduction};
use dynid_io::MappingSpec;
use dynid_io::digest::sha256;
use dynid_record::words;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::FleetFault;
use super::manifest::Entry;
use crate::Error;
use crate::config::{LogConfig, MotorSide};
use crate::reduce::{Recipe, reduce_log};

/// Raised whenever the bits of a reduction change, so that factors of before are made anew.
pub const NUMERICS: u32 = 1;

const RECIPE: &str = "recipe.factors";
const REDUCED: &str = "factors";
const FAILED: &str = "failed.json";

/// A log that could not be reduced.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Failure {
    /// The log, as the manifest states it.
    pub log: String,
    /// Its robot.
    pub robot: String,
    /// Which kind of fault.
    pub code: FailureCode,
    /// What is wrong.
    pub message: String,
    /// What can be done about it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hint: Option<String>,
}

words! {
    /// Kinds of faults of logs.
    FailureCode {
        /// The file is not there, or cannot be opened.
        Unreadable = "unreadable",
        /// Columns, units or numbers are not what a log has.
        Malformed = "malformed",
        /// The pre-flight refuses the log: nonsense would come of it.
        Preflight = "preflight",
        /// Another sample rate, or a joint without a column: not a log of this recipe.
        RecipeMismatch = "recipe_mismatch",
        /// Nothing is left of the log behind kernel and mask.
        NoRows = "no_rows",
        /// The factors of the log cannot be read.
        Damaged = "damaged",
        /// The same log is stated for several robots.
        TwoRobots = "two_robots",
    }
}

impl FailureCode {
    fn of(error: &Error) -> FailureCode {
        use crate::reduce::ReductionError as Reduction;
        match error {
            Error::Read { .. } => FailureCode::Unreadable,
            Error::Reduction(Reduction::Rate { .. } | Reduction::NotLogged { .. }) => {
                FailureCode::RecipeMismatch
            }
            Error::Reduction(Reduction::NoRows { .. }) => FailureCode::NoRows,
            Error::PreflightFault(_) => FailureCode::Preflight,
            _ => FailureCode::Malformed,
        }
    }
}

/// What became of a log.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// It was reduced now.
    Reduced,
    /// It had been before.
    Known,
    /// It cannot be.
    Failed(Failure),
}

/// How logs of a manifest are read.
#[derive(Debug, Clone, Default)]
pub struct StoreReading {
    /// Columns.
    pub columns: MappingSpec,
    /// Where efforts are those of motors.
    pub motor_side: Option<MotorSide>,
}

/// A folder of factors by one recipe.
#[derive(Debug)]
pub struct FactorStore {
    folder: PathBuf,
    reducer: Reducer,
    recipe_sha256: String,
    reading: StoreReading,
    /// What enters the name of every file beside log and origin.
    salt: String,
}

impl FactorStore {
    /// Opens a folder for logs to be reduced by a recipe; makes it if it is not there.
    ///
    /// # Errors
    /// [`FleetFault::OtherRecipe`] if the folder holds factors of another recipe; [`Error::Output`]; as [`Recipe::reducer`].
    pub fn create(folder: &Path, recipe: Recipe, reading: StoreReading) -> Result<FactorStore, Error> {
        let recipe_sha256 = recipe.hash();
        let at = folder.join(RECIPE);
        if at.exists() {
            let found = crate::reduce::read(&at)?.recipe().hash();
            if found != recipe_sha256 {
                let folder = folder.display().to_string();
                return Err(FleetFault::OtherRecipe { folder, expected: found, found: recipe_sha256 }.into());
            }
        } else {
            make_folder(folder)?;
            dynid_io::output::write_atomically(&at, &Reduction::without_logs(recipe.clone()).to_bytes())?;
        }
        // Settings as text: the same for the same settings, whatever order they were given in.
        let side =
            serde_json::to_string(&reading.motor_side).unwrap_or_else(|e| unreachable!("plain data: {e}"));
        let columns =
            serde_json::to_string(&reading.columns).unwrap_or_else(|e| unreachable!("plain data: {e}"));
        let salt = format!("{recipe_sha256}\n{NUMERICS}\n{}\n{columns}\n{side}\n", env!("CARGO_PKG_VERSION"));
        Ok(FactorStore {
            folder: folder.to_owned(),
            reducer: recipe.reducer()?,
            recipe_sha256,
            reading,
            salt,
        })
    }

    /// Reduces logs that are not there yet, several at a time; `progress` hears of every log as it is done, in any order.
    ///
    /// A log that cannot be reduced is an outcome, kept in the folder, and no error.
    ///
    /// # Errors
    /// [`Error::Output`]: the folder cannot be written.
    pub fn reduce(
        &self,
        entries: &[Entry],
        progress: &(dyn Fn(&Entry, &Outcome) + Sync),
    ) -> Result<Vec<Outcome>, Error> {
        let one = |entry: &Entry| {
            let outcome = self.reduce_one(entry)?;
            progress(entry, &outcome);
            Ok(outcome)
        };
        entries.par_iter().map(one).collect()
    }

    fn reduce_one(&self, entry: &Entry) -> Result<Outcome, Error> {
        let failed = |error: &Error| Failure {
            log: entry.log.clone(),
            robot: entry.origin.robot.clone(),
            code: FailureCode::of(error),
            message: error.to_string(),
            hint: error.hint(),
        };
        let source = match self.digest(entry) {
            Ok(source) => source,
            // What was not there may come: nothing is kept.
            Err(error) => return Ok(Outcome::Failed(failed(&error))),
        };
        let origin = serde_json::to_string(&entry.origin).unwrap_or_else(|e| unreachable!("plain data: {e}"));
        let name = sha256(format!("{source}\n{origin}\n{}", self.salt).as_bytes())[..32].to_owned();
        let folder = self.folder.join(&name[..2]);
        let (reduced, refused) =
            (folder.join(format!("{name}.{REDUCED}")), folder.join(format!("{name}.{FAILED}")));
        if let Ok(bytes) = fs::read(&reduced)
            && self.read_log(&bytes, &reduced).is_ok()
        {
            return Ok(Outcome::Known);
        }
        if let Ok(bytes) = fs::read(&refused)
            && let Ok(failure) = serde_json::from_slice(&bytes)
        {
            return Ok(Outcome::Failed(failure));
        }
        make_folder(&folder)?;
        match self.reduced(entry) {
            Ok(log) => {
                dynid_io::output::write_atomically(&reduced, &log.to_bytes(&self.recipe_sha256))?;
                Ok(Outcome::Reduced)
            }
            Err(error) => {
                let failure = failed(&error);
                let text = serde_json::to_string_pretty(&failure)
                    .unwrap_or_else(|e| unreachable!("plain data: {e}"));
                dynid_io::output::write_atomically(&refused, text.as_bytes())?;
                Ok(Outcome::Failed(failure))
            }
        }
    }

    /// Hash of the bytes of a log, and of which part of the file it is.
    fn digest(&self, entry: &Entry) -> Result<String, Error> {
        let file = dynid_io::log::LogFile::of(&entry.path);
        let unreadable = |source| Error::Read { file: entry.log.clone().into(), source };
        let hash = match file.path.is_dir() {
            true => folder_digest(&file.path),
            false => dynid_io::digest::sha256_of_file(&file.path),
        };
        let hash = hash.map_err(unreadable)?;
        Ok(match file.member {
            Some(member) => format!("{hash}#{member}"),
            None => hash,
        })
    }

    fn reduced(&self, entry: &Entry) -> Result<ReducedLog, Error> {
        let config = LogConfig { path: entry.path.clone(), ..LogConfig::default() };
        let StoreReading { columns, motor_side } = &self.reading;
        let log = reduce_log(&self.reducer, &config, columns, motor_side.as_ref())?;
        let mut log = log.in_one_block();
        log.facts.origin = Some(entry.origin.clone());
        // Names as the manifest has them: the same bytes wherever the logs lie.
        log.facts.log.name.clone_from(&entry.log);
        log.facts.inputs.iter_mut().for_each(|input| input.path.clone_from(&entry.log));
        Ok(log)
    }

    fn read_log(&self, bytes: &[u8], path: &Path) -> Result<ReducedLog, Error> {
        let by = (self.reducer.recipe(), self.recipe_sha256.as_str());
        Ok(ReducedLog::from_bytes(bytes, &path.display().to_string(), by)?)
    }
}

/// Hash of names, sizes and times of the files of a dataset: weaker than one of their bytes, which may be many.
fn folder_digest(folder: &Path) -> std::io::Result<String> {
    let mut out = Vec::new();
    let mut left = vec![folder.to_owned()];
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

fn make_folder(folder: &Path) -> Result<(), Error> {
    fs::create_dir_all(folder).map_err(|error| {
        Error::Output(dynid_io::OutputError::Unwritable { file: folder.display().to_string(), error })
    })
}

/// What a folder of factors holds.
#[derive(Debug)]
pub struct StoreContent {
    /// The recipe.
    pub recipe: Recipe,
    /// Logs in the order of their keys, each once.
    pub logs: Vec<ReducedLog>,
    /// Logs that could not be reduced, by robot and name, and files that cannot be read.
    pub failures: Vec<Failure>,
    /// Logs that were there again under another name.
    pub repeated: usize,
    /// Logs that are stated several times with different dates or numbers; the first by name was taken.
    pub contradicting: usize,
}

/// Reads folders of factors by one recipe.
///
/// Files that are damaged are failures, and so are logs that are stated for two robots: neither copy is counted.
///
/// # Errors
/// [`Error::Read`] where there is no such folder or no recipe in it; [`FleetFault::OtherRecipe`].
pub fn read(folders: &[PathBuf]) -> Result<StoreContent, Error> {
    let mut recipe: Option<(Recipe, String)> = None;
    let mut files = Vec::new();
    for folder in folders {
        let own = crate::reduce::read(&folder.join(RECIPE))?.recipe().clone();
        let hash = own.hash();
        match &recipe {
            Some((_, expected)) if *expected != hash => {
                let folder = folder.display().to_string();
                return Err(
                    FleetFault::OtherRecipe { folder, expected: expected.clone(), found: hash }.into()
                );
            }
            Some(_) => {}
            None => recipe = Some((own, hash)),
        }
        files.extend(listed(folder)?);
    }
    let Some((recipe, hash)) = recipe else {
        return Err(FleetFault::NoFolder.into());
    };
    files.sort();
    let read = |path: &PathBuf| -> Result<Result<ReducedLog, Failure>, Error> {
        let bytes = fs::read(path).map_err(|source| Error::Read { file: path.clone(), source })?;
        let name = path.display().to_string();
        let damaged = |message: String, hint: Option<String>| Failure {
            log: name.clone(),
            robot: String::new(),
            code: FailureCode::Damaged,
            message,
            hint,
        };
        if name.ends_with(FAILED) {
            return Ok(Err(serde_json::from_slice(&bytes).unwrap_or_else(|e| damaged(e.to_string(), None))));
        }
        Ok(match ReducedLog::from_bytes(&bytes, &name, (&recipe, &hash)) {
            Ok(log) if log.facts.origin.is_some() => Ok(log),
            Ok(_) => Err(damaged(format!("{name}: the log states no robot"), None)),
            Err(error) => {
                let hint = "remove the file and reduce the log again: what is there is not made twice";
                Err(damaged(error.to_string(), Some(hint.to_owned())))
            }
        })
    };
    let found: Vec<Result<ReducedLog, Failure>> = files.par_iter().map(read).collect::<Result<_, Error>>()?;
    let (mut logs, mut failures) = (Vec::new(), Vec::new());
    for one in found {
        match one {
            Ok(log) => logs.push(log),
            Err(failure) => failures.push(failure),
        }
    }
    let (repeated, contradicting) = once(&mut logs, &mut failures);
    failures.sort_by(|a, b| (&a.robot, &a.log, &a.message).cmp(&(&b.robot, &b.log, &b.message)));
    Ok(StoreContent { recipe, logs, failures, repeated, contradicting })
}

/// Leaves every log once, in the order of the keys; those of two robots become failures. How many were there again, and contradict themselves.
fn once(logs: &mut Vec<ReducedLog>, failures: &mut Vec<Failure>) -> (usize, usize) {
    logs.sort_by(|a, b| (&a.key, &a.facts.name).cmp(&(&b.key, &b.facts.name)));
    let robot = |log: &ReducedLog| log.facts.origin.as_ref().map(|o| o.robot.clone()).unwrap_or_default();
    let mut out: Vec<ReducedLog> = Vec::with_capacity(logs.len());
    let (mut repeated, mut contradicting) = (0, 0);
    let mut rest = std::mem::take(logs).into_iter().peekable();
    while let Some(log) = rest.next() {
        let mut same = vec![log];
        while let Some(next) = rest.next_if(|next| next.key == same[0].key) {
            same.push(next);
        }
        let mut robots: Vec<String> = same.iter().map(robot).collect();
        robots.sort();
        robots.dedup();
        if robots.len() > 1 {
            for log in &same {
                failures.push(Failure {
                    log: log.facts.log.name.clone(),
                    robot: robot(log),
                    code: FailureCode::TwoRobots,
                    message: format!("the same log is stated for {}", robots.join(" and ")),
                    hint: Some(
                        "state in the manifest whose log it is, and reduce into a new folder".to_owned(),
                    ),
                });
            }
            continue;
        }
        repeated += same.len() - 1;
        contradicting += usize::from(same.iter().any(|log| log.facts.origin != same[0].facts.origin));
        out.push(same.swap_remove(0));
    }
    *logs = out;
    (repeated, contradicting)
}

/// Files of a store.
fn listed(folder: &Path) -> Result<Vec<PathBuf>, Error> {
    let unreadable = |path: &Path, source| Error::Read { file: path.into(), source };
    let mut out = Vec::new();
    let entries = |path: &Path| -> Result<Vec<PathBuf>, Error> {
        let found = fs::read_dir(path).and_then(|found| found.map(|e| e.map(|e| e.path())).collect());
        found.map_err(|source| unreadable(path, source))
    };
    for part in entries(folder)? {
        let named = part.file_name().is_some_and(|name| name.len() == 2);
        if !named || !part.is_dir() {
            continue;
        }
        let kept = |path: &PathBuf| {
            let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
            !name.starts_with('.') && (name.ends_with(FAILED) || name.ends_with(REDUCED))
        };
        out.extend(entries(&part)?.into_iter().filter(kept));
    }
    Ok(out)
}
