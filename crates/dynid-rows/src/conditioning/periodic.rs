//! States of periodic motions: a Fourier series through the positions, differentiated exactly.

use dynid_motion::harmonics::Harmonics;
use dynid_motion::median::median;
use rayon::prelude::*;

use super::{ConditioningError, PeriodicMotion, PreparedLog};

/// Largest correction of a stated period, in parts of it: clocks differ by far less.
const PERIOD_SLACK: f64 = 0.01;
/// Harmonics by which the period is corrected, and from which the search for the last one starts.
const FIRST_HARMONICS: usize = 16;
/// Probability that noise passes for any harmonic of a joint.
const FALSE_ALARM: f64 = 0.01;

impl PreparedLog {
    /// States from a motion that repeats every `period_s` seconds.
    ///
    /// By least squares over all whole periods, positions become `q0 + sum_k [a_k sin(k w t) + b_k cos(k w t)]`; velocity and
    /// acceleration are its exact derivatives (Swevers et al. 1997), and no filter stands between. Up to
    /// which harmonic is found for each joint: at most to the frequency at which the spectrum of its positions meets the
    /// noise, and no further than to the last harmonic that stands above the power of its neighbours by more than chance
    /// (1 % for a joint). Harmonics that a controller adds to the designed ones are thus found too.
    ///
    /// The period is corrected by up to 1 % from the positions themselves, since controller and logger may keep different
    /// clocks: one Gauss-Newton unknown, weighted over joints by their noise. Samples beyond the last whole period become
    /// unusable. Since the states hold next to no noise, it no longer limits the kernel: see
    /// [`super::ConditioningSettings::periodic_kernel_hz`]. A log that was averaged ([`PreparedLog::averaged`]) is one period, which stands.
    ///
    /// # Errors
    /// [`ConditioningError::ShorterThanPeriod`] without a whole period, [`ConditioningError::OtherPeriod`] if the positions
    /// repeat after another time.
    pub fn with_period(mut self, period_s: f64) -> Result<Self, ConditioningError> {
        let duration = self.duration();
        let period_s = if self.averaged.is_some() { duration } else { period_s };
        let whole = |period_s: f64| (duration / period_s * (1.0 + 1e-9)) as usize;
        if !(period_s.is_finite() && period_s * self.rate_hz >= 8.0 && whole(period_s) > 0) {
            return Err(ConditioningError::ShorterThanPeriod {
                log: self.name,
                expected: period_s,
                found: duration,
            });
        }
        let fitted = |log: &PreparedLog, period_s: f64| -> Vec<bool> {
            let periods = whole(period_s).max(1) as f64;
            let end = (periods * period_s * log.rate_hz).round() as usize;
            log.usable.iter().enumerate().map(|(n, u)| *u && n < end).collect()
        };
        let period_s = match self.averaged {
            Some(_) => period_s,
            None => self.corrected_period(period_s, &fitted(&self, period_s))?,
        };
        let usable = fitted(&self, period_s);
        let periods = whole(period_s).max(1);
        let step = std::f64::consts::TAU / (period_s * self.rate_hz);
        let fits: Vec<(Harmonics, f64)> = (0..self.position.len())
            .into_par_iter()
            .map(|j| self.chosen_fit(j, &usable, step, periods))
            .collect();
        let mut motion = PeriodicMotion {
            period_s,
            periods,
            harmonics: Vec::new(),
            residual_ratio: Vec::new(),
            velocity_sigma: Vec::new(),
            q: Vec::new(),
            dq: Vec::new(),
            ddq: Vec::new(),
        };
        for (j, (series, noise)) in fits.into_iter().enumerate() {
            let count = series.sine.len();
            let sigma = self.position_noise[j].sigma;
            let rms = series.residual_rms(&self.position[j], &usable);
            let rates = (1..=count).map(|k| (k as f64 * step * self.rate_hz).powi(2));
            motion.harmonics.push(count);
            motion.residual_ratio.push((sigma > 0.0).then(|| rms / sigma));
            motion.velocity_sigma.push((0.5 * noise * rates.sum::<f64>()).sqrt());
            let velocity = series.derivative(self.rate_hz);
            let acceleration = velocity.derivative(self.rate_hz);
            motion.q.push(series.values(self.samples()));
            motion.dq.push(velocity.values(self.samples()));
            motion.ddq.push(acceleration.values(self.samples()));
        }
        self.usable = usable;
        self.repeats_after = (periods > 1).then_some(period_s * self.rate_hz);
        self.periodic = Some(motion);
        Ok(self)
    }

    /// Harmonics below the frequency at which noise takes over; 0 for a joint at rest.
    fn most_harmonics(&self, output: usize, step: f64, usable: usize) -> usize {
        let Some(crossing_hz) = self.position_noise[output].crossing_hz.filter(|_| self.moves[output]) else {
            return 0;
        };
        let below = std::f64::consts::TAU * crossing_hz / (step * self.rate_hz);
        (below.ceil() as usize).clamp(1, (usable / 4).max(1))
    }

    /// The series of an output up to its last harmonic above the noise, and the mean power of noise in a harmonic.
    fn chosen_fit(&self, output: usize, usable: &[bool], step: f64, periods: usize) -> (Harmonics, f64) {
        let signal = &self.position[output];
        let samples = usable.iter().filter(|u| **u).count();
        let most = self.most_harmonics(output, step, samples);
        let fit = |count: usize| Harmonics::fit(signal, usable, step, count);
        if most == 0 {
            return (fit(0), 0.0);
        }
        // White noise leaves this mean power in a harmonic; noise that repeats with the motion (quantisation in step with it)
        // up to `periods` times as much.
        let white = 4.0 * self.position_noise[output].sigma.powi(2) / samples as f64;
        let mut count = FIRST_HARMONICS.min(most);
        loop {
            let series = fit(count);
            let powers = series.powers();
            let upper = &powers[count / 2..];
            // The median of an exponential distribution lies at ln 2 of its mean.
            let found = median(upper).unwrap_or(0.0) / std::f64::consts::LN_2;
            let noise = found.clamp(white, 4.0 * periods as f64 * white);
            let least = noise * (count as f64 / FALSE_ALARM).ln();
            let quiet = found <= 4.0 * periods as f64 * white && upper.iter().all(|p| *p <= least);
            if quiet || count == most {
                let last = powers.iter().rposition(|p| *p > least).map_or(0, |k| k + 1);
                return (if last == count { series } else { fit(last) }, noise);
            }
            count = (2 * count).min(most);
        }
    }

    /// The period at which the positions repeat best, near the stated one.
    fn corrected_period(&self, stated: f64, usable: &[bool]) -> Result<f64, ConditioningError> {
        let samples = usable.iter().filter(|u| **u).count();
        let mut step = std::f64::consts::TAU / (stated * self.rate_hz);
        let first = step;
        for _ in 0..8 {
            let sums: Vec<(f64, f64)> = (0..self.position.len())
                .into_par_iter()
                .map(|j| {
                    let count = self.most_harmonics(j, step, samples).min(FIRST_HARMONICS);
                    if count == 0 { (0.0, 0.0) } else { self.step_sums(j, usable, step, count) }
                })
                .collect();
            let (slope, curvature) = sums.iter().fold((0.0, 0.0), |s, x| (s.0 + x.0, s.1 + x.1));
            // Nothing that repeats: the stated period stands.
            if curvature <= 0.0 || !curvature.is_finite() {
                return Ok(stated);
            }
            let change = slope / curvature;
            step += change;
            if (step / first - 1.0).abs() > PERIOD_SLACK {
                return Err(ConditioningError::OtherPeriod {
                    log: self.name.clone(),
                    expected: stated,
                    found: std::f64::consts::TAU / (step * self.rate_hz),
                });
            }
            // Far below the standard error of the step, 1 / sqrt(curvature).
            if change.abs() < 1e-3 / curvature.sqrt() || change.abs() < 1e-14 * step {
                break;
            }
        }
        Ok(std::f64::consts::TAU / (step * self.rate_hz))
    }

    /// Slope and curvature of minus half the sum of squared residuals of an output in the step, in units of the noise:
    /// the derivative by the step, freed of what amplitudes can imitate, against the residual.
    fn step_sums(&self, output: usize, usable: &[bool], step: f64, count: usize) -> (f64, f64) {
        let signal = &self.position[output];
        let series = Harmonics::fit(signal, usable, step, count);
        // By the phase per sample: d q_n / d step = n dq_n / d(step n).
        let per_step = series.derivative(1.0 / step);
        let middle = 0.5 * signal.len() as f64;
        let slope: Vec<f64> =
            per_step.values(signal.len()).iter().enumerate().map(|(n, v)| v * (n as f64 - middle)).collect();
        let imitated = Harmonics::fit(&slope, usable, step, count).values(signal.len());
        let values = series.values(signal.len());
        let sigma = self.position_noise[output].sigma.max(f64::MIN_POSITIVE.sqrt());
        let (mut along, mut square) = (0.0, 0.0);
        for n in (0..signal.len()).filter(|n| usable[*n]) {
            let own = (slope[n] - imitated[n]) / sigma;
            along += own * (signal[n] - values[n]) / sigma;
            square += own * own;
        }
        (along, square)
    }
}
