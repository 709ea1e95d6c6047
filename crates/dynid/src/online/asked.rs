//! What a session is asked for, translated once from a configuration.

use crate::Error;
use crate::config::{Config, MotorSide, OnlineConfig};
use crate::elements::{ElementPlan, REACTION_FRICTION};
use crate::robot::{Robot, refuse_internal_load};
use crate::settings::{Clearance, Settings};

/// What a session is asked for.
#[derive(Debug)]
pub(super) struct Asked {
    /// The robot, before joints without columns are held.
    pub(super) robot: Robot,
    /// Settings of the identification.
    pub(super) settings: Settings,
    /// Settings of the session.
    pub(super) online: OnlineConfig,
    /// Columns of sources that say nothing else.
    pub(super) columns: dynid_logs::MappingSpec,
    /// Transmission between logged motors and joints.
    pub(super) motor_side: Option<MotorSide>,
    /// Files and settings that the state of a session depends on, as text.
    pub(super) identity: String,
}

impl Asked {
    /// # Errors
    /// [`Error`]: bad configuration or robot.
    pub(super) fn of(config: &Config) -> Result<Asked, Error> {
        config.check()?;
        config.online.check_effect()?;
        if config.log.iter().any(|log| log.payload.is_some() || !log.own.is_empty()) {
            return Err(Error::Unsupported(
                "on-line identification of logs with a payload or terms of their own: it follows the robot alone".to_owned(),
            ));
        }
        let robot = config.read_robot()?;
        refuse_internal_load(&robot, "identified on line")?;
        if robot.closed.is_none() && robot.mechanism.positions() != robot.mechanism.rates() {
            return Err(Error::Unsupported(
                "a floating base cannot be identified from joint logs: lock the base or leave it out"
                    .to_owned(),
            ));
        }
        let mut settings = config.settings()?;
        if settings.elements.clearance == Some(Clearance::Journals) {
            return Err(Error::Unsupported(
                "journals that move in their bearings are not followed on line, since what they do goes with the estimate: \
                 leave out `clearance` under `[elements]`"
                    .to_owned(),
            ));
        }
        settings.elements.clearance = (!robot.elements.clearance.is_empty()).then_some(Clearance::Ideal);
        if ElementPlan::of_run(&settings, &robot, |rate| robot.is_driven(rate))?.has_reactions() {
            return Err(Error::Unsupported(format!(
                "`{REACTION_FRICTION}` is not followed on line, since its columns go with the estimate: state other friction"
            )));
        }
        if settings.estimator.search.is_some() {
            return Err(Error::Unsupported(
                "`[estimator.search]` beside on-line identification, which has no search: leave the table out".to_owned(),
            ));
        }
        let c = &settings.conditioning;
        if c.smoothing.is_some() || c.effort_smoothing.is_some() || c.average_periods.is_some() {
            return Err(Error::Unsupported(
                "smoothings and averages of the textbook route on line, where samples are conditioned as they come: leave out `smoothing`, \
                 `effort_smoothing` and `average_periods`"
                    .to_owned(),
            ));
        }
        Ok(Asked {
            robot,
            settings,
            online: config.online.clone(),
            columns: config.columns.clone(),
            motor_side: config.motor_side.clone(),
            identity: identity(config)?,
        })
    }
}

/// Differs between configurations whose states differ.
fn identity(config: &Config) -> Result<String, Error> {
    let mut config = config.clone();
    let robot = crate::logs::sha256(&config.robot)?;
    let friction = match config.elements.known_friction.take() {
        Some(file) => crate::logs::sha256(&file)?,
        None => String::new(),
    };
    config.robot = std::path::PathBuf::new();
    config.out = None;
    config.log.clear();
    config.validation.clear();
    (config.online.checkpoint, config.online.checkpoint_s) = (None, 1.0);
    Ok(format!("{robot} {friction} {config:?}"))
}
