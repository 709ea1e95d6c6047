//! Separable least squares: models linear in most of their parameters, `y ≈ Φ(α) c`.
//!
//! For given shape parameters `α` the linear ones follow from `Φ = QR`, so that only `α` is searched, on the residual
//! `r(α) = (1 - QQᵀ) y` with Kaufman's Jacobian `J_k = -(1 - QQᵀ) ∂Φ/∂α_k c`: bounded Levenberg-Marquardt from several
//! starts. Only columns that change are projected again; fixed columns are reduced once per group of rows, whatever the
//! weights.
//!
//! | question | item |
//! |---|---|
//! | rows, columns, derivatives of one's own problem | [`SeparableProblem`] |
//! | an effort model over motion and measured efforts | [`EffortProblem`] |
//! | friction measured in steady motion | [`SteadyRows`] |
//! | several of these together | [`JoinedProblem`] |
//! | the fit | [`fit`], [`SeparableSettings`] |
//! | values, covariance of `(c, α)` together | [`SeparableEstimate`] |
//! | whether the data see a shape parameter | [`ShapeFinding`] |
//! | whether another minimum was reached from other starts | [`StartReport`] |
//!
//! `(ΦᵀΦ)⁻¹` alone is never a covariance: it takes the shape for known.
//!
//! Source: Golub & Pereyra 1973; Kaufman 1975; Moré 1978 for scaling and damping.

mod boxed;
mod dense;
mod effort_problem;
mod estimate;
mod fit;
mod joined;
mod levenberg;
mod limit;
mod linearised;
mod places;
mod polish;
mod problem;
mod profile;
mod projection;
mod reduction;
mod robust;
mod scale;
mod settings;
mod sobol;
mod starts;
mod steady_rows;
mod work;

pub use effort_problem::{EffortBlock, EffortProblem};
pub use estimate::{Deviations, SeparableEstimate};
pub use fit::fit;
pub use joined::JoinedProblem;
pub use levenberg::SearchStatus;
pub use limit::{Bound, limit_model};
pub use places::{OutputPlaces, places};
pub use problem::{RowGroup, SeparableProblem, ShapedColumns};
pub use profile::{ShapeFinding, ShapeVerdict};
pub use settings::{SeparableError, SeparableLoss, SeparableSettings, ShapeSearch, Weighting};
pub use starts::{StartOutcome, StartReport};
pub use steady_rows::{SteadyFrictionRow, SteadyRows};
