//! Direction of gravity.

use super::PreflightError;
use super::refine::{Problem, Unknown, dot, norm};
use super::trial::Trial;
use super::wiring::Wiring;

/// Gravity as the efforts show it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tilt {
    /// Gravity in base axes, m/s², as long as the one stated.
    pub gravity: [f64; 3],
    /// Angle to the gravity stated, rad.
    pub angle: f64,
    /// Standard error of the angle, jackknife over twelve parts of the record, rad.
    pub error: f64,
    /// Misfit that is left, in the unit of [`super::WiringSearch::nothing`], the prior's part included.
    pub misfit: f64,
}

/// Fits the direction of gravity together with all parameters; `None` without gravity, or where the log does not tell it.
///
/// Gauss-Newton on the two components across the present direction, from the wiring's; a Gaussian prior fills what the log does not
/// see. What joints that turn about the vertical feel of gravity is due to the tilt alone, so that no inertia has to be known.
///
/// # Errors
/// [`PreflightError`] if a regressor is not finite.
pub fn tilt(trial: &Trial<'_>, wiring: &Wiring) -> Result<Option<Tilt>, PreflightError> {
    let stated = trial.gravity;
    let size = norm(stated);
    if size == 0.0 {
        return Ok(None);
    }
    let problem: Problem<'_> = trial.refinement(trial.samples);
    let start = Wiring { gravity: Some(wiring.gravity.unwrap_or(stated)), ..wiring.clone() };
    let Some(found) = problem.refine(&start, Unknown::Gravity, f64::INFINITY, None)? else { return Ok(None) };
    let Some(error) = found.error else { return Ok(None) };
    let gravity = found.wiring.gravity.unwrap_or(stated);
    let cosine = dot(gravity, stated) / (size * norm(gravity));
    Ok(Some(Tilt { gravity, angle: cosine.clamp(-1.0, 1.0).acos(), error, misfit: found.misfit }))
}
