//! Keys of instrumental variables: reference and controller of the recorded motion.

use std::collections::BTreeMap;
use std::path::PathBuf;

use dynid_identify::Error;
use dynid_identify::closed_loop::reference_channel;
use dynid_identify::settings::{ClosedLoop, Given, NominalModel, refuse};
use dynid_logs::MappingSpec;
use dynid_logs::columns::ChannelSpec;
use serde::{Deserialize, Serialize};

use super::LogConfig;

/// Columns of the reference.
#[derive(Debug, Clone, Deserialize, Serialize, PartialEq)]
#[serde(untagged, expecting = "a pattern such as \"qref{}\", a list of columns, or a table joint -> column")]
pub enum ReferenceColumns {
    /// A pattern: `{}` is the number of the joint, from 1, `{joint}` its name.
    Pattern(String),
    /// One column per joint in joint order; an empty one: not logged.
    List(Vec<String>),
    /// Joint to column.
    Table(BTreeMap<String, String>),
}

/// The closed loop that logs were recorded in, as a noise-free simulation runs it once more.
#[derive(Debug, Clone, Deserialize, Serialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct InstrumentsConfig {
    /// Columns of the reference position. Default: channels called `reference_<joint>`, else a trajectory file.
    pub reference: Option<ReferenceColumns>,
    /// Radians or metres per unit of these columns. Default 1.
    pub reference_scale: f64,
    /// Trajectory file of the reference, relative to the configuration; it starts with the first row of each log. Default: the
    /// trajectory that the log states, which starts with its record.
    pub trajectory: Option<PathBuf>,
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

impl Default for InstrumentsConfig {
    fn default() -> Self {
        InstrumentsConfig {
            reference: None,
            reference_scale: 1.0,
            trajectory: None,
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

impl InstrumentsConfig {
    /// Lets logs be read with the columns of the reference as channels.
    ///
    /// # Errors
    /// [`Error::Setting`] for a list of another length or a table with unknown joints.
    pub fn read_reference(
        &self,
        logs: &mut [LogConfig],
        run_columns: &MappingSpec,
        joints: &[String],
    ) -> Result<(), Error> {
        let Some(columns) = &self.reference else { return Ok(()) };
        let stated = self.columns_of(columns, joints)?;
        for log in logs {
            let spec = log.columns.get_or_insert_with(|| run_columns.clone());
            for (joint, column) in &stated {
                let channel =
                    ChannelSpec { column: column.clone(), scale: self.reference_scale, offset: 0.0 };
                spec.channels.insert(reference_channel(joint), channel);
            }
        }
        Ok(())
    }

    fn columns_of(
        &self,
        columns: &ReferenceColumns,
        joints: &[String],
    ) -> Result<Vec<(String, String)>, Error> {
        let setting =
            |expected: &str, found: String| Error::setting("instruments.reference", expected, found);
        Ok(match columns {
            ReferenceColumns::Pattern(pattern) => {
                if joints.len() > 1 && !pattern.contains("{}") && !pattern.contains("{joint}") {
                    return Err(setting("a pattern with `{}` or `{joint}`", format!("`{pattern}`")));
                }
                let name = |(k, joint): (usize, &String)| {
                    let column = pattern.replace("{}", &(k + 1).to_string()).replace("{joint}", joint);
                    (joint.clone(), column)
                };
                joints.iter().enumerate().map(name).collect()
            }
            ReferenceColumns::List(list) if list.len() == joints.len() => {
                let named = joints.iter().zip(list).filter(|(_, column)| !column.is_empty());
                named.map(|(joint, column)| (joint.clone(), column.clone())).collect()
            }
            ReferenceColumns::List(list) => {
                return Err(setting(&format!("{} columns", joints.len()), list.len().to_string()));
            }
            ReferenceColumns::Table(table) => {
                if let Some(name) = table.keys().find(|name| !joints.contains(name)) {
                    return Err(Error::UnknownJoint { name: name.clone(), known: joints.to_vec() });
                }
                table.iter().map(|(joint, column)| (joint.clone(), column.clone())).collect()
            }
        })
    }

    /// Checks that numbers make sense.
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub(super) fn check(&self) -> Result<(), Error> {
        if !(self.reference_scale.is_finite() && self.reference_scale != 0.0) {
            let expected = "a finite number that is not zero";
            return Err(Error::setting("instruments.reference_scale", expected, self.reference_scale));
        }
        self.closed_loop().check()
    }

    /// Refuses settings that would do nothing beside the others.
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub(super) fn check_effect(&self) -> Result<(), Error> {
        let usual = InstrumentsConfig::default();
        let set = |key, given, needs| Given { key, given, needs };
        if self.reference.is_none() {
            let given = self.reference_scale != usual.reference_scale;
            refuse(
                "none",
                &[set("instruments.reference_scale", given, "`reference`, the columns that it scales,")],
            )?;
        } else {
            let given = self.trajectory.is_some();
            refuse(
                "`reference`, which takes its place",
                &[set("instruments.trajectory", given, "no columns of the reference")],
            )?;
        }
        self.closed_loop().check_effect()
    }

    /// The closed loop without what is read from files.
    pub fn closed_loop(&self) -> ClosedLoop {
        ClosedLoop {
            reference_velocity: self.reference_velocity,
            rate_hz: self.rate_hz,
            bandwidth_hz: self.bandwidth_hz,
            damping: self.damping,
            position_gain: self.position_gain.clone(),
            velocity_gain: self.velocity_gain.clone(),
            velocity_cutoff_hz: self.velocity_cutoff_hz,
            feed_forward: self.feed_forward,
            nominal: self.nominal,
            delay_ticks: self.delay_ticks,
            effort_limit: self.effort_limit.clone(),
            sign_width: self.sign_width,
            settled: self.settled,
            max_rounds: self.max_rounds,
            divergence: self.divergence,
        }
    }
}
