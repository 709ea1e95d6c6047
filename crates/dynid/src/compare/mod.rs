//! Every applicable estimator on the same logs, ranked on time that none of them saw.
//!
//! The training logs are cut into contiguous folds of time. Each estimator fits the model to all folds but one and predicts
//! that one; what is compared is the effort through one filter, joint by joint. Kernel, reversal mask and delay are chosen
//! once for all from the whole logs, and are alike for every estimator; friction shapes, weights, priors, simulations and
//! searches are found again without the held-out fold.

mod estimators;
mod record;
mod report;

use std::sync::Arc;
use std::time::Instant;

use dynid_model::{EffortModel, RobotModel};
use dynid_motion::mask::edges;
use dynid_rows::conditioning::{Conditioning, ConditioningSettings, PreparedLog};

use crate::Error;
use crate::agreement::{Alignment, compare as against};
use crate::config::{Config, Route};
use crate::log::Log;
use crate::pipeline::{self, ModelFit, Problem, Step};
use crate::robot::Robot;
use crate::settings::Settings;
use estimators::{Contestant, contestants};
pub use record::{CompareStatus, ComparedEstimator, Comparison, JointError};

/// Folds of time per log.
pub const FOLDS: usize = 5;

/// Errors of an estimator on one fold.
#[derive(Debug, Clone)]
struct FoldScore {
    /// Per joint: mean squares of the error and of the effort through the filter; `None` where the joint does not move.
    joints: Vec<Option<(f64, f64)>>,
    /// Per joint, in motion and at rest: sum of squared errors and number of samples.
    apart: Vec<[(f64, f64); 2]>,
    /// Time of the fit, s.
    seconds: f64,
}

/// Compares all estimators that a configuration allows. `progress`: fits done, of how many, and what is being fitted.
///
/// # Errors
/// Fails as [`crate::identify()`] does. An estimator that fails is in the table with its reason, and no error.
pub fn compare(config: &Config, progress: &mut dyn FnMut(usize, usize, &str)) -> Result<Comparison, Error> {
    progress(0, 1, "reading");
    let compact = Config {
        conditioning: crate::config::ConditioningConfig {
            route: Route::Compact,
            ..config.conditioning.clone()
        },
        ..config.clone()
    };
    compact.check()?;
    compact.demand_inputs()?;
    let robot = compact.read_robot()?;
    let logs = compact.read_all(&robot, &mut |_: Step| {})?;
    compare_logs(robot, logs, &config.settings()?, progress)
}

/// Compares all estimators that settings allow on logs, which need not come from files. `progress`: fits done, of how many, and what is
/// being fitted.
///
/// # Errors
/// Fails as [`pipeline::open`] does. An estimator that fails is in the table with its reason, and no error.
pub fn compare_logs(
    robot: Robot,
    logs: Vec<Log>,
    asked: &Settings,
    progress: &mut dyn FnMut(usize, usize, &str),
) -> Result<Comparison, Error> {
    let mut compact = asked.clone();
    compact.conditioning.route = Route::Compact;
    let mut opened = pipeline::open(robot, logs, &compact, &mut |_| {})?;
    progress(0, 1, "conditioning");
    let conditioning = opened.problem.condition(&mut |_| {})?;
    let conditioning = conditioning.unwrap_or_else(|| unreachable!("the route is the compact one"));
    let bench = Bench {
        problem: &opened.problem,
        conditioning: &conditioning,
        settings: asked.conditioning_settings(),
    };
    let list = contestants(asked, &opened.problem);
    let folds: Vec<[Arc<[PreparedLog]>; 2]> = (0..FOLDS).map(|k| split(&opened.problem.logs, k)).collect();
    let total = list.len() * FOLDS;
    let scores = list
        .iter()
        .enumerate()
        .map(|(k, contestant)| {
            let each = folds.iter().enumerate().map(|(fold, [training, held_out])| {
                progress(k * FOLDS + fold, total, contestant.name);
                bench.score(contestant, training, held_out)
            });
            each.collect::<Result<Vec<FoldScore>, Error>>().map_err(|e| e.to_string())
        })
        .collect();
    let mut inputs = opened.problem.robot.inputs();
    inputs.extend(opened.inputs().cloned());
    Ok(record::ranked(&opened.problem, inputs, &conditioning, &list, scores))
}

struct Bench<'a> {
    problem: &'a Problem,
    conditioning: &'a Conditioning,
    settings: ConditioningSettings,
}

impl Bench<'_> {
    fn score(
        &self,
        contestant: &Contestant,
        training: &Arc<[PreparedLog]>,
        held_out: &[PreparedLog],
    ) -> Result<FoldScore, Error> {
        let start = Instant::now();
        let (problem, fit) = self.fit(contestant, training)?;
        let unfolded = fit.unfolded(&problem)?;
        let seconds = start.elapsed().as_secs_f64();
        let (model, values): (&RobotModel, &[f64]) = match &unfolded {
            Some((model, values)) => (model, values),
            None => (&problem.model, &fit.consistent.values),
        };
        let textbook = contestant.settings.conditioning.route == Route::Textbook;
        let alignment = Alignment {
            state_hz: self.conditioning.state_hz.iter().copied().fold(f64::INFINITY, f64::min),
            // The textbook route knows of no delay, and its predictions go without.
            delay_samples: if textbook { 0.0 } else { self.conditioning.delay.samples },
            delay_rate_hz: self.problem.logs[0].rate_hz,
            filter_hz: self.conditioning.kernel_hz,
        };
        let mut sums = vec![(0.0, 0.0, 0.0); model.outputs().len()];
        // Squared errors and samples in motion and at rest.
        let mut apart = vec![[(0.0, 0.0); 2]; model.outputs().len()];
        for log in held_out {
            // A fold of a short log may hold nothing but edges.
            let Ok(found) = against(model, values, log, &alignment, &self.settings) else { continue };
            let counted = found.counted.iter().filter(|c| **c).count() as f64;
            for (j, sum) in sums.iter_mut().enumerate().filter(|(j, _)| found.moves[*j]) {
                let stands = counted * found.standing_share[j];
                let parts = [(&found.moving, counted - stands), (&found.standing, stands)];
                for (sum, (fit, samples)) in apart[j].iter_mut().zip(parts) {
                    if let Some(rms) = fit.channels[j].rms {
                        sum.0 += samples * rms * rms;
                        sum.1 += samples;
                    }
                }
                let channel = &found.filtered.channels[j];
                if let (Some(rms), Some(relative)) = (channel.rms, channel.relative_error) {
                    sum.0 += counted * rms * rms;
                    sum.1 += counted * (100.0 * rms / relative.max(1e-12)).powi(2);
                    sum.2 += counted;
                }
            }
        }
        let joints = sums.iter().map(|(e, y, n)| (*n > 0.0).then(|| (e / n, y / n))).collect();
        Ok(FoldScore { joints, apart, seconds })
    }

    fn fit(
        &self,
        contestant: &Contestant,
        training: &Arc<[PreparedLog]>,
    ) -> Result<(Problem, ModelFit), Error> {
        let settings = contestant.settings.clone();
        let conditioning = match settings.conditioning.route {
            Route::Compact => Some(self.conditioning.clone()),
            Route::Textbook => None,
        };
        self.problem.on(training.clone(), settings)?.fit(conditioning, &mut |_| {})
    }
}

/// Logs without a fold of their time, and that fold alone.
fn split(logs: &[PreparedLog], fold: usize) -> [Arc<[PreparedLog]>; 2] {
    let with = |inside: bool| -> Arc<[PreparedLog]> {
        logs.iter()
            .map(|log| {
                let n = log.samples();
                let range = fold * n / FOLDS..(fold + 1) * n / FOLDS;
                let mut log = log.clone();
                for (k, usable) in log.usable.iter_mut().enumerate() {
                    *usable &= range.contains(&k) == inside;
                }
                let ends = edges(n, 1);
                log.usable.iter_mut().zip(ends).for_each(|(usable, end)| *usable &= !end);
                log
            })
            .collect()
    };
    [with(false), with(true)]
}
