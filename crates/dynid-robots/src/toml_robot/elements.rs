//! What a robot file says about elements at joints, in plain words and numbers.
//!
//! Which elements exist and which settings they take is decided by those who build them.

use dynid_files::excerpt::excerpt;
use dynid_model::Description;
use dynid_model::element::ElementRegistry;
use toml::Value;

use super::Source;
use super::clearance::{self, ClearanceSpec};
use super::elastic::{self, ElasticSpec};
use super::number::number;
use super::reaction::{self, ReactionSpec};
use super::schema::{CouplingForm, RobotToml};
use crate::law::with_laws;
use crate::robot_error::RobotFileError;
use crate::tie::TieSpec;

/// All elements of a joint, and those that it has beside the defaults.
const LIST: &str = "elements";
const BESIDE: &str = "beside";

/// Elements, their settings, and transmissions that couple joints.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ElementSpec {
    /// Elements of every moving joint: `[defaults] elements`.
    pub defaults: Vec<String>,
    /// Elements of single joints in place of the defaults: `[element.<joint>] elements`.
    pub per_joint: Vec<(String, Vec<String>)>,
    /// Elements of joints that have no list of their own, beside the defaults: `[element.<joint>] beside`, and springs that an MJCF or an SDF
    /// states.
    pub beside: Vec<(String, String)>,
    /// Settings of elements: the other keys of `[element.<joint>]`.
    pub settings: Vec<ElementSetting>,
    /// Couplings: `[[coupling]]`.
    pub couplings: Vec<CouplingSpec>,
    /// Elastic joints: `[element.<joint>] elastic = { .. }`, in joint order.
    pub elastic: Vec<ElasticSpec>,
    /// Joints with clearance: `[element.<joint>] clearance = { .. }`, in joint order.
    pub clearance: Vec<ClearanceSpec>,
    /// What presses on joints whose friction follows it: `[element.<joint>] reaction_friction = { loads = [..] }`, in joint order.
    pub reactions: Vec<ReactionSpec>,
    /// Parameters that are known, or multiples or sums of others: `[[tie]]`.
    pub ties: Vec<TieSpec>,
    /// The kinds of elements that these names and settings are of. A file knows those that come with the library; a program
    /// may put others in their place.
    pub registry: ElementRegistry,
}

impl ElementSpec {
    /// The elements with journals that sit in the centres of their bearings: no joint has clearance.
    #[must_use]
    pub fn with_ideal_bearings(&self) -> ElementSpec {
        ElementSpec { clearance: Vec::new(), ..self.clone() }
    }
}

/// One setting: `[element.j1] stribeck = { vs = { start = 0.04 } }` has element `stribeck`, key `vs.start`.
#[derive(Clone, Debug, PartialEq)]
pub struct ElementSetting {
    /// Joint.
    pub joint: String,
    /// Element.
    pub element: String,
    /// Path of keys joined by points; empty if the element's key holds the value itself.
    pub key: String,
    /// Value.
    pub value: SettingValue,
}

/// Value of an element's setting.
#[derive(Clone, Debug, PartialEq)]
pub enum SettingValue {
    /// Number, finite.
    Number(f64),
    /// Text.
    Text(String),
    /// True or false.
    Flag(bool),
    /// Numbers, all finite.
    Numbers(Vec<f64>),
    /// Texts.
    Texts(Vec<String>),
}

/// A transmission: `q_motor = matrix · q_joint`, `effort_joint = matrixᵀ · effort_motor`.
#[derive(Clone, Debug, PartialEq, serde::Serialize, schemars::JsonSchema)]
pub struct CouplingSpec {
    /// Names of the motors, one per row.
    pub motors: Vec<String>,
    /// Joints, one per column.
    pub joints: Vec<String>,
    /// Rows of the matrix.
    pub matrix: Vec<Vec<f64>>,
    /// Which parameters stand for the motors' side.
    pub form: CouplingForm,
}

pub(super) fn build(
    source: &Source<'_>,
    robot: &RobotToml,
    joints: &[&str],
    description: &Description,
) -> Result<ElementSpec, RobotFileError> {
    let mut spec = ElementSpec { defaults: robot.defaults.elements.clone(), ..ElementSpec::default() };
    for (name, law) in &robot.law {
        let (offset, law) = (law.span().start, law.get_ref().clone());
        let laws = [(name.clone(), law)].into();
        spec.registry =
            with_laws(spec.registry, &laws).map_err(|(name, fault)| source.law(offset, &name, fault))?;
    }
    spec.elastic = elastic::build(source, robot, joints)?;
    spec.clearance = clearance::build(source, robot, description)?;
    let (reactions, flags) = reaction::build(source, robot, description)?;
    spec.reactions = reactions;
    spec.settings.extend(flags.into_iter().map(|(joint, key, flag)| ElementSetting {
        joint,
        element: reaction::REACTION_FRICTION.to_owned(),
        key: key.to_owned(),
        value: SettingValue::Flag(flag),
    }));
    let motors = spec.elastic.iter().map(|e| e.motor.as_str());
    let owners: Vec<&str> = joints.iter().copied().chain(motors).collect();
    for (joint, table) in &robot.element {
        let offset = table.span().start;
        source.known(offset, "element", "joint", joint, &owners)?;
        for (element, value) in table.get_ref() {
            let is_joint = joints.contains(&joint.as_str());
            if is_joint && (element == elastic::ELASTIC || element == clearance::CLEARANCE) {
                continue;
            }
            if element == clearance::CLEARANCE {
                let owner = format!("element.{joint}");
                return Err(source.value(offset, &owner, element, "a joint that turns", "a motor"));
            }
            if element == reaction::REACTION_FRICTION
                && let (true, Some(table)) = (is_joint, value.as_table())
            {
                let plain = table.iter().filter(|(key, _)| !reaction::is_own(key));
                let plain = plain.map(|(key, value)| (key.clone(), value.clone())).collect();
                let mut path = Path { source, offset, joint, element, out: &mut spec.settings };
                path.flatten("", &Value::Table(plain))?;
            } else if element == LIST || element == BESIDE {
                if element == BESIDE && table.get_ref().contains_key(LIST) {
                    let owner = format!("element.{joint}");
                    let expected = "no list of all elements of the joint beside it";
                    return Err(source.value(offset, &owner, BESIDE, expected, "`elements`"));
                }
                let list = value.as_array().and_then(|a| texts(a));
                let list = list.ok_or_else(|| {
                    let owner = format!("element.{joint}");
                    source.value(offset, &owner, element, "a list of names", &value.to_string())
                })?;
                match element.as_str() {
                    BESIDE => spec.beside.extend(list.into_iter().map(|name| (joint.clone(), name))),
                    _ => spec.per_joint.push((joint.clone(), list)),
                }
            } else {
                let mut path = Path { source, offset, joint, element, out: &mut spec.settings };
                path.flatten("", value)?;
            }
        }
    }
    for coupling in &robot.coupling {
        let (offset, c) = (coupling.span().start, coupling.get_ref());
        for joint in &c.joints {
            source.known(offset, "coupling", "joint", joint, joints)?;
        }
        let rows_fit = c.matrix.len() == c.motors.len();
        if c.motors.is_empty() || !rows_fit || c.matrix.iter().any(|r| r.len() != c.joints.len()) {
            let expected = format!("{} rows (motors) of {} numbers (joints)", c.motors.len(), c.joints.len());
            let rows: Vec<usize> = c.matrix.iter().map(Vec::len).collect();
            let found = format!("rows of {rows:?} numbers");
            return Err(source.value(offset, "coupling", "matrix", &expected, &found));
        }
        spec.couplings.push(CouplingSpec {
            motors: c.motors.clone(),
            joints: c.joints.clone(),
            matrix: c.matrix.iter().map(|r| r.iter().map(|x| x.0).collect()).collect(),
            form: c.form,
        });
    }
    let motors = robot.coupling.iter().flat_map(|c| c.get_ref().motors.iter().map(String::as_str));
    let links = description.links.iter().map(|link| link.name.as_str());
    let owners: Vec<&str> = owners.into_iter().chain(motors).chain(links).collect();
    for tie in &robot.tie {
        let (offset, tie) = (tie.span().start, tie.get_ref());
        tie.check().map_err(|e| source.value(offset, "tie", e.key, e.expected, &e.found))?;
        if let Some(name) = tie.unknown(&owners) {
            source.known(offset, "tie", "joint, link or parameter of one", name, &owners)?;
        }
        spec.ties.push(tie.clone());
    }
    Ok(spec)
}

fn texts(list: &[Value]) -> Option<Vec<String>> {
    list.iter().map(|v| v.as_str().map(str::to_owned)).collect()
}

/// Flattens nested tables of settings.
struct Path<'a, 'o> {
    source: &'a Source<'a>,
    offset: usize,
    joint: &'a str,
    element: &'a str,
    out: &'o mut Vec<ElementSetting>,
}

impl Path<'_, '_> {
    fn flatten(&mut self, key: &str, value: &Value) -> Result<(), RobotFileError> {
        let setting = match value {
            // TOML's parser bounds the nesting, and with it this recursion.
            Value::Table(table) => {
                for (inner, value) in table {
                    let path = if key.is_empty() { inner.clone() } else { format!("{key}.{inner}") };
                    self.flatten(&path, value)?;
                }
                return Ok(());
            }
            Value::Integer(_) | Value::Float(_) => number(value).map(SettingValue::Number),
            Value::String(text) => Some(SettingValue::Text(text.clone())),
            Value::Boolean(flag) => Some(SettingValue::Flag(*flag)),
            Value::Array(list) => {
                let numbers: Option<Vec<f64>> = list.iter().map(number).collect();
                numbers.map(SettingValue::Numbers).or_else(|| texts(list).map(SettingValue::Texts))
            }
            Value::Datetime(_) => None,
        };
        let Some(setting) = setting else {
            let owner = format!("element.{}", excerpt(self.joint));
            let field =
                if key.is_empty() { self.element.to_owned() } else { format!("{}.{key}", self.element) };
            let expected = "finite numbers, texts, true or false, or lists of numbers or texts";
            return Err(self.source.value(self.offset, &owner, &field, expected, &value.to_string()));
        };
        self.out.push(ElementSetting {
            joint: self.joint.to_owned(),
            element: self.element.to_owned(),
            key: key.to_owned(),
            value: setting,
        });
        Ok(())
    }
}
