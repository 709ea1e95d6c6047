//! Conditions at any positions, and the motions that they leave free.

use super::factor::Factor;
use super::mechanism::ClosedMechanism;
use super::sweep::World;

/// Conditions at positions that need not be closed, and a basis of the motions that they leave free; reusable.
///
/// Neither driven nor independent coordinates are looked at, so that the basis also exists where these lose control. Angles
/// count as lengths by `L_c` wherever something is shortest or orthonormal.
#[derive(Clone, Debug)]
pub struct FreeMotions {
    world: World<f64>,
    residual: Vec<f64>,
    jacobian: Vec<f64>,
    bias: Vec<f64>,
    row_scale: Vec<f64>,
    rate_scale: Vec<f64>,
    /// Of the transposed Jacobian in lengths, to the usual rank.
    factor: Factor,
    /// Of what remains of it, transposed, where rows repeat each other.
    across: Factor,
    basis: Vec<f64>,
}

impl FreeMotions {
    /// Residuals of the conditions, m or 1.
    pub fn residual(&self) -> &[f64] {
        &self.residual
    }

    /// Jacobian `J` of the conditions by all rates, row-major, SI units.
    pub fn jacobian(&self) -> &[f64] {
        &self.jacobian
    }

    /// `b` in `Γ̈ = J q̈ + b`; valid after [`ClosedMechanism::bias_at`].
    pub fn bias(&self) -> &[f64] {
        &self.bias
    }

    /// `Z` with `J Z = 0`, row-major, one row per rate and one column per free motion; orthonormal in lengths.
    pub fn basis(&self) -> &[f64] {
        &self.basis
    }

    /// Largest residual, m.
    pub fn gap(&self) -> f64 {
        let size = |(r, s): (&f64, &f64)| (r * s).abs();
        // Not `max`, which would lose what is not a number.
        self.residual
            .iter()
            .zip(&self.row_scale)
            .map(size)
            .fold(0.0, |m, x| if x > m || x.is_nan() { x } else { m })
    }

    /// A cheap stand-in for `σ_r/σ_max` of the Jacobian at its usual rank `r`: 0 where the mobility changes.
    pub fn regularity(&self) -> f64 {
        self.factor.flatness()
    }

    /// The shortest `x` with `J x = right`; of rows that repeat each other some are not looked at.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn shortest(&self, right: &[f64], x: &mut [f64]) {
        assert_eq!(right.len(), self.row_scale.len(), "length of the right-hand side");
        let scaled: Vec<f64> = right.iter().zip(&self.row_scale).map(|(b, s)| b * s).collect();
        self.factor.solve_transposed(&scaled, x);
        x.iter_mut().zip(&self.rate_scale).for_each(|(x, s)| *x /= s);
    }

    /// The shortest multipliers with `Jᵀ λ` nearest to `effort`: N and N m per `L_c` count alike.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn multipliers(&self, effort: &[f64], multipliers: &mut [f64]) {
        assert_eq!(effort.len(), self.rate_scale.len(), "length of the efforts");
        let mut scaled: Vec<f64> = effort.iter().zip(&self.rate_scale).map(|(t, s)| t / s).collect();
        let rank = self.rate_scale.len() - self.mobility();
        if rank == multipliers.len() {
            self.factor.solve(&mut scaled, multipliers);
        } else {
            self.factor.turn(&mut scaled);
            let mut ordered = vec![0.0; multipliers.len()];
            self.across.solve_transposed(&scaled[..rank], &mut ordered);
            for (pivot, value) in self.factor.pivots().iter().zip(ordered) {
                multipliers[*pivot] = value;
            }
        }
        multipliers.iter_mut().zip(&self.row_scale).for_each(|(l, s)| *l *= s);
    }

    fn mobility(&self) -> usize {
        self.basis.len() / self.rate_scale.len()
    }
}

impl ClosedMechanism {
    /// Conditions and free motions at home.
    pub fn free_motions(&self) -> FreeMotions {
        let (m, n, d) = (self.rows.len(), self.tree.rates, self.independent.len());
        let mut free = FreeMotions {
            world: World::new(&self.tree),
            residual: vec![0.0; m],
            jacobian: vec![0.0; m * n],
            bias: vec![0.0; m],
            row_scale: self.row_scale.clone(),
            rate_scale: self.rate_scale.clone(),
            factor: Factor::default(),
            across: Factor::default(),
            basis: vec![0.0; n * d],
        };
        self.free_at(&mut free, &self.home);
        free
    }

    /// Takes conditions and free motions to positions of all joints.
    ///
    /// # Panics
    /// If `q` has the wrong length.
    pub fn free_at(&self, free: &mut FreeMotions, q: &[f64]) {
        let (m, n, d) = (self.rows.len(), self.tree.rates, self.independent.len());
        assert_eq!(q.len(), self.tree.positions, "length of q");
        let FreeMotions { world, residual, jacobian, factor, across, basis, .. } = free;
        world.place(&self.tree, q);
        self.rows.evaluate(world, q, residual, jacobian);
        let rank = n - d;
        factor.factor_to(rank, (n, m), |i, j| jacobian[j * n + i] * self.row_scale[j] / self.rate_scale[i]);
        if rank < m {
            across.factor(m, rank, |i, j| factor.upper(j, i));
        }
        let mut unit = vec![0.0; n];
        for k in 0..d {
            unit.fill(0.0);
            unit[rank + k] = 1.0;
            factor.turn_back(&mut unit);
            for (rate, (x, scale)) in unit.iter().zip(&self.rate_scale).enumerate() {
                basis[rate * d + k] = x / scale;
            }
        }
    }

    /// Takes the bias to rates of all coordinates, which the conditions need not allow; after
    /// [`ClosedMechanism::free_at`].
    ///
    /// # Panics
    /// If `dq` has the wrong length.
    pub fn bias_at(&self, free: &mut FreeMotions, dq: &[f64]) {
        assert_eq!(dq.len(), self.tree.rates, "length of dq");
        free.world.drift(&self.tree, dq);
        self.rows.bias(&free.world, &mut free.bias);
    }

    /// The wrench that unit multipliers exert on what hangs on the joint of a body: force (N) then moment about the joint
    /// frame's origin (N m), axes of the joint frame; row-major, six rows, one column per condition. The joint carries
    /// what the motion of the tree needs less this.
    ///
    /// # Panics
    /// If there is no such body.
    pub fn condition_wrenches(&self, free: &FreeMotions, body: usize) -> Vec<f64> {
        let (hanging, conditions) = (self.hanging(body), self.rows.len());
        let mut out = vec![0.0; 6 * conditions];
        for (component, row) in out.chunks_exact_mut(conditions.max(1)).enumerate() {
            self.closure_entries_at(&free.world, &hanging, component, row);
        }
        out
    }
}
