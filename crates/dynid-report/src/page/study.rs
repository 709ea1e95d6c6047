//! What the templates of a study's page see.

use minijinja::context;
use minijinja::value::{Serde, Value};
use serde::Serialize;

use super::chart::{ChartView, chart};
use crate::data::{Fact, StudyReport, StudySection, StudyTable};

pub(super) fn context(kind: &str, data: &StudyReport) -> Value {
    context! {
        kind => kind,
        title => data.title.as_str(),
        verdict => Serde(&data.verdict),
        warnings => Serde(&data.warnings),
        introduction => Serde(&data.introduction),
        rows => Serde(&data.rows),
        graded => data.rows.iter().filter(|r| r.pass.is_some()).count(),
        sections => Serde(sections(&data.sections)),
        provenance => Serde(&data.provenance),
    }
}

/// Sections as their template sees them.
pub(super) fn sections(list: &[StudySection]) -> Vec<SectionView<'_>> {
    list.iter().map(section).collect()
}

#[derive(Debug, Serialize)]
pub(super) struct SectionView<'a> {
    title: &'a str,
    text: &'a [String],
    facts: &'a [Fact],
    tables: &'a [StudyTable],
    charts: Vec<ChartView<'a>>,
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
