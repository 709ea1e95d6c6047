//! A design on a grid of times: motion, values of all limits, their linearisations.

use dynid_model::MotionBlock;
use dynid_motion::trajectory::FourierBasis;

use crate::constraint::ConstraintKind;
use crate::optimiser::{NearRow, Row};
use crate::parametrisation::Parametrisation;
use crate::problem::Problem;

/// Motion of all coordinates at the times of a grid, `channel[coordinate * samples + sample]`.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct GridMotion {
    pub(crate) samples: usize,
    /// Positions and their first three derivatives.
    pub(crate) channels: [Vec<f64>; 4],
    /// Positions and velocities of what follows the motion; empty where the motion is that of the robot.
    followed: [Vec<f64>; 2],
}

impl GridMotion {
    pub(crate) fn new(problem: &Problem, coefficients: &[Vec<f64>], basis: &FourierBasis) -> Self {
        let samples = basis.times().len();
        let mut channels = [const { Vec::new() }; 4];
        for (derivative, channel) in channels.iter_mut().enumerate() {
            channel.resize(samples * coefficients.len(), 0.0);
            for (x, out) in coefficients.iter().zip(channel.chunks_exact_mut(samples)) {
                basis.evaluate(derivative, x, out);
            }
        }
        let mut followed = [const { Vec::new() }; 2];
        for (coordinate, x) in coefficients.iter().enumerate() {
            let Some(x) = after(problem, coordinate, x.clone(), false) else { continue };
            for (derivative, channel) in followed.iter_mut().enumerate() {
                let first = channel.len();
                channel.resize(first + samples, 0.0);
                basis.evaluate(derivative, &x, &mut channel[first..]);
            }
        }
        GridMotion { samples, channels, followed }
    }

    pub(crate) fn block(&self, sign_width: f64) -> MotionBlock<'_> {
        MotionBlock {
            samples: self.samples,
            stride: self.samples,
            q: &self.channels[0],
            dq: &self.channels[1],
            ddq: &self.channels[2],
            gravity: None,
            channels: &[],
            sign_width,
        }
    }
}

/// Coefficients of the motion of a coordinate behind its loop from those of its command; `transposed`: derivatives by the former turned into
/// those by the latter. `None`: the coordinate is where its command is.
fn after(problem: &Problem, coordinate: usize, mut x: Vec<f64>, transposed: bool) -> Option<Vec<f64>> {
    let harmonics = (x.len() - 1) / 2;
    for k in 0..harmonics {
        let (re, im) = problem.model.response(coordinate, problem.base * (k + 1) as f64)?;
        let im = if transposed { -im } else { im };
        // a sin + b cos is the imaginary part of (a + j b) e^{jωt}.
        let (a, b) = (x[1 + k], x[1 + harmonics + k]);
        x[1 + k] = re * a - im * b;
        x[1 + harmonics + k] = im * a + re * b;
    }
    Some(x)
}

/// Which limit, at which sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct RowId {
    pub(crate) limit: LimitId,
    pub(crate) sample: usize,
}

/// Which limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum LimitId {
    /// A derivative (0 to 3) of a coordinate.
    Coordinate { coordinate: usize, derivative: usize },
    /// A derivative (0 or 1) of a coordinate behind the loop that follows its command.
    Followed { coordinate: usize, derivative: usize },
    /// A row of a path constraint.
    Path { constraint: usize, row: usize },
}

/// Values of all limits on a grid, normalised; the value of [`LimitId`] `k` at sample `s` is `values[k][s]`.
pub(crate) struct LimitValues {
    pub(crate) limits: Vec<LimitValue>,
    pub(crate) motion: GridMotion,
}

/// Values of one limit at all samples and its bounds.
pub(crate) struct LimitValue {
    pub(crate) id: LimitId,
    pub(crate) lower: f64,
    pub(crate) upper: f64,
    pub(crate) values: Vec<f64>,
    /// How near to its bound a sample must be to enter a quadratic program, in shares of what is usual.
    pub(crate) nearness: f64,
}

/// Nearness of floor and own links: there are many of them, and none moves by more than some 15 cm in one step.
const NEARNESS_OF_LINKS: f64 = 0.3;

fn nearness(kind: ConstraintKind) -> f64 {
    match kind {
        ConstraintKind::OwnLinks | ConstraintKind::Floor | ConstraintKind::Mounting => NEARNESS_OF_LINKS,
        _ => 1.0,
    }
}

impl LimitValue {
    /// By how much a sample is outside; negative: inside. What is not a number is infinitely far outside.
    pub(crate) fn excess(&self, sample: usize) -> f64 {
        let value = self.values[sample];
        if value.is_nan() { f64::INFINITY } else { (value - self.upper).max(self.lower - value) }
    }
}

impl LimitValues {
    /// Distance of a row from its bound, negative: outside.
    pub(crate) fn slack(&self, row: SidedRow) -> f64 {
        let limit = &self.limits[row.place];
        let value = limit.values[row.id.sample];
        if row.sign > 0.0 { limit.upper - value } else { value - limit.lower }
    }

    /// Largest excess over all limits and samples.
    pub(crate) fn worst(&self) -> (f64, Option<RowId>) {
        let mut worst = (f64::NEG_INFINITY, None);
        for limit in &self.limits {
            for sample in 0..self.motion.samples {
                let excess = limit.excess(sample);
                if excess > worst.0 {
                    worst = (excess, Some(RowId { limit: limit.id, sample }));
                }
            }
        }
        worst
    }
}

/// A problem on a grid of times.
pub(crate) struct Grid<'a> {
    pub(crate) problem: &'a Problem,
    pub(crate) map: &'a Parametrisation,
    pub(crate) basis: FourierBasis,
    /// Bound of normalised coordinate limits: below 1 where peaks between samples are to be covered.
    pub(crate) bound: f64,
    /// Width of the smoothed sign.
    pub(crate) sign_width: f64,
}

impl<'a> Grid<'a> {
    /// Grid of the search: `samples` in one period, coordinate limits tightened so that peaks between samples stay
    /// within them.
    pub(crate) fn search(problem: &'a Problem, map: &'a Parametrisation, samples: usize) -> Self {
        let basis = FourierBasis::on_period(problem.base, problem.harmonics, samples);
        let bound = FourierBasis::grid_factor(problem.harmonics, samples).map_or(1.0, |f| 1.0 / f);
        Grid { problem, map, basis, bound, sign_width: problem.sign_width }
    }

    /// Fine grid, limits as they are.
    pub(crate) fn exact(problem: &'a Problem, map: &'a Parametrisation, samples: usize) -> Self {
        let basis = FourierBasis::on_period(problem.base, problem.harmonics, samples);
        Grid { problem, map, basis, bound: 1.0, sign_width: problem.sign_width }
    }

    /// Grid of given times, limits as they are.
    pub(crate) fn at_times(problem: &'a Problem, map: &'a Parametrisation, times: Vec<f64>) -> Self {
        let basis = FourierBasis::new(problem.base, problem.harmonics, times);
        Grid { problem, map, basis, bound: 1.0, sign_width: problem.sign_width }
    }

    pub(crate) fn motion(&self, z: &[f64]) -> GridMotion {
        GridMotion::new(self.problem, &self.map.coefficients(z), &self.basis)
    }

    /// Values of all limits.
    pub(crate) fn values(&self, z: &[f64]) -> LimitValues {
        self.values_of(self.motion(z))
    }

    /// Values of all limits of a motion.
    pub(crate) fn values_of(&self, motion: GridMotion) -> LimitValues {
        let samples = motion.samples;
        let mut limits = Vec::new();
        for (coordinate, limit) in self.problem.limits.iter().enumerate() {
            let commanded = motion.channels.iter().enumerate().map(|(derivative, channel)| {
                (LimitId::Coordinate { coordinate, derivative }, derivative, channel)
            });
            let followed = motion.followed.iter().enumerate().map(|(derivative, channel)| {
                (LimitId::Followed { coordinate, derivative }, derivative, channel)
            });
            for (id, derivative, channel) in commanded.chain(followed) {
                let Some(scale) = limit.of_derivative(derivative).filter(|_| !channel.is_empty()) else {
                    continue;
                };
                let middle = if derivative == 0 { limit.middle() } else { 0.0 };
                let channel = &channel[coordinate * samples..][..samples];
                limits.push(LimitValue {
                    id,
                    lower: -self.bound,
                    upper: self.bound,
                    values: channel.iter().map(|x| (x - middle) / scale).collect(),
                    nearness: 1.0,
                });
            }
        }
        let block = motion.block(self.sign_width);
        for (c, constraint) in self.problem.constraints.iter().enumerate() {
            let rows = constraint.rows();
            let mut values = vec![0.0; rows.len() * samples];
            constraint.values(&block, samples, &mut values);
            for (row, (info, values)) in rows.iter().zip(values.chunks_exact(samples)).enumerate() {
                limits.push(LimitValue {
                    id: LimitId::Path { constraint: c, row },
                    lower: info.lower,
                    upper: info.upper,
                    values: values.to_vec(),
                    nearness: nearness(info.kind),
                });
            }
        }
        LimitValues { limits, motion }
    }

    /// Linearised rows of all samples that `wanted(limit, sample)` names, with a distance to keep from the bound.
    ///
    /// Rows that the unknowns do not move (the start pose) are left out.
    pub(crate) fn linearised(
        &self,
        values: &LimitValues,
        margin: f64,
        mut wanted: impl FnMut(&LimitValue, usize) -> bool,
    ) -> Vec<NearRow<SidedRow>> {
        let mut rows = Vec::new();
        let mut path = Vec::new();
        for (place, limit) in values.limits.iter().enumerate() {
            for sample in 0..values.motion.samples {
                if !wanted(limit, sample) {
                    continue;
                }
                let id = RowId { limit: limit.id, sample };
                let value = limit.values[sample];
                let sides = [(1.0, limit.upper - margin - value), (-1.0, value - limit.lower - margin)];
                // Only the nearer side can matter.
                let (sign, bound) = if sides[0].1 <= sides[1].1 { sides[0] } else { sides[1] };
                match limit.id {
                    LimitId::Coordinate { .. } | LimitId::Followed { .. } => {
                        let mut row = self.coordinate_row(id);
                        row.values.iter_mut().for_each(|x| *x *= sign);
                        row.bound = bound;
                        rows.push(NearRow { row, curved: None });
                    }
                    LimitId::Path { .. } => path.push(SidedRow { id, place, sign }),
                }
            }
        }
        for (mut row, id) in self.path_rows(values, &path).into_iter().zip(path) {
            row.bound -= margin;
            rows.push(NearRow { row, curved: Some(id) });
        }
        rows.retain(|r| r.row.values.iter().any(|x| x.abs() > 1e-9));
        rows
    }

    fn coordinate_row(&self, id: RowId) -> Row {
        let (coordinate, derivative) = match id.limit {
            LimitId::Coordinate { coordinate, derivative } | LimitId::Followed { coordinate, derivative } => {
                (coordinate, derivative)
            }
            LimitId::Path { .. } => unreachable!("asked of coordinate limits only"),
        };
        let scale = self.problem.limits[coordinate].of_derivative(derivative).unwrap_or(f64::INFINITY);
        let behind = matches!(id.limit, LimitId::Followed { .. });
        let of_basis = || self.basis.row(derivative, id.sample).to_vec();
        let mut values = match behind.then(|| after(self.problem, coordinate, of_basis(), true)).flatten() {
            Some(slopes) => {
                let mut values = vec![0.0; self.map.range(coordinate).len()];
                self.map.pull_back(coordinate, &slopes, &mut values);
                values
            }
            None => self.map.row(coordinate, &self.basis, derivative, id.sample),
        };
        values.iter_mut().for_each(|x| *x /= scale);
        Row { first: self.map.range(coordinate).start, values, bound: 0.0 }
    }

    /// Linearised rows of path constraints, in the order of `ids`.
    pub(crate) fn path_rows(&self, values: &LimitValues, ids: &[SidedRow]) -> Vec<Row> {
        let n = self.map.coordinates();
        let block = values.motion.block(self.sign_width);
        let mut rows: Vec<Row> =
            ids.iter().map(|id| Row { first: 0, values: Vec::new(), bound: values.slack(*id) }).collect();
        for (c, constraint) in self.problem.constraints.iter().enumerate() {
            let mut wanted = Vec::new();
            let mut places = Vec::new();
            for (place, id) in ids.iter().enumerate() {
                if let LimitId::Path { constraint, row } = id.id.limit
                    && constraint == c
                {
                    wanted.push((row, id.id.sample));
                    places.push(place);
                }
            }
            if wanted.is_empty() {
                continue;
            }
            let mut gradients = vec![0.0; 3 * n * wanted.len()];
            constraint.gradients(&block, &wanted, &mut gradients);
            for ((gradient, (_, sample)), place) in gradients.chunks_exact(3 * n).zip(&wanted).zip(places) {
                rows[place].values = self.state_gradient(gradient, *sample, ids[place].sign);
            }
        }
        rows
    }

    /// Derivatives with respect to the unknowns from those with respect to the state of one sample.
    fn state_gradient(&self, gradient: &[f64], sample: usize, sign: f64) -> Vec<f64> {
        let n = self.map.coordinates();
        let mut z = vec![0.0; self.map.unknowns()];
        let mut coefficients = vec![0.0; 1 + 2 * self.basis.harmonics()];
        for coordinate in 0..n {
            let slopes = [0, 1, 2].map(|derivative| sign * gradient[derivative * n + coordinate]);
            // Distances know nothing of rates, nor of joints beyond their point.
            if slopes == [0.0; 3] {
                continue;
            }
            coefficients.fill(0.0);
            for (derivative, slope) in slopes.into_iter().enumerate().filter(|(_, slope)| *slope != 0.0) {
                for (c, b) in coefficients.iter_mut().zip(self.basis.row(derivative, sample)) {
                    *c += slope * b;
                }
            }
            self.map.pull_back(coordinate, &coefficients, &mut z[self.map.range(coordinate)]);
        }
        z
    }
}

/// A row of a path constraint towards its upper (+1) or lower (-1) bound.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SidedRow {
    pub(crate) id: RowId,
    /// Index of its limit among [`LimitValues::limits`], the same for all motions of a problem.
    place: usize,
    pub(crate) sign: f64,
}
