//! What the logs of one robot say of its varying parameters over time.

use dynid_linalg::Mat;

/// Estimates of the varying parameters, log by log, as informations: a log that does not tell a parameter adds nothing to it.
#[derive(Debug, Clone)]
pub struct Series {
    /// Per log its time, ascending, on any axis.
    pub times: Vec<f64>,
    /// Per log and covariate: its value, counted from the mean.
    pub covariates: Vec<Vec<f64>>,
    /// Per log: `Λ = V⁻¹`, the information on the coordinates with the scatter between logs in it.
    pub information: Vec<Mat>,
    /// Per log: `Λ y`, `y` the deviation of the coordinates from the fleet's at the covariates of the log.
    pub moment: Vec<Vec<f64>>,
}

impl Series {
    /// Number of logs.
    pub fn len(&self) -> usize {
        self.times.len()
    }

    /// Whether there are no logs.
    pub fn is_empty(&self) -> bool {
        self.times.is_empty()
    }

    /// Number of coordinates.
    pub(crate) fn coordinates(&self) -> usize {
        self.information.first().map_or(0, Mat::nrows)
    }
}

/// What is fitted beside a pattern of time: a level per coordinate, slopes over the covariates, patterns that were found before.
pub(crate) struct Background<'a> {
    series: &'a Series,
    /// Per covariate and coordinate: precision of the robot's own slope about the fleet's.
    precision: &'a [Vec<f64>],
    /// Per log the regressors of the background: 1, covariates; then patterns, of one coordinate each.
    patterns: Vec<(usize, Vec<f64>)>,
    /// Solves with `UᵀΛU + Π`.
    solver: dynid_linalg::Cholesky,
    /// `(UᵀΛU + Π)⁻¹ UᵀΛ y`.
    explained: Vec<f64>,
}

impl<'a> Background<'a> {
    pub(crate) fn new(
        series: &'a Series,
        precision: &'a [Vec<f64>],
        patterns: Vec<(usize, Vec<f64>)>,
    ) -> Background<'a> {
        let q = series.coordinates();
        let bases = 1 + precision.len();
        let size = bases * q + patterns.len();
        let mut a = Mat::zeros(size, size);
        let mut moment = vec![0.0; size];
        for l in 0..series.len() {
            let regressors = regressors(series, l);
            let (information, own) = (&series.information[l], &series.moment[l]);
            for (c, u) in regressors.iter().enumerate() {
                for (d, v) in regressors.iter().enumerate() {
                    for i in 0..q {
                        (0..q).for_each(|j| a[(c * q + i, d * q + j)] += u * v * information[(i, j)]);
                    }
                }
                (0..q).for_each(|i| moment[c * q + i] += u * own[i]);
                for (p, (k, h)) in patterns.iter().enumerate() {
                    for i in 0..q {
                        let value = u * h[l] * information[(i, *k)];
                        a[(c * q + i, bases * q + p)] += value;
                        a[(bases * q + p, c * q + i)] += value;
                    }
                }
            }
            for (p, (k, h)) in patterns.iter().enumerate() {
                moment[bases * q + p] += h[l] * own[*k];
                for (o, (m, g)) in patterns.iter().enumerate() {
                    a[(bases * q + p, bases * q + o)] += h[l] * g[l] * information[(*k, *m)];
                }
            }
        }
        for (c, of_covariate) in precision.iter().enumerate() {
            of_covariate.iter().enumerate().for_each(|(i, v)| a[((1 + c) * q + i, (1 + c) * q + i)] += v);
        }
        for i in 0..size {
            // What no log tells is held, and what patterns double is shared.
            a[(i, i)] = if a[(i, i)] > 0.0 { a[(i, i)] * (1.0 + 1e-12) } else { 1.0 };
        }
        // Rounding may leave a direction that two patterns share; more of the same mends it.
        let mut share = 1e-11;
        let solver = loop {
            match a.cholesky() {
                Some(solver) => break solver,
                None => (0..size).for_each(|i| a[(i, i)] *= 1.0 + share),
            }
            share *= 10.0;
        };
        let explained = solver.solve_vector(&moment);
        Background { series, precision, patterns, solver, explained }
    }

    /// `(hᵀQy, hᵀQh)` of patterns of coordinate `k`, with `Q = Λ - ΛU (UᵀΛU + Π)⁻¹ UᵀΛ`.
    pub(crate) fn of(&self, k: usize, patterns: &[Vec<f64>]) -> Vec<(f64, f64)> {
        let series = self.series;
        let q = series.coordinates();
        let bases = 1 + series.covariates.first().map_or(0, Vec::len);
        let size = bases * q + self.patterns.len();
        let mut shared = Mat::zeros(size, patterns.len());
        let mut raw = vec![(0.0, 0.0); patterns.len()];
        for l in 0..series.len() {
            let regressors = regressors(series, l);
            let (information, own) = (&series.information[l], &series.moment[l]);
            for (p, h) in patterns.iter().enumerate().filter(|(_, h)| h[l] != 0.0) {
                raw[p].0 += h[l] * own[k];
                raw[p].1 += h[l] * h[l] * information[(k, k)];
                let column = shared.col_mut(p);
                for (c, u) in regressors.iter().enumerate() {
                    (0..q).for_each(|i| column[c * q + i] += u * h[l] * information[(i, k)]);
                }
                for (o, (m, g)) in self.patterns.iter().enumerate() {
                    column[bases * q + o] += h[l] * g[l] * information[(*m, k)];
                }
            }
        }
        let solved = self.solver.solve(&shared);
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let of = |(p, (y, h)): (usize, (f64, f64))| {
            let column = shared.col(p);
            (y - dot(column, &self.explained), h - dot(column, solved.col(p)))
        };
        raw.into_iter().enumerate().map(of).collect()
    }

    /// Deviation of the coordinates at log `l` from the fleet's by the background: level, own slopes, patterns.
    pub(crate) fn fitted(&self, l: usize) -> Vec<f64> {
        let q = self.series.coordinates();
        let regressors = regressors(self.series, l);
        let mut out: Vec<f64> = (0..q)
            .map(|i| regressors.iter().enumerate().map(|(c, u)| u * self.explained[c * q + i]).sum())
            .collect();
        for (p, (k, h)) in self.patterns.iter().enumerate() {
            out[*k] += h[l] * self.explained[regressors.len() * q + p];
        }
        out
    }

    /// What the robot's own slopes cost: `Σ Π γ²`.
    pub(crate) fn strain(&self) -> f64 {
        let q = self.series.coordinates();
        let own = self.explained[q..].iter().zip(self.precision.iter().flatten());
        own.map(|(slope, precision)| precision * slope * slope).sum()
    }

    /// Slopes of the robot over covariate `c`, counted from the fleet's, and their variances.
    pub(crate) fn slopes(&self, c: usize) -> Vec<(f64, f64)> {
        let q = self.series.coordinates();
        let size = self.explained.len();
        let unit = Mat::from_fn(size, q, |i, k| if i == (1 + c) * q + k { 1.0 } else { 0.0 });
        let inverse = self.solver.solve(&unit);
        (0..q).map(|k| (self.explained[(1 + c) * q + k], inverse[((1 + c) * q + k, k)])).collect()
    }
}

/// 1 and the covariates of a log.
fn regressors(series: &Series, l: usize) -> Vec<f64> {
    std::iter::once(1.0).chain(series.covariates[l].iter().copied()).collect()
}
