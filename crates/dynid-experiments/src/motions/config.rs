//! What test motions are made of, a TOML file.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use dynid_config::config::{PerJoint, toml_file};
use dynid_identify::Error;
use dynid_identify::settings::lists::{exactly, just};
use serde::{Deserialize, Deserializer, Serialize};

/// Most repetitions of a part.
const MOST_REPEATS: usize = 100_000;

/// A motion, part after part. Every key but `robot` and `part` has a default.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct MotionConfig {
    /// Robot file (URDF, MJCF, SDF or TOML), relative to the configuration.
    pub robot: PathBuf,
    /// Output folder, relative to the configuration. Without it the program writes to `dynid-motion` in the current folder.
    pub out: Option<PathBuf>,
    /// Rate of the samples, Hz; borders of blends and pauses lie on samples.
    pub sample_rate_hz: f64,
    /// Couple mimic joints to their leaders.
    pub couple_mimics: bool,
    /// Joints held at a position, rad or m; the files have no columns of them.
    pub locked: BTreeMap<String, f64>,
    /// Pose in which the motion begins and ends and other joints rest, by joint, rad or m. Default: zero or the nearest position
    /// within the limits; of mechanisms with loops home.
    pub start: BTreeMap<String, f64>,
    /// Limits of joints, beside those of the robot file.
    pub limits: MotionLimitsConfig,
    /// A part that breaks a limit of speed, acceleration or jerk is run slower, as a whole; `false` refuses it.
    pub slower: bool,
    /// Parts in the order in which they run.
    pub part: Vec<PartConfig>,
    /// Loads that are to act on joints, as columns of the files.
    pub load: Vec<LoadConfig>,
}

impl Default for MotionConfig {
    fn default() -> Self {
        MotionConfig {
            robot: PathBuf::new(),
            out: None,
            sample_rate_hz: 500.0,
            couple_mimics: false,
            locked: BTreeMap::new(),
            start: BTreeMap::new(),
            limits: MotionLimitsConfig::default(),
            slower: false,
            part: Vec::new(),
            load: Vec::new(),
        }
    }
}

/// Limits of joints. What is not given comes from the robot file.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct MotionLimitsConfig {
    /// Least and largest position, rad or m, by joint.
    #[serde(deserialize_with = "ranges")]
    pub position: BTreeMap<String, [f64; 2]>,
    /// Largest speed, rad/s or m/s.
    pub velocity: PerJoint,
    /// Largest acceleration, rad/s² or m/s². Default: full speed in half a second.
    pub acceleration: PerJoint,
    /// Largest jerk, rad/s³ or m/s³. Default: none.
    pub jerk: PerJoint,
    /// Share of the robot file's limits that may be used (positions: of the range about its middle).
    pub share: f64,
}

impl Default for MotionLimitsConfig {
    fn default() -> Self {
        MotionLimitsConfig {
            position: BTreeMap::new(),
            velocity: PerJoint::default(),
            acceleration: PerJoint::default(),
            jerk: PerJoint::default(),
            share: 1.0,
        }
    }
}

/// A part: just one of `sweep`, `presliding`, `track`, `circle` and `pause_s`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct PartConfig {
    /// Name in messages and results. Default: what it is.
    pub name: Option<String>,
    /// How often it runs, for warm-up.
    pub repeat: usize,
    /// Constant speeds of one joint.
    pub sweep: Option<SweepConfig>,
    /// Small sinusoids of one joint.
    pub presliding: Option<PreslidingConfig>,
    /// Straight lines between points in joint space, with blended corners.
    pub track: Option<TrackConfig>,
    /// A point of a link on a circle.
    pub circle: Option<CircleConfig>,
    /// Rest for so long, s.
    pub pause_s: Option<f64>,
}

impl Default for PartConfig {
    fn default() -> Self {
        PartConfig {
            name: None,
            repeat: 1,
            sweep: None,
            presliding: None,
            track: None,
            circle: None,
            pause_s: None,
        }
    }
}

/// Constant speeds of one joint, each forth and back over the same positions, while the others rest: what `dynid friction` reads.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct SweepConfig {
    /// The joint.
    pub joint: String,
    /// Speeds, rad/s or m/s, each forth and back, in this order.
    pub speeds: Vec<f64>,
    /// Positions within which the joint moves, rad or m. Default: its limits.
    #[serde(deserialize_with = "exactly")]
    pub range: Option<[f64; 2]>,
    /// Acceleration of the blends, rad/s² or m/s². Default: its limit.
    pub acceleration: Option<f64>,
    /// Longest time at one speed, s: slow passes stay about the middle of the range.
    pub longest_s: f64,
    /// Least time at one speed, s; a speed that the range leaves less of is refused.
    pub least_s: f64,
    /// Rest after every pass, s; 0: none.
    pub pause_s: f64,
}

impl Default for SweepConfig {
    fn default() -> Self {
        SweepConfig {
            joint: String::new(),
            speeds: Vec::new(),
            range: None,
            acceleration: None,
            longest_s: 20.0,
            least_s: 0.6,
            pause_s: 0.5,
        }
    }
}

/// Small sinusoids of one joint about a position, from rest to rest: motion within the bristles of friction.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct PreslidingConfig {
    /// The joint.
    pub joint: String,
    /// Frequency in Hz and amplitude in rad or m of every sinusoid.
    #[serde(deserialize_with = "pairs")]
    pub tones: Vec<[f64; 2]>,
    /// Position about which it moves, rad or m. Default: that of the start pose.
    pub about: Option<f64>,
    /// Duration, s.
    pub duration_s: f64,
    /// Time in which the sinusoids rise from rest, and fall at the end, s. Default: a period of the slowest.
    pub fade_s: Option<f64>,
}

impl Default for PreslidingConfig {
    fn default() -> Self {
        PreslidingConfig {
            joint: String::new(),
            tones: Vec::new(),
            about: None,
            duration_s: 5.0,
            fade_s: None,
        }
    }
}

/// Straight lines between points in joint space, at constant speed with blended corners (Paul 1981).
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct TrackConfig {
    /// Points by joint, rad or m, two at least; a joint that a point leaves out stays where the point before has it (the first: the
    /// start pose).
    pub points: Vec<BTreeMap<String, f64>>,
    /// Times of the lines, s. Default: the shortest that keep `speed` and the blends.
    pub times_s: Option<Vec<f64>>,
    /// Largest speeds on the lines, rad/s or m/s. Default: the limits.
    pub speed: PerJoint,
    /// Time of a blend, s. Default: the shortest that keeps the limits of acceleration and jerk.
    pub blend_s: Option<f64>,
}

/// A point of a link on a circle in task space, at constant speed but for its beginning and end.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct CircleConfig {
    /// Link that carries the point.
    pub link: String,
    /// The point in the frame of the link, m.
    #[serde(deserialize_with = "just")]
    pub point: [f64; 3],
    /// Centre in base axes, m. Default: where the point is in the start pose.
    #[serde(deserialize_with = "exactly")]
    pub centre: Option<[f64; 3]>,
    /// Normal of the plane in base axes; the point turns about it by the right hand.
    #[serde(deserialize_with = "just")]
    pub normal: [f64; 3],
    /// Radius, m.
    pub radius: f64,
    /// Turns, whole or not; below 0 the other way round.
    pub turns: f64,
    /// Time of a turn at constant speed, s.
    pub turn_s: f64,
    /// Time in which the point gets to that speed, and comes to rest, s. Default: a quarter of a turn's, or of the whole way's where
    /// that is shorter.
    pub blend_s: Option<f64>,
    /// The link keeps the orientation of the start pose.
    pub hold_orientation: bool,
    /// Joints that stay where they are in the start pose.
    pub hold: Vec<String>,
}

impl Default for CircleConfig {
    fn default() -> Self {
        CircleConfig {
            link: String::new(),
            point: [0.0, 0.0, 0.0],
            centre: None,
            normal: [0.0, 0.0, 1.0],
            radius: 0.0,
            turns: 1.0,
            turn_s: 10.0,
            blend_s: None,
            hold_orientation: true,
            hold: Vec::new(),
        }
    }
}

/// A load on a joint beside its drive, as the column `load_<joint>`: what `external_load` of a robot file reads.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct LoadConfig {
    /// The joint.
    pub joint: String,
    /// The load is a brake's: it opposes motion in either direction, and no value is below 0. Else it counts positive against
    /// positive motion.
    pub brake: bool,
    /// Times from the beginning of the motion in s and loads in N m or N, linear in between and constant beyond.
    #[serde(deserialize_with = "pairs")]
    pub points: Vec<[f64; 2]>,
    /// In place of `points`: a load for every part, N m or N, constant while it runs and linear on the way to the next.
    pub by_part: Vec<f64>,
}

/// Ranges by joint, two numbers each.
fn ranges<'de, D: Deserializer<'de>>(deserializer: D) -> Result<BTreeMap<String, [f64; 2]>, D::Error> {
    let ranges = BTreeMap::<String, Pair>::deserialize(deserializer)?;
    Ok(ranges.into_iter().map(|(joint, range)| (joint, range.0)).collect())
}

/// Pairs of numbers.
fn pairs<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<[f64; 2]>, D::Error> {
    Ok(Vec::<Pair>::deserialize(deserializer)?.into_iter().map(|pair| pair.0).collect())
}

/// Just two numbers.
#[derive(Deserialize)]
#[serde(transparent)]
struct Pair(#[serde(deserialize_with = "just")] [f64; 2]);

impl MotionConfig {
    /// Reads a configuration; paths in it become relative to its folder.
    ///
    /// # Errors
    /// [`Error::Read`], and as [`MotionConfig::parse`].
    pub fn read(path: &Path) -> Result<Self, Error> {
        let (mut config, folder) = toml_file::read(path, Self::parse)?;
        config.robot = folder.join(&config.robot);
        config.out = config.out.map(|o| folder.join(o));
        Ok(config)
    }

    /// Parses a configuration.
    ///
    /// # Errors
    /// [`Error::Config`] with the line; [`Error::InFile`] with what [`MotionConfig::check`] finds.
    pub fn parse(text: &str, file: &str) -> Result<Self, Error> {
        let config: MotionConfig = toml_file::parse(text, file)?;
        if config.robot.as_os_str().is_empty() {
            return Err(toml_file::missing(file, "`robot = \"file\"`"));
        }
        toml_file::in_file(file, config.check())?;
        Ok(config)
    }

    /// Checks what needs no robot.
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub fn check(&self) -> Result<(), Error> {
        for (name, x) in [("sample_rate_hz", self.sample_rate_hz), ("limits.share", self.limits.share)] {
            if !(x > 0.0 && x.is_finite()) {
                return Err(Error::setting(name, "a positive number", x));
            }
        }
        if self.limits.share > 1.0 {
            return Err(Error::setting("limits.share", "at most 1", self.limits.share));
        }
        if self.part.is_empty() {
            return Err(Error::setting("part", "at least one `[[part]]`", "none"));
        }
        let poses = [("locked", &self.locked), ("start", &self.start)];
        for (key, (joint, x)) in poses.iter().flat_map(|(key, pose)| pose.iter().map(move |p| (key, p))) {
            finite(&format!("{key}.{joint}"), *x)?;
        }
        for (k, part) in self.part.iter().enumerate() {
            part.check(k + 1)?;
        }
        self.load.iter().enumerate().try_for_each(|(k, load)| load.check(k, self))
    }
}

fn finite(name: &str, x: f64) -> Result<(), Error> {
    if x.is_finite() { Ok(()) } else { Err(Error::setting(name, "a finite number", x)) }
}

fn positive(name: &str, x: f64) -> Result<(), Error> {
    let good = x > 0.0 && x.is_finite();
    if good { Ok(()) } else { Err(Error::setting(name, "a positive number", x)) }
}

/// Name of a key of a part in messages; parts are counted from 1.
pub(super) fn key(part: usize, name: &str) -> String {
    format!("part {part}: {name}")
}

impl PartConfig {
    /// What kind of part it is.
    pub(super) fn kind(&self) -> &'static str {
        let kinds = [
            ("sweep", self.sweep.is_some()),
            ("presliding", self.presliding.is_some()),
            ("track", self.track.is_some()),
            ("circle", self.circle.is_some()),
        ];
        kinds.iter().find(|(_, given)| *given).map_or("pause", |(kind, _)| kind)
    }

    /// Name in messages, its number first.
    pub(super) fn title(&self, number: usize) -> String {
        let own = match (&self.name, &self.sweep, &self.presliding) {
            (Some(name), _, _) => name.clone(),
            (None, Some(SweepConfig { joint, .. }), _) => format!("sweep of `{joint}`"),
            (None, _, Some(PreslidingConfig { joint, .. })) => format!("presliding of `{joint}`"),
            _ => self.kind().to_owned(),
        };
        format!("part {number} ({own})")
    }

    fn check(&self, number: usize) -> Result<(), Error> {
        let key = |name: &str| key(number, name);
        let given = [
            self.sweep.is_some(),
            self.presliding.is_some(),
            self.track.is_some(),
            self.circle.is_some(),
            self.pause_s.is_some(),
        ];
        let count = given.iter().filter(|given| **given).count();
        if count != 1 {
            let expected = "just one of `sweep`, `presliding`, `track`, `circle` and `pause_s`";
            return Err(Error::setting(&key("kind"), expected, count));
        }
        if !(1..=MOST_REPEATS).contains(&self.repeat) {
            return Err(Error::setting(&key("repeat"), &format!("1 to {MOST_REPEATS}"), self.repeat));
        }
        if let Some(pause) = self.pause_s {
            positive(&key("pause_s"), pause)?;
        }
        if let Some(s) = &self.sweep {
            if s.speeds.is_empty() {
                return Err(Error::setting(&key("sweep.speeds"), "at least one speed", "none"));
            }
            s.speeds.iter().try_for_each(|v| positive(&key("sweep.speeds"), *v))?;
            if let Some([low, high]) = s.range
                && !(low < high && low.is_finite() && high.is_finite())
            {
                let found = format!("{low} to {high}");
                return Err(Error::setting(&key("sweep.range"), "least below largest, finite", found));
            }
            positive(&key("sweep.acceleration"), s.acceleration.unwrap_or(1.0))?;
            positive(&key("sweep.longest_s"), s.longest_s)?;
            positive(&key("sweep.least_s"), s.least_s)?;
            if s.least_s > s.longest_s {
                return Err(Error::setting(&key("sweep.least_s"), "at most `longest_s`", s.least_s));
            }
            not_negative(&key("sweep.pause_s"), s.pause_s)?;
        }
        if let Some(p) = &self.presliding {
            if p.tones.is_empty() {
                let expected = "at least one `[frequency in Hz, amplitude]`";
                return Err(Error::setting(&key("presliding.tones"), expected, "none"));
            }
            p.tones.iter().flatten().try_for_each(|x| positive(&key("presliding.tones"), *x))?;
            positive(&key("presliding.duration_s"), p.duration_s)?;
            positive(&key("presliding.fade_s"), p.fade_s.unwrap_or(1.0))?;
            finite(&key("presliding.about"), p.about.unwrap_or(0.0))?;
        }
        if let Some(t) = &self.track {
            t.check(&key)?;
        }
        if let Some(c) = &self.circle {
            for (name, x) in [
                ("circle.radius", c.radius),
                ("circle.turn_s", c.turn_s),
                ("circle.blend_s", c.blend_s.unwrap_or(1.0)),
                ("circle.turns, without its sign", c.turns.abs()),
            ] {
                positive(&key(name), x)?;
            }
        }
        Ok(())
    }
}

fn not_negative(name: &str, x: f64) -> Result<(), Error> {
    let good = x >= 0.0 && x.is_finite();
    if good { Ok(()) } else { Err(Error::setting(name, "a number that is not negative", x)) }
}

impl TrackConfig {
    fn check(&self, key: &dyn Fn(&str) -> String) -> Result<(), Error> {
        if self.points.len() < 2 {
            return Err(Error::setting(&key("track.points"), "at least two points", self.points.len()));
        }
        self.points.iter().flat_map(BTreeMap::values).try_for_each(|q| finite(&key("track.points"), *q))?;
        positive(&key("track.blend_s"), self.blend_s.unwrap_or(1.0))?;
        let Some(times) = &self.times_s else { return Ok(()) };
        let lines = self.points.len() - 1;
        if times.len() != lines {
            let expected = format!("{lines} times, one per line");
            return Err(Error::setting(&key("track.times_s"), &expected, times.len()));
        }
        if !self.speed.is_none() {
            let expected = "no value beside `times_s`, which decides the speeds";
            return Err(Error::setting(&key("track.speed"), expected, "one"));
        }
        times.iter().try_for_each(|t| positive(&key("track.times_s"), *t))
    }
}

impl LoadConfig {
    fn check(&self, number: usize, config: &MotionConfig) -> Result<(), Error> {
        let key = |name: &str| format!("load {}: {name}", number + 1);
        if self.points.is_empty() == self.by_part.is_empty() {
            let found = if self.points.is_empty() { "neither" } else { "both" };
            return Err(Error::setting(&key("points"), "either `points` or `by_part`", found));
        }
        let parts = config.part.len();
        if !self.by_part.is_empty() && self.by_part.len() != parts {
            let expected = format!("{parts} loads, one per part");
            return Err(Error::setting(&key("by_part"), &expected, self.by_part.len()));
        }
        self.points.iter().try_for_each(|[t, _]| not_negative(&key("points"), *t))?;
        if self.points.windows(2).any(|w| w[0][0] >= w[1][0]) {
            return Err(Error::setting(&key("points"), "times that ascend", "others"));
        }
        for (name, x) in
            (self.points.iter().map(|p| ("points", p[1]))).chain(self.by_part.iter().map(|x| ("by_part", *x)))
        {
            finite(&key(name), x)?;
            if self.brake {
                not_negative(&key(name), x)?;
            }
        }
        if config.load[..number].iter().any(|other| other.joint == self.joint) {
            return Err(Error::setting(&key("joint"), "every joint once", &self.joint));
        }
        Ok(())
    }
}
