//! Virtual friction experiments: one joint to and fro at constant speeds, and within its friction.

use dynid::model::EffortModel;
use dynid::motion::{Channel, JointSignals, Log};
use dynid::sim::{
    ControlSettings, ExperimentSettings, Imperfections, Integrator, PlantState, Profile, Ripple, run,
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::fault;
use super::robot::SingleJoint;
use super::settings::Settings;
use crate::StudyError;

/// Slowest and fastest level, rad/s.
pub(super) const SPEEDS: [f64; 2] = [0.01, 2.4];
/// Acceleration between levels, rad/s².
const ACCELERATION: f64 = 3.0;
/// Longest way at constant speed, rad, and longest time for it, s.
const LONGEST: (f64, f64) = (1.2, 4.0);
/// Sample and control rate of the sweeps, Hz.
const RATE_HZ: f64 = 500.0;
/// Half of the temperature's drift within a test, K.
const DRIFT: f64 = 0.5;

/// Speeds of the levels, evenly spaced in their logarithm.
pub(super) fn levels(count: usize) -> Vec<f64> {
    let [low, high] = SPEEDS;
    (0..count).map(|k| low * (high / low).powf(k as f64 / (count - 1) as f64)).collect()
}

/// Motion with piecewise constant acceleration, from rest at a start: `(duration, acceleration)`.
struct Staircase {
    /// Start time, position, velocity, acceleration of every piece.
    pieces: Vec<[f64; 4]>,
    duration: f64,
}

impl Staircase {
    /// Every level forward and back again, about the middle position 0.
    fn new(levels: &[f64]) -> Self {
        let mut moves = vec![(0.2, 0.0)];
        for v in levels {
            let ramp = v / ACCELERATION;
            let steady = (LONGEST.0 / v).min(LONGEST.1);
            for direction in [1.0, -1.0] {
                moves.extend([
                    (ramp, direction * ACCELERATION),
                    (steady, 0.0),
                    (ramp, -direction * ACCELERATION),
                ]);
                moves.push((0.1, 0.0));
            }
        }
        let fastest = levels.iter().copied().fold(0.0, f64::max);
        let widest = fastest * fastest / ACCELERATION + LONGEST.0.min(fastest * LONGEST.1);
        let mut state = [0.0, -0.5 * widest, 0.0];
        let mut pieces = Vec::new();
        for (duration, a) in moves {
            let [t, q, v] = state;
            pieces.push([t, q, v, a]);
            // A piece without acceleration after a whole move is a stop, whatever rounding has left.
            let v_end = v + a * duration;
            let v_end = if v_end.abs() < 1e-12 { 0.0 } else { v_end };
            state = [t + duration, q + v * duration + 0.5 * a * duration * duration, v_end];
        }
        Staircase { pieces, duration: state[0] }
    }

    fn at(&self, time: f64) -> [f64; 3] {
        let k = self.pieces.partition_point(|p| p[0] <= time).max(1) - 1;
        let [t, q, v, a] = self.pieces[k];
        let dt = (time - t).max(0.0);
        [q + v * dt + 0.5 * a * dt * dt, v + a * dt, a]
    }
}

/// The log of all speed levels of a joint about one temperature.
pub(super) fn sweep(
    joint: usize,
    arm: &SingleJoint,
    settings: &Settings,
    (temperature, levels): (f64, &[f64]),
    seed: u64,
) -> Result<Log, StudyError> {
    let motion = Staircase::new(levels);
    let simulation = &settings.simulation;
    let channel = Profile::new(vec![(0.0, temperature - DRIFT), (motion.duration, temperature + DRIFT)])
        .map_err(fault)?;
    let experiment = ExperimentSettings {
        duration_s: motion.duration,
        log_rate_hz: RATE_HZ,
        tolerance: 1e-6,
        control: ControlSettings { rate_hz: RATE_HZ, ..ControlSettings::default() },
        imperfections: Imperfections {
            encoder_bits: simulation.encoder_bits,
            effort_noise: vec![simulation.torque_noise[joint]],
            ripple: Some(vec![Ripple {
                amplitude: -simulation.ripple[joint],
                cycles: 2.0,
                phase: joint as f64,
            }]),
            ..Imperfections::none()
        },
        channels: vec![channel],
        seed,
    };
    let reference = |time: f64| vec![motion.at(time)];
    let result = run(&mut arm.plant()?, &arm.plant()?, &reference, &experiment)?.log;
    log(arm, result.time, result.position, result.effort, result.channels)
}

/// Resolution of the motor's encoder seen at the joint, rad: standard deviation of the noise.
const MOTOR_NOISE: f64 = 2e-6;
/// Sample rate, Hz, base frequency, Hz, and duration, s, of motion within friction.
const PRESLIDING: (f64, f64, f64) = (4000.0, 3.0, 2.0);

/// Torque `A (sin ωt + 0.5 sin 2.3 ωt)` with `A = 0.7 F_s` on a joint at rest, the motion of about 1 mrad it gives, and the
/// constant torque beneath it.
pub(super) fn presliding(
    joint: usize,
    arm: &SingleJoint,
    settings: &Settings,
    temperature: f64,
    seed: u64,
) -> Result<(Log, f64), StudyError> {
    let (rate, frequency, duration) = PRESLIDING;
    let plant = arm.plant()?;
    let mut integrator = Integrator::new(&plant, 1e-6)?;
    let mut work = plant.workspace();
    // Gravity of the upright pose is held by the drive throughout.
    let still = [&[0.0][..]; 3];
    let gravity = plant.drive_effort(still, &[temperature], &mut work)[0];
    let amplitude = 0.7 * settings.friction[joint].fixed;
    let omega = std::f64::consts::TAU * frequency;
    let mut state = PlantState {
        q: vec![0.0],
        dq: vec![0.0],
        history: Default::default(),
        drive_work: 0.0,
        element_work: 0.0,
    };
    let samples = (duration * rate) as usize;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (mut time, mut position, mut effort) = (Vec::new(), Vec::new(), Vec::new());
    for k in 0..samples {
        let t = k as f64 / rate;
        let drive = gravity + amplitude * ((omega * t).sin() + 0.5 * (2.3 * omega * t).sin());
        time.push(t);
        let noise: f64 = StandardNormal.sample(&mut rng);
        position.push(state.q[0] + MOTOR_NOISE * noise);
        effort.push(drive);
        integrator.advance(&mut state, &[drive], &[temperature], t, 1.0 / rate)?;
    }
    let log = log(arm, time, vec![position], vec![effort], vec![vec![temperature; samples]])?;
    Ok((log, gravity))
}

fn log(
    arm: &SingleJoint,
    time: Vec<f64>,
    position: Vec<Vec<f64>>,
    effort: Vec<Vec<f64>>,
    channels: Vec<Vec<f64>>,
) -> Result<Log, StudyError> {
    let joints = position.into_iter().zip(effort).map(|(position, effort)| JointSignals {
        name: arm.name.clone(),
        position,
        velocity: None,
        effort,
    });
    let channels = arm.model.channels().iter().zip(channels);
    let channels = channels.map(|(name, values)| Channel { name: name.clone(), values });
    Ok(Log::new(&*arm.name, time, joints.collect(), channels.collect()).map_err(dynid::Error::from)?)
}
