//! Whether logs bear out what ties say: the same rows, with every parameter free.

use dynid_estimate::distribution::{f_quantile, t_quantile};
use dynid_estimate::identifiability::excited_regrouping;
use dynid_estimate::linear::{LinearMethod, ols};
use dynid_factor::rows::RowSource;
use dynid_linalg::Mat;
use dynid_model::{BaseParameters, BaseSettings, EffortModel, RobotModel, Ties};
use dynid_rows::conditioning::{LogRows, textbook_rows};

use super::model_fit::ModelFit;
use crate::fitting::{self, Fitted};
use crate::problem::Problem;
use crate::tie_test::{TieDeviation, TieTest};
use crate::{Error, advice, shape};

/// Confidence of the tests.
const CONFIDENCE: f64 = 0.99;
/// A relation is seen by the data if it is one of base parameters up to this share, in units of what is known before.
const SEEN: f64 = 1e-6;

/// Tests the ties of a fit; `None` without any, or where they hold nothing that the logs show.
///
/// # Errors
/// [`Error::Conditioning`].
pub(crate) fn test(problem: &Problem, fit: &ModelFit) -> Result<Option<TieTest>, Error> {
    let Some(ties) = problem.model.ties() else { return Ok(None) };
    let free = free_model(problem, fit)?;
    let shape = free.parameters().shape_start();
    let settings = BaseSettings { seed: problem.settings.seed.unwrap_or(1), ..BaseSettings::default() };
    let base = BaseParameters::of_model(&free, &shape, &settings);
    let conditioned = problem.conditioning_settings();
    let logs = &problem.logs;
    let source: Box<dyn RowSource + '_> = match &fit.conditioning {
        Some(found) => Box::new(LogRows::new(&free, &shape, &base.kept, logs, found, &conditioned)?),
        None => {
            let route = problem.settings.textbook_route();
            Box::new(textbook_rows(&free, &shape, &base.kept, logs, &route, &conditioned)?)
        }
    };
    // Weights and colour of the residual are those of the fit in which ties may fail: one that is wrong leaves residuals of any colour.
    let (estimate, groups) = fitting::fit(&problem.settings, base.len(), &LinearMethod::Wls, &*source)?;
    let residuals = fitting::residuals(&*source, &estimate)?;
    drop(source);
    let fixed = problem.settings.conditioning.block_s.is_some();
    let fitted = fitting::with_precision(estimate, &residuals, logs, fixed);
    let explained = vec![true; free.outputs().len()];
    let tied = ols(&fitted.deflated(&fit.groups, problem.structure.base.len(), &explained));
    let loose = ols(&fitted.deflated(&groups, base.len(), &explained));
    let held = loose.kept.len().saturating_sub(tied.kept.len());
    if held == 0 {
        return Ok(None);
    }
    let freedom = (fitted.estimate.blocks.len() as f64 - 1.0).max(1.0);
    let limit = f_quantile(CONFIDENCE, held as f64, freedom).unwrap_or(f64::INFINITY);
    let fall = (tied.rss - loose.rss).max(0.0);
    let regrouping = advice::regrouping(&base);
    let whole = Relations { free: &free, ties, regrouping: &regrouping, fitted: &fitted };
    Ok(Some(TieTest {
        f: fall / held as f64,
        limit,
        held,
        relief: if tied.rss > 0.0 { 1.0 - (loose.rss / tied.rss).sqrt() } else { 0.0 },
        deviations: whole.deviations(&problem.structure.prior.std, freedom),
    }))
}

/// The model of the fit with every parameter free.
fn free_model(problem: &Problem, fit: &ModelFit) -> Result<RobotModel, Error> {
    let mut plan = problem.plan.clone();
    // Columns of the fit tell how friction changes with its loads: those without ties have to do so as well, to hold the tied ones.
    if let Some(loads) = &mut plan.load_values {
        loads.linearised = true;
    }
    match &fit.shapes {
        None => plan.model(&problem.robot.mechanism),
        Some(found) => shape::linearised_whole(&plan, &found.model, &found.linear, &found.free()),
    }
}

/// Relations of ties beside a fit in which they may fail.
struct Relations<'a> {
    free: &'a RobotModel,
    ties: &'a Ties,
    regrouping: &'a Mat,
    fitted: &'a Fitted,
}

impl Relations<'_> {
    fn deviations(&self, scale: &[f64], freedom: f64) -> Vec<TieDeviation> {
        let fit = &self.fitted.estimate;
        let excited = excited_regrouping(&fit.factor, &fit.solution.kept, self.regrouping);
        let (k, p) = (excited.nrows(), excited.ncols());
        if k == 0 {
            return Vec::new();
        }
        // A relation c is told by the data if c = Kᵀ a: then it is a of the base parameters.
        let rows = Mat::from_fn(p, k, |j, i| excited[(i, j)] * scale[j]).qr();
        let covariance = self.fitted.covariance();
        let x = fit.kept_x();
        let table = self.free.parameters();
        let mut out: Vec<(f64, TieDeviation)> = Vec::new();
        let mut told = 0;
        for dependent in self.ties.linear() {
            let mut relation = vec![0.0; p];
            relation[dependent.index] = 1.0;
            dependent.terms.iter().for_each(|(c, f)| relation[*c] -= f);
            let side = Mat::from_fn(p, 1, |j, _| relation[j] * scale[j]);
            let a = rows.solve_least_squares(&side);
            let left = (0..p).map(|j| {
                let own: f64 = (0..k).map(|i| excited[(i, j)] * a[(i, 0)]).sum();
                ((own - relation[j]) * scale[j]).powi(2)
            });
            if left.sum::<f64>().sqrt() > SEEN * side.norm_l2() {
                continue;
            }
            told += 1;
            let value = (0..k).map(|i| a[(i, 0)] * x[i]).sum::<f64>() - dependent.constant;
            let row = |i: usize| (0..k).map(|j| a[(i, 0)] * a[(j, 0)] * covariance[(i, j)]).sum::<f64>();
            let std = (0..k).map(row).sum::<f64>().max(0.0).sqrt();
            let tie = Ties::words(dependent, table);
            let unit = table.linear[dependent.index].unit.to_owned();
            out.push(((value / std).abs(), TieDeviation { tie, value, std, unit }));
        }
        let probability = 1.0 - (1.0 - CONFIDENCE) / (2.0 * f64::from(told.max(1)));
        let limit = t_quantile(probability, freedom).unwrap_or(f64::INFINITY);
        out.retain(|(t, _)| *t > limit);
        out.sort_by(|a, b| b.0.total_cmp(&a.0));
        out.into_iter().map(|(_, deviation)| deviation).collect()
    }
}
