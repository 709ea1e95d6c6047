//! Power spectra, and what they say about sensor noise and excitation.

use std::f64::consts::PI;
use std::fmt;
use std::sync::Arc;

use realfft::num_complex::Complex;
use realfft::{RealFftPlanner, RealToComplex};

use crate::median::{median, running_median};
use crate::signal::{SignalError, check_finite, check_positive, check_signal};

/// One-sided power spectral density.
#[derive(Debug, Clone, PartialEq)]
pub struct PowerSpectrum {
    /// Frequencies from 0 to half the sample rate, equally spaced, Hz.
    pub frequency: Vec<f64>,
    /// Density, signal unit squared per Hz.
    pub density: Vec<f64>,
}

impl PowerSpectrum {
    /// Distance of neighbouring frequencies, Hz.
    pub fn resolution(&self) -> f64 {
        self.frequency.get(1).copied().unwrap_or(0.0)
    }

    fn scaled(mut self, factor: impl Fn(f64) -> f64) -> Self {
        for (density, f) in self.density.iter_mut().zip(&self.frequency) {
            *density *= factor(*f);
        }
        self
    }
}

/// Longest window that stands for a whole record, samples: the transform of a longer one takes more room than the log.
const LONGEST: usize = 1 << 18;

/// Welch's estimate: Hann windows of `segment` samples overlapping by half, each freed of its mean, averaged.
///
/// A segment longer than the signal is cut to it. Equals SciPy's `welch(x, fs, nperseg=segment)`. Fails if the signal
/// or the segment has fewer than two samples, a sample is not finite or the rate is not positive.
pub fn welch(signal: &[f64], rate_hz: f64, segment: usize) -> Result<PowerSpectrum, SignalError> {
    check_positive("rate_hz", rate_hz)?;
    check_signal(signal, 2)?;
    if segment < 2 {
        return Err(SignalError::Setting {
            name: "segment",
            expected: "at least 2 samples",
            found: segment as f64,
        });
    }
    let length = segment.min(signal.len());
    let window: Vec<f64> =
        (0..length).map(|n| 0.5 - 0.5 * (2.0 * PI * n as f64 / length as f64).cos()).collect();
    let transform = RealFftPlanner::<f64>::new().plan_fft_forward(length);
    let mut buffer = transform.make_input_vec();
    let mut bins = transform.make_output_vec();
    let mut scratch = transform.make_scratch_vec();
    let mut density = vec![0.0; bins.len()];
    let mut segments = 0.0;
    for part in signal.windows(length).step_by(length - length / 2) {
        let mean = part.iter().sum::<f64>() / length as f64;
        for ((b, x), w) in buffer.iter_mut().zip(part).zip(&window) {
            *b = (x - mean) * w;
        }
        // The buffers come from the plan itself, so their lengths fit.
        if transform.process_with_scratch(&mut buffer, &mut bins, &mut scratch).is_err() {
            return Err(SignalError::Length { what: "segment", expected: length, found: buffer.len() });
        }
        for (d, b) in density.iter_mut().zip(&bins) {
            *d += b.norm_sqr();
        }
        segments += 1.0;
    }
    let power: f64 = window.iter().map(|w| w * w).sum();
    let last = density.len() - 1;
    for (k, d) in density.iter_mut().enumerate() {
        let sides = if k == 0 || (k == last && length.is_multiple_of(2)) { 1.0 } else { 2.0 };
        *d *= sides / (rate_hz * power * segments);
    }
    let frequency = (0..density.len()).map(|k| k as f64 * rate_hz / length as f64).collect();
    Ok(PowerSpectrum { frequency, density })
}

/// Periodograms of signals of one length.
pub struct Periodogram {
    transform: Arc<dyn RealToComplex<f64>>,
    input: Vec<f64>,
    bins: Vec<Complex<f64>>,
    scratch: Vec<Complex<f64>>,
}

impl fmt::Debug for Periodogram {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Periodogram").field("samples", &self.input.len()).finish()
    }
}

impl Periodogram {
    /// Plans the transform of signals of so many samples, of one at least.
    pub fn new(samples: usize) -> Self {
        let transform = RealFftPlanner::<f64>::new().plan_fft_forward(samples.max(1));
        Periodogram {
            input: transform.make_input_vec(),
            bins: transform.make_output_vec(),
            scratch: transform.make_scratch_vec(),
            transform,
        }
    }

    /// `|X_k|²` of the discrete Fourier transform of a signal, `k` from 0 to half its length.
    ///
    /// # Panics
    /// If the signal has another number of samples.
    pub fn of(&mut self, signal: &[f64]) -> Vec<f64> {
        self.input.copy_from_slice(signal);
        let done = self.transform.process_with_scratch(&mut self.input, &mut self.bins, &mut self.scratch);
        assert!(done.is_ok(), "buffers of the plan itself");
        self.bins.iter().map(|c| c.norm_sqr()).collect()
    }
}

/// The [`Periodogram`] of one signal; `None` for an empty one.
pub fn periodogram(signal: &[f64]) -> Option<Vec<f64>> {
    (!signal.is_empty()).then(|| Periodogram::new(signal.len()).of(signal))
}

/// `Σ_k x_k x_{k+i}` for every lag `i`, by the transform of the padded signal; `None` for an empty signal.
pub fn lagged_products(signal: &[f64]) -> Option<Vec<f64>> {
    let length = (2 * signal.len()).next_power_of_two();
    let mut planner = RealFftPlanner::<f64>::new();
    let (forward, back) = (planner.plan_fft_forward(length), planner.plan_fft_inverse(length));
    let mut input = signal.to_vec();
    input.resize(length, 0.0);
    let mut bins = forward.make_output_vec();
    forward.process(&mut input, &mut bins).ok()?;
    for bin in &mut bins {
        *bin = Complex::new(bin.norm_sqr(), 0.0);
    }
    back.process(&mut bins, &mut input).ok()?;
    input.truncate(signal.len());
    input.iter_mut().for_each(|v| *v /= length as f64);
    (!input.is_empty()).then_some(input)
}

/// How noise is read from spectra.
#[derive(Debug, Clone, PartialEq)]
pub struct NoiseSettings {
    /// The floor is the median over this band, in parts of half the sample rate. Default 0.70 to 0.95.
    pub floor_band: (f64, f64),
    /// The median of the estimated densities divided by this is the floor. Default 0.95.
    pub floor_bias: f64,
    /// The spectrum has met the floor when its running median is below this many floors. Default 3.
    pub crossing_factor: f64,
    /// Length of that running median, bins. Default 9.
    pub crossing_window: usize,
    /// Share of the position's power inside the excited band. Default 0.999.
    pub excited_power: f64,
    /// Largest tolerated noise power of an acceleration column, in parts of its signal power. Default 5e-5.
    pub noise_power: f64,
    /// Longest Welch segment, samples. Default 4096. Records use the power of two below a quarter of their length, at
    /// least 64: some eight overlapping segments, for which the median of a density lies at 0.95 of its mean.
    pub longest_segment: usize,
}

impl Default for NoiseSettings {
    fn default() -> Self {
        Self {
            floor_band: (0.70, 0.95),
            floor_bias: 0.95,
            crossing_factor: 3.0,
            crossing_window: 9,
            excited_power: 0.999,
            noise_power: 5e-5,
            longest_segment: 4096,
        }
    }
}

impl NoiseSettings {
    fn check(&self, rate_hz: f64) -> Result<(), SignalError> {
        check_positive("rate_hz", rate_hz)?;
        check_positive("floor_bias", self.floor_bias)?;
        check_positive("crossing_factor", self.crossing_factor)?;
        check_positive("noise_power", self.noise_power)
    }
}

/// White noise of a measured position and the band in which the signal stands above it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PositionNoise {
    /// One-sided density `S_n` of the white floor, rad^2/Hz.
    pub floor_psd: f64,
    /// Standard deviation `sqrt(S_n fs / 2)`, rad.
    pub sigma: f64,
    /// Lowest frequency at which the spectrum has fallen to the floor; beyond it the acceleration is noise.
    /// Half the sample rate if it never does, `None` for a signal that is constant or a straight line.
    pub crossing_hz: Option<f64>,
    /// Frequency below which the given share of the position's power lies; 0 for a constant.
    pub excited_band_hz: f64,
    /// Highest cut-off `f` at which the noise power of the acceleration below `f` is `noise_power` of the
    /// acceleration's own power below `f` (see [`noise_limit`]), Hz; 0 for a signal without acceleration, infinite
    /// for one without noise.
    pub noise_limit_hz: f64,
    /// Variance of the acceleration below that limit (or the crossing, if lower) with the floor's share taken off,
    /// (rad/s^2)^2.
    pub acceleration_variance: f64,
    /// Variance of the velocity below the same limit, the floor's share taken off, (rad/s)^2.
    pub velocity_variance: f64,
}

impl PositionNoise {
    /// Noise and motion of one joint over several records, `(duration, noise)`: what a fit to all of them meets.
    ///
    /// Powers are means over time, so that a record in which the joint stands or creeps adds its noise and hardly any motion; the limit
    /// follows from them anew ([`noise_limit`]). Crossing and band are those of the records in which the joint accelerates, each by its share of
    /// the acceleration. One record gives its own figures. `None` without records.
    pub fn pooled(records: &[(f64, PositionNoise)], noise_power: f64) -> Option<PositionNoise> {
        let [.., (_, last)] = records else { return None };
        if records.len() == 1 {
            return Some(*last);
        }
        let total: f64 = records.iter().map(|(duration, _)| duration).sum();
        let mean = |of: fn(&PositionNoise) -> f64| -> f64 {
            records.iter().map(|(duration, noise)| duration / total * of(noise)).sum()
        };
        let floor_psd = mean(|noise| noise.floor_psd);
        let acceleration_variance = mean(|noise| noise.acceleration_variance);
        let moving = || {
            records
                .iter()
                .filter_map(|(duration, n)| Some((duration * n.acceleration_variance, n, n.crossing_hz?)))
        };
        let accelerated: f64 = moving().map(|(power, ..)| power).sum();
        let by_motion = |of: &dyn Fn(&PositionNoise, f64) -> f64| -> Option<f64> {
            (accelerated > 0.0)
                .then(|| moving().map(|(power, n, crossing)| power / accelerated * of(n, crossing)).sum())
        };
        Some(PositionNoise {
            floor_psd,
            sigma: mean(|noise| noise.sigma * noise.sigma).sqrt(),
            crossing_hz: by_motion(&|_, crossing| crossing),
            excited_band_hz: by_motion(&|n, _| n.excited_band_hz).unwrap_or(0.0),
            noise_limit_hz: noise_limit(acceleration_variance, floor_psd, noise_power),
            acceleration_variance,
            velocity_variance: mean(|noise| noise.velocity_variance),
        })
    }
}

/// Reads the noise of a position from its second differences, `S_q = S_dd / (2 sin(pi f / fs))^4`, which keeps the
/// leakage of the large slow motion out.
///
/// Fails with fewer than 16 samples, a non-finite sample or a rate that is not positive.
pub fn position_noise(
    position: &[f64],
    rate_hz: f64,
    settings: &NoiseSettings,
) -> Result<PositionNoise, SignalError> {
    check_signal(position, 16)?;
    settings.check(rate_hz)?;
    let bend: Vec<f64> = position.windows(3).map(|w| w[2] - 2.0 * w[1] + w[0]).collect();
    let spectrum = welch(&bend, rate_hz, segment_length(bend.len(), settings))?
        .scaled(|f| if f > 0.0 { (2.0 * (PI * f / rate_hz).sin()).powi(-4) } else { 0.0 });
    let floor_psd = floor(&spectrum, rate_hz, settings);
    let crossing_hz = crossing(&spectrum, floor_psd, rate_hz, settings);
    let (noise_limit_hz, [acceleration_variance, velocity_variance]) = match crossing_hz {
        Some(crossing) => limit_from_bend(&bend, rate_hz, floor_psd, crossing, settings.noise_power)?,
        None => (0.0, [0.0; 2]),
    };
    Ok(PositionNoise {
        floor_psd,
        sigma: (0.5 * floor_psd * rate_hz).sqrt(),
        crossing_hz,
        excited_band_hz: excited_band(position, rate_hz, settings.excited_power)?,
        noise_limit_hz,
        acceleration_variance,
        velocity_variance,
    })
}

/// White noise of a measured effort.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EffortNoise {
    /// One-sided density of the white floor, (N m)^2/Hz.
    pub floor_psd: f64,
    /// Standard deviation, N m.
    pub sigma: f64,
}

/// Reads the white noise of an effort from its first differences, `S = S_d / (2 sin(pi f / fs))^2`.
///
/// Fails with fewer than 16 samples, a non-finite sample or a rate that is not positive.
pub fn effort_noise(
    effort: &[f64],
    rate_hz: f64,
    settings: &NoiseSettings,
) -> Result<EffortNoise, SignalError> {
    check_signal(effort, 16)?;
    settings.check(rate_hz)?;
    let steps: Vec<f64> = effort.windows(2).map(|w| w[1] - w[0]).collect();
    let spectrum = welch(&steps, rate_hz, segment_length(steps.len(), settings))?
        .scaled(|f| if f > 0.0 { (2.0 * (PI * f / rate_hz).sin()).powi(-2) } else { 0.0 });
    let floor_psd = floor(&spectrum, rate_hz, settings);
    Ok(EffortNoise { floor_psd, sigma: (0.5 * floor_psd * rate_hz).sqrt() })
}

fn segment_length(samples: usize, settings: &NoiseSettings) -> usize {
    let quarter = (samples / 4).max(1);
    (1usize << quarter.ilog2()).max(64).min(settings.longest_segment.max(2))
}

fn floor(spectrum: &PowerSpectrum, rate_hz: f64, settings: &NoiseSettings) -> f64 {
    let (low, high) = settings.floor_band;
    let nyquist = 0.5 * rate_hz;
    let band: Vec<f64> = spectrum
        .frequency
        .iter()
        .zip(&spectrum.density)
        .filter(|(f, _)| (low * nyquist..=high * nyquist).contains(*f))
        .map(|(_, d)| *d)
        .collect();
    median(&band).unwrap_or(0.0) / settings.floor_bias
}

fn crossing(spectrum: &PowerSpectrum, floor_psd: f64, rate_hz: f64, settings: &NoiseSettings) -> Option<f64> {
    // Bin 0 holds no power of the differences, so the search starts above it.
    let density = &spectrum.density[1..];
    if density.iter().all(|d| *d == 0.0) {
        return None;
    }
    let met = running_median(density, settings.crossing_window)
        .iter()
        .position(|d| *d < settings.crossing_factor * floor_psd);
    Some(met.map_or(0.5 * rate_hz, |k| spectrum.frequency[k + 1]))
}

/// Frequency below which `share` of the power of the signal about its mean lies, Hz; 0 for a constant.
///
/// Uses one Hann window over the whole record, so that slow motion is resolved; of more than 262,144 samples windows of so many.
/// Fails if the signal has fewer than two samples or is not finite.
pub fn excited_band(signal: &[f64], rate_hz: f64, share: f64) -> Result<f64, SignalError> {
    let spectrum = welch(signal, rate_hz, signal.len().clamp(2, LONGEST))?;
    // The mean of a constant is rounded, so its spectrum is not quite zero.
    if signal.iter().all(|x| *x == signal[0]) {
        return Ok(0.0);
    }
    let total: f64 = spectrum.density.iter().sum();
    let mut below = 0.0;
    let edge = spectrum.density.iter().position(|d| {
        below += d;
        below >= share * total
    });
    Ok(edge.map_or(0.5 * rate_hz, |k| spectrum.frequency[k]))
}

/// Cut-off at which white position noise of density `floor_psd` (rad^2/Hz) has `noise_power` of the power of an
/// acceleration of the given variance: `(noise_power var(a) 5 / (S_n (2 pi)^4))^(1/5)`, Hz.
///
/// 0 for a joint without acceleration, infinite for one without noise.
pub fn noise_limit(acceleration_variance: f64, floor_psd: f64, noise_power: f64) -> f64 {
    if acceleration_variance <= 0.0 {
        return 0.0;
    }
    (noise_power * acceleration_variance * 5.0 / (floor_psd * (2.0 * PI).powi(4))).powf(0.2)
}

/// Cut-off at which white position noise of density `floor_psd` (rad^2/Hz) has `noise_power` of the power of a velocity of the given
/// variance: `(noise_power var(v) 3 / (S_n (2 pi)^2))^(1/3)`, Hz.
///
/// 0 for a joint at rest, infinite for one without noise.
pub fn velocity_limit(velocity_variance: f64, floor_psd: f64, noise_power: f64) -> f64 {
    if velocity_variance <= 0.0 {
        return 0.0;
    }
    (noise_power * velocity_variance * 3.0 / (floor_psd * (2.0 * PI).powi(2))).cbrt()
}

/// The noise limit, the acceleration variance it rests on, and the variance of the velocity below it.
///
/// The variance counts only what lies below the limit itself: noise that is not white (a jittering clock raises it
/// far above the floor at some ten Hz) would otherwise pass for acceleration and lift the limit.
fn limit_from_bend(
    bend: &[f64],
    rate_hz: f64,
    floor_psd: f64,
    crossing_hz: f64,
    noise_power: f64,
) -> Result<(f64, [f64; 2]), SignalError> {
    let spectrum = welch(bend, rate_hz, bend.len().clamp(2, LONGEST))?;
    let bin = spectrum.resolution();
    let acceleration: Vec<f64> = (spectrum.frequency.iter().zip(&spectrum.density))
        .map(|(f, d)| {
            let half_angle = PI * f / rate_hz;
            let transfer = if half_angle > 0.0 { half_angle / half_angle.sin() } else { 1.0 };
            d * transfer.powi(4) * bin * rate_hz.powi(4)
        })
        .collect();
    let mut total = 0.0;
    let below: Vec<f64> = (acceleration.iter())
        .map(|a| {
            total += a;
            total
        })
        .collect();
    let last = |f: f64| ((f / bin) as usize).min(below.len() - 1);
    let variance_below = |f: f64| {
        let power = below[last(f)];
        (power - floor_psd * (2.0 * PI).powi(4) * f.powi(5) / 5.0).max(0.0)
    };
    let velocity_below = |f: f64| {
        let of_bin = |(a, f): (&f64, &f64)| if *f > 0.0 { a / (2.0 * PI * f).powi(2) } else { 0.0 };
        let power: f64 = acceleration.iter().zip(&spectrum.frequency).take(last(f) + 1).map(of_bin).sum();
        (power - floor_psd * (2.0 * PI).powi(2) * f.powi(3) / 3.0).max(0.0)
    };
    let mut edge = crossing_hz;
    loop {
        let variance = variance_below(edge);
        let limit = noise_limit(variance, floor_psd, noise_power);
        // The variance falls with the edge, so the edges descend to the highest fixed point, bin by bin at worst.
        if limit + bin > edge {
            return Ok((limit, [variance, velocity_below(edge)]));
        }
        edge = limit;
    }
}

/// Standard deviation of the velocity that follows from white position noise after the state filter, rad/s:
/// `sigma_v^2 = S_n int_0^(fs/2) (2 pi f)^2 |H|^4 df` with `|H|^2 = 1 / (1 + (f/fc)^(2 order))`.
///
/// `floor_psd`: `S_n`, rad^2/Hz; `order` of the Butterworth run forward and backward at `cutoff_hz`.
/// Fails if the floor is negative or not finite, or the cut-off is not between 0 and half the rate.
pub fn velocity_noise(
    floor_psd: f64,
    order: usize,
    cutoff_hz: f64,
    rate_hz: f64,
) -> Result<f64, SignalError> {
    crate::signal::check_cutoff(cutoff_hz, rate_hz)?;
    check_finite(&[floor_psd])?;
    if floor_psd < 0.0 {
        return Err(SignalError::Setting { name: "floor_psd", expected: "0 or more", found: floor_psd });
    }
    // Simpson's rule in x = f / fc; beyond x = 20 an order 2 filter leaves less than 1e-3 of the integral and
    // higher orders nothing.
    const PANELS: usize = 2000;
    let end = (0.5 * rate_hz / cutoff_hz).min(20.0);
    let step = end / PANELS as f64;
    let value = |k: usize| {
        let x = k as f64 * step;
        x * x / (1.0 + x.powi(2 * order as i32)).powi(2)
    };
    let inner: f64 = (1..PANELS).map(|k| value(k) * if k % 2 == 1 { 4.0 } else { 2.0 }).sum();
    let integral = (value(0) + inner + value(PANELS)) * step / 3.0;
    Ok((floor_psd * (2.0 * PI).powi(2) * cutoff_hz.powi(3) * integral).sqrt())
}
