//! Recursive estimation over streams of cruises.

use dynid::estimators::online::{
    DetectionSettings, Estimator, Forgetting, MonitorSettings, ReactionSettings, RowNoise,
    Settings as Recursive,
};
use dynid::model::RobotModel;
use dynid::model::element::CubicSpring;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use super::joint::{Damping, Extras, LINK, MOTOR, identified};
use super::measurement::Signals;
use super::settings::Settings;
use super::{PARAMETERS, Values};
use crate::StudyError;

/// The two rows of a sample on the joint's side: regressor and effort.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample {
    pub(super) regressor: [f64; 2 * PARAMETERS],
    pub(super) effort: [f64; 2],
}

/// Samples of a record, row by row.
pub(super) fn samples(settings: &Settings, model: &RobotModel, signals: &Signals) -> Vec<Sample> {
    use dynid::model::EffortModel;
    let block = signals.regressor(settings, model);
    let layout = model.layout();
    let entries = |sample: usize| {
        let mut regressor = [0.0; 2 * PARAMETERS];
        for (row, output, factor) in [(0, MOTOR, settings.ratio), (1, LINK, -1.0)] {
            for (k, column) in layout.columns(output).iter().enumerate() {
                regressor[row * PARAMETERS + column] = factor * block.column(output, k)[sample];
            }
        }
        let input = signals.motor_torque[sample] - block.offset(MOTOR)[sample];
        Sample { regressor, effort: [settings.ratio * input, signals.link_torque[sample]] }
    };
    (0..signals.len()).map(entries).collect()
}

/// Covariance of both rows at an estimate: noise of efforts and speeds, and that of the deformation, which they share.
pub(super) fn row_covariance(settings: &Settings, x: &[f64], sample: &Sample) -> [f64; 4] {
    let noise = &settings.noise;
    let spring = CubicSpring { k1: x[0], k2: x[1] };
    let shared = (spring.stiffness(sample.regressor[0]) * noise.deformation).powi(2);
    let input = settings.ratio * noise.motor_torque.hypot(x[2] * noise.motor_speed);
    let output = noise.link_torque.hypot(x[4] * noise.link_speed);
    [input * input + shared, shared, shared, output * output + shared]
}

/// What the estimator is told of the noise.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Stated {
    /// Nothing, as in the paper: rows count alike.
    Nothing,
    /// Standard deviations of the sensors.
    Sensors,
}

/// An estimator of the joint with what it is told of the noise.
#[derive(Debug, Clone)]
pub(super) struct Online<'a> {
    settings: &'a Settings,
    stated: Stated,
    pub(super) estimator: Estimator,
}

/// What guards a forgetting estimator.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Guard {
    None,
    /// Parameters that nothing excites do not forget.
    Monitor,
}

impl<'a> Online<'a> {
    /// From nothing, forgetting as told, without alarms.
    pub(super) fn forgetting(
        settings: &'a Settings,
        forgetting: Forgetting,
        stated: Stated,
        guard: Guard,
    ) -> Result<Self, StudyError> {
        let mut recursive = from_nothing(settings);
        (recursive.detection, recursive.reaction) = (None, None);
        recursive.forgetting = forgetting;
        recursive.monitor = (guard == Guard::Monitor).then(|| {
            // A stretch counts that finds the parameter to a twentieth of its unit.
            let share = (20.0 * settings.online.start_std).powi(2);
            MonitorSettings { share, ..MonitorSettings::default() }
        });
        Ok(Online { settings, stated, estimator: Estimator::new(recursive)? })
    }

    /// From nothing without forgetting; alarms are answered by opening what changed.
    pub(super) fn reacting(settings: &'a Settings, detection: DetectionSettings) -> Result<Self, StudyError> {
        let mut recursive = from_nothing(settings);
        recursive.detection = Some(detection);
        recursive.reaction = Some(ReactionSettings::default());
        Ok(Online { settings, stated: Stated::Sensors, estimator: Estimator::new(recursive)? })
    }

    pub(super) fn step(&mut self, sample: &Sample) -> Result<dynid::estimators::online::Step, StudyError> {
        let step = match self.stated {
            Stated::Nothing => {
                self.estimator.step(&sample.regressor, &sample.effort, RowNoise::Std(&[1.0, 1.0]))?
            }
            Stated::Sensors => {
                let covariance = row_covariance(self.settings, self.estimator.x(), sample);
                self.estimator.step(&sample.regressor, &sample.effort, RowNoise::Covariance(&covariance))?
            }
        };
        Ok(step)
    }

    pub(super) fn std(&mut self) -> Values {
        let mut out = [0.0; PARAMETERS];
        self.estimator.std(&mut out);
        out
    }

    pub(super) fn x(&self) -> &[f64] {
        self.estimator.x()
    }
}

fn from_nothing(settings: &Settings) -> Recursive {
    let online = &settings.online;
    let std = online.units.map(|u| online.start_std * u);
    let mut recursive = Recursive::new(vec![0.0; PARAMETERS], std.to_vec(), 2);
    recursive.scale = online.units.to_vec();
    recursive
}

/// The paper's rule.
pub(super) fn published(settings: &Settings) -> Forgetting {
    let online = &settings.online;
    Forgetting::ErrorDriven { alpha: online.alpha, beta: online.beta, floor: online.floor }
}

/// Cycles before and after the change, each all cruises in random order.
pub(super) const CYCLES: usize = 3;
/// What is left of the stiffness.
pub(super) const DROP: f64 = 0.85;

/// The clean cruises that a stream is made of.
#[derive(Debug)]
pub(super) struct Machine<'a> {
    settings: &'a Settings,
    pub(super) model: RobotModel,
    /// Signals of the joint as built, and after the stiffness has dropped.
    states: [Vec<Signals>; 2],
    pub(super) truth: [Values; 2],
}

impl<'a> Machine<'a> {
    pub(super) fn new(settings: &'a Settings) -> Result<Self, StudyError> {
        let built = settings.truth.values();
        let mut dropped = built;
        dropped[0] *= DROP;
        let record = |x: &Values| {
            Signals::programme(settings, x, Extras::default(), settings.programme.online_rate_hz)
        };
        Ok(Machine {
            settings,
            model: identified(settings, Damping::Full, false),
            states: [record(&built)?, record(&dropped)?],
            truth: [built, dropped],
        })
    }

    /// Samples of a cycle.
    pub(super) fn cycle(&self) -> usize {
        self.states[0].iter().map(Signals::len).sum()
    }

    /// Cruises of the programme, forth and back in turn, the fastest last.
    pub(super) fn cruises(&self) -> usize {
        self.states[0].len()
    }

    /// A cruise without noise.
    pub(super) fn clean(&self, state: usize, cruise: usize) -> Vec<Sample> {
        samples(self.settings, &self.model, &self.states[state][cruise])
    }

    /// All cruises in random order, `cycles` times, with noise; `state` 1 after the drop. Sample by sample to `take`.
    pub(super) fn run(
        &self,
        state: usize,
        cycles: usize,
        random: &mut ChaCha8Rng,
        take: &mut dyn FnMut(&Sample) -> Result<(), StudyError>,
    ) -> Result<(), StudyError> {
        for _ in 0..cycles {
            let mut order: Vec<usize> = (0..self.states[state].len()).collect();
            order.shuffle(random);
            for cruise in order {
                self.cruise(state, cruise, random, take)?;
            }
        }
        Ok(())
    }

    /// One cruise of the programme with noise.
    pub(super) fn cruise(
        &self,
        state: usize,
        cruise: usize,
        random: &mut ChaCha8Rng,
        take: &mut dyn FnMut(&Sample) -> Result<(), StudyError>,
    ) -> Result<(), StudyError> {
        let signals = self.states[state][cruise].noisy(&self.settings.noise, random);
        samples(self.settings, &self.model, &signals).iter().try_for_each(take)
    }
}

/// Seed of the `k`-th realisation of a run: no two runs share any but by their own seed.
pub(super) fn nth_seed(seed: u64, k: u64) -> u64 {
    seed.wrapping_add(k << 32)
}

pub(super) fn random(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}
