//! Figures of a log from its agreement.

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
    let pooled = |fit: &dyn Fn(&Agreement) -> FitValues, count: &dyn Fn(&Agreement, usize) -> f64| {
        let each: Vec<(FitValues, &Agreement)> = all.iter().map(|a| (fit(a), a)).collect();
        if let [(only, _)] = &each[..] {
            return only.clone();
        }
        let mean = |j: usize, pick: &dyn Fn(&FitValues) -> Option<f64>| -> Option<f64> {
            let parts = || each.iter().filter_map(|(f, a)| Some((pick(f)?, count(a, j))));
            let total: f64 = parts().map(|(_, n)| n).sum();
            (total > 0.0).then(|| parts().map(|(x, n)| x * n).sum::<f64>() / total)
        };
        let of = |pick: &dyn Fn(&FitValues, usize) -> Option<f64>| -> Vec<Option<f64>> {
            (0..joints).map(|j| mean(j, &|f| pick(f, j))).collect()
        };
        FitValues {
            rms: of(&|f, j| f.rms[j].map(|r| r * r)).into_iter().map(|m| m.map(f64::sqrt)).collect(),
            nrmse: of(&|f, j| f.nrmse[j]),
            r2: of(&|f, j| f.r2[j]),
            correlation: of(&|f, j| f.correlation[j]),
            relative_error_per_joint: of(&|f, j| f.relative_error_per_joint[j]),
            relative_error: None,
        }
    };
    let total: f64 = all.iter().map(counted).sum();
    let least = |j: usize| all.iter().map(|a| a.motion.least_speed[j]).fold(f64::INFINITY, f64::min);
    ByMotion {
        moving: pooled(&|a| FitValues::from(&a.moving), &|a, j| counted(a) - stands(a, j)),
        standing: pooled(&|a| FitValues::from(&a.standing), &stands),
        standing_share: (0..joints).map(|j| all.iter().map(|a| stands(a, j)).sum::<f64>() / total).collect(),
        least_speed: (0..joints).map(least).collect(),
    }
}

pub(crate) fn pool(all: &[(FitValues, usize)]) -> FitValues {
    let [(only, _)] = all else {
        let joints = all.first().map_or(0, |(f, _)| f.rms.len());
        let total: usize = all.iter().map(|(_, n)| n).sum();
        let mean_square = |j: usize| -> Option<f64> {
            let sum = all.iter().try_fold(0.0, |s, (f, n)| Some(s + f.rms[j]?.powi(2) * *n as f64))?;
            (total > 0).then(|| (sum / total as f64).sqrt())
        };
        // Range, R² and relative errors have no meaning across logs with different motions; the log-by-log figures do.
        let weighted = |pick: &dyn Fn(&FitValues) -> Option<f64>| -> Option<f64> {
            let sum = all.iter().try_fold(0.0, |s, (f, n)| Some(s + pick(f)? * *n as f64))?;
            (total > 0).then(|| sum / total as f64)
        };
        return FitValues {
            rms: (0..joints).map(mean_square).collect(),
            nrmse: (0..joints).map(|j| weighted(&|f| f.nrmse[j])).collect(),
            r2: (0..joints).map(|j| weighted(&|f| f.r2[j])).collect(),
            correlation: (0..joints).map(|j| weighted(&|f| f.correlation[j])).collect(),
            relative_error_per_joint: (0..joints)
                .map(|j| weighted(&|f| f.relative_error_per_joint[j]))
                .collect(),
            relative_error: weighted(&|f| f.relative_error),
        };
    };
    only.clone()
}
