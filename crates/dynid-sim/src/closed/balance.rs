//! Friction that follows reactions: accelerations, multipliers, forces on joints and friction of one instant go together.

use dynid_model::{LoadGroup, Reaction};

use super::plant::{ClosedPlant, ClosedWorkspace};
use crate::error::ForwardError;
use crate::lu::Lu;

/// Change of forces, as a share of the largest, at which they are settled; and where rounding keeps it from falling.
const SETTLED: f64 = 1e-12;
const STALLED: f64 = 1e-10;
const ROUNDS: usize = 50;
/// Share of a change that the next may have before Newton's method takes over.
const CONTRACTION: f64 = 0.9;
/// Change of a force for differences, as a share of the largest.
const DIFFERENCE: f64 = 1e-6;

impl ClosedPlant {
    /// Forces on the joints in a motion with given multipliers, at positions that `work.free` was taken to.
    pub(super) fn press(
        &self,
        motion: [&[f64]; 3],
        multipliers: &[f64],
        work: &mut ClosedWorkspace,
    ) -> Vec<f64> {
        let loads = &self.loads;
        let mut wrenches: Vec<[f64; 6]> = Vec::with_capacity(loads.bodies.len());
        if !loads.bodies.is_empty() {
            self.rigid_effort(motion, &mut work.dynamics, &mut work.column);
            for body in &loads.bodies {
                let mut wrench = self.dynamics.joint_wrench(*body, &work.dynamics);
                let carried = self.machine.condition_wrenches(&work.free, *body);
                for (w, row) in wrench.iter_mut().zip(carried.chunks_exact(multipliers.len().max(1))) {
                    *w -= row.iter().zip(multipliers).map(|(c, l)| c * l).sum::<f64>();
                }
                wrenches.push(wrench);
            }
        }
        let component = |reaction: &Reaction| match reaction {
            Reaction::Multiplier { condition } => multipliers[*condition],
            Reaction::Joint { body, component } => {
                loads.bodies.binary_search(body).map_or(0.0, |k| wrenches[k][*component])
            }
        };
        let length = |g: &LoadGroup| g.components.iter().map(|c| component(c).powi(2)).sum::<f64>().sqrt();
        loads.joints.iter().map(|j| j.groups.iter().map(|g| g.factor * length(g)).sum()).collect()
    }

    /// Forces on the joints that `round` gives back when friction follows them, from the last ones on: by fixed point, then by
    /// Newton's method.
    ///
    /// # Errors
    /// [`ForwardError::SelfLocking`], and those of `round`.
    pub(super) fn balance(
        &self,
        work: &mut ClosedWorkspace,
        mut round: impl FnMut(&[f64], &mut ClosedWorkspace) -> Result<Vec<f64>, ForwardError>,
    ) -> Result<(), ForwardError> {
        let mut forces = work.forces.clone();
        if forces.iter().any(|f| !f.is_finite()) {
            forces.fill(0.0);
        }
        let mut last = f64::INFINITY;
        let mut result = Err(());
        for _ in 0..ROUNDS {
            let next = round(&forces, work)?;
            let change = difference(&next, &forces);
            forces = next;
            if change <= SETTLED || (change <= STALLED && change > 0.5 * last) {
                result = Ok(());
                break;
            }
            if change > CONTRACTION * last || !change.is_finite() {
                break;
            }
            last = change;
        }
        if result.is_err() {
            forces = self.newton(forces, work, &mut round)?;
        }
        work.forces = forces;
        Ok(())
    }

    /// Newton's method on `F - round(F)`, with differences for the derivative and half steps where it grows.
    fn newton(
        &self,
        mut forces: Vec<f64>,
        work: &mut ClosedWorkspace,
        round: &mut impl FnMut(&[f64], &mut ClosedWorkspace) -> Result<Vec<f64>, ForwardError>,
    ) -> Result<Vec<f64>, ForwardError> {
        let n = forces.len();
        let mut lu = Lu::default();
        if forces.iter().any(|f| !f.is_finite()) {
            forces.fill(0.0);
        }
        let mut image = round(&forces, work)?;
        for _ in 0..ROUNDS {
            let gap = difference(&image, &forces);
            if gap <= STALLED {
                return Ok(image);
            }
            let scale = forces.iter().chain(&image).fold(1e-12_f64, |m, x| m.max(x.abs()));
            let mut matrix = vec![0.0; n * n];
            for k in 0..n {
                let mut moved = forces.clone();
                moved[k] += DIFFERENCE * scale;
                for (row, (m, i)) in round(&moved, work)?.iter().zip(&image).enumerate() {
                    matrix[row * n + k] = f64::from(u8::from(row == k)) - (m - i) / (DIFFERENCE * scale);
                }
            }
            let mut step: Vec<f64> = image.iter().zip(&forces).map(|(i, f)| i - f).collect();
            if !lu.factor(n, &matrix) {
                break;
            }
            lu.solve(&mut step);
            let absolute = |image: &[f64], forces: &[f64]| -> f64 {
                image.iter().zip(forces).map(|(i, f)| (i - f).abs()).fold(0.0, f64::max)
            };
            let before = absolute(&image, &forces);
            let mut part = 1.0;
            loop {
                let trial: Vec<f64> =
                    forces.iter().zip(&step).map(|(f, s)| (f + part * s).max(0.0)).collect();
                let next = round(&trial, work)?;
                if absolute(&next, &trial) < before {
                    (forces, image) = (trial, next);
                    break;
                }
                part *= 0.5;
                if part < 1e-3 {
                    return Err(self.locked(&image, &forces));
                }
            }
        }
        Err(self.locked(&image, &forces))
    }

    fn locked(&self, image: &[f64], forces: &[f64]) -> ForwardError {
        let change = |k: usize| (image[k] - forces[k]).abs();
        let worst = (0..forces.len()).fold(0, |m, k| if change(k) > change(m) { k } else { m });
        ForwardError::SelfLocking { joint: self.loads.joints[worst].name.clone() }
    }
}

/// Largest change, as a share of the largest force.
fn difference(next: &[f64], forces: &[f64]) -> f64 {
    // Not `max`, which would lose what is not a number.
    let worst = |values: &mut dyn Iterator<Item = f64>| {
        values.fold(0.0_f64, |m, x| if x > m || x.is_nan() { x } else { m })
    };
    let change = worst(&mut next.iter().zip(forces).map(|(a, b)| (a - b).abs()));
    let largest = worst(&mut next.iter().map(|x| x.abs()));
    if change == 0.0 { 0.0 } else { change / largest }
}
