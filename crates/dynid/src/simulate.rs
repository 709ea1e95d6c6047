//! Virtual logs by inverse dynamics: trajectory, elements, noise, encoder, seeded.

use dynid_model::{EffortModel, MotionBlock, RandomMotion, RegressorBlock, RobotModel};
use dynid_motion::trajectory::Fourier;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::Deserialize;

use crate::Error;
use crate::elements::ElementPlan;
use crate::robot::Robot;

/// What a virtual log is made of.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SimulateSettings {
    /// Length, s. Default 20.
    pub duration_s: f64,
    /// Sample rate, Hz. Default 500.
    pub rate_hz: f64,
    /// Harmonics of the trajectory. Default 5.
    pub harmonics: usize,
    /// Period of the trajectory, s. Default: the duration.
    pub period_s: Option<f64>,
    /// Share of the position and velocity limits that the motion uses. Default 0.8.
    pub share: f64,
    /// Noise of the effort as a share of its rms. Default 0.02.
    pub effort_noise: f64,
    /// Encoder resolution, bits per turn (per metre for sliding joints); 0: exact. Default 18.
    pub encoder_bits: u32,
    /// Lead of the logged effort before the motion, samples. Default 0.5 (a command held over a sample).
    pub delay_samples: f64,
    /// Largest acceleration, rad/s² or m/s². Default 6.
    pub acceleration: f64,
    /// Values of parameters that the robot file does not state, by name (`j1.fc`).
    pub values: std::collections::BTreeMap<String, f64>,
    /// Seed of trajectory and noise. Default 1.
    pub seed: u64,
}

impl Default for SimulateSettings {
    fn default() -> Self {
        SimulateSettings {
            duration_s: 20.0,
            rate_hz: 500.0,
            harmonics: 5,
            period_s: None,
            share: 0.8,
            effort_noise: 0.02,
            encoder_bits: 18,
            delay_samples: 0.5,
            acceleration: 6.0,
            values: std::collections::BTreeMap::new(),
            seed: 1,
        }
    }
}

impl SimulateSettings {
    /// Parses settings from TOML.
    ///
    /// # Errors
    /// [`Error::Config`] with the line.
    pub fn parse(text: &str, file: &str) -> Result<Self, Error> {
        toml::from_str(text).map_err(|e| Error::Config {
            file: file.to_owned(),
            line: e.span().map(|s| 1 + text[..s.start.min(text.len())].matches('\n').count()),
            message: e.message().lines().next().unwrap_or_default().to_owned(),
        })
    }
}

/// A virtual log with the truth beside it.
#[derive(Debug, Clone)]
pub struct SimulatedLog {
    /// Joints.
    pub joints: Vec<String>,
    /// Time, s.
    pub time: Vec<f64>,
    /// Per joint: position as the encoder reads it.
    pub position: Vec<Vec<f64>>,
    /// Per joint: effort with noise.
    pub effort: Vec<Vec<f64>>,
    /// Per joint: true position, velocity, acceleration, effort at the same times.
    pub clean: [Vec<Vec<f64>>; 4],
    /// Parameters of the truth: name, value.
    pub truth: Vec<(String, f64)>,
}

/// Runs a random Fourier trajectory within the robot's limits through its inverse dynamics.
///
/// Link inertias and stated element values come from the robot file; elements without a stated value get one that is
/// typical for the joint: Coulomb 10 % and viscous 10 % (at the speed limit) of the largest rigid effort over random
/// states, no offset, no rotor. It does not depend on the trajectory, so logs of one robot have one truth.
///
/// # Errors
/// [`Error::Setting`], [`Error::Unsupported`].
pub fn simulate(robot: &Robot, settings: &SimulateSettings) -> Result<SimulatedLog, Error> {
    check(settings)?;
    let mechanism = &robot.mechanism;
    if mechanism.positions() != mechanism.rates() {
        return Err(Error::Unsupported(
            "a floating base has no joint log: simulate the arm alone".to_owned(),
        ));
    }
    let plan = ElementPlan::new(mechanism, &robot.elements, None, |_| true)?;
    let model = RobotModel::new(mechanism.clone(), plan.build(mechanism)?);
    if !model.channels().is_empty() {
        return Err(Error::Unsupported(format!(
            "elements that read the channels {} cannot be simulated: inverse dynamics makes no such channel",
            model.channels().join(", ")
        )));
    }
    let n = mechanism.rates();
    let samples = (settings.duration_s * settings.rate_hz).round() as usize + 1;
    let mut rng = ChaCha8Rng::seed_from_u64(settings.seed);
    let trajectories = trajectories(&model, settings, &mut rng)?;
    let sample = |shift: f64| {
        let mut signals = [vec![0.0; n * samples], vec![0.0; n * samples], vec![0.0; n * samples]];
        for (j, trajectory) in trajectories.iter().enumerate() {
            for s in 0..samples {
                let point = trajectory.at((s as f64 + shift) / settings.rate_hz);
                signals[0][j * samples + s] = point.position;
                signals[1][j * samples + s] = point.velocity;
                signals[2][j * samples + s] = point.acceleration;
            }
        }
        signals
    };
    let at = sample(0.0);
    let values = truth(&model, &plan, settings)?;
    let clean_effort = efforts(&model, &values, &at, samples);
    // The logged effort belongs to the motion that follows it.
    let led = efforts(&model, &values, &sample(settings.delay_samples), samples);
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
    let effort = led
        .iter()
        .map(|e| {
            let sigma = settings.effort_noise * dynid_motion::signal::rms(e);
            e.iter()
                .map(|x| {
                    let noise: f64 = StandardNormal.sample(&mut rng);
                    x + sigma * noise
                })
                .collect()
        })
        .collect();
    let names = model.parameters().linear.iter().map(|p| p.name.clone());
    Ok(SimulatedLog {
        joints: mechanism.rate_names(),
        time: (0..samples).map(|s| s as f64 / settings.rate_hz).collect(),
        position,
        effort,
        clean: [split(&at[0]), split(&at[1]), split(&at[2]), clean_effort],
        truth: names.zip(values).collect(),
    })
}

fn check(s: &SimulateSettings) -> Result<(), Error> {
    let positive = [
        ("duration_s", s.duration_s),
        ("rate_hz", s.rate_hz),
        ("share", s.share),
        ("acceleration", s.acceleration),
        ("period_s", s.period_s.unwrap_or(1.0)),
    ];
    for (name, x) in positive {
        if !(x.is_finite() && x > 0.0) {
            return Err(setting(name, "a positive number", x));
        }
    }
    for (name, x) in [("effort_noise", s.effort_noise), ("delay_samples", s.delay_samples.abs())] {
        if !(x.is_finite() && x >= 0.0) {
            return Err(setting(name, "a finite number", x));
        }
    }
    if s.duration_s * s.rate_hz > 1e8 {
        return Err(setting("duration_s", "at most 1e8 samples", s.duration_s));
    }
    if !(1..=100).contains(&s.harmonics) {
        return Err(setting("harmonics", "1 to 100", s.harmonics));
    }
    if s.encoder_bits > 40 {
        return Err(setting("encoder_bits", "at most 40", s.encoder_bits));
    }
    Ok(())
}

fn setting(name: &str, expected: &str, found: impl ToString) -> Error {
    Error::Setting { name: name.to_owned(), expected: expected.to_owned(), found: found.to_string() }
}

/// One random Fourier series per joint, scaled so that position, speed and acceleration stay within their share.
fn trajectories(
    model: &RobotModel,
    settings: &SimulateSettings,
    rng: &mut ChaCha8Rng,
) -> Result<Vec<Fourier>, Error> {
    let base = std::f64::consts::TAU / settings.period_s.unwrap_or(settings.duration_s);
    let owners = model.mechanism().rate_bodies();
    owners
        .iter()
        .map(|body| {
            let joint = &model.mechanism().bodies()[*body].joint;
            let reach = if joint.effort_unit() == "N" { 0.5 } else { 2.0 };
            let (low, high) = joint.limits.position.unwrap_or((-reach, reach));
            let (low, high) = (low.max(-2.0 * reach), high.min(2.0 * reach));
            let middle = 0.5 * (low + high);
            let mut draw = || -> Vec<f64> {
                (0..settings.harmonics).map(|k| rng.random_range(-1.0..=1.0) / (1.0 + k as f64)).collect()
            };
            let (a, b) = (draw(), draw());
            let fourier = |scale: f64| {
                let scaled = |v: &[f64]| v.iter().map(|x| x * scale).collect::<Vec<f64>>();
                Fourier::plain(base, middle, scaled(&a), scaled(&b))
                    .map_err(|e| setting("harmonics", "a trajectory", e))
            };
            let unit = fourier(1.0)?;
            let period = std::f64::consts::TAU / base;
            let peak = |pick: &dyn Fn(&dynid_motion::trajectory::Point) -> f64| {
                (0..2000)
                    .map(|k| pick(&unit.at(period * f64::from(k) / 2000.0)).abs())
                    .fold(f64::MIN_POSITIVE, f64::max)
            };
            let speed = joint.limits.velocity.unwrap_or(2.0);
            let scale = (settings.share * 0.5 * (high - low) / peak(&|p| p.position - middle))
                .min(settings.share * speed / peak(&|p| p.velocity))
                .min(settings.share * settings.acceleration / peak(&|p| p.acceleration));
            fourier(scale)
        })
        .collect()
}

fn efforts(model: &RobotModel, values: &[f64], signals: &[Vec<f64>; 3], samples: usize) -> Vec<Vec<f64>> {
    let mut block = RegressorBlock::new(model.layout().clone(), samples);
    let motion = MotionBlock {
        samples,
        stride: samples,
        q: &signals[0],
        dq: &signals[1],
        ddq: &signals[2],
        gravity: None,
        channels: &[],
        sign_width: 0.0,
    };
    model.regressor(&motion, &[], &mut block);
    (0..model.outputs().len()).map(|output| block.effort(output, values)).collect()
}

/// Seed of the states that typical friction is scaled by: the same robot always gets the same truth.
const TYPICAL_SEED: u64 = 1;

fn truth(model: &RobotModel, plan: &ElementPlan, settings: &SimulateSettings) -> Result<Vec<f64>, Error> {
    let table = model.parameters();
    let mut values = table.prior();
    let peaks = typical_efforts(model, &values);
    let owners = model.mechanism().rate_bodies();
    let mut given: Vec<(String, f64)> = Vec::new();
    for (j, joint) in model.joints().iter().enumerate() {
        let speed = model.mechanism().bodies()[owners[j]].joint.limits.velocity.unwrap_or(2.0);
        for (symbol, value) in [("fc", 0.1 * peaks[j]), ("fv", 0.1 * peaks[j] / speed)] {
            given.push((format!("{}.{symbol}", joint.name), value));
        }
    }
    given.extend(plan.stated_values());
    for (name, value) in given {
        if let Some(column) = table.column(&name) {
            values[column] = value;
        }
    }
    for (name, value) in &settings.values {
        let Some(column) = table.column(name) else {
            return Err(setting("values", "names of parameters such as `j1.fc`", name));
        };
        if !value.is_finite() {
            return Err(setting(&format!("values.{name}"), "a finite number", value));
        }
        values[column] = *value;
    }
    Ok(values)
}

/// Largest rigid effort of every joint over random states.
fn typical_efforts(model: &RobotModel, values: &[f64]) -> Vec<f64> {
    const STATES: usize = 100;
    let motion = RandomMotion::new(model.mechanism(), model.channels(), STATES, TYPICAL_SEED);
    let mut block = RegressorBlock::new(model.layout().clone(), STATES);
    motion.with_block(|m| model.regressor(m, &[], &mut block));
    (0..model.outputs().len())
        .map(|j| block.effort(j, values).iter().fold(0.0_f64, |m, x| m.max(x.abs())))
        .collect()
}
