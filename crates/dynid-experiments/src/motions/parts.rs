//! From a part of the configuration to pieces of motion within the limits.

use std::f64::consts::TAU;
use std::sync::Arc;

use dynid_excitation::{CircleSettings, PointCircle, TaskSpaceError};
use dynid_identify::Error;
use dynid_motion::trajectory::{
    Alone, FadedTones, PaulBlend, PaulTrack, Point, Profile, Quantity, QuinticSegment, QuinticSpline, Rest,
    Sampled, SweepSettings, Tone, Trajectory, TrajectoryError, sweeps,
};

use super::bench::Bench;
use super::config::{
    CircleConfig, MotionConfig, PartConfig, PreslidingConfig, SweepConfig, TrackConfig, key,
};
use super::fault::MotionFault;

/// How often a part is made slower until its limits are kept.
const ATTEMPTS: usize = 8;
/// Excess that is taken for rounding, in parts of the limit.
const ROUNDING: f64 = 1e-9;
/// Samples that a period of a sinusoid needs, so that polynomials between samples are the sinusoid.
const SAMPLES_PER_PERIOD: f64 = 10.0;
/// Distance of poses that counts as none, rad or m.
const SAME: f64 = 1e-12;

/// A stretch of motion.
#[derive(Clone)]
pub(super) struct Piece {
    pub(super) trajectory: Arc<dyn Trajectory>,
    /// Of a constant-speed pass: speed, start and end of the cruise after the piece begins, s.
    pub(super) cruise: Option<(f64, f64, f64)>,
}

impl Piece {
    fn new(trajectory: impl Trajectory + 'static) -> Self {
        Piece { trajectory: Arc::new(trajectory), cruise: None }
    }

    pub(super) fn first(&self) -> Vec<f64> {
        self.positions(0.0)
    }

    pub(super) fn last(&self) -> Vec<f64> {
        self.positions(self.trajectory.duration())
    }

    fn positions(&self, time: f64) -> Vec<f64> {
        let mut out = vec![Point::default(); self.trajectory.coordinates()];
        self.trajectory.at(time, &mut out);
        out.iter().map(|p| p.position).collect()
    }
}

/// Least and greatest value of every quantity of every coordinate, `[coordinate][quantity]`.
pub(super) type Ranges = Vec<[(f64, f64); 4]>;

/// A part within its limits.
pub(super) struct Part {
    pub(super) pieces: Vec<Piece>,
    pub(super) ranges: Ranges,
    /// How many times slower it runs than asked for.
    pub(super) slowed: f64,
}

/// Makes a part that begins wherever it likes, from rest to rest; pauses stay at `current`.
pub(super) fn part(
    bench: &Bench<'_>,
    config: &MotionConfig,
    (number, part): (usize, &PartConfig),
    current: &[f64],
) -> Result<Part, Error> {
    let mut slowed = 1.0;
    if let Some(fast) = too_fast(bench, part)? {
        if !config.slower {
            return Err(fast.fault(bench, part.title(number), false));
        }
        slowed = fast.factor;
    }
    for _ in 0..ATTEMPTS {
        let pieces = pieces(bench, (number, part), current, slowed)?;
        let ranges = ranges(bench, &pieces).map_err(|source| trajectory(number, part, source))?;
        let Some(worst) = worst(bench, &ranges) else { return Ok(Part { pieces, ranges, slowed }) };
        if !config.slower || worst.quantity == Quantity::Position {
            return Err(worst.fault(bench, part.title(number), false));
        }
        slowed *= worst.factor * (1.0 + ROUNDING);
    }
    let pieces = pieces(bench, (number, part), current, slowed)?;
    let ranges = ranges(bench, &pieces).map_err(|source| trajectory(number, part, source))?;
    match worst(bench, &ranges) {
        Some(worst) => Err(worst.fault(bench, part.title(number), true)),
        None => Ok(Part { pieces, ranges, slowed }),
    }
}

/// The way between two poses, from rest to rest, as short as the limits and whole samples allow; none between poses that are the same.
///
/// On a straight line in joint space, `q = from + (to - from)(10 s³ - 15 s⁴ + 6 s⁵)`.
pub(super) fn way(bench: &Bench<'_>, from: &[f64], to: &[f64]) -> Result<Option<Piece>, TrajectoryError> {
    let mut duration: f64 = 0.0;
    for ((a, b), limits) in from.iter().zip(to).zip(&bench.limits) {
        // Peaks of the quintic at unit distance and duration.
        let distance = (b - a).abs();
        duration = duration
            .max(1.875 * distance / limits.velocity)
            .max((10.0 / 3f64.sqrt() * distance / limits.acceleration).sqrt())
            .max((60.0 * distance / limits.jerk).cbrt());
    }
    if from.iter().zip(to).all(|(a, b)| (a - b).abs() <= SAME) {
        return Ok(None);
    }
    let rest = |pose: &[f64]| pose.iter().map(|q| Point::rest(*q)).collect::<Vec<_>>();
    let segment = QuinticSegment::new(&rest(from), &rest(to), bench.on_grid(duration))?;
    Ok(Some(Piece::new(segment)))
}

/// Ranges of quantities over pieces, between samples too.
pub(super) fn ranges(bench: &Bench<'_>, pieces: &[Piece]) -> Result<Ranges, TrajectoryError> {
    let mut out = vec![[(f64::INFINITY, f64::NEG_INFINITY); 4]; bench.joints.len()];
    for piece in pieces {
        let spline = QuinticSpline::new(Sampled::at_rate(&*piece.trajectory, bench.rate_hz)?)?;
        for (coordinate, ranges) in out.iter_mut().enumerate() {
            for (range, quantity) in ranges.iter_mut().zip(Quantity::ALL) {
                let (least, most) = spline.range(coordinate, quantity);
                *range = (range.0.min(least), range.1.max(most));
            }
        }
    }
    Ok(out)
}

/// The limit that asks for the slowest motion; positions first.
struct Worst {
    coordinate: usize,
    quantity: Quantity,
    found: f64,
    factor: f64,
}

impl Worst {
    fn fault(&self, bench: &Bench<'_>, part: String, slowed: bool) -> Error {
        let (low, high) = bench.limits[self.coordinate].of(self.quantity);
        let (joint, quantity, found) = (bench.joints[self.coordinate].clone(), self.quantity, self.found);
        MotionFault::Limit { part, joint, quantity, low, high, found, slowed }.into()
    }
}

/// A speed of a sweep beyond the limit, which says more than what the range has no room for.
fn too_fast(bench: &Bench<'_>, part: &PartConfig) -> Result<Option<Worst>, Error> {
    let Some(config) = &part.sweep else { return Ok(None) };
    let coordinate = bench.coordinate(&config.joint)?;
    let found = config.speeds.iter().copied().fold(0.0, f64::max);
    let factor = found / bench.limits[coordinate].velocity;
    let fast = Worst { coordinate, quantity: Quantity::Velocity, found, factor };
    Ok((factor > 1.0 + ROUNDING).then_some(fast))
}

fn worst(bench: &Bench<'_>, ranges: &Ranges) -> Option<Worst> {
    let mut worst: Option<Worst> = None;
    for (coordinate, (limits, ranges)) in bench.limits.iter().zip(ranges).enumerate() {
        for (quantity, range) in Quantity::ALL.into_iter().zip(ranges) {
            let (low, high) = limits.of(quantity);
            let excess = limits.excess(quantity, *range);
            if excess <= ROUNDING {
                continue;
            }
            let found = if range.1 - high > low - range.0 { range.1 } else { range.0 };
            // In a slower motion derivatives fall with powers of time.
            let factor = match quantity {
                Quantity::Position => f64::INFINITY,
                Quantity::Velocity => found.abs() / high,
                Quantity::Acceleration => (found.abs() / high).sqrt(),
                Quantity::Jerk => (found.abs() / high).cbrt(),
            };
            if worst.as_ref().is_none_or(|w| factor > w.factor) {
                worst = Some(Worst { coordinate, quantity, found, factor });
            }
        }
    }
    worst
}

fn trajectory(number: usize, part: &PartConfig, source: TrajectoryError) -> Error {
    MotionFault::Trajectory { part: part.title(number), source }.into()
}

/// Pieces of a part that runs so many times slower than asked for, without regard to limits.
fn pieces(
    bench: &Bench<'_>,
    (number, part): (usize, &PartConfig),
    current: &[f64],
    slowed: f64,
) -> Result<Vec<Piece>, Error> {
    let formed =
        |result: Result<Vec<Piece>, TrajectoryError>| result.map_err(|e| trajectory(number, part, e));
    if let Some(config) = &part.sweep {
        let coordinate = bench.coordinate(&config.joint)?;
        let limit = bench.limits[coordinate].acceleration;
        if let Some(found) = config.acceleration.filter(|a| *a > limit * (1.0 + ROUNDING)) {
            let expected = format!("at most {limit}, the limit of `{}`", config.joint);
            return Err(Error::setting(&key(number, "sweep.acceleration"), &expected, found));
        }
        return formed(sweep(bench, config, coordinate, slowed));
    }
    if let Some(config) = &part.presliding {
        let coordinate = bench.coordinate(&config.joint)?;
        let fastest = config.tones.iter().map(|t| t[0]).fold(0.0, f64::max);
        if bench.rate_hz < SAMPLES_PER_PERIOD * fastest {
            let expected = format!(
                "at least {} Hz, {SAMPLES_PER_PERIOD} samples per period of {}",
                SAMPLES_PER_PERIOD * fastest,
                part.title(number)
            );
            return Err(Error::setting("sample_rate_hz", &expected, bench.rate_hz));
        }
        return formed(presliding(bench, config, coordinate, slowed));
    }
    if let Some(config) = &part.track {
        let points = track_points(bench, config)?;
        let speeds = config.speed.positive(&key(number, "track.speed"), &bench.joints)?;
        let speeds: Vec<f64> =
            speeds.iter().zip(&bench.limits).map(|(v, l)| v.unwrap_or(l.velocity) / slowed).collect();
        return formed(track(bench, config, points, &speeds, slowed));
    }
    if let Some(config) = &part.circle {
        let whole = config.turns.abs() * config.turn_s;
        if let Some(blend) = config.blend_s.filter(|blend| *blend > whole) {
            let expected = format!("at most {whole} s, the time of the whole way");
            return Err(Error::setting(&key(number, "circle.blend_s"), &expected, blend));
        }
        return circle(bench, config, slowed).map_err(|source| {
            MotionFault::Circle { part: part.title(number), source: Box::new(source) }.into()
        });
    }
    let pause = part.pause_s.unwrap_or_default();
    formed(Rest::new(current.to_vec(), bench.on_grid(pause)).map(|rest| vec![Piece::new(rest)]))
}

fn sweep(
    bench: &Bench<'_>,
    config: &SweepConfig,
    coordinate: usize,
    slowed: f64,
) -> Result<Vec<Piece>, TrajectoryError> {
    let limits = &bench.limits[coordinate];
    let passes = sweeps(&SweepSettings {
        range: config.range.map_or(limits.position, |[low, high]| (low, high)),
        speeds: config.speeds.iter().map(|v| v / slowed).collect(),
        acceleration: config.acceleration.unwrap_or(limits.acceleration),
        jerk: limits.jerk,
        longest_s: config.longest_s,
        least_s: config.least_s,
        rate_hz: bench.rate_hz,
    })?;
    let mut pieces: Vec<Piece> = Vec::new();
    for pass in passes {
        let mut pose = bench.start.clone();
        pose[coordinate] = pass.at(0.0).position;
        if let Some(before) = pieces.last() {
            pieces.extend(way(bench, &before.last(), &pose)?);
        }
        let (start, end) = pass.cruise();
        let cruise = Some((pass.speed(), start, end));
        let motion = Alone::new(bench.start.clone(), coordinate, pass)?;
        pieces.push(Piece { cruise, ..Piece::new(motion) });
        if config.pause_s > 0.0 {
            let pose = pieces.last().map(Piece::last).unwrap_or(pose);
            pieces.push(Piece::new(Rest::new(pose, bench.on_grid(config.pause_s))?));
        }
    }
    Ok(pieces)
}

fn presliding(
    bench: &Bench<'_>,
    config: &PreslidingConfig,
    coordinate: usize,
    slowed: f64,
) -> Result<Vec<Piece>, TrajectoryError> {
    let tones: Vec<Tone> = (config.tones.iter())
        .map(|[hz, amplitude]| Tone { frequency_hz: hz / slowed, amplitude: *amplitude })
        .collect();
    let slowest = tones.iter().map(|t| t.frequency_hz).fold(f64::INFINITY, f64::min);
    let fade = bench.on_grid(config.fade_s.map_or(1.0 / slowest, |fade| fade * slowed));
    let duration = bench.on_grid(config.duration_s * slowed);
    let about = config.about.unwrap_or(bench.start[coordinate]);
    let tones = FadedTones::new(about, tones, duration, fade)?;
    let motion = Alone::new(bench.start.clone(), coordinate, tones)?;
    Ok(vec![Piece::new(motion)])
}

fn track_points(bench: &Bench<'_>, config: &TrackConfig) -> Result<Vec<Vec<f64>>, Error> {
    let mut pose = bench.start.clone();
    let mut out = Vec::with_capacity(config.points.len());
    for point in &config.points {
        for (joint, q) in point {
            pose[bench.coordinate(joint)?] = *q;
        }
        out.push(pose.clone());
    }
    Ok(out)
}

fn track(
    bench: &Bench<'_>,
    config: &TrackConfig,
    points: Vec<Vec<f64>>,
    speeds: &[f64],
    slowed: f64,
) -> Result<Vec<Piece>, TrajectoryError> {
    let times = |blend: f64| match &config.times_s {
        Some(times) => Ok(times.iter().map(|t| bench.on_grid(t * slowed)).collect()),
        None => PaulTrack::times(&points, speeds, blend),
    };
    let blend = match config.blend_s {
        Some(blend) => blend * slowed,
        None => shortest_blend(bench, &points, &times(1.0 / bench.rate_hz)?),
    };
    let mut blend = bench.on_grid(blend);
    if config.blend_s.is_none() && config.times_s.is_some() {
        // Stated times may leave no room for the blend that a limit asks for: it is then told as broken.
        blend = times(blend)?.into_iter().fold(blend, f64::min);
    }
    let times = times(blend)?.iter().map(|t| bench.on_grid(*t)).collect();
    let motion = PaulTrack::new(points, times, blend)?;
    Ok(vec![Piece::new(motion)])
}

/// Blend that keeps the limits of acceleration and jerk with these times of the lines; longer times ask for no longer one.
fn shortest_blend(bench: &Bench<'_>, points: &[Vec<f64>], times: &[f64]) -> f64 {
    let velocity = |k: usize, c: usize| match k.checked_sub(1).and_then(|line| times.get(line)) {
        Some(time) => (points[k][c] - points[k - 1][c]) / time,
        None => 0.0,
    };
    let mut blend: f64 = 0.0;
    for k in 0..points.len() {
        for (c, limits) in bench.limits.iter().enumerate() {
            let change = (velocity(k + 1, c) - velocity(k, c)).abs();
            blend = blend.max(1.5 * change / limits.acceleration).max((6.0 * change / limits.jerk).sqrt());
        }
    }
    blend
}

fn circle(bench: &Bench<'_>, config: &CircleConfig, slowed: f64) -> Result<Vec<Piece>, TaskSpaceError> {
    let file = &bench.robot.file;
    let settings = CircleSettings {
        link: config.link.clone(),
        point: config.point,
        centre: config.centre,
        normal: config.normal,
        radius: config.radius,
        hold_orientation: config.hold_orientation,
        hold: config.hold.clone(),
    };
    let circle = PointCircle::new(&file.description, &file.closures, &bench.joints, &bench.all, &settings)?;
    let turn = config.turn_s * slowed;
    let whole = bench.on_grid(config.turns.abs() * turn);
    let blend = config.blend_s.map_or(0.25 * turn.min(whole), |blend| blend * slowed);
    let blend = bench.on_grid(blend).min(whole);
    let angle = PaulBlend::constant_velocity(0.0, TAU * config.turns / whole, blend, whole - blend)?;
    let motion = QuinticSpline::new(circle.follow(angle, bench.rate_hz)?)?;
    Ok(vec![Piece::new(motion)])
}
