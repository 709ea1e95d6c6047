//! How many parameters there are, and of how many the logs tell the value.

use serde::{Deserialize, Serialize};

/// Parameters by kind and by what the logs say of them; text, JSON and page all show these numbers.
///
/// Three kinds are counted apart. *Standard parameters* are those of single links and joints (mass, first moments, inertias,
/// friction, rotor). *Base parameters* are the combinations of them that the effort depends on, which is all that any log can
/// reveal. *Shape parameters* enter the effort nonlinearly, such as a Stribeck velocity. What belongs to single logs (payloads,
/// offsets of a log) is not counted.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct ParameterCounts {
    /// Base parameters.
    pub base: BaseCounts,
    /// Standard parameters.
    pub standard: StandardCounts,
    /// Shape parameters.
    pub shape: ShapeCounts,
}

/// Base parameters; each count holds the next.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct BaseCounts {
    /// Combinations that some motion of the robot reveals.
    pub all: usize,
    /// Of these, the ones that the logs excite at all.
    pub excited: usize,
    /// Of these, the ones that the logs determine: verdict `seen in the data`.
    pub seen: usize,
}

/// Standard parameters by verdict; the verdicts add up to all.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct StandardCounts {
    /// All of them.
    pub all: usize,
    /// Verdict `seen in the data`.
    pub seen: usize,
    /// Verdict `carried by the prior`.
    pub carried: usize,
    /// Verdict `not identifiable`.
    pub not_identifiable: usize,
    /// Verdict `given`.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub given: usize,
}

fn is_zero(count: &usize) -> bool {
    *count == 0
}

/// Shape parameters.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct ShapeCounts {
    /// All of them.
    pub all: usize,
    /// Verdict `seen in the data`.
    pub seen: usize,
}

impl ParameterCounts {
    /// Base parameters in words, e.g. `48 of 62 base parameters seen in the data`.
    pub fn base_in_words(&self) -> String {
        let BaseCounts { all, seen, .. } = self.base;
        format!("{seen} of {all} base parameters seen in the data")
    }

    /// Standard parameters in words.
    pub fn standard_in_words(&self) -> String {
        let StandardCounts { all, seen, carried, not_identifiable, given } = self.standard;
        let given = if given > 0 { format!(", {given} given by ties") } else { String::new() };
        format!(
            "{seen} of {all} standard parameters seen in the data, {carried} carried by the prior, {not_identifiable} not \
             identifiable{given}"
        )
    }
}
