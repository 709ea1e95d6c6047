//! Identification and what comes of it.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use dynid::agreement::{Alignment, compare};
use dynid::config::Config;
use dynid::estimate::{Estimate as Record, Split, log_fit};
use dynid::estimators::conditioning::ConditioningSettings;
use dynid::export::{CheckStates, IdentifiedRobot, RobotExport, Source, exported, json};
use dynid::model::{EffortModel, MotionBlock, RobotModel};
use dynid::pipeline::Identification;
use numpy::{PyArrayDyn, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::arrays::{
    Batch, CHUNK, Matrix, Vector, as_doubles, by_chunks, demand_finite, filled, transpose, vector,
};
use crate::error::{raise, unsupported};
use crate::log::Log;
use crate::robot::Robot;
use crate::settings::settings;

/// A result file with the model that it stands for.
#[pyclass(frozen, module = "dynid._native")]
pub(crate) struct Estimate {
    record: Record,
    /// By its parts: physically consistent, without constraints.
    models: [(RobotModel, Vec<f64>); 2],
    /// With its logs; not there once it was read.
    found: Option<Arc<Identification>>,
    /// The robot file's text, where the robot was made of a text.
    source: Option<(PathBuf, Arc<str>)>,
    /// Names and covariance of the base parameters that were solved for, row-major.
    covariance: Option<(Vec<String>, Vec<f64>)>,
}

impl Estimate {
    pub(crate) fn new(
        record: Record,
        found: Option<Identification>,
        source: Option<(PathBuf, Arc<str>)>,
    ) -> Result<Self, dynid::Error> {
        let covariance = found.as_ref().map(|id| {
            let solution = &id.fitted.estimate.solution;
            let table = id.model.parameters();
            let names = solution.kept.iter().map(|k| table.linear[id.base.kept[*k]].name.clone()).collect();
            let (of, n) = (id.fitted.covariance(), solution.kept.len());
            (names, (0..n * n).map(|k| of[(k / n, k % n)]).collect())
        });
        Self::whole(record, found.map(Arc::new), source, covariance)
    }

    fn whole(
        record: Record,
        found: Option<Arc<Identification>>,
        source: Option<(PathBuf, Arc<str>)>,
        covariance: Option<(Vec<String>, Vec<f64>)>,
    ) -> Result<Self, dynid::Error> {
        let model = |split| {
            Ok::<_, dynid::Error>((record.effort_model(Path::new("estimate"), split)?, record.values(split)))
        };
        let models = [model(Split::Consistent)?, model(Split::Unconstrained)?];
        Ok(Estimate { record, models, found, source, covariance })
    }

    fn model(&self, unconstrained: bool) -> &(RobotModel, Vec<f64>) {
        &self.models[usize::from(unconstrained)]
    }

    pub(crate) fn found(&self, py: Python<'_>, what: &str) -> PyResult<&Arc<Identification>> {
        self.found.as_ref().ok_or_else(|| {
            let text = format!("{what}: the estimate was read or unpickled, without the samples of its logs");
            unsupported(py, text, "it is there on what `identify` returns")
        })
    }

    /// Text of a robot file by the identified model.
    fn export(
        &self,
        kind: Kind,
        allow_unphysical: bool,
    ) -> Result<(String, Vec<String>, Option<String>), dynid::Error> {
        let source = match &self.source {
            Some((path, text)) => Source::parse(text, path)?,
            None => match self.record.robot_file() {
                Some(file) => Source::read(file.path.as_ref())?,
                None => {
                    let text = "the estimate names no robot file".to_owned();
                    return Err(dynid::Error::Unsupported(text));
                }
            },
        };
        let identified = IdentifiedRobot::of(&self.record, Path::new("estimate"))?;
        let states = CheckStates::random(identified.identified().model);
        let export = RobotExport::new(identified.identified(), &source)?
            .with_projections(&self.record.exported.projections);
        if !allow_unphysical {
            export.require_physical()?;
        }
        let made = match kind {
            Kind::Urdf => export.urdf(&states)?,
            Kind::Mjcf => export.mjcf(&states)?,
            Kind::Model => json(&identified.identified(), &states)?,
        };
        let loops = match kind {
            Kind::Urdf => export.loops("robot.urdf"),
            _ => None,
        };
        Ok((made.text, made.notes, loops))
    }
}

#[derive(Clone, Copy)]
enum Kind {
    Urdf,
    Mjcf,
    Model,
}

#[pymethods]
impl Estimate {
    #[staticmethod]
    #[pyo3(signature = (text, robot=None))]
    fn parse(py: Python<'_>, text: &[u8], robot: Option<PyRef<'_, Robot>>) -> PyResult<Self> {
        let record = Record::parse(text, "estimate").map_err(|e| raise(py, &e))?;
        let source = robot.and_then(|r| Some((r.robot.path.clone(), r.text.clone()?)));
        Estimate::whole(record, None, source, None).map_err(|e| raise(py, &e))
    }

    fn to_json(&self) -> String {
        self.record.to_json()
    }

    #[getter]
    fn robot(&self) -> &str {
        &self.record.robot
    }

    #[getter]
    fn joints(&self) -> Vec<String> {
        self.record.joints.clone()
    }

    #[getter]
    fn status(&self) -> String {
        self.record.verdict.status.to_string()
    }

    #[getter]
    fn headline(&self) -> &str {
        &self.record.verdict.headline
    }

    #[getter]
    fn parameter_names(&self) -> Vec<String> {
        self.record.parameters.iter().map(|p| p.name.clone()).collect()
    }

    #[getter]
    fn channels(&self) -> Vec<String> {
        self.models[0].0.channels().to_vec()
    }

    #[pyo3(signature = (unconstrained=false))]
    fn values<'py>(&self, py: Python<'py>, unconstrained: bool) -> Vector<'py> {
        vector(py, &self.model(unconstrained).1)
    }

    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<(Vec<String>, Matrix<'py>)> {
        let Some((names, values)) = &self.covariance else {
            let text = "covariance: the result file has standard deviations alone";
            return Err(unsupported(
                py,
                text,
                "it is there on what `identify` returns, and on what was pickled of it",
            ));
        };
        Ok((names.clone(), vector(py, values).reshape([names.len(), names.len()])?))
    }

    #[pyo3(signature = (q, v, a, *, channels=None, unconstrained=false, threads=1))]
    #[expect(clippy::too_many_arguments, reason = "keywords of a Python function")]
    fn predict<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        v: &Bound<'py, PyAny>,
        a: &Bound<'py, PyAny>,
        channels: Option<&Bound<'py, PyDict>>,
        unconstrained: bool,
        threads: usize,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let (model, linear) = self.model(unconstrained);
        let (nq, nv) = model.dimensions();
        let batches = [Batch::take("q", q, nq)?, Batch::take("v", v, nv)?, Batch::take("a", a, nv)?];
        let rows = batches[0].rows;
        for (name, batch) in ["q", "v", "a"].iter().zip(&batches) {
            if batch.rows != rows {
                let text = format!("{name}: expected {rows} states as in q, found {}", batch.rows);
                return Err(PyValueError::new_err(text));
            }
            demand_finite(name, batch.values()?, batch.columns)?;
        }
        let extra = extra(py, model, channels, rows)?;
        let states = [batches[0].values()?, batches[1].values()?, batches[2].values()?];
        let columns = [nq, nv, nv];
        let outputs = model.outputs().len();
        let shape = model.parameters().shape_start();
        let flat = |from: usize, count: usize| {
            let mut motion = [Vec::new(), Vec::new(), Vec::new()];
            for ((values, columns), to) in states.iter().zip(columns).zip(&mut motion) {
                to.resize(columns * count, 0.0);
                transpose(values, columns, from, count, to);
            }
            motion
        };
        let chunk = if model.closed().is_some() { rows } else { CHUNK };
        if let Some(closed) = model.closed() {
            let [q, dq, ddq] = flat(0, rows);
            closed.reachable(&MotionBlock::plain(rows, &q, &dq, &ddq)).map_err(|e| {
                let file = "states".to_owned();
                raise(py, &dynid::Error::Pose { file, row: e.sample + 1, fault: Box::new(e.fault) })
            })?;
        }
        filled(py, (rows, batches[0].single), &[outputs], |out| {
            let work = |from: usize, part: &mut [f64], effort: &mut Vec<f64>| {
                let count = part.len() / outputs;
                let [q, dq, ddq] = flat(from, count);
                let channels: Vec<(&str, &[f64])> =
                    extra.iter().map(|(name, x)| (name.as_str(), &x[from..from + count])).collect();
                let motion = MotionBlock { channels: &channels, ..MotionBlock::plain(count, &q, &dq, &ddq) };
                effort.resize(outputs * count, 0.0);
                model.efforts(&motion, &shape, linear, count, effort);
                for (s, row) in part.chunks_exact_mut(outputs).enumerate() {
                    row.iter_mut().enumerate().for_each(|(o, to)| *to = effort[o * count + s]);
                }
            };
            py.detach(|| by_chunks((threads, chunk), outputs, out, Vec::new, work))
        })
    }

    /// Predicted against measured efforts of logs: the figures of a result file, as JSON.
    #[pyo3(signature = (logs, *, unconstrained=false, filter_hz=None))]
    fn validate(
        &self,
        py: Python<'_>,
        logs: Vec<PyRef<'_, Log>>,
        unconstrained: bool,
        filter_hz: Option<f64>,
    ) -> PyResult<String> {
        let robot = self.found.as_ref().map(|found| found.robot.clone());
        let robot = match robot {
            Some(robot) => robot,
            None => self.read_robot().map_err(|e| raise(py, &e))?,
        };
        let (model, linear) = self.model(unconstrained);
        let settings = ConditioningSettings::default();
        let record = &self.record;
        let alignment = Alignment {
            state_hz: record.model.state_hz,
            delay_samples: record.conditioning.delay_samples,
            delay_rate_hz: record.conditioning.delay_rate_hz,
            filter_hz: filter_hz.unwrap_or(record.model.kernel_hz),
        };
        let logs: Vec<Log> = logs.iter().map(|l| (**l).clone()).collect();
        let fits = py.detach(|| {
            logs.iter()
                .map(|log| {
                    let prepared = log.of(&robot, true)?.prepare(model, &settings)?;
                    Ok(log_fit(&compare(model, linear, &prepared, &alignment, &settings)?))
                })
                .collect::<Result<Vec<_>, dynid::Error>>()
        });
        let fits = fits.map_err(|e| raise(py, &e))?;
        serde_json::to_string(&fits).map_err(|e| PyValueError::new_err(e.to_string()))
    }

    /// What was found of bodies that some logs carry: records as JSON.
    fn payloads(&self, py: Python<'_>) -> PyResult<String> {
        let records = dynid::payload::payload_records(self.found(py, "payloads")?);
        serde_json::to_string(&records).map_err(|e| PyValueError::new_err(e.to_string()))
    }

    fn report(&self, py: Python<'_>) -> PyResult<String> {
        let found = self.found(py, "report")?.clone();
        py.detach(|| dynid::report_page(&found, &self.record)).map_err(|e| raise(py, &e))
    }

    /// Text, notes and loops of an export: `urdf`, `mjcf` or `model`.
    #[pyo3(signature = (kind, allow_unphysical=false))]
    fn exported(
        &self,
        py: Python<'_>,
        kind: &str,
        allow_unphysical: bool,
    ) -> PyResult<(String, Vec<String>, Option<String>)> {
        let kind = match kind {
            "urdf" => Kind::Urdf,
            "mjcf" => Kind::Mjcf,
            "model" => Kind::Model,
            _ => {
                return Err(PyValueError::new_err(format!(
                    "kind: expected urdf, mjcf or model, found {kind}"
                )));
            }
        };
        py.detach(|| self.export(kind, allow_unphysical)).map_err(|e| raise(py, &e))
    }

    fn __repr__(&self) -> String {
        format!("<dynid.Estimate of {}: {}>", self.record.robot, self.record.verdict.status)
    }

    #[staticmethod]
    fn restored(
        py: Python<'_>,
        text: &[u8],
        source: Option<(PathBuf, String)>,
        covariance: Option<(Vec<String>, Vec<f64>)>,
    ) -> PyResult<Self> {
        let record = Record::parse(text, "estimate").map_err(|e| raise(py, &e))?;
        let source = source.map(|(path, text)| (path, Arc::from(text)));
        Estimate::whole(record, None, source, covariance).map_err(|e| raise(py, &e))
    }

    #[expect(clippy::type_complexity, reason = "what Python wants of a pickle")]
    fn __reduce__<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(
        Bound<'py, PyAny>,
        (Bound<'py, PyBytes>, Option<(PathBuf, String)>, Option<(Vec<String>, Vec<f64>)>),
    )> {
        let text = PyBytes::new(py, self.record.to_json().as_bytes());
        let source = self.source.as_ref().map(|(path, text)| (path.clone(), text.to_string()));
        Ok((py.get_type::<Estimate>().getattr("restored")?, (text, source, self.covariance.clone())))
    }
}

impl Estimate {
    /// The robot of a result that was read.
    fn read_robot(&self) -> Result<dynid::Robot, dynid::Error> {
        let options = dynid::RobotOptions::default();
        match (&self.source, self.record.robot_file()) {
            (Some((path, text)), _) => dynid::Robot::parse(text, path, &options),
            (None, Some(file)) => dynid::Robot::load(file.path.as_ref(), &options),
            (None, None) => Err(dynid::Error::Unsupported("the estimate names no robot file".to_owned())),
        }
    }
}

/// Channels that a model reads, each as long as the states.
fn extra(
    py: Python<'_>,
    model: &RobotModel,
    given: Option<&Bound<'_, PyDict>>,
    rows: usize,
) -> PyResult<Vec<(String, Vec<f64>)>> {
    let mut out = Vec::new();
    for (name, values) in given.into_iter().flatten() {
        let name: String = name.extract()?;
        if !model.channels().contains(&name) {
            let known = model.channels().join(", ");
            let text = format!("channels: expected one of [{known}], found `{name}`");
            return Err(PyValueError::new_err(text));
        }
        let values = as_doubles(&values)?;
        let values = values.as_slice()?.to_vec();
        demand_finite(&name, &values, 1)?;
        if values.len() != rows {
            let text = format!("channels: {name}: expected {rows} values, found {}", values.len());
            return Err(PyValueError::new_err(text));
        }
        out.push((name, values));
    }
    match model.channels().iter().find(|c| !out.iter().any(|(name, _)| name == *c)) {
        Some(channel) => Err(raise(py, &dynid::Error::StatesChannel { channel: channel.clone() })),
        None => Ok(out),
    }
}

/// Identifies a robot from logs in memory.
#[pyfunction]
#[pyo3(signature = (robot, logs, validation, settings_json, *, progress=None, threads=0))]
pub(crate) fn identify(
    py: Python<'_>,
    robot: &Robot,
    logs: Vec<PyRef<'_, Log>>,
    validation: Vec<PyRef<'_, Log>>,
    settings_json: &str,
    progress: Option<Bound<'_, PyAny>>,
    threads: usize,
) -> PyResult<Estimate> {
    let settings = settings(py, settings_json)?;
    let own = robot.robot.clone();
    let source = robot.text.clone().map(|text| (own.path.clone(), text));
    let all: Vec<(Log, bool)> = logs
        .iter()
        .map(|l| ((**l).clone(), false))
        .chain(validation.iter().map(|l| ((**l).clone(), true)))
        .collect();
    crate::work::run(py, progress, threads, move |tell| {
        let logs =
            all.iter().map(|(log, validation)| log.of(&own, *validation)).collect::<Result<Vec<_>, _>>()?;
        drop(all);
        let found = dynid::pipeline::identify(&own, logs, &settings, &mut |step| tell(step.to_string()))?;
        let record = Record { exported: exported(&found)?, ..found.estimate() };
        Estimate::new(record, Some(found), source)
    })
}

/// Does what a configuration file says.
#[pyfunction]
#[pyo3(signature = (path, *, progress=None, threads=0))]
pub(crate) fn identify_file(
    py: Python<'_>,
    path: PathBuf,
    progress: Option<Bound<'_, PyAny>>,
    threads: usize,
) -> PyResult<Estimate> {
    crate::work::run(py, progress, threads, move |tell| {
        let config = Config::read(&path)?;
        let run = dynid::identify(&config, &mut |step| tell(step.to_string()))?;
        let record = run.estimate();
        Estimate::new(record, Some(run.identification), None)
    })
}
