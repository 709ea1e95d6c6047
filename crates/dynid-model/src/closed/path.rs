//! The way from pose to pose: prediction, Newton's method, and steps that are halved until they are plainly a continuation.

use super::bend::float;
use super::error::PoseError;
use super::mechanism::ClosedMechanism;
use super::pose::PoseWorkspace;

/// Residual at which a pose counts as closed, m.
const CLOSED: f64 = 1e-14;
/// Largest gap where rounding keeps it from falling further.
const STALLED: f64 = 1e-11;
const ITERATIONS: usize = 12;
/// Longest step of a coordinate between two poses, m (or rad times `L_c`).
const LONGEST: f64 = 0.5;
/// Correction that a predicted pose may need, as a share of the step and beyond it.
const CORRECTION: (f64, f64) = (0.3, 1e-3);
/// Smallest part of the way to a pose that is tried.
const SHORTEST: f64 = 1.0 / 65536.0;

impl ClosedMechanism {
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

    /// Solves `J_dependent x = right` into `work.step`; length of the largest entry, m.
    fn solve_step(&self, work: &mut PoseWorkspace) -> f64 {
        self.solve_dependent(&work.factor, &mut work.right, &mut work.step);
        let scaled = self.dependent.iter().zip(&work.step).map(|(r, x)| (x * self.rate_scale[*r]).abs());
        scaled.fold(0.0, |m: f64, x| if x <= m || m.is_nan() { m } else { x })
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
}
