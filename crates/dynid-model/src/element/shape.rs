//! Start values and bounds of parameters that enter an element nonlinearly.

use super::JointInfo;
use crate::parameter::ShapeParameter;

/// What is to be done with one shape parameter of an element.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShapeSetting {
    /// Start of a search, or the value itself where it is held.
    pub start: f64,
    /// Lower bound of a search.
    pub lower: f64,
    /// Upper bound of a search.
    pub upper: f64,
    /// The value is known: it is no entry of the shape vector.
    pub held: bool,
}

/// A shape setting that no search can start from.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ShapeFault {
    /// Start or bound is not a finite number.
    #[error("start and bounds must be finite, found {start} in {lower} .. {upper}")]
    NotFinite {
        /// Start value.
        start: f64,
        /// Lower bound.
        lower: f64,
        /// Upper bound.
        upper: f64,
    },
    /// A parameter that must be positive may reach zero.
    #[error("expected a value above 0, found {found}")]
    NotPositive {
        /// The offending start or bound.
        found: f64,
    },
    /// The start is not between the bounds.
    #[error("expected a start between {lower} and {upper}, found {start}")]
    OutOfBounds {
        /// Start value.
        start: f64,
        /// Lower bound.
        lower: f64,
        /// Upper bound.
        upper: f64,
    },
}

impl ShapeSetting {
    /// Held at a value.
    pub fn held(value: f64) -> Self {
        ShapeSetting { start: value, lower: value, upper: value, held: true }
    }

    /// Whether a search can start from it; `positive`: the law needs a value above 0. Bounds of a held value do not count.
    pub fn check(&self, positive: bool) -> Result<(), ShapeFault> {
        let ShapeSetting { start, lower, upper, held } = *self;
        let (least, most) = if held { (start, start) } else { (lower, upper) };
        if ![start, least, most].iter().all(|x| x.is_finite()) {
            return Err(ShapeFault::NotFinite { start, lower: least, upper: most });
        }
        if positive && least <= 0.0 {
            return Err(ShapeFault::NotPositive { found: least });
        }
        if !(least <= start && start <= most) {
            return Err(ShapeFault::OutOfBounds { start, lower: least, upper: most });
        }
        Ok(())
    }

    pub(super) fn parameter(
        &self,
        joint: &JointInfo,
        symbol: &str,
        units: [&'static str; 2],
        logarithmic: bool,
    ) -> ShapeParameter {
        ShapeParameter {
            name: format!("{}.{symbol}", joint.name),
            unit: units[usize::from(joint.slides)],
            start: self.start,
            lower: self.lower,
            upper: self.upper,
            logarithmic,
        }
    }
}

/// Values of all shape parameters of an element: free ones from the shape vector, held ones from their settings.
pub(super) fn values<const N: usize>(settings: [&ShapeSetting; N], shape: &[f64]) -> [f64; N] {
    let mut free = shape.iter();
    settings.map(|s| if s.held { s.start } else { free.next().copied().unwrap_or(s.start) })
}

/// Index in the shape vector of every shape parameter of an element; `None` where it is held.
pub(super) fn places<const N: usize>(settings: [&ShapeSetting; N]) -> [Option<usize>; N] {
    let mut next = 0..;
    settings.map(|s| if s.held { None } else { next.next() })
}
