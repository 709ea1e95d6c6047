//! Where a joint moves at constant speed.

use std::collections::VecDeque;
use std::ops::Range;

use super::ConstantSpeedError;
use super::speed::{check, of_positions, of_velocity, slope};
use crate::log::JointSignals;
use crate::signal::{SignalError, check_positive};

/// What counts as constant speed.
#[derive(Debug, Clone, PartialEq)]
pub struct SegmentSettings {
    /// Least duration after trimming, s. Default 0.3.
    pub least_duration_s: f64,
    /// Largest departure from the mean speed, as a share of it. Default 0.03.
    pub speed_tolerance: f64,
    /// Largest departure from the mean speed in standard deviations of the noise of the speed; it adds to `speed_tolerance`. Default 4.
    pub noise_tolerance: f64,
    /// Cut from both ends, where the joint still speeds up or swings in, s. Default 0.1.
    pub trim_s: f64,
    /// Window over which the speed is averaged, s. Default 0.05.
    pub window_s: f64,
    /// Speeds below this are rest, rad/s or m/s. Default `None`: five standard deviations of the noise of the speed.
    pub least_speed: Option<f64>,
    /// Use the logged velocity where there is one, not the slope of the positions. Default false.
    pub use_velocity: bool,
}

/// Windows in which speed is averaged, one after the other, in units of the setting.
const WINDOWS: [f64; 3] = [1.0, 4.0, 16.0];

impl Default for SegmentSettings {
    fn default() -> Self {
        SegmentSettings {
            least_duration_s: 0.3,
            speed_tolerance: 0.03,
            noise_tolerance: 4.0,
            trim_s: 0.1,
            window_s: 0.05,
            least_speed: None,
            use_velocity: false,
        }
    }
}

impl SegmentSettings {
    fn check(&self) -> Result<(), SignalError> {
        check_positive("least_duration_s", self.least_duration_s)?;
        check_positive("speed_tolerance", self.speed_tolerance)?;
        check_positive("window_s", self.window_s)?;
        for (name, found) in [("noise_tolerance", self.noise_tolerance), ("trim_s", self.trim_s)] {
            if !(found >= 0.0 && found.is_finite()) {
                return Err(SignalError::Setting { name, expected: "0 or more", found });
            }
        }
        self.least_speed.map_or(Ok(()), |v| check_positive("least_speed", v))
    }
}

/// A stretch of constant speed, transients cut.
#[derive(Debug, Clone, PartialEq)]
pub struct Segment {
    /// Rows of the log.
    pub rows: Range<usize>,
    /// Slope of the least-squares line through its positions, signed, rad/s or m/s.
    pub speed: f64,
    /// Largest departure of the averaged speed from it, rad/s or m/s.
    pub deviation: f64,
    /// First to last sample, s.
    pub duration: f64,
}

/// Stretches of constant speed of one joint, in time order. The clock need not be uniform.
///
/// Speed is the slope of the least-squares line through the positions in a window (or the averaged velocity). Within every
/// run of one direction, the longest stretch in which the speed stays within `± (speed_tolerance |mean| + noise_tolerance
/// noise)` is taken, then the longest of what is left on either side, and so on: a staircase of speeds gives one
/// segment per step. Both ends are trimmed. What is left is looked at again with windows four and sixteen times as wide: near
/// the resolution of the encoder, slow speeds show over longer times only.
///
/// # Errors
/// [`ConstantSpeedError`] for settings out of range, fewer than three samples, values that are not finite, and time that
/// does not advance.
pub fn segments(
    time: &[f64],
    joint: &JointSignals,
    settings: &SegmentSettings,
) -> Result<Vec<Segment>, ConstantSpeedError> {
    settings.check()?;
    check(time, &[("position", &joint.position)])?;
    let logged = joint.velocity.as_ref().filter(|_| settings.use_velocity);
    if let Some(velocity) = logged {
        check(time, &[("velocity", velocity)])?;
    }
    let mut found: Vec<Segment> = Vec::new();
    for factor in WINDOWS {
        let window = factor * settings.window_s;
        let mut smoothed = match logged {
            Some(velocity) => of_velocity(time, velocity, window),
            None => of_positions(time, &joint.position, window),
        };
        for segment in &found {
            smoothed.speed[segment.rows.clone()].fill(0.0);
        }
        let least = settings.least_speed.unwrap_or(5.0 * smoothed.noise);
        let slack = settings.noise_tolerance * smoothed.noise;
        // Within half a window of a change, speeds are mixed.
        let trim = if factor > 1.0 { settings.trim_s.max(0.5 * window) } else { settings.trim_s };
        let shortest = settings.least_duration_s + 2.0 * trim;
        for run in runs(&smoothed.speed, least) {
            let mut left = vec![run];
            while let Some(rows) = left.pop() {
                let longest = |rows: Range<usize>| time[rows.end - 1] - time[rows.start];
                if rows.len() < 3 || longest(rows.clone()) < shortest {
                    continue;
                }
                let stretch = steadiest(time, &smoothed.speed, rows.clone(), settings.speed_tolerance, slack);
                if longest(stretch.clone()) < shortest {
                    continue;
                }
                left.push(rows.start..stretch.start);
                left.push(stretch.end..rows.end);
                found.extend(trimmed(time, &joint.position, &smoothed.speed, stretch, trim));
            }
        }
    }
    found.retain(|s| s.duration >= settings.least_duration_s * (1.0 - 1e-9));
    found.sort_by_key(|s| s.rows.start);
    Ok(found)
}

/// Whether a joint stands still within some rows: its positions stay within `tolerance` (rad or m), or within the noise
/// that [`JointSignals::moves`] allows for.
pub fn at_rest(joint: &JointSignals, rows: Range<usize>, tolerance: f64) -> bool {
    let position = &joint.position[rows];
    let (low, high) =
        position.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(*x), b.max(*x)));
    let alone = |position: &[f64]| JointSignals {
        name: String::new(),
        position: position.to_vec(),
        velocity: None,
        effort: Vec::new(),
    };
    position.len() < 2 || high - low <= tolerance || !alone(position).moves()
}

/// Runs of one direction.
fn runs(speed: &[f64], least: f64) -> Vec<Range<usize>> {
    let direction = |v: f64| if v > least { 1 } else { -i8::from(v < -least) };
    let mut runs = Vec::new();
    let mut start = 0;
    for k in 1..=speed.len() {
        if k == speed.len() || direction(speed[k]) != direction(speed[start]) {
            if direction(speed[start]) != 0 {
                runs.push(start..k);
            }
            start = k;
        }
    }
    runs
}

/// The longest stretch whose speeds lie within the tolerance of their middle.
fn steadiest(time: &[f64], speed: &[f64], rows: Range<usize>, share: f64, slack: f64) -> Range<usize> {
    let (mut least, mut most): (VecDeque<usize>, VecDeque<usize>) = (VecDeque::new(), VecDeque::new());
    let mut best = rows.start..rows.start + 1;
    let mut start = rows.start;
    for k in rows.clone() {
        while least.back().is_some_and(|j| speed[*j] >= speed[k]) {
            least.pop_back();
        }
        while most.back().is_some_and(|j| speed[*j] <= speed[k]) {
            most.pop_back();
        }
        least.push_back(k);
        most.push_back(k);
        loop {
            let (low, high) = (speed[least[0]], speed[most[0]]);
            if high - low <= share * (high + low).abs() + 2.0 * slack {
                break;
            }
            start += 1;
            while least[0] < start {
                least.pop_front();
            }
            while most[0] < start {
                most.pop_front();
            }
        }
        if time[k] - time[start] > time[best.end - 1] - time[best.start] {
            best = start..k + 1;
        }
    }
    best
}

fn trimmed(
    time: &[f64],
    position: &[f64],
    speed: &[f64],
    stretch: Range<usize>,
    trim: f64,
) -> Option<Segment> {
    let (first, last) = (time[stretch.start] + trim, time[stretch.end - 1] - trim);
    let start = stretch.clone().find(|k| time[*k] >= first)?;
    let end = stretch.rev().find(|k| time[*k] <= last)? + 1;
    if end < start + 3 {
        return None;
    }
    let mean = slope(&time[start..end], &position[start..end], time[start], position[start]);
    let deviation = speed[start..end].iter().map(|v| (v - mean).abs()).fold(0.0, f64::max);
    Some(Segment { rows: start..end, speed: mean, deviation, duration: time[end - 1] - time[start] })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn joint(position: Vec<f64>) -> JointSignals {
        let effort = vec![0.0; position.len()];
        JointSignals { name: "j".into(), position, velocity: None, effort }
    }

    /// Positions of a speed profile: `(duration, speed)` with ramps of 0.1 s between.
    fn motion(parts: &[(f64, f64)], rate: f64, quantum: f64) -> (Vec<f64>, Vec<f64>) {
        let (mut time, mut position) = (Vec::new(), Vec::new());
        let (mut t, mut x, mut v) = (0.0, 0.0, 0.0);
        for &(duration, speed) in parts {
            let ramp = 0.1;
            let from = v;
            let steps = (duration * rate).round() as usize;
            for k in 0..steps {
                v = from + (speed - from) * (k as f64 / rate / ramp).min(1.0);
                time.push(t);
                position.push(if quantum > 0.0 { (x / quantum).round() * quantum } else { x });
                t += 1.0 / rate;
                x += v / rate;
            }
        }
        (time, position)
    }

    #[test]
    fn a_staircase_gives_one_segment_per_step() {
        let (time, position) =
            motion(&[(0.5, 0.0), (2.0, 0.3), (2.0, 0.6), (0.5, 0.0), (2.0, -0.6), (1.0, 0.0)], 500.0, 2.4e-5);
        let found = segments(&time, &joint(position), &SegmentSettings::default()).unwrap();
        let speeds: Vec<f64> = found.iter().map(|s| s.speed).collect();
        assert_eq!(found.len(), 3, "{speeds:?}");
        for (speed, expected) in speeds.iter().zip([0.3, 0.6, -0.6]) {
            assert!((speed - expected).abs() < 1e-4, "{speeds:?}");
        }
        assert!(found.iter().all(|s| s.duration > 1.5 && s.duration < 2.0), "{found:?}");
    }

    #[test]
    fn slow_motion_of_a_coarse_encoder_is_found_and_rest_is_not() {
        let (time, position) = motion(&[(1.0, 0.0), (20.0, 0.01), (1.0, 0.0), (20.0, -0.01)], 250.0, 9.6e-5);
        let found = segments(&time, &joint(position), &SegmentSettings::default()).unwrap();
        assert_eq!(found.len(), 2, "{found:?}");
        assert!((found[0].speed - 0.01).abs() < 2e-5 && (found[1].speed + 0.01).abs() < 2e-5, "{found:?}");
    }

    #[test]
    fn a_clock_that_is_not_uniform_will_do() {
        let (time, position) = motion(&[(0.5, 0.0), (3.0, 0.5), (0.5, 0.0)], 1000.0, 0.0);
        let keep = |k: &usize| k % 7 != 3 && k % 11 != 5;
        let pick = |x: &[f64]| (0..x.len()).filter(keep).map(|k| x[k]).collect::<Vec<f64>>();
        let found = segments(&pick(&time), &joint(pick(&position)), &SegmentSettings::default()).unwrap();
        assert_eq!(found.len(), 1);
        assert!((found[0].speed - 0.5).abs() < 1e-9);
    }

    #[test]
    fn a_fast_sine_has_no_constant_speed() {
        let time: Vec<f64> = (0..4000).map(|k| f64::from(k) / 500.0).collect();
        let position = time.iter().map(|t| 0.5 * (3.0 * t).sin()).collect();
        assert!(segments(&time, &joint(position), &SegmentSettings::default()).unwrap().is_empty());
    }

    #[test]
    fn bad_input_is_named() {
        let time = vec![0.0, 1.0, 1.0, 2.0];
        let error = segments(&time, &joint(vec![0.0; 4]), &SegmentSettings::default()).unwrap_err();
        assert_eq!(error.to_string(), "time of sample 2: expected more than 1 s, found 1 s");
        let settings = SegmentSettings { trim_s: -1.0, ..SegmentSettings::default() };
        assert!(segments(&time, &joint(vec![0.0; 4]), &settings).is_err());
    }

    #[test]
    fn a_joint_at_rest_may_sag() {
        let sagging = joint((0..100).map(|k| 1e-5 * f64::from(k)).collect());
        assert!(at_rest(&sagging, 0..100, 2e-3));
        assert!(!at_rest(&sagging, 0..100, 1e-4));
    }
}
