//! What closes loops, as equality constraints of MJCF.

use std::collections::HashMap;

use dynid_model::closed::{ClosureDescription, Condition, CutKind, LinkFrame};
use dynid_model::{Placement, Vec3};
use quick_xml::escape::escape;

use super::unwritable;
use crate::robot_error::RobotFileError;

/// Distance between the two points that make the axis of a revolute joint, m.
const AXIS: f64 = 0.1;

/// What closes the loops of a mechanism, and how it starts.
#[derive(Clone, Copy, Debug)]
pub struct Loops<'a> {
    /// Cut joints and couplings.
    pub closures: &'a [ClosureDescription],
    /// Driven joints.
    pub driven: &'a [String],
    /// A closed pose: positions of all joints by name.
    pub home: &'a [(String, Vec<f64>)],
}

/// Constraints and the sites on links that they hold together.
#[derive(Debug, Default)]
pub(super) struct Constraints<'a> {
    /// Sites by link: name and place.
    pub(super) sites: HashMap<&'a str, Vec<(String, Placement)>>,
    /// Elements of `<equality>`.
    pub(super) lines: Vec<String>,
}

impl<'a> Loops<'a> {
    /// # Errors
    /// [`RobotFileError::Unwritable`] for a cut joint that MJCF has no constraint for.
    pub(super) fn constraints(&self) -> Result<Constraints<'a>, RobotFileError> {
        let mut out = Constraints::default();
        for closure in self.closures {
            let name = closure.name.as_str();
            match &closure.condition {
                Condition::Coordinates { terms, constant } => match &terms[..] {
                    [(first, f), (second, g)] if *f != 0.0 => {
                        let names = [("name", name), ("joint1", first.as_str()), ("joint2", second.as_str())];
                        let polynomial = format!(" polycoef=\"{:?} {:?} 0 0 0\"", constant / f, -g / f);
                        out.line("joint", &names, &polynomial);
                    }
                    _ => return Err(refused(name, "couples more than two joints")),
                },
                Condition::Joint { kind, a, b } => match kind {
                    CutKind::Spherical | CutKind::PlanarRevolute => out.connect(name, (a, b), Vec3::zero()),
                    CutKind::Revolute => {
                        out.connect(name, (a, b), Vec3::zero());
                        out.connect(&format!("{name}.axis"), (a, b), Vec3([0.0, 0.0, AXIS]));
                    }
                    CutKind::Fixed => {
                        let [one, two] = out.sites(name, (a, b), Vec3::zero());
                        out.line(
                            "weld",
                            &[("name", name), ("site1", one.as_str()), ("site2", two.as_str())],
                            "",
                        );
                    }
                    _ => {
                        let why = format!("is a `{}` joint, which MJCF has no constraint for", kind.name());
                        return Err(refused(name, &why));
                    }
                },
            }
        }
        Ok(out)
    }
}

impl<'a> Constraints<'a> {
    fn line(&mut self, element: &str, names: &[(&str, &str)], more: &str) {
        let names: String = names.iter().map(|(key, name)| format!(" {key}=\"{}\"", escape(*name))).collect();
        self.lines.push(format!("<{element}{names}{more}/>"));
    }

    /// Sites at a point of both frames.
    fn sites(&mut self, name: &str, (a, b): (&'a LinkFrame, &'a LinkFrame), point: Vec3<f64>) -> [String; 2] {
        [(a, "a"), (b, "b")].map(|(frame, side)| {
            let site = format!("{name}.{side}");
            let Placement { rotation, translation } = frame.placement;
            let place = Placement { rotation, translation: translation + rotation.mul_vec(point) };
            self.sites.entry(frame.link.as_str()).or_default().push((site.clone(), place));
            site
        })
    }

    fn connect(&mut self, name: &str, frames: (&'a LinkFrame, &'a LinkFrame), point: Vec3<f64>) {
        let [one, two] = self.sites(name, frames, point);
        self.line("connect", &[("name", name), ("site1", one.as_str()), ("site2", two.as_str())], "");
    }
}

fn refused(name: &str, why: &str) -> RobotFileError {
    unwritable("loop", name, format!("it {why}"))
}
