//! The box that a search stays in.

use thiserror::Error;

/// Why bounds are refused.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum BoundsError {
    /// No coordinates.
    #[error("bounds of no coordinates")]
    Empty,
    /// Lower and upper bounds are of different numbers.
    #[error("{upper} upper bounds, expected {lower} as there are lower bounds")]
    Length {
        /// Number of lower bounds.
        lower: usize,
        /// Number of upper bounds.
        upper: usize,
    },
    /// A bound is not a number, or infinite on the wrong side, or the width overflows.
    #[error("coordinate {index}: bounds {lower} to {upper} hold no interval of numbers")]
    NotFinite {
        /// The coordinate, from 0.
        index: usize,
        /// Lower bound of the coordinate.
        lower: f64,
        /// Upper bound of the coordinate.
        upper: f64,
    },
    /// A lower bound above its upper bound.
    #[error("coordinate {index}: lower bound {lower} is above the upper bound {upper}")]
    Reversed {
        /// The coordinate, from 0.
        index: usize,
        /// Lower bound of the coordinate.
        lower: f64,
        /// Upper bound of the coordinate.
        upper: f64,
    },
    /// A logarithmic coordinate whose lower bound is not positive.
    #[error("coordinate {index}: a logarithmic coordinate needs a positive lower bound, found {lower}")]
    NotPositive {
        /// The coordinate, from 0.
        index: usize,
        /// Lower bound of the coordinate.
        lower: f64,
    },
    /// A coordinate that does not exist was to be logarithmic.
    #[error("coordinate {index} of {dimensions} cannot be logarithmic: there is none")]
    NoSuchCoordinate {
        /// The coordinate, from 0.
        index: usize,
        /// Number of coordinates.
        dimensions: usize,
    },
}

/// Bounds `lower_i ≤ x_i ≤ upper_i` of every coordinate, each searched as it is or by its logarithm.
///
/// Equal bounds hold a coordinate. One-sided and absent bounds (`±∞`) are allowed here, but most algorithms draw from the
/// box and refuse them ([`SearchError::Unbounded`](super::SearchError::Unbounded)).
#[derive(Debug, Clone, PartialEq)]
pub struct Bounds {
    lower: Vec<f64>,
    upper: Vec<f64>,
    logarithmic: Vec<bool>,
    /// Bounds of the coordinates that algorithms see.
    search_lower: Vec<f64>,
    search_upper: Vec<f64>,
}

impl Bounds {
    /// Bounds of all coordinates, none of them logarithmic.
    ///
    /// # Errors
    /// Lengths that differ or are 0, bounds that are not numbers, reversed bounds.
    pub fn new(lower: Vec<f64>, upper: Vec<f64>) -> Result<Bounds, BoundsError> {
        if lower.len() != upper.len() {
            return Err(BoundsError::Length { lower: lower.len(), upper: upper.len() });
        }
        if lower.is_empty() {
            return Err(BoundsError::Empty);
        }
        for (index, (&l, &u)) in lower.iter().zip(&upper).enumerate() {
            let overflows = l.is_finite() && u.is_finite() && !(u - l).is_finite();
            if l.is_nan() || u.is_nan() || l == f64::INFINITY || u == f64::NEG_INFINITY || overflows {
                return Err(BoundsError::NotFinite { index, lower: l, upper: u });
            }
            if l > u {
                return Err(BoundsError::Reversed { index, lower: l, upper: u });
            }
        }
        let logarithmic = vec![false; lower.len()];
        Ok(Bounds { search_lower: lower.clone(), search_upper: upper.clone(), lower, upper, logarithmic })
    }

    /// Returns the bounds with the given coordinates searched by their logarithm: steps and spreads are then factors.
    ///
    /// # Errors
    /// A coordinate that does not exist or whose lower bound is not positive.
    pub fn with_logarithmic(mut self, coordinates: &[usize]) -> Result<Bounds, BoundsError> {
        let dimensions = self.dimensions();
        for &index in coordinates {
            if index >= dimensions {
                return Err(BoundsError::NoSuchCoordinate { index, dimensions });
            }
            if self.lower[index] <= 0.0 {
                return Err(BoundsError::NotPositive { index, lower: self.lower[index] });
            }
            self.logarithmic[index] = true;
            self.search_lower[index] = self.lower[index].ln();
            self.search_upper[index] = self.upper[index].ln();
        }
        Ok(self)
    }

    /// Number of coordinates `d`.
    pub fn dimensions(&self) -> usize {
        self.lower.len()
    }

    /// Lower bounds.
    pub fn lower(&self) -> &[f64] {
        &self.lower
    }

    /// Upper bounds.
    pub fn upper(&self) -> &[f64] {
        &self.upper
    }

    /// Whether a coordinate is searched by its logarithm.
    pub fn is_logarithmic(&self, coordinate: usize) -> bool {
        self.logarithmic[coordinate]
    }

    /// Whether a point lies within all bounds; never with a coordinate that is not a number.
    pub fn contain(&self, point: &[f64]) -> bool {
        point.len() == self.dimensions()
            && point.iter().zip(&self.lower).zip(&self.upper).all(|((x, l), u)| l <= x && x <= u)
    }

    /// First coordinate without two finite bounds.
    pub(super) fn unbounded(&self) -> Option<usize> {
        (0..self.dimensions()).find(|i| !(self.lower[*i].is_finite() && self.upper[*i].is_finite()))
    }

    /// Bounds in search coordinates.
    pub(super) fn search(&self, coordinate: usize) -> (f64, f64) {
        (self.search_lower[coordinate], self.search_upper[coordinate])
    }

    /// Width in search coordinates.
    pub(super) fn width(&self, coordinate: usize) -> f64 {
        self.search_upper[coordinate] - self.search_lower[coordinate]
    }

    /// Search coordinate brought into its bounds.
    pub(super) fn clip(&self, coordinate: usize, u: f64) -> f64 {
        u.max(self.search_lower[coordinate]).min(self.search_upper[coordinate])
    }

    /// Point from its search coordinates, inside the bounds to the last bit.
    pub(super) fn point(&self, search: &[f64], point: &mut [f64]) {
        for (i, (x, u)) in point.iter_mut().zip(search).enumerate() {
            let plain = if self.logarithmic[i] { u.exp() } else { *u };
            *x = plain.max(self.lower[i]).min(self.upper[i]);
        }
    }

    /// Search coordinates of a point.
    pub(super) fn search_point(&self, point: &[f64]) -> Vec<f64> {
        let of = |(i, x): (usize, &f64)| if self.logarithmic[i] { x.ln() } else { *x };
        point.iter().enumerate().map(of).collect()
    }
}
