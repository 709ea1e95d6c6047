//! What a log of commands will tell, before the robot has moved.

use dynid_linalg::Mat;

use crate::chain::Chain;
use crate::channel::Channel;
use crate::fit::{Evaluation, ServoProblem, blocks, with_priors};
use crate::free::{Free, ServoValues};
use crate::identify::{ServoGroup, groups};
use crate::joint::Scheme;
use crate::log::ServoLog;
use crate::rollout::{Lost, Rollout};

/// Where commands lead a robot, and how well its parameters will be known from that.
#[derive(Debug, Clone)]
pub struct ServoForecast {
    /// Parameters that readings depend on, or that something is known of beforehand: places among those that were asked for.
    pub seen: Vec<usize>,
    /// Upper triangle `R` of these parameters: `RᵀR` is the information of all readings, with what is known beforehand.
    pub triangle: Mat,
    /// Parameters that will be known together only, by their places among those that were asked for.
    pub groups: Vec<ServoGroup>,
    /// What the encoders read at the rows of the log, not rounded, by joint, rad or m.
    pub reading: Vec<Vec<f64>>,
    /// Velocities of the joints.
    pub velocity: Vec<Vec<f64>>,
    /// Efforts of the drives, in the middle of the step before the row.
    pub effort: Vec<Vec<f64>>,
}

/// Simulates a log's commands from rest at its first readings, with the slopes of all readings: `RᵀR = Σ JᵀΣ⁻¹J` over its rows, `sigma` the standard
/// deviation of the noise of every joint's readings. Positions behind the first row are not used.
///
/// That is what a log tells if the law is the true one and errors of readings are independent from row to row.
///
/// # Errors
/// [`Lost`] if the loop is unstable.
pub fn forecast(
    chains: &[Chain],
    log: &ServoLog,
    values: &ServoValues,
    free: &[Free],
    scheme: Scheme,
    sigma: &[f64],
) -> Result<ServoForecast, Lost> {
    let first = log.position.iter().map(|x| x[0]).collect();
    let log = ServoLog { start: Some(first), ..log.clone() };
    let logs = std::slice::from_ref(&log);
    let whole = blocks(logs, 1);
    let channels = &[Channel::Position];
    let problem = ServoProblem { chains, logs, scheme, free, channels, blocks: &whole };
    let evaluation = Evaluation::new(&problem, values, sigma, true)?;
    let estimate = values.gather(free);
    let information = with_priors(evaluation.normal(&|_| true), free, &estimate).0;
    let seen: Vec<usize> = (0..free.len()).filter(|k| information[(*k, *k)] > 0.0).collect();
    let scale: Vec<f64> = seen.iter().map(|k| information[(*k, *k)].sqrt()).collect();
    let m = seen.len();
    // What is exactly alike has a pivot of rounding: the smallest that still factors says that it is not known apart.
    let ridge = |i: usize, j: usize| if i == j { f64::EPSILON } else { 0.0 };
    let scaled =
        Mat::from_fn(m, m, |i, j| information[(seen[i], seen[j])] / (scale[i] * scale[j]) + ridge(i, j));
    let (mut triangle, mut correlation) = (Mat::zeros(m, m), Mat::identity(m, m));
    if let Some(factor) = scaled.cholesky() {
        let inverse = factor.solve(&Mat::identity(m, m));
        let lower = factor.lower().to_mat();
        triangle = Mat::from_fn(m, m, |i, j| if i <= j { lower[(j, i)] * scale[j] } else { 0.0 });
        correlation = Mat::from_fn(m, m, |i, j| inverse[(i, j)] / (inverse[(i, i)] * inverse[(j, j)]).sqrt());
    }
    let nothing = || vec![vec![0.0; log.rows()]; log.joints()];
    let (mut reading, mut velocity, mut effort) = (nothing(), nothing(), nothing());
    for chain in chains {
        Rollout::new(chain, scheme, &[]).run(values, &log, |row| {
            for (k, j) in chain.joints.iter().enumerate() {
                reading[*j][row.row] = row.reading[k];
                velocity[*j][row.row] = row.velocity[k];
                effort[*j][row.row] = row.effort[k];
            }
        })?;
    }
    Ok(ServoForecast { groups: groups(free, &seen, &correlation), seen, triangle, reading, velocity, effort })
}
