//! The closed loop that logs were recorded in.

use serde::{Deserialize, Serialize};

use super::{Given, refuse};
use crate::Error;

/// What the controller takes the robot for.
#[derive(Debug, Clone, Copy, Default, Deserialize, Serialize, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
pub enum NominalModel {
    /// The robot file, with bodies invented where it states none.
    #[default]
    RobotFile,
    /// The parameters that are simulated.
    Identified,
}

/// The closed loop that logs were recorded in, as a noise-free simulation runs it once more. Its reference goes with
/// the logs: channels called `reference_<joint>`, or a trajectory.
#[derive(Debug, Clone, Serialize, PartialEq)]
pub struct ClosedLoop {
    /// Whether the controller uses the velocity of the reference; else it damps the measured velocity alone. Default true.
    pub reference_velocity: bool,
    /// Ticks of the controller per second, rounded to a multiple of the log's rate. Default: the first one of at least 1000.
    pub rate_hz: Option<f64>,
    /// Natural frequency of the position loop, Hz, where gains are not stated. Default 5.
    pub bandwidth_hz: f64,
    /// Damping ratio of the position loop. Default 1.
    pub damping: f64,
    /// Position gains in joint order, N m/rad or N/m. Default: from `bandwidth_hz` and the nominal inertia.
    pub position_gain: Option<Vec<f64>>,
    /// Velocity gains in joint order, N m s/rad or N s/m. Default: as for position gains.
    pub velocity_gain: Option<Vec<f64>>,
    /// Low pass on differences of readings, Hz. Default 100.
    pub velocity_cutoff_hz: f64,
    /// Whether the effort of the nominal model along the reference is fed forward. Default false.
    pub feed_forward: bool,
    /// Nominal model of feed-forward and default gains. Default `robot-file`.
    pub nominal: NominalModel,
    /// Time from a tick to the change of effort, ticks. Default 0.
    pub delay_ticks: f64,
    /// Effort limits in joint order, N m or N. Default: those of the robot file.
    pub effort_limit: Option<Vec<f64>>,
    /// Speed over which the simulation smooths the sign of velocities, rad/s or m/s. Default 1e-4.
    pub sign_width: f64,
    /// Estimates have settled when no parameter moves by more than this share. Default 1e-4.
    pub settled: f64,
    /// Most simulations of one estimate. Default 10.
    pub max_rounds: usize,
    /// A simulation further than this from its reference has diverged, rad or m. Default 0.5.
    pub divergence: f64,
}

impl Default for ClosedLoop {
    fn default() -> Self {
        ClosedLoop {
            reference_velocity: true,
            rate_hz: None,
            bandwidth_hz: 5.0,
            damping: 1.0,
            position_gain: None,
            velocity_gain: None,
            velocity_cutoff_hz: 100.0,
            feed_forward: false,
            nominal: NominalModel::default(),
            delay_ticks: 0.0,
            effort_limit: None,
            sign_width: 1e-4,
            settled: 1e-4,
            max_rounds: 10,
            divergence: 0.5,
        }
    }
}

impl ClosedLoop {
    /// Checks that numbers make sense.
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub fn check(&self) -> Result<(), Error> {
        let positive = [
            ("rate_hz", self.rate_hz.unwrap_or(1.0)),
            ("bandwidth_hz", self.bandwidth_hz),
            ("damping", self.damping),
            ("velocity_cutoff_hz", self.velocity_cutoff_hz),
            ("sign_width", self.sign_width),
            ("settled", self.settled),
            ("divergence", self.divergence),
        ];
        for (name, x) in positive {
            if !(x.is_finite() && x > 0.0) {
                return Err(Error::setting(&format!("instruments.{name}"), "a positive number", x));
            }
        }
        if !(0.0..=1000.0).contains(&self.delay_ticks) {
            return Err(Error::setting("instruments.delay_ticks", "0 to 1000", self.delay_ticks));
        }
        if self.max_rounds == 0 {
            return Err(Error::setting("instruments.max_rounds", "at least 1", 0));
        }
        if self.feed_forward && !self.reference_velocity {
            let expected = "true with `feed_forward`, which needs the motion of the reference";
            return Err(Error::setting("instruments.reference_velocity", expected, false));
        }
        let lists = [
            ("position_gain", &self.position_gain),
            ("velocity_gain", &self.velocity_gain),
            ("effort_limit", &self.effort_limit),
        ];
        for (name, list) in lists {
            if let Some(x) = list.iter().flatten().find(|x| x.is_nan() || **x < 0.0) {
                return Err(Error::setting(&format!("instruments.{name}"), "numbers, none negative", x));
            }
        }
        Ok(())
    }

    /// Refuses settings that would do nothing beside the others.
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub fn check_effect(&self) -> Result<(), Error> {
        let usual = ClosedLoop::default();
        let set = |key, given, needs| Given { key, given, needs };
        if self.position_gain.is_some() && self.velocity_gain.is_some() {
            let needs = "gains that it decides, not both lists of gains,";
            refuse(
                "`position_gain` and `velocity_gain`",
                &[
                    set("instruments.bandwidth_hz", self.bandwidth_hz != usual.bandwidth_hz, needs),
                    set("instruments.damping", self.damping != usual.damping, needs),
                ],
            )?;
            if !self.feed_forward {
                let needs = "`feed_forward`, or gains that it decides,";
                let given = self.nominal != usual.nominal;
                refuse("`position_gain` and `velocity_gain`", &[set("instruments.nominal", given, needs)])?;
            }
        } else if self.velocity_gain.is_some() {
            let needs = "a velocity gain that it decides, no `velocity_gain`,";
            let given = self.damping != usual.damping;
            refuse("`velocity_gain`", &[set("instruments.damping", given, needs)])?;
        }
        Ok(())
    }
}
