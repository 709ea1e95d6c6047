//! The classical Runge-Kutta method of order four.

use super::branch::Branch;
use super::record::ContactEventKind;
use super::run::Run;
use crate::collocation::Motion;
use crate::error::SimError;

impl Run<'_, '_> {
    /// One explicit step.
    pub(super) fn explicit_step(&mut self, h: f64, end: f64) -> Result<(), SimError> {
        let n = self.x.len();
        let mut slopes: Vec<(Vec<f64>, Vec<f64>)> = Vec::with_capacity(4);
        for (k, share) in [0.0, 0.5, 0.5, 1.0].into_iter().enumerate() {
            let (mut x, mut v) = (self.x.clone(), self.v.clone());
            if k > 0 {
                let (dx, dv) = &slopes[k - 1];
                for m in 0..n {
                    x[m] += share * h * dx[m];
                    v[m] += share * h * dv[m];
                }
            }
            let mut a = vec![0.0; n];
            if !self.system.acceleration(self.t + share * h, &x, &v, &mut a) {
                return Err(SimError::TooFast { time: self.t, steps: 0 });
            }
            self.evaluations += 1;
            slopes.push((v, a));
        }
        for m in 0..n {
            let sum = |f: &dyn Fn(usize) -> f64| (f(0) + 2.0 * f(1) + 2.0 * f(2) + f(3)) / 6.0;
            self.x[m] += h * sum(&|k| slopes[k].0[m]);
            self.v[m] += h * sum(&|k| slopes[k].1[m]);
        }
        let t = self.t + h;
        self.t = if end - t <= 1e-9 * h { end } else { t };
        self.record.count.steps += 1;
        if self.x.iter().chain(&self.v).any(|x| !x.is_finite()) {
            return Err(SimError::TooFast { time: self.t, steps: self.record.count.steps });
        }
        self.system.place(self.t, &self.x, &self.v);
        for c in 0..self.system.contacts.len() {
            let found = self.system.contact(c);
            let (now, before) = (found.penetration > 0.0, self.system.branches[c] != Branch::Open);
            if now && !before {
                let speed = found.penetration_rate.abs();
                self.system.branches[c] = self.system.closed(c, speed);
                self.event(c, ContactEventKind::Onset(speed));
            } else if before && !now {
                self.system.branches[c] = Branch::Open;
                self.event(c, ContactEventKind::Loss);
            }
            self.closed_time[c] += if now { h } else { 0.0 };
            let journal = &mut self.record.journals[c];
            journal.largest_penetration = journal.largest_penetration.max(found.penetration);
            journal.largest_normal_force = journal.largest_normal_force.max(found.normal_force);
        }
        Ok(())
    }
}
