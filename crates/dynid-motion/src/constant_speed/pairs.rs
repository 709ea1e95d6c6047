//! Forward and backward passes at equal speed and position.

use std::fmt;
use std::ops::Range;

use super::ConstantSpeedError;
use crate::signal::{SignalError, check_finite, check_positive};

/// Samples of one pass at constant speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pass<'a> {
    /// Signed speed, rad/s or m/s.
    pub speed: f64,
    /// Positions, rad or m.
    pub position: &'a [f64],
    /// Efforts, N m or N.
    pub effort: &'a [f64],
    /// Temperatures, °C.
    pub temperature: Option<&'a [f64]>,
}

/// What is paired with what.
#[derive(Debug, Clone, PartialEq)]
pub struct PairSettings {
    /// Speeds of one level differ from their mean by at most this share. Default 0.05.
    pub speed_tolerance: f64,
    /// Temperatures of one point differ from their mean by at most this, K. Default 1.5.
    pub temperature_tolerance: f64,
    /// Bins of the common range of positions. Default 24.
    pub bins: usize,
    /// Least samples of either direction in a bin. Default 2.
    pub least_samples: usize,
    /// Least bins of a point. Default 4.
    pub least_bins: usize,
}

impl Default for PairSettings {
    fn default() -> Self {
        PairSettings {
            speed_tolerance: 0.05,
            temperature_tolerance: 1.5,
            bins: 24,
            least_samples: 2,
            least_bins: 4,
        }
    }
}

/// Friction at one speed and temperature.
#[derive(Debug, Clone, PartialEq)]
pub struct SpeedPoint {
    /// Mean of the absolute speeds of both directions, rad/s or m/s.
    pub speed: f64,
    /// Mean temperature of all passes, °C.
    pub temperature: Option<f64>,
    /// Half the difference of the efforts of both directions, mean over bins, N m or N.
    pub friction: f64,
    /// Standard error of [`Self::friction`] from the scatter of the bins, inflated by their correlation, N m or N.
    pub std: f64,
    /// Half the sum of the efforts of both directions: gravity and offset, mean over bins, N m or N.
    pub half_sum: f64,
    /// Bins that both directions fill.
    pub bins: usize,
    /// Samples in them.
    pub samples: usize,
    /// Range of positions that both directions share.
    pub positions: (f64, f64),
    /// Passes used, forward and backward, ascending.
    pub passes: Vec<usize>,
}

/// Figures of a pass of its own, friction and gravity together.
#[derive(Debug, Clone, PartialEq)]
pub struct PassSummary {
    /// Signed speed, rad/s or m/s.
    pub speed: f64,
    /// Mean temperature, °C.
    pub temperature: Option<f64>,
    /// Mean effort, N m or N.
    pub effort: f64,
    /// Standard deviation of the effort, N m or N.
    pub spread: f64,
    /// Samples.
    pub samples: usize,
    /// Lowest and highest position.
    pub positions: (f64, f64),
}

/// A pass that went into no point.
#[derive(Debug, Clone, PartialEq)]
pub struct Unpaired {
    /// Index of the pass.
    pub pass: usize,
    /// Why.
    pub reason: UnpairedReason,
    /// What it says by itself.
    pub summary: PassSummary,
}

/// Why a pass went into no point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum UnpairedReason {
    /// No pass of the other direction at all.
    OneDirection,
    /// None of the other direction at this speed; the nearest absolute speed there, rad/s or m/s.
    NoEqualSpeed {
        /// The nearest one.
        nearest: f64,
    },
    /// The other direction ran at this speed, but at another temperature.
    OtherTemperature,
    /// Too few positions that both directions pass.
    NoCommonPositions,
}

impl fmt::Display for UnpairedReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            UnpairedReason::OneDirection => f.write_str(
                "no pass in the other direction: Coulomb friction and offset or gravity cannot be told apart",
            ),
            UnpairedReason::NoEqualSpeed { nearest } => {
                write!(f, "no pass in the other direction at this speed, the nearest is {nearest:.4}")
            }
            UnpairedReason::OtherTemperature => {
                f.write_str("the other direction ran at this speed at another temperature only")
            }
            UnpairedReason::NoCommonPositions => {
                f.write_str("both directions share too few positions at this speed")
            }
        }
    }
}

/// What forward and backward passes say.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Pairing {
    /// Friction by speed and temperature, ascending by temperature, then by speed.
    pub points: Vec<SpeedPoint>,
    /// Passes without a partner.
    pub unpaired: Vec<Unpaired>,
}

impl Pairing {
    /// Whether there were passes, all in one direction.
    pub fn one_direction(&self) -> bool {
        self.points.is_empty()
            && !self.unpaired.is_empty()
            && self.unpaired.iter().all(|u| u.reason == UnpairedReason::OneDirection)
    }
}

/// Pairs forward and backward passes of equal speed and temperature over their common positions.
///
/// Passes are grouped by absolute speed, then by temperature. In a group, the range of positions that both directions
/// pass is cut into bins; a bin counts if both directions fill it. With `F`, `B` the means of all forward and backward samples of a
/// bin, friction is the mean of `(F - B)/2` over bins and gravity with offset that of `(F + B)/2`. The standard error is
/// `s sqrt((1 + r)/((1 - r) n))` from the scatter `s` of the `n` bins and the correlation `r ≥ 0` of neighbours.
///
/// # Errors
/// [`ConstantSpeedError::Signal`] for settings out of range, values that are not finite and signals of unequal length.
pub fn pair(passes: &[Pass<'_>], settings: &PairSettings) -> Result<Pairing, ConstantSpeedError> {
    check(passes, settings)?;
    let mut out = Pairing::default();
    let forward = |k: &usize| passes[*k].speed > 0.0;
    let both = (0..passes.len()).any(|k| forward(&k)) && (0..passes.len()).any(|k| !forward(&k));
    let summaries: Vec<PassSummary> = passes.iter().map(summary).collect();
    let mut drop = |group: &[usize], reason: &dyn Fn(usize) -> UnpairedReason| {
        for &pass in group {
            out.unpaired.push(Unpaired { pass, reason: reason(pass), summary: summaries[pass].clone() });
        }
    };
    let speed = |k: usize| passes[k].speed.abs();
    let all: Vec<usize> = (0..passes.len()).collect();
    for level in grouped(&all, &speed, &|mean| settings.speed_tolerance * mean) {
        if !(level.iter().any(forward) && level.iter().any(|k| !forward(k))) {
            drop(&level, &|k| match both {
                false => UnpairedReason::OneDirection,
                true => UnpairedReason::NoEqualSpeed { nearest: nearest(passes, k) },
            });
            continue;
        }
        let (known, unknown): (Vec<usize>, Vec<usize>) =
            level.iter().partition(|k| summaries[**k].temperature.is_some());
        let warmth = |k: usize| summaries[k].temperature.unwrap_or(0.0);
        let mut groups = grouped(&known, &warmth, &|_| settings.temperature_tolerance);
        if !unknown.is_empty() {
            groups.push(unknown);
        }
        for group in groups {
            if !(group.iter().any(forward) && group.iter().any(|k| !forward(k))) {
                drop(&group, &|_| UnpairedReason::OtherTemperature);
                continue;
            }
            match point(passes, &summaries, &group, settings) {
                Some(point) => out.points.push(point),
                None => drop(&group, &|_| UnpairedReason::NoCommonPositions),
            }
        }
    }
    let warmth = |p: &SpeedPoint| p.temperature.unwrap_or(f64::NEG_INFINITY);
    out.points.sort_by(|a, b| warmth(a).total_cmp(&warmth(b)).then(a.speed.total_cmp(&b.speed)));
    out.unpaired.sort_by_key(|u| u.pass);
    Ok(out)
}

fn check(passes: &[Pass<'_>], settings: &PairSettings) -> Result<(), SignalError> {
    check_positive("speed_tolerance", settings.speed_tolerance)?;
    check_positive("temperature_tolerance", settings.temperature_tolerance)?;
    for (name, found) in [("bins", settings.bins), ("least_bins", settings.least_bins)] {
        if found < 2 {
            return Err(SignalError::Setting { name, expected: "2 or more", found: found as f64 });
        }
    }
    for pass in passes {
        let expected = pass.position.len();
        for (what, signal) in [("effort", Some(pass.effort)), ("temperature", pass.temperature)] {
            let Some(signal) = signal else { continue };
            if signal.len() != expected {
                return Err(SignalError::Length { what, expected, found: signal.len() });
            }
            check_finite(signal)?;
        }
        check_finite(pass.position)?;
        check_finite(&[pass.speed])?;
    }
    Ok(())
}

fn summary(pass: &Pass<'_>) -> PassSummary {
    let n = pass.effort.len().max(1) as f64;
    let effort = pass.effort.iter().sum::<f64>() / n;
    let spread = (pass.effort.iter().map(|e| (e - effort).powi(2)).sum::<f64>() / n).sqrt();
    PassSummary {
        speed: pass.speed,
        temperature: pass.temperature.map(|t| t.iter().sum::<f64>() / n),
        effort,
        spread,
        samples: pass.effort.len(),
        positions: extent(pass.position),
    }
}

fn extent(x: &[f64]) -> (f64, f64) {
    x.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(*x), b.max(*x)))
}

/// Groups of neighbours: the next larger value joins while it lies within the tolerance of the group's mean.
fn grouped(
    passes: &[usize],
    value: &dyn Fn(usize) -> f64,
    tolerance: &dyn Fn(f64) -> f64,
) -> Vec<Vec<usize>> {
    let mut sorted = passes.to_vec();
    sorted.sort_by(|a, b| value(*a).total_cmp(&value(*b)).then(a.cmp(b)));
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for k in sorted {
        match groups.last_mut() {
            Some(group) => {
                let mean = group.iter().map(|j| value(*j)).sum::<f64>() / group.len() as f64;
                if value(k) - mean <= tolerance(mean) { group.push(k) } else { groups.push(vec![k]) }
            }
            None => groups.push(vec![k]),
        }
    }
    groups
}

fn nearest(passes: &[Pass<'_>], k: usize) -> f64 {
    let own = passes[k].speed;
    let others = passes.iter().map(|p| p.speed).filter(|v| (*v > 0.0) != (own > 0.0)).map(f64::abs);
    others.min_by(|a, b| (a - own.abs()).abs().total_cmp(&(b - own.abs()).abs())).unwrap_or(f64::NAN)
}

fn point(
    passes: &[Pass<'_>],
    summaries: &[PassSummary],
    group: &[usize],
    settings: &PairSettings,
) -> Option<SpeedPoint> {
    let side = |forward: bool| group.iter().copied().filter(move |k| (passes[*k].speed > 0.0) == forward);
    let range = |forward: bool| {
        side(forward)
            .map(|k| summaries[k].positions)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), p| (a.min(p.0), b.max(p.1)))
    };
    let ((a, b), (c, d)) = (range(true), range(false));
    let (low, high) = (a.max(c), b.min(d));
    if high <= low {
        return None;
    }
    let bins = settings.bins;
    let sums = |forward: bool| {
        let mut sums = vec![(0.0, 0_usize); bins];
        for k in side(forward) {
            for (q, e) in passes[k].position.iter().zip(passes[k].effort) {
                if (low..=high).contains(q) {
                    let bin = (((q - low) / (high - low) * bins as f64) as usize).min(bins - 1);
                    sums[bin].0 += e;
                    sums[bin].1 += 1;
                }
            }
        }
        sums
    };
    let (forward, backward) = (sums(true), sums(false));
    let (mut halves, mut samples) = (Vec::new(), 0);
    for ((f, n), (b, m)) in forward.iter().zip(&backward) {
        if *n >= settings.least_samples.max(1) && *m >= settings.least_samples.max(1) {
            let (f, b) = (f / *n as f64, b / *m as f64);
            halves.push((0.5 * (f - b), 0.5 * (f + b)));
            samples += n + m;
        }
    }
    let n = halves.len();
    if n < settings.least_bins {
        return None;
    }
    let mean = |of: &dyn Fn(&(f64, f64)) -> f64| halves.iter().map(of).sum::<f64>() / n as f64;
    let (friction, half_sum) = (mean(&|h| h.0), mean(&|h| h.1));
    let speeds = |forward: bool| {
        let list: Vec<f64> = side(forward).map(|k| passes[k].speed.abs()).collect();
        list.iter().sum::<f64>() / list.len() as f64
    };
    let temperatures: Vec<f64> = group.iter().filter_map(|k| summaries[*k].temperature).collect();
    let differences: Vec<f64> = halves.iter().map(|h| h.0 - friction).collect();
    let mut used = group.to_vec();
    used.sort_unstable();
    Some(SpeedPoint {
        speed: 0.5 * (speeds(true) + speeds(false)),
        temperature: (!temperatures.is_empty())
            .then(|| temperatures.iter().sum::<f64>() / temperatures.len() as f64),
        friction,
        std: standard_error(&differences),
        half_sum,
        bins: n,
        samples,
        positions: (low, high),
        passes: used,
    })
}

/// Standard error of the mean of neighbours that may be correlated.
fn standard_error(differences: &[f64]) -> f64 {
    let n = differences.len() as f64;
    let energy: f64 = differences.iter().map(|d| d * d).sum();
    if energy == 0.0 {
        return 0.0;
    }
    let neighbours: f64 = differences.windows(2).map(|d| d[0] * d[1]).sum();
    let r = (neighbours / energy).clamp(0.0, 0.9);
    (energy / (n - 1.0) * (1.0 + r) / ((1.0 - r) * n)).sqrt()
}

impl<'a> Pass<'a> {
    /// The rows of a segment, from signals of the whole log.
    pub fn of(
        speed: f64,
        rows: &Range<usize>,
        position: &'a [f64],
        effort: &'a [f64],
        temperature: Option<&'a [f64]>,
    ) -> Self {
        Pass {
            speed,
            position: &position[rows.clone()],
            effort: &effort[rows.clone()],
            temperature: temperature.map(|t| &t[rows.clone()]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Samples {
        speed: f64,
        position: Vec<f64>,
        effort: Vec<f64>,
        temperature: Vec<f64>,
    }

    impl Samples {
        /// A pass from -1 to 1 rad under gravity `3 cos q`, an offset of 0.4 and friction `2 + speed`.
        fn new(speed: f64, temperature: f64, from: f64) -> Self {
            let position: Vec<f64> = (0..400).map(|k| from + 2.0 * f64::from(k) / 399.0).collect();
            let friction = (2.0 + speed.abs()) * speed.signum();
            let effort = position.iter().map(|q| 3.0 * q.cos() + 0.4 + friction).collect();
            Samples { speed, effort, temperature: vec![temperature; position.len()], position }
        }

        fn pass(&self) -> Pass<'_> {
            Pass {
                speed: self.speed,
                position: &self.position,
                effort: &self.effort,
                temperature: Some(&self.temperature),
            }
        }
    }

    fn pairing(samples: &[Samples]) -> Pairing {
        let passes: Vec<Pass<'_>> = samples.iter().map(Samples::pass).collect();
        pair(&passes, &PairSettings::default()).unwrap()
    }

    #[test]
    fn gravity_and_offset_cancel_and_all_passes_are_used() {
        let samples = [
            Samples::new(0.5, 30.0, -1.0),
            Samples::new(-0.5, 30.2, -1.0),
            Samples::new(0.501, 30.4, -1.0),
            Samples::new(-0.499, 30.1, -1.0),
        ];
        let found = pairing(&samples);
        assert_eq!((found.points.len(), found.unpaired.len()), (1, 0));
        let point = &found.points[0];
        assert!((point.friction - 2.5).abs() < 1e-12, "{point:?}");
        assert!((point.half_sum - (0.4 + 3.0 * 1f64.sin())).abs() < 0.01, "{point:?}");
        assert_eq!(point.passes, [0, 1, 2, 3]);
        assert!((point.temperature.unwrap() - 30.175).abs() < 1e-9);
        assert_eq!(point.samples, 1600);
    }

    #[test]
    fn passes_without_a_partner_say_why() {
        let samples = [
            Samples::new(0.5, 30.0, -1.0),
            Samples::new(-0.5, 30.0, -1.0),
            Samples::new(1.0, 30.0, -1.0),
            Samples::new(0.5, 45.0, -1.0),
            Samples::new(2.0, 30.0, -1.0),
            Samples::new(-2.0, 30.0, 5.0),
        ];
        let found = pairing(&samples);
        assert_eq!(found.points.len(), 1);
        let reasons: Vec<(usize, UnpairedReason)> =
            found.unpaired.iter().map(|u| (u.pass, u.reason)).collect();
        assert_eq!(
            reasons,
            [
                (2, UnpairedReason::NoEqualSpeed { nearest: 0.5 }),
                (3, UnpairedReason::OtherTemperature),
                (4, UnpairedReason::NoCommonPositions),
                (5, UnpairedReason::NoCommonPositions),
            ]
        );
    }

    #[test]
    fn one_direction_alone_is_said() {
        let found = pairing(&[Samples::new(0.5, 30.0, -1.0), Samples::new(1.0, 30.0, -1.0)]);
        assert!(found.one_direction());
        assert!(found.unpaired[0].reason.to_string().contains("cannot be told apart"));
        assert!((found.unpaired[0].summary.effort - (2.9 + 3.0 * 1f64.sin())).abs() < 0.02);
    }

    #[test]
    fn the_standard_error_covers_correlated_scatter() {
        // A ripple of friction over position: neighbouring bins agree, so that 24 bins are worth far fewer.
        let mut forward = Samples::new(0.5, 30.0, -1.0);
        let ripple = |q: f64| 0.2 * (3.0 * q + 0.5).sin();
        for (e, q) in forward.effort.iter_mut().zip(&forward.position) {
            *e += 2.0 * ripple(*q);
        }
        let found = pairing(&[forward, Samples::new(-0.5, 30.0, -1.0)]);
        let point = &found.points[0];
        let plain = 0.2 / 2f64.sqrt() / 24f64.sqrt();
        assert!(point.std > 2.0 * plain, "{} {plain}", point.std);
        assert!((point.friction - 2.5).abs() < 3.0 * point.std, "{point:?}");
    }
}
