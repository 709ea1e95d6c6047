//! What expressions see of their surroundings.

use super::value::Value;
use crate::xacro_fault::XacroFault;

/// Why an expression has no value.
#[derive(Debug)]
pub(super) enum Failure {
    /// In words.
    Reason(String),
    /// Something that it refers to is at fault.
    Fault(XacroFault),
}

impl From<String> for Failure {
    fn from(reason: String) -> Self {
        Failure::Reason(reason)
    }
}

impl From<XacroFault> for Failure {
    fn from(fault: XacroFault) -> Self {
        Failure::Fault(fault)
    }
}

/// What names of an expression stand for.
pub(super) trait Names {
    /// The value of a name in its surroundings; `None`: it has none.
    fn value(&mut self, name: &str) -> Result<Option<Value>, XacroFault>;

    /// The value of a name of an included file with `ns`.
    fn value_in(&mut self, scope: usize, name: &str) -> Result<Option<Value>, XacroFault>;

    /// An argument of the file.
    fn argument(&mut self, name: &str) -> Result<Value, XacroFault>;

    /// What a YAML file holds.
    fn yaml(&mut self, file: &str) -> Result<Value, XacroFault>;

    /// The path of a file that is named relative to the current one.
    fn path(&self, file: &str) -> String;

    /// Counts a step of the work, one level below the last one that was not left.
    fn enter(&mut self) -> Result<(), XacroFault>;

    /// Leaves a level.
    fn leave(&mut self);

    /// Counts values that were made or gone through.
    fn spend(&mut self, values: usize) -> Result<(), XacroFault>;
}
