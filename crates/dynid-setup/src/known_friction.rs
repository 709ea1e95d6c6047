//! Friction of joints that a model takes as known.

use dynid_files::SourceFile;
use dynid_friction::steady_friction::FrictionLaw;
use dynid_model::KnownElement;
use dynid_model::element::{Coulomb, ExponentialViscous, LuGre, ShapeSetting, Stribeck, Viscous};
use dynid_motion::temperature::PLAUSIBLE;
use serde::{Deserialize, Serialize};

use crate::Error;
use crate::per_joint::PerJoint;

/// Largest coefficient.
const LARGEST: f64 = 1e30;

/// Friction of one joint whose coefficients are known. SI, °C.
///
/// With bristles it is LuGre friction, else Stribeck friction where the static friction is known, else Coulomb friction;
/// viscous friction stands beside it. Temperatures beyond the range count as its nearer end.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct KnownFriction {
    /// Joint.
    pub joint: String,
    /// Coulomb friction `F_c`, N m or N.
    pub coulomb: f64,
    /// Static friction `F_s`, N m or N; absent: equal to Coulomb friction.
    #[serde(rename = "static", default, skip_serializing_if = "Option::is_none")]
    pub static_: Option<f64>,
    /// Stribeck speed `v_s`, rad/s or m/s; without it static friction counts as equal to Coulomb friction.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stribeck_speed: Option<f64>,
    /// Exponent `δ`; absent: 2.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stribeck_exponent: Option<f64>,
    /// Viscous part.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub viscous: Option<ViscousModel>,
    /// Bristles.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bristle: Option<BristleModel>,
    /// Temperatures for which the law holds, °C; absent: not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub temperature_range: Option<[f64; 2]>,
    /// A constant temperature in place of the logged one, °C.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub temperature: Option<f64>,
}

impl KnownFriction {
    /// Friction of a joint by a fitted law, without bristles; `None` if the law has no Coulomb friction.
    pub fn of_law(joint: &str, law: &FrictionLaw) -> Option<Self> {
        let (low, high) = law.temperature_range;
        Some(KnownFriction {
            joint: joint.to_owned(),
            coulomb: law.value("fc")?,
            static_: law.value("fs"),
            stribeck_speed: law.value("vs"),
            stribeck_exponent: None,
            viscous: ViscousModel::of_law(law),
            bristle: None,
            temperature_range: (low.is_finite() && high.is_finite()).then_some([low, high]),
            temperature: None,
        })
    }

    /// Says what is wrong with the coefficients.
    ///
    /// # Errors
    /// The fault, in words.
    pub fn check(&self) -> Result<(), String> {
        let finite = |name: &str, x: f64| match x.abs() <= LARGEST {
            true => Ok(()),
            false => Err(format!("`{name}`: expected a number up to {LARGEST:e}, found {x}")),
        };
        let sign = |name: &str, x: f64, zero: bool| {
            finite(name, x)?;
            match x > 0.0 || (zero && x == 0.0) {
                true => Ok(()),
                false if zero => Err(format!("`{name}`: expected at least 0, found {x}")),
                false => Err(format!("`{name}`: expected a number above 0, found {x}")),
            }
        };
        sign("coulomb", self.coulomb, true)?;
        self.static_.map_or(Ok(()), |x| sign("static", x, false))?;
        self.stribeck_speed.map_or(Ok(()), |x| sign("stribeck_speed", x, false))?;
        self.stribeck_exponent.map_or(Ok(()), |x| sign("stribeck_exponent", x, false))?;
        match self.viscous {
            Some(ViscousModel::Linear { coefficient }) => finite("coefficient", coefficient)?,
            Some(ViscousModel::Exponential(e)) => {
                if !PLAUSIBLE.contains(&e.reference_temperature) {
                    let found = e.reference_temperature;
                    return Err(format!(
                        "`reference_temperature`: expected degrees Celsius, -40 to 120, found {found}"
                    ));
                }
                finite("sigma2", e.sigma2)?;
                sign("sigma3", e.sigma3, false)?;
                sign("sigma4", e.sigma4, false)?;
                for (name, slope) in [
                    ("sigma2_slope", e.sigma2_slope),
                    ("sigma3_slope", e.sigma3_slope),
                    ("sigma4_slope", e.sigma4_slope),
                ] {
                    finite(name, slope)?;
                }
            }
            None => {}
        }
        if let Some(bristle) = self.bristle {
            sign("sigma0", bristle.sigma0, false)?;
            sign("sigma1", bristle.sigma1, true)?;
        }
        if let Some([low, high]) = self.temperature_range
            && !(low.is_finite() && high.is_finite() && low <= high)
        {
            return Err(format!(
                "`temperature_range`: expected two ascending numbers, found [{low}, {high}]"
            ));
        }
        self.temperature.map_or(Ok(()), |t| finite("temperature", t))
    }

    /// Whether the law changes with the temperature.
    pub fn is_thermal(&self) -> bool {
        let slopes = |e: &ExponentialModel| [e.sigma2_slope, e.sigma3_slope, e.sigma4_slope];
        matches!(&self.viscous, Some(ViscousModel::Exponential(e)) if slopes(e).iter().any(|s| *s != 0.0))
    }

    /// Static friction and Stribeck speed, where both are known.
    fn rise(&self) -> Option<(f64, f64)> {
        self.static_.zip(self.stribeck_speed)
    }

    /// Bristles that have a friction to slip at.
    pub fn slipping_bristle(&self) -> Option<BristleModel> {
        self.bristle.filter(|_| self.coulomb > 0.0)
    }

    /// The elements at a rate.
    pub fn elements(&self, rate: usize) -> Vec<KnownElement> {
        let held = ShapeSetting::held;
        let delta = held(self.stribeck_exponent.unwrap_or(2.0));
        let mut out = Vec::new();
        match (self.slipping_bristle(), self.rise()) {
            (Some(bristle), rise) => {
                let (fixed, vs) = rise.unwrap_or((self.coulomb, 1.0));
                let kappa = held(bristle.sigma0 / self.coulomb);
                let element = LuGre { rate, kappa, rho: held(fixed / self.coulomb), vs: held(vs), delta };
                out.push(known(element, vec![self.coulomb, bristle.sigma1]));
            }
            (None, Some((fixed, vs))) => {
                out.push(known(Stribeck { rate, vs: held(vs), delta }, vec![self.coulomb, fixed]));
            }
            (None, None) => out.push(known(Coulomb { rate }, vec![self.coulomb])),
        }
        match self.viscous {
            Some(ViscousModel::Linear { coefficient }) => {
                out.push(known(Viscous { rate }, vec![coefficient]));
            }
            Some(ViscousModel::Exponential(e)) => {
                let element = ExponentialViscous {
                    rate,
                    sigma3: held(e.sigma3),
                    sigma3_slope: held(e.sigma3_slope),
                    sigma4: held(e.sigma4),
                    sigma4_slope: held(e.sigma4_slope),
                    reference_temperature: e.reference_temperature,
                    temperature_range: match self.temperature_range {
                        Some([low, high]) => (low, high),
                        None => (f64::NEG_INFINITY, f64::INFINITY),
                    },
                    // A law that does not change with the temperature asks for none.
                    temperature: match self.is_thermal() {
                        true => self.temperature,
                        false => Some(e.reference_temperature),
                    },
                };
                out.push(known(element, vec![e.sigma2, e.sigma2_slope]));
            }
            None => {}
        }
        out
    }

    /// The law in words.
    pub fn in_words(&self) -> String {
        let first = match (self.slipping_bristle(), self.rise()) {
            (Some(_), _) => "LuGre",
            (None, Some(_)) => "Stribeck",
            (None, None) => "Coulomb",
        };
        let viscous = match (&self.viscous, self.is_thermal()) {
            (None, _) => String::new(),
            (Some(ViscousModel::Linear { .. }), _) => " and linear viscous friction".to_owned(),
            (Some(_), false) => " and exponential viscous friction".to_owned(),
            (Some(_), true) => match self.temperature {
                Some(t) => format!(" and exponential viscous friction at {t} °C"),
                None => " and exponential viscous friction of the logged temperature".to_owned(),
            },
        };
        format!("{first}{viscous}")
    }
}

/// An element whose shape parameters are all held.
fn known(element: impl dynid_model::element::JointElement + 'static, linear: Vec<f64>) -> KnownElement {
    KnownElement { element: Box::new(element), linear, shape: Vec::new() }
}

/// Viscous friction.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(untagged)]
pub enum ViscousModel {
    /// `s(v) σ2(T) (1 - exp(-|σ3(T) v|^σ4(T)))` with `σ_j(T) = σ_j + σ_j_slope (T - T_ref)`.
    Exponential(ExponentialModel),
    /// `coefficient · v`.
    Linear {
        /// N m s/rad or N s/m.
        coefficient: f64,
    },
}

impl ViscousModel {
    /// Viscous friction of a fitted law; slopes that it lacks are 0.
    pub fn of_law(law: &FrictionLaw) -> Option<Self> {
        if let Some(coefficient) = law.value("fv") {
            return Some(ViscousModel::Linear { coefficient });
        }
        let ((sigma2, sigma2_slope), (sigma3, sigma3_slope), (sigma4, sigma4_slope)) =
            (law.line("sigma2")?, law.line("sigma3")?, law.line("sigma4")?);
        Some(ViscousModel::Exponential(ExponentialModel {
            reference_temperature: law.reference_temperature,
            sigma2,
            sigma2_slope,
            sigma3,
            sigma3_slope,
            sigma4,
            sigma4_slope,
        }))
    }
}

/// Coefficients of exponential viscous friction.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct ExponentialModel {
    /// `T_ref`, °C.
    pub reference_temperature: f64,
    /// Amplitude at `T_ref`, N m or N.
    pub sigma2: f64,
    /// Slope of the amplitude, N m/K or N/K.
    pub sigma2_slope: f64,
    /// Rate at `T_ref`, s/rad or s/m.
    pub sigma3: f64,
    /// Slope of the rate, per K.
    pub sigma3_slope: f64,
    /// Exponent at `T_ref`.
    pub sigma4: f64,
    /// Slope of the exponent, per K.
    pub sigma4_slope: f64,
}

/// Bristles of LuGre friction: `ż = v - σ0 |v| z/g(v)`, effort `σ0 z + σ1 ż`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct BristleModel {
    /// Stiffness, N m/rad or N/m.
    pub sigma0: f64,
    /// Damping, N m s/rad or N s/m.
    pub sigma1: f64,
    /// True: stated as prior, not identified.
    #[serde(default)]
    pub prior: bool,
}

/// Friction that is taken as known.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct KnownLaws {
    /// Laws by joint; those of joints that the robot does not move are left out.
    pub laws: Vec<KnownFriction>,
    /// Joints with friction of which no law may be used, for messages.
    pub stated: Vec<String>,
    /// Where they come from.
    pub source: SourceFile,
    /// Sign of their errors. Default `free`.
    pub errors: FrictionErrors,
    /// Constant temperature of joints in place of the logged one, °C. Default: none.
    pub temperature: PerJoint,
}

impl KnownLaws {
    /// Laws of `joints`, in their order.
    ///
    /// # Errors
    /// [`Error::NoKnownFriction`] if no joint has one, [`Error::KnownFriction`] if a coefficient makes no sense, [`Error::Setting`] for a
    /// temperature that no joint has.
    pub fn of_joints(&self, joints: &[String]) -> Result<Vec<KnownFriction>, Error> {
        let temperatures = self.temperature.finite("elements.temperature", joints)?;
        let mut out = Vec::new();
        for (joint, temperature) in joints.iter().zip(&temperatures) {
            let Some(mut known) = self.laws.iter().find(|law| law.joint == *joint).cloned() else { continue };
            if let Some(t) = temperature.filter(|t| !PLAUSIBLE.contains(t)) {
                return Err(Error::setting("elements.temperature", "degrees Celsius", t));
            }
            known.temperature = *temperature;
            let file = self.source.path.clone();
            known.check().map_err(|fault| Error::KnownFriction { file, joint: joint.clone(), fault })?;
            out.push(known);
        }
        if out.is_empty() {
            let (file, stated) = (self.source.path.clone(), self.stated.clone());
            return Err(Error::NoKnownFriction { file, stated, joints: joints.to_vec() });
        }
        Ok(out)
    }
}

/// Sign of the errors of known friction.
#[derive(Debug, Clone, Copy, Default, Deserialize, Serialize, PartialEq, Eq, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum FrictionErrors {
    /// Any: known friction may be too large or too small.
    #[default]
    Free,
    /// Not negative, as coefficients of friction.
    Nonnegative,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn law() -> KnownFriction {
        KnownFriction {
            joint: "j1".to_owned(),
            coulomb: 4.0,
            static_: Some(6.0),
            stribeck_speed: Some(0.05),
            stribeck_exponent: None,
            viscous: Some(ViscousModel::Exponential(ExponentialModel {
                reference_temperature: 30.0,
                sigma2: 20.0,
                sigma2_slope: -0.2,
                sigma3: 0.6,
                sigma3_slope: 0.0,
                sigma4: 0.8,
                sigma4_slope: 0.0,
            })),
            bristle: Some(BristleModel { sigma0: 4000.0, sigma1: 3.0, prior: false }),
            temperature_range: Some([20.0, 45.0]),
            temperature: None,
        }
    }

    #[test]
    fn the_law_is_as_rich_as_what_is_known() {
        let names = |law: &KnownFriction| {
            law.elements(0).iter().map(|k| format!("{:?}", k.element)).collect::<Vec<_>>().join(" ")
        };
        assert!(names(&law()).starts_with("LuGre"));
        assert!(names(&KnownFriction { bristle: None, ..law() }).starts_with("Stribeck"));
        assert!(names(&KnownFriction { bristle: None, static_: None, ..law() }).starts_with("Coulomb"));
        assert!(names(&law()).contains("temperature: None"));
        let mut constant = law();
        if let Some(ViscousModel::Exponential(e)) = &mut constant.viscous {
            e.sigma2_slope = 0.0;
        }
        assert!(!constant.is_thermal() && names(&constant).contains("temperature: Some(30.0)"));
    }

    #[test]
    fn senseless_coefficients_are_named() {
        for (fault, broken) in [
            ("coulomb", KnownFriction { coulomb: -1.0, ..law() }),
            ("static", KnownFriction { static_: Some(f64::NAN), ..law() }),
            ("stribeck_speed", KnownFriction { stribeck_speed: Some(0.0), ..law() }),
            ("temperature_range", KnownFriction { temperature_range: Some([50.0, 20.0]), ..law() }),
        ] {
            assert!(broken.check().unwrap_err().contains(fault), "{fault}");
        }
        assert_eq!(law().check(), Ok(()));
    }
}
