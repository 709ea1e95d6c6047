//! The experiment: a controlled plant in motion, and what its sensors made of it.

mod recorder;
mod schedule;

use std::collections::VecDeque;

use rand::RngExt;

use crate::clearance::{self, ClearanceMotion, ClearanceRecord};
use crate::closed::{ClosedMotion, ClosedNominal, ClosedPlant};
use crate::controller::{ControlSettings, Controller, Nominal, Reference, Wanted};
use crate::encoder::Encoders;
use crate::error::{SimError, demand_length};
use crate::imperfections::Imperfections;
use crate::machine::{Instant, Motion, PlantMotion, PlantNominal};
use crate::plant::{Plant, PlantEnergy, Ripple};
use crate::profile::Profile;
use crate::rosenbrock::IntegrationCount;
use crate::streams::{Cause, generator, normal};
use recorder::Recording;
pub use recorder::{Truth, VirtualLog};
use schedule::Schedule;

/// Settings of an experiment.
#[derive(Debug, Clone, PartialEq)]
pub struct ExperimentSettings {
    /// Length, s. Default 20.
    pub duration_s: f64,
    /// Rows of the log per second; the control rate must be a whole multiple. Default 1000.
    pub log_rate_hz: f64,
    /// Largest local error of an integration step (see [`Integrator::new`](crate::Integrator::new)). Default 1e-9.
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
    /// Position and velocity gain of every drive, as stated or chosen: N m/rad and N m s/rad, or N/m and N s/m.
    pub gains: Vec<(f64, f64)>,
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
    motion: &'a mut dyn Motion,
    schedule: Schedule,
    encoders: Encoders,
    recording: Recording,
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
        self.motion.advance(&self.in_force, channels, time, (to - from) * period)
    }

    fn sample(&mut self, row: usize, time: f64, reading: &[f64], channels: &[f64]) -> Result<(), SimError> {
        let Instant { q, dq, ddq, effort, sensors } = self.motion.instant(&self.in_force, channels, time)?;
        let between = (self.schedule.motion_part > 0.0).then(|| self.encoders.between_ticks(&q));
        let truth = [&q[..], &dq, &ddq, &effort];
        let channels: Vec<f64> = channels.iter().copied().chain(sensors).collect();
        self.recording.motion(row, between.as_deref().unwrap_or(reading), truth, &channels);
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
    let mut believed = PlantNominal::new(nominal);
    demand_length("joints of the nominal model", plant.joints(), nominal.joints())?;
    let prepared = Prepared::new(&mut believed, reference, settings)?;
    plant.set_ripple(prepared.ripple.clone());
    let mut motion = PlantMotion::new(plant, &prepared.start, settings.tolerance)?;
    prepared.run(&mut motion, &mut believed, reference, settings)
}

/// Runs an experiment with a closed mechanism: as [`run`], with encoders and drives at its driven joints alone, of which
/// reference and log have one column each.
///
/// The mechanism starts from home on the straight way of the drives to the reference. Of an over-actuated mechanism the
/// reference of all drives must be of one motion.
///
/// # Errors
/// Fails as [`run`] does; [`SimError::Pose`] where the reference leaves the workspace or comes next to a singular pose,
/// [`SimError::Reference`], [`SimError::Forward`].
pub fn run_closed(
    plant: &mut ClosedPlant,
    nominal: &ClosedPlant,
    reference: &dyn Fn(f64) -> Vec<Wanted>,
    settings: &ExperimentSettings,
) -> Result<ExperimentResult, SimError> {
    let mut believed = ClosedNominal::new(nominal, 1.0 / settings.control.rate_hz);
    demand_length("drives of the nominal model", plant.drives(), nominal.drives())?;
    let prepared = Prepared::new(&mut believed, reference, settings)?;
    plant.set_ripple(prepared.ripple.clone());
    let mut motion = ClosedMotion::new(plant, &prepared.start, settings.tolerance)?;
    prepared.run(&mut motion, &mut believed, reference, settings)
}

/// Runs an experiment with a machine whose joints have clearance: as [`run`], with the [sensors](clearance::sensors) of its journals as
/// channels behind those of the model.
///
/// `plant`: bodies with translations of the journals, its contacts among its elements. `nominal`: the robot without clearance. Journals
/// begin at rest against their bearings. Contacts are integrated as [`clearance::simulate`] does, with a tolerance of its own.
///
/// # Errors
/// Fails as [`run`] and [`clearance::simulate`] do.
pub fn run_with_clearance(
    plant: Plant,
    nominal: &Plant,
    reference: &dyn Fn(f64) -> Vec<Wanted>,
    settings: &ExperimentSettings,
) -> Result<(ExperimentResult, ClearanceRecord), SimError> {
    let mut believed = PlantNominal::new(nominal);
    let mut prepared = Prepared::new(&mut believed, reference, settings)?;
    let mut plant = plant.without_contacts();
    let mut ripple = prepared.ripple.clone();
    ripple.resize(plant.joints(), Ripple::default());
    plant.set_ripple(ripple);
    prepared.sensors = clearance::sensors(&plant).len();
    let channels: Vec<f64> = settings.channels.iter().map(|p| p.at(0.0)).collect();
    let mut motion = ClearanceMotion::new(&plant, &prepared.start, &channels)?;
    let result = prepared.run(&mut motion, &mut believed, reference, settings)?;
    Ok((result, motion.finish()))
}

/// What an experiment fixes before anything moves.
struct Prepared {
    schedule: Schedule,
    start: Vec<Wanted>,
    inertia: Vec<f64>,
    ripple: Vec<Ripple>,
    /// Sensors of the machine besides encoders and drives.
    sensors: usize,
}

impl Prepared {
    fn new(
        nominal: &mut dyn Nominal,
        reference: Reference<'_>,
        settings: &ExperimentSettings,
    ) -> Result<Prepared, SimError> {
        let n = nominal.drives();
        settings.control.check(n)?;
        settings.imperfections.check(n)?;
        let schedule = Schedule::new(settings)?;
        let channels = nominal.channels();
        if let Some(name) = channels.get(settings.channels.len()) {
            return Err(SimError::Channel { name: name.clone() });
        }
        demand_length("channel profiles", channels.len(), settings.channels.len())?;
        let start = nominal.follow(reference, 0.0)?;
        let times: Vec<f64> = instants(settings).collect();
        Ok(Prepared {
            schedule,
            start,
            inertia: nominal.largest_inertia(reference, &times)?,
            ripple: match &settings.imperfections.ripple {
                Some(given) => given.clone(),
                None => ripple(nominal, reference, settings)?,
            },
            sensors: 0,
        })
    }

    fn run(
        self,
        motion: &mut dyn Motion,
        nominal: &mut dyn Nominal,
        reference: Reference<'_>,
        settings: &ExperimentSettings,
    ) -> Result<ExperimentResult, SimError> {
        let before = motion.energy();
        let encoders = Encoders::new(&nominal.slides(), &settings.imperfections, settings.seed);
        let channels = settings.channels.len() + self.sensors;
        let recording = Recording::new(nominal.drives(), channels, self.schedule.rows);
        let mut controller = Controller::new(nominal, &settings.control, &self.inertia);
        let ticks = self.schedule.ticks();
        let mut run = Run {
            motion,
            encoders,
            recording,
            schedule: self.schedule,
            in_force: Vec::new(),
            coming: VecDeque::new(),
        };
        for tick in 0..ticks {
            let time = tick as f64 * run.schedule.period;
            let channels: Vec<f64> = settings.channels.iter().map(|p| p.at(time)).collect();
            let reading = run.encoders.at_tick(&run.motion.positions());
            let command = controller.command(reference, time, &reading, &channels)?;
            if tick == 0 {
                // Until the first command arrives the drives already hold it.
                run.in_force.clone_from(&command);
            }
            run.tick(tick, &reading, command, &channels)?;
        }
        let after = run.motion.energy();
        let [drive_work, element_work] = run.motion.work();
        Ok(ExperimentResult {
            energy: EnergyBalance { before, after, drive_work, element_work },
            integration: run.motion.count(),
            log: run.recording.finish(settings),
            imperfections: settings.imperfections.active(),
            ripple: self.ripple,
            gains: controller.gains().to_vec(),
            ticks,
            saturated_ticks: controller.saturated,
        })
    }
}

/// Some instants of the motion, s.
fn instants(settings: &ExperimentSettings) -> impl Iterator<Item = f64> + use<> {
    const INSTANTS: u32 = 200;
    let duration = settings.duration_s;
    (0..INSTANTS).map(move |k| duration * f64::from(k) / f64::from(INSTANTS))
}

/// Ripple in proportion to the rms of the efforts that the nominal model needs along the reference.
fn ripple(
    nominal: &mut dyn Nominal,
    reference: Reference<'_>,
    settings: &ExperimentSettings,
) -> Result<Vec<Ripple>, SimError> {
    let mut rng = generator(settings.seed, Cause::Ripple);
    let mut squares = vec![0.0; nominal.drives()];
    let mut count = 0.0;
    for time in instants(settings) {
        let wanted = nominal.follow(reference, time)?;
        let channels: Vec<f64> = settings.channels.iter().map(|p| p.at(time)).collect();
        let effort = nominal.effort(&wanted, &channels)?;
        squares.iter_mut().zip(&effort).for_each(|(s, e)| *s += e * e);
        count += 1.0;
    }
    let (share, cycles) = (settings.imperfections.ripple_share, settings.imperfections.ripple_cycles);
    let passive = nominal.passive(&settings.control);
    let of_drive = |(square, passive): (&f64, bool)| Ripple {
        amplitude: if passive { 0.0 } else { share * f64::sqrt(square / count) },
        cycles,
        phase: rng.random_range(0.0..std::f64::consts::TAU),
    };
    Ok(squares.iter().zip(passive).map(of_drive).collect())
}
