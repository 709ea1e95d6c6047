//! The friction model of a robot as a file, `friction.json`: keys are added, never renamed.

mod error;
mod known;

use std::collections::BTreeMap;
use std::path::Path;

use dynid_files::SourceFile;
use dynid_identify::Error;
use dynid_identify::estimate::Provenance;
use dynid_record::Outcome;
pub use error::FrictionError;
pub use known::known_friction;
pub use known::known_laws;
use serde::{Deserialize, Serialize};

pub use dynid_identify::known_friction::{BristleModel, ExponentialModel, ViscousModel};

/// Schema of `friction.json`.
pub const SCHEMA: u32 = 1;

/// Friction of a robot's joints. Units are SI, temperatures °C.
#[derive(Debug, Clone, Serialize, Deserialize, schemars::JsonSchema)]
pub struct FrictionModel {
    /// Schema, 1.
    pub schema: u32,
    /// Name of the robot.
    pub robot: String,
    /// The result in words.
    pub verdict: FrictionVerdict,
    /// Joints with tests, in the robot's order.
    pub joints: Vec<JointFrictionModel>,
    /// Where all this comes from.
    pub provenance: Provenance,
    /// What to know before the model is used.
    pub warnings: Vec<String>,
}

/// The result in words.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct FrictionVerdict {
    /// Whether the file may be used.
    pub status: Outcome,
    /// One sentence.
    pub headline: String,
}

dynid_record::words! {
    /// What the tests of a joint came to.
    FrictionStatus {
        /// A whole law.
        Identified = "identified",
        /// A law of fewer terms: the points carry less than was hoped for.
        Simplified = "simplified",
        /// A law that is not to be used.
        Invalid = "invalid",
        /// No law: the joint was moved in one direction alone.
        OneDirection = "one_direction",
        /// No law.
        NotIdentified = "not_identified",
    }
}

dynid_record::words! {
    /// What became of a pre-sliding log.
    PreslidingStatus {
        /// It tells the bristles.
        Identified = "identified",
        /// It does not.
        NotIdentifiable = "not_identifiable",
    }
}

dynid_record::words! {
    /// The effort between its samples.
    EffortBetween {
        /// Held until the next sample.
        Held = "held",
        /// Straight from one sample to the next.
        Linear = "linear",
    }
}

/// Friction of one joint:
/// `s(v) (F_c + (F_s - F_c) exp(-|v/v_s|^δ)) + viscous + offset`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct JointFrictionModel {
    /// Joint.
    pub joint: String,
    /// What its tests came to.
    pub status: FrictionStatus,
    /// Coulomb friction `F_c`, N m or N; `None` without a law.
    pub coulomb: Option<f64>,
    /// Static friction `F_s`, N m or N; `None`: not estimable, equal to Coulomb friction.
    #[serde(rename = "static")]
    pub static_: Option<f64>,
    /// Stribeck speed `v_s`, rad/s or m/s.
    pub stribeck_speed: Option<f64>,
    /// Exponent `δ`.
    pub stribeck_exponent: Option<f64>,
    /// Viscous part.
    pub viscous: Option<ViscousModel>,
    /// Constant effort of friction signals, N m or N.
    pub offset: Option<f64>,
    /// Bristles of LuGre friction; `None`: not identifiable.
    pub bristle: Option<BristleModel>,
    /// Temperatures for which the law holds, °C; it is to be clamped beyond. `None`: no temperatures were logged.
    pub temperature_range: Option<[f64; 2]>,
    /// Speeds of the points, rad/s or m/s.
    pub speed_range: Option<[f64; 2]>,
    /// Standard deviations of the coefficients above, by name.
    pub std: BTreeMap<String, f64>,
    /// Root mean square of the residuals of the points, N m or N.
    pub residual_rms: Option<f64>,
    /// Largest residual as a share of the largest friction.
    pub largest_error: Option<f64>,
    /// `χ²` and its degrees of freedom.
    pub chi_squared: Option<(f64, usize)>,
    /// Points of friction; of friction signals, none are listed.
    pub points: Vec<PointRecord>,
    /// Number of samples of friction signals.
    pub samples: usize,
    /// Coefficients by temperature, coldest first.
    pub levels: Vec<LevelRecord>,
    /// Lines through the coefficients of the common fit, by name.
    pub lines: BTreeMap<String, LineRecord>,
    /// Laws that were tried.
    pub laws: Vec<LawRecord>,
    /// Passes that went into no point.
    pub unpaired: Vec<UnpairedRecord>,
    /// Pre-sliding logs.
    pub presliding: Vec<PreslidingRecord>,
    /// What the tests could not tell, in words.
    pub notes: Vec<String>,
}

/// Friction at one speed and temperature.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct PointRecord {
    /// Speed, rad/s or m/s.
    pub speed: f64,
    /// Temperature, °C.
    pub temperature: Option<f64>,
    /// Half the difference of both directions, N m or N.
    pub friction: f64,
    /// Standard error of the friction.
    pub std: f64,
    /// Half the sum of both directions: gravity and offset, N m or N.
    pub half_sum: f64,
    /// Passes used.
    pub passes: usize,
    /// Residual of the law.
    pub residual: Option<f64>,
}

/// Coefficients of one temperature.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct LevelRecord {
    /// Mean temperature, °C.
    pub temperature: f64,
    /// Points.
    pub points: usize,
    /// Of the common fit, in which all temperatures share Coulomb, static friction and Stribeck speed.
    pub sigma2: Option<f64>,
    /// Rate of the common fit; absent where `sigma2` is.
    pub sigma3: Option<f64>,
    /// Exponent of the common fit; absent where `sigma2` is.
    pub sigma4: Option<f64>,
    /// Standard deviations of these coefficients.
    pub std: BTreeMap<String, f64>,
    /// Coefficients of this temperature's points alone, by name.
    pub alone: BTreeMap<String, f64>,
    /// Residual of these, N m or N.
    pub alone_rms: Option<f64>,
}

/// A line through the coefficients of the levels.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct LineRecord {
    /// Value at `T_ref`.
    pub intercept: f64,
    /// Per K.
    pub slope: f64,
    /// Half width of the interval of the intercept.
    pub intercept_half_width: f64,
    /// Half width of the interval of the slope.
    pub slope_half_width: f64,
    /// Confidence of both.
    pub confidence: f64,
    /// `χ²` of the levels about the line and its degrees of freedom.
    pub chi_squared: (f64, usize),
}

/// A law that was tried.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct LawRecord {
    /// In words.
    pub law: String,
    /// Residual, N m or N.
    pub rms: Option<f64>,
    /// Corrected Akaike criterion.
    pub aicc: Option<f64>,
    /// Why it is no candidate.
    pub refused: Option<String>,
    /// Whether it was taken.
    pub chosen: bool,
}

/// A pass that went into no point.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct UnpairedRecord {
    /// Log.
    pub log: String,
    /// Signed speed, rad/s or m/s.
    pub speed: f64,
    /// Mean temperature, °C.
    pub temperature: Option<f64>,
    /// Mean effort, N m or N: friction, gravity and offset together.
    pub effort: f64,
    /// Standard deviation of the effort, N m or N.
    pub spread: f64,
    /// Samples.
    pub samples: usize,
    /// Why.
    pub reason: String,
}

/// What became of a pre-sliding log.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct PreslidingRecord {
    /// Log.
    pub log: String,
    /// Whether it tells the bristles.
    pub status: PreslidingStatus,
    /// Why, in words.
    pub reason: String,
    /// Values found, where identified, with standard deviations.
    pub sigma0: Option<[f64; 2]>,
    /// Damping of the bristles and its standard deviation, where identified.
    pub sigma1: Option<[f64; 2]>,
    /// Peak to peak of the motion, rad or m.
    pub motion: f64,
    /// Resolution of the positions, rad or m.
    pub resolution: f64,
    /// Residual of the positions, rad or m.
    pub residual_rms: Option<f64>,
    /// The effort between its samples.
    pub effort_hold: Option<EffortBetween>,
    /// Simulations run.
    pub simulations: u64,
}

impl FrictionModel {
    /// Reads a friction file.
    ///
    /// # Errors
    /// [`Error::Read`], [`FrictionError`] with [`FrictionError::File`] for other files and schemas.
    pub fn load(path: &Path) -> Result<Self, Error> {
        Ok(Self::load_source(path)?.0)
    }

    /// Reads a friction file, and returns what was read beside it.
    pub fn load_source(path: &Path) -> Result<(Self, SourceFile), Error> {
        let text =
            dynid_files::input::read(path).map_err(|source| Error::Read { file: path.to_owned(), source })?;
        let source =
            SourceFile { path: path.display().to_string(), sha256: dynid_files::digest::sha256(&text) };
        let fault = |message: String| FrictionError::File { file: path.display().to_string(), message };
        let model: FrictionModel = serde_json::from_slice(&text).map_err(|e| fault(e.to_string()))?;
        if model.schema != SCHEMA {
            return Err(fault(format!("expected schema {SCHEMA}, found {}", model.schema)).into());
        }
        Ok((model, source))
    }

    /// The file's text.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }

    /// Friction of a joint, if it has a law that may be used.
    pub fn joint(&self, name: &str) -> Option<&JointFrictionModel> {
        self.joints
            .iter()
            .find(|j| j.joint == name && j.coulomb.is_some() && j.status != FrictionStatus::Invalid)
    }
}
