//! How the best value fell.

use dynid_words::Transfer;

/// Best value known after a number of evaluations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HistoryPoint {
    /// Evaluations so far.
    pub evaluations: u64,
    /// The best value among them.
    pub value: f64,
}

/// Best values after every `stride`-th iteration; the stride doubles whenever the points become too many.
#[derive(Debug, Clone)]
pub(super) struct History {
    points: Vec<HistoryPoint>,
    stride: u64,
    offered: u64,
    capacity: usize,
}

impl History {
    pub(super) fn new(capacity: usize) -> History {
        History { points: Vec::new(), stride: 1, offered: 0, capacity: capacity.max(2) }
    }

    pub(super) fn offer(&mut self, evaluations: u64, value: f64) {
        if self.offered.is_multiple_of(self.stride) {
            if self.points.len() == self.capacity {
                let mut index = 0;
                self.points.retain(|_| {
                    index += 1;
                    index % 2 == 1
                });
                self.stride = self.stride.saturating_mul(2);
            }
            if self.offered.is_multiple_of(self.stride) {
                self.points.push(HistoryPoint { evaluations, value });
            }
        }
        self.offered = self.offered.saturating_add(1);
    }

    /// All points and, where it is not among them, the last.
    pub(super) fn closed(mut self, evaluations: u64, value: f64) -> Vec<HistoryPoint> {
        if self.points.last().is_none_or(|p| p.evaluations != evaluations) {
            self.points.push(HistoryPoint { evaluations, value });
        }
        self.points
    }

    pub(super) fn fields(&mut self, transfer: &mut Transfer<'_>) {
        transfer.integer(&mut self.stride);
        transfer.integer(&mut self.offered);
        let mut flat: Vec<f64> =
            self.points.iter().flat_map(|p| [f64::from_bits(p.evaluations), p.value]).collect();
        transfer.list(&mut flat, 2);
        let point = |p: &[f64]| HistoryPoint { evaluations: p[0].to_bits(), value: p[1] };
        self.points = flat.chunks_exact(2).map(point).collect();
        self.stride = self.stride.max(1);
    }
}
