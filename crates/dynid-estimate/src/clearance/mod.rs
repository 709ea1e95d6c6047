//! The clearance of a joint from records: with probes at the journal ([`orbit`]), from the effort of the drive alone ([`swing`]),
//! and backlash of the drive itself ([`backlash`]).

pub mod backlash;
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
