//! Total least squares with exact columns.

use super::ols::ols;
use dynid_factor::factor::Factor;
use dynid_factor::groups::ReducedGroup;
use dynid_factor::rank::numerical_rank;
use dynid_linalg::Mat;
use dynid_linalg::triangular::solve_upper;

/// `s_min/s_{min-1}` above which the smallest singular value is not told from the next.
const LARGEST_RATIO: f64 = 0.99;

/// Last entry of the singular vector below which the solution lies at infinity.
const LEAST_LAST_ENTRY: f64 = 1e-6;

/// Standard deviations of the errors of the columns of `[W y]`, up to one common factor.
#[derive(Debug, Clone, PartialEq)]
pub struct TlsNoise {
    /// One per column of `W`, in its unit; zero: the column is exact (a constant, the sign of a commanded velocity).
    pub columns: Vec<f64>,
    /// Of the effort, positive.
    pub effort: f64,
}

/// Solution of [`tls`].
#[derive(Debug, Clone, PartialEq)]
pub struct TlsSolution {
    /// `p` parameters; those of dropped columns are zero.
    pub x: Vec<f64>,
    /// Independent columns the solution uses, ascending.
    pub kept: Vec<usize>,
    /// Unexcited and dependent columns left out, ascending.
    pub dropped: Vec<usize>,
    /// `σ² = s_min²/(N - p)`: square of the common factor of the stated standard deviations, 1 where they hold
    /// absolutely. `None` without a degree of freedom.
    pub variance: Option<f64>,
    /// Singular values of the trailing block `[W_noisy y]` left after the exact columns are eliminated, in units of
    /// the stated standard deviations, descending.
    pub singular_values: Vec<f64>,
    /// Number `N` of rows.
    pub rows: usize,
}

/// Total least squares has no unique solution: no parameters could be told from others.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TlsRefusal {
    /// The two smallest singular values agree, so every combination of their vectors fits as well.
    #[error(
        "total least squares has no unique solution: the two smallest singular values have ratio {ratio:.4}, expected at most 0.99"
    )]
    RepeatedSingularValue {
        /// `s_min/s_{min-1}`.
        ratio: f64,
    },
    /// The smallest singular value belongs to the columns alone, so that no finite parameters reach it.
    #[error(
        "total least squares has no finite solution: the effort's share in the last singular vector is {share:.1e}, expected at least 1e-6"
    )]
    EffortNotInvolved {
        /// `|v_end|`.
        share: f64,
    },
    /// The decomposition of the trailing block failed, which takes numbers beyond the range of double precision.
    #[error("the singular values of the noisy columns could not be computed")]
    Decomposition,
}

/// Total least squares where some columns are exact:
/// `min Σ_k (e_k²/s_y² + Σ_c E_kc²/s_c²)` subject to `(W - E) x = y - e`, no error in columns of `s_c = 0`.
///
/// Columns are divided by their stated standard deviation (exact ones by their norm), ordered exact, noisy, effort, and
/// triangularised again from the factor. Of the trailing block of noisy columns and effort, the last right singular
/// vector `v` gives `x_n = -v_{1..}/v_end`; the exact columns follow by back substitution. Without a noisy column it is
/// ordinary least squares. Errors must be independent between rows and columns, and alike in all rows.
///
/// Dependent and unexcited columns are dropped as in [`super::ols`]. Fails with [`TlsRefusal`] if the solution is not
/// unique. Panics unless there is one standard deviation per column, none negative, and that of the effort positive.
///
/// Source: Golub, Hoffman & Stewart 1987; Van Huffel & Vandewalle 1991, section 3.5.
pub fn tls(factor: &Factor, noise: &TlsNoise) -> Result<TlsSolution, TlsRefusal> {
    assert_eq!(noise.columns.len(), factor.columns(), "one standard deviation per column");
    assert!(noise.columns.iter().all(|s| *s >= 0.0 && s.is_finite()), "standard deviations are not negative");
    assert!(noise.effort > 0.0 && noise.effort.is_finite(), "the effort has noise");
    let kept = numerical_rank(factor).independent;
    let dropped: Vec<usize> = (0..factor.columns()).filter(|c| kept.binary_search(c).is_err()).collect();
    let (exact, noisy): (Vec<usize>, Vec<usize>) = kept.iter().partition(|c| noise.columns[**c] == 0.0);
    let order = [exact.clone(), noisy.clone()].concat();
    let ordered = factor.select(&order);
    let (p, first) = (order.len(), exact.len());
    let (r, z) = (ordered.r_matrix(), ordered.z());
    let norms = factor.column_norms();
    let scales: Vec<f64> = order
        .iter()
        .map(|&c| if noise.columns[c] == 0.0 { norms[c] } else { noise.columns[c] } / noise.effort)
        .collect();

    let size = p - first + 1;
    let trailing = Mat::from_fn(size, size, |i, j| {
        let (row, column) = (first + i, first + j);
        match (row < p, column < p) {
            (true, true) => r[(row, column)] / scales[column],
            (true, false) => z[row],
            (false, true) => 0.0,
            (false, false) => ordered.rho(),
        }
    });
    let (noisy_x, singular_values) = last_singular_vector(&trailing)?;
    let mut scaled = vec![0.0; p];
    scaled[first..].copy_from_slice(&noisy_x);
    let top = Mat::from_fn(first, first, |i, j| r[(i, j)] / scales[j]);
    let right = Mat::from_fn(first, 1, |i, _| {
        z[i] - (first..p).map(|j| r[(i, j)] / scales[j] * scaled[j]).sum::<f64>()
    });
    let exact_x = solve_upper(&top, &right);
    (0..first).for_each(|i| scaled[i] = exact_x[(i, 0)]);

    let mut x = vec![0.0; factor.columns()];
    for ((&column, value), scale) in order.iter().zip(&scaled).zip(&scales) {
        x[column] = value / scale;
    }
    // The block was formed in the effort's unit; singular values are stated in units of standard deviations.
    let singular_values: Vec<f64> = singular_values.iter().map(|s| s / noise.effort).collect();
    let least = singular_values.last().copied().unwrap_or(0.0);
    let variance = (factor.rows() > p).then(|| least * least / (factor.rows() - p) as f64);
    Ok(TlsSolution { x, kept, dropped, variance, singular_values, rows: factor.rows() })
}

/// `-v_{1..}/v_end` of the last right singular vector of a square block, and all singular values, descending.
fn last_singular_vector(block: &Mat) -> Result<(Vec<f64>, Vec<f64>), TlsRefusal> {
    let size = block.nrows();
    let decomposition = block.svd().ok_or(TlsRefusal::Decomposition)?;
    let values = decomposition.values;
    if size > 1 {
        let ratio = values[size - 1] / values[size - 2];
        if ratio.is_nan() || ratio > LARGEST_RATIO {
            return Err(TlsRefusal::RepeatedSingularValue { ratio });
        }
    }
    let vector = decomposition.v.col(size - 1);
    let last = vector[size - 1];
    if last.abs() < LEAST_LAST_ENTRY {
        return Err(TlsRefusal::EffortNotInvolved { share: last.abs() });
    }
    Ok(((0..size - 1).map(|i| -vector[i] / last).collect(), values))
}

/// What the residual of a group tells of the errors of its columns: `E{W error | r} = -r gᵀ`.
pub(crate) struct ColumnErrors {
    /// Variance of a residual over that of the effort, `1 + Σ_c x_c² s_c²/s_y²` over the columns that act.
    pub(crate) d: f64,
    x: Vec<f64>,
    /// `g_c = x_c s_c²/(s_y² d)`.
    g: Vec<f64>,
}

impl ColumnErrors {
    pub(crate) fn new(noise: &TlsNoise, group: &ReducedGroup, x: &[f64]) -> Self {
        let ratio = |c: usize| (noise.columns[c] / noise.effort).powi(2);
        let d = 1.0 + group.columns.iter().map(|&c| ratio(c) * x[c] * x[c]).sum::<f64>();
        ColumnErrors {
            d,
            x: group.columns.iter().map(|&c| x[c]).collect(),
            g: group.columns.iter().map(|&c| ratio(c) * x[c] / d).collect(),
        }
    }

    /// The group with columns freed of these errors; its residuals at `x` stay.
    pub(crate) fn removed(&self, group: &ReducedGroup) -> ReducedGroup {
        let blocks = group.blocks.iter().map(|b| b.with_residual_in_columns(&self.x, &self.g)).collect();
        ReducedGroup { columns: group.columns.clone(), blocks, ..*group }
    }
}

/// Solution of [`tls_groups`].
pub(crate) struct GroupedTls {
    pub(crate) x: Vec<f64>,
    pub(crate) kept: Vec<usize>,
    pub(crate) passes: usize,
    pub(crate) converged: bool,
    /// Whether one singular value decomposition of all rows holds the solution.
    pub(crate) alike: bool,
}

/// Change of `x`, relative to its standard deviation, at which the iteration over groups stops.
const GROUPED_TOLERANCE: f64 = 1e-9;

/// Total least squares over groups that different noisy columns act on, `min Σ_j rss_j(x)/d_j(x)`.
///
/// Where all noisy columns act on all groups this is [`tls`] of the merged rows. Otherwise it is iterated from least
/// squares: columns freed of the errors that the residuals at `x` tell, rows divided by `√d_j`, solved again. A fixed
/// point is stationary.
pub(crate) fn tls_groups(
    groups: &[ReducedGroup],
    factors: &[Factor],
    total: usize,
    noise: &TlsNoise,
    max_passes: usize,
) -> Result<GroupedTls, TlsRefusal> {
    let all = Factor::merge(&factors.iter().collect::<Vec<_>>());
    let noisy: Vec<usize> = (0..total).filter(|&c| noise.columns[c] > 0.0).collect();
    if groups.iter().all(|g| noisy.iter().all(|c| g.columns.contains(c))) {
        let TlsSolution { x, kept, .. } = tls(&all, noise)?;
        return Ok(GroupedTls { x, kept, passes: 1, converged: true, alike: true });
    }
    let start = ols(&all);
    let (mut x, kept) = (start.x, start.kept);
    for passes in 1..=max_passes {
        let corrected: Vec<Factor> = groups
            .iter()
            .map(|group| {
                let errors = ColumnErrors::new(noise, group, &x);
                errors.removed(group).merged(total).scaled(1.0 / errors.d.sqrt())
            })
            .collect();
        let solution = ols(&Factor::merge(&corrected.iter().collect::<Vec<_>>()).select(&kept));
        let unit = solution.unit_covariance();
        let variance = solution.residual_variance().unwrap_or(1.0);
        let mut moved = 0.0_f64;
        for (i, &k) in solution.kept.iter().enumerate() {
            let step = (solution.x[k] - x[kept[k]]).abs();
            if step > 0.0 {
                moved = moved.max(step / (variance * unit[(i, i)]).sqrt().max(f64::EPSILON * step));
            }
        }
        for (&column, value) in kept.iter().zip(&solution.x) {
            x[column] = *value;
        }
        if moved < GROUPED_TOLERANCE || passes == max_passes {
            let converged = moved < GROUPED_TOLERANCE;
            return Ok(GroupedTls { x, kept, passes, converged, alike: false });
        }
    }
    Ok(GroupedTls { x, kept, passes: 0, converged: false, alike: false })
}
