//! Parts of a study's page: cells, tables, axes, curves.

use std::borrow::Borrow;

use dynid::report::{ChartAxis, ChartCurve, CurveStyle, StudyTable, Value};

/// A cell of words.
pub(crate) fn text(words: impl Into<String>) -> Value {
    Value::from(words.into())
}

/// A table with the names of its columns.
pub(crate) fn table(caption: &str, head: &[&str], rows: Vec<Vec<Value>>) -> StudyTable {
    StudyTable { caption: caption.into(), head: head.iter().map(|h| (*h).to_owned()).collect(), rows }
}

pub(crate) fn axis(label: &str, unit: &str) -> ChartAxis {
    ChartAxis { label: label.into(), unit: unit.into(), logarithmic: false }
}

pub(crate) fn logarithmic(label: &str, unit: &str) -> ChartAxis {
    ChartAxis { logarithmic: true, ..axis(label, unit) }
}

pub(crate) fn curve(name: &str, points: Vec<[f64; 2]>, style: CurveStyle) -> ChartCurve {
    ChartCurve { name: name.into(), points, style }
}

/// Points of a signal over time, as many as both have.
pub(crate) fn over(time: &[f64], signal: impl IntoIterator<Item = impl Borrow<f64>>) -> Vec<[f64; 2]> {
    time.iter().zip(signal).map(|(t, x)| [*t, *x.borrow()]).collect()
}
