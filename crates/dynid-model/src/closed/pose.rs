//! Closed poses: Newton's method, and continuation from pose to pose (spec/mechanisms.md section 11).

use super::bend::{Bend, float};
use super::error::{NamedMotion, PoseError};
use super::factor::Factor;
use super::mechanism::ClosedMechanism;
use super::sweep::World;

/// Residual at which a pose counts as closed, m.
const CLOSED: f64 = 1e-14;
/// The same where rounding keeps it from falling further.
const STALLED: f64 = 1e-11;
const ITERATIONS: usize = 12;
/// Longest step of a coordinate between two poses, m (or rad times `L_c`).
const LONGEST: f64 = 0.5;
/// Correction that a predicted pose may need, as a share of the step and beyond it.
const CORRECTION: (f64, f64) = (0.3, 1e-3);
/// Smallest part of the way to a pose that is tried.
const SHORTEST: f64 = 1.0 / 65536.0;
/// Flatness of the factors below which the measure of singularity is worked out.
const DOUBTFUL: f64 = 10.0;

/// A closed pose and what belongs to it; reusable, the next pose is sought from the last one.
#[derive(Clone, Debug)]
pub struct PoseWorkspace {
    pub(super) world: World<f64>,
    /// Positions of all joints.
    pub(super) q: Vec<f64>,
    residual: Vec<f64>,
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
    right: Vec<f64>,
    step: Vec<f64>,
    rights: Vec<f64>,
    steps: Vec<f64>,
    bend: Bend,
    before: Vec<f64>,
    from: Vec<f64>,
    /// Newton steps of the last search.
    iterations: usize,
    at_home: bool,
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

    /// `c` in `q̈ = G q̈_i + c`; valid after [`ClosedMechanism::drift`].
    pub fn acceleration_drift(&self) -> &[f64] {
        &self.drift
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
    /// As [`ClosedMechanism::reach`]; `q` may be off by rounding only, and dependent joints are corrected.
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

    /// Takes a workspace from its pose to the one with other positions of the independent coordinates, in short steps
    /// along the straight line between them.
    ///
    /// # Errors
    /// [`PoseError`]; the workspace then stays at its pose.
    ///
    /// # Panics
    /// If `independent` has the wrong length.
    pub fn reach(&self, work: &mut PoseWorkspace, independent: &[f64]) -> Result<(), PoseError> {
        assert_eq!(independent.len(), self.independent.len(), "length of the independent positions");
        if let Some(k) = independent.iter().position(|x| !x.is_finite()) {
            return Err(PoseError::NotFinite { joint: self.rate_name(self.independent[k]) });
        }
        let mut start = std::mem::take(&mut work.before);
        start.clone_from(&work.q);
        work.at_home = false;
        work.iterations = 0;
        let result = self.follow(work, &start, independent);
        if result.is_err() {
            work.q.copy_from_slice(&start);
            self.evaluate(work);
        }
        work.before = start;
        result
    }

    fn follow(&self, work: &mut PoseWorkspace, start: &[f64], target: &[f64]) -> Result<(), PoseError> {
        let mut done = 0.0;
        let way = self
            .independent
            .iter()
            .zip(target)
            .map(|(r, to)| (to - start[self.position_of[*r]]).abs() * self.rate_scale[*r])
            .fold(0.0, f64::max);
        let mut part: f64 = (LONGEST / way).min(1.0);
        let mut from = std::mem::take(&mut work.from);
        let result = loop {
            let next = if done + part >= 1.0 - 1e-9 { 1.0 } else { done + part };
            from.clone_from(&work.q);
            if self.try_step(work, start, target, next) {
                if next >= 1.0 {
                    break self.accept(work);
                }
                done = next;
                part *= 2.0;
                continue;
            }
            part *= 0.5;
            let fault = if part < SHORTEST { Some(self.out_of_reach(work)) } else { None };
            work.q.copy_from_slice(&from);
            self.evaluate(work);
            if let Some(fault) = fault {
                // A pose next to a singular one is refused as that.
                break self.accept(work).and(Err(fault));
            }
        };
        work.from = from;
        result
    }

    /// One predictor step and its correction; false if the pose is not plainly the continuation of the last.
    fn try_step(&self, work: &mut PoseWorkspace, start: &[f64], target: &[f64], next: f64) -> bool {
        let n = self.tree.rates;
        work.right.fill(0.0);
        let target = self.independent.iter().zip(target).map(|(r, to)| {
            let from = start[self.position_of[*r]];
            if next >= 1.0 { *to } else { from + next * (to - from) }
        });
        let by = target.clone().zip(&self.independent).map(|(at, r)| at - work.q[self.position_of[*r]]);
        let ratio = work.bend.ratio(by.clone());
        work.bend.by.clear();
        work.bend.by.extend(by);
        for (r, by) in self.independent.iter().zip(&work.bend.by) {
            for (row, b) in work.right.iter_mut().enumerate() {
                *b -= work.jacobian[row * n + r] * by;
            }
        }
        for (r, at) in self.independent.iter().zip(target) {
            work.q[self.position_of[*r]] = at;
        }
        let predicted = self.solve_step(work);
        match ratio {
            Some(ratio) => {
                for (x, sum) in work.step.iter_mut().zip(&mut work.bend.sum) {
                    *sum *= ratio;
                    *x += *sum;
                }
            }
            None => work.bend.sum.fill(0.0),
        }
        work.bend.known = None;
        if predicted > LONGEST || predicted.is_nan() {
            return false;
        }
        self.apply_step(work, 1.0);
        self.evaluate(work);
        let good = match self.newton(work) {
            Some(corrected) => {
                corrected <= CORRECTION.0 * predicted + CORRECTION.1 && self.mode_of(work) == self.mode
            }
            None => false,
        };
        let squared: f64 = work.bend.by.iter().map(|x| x * x).sum();
        work.bend.known = (good && squared > 0.0).then_some(squared);
        good
    }

    /// Newton's method on the dependent coordinates from the pose evaluated last: by how much they moved, if the loops closed.
    pub(super) fn newton(&self, work: &mut PoseWorkspace) -> Option<f64> {
        let mut moved = 0.0;
        let mut last = f64::INFINITY;
        for _ in 0..ITERATIONS {
            let gap = self.gap(work);
            if gap <= CLOSED || (gap <= STALLED && gap > 0.5 * last) {
                return Some(moved);
            }
            if !gap.is_finite() {
                return None;
            }
            last = gap;
            for (b, r) in work.right.iter_mut().zip(&work.residual) {
                *b = -r;
            }
            let length = self.solve_step(work);
            if !length.is_finite() {
                return None;
            }
            let factor = (LONGEST / length).min(1.0);
            self.apply_step(work, factor);
            moved += factor * length;
            work.bend.sum.iter_mut().zip(&work.step).for_each(|(sum, x)| *sum += factor * x);
            work.iterations += 1;
            self.evaluate(work);
        }
        (self.gap(work) <= STALLED).then_some(moved)
    }

    /// Largest residual, m.
    fn gap(&self, work: &PoseWorkspace) -> f64 {
        let size = |(r, s): (&f64, &f64)| (r * s).abs();
        // Not `max`, which would lose what is not a number.
        work.residual
            .iter()
            .zip(&self.row_scale)
            .map(size)
            .fold(0.0, |m: f64, x| if x <= m || m.is_nan() { m } else { x })
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

    /// Solves `J_dependent x = right` into `work.step`; length of the largest entry, m.
    fn solve_step(&self, work: &mut PoseWorkspace) -> f64 {
        self.solve_dependent(&work.factor, &mut work.right, &mut work.step);
        let scaled = self.dependent.iter().zip(&work.step).map(|(r, x)| (x * self.rate_scale[*r]).abs());
        scaled.fold(0.0, |m: f64, x| if x <= m || m.is_nan() { m } else { x })
    }

    /// Least-squares solution of `J_dependent x = right`, in SI units.
    pub(super) fn solve_dependent(&self, factor: &Factor, right: &mut [f64], x: &mut [f64]) {
        right.iter_mut().zip(&self.row_scale).for_each(|(b, s)| *b *= s);
        factor.solve(right, x);
        for (x, rate) in x.iter_mut().zip(&self.dependent) {
            *x /= self.rate_scale[*rate];
        }
    }

    fn apply_step(&self, work: &mut PoseWorkspace, factor: f64) {
        let mut rates = [0.0; 6];
        let mut k = 0;
        while k < self.dependent.len() {
            let rate = self.dependent[k];
            let position = self.position_of[rate];
            if !self.floats[rate] {
                work.q[position] += factor * work.step[k];
                k += 1;
                continue;
            }
            // All rates of a floating joint are dependent.
            for (r, s) in rates.iter_mut().zip(&work.step[k..k + 6]) {
                *r = factor * s;
            }
            float(&mut work.q[position..position + 7], &rates);
            k += 6;
        }
    }

    fn accept(&self, work: &mut PoseWorkspace) -> Result<(), PoseError> {
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

    /// Rates `dq` of all coordinates and what remains of their accelerations; after [`ClosedMechanism::map`]. See
    /// [`PoseWorkspace::acceleration_drift`].
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

    fn out_of_reach(&self, work: &PoseWorkspace) -> PoseError {
        let (closure, gap) = self.largest_gap(&work.residual);
        PoseError::OutOfReach { closure, gap }
    }

    /// Closure with the largest residual, and the residual in words.
    pub(super) fn largest_gap(&self, residual: &[f64]) -> (String, String) {
        let size = |k: usize| (residual[k] * self.row_scale[k]).abs();
        let worst = (0..residual.len()).fold(0, |m, k| if size(k) > size(m) { k } else { m });
        let gap = if self.rows.angular[worst] {
            format!("{:.3e} rad", residual[worst])
        } else {
            format!("{:.4} mm", 1e3 * residual[worst])
        };
        (self.closures[self.rows.owner[worst]].name.clone(), gap)
    }

    pub(super) fn rate_name(&self, rate: usize) -> String {
        self.mechanism.rate_names()[rate].clone()
    }

    fn joint_at(&self, position: usize) -> String {
        let owns =
            |b: &&crate::mechanism::Body| (b.position..b.position + b.joint.positions()).contains(&position);
        self.mechanism.bodies().iter().find(owns).map_or_else(String::new, |b| b.joint.name.clone())
    }

    /// The largest entries of a motion of some rates.
    pub(super) fn named_motion(&self, rates: &[usize], entries: &[f64]) -> NamedMotion {
        let names = self.mechanism.rate_names();
        let largest = entries.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let mut named: Vec<(String, f64)> = rates
            .iter()
            .zip(entries)
            .filter(|(_, x)| x.abs() > 0.05 * largest)
            .map(|(r, x)| (names[*r].clone(), x / largest))
            .collect();
        named.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
        named.truncate(6);
        NamedMotion(named)
    }
}
