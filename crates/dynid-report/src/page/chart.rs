//! What the templates see of a chart.

use serde::Serialize;

use crate::data::{Chart, ChartAxis, CurveStyle};
use crate::drawing::chart_svg;

#[derive(Debug, Serialize)]
pub(super) struct ChartView<'a> {
    title: &'a str,
    note: &'a str,
    x: &'a ChartAxis,
    y: &'a ChartAxis,
    curves: Vec<Legend<'a>>,
    picture: String,
}

#[derive(Debug, Serialize)]
struct Legend<'a> {
    name: &'a str,
    style: CurveStyle,
}

pub(super) fn chart(chart: &Chart) -> ChartView<'_> {
    ChartView {
        title: &chart.title,
        note: &chart.note,
        x: &chart.x,
        y: &chart.y,
        curves: chart
            .curves
            .iter()
            .filter(|c| c.style != CurveStyle::Named)
            .map(|c| Legend { name: &c.name, style: c.style })
            .collect(),
        picture: chart_svg(chart),
    }
}
