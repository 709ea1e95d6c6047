//! Standard parameters by owner, and how many of them can be trusted.

use serde::Serialize;

use super::words::look;
use crate::data::{Consistency, OwnerKind, ParameterVerdict, ReportData, StandardParameter};
use crate::drawing::counts_svg;

#[derive(Debug, Serialize)]
pub(super) struct TrustView<'a> {
    all: usize,
    seen: usize,
    carried: usize,
    not_identifiable: usize,
    given: usize,
    /// The counts as one bar.
    bar: String,
    groups: Vec<Group<'a>>,
}

/// Parameters of one link or joint.
#[derive(Debug, Serialize)]
struct Group<'a> {
    owner: &'a str,
    kind: OwnerKind,
    seen: usize,
    /// Constraints that hold it.
    limits: Vec<&'a str>,
    rows: Vec<Row<'a>>,
}

#[derive(Debug, Serialize)]
struct Row<'a> {
    #[serde(flatten)]
    parameter: &'a StandardParameter,
    /// The value in use lies outside the interval, which is that of the data.
    outside: bool,
}

pub(super) fn trust(data: &ReportData) -> TrustView<'_> {
    let parameters = &data.standard_parameters;
    let count = |v: ParameterVerdict| parameters.iter().filter(|p| p.verdict == Some(v)).count();
    let (seen, carried, none) = (
        count(ParameterVerdict::SeenInData),
        count(ParameterVerdict::CarriedByPrior),
        count(ParameterVerdict::NotIdentifiable),
    );
    TrustView {
        all: parameters.len(),
        seen,
        carried,
        not_identifiable: none,
        given: count(ParameterVerdict::Given),
        bar: counts_svg(
            &format!("{seen} seen in the data, {carried} carried by the prior, {none} not identifiable"),
            &[
                (look(ParameterVerdict::SeenInData), seen),
                (look(ParameterVerdict::CarriedByPrior), carried),
                (look(ParameterVerdict::NotIdentifiable), none),
                ("unknown", parameters.len() - seen - carried - none),
            ],
        ),
        groups: groups(parameters, data.consistency.as_ref()),
    }
}

fn groups<'a>(parameters: &'a [StandardParameter], consistency: Option<&'a Consistency>) -> Vec<Group<'a>> {
    let mut groups: Vec<Group<'a>> = Vec::new();
    for p in parameters {
        let row = Row {
            parameter: p,
            outside: matches!((p.value, p.interval), (Some(v), Some([low, high])) if v < low || v > high),
        };
        let seen = usize::from(p.verdict == Some(ParameterVerdict::SeenInData));
        match groups.iter_mut().find(|g| g.owner == p.owner && g.kind == p.owner_kind) {
            Some(group) => {
                group.seen += seen;
                group.rows.push(row);
            }
            None => groups.push(Group {
                owner: &p.owner,
                kind: p.owner_kind,
                seen,
                limits: limits(consistency, &p.owner, p.owner_kind),
                rows: vec![row],
            }),
        }
    }
    groups
}

fn limits<'a>(consistency: Option<&'a Consistency>, owner: &str, kind: OwnerKind) -> Vec<&'a str> {
    let all = consistency.map_or(&[][..], |c| &c.limits);
    all.iter().filter(|l| l.owner == owner && l.owner_kind == kind).map(|l| l.text.as_str()).collect()
}

/// Constraints by owner, in order of first appearance.
#[derive(Debug, Serialize)]
pub(super) struct OwnerLimits<'a> {
    owner: &'a str,
    kind: OwnerKind,
    limits: Vec<&'a str>,
}

pub(super) fn limits_by_owner(consistency: Option<&Consistency>) -> Vec<OwnerLimits<'_>> {
    let mut out: Vec<OwnerLimits<'_>> = Vec::new();
    for l in consistency.map_or(&[][..], |c| &c.limits) {
        match out.iter_mut().find(|o| o.owner == l.owner && o.kind == l.owner_kind) {
            Some(known) => known.limits.push(&l.text),
            None => out.push(OwnerLimits { owner: &l.owner, kind: l.owner_kind, limits: vec![&l.text] }),
        }
    }
    out
}
