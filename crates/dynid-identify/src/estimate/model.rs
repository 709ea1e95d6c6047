//! The model in the result file, from which efforts can be predicted again.

use std::collections::BTreeMap;
use std::sync::Arc;

use dynid_model::element::ElementRegistry;
use dynid_model::{
    Description, Inertia, JointDescription, JointKind, Limits, LinkDescription, Mat3, Mechanism, Mimic,
    Placement, Vec3,
};
use dynid_robots::{
    ClearanceSpec, ClearanceValue, CouplingForm, CouplingSpec, ElasticSpec, ElementSetting, ElementSpec,
    LawSpec, ReactionSpec, RobotFile, SettingValue, TieSpec,
};
use serde::{Deserialize, Serialize};

use super::loops::LoopsRecord;
use crate::Error;
use crate::elements::ElementPlan;
use crate::known_friction::KnownFriction;

/// Robot, elements and settings that predictions need.
#[derive(Debug, Clone, Serialize, Deserialize, schemars::JsonSchema)]
pub struct ModelRecord {
    /// Gravity, m/s².
    pub gravity: [f64; 3],
    /// Floating base under the root link.
    pub floating_base: bool,
    /// Mimic joints follow their leaders.
    pub couple_mimics: bool,
    /// Links: name, and the inertia of the robot file.
    pub links: Vec<LinkRecord>,
    /// Joints.
    pub joints: Vec<JointRecord>,
    /// Cut joints that close loops, if there are some.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub loops: Option<LoopsRecord>,
    /// Element names per effort; per rate of the tree where loops are closed.
    pub elements: Vec<Vec<String>>,
    /// Laws of friction among these elements that formulas state, by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub laws: BTreeMap<String, LawSpec>,
    /// Couplings.
    pub couplings: Vec<CouplingRecord>,
    /// Joints that motors drive through springs; their stiffness is among the parameters.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub elastic: Vec<ElasticRecord>,
    /// What presses on joints whose friction follows it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub reactions: Vec<ReactionSpec>,
    /// Joints with clearance whose journals move in their bearings.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub clearance: Vec<ClearanceRecord>,
    /// Parameters that are known, or multiples or sums of others.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub ties: Vec<TieSpec>,
    /// Settings of elements that are numbers or flags: joint, element, key, value.
    pub element_settings: Vec<(String, String, String, SettingRecord)>,
    /// Standard parameters of all bodies whose rigid effort loads the gears of `load` elements; absent: those of the links.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub load_reference: Option<Vec<f64>>,
    /// Friction whose effort is known; coefficients of friction among the parameters of these joints are its errors.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub known_friction: Vec<KnownFriction>,
    /// Cut-off of the state filter, Hz.
    pub state_hz: f64,
    /// Cut-off of the widest kernel, Hz.
    pub kernel_hz: f64,
    /// The kinds of elements that the names are of; no part of the file. A program with elements of its own puts them here before it
    /// asks for the model of an estimate that was read.
    #[serde(skip)]
    pub registry: ElementRegistry,
}

/// A joint with clearance.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct ClearanceRecord {
    /// Joint.
    pub joint: String,
    /// What its robot file states under `clearance`.
    pub keys: BTreeMap<String, ClearanceValue>,
}

/// A joint that its motor drives through a spring.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct ElasticRecord {
    /// Joint.
    pub joint: String,
    /// Motor of the joint, an effort of its own.
    pub motor: String,
    /// Travel of the motor over that of the joint with a stiff spring.
    pub ratio: f64,
    /// The spring has a cubic part, `<joint>.k2`.
    pub cubic: bool,
    /// Whether the spring is damped, `<joint>.d`.
    pub damping: bool,
    /// A sensor behind the spring measures its torque; efforts of the joint are the negative readings.
    pub sensor: bool,
}

impl ElasticRecord {
    pub(crate) fn new(e: &ElasticSpec) -> Self {
        ElasticRecord {
            joint: e.joint.clone(),
            motor: e.motor.clone(),
            ratio: e.ratio,
            cubic: e.cubic,
            damping: e.damping,
            sensor: e.sensor,
        }
    }

    pub(crate) fn spec(&self) -> Result<ElasticSpec, Error> {
        if !(self.ratio.is_finite() && self.ratio != 0.0) {
            return Err(Error::setting("elastic.ratio", "a finite number other than 0", self.ratio));
        }
        let (k1, k2, d) = (None, None, None);
        let ElasticRecord { joint, motor, ratio, cubic, damping, sensor } = self.clone();
        Ok(ElasticSpec { joint, motor, ratio, cubic, damping, sensor, k1, k2, d })
    }
}

/// Value of an element's setting.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(untagged)]
pub enum SettingRecord {
    /// A number.
    Number(f64),
    /// True or false.
    Flag(bool),
}

/// A link.
#[derive(Debug, Clone, Serialize, Deserialize, schemars::JsonSchema)]
pub struct LinkRecord {
    /// Name.
    pub name: String,
    /// Ten standard parameters, if the file states them.
    pub phi: Option<[f64; 10]>,
}

dynid_record::words! {
    /// Kind of a joint.
    JointType {
        /// Rotation about the axis within limits.
        Revolute = "revolute",
        /// Rotation about the axis without limits.
        Continuous = "continuous",
        /// Translation along the axis.
        Prismatic = "prismatic",
        /// Rotation about the axis and translation along it together.
        Helical = "helical",
        /// Six degrees of freedom.
        Floating = "floating",
        /// No motion.
        Fixed = "fixed",
    }
}

impl From<JointKind> for JointType {
    fn from(kind: JointKind) -> Self {
        match kind {
            JointKind::Revolute => JointType::Revolute,
            JointKind::Continuous => JointType::Continuous,
            JointKind::Prismatic => JointType::Prismatic,
            JointKind::Helical { .. } => JointType::Helical,
            JointKind::Floating => JointType::Floating,
            JointKind::Fixed => JointType::Fixed,
        }
    }
}

/// A joint.
#[derive(Debug, Clone, Serialize, Deserialize, schemars::JsonSchema)]
pub struct JointRecord {
    /// Name.
    pub name: String,
    /// Parent link.
    pub parent: String,
    /// Child link.
    pub child: String,
    /// Kind.
    pub kind: JointType,
    /// Pitch of a helical joint, m/rad.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pitch: Option<f64>,
    /// Rows of the rotation parent ← joint.
    pub rotation: [[f64; 3]; 3],
    /// Origin in the parent, m.
    pub translation: [f64; 3],
    /// Axis.
    pub axis: [f64; 3],
    /// Position limits.
    pub position_limits: Option<(f64, f64)>,
    /// Leader, ratio and offset of a mimic joint.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mimic: Option<(String, f64, f64)>,
}

/// A coupling.
#[derive(Debug, Clone, Serialize, Deserialize, schemars::JsonSchema)]
pub struct CouplingRecord {
    /// Motors.
    pub motors: Vec<String>,
    /// Joints.
    pub joints: Vec<String>,
    /// Matrix.
    pub matrix: Vec<Vec<f64>>,
    /// Which parameters it brings.
    pub form: CouplingForm,
}

impl ModelRecord {
    /// Records a description and what acts at its joints.
    pub fn new(description: &Description, mechanism: &Mechanism, plan: &ElementPlan) -> Self {
        let links = description
            .links
            .iter()
            .map(|l| LinkRecord { name: l.name.clone(), phi: l.inertia.map(|i| i.0) })
            .collect();
        let joints = description.joints.iter().map(joint_record).collect();
        let couplings = plan
            .couplings
            .iter()
            .map(|c| CouplingRecord {
                motors: c.motors.clone(),
                joints: c.joints.clone(),
                matrix: c.matrix.clone(),
                form: c.form,
            })
            .collect();
        let element_settings = plan
            .settings()
            .iter()
            .filter_map(|s| {
                let value = match s.value {
                    SettingValue::Number(x) => SettingRecord::Number(x),
                    SettingValue::Flag(x) => SettingRecord::Flag(x),
                    _ => return None,
                };
                Some((s.joint.clone(), s.element.clone(), s.key.clone(), value))
            })
            .collect();
        let named = |name: &str| plan.per_rate.iter().any(|list| list.iter().any(|element| element == name));
        let laws = plan.registry().kinds().filter(|kind| named(kind.name));
        let laws = laws.filter_map(|kind| Some((kind.name.to_owned(), LawSpec::of(kind)?))).collect();
        ModelRecord {
            laws,
            gravity: mechanism.gravity().0,
            floating_base: description.floating_base,
            couple_mimics: description.couple_mimics,
            links,
            joints,
            loops: plan.closed.as_deref().map(LoopsRecord::new),
            elements: plan.per_rate.clone(),
            couplings,
            elastic: plan.elastic.iter().map(ElasticRecord::new).collect(),
            reactions: match plan.has_reactions() {
                true => plan.reactions().to_vec(),
                false => Vec::new(),
            },
            clearance: (plan.clearances().iter())
                .map(|c| ClearanceRecord { joint: c.joint.clone(), keys: c.stated.clone() })
                .collect(),
            ties: plan.ties().to_vec(),
            element_settings,
            load_reference: plan.load_reference.clone(),
            known_friction: plan.known.clone(),
            state_hz: 0.0,
            kernel_hz: 0.0,
            registry: plan.registry().clone(),
        }
    }

    /// The robot that is recorded, under a name.
    ///
    /// # Errors
    /// What contradicts itself, in words.
    pub fn description(&self, name: &str) -> Result<Description, String> {
        let mut d = Description::new(name);
        d.gravity = self.gravity;
        d.floating_base = self.floating_base;
        d.couple_mimics = self.couple_mimics;
        d.links = self
            .links
            .iter()
            .map(|l| LinkDescription { name: l.name.clone(), inertia: l.phi.map(Inertia) })
            .collect();
        d.joints = self.joints.iter().map(joint_description).collect::<Result<_, _>>()?;
        Ok(d)
    }

    /// The robot that is recorded, as a robot file would state it, with the elements of its joints.
    ///
    /// # Errors
    /// What contradicts itself, in words.
    pub(crate) fn robot_file(&self, name: &str) -> Result<RobotFile, String> {
        let registry = self.kinds().map_err(|e| e.to_string())?;
        let elements = ElementSpec { registry, ..ElementSpec::default() };
        let mut file = RobotFile::plain(self.description(name)?, elements);
        if let Some(loops) = &self.loops {
            file.closures = loops.descriptions()?;
            file.actuated = Some(loops.driven.clone());
            file.home.clone_from(&loops.home);
        }
        Ok(file)
    }

    pub(crate) fn plan(&self, mechanism: &Mechanism) -> Result<ElementPlan, Error> {
        let couplings = self
            .couplings
            .iter()
            .map(|c| CouplingSpec {
                motors: c.motors.clone(),
                joints: c.joints.clone(),
                matrix: c.matrix.clone(),
                form: c.form,
            })
            .collect();
        let settings = self
            .element_settings
            .iter()
            .map(|(joint, element, key, value)| ElementSetting {
                joint: joint.clone(),
                element: element.clone(),
                key: key.clone(),
                value: match *value {
                    SettingRecord::Number(x) => SettingValue::Number(x),
                    SettingRecord::Flag(x) => SettingValue::Flag(x),
                },
            })
            .collect();
        let elastic = self.elastic.iter().map(ElasticRecord::spec).collect::<Result<Vec<_>, _>>()?;
        if let Some(joint) = repeated(mechanism, &elastic) {
            return Err(Error::setting("elastic", "names that occur once", joint));
        }
        let registry = self.kinds()?;
        let reactions = self.reactions.clone();
        let ties = self.ties.clone();
        let clearance = self.clearances()?;
        let journals = self.journals(&clearance)?;
        let spec =
            ElementSpec { settings, elastic, clearance, reactions, ties, registry, ..ElementSpec::default() };
        let plan = ElementPlan::recorded(mechanism, self.elements.clone(), couplings, spec)?;
        let mut plan = plan.with_journals(journals);
        plan.load_reference.clone_from(&self.load_reference);
        plan.known.clone_from(&self.known_friction);
        Ok(plan)
    }
}

impl ModelRecord {
    /// The kinds of elements, with the laws that the record states.
    fn kinds(&self) -> Result<ElementRegistry, Error> {
        let with = dynid_robots::with_laws(self.registry.clone(), &self.laws);
        with.map_err(|(name, fault)| Error::Law { name, fault })
    }

    fn clearances(&self) -> Result<Vec<ClearanceSpec>, Error> {
        let of = |record: &ClearanceRecord| {
            ClearanceSpec::of("model.clearance", &record.joint, &record.keys)
                .map_err(|e| Error::setting("model.clearance", "the keys of a robot file", e))
        };
        self.clearance.iter().map(of).collect()
    }

    /// The mechanism with translations of the journals, if there are some.
    fn journals(&self, clearance: &[ClearanceSpec]) -> Result<Option<Arc<Mechanism>>, Error> {
        if clearance.is_empty() {
            return Ok(None);
        }
        let fault = |e: String| Error::setting("model.clearance", "joints that turn", e);
        let joints: Vec<&str> = clearance.iter().map(|c| c.joint.as_str()).collect();
        let description = self.description("").map_err(fault)?;
        let moving = description.with_clearance(&joints).and_then(|d| d.build());
        Ok(Some(Arc::new(moving.map_err(|e| fault(e.to_string()))?)))
    }
}

/// A joint or motor that stands twice.
fn repeated(mechanism: &Mechanism, elastic: &[ElasticSpec]) -> Option<String> {
    let mut names = mechanism.rate_names();
    for e in elastic {
        if names.contains(&e.motor) {
            return Some(e.motor.clone());
        }
        names.push(e.motor.clone());
    }
    let twice = elastic.iter().enumerate().find(|(k, e)| elastic[..*k].iter().any(|b| b.joint == e.joint));
    twice.map(|(_, e)| e.joint.clone())
}

fn joint_record(j: &JointDescription) -> JointRecord {
    let pitch = match j.kind {
        JointKind::Helical { pitch } => Some(pitch),
        _ => None,
    };
    JointRecord {
        name: j.name.clone(),
        parent: j.parent.clone(),
        child: j.child.clone(),
        kind: j.kind.into(),
        pitch,
        rotation: j.placement.rotation.rows(),
        translation: j.placement.translation.0,
        axis: j.axis,
        position_limits: j.limits.position,
        mimic: j.mimic.as_ref().map(|m| (m.of.clone(), m.ratio, m.offset)),
    }
}

fn joint_description(j: &JointRecord) -> Result<JointDescription, String> {
    let kind = match (j.kind, j.pitch) {
        (JointType::Revolute, _) => JointKind::Revolute,
        (JointType::Continuous, _) => JointKind::Continuous,
        (JointType::Prismatic, _) => JointKind::Prismatic,
        (JointType::Helical, Some(pitch)) => JointKind::Helical { pitch },
        (JointType::Helical, None) => return Err(format!("joint `{}`: no pitch", j.name)),
        (JointType::Floating, _) => JointKind::Floating,
        (JointType::Fixed, _) => JointKind::Fixed,
    };
    Ok(JointDescription {
        name: j.name.clone(),
        parent: j.parent.clone(),
        child: j.child.clone(),
        kind,
        placement: Placement { rotation: Mat3::from_rows(j.rotation), translation: Vec3(j.translation) },
        axis: j.axis,
        limits: Limits { position: j.position_limits, ..Limits::default() },
        mimic: j.mimic.clone().map(|(of, ratio, offset)| Mimic { of, ratio, offset }),
    })
}
