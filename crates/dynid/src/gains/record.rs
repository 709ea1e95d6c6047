//! What is found of drive gains, and its file.

use dynid_record::Status;
use serde::{Deserialize, Serialize};

use super::GainIdentification;
use crate::estimate::{Provenance, SCHEMA};

/// t-value of `1/g` above which a gain is determined.
pub(super) const LEAST_T: f64 = 5.0;
/// Share of the load column that must be left after projection on all others.
pub(super) const LEAST_SHARE: f64 = 0.01;

/// The gain of one drive.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct JointGain {
    /// Joint.
    pub joint: String,
    /// Unit, effort per unit of the logged column.
    pub unit: String,
    /// The gain that the configuration states, `scale` of the effort columns; 1 where none is stated.
    pub stated: f64,
    /// Drive gain by the inverse form; absent unless it is determined.
    pub gain: Option<f64>,
    /// Standard deviation of the gain, that of the mass included.
    pub std: Option<f64>,
    /// 95 % interval.
    pub interval: Option<(f64, f64)>,
    /// t-value of `1/g` (jackknife); 0 where the load has no column.
    pub t: f64,
    /// Share of the load column that is left after projection on all others.
    pub share: f64,
    /// Gain by least squares with the current as a column; biased by its noise.
    pub plain_least_squares: Option<f64>,
    /// Gain by total least squares, all columns of unit length taken for equally noisy.
    pub total_least_squares: Option<f64>,
    /// `determined`, or why not.
    pub verdict: String,
}

impl JointGain {
    pub(super) fn without(joint: &str, unit: &str, stated: f64) -> Self {
        JointGain {
            joint: joint.to_owned(),
            unit: format!("{unit}/A"),
            stated,
            gain: None,
            std: None,
            interval: None,
            t: 0.0,
            share: 0.0,
            plain_least_squares: None,
            total_least_squares: None,
            verdict: "the load does not act on this joint".to_owned(),
        }
    }

    /// Takes up `h = stated/gain` with its standard deviation. `mass`: relative standard deviation of the mass; `quantile`:
    /// half width of an interval in standard deviations.
    pub(super) fn found(&mut self, stated: f64, h: f64, std: f64, mass: f64, quantile: f64) {
        self.t = if std > 0.0 { h.abs() / std } else { 0.0 };
        if self.share < LEAST_SHARE {
            return;
        }
        if self.t <= LEAST_T {
            self.verdict = format!("the load acts on this joint too weakly: t = {:.1}", self.t);
            return;
        }
        let gain = stated / h;
        let std = gain.abs() * (std / h).hypot(mass);
        self.gain = Some(gain);
        self.std = Some(std);
        self.interval = Some((gain - quantile * std, gain + quantile * std));
        self.verdict = "determined".to_owned();
    }
}

/// The output of `dynid gains --json`.
#[derive(Debug, Clone, Serialize, Deserialize, schemars::JsonSchema)]
pub struct GainsFile {
    /// Layout version.
    pub schema: u32,
    /// Robot.
    pub robot: String,
    /// Payload.
    pub payload: String,
    /// Mass of the payload, kg.
    pub mass: f64,
    /// What is known of it besides.
    pub known: String,
    /// Drives.
    pub joints: Vec<JointGain>,
    /// Time blocks behind the standard deviations.
    pub blocks: usize,
    /// Variance inflation by coloured residuals.
    pub variance_inflation: f64,
    /// `ok` if a drive at least is determined, else `fail`.
    pub status: Status,
    /// Warnings.
    pub warnings: Vec<String>,
    /// Inputs and settings.
    pub provenance: Provenance,
}

impl GainIdentification {
    /// The result in full.
    pub fn file(&self) -> GainsFile {
        let p = &self.payload;
        let known = match (p.com, p.inertia) {
            (Some(_), Some(_)) => "mass, centre of mass and inertia",
            (Some(_), None) => "mass and centre of mass; its inertia has columns of its own",
            _ => "mass alone; its centre of mass and inertia have columns of their own",
        };
        let determined = self.joints.iter().any(|j| j.gain.is_some());
        GainsFile {
            schema: SCHEMA,
            robot: self.robot.clone(),
            payload: p.name.clone(),
            mass: p.mass.unwrap_or_default(),
            known: known.to_owned(),
            joints: self.joints.clone(),
            blocks: self.fitted.estimate.blocks.len(),
            variance_inflation: self.fitted.inflation,
            status: if determined { Status::Ok } else { Status::Fail },
            warnings: self.warnings.clone(),
            provenance: self.provenance.clone(),
        }
    }
}
