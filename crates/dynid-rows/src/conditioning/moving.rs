//! In which samples a joint moves, and in which it stands.

use dynid_motion::mask::reversal_threshold;
use rayon::prelude::*;

use super::states::{LEAST_SHARE, States};
use super::{ConditioningError, ConditioningSettings, PreparedLog};

/// Where the joints of a log move.
///
/// A joint moves where `|v| ≥ max(4 σ_v, 3 % of its rms speed)`, `σ_v` the noise of the speed at the state cut-off: below that the
/// sign of a speed, and with it friction, is a matter of chance. A joint that the log does not move at all stands throughout.
#[derive(Debug, Clone, PartialEq)]
pub struct Moving {
    /// Per output: least speed of a joint that moves, rad/s or m/s.
    pub least_speed: Vec<f64>,
    /// Per output and sample: whether it moves.
    pub samples: Vec<Vec<bool>>,
}

impl Moving {
    /// Of a log with its states.
    pub fn new(log: &PreparedLog, states: &States, settings: &ConditioningSettings) -> Moving {
        let of_output = |j: usize| {
            let v = states.velocity(j);
            let least = reversal_threshold(&v, states.velocity_sigma[j], settings.stick_sigma, LEAST_SHARE);
            (least, v.iter().map(|v| log.moves[j] && *v != 0.0 && v.abs() >= least).collect())
        };
        let (least_speed, samples) = (0..log.position.len()).into_par_iter().map(of_output).unzip();
        Moving { least_speed, samples }
    }

    /// Of a log at a state cut-off, Hz, which counts up to what the sample rate allows.
    ///
    /// # Errors
    /// [`ConditioningError::Signal`] for a signal that cannot be filtered.
    pub fn of(
        log: &PreparedLog,
        state_hz: f64,
        settings: &ConditioningSettings,
    ) -> Result<Moving, ConditioningError> {
        Ok(Moving::new(log, &States::of_motion(log, state_hz, settings)?, settings))
    }
}

impl States {
    /// The same with zero velocity wherever a joint stands: its sign there is that of noise, and friction may have any value up to static
    /// friction. A prediction along such states is the middle of what it may be, and does not jump.
    #[must_use]
    pub fn resting(mut self, moving: &Moving) -> States {
        self.moves = Some(moving.samples.clone());
        self
    }
}
