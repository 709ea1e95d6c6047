//! Points of a population and their values.

use super::run::Run;
use dynid_words::Transfer;

/// `count` points in search coordinates, row after row, and their values.
#[derive(Debug, Clone, Default)]
pub(super) struct Population {
    dimensions: usize,
    pub(super) points: Vec<f64>,
    pub(super) values: Vec<f64>,
}

impl Population {
    pub(super) fn new(count: usize, dimensions: usize) -> Population {
        Population { dimensions, points: vec![0.0; count * dimensions], values: vec![f64::INFINITY; count] }
    }

    pub(super) fn len(&self) -> usize {
        self.values.len()
    }

    pub(super) fn point(&self, index: usize) -> &[f64] {
        &self.points[index * self.dimensions..][..self.dimensions]
    }

    pub(super) fn point_mut(&mut self, index: usize) -> &mut [f64] {
        &mut self.points[index * self.dimensions..][..self.dimensions]
    }

    /// Index of the least value, the first of equal ones.
    pub(super) fn best(&self) -> usize {
        (1..self.len()).fold(0, |best, k| if self.values[k] < self.values[best] { k } else { best })
    }

    /// Points uniform in the bounds, the start (if there is one) in place of the first; all evaluated.
    pub(super) fn draw(&mut self, run: &mut Run<'_>) {
        for point in self.points.chunks_exact_mut(self.dimensions) {
            run.draw(point);
        }
        if let Some(start) = run.start() {
            self.points[..self.dimensions].copy_from_slice(start);
        }
        self.evaluate(run);
    }

    pub(super) fn evaluate(&mut self, run: &mut Run<'_>) {
        run.evaluate(&self.points, &mut self.values);
    }

    /// Takes over point and value of another population.
    pub(super) fn take(&mut self, index: usize, from: &Population, other: usize) {
        self.point_mut(index).copy_from_slice(from.point(other));
        self.values[index] = from.values[other];
    }

    pub(super) fn fields(&mut self, transfer: &mut Transfer<'_>) {
        transfer.reals(&mut self.points);
        transfer.reals(&mut self.values);
    }
}
