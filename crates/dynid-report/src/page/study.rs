//! What the templates of a study's page see.

use minijinja::context;
use minijinja::value::{Serde, Value};
use serde::Serialize;

use super::chart::{ChartView, chart};
use crate::data::{Fact, Ranking, StudyReport, StudySection, StudyTable};
use crate::drawing::ranked_svg;

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
    rankings: Vec<RankingView<'a>>,
}

/// A ranking on a scale of its own.
#[derive(Debug, Serialize)]
struct RankingView<'a> {
    title: &'a str,
    note: &'a str,
    unit: &'a str,
    rows: Vec<RankedView<'a>>,
}

#[derive(Debug, Serialize)]
struct RankedView<'a> {
    name: &'a str,
    value: f64,
    error: f64,
    /// The value with its error as a picture.
    picture: String,
}

fn ranking(data: &Ranking) -> RankingView<'_> {
    let ends = data.rows.iter().map(|row| row.value + row.error).filter(|x| x.is_finite());
    let most = ends.fold(0.0, f64::max);
    RankingView {
        title: &data.title,
        note: &data.note,
        unit: &data.unit,
        rows: data
            .rows
            .iter()
            .map(|row| RankedView {
                name: &row.name,
                value: row.value,
                error: row.error,
                picture: ranked_svg(row.value, row.error, most),
            })
            .collect(),
    }
}

pub(super) fn section(section: &StudySection) -> SectionView<'_> {
    SectionView {
        title: &section.title,
        text: &section.text,
        facts: &section.facts,
        tables: &section.tables,
        charts: section.charts.iter().map(chart).collect(),
        rankings: section.rankings.iter().map(ranking).collect(),
    }
}
