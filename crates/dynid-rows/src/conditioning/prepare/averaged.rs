//! Logs of periodic motions averaged over their periods.

use std::sync::Arc;

use dynid_motion::Channel;
use dynid_motion::periods::average_periods;
use dynid_motion::spectrum::{NoiseSettings, effort_noise, position_noise};

use super::PreparedLog;
use crate::conditioning::ConditioningError;

/// Parts of a sample by which the last period averaged may have drifted from the first.
const DRIFT: f64 = 0.05;

/// What was averaged, and what the scatter between periods shows.
#[derive(Debug, Clone, PartialEq)]
pub struct PeriodsAveraged {
    /// Whole periods.
    pub periods: usize,
    /// Per output: standard deviation of a position between periods, rad or m; the average has `1/√periods` of it.
    pub position_deviation: Vec<f64>,
    /// Per output: standard deviation of the effort between periods, N m or N.
    pub effort_deviation: Vec<f64>,
    /// Per output: standard deviation of the position between periods in parts of its noise before the average: about 1 where the motion
    /// repeats. `None` without noise.
    pub scatter_ratio: Vec<Option<f64>>,
}

impl PreparedLog {
    /// One period, the mean of all whole periods of a motion that repeats every `period_s` seconds, sample by sample: positions, efforts and
    /// channels. What is left after the last whole period is not used. Noise falls by `√periods`; noise and band are measured anew.
    ///
    /// A sample is usable where it is so in every period. States near the ends are those of one period, whose ends no filter
    /// joins. The period is taken as stated.
    ///
    /// # Errors
    /// [`ConditioningError::FewPeriods`] with less than two whole periods, [`ConditioningError::PeriodOffGrid`] if the period is no
    /// whole number of samples, so that over all periods more than 0.05 of a sample are lost.
    pub fn averaged(mut self, period_s: f64, noise: &NoiseSettings) -> Result<Self, ConditioningError> {
        let per_period = period_s * self.rate_hz;
        let found = self.duration() / period_s;
        if !(per_period.is_finite() && per_period >= 1.0 && found * (1.0 + 1e-9) >= 2.0) {
            let found = if found.is_finite() { found } else { 0.0 };
            return Err(ConditioningError::FewPeriods { log: self.name, period_s, found });
        }
        let period = per_period.round() as usize;
        let periods = self.samples() / period;
        if (per_period - period as f64).abs() * periods as f64 > DRIFT || periods < 2 {
            return Err(ConditioningError::PeriodOffGrid {
                log: self.name,
                period_s,
                rate_hz: self.rate_hz,
                found: per_period,
            });
        }
        let mut means = PeriodsAveraged {
            periods,
            position_deviation: Vec::with_capacity(self.position.len()),
            effort_deviation: Vec::with_capacity(self.effort.len()),
            scatter_ratio: Vec::with_capacity(self.position.len()),
        };
        for (j, position) in self.position.iter_mut().enumerate() {
            let mean = average_periods(position, period, 0)?;
            let (scatter, sigma) = (mean.deviation.unwrap_or(0.0), self.position_noise[j].sigma);
            means.position_deviation.push(scatter);
            means.scatter_ratio.push((sigma > 0.0).then(|| scatter / sigma));
            *position = mean.mean;
            self.position_noise[j] = position_noise(position, self.rate_hz, noise)?;
        }
        for (j, effort) in self.effort.iter_mut().enumerate() {
            let mean = average_periods(effort, period, 0)?;
            means.effort_deviation.push(mean.deviation.unwrap_or(0.0));
            self.effort_noise[j] = effort_noise(&mean.mean, self.rate_hz, noise)?;
            *effort = Arc::new(mean.mean);
        }
        for channel in &mut self.channels {
            let mean = average_periods(&channel.values, period, 0)?.mean;
            *channel = Channel { name: channel.name.clone(), values: mean };
        }
        let whole = &self.usable[..periods * period];
        self.usable = (0..period).map(|k| whole[k..].iter().step_by(period).all(|u| *u)).collect();
        self.averaged = Some(means);
        (self.repeats_after, self.shared) = (None, None);
        Ok(self)
    }
}
