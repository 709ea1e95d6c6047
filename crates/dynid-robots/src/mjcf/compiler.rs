//! `<compiler>` and `<option>`: what the numbers of a model mean, and what acts besides its bodies.

use dynid_model::description::STANDARD_GRAVITY;

use super::document::{Document, Element};
use super::fields::Fields;
use crate::robot_error::RobotFileError;

/// Whether inertias come from shapes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum FromGeoms {
    Never,
    /// Where a body states none.
    Missing,
    Always,
}

/// How numbers of a model are meant.
#[derive(Debug)]
pub(super) struct Compiler<'a> {
    degree: bool,
    /// Axes of the three turns, lower case about turned axes, upper case about those that stand.
    pub(super) euler: [u8; 3],
    pub(super) limits_follow_ranges: bool,
    pub(super) from_geoms: FromGeoms,
    /// Groups of shapes that count.
    pub(super) groups: [f64; 2],
    pub(super) balance: bool,
    pub(super) least_mass: f64,
    pub(super) least_inertia: f64,
    /// Mass of all bodies together, if it is given.
    pub(super) total_mass: Option<f64>,
    pub(super) mesh_folder: &'a str,
    pub(super) strip_path: bool,
    pub(super) aligns_free: bool,
    pub(super) elements: Vec<&'a Element>,
}

impl<'a> Compiler<'a> {
    /// The settings of all `<compiler>` elements, later ones before earlier ones.
    pub(super) fn of(document: &'a Document) -> Result<Self, RobotFileError> {
        let elements: Vec<&Element> = document.sections("compiler").collect();
        let mut compiler = Compiler {
            degree: true,
            euler: *b"xyz",
            limits_follow_ranges: true,
            from_geoms: FromGeoms::Missing,
            groups: [0.0, 5.0],
            balance: false,
            least_mass: 0.0,
            least_inertia: 0.0,
            total_mass: None,
            mesh_folder: "",
            strip_path: false,
            aligns_free: false,
            elements,
        };
        let Some((last, earlier)) = compiler.elements.split_last() else { return Ok(compiler) };
        let fields = Fields::new(document, last, earlier.iter().rev().copied().collect());
        match fields.text("angle") {
            None | Some("degree") => {}
            Some("radian") => compiler.degree = false,
            Some(_) => return Err(fields.value("angle", "degree or radian")),
        }
        if let Some(sequence) = fields.text("eulerseq") {
            let axes: Option<[u8; 3]> = sequence.as_bytes().try_into().ok();
            let known = axes.filter(|a| a.iter().all(|c| b"xyzXYZ".contains(c)));
            compiler.euler = known.ok_or_else(|| fields.value("eulerseq", "three letters of xyz or XYZ"))?;
        }
        compiler.from_geoms = match fields.text("inertiafromgeom") {
            None | Some("auto") => FromGeoms::Missing,
            Some("true") => FromGeoms::Always,
            Some("false") => FromGeoms::Never,
            Some(_) => return Err(fields.value("inertiafromgeom", "true, false or auto")),
        };
        if fields.text("coordinate") == Some("global") {
            let reason = "`coordinate=\"global\"` is no longer a part of MJCF";
            let hint = "save the model with a MuJoCo before 2.3.4, whose files have local coordinates";
            return Err(fields.refuse("coordinate", reason, hint));
        }
        if let Some(groups) = fields.numbers("inertiagrouprange")? {
            compiler.groups = groups;
        }
        compiler.limits_follow_ranges = fields.flag("autolimits")?.unwrap_or(true);
        compiler.balance = fields.flag("balanceinertia")?.unwrap_or(false);
        compiler.strip_path = fields.flag("strippath")?.unwrap_or(false);
        compiler.aligns_free = fields.flag("alignfree")?.unwrap_or(false);
        compiler.least_mass = fields.not_negative("boundmass", fields.number("boundmass", 0.0)?)?;
        compiler.least_inertia = fields.not_negative("boundinertia", fields.number("boundinertia", 0.0)?)?;
        compiler.total_mass = fields.numbers("settotalmass")?.map(|[m]| m).filter(|m| *m > 0.0);
        compiler.mesh_folder = fields.text("meshdir").or(fields.text("assetdir")).unwrap_or("");
        Ok(compiler)
    }

    /// An angle of the file in rad.
    pub(super) fn angle(&self, x: f64) -> f64 {
        if self.degree { x.to_radians() } else { x }
    }

    /// Whether stated inertias are used as they stand.
    pub(super) fn takes_inertias_as_stated(&self) -> bool {
        self.from_geoms != FromGeoms::Always
            && !self.balance
            && self.least_mass == 0.0
            && self.least_inertia == 0.0
            && self.total_mass.is_none()
    }
}

/// What acts on all bodies.
#[derive(Debug)]
pub(super) struct Options {
    pub(super) gravity: [f64; 3],
    /// Whether `<equality>` holds.
    pub(super) equalities: bool,
    pub(super) springs: bool,
    pub(super) dampers: bool,
    pub(super) friction: bool,
}

impl Options {
    pub(super) fn of(document: &Document) -> Result<Self, RobotFileError> {
        let mut options = Options {
            gravity: STANDARD_GRAVITY,
            equalities: true,
            springs: true,
            dampers: true,
            friction: true,
        };
        let mut without_gravity = false;
        for element in document.sections("option") {
            let fields = Fields::alone(document, element);
            if let Some(gravity) = fields.numbers("gravity")? {
                options.gravity = gravity;
            }
            for key in ["density", "viscosity"] {
                if fields.number(key, 0.0)? != 0.0 {
                    let reason =
                        format!("`{key}` of a medium acts on the bodies, and no medium is known here");
                    return Err(fields.refuse(
                        key,
                        reason,
                        "remove the attribute, if the robot moves in air",
                    ));
                }
            }
            for flag in element.children.iter().filter(|c| c.name == "flag") {
                let off = |key: &str| flag.text(key) == Some("disable");
                without_gravity |= off("gravity");
                options.equalities &= !(off("equality") || off("constraint"));
                options.friction &= !(off("frictionloss") || off("constraint"));
                options.springs &= !(off("spring") || off("passive"));
                options.dampers &= !(off("damper") || off("passive"));
            }
        }
        if without_gravity {
            options.gravity = [0.0; 3];
        }
        Ok(options)
    }
}
