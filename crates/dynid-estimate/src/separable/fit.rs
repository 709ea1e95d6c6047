//! The separable fit from problem to estimate.

use super::estimate::{SeparableEstimate, kappa};
use super::levenberg::{SearchStatus, Stops, search};
use super::polish::polish;
use super::problem::{RowGroup, SeparableProblem, check};
use super::profile::{Minimum, ShapeFinding, ShapeVerdict};
use super::reduction::{GroupReduction, Target};
use super::robust::{Robust, refine_robust};
use super::settings::{SeparableError, SeparableLoss, SeparableSettings, ShapeSearch, Weighting};
use super::starts::{START_FALL, StartReport, multi_start, starts};
use super::work::Work;
use crate::linear::{LinearMethod, estimate};
use dynid_factor::groups::ReducedGroup;
use dynid_model::ShapeParameter;
use dynid_search::{self as search, Bounds, PointObjective, SearchError};
use rayon::prelude::*;
use std::ops::ControlFlow;

/// Residuals below this share of the efforts are rounding, as for the weights of linear fits.
const ROUNDING: f64 = 1e-9;

/// Fits linear and shape parameters of a separable problem.
///
/// 1. Multi-start of Levenberg-Marquardt searches on the projected residual, with variances of a linear fit at the given
///    start; then variances and parameters in turn until both settle.
/// 2. Profiles: shape parameters that the data do not see are held at their start, the flattest of each group of rows first, and the others
///    fitted again (unless [`SeparableSettings::hold_unseen`] is off).
/// 3. Robust losses: iteratively re-weighted from there.
/// 4. Gauss-Newton on all parameters together for the last digits, and the covariance of all of them.
///
/// Starts are clipped into the bounds. The result does not depend on the number of threads.
///
/// # Errors
/// [`SeparableError`] for problems that are not well formed or whose model is finite nowhere. Rank deficiency, iteration
/// limits and unseen parameters are statuses of the estimate.
///
/// Source: Golub & Pereyra 1973; Kaufman 1975.
pub fn fit(
    problem: &dyn SeparableProblem,
    settings: &SeparableSettings,
) -> Result<SeparableEstimate, SeparableError> {
    check(problem)?;
    let mut work = Work::new(problem, settings)?;
    let (report, mut status) = work.global()?;
    let mut findings = work.findings(None);
    let mut judged: Vec<Option<ShapeFinding>> = vec![None; findings.len()];
    loop {
        let flattest = if settings.hold_unseen { flattest(&findings, problem.groups()) } else { Vec::new() };
        if flattest.is_empty() {
            break;
        }
        for k in flattest {
            judged[k] = Some(findings[k].clone());
            work.held[k] = true;
            work.u[k] = work.bounds.start[k];
        }
        status = work.settle()?;
        // What was seen stays so where fewer parameters can make up for it.
        findings = work.findings(Some(&findings));
    }
    for (finding, earlier) in findings.iter_mut().zip(judged) {
        if let Some(earlier) = earlier {
            *finding = earlier;
        }
    }
    work.finish(report, status, findings)
}

/// The least seen of the shape parameters that are not seen, one of those that change rows of the same group: others cannot stand in for
/// each other.
fn flattest(findings: &[ShapeFinding], groups: &[RowGroup]) -> Vec<usize> {
    let range = |k: &usize| findings[*k].profile.iter().map(|p| p.1).fold(0.0, f64::max);
    let mut unseen: Vec<usize> =
        (0..findings.len()).filter(|k| findings[*k].verdict == ShapeVerdict::NotSeen).collect();
    unseen.sort_by(|a, b| range(a).total_cmp(&range(b)));
    let changes = |group: &RowGroup, k: usize| group.dependence.iter().any(|(_, p)| *p == k);
    let share_rows = |a: usize, b: usize| groups.iter().any(|g| changes(g, a) && changes(g, b));
    let mut out: Vec<usize> = Vec::new();
    for k in unseen {
        if !out.iter().any(|other| share_rows(*other, k)) {
            out.push(k);
        }
    }
    out
}

impl Work<'_> {
    fn stops(&self) -> Stops {
        Stops {
            iterations: self.settings.max_iterations,
            step: self.settings.step_tolerance,
            gradient: self.settings.gradient_tolerance,
            fall: 0.0,
            relative_fall: 0.0,
        }
    }

    /// Weighted rss below which nothing but rounding and the tolerance of steps is left.
    fn rounding(&self) -> f64 {
        let groups = self.problem.groups().iter().zip(&self.variances);
        let energy: f64 = groups.map(|(g, v)| g.effort.iter().map(|y| y * y).sum::<f64>() / v).sum();
        ROUNDING.powi(2) * energy
    }

    /// Best point of a search, in searched coordinates.
    fn searched(&self, search: &ShapeSearch) -> Result<Vec<f64>, SeparableError> {
        let parameters = self.problem.shape();
        let free: Vec<usize> = (0..parameters.len()).filter(|k| !self.held[*k]).collect();
        let side = |of: &dyn Fn(&ShapeParameter) -> f64| free.iter().map(|k| of(&parameters[*k])).collect();
        let logarithmic: Vec<usize> = (0..free.len()).filter(|i| parameters[free[*i]].logarithmic).collect();
        let bounds = Bounds::new(side(&|p| p.lower), side(&|p| p.upper))
            .and_then(|b| b.with_logarithmic(&logarithmic))
            .map_err(SearchError::from)?;
        let at = self.shape();
        let whole = |point: &[f64]| {
            let mut shape = at.clone();
            free.iter().zip(point).for_each(|(k, x)| shape[*k] = *x);
            shape
        };
        let projection = self.projection();
        let loss = |point: &[f64]| projection.at(&whole(point), Target::Effort).map_or(f64::NAN, |p| p.rss);
        let objective = PointObjective::new(free.len(), loss).in_parallel();
        let start = search.settings.start.clone().unwrap_or_else(|| free.iter().map(|k| at[*k]).collect());
        let settings = search::Settings { start: Some(start), ..search.settings.clone() };
        let found = search::run(&search.algorithm, &objective, &bounds, &settings, &mut |_| {
            ControlFlow::Continue(())
        })?;
        let shape = whole(&found.point);
        Ok((0..shape.len()).map(|k| self.bounds.searched(k, shape[k])).collect())
    }

    fn global(&mut self) -> Result<(StartReport, SearchStatus), SeparableError> {
        if self.bounds.len() > 0 {
            self.renew_variances(&[])?;
        }
        let starts = match &self.settings.search {
            Some(search) if self.held.contains(&false) => vec![self.searched(search)?],
            _ => starts(&self.bounds, self.settings.starts, self.settings.seed),
        };
        let (found, report) = multi_start(
            &self.projection(),
            &self.bounds,
            &starts,
            &self.held,
            Stops { relative_fall: START_FALL, ..self.stops() },
            self.rounding(),
        )
        .ok_or(SeparableError::NotFiniteAnywhere { starts: starts.len() })?;
        (self.u, self.linear) = (found.u, found.point.linear);
        let status = self.settle()?;
        Ok((report, status))
    }

    /// Parameters and variances in turn, from where they are, until both settle.
    fn settle(&mut self) -> Result<SearchStatus, SeparableError> {
        let (tolerance, passes) = match &self.settings.weighting {
            Weighting::Equal => (f64::INFINITY, 1),
            Weighting::Groups { wls, .. } => (wls.tolerance, wls.max_passes.max(1)),
        };
        let mut pass = 0;
        loop {
            let found = search(&self.projection(), &self.bounds, &self.u, &self.held, self.stops())
                .ok_or(SeparableError::NotFiniteAnywhere { starts: 1 })?;
            (self.u, self.linear) = (found.u, found.point.linear);
            pass += 1;
            let active = self.active();
            let change = self.renew_variances(&active)?;
            if change <= tolerance || pass >= passes {
                return Ok(found.status);
            }
        }
    }

    /// Variances of the linearised problem; returns the largest relative change.
    fn renew_variances(&mut self, active: &[usize]) -> Result<f64, SeparableError> {
        let shape = self.shape();
        if matches!(self.settings.weighting, Weighting::Equal)
            || self.projection().at(&shape, Target::Effort).is_none()
        {
            return Ok(0.0);
        }
        let groups: Vec<ReducedGroup> = self
            .linearisation
            .reduced(&self.linear, &shape, active)?
            .iter()
            .map(|g| g.coarsened(g.blocks.len().max(1)))
            .collect();
        let found = self.linear_estimate(&groups, active.len(), &self.variances)?;
        let mut change = 0.0_f64;
        for (old, new) in self.variances.iter_mut().zip(&found.groups) {
            change = change.max((new.variance - *old).abs() / new.variance);
            *old = new.variance;
        }
        Ok(change)
    }

    /// Findings of all shape parameters, of those alone that were not seen `before`.
    fn findings(&self, before: Option<&[ShapeFinding]>) -> Vec<ShapeFinding> {
        let linearised = self.linearised().ok();
        let inflation = linearised.as_ref().map_or(1.0, kappa);
        let projection = self.projection();
        let rss = projection.at(&self.shape(), Target::Residual(&self.linear)).map_or(0.0, |p| p.rss);
        let variance = match self.settings.weighting {
            Weighting::Groups { .. } => 1.0,
            Weighting::Equal => {
                let freedom = projection.rows() as f64 - (self.linear.len() + self.active().len()) as f64;
                rss / freedom.max(1.0)
            }
        };
        let minimum = Minimum {
            projection: &projection,
            bounds: &self.bounds,
            u: &self.u,
            rss,
            held: &self.held,
            variance: variance.max(self.rounding()).max(f64::MIN_POSITIVE),
            rise: self.settings.profile_rise * inflation,
            points: self.settings.profile_points,
        };
        minimum.findings(self.problem, before)
    }

    fn finish(
        mut self,
        starts: StartReport,
        status: SearchStatus,
        findings: Vec<ShapeFinding>,
    ) -> Result<SeparableEstimate, SeparableError> {
        let robust = match self.settings.loss {
            SeparableLoss::Squares => None,
            _ => Some(refine_robust(&mut self)?),
        };
        let row_weights = robust.as_ref().map(|r| r.root_weights.clone());
        if let Some(Robust { root_weights, .. }) = &robust {
            self.reductions = (self.problem.groups().par_iter())
                .zip(root_weights)
                .map(|(group, weights)| GroupReduction::new(group, Some(weights)))
                .collect();
        }
        let projection = self.projection();
        let polished = polish(&projection, &self.bounds, self.linear.clone(), self.shape(), &self.held)
            .ok_or(SeparableError::NotFiniteAnywhere { starts: 1 })?;
        let dependent = projection
            .at(&polished.shape, Target::Residual(&polished.linear))
            .map_or_else(Vec::new, |p| p.dependent);
        drop(projection);
        let active = self.active();
        self.linear.clone_from(&polished.linear);
        let linearised = match self.settings.loss {
            SeparableLoss::Absolute => None,
            SeparableLoss::Squares => {
                let groups = self.linearisation.reduced(&polished.linear, &polished.shape, &active)?;
                Some(self.linear_estimate(&groups, active.len(), &[])?)
            }
            SeparableLoss::Huber => {
                let total = polished.linear.len() + active.len();
                let rows = self.linearisation.rows(&polished.linear, &polished.shape, &active);
                let groups = self.linearisation.reduced(&polished.linear, &polished.shape, &active)?;
                let settings = self.linear_settings();
                Some(estimate(&groups, Some(&rows), total, &LinearMethod::Huber, &settings)?)
            }
        };
        let residuals = self.linearisation.residuals(&polished.linear, &polished.shape);
        let inflation = linearised.as_ref().map_or(1.0, kappa);
        Ok(SeparableEstimate {
            linear: polished.linear,
            shape: polished.shape,
            rss: polished.rss,
            variances: self.variances,
            residuals,
            row_weights,
            dependent,
            status,
            passes: robust.as_ref().map_or(0, |r| r.passes),
            settled: robust.as_ref().is_none_or(|r| r.settled),
            starts,
            findings,
            active,
            inflation,
            linearised,
        })
    }
}
