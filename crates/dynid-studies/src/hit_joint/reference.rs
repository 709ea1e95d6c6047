//! Reference numbers of an independent implementation (NumPy; recursions with 60 digits in mpmath as well), embedded.

use serde::Deserialize;

use super::Values;
use crate::StudyError;
use crate::reference::parse;

#[derive(Debug, Deserialize)]
pub(super) struct Parts {
    pub(super) paul: Paul,
    pub(super) spring: Spring,
    pub(super) friction: Friction,
    pub(super) forgetting: Forgetting,
}

#[derive(Debug, Deserialize)]
pub(super) struct Paul {
    pub(super) v: f64,
    pub(super) blend: f64,
    pub(super) cruise: f64,
    pub(super) t: Vec<f64>,
    pub(super) theta: Vec<f64>,
    pub(super) theta_d: Vec<f64>,
    pub(super) theta_dd: Vec<f64>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Spring {
    pub(super) k1: f64,
    pub(super) k2: f64,
    pub(super) torque: Vec<f64>,
    pub(super) dtheta: Vec<f64>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Friction {
    pub(super) theta_in_d: Vec<f64>,
    #[serde(rename = "T_d_in")]
    pub(super) torque: Vec<f64>,
    pub(super) cyclic: Cyclic,
}

#[derive(Debug, Deserialize)]
pub(super) struct Cyclic {
    pub(super) theta_out: Vec<f64>,
    #[serde(rename = "T_b")]
    pub(super) torque: Vec<f64>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Forgetting {
    pub(super) alpha: f64,
    pub(super) beta: f64,
    pub(super) relative_error: Vec<f64>,
    pub(super) lam: Vec<f64>,
}

#[derive(Debug, Deserialize)]
pub(super) struct LeastSquares {
    pub(super) clean: Clean,
    pub(super) noisy: Noisy,
}

#[derive(Debug, Deserialize)]
pub(super) struct Measured {
    pub(super) dtheta: Vec<f64>,
    pub(super) theta_in_d: Vec<f64>,
    pub(super) theta_out_d: Vec<f64>,
    pub(super) motor_torque: Vec<f64>,
    #[serde(rename = "T_out")]
    pub(super) link_torque: Vec<f64>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Clean {
    #[serde(flatten)]
    pub(super) measured: Measured,
    pub(super) theta_in_dd: Vec<f64>,
    pub(super) solution: Values,
    pub(super) truth: Values,
}

#[derive(Debug, Deserialize)]
pub(super) struct Noisy {
    #[serde(flatten)]
    pub(super) measured: Measured,
    pub(super) solution_coupled_6: Values,
    pub(super) eq1_no_damping: Vec<f64>,
    pub(super) eq2_no_damping: Vec<f64>,
    pub(super) coupled_no_damping: Vec<f64>,
    pub(super) eq1_coulomb: Vec<f64>,
    pub(super) eq2_coulomb: Vec<f64>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Recursion {
    pub(super) units: Values,
    pub(super) floor: f64,
    pub(super) alpha: f64,
    pub(super) beta: f64,
    pub(super) compare_from_step: usize,
    /// `Δ, θ̇_in, θ̇_out`, and the left-hand sides of both rows.
    pub(super) rows: Vec<[f64; 5]>,
    pub(super) variable: Sequence,
    pub(super) constant: Sequence,
}

/// Estimates step by step.
#[derive(Debug, Deserialize)]
pub(super) struct Sequence {
    /// By the covariance recursion in double precision.
    pub(super) double: Vec<Values>,
    /// By the same with 60 digits.
    pub(super) exact: Vec<Values>,
}

pub(super) fn parts() -> Result<Parts, StudyError> {
    parse("hit_joint/reference/parts.json", include_str!("reference/parts.json"))
}

pub(super) fn least_squares() -> Result<LeastSquares, StudyError> {
    parse("hit_joint/reference/least_squares.json", include_str!("reference/least_squares.json"))
}

pub(super) fn recursion() -> Result<Recursion, StudyError> {
    parse("hit_joint/reference/recursion.json", include_str!("reference/recursion.json"))
}
