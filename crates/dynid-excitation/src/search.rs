//! The design problem as the optimiser sees it.

use dynid_linalg::Mat;
use dynid_model::MotionAdjoint;

use crate::criterion::{Criterion, GramSensitivity, Measure, Smoothing, triangle};
use crate::grid::{Grid, GridMotion, LimitValues, SidedRow};
use crate::model::Sensitivity;
use crate::optimiser::{NearRow, Point, Program, Row};
use crate::problem::Problem;

/// Weighted observation matrix of a motion and its triangle, prior information included.
pub(crate) struct Observation {
    /// `W`, rows weighted.
    weighted: Mat,
    pub(crate) triangle: Mat,
}

impl Observation {
    pub(crate) fn new(problem: &Problem, motion: &GridMotion, sign_width: f64) -> Self {
        let (outputs, samples) = (problem.model.outputs(), motion.samples);
        let columns = problem.model.columns().len();
        let mut weighted = Mat::zeros(outputs * samples, columns);
        problem.model.observe(&motion.block(sign_width), &mut weighted);
        for column in 0..columns {
            let column = weighted.col_mut(column);
            for (part, weight) in column.chunks_exact_mut(samples).zip(row_weights(problem, samples)) {
                part.iter_mut().for_each(|x| *x *= weight);
            }
        }
        let prior = problem.prior.as_ref();
        let extra = prior.map_or(0, Mat::nrows);
        let rows = outputs * samples;
        let mut stacked = Mat::zeros(rows + extra, columns);
        stacked.set_rows(0, &weighted);
        if let Some(prior) = prior {
            stacked.set_rows(rows, prior);
        }
        let triangle = triangle(&mut stacked);
        Observation { weighted, triangle }
    }

    /// Derivatives of the criterion with respect to the motion.
    pub(crate) fn adjoint(
        &self,
        problem: &Problem,
        motion: &GridMotion,
        sign_width: f64,
        sensitivity: &GramSensitivity,
    ) -> MotionAdjoint {
        let n = problem.model.coordinates();
        let mut out = MotionAdjoint::new(n, n, motion.samples);
        let block = motion.block(sign_width);
        let by_output: Vec<f64> = row_weights(problem, motion.samples).collect();
        let weights = |row: usize| by_output[row / motion.samples];
        match sensitivity {
            GramSensitivity::Full(h) => {
                let mut g = &self.weighted * h;
                for column in 0..g.ncols() {
                    let column = g.col_mut(column);
                    column.iter_mut().enumerate().for_each(|(row, x)| *x *= weights(row));
                }
                problem.model.adjoint(&block, Sensitivity::Full(&g), &mut out);
            }
            GramSensitivity::Outer(terms) => {
                let outer: Vec<(Vec<f64>, Vec<f64>)> = terms
                    .iter()
                    .map(|(factor, v)| {
                        let image = self.weighted.times(v);
                        let u = image.iter().enumerate().map(|(row, x)| factor * weights(row) * x).collect();
                        (u, v.clone())
                    })
                    .collect();
                problem.model.adjoint(&block, Sensitivity::Outer(&outer), &mut out);
            }
        }
        out
    }
}

/// Factors of the rows of every output: `1/σ`, and the share of a sample of the log that a sample of the grid stands for.
fn row_weights(problem: &Problem, samples: usize) -> impl Iterator<Item = f64> {
    let share = (problem.effective_samples / samples as f64).sqrt();
    problem.output_weights.iter().map(move |w| w * share)
}

/// Criterion and limits on a grid, with what was computed last.
pub(crate) struct Search<'a> {
    grid: &'a Grid<'a>,
    criterion: Criterion,
    smoothing: Smoothing,
    /// Factor of the criterion in the objective.
    scale: f64,
    last: Option<Evaluation>,
    pub(crate) evaluations: usize,
}

struct Evaluation {
    z: Vec<f64>,
    values: LimitValues,
    observation: Observation,
    sensitivity: GramSensitivity,
    point: Point,
}

impl<'a> Search<'a> {
    pub(crate) fn new(grid: &'a Grid<'a>, criterion: Criterion, smoothing: Smoothing) -> Self {
        // A determinant is a sum over all columns; penalties and thresholds of progress are made for numbers around one.
        let scale = match criterion.measure {
            Measure::Determinant => 1.0 / grid.problem.model.columns().len() as f64,
            _ => 1.0,
        };
        Search { grid, criterion, smoothing, scale, last: None, evaluations: 0 }
    }

    fn at(&mut self, z: &[f64]) -> Option<&Evaluation> {
        if self.last.as_ref().is_none_or(|e| e.z != z) {
            self.evaluations += 1;
            self.last = None;
            let values = self.grid.values(z);
            let violation = values.worst().0.max(0.0);
            // Out of reach: there is nothing to evaluate.
            if !violation.is_finite() {
                return None;
            }
            let observation = Observation::new(self.grid.problem, &values.motion, self.grid.sign_width);
            let (value, sensitivity) = self.criterion.sensitivity(&observation.triangle, self.smoothing)?;
            let point = Point { objective: self.scale * value, violation };
            self.last = Some(Evaluation { z: z.to_vec(), values, observation, sensitivity, point });
        }
        self.last.as_ref()
    }
}

impl Program for Search<'_> {
    type Id = SidedRow;

    fn unknowns(&self) -> usize {
        self.grid.map.unknowns()
    }

    fn evaluate(&mut self, z: &[f64]) -> Option<Point> {
        self.at(z).map(|e| e.point)
    }

    fn gradient(&mut self, z: &[f64]) -> Option<Vec<f64>> {
        let (grid, scale) = (self.grid, self.scale);
        let e = self.at(z)?;
        let adjoint = e.observation.adjoint(grid.problem, &e.values.motion, grid.sign_width, &e.sensitivity);
        let mut gradient = grid.map.gradient(&grid.basis, &adjoint);
        gradient.iter_mut().for_each(|x| *x *= scale);
        Some(gradient)
    }

    fn near_rows(&mut self, z: &[f64], distance: f64) -> Vec<NearRow<SidedRow>> {
        let grid = self.grid;
        match self.at(z) {
            Some(e) => grid.linearised(&e.values, 0.0, |limit, sample| {
                limit.excess(sample) > -distance * limit.nearness
            }),
            None => Vec::new(),
        }
    }

    fn curved_bounds(&mut self, z: &[f64], ids: &[SidedRow]) -> Vec<f64> {
        let grid = self.grid;
        let bounds = |values: &LimitValues| ids.iter().map(|id| values.slack(*id)).collect();
        match self.at(z) {
            Some(e) => bounds(&e.values),
            None => bounds(&grid.values(z)),
        }
    }

    fn curved_rows(&mut self, z: &[f64], ids: &[SidedRow]) -> Vec<Row> {
        let grid = self.grid;
        match self.at(z) {
            Some(e) => grid.path_rows(&e.values, ids),
            None => grid.path_rows(&grid.values(z), ids),
        }
    }
}
