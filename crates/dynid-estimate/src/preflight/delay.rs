//! Delay between effort and motion.

use dynid_model::EffortModel;
use dynid_motion::UniformLog;
use dynid_motion::shift::shift;

use super::PreflightError;
use super::rows::TrialRows;
use super::samples::{BLOCKS, Samples};
use super::wiring::Wiring;

/// Gauss-Newton steps.
const STEPS: usize = 16;
/// A step below this ends them, samples.
const SETTLED: f64 = 0.02;
/// A last step below this is good enough, samples.
const ROUGH: f64 = 0.3;
/// Farthest that is looked, s.
const FARTHEST_S: f64 = 0.25;

/// A delay with its standard error, samples: the motion comes this much later than the effort of the same row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Delay {
    /// Delay.
    pub samples: f64,
    /// Standard error, jackknife over twelve parts of the record.
    pub error: f64,
}

/// Delay of a log whose joints are in the order of a model's outputs, by Gauss-Newton on the efforts; `None` where motion
/// and effort do not tell.
///
/// # Errors
/// [`PreflightError`] if a signal cannot be filtered or a regressor is not finite.
pub fn delay(
    model: &dyn EffortModel,
    shape: &[f64],
    kept: &[usize],
    log: &UniformLog,
    moves: &[bool],
    wiring: &Wiring,
) -> Result<Option<Delay>, PreflightError> {
    let mut at = 0.0;
    for step in 0..STEPS {
        let last = step + 1 == STEPS;
        let mut moved = log.clone();
        for joint in &mut moved.joints {
            joint.effort = shift(&joint.effort, -at)?.values;
        }
        let Some(samples) = Samples::new(&moved, moves)? else { return Ok(None) };
        let rows = TrialRows::new(model, shape, kept, &samples, &wiring.position, true)?;
        let Some(rest) = pooled(&rows, wiring, None) else { return Ok(None) };
        let step = rest * log.rate_hz;
        at += step.clamp(-0.02 * log.rate_hz, 0.02 * log.rate_hz);
        if at.abs() > FARTHEST_S * log.rate_hz {
            return Ok(None);
        }
        if step.abs() < SETTLED || last && step.abs() < ROUGH {
            let without: Vec<f64> = (0..BLOCKS).filter_map(|b| pooled(&rows, wiring, Some(b))).collect();
            let count = without.len() as f64;
            let mean = without.iter().sum::<f64>() / count;
            let spread: f64 = without.iter().map(|d| (d - mean).powi(2)).sum();
            let error = log.rate_hz * ((count - 1.0) / count * spread).sqrt();
            return Ok((count > 2.0).then_some(Delay { samples: at, error }));
        }
    }
    Ok(None)
}

/// Rest of the delay over all joints that move, s, each weighted by how well the model explains it.
fn pooled(rows: &TrialRows, wiring: &Wiring, without: Option<usize>) -> Option<f64> {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
    let (mut sum, mut weight) = (0.0, 0.0);
    for (output, source) in wiring.effort.iter().enumerate() {
        let Some([rest, slope]) = rows.rests(output, *source, without) else { continue };
        let (left, power) = (dot(&rest, &rest), dot(&slope, &slope));
        if left > 0.0 && power > 0.0 {
            sum += dot(&rest, &slope) / left;
            weight += power / left;
        }
    }
    (weight > 0.0).then(|| sum / weight)
}
