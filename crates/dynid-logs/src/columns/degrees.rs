//! Signs that angles said to be in radians are in degrees.

use std::f64::consts::PI;

/// Largest angle that passes without a second look where no limits are known, rad: two turns.
const TWO_TURNS: f64 = 4.0 * PI;
/// How far beyond its limits a joint must be before degrees are suspected.
const BEYOND_LIMITS: f64 = 3.0;
/// Slack of the limits when the angle is read as degrees.
const SLACK: f64 = 1.05;

/// Why positions look like degrees.
#[derive(Clone, Debug, PartialEq)]
pub struct DegreesEvidence {
    /// Index of the joint with the strongest sign.
    pub joint: usize,
    /// Largest position of the joint, in the unit of the log.
    pub largest: f64,
    /// The limit that it exceeds, rad; `None`: no limits are known, and it exceeds two turns.
    pub limit: Option<f64>,
}

/// Looks for positions of revolute joints that make sense as degrees and none as radians.
///
/// `position`: per joint, rad as the log says; `limits`: lowest and highest position of the same joints, rad, where they are known. A joint is suspect if it goes three times
/// beyond its limit and yet keeps it when read as degrees. Without any limits: if at least half of the joints pass two
/// turns (4π), as continuous joints alone rarely do. Leave prismatic joints out.
pub fn degrees_suspected(position: &[Vec<f64>], limits: &[Option<(f64, f64)>]) -> Option<DegreesEvidence> {
    let largest: Vec<f64> = position.iter().map(|q| q.iter().fold(0.0, |m: f64, x| m.max(x.abs()))).collect();
    let reach = |(low, high): (f64, f64)| low.abs().max(high.abs());
    let known: Vec<Option<f64>> = limits.iter().map(|limit| limit.map(reach)).collect();
    let beyond = largest.iter().zip(&known).enumerate().filter_map(|(joint, (largest, limit))| {
        let limit = (*limit)?;
        let suspect = *largest > BEYOND_LIMITS * limit && largest.to_radians() <= SLACK * limit;
        suspect.then_some((joint, *largest, limit))
    });
    if let Some((joint, largest, limit)) = beyond.max_by(|a, b| (a.1 / a.2).total_cmp(&(b.1 / b.2))) {
        return Some(DegreesEvidence { joint, largest, limit: Some(limit) });
    }
    if known.iter().any(Option::is_some) {
        return None;
    }
    let passing = largest.iter().filter(|x| **x > TWO_TURNS).count();
    if passing == 0 || 2 * passing < largest.len() {
        return None;
    }
    let (joint, largest) = largest.into_iter().enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
    Some(DegreesEvidence { joint, largest, limit: None })
}
