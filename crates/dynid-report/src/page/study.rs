//! What the templates of a study's page see.

use minijinja::context;
use minijinja::value::{Serde, Value};
use serde::Serialize;

use crate::data::{Chart, ChartAxis, Fact, StudyReport, StudySection, StudyTable};
use crate::drawing::chart_svg;

pub(super) fn context(data: &StudyReport) -> Value {
    let sections: Vec<SectionView<'_>> = data.sections.iter().map(section).collect();
    context! {
        title => data.title.as_str(),
        verdict => Serde(&data.verdict),
        warnings => Serde(&data.warnings),
        introduction => Serde(&data.introduction),
        rows => Serde(&data.rows),
        passed => data.rows.iter().filter(|r| r.pass).count(),
        sections => Serde(sections),
        provenance => Serde(&data.provenance),
    }
}

#[derive(Debug, Serialize)]
struct SectionView<'a> {
    title: &'a str,
    text: &'a [String],
    facts: &'a [Fact],
    tables: &'a [StudyTable],
    charts: Vec<ChartView<'a>>,
}

#[derive(Debug, Serialize)]
struct ChartView<'a> {
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
    style: crate::data::CurveStyle,
}

fn section(section: &StudySection) -> SectionView<'_> {
    SectionView {
        title: &section.title,
        text: &section.text,
        facts: &section.facts,
        tables: &section.tables,
        charts: section.charts.iter().map(chart).collect(),
    }
}

fn chart(chart: &Chart) -> ChartView<'_> {
    ChartView {
        title: &chart.title,
        note: &chart.note,
        x: &chart.x,
        y: &chart.y,
        curves: chart.curves.iter().map(|c| Legend { name: &c.name, style: c.style }).collect(),
        picture: chart_svg(chart),
    }
}
