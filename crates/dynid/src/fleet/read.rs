//! What folders of factors hold: every log once.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use dynid_identify::reduction::ReducedLog;
use rayon::prelude::*;

use super::FleetFault;
use super::failure::{Failure, FailureCode};
use crate::Error;
use crate::reduce::Recipe;

pub(super) const RECIPE: &str = "recipe.factors";
pub(super) const REDUCED: &str = "factors";
pub(super) const FAILED: &str = "failed.json";

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
/// Files that are damaged are failures, and so are logs that are stated for two robots: neither copy is counted. A log that was lost with its
/// process and reduced another time is no failure.
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
            id: None,
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
    let known: BTreeSet<(String, String)> = (logs.iter())
        .filter_map(|log| Some((log.facts.log.name.clone(), log.facts.origin.as_ref()?.robot.clone())))
        .collect();
    failures.retain(|f| !(f.may_pass() && known.contains(&(f.log.clone(), f.robot.clone()))));
    let (repeated, contradicting) = once(&mut logs, &mut failures);
    failures.sort_by(|a, b| (&a.robot, &a.log, &a.message).cmp(&(&b.robot, &b.log, &b.message)));
    failures.dedup();
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
                    id: None,
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
pub(super) fn listed(folder: &Path) -> Result<Vec<PathBuf>, Error> {
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
