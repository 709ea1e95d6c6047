//! Friction that follows reactions, of a robot file.

use dynid_model::{Description, JointDescription};
use serde::{Deserialize, Serialize};
use toml::{Table, Value};

use super::Source;
use super::number::number;
use super::schema::RobotToml;
use crate::robot_error::RobotFileError;

/// Key of such friction among the elements of a joint.
pub(super) const REACTION_FRICTION: &str = "reaction_friction";

/// What presses on a joint with friction: `F = Σ factor ‖components‖` and the steady force
/// `F_w = preload + |g| Σ share · mass`:
/// `[element.slider1] reaction_friction = { loads = [{ force = ["y"] }], weight = { slider1 = 1, platform = 0.7 } }`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct ReactionSpec {
    /// The joint.
    pub joint: String,
    /// Reactions that press on it; those of one entry press together.
    pub loads: Vec<ReactionLoad>,
    /// Links whose weight rests on it, and the share of it.
    pub weight: Vec<(String, f64)>,
    /// Steady force beside them, N, or N m where loads act on a radius.
    pub preload: f64,
}

/// Some components of the wrench in a joint, whose Euclidean length counts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct ReactionLoad {
    /// The joint whose wrench it is.
    pub joint: String,
    /// Components: 0 to 2 force along x, y, z of the joint's frame, 3 to 5 moment about them.
    pub components: Vec<usize>,
    /// Factor: 1, a radius (m) on which a force rubs, or the inverse of the arm (1/m) over which a moment is borne.
    pub factor: f64,
}

/// Flags that follow from what else is stated: joint, key, value.
pub(super) type Flag = (String, &'static str, bool);

/// Loads in the order of the joints, and flags (`stribeck`, `viscous`) that the file leaves to what else it states.
pub(super) fn build(
    source: &Source<'_>,
    robot: &RobotToml,
    description: &Description,
) -> Result<(Vec<ReactionSpec>, Vec<Flag>), RobotFileError> {
    let (mut out, mut flags) = (Vec::new(), Vec::new());
    for joint in &description.joints {
        let Some(element) = robot.element.get(&joint.name) else { continue };
        let Some(value) = element.get_ref().get(REACTION_FRICTION) else { continue };
        let keys = Keys {
            source,
            offset: element.span().start,
            owner: format!("element.{}", joint.name),
            description,
        };
        let Some(table) = value.as_table() else {
            return Err(keys.fault("", "a table with `loads`", &value.to_string()));
        };
        out.push(keys.spec(joint, table)?);
        flags.extend(keys.flags(joint, table)?);
    }
    Ok((out, flags))
}

/// Keys that are about loads; the others are settings as all elements have them.
pub(super) fn is_own(key: &str) -> bool {
    ["loads", "weight", "preload"].contains(&key)
}

/// The table of one joint.
struct Keys<'a> {
    source: &'a Source<'a>,
    offset: usize,
    owner: String,
    description: &'a Description,
}

impl Keys<'_> {
    fn fault(&self, key: &str, expected: &str, found: &str) -> RobotFileError {
        let point = if key.is_empty() { "" } else { "." };
        self.source.value(
            self.offset,
            &self.owner,
            &format!("{REACTION_FRICTION}{point}{key}"),
            expected,
            found,
        )
    }

    fn spec(&self, joint: &JointDescription, table: &Table) -> Result<ReactionSpec, RobotFileError> {
        let mut loads = Vec::new();
        if let Some(value) = table.get("loads") {
            let expected = "a list of tables such as `{ force = [\"y\"] }`";
            let list = value.as_array().ok_or_else(|| self.fault("loads", expected, &value.to_string()))?;
            for load in list {
                let load = load.as_table().ok_or_else(|| self.fault("loads", expected, &load.to_string()))?;
                loads.push(self.load(joint, load)?);
            }
        }
        let mut weight = Vec::new();
        if let Some(value) = table.get("weight") {
            let expected = "a table of links and shares such as `{ slider1 = 1 }`";
            let shares =
                value.as_table().ok_or_else(|| self.fault("weight", expected, &value.to_string()))?;
            for (link, share) in shares {
                if !self.description.links.iter().any(|l| l.name == *link) {
                    return Err(self.fault("weight", "a link of the robot", link));
                }
                weight.push((link.clone(), self.at_least_zero(&format!("weight.{link}"), share)?));
            }
        }
        let preload = table.get("preload").map_or(Ok(0.0), |value| self.at_least_zero("preload", value))?;
        if loads.is_empty() && weight.is_empty() && preload == 0.0 {
            let found = "none: friction that no load changes is `coulomb`";
            return Err(self.fault("", "`loads`, `weight` or `preload`", found));
        }
        Ok(ReactionSpec { joint: joint.name.clone(), loads, weight, preload })
    }

    fn load(&self, own: &JointDescription, table: &Table) -> Result<ReactionLoad, RobotFileError> {
        const KEYS: [&str; 5] = ["joint", "force", "moment", "radius", "arm"];
        if let Some(key) = table.keys().find(|key| !KEYS.contains(&key.as_str())) {
            return Err(self.fault("loads", &format!("keys `{}`", KEYS.join("`, `")), key));
        }
        let joint = match table.get("joint") {
            None => own,
            Some(value) => {
                let name = value.as_str().unwrap_or_default();
                let found = self.description.joints.iter().find(|j| j.name == name);
                found.ok_or_else(|| self.fault("loads.joint", "a joint of the robot", &value.to_string()))?
            }
        };
        let (first, value) = match (table.get("force"), table.get("moment")) {
            (Some(value), None) => (0, value),
            (None, Some(value)) => (3, value),
            _ => {
                return Err(self.fault(
                    "loads",
                    "either `force` or `moment`",
                    &Value::Table(table.clone()).to_string(),
                ));
            }
        };
        let (length, factor) = match (table.get("radius"), table.get("arm"), first) {
            (None, None, _) => (None, 1.0),
            (Some(radius), None, 0) => (Some("radius"), self.at_least_zero("loads.radius", radius)?),
            (None, Some(arm), 3) => (Some("arm"), self.at_least_zero("loads.arm", arm)?.recip()),
            _ => {
                let expected = "`radius` beside `force`, `arm` beside `moment`";
                return Err(self.fault("loads", expected, &Value::Table(table.clone()).to_string()));
            }
        };
        if let Some(key) = length.filter(|_| !(factor.is_finite() && factor > 0.0)) {
            return Err(self.fault(&format!("loads.{key}"), "a length above 0, m", &table[key].to_string()));
        }
        let axes = self.axes(joint, value)?;
        Ok(ReactionLoad {
            joint: joint.name.clone(),
            components: axes.iter().map(|a| first + a).collect(),
            factor,
        })
    }

    /// Axes of a joint's frame: a list of their names, `"axial"` along the joint's axis or `"radial"` across it.
    fn axes(&self, joint: &JointDescription, value: &Value) -> Result<Vec<usize>, RobotFileError> {
        let expected = "a list of `\"x\"`, `\"y\"`, `\"z\"` (the joint's frame), each once, or `\"axial\"` or `\"radial\"`";
        let fault = || self.fault("loads", expected, &value.to_string());
        if let Some(word) = value.as_str() {
            let size = joint.axis.iter().map(|x| x * x).sum::<f64>().sqrt();
            let along = (0..3).find(|k| joint.axis[*k].abs() > (1.0 - 1e-9) * size);
            let Some(along) = along.filter(|_| size > 0.0) else {
                let expected =
                    "components by name (`[\"x\", \"y\"]`), where the joint's axis is not one of its frame's";
                return Err(self.fault("loads", expected, word));
            };
            return match word {
                "axial" => Ok(vec![along]),
                "radial" => Ok((0..3).filter(|k| *k != along).collect()),
                _ => Err(fault()),
            };
        }
        let list = value.as_array().ok_or_else(fault)?;
        let mut out: Vec<usize> = Vec::new();
        for name in list {
            let axis =
                ["x", "y", "z"].iter().position(|axis| name.as_str() == Some(axis)).ok_or_else(fault)?;
            if out.contains(&axis) {
                return Err(fault());
            }
            out.push(axis);
        }
        if out.is_empty() { Err(fault()) } else { Ok(out) }
    }

    fn at_least_zero(&self, key: &str, value: &Value) -> Result<f64, RobotFileError> {
        number(value)
            .filter(|x| *x >= 0.0)
            .ok_or_else(|| self.fault(key, "a finite number, not negative", &value.to_string()))
    }

    /// Whether friction falls and grows with speed: as said, else if a value of such friction is stated.
    fn flags(&self, joint: &JointDescription, table: &Table) -> Result<Vec<Flag>, RobotFileError> {
        let mut out = Vec::new();
        for (flag, values) in [("stribeck", &["mu_s", "vs", "delta"][..]), ("viscous", &["mu_v"])] {
            let stated = values.iter().find(|key| table.contains_key(**key));
            match (table.get(flag), stated) {
                (Some(Value::Boolean(false)), Some(key)) => {
                    return Err(self.fault(
                        key,
                        &format!("no such value beside `{flag} = false`"),
                        &table[*key].to_string(),
                    ));
                }
                (Some(_), _) => {}
                (None, stated) => out.push((joint.name.clone(), flag, stated.is_some())),
            }
        }
        Ok(out)
    }
}
