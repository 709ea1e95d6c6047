//! The factor file.
//!
//! | part | |
//! |---|---|
//! | line | `dynid factors 1` and a line feed: what it is, and its version |
//! | `u64` | length of the description, little-endian like all numbers |
//! | description | JSON: `recipe` (absent where it lies beside), `recipe_sha256`, and per log `key`, its facts, how many bytes its factors take and their SHA-256 |
//! | factors | of one log after the other, as [`dynid_factor::wire`] writes them |
//! | 32 bytes | SHA-256 of all before |
//!
//! The same reduction gives the same bytes.

use dynid_factor::groups::ReducedGroup;
use dynid_factor::wire::{read_groups, write_groups};
use serde::{Deserialize, Serialize};

use super::{LogFacts, Recipe, ReducedLog, Reduction, ReductionError, plain};
use crate::reduction_error::FactorFileFault as Fault;

/// Version of the factor file.
pub const VERSION: u32 = 1;

const MAGIC: &str = "dynid factors ";
const DIGEST: usize = 32;

#[derive(Serialize, Deserialize)]
struct Description {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    recipe: Option<Recipe>,
    recipe_sha256: String,
    logs: Vec<LogEntry>,
}

#[derive(Serialize, Deserialize)]
struct LogEntry {
    key: String,
    facts: LogFacts,
    bytes: u64,
    /// SHA-256 of these bytes.
    sha256: String,
}

/// Key of a log: what it contributes by a recipe, however it is cut into time blocks.
pub(super) fn key(recipe: &str, groups: &[ReducedGroup]) -> String {
    let whole: Vec<ReducedGroup> = groups.iter().map(|g| g.coarsened(g.blocks.len().max(1))).collect();
    let mut bytes = recipe.as_bytes().to_vec();
    write_groups(&whole, &mut bytes);
    dynid_files::digest::sha256(&bytes)
}

impl Reduction {
    /// The bytes of a factor file.
    pub fn to_bytes(&self) -> Vec<u8> {
        written(Some(&self.recipe), &self.recipe.hash(), &self.logs)
    }

    /// Reads a factor file; `name` stands in messages.
    ///
    /// # Errors
    /// [`ReductionError::File`].
    pub fn from_bytes(bytes: &[u8], name: &str) -> Result<Reduction, ReductionError> {
        let found = read(bytes, None).and_then(|(recipe, logs)| {
            let recipe = recipe.ok_or_else(|| {
                Fault::Description("a recipe is expected, which lies beside this file instead".to_owned())
            })?;
            Ok(Reduction { recipe, logs })
        });
        found.map_err(|fault| ReductionError::File { file: name.to_owned(), fault })
    }
}

impl ReducedLog {
    /// The bytes of a factor file of this log alone, for a place where the recipe lies beside it.
    ///
    /// `recipe_sha256`: [`Recipe::hash`] of the recipe that it was reduced by.
    pub fn to_bytes(&self, recipe_sha256: &str) -> Vec<u8> {
        written(None, recipe_sha256, std::slice::from_ref(self))
    }

    /// Reads a factor file of one log whose recipe lies beside it; `name` stands in messages, `recipe_sha256` is [`Recipe::hash`].
    ///
    /// # Errors
    /// [`ReductionError::File`], [`ReductionError::OtherRecipe`].
    pub fn from_bytes(
        bytes: &[u8],
        name: &str,
        (recipe, recipe_sha256): (&Recipe, &str),
    ) -> Result<ReducedLog, ReductionError> {
        let fault = |fault| ReductionError::File { file: name.to_owned(), fault };
        let (_, mut logs) = read(bytes, Some((recipe, recipe_sha256))).map_err(|found| match found {
            Fault::Recipe { found } => ReductionError::OtherRecipe {
                log: name.to_owned(),
                expected: recipe_sha256.to_owned(),
                found,
            },
            other => fault(other),
        })?;
        match logs.len() {
            1 => Ok(logs.remove(0)),
            n => Err(fault(Fault::Description(format!("one log is expected, {n} were found")))),
        }
    }

    /// Returns the log with so many time blocks at most, of which one is enough where logs stand beside many others; its key stays.
    ///
    /// # Panics
    /// If `most` is 0.
    #[must_use]
    pub fn in_blocks(self, most: usize) -> ReducedLog {
        let groups = self.groups.iter().map(|g| g.coarsened(g.blocks.len().div_ceil(most).max(1))).collect();
        ReducedLog { groups, ..self }
    }
}

fn written(recipe: Option<&Recipe>, recipe_sha256: &str, reduced: &[ReducedLog]) -> Vec<u8> {
    let mut factors = Vec::new();
    let mut logs = Vec::new();
    for log in reduced {
        let before = factors.len();
        write_groups(&log.groups, &mut factors);
        let bytes = (factors.len() - before) as u64;
        let sha256 = dynid_files::digest::sha256(&factors[before..]);
        logs.push(LogEntry { key: log.key.clone(), facts: log.facts.clone(), bytes, sha256 });
    }
    let description = Description { recipe: recipe.cloned(), recipe_sha256: recipe_sha256.to_owned(), logs };
    let text = plain(&description);
    let mut out = format!("{MAGIC}{VERSION}\n").into_bytes();
    out.extend((text.len() as u64).to_le_bytes());
    out.extend(text.as_bytes());
    out.extend(factors);
    out.extend(dynid_files::digest::sha256_bytes(&out));
    out
}

/// Reads the file. `known`: the recipe that lies beside it, and its hash.
fn read(bytes: &[u8], known: Option<(&Recipe, &str)>) -> Result<(Option<Recipe>, Vec<ReducedLog>), Fault> {
    let rest = bytes.strip_prefix(MAGIC.as_bytes()).ok_or(Fault::NotFactors)?;
    let end = rest.iter().take(12).position(|b| *b == b'\n').ok_or(Fault::NotFactors)?;
    let version = String::from_utf8_lossy(&rest[..end]).into_owned();
    if version != VERSION.to_string() {
        return Err(Fault::Version { expected: VERSION, found: version });
    }
    let rest = &rest[end + 1..];
    let head = (bytes.len() - rest.len() + 8 + DIGEST) as u64;
    let cut = |expected: u64| Fault::Length { expected, found: bytes.len() as u64 };
    let (length, rest) = rest.split_first_chunk::<8>().ok_or(cut(head))?;
    let length = u64::from_le_bytes(*length);
    let expected = head.saturating_add(length);
    if (bytes.len() as u64) < expected {
        return Err(cut(expected));
    }
    let (before, digest) = bytes.split_at(bytes.len() - DIGEST);
    if dynid_files::digest::sha256_bytes(before) != digest {
        return Err(Fault::Damaged);
    }
    // Both fit: the file holds them.
    let (text, rest) = rest.split_at(length as usize);
    let mut factors = &rest[..rest.len() - DIGEST];
    let Description { recipe, recipe_sha256, logs } =
        serde_json::from_slice(text).map_err(|e| Fault::Description(e.to_string()))?;
    let promised: u64 = logs.iter().fold(0, |sum: u64, log| sum.saturating_add(log.bytes));
    if promised != factors.len() as u64 {
        return Err(cut(expected.saturating_add(promised)));
    }
    if recipe.as_ref().is_some_and(|recipe| recipe.hash() != recipe_sha256) {
        return Err(Fault::Description("the recipe is not the one that it was".to_owned()));
    }
    if known.is_some_and(|(_, hash)| hash != recipe_sha256) {
        return Err(Fault::Recipe { found: recipe_sha256 });
    }
    let beside = "its recipe lies beside it: read the folder, or a file with its recipe";
    let by = recipe
        .as_ref()
        .or(known.map(|(recipe, _)| recipe))
        .ok_or_else(|| Fault::Description(beside.to_owned()))?;
    let outputs = by.outputs.len();
    let columns = by.all_columns().len();
    let mut out: Vec<ReducedLog> = Vec::new();
    for LogEntry { key: expected, facts, bytes, sha256 } in logs {
        let (own, others) = factors.split_at(bytes as usize);
        factors = others;
        let named = |fault| Fault::Factors { log: facts.name.clone(), fault };
        let groups = read_groups(own, 0, columns).map_err(named)?;
        let wrong = |what: &str| Err(Fault::Log { log: facts.name.clone(), what: what.to_owned() });
        if dynid_files::digest::sha256(own) != sha256 {
            return wrong("its factors are not those that were written");
        }
        if expected.len() != 2 * DIGEST || !expected.bytes().all(|b| b.is_ascii_hexdigit()) {
            return wrong("its key is no SHA-256");
        }
        if out.last().is_some_and(|last| last.key >= expected) {
            return wrong("logs are not in the order of their keys");
        }
        if groups.is_empty() || groups.iter().any(|g| !by.has_group(g.output, g.scale) || g.blocks.is_empty())
        {
            return wrong("factors of an effort or kernel that the recipe does not have");
        }
        if !facts.fit(outputs) {
            return wrong(
                "facts of another number of efforts than the recipe has, or numbers that cannot be",
            );
        }
        out.push(ReducedLog { key: expected, facts, groups });
    }
    Ok((recipe, out))
}

impl LogFacts {
    /// Whether there is one of everything per output, and every number can be.
    fn fit(&self, outputs: usize) -> bool {
        let LogFacts { log, efforts, .. } = self;
        let lengths = [
            log.position_noise.len(),
            log.effort_noise.len(),
            log.moves.len(),
            log.velocities.len(),
            efforts.len(),
        ];
        let positive = |x: f64| x.is_finite() && x > 0.0;
        let counts = |x: &f64| x.is_finite() && *x >= 0.0;
        lengths.iter().all(|n| *n == outputs)
            && positive(log.rate_hz)
            && positive(log.duration_s)
            && log.effort_noise.iter().chain(&log.position_noise).all(counts)
            && efforts.iter().all(|e| counts(&e.squares) && e.sum.is_finite() && e.least <= e.greatest)
    }
}
