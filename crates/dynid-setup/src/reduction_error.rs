//! What is wrong with factors and recipes.

use dynid_factor::wire::WireError;

/// Why logs cannot be reduced, merged or solved.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ReductionError {
    /// Bytes that are no factors.
    #[error("{file}: {fault}")]
    File {
        /// File.
        file: String,
        /// What is wrong.
        fault: FactorFileFault,
    },
    /// A recipe that contradicts itself.
    #[error("the recipe of the factors contradicts itself: {what}")]
    Contradiction {
        /// What.
        what: String,
    },
    /// Factors of another recipe.
    #[error(
        "the factors of `{log}` were made by another recipe: expected {}, found {}",
        short(expected),
        short(found)
    )]
    OtherRecipe {
        /// First log of them.
        log: String,
        /// Hash of the recipe of the others.
        expected: String,
        /// Hash of its recipe.
        found: String,
    },
    /// Nothing to merge or to solve.
    #[error("no factors: expected those of one log at least")]
    Nothing,
    /// A log with another sample rate than those of the recipe.
    #[error(
        "{log}: expected a sample rate within 5 % of {expected_hz} Hz, by which the recipe counts the delay of the effort, found {found_hz} Hz"
    )]
    Rate {
        /// Log.
        log: String,
        /// Rate of the recipe, Hz.
        expected_hz: f64,
        /// Rate of the log, Hz.
        found_hz: f64,
    },
    /// A joint of the recipe that a log does not hold.
    #[error("{log}: expected a column for `{joint}`, which moves in the logs of the recipe, found none")]
    NotLogged {
        /// Log.
        log: String,
        /// Joint or motor.
        joint: String,
    },
    /// A position that was taken for one that counts from zero again after a turn, and then is none.
    #[error(
        "{log}, row {row}: the position of `{joint}` jumps by a full turn in rows before, and here by what is none, or leaves the turn"
    )]
    Turns {
        /// Log.
        log: String,
        /// Row, from 1.
        row: usize,
        /// Joint or motor.
        joint: String,
    },
    /// A log without rows.
    #[error("{log}: {seconds:.2} s leave no row behind kernel, mask and edges")]
    NoRows {
        /// Log.
        log: String,
        /// Its length, s.
        seconds: f64,
    },
}

impl ReductionError {
    /// What a user can do about it.
    pub fn hint(&self) -> Option<String> {
        let words = match self {
            ReductionError::File { fault: FactorFileFault::NotFactors, .. } => {
                "`dynid reduce dynid.toml --out cell.factors` makes one of a configuration and its logs"
            }
            ReductionError::File { fault: FactorFileFault::Version { .. }, .. } => {
                "reduce the logs again with this version, or solve with the version that wrote the file"
            }
            ReductionError::File { .. } | ReductionError::Contradiction { .. } => {
                "copy the file again, or reduce the logs again"
            }
            ReductionError::OtherRecipe { .. } => {
                "reduce all logs by one recipe: `dynid reduce cell.factors --log other.csv --out other.factors` takes that of `cell.factors`"
            }
            ReductionError::Nothing => "name at least one factor file",
            ReductionError::Rate { .. } => {
                "resample the log, or learn a recipe of its own for logs of this rate"
            }
            ReductionError::NotLogged { .. } => "log the joint, or learn a recipe on logs without it",
            ReductionError::Turns { .. } => {
                "log the position so that turns are kept apart, or take the rows before this one: `rows = [1, 1000]` in the `[[log]]`"
            }
            ReductionError::NoRows { .. } => "take a longer log, or a recipe with a higher `kernel_hz`",
        };
        Some(words.to_owned())
    }
}

/// What is wrong with the bytes of a factor file.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum FactorFileFault {
    /// Not a factor file.
    #[error("expected a factor file, which begins with `dynid factors`")]
    NotFactors,
    /// A version that this program does not read.
    #[error("expected version {expected} of the factor file, found {found}")]
    Version {
        /// Version that is read.
        expected: u32,
        /// Version of the file.
        found: String,
    },
    /// The file ends early, or goes on behind its end.
    #[error("expected {expected} bytes, found {found}: the file was cut or added to")]
    Length {
        /// Bytes that its head promises.
        expected: u64,
        /// Bytes there are.
        found: u64,
    },
    /// The bytes are not those that were written.
    #[error("the file is damaged: its SHA-256 is not the one it ends with")]
    Damaged,
    /// The factors of another recipe than the one that lies beside them.
    #[error("factors of another recipe, {}", short(found))]
    Recipe {
        /// Hash of their recipe.
        found: String,
    },
    /// The description cannot be read.
    #[error("its description: {0}")]
    Description(String),
    /// Factors of a log cannot be read.
    #[error("factors of `{log}`: {fault}")]
    Factors {
        /// Log.
        log: String,
        /// What is wrong.
        fault: WireError,
    },
    /// Factors of a log that are not what the description says.
    #[error("`{log}`: {what}")]
    Log {
        /// Log.
        log: String,
        /// What is wrong.
        what: String,
    },
}

/// The head of a hash, which is enough to tell it from another.
fn short(hash: &str) -> String {
    hash.chars().take(12).collect()
}
