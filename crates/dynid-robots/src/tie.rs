//! Ties of parameters, in robot files and configurations.

use std::collections::BTreeMap;

use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

/// Parameters that are known, or multiples or sums of others: one of `equal`, `ratio`, `sum`, `known` and `massless`. A list of names alone
/// says `equal`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, schemars::JsonSchema)]
pub struct TieSpec {
    /// Parameters that are equal, by name such as `joint1.fc`; or joints, or links, all of whose parameters are. The first one stands for all:
    /// what the robot file states of it counts.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub equal: Vec<String>,
    /// Equal links are mirror images in the plane across this axis of their frames: the first against each other one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mirror: Option<MirrorAxis>,
    /// Parameters in a fixed proportion, and their shares.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub ratio: BTreeMap<String, f64>,
    /// Factors of parameters whose sum is `value`.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub sum: BTreeMap<String, f64>,
    /// What `sum` adds up to, in the unit of its terms.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub value: Option<f64>,
    /// Values of parameters, in their units.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub known: BTreeMap<String, f64>,
    /// Links without mass: carriers between the joints of one place.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub massless: Vec<String>,
}

/// Axis of a frame that a mirror turns round.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum MirrorAxis {
    /// x.
    X,
    /// y.
    Y,
    /// z.
    Z,
}

/// What is wrong with a tie, whatever the robot.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TieFault {
    /// Key.
    pub key: &'static str,
    /// What the key should hold.
    pub expected: &'static str,
    /// What it holds.
    pub found: String,
}

impl TieSpec {
    /// Names of the robot's parameters, joints and links that it speaks of.
    pub fn names(&self) -> impl Iterator<Item = &String> {
        let of_tables = self.ratio.keys().chain(self.sum.keys()).chain(self.known.keys());
        self.equal.iter().chain(of_tables).chain(&self.massless)
    }

    /// The first name that is none of a robot's: neither `owners`, its joints, motors and links, nor a parameter of one, `<owner>.<symbol>`.
    pub fn unknown<'a>(&'a self, owners: &[&str]) -> Option<&'a String> {
        let of = |name: &str, owner: &str| {
            name.strip_prefix(owner).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
        };
        self.names().find(|name| !owners.iter().any(|owner| of(name, owner)))
    }

    /// Checks what can be told without a robot.
    ///
    /// # Errors
    /// The first fault.
    pub fn check(&self) -> Result<(), TieFault> {
        let fault = |key, expected, found: String| Err(TieFault { key, expected, found });
        let stated = [
            ("equal", !self.equal.is_empty()),
            ("ratio", !self.ratio.is_empty()),
            ("sum", !self.sum.is_empty()),
            ("known", !self.known.is_empty()),
            ("massless", !self.massless.is_empty()),
        ];
        let given: Vec<&str> = stated.iter().filter(|(_, given)| *given).map(|(key, _)| *key).collect();
        if given.len() != 1 {
            let found = if given.is_empty() {
                "none of them".to_owned()
            } else {
                format!("`{}`", given.join("`, `"))
            };
            return fault("", "one of `equal`, `ratio`, `sum`, `known`, `massless`", found);
        }
        let twice = |list: &[String]| {
            list.iter().enumerate().find(|(k, n)| list[..*k].contains(n)).map(|(_, n)| n.clone())
        };
        for (key, list) in [("equal", &self.equal), ("massless", &self.massless)] {
            if let Some(name) = twice(list) {
                return fault(key, "every name once", format!("`{name}` twice"));
            }
        }
        if self.equal.len() == 1 {
            return fault("equal", "at least two names", format!("`{}` alone", self.equal[0]));
        }
        if let (Some(_), true) = (self.mirror, self.equal.is_empty()) {
            return fault(
                "mirror",
                "a tie with `equal`, whose links are mirror images",
                format!("`{}`", given[0]),
            );
        }
        if self.ratio.len() == 1 {
            return fault("ratio", "at least two parameters", "one".to_owned());
        }
        match (self.value, self.sum.is_empty()) {
            (None, false) => return fault("value", "what the sum is", "nothing".to_owned()),
            (Some(_), true) => {
                return fault("value", "a tie with `sum`, whose value it is", format!("`{}`", given[0]));
            }
            _ => {}
        }
        for (key, table) in [("ratio", &self.ratio), ("sum", &self.sum)] {
            if let Some((name, x)) = table.iter().find(|(_, x)| !x.is_finite() || **x == 0.0) {
                return fault(key, "finite numbers that are not 0", format!("{name} = {x}"));
            }
        }
        if let Some((name, x)) = self.known.iter().find(|(_, x)| !x.is_finite()) {
            return fault("known", "finite numbers", format!("{name} = {x}"));
        }
        match self.value.filter(|x| !x.is_finite()) {
            Some(x) => fault("value", "a finite number", x.to_string()),
            None => Ok(()),
        }
    }

    /// The tie in words: `equal = ["j1", "j2"]`.
    pub fn words(&self) -> String {
        let list = |names: &[String]| names.iter().map(|n| format!("\"{n}\"")).collect::<Vec<_>>().join(", ");
        let table = |map: &BTreeMap<String, f64>| {
            map.iter().map(|(name, x)| format!("\"{name}\" = {x}")).collect::<Vec<_>>().join(", ")
        };
        if !self.equal.is_empty() {
            return format!("equal = [{}]", list(&self.equal));
        }
        if !self.massless.is_empty() {
            return format!("massless = [{}]", list(&self.massless));
        }
        let value = self.value.map_or_else(String::new, |x| format!(", value = {x}"));
        let tables = [("ratio", &self.ratio), ("sum", &self.sum), ("known", &self.known)];
        let given = tables.into_iter().find(|(_, map)| !map.is_empty());
        given.map_or_else(String::new, |(key, map)| format!("{key} = {{ {} }}{value}", table(map)))
    }
}

/// The keys, for serde.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TieTable {
    #[serde(default)]
    equal: Vec<String>,
    mirror: Option<MirrorAxis>,
    #[serde(default)]
    ratio: BTreeMap<String, f64>,
    #[serde(default)]
    sum: BTreeMap<String, f64>,
    value: Option<f64>,
    #[serde(default)]
    known: BTreeMap<String, f64>,
    #[serde(default)]
    massless: Vec<String>,
}

impl<'de> Deserialize<'de> for TieSpec {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = TieSpec;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("a list of names that are equal, or a table with `equal`, `ratio`, `sum`, `known` or `massless`")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<TieSpec, A::Error> {
                let equal = Vec::deserialize(SeqAccessDeserializer::new(list))?;
                Ok(TieSpec { equal, ..TieSpec::default() })
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<TieSpec, A::Error> {
                let TieTable { equal, mirror, ratio, sum, value, known, massless } =
                    TieTable::deserialize(MapAccessDeserializer::new(map))?;
                Ok(TieSpec { equal, mirror, ratio, sum, value, known, massless })
            }
        }
        deserializer.deserialize_any(Either)
    }
}
