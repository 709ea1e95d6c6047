//! Numbered columns on robots whose joints have no one order.

use dynid_model::{JointKind, Mechanism};

use crate::finding::{FindingId, Findings, Severity};
use crate::log::LogSource;

/// Warns where columns go to joints by number alone and a log cannot tell another order: branches that are alike fit each other's columns,
/// and file order, depth first (children by name) and alphabetical order number the joints of a branched robot differently.
pub(super) fn examine(mechanism: &Mechanism, source: &LogSource, out: &mut Findings<'_>) {
    let Some(mapping) = source.mapping.as_ref().filter(|_| source.by_number) else { return };
    let pairs = mapping.joints.iter().zip(&mapping.position);
    let numbered: Vec<(&str, &str)> = pairs
        .filter_map(|(joint, column)| Some((joint.as_str(), column.as_ref()?.name.as_str())))
        .filter(|(joint, column)| !column.to_lowercase().contains(&joint.to_lowercase()))
        .collect();
    let Some(doubt) = doubt(mechanism).filter(|_| numbered.len() > 1) else { return };
    let list = |form: &dyn Fn(&str, &str) -> String| {
        numbered.iter().map(|(joint, column)| form(joint, column)).collect::<Vec<_>>().join(", ")
    };
    let evidence = format!(
        "{doubt}, so that no log tells whose a numbered column is; taken in the order of the robot file: {}",
        list(&|joint, column| format!("{column} = {joint}"))
    );
    let remedy = format!(
        "compare the list with the program that wrote the log, then state it by names: `[columns] position = {{ {} }}`, velocity and effort alike",
        list(&|joint, column| format!("\"{joint}\" = \"{column}\""))
    );
    out.add(FindingId::ColumnOrder, Severity::Warning, None, evidence, &remedy);
}

/// Why the order of a robot's joints is open, in words; `None` for one chain.
fn doubt(mechanism: &Mechanism) -> Option<String> {
    let bodies = mechanism.bodies();
    let children = |parent: Option<usize>| -> Vec<usize> {
        (0..bodies.len()).filter(|b| bodies[*b].parent == parent).collect()
    };
    let parents = std::iter::once(None).chain((0..bodies.len()).map(Some));
    for siblings in parents.map(children).filter(|c| c.len() > 1) {
        for (k, a) in siblings.iter().enumerate() {
            if let Some(b) = siblings[k + 1..].iter().find(|b| kinds(mechanism, *a) == kinds(mechanism, **b))
            {
                let [a, b] = [*a, *b].map(|s| &bodies[s].joint.name);
                return Some(format!("the branches that begin with `{a}` and `{b}` are alike"));
            }
        }
    }
    let file: Vec<usize> = (0..bodies.len()).collect();
    let branched = (0..bodies.len()).any(|b| children(Some(b)).len() > 1) || children(None).len() > 1;
    let orders = [
        ("depth first, children by name", depth_first(mechanism)),
        ("alphabetical", alphabetical(mechanism)),
    ];
    let other = orders.into_iter().find(|(_, order)| branched && *order != file)?;
    Some(format!("the robot has branches, and its joints are in another order {}", other.0))
}

/// Kinds of the joints of a branch, depth first in file order: what tells two branches apart.
fn kinds(mechanism: &Mechanism, root: usize) -> Vec<JointKind> {
    let bodies = mechanism.bodies();
    let mut out = vec![bodies[root].joint.kind];
    for child in (0..bodies.len()).filter(|b| bodies[*b].parent == Some(root)) {
        out.extend(kinds(mechanism, child));
    }
    out
}

fn depth_first(mechanism: &Mechanism) -> Vec<usize> {
    let bodies = mechanism.bodies();
    let mut out = Vec::new();
    let mut open: Vec<Option<usize>> = vec![None];
    while let Some(at) = open.pop() {
        out.extend(at);
        let mut children: Vec<usize> = (0..bodies.len()).filter(|b| bodies[*b].parent == at).collect();
        children.sort_by(|a, b| bodies[*b].joint.name.cmp(&bodies[*a].joint.name));
        open.extend(children.into_iter().map(Some));
    }
    out
}

fn alphabetical(mechanism: &Mechanism) -> Vec<usize> {
    let mut out: Vec<usize> = (0..mechanism.bodies().len()).collect();
    out.sort_by(|a, b| mechanism.bodies()[*a].joint.name.cmp(&mechanism.bodies()[*b].joint.name));
    out
}
