//! The table of a comparison.

use dynid_model::EffortModel;
use dynid_rows::conditioning::Conditioning;
use serde::Serialize;

use super::estimators::Contestant;
use super::{FOLDS, FoldScore};
use crate::estimate::InputRecord;
use crate::pipeline::Problem;

/// Error of an estimator on one joint.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, schemars::JsonSchema)]
pub struct JointError {
    /// Root mean square of the held-out error, N m or N.
    pub rms: f64,
    /// Error relative to the root mean square of the effort, %.
    pub relative: f64,
    /// The root mean square of samples in which the joint moves, N m or N.
    pub rms_moving: Option<f64>,
    /// Of samples in which it stands, where friction has any value up to static friction.
    pub rms_standing: Option<f64>,
    /// Share of the samples in which it stands.
    pub standing_share: f64,
}

/// An estimator with its errors on time that it did not see.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct ComparedEstimator {
    /// Name.
    pub name: String,
    /// What it does.
    pub what: String,
    /// Place, from 1; `None` if it failed.
    pub rank: Option<usize>,
    /// Mean over joints of the relative held-out error, mean over folds, %.
    pub error: Option<f64>,
    /// Standard error of that mean over folds.
    pub standard_error: Option<f64>,
    /// By how much it exceeds the best one's, %, and the standard error of that difference, paired by fold.
    pub behind: Option<[f64; 2]>,
    /// Whether it is behind the best by less than two standard errors.
    pub level_with_best: bool,
    /// Per joint, over all folds; `None` where the joint does not move.
    pub joints: Vec<Option<JointError>>,
    /// Time of one fit, s, mean over folds.
    pub seconds: Option<f64>,
    /// Why it failed.
    pub failure: Option<String>,
}

/// Held-out error of an estimator that predicts well, mean over joints, at most, %.
const WELL: f64 = 10.0;

/// How well the best estimator of a comparison predicts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CompareStatus {
    /// Within 10 % of the effort, mean over joints.
    Well,
    /// Worse: all estimators fit one model to the same rows, which do not go together.
    Poorly,
    /// None could be fitted.
    NoneFitted,
}

/// Outcome of [`super::compare()`].
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct Comparison {
    /// Robot file.
    pub robot: String,
    /// Log files.
    pub logs: Vec<String>,
    /// Joints.
    pub joints: Vec<String>,
    /// Folds of time per log.
    pub folds: usize,
    /// Cut-off of the filter that errors are formed through, Hz.
    pub filter_hz: f64,
    /// Estimators, best first, failed ones last.
    pub estimators: Vec<ComparedEstimator>,
    /// Files as they were read.
    #[serde(skip)]
    pub inputs: Vec<InputRecord>,
}

impl Comparison {
    /// The result as JSON.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).unwrap_or_default()
    }

    /// What was found, in one line.
    pub fn headline(&self) -> String {
        let Some(best) = self.estimators.first().filter(|e| e.rank.is_some()) else {
            return "No estimator could be fitted".to_owned();
        };
        let level: Vec<&str> =
            self.estimators.iter().skip(1).filter(|e| e.level_with_best).map(|e| e.name.as_str()).collect();
        let error = best.error.unwrap_or(0.0);
        let level = match level.is_empty() {
            true => String::new(),
            false => format!("; level with it: {}", level.join(", ")),
        };
        let well = match self.status() {
            CompareStatus::Well => "",
            _ => {
                "; none predicts well, so the model or the logs are at fault, not the estimator: `dynid identify` says more"
            }
        };
        format!("`{}` predicts unseen time best, within {error:.2} % of the effort{level}{well}", best.name)
    }

    /// How well the best estimator predicts time that it did not see.
    pub fn status(&self) -> CompareStatus {
        match self.estimators.first().filter(|e| e.rank.is_some()).and_then(|e| e.error) {
            Some(error) if error <= WELL => CompareStatus::Well,
            Some(_) => CompareStatus::Poorly,
            None => CompareStatus::NoneFitted,
        }
    }
}

/// Relative error of a fold, mean over joints, %.
fn error(score: &FoldScore) -> Option<f64> {
    let each: Vec<f64> =
        score.joints.iter().flatten().map(|(e, y)| 100.0 * (e / y.max(f64::MIN_POSITIVE)).sqrt()).collect();
    (!each.is_empty()).then(|| each.iter().sum::<f64>() / each.len() as f64)
}

fn mean_and_error(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let spread: f64 = values.iter().map(|x| (x - mean).powi(2)).sum();
    (mean, if n > 1.0 { (spread / (n - 1.0) / n).sqrt() } else { 0.0 })
}

/// The table, ranked.
pub(super) fn ranked(
    problem: &Problem,
    inputs: Vec<InputRecord>,
    conditioning: &Conditioning,
    list: &[Contestant],
    scores: Vec<Result<Vec<FoldScore>, String>>,
) -> Comparison {
    let folds: Vec<Vec<Option<f64>>> =
        scores.iter().map(|s| s.iter().flatten().map(error).collect()).collect();
    let mut estimators: Vec<(ComparedEstimator, usize)> = list
        .iter()
        .zip(scores)
        .enumerate()
        .map(|(k, (contestant, score))| (entry(contestant, score), k))
        .collect();
    estimators.sort_by(|(a, _), (b, _)| {
        a.error.unwrap_or(f64::INFINITY).total_cmp(&b.error.unwrap_or(f64::INFINITY))
    });
    let best = estimators.first().map(|(_, k)| folds[*k].clone()).unwrap_or_default();
    for (place, (estimator, k)) in estimators.iter_mut().enumerate() {
        if estimator.error.is_none() {
            continue;
        }
        estimator.rank = Some(place + 1);
        let differences: Vec<f64> =
            folds[*k].iter().zip(&best).filter_map(|(own, best)| Some((*own)? - (*best)?)).collect();
        let (mean, spread) = mean_and_error(&differences);
        estimator.behind = Some([mean, spread]);
        estimator.level_with_best = mean <= 2.0 * spread;
    }
    Comparison {
        inputs,
        robot: problem.robot.path.display().to_string(),
        logs: problem.logs.iter().map(|l| l.name.clone()).collect(),
        joints: problem.model.outputs().iter().map(|o| o.name.clone()).collect(),
        folds: FOLDS,
        filter_hz: conditioning.kernel_hz,
        estimators: estimators.into_iter().map(|(e, _)| e).collect(),
    }
}

fn entry(contestant: &Contestant, score: Result<Vec<FoldScore>, String>) -> ComparedEstimator {
    let mut out = ComparedEstimator {
        name: contestant.name.to_owned(),
        what: contestant.what.to_owned(),
        rank: None,
        error: None,
        standard_error: None,
        behind: None,
        level_with_best: false,
        joints: Vec::new(),
        seconds: None,
        failure: None,
    };
    let folds = match score {
        Ok(folds) => folds,
        Err(reason) => return ComparedEstimator { failure: Some(reason), ..out },
    };
    let errors: Vec<f64> = folds.iter().filter_map(error).collect();
    if errors.is_empty() {
        return ComparedEstimator { failure: Some("no sample of the folds counts".to_owned()), ..out };
    }
    let (mean, spread) = mean_and_error(&errors);
    (out.error, out.standard_error) = (Some(mean), Some(spread));
    out.seconds = Some(folds.iter().map(|f| f.seconds).sum::<f64>() / folds.len() as f64);
    let joints = folds.first().map_or(0, |f| f.joints.len());
    out.joints = (0..joints)
        .map(|j| {
            let of: Vec<(f64, f64)> = folds.iter().filter_map(|f| f.joints[j]).collect();
            let count = of.len() as f64;
            let (e, y) = of.iter().fold((0.0, 0.0), |(e, y), f| (e + f.0 / count, y + f.1 / count));
            let [moving, standing] = [0, 1].map(|part| {
                folds.iter().map(|f| f.apart[j][part]).fold((0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1))
            });
            let rms = |(sum, samples): (f64, f64)| (samples > 0.0).then(|| (sum / samples).sqrt());
            (count > 0.0).then(|| JointError {
                rms: e.sqrt(),
                relative: 100.0 * (e / y.max(f64::MIN_POSITIVE)).sqrt(),
                rms_moving: rms(moving),
                rms_standing: rms(standing),
                standing_share: standing.1 / (moving.1 + standing.1).max(1.0),
            })
        })
        .collect();
    out
}
