//! Elements of one joint that say the same.

use std::fmt;

use crate::Error;

/// Elements whose columns depend on each other whatever the motion, the one to be left out first, and why.
const EQUAL: [(&str, &str, &str); 11] = [
    ("offset", "asymmetric", "its Coulomb columns differ by a constant"),
    ("coulomb", "asymmetric", "its Coulomb columns add up to the sign"),
    ("viscous", "asymmetric", "its viscous columns add up to the velocity"),
    ("viscous_magnitude", "asymmetric", "its viscous columns differ by the speed"),
    ("stribeck", "asymmetric", "the columns of both add up to the sign"),
    ("coulomb", "stribeck", "its columns add up to the sign"),
    ("coulomb", "lugre", "its bristles, once bent, are the sign"),
    ("stribeck", "lugre", "its bristles, once bent, are Stribeck friction"),
    ("stribeck_viscous", "stribeck", "both have a Stribeck speed `vs`"),
    ("stribeck_viscous", "lugre", "both have a Stribeck speed `vs`"),
    ("asymmetric", "lugre", "its bristles, once bent, are the sign"),
];

/// Elements whose columns are alike unless the motion tells them apart, and what it takes.
const ALIKE: [(&str, &str, &str); 18] = [
    ("coulomb", "tanh", SLOW),
    ("coulomb", "sigmoid", SLOW),
    ("coulomb", "sigmoid_offset", SLOW),
    ("stribeck", "tanh", SLOW),
    ("stribeck", "sigmoid", SLOW),
    ("stribeck", "sigmoid_offset", SLOW),
    ("tanh", "arctangent", SLOW),
    ("tanh", "sigmoid", SLOW),
    ("tanh", "sigmoid_offset", SLOW),
    ("arctangent", "sigmoid", SLOW),
    ("arctangent", "sigmoid_offset", SLOW),
    ("viscous", "arctangent", "speeds far above 1/fb"),
    ("viscous", "exponential_viscous", "speeds far above 1/sigma3"),
    ("power", "exponential_viscous", "speeds far above 1/sigma3"),
    ("lugre", "tanh", SLOW),
    ("coulomb", "load", "loads that vary"),
    ("stribeck", "load", "loads that vary"),
    ("viscous", "power", "speeds that differ by an order of magnitude"),
];
const SLOW: &str = "many samples close to rest";

/// Two elements of a joint that only a suitable motion tells apart.
#[derive(Debug, Clone, PartialEq)]
pub struct AlikeElements {
    /// Joint.
    pub joint: String,
    /// One element.
    pub first: &'static str,
    /// The second of the two.
    pub second: &'static str,
    /// What motion they need.
    pub needs: &'static str,
}

impl fmt::Display for AlikeElements {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let AlikeElements { joint, first, second, needs } = self;
        write!(f, "`{first}` and `{second}` of joint `{joint}` are nearly the same element without {needs}")
    }
}

/// Refuses elements that no motion can tell apart.
pub(super) fn check(joint: &str, elements: &[String]) -> Result<(), Error> {
    let equal = |first: &str, second: &str, reason: &str| Error::EqualElements {
        joint: joint.to_owned(),
        first: first.to_owned(),
        second: second.to_owned(),
        reason: reason.to_owned(),
    };
    let has = |name: &str| elements.iter().any(|e| e == name);
    for (k, name) in elements.iter().enumerate() {
        if elements[..k].contains(name) {
            return Err(equal(name, name, "it stands there twice"));
        }
    }
    match EQUAL.iter().find(|(first, second, _)| has(first) && has(second)) {
        Some((first, second, reason)) => Err(equal(first, second, reason)),
        None => Ok(()),
    }
}

/// Pairs that only a suitable motion tells apart.
pub(super) fn alike(joint: &str, elements: &[String]) -> Vec<AlikeElements> {
    let has = |name: &str| elements.iter().any(|e| e == name);
    ALIKE
        .iter()
        .filter(|(first, second, _)| has(first) && has(second))
        .map(|(first, second, needs)| AlikeElements { joint: joint.to_owned(), first, second, needs })
        .collect()
}
