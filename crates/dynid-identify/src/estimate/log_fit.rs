//! Figures of a log from its agreement.

use dynid_estimate::metrics::{Fit, FitSums};

use super::{ByMotion, LogFit};
use crate::agreement::{Agreement, FitValues};

/// The figures of one log as the result file holds them.
pub fn log_fit(a: &Agreement) -> LogFit {
    LogFit {
        log: a.name.clone(),
        raw: FitValues::from(&a.raw),
        filtered: FitValues::from(&a.filtered),
        filter_hz: a.filter_hz,
        filtered_unaligned: FitValues::from(&a.filtered_unaligned),
        by_motion: by_motion(std::slice::from_ref(a)),
    }
}

/// Figures in motion and at rest, those of several logs pooled joint by joint over the samples of either kind.
pub(crate) fn by_motion(all: &[Agreement]) -> ByMotion {
    let joints = all.first().map_or(0, |a| a.standing_share.len());
    let counted = |a: &Agreement| a.counted.iter().filter(|c| **c).count() as f64;
    let stands = |a: &Agreement, j: usize| counted(a) * a.standing_share[j];
    // Over all joints there is no figure: the samples of each are others.
    let pooled = |fit: &dyn Fn(&Agreement) -> &Fit| {
        let of_one = all.len() == 1;
        let values = pool(all.iter().map(fit));
        FitValues { relative_error: values.relative_error.filter(|_| of_one), ..values }
    };
    let total: f64 = all.iter().map(counted).sum();
    let least = |j: usize| all.iter().map(|a| a.motion.least_speed[j]).fold(f64::INFINITY, f64::min);
    ByMotion {
        moving: pooled(&|a| &a.moving),
        standing: pooled(&|a| &a.standing),
        standing_share: (0..joints).map(|j| all.iter().map(|a| stands(a, j)).sum::<f64>() / total).collect(),
        least_speed: (0..joints).map(least).collect(),
    }
}

/// Figures of several logs: errors in parts of what the efforts of all of them hold, R² of what varies within the logs.
pub(crate) fn pool<'a>(fits: impl Iterator<Item = &'a Fit>) -> FitValues {
    FitValues::from(&FitSums::pooled(fits.map(|fit| &fit.sums)).fit())
}
