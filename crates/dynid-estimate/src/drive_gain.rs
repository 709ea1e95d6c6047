//! Drive gains from a known load: what stands beside the inverse form.
//!
//! Where currents `i = (W x + w_L)/g` were logged with and without a known load `w_L`, the current is regressed on
//! exact columns, `i = W (x/g) + w_L (1/g)`. Moving it to the regressor, `w_L = g i - W x`, brings its noise there and pulls
//! `g` towards zero.

use crate::least_squares::{TlsNoise, ols, tls};
use dynid_factor::factor::Factor;
use dynid_factor::rank::numerical_rank;

/// What the rows of one drive say about its load column.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadColumn {
    /// Share of the column's length that is left after projection on all others, 0 to 1.
    pub share: f64,
    /// `g` by least squares with the current as a column; biased by its noise. `None` if the column is not independent.
    pub plain: Option<f64>,
    /// `g` by total least squares with all columns scaled to unit length and taken for equally noisy; `None` if there is no
    /// unique solution.
    pub total: Option<f64>,
}

/// Judges the load column of one drive. `factor`: its rows, weighted; `load`: column of `w_L`.
///
/// # Panics
/// If there is no such column.
pub fn load_column(factor: &Factor, load: usize) -> LoadColumn {
    let norms = factor.column_norms();
    if norms[load] <= 0.0 {
        return LoadColumn { share: 0.0, plain: None, total: None };
    }
    let others: Vec<usize> = (0..factor.columns()).filter(|c| *c != load && norms[*c] > 0.0).collect();
    let rest = factor.select(&others);
    let kept: Vec<usize> = numerical_rank(&rest).independent.iter().map(|k| others[*k]).collect();
    let order: Vec<usize> = kept.iter().copied().chain([load]).collect();
    let ordered = factor.select(&order);
    let last = order.len() - 1;
    let share = match ordered.height() > last {
        true => (ordered.r(last, last).abs() / norms[load]).min(1.0),
        false => 0.0,
    };
    let finite = |g: f64| g.is_finite().then_some(g);
    let exchanged = ols(&ordered.with_effort_exchanged(last));
    let noise = TlsNoise { columns: ordered.column_norms(), effort: ordered.effort_norm() };
    let usable = noise.effort > 0.0 && noise.columns.iter().all(|c| *c > 0.0);
    LoadColumn {
        share,
        plain: exchanged.kept.contains(&last).then(|| exchanged.x[last]).and_then(finite),
        total: usable.then(|| tls(&ordered, &noise).ok()).flatten().and_then(|t| finite(1.0 / t.x[last])),
    }
}
