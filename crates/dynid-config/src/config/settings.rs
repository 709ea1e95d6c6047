//! From a configuration to the settings of an identification.

use dynid_identify::Error;
use dynid_identify::commands::RunFiles;
use dynid_identify::settings::{Elements, LogSettings, Settings, check_log_effect, labels};
use dynid_robots::CouplingSpec;

use super::{Config, CouplingConfig, InstrumentsConfig, LogConfig};
use crate::friction_model::known_laws;

impl Config {
    /// Settings of an identification, friction files read.
    ///
    /// # Errors
    /// [`Error::Read`], [`FrictionError`](crate::friction_model::FrictionError) for a friction file that is none.
    pub fn settings(&self) -> Result<Settings, Error> {
        let mut settings = self.plain_settings();
        if let Some(file) = &self.elements.known_friction {
            settings.elements.known =
                Some(known_laws(file, self.elements.friction_errors, self.elements.temperature.clone())?);
        }
        Ok(settings)
    }

    /// Settings without what files hold.
    pub(super) fn plain_settings(&self) -> Settings {
        Settings::default().with(|settings| {
            settings.seed = self.seed;
            settings.elements = Elements {
                default: self.elements.default.clone(),
                joint: self.elements.joint.clone(),
                friction: self.elements.friction,
                known: None,
                clearance: self.elements.clearance,
            };
            settings.couplings = self.coupling.iter().map(coupling).collect();
            settings.conditioning = self.conditioning.clone();
            settings.known_effort_scale = self.known_effort_scale;
            settings.known_mass = self.known_mass.clone();
            settings.preflight = self.preflight;
            settings.estimator = self.estimator.clone();
            settings.closed_loop = self.instruments.as_ref().map(InstrumentsConfig::closed_loop);
            settings.bound = self.bound.clone();
            settings.law = self.law.clone();
            settings.tie = self.tie.clone();
            settings.preferred = self.preferred.clone();
            settings.stiff_joints = self.stiff_joints;
            settings.payload = self.payload.clone();
            settings.files = RunFiles {
                config: self.file.clone(),
                robot: self.robot.clone(),
                logs: self.log.iter().map(|log| log.path.clone()).collect(),
            };
        })
    }

    /// Names of the training logs in parameters and messages: as stated, else the file's name, with `#2` where it comes again.
    pub fn log_labels(&self) -> Vec<String> {
        let settings: Vec<LogSettings> = self.log.iter().map(LogConfig::settings).collect();
        let files: Vec<String> = self.log.iter().map(|log| log.path.display().to_string()).collect();
        labels(settings.iter().zip(files.iter().map(String::as_str)))
    }

    /// Checks what differs from log to log.
    pub(super) fn check_logs(&self) -> Result<(), Error> {
        let of = |logs: &[LogConfig]| logs.iter().map(LogConfig::settings).collect::<Vec<_>>();
        let (training, validation) = (of(&self.log), of(&self.validation));
        let (training, validation): (Vec<_>, Vec<_>) =
            (training.iter().collect(), validation.iter().collect());
        self.plain_settings().check_logs(&training, &validation, &self.log_labels())
    }

    /// Refuses settings of an identification that would do nothing beside the others.
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub fn check_effect(&self) -> Result<(), Error> {
        self.plain_settings().check_effect()?;
        let of = |logs: &[LogConfig]| logs.iter().map(LogConfig::settings).collect::<Vec<_>>();
        let (training, validation) = (of(&self.log), of(&self.validation));
        let files: Vec<String> = self.log.iter().map(|log| log.path.display().to_string()).collect();
        check_log_effect(
            &training.iter().collect::<Vec<_>>(),
            &validation.iter().collect::<Vec<_>>(),
            &self.log_labels(),
            &files.iter().map(String::as_str).collect::<Vec<_>>(),
        )?;
        let all_own = self.log.iter().all(|log| log.trajectory.is_some() || log.period_s.is_some());
        let expected = "a `[[log]]` without `trajectory` and `period_s` of its own";
        match (&self.trajectory, self.period_s) {
            (Some(file), _) if all_own => Err(Error::setting("trajectory", expected, file.display())),
            (_, Some(period)) if all_own => Err(Error::setting("period_s", expected, period)),
            _ => self.instruments.iter().try_for_each(InstrumentsConfig::check_effect),
        }
    }
}

impl LogConfig {
    /// What an identification has to know of the log beside its signals.
    pub fn settings(&self) -> LogSettings {
        LogSettings {
            name: self.name.clone(),
            payload: self.payload.clone(),
            own: self.own.clone(),
            like: self.like.clone(),
            temperature: self.temperature.clone(),
            validation: false,
            period_s: self.period_s,
        }
    }
}

fn coupling(of: &CouplingConfig) -> CouplingSpec {
    CouplingSpec {
        motors: of.motors.clone(),
        joints: of.joints.clone(),
        matrix: of.matrix.clone(),
        form: of.form,
    }
}
