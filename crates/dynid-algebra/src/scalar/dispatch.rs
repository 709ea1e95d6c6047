//! Lanes at the width that the processor at hand is best at, chosen at run time.

use super::{Lanes, Scalar};

/// Number of samples that run side by side.
pub const LANES: usize = 4;

/// Work that runs on lanes.
///
/// Everything that `run` calls must be `#[inline(always)]`, so that it is compiled once more inside the function that
/// may use the processor's wide registers.
pub trait LaneTask {
    /// Runs the work with the given lane type; `load` and `store` move [`LANES`] consecutive numbers.
    fn run<S: Scalar>(self, load: impl Fn(&[f64]) -> S, store: impl Fn(S, &mut [f64]));
}

/// Work on one sample that comes in two versions.
pub trait FusedTask {
    /// For processors with fused multiply-add; everything it calls must be `#[inline(always)]`.
    fn fused(self);
    /// For all others.
    fn plain(self);
}

/// Runs the version that suits the processor.
#[inline]
pub fn run_fused(task: impl FusedTask) {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma") {
        #[expect(unsafe_code, reason = "the features that the function is compiled for were just detected")]
        // SAFETY: both target features are present.
        unsafe {
            run_fused_avx2(task);
        }
        return;
    }
    task.plain();
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn run_fused_avx2(task: impl FusedTask) {
    task.fused();
}

/// Runs a task with fused multiply-add on AVX2 where the processor has it, else with what every x86-64 has.
pub fn run_on_lanes(task: impl LaneTask) {
    #[cfg(target_arch = "x86_64")]
    let Some(task) = on_avx2(task) else { return };
    run_plain(task);
}

/// Runs a task on lanes that the processor has; gives it back where it has none, as an x86-64 without AVX2.
///
/// For large tasks, of which no second version on lanes is compiled for such processors: one sample after the other does for them.
#[must_use]
pub fn run_on_wide_lanes<T: LaneTask>(task: T) -> Option<T> {
    #[cfg(target_arch = "x86_64")]
    return on_avx2(task);
    #[cfg(not(target_arch = "x86_64"))]
    {
        run_plain(task);
        None
    }
}

/// Runs a task with AVX2 and fused multiply-add, or gives it back.
#[cfg(target_arch = "x86_64")]
fn on_avx2<T: LaneTask>(task: T) -> Option<T> {
    if !(std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma")) {
        return Some(task);
    }
    #[expect(unsafe_code, reason = "the features that the function is compiled for were just detected")]
    // SAFETY: both target features are present.
    unsafe {
        run_avx2(task);
    }
    None
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn run_avx2(task: impl LaneTask) {
    task.run(Lanes::<LANES, true>::load, |lanes, to| lanes.store(to));
}

fn run_plain(task: impl LaneTask) {
    task.run(Lanes::<LANES, false>::load, |lanes, to| lanes.store(to));
}
