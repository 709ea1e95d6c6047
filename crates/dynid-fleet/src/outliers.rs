//! Robots and logs that are out of the spread of the others.

use dynid_estimate::distribution::t_exceedance;

use crate::fit::FleetFit;
use crate::spread::LEFT_OUT;

/// A coordinate of a robot or log that is out of the spread.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outlier {
    /// Index of the robot or log.
    pub unit: usize,
    /// Index of the coordinate.
    pub coordinate: usize,
    /// Its deviation over the standard deviation that spread and estimation give it.
    pub z: f64,
    /// Probability of that in a unit like the others, for all its coordinates.
    pub p: f64,
}

impl FleetFit {
    /// Robots out of the spread of the fleet; of those that are named at most the share `rate` is not (Benjamini and Hochberg 1995).
    pub fn robot_outliers(&self, rate: f64) -> Vec<Outlier> {
        let robots = self.robots.iter().enumerate().filter_map(|(r, robot)| {
            let robot = robot.as_ref()?;
            Some((r, robot.deviation.as_slice(), robot.deviation_sd.as_slice()))
        });
        outliers(robots, &self.variances.robots, (&self.variances.robot_weights, &self.splits.watched), rate)
    }

    /// Logs out of the spread of their robot, alike.
    pub fn log_outliers(&self, rate: f64) -> Vec<Outlier> {
        let logs = self.logs.iter().enumerate();
        let logs = logs.map(|(l, log)| (l, log.deviation.as_slice(), log.deviation_sd.as_slice()));
        outliers(logs, &self.variances.logs, (&self.variances.log_weights, &self.splits.watched), rate)
    }
}

/// Coordinates that were left out of the spread stand for themselves: their deviation is their own, and so is its standard deviation.
fn outliers<'a>(
    units: impl Iterator<Item = (usize, &'a [f64], &'a [f64])>,
    variances: &[f64],
    (weights, watched): (&[Vec<f64>], &[bool]),
    rate: f64,
) -> Vec<Outlier> {
    let q = watched.iter().filter(|w| **w).count() as f64;
    let left_in = |k: usize| weights.iter().filter(|own| own[k] > LEFT_OUT).count();
    let kept: Vec<f64> = (0..variances.len()).map(|k| (left_in(k) as f64 - 1.0).max(1.0)).collect();
    let mut number = 0;
    let mut found: Vec<Outlier> = Vec::new();
    let mut least: Vec<f64> = Vec::new();
    for (unit, deviation, sd) in units {
        number += 1;
        let first = found.len();
        for (coordinate, variance) in
            variances.iter().enumerate().filter(|(k, _)| watched[*k] && weights[unit][*k] <= LEFT_OUT)
        {
            let z = deviation[coordinate] / (variance + sd[coordinate] * sd[coordinate]).sqrt();
            // The spread comes from the units that were left in: Student's t, not the normal law.
            let tail = t_exceedance(z.abs(), kept[coordinate]).unwrap_or(0.5);
            let p = (2.0 * q * tail).min(1.0);
            found.push(Outlier { unit, coordinate, z, p });
        }
        least.extend(found[first..].iter().map(|o| o.p).reduce(f64::min));
    }
    let threshold = largest_discovery(least, number, rate);
    found.retain(|outlier| outlier.p <= threshold);
    found
}

/// The largest of some probabilities that is named where `number` were tested; 0 where none is (Benjamini and Hochberg 1995).
pub(crate) fn largest_discovery(mut p: Vec<f64>, number: usize, rate: f64) -> f64 {
    p.sort_by(f64::total_cmp);
    let below = |(i, p): (usize, &f64)| *p <= rate * (i + 1) as f64 / number as f64;
    p.iter().enumerate().filter(|(i, p)| below((*i, p))).map(|(_, p)| *p).fold(0.0, f64::max)
}
