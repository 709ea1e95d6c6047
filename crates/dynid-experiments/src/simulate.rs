//! Virtual logs: trajectory, elements, noise, encoder, seeded; by inverse dynamics or in closed loop.

mod channels;
mod clearance;
mod closed_loop;
mod drives;
mod elastic;
mod fleet;
mod fleet_table;
mod settings;
mod trajectory;

pub use clearance::{ClearanceSummary, JournalSummary};
pub use drives::simulate_drives;
use dynid_config::nominal::{nominal_parameters, with_nominal_shape};
use dynid_identify::Error;
use dynid_identify::elements::{ElementPlan, LOAD, REACTION_FRICTION};
use dynid_identify::robot::{Robot, refuse_elastic, refuse_internal_load, refuse_loops};
use dynid_model::{
    ClosedModel, EffortModel, History, LoadReference, Mechanism, MotionBlock, RegressorBlock, RobotModel,
};
use dynid_sim::Profile;
pub use fleet::{PlannedChange, VirtualFleet, VirtualLog};
pub use fleet_table::FleetTable;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
pub use settings::{
    ControlTable, ImperfectionTable, PlantTable, SeriesSettings, SimulateMode, SimulateSettings,
};
use trajectory::Reference;

/// Positions, velocities and accelerations, coordinate after coordinate, and the effort of every output.
type Moved = ([Vec<f64>; 3], Vec<Vec<f64>>);

/// A virtual log with the truth beside it.
#[derive(Debug, Clone)]
pub struct SimulatedLog {
    /// Joints, then motors behind springs.
    pub joints: Vec<String>,
    /// Per joint: no drive acts on it, so a log holds no effort of it.
    pub undriven: Vec<bool>,
    /// Time, s.
    pub time: Vec<f64>,
    /// Per joint: what its drive is told, in the numbers of its encoder; of logs by [`simulate_drives`], which hold no effort.
    pub command: Option<Vec<Vec<f64>>>,
    /// Per joint: position as the encoder reads it.
    pub position: Vec<Vec<f64>>,
    /// Per joint: velocity signal, where it is asked for.
    pub velocity: Option<Vec<Vec<f64>>>,
    /// Per joint: effort with noise; of joints with a torque sensor its reading.
    pub effort: Vec<Vec<f64>>,
    /// Extra channels by name, with noise.
    pub channels: Vec<(String, Vec<f64>)>,
    /// Extra channels by name, without noise.
    pub clean_channels: Vec<(String, Vec<f64>)>,
    /// Per joint: true position, velocity, acceleration, effort at the same times.
    pub clean: [Vec<Vec<f64>>; 4],
    /// Parameters of the truth: name, value.
    pub truth: Vec<(String, f64)>,
    /// What happened in closed loop.
    pub experiment: Option<ExperimentSummary>,
    /// What journals did in their bearings.
    pub clearance: Option<ClearanceSummary>,
    /// What a user should know, in words.
    pub warnings: Vec<String>,
}

/// What happened in a closed-loop experiment.
#[derive(Debug, Clone, PartialEq)]
pub struct ExperimentSummary {
    /// Names of the imperfections that were on.
    pub imperfections: Vec<&'static str>,
    /// Torque ripple per joint.
    pub ripple: Vec<dynid_sim::Ripple>,
    /// Work and energy.
    pub energy: dynid_sim::EnergyBalance,
    /// Work of the integrator.
    pub integration: dynid_sim::IntegrationCount,
    /// Ticks of the controller.
    pub ticks: usize,
    /// Ticks at which some effort was cut off at its limit.
    pub saturated_ticks: usize,
    /// Rows that are missing from the log.
    pub dropped_rows: usize,
    /// Speed over which the true friction smooths the sign of velocities.
    pub sign_width: f64,
}

/// Makes a virtual log of a random or given Fourier trajectory within the robot's limits.
///
/// By inverse dynamics the robot is on the trajectory exactly; motors behind springs move as their joints ask for
/// ([`dynid_sim::ElasticInverse`]), with signs of velocities smooth over 1 % of the slowest joint's rms speed. In closed loop a controller makes it follow (see
/// [`dynid_sim::run`]); signs of velocities are smooth there. Motors behind springs are then the drives, with encoders of their own beside those
/// of the links; their reference follows from that of the links by the springs of the controller's model, damping left out.
///
/// On robots whose joints have clearance, joints are on the trajectory exactly and journals move in their bearings
/// ([`dynid_sim::clearance`]), from the centre at rest; offsets of the journals, forces and penetrations are channels.
///
/// Link inertias and stated element values come from the robot file; elements without a stated value get one that is
/// typical for the joint ([`nominal_parameters`]): Coulomb and viscous friction (at the speed limit) of 10 % of the largest
/// rigid effort over random states each, at most 3 % of the effort limit; no offset, no rotor. It does not depend on the trajectory, so logs of one robot have one truth.
///
/// # Errors
/// [`Error::Setting`], [`Error::UnknownJoint`], [`Error::Unsupported`], [`Error::Experiment`].
pub fn simulate(robot: &Robot, settings: &SimulateSettings) -> Result<SimulatedLog, Error> {
    settings.check()?;
    settings.check_effect()?;
    if settings.fleet.is_some() {
        return Err(Error::setting("fleet", "no table beside a single log", "[fleet]"));
    }
    if let Some(drives) = &settings.drives {
        let expected = "no file beside a robot in memory: `dynid simulate --drives` makes logs of drives that are told positions";
        return Err(Error::setting("drives", expected, drives.display()));
    }
    let mechanism = &robot.mechanism;
    if robot.closed.is_none() && mechanism.positions() != mechanism.rates() {
        return Err(Error::Unsupported(
            "a floating base has no joint log: simulate the arm alone".to_owned(),
        ));
    }
    refuse_internal_load(robot, "simulated by this command")?;
    let plan = ElementPlan::new(mechanism, &robot.elements, None, |rate| robot.is_driven(rate))?
        .with_loops(robot.closed.clone());
    if settings.mode == SimulateMode::ClosedLoop {
        elastic::refuse_sensors(robot)?;
    }
    if settings.mode == SimulateMode::ClosedLoop && plan.per_rate.iter().flatten().any(|name| name == LOAD) {
        return Err(Error::Unsupported(format!(
            "`{LOAD}` friction depends on accelerations through its load, for which the equation of motion has no form: \
             simulate by inverse dynamics"
        )));
    }
    let with_clearance = robot.with_clearance()?;
    match with_clearance {
        None => settings.check_ideal()?,
        Some(_) => {
            refuse_elastic(robot, "simulated beside joints with clearance")?;
            refuse_loops(robot, "simulated beside joints with clearance")?;
            if plan.has_reactions() {
                return Err(Error::Unsupported(format!(
                    "`{REACTION_FRICTION}` has no form beside joints with clearance: state other friction, or leave out `clearance`"
                )));
            }
            if mechanism.follows().is_some() {
                return Err(Error::Unsupported(
                    "joints that follow others are not simulated beside joints with clearance: do not couple mimic joints"
                        .to_owned(),
                ));
            }
        }
    }
    let model = plan.model(mechanism)?;
    let model = with_nominal_shape(model, &plan, &settings.values)?;
    let mut rng = ChaCha8Rng::seed_from_u64(settings.seed);
    let (reference, followed) = Reference::new(&model, settings, &mut rng)?;
    let profiles = channels::profiles(model.channels(), &settings.channels, &followed)?;
    let settings = &match reference.duration() {
        Some(duration_s) => SimulateSettings { duration_s, ..settings.clone() },
        None => settings.clone(),
    };
    settings.check()?;
    let values = nominal_parameters(&model, &plan, &settings.values)?;
    let model = at_own_loads(model, &values);
    match settings.mode {
        SimulateMode::InverseDynamics => {
            let load = plan.is_measured().then_some(mechanism);
            by_inverse_dynamics(
                (&model, with_clearance, load),
                (&reference, &profiles),
                values,
                settings,
                &mut rng,
            )
        }
        SimulateMode::ClosedLoop => {
            let with_clearance = with_clearance.map(|contacts| {
                let elements = plan.build(mechanism)?;
                Ok::<_, Error>(clearance::with_elements(&contacts, elements))
            });
            let models = (model, with_clearance.transpose()?);
            closed_loop::experiment(models, &reference, values, profiles, settings)
        }
    }
}

/// Parameters of the truth by name, as [`simulate`] takes them.
fn nominal(robot: &Robot, settings: &SimulateSettings) -> Result<Vec<(String, f64)>, Error> {
    let plan = ElementPlan::new(&robot.mechanism, &robot.elements, None, |rate| robot.is_driven(rate))?
        .with_loops(robot.closed.clone());
    let model = with_nominal_shape(plan.model(&robot.mechanism)?, &plan, &settings.values)?;
    let values = nominal_parameters(&model, &plan, &settings.values)?;
    Ok(named(&model, values))
}

/// The model with the loads of its friction at parameters of its own.
fn at_own_loads(model: RobotModel, values: &[f64]) -> RobotModel {
    let shape = model.parameters().shape_start();
    let reference = LoadReference { linear: values.to_vec(), shape, linearised: false };
    model
        .with_load_reference(reference)
        .unwrap_or_else(|e| unreachable!("parameters of the model itself: {e}"))
}

fn by_inverse_dynamics(
    (model, with_clearance, load): (&RobotModel, Option<RobotModel>, Option<&Mechanism>),
    (reference, profiles): (&Reference, &[Profile]),
    values: Vec<f64>,
    settings: &SimulateSettings,
    rng: &mut ChaCha8Rng,
) -> Result<SimulatedLog, Error> {
    let n = model.joints().len();
    let samples = (settings.duration_s * settings.rate_hz).round() as usize + 1;
    let sample = |shift: f64| {
        let mut signals = [vec![0.0; n * samples], vec![0.0; n * samples], vec![0.0; n * samples]];
        for s in 0..samples {
            for (j, [q, dq, ddq]) in
                reference.at((s as f64 + shift) / settings.rate_hz).into_iter().enumerate()
            {
                signals[0][j * samples + s] = q;
                signals[1][j * samples + s] = dq;
                signals[2][j * samples + s] = ddq;
            }
        }
        signals
    };
    let span = (samples, settings.rate_hz);
    if let Some(closed) = model.closed() {
        reachable(closed, &sample(0.0)[0], samples)?;
    }
    let moved = |shift: f64| -> Result<Moved, Error> {
        if !model.coordinates().is_empty() {
            return elastic::along((model, load), (reference, profiles), &values, shift, span);
        }
        let at = sample(shift);
        let effort = efforts(model, &values, &at, &channels::sampled(profiles, shift, span), span);
        Ok((at, effort))
    };
    // The logged effort belongs to the motion that follows it.
    let lead = settings.delay_samples.unwrap_or(HELD_COMMAND);
    let (at, clean_effort, led, journals) = match with_clearance {
        None => {
            let (at, clean_effort) = moved(0.0)?;
            (at, clean_effort, moved(lead)?.1, None)
        }
        Some(contacts) => {
            let (at, ahead) = (sample(0.0), sample(lead));
            let models = (model, contacts);
            let found =
                clearance::along(models, (reference, profiles), &values, [&at, &ahead], lead, settings)?;
            let effort = (found.effort, found.led);
            let journals = (found.offsets, found.contacts, found.parameters, found.summary);
            (at, effort.0, effort.1, Some(journals))
        }
    };
    let (clean_effort, led) =
        (dynid_identify::log::as_logged(model, clean_effort), dynid_identify::log::as_logged(model, led));
    let step = |j: usize| {
        let turn = if model.joints()[j].slides { 1.0 } else { std::f64::consts::TAU };
        turn / 2f64.powi(settings.encoder_bits as i32)
    };
    let split = |flat: &[f64]| flat.chunks_exact(samples).map(<[f64]>::to_vec).collect::<Vec<_>>();
    let position = split(&at[0])
        .into_iter()
        .enumerate()
        .map(|(j, q)| {
            if settings.encoder_bits == 0 {
                return q;
            }
            q.iter().map(|x| (x / step(j)).round() * step(j)).collect()
        })
        .collect();
    let undriven: Vec<bool> = (0..n).map(|j| model.is_undriven(j)).collect();
    let effort: Vec<Vec<f64>> = led
        .iter()
        .map(|e| {
            let sigma = settings.effort_noise * dynid_motion::signal::rms(e);
            e.iter()
                .map(|x| {
                    let noise: f64 = StandardNormal.sample(rng);
                    x + sigma * noise
                })
                .collect()
        })
        .collect();
    let mut truth = named(model, values);
    let read = model.channels().iter().cloned().zip(channels::sampled(profiles, 0.0, span));
    let mut channels: Vec<(String, Vec<f64>)> = read.collect();
    let (mut clean_channels, mut summary) = (channels.clone(), None);
    if let Some((offsets, forces, parameters, found)) = journals {
        truth.extend(parameters);
        let noisy = offsets.iter().map(|(name, x)| {
            let mut noise = || -> f64 { StandardNormal.sample(rng) };
            (name.clone(), x.iter().map(|x| x + settings.journal_noise * noise()).collect())
        });
        channels.extend(noisy);
        channels.extend(forces.iter().cloned());
        clean_channels.extend(offsets);
        clean_channels.extend(forces);
        summary = Some(found);
    }
    let warnings = (summary.iter().flat_map(|s| s.warnings(settings.rate_hz)))
        .chain(load.and_then(elastic::unloaded))
        .chain(beyond_limits(model, &clean_effort))
        .collect();
    Ok(SimulatedLog {
        joints: model.joints().iter().map(|j| j.name.clone()).collect(),
        undriven,
        time: (0..samples).map(|s| s as f64 / settings.rate_hz).collect(),
        command: None,
        position,
        velocity: None,
        effort,
        channels,
        clean_channels,
        clean: [split(&at[0]), split(&at[1]), split(&at[2]), clean_effort],
        truth,
        experiment: None,
        warnings,
        clearance: summary,
    })
}

/// Drives that the motion asks for more than they have, in words.
fn beyond_limits(model: &RobotModel, efforts: &[Vec<f64>]) -> Option<String> {
    let beyond = efforts.iter().enumerate().filter_map(|(j, effort)| {
        let limit = model.limits(j).effort.filter(|e| e.is_finite() && *e > 0.0)?;
        let most = effort.iter().fold(0.0, |m: f64, e| m.max(e.abs()));
        (most > limit).then(|| format!("{most:.0} at `{}`, limit {limit}", model.joints()[j].name))
    });
    let beyond: Vec<String> = beyond.collect();
    (!beyond.is_empty()).then(|| {
        format!(
            "efforts beyond the limits of the robot file ({}): lower `acceleration` or `share`",
            beyond.join("; ")
        )
    })
}

/// Refuses a motion that a mechanism with loops cannot make.
fn reachable(closed: &ClosedModel, positions: &[f64], samples: usize) -> Result<(), Error> {
    let still = vec![0.0; positions.len()];
    let found = closed.follow(&MotionBlock::plain(samples, positions, &still, &still), |_, _| ());
    found.map_err(|e| Error::Pose {
        file: "simulated motion".to_owned(),
        row: e.sample + 1,
        fault: Box::new(e.fault),
    })
}

/// Lead of a command that is held over a sample, samples.
const HELD_COMMAND: f64 = 0.5;

fn named(model: &RobotModel, values: Vec<f64>) -> Vec<(String, f64)> {
    let table = model.parameters();
    let linear = table.linear.iter().map(|p| p.name.clone()).zip(values);
    linear.chain(table.shape.iter().map(|s| (s.name.clone(), s.start))).collect()
}

/// Efforts along a motion that starts in the steady state of elements that remember.
fn efforts(
    model: &RobotModel,
    values: &[f64],
    signals: &[Vec<f64>; 3],
    read: &[Vec<f64>],
    (samples, rate_hz): (usize, f64),
) -> Vec<Vec<f64>> {
    let mut block = RegressorBlock::new(model.layout().clone(), samples);
    let shape = model.parameters().shape_start();
    let names = model.channels().iter().map(String::as_str);
    let read: Vec<(&str, &[f64])> = names.zip(read.iter().map(Vec::as_slice)).collect();
    let plain = MotionBlock::plain(samples, &signals[0], &signals[1], &signals[2]);
    let plain = MotionBlock { channels: &read, ..plain };
    let mut remembered = vec![0.0; model.signals().len() * samples];
    model.remember(&plain, 1.0 / rate_hz, &shape, &mut History::default(), samples, &mut remembered);
    let named = model.signals().iter().zip(remembered.chunks_exact(samples));
    let named = named.map(|(name, values)| (name.as_str(), values));
    let channels: Vec<(&str, &[f64])> = read.iter().copied().chain(named).collect();
    model.regressor(&MotionBlock { channels: &channels, ..plain }, &shape, &mut block);
    (0..model.outputs().len()).map(|output| block.effort(output, values)).collect()
}
