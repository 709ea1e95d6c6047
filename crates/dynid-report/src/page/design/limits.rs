//! Uses of limits as a table of joints and kinds, and a list of the others.

use serde::Serialize;

use crate::data::{DesignReport, LimitUse};

/// A use this much above 100 % is more than rounding.
const BROKEN_PERCENT: f64 = 100.001;

#[derive(Debug, Serialize)]
pub(super) struct LimitsView<'a> {
    /// Headings of the table.
    kinds: Vec<&'a str>,
    rows: Vec<JointRow<'a>>,
    others: Vec<UseView<'a>>,
    acting: Vec<UseView<'a>>,
}

#[derive(Debug, Serialize)]
struct JointRow<'a> {
    joint: &'a str,
    /// One per kind; `None` where there is no such limit.
    cells: Vec<Option<UseView<'a>>>,
}

#[derive(Debug, Clone, Copy, Serialize)]
struct UseView<'a> {
    #[serde(flatten)]
    limit: &'a LimitUse,
    broken: bool,
}

pub(super) fn limits(data: &DesignReport) -> LimitsView<'_> {
    let mut kinds: Vec<&str> = Vec::new();
    let mut rows: Vec<JointRow<'_>> =
        data.joints.iter().map(|j| JointRow { joint: &j.name, cells: Vec::new() }).collect();
    let mut others = Vec::new();
    for view in data.limits.iter().map(view) {
        let LimitUse { kind, subject, .. } = view.limit;
        let row = rows.iter().position(|r| r.joint == subject).filter(|_| view.limit.use_percent.is_some());
        let Some(row) = row else {
            others.push(view);
            continue;
        };
        let column = kinds.iter().position(|k| k == kind).unwrap_or_else(|| {
            kinds.push(kind);
            kinds.len() - 1
        });
        let cells = &mut rows[row].cells;
        if cells.len() <= column {
            cells.resize(column + 1, None);
        }
        // A second limit of the same kind on the same joint has no place in the table.
        match &mut cells[column] {
            free @ None => *free = Some(view),
            Some(_) => others.push(view),
        }
    }
    if kinds.is_empty() {
        rows.clear();
    }
    for row in &mut rows {
        row.cells.resize(kinds.len(), None);
    }
    let acting = data.limits.iter().filter(|l| l.acts).map(view).collect();
    LimitsView { kinds, rows, others, acting }
}

fn view(limit: &LimitUse) -> UseView<'_> {
    let broken =
        limit.use_percent.is_some_and(|p| p > BROKEN_PERCENT) || limit.margin.is_some_and(|m| m < -1e-6);
    UseView { limit, broken }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::DesignJoint;

    #[test]
    fn every_limit_has_one_place() {
        let limit = |kind: &str, subject: &str, percent: Option<f64>| LimitUse {
            kind: kind.to_owned(),
            subject: subject.to_owned(),
            use_percent: percent,
            acts: percent == Some(100.0),
            ..LimitUse::default()
        };
        let joint = |name: &str| DesignJoint { name: name.to_owned(), ..DesignJoint::default() };
        let data = DesignReport {
            joints: vec![joint("a"), joint("b")],
            limits: vec![
                limit("velocity", "b", Some(100.0)),
                limit("effort", "a", Some(20.0)),
                limit("effort", "a", Some(30.0)),
                limit("plane", "tool", None),
            ],
            ..DesignReport::default()
        };
        let view = limits(&data);
        assert_eq!(view.kinds, ["velocity", "effort"]);
        let percent = |row: usize, column: usize| {
            view.rows[row].cells[column].map(|c| c.limit.use_percent.unwrap_or_default())
        };
        assert_eq!(
            [percent(0, 0), percent(0, 1), percent(1, 0), percent(1, 1)],
            [None, Some(20.0), Some(100.0), None]
        );
        assert_eq!(view.others.len(), 2);
        assert_eq!(view.acting.len(), 1);
    }
}
