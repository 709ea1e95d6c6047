//! What is left after the model: distribution and autocorrelation of the residual.

/// Bins of a histogram; odd, so that one is centred on zero.
const BINS: usize = 41;
/// Half width of the histogram in standard deviations about zero.
const HALF_WIDTH_STD: f64 = 4.0;
/// Lags at which the autocorrelation is drawn, beside lag 0.
const LAGS: usize = 60;
/// Longest lag drawn, s.
const LONGEST_LAG_S: f64 = 0.5;

/// Statistics of one joint's residual, over its finite samples.
#[derive(Clone, Debug)]
pub(crate) struct ResidualSummary {
    pub(crate) samples: usize,
    pub(crate) mean: f64,
    /// Standard deviation about the mean (divisor `samples`).
    pub(crate) std: f64,
    pub(crate) histogram: Histogram,
    /// `None` with fewer than 8 samples or a constant residual.
    pub(crate) autocorrelation: Option<Autocorrelation>,
}

/// Counts in equal bins over `-half_width .. half_width`.
#[derive(Clone, Debug)]
pub(crate) struct Histogram {
    pub(crate) half_width: f64,
    pub(crate) counts: Vec<usize>,
    /// Samples outside.
    pub(crate) outside: usize,
}

/// `r(k) = sum_i (e_i - m)(e_{i+k} - m) / sum_i (e_i - m)^2` (the biased estimator: Box and Jenkins 1976, 2.1.6).
#[derive(Clone, Debug)]
pub(crate) struct Autocorrelation {
    /// Samples between neighbouring lags.
    pub(crate) stride: usize,
    /// `r(stride), r(2 stride), ...`.
    pub(crate) values: Vec<f64>,
    /// `r(1)`.
    pub(crate) first: f64,
    /// Half width of the 95 % band of white noise, `1.96 / sqrt(samples)`.
    pub(crate) white_band: f64,
}

/// `measured - predicted`, sample by sample.
pub(crate) fn residual(measured: &[f64], predicted: &[f64]) -> Vec<f64> {
    measured.iter().zip(predicted).map(|(m, p)| m - p).collect()
}

/// Statistics of a residual sampled every `step_s` seconds; `None` if no sample is finite.
///
/// Samples that are not finite are dropped first and those around them taken as neighbours.
pub(crate) fn summarise(residual: &[f64], step_s: f64) -> Option<ResidualSummary> {
    let finite: Vec<f64> = residual.iter().copied().filter(|e| e.is_finite()).collect();
    if finite.is_empty() {
        return None;
    }
    let samples = finite.len();
    let mean = finite.iter().map(|e| e / samples as f64).sum::<f64>();
    let centred: Vec<f64> = finite.iter().map(|e| e - mean).collect();
    let energy: f64 = centred.iter().map(|e| e * e).sum();
    // A spread within the rounding error of the mean is none.
    let largest = finite.iter().fold(0.0, |largest: f64, e| largest.max(e.abs()));
    let spread = (energy / samples as f64).sqrt();
    let std = if spread <= samples as f64 * f64::EPSILON * largest { 0.0 } else { spread };
    let autocorrelation =
        (samples >= 8 && std > 0.0 && energy.is_finite()).then(|| autocorrelation(&centred, energy, step_s));
    Some(ResidualSummary { samples, mean, std, histogram: histogram(&finite, std), autocorrelation })
}

fn histogram(residual: &[f64], std: f64) -> Histogram {
    let half_width = if std > 0.0 && std.is_finite() { HALF_WIDTH_STD * std } else { 1.0 };
    let mut counts = vec![0; BINS];
    let mut outside = 0;
    for e in residual {
        let position = (e / half_width + 1.0) / 2.0 * BINS as f64;
        if (0.0..BINS as f64).contains(&position) {
            counts[position as usize] += 1;
        } else {
            outside += 1;
        }
    }
    Histogram { half_width, counts, outside }
}

fn autocorrelation(centred: &[f64], energy: f64, step_s: f64) -> Autocorrelation {
    let wished = LONGEST_LAG_S / step_s / LAGS as f64;
    let stride = if wished.is_finite() { (wished.round() as usize).max(1) } else { 1 };
    let stride = stride.min((centred.len() / 4 / LAGS).max(1));
    let lags: Vec<usize> =
        (1..=LAGS).map(|j| j * stride).take_while(|&lag| lag < centred.len() / 2).collect();
    let (groups, rest) = lags.as_chunks::<AT_ONCE>();
    let sums = groups.iter().flat_map(|lags| lagged_sums(centred, *lags));
    let sums = sums.chain(rest.iter().flat_map(|lag| lagged_sums(centred, [*lag])));
    let values = sums.map(|sum| sum / energy).collect();
    let [first] = lagged_sums(centred, [1]);
    let white_band = 1.96 / (centred.len() as f64).sqrt();
    Autocorrelation { stride, values, first: first / energy, white_band }
}

/// Lags that are summed side by side: a sum waits for its last addition, others fill that time.
const AT_ONCE: usize = 4;

/// `Σ_k x_k x_{k + lag}` for ascending lags.
fn lagged_sums<const N: usize>(x: &[f64], lags: [usize; N]) -> [f64; N] {
    let shortest = x.len() - lags[N - 1];
    let later = lags.map(|lag| &x[lag..]);
    let mut sums = [0.0; N];
    for (k, x) in x[..shortest].iter().enumerate() {
        for (sum, later) in sums.iter_mut().zip(&later) {
            *sum += x * later[k];
        }
    }
    for (sum, later) in sums.iter_mut().zip(&later) {
        let rest = x[shortest..].iter().zip(&later[shortest..]);
        *sum = rest.fold(*sum, |sum, (x, later)| sum + x * later);
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Uniform on -0.5 .. 0.5, from a 64-bit linear congruential generator (Knuth's MMIX constants).
    fn uniform(n: usize) -> Vec<f64> {
        let mut state = 1u64;
        (0..n)
            .map(|_| {
                state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
            })
            .collect()
    }

    #[test]
    fn white_noise_has_the_moments_of_its_law_and_stays_in_its_band() {
        let summary = summarise(&uniform(20_000), 0.001).unwrap();
        assert!((summary.std - (1.0f64 / 12.0).sqrt()).abs() < 0.005);
        assert!(summary.mean.abs() < 0.01);
        let autocorrelation = summary.autocorrelation.unwrap();
        assert_eq!(autocorrelation.stride, 8);
        let beyond = autocorrelation.values.iter().filter(|r| r.abs() > autocorrelation.white_band).count();
        assert!(beyond <= 8, "{beyond} of 60 lags beyond the 95 % band");
    }

    #[test]
    fn a_first_order_process_shows_its_coefficient() {
        let mut e = uniform(50_000);
        for i in 1..e.len() {
            e[i] += 0.8 * e[i - 1];
        }
        let autocorrelation = summarise(&e, 0.1).unwrap().autocorrelation.unwrap();
        assert_eq!(autocorrelation.stride, 1);
        for (k, r) in autocorrelation.values.iter().take(3).enumerate() {
            assert!((r - 0.8f64.powi(k as i32 + 1)).abs() < 0.02);
        }
        assert_eq!(autocorrelation.first, autocorrelation.values[0]);
    }

    #[test]
    fn every_sample_is_counted_once() {
        let mut e = uniform(1000);
        e[3] = 1e6;
        e[4] = f64::NAN;
        let summary = summarise(&e, 0.01).unwrap();
        assert_eq!(summary.samples, 999);
        assert_eq!(summary.histogram.counts.iter().sum::<usize>() + summary.histogram.outside, 999);
        assert_eq!(summary.histogram.outside, 1);
    }

    #[test]
    fn constant_short_and_missing_residuals_are_no_error() {
        assert!(summarise(&[], 0.01).is_none());
        assert!(summarise(&[f64::NAN], 0.01).is_none());
        let constant = summarise(&[2.0; 50], 0.01).unwrap();
        assert_eq!(constant.histogram.outside, 50);
        assert!(constant.autocorrelation.is_none());
        assert!(summarise(&[1.0, -1.0, 2.0], 0.0).unwrap().autocorrelation.is_none());
    }
}
