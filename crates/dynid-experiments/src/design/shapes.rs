//! Capsules about the links of a robot: from the shapes of its URDF, from mesh files, along the chain of joints.

use std::path::{Path, PathBuf};

use dynid_excitation::constraint::Capsule;
use dynid_excitation::constraint::ConstraintError;
use dynid_excitation::envelope::{Envelope, Triangle, chain_capsules, chain_radius};
use dynid_files::{FileMember, SourceFile};
use dynid_identify::Error;
use dynid_identify::robot::Robot;
use dynid_model::{Placement, Vec3};
use dynid_robots::MeshError;
use dynid_robots::urdf::{LinkShape, Shape, ShapeRole, parse_shapes};
use serde::Serialize;

use super::DesignError;
use super::config::DesignConfig;

/// A mesh that is this much larger than the robot is in other units.
const LARGEST_SHARE: f64 = 3.0;

/// Where a capsule comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum CapsuleSource {
    /// `<collision>` of the URDF: it holds boxes, cylinders, spheres and all corners of meshes.
    Collision,
    /// `<visual>` of the URDF, in the same way.
    Visual,
    /// No shape was read: a guess along the chain of joints.
    Chain,
    /// `[[capsule]]` of the configuration.
    Given,
}

/// A capsule about a link, or a part of it.
#[derive(Debug, Clone, PartialEq)]
pub struct LinkCapsule {
    /// The capsule, in the frame of its link.
    pub capsule: Capsule,
    /// Where it comes from.
    pub source: CapsuleSource,
}

/// Capsules about all links, and what they are made of.
#[derive(Debug, Clone, Default)]
pub(super) struct LinkCapsules {
    pub(super) capsules: Vec<LinkCapsule>,
    /// Meshes that were not read: link and reason.
    pub(super) unread: Vec<(String, String)>,
    /// Mesh files that were read.
    pub(super) meshes: Vec<SourceFile>,
}

/// Capsules about every link with a shape, along the chain where a moving link or the base has none that can be read.
pub(super) fn link_capsules(robot: &Robot, config: &DesignConfig) -> Result<LinkCapsules, Error> {
    let mechanism = &robot.mechanism;
    let mut out = LinkCapsules::default();
    let shapes = shapes_of(robot)?;
    check_package_dirs(config, &shapes)?;
    let mut reader = MeshReader::new(robot, config);
    let mut links: Vec<&str> = Vec::new();
    for shape in &shapes {
        if !links.contains(&shape.link.as_str()) {
            links.push(&shape.link);
        }
    }
    // Bodies (`None`: the base) whose shapes are all known.
    let mut known = Vec::new();
    let mut unknown = Vec::new();
    for link in links {
        let frame = mechanism.frame(link).map_err(ConstraintError::from).map_err(DesignError::from)?;
        let body = frame.body;
        let own = |role| shapes.iter().filter(|s| s.link == link && s.role == role).collect::<Vec<_>>();
        let (collision, visual) = (own(ShapeRole::Collision), own(ShapeRole::Visual));
        match reader.first_whole(&collision, &visual) {
            Ok((source, envelopes)) => {
                known.push(body);
                out.capsules.extend(envelopes.into_iter().map(|e| on_link(link, e, source)));
            }
            Err(reason) => {
                unknown.push(body);
                out.unread.push((link.to_owned(), reason));
            }
        }
    }
    if let Some(radius) = chain_radius(mechanism) {
        for body in std::iter::once(None).chain((0..mechanism.bodies().len()).map(Some)) {
            if !known.contains(&body) || unknown.contains(&body) {
                let chain = chain_capsules(mechanism, body, radius);
                out.capsules.extend(
                    chain.into_iter().map(|capsule| LinkCapsule { capsule, source: CapsuleSource::Chain }),
                );
            }
        }
    }
    for given in &config.capsule {
        let ends = [Vec3(given.from), Vec3(given.to)];
        let capsule = Capsule { frame: given.frame.clone(), ends, radius: given.radius };
        out.capsules.push(LinkCapsule { capsule, source: CapsuleSource::Given });
    }
    out.meshes = reader.meshes;
    Ok(out)
}

fn on_link(link: &str, envelope: Envelope, source: CapsuleSource) -> LinkCapsule {
    let capsule = Capsule { frame: link.to_owned(), ends: envelope.ends, radius: envelope.radius };
    LinkCapsule { capsule, source }
}

/// Shapes of the robot's URDF; none if it is described otherwise.
fn shapes_of(robot: &Robot) -> Result<Vec<LinkShape>, Error> {
    let (Some(urdf), Some(text)) = (&robot.file.urdf, &robot.file.xml) else { return Ok(Vec::new()) };
    Ok(parse_shapes(text, urdf)?)
}

/// Folders of packages must exist, and something must be looked for in them.
fn check_package_dirs(config: &DesignConfig, shapes: &[LinkShape]) -> Result<(), Error> {
    let Some(first) = config.package_dirs.first() else { return Ok(()) };
    if let Some(missing) = config.package_dirs.iter().find(|dir| !dir.is_dir()) {
        return Err(Error::setting("package_dirs", "folders that exist", missing.display()));
    }
    if !shapes.iter().any(|s| matches!(s.shape, Shape::Mesh { .. })) {
        return Err(Error::setting("package_dirs", "a URDF with meshes, which it is for", first.display()));
    }
    Ok(())
}

/// Finds and reads mesh files.
struct MeshReader {
    /// Folder of the URDF.
    folder: PathBuf,
    package_dirs: Vec<PathBuf>,
    /// Largest extent of a mesh that is believed, m.
    largest: f64,
    meshes: Vec<SourceFile>,
}

impl MeshReader {
    fn new(robot: &Robot, config: &DesignConfig) -> Self {
        let own = FileMember::of(&robot.path).path;
        let file = robot.file.urdf.as_ref().map_or(own.as_path(), Path::new);
        let folder = file.parent().map_or_else(PathBuf::new, Path::to_path_buf);
        let lengths = robot.mechanism.bodies().iter().map(|b| b.joint.placement.translation.norm());
        MeshReader {
            // Relative names have no ancestors beyond the current folder.
            folder: std::path::absolute(&folder).unwrap_or(folder),
            package_dirs: config.package_dirs.clone(),
            largest: LARGEST_SHARE * (lengths.sum::<f64>() + 1.0),
            meshes: Vec::new(),
        }
    }

    /// Capsules from the collision shapes, else from the looks; of neither a part is left out.
    fn first_whole(
        &mut self,
        collision: &[&LinkShape],
        visual: &[&LinkShape],
    ) -> Result<(CapsuleSource, Vec<Envelope>), String> {
        let mut fault = None;
        for (source, shapes) in [(CapsuleSource::Collision, collision), (CapsuleSource::Visual, visual)] {
            if shapes.is_empty() {
                continue;
            }
            match shapes.iter().map(|s| self.envelopes(s)).collect::<Result<Vec<_>, _>>() {
                Ok(envelopes) => return Ok((source, envelopes.concat())),
                Err(reason) => fault = fault.or(Some(reason)),
            }
        }
        Err(fault.unwrap_or_default())
    }

    /// Capsules about one shape, in the frame of its link.
    fn envelopes(&mut self, shape: &LinkShape) -> Result<Vec<Envelope>, String> {
        let own = match &shape.shape {
            Shape::Box { size } => Envelope::of_box(*size),
            Shape::Cylinder { radius, length } => vec![Envelope::of_cylinder(*radius, *length)],
            Shape::Sphere { radius } => vec![Envelope::of_sphere(*radius)],
            Shape::Mesh { file, scale } => self.mesh(file, *scale)?,
        };
        let placed = |e: Envelope| Envelope { ends: e.ends.map(|x| place(&shape.placement, x)), ..e };
        Ok(own.into_iter().map(placed).collect())
    }

    fn mesh(&mut self, file: &str, scale: [f64; 3]) -> Result<Vec<Envelope>, String> {
        let Some(path) = self.find(file) else { return Err(format!("{file} is not there")) };
        let (mesh, source) = dynid_robots::mesh::read(&path).map_err(|e| match e {
            MeshError::Format { found, .. } => format!("{file}: {found} is not read, only STL and OBJ"),
            other => other.to_string(),
        })?;
        let corner = |p: [f64; 3]| Vec3(std::array::from_fn(|c| scale[c] * p[c]));
        let triangles: Vec<Triangle> = mesh.triangles.iter().map(|t| t.map(corner)).collect();
        let extent = triangles.iter().flatten().map(|p| p.norm()).fold(0.0, f64::max);
        if extent > self.largest {
            return Err(format!(
                "{file} reaches {extent:.0} m from its origin: it is in other units (`scale=\"0.001 0.001 0.001\"` reads millimetres)"
            ));
        }
        if !self.meshes.iter().any(|m| m.path == source.path) {
            self.meshes.push(source);
        }
        Ok(Envelope::of_surface(&triangles))
    }

    /// The file that a name in the URDF means: `package://NAME/REST` in the folders of packages, then in the folders above
    /// the URDF; other names from the folder of the URDF.
    fn find(&self, name: &str) -> Option<PathBuf> {
        let in_package = name.strip_prefix("package://").or_else(|| name.strip_prefix("model://"));
        let candidates: Vec<PathBuf> = match in_package {
            Some(inside) => {
                let (package, rest) = inside.split_once('/')?;
                let folders = self.package_dirs.iter().map(PathBuf::as_path).chain(self.folder.ancestors());
                folders
                    .flat_map(|folder| {
                        let is_package = folder.file_name().is_some_and(|n| n == package);
                        [Some(folder.join(inside)), is_package.then(|| folder.join(rest))]
                    })
                    .flatten()
                    .collect()
            }
            None => {
                let path = name.strip_prefix("file://").unwrap_or(name);
                std::iter::once(&self.folder).chain(&self.package_dirs).map(|f| f.join(path)).collect()
            }
        };
        candidates.into_iter().find(|path| path.is_file())
    }
}

fn place(placement: &Placement, x: Vec3<f64>) -> Vec3<f64> {
    placement.rotation.mul_vec(x) + placement.translation
}
