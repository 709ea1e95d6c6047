//! Joints with clearance of a robot file.

use std::collections::BTreeMap;

use dynid_model::contact::{
    ContactError, ContactLaw, FractalLankaraniNikravesh, FractalSettings, FractalSurface, Hertz,
    HertzStiffness, JournalBearing, KelvinVoigt, LankaraniNikravesh, Material, PressureFactor,
    SlidingFriction, SurfaceSettings,
};
use dynid_model::{Description, MechanismError};
use serde::{Deserialize, Serialize};
use toml::{Table, Value};

use super::Source;
use super::elastic::ELASTIC;
use super::number::number;
use super::schema::RobotToml;
use crate::robot_error::RobotFileError;

/// Key of a joint with clearance among its elements.
pub(super) const CLEARANCE: &str = "clearance";

/// A joint whose journal has clearance in its bearing:
/// `[element.j1] clearance = { journal_radius = 0.01, gap = 5e-5, width = 0.02 }`.
#[derive(Clone, Debug, PartialEq)]
pub struct ClearanceSpec {
    /// The joint.
    pub joint: String,
    /// Radius of the journal, m.
    pub journal_radius: f64,
    /// Law of the normal force; it holds the radial clearance.
    pub law: ContactLaw,
    /// Sliding friction.
    pub friction: SlidingFriction,
    /// Keys of the table that this is of, the `mass` that the file states of the moving link among them where the law needs it.
    pub stated: BTreeMap<String, ClearanceValue>,
}

/// Value of a key of a joint with clearance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(untagged)]
pub enum ClearanceValue {
    /// A number.
    Number(f64),
    /// One for the journal, one for its bearing.
    Pair([f64; 2]),
    /// A word.
    Text(String),
}

impl ClearanceSpec {
    /// The clearance of a joint that these keys state ([`ClearanceSpec::stated`]). `file`: where they stand, for messages.
    ///
    /// # Errors
    /// Fails as the reading of a robot file does.
    pub fn of(
        file: &str,
        joint: &str,
        stated: &BTreeMap<String, ClearanceValue>,
    ) -> Result<ClearanceSpec, RobotFileError> {
        let value = |value: &ClearanceValue| match value {
            ClearanceValue::Number(x) => Value::Float(*x),
            ClearanceValue::Pair(pair) => Value::Array(pair.iter().map(|x| Value::Float(*x)).collect()),
            ClearanceValue::Text(text) => Value::String(text.clone()),
        };
        let table: Table = stated.iter().map(|(key, of)| (key.clone(), value(of))).collect();
        let source = Source { text: "", file };
        let owner = format!("element.{joint}");
        Keys { source: &source, offset: 0, owner: &owner, table: &table }.spec(joint, (joint, None))
    }

    /// Radial clearance, m.
    pub fn gap(&self) -> f64 {
        self.law.clearance()
    }
}

/// Keys that all laws have.
const COMMON: [&str; 7] = ["journal_radius", "gap", "bearing_radius", "law", "friction", "v_0", "v_m"];

/// Laws, the default first, with the keys of their own.
const LAWS: [(&str, &[&str]); 4] = [
    (
        "rough",
        &[
            "width",
            "roughness_um",
            "mass",
            "area_ratio",
            "restitution",
            "exponent",
            "yield_strength",
            "youngs_modulus",
            "poisson_ratio",
            "hardness_ratio",
            "pressure_factor",
            "profile_constant",
            "impact_speed_floor",
        ],
    ),
    (
        "lankarani_nikravesh",
        &["stiffness", "youngs_modulus", "poisson_ratio", "restitution", "impact_speed_floor"],
    ),
    ("hertz", &["stiffness", "youngs_modulus", "poisson_ratio"]),
    ("kelvin_voigt", &["stiffness", "damping"]),
];

/// Joints with clearance in the order of the robot's.
pub(super) fn build(
    source: &Source<'_>,
    robot: &RobotToml,
    description: &Description,
) -> Result<Vec<ClearanceSpec>, RobotFileError> {
    let mut out = Vec::new();
    for joint in &description.joints {
        let Some(element) = robot.element.get(&joint.name) else { continue };
        let Some(value) = element.get_ref().get(CLEARANCE) else { continue };
        let offset = element.span().start;
        let owner = format!("element.{}", joint.name);
        let none = Table::new();
        let empty = Keys { source, offset, owner: &owner, table: &none };
        if let Err(MechanismError::NoJournal { found, .. }) = description.with_clearance(&[&joint.name]) {
            return Err(empty.fault("", "a joint that turns and is coupled to no other (mimic)", found));
        }
        if element.get_ref().contains_key(ELASTIC) {
            return Err(empty.fault("", "no `elastic` at the same joint", ELASTIC));
        }
        let Some(table) = value.as_table() else {
            let expected = "a table with `journal_radius`, `gap` and the keys of a law";
            return Err(empty.fault("", expected, &value.to_string()));
        };
        let carried = description.links.iter().find(|l| l.name == joint.child);
        let stated = carried.and_then(|l| l.inertia).map(|i| i.mass()).filter(|m| *m > 0.0);
        let keys = Keys { source, offset, owner: &owner, table };
        out.push(keys.spec(&joint.name, (&joint.child, stated))?);
    }
    Ok(out)
}

/// The table of one joint with clearance.
#[derive(Clone, Copy)]
struct Keys<'a> {
    source: &'a Source<'a>,
    offset: usize,
    owner: &'a str,
    table: &'a Table,
}

impl Keys<'_> {
    fn fault(&self, key: &str, expected: &str, found: &str) -> RobotFileError {
        let field = if key.is_empty() { CLEARANCE.to_owned() } else { format!("{CLEARANCE}.{key}") };
        self.source.value(self.offset, self.owner, &field, expected, found)
    }

    fn missing(&self, expected: &str) -> RobotFileError {
        RobotFileError::Missing {
            at: self.source.place(self.offset),
            owner: format!("{}: {CLEARANCE}", self.owner),
            expected: expected.to_owned(),
        }
    }

    /// A fault of a contact by the name that its field has in files.
    fn contact(&self, error: &ContactError) -> RobotFileError {
        let field = match error.field() {
            "clearance" => "gap",
            "coefficient" => "friction",
            "force_index" => "exponent",
            field => field,
        };
        if let ContactError::OutOfRange { expected, found, .. } = error {
            return self.fault(field, expected, &found.to_string());
        }
        let text = error.to_string();
        let said = text.split_once(": expected ").map_or(text.as_str(), |(_, said)| said);
        let (expected, found) = said.split_once(", found ").unwrap_or((said, "another"));
        self.fault(field, expected, found)
    }

    /// `mass` of the moving link by name, if it is stated.
    fn spec(&self, joint: &str, mass: (&str, Option<f64>)) -> Result<ClearanceSpec, RobotFileError> {
        let law = self.law()?;
        let journal_radius =
            self.number("journal_radius")?.ok_or_else(|| self.missing("`journal_radius` in m"))?;
        let told = |e: ContactError| self.contact(&e);
        let friction = SlidingFriction::default();
        let friction = SlidingFriction::new(
            self.number("friction")?.unwrap_or(friction.coefficient),
            self.number("v_0")?.unwrap_or(friction.v_0),
            self.number("v_m")?.unwrap_or(friction.v_m),
        )
        .map_err(told)?;
        let (_, uses) = law;
        let stated = self.stated(mass.1.filter(|_| uses.contains(&"mass")));
        let width = match self.number("width")? {
            Some(width) => width,
            None if uses.contains(&"width") => return Err(self.missing("`width` of the contact in m")),
            // The other laws do not know it.
            None => journal_radius,
        };
        let bearing = match (self.number("gap")?, self.number("bearing_radius")?) {
            (Some(gap), None) => JournalBearing::with_gap(journal_radius, gap, width),
            (None, Some(radius)) => JournalBearing::new(radius, journal_radius, width),
            (None, None) => {
                return Err(self.missing("`gap`, the radial clearance in m, or `bearing_radius` in m"));
            }
            (Some(_), Some(radius)) => {
                return Err(self.fault("bearing_radius", "no value beside `gap`", &radius.to_string()));
            }
        }
        .map_err(told)?;
        let law = match law.0 {
            "rough" => self.rough(bearing, friction.coefficient, mass)?,
            "kelvin_voigt" => {
                let stated = |key: &str, unit: &str| {
                    let missing = || self.missing(&format!("`{key}` in {unit}, which this law needs"));
                    self.number(key)?.ok_or_else(missing)
                };
                let (stiffness, damping) = (stated("stiffness", "N/m")?, stated("damping", "N s/m")?);
                KelvinVoigt::new(stiffness, damping, bearing.clearance()).map_err(told)?.into()
            }
            "hertz" => Hertz::new(self.stiffness(bearing)?).into(),
            _ => {
                let settings = FractalSettings::new(1.0);
                let restitution = self.number("restitution")?.unwrap_or(settings.restitution);
                let floor = self.number("impact_speed_floor")?.unwrap_or(settings.impact_speed_floor);
                LankaraniNikravesh::new(self.stiffness(bearing)?, restitution)
                    .and_then(|law| law.with_impact_speed_floor(floor))
                    .map_err(told)?
                    .into()
            }
        };
        Ok(ClearanceSpec { joint: joint.to_owned(), journal_radius, law, friction, stated })
    }

    /// Keys and values; `mass` where the table leaves it to the link.
    fn stated(&self, mass: Option<f64>) -> BTreeMap<String, ClearanceValue> {
        let of = |value: &Value| match (number(value), value) {
            (Some(x), _) => ClearanceValue::Number(x),
            (None, Value::Array(list)) => {
                let number = |k: usize| list.get(k).and_then(number).unwrap_or(f64::NAN);
                ClearanceValue::Pair([number(0), number(1)])
            }
            (None, value) => ClearanceValue::Text(value.as_str().unwrap_or_default().to_owned()),
        };
        let mut out: BTreeMap<_, _> =
            self.table.iter().map(|(key, value)| (key.clone(), of(value))).collect();
        if let Some(mass) = mass {
            out.entry("mass".to_owned()).or_insert(ClearanceValue::Number(mass));
        }
        out
    }

    /// The law, and that the table has no keys that it does not use.
    fn law(&self) -> Result<(&'static str, &'static [&'static str]), RobotFileError> {
        let names = LAWS.map(|(name, _)| name);
        let law = match self.table.get("law") {
            None => LAWS[0],
            Some(value) => {
                let stated = value.as_str().and_then(|name| LAWS.into_iter().find(|(law, _)| *law == name));
                let expected = format!("one of `{}`", names.join("`, `"));
                let said = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
                stated.ok_or_else(|| self.fault("law", &expected, &said))?
            }
        };
        let (name, own) = law;
        let unused = |key: &&String| !COMMON.contains(&key.as_str()) && !own.contains(&key.as_str());
        let Some(key) = self.table.keys().find(unused) else { return Ok(law) };
        let keys = COMMON.iter().chain(own).copied().collect::<Vec<_>>().join("`, `");
        Err(match LAWS.iter().any(|(_, keys)| keys.contains(&key.as_str())) {
            true => {
                let expected = format!("no value with the law `{name}`, whose keys are `{keys}`");
                self.fault(key, &expected, &self.table[key].to_string())
            }
            false => self.fault("", &format!("a table with the keys `{keys}`"), key),
        })
    }

    fn rough(
        &self,
        bearing: JournalBearing,
        friction: f64,
        (link, mass): (&str, Option<f64>),
    ) -> Result<ContactLaw, RobotFileError> {
        let told = |e: ContactError| self.contact(&e);
        let missing = || self.missing(&format!("`mass` in kg, as the file states none of the link `{link}`"));
        let mass = self.number("mass")?.or(mass).ok_or_else(missing)?;
        let [journal, bushing] = self.materials()?;
        let journal_is_softer = journal.youngs_modulus <= bushing.youngs_modulus;
        let (softer, harder) = if journal_is_softer { (journal, bushing) } else { (bushing, journal) };
        let default = SurfaceSettings::default();
        let or = |key: &str, default: f64| Ok::<_, RobotFileError>(self.number(key)?.unwrap_or(default));
        let surface = FractalSurface::new(SurfaceSettings {
            roughness_um: or("roughness_um", default.roughness_um)?,
            friction,
            softer,
            harder,
            yield_strength: or("yield_strength", default.yield_strength)?,
            hardness_ratio: or("hardness_ratio", default.hardness_ratio)?,
            pressure_factor: self
                .number("pressure_factor")?
                .map_or(default.pressure_factor, PressureFactor::Given),
            profile_constant: or("profile_constant", default.profile_constant)?,
        })
        .map_err(told)?;
        let settings = FractalSettings::new(mass);
        let settings = FractalSettings {
            area_ratio: or("area_ratio", settings.area_ratio)?,
            restitution: or("restitution", settings.restitution)?,
            force_index: or("exponent", settings.force_index)?,
            impact_speed_floor: or("impact_speed_floor", settings.impact_speed_floor)?,
            ..settings
        };
        Ok(FractalLankaraniNikravesh::new(surface, bearing, settings).map_err(told)?.into())
    }

    /// Stiffness of smooth bodies: as stated, else from their materials.
    fn stiffness(&self, bearing: JournalBearing) -> Result<HertzStiffness, RobotFileError> {
        let Some(stiffness) = self.number("stiffness")? else {
            let [journal, bushing] = self.materials()?;
            return HertzStiffness::of_bearing(bearing, journal, bushing).map_err(|e| self.contact(&e));
        };
        if let Some(key) = ["youngs_modulus", "poisson_ratio"].iter().find(|k| self.table.contains_key(**k)) {
            return Err(self.fault(key, "no value beside `stiffness`", &self.table[*key].to_string()));
        }
        HertzStiffness::given(stiffness, bearing.clearance()).map_err(|e| self.contact(&e))
    }

    /// Journal and bearing.
    fn materials(&self) -> Result<[Material; 2], RobotFileError> {
        let steel = Material::STEEL;
        let [e1, e2] = self.pair("youngs_modulus", steel.youngs_modulus)?;
        let [n1, n2] = self.pair("poisson_ratio", steel.poisson_ratio)?;
        let body = |youngs_modulus, poisson_ratio| Material { youngs_modulus, poisson_ratio };
        Ok([body(e1, n1), body(e2, n2)])
    }

    fn number(&self, key: &str) -> Result<Option<f64>, RobotFileError> {
        let of = |v: &Value| number(v).ok_or_else(|| self.fault(key, "a finite number", &v.to_string()));
        self.table.get(key).map(of).transpose()
    }

    /// One number for journal and bearing, or one each.
    fn pair(&self, key: &str, default: f64) -> Result<[f64; 2], RobotFileError> {
        let Some(value) = self.table.get(key) else { return Ok([default; 2]) };
        let both = number(value).map(|x| [x; 2]);
        let each = || {
            let list: Option<Vec<f64>> = value.as_array()?.iter().map(number).collect();
            <[f64; 2]>::try_from(list?).ok()
        };
        let expected = "a finite number, or two as [journal, bearing]";
        both.or_else(each).ok_or_else(|| self.fault(key, expected, &value.to_string()))
    }
}
