//! Inertial parameters where the data leave a choice: the nearest to design values that a body can have.

use super::barrier::{Affine, Constraint, Program};
use super::bounded::clipped;
use super::error::{LoadFrictionError, in_range, same_size};
use super::identifiability::right_singular;
use super::problem::Problem;
use dynid_factor::rank::rank_tolerance;
use dynid_linalg::Mat;
use dynid_search::Bounds;

/// Gap of the squared distance (or of the objective where the fit gives way).
const TOLERANCE: f64 = 1e-9;
/// Weight of the squared distance beside the fit where the fit gives way.
const DISTANCE_WEIGHT: f64 = 1e-6;
/// Entry of a scaled free direction below which it does not move the parameter.
const STILL: f64 = 1e-9;

/// A body in the plane: where its parameters are among `φ`.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanarBody {
    /// Name.
    pub name: String,
    /// Mass `m`.
    pub mass: usize,
    /// First moments `h`, one per axis that the model has.
    pub moments: Vec<usize>,
    /// Moment of inertia `I` about the origin of the first moments.
    pub inertia: usize,
    /// Range of the centre of mass `h/m` along each of these axes, m; infinite ends for none.
    pub centre: Vec<(f64, f64)>,
}

/// What parameters are drawn to.
#[derive(Debug, Clone, PartialEq)]
pub struct Design {
    /// Design values of `φ`.
    pub values: Vec<f64>,
    /// Scales of `φ`, positive: the distance is `√Σ((φ_k - values_k)/scales_k)²`.
    pub scales: Vec<f64>,
    /// Bodies that must be able to exist. Parameters of no body have their bounds only.
    pub bodies: Vec<PlanarBody>,
    /// Least moment of inertia about the centre of mass, as a share of the design's: `I - Σh²/m >= margin · that`.
    /// In `[0, 1)`.
    pub margin: f64,
}

/// How [`nearest_to_design`] met its conditions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DesignStatus {
    /// Along free directions alone: efforts and reactions are those of the fit.
    FreeDirections,
    /// The fit had to give way.
    GaveWay,
}

/// Outcome of [`nearest_to_design`].
#[derive(Debug, Clone, PartialEq)]
pub struct NearestDesign {
    /// `θ`: friction as it was, `φ` inside its bounds, bodies that can exist.
    pub theta: Vec<f64>,
    /// Distance from the design.
    pub distance: f64,
    /// RMS change of the predicted efforts over the used samples; 0 if the free directions suffice.
    pub gave_way: f64,
    /// Whether they do.
    pub status: DesignStatus,
    /// Number of free directions of `φ`.
    pub free_directions: usize,
    /// Proven bound on what the objective could still fall: half the squared distance, or half of
    /// `(RMS change/ρ)² + 1e-6 distance²` with `ρ` the RMS residual (at least 1e-6 of the RMS effort).
    pub gap: f64,
    /// `I - Σh²/m` of every body.
    pub central_inertias: Vec<f64>,
}

/// Among all parameters with the same efforts and the same reactions as `theta`, the ones nearest to the design that lie
/// within their bounds and belong to bodies that can exist: `I - Σh²/m > 0` with a margin, `h/m` in a box. Where there
/// are none, the fit gives way as little as possible, friction parameters held.
///
/// Free directions are the null space of all rows `W`, `N_k`, `w` together. Bodies are the cone `m I >= Σh²`, so the
/// program is convex. Its method is a barrier of its own: [`dynid_estimate::consistent`] wants ten columns per body and meets
/// efforts up to the weight of its prior, while here the null space keeps them to rounding.
///
/// # Errors
/// Sizes, indices and numbers that do not fit, a design whose bodies cannot exist, and conditions that no parameters
/// meet ([`LoadFrictionError::Infeasible`]).
pub fn nearest_to_design(
    problem: &Problem,
    bounds: &Bounds,
    theta: &[f64],
    design: &Design,
) -> Result<NearestDesign, LoadFrictionError> {
    let p = problem.inertial();
    let held = clipped(problem, bounds, theta)?;
    let floors = check(design, p)?;
    let task = Task { problem, bounds, design, floors, p };
    let scaled = task.structure()?;
    let movable: Vec<bool> = (0..p).map(|k| bounds.lower()[k] < bounds.upper()[k]).collect();
    let space = null_space(&scaled, &movable)?;
    let free_directions = space.ncols();
    let outside = (0..held.len()).any(|k| (k >= p || !movable[k]) && theta[k] != held[k]);
    let mut full = theta.to_vec();
    full[p..].copy_from_slice(&held[p..]);
    let exact = if outside { Err(f64::INFINITY) } else { task.along(&full, &space).solve(TOLERANCE) };
    let (found, status, map) = match exact {
        Ok(found) => (found, DesignStatus::FreeDirections, space),
        Err(_) => {
            full[..p].copy_from_slice(&held[..p]);
            let free: Vec<usize> = (0..p).filter(|k| movable[*k]).collect();
            let map = Mat::from_fn(p, free.len(), |k, j| f64::from(u8::from(free[j] == k)));
            let mut original = theta.to_vec();
            original[p..].copy_from_slice(&held[p..]);
            let program = task.giving_way(&full, &original, &map)?;
            let found =
                program.solve(TOLERANCE).map_err(|violation| LoadFrictionError::Infeasible { violation })?;
            (found, DesignStatus::GaveWay, map)
        }
    };
    let mut result = full;
    for k in 0..p {
        let moved: f64 = found.x.iter().enumerate().map(|(j, x)| map[(k, j)] * x).sum();
        let value = result[k] + design.scales[k] * moved;
        result[k] = value.max(bounds.lower()[k]).min(bounds.upper()[k]);
    }
    let gave_way = match status {
        DesignStatus::FreeDirections => 0.0,
        DesignStatus::GaveWay => task.effort_change(theta, &result),
    };
    Ok(NearestDesign {
        distance: (0..p)
            .map(|k| ((result[k] - design.values[k]) / design.scales[k]).powi(2))
            .sum::<f64>()
            .sqrt(),
        central_inertias: design.bodies.iter().map(|b| central_inertia(b, &result)).collect(),
        theta: result,
        gave_way,
        status,
        free_directions,
        gap: found.gap,
    })
}

fn central_inertia(body: &PlanarBody, phi: &[f64]) -> f64 {
    let square: f64 = body.moments.iter().map(|h| phi[*h] * phi[*h]).sum();
    phi[body.inertia] - square / phi[body.mass]
}

/// Checks a design; returns the least central inertia of every body.
fn check(design: &Design, p: usize) -> Result<Vec<f64>, LoadFrictionError> {
    same_size("design values", p, design.values.len())?;
    same_size("design scales", p, design.scales.len())?;
    for (k, (value, scale)) in design.values.iter().zip(&design.scales).enumerate() {
        in_range(format!("design value {k}"), "a finite number", *value, value.is_finite())?;
        in_range(
            format!("design scale {k}"),
            "a positive number",
            *scale,
            scale.is_finite() && *scale > 0.0,
        )?;
    }
    in_range("margin", "a number in [0, 1)", design.margin, (0.0..1.0).contains(&design.margin))?;
    let floor = |body: &PlanarBody| {
        let name = &body.name;
        same_size(format!("centre ranges of {name}"), body.moments.len(), body.centre.len())?;
        for k in body.moments.iter().chain([&body.mass, &body.inertia]) {
            let what = format!("parameter of {name}");
            in_range(what, "an index of an inertial parameter", *k as f64, *k < p)?;
        }
        for (low, high) in &body.centre {
            in_range(format!("centre range of {name}"), "a lower end below the upper", *low, low < high)?;
        }
        let mass = design.values[body.mass];
        in_range(format!("design mass of {name}"), "a positive number", mass, mass > 0.0)?;
        let inertia = central_inertia(body, &design.values);
        let what = format!("design inertia of {name} about its centre of mass");
        in_range(what, "a positive number", inertia, inertia > 0.0)?;
        Ok(design.margin * inertia)
    };
    design.bodies.iter().map(floor).collect()
}

/// Orthonormal null space of the movable columns, with zeros for the others and for parameters it does not move.
fn null_space(scaled: &Mat, movable: &[bool]) -> Result<Mat, LoadFrictionError> {
    let columns: Vec<usize> = (0..movable.len()).filter(|k| movable[*k]).collect();
    let part = Mat::from_fn(scaled.nrows(), columns.len(), |i, j| scaled[(i, columns[j])]);
    if columns.is_empty() {
        return Ok(Mat::zeros(movable.len(), 0));
    }
    let (values, v) = right_singular(&part)?;
    let tolerance = rank_tolerance(scaled.nrows(), columns.len(), values[0]);
    let rank = values.iter().take_while(|s| **s > tolerance).count();
    let mut out = Mat::zeros(movable.len(), columns.len() - rank);
    for (j, &k) in columns.iter().enumerate() {
        for i in 0..out.ncols() {
            out[(k, i)] = v[(j, rank + i)];
        }
        if (0..out.ncols()).all(|i| out[(k, i)].abs() < STILL) {
            (0..out.ncols()).for_each(|i| out[(k, i)] = 0.0);
        }
    }
    Ok(out)
}

struct Task<'a> {
    problem: &'a Problem,
    bounds: &'a Bounds,
    design: &'a Design,
    floors: Vec<f64>,
    p: usize,
}

impl Task<'_> {
    /// All rows `W`, `N_k`, `w`, columns in units of the scales.
    fn structure(&self) -> Result<Mat, LoadFrictionError> {
        let drives = self.problem.record.drives();
        let samples = self.problem.record.samples();
        let blocks: Vec<&Mat> =
            drives.iter().flat_map(|d| std::iter::once(&d.regressor).chain(&d.reactions)).collect();
        let rows = blocks.len() * samples;
        // A weight acts in every sample.
        let root = (samples as f64).sqrt();
        Ok(Mat::from_fn(rows + drives.len(), self.p, |i, k| {
            let entry = match i.checked_sub(rows) {
                Some(drive) => root * drives[drive].weight[k],
                None => blocks[i / samples][(i % samples, k)],
            };
            entry * self.design.scales[k]
        }))
    }

    /// Half the squared distance along `φ = φ̂ + S Z x`.
    fn along(&self, theta: &[f64], space: &Mat) -> Program {
        let n = space.ncols();
        let off = |k: usize| (theta[k] - self.design.values[k]) / self.design.scales[k];
        Program {
            hessian: space.transpose() * space,
            gradient: (0..n).map(|i| (0..self.p).map(|k| space[(k, i)] * off(k)).sum()).collect(),
            constraints: self.constraints(theta, space),
        }
    }

    /// Half of `(RMS change of efforts/ρ)² + 1e-6 distance²` along `φ = start + S Z x`, the change counted from `theta`.
    fn giving_way(&self, start: &[f64], theta: &[f64], space: &Mat) -> Result<Program, LoadFrictionError> {
        let jacobian = self.problem.jacobian(start)?;
        let rows = self.problem.rows() as f64;
        let rms = |sum: f64| (sum / rows).sqrt();
        let effort = rms(self.problem.efforts().iter().map(|y| y * y).sum());
        let size = rms(self.problem.sum_of_squares(start)?).max(1e-6 * effort).max(f64::MIN_POSITIVE);
        let scaled = Mat::from_fn(jacobian.nrows(), self.p, |i, k| {
            jacobian[(i, k)] * self.design.scales[k] / (size * rows.sqrt())
        });
        let moved = &scaled * space;
        let off = Mat::from_fn(self.p, 1, |k, _| (start[k] - theta[k]) / self.design.scales[k]);
        let first = moved.transpose() * (&scaled * off);
        let mut program = self.along(start, space);
        program.hessian = &program.hessian * DISTANCE_WEIGHT + moved.transpose() * &moved;
        for (i, g) in program.gradient.iter_mut().enumerate() {
            *g = DISTANCE_WEIGHT * *g + first[(i, 0)];
        }
        Ok(program)
    }

    fn constraints(&self, theta: &[f64], space: &Mat) -> Vec<Constraint> {
        let scales = &self.design.scales;
        // `factor φ_k + shift` as a function of x.
        let affine = |terms: &[(usize, f64)], shift: f64| Affine {
            constant: shift + terms.iter().map(|(k, f)| f * theta[*k]).sum::<f64>(),
            factors: (0..space.ncols())
                .map(|i| terms.iter().map(|(k, f)| f * scales[*k] * space[(*k, i)]).sum())
                .collect(),
        };
        let mut all = Vec::new();
        for (k, &unit) in scales.iter().enumerate() {
            let (lower, upper) = (self.bounds.lower()[k], self.bounds.upper()[k]);
            if lower == upper {
                continue;
            }
            if lower.is_finite() {
                all.push(Constraint::Positive { value: affine(&[(k, 1.0)], -lower), unit });
            }
            if upper.is_finite() {
                all.push(Constraint::Positive { value: affine(&[(k, -1.0)], upper), unit });
            }
        }
        for (body, floor) in self.design.bodies.iter().zip(&self.floors) {
            let (mass, inertia) = (body.mass, body.inertia);
            all.push(Constraint::Body {
                inertia: affine(&[(inertia, 1.0)], -floor),
                mass: affine(&[(mass, 1.0)], 0.0),
                moments: body.moments.iter().map(|h| affine(&[(*h, 1.0)], 0.0)).collect(),
                units: (scales[inertia], scales[mass]),
            });
            for (&h, &(low, high)) in body.moments.iter().zip(&body.centre) {
                if low.is_finite() {
                    let value = affine(&[(h, 1.0), (mass, -low)], 0.0);
                    all.push(Constraint::Positive { value, unit: scales[h] });
                }
                if high.is_finite() {
                    let value = affine(&[(h, -1.0), (mass, high)], 0.0);
                    all.push(Constraint::Positive { value, unit: scales[h] });
                }
            }
        }
        all
    }

    fn effort_change(&self, before: &[f64], after: &[f64]) -> f64 {
        let drives = 0..self.problem.drives.len();
        let sum: f64 = drives
            .map(|j| {
                let (a, b) = (self.problem.used_effort(j, before), self.problem.used_effort(j, after));
                a.iter().zip(&b).map(|(a, b)| (a - b).powi(2)).sum::<f64>()
            })
            .sum();
        (sum / self.problem.rows() as f64).sqrt()
    }
}
