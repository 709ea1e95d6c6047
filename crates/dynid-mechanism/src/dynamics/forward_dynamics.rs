//! Forward dynamics: accelerations from efforts.

use super::articulated_body::{self, ArticulatedWorkspace};
use super::{Dynamics, DynamicsWorkspace, State, fuse_all};
use dynid_algebra::scalar::{FusedTask, Scalar, run_fused};
use dynid_algebra::spatial::Vec3;

/// State of motion, and the efforts that act on it.
#[derive(Clone, Copy, Debug)]
pub struct LoadedState<'a, S> {
    /// Positions: rad, m; `x y z qx qy qz qw` for a floating joint.
    pub q: &'a [S],
    /// Rates.
    pub dq: &'a [S],
    /// Efforts that the rigid bodies and the added inertia feel, N m or N.
    pub effort: &'a [S],
    /// Acceleration of gravity in base axes, m/s²; `None`: the mechanism's.
    pub gravity: Option<Vec3<S>>,
}

/// Inertia in the space of the rates, besides that of the bodies: rotors behind gears.
#[derive(Clone, Copy, Debug)]
pub enum AddedInertia<'a, S> {
    /// None.
    None,
    /// One number per rate, kg m² or kg.
    Diagonal(&'a [S]),
    /// A symmetric matrix, row-major: motors that several joints share.
    Full(&'a [S]),
}

/// No finite acceleration answers an effort.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the inertia that rate {rate} moves is not positive")]
pub struct NotPositive {
    /// First such rate that was met.
    pub rate: usize,
}

/// Memory of [`Dynamics::forward_dynamics`], reusable from sample to sample.
#[derive(Clone, Debug)]
pub struct ForwardDynamicsWorkspace<S: Scalar> {
    plain: ArticulatedWorkspace<S>,
    fused: ArticulatedWorkspace<S::Fused>,
    /// Positions, rates, efforts, added inertia, accelerations.
    buffers: [Vec<S::Fused>; 5],
    inverse: DynamicsWorkspace<S>,
    mass: Vec<S>,
    /// Zeros, a unit acceleration, its efforts.
    rates: [Vec<S>; 3],
}

impl Dynamics {
    /// Memory for [`Dynamics::forward_dynamics`].
    pub fn forward_workspace<S: Scalar>(&self) -> ForwardDynamicsWorkspace<S> {
        let (n, zero) = (self.rates, S::zero());
        let joints = self.tree.rates;
        ForwardDynamicsWorkspace {
            plain: ArticulatedWorkspace::new(&self.tree),
            fused: ArticulatedWorkspace::new(&self.tree),
            buffers: [self.tree.positions, joints, joints, joints, joints].map(|n| vec![zero.fuse(); n]),
            inverse: self.workspace(),
            mass: vec![zero; n * n],
            rates: [vec![zero; n], vec![zero; n], vec![zero; n]],
        }
    }

    /// Acceleration of a rate per effort on it at rest without gravity, all other rates free: entry `rate` of the diagonal of `(M(q) + added)⁻¹`, 1/(kg m²) or
    /// 1/kg.
    ///
    /// # Errors
    /// As [`Dynamics::forward_dynamics`].
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn mobility(
        &self,
        q: &[f64],
        inertias: &[f64],
        added: AddedInertia<'_, f64>,
        rate: usize,
    ) -> Result<f64, NotPositive> {
        let (still, mut ddq) = (vec![0.0; self.rates], vec![0.0; self.rates]);
        let mut effort = still.clone();
        effort[rate] = 1.0;
        let state = LoadedState { q, dq: &still, effort: &effort, gravity: Some(Vec3::zero()) };
        self.forward_dynamics(&state, inertias, added, &mut self.forward_workspace(), &mut ddq)?;
        Ok(ddq[rate])
    }

    /// Accelerations `q̈` with `(M(q) + added) q̈ + h(q, q̇) = effort`: the inverse of [`Dynamics::inverse_dynamics`].
    ///
    /// `inertias`: ten standard parameters per body in file order. Trees without coupled joints and without a full added
    /// inertia go through the articulated-body algorithm, in time proportional to the number of bodies; the others
    /// through the mass matrix and its triangular factors. Over dual numbers the derivatives are exact.
    ///
    /// # Errors
    /// [`NotPositive`] if a pivot is not positive; `ddq` is then without meaning.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn forward_dynamics<S: Scalar>(
        &self,
        state: &LoadedState<'_, S>,
        inertias: &[S],
        added: AddedInertia<'_, S>,
        work: &mut ForwardDynamicsWorkspace<S>,
        ddq: &mut [S],
    ) -> Result<(), NotPositive> {
        let n = self.rates;
        assert_eq!(state.q.len(), self.positions, "length of q");
        assert_eq!(state.dq.len(), n, "length of dq");
        assert_eq!(state.effort.len(), n, "length of effort");
        assert_eq!(inertias.len(), 10 * self.bodies, "length of inertias");
        assert_eq!(ddq.len(), n, "length of ddq");
        let diagonal: &[S] = match added {
            AddedInertia::None => &[],
            AddedInertia::Diagonal(d) => {
                assert_eq!(d.len(), n, "length of the added inertia");
                d
            }
            AddedInertia::Full(m) => {
                assert_eq!(m.len(), n * n, "length of the added inertia");
                return self.through_mass_matrix(state, inertias, added, work, ddq);
            }
        };
        if self.follows.is_some() {
            return self.through_mass_matrix(state, inertias, added, work, ddq);
        }
        let mut fault = None;
        let gravity = self.gravity_or(state.gravity);
        let fault_found = &mut fault;
        let task = AccelerationTask {
            dynamics: self,
            state,
            gravity,
            inertias,
            diagonal,
            work,
            ddq,
            fault: fault_found,
        };
        run_fused(task);
        fault.map_or(Ok(()), |rate| Err(NotPositive { rate }))
    }

    fn through_mass_matrix<S: Scalar>(
        &self,
        state: &LoadedState<'_, S>,
        inertias: &[S],
        added: AddedInertia<'_, S>,
        work: &mut ForwardDynamicsWorkspace<S>,
        ddq: &mut [S],
    ) -> Result<(), NotPositive> {
        let n = self.rates;
        let ForwardDynamicsWorkspace { inverse, mass, rates: [rest, unit, column], .. } = work;
        let q = state.q;
        let drifting = State { q, dq: state.dq, ddq: rest, gravity: state.gravity };
        self.inverse_dynamics(&drifting, inertias, inverse, column);
        for (a, (e, h)) in ddq.iter_mut().zip(state.effort.iter().zip(&*column)) {
            *a = *e - *h;
        }
        for k in 0..n {
            unit.fill(S::zero());
            unit[k] = S::one();
            let pushed = State { q, dq: rest, ddq: unit, gravity: Some(Vec3::zero()) };
            self.inverse_dynamics(&pushed, inertias, inverse, column);
            for (row, value) in column.iter().enumerate() {
                mass[row * n + k] = *value;
            }
        }
        match added {
            AddedInertia::None => {}
            AddedInertia::Diagonal(d) => d.iter().enumerate().for_each(|(k, x)| mass[k * (n + 1)] += *x),
            AddedInertia::Full(m) => mass.iter_mut().zip(m).for_each(|(a, b)| *a += *b),
        }
        solve_positive(mass, ddq)
    }

    fn gravity_or<S: Scalar>(&self, gravity: Option<Vec3<S>>) -> Vec3<S> {
        gravity.unwrap_or_else(|| Vec3::constant(self.gravity.0))
    }
}

/// Solves `A x = b` in place for a symmetric positive definite `A = L D Lᵀ` (row-major, overwritten).
///
/// Without square roots, so that it runs on every [`Scalar`].
fn solve_positive<S: Scalar>(a: &mut [S], x: &mut [S]) -> Result<(), NotPositive> {
    let n = x.len();
    for j in 0..n {
        let pivot = a[j * n + j];
        if !pivot.is_positive_finite() {
            return Err(NotPositive { rate: j });
        }
        let inverse = pivot.recip();
        for i in j + 1..n {
            let factor = a[i * n + j] * inverse;
            for k in j + 1..=i {
                let product = factor * a[k * n + j];
                a[i * n + k] = a[i * n + k] - product;
            }
            x[i] = x[i] - factor * x[j];
        }
        // The column is needed unscaled above and scaled from here on.
        for i in j + 1..n {
            a[i * n + j] = a[i * n + j] * inverse;
        }
        x[j] = x[j] * inverse;
    }
    for j in (0..n).rev() {
        for i in j + 1..n {
            x[j] = x[j] - a[i * n + j] * x[i];
        }
    }
    Ok(())
}

struct AccelerationTask<'a, S: Scalar> {
    dynamics: &'a Dynamics,
    state: &'a LoadedState<'a, S>,
    gravity: Vec3<S>,
    inertias: &'a [S],
    /// Empty: none.
    diagonal: &'a [S],
    work: &'a mut ForwardDynamicsWorkspace<S>,
    ddq: &'a mut [S],
    fault: &'a mut Option<usize>,
}

impl<S: Scalar> FusedTask for AccelerationTask<'_, S> {
    #[inline(always)]
    fn fused(self) {
        let tree = &self.dynamics.tree;
        let ForwardDynamicsWorkspace { fused, buffers: [q, dq, effort, added, ddq], .. } = self.work;
        fuse_all(self.state.q, q);
        fuse_all(self.state.dq, dq);
        fuse_all(self.state.effort, effort);
        fuse_all(self.diagonal, added);
        fused.load_inertias(tree, self.inertias, S::fuse);
        let gravity = Vec3(self.gravity.0.map(S::fuse));
        let none = self.diagonal.is_empty();
        let added = |rate: usize| if none { S::zero().fuse() } else { added[rate] };
        *self.fault = articulated_body::sweep(tree, (q, dq, effort), gravity, added, fused, ddq);
        for (to, from) in self.ddq.iter_mut().zip(ddq) {
            *to = S::unfuse(*from);
        }
    }

    fn plain(self) {
        let tree = &self.dynamics.tree;
        let plain = &mut self.work.plain;
        plain.load_inertias(tree, self.inertias, |x| x);
        let added = |rate: usize| self.diagonal.get(rate).copied().unwrap_or_else(S::zero);
        let state = (self.state.q, self.state.dq, self.state.effort);
        *self.fault = articulated_body::sweep(tree, state, self.gravity, added, plain, self.ddq);
    }
}
