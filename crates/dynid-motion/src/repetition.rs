//! Whether a motion repeats, and after what time.
//!
//! What a model leaves over at a place and speed comes back whenever a motion does: rows of later periods are no independent witnesses of it.

use crate::signal::rms;

/// Samples per second at which lags are looked through.
const COARSE_HZ: f64 = 20.0;
/// Fewest and most samples of that.
const COARSE: (usize, usize) = (64, 3000);
/// Shortest time after which a motion may repeat, s; what repeats sooner has come round several times then.
const SHORTEST_S: f64 = 0.5;
/// Difference of positions, in standard deviations of them, up to which coarse samples and samples agree.
const ALIKE: (f64, f64) = (0.3, 0.05);
/// Share of the samples that must agree, all joints at once: approach, return and pauses need not.
const SHARE: f64 = 0.6;
/// The motion must have been elsewhere in between: at most this share agrees at some shorter lag.
const ELSEWHERE: f64 = 0.3;
/// Share of the record that must be left behind a lag, for the two to be compared.
const OVERLAP: f64 = 0.2;
/// Where samples agree positions must spread by this share of what they do over the record: rest agrees with rest.
const SPREAD: f64 = 0.3;
/// Means and spreads of the same motion differ by at most this, in spreads.
const LIKE: f64 = 0.25;
/// Lags that are looked at closely.
const CANDIDATES: usize = 12;
/// Samples of a close look.
const CLOSE: usize = 2000;

/// Time after which the motion of a log repeats, samples, not whole; `None` if it does not within 80 % of the log.
///
/// `positions`: per joint that moves, of one length. A motion repeats after a lag if all joints are back within 5 % of their
/// standard deviations at 60 % of the samples, having been elsewhere in between.
pub fn repetition(positions: &[&[f64]], rate_hz: f64) -> Option<f64> {
    let samples = positions.first()?.len();
    let spreads: Vec<f64> = positions.iter().map(|q| deviation(q)).collect();
    if samples < COARSE.0 || spreads.iter().any(|s| !(*s > 0.0 && s.is_finite())) {
        return None;
    }
    let wanted = (samples as f64 / rate_hz * COARSE_HZ).ceil() as usize;
    let step = samples.div_ceil(wanted.clamp(COARSE.0, COARSE.1)).max(1);
    let scaled: Vec<Vec<f64>> = (positions.iter().zip(&spreads))
        .map(|(q, spread)| q.iter().step_by(step).map(|x| x / spread).collect())
        .collect();
    let coarse = scaled[0].len();
    let shortest = ((SHORTEST_S * rate_hz / step as f64).ceil() as usize).max(2);
    let longest = ((1.0 - OVERLAP) * coarse as f64) as usize;
    let shares: Vec<f64> = (0..=longest).map(|lag| coarse_share(&scaled, lag)).collect();
    let close = |around: usize, room: usize| closest(positions, &spreads, around, room);
    let mut lag = shares.iter().position(|share| *share < ELSEWHERE)?.max(shortest);
    for _ in 0..CANDIDATES {
        // A stretch of lags at which most samples agree, and the best of it, which may be several alike.
        lag += shares.get(lag..)?.iter().position(|share| *share >= SHARE)?;
        let stretch = shares[lag..].iter().take_while(|share| **share >= SHARE).count();
        let best = shares[lag..lag + stretch].iter().copied().fold(0.0, f64::max);
        let of_best = |k: &usize| shares[*k] == best;
        let first = (lag..lag + stretch).find(of_best)?;
        let last = (lag..lag + stretch).rfind(of_best)?;
        if let Some(found) = close((first + last) * step / 2, (last - first + 2) * step) {
            // Of several periods together the lag is known better.
            let periods = ((1.0 - OVERLAP) * samples as f64 / found as f64) as usize;
            let together = (periods > 1).then(|| close(periods * found, periods)).flatten();
            return Some(together.map_or(found as f64, |lag| lag as f64 / periods as f64));
        }
        lag += stretch;
    }
    None
}

/// By how many samples a motion lies behind another one of the same sample rate that it repeats: `b(t) = a(t + lag)`. `None` if it is another
/// motion: positions must agree as [`repetition`] says, at 60 % of the samples of `b` or more.
///
/// `a`, `b`: per joint, in the same order.
pub fn repeated_from(a: &[&[f64]], b: &[&[f64]], rate_hz: f64) -> Option<isize> {
    let (of_a, of_b) = (a.first()?.len(), b.first()?.len());
    let spreads: Vec<f64> = a.iter().map(|q| deviation(q)).collect();
    if a.len() != b.len() || of_a.min(of_b) < COARSE.0 || spreads.iter().any(|s| !(*s > 0.0 && s.is_finite()))
    {
        return None;
    }
    let mean = |q: &[f64]| q.iter().sum::<f64>() / q.len() as f64;
    let alike = |((a, b), spread): ((&&[f64], &&[f64]), &f64)| {
        (deviation(b) / spread - 1.0).abs() < LIKE && (mean(a) - mean(b)).abs() < LIKE * spread
    };
    if !a.iter().zip(b).zip(&spreads).all(alike) {
        return None;
    }
    let wanted = (of_a.max(of_b) as f64 / rate_hz * COARSE_HZ).ceil() as usize;
    let step = of_a.max(of_b).div_ceil(wanted.clamp(COARSE.0, COARSE.1)).max(1);
    let coarse = |signals: &[&[f64]]| -> Vec<Vec<f64>> {
        let of = |(q, spread): (&&[f64], &f64)| q.iter().step_by(step).map(|x| x / spread).collect();
        signals.iter().zip(&spreads).map(of).collect()
    };
    let (x, y) = (coarse(a), coarse(b));
    let (n, m) = (x[0].len() as isize, y[0].len() as isize);
    let least = (SHARE * m as f64) as isize;
    let agreeing = |lag: isize| {
        let range = (-lag).max(0)..(n - lag).min(m);
        range
            .filter(|t| {
                x.iter().zip(&y).all(|(x, y)| (x[(t + lag) as usize] - y[*t as usize]).abs() <= ALIKE.0)
            })
            .count()
    };
    let lags: Vec<isize> = (least - m..=n - least).collect();
    let counts: Vec<usize> = lags.iter().map(|lag| agreeing(*lag)).collect();
    let most = *counts.iter().max()?;
    if (most as f64) < SHARE * m as f64 {
        return None;
    }
    // Several lags may be as good by coarse samples.
    let first = counts.iter().position(|count| *count == most)?;
    let alike = counts[first..].iter().take_while(|count| **count == most).count();
    let (lag, room) = (lags[first + alike / 2], alike as isize / 2 + 2);
    let step = step as isize;
    let overlap = |lag: isize| (-lag).max(0)..(of_a as isize - lag).min(of_b as isize);
    let off = |lag: isize, t: isize| {
        let of =
            |((a, b), s): ((&&[f64], &&[f64]), &f64)| ((a[(t + lag) as usize] - b[t as usize]) / s).abs();
        a.iter().zip(b).zip(&spreads).map(of).fold(0.0, f64::max)
    };
    let misfit = |lag: &isize| {
        let range = overlap(*lag);
        let stride = (range.len() / CLOSE).max(1);
        let (count, range) = (range.len().div_ceil(stride).max(1), range.step_by(stride));
        range.map(|t| (off(*lag, t) / ALIKE.1).powi(2).min(1.0)).sum::<f64>() / count as f64
    };
    let close = ((lag - room) * step..=(lag + room) * step).filter(|lag| !overlap(*lag).is_empty());
    let lag = close.min_by(|p, q| misfit(p).total_cmp(&misfit(q)))?;
    let same: Vec<isize> = overlap(lag).filter(|t| off(lag, *t) <= ALIKE.1).collect();
    let moves = |(b, spread): (&&[f64], &f64)| {
        let there: Vec<f64> = same.iter().map(|t| b[*t as usize]).collect();
        deviation(&there) >= SPREAD * spread
    };
    (same.len() as f64 >= SHARE * of_b as f64 && b.iter().zip(&spreads).all(moves)).then_some(lag)
}

fn deviation(signal: &[f64]) -> f64 {
    let mean = signal.iter().sum::<f64>() / signal.len().max(1) as f64;
    rms(&signal.iter().map(|x| x - mean).collect::<Vec<_>>())
}

/// Share of coarse samples at which all joints agree with themselves so much later.
fn coarse_share(scaled: &[Vec<f64>], lag: usize) -> f64 {
    let count = scaled[0].len() - lag;
    let alike = |t: usize| scaled.iter().all(|q| (q[t + lag] - q[t]).abs() <= ALIKE.0);
    (0..count).filter(|t| alike(*t)).count() as f64 / count as f64
}

/// The lag within `room` of another at which positions agree best, if enough of them do, and move there.
fn closest(positions: &[&[f64]], spreads: &[f64], around: usize, room: usize) -> Option<usize> {
    let samples = positions[0].len();
    let least = ((1.0 - SHARE) * OVERLAP * samples as f64) as usize;
    let lags = around.saturating_sub(room).max(1)..=(around + room).min(samples - least.max(2));
    let misfit = |lag: usize| {
        let stride = (samples - lag).div_ceil(CLOSE);
        let (mut sum, mut count) = (0.0, 0);
        for t in (0..samples - lag).step_by(stride) {
            let off = |(q, spread): (&&[f64], &f64)| ((q[t + lag] - q[t]) / spread).abs();
            let worst = positions.iter().zip(spreads).map(off).fold(0.0, f64::max);
            sum += (worst / ALIKE.1).powi(2).min(1.0);
            count += 1;
        }
        sum / f64::from(count)
    };
    let lag = lags.min_by(|a, b| misfit(*a).total_cmp(&misfit(*b)))?;
    let alike = |t: &usize| {
        positions.iter().zip(spreads).all(|(q, spread)| (q[t + lag] - q[*t]).abs() <= ALIKE.1 * spread)
    };
    let same: Vec<usize> = (0..samples - lag).filter(alike).collect();
    let moves = |(q, spread): (&&[f64], &f64)| {
        let there: Vec<f64> = same.iter().map(|t| q[*t]).collect();
        deviation(&there) >= SPREAD * spread
    };
    let is_repeated = same.len() as f64 >= SHARE * (samples - lag) as f64;
    (is_repeated && positions.iter().zip(spreads).all(moves)).then_some(lag)
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE_HZ: f64 = 250.0;

    /// Two joints of a Fourier motion of some period with noise of encoders, for some time.
    fn motion(period_s: f64, duration_s: f64, noise: f64) -> [Vec<f64>; 2] {
        let mut state = 1_u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as f64 / (1_u64 << 31) as f64 - 0.5
        };
        let omega = std::f64::consts::TAU / period_s;
        let count = (duration_s * RATE_HZ) as usize;
        [1.0, 2.0].map(|phase| {
            (0..count)
                .map(|k| {
                    let t = k as f64 / RATE_HZ;
                    let of = |l: i32| (f64::from(l) * (omega * t + phase)).sin() / f64::from(l);
                    (1..=5).map(of).sum::<f64>() + noise * random()
                })
                .collect()
        })
    }

    fn found(signals: &[Vec<f64>; 2]) -> Option<f64> {
        repetition(&signals.each_ref().map(Vec::as_slice), RATE_HZ).map(|samples| samples / RATE_HZ)
    }

    #[test]
    fn periods_are_found_whatever_their_number() {
        for (period_s, duration_s) in
            [(5.0, 60.0), (5.0, 8.0), (2.013, 30.0), (20.0, 60.0), (0.9, 40.0), (7.77, 700.0)]
        {
            let found = found(&motion(period_s, duration_s, 1e-3)).unwrap_or(f64::NAN);
            assert!((found / period_s - 1.0).abs() < 2e-3, "{period_s} for {duration_s}: {found}");
        }
    }

    #[test]
    fn what_does_not_repeat_has_no_period() {
        assert_eq!(found(&motion(60.0, 60.0, 1e-3)), None);
        assert_eq!(found(&motion(60.0, 70.0, 1e-3)), None);
        // Periods that have no common multiple within the record.
        let mut two = motion(5.0, 60.0, 0.0);
        two[1] = motion(std::f64::consts::E * 2.0, 60.0, 0.0)[1].clone();
        assert_eq!(found(&two), None);
        // A motion between rests at one place.
        let still = |q: &Vec<f64>| [vec![q[0]; 4000], q.clone(), vec![q[0]; 4000]].concat();
        assert_eq!(found(&motion(20.0, 20.0, 0.0).each_ref().map(still)), None);
        let ramp = [0.3, 0.5].map(|v| (0..8000).map(|k| v * f64::from(k)).collect());
        assert_eq!(found(&ramp), None);
    }

    #[test]
    fn the_same_motion_in_two_records_is_found_with_its_lag() {
        let slices = |signals: &[Vec<f64>; 2]| signals.each_ref().map(|q| q.clone());
        let [first, again] = [1e-3, 2e-3].map(|noise| slices(&motion(20.0, 20.0, noise)));
        let of = |a: &[Vec<f64>; 2], b: &[Vec<f64>; 2]| {
            repeated_from(&a.each_ref().map(Vec::as_slice), &b.each_ref().map(Vec::as_slice), RATE_HZ)
        };
        assert_eq!(of(&first, &again), Some(0));
        let later = again.each_ref().map(|q| q[300..].to_vec());
        assert_eq!(of(&first, &later), Some(300));
        assert_eq!(of(&later, &first), Some(-300));
        assert_eq!(of(&first, &motion(21.0, 20.0, 1e-3)), None);
        let other = [first[1].clone(), first[0].clone()];
        assert_eq!(of(&first, &other), None);
    }

    #[test]
    fn approach_and_return_need_not_repeat() {
        let with_ways = |q: &Vec<f64>| {
            let way = |from: f64, to: f64| (0..800).map(move |k| from + (to - from) * f64::from(k) / 800.0);
            way(3.0, q[0]).chain(q.iter().copied()).chain(way(q[q.len() - 1], 3.0)).collect()
        };
        let found = found(&motion(5.0, 30.0, 1e-3).each_ref().map(with_ways)).unwrap_or(f64::NAN);
        assert!((found / 5.0 - 1.0).abs() < 2e-3, "{found}");
    }
}
