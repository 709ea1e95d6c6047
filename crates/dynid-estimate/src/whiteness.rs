//! Are residuals white, as far as the filter lets one see?

use dynid_motion::spectrum::{lagged_products, periodogram};

/// Autocorrelations `ρ_1..ρ_lags` about zero over pairs of samples that both count, a sample of exactly zero not
/// counting: `ρ_i = (Σ r_k r_{k+i}/n_i)/(Σ r_k²/n_0)`, zero for lags without a pair.
///
/// `None` for a signal without a counted sample or no longer than `lags`.
pub fn counted_autocorrelation(signal: &[f64], lags: usize) -> Option<Vec<f64>> {
    let counted: Vec<f64> = signal.iter().map(|v| f64::from(u8::from(*v != 0.0))).collect();
    let (products, pairs) = (lagged_products(signal)?, lagged_products(&counted)?);
    if signal.len() <= lags || products[0].is_nan() || products[0] <= 0.0 {
        return None;
    }
    let mean = products[0] / pairs[0];
    // Sums by transforms are exact to rounding, so that counts of pairs are whole numbers.
    let at = |lag: usize| if pairs[lag] < 0.5 { 0.0 } else { products[lag] / pairs[lag].round() / mean };
    Some((1..=lags).map(at).collect())
}

/// Settings of [`raw_in_band_whiteness`].
#[derive(Debug, Clone, PartialEq)]
pub struct InBandSettings {
    /// Share of the cut-off frequency that counts as in band. Default 0.8.
    pub band: f64,
    /// Critical value of Kolmogorov's statistic, `D √(m-1)`. Default 1.358 (5 %).
    pub critical: f64,
}

impl Default for InBandSettings {
    fn default() -> Self {
        Self { band: 0.8, critical: 1.358 }
    }
}

/// Outcome of [`raw_in_band_whiteness`].
#[derive(Debug, Clone, PartialEq)]
pub struct InBandWhiteness {
    /// `D = max_k |cumulative share - k/m|`.
    pub distance: f64,
    /// Threshold `1.358/√(m-1)`, with `m` times the share of counted samples for raw residuals.
    pub threshold: f64,
    /// Number `m` of frequencies in band.
    pub frequencies: usize,
    /// Frequency of the largest whitened periodogram value, Hz.
    pub dominant_frequency: f64,
}

impl InBandWhiteness {
    /// Whether whiteness is rejected: standard deviations of plain least squares are not to be believed.
    pub fn rejected(&self) -> bool {
        self.distance > self.threshold
    }
}

/// Cumulative periodogram test of *raw* residuals below a band limit: no filter to divide by.
///
/// `residuals`: measured minus predicted effort at the raw rate, exactly zero where samples do not count (reversals,
/// gaps, edges); `sample_rate` in Hz; `band_hz`: frequencies below `settings.band` of it are looked at, the kernel's
/// cut-off being the natural choice. The mean of the counted samples is taken off.
///
/// Samples that do not count leave `n` of `N` and tie neighbouring frequencies together: the running share varies about
/// as if there were only `m n/N` frequencies, which the threshold uses. It errs on the cautious side (measured on 30 s
/// of white noise: 4 % rejected without gaps, 1 to 3 % with a fifth to a half of the samples missing).
///
/// Records beyond 2^18 samples are cut to the next length without prime factors above 7 (1.6 % shorter at most): the transform of a length
/// with large factors takes more room than the log.
///
/// `None` with fewer than 8 effective frequencies in band, or for zero residuals.
///
/// Source: Bartlett 1955 (cumulative periodogram), restricted to the band.
pub fn raw_in_band_whiteness(
    residuals: &[f64],
    sample_rate: f64,
    band_hz: f64,
    settings: &InBandSettings,
) -> Option<InBandWhiteness> {
    let residuals = match residuals.len() {
        0..=LONG => residuals,
        long => &residuals[..smooth_length(long)],
    };
    let counted = residuals.iter().filter(|r| **r != 0.0).count();
    let mean = residuals.iter().sum::<f64>() / counted.max(1) as f64;
    let centred: Vec<f64> = residuals.iter().map(|r| if *r != 0.0 { r - mean } else { 0.0 }).collect();
    let periodogram = periodogram(&centred)?;
    let step = sample_rate / residuals.len() as f64;
    let powers: Vec<f64> =
        in_band(&periodogram, step, settings.band * band_hz, sample_rate).map(|(_, power)| power).collect();
    cumulative_test(&powers, step, counted as f64 / residuals.len() as f64, settings)
}

/// Records that are transformed whole, samples.
const LONG: usize = 1 << 18;

/// The largest number up to `most` whose prime factors are 2, 3, 5 and 7; 1 for 0.
fn smooth_length(most: usize) -> usize {
    let mut best = 1;
    let powers = |of: usize, from: usize| {
        std::iter::successors(Some(from), move |p| p.checked_mul(of).filter(|p| *p <= most))
    };
    for odd in powers(7, 1).flat_map(|p| powers(5, p)).flat_map(|p| powers(3, p)) {
        best = best.max(powers(2, odd).last().unwrap_or(1));
    }
    best
}

/// Frequencies and powers above zero, below a limit and below half the sample rate.
fn in_band(periodogram: &[f64], step: f64, limit: f64, sample_rate: f64) -> impl Iterator<Item = (f64, f64)> {
    periodogram
        .iter()
        .enumerate()
        .skip(1)
        .map(move |(k, power)| (k as f64 * step, *power))
        .take_while(move |(frequency, _)| *frequency < limit && *frequency < 0.5 * sample_rate)
}

/// `share`: of the samples that count.
fn cumulative_test(
    powers: &[f64],
    step: f64,
    share: f64,
    settings: &InBandSettings,
) -> Option<InBandWhiteness> {
    let total: f64 = powers.iter().sum();
    let count = powers.len();
    let effective = count as f64 * share;
    if effective < 8.0 || !total.is_finite() || total <= 0.0 {
        return None;
    }
    let (mut running, mut distance) = (0.0, 0.0_f64);
    for (k, power) in powers.iter().enumerate() {
        running += power;
        distance = distance.max((running / total - (k + 1) as f64 / count as f64).abs());
    }
    let largest = (0..count).max_by(|&a, &b| powers[a].total_cmp(&powers[b])).unwrap_or(0);
    Some(InBandWhiteness {
        distance,
        threshold: settings.critical / (effective - 1.0).sqrt(),
        frequencies: count,
        dominant_frequency: (largest + 1) as f64 * step,
    })
}

#[cfg(test)]
mod tests {
    use super::smooth_length;

    #[test]
    fn smooth_lengths_have_small_factors_and_lose_little() {
        let smooth = |mut n: usize| {
            for factor in [2, 3, 5, 7] {
                while n.is_multiple_of(factor) {
                    n /= factor;
                }
            }
            n == 1
        };
        for most in 1..3000 {
            let largest = (1..=most).rev().find(|n| smooth(*n)).unwrap();
            assert_eq!(smooth_length(most), largest, "{most}");
        }
        assert_eq!(smooth_length(1_000_001), 1_000_000);
        for most in (1 << 18..1 << 23).step_by(997) {
            assert!(smooth_length(most) as f64 > 0.984 * most as f64, "{most}");
        }
    }
}
