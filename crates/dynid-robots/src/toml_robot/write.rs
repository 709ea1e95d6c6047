//! The loops of a robot whose tree is in a URDF, written.

use std::fmt::Write as _;

use dynid_model::closed::{ClosureDescription, Condition, CutKind, LinkFrame};

/// What a URDF cannot state of a mechanism with loops.
#[derive(Clone, Copy, Debug)]
pub struct Loops<'a> {
    /// Name of the robot.
    pub name: &'a str,
    /// The URDF, relative to the file to be written.
    pub urdf: &'a str,
    /// Gravity, m/s², base axes.
    pub gravity: [f64; 3],
    /// Cut joints.
    pub closures: &'a [ClosureDescription],
    /// Driven joints.
    pub driven: &'a [String],
    /// Home position by joint.
    pub home: &'a [(String, Vec<f64>)],
}

impl Loops<'_> {
    /// A robot in TOML that [`parse`](super::parse) reads: the URDF with its loops.
    pub fn to_toml(&self) -> String {
        let mut out = String::new();
        let names: Vec<String> = self.driven.iter().map(|n| text(n)).collect();
        let positions = |values: &[f64]| match values {
            [one] => format!("{one:?}"),
            more => format!("{more:?}"),
        };
        let home: Vec<String> =
            self.home.iter().map(|(name, q)| format!("{} = {}", text(name), positions(q))).collect();
        let _ = writeln!(out, "schema = 1\nname = {}\nurdf = {}", text(self.name), text(self.urdf));
        let _ = writeln!(out, "gravity = {:?}", self.gravity);
        let _ = writeln!(out, "actuated = [{}]", names.join(", "));
        let _ = writeln!(out, "home = {{ {} }}", home.join(", "));
        for closure in self.closures {
            let _ = writeln!(out, "\n[[loop]]\nname = {}", text(&closure.name));
            match &closure.condition {
                Condition::Joint { kind, a, b } => {
                    let _ = writeln!(out, "kind = {}", text(kind.name()));
                    frame(&mut out, "a", a);
                    frame(&mut out, "b", b);
                    if let CutKind::Distance { length } = kind {
                        let _ = writeln!(out, "length = {length:?}");
                    }
                }
                Condition::Coordinates { terms, constant } => {
                    let terms: Vec<String> =
                        terms.iter().map(|(joint, factor)| format!("{} = {factor:?}", text(joint))).collect();
                    let _ = writeln!(
                        out,
                        "kind = \"coordinate\"\nterms = {{ {} }}\nconstant = {constant:?}",
                        terms.join(", ")
                    );
                }
            }
        }
        out
    }
}

fn frame(out: &mut String, side: &str, frame: &LinkFrame) {
    let _ = writeln!(out, "{side} = {}", text(&frame.link));
    let _ = writeln!(out, "{side}_xyz = {:?}", frame.placement.translation.0);
    let _ = writeln!(out, "{side}_rpy = {:?}", frame.placement.rotation.to_rpy());
}

fn text(value: &str) -> String {
    toml::Value::String(value.to_owned()).to_string()
}
