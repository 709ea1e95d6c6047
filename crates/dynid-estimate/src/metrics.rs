//! How well predicted effort matches measured effort.

/// Agreement of one channel. A figure that has no meaning for the signal is `None`, never NaN.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChannelFit {
    /// Root mean square of `τ - τ̂`, in the unit of effort; `None` without samples.
    pub rms: Option<f64>,
    /// `rms/(max τ - min τ)`; `None` for a constant or empty signal.
    pub nrmse: Option<f64>,
    /// `R² = 1 - Σ(τ - τ̂)²/Σ(τ - τ̄)²`; `None` for a constant or empty signal.
    pub r2: Option<f64>,
    /// `100 ‖τ - τ̂‖/‖τ‖` in percent; `None` for a zero or empty signal.
    pub relative_error: Option<f64>,
}

/// Agreement of all channels.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// One entry per channel, in the order given.
    pub channels: Vec<ChannelFit>,
    /// `100 √(Σ_j ‖τ_j - τ̂_j‖²/Σ_j ‖τ_j‖²)` in percent; `None` if all signals are zero or empty.
    pub relative_error: Option<f64>,
}

/// Signals that cannot be compared.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MetricsError {
    /// Unequal numbers of channels.
    #[error("expected {expected} predicted channels (as measured), found {found}")]
    Channels {
        /// Measured channels.
        expected: usize,
        /// Predicted channels.
        found: usize,
    },
    /// Unequal lengths within a channel.
    #[error("channel {channel}: expected {expected} predicted samples (as measured), found {found}")]
    Samples {
        /// Channel, counted from 0.
        channel: usize,
        /// Measured samples.
        expected: usize,
        /// Predicted samples.
        found: usize,
    },
    /// A value is NaN or infinite.
    #[error(
        "channel {channel}, sample {sample}: expected finite effort, found measured {measured}, predicted {predicted}"
    )]
    NotFinite {
        /// Channel, counted from 0.
        channel: usize,
        /// Sample, counted from 0.
        sample: usize,
        /// Measured value.
        measured: f64,
        /// Predicted value.
        predicted: f64,
    },
}

/// Compares measured and predicted effort channel by channel (one slice per joint, same sample times).
pub fn fit<M: AsRef<[f64]>, P: AsRef<[f64]>>(measured: &[M], predicted: &[P]) -> Result<Fit, MetricsError> {
    if measured.len() != predicted.len() {
        return Err(MetricsError::Channels { expected: measured.len(), found: predicted.len() });
    }
    let mut sums = FitSums::default();
    for (m, p) in measured.iter().zip(predicted) {
        sums.push(m.as_ref(), p.as_ref(), true)?;
    }
    Ok(sums.fit())
}

/// Agreement of channels that come one after the other, so that signals need not be held together.
#[derive(Debug, Default)]
pub struct FitSums {
    channels: Vec<ChannelFit>,
    error_energy: f64,
    energy: f64,
}

impl FitSums {
    /// Takes the next channel. `counts`: whether it counts in the figure over all channels.
    ///
    /// # Errors
    /// [`MetricsError::Samples`], [`MetricsError::NotFinite`].
    pub fn push(&mut self, measured: &[f64], predicted: &[f64], counts: bool) -> Result<(), MetricsError> {
        if measured.len() != predicted.len() {
            let (channel, expected, found) = (self.channels.len(), measured.len(), predicted.len());
            return Err(MetricsError::Samples { channel, expected, found });
        }
        let pairs = measured.iter().copied().zip(predicted.iter().copied());
        self.add(&ChannelSums::of(self.channels.len(), pairs)?, counts);
        Ok(())
    }

    /// Takes the sums of the next channel. `counts`: whether it counts in the figure over all channels.
    pub fn add(&mut self, sums: &ChannelSums, counts: bool) {
        if counts {
            self.error_energy += sums.error_energy;
            self.energy += sums.energy;
        }
        self.channels.push(sums.fit());
    }

    /// Agreement of all channels taken.
    pub fn fit(self) -> Fit {
        Fit { channels: self.channels, relative_error: percent(self.error_energy, self.energy) }
    }
}

/// What the agreement of a channel is formed from.
#[derive(Debug, Clone, Copy)]
pub struct ChannelSums {
    samples: usize,
    error_energy: f64,
    energy: f64,
    variation: f64,
    range: f64,
}

impl ChannelSums {
    /// Sums over samples, measured and predicted. `channel`: number of the channel, for errors.
    ///
    /// # Errors
    /// [`MetricsError::NotFinite`].
    pub fn of(channel: usize, pairs: impl Iterator<Item = (f64, f64)> + Clone) -> Result<Self, MetricsError> {
        let (mut samples, mut sum, mut error_energy, mut energy) = (0, 0.0, 0.0, 0.0);
        let (mut highest, mut lowest) = (f64::NEG_INFINITY, f64::INFINITY);
        for (measured, predicted) in pairs.clone() {
            if !measured.is_finite() || !predicted.is_finite() {
                return Err(MetricsError::NotFinite { channel, sample: samples, measured, predicted });
            }
            samples += 1;
            sum += measured;
            error_energy += (measured - predicted).powi(2);
            energy += measured * measured;
            highest = highest.max(measured);
            lowest = lowest.min(measured);
        }
        let mean = sum / samples.max(1) as f64;
        let variation = pairs.map(|(measured, _)| (measured - mean).powi(2)).sum();
        Ok(Self { samples, error_energy, energy, variation, range: highest - lowest })
    }

    fn fit(&self) -> ChannelFit {
        let rms = (self.samples > 0).then(|| (self.error_energy / self.samples as f64).sqrt());
        // The variation of a constant signal is rounding about its mean; its range is exactly zero.
        let varies = self.range > 0.0 && self.variation > 0.0;
        ChannelFit {
            rms,
            nrmse: rms.filter(|_| varies).map(|r| r / self.range),
            r2: varies.then(|| 1.0 - self.error_energy / self.variation),
            relative_error: percent(self.error_energy, self.energy),
        }
    }
}

fn percent(error_energy: f64, energy: f64) -> Option<f64> {
    (energy > 0.0).then(|| 100.0 * (error_energy / energy).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_follow_their_definitions() {
        let fit =
            fit(&[[1.0, 3.0, 5.0, -1.0], [2.0, 0.0, 0.0, 0.0]], &[[1.0, 2.0, 5.0, 0.0], [2.0; 4]]).unwrap();
        let first = fit.channels[0];
        assert_eq!(first.rms, Some(0.5_f64.sqrt()));
        assert_eq!(first.nrmse, Some(0.5_f64.sqrt() / 6.0));
        assert_eq!(first.r2, Some(1.0 - 2.0 / 20.0));
        assert_eq!(first.relative_error, Some(100.0 * (2.0_f64 / 36.0).sqrt()));
        assert_eq!(fit.relative_error, Some(100.0 * (14.0_f64 / 40.0).sqrt()));
    }

    #[test]
    fn constant_zero_and_empty_signals_have_no_ratio() {
        let constant = fit(&[[0.1; 7]], &[[0.2; 7]]).unwrap().channels[0];
        assert!(constant.rms.is_some() && constant.relative_error.is_some());
        assert_eq!((constant.nrmse, constant.r2), (None, None));
        let zero = fit(&[[0.0; 3]], &[[1.0; 3]]).unwrap();
        assert_eq!((zero.channels[0].rms, zero.relative_error), (Some(1.0), None));
        let empty = fit(&[[]], &[[]]).unwrap().channels[0];
        assert_eq!((empty.rms, empty.nrmse, empty.r2, empty.relative_error), (None, None, None, None));
    }

    #[test]
    fn unusable_signals_are_named() {
        assert_eq!(
            fit(&[vec![1.0], vec![1.0, 2.0]], &[vec![1.0], vec![1.0]]),
            Err(MetricsError::Samples { channel: 1, expected: 2, found: 1 })
        );
        let error = fit(&[[1.0, f64::NAN]], &[[1.0, 2.0]]).unwrap_err();
        assert!(matches!(error, MetricsError::NotFinite { channel: 0, sample: 1, .. }));
    }
}
