//! What the templates of a page by joints see.

use minijinja::context;
use minijinja::value::{Serde, Value};
use serde::Serialize;

use super::chart::{ChartView, chart};
use crate::data::{ChartAxis, Fact, JointSection, JointsReport, Status, StudyTable};
use crate::drawing::{by_temperature_svg, surface_svg};

pub(super) fn context(data: &JointsReport) -> Value {
    let sections: Vec<JointView<'_>> = data.overview.iter().chain(&data.joints).map(joint).collect();
    context! {
        kind => data.kind.as_str(),
        title => data.title.as_str(),
        verdict => Serde(&data.verdict),
        warnings => Serde(&data.warnings),
        robot => Serde(&data.robot),
        introduction => Serde(&data.introduction),
        counted => data.counted.clone().unwrap_or_else(|| joints(data.joints.len())),
        sections => Serde(sections),
        provenance => Serde(&data.provenance),
    }
}

fn joints(count: usize) -> String {
    format!("{count} joint{}", if count == 1 { "" } else { "s" })
}

#[derive(Debug, Serialize)]
struct JointView<'a> {
    name: &'a str,
    status: Status,
    state: &'a str,
    facts: &'a [Fact],
    notes: &'a [String],
    tables: &'a [StudyTable],
    maps: Vec<MapView<'a>>,
    charts: Vec<ChartView<'a>>,
}

/// A picture whose curves name themselves.
#[derive(Debug, Serialize)]
struct MapView<'a> {
    title: &'a str,
    note: &'a str,
    x: &'a ChartAxis,
    y: &'a ChartAxis,
    curves: [(); 0],
    picture: String,
}

fn joint(test: &JointSection) -> JointView<'_> {
    let curves = test.curves.iter().map(|c| MapView {
        title: &c.title,
        note: &c.note,
        x: &c.x,
        y: &c.y,
        curves: [],
        picture: by_temperature_svg(c),
    });
    let surface = test.surface.iter().map(|s| MapView {
        title: &s.title,
        note: &s.note,
        x: &s.x,
        y: &s.y,
        curves: [],
        picture: surface_svg(s),
    });
    JointView {
        name: &test.name,
        status: test.status,
        state: &test.state,
        facts: &test.facts,
        notes: &test.notes,
        tables: &test.tables,
        maps: curves.chain(surface).collect(),
        charts: test.charts.iter().map(chart).collect(),
    }
}
