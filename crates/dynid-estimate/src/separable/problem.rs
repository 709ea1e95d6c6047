//! Problems that are linear in most of their parameters, as rows.

use super::SeparableError;
use super::limit::Bound;
use dynid_model::ShapeParameter;

/// Rows that share a residual variance: one output of one log at one kernel scale, in time order.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RowGroup {
    /// Index of the log.
    pub log: usize,
    /// Index of the output.
    pub output: usize,
    /// Index of the kernel scale, 0 = widest.
    pub scale: usize,
    /// Rows of each time block, in order; they sum to the rows of the group.
    pub block_rows: Vec<usize>,
    /// Linear parameters with a column here that no shape parameter changes.
    pub fixed: Vec<usize>,
    /// Columns of the fixed parameters: `fixed_values[k * rows + i]`, effort per unit of the parameter.
    pub fixed_values: Vec<f64>,
    /// Measured effort less what is known of it.
    pub effort: Vec<f64>,
    /// Columns that shape parameters change: the linear parameter, or `None` for a column that is known, that is, has
    /// the factor 1.
    pub shaped: Vec<Option<usize>>,
    /// `(index into shaped, shape parameter)` where that column depends on that parameter, each pair once.
    pub dependence: Vec<(usize, usize)>,
}

impl RowGroup {
    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.effort.len()
    }

    /// The `k`-th fixed column.
    pub(super) fn fixed_column(&self, k: usize) -> &[f64] {
        &self.fixed_values[k * self.rows()..][..self.rows()]
    }
}

/// Values and derivatives of the shaped columns of one [`RowGroup`].
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ShapedColumns {
    rows: usize,
    values: Vec<f64>,
    derivatives: Vec<f64>,
}

impl ShapedColumns {
    /// Columns of zeros for a group.
    pub fn new(group: &RowGroup) -> Self {
        let rows = group.rows();
        ShapedColumns {
            rows,
            values: vec![0.0; rows * group.shaped.len()],
            derivatives: vec![0.0; rows * group.dependence.len()],
        }
    }

    /// The column of an entry of [`RowGroup::shaped`].
    pub fn value(&self, k: usize) -> &[f64] {
        &self.values[k * self.rows..][..self.rows]
    }

    /// Values of a shaped column, to be written.
    pub fn value_mut(&mut self, k: usize) -> &mut [f64] {
        &mut self.values[k * self.rows..][..self.rows]
    }

    /// The derivative that an entry of [`RowGroup::dependence`] stands for.
    pub fn derivative(&self, d: usize) -> &[f64] {
        &self.derivatives[d * self.rows..][..self.rows]
    }

    /// A derivative of a shaped column, to be written.
    pub fn derivative_mut(&mut self, d: usize) -> &mut [f64] {
        &mut self.derivatives[d * self.rows..][..self.rows]
    }

    /// Makes all entries zero, to be added to.
    pub fn clear(&mut self) {
        self.values.fill(0.0);
        self.derivatives.fill(0.0);
    }

    pub(super) fn is_finite(&self) -> bool {
        self.values.iter().chain(&self.derivatives).all(|v| v.is_finite())
    }
}

/// A model `y ≈ Φ(α) c` over groups of rows: `c` linear, `α` shape parameters.
///
/// Without linear parameters (all shaped columns known) this is a general nonlinear least-squares problem with bounds,
/// `y ≈ f(α)`.
pub trait SeparableProblem: Sync {
    /// Number of linear parameters.
    fn linear(&self) -> usize;
    /// Shape parameters: start, bounds, scale. Infinite bounds are allowed; a parameter with one is held at its start
    /// in the other starts of the multi-start and has no profile.
    fn shape(&self) -> &[ShapeParameter];
    /// The rows.
    fn groups(&self) -> &[RowGroup];
    /// Writes the shaped columns of all groups and their exact derivatives, in the unit of the shape parameter.
    ///
    /// `out`: one entry per group. A value that is not finite makes the solver shorten its step.
    fn shaped(&self, shape: &[f64], out: &mut [ShapedColumns]);
    /// The simpler model that a shape parameter at a bound stands for; by default what [`super::limit_model`] says.
    fn limit(&self, parameter: usize, bound: Bound) -> Option<&'static str> {
        super::limit_model(&self.shape()[parameter].name, bound)
    }
}

/// Refuses problems that are not well formed.
pub(super) fn check(problem: &dyn SeparableProblem) -> Result<(), SeparableError> {
    for parameter in problem.shape() {
        let ShapeParameter { lower, upper, start, .. } = *parameter;
        let name = || parameter.name.clone();
        if lower.is_nan() || upper.is_nan() || lower > upper {
            return Err(SeparableError::Bounds { name: name(), lower, upper });
        }
        if !start.is_finite() {
            return Err(SeparableError::Start { name: name(), found: start });
        }
        if parameter.logarithmic && (lower < 0.0 || upper <= 0.0 || start <= 0.0) {
            return Err(SeparableError::Logarithm { name: name(), lower, start });
        }
    }
    if problem.groups().iter().all(|g| g.rows() == 0) {
        return Err(SeparableError::NoRows);
    }
    problem.groups().iter().enumerate().try_for_each(|(g, group)| {
        check_group(group, problem.linear(), problem.shape().len()).map_err(|source| source.of_group(g))
    })
}

/// What is wrong with a group, before its index is known.
enum Fault {
    Size { what: &'static str, expected: usize, found: usize },
    NotFinite { column: Option<usize>, row: usize, found: f64 },
}

impl Fault {
    fn of_group(self, group: usize) -> SeparableError {
        match self {
            Fault::Size { what, expected, found } => SeparableError::Size { group, what, expected, found },
            Fault::NotFinite { column, row, found } => {
                SeparableError::NotFinite { group, column, row, found }
            }
        }
    }
}

fn check_group(group: &RowGroup, linear: usize, shape: usize) -> Result<(), Fault> {
    let rows = group.rows();
    let same = |what, expected, found| {
        if expected == found { Ok(()) } else { Err(Fault::Size { what, expected, found }) }
    };
    let below = |what, expected: usize, found: usize| {
        if found < expected { Ok(()) } else { Err(Fault::Size { what, expected, found }) }
    };
    same("rows of all time blocks", rows, group.block_rows.iter().sum())?;
    same("values of fixed columns", rows * group.fixed.len(), group.fixed_values.len())?;
    for &column in group.fixed.iter().chain(group.shaped.iter().flatten()) {
        below("index of a linear parameter, below", linear, column)?;
    }
    for &(entry, parameter) in &group.dependence {
        below("index of a shaped column, below", group.shaped.len(), entry)?;
        below("index of a shape parameter, below", shape, parameter)?;
    }
    let finite = |column: Option<usize>, values: &[f64]| match values.iter().position(|v| !v.is_finite()) {
        Some(row) => Err(Fault::NotFinite { column, row, found: values[row] }),
        None => Ok(()),
    };
    finite(None, &group.effort)?;
    group.fixed.iter().enumerate().try_for_each(|(k, column)| finite(Some(*column), group.fixed_column(k)))
}
