//! How identified bodies are given back to links.

use std::collections::HashMap;

use dynid_model::{Description, Inertia, JointDescription, JointKind, Mechanism, Vec3};

use super::error::LinkFault;

/// Inertias of links, and what is to be said about them.
pub(crate) struct Shares {
    /// Links whose inertia changes.
    pub(crate) links: Vec<(String, Inertia)>,
    /// Links that no body could be.
    pub(crate) faults: Vec<LinkFault>,
    /// In words.
    pub(crate) notes: Vec<String>,
}

/// Shares every identified body out to the links that it is made of.
///
/// `mechanism`: the robot file with held joints fixed; `description`: the same; `held`: names of the held joints;
/// `inertias`: the identified inertia of every body of `mechanism`.
///
/// Links on fixed joints keep the inertia of the robot file and the moving link gets the rest, if that is a possible
/// body. Else the moving link carries everything and they state no mass; links behind held joints keep theirs all the
/// same, since the exported robot moves them.
pub(crate) fn share(
    mechanism: &Mechanism,
    description: &Description,
    held: &[(String, f64)],
    inertias: &[Inertia],
) -> Shares {
    let above: HashMap<&str, &JointDescription> =
        description.joints.iter().map(|j| (j.child.as_str(), j)).collect();
    let is_held = |joint: &str| held.iter().any(|(name, _)| name == joint);
    let mut out = Shares { links: Vec::new(), faults: Vec::new(), notes: Vec::new() };
    for (body, identified) in mechanism.bodies().iter().zip(inertias) {
        let behind_held = |link: &str| {
            let mut link = link;
            while link != body.name
                && let Some(joint) = above.get(link)
            {
                if is_held(&joint.name) {
                    return true;
                }
                link = &joint.parent;
            }
            false
        };
        let stated: Vec<(&str, Inertia, Inertia)> = body
            .fixed_links
            .iter()
            .filter_map(|f| Some((f.name.as_str(), f.inertia?, f.inertia?.in_frame(&f.placement))))
            .filter(|(_, own, _)| *own != Inertia::default())
            .collect();
        let rest = |without: &dyn Fn(&str) -> bool| {
            stated.iter().filter(|(name, ..)| without(name)).fold(*identified, |sum, (.., i)| minus(&sum, i))
        };
        let possible = |i: &Inertia| i.physical_fault().is_none();
        let all_kept = rest(&|_| true);
        let (own, kept) = if stated.iter().all(|(_, own, _)| possible(own)) && possible(&all_kept) {
            (all_kept, true)
        } else {
            (rest(&behind_held), false)
        };
        let (behind, welded): (Vec<_>, Vec<_>) = stated.iter().partition(|(name, ..)| behind_held(name));
        if let Some(fault) = own.physical_fault() {
            let less = if behind.is_empty() {
                String::new()
            } else {
                format!(" (less {}, behind joints that were held)", names(&behind))
            };
            out.faults.push(LinkFault { link: body.name.clone(), fault: format!("{fault}{less}") });
        }
        if kept && !stated.is_empty() {
            out.notes.push(format!(
                "{} keep{} the inertia of the robot file; link `{}`, which they move with, gets the rest of what was identified",
                names(&stated.iter().collect::<Vec<_>>()),
                if stated.len() == 1 { "s" } else { "" },
                body.name
            ));
        } else if !welded.is_empty() {
            out.notes.push(format!(
                "link `{}` carries the whole identified body and {} no mass any more: less what the robot file states of them, it would be impossible",
                body.name,
                if welded.len() == 1 { format!("{} states", names(&welded)) } else { format!("{} state", names(&welded)) },
            ));
        }
        out.links.push((body.name.clone(), own));
        if !kept {
            out.links.extend(welded.iter().map(|(name, ..)| ((*name).to_owned(), Inertia::default())));
        }
    }
    out
}

fn names(links: &[&(&str, Inertia, Inertia)]) -> String {
    let list: Vec<String> = links.iter().map(|(name, ..)| format!("`{name}`")).collect();
    format!("link{} {}", if list.len() == 1 { "" } else { "s" }, list.join(", "))
}

fn minus(a: &Inertia, b: &Inertia) -> Inertia {
    Inertia(std::array::from_fn(|k| a.0[k] - b.0[k]))
}

/// Position at which a joint of the robot file has been held: its motion from the file's placement to the recorded one.
pub(crate) fn held_position(joint: &JointDescription, recorded: &JointDescription) -> f64 {
    let motion = joint.placement.inverse().then(&recorded.placement);
    let norm = Vec3(joint.axis).norm();
    let axis = Vec3(joint.axis).scale(1.0 / norm);
    if joint.kind == JointKind::Prismatic {
        return axis.dot(motion.translation);
    }
    let r = motion.rotation.rows();
    let twice_sine = Vec3([r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]]);
    let twice_cosine = r[0][0] + r[1][1] + r[2][2] - 1.0;
    axis.dot(twice_sine).atan2(twice_cosine)
}
