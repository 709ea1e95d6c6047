//! Estimates while a machine runs.
//!
//! The recursive estimator is a crate of its own, `dynid-online`, which needs no standard library and
//! allocates at construction only; all of it is here again. Beside it stands what needs more: conversions
//! between its state and [`Factor`](dynid_factor::Factor), physical consistency of the estimate, the Chow test,
//! and hypotheses on what changed.

mod chow;
mod consistent;
mod factor;
mod hypotheses;

pub use chow::{ChowTest, MovedParameter, chow_test};
pub use consistent::{ConsistentPublisher, PublishedEstimate};
pub use dynid_online::*;
pub use factor::{factor_from_root, root_from_factor};
pub use hypotheses::{
    ChangeHypothesis, ChangeJudgement, JudgeSettings, JudgedHypothesis, after_change, judge_change,
};
