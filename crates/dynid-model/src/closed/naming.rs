//! Words for what is far from closed, and for motions.

use super::error::NamedMotion;
use super::mechanism::ClosedMechanism;

impl ClosedMechanism {
    /// Closure with the largest residual, and the residual in words.
    pub(super) fn largest_gap(&self, residual: &[f64]) -> (String, String) {
        let size = |k: usize| (residual[k] * self.row_scale[k]).abs();
        let worst = (0..residual.len()).fold(0, |m, k| if size(k) > size(m) { k } else { m });
        let gap = if self.rows.angular[worst] {
            format!("{:.3e} rad", residual[worst].abs())
        } else {
            format!("{:.4} mm", 1e3 * residual[worst].abs())
        };
        (self.closures[self.rows.owner[worst]].name.clone(), gap)
    }

    pub(super) fn rate_name(&self, rate: usize) -> String {
        self.mechanism.rate_names()[rate].clone()
    }

    pub(super) fn joint_at(&self, position: usize) -> String {
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
