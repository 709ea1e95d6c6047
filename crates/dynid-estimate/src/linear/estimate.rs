//! Every linear estimator through one call.

use super::irls::{Irls, Loss, Start, irls};
use super::linear_estimate::{GroupFit, LinearEstimate};
use super::method::{LinearError, LinearMethod, LinearSettings};
use super::own::{OwnEstimator, OwnFit};
use crate::least_squares::{ColumnErrors, TlsNoise, tls_groups};
use crate::least_squares::{LinearSolution, ols};
use crate::least_squares::{PriorRows, WlsEstimate, floors, wls_with};
use dynid_factor::factor::Factor;
use dynid_factor::groups::{ReducedGroup, time_blocks};
use dynid_factor::rows::{MemoryRows, RowSource};

/// Estimates the parameters of all `total` columns.
///
/// `groups`: factors of all groups and time blocks, from [`reduce_rows`](dynid_factor::rows::reduce_rows); `rows`: the same
/// groups' rows, needed by robust losses only ([`LinearMethod::needs_rows`]) and kept in memory where [`super::IrlsSettings::memory`] allows.
///
/// Rank deficiency and the iteration limit are statuses of the estimate.
///
/// # Errors
/// [`LinearError`]: no groups, a method whose entries do not fit the columns, missing or unusable rows, instruments asked
/// for, or no unique total least-squares solution.
pub fn estimate(
    groups: &[ReducedGroup],
    rows: Option<&dyn RowSource>,
    total: usize,
    method: &LinearMethod,
    settings: &LinearSettings,
) -> Result<LinearEstimate, LinearError> {
    if groups.is_empty() {
        return Err(LinearError::NoGroups);
    }
    method.check(total)?;
    let factors: Vec<Factor> = groups.iter().map(|g| g.merged(total)).collect();
    let classes = match method {
        LinearMethod::Ols | LinearMethod::Tls(_) => vec![0; groups.len()],
        _ => settings.sharing.classes(groups),
    };
    let prior = match method {
        LinearMethod::Ridge { prior, scale, kappa } => {
            Some(PriorRows { weights: scale.iter().map(|s| kappa.sqrt() / s).collect(), x0: prior.clone() })
        }
        _ => None,
    };
    let start = wls_with(&factors, &classes, prior.as_ref(), &settings.wls);
    match method {
        LinearMethod::Ols | LinearMethod::Wls | LinearMethod::Ridge { .. } => {
            let prior = prior.map(|p| Factor::empty(total).with_prior_rows(&p.weights, &p.x0));
            Ok(squared(groups, total, method, start, prior))
        }
        LinearMethod::Tls(noise) => total_least_squares(groups, &factors, total, noise, start, settings),
        LinearMethod::Own(own) => by_own(own, groups, total, start),
        LinearMethod::Instrumental | LinearMethod::Didim | LinearMethod::Cloe => {
            Err(LinearError::NeedsSimulation)
        }
        LinearMethod::Huber | LinearMethod::Tukey => {
            let source = rows.ok_or(LinearError::NeedsRows)?;
            check_rows(groups, source)?;
            let memory = MemoryRows::collect(source, settings.irls.memory)?;
            let source = memory.as_ref().map_or(source, |m| m as &dyn RowSource);
            robust(groups, &factors, source, total, method, settings, &classes, start)
        }
    }
}

fn check_rows(groups: &[ReducedGroup], source: &dyn RowSource) -> Result<(), LinearError> {
    let shapes = source.groups();
    let same = shapes.len() == groups.len()
        && shapes.iter().zip(groups).all(|(s, g)| {
            (s.log, s.output, s.scale, &s.columns, s.blocks)
                == (g.log, g.output, g.scale, &g.columns, g.blocks.len())
        });
    if same { Ok(()) } else { Err(LinearError::OtherRows { expected: groups.len(), found: shapes.len() }) }
}

/// Least squares of a group of rows whose residuals are known to have a variance of one, such as those that a mixed model whitened.
///
/// `total`: columns of the problem. The weight is one, and `C = (RᵀR)⁻¹`. Rank deficiency is a status of the estimate.
pub fn of_unit_variance(group: ReducedGroup, total: usize) -> LinearEstimate {
    let factor = group.merged(total);
    let solution = ols(&factor);
    let fit = GroupFit {
        log: group.log,
        output: group.output,
        scale: group.scale,
        variance: 1.0,
        weight: 1.0,
        leverage: solution.kept.len() as f64,
        rss: factor.rss(&solution.x),
        rows: factor.rows(),
        at_floor: false,
        down_weighted: 0.0,
        rejected: 0.0,
        curvature: 1.0,
    };
    assemble(LinearMethod::Wls, solution.x, &solution.kept, vec![fit], vec![group])
}

fn group_fits(groups: &[ReducedGroup], start: &WlsEstimate) -> Vec<GroupFit> {
    let of = |(group, found): (&ReducedGroup, &super::GroupVariance)| GroupFit {
        log: group.log,
        output: group.output,
        scale: group.scale,
        variance: found.variance,
        weight: 1.0 / found.variance.sqrt(),
        leverage: found.leverage,
        rss: found.rss,
        rows: found.rows,
        at_floor: found.at_floor,
        down_weighted: 0.0,
        rejected: 0.0,
        curvature: 1.0,
    };
    groups.iter().zip(&start.groups).map(of).collect()
}

fn squared(
    groups: &[ReducedGroup],
    total: usize,
    method: &LinearMethod,
    start: WlsEstimate,
    prior: Option<Factor>,
) -> LinearEstimate {
    let fits = group_fits(groups, &start);
    let weights: Vec<f64> = fits.iter().map(|g| g.weight).collect();
    LinearEstimate {
        method: method.clone(),
        x: start.solution.x.clone(),
        solution: start.solution,
        groups: fits,
        reduced: groups.to_vec(),
        factor: start.factor,
        blocks: time_blocks(groups, &weights, total),
        passes: start.passes,
        converged: start.converged,
        losses: Vec::new(),
        prior,
        loss: None,
        given_blocks: Vec::new(),
        parts: Vec::new(),
        paired: Vec::new(),
    }
}

/// The estimate of all groups; `start`: weighted least squares, for the leverages.
fn by_own(
    own: &OwnEstimator,
    groups: &[ReducedGroup],
    total: usize,
    start: WlsEstimate,
) -> Result<LinearEstimate, LinearError> {
    let OwnFit { mut x, variances } =
        own.fit(groups, total).ok_or_else(|| LinearError::NoOwnFit { name: own.name().to_owned() })?;
    check_own("parameters of an own estimator", &x, total, "finite numbers", f64::is_finite)?;
    let positive = |v: f64| v.is_finite() && v > 0.0;
    check_own("variances of an own estimator", &variances, groups.len(), "positive numbers", positive)?;
    let weights: Vec<f64> = variances.iter().map(|v| 1.0 / v.sqrt()).collect();
    let blocks = time_blocks(groups, &weights, total);
    let weighted = match blocks.is_empty() {
        true => Factor::empty(total),
        false => Factor::merge(&blocks.iter().collect::<Vec<_>>()),
    };
    let rank = ols(&weighted);
    rank.dropped.iter().for_each(|c| x[*c] = 0.0);
    let factor = weighted.around(&x);
    let mut solution = ols(&factor);
    solution.x.clone_from(&x);
    let fits = groups.iter().zip(&start.groups).zip(variances.iter().zip(&weights));
    let fits = fits.map(|((group, of_start), (variance, weight))| GroupFit {
        log: group.log,
        output: group.output,
        scale: group.scale,
        variance: *variance,
        weight: *weight,
        leverage: of_start.leverage,
        rss: group.merged(total).rss(&x),
        rows: of_start.rows,
        at_floor: false,
        down_weighted: 0.0,
        rejected: 0.0,
        curvature: 1.0,
    });
    Ok(LinearEstimate {
        method: LinearMethod::Own(own.clone()),
        groups: fits.collect(),
        x,
        solution,
        reduced: groups.to_vec(),
        factor,
        blocks,
        passes: 1,
        converged: true,
        losses: Vec::new(),
        prior: None,
        loss: None,
        given_blocks: Vec::new(),
        parts: Vec::new(),
        paired: Vec::new(),
    })
}

fn check_own(
    name: &'static str,
    values: &[f64],
    count: usize,
    expected: &'static str,
    fits: impl Fn(f64) -> bool,
) -> Result<(), LinearError> {
    if values.len() != count {
        return Err(LinearError::Length { name, expected: count, found: values.len() });
    }
    match values.iter().find(|v| !fits(**v)) {
        Some(&found) => Err(LinearError::Setting { name, expected, found }),
        None => Ok(()),
    }
}

fn total_least_squares(
    groups: &[ReducedGroup],
    factors: &[Factor],
    total: usize,
    noise: &TlsNoise,
    start: WlsEstimate,
    settings: &LinearSettings,
) -> Result<LinearEstimate, LinearError> {
    let mut fits = group_fits(groups, &start);
    let found = tls_groups(groups, factors, total, noise, settings.irls.max_passes)?;
    let errors = |group: &ReducedGroup| ColumnErrors::new(noise, group, &found.x);
    let sum: f64 = groups.iter().zip(factors).map(|(g, f)| f.rss(&found.x) / errors(g).d).sum();
    let freedom = factors.iter().map(Factor::rows).sum::<usize>() as f64 - found.kept.len() as f64;
    let variance = if freedom >= 1.0 { sum / freedom } else { 0.0 };
    let variance = variance.max(floors(factors, &vec![0; factors.len()], settings.wls.floor)[0]);
    for ((fit, group), factor) in fits.iter_mut().zip(groups).zip(factors) {
        fit.variance = variance * errors(group).d;
        (fit.weight, fit.rss) = (1.0 / fit.variance.sqrt(), factor.rss(&found.x));
    }
    let reduced = groups.iter().map(|g| errors(g).removed(g)).collect();
    let method = LinearMethod::Tls(noise.clone());
    let mut estimate = assemble(method, found.x, &found.kept, fits, reduced);
    (estimate.passes, estimate.converged) = (found.passes, found.converged);
    if found.alike {
        estimate.given_blocks = time_blocks(groups, &vec![1.0; groups.len()], total);
    }
    Ok(estimate)
}

#[expect(clippy::too_many_arguments, reason = "one call site; the arguments are the whole problem")]
fn robust(
    groups: &[ReducedGroup],
    factors: &[Factor],
    source: &dyn RowSource,
    total: usize,
    method: &LinearMethod,
    settings: &LinearSettings,
    classes: &[usize],
    start: WlsEstimate,
) -> Result<LinearEstimate, LinearError> {
    let mut fits = group_fits(groups, &start);
    let given: Vec<Option<f64>> = fits
        .iter()
        .map(|f| (f.at_floor || (f.rows as f64) < 2.0 * f.leverage).then(|| f.variance.sqrt()))
        .collect();
    let floors: Vec<f64> = floors(factors, classes, settings.wls.floor).iter().map(|v| v.sqrt()).collect();
    let begin = |x: Vec<f64>| Start {
        x,
        kept: start.solution.kept.clone(),
        classes,
        floors: floors.clone(),
        given: given.clone(),
        total,
    };
    let mut loss = Loss::Huber(settings.irls.huber);
    let huber = irls(source, loss, begin(start.solution.x.clone()), &settings.irls)?;
    let found = match method {
        LinearMethod::Tukey => {
            loss = Loss::Tukey(settings.irls.tukey);
            let after = irls(source, loss, begin(huber.x), &settings.irls)?;
            Irls { converged: after.converged && huber.converged, ..after }
        }
        _ => huber,
    };
    let Irls { x, kept, groups: weighted, scales, tallies, passes, converged, losses } = found;
    for (k, fit) in fits.iter_mut().enumerate() {
        let tally = &tallies[k];
        fit.variance = scales[k] * scales[k];
        fit.curvature = tally.curvature();
        fit.weight = fit.curvature.sqrt() / scales[k];
        fit.rss = factors[k].rss(&x);
        (fit.down_weighted, fit.rejected) = (tally.down_weighted(), tally.rejected());
    }
    // The score ψ stays, the curvature becomes that of the loss: weight √c, residual over c.
    let bent: Vec<ReducedGroup> = weighted
        .iter()
        .zip(&fits)
        .map(|(group, fit)| {
            let own: Vec<f64> = group.columns.iter().map(|&c| x[c]).collect();
            let blocks =
                group.blocks.iter().map(|b| b.with_residual_scaled(&own, 1.0 / fit.curvature)).collect();
            ReducedGroup { columns: group.columns.clone(), blocks, ..*group }
        })
        .collect();
    let estimate = assemble(method.clone(), x, &kept, fits, bent);
    Ok(LinearEstimate { passes, converged, losses, loss: Some(loss), ..estimate })
}

/// Estimate from rows whose least-squares solution on the kept columns is `x`.
pub(crate) fn assemble(
    method: LinearMethod,
    x: Vec<f64>,
    kept: &[usize],
    groups: Vec<GroupFit>,
    reduced: Vec<ReducedGroup>,
) -> LinearEstimate {
    let total = x.len();
    let weights: Vec<f64> = groups.iter().map(|g| g.weight).collect();
    let blocks = time_blocks(&reduced, &weights, total);
    let factor = match blocks.is_empty() {
        true => Factor::empty(total),
        false => Factor::merge(&blocks.iter().collect::<Vec<_>>()),
    };
    let mut solution = ols(&factor);
    if solution.kept != kept {
        let restricted = ols(&factor.select(kept));
        let names = |of: &[usize]| of.iter().map(|&k| kept[k]).collect::<Vec<_>>();
        solution = LinearSolution {
            x: x.clone(),
            kept: names(&restricted.kept),
            dropped: (0..total).filter(|c| !names(&restricted.kept).contains(c)).collect(),
            ..restricted
        };
    }
    solution.x.clone_from(&x);
    LinearEstimate {
        method,
        x,
        solution,
        groups,
        reduced,
        factor,
        blocks,
        passes: 1,
        converged: true,
        losses: Vec::new(),
        prior: None,
        loss: None,
        given_blocks: Vec::new(),
        parts: Vec::new(),
        paired: Vec::new(),
    }
}
