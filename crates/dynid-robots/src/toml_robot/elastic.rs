//! Elastic joints of a robot file.

use toml::{Table, Value};

use super::Source;
use super::number::number;
use super::schema::RobotToml;
use crate::robot_error::RobotFileError;

/// Key of an elastic joint among its elements.
pub(super) const ELASTIC: &str = "elastic";

/// A joint that its motor drives through a spring, each with a measured position:
/// `[element.j1] elastic = { ratio = 100 }`.
#[derive(Clone, Debug, PartialEq)]
pub struct ElasticSpec {
    /// The joint.
    pub joint: String,
    /// Name of its motor. Default: `<joint>_motor`.
    pub motor: String,
    /// Travel of the motor over that of the joint with a stiff spring; finite and not 0.
    pub ratio: f64,
    /// Whether the spring has a cubic part. Default: true.
    pub cubic: bool,
    /// Whether it is damped. Default: whether `d` is stated.
    pub damping: bool,
    /// Whether a sensor behind the spring measures its torque. Default: false.
    pub sensor: bool,
    /// Stiffness `k1`, N m/rad or N/m, if stated.
    pub k1: Option<f64>,
    /// Cubic stiffness `k2`, N m/rad³ or N/m³, if stated.
    pub k2: Option<f64>,
    /// Damping `d`, N m s/rad or N s/m, if stated.
    pub d: Option<f64>,
}

impl ElasticSpec {
    /// Motor of a joint about whose name nothing is said.
    pub fn default_motor(joint: &str) -> String {
        format!("{joint}_motor")
    }
}

/// Elastic joints in the order of the robot's.
pub(super) fn build(
    source: &Source<'_>,
    robot: &RobotToml,
    joints: &[&str],
) -> Result<Vec<ElasticSpec>, RobotFileError> {
    let mut out: Vec<ElasticSpec> = Vec::new();
    for joint in joints {
        let Some(table) = robot.element.get(*joint) else { continue };
        let Some(value) = table.get_ref().get(ELASTIC) else { continue };
        let keys = Keys { source, offset: table.span().start, owner: format!("element.{joint}") };
        let spec = keys.spec(joint, value)?;
        let taken = joints.contains(&spec.motor.as_str()) || out.iter().any(|e| e.motor == spec.motor);
        if taken || spec.motor.is_empty() {
            return Err(keys.fault("motor", "a name that no joint and no other motor has", &spec.motor));
        }
        out.push(spec);
    }
    Ok(out)
}

/// The table of one elastic joint.
struct Keys<'a> {
    source: &'a Source<'a>,
    offset: usize,
    owner: String,
}

impl Keys<'_> {
    fn fault(&self, key: &str, expected: &str, found: &str) -> RobotFileError {
        let field = if key.is_empty() { ELASTIC.to_owned() } else { format!("{ELASTIC}.{key}") };
        self.source.value(self.offset, &self.owner, &field, expected, found)
    }

    fn spec(&self, joint: &str, value: &Value) -> Result<ElasticSpec, RobotFileError> {
        const KEYS: [&str; 8] = ["ratio", "motor", "cubic", "damping", "sensor", "k1", "k2", "d"];
        let expected = format!("a table with `{}`", KEYS.join("`, `"));
        let table = value.as_table().ok_or_else(|| self.fault("", &expected, &value.to_string()))?;
        if let Some(key) = table.keys().find(|key| !KEYS.contains(&key.as_str())) {
            return Err(self.fault("", &expected, key));
        }
        let ratio = self.number(table, "ratio")?.ok_or_else(|| RobotFileError::Missing {
            at: self.source.place(self.offset),
            owner: format!("{}: {ELASTIC}", self.owner),
            expected: "`ratio`, the travel of the motor over that of the joint".to_owned(),
        })?;
        if ratio == 0.0 {
            return Err(self.fault("ratio", "a number other than 0", "0"));
        }
        let (k1, k2, d) = (self.number(table, "k1")?, self.number(table, "k2")?, self.number(table, "d")?);
        for (key, value) in [("k1", k1), ("d", d)] {
            if let Some(x) = value.filter(|x| *x < 0.0) {
                return Err(self.fault(key, "a number from 0 on", &x.to_string()));
            }
        }
        let cubic = self.flag(table, "cubic")?.unwrap_or(true);
        let damping = self.flag(table, "damping")?.unwrap_or(d.is_some());
        for (key, stated, with, used) in
            [("k2", k2.is_some(), "cubic", cubic), ("d", d.is_some(), "damping", damping)]
        {
            if stated && !used {
                return Err(self.fault(key, &format!("no value beside `{with} = false`"), "one"));
            }
        }
        Ok(ElasticSpec {
            joint: joint.to_owned(),
            motor: self.text(table, "motor")?.unwrap_or_else(|| ElasticSpec::default_motor(joint)),
            ratio,
            cubic,
            damping,
            sensor: self.flag(table, "sensor")?.unwrap_or(false),
            k1,
            k2,
            d,
        })
    }

    fn number(&self, table: &Table, key: &str) -> Result<Option<f64>, RobotFileError> {
        let of = |v: &Value| number(v).ok_or_else(|| self.fault(key, "a finite number", &v.to_string()));
        table.get(key).map(of).transpose()
    }

    fn flag(&self, table: &Table, key: &str) -> Result<Option<bool>, RobotFileError> {
        let of = |v: &Value| v.as_bool().ok_or_else(|| self.fault(key, "true or false", &v.to_string()));
        table.get(key).map(of).transpose()
    }

    fn text(&self, table: &Table, key: &str) -> Result<Option<String>, RobotFileError> {
        let of = |v: &Value| {
            v.as_str().map(str::to_owned).ok_or_else(|| self.fault(key, "a name", &v.to_string()))
        };
        table.get(key).map(of).transpose()
    }
}
