//! Identification of machines whose friction follows their reaction forces (Rosyid & El-Khasawneh 2020).
//!
//! A drive `j` (a slider, a driven joint) feels, at sample `t`,
//!
//! ```text
//! τ_j = W_j φ + [μ_c + (μ_s - μ_c) exp(-(|v_j|/v_s)^δ)] F_j sign v_j + μ_c w_j·φ sign v_j + f_v v_j
//! F_j = Σ_k |N_jk φ|
//! ```
//!
//! with inertial parameters `φ`, the reactions `N_jk φ` that press on the drive, and a normal force `w_j · φ` that does not
//! change. Nothing here knows a mechanism: `W`, `N`, `w` and `v` come as arrays. Unknown is `θ = [φ, μ_c, f_v, μ_s, v_s]`,
//! in units of the effort per unit of the parameter; normal forces have the unit of the effort.
//!
//! | question | item |
//! |---|---|
//! | a motion as arrays | [`Record`], [`DriveRows`] |
//! | measured efforts, friction law, samples that count | [`Problem`], [`Settings`], [`Model`] |
//! | efforts, friction, normal forces, also on another record | [`Problem::predict`], [`Problem::predict_on`] |
//! | residuals and exact derivatives | [`Problem::residuals`], [`Problem::jacobian`] |
//! | the misfit for [`dynid_search`] | [`SquaredResiduals`] |
//! | least squares within bounds over all of `θ` | [`fit_bounded`] |
//! | the same with `φ` and `f_v` eliminated | [`fit_separated`] |
//! | rank, free directions, standard deviations of combinations | [`Problem::identifiability`] |
//! | the free directions filled from design values, bodies that can exist | [`nearest_to_design`] |
//! | what each value rests on | [`verdicts`] |
//!
//! In the inverse model nothing is implicit: reactions come from rows without friction. Signs of reactions make `J` piecewise
//! smooth. Masses and moments that move no effort and no reaction stay undetermined whatever the method.

mod barrier;
mod bounded;
mod error;
mod free_directions;
mod identifiability;
mod law;
mod objective;
mod predict;
mod problem;
mod record;
mod separated;
mod verdict;

pub use bounded::{BoundedFit, FitSettings, fit_bounded};
pub use error::LoadFrictionError;
pub use free_directions::{Design, DesignStatus, NearestDesign, PlanarBody, nearest_to_design};
pub use identifiability::{CombinationValue, Identifiability};
pub use law::{FrictionParameter, Model};
pub use objective::SquaredResiduals;
pub use predict::{DrivePrediction, Prediction};
pub use problem::{Problem, Settings};
pub use record::{DriveRows, Record};
pub use separated::{SeparatedFit, SignStatus, fit_separated};
pub use verdict::{Verdict, verdicts};
