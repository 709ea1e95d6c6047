//! How far joints give way: clearance of bearings, backlash of drives, compliance of gears.
//!
//! | question | module |
//! |---|---|
//! | clearance with probes at the journal | [`orbit`] |
//! | clearance from the effort of the drive alone | [`swing`] |
//! | backlash of the drive itself | [`backlash`] |
//! | compliance of joints from encoders on both sides of their gears | [`deformation`] |

pub mod backlash;
pub mod deformation;
pub mod orbit;
pub mod swing;

/// A value with its standard deviation.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Estimate {
    /// Value.
    pub value: f64,
    /// Standard deviation.
    pub std: f64,
}
