//! The configuration of a run, a TOML file.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use dynid_estimate::conditioning::{ConditioningSettings, TextbookRoute};
use dynid_io::{CouplingForm, MappingSpec};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};

use crate::Error;

/// Limits beyond this are a slip or were meant to be infinite, whatever the unit.
const LARGEST_LIMIT: f64 = 1e9;

/// What is to be identified from which logs, and how. Every key but `robot` and `log` has a default.
#[derive(Debug, Clone, Default, Deserialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct Config {
    /// Robot file (URDF or TOML), relative to the configuration.
    pub robot: PathBuf,
    /// Output folder, relative to the configuration. Without it the program writes to `dynid-out` in the current folder.
    pub out: Option<PathBuf>,
    /// Seed of everything random (states of the structural analysis). Default 1.
    pub seed: Option<u64>,
    /// Gravity in base axes, m/s². Default: the robot file's, else 0 0 -9.81.
    #[serde(deserialize_with = "exactly")]
    pub gravity: Option<[f64; 3]>,
    /// Couple mimic joints to their leaders. Default false.
    pub couple_mimics: Option<bool>,
    /// Joints held at a position, rad or m; their links are merged.
    pub locked: BTreeMap<String, f64>,
    /// Elements per joint.
    pub elements: ElementsConfig,
    /// Couplings of joints, besides those of the robot file.
    pub coupling: Vec<CouplingConfig>,
    /// Columns of all logs; a log may bring its own.
    pub columns: MappingSpec,
    /// Logs hold motor positions and motor efforts behind a transmission matrix.
    pub motor_side: Option<MotorSide>,
    /// Conditioning.
    pub conditioning: ConditioningConfig,
    /// Estimator.
    pub estimator: EstimatorConfig,
    /// Bounds on masses, centres of mass and parameters.
    pub bound: Vec<BoundConfig>,
    /// Columns to keep as base parameters where there is a choice, by name (`link2.Izz`) or symbol (`Izz2`).
    pub preferred: Vec<String>,
    /// Logs to identify from.
    pub log: Vec<LogConfig>,
    /// Logs to validate on.
    pub validation: Vec<LogConfig>,
}

/// Elements at joints.
#[derive(Debug, Clone, Default, Deserialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct ElementsConfig {
    /// For every joint about which nothing else is said.
    pub default: Option<Vec<String>>,
    /// For single joints.
    pub joint: BTreeMap<String, Vec<String>>,
}

/// Motor-side inertia and friction of joints that share motors; see the robot file's `[[coupling]]`.
#[derive(Debug, Clone, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct CouplingConfig {
    /// Motors, one per row.
    pub motors: Vec<String>,
    /// Joints, one per column.
    pub joints: Vec<String>,
    /// Transmission matrix, motor speeds from joint speeds.
    pub matrix: Vec<Vec<f64>>,
    /// `strict` (one inertia and friction per motor) or `columns` (three coupling terms beside the joints' own).
    #[serde(default)]
    pub form: CouplingForm,
}

/// Transmission between the motors that a log records and the joints: `q_motor = matrix · (q - offset)`,
/// `effort_joint = matrixᵀ · effort_motor`.
#[derive(Debug, Clone, Default, Deserialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct MotorSide {
    /// Transmission matrix, one row per motor, one column per joint.
    pub matrix: Vec<Vec<f64>>,
    /// Joint position at motor position zero, rad or m. Default: zeros.
    pub offset: Vec<f64>,
}

/// One log file.
#[derive(Debug, Clone, Default, Deserialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct LogConfig {
    /// CSV or CSV.gz, relative to the configuration.
    pub path: PathBuf,
    /// First and last data row, from 1, both included. Default: all.
    #[serde(deserialize_with = "pair")]
    pub rows: Option<(usize, usize)>,
    /// First and last part of the record to use, as shares of its rows, e.g. `[0.0, 0.7]`. Default: all.
    #[serde(deserialize_with = "pair")]
    pub part: Option<(f64, f64)>,
    /// Columns of this log in place of the run's.
    pub columns: Option<MappingSpec>,
}

/// Which way from samples to rows.
#[derive(Debug, Clone, Copy, Default, Deserialize, Serialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub enum Route {
    /// States at a high cut-off, then one compact kernel over columns and effort; everything found from the data.
    #[default]
    Compact,
    /// Zero-phase Butterworth, central differences, decimation.
    Textbook,
}

/// Settings of the conditioning; those left out are found from the data.
#[derive(Debug, Clone, Default, Deserialize, Serialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct ConditioningConfig {
    /// Route. Default `compact`.
    pub route: Route,
    /// Cut-off of the widest kernel, Hz; on the textbook route the cut-off of the filter (default 10).
    pub kernel_hz: Option<f64>,
    /// Cut-off of the state filter, Hz.
    pub state_hz: Option<f64>,
    /// Delay of the motion behind the logged effort, samples.
    pub delay_samples: Option<f64>,
    /// Reversal mask as a share of rms speed; negative: none.
    pub reversal_mask: Option<f64>,
    /// Remove spikes. Default true.
    pub remove_spikes: Option<bool>,
    /// Length of the time blocks behind standard deviations, s. Default 1.
    pub block_s: Option<f64>,
    /// Textbook route: keep every n-th row.
    pub decimation: Option<usize>,
    /// Textbook route: filter columns and effort before rows are dropped (MATLAB's `decimate`). Default false.
    pub parallel_filter: Option<bool>,
    /// Textbook route: filter the effort like the positions. Default true.
    pub filter_effort: Option<bool>,
    /// Textbook route: cut from both ends, s. Default 0.2.
    pub trim_s: Option<f64>,
}

/// Linear estimator.
#[derive(Debug, Clone, Copy, Default, Deserialize, Serialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// Ordinary least squares: all rows alike.
    Ols,
    /// Weighted by residual variances that are estimated along the way, shared as [`EstimatorConfig::variances`] says.
    #[default]
    Wls,
    /// Huber's loss: for some per cent of gross errors.
    Huber,
    /// Tukey's biweight: gross errors lose all influence.
    Tukey,
    /// Weighted, with the robot file as a Gaussian prior.
    Ridge,
    /// Total least squares: columns with errors of their own, see [`EstimatorConfig::column_noise`].
    Tls,
}

/// Which rows share a residual variance.
#[derive(Debug, Clone, Copy, Default, Deserialize, Serialize, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
pub enum Variances {
    /// One per joint, log and kernel scale.
    #[default]
    Group,
    /// One per joint and log.
    JointAndLog,
    /// One per joint.
    Joint,
}

/// Which bodies the standard parameters may describe.
#[derive(Debug, Clone, Copy, Default, Deserialize, Serialize, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
pub enum Consistency {
    /// Some mass distribution has them (4 x 4 pseudo-inertia).
    #[default]
    PseudoInertia,
    /// Positive mass and inertia about the centre of mass, triangle inequality or not (6 x 6 spatial inertia).
    SpatialInertia,
    /// Any numbers: base values as identified, split as near as possible to the robot file.
    None,
}

/// How distance from the robot file is measured in directions that the data do not see.
#[derive(Debug, Clone, Copy, Default, Deserialize, Serialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub enum PriorDistance {
    /// Squared distance in units of the prior standard deviations (half the mass, and the moments that go with it).
    #[default]
    Quadratic,
    /// Entropic (Bregman log-det) divergence, the same in every frame and unit.
    Entropic,
}

/// Settings of the estimator.
#[derive(Debug, Clone, Default, Deserialize, Serialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct EstimatorConfig {
    /// Method. Default `wls`.
    pub method: Method,
    /// Which rows share a residual variance. Default `group`.
    pub variances: Variances,
    /// Weight of the robot file in `ridge`; 1 means a Gaussian prior. Default 1.
    pub ridge_weight: Option<f64>,
    /// For `tls`: standard deviation of the errors of base columns, by name of the kept parameter, in the column's unit.
    /// Columns not named are exact.
    pub column_noise: BTreeMap<String, f64>,
    /// For `tls`: standard deviation of the effort, in the effort's unit.
    pub effort_noise: Option<f64>,
    /// Which bodies the standard parameters may describe. Default `pseudo-inertia`.
    pub consistency: Consistency,
    /// Distance from the robot file. Default `quadratic`.
    pub prior: PriorDistance,
    /// Weight of that distance, residual variances per squared deviation or per nat. Default: as large as held-out folds
    /// allow, at most that of a Gaussian prior.
    pub prior_weight: Option<f64>,
}

/// Bounds that the consistent estimate must meet: on the total mass and on the centre of mass of one or more links, or
/// on any parameter. `[lower, upper]`; `-inf` and `inf` leave a side open; finite limits are at most 1e9 in size.
#[derive(Debug, Clone, Default, Deserialize, Serialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct BoundConfig {
    /// Moving links; a link stands for everything welded to it.
    pub links: Vec<String>,
    /// Sum of their masses, kg.
    #[serde(deserialize_with = "pair")]
    pub mass: Option<(f64, f64)>,
    /// Centre of mass of a single link along x of its frame, m.
    #[serde(deserialize_with = "pair")]
    pub com_x: Option<(f64, f64)>,
    /// The same along y, m.
    #[serde(deserialize_with = "pair")]
    pub com_y: Option<(f64, f64)>,
    /// The same along z, m.
    #[serde(deserialize_with = "pair")]
    pub com_z: Option<(f64, f64)>,
    /// A parameter, by name such as `joint1.fc`.
    pub parameter: Option<String>,
    /// Its range, in its unit.
    #[serde(deserialize_with = "pair")]
    pub range: Option<(f64, f64)>,
}

impl Config {
    /// Reads a configuration; paths in it become relative to its folder.
    ///
    /// # Errors
    /// [`Error::Read`], and as [`Config::parse`].
    pub fn read(path: &Path) -> Result<Self, Error> {
        let text =
            std::fs::read_to_string(path).map_err(|source| Error::Read { file: path.to_owned(), source })?;
        let mut config = Self::parse(&text, &path.display().to_string())?;
        let folder = path.parent().unwrap_or(Path::new(""));
        config.robot = folder.join(&config.robot);
        config.out = config.out.map(|o| folder.join(o));
        for log in config.log.iter_mut().chain(&mut config.validation) {
            log.path = folder.join(&log.path);
        }
        Ok(config)
    }

    /// Parses a configuration.
    ///
    /// # Errors
    /// [`Error::Config`] with the line; [`Error::InFile`] with what [`Config::check`] finds.
    pub fn parse(text: &str, file: &str) -> Result<Self, Error> {
        let config: Config = toml::from_str(text).map_err(|e| Error::Config {
            file: file.to_owned(),
            line: e.span().map(|s| 1 + text[..s.start.min(text.len())].matches('\n').count()),
            message: e.message().lines().next().unwrap_or_default().to_owned(),
        })?;
        let missing = |what: &str| Error::Config {
            file: file.to_owned(),
            line: None,
            message: format!("expected {what}"),
        };
        if config.robot.as_os_str().is_empty() {
            return Err(missing("`robot = \"file\"`"));
        }
        if config.log.is_empty() {
            return Err(missing("at least one `[[log]]` with a `path`"));
        }
        for log in config.log.iter().chain(&config.validation) {
            if log.path.as_os_str().is_empty() {
                return Err(missing("a `path` in every `[[log]]` and `[[validation]]`"));
            }
        }
        config.check().map_err(|e| Error::InFile { file: file.to_owned(), source: Box::new(e) })?;
        Ok(config)
    }

    /// Checks that every number makes sense.
    ///
    /// # Errors
    /// [`Error::Setting`], [`Error::Coupling`].
    pub fn check(&self) -> Result<(), Error> {
        let c = &self.conditioning;
        for (name, value) in [("kernel_hz", c.kernel_hz), ("state_hz", c.state_hz), ("block_s", c.block_s)] {
            if let Some(x) = value
                && !(x.is_finite() && x > 0.0)
            {
                return Err(setting(name, "a positive number", x));
            }
        }
        for (name, value) in [("delay_samples", c.delay_samples), ("reversal_mask", c.reversal_mask)] {
            if let Some(x) = value
                && !(x.is_finite() && x.abs() <= 1e4)
            {
                return Err(setting(name, "a number of moderate size", x));
            }
        }
        if let Some(x) = c.trim_s
            && !(x.is_finite() && x >= 0.0)
        {
            return Err(setting("trim_s", "a number that is not negative", x));
        }
        if c.decimation == Some(0) {
            return Err(setting("decimation", "at least 1", 0));
        }
        if let Some(g) = self.gravity
            && !g.iter().all(|x| x.is_finite())
        {
            return Err(setting("gravity", "three finite numbers", format!("{g:?}")));
        }
        for coupling in &self.coupling {
            if !coupling.matrix.iter().flatten().all(|x| x.is_finite()) {
                return Err(Error::Coupling {
                    joints: coupling.joints.join(", "),
                    fault: format!("expected finite numbers in the matrix, found {:?}", coupling.matrix),
                });
            }
        }
        self.check_estimator()?;
        for (joint, position) in &self.locked {
            if !position.is_finite() {
                return Err(setting(&format!("locked.{joint}"), "a finite number", position));
            }
        }
        for log in self.log.iter().chain(&self.validation) {
            if let Some((a, b)) = log.part
                && !(0.0..1.0).contains(&a) | !(b > a && b <= 1.0)
            {
                return Err(setting("part", "two increasing shares between 0 and 1", format!("[{a}, {b}]")));
            }
        }
        Ok(())
    }

    fn check_estimator(&self) -> Result<(), Error> {
        let e = &self.estimator;
        let weights = [
            ("ridge_weight", e.ridge_weight),
            ("prior_weight", e.prior_weight),
            ("effort_noise", e.effort_noise),
        ];
        for (name, value) in weights {
            if let Some(x) = value
                && !(x.is_finite() && x > 0.0)
            {
                return Err(setting(name, "a positive number", x));
            }
        }
        for (name, x) in &e.column_noise {
            if !(x.is_finite() && *x >= 0.0) {
                return Err(setting(&format!("column_noise.{name}"), "a number that is not negative", x));
            }
        }
        if e.method == Method::Tls && e.effort_noise.is_none() {
            return Err(setting(
                "effort_noise",
                "the standard deviation of the effort, which `tls` needs",
                "nothing",
            ));
        }
        if e.prior == PriorDistance::Entropic && e.consistency == Consistency::SpatialInertia {
            return Err(setting("prior", "`quadratic` with the 6 x 6 form", "`entropic`"));
        }
        if e.consistency == Consistency::None && !self.bound.is_empty() {
            return Err(setting(
                "consistency",
                "`pseudo-inertia` or `spatial-inertia`, as there are bounds",
                "`none`",
            ));
        }
        self.bound.iter().try_for_each(BoundConfig::check)
    }

    /// Checks the given cut-offs against the sample rate of a log.
    ///
    /// # Errors
    /// [`Error::Cutoff`].
    pub fn check_cutoffs(&self, file: &str, rate_hz: f64) -> Result<(), Error> {
        let c = &self.conditioning;
        for (name, value) in [("kernel_hz", c.kernel_hz), ("state_hz", c.state_hz)] {
            if let Some(found) = value
                && found >= 0.5 * rate_hz
            {
                return Err(Error::Cutoff { file: file.to_owned(), name: name.to_owned(), rate_hz, found });
            }
        }
        Ok(())
    }

    /// Settings of the compact route.
    pub fn conditioning_settings(&self) -> ConditioningSettings {
        let c = &self.conditioning;
        let defaults = ConditioningSettings::default();
        ConditioningSettings {
            kernel_hz: c.kernel_hz,
            state_hz: c.state_hz,
            delay_samples: c.delay_samples,
            reversal_mask: c.reversal_mask,
            remove_spikes: c.remove_spikes.unwrap_or(defaults.remove_spikes),
            block_s: c.block_s.unwrap_or(defaults.block_s),
            ..defaults
        }
    }

    /// Settings of the textbook route.
    pub fn textbook_route(&self) -> TextbookRoute {
        let c = &self.conditioning;
        let defaults = TextbookRoute::default();
        TextbookRoute {
            cutoff_hz: c.kernel_hz.unwrap_or(defaults.cutoff_hz),
            decimation: c.decimation,
            parallel_filter: c.parallel_filter.unwrap_or(defaults.parallel_filter),
            filter_effort: c.filter_effort.unwrap_or(defaults.filter_effort),
            trim_s: c.trim_s.unwrap_or(defaults.trim_s),
            ..defaults
        }
    }
}

impl BoundConfig {
    /// Every range of the entry with its key.
    pub fn ranges(&self) -> impl Iterator<Item = (&'static str, (f64, f64))> {
        let all = [
            ("mass", self.mass),
            ("com_x", self.com_x),
            ("com_y", self.com_y),
            ("com_z", self.com_z),
            ("range", self.range),
        ];
        all.into_iter().filter_map(|(key, range)| Some((key, range?)))
    }

    fn check(&self) -> Result<(), Error> {
        let complete = match (&self.parameter, self.links.len()) {
            (Some(_), 0) => self.ranges().all(|(key, _)| key == "range") && self.range.is_some(),
            (None, 1) => self.range.is_none() && self.ranges().next().is_some(),
            (None, 2..) => self.ranges().all(|(key, _)| key == "mass") && self.mass.is_some(),
            _ => false,
        };
        if !complete {
            let expected = "`links` with `mass` (or, for one link, `com_x`, `com_y`, `com_z`), or `parameter` with `range`";
            return Err(setting("bound", expected, self.keys()));
        }
        let twice = self.links.iter().enumerate().find(|(k, link)| self.links[..*k].contains(link));
        if let Some((_, link)) = twice {
            return Err(setting("bound.links", "every link once", format!("`{link}` twice")));
        }
        for (key, (lower, upper)) in self.ranges() {
            // Infinity as lower limit, or minus infinity as upper one, admits no number.
            let possible = lower <= upper && lower < f64::INFINITY && upper > f64::NEG_INFINITY;
            if !possible || !(lower.is_finite() || upper.is_finite()) {
                let of = self.parameter.as_ref().map_or_else(|| self.links.join("`, `"), Clone::clone);
                let expected = "[lower, upper] with lower not above upper and one of them finite";
                let found = format!("[{lower}, {upper}] for `{of}`");
                return Err(setting(&format!("bound.{key}"), expected, found));
            }
            if let Some(x) = [lower, upper].into_iter().find(|x| x.is_finite() && x.abs() > LARGEST_LIMIT) {
                let expected = format!("limits up to {LARGEST_LIMIT:e}, or `-inf` and `inf`");
                return Err(setting(&format!("bound.{key}"), &expected, format!("{x:e}")));
            }
        }
        Ok(())
    }

    /// The keys that are given, as a user would say it.
    fn keys(&self) -> String {
        let links = match self.links.len() {
            0 => None,
            1 => Some("`links` with one link".to_owned()),
            n => Some(format!("`links` with {n} links")),
        };
        let parameter = self.parameter.as_ref().map(|_| "`parameter`".to_owned());
        let ranges = self.ranges().map(|(key, _)| format!("`{key}`"));
        let keys: Vec<String> = links.into_iter().chain(parameter).chain(ranges).collect();
        if keys.is_empty() { "none of them".to_owned() } else { keys.join(", ") }
    }
}

fn setting(name: &str, expected: &str, found: impl ToString) -> Error {
    Error::Setting { name: name.to_owned(), expected: expected.to_owned(), found: found.to_string() }
}

/// A list of just so many entries; serde's own arrays and tuples pass over surplus ones.
fn exactly<'de, D: Deserializer<'de>, T: Deserialize<'de>, const N: usize>(
    deserializer: D,
) -> Result<Option<[T; N]>, D::Error> {
    let list = Vec::<T>::deserialize(deserializer)?;
    <[T; N]>::try_from(list)
        .map(Some)
        .map_err(|list| D::Error::custom(format!("expected a list of {N} numbers, found {}", list.len())))
}

fn pair<'de, D: Deserializer<'de>, T: Deserialize<'de>>(deserializer: D) -> Result<Option<(T, T)>, D::Error> {
    Ok(exactly(deserializer)?.map(|[lower, upper]| (lower, upper)))
}
