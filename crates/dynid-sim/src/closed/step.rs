//! Stages of a step.

use super::integrator::ClosedIntegrator;
use crate::error::ForwardError;
use crate::integrator::{PlantState, mean};
use crate::lu::add_product;
use crate::rosenbrock::{ALPHA, EMBEDDED, GAMMA, GAMMAS, WEIGHTS};

/// Nodes and weights of the classical Runge-Kutta method.
const NODES: [f64; 4] = [0.0, 0.5, 0.5, 1.0];
const CLASSICAL: [f64; 4] = [1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0];

impl ClosedIntegrator<'_> {
    /// Takes the matrices that are held over the next step.
    pub(super) fn begin(
        &mut self,
        state: &PlantState,
        (drive, channels): (&[f64], &[f64]),
    ) -> Result<(), ForwardError> {
        let (plant, work, start) = (self.plant, &mut self.work, &mut self.start);
        let now = plant.elements().with_signals(channels, &state.history, None, (&state.q, &state.dq));
        if plant.loads.joints.is_empty() {
            plant.machine.free_at(&mut work.free, &state.q);
            plant.reduce(&state.q, work)?;
        } else {
            // Friction is as stiff as what presses on its joint.
            let at = (&state.q[..], &state.dq[..]);
            plant.acceleration(at, drive, &now, work, &mut self.acceleration)?;
        }
        start.basis.clear();
        start.basis.extend_from_slice(work.free.basis());
        start.reduced.clone_from(&work.reduced);
        let slopes = (&mut start.stiffness[..], &mut start.damping[..]);
        plant.stiffness_and_damping((&state.q, &state.dq), &now, work, slopes);
        let d = plant.machine.mobility();
        for (full, to) in
            [(&start.stiffness, &mut start.reduced_stiffness), (&start.damping, &mut start.reduced_damping)]
        {
            congruent(full, &start.basis, d, to);
        }
        Ok(())
    }

    /// Acceleration at a stage, from its displacement and rates, a time `step` after the start.
    fn evaluate(
        &mut self,
        from: &PlantState,
        (drive, channels): (&[f64], &[f64]),
        step: f64,
    ) -> Result<(), ForwardError> {
        let stage = &mut self.stage;
        stage.q.copy_from_slice(&from.q);
        self.plant.machine.displace(&mut stage.q, &stage.z);
        self.plant.machine.displacement_rates(&stage.z, &stage.dq, &mut stage.dz);
        let elements = self.plant.elements();
        let between = if elements.remember() { mean(&from.dq, &stage.dq) } else { Vec::new() };
        let step = (step > 0.0).then_some((step, between.as_slice()));
        let state = (&stage.q[..], &stage.dq[..]);
        let channels = elements.with_signals(channels, &from.history, step, state);
        self.evaluations += 1;
        self.plant.acceleration(state, drive, &channels, &mut self.work, &mut self.acceleration)
    }

    /// Power of drives and that taken by elements, at the last evaluation.
    fn powers(&self) -> [f64; 2] {
        let dq = &self.stage.dq;
        let driven = self.plant.machine.driven().iter().map(|r| dq[*r]);
        [
            self.work.delivered.iter().zip(driven).map(|(e, v)| e * v).sum(),
            self.work.element.iter().zip(dq).map(|(e, v)| e * v).sum(),
        ]
    }

    /// Tries a step with the matrices of [`ClosedIntegrator::begin`], up to its closed end, and gives its error in units of the
    /// tolerance.
    pub(super) fn attempt(
        &mut self,
        from: &PlantState,
        input: (&[f64], &[f64]),
        h: f64,
    ) -> Result<f64, ForwardError> {
        let (d, g) = (self.plant.machine.mobility(), h * GAMMA);
        let start = &mut self.start;
        let matrix: Vec<f64> = (0..d * d)
            .map(|k| start.reduced[k] + g * (start.reduced_damping[k] + g * start.reduced_stiffness[k]))
            .collect();
        if !start.lu.factor(d, &matrix) {
            return Ok(f64::INFINITY);
        }
        for (i, alpha) in ALPHA.iter().enumerate() {
            self.load(from, alpha);
            self.evaluate(from, input, h * alpha.iter().sum::<f64>())?;
            self.solve_stage(i, h);
        }
        self.sum(from, &WEIGHTS);
        let mut worst = 0.0_f64;
        for rate in 0..from.dq.len() {
            let error = |of: &dyn Fn(usize) -> f64| -> f64 {
                (0..WEIGHTS.len()).map(|s| (WEIGHTS[s] - EMBEDDED[s]) * of(s)).sum()
            };
            let error =
                self.relative(rate, error(&|s| self.stages[s].z[rate]), error(&|s| self.stages[s].dq[rate]));
            // `max` would drop a NaN.
            worst = if error.is_nan() { f64::INFINITY } else { worst.max(error) };
        }
        if worst <= 1.0 {
            self.finish(from, h)?;
        }
        Ok(worst)
    }

    /// State of a stage: that of the start and increments of stages before.
    fn load(&mut self, from: &PlantState, factors: &[f64]) {
        let stage = &mut self.stage;
        stage.z.fill(0.0);
        stage.dq.copy_from_slice(&from.dq);
        for (factor, k) in factors.iter().zip(&self.stages).filter(|(f, _)| **f != 0.0) {
            stage.z.iter_mut().zip(&k.z).for_each(|(z, k)| *z += factor * k);
            stage.dq.iter_mut().zip(&k.dq).for_each(|(v, k)| *v += factor * k);
        }
    }

    /// `(1 - hγJ) k = h f + h J Σ_j γ_ij k_j` with `J = [[0, 1], [-A K, -A D]]`, `A = Z (Zᵀ M Z)⁻¹ Zᵀ`: the increment of the
    /// rates is `h q̈ + Z u`.
    fn solve_stage(&mut self, i: usize, h: f64) {
        let (n, g) = (self.acceleration.len(), h * GAMMA);
        let (mut known_z, mut known_v) = (vec![0.0; n], vec![0.0; n]);
        for (factor, k) in GAMMAS[i].iter().zip(&self.stages[..i]) {
            known_z.iter_mut().zip(&k.z).for_each(|(x, k)| *x += factor * k);
            known_v.iter_mut().zip(&k.dq).for_each(|(x, k)| *x += factor * k);
        }
        // Displacements and rates that stiffness and damping act on, without the part along `u`.
        let (mut stiff, mut damped) = (vec![0.0; n], vec![0.0; n]);
        let along: Vec<f64> = known_v.iter().zip(&self.stage.dz).map(|(x, v)| h * (x + v)).collect();
        for k in 0..n {
            let free = h * self.acceleration[k];
            stiff[k] = h * known_z[k] + g * (along[k] + g * free);
            damped[k] = h * known_v[k] + g * free;
        }
        let start = &self.start;
        let mut effort = vec![0.0; n];
        add_product(&mut effort, 1.0, &start.stiffness, &stiff);
        add_product(&mut effort, 1.0, &start.damping, &damped);
        let d = self.plant.machine.mobility();
        let mut u = vec![0.0; d];
        for (row, e) in start.basis.chunks_exact(d).zip(&effort) {
            u.iter_mut().zip(row).for_each(|(u, z)| *u -= z * e);
        }
        start.lu.solve(&mut u);
        let powers = self.powers();
        let stage = &mut self.stages[i];
        stage.dq.iter_mut().zip(&self.acceleration).for_each(|(k, a)| *k = h * a);
        add_product(&mut stage.dq, 1.0, &start.basis, &u);
        for ((z, along), v) in stage.z.iter_mut().zip(&along).zip(&stage.dq) {
            *z = along + g * v;
        }
        stage.work = powers.map(|p| h * p);
    }

    /// A step of the classical method.
    pub(super) fn runge_kutta(
        &mut self,
        from: &PlantState,
        input: (&[f64], &[f64]),
        h: f64,
    ) -> Result<(), ForwardError> {
        for (i, node) in NODES.iter().enumerate() {
            let mut factors = [0.0; 4];
            if let Some(before) = i.checked_sub(1) {
                factors[before] = *node;
            }
            self.load(from, &factors);
            self.evaluate(from, input, h * node)?;
            let powers = self.powers();
            let (stage, at) = (&mut self.stages[i], &self.stage);
            stage.z.iter_mut().zip(&at.dz).for_each(|(k, v)| *k = h * v);
            stage.dq.iter_mut().zip(&self.acceleration).for_each(|(k, a)| *k = h * a);
            stage.work = powers.map(|p| h * p);
        }
        self.sum(from, &CLASSICAL);
        Ok(())
    }

    /// `self.next`: the start and weighted increments; positions off the closed poses by the error of the step.
    fn sum(&mut self, from: &PlantState, weights: &[f64; 4]) {
        let mut z = vec![0.0; from.dq.len()];
        self.next.clone_from(from);
        for (weight, k) in weights.iter().zip(&self.stages) {
            z.iter_mut().zip(&k.z).for_each(|(z, k)| *z += weight * k);
            self.next.dq.iter_mut().zip(&k.dq).for_each(|(v, k)| *v += weight * k);
            self.next.drive_work += weight * k.work[0];
            self.next.element_work += weight * k.work[1];
        }
        self.plant.machine.displace(&mut self.next.q, &z);
    }

    /// Closes the tried step and takes on what elements remember.
    pub(super) fn finish(&mut self, from: &PlantState, h: f64) -> Result<(), ForwardError> {
        let next = &mut self.next;
        self.plant.settle(&mut next.q, &mut next.dq, &mut self.work)?;
        let between = mean(&from.dq, &next.dq);
        self.plant.elements().pass(&mut next.history, h, (&next.q, &between));
        Ok(())
    }
}

/// `Zᵀ A Z` of a row-major square matrix.
fn congruent(full: &[f64], basis: &[f64], d: usize, to: &mut [f64]) {
    let n = basis.len() / d;
    to.fill(0.0);
    let mut row_product = vec![0.0; d];
    for (row, z) in full.chunks_exact(n).zip(basis.chunks_exact(d)) {
        if row.iter().all(|x| *x == 0.0) {
            continue;
        }
        row_product.fill(0.0);
        for (a, other) in row.iter().zip(basis.chunks_exact(d)) {
            row_product.iter_mut().zip(other).for_each(|(p, z)| *p += a * z);
        }
        for (k, z) in z.iter().enumerate() {
            to[k * d..(k + 1) * d].iter_mut().zip(&row_product).for_each(|(t, p)| *t += z * p);
        }
    }
}
