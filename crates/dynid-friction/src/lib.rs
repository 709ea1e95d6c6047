//! Friction of joints: laws from experiments, and what residuals show of it.
//!
//! | question | module |
//! |---|---|
//! | friction laws from constant-speed tests | [`steady_friction`] |
//! | friction that follows reaction forces | [`load_friction`] |
//! | effort that repeats with the position of a joint | [`cyclic`] |

pub mod cyclic;
pub mod load_friction;
pub mod steady_friction;
