//! Predicted efforts in parts, on any record.

use super::error::{LoadFrictionError, same_size};
use super::law::{Model, check_theta, decay, direction, split};
use super::problem::{Problem, Settings, dot};
use super::record::{Record, product};

/// Predicted efforts of a drive and what they consist of, per sample.
#[derive(Debug, Clone, PartialEq)]
pub struct DrivePrediction {
    /// `frictionless + friction`.
    pub effort: Vec<f64>,
    /// `W φ`.
    pub frictionless: Vec<f64>,
    /// Friction; without its sign-dependent part at rest.
    pub friction: Vec<f64>,
    /// `F`: `Σ_k |N_k φ|`, or the mean of [`Model::Constant`].
    pub normal: Vec<f64>,
    /// `w · φ`.
    pub constant_normal: f64,
    /// Whether the drive moves, faster than [`Settings::rest_speed`].
    pub moving: Vec<bool>,
}

/// Predicted efforts of all drives.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    /// One entry per drive.
    pub drives: Vec<DrivePrediction>,
}

impl Prediction {
    /// RMS of `efforts - predicted` over the moving samples of all drives; `None` if nothing moves.
    ///
    /// # Errors
    /// Sizes that differ.
    pub fn rms_error(&self, efforts: &[Vec<f64>]) -> Result<Option<f64>, LoadFrictionError> {
        same_size("drives with efforts", self.drives.len(), efforts.len())?;
        let (mut sum, mut count) = (0.0, 0_usize);
        for (j, (drive, effort)) in self.drives.iter().zip(efforts).enumerate() {
            same_size(format!("efforts of drive {j}"), drive.effort.len(), effort.len())?;
            for ((predicted, measured), _) in
                drive.effort.iter().zip(effort).zip(&drive.moving).filter(|(_, moving)| **moving)
            {
                sum += (measured - predicted).powi(2);
                count += 1;
            }
        }
        Ok((count > 0).then(|| (sum / count as f64).sqrt()))
    }
}

impl Problem {
    /// Efforts at `θ` on the record of the problem, all samples.
    ///
    /// # Errors
    /// Fails as [`Problem::residuals`] does.
    pub fn predict(&self, theta: &[f64]) -> Result<Prediction, LoadFrictionError> {
        self.predict_on(&self.record, theta)
    }

    /// Efforts at `θ` on another record of the same machine. [`Model::Constant`] keeps the mean normal forces of the
    /// problem's own record.
    ///
    /// # Errors
    /// Fails as [`Problem::residuals`] does, and for a record with other numbers of drives or inertial parameters.
    pub fn predict_on(&self, record: &Record, theta: &[f64]) -> Result<Prediction, LoadFrictionError> {
        check_theta(self.settings.model, self.inertial(), theta)?;
        same_size("drives of the record", self.record.drives().len(), record.drives().len())?;
        same_size("inertial parameters of the record", self.inertial(), record.inertial())?;
        let drives = (0..record.drives().len()).map(|j| self.predict_drive(record, j, theta)).collect();
        Ok(Prediction { drives })
    }

    fn predict_drive(&self, record: &Record, j: usize, theta: &[f64]) -> DrivePrediction {
        let (rows, x) = (&record.drives()[j], split(theta));
        let Settings { model, exponent, rest_speed } = self.settings;
        let frictionless = product(&rows.regressor, x.inertial);
        let mut normal = vec![0.0; record.samples()];
        if model == Model::Constant {
            normal.fill(self.mean_normal_force(j, x.inertial));
        } else {
            for reaction in &rows.reactions {
                let force = product(reaction, x.inertial);
                normal.iter_mut().zip(&force).for_each(|(n, f)| *n += f.abs());
            }
        }
        let constant_normal = dot(&rows.weight, x.inertial);
        let friction: Vec<f64> = (rows.speed.iter().zip(&normal))
            .map(|(v, f)| {
                let (e, _) = decay(model, exponent, *v, x.stribeck);
                let stribeck = x.coulomb + (x.stick - x.coulomb) * e;
                direction(*v, rest_speed) * (stribeck * f + x.coulomb * constant_normal) + x.viscous * v
            })
            .collect();
        DrivePrediction {
            effort: frictionless.iter().zip(&friction).map(|(a, b)| a + b).collect(),
            frictionless,
            friction,
            normal,
            constant_normal,
            moving: rows.speed.iter().map(|v| direction(*v, rest_speed) != 0.0).collect(),
        }
    }
}
