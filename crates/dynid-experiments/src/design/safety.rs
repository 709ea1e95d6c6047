//! What every design keeps unless it is turned off: links above the floor, and apart from each other.

use dynid_excitation::constraint::{
    Capsule, CapsulePairs, Capsules, CartesianLimits, ConstraintError, ConstraintKind, FramePoint,
    PathConstraint, Plane, PlaneScreening, mean_place, screen,
};
use dynid_files::SourceFile;
use dynid_identify::Error;
use dynid_identify::robot::Robot;
use dynid_model::{BodyPoint, ClosedModel, Mechanism, Vec3};
use serde::Serialize;

use super::DesignError;
use super::config::DesignConfig;
use super::shapes::{CapsuleSource, LinkCapsule, LinkCapsules, link_capsules};

/// Cosine of the angle between the z axis of the base and the vertical up to which the base is upright: 45°.
const UPRIGHT: f64 = 0.7;
/// Cosine of the angle between where the links are and a direction up to which they are on that side: 60°.
const SAME_SIDE: f64 = 0.5;
/// Links whose mean place is nearer to the base than this share of their reach are on no side.
const NO_SIDE: f64 = 0.1;

/// Limits that are kept by default, and what they mean.
pub(super) struct Safety {
    pub(super) constraints: Vec<Box<dyn PathConstraint>>,
    pub(super) record: SafetyRecord,
    pub(super) capsules: Vec<LinkCapsule>,
    /// Mesh files that were read.
    pub(super) meshes: Vec<SourceFile>,
    /// What was taken for granted, in words.
    pub(super) assumptions: Vec<String>,
}

/// What is checked by default, and what is not.
#[derive(Debug, Clone, Default, PartialEq, Serialize, schemars::JsonSchema)]
pub struct SafetyRecord {
    /// Least distance between links and from planes, m.
    pub margin_m: f64,
    /// Planes that moving links stay above.
    pub planes: Vec<PlaneRecord>,
    /// Pairs of links that are kept apart.
    pub pairs: Vec<[String; 2]>,
    /// Pairs of links of which parts are not kept apart, with the reason.
    pub exempt: Vec<ExemptRecord>,
    /// Capsules about the links.
    pub capsules: Vec<CapsuleRecord>,
    /// What is not checked, in words.
    pub not_checked: Vec<String>,
}

dynid_record::words! {
    /// Planes that links stay above.
    PlaneName {
        /// The floor.
        Floor = "floor",
        /// The plane that the robot is mounted on.
        Mounting = "mounting plane",
    }
}

/// A plane that links stay above.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct PlaneRecord {
    /// Which plane.
    pub name: PlaneName,
    /// Unit vector into the side of the robot, base axes.
    pub normal: [f64; 3],
    /// Distance from the origin of the base along the normal, m.
    pub height_m: f64,
    /// Links that are kept above it.
    pub links: Vec<String>,
    /// Links of which a part is below it by the margin in every pose.
    pub always_low: Vec<String>,
}

/// A pair of links that is not kept apart.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct ExemptRecord {
    /// The links.
    pub links: [String; 2],
    /// Why.
    pub reason: &'static str,
}

/// A capsule about a link.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct CapsuleRecord {
    /// Link.
    pub link: String,
    /// One end of its segment in the frame of the link, m.
    pub from_m: [f64; 3],
    /// The other end.
    pub to_m: [f64; 3],
    /// Radius, m.
    pub radius_m: f64,
    /// What it was made from.
    pub source: CapsuleSource,
}

/// Where poses of a robot are drawn from.
pub(super) struct Drawn<'a> {
    pub(super) mechanism: &'a Mechanism,
    /// Positions of all joints of the tree.
    pub(super) ranges: &'a [(f64, f64)],
    /// Its poses where it has loops.
    pub(super) closed: Option<&'a ClosedModel>,
}

/// Floor and own links of a robot, as far as they are wanted.
pub(super) fn safety(robot: &Robot, config: &DesignConfig, drawn: &Drawn<'_>) -> Result<Safety, Error> {
    let wanted = &config.safety;
    let mut out = Safety {
        constraints: Vec::new(),
        record: SafetyRecord { margin_m: wanted.margin_m, ..SafetyRecord::default() },
        capsules: Vec::new(),
        meshes: Vec::new(),
        assumptions: Vec::new(),
    };
    if !wanted.floor {
        out.record.not_checked.push("the floor (turned off)".to_owned());
    }
    if !wanted.self_collision {
        out.record.not_checked.push("own links against each other (turned off)".to_owned());
    }
    if wanted.floor || wanted.self_collision {
        let shapes = link_capsules(robot, config)?;
        out.tell_of_shapes(&shapes, robot);
        out.meshes = shapes.meshes;
        let planes = if wanted.floor { out.planes(config, drawn)? } else { Vec::new() };
        out.capsules = shapes.capsules;
        out.keep(config, drawn, &planes)?;
    }
    out.record.not_checked.push("tools, cables and surroundings".to_owned());
    Ok(out)
}

impl Safety {
    /// Notes on links whose shape is not known.
    fn tell_of_shapes(&mut self, shapes: &LinkCapsules, robot: &Robot) {
        let chain = shapes.capsules.iter().find(|c| c.source == CapsuleSource::Chain);
        let radius = chain.map_or(0.0, |c| 1e3 * c.capsule.radius);
        if !shapes.unread.is_empty() {
            let links: Vec<&str> = shapes.unread.iter().map(|(link, _)| link.as_str()).collect();
            let reasons: Vec<String> =
                shapes.unread.iter().map(|(link, reason)| format!("{link}: {reason}")).collect();
            self.assumptions.push(format!(
                "meshes are not read ({}): capsules along the chain of joints, {radius:.0} mm in radius, stand for these links; \
                 `package_dirs = [\"FOLDER\"]` (--package-dir FOLDER) says where the packages are",
                reasons.join("; ")
            ));
            self.record.not_checked.push(format!(
                "the true shape of {} (meshes not read, capsules of {radius:.0} mm along the chain of joints instead)",
                links.join(", ")
            ));
        } else if chain.is_some() {
            let links = robot.mechanism.bodies().iter().map(|b| b.name.as_str());
            let mut guessed: Vec<&str> = std::iter::once(robot.mechanism.base_link()).chain(links).collect();
            let is_chain = |l: &&str| {
                shapes.capsules.iter().any(|c| c.source == CapsuleSource::Chain && c.capsule.frame == **l)
            };
            guessed.retain(is_chain);
            self.assumptions.push(format!(
                "no shapes are stated for {}: capsules along the chain of joints, {radius:.0} mm in radius, stand for these links",
                guessed.join(", ")
            ));
            self.record.not_checked.push(format!(
                "the true shape of {} (none stated, capsules of {radius:.0} mm along the chain of joints instead)",
                guessed.join(", ")
            ));
        }
        if shapes.capsules.is_empty() {
            let reason = "the robot file states no shapes, and all joints are at one place";
            self.assumptions.push(format!("neither floor nor own links are checked: {reason}"));
            self.record.not_checked.push(format!("the floor and own links ({reason})"));
        }
    }

    /// The floor, or what stands for it.
    fn planes(&mut self, config: &DesignConfig, drawn: &Drawn<'_>) -> Result<Vec<Plane>, Error> {
        let gravity = drawn.mechanism.gravity();
        let stated = config.safety.floor_height_m;
        let not_checked = &mut self.record.not_checked;
        if gravity.norm() == 0.0 {
            if let Some(height) = stated {
                let expected = "gravity beside it, which says where up is";
                return Err(Error::setting("safety.floor_height_m", expected, height));
            }
            not_checked.push("the floor (gravity is zero: nothing says where up is)".to_owned());
            return Ok(Vec::new());
        }
        let up = gravity.scale(-1.0 / gravity.norm());
        let floor = |height| Plane { kind: ConstraintKind::Floor, normal: up, height };
        let side = (up.0[2] < UPRIGHT).then(|| side_of_links(drawn)).transpose()?;
        // Links on no side, or above: an upright base in other axes.
        let Some(side) = side.flatten().filter(|side| side.dot(up) < SAME_SIDE) else {
            return Ok(vec![floor(stated.unwrap_or(0.0))]);
        };
        let mut planes: Vec<Plane> = stated.map(floor).into_iter().collect();
        let [x, y, z] = gravity.0;
        let line = "`floor_height_m = -1.5` under [safety] keeps a floor 1.5 m below the origin of the base";
        if stated.is_none() {
            not_checked.push("the floor (the base is not upright: its height is not known)".to_owned());
        }
        match nearest_axis(side) {
            Some(normal) => {
                planes.push(Plane { kind: ConstraintKind::Mounting, normal, height: 0.0 });
                self.assumptions.push(format!(
                    "the base is not upright (gravity {x} {y} {z} in base axes): links are kept on the side {} of the plane \
                     through its origin, which it is mounted on; {line}",
                    axis_name(normal)
                ));
            }
            None => self.assumptions.push(format!(
                "the base is not upright (gravity {x} {y} {z} in base axes), and what it is mounted on is not known; {line}"
            )),
        }
        Ok(planes)
    }

    /// Poses the limits, and tells what they leave out.
    fn keep(&mut self, config: &DesignConfig, drawn: &Drawn<'_>, planes: &[Plane]) -> Result<(), Error> {
        let Drawn { mechanism, ranges, closed } = *drawn;
        let margin = config.safety.margin_m;
        let capsules: Vec<Capsule> = self.capsules.iter().map(|c| c.capsule.clone()).collect();
        let screened =
            screen(mechanism, &capsules, planes, margin, ranges, closed).map_err(DesignError::from)?;
        let record = |c: &LinkCapsule| CapsuleRecord {
            link: c.capsule.frame.clone(),
            from_m: c.capsule.ends[0].0,
            to_m: c.capsule.ends[1].0,
            radius_m: c.capsule.radius,
            source: c.source,
        };
        self.record.capsules = self.capsules.iter().map(record).collect();
        for (plane, ends) in planes.iter().zip(&screened.planes) {
            self.keep_plane(mechanism, &capsules, plane, ends, margin)?;
        }
        if config.safety.self_collision {
            self.keep_apart(config, mechanism, &capsules, &screened.pairs, &screened.always_near)?;
        }
        Ok(())
    }

    fn keep_plane(
        &mut self,
        mechanism: &Mechanism,
        capsules: &[Capsule],
        plane: &Plane,
        ends: &PlaneScreening,
        margin: f64,
    ) -> Result<(), Error> {
        let point = |(capsule, end): &(usize, usize)| {
            let c = &capsules[*capsule];
            (FramePoint { frame: c.frame.clone(), position: c.ends[*end] }, c.radius + margin)
        };
        let points: Vec<_> = ends.kept.iter().map(point).collect();
        let names = |ends: &[(usize, usize)]| distinct(ends.iter().map(|(c, _)| capsules[*c].frame.clone()));
        let is_floor = plane.kind == ConstraintKind::Floor;
        let name = if is_floor { PlaneName::Floor } else { PlaneName::Mounting };
        let always_low = names(&ends.always_low);
        if !always_low.is_empty() {
            let millimetres = 1e3 * margin;
            self.record.not_checked.push(format!(
                "the {name} for parts of {}, which every pose has below it or within {millimetres:.0} mm",
                always_low.join(", ")
            ));
        }
        self.record.planes.push(PlaneRecord {
            name,
            normal: plane.normal.0,
            height_m: plane.height,
            links: names(&ends.kept),
            always_low,
        });
        if !points.is_empty() {
            self.constraints.push(Box::new(
                CartesianLimits::above_plane(mechanism, &points, plane).map_err(DesignError::from)?,
            ));
        }
        Ok(())
    }

    fn keep_apart(
        &mut self,
        config: &DesignConfig,
        mechanism: &Mechanism,
        capsules: &[Capsule],
        pairs: &[(usize, usize)],
        always_near: &[(usize, usize)],
    ) -> Result<(), Error> {
        let margin = config.safety.margin_m;
        let is_given = |k: usize| self.capsules[k].source == CapsuleSource::Given;
        let names = |(a, b): &(usize, usize)| [capsules[*a].frame.clone(), capsules[*b].frame.clone()];
        let stated = |pair: &[String; 2]| {
            config
                .safety
                .exempt
                .iter()
                .any(|[a, b]| (*a == pair[0] && *b == pair[1]) || (*b == pair[0] && *a == pair[1]))
        };
        // Given capsules are kept apart among themselves as the configuration says.
        let own = |(a, b): &&(usize, usize)| !(is_given(*a) && is_given(*b));
        let wanted: Vec<(usize, usize)> = pairs.iter().filter(own).copied().collect();
        let (exempt, kept): (Vec<_>, Vec<_>) = wanted.iter().partition(|pair| stated(&names(pair)));
        check_exempt(&config.safety.exempt, mechanism, &exempt.iter().map(names).collect::<Vec<_>>())?;
        let near = distinct(always_near.iter().filter(own).map(names));
        if !near.is_empty() {
            let text: Vec<String> = near.iter().map(|[a, b]| format!("{a} and {b}")).collect();
            let millimetres = 1e3 * margin;
            self.assumptions.push(format!(
                "parts of these links are not kept apart, since 95 of 100 poses or more have them within {millimetres:.0} mm: {}",
                text.join(", ")
            ));
            self.record.not_checked.push(format!(
                "parts of {} pairs of links that are near in nearly every pose ({})",
                near.len(),
                text.join(", ")
            ));
        }
        let exempt = distinct(exempt.iter().map(names));
        if !exempt.is_empty() {
            let text: Vec<String> = exempt.iter().map(|[a, b]| format!("{a} and {b}")).collect();
            self.record.not_checked.push(format!("exempt pairs of links ({})", text.join(", ")));
        }
        let reason = "95 of 100 poses or more have parts of them within the margin";
        self.record.exempt.extend(near.into_iter().map(|links| ExemptRecord { links, reason }));
        let reason = "the configuration says so";
        self.record.exempt.extend(exempt.into_iter().map(|links| ExemptRecord { links, reason }));
        self.record.pairs = distinct(kept.iter().map(names));
        if !kept.is_empty() {
            self.constraints.push(Box::new(
                Capsules::own_links(mechanism, capsules, &kept, margin).map_err(DesignError::from)?,
            ));
        }
        Ok(())
    }
}

/// Exemptions must name links, and pairs that would be kept apart without them.
fn check_exempt(exempt: &[[String; 2]], mechanism: &Mechanism, used: &[[String; 2]]) -> Result<(), Error> {
    for pair in exempt {
        for link in pair {
            mechanism.frame(link).map_err(ConstraintError::from).map_err(DesignError::from)?;
        }
        let [a, b] = pair;
        if !used.iter().any(|u| u == pair || (u[0] == *b && u[1] == *a)) {
            let expected = "two links that would be kept apart: not those that one joint joins, that are near in every pose or \
                            in none";
            return Err(Error::setting("safety.exempt", expected, format!("{a} and {b}")));
        }
    }
    Ok(())
}

/// Capsules of the configuration, kept apart among themselves.
pub(super) fn given_capsules(
    config: &DesignConfig,
    mechanism: &Mechanism,
    ranges: &[(f64, f64)],
    assumptions: &mut Vec<String>,
) -> Result<Option<Box<dyn PathConstraint>>, Error> {
    let given = |c: &super::CapsuleConfig| Capsule {
        frame: c.frame.clone(),
        ends: [Vec3(c.from), Vec3(c.to)],
        radius: c.radius,
    };
    let capsules: Vec<Capsule> = config.capsule.iter().map(given).collect();
    if capsules.len() < 2 {
        return Ok(None);
    }
    let kept = Capsules::new(mechanism, &capsules, &CapsulePairs::All, ranges).map_err(DesignError::from)?;
    if kept.pairs().is_empty() {
        assumptions.push(
            "no two capsules are kept apart: they cannot touch within the position limits, or stand on one link or on two that \
             one joint joins"
                .to_owned(),
        );
    }
    Ok(Some(Box::new(kept)))
}

/// Unit vector from the base to where the links are on the whole; `None` if they are all around it.
fn side_of_links(drawn: &Drawn<'_>) -> Result<Option<Vec3<f64>>, Error> {
    let Drawn { mechanism, ranges, closed } = *drawn;
    let origin = |body| BodyPoint { body: Some(body), position: Vec3::zero() };
    let origins: Vec<BodyPoint> = (0..mechanism.bodies().len()).map(origin).collect();
    let (mean, reach) = mean_place(mechanism, &origins, ranges, closed).map_err(DesignError::from)?;
    let distance = mean.norm();
    Ok((distance > NO_SIDE * reach).then(|| mean.scale(1.0 / distance)))
}

/// The axis of the base that a direction is nearest to, if it is near to one.
fn nearest_axis(direction: Vec3<f64>) -> Option<Vec3<f64>> {
    let axis = |c: usize, sign: f64| {
        let mut axis = Vec3::zero();
        axis.0[c] = sign;
        axis
    };
    let axes = (0..3).flat_map(|c| [axis(c, 1.0), axis(c, -1.0)]);
    axes.max_by(|a, b| a.dot(direction).total_cmp(&b.dot(direction))).filter(|a| a.dot(direction) > UPRIGHT)
}

fn axis_name(axis: Vec3<f64>) -> String {
    let names = ["x", "y", "z"];
    let place = axis.0.iter().position(|x| *x != 0.0).unwrap_or(2);
    format!("{}{}", if axis.0[place] < 0.0 { "-" } else { "+" }, names[place])
}

/// Each once, in the order of their first appearance.
fn distinct<T: PartialEq>(items: impl Iterator<Item = T>) -> Vec<T> {
    let mut out: Vec<T> = Vec::new();
    for item in items {
        if !out.contains(&item) {
            out.push(item);
        }
    }
    out
}
