//! Random states of a mechanism, for questions about structure that need no log.

use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::description::JointKind;
use crate::dynamics::MotionBlock;
use crate::element::is_temperature;
use crate::mechanism::Mechanism;

/// Motion that owns its samples; see [`MotionBlock`] for the layout (`stride = samples`).
#[derive(Debug, Clone, PartialEq)]
pub struct RandomMotion {
    samples: usize,
    q: Vec<f64>,
    dq: Vec<f64>,
    ddq: Vec<f64>,
    channels: Vec<(String, Vec<f64>)>,
}

impl RandomMotion {
    /// Uniform positions inside the limits (±π and ±1 m where the file states none), rates in ±2, accelerations in ±5,
    /// extra channels in ±1 (temperatures in 20 .. 40 °C); unit quaternions for floating joints. The same seed gives the
    /// same numbers.
    pub fn new<'a>(
        mechanism: &Mechanism,
        channels: impl IntoIterator<Item = &'a String>,
        samples: usize,
        seed: u64,
    ) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut q = Vec::new();
        let mut uniform = |range: f64, count: usize| -> Vec<f64> {
            (0..count).map(|_| rng.random_range(-range..=range)).collect()
        };
        let rates = mechanism.rates();
        let dq = uniform(2.0, rates * samples);
        let ddq = uniform(5.0, rates * samples);
        let channels = channel_values(channels, |range| uniform(range, samples));
        for body in mechanism.bodies() {
            if mechanism.follows().is_some() && body.joint.mimic.is_some() {
                continue;
            }
            if body.joint.kind == JointKind::Floating {
                q.extend(floating_positions(&mut rng, samples));
                continue;
            }
            let reach = if body.joint.kind == JointKind::Prismatic { 1.0 } else { std::f64::consts::PI };
            let (low, high) = match body.joint.limits.position {
                Some((low, high)) if high > low && body.joint.kind != JointKind::Continuous => {
                    (low.max(-4.0 * reach), high.min(4.0 * reach))
                }
                _ => (-reach, reach),
            };
            let (low, high) = if high > low { (low, high) } else { (-reach, reach) };
            q.extend((0..samples).map(|_| rng.random_range(low..=high)));
        }
        RandomMotion { samples, q, dq, ddq, channels }
    }

    /// Returns the motion with coordinates that no body moves with, of these travels ([`EffortModel::travels`](crate::EffortModel::travels)).
    pub(crate) fn with_travels(mut self, travels: &[f64], seed: u64) -> Self {
        let samples = self.samples;
        let mut rng = ChaCha8Rng::seed_from_u64(seed.wrapping_add(0x636f_6f72_6469));
        for travel in travels {
            let mut uniform = |range: f64| -> Vec<f64> {
                let range = range * travel.abs();
                (0..samples).map(|_| rng.random_range(-range..=range)).collect()
            };
            self.q.extend(uniform(std::f64::consts::PI));
            self.dq.extend(uniform(2.0));
            self.ddq.extend(uniform(5.0));
        }
        self
    }

    /// From positions, rates and accelerations, `[k * samples + s]`, and named channels.
    pub(crate) fn from_parts(
        samples: usize,
        [q, dq, ddq]: [Vec<f64>; 3],
        channels: Vec<(String, Vec<f64>)>,
    ) -> Self {
        RandomMotion { samples, q, dq, ddq, channels }
    }

    /// Number of samples.
    pub fn samples(&self) -> usize {
        self.samples
    }

    /// Runs `work` on all samples as one block.
    pub fn with_block<T>(&self, work: impl FnOnce(&MotionBlock<'_>) -> T) -> T {
        let channels: Vec<(&str, &[f64])> =
            self.channels.iter().map(|(n, v)| (n.as_str(), v.as_slice())).collect();
        work(&MotionBlock {
            samples: self.samples,
            stride: self.samples,
            q: &self.q,
            dq: &self.dq,
            ddq: &self.ddq,
            gravity: None,
            channels: &channels,
            sign_width: 0.0,
        })
    }
}

/// Values in ±1 for named channels, temperatures in 20 .. 40 °C, from values in ± a range.
pub(crate) fn channel_values<'a>(
    names: impl IntoIterator<Item = &'a String>,
    mut uniform: impl FnMut(f64) -> Vec<f64>,
) -> Vec<(String, Vec<f64>)> {
    names
        .into_iter()
        .map(|name| {
            let mut values = uniform(1.0);
            if is_temperature(name) {
                values.iter_mut().for_each(|t| *t = 30.0 + 10.0 * *t);
            }
            (name.clone(), values)
        })
        .collect()
}

fn floating_positions(rng: &mut impl Rng, samples: usize) -> Vec<f64> {
    let mut q = vec![0.0; 7 * samples];
    for s in 0..samples {
        let mut quaternion = [0.0; 4];
        let mut norm: f64 = 0.0;
        while !(0.1..=1.0).contains(&norm) {
            quaternion = std::array::from_fn(|_| rng.random_range(-1.0..=1.0));
            norm = quaternion.iter().map(|x| x * x).sum::<f64>().sqrt();
        }
        for k in 0..3 {
            q[k * samples + s] = rng.random_range(-1.0..=1.0);
        }
        for (k, x) in quaternion.iter().enumerate() {
            q[(3 + k) * samples + s] = x / norm;
        }
    }
    q
}
