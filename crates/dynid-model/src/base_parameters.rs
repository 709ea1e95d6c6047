//! Base parameters: the combinations of standard parameters that motion and effort can reveal (Gautier 1991).

mod expression;

pub use expression::{linear_combination, significant};

use dynid_linalg::Mat;
use dynid_linalg::triangular::solve_upper_in_place;

use crate::closed_model::{ClosedModel, Reaction};
use crate::dynamics::MotionBlock;
use crate::effort_model::{EffortModel, RegressorBlock};
use crate::mechanism::Mechanism;
use crate::parameter::ParameterTable;
use crate::random_motion::RandomMotion;

/// Robots with more outputs than this have rows enough by few states.
const MANY_OUTPUTS: usize = 30;
/// Up to so many columns the gap is that of singular values; beyond, of bounds of them.
const FEW_COLUMNS: usize = 600;
/// Columns that are projected on the kept ones together, of few columns and of many.
const BLOCKS: [usize; 2] = [256, 64];

/// Settings of the structural analysis.
#[derive(Debug, Clone, PartialEq)]
pub struct BaseSettings {
    /// A column is dependent if less than this share of its length is left after projection on the kept columns.
    ///
    /// Rotations that a file gives with 5 to 12 digits leave shares of up to 1e-9; true parameters of robots start at
    /// about 1e-3. Default 1e-7.
    pub tolerance: f64,
    /// Random states; 0: enough for a stack three times as tall as wide, at least 100; of more than 30 outputs 1.5 times, at least 20. Default 0.
    pub states: usize,
    /// Seed of the random states.
    pub seed: u64,
    /// Columns to keep if possible, first choice first; the others follow in the default order (parameters that are
    /// not [`fold_first`](crate::Parameter::fold_first) in column order, then those that are).
    pub preferred: Vec<usize>,
}

impl Default for BaseSettings {
    fn default() -> Self {
        BaseSettings { tolerance: 1e-7, states: 0, seed: 1, preferred: Vec::new() }
    }
}

impl BaseSettings {
    fn states_for(&self, model: &dyn EffortModel) -> usize {
        match self.states {
            0 => {
                let outputs = model.outputs().len();
                let parameters = model.layout().parameters();
                match outputs > MANY_OUTPUTS {
                    // The states of a joint's rows are to be more than the parameters of its body and elements.
                    true => 20.max((3 * parameters).div_ceil(2 * outputs)),
                    false => 100.max((3 * parameters).div_ceil(outputs)),
                }
            }
            n => n,
        }
    }
}

/// Gap in the singular values at the rank decision (columns scaled to unit length).
///
/// Of more than 600 columns bounds stand for them: the root of the rank, the least remainder of a column that was kept, the largest of one that was
/// not.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RankGap {
    /// Largest singular value.
    pub largest: f64,
    /// Last one counted.
    pub kept: f64,
    /// First one not counted; `None` at full rank.
    pub dropped: Option<f64>,
}

impl RankGap {
    /// Ratio of the singular values on both sides of the decision; infinite at full rank. Below 1e4 the decision is
    /// doubtful.
    pub fn ratio(&self) -> f64 {
        self.dropped.map_or(f64::INFINITY, |d| self.kept / d.max(f64::MIN_POSITIVE))
    }
}

/// Which standard parameters are kept, which are folded into them and how: `β = K x`.
#[derive(Debug, Clone, PartialEq)]
pub struct BaseParameters {
    /// Columns that are kept, ascending: base parameter `i` is column `kept[i]` plus what is folded into it.
    pub kept: Vec<usize>,
    /// Columns that depend on kept ones, ascending.
    pub folded: Vec<usize>,
    /// Columns that are zero for every motion: these parameters never act.
    pub zero: Vec<usize>,
    /// `folded.len()` columns of `kept.len()` factors: `W[:, folded[j]] = Σ factors[j][i] W[:, kept[i]]`.
    pub factors: Vec<Vec<f64>>,
    /// Gap at the rank decision.
    pub gap: RankGap,
    parameters: usize,
}

impl BaseParameters {
    /// Analyses an effort model of a mechanism on random states. `shape` are the model's shape parameters.
    pub fn of(
        model: &dyn EffortModel,
        mechanism: &Mechanism,
        shape: &[f64],
        settings: &BaseSettings,
    ) -> Self {
        // What elements remember takes values of its own: any of them may come before a state.
        let motion = RandomMotion::of(model, mechanism, settings.states_for(model), settings.seed);
        motion.with_block(|block| Self::on_motion(model, block, shape, settings))
    }

    /// Base parameters of any effort model, on [its own random states](EffortModel::random_motion).
    pub fn of_model(model: &dyn EffortModel, shape: &[f64], settings: &BaseSettings) -> Self {
        let motion = model.random_motion(settings.states_for(model), settings.seed);
        motion.with_block(|block| Self::on_motion(model, block, shape, settings))
    }

    /// Analyses a closed mechanism of which reactions are known beside the efforts: measured, or felt through friction.
    ///
    /// Efforts alone tell combinations that belong to the mechanism; what reactions add belongs to the place of the cuts.
    pub fn with_reactions(
        model: &ClosedModel,
        reactions: &[Reaction],
        shape: &[f64],
        settings: &BaseSettings,
    ) -> Self {
        let motion = model.random_motion(settings.states_for(model), settings.seed);
        let reactions = model.reactions(reactions);
        let mut effort = RegressorBlock::new(model.layout().clone(), motion.samples());
        let mut rows = RegressorBlock::new(reactions.layout().clone(), motion.samples());
        motion.with_block(|block| model.reaction_regressor(block, shape, &reactions, &mut effort, &mut rows));
        Self::of_blocks(&[&effort, &rows], model.parameters(), settings)
    }

    /// Analyses an effort model on given motion.
    pub fn on_motion(
        model: &dyn EffortModel,
        motion: &MotionBlock<'_>,
        shape: &[f64],
        settings: &BaseSettings,
    ) -> Self {
        let mut block = RegressorBlock::new(model.layout().clone(), motion.samples);
        model.regressor(motion, shape, &mut block);
        Self::of_blocks(&[&block], model.parameters(), settings)
    }

    /// Analyses regressors in the same parameters, one below the other.
    ///
    /// # Panics
    /// If a block has another number of parameters than the table.
    pub fn of_blocks(blocks: &[&RegressorBlock], table: &ParameterTable, settings: &BaseSettings) -> Self {
        let rows = blocks.iter().map(|b| b.layout().outputs() * b.samples()).sum();
        let mut stacked = vec![vec![0.0; rows]; table.linear.len()];
        let mut first = 0;
        for block in blocks {
            let (layout, samples) = (block.layout(), block.samples());
            assert_eq!(layout.parameters(), table.linear.len(), "parameters of a regressor");
            for output in 0..layout.outputs() {
                for (k, &column) in layout.columns(output).iter().enumerate() {
                    stacked[column][first..first + samples].copy_from_slice(block.column(output, k));
                }
                first += samples;
            }
        }
        Self::of_columns(stacked, table, settings)
    }

    /// Analyses the columns of a stacked regressor.
    fn of_columns(mut stacked: Vec<Vec<f64>>, table: &ParameterTable, settings: &BaseSettings) -> Self {
        let rows = stacked.first().map_or(0, Vec::len);
        let norms: Vec<f64> = stacked.iter().map(|c| dot(c, c).sqrt()).collect();
        let largest = norms.iter().fold(0.0_f64, |m, n| m.max(*n));
        let silent = |c: usize| norms[c] <= 1e-12 * largest || norms[c] == 0.0;
        for (column, norm) in stacked.iter_mut().zip(&norms) {
            if *norm > 0.0 {
                column.iter_mut().for_each(|x| *x /= norm);
            }
        }
        let zero: Vec<usize> = (0..stacked.len()).filter(|c| silent(*c)).collect();
        let order = preference(table, &settings.preferred).into_iter().filter(|c| !silent(*c));
        let active: Vec<usize> = (0..stacked.len()).filter(|c| !silent(*c)).collect();
        let mut projection = Projection::new(rows, active.len());
        let mut kept = Vec::new();
        let mut folded: Vec<(usize, Vec<f64>)> = Vec::new();
        let (mut least, mut most_left) = (f64::INFINITY, None::<f64>);
        let order: Vec<usize> = order.collect();
        let many = active.len() > FEW_COLUMNS;
        for block in order.chunks(BLOCKS[usize::from(many)]) {
            let mut remainders = projection.block(block.iter().map(|c| stacked[*c].as_slice()));
            for (k, &column) in block.iter().enumerate() {
                let left = projection.project(&mut remainders, k);
                if left > settings.tolerance {
                    projection.keep(&mut remainders, k, left);
                    kept.push(column);
                    least = least.min(left);
                } else {
                    folded.push((column, remainders.coefficients(k)));
                    most_left = Some(most_left.map_or(left, |m| m.max(left)));
                }
            }
        }
        let rank = kept.len();
        let gap = match many {
            false => {
                let singular = singular_values(rows, &active, &stacked);
                RankGap {
                    largest: singular.first().copied().unwrap_or(0.0),
                    kept: if rank > 0 { singular[rank - 1] } else { 0.0 },
                    dropped: singular.get(rank).copied(),
                }
            }
            true => RankGap { largest: (rank as f64).sqrt(), kept: least, dropped: most_left },
        };

        // Kept columns ascending from here on.
        let mut position: Vec<usize> = (0..rank).collect();
        position.sort_by_key(|k| kept[*k]);
        projection.solve(&mut folded);
        for (column, factors) in &mut folded {
            let factor = |k: &usize| {
                let value = factors.get(*k).copied().unwrap_or(0.0);
                // Undo the scaling; drop what is rounding.
                if value.abs() < 1e-10 { 0.0 } else { value * norms[*column] / norms[kept[*k]] }
            };
            *factors = position.iter().map(factor).collect();
        }
        folded.sort_by_key(|(column, _)| *column);
        kept.sort_unstable();
        let (folded, factors) = folded.into_iter().unzip();
        BaseParameters { kept, folded, zero, factors, gap, parameters: stacked.len() }
    }

    /// Number of base parameters.
    pub fn len(&self) -> usize {
        self.kept.len()
    }

    /// True if nothing can be identified.
    pub fn is_empty(&self) -> bool {
        self.kept.is_empty()
    }

    /// Base values `β = K x` of a full parameter vector.
    ///
    /// # Panics
    /// If `x` has the wrong length.
    pub fn values(&self, x: &[f64]) -> Vec<f64> {
        assert_eq!(x.len(), self.parameters, "length of the parameter vector");
        let mut values: Vec<f64> = self.kept.iter().map(|c| x[*c]).collect();
        for (column, factors) in self.folded.iter().zip(&self.factors) {
            for (value, factor) in values.iter_mut().zip(factors) {
                *value += factor * x[*column];
            }
        }
        values
    }

    /// The parameter vector whose kept columns are `beta` and all others zero: its base values are `beta`.
    ///
    /// # Panics
    /// If `beta` has the wrong length.
    pub fn expanded(&self, beta: &[f64]) -> Vec<f64> {
        assert_eq!(beta.len(), self.len(), "length of beta");
        let mut x = vec![0.0; self.parameters];
        for (column, value) in self.kept.iter().zip(beta) {
            x[*column] = *value;
        }
        x
    }

    /// Regrouping matrix `K`, row-major, `len() × parameters`.
    pub fn matrix(&self) -> Vec<f64> {
        let mut k = vec![0.0; self.len() * self.parameters];
        for (row, column) in self.kept.iter().enumerate() {
            k[row * self.parameters + column] = 1.0;
        }
        for (column, factors) in self.folded.iter().zip(&self.factors) {
            for (row, factor) in factors.iter().enumerate() {
                k[row * self.parameters + column] = *factor;
            }
        }
        k
    }

    /// The parameter vector with base values `beta` that is nearest to `prior`, in the metric in which parameter `i`
    /// may move by `scale[i]`: `min ‖(x - prior) / scale‖` subject to `K x = beta`.
    ///
    /// Parameters that never act keep their prior.
    ///
    /// # Panics
    /// If lengths differ from what they should be.
    pub fn nearest(&self, beta: &[f64], prior: &[f64], scale: &[f64]) -> Vec<f64> {
        assert_eq!(beta.len(), self.len(), "length of beta");
        assert_eq!(prior.len(), self.parameters, "length of prior");
        assert_eq!(scale.len(), self.parameters, "length of scale");
        let n = self.len();
        let missing: Vec<f64> = beta.iter().zip(self.values(prior)).map(|(b, p)| b - p).collect();
        // x = prior + S² Kᵀ y with (K S² Kᵀ) y = missing; the kept part is diagonal, so this is well conditioned.
        let mut gram = Mat::zeros(n, n);
        for (i, c) in self.kept.iter().enumerate() {
            gram[(i, i)] += scale[*c] * scale[*c];
        }
        for (column, factors) in self.folded.iter().zip(&self.factors) {
            let weight = scale[*column] * scale[*column];
            for i in 0..n {
                if factors[i] != 0.0 {
                    for j in 0..n {
                        gram[(i, j)] += weight * factors[i] * factors[j];
                    }
                }
            }
        }
        let rhs = Mat::from_fn(n, 1, |i, _| missing[i]);
        let y = gram.full_lu().solve(&rhs);
        let mut x = prior.to_vec();
        for (i, c) in self.kept.iter().enumerate() {
            x[*c] += scale[*c] * scale[*c] * y[(i, 0)];
        }
        for (column, factors) in self.folded.iter().zip(&self.factors) {
            let pull: f64 = factors.iter().enumerate().map(|(i, f)| f * y[(i, 0)]).sum();
            x[*column] += scale[*column] * scale[*column] * pull;
        }
        x
    }
}

/// Columns in the order in which they are offered: preferred, then ordinary, then those to be folded.
fn preference(table: &ParameterTable, preferred: &[usize]) -> Vec<usize> {
    let mut order: Vec<usize> = preferred.to_vec();
    let mut rest: Vec<usize> = (0..table.linear.len()).filter(|c| !preferred.contains(c)).collect();
    rest.sort_by_key(|c| table.linear[*c].fold_first);
    order.extend(rest);
    order
}

fn singular_values(rows: usize, active: &[usize], columns: &[Vec<f64>]) -> Vec<f64> {
    let matrix = Mat::from_fn(rows, active.len(), |i, j| columns[active[j]][i]);
    matrix.singular_values().unwrap_or_else(|| vec![f64::NAN; active.len().min(rows)])
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    // Four partial sums: fixed order, and independent chains for the processor.
    let mut sums = [0.0; 4];
    let (a4, b4) = (a.chunks_exact(4), b.chunks_exact(4));
    let rest: f64 = a4.remainder().iter().zip(b4.remainder()).map(|(x, y)| x * y).sum();
    for (x, y) in a4.zip(b4) {
        for k in 0..4 {
            sums[k] += x[k] * y[k];
        }
    }
    sums[0] + sums[1] + (sums[2] + sums[3]) + rest
}

/// Gram-Schmidt with every projection done twice, which keeps the directions orthogonal to rounding; blocks of columns are projected together.
struct Projection {
    /// Orthonormal directions, the first [`Projection::count`] columns.
    directions: Mat,
    count: usize,
    /// Column `k` of the triangular factor: coefficients on directions `0..k`, then the length left.
    triangle: Vec<Vec<f64>>,
}

/// Columns of a block, projected on the directions that there were when it began.
struct Remainders {
    columns: Mat,
    /// Coefficients on the directions, one list per column.
    coefficients: Vec<Vec<f64>>,
}

impl Remainders {
    fn coefficients(&mut self, k: usize) -> Vec<f64> {
        std::mem::take(&mut self.coefficients[k])
    }
}

impl Projection {
    fn new(rows: usize, most: usize) -> Self {
        Projection { directions: Mat::zeros(rows, most.min(rows)), count: 0, triangle: Vec::new() }
    }

    fn block<'a>(&self, columns: impl ExactSizeIterator<Item = &'a [f64]>) -> Remainders {
        let (rows, width) = (self.directions.nrows(), columns.len());
        let mut block = Mat::zeros(rows, width);
        for (k, column) in columns.enumerate() {
            block.col_mut(k).copy_from_slice(column);
        }
        let mut coefficients = vec![vec![0.0; self.count]; width];
        if self.count > 0 {
            let directions = self.directions.columns(0..self.count);
            for _ in 0..2 {
                let along = directions.transpose() * &block;
                block -= directions * &along;
                for (k, own) in coefficients.iter_mut().enumerate() {
                    own.iter_mut().zip(along.col(k)).for_each(|(sum, x)| *sum += x);
                }
            }
        }
        Remainders { columns: block, coefficients }
    }

    /// Projects a column of a block on the directions that came since; the length that is left.
    fn project(&self, block: &mut Remainders, k: usize) -> f64 {
        let Remainders { columns, coefficients } = block;
        let (own, residual) = (&mut coefficients[k], columns.col_mut(k));
        let before = own.len();
        own.resize(self.count, 0.0);
        for _ in 0..2 {
            for (place, coefficient) in own.iter_mut().enumerate().skip(before) {
                let direction = self.directions.col(place);
                let along = dot(direction, residual);
                *coefficient += along;
                for (r, d) in residual.iter_mut().zip(direction) {
                    *r -= along * d;
                }
            }
        }
        dot(residual, residual).sqrt()
    }

    fn keep(&mut self, block: &mut Remainders, k: usize, length: f64) {
        let direction = self.directions.col_mut(self.count);
        direction.iter_mut().zip(block.columns.col(k)).for_each(|(d, x)| *d = x / length);
        self.count += 1;
        let mut coefficients = block.coefficients(k);
        coefficients.push(length);
        self.triangle.push(coefficients);
    }

    /// Turns coefficients on the directions into factors on the kept columns: back substitution.
    fn solve(&self, folded: &mut [(usize, Vec<f64>)]) {
        if self.count > FEW_COLUMNS {
            return self.solve_together(folded);
        }
        for (_, x) in folded {
            for k in (0..x.len()).rev() {
                x[k] /= self.triangle[k][k];
                let (earlier, from) = x.split_at_mut(k);
                for (c, t) in earlier.iter_mut().zip(&self.triangle[k]) {
                    *c -= t * from[0];
                }
            }
        }
    }

    /// Solves for all columns together, which sums in another order.
    fn solve_together(&self, folded: &mut [(usize, Vec<f64>)]) {
        let n = self.count;
        let triangle = Mat::from_fn(n, n, |i, k| if i <= k { self.triangle[k][i] } else { 0.0 });
        let mut x = Mat::from_fn(n, folded.len(), |i, c| folded[c].1.get(i).copied().unwrap_or(0.0));
        solve_upper_in_place(&triangle, &mut x);
        for (c, (_, out)) in folded.iter_mut().enumerate() {
            *out = x.col(c).to_vec();
        }
    }
}
