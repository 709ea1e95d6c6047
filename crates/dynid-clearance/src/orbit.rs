//! Clearance, friction and stiffness of a bearing from the measured offset of its journal.
//!
//! A journal at rest in its bearing, or swinging little, sits where contact and load balance. With the load `F` on the
//! journal (what the bearing has to give, in axes that turn with the journal's link), the direction of friction
//! `d = c_d sign(v_t)` and the friction coefficient `μ`,
//!
//! ```text
//! F = -F_n (n + μ d t)  =>  n = -R(-φ) F/|F|,  tan φ = μ d,   F_n = |F| / √(1 + μ² d²)
//! e = (c + δ) n,            κ E(δ; c) = F_n
//! ```
//!
//! The angle between offset and load gives `μ`, the length of the offset `c + δ`. How much of it is clearance depends on
//! the stiffness, of which the offset tells only as far as the load changes: `κ`, the factor of the law's force, has a
//! prior. The estimate minimises `Σ |e - e(c, μ, ln κ)|²/σ² + (ln κ/s)²` by damped Gauss-Newton steps.

use dynid_linalg::Mat;
use dynid_model::contact::{ContactError, ContactLaw, SlidingFriction};

use super::Estimate;

/// What was measured at an instant.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct OrbitSample {
    /// Offset of the journal's centre from the bearing's, m, in axes that turn with the journal's link.
    pub offset: [f64; 2],
    /// Force that the bearing exerts on the journal, N, in the same axes.
    pub load: [f64; 2],
    /// Direction of friction `c_d sign(v_t)`, -1 to 1.
    pub sliding: f64,
}

/// Settings of [`estimate`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OrbitSettings {
    /// Standard deviation of `ln κ` before the data; 0: the law is trusted, infinite: nothing is known. Default: 0.3.
    pub stiffness_prior: f64,
    /// Known standard deviation of an offset, m; default: that of the residuals.
    pub noise: Option<f64>,
}

impl Default for OrbitSettings {
    fn default() -> Self {
        OrbitSettings { stiffness_prior: 0.3, noise: None }
    }
}

/// Why nothing can be estimated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum OrbitError {
    /// Fewer samples than it takes.
    #[error("expected at least 4 samples of a loaded journal that slides, found {found}")]
    TooFew {
        /// Samples with load and sliding.
        found: usize,
    },
    /// A number is not finite.
    #[error("sample {row}: expected finite numbers")]
    NotFinite {
        /// Index from 0.
        row: usize,
    },
    /// The offset is no longer than the penetration that the load asks for: no clearance is left.
    #[error("the journal's offset of {length} m leaves no clearance")]
    NoClearance {
        /// Mean length of the offset, m.
        length: f64,
    },
    /// The law refuses a clearance.
    #[error(transparent)]
    Law(#[from] ContactError),
}

/// Clearance of a bearing as its journal's offset shows it.
#[derive(Debug, Clone, PartialEq)]
pub struct OrbitEstimate {
    /// Radial clearance `c`, m.
    pub clearance: Estimate,
    /// Friction coefficient.
    pub friction: Estimate,
    /// Factor `κ` of the law's elastic force; its deviation is relative, that of `ln κ`.
    pub stiffness: Estimate,
    /// Share of the prior variance of `ln κ` that the data took away: near 0, the stiffness is the prior's.
    pub stiffness_seen: f64,
    /// Offset at the mean load, `c + δ`, m: what holds whatever the stiffness is.
    pub length: Estimate,
    /// Correlation of clearance and `ln κ`.
    pub correlation: f64,
    /// Root of the mean square of the residuals, m.
    pub residual: f64,
    /// Samples used: loaded and sliding.
    pub samples: usize,
    /// Gauss-Newton steps.
    pub iterations: usize,
    /// The last step was below a millionth of the deviations, or below rounding.
    pub converged: bool,
}

const MOST_ITERATIONS: usize = 50;
/// Samples below this direction of friction are on the way between sticking and sliding.
const LEAST_SLIDING: f64 = 0.5;

/// How much faster than `v_m` a joint has to turn its journal's surface for the swing of the journal not to matter.
const CLEAR_OF_SWING: f64 = 5.0;

/// Direction of friction where the rotation of a joint alone gives the surface of its journal a speed (m/s): that of the law
/// from `5 v_m` on, 0 below. Slower surfaces may stop when the journal swings, and count as less friction than there is:
/// 2 % for a published pointing mechanism, nine standard deviations.
pub fn sliding_of(friction: &SlidingFriction, speed: f64) -> f64 {
    if speed.abs() < CLEAR_OF_SWING * friction.v_m { 0.0 } else { friction.direction(speed).0 }
}

/// Unknowns: clearance, friction, `ln κ`.
type Unknowns = [f64; 3];

/// Estimates clearance, friction and stiffness of a bearing.
///
/// `law`: of the contact; its own clearance is where the search starts from the measured length. Samples without load or
/// with little sliding are left out.
///
/// # Errors
/// [`OrbitError`].
pub fn estimate(
    samples: &[OrbitSample],
    law: &ContactLaw,
    settings: &OrbitSettings,
) -> Result<OrbitEstimate, OrbitError> {
    let finite = |s: &OrbitSample| s.offset.iter().chain(&s.load).chain([&s.sliding]).all(|x| x.is_finite());
    if let Some(row) = samples.iter().position(|s| !finite(s)) {
        return Err(OrbitError::NotFinite { row });
    }
    let used: Vec<&OrbitSample> =
        samples.iter().filter(|s| norm(s.load) > 0.0 && s.sliding.abs() >= LEAST_SLIDING).collect();
    if used.len() < 4 {
        return Err(OrbitError::TooFew { found: used.len() });
    }
    let count = used.len() as f64;
    let length = used.iter().map(|s| norm(s.offset)).sum::<f64>() / count;
    let load = used.iter().map(|s| norm(s.load)).sum::<f64>() / count;
    let mut at = start(&used, law, load, length)?;
    let mut noise = settings.noise.unwrap_or(1e-3 * length);
    let mut iterations = 0;
    let mut converged = false;
    let mut system = System::new(&used, law, at, settings)?;
    while iterations < MOST_ITERATIONS && !converged {
        iterations += 1;
        noise = settings.noise.unwrap_or((system.squares / (2.0 * count - 3.0)).sqrt()).max(1e-15);
        let normal = system.normal(noise, settings.stiffness_prior, at[2]);
        let step = normal.step();
        let spread = normal.deviations();
        converged = (0..3).all(|k| step[k].abs() <= (1e-6 * spread[k]).max(1e-12 * at[k].abs().max(1e-9)));
        let mut share = 1.0;
        loop {
            let next: Unknowns = std::array::from_fn(|k| at[k] + share * step[k]);
            if next[0] > 0.0 && next[1] > -1.0 {
                let tried = System::new(&used, law, next, settings)?;
                let objective =
                    |s: &System, ln: f64| s.squares / (noise * noise) + prior(ln, settings.stiffness_prior);
                if share < 1e-3 || objective(&tried, next[2]) <= objective(&system, at[2]) * (1.0 + 1e-12) {
                    (at, system) = (next, tried);
                    break;
                }
            } else if share < 1e-3 {
                return Err(OrbitError::NoClearance { length });
            }
            share *= 0.5;
        }
    }
    let normal = system.normal(noise, settings.stiffness_prior, at[2]);
    let covariance = normal.covariance();
    let std = |k: usize| covariance[(k, k)].max(0.0).sqrt();
    let law = law.with_clearance(at[0])?;
    let (depth, slopes) = depth(&law, load / at[2].exp(), at[2]);
    let gradient = [1.0 + slopes.by_clearance, 0.0, slopes.by_ln];
    let variance: f64 = (0..9).map(|k| gradient[k / 3] * covariance[(k / 3, k % 3)] * gradient[k % 3]).sum();
    let held = settings.stiffness_prior;
    Ok(OrbitEstimate {
        clearance: Estimate { value: at[0], std: std(0) },
        friction: Estimate { value: at[1], std: std(1) },
        stiffness: Estimate { value: at[2].exp(), std: std(2) },
        stiffness_seen: match held {
            0.0 => 0.0,
            s if s.is_finite() => (1.0 - covariance[(2, 2)] / (s * s)).clamp(0.0, 1.0),
            _ => 1.0,
        },
        length: Estimate { value: at[0] + depth, std: variance.max(0.0).sqrt() },
        correlation: match std(0) * std(2) {
            0.0 => 0.0,
            both => covariance[(0, 2)] / both,
        },
        residual: (system.squares / (2.0 * count)).sqrt(),
        samples: used.len(),
        iterations,
        converged,
    })
}

/// Clearance behind an offset of a given length under a load, `c = |e| - δ(c)`, with a stiffness known as well as
/// `stiffness_prior` says ([`OrbitSettings::stiffness_prior`]).
///
/// # Errors
/// [`OrbitError::NoClearance`], [`OrbitError::Law`].
pub fn clearance_of_length(
    law: &ContactLaw,
    length: Estimate,
    load: f64,
    stiffness_prior: f64,
) -> Result<Estimate, OrbitError> {
    let mut clearance = length.value;
    for _ in 0..50 {
        let depth = law.with_clearance(clearance)?.static_penetration(load);
        let next = length.value - depth;
        if next <= 0.05 * length.value {
            return Err(OrbitError::NoClearance { length: length.value });
        }
        let change = (next - clearance).abs();
        clearance = next;
        if change <= 1e-12 * length.value {
            break;
        }
    }
    let (_, slopes) = depth(&law.with_clearance(clearance)?, load, 0.0);
    let unsure = stiffness_prior * slopes.by_ln;
    Ok(Estimate { value: clearance, std: length.std.hypot(unsure) / (1.0 + slopes.by_clearance) })
}

fn prior(ln: f64, std: f64) -> f64 {
    if std > 0.0 { (ln / std).powi(2) } else { 0.0 }
}

fn norm([x, y]: [f64; 2]) -> f64 {
    x.hypot(y)
}

/// The mean length without the penetration, and the mean tangent of the angle between offset and load.
fn start(used: &[&OrbitSample], law: &ContactLaw, load: f64, length: f64) -> Result<Unknowns, OrbitError> {
    let mut clearance = length;
    for _ in 0..20 {
        let depth = law.with_clearance(clearance)?.static_penetration(load);
        clearance = (length - depth).max(0.05 * length);
    }
    if clearance <= 0.05 * length {
        return Err(OrbitError::NoClearance { length });
    }
    let (mut across, mut along) = (0.0, 0.0);
    for s in used {
        let ([ex, ey], [fx, fy]) = (s.offset, s.load);
        // n = -R(-φ) F/|F|: the offset lies φ behind the opposite of the load.
        across += s.sliding.signum() * (ey * fx - ex * fy);
        along -= ex * fx + ey * fy;
    }
    Ok([clearance, (-across / along).clamp(-0.9, 0.9), 0.0])
}

/// How a penetration changes with the clearance and with `ln κ`, and with the force.
#[derive(Debug, Clone, Copy)]
struct DepthSlopes {
    by_clearance: f64,
    by_ln: f64,
    by_force: f64,
}

/// Penetration that carries a force on the law itself (`F_n/κ`), with slopes by the law's clearance, by `ln κ` and by `F_n`.
fn depth(law: &ContactLaw, force: f64, ln: f64) -> (f64, DepthSlopes) {
    let depth = law.static_penetration(force);
    let at = law.at(depth, 0.0);
    let slopes = DepthSlopes {
        by_clearance: -at.elastic_by_clearance / at.elastic_slope,
        by_ln: -force / at.elastic_slope,
        by_force: 1.0 / (ln.exp() * at.elastic_slope),
    };
    (depth, slopes)
}

/// Sums of products of slopes and residuals.
struct System {
    gram: [[f64; 3]; 3],
    right: [f64; 3],
    squares: f64,
    free: [bool; 3],
}

impl System {
    fn new(
        used: &[&OrbitSample],
        law: &ContactLaw,
        [clearance, friction, ln]: Unknowns,
        settings: &OrbitSettings,
    ) -> Result<Self, OrbitError> {
        let law = law.with_clearance(clearance)?;
        let mut out = System {
            gram: [[0.0; 3]; 3],
            right: [0.0; 3],
            squares: 0.0,
            free: [true, true, settings.stiffness_prior > 0.0],
        };
        for s in used {
            let tangent = friction * s.sliding;
            let stretch = (1.0 + tangent * tangent).sqrt();
            let size = norm(s.load);
            let (sine, cosine) = (tangent / stretch, 1.0 / stretch);
            let [ux, uy] = s.load.map(|f| -f / size);
            // R(-φ) turns by the angle of friction.
            let n = [cosine * ux + sine * uy, cosine * uy - sine * ux];
            let t = [-n[1], n[0]];
            let force = size / stretch;
            let (penetration, slopes) = depth(&law, force / ln.exp(), ln);
            let length = clearance + penetration;
            let turn = -s.sliding / (stretch * stretch);
            let by_force = -size * friction * s.sliding * s.sliding / stretch.powi(3);
            let by = [
                [(1.0 + slopes.by_clearance) * n[0], (1.0 + slopes.by_clearance) * n[1]],
                [0, 1].map(|k| slopes.by_force * by_force * n[k] + length * turn * t[k]),
                [slopes.by_ln * n[0], slopes.by_ln * n[1]],
            ];
            for axis in 0..2 {
                let residual = s.offset[axis] - length * n[axis];
                out.squares += residual * residual;
                for i in 0..3 {
                    out.right[i] += by[i][axis] * residual;
                    for j in 0..3 {
                        out.gram[i][j] += by[i][axis] * by[j][axis];
                    }
                }
            }
        }
        Ok(out)
    }

    /// Gauss-Newton's equations with the prior, scaled to unit diagonals.
    fn normal(&self, noise: f64, held: f64, ln: f64) -> Normal {
        let weight = 1.0 / (noise * noise);
        let mut matrix = self.gram.map(|row| row.map(|x| weight * x));
        let mut right = self.right.map(|x| weight * x);
        if held > 0.0 {
            matrix[2][2] += 1.0 / (held * held);
            right[2] -= ln / (held * held);
        }
        Normal { matrix, right, free: self.free }
    }
}

struct Normal {
    matrix: [[f64; 3]; 3],
    right: [f64; 3],
    free: [bool; 3],
}

impl Normal {
    fn scales(&self) -> [f64; 3] {
        std::array::from_fn(
            |k| if self.free[k] { self.matrix[k][k].sqrt().max(f64::MIN_POSITIVE) } else { 1.0 },
        )
    }

    fn scaled(&self) -> Mat {
        let s = self.scales();
        Mat::from_fn(3, 3, |i, j| match self.free[i] && self.free[j] {
            true => self.matrix[i][j] / (s[i] * s[j]),
            false => f64::from(u8::from(i == j)),
        })
    }

    fn covariance(&self) -> Mat {
        let s = self.scales();
        // Three unknowns at most, scaled; where clearance and stiffness cannot be told apart, the least eigenvalue says so.
        let scaled = self.scaled();
        let inverse = match scaled.symmetric_eigen() {
            Some(eigen) => {
                let (u, l) = (eigen.vectors, eigen.values);
                Mat::from_fn(3, 3, |i, j| {
                    (0..3).map(|k| u[(i, k)] * u[(j, k)] / l[k].max(1e-16)).sum::<f64>()
                })
            }
            None => Mat::from_fn(3, 3, |i, j| if i == j { f64::INFINITY } else { 0.0 }),
        };
        Mat::from_fn(3, 3, |i, j| match self.free[i] && self.free[j] {
            true => inverse[(i, j)] / (s[i] * s[j]),
            false => 0.0,
        })
    }

    fn step(&self) -> Unknowns {
        let covariance = self.covariance();
        std::array::from_fn(|i| (0..3).map(|j| covariance[(i, j)] * self.right[j]).sum())
    }

    fn deviations(&self) -> Unknowns {
        let covariance = self.covariance();
        std::array::from_fn(|k| if self.free[k] { covariance[(k, k)].max(0.0).sqrt() } else { f64::INFINITY })
    }
}
