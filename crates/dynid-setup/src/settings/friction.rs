//! Friction laws by name.

use dynid_model::element::ElementRegistry;
use serde::{Deserialize, Serialize};

/// Friction of the joints that move.
#[derive(Debug, Clone, Copy, Default, Deserialize, Serialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum Friction {
    /// The elements of the robot file or the configuration, and beside them what held-out stretches of the logs ask for: shapes of friction, and
    /// efforts that repeat with the position of a joint.
    #[default]
    Auto,
    /// The elements of the robot file or the configuration, nothing else.
    Given,
    /// Coulomb, viscous, offset.
    Linear,
    /// Coulomb and viscous friction with a law of its own for each direction.
    Asymmetric,
    /// Coulomb, viscous, offset and an arctangent.
    Arctangent,
    /// Stribeck in place of Coulomb; viscous, offset.
    Stribeck,
    /// A hyperbolic tangent in place of Coulomb; viscous, offset.
    Tanh,
    /// A sigmoid that vanishes at rest in place of Coulomb; viscous, offset.
    Sigmoid,
    /// A sigmoid beside viscous friction and the offset that centres it.
    SigmoidOffset,
    /// Coulomb, a power of the speed in place of viscous friction, offset.
    Power,
}

impl Friction {
    fn elements(self) -> Option<&'static [&'static str]> {
        Some(match self {
            Friction::Auto | Friction::Given => return None,
            Friction::Linear => &["coulomb", "viscous", "offset"],
            Friction::Asymmetric => &["asymmetric"],
            Friction::Arctangent => &["coulomb", "viscous", "offset", "arctangent"],
            Friction::Stribeck => &["stribeck", "viscous", "offset"],
            Friction::Tanh => &["tanh", "viscous", "offset"],
            Friction::Sigmoid => &["sigmoid", "viscous", "offset"],
            Friction::SigmoidOffset => &["sigmoid_offset", "viscous", "offset"],
            Friction::Power => &["coulomb", "power", "offset"],
        })
    }

    /// Whether the law takes the place of something; what is no law need not.
    pub fn replaces_any(self, registry: &ElementRegistry, lists: &[Vec<String>]) -> bool {
        let gives_way = |name: &String| registry.kind(name).is_some_and(|kind| kind.gives_way);
        self.elements().is_none() || lists.iter().flatten().any(gives_way)
    }

    /// Element names of a joint with this friction in place of the one listed; a joint without any keeps none.
    pub fn of_joint(self, registry: &ElementRegistry, listed: &[String]) -> Vec<String> {
        let gives_way = |name: &&String| registry.kind(name).is_some_and(|kind| kind.gives_way);
        let Some(law) = self.elements().filter(|_| listed.iter().any(|n| gives_way(&n))) else {
            return listed.to_vec();
        };
        let others = listed.iter().filter(|n| !gives_way(n)).cloned();
        law.iter().map(|n| (*n).to_owned()).chain(others).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_law_replaces_friction_and_leaves_the_rest() {
        let listed = ["coulomb", "viscous", "offset", "rotor"].map(str::to_owned);
        let names =
            |law: Friction, listed: &[String]| law.of_joint(&ElementRegistry::default(), listed).join(" ");
        assert_eq!(names(Friction::Stribeck, &listed), "stribeck viscous offset rotor");
        assert_eq!(names(Friction::Asymmetric, &listed), "asymmetric rotor");
        assert_eq!(names(Friction::Auto, &listed), "coulomb viscous offset rotor");
        assert_eq!(names(Friction::Stribeck, &["rotor".to_owned()]), "rotor");
        assert_eq!(names(Friction::Stribeck, &[]), "");
    }
}
