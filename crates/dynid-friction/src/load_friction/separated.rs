//! Everything but `μ_c, μ_s, v_s` by linear least squares, the signs of the reactions in rounds.

use super::bounded::{FitSettings, clipped, separable_settings, stribeck_starts};
use super::error::LoadFrictionError;
use super::law::{FrictionParameter, Model, decay};
use super::problem::{Problem, add_product, sign};
use dynid_estimate::separable::{
    RowGroup, SearchStatus, SeparableError, SeparableEstimate, SeparableProblem, ShapedColumns, fit,
};
use dynid_model::ShapeParameter;
use dynid_search::Bounds;

/// Of two starts, the first counts where they agree to this share of `J`.
const SAME: f64 = 1e-9;

/// How the rounds of [`fit_separated`] ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SignStatus {
    /// The signs of all reactions are those of the solution.
    Settled,
    /// The signs of a solution are those of an earlier round: there is no solution with its own signs on this path, mostly
    /// since some reactions are zero at the minimum.
    Cycling {
        /// Rounds until the signs come back.
        period: usize,
        /// Samples of reactions whose sign differs between the last two rounds.
        differing: usize,
    },
    /// The limit of rounds is reached; so many signs still differ.
    RoundLimit {
        /// Samples of reactions whose sign differs.
        differing: usize,
    },
}

/// Minimum of `J(θ)` with inertial parameters and `f_v` free of bounds.
#[derive(Debug, Clone, PartialEq)]
pub struct SeparatedFit {
    /// `θ`. Inertial parameters that others make up are zero: a basic solution, to be moved along the free directions
    /// by [`super::nearest_to_design`]. Efforts and reactions do not depend on that choice.
    pub theta: Vec<f64>,
    /// `J(θ)`, effort².
    pub sum_of_squares: f64,
    /// `√(J/rows)`.
    pub rms: f64,
    /// Inertial parameters (or `f_v`, index p) that others make up or no row sees, ascending.
    pub dependent: Vec<usize>,
    /// Rounds made.
    pub rounds: usize,
    /// How the rounds ended. Unless they settled, `theta` is that of the round with the least `J`, which need not be the minimum.
    pub signs: SignStatus,
    /// How the search of that round ended.
    pub status: SearchStatus,
}

/// Minimises `J(θ)` by separable least squares: with the signs of the reactions given, efforts are linear in `(φ, f_v)` for
/// given `(μ_c, μ_s, v_s)`, which alone are searched, within their bounds. Signs are those at the start, then those of the
/// solution, until they agree, come back to those of an earlier round, or [`FitSettings::max_rounds`] is reached; which of
/// these is [`SeparatedFit::signs`], never an error.
///
/// Bounds of `φ` and `f_v` are not used. The start's inertial parameters decide the first signs only.
///
/// # Errors
/// Fails as [`super::fit_bounded`] does.
pub fn fit_separated(
    problem: &Problem,
    bounds: &Bounds,
    start: &[f64],
    settings: &FitSettings,
) -> Result<SeparatedFit, LoadFrictionError> {
    let start = clipped(problem, bounds, start)?;
    let mut best: Option<SeparatedFit> = None;
    for start in stribeck_starts(problem, bounds, &start, settings) {
        let found = rounds(problem, bounds, &start, settings)?;
        if best.as_ref().is_none_or(|b| found.sum_of_squares < b.sum_of_squares * (1.0 - SAME)) {
            best = Some(found);
        }
    }
    best.ok_or(LoadFrictionError::Fit(SeparableError::NotFiniteAnywhere { starts: 0 }))
}

fn rounds(
    problem: &Problem,
    bounds: &Bounds,
    start: &[f64],
    settings: &FitSettings,
) -> Result<SeparatedFit, LoadFrictionError> {
    let p = problem.inertial();
    let mut theta = start.to_vec();
    let mut tried = vec![signs_at(problem, &theta[..p])];
    let limit = settings.max_rounds.max(1);
    let mut best: Option<SeparatedFit> = None;
    loop {
        let rounds = tried.len();
        let signs = &tried[rounds - 1];
        let signed = Signed::new(problem, bounds, &theta, signs);
        let found = fit(&signed, &separable_settings(settings))?;
        signed.put(&found, &mut theta);
        let next = signs_at(problem, &theta[..p]);
        let differing = signs.iter().zip(&next).filter(|(a, b)| a != b).count();
        let ended = match tried.iter().rposition(|earlier| *earlier == next) {
            Some(at) if at + 1 == rounds => Some(SignStatus::Settled),
            Some(at) => Some(SignStatus::Cycling { period: rounds - at, differing }),
            None if rounds == limit => Some(SignStatus::RoundLimit { differing }),
            None => None,
        };
        let sum_of_squares = problem.sum_of_squares(&theta)?;
        let this = SeparatedFit {
            theta: theta.clone(),
            rms: (sum_of_squares / problem.rows() as f64).sqrt(),
            sum_of_squares,
            dependent: found.dependent,
            rounds,
            signs: SignStatus::Settled,
            status: found.status,
        };
        let settled = ended == Some(SignStatus::Settled);
        let kept = match best.take() {
            Some(earlier) if !settled && earlier.sum_of_squares <= sum_of_squares => earlier,
            _ => this,
        };
        if let Some(signs) = ended {
            return Ok(SeparatedFit { rounds, signs, ..kept });
        }
        best = Some(kept);
        tried.push(next);
    }
}

/// Signs of all reactions that the law uses, in the order of [`Signed::new`].
fn signs_at(problem: &Problem, inertial: &[f64]) -> Vec<f64> {
    let mut all = Vec::new();
    for (used, rows) in problem.drives.iter().zip(problem.record.drives()) {
        if problem.settings.model == Model::Constant {
            for reaction in &rows.reactions {
                all.extend(super::record::product(reaction, inertial).iter().map(|f| sign(*f)));
            }
            continue;
        }
        for reaction in &used.reactions {
            let mut force = vec![0.0; used.rows()];
            add_product(&mut force, reaction, used.rows(), 0, inertial);
            all.extend(force.iter().map(|f| sign(*f)));
        }
    }
    all
}

/// The problem with given signs: linear parameters `φ, f_v`, shape parameters those of `μ_c, μ_s, v_s` that act.
struct Signed<'a> {
    problem: &'a Problem,
    shape: Vec<ShapeParameter>,
    kinds: Vec<FrictionParameter>,
    groups: Vec<RowGroup>,
    /// `∂F/∂φ` per drive, column after column.
    normal: Vec<Vec<f64>>,
    theta: Vec<f64>,
}

impl<'a> Signed<'a> {
    fn new(problem: &'a Problem, bounds: &Bounds, theta: &[f64], signs: &[f64]) -> Self {
        let p = problem.inertial();
        let kinds: Vec<FrictionParameter> =
            [FrictionParameter::Coulomb, FrictionParameter::Static, FrictionParameter::StribeckSpeed]
                .into_iter()
                .filter(|k| k.acts_in(problem.settings.model))
                .collect();
        let shape = kinds
            .iter()
            .map(|kind| {
                let k = kind.index(p);
                ShapeParameter {
                    name: kind.name().to_owned(),
                    unit: "",
                    start: theta[k],
                    lower: bounds.lower()[k],
                    upper: bounds.upper()[k],
                    logarithmic: bounds.is_logarithmic(k),
                }
            })
            .collect();
        let mut left = signs;
        let normal = (0..problem.drives.len()).map(|j| signed_rows(problem, j, &mut left)).collect();
        let group = |(output, rows): (usize, &super::problem::UsedRows)| RowGroup {
            output,
            block_rows: vec![rows.rows()],
            fixed: vec![p],
            fixed_values: rows.speed.clone(),
            effort: rows.effort.clone(),
            shaped: (0..p).map(Some).collect(),
            dependence: (0..p).flat_map(|k| (0..kinds.len()).map(move |s| (k, s))).collect(),
            ..RowGroup::default()
        };
        let groups = problem.drives.iter().enumerate().map(group).collect();
        Signed { problem, shape, kinds, groups, normal, theta: theta.to_vec() }
    }

    fn put(&self, found: &SeparableEstimate, theta: &mut [f64]) {
        let p = self.problem.inertial();
        theta[..p].copy_from_slice(&found.linear[..p]);
        theta[FrictionParameter::Viscous.index(p)] = found.linear[p];
        for (kind, value) in self.kinds.iter().zip(&found.shape) {
            theta[kind.index(p)] = *value;
        }
    }

    /// `μ_c, μ_s, v_s`.
    fn friction(&self, shape: &[f64]) -> [f64; 3] {
        let p = self.problem.inertial();
        let of = |kind: FrictionParameter| {
            let place = self.kinds.iter().position(|k| *k == kind);
            place.map_or(self.theta[kind.index(p)], |at| shape[at])
        };
        [of(FrictionParameter::Coulomb), of(FrictionParameter::Static), of(FrictionParameter::StribeckSpeed)]
    }
}

/// `Σ_k sign · N_k` of the used samples of a drive, or its mean over the record; takes its signs off the front.
fn signed_rows(problem: &Problem, j: usize, signs: &mut &[f64]) -> Vec<f64> {
    let used = &problem.drives[j];
    let rows = used.rows();
    let mut out = vec![0.0; rows * problem.inertial()];
    let mut take = |count: usize| {
        let (front, rest) = signs.split_at(count);
        *signs = rest;
        front
    };
    if problem.settings.model == Model::Constant {
        let samples = problem.record.samples();
        for reaction in &problem.record.drives()[j].reactions {
            let signs = take(samples);
            for (k, to) in out.chunks_exact_mut(rows.max(1)).enumerate() {
                let sum: f64 = reaction.col(k).iter().zip(signs).map(|(n, s)| n * s).sum();
                to.iter_mut().for_each(|t| *t += sum / samples as f64);
            }
        }
        return out;
    }
    for reaction in &used.reactions {
        let signs = take(rows);
        for (k, to) in out.chunks_exact_mut(rows.max(1)).enumerate() {
            let column = used.column(reaction, k);
            to.iter_mut().zip(column).zip(signs).for_each(|((t, n), s)| *t += n * s);
        }
    }
    out
}

impl SeparableProblem for Signed<'_> {
    fn linear(&self) -> usize {
        self.problem.inertial() + 1
    }

    fn shape(&self) -> &[ShapeParameter] {
        &self.shape
    }

    fn groups(&self) -> &[RowGroup] {
        &self.groups
    }

    fn shaped(&self, shape: &[f64], out: &mut [ShapedColumns]) {
        let [coulomb, stick, stribeck] = self.friction(shape);
        let settings = &self.problem.settings;
        for (j, columns) in out.iter_mut().enumerate() {
            let used = &self.problem.drives[j];
            let weight = &self.problem.record.drives()[j].weight;
            let decays: Vec<(f64, f64)> =
                (used.speed.iter()).map(|v| decay(settings.model, settings.exponent, *v, stribeck)).collect();
            for (k, w) in weight.iter().enumerate() {
                let (regressor, normal) = (used.column(&used.regressor, k), used.column(&self.normal[j], k));
                for (i, value) in columns.value_mut(k).iter_mut().enumerate() {
                    let factor = coulomb + (stick - coulomb) * decays[i].0;
                    *value = regressor[i] + used.sign[i] * (factor * normal[i] + coulomb * w);
                }
                for (at, kind) in self.kinds.iter().enumerate() {
                    let to = columns.derivative_mut(k * self.kinds.len() + at);
                    for (i, d) in to.iter_mut().enumerate() {
                        let (e, slope) = decays[i];
                        *d = used.sign[i]
                            * match kind {
                                FrictionParameter::Coulomb => (1.0 - e) * normal[i] + w,
                                FrictionParameter::Static => e * normal[i],
                                _ => (stick - coulomb) * slope * normal[i],
                            };
                    }
                }
            }
        }
    }
}
