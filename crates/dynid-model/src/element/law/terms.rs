//! What a law says of its parameters.

use crate::element::{JointInfo, ShapeSetting};
use crate::parameter::{Parameter, ShapeParameter};

/// Units of parameters of joints that turn and of joints that slide.
pub mod units {
    /// Of an effort.
    pub const EFFORT: [&str; 2] = ["N m", "N"];
    /// Of a viscous coefficient.
    pub const VISCOUS: [&str; 2] = ["N m s/rad", "N s/m"];
    /// Of a speed.
    pub const SPEED: [&str; 2] = ["rad/s", "m/s"];
    /// Of a position.
    pub const POSITION: [&str; 2] = ["rad", "m"];
    /// Of a stiffness.
    pub const STIFFNESS: [&str; 2] = ["N m/rad", "N/m"];
    /// Of what multiplies a position.
    pub const PER_ANGLE: [&str; 2] = ["1/rad", "1/m"];
    /// Of what multiplies a speed.
    pub const PER_SPEED: [&str; 2] = ["s/rad", "s/m"];
    /// Of repetitions over a turn, or over `2π` of a slide.
    pub const REPETITIONS: [&str; 2] = ["1", "rad/m"];
    /// Of a number.
    pub const NUMBER: [&str; 2] = ["1", "1"];
}

/// A coefficient of a law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearTerm {
    /// Symbol: its name is `<joint>.<symbol>`.
    pub symbol: &'static str,
    /// Units for joints that turn and for joints that slide.
    pub units: [&'static str; 2],
    /// Smallest value that makes sense, if there is one.
    pub lower: Option<f64>,
    /// A coefficient of friction: a law that takes energy out of the motion has it positive.
    pub coefficient: bool,
}

impl LinearTerm {
    /// With any value and given units.
    pub const fn new(symbol: &'static str, units: [&'static str; 2]) -> Self {
        LinearTerm { symbol, units, lower: None, coefficient: false }
    }

    /// An effort, N m or N.
    pub const fn effort(symbol: &'static str) -> Self {
        Self::new(symbol, units::EFFORT)
    }

    /// A viscous coefficient, N m s/rad or N s/m.
    pub const fn viscous(symbol: &'static str) -> Self {
        Self::new(symbol, units::VISCOUS)
    }

    /// Returns the term as a coefficient of friction that is not negative.
    #[must_use]
    pub const fn friction(self) -> Self {
        LinearTerm { lower: Some(0.0), ..self.coefficient() }
    }

    /// Returns the term as a coefficient of friction of any sign, whose law is passive where it is positive.
    #[must_use]
    pub const fn coefficient(self) -> Self {
        LinearTerm { coefficient: true, ..self }
    }

    /// Returns the term with a smallest value.
    #[must_use]
    pub const fn at_least(self, lower: f64) -> Self {
        LinearTerm { lower: Some(lower), ..self }
    }

    pub(super) fn parameter(&self, joint: &JointInfo) -> Parameter {
        joint.parameter(self.symbol, self.units, self.lower)
    }
}

/// What the bounds of a shape parameter go with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ShapeScale {
    /// Nothing.
    Fixed,
    /// They are multiples of the largest speed in use.
    Speed,
    /// They are divided by the largest speed in use.
    PerSpeed,
}

/// A shape parameter of a law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShapeTerm {
    /// Symbol: its name is `<joint>.<symbol>`.
    pub symbol: &'static str,
    /// Units for joints that turn and for joints that slide.
    pub units: [&'static str; 2],
    /// Lower bound of a search, in units of `scale`.
    pub lower: f64,
    /// Upper bound of a search, in units of `scale`.
    pub upper: f64,
    /// Start of a search, or the value where it is held; `None`: the geometric mean of the bounds.
    pub start: Option<f64>,
    /// Known unless a setting frees it.
    pub held: bool,
    /// What the bounds go with.
    pub scale: ShapeScale,
    /// Values must be above 0 and are searched on a logarithmic scale.
    pub positive: bool,
    /// No value is likely: whoever names the element states one.
    pub needed: bool,
}

impl ShapeTerm {
    /// A positive number between bounds, searched from their geometric mean.
    pub const fn positive(symbol: &'static str, units: [&'static str; 2], lower: f64, upper: f64) -> Self {
        let scale = ShapeScale::Fixed;
        ShapeTerm {
            symbol,
            units,
            lower,
            upper,
            start: None,
            held: false,
            scale,
            positive: true,
            needed: false,
        }
    }

    /// A speed between bounds in units of the largest speed in use, searched from their geometric mean.
    pub const fn speed(symbol: &'static str, lower: f64, upper: f64) -> Self {
        let scale = ShapeScale::Speed;
        ShapeTerm { scale, ..Self::positive(symbol, units::SPEED, lower, upper) }
    }

    /// What multiplies a speed, between bounds in units of 1 / the largest speed in use, searched from their geometric mean.
    pub const fn per_speed(symbol: &'static str, lower: f64, upper: f64) -> Self {
        let scale = ShapeScale::PerSpeed;
        ShapeTerm { scale, ..Self::positive(symbol, units::PER_SPEED, lower, upper) }
    }

    /// A number of any sign between `-most` and `most`, searched from 0.
    pub const fn signed(symbol: &'static str, units: [&'static str; 2], most: f64) -> Self {
        let term = Self::positive(symbol, units, -most, most);
        ShapeTerm { start: Some(0.0), positive: false, ..term }
    }

    /// Returns the term with a start of its own.
    #[must_use]
    pub const fn from(self, start: f64) -> Self {
        ShapeTerm { start: Some(start), ..self }
    }

    /// Returns the term, known at a value unless a setting frees it.
    #[must_use]
    pub const fn held_at(self, value: f64) -> Self {
        ShapeTerm { start: Some(value), held: true, ..self }
    }

    /// Returns the term, known at a value that has to be stated unless a setting frees it.
    #[must_use]
    pub const fn needed(self) -> Self {
        ShapeTerm { needed: true, held: true, ..self }
    }

    /// Whether the bounds go with the speeds in use.
    pub fn scales(&self) -> bool {
        self.scale != ShapeScale::Fixed
    }

    /// Start and bounds for speeds up to `v_max`, rad/s or m/s, above 0.
    pub fn setting(&self, v_max: f64) -> ShapeSetting {
        let scaled = |bound: f64| match self.scale {
            ShapeScale::Fixed => bound,
            ShapeScale::Speed => bound * v_max,
            ShapeScale::PerSpeed => bound / v_max,
        };
        let (lower, upper) = (scaled(self.lower), scaled(self.upper));
        let start = self.start.map_or_else(|| (lower * upper).sqrt(), scaled);
        ShapeSetting { start, lower, upper, held: self.held }
    }

    pub(in crate::element) fn parameter(&self, setting: &ShapeSetting, joint: &JointInfo) -> ShapeParameter {
        setting.parameter(joint, self.symbol, self.units, self.positive)
    }
}
