//! Closed poses, and how all coordinates move there with the independent ones.

use super::bend::Bend;
use super::error::PoseError;
use super::factor::Factor;
use super::mechanism::ClosedMechanism;
use super::sweep::World;

/// Flatness of the factors below which the measure of singularity is worked out.
const DOUBTFUL: f64 = 10.0;

/// A closed pose and what belongs to it; reusable, the next pose is sought from the last one.
#[derive(Clone, Debug)]
pub struct PoseWorkspace {
    pub(super) world: World<f64>,
    /// Positions of all joints.
    pub(super) q: Vec<f64>,
    pub(super) residual: Vec<f64>,
    /// Row-major.
    pub(super) jacobian: Vec<f64>,
    pub(super) bias: Vec<f64>,
    /// Of the scaled Jacobian of the dependent coordinates at the pose.
    pub(super) factor: Factor,
    mode: Factor,
    /// `G`: change of every rate per independent rate, row-major `rates × mobility`.
    pub(super) map: Vec<f64>,
    /// `c`: accelerations while no independent coordinate accelerates.
    pub(super) drift: Vec<f64>,
    pub(super) right: Vec<f64>,
    pub(super) step: Vec<f64>,
    rights: Vec<f64>,
    steps: Vec<f64>,
    pub(super) bend: Bend,
    pub(super) before: Vec<f64>,
    pub(super) from: Vec<f64>,
    /// Newton steps of the last search.
    pub(super) iterations: usize,
    pub(super) at_home: bool,
}

impl PoseWorkspace {
    /// Positions of all joints.
    pub fn positions(&self) -> &[f64] {
        &self.q
    }

    /// `G = ∂q̇/∂q̇_i`, row-major, one row per rate of the tree; valid after [`ClosedMechanism::map`].
    pub fn velocity_map(&self) -> &[f64] {
        &self.map
    }

    /// Jacobian `J` of the closures by all rates, row-major, SI units.
    pub fn jacobian(&self) -> &[f64] {
        &self.jacobian
    }

    /// `b` in `Γ̈ = J q̈ + b`; valid after [`ClosedMechanism::drift`].
    pub fn bias(&self) -> &[f64] {
        &self.bias
    }

    /// Residuals of the closures at the pose, m or 1.
    pub fn residual(&self) -> &[f64] {
        &self.residual
    }

    /// Newton steps that the last pose took, all steps on the way to it together.
    pub fn iterations(&self) -> usize {
        self.iterations
    }
}

impl ClosedMechanism {
    /// A workspace at the home position.
    pub fn workspace(&self) -> PoseWorkspace {
        let (m, n, d) = (self.rows.len(), self.tree.rates, self.independent.len());
        let mut work = PoseWorkspace {
            world: World::new(&self.tree),
            q: self.home.clone(),
            residual: vec![0.0; m],
            jacobian: vec![0.0; m * n],
            bias: vec![0.0; m],
            factor: Factor::default(),
            mode: Factor::default(),
            map: vec![0.0; n * d],
            drift: vec![0.0; n],
            right: vec![0.0; m],
            step: vec![0.0; n - d],
            rights: vec![0.0; m * d],
            steps: vec![0.0; (n - d) * d],
            bend: Bend { by: vec![0.0; d], sum: vec![0.0; n - d], known: None },
            before: Vec::new(),
            from: Vec::new(),
            iterations: 0,
            at_home: false,
        };
        self.go_home(&mut work);
        work
    }

    /// Takes a workspace to the home position.
    pub fn go_home(&self, work: &mut PoseWorkspace) {
        if !work.at_home {
            work.q.copy_from_slice(&self.home);
            work.bend.known = None;
            self.evaluate(work);
            work.at_home = true;
        }
    }

    /// Takes a workspace to a closed pose: positions of all joints, as a motion or a file states them.
    ///
    /// # Errors
    /// Fails as [`ClosedMechanism::reach`] does; `q` may be off by rounding only, and dependent joints are corrected.
    ///
    /// # Panics
    /// If `q` has the wrong length.
    pub fn take(&self, work: &mut PoseWorkspace, q: &[f64]) -> Result<(), PoseError> {
        assert_eq!(q.len(), self.tree.positions, "length of q");
        if let Some(k) = q.iter().position(|x| !x.is_finite()) {
            return Err(PoseError::NotFinite { joint: self.joint_at(k) });
        }
        work.at_home = false;
        work.bend.known = None;
        work.q.copy_from_slice(q);
        work.iterations = 0;
        self.evaluate(work);
        match self.newton(work) {
            Some(_) => self.accept(work),
            None => Err(self.out_of_reach(work)),
        }
    }

    /// Residuals, Jacobian and its factors at the positions of the workspace.
    pub(super) fn evaluate(&self, work: &mut PoseWorkspace) {
        work.world.place(&self.tree, &work.q);
        self.rows.evaluate(&work.world, &work.q, &mut work.residual, &mut work.jacobian);
        let (n, jacobian) = (self.tree.rates, &work.jacobian);
        work.factor.factor(self.rows.len(), self.dependent.len(), |i, j| {
            let rate = self.dependent[j];
            jacobian[i * n + rate] * self.row_scale[i] / self.rate_scale[rate]
        });
    }

    /// Least-squares solution of `J_dependent x = right`, in SI units.
    pub(super) fn solve_dependent(&self, factor: &Factor, right: &mut [f64], x: &mut [f64]) {
        right.iter_mut().zip(&self.row_scale).for_each(|(b, s)| *b *= s);
        factor.solve(right, x);
        for (x, rate) in x.iter_mut().zip(&self.dependent) {
            *x /= self.rate_scale[*rate];
        }
    }

    pub(super) fn accept(&self, work: &mut PoseWorkspace) -> Result<(), PoseError> {
        if work.factor.flatness() < DOUBTFUL * self.least_measure {
            let found = self.singularity(work);
            if found.measure < self.least_measure {
                let (measure, motion) = (found.measure, found.motion);
                return Err(PoseError::Singular { measure, least: self.least_measure, motion });
            }
        }
        if self.mode_of(work) == self.mode { Ok(()) } else { Err(PoseError::OtherMode) }
    }

    /// Sign of the determinant of as many rows of the dependent Jacobian as it has columns.
    pub(super) fn mode_of(&self, work: &mut PoseWorkspace) -> f64 {
        if self.mode_rows.len() == self.rows.len() {
            return work.factor.sign();
        }
        let (n, jacobian) = (self.tree.rates, &work.jacobian);
        work.mode.factor(self.mode_rows.len(), self.dependent.len(), |i, j| {
            jacobian[self.mode_rows[i] * n + self.dependent[j]]
        });
        work.mode.sign()
    }

    /// Velocity map `G` at the pose; see [`PoseWorkspace::velocity_map`].
    pub fn map(&self, work: &mut PoseWorkspace) {
        let (n, d) = (self.tree.rates, self.independent.len());
        let PoseWorkspace { factor, rights, steps, map, jacobian, .. } = work;
        for ((row, b), s) in jacobian.chunks_exact(n).zip(rights.chunks_exact_mut(d)).zip(&self.row_scale) {
            b.iter_mut().zip(&self.independent).for_each(|(b, rate)| *b = -s * row[*rate]);
        }
        factor.solve_many(d, rights, steps);
        for (rate, x) in self.dependent.iter().zip(steps.chunks_exact(d)) {
            let scale = 1.0 / self.rate_scale[*rate];
            map[rate * d..][..d].iter_mut().zip(x).for_each(|(g, x)| *g = scale * x);
        }
        for (column, rate) in self.independent.iter().enumerate() {
            let row = &mut map[rate * d..][..d];
            row.fill(0.0);
            row[column] = 1.0;
        }
    }

    /// Rates `dq` of all coordinates and what remains of their accelerations, `c` in `q̈ = G q̈_i + c`; after
    /// [`ClosedMechanism::map`].
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn drift(&self, work: &mut PoseWorkspace, independent: &[f64], dq: &mut [f64]) {
        let d = self.independent.len();
        assert_eq!(independent.len(), d, "length of the independent rates");
        assert_eq!(dq.len(), self.tree.rates, "length of dq");
        for (v, row) in dq.iter_mut().zip(work.map.chunks_exact(d)) {
            *v = row.iter().zip(independent).map(|(g, v)| g * v).sum();
        }
        work.world.drift(&self.tree, dq);
        self.rows.bias(&work.world, &mut work.bias);
        for (right, b) in work.right.iter_mut().zip(&work.bias) {
            *right = -b;
        }
        let PoseWorkspace { factor, right, step, drift, .. } = work;
        self.solve_dependent(factor, right, step);
        drift.fill(0.0);
        for (r, x) in self.dependent.iter().zip(step) {
            drift[*r] = *x;
        }
    }

    /// Rates and accelerations of all coordinates from those of the independent ones, at the pose of the workspace.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn motion(
        &self,
        work: &mut PoseWorkspace,
        (rates, accelerations): (&[f64], &[f64]),
        dq: &mut [f64],
        ddq: &mut [f64],
    ) {
        let d = self.independent.len();
        assert_eq!(accelerations.len(), d, "length of the independent accelerations");
        assert_eq!(ddq.len(), self.tree.rates, "length of ddq");
        self.map(work);
        self.drift(work, rates, dq);
        for ((a, row), c) in ddq.iter_mut().zip(work.map.chunks_exact(d)).zip(&work.drift) {
            *a = c + row.iter().zip(accelerations).map(|(g, a)| g * a).sum::<f64>();
        }
    }

    pub(super) fn out_of_reach(&self, work: &PoseWorkspace) -> PoseError {
        let (closure, gap) = self.largest_gap(&work.residual);
        PoseError::OutOfReach { closure, gap }
    }
}
