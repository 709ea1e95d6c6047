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
    /// Correlation coefficient `Σ(τ - τ̄)(τ̂ - m)/√(Σ(τ - τ̄)² Σ(τ̂ - m)²)` with `m` the mean of `τ̂`, -1 to 1 (Pearson 1895). It is blind
    /// to scale and offset of the prediction, so that `r2` far below its square tells of one of these. `None` if either signal is
    /// constant or empty.
    pub correlation: Option<f64>,
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
    /// What these figures are formed from.
    pub sums: FitSums,
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
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FitSums {
    /// Per channel: its sums, and whether it counts in the figure over all channels.
    channels: Vec<(ChannelSums, bool)>,
}

impl FitSums {
    /// Takes the next channel. `counts`: whether it counts in the figure over all channels.
    ///
    /// # Errors
    /// [`MetricsError::Samples`], [`MetricsError::NotFinite`].
    pub fn push(&mut self, measured: &[f64], predicted: &[f64], counts: bool) -> Result<(), MetricsError> {
        self.add(&ChannelSums::of(self.channels.len(), measured, predicted)?, counts);
        Ok(())
    }

    /// Takes the sums of the next channel. `counts`: whether it counts in the figure over all channels.
    pub fn add(&mut self, sums: &ChannelSums, counts: bool) {
        self.channels.push((*sums, counts));
    }

    /// Sums of several records of the same channels. Variations are those about the mean of each record, so that figures formed of them say
    /// what is explained within the records and nothing of the differences between them. Of a channel that counts in some records the others
    /// are left out.
    pub fn pooled<'a>(records: impl IntoIterator<Item = &'a FitSums>) -> FitSums {
        let mut records = records.into_iter();
        let mut out = records.next().cloned().unwrap_or_default();
        for record in records {
            for (all, more) in out.channels.iter_mut().zip(&record.channels) {
                match (all.1, more.1) {
                    (true, false) => {}
                    (false, true) => *all = *more,
                    _ => all.0.add(&more.0),
                }
            }
        }
        out
    }

    /// Sums of a channel.
    pub fn channel(&self, channel: usize) -> &ChannelSums {
        &self.channels[channel].0
    }

    /// Agreement of all channels taken.
    pub fn fit(self) -> Fit {
        let counting = || self.channels.iter().filter(|(_, counts)| *counts).map(|(sums, _)| sums);
        let error_energy = counting().map(|sums| sums.error_energy).sum();
        let energy = counting().map(|sums| sums.energy).sum();
        Fit {
            channels: self.channels.iter().map(|(sums, _)| sums.fit()).collect(),
            relative_error: percent(error_energy, energy),
            sums: self,
        }
    }
}

fn same_length(channel: usize, expected: usize, found: usize) -> Result<(), MetricsError> {
    match found == expected {
        true => Ok(()),
        false => Err(MetricsError::Samples { channel, expected, found }),
    }
}

/// What the agreement of a channel is formed from.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ChannelSums {
    /// Number of samples.
    pub samples: usize,
    /// `Σ(τ - τ̂)²`.
    pub error_energy: f64,
    /// `Σ τ²`.
    pub energy: f64,
    /// `Σ(τ - τ̄)²`; 0: of no meaning, as are the figures that need it.
    pub variation: f64,
    /// `max τ - min τ`.
    pub range: f64,
    /// `Σ(τ - τ̄)(τ̂ - τ̂̄)`.
    pub common: f64,
    /// `Σ(τ̂ - τ̂̄)²`.
    pub predicted_variation: f64,
    /// `max τ̂ - min τ̂`; 0: no correlation is formed.
    pub predicted_range: f64,
}

impl ChannelSums {
    /// Sums over samples, measured and predicted. `channel`: number of the channel, for errors.
    ///
    /// # Errors
    /// [`MetricsError::Samples`], [`MetricsError::NotFinite`].
    pub fn of(channel: usize, measured: &[f64], predicted: &[f64]) -> Result<Self, MetricsError> {
        same_length(channel, measured.len(), predicted.len())?;
        Self::of_pairs(channel, measured.iter().copied().zip(predicted.iter().copied()))
    }

    /// [`ChannelSums::of`] over the samples that count, one flag per sample; the sample of an error is counted among these.
    ///
    /// # Errors
    /// [`MetricsError::Samples`], [`MetricsError::NotFinite`].
    ///
    /// # Panics
    /// If there is not one flag per sample.
    pub fn of_counted(
        channel: usize,
        measured: &[f64],
        predicted: &[f64],
        counts: &[bool],
    ) -> Result<Self, MetricsError> {
        same_length(channel, measured.len(), predicted.len())?;
        assert_eq!(measured.len(), counts.len(), "flags of samples");
        let pairs = measured.iter().zip(predicted).zip(counts);
        Self::of_pairs(channel, pairs.filter(|(_, counts)| **counts).map(|((m, p), _)| (*m, *p)))
    }

    fn of_pairs(
        channel: usize,
        pairs: impl Iterator<Item = (f64, f64)> + Clone,
    ) -> Result<Self, MetricsError> {
        let (mut samples, mut sum, mut error_energy, mut energy) = (0, 0.0, 0.0, 0.0);
        let (mut highest, mut lowest) = (f64::NEG_INFINITY, f64::INFINITY);
        let (mut most, mut least, mut predicted_sum) = (f64::NEG_INFINITY, f64::INFINITY, 0.0);
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
            most = most.max(predicted);
            least = least.min(predicted);
            predicted_sum += predicted;
        }
        let mean = sum / samples.max(1) as f64;
        let predicted_mean = predicted_sum / samples.max(1) as f64;
        let (mut variation, mut common, mut predicted_variation) = (0.0, 0.0, 0.0);
        for (measured, predicted) in pairs {
            let (m, p) = (measured - mean, predicted - predicted_mean);
            variation += m.powi(2);
            common += m * p;
            predicted_variation += p.powi(2);
        }
        Ok(Self {
            samples,
            error_energy,
            energy,
            variation,
            range: (highest - lowest).max(0.0),
            common,
            predicted_variation,
            predicted_range: (most - least).max(0.0),
        })
    }

    /// Adds those of another record. Ranges are the greater ones.
    fn add(&mut self, more: &ChannelSums) {
        self.samples += more.samples;
        self.error_energy += more.error_energy;
        self.energy += more.energy;
        self.variation += more.variation;
        self.range = self.range.max(more.range);
        self.common += more.common;
        self.predicted_variation += more.predicted_variation;
        self.predicted_range = self.predicted_range.max(more.predicted_range);
    }

    /// The agreement.
    pub fn fit(&self) -> ChannelFit {
        let rms = (self.samples > 0).then(|| (self.error_energy / self.samples as f64).sqrt());
        // The variation of a constant signal is rounding about its mean; its range is exactly zero.
        let varies = self.range > 0.0 && self.variation > 0.0;
        ChannelFit {
            rms,
            nrmse: rms.filter(|_| varies).map(|r| r / self.range),
            r2: varies.then(|| 1.0 - self.error_energy / self.variation),
            correlation: (varies && self.predicted_range > 0.0 && self.predicted_variation > 0.0).then(
                || {
                    // Rounding may lead beyond the ends by some units in the last place.
                    (self.common / (self.variation.sqrt() * self.predicted_variation.sqrt())).clamp(-1.0, 1.0)
                },
            ),
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
        // About the mean 2 of both: -1, 1, 3, -3 and -1, 0, 3, -2.
        assert!((first.correlation.unwrap() - 16.0 / 280.0_f64.sqrt()).abs() < 4.0 * f64::EPSILON);
        assert_eq!(fit.channels[1].correlation, None);
        assert_eq!(fit.relative_error, Some(100.0 * (14.0_f64 / 40.0).sqrt()));
    }

    #[test]
    fn records_pool_to_what_is_explained_within_them() {
        let of = |level: f64, error: f64| {
            let measured: Vec<f64> = (0..100).map(|k| level + (0.3 * f64::from(k)).sin()).collect();
            let predicted: Vec<f64> = measured.iter().map(|x| x + error).collect();
            fit(&[measured], &[predicted]).unwrap()
        };
        let (first, second) = (of(0.0, 0.1), of(50.0, 0.3));
        let pooled = FitSums::pooled([&first.sums, &second.sums]).fit();
        assert!((pooled.channels[0].rms.unwrap() - 0.05_f64.sqrt()).abs() < 1e-12);
        // A level that differs between the records explains nothing.
        let r2 = [&first, &second].map(|f| f.channels[0].r2.unwrap());
        assert!((pooled.channels[0].r2.unwrap() - 0.5 * (r2[0] + r2[1])).abs() < 1e-12);
        assert_eq!(FitSums::pooled([&first.sums]).fit(), first);
        // What does not count in a record says nothing beside one in which it does, whatever their order.
        let mut held = FitSums::default();
        held.push(&[0.0; 4], &[90.0; 4], false).unwrap();
        assert_eq!(FitSums::pooled([&held, &first.sums, &held]).fit(), first);
        assert_eq!(FitSums::pooled([]).fit().channels, []);
    }

    #[test]
    fn correlation_is_blind_to_scale_and_offset() {
        let measured: Vec<f64> = (0..50).map(|k| (0.3 * f64::from(k)).sin()).collect();
        let of = |scale: f64, offset: f64| {
            let predicted: Vec<f64> = measured.iter().map(|x| scale * x + offset).collect();
            fit(&[&measured], &[&predicted]).unwrap().channels[0]
        };
        let rounding = 50.0 * f64::EPSILON;
        for (scale, sign) in [(0.5, 1.0), (3.0, 1.0), (-2.0, -1.0)] {
            let found = of(scale, 7.0);
            assert!((found.correlation.unwrap() - sign).abs() < rounding && found.r2.unwrap() < 0.0);
        }
    }

    #[test]
    fn constant_zero_and_empty_signals_have_no_ratio() {
        let constant = fit(&[[0.1; 7]], &[[0.2; 7]]).unwrap().channels[0];
        assert!(constant.rms.is_some() && constant.relative_error.is_some());
        assert_eq!((constant.nrmse, constant.r2, constant.correlation), (None, None, None));
        let zero = fit(&[[0.0; 3]], &[[1.0; 3]]).unwrap();
        assert_eq!((zero.channels[0].rms, zero.relative_error), (Some(1.0), None));
        let empty = fit(&[[]], &[[]]).unwrap().channels[0];
        assert_eq!((empty.rms, empty.nrmse, empty.r2, empty.relative_error), (None, None, None, None));
    }

    #[test]
    fn samples_that_do_not_count_are_left_out() {
        let (measured, predicted) = ([1.0, 7.0, 3.0, f64::NAN], [1.5, -7.0, 2.0, 0.0]);
        let counts = [true, false, true, false];
        let counted = ChannelSums::of_counted(2, &measured, &predicted, &counts).unwrap();
        assert_eq!(counted, ChannelSums::of(2, &[1.0, 3.0], &[1.5, 2.0]).unwrap());
        assert_eq!((counted.samples, counted.error_energy, counted.energy), (2, 1.25, 10.0));
        let short = ChannelSums::of_counted(2, &measured, &predicted[..3], &counts);
        assert_eq!(short, Err(MetricsError::Samples { channel: 2, expected: 4, found: 3 }));
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
