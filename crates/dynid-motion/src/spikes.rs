//! Single outliers: found against a running median, told from chatter and from steps, replaced.

use crate::median::{median, running_median};
use crate::signal::{SignalError, check_finite, check_positive, quantum};

/// When a deviation from the running median is a spike. Defaults are for effort; see [`SpikeSettings::position`].
#[derive(Debug, Clone, PartialEq)]
pub struct SpikeSettings {
    /// Length of the running median, samples (odd). Default 13.
    pub window: usize,
    /// Threshold in robust standard deviations `s = 1.4826 median |r|` of the residual `r`. Default 6.
    pub threshold: f64,
    /// Longest run of samples above the threshold that still is a spike. Default 3.
    pub longest_run: usize,
    /// The peak must exceed this many times the second largest `|r|` of the neighbours. Default 3.
    pub isolation: f64,
    /// Neighbours looked at on either side of the run, samples. Default 8.
    pub neighbours: usize,
    /// The median levels before and after must differ by less than this part of the peak. Default 0.5.
    pub level_change: f64,
    /// Samples on either side that make a level. Default 3.
    pub level_samples: usize,
    /// If a larger share of the signal is flagged, it is noise or chatter and nothing is removed. Default 0.01.
    pub cap: f64,
}

impl Default for SpikeSettings {
    fn default() -> Self {
        Self {
            window: 13,
            threshold: 6.0,
            longest_run: 3,
            isolation: 3.0,
            neighbours: 8,
            level_change: 0.5,
            level_samples: 3,
            cap: 0.01,
        }
    }
}

impl SpikeSettings {
    /// Settings for positions: 30 standard deviations, runs of at most 2 samples.
    pub fn position() -> Self {
        Self { threshold: 30.0, longest_run: 2, ..Self::default() }
    }
}

/// What was found in one signal.
#[derive(Debug, Clone, PartialEq)]
pub struct SpikeReport {
    /// Samples that look like spikes, ascending.
    pub flagged: Vec<usize>,
    /// Whether they were replaced (false if there are more than the cap allows).
    pub removed: bool,
    /// Robust standard deviation of the residual against the running median, in the signal's unit.
    pub residual_sd: f64,
}

/// What a part of a signal tells of the spikes of the whole.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpikeLevel {
    /// Robust standard deviation of the residual against the running median, in the signal's unit; 0 for a part that is constant.
    pub residual_sd: f64,
    /// More samples stick out than the cap allows: it is noise or chatter, and nothing is replaced.
    pub chatter: bool,
}

impl SpikeLevel {
    /// At which nothing is replaced.
    pub const NONE: SpikeLevel = SpikeLevel { residual_sd: 0.0, chatter: false };
}

impl SpikeReport {
    /// What the signal tells of a longer one that it is a part of.
    pub fn level(&self) -> SpikeLevel {
        SpikeLevel { residual_sd: self.residual_sd, chatter: !self.removed && !self.flagged.is_empty() }
    }
}

/// Finds spikes and replaces them in `signal` by the running median.
///
/// With the residual `r` against the running median and `s = 1.4826 median |r|`, a run of at most `longest_run`
/// samples with `|r| > threshold s` is a spike if its peak exceeds `isolation` times the second largest `|r|` of its
/// neighbours and the levels before and after differ by less than `level_change` times the peak, so that a step at
/// velocity reversal and chatter stay. If more than half of the residuals vanish (a smooth or coarsely quantised
/// signal), the resolution step stands in for `s`. A run that touches an end of the signal is left alone.
/// Fails if a sample is not finite or a setting is not positive.
pub fn remove(signal: &mut [f64], settings: &SpikeSettings) -> Result<SpikeReport, SignalError> {
    check_finite(signal)?;
    check_positive("threshold", settings.threshold)?;
    check_positive("isolation", settings.isolation)?;
    let smooth = running_median(signal, settings.window);
    let residual: Vec<f64> = signal.iter().zip(&smooth).map(|(x, m)| (x - m).abs()).collect();
    let spread = 1.4826 * median(&residual).unwrap_or(0.0);
    let residual_sd = if spread > 0.0 { spread } else { quantum(signal) };
    let flagged: Vec<usize> = runs_above(&residual, settings.threshold * residual_sd)
        .filter(|run| is_spike(signal, &residual, run, settings))
        .flatten()
        .collect();
    let removed = !flagged.is_empty() && flagged.len() as f64 <= settings.cap * signal.len() as f64;
    if removed {
        for &n in &flagged {
            signal[n] = smooth[n];
        }
    }
    Ok(SpikeReport { flagged, removed, residual_sd })
}

/// [`remove`] in a stretch of a signal of which a part was looked at before: samples that were replaced, ascending.
///
/// With the level of the very same signal it replaces what [`remove`] does. A sample is judged by at most
/// `window + neighbours + longest_run` samples on either side.
///
/// # Errors
/// As [`remove`].
pub fn remove_at(
    signal: &mut [f64],
    level: SpikeLevel,
    settings: &SpikeSettings,
) -> Result<Vec<usize>, SignalError> {
    check_finite(signal)?;
    check_positive("threshold", settings.threshold)?;
    check_positive("isolation", settings.isolation)?;
    let limit = settings.threshold * level.residual_sd;
    if level.chatter || limit <= 0.0 || settings.window < 2 {
        return Ok(Vec::new());
    }
    let far = far_from_median(signal, settings.window / 2, limit);
    let reach = settings.neighbours.max(settings.level_samples) + settings.window;
    let mut replaced: Vec<(usize, f64)> = Vec::new();
    for run in far.chunk_by(|a, b| a + 1 == *b).filter(|run| run.len() <= settings.longest_run) {
        // The run with all that it is judged by.
        let from = run[0].saturating_sub(reach);
        let end = (run[0] + run.len() + reach).min(signal.len());
        let around = &signal[from..end];
        let smooth = running_median(around, settings.window);
        let residual: Vec<f64> = around.iter().zip(&smooth).map(|(x, m)| (x - m).abs()).collect();
        let place = run[0] - from..run[0] - from + run.len();
        if is_spike(around, &residual, &place, settings) {
            replaced.extend(place.map(|k| (from + k, smooth[k])));
        }
    }
    for (sample, value) in &replaced {
        signal[*sample] = *value;
    }
    Ok(replaced.into_iter().map(|(sample, _)| sample).collect())
}

/// Samples further than a limit from the median of `half` samples on either side of them, told without forming medians: more than half of the
/// window lies further off on the same side.
fn far_from_median(signal: &[f64], half: usize, limit: f64) -> Vec<usize> {
    const AT_ONCE: usize = 256;
    let n = signal.len();
    let inside = half.min(n)..n.saturating_sub(half).max(half.min(n));
    let mut out = Vec::new();
    // At the ends the window keeps the samples that exist.
    let ends = |range: Run, out: &mut Vec<usize>| {
        let (from, end) = (range.start.saturating_sub(half), (range.end + half).min(n));
        let smooth = running_median(&signal[from..end], 2 * half + 1);
        out.extend(range.filter(|k| (signal[*k] - smooth[*k - from]).abs() > limit));
    };
    ends(0..inside.start, &mut out);
    let is_far = |k: usize| {
        let window = &signal[k - half..=k + half];
        let count = |far: &dyn Fn(f64) -> bool| window.iter().filter(|y| far(**y)).count();
        count(&|y| signal[k] - y > limit).max(count(&|y| y - signal[k] > limit)) > half
    };
    let (mut low, mut high) = (Vec::new(), Vec::new());
    for start in inside.clone().step_by(AT_ONCE) {
        let end = (start + AT_ONCE).min(inside.end);
        // Extremes of `half` samples from each on; where all on one side are near enough, so is the median.
        let runs = &signal[start - half..end + half];
        let count = end - start + half + 1;
        low.clear();
        low.extend_from_slice(&runs[..count]);
        high.clear();
        high.extend_from_slice(&runs[..count]);
        for shift in 1..half {
            for ((low, high), y) in low.iter_mut().zip(&mut high).zip(&runs[shift..]) {
                *low = if *y < *low { *y } else { *low };
                *high = if *y > *high { *y } else { *high };
            }
        }
        let near_enough = |(place, x): (usize, &f64)| {
            let (before, after) = (place, place + half + 1);
            (x - low[before] <= limit || x - low[after] <= limit)
                && (high[before] - x <= limit || high[after] - x <= limit)
        };
        let own = signal[start..end].iter().enumerate();
        let doubtful = own.filter(|sample| !near_enough(*sample)).map(|(place, _)| start + place);
        out.extend(doubtful.filter(|k| is_far(*k)));
    }
    ends(inside.end..n, &mut out);
    out
}

type Run = std::ops::Range<usize>;

fn runs_above(residual: &[f64], limit: f64) -> impl Iterator<Item = Run> {
    let mut at = 0;
    std::iter::from_fn(move || {
        let start = at + residual[at..].iter().position(|r| *r > limit)?;
        let length = residual[start..].iter().take_while(|r| **r > limit).count();
        at = start + length;
        Some(start..at)
    })
}

fn is_spike(signal: &[f64], residual: &[f64], run: &Run, settings: &SpikeSettings) -> bool {
    if run.len() > settings.longest_run || run.start == 0 || run.end == signal.len() {
        return false;
    }
    let peak = residual[run.clone()].iter().copied().fold(0.0, f64::max);
    let around = |width: usize| {
        (run.start.saturating_sub(width)..run.start, run.end..(run.end + width).min(signal.len()))
    };
    let (before, after) = around(settings.neighbours);
    if peak <= settings.isolation * second_largest(residual[before].iter().chain(&residual[after])) {
        return false;
    }
    let (before, after) = around(settings.level_samples);
    match (median(&signal[before]), median(&signal[after])) {
        (Some(before), Some(after)) => (after - before).abs() < settings.level_change * peak,
        _ => false,
    }
}

fn second_largest<'a>(values: impl Iterator<Item = &'a f64>) -> f64 {
    let (_, second) =
        values.fold(
            (0.0f64, 0.0f64),
            |(first, second), &x| {
                if x > first { (x, first) } else { (first, second.max(x)) }
            },
        );
    second
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(n: usize) -> Vec<f64> {
        let mut state = 1u64;
        (0..n)
            .map(|_| {
                (0..12)
                    .map(|_| {
                        state = state
                            .wrapping_mul(6_364_136_223_846_793_005)
                            .wrapping_add(1_442_695_040_888_963_407);
                        (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
                    })
                    .sum()
            })
            .collect()
    }

    #[test]
    fn a_spike_goes_and_a_reversal_step_stays() {
        let mut signal = noise(2000);
        for x in &mut signal[1000..] {
            *x += 40.0;
        }
        signal[300] += 30.0;
        signal[700] -= 25.0;
        signal[701] -= 25.0;
        let before = signal.clone();
        let report = remove(&mut signal, &SpikeSettings::default()).unwrap();
        assert_eq!(report.flagged, [300, 700, 701]);
        assert!(report.removed);
        assert!(signal[300].abs() < 3.0 && signal[700].abs() < 3.0);
        assert_eq!(signal[995..1010], before[995..1010]);
    }

    #[test]
    fn chatter_and_crowds_stay() {
        let mut chatter = noise(3000);
        for (n, x) in chatter.iter_mut().enumerate().skip(1200).take(300) {
            *x += if n % 4 < 2 { 20.0 } else { -20.0 };
        }
        let before = chatter.clone();
        remove(&mut chatter, &SpikeSettings::default()).unwrap();
        assert_eq!(chatter, before);

        let mut crowd = noise(3000);
        for n in (20..2980).step_by(50) {
            crowd[n] += 50.0;
        }
        let report = remove(&mut crowd, &SpikeSettings::default()).unwrap();
        assert_eq!(report.flagged.len(), 60);
        assert!(!report.removed);
    }

    #[test]
    fn a_smooth_position_loses_only_its_spike() {
        let mut position: Vec<f64> =
            (0..4000).map(|k| (((f64::from(k) * 0.0004).sin()) / 2.4e-5).round() * 2.4e-5).collect();
        position[2100] += 0.01;
        let report = remove(&mut position, &SpikeSettings::position()).unwrap();
        assert_eq!(report.flagged, [2100]);
    }

    #[test]
    fn a_known_level_replaces_what_the_whole_signal_does() {
        let mut spiky = noise(3000);
        for (place, size) in [(3, 40.0), (7, -30.0), (300, 30.0), (701, -25.0), (702, -25.0), (2995, 50.0)] {
            spiky[place] += size;
        }
        for x in &mut spiky[1000..] {
            *x += 40.0;
        }
        let mut chatter = noise(3000);
        chatter.iter_mut().step_by(50).for_each(|x| *x += 50.0);
        for signal in [spiky, chatter, noise(40), vec![1.0; 30], vec![0.0, 1.0], Vec::new()] {
            let (mut whole, mut known) = (signal.clone(), signal);
            let report = remove(&mut whole, &SpikeSettings::default()).unwrap();
            let replaced = remove_at(&mut known, report.level(), &SpikeSettings::default()).unwrap();
            assert_eq!(known, whole);
            assert_eq!(replaced, if report.removed { report.flagged } else { Vec::new() });
        }
    }

    #[test]
    fn degenerate_signals_have_no_spikes() {
        for mut signal in [vec![], vec![1.0], vec![0.0; 50], vec![1.0, 2.0]] {
            assert!(remove(&mut signal, &SpikeSettings::default()).unwrap().flagged.is_empty());
        }
        assert!(remove(&mut [0.0, f64::NAN], &SpikeSettings::default()).is_err());
    }
}
