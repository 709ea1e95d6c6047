//! Positions that count from zero again after a full turn.

use std::f64::consts::PI;

use dynid_logs::Signals;
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

/// Unwraps the positions of a log that comes in parts, as [`unwrap`] does those of a whole one.
#[derive(Debug, Clone)]
pub struct Unwrapper {
    joints: Vec<Followed>,
}

/// What of a position was seen.
#[derive(Debug, Clone)]
struct Followed {
    joint: String,
    /// It slides, or moved as no wrapped position does.
    is_plain: bool,
    low: f64,
    high: f64,
    last: f64,
    turns: f64,
    jumps: usize,
    rows: usize,
}

impl Unwrapper {
    /// Behind the first rows of a log, as they were recorded, which [`unwrap`] unwraps.
    pub fn behind(first: &Signals, axes: &[LogAxis]) -> Self {
        let followed = |((position, index), joint): ((&Vec<f64>, &usize), &String)| {
            let slides = axes.get(*index).is_some_and(|axis| axis.slides);
            let (low, high) = extremes(position);
            let found = position.windows(2).filter(jumps).count();
            let is_plain = slides || (found > 0 && !is_wrapped(position, high - low));
            let turns = position.windows(2).filter(jumps).map(|w| -(w[1] - w[0]).signum()).sum();
            Followed {
                joint: joint.clone(),
                is_plain,
                low,
                high,
                last: position.last().copied().unwrap_or(0.0),
                turns: if is_plain { 0.0 } else { turns },
                jumps: if is_plain { 0 } else { found },
                rows: position.len(),
            }
        };
        let joints = first.position.iter().zip(&first.indices).zip(&first.joints);
        Unwrapper { joints: joints.map(followed).collect() }
    }

    /// Unwraps the next rows.
    ///
    /// # Errors
    /// Joint and row (from 1) at which a position that was unwrapped before moves as no wrapped one does.
    pub fn unwrap(&mut self, signals: &mut Signals) -> Result<(), (String, usize)> {
        for (position, followed) in signals.position.iter_mut().zip(&mut self.joints) {
            for x in position.iter_mut() {
                followed.follow(x)?;
            }
        }
        Ok(())
    }

    /// Positions that were unwrapped so far.
    pub fn unwrapped(&self) -> Vec<Unwrapped> {
        let jumped = self.joints.iter().filter(|followed| followed.jumps > 0);
        jumped.map(|followed| Unwrapped { joint: followed.joint.clone(), jumps: followed.jumps }).collect()
    }
}

impl Followed {
    fn follow(&mut self, x: &mut f64) -> Result<(), (String, usize)> {
        self.rows += 1;
        if self.is_plain {
            return Ok(());
        }
        let step = *x - std::mem::replace(&mut self.last, *x);
        (self.low, self.high) = (self.low.min(*x), self.high.max(*x));
        let jumps = step.abs() > PI;
        if self.high - self.low > WITHIN || (jumps && (step.abs() - TURN).abs() >= BESIDE) {
            if self.jumps > 0 {
                return Err((self.joint.clone(), self.rows));
            }
            self.is_plain = true;
            return Ok(());
        }
        if jumps {
            self.turns -= step.signum();
            self.jumps += 1;
        }
        *x += self.turns * TURN;
        Ok(())
    }
}

fn extremes(position: &[f64]) -> (f64, f64) {
    position.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(*x), b.max(*x)))
}

fn jumps(w: &&[f64]) -> bool {
    (w[1] - w[0]).abs() > PI
}

/// Whether a position of this range that jumps is wrapped. What is not finite is not.
fn is_wrapped(position: &[f64], range: f64) -> bool {
    let is_turn = |w: &[f64]| ((w[1] - w[0]).abs() - TURN).abs() < BESIDE;
    !range.is_nan() && range <= WITHIN && position.windows(2).filter(jumps).all(is_turn)
}

/// Unwraps a position, rad; the number of jumps taken out.
fn unwrap_signal(position: &mut [f64]) -> usize {
    let (low, high) = extremes(position);
    let found = position.windows(2).filter(jumps).count();
    if found == 0 || !is_wrapped(position, high - low) {
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
    fn parts_are_unwrapped_as_the_whole() {
        let axes: [LogAxis; 0] = [];
        let signals = |position: &[f64]| Signals {
            joints: vec!["j".to_owned()],
            indices: vec![0],
            position: vec![position.to_vec()],
            ..Signals::default()
        };
        let turning: Vec<f64> =
            (0..4000).map(|k| wrapped(3.0 + 5.0 * (f64::from(k) * 0.004).sin())).collect();
        let far: Vec<f64> = (0..4000).map(|k| 0.01 * f64::from(k)).collect();
        for recorded in [turning, far] {
            for first in [2, 700, 1500, 3999] {
                let mut whole = signals(&recorded);
                let found = unwrap(&mut whole, &axes);
                let mut parts = signals(&recorded[..first]);
                let mut unwrapper = Unwrapper::behind(&parts, &axes);
                unwrap(&mut parts, &axes);
                for rest in recorded[first..].chunks(37) {
                    let mut rest = signals(rest);
                    unwrapper.unwrap(&mut rest).unwrap();
                    parts.position[0].extend_from_slice(&rest.position[0]);
                }
                assert!(parts.position[0].iter().zip(&whole.position[0]).all(|(a, b)| (a - b).abs() < 1e-12));
                assert_eq!(unwrapper.unwrapped(), found);
            }
        }
        let mut jumping = signals(&[3.1, -3.1]);
        let mut unwrapper = Unwrapper::behind(&jumping, &axes);
        unwrap(&mut jumping, &axes);
        assert_eq!(unwrapper.unwrap(&mut signals(&[-3.0, 1.0])), Err(("j".to_owned(), 4)));
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
