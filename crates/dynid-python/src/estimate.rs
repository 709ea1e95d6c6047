//! Identification and what comes of it.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use dynid::config::Config;
use dynid::estimate::{Estimate as Record, Split, log_fit};
use dynid::export::{CheckStates, IdentifiedRobot, RobotExport, Source, exported, json};
use dynid::model::{EffortModel, RobotModel};
use dynid::pipeline::Identification;
use dynid::validate::validate_logs;
use numpy::{PyArrayDyn, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::arrays::{Matrix, Vector, columns_by_name, vector};
use crate::error::{raise, unsupported, warn};
use crate::log::Log;
use crate::robot::Robot;
use crate::settings::{as_json, settings};
use crate::states::{Given, channels_of};

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

    /// The robot file that was identified, and whether its file has changed since.
    fn source(&self) -> Result<(Source, Option<String>), dynid::Error> {
        if let Some((path, text)) = &self.source {
            return Ok((Source::parse(text, path)?, None));
        }
        let Some(file) = self.record.robot_file() else {
            return Err(dynid::Error::Unsupported("the estimate names no robot file".to_owned()));
        };
        let path = Path::new(&file.path);
        let source = Source::read(path)?;
        let changed = source.sha256() != Some(file.sha256.as_str());
        Ok((source, changed.then(|| format!("{} has changed since it was identified", file.path))))
    }

    /// A robot file by the identified model; `name` of a URDF in the file of its loops.
    fn export(&self, kind: Kind, name: &str, allow_unphysical: bool) -> Result<Made, dynid::Error> {
        let (source, changed) = self.source()?;
        let identified = IdentifiedRobot::of(&self.record, Path::new("estimate"))?;
        let states = CheckStates::random(identified.identified().model);
        let export = RobotExport::new(identified.identified(), &source)?
            .with_projections(&self.record.exported.projections);
        if !allow_unphysical {
            export.require_physical()?;
        }
        let (made, loops) = match kind {
            Kind::Urdf => (export.urdf(&states)?, export.loops(name)),
            Kind::Mjcf => (export.mjcf(&states)?, None),
            Kind::Model => (json(&identified.identified(), &states)?, None),
        };
        let faults = export.faults().iter();
        let refused =
            faults.map(|f| format!("link `{}` {}: simulators refuse such a robot", f.link, f.fault));
        let notes = changed.into_iter().chain(made.notes).chain(refused).collect();
        Ok(Made { text: made.text, notes, loops, included: made.included })
    }
}

/// A file that was made.
struct Made {
    text: String,
    notes: Vec<String>,
    loops: Option<String>,
    /// Included files that change with an MJCF, by their paths from its folder.
    included: Vec<(String, String)>,
}

/// Text of an exported file, of the file of its loops, and of files that it includes.
type Texts = (String, Option<String>, Vec<(String, String)>);

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
        let given = Given::take(model, q, v, a)?;
        let states = given.of(py, model)?;
        let channels = channels_of(py, model, columns_by_name(channels)?, states.rows)?;
        states.efforts(py, linear, &channels, threads)
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
        let (model, linear) = self.model(unconstrained);
        let axes = dynid::log::axes(model);
        let logs: Vec<Log> = logs.iter().map(|l| (**l).clone()).collect();
        let found = py.detach(|| {
            let loaded = logs.iter().map(|log| log.of(&axes, true));
            validate_logs(&self.record, (model, linear), loaded, filter_hz)
        });
        let found = found.map_err(|e| raise(py, &e))?;
        found.warnings.iter().try_for_each(|warning| warn(py, warning))?;
        as_json(&found.agreements.iter().map(log_fit).collect::<Vec<_>>())
    }

    /// What was found of bodies that some logs carry: records as JSON.
    fn payloads(&self, py: Python<'_>) -> PyResult<String> {
        let records = dynid::payload::payload_records(self.found(py, "payloads")?);
        as_json(&records)
    }

    fn report(&self, py: Python<'_>) -> PyResult<String> {
        let found = self.found(py, "report")?.clone();
        py.detach(|| dynid::report_page(&found, &self.record)).map_err(|e| raise(py, &e))
    }

    /// Text of a robot file, `urdf`, `mjcf` or `model`, of the file of its loops beside a URDF of that name, and of files that an MJCF includes
    /// and that change with it; what is lost is told.
    #[pyo3(signature = (kind, name, allow_unphysical))]
    fn exported(&self, py: Python<'_>, kind: &str, name: &str, allow_unphysical: bool) -> PyResult<Texts> {
        let kind = match kind {
            "urdf" => Kind::Urdf,
            "mjcf" => Kind::Mjcf,
            "model" => Kind::Model,
            _ => {
                let text = format!("kind: expected urdf, mjcf or model, found {kind}");
                return Err(PyValueError::new_err(text));
            }
        };
        let made = py.detach(|| self.export(kind, name, allow_unphysical)).map_err(|e| raise(py, &e))?;
        made.notes.iter().try_for_each(|note| warn(py, note))?;
        Ok((made.text, made.loops, made.included))
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
        let logs = all
            .iter()
            .map(|(log, validation)| log.of(&own.axes, *validation))
            .collect::<Result<Vec<_>, _>>()?;
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
