//! A fitted law: coefficients and its curve.

use dynid_model::element::{
    Coulomb, ExponentialViscous, JointElement, Offset, ShapeSetting, Stribeck, Viscous, temperature_channel,
};
use dynid_model::{Description, EffortModel, JointDescription, JointKind, Limits, LinkDescription};
use dynid_model::{MotionBlock, Placement, RobotModel};

use super::form::{LawForm, ViscousForm};

/// Name of the one joint of the models here.
pub(super) const JOINT: &str = "joint";

/// A coefficient of a law.
#[derive(Debug, Clone, PartialEq)]
pub struct Coefficient {
    /// `fc`, `fs`, `vs`, `fv`, `sigma2`, `sigma2_slope`, .., `sigma4_slope`, `fo`.
    pub symbol: &'static str,
    /// Value, SI and per K.
    pub value: f64,
    /// Standard deviation; `None` where the points do not tell.
    pub std: Option<f64>,
}

/// A friction law with its coefficients.
#[derive(Debug, Clone, PartialEq)]
pub struct FrictionLaw {
    /// Terms.
    pub form: LawForm,
    /// Coefficients: linear ones, then shape parameters.
    pub coefficients: Vec<Coefficient>,
    /// `T_ref` of the lines, °C.
    pub reference_temperature: f64,
    /// Temperatures beyond are clamped, °C.
    pub temperature_range: (f64, f64),
}

/// How far a law is from its points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurveError {
    /// Root mean square of the residuals, N m or N.
    pub rms: f64,
    /// Largest residual as a share of the largest friction.
    pub largest: f64,
    /// `χ²`: squares of the residuals in standard errors.
    pub chi_squared: f64,
    /// Degrees of freedom.
    pub freedom: usize,
}

impl FrictionLaw {
    /// Value of a coefficient; `None` if the law does not have it.
    pub fn value(&self, symbol: &str) -> Option<f64> {
        self.coefficients.iter().find(|c| c.symbol == symbol).map(|c| c.value)
    }

    /// Standard deviation of a coefficient.
    pub fn std(&self, symbol: &str) -> Option<f64> {
        self.coefficients.iter().find(|c| c.symbol == symbol).and_then(|c| c.std)
    }

    /// Friction at speeds and temperatures (one per speed; clamped to the range), N m or N.
    ///
    /// # Panics
    /// If there is not one temperature per speed.
    pub fn friction(&self, speeds: &[f64], temperatures: &[f64]) -> Vec<f64> {
        assert_eq!(speeds.len(), temperatures.len(), "one temperature per speed");
        let shape: Vec<f64> = self.form.shape().iter().map(|s| self.value(s).unwrap_or(1.0)).collect();
        let built =
            build(&self.form, &ShapeScale::wide(), self.reference_temperature, self.temperature_range);
        let mut linear = vec![0.0; built.model.parameters().linear.len()];
        for (column, symbol) in built.kept.iter().zip(self.form.linear()) {
            linear[*column] = self.value(symbol).unwrap_or(0.0);
        }
        let n = speeds.len();
        let mut effort = vec![0.0; n];
        let channels = [(built.channel.as_str(), temperatures)];
        let zeros = vec![0.0; n];
        built.model.efforts(&motion(speeds, &zeros, &channels), &shape, &linear, n, &mut effort);
        effort
    }

    /// A line `σ(T_ref), slope` of `sigma2`, `sigma3` or `sigma4`; the slope is 0 without lines.
    pub fn line(&self, symbol: &str) -> Option<(f64, f64)> {
        Some((self.value(symbol)?, self.value(&format!("{symbol}_slope")).unwrap_or(0.0)))
    }

    /// Temperature at which a falling or rising `σ2` vanishes, °C.
    pub fn vanishes_at(&self) -> Option<f64> {
        let (value, slope) = self.line("sigma2")?;
        (slope != 0.0).then(|| self.reference_temperature - value / slope)
    }
}

/// Ranges of speeds that bounds of shape parameters follow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ShapeScale {
    pub(super) least_speed: f64,
    pub(super) largest_speed: f64,
}

impl ShapeScale {
    /// For evaluation: any value will do.
    pub(super) fn wide() -> Self {
        ShapeScale { least_speed: 1e-9, largest_speed: 1e9 }
    }
}

/// The model of one joint without inertia.
pub(super) struct Built {
    pub(super) model: RobotModel,
    /// Columns of the form's linear coefficients.
    pub(super) kept: Vec<usize>,
    pub(super) channel: String,
}

/// Steady motion of the one joint. `zeros`: position and acceleration.
pub(super) fn motion<'a>(
    speeds: &'a [f64],
    zeros: &'a [f64],
    channels: &'a [(&'a str, &'a [f64])],
) -> MotionBlock<'a> {
    MotionBlock { channels, ..MotionBlock::plain(speeds.len(), zeros, speeds, zeros) }
}

/// Bounds: `v_s` from a third of the least speed to 0.3 of the largest; `σ3` such that the knee `1/σ3` lies between a tenth
/// of the least speed and ten times the largest, within 0.1 to 10 s/rad and beyond where speeds ask for it.
pub(super) fn build(form: &LawForm, scale: &ShapeScale, reference: f64, range: (f64, f64)) -> Built {
    let mut elements: Vec<Box<dyn JointElement>> = Vec::new();
    if form.stribeck {
        let mut stribeck = Stribeck::new(0);
        let (lower, upper) = (scale.least_speed / 3.0, (0.3 * scale.largest_speed).max(scale.least_speed));
        stribeck.vs = ShapeSetting { start: (lower * upper).sqrt(), lower, upper, held: false };
        elements.push(Box::new(stribeck));
    } else {
        elements.push(Box::new(Coulomb { rate: 0 }));
    }
    match form.viscous {
        ViscousForm::Linear => elements.push(Box::new(Viscous { rate: 0 })),
        ViscousForm::Exponential => {
            let mut viscous = ExponentialViscous::new(0);
            let slopes = form.has_lines();
            viscous.reference_temperature = reference;
            viscous.temperature_range = range;
            let (lower, upper) = (0.1 / scale.largest_speed.max(1.0), 10.0 / scale.largest_speed.min(1.0));
            viscous.sigma3 = ShapeSetting { start: (lower * upper).sqrt(), lower, upper, held: false };
            viscous.sigma4 = ShapeSetting { start: 0.9, lower: 0.3, upper: 2.0, held: false };
            // ±3 %/K of a value at the middle of its range.
            let slope = |limit: f64| match slopes {
                true => ShapeSetting { start: 0.0, lower: -limit, upper: limit, held: false },
                false => ShapeSetting::held(0.0),
            };
            viscous.sigma3_slope = slope(0.03 * viscous.sigma3.upper.min(3.0));
            viscous.sigma4_slope = slope(0.03);
            elements.push(Box::new(viscous));
        }
    }
    if form.offset {
        elements.push(Box::new(Offset { rate: 0 }));
    }
    let mut description = Description::new("joint");
    let link = |name: &str| LinkDescription { name: name.to_owned(), inertia: None };
    description.links = vec![link("base"), link("link")];
    description.joints = vec![JointDescription {
        name: JOINT.to_owned(),
        kind: JointKind::Continuous,
        parent: "base".to_owned(),
        child: "link".to_owned(),
        placement: Placement::identity(),
        axis: [0.0, 0.0, 1.0],
        limits: Limits::default(),
        mimic: None,
    }];
    #[expect(clippy::expect_used, reason = "two links and a joint always form a mechanism")]
    let mechanism = description.build().expect("one joint is a mechanism");
    let model = RobotModel::new(mechanism, elements);
    let column = |symbol: &str| model.parameters().column(&format!("{JOINT}.{symbol}"));
    let kept = form.linear().into_iter().filter_map(column).collect();
    Built { model, kept, channel: temperature_channel(JOINT) }
}

/// A law as an effort model, its friction in two parts.
#[derive(Debug)]
pub struct LawParts {
    /// The model of one joint without inertia.
    pub model: RobotModel,
    /// Shape parameters of the model.
    pub shape: Vec<f64>,
    /// Linear parameters of Coulomb or Stribeck friction alone.
    pub bristles: Vec<f64>,
    /// Linear parameters of viscous friction alone.
    pub viscous: Vec<f64>,
}

impl FrictionLaw {
    /// The law's model with what bristles carry and what is viscous apart; an offset belongs to neither.
    pub fn parts(&self) -> LawParts {
        let shape: Vec<f64> = self.form.shape().iter().map(|s| self.value(s).unwrap_or(1.0)).collect();
        let built =
            build(&self.form, &ShapeScale::wide(), self.reference_temperature, self.temperature_range);
        let mut bristles = vec![0.0; built.model.parameters().linear.len()];
        let mut viscous = bristles.clone();
        for (column, symbol) in built.kept.iter().zip(self.form.linear()) {
            let part = match symbol {
                "fc" | "fs" => &mut bristles,
                "fo" => continue,
                _ => &mut viscous,
            };
            part[*column] = self.value(symbol).unwrap_or(0.0);
        }
        LawParts { model: built.model, shape, bristles, viscous }
    }
}
