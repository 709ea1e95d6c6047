//! Motions that anybody can run: one joint, or two neighbouring joints, for some seconds.

use std::f64::consts::{PI, TAU};

use dynid_model::{JointKind, Mechanism};
use dynid_motion::trajectory::{Point, Quintic};

use crate::prior;

/// What a motion is like. Amplitudes are the largest for which every limit holds by a bound, with `f_c` the cut-off of
/// the rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MotionKind {
    /// Moves of a second between poses over the range, a second of rest at each. Only joints without dry friction give
    /// rows at rest.
    Hold,
    /// Two sines of 0.1 and 0.23 Hz at a quarter of the speed.
    Slow,
    /// Two sines, at the frequency at which range and speed are both used up (0.1 Hz to `f_c/4`) and 2.24 times that.
    Fast,
    /// A slow sweep over half the range with two sines of `min(2 Hz, f_c/3)` and 1.4 times that on it.
    Bursts,
}

/// A motion of one joint, or of two at different frequencies. All other joints rest at 30 % of their range: in the
/// middle many arms are stretched out, and effects vanish.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Motion {
    /// What it is like.
    pub kind: MotionKind,
    /// Rates that move.
    pub rates: Vec<usize>,
}

/// Limits and length of the motions.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionSettings {
    /// Length, s. Default 10.
    pub duration_s: f64,
    /// Share of position range and speed limit in use. Default 0.8.
    pub share: f64,
    /// Largest acceleration, rad/s² or m/s². Default 10.
    pub acceleration: f64,
}

impl Default for MotionSettings {
    fn default() -> Self {
        MotionSettings { duration_s: 10.0, share: 0.8, acceleration: 10.0 }
    }
}

impl Motion {
    /// The motion in words. `joints`: names of the rates.
    pub fn words(&self, joints: &[String]) -> String {
        let of = match self.rates[..] {
            [one] => format!("of joint {}", joints[one]),
            _ => {
                let names: Vec<&str> = self.rates.iter().map(|r| joints[*r].as_str()).collect();
                format!("of joints {} together", names.join(" and "))
            }
        };
        match self.kind {
            MotionKind::Hold => format!("motion between poses {of}"),
            MotionKind::Slow => format!("slow motion {of}"),
            MotionKind::Fast => format!("fast motion {of}"),
            MotionKind::Bursts => format!("short bursts of acceleration {of}"),
        }
    }
}

/// All motions to try, simple ones first.
pub(super) fn library(mechanism: &Mechanism) -> Vec<Motion> {
    let rates = mechanism.rates();
    let mut all = Vec::new();
    for kind in [MotionKind::Hold, MotionKind::Slow, MotionKind::Fast, MotionKind::Bursts] {
        all.extend((0..rates).map(|rate| Motion { kind, rates: vec![rate] }));
    }
    let owners = mechanism.rate_bodies();
    let rate_of = |body: usize| {
        let rate = mechanism.bodies()[body].rate;
        mechanism.follows().map_or(rate, |f| f[rate].coordinate)
    };
    for kind in [MotionKind::Slow, MotionKind::Fast, MotionKind::Bursts] {
        for (rate, body) in owners.iter().enumerate() {
            if let Some(parent) = mechanism.bodies()[*body].parent.map(rate_of)
                && parent != rate
            {
                all.push(Motion { kind, rates: vec![parent, rate] });
            }
        }
    }
    all
}

/// What a joint may do.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reach {
    low: f64,
    high: f64,
    speed: f64,
    acceleration: f64,
}

impl Reach {
    /// Limits of all coordinates, the share of them in use. Positions: as stated, ±2 rad (±0.5 m) by default and for
    /// endless joints, at most π (1 m) from the middle.
    pub(super) fn of(mechanism: &Mechanism, settings: &MotionSettings) -> Vec<Reach> {
        mechanism
            .rate_bodies()
            .iter()
            .map(|body| {
                let joint = &mechanism.bodies()[*body].joint;
                let slides = joint.kind == JointKind::Prismatic;
                let (default, most) = if slides { (0.5, 1.0) } else { (2.0, PI) };
                let (low, high) = joint
                    .limits
                    .position
                    .filter(|(l, h)| {
                        joint.kind != JointKind::Continuous && l.is_finite() && h.is_finite() && h > l
                    })
                    .unwrap_or((-default, default));
                let (middle, half) = (0.5 * (low + high), settings.share * (0.5 * (high - low)).min(most));
                Reach {
                    low: middle - half,
                    high: middle + half,
                    speed: settings.share * prior::speed_limit(slides, joint.limits.velocity),
                    acceleration: settings.acceleration,
                }
            })
            .collect()
    }

    fn half(&self) -> f64 {
        0.5 * (self.high - self.low)
    }

    fn middle(&self) -> f64 {
        0.5 * (self.low + self.high)
    }

    fn part(&self, share: f64) -> Reach {
        let half = share * self.half();
        Reach {
            low: self.middle() - half,
            high: self.middle() + half,
            speed: share * self.speed,
            acceleration: share * self.acceleration,
        }
    }
}

/// The course of one joint.
#[derive(Debug)]
pub(super) enum Course {
    Rest(f64),
    Poses(Vec<Quintic>),
    /// Middle, and `(amplitude, angular frequency, phase)`.
    Tones(f64, Vec<(f64, f64, f64)>),
}

/// Time from one pose to the next, of which half is motion, s.
const POSE_S: f64 = 2.0;

impl Course {
    pub(super) fn rest(reach: &Reach) -> Course {
        Course::Rest(reach.low + 0.3 * (reach.high - reach.low))
    }

    /// Course of the `member`-th joint of a motion. `cutoff_hz`: of the rows.
    pub(super) fn new(kind: MotionKind, reach: &Reach, member: usize, cutoff_hz: f64) -> Course {
        // Incommensurable frequencies and a phase keep the joints of a pair apart.
        let (pace, phase) = if member == 0 { (1.0, 0.0) } else { (1.3, 1.0) };
        let slow = |reach: &Reach, speed: f64| {
            tones(&Reach { speed, ..*reach }, [0.1 * pace, 0.23 * pace], [0.75, 0.25], phase)
        };
        match kind {
            MotionKind::Hold => poses(reach).unwrap_or_else(|| Course::rest(reach)),
            MotionKind::Slow => Course::Tones(reach.middle(), slow(reach, 0.25 * reach.speed)),
            MotionKind::Fast => {
                let both = reach.speed / (TAU * reach.half());
                let hz = both.min(0.25 * cutoff_hz).max(0.1) * pace;
                Course::Tones(reach.middle(), tones(reach, [hz, 2.236 * hz], [0.75, 0.25], phase))
            }
            MotionKind::Bursts => {
                let hz = (cutoff_hz / 3.0).min(2.0) * pace;
                let half = reach.part(0.5);
                let mut all = slow(&half, half.speed);
                all.extend(tones(&half, [hz, 1.4 * hz], [0.5, 0.5], phase));
                Course::Tones(reach.middle(), all)
            }
        }
    }

    pub(super) fn at(&self, time: f64) -> Point {
        match self {
            Course::Rest(position) => Point::rest(*position),
            Course::Poses(moves) => {
                let k = ((time / POSE_S) as usize).min(moves.len() - 1);
                moves[k].at(time - k as f64 * POSE_S)
            }
            Course::Tones(middle, tones) => {
                let mut point = Point::rest(*middle);
                for (amplitude, omega, phase) in tones {
                    let (sin, cos) = (omega * time + phase).sin_cos();
                    point.position += amplitude * sin;
                    point.velocity += amplitude * omega * cos;
                    point.acceleration -= amplitude * omega * omega * sin;
                    point.jerk -= amplitude * omega.powi(3) * cos;
                }
                point
            }
        }
    }
}

/// Two tones of given shares, as large as the bounds `Σ A ≤ half range`, `Σ A ω ≤ speed`, `Σ A ω² ≤ acceleration` allow.
fn tones(reach: &Reach, hz: [f64; 2], shares: [f64; 2], phase: f64) -> Vec<(f64, f64, f64)> {
    let omega = hz.map(|f| TAU * f);
    let sum = |power: i32| -> f64 { (0..2).map(|k| shares[k] * omega[k].powi(power)).sum() };
    let scale = (reach.half() / sum(0)).min(reach.speed / sum(1)).min(reach.acceleration / sum(2)).max(0.0);
    (0..2).map(|k| (scale * shares[k], omega[k], phase + k as f64)).collect()
}

/// Moves of a second between five poses, with a second of rest behind each.
fn poses(reach: &Reach) -> Option<Course> {
    let step = |stretch: f64| Quintic::new(0.0, stretch, 0.5 * POSE_S).ok();
    let unit = step(1.0)?;
    let longest = (reach.speed / unit.peak_velocity()).min(reach.acceleration / unit.peak_acceleration());
    // From the middle: the longest move spans a quarter of the range.
    let half = reach.half().min(2.0 * longest);
    let at = |k: f64| reach.middle() + half * k;
    let stops = [0.0, 0.5, 1.0, 0.5, 0.0, -0.5, -1.0];
    let moves = stops.windows(2).map(|w| Quintic::new(at(w[0]), at(w[1]), 0.5 * POSE_S).ok());
    moves.collect::<Option<Vec<_>>>().map(Course::Poses)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_motion_stays_inside_its_limits() {
        for (low, high, speed, acceleration) in
            [(-2.9, 2.9, 2.0, 10.0), (-0.1, 0.3, 2.0, 10.0), (-3.0, 3.0, 0.1, 0.5), (0.0, 1e-3, 9.0, 10.0)]
        {
            let reach = Reach { low, high, speed, acceleration };
            for kind in [MotionKind::Hold, MotionKind::Slow, MotionKind::Fast, MotionKind::Bursts] {
                for member in [0, 1] {
                    let course = Course::new(kind, &reach, member, 6.0);
                    let mut moved: f64 = 0.0;
                    for k in 0..=2000 {
                        let p = course.at(f64::from(k) * 5e-3);
                        let slack = 1e-12;
                        assert!(p.position >= low - slack && p.position <= high + slack, "{kind:?} {p:?}");
                        assert!(p.velocity.abs() <= speed * (1.0 + 1e-12), "{kind:?} {p:?}");
                        assert!(p.acceleration.abs() <= acceleration * (1.0 + 1e-12), "{kind:?} {p:?}");
                        moved = moved.max((p.position - course.at(0.0).position).abs());
                    }
                    assert!(moved > 0.0, "{kind:?} stands still");
                }
            }
        }
    }
}
