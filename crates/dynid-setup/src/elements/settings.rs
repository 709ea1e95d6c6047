//! Settings of elements in a robot file, read as the registry says.

use dynid_model::element::{
    ElementKind, ElementRegistry, JointElement, OptionTerm, OptionValue, Placement, ShapeSetting, ShapeTerm,
};
use dynid_robots::{ElementSetting, SettingValue};

use crate::Error;

const SHAPE_KEYS: [&str; 4] = ["start", "lower", "upper", "held"];
/// Key of the scale of speed.
pub(super) const SPEED: &str = "speed";

/// Refuses settings of elements that do not exist, and keys and values that no element takes, also of elements that are not in
/// use.
///
/// # Errors
/// [`Error::UnknownElement`], [`Error::ElementSetting`].
pub(super) fn check(registry: &ElementRegistry, settings: &[ElementSetting]) -> Result<(), Error> {
    for ElementSetting { joint, element, .. } in settings {
        Settings::of(kind(registry, element, joint)?, joint, settings).check_keys()?;
    }
    Ok(())
}

/// The kind of an element at a joint.
///
/// # Errors
/// [`Error::UnknownElement`].
pub(super) fn kind<'a>(
    registry: &'a ElementRegistry,
    name: &str,
    joint: &str,
) -> Result<&'a ElementKind, Error> {
    registry.kind(name).ok_or_else(|| Error::UnknownElement {
        name: name.to_owned(),
        joint: joint.to_owned(),
        known: registry.names().map(str::to_owned).collect(),
    })
}

/// The element of a kind at a joint; `None` if it takes more than a joint. `speed`: largest speed of the joint, if known.
///
/// # Errors
/// [`Error::ElementSetting`].
pub(super) fn place(
    kind: &ElementKind,
    rate: usize,
    joint: &str,
    speed: Option<f64>,
    settings: &[ElementSetting],
) -> Result<Option<Box<dyn JointElement>>, Error> {
    let settings = Settings::of(kind, joint, settings);
    settings.check_keys()?;
    let v_max = settings.speed()?.or(speed.filter(|v| v.is_finite() && *v > 0.0)).unwrap_or(1.0);
    let shape = kind.shape.iter().map(|term| settings.shape(term, v_max)).collect::<Result<Vec<_>, _>>()?;
    let options = settings.options()?;
    match kind.place(&Placement { rate, shape: &shape, options: &options }) {
        None => Ok(None),
        Some(built) => built.map(Some).map_err(|fault| settings.fault(fault)),
    }
}

/// Settings of one element at one joint.
struct Settings<'a> {
    kind: &'a ElementKind,
    joint: &'a str,
    own: Vec<&'a ElementSetting>,
}

impl<'a> Settings<'a> {
    fn of(kind: &'a ElementKind, joint: &'a str, settings: &'a [ElementSetting]) -> Self {
        let own = settings.iter().filter(|s| s.joint == joint && s.element == kind.name).collect();
        Settings { kind, joint, own }
    }

    fn fault(&self, fault: String) -> Error {
        Error::ElementSetting { element: self.kind.name.to_owned(), joint: self.joint.to_owned(), fault }
    }

    fn check_keys(&self) -> Result<(), Error> {
        let ElementKind { stated, options, shape, .. } = self.kind;
        for setting in &self.own {
            let (head, tail) = setting.key.split_once('.').unwrap_or((&setting.key, ""));
            let is_shape =
                shape.iter().any(|s| s.symbol == head) && (tail.is_empty() || SHAPE_KEYS.contains(&tail));
            let is_option = tail.is_empty() && options.iter().any(|o| o.key() == head);
            let is_value = tail.is_empty()
                && (stated.iter().any(|s| s.key == head) || (self.kind.scales() && head == SPEED));
            if !is_shape && !is_option && !is_value {
                return Err(self.unknown(setting));
            }
            if is_value {
                self.number(&setting.key)?;
            }
        }
        self.options().map(drop)
    }

    fn unknown(&self, setting: &ElementSetting) -> Error {
        let ElementKind { stated, options, shape, .. } = self.kind;
        let values = stated.iter().map(|s| s.key).chain(options.iter().map(OptionTerm::key));
        let values = values.chain(self.kind.scales().then_some(SPEED)).map(|key| format!("`{key}`"));
        let shapes = shape.iter().map(|s| {
            let symbol = s.symbol;
            format!("`{symbol}` (or `{symbol}.{}`)", SHAPE_KEYS.join(&format!("`, `{symbol}.")))
        });
        let expected: Vec<String> = values.chain(shapes).collect();
        let (kind, found) = match setting.key.as_str() {
            "" => ("a table with some of", in_words(&setting.value)),
            key => ("one of", format!("`{key}`")),
        };
        self.fault(match expected.is_empty() {
            true => format!("expected no settings, found {found}"),
            false => format!("expected {kind} {}, found {found}", expected.join(", ")),
        })
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
            // Result files record what is held as a number.
            Some(SettingValue::Number(x)) if *x == 0.0 || *x == 1.0 => Ok(Some(*x == 1.0)),
            Some(_) => Err(self.not_a_flag(key)),
        }
    }

    fn not_a_flag(&self, key: &str) -> Error {
        let found = self.setting(key).map_or_else(String::new, in_words);
        self.fault(format!("`{key}`: expected true or false, found {found}"))
    }

    fn options(&self) -> Result<Vec<(&'static str, OptionValue)>, Error> {
        let mut out = Vec::new();
        for option in &self.kind.options {
            let value = match *option {
                OptionTerm::Flag { key } => match self.setting(key) {
                    Some(SettingValue::Number(_)) => return Err(self.not_a_flag(key)),
                    _ => self.flag(key)?.map(OptionValue::Flag),
                },
                OptionTerm::Number { key, expected, holds, .. } => match self.number(key)? {
                    Some(x) if !holds(x) => {
                        return Err(self.fault(format!("`{key}`: expected {expected}, found {x}")));
                    }
                    x => x.map(OptionValue::Number),
                },
            };
            out.extend(value.map(|value| (option.key(), value)));
        }
        Ok(out)
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
    fn shape(&self, term: &ShapeTerm, v_max: f64) -> Result<ShapeSetting, Error> {
        let (key, default) = (term.symbol, term.setting(v_max));
        let of = |field: &str| format!("{key}.{field}");
        let start = self.number(key)?.or(self.number(&of("start"))?);
        if term.needed && start.is_none() {
            let symbols: Vec<String> =
                self.kind.shape.iter().filter(|t| t.needed).map(|t| format!("{} = ..", t.symbol)).collect();
            return Err(self.fault(format!(
                "`{key}`: expected a value in {}, found none; state `{} = {{ {} }}`",
                term.units[0],
                self.kind.name,
                symbols.join(", ")
            )));
        }
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
        setting.check(term.positive).map_err(|e| self.fault(format!("`{key}`: {e}")))?;
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
