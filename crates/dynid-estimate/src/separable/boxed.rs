//! The damped linear step within bounds.

use super::dense::{Columns, PivotedQr, triangle};
use dynid_linalg::vector::{add_scaled, dot, norm};

/// `min ‖r + J δ‖² + λ ‖D δ‖²` with `lower <= δ <= upper`, where `lower <= 0 <= upper`; every column of `J` is to be
/// damped, so that the minimum is unique.
///
/// Active set from `δ = 0`: the objective never rises, whenever it is stopped. Source: Stark & Parker 1995.
pub(super) struct BoxedStep {
    /// Triangle of `[J r]`.
    reduced: Columns,
    /// `√λ D`.
    damping: Vec<f64>,
    lower: Vec<f64>,
    upper: Vec<f64>,
}

impl BoxedStep {
    /// `jacobian`: the columns that may move, the residual behind them.
    pub(super) fn new(jacobian: Columns, damping: Vec<f64>, lower: Vec<f64>, upper: Vec<f64>) -> Self {
        BoxedStep { reduced: triangle(jacobian), damping, lower, upper }
    }

    /// The step; components at a bound are exactly its entry of `lower` or `upper`.
    pub(super) fn solve(&self) -> Vec<f64> {
        let n = self.damping.len();
        let mut step = vec![0.0; n];
        let mut free = vec![true; n];
        for _ in 0..10 * n + 10 {
            let target = self.minimum(&step, &free);
            let mut share = 1.0_f64;
            for k in (0..n).filter(|k| free[*k]) {
                let move_by = target[k] - step[k];
                let room = if move_by < 0.0 { self.lower[k] - step[k] } else { self.upper[k] - step[k] };
                if room.abs() < move_by.abs() {
                    share = share.min(room / move_by);
                }
            }
            let mut blocked = false;
            for k in 0..n {
                if !free[k] {
                    continue;
                }
                let move_by = target[k] - step[k];
                let next = step[k] + share * move_by;
                let bound = if move_by < 0.0 { self.lower[k] } else { self.upper[k] };
                // The component that limits the share reaches its bound, whatever rounding says.
                let room = (bound - step[k]).abs();
                let reaches = share < 1.0 && room <= share * move_by.abs() * (1.0 + 4.0 * f64::EPSILON);
                (step[k], free[k]) = if reaches { (bound, false) } else { (next, true) };
                blocked |= reaches;
            }
            if !blocked && !self.release(&step, &mut free) {
                break;
            }
        }
        step
    }

    /// Minimum over the free components, the others as they are.
    fn minimum(&self, step: &[f64], free: &[bool]) -> Vec<f64> {
        let n = step.len();
        let moving: Vec<usize> = (0..n).filter(|k| free[*k]).collect();
        let rows = self.reduced.rows();
        let mut stack = Columns::zeros(rows + moving.len(), moving.len());
        for (j, &k) in moving.iter().enumerate() {
            let column = stack.column_mut(j);
            column[..rows].copy_from_slice(self.reduced.column(k));
            column[rows + j] = self.damping[k];
        }
        let fixed: Vec<f64> = (0..n).map(|k| if free[k] { 0.0 } else { step[k] }).collect();
        let mut right = self.residual(&fixed);
        right.resize(rows + moving.len(), 0.0);
        let sizes: Vec<f64> = (0..moving.len()).map(|j| norm(stack.column(j))).collect();
        let qr = PivotedQr::new(stack, &sizes, moving.len());
        qr.rotate(&mut right);
        let mut out = step.to_vec();
        moving.iter().zip(qr.solve(&right)).for_each(|(k, s)| out[*k] = -s);
        out
    }

    /// `r + J δ`, reduced.
    fn residual(&self, step: &[f64]) -> Vec<f64> {
        let mut out = self.reduced.column(step.len()).to_vec();
        for (k, s) in step.iter().enumerate() {
            add_scaled(&mut out, *s, self.reduced.column(k));
        }
        out
    }

    /// Frees the component whose descent leads away from its bound most; whether there is one.
    fn release(&self, step: &[f64], free: &mut [bool]) -> bool {
        let residual = self.residual(step);
        let size = norm(&residual);
        let mut best = (0.0, None);
        for k in (0..step.len()).filter(|k| !free[*k] && self.lower[*k] < self.upper[*k]) {
            let column = self.reduced.column(k);
            let gradient = dot(column, &residual) + self.damping[k].powi(2) * step[k];
            let inward = if step[k] <= self.lower[k] { -gradient } else { gradient };
            let scale = norm(column).hypot(self.damping[k]) * size;
            if inward > 1e-12 * scale && inward / scale > best.0 {
                best = (inward / scale, Some(k));
            }
        }
        if let Some(k) = best.1 {
            free[k] = true;
        }
        best.1.is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The least objective over all choices of components at bounds, which is the minimum of a convex problem.
    fn by_enumeration(step: &BoxedStep) -> f64 {
        let n = step.damping.len();
        let mut least = f64::INFINITY;
        for code in 0..3_usize.pow(n as u32) {
            let state: Vec<usize> = (0..n).map(|k| code / 3_usize.pow(k as u32) % 3).collect();
            let at = |k: usize| if state[k] == 1 { step.lower[k] } else { step.upper[k] };
            let start: Vec<f64> = (0..n).map(|k| if state[k] == 0 { 0.0 } else { at(k) }).collect();
            let free: Vec<bool> = state.iter().map(|s| *s == 0).collect();
            let found = step.minimum(&start, &free);
            if (0..n).all(|k| (step.lower[k]..=step.upper[k]).contains(&found[k])) {
                least = least.min(objective(step, &found));
            }
        }
        least
    }

    fn objective(step: &BoxedStep, x: &[f64]) -> f64 {
        let r = step.residual(x);
        dot(&r, &r) + x.iter().zip(&step.damping).map(|(x, d)| (x * d).powi(2)).sum::<f64>()
    }

    #[test]
    fn steps_are_the_minima_within_their_bounds() {
        for seed in 0..200_u32 {
            let number = |i: usize| (f64::from(seed) * 7.3 + i as f64 * 1.7 + (i * i) as f64 * 0.37).sin();
            let (n, rows) = (4, 9);
            let mut jacobian = Columns::zeros(rows, n + 1);
            for k in 0..=n {
                jacobian.column_mut(k).iter_mut().enumerate().for_each(|(i, v)| *v = number(20 * k + i));
            }
            let lower = (0..n).map(|k| -0.3 * (number(200 + k) + 1.0).max(0.0)).collect();
            let upper = (0..n).map(|k| 0.3 * (number(300 + k) + 1.0).max(0.0)).collect();
            let step = BoxedStep::new(jacobian, vec![0.03; n], lower, upper);
            let found = step.solve();
            assert!((0..n).all(|k| step.lower[k] <= found[k] && found[k] <= step.upper[k]), "seed {seed}");
            let (ours, least) = (objective(&step, &found), by_enumeration(&step));
            assert!(ours <= least * (1.0 + 1e-12) + 1e-14, "seed {seed}: {ours} against {least}");
        }
    }
}
