//! Robots in TOML: DH tables, body trees, or a URDF with an element list.

mod bodies;
mod clearance;
mod dh;
mod elastic;
mod elements;
mod floating;
mod home;
mod loops;
mod number;
mod reaction;
mod schema;
mod write;

use std::path::Path;
use std::sync::Arc;

use dynid_model::closed::ClosureDescription;
use dynid_model::{Description, Inertia, Mat3, Vec3};

pub use clearance::{ClearanceSpec, ClearanceValue};
pub use elastic::ElasticSpec;
pub use elements::{CouplingSpec, ElementSetting, ElementSpec, SettingValue};
pub use reaction::{ReactionLoad, ReactionSpec};
pub use schema::CouplingForm;

use toml::Spanned;

pub use write::Loops;

use crate::law::LawFault;
use crate::plain::Plain;
use crate::robot_error::{Place, RobotFileError};
use crate::source::{MAX_ROBOT_FILE_BYTES, read_text};
use crate::urdf;
use dynid_files::digest::SourceFile;
use dynid_files::excerpt::{closest, excerpt};
use schema::{BodyInertia, RobotToml};

/// A robot file: the mechanism and what the file says about the elements at its joints.
#[derive(Clone, Debug, PartialEq)]
pub struct RobotFile {
    /// Links and joints.
    pub description: Description,
    /// Elements, their settings and couplings.
    pub elements: ElementSpec,
    /// Actuated joints; `None` if the file does not say (all of them).
    pub actuated: Option<Vec<String>>,
    /// Home position of joints, sorted by name: one value (rad or m), of a floating joint seven, `x y z qx qy qz qw`.
    pub home: Vec<(String, Vec<f64>)>,
    /// What closes loops of the tree, in the order of the file.
    pub closures: Vec<ClosureDescription>,
    /// Path of the URDF that holds the tree, if the file is a URDF or refers to one.
    pub urdf: Option<String>,
    /// Text of that URDF, or of the MJCF that the file is; of xacro what it expands to.
    pub xml: Option<Arc<str>>,
    /// Files of the MJCF that this is, if it is one: the path from the folder of the main file, which itself comes first and is empty.
    pub mjcf: Option<Vec<String>>,
    /// Whether it is an SDF, which is read and not written.
    pub sdf: bool,
    /// What a user should know about what was read.
    pub warnings: Vec<String>,
    /// Files that were read, this one first; a text alone has none but those that it refers to.
    pub sources: Vec<SourceFile>,
}

impl RobotFile {
    /// A description without anything besides.
    pub fn plain(description: Description, elements: ElementSpec) -> Self {
        RobotFile {
            description,
            elements,
            actuated: None,
            home: Vec::new(),
            closures: Vec::new(),
            urdf: None,
            xml: None,
            mjcf: None,
            sdf: false,
            warnings: Vec::new(),
            sources: Vec::new(),
        }
    }
}

/// Reads a robot in TOML of at most 64 MiB. See [`parse`].
///
/// # Errors
/// [`RobotFileError`].
pub fn read(path: impl AsRef<Path>) -> Result<RobotFile, RobotFileError> {
    let path = path.as_ref();
    let (text, source) = read_text(path, MAX_ROBOT_FILE_BYTES)?;
    parse_source(&text, &path.display().to_string(), Some(source))
}

/// Reads a robot in TOML; `source_name` stands in messages, and its folder is where `urdf = "..."` is looked for.
///
/// One of three forms: `joint = [..]` (DH rows, see below), `body = [..]` (a tree), `urdf = "file"`. Lengths m, angles
/// rad or text such as `"90deg"`. Keys of every form: `schema` (1), `name`, `gravity` (m/s², base axes),
/// `floating_base`, `couple_mimics`, `floating`, `loop`, `actuated`, `home`, `[defaults]`, `[element.<joint>]`,
/// `[[coupling]]`. Unknown keys are errors. `[element.<joint>] elastic = { ratio = .. }` ([`ElasticSpec`]) puts a motor
/// behind a spring; `[element.<motor>]` is then as for joints. `clearance = { journal_radius = .., gap = .. }`
/// ([`ClearanceSpec`]) gives the joint's journal room in its bearing. `reaction_friction = { loads = [..] }` ([`ReactionSpec`])
/// says what presses on a joint whose friction follows it: `loads` (tables of `force` or `moment`: names of axes, `"axial"`
/// or `"radial"`; `radius` or `arm`, m; `joint`, by default its own), `weight` (shares of the weight of links), `preload`.
///
/// `floating = [..]` names links or joints: the joint that carries the link, or the joint itself, becomes a floating one,
/// whatever its kind. `home = { joint = .. }`: a number or an angle, of a floating joint `[x, y, z, qx, qy, qz, qw]` with a
/// quaternion of length 1 within 1e-3 (kept as it stands).
///
/// `loop = [..]` joins frames of two links where a joint has been cut ([`Condition`](dynid_model::closed::Condition)): `name`,
/// `kind` (`spherical` or `point`, `planar_revolute`, `revolute`, `universal`, `cylindrical`, `prismatic`, `planar_prismatic`,
/// `fixed`, `distance`), `a`, `b` (links; the root is `ground` of a body tree, `base` of a DH table), `a_xyz`, `a_rpy`,
/// `b_xyz`, `b_rpy` (default 0), and `length` (m, positive) of a `distance`. `kind = "coordinate"` has `terms = { joint =
/// factor, .. }` and `constant` (default 0, in the unit of the terms) instead of frames. Whether the loops can be closed is
/// not decided here.
///
/// A body: `name`, `parent` (a body or `ground`), `joint = { name, kind, xyz, rpy, axis, pitch, limits }` with `kind`
/// `revolute` (default), `continuous`, `prismatic`, `helical` (with `pitch`, m/rad), `floating`, `fixed`, and the inertia as in
/// DH rows. The joint's name is by default that of the body.
///
/// DH rows (`dh = "modified"` or `"standard"`): `name`, `link` (default `link<k>`), `a`, `alpha`, `d`, `offset`, `kind`
/// (`revolute`, `continuous`, `prismatic`), `limits`, and the inertia as `phi` (order m, mx, my, mz, Ixx, Ixy, Ixz, Iyy,
/// Iyz, Izz about the joint frame) or `mass`, `com`, `inertia_com`; axis z. The first parent is the link `base`.
///
/// - Modified (Craig 1986): `P_i = Rx(alpha) Tx(a) Tz(d) Rz(offset)` with `a`, `alpha` of index i-1 in row i;
///   prismatic: `P_i = Rx(alpha) Tx(a) Rz(theta) Tz(offset)`.
/// - Standard: `T_i = Rz(q + offset) Tz(d) Tx(a) Rx(alpha)`. The joint frame is the table's frame i-1 turned by its angle:
///   `P_1 = Rz(offset_1)`, `P_{i+1} = Tz(d_i) Tx(a_i) Rx(alpha_i) Rz(offset_{i+1})`; prismatic:
///   `P_i = (previous tail) Rz(theta_i) Tz(offset_i)`, tail `Tx(a_i) Rx(alpha_i)`. Inertias are about the joint frame;
///   `frame = "distal"` states them about the table's frame i, and they are shifted by the tail. The last tail is the
///   massless fixed link `tool`.
/// - `tool = { xyz, rpy }` adds a massless fixed link `tool` to the last link (behind the tail, if there is one).
///
/// # Errors
/// [`RobotFileError`] with line and column.
pub fn parse(text: &str, source_name: &str) -> Result<RobotFile, RobotFileError> {
    parse_source(text, source_name, None)
}

/// Parses a robot from text that was read from a file.
pub(crate) fn parse_source(
    text: &str,
    source_name: &str,
    own: Option<SourceFile>,
) -> Result<RobotFile, RobotFileError> {
    let mut sources: Vec<SourceFile> = own.into_iter().collect();
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let robot: RobotToml = toml::from_str(text).map_err(|e| syntax(text, source_name, &e))?;
    let source = Source { text, file: source_name };
    let (mut urdf_path, mut xml) = (None, None);
    let mut description = match (&robot.joint, &robot.body, &robot.urdf) {
        (Some(rows), None, None) => dh::build(&source, &robot, rows)?,
        (None, Some(bodies), None) => bodies::build(&source, bodies)?,
        (None, None, Some(file)) => {
            let folder = Path::new(source_name).parent().unwrap_or(Path::new(""));
            let path = folder.join(file.get_ref());
            urdf_path = Some(path.display().to_string());
            let read = Plain::read(&path)?;
            sources.extend(read.sources);
            let description = urdf::parse(&read.text, &read.name)?;
            xml = Some(read.text.into());
            description
        }
        (None, None, None) => {
            let expected = "one of the keys `joint`, `body`, `urdf`".to_owned();
            return Err(RobotFileError::Missing { at: source.place(0), owner: "robot".to_owned(), expected });
        }
        _ => {
            let at = source.place(0);
            let what = "a description (one of the keys `joint`, `body`, `urdf`)".to_owned();
            return Err(RobotFileError::Repeated { at, owner: "robot".to_owned(), what });
        }
    };
    check_dh_keys(&source, &robot)?;
    if let Some(name) = &robot.name {
        description.name.clone_from(name);
    }
    if let Some(gravity) = robot.gravity {
        description.gravity = gravity.map(|x| x.0);
    }
    description.floating_base = robot.floating_base;
    description.couple_mimics = robot.couple_mimics;
    floating::release(&source, &robot.floating, &mut description)?;
    let joints: Vec<&str> = description.joints.iter().map(|j| j.name.as_str()).collect();
    let elements = elements::build(&source, &robot, &joints, &description)?;
    for name in robot.actuated.iter().flatten() {
        source.known(name.span().start, "actuated", "joint", name.get_ref(), &joints)?;
    }
    let home = home::build(&source, &robot.home, &description)?;
    let closures = loops::build(&source, &robot.loops, &description)?;
    let actuated = robot.actuated.map(|names| names.into_iter().map(Spanned::into_inner).collect());
    let plain = RobotFile::plain(description, elements);
    Ok(RobotFile { actuated, home, closures, urdf: urdf_path, xml, sources, ..plain })
}

/// `dh` and `tool` belong to DH tables.
fn check_dh_keys(source: &Source<'_>, robot: &RobotToml) -> Result<(), RobotFileError> {
    let dh = robot.dh.as_ref().map(|x| ("dh", x.span().start));
    let tool = robot.tool.as_ref().map(|x| ("tool", x.span().start));
    match dh.or(tool) {
        Some((key, offset)) if robot.joint.is_none() => Err(RobotFileError::Value {
            at: source.place(offset),
            owner: "robot".to_owned(),
            field: key.to_owned(),
            expected: "this key only beside DH rows (`joint = [..]`)".to_owned(),
            found: key.to_owned(),
        }),
        _ => Ok(()),
    }
}

fn syntax(text: &str, file: &str, error: &toml::de::Error) -> RobotFileError {
    let at = Place::of(file, text, error.span().map_or(0, |s| s.start));
    let message = error.message().lines().collect::<Vec<_>>().join("; ");
    let message = dynid_files::input::toml_message(&message, text, error.span());
    RobotFileError::Syntax { at, message }
}

/// The text that spans refer to.
struct Source<'a> {
    text: &'a str,
    file: &'a str,
}

impl Source<'_> {
    fn place(&self, offset: usize) -> Place {
        Place::of(self.file, self.text, offset)
    }

    fn value(&self, offset: usize, owner: &str, field: &str, expected: &str, found: &str) -> RobotFileError {
        RobotFileError::Value {
            at: self.place(offset),
            owner: owner.to_owned(),
            field: field.to_owned(),
            expected: expected.to_owned(),
            found: excerpt(found),
        }
    }

    fn law(&self, offset: usize, name: &str, fault: Box<LawFault>) -> RobotFileError {
        RobotFileError::Law { at: self.place(offset), name: excerpt(name), fault }
    }

    fn known(
        &self,
        offset: usize,
        context: &str,
        kind: &'static str,
        name: &str,
        known: &[&str],
    ) -> Result<(), RobotFileError> {
        if known.contains(&name) {
            return Ok(());
        }
        Err(RobotFileError::UnknownName {
            at: self.place(offset),
            context: context.to_owned(),
            kind,
            name: excerpt(name),
            meant: closest(name, known).map(str::to_owned),
        })
    }

    /// The inertia that a row or body states: `phi`, or `mass`, `com`, `inertia_com`, or neither.
    fn inertia(
        &self,
        offset: usize,
        owner: &str,
        stated: &BodyInertia,
    ) -> Result<Option<Inertia>, RobotFileError> {
        let missing = |expected: &str| RobotFileError::Missing {
            at: self.place(offset),
            owner: owner.to_owned(),
            expected: expected.to_owned(),
        };
        let inertia = match (&stated.phi, &stated.mass, &stated.com, &stated.inertia_com) {
            (None, None, None, None) => return Ok(None),
            (Some(phi), None, None, None) => Inertia(phi.map(|x| x.0)),
            (Some(_), ..) => {
                let (at, owner) = (self.place(offset), owner.to_owned());
                let what = "an inertia (`phi`, or `mass` with `com` and `inertia_com`)".to_owned();
                return Err(RobotFileError::Repeated { at, owner, what });
            }
            (None, Some(mass), com, tensor) => {
                let [xx, xy, xz, yy, yz, zz] = tensor.unwrap_or_default().map(|x| x.0);
                let tensor = Mat3::from_rows([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]);
                Inertia::from_com(mass.0, Vec3(com.unwrap_or_default().map(|x| x.0)), &tensor)
            }
            (None, None, ..) => return Err(missing("`mass` beside `com` and `inertia_com`")),
        };
        if inertia.0.iter().all(|x| x.is_finite()) {
            Ok(Some(inertia))
        } else {
            Err(self.value(offset, owner, "inertia", "numbers that do not overflow", "too large numbers"))
        }
    }

    /// Names of rows or bodies, each once.
    fn unique<'n>(
        &self,
        kind: &'static str,
        names: impl Iterator<Item = (usize, &'n str)>,
    ) -> Result<(), RobotFileError> {
        let mut seen = std::collections::HashMap::new();
        for (offset, name) in names {
            if let Some(first) = seen.insert(name, offset) {
                let (at, first_line) = (self.place(offset), self.place(first).line);
                return Err(RobotFileError::Duplicate { at, kind, name: excerpt(name), first_line });
            }
        }
        Ok(())
    }
}
