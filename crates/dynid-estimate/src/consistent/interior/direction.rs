//! Search directions in unknowns, slacks and multipliers.

use dynid_model::symmetric::{Square, inner};

use super::super::cone::{LINK, add_scaled, longest};
use super::super::program::Program;
use super::newton::{Newton, Target};
use super::{Iterate, Scalings};

/// Changes for a full step.
pub(super) struct Direction<const N: usize> {
    pub xi: Vec<f64>,
    pub scaled_slacks: Vec<Square<N>>,
    pub scaled_links: Vec<Square<N>>,
    pub links: Vec<Square<N>>,
    pub scaled_room: Vec<f64>,
    pub scaled_rays: Vec<f64>,
    pub rays: Vec<f64>,
}

impl<const N: usize> Direction<N> {
    /// `None` if the Newton system has no finite solution.
    pub(super) fn new(
        program: &Program<N>,
        newton: &Newton,
        xi: &[f64],
        scalings: &Scalings<N>,
        target: &Target<N>,
    ) -> Option<Self> {
        let change = newton.solve(program, xi, scalings, target)?;
        let mut out = Direction {
            scaled_slacks: Vec::with_capacity(program.cones.len()),
            scaled_links: Vec::with_capacity(program.cones.len()),
            links: Vec::with_capacity(program.cones.len()),
            scaled_room: Vec::with_capacity(program.rays.len()),
            scaled_rays: Vec::with_capacity(program.rays.len()),
            rays: Vec::with_capacity(program.rays.len()),
            xi: change,
        };
        for (i, (cone, scaling)) in program.cones.iter().zip(&scalings.links).enumerate() {
            let slack = scaling.scaled(&out.xi[cone.first..cone.first + LINK]);
            let mut multiplier = target.links[i];
            add_scaled(&mut multiplier, -1.0, &slack);
            for (k, d) in scaling.d.iter().enumerate() {
                multiplier[k][k] -= d;
            }
            out.links.push(scaling.unscaled_multiplier(&multiplier));
            out.scaled_slacks.push(slack);
            out.scaled_links.push(multiplier);
        }
        for (k, (ray, (d, ratio))) in program.rays.iter().zip(&scalings.rays).enumerate() {
            let room = -ratio * ray.along(&out.xi);
            let multiplier = target.rays[k] - d - room;
            out.rays.push(multiplier * ratio);
            out.scaled_room.push(room);
            out.scaled_rays.push(multiplier);
        }
        Some(out)
    }

    /// Longest step that stays in all cones, for slacks and multipliers alike.
    pub(super) fn longest(&self, scalings: &Scalings<N>) -> f64 {
        let mut a = f64::INFINITY;
        for (i, scaling) in scalings.links.iter().enumerate() {
            a = a.min(scaling.longest(&self.scaled_slacks[i])).min(scaling.longest(&self.scaled_links[i]));
        }
        for (k, (d, _)) in scalings.rays.iter().enumerate() {
            a = a.min(longest(self.scaled_room[k] / d)).min(longest(self.scaled_rays[k] / d));
        }
        a
    }

    /// `Σ ⟨X, S⟩` after a step of length `a` of a predictor, which removes all of it to first order.
    pub(super) fn complementarity(&self, at: &Iterate<N>, a: f64) -> f64 {
        let links = (0..self.links.len()).map(|i| {
            let second = inner(&self.scaled_slacks[i], &self.scaled_links[i]);
            (1.0 - a) * inner(&at.slack[i], &at.links[i]) + a * a * second
        });
        let rays = (0..self.rays.len()).map(|k| {
            let second = self.scaled_room[k] * self.scaled_rays[k];
            (1.0 - a) * at.room[k] * at.rays[k] + a * a * second
        });
        links.sum::<f64>() + rays.sum::<f64>()
    }
}
