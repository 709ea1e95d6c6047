//! Positions that count from zero again after a full turn.
//!
//! A position is wrapped if all of it lies within one turn and every step of more than half a turn is a full turn but for less than 1 rad;
//! anything else stays as it is.

use std::f64::consts::PI;

/// A full turn, rad.
const TURN: f64 = 2.0 * PI;
/// Positions that are wrapped keep within a turn, up to rounding.
const WITHIN: f64 = 1.001 * TURN;
/// A jump between two rows is that of a wrap if it leaves less than this beside a full turn, rad.
const BESIDE: f64 = 1.0;

/// Unwraps a position, rad; the number of jumps taken out.
pub fn unwrap(position: &mut [f64]) -> usize {
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

/// Unwraps a position that comes in parts, as [`unwrap`] does a whole one.
#[derive(Debug, Clone)]
pub struct Unwrapping {
    /// It has no turns to take out, or moved as no wrapped position does.
    is_plain: bool,
    low: f64,
    high: f64,
    last: f64,
    turns: f64,
    jumps: usize,
    rows: usize,
}

impl Unwrapping {
    /// Behind the first rows, as they were recorded, which [`unwrap`] unwraps. `is_plain`: whether it is known to have no turns.
    pub fn behind(position: &[f64], is_plain: bool) -> Self {
        let (low, high) = extremes(position);
        let found = position.windows(2).filter(jumps).count();
        let is_plain = is_plain || (found > 0 && !is_wrapped(position, high - low));
        let turns = position.windows(2).filter(jumps).map(|w| -(w[1] - w[0]).signum()).sum();
        Unwrapping {
            is_plain,
            low,
            high,
            last: position.last().copied().unwrap_or(0.0),
            turns: if is_plain { 0.0 } else { turns },
            jumps: if is_plain { 0 } else { found },
            rows: position.len(),
        }
    }

    /// Unwraps the next rows.
    ///
    /// # Errors
    /// The row (from 1, counted from the first of all) at which a position that was unwrapped before moves as no wrapped one does.
    pub fn next(&mut self, position: &mut [f64]) -> Result<(), usize> {
        for x in position {
            self.follow(x)?;
        }
        Ok(())
    }

    /// Jumps that were taken out so far.
    pub fn jumps(&self) -> usize {
        self.jumps
    }

    fn follow(&mut self, x: &mut f64) -> Result<(), usize> {
        self.rows += 1;
        if self.is_plain {
            return Ok(());
        }
        let step = *x - std::mem::replace(&mut self.last, *x);
        (self.low, self.high) = (self.low.min(*x), self.high.max(*x));
        let jumps = step.abs() > PI;
        if self.high - self.low > WITHIN || (jumps && (step.abs() - TURN).abs() >= BESIDE) {
            if self.jumps > 0 {
                return Err(self.rows);
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
        assert!(unwrap(&mut position) > 2);
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
            assert_eq!(unwrap(&mut position), 0);
            assert_eq!(position, signal);
        }
    }
}
