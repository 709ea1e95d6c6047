//! Joint elements by name.

mod elastic;
mod journals;
mod model;
mod pairs;
mod reactions;
mod settings;
mod ties;

use std::sync::Arc;

use dynid_files::SourceFile;
use dynid_friction::cyclic::CyclicFinding;
use dynid_model::closed::ClosedMechanism;
use dynid_model::element::{
    Candidate, CoupledWrist, ElementKind, ElementRegistry, JointElement, JointInfo, LoadFriction, LogScaled,
    Transmission,
};
use dynid_model::{Coordinate, JointKind, Mechanism};
use dynid_robots::{CouplingForm, CouplingSpec, ElasticSpec, ElementSetting, ElementSpec, SettingValue};
use dynid_rows::conditioning::{FrictionShape, ShapeKind};

use crate::Error;
pub use crate::error::ElasticFault;
use crate::known_friction::KnownFriction;
use crate::log_terms::LogTerms;
pub use elastic::{ELASTIC, stated_springs};
pub use journals::contacts;
pub use pairs::AlikeElements;
pub use reactions::{LoadValues, REACTION_FRICTION};

/// Friction that grows with the load of the gear.
pub const LOAD: &str = "load";

/// Elements of a joint about which nothing is said.
pub const DEFAULTS: [&str; 4] = ["coulomb", "viscous", "offset", "rotor"];
/// A spring between the bodies that a joint joins, one beside the joint, and a constant effort.
const SPRING: &str = "spring";
const BALANCER: &str = "balancer";
const OFFSET: &str = "offset";

/// Which elements act at which joints of a mechanism, by name.
#[derive(Debug, Clone, PartialEq)]
pub struct ElementPlan {
    /// Per rate of the model: element names; empty for a floating base. Rates are those of the mechanism, then motors behind
    /// springs ([`ElementPlan::names`]).
    pub per_rate: Vec<Vec<String>>,
    /// Elastic joints.
    pub elastic: Vec<ElasticSpec>,
    /// Coordinates without bodies that go with them, the last of the rates.
    coordinates: Vec<Coordinate>,
    /// Couplings.
    pub couplings: Vec<CouplingSpec>,
    /// Settings of elements.
    spec: ElementSpec,
    /// Ten standard parameters per body whose rigid effort loads the gears of `load` elements; `None`: those of the robot
    /// file.
    pub load_reference: Option<Vec<f64>>,
    /// Parameters at which the loads of `reaction_friction` and of journals are taken; `None`: those of the robot file, frozen.
    pub load_values: Option<LoadValues>,
    /// Friction whose effort is known, at most one law per joint. Coefficients of friction among the elements of these
    /// joints are errors of the laws.
    pub known: Vec<KnownFriction>,
    /// The file that they come from.
    pub known_source: Option<SourceFile>,
    /// Whether these errors may have any sign.
    pub free_errors: bool,
    /// The mechanism with its loops closed, if it has some.
    pub closed: Option<Arc<ClosedMechanism>>,
    /// The mechanism with translations of the journals that have clearance; `None`: all joints are ideal.
    moving: Option<Arc<Mechanism>>,
    /// Elements that act in some logs only; none in the model that a result file records.
    pub log_terms: LogTerms,
}

impl ElementPlan {
    /// Elements as the robot file (or the configuration) says; joints and motors about which nothing is said get
    /// [`DEFAULTS`] if they move, joints behind a spring without `rotor`: theirs turns with the motor; joints with clearance without
    /// `coulomb`: the friction of their bearings has a law of its own. A spring that the file of another format states comes beside the defaults, in
    /// place of `offset`; a joint that stands still has it too.
    ///
    /// `moves`: whether the logs move the joint of each rate.
    ///
    /// # Errors
    /// [`Error::UnknownJoint`], [`Error::Elastic`]; [`Error::UnknownElement`], [`Error::ElementSetting`] for settings that nothing
    /// reads.
    pub fn new(
        mechanism: &Mechanism,
        spec: &ElementSpec,
        default: Option<&[String]>,
        moves: impl Fn(usize) -> bool,
    ) -> Result<Self, Error> {
        elastic::check(mechanism, &spec.elastic)?;
        settings::check(&spec.registry, &spec.settings)?;
        let mut plan = ElementPlan {
            per_rate: Vec::new(),
            coordinates: elastic::coordinates(mechanism, &spec.elastic),
            elastic: spec.elastic.clone(),
            couplings: spec.couplings.clone(),
            spec: spec.clone(),
            load_reference: None,
            load_values: None,
            known: Vec::new(),
            known_source: None,
            free_errors: true,
            closed: None,
            moving: None,
            log_terms: LogTerms::default(),
        };
        let names = plan.names(mechanism);
        for (joint, _) in &spec.per_joint {
            if !names.contains(joint) {
                return Err(Error::UnknownJoint { name: joint.clone(), known: names });
            }
        }
        let defaults: Vec<String> = match default {
            Some(list) => list.to_vec(),
            None if !spec.defaults.is_empty() => spec.defaults.clone(),
            None => DEFAULTS.map(str::to_owned).to_vec(),
        };
        let owners = mechanism.rate_bodies();
        let measured = plan.is_measured();
        let floats = |rate: usize| {
            let own = owners.get(rate).filter(|_| !measured);
            own.is_some_and(|body| mechanism.bodies()[*body].joint.kind == JointKind::Floating)
        };
        for (rate, name) in names.iter().enumerate() {
            let stated = spec.per_joint.iter().find(|(joint, _)| joint == name);
            let beside: Vec<&String> =
                spec.beside.iter().filter(|(joint, _)| joint == name).map(|(_, e)| e).collect();
            let list = match stated {
                _ if floats(rate) => Vec::new(),
                Some((_, list)) => list.clone(),
                None if moves(rate) => {
                    let behind = spec.elastic.iter().any(|e| e.joint == *name);
                    let rubs = spec.clearance.iter().any(|c| c.joint == *name);
                    // A constant effort is the same as another rest position of a spring.
                    let springs = beside.iter().any(|e| *e == SPRING);
                    let left_out = |d: &str| {
                        (behind && d == elastic::ROTOR)
                            || (rubs && d == journals::COULOMB)
                            || (springs && d == OFFSET)
                    };
                    let own = defaults.iter().filter(|d| !left_out(d) && !beside.contains(d));
                    own.chain(beside.iter().copied()).cloned().collect()
                }
                // A spring pulls at a joint that stands still too.
                None => {
                    beside.into_iter().filter(|e| [SPRING, BALANCER].contains(&e.as_str())).cloned().collect()
                }
            };
            plan.per_rate.push(elastic::without_elastic(name, &list, &spec.elastic)?);
        }
        Ok(plan)
    }

    /// A plan with given names per rate, as an estimate file records it.
    ///
    /// # Errors
    /// [`Error::UnknownJoint`], [`Error::Elastic`].
    pub fn recorded(
        mechanism: &Mechanism,
        per_rate: Vec<Vec<String>>,
        couplings: Vec<CouplingSpec>,
        spec: ElementSpec,
    ) -> Result<Self, Error> {
        let plan = ElementPlan::new(mechanism, &spec, Some(&[]), |_| false)?;
        Ok(ElementPlan { per_rate, couplings, ..plan })
    }

    /// A plan of the springs alone.
    ///
    /// # Errors
    /// [`Error::UnknownJoint`], [`Error::Elastic`].
    pub fn bare(mechanism: &Mechanism, spec: &ElementSpec) -> Result<Self, Error> {
        let ElementSpec { elastic, registry, .. } = spec.clone();
        let spec = ElementSpec { elastic, registry, ..ElementSpec::default() };
        ElementPlan::new(mechanism, &spec, Some(&[]), |_| false)
    }

    /// Returns the plan for a mechanism whose loops are closed.
    #[must_use]
    pub fn with_loops(self, closed: Option<Arc<ClosedMechanism>>) -> Self {
        ElementPlan { closed, ..self }
    }

    /// Returns the plan for motion whose past is not looked at: without friction that gives way where a joint has friction with the sign of its
    /// velocity, which it is the same as there.
    #[must_use]
    pub fn in_steady_motion(mut self) -> Self {
        let kind = ShapeKind::MaxwellSlip;
        let beside = candidate(&self.spec.registry, kind).map_or(&[][..], |c| c.beside);
        for list in &mut self.per_rate {
            if list.iter().any(|name| beside.contains(&name.as_str())) {
                list.retain(|name| name != kind.element());
            }
        }
        self
    }

    /// The plan of the robot alone: nothing that belongs to single logs.
    pub fn without_logs(&self) -> Self {
        ElementPlan { log_terms: LogTerms::default(), ..self.clone() }
    }

    /// The kinds of elements that its names are of.
    pub fn registry(&self) -> &ElementRegistry {
        &self.spec.registry
    }

    /// Settings of the elements.
    pub fn settings(&self) -> &[dynid_robots::ElementSetting] {
        &self.spec.settings
    }

    /// Returns the plan with bounds of shape parameters for the speeds that a log reaches, per rate; `None`: not known. Settings that
    /// state a speed stand; joints that ties make equal have the greatest of theirs.
    #[must_use]
    pub fn with_speeds(mut self, mechanism: &Mechanism, speeds: &[Option<f64>]) -> Self {
        let names = self.names(mechanism);
        // Equal joints have equal bounds.
        let of_name = |name: &String| names.iter().position(|n| n == name).and_then(|k| speeds[k]);
        let shared = |joint: &str, own: Option<f64>| {
            let others = self.equal_joints(joint).filter_map(of_name);
            own.into_iter().chain(others).filter(|v| v.is_finite() && *v > 0.0).reduce(f64::max)
        };
        let speeds: Vec<Option<f64>> = names.iter().zip(speeds).map(|(n, own)| shared(n, *own)).collect();
        for ((joint, list), speed) in names.iter().zip(&self.per_rate).zip(speeds) {
            let Some(speed) = speed else { continue };
            let scales = |name: &&String| self.spec.registry.kind(name).is_some_and(ElementKind::scales);
            for element in list.iter().filter(scales) {
                let is_speed = |s: &ElementSetting| {
                    s.joint == *joint && s.element == *element && s.key == settings::SPEED
                };
                if !self.spec.settings.iter().any(is_speed) {
                    self.spec.settings.push(ElementSetting {
                        joint: joint.clone(),
                        element: element.clone(),
                        key: settings::SPEED.to_owned(),
                        value: SettingValue::Number(speed),
                    });
                }
            }
        }
        self
    }

    /// Pairs of elements at a joint that only a suitable motion tells apart.
    pub fn alike(&self, mechanism: &Mechanism) -> Vec<AlikeElements> {
        let names = self.names(mechanism);
        names
            .iter()
            .zip(&self.per_rate)
            .flat_map(|(joint, list)| pairs::alike(self.registry(), joint, list))
            .collect()
    }

    /// Adds a friction shape to a joint, its value the start of a search within a factor of 3. Its element may take the place of
    /// another ([`Candidate::instead_of`]).
    pub fn add_shape(&mut self, rate: usize, joint: &str, shape: &FrictionShape) {
        let (name, key) = shape_element(shape.kind);
        let list = &mut self.per_rate[rate];
        let instead = candidate(&self.spec.registry, shape.kind).and_then(|c| c.instead_of);
        match list.iter_mut().find(|n| Some(n.as_str()) == instead) {
            Some(other) => *other = name.to_owned(),
            None => list.push(name.to_owned()),
        }
        let (lower, upper) = shape.bounds();
        for (field, value) in [("start", shape.value), ("lower", lower), ("upper", upper)] {
            self.spec.settings.extend(key.map(|key| ElementSetting {
                joint: joint.to_owned(),
                element: name.to_owned(),
                key: format!("{key}.{field}"),
                value: SettingValue::Number(value),
            }));
        }
    }

    /// Takes a shape away again that [`ElementPlan::add_shape`] added.
    pub fn remove_shape(&mut self, rate: usize, joint: &str, shape: &FrictionShape) {
        let (name, _) = shape_element(shape.kind);
        let list = &mut self.per_rate[rate];
        if let Some(place) = list.iter().position(|n| *n == name) {
            match candidate(&self.spec.registry, shape.kind).and_then(|c| c.instead_of) {
                Some(other) => list[place] = other.to_owned(),
                None => drop(list.remove(place)),
            }
        }
        self.spec.settings.retain(|s| !(s.joint == joint && s.element == name));
    }

    /// Adds a cyclic effort to a joint, its order the start of a search within what orders are told apart by, or held where it is a whole number.
    pub fn add_cyclic(&mut self, rate: usize, joint: &str, found: &CyclicFinding) {
        let (name, key) = cyclic_element(found.is_friction);
        self.per_rate[rate].push(name.to_owned());
        let number = |field: &str, value: f64| (format!("{key}.{field}"), SettingValue::Number(value));
        let reach = 2.0 * found.resolution;
        let settings = [
            number("start", found.cycles),
            number("lower", found.cycles - reach),
            number("upper", found.cycles + reach),
            (format!("{key}.held"), SettingValue::Flag(reach == 0.0)),
        ];
        self.spec.settings.extend(settings.map(|(key, value)| ElementSetting {
            joint: joint.to_owned(),
            element: name.to_owned(),
            key,
            value,
        }));
    }

    /// Builds the elements in joint order, then gear loads, couplings and springs, last what belongs to single logs. Where logs
    /// have a factor on friction, all friction stands after the other elements of joints.
    ///
    /// Shape parameters about which nothing is said get bounds for the speed limit of the joint, or for 1 rad/s (m/s)
    /// where there is none.
    ///
    /// # Errors
    /// [`Error::UnknownElement`], [`Error::ElementSetting`], [`Error::EqualElements`], [`Error::Coupling`],
    /// [`Error::UnknownJoint`], [`Error::Elastic`].
    pub fn build(&self, mechanism: &Mechanism) -> Result<Vec<Box<dyn JointElement>>, Error> {
        let names = self.names(mechanism);
        let joints = JointInfo::of(mechanism, &self.coordinates);
        let mut out: Vec<Box<dyn JointElement>> = Vec::new();
        for (rate, list) in self.per_rate.iter().enumerate() {
            pairs::check(self.registry(), &names[rate], list)?;
            let speed = self.limits(mechanism, rate).velocity;
            for name in list {
                let kind = settings::kind(self.registry(), name, &names[rate])?;
                if kind.turns && joints[rate].slides {
                    return Err(Error::ElementSetting {
                        element: name.clone(),
                        joint: names[rate].clone(),
                        fault: "it acts at joints that turn, and this one slides".to_owned(),
                    });
                }
                out.extend(settings::place(kind, rate, &names[rate], speed, &self.spec.settings)?);
            }
        }
        out.extend(self.journal_friction(&names)?);
        let load = self.load(mechanism, &names)?;
        match self.log_terms.scaled() {
            logs if logs.is_empty() => out.extend(load),
            logs => {
                let (friction, others): (Vec<_>, Vec<_>) = out.into_iter().partition(|e| e.is_friction());
                out = others;
                out.push(self.scaled(mechanism, friction.into_iter().chain(load).collect(), logs)?);
            }
        }
        for coupling in &self.couplings {
            out.push(build_coupling(coupling, &names)?);
        }
        out.extend(self.transmissions(&names)?);
        out.extend(self.log_terms.elements(mechanism, &self.per_rate, self.registry()));
        Ok(out)
    }

    /// Friction with a factor for each of these logs, which has a start.
    fn scaled(
        &self,
        mechanism: &Mechanism,
        friction: Vec<Box<dyn JointElement>>,
        logs: Vec<(String, f64)>,
    ) -> Result<Box<dyn JointElement>, Error> {
        let joints = JointInfo::of(mechanism, &self.coordinates);
        let refused = match friction.is_empty() {
            _ if self.has_reactions() => Some("beside `reaction_friction`, which it has no form for"),
            _ if self.has_journals() => {
                Some("beside joints with clearance, whose friction it has no form for")
            }
            true => Some("where no joint has friction"),
            false => (friction.iter().any(|e| !e.signals(&joints).is_empty()))
                .then_some("beside `lugre` or `maxwell_slip`: friction with memory has no form for it"),
        };
        match refused {
            Some(why) => Err(Error::Unsupported(format!("`own = [\"friction_scale\"]` {why}"))),
            None => Ok(Box::new(LogScaled::new(friction, &joints, logs))),
        }
    }

    /// The loads of all gears, one element: they need the same rigid efforts.
    fn load(&self, mechanism: &Mechanism, names: &[String]) -> Result<Option<Box<dyn JointElement>>, Error> {
        let loaded = |rate: &usize| self.per_rate[*rate].iter().any(|name| name == LOAD);
        let rates: Vec<usize> = (0..self.per_rate.len()).filter(loaded).collect();
        let Some(first) = rates.first() else { return Ok(None) };
        let fault = |fault: &str| Error::ElementSetting {
            element: LOAD.to_owned(),
            joint: names[*first].clone(),
            fault: fault.to_owned(),
        };
        if self.closed.is_some() {
            return Err(fault("it has no form for mechanisms with loops"));
        }
        if self.is_measured() || rates.iter().any(|rate| *rate >= mechanism.rates()) {
            return Err(fault(
                "it has no form for motors behind springs and for measured loads: no body acts on them",
            ));
        }
        if mechanism.follows().is_some() {
            return Err(fault("it has no form for joints that follow others: do not couple mimic joints"));
        }
        let reference = self.load_reference.clone().unwrap_or_else(|| mechanism.inertia_vector());
        if reference.len() != mechanism.inertial_parameters() {
            return Err(fault("the reference inertias are those of another robot"));
        }
        Ok(Some(Box::new(LoadFriction::new(mechanism, rates, reference.into()))))
    }

    /// Values that the robot file states for element parameters: `(parameter name, value)`. It states friction, not errors of
    /// known friction.
    ///
    /// `[element.j1] rotor = { inertia = 0.4 }` states `j1.Ia`: keys and symbols are those of the [registry](ElementKind::stated),
    /// and `k1`, `k2`, `d` of `elastic`.
    pub fn stated_values(&self) -> Vec<(String, f64)> {
        self.spec
            .settings
            .iter()
            .filter_map(|s| {
                let kind = self.registry().kind(&s.element)?;
                let symbol = kind.stated.iter().find(|stated| stated.key == s.key)?.symbol;
                match s.value {
                    SettingValue::Number(x) => Some((format!("{}.{symbol}", s.joint), x)),
                    _ => None,
                }
            })
            .chain(stated_springs(&self.elastic))
            .chain(self.stated_journals())
            .filter(|(name, _)| !self.is_friction_error(name))
            .collect()
    }
}

/// Where a friction shape is a candidate.
fn candidate(registry: &ElementRegistry, kind: ShapeKind) -> Option<&Candidate> {
    registry.kind(kind.element())?.candidate.as_ref()
}

/// Element of a friction shape, and the shape parameter that its value is.
pub fn shape_element(kind: ShapeKind) -> (&'static str, Option<&'static str>) {
    let registry = ElementRegistry::default();
    (kind.element(), candidate(&registry, kind).and_then(|candidate| candidate.value))
}

/// Element of a cyclic friction or torque, and the shape parameter that is its order.
pub fn cyclic_element(is_friction: bool) -> (&'static str, &'static str) {
    if is_friction { ("cyclic_friction", "friction_cycles") } else { ("cyclic", "cycles") }
}

/// Kinds of shapes that say something new beside given elements. `unloaded`: no rigid effort is to be had for a gear's load.
pub fn shapes_beside(registry: &ElementRegistry, elements: &[String], unloaded: bool) -> Vec<ShapeKind> {
    let has = |name: &str| elements.iter().any(|e| e == name);
    let shaped = elements.iter().any(|name| registry.is_shaped(name));
    let says_new = |kind: &ShapeKind| {
        let Some(candidate) = candidate(registry, *kind) else { return false };
        let beside = candidate.beside.iter().any(|name| has(name)) && !has(kind.element());
        beside && !(candidate.unless_shaped && shaped) && !(*kind == ShapeKind::Load && unloaded)
    };
    ShapeKind::ALL.into_iter().filter(says_new).collect()
}

fn build_coupling(coupling: &CouplingSpec, names: &[String]) -> Result<Box<dyn JointElement>, Error> {
    let fault = |fault: String| Error::Coupling { joints: coupling.joints.join(", "), fault };
    let rates = coupling
        .joints
        .iter()
        .map(|j| {
            names
                .iter()
                .position(|n| n == j)
                .ok_or_else(|| Error::UnknownJoint { name: j.clone(), known: names.to_vec() })
        })
        .collect::<Result<Vec<_>, _>>()?;
    let square =
        coupling.matrix.len() == rates.len() && coupling.matrix.iter().all(|r| r.len() == rates.len());
    if !square || coupling.motors.len() != rates.len() {
        return Err(fault(format!("expected a {0} x {0} matrix and {0} motors", rates.len())));
    }
    if inverse(&coupling.matrix).is_none() {
        return Err(fault("the transmission matrix is singular".to_owned()));
    }
    match coupling.form {
        CouplingForm::Strict => Ok(Box::new(Transmission {
            joints: rates,
            matrix: coupling.matrix.clone(),
            motors: coupling.motors.clone(),
        })),
        CouplingForm::Columns => {
            let [a, b] = rates[..] else {
                return Err(fault("the form `columns` couples two joints".to_owned()));
            };
            let m = &coupling.matrix;
            if m[0][1] != 0.0 || m[1][0] == 0.0 {
                return Err(fault(
                    "the form `columns` expects the second motor to turn with the first joint: matrix [[r1, 0], [c, r2]]"
                        .to_owned(),
                ));
            }
            Ok(Box::new(CoupledWrist { a, b, ratio: m[1][0] / m[1][1] }))
        }
    }
}

/// Inverse of a small square matrix by Gauss-Jordan elimination with pivoting; `None` if it is singular to rounding.
pub fn inverse(matrix: &[Vec<f64>]) -> Option<Vec<Vec<f64>>> {
    let n = matrix.len();
    let mut m: Vec<Vec<f64>> = matrix
        .iter()
        .enumerate()
        .map(|(r, row)| row.iter().copied().chain((0..n).map(|c| if c == r { 1.0 } else { 0.0 })).collect())
        .collect();
    let largest = matrix.iter().flatten().fold(0.0_f64, |a, x| a.max(x.abs()));
    for k in 0..n {
        let pivot = (k..n).max_by(|a, b| m[*a][k].abs().total_cmp(&m[*b][k].abs()))?;
        if m[pivot][k].abs() <= 1e-12 * largest {
            return None;
        }
        m.swap(pivot, k);
        let scale = m[k][k];
        m[k].iter_mut().for_each(|x| *x /= scale);
        let row = m[k].clone();
        for (r, other) in m.iter_mut().enumerate() {
            let factor = other[k];
            if r != k && factor != 0.0 {
                other.iter_mut().zip(&row).for_each(|(x, y)| *x -= factor * y);
            }
        }
    }
    Some(m.into_iter().map(|row| row[n..].to_vec()).collect())
}
