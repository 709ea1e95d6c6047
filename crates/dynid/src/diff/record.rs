//! The outcome of a comparison.

use serde::Serialize;

use super::effort::JointEffort;
use super::parameters::{Compared, ParameterDiff};

/// Version of the layout of [`ModelDiff`]: keys are added, never renamed.
const SCHEMA: &str = "dynid-diff/1";
/// Names that a headline lists.
const LISTED: usize = 5;

/// Two models of one robot compared.
#[derive(Debug, Clone, Serialize, schemars::JsonSchema)]
pub struct ModelDiff {
    /// Schema and version.
    pub schema: &'static str,
    /// First model.
    pub a: String,
    /// Second model.
    pub b: String,
    /// Robot.
    pub robot: String,
    /// Whether a parameter differs beyond chance, or one of the models has parameters that the other has not.
    pub differ: bool,
    /// The outcome in a sentence or two.
    pub headline: String,
    /// Parameters and combinations that both models tell.
    pub parameters: Vec<ParameterDiff>,
    /// Parameters that cannot be compared.
    pub not_compared: Vec<NotCompared>,
    /// Parameters of the first model alone.
    pub only_in_a: Vec<String>,
    /// Parameters of the second model alone.
    pub only_in_b: Vec<String>,
    /// Difference of the effort.
    pub effort: EffortDiff,
    /// What to know about the comparison.
    pub remarks: Vec<String>,
}

/// A parameter that cannot be compared.
#[derive(Debug, Clone, Serialize, schemars::JsonSchema)]
pub struct NotCompared {
    /// Name.
    pub name: String,
    /// Why: the verdict of a model that does not tell it, or that a robot file does not state it.
    pub reason: String,
}

/// Difference of the effort.
#[derive(Debug, Clone, Serialize, schemars::JsonSchema)]
pub struct EffortDiff {
    /// Where efforts were compared, in words.
    pub states: String,
    /// Joints in the order of the first model.
    pub joints: Vec<JointEffort>,
}

impl ModelDiff {
    pub(super) fn new(
        [a, b]: [String; 2],
        robot: &str,
        found: Compared,
        effort: EffortDiff,
        remark: Option<String>,
    ) -> Self {
        let headline = headline(&found, &effort);
        let others = !found.only_in_a.is_empty() || !found.only_in_b.is_empty();
        ModelDiff {
            schema: SCHEMA,
            a,
            b,
            robot: robot.to_owned(),
            differ: others || found.parameters.iter().any(|p| p.differs),
            headline,
            parameters: found.parameters,
            not_compared: found
                .not_compared
                .into_iter()
                .map(|(name, reason)| NotCompared { name, reason })
                .collect(),
            only_in_a: found.only_in_a,
            only_in_b: found.only_in_b,
            effort,
            remarks: remark.into_iter().collect(),
        }
    }
}

fn headline(found: &Compared, effort: &EffortDiff) -> String {
    let count = found.parameters.len();
    let differing: Vec<&str> =
        found.parameters.iter().filter(|p| p.differs).map(|p| p.name.as_str()).collect();
    let beyond = found.parameters.iter().filter(|p| p.beyond_interval).count();
    let parameters = match (count, differing.len()) {
        (0, _) => "no parameter is told by both".to_owned(),
        (_, 0) => format!(
            "none of {count} parameters differs; {beyond} beyond their 95 % intervals, {:.1} would be by chance",
            0.05 * count as f64
        ),
        (_, n) => format!("{n} of {count} parameters differ beyond chance: {}", listed(&differing)),
    };
    let only = |names: &[String], which: &str| match names {
        [] => String::new(),
        names => {
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            format!("; only the {which} has {}", listed(&names))
        }
    };
    let worst = effort.joints.iter().filter_map(|j| Some((j, j.percent?))).max_by(|a, b| a.1.total_cmp(&b.1));
    let effort = worst.map_or_else(String::new, |(joint, percent)| {
        format!("; efforts are {percent:.1} % apart at most, at `{}`", joint.joint)
    });
    format!("{parameters}{}{}{effort}", only(&found.only_in_a, "first"), only(&found.only_in_b, "second"))
}

fn listed(names: &[&str]) -> String {
    let shown = names.iter().take(LISTED).copied().collect::<Vec<_>>().join(", ");
    if names.len() > LISTED { format!("{shown} and {} more", names.len() - LISTED) } else { shown }
}
