//! Positions that count from zero again after a full turn.

use dynid_logs::Signals;
use dynid_motion::turns::{self, Unwrapping};
use serde::{Deserialize, Serialize};

use crate::log_axis::LogAxis;

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

/// Unwraps the positions of what turns ([`dynid_motion::turns`]).
pub fn unwrap(signals: &mut Signals, axes: &[LogAxis]) -> Vec<Unwrapped> {
    let mut out = Vec::new();
    for ((position, index), joint) in signals.position.iter_mut().zip(&signals.indices).zip(&signals.joints) {
        if axes.get(*index).is_some_and(|axis| axis.slides) {
            continue;
        }
        let jumps = turns::unwrap(position);
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

/// A joint, and what of its position was seen.
#[derive(Debug, Clone)]
struct Followed {
    joint: String,
    position: Unwrapping,
}

impl Unwrapper {
    /// Behind the first rows of a log, as they were recorded, which [`unwrap`] unwraps.
    pub fn behind(first: &Signals, axes: &[LogAxis]) -> Self {
        let followed = |((position, index), joint): ((&Vec<f64>, &usize), &String)| {
            let slides = axes.get(*index).is_some_and(|axis| axis.slides);
            Followed { joint: joint.clone(), position: Unwrapping::behind(position, slides) }
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
            followed.position.next(position).map_err(|row| (followed.joint.clone(), row))?;
        }
        Ok(())
    }

    /// Positions that were unwrapped so far.
    pub fn unwrapped(&self) -> Vec<Unwrapped> {
        let jumped = self.joints.iter().filter(|followed| followed.position.jumps() > 0);
        jumped
            .map(|followed| Unwrapped { joint: followed.joint.clone(), jumps: followed.position.jumps() })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    fn wrapped(x: f64) -> f64 {
        (x + PI).rem_euclid(2.0 * PI) - PI
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
}
