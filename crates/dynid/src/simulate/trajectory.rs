//! Wanted motion of a virtual robot.

use dynid_io::TrajectoryFile;
use dynid_model::{ClosedModel, MotionBlock, RobotModel};
use dynid_motion::trajectory::{Form, Fourier, Point, Sequence, Trajectory};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::settings::SimulateSettings;
use crate::Error;

/// Motion that the robot is to make.
pub(super) enum Reference {
    /// One periodic series per joint.
    Series(Vec<Fourier>),
    /// A trajectory file; coordinate of every joint.
    File(Sequence, Vec<usize>),
}

impl Reference {
    /// From the trajectory file that the settings name, else series.
    pub(super) fn new(
        model: &RobotModel,
        settings: &SimulateSettings,
        rng: &mut ChaCha8Rng,
    ) -> Result<Self, Error> {
        let Some(path) = &settings.follow else {
            return Ok(Reference::Series(series(model, settings, rng)?));
        };
        let file = TrajectoryFile::read(path)?;
        let joints: Vec<String> = model.joints().iter().map(|j| j.name.clone()).collect();
        let order = file.order_of(&joints).map_err(|joint| Error::InFile {
            file: path.display().to_string(),
            source: Box::new(Error::setting("joints", &format!("a trajectory of joint `{joint}`"), "none")),
        })?;
        Ok(Reference::File(file.sequence()?, order))
    }

    /// Duration of a trajectory file, s.
    pub(super) fn duration(&self) -> Option<f64> {
        match self {
            Reference::Series(_) => None,
            Reference::File(sequence, _) => Some(sequence.duration()),
        }
    }

    /// Position, velocity and acceleration of all joints at a time.
    pub(super) fn at(&self, time: f64) -> Vec<[f64; 3]> {
        let wanted = |p: Point| [p.position, p.velocity, p.acceleration];
        match self {
            Reference::Series(series) => series.iter().map(|s| wanted(s.at(time))).collect(),
            Reference::File(sequence, order) => {
                let mut points = vec![Point::default(); sequence.coordinates()];
                sequence.at(time, &mut points);
                order.iter().map(|c| wanted(points[*c])).collect()
            }
        }
    }
}

/// One Fourier series per joint: as the settings state it, else a random one.
fn series(
    model: &RobotModel,
    settings: &SimulateSettings,
    rng: &mut ChaCha8Rng,
) -> Result<Vec<Fourier>, Error> {
    let mut out = random(model, settings, rng)?;
    if let Some(closed) = model.closed()
        && settings.trajectory.is_empty()
    {
        out = within_reach(closed, out, settings)?;
    }
    let names: Vec<String> = driven(model).map(|rate| model.joints()[rate].name.clone()).collect();
    for (joint, series) in &settings.trajectory {
        let Some(j) = names.iter().position(|n| n == joint) else {
            return Err(Error::UnknownJoint { name: joint.clone(), known: names });
        };
        out[j] = Fourier::plain(out[j].base(), series.offset, series.sine.clone(), series.cosine.clone())
            .map_err(|e| Error::setting(&format!("trajectory.{joint}"), "a Fourier series", e))?;
    }
    Ok(out)
}

/// Rates whose motion is chosen: all but motors behind springs, which come last.
fn driven(model: &RobotModel) -> impl Iterator<Item = usize> {
    (0..model.joints().len()).filter(|rate| model.elastic_link(*rate).is_none())
}

/// One random Fourier series per joint, scaled so that position, speed and acceleration stay within their share.
fn random(
    model: &RobotModel,
    settings: &SimulateSettings,
    rng: &mut ChaCha8Rng,
) -> Result<Vec<Fourier>, Error> {
    let base = std::f64::consts::TAU / settings.period_s.unwrap_or(settings.duration_s);
    let homes = model.closed().map(homes);
    driven(model)
        .map(|rate| {
            let limits = model.limits(rate);
            let reach = if model.joints()[rate].slides { 0.5 } else { 2.0 };
            let (low, high) = match homes.as_ref().map(|h| h[rate]) {
                None => {
                    let (low, high) = limits.position.unwrap_or((-reach, reach));
                    (low.max(-2.0 * reach), high.min(2.0 * reach))
                }
                // Drives of a mechanism with loops move about its home position.
                Some(home) => {
                    let (low, high) = limits.position.unwrap_or((home - reach, home + reach));
                    let room = (high - home).min(home - low).clamp(0.0, reach);
                    (home - room, home + room)
                }
            };
            let middle = 0.5 * (low + high);
            let mut draw = || -> Vec<f64> {
                (0..settings.harmonics).map(|k| rng.random_range(-1.0..=1.0) / (1.0 + k as f64)).collect()
            };
            let (a, b) = (draw(), draw());
            let fourier = |scale: f64| {
                let scaled = |v: &[f64]| v.iter().map(|x| x * scale).collect::<Vec<f64>>();
                Fourier::plain(base, middle, scaled(&a), scaled(&b))
                    .map_err(|e| Error::setting("harmonics", "a trajectory", e))
            };
            let unit = fourier(1.0)?;
            let period = std::f64::consts::TAU / base;
            let peak = |pick: &dyn Fn(&dynid_motion::trajectory::Point) -> f64| {
                (0..2000)
                    .map(|k| pick(&unit.at(period * f64::from(k) / 2000.0)).abs())
                    .fold(f64::MIN_POSITIVE, f64::max)
            };
            let speed = limits.velocity.unwrap_or(2.0);
            let scale = (settings.share * 0.5 * (high - low) / peak(&|p| p.position - middle))
                .min(settings.share * speed / peak(&|p| p.velocity))
                .min(settings.share * settings.acceleration / peak(&|p| p.acceleration));
            fourier(scale)
        })
        .collect()
}

/// Home positions of the drives of a mechanism with loops.
fn homes(closed: &ClosedModel) -> Vec<f64> {
    let machine = closed.machine();
    machine.driven().iter().map(|rate| machine.home()[machine.position_of(*rate)]).collect()
}

/// Times per period at which poses are tried, and how often the motion is made smaller.
const TRIED: usize = 1000;
const SMALLER: usize = 60;
/// Share of the measure of singularity at home that all poses keep.
const LEAST_MEASURE: f64 = 0.25;

/// The same motion, all drives smaller by the same factor until the mechanism can follow it away from singular poses.
fn within_reach(
    closed: &ClosedModel,
    series: Vec<Fourier>,
    settings: &SimulateSettings,
) -> Result<Vec<Fourier>, Error> {
    let machine = closed.machine();
    let least = LEAST_MEASURE * machine.singularity(&machine.workspace()).measure;
    let period = settings.period_s.unwrap_or(settings.duration_s);
    let time = |k: usize| period * k as f64 / TRIED as f64;
    let mut scale = 1.0;
    let homes = homes(closed);
    for _ in 0..SMALLER {
        let moved: Vec<f64> = series
            .iter()
            .zip(&homes)
            .flat_map(|(s, home)| (0..=TRIED).map(move |k| home + scale * (s.at(time(k)).position - home)))
            .collect();
        let still = vec![0.0; moved.len()];
        let mut measure = f64::INFINITY;
        let block = MotionBlock::plain(TRIED + 1, &moved, &still, &still);
        let reached = closed.follow(&block, |sample, pose| {
            if sample % 10 == 0 {
                measure = measure.min(machine.singularity(pose).measure);
            }
        });
        if reached.is_ok() && measure >= least {
            return series
                .iter()
                .zip(&homes)
                .map(|(s, home)| {
                    let (a, b) = s.coefficients(Form::Plain);
                    let scaled = |x: Vec<f64>| x.into_iter().map(|x| scale * x).collect::<Vec<f64>>();
                    Fourier::plain(s.base(), *home, scaled(a), scaled(b))
                        .map_err(|e| Error::setting("harmonics", "a trajectory", e))
                })
                .collect();
        }
        scale *= 0.85;
    }
    Err(Error::Unsupported("no random motion about the home position stays within reach".to_owned()))
}
