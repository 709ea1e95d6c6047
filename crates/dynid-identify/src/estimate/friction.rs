//! Friction in the result file: shapes that were tried, and whether the identified laws are passive.

use serde::{Deserialize, Serialize};

/// A friction shape that was tried on held-out blocks.
#[derive(Debug, Clone, Serialize, Deserialize, schemars::JsonSchema)]
pub struct FrictionTrial {
    /// Joint.
    pub joint: String,
    /// Element that stands for the shape.
    pub element: String,
    /// Value of the shape's own parameter in the grid of the search: a speed (`vs`, `w`), rad/s or m/s, an exponent (`p`), or a travel
    /// (`travel`), rad or m; absent where the shape has none. Earlier files call it `speed`.
    #[serde(alias = "speed")]
    pub value: Option<f64>,
    /// Unit of the value; empty where there is none.
    #[serde(default)]
    pub unit: String,
    /// Share by which the joint's held-out mean square falls: of an accepted shape against the choice without it, of
    /// another one beside the choice.
    pub gain: f64,
    /// Standard error of the gain over time blocks.
    pub standard_error: f64,
    /// Whether it was taken.
    pub accepted: bool,
}

/// An effort that repeats with the position of a joint, `w (A cos nq + B sin nq)`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct CyclicEffort {
    /// Joint.
    pub joint: String,
    /// Element that it became: `cyclic`, a torque (`w` is 1), or `cyclic_friction` (`w` is the sign of the velocity).
    pub element: String,
    /// Repetitions `n` per turn; of a joint that slides, per `2π` metres.
    pub cycles: f64,
    /// Amplitude `√(A² + B²)`.
    pub amplitude: f64,
    /// Unit of the amplitude.
    pub unit: String,
    /// Share by which the joint's mean square residual falls on held-out parts of the motion.
    pub gain: f64,
    /// Standard error of the gain over these parts.
    pub standard_error: f64,
}

dynid_record::words! {
    /// Where the friction of a joint takes energy out of the motion.
    FrictionPassivity {
        /// At all velocities that the logs reach.
        Passive = "passive",
        /// On some intervals of them.
        PassiveOn = "passive on",
        /// Nowhere.
        NotPassive = "not passive",
    }
}

/// Whether the identified friction of a joint is passive, `v (e(v) - e(0)) >= 0`, at the velocities of the training logs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct PassivityRecord {
    /// Joint.
    pub joint: String,
    /// Velocities that the training logs reach, rad/s or m/s; rest lies within.
    pub velocity_range: (f64, f64),
    /// Where it is.
    pub passivity: FrictionPassivity,
    /// Intervals of velocity `(from, to)` on which alone it is passive, ascending; empty unless `passive on`.
    #[serde(default)]
    pub intervals: Vec<(f64, f64)>,
    /// Velocity at which friction feeds most power into the motion; absent where it is passive.
    #[serde(default)]
    pub worst_velocity: Option<f64>,
    /// Power that friction feeds into the motion at that velocity, W.
    #[serde(default)]
    pub worst_power: Option<f64>,
    /// Static friction is identified below Coulomb friction.
    #[serde(default)]
    pub static_below_coulomb: bool,
}
