//! Fleets: single logs to bytes, bytes to folders, folders to what their logs say together. Records travel as JSON.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use dynid::fleet::{
    Entry, FleetFile, FleetResult, FleetSettings, LogReducer as Reducer, Origin, Outcome, StoreReading,
};
use dynid::reduce::{Recipe, Reduction};
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use serde::{Deserialize, Serialize};

use crate::error::raise;
use crate::estimate::Estimate;
use crate::log::Log;
use crate::settings::{as_json, parsed};
use crate::work;

/// A log of a fleet, as a manifest has it.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Row {
    log: String,
    path: PathBuf,
    robot: String,
    start: Option<f64>,
    covariates: BTreeMap<String, f64>,
}

impl From<Row> for Entry {
    fn from(row: Row) -> Entry {
        let Row { log, path, robot, start, covariates } = row;
        Entry { log, path, origin: Origin { robot, start_s: start, covariates } }
    }
}

impl From<Entry> for Row {
    fn from(entry: Entry) -> Row {
        let Entry { log, path, origin: Origin { robot, start_s, covariates } } = entry;
        Row { log, path, robot, start: start_s, covariates }
    }
}

/// The logs of a manifest: rows as JSON.
#[pyfunction]
pub(crate) fn read_manifest(py: Python<'_>, path: PathBuf) -> PyResult<String> {
    let entries = dynid::fleet::manifest(&path).map_err(|e| raise(py, &e))?;
    as_json(&entries.into_iter().map(Row::from).collect::<Vec<_>>())
}

/// Seconds since 1970 of a date; None for what is none.
#[pyfunction]
pub(crate) fn date(text: &str) -> Option<f64> {
    dynid::fleet::date(text)
}

fn recipe(py: Python<'_>, bytes: &[u8]) -> PyResult<Recipe> {
    let reduction = Reduction::from_bytes(bytes, "recipe").map_err(|e| raise(py, &e.into()))?;
    Ok(reduction.recipe().clone())
}

/// Reduces single logs by a recipe.
#[pyclass(frozen, module = "dynid._native")]
pub(crate) struct LogReducer {
    reducer: Arc<Reducer>,
}

#[pymethods]
impl LogReducer {
    #[new]
    fn new(py: Python<'_>, recipe: &[u8]) -> PyResult<Self> {
        let recipe = self::recipe(py, recipe)?;
        let reading = StoreReading::of(&recipe);
        let reducer = py.detach(|| Reducer::new(recipe, reading)).map_err(|e| raise(py, &e))?;
        Ok(LogReducer { reducer: Arc::new(reducer) })
    }

    /// What was made of a log: of the file of the row, or of the log that is given.
    #[pyo3(signature = (row, log=None))]
    fn reduce<'py>(
        &self,
        py: Python<'py>,
        row: &str,
        log: Option<PyRef<'_, Log>>,
    ) -> PyResult<Bound<'py, PyBytes>> {
        let entry = Entry::from(parsed::<Row>(py, row, "row")?);
        let (reducer, log) = (self.reducer.clone(), log.map(|log| (*log).clone()));
        let bytes = work::run(py, None, 0, move |_| {
            let made = match log {
                None => reducer.file(&entry),
                Some(log) => {
                    let read = log.of(&reducer.reducer().robot().axes, false);
                    reducer.log(&entry.log, &entry.origin, read)
                }
            };
            Ok(reducer.to_bytes(&made))
        })?;
        Ok(PyBytes::new(py, &bytes))
    }
}

/// A folder of factors by one recipe.
#[pyclass(frozen, module = "dynid._native")]
pub(crate) struct FactorStore {
    store: Arc<dynid::fleet::FactorStore>,
    folder: PathBuf,
}

#[pymethods]
impl FactorStore {
    #[new]
    #[pyo3(signature = (folder, recipe=None))]
    fn new(py: Python<'_>, folder: PathBuf, recipe: Option<&[u8]>) -> PyResult<Self> {
        let recipe = recipe.map(|bytes| self::recipe(py, bytes)).transpose()?;
        let opened = py.detach(|| match recipe {
            Some(recipe) => {
                let reading = StoreReading::of(&recipe);
                dynid::fleet::FactorStore::create(&folder, recipe, reading)
            }
            None => dynid::fleet::FactorStore::open(&folder),
        });
        Ok(FactorStore { store: Arc::new(opened.map_err(|e| raise(py, &e))?), folder })
    }

    #[getter]
    fn folder(&self) -> &Path {
        &self.folder
    }

    #[getter]
    fn recipe<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        let recipe = self.store.reducer().recipe().clone();
        PyBytes::new(py, &Reduction::without_logs(recipe).to_bytes())
    }

    /// The failure that the bytes tell, as JSON.
    fn put(&self, py: Python<'_>, made: &[u8]) -> PyResult<Option<String>> {
        match py.detach(|| self.store.put(made)).map_err(|e| raise(py, &e))? {
            Outcome::Failed(failure) => Ok(Some(failure.to_json())),
            Outcome::Reduced | Outcome::Known => Ok(None),
        }
    }

    fn fail(&self, py: Python<'_>, log: &str, robot: &str, message: &str) -> PyResult<String> {
        let failure = py.detach(|| self.store.fail(log, robot, message)).map_err(|e| raise(py, &e))?;
        Ok(failure.to_json())
    }

    /// Reduces the logs of rows: what became of them, as JSON.
    #[pyo3(signature = (rows, *, progress=None, threads=0))]
    fn reduce(
        &self,
        py: Python<'_>,
        rows: &str,
        progress: Option<Bound<'_, PyAny>>,
        threads: usize,
    ) -> PyResult<String> {
        let rows: Vec<Row> = parsed(py, rows, "rows")?;
        let entries: Vec<Entry> = rows.into_iter().map(Entry::from).collect();
        let (store, count) = (self.store.clone(), entries.len());
        let outcomes = work::run(py, progress, threads, move |tell| {
            let (tell, done) = (Mutex::new(tell), AtomicUsize::new(0));
            store.reduce(&entries, &|entry, _| {
                let done = done.fetch_add(1, Ordering::Relaxed) + 1;
                // Whoever stopped the work left the lock poisoned.
                tell.lock().unwrap_or_else(PoisonError::into_inner)(format!(
                    "{done} of {count}: {}",
                    entry.log
                ));
            })
        })?;
        let of = |wanted: &Outcome| outcomes.iter().filter(|o| *o == wanted).count();
        let (reduced, known) = (of(&Outcome::Reduced), of(&Outcome::Known));
        let failures: Vec<_> =
            outcomes.iter().filter_map(|o| if let Outcome::Failed(f) = o { Some(f) } else { None }).collect();
        as_json(
            &serde_json::json!({ "logs": count, "reduced": reduced, "known": known, "failures": failures }),
        )
    }

    fn __len__(&self, py: Python<'_>) -> PyResult<usize> {
        py.detach(|| self.store.count()).map_err(|e| raise(py, &e))
    }

    /// Logs that could not be reduced or read, as JSON.
    fn failures(&self, py: Python<'_>) -> PyResult<String> {
        let folder = self.folder.clone();
        let content = py.detach(|| dynid::fleet::read(&[folder])).map_err(|e| raise(py, &e))?;
        as_json(&content.failures)
    }
}

/// What the logs of a fleet say together.
#[pyclass(frozen, module = "dynid._native")]
pub(crate) struct Fleet {
    found: FleetResult,
    file: FleetFile,
}

#[pymethods]
impl Fleet {
    fn to_json(&self) -> String {
        self.file.to_json()
    }

    fn report(&self, py: Python<'_>) -> PyResult<String> {
        py.detach(|| self.found.report(&self.file)).map_err(|e| raise(py, &e))
    }

    fn robot_page(&self, py: Python<'_>, name: &str) -> PyResult<String> {
        let asked = [name.to_owned()];
        let pages = py.detach(|| self.found.robot_pages(&self.file, &asked)).map_err(|e| raise(py, &e))?;
        let page = pages.into_iter().find(|(robot, _)| robot == name);
        page.map(|(_, page)| page).ok_or_else(|| PyKeyError::new_err(name.to_owned()))
    }

    #[pyo3(signature = (robot=None))]
    fn estimate(&self, py: Python<'_>, robot: Option<&str>) -> PyResult<Estimate> {
        let named = |name: &str| {
            let found = self.file.robots.iter().find(|r| r.name == name);
            found.ok_or_else(|| PyKeyError::new_err(name.to_owned()))
        };
        let robot = robot.map(named).transpose()?;
        let solved = || {
            let of_type = self.found.type_model(&self.file)?;
            let model = match robot {
                Some(robot) => self.found.robot_model(&self.file, robot, &of_type)?,
                None => of_type,
            };
            Estimate::new(self.found.estimate(&model), Some(model), None)
        };
        py.detach(solved).map_err(|e| raise(py, &e))
    }
}

/// Reads folders of factors, and fits the fleet.
#[pyfunction]
#[pyo3(signature = (folders, settings_json, *, progress=None, threads=0))]
pub(crate) fn fleet(
    py: Python<'_>,
    folders: Vec<PathBuf>,
    settings_json: &str,
    progress: Option<Bound<'_, PyAny>>,
    threads: usize,
) -> PyResult<Fleet> {
    let settings: FleetSettings = parsed(py, settings_json, "settings of a fleet")?;
    work::run(py, progress, threads, move |tell| {
        let found = dynid::fleet::fleet(&folders, &settings, &mut |step| tell(step.to_string()))?;
        let file = found.file();
        Ok(Fleet { found, file })
    })
}
