//! One fit of a law to points in one or several parts.

use dynid_linalg::Mat;

use super::SteadySettings;
use super::form::LawForm;
use super::law::{Coefficient, CurveError, FrictionLaw, ShapeScale, build, motion};
use super::shared::{Part, Shared};
use dynid_estimate::linear::LinearEstimate;
use dynid_estimate::separable::{
    Deviations, EffortBlock, EffortProblem, SeparableError, SeparableEstimate, SeparableProblem,
    SeparableSettings, Weighting, fit,
};

/// Points as columns.
#[derive(Debug, Clone, Default)]
pub(super) struct Rows {
    pub(super) speed: Vec<f64>,
    pub(super) temperature: Vec<f64>,
    pub(super) friction: Vec<f64>,
    /// Standard errors, floor applied.
    pub(super) std: Vec<f64>,
}

impl Rows {
    pub(super) fn len(&self) -> usize {
        self.speed.len()
    }

    pub(super) fn pick(&self, indices: &[usize]) -> Rows {
        let of = |x: &[f64]| indices.iter().map(|k| x[*k]).collect();
        Rows {
            speed: of(&self.speed),
            temperature: of(&self.temperature),
            friction: of(&self.friction),
            std: of(&self.std),
        }
    }

    pub(super) fn scale(&self) -> ShapeScale {
        let speeds = || self.speed.iter().map(|v| v.abs()).filter(|v| *v > 0.0);
        let largest_speed = speeds().fold(0.0, f64::max);
        let least = speeds().fold(f64::INFINITY, f64::min);
        // Samples of a signal come arbitrarily near rest.
        ShapeScale { least_speed: least.max(1e-3 * largest_speed), largest_speed }
    }

    /// Range of temperatures.
    pub(super) fn range(&self) -> (f64, f64) {
        self.temperature.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), t| (a.min(*t), b.max(*t)))
    }
}

/// A fit of all parts.
pub(super) struct Solved {
    /// Law of every part.
    pub(super) laws: Vec<FrictionLaw>,
    /// Residuals of every part, N m or N.
    pub(super) residuals: Vec<Vec<f64>>,
    pub(super) chi_squared: f64,
    pub(super) rows: usize,
    /// Free coefficients of all parts together.
    pub(super) coefficients: usize,
    /// Place of every coefficient of every part in the covariance.
    places: Vec<Vec<usize>>,
    largest_friction: f64,
    /// Covariance of all coefficients; NaN where the points do not tell.
    covariance: Mat,
}

impl Solved {
    /// Covariance of one coefficient over the parts; `None` if one of them is not told.
    pub(super) fn covariance_of(&self, symbol: &str) -> Option<Mat> {
        let places: Vec<usize> = self
            .laws
            .iter()
            .zip(&self.places)
            .map(|(law, places)| law.coefficients.iter().position(|c| c.symbol == symbol).map(|k| places[k]))
            .collect::<Option<_>>()?;
        let n = places.len();
        let block = Mat::from_fn(n, n, |i, j| self.covariance[(places[i], places[j])]);
        (0..n).all(|i| block[(i, i)].is_finite()).then_some(block)
    }

    pub(super) fn error(&self) -> CurveError {
        let all = || self.residuals.iter().flatten();
        let largest = all().map(|r| r.abs()).fold(0.0, f64::max);
        CurveError {
            rms: (all().map(|r| r * r).sum::<f64>() / self.rows.max(1) as f64).sqrt(),
            largest: if self.largest_friction > 0.0 { largest / self.largest_friction } else { 0.0 },
            chi_squared: self.chi_squared,
            freedom: self.rows.saturating_sub(self.coefficients),
        }
    }
}

/// Fits one form to all parts; coefficients named in `shared` are the same in all of them.
///
/// `length`: rows of a block of time of a single part, for standard deviations by leaving out one block after the other. `None`: rows
/// are independent.
pub(super) fn solve(
    parts: &[Rows],
    form: &LawForm,
    shared: &[&str],
    length: Option<usize>,
    settings: &SteadySettings,
) -> Result<Solved, SeparableError> {
    let scale = parts.iter().map(Rows::scale).reduce(|a, b| ShapeScale {
        least_speed: a.least_speed.min(b.least_speed),
        largest_speed: a.largest_speed.max(b.largest_speed),
    });
    let Some(scale) = scale else { return Err(SeparableError::NoRows) };
    let range = parts
        .iter()
        .map(Rows::range)
        .fold((f64::INFINITY, f64::NEG_INFINITY), |a, b| (a.0.min(b.0), a.1.max(b.1)));
    let built = build(form, &scale, settings.reference_temperature, range);
    let (linear, shape) = (form.linear(), form.shape());
    let place = |symbols: &[&str], next: &mut usize, first: &mut Vec<Option<usize>>| -> Vec<usize> {
        let mut out = Vec::new();
        for (k, symbol) in symbols.iter().enumerate() {
            let known = first[k].filter(|_| shared.contains(symbol));
            let at = known.unwrap_or(*next);
            *next += usize::from(known.is_none());
            first[k] = Some(at);
            out.push(at);
        }
        out
    };
    let (mut linear_count, mut shape_count) = (0, 0);
    let (mut first_linear, mut first_shape) = (vec![None; linear.len()], vec![None; shape.len()]);
    let zeros: Vec<Vec<f64>> = parts.iter().map(|p| vec![0.0; p.len()]).collect();
    let channels: Vec<[(&str, &[f64]); 1]> =
        parts.iter().map(|p| [(built.channel.as_str(), p.temperature.as_slice())]).collect();
    let mut problems = Vec::with_capacity(parts.len());
    for ((rows, zeros), channels) in parts.iter().zip(&zeros).zip(&channels) {
        let block =
            EffortBlock { log: 0, motion: motion(&rows.speed, zeros, channels), effort: &rows.friction };
        problems.push(Part {
            problem: EffortProblem::new(&built.model, &built.kept, &[block])?,
            weights: rows.std.iter().map(|s| 1.0 / s).collect(),
            block: length.unwrap_or(rows.len()),
            linear: place(&linear, &mut linear_count, &mut first_linear),
            shape: place(&shape, &mut shape_count, &mut first_shape),
        });
    }
    let places: Vec<(Vec<usize>, Vec<usize>)> =
        problems.iter().map(|p| (p.linear.clone(), p.shape.clone())).collect();
    let mut parameters = vec![None; shape_count];
    for part in &problems {
        for (k, at) in part.shape.iter().enumerate() {
            parameters[*at] = Some(part.problem.shape()[k].clone());
        }
    }
    let problem = Shared::new(problems, linear_count, parameters.into_iter().flatten().collect());
    let found = fit(
        &problem,
        &SeparableSettings {
            weighting: Weighting::Equal,
            starts: settings.starts,
            profile_points: 0,
            hold_unseen: false,
            ..SeparableSettings::default()
        },
    )?;
    let covariance = match length {
        Some(_) => jackknifed(&found),
        None => covariance(&found),
    };
    Ok(solved(parts, form, settings, (&found, covariance), &places, (linear_count, range)))
}

fn solved(
    parts: &[Rows],
    form: &LawForm,
    settings: &SteadySettings,
    (found, mut covariance): (&SeparableEstimate, Mat),
    places: &[(Vec<usize>, Vec<usize>)],
    (linear_count, range): (usize, (f64, f64)),
) -> Solved {
    let chi_squared: f64 = found.residuals.iter().flatten().map(|r| r * r).sum();
    let rows: usize = parts.iter().map(Rows::len).sum();
    let coefficients = linear_count + found.shape.len();
    // Points that state their errors are not better than these because most of them fit better: where friction is large, the few
    // that decide need not.
    let freedom = rows.saturating_sub(coefficients) as f64;
    if !settings.series && chi_squared > 0.0 && chi_squared < freedom {
        covariance *= freedom / chi_squared;
    }
    let std = |at: usize| Some(covariance[(at, at)].sqrt()).filter(|s| s.is_finite());
    let symbols: Vec<&'static str> = form.linear().into_iter().chain(form.shape()).collect();
    let places: Vec<Vec<usize>> = places
        .iter()
        .map(|(linear, shape)| linear.iter().copied().chain(shape.iter().map(|k| linear_count + k)).collect())
        .collect();
    let value = |at: usize| if at < linear_count { found.linear[at] } else { found.shape[at - linear_count] };
    let laws = places
        .iter()
        .map(|places| FrictionLaw {
            form: *form,
            coefficients: symbols
                .iter()
                .zip(places)
                .map(|(symbol, at)| Coefficient { symbol, value: value(*at), std: std(*at) })
                .collect(),
            reference_temperature: settings.reference_temperature,
            temperature_range: range,
        })
        .collect();
    let residuals: Vec<Vec<f64>> = found
        .residuals
        .iter()
        .zip(parts)
        .map(|(r, rows)| r.iter().zip(&rows.std).map(|(r, s)| r * s).collect())
        .collect();
    Solved {
        laws,
        residuals,
        chi_squared,
        rows,
        coefficients,
        places,
        largest_friction: parts.iter().flat_map(|p| &p.friction).fold(0.0, |m, f| m.max(f.abs())),
        covariance,
    }
}

/// Covariance of linear and shape parameters for independent rows, NaN where there is none.
fn covariance(found: &SeparableEstimate) -> Mat {
    match (&found.linearised, found.standard_deviations()) {
        (Some(fit), Some(deviations)) => placed(found, fit, &fit.model_covariance(), deviations),
        _ => nothing(found),
    }
}

/// Covariance from the delete-a-block jackknife.
fn jackknifed(found: &SeparableEstimate) -> Mat {
    let jackknife = found.linearised.as_ref().and_then(LinearEstimate::jackknife);
    match (&found.linearised, jackknife, found.jackknife_deviations()) {
        (Some(fit), Some(jackknife), Some(deviations)) => {
            placed(found, fit, &jackknife.covariance, deviations)
        }
        _ => nothing(found),
    }
}

fn nothing(found: &SeparableEstimate) -> Mat {
    let n = found.linear.len() + found.shape.len();
    Mat::from_fn(n, n, |_, _| f64::NAN)
}

/// A covariance of kept columns, scaled to standard deviations, in the places of all parameters.
fn placed(found: &SeparableEstimate, fit: &LinearEstimate, unit: &Mat, deviations: Deviations) -> Mat {
    let linear = found.linear.len();
    let mut all = nothing(found);
    let std: Vec<Option<f64>> = deviations.linear.into_iter().chain(deviations.shape).collect();
    let place = |column: usize| if column < linear { column } else { linear + found.active[column - linear] };
    let kept: Vec<usize> = fit.solution.kept.iter().map(|c| place(*c)).collect();
    for (i, &a) in kept.iter().enumerate() {
        for (j, &b) in kept.iter().enumerate() {
            if let (Some(sa), Some(sb)) = (std[a], std[b]) {
                all[(a, b)] = sa * sb * unit[(i, j)] / (unit[(i, i)] * unit[(j, j)]).sqrt();
            }
        }
    }
    all
}
