//! A record with measured efforts and a friction law: residuals and their derivatives.

use super::error::{LoadFrictionError, in_range, same_size};
use super::law::{Model, check_theta, decay, direction, split};
use super::record::{Record, finite, product};
use dynid_linalg::Mat;

/// Law and choice of samples.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Friction law. Default [`Model::Stribeck`].
    pub model: Model,
    /// Exponent `δ` of the Stribeck term, positive. Default 1.
    pub exponent: f64,
    /// Samples of a drive below this speed are left out of fits: friction at rest is not determined by the motion. In
    /// predictions their friction has no sign. Not negative, unit of the speed. Default 1e-6.
    pub rest_speed: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Settings { model: Model::Stribeck, exponent: 1.0, rest_speed: 1e-6 }
    }
}

/// What is fitted: `τ_j = W_j φ + friction_j(θ)` against measured efforts, `θ = [φ, μ_c, f_v, μ_s, v_s]`.
///
/// Rows of residuals and Jacobians are the used samples of the first drive, then those of the second, and so on.
#[derive(Debug, Clone)]
pub struct Problem {
    pub(super) record: Record,
    pub(super) settings: Settings,
    pub(super) drives: Vec<UsedRows>,
}

/// Used samples of a drive, column after column.
#[derive(Debug, Clone)]
pub(super) struct UsedRows {
    pub(super) samples: Vec<usize>,
    pub(super) regressor: Vec<f64>,
    pub(super) reactions: Vec<Vec<f64>>,
    pub(super) speed: Vec<f64>,
    pub(super) sign: Vec<f64>,
    pub(super) effort: Vec<f64>,
}

impl UsedRows {
    pub(super) fn rows(&self) -> usize {
        self.samples.len()
    }

    pub(super) fn column<'a>(&self, of: &'a [f64], k: usize) -> &'a [f64] {
        &of[k * self.rows()..][..self.rows()]
    }

    fn keep(&mut self, which: &[bool]) {
        let rows = self.rows();
        let thin = |values: &mut Vec<f64>| {
            let mut at = 0;
            values.retain(|_| {
                at += 1;
                which[(at - 1) % rows]
            });
        };
        thin(&mut self.regressor);
        self.reactions.iter_mut().for_each(thin);
        [&mut self.speed, &mut self.sign, &mut self.effort].into_iter().for_each(thin);
        let mut kept = which.iter();
        self.samples.retain(|_| kept.next().copied().unwrap_or(false));
    }
}

impl Problem {
    /// A record with `efforts[j]`, the measured samples of drive `j`.
    ///
    /// # Errors
    /// Sizes that differ from the record's, efforts that are not finite, settings out of range, and no sample in motion.
    pub fn new(
        record: Record,
        efforts: &[Vec<f64>],
        settings: Settings,
    ) -> Result<Problem, LoadFrictionError> {
        let (rest, exponent) = (settings.rest_speed, settings.exponent);
        in_range("rest speed", "a number that is not negative", rest, rest.is_finite() && rest >= 0.0)?;
        in_range("Stribeck exponent", "a positive number", exponent, exponent.is_finite() && exponent > 0.0)?;
        same_size("drives with efforts", record.drives().len(), efforts.len())?;
        let mut drives = Vec::new();
        for (drive, (rows, effort)) in record.drives().iter().zip(efforts).enumerate() {
            same_size(format!("efforts of drive {drive}"), record.samples(), effort.len())?;
            finite("effort", drive, effort.iter().copied())?;
            let sign: Vec<f64> = rows.speed.iter().map(|v| direction(*v, rest)).collect();
            let moving: Vec<bool> = sign.iter().map(|s| *s != 0.0).collect();
            let flat = |m: &Mat| m.col_iter().flat_map(|c| c.iter().copied()).collect::<Vec<f64>>();
            let mut used = UsedRows {
                samples: (0..record.samples()).collect(),
                regressor: flat(&rows.regressor),
                reactions: rows.reactions.iter().map(flat).collect(),
                speed: rows.speed.clone(),
                sign,
                effort: effort.clone(),
            };
            used.keep(&moving);
            drives.push(used);
        }
        let problem = Problem { record, settings, drives };
        problem.check_samples()?;
        Ok(problem)
    }

    /// Returns the problem without samples of a drive in which one of its reactions `N_k φ` is below `share` of that reaction's RMS
    /// over the used samples: there its size has a kink. Decided once, at the given `φ` (p values), so that the misfit
    /// stays a continuous function of `θ`.
    ///
    /// # Errors
    /// A wrong number of parameters, a share outside `[0, 1)`, and no samples left.
    pub fn without_small_reactions(
        mut self,
        inertial: &[f64],
        share: f64,
    ) -> Result<Problem, LoadFrictionError> {
        same_size("inertial parameters", self.inertial(), inertial.len())?;
        in_range("share of the reaction's RMS", "a number in [0, 1)", share, (0.0..1.0).contains(&share))?;
        for used in &mut self.drives {
            let mut keep = vec![true; used.rows()];
            for reaction in &used.reactions {
                let mut force = vec![0.0; used.rows()];
                add_product(&mut force, reaction, used.rows(), 0, inertial);
                let square: f64 = force.iter().map(|f| f * f).sum();
                let least = share * (square / force.len().max(1) as f64).sqrt();
                keep.iter_mut().zip(&force).for_each(|(k, f)| *k &= f.abs() >= least);
            }
            used.keep(&keep);
        }
        self.check_samples()?;
        Ok(self)
    }

    fn check_samples(&self) -> Result<(), LoadFrictionError> {
        if self.rows() == 0 {
            return Err(LoadFrictionError::NoSamples { samples: self.record.samples() });
        }
        Ok(())
    }

    /// The motion.
    pub fn record(&self) -> &Record {
        &self.record
    }

    /// Law and choice of samples.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Number `p` of inertial parameters.
    pub fn inertial(&self) -> usize {
        self.record.inertial()
    }

    /// Number `p + 4` of all parameters.
    pub fn parameters(&self) -> usize {
        self.inertial() + 4
    }

    /// Rows: used samples of all drives.
    pub fn rows(&self) -> usize {
        self.drives.iter().map(UsedRows::rows).sum()
    }

    /// Indices of the samples of a drive that are used.
    pub fn used_samples(&self, drive: usize) -> &[usize] {
        &self.drives[drive].samples
    }

    /// Measured efforts of the rows.
    pub fn efforts(&self) -> Vec<f64> {
        self.drives.iter().flat_map(|d| d.effort.iter().copied()).collect()
    }

    /// `F` of [`Model::Constant`]: mean normal force of every drive over all samples of the record, in units of effort.
    ///
    /// # Errors
    /// A wrong number of inertial parameters.
    pub fn mean_normal_forces(&self, inertial: &[f64]) -> Result<Vec<f64>, LoadFrictionError> {
        same_size("inertial parameters", self.inertial(), inertial.len())?;
        Ok((0..self.drives.len()).map(|j| self.mean_normal_force(j, inertial)).collect())
    }

    pub(super) fn mean_normal_force(&self, drive: usize, inertial: &[f64]) -> f64 {
        let reactions = &self.record.drives()[drive].reactions;
        let sum: f64 =
            reactions.iter().map(|n| product(n, inertial).iter().map(|f| f.abs()).sum::<f64>()).sum();
        sum / self.record.samples() as f64
    }

    /// Residuals `τ_meas - τ(θ)` of the rows.
    ///
    /// # Errors
    /// A wrong number of parameters, values that are not finite, a Stribeck speed that is not positive.
    pub fn residuals(&self, theta: &[f64]) -> Result<Vec<f64>, LoadFrictionError> {
        check_theta(self.settings.model, self.inertial(), theta)?;
        let mut out = Vec::with_capacity(self.rows());
        for j in 0..self.drives.len() {
            out.extend(self.drives[j].effort.iter().zip(self.used_effort(j, theta)).map(|(y, f)| y - f));
        }
        Ok(out)
    }

    /// `J(θ) = Σ residual²` (Rosyid 2020).
    ///
    /// # Errors
    /// Fails as [`Problem::residuals`] does.
    pub fn sum_of_squares(&self, theta: &[f64]) -> Result<f64, LoadFrictionError> {
        Ok(self.residuals(theta)?.iter().map(|r| r * r).sum())
    }

    /// Exact derivatives `∂τ/∂θ` of the predicted efforts, rows × (p + 4), signs of the reactions held: valid away from
    /// samples where a reaction vanishes.
    ///
    /// # Errors
    /// Fails as [`Problem::residuals`] does.
    pub fn jacobian(&self, theta: &[f64]) -> Result<Mat, LoadFrictionError> {
        check_theta(self.settings.model, self.inertial(), theta)?;
        let mut out = Mat::zeros(self.rows(), self.parameters());
        let mut first = 0;
        for (j, used) in self.drives.iter().enumerate() {
            let flat = self.used_jacobian(j, theta);
            for k in 0..self.parameters() {
                for (i, value) in used.column(&flat, k).iter().enumerate() {
                    out[(first + i, k)] = *value;
                }
            }
            first += used.rows();
        }
        Ok(out)
    }

    /// Predicted efforts of the used samples of a drive.
    pub(super) fn used_effort(&self, j: usize, theta: &[f64]) -> Vec<f64> {
        let (used, x) = (&self.drives[j], split(theta));
        let Settings { model, exponent, .. } = self.settings;
        let mut effort = vec![0.0; used.rows()];
        add_product(&mut effort, &used.regressor, used.rows(), 0, x.inertial);
        let normal = self.used_normal(j, x.inertial);
        let constant = dot(&self.record.drives()[j].weight, x.inertial);
        for (i, to) in effort.iter_mut().enumerate() {
            let (e, _) = decay(model, exponent, used.speed[i], x.stribeck);
            let stribeck = x.coulomb + (x.stick - x.coulomb) * e;
            *to += used.sign[i] * (stribeck * normal[i] + x.coulomb * constant) + x.viscous * used.speed[i];
        }
        effort
    }

    /// `F` of the used samples of a drive.
    fn used_normal(&self, j: usize, inertial: &[f64]) -> Vec<f64> {
        let used = &self.drives[j];
        if self.settings.model == Model::Constant {
            return vec![self.mean_normal_force(j, inertial); used.rows()];
        }
        let mut normal = vec![0.0; used.rows()];
        for reaction in &used.reactions {
            let mut force = vec![0.0; used.rows()];
            add_product(&mut force, reaction, used.rows(), 0, inertial);
            normal.iter_mut().zip(&force).for_each(|(n, f)| *n += f.abs());
        }
        normal
    }

    /// `∂F/∂φ` of the used samples of a drive, column after column, with the signs of the reactions at `φ`.
    pub(super) fn used_normal_rows(&self, j: usize, inertial: &[f64]) -> Vec<f64> {
        let used = &self.drives[j];
        let rows = used.rows();
        let mut out = vec![0.0; rows * self.inertial()];
        if self.settings.model == Model::Constant {
            for reaction in &self.record.drives()[j].reactions {
                let force = product(reaction, inertial);
                for (k, to) in out.chunks_exact_mut(rows.max(1)).enumerate() {
                    let column = reaction.col(k);
                    let sum: f64 = column.iter().zip(&force).map(|(n, f)| n * sign(*f)).sum();
                    to.iter_mut().for_each(|t| *t += sum / self.record.samples() as f64);
                }
            }
            return out;
        }
        for reaction in &used.reactions {
            let mut force = vec![0.0; rows];
            add_product(&mut force, reaction, rows, 0, inertial);
            for (k, to) in out.chunks_exact_mut(rows.max(1)).enumerate() {
                let column = used.column(reaction, k);
                to.iter_mut().zip(column).zip(&force).for_each(|((t, n), f)| *t += n * sign(*f));
            }
        }
        out
    }

    /// `∂τ/∂θ` of the used samples of a drive, column after column.
    pub(super) fn used_jacobian(&self, j: usize, theta: &[f64]) -> Vec<f64> {
        let (used, x, p) = (&self.drives[j], split(theta), self.inertial());
        let Settings { model, exponent, .. } = self.settings;
        let rows = used.rows();
        let normal = self.used_normal(j, x.inertial);
        let mut out = self.used_normal_rows(j, x.inertial);
        out.resize(rows * (p + 4), 0.0);
        let weight = &self.record.drives()[j].weight;
        let constant = dot(weight, x.inertial);
        for i in 0..rows {
            let (e, slope) = decay(model, exponent, used.speed[i], x.stribeck);
            let (s, f) = (used.sign[i], normal[i]);
            let stribeck = x.coulomb + (x.stick - x.coulomb) * e;
            for (k, w) in weight.iter().enumerate() {
                let at = k * rows + i;
                out[at] = used.regressor[at] + s * (stribeck * out[at] + x.coulomb * w);
            }
            out[p * rows + i] = s * (f * (1.0 - e) + constant);
            out[(p + 1) * rows + i] = used.speed[i];
            out[(p + 2) * rows + i] = s * e * f;
            out[(p + 3) * rows + i] = s * (x.stick - x.coulomb) * slope * f;
        }
        out
    }
}

/// Sign of a force, 0 for none.
pub(super) fn sign(force: f64) -> f64 {
    if force == 0.0 { 0.0 } else { force.signum() }
}

pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// `to += columns[first..][..to.len()] · x` for columns of `rows` entries each, four columns at a time.
pub(super) fn add_product(to: &mut [f64], columns: &[f64], rows: usize, first: usize, x: &[f64]) {
    let n = to.len();
    let column = |k: usize| &columns[k * rows + first..][..n];
    let whole = x.len() - x.len() % 4;
    for k in (0..whole).step_by(4) {
        let (a, b, c, d) = (column(k), column(k + 1), column(k + 2), column(k + 3));
        let (xa, xb, xc, xd) = (x[k], x[k + 1], x[k + 2], x[k + 3]);
        for ((t, (a, b)), (c, d)) in to.iter_mut().zip(a.iter().zip(b)).zip(c.iter().zip(d)) {
            *t += (xa * a + xb * b) + (xc * c + xd * d);
        }
    }
    for (k, factor) in x.iter().enumerate().skip(whole) {
        to.iter_mut().zip(column(k)).for_each(|(t, c)| *t += factor * c);
    }
}
