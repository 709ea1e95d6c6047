//! Logs of a made-up arm shared by the tests: smooth regressors, joints that share columns, rows in time blocks.

use dynid_factor::rows::{GroupShape, MemoryRows, Rows};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

pub(crate) const COLUMNS: usize = 6;
pub(crate) const TRUTH: [f64; COLUMNS] = [2.0, -1.0, 0.5, 3.0, -0.7, 1.2];
/// Columns that act on each joint.
pub(crate) const ACTING: [&[usize]; 2] = [&[0, 1, 2, 3], &[2, 3, 4, 5]];
/// Standard deviation of the noise of each joint.
pub(crate) const NOISE: [f64; 2] = [0.2, 0.05];

pub(crate) struct Normal(ChaCha8Rng);

impl Normal {
    pub(crate) fn new(seed: u64, stream: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(stream);
        Normal(rng)
    }

    pub(crate) fn draw(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }
}

/// Regressor entry of a joint's `c`-th column at a sample.
pub(crate) fn regressor(log: usize, joint: usize, c: usize, sample: usize) -> f64 {
    let t = 0.04 * sample as f64 + 5.0 * log as f64;
    let (rate, phase) = (0.5 + 0.37 * (3 * joint + c) as f64, 1.7 * (joint + 2 * c) as f64);
    match c {
        0 => 1.0,
        1 => (rate * t + phase).sin().signum(),
        _ => (rate * t + phase).sin() + 0.4 * (1.9 * rate * t + 0.3).cos(),
    }
}

/// Rows of `logs` logs of `blocks · block_rows` samples; `error(joint, sample)` is added to the effort.
pub(crate) fn rows(
    logs: usize,
    blocks: usize,
    block_rows: usize,
    mut error: impl FnMut(usize, usize) -> f64,
) -> MemoryRows {
    let mut out = MemoryRows::new();
    for log in 0..logs {
        for (joint, acting) in ACTING.iter().enumerate() {
            let shape = GroupShape { log, output: joint, scale: 0, columns: acting.to_vec(), blocks };
            let group = out.add_group(shape);
            for block in 0..blocks {
                let samples: Vec<usize> = (block * block_rows..(block + 1) * block_rows).collect();
                let w: Vec<f64> = (0..acting.len())
                    .flat_map(|c| samples.iter().map(move |&k| (c, k)))
                    .map(|(c, k)| regressor(log, joint, c, k))
                    .collect();
                let effort: Vec<f64> = samples
                    .iter()
                    .enumerate()
                    .map(|(i, &k)| {
                        let clean: f64 =
                            acting.iter().enumerate().map(|(c, &p)| w[c * block_rows + i] * TRUTH[p]).sum();
                        clean + error(joint, k)
                    })
                    .collect();
                let rows =
                    Rows { block, samples: &samples, regressor: &w, stride: block_rows, effort: &effort };
                out.push(group, &rows);
            }
        }
    }
    out
}
