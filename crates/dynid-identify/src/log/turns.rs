//! Positions that count from zero again after a full turn.

use std::f64::consts::PI;

use dynid_io::Signals;
use serde::{Deserialize, Serialize};

use crate::log_axis::LogAxis;

/// A full turn, rad.
const TURN: f64 = 2.0 * PI;
/// Positions that are wrapped keep within a turn, up to rounding.
const WITHIN: f64 = 1.001 * TURN;
/// A jump between two rows is that of a wrap if it leaves less than this beside a full turn, rad.
const BESIDE: f64 = 1.0;

/// A position that was unwrapped.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Unwrapped {
    /// Joint, or motor.
    pub joint: String,
    /// Jumps by a full turn.
    pub jumps: usize,
}

impl Unwrapped {
    /// What was done, in words.
    pub fn words(&self) -> String {
        let times = if self.jumps == 1 { "once".to_owned() } else { format!("{} times", self.jumps) };
        format!("the position of `{}` jumps by a full turn {times}: it was unwrapped", self.joint)
    }
}

/// Unwraps the positions of what turns. A position is wrapped if all of it lies within one turn and every step of more than half a turn is a full
/// turn but for less than 1 rad; anything else stays as it is.
pub fn unwrap(signals: &mut Signals, axes: &[LogAxis]) -> Vec<Unwrapped> {
    let mut out = Vec::new();
    for ((position, index), joint) in signals.position.iter_mut().zip(&signals.indices).zip(&signals.joints) {
        if axes.get(*index).is_some_and(|axis| axis.slides) {
            continue;
        }
        let jumps = unwrap_signal(position);
        if jumps > 0 {
            out.push(Unwrapped { joint: joint.clone(), jumps });
        }
    }
    out
}

/// Unwraps a position, rad; the number of jumps taken out.
fn unwrap_signal(position: &mut [f64]) -> usize {
    let (low, high) =
        position.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(*x), b.max(*x)));
    let jumps = |w: &&[f64]| (w[1] - w[0]).abs() > PI;
    let is_turn = |w: &[f64]| ((w[1] - w[0]).abs() - TURN).abs() < BESIDE;
    let found = position.windows(2).filter(jumps).count();
    // What is not finite stays as it is.
    let range = high - low;
    if found == 0 || range.is_nan() || range > WITHIN || !position.windows(2).filter(jumps).all(is_turn) {
        return 0;
    }
    let (mut turns, mut before) = (0.0, position[0]);
    for x in position.iter_mut() {
        let now = *x;
        if (now - before).abs() > PI {
            turns -= (now - before).signum();
        }
        before = now;
        *x = now + turns * TURN;
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wrapped(x: f64) -> f64 {
        (x + PI).rem_euclid(TURN) - PI
    }

    #[test]
    fn a_wrapped_position_comes_back_as_it_was() {
        let true_one: Vec<f64> = (0..4000).map(|k| 3.0 + 5.0 * (f64::from(k) * 0.004).sin()).collect();
        let mut position: Vec<f64> = true_one.iter().map(|x| wrapped(*x)).collect();
        assert!(unwrap_signal(&mut position) > 2);
        let offset = position[0] - true_one[0];
        assert!(position.iter().zip(&true_one).all(|(a, b)| (a - b - offset).abs() < 1e-12));
    }

    #[test]
    fn positions_that_are_not_wrapped_stay() {
        // More than a turn, a fallen-out sample, a fast motor.
        let far: Vec<f64> = (0..100).map(|k| if k < 50 { 0.0 } else { 6.5 }).collect();
        let out: Vec<f64> = (0..100).map(|k| if k == 50 { 0.0 } else { 3.3 }).collect();
        let fast: Vec<f64> = (0..100).map(|k| 4.0 * f64::from(k)).collect();
        for signal in [far, out, fast] {
            let mut position = signal.clone();
            assert_eq!(unwrap_signal(&mut position), 0);
            assert_eq!(position, signal);
        }
    }
}
