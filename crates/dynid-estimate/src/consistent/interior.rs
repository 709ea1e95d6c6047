//! Primal-dual interior-point method with Nesterov-Todd directions, predictor and corrector.
//!
//! Sources: Nesterov & Todd 1997; Mehrotra 1992; Todd, Toh & Tütüncü 1998.

mod direction;
mod newton;

use dynid_linalg::Mat;
use dynid_model::symmetric::{Square, cholesky, congruence, inner, lower_inverse, product, trace, transpose};

use super::certificate;
use super::cone::{LINK, Scaling, add_scaled, diagonal, least_product};
use super::program::Program;
use direction::Direction;
use newton::{Newton, Target};

const MAX_ITERATIONS: usize = 150;
/// Without visible progress for this many iterations the method stops.
const PATIENCE: usize = 16;
/// Share of the way to the boundary.
const STEP: f64 = 0.98;
/// Least eigenvalue of `X S` as a share of its mean.
const CENTRALITY: f64 = 0.05;

/// Where the method ended.
#[derive(Debug, Clone)]
pub(super) struct Outcome {
    /// Strictly consistent point.
    pub xi: Vec<f64>,
    /// Certified gap of the point.
    pub gap: f64,
    pub iterations: usize,
    /// Traces of the multipliers of the matrix inequalities, then multipliers of the half-lines.
    pub multipliers: Vec<f64>,
    /// Whether the gap is within the tolerance.
    pub converged: bool,
}

/// A strictly consistent point with positive definite multipliers.
#[derive(Debug, Clone)]
struct Iterate<const N: usize> {
    xi: Vec<f64>,
    /// Slacks and multipliers of the matrix inequalities.
    slack: Vec<Square<N>>,
    links: Vec<Square<N>>,
    /// Slacks and multipliers of the half-lines.
    room: Vec<f64>,
    rays: Vec<f64>,
}

impl<const N: usize> Iterate<N> {
    /// Multipliers `C + μ X⁻¹` with `C` from the gradient and `μ` twice what makes them definite: well centred.
    fn start(program: &Program<N>, xi: &[f64]) -> Option<Self> {
        let gradient = program.gradient(xi)?;
        let slack: Vec<Square<N>> = program.cones.iter().map(|c| c.slack(xi)).collect();
        let room: Vec<f64> = program.rays.iter().map(|r| r.slack(xi)).collect();
        let mut size = 1e-3_f64;
        let mut wanted = Vec::with_capacity(slack.len());
        for (cone, x) in program.cones.iter().zip(&slack) {
            let own = &gradient[cone.first..cone.first + LINK];
            let mut c = [[0.0; N]; N];
            // For a basis that does not span all symmetric matrices there is no such C.
            if N == 4 {
                own.iter().zip(&cone.basis).for_each(|(g, e)| add_scaled(&mut c, *g, e));
            }
            let l = cholesky(x)?;
            let along = congruence(&transpose(&l), &c);
            let length = own.iter().map(|g| g * g).sum::<f64>().sqrt();
            size = size.max(if N == 4 { inner(&along, &along).sqrt() } else { length });
            wanted.push((c, lower_inverse(&l)));
        }
        for (k, (variable, _)) in program.lower.iter().enumerate() {
            size = size.max(gradient[*variable].abs() * room[k]);
        }
        let mu = 2.0 * size;
        let links = wanted
            .into_iter()
            .map(|(mut c, inverse)| {
                add_scaled(&mut c, mu, &product(&transpose(&inverse), &inverse));
                c
            })
            .collect();
        let rays = room
            .iter()
            .enumerate()
            .map(|(k, w)| program.lower.get(k).map_or(0.0, |(variable, _)| gradient[*variable]) + mu / w)
            .collect();
        Some(Iterate { xi: xi.to_vec(), slack, links, room, rays })
    }

    /// Mean of `⟨X, S⟩` per unit of cone size.
    fn complementarity(&self, program: &Program<N>) -> f64 {
        let links: f64 = self.slack.iter().zip(&self.links).map(|(x, s)| inner(x, s)).sum();
        let rays: f64 = self.room.iter().zip(&self.rays).map(|(w, y)| w * y).sum();
        (links + rays) / program.order().max(1) as f64
    }

    /// The point after a step of length `a`; `None` outside the cones or too close to their boundary.
    fn moved(&self, program: &Program<N>, step: &Direction<N>, a: f64) -> Option<Self> {
        let xi: Vec<f64> = self.xi.iter().zip(&step.xi).map(|(x, d)| x + a * d).collect();
        let slack: Vec<Square<N>> = program.cones.iter().map(|c| c.slack(&xi)).collect();
        let room: Vec<f64> = program.rays.iter().map(|r| r.slack(&xi)).collect();
        let mut links = self.links.clone();
        for (s, change) in links.iter_mut().zip(&step.links) {
            add_scaled(s, a, change);
        }
        let rays: Vec<f64> = self.rays.iter().zip(&step.rays).map(|(y, d)| y + a * d).collect();
        let next = Iterate { xi, slack, links, room, rays };
        let least = CENTRALITY * next.complementarity(program);
        for (x, s) in next.slack.iter().zip(&next.links) {
            if least_product(x, s)? < least {
                return None;
            }
        }
        let central = |(w, y): (&f64, &f64)| *w > 0.0 && *y > 0.0 && w * y >= least;
        next.room.iter().zip(&next.rays).all(central).then_some(next)
    }

    /// Certified gap of the point.
    fn gap(&self, program: &Program<N>) -> f64 {
        let bounds = &self.rays[program.lower.len()..];
        let links = (N != 4).then_some(self.links.as_slice());
        let equalities = self.equalities(program).unwrap_or_default();
        certificate::gap(program, &self.xi, bounds, &equalities, links).unwrap_or(f64::INFINITY)
    }

    /// Multipliers of the equalities that go with those of the cones.
    fn equalities(&self, program: &Program<N>) -> Option<Vec<f64>> {
        let plane = program.plane.as_ref()?;
        let mut cost = program.gradient(&self.xi)?;
        for (ray, y) in program.rays.iter().zip(&self.rays) {
            ray.terms.iter().for_each(|(k, f)| cost[*k] += y * f);
        }
        for (cone, s) in program.cones.iter().zip(&self.links) {
            cost[cone.first..].iter_mut().zip(cone.adjoint(s)).for_each(|(c, a)| *c -= a);
        }
        Some(plane.multipliers(&cost))
    }

    fn outcome(&self, gap: f64, iterations: usize, converged: bool) -> Outcome {
        let multipliers = self.links.iter().map(trace).chain(self.rays.iter().copied()).collect();
        Outcome { xi: self.xi.clone(), gap, iterations, multipliers, converged }
    }
}

/// Scalings of all cones at an iterate.
struct Scalings<const N: usize> {
    links: Vec<Scaling<N>>,
    /// `√(room · multiplier)` and `√(multiplier / room)` of each half-line.
    rays: Vec<(f64, f64)>,
}

impl<const N: usize> Scalings<N> {
    fn new(program: &Program<N>, at: &Iterate<N>) -> Option<Self> {
        let links = program
            .cones
            .iter()
            .zip(at.slack.iter().zip(&at.links))
            .map(|(cone, (x, s))| Scaling::new(cone, x, s))
            .collect::<Option<_>>()?;
        let rays = at.room.iter().zip(&at.rays).map(|(w, y)| ((w * y).sqrt(), (y / w).sqrt())).collect();
        Some(Scalings { links, rays })
    }

    /// Scaled targets `m d⁻¹ - c` of all cones.
    fn target(&self, m: f64, corrections: Option<&Direction<N>>) -> Target<N> {
        let links = self.links.iter().enumerate().map(|(i, scaling)| {
            let mut target = diagonal(scaling.d.map(|d| m / d));
            if let Some(step) = corrections {
                let (x, s) = (&step.scaled_slacks[i], &step.scaled_links[i]);
                let (xs, sx) = (product(x, s), product(s, x));
                for j in 0..N {
                    for k in 0..N {
                        target[j][k] -= (xs[j][k] + sx[j][k]) / (scaling.d[j] + scaling.d[k]);
                    }
                }
            }
            target
        });
        let rays = self.rays.iter().enumerate().map(|(k, (d, _))| {
            let correction = corrections.map_or(0.0, |s| s.scaled_room[k] * s.scaled_rays[k] / d);
            m / d - correction
        });
        Target { links: links.collect(), rays: rays.collect() }
    }
}

/// Minimises the program from a strictly consistent point, until `tolerance(F)` is not below the certified gap.
///
/// The result is strictly consistent whatever happens.
pub(super) fn solve<const N: usize>(
    program: &Program<N>,
    start: &[f64],
    tolerance: &dyn Fn(f64) -> f64,
) -> Outcome {
    let stuck = || Outcome {
        xi: start.to_vec(),
        gap: f64::INFINITY,
        iterations: 0,
        multipliers: vec![0.0; program.cones.len() + program.rays.len()],
        converged: false,
    };
    let Some(mut at) = Iterate::start(program, start) else { return stuck() };
    let quadratic = program.quadratic();
    let mut best: Option<Outcome> = None;
    let mut marks = Marks::default();
    let mut orthogonal = false;
    for iteration in 0..=MAX_ITERATIONS {
        let objective = program.objective(&at.xi).unwrap_or(f64::INFINITY);
        let gap = at.gap(program);
        let converged = gap <= tolerance(objective);
        if best.as_ref().is_none_or(|b| gap < b.gap) {
            best = Some(at.outcome(gap, iteration, converged));
        }
        if converged || marks.stalled(gap, objective, at.complementarity(program)) {
            break;
        }
        let next = match advance(program, &quadratic, &at, orthogonal) {
            None if !orthogonal => {
                orthogonal = true;
                advance(program, &quadratic, &at, true)
            }
            other => other,
        };
        let Some(next) = next else { break };
        at = next;
        // Rounding in the normal equations shows as a crawl long before it shows as a failure.
        orthogonal |= marks.idle > PATIENCE / 2;
    }
    let mut ended = best.unwrap_or_else(stuck);
    ended.converged &= ended.gap.is_finite();
    ended
}

/// Best figures so far and for how long none has improved.
#[derive(Default)]
struct Marks {
    best: Option<[f64; 3]>,
    idle: usize,
}

impl Marks {
    fn stalled(&mut self, gap: f64, objective: f64, mu: f64) -> bool {
        let now = [gap, objective, mu];
        let shares = [0.9, 0.8, 0.8];
        let Some(best) = &mut self.best else {
            self.best = Some(now);
            return false;
        };
        let better = (0..3).any(|k| now[k] < shares[k] * best[k]);
        for (b, x) in best.iter_mut().zip(now) {
            *b = b.min(x);
        }
        self.idle = if better { 0 } else { self.idle + 1 };
        self.idle >= PATIENCE
    }
}

/// One iteration: predictor, corrector, and where these are blocked a plain centring step.
fn advance<const N: usize>(
    program: &Program<N>,
    quadratic: &Mat,
    at: &Iterate<N>,
    orthogonal: bool,
) -> Option<Iterate<N>> {
    let scalings = Scalings::new(program, at)?;
    let newton = Newton::new(program, quadratic, &at.xi, &scalings, orthogonal)?;
    let mu = at.complementarity(program);
    let direction = |m: f64, corrections: Option<&Direction<N>>| {
        Direction::new(program, &newton, &at.xi, &scalings, &scalings.target(m, corrections))
    };
    let predictor = direction(0.0, None)?;
    let reach = (STEP * predictor.longest(&scalings)).min(1.0);
    let expected = predictor.complementarity(at, reach) / program.order().max(1) as f64;
    let sigma = (expected / mu).powi(3).clamp(1e-4, 1.0);
    let corrector = direction(sigma * mu, Some(&predictor))?;
    let stepped = |step: &Direction<N>| {
        let mut a = (STEP * step.longest(&scalings)).min(1.0);
        while a > 1e-8 {
            if let Some(next) = at.moved(program, step, a) {
                return Some((a, next));
            }
            a *= 0.8;
        }
        None
    };
    let first = stepped(&corrector);
    if let Some((a, next)) = first {
        if a >= 0.3 {
            return Some(next);
        }
        return Some(match stepped(&direction(0.5 * mu, None)?) {
            Some((b, centred)) if b > a => centred,
            _ => next,
        });
    }
    stepped(&direction(0.5 * mu, None)?).map(|(_, next)| next)
}
