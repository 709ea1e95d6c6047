//! Fits of joints 1 to 3 of the ER-16, in the published order of parameters.

use dynid_estimate::separable::{EffortBlock, SeparableEstimate};
use dynid_model::{EffortModel, MotionBlock, RegressorBlock, ShapeParameter};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde_json::Value;

use crate::er16::{self, Motion};

pub(crate) const JOINTS: usize = 3;
/// Time blocks of the motion.
const BLOCKS: usize = 10;

/// The arm on a motion.
pub(crate) struct Er16 {
    pub(crate) arm: er16::Er16,
    /// 15 base parameters, then `fo, fc, fv, fa, fb` per joint.
    pub(crate) truth: Vec<f64>,
    motion: Motion,
}

impl Er16 {
    fn new(motion: impl FnOnce(&er16::Er16) -> Motion) -> Option<Self> {
        let arm = er16::Er16::load()?;
        Some(Er16 { truth: arm.published_truth(), motion: motion(&arm), arm })
    }

    /// One period of the reference trajectory `inertial`, 200 samples.
    pub(crate) fn reference() -> Option<Self> {
        Er16::new(er16::Er16::motion)
    }

    /// The motion of the golden set.
    pub(crate) fn golden(golden: &Value) -> Option<Self> {
        Er16::new(|_| Motion::from_rows(&golden["q"], &golden["qd"], &golden["qdd"]))
    }

    /// Shape parameters with the bounds of the study.
    pub(crate) fn shape(&self) -> Vec<ShapeParameter> {
        let own = self.arm.model.parameters().shape.iter();
        own.map(|p| ShapeParameter { start: 5.5, lower: 1.0, upper: 30.0, logarithmic: true, ..p.clone() })
            .collect()
    }

    /// Per kept column: its place in the truth.
    fn places(&self) -> &[usize] {
        &self.arm.order[..self.arm.kept.len()]
    }

    fn part(&self, from: usize, samples: usize) -> MotionBlock<'_> {
        let Motion { samples: stride, q, dq, ddq } = &self.motion;
        MotionBlock {
            samples,
            stride: *stride,
            q: &q[from..],
            dq: &dq[from..],
            ddq: &ddq[from..],
            gravity: None,
            channels: &[],
            sign_width: 0.0,
        }
    }

    /// Ten time blocks of one log.
    pub(crate) fn blocks<'a>(&'a self, effort: &'a [f64]) -> Vec<EffortBlock<'a>> {
        let length = self.motion.samples.div_ceil(BLOCKS);
        (0..self.motion.samples)
            .step_by(length)
            .map(|k| EffortBlock {
                log: 0,
                motion: self.part(k, length.min(self.motion.samples - k)),
                effort: &effort[k..],
            })
            .collect()
    }

    /// Efforts of a parameter vector in the order of the truth, joint after joint.
    pub(crate) fn efforts(&self, x: &[f64]) -> Vec<f64> {
        let shape: Vec<f64> = (0..JOINTS).map(|j| x[19 + 5 * j]).collect();
        let mut linear = vec![0.0; self.arm.model.layout().parameters()];
        self.arm.kept.iter().zip(self.places()).for_each(|(column, place)| linear[*column] = x[*place]);
        let mut block = RegressorBlock::new(self.arm.model.layout().clone(), self.motion.samples);
        self.arm.model.regressor(&self.motion.block(), &shape, &mut block);
        (0..JOINTS).flat_map(|j| block.effort(j, &linear)).collect()
    }

    pub(crate) fn clean(&self) -> Vec<f64> {
        self.efforts(&self.truth)
    }

    /// Efforts with white noise of 4, 5 and 3 N m.
    pub(crate) fn noisy(&self, seed: u64) -> Vec<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let deviation = |k: usize| [4.0, 5.0, 3.0][k / self.motion.samples];
        let clean = self.clean().into_iter().enumerate();
        clean
            .map(|(k, e)| {
                let draw: f64 = StandardNormal.sample(&mut rng);
                e + deviation(k) * draw
            })
            .collect()
    }

    /// The estimate in the order of the truth.
    pub(crate) fn vector(&self, estimate: &SeparableEstimate) -> Vec<f64> {
        let mut x = vec![0.0; self.truth.len()];
        self.places().iter().zip(&estimate.linear).for_each(|(place, v)| x[*place] = *v);
        estimate.shape.iter().enumerate().for_each(|(j, fb)| x[19 + 5 * j] = *fb);
        x
    }

    /// Largest deviation from the truth.
    pub(crate) fn error(&self, estimate: &SeparableEstimate) -> f64 {
        self.vector(estimate).iter().zip(&self.truth).map(|(x, t)| (x - t).abs()).fold(0.0, f64::max)
    }

    /// `F`: mean over samples of the sum of absolute residuals of the joints.
    pub(crate) fn loss_of(&self, x: &[f64], effort: &[f64]) -> f64 {
        let residuals = self.efforts(x).into_iter().zip(effort).map(|(e, y)| (e - y).abs());
        residuals.sum::<f64>() / self.motion.samples as f64
    }

    pub(crate) fn loss(&self, estimate: &SeparableEstimate, effort: &[f64]) -> f64 {
        self.loss_of(&self.vector(estimate), effort)
    }
}
