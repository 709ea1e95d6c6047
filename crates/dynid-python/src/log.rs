//! Logs from arrays and files, and virtual ones.

use std::path::PathBuf;

use dynid::config::LogConfig;
use dynid::estimate::MotorSide;
use dynid::io::MappingSpec;
use dynid::io::table_file::Column;
use dynid::log::LogAxis;
use dynid::motion::{Channel, JointSignals, Log as Recording};
use dynid::settings::LogSettings;
use dynid::simulate::{SimulateSettings, SimulatedLog};
use numpy::PyArrayMethods;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{Matrix, as_doubles, columns_by_name, vector};
use crate::error::{raise, setting};
use crate::robot::Robot;
use crate::settings::parsed;

/// A log: arrays, or a file that is read once the robot is known.
#[pyclass(frozen, module = "dynid._native")]
#[derive(Clone)]
pub(crate) struct Log {
    source: Source,
    pub(crate) settings: LogSettings,
}

#[derive(Clone)]
enum Source {
    Arrays {
        name: String,
        time: Vec<f64>,
        /// Names of the columns, where they are not those of the robot in its order.
        joints: Option<Vec<String>>,
        position: Vec<Vec<f64>>,
        velocity: Option<Vec<Vec<f64>>>,
        effort: Vec<Vec<f64>>,
        channels: Vec<(String, Vec<f64>)>,
    },
    File {
        config: Box<LogConfig>,
        columns: Box<MappingSpec>,
        motor_side: Option<MotorSide>,
    },
}

fn wrong(text: String) -> PyErr {
    PyValueError::new_err(text)
}

/// Columns of a signal, `(n, joints)` or `(n,)` of one joint.
fn signal(name: &str, value: &Bound<'_, PyAny>, rows: usize) -> PyResult<Vec<Vec<f64>>> {
    let array = as_doubles(value)?;
    let shape: Vec<usize> = numpy::PyUntypedArrayMethods::shape(&*array).to_vec();
    let (found, columns) = match shape[..] {
        [n] => (n, 1),
        [n, columns] => (n, columns),
        _ => (usize::MAX, 0),
    };
    if found != rows {
        return Err(wrong(format!("{name}: expected shape ({rows}, joints) as t has, found {shape:?}")));
    }
    let values = array.as_slice()?;
    Ok((0..columns).map(|c| values.iter().skip(c).step_by(columns).copied().collect()).collect())
}

/// What an identification has to know beside the signals.
fn of_config(config: &LogConfig) -> LogSettings {
    LogSettings {
        name: config.name.clone(),
        payload: config.payload.clone(),
        own: config.own.clone(),
        like: config.like.clone(),
        temperature: config.temperature.clone(),
        validation: false,
        period_s: config.period_s,
    }
}

#[pymethods]
impl Log {
    #[new]
    #[pyo3(signature = (t, q, tau, v=None, *, joints=None, channels=None, name="log", settings="{}"))]
    #[expect(clippy::too_many_arguments, reason = "keywords of a Python function")]
    fn new(
        py: Python<'_>,
        t: &Bound<'_, PyAny>,
        q: &Bound<'_, PyAny>,
        tau: &Bound<'_, PyAny>,
        v: Option<&Bound<'_, PyAny>>,
        joints: Option<Vec<String>>,
        channels: Option<&Bound<'_, PyDict>>,
        name: &str,
        settings: &str,
    ) -> PyResult<Self> {
        let time = as_doubles(t)?;
        if numpy::PyUntypedArrayMethods::ndim(&*time) != 1 {
            return Err(wrong("t: expected a vector of seconds".to_owned()));
        }
        let time = time.as_slice()?.to_vec();
        let rows = time.len();
        let position = signal("q", q, rows)?;
        let effort = signal("tau", tau, rows)?;
        let velocity = v.map(|v| signal("v", v, rows)).transpose()?;
        let same = [("tau", Some(&effort)), ("v", velocity.as_ref())];
        for (what, columns) in same.into_iter().filter_map(|(what, c)| Some((what, c?))) {
            if columns.len() != position.len() {
                let text =
                    format!("{what}: expected {} joints as in q, found {}", position.len(), columns.len());
                return Err(wrong(text));
            }
        }
        if let Some(joints) = joints.as_ref().filter(|j| j.len() != position.len()) {
            return Err(wrong(format!(
                "joints: expected {} names as q has columns, found {}",
                position.len(),
                joints.len()
            )));
        }
        let extra = columns_by_name(channels)?;
        if let Some((channel, _)) = extra.iter().find(|(_, values)| values.len() != rows) {
            return Err(wrong(format!("{channel}: expected shape ({rows},)")));
        }
        let source = Source::Arrays {
            name: name.to_owned(),
            time,
            joints,
            position,
            velocity,
            effort,
            channels: extra,
        };
        let config: LogConfig = parsed(py, settings, "settings of a log")?;
        let of_files = LogConfig {
            name: config.name.clone(),
            payload: config.payload.clone(),
            own: config.own.clone(),
            like: config.like.clone(),
            temperature: config.temperature.clone(),
            period_s: config.period_s,
            ..LogConfig::default()
        };
        if config != of_files {
            let text = "settings of a log: `path`, `rows`, `part`, `leave_out`, `drop_repeated`, `columns` and `trajectory` are those of files";
            return Err(setting(py, text, "slice the arrays, or read the file: `Log.read(path, ..)`"));
        }
        Ok(Log { source, settings: of_config(&config) })
    }

    #[staticmethod]
    #[pyo3(signature = (path, *, columns="{}", motor_side=None, settings="{}"))]
    fn read_file(
        py: Python<'_>,
        path: PathBuf,
        columns: &str,
        motor_side: Option<&str>,
        settings: &str,
    ) -> PyResult<Self> {
        let config: LogConfig = parsed(py, settings, "settings of a log")?;
        let own = of_config(&config);
        let source = Source::File {
            config: Box::new(LogConfig { path, ..config }),
            columns: Box::new(parsed(py, columns, "columns")?),
            motor_side: motor_side.map(|text| parsed(py, text, "motor_side")).transpose()?,
        };
        Ok(Log { source, settings: own })
    }

    fn __repr__(&self) -> String {
        match &self.source {
            Source::Arrays { name, time, position, .. } => {
                format!("<dynid.Log {name}: {} samples of {} joints>", time.len(), position.len())
            }
            Source::File { config, .. } => format!("<dynid.Log of {}>", config.path.display()),
        }
    }
}

impl Log {
    /// The log of a robot with these axes.
    pub(crate) fn of(&self, axes: &[LogAxis], validation: bool) -> Result<dynid::log::Log, dynid::Error> {
        let settings = LogSettings { validation, ..self.settings.clone() };
        let log = match &self.source {
            Source::File { config, columns, motor_side } => {
                dynid::logs::load(config, axes, columns, motor_side.as_ref())?
            }
            Source::Arrays { name, time, joints, position, velocity, effort, channels } => {
                let known = dynid::log::names(axes);
                let names = joints.as_ref().unwrap_or(&known);
                if names.len() != position.len() {
                    return Err(dynid::Error::setting(
                        "joints",
                        &format!("{} columns of q for {}", known.len(), known.join(", ")),
                        position.len(),
                    ));
                }
                let joint = |j: usize| JointSignals {
                    name: names[j].clone(),
                    position: position[j].clone(),
                    velocity: velocity.as_ref().map(|v| v[j].clone()),
                    effort: effort[j].clone(),
                };
                let channels = channels
                    .iter()
                    .map(|(name, values)| Channel { name: name.clone(), values: values.clone() });
                let signals = Recording::new(
                    name.clone(),
                    time.clone(),
                    (0..names.len()).map(joint).collect(),
                    channels.collect(),
                )?;
                dynid::log::Log::of_axes(axes, signals)?
            }
        };
        Ok(log.with_settings(settings))
    }
}

/// Makes a virtual log: a dictionary of its arrays, the truth and what happened.
#[pyfunction]
pub(crate) fn simulate<'py>(py: Python<'py>, robot: &Robot, settings: &str) -> PyResult<Bound<'py, PyDict>> {
    let settings: SimulateSettings = parsed(py, settings, "settings of a simulation")?;
    let own = robot.robot.clone();
    let made = crate::work::run(py, None, 0, move |_| dynid::simulate::simulate(&own, &settings))?;
    let rows = made.time.len();
    let table = |columns: &[Vec<f64>]| -> PyResult<Matrix<'py>> {
        let flat: Vec<f64> = (0..rows).flat_map(|s| columns.iter().map(move |c| c[s])).collect();
        vector(py, &flat).reshape([rows, columns.len()])
    };
    let SimulatedLog { joints, time, position, velocity, effort, channels, clean, truth, warnings, .. } =
        &made;
    let out = PyDict::new(py);
    out.set_item("joints", joints)?;
    out.set_item("t", vector(py, time))?;
    out.set_item("q", table(position)?)?;
    out.set_item("v", velocity.as_ref().map(|v| table(v)).transpose()?)?;
    out.set_item("tau", table(effort)?)?;
    for (name, columns) in ["clean_q", "clean_v", "clean_a", "clean_tau"].iter().zip(clean) {
        out.set_item(name, table(columns)?)?;
    }
    let extra = PyDict::new(py);
    for (name, values) in channels {
        extra.set_item(name, vector(py, values))?;
    }
    out.set_item("channels", extra)?;
    let values = PyDict::new(py);
    for (name, value) in truth {
        values.set_item(name, value)?;
    }
    out.set_item("truth", values)?;
    out.set_item("warnings", warnings)?;
    Ok(out)
}

/// The logs that a path stands for: a pattern, a folder, a list.
#[pyfunction]
pub(crate) fn find_logs(py: Python<'_>, path: PathBuf) -> PyResult<Vec<PathBuf>> {
    dynid::io::log::files(&path).map_err(|error| raise(py, &error.into()))
}

/// All columns of a log, or the signals of a robot in it: a dictionary of arrays.
#[pyfunction]
#[pyo3(signature = (path, robot=None, *, columns="{}", rows=None))]
pub(crate) fn read_columns<'py>(
    py: Python<'py>,
    path: PathBuf,
    robot: Option<&Robot>,
    columns: &str,
    rows: Option<(usize, usize)>,
) -> PyResult<Bound<'py, PyDict>> {
    let columns: MappingSpec = parsed(py, columns, "columns")?;
    let columns = MappingSpec { allow_no_effort: true, ..columns };
    let log = LogConfig { path, rows, ..LogConfig::default() };
    let own = robot.map(|robot| robot.robot.clone());
    let read = crate::work::run(py, None, 0, move |_| dynid::convert::convert(&log, &columns, own.as_ref()))?;
    let out = PyDict::new(py);
    for (name, column) in read.names.iter().zip(&read.columns) {
        match column {
            Column::Float(values) => out.set_item(name, vector(py, values))?,
            Column::Whole(values) => out.set_item(name, numpy::PyArray1::from_slice(py, values))?,
        }
    }
    Ok(out)
}
