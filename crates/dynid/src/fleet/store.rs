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

use dynid_files::digest::sha256;
use dynid_files::output::write_atomically;
use dynid_identify::reduction::{ReducedLog, Reduction};
use rayon::prelude::*;

use super::FleetFault;
use super::failure::{Failure, FailureCode};
use super::manifest::Entry;
use super::one_log::{LogReducer, Made, StoreReading, is_id};
use super::read::{FAILED, RECIPE, REDUCED, listed};
use crate::Error;
use crate::reduce::Recipe;

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

/// A folder of factors by one recipe.
#[derive(Debug)]
pub struct FactorStore {
    folder: PathBuf,
    reducer: LogReducer,
}

/// Files of a log, of which one is there at most.
struct Place {
    reduced: PathBuf,
    refused: PathBuf,
}

impl FactorStore {
    /// Opens a folder for logs to be reduced by a recipe; makes it if it is not there.
    ///
    /// # Errors
    /// [`FleetFault::OtherRecipe`] if the folder holds factors of another recipe; [`Error::Output`]; as [`Recipe::reducer`].
    pub fn create(folder: &Path, recipe: Recipe, reading: StoreReading) -> Result<FactorStore, Error> {
        let at = folder.join(RECIPE);
        if at.exists() {
            let (expected, found) = (crate::reduce::read(&at)?.recipe().hash(), recipe.hash());
            if found != expected {
                let folder = folder.display().to_string();
                return Err(FleetFault::OtherRecipe { folder, expected, found }.into());
            }
        } else {
            make_folder(folder)?;
            write_atomically(&at, &Reduction::without_logs(recipe.clone()).to_bytes())?;
        }
        Ok(FactorStore { folder: folder.to_owned(), reducer: LogReducer::new(recipe, reading)? })
    }

    /// Opens a folder that is there; logs are read as those that taught its recipe.
    ///
    /// # Errors
    /// [`Error::Read`] where there is no such folder or no recipe in it; as [`Recipe::reducer`].
    pub fn open(folder: &Path) -> Result<FactorStore, Error> {
        let recipe = crate::reduce::read(&folder.join(RECIPE))?.recipe().clone();
        let reading = StoreReading::of(&recipe);
        Ok(FactorStore { folder: folder.to_owned(), reducer: LogReducer::new(recipe, reading)? })
    }

    /// What reduces single logs.
    pub fn reducer(&self) -> &LogReducer {
        &self.reducer
    }

    /// Number of logs whose factors are there.
    ///
    /// # Errors
    /// [`Error::Read`].
    pub fn count(&self) -> Result<usize, Error> {
        let files = listed(&self.folder)?;
        Ok(files.iter().filter(|file| file.extension().is_some_and(|e| e == REDUCED)).count())
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
        let id = match self.reducer.id(entry) {
            Ok(id) => id,
            // What was not there may come: nothing is kept.
            Err(failure) => return Ok(Outcome::Failed(*failure)),
        };
        let place = self.place(&id);
        if self.holds(&place) {
            return Ok(Outcome::Known);
        }
        if let Ok(bytes) = fs::read(&place.refused)
            && let Ok(failure) = serde_json::from_slice(&bytes)
        {
            return Ok(Outcome::Failed(failure));
        }
        let made = self.reducer.identified(entry, id);
        self.write(&place, &made)
    }

    /// Keeps what a [`LogReducer`] of the same recipe made of a log, by its bytes. What is there already is left as it is.
    ///
    /// Of a log that could not be opened nothing is kept: it may come.
    ///
    /// # Errors
    /// [`FleetFault::Kept`] for other bytes; as [`ReducedLog::from_bytes`]; [`Error::Output`].
    pub fn put(&self, bytes: &[u8]) -> Result<Outcome, Error> {
        let other =
            |found: String| FleetFault::Kept { expected: "the factors of a log, or a failure", found };
        if bytes.first() == Some(&b'{') {
            let failure: Failure = serde_json::from_slice(bytes).map_err(|e| other(e.to_string()))?;
            let place = match &failure.id {
                Some(id) if is_id(id) => self.place(id),
                Some(id) => return Err(other(format!("a failure with the id `{id}`")).into()),
                None if failure.code == FailureCode::Unreadable => return Ok(Outcome::Failed(failure)),
                None => self.unidentified(&failure),
            };
            if self.holds(&place) {
                return Ok(Outcome::Known);
            }
            return self.write(&place, &Made::Failure(failure));
        }
        let log: ReducedLog = self.reducer.read(bytes, "bytes to be kept")?;
        let id = log.facts.id.as_deref().filter(|id| is_id(id) && log.facts.origin.is_some());
        let id = id.ok_or_else(|| other(format!("factors of {} without robot and id", log.facts.name)))?;
        let place = self.place(id);
        if self.holds(&place) {
            return Ok(Outcome::Known);
        }
        self.write(&place, &Made::Factors(Box::new(log)))
    }

    /// Keeps a log as failed whose process ended without a result when it had that log alone. It is forgotten once the log was reduced.
    ///
    /// # Errors
    /// [`Error::Output`].
    pub fn fail(&self, log: &str, robot: &str, message: &str) -> Result<Failure, Error> {
        let failure = Failure {
            log: log.to_owned(),
            robot: robot.to_owned(),
            code: FailureCode::WorkerLost,
            message: message.to_owned(),
            hint: Some(
                "reduce this log alone to see why: `dynid reduce TYPE.factors --log LOG --out one.factors`"
                    .to_owned(),
            ),
            id: None,
        };
        self.write(&self.unidentified(&failure), &Made::Failure(failure.clone()))?;
        Ok(failure)
    }

    /// Where a log is kept.
    fn place(&self, id: &str) -> Place {
        let folder = self.folder.join(&id[..2]);
        Place {
            reduced: folder.join(format!("{id}.{REDUCED}")),
            refused: folder.join(format!("{id}.{FAILED}")),
        }
    }

    /// Where a failure is kept of a log that is known by its name alone.
    fn unidentified(&self, failure: &Failure) -> Place {
        self.place(&sha256(format!("by name\n{}\n{}", failure.log, failure.robot).as_bytes())[..32])
    }

    /// Whether the factors of a log are there and whole.
    fn holds(&self, place: &Place) -> bool {
        fs::read(&place.reduced)
            .is_ok_and(|bytes| self.reducer.read(&bytes, &place.reduced.display().to_string()).is_ok())
    }

    fn write(&self, place: &Place, made: &Made) -> Result<Outcome, Error> {
        let (path, outcome) = match made {
            Made::Factors(_) => (&place.reduced, Outcome::Reduced),
            Made::Failure(failure) => (&place.refused, Outcome::Failed(failure.clone())),
        };
        make_folder(path.parent().unwrap_or(&self.folder))?;
        write_atomically(path, &self.reducer.to_bytes(made))?;
        Ok(outcome)
    }
}

fn make_folder(folder: &Path) -> Result<(), Error> {
    fs::create_dir_all(folder).map_err(|error| {
        Error::Output(dynid_files::OutputError::Unwritable { file: folder.display().to_string(), error })
    })
}
