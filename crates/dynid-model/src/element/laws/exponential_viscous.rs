//! Viscous friction that saturates with speed and falls with temperature.

use crate::element::law::units::{NUMBER, PER_SPEED};
use crate::element::{LinearTerm, ShapeTerm, Velocity, VelocityLaw};
use dynid_algebra::scalar::Scalar;

const EFFORT_PER_KELVIN: [&str; 2] = ["N m/K", "N/K"];
const PER_SPEED_PER_KELVIN: [&str; 2] = ["s/(rad K)", "s/(m K)"];
const PER_KELVIN: [&str; 2] = ["1/K", "1/K"];

/// Rates and exponents that a line may not fall below.
const LEAST: f64 = 1e-6;

/// Viscous friction `s(v) σ2(T) (1 - e)` with `e = exp(-|σ3(T) v|^σ4(T))` and coefficients that are lines over the joint's
/// temperature, `σ_j(T) = σ_j + σ_j' (T - T0)`: `sigma2`, `sigma2_slope`; shape `sigma3` (s/rad, s/m), 0.1 .. 10, `sigma4`,
/// 0.3 .. 2, and `sigma3_slope`, `sigma4_slope`, held at 0 (bounds ±0.03 per kelvin).
///
/// Source: Tadese, Pico, Seo & Moon 2022, Eq. 5, made odd in `v`. Temperatures outside of the valid range count as its nearer
/// end. With one temperature alone the slopes cannot be told from the values: leave `T0` at that temperature and the slopes at
/// 0. At rest with `σ4 < 1` the law is infinitely steep; derivatives by the velocity count 0 there. Passive while `σ2(T)`,
/// `σ3(T)` are positive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExponentialViscous {
    /// `T0`, °C.
    pub reference_temperature: f64,
    /// Temperatures for which the law holds, °C, ascending.
    pub temperature_range: (f64, f64),
    /// A constant temperature in place of the channel, °C.
    pub temperature: Option<f64>,
}

impl Default for ExponentialViscous {
    /// The line through 25 °C, valid at all temperatures, which a channel tells.
    fn default() -> Self {
        ExponentialViscous {
            reference_temperature: 25.0,
            temperature_range: (f64::NEG_INFINITY, f64::INFINITY),
            temperature: None,
        }
    }
}

impl VelocityLaw<4, 2> for ExponentialViscous {
    const THERMAL: bool = true;

    fn linear(&self) -> [LinearTerm; 2] {
        [LinearTerm::effort("sigma2").friction(), LinearTerm::new("sigma2_slope", EFFORT_PER_KELVIN)]
    }
    fn shape(&self) -> [ShapeTerm; 4] {
        [
            ShapeTerm::positive("sigma3", PER_SPEED, 0.1, 10.0),
            ShapeTerm::signed("sigma3_slope", PER_SPEED_PER_KELVIN, 0.03).held_at(0.0),
            ShapeTerm::positive("sigma4", NUMBER, 0.3, 2.0),
            ShapeTerm::signed("sigma4_slope", PER_KELVIN, 0.03).held_at(0.0),
        ]
    }
    #[inline(always)]
    fn columns<S: Scalar>(&self, v: Velocity<S>, [s3, s3_slope, s4, s4_slope]: [S; 4]) -> [S; 2] {
        let (low, high) = self.temperature_range;
        let within = v.temperature().at_least(low).at_most(high);
        let above = within - S::from_f64(self.reference_temperature);
        let sigma3 = (s3 + s3_slope * above).at_least(LEAST);
        let sigma4 = (s4 + s4_slope * above).at_least(LEAST);
        let value = v.sign() * (sigma3 * v.speed()).power(sigma4).rise();
        [value, value * above]
    }
    fn constant_temperature(&self) -> Option<f64> {
        self.temperature
    }
}
