//! Friction elements with shape parameters, from the settings of a robot file.

use dynid_io::{ElementSetting, SettingValue};
use dynid_model::element::{
    Arctangent, ExponentialViscous, JointElement, LuGre, PowerLaw, ShapeSetting, Sigmoid, SigmoidOffset,
    Stribeck, StribeckViscous, TanhFriction,
};

use crate::Error;

/// Settings that state a linear parameter: element, key, symbol of the parameter.
pub(super) const STATED: [(&str, &str, &str); 14] = [
    ("arctangent", "effort", "fa"),
    ("stribeck", "coulomb", "fc"),
    ("stribeck", "static", "fs"),
    ("tanh", "effort", "ft"),
    ("sigmoid", "effort", "fg"),
    ("sigmoid_offset", "effort", "fl"),
    ("power", "coefficient", "fp"),
    ("viscous_magnitude", "coefficient", "fva"),
    ("stribeck_viscous", "coefficient", "fvs"),
    ("load", "coefficient", "mu"),
    ("exponential_viscous", "sigma2", "sigma2"),
    ("exponential_viscous", "sigma2_slope", "sigma2_slope"),
    ("lugre", "coulomb", "fc"),
    ("lugre", "sigma1", "sigma1"),
];

/// Shape parameters of every element, and whether its bounds scale with the speeds in use.
const SHAPES: [(&str, &[&str], bool); 9] = [
    ("arctangent", &["fb"], true),
    ("stribeck", &["vs", "delta"], true),
    ("stribeck_viscous", &["vs", "delta"], true),
    ("tanh", &["w"], true),
    ("sigmoid", &["phi2", "phi3"], false),
    ("sigmoid_offset", &["alpha", "nu"], false),
    ("power", &["p"], false),
    ("exponential_viscous", &["sigma3", "sigma3_slope", "sigma4", "sigma4_slope"], false),
    ("lugre", &["kappa", "rho", "vs", "delta"], true),
];

/// Further settings, numbers: element and key.
const OPTIONS: [(&str, &str); 4] = [
    ("exponential_viscous", "reference_temperature"),
    ("exponential_viscous", "temperature"),
    ("exponential_viscous", "temperature_min"),
    ("exponential_viscous", "temperature_max"),
];

/// Friction coefficients that a passive law has positive; offsets and the difference between the directions have any sign.
pub(crate) const COEFFICIENTS: [&str; 14] =
    ["fc", "fs", "fv", "fvs", "fa", "ft", "fg", "fl", "fp", "fcp", "fcn", "fvp", "fvn", "sigma2"];

/// Friction laws of the speed alone that have no shape parameters.
const UNSHAPED: [&str; 4] = ["coulomb", "viscous", "asymmetric", "viscous_magnitude"];

/// Whether an element is friction of the joint's own speed alone.
pub fn is_law(name: &str) -> bool {
    UNSHAPED.contains(&name) || is_shaped(name)
}

/// Whether an element is friction with shape parameters, known or not.
pub fn is_shaped(name: &str) -> bool {
    SHAPES.iter().any(|(element, _, _)| *element == name)
}

const SHAPE_KEYS: [&str; 4] = ["start", "lower", "upper", "held"];
/// Key of the scale of speed.
pub(super) const SPEED: &str = "speed";

/// Whether the bounds of an element's shape parameters scale with the speeds in use.
pub(super) fn scales(name: &str) -> bool {
    SHAPES.iter().any(|(element, _, scaled)| *element == name && *scaled)
}

/// The element of this name at a joint; `None` if it is none of these. `speed`: largest speed of the joint, if known.
pub(super) fn build(
    name: &str,
    rate: usize,
    joint: &str,
    speed: Option<f64>,
    settings: &[ElementSetting],
) -> Option<Result<Box<dyn JointElement>, Error>> {
    let (element, shapes, scaled) = *SHAPES.iter().find(|(element, _, _)| *element == name)?;
    let own = settings.iter().filter(|s| s.joint == joint && s.element == name).collect();
    Some(Settings { element, joint, own }.build(rate, shapes, scaled, speed))
}

/// Checks the settings of an element at a joint; whether it is one of these elements.
///
/// # Errors
/// [`Error::ElementSetting`] for a key that the element does not take.
pub(super) fn check(name: &str, joint: &str, settings: &[ElementSetting]) -> Result<bool, Error> {
    let Some((element, shapes, scaled)) = SHAPES.iter().find(|(element, _, _)| *element == name) else {
        return Ok(false);
    };
    let own = settings.iter().filter(|s| s.joint == joint && s.element == name).collect();
    Settings { element, joint, own }.check_keys(shapes, *scaled).map(|()| true)
}

/// Settings of one element at one joint.
struct Settings<'a> {
    element: &'static str,
    joint: &'a str,
    own: Vec<&'a ElementSetting>,
}

impl Settings<'_> {
    fn build(
        &self,
        rate: usize,
        shapes: &[&str],
        scaled: bool,
        speed: Option<f64>,
    ) -> Result<Box<dyn JointElement>, Error> {
        self.check_keys(shapes, scaled)?;
        let v_max = self.speed()?.or(speed.filter(|v| v.is_finite() && *v > 0.0)).unwrap_or(1.0);
        Ok(match self.element {
            "arctangent" => {
                let Arctangent { fb, .. } = Arctangent::scaled(rate, v_max);
                Box::new(Arctangent { rate, fb: self.shape("fb", fb, true)? })
            }
            "stribeck" => {
                let Stribeck { vs, delta, .. } = Stribeck::scaled(rate, v_max);
                let (vs, delta) = (self.shape("vs", vs, true)?, self.shape("delta", delta, true)?);
                Box::new(Stribeck { rate, vs, delta })
            }
            "stribeck_viscous" => {
                let StribeckViscous { vs, delta, .. } = StribeckViscous::scaled(rate, v_max);
                let (vs, delta) = (self.shape("vs", vs, true)?, self.shape("delta", delta, true)?);
                Box::new(StribeckViscous { rate, vs, delta })
            }
            "tanh" => {
                let TanhFriction { w, .. } = TanhFriction::scaled(rate, v_max);
                Box::new(TanhFriction { rate, w: self.shape("w", w, true)? })
            }
            "exponential_viscous" => Box::new(self.exponential_viscous(rate)?),
            "lugre" => {
                let LuGre { kappa, rho, vs, delta, .. } = LuGre::scaled(rate, v_max);
                Box::new(LuGre {
                    rate,
                    kappa: self.shape("kappa", kappa, true)?,
                    rho: self.shape("rho", rho, true)?,
                    vs: self.shape("vs", vs, true)?,
                    delta: self.shape("delta", delta, true)?,
                })
            }
            "sigmoid" => {
                let Sigmoid { phi2, phi3, .. } = Sigmoid::new(rate);
                let (phi2, phi3) = (self.shape("phi2", phi2, true)?, self.shape("phi3", phi3, false)?);
                Box::new(Sigmoid { rate, phi2, phi3 })
            }
            "sigmoid_offset" => {
                let SigmoidOffset { alpha, nu, .. } = SigmoidOffset::new(rate);
                let (alpha, nu) = (self.shape("alpha", alpha, true)?, self.shape("nu", nu, false)?);
                Box::new(SigmoidOffset { rate, alpha, nu })
            }
            _ => {
                let PowerLaw { p, .. } = PowerLaw::new(rate);
                Box::new(PowerLaw { rate, p: self.shape("p", p, true)? })
            }
        })
    }

    fn exponential_viscous(&self, rate: usize) -> Result<ExponentialViscous, Error> {
        let default = ExponentialViscous::new(rate);
        let number = |key: &str, default: f64| -> Result<f64, Error> {
            let x = self.number(key)?.unwrap_or(default);
            match x.is_nan() {
                true => Err(self.fault(format!("`{key}`: expected a number, found {x}"))),
                false => Ok(x),
            }
        };
        let (lowest, highest) = default.temperature_range;
        let range = (number("temperature_min", lowest)?, number("temperature_max", highest)?);
        if range.0 >= range.1 {
            let fault = format!(
                "expected `temperature_min` below `temperature_max`, found {} and {}",
                range.0, range.1
            );
            return Err(self.fault(fault));
        }
        let degrees = |key: &str, t: f64| match dynid_motion::temperature::PLAUSIBLE.contains(&t) {
            true => Ok(t),
            false => Err(self.fault(format!("`{key}`: expected degrees Celsius, found {t}"))),
        };
        Ok(ExponentialViscous {
            sigma3: self.shape("sigma3", default.sigma3, true)?,
            sigma3_slope: self.shape("sigma3_slope", default.sigma3_slope, false)?,
            sigma4: self.shape("sigma4", default.sigma4, true)?,
            sigma4_slope: self.shape("sigma4_slope", default.sigma4_slope, false)?,
            reference_temperature: degrees(
                "reference_temperature",
                number("reference_temperature", default.reference_temperature)?,
            )?,
            temperature_range: range,
            temperature: match self.number("temperature")? {
                Some(t) => Some(degrees("temperature", t)?),
                None => None,
            },
            ..default
        })
    }

    fn fault(&self, fault: String) -> Error {
        Error::ElementSetting { element: self.element.to_owned(), joint: self.joint.to_owned(), fault }
    }

    fn check_keys(&self, shapes: &[&str], scaled: bool) -> Result<(), Error> {
        let stated = STATED.iter().map(|(element, key, _)| (element, key));
        let values: Vec<&str> = stated
            .chain(OPTIONS.iter().map(|(element, key)| (element, key)))
            .filter(|(element, _)| **element == self.element)
            .map(|(_, key)| *key)
            .collect();
        for setting in &self.own {
            let (head, tail) = setting.key.split_once('.').unwrap_or((&setting.key, ""));
            let shape = shapes.contains(&head) && (tail.is_empty() || SHAPE_KEYS.contains(&tail));
            let value = tail.is_empty() && (values.contains(&head) || (scaled && head == SPEED));
            if !shape && !value {
                let values =
                    values.iter().map(|v| format!("`{v}`")).chain(scaled.then(|| format!("`{SPEED}`")));
                let shapes = shapes
                    .iter()
                    .map(|s| format!("`{s}` (or `{s}.{}`)", SHAPE_KEYS.join(&format!("`, `{s}."))));
                let expected: Vec<String> = values.chain(shapes).collect();
                let (kind, found) = match setting.key.as_str() {
                    "" => ("a table with some", in_words(&setting.value)),
                    key => ("one", format!("`{key}`")),
                };
                return Err(self.fault(format!("expected {kind} of {}, found {found}", expected.join(", "))));
            }
            if value {
                self.number(&setting.key)?;
            }
        }
        Ok(())
    }

    fn setting(&self, key: &str) -> Option<&SettingValue> {
        self.own.iter().find(|s| s.key == key).map(|s| &s.value)
    }

    fn number(&self, key: &str) -> Result<Option<f64>, Error> {
        match self.setting(key) {
            None => Ok(None),
            Some(SettingValue::Number(x)) => Ok(Some(*x)),
            Some(other) => Err(self.fault(format!("`{key}`: expected a number, found {}", in_words(other)))),
        }
    }

    fn flag(&self, key: &str) -> Result<Option<bool>, Error> {
        match self.setting(key) {
            None => Ok(None),
            Some(SettingValue::Flag(flag)) => Ok(Some(*flag)),
            // Result files record settings as numbers.
            Some(SettingValue::Number(x)) if *x == 0.0 || *x == 1.0 => Ok(Some(*x == 1.0)),
            Some(other) => {
                Err(self.fault(format!("`{key}`: expected true or false, found {}", in_words(other))))
            }
        }
    }

    fn speed(&self) -> Result<Option<f64>, Error> {
        match self.number(SPEED)? {
            Some(v) if v <= 0.0 => {
                Err(self.fault(format!("`{SPEED}`: expected a number above 0, found {v}")))
            }
            v => Ok(v),
        }
    }

    /// A shape parameter: `<key> = start`, or a table with `start`, `lower`, `upper`, `held`. Bounds about which nothing is
    /// said are the default's, widened to hold the start.
    fn shape(&self, key: &str, default: ShapeSetting, positive: bool) -> Result<ShapeSetting, Error> {
        let of = |field: &str| format!("{key}.{field}");
        let start = self.number(key)?.or(self.number(&of("start"))?);
        let (lower, upper) = (self.number(&of("lower"))?, self.number(&of("upper"))?);
        let held = self.flag(&of("held"))?.unwrap_or(default.held);
        // A default start outside of stated bounds moves to the nearest of them.
        let start = start.unwrap_or_else(|| {
            let start = lower.map_or(default.start, |l| default.start.max(l));
            upper.map_or(start, |u| start.min(u))
        });
        let setting = ShapeSetting {
            start,
            lower: lower.unwrap_or(default.lower.min(start)),
            upper: upper.unwrap_or(default.upper.max(start)),
            held,
        };
        setting.check(positive).map_err(|e| self.fault(format!("`{key}`: {e}")))?;
        Ok(setting)
    }
}

fn in_words(value: &SettingValue) -> String {
    match value {
        SettingValue::Number(x) => x.to_string(),
        SettingValue::Text(text) => format!("{text:?}"),
        SettingValue::Flag(flag) => flag.to_string(),
        SettingValue::Numbers(list) => format!("{list:?}"),
        SettingValue::Texts(list) => format!("{list:?}"),
    }
}
