//! How rates, accelerations and projections of a pose change with the motion of the independent coordinates.

use super::mechanism::ClosedMechanism;
use super::pose::PoseWorkspace;
use super::sweep::World;
use dynid_algebra::scalar::Dual;

/// Directions per pass.
const WIDTH: usize = 6;
type D = Dual<WIDTH>;

/// Sensitivities to be carried from all coordinates to the independent ones, at one pose.
pub(crate) struct Seeds<'a> {
    /// Rates and accelerations of all coordinates.
    pub(crate) dq: &'a [f64],
    pub(crate) ddq: &'a [f64],
    /// By positions, rates and accelerations of all coordinates.
    pub(crate) by_q: &'a [f64],
    pub(crate) by_dq: &'a [f64],
    pub(crate) by_ddq: &'a [f64],
    /// `(λ, w)`: multipliers of efforts, and rates that these efforts do work on: of `λᵀ J w` the change of `J` counts,
    /// with a minus.
    pub(crate) work: &'a [(Vec<f64>, Vec<f64>)],
}

/// Memory of [`ClosedMechanism::carry`].
pub(crate) struct CarryWorkspace {
    world: World<D>,
    q: Vec<D>,
    dq: Vec<D>,
    residual: Vec<D>,
    jacobian: Vec<D>,
    bias: Vec<D>,
    right: Vec<f64>,
    step: Vec<f64>,
    by_rates: Vec<f64>,
    by_accelerations: Vec<f64>,
}

impl ClosedMechanism {
    pub(crate) fn carry_workspace(&self) -> CarryWorkspace {
        let (m, n) = (self.rows.len(), self.tree.rates);
        let zero = Dual { value: 0.0, derivative: [0.0; WIDTH] };
        CarryWorkspace {
            world: World::new(&self.tree),
            q: vec![zero; self.tree.positions],
            dq: vec![zero; n],
            residual: vec![zero; m],
            jacobian: vec![zero; m * n],
            bias: vec![zero; m],
            right: vec![0.0; m],
            step: vec![0.0; self.dependent.len()],
            by_rates: vec![0.0; m],
            by_accelerations: vec![0.0; m],
        }
    }

    /// Writes the sensitivities to positions, rates and accelerations of the independent coordinates.
    ///
    /// The pose has its velocity map, and the rates are those of a motion through it. No joint may float.
    pub(crate) fn carry(
        &self,
        pose: &PoseWorkspace,
        seeds: &Seeds<'_>,
        work: &mut CarryWorkspace,
        [to_q, to_dq, to_ddq]: [&mut [f64]; 3],
    ) {
        let (n, d) = (self.tree.rates, self.independent.len());
        self.project(pose, seeds.by_q, to_q);
        self.project(pose, seeds.by_dq, to_dq);
        self.project(pose, seeds.by_ddq, to_ddq);
        let dependent = |by: &[f64]| -> Vec<f64> { self.dependent.iter().map(|r| by[*r]).collect() };
        self.multipliers(pose, &mut dependent(seeds.by_dq), &mut work.by_rates);
        self.multipliers(pose, &mut dependent(seeds.by_ddq), &mut work.by_accelerations);
        for first in (0..2 * d).step_by(WIDTH) {
            let directions = first..(first + WIDTH).min(2 * d);
            let along = |rate: usize, k: usize| pose.map[rate * d + k % d];
            for rate in 0..n {
                let mut derivative = [0.0; WIDTH];
                for k in directions.clone().filter(|k| *k < d) {
                    derivative[k - first] = along(rate, k);
                }
                let position = self.position_of[rate];
                work.q[position] = Dual { value: pose.q[position], derivative };
            }
            work.world.place(&self.tree, &work.q);
            self.rows.evaluate(&work.world, &work.q, &mut work.residual, &mut work.jacobian);
            let changed = |jacobian: &[D], row: usize, k: usize, rates: &[f64]| -> f64 {
                jacobian[row * n..(row + 1) * n].iter().zip(rates).map(|(j, v)| j.derivative[k] * v).sum()
            };
            for (v, value) in work.dq.iter_mut().zip(seeds.dq) {
                *v = Dual { value: *value, derivative: [0.0; WIDTH] };
            }
            for k in directions.clone() {
                if k >= d {
                    for (rate, v) in work.dq.iter_mut().enumerate() {
                        v.derivative[k - first] = along(rate, k);
                    }
                    continue;
                }
                for (row, b) in work.right.iter_mut().enumerate() {
                    *b = -changed(&work.jacobian, row, k - first, seeds.dq);
                }
                self.solve_dependent(&pose.factor, &mut work.right, &mut work.step);
                for (rate, x) in self.dependent.iter().zip(&work.step) {
                    work.dq[*rate].derivative[k - first] = *x;
                }
            }
            work.world.drift(&self.tree, &work.dq);
            self.rows.bias(&work.world, &mut work.bias);
            for k in directions {
                let mut sum = 0.0;
                for (row, b) in work.bias.iter().enumerate() {
                    sum += work.by_accelerations[row] * b.derivative[k - first];
                    if k < d {
                        let change = |rates| changed(&work.jacobian, row, k - first, rates);
                        sum += work.by_rates[row] * change(seeds.dq);
                        sum += work.by_accelerations[row] * change(seeds.ddq);
                        for (multipliers, rates) in seeds.work {
                            sum += multipliers[row] * change(rates);
                        }
                    }
                }
                let to = if k < d { &mut to_q[k] } else { &mut to_dq[k - d] };
                *to -= sum;
            }
        }
    }
}
