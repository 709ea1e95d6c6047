//! Settings of virtual logs.

use std::collections::BTreeMap;
use std::path::PathBuf;

use dynid_config::config::{PerJoint, toml_file};
use dynid_identify::Error;
use serde::Deserialize;

use super::fleet_table::FleetTable;

/// What a virtual log is made of.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SimulateSettings {
    /// Length, s. Default 20.
    pub duration_s: f64,
    /// Sample rate, Hz. Default 500.
    pub rate_hz: f64,
    /// Harmonics of the trajectory. Default 5.
    pub harmonics: usize,
    /// Period of the trajectory, s. Default: the duration; of a mechanism with loops the shortest whole part of it that speeds,
    /// accelerations and 2 Hz leave room for.
    pub period_s: Option<f64>,
    /// Share of the position and velocity limits that the motion uses. Default 0.8.
    pub share: f64,
    /// How the log is made. Default: inverse dynamics.
    pub mode: SimulateMode,
    /// Noise of the effort as a share of its rms. Default 0.02.
    pub effort_noise: f64,
    /// Encoder resolution, bits per turn (per metre for sliding joints); 0: exact. Default 18.
    pub encoder_bits: u32,
    /// Lead of the logged effort before the motion, samples. Default 0.5 with inverse dynamics (a command held over a
    /// sample), 0.3 in closed loop, where the held command adds half a control tick by itself.
    pub delay_samples: Option<f64>,
    /// Largest acceleration, rad/s² or m/s². Default 6.
    pub acceleration: f64,
    /// Values of parameters that the robot file does not state, by name (`j1.fc`).
    pub values: BTreeMap<String, f64>,
    /// Seed of trajectory and noise. Default 1.
    pub seed: u64,
    /// Trajectories of joints by name, in place of random ones; the period is `period_s`.
    pub trajectory: BTreeMap<String, SeriesSettings>,
    /// Trajectory file to follow, approach and return included, in place of all settings of a trajectory and of the duration:
    /// coefficients (`dynid design` writes them) or a table of samples, `.csv` or `.csv.gz` (`dynid motion` writes them), whose
    /// channels such as `load_<joint>` are followed too. Relative to the settings' file.
    pub follow: Option<PathBuf>,
    /// What `dynid servo` found of the drives, its `servo.json`: the trajectory is what they are told, and the log holds commands and positions and
    /// no effort. `values` are then those of joints and terms (`j1.coulomb`, `j1.delay`). Relative to the settings' file.
    pub drives: Option<PathBuf>,
    /// Only of robots with clearance on a periodic trajectory: time that is simulated before the log begins, s. Default 0.5.
    pub settle_s: Option<f64>,
    /// Only of robots with clearance: noise of the logged offsets of journals, m. Default 0.
    pub journal_noise: f64,
    /// Only in closed loop: switches every imperfection off, noise, encoder steps and delay included. Default false.
    pub perfect: bool,
    /// Only in closed loop: whether velocity is logged, as `dq_<joint>`. Default false.
    pub log_velocity: bool,
    /// Only in closed loop: the controller.
    pub control: Option<ControlTable>,
    /// Only in closed loop: what sensors, drives and logger do wrong.
    pub imperfections: Option<ImperfectionTable>,
    /// Only in closed loop: the equation of motion.
    pub plant: Option<PlantTable>,
    /// Channels that elements read, such as temperatures, by name (`temperature_j1`, or `temperature` for all joints):
    /// `[time in s, value]`, linear in between.
    pub channels: BTreeMap<String, Vec<[f64; 2]>>,
    /// A fleet in place of one log: `--out` is a folder then. By inverse dynamics only.
    pub fleet: Option<FleetTable>,
}

/// How a virtual log is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SimulateMode {
    /// The robot is on the trajectory exactly; efforts by inverse dynamics.
    #[default]
    InverseDynamics,
    /// A controller makes the robot follow the trajectory; motion by integration.
    ClosedLoop,
}

/// Fourier series of one joint: `offset + Σ_l sine_l sin(l ω t) + cosine_l cos(l ω t)`, rad or m.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SeriesSettings {
    /// Middle. Default 0.
    pub offset: f64,
    /// Amplitudes of sines. Default: none.
    pub sine: Vec<f64>,
    /// Amplitudes of cosines, as many.
    pub cosine: Vec<f64>,
}

/// Keys of `[control]`; see [`dynid_sim::ControlSettings`] for what is not said here.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ControlTable {
    /// Ticks per second, a whole multiple of `rate_hz`. Default: the first such that is at least 1000.
    pub rate_hz: Option<f64>,
    /// Natural frequency of the position loop, Hz. Default 5.
    pub bandwidth_hz: f64,
    /// Damping ratio of the position loop. Default 1.
    pub damping: f64,
    /// Position gains in joint order, in place of those.
    pub position_gain: Option<Vec<f64>>,
    /// Velocity gains in joint order, in place of those.
    pub velocity_gain: Option<Vec<f64>>,
    /// Whether the nominal model is fed forward. Default true.
    pub feed_forward: bool,
    /// Standard deviation of the nominal model's parameters from the true ones, share of each. Default 0.1.
    pub model_error: f64,
    /// Low pass on differences of encoder readings, Hz. Default 100.
    pub velocity_cutoff_hz: f64,
    /// Time from a tick to the change of effort, ticks. Default 0.
    pub delay_ticks: f64,
    /// Whether efforts stay within the robot file's limits. Default true.
    pub effort_limits: bool,
    /// Joints without a drive. Default: none.
    pub passive: Vec<String>,
}

impl Default for ControlTable {
    fn default() -> Self {
        let common = dynid_sim::ControlSettings::default();
        ControlTable {
            rate_hz: None,
            bandwidth_hz: common.bandwidth_hz,
            damping: common.damping,
            position_gain: None,
            velocity_gain: None,
            feed_forward: common.feed_forward,
            model_error: 0.1,
            velocity_cutoff_hz: common.velocity_cutoff_hz,
            delay_ticks: common.delay_ticks,
            effort_limits: true,
            passive: Vec::new(),
        }
    }
}

/// Keys of `[imperfections]`, as in [`dynid_sim::Imperfections`], whose defaults they have. Encoder steps, effort noise as
/// a share and delay are `encoder_bits`, `effort_noise` and `delay_samples`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ImperfectionTable {
    /// Encoder noise, rad or m.
    pub encoder_noise: f64,
    /// Noise of the logged velocity, rad/s or m/s.
    pub velocity_noise: f64,
    /// Further effort noise, one number for all joints or numbers by joint, N m or N. Default: none.
    pub effort_noise_absolute: PerJoint,
    /// Torque ripple, share of the rms effort.
    pub ripple_share: f64,
    /// Repetitions of the ripple per turn.
    pub ripple_cycles: f64,
    /// Share of effort samples that are outliers.
    pub outlier_share: f64,
    /// Size of outliers in multiples of the rms effort.
    pub outlier_size: f64,
    /// Share of rows that are missing.
    pub dropped_share: f64,
    /// Error of the time stamps, s.
    pub clock_jitter_s: f64,
}

impl Default for ImperfectionTable {
    fn default() -> Self {
        let common = dynid_sim::Imperfections::default();
        ImperfectionTable {
            encoder_noise: common.encoder_noise,
            velocity_noise: common.velocity_noise,
            effort_noise_absolute: PerJoint::default(),
            ripple_share: common.ripple_share,
            ripple_cycles: common.ripple_cycles,
            outlier_share: common.outlier_share,
            outlier_size: common.outlier_size,
            dropped_share: common.dropped_share,
            clock_jitter_s: common.clock_jitter_s,
        }
    }
}

/// Keys of `[plant]`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PlantTable {
    /// Speed over which the sign of a velocity is smoothed, rad/s or m/s. Default 1e-4.
    pub sign_width: f64,
    /// Largest local error of an integration step. Default 1e-9.
    pub tolerance: f64,
}

impl Default for PlantTable {
    fn default() -> Self {
        PlantTable { sign_width: 1e-4, tolerance: 1e-9 }
    }
}

impl Default for SimulateSettings {
    fn default() -> Self {
        SimulateSettings {
            duration_s: 20.0,
            rate_hz: 500.0,
            harmonics: 5,
            period_s: None,
            share: 0.8,
            mode: SimulateMode::InverseDynamics,
            effort_noise: 0.02,
            encoder_bits: 18,
            delay_samples: None,
            acceleration: 6.0,
            values: BTreeMap::new(),
            seed: 1,
            trajectory: BTreeMap::new(),
            follow: None,
            drives: None,
            settle_s: None,
            journal_noise: 0.0,
            perfect: false,
            log_velocity: false,
            control: None,
            imperfections: None,
            plant: None,
            channels: BTreeMap::new(),
            fleet: None,
        }
    }
}

impl SimulateSettings {
    /// Parses settings from TOML.
    ///
    /// # Errors
    /// [`Error::Config`] with the line.
    pub fn parse(text: &str, file: &str) -> Result<Self, Error> {
        toml_file::parse(text, file)
    }

    /// Fails unless all values make sense on their own.
    pub(super) fn check(&self) -> Result<(), Error> {
        let s = self;
        let positive = [
            ("duration_s", s.duration_s),
            ("rate_hz", s.rate_hz),
            ("share", s.share),
            ("acceleration", s.acceleration),
            ("period_s", s.period_s.unwrap_or(1.0)),
        ];
        for (name, x) in positive {
            if !(x.is_finite() && x > 0.0) {
                return Err(Error::setting(name, "a positive number", x));
            }
        }
        for (name, x) in [
            ("effort_noise", s.effort_noise),
            ("delay_samples", s.delay_samples.unwrap_or(0.0).abs()),
            ("settle_s", s.settle_s.unwrap_or(0.0)),
            ("journal_noise", s.journal_noise),
        ] {
            if !(x.is_finite() && x >= 0.0) {
                return Err(Error::setting(name, "a finite number", x));
            }
        }
        if s.duration_s * s.rate_hz > 1e8 {
            return Err(Error::setting("duration_s", "at most 1e8 samples", s.duration_s));
        }
        if !(1..=100).contains(&s.harmonics) {
            return Err(Error::setting("harmonics", "1 to 100", s.harmonics));
        }
        if s.encoder_bits > 40 {
            return Err(Error::setting("encoder_bits", "at most 40", s.encoder_bits));
        }
        if let (Some(settle), Some(_)) = (s.settle_s, &s.follow) {
            return Err(Error::setting("settle_s", "no value beside `follow`, which has a start", settle));
        }
        if let (Some(settle), SimulateMode::ClosedLoop) = (s.settle_s, s.mode) {
            let expected = "no value in closed loop, where journals begin at rest against their bearings";
            return Err(Error::setting("settle_s", expected, settle));
        }
        s.check_mode()
    }

    /// Fails if something is said about random motion where all joints have a stated one.
    pub(super) fn check_random(&self, joints: &[String]) -> Result<(), Error> {
        let usual = SimulateSettings::default();
        let given = [
            ("harmonics", self.harmonics != usual.harmonics),
            ("share", self.share != usual.share),
            ("acceleration", self.acceleration != usual.acceleration),
        ];
        let all = joints.iter().all(|joint| self.trajectory.contains_key(joint));
        match given.iter().find(|(_, given)| all && *given) {
            None => Ok(()),
            Some((name, _)) => Err(Error::setting(
                name,
                "a joint without `[trajectory.<joint>]`, which moves at random",
                "none",
            )),
        }
    }

    /// Fails if something is said about clearance, for robots that have none.
    pub(super) fn check_ideal(&self) -> Result<(), Error> {
        let given =
            [("settle_s", self.settle_s), ("journal_noise", Some(self.journal_noise).filter(|x| *x > 0.0))];
        match given.into_iter().find_map(|(name, x)| Some((name, x?))) {
            None => Ok(()),
            Some((name, x)) => Err(Error::setting(name, "a robot with clearance in its joints", x)),
        }
    }

    /// Fails if a setting would do nothing beside the others.
    pub(super) fn check_effect(&self) -> Result<(), Error> {
        let usual = SimulateSettings::default();
        let refuse = |keys: &[(&str, bool)], expected: &str, found: &str| match keys.iter().find(|k| k.1) {
            Some((key, _)) => Err(Error::setting(key, expected, found)),
            None => Ok(()),
        };
        let random = [
            ("harmonics", self.harmonics != usual.harmonics),
            ("share", self.share != usual.share),
            ("acceleration", self.acceleration != usual.acceleration),
        ];
        if self.follow.is_some() {
            let all = [
                ("duration_s", self.duration_s != usual.duration_s),
                ("period_s", self.period_s.is_some()),
                ("trajectory", !self.trajectory.is_empty()),
            ];
            let expected = "no value beside `follow`, which decides the motion";
            refuse(&[&random[..], &all].concat(), expected, "one")?;
        }
        if self.perfect {
            let all = [
                ("imperfections", self.imperfections.is_some()),
                ("effort_noise", self.effort_noise != usual.effort_noise),
                ("encoder_bits", self.encoder_bits != usual.encoder_bits),
                ("delay_samples", self.delay_samples.is_some()),
            ];
            refuse(&all, "no value beside `perfect`, which switches all imperfections off", "one")?;
        }
        if let Some(table) = &self.imperfections {
            let usual = ImperfectionTable::default();
            let expected = "a share above 0 of what it describes";
            let cycles = table.ripple_share == 0.0 && table.ripple_cycles != usual.ripple_cycles;
            let size = table.outlier_share == 0.0 && table.outlier_size != usual.outlier_size;
            refuse(
                &[("imperfections.ripple_cycles", cycles), ("imperfections.outlier_size", size)],
                expected,
                "0",
            )?;
            let noise = table.velocity_noise > 0.0
                && table.velocity_noise != usual.velocity_noise
                && !self.log_velocity;
            refuse(&[("imperfections.velocity_noise", noise)], "`log_velocity` beside it", "none")?;
        }
        self.control.iter().try_for_each(|table| {
            let usual = ControlTable::default();
            let [position, velocity] = [&table.position_gain, &table.velocity_gain].map(Option::is_some);
            let keys = [
                ("control.bandwidth_hz", position && velocity && table.bandwidth_hz != usual.bandwidth_hz),
                ("control.damping", velocity && table.damping != usual.damping),
                (
                    "control.model_error",
                    position && velocity && !table.feed_forward && table.model_error != usual.model_error,
                ),
            ];
            refuse(&keys, "gains that it decides", "`position_gain`, `velocity_gain` that are stated")
        })
    }

    /// Keys that would do nothing are slips.
    fn check_mode(&self) -> Result<(), Error> {
        if self.mode == SimulateMode::ClosedLoop {
            return Ok(());
        }
        let given = [
            ("control", self.control.is_some()),
            ("imperfections", self.imperfections.is_some()),
            ("plant", self.plant.is_some()),
            ("perfect", self.perfect),
            ("log_velocity", self.log_velocity),
        ];
        match given.iter().find(|(_, given)| *given) {
            None => Ok(()),
            Some((name, _)) => {
                Err(Error::setting(name, "mode = \"closed_loop\" beside it", "inverse dynamics"))
            }
        }
    }
}
