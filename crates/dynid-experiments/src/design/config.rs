//! The configuration of a design, a TOML file.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use dynid_config::config::{ElementsConfig, PerJoint, toml_file};
use dynid_drives::config::DriveConfig;
use dynid_identify::Error;
use dynid_identify::settings::lists::{exactly, just};
use serde::{Deserialize, Deserializer, Serialize};

/// Seeds count up from start to start.
const LARGEST_SEED: u64 = u64::MAX - 1_000_000;

/// What is to be designed, and how. Every key but `robot` has a default.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct DesignConfig {
    /// Robot file (URDF, MJCF, SDF or TOML), relative to the configuration.
    pub robot: PathBuf,
    /// Output folder, relative to the configuration. Without it the program writes to `dynid-design` in the current
    /// folder.
    pub out: Option<PathBuf>,
    /// Gravity in base axes, m/s². Default: the robot file's, else 0 0 -9.81.
    #[serde(deserialize_with = "exactly")]
    pub gravity: Option<[f64; 3]>,
    /// Couple mimic joints to their leaders. Default false.
    pub couple_mimics: bool,
    /// Joints held at a position, rad or m.
    pub locked: BTreeMap<String, f64>,
    /// Elements per joint. Default: the robot file's, else coulomb, viscous, offset, rotor.
    pub elements: ElementsConfig,
    /// Nominal values of parameters that the robot file does not state, by name (`j1.fc`).
    pub values: BTreeMap<String, f64>,
    /// The trajectory's form.
    pub trajectory: TrajectoryConfig,
    /// Limits of joints, beside those of the robot file.
    pub limits: LimitsConfig,
    /// Where points of the robot must stay.
    pub keep: Vec<KeepConfig>,
    /// Capsules around links, which must not touch.
    pub capsule: Vec<CapsuleConfig>,
    /// What is kept without being asked for: the floor, own links apart.
    pub safety: SafetyConfig,
    /// Folders that hold packages, for `package://NAME/...` of meshes in a URDF, relative to the configuration. The folders
    /// above the URDF are looked through too.
    pub package_dirs: Vec<PathBuf>,
    /// What is minimised.
    pub criterion: CriterionConfig,
    /// Trajectories that will be or were recorded as well: their information counts. Files of earlier designs.
    pub earlier: Vec<PathBuf>,
    /// What `dynid servo` found, its `servo.json`, relative to the configuration: the log will hold commands and positions and no effort, and the
    /// motion is for what such a log tells of gains, rotor inertia, friction and delay.
    pub drives: Option<PathBuf>,
    /// The same where no log has been identified yet: what is known of the drives, as for `dynid servo`. Guesses stand under `values`
    /// (`j1.position_gain`, `j1.coulomb`, ..).
    pub servo: Option<DriveConfig>,
    /// The search.
    pub search: SearchConfig,
}

/// Form of the trajectory.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct TrajectoryConfig {
    /// Period, s. Default 20; with drives 10.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub period_s: Option<f64>,
    /// Harmonics. Default 5; with drives, whose lags only fast motion tells apart, 20.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub harmonics: Option<usize>,
    /// Periods that are recorded. Default 1.
    pub periods: usize,
    /// Velocity and acceleration are zero at start and end. Default true.
    pub rest: bool,
    /// Jerk too. Default false.
    pub zero_jerk: bool,
    /// Pose at start and end of every period, rad or m, by joint; all joints or none. Default: free.
    pub start_pose: BTreeMap<String, f64>,
    /// Pose that the robot comes from and goes back to, by joint; joints left out are at zero, or the nearest position
    /// within their limits. Default: no approach and no return.
    pub parking: Option<BTreeMap<String, f64>>,
    /// Rate of the commanded and recorded samples, Hz. Default 500; with drives 100.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sample_rate_hz: Option<f64>,
    /// Frames whose paths are drawn. Default: the last link of every branch.
    pub frames: Vec<String>,
}

impl Default for TrajectoryConfig {
    fn default() -> Self {
        TrajectoryConfig {
            period_s: None,
            harmonics: None,
            periods: 1,
            rest: true,
            zero_jerk: false,
            start_pose: BTreeMap::new(),
            parking: None,
            sample_rate_hz: None,
            frames: Vec::new(),
        }
    }
}

/// Period, harmonics and rate of a designed motion: what is stated, else the defaults.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionForm {
    /// Period, s.
    pub period_s: f64,
    /// Harmonics.
    pub harmonics: usize,
    /// Rate of the commanded and recorded samples, Hz.
    pub sample_rate_hz: f64,
}

/// Limits of joints. What is not given comes from the robot file.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct LimitsConfig {
    /// Least and largest position, rad or m, by joint.
    #[serde(deserialize_with = "ranges")]
    pub position: BTreeMap<String, [f64; 2]>,
    /// Largest speed, rad/s or m/s.
    pub velocity: PerJoint,
    /// Largest acceleration, rad/s² or m/s². Default: full speed in half a second.
    pub acceleration: PerJoint,
    /// Largest jerk, rad/s³ or m/s³. Default: none.
    pub jerk: PerJoint,
    /// Largest effort, N m or N.
    pub effort: PerJoint,
    /// Share of the robot file's limits that may be used (positions: of the range about its middle). Default 1.
    pub share: f64,
    /// Keep the nominal model's efforts within their limits. Default true.
    pub efforts: bool,
    /// Of mechanisms with loops: least distance from singular poses, `σ_min/σ_max` of the loops' Jacobian by the joints that follow, as a share
    /// of that at home. Default 0.3: nearer, friction that follows loads may lock a joint.
    pub singularity: Option<f64>,
}

impl Default for LimitsConfig {
    fn default() -> Self {
        LimitsConfig {
            position: BTreeMap::new(),
            velocity: PerJoint::default(),
            acceleration: PerJoint::default(),
            jerk: PerJoint::default(),
            effort: PerJoint::default(),
            share: 1.0,
            efforts: true,
            singularity: None,
        }
    }
}

/// Limits that every design keeps unless they are turned off: links stay above the floor and apart from each other.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct SafetyConfig {
    /// Keep moving links above the floor: the plane through the origin of the base, across gravity. Of a base that is not
    /// upright the plane that it is mounted on takes its place. Default true.
    pub floor: bool,
    /// Height of the floor above the origin of the base, m. Default: 0 under an upright base, else not known.
    pub floor_height_m: Option<f64>,
    /// Keep links apart that are not joined by one joint. Default true.
    pub self_collision: bool,
    /// Least distance between links, and from the floor, m. Default 0.02.
    pub margin_m: f64,
    /// Pairs of links that need not be kept apart.
    pub exempt: Vec<[String; 2]>,
}

impl Default for SafetyConfig {
    fn default() -> Self {
        SafetyConfig {
            floor: true,
            floor_height_m: None,
            self_collision: true,
            margin_m: 0.02,
            exempt: Vec::new(),
        }
    }
}

/// Where points of the robot must stay; every region that is given counts. Base axes, m.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct KeepConfig {
    /// Links.
    pub frames: Vec<String>,
    /// Point in the axes of each link, m. Default: its origin.
    #[serde(deserialize_with = "just")]
    pub point: [f64; 3],
    /// Least height `z`.
    pub above: Option<f64>,
    /// `normal · x ≥ offset`.
    pub half_space: Option<HalfSpaceConfig>,
    /// Inside a box.
    pub inside: Option<BoxConfig>,
    /// Outside an upright cylinder.
    pub outside_cylinder: Option<CylinderConfig>,
    /// Outside an upright column or above it.
    pub outside_column: Option<ColumnConfig>,
}

/// A half-space.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct HalfSpaceConfig {
    /// Direction into the allowed side; any length.
    #[serde(deserialize_with = "just")]
    pub normal: [f64; 3],
    /// Distance of the plane from the origin along the normal, m.
    pub offset: f64,
}

/// An upright box.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct BoxConfig {
    /// Smallest coordinates, m.
    #[serde(deserialize_with = "just")]
    pub lower: [f64; 3],
    /// Largest coordinates, m.
    #[serde(deserialize_with = "just")]
    pub upper: [f64; 3],
}

/// An upright cylinder without ends.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct CylinderConfig {
    /// `x`, `y` of its axis, m. Default: the origin.
    #[serde(default, deserialize_with = "just")]
    pub center: [f64; 2],
    /// Radius, m.
    pub radius: f64,
}

/// An upright column that stands on the ground.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct ColumnConfig {
    /// `x`, `y` of its axis, m. Default: the origin.
    #[serde(default, deserialize_with = "just")]
    pub center: [f64; 2],
    /// Radius, m.
    pub radius: f64,
    /// `z` of its top, m.
    pub height: f64,
}

/// All points within a radius of a segment of a link.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct CapsuleConfig {
    /// Link.
    pub frame: String,
    /// One end of the segment in the link's axes, m.
    #[serde(deserialize_with = "just")]
    pub from: [f64; 3],
    /// The other end of the segment; equal to `from` for a sphere.
    #[serde(deserialize_with = "just")]
    pub to: [f64; 3],
    /// Radius, m.
    pub radius: f64,
}

/// What makes one trajectory better than another.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum CriterionName {
    /// Mean square of the relative standard deviations of the base parameters.
    RelativeStd,
    /// Condition number of the columns at unit length.
    UnitCondition,
    /// Condition number of the columns in SI units.
    Condition,
    /// `w1 condition + w2 / smallest singular value`.
    Mix,
    /// A-optimal: mean variance of the base parameters.
    A,
    /// D-optimal: determinant of the information.
    D,
    /// E-optimal: smallest singular value.
    E,
    /// Intervals that are wanted of parameters, given the factors of earlier logs: what `dynid next` makes narrow enough, and no design by
    /// itself.
    Intervals,
}

/// Parameters that are to become visible.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ColumnsName {
    /// All base parameters: bodies, rotors, friction, offsets.
    #[default]
    All,
    /// Base parameters of the rigid bodies alone.
    Inertial,
}

/// The criterion.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct CriterionConfig {
    /// Which. Default: `relative-std` if the robot file states inertias, else `unit-condition`.
    pub name: Option<CriterionName>,
    /// Parameters that count. Default `all`.
    pub columns: ColumnsName,
    /// Standard deviation of the effort's noise, N m or N. Default: 1 % of the effort limit, else of the largest nominal
    /// effort. With drives that of the positions, rad or m. Default: the residual of `drives`, else the rounding of an encoder with 4096 counts.
    pub noise: PerJoint,
    /// Time after which noise is independent of what it was, s. Default 0: every sample counts.
    pub correlation_time_s: f64,
    /// `w1`, `w2` of `mix`. Default 1, 1.
    #[serde(deserialize_with = "just")]
    pub mix: [f64; 2],
}

impl Default for CriterionConfig {
    fn default() -> Self {
        CriterionConfig {
            name: None,
            columns: ColumnsName::All,
            noise: PerJoint::default(),
            correlation_time_s: 0.0,
            mix: [1.0, 1.0],
        }
    }
}

/// The search.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct SearchConfig {
    /// Random starts. Default 16.
    pub starts: usize,
    /// Seed of the first. Default 1.
    pub seed: u64,
    /// No start begins after this time, and those that began end at their next step, s; the first one gives a trajectory in
    /// any case. Default: none.
    pub time_budget_s: Option<f64>,
    /// File that keeps finished starts, so that a run can be taken up again.
    pub checkpoint: Option<PathBuf>,
}

impl Default for SearchConfig {
    fn default() -> Self {
        SearchConfig { starts: 16, seed: 1, time_budget_s: None, checkpoint: None }
    }
}

/// Ranges by joint, two numbers each.
fn ranges<'de, D: Deserializer<'de>>(deserializer: D) -> Result<BTreeMap<String, [f64; 2]>, D::Error> {
    #[derive(Deserialize)]
    #[serde(transparent)]
    struct Range(#[serde(deserialize_with = "just")] [f64; 2]);
    let ranges = BTreeMap::<String, Range>::deserialize(deserializer)?;
    Ok(ranges.into_iter().map(|(joint, range)| (joint, range.0)).collect())
}

impl DesignConfig {
    /// Reads a configuration; paths in it become relative to its folder.
    ///
    /// # Errors
    /// [`Error::Read`], and as [`DesignConfig::parse`].
    pub fn read(path: &Path) -> Result<Self, Error> {
        let (mut config, folder) = toml_file::read(path, Self::parse)?;
        config.robot = folder.join(&config.robot);
        config.out = config.out.map(|o| folder.join(o));
        config.search.checkpoint = config.search.checkpoint.map(|c| folder.join(c));
        for path in config.earlier.iter_mut().chain(&mut config.package_dirs).chain(&mut config.drives) {
            *path = folder.join(&path);
        }
        Ok(config)
    }

    /// Parses a configuration.
    ///
    /// # Errors
    /// [`Error::Config`] with the line; [`Error::InFile`] with what [`DesignConfig::check`] finds.
    pub fn parse(text: &str, file: &str) -> Result<Self, Error> {
        let config: DesignConfig = toml_file::parse(text, file)?;
        if config.robot.as_os_str().is_empty() {
            return Err(toml_file::missing(file, "`robot = \"file\"`"));
        }
        toml_file::in_file(file, config.check())?;
        Ok(config)
    }

    /// Refuses settings that would do nothing: friction found on logs, and what the other settings switch off.
    fn check_effect(&self) -> Result<(), Error> {
        let (usual, e) = (ElementsConfig::default(), &self.elements);
        let logs = "no value: a design has no logs; name laws in the lists of elements";
        let mix = CriterionConfig::default().mix;
        let (safety, plain) = (&self.safety, SafetyConfig::default());
        let is_off = !safety.floor && !safety.self_collision;
        let keys = [
            (
                "safety.floor_height_m",
                !safety.floor && safety.floor_height_m.is_some(),
                "`floor = true` beside it",
            ),
            (
                "safety.margin_m",
                is_off && safety.margin_m != plain.margin_m,
                "`floor` or `self_collision` beside it",
            ),
            (
                "safety.exempt",
                !safety.self_collision && !safety.exempt.is_empty(),
                "`self_collision = true` beside it",
            ),
            (
                "package_dirs",
                is_off && !self.package_dirs.is_empty(),
                "`floor` or `self_collision` under [safety], which meshes are read for",
            ),
            ("elements.friction", e.friction != usual.friction, logs),
            ("elements.friction_errors", e.friction_errors != usual.friction_errors, logs),
            ("elements.temperature", !e.temperature.is_none(), logs),
            (
                "elements.clearance",
                e.clearance.is_some(),
                "no value: a design takes joints as ideal, whether they have clearance or not",
            ),
            (
                "criterion.mix",
                self.criterion.mix != mix && self.criterion.name != Some(CriterionName::Mix),
                "`name = \"mix\"` beside it",
            ),
            ("trajectory.zero_jerk", self.trajectory.zero_jerk && !self.trajectory.rest, "`rest` beside it"),
            (
                "limits.effort",
                !self.limits.efforts && !self.limits.effort.is_none(),
                "`efforts = true` beside it, which keeps these limits",
            ),
        ];
        match keys.iter().find(|(_, idle, _)| *idle) {
            Some((key, _, expected)) => Err(Error::setting(key, expected, "one")),
            None => Ok(()),
        }
    }

    /// Whether the motion is for drives that log positions and no effort.
    pub fn has_drives(&self) -> bool {
        self.drives.is_some() || self.servo.is_some()
    }

    /// Period, harmonics and rate: what is stated, else the defaults.
    pub fn form(&self) -> MotionForm {
        let (period_s, harmonics, sample_rate_hz) =
            if self.has_drives() { (10.0, 20, 100.0) } else { (20.0, 5, 500.0) };
        let t = &self.trajectory;
        MotionForm {
            period_s: t.period_s.unwrap_or(period_s),
            harmonics: t.harmonics.unwrap_or(harmonics),
            sample_rate_hz: t.sample_rate_hz.unwrap_or(sample_rate_hz),
        }
    }

    /// Checks numbers that need no robot.
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub fn check(&self) -> Result<(), Error> {
        let (t, form) = (&self.trajectory, self.form());
        let positive = [
            ("trajectory.period_s", form.period_s),
            ("trajectory.sample_rate_hz", form.sample_rate_hz),
            ("limits.share", self.limits.share),
            ("criterion.mix", self.criterion.mix[0]),
        ];
        for (name, x) in positive {
            if !(x > 0.0 && x.is_finite()) {
                return Err(Error::setting(name, "a positive number", x));
            }
        }
        if let Some(x) = self.limits.singularity.filter(|x| !(*x > 0.0 && *x < 1.0)) {
            return Err(Error::setting("limits.singularity", "above 0 and below 1", x));
        }
        if self.limits.share > 1.0 {
            return Err(Error::setting("limits.share", "at most 1", self.limits.share));
        }
        let other = [
            ("criterion.mix", self.criterion.mix[1]),
            ("criterion.correlation_time_s", self.criterion.correlation_time_s),
            ("search.time_budget_s", self.search.time_budget_s.unwrap_or(0.0)),
            ("safety.margin_m", self.safety.margin_m),
        ];
        for (name, x) in other {
            if !(x >= 0.0 && x.is_finite()) {
                return Err(Error::setting(name, "a number that is not negative", x));
            }
        }
        let counts = [
            ("trajectory.harmonics", form.harmonics, 2, 50),
            ("trajectory.periods", t.periods, 1, 10_000),
            ("search.starts", self.search.starts, 1, 100_000),
        ];
        for (name, x, least, most) in counts {
            if !(least..=most).contains(&x) {
                return Err(Error::setting(name, &format!("{least} to {most}"), x));
            }
        }
        if self.search.seed > LARGEST_SEED {
            return Err(Error::setting("search.seed", &format!("at most {LARGEST_SEED}"), self.search.seed));
        }
        let held = self.locked.iter().map(|(joint, x)| (format!("locked.{joint}"), *x));
        let pull = self.gravity.into_iter().flatten().map(|x| ("gravity".to_owned(), x));
        for (name, x) in held.chain(pull) {
            if !x.is_finite() {
                return Err(Error::setting(&name, "a finite number", x));
            }
        }
        let MotionForm { period_s, harmonics, sample_rate_hz } = form;
        let samples = period_s * sample_rate_hz;
        if samples < 4.0 * harmonics as f64 {
            let expected =
                format!("at least {} Hz: four samples per harmonic", 4.0 * harmonics as f64 / period_s);
            return Err(Error::setting("trajectory.sample_rate_hz", &expected, sample_rate_hz));
        }
        if samples * t.periods as f64 > 1e7 {
            let expected = "at most 1e7 samples in all periods";
            return Err(Error::setting("trajectory.sample_rate_hz", expected, sample_rate_hz));
        }
        self.check_effect()?;
        if let Some(height) = self.safety.floor_height_m.filter(|h| !h.is_finite()) {
            return Err(Error::setting("safety.floor_height_m", "a finite number", height));
        }
        if self.capsule.len() == 1 && !self.safety.floor && !self.safety.self_collision {
            let expected = "two or more: pairs of capsules must not touch";
            return Err(Error::setting("capsule", expected, "one"));
        }
        for keep in &self.keep {
            if keep.frames.is_empty() {
                return Err(Error::setting("keep.frames", "at least one link", "none"));
            }
            let regions = [
                keep.above.is_some(),
                keep.half_space.is_some(),
                keep.inside.is_some(),
                keep.outside_cylinder.is_some(),
                keep.outside_column.is_some(),
            ];
            if !regions.contains(&true) {
                let expected = "`above`, `half_space`, `inside`, `outside_cylinder` or `outside_column`";
                return Err(Error::setting("keep", expected, "no region"));
            }
        }
        Ok(())
    }
}
