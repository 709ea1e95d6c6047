//! Random numbers, one stream per cause: what one cause draws never depends on whether another is on.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// What random numbers are drawn for. Stream 0 is left to the trajectory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cause {
    /// Errors of the model that the controller feeds forward.
    NominalModel = 1,
    /// Encoder noise as the controller reads it.
    Encoder = 2,
    /// Encoder noise of samples taken between the controller's.
    EncoderBetween = 3,
    /// Noise of the velocity signal.
    Velocity = 4,
    /// Noise of the effort signal.
    Effort = 5,
    /// Which samples of the effort are outliers, and how large.
    Outliers = 6,
    /// Which rows are missing.
    Dropped = 7,
    /// Errors of the time stamps.
    Clock = 8,
    /// Phases of the torque ripple.
    Ripple = 9,
    /// Noise of probes at journals.
    Journals = 10,
}

/// Generator of a cause: ChaCha8 of the seed, on the cause's own stream.
pub fn generator(seed: u64, cause: Cause) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(cause as u64);
    rng
}

/// A normally distributed number of deviation 1.
pub fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}
