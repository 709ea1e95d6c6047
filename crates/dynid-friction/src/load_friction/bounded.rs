//! Bounded least squares over all parameters at once.

use super::error::{LoadFrictionError, same_size};
use super::law::{FrictionParameter, check_theta};
use super::problem::Problem;
use dynid_estimate::separable::{
    Bound, RowGroup, SearchStatus, SeparableError, SeparableProblem, SeparableSettings, ShapedColumns,
    StartOutcome, Weighting, fit,
};
use dynid_model::ShapeParameter;
use dynid_search::Bounds;

/// Share of the sum of squared efforts below which differences of `J` are rounding.
const ROUNDING: f64 = 1e-18;

/// Settings of [`fit_bounded`] and [`super::fit_separated`].
#[derive(Debug, Clone, PartialEq)]
pub struct FitSettings {
    /// Starts: the given one, the centre of the box, its lowest and highest corner, Sobol points; parameters without two
    /// finite bounds stay at the given start. Default 1, the given one alone.
    pub starts: usize,
    /// Further starts of the Stribeck speed, as shares of the largest speed of the record; each with all of the others.
    /// The misfit often has several minima along it, and its bound is mostly infinite. Default 0.02, 0.1 and 0.4.
    pub stribeck_starts: Vec<f64>,
    /// Seed of the Sobol points. Default 0.
    pub seed: u64,
    /// Most iterations from one start. Default 300.
    pub max_iterations: usize,
    /// Most rounds of [`super::fit_separated`]. Default 20.
    pub max_rounds: usize,
}

impl Default for FitSettings {
    fn default() -> Self {
        FitSettings {
            starts: 1,
            stribeck_starts: vec![0.02, 0.1, 0.4],
            seed: 0,
            max_iterations: 300,
            max_rounds: 20,
        }
    }
}

/// Minimum of `J(θ)` within bounds.
#[derive(Debug, Clone, PartialEq)]
pub struct BoundedFit {
    /// `θ`, inside the bounds to the last bit. Parameters without effect are at their start.
    pub theta: Vec<f64>,
    /// `J(θ)`, effort².
    pub sum_of_squares: f64,
    /// `√(J/rows)`.
    pub rms: f64,
    /// Bound at which each parameter lies, if it does.
    pub at_bound: Vec<Option<Bound>>,
    /// How the search from the best start ended.
    pub status: SearchStatus,
    /// What every start reached, and in how many iterations.
    pub starts: Vec<StartOutcome>,
    /// Starts that reach the least `J` within 1e-6, relative.
    pub reached: usize,
}

/// Minimises `J(θ)` with `lower <= θ <= upper` by Levenberg-Marquardt with exact derivatives
/// ([`dynid_estimate::separable`] without linear parameters). A start outside is brought inside. Directions that the data do
/// not see stay as the path of damped steps leaves them: see [`super::nearest_to_design`].
///
/// # Errors
/// Sizes that differ, a start that is not finite, bounds that [`dynid_estimate::separable::fit`] refuses, a model that is finite
/// at no start. How the search ended is a status.
pub fn fit_bounded(
    problem: &Problem,
    bounds: &Bounds,
    start: &[f64],
    settings: &FitSettings,
) -> Result<BoundedFit, LoadFrictionError> {
    let start = clipped(problem, bounds, start)?;
    let mut outcomes = Vec::new();
    let mut best: Option<(f64, Vec<f64>, SearchStatus)> = None;
    for start in stribeck_starts(problem, bounds, &start, settings) {
        let found = fit(&All::new(problem, bounds, &start), &separable_settings(settings))?;
        outcomes.extend(found.starts.outcomes);
        let value = problem.sum_of_squares(&found.shape)?;
        if best.as_ref().is_none_or(|b| value < b.0) {
            best = Some((value, found.shape, found.status));
        }
    }
    let (sum_of_squares, theta, status) = best.ok_or(SeparableError::NotFiniteAnywhere { starts: 0 })?;
    let noise = ROUNDING * problem.efforts().iter().map(|y| y * y).sum::<f64>();
    let same = |rss: f64| rss - sum_of_squares <= 1e-6 * sum_of_squares + noise;
    Ok(BoundedFit {
        at_bound: bounds_reached(problem, bounds, &theta),
        rms: (sum_of_squares / problem.rows() as f64).sqrt(),
        sum_of_squares,
        theta,
        status,
        reached: outcomes.iter().filter(|o| o.rss.is_some_and(same)).count(),
        starts: outcomes,
    })
}

/// The start as given, then with other Stribeck speeds inside the bounds.
pub(super) fn stribeck_starts(
    problem: &Problem,
    bounds: &Bounds,
    start: &[f64],
    settings: &FitSettings,
) -> Vec<Vec<f64>> {
    let mut all = vec![start.to_vec()];
    let k = FrictionParameter::StribeckSpeed.index(problem.inertial());
    if acts(problem, k) {
        let speeds = problem.drives.iter().flat_map(|d| &d.speed);
        let largest = speeds.fold(0.0_f64, |most, v| most.max(v.abs()));
        for share in &settings.stribeck_starts {
            let mut start = start.to_vec();
            start[k] = (share * largest).max(bounds.lower()[k]).min(bounds.upper()[k]);
            all.push(start);
        }
    }
    all
}

pub(super) fn separable_settings(settings: &FitSettings) -> SeparableSettings {
    SeparableSettings {
        weighting: Weighting::Equal,
        starts: settings.starts,
        seed: settings.seed,
        max_iterations: settings.max_iterations,
        profile_points: 0,
        hold_unseen: false,
        ..SeparableSettings::default()
    }
}

/// The start inside the bounds, checked.
pub(super) fn clipped(
    problem: &Problem,
    bounds: &Bounds,
    start: &[f64],
) -> Result<Vec<f64>, LoadFrictionError> {
    same_size("bounds", problem.parameters(), bounds.dimensions())?;
    same_size("start values", problem.parameters(), start.len())?;
    let inside = |(k, x): (usize, &f64)| x.max(bounds.lower()[k]).min(bounds.upper()[k]);
    let start: Vec<f64> = start.iter().enumerate().map(inside).collect();
    check_theta(problem.settings.model, problem.inertial(), &start)?;
    Ok(start)
}

/// Bounds at which parameters that act lie.
pub(super) fn bounds_reached(problem: &Problem, bounds: &Bounds, theta: &[f64]) -> Vec<Option<Bound>> {
    let at = |(k, x): (usize, &f64)| match () {
        () if !acts(problem, k) => None,
        () if *x <= bounds.lower()[k] => Some(Bound::Lower),
        () if *x >= bounds.upper()[k] => Some(Bound::Upper),
        () => None,
    };
    theta.iter().enumerate().map(at).collect()
}

/// Whether efforts depend on a parameter, by the law.
pub(super) fn acts(problem: &Problem, parameter: usize) -> bool {
    match parameter.checked_sub(problem.inertial()) {
        Some(friction) => FrictionParameter::ALL[friction].acts_in(problem.settings.model),
        None => true,
    }
}

/// Efforts as one known column that depends on everything.
struct All<'a> {
    problem: &'a Problem,
    shape: Vec<ShapeParameter>,
    groups: Vec<RowGroup>,
}

impl<'a> All<'a> {
    fn new(problem: &'a Problem, bounds: &Bounds, start: &[f64]) -> Self {
        let shape = (0..problem.parameters())
            .map(|k| {
                let held = !acts(problem, k);
                ShapeParameter {
                    name: name(problem, k),
                    unit: "",
                    start: start[k],
                    lower: if held { start[k] } else { bounds.lower()[k] },
                    upper: if held { start[k] } else { bounds.upper()[k] },
                    logarithmic: bounds.is_logarithmic(k),
                }
            })
            .collect();
        let group = |(output, rows): (usize, &super::problem::UsedRows)| RowGroup {
            output,
            block_rows: vec![rows.rows()],
            effort: rows.effort.clone(),
            shaped: vec![None],
            dependence: (0..problem.parameters()).map(|k| (0, k)).collect(),
            ..RowGroup::default()
        };
        All { problem, shape, groups: problem.drives.iter().enumerate().map(group).collect() }
    }
}

pub(super) fn name(problem: &Problem, parameter: usize) -> String {
    match parameter.checked_sub(problem.inertial()) {
        Some(friction) => FrictionParameter::ALL[friction].name().to_owned(),
        None => format!("inertial parameter {parameter}"),
    }
}

impl SeparableProblem for All<'_> {
    fn linear(&self) -> usize {
        0
    }

    fn shape(&self) -> &[ShapeParameter] {
        &self.shape
    }

    fn groups(&self) -> &[RowGroup] {
        &self.groups
    }

    fn shaped(&self, shape: &[f64], out: &mut [ShapedColumns]) {
        for (j, columns) in out.iter_mut().enumerate() {
            columns.value_mut(0).copy_from_slice(&self.problem.used_effort(j, shape));
            let flat = self.problem.used_jacobian(j, shape);
            for k in 0..shape.len() {
                let of = self.problem.drives[j].column(&flat, k);
                columns.derivative_mut(k).copy_from_slice(of);
            }
        }
    }
}
