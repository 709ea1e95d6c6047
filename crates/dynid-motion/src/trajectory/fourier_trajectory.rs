//! Periodic motion of several coordinates.

use super::error::check_count;
use super::{Form, Fourier, Point, RowOrder, Trajectory, TrajectoryError, held};

/// Fourier series of one base frequency, run for a number of whole periods.
#[derive(Debug, Clone, PartialEq)]
pub struct FourierTrajectory {
    series: Vec<Fourier>,
    periods: usize,
}

impl FourierTrajectory {
    /// One series per coordinate, `periods` times.
    ///
    /// Fails without a coordinate or a period, or if base frequencies differ.
    pub fn new(series: Vec<Fourier>, periods: usize) -> Result<Self, TrajectoryError> {
        let Some(first) = series.first() else {
            return Err(TrajectoryError::Value { name: "coordinates", expected: "at least 1", found: 0.0 });
        };
        if periods == 0 {
            return Err(TrajectoryError::Value { name: "periods", expected: "at least 1", found: 0.0 });
        }
        let expected = first.base();
        if let Some((coordinate, other)) = series.iter().enumerate().find(|(_, s)| s.base() != expected) {
            return Err(TrajectoryError::BaseFrequency { coordinate, expected, found: other.base() });
        }
        Ok(FourierTrajectory { series, periods })
    }

    /// From a published table, one row of `2 L + 1` coefficients per coordinate; `base` is in rad/s.
    ///
    /// Fails as [`Fourier::from_row`] and [`Self::new`], or if the rows differ in length.
    pub fn from_rows(
        base: f64,
        form: Form,
        order: &RowOrder,
        rows: &[Vec<f64>],
        periods: usize,
    ) -> Result<Self, TrajectoryError> {
        for row in rows {
            check_count("entries of a row of coefficients", rows[0].len(), row.len())?;
        }
        let series = rows.iter().map(|row| Fourier::from_row(base, form, order, row));
        Self::new(series.collect::<Result<_, _>>()?, periods)
    }

    /// The coefficients as a table in the given order and form.
    ///
    /// Fails if the order names another number of harmonics than the series have.
    pub fn to_rows(&self, form: Form, order: &RowOrder) -> Result<Vec<Vec<f64>>, TrajectoryError> {
        self.series.iter().map(|s| s.to_row(form, order)).collect()
    }

    /// The series, one per coordinate.
    pub fn series(&self) -> &[Fourier] {
        &self.series
    }

    /// Number of periods.
    pub fn periods(&self) -> usize {
        self.periods
    }

    /// Base frequency, rad/s.
    pub fn base(&self) -> f64 {
        self.series[0].base()
    }

    /// Period, s.
    pub fn period(&self) -> f64 {
        self.series[0].period()
    }
}

impl Trajectory for FourierTrajectory {
    fn coordinates(&self) -> usize {
        self.series.len()
    }

    fn duration(&self) -> f64 {
        self.periods as f64 * self.period()
    }

    fn at(&self, time: f64, out: &mut [Point]) {
        assert_eq!(out.len(), self.series.len(), "one point per coordinate");
        let (time, outside) = held(time, self.duration());
        for (point, series) in out.iter_mut().zip(&self.series) {
            *point = series.at(time);
            if outside {
                point.jerk = 0.0;
            }
        }
    }
}
