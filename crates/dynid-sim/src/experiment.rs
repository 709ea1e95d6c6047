//! The experiment: a controlled plant in motion, and what its sensors made of it.

use std::collections::VecDeque;

use dynid_model::{EffortModel, History};
use rand::RngExt;

use crate::controller::{ControlSettings, Controller, Wanted};
use crate::encoder::Encoders;
use crate::error::{SimError, demand, demand_length};
use crate::imperfections::Imperfections;
use crate::integrator::{IntegrationCount, Integrator, PlantState};
use crate::plant::{Plant, PlantEnergy, Ripple};
use crate::profile::Profile;
use crate::recorder::{Recording, VirtualLog};
use crate::streams::{Cause, generator, normal};

/// Largest number of controller ticks of one experiment.
const MOST_TICKS: f64 = 1e8;

/// Settings of an experiment.
#[derive(Debug, Clone, PartialEq)]
pub struct ExperimentSettings {
    /// Length, s. Default 20.
    pub duration_s: f64,
    /// Rows of the log per second; the control rate must be a whole multiple. Default 1000.
    pub log_rate_hz: f64,
    /// Largest local error of an integration step (see [`Integrator::new`]). Default 1e-9.
    pub tolerance: f64,
    /// The controller.
    pub control: ControlSettings,
    /// What goes wrong.
    pub imperfections: Imperfections,
    /// One profile per channel of the model, in its order; values are held over a tick. Default: none.
    pub channels: Vec<Profile>,
    /// Seed of all random numbers. Default 1.
    pub seed: u64,
}

impl Default for ExperimentSettings {
    fn default() -> Self {
        ExperimentSettings {
            duration_s: 20.0,
            log_rate_hz: 1000.0,
            tolerance: 1e-9,
            control: ControlSettings::default(),
            imperfections: Imperfections::default(),
            channels: Vec::new(),
            seed: 1,
        }
    }
}

/// Work and energy over an experiment, J: without errors of integration
/// `after - before = drive_work - element_work`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EnergyBalance {
    /// Energy at the start.
    pub before: PlantEnergy,
    /// Energy at the end.
    pub after: PlantEnergy,
    /// Work of the drives, ripple included.
    pub drive_work: f64,
    /// Work taken by elements: losses of friction, store of springs, work against offsets.
    pub element_work: f64,
}

impl EnergyBalance {
    /// What is missing, J.
    pub fn residual(&self) -> f64 {
        let total = |e: &PlantEnergy| e.kinetic + e.potential;
        total(&self.after) - total(&self.before) - (self.drive_work - self.element_work)
    }
}

/// What an experiment gave.
#[derive(Debug, Clone, PartialEq)]
pub struct ExperimentResult {
    /// The log, with the truth beside it.
    pub log: VirtualLog,
    /// Names of the imperfections that were on.
    pub imperfections: Vec<&'static str>,
    /// Ripple of every drive.
    pub ripple: Vec<Ripple>,
    /// Work and energy.
    pub energy: EnergyBalance,
    /// Work of the integrator.
    pub integration: IntegrationCount,
    /// Ticks of the controller.
    pub ticks: usize,
    /// Ticks at which some effort was cut off at its limit.
    pub saturated_ticks: usize,
}

/// The parameters of a model that is wrong by a share of each value, normally distributed.
pub fn wrong_model(linear: &[f64], share: f64, seed: u64) -> Vec<f64> {
    let mut rng = generator(seed, Cause::NominalModel);
    linear.iter().map(|x| x * (1.0 + share * normal(&mut rng))).collect()
}

/// How the ticks of the controller, the rows of the log and the cuts within a tick lie to each other.
struct Schedule {
    period: f64,
    /// Ticks per row.
    stride: usize,
    rows: usize,
    /// Whole ticks that the motion of a row comes after the row's effort, and the part of a tick.
    motion_later: isize,
    motion_part: f64,
    command_late: usize,
    command_part: f64,
}

impl Schedule {
    fn new(settings: &ExperimentSettings) -> Result<Schedule, SimError> {
        let (duration, rate) = (settings.duration_s, settings.log_rate_hz);
        let positive = |x: f64| x.is_finite() && x > 0.0;
        demand(positive(duration), "duration", "a positive number", duration)?;
        demand(positive(rate), "log rate", "a positive number", rate)?;
        let control = settings.control.rate_hz;
        demand(duration * control <= MOST_TICKS, "duration", "at most 1e8 control ticks", duration)?;
        let ratio = control / rate;
        let whole = ratio >= 0.999 && (ratio - ratio.round()).abs() <= 1e-9 * ratio;
        let expected = "the control rate divided by a whole number";
        demand(whole, "log rate", expected, format!("{rate} Hz at a control rate of {control} Hz"))?;
        let stride = ratio.round() as usize;
        let (motion, command) =
            (settings.imperfections.effort_delay_samples * ratio, settings.control.delay_ticks);
        Ok(Schedule {
            period: 1.0 / control,
            stride,
            rows: (duration * rate).round() as usize + 1,
            motion_later: motion.floor() as isize,
            motion_part: motion - motion.floor(),
            command_late: command.floor() as usize,
            command_part: command - command.floor(),
        })
    }

    fn ticks(&self) -> usize {
        (self.rows - 1) * self.stride + self.motion_later.unsigned_abs() + 1
    }

    fn row_at(&self, tick: usize, later: usize) -> Option<usize> {
        let since = tick.checked_sub(later)?;
        let row = since / self.stride;
        (since.is_multiple_of(self.stride) && row < self.rows).then_some(row)
    }

    /// Row whose motion is sampled within a tick.
    fn motion_row(&self, tick: usize) -> Option<usize> {
        self.row_at(tick, self.motion_later.max(0).unsigned_abs())
    }

    /// Row whose effort is taken at a tick.
    fn effort_row(&self, tick: usize) -> Option<usize> {
        self.row_at(tick, self.motion_later.min(0).unsigned_abs())
    }
}

/// What happens within a tick, in this order where times are equal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Event {
    /// The drives take the next effort.
    Change,
    /// Row whose effort is logged.
    Effort(usize),
    /// Row whose motion is logged.
    Motion(usize),
}

/// An experiment under way.
struct Run<'a> {
    plant: &'a Plant,
    schedule: Schedule,
    integrator: Integrator<'a>,
    encoders: Encoders,
    recording: Recording,
    state: PlantState,
    /// Effort of the drives.
    in_force: Vec<f64>,
    /// Commands that are still on their way, oldest first.
    coming: VecDeque<Vec<f64>>,
}

impl Run<'_> {
    /// From a tick to the next, with what the controller read and commanded at it.
    fn tick(
        &mut self,
        tick: usize,
        reading: &[f64],
        command: Vec<f64>,
        channels: &[f64],
    ) -> Result<(), SimError> {
        let schedule = &self.schedule;
        let start = tick as f64 * schedule.period;
        self.coming.push_back(command);
        let mut events = vec![(schedule.command_part, Event::Change)];
        events.extend(schedule.effort_row(tick).map(|row| (0.0, Event::Effort(row))));
        events.extend(schedule.motion_row(tick).map(|row| (schedule.motion_part, Event::Motion(row))));
        events.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut part = 0.0;
        for (at, event) in events {
            self.advance(start, part, at, channels)?;
            part = at;
            match event {
                Event::Change if self.coming.len() > self.schedule.command_late => {
                    self.in_force = self.coming.pop_front().unwrap_or_default();
                }
                Event::Change => {}
                Event::Effort(row) => self.recording.effort(row, &self.in_force),
                Event::Motion(row) => {
                    self.sample(row, start + at * self.schedule.period, reading, channels)?
                }
            }
        }
        self.advance(start, part, 1.0, channels)
    }

    fn advance(&mut self, start: f64, from: f64, to: f64, channels: &[f64]) -> Result<(), SimError> {
        if to <= from {
            return Ok(());
        }
        let period = self.schedule.period;
        let time = start + from * period;
        self.integrator.advance(&mut self.state, &self.in_force, channels, time, (to - from) * period)
    }

    fn sample(&mut self, row: usize, time: f64, reading: &[f64], channels: &[f64]) -> Result<(), SimError> {
        let PlantState { q, dq, history, .. } = &self.state;
        let mut ddq = vec![0.0; q.len()];
        let mut all = channels.to_vec();
        if self.plant.remembers() {
            all.extend(self.plant.signals(history, None, dq));
        }
        self.plant
            .acceleration((q, dq), &self.in_force, &all, self.integrator.workspace(), &mut ddq)
            .map_err(|source| SimError::Inertia { time, source })?;
        let between = (self.schedule.motion_part > 0.0).then(|| self.encoders.between_ticks(q));
        let felt = self.plant.delivered(q, &self.in_force);
        self.recording.motion(row, between.as_deref().unwrap_or(reading), [q, dq, &ddq, &felt], channels);
        Ok(())
    }
}

/// Runs an experiment.
///
/// The plant starts on the reference. At every tick the controller reads the encoders and computes the drives' efforts
/// from the reference, its `nominal` model and the readings; they act from `delay_ticks` later on and are held until the
/// next ones. Logged efforts are what the drives were told (ripple is not seen), those in force at the row's time. The
/// truth holds what joints felt at the instant the row's motion was sampled, so its effort is the inverse dynamics of its
/// motion. The plant gets its ripple from the imperfections.
///
/// `reference`: wanted position, velocity, acceleration of every joint at a time, s. The same seed gives the same bits.
///
/// # Errors
/// [`SimError`]: settings out of range, a reference of the wrong length, a motion that cannot be followed.
pub fn run(
    plant: &mut Plant,
    nominal: &Plant,
    reference: &dyn Fn(f64) -> Vec<Wanted>,
    settings: &ExperimentSettings,
) -> Result<ExperimentResult, SimError> {
    let n = plant.joints();
    settings.control.check(n)?;
    settings.imperfections.check(n)?;
    let schedule = Schedule::new(settings)?;
    demand_length("joints of the nominal model", n, nominal.joints())?;
    let start = reference(0.0);
    demand_length("joints of the reference", n, start.len())?;
    let channels = plant.model().channels();
    if let Some(name) = channels.get(settings.channels.len()) {
        return Err(SimError::Channel { name: name.clone() });
    }
    demand_length("channel profiles", channels.len(), settings.channels.len())?;
    let ripple =
        settings.imperfections.ripple.clone().unwrap_or_else(|| ripple(nominal, reference, settings));
    plant.set_ripple(ripple.clone());

    let poses: Vec<Vec<f64>> =
        instants(settings).map(|t| reference(t).iter().map(|w| w[0]).collect()).collect();
    let mut controller = Controller::new(nominal, &settings.control, &poses);
    let mut run = Run {
        plant,
        integrator: Integrator::new(plant, settings.tolerance)?,
        encoders: Encoders::new(plant, &settings.imperfections, settings.seed),
        recording: Recording::new(n, settings.channels.len(), schedule.rows),
        schedule,
        state: PlantState {
            q: start.iter().map(|w| w[0]).collect(),
            dq: start.iter().map(|w| w[1]).collect(),
            history: History::default(),
            drive_work: 0.0,
            element_work: 0.0,
        },
        in_force: Vec::new(),
        coming: VecDeque::new(),
    };
    let before = plant.energy(&run.state.q, &run.state.dq, run.integrator.workspace());
    let ticks = run.schedule.ticks();
    for tick in 0..ticks {
        let time = tick as f64 * run.schedule.period;
        let channels: Vec<f64> = settings.channels.iter().map(|p| p.at(time)).collect();
        let reading = run.encoders.at_tick(&run.state.q);
        let command = controller.command(&reference(time), &reading, &channels);
        if tick == 0 {
            // Until the first command arrives the drives already hold it.
            run.in_force.clone_from(&command);
        }
        run.tick(tick, &reading, command, &channels)?;
    }
    let PlantState { q, dq, drive_work, element_work, .. } = &run.state;
    let after = plant.energy(q, dq, run.integrator.workspace());
    Ok(ExperimentResult {
        energy: EnergyBalance { before, after, drive_work: *drive_work, element_work: *element_work },
        integration: run.integrator.count(),
        log: run.recording.finish(settings),
        imperfections: settings.imperfections.active(),
        ripple,
        ticks,
        saturated_ticks: controller.saturated,
    })
}

/// Some instants of the motion, s.
fn instants(settings: &ExperimentSettings) -> impl Iterator<Item = f64> + use<> {
    const INSTANTS: u32 = 200;
    let duration = settings.duration_s;
    (0..INSTANTS).map(move |k| duration * f64::from(k) / f64::from(INSTANTS))
}

/// Ripple in proportion to the rms of the efforts that the nominal model needs along the reference.
fn ripple(
    nominal: &Plant,
    reference: &dyn Fn(f64) -> Vec<Wanted>,
    settings: &ExperimentSettings,
) -> Vec<Ripple> {
    let mut rng = generator(settings.seed, Cause::Ripple);
    let mut work = nominal.workspace();
    let mut squares = vec![0.0; nominal.joints()];
    let mut count = 0.0;
    for time in instants(settings) {
        let wanted = reference(time);
        let of = |k: usize| wanted.iter().map(|w| w[k]).collect::<Vec<f64>>();
        let channels: Vec<f64> = settings.channels.iter().map(|p| p.at(time)).collect();
        let effort = nominal.drive_effort([&of(0), &of(1), &of(2)], &channels, &mut work);
        squares.iter_mut().zip(&effort).for_each(|(s, e)| *s += e * e);
        count += 1.0;
    }
    let (share, cycles) = (settings.imperfections.ripple_share, settings.imperfections.ripple_cycles);
    squares
        .iter()
        .enumerate()
        .map(|(j, s)| Ripple {
            amplitude: if settings.control.is_passive(nominal.model(), j) {
                0.0
            } else {
                share * f64::sqrt(s / count)
            },
            cycles,
            phase: rng.random_range(0.0..std::f64::consts::TAU),
        })
        .collect()
}
