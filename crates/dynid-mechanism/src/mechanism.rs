//! The compiled kinematic tree.

mod build;
mod clearance;
mod fault;

pub use clearance::{JournalPath, translation_names};
pub use fault::{MechanismError, MechanismWarning};

use crate::description::{JointKind, Limits, Mimic};
use crate::dynamics::MotionBlock;
use dynid_algebra::inertia::Inertia;
use dynid_algebra::spatial::{Placement, Vec3};

/// Largest number of moving joints of one mechanism. Regressors grow with joints times depth; beyond this a file is
/// more likely broken than a robot.
pub const MAX_MOVING_JOINTS: usize = 1000;

/// Name of the joint that a floating base adds between the world and the root link.
pub const ROOT_JOINT: &str = "root_joint";

/// A link that is welded to a moving link.
#[derive(Debug, Clone, PartialEq)]
pub struct FixedLink {
    /// Link name.
    pub name: String,
    /// Frame of the link in the frame of the body.
    pub placement: Placement,
    /// Inertia in its own frame as stated by the file.
    pub inertia: Option<Inertia>,
}

/// A frame of the robot: of a link, moving or fixed to another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// The body that carries it; `None`: the base.
    pub body: Option<usize>,
    /// Where it is in the frame of the body, or in base axes.
    pub placement: Placement,
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
    /// Links fixed to the ground, the root link first.
    ground_links: Vec<FixedLink>,
    bodies: Vec<Body>,
    sweep: Vec<usize>,
    /// One entry per joint rate if mimic joints are coupled.
    follows: Option<Vec<Follow>>,
    warnings: Vec<MechanismWarning>,
}

impl Mechanism {
    /// A mechanism in which nothing moves, for a model of coordinates without bodies alone.
    pub fn without_bodies(name: impl Into<String>) -> Self {
        Mechanism {
            name: name.into(),
            gravity: Vec3(crate::description::STANDARD_GRAVITY),
            base_link: "base".into(),
            ground_links: Vec::new(),
            bodies: Vec::new(),
            sweep: Vec::new(),
            follows: None,
            warnings: Vec::new(),
        }
    }

    /// Name of the robot.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Acceleration of gravity in base axes, m/s².
    pub fn gravity(&self) -> Vec3<f64> {
        self.gravity
    }

    /// Returns the mechanism under another gravity (m/s², base axes).
    #[must_use]
    pub fn with_gravity(mut self, gravity: [f64; 3]) -> Self {
        self.gravity = Vec3(gravity);
        self
    }

    /// Returns the mechanism with other body inertias, in body order.
    ///
    /// # Panics
    /// If there is not one inertia per body.
    #[must_use]
    pub fn with_inertias(mut self, inertias: &[Inertia]) -> Self {
        assert_eq!(inertias.len(), self.bodies.len(), "one inertia per body");
        for (body, inertia) in self.bodies.iter_mut().zip(inertias) {
            body.inertia = *inertia;
        }
        self
    }

    /// The trees that hang on the ground one by one, each with the independent rates of this mechanism that it moves: on a fixed base
    /// none feels another. A mechanism whose mimic joints are coupled is one.
    pub fn chains(&self) -> Vec<(Mechanism, Vec<usize>)> {
        if self.follows.is_some() {
            return vec![(self.clone(), (0..self.rates()).collect())];
        }
        let mut root: Vec<usize> = (0..self.bodies.len()).collect();
        for &b in &self.sweep {
            root[b] = self.bodies[b].parent.map_or(b, |p| root[p]);
        }
        let roots = (0..self.bodies.len()).filter(|b| self.bodies[*b].parent.is_none());
        roots.map(|r| self.part(|b| root[b] == r)).collect()
    }

    /// The bodies of a choice that is closed under parents, with the rates of this mechanism that they have.
    fn part(&self, chosen: impl Fn(usize) -> bool) -> (Mechanism, Vec<usize>) {
        let mut place = vec![usize::MAX; self.bodies.len()];
        let (mut bodies, mut rates, mut position) = (Vec::new(), Vec::new(), 0);
        for (b, body) in self.bodies.iter().enumerate().filter(|(b, _)| chosen(*b)) {
            place[b] = bodies.len();
            bodies.push(Body { position, rate: rates.len(), ..body.clone() });
            position += body.joint.positions();
            rates.extend(body.rate..body.rate + body.joint.rates());
        }
        for body in &mut bodies {
            body.parent = body.parent.map(|p| place[p]);
        }
        let sweep = self.sweep.iter().filter(|b| chosen(**b)).map(|b| place[*b]).collect();
        (Mechanism { bodies, sweep, ..self.clone() }, rates)
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

    /// Frame of the link with this name: a moving link, one that is fixed to it, or one that is fixed to the ground.
    pub fn frame(&self, link: &str) -> Result<Frame, MechanismError> {
        let named = |body, l: &FixedLink| (l.name.clone(), Frame { body, placement: l.placement });
        let mut all: Vec<(String, Frame)> = self.ground_links.iter().map(|l| named(None, l)).collect();
        for (b, body) in self.bodies.iter().enumerate() {
            all.push((body.name.clone(), Frame { body: Some(b), placement: Placement::identity() }));
            all.extend(body.fixed_links.iter().map(|l| named(Some(b), l)));
        }
        match all.iter().find(|(name, _)| name == link) {
            Some((_, frame)) => Ok(*frame),
            None => Err(MechanismError::UnknownLink {
                name: link.to_owned(),
                known: all.into_iter().map(|(name, _)| name).collect(),
            }),
        }
    }

    /// Standard inertial parameters of the file, ten per body in body order.
    pub fn inertia_vector(&self) -> Vec<f64> {
        self.bodies.iter().flat_map(|b| b.inertia.0).collect()
    }

    /// Joint positions, rates and accelerations of a block of coupled coordinates, packed without gaps.
    pub fn expand_block(&self, motion: &MotionBlock<'_>) -> [Vec<f64>; 3] {
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
    pub fn quaternions_before(&self, coordinate: usize) -> usize {
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

/// Rates of the joints between a body and the base, the body's own first.
pub fn ancestor_rates(mechanism: &Mechanism, body: usize) -> Vec<usize> {
    let mut rates = Vec::new();
    let mut next = Some(body);
    while let Some(b) = next {
        let body: &Body = &mechanism.bodies()[b];
        rates.extend(body.rate..body.rate + body.joint.rates());
        next = body.parent;
    }
    rates
}
