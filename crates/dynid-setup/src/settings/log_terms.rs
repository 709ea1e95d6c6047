//! What differs from log to log: payloads and terms of their own.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::Settings;
use crate::Error;
use crate::per_joint::PerJoint;

/// A body that some logs carry.
#[derive(Debug, Clone, Default, Deserialize, Serialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct PayloadConfig {
    /// Name, for `payload = "name"` in logs and for its parameters `name.m` ...
    pub name: String,
    /// Moving link that carries it. Default: the last one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub link: Option<String>,
    /// Largest mass thought possible, kg: decides what is known of it without a log. Default 5.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rated_mass: Option<f64>,
    /// Mass if it is known, kg.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mass: Option<f64>,
    /// Standard deviation of that mass, kg. Default 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mass_std: Option<f64>,
    /// Centre of mass if it is known, in the joint frame of the link, m.
    #[serde(deserialize_with = "super::lists::exactly", skip_serializing_if = "Option::is_none")]
    pub com: Option<[f64; 3]>,
    /// Inertia about the centre of mass in the axes of the link if it is known, `[Ixx, Ixy, Ixz, Iyy, Iyz, Izz]`, kg m².
    #[serde(deserialize_with = "super::lists::exactly", skip_serializing_if = "Option::is_none")]
    pub inertia: Option<[f64; 6]>,
}

/// Masses that a payload may have, kg.
pub const MASSES: std::ops::RangeInclusive<f64> = 1e-6..=1e6;

/// Largest mass of a payload about which nothing is said, kg.
pub const RATED_MASS: f64 = 5.0;

/// What a log has of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Own {
    /// Offset of every joint that has one: zero of its torque sensor or current.
    Offset,
    /// Coulomb and viscous friction of every joint that has friction: colder or warmer gears.
    Friction,
    /// One factor on the friction of all joints: gears that are colder or warmer altogether.
    FrictionScale,
    /// Delay of the motion behind the logged effort.
    Delay,
}

impl Own {
    /// The word of the configuration.
    pub fn word(self) -> &'static str {
        match self {
            Own::Offset => "offset",
            Own::Friction => "friction",
            Own::FrictionScale => "friction_scale",
            Own::Delay => "delay",
        }
    }
}

impl PayloadConfig {
    /// The rated mass, or [`RATED_MASS`].
    pub fn rated(&self) -> f64 {
        self.rated_mass.unwrap_or(RATED_MASS)
    }

    /// Whether mass, centre of mass and inertia are all known.
    pub fn is_known(&self) -> bool {
        self.mass.is_some() && self.com.is_some() && self.inertia.is_some()
    }

    fn check(&self) -> Result<(), Error> {
        let key = |key: &str| format!("payload.{}.{key}", self.name);
        let positive = [("rated_mass", self.rated_mass), ("mass", self.mass)];
        for (name, value) in positive.into_iter().filter_map(|(n, v)| Some((n, v?))) {
            if !MASSES.contains(&value) {
                return Err(Error::setting(&key(name), "a positive number, 1e-6 to 1e6 kg", value));
            }
        }
        if let Some(std) = self.mass_std.filter(|s| *s != 0.0 && !MASSES.contains(s)) {
            return Err(Error::setting(&key("mass_std"), "0, or 1e-6 to 1e6 kg", std));
        }
        let beside =
            |name: &str, with: &str| Error::setting(&key(name), &format!("`{with}` beside it"), "none");
        if self.mass.is_none() && self.mass_std.is_some() {
            return Err(beside("mass_std", "mass"));
        }
        if self.mass.is_none() && self.com.is_some() {
            return Err(beside("com", "mass"));
        }
        if self.com.is_none() && self.inertia.is_some() {
            return Err(beside("inertia", "com"));
        }
        let numbers = self.com.iter().flatten().chain(self.inertia.iter().flatten());
        match numbers.copied().find(|x| x.is_nan() || x.abs() > *MASSES.end()) {
            Some(x) => Err(Error::setting(&key("com, inertia"), "numbers up to 1e6", x)),
            None => Ok(()),
        }
    }
}

/// What an identification has to know of a log beside its signals.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct LogSettings {
    /// Name in parameters and messages. Default: the name of the log's file up to its first dot.
    pub name: Option<String>,
    /// The payload that it carries. Default: none.
    pub payload: Option<String>,
    /// What it has of its own, beside the other training logs. Default: nothing.
    pub own: Vec<Own>,
    /// Of a validation log: the training log whose own terms it shares. Default: none.
    pub like: Option<String>,
    /// Temperature of joints throughout the log, °C, in place of the logged one, where it was stated.
    #[serde(skip_serializing_if = "PerJoint::is_none")]
    pub temperature: PerJoint,
    /// Whether it is kept from the fit, to validate on. Default false.
    pub validation: bool,
    /// Period of its motion, s, if it repeats: states come from a Fourier series of that period. Default: none.
    pub period_s: Option<f64>,
}

impl Settings {
    /// Checks names and numbers of payloads.
    pub(super) fn check_payloads(&self) -> Result<(), Error> {
        for (k, payload) in self.payload.iter().enumerate() {
            if payload.name.trim().is_empty() {
                return Err(Error::setting("payload.name", "a name in every `[[payload]]`", "none"));
            }
            if payload.name.chars().any(char::is_control) {
                let found = format!("{:?}", payload.name);
                return Err(Error::setting("payload.name", "a name without control characters", found));
            }
            if self.payload[..k].iter().any(|p| p.name == payload.name) {
                return Err(Error::setting("payload.name", "names that occur once", &payload.name));
            }
            payload.check()?;
        }
        Ok(())
    }

    /// Checks what differs from log to log. `labels`: names of the training logs ([`labels`]).
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub fn check_logs(
        &self,
        training: &[&LogSettings],
        validation: &[&LogSettings],
        labels: &[String],
    ) -> Result<(), Error> {
        for log in training.iter().chain(validation) {
            let known: Vec<String> = self.payload.iter().map(|p| p.name.clone()).collect();
            one_of("payload", log.payload.as_ref(), &known, "[[payload]]")?;
        }
        let mut names = training.iter().filter_map(|log| log.name.as_ref());
        if let Some(name) = names.find(|name| name.chars().any(char::is_control)) {
            return Err(Error::setting("log.name", "a name without control characters", format!("{name:?}")));
        }
        for payload in &self.payload {
            let carried = |log: &&LogSettings| log.payload.as_ref() == Some(&payload.name);
            if !training.is_empty() && !training.iter().any(carried) {
                let expected = format!("`payload = \"{}\"` in a `[[log]]` at least", payload.name);
                return Err(Error::setting(&format!("payload.{}", payload.name), &expected, "none"));
            }
        }
        for (k, (log, label)) in training.iter().zip(labels).enumerate() {
            if log.name.is_some() && labels[..k].contains(label) {
                return Err(Error::setting("log.name", "names that occur once", label));
            }
            if log.own.contains(&Own::Friction) && log.own.contains(&Own::FrictionScale) {
                let expected = "`friction` or `friction_scale`: friction joint by joint has any scale";
                return Err(Error::setting("log.own", expected, "both"));
            }
            if let Some(like) = &log.like {
                return Err(Error::setting("log.like", "it in `[[validation]]` only", like));
            }
        }
        for log in validation {
            one_of("validation.like", log.like.as_ref(), labels, "[[log]]")?;
            if let Some(own) = log.own.first() {
                return Err(Error::setting(
                    "validation.own",
                    "`like = \"a log\"` there: what a log has of its own is found from `[[log]]` alone",
                    own.word(),
                ));
            }
        }
        Ok(())
    }
}

/// Names of training logs in parameters and messages: as stated, else the file's name, with `#2` where it comes again.
pub fn labels<'a>(logs: impl Iterator<Item = (&'a LogSettings, &'a str)>) -> Vec<String> {
    let mut labels: Vec<String> = Vec::new();
    for (log, file) in logs {
        let own = log.name.clone().unwrap_or_else(|| stem(file));
        let again = (2..).map(|k| format!("{own}#{k}")).find(|label| !labels.contains(label));
        let taken = labels.contains(&own) && log.name.is_none();
        labels.push(again.filter(|_| taken).unwrap_or(own));
    }
    labels
}

fn one_of(key: &str, name: Option<&String>, known: &[String], section: &str) -> Result<(), Error> {
    let Some(name) = name.filter(|name| !known.contains(name)) else { return Ok(()) };
    let expected = match known {
        [] => format!("a name of a `{section}`, of which there are none"),
        _ => format!("a name of a `{section}`: `{}`", known.join("`, `")),
    };
    Err(Error::setting(key, &expected, name))
}

fn stem(file: &str) -> String {
    let name = Path::new(file).file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    name.split('.').next().unwrap_or_default().to_owned()
}
