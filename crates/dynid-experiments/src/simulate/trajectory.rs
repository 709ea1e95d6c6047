//! Wanted motion of a virtual robot.

use std::collections::BTreeMap;

use dynid_identify::Error;
use dynid_logs::TrajectoryFile;
use dynid_logs::trajectory::TrajectorySamples;
use dynid_model::{ClosedModel, MotionBlock, RobotModel};
use dynid_motion::trajectory::{Form, Fourier, Point, Trajectory};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::settings::SimulateSettings;

/// Motion that the robot is to make.
pub(super) enum Reference {
    /// One periodic series per joint.
    Series(Vec<Fourier>),
    /// A trajectory file; coordinate of every joint.
    File(Box<dyn Trajectory>, Vec<usize>),
}

/// Channels by name: points `[time in s, value]`.
pub(super) type Channels = BTreeMap<String, Vec<[f64; 2]>>;

impl Reference {
    /// From the trajectory file that the settings name, else series; with the channels that the file has.
    pub(super) fn new(
        model: &RobotModel,
        settings: &SimulateSettings,
        rng: &mut ChaCha8Rng,
    ) -> Result<(Self, Channels), Error> {
        let Some(path) = &settings.follow else {
            return Ok((Reference::Series(series(model, settings, rng)?), Channels::new()));
        };
        let joints: Vec<String> = model.joints().iter().map(|j| j.name.clone()).collect();
        let missing = |joint: String| Error::InFile {
            file: path.display().to_string(),
            source: Box::new(Error::setting("joints", &format!("a trajectory of joint `{joint}`"), "none")),
        };
        if TrajectorySamples::is_table(path) {
            let TrajectorySamples { joints: found, motion, channels } = TrajectorySamples::read(path)?;
            let place = |joint: &String| found.iter().position(|f| f == joint);
            let order = joints.iter().map(|joint| place(joint).ok_or_else(|| missing(joint.clone())));
            let order = order.collect::<Result<_, _>>()?;
            let points = |values: Vec<f64>| {
                motion.knots().time.iter().zip(values).map(|(t, x)| [*t, x]).collect::<Vec<_>>()
            };
            let channels = channels.into_iter().map(|(name, values)| (name, points(values))).collect();
            return Ok((Reference::File(Box::new(motion), order), channels));
        }
        let file = TrajectoryFile::read(path)?;
        let order = file.order_of(&joints).map_err(missing)?;
        Ok((Reference::File(Box::new(file.sequence()?), order), Channels::new()))
    }

    /// Duration of a trajectory file, s.
    pub(super) fn duration(&self) -> Option<f64> {
        match self {
            Reference::Series(_) => None,
            Reference::File(motion, _) => Some(motion.duration()),
        }
    }

    /// Position, velocity and acceleration of all joints at a time.
    pub(super) fn at(&self, time: f64) -> Vec<[f64; 3]> {
        let wanted = |p: Point| [p.position, p.velocity, p.acceleration];
        match self {
            Reference::Series(series) => series.iter().map(|s| wanted(s.at(time))).collect(),
            Reference::File(motion, order) => {
                let mut points = vec![Point::default(); motion.coordinates()];
                motion.at(time, &mut points);
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
        out = within_reach((model, closed), out, settings)?;
    }
    let names: Vec<String> = driven(model).map(|rate| model.joints()[rate].name.clone()).collect();
    settings.check_random(&names)?;
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
            let (low, high) = window(model, rate, homes.as_ref().map(|h| h[rate]));
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
            let speed = speed_limit(model, rate);
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

/// Where a joint may move: within its limits, at most so far; drives of a mechanism with loops about `home`.
fn window(model: &RobotModel, rate: usize, home: Option<f64>) -> (f64, f64) {
    let limits = model.limits(rate).position;
    let reach = if model.joints()[rate].slides { 0.5 } else { 2.0 };
    match home {
        None => {
            let (low, high) = limits.unwrap_or((-reach, reach));
            (low.max(-2.0 * reach), high.min(2.0 * reach))
        }
        Some(home) => {
            let (low, high) = limits.unwrap_or((home - reach, home + reach));
            (low.max(home - reach).min(home), high.min(home + reach).max(home))
        }
    }
}

/// Speed limit of a joint; 2 rad/s or m/s where none is stated.
fn speed_limit(model: &RobotModel, rate: usize) -> f64 {
    model.limits(rate).velocity.unwrap_or(2.0)
}

/// Highest frequency of the motion of a mechanism with loops, Hz.
const MOST_HZ: f64 = 2.0;
/// Times per period at which poses are tried, and how often the motion is made smaller.
const TRIED: usize = 1000;
const SMALLER: usize = 60;
/// Share of the measure of singularity at home that all poses keep.
const LEAST_MEASURE: f64 = 0.25;
/// Ways from home to the middle of the drives' windows on which the middle of the motion may lie.
const WAYS: [f64; 5] = [0.0, 0.25, 0.5, 0.75, 1.0];

/// Returns the motion, all drives smaller by the same factor until the mechanism can follow it away from singular poses, about
/// that place between home and the middle of the drives' windows that leaves most room.
fn within_reach(
    (model, closed): (&RobotModel, &ClosedModel),
    series: Vec<Fourier>,
    settings: &SimulateSettings,
) -> Result<Vec<Fourier>, Error> {
    let homes = homes(closed);
    let windows = homes.iter().enumerate().map(|(rate, home)| window(model, rate, Some(*home))).collect();
    let swing = Swing::new(closed, (homes, windows), &series, settings);
    let ways = if swing.home_is_middle() { &WAYS[..1] } else { &WAYS[..] };
    let mut best: Option<(f64, Vec<f64>)> = None;
    for way in ways {
        let about = swing.about(*way);
        let least = best.as_ref().map_or(0.0, |(scale, _)| *scale);
        if let Some(scale) = swing.largest(&about).filter(|scale| *scale > least) {
            best = Some((scale, about));
        }
    }
    let Some((scale, about)) = best else {
        return Err(Error::Unsupported(
            "no random motion about the home position stays within reach".to_owned(),
        ));
    };
    let moved = series.iter().zip(about).map(|(s, middle)| {
        let (a, b) = s.coefficients(Form::Plain);
        let scaled = |x: Vec<f64>| x.into_iter().map(|x| scale * x).collect::<Vec<f64>>();
        Fourier::plain(s.base(), middle, scaled(a), scaled(b))
            .map_err(|e| Error::setting("harmonics", "a trajectory", e))
    });
    let moved = moved.collect::<Result<Vec<Fourier>, Error>>()?;
    match settings.period_s {
        Some(_) => Ok(moved),
        None => livelier(model, moved, settings),
    }
}

/// Returns the motion, as many whole times in the log as speeds and accelerations leave room for: what had to be made smaller
/// would be slow.
fn livelier(
    model: &RobotModel,
    series: Vec<Fourier>,
    settings: &SimulateSettings,
) -> Result<Vec<Fourier>, Error> {
    let times = series.iter().enumerate().map(|(rate, s)| {
        let peak = |pick: fn(Point) -> f64| {
            let sizes = (0..TRIED).map(|k| pick(s.at(s.period() * k as f64 / TRIED as f64)).abs());
            sizes.fold(f64::MIN_POSITIVE, f64::max)
        };
        let speed = settings.share * speed_limit(model, rate) / peak(|p| p.velocity);
        speed.min((settings.share * settings.acceleration / peak(|p| p.acceleration)).sqrt())
    });
    let fastest = MOST_HZ * settings.duration_s / settings.harmonics as f64;
    let times = times.fold(fastest, f64::min).floor().max(1.0);
    let faster = series.into_iter().map(|s| {
        let (a, b) = s.coefficients(Form::Plain);
        Fourier::plain(times * s.base(), s.offset(), a, b)
            .map_err(|e| Error::setting("harmonics", "a trajectory", e))
    });
    faster.collect()
}

/// Drives of a mechanism with loops along a random motion, about the middles of their windows.
struct Swing<'a> {
    closed: &'a ClosedModel,
    homes: Vec<f64>,
    windows: Vec<(f64, f64)>,
    /// Share of the windows that is used.
    share: f64,
    /// Per drive.
    middles: Vec<f64>,
    /// Per drive: positions along the motion, its middle taken away.
    moved: Vec<Vec<f64>>,
    /// Least measure of singularity.
    least: f64,
}

impl<'a> Swing<'a> {
    fn new(
        closed: &'a ClosedModel,
        (homes, windows): (Vec<f64>, Vec<(f64, f64)>),
        series: &[Fourier],
        settings: &SimulateSettings,
    ) -> Self {
        let period = settings.period_s.unwrap_or(settings.duration_s);
        let machine = closed.machine();
        let moved = |s: &Fourier| {
            let at = |k: usize| s.at(period * k as f64 / TRIED as f64).position - s.offset();
            (0..=TRIED).map(at).collect()
        };
        Swing {
            closed,
            homes,
            windows,
            share: settings.share,
            middles: series.iter().map(Fourier::offset).collect(),
            moved: series.iter().map(moved).collect(),
            least: LEAST_MEASURE * machine.singularity(&machine.workspace()).measure,
        }
    }

    fn home_is_middle(&self) -> bool {
        self.homes.iter().zip(&self.middles).all(|(home, middle)| (home - middle).abs() < 1e-9)
    }

    /// A place on the way from home to the middles.
    fn about(&self, way: f64) -> Vec<f64> {
        self.homes.iter().zip(&self.middles).map(|(home, middle)| home + way * (middle - home)).collect()
    }

    /// Largest scale of the motion about a place that can be followed; `None` if there is none.
    fn largest(&self, about: &[f64]) -> Option<f64> {
        let room = |j: usize| {
            let most = self.moved[j].iter().fold(f64::MIN_POSITIVE, |m: f64, x| m.max(x.abs()));
            let (low, high) = self.windows[j];
            self.share * (high - about[j]).min(about[j] - low) / most
        };
        let room = (0..about.len()).map(room).fold(1.0, f64::min);
        let scales = (0..SMALLER).map(|k| room * 0.85f64.powi(k as i32));
        (room > 0.0).then_some(scales).into_iter().flatten().find(|scale| self.follows(about, *scale))
    }

    fn follows(&self, about: &[f64], scale: f64) -> bool {
        let drives = self.moved.iter().zip(about);
        let moved: Vec<f64> = drives.flat_map(|(own, at)| own.iter().map(move |x| at + scale * x)).collect();
        let still = vec![0.0; moved.len()];
        let mut measure = f64::INFINITY;
        let block = MotionBlock::plain(TRIED + 1, &moved, &still, &still);
        let machine = self.closed.machine();
        let reached = self.closed.follow(&block, |sample, pose| {
            if sample % 10 == 0 {
                measure = measure.min(machine.singularity(pose).measure);
            }
        });
        reached.is_ok() && measure >= self.least
    }
}
