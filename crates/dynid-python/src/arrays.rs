//! NumPy arrays in and out: a state or a batch of states per argument, rows of doubles, and chunks of them for the engine, which wants
//! one joint after the other.

use numpy::{
    PyArray1, PyArray2, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods, ndarray::IxDyn,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{IntoPyDict, PyDict};
use rayon::prelude::*;

use crate::work::pool;

/// A vector.
pub(crate) type Vector<'py> = Bound<'py, PyArray1<f64>>;
/// A matrix.
pub(crate) type Matrix<'py> = Bound<'py, PyArray2<f64>>;

/// States of a chunk: what a core holds in its caches with the rows of a regressor.
pub(crate) const CHUNK: usize = 64;

/// Rows of doubles: `(columns,)` for one state, `(rows, columns)` for many.
pub(crate) struct Batch<'py> {
    array: PyReadonlyArrayDyn<'py, f64>,
    /// Number of states.
    pub(crate) rows: usize,
    /// Numbers per state.
    pub(crate) columns: usize,
    /// Whether one state was given without the axis of states.
    pub(crate) single: bool,
}

impl<'py> Batch<'py> {
    /// Takes anything that NumPy makes an array of; an array of doubles in C order is taken as it is.
    pub(crate) fn take(name: &str, value: &Bound<'py, PyAny>, columns: usize) -> PyResult<Self> {
        let array = as_doubles(value)?;
        let shape = array.shape();
        let (rows, found, single) = match shape {
            [n] => (1, *n, true),
            [rows, n] => (*rows, *n, false),
            _ => (0, 0, false),
        };
        if found != columns || shape.is_empty() || shape.len() > 2 {
            return Err(PyValueError::new_err(format!(
                "{name}: expected shape ({columns},) or (n, {columns}), found {shape:?}"
            )));
        }
        Ok(Batch { array, rows, columns, single })
    }

    /// Fails unless there are as many states as in `q`.
    pub(crate) fn demand_rows(&self, name: &str, rows: usize) -> PyResult<()> {
        if self.rows == rows {
            return Ok(());
        }
        Err(PyValueError::new_err(format!("{name}: expected {rows} states as in q, found {}", self.rows)))
    }

    /// The numbers, row after row.
    pub(crate) fn values(&self) -> PyResult<&[f64]> {
        Ok(self.array.as_slice()?)
    }
}

/// A finite number wherever one is expected: what is not a number would come out as one that is none either.
pub(crate) fn demand_finite(name: &str, values: &[f64], columns: usize) -> PyResult<()> {
    match values.iter().position(|x| !x.is_finite()) {
        None => Ok(()),
        Some(k) => Err(PyValueError::new_err(format!(
            "{name}[{}, {}]: expected a finite number, found {}",
            k / columns,
            k % columns,
            values[k]
        ))),
    }
}

/// An array of doubles in C order.
pub(crate) fn as_doubles<'py>(value: &Bound<'py, PyAny>) -> PyResult<PyReadonlyArrayDyn<'py, f64>> {
    static TO_ARRAY: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
    if let Ok(array) = value.cast::<PyArrayDyn<f64>>()
        && array.is_c_contiguous()
    {
        return Ok(array.try_readonly()?);
    }
    let py = value.py();
    let to_array = TO_ARRAY
        .get_or_try_init(py, || Ok::<_, PyErr>(py.import("numpy")?.getattr("ascontiguousarray")?.unbind()))?;
    let options: Bound<'py, PyDict> = [("dtype", "float64")].into_py_dict(py)?;
    // What has no axis gets one there.
    let array = to_array.bind(py).call((value,), Some(&options))?;
    Ok(array.cast::<PyArrayDyn<f64>>()?.try_readonly()?)
}

/// Vectors by name.
pub(crate) fn columns_by_name(given: Option<&Bound<'_, PyDict>>) -> PyResult<Vec<(String, Vec<f64>)>> {
    let of = |(name, values): (Bound<'_, PyAny>, Bound<'_, PyAny>)| {
        let (name, values) = (name.extract::<String>()?, as_doubles(&values)?);
        if values.ndim() != 1 {
            return Err(PyValueError::new_err(format!(
                "{name}: expected a vector, found shape {:?}",
                values.shape()
            )));
        }
        Ok((name, values.as_slice()?.to_vec()))
    };
    given.into_iter().flatten().map(of).collect()
}

/// An array of zeros that is filled by the caller, with the axis of states left out for a single one.
pub(crate) fn filled<'py>(
    py: Python<'py>,
    (rows, single): (usize, bool),
    shape: &[usize],
    fill: impl FnOnce(&mut [f64]) -> PyResult<()>,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let whole: Vec<usize> =
        if single { shape.to_vec() } else { std::iter::once(rows).chain(shape.iter().copied()).collect() };
    let array = PyArrayDyn::<f64>::zeros(py, IxDyn(&whole), false);
    {
        let mut writable = array.try_readwrite()?;
        fill(writable.as_slice_mut()?)?;
    }
    Ok(array)
}

/// A one-dimensional array.
pub(crate) fn vector<'py>(py: Python<'py>, values: &[f64]) -> Vector<'py> {
    PyArray1::from_slice(py, values)
}

/// Rows `from..from + count` of row-major numbers, column after column.
pub(crate) fn transpose(values: &[f64], columns: usize, from: usize, count: usize, to: &mut [f64]) {
    for (s, row) in values[from * columns..][..count * columns].chunks_exact(columns.max(1)).enumerate() {
        for (c, x) in row.iter().enumerate() {
            to[c * count + s] = *x;
        }
    }
}

/// Works through rows, `chunk` at a time, with `width` numbers of output per row; on `threads` threads (0: all), with the same bits for any
/// number.
pub(crate) fn by_chunks<S>(
    (threads, chunk): (usize, usize),
    width: usize,
    out: &mut [f64],
    scratch: impl Fn() -> S + Sync + Send,
    work: impl Fn(usize, &mut [f64], &mut S) + Sync + Send,
) -> PyResult<()> {
    let length = chunk * width;
    if length == 0 {
        return Ok(());
    }
    if threads == 1 || out.len() <= length {
        let mut own = scratch();
        out.chunks_mut(length).enumerate().for_each(|(k, part)| work(k * chunk, part, &mut own));
        return Ok(());
    }
    let run = |out: &mut [f64]| {
        out.par_chunks_mut(length)
            .enumerate()
            .for_each_init(&scratch, |own, (k, part)| work(k * chunk, part, own));
    };
    match threads {
        0 => run(out),
        n => pool(n)?.install(|| run(out)),
    }
    Ok(())
}
