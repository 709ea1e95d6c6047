//! A point of a mechanism on a circle, and the joints that take it there.
//!
//! A carriage without mass slides along both axes of the circle's plane, and the point is closed onto it like a loop
//! ([`ClosedMechanism`]): the joints then follow from the carriage by the damped steps of Newton's method that close loops, and
//! their velocities and accelerations by the exact Jacobian of the closures. Trees and mechanisms with loops are the same to it.

use dynid_model::closed::{
    ClosedError, ClosedMechanism, ClosureDescription, Condition, CutKind, LinkFrame, NamedMotion, PoseError,
};
use dynid_model::dynamics::Dynamics;
use dynid_model::{
    Description, JointDescription, JointKind, Limits, LinkDescription, Mat3, Mechanism, MechanismError,
    Placement, Vec3,
};
use dynid_motion::trajectory::{Circle, Point, Profile, Sampled, Trajectory, TrajectoryError};
use thiserror::Error;

/// Where a point is to move.
#[derive(Debug, Clone, PartialEq)]
pub struct CircleSettings {
    /// Link that carries the point.
    pub link: String,
    /// The point in the frame of the link, m. Default: its origin.
    pub point: [f64; 3],
    /// Centre in base axes, m. Default: where the point is in the start pose.
    pub centre: Option<[f64; 3]>,
    /// Normal of the plane in base axes, of any length but zero; the point turns about it by the right hand. Default: z.
    pub normal: [f64; 3],
    /// Radius, m. No default.
    pub radius: f64,
    /// The link keeps the orientation of the start pose. Default true.
    pub hold_orientation: bool,
    /// Joints that stay where they are in the start pose. Default: none.
    pub hold: Vec<String>,
}

impl Default for CircleSettings {
    fn default() -> Self {
        CircleSettings {
            link: String::new(),
            point: [0.0; 3],
            centre: None,
            normal: [0.0, 0.0, 1.0],
            radius: f64::NAN,
            hold_orientation: true,
            hold: Vec::new(),
        }
    }
}

/// Why a point cannot move on a circle.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum TaskSpaceError {
    /// A link or joint that does not exist.
    #[error(transparent)]
    Mechanism(#[from] MechanismError),
    /// A number out of range.
    #[error("{name}: expected {expected}, found {found}")]
    Value {
        /// Name of the number.
        name: &'static str,
        /// What is accepted.
        expected: &'static str,
        /// What was given.
        found: f64,
    },
    /// The point cannot be moved in the plane from the start pose.
    #[error("the point cannot move in the plane of the circle from the start pose: {0}")]
    Start(ClosedError),
    /// The start pose is next to a singular one.
    #[error("the start pose is singular: with the point held, {motion} is free")]
    SingularStart {
        /// The motion that is free there.
        motion: NamedMotion,
    },
    /// More joints than the circle asks for, or fewer.
    #[error("expected just {expected} free motions, those of the point, found {found}")]
    Mobility {
        /// Coordinates of the carriage.
        expected: usize,
        /// Mobility.
        found: usize,
    },
    /// A point of the circle cannot be reached.
    #[error("the point cannot be taken to {:.4} {:.4} {:.4} m ({:.0} degrees on the circle): {fault}", at[0], at[1], at[2], angle.to_degrees())]
    Unreachable {
        /// The point in base axes, m.
        at: [f64; 3],
        /// Angle on the circle, rad.
        angle: f64,
        /// The fault.
        fault: PoseError,
    },
    /// A motion along the circle is refused.
    #[error(transparent)]
    Trajectory(#[from] TrajectoryError),
}

/// A mechanism whose point is held in the plane of a circle.
#[derive(Debug, Clone)]
pub struct PointCircle {
    machine: ClosedMechanism,
    /// Per coordinate: its rate and position, or where it is held.
    coordinates: Vec<Coordinate>,
    /// Axes of the plane and normal, centre, in base axes.
    plane: Placement,
    radius: f64,
    /// The carriage slides along the normal, too.
    off_plane: bool,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Coordinate {
    Moves { rate: usize, position: usize },
    Held(f64),
}

/// Names that no robot file has.
const CARRIAGE: [&str; 3] = [" carriage x", " carriage y", " carriage z"];
/// Largest distance of the start from the plane that counts as none, m.
const IN_PLANE: f64 = 1e-9;

impl PointCircle {
    /// Prepares a circle.
    ///
    /// `description`, `closures`: the mechanism. `coordinates`: joints whose motion is wanted. `start`: positions of all moving
    /// joints in the start pose, by name; loops are closed there.
    ///
    /// The plane has the axes `e_1` (x of the base without its part along the normal; y of the base where the normal is within
    /// 25° of x) and `e_2 = n × e_1`; the circle begins at `centre + radius e_1`.
    ///
    /// # Errors
    /// [`TaskSpaceError`]: unknown names, numbers out of range, a start pose next to a singular one, joints that the circle leaves
    /// free or that are too few for it.
    pub fn new(
        description: &Description,
        closures: &[ClosureDescription],
        coordinates: &[String],
        start: &[(String, Vec<f64>)],
        settings: &CircleSettings,
    ) -> Result<Self, TaskSpaceError> {
        check_numbers(settings)?;
        let mut description = description.clone();
        let held: Vec<(String, f64)> = (settings.hold.iter())
            .map(|joint| {
                let known = || start.iter().map(|(name, _)| name.clone()).collect();
                let at = start.iter().find(|(name, q)| name == joint && q.len() == 1);
                at.map(|(name, q)| (name.clone(), q[0]))
                    .ok_or_else(|| MechanismError::UnknownJoint { name: joint.clone(), known: known() })
            })
            .collect::<Result<_, _>>()?;
        description.lock(&held)?;
        let mut start: Vec<(String, Vec<f64>)> = start.to_vec();
        start.retain(|(name, _)| !settings.hold.contains(name));
        let mechanism = description.build()?;
        let tool = placed(&mechanism, &settings.link, &start)?;
        let at = tool.rotation.mul_vec(Vec3(settings.point)) + tool.translation;
        let plane = plane(settings, settings.centre.map_or(at, Vec3));
        let offset = plane.rotation.tr_mul_vec(at - plane.translation);
        let off_plane = offset.0[2].abs() > IN_PLANE;
        let slides = if off_plane { 3 } else { 2 };
        let carriage = add_carriage(&mut description, mechanism.base_link(), &plane, slides);
        let kind = if settings.hold_orientation { CutKind::Fixed } else { CutKind::Spherical };
        let relative = plane.rotation.transpose().mul_mat(&tool.rotation);
        let mut closures = closures.to_vec();
        closures.push(ClosureDescription {
            name: "point on its circle".to_owned(),
            condition: Condition::Joint {
                kind,
                a: LinkFrame {
                    link: CARRIAGE[slides - 1].to_owned(),
                    placement: Placement { rotation: relative, translation: Vec3([0.0; 3]) },
                },
                b: LinkFrame {
                    link: settings.link.clone(),
                    placement: Placement { translation: Vec3(settings.point), ..Placement::identity() },
                },
            },
        });
        start.extend(carriage.iter().cloned().zip(offset.0.map(|x| vec![x])));
        let machine = ClosedMechanism::new(description.build()?, closures, Some(&carriage), &start)
            .map_err(|fault| at_start(fault, slides))?;
        if machine.mobility() != slides {
            return Err(TaskSpaceError::Mobility { expected: slides, found: machine.mobility() });
        }
        let rates = machine.mechanism().rate_names();
        let coordinates = coordinates
            .iter()
            .map(|name| match (rates.iter().position(|r| r == name), held.iter().find(|(h, _)| h == name)) {
                (Some(rate), _) => Ok(Coordinate::Moves { rate, position: machine.position_of(rate) }),
                (None, Some((_, q))) => Ok(Coordinate::Held(*q)),
                (None, None) => {
                    Err(MechanismError::UnknownJoint { name: name.clone(), known: rates.clone() })
                }
            })
            .collect::<Result<_, _>>()?;
        Ok(PointCircle { machine, coordinates, plane, radius: settings.radius, off_plane })
    }

    /// Centre of the circle in base axes, m.
    pub fn centre(&self) -> [f64; 3] {
        self.plane.translation.0
    }

    /// Motion of the coordinates while the angle on the circle goes along `angle` (rad, 0 at the beginning of the circle), sampled at
    /// `rate_hz` from 0 to the end; the way from the start pose to the circle is sought but is no part of it.
    ///
    /// # Errors
    /// [`TaskSpaceError::Unreachable`] at the first point that is out of reach or next to a singular pose,
    /// [`TaskSpaceError::Trajectory`] for more samples than there may be.
    pub fn follow<P: Profile>(&self, angle: P, rate_hz: f64) -> Result<Sampled, TaskSpaceError> {
        let circle = Circle::new([0.0; 2], self.radius, angle)?;
        let path = Sampled::at_rate(&circle, rate_hz)?;
        let (n, samples) = (self.coordinates.len(), path.samples());
        let mut out = Sampled {
            q: vec![0.0; n * samples],
            dq: vec![0.0; n * samples],
            ddq: vec![0.0; n * samples],
            time: path.time,
        };
        let machine = &self.machine;
        let mut work = machine.workspace();
        let rates = machine.mechanism().rates();
        let (mut dq, mut ddq) = (vec![0.0; rates], vec![0.0; rates]);
        let mut points = [Point::default(); 2];
        for sample in 0..samples {
            circle.at(out.time[sample], &mut points);
            let wanted = |of: fn(&Point) -> f64| -> Vec<f64> {
                let mut values = vec![of(&points[0]), of(&points[1])];
                values.extend(self.off_plane.then_some(0.0));
                values
            };
            machine.reach(&mut work, &wanted(|p| p.position)).map_err(|fault| {
                let [x, y] = points.map(|p| p.position);
                let at = self.plane.rotation.mul_vec(Vec3([x, y, 0.0])) + self.plane.translation;
                let angle = circle.angle().at(out.time[sample]).position;
                TaskSpaceError::Unreachable { at: at.0, angle, fault }
            })?;
            let motion = (&*wanted(|p| p.velocity), &*wanted(|p| p.acceleration));
            machine.motion(&mut work, motion, &mut dq, &mut ddq);
            for (k, coordinate) in self.coordinates.iter().enumerate() {
                let place = k * samples + sample;
                match coordinate {
                    Coordinate::Held(q) => out.q[place] = *q,
                    Coordinate::Moves { rate, position } => {
                        out.q[place] = work.positions()[*position];
                        out.dq[place] = dq[*rate];
                        out.ddq[place] = ddq[*rate];
                    }
                }
            }
        }
        Ok(out)
    }
}

/// A fault of the mechanism with its carriage, in the words of circles.
fn at_start(fault: ClosedError, expected: usize) -> TaskSpaceError {
    match fault {
        ClosedError::UnderActuated { mobility, .. } => TaskSpaceError::Mobility { expected, found: mobility },
        ClosedError::Immobile { .. } => TaskSpaceError::Mobility { expected, found: 0 },
        ClosedError::SingularHome { motion, .. } | ClosedError::Dependent { motion, .. } => {
            TaskSpaceError::SingularStart { motion }
        }
        other => TaskSpaceError::Start(other),
    }
}

fn check_numbers(settings: &CircleSettings) -> Result<(), TaskSpaceError> {
    if !(settings.radius > 0.0 && settings.radius.is_finite()) {
        let (expected, found) = ("a positive number", settings.radius);
        return Err(TaskSpaceError::Value { name: "radius", expected, found });
    }
    let lists =
        [("point", Some(settings.point)), ("centre", settings.centre), ("normal", Some(settings.normal))];
    for (name, values) in lists {
        if let Some(found) = values.into_iter().flatten().find(|x| !x.is_finite()) {
            return Err(TaskSpaceError::Value { name, expected: "finite numbers", found });
        }
    }
    let length = Vec3(settings.normal).norm();
    if length < 1e-9 {
        return Err(TaskSpaceError::Value {
            name: "normal",
            expected: "a vector with a length",
            found: length,
        });
    }
    Ok(())
}

/// Where a link is in a pose.
fn placed(
    mechanism: &Mechanism,
    link: &str,
    pose: &[(String, Vec<f64>)],
) -> Result<Placement, TaskSpaceError> {
    let frame = mechanism.frame(link)?;
    let mut q = vec![0.0; mechanism.joint_positions()];
    for (joint, values) in pose {
        let body = &mechanism.bodies()[mechanism.joint_index(joint)?];
        if values.len() != body.joint.positions() || values.iter().any(|x| !x.is_finite()) {
            let found = values.iter().copied().find(|x| !x.is_finite()).unwrap_or(values.len() as f64);
            let expected = "finite positions, as many as the joint has";
            return Err(TaskSpaceError::Value { name: "start pose", expected, found });
        }
        q[body.position..][..values.len()].copy_from_slice(values);
    }
    let dynamics = Dynamics::new(mechanism);
    let frames = dynamics.forward_kinematics(&q, &mut dynamics.workspace());
    Ok(frame.body.map_or(frame.placement, |body| frames[body].then(&frame.placement)))
}

/// Axes of the circle's plane, about its centre.
fn plane(settings: &CircleSettings, centre: Vec3<f64>) -> Placement {
    let normal = Vec3(settings.normal);
    let normal = normal.scale(1.0 / normal.norm());
    let toward = if normal.0[0].abs() > 0.9 { Vec3([0.0, 1.0, 0.0]) } else { Vec3([1.0, 0.0, 0.0]) };
    let first = toward - normal.scale(normal.dot(toward));
    let first = first.scale(1.0 / first.norm());
    Placement { rotation: Mat3([first, normal.cross(first), normal]), translation: centre }
}

/// Adds slides along the axes of the plane to the base; returns the names of their joints.
fn add_carriage(description: &mut Description, base: &str, plane: &Placement, slides: usize) -> Vec<String> {
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for (k, name) in CARRIAGE.iter().take(slides).enumerate() {
        description.links.push(LinkDescription { name: (*name).to_owned(), inertia: None });
        description.joints.push(JointDescription {
            name: (*name).to_owned(),
            parent: if k == 0 { base } else { CARRIAGE[k - 1] }.to_owned(),
            child: (*name).to_owned(),
            kind: JointKind::Prismatic,
            placement: if k == 0 { *plane } else { Placement::identity() },
            axis: axes[k],
            limits: Limits::default(),
            mimic: None,
        });
    }
    CARRIAGE[..slides].iter().map(|name| (*name).to_owned()).collect()
}
