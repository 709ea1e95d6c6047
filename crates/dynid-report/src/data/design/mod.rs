//! What a report of a designed trajectory is made of; the conventions are those of [`crate::ReportData`].

mod forecast;
mod limits;
mod motion;
mod starts;

pub use forecast::{
    ConfoundedPair, DesignParameter, DesignQuality, IntervalForecast, ParameterShare, RandomMotion,
};
pub use limits::{LimitUse, Obstacle, Shape};
pub use motion::{DesignJoint, FramePath, JointMotion, Trajectory};
pub use starts::{DesignStart, Starts};

use serde::Serialize;

use super::{Fact, Provenance, Robot, RobotPicture, Verdict, Warning};

/// Everything the report of one designed trajectory shows.
///
/// Every list may be empty and every `Option` `None`: its section then says so or is left out, its number is printed
/// as `-`; a verdict that fails with a headline, without parameters, leaves out what a trajectory would have told. [`Default`] gives an empty
/// report. A list documented "per joint" has one entry per entry of
/// [`DesignReport::joints`], in that order, or is empty.
///
/// # Example
///
/// ```
/// use dynid_report::{
///     DesignJoint, DesignParameter, DesignReport, DesignStart, FramePath, JointMotion, LimitUse, Obstacle, Shape,
///     Starts, Status, Trajectory, Verdict, render_design,
/// };
///
/// let time_s: Vec<f64> = (0..=100).map(|k| 0.05 * f64::from(k)).collect();
/// let of_time = |f: &dyn Fn(f64) -> f64| time_s.iter().map(|t| f(*t)).collect::<Vec<f64>>();
/// let report = DesignReport {
///     title: "Excitation for demo-arm".into(),
///     verdict: Verdict {
///         status: Status::Ok,
///         headline: "All limits hold at every instant".into(),
///         ..Verdict::default()
///     },
///     criterion: "relative standard deviations".into(),
///     period_s: Some(5.0),
///     seed: Some(1),
///     parameters: vec![DesignParameter {
///         name: "Izz1".into(),
///         unit: "kg m^2".into(),
///         nominal: Some(0.8),
///         std: Some(0.004),
///         relative_std_percent: Some(0.5),
///     }],
///     limits: vec![LimitUse {
///         kind: "velocity".into(),
///         subject: "joint_1".into(),
///         use_percent: Some(62.8),
///         at_s: Some(0.0),
///         ..LimitUse::default()
///     }],
///     joints: vec![DesignJoint {
///         name: "joint_1".into(),
///         unit: "rad".into(),
///         effort_unit: "N m".into(),
///         velocity: Some(1.0),
///         ..DesignJoint::default()
///     }],
///     trajectory: Some(Trajectory {
///         joints: vec![JointMotion {
///             q: of_time(&|t| 0.5 * (1.2566 * t).sin()),
///             dq: of_time(&|t| 0.6283 * (1.2566 * t).cos()),
///             ddq: of_time(&|t| -0.7896 * (1.2566 * t).sin()),
///             jerk: None,
///             effort: None,
///         }],
///         recorded_s: Some([0.0, 5.0]),
///         frames: vec![FramePath {
///             name: "tool".into(),
///             xyz_m: time_s.iter().map(|t| [0.5 * t.cos(), 0.5 * t.sin(), 0.3]).collect(),
///         }],
///         time_s,
///     }),
///     obstacles: vec![Obstacle {
///         name: "floor".into(),
///         frames: Vec::new(),
///         shape: Shape::HalfSpace { normal: [0.0, 0.0, 1.0], offset_m: 0.05 },
///     }],
///     starts: Starts {
///         asked: Some(1),
///         near_best: Some(32.6),
///         outcomes: vec![DesignStart { seed: 1, criterion: Some(31.0), feasible: true }],
///     },
///     ..DesignReport::default()
/// };
/// assert!(render_design(&report)?.contains("All limits hold at every instant"));
/// # Ok::<(), dynid_report::ReportError>(())
/// ```
#[derive(Clone, Debug, Default, Serialize)]
pub struct DesignReport {
    /// Title of the page, e.g. `Excitation for indy7`.
    pub title: String,
    /// The result in plain words, e.g. `All limits hold at every instant; criterion 28.4`.
    pub verdict: Verdict,
    /// What the reader should know before running the trajectory.
    pub warnings: Vec<Warning>,
    /// The mechanism.
    pub robot: Robot,
    /// Name of the criterion, e.g. `relative standard deviations (A-optimal)`.
    pub criterion: String,
    /// What the criterion means, a sentence or two; smaller is better.
    pub criterion_meaning: String,
    /// Period of the motion, s.
    pub period_s: Option<f64>,
    /// Harmonics of the Fourier series.
    pub harmonics: Option<u64>,
    /// Periods to record.
    pub periods_recorded: Option<u64>,
    /// Duration of the approach to the first recorded pose, s.
    pub approach_s: Option<f64>,
    /// Duration of the return after the last recorded pose, s.
    pub return_s: Option<f64>,
    /// Rate at which the trajectory was written, Hz.
    pub sample_rate_hz: Option<f64>,
    /// Evaluations of criterion and limits, all starts together.
    pub evaluations: Option<u64>,
    /// Seed of the first start.
    pub seed: Option<u64>,
    /// Further facts: form of the start, noise levels, files written, ...
    pub facts: Vec<Fact>,
    /// Criterion and condition of the designed trajectory.
    pub quality: DesignQuality,
    /// Criterion and condition of random motion within the same limits; `None` if none was found or tried.
    pub random: Option<RandomMotion>,
    /// Intervals of a motion that is to be recorded beside logs, those that are wanted first; empty for other designs.
    pub intervals: Vec<IntervalForecast>,
    /// Parameters and how well the log will show them, in the order of the table.
    pub parameters: Vec<DesignParameter>,
    /// Pairs that the log will hardly tell apart, worst first.
    pub confounded: Vec<ConfoundedPair>,
    /// Parameters that carry the combination seen least, with their shares, largest first.
    pub seen_least: Vec<ParameterShare>,
    /// Every limit with its largest use.
    pub limits: Vec<LimitUse>,
    /// The actuated joints with their limits.
    pub joints: Vec<DesignJoint>,
    /// The motion to draw; `None` leaves out plots and paths.
    pub trajectory: Option<Trajectory>,
    /// The robot on its way through the trajectory; `None` leaves the picture out.
    pub picture: Option<RobotPicture>,
    /// What the paths of frames keep away from or stay within.
    pub obstacles: Vec<Obstacle>,
    /// Ends of the search's starts.
    pub starts: Starts,
    /// What is needed to repeat the run.
    pub provenance: Provenance,
}
