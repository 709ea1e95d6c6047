//! Robust losses: Levenberg-Marquardt inside iteratively re-weighted least squares.

use super::levenberg::{Stops, search};
use super::projection::Projection;
use super::reduction::GroupReduction;
use super::settings::{SeparableError, SeparableLoss, Weighting};
use super::work::Work;
use crate::linear::robust_scales;
use dynid_factor::groups::ReducedGroup;
use rayon::prelude::*;

/// Smoothing of `|r|` about zero in units of the scale: begun wide, so that no row sticks to a residual that was small by
/// chance, and divided by ten whenever the parameters have settled.
const FIRST_SMOOTHING: f64 = 0.1;
const LAST_SMOOTHING: f64 = 1e-8;
/// Tolerance of the inner searches.
const INNER_STEP: f64 = 1e-3;

/// Outcome of the re-weighting.
pub(super) struct Robust {
    /// `√ω` of every row.
    pub(super) root_weights: Vec<Vec<f64>>,
    pub(super) passes: usize,
    pub(super) settled: bool,
}

/// Moves the fit to the minimum of its robust loss; variances become squared scales.
pub(super) fn refine_robust(work: &mut Work<'_>) -> Result<Robust, SeparableError> {
    let settings = &work.settings.irls;
    let classes = classes(work);
    let floors = floors(work, &classes);
    let given = vec![None; classes.len()];
    let deviations = deviations(work)?;
    let absolute = work.settings.loss == SeparableLoss::Absolute;
    let mut smoothing = if absolute { FIRST_SMOOTHING } else { LAST_SMOOTHING };
    let levels = if absolute { 8 } else { 1 };
    let (mut scales, mut root_weights) = (Vec::new(), Vec::new());
    let (mut passes, mut settled) = (0, false);
    while passes < settings.max_passes.saturating_mul(levels) {
        let frozen = passes >= settings.scale_passes.max(1);
        let residuals = work.linearisation.residuals(&work.linear, &work.shape());
        if !frozen {
            scales = robust_scales(&residuals, &classes, &floors, &given);
            work.variances = scales.iter().map(|s| s * s).collect();
        }
        let weight = |r: f64, scale: f64| match work.settings.loss {
            SeparableLoss::Absolute => 1.0 / (r / scale).abs().max(smoothing),
            _ => (settings.huber / (r / scale).abs()).min(1.0),
        };
        root_weights = residuals
            .iter()
            .zip(&scales)
            .map(|(r, scale)| r.iter().map(|r| weight(*r, *scale).sqrt()).collect::<Vec<f64>>())
            .collect();
        let reductions: Vec<GroupReduction> = (work.problem.groups().par_iter())
            .zip(&root_weights)
            .map(|(group, weights)| GroupReduction::new(group, Some(weights)))
            .collect();
        let projection = Projection::new(work.problem, &reductions, work.weights());
        let stops = Stops {
            iterations: work.settings.max_iterations,
            step: INNER_STEP,
            gradient: work.settings.gradient_tolerance,
            fall: 0.0,
            relative_fall: 0.0,
        };
        let found = search(&projection, &work.bounds, &work.u, &work.held, stops)
            .ok_or(SeparableError::NotFiniteAnywhere { starts: 1 })?;
        let before: Vec<f64> = work.linear.iter().copied().chain(work.shape()).collect();
        (work.u, work.linear) = (found.u, found.point.linear);
        let now = work.linear.iter().copied().chain(work.shape());
        let moved = before.iter().zip(now).zip(&deviations).map(|((a, b), d)| (a - b).abs() / d);
        let moved = moved.filter(|m| m.is_finite()).fold(0.0, f64::max);
        passes += 1;
        if frozen && moved < settings.tolerance {
            if smoothing <= LAST_SMOOTHING {
                settled = true;
                break;
            }
            smoothing = (0.1 * smoothing).max(LAST_SMOOTHING);
        }
    }
    Ok(Robust { root_weights, passes, settled })
}

/// Standard deviations of the least-squares fit, the measure of how far parameters move; infinite where there is none.
fn deviations(work: &Work<'_>) -> Result<Vec<f64>, SeparableError> {
    let active = work.active();
    let fit = work.linearised()?;
    let covariance = fit.model_covariance();
    let mut found = vec![f64::INFINITY; work.linear.len() + work.u.len()];
    for (i, &column) in fit.solution.kept.iter().enumerate() {
        let place = match column.checked_sub(work.linear.len()) {
            Some(k) => work.linear.len() + active[k],
            None => column,
        };
        found[place] = covariance[(i, i)].sqrt();
    }
    Ok(found)
}

/// Per group, the first group it shares its scale with.
fn classes(work: &Work<'_>) -> Vec<usize> {
    let groups = work.problem.groups().iter().map(|g| ReducedGroup {
        log: g.log,
        output: g.output,
        scale: g.scale,
        columns: Vec::new(),
        blocks: Vec::new(),
    });
    let groups: Vec<ReducedGroup> = groups.collect();
    match &work.settings.weighting {
        Weighting::Equal => vec![0; groups.len()],
        Weighting::Groups { sharing, .. } => sharing.classes(&groups),
    }
}

/// Least scale of each group's class, a share of its rms effort.
fn floors(work: &Work<'_>, classes: &[usize]) -> Vec<f64> {
    let share = work.linear_settings().wls.floor;
    let groups = work.problem.groups();
    let floor = |class: usize| {
        let of_class =
            || groups.iter().zip(classes).filter(|(_, c)| **c == class).flat_map(|(g, _)| &g.effort);
        let energy: f64 = of_class().map(|y| y * y).sum();
        share * (energy / of_class().count().max(1) as f64).sqrt()
    };
    classes.iter().map(|c| floor(*c).max(f64::MIN_POSITIVE)).collect()
}
