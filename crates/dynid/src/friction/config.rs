//! The configuration of friction experiments, a TOML file.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use dynid_friction::steady_friction::{LawForm, SteadySettings, ViscousForm};
use dynid_logs::MappingSpec;
use dynid_motion::constant_speed::{PairSettings, SegmentSettings};
use serde::{Deserialize, Serialize};

use crate::Error;
use crate::config::{LogConfig, toml_file};
use crate::settings::lists::exactly;

/// Friction experiments and how they are to be understood. Every key but `robot` and `log` has a default.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct FrictionConfig {
    /// Robot file (URDF, MJCF, SDF or TOML), relative to the configuration.
    pub robot: PathBuf,
    /// Output folder, relative to the configuration. Without it the program writes to `dynid-friction` in the current
    /// folder.
    pub out: Option<PathBuf>,
    /// Columns of all logs; a log may bring its own.
    #[serde(skip_serializing)]
    pub columns: MappingSpec,
    /// `T_ref` of the thermal lines, °C. Default 25.
    pub reference_temperature: f64,
    /// Temperatures for which the model is to hold, °C; it is clamped beyond. Default: those of the experiments.
    #[serde(deserialize_with = "exactly")]
    pub temperature_range: Option<[f64; 2]>,
    /// Lines of the viscous coefficients over temperature.
    pub thermal_lines: ThermalLines,
    /// The friction law.
    pub law: LawName,
    /// Confidence of intervals. Default 0.95.
    pub confidence: f64,
    /// What counts as constant speed.
    pub constant_speed: ConstantSpeedConfig,
    /// Which passes belong together.
    pub pairs: PairsConfig,
    /// Logs of constant-speed tests, or of friction signals.
    pub log: Vec<FrictionLog>,
    /// Logs of pre-sliding motion.
    pub presliding: Vec<PreslidingLog>,
    /// Bristles of joints where no log tells: kept and marked as prior.
    pub prior: BTreeMap<String, BristlePrior>,
}

impl Default for FrictionConfig {
    fn default() -> Self {
        FrictionConfig {
            robot: PathBuf::new(),
            out: None,
            columns: MappingSpec::default(),
            reference_temperature: 25.0,
            temperature_range: None,
            thermal_lines: ThermalLines::Auto,
            law: LawName::Auto,
            confidence: 0.95,
            constant_speed: ConstantSpeedConfig::default(),
            pairs: PairsConfig::default(),
            log: Vec::new(),
            presliding: Vec::new(),
            prior: BTreeMap::new(),
        }
    }
}

/// Whether viscous coefficients are lines over temperature.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ThermalLines {
    /// Where temperatures are logged and span enough.
    #[default]
    Auto,
    /// Logs without temperatures are refused.
    Required,
    /// Never.
    None,
}

/// Friction laws by name.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum LawName {
    /// The one that the points can carry.
    #[default]
    Auto,
    /// Coulomb and linear viscous friction.
    CoulombViscous,
    /// Coulomb and exponential viscous friction.
    CoulombExponential,
    /// Stribeck and linear viscous friction.
    StribeckViscous,
    /// Stribeck and exponential viscous friction.
    StribeckExponential,
}

impl LawName {
    fn form(self) -> Option<LawForm> {
        let (stribeck, viscous) = match self {
            LawName::Auto => return None,
            LawName::CoulombViscous => (false, ViscousForm::Linear),
            LawName::CoulombExponential => (false, ViscousForm::Exponential),
            LawName::StribeckViscous => (true, ViscousForm::Linear),
            LawName::StribeckExponential => (true, ViscousForm::Exponential),
        };
        Some(LawForm { stribeck, viscous, thermal: true, offset: false })
    }
}

/// What counts as constant speed; see [`SegmentSettings`].
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct ConstantSpeedConfig {
    /// Least duration after trimming, s. Default 0.3.
    pub least_duration_s: f64,
    /// Largest departure from the mean speed, as a share of it. Default 0.03.
    pub speed_tolerance: f64,
    /// Largest departure from the mean speed in standard deviations of the speed's noise, besides. Default 4.
    pub noise_tolerance: f64,
    /// Cut from both ends, s. Default 0.1.
    pub trim_s: f64,
    /// Window over which the speed is averaged, s. Default 0.05.
    pub window_s: f64,
    /// Speeds below this are rest, rad/s or m/s. Default: five standard deviations of the speed's noise.
    pub least_speed: Option<f64>,
    /// Use the logged velocity, not the slope of the positions. Default false.
    pub use_velocity: bool,
    /// Largest motion of the other joints meanwhile, rad or m. Default 0.002.
    pub rest_tolerance: f64,
}

impl Default for ConstantSpeedConfig {
    fn default() -> Self {
        let s = SegmentSettings::default();
        ConstantSpeedConfig {
            least_duration_s: s.least_duration_s,
            speed_tolerance: s.speed_tolerance,
            noise_tolerance: s.noise_tolerance,
            trim_s: s.trim_s,
            window_s: s.window_s,
            least_speed: s.least_speed,
            use_velocity: s.use_velocity,
            rest_tolerance: 2e-3,
        }
    }
}

/// Which passes belong together; see [`PairSettings`].
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct PairsConfig {
    /// Speeds of one level differ from their mean by at most this share. Default 0.05.
    pub speed_tolerance: f64,
    /// Temperatures of one point differ from their mean by at most this, K. Default 1.5.
    pub temperature_tolerance: f64,
    /// Bins of the common range of positions. Default 24.
    pub bins: usize,
    /// Temperatures of one level of the fits differ from their mean by at most this, K. Default 2.5.
    pub level_tolerance: f64,
}

impl Default for PairsConfig {
    fn default() -> Self {
        let p = PairSettings::default();
        PairsConfig {
            speed_tolerance: p.speed_tolerance,
            temperature_tolerance: p.temperature_tolerance,
            bins: p.bins,
            level_tolerance: SteadySettings::default().level_tolerance,
        }
    }
}

/// What the effort column of a log is.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum LoggedSignal {
    /// The effort of the drive: constant speeds are looked for and both directions paired.
    #[default]
    Effort,
    /// Friction itself (effort less a model of everything else): every sample is a point, with a constant offset.
    Friction,
}

/// One log of a test.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct FrictionLog {
    /// CSV or CSV.gz, relative to the configuration.
    pub path: PathBuf,
    /// The joint that moves. Default: every joint that moves while the others rest.
    pub joint: Option<String>,
    /// What the effort column is. Default `effort`.
    pub signal: LoggedSignal,
    /// First and last data row, from 1, both included. Default: all.
    #[serde(deserialize_with = "crate::settings::lists::pair")]
    pub rows: Option<(usize, usize)>,
    /// First and last part of the record, as shares of its rows. Default: all.
    #[serde(deserialize_with = "crate::settings::lists::pair")]
    pub part: Option<(f64, f64)>,
    /// Columns of this log in place of the run's.
    #[serde(skip_serializing)]
    pub columns: Option<MappingSpec>,
}

impl FrictionLog {
    pub(super) fn plain(&self) -> LogConfig {
        LogConfig {
            path: self.path.clone(),
            rows: self.rows,
            part: self.part,
            columns: self.columns.clone(),
            ..LogConfig::default()
        }
    }
}

/// The effort between its samples in pre-sliding logs.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum HoldName {
    /// Whichever fits better.
    #[default]
    Auto,
    /// Held until the next sample.
    Held,
    /// Straight from one sample to the next.
    Linear,
}

/// A log of one joint moved within its friction, from rest.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct PreslidingLog {
    /// CSV or CSV.gz, relative to the configuration.
    pub path: PathBuf,
    /// The joint.
    pub joint: String,
    /// Inertia at the joint in this pose, all that moves with it, kg m² or kg.
    pub inertia: f64,
    /// Constant effort in this pose (gravity, offset), N m or N. Default 0.
    pub offset: f64,
    /// The effort between its samples. Default `auto`.
    pub effort_hold: HoldName,
    /// First and last data row, from 1, both included. Default: all.
    #[serde(deserialize_with = "crate::settings::lists::pair")]
    pub rows: Option<(usize, usize)>,
    /// Columns of this log in place of the run's.
    #[serde(skip_serializing)]
    pub columns: Option<MappingSpec>,
}

impl PreslidingLog {
    pub(super) fn plain(&self) -> LogConfig {
        LogConfig {
            path: self.path.clone(),
            rows: self.rows,
            columns: self.columns.clone(),
            ..LogConfig::default()
        }
    }
}

/// Bristles as known before.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct BristlePrior {
    /// Stiffness, N m/rad or N/m.
    pub sigma0: f64,
    /// Damping, N m s/rad or N s/m.
    pub sigma1: f64,
}

impl FrictionConfig {
    /// Reads a configuration; paths in it become relative to its folder.
    ///
    /// # Errors
    /// [`Error::Read`], [`Error::LogFile`] for patterns, folders and lists without a log, and as [`FrictionConfig::parse`].
    pub fn read(path: &Path) -> Result<Self, Error> {
        let (mut config, folder) = toml_file::read(path, Self::parse)?;
        config.robot = folder.join(&config.robot);
        config.out = config.out.map(|o| folder.join(o));
        let mut logs = Vec::new();
        for log in &config.log {
            for path in dynid_logs::log::files(&folder.join(&log.path))? {
                logs.push(FrictionLog { path, ..log.clone() });
            }
        }
        config.log = logs;
        config.presliding.iter_mut().for_each(|log| log.path = folder.join(&log.path));
        Ok(config)
    }

    /// Parses a configuration.
    ///
    /// # Errors
    /// [`Error::Config`] with the line; [`Error::InFile`] with what [`FrictionConfig::check`] finds.
    pub fn parse(text: &str, file: &str) -> Result<Self, Error> {
        let config: FrictionConfig = toml_file::parse(text, file)?;
        let missing = |what: &str| toml_file::missing(file, what);
        if config.robot.as_os_str().is_empty() {
            return Err(missing("`robot = \"file\"`"));
        }
        if config.log.is_empty() {
            return Err(missing("at least one `[[log]]` with a `path`"));
        }
        let paths = config.log.iter().map(|l| &l.path).chain(config.presliding.iter().map(|l| &l.path));
        if paths.into_iter().any(|p| p.as_os_str().is_empty()) {
            return Err(missing("a `path` in every `[[log]]` and `[[presliding]]`"));
        }
        toml_file::in_file(file, config.check())?;
        Ok(config)
    }

    /// Checks that every number makes sense.
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub fn check(&self) -> Result<(), Error> {
        let (c, p) = (&self.constant_speed, &self.pairs);
        let positive = [
            ("least_duration_s", c.least_duration_s),
            ("constant_speed.speed_tolerance", c.speed_tolerance),
            ("window_s", c.window_s),
            ("rest_tolerance", c.rest_tolerance),
            ("pairs.speed_tolerance", p.speed_tolerance),
            ("temperature_tolerance", p.temperature_tolerance),
            ("level_tolerance", p.level_tolerance),
            ("least_speed", c.least_speed.unwrap_or(1.0)),
        ];
        let logs = self.presliding.iter().map(|log| ("inertia", log.inertia));
        let priors = self.prior.values().flat_map(|b| [("sigma0", b.sigma0), ("sigma1", b.sigma1)]);
        for (name, x) in positive.into_iter().chain(logs).chain(priors) {
            if !(x.is_finite() && x > 0.0) {
                return Err(Error::setting(name, "a positive number", x));
            }
        }
        for (name, x) in [("noise_tolerance", c.noise_tolerance), ("trim_s", c.trim_s)] {
            if !(x.is_finite() && x >= 0.0) {
                return Err(Error::setting(name, "a number that is not negative", x));
            }
        }
        if p.bins < 4 {
            return Err(Error::setting("bins", "at least 4", p.bins));
        }
        if !(self.confidence > 0.0 && self.confidence < 1.0) {
            return Err(Error::setting("confidence", "a number between 0 and 1", self.confidence));
        }
        let plausible = dynid_motion::temperature::PLAUSIBLE;
        if !plausible.contains(&self.reference_temperature) {
            let expected = "a temperature in degC, -40 to 120";
            return Err(Error::setting("reference_temperature", expected, self.reference_temperature));
        }
        if let Some([a, b]) = self.temperature_range
            && !(plausible.contains(&a) && plausible.contains(&b) && a < b)
        {
            let expected = "two increasing temperatures in degC, -40 to 120";
            return Err(Error::setting("temperature_range", expected, format!("[{a}, {b}]")));
        }
        match self.presliding.iter().find(|log| !log.offset.is_finite()) {
            Some(log) => Err(Error::setting("offset", "a finite number", log.offset)),
            None => Ok(()),
        }
    }

    pub(super) fn segments(&self) -> SegmentSettings {
        let c = &self.constant_speed;
        SegmentSettings {
            least_duration_s: c.least_duration_s,
            speed_tolerance: c.speed_tolerance,
            noise_tolerance: c.noise_tolerance,
            trim_s: c.trim_s,
            window_s: c.window_s,
            least_speed: c.least_speed,
            use_velocity: c.use_velocity,
        }
    }

    pub(super) fn pairing(&self) -> PairSettings {
        PairSettings {
            speed_tolerance: self.pairs.speed_tolerance,
            temperature_tolerance: self.pairs.temperature_tolerance,
            bins: self.pairs.bins,
            ..PairSettings::default()
        }
    }

    pub(super) fn steady(&self, series: bool) -> SteadySettings {
        SteadySettings {
            reference_temperature: self.reference_temperature,
            level_tolerance: self.pairs.level_tolerance,
            form: self.law.form(),
            thermal: self.thermal_lines != ThermalLines::None && !series,
            confidence: self.confidence,
            series,
            offset: series,
            ..SteadySettings::default()
        }
    }
}
