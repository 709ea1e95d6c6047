//! JSON Schemas of the results that programs read, made from the types that are written.

use schemars::JsonSchema;
use schemars::generate::SchemaSettings;

use crate::estimate::{Estimate, LogFit};

/// A result and its schema.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct ResultSchema {
    /// Name, that of the command where there is one.
    pub name: &'static str,
    /// What it is of.
    pub of: &'static str,
    /// JSON Schema (2020-12), as text.
    pub text: String,
}

/// Schemas of all results. Keys may be added in later versions and are never renamed, so a reader passes over keys that it does not know.
pub fn all() -> Vec<ResultSchema> {
    vec![
        schema::<Vec<crate::backlash::LogBacklash>>("backlash", "`dynid backlash --json`"),
        schema::<crate::check::Check>("check", "`dynid check --json`"),
        schema::<Vec<crate::clearance::JointClearance>>("clearance", "`dynid clearance --json`"),
        schema::<crate::compare::Comparison>("compare", "`dynid compare --json`"),
        schema::<crate::design::DesignRecord>("design", "`design.json`"),
        schema::<crate::diff::ModelDiff>("diff", "`dynid diff --json`"),
        schema::<Estimate>("estimate", "`estimate.json` of `dynid identify` and `dynid solve`"),
        schema::<crate::fleet::FleetFile>("fleet", "`fleet.json`"),
        schema::<crate::FrictionModel>("friction", "`friction.json`"),
        schema::<crate::gains::GainsFile>("gains", "`dynid gains --json`"),
        schema::<crate::inspect::Inspection>("inspect", "`dynid inspect --json`"),
        schema::<crate::inspect::LogInspection>("inspect-log", "`dynid inspect LOG --json`"),
        schema::<crate::export::RobotJson>("model", "`dynid export --model`"),
        schema::<crate::motions::MotionRecord>("motion", "`motion.json`"),
        schema::<crate::design::next::NextRecord>("next", "`next.json`"),
        schema::<crate::online::Event>("online", "a line of `dynid online`"),
        schema::<crate::payload::PayloadFile>("payload", "`payload.json`"),
        schema::<crate::servo::ServoFile>("servo", "`servo.json`"),
        schema::<Vec<LogFit>>("validate", "`dynid validate --json`"),
    ]
}

fn schema<T: JsonSchema>(name: &'static str, of: &'static str) -> ResultSchema {
    // What is written, not what is understood when it is read: every key that is always there is required.
    let generator = SchemaSettings::draft2020_12().for_serialize().into_generator();
    let mut schema = generator.into_root_schema_for::<T>();
    schema.insert("title".to_owned(), format!("dynid {name}").into());
    let mut text = serde_json::to_string_pretty(&schema).unwrap_or_else(|e| unreachable!("plain data: {e}"));
    text.push('\n');
    ResultSchema { name, of, text }
}
