//! Excitation design: from a robot file and limits to a trajectory, what it promises, and files that robots understand.

mod checkpoint;
mod config;
mod drives;
mod fault;
mod limits;
mod loops;
mod motion;
pub mod next;
mod problem;
mod record;
mod report;
mod safety;
mod shapes;

use std::fmt;
use std::path::Path;

use dynid_excitation::{
    Forecast, Infeasible, LimitPoint, Outcome, Settings, StartOutcome, forecast, limit_points,
};

use dynid_files::SourceFile;

pub use config::{
    BoxConfig, CapsuleConfig, ColumnConfig, ColumnsName, CriterionConfig, CriterionName, CylinderConfig,
    DesignConfig, HalfSpaceConfig, KeepConfig, LimitsConfig, MotionForm, SafetyConfig, SearchConfig,
    TrajectoryConfig,
};
use drives::Drives;
pub use drives::{BrokenBehind, FollowedJoint, FollowedRecord};
use dynid_identify::Error;
use dynid_identify::robot::{Robot, RobotOptions};
pub use fault::DesignError;
pub use motion::{DesignedMotion, LegFault, MotionPaths};
use problem::RobotProblem;
pub use record::{DesignRecord, DesignVerdict};
pub use safety::{CapsuleRecord, ExemptRecord, PlaneName, PlaneRecord, SafetyRecord};
pub use shapes::{CapsuleSource, LinkCapsule};

/// Samples of a period on which criterion and forecast are taken, with exact signs; at least 20 per harmonic.
const REPORT_SAMPLES: usize = 1000;
/// Samples of a period on which the limits are checked once more.
const CHECK_SAMPLES: usize = 100_000;

/// What is being worked on.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum DesignStep {
    /// Reading the robot, finding base parameters.
    Structure,
    /// Starts have ended.
    Starts {
        /// How many.
        ended: usize,
        /// Of how many.
        of: usize,
        /// Best criterion so far, if any start met all limits.
        best: Option<f64>,
    },
    /// Looking for the shortest motion: what was found at a speed.
    Length {
        /// Highest frequency of the motion, Hz.
        highest_hz: f64,
        /// Time after which it reaches all that is wanted, s; `None`: not within ten thousand times its own.
        needed_s: Option<f64>,
    },
    /// Going on within smaller limits, since drives lead the robot beyond them.
    Within {
        /// Which time, from 1.
        round: usize,
    },
    /// Predicting what the log will tell.
    Forecast,
}

impl fmt::Display for DesignStep {
    /// What is being done; of starts how good the best is.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            DesignStep::Structure => f.write_str("finding base parameters"),
            DesignStep::Starts { best: Some(best), .. } => write!(f, "starts, best {best:.4}"),
            DesignStep::Starts { best: None, .. } => f.write_str("starts, none within all limits yet"),
            DesignStep::Length { highest_hz, needed_s: Some(needed_s) } => {
                write!(f, "motion up to {highest_hz:.2} Hz: {needed_s:.1} s needed")
            }
            DesignStep::Length { highest_hz, needed_s: None } => {
                write!(f, "motion up to {highest_hz:.2} Hz: no length is enough")
            }
            DesignStep::Within { round } => {
                write!(f, "drives lead the robot beyond its limits: search {round} within smaller ones")
            }
            DesignStep::Forecast => f.write_str("predicting what the log will tell"),
        }
    }
}

/// A design that has been run.
pub struct DesignRun {
    robot: Robot,
    drives: Option<Drives>,
    set: RobotProblem,
    /// All starts that ran, by seed.
    pub starts: Vec<StartOutcome>,
    /// The trajectory, or why there is none.
    pub outcome: Result<DesignedTrajectory, Infeasible>,
}

/// The best trajectory.
#[derive(Debug)]
pub struct DesignedTrajectory {
    /// Fourier coefficients `[q0, a.., b..]` per joint, plain amplitudes.
    pub coefficients: Vec<Vec<f64>>,
    /// Index of the best start.
    pub best: usize,
    /// What the log will tell.
    pub forecast: Forecast,
    /// Limits broken by more than 1e-6 of themselves on a fine check of the period: none, or a fault of the program.
    pub broken: Vec<LimitPoint>,
    /// For every limit its instant of largest use.
    pub uses: Vec<LimitPoint>,
    /// Approach, periods and return.
    pub motion: DesignedMotion,
    /// Where the drives lead the robot, of designs for logs without efforts.
    pub followed: Option<FollowedRecord>,
}

/// Designs an excitation trajectory.
///
/// `progress` hears of every step. Results do not depend on the number of threads; with a time budget the number of starts
/// depends on the machine.
///
/// # Errors
/// [`Error`] for bad input. A problem without a solution is an [`Infeasible`] outcome.
pub fn design(config: &DesignConfig, progress: &mut dyn FnMut(DesignStep)) -> Result<DesignRun, Error> {
    config.check()?;
    progress(DesignStep::Structure);
    let (robot, drives) = match drives::load(config)? {
        Some((robot, drives)) => (robot, Some(drives)),
        None => (load(config)?, None),
    };
    let mut set = match &drives {
        Some(drives) => drives.problem(&robot, config)?,
        None => problem::problem(&robot, config)?,
    };
    let parking = problem::pose(&set, config)?;
    let mut file = Checkpointing::open(config, &set.safety.meshes)?;
    let settings = Settings {
        starts: config.search.starts,
        seed: config.search.seed,
        time_budget_s: config.search.time_budget_s,
        report_samples: report_samples(config),
        from: None,
    };
    let mut ended = 0;
    let mut best: Option<f64> = None;
    let done = std::mem::take(&mut file.starts);
    for start in &done {
        file.push(start)?;
    }
    let mut fault = None;
    let outcome = dynid_excitation::design(&set.problem, &settings, done, &mut |start| {
        ended += 1;
        if start.is_feasible() {
            best = [best, start.criterion].into_iter().flatten().reduce(f64::min);
        }
        progress(DesignStep::Starts { ended, of: settings.starts, best });
        if fault.is_none() {
            fault = file.push(start).err();
        }
    })
    .map_err(DesignError::from)?;
    if let Some(fault) = fault {
        return Err(fault);
    }
    let outcome = match (&drives, outcome) {
        (Some(drives), Outcome::Found(found)) => {
            let mut again = |round| progress(DesignStep::Within { round });
            Outcome::Found(drives.within(&mut set.problem, &settings, found, &mut again)?)
        }
        (_, outcome) => outcome,
    };
    finished((robot, drives), set, config, outcome, parking.as_deref(), progress)
}

/// The robot of a configuration.
fn load(config: &DesignConfig) -> Result<Robot, Error> {
    let options = RobotOptions {
        gravity: config.gravity,
        couple_mimics: config.couple_mimics,
        floating_base: false,
        locked: config.locked.iter().map(|(j, q)| (j.clone(), *q)).collect(),
    };
    Robot::load(&config.robot, &options)
}

/// A design from what its search found.
fn finished(
    (robot, drives): (Robot, Option<Drives>),
    set: RobotProblem,
    config: &DesignConfig,
    outcome: Outcome,
    parking: Option<&[f64]>,
    progress: &mut dyn FnMut(DesignStep),
) -> Result<DesignRun, Error> {
    let (starts, outcome) = match outcome {
        Outcome::Infeasible(infeasible) => (Vec::new(), Err(infeasible)),
        Outcome::Found(found) => {
            progress(DesignStep::Forecast);
            let (coefficients, samples) = (found.coefficients, report_samples(config));
            let (forecast, followed) = match &drives {
                Some(drives) => {
                    let (forecast, followed) = drives.forecast(&set.problem, &coefficients, samples)?;
                    (forecast, Some(followed))
                }
                None => (forecast(&set.problem, &coefficients, samples), None),
            };
            let forecast = forecast.ok_or_else(|| {
                let limited =
                    if drives.is_some() { ", or the drives are at their effort limits" } else { "" };
                Error::Unsupported(format!("the designed trajectory leaves parameters unseen{limited}"))
            })?;
            let motion = DesignedMotion::new(&set, config, &coefficients, parking)?;
            let designed = DesignedTrajectory {
                best: found.best,
                forecast,
                broken: limit_points(&set.problem, &coefficients, CHECK_SAMPLES, 1e-6),
                uses: limit_points(&set.problem, &coefficients, samples, f64::NEG_INFINITY),
                motion,
                coefficients,
                followed,
            };
            (found.starts, Ok(designed))
        }
    };
    Ok(DesignRun { robot, drives, set, starts, outcome })
}

/// Samples of a period on which criterion and forecast are taken.
fn report_samples(config: &DesignConfig) -> usize {
    REPORT_SAMPLES.max(20 * config.form().harmonics)
}

impl DesignRun {
    /// What the drives are told at the samples of the motion, approach and return included, in the numbers of their encoders: joint after joint.
    /// `None` without drives, or without a trajectory.
    ///
    /// # Errors
    /// [`Error::Trajectory`] if there are too many samples.
    pub fn commands(&self) -> Result<Option<Vec<Vec<f64>>>, Error> {
        let (Some(drives), Ok(designed)) = (&self.drives, &self.outcome) else { return Ok(None) };
        Ok(Some(drives.told(&designed.motion.sampled()?.q)))
    }

    /// Writes [`DesignRun::commands`] with their times; nothing where there are none.
    ///
    /// # Errors
    /// [`Error::Trajectory`] if there are too many samples, [`Error::Output`].
    pub fn write_commands(&self, path: &Path) -> Result<(), Error> {
        let (Some(told), Ok(designed)) = (self.commands()?, &self.outcome) else { return Ok(()) };
        let sampled = designed.motion.sampled()?;
        Ok(dynid_logs::trajectory::write_commands(path, &designed.motion.joints, &sampled.time, &told)?)
    }

    /// Capsules about the links of the robot, as they are kept apart and above the floor; none if both are turned off.
    pub fn capsules(&self) -> &[LinkCapsule] {
        &self.set.safety.capsules
    }

    /// Ends of all capsules at `count` instants spread evenly over a period of a designed trajectory: `[instant][capsule]`, two
    /// points in base axes each, m. Empty without a trajectory.
    pub fn capsule_poses(&self, count: usize) -> Result<Vec<Vec<[[f64; 3]; 2]>>, Error> {
        let Ok(designed) = &self.outcome else { return Ok(Vec::new()) };
        motion::capsule_poses(&self.set, &designed.coefficients, count)
    }

    /// A random motion within the same limits, as long as the designed one, without approach and return; `None` if none is
    /// found.
    ///
    /// # Errors
    /// [`Error::Trajectory`].
    pub fn random_motion(&self, config: &DesignConfig, seed: u64) -> Result<Option<DesignedMotion>, Error> {
        match dynid_excitation::random_trajectory(&self.set.problem, seed) {
            Some(coefficients) => DesignedMotion::new(&self.set, config, &coefficients, None).map(Some),
            None => Ok(None),
        }
    }
}

/// The checkpoint file of a run, if one is wanted.
struct Checkpointing<'a> {
    path: Option<&'a Path>,
    fingerprint: String,
    starts: Vec<StartOutcome>,
}

impl<'a> Checkpointing<'a> {
    fn open(config: &'a DesignConfig, meshes: &[SourceFile]) -> Result<Self, Error> {
        let path = config.search.checkpoint.as_deref();
        let fingerprint = checkpoint::fingerprint(config, meshes)?;
        let starts = match path {
            Some(path) => checkpoint::read(path, &fingerprint)?,
            None => Vec::new(),
        };
        Ok(Checkpointing { path, fingerprint, starts })
    }

    fn push(&mut self, start: &StartOutcome) -> Result<(), Error> {
        // What a time budget cut short is done again by the next run.
        if start.cut {
            return Ok(());
        }
        self.starts.push(start.clone());
        self.starts.sort_by_key(|s| s.seed);
        match self.path {
            Some(path) => checkpoint::write(path, &self.fingerprint, &self.starts),
            None => Ok(()),
        }
    }
}
