//! DH tables to links and joints.

use dynid_files::excerpt::excerpt;
use dynid_model::{Description, JointDescription, JointKind, Limits, LinkDescription, Placement};
use toml::Spanned;

use super::Source;
use super::schema::{Dh, Frame, LimitsToml, RobotToml, Row, RowKind};
use crate::robot_error::RobotFileError;
use crate::robot_numbers::LEAST_LIMIT;

const X: [f64; 3] = [1.0, 0.0, 0.0];
const Z: [f64; 3] = [0.0, 0.0, 1.0];

pub(super) fn build(
    source: &Source<'_>,
    robot: &RobotToml,
    rows: &[Spanned<Row>],
) -> Result<Description, RobotFileError> {
    let missing = |expected: &str| RobotFileError::Missing {
        at: source.place(0),
        owner: "robot".to_owned(),
        expected: expected.to_owned(),
    };
    let Some(dh) = robot.dh.as_ref().map(|d| *d.get_ref()) else {
        return Err(missing("`dh = \"modified\"` or `dh = \"standard\"` beside DH rows"));
    };
    if rows.is_empty() {
        return Err(missing("at least one row in `joint`"));
    }
    source.unique("joint", rows.iter().map(|r| (r.span().start, r.get_ref().name.as_str())))?;
    let links: Vec<String> = rows
        .iter()
        .enumerate()
        .map(|(k, r)| r.get_ref().link.clone().unwrap_or_else(|| format!("link{}", k + 1)))
        .collect();
    let reserved = std::iter::once((0, "base"));
    let named = rows.iter().zip(&links).map(|(r, name)| (r.span().start, name.as_str()));
    source.unique("link", reserved.chain(named))?;

    let mut description = Description::new("robot");
    description.links.push(LinkDescription { name: "base".to_owned(), inertia: None });
    let mut tail = Placement::identity();
    for ((k, row), link) in rows.iter().enumerate().zip(links) {
        let parent = description.links[k].name.clone();
        let (offset, row) = (row.span().start, row.get_ref());
        check_row(source, offset, dh, row)?;
        let own_tail = tail_of(dh, row);
        let placement = match dh {
            Dh::Modified => modified(row),
            Dh::Standard => tail.then(&standard_head(row)),
        };
        let owner = format!("joint `{}`", excerpt(&row.name));
        let inertia = source.inertia(offset, &owner, &row.stated_inertia())?.map(|phi| match row.frame {
            Frame::Joint => phi,
            Frame::Distal => phi.in_frame(&own_tail),
        });
        description.links.push(LinkDescription { name: link.clone(), inertia });
        description.joints.push(JointDescription {
            name: row.name.clone(),
            parent,
            child: link,
            kind: match row.kind {
                RowKind::Revolute => JointKind::Revolute,
                RowKind::Continuous => JointKind::Continuous,
                RowKind::Prismatic => JointKind::Prismatic,
            },
            placement,
            axis: Z,
            limits: limits(source, offset, &owner, &row.limits)?,
            mimic: None,
        });
        tail = own_tail;
    }
    add_tool(&mut description, dh, robot, &tail);
    Ok(description)
}

/// `d` belongs to revolute rows, `theta` to prismatic ones, `frame = "distal"` to standard tables.
fn check_row(source: &Source<'_>, offset: usize, dh: Dh, row: &Row) -> Result<(), RobotFileError> {
    let owner = format!("joint `{}`", excerpt(&row.name));
    let refuse =
        |field: &str, expected: &str, found: &str| Err(source.value(offset, &owner, field, expected, found));
    let prismatic = row.kind == RowKind::Prismatic;
    match (row.d, row.theta) {
        (Some(d), _) if prismatic && d.0 != 0.0 => {
            refuse("d", "none or 0 in a prismatic row (use `offset`)", &d.0.to_string())
        }
        (_, Some(theta)) if !prismatic && theta.0 != 0.0 => {
            refuse("theta", "none or 0 in a revolute row (use `offset`)", &theta.0.to_string())
        }
        _ if row.frame == Frame::Distal && dh == Dh::Modified => {
            refuse("frame", "`joint` with modified DH, whose frames lie on the joints", "distal")
        }
        _ => Ok(()),
    }
}

fn rotate_and_shift(row: &Row) -> Placement {
    let d = row.d.unwrap_or_default().0;
    let theta = row.theta.unwrap_or_default().0;
    match row.kind {
        RowKind::Prismatic => Placement::rotate(Z, theta).then(&Placement::translate(0.0, 0.0, row.offset.0)),
        RowKind::Revolute | RowKind::Continuous => {
            Placement::translate(0.0, 0.0, d).then(&Placement::rotate(Z, row.offset.0))
        }
    }
}

/// `Rx(alpha) Tx(a) Tz(d) Rz(offset)`; prismatic `Rx(alpha) Tx(a) Rz(theta) Tz(offset)`.
fn modified(row: &Row) -> Placement {
    Placement::rotate(X, row.alpha.0)
        .then(&Placement::translate(row.a.0, 0.0, 0.0))
        .then(&rotate_and_shift(row))
}

/// The part of a standard row in front of the motion: `Rz(offset)`; prismatic `Rz(theta) Tz(offset)`.
fn standard_head(row: &Row) -> Placement {
    match row.kind {
        RowKind::Prismatic => rotate_and_shift(row),
        RowKind::Revolute | RowKind::Continuous => Placement::rotate(Z, row.offset.0),
    }
}

/// The part of a standard row behind the motion: `Tz(d) Tx(a) Rx(alpha)`; prismatic `Tx(a) Rx(alpha)`.
fn tail_of(dh: Dh, row: &Row) -> Placement {
    let d = match (dh, row.kind) {
        (Dh::Modified, _) => return Placement::identity(),
        (Dh::Standard, RowKind::Prismatic) => 0.0,
        (Dh::Standard, _) => row.d.unwrap_or_default().0,
    };
    Placement::translate(row.a.0, 0.0, d).then(&Placement::rotate(X, row.alpha.0))
}

fn add_tool(description: &mut Description, dh: Dh, robot: &RobotToml, tail: &Placement) {
    let stated = robot.tool.as_ref().map(|t| {
        let t = t.get_ref();
        Placement::from_xyz_rpy(t.xyz.map(|x| x.0), t.rpy.map(|x| x.0))
    });
    if dh == Dh::Modified && stated.is_none() {
        return;
    }
    let Some(last) = description.links.last().map(|l| l.name.clone()) else { return };
    description.links.push(LinkDescription { name: "tool".to_owned(), inertia: None });
    description.joints.push(JointDescription {
        name: "tool".to_owned(),
        parent: last,
        child: "tool".to_owned(),
        kind: JointKind::Fixed,
        placement: stated.map_or(*tail, |t| tail.then(&t)),
        axis: Z,
        limits: Limits::default(),
        mimic: None,
    });
}

pub(super) fn limits(
    source: &Source<'_>,
    offset: usize,
    owner: &str,
    stated: &LimitsToml,
) -> Result<Limits, RobotFileError> {
    let position = stated.position.map(|[low, high]| (low.0, high.0));
    let velocity = stated.velocity.map(|x| x.0);
    let effort = stated.effort.map(|x| x.0);
    if let Some((low, high)) = position.filter(|(low, high)| low > high) {
        let found = format!("{low}, {high}");
        return Err(source.value(offset, owner, "limits.position", "lower <= upper", &found));
    }
    for (field, value) in [("limits.velocity", velocity), ("limits.effort", effort)] {
        if let Some(x) = value.filter(|x| *x < LEAST_LIMIT) {
            let expected = format!("a positive number, at least {LEAST_LIMIT:e}");
            return Err(source.value(offset, owner, field, &expected, &x.to_string()));
        }
    }
    Ok(Limits { position, velocity, effort })
}
