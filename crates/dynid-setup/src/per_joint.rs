//! Numbers that may differ from joint to joint.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::Error;

/// One number for all joints, or numbers for some.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, schemars::JsonSchema)]
#[serde(untagged, expecting = "expected a number, or numbers by joint such as `{ j1 = 2.0 }`")]
pub enum PerJoint {
    /// One value for all joints.
    All(f64),
    /// By joint.
    Each(BTreeMap<String, f64>),
}

impl Default for PerJoint {
    fn default() -> Self {
        PerJoint::Each(BTreeMap::new())
    }
}

impl PerJoint {
    /// Whether nothing is said.
    pub fn is_none(&self) -> bool {
        *self == PerJoint::default()
    }

    /// Positive numbers per joint, `None` where nothing is said.
    ///
    /// # Errors
    /// [`Error::UnknownJoint`], [`Error::Setting`] if a number is not positive.
    pub fn positive(&self, what: &str, joints: &[String]) -> Result<Vec<Option<f64>>, Error> {
        self.resolve(what, joints, "a positive number", |x| x > 0.0)
    }

    /// Numbers per joint that are not negative, `None` where nothing is said.
    ///
    /// # Errors
    /// [`Error::UnknownJoint`], [`Error::Setting`] if a number is negative.
    pub fn not_negative(&self, what: &str, joints: &[String]) -> Result<Vec<Option<f64>>, Error> {
        self.resolve(what, joints, "a number that is not negative", |x| x >= 0.0)
    }

    /// Finite numbers per joint, `None` where nothing is said.
    ///
    /// # Errors
    /// [`Error::UnknownJoint`], [`Error::Setting`] if a number is not finite.
    pub fn finite(&self, what: &str, joints: &[String]) -> Result<Vec<Option<f64>>, Error> {
        self.resolve(what, joints, "a finite number", |_| true)
    }

    fn resolve(
        &self,
        what: &str,
        joints: &[String],
        expected: &str,
        allowed: impl Fn(f64) -> bool,
    ) -> Result<Vec<Option<f64>>, Error> {
        let check = |name: &str, x: f64| {
            if allowed(x) && x.is_finite() { Ok(()) } else { Err(Error::setting(name, expected, x)) }
        };
        match self {
            PerJoint::All(x) => {
                check(what, *x)?;
                Ok(vec![Some(*x); joints.len()])
            }
            PerJoint::Each(map) => {
                for (joint, x) in map {
                    known(joint, joints)?;
                    check(&format!("{what}.{joint}"), *x)?;
                }
                Ok(joints.iter().map(|j| map.get(j).copied()).collect())
            }
        }
    }
}

/// Refuses a joint that the robot does not have.
pub fn known(joint: &String, joints: &[String]) -> Result<(), Error> {
    if joints.contains(joint) {
        return Ok(());
    }
    Err(Error::UnknownJoint { name: joint.clone(), known: joints.to_vec() })
}
