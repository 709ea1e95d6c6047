//! What the deformation of an elastic joint tells of its stiffness.

use dynid_clearance::deformation::Verdict;
use dynid_robots::ElasticSpec;
use serde::{Deserialize, Serialize};

/// What the deformation tells.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum StiffnessVerdict {
    /// The compliance is ten standard deviations or more.
    Told,
    /// Three to ten: to be read by its interval.
    Coarse,
    /// Less than three: a lower bound of the stiffness alone.
    NotTold,
    /// Not positive, or errors once per turn change its sign.
    Sign,
    /// Zero, lag or hysteresis stand in for the load.
    Shared,
    /// The load hardly changes, nothing deforms, or the fit has left the efforts: no measurement.
    Degenerate,
}

impl From<Verdict> for StiffnessVerdict {
    fn from(verdict: Verdict) -> Self {
        match verdict {
            Verdict::Told => StiffnessVerdict::Told,
            Verdict::Coarse => StiffnessVerdict::Coarse,
            Verdict::NotTold => StiffnessVerdict::NotTold,
            Verdict::Sign => StiffnessVerdict::Sign,
            Verdict::Shared { .. } => StiffnessVerdict::Shared,
            Verdict::OtherLoad { .. } | Verdict::NoLoad | Verdict::BelowNoise { .. } => {
                StiffnessVerdict::Degenerate
            }
        }
    }
}

/// Stiffness of one joint as its deformation tells it. Angles in rad (m of joints that slide), efforts in N m (N).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct JointStiffness {
    /// Joint.
    pub joint: String,
    /// What the logs tell.
    pub verdict: StiffnessVerdict,
    /// Compliance `c = 1/k`, rad/(N m).
    pub compliance: f64,
    /// Standard deviation with correlated residuals, blocks of time left out, and errors of the encoders once per turn.
    pub compliance_std: f64,
    /// Stiffness, N m/rad; absent unless told.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stiffness: Option<f64>,
    /// Interval of two standard deviations of the compliance; absent unless told.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub interval: Option<(f64, f64)>,
    /// Lower bound of the stiffness where it is not told; absent where not even that is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stiffness_at_least: Option<f64>,
    /// What the record of the link is later than that of the motor, s, with its standard deviation.
    pub lag_s: (f64, f64),
    /// Hysteresis (half the width of its loop), rad, with its standard deviation.
    pub hysteresis: (f64, f64),
    /// Deformation of the load alone, `c` times the load that zero, lag and hysteresis leave, root mean square, rad.
    pub by_load: f64,
    /// What is left of the deformation, root mean square, rad.
    pub residual: f64,
    /// Root mean square of the load that deforms the joint, without its mean, N m.
    pub load: f64,
    /// Stiffness that the fit of the robot's rows found, N m/rad.
    pub of_rows: f64,
    /// Slope of the load that it makes of the deformation on the load of the motors' efforts: 1 where both agree.
    pub slope_of_rows: f64,
    /// Whether the spring has a cubic part, so that one stiffness is that of its middle.
    pub cubic: bool,
}

impl JointStiffness {
    /// Whether the fit of the robot's rows found a stiffness that the deformation bears out.
    pub fn is_borne_out(&self) -> bool {
        let Some(stiffness) = self.stiffness else { return false };
        let (share, deviations) = SAME;
        let off = (self.of_rows / stiffness - 1.0).abs();
        let same = self.cubic || off < share.max(deviations * self.compliance_std / self.compliance);
        same && (SLOPES.0..=SLOPES.1).contains(&self.slope_of_rows)
    }

    /// What is told of the joint, in words.
    pub fn words(&self) -> String {
        let told = match (self.stiffness, self.interval, self.stiffness_at_least) {
            (Some(k), Some((low, high)), _) => format!("{k:.3e} ({low:.3e} to {high:.3e})"),
            (_, _, Some(least)) => format!("not told, at least {least:.3e}"),
            _ => "not told".to_owned(),
        };
        format!("`{}`: {told}, link record late by {:.2} ms", self.joint, 1e3 * self.lag_s.0)
    }
}

/// An elastic joint that was taken as a stiff one.
#[derive(Debug, Clone, PartialEq)]
pub struct StiffJoint {
    /// The joint as its robot file has it.
    pub spec: ElasticSpec,
    /// Parameters whose efforts load it: those of its link's row but friction and the spring.
    pub loads: Vec<String>,
}

/// What helps where a log tells little of a spring.
pub(crate) const REMEDY: &str = "read encoders on both sides of the gear at the same times, or take the joint as stiff: leave `elastic` out of its \
                                 `[element.<joint>]` in the robot file";

/// Loads of springs over those of the efforts: outside, the rows of links have pulled the load away.
const SLOPES: (f64, f64) = (0.7, 1.4);

/// A stiffness of the rows this close to that of the deformation (relative), or this many standard deviations, is the same.
const SAME: (f64, f64) = (0.02, 3.0);
