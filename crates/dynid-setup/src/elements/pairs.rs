//! Elements of one joint that say the same.

use std::fmt;

use dynid_model::element::ElementRegistry;

use crate::Error;

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
pub(super) fn check(registry: &ElementRegistry, joint: &str, elements: &[String]) -> Result<(), Error> {
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
    for kind in registry.kinds().filter(|kind| has(kind.name)) {
        if let Some((other, why)) = kind.excludes.iter().find(|(other, _)| has(other)) {
            return Err(equal(other, kind.name, why));
        }
    }
    Ok(())
}

/// Pairs that only a suitable motion tells apart.
pub(super) fn alike(registry: &ElementRegistry, joint: &str, elements: &[String]) -> Vec<AlikeElements> {
    let has = |name: &str| elements.iter().any(|e| e == name);
    let pairs = registry.kinds().flat_map(|kind| kind.alike.iter().map(move |other| (kind.name, other)));
    pairs
        .filter(|(first, (second, _))| has(first) && has(second))
        .map(|(first, (second, needs))| AlikeElements { joint: joint.to_owned(), first, second, needs })
        .collect()
}
