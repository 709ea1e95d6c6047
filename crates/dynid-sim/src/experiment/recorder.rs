//! From what happened to what was logged.

use rand::RngExt;

use super::ExperimentSettings;
use crate::streams::{Cause, generator, normal};

/// True motion and effort at the instants at which the rows' motion was sampled; per joint, one number per row.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Truth {
    /// Positions.
    pub q: Vec<Vec<f64>>,
    /// Velocities.
    pub dq: Vec<Vec<f64>>,
    /// Accelerations.
    pub ddq: Vec<Vec<f64>>,
    /// Efforts that the joints felt.
    pub effort: Vec<Vec<f64>>,
}

/// A log as a robot would give it, and the truth row by row. Signals: per joint, one number per row.
#[derive(Debug, Clone, PartialEq)]
pub struct VirtualLog {
    /// Time stamps, s.
    pub time: Vec<f64>,
    /// Encoder readings.
    pub position: Vec<Vec<f64>>,
    /// Velocity signals.
    pub velocity: Vec<Vec<f64>>,
    /// Efforts of the drives.
    pub effort: Vec<Vec<f64>>,
    /// Extra channels, in the order of the model's.
    pub channels: Vec<Vec<f64>>,
    /// The truth.
    pub truth: Truth,
    /// Rows that are missing.
    pub dropped_rows: usize,
}

/// Signals as they come in, all rows.
#[derive(Debug)]
pub(crate) struct Recording {
    position: Vec<Vec<f64>>,
    effort: Vec<Vec<f64>>,
    channels: Vec<Vec<f64>>,
    truth: Truth,
}

impl Recording {
    pub(crate) fn new(joints: usize, channels: usize, rows: usize) -> Self {
        let zeros = |n: usize| vec![vec![0.0; rows]; n];
        let truth = Truth { q: zeros(joints), dq: zeros(joints), ddq: zeros(joints), effort: zeros(joints) };
        Recording { position: zeros(joints), effort: zeros(joints), channels: zeros(channels), truth }
    }

    pub(crate) fn effort(&mut self, row: usize, drive: &[f64]) {
        put(&mut self.effort, row, drive);
    }

    pub(crate) fn motion(
        &mut self,
        row: usize,
        reading: &[f64],
        [q, dq, ddq, effort]: [&[f64]; 4],
        channels: &[f64],
    ) {
        put(&mut self.position, row, reading);
        put(&mut self.truth.q, row, q);
        put(&mut self.truth.dq, row, dq);
        put(&mut self.truth.ddq, row, ddq);
        put(&mut self.truth.effort, row, effort);
        put(&mut self.channels, row, channels);
    }

    /// Adds what sensors and logger do wrong to what does not feed back into the motion.
    pub(crate) fn finish(self, settings: &ExperimentSettings) -> VirtualLog {
        let (faults, seed) = (&settings.imperfections, settings.seed);
        let rows = self.truth.q.first().map_or(0, Vec::len);
        let mut noise = generator(seed, Cause::Velocity);
        let velocity =
            self.truth.dq.iter().map(|v| {
                v.iter().map(|v| v + faults.velocity_noise * normal(&mut noise)).collect::<Vec<f64>>()
            });
        let velocity = velocity.collect();
        let mut noise = generator(seed, Cause::Effort);
        let mut outliers = generator(seed, Cause::Outliers);
        let mut effort = self.effort;
        for (joint, signal) in effort.iter_mut().enumerate() {
            let rms = dynid_motion::signal::rms(signal);
            let absolute = faults.effort_noise.get(joint).copied().unwrap_or(0.0);
            let sigma = (faults.effort_noise_share * rms).hypot(absolute);
            for e in signal {
                *e += sigma * normal(&mut noise);
                let (draw, size): (f64, f64) = (outliers.random(), normal(&mut outliers));
                if draw < faults.outlier_share {
                    *e += faults.outlier_size * rms * size;
                }
            }
        }
        let mut clock = generator(seed, Cause::Clock);
        let period = 1.0 / settings.log_rate_hz;
        let time: Vec<f64> = (0..rows)
            .map(|row| {
                let late = faults.clock_jitter_s * normal(&mut clock);
                row as f64 / settings.log_rate_hz + late.clamp(-period / 3.0, period / 3.0)
            })
            .collect();
        let mut lottery = generator(seed, Cause::Dropped);
        let kept: Vec<bool> = (0..rows).map(|_| lottery.random::<f64>() >= faults.dropped_share).collect();
        let log = VirtualLog {
            time,
            position: self.position,
            velocity,
            effort,
            channels: self.channels,
            truth: self.truth,
            dropped_rows: kept.iter().filter(|k| !**k).count(),
        };
        if log.dropped_rows > 0 { log.without(&kept) } else { log }
    }
}

impl VirtualLog {
    fn without(mut self, kept: &[bool]) -> VirtualLog {
        let thin = |signal: &mut Vec<f64>| {
            let mut row = 0;
            signal.retain(|_| {
                row += 1;
                kept[row - 1]
            });
        };
        thin(&mut self.time);
        let truth = &mut self.truth;
        for signals in [
            &mut self.position,
            &mut self.velocity,
            &mut self.effort,
            &mut self.channels,
            &mut truth.q,
            &mut truth.dq,
            &mut truth.ddq,
            &mut truth.effort,
        ] {
            signals.iter_mut().for_each(thin);
        }
        self
    }
}

fn put(signals: &mut [Vec<f64>], row: usize, values: &[f64]) {
    for (signal, value) in signals.iter_mut().zip(values) {
        signal[row] = *value;
    }
}
