//! Rows d and e: base parameters by least squares.

use dynid::estimators::distribution::t_quantile;
use dynid::estimators::linear::{LinearSolution, ols};
use serde_json::json;

use super::data::{Data, Knowledge, factor, rms};
use super::parameters::{BASE, Parameters};
use super::pointing::Pointing;
use super::{JOINTS, fault};
use crate::{Row, StudyError};

/// Level of the intervals.
pub(super) const LEVEL: f64 = 0.95;
/// Names of the base parameters, in order.
pub(super) const SYMBOLS: [&str; BASE] = ["π1", "π2", "π3", "π4", "π5", "π6", "π7", "π8"];

/// A fit of base parameters and friction.
#[derive(Debug)]
pub(super) struct Fitted {
    /// Base parameters, friction entries, with clearance also mass 2.
    pub(super) x: Vec<f64>,
    /// Half widths of their intervals.
    pub(super) half: Vec<f64>,
    /// Residual torque, joint 1 then joint 2, N m.
    pub(super) residual: Vec<f64>,
}

/// Half widths of intervals that take residuals for white noise of one variance.
pub(super) fn half_widths(solution: &LinearSolution) -> Result<Vec<f64>, StudyError> {
    let freedom = (solution.rows - solution.kept.len()) as f64;
    let t = t_quantile(0.5 + 0.5 * LEVEL, freedom).ok_or_else(|| fault("no degrees of freedom"))?;
    let deviations = solution.standard_deviations(solution.residual_variance().unwrap_or(f64::NAN));
    Ok(deviations.into_iter().map(|d| t * d.unwrap_or(f64::INFINITY)).collect())
}

impl Fitted {
    /// `mass`: mass 2 with its standard deviation, as far as it is known beforehand. Torques hardly show it.
    pub(super) fn new(
        data: &Data,
        torque: &[f64],
        knowledge: Knowledge,
        mass: Option<[f64; 2]>,
    ) -> Result<Self, StudyError> {
        let columns = data.base_columns(knowledge);
        let mut factor = factor(&columns, torque)?;
        if let (Some([value, deviation]), Knowledge::Clearance) = (mass, knowledge) {
            let noise = ols(&factor).residual_variance().unwrap_or(0.0).sqrt();
            let only =
                |x: f64| (0..columns.len()).map(|k| if k + 1 == columns.len() { x } else { 0.0 }).collect();
            let (weights, values): (Vec<f64>, Vec<f64>) = (only(noise / deviation), only(value));
            factor = factor.with_prior_rows(&weights, &values);
        }
        let solution = ols(&factor);
        let half = half_widths(&solution)?;
        let mut residual = torque.to_vec();
        for (column, x) in columns.iter().zip(&solution.x) {
            residual.iter_mut().zip(column).for_each(|(r, w)| *r -= x * w);
        }
        Ok(Fitted { x: solution.x, half, residual })
    }

    /// RMS of the residual of both joints, N m.
    pub(super) fn residual_rms(&self) -> f64 {
        rms(self.residual.iter().copied())
    }

    /// Errors of the base parameters.
    pub(super) fn errors(&self, truth: &[f64; BASE]) -> [f64; BASE] {
        std::array::from_fn(|k| self.x[k] - truth[k])
    }
}

/// The noise-free torque fitted by every model.
#[derive(Debug)]
pub(super) struct Fits {
    pub(super) truth: [f64; BASE],
    /// In the order of [`Knowledge::ALL`].
    pub(super) all: [Fitted; 3],
}

impl Fits {
    pub(super) fn new(pointing: &Pointing, data: &Data) -> Result<Self, StudyError> {
        let fit = |knowledge| Fitted::new(data, &data.torque, knowledge, None);
        Ok(Fits {
            truth: Parameters::of(pointing.mechanism())?.base(pointing.length()),
            all: [fit(Knowledge::Clearance)?, fit(Knowledge::Ideal)?, fit(Knowledge::Coulomb)?],
        })
    }

    /// Largest error of a base parameter, and of a friction entry against 1.
    fn exactness(&self) -> [f64; 2] {
        let clearance = &self.all[0];
        let base = clearance.errors(&self.truth).iter().map(|e| e.abs()).fold(0.0, f64::max);
        let friction = clearance.x[BASE..][..JOINTS].iter().map(|k| (k - 1.0).abs()).fold(0.0, f64::max);
        [base, friction]
    }

    /// Rows d and e.
    pub(super) fn rows(&self) -> [Row; 2] {
        let [clearance, ideal, coulomb] = &self.all;
        let [base, friction] = self.exactness();
        let exact = Row::new(
            "d",
            "Least squares on the 8 base parameters, both friction entries and what mass 2 adds with clearance: with the journals' \
             motion known, exact without noise",
            "base parameters 1e-6, friction entries 1e-6",
            json!({ "base": base, "friction": friction, "x": clearance.x, "truth": self.truth,
                    "residual_rms": clearance.residual_rms() }),
            format!("{base:.1e}, {friction:.1e}; residual {:.1e} N m rms", clearance.residual_rms()),
            base <= 1e-6 && friction <= 1e-6,
        );
        let wanted = [0.029393, 0.188999];
        let off = (0..2).map(|k| (coulomb.x[6 + k] - wanted[k]).abs()).fold(0.0, f64::max);
        let residual = coulomb.residual_rms();
        let errors = |fit: &Fitted| fit.errors(&self.truth);
        let (of_ideal, of_coulomb) = (errors(ideal), errors(coulomb));
        let fair = Row::new(
            "e",
            "A fairer baseline, ideal joints with Coulomb friction by the signs of the speeds, removes most of the bias of π7 and π8; \
             what it leaves is the swing of the journals",
            "π7 = 0.029393, π8 = 0.188999 to 1e-4; residual 0.007 to 0.013 N m rms",
            json!({ "pi7": coulomb.x[6], "pi8": coulomb.x[7], "residual_rms": residual,
                    "errors": of_coulomb, "errors_ideal": of_ideal, "friction": coulomb.x[BASE..],
                    "residual_rms_ideal": ideal.residual_rms() }),
            format!(
                "π7 = {:.6}, π8 = {:.6}; residual {residual:.4} N m (ideal {:.4}); errors {:.1e} and {:.1e} against {:.1e} and \
                 {:.1e} without friction; of π1 {:.1e} against {:.1e}",
                coulomb.x[6],
                coulomb.x[7],
                ideal.residual_rms(),
                of_coulomb[6].abs(),
                of_coulomb[7].abs(),
                of_ideal[6].abs(),
                of_ideal[7].abs(),
                of_coulomb[0].abs(),
                of_ideal[0].abs(),
            ),
            off <= 1e-4 && (0.007..=0.013).contains(&residual),
        );
        [exact, fair]
    }
}
