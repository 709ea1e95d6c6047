//! MJCF to a robot.

use std::path::Path;

use dynid_files::digest::SourceFile;
use dynid_model::Description;

use super::actuator;
use super::compiler::{Compiler, Options};
use super::defaults::Defaults;
use super::document::{Document, EditedFile};
use super::equality;
use super::mesh::Meshes;
use super::model::Model;
use super::parts::Parts;
use super::walk::{Count, Walk};
use super::{JointParameters, PositionActuator};
use crate::robot_error::RobotFileError;
use crate::toml_robot::RobotFile;

/// What MJCF holds.
#[derive(Clone, Debug, PartialEq)]
pub struct MjcfRobot {
    /// Links and joints, inner bodies first where they stand in the file; the root link is `world`, and a body without joint hangs on a fixed
    /// joint `<body>/fixed`.
    pub description: Description,
    /// What the moving joints state besides, in the order of the file.
    pub joints: Vec<JointParameters>,
    /// Positions of these joints where the model is as drawn (`ref`), rad or m, in the same order.
    pub drawn: Vec<f64>,
    /// Position loops that actuators close: `<position>` and `<general>` that says the same, of gear 1.
    pub position_actuators: Vec<PositionActuator>,
    /// The robot with what it says of elements, loops and sources.
    pub file: RobotFile,
}

/// Reads MJCF from its text; `path` is where it is from: it stands in messages, and included files and meshes are looked for from its
/// folder.
///
/// - Bodies are links under their own names (`body<k>` without one, `k` as MuJoCo counts); `hinge` is revolute or continuous, `slide`
///   prismatic, `freejoint` floating with a pose in the world. `ref` is part of the placement: positions are those of MuJoCo.
/// - Several joints in one body are a row of joints with massless links `<body>__<joint>` between them, which are tied to have no mass.
/// - Frames, copies (`<replicate>`), classes of `<default>` and included files are resolved, and orientations in all ways of MJCF.
/// - Inertia: `<inertial>`, or the shapes (`inertiafromgeom`): spheres, capsules, cylinders, ellipsoids, boxes, and meshes (STL, OBJ) of
///   `inertia` legacy, exact or shell; the bounds and the total mass of `<compiler>`. Shapes of bodies that stand still are not weighed.
/// - `armature`, `damping` and `frictionloss` are stated values of the elements `rotor`, `viscous` and `coulomb`; `stiffness` and `springref` are the
///   element `spring` of the joint, with its values.
/// - Efforts are limited by `actuatorfrcrange`, or by the `forcerange` of an actuator (of a motor also its `ctrlrange`) times its gear.
/// - `<equality>`: linear `<joint>` is a mimic joint, `<connect>` a spherical and `<weld>` a fixed loop.
///
/// # Errors
/// [`RobotFileError`] with file, line and column; [`RobotFileError::NotCarried`] for what changes efforts and has no place here, such as
/// ball joints, fluids, `gravcomp`, tendons that pull, plugins, and shapes whose inertia is not computed.
pub fn parse(text: &str, path: impl AsRef<Path>) -> Result<MjcfRobot, RobotFileError> {
    parse_edited(text, path.as_ref(), &[])
}

/// Reads MJCF of which some included files have been edited; see [`parse`].
///
/// # Errors
/// As [`parse`].
pub fn parse_edited(text: &str, path: &Path, changed: &[EditedFile]) -> Result<MjcfRobot, RobotFileError> {
    let document = Document::load(text, path, changed)?;
    let (model, meshes) = model(&document, path)?;
    let files = document.files.iter().map(|f| f.name.clone()).collect();
    let sources = [document.sources.clone(), meshes].concat();
    Ok(MjcfRobot {
        drawn: model.joints.iter().map(|j| j.zero).collect(),
        joints: model.joints.into_iter().map(|j| j.parameters).collect(),
        position_actuators: model.position_actuators,
        file: RobotFile {
            actuated: (!model.closures.is_empty() && !model.driven.is_empty()).then_some(model.driven),
            home: model.home,
            closures: model.closures,
            mjcf: Some(files),
            sources,
            warnings: model.warnings,
            ..RobotFile::plain(model.description.clone(), model.elements)
        },
        description: model.description,
    })
}

/// The model of a document, and the meshes that were read for it.
pub(super) fn model<'a>(
    document: &'a Document,
    path: &Path,
) -> Result<(Model<'a>, Vec<SourceFile>), RobotFileError> {
    let compiler = Compiler::of(document)?;
    let options = Options::of(document)?;
    let defaults = Defaults::of(document)?;
    equality::refuse_others(document, &defaults)?;
    let mut model = Model::new(document.root.text("model").filter(|n| !n.is_empty()).unwrap_or("robot"));
    model.description.gravity = options.gravity;
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut walk = Walk {
        document,
        compiler: &compiler,
        options: &options,
        defaults: &defaults,
        parts: Parts { document, compiler: &compiler, defaults: &defaults, count: 0 },
        meshes: Meshes::of(document, &compiler, &defaults, folder)?,
        model,
        count: Count::default(),
    };
    walk.world()?;
    let Walk { mut model, meshes, .. } = walk;
    actuator::read(document, &defaults, &mut model)?;
    equality::read(document, &defaults, &options, &mut model)?;
    equality::home(document, &mut model)?;
    Ok((model, meshes.sources))
}
