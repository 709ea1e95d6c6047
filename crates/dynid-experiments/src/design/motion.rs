//! The whole motion of a design: approach, recorded periods, return.

use dynid_excitation::LimitKind;
use dynid_excitation::constraint::{ConstraintError, PathConstraint};
use dynid_files::OutputError;
use dynid_identify::Error;
use dynid_logs::TrajectoryFile;
use dynid_logs::trajectory::{Leg, Playback, TrajectoryJoint};
use dynid_model::{BodyPoint, Dynamics, MotionBlock};
use dynid_motion::trajectory::{Form, FourierTrajectory, Phase, RowOrder, Sampled, Sequence};

use super::DesignError;
use super::config::DesignConfig;
use super::loops;
use super::problem::RobotProblem;
use super::shapes::LinkCapsule;

/// Samples of approach and return at which efforts and distances are checked.
const CHECKS: usize = 500;
/// Approach and return are made longer by this factor until efforts are within their limits ..
const SLOWER: f64 = 1.25;
/// .. at most so often.
const ATTEMPTS: usize = 12;

/// A limit that approach or return breaks.
#[derive(Debug, Clone, PartialEq)]
pub struct LegFault {
    /// What is limited.
    pub kind: LimitKind,
    /// Whose.
    pub subject: String,
    /// `approach` or `return`.
    pub phase: &'static str,
    /// Largest excess, in units of the limit.
    pub excess: f64,
    /// What one such unit is: size and unit; of coordinates their limit itself.
    pub scale: Option<(f64, &'static str)>,
}

/// Approach, periods and return of a design.
#[derive(Debug)]
pub struct DesignedMotion {
    /// Joints.
    pub joints: Vec<String>,
    /// The motion as written to files.
    pub file: TrajectoryFile,
    /// All of it.
    pub sequence: Sequence,
    /// Rate of samples, Hz.
    pub rate_hz: f64,
    /// Limits that approach or return break: their path is straight in joint space, and no slowness mends that.
    pub leg_faults: Vec<LegFault>,
}

impl DesignedMotion {
    pub(super) fn new(
        set: &RobotProblem,
        config: &DesignConfig,
        coefficients: &[Vec<f64>],
        parking: Option<&[f64]>,
    ) -> Result<Self, Error> {
        let (t, rate_hz) = (&config.trajectory, config.form().sample_rate_hz);
        let problem = &set.problem;
        let order = RowOrder::default();
        let record =
            || FourierTrajectory::from_rows(problem.base, Form::Plain, &order, coefficients, t.periods);
        let mut file = TrajectoryFile {
            robot: Some(config.robot.display().to_string()),
            form: Form::Plain,
            joints: problem
                .coordinates
                .iter()
                .zip(set.model.joints())
                .map(|(name, info)| TrajectoryJoint { name: Some(name.clone()), slides: info.slides })
                .collect(),
            motion: record()?,
            approach: None,
            back: None,
            sample_rate_hz: Some(rate_hz),
        };
        let Some(parking) = parking else {
            let sequence = file.sequence()?;
            return Ok(Self::of(set, file, sequence, rate_hz, Vec::new()));
        };
        let shortest = Sequence::parked(parking, Box::new(record()?), &problem.limits)?;
        let length = |phase: Phase| shortest.span(phase).map_or(0.0, |s| s.end - s.start);
        let (mut approach, mut back) = (length(Phase::Approach), length(Phase::Return));
        let mut faults = Vec::new();
        // The last sample is that of the end: a sampled motion comes to rest.
        let on_grid = |end: f64| (end * rate_hz - 1e-6).ceil() / rate_hz;
        let recorded = length(Phase::Record);
        for _ in 0..ATTEMPTS {
            let coming = on_grid(approach);
            let going = on_grid(coming + recorded + back) - (coming + recorded);
            file.approach = Some(Leg { pose: parking.to_vec(), duration_s: coming });
            file.back = Some(Leg { pose: parking.to_vec(), duration_s: going });
            let sequence = file.sequence()?;
            let found = leg_faults(set, &sequence);
            // Slowness helps efforts only, and only as long as it makes a difference.
            let helps = |f: &LegFault| {
                let before = faults.iter().find(|b: &&LegFault| b.subject == f.subject && b.phase == f.phase);
                matches!(f.kind, LimitKind::Path(dynid_excitation::constraint::ConstraintKind::Effort))
                    && before.is_none_or(|b| f.excess < 0.98 * b.excess)
            };
            let slower = |phase: &str| found.iter().any(|f| f.phase == phase && helps(f));
            let (longer_approach, longer_back) =
                (slower(Phase::Approach.name()), slower(Phase::Return.name()));
            if !longer_approach && !longer_back {
                return Ok(Self::of(set, file, sequence, rate_hz, found));
            }
            approach *= if longer_approach { SLOWER } else { 1.0 };
            back *= if longer_back { SLOWER } else { 1.0 };
            faults = found;
        }
        let sequence = file.sequence()?;
        Ok(Self::of(set, file, sequence, rate_hz, faults))
    }

    fn of(
        set: &RobotProblem,
        file: TrajectoryFile,
        sequence: Sequence,
        rate_hz: f64,
        leg_faults: Vec<LegFault>,
    ) -> Self {
        DesignedMotion { joints: set.problem.coordinates.clone(), file, sequence, rate_hz, leg_faults }
    }

    /// Samples at the rate.
    ///
    /// # Errors
    /// [`Error::Trajectory`] if there are too many.
    pub fn sampled(&self) -> Result<Sampled, Error> {
        Ok(Sampled::at_rate(&self.sequence, self.rate_hz)?)
    }

    /// Writes the motion: coefficients (`.json`), samples (`.csv`), ROS 2 messages (`.ros2.yaml`, `.ros2.json`), each
    /// beside its place and renamed. `stem`: path without these endings.
    ///
    /// # Errors
    /// [`Error::Output`], [`Error::Trajectory`].
    pub fn write(&self, paths: &MotionPaths) -> Result<(), Error> {
        let sampled = self.sampled()?;
        let phases: Vec<Phase> = sampled.time.iter().map(|t| self.sequence.phase(*t)).collect();
        let output = |e: OutputError| Error::Output(e);
        self.file.write(&paths.coefficients).map_err(output)?;
        dynid_logs::trajectory::write_csv(&paths.samples, &self.joints, &sampled, Some(&phases))
            .map_err(output)?;
        dynid_logs::trajectory::write_ros_yaml(&paths.ros_yaml, &self.joints, &sampled).map_err(output)?;
        dynid_logs::trajectory::write_ros_json(&paths.ros_json, &self.joints, &sampled).map_err(output)
    }

    /// The motion as a file for what plays it; `file` stands in errors.
    ///
    /// # Errors
    /// [`Error::Trajectory`] if there are too many samples; [`Error::Output`] with what cannot be played.
    pub fn playback(&self, format: Playback, file: &std::path::Path) -> Result<String, Error> {
        let sampled = Sampled::at_rate(&self.sequence, format.rate_hz(self.rate_hz))?;
        format.text(file, &self.joints, &sampled).map_err(Error::Output)
    }
}

/// Ends of all capsules at instants spread evenly over a period, `[instant][capsule]`, base axes, m.
pub(super) fn capsule_poses(
    set: &RobotProblem,
    coefficients: &[Vec<f64>],
    count: usize,
) -> Result<Vec<Vec<[[f64; 3]; 2]>>, Error> {
    let mechanism = set.model.mechanism();
    let mut points = Vec::new();
    for LinkCapsule { capsule, .. } in &set.safety.capsules {
        let frame =
            mechanism.frame(&capsule.frame).map_err(ConstraintError::from).map_err(DesignError::from)?;
        for end in capsule.ends {
            let position = frame.placement.rotation.mul_vec(end) + frame.placement.translation;
            points.push(BodyPoint { body: frame.body, position });
        }
    }
    let base = set.problem.base;
    let record = FourierTrajectory::from_rows(base, Form::Plain, &RowOrder::default(), coefficients, 1)?;
    let period = record.period();
    let times = (0..count).map(|k| period * k as f64 / count as f64).collect();
    let sampled = Sampled::at_times(&record, times);
    let block = MotionBlock::plain(count, &sampled.q, &sampled.dq, &sampled.ddq);
    let mut places = vec![0.0; 3 * points.len() * count];
    loops::with_all_joints(set.poses.as_ref(), &block, |all| {
        Dynamics::new(mechanism).points(all, &points, count, &mut places);
    });
    let at = |p: usize, s: usize| [0, 1, 2].map(|c| places[(3 * p + c) * count + s]);
    let pose = |s| (0..points.len() / 2).map(|k| [at(2 * k, s), at(2 * k + 1, s)]).collect();
    Ok((0..count).map(pose).collect())
}

/// Where a motion is written.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionPaths {
    /// Coefficients, JSON.
    pub coefficients: std::path::PathBuf,
    /// Samples, CSV.
    pub samples: std::path::PathBuf,
    /// `trajectory_msgs/JointTrajectory` as YAML.
    pub ros_yaml: std::path::PathBuf,
    /// The message `JointTrajectory` as JSON.
    pub ros_json: std::path::PathBuf,
}

/// Path limits that approach and return break, one entry per limit and phase.
fn leg_faults(set: &RobotProblem, sequence: &Sequence) -> Vec<LegFault> {
    let mut faults = Vec::new();
    for phase in [Phase::Approach, Phase::Return] {
        let Some(span) = sequence.span(phase) else { continue };
        let step = (span.end - span.start) / (CHECKS - 1) as f64;
        let times = (0..CHECKS).map(|k| span.start + step * k as f64).collect();
        let sampled = Sampled::at_times(sequence, times);
        let block = MotionBlock {
            samples: CHECKS,
            stride: CHECKS,
            q: &sampled.q,
            dq: &sampled.dq,
            ddq: &sampled.ddq,
            gravity: None,
            channels: &[],
            sign_width: set.problem.sign_width,
        };
        for constraint in &set.problem.constraints {
            faults.extend(broken(constraint.as_ref(), &block, phase));
        }
    }
    faults
}

fn broken(constraint: &dyn PathConstraint, block: &MotionBlock<'_>, phase: Phase) -> Vec<LegFault> {
    let rows = constraint.rows();
    let mut values = vec![0.0; rows.len() * block.samples];
    constraint.values(block, block.samples, &mut values);
    rows.iter()
        .zip(values.chunks_exact(block.samples))
        .filter_map(|(row, values)| {
            let excess =
                values.iter().map(|x| (x - row.upper).max(row.lower - x)).fold(f64::NEG_INFINITY, f64::max);
            (excess > 1e-6).then(|| LegFault {
                kind: LimitKind::Path(row.kind),
                subject: row.subject.clone(),
                phase: phase.name(),
                excess,
                scale: Some((row.scale, row.unit)),
            })
        })
        .collect()
}
