//! A simulated period as data, and the models that are held against it.

use dynid::estimators::{Factor, FactorBuilder};
use dynid::model::MotionBlock;
use dynid::sim::clearance::ClearanceRecord;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

use super::parameters::{BASE_COLUMNS, INERTIA_1, MASS_2, MOMENT_1, PARAMETERS, Parameters};
use super::pointing::Pointing;
use super::tree::{RATES, with_clearance};
use super::{JOINTS, fault};
use crate::StudyError;

/// Root of the mean square.
pub(super) fn rms(values: impl IntoIterator<Item = f64>) -> f64 {
    let (sum, count) = values.into_iter().fold((0.0, 0.0), |(sum, count), x| (sum + x * x, count + 1.0));
    (sum / count).sqrt()
}

/// What a model knows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Knowledge {
    /// Motion of the journals and the shape of their friction over time, whose sizes are unknowns.
    Clearance,
    /// Joints without clearance, without friction.
    Ideal,
    /// Joints without clearance, with Coulomb friction.
    Coulomb,
}

impl Knowledge {
    pub(super) const ALL: [Knowledge; 3] = [Knowledge::Clearance, Knowledge::Ideal, Knowledge::Coulomb];

    pub(super) fn name(self) -> &'static str {
        match self {
            Knowledge::Clearance => "clearance",
            Knowledge::Ideal => "ideal",
            Knowledge::Coulomb => "ideal with Coulomb friction",
        }
    }

    /// Friction entries.
    pub(super) fn frictions(self) -> usize {
        if self == Knowledge::Ideal { 0 } else { JOINTS }
    }
}

/// Samples after the discarded start. Columns and torques: joint 1 at all samples, then joint 2.
#[derive(Debug)]
pub(super) struct Data {
    pub(super) record: ClearanceRecord,
    /// First sample that counts.
    pub(super) first: usize,
    pub(super) samples: usize,
    /// Without noise, N m.
    pub(super) torque: Vec<f64>,
    /// Friction torque of each joint, N m.
    pub(super) friction: [Vec<f64>; JOINTS],
    /// Columns of `θ` with the simulated offsets, and without any.
    with_clearance: Vec<Vec<f64>>,
    /// Columns of all standard parameters of both links with the simulated offsets.
    standard: Vec<Vec<f64>>,
    ideal: Vec<Vec<f64>>,
    system: Parameters,
    length: f64,
}

impl Data {
    pub(super) fn of(ideal: &Pointing, record: ClearanceRecord, discarded: f64) -> Result<Self, StudyError> {
        let first = record.time.iter().position(|t| *t > discarded).unwrap_or(0);
        let samples = record.time.len() - first;
        let by_rate = |of: &[Vec<f64>], rates: usize| -> Vec<f64> {
            (0..rates).flat_map(|rate| of[first..].iter().map(move |sample| sample[rate])).collect()
        };
        let [q, dq, ddq] = [&record.q, &record.dq, &record.ddq].map(|of| by_rate(of, RATES));
        let motion = MotionBlock::plain(samples, &q, &dq, &ddq);
        let turning = JOINTS * samples;
        let turns = MotionBlock::plain(samples, &q[..turning], &dq[..turning], &ddq[..turning]);
        let tree = with_clearance()?;
        let friction = |joint: usize| record.journals[joint].friction_moment[first..].to_vec();
        Ok(Data {
            with_clearance: tree.theta_columns(&motion),
            standard: tree.standard_columns(&motion),
            ideal: ideal.theta_columns(&turns),
            torque: by_rate(&record.effort, JOINTS),
            friction: std::array::from_fn(friction),
            system: Parameters::of(ideal.mechanism())?,
            length: ideal.length(),
            first,
            samples,
            record,
        })
    }

    /// What of a signal of the record counts.
    pub(super) fn counted<'a, T>(&self, signal: &'a [T]) -> &'a [T] {
        &signal[self.first..]
    }

    pub(super) fn joint<'a>(&self, torque: &'a [f64], joint: usize) -> &'a [f64] {
        &torque[joint * self.samples..][..self.samples]
    }

    fn system_torque(&self, columns: &[Vec<f64>], joint: usize) -> Vec<f64> {
        let mut out = vec![0.0; self.samples];
        for (column, x) in columns.iter().zip(self.system.theta()) {
            out.iter_mut().zip(self.joint(column, joint)).for_each(|(out, w)| *out += x * w);
        }
        out
    }

    /// Torque of the system without clearance and friction.
    pub(super) fn ideal_torque(&self, joint: usize) -> Vec<f64> {
        self.system_torque(&self.ideal, joint)
    }

    /// What the offsets of the journals add to that.
    pub(super) fn ringing(&self, joint: usize) -> Vec<f64> {
        let ideal = self.ideal_torque(joint);
        self.system_torque(&self.with_clearance, joint).iter().zip(ideal).map(|(a, b)| a - b).collect()
    }

    /// The torque with noise of a standard deviation.
    pub(super) fn noisy(&self, deviation: f64, seed: u64) -> Result<Vec<f64>, StudyError> {
        let noise = Normal::new(0.0, deviation).map_err(fault)?;
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        Ok(self.torque.iter().map(|t| t + noise.sample(&mut random)).collect())
    }

    /// Columns of `θ` and of friction.
    pub(super) fn columns(&self, knowledge: Knowledge) -> Vec<Vec<f64>> {
        let mut columns = match knowledge {
            Knowledge::Clearance => self.with_clearance.clone(),
            Knowledge::Ideal | Knowledge::Coulomb => self.ideal.clone(),
        };
        columns.extend(self.friction_columns(knowledge));
        columns
    }

    /// Torques of the paper's parameters, then friction entries.
    pub(super) fn predicted(&self, knowledge: Knowledge, point: &[f64]) -> Vec<f64> {
        let (parameters, friction) = point.split_at(PARAMETERS);
        let theta = Parameters(std::array::from_fn(|k| parameters[k])).theta();
        let mut out = vec![0.0; JOINTS * self.samples];
        for (column, x) in self.columns(knowledge).iter().zip(theta.iter().chain(friction)) {
            out.iter_mut().zip(column).for_each(|(out, w)| *out += x * w);
        }
        out
    }

    /// Columns of all standard parameters of both links and of friction, with clearance.
    pub(super) fn standard_columns(&self) -> Vec<Vec<f64>> {
        self.standard.iter().cloned().chain(self.friction_columns(Knowledge::Clearance)).collect()
    }

    fn friction_columns(&self, knowledge: Knowledge) -> Vec<Vec<f64>> {
        let mut columns = Vec::new();
        for joint in 0..knowledge.frictions() {
            let mut column = vec![0.0; JOINTS * self.samples];
            let own = &mut column[joint * self.samples..][..self.samples];
            match knowledge {
                Knowledge::Clearance => own.copy_from_slice(&self.friction[joint]),
                _ => {
                    let speed = self.counted(&self.record.dq).iter().map(|dq| dq[joint]);
                    own.iter_mut()
                        .zip(speed)
                        .for_each(|(out, v)| *out = f64::from(v.partial_cmp(&0.0).map_or(0, |o| o as i8)));
                }
            }
            columns.push(column);
        }
        columns
    }

    /// Columns of the base parameters and of friction; with clearance also of what mass 2 does beyond them, since the offset
    /// of journal 2 changes the distance between the axes.
    pub(super) fn base_columns(&self, knowledge: Knowledge) -> Vec<Vec<f64>> {
        let mut all = self.columns(knowledge);
        let friction = all.split_off(PARAMETERS);
        let beyond = (knowledge == Knowledge::Clearance).then(|| {
            let of = |k: usize| all[k].iter();
            let rest = of(MASS_2).zip(of(INERTIA_1)).zip(of(MOMENT_1));
            let length = self.length;
            rest.map(|((m, i), h)| m - length * length * i - length * h).collect()
        });
        BASE_COLUMNS.iter().map(|k| all[*k].clone()).chain(friction).chain(beyond).collect()
    }
}

/// Triangle of columns beside a right-hand side.
pub(super) fn factor(columns: &[Vec<f64>], effort: &[f64]) -> Result<Factor, StudyError> {
    let mut builder = FactorBuilder::new(columns.len());
    builder.push_block(&columns.concat(), effort.len(), effort).map_err(fault)?;
    Ok(builder.finish())
}
