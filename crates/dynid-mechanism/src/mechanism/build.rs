//! From a description to a mechanism: structure checked, fixed joints merged, mimic joints resolved.

use std::collections::HashMap;

use super::{
    Body, FixedLink, Follow, Joint, MAX_MOVING_JOINTS, Mechanism, MechanismError, MechanismWarning,
    ROOT_JOINT,
};
use crate::description::{Description, JointDescription, JointKind, Limits};
use dynid_algebra::inertia::Inertia;
use dynid_algebra::spatial::{Placement, Vec3};

impl Description {
    /// Holds joints at fixed positions (rad or m): they become fixed joints and their links are merged. A floating joint is held where
    /// the file puts it, by position 0.
    ///
    /// Fails if a name is not that of a moving joint, or a floating one is to be held elsewhere.
    pub fn lock(&mut self, joints: &[(String, f64)]) -> Result<(), MechanismError> {
        for (name, position) in joints {
            let known = || {
                self.joints.iter().filter(|j| j.kind != JointKind::Fixed).map(|j| j.name.clone()).collect()
            };
            let found = self
                .joints
                .iter()
                .position(|j| j.name == *name && j.kind != JointKind::Fixed)
                .filter(|j| self.joints[*j].kind != JointKind::Floating || *position == 0.0);
            let Some(index) = found else {
                return Err(MechanismError::UnknownJoint { name: name.clone(), known: known() });
            };
            let joint = &mut self.joints[index];
            if joint.kind == JointKind::Floating {
                joint.kind = JointKind::Fixed;
                continue;
            }
            let axis = unit_axis(joint)?;
            let moved = match joint.kind {
                JointKind::Prismatic => {
                    let t = axis.scale(*position);
                    Placement::translate(t.0[0], t.0[1], t.0[2])
                }
                JointKind::Helical { pitch } => Placement {
                    translation: axis.scale(pitch * position),
                    ..Placement::rotate(axis.0, *position)
                },
                _ => Placement::rotate(axis.0, *position),
            };
            joint.placement = joint.placement.then(&moved);
            joint.kind = JointKind::Fixed;
            joint.mimic = None;
        }
        Ok(())
    }

    /// Checks the structure and merges fixed joints.
    ///
    /// Errors: cycles, several roots, missing or doubly owned links, duplicate names, zero axes, numbers that are not
    /// finite, mimic joints without a leader, more than [`MAX_MOVING_JOINTS`] moving joints. Massless or non-physical
    /// links are warnings.
    pub fn build(&self) -> Result<Mechanism, MechanismError> {
        build(self)
    }
}

pub(super) fn unit_axis(joint: &JointDescription) -> Result<Vec3<f64>, MechanismError> {
    let axis = Vec3(joint.axis);
    if !axis.0.iter().all(|x| x.is_finite()) {
        return Err(MechanismError::NotFinite { what: "axis", name: joint.name.clone() });
    }
    let largest = axis.0.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    // Of the least numbers there is no quotient.
    if !largest.is_normal() {
        return Err(MechanismError::ZeroAxis { joint: joint.name.clone() });
    }
    let scaled = axis.scale(1.0 / largest);
    Ok(scaled.scale(1.0 / scaled.norm()))
}

fn check_names_and_numbers(d: &Description) -> Result<HashMap<&str, usize>, MechanismError> {
    if d.links.is_empty() {
        return Err(MechanismError::Empty { robot: d.name.clone() });
    }
    let links = d.links.iter().map(|l| ("link", &l.name));
    let joints = d.joints.iter().map(|j| ("joint", &j.name));
    let mut names = std::iter::once(("robot", &d.name)).chain(links).chain(joints);
    if let Some((what, name)) = names.find(|(_, name)| name.chars().any(char::is_control)) {
        return Err(MechanismError::ControlCharacter { what, name: name.clone() });
    }
    if !d.gravity.iter().all(|g| g.is_finite()) {
        return Err(MechanismError::NotFinite { what: "gravity", name: d.name.clone() });
    }
    let mut links = HashMap::with_capacity(d.links.len());
    for (k, link) in d.links.iter().enumerate() {
        if links.insert(link.name.as_str(), k).is_some() {
            return Err(MechanismError::Duplicate { what: "link", name: link.name.clone() });
        }
        if link.inertia.is_some_and(|i| !i.0.iter().all(|x| x.is_finite())) {
            return Err(MechanismError::NotFinite { what: "inertia", name: link.name.clone() });
        }
    }
    let mut joints = HashMap::with_capacity(d.joints.len());
    for joint in &d.joints {
        if joints.insert(joint.name.as_str(), ()).is_some() {
            return Err(MechanismError::Duplicate { what: "joint", name: joint.name.clone() });
        }
        if !joint.placement.is_finite() {
            return Err(MechanismError::NotFinite { what: "origin", name: joint.name.clone() });
        }
    }
    Ok(links)
}

/// For every link the joint that it is the child of; for every link its child joints in file order; the root.
struct Graph {
    children: Vec<Vec<usize>>,
    root: usize,
}

fn graph(d: &Description, links: &HashMap<&str, usize>) -> Result<Graph, MechanismError> {
    let mut parent_joint: Vec<Option<usize>> = vec![None; d.links.len()];
    let mut children: Vec<Vec<usize>> = vec![Vec::new(); d.links.len()];
    for (k, joint) in d.joints.iter().enumerate() {
        let find = |role, link: &String| {
            links.get(link.as_str()).copied().ok_or_else(|| MechanismError::MissingLink {
                joint: joint.name.clone(),
                role,
                link: link.clone(),
            })
        };
        let parent = find("parent", &joint.parent)?;
        let child = find("child", &joint.child)?;
        if let Some(first) = parent_joint[child] {
            return Err(MechanismError::TwoParents {
                link: joint.child.clone(),
                first: d.joints[first].name.clone(),
                second: joint.name.clone(),
            });
        }
        parent_joint[child] = Some(k);
        children[parent].push(k);
    }
    let roots: Vec<usize> = (0..d.links.len()).filter(|l| parent_joint[*l].is_none()).collect();
    match roots.as_slice() {
        [] => Err(MechanismError::Cycle { link: d.links[0].name.clone() }),
        [root] => Ok(Graph { children, root: *root }),
        [first, second, ..] => Err(MechanismError::ManyRoots {
            count: roots.len(),
            first: d.links[*first].name.clone(),
            second: d.links[*second].name.clone(),
        }),
    }
}

fn build(d: &Description) -> Result<Mechanism, MechanismError> {
    let links = check_names_and_numbers(d)?;
    let Graph { children, root } = graph(d, &links)?;
    let moving =
        d.joints.iter().filter(|j| j.kind != JointKind::Fixed).count() + usize::from(d.floating_base);
    if moving > MAX_MOVING_JOINTS {
        return Err(MechanismError::TooManyJoints { found: moving });
    }
    if moving == 0 {
        return Err(MechanismError::NothingMoves { robot: d.name.clone() });
    }

    // Bodies in file order; a floating base comes first.
    let mut bodies: Vec<Body> = Vec::with_capacity(moving);
    let mut body_of_joint: HashMap<usize, usize> = HashMap::with_capacity(moving);
    let (mut position, mut rate) = (0, 0);
    let mut add = |bodies: &mut Vec<Body>, name: &str, joint: Joint| {
        let body = Body {
            name: name.to_owned(),
            parent: None,
            inertia: Inertia::default(),
            stated: false,
            fixed_links: Vec::new(),
            position,
            rate,
            joint,
        };
        position += body.joint.positions();
        rate += body.joint.rates();
        bodies.push(body);
    };
    if d.floating_base {
        let joint = Joint {
            name: ROOT_JOINT.to_owned(),
            kind: JointKind::Floating,
            placement: Placement::identity(),
            axis: Vec3([0.0, 0.0, 1.0]),
            limits: Limits::default(),
            mimic: None,
        };
        add(&mut bodies, &d.links[root].name, joint);
    }
    for (k, joint) in d.joints.iter().enumerate() {
        if joint.kind == JointKind::Fixed {
            continue;
        }
        let axis = if joint.kind == JointKind::Floating { Vec3([0.0, 0.0, 1.0]) } else { unit_axis(joint)? };
        body_of_joint.insert(k, bodies.len());
        let compiled = Joint {
            name: joint.name.clone(),
            kind: joint.kind,
            placement: Placement::identity(),
            axis,
            limits: joint.limits,
            mimic: joint.mimic.clone(),
        };
        add(&mut bodies, &joint.child, compiled);
    }

    // Walk from the root without recursion: (link, body it belongs to, its frame in that body).
    let mut sweep = Vec::with_capacity(bodies.len());
    let mut reached = vec![false; d.links.len()];
    let mut ground_links = Vec::new();
    let mut stack = vec![(root, d.floating_base.then_some(0), Placement::identity())];
    if d.floating_base {
        sweep.push(0);
    }
    while let Some((link, body, placement)) = stack.pop() {
        reached[link] = true;
        let stated = &d.links[link];
        let welded = || FixedLink { name: stated.name.clone(), placement, inertia: stated.inertia };
        if let Some(b) = body {
            let owner = &mut bodies[b];
            if let Some(inertia) = &stated.inertia {
                owner.inertia = owner.inertia.plus(&inertia.in_frame(&placement));
                owner.stated = true;
            }
            if stated.name != owner.name {
                owner.fixed_links.push(welded());
            }
        } else {
            ground_links.push(welded());
        }
        for &k in children[link].iter().rev() {
            let joint = &d.joints[k];
            let child = links[joint.child.as_str()];
            let at = placement.then(&joint.placement);
            match body_of_joint.get(&k) {
                None => stack.push((child, body, at)),
                Some(&b) => {
                    bodies[b].parent = body;
                    bodies[b].joint.placement = at;
                    stack.push((child, Some(b), Placement::identity()));
                }
            }
        }
        if let Some(b) = body
            && stated.name == bodies[b].name
            && !(d.floating_base && b == 0)
        {
            sweep.push(b);
        }
    }
    if reached.contains(&false) {
        // Every link has one parent at most, so what the walk missed lies on or behind a cycle.
        let missed = reached.iter().position(|r| !r).unwrap_or(root);
        return Err(MechanismError::Cycle { link: d.links[missed].name.clone() });
    }

    let follows = if d.couple_mimics { couple(&bodies)? } else { None };
    let warnings = warnings(&bodies, d.couple_mimics);
    Ok(Mechanism {
        name: d.name.clone(),
        gravity: Vec3(d.gravity),
        base_link: d.links[root].name.clone(),
        ground_links,
        bodies,
        sweep,
        follows,
        warnings,
    })
}

fn warnings(bodies: &[Body], coupled: bool) -> Vec<MechanismWarning> {
    let mut out = Vec::new();
    for body in bodies {
        if !body.stated {
            out.push(MechanismWarning::NotStated { body: body.name.clone() });
        } else if let Some(fault) = body.inertia.physical_fault() {
            out.push(MechanismWarning::NotPhysical { body: body.name.clone(), fault });
        }
        if let Some(mimic) = &body.joint.mimic
            && !coupled
        {
            out.push(MechanismWarning::MimicIndependent {
                joint: body.joint.name.clone(),
                of: mimic.of.clone(),
            });
        }
    }
    out
}

/// Resolves chains of mimic joints to the leading coordinate.
fn couple(bodies: &[Body]) -> Result<Option<Vec<Follow>>, MechanismError> {
    if bodies.iter().all(|b| b.joint.mimic.is_none()) {
        return Ok(None);
    }
    let by_name: HashMap<&str, usize> =
        bodies.iter().enumerate().map(|(k, b)| (b.joint.name.as_str(), k)).collect();
    let mut coordinate = HashMap::new();
    let mut next = 0;
    for (k, body) in bodies.iter().enumerate() {
        if body.joint.mimic.is_none() {
            coordinate.insert(k, next);
            next += body.joint.rates();
        }
    }
    let mut follows = Vec::new();
    for (k, body) in bodies.iter().enumerate() {
        let (mut leader, mut ratio, mut offset) = (k, 1.0, 0.0);
        let mut steps = 0;
        while let Some(mimic) = &bodies[leader].joint.mimic {
            let fault =
                |fault| MechanismError::Mimic { joint: body.joint.name.clone(), of: mimic.of.clone(), fault };
            offset += ratio * mimic.offset;
            ratio *= mimic.ratio;
            leader = *by_name.get(mimic.of.as_str()).ok_or_else(|| fault("which is no moving joint"))?;
            steps += 1;
            if steps > bodies.len() {
                return Err(fault("which follows it in turn"));
            }
            if bodies[leader].joint.rates() != 1 || body.joint.rates() != 1 {
                return Err(fault("but only joints with one coordinate can follow"));
            }
        }
        if !(ratio.is_finite() && offset.is_finite()) {
            return Err(MechanismError::NotFinite {
                what: "mimic ratio or offset",
                name: body.joint.name.clone(),
            });
        }
        let first = coordinate[&leader];
        for r in 0..body.joint.rates() {
            follows.push(Follow { coordinate: first + r, ratio, offset });
        }
    }
    Ok(Some(follows))
}
