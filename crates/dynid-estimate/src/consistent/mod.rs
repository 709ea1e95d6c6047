//! Physically consistent estimates: standard parameters that a body can have, fitted to a factor.
//!
//! `min ‖R x - z‖² + δ ‖ξ - ξ0‖² + w Σ ((x_j - x0_j)/σ0_j)² + γ Σ_i D(P_i | P0_i)` over standard parameters `x` such that every link's
//! pseudo-inertia `P_i ⪰ ε P0_i` (or its weaker 6 × 6 form), friction and rotor inertias stay above `ε`, and linear
//! bounds and equalities hold. `ξ` are whitened parameters: `svec(L⁻¹ P L⁻ᵀ)` of each link with `P0 = L Lᵀ`, scalars divided by their
//! scale. The problem is convex; [`estimate`] solves it by a primal-dual interior-point method and returns, with the
//! estimate, a proven bound on how far from the optimum it can be ([`certificate`]).
//!
//! `R`, `z` are weighted by `1/σ`, so that everything counts in units of the residual variance.
//!
//! Sources: Wensing, Kim & Slotine 2018 (pseudo-inertia); Sousa & Cortesão 2014 (6 × 6 form); Lee, Wensing & Park 2020
//! (entropic distance); Nesterov & Todd 1997, Mehrotra 1992 (method).

mod active;
mod bounds;
mod certificate;
mod cone;
pub mod entropic;
mod interior;
mod manifold;
mod problem;
mod program;
mod whitening;

pub use active::ActiveConstraint;
pub use problem::{Bound, Equality, Form, LinkPrior, Margin, Problem, ProblemError, ScalarPrior, Settings};

use program::Program;
use whitening::Whitening;

/// How a consistent estimate ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// The unconstrained optimum is consistent: no constraint matters.
    Unconstrained,
    /// A constraint is active and the certified gap is within the tolerance.
    Optimal,
    /// The estimate is consistent, but its certified gap stayed above the tolerance.
    Stalled,
}

/// Outcome of [`estimate`].
#[derive(Debug, Clone, PartialEq)]
pub struct ConsistentEstimate {
    /// Standard parameters in column order, SI units; always consistent.
    pub x: Vec<f64>,
    /// `‖R x - z‖²`, in units of the residual variance.
    pub fit: f64,
    /// The least that any parameters reach, consistent or not.
    pub unconstrained_fit: f64,
    /// Value of the whole objective.
    pub objective: f64,
    /// No consistent parameters with whitened sizes below ten times these have an objective lower by more than this.
    pub gap: f64,
    /// How it ended.
    pub status: Status,
    /// Interior-point iterations, phase I included; 0 if unconstrained.
    pub iterations: usize,
    /// Least `λ_min(X_i)` over the links, `X_i = L⁻¹ P_i L⁻ᵀ` (or the 6 × 6 form whitened alike): at least the margin, to
    /// rounding of the largest. `None` without links.
    pub least_eigenvalue: Option<f64>,
    /// Largest `tr X_i` over the links; above 100 the prior is off by two orders of magnitude.
    pub largest_trace: f64,
    /// Constraints that hold the estimate back.
    pub active: Vec<ActiveConstraint>,
}

impl ConsistentEstimate {
    /// What consistency costs in fit, `χ²(consistent) - χ²(unconstrained)`, in units of the residual variance.
    pub fn price(&self) -> f64 {
        self.fit - self.unconstrained_fit
    }
}

/// Solves the problem.
///
/// # Errors
/// [`ProblemError`]: the problem contradicts itself (including bounds that no body meets, which are named) or holds
/// numbers that are not finite. A gap above the tolerance is a [`Status`].
pub fn estimate(problem: &Problem, settings: &Settings) -> Result<ConsistentEstimate, ProblemError> {
    problem.check(settings)?;
    match settings.form {
        Form::PseudoInertia => estimate_in::<4>(problem, settings),
        Form::SpatialInertia => estimate_in::<6>(problem, settings),
    }
}

fn estimate_in<const N: usize>(
    problem: &Problem,
    settings: &Settings,
) -> Result<ConsistentEstimate, ProblemError>
where
    Whitening: whitening::ConeOf<N>,
{
    let whitening = Whitening::new(problem)?;
    let program: Program<N> = whitening.program(problem, settings);
    let free = program.unconstrained();
    let unconstrained_fit = program.least_fit();
    let start = bounds::start(&program, problem)?;
    if settings.entropic_weight == 0.0 && program.strictly_feasible(&free) {
        let ended =
            interior::Outcome { xi: free, gap: 0.0, iterations: 0, multipliers: Vec::new(), converged: true };
        return Ok(report(problem, &whitening, &program, ended, unconstrained_fit, Status::Unconstrained));
    }
    let least = program.objective(&free).unwrap_or(f64::INFINITY).min(f64::MAX);
    let tolerance = |objective: f64| {
        let noise = 2e-14 * problem.z.iter().map(|z| z * z).sum::<f64>();
        (1e-6 * (objective - least)).max(1e-6).max(noise)
    };
    let mut ended = interior::solve(&program, &start.xi, &tolerance);
    ended.iterations += start.iterations;
    let status = if ended.converged { Status::Optimal } else { Status::Stalled };
    Ok(report(problem, &whitening, &program, ended, unconstrained_fit, status))
}

fn report<const N: usize>(
    problem: &Problem,
    whitening: &Whitening,
    program: &Program<N>,
    ended: interior::Outcome,
    unconstrained_fit: f64,
    status: Status,
) -> ConsistentEstimate {
    let (mut least, mut largest) = (None, 0.0_f64);
    for cone in &program.cones {
        let whole = cone.matrix(&ended.xi);
        let own = dynid_model::symmetric::least_eigenvalue(&whole);
        least = Some(least.map_or(own, |least: f64| least.min(own)));
        largest = largest.max(dynid_model::symmetric::trace(&whole));
    }
    ConsistentEstimate {
        x: whitening.parameters(&ended.xi),
        fit: program.fit(&ended.xi),
        unconstrained_fit,
        objective: program.objective(&ended.xi).unwrap_or(f64::INFINITY),
        gap: ended.gap,
        status,
        iterations: ended.iterations,
        least_eigenvalue: least,
        largest_trace: largest,
        active: active::constraints(problem, whitening, program, &ended.xi),
    }
}

/// Proven bound on the excess of an estimate, from whatever method, over the consistent optimum.
///
/// For any consistent `x` whose whitened parts are below ten times those of `estimate`,
/// `objective(x) ≥ objective(estimate) - gap`. Bounds of the problem are given their
/// best multipliers zero, which is safe and loose where a bound is active. `None` for the 6 × 6 form, which needs
/// multipliers, and if the estimate is not consistent.
///
/// # Errors
/// [`ProblemError`] as for [`estimate`].
pub fn certificate(
    problem: &Problem,
    settings: &Settings,
    estimate: &[f64],
) -> Result<Option<f64>, ProblemError> {
    problem.check(settings)?;
    if settings.form != Form::PseudoInertia {
        return Ok(None);
    }
    let whitening = Whitening::new(problem)?;
    let program: Program<4> = whitening.program(problem, settings);
    let xi = whitening.whitened(estimate);
    let free = program.plane.as_ref().and_then(|plane| Some(plane.multipliers(&program.gradient(&xi)?)));
    Ok(certificate::gap(&program, &xi, &vec![0.0; program.bounds()], &free.unwrap_or_default(), None))
}
