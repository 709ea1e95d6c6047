//! The elements inside a body, with `<frame>` and `<replicate>` resolved.

use dynid_model::{Placement, Vec3};

use super::FLATTEN;
use super::compiler::Compiler;
use super::defaults::Defaults;
use super::document::{Document, Element};
use super::fields::Fields;
use super::orientation::{euler, placement};
use crate::robot_error::RobotFileError;

/// Most bodies, joints, shapes and frames of a model, copies counted.
const MAX_PARTS: usize = 100_000;

/// What stands around an element: class, frames, and the suffix of copies.
#[derive(Clone, Debug)]
pub(super) struct Around {
    pub(super) class: Option<usize>,
    pub(super) frame: Placement,
    pub(super) suffix: String,
    pub(super) copied: bool,
}

impl Around {
    pub(super) fn nothing() -> Self {
        Around { class: None, frame: Placement::identity(), suffix: String::new(), copied: false }
    }
}

/// An element of a body with what stands around it.
pub(super) struct Part<'a> {
    pub(super) element: &'a Element,
    pub(super) around: Around,
}

/// What finds the elements of bodies, and counts them.
pub(super) struct Parts<'w, 'a> {
    pub(super) document: &'a Document,
    pub(super) compiler: &'w Compiler<'a>,
    pub(super) defaults: &'w Defaults<'a>,
    /// Elements found so far.
    pub(super) count: usize,
}

impl<'a> Parts<'_, 'a> {
    /// Elements inside a body, frames and copies resolved.
    pub(super) fn inside(
        &mut self,
        holder: &'a Element,
        around: &Around,
    ) -> Result<Vec<Part<'a>>, RobotFileError> {
        let mut out = Vec::new();
        self.collect(holder, around, &mut out)?;
        Ok(out)
    }

    fn collect(
        &mut self,
        holder: &'a Element,
        around: &Around,
        out: &mut Vec<Part<'a>>,
    ) -> Result<(), RobotFileError> {
        for element in &holder.children {
            self.counted(element)?;
            let fields = Fields::alone(self.document, element);
            match element.name.as_str() {
                "frame" => {
                    let inner = Around {
                        class: self.defaults.class(element, "childclass")?.or(around.class),
                        frame: around.frame.then(&placement(&fields, self.compiler)?),
                        ..around.clone()
                    };
                    self.collect(element, &inner, out)?;
                }
                "replicate" => self.copies(element, &fields, around, out)?,
                "body" | "joint" | "freejoint" | "inertial" | "geom" | "site" => {
                    out.push(Part { element, around: around.clone() });
                }
                "camera" | "light" => {}
                "attach" | "composite" | "flexcomp" => {
                    let reason = "it stands for bodies that MuJoCo makes";
                    return Err(fields.refuse("", reason, FLATTEN));
                }
                "plugin" => {
                    let reason = "a plugin acts on the body by forces that are not known here";
                    return Err(fields.refuse("", reason, "remove it, if the robot does not need it"));
                }
                _ => {
                    let reason = "MJCF has no such element inside a body";
                    return Err(fields.refuse("", reason, "correct its name"));
                }
            }
        }
        Ok(())
    }

    fn counted(&mut self, element: &Element) -> Result<(), RobotFileError> {
        self.count += 1;
        if self.count <= MAX_PARTS {
            return Ok(());
        }
        let what = "bodies, joints, shapes and frames";
        Err(RobotFileError::TooMany { at: self.document.place(element, 0), what, limit: MAX_PARTS })
    }

    /// The copies of a `<replicate>`.
    fn copies(
        &mut self,
        element: &'a Element,
        fields: &Fields<'a>,
        around: &Around,
        out: &mut Vec<Part<'a>>,
    ) -> Result<(), RobotFileError> {
        let expected = format!("a whole number from 1 to {MAX_PARTS}");
        let count = fields.text("count").and_then(|c| c.trim().parse::<usize>().ok());
        let count =
            count.filter(|c| (1..=MAX_PARTS).contains(c)).ok_or_else(|| fields.value("count", expected))?;
        let (offset, angles) = (fields.vector("offset")?, fields.numbers("euler")?.unwrap_or_default());
        let width = count.to_string().len();
        let separator = fields.text("sep").unwrap_or("");
        let mut at = Vec3::zero();
        for k in 0..count {
            self.counted(element)?;
            let rotation = euler(angles.map(|a| a * k as f64), self.compiler);
            let inner = Around {
                class: self.defaults.class(element, "childclass")?.or(around.class),
                frame: around.frame.then(&Placement { rotation, translation: at }),
                suffix: format!("{separator}{k:0width$}{}", around.suffix),
                copied: true,
            };
            self.collect(element, &inner, out)?;
            at = at + rotation.mul_vec(offset);
        }
        Ok(())
    }
}
