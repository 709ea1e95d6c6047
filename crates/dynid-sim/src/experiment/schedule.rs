//! Ticks of the controller and rows of the log.

use super::ExperimentSettings;
use crate::error::{SimError, demand};

/// Largest number of controller ticks of one experiment.
const MOST_TICKS: f64 = 1e8;

/// How the ticks of the controller, the rows of the log and the cuts within a tick lie to each other.
pub(crate) struct Schedule {
    pub(crate) period: f64,
    /// Ticks per row.
    pub(crate) stride: usize,
    pub(crate) rows: usize,
    /// Whole ticks that the motion of a row comes after the row's effort, and the part of a tick.
    pub(crate) motion_later: isize,
    pub(crate) motion_part: f64,
    pub(crate) command_late: usize,
    pub(crate) command_part: f64,
}

impl Schedule {
    pub(crate) fn new(settings: &ExperimentSettings) -> Result<Schedule, SimError> {
        let (duration, rate) = (settings.duration_s, settings.log_rate_hz);
        let positive = |x: f64| x.is_finite() && x > 0.0;
        demand(positive(duration), "duration", "a positive number", duration)?;
        demand(positive(rate), "log rate", "a positive number", rate)?;
        let control = settings.control.rate_hz;
        demand(duration * control <= MOST_TICKS, "duration", "at most 1e8 control ticks", duration)?;
        let ratio = control / rate;
        let whole = ratio >= 0.999 && (ratio - ratio.round()).abs() <= 1e-9 * ratio;
        let expected = "the control rate divided by a whole number";
        demand(whole, "log rate", expected, format!("{rate} Hz at a control rate of {control} Hz"))?;
        let stride = ratio.round() as usize;
        let (motion, command) =
            (settings.imperfections.effort_delay_samples * ratio, settings.control.delay_ticks);
        Ok(Schedule {
            period: 1.0 / control,
            stride,
            rows: (duration * rate).round() as usize + 1,
            motion_later: motion.floor() as isize,
            motion_part: motion - motion.floor(),
            command_late: command.floor() as usize,
            command_part: command - command.floor(),
        })
    }

    pub(crate) fn ticks(&self) -> usize {
        (self.rows - 1) * self.stride + self.motion_later.unsigned_abs() + 1
    }

    fn row_at(&self, tick: usize, later: usize) -> Option<usize> {
        let since = tick.checked_sub(later)?;
        let row = since / self.stride;
        (since.is_multiple_of(self.stride) && row < self.rows).then_some(row)
    }

    /// Row whose motion is sampled within a tick.
    pub(crate) fn motion_row(&self, tick: usize) -> Option<usize> {
        self.row_at(tick, self.motion_later.max(0).unsigned_abs())
    }

    /// Row whose effort is taken at a tick.
    pub(crate) fn effort_row(&self, tick: usize) -> Option<usize> {
        self.row_at(tick, self.motion_later.min(0).unsigned_abs())
    }
}
