//! Why a closed mechanism does not move on.

/// Why there is no acceleration at a state of a closed mechanism, or no closed pose near it.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ForwardError {
    /// A motion that the loops leave free moves no inertia.
    #[error(
        "a free motion, of `{joint}` above all, moves no inertia: give a body that it moves a mass, or its drive a rotor"
    )]
    NoInertia {
        /// Joint that moves most in it.
        joint: String,
    },
    /// Loops lose hold of a motion: the mechanism has more free motions there than elsewhere.
    #[error("the mechanism changes its mobility at this pose: how it goes on is not determined")]
    Mobility,
    /// Positions have left the closed poses too far to be taken back.
    #[error("a gap of {gap:.2e} m in the loops does not close")]
    Open {
        /// Largest gap, m (rad times the mechanism's length `L_c`).
        gap: f64,
    },
    /// Friction that follows reactions has no solution: the more it holds, the more it is pressed.
    #[error(
        "friction at `{joint}` locks itself: no force presses on it that goes with the friction it causes"
    )]
    SelfLocking {
        /// Joint at which the force changes most from trial to trial.
        joint: String,
    },
}
