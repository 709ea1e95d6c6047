//! How loads of friction that follows reactions came to rest.

/// How the loads of friction came to rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadRounds {
    /// Rounds after the first fit.
    pub rounds: usize,
    /// Root mean square change of the loads in the last round over random states, relative to that of the loads.
    pub change: f64,
}

impl LoadRounds {
    /// Change at which rounds end.
    pub const SETTLED: f64 = 1e-6;
}
