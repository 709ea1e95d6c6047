//! Motions as arrays, checked once.

use super::error::{LoadFrictionError, in_range, same_size};
use dynid_linalg::Mat;

/// A drive along a motion: everything that is linear in the inertial parameters `φ` (`p` of them).
#[derive(Debug, Clone, PartialEq)]
pub struct DriveRows {
    /// `W`, samples × p: `W φ` is the effort without friction.
    pub regressor: Mat,
    /// `N_k`, each samples × p: `N_k φ` is a component of the reaction that presses on the drive; its size counts,
    /// whatever its sign. None for a drive without such a reaction.
    pub reactions: Vec<Mat>,
    /// `w`, p: `w · φ` is a normal force that does not change, such as a weight; empty for none. Physical parameters give
    /// `w · φ >= 0`; its sign is not touched.
    pub weight: Vec<f64>,
    /// Speed of the drive, m/s or rad/s.
    pub speed: Vec<f64>,
}

/// A motion of a machine: the same samples of every drive, the same inertial parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    drives: Vec<DriveRows>,
    samples: usize,
    inertial: usize,
}

impl Record {
    /// Checks sizes and finiteness.
    ///
    /// # Errors
    /// No drives; matrices or lists whose sizes differ from those of the first drive's regressor; numbers that are not
    /// finite.
    pub fn new(mut drives: Vec<DriveRows>) -> Result<Record, LoadFrictionError> {
        let first = drives.first().ok_or(LoadFrictionError::NoDrives)?;
        let (samples, inertial) = (first.regressor.nrows(), first.regressor.ncols());
        for (drive, rows) in drives.iter_mut().enumerate() {
            let matrices = std::iter::once(("regressor", &rows.regressor))
                .chain(rows.reactions.iter().map(|n| ("reaction", n)));
            for (what, matrix) in matrices {
                same_size(format!("rows of the {what} of drive {drive}"), samples, matrix.nrows())?;
                same_size(format!("columns of the {what} of drive {drive}"), inertial, matrix.ncols())?;
                for column in matrix.col_iter() {
                    finite(what, drive, column.iter().copied())?;
                }
            }
            if rows.weight.is_empty() {
                rows.weight = vec![0.0; inertial];
            }
            same_size(format!("entries of the weight of drive {drive}"), inertial, rows.weight.len())?;
            for w in &rows.weight {
                in_range(format!("weight of drive {drive}"), "a finite number", *w, w.is_finite())?;
            }
            same_size(format!("speeds of drive {drive}"), samples, rows.speed.len())?;
            finite("speed", drive, rows.speed.iter().copied())?;
        }
        Ok(Record { drives, samples, inertial })
    }

    /// Drives; an empty weight has become zeros.
    pub fn drives(&self) -> &[DriveRows] {
        &self.drives
    }

    /// Samples per drive.
    pub fn samples(&self) -> usize {
        self.samples
    }

    /// Number `p` of inertial parameters.
    pub fn inertial(&self) -> usize {
        self.inertial
    }
}

pub(super) fn finite(
    what: &'static str,
    drive: usize,
    values: impl Iterator<Item = f64>,
) -> Result<(), LoadFrictionError> {
    match values.enumerate().find(|(_, v)| !v.is_finite()) {
        Some((sample, found)) => Err(LoadFrictionError::NotFinite { what, drive, sample, found }),
        None => Ok(()),
    }
}

/// `matrix · x`.
pub(super) fn product(matrix: &Mat, x: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; matrix.nrows()];
    for (k, factor) in x.iter().enumerate() {
        for (to, m) in out.iter_mut().zip(matrix.col(k)) {
            *to += factor * m;
        }
    }
    out
}
