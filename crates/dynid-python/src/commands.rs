//! Work beside identification: pre-flight, comparisons, drive gains, drives, designs, identification on line.

use std::sync::{Mutex, PoisonError};

use dynid::compare::compare_logs;
use dynid::config::Config;
use dynid::design::next::{NextSettings, Wanted, next};
use dynid::design::{DesignConfig, DesignRun, DesignStep, design as run_design};
use dynid::friction::{FrictionConfig, FrictionStep, friction_of_logs};
use dynid::gains::gains_of_logs;
use dynid::online::{Event, Session};
use dynid::overlap::Overlaps;
use dynid::pipeline::held_where_not_logged;
use dynid::preflight::{self, Bench};
use dynid::reduce::Reduction;
use dynid::servo::{ServoConfig, ServoStep, identify_servo};
use dynid::settings::Method;
use numpy::PyArrayMethods;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{Batch, demand_finite, vector};
use crate::error::{raise, setting};
use crate::factor::Factor;
use crate::log::Log;
use crate::robot::Robot;
use crate::settings::{as_json, parsed, settings};
use crate::work;

/// What is wrong with logs before anything is identified: findings as JSON.
#[pyfunction]
pub(crate) fn check(
    py: Python<'_>,
    robot: &Robot,
    logs: Vec<PyRef<'_, Log>>,
    settings_json: &str,
) -> PyResult<String> {
    let settings = settings(py, settings_json)?;
    let own = robot.robot.clone();
    let logs: Vec<Log> = logs.iter().map(|l| (**l).clone()).collect();
    let findings = work::run(py, None, 0, move |_| {
        let logs = logs.iter().map(|log| log.of(&own.axes, false)).collect::<Result<Vec<_>, _>>()?;
        let held = held_where_not_logged(own, &logs)?;
        preflight::of_logs(&Bench::new(&settings, &held)?, &logs, &Overlaps::of(&logs, &[]))
    })?;
    as_json(&findings)
}

/// Compares all estimators on logs: the record as JSON, and the page.
#[pyfunction]
#[pyo3(signature = (robot, logs, settings_json, *, progress=None, threads=0))]
pub(crate) fn compare(
    py: Python<'_>,
    robot: &Robot,
    logs: Vec<PyRef<'_, Log>>,
    settings_json: &str,
    progress: Option<Bound<'_, PyAny>>,
    threads: usize,
) -> PyResult<(String, String)> {
    let settings = settings(py, settings_json)?;
    let own = robot.robot.clone();
    let logs: Vec<Log> = logs.iter().map(|l| (**l).clone()).collect();
    work::run(py, progress, threads, move |tell| {
        let logs = logs.iter().map(|log| log.of(&own.axes, false)).collect::<Result<Vec<_>, _>>()?;
        let found = compare_logs(own, logs, &settings, &mut |done, of, what| {
            tell(format!("{done} of {of} fits: {what}"));
        })?;
        Ok((found.to_json(), found.report()?))
    })
}

/// Finds drive gains from logs with and without a known payload: the record as JSON.
#[pyfunction]
#[pyo3(signature = (robot, logs, settings_json, *, progress=None, threads=0))]
pub(crate) fn gains(
    py: Python<'_>,
    robot: &Robot,
    logs: Vec<PyRef<'_, Log>>,
    settings_json: &str,
    progress: Option<Bound<'_, PyAny>>,
    threads: usize,
) -> PyResult<String> {
    let keys: serde_json::Map<String, serde_json::Value> = parsed(py, settings_json, "settings")?;
    let idle = ["bound", "instruments", "known_effort_scale", "known_mass", "preferred", "preflight"];
    if let Some(key) = idle.into_iter().find(|key| keys.contains_key(*key)) {
        return Err(setting(py, format!("setting `{key}`: does nothing for drive gains"), "leave it out"));
    }
    let settings = settings(py, settings_json)?;
    if settings.estimator.method != Method::Wls {
        let what =
            "setting `estimator.method`: expected `wls`, which gains of drives are found by".to_owned();
        return Err(setting(py, what, "leave it out"));
    }
    let own = robot.robot.clone();
    let logs: Vec<Log> = logs.iter().map(|l| (**l).clone()).collect();
    let file = work::run(py, progress, threads, move |tell| {
        let logs = logs.iter().map(|log| log.of(&own.axes, false)).collect::<Result<Vec<_>, _>>()?;
        Ok(gains_of_logs(own, logs, &settings, &mut |step| tell(step.to_string()))?.file())
    })?;
    as_json(&file)
}

/// Friction of single joints from logs of constant speeds and of pre-sliding: the record as JSON, and the page.
#[pyfunction]
#[pyo3(signature = (robot, logs, presliding, settings_json, *, progress=None, threads=0))]
pub(crate) fn friction(
    py: Python<'_>,
    robot: &Robot,
    logs: Vec<PyRef<'_, Log>>,
    presliding: Vec<PyRef<'_, Log>>,
    settings_json: &str,
    progress: Option<Bound<'_, PyAny>>,
    threads: usize,
) -> PyResult<(String, String)> {
    let config: FrictionConfig = parsed(py, settings_json, "settings of friction")?;
    let own = robot.robot.clone();
    let [logs, presliding] =
        [logs, presliding].map(|given| given.iter().map(|l| (**l).clone()).collect::<Vec<Log>>());
    work::run(py, progress, threads, move |tell| {
        let of =
            |given: &[Log]| given.iter().map(|log| log.of(&own.axes, false)).collect::<Result<Vec<_>, _>>();
        let (logs, presliding) = (of(&logs)?, of(&presliding)?);
        let found = friction_of_logs(own, logs, presliding, &config, &mut |step| {
            tell(match step {
                FrictionStep::Read(log) => format!("reading {log}"),
                FrictionStep::Law(joint) => format!("fitting the law of {joint}"),
                FrictionStep::Presliding(joint) => format!("searching the bristles of {joint}"),
            });
        })?;
        let model = found.model(&config)?;
        Ok((model.to_json(), found.report(&model)?))
    })
}

/// The record as JSON, the page, and files by name and text.
type Drives = (String, String, Vec<(String, String)>);

/// Identifies drives from commands and positions: the record as JSON, the page, and the files that other programs take, name and text.
#[pyfunction]
#[pyo3(signature = (config, *, progress=None, threads=0))]
pub(crate) fn servo(
    py: Python<'_>,
    config: &str,
    progress: Option<Bound<'_, PyAny>>,
    threads: usize,
) -> PyResult<Drives> {
    let config: ServoConfig = parsed(py, config, "settings of drives")?;
    work::run(py, progress, threads, move |tell| {
        let found = identify_servo(&config, &mut |step| {
            tell(match step {
                ServoStep::Read(file) => format!("reading {file}"),
                ServoStep::Fit => "simulating drives".to_owned(),
            });
        })?;
        let files = found.files()?;
        let file = found.file(&config, &files.notes);
        let page = found.report(&file)?;
        Ok((file.to_json(), page, files.files))
    })
}

/// Designs a motion: a dictionary with its samples, the coefficients and the record as JSON.
#[pyfunction]
#[pyo3(signature = (config, *, progress=None, threads=0))]
pub(crate) fn design<'py>(
    py: Python<'py>,
    config: &str,
    progress: Option<Bound<'py, PyAny>>,
    threads: usize,
) -> PyResult<Bound<'py, PyDict>> {
    let config: DesignConfig = parsed(py, config, "settings of a design")?;
    let (run, record, page) = work::run(py, progress, threads, move |tell| {
        let run = run_design(&config, &mut |step| tell(words(step)))?;
        let record = run.record(&config)?;
        let page = run.report(&config, &record)?;
        Ok((run, record, page))
    })?;
    let out = PyDict::new(py);
    out.set_item("record", as_json(&record)?)?;
    out.set_item("report", page)?;
    with_motion(&out, &run)?;
    Ok(out)
}

/// The shortest motion that narrows intervals to what is wanted (`NAME=WIDTH`), given factors of all logs so far: as [`design`].
#[pyfunction]
#[pyo3(signature = (config, factors, wanted, longest_s, *, progress=None, threads=0))]
pub(crate) fn next_motion<'py>(
    py: Python<'py>,
    config: &str,
    factors: Vec<PyRef<'py, Factor>>,
    wanted: Vec<String>,
    longest_s: Option<f64>,
    progress: Option<Bound<'py, PyAny>>,
    threads: usize,
) -> PyResult<Bound<'py, PyDict>> {
    let config: DesignConfig = parsed(py, config, "settings of a design")?;
    let refused = |text: String| {
        setting(py, format!("setting `want`: {text}"), "`want={\"j1.fc\": \"5%\"}`, or a half width")
    };
    let wanted = wanted.iter().map(|w| w.parse().map_err(refused)).collect::<PyResult<Vec<Wanted>>>()?;
    let parts: Vec<Reduction> = factors.iter().map(|f| f.reduction.clone()).collect();
    let earlier = Reduction::merge(parts).map_err(|e| raise(py, &e.into()))?;
    let defaults = NextSettings::default();
    let asked = NextSettings { wanted, longest_s: longest_s.unwrap_or(defaults.longest_s) };
    let (run, record, page) = work::run(py, progress, threads, move |tell| {
        let run = next(&config, &asked, &earlier, &mut |step| tell(words(step)))?;
        let record = run.record()?;
        let page = run.report(&record)?;
        Ok((run, record, page))
    })?;
    let out = PyDict::new(py);
    out.set_item("record", as_json(&record)?)?;
    out.set_item("report", page)?;
    if let Some(design) = &run.design {
        with_motion(&out, design)?;
    }
    Ok(out)
}

/// Puts the motion of a design, if there is one, beside its record.
fn with_motion(out: &Bound<'_, PyDict>, run: &DesignRun) -> PyResult<()> {
    let py = out.py();
    if let Ok(designed) = &run.outcome {
        let sampled = designed.motion.sampled().map_err(|e| raise(py, &e))?;
        let rows = sampled.time.len();
        out.set_item("joints", &designed.motion.joints)?;
        out.set_item("t", vector(py, &sampled.time))?;
        for (name, values) in [("q", &sampled.q), ("v", &sampled.dq), ("a", &sampled.ddq)] {
            // Joint after joint there, row after row here.
            let columns = values.len() / rows.max(1);
            let flat: Vec<f64> =
                (0..rows).flat_map(|s| (0..columns).map(move |c| values[c * rows + s])).collect();
            out.set_item(name, vector(py, &flat).reshape([rows, columns])?)?;
        }
        if let Some(told) = run.commands().map_err(|e| raise(py, &e))? {
            let flat: Vec<f64> = (0..rows).flat_map(|s| told.iter().map(move |u| u[s])).collect();
            out.set_item("commands", vector(py, &flat).reshape([rows, told.len()])?)?;
        }
    }
    Ok(())
}

fn words(step: DesignStep) -> String {
    match step {
        DesignStep::Starts { ended, of, .. } => format!("{ended} of {of} {step}"),
        _ => step.to_string(),
    }
}

/// Identification of a robot while it runs.
#[pyclass(frozen, module = "dynid._native")]
pub(crate) struct Online {
    session: Mutex<Session>,
    columns: usize,
    joints: Vec<String>,
}

#[pymethods]
impl Online {
    #[new]
    fn new(py: Python<'_>, config: &str, header: Vec<String>) -> PyResult<Self> {
        let config: Config = parsed(py, config, "settings")?;
        let columns = header.len();
        let session =
            py.detach(|| Session::new(&config, "stream", &header[..], None)).map_err(|e| raise(py, &e))?;
        let joints = session.joints();
        Ok(Online { session: Mutex::new(session), columns, joints })
    }

    #[getter]
    fn joints(&self) -> Vec<String> {
        self.joints.clone()
    }

    /// Takes rows of the stream; gives the events that came of them, as JSON.
    fn feed(&self, py: Python<'_>, rows: &Bound<'_, PyAny>) -> PyResult<String> {
        let batch = Batch::take("rows", rows, self.columns)?;
        let values = batch.values()?;
        demand_finite("rows", values, self.columns)?;
        self.events(py, |session, emit| {
            for row in values.chunks_exact(self.columns) {
                session.row(row, emit)?;
            }
            session.flush(emit)
        })
    }

    /// Ends the stream; gives the last events.
    fn finish(&self, py: Python<'_>) -> PyResult<String> {
        self.events(py, |session, emit| session.finish(emit))
    }
}

impl Online {
    fn events(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut Session, &mut dyn FnMut(Event)) -> Result<(), dynid::Error> + Send,
    ) -> PyResult<String> {
        let mut events = Vec::new();
        let done = py.detach(|| {
            // A panic is a fault of the program, told as such; the session behind it is as it was.
            let mut session = self.session.lock().unwrap_or_else(PoisonError::into_inner);
            work(&mut session, &mut |event| events.push(event))
        });
        done.map_err(|e| raise(py, &e))?;
        as_json(&events)
    }
}
