//! The random stream of a run.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use dynid_words::Transfer;

/// ChaCha8 from the seed of a run; its position in the stream is all its state.
#[derive(Clone)]
pub(super) struct Random(ChaCha8Rng);

impl Random {
    pub(super) fn new(seed: u64) -> Random {
        Random(ChaCha8Rng::seed_from_u64(seed))
    }

    /// Uniform on `[0, 1)`.
    pub(super) fn uniform(&mut self) -> f64 {
        self.0.random()
    }

    /// Uniform between two numbers.
    pub(super) fn between(&mut self, lower: f64, upper: f64) -> f64 {
        lower + (upper - lower) * self.uniform()
    }

    /// Uniform among `0, ..., count - 1`.
    pub(super) fn below(&mut self, count: usize) -> usize {
        self.0.random_range(0..count)
    }

    /// Uniform among `0, ..., count - 1` without `other`.
    pub(super) fn below_except(&mut self, count: usize, other: usize) -> usize {
        let drawn = self.below(count - 1);
        drawn + usize::from(drawn >= other)
    }

    /// Standard normal.
    pub(super) fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }

    /// Standard Cauchy.
    pub(super) fn cauchy(&mut self) -> f64 {
        (std::f64::consts::PI * (self.uniform() - 0.5)).tan()
    }

    /// A random order of `0, ..., count - 1` (Fisher & Yates).
    pub(super) fn permutation(&mut self, count: usize) -> Vec<usize> {
        let mut order: Vec<usize> = (0..count).collect();
        for last in (1..count).rev() {
            order.swap(last, self.below(last + 1));
        }
        order
    }

    pub(super) fn fields(&mut self, transfer: &mut Transfer<'_>) {
        let position = self.0.get_word_pos();
        let (mut low, mut high) = (position as u64, (position >> 64) as u64);
        transfer.integer(&mut low);
        transfer.integer(&mut high);
        self.0.set_word_pos(u128::from(low) | (u128::from(high) << 64));
    }
}
