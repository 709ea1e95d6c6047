//! Rows that repeat the row before.

use crate::log::Log;
use crate::signal::quantum;

/// Rows in which no signal differs from the row before although a joint moves.
#[derive(Debug, Clone, PartialEq)]
pub struct Repeats {
    /// The rows, ascending, counted from 0.
    pub rows: Vec<usize>,
    /// Rows at which a repetition would show.
    pub examined: usize,
}

impl Repeats {
    /// Share of the rows at which a repetition would show.
    pub fn share(&self) -> f64 {
        self.rows.len() as f64 / self.examined.max(1) as f64
    }
}

/// Finds rows whose positions and efforts all equal those of the row before while some joint moves by more than four
/// resolution steps from the row before that one to the row after.
pub fn repeated(log: &Log) -> Repeats {
    let joints: Vec<(&[f64], &[f64], f64)> = log
        .joints()
        .iter()
        .map(|j| (j.position.as_slice(), j.effort.as_slice(), 4.0 * quantum(&j.position)))
        .collect();
    let mut out = Repeats { rows: Vec::new(), examined: 0 };
    for k in 2..log.rows().saturating_sub(1) {
        let moves = joints.iter().any(|(q, _, least)| (q[k + 1] - q[k - 2]).abs() > *least);
        if !moves {
            continue;
        }
        out.examined += 1;
        if joints.iter().all(|(q, e, _)| q[k] == q[k - 1] && e[k] == e[k - 1]) {
            out.rows.push(k);
        }
    }
    out
}
