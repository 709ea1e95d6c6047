//! The search: orders from a spectrum, judged on held-out parts.

use std::f64::consts::{PI, TAU};

use super::rows::{CyclicRows, CyclicSettings, Row, moving, passes, range};
use super::score::{Gain, Score, rss, score, without_friction, without_order};
use super::slow::{is_slow, slow_gain};
use super::spectrum::spectrum;

/// A cyclic effort found in residuals, `w (A cos nq + B sin nq)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CyclicFinding {
    /// `w` is the sign of the velocity: friction that changes over a turn. Otherwise it is 1: torque ripple.
    pub is_friction: bool,
    /// Repetitions `n` per turn (per `2π` metres for joints that slide).
    pub cycles: f64,
    /// A quarter of the distance of orders that the range of the joint tells apart; 0 for a slow order, which is a whole number.
    pub resolution: f64,
    /// Amplitude `√(A² + B²)`, N m or N.
    pub amplitude: f64,
    /// Share by which the mean square residual falls on held-out parts, all parts alike; where a few told all, the sum of squares.
    pub gain: f64,
    /// Standard error of the gain over parts.
    pub standard_error: f64,
}

impl CyclicFinding {
    /// Whether it is a torque of a slow order: what a spring or a gravity compensator leaves in a residual looks like that.
    pub fn may_be_a_spring(&self) -> bool {
        self.resolution == 0.0 && !self.is_friction
    }
}

/// Share of the rows that is slow enough for the largest order to pass the kernel.
const SLOWEST: f64 = 0.2;
/// Peaks of a spectrum that are judged.
const TRIED: usize = 3;
/// Part of what is asked for that a line of the spectrum must show: the order between the lines shows more.
const NEAR: f64 = 0.7;
/// Steps of the search for the order between its neighbours.
const STEPS: usize = 24;
/// The part of an interval that a golden section keeps.
const GOLDEN: f64 = 0.618_033_988_749_895;

/// The cyclic efforts that residuals of a joint show: at most one torque and one friction, the one that gains more first.
///
/// The order `n` is a small whole number, where any slow function of the position takes a share of the residual too, or is looked for between
/// `least_periods` over the range of the joint and the largest whose ripple passes the kernel in a fifth of the rows. At a row the kernel leaves `exp(-½ (n v σ)²)` of a ripple, `v` its speed, `σ` the kernel's standard deviation. Peaks of the spectrum
/// over position are fitted without one part of the motion each and judged there; what passes is taken off before more is looked for.
///
/// # Panics
/// If the lists differ in length or a part is not below `parts`.
pub fn find_cyclic(rows: &CyclicRows, settings: &CyclicSettings) -> Vec<CyclicFinding> {
    let Some(mut search) = Search::new(rows, settings) else { return Vec::new() };
    let mut out = Vec::new();
    let mut kinds = vec![false, true];
    while let Some(found) = search.next(&kinds) {
        kinds.retain(|is_friction| *is_friction != found.is_friction);
        out.push(found);
    }
    out
}

/// An order that passes.
struct Passed {
    is_friction: bool,
    cycles: f64,
    gain: Gain,
    coefficients: [f64; 2],
    is_slow: bool,
}

struct Search<'a> {
    settings: &'a CyclicSettings,
    rows: Vec<Row>,
    parts: usize,
    kernel_s: f64,
    range: (f64, f64),
    orders: (f64, f64),
    slow: Vec<f64>,
}

impl<'a> Search<'a> {
    /// `None` where no order can be told.
    fn new(given: &CyclicRows, settings: &'a CyclicSettings) -> Option<Self> {
        let mut rows = moving(given, settings.least_parts)?;
        if passes(&rows) < settings.least_passes {
            return None;
        }
        let (parts, kernel_s) = (&given.parts, &given.kernel_s);
        let mut speeds: Vec<f64> = rows.iter().map(|r| r.velocity.abs()).collect();
        let place = (SLOWEST * (speeds.len() - 1) as f64) as usize;
        let slow = *speeds.select_nth_unstable_by(place, f64::total_cmp).1;
        let (low, high) = range(&rows);
        let orders = (settings.least_periods * TAU / (high - low), 1.0 / (kernel_s * slow));
        if !(orders.0.is_finite() && orders.1.is_finite()) {
            return None;
        }
        without_friction(&mut rows);
        let slow =
            (1..=settings.slow_orders).map(f64::from).filter(|n| !given.slides && *n < orders.0).collect();
        Some(Search { settings, rows, parts: *parts, kernel_s: *kernel_s, range: (low, high), orders, slow })
    }

    /// The best of the kinds that passes, taken off the residuals.
    fn next(&mut self, kinds: &[bool]) -> Option<CyclicFinding> {
        let lines = match self.orders.0 < self.orders.1 {
            true => spectrum(&self.rows, self.kernel_s, self.range, self.orders),
            false => Vec::new(),
        };
        let resolution = PI / (2.0 * (self.range.1 - self.range.0));
        let mut best: Option<Passed> = None;
        let mut offer = |passed: Passed| {
            if best.as_ref().is_none_or(|other| passed.gain.share > other.gain.share) {
                best = Some(passed);
            }
        };
        for is_friction in kinds.iter().copied() {
            let judged = |n: f64| score(&self.rows, self.parts, n, is_friction, self.kernel_s);
            // One order alone may be a chance of the places that a motion passes: the residual is to be a function of the position as a whole.
            let slow = slow_gain(&self.rows, self.parts, is_friction, self.settings).map(|_| &self.slow);
            for cycles in slow.into_iter().flatten().copied() {
                let Some(Score { of_parts: gain, coefficients, .. }) = judged(cycles) else { continue };
                if is_slow(&gain, self.settings) {
                    offer(Passed { is_friction, cycles, gain, coefficients, is_slow: true });
                }
            }
            let share = |k: usize| lines[k].shares[usize::from(is_friction)];
            let worth = NEAR * self.settings.least_gain;
            let is_peak = |k: &usize| {
                let above =
                    |other: Option<usize>| other.is_none_or(|o| o >= lines.len() || share(o) < share(*k));
                share(*k) >= worth && above(k.checked_sub(1)) && above(Some(k + 1))
            };
            let mut peaks: Vec<usize> = (0..lines.len()).filter(is_peak).collect();
            peaks.sort_by(|a, b| share(*b).total_cmp(&share(*a)));
            for k in peaks.into_iter().take(TRIED) {
                if judged(lines[k].order).and_then(|found| self.passes(&found, NEAR)).is_none() {
                    continue;
                }
                let cycles = self.refined(lines[k].order, is_friction, resolution);
                let Some(found) = judged(cycles) else { continue };
                let Some(gain) = self.passes(&found, 1.0) else { continue };
                offer(Passed { is_friction, cycles, gain, coefficients: found.coefficients, is_slow: false });
            }
        }
        let Passed { is_friction, cycles, gain, coefficients, is_slow } = best?;
        without_order(&mut self.rows, cycles, is_friction, coefficients, self.kernel_s);
        let [a, b] = coefficients;
        let amplitude = a.hypot(b);
        let (gain, standard_error) = (gain.share, gain.error);
        let resolution = if is_slow { 0.0 } else { resolution };
        Some(CyclicFinding { is_friction, cycles, resolution, amplitude, gain, standard_error })
    }

    /// What an order gains, if it is enough; `part`: of what is asked for.
    fn passes(&self, found: &Score, part: f64) -> Option<Gain> {
        let CyclicSettings { sigmas, least_gain, least_gain_of_sum, .. } = self.settings;
        let enough =
            |gain: &Gain, least: f64| gain.share >= part * least && gain.share > part * sigmas * gain.error;
        let either = [(found.of_parts, *least_gain), (found.of_sum, *least_gain_of_sum)];
        either.into_iter().find(|(gain, least)| enough(gain, *least)).map(|(gain, _)| gain)
    }

    /// The order of least residual between the neighbours of a line of the spectrum, by a golden section.
    fn refined(&self, order: f64, is_friction: bool, reach: f64) -> f64 {
        let loss = |n: f64| rss(&self.rows, n, is_friction, self.kernel_s);
        let (mut low, mut high) = (order - reach, order + reach);
        let inner = |low: f64, high: f64| [high - GOLDEN * (high - low), low + GOLDEN * (high - low)];
        let [mut a, mut b] = inner(low, high);
        let (mut at_a, mut at_b) = (loss(a), loss(b));
        for _ in 0..STEPS {
            if at_a <= at_b {
                (high, b, at_b) = (b, a, at_a);
                a = inner(low, high)[0];
                at_a = loss(a);
            } else {
                (low, a, at_a) = (a, b, at_b);
                b = inner(low, high)[1];
                at_b = loss(b);
            }
        }
        0.5 * (low + high)
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt as _, SeedableRng as _};

    use super::super::find_slow;
    use super::*;

    /// 60 s of a joint at 200 rows/s with white noise of deviation 1 behind no kernel to speak of.
    fn rows(residual: impl Fn(f64, f64) -> f64) -> CyclicRows {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        let mut out = CyclicRows { parts: 20, kernel_s: 0.002, ..CyclicRows::default() };
        for k in 0..12_000 {
            let t = 0.005 * f64::from(k);
            let q = 1.1 * (0.9 * t).sin() + 0.7 * (1.37 * t + 0.4).cos();
            let v = 0.99 * (0.9 * t).cos() - 0.959 * (1.37 * t + 0.4).sin();
            let noise: f64 = (0..12).map(|_| random.random_range(-0.5..0.5)).sum();
            out.position.push(q);
            out.velocity.push(v);
            out.residual.push(residual(q, v) + noise);
            out.weight.push(1.0);
            out.part.push(k as usize / 600);
        }
        out
    }

    fn found(residual: impl Fn(f64, f64) -> f64) -> Vec<CyclicFinding> {
        find_cyclic(&rows(residual), &CyclicSettings::default())
    }

    #[test]
    fn ripple_is_found_with_its_order_and_amplitude() {
        let [torque] = found(|q, _| 0.6 * (50.3 * q + 0.7).sin() + 0.4)[..] else { panic!("one torque") };
        assert!(!torque.is_friction && (torque.cycles - 50.3).abs() < 0.02, "{torque:?}");
        assert!((torque.amplitude - 0.6).abs() < 0.05 && torque.gain > 0.1, "{torque:?}");
        let [friction] = found(|q, v| v.signum() * 0.8 * (12.0 * q).cos())[..] else {
            panic!("one friction")
        };
        assert!(friction.is_friction && (friction.cycles - 12.0).abs() < 0.02, "{friction:?}");
    }

    #[test]
    fn what_repeats_with_the_turn_of_the_joint_has_a_whole_order() {
        let [spring] = found(|q, _| 0.9 * (2.0 * q + 0.3).sin())[..] else { panic!("one torque") };
        assert!(!spring.is_friction && spring.cycles == 2.0 && spring.resolution == 0.0, "{spring:?}");
        assert!((spring.amplitude - 0.9).abs() < 0.05 && spring.gain > 0.2, "{spring:?}");
        let [gear] = found(|q, v| v.signum() * 1.5 * (2.0 * q).cos())[..] else { panic!("one friction") };
        assert!(gear.is_friction && gear.cycles == 2.0, "{gear:?}");
        let settings = CyclicSettings::default();
        let mut slides = rows(|q, _| 0.9 * (2.0 * q + 0.3).sin());
        slides.slides = true;
        assert_eq!(find_cyclic(&slides, &settings), [], "no turn");
        // Whatever function of the position it is, the residual says that it is one.
        let step = |q: f64, _: f64| if q > 0.4 { 1.0 } else { -1.0 };
        let found = find_slow(&rows(step), &settings).unwrap();
        assert!(found.share > 0.3 && found.share > 5.0 * found.standard_error, "{found:?}");
        assert_eq!(find_slow(&rows(|_, v| v.signum() + 0.3 * v), &settings), None);
    }

    #[test]
    fn both_kinds_are_found_beside_each_other() {
        let both = found(|q, v| 0.6 * (50.3 * q).sin() + v.signum() * 0.8 * (31.0 * q).cos());
        let kinds: Vec<bool> = both.iter().map(|f| f.is_friction).collect();
        assert_eq!(kinds, [true, false], "the larger one first: {both:?}");
    }

    #[test]
    fn noise_and_what_changes_slowly_are_no_ripple() {
        assert_eq!(found(|_, _| 0.0), []);
        assert_eq!(
            found(|q, _| 0.3 * (2.0 * q).sin()),
            [],
            "a twentieth of the residual: another motion need not share it"
        );
        assert_eq!(found(|_, v| v.signum() + 0.3 * v), [], "friction that is left");
    }

    #[test]
    fn joints_that_tell_nothing_have_no_findings() {
        let settings = CyclicSettings::default();
        assert_eq!(find_cyclic(&CyclicRows::default(), &settings), []);
        let mut still = rows(|q, _| (50.0 * q).sin());
        still.position.fill(0.3);
        assert_eq!(find_cyclic(&still, &settings), []);
        let mut few = rows(|q, _| (50.0 * q).sin());
        few.part.iter_mut().for_each(|p| *p %= 4);
        assert_eq!(find_cyclic(&few, &settings), [], "four parts of a motion");
        let mut once = rows(|_, _| 0.0);
        for (k, residual) in once.residual.iter_mut().enumerate() {
            (once.position[k], once.velocity[k]) = (5e-4 * k as f64, 0.1);
            *residual += (0.3 * k as f64).sin();
        }
        assert_eq!(find_cyclic(&once, &settings), [], "a vibration on a single pass");
    }
}
