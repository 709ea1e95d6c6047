//! The compiled kinematic tree.

use std::collections::HashMap;

use thiserror::Error;

use crate::description::{Description, JointDescription, JointKind, Limits, Mimic};
use crate::dynamics::MotionBlock;
use crate::inertia::Inertia;
use crate::spatial::{Placement, Vec3};

/// Largest number of moving joints of one mechanism. Regressors grow with joints times depth; beyond this a file is
/// more likely broken than a robot.
pub const MAX_MOVING_JOINTS: usize = 1000;

/// Name of the joint that a floating base adds between the world and the root link.
pub const ROOT_JOINT: &str = "root_joint";

/// A structural fault of a description.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum MechanismError {
    /// No link at all.
    #[error("robot `{robot}` has no links")]
    Empty {
        /// Robot name.
        robot: String,
    },
    /// No joint moves.
    #[error("robot `{robot}` has no moving joint")]
    NothingMoves {
        /// Robot name.
        robot: String,
    },
    /// A name is used twice.
    #[error("{what} name `{name}` is used more than once")]
    Duplicate {
        /// "link" or "joint".
        what: &'static str,
        /// The name.
        name: String,
    },
    /// A joint names a link that does not exist.
    #[error("joint `{joint}`: {role} link `{link}` does not exist")]
    MissingLink {
        /// Joint.
        joint: String,
        /// "parent" or "child".
        role: &'static str,
        /// The missing link.
        link: String,
    },
    /// A link is the child of two joints.
    #[error("link `{link}` is the child of two joints, `{first}` and `{second}`")]
    TwoParents {
        /// Link.
        link: String,
        /// First joint.
        first: String,
        /// Second joint.
        second: String,
    },
    /// More than one link has no parent.
    #[error("the robot has {count} root links (links that are no joint's child), expected one: `{first}`, `{second}`{}", if *count > 2 { ", ..." } else { "" })]
    ManyRoots {
        /// Number of roots.
        count: usize,
        /// First root.
        first: String,
        /// Second root.
        second: String,
    },
    /// Joints form a circle.
    #[error("joints form a cycle through link `{link}`")]
    Cycle {
        /// A link on the cycle.
        link: String,
    },
    /// The axis of a joint is zero.
    #[error("joint `{joint}`: axis is (0, 0, 0), expected a direction")]
    ZeroAxis {
        /// Joint.
        joint: String,
    },
    /// A number is NaN or infinite.
    #[error("{what} of `{name}` is not finite")]
    NotFinite {
        /// Which quantity.
        what: &'static str,
        /// Of which link or joint.
        name: String,
    },
    /// A mimic joint follows a joint that does not exist, does not move, or follows in turn without end.
    #[error("joint `{joint}` mimics `{of}`, {fault}")]
    Mimic {
        /// The mimic joint.
        joint: String,
        /// The leader.
        of: String,
        /// What is wrong.
        fault: &'static str,
    },
    /// More moving joints than [`MAX_MOVING_JOINTS`].
    #[error("the robot has {found} moving joints, at most {MAX_MOVING_JOINTS} are supported")]
    TooManyJoints {
        /// Number found.
        found: usize,
    },
    /// A joint that was asked for does not exist or does not move.
    #[error("no moving joint is named `{name}` (joints: {})", known.join(", "))]
    UnknownJoint {
        /// The name asked for.
        name: String,
        /// Names that exist.
        known: Vec<String>,
    },
}

/// An oddity of a robot file that does not keep it from being used.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum MechanismWarning {
    /// No mass distribution could have the stated inertia.
    #[error("body `{body}` {fault}: its stated inertia is used as a starting value only")]
    NotPhysical {
        /// Name of the moving link.
        body: String,
        /// What is wrong with it.
        fault: &'static str,
    },
    /// A moving link and all that is fixed to it state no inertia.
    #[error(
        "body `{body}` states no inertia: its parameters are unknown, taken as zero where a value is needed"
    )]
    NotStated {
        /// Name of the moving link.
        body: String,
    },
    /// A mimic joint is treated as a coordinate of its own.
    #[error(
        "joint `{joint}` mimics `{of}` in the file; it is treated as independent (ask for coupled mimic joints to change this)"
    )]
    MimicIndependent {
        /// The mimic joint.
        joint: String,
        /// Its leader.
        of: String,
    },
    /// A joint was locked because nothing moves it.
    #[error("joint `{joint}` is held at {position}")]
    Locked {
        /// Joint.
        joint: String,
        /// Held position, rad or m.
        position: f64,
    },
}

/// A link that is welded to a moving link.
#[derive(Debug, Clone, PartialEq)]
pub struct FixedLink {
    /// Link name.
    pub name: String,
    /// Its frame in the frame of the body.
    pub placement: Placement,
    /// Inertia in its own frame as stated by the file.
    pub inertia: Option<Inertia>,
}

/// A moving joint.
#[derive(Debug, Clone, PartialEq)]
pub struct Joint {
    /// Name.
    pub name: String,
    /// Kind; never [`JointKind::Fixed`].
    pub kind: JointKind,
    /// Frame of the joint in the parent body at position zero.
    pub placement: Placement,
    /// Unit axis in the joint frame.
    pub axis: Vec3<f64>,
    /// Limits.
    pub limits: Limits,
    /// The joint that this one follows in the file.
    pub mimic: Option<Mimic>,
}

impl Joint {
    /// Number of entries in the position vector: 1, or 7 for a floating joint.
    pub fn positions(&self) -> usize {
        if self.kind == JointKind::Floating { 7 } else { 1 }
    }

    /// Number of rates: 1, or 6 for a floating joint.
    pub fn rates(&self) -> usize {
        if self.kind == JointKind::Floating { 6 } else { 1 }
    }

    /// Unit of effort: `N m` for joints that turn, `N` for joints that slide.
    pub fn effort_unit(&self) -> &'static str {
        if self.kind == JointKind::Prismatic { "N" } else { "N m" }
    }
}

/// A moving link together with the links welded to it.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// Name of the moving link.
    pub name: String,
    /// The joint that moves it. The joint frame is the frame of the link and of `inertia`.
    pub joint: Joint,
    /// The body it hangs on; `None` for the fixed base.
    pub parent: Option<usize>,
    /// Standard parameters of link and welded links together, about the joint frame; zero where nothing is stated.
    pub inertia: Inertia,
    /// True if any of the merged links states an inertia.
    pub stated: bool,
    /// Links welded to it, in file order.
    pub fixed_links: Vec<FixedLink>,
    /// First entry in the joint position vector.
    pub position: usize,
    /// First entry in the joint rate vector.
    pub rate: usize,
}

/// Where the position of a joint comes from: `joint = ratio · coordinate + offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Follow {
    /// Index of the independent coordinate.
    pub coordinate: usize,
    /// Factor.
    pub ratio: f64,
    /// Offset, rad or m.
    pub offset: f64,
}

/// A kinematic tree of moving bodies, checked and ready for the recursions.
///
/// Bodies, joints and coordinates are in the order of the robot file; `sweep` gives an order with parents first.
/// Ground has no index. Fixed joints are merged away; what is fixed to the ground does not appear.
#[derive(Debug, Clone, PartialEq)]
pub struct Mechanism {
    name: String,
    gravity: Vec3<f64>,
    base_link: String,
    bodies: Vec<Body>,
    sweep: Vec<usize>,
    /// One entry per joint rate if mimic joints are coupled.
    follows: Option<Vec<Follow>>,
    warnings: Vec<MechanismWarning>,
}

impl Mechanism {
    /// Name of the robot.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Acceleration of gravity in base axes, m/s².
    pub fn gravity(&self) -> Vec3<f64> {
        self.gravity
    }

    /// The same mechanism under another gravity (m/s², base axes).
    pub fn with_gravity(mut self, gravity: [f64; 3]) -> Self {
        self.gravity = Vec3(gravity);
        self
    }

    /// The same mechanism with other body inertias, in body order.
    ///
    /// # Panics
    /// If there is not one inertia per body.
    pub fn with_inertias(mut self, inertias: &[Inertia]) -> Self {
        assert_eq!(inertias.len(), self.bodies.len(), "one inertia per body");
        for (body, inertia) in self.bodies.iter_mut().zip(inertias) {
            body.inertia = *inertia;
        }
        self
    }

    /// Name of the root link of the file.
    pub fn base_link(&self) -> &str {
        &self.base_link
    }

    /// Moving bodies in file order of their joints.
    pub fn bodies(&self) -> &[Body] {
        &self.bodies
    }

    /// Indices of bodies, parents before children.
    pub fn sweep(&self) -> &[usize] {
        &self.sweep
    }

    /// Oddities found while building.
    pub fn warnings(&self) -> &[MechanismWarning] {
        &self.warnings
    }

    /// How joints follow coordinates, one entry per joint rate; `None` if every joint is a coordinate of its own.
    pub fn follows(&self) -> Option<&[Follow]> {
        self.follows.as_deref()
    }

    /// Length of the joint position vector (7 for a floating joint, 1 for others).
    pub fn joint_positions(&self) -> usize {
        self.bodies.iter().map(|b| b.joint.positions()).sum()
    }

    /// Length of the joint rate vector (6 for a floating joint, 1 for others).
    pub fn joint_rates(&self) -> usize {
        self.bodies.iter().map(|b| b.joint.rates()).sum()
    }

    /// Length of the position vector of the independent coordinates.
    pub fn positions(&self) -> usize {
        match &self.follows {
            None => self.joint_positions(),
            Some(f) => self.joint_positions() - (f.len() - self.rates()),
        }
    }

    /// Number of independent rates, which is the number of efforts.
    pub fn rates(&self) -> usize {
        match &self.follows {
            None => self.joint_rates(),
            Some(f) => f.iter().map(|f| f.coordinate + 1).max().unwrap_or(0),
        }
    }

    /// Number of standard inertial parameters, ten per body.
    pub fn inertial_parameters(&self) -> usize {
        10 * self.bodies.len()
    }

    /// Names of the independent coordinates, one per rate: the joint's name, or for a floating joint the name followed
    /// by `.vx .vy .vz .wx .wy .wz`.
    pub fn rate_names(&self) -> Vec<String> {
        self.names(|joint, k| {
            if joint.rates() == 1 {
                joint.name.clone()
            } else {
                format!("{}.{}", joint.name, ["vx", "vy", "vz", "wx", "wy", "wz"][k])
            }
        })
    }

    /// Unit of the effort of every rate.
    pub fn effort_units(&self) -> Vec<&'static str> {
        self.names(|joint, k| if joint.rates() == 6 && k < 3 { "N" } else { joint.effort_unit() })
    }

    /// The body that owns each independent rate.
    pub fn rate_bodies(&self) -> Vec<usize> {
        let mut owners = vec![0; self.rates()];
        for (b, body) in self.bodies.iter().enumerate() {
            for k in 0..body.joint.rates() {
                let rate = body.rate + k;
                match &self.follows {
                    None => owners[rate] = b,
                    Some(f) if body.joint.mimic.is_none() => {
                        owners[f[rate].coordinate] = b;
                    }
                    Some(_) => {}
                }
            }
        }
        owners
    }

    fn names<T>(&self, name: impl Fn(&Joint, usize) -> T) -> Vec<T> {
        let mut out = Vec::with_capacity(self.rates());
        for body in &self.bodies {
            if self.follows.is_some() && body.joint.mimic.is_some() {
                continue;
            }
            out.extend((0..body.joint.rates()).map(|k| name(&body.joint, k)));
        }
        out
    }

    /// Index of the body moved by the joint with this name.
    pub fn joint_index(&self, name: &str) -> Result<usize, MechanismError> {
        self.bodies.iter().position(|b| b.joint.name == name).ok_or_else(|| MechanismError::UnknownJoint {
            name: name.to_owned(),
            known: self.bodies.iter().map(|b| b.joint.name.clone()).collect(),
        })
    }

    /// Standard inertial parameters of the file, ten per body in body order.
    pub fn inertia_vector(&self) -> Vec<f64> {
        self.bodies.iter().flat_map(|b| b.inertia.0).collect()
    }

    /// Joint positions, rates and accelerations of a block of coupled coordinates, packed without gaps.
    pub(crate) fn expand_block(&self, motion: &MotionBlock<'_>) -> [Vec<f64>; 3] {
        let n = motion.samples;
        let mut q = vec![0.0; self.joint_positions() * n];
        let mut dq = vec![0.0; self.joint_rates() * n];
        let mut ddq = vec![0.0; self.joint_rates() * n];
        let own = |rate| Follow { coordinate: rate, ratio: 1.0, offset: 0.0 };
        let scale = |to: &mut [f64], from: &[f64], f: &Follow, offset: f64| {
            for (t, x) in to.iter_mut().zip(from) {
                *t = f.ratio * x + offset;
            }
        };
        for body in &self.bodies {
            for rate in body.rate..body.rate + body.joint.rates() {
                let f = self.follows.as_ref().map_or_else(|| own(rate), |f| f[rate]);
                scale(&mut dq[rate * n..][..n], motion.rate(f.coordinate), &f, 0.0);
                scale(&mut ddq[rate * n..][..n], motion.acceleration(f.coordinate), &f, 0.0);
            }
            let f = self.follows.as_ref().map_or_else(|| own(body.rate), |f| f[body.rate]);
            let from = f.coordinate + self.quaternions_before(f.coordinate);
            for k in 0..body.joint.positions() {
                scale(&mut q[(body.position + k) * n..][..n], motion.position(from + k), &f, f.offset);
            }
        }
        [q, dq, ddq]
    }

    /// Number of floating joints whose coordinates come before this one: each has a position entry more than rates.
    pub(crate) fn quaternions_before(&self, coordinate: usize) -> usize {
        self.bodies
            .iter()
            .filter(|b| b.joint.kind == JointKind::Floating)
            .filter(|b| self.follows.as_ref().map_or(b.rate, |f| f[b.rate].coordinate) < coordinate)
            .count()
    }

    /// Mean distance between consecutive joints, m; 1 if all joints share one point. Length scale `L_c` of the robot.
    pub fn characteristic_length(&self) -> f64 {
        let lengths: Vec<f64> = self
            .bodies
            .iter()
            .filter(|b| b.parent.is_some())
            .map(|b| b.joint.placement.translation.norm())
            .filter(|d| *d > 0.0)
            .collect();
        if lengths.is_empty() { 1.0 } else { lengths.iter().sum::<f64>() / lengths.len() as f64 }
    }
}

impl Description {
    /// Holds joints at fixed positions (rad or m): they become fixed joints and their links are merged.
    ///
    /// Fails if a name is not that of a moving joint with one coordinate.
    pub fn lock(&mut self, joints: &[(String, f64)]) -> Result<(), MechanismError> {
        for (name, position) in joints {
            let known = || {
                self.joints.iter().filter(|j| j.kind != JointKind::Fixed).map(|j| j.name.clone()).collect()
            };
            let found = self
                .joints
                .iter()
                .position(|j| j.name == *name && !matches!(j.kind, JointKind::Fixed | JointKind::Floating));
            let Some(index) = found else {
                return Err(MechanismError::UnknownJoint { name: name.clone(), known: known() });
            };
            let joint = &mut self.joints[index];
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

fn unit_axis(joint: &JointDescription) -> Result<Vec3<f64>, MechanismError> {
    let axis = Vec3(joint.axis);
    if !axis.0.iter().all(|x| x.is_finite()) {
        return Err(MechanismError::NotFinite { what: "axis", name: joint.name.clone() });
    }
    let largest = axis.0.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    if largest == 0.0 {
        return Err(MechanismError::ZeroAxis { joint: joint.name.clone() });
    }
    let scaled = axis.scale(1.0 / largest);
    Ok(scaled.scale(1.0 / scaled.norm()))
}

fn check_names_and_numbers(d: &Description) -> Result<HashMap<&str, usize>, MechanismError> {
    if d.links.is_empty() {
        return Err(MechanismError::Empty { robot: d.name.clone() });
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
    let mut stack = vec![(root, d.floating_base.then_some(0), Placement::identity())];
    if d.floating_base {
        sweep.push(0);
    }
    while let Some((link, body, placement)) = stack.pop() {
        reached[link] = true;
        let stated = &d.links[link];
        if let Some(b) = body {
            let owner = &mut bodies[b];
            if let Some(inertia) = &stated.inertia {
                owner.inertia = owner.inertia.plus(&inertia.in_frame(&placement));
                owner.stated = true;
            }
            if stated.name != owner.name {
                owner.fixed_links.push(FixedLink {
                    name: stated.name.clone(),
                    placement,
                    inertia: stated.inertia,
                });
            }
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
