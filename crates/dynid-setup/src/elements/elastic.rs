//! Elastic joints: motors behind springs, each with a position of its own.

use dynid_model::element::{ElasticTransmission, JointElement};
use dynid_model::{Coordinate, JointKind, Limits, Mechanism};
use dynid_robots::ElasticSpec;

use super::ElementPlan;
use crate::Error;
use crate::error::ElasticFault;

/// Name of the element.
pub const ELASTIC: &str = "elastic";
/// Element that is left out of the default ones of a joint whose rotor turns with its motor.
pub(super) const ROTOR: &str = "rotor";

fn fault(joint: &str, fault: ElasticFault) -> Error {
    Error::Elastic { joint: joint.to_owned(), fault }
}

/// Refuses elastic joints that a mechanism cannot have.
pub(super) fn check(mechanism: &Mechanism, elastic: &[ElasticSpec]) -> Result<(), Error> {
    let names = mechanism.rate_names();
    for spec in elastic {
        let Some(body) = mechanism.bodies().iter().find(|b| b.joint.name == spec.joint) else {
            return Err(Error::UnknownJoint { name: spec.joint.clone(), known: names });
        };
        if body.joint.kind == JointKind::Floating {
            return Err(fault(&spec.joint, ElasticFault::Floats));
        }
        if let Some(follows) = mechanism.follows() {
            let own = follows[body.rate].coordinate;
            if follows.iter().filter(|f| f.coordinate == own).count() > 1 {
                return Err(fault(&spec.joint, ElasticFault::Follows));
            }
        }
    }
    let Some(sensed) = elastic.iter().find(|e| e.sensor) else { return Ok(()) };
    let with_sensor = |name: &String| elastic.iter().any(|e| e.sensor && e.joint == *name);
    let without: Vec<String> = names.into_iter().filter(|name| !with_sensor(name)).collect();
    match without.is_empty() {
        true => Ok(()),
        false => Err(fault(&sensed.joint, ElasticFault::OthersWithoutSensor(without))),
    }
}

/// Coordinates without bodies of a mechanism with these elastic joints: links with a sensor, then motors.
pub(super) fn coordinates(mechanism: &Mechanism, elastic: &[ElasticSpec]) -> Vec<Coordinate> {
    let joint = |spec: &ElasticSpec| mechanism.bodies().iter().find(|b| b.joint.name == spec.joint);
    let of = |name: &str, spec: &ElasticSpec, ratio: f64| {
        let limits = joint(spec).map_or_else(Limits::default, |b| b.joint.limits);
        let slides = joint(spec).is_some_and(|b| b.joint.kind == JointKind::Prismatic);
        let velocity = limits.velocity.map(|v| v * ratio.abs());
        let limits = match name == spec.joint {
            true => limits,
            false => Limits { velocity, ..Limits::default() },
        };
        Coordinate { name: name.to_owned(), slides, limits }
    };
    let links = elastic.iter().filter(|e| e.sensor).map(|e| of(&e.joint, e, 1.0));
    links.chain(elastic.iter().map(|e| of(&e.motor, e, e.ratio))).collect()
}

impl ElementPlan {
    /// Whether sensors measure the load of all joints, so that no body acts on any effort.
    pub fn is_measured(&self) -> bool {
        self.elastic.iter().any(|e| e.sensor)
    }

    /// Names of the rates of the plan's model: those of the mechanism, then of motors behind springs.
    pub fn names(&self, mechanism: &Mechanism) -> Vec<String> {
        let mut names = if self.is_measured() { Vec::new() } else { mechanism.rate_names() };
        names.extend(self.coordinates.iter().map(|c| c.name.clone()));
        names
    }

    /// Limits of a rate of the plan's model.
    pub(super) fn limits(&self, mechanism: &Mechanism, rate: usize) -> Limits {
        let own = if self.is_measured() { 0 } else { mechanism.rates() };
        match rate.checked_sub(own) {
            Some(k) => self.coordinates[k].limits,
            None => mechanism.bodies()[mechanism.rate_bodies()[rate]].joint.limits,
        }
    }

    /// The mechanism whose bodies act on the plan's outputs.
    pub(super) fn bodies(&self, mechanism: &Mechanism) -> Mechanism {
        match self.is_measured() {
            true => Mechanism::without_bodies(mechanism.name()).with_gravity(mechanism.gravity().0),
            false => mechanism.clone(),
        }
    }

    /// The springs, in the order of their joints.
    pub(super) fn transmissions(&self, names: &[String]) -> Result<Vec<Box<dyn JointElement>>, Error> {
        let rate = |name: &String| {
            let unknown = || Error::UnknownJoint { name: name.clone(), known: names.to_vec() };
            names.iter().position(|n| n == name).ok_or_else(unknown)
        };
        self.elastic
            .iter()
            .map(|e| {
                if self.couplings.iter().any(|c| c.joints.contains(&e.joint)) {
                    return Err(fault(&e.joint, ElasticFault::Coupled));
                }
                let (link, motor) = (rate(&e.joint)?, rate(&e.motor)?);
                let element =
                    ElasticTransmission { link, motor, ratio: e.ratio, cubic: e.cubic, damping: e.damping };
                Ok(Box::new(element) as Box<dyn JointElement>)
            })
            .collect()
    }
}

/// Stated values of springs: parameter name, value.
pub fn stated_springs(elastic: &[ElasticSpec]) -> impl Iterator<Item = (String, f64)> {
    elastic.iter().flat_map(|e| {
        let stated = [("k1", e.k1), ("k2", e.k2), ("d", e.d)];
        stated.into_iter().filter_map(|(symbol, x)| Some((format!("{}.{symbol}", e.joint), x?)))
    })
}

/// Takes `elastic`, which states nothing by itself, out of a list of elements.
pub(super) fn without_elastic(
    joint: &str,
    list: &[String],
    elastic: &[ElasticSpec],
) -> Result<Vec<String>, Error> {
    if list.iter().any(|name| name == ELASTIC) && !elastic.iter().any(|e| e.joint == joint) {
        return Err(fault(joint, ElasticFault::NoRatio));
    }
    Ok(list.iter().filter(|name| *name != ELASTIC).cloned().collect())
}
