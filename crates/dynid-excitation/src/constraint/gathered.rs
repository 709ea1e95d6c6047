//! Chosen samples of a block.

use dynid_model::MotionBlock;

/// Chosen samples of a block, packed.
pub(super) struct Gathered {
    samples: usize,
    q: Vec<f64>,
    dq: Vec<f64>,
    ddq: Vec<f64>,
    gravity: Option<Vec<f64>>,
    channels: Vec<Vec<f64>>,
}

impl Gathered {
    pub(super) fn new(
        motion: &MotionBlock<'_>,
        samples: impl ExactSizeIterator<Item = usize> + Clone,
    ) -> Self {
        let pick = |values: &[f64]| -> Vec<f64> {
            let channels = values.chunks(motion.stride).filter(|c| c.len() >= motion.samples);
            channels.flat_map(|channel| samples.clone().map(|s| channel[s])).collect()
        };
        Gathered {
            samples: samples.len(),
            q: pick(motion.q),
            dq: pick(motion.dq),
            ddq: pick(motion.ddq),
            gravity: motion.gravity.map(pick),
            channels: motion.channels.iter().map(|(_, v)| samples.clone().map(|s| v[s]).collect()).collect(),
        }
    }

    pub(super) fn with_block(&self, of: &MotionBlock<'_>, work: impl FnOnce(&MotionBlock<'_>)) {
        let channels: Vec<(&str, &[f64])> =
            of.channels.iter().zip(&self.channels).map(|((name, _), v)| (*name, v.as_slice())).collect();
        work(&MotionBlock {
            samples: self.samples,
            stride: self.samples,
            q: &self.q,
            dq: &self.dq,
            ddq: &self.ddq,
            gravity: self.gravity.as_deref(),
            channels: &channels,
            sign_width: of.sign_width,
        });
    }
}
