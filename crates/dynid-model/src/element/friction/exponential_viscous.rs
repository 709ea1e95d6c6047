//! Viscous friction that saturates with speed and falls with temperature.

use super::{EFFORT, NUMBER, PER_SPEED};
use crate::dynamics::{MotionAdjoint, MotionBlock};
use crate::element::shape::{self, places, values};
use crate::element::{
    ElementColumns, ElementWeights, JointElement, JointInfo, ShapeSetting, temperature_channel,
    temperature_of,
};
use crate::parameter::{Parameter, ShapeParameter};

const EFFORT_PER_KELVIN: [&str; 2] = ["N m/K", "N/K"];
const PER_SPEED_PER_KELVIN: [&str; 2] = ["s/(rad K)", "s/(m K)"];
const PER_KELVIN: [&str; 2] = ["1/K", "1/K"];

/// Viscous friction `s(v) σ2(T) (1 - e)` with `e = exp(-|σ3(T) v|^σ4(T))` and coefficients that are lines over the joint's
/// temperature, `σ_j(T) = σ_j + σ_j' (T - T0)` (Tadese, Pico, Seo & Moon 2022, Eq. 5, made odd in `v`).
///
/// Two columns `[s (1 - e), s (T - T0) (1 - e)]` for `sigma2`, `sigma2_slope`; shape parameters `sigma3`, `sigma3_slope`,
/// `sigma4`, `sigma4_slope`. It needs the channel [`temperature_channel`], °C, unless a constant temperature is stated;
/// temperatures outside of the valid range count as its nearer end. With one temperature alone the slopes cannot be told
/// from the values: leave `T0` at that temperature and the slopes at 0.
///
/// `∂e/∂σ3 = -e a σ4/σ3`, `∂e/∂σ4 = -e a ln|σ3 v|` with `a = |σ3 v|^σ4`; slopes the same times `T - T0`. At rest with
/// `σ4 < 1` the law is infinitely steep; derivatives by the velocity count nothing there. Passive while `σ2(T)`, `σ3(T)`
/// are positive.
#[derive(Debug, Clone, PartialEq)]
pub struct ExponentialViscous {
    /// Rate it acts on.
    pub rate: usize,
    /// Rate `σ3` at `T0`, s/rad or s/m, positive. Default: 0.1 .. 10 from their geometric mean.
    pub sigma3: ShapeSetting,
    /// Change of `σ3` per kelvin. Default: held at 0 (bounds ±0.03).
    pub sigma3_slope: ShapeSetting,
    /// Exponent `σ4` at `T0`, positive. Default: 0.3 .. 2 from their geometric mean.
    pub sigma4: ShapeSetting,
    /// Change of `σ4` per kelvin. Default: held at 0 (bounds ±0.03).
    pub sigma4_slope: ShapeSetting,
    /// `T0`, °C. Default 25.
    pub reference_temperature: f64,
    /// Temperatures for which the law holds, °C, ascending. Default: all.
    pub temperature_range: (f64, f64),
    /// A constant temperature in place of the channel, °C. Default: none.
    pub temperature: Option<f64>,
}

impl ExponentialViscous {
    /// Friction of a rate with both slopes of the shape held at 0.
    pub fn new(rate: usize) -> Self {
        let slope = ShapeSetting { start: 0.0, lower: -0.03, upper: 0.03, held: true };
        ExponentialViscous {
            rate,
            sigma3: ShapeSetting::between(0.1, 10.0),
            sigma3_slope: slope,
            sigma4: ShapeSetting::between(0.3, 2.0),
            sigma4_slope: slope,
            reference_temperature: 25.0,
            temperature_range: (f64::NEG_INFINITY, f64::INFINITY),
            temperature: None,
        }
    }

    fn settings(&self) -> [&ShapeSetting; 4] {
        [&self.sigma3, &self.sigma3_slope, &self.sigma4, &self.sigma4_slope]
    }

    /// Hands every sample's `(index, speed, T - T0)` on.
    fn each(&self, joints: &[JointInfo], motion: &MotionBlock<'_>, mut work: impl FnMut(usize, f64, f64)) {
        let (low, high) = self.temperature_range;
        let above = |t: f64| t.max(low).min(high) - self.reference_temperature;
        let speeds = motion.rate(self.rate);
        match self.temperature {
            Some(constant) => {
                let above = above(constant);
                speeds.iter().enumerate().for_each(|(k, v)| work(k, *v, above));
            }
            None => {
                let joint = &joints[self.rate].name;
                let Some(temperature) = temperature_of(motion.channels, joint) else {
                    panic!("motion block without channel `{}`", temperature_channel(joint))
                };
                speeds.iter().zip(temperature).enumerate().for_each(|(k, (v, t))| work(k, *v, above(*t)));
            }
        }
    }
}

/// The law at one sample.
struct Sample {
    sign: f64,
    /// `a = |σ3 v|^σ4`.
    power: f64,
    /// `1 - e`, exact for small arguments too.
    risen: f64,
    sigma3: f64,
    sigma4: f64,
    /// `ln |σ3 v|`.
    logarithm: f64,
}

/// Rates and exponents that a line may not fall below.
const LEAST: f64 = 1e-6;

impl Sample {
    fn new(motion: &MotionBlock<'_>, v: f64, above: f64, [s3, s3_slope, s4, s4_slope]: [f64; 4]) -> Self {
        let sigma3 = (s3 + s3_slope * above).max(LEAST);
        let sigma4 = (s4 + s4_slope * above).max(LEAST);
        let logarithm = (sigma3 * v.abs()).ln();
        let power = (sigma4 * logarithm).exp();
        let risen = -(-power).exp_m1();
        Sample { sign: motion.sign(v), power, risen, sigma3, sigma4, logarithm }
    }

    /// `e`; where it is lost in rounding it multiplies nothing that matters.
    fn e(&self) -> f64 {
        1.0 - self.risen
    }

    /// `∂(1 - e)/∂σ3` or `∂(1 - e)/∂σ4`.
    fn by_shape(&self, exponent: bool) -> f64 {
        match exponent {
            false => self.e() * self.power * self.sigma4 / self.sigma3,
            // x^σ ln x goes to 0 with x.
            true if self.power == 0.0 => 0.0,
            true => self.e() * self.power * self.logarithm,
        }
    }

    /// Derivative of `s (1 - e)` by the velocity.
    fn slope(&self, motion: &MotionBlock<'_>, v: f64) -> f64 {
        if v == 0.0 {
            return 0.0;
        }
        motion.sign_slope(v) * self.risen + self.sign * self.e() * self.power * self.sigma4 / v
    }

    /// Derivative of `s ∂(1 - e)/∂σ` by the velocity.
    fn shape_slope(&self, motion: &MotionBlock<'_>, v: f64, exponent: bool) -> f64 {
        if v == 0.0 {
            return 0.0;
        }
        let rising = (1.0 - self.power) * self.sigma4;
        let along = match exponent {
            false => self.sigma4 / self.sigma3 * rising,
            true => rising * self.logarithm + 1.0,
        };
        motion.sign_slope(v) * self.by_shape(exponent) + self.sign * self.e() * self.power * along / v
    }
}

impl JointElement for ExponentialViscous {
    fn rates(&self) -> Vec<usize> {
        vec![self.rate]
    }
    fn parameters(&self, joints: &[JointInfo]) -> Vec<Parameter> {
        let joint = &joints[self.rate];
        vec![
            joint.parameter("sigma2", EFFORT, Some(0.0)),
            joint.parameter("sigma2_slope", EFFORT_PER_KELVIN, None),
        ]
    }
    fn shape(&self, joints: &[JointInfo]) -> Vec<ShapeParameter> {
        let joint = &joints[self.rate];
        shape::free([
            (&self.sigma3, self.sigma3.parameter(joint, "sigma3", PER_SPEED, true)),
            (
                &self.sigma3_slope,
                self.sigma3_slope.parameter(joint, "sigma3_slope", PER_SPEED_PER_KELVIN, false),
            ),
            (&self.sigma4, self.sigma4.parameter(joint, "sigma4", NUMBER, true)),
            (&self.sigma4_slope, self.sigma4_slope.parameter(joint, "sigma4_slope", PER_KELVIN, false)),
        ])
    }
    fn is_friction(&self) -> bool {
        true
    }
    fn entries(&self) -> Vec<(usize, usize)> {
        vec![(self.rate, 0), (self.rate, 1)]
    }
    fn channels(&self, joints: &[JointInfo]) -> Vec<String> {
        match self.temperature {
            Some(_) => Vec::new(),
            None => vec![temperature_channel(&joints[self.rate].name)],
        }
    }
    fn fill(
        &self,
        joints: &[JointInfo],
        motion: &MotionBlock<'_>,
        shape: &[f64],
        out: &mut ElementColumns<'_>,
    ) {
        let values = values(self.settings(), shape);
        let [value, slope] = out.two_columns(0, 1);
        self.each(joints, motion, |k, v, above| {
            let sample = Sample::new(motion, v, above, values);
            value[k] = sample.sign * sample.risen;
            slope[k] = value[k] * above;
        });
    }
    fn shape_entries(&self) -> Vec<(usize, usize)> {
        places(self.settings()).into_iter().flatten().flat_map(|p| [(0, p), (1, p)]).collect()
    }
    fn shape_derivatives(
        &self,
        joints: &[JointInfo],
        motion: &MotionBlock<'_>,
        shape: &[f64],
        out: &mut ElementColumns<'_>,
    ) {
        let values = values(self.settings(), shape);
        for (setting, place) in places(self.settings()).into_iter().enumerate() {
            let Some(place) = place else { continue };
            let (exponent, per_kelvin) = (setting >= 2, setting % 2 == 1);
            let [value, slope] = out.two_columns(2 * place, 2 * place + 1);
            self.each(joints, motion, |k, v, above| {
                let sample = Sample::new(motion, v, above, values);
                let factor = if per_kelvin { above } else { 1.0 };
                value[k] = sample.sign * sample.by_shape(exponent) * factor;
                slope[k] = value[k] * above;
            });
        }
    }
    fn shape_adjoint(
        &self,
        joints: &[JointInfo],
        motion: &MotionBlock<'_>,
        shape: &[f64],
        weights: &ElementWeights<'_>,
        out: &mut MotionAdjoint,
    ) {
        let values = values(self.settings(), shape);
        let to = &mut out.dq[self.rate * motion.samples..][..motion.samples];
        for (setting, place) in places(self.settings()).into_iter().enumerate() {
            let Some(place) = place else { continue };
            let (exponent, per_kelvin) = (setting >= 2, setting % 2 == 1);
            let (own, sloped) = (weights.column(2 * place), weights.column(2 * place + 1));
            self.each(joints, motion, |k, v, above| {
                let sample = Sample::new(motion, v, above, values);
                let factor = if per_kelvin { above } else { 1.0 };
                to[k] += (own[k] + sloped[k] * above) * factor * sample.shape_slope(motion, v, exponent);
            });
        }
    }
    fn adjoint(
        &self,
        joints: &[JointInfo],
        motion: &MotionBlock<'_>,
        shape: &[f64],
        weights: &ElementWeights<'_>,
        out: &mut MotionAdjoint,
    ) {
        let values = values(self.settings(), shape);
        let (own, sloped) = (weights.column(0), weights.column(1));
        let to = &mut out.dq[self.rate * motion.samples..][..motion.samples];
        self.each(joints, motion, |k, v, above| {
            let sample = Sample::new(motion, v, above, values);
            to[k] += (own[k] + sloped[k] * above) * sample.slope(motion, v);
        });
    }
}
