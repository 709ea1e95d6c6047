//! What the rows of factors are of, and what their columns stand for.

use serde::{Deserialize, Serialize};

/// An effort.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Output {
    /// Joint or motor.
    pub name: String,
    /// `N m` or `N`.
    pub unit: String,
}

/// A column of the factors.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Column {
    /// Base parameter, by the standard parameter that stands for it.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Size of the parameter: standard deviation that its prior leaves, in its unit.
    pub scale: f64,
}
