//! Blocks of any length: lanes where there are enough samples, one after the other where not.

use dynid_algebra::scalar::{FusedTask, LANES, LaneTask, Lanes, Scalar, run_fused, run_on_wide_lanes};

/// Work on groups of `width` consecutive samples, each group read as one number.
pub(super) trait GroupTask {
    /// Everything that this calls must be `#[inline(always)]`; see [`LaneTask`].
    fn run<S: Scalar>(self, width: usize, load: impl Fn(&[f64]) -> S, store: impl Fn(S, &mut [f64]));
}

struct OnLanes<T>(T);

impl<T: GroupTask> LaneTask for OnLanes<T> {
    #[inline(always)]
    fn run<S: Scalar>(self, load: impl Fn(&[f64]) -> S, store: impl Fn(S, &mut [f64])) {
        self.0.run(LANES, load, store);
    }
}

struct OneByOne<T>(T);

impl<T: GroupTask> FusedTask for OneByOne<T> {
    #[inline(always)]
    fn fused(self) {
        self.0.run(1, Lanes::<1, true>::load, |value, to| value.store(to));
    }
    fn plain(self) {
        self.0.run(1, |from| from[0], |value: f64, to| to[0] = value);
    }
}

/// Runs a task on lanes, or sample after sample where there are too few of them or the processor has no lanes.
pub(super) fn run(samples: usize, task: impl GroupTask) {
    let left = if samples >= LANES { run_on_wide_lanes(OnLanes(task)) } else { Some(OnLanes(task)) };
    if let Some(OnLanes(task)) = left {
        run_fused(OneByOne(task));
    }
}

/// First sample of every group of `width`, and how many of its samples the group before has done.
#[inline(always)]
pub(super) fn groups(samples: usize, width: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..samples.div_ceil(width)).map(move |g| {
        let first = (g * width).min(samples - width);
        (first, g * width - first)
    })
}
