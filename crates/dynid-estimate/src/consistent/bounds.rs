//! A start that meets the bounds, or the bounds that exclude each other.

use dynid_linalg::Mat;
use dynid_model::symmetric::trace;

use super::cone::{LINK, Ray};
use super::interior;
use super::manifold::Manifold;
use super::problem::{Bound, Problem, ProblemError};
use super::program::Program;

/// Bounds must leave this much room, in whitened units.
const ROOM: f64 = 1e-9;
/// Multipliers above this share of the largest belong to the conflict.
const SHARE: f64 = 0.01;
/// Slack that [`lift`] seeks, in whitened units.
const LIFTED: f64 = 0.1;
/// Sweeps of [`lift`] over all half-lines of scalars.
const SWEEPS: usize = 100;
/// Pull towards the prior while a start is sought.
const PULL: f64 = 1e-8;
/// Weights of a distance from the plane of the equalities beside one nat of distance from the prior, while a start is sought.
const FORCES: [f64; 4] = [1e2, 1e4, 1e6, 1e8];

/// A strictly consistent start.
pub(super) struct Start {
    pub xi: Vec<f64>,
    pub iterations: usize,
}

/// The prior, or where it breaks a bound a point found by minimising the largest violation.
pub(super) fn start<const N: usize>(program: &Program<N>, problem: &Problem) -> Result<Start, ProblemError> {
    contradiction(&problem.bounds)?;
    let (xi, before) = match &program.plane {
        None => (inside(program), 0),
        Some(plane) => in_plane(program, plane, problem)?,
    };
    let bounds = &program.rays[program.lower.len()..];
    let worst = bounds.iter().map(|r| -r.slack(&xi)).fold(f64::NEG_INFINITY, f64::max);
    // A start that barely meets a bound is as bad as one that does not.
    if worst < -0.05 {
        return Ok(Start { xi, iterations: before });
    }
    let n = program.unknowns();
    // However far the bounds are, the pull must not outweigh a violation.
    let relaxed = relaxed(program, PULL / (1.0 + worst.max(0.0)).powi(2));
    let mut first = xi;
    first.push(worst.max(0.0) + 1.0);
    // (s + 1)² against 1 decides. A start needs most of the room there is and no more: the optimum itself lies on the
    // boundary. Names of a conflict need multipliers that have settled.
    let tolerance = |objective: f64| match objective - 1.0 {
        excess if excess < 0.0 => (-0.1 * excess).max(1e-9),
        excess => (1e-4 * excess).max(1e-9),
    };
    let ended = interior::solve(&relaxed, &first, &tolerance);
    let violation = ended.xi[n];
    if violation > -ROOM {
        return Err(ProblemError::Infeasible { conflict: conflict(program, problem, &ended), violation });
    }
    Ok(Start { xi: ended.xi[..n].to_vec(), iterations: before + ended.iterations })
}

/// A point of the plane inside the links' and scalars' own limits, and the iterations to it.
///
/// First the prior, brought into the plane. Where that is outside, the point whose distance from the plane is least beside the
/// entropic distance from the prior, which keeps it inside the cones, brought into the plane.
fn in_plane<const N: usize>(
    program: &Program<N>,
    plane: &Manifold,
    problem: &Problem,
) -> Result<(Vec<f64>, usize), ProblemError> {
    let own = |xi: &[f64]| {
        let within = program.rays[..program.lower.len()].iter().all(|r| r.slack(xi) > ROOM);
        within && program.cones.iter().all(|c| dynid_model::symmetric::least_eigenvalue(&c.slack(xi)) > ROOM)
    };
    let first = inside(program);
    let near = plane.project(&first);
    if own(&near) {
        return Ok((near, 0));
    }
    let n = program.unknowns();
    let zero = plane.residual(&vec![0.0; n]);
    let (mut xi, mut iterations) = (first, 0);
    // A plane that barely meets the cones asks for a greater force, which a start nearby can bear.
    for force in FORCES {
        let search = Program {
            a: Mat::from_fn(zero.len(), n, |i, k| force * plane.rows()[(i, k)]),
            b: zero.iter().map(|z| -force * z).collect(),
            data_rows: zero.len(),
            weight: vec![PULL; n],
            centre: program.centre.clone(),
            entropy: 1.0,
            cones: program.cones.clone(),
            rays: program.rays[..program.lower.len()].to_vec(),
            lower: program.lower.clone(),
            scalars: program.scalars.clone(),
            plane: None,
        };
        let tolerance = |objective: f64| (1e-4 * objective).max(1e-9);
        let ended = interior::solve(&search, &xi, &tolerance);
        iterations += ended.iterations;
        let near = plane.project(&ended.xi);
        if own(&near) {
            return Ok((near, iterations));
        }
        xi = ended.xi;
    }
    let residual = plane.residual(&xi);
    let violation = residual.iter().map(|r| r.abs()).fold(0.0, f64::max);
    // Where the plane is met, but on the boundary of the cones, no single equality is at fault.
    let named = problem.equalities.iter().zip(&residual).filter(|(_, r)| r.abs() >= SHARE * violation);
    Err(ProblemError::Infeasible { conflict: named.map(|(e, _)| e.name.clone()).collect(), violation })
}

/// The prior, moved inside the links' and scalars' own limits.
fn inside<const N: usize>(program: &Program<N>) -> Vec<f64> {
    let mut xi = program.centre.clone();
    for cone in &program.cones {
        // The prior is the unit matrix; the floor may be anything.
        let lift = 1.0 + trace(&cone.floor) / N as f64;
        for x in &mut xi[cone.first..cone.first + LINK] {
            *x *= lift;
        }
        while dynid_model::symmetric::least_eigenvalue(&cone.slack(&xi)) < 0.1 {
            xi[cone.first..cone.first + LINK].iter_mut().for_each(|x| *x *= 2.0);
        }
    }
    for (k, least) in &program.lower {
        xi[*k] = xi[*k].max(least + 1.0);
    }
    lift(program, &mut xi);
    xi
}

/// Moves scalars inside the half-lines that hold for scalars alone, by projection onto one after the other (Agmon 1954). Where
/// these leave no such room the start stays where that ends.
fn lift<const N: usize>(program: &Program<N>, xi: &mut [f64]) {
    let of_scalars = |ray: &&Ray| ray.terms.iter().all(|(k, _)| program.scalars.contains(k));
    let rays: Vec<&Ray> = program.rays.iter().filter(of_scalars).collect();
    for _ in 0..SWEEPS {
        let mut inside = true;
        for ray in &rays {
            let missing = LIFTED - ray.slack(xi);
            if missing > 0.0 {
                inside &= missing < 0.5 * LIFTED;
                let length: f64 = ray.terms.iter().map(|(_, f)| f * f).sum();
                ray.terms.iter().for_each(|(k, f)| xi[*k] -= f * missing / length);
            }
        }
        if inside {
            return;
        }
    }
}

/// `min (s + 1)² + pull` with every bound relaxed by `s`: the bounds can be met exactly if the optimum has `s < 0`.
fn relaxed<const N: usize>(program: &Program<N>, pull: f64) -> Program<N> {
    let n = program.unknowns();
    let rays = program.rays.iter().enumerate().map(|(k, ray)| {
        let mut terms = ray.terms.clone();
        if k >= program.lower.len() {
            terms.push((n, -1.0));
        }
        Ray { terms, upper: ray.upper }
    });
    let mut weight = vec![pull; n];
    weight.push(0.0);
    let mut centre = program.centre.clone();
    centre.push(0.0);
    let mut scalars = program.scalars.clone();
    scalars.push(n);
    Program {
        a: Mat::from_fn(1, n + 1, |_, j| if j == n { 1.0 } else { 0.0 }),
        b: vec![-1.0],
        data_rows: 1,
        weight,
        centre,
        entropy: 0.0,
        cones: program.cones.clone(),
        rays: rays.collect(),
        lower: program.lower.clone(),
        scalars,
        plane: program.plane.as_ref().map(Manifold::with_one_more),
    }
}

/// Names of the bounds, and of links and scalars whose own limits matter, by the size of their multipliers.
fn conflict<const N: usize>(
    program: &Program<N>,
    problem: &Problem,
    ended: &interior::Outcome,
) -> Vec<String> {
    let (own, bounds) = ended.multipliers.split_at(program.cones.len() + program.lower.len());
    let largest = bounds.iter().copied().fold(0.0, f64::max);
    let mut names: Vec<String> = problem
        .bounds
        .iter()
        .zip(bounds)
        .filter(|(_, y)| **y > SHARE * largest)
        .map(|(bound, _)| bound.name.clone())
        .collect();
    let positive = problem.scalars.iter().filter(|s| s.nonnegative);
    let links = problem.links.iter().map(|l| format!("link `{}` is a physical body", l.name));
    let limits = links.chain(positive.map(|s| format!("`{}` is not negative", s.name)));
    names.extend(limits.zip(own).filter(|(_, y)| **y > SHARE * largest).map(|(name, _)| name));
    names
}

/// Pairs of bounds on the same combination that leave nothing between them.
fn contradiction(bounds: &[Bound]) -> Result<(), ProblemError> {
    let normal = |bound: &Bound| {
        let mut terms = bound.terms.clone();
        terms.sort_by_key(|(column, _)| *column);
        terms
    };
    let normals: Vec<Vec<(usize, f64)>> = bounds.iter().map(normal).collect();
    for (i, (first, terms)) in bounds.iter().zip(&normals).enumerate() {
        for (second, others) in bounds[..i].iter().zip(&normals) {
            if terms.len() != others.len() || others[0].1 == 0.0 {
                continue;
            }
            let ratio = -terms[0].1 / others[0].1;
            let opposite = terms
                .iter()
                .zip(others)
                .all(|(a, b)| a.0 == b.0 && (a.1 + ratio * b.1).abs() <= 1e-12 * a.1.abs());
            if ratio > 0.0 && opposite && first.upper + ratio * second.upper < 0.0 {
                let (first, second) = (second.name.clone(), first.name.clone());
                return Err(ProblemError::Contradiction { first, second });
            }
        }
    }
    Ok(())
}
