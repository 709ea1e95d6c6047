//! Logs reduced by the recipe of an estimate: bytes that travel, merge and are solved.

use dynid::reduce::Reduction;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::error::raise;
use crate::estimate::Estimate;
use crate::log::Log;

/// Factors of logs with the recipe that they were reduced by.
#[pyclass(frozen, module = "dynid._native")]
#[derive(Clone)]
pub(crate) struct Factor {
    pub(crate) reduction: Reduction,
}

#[pymethods]
impl Factor {
    /// Reduces logs by the choices of an identification.
    #[staticmethod]
    fn of(
        py: Python<'_>,
        estimate: PyRef<'_, Estimate>,
        logs: Vec<PyRef<'_, Log>>,
        delays: bool,
        payload: Option<String>,
    ) -> PyResult<Self> {
        let found = estimate.found(py, "reduce")?.clone();
        let logs: Vec<Log> = logs.iter().map(|l| (**l).clone()).collect();
        let reduction = crate::work::run(py, None, 0, move |_| {
            let recipe = found.recipe()?;
            let recipe = if delays { recipe.with_delays() } else { recipe };
            let recipe = match &payload {
                Some(link) => recipe.with_payload(link)?,
                None => recipe,
            };
            let reducer = recipe.reducer()?;
            let logs =
                logs.iter().map(|log| log.of(&reducer.robot().axes, false)).collect::<Result<Vec<_>, _>>()?;
            Reduction::of(&reducer, logs)
        })?;
        Ok(Factor { reduction })
    }

    #[staticmethod]
    fn from_bytes(py: Python<'_>, data: &[u8]) -> PyResult<Self> {
        let reduction = Reduction::from_bytes(data, "bytes").map_err(|e| raise(py, &e.into()))?;
        Ok(Factor { reduction })
    }

    fn to_bytes<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, &self.reduction.to_bytes())
    }

    #[staticmethod]
    fn merge(py: Python<'_>, parts: Vec<PyRef<'_, Factor>>) -> PyResult<Self> {
        let parts: Vec<Reduction> = parts.iter().map(|p| p.reduction.clone()).collect();
        let reduction = Reduction::merge(parts).map_err(|e| raise(py, &e.into()))?;
        Ok(Factor { reduction })
    }

    #[pyo3(signature = (logs))]
    fn reduce(&self, py: Python<'_>, logs: Vec<PyRef<'_, Log>>) -> PyResult<Self> {
        let recipe = self.reduction.recipe().clone();
        let logs: Vec<Log> = logs.iter().map(|l| (**l).clone()).collect();
        let reduction = crate::work::run(py, None, 0, move |_| {
            let reducer = recipe.reducer()?;
            let logs =
                logs.iter().map(|log| log.of(&reducer.robot().axes, false)).collect::<Result<Vec<_>, _>>()?;
            Reduction::of(&reducer, logs)
        })?;
        Ok(Factor { reduction })
    }

    #[pyo3(signature = (validation=Vec::new(), *, progress=None, threads=0))]
    fn solve(
        &self,
        py: Python<'_>,
        validation: Vec<PyRef<'_, Log>>,
        progress: Option<Bound<'_, PyAny>>,
        threads: usize,
    ) -> PyResult<Estimate> {
        let reduction = self.reduction.clone();
        let logs: Vec<Log> = validation.iter().map(|l| (**l).clone()).collect();
        crate::work::run(py, progress, threads, move |tell| {
            let reducer = reduction.recipe().clone().reducer()?;
            let logs =
                logs.iter().map(|log| log.of(&reducer.robot().axes, true)).collect::<Result<Vec<_>, _>>()?;
            let found = reduction.solve(logs, &mut |step| tell(step.to_string()))?;
            let estimate = dynid::reduce::estimate(&found, reduction.recipe());
            Estimate::new(estimate, Some(found), None)
        })
    }

    #[getter]
    fn logs(&self) -> Vec<String> {
        self.reduction.logs().iter().map(|log| log.facts.name.clone()).collect()
    }

    fn __repr__(&self) -> String {
        format!("<dynid.Factor of {} logs>", self.reduction.logs().len())
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, (Bound<'py, PyBytes>,))> {
        Ok((py.get_type::<Factor>().getattr("from_bytes")?, (self.to_bytes(py),)))
    }
}
