//! Test motions: constant-speed sweeps, pre-sliding sinusoids, Paul's tracks, circles in task space, pauses, and loads beside the drives,
//! within the limits of the joints.
//!
//! A motion is a list of parts, each from rest to rest; quintics lead from one to the next and back to the start pose. Borders of blends
//! and pauses lie on samples, so that the table of samples with polynomials of degree 5 between its rows
//! ([`QuinticSpline`]) is the motion itself; limits are checked on it, between samples too.

mod bench;
pub mod config;
mod fault;
mod loads;
mod page;
mod parts;
mod record;

use std::path::{Path, PathBuf};

use dynid_files::OutputError;
use dynid_logs::trajectory::Playback;
use dynid_motion::trajectory::{Phase, Point, QuinticSpline, Sampled, Sequence, Trajectory};

use bench::Bench;
pub use config::{
    CircleConfig, LoadConfig, MotionConfig, MotionLimitsConfig, PartConfig, PreslidingConfig, SweepConfig,
    TrackConfig,
};
use dynid_identify::Error;
use dynid_identify::estimate::Provenance;
use dynid_identify::robot::{Robot, RobotOptions};
pub use fault::MotionFault;
use parts::{Piece, Ranges};
pub use record::{LimitUse, LimitedQuantity, LoadRecord, MotionRecord, PartKind, PartRecord, PassRecord};

/// Most samples of a motion.
const MOST_SAMPLES: f64 = 1e7;

/// A motion that was made.
#[derive(Debug)]
pub struct MotionRun {
    /// What it is, as `motion.json` has it.
    pub record: MotionRecord,
    /// Samples.
    pub sampled: Sampled,
    /// Loads by column, a value per sample.
    pub channels: Vec<(String, Vec<f64>)>,
    /// Per sample: number of the part, 0 on the ways between.
    part: Vec<f64>,
    /// Per sample: before the first part, among the parts, behind the last.
    phases: Vec<Phase>,
}

/// Where a motion is written.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionPaths {
    /// Samples with loads, CSV.
    pub samples: PathBuf,
    /// `trajectory_msgs/JointTrajectory` as YAML.
    pub ros_yaml: PathBuf,
    /// The same as JSON.
    pub ros_json: PathBuf,
}

/// Makes a motion.
///
/// # Errors
/// [`Error`] for bad input; [`MotionFault`] in [`Error::Job`] for parts that break a limit or cannot be.
pub fn motion(config: &MotionConfig) -> Result<MotionRun, Error> {
    config.check()?;
    let options = RobotOptions {
        couple_mimics: config.couple_mimics,
        locked: config.locked.iter().map(|(joint, q)| (joint.clone(), *q)).collect(),
        ..RobotOptions::default()
    };
    let robot = Robot::load(&config.robot, &options)?;
    let mut warnings = Vec::new();
    let bench = Bench::new(&robot, config, &mut warnings)?;
    let Assembly { pieces, parts, ranges } = Assembly::new(&bench, config)?;
    for part in parts.iter().filter(|p| p.slowed > 1.0) {
        warnings.push(format!(
            "part {} ({}) runs {:.4} times slower than asked for, to keep the limits",
            part.number, part.name, part.slowed
        ));
    }
    let first = pieces.iter().position(|(_, number, _)| *number > 0).unwrap_or_default();
    let last = pieces.iter().rposition(|(_, number, _)| *number > 0).unwrap_or_default();
    let phase = |k: usize| match (k < first, k > last) {
        (true, _) => Phase::Approach,
        (false, false) => Phase::Record,
        (false, true) => Phase::Return,
    };
    // Position, velocity and acceleration of a piece begin where those of the one before end.
    let segment = |(k, (_, _, piece)): (usize, &(usize, usize, Piece))| -> (Phase, Box<dyn Trajectory>) {
        (phase(k), Box::new(piece.trajectory.clone()))
    };
    Sequence::new(pieces.iter().enumerate().map(segment).collect())?;
    let sampled = sampled(&pieces, bench.joints.len(), bench.rate_hz);
    let owner = |sample: usize| pieces.partition_point(|(from, _, _)| *from <= sample).saturating_sub(1);
    let phases = (0..sampled.samples()).map(|sample| phase(owner(sample))).collect();
    let part = (0..sampled.samples()).map(|sample| pieces[owner(sample)].1 as f64).collect();
    bench.check_inside(&sampled, &|sample| match pieces[owner(sample)].1 {
        0 => "way between parts".to_owned(),
        number => config.part[number - 1].title(number),
    })?;
    let duration_s = sampled.time[sampled.samples() - 1];
    let loads = loads::loads(&robot, config, &parts, &sampled.time)?;
    warnings.extend(loads.iter().filter_map(|(load, _)| loads::unread(load)));
    let channels = loads.iter().map(|(load, values)| (load.column.clone(), values.clone())).collect();
    let settings = serde_json::to_value(config).unwrap_or_default();
    let provenance = Provenance { inputs: robot.inputs(), settings, ..Provenance::default() };
    let record = MotionRecord {
        schema: record::SCHEMA,
        robot: config.robot.display().to_string(),
        headline: headline(&parts, duration_s, bench.joints.len()),
        duration_s,
        sample_rate_hz: bench.rate_hz,
        samples: sampled.samples(),
        start: bench.start.clone(),
        limits: record::uses(&bench.joints, &bench.limits, &ranges),
        joints: bench.joints,
        parts,
        loads: loads.into_iter().map(|(load, _)| load).collect(),
        warnings,
        provenance,
    };
    Ok(MotionRun { record, sampled, channels, part, phases })
}

impl MotionRun {
    /// Writes the motion, each file beside its place and renamed: samples with loads, `part` and `phase` (CSV), messages
    /// `JointTrajectory` of ROS 2 (YAML, JSON), which hold no loads.
    ///
    /// # Errors
    /// [`Error::Output`].
    pub fn write(&self, paths: &MotionPaths) -> Result<(), Error> {
        let output = |e: OutputError| Error::Output(e);
        let joints = &self.record.joints;
        let mut channels = self.channels.clone();
        channels.push(("part".to_owned(), self.part.clone()));
        dynid_logs::trajectory::write_csv_with_channels(
            &paths.samples,
            joints,
            &self.sampled,
            &channels,
            Some(&self.phases),
        )
        .map_err(output)?;
        dynid_logs::trajectory::write_ros_yaml(&paths.ros_yaml, joints, &self.sampled).map_err(output)?;
        dynid_logs::trajectory::write_ros_json(&paths.ros_json, joints, &self.sampled).map_err(output)
    }

    /// The motion as a file for what plays it, without loads; `file` stands in errors.
    ///
    /// # Errors
    /// [`Error::Trajectory`] if there are too many samples; [`Error::Output`] with what cannot be played.
    pub fn playback(&self, format: Playback, file: &Path) -> Result<String, Error> {
        let rate_hz = format.rate_hz(self.record.sample_rate_hz);
        let resampled = match rate_hz == self.record.sample_rate_hz {
            true => None,
            false => Some(Sampled::at_rate(&QuinticSpline::new(self.sampled.clone())?, rate_hz)?),
        };
        let sampled = resampled.as_ref().unwrap_or(&self.sampled);
        format.text(file, &self.record.joints, sampled).map_err(Error::Output)
    }
}

/// Samples of pieces that begin on samples; the last one is that of the end.
fn sampled(pieces: &[(usize, usize, Piece)], joints: usize, rate_hz: f64) -> Sampled {
    let of = |(from, _, piece): &(usize, usize, Piece)| from + samples_of(piece, rate_hz);
    let samples = 1 + pieces.last().map_or(0, of);
    let zero = || vec![0.0; joints * samples];
    let time = (0..samples).map(|k| k as f64 / rate_hz).collect();
    let mut out = Sampled { time, q: zero(), dq: zero(), ddq: zero() };
    let mut points = vec![Point::default(); joints];
    for (from, _, piece) in pieces {
        let count = samples_of(piece, rate_hz);
        for k in 0..=count {
            // The end itself, which sums of durations may miss by rounding.
            let time = if k == count { piece.trajectory.duration() } else { k as f64 / rate_hz };
            piece.trajectory.at(time, &mut points);
            for (coordinate, point) in points.iter().enumerate() {
                let place = coordinate * samples + from + k;
                out.q[place] = point.position;
                out.dq[place] = point.velocity;
                out.ddq[place] = point.acceleration;
            }
        }
    }
    out
}

/// Samples from the beginning of a piece to its end, which lies on one.
fn samples_of(piece: &Piece, rate_hz: f64) -> usize {
    (piece.trajectory.duration() * rate_hz).round() as usize
}

/// All pieces in order.
struct Assembly {
    /// Sample at which it begins, number of the part (0: a way between), and what moves.
    pieces: Vec<(usize, usize, Piece)>,
    parts: Vec<PartRecord>,
    ranges: Ranges,
}

impl Assembly {
    fn new(bench: &Bench<'_>, config: &MotionConfig) -> Result<Self, Error> {
        let mut out = Assembly {
            pieces: Vec::new(),
            parts: Vec::with_capacity(config.part.len()),
            ranges: vec![[(f64::INFINITY, f64::NEG_INFINITY); 4]; bench.joints.len()],
        };
        let mut at = (0, bench.start.clone());
        let time = |sample: usize| sample as f64 / bench.rate_hz;
        for (k, stated) in config.part.iter().enumerate() {
            let (number, whole) = (k + 1, parts::part(bench, config, (k + 1, stated), &at.1)?);
            out.widen(&whole.ranges);
            let mut record = PartRecord {
                number,
                name: stated.name.clone().unwrap_or_else(|| stated.kind().to_owned()),
                kind: PartKind::of_word(stated.kind()).unwrap_or(PartKind::Pause),
                joint: (stated.sweep.iter().map(|s| &s.joint))
                    .chain(stated.presliding.iter().map(|p| &p.joint))
                    .next()
                    .cloned(),
                repeat: stated.repeat,
                from_s: f64::NAN,
                to_s: f64::NAN,
                slowed: whole.slowed,
                passes: Vec::new(),
            };
            for _ in 0..stated.repeat {
                if let Some(first) = whole.pieces.first() {
                    out.go(bench, &mut at, &first.first())?;
                }
                record.from_s = if record.from_s.is_nan() { time(at.0) } else { record.from_s };
                for piece in &whole.pieces {
                    if let Some((speed, from, to)) = piece.cruise {
                        record.passes.push(PassRecord {
                            speed,
                            from_s: time(at.0) + from,
                            to_s: time(at.0) + to,
                        });
                    }
                    out.push(bench, &mut at, number, piece.clone())?;
                }
            }
            record.to_s = time(at.0);
            out.parts.push(record);
        }
        out.go(bench, &mut at, &bench.start)?;
        Ok(out)
    }

    fn widen(&mut self, ranges: &Ranges) {
        for (own, other) in self.ranges.iter_mut().flatten().zip(ranges.iter().flatten()) {
            *own = (own.0.min(other.0), own.1.max(other.1));
        }
    }

    /// Goes to a pose, if it is another than the present one.
    fn go(&mut self, bench: &Bench<'_>, at: &mut (usize, Vec<f64>), to: &[f64]) -> Result<(), Error> {
        let Some(way) = parts::way(bench, &at.1, to)? else { return Ok(()) };
        self.widen(&parts::ranges(bench, std::slice::from_ref(&way))?);
        self.push(bench, at, 0, way)
    }

    fn push(
        &mut self,
        bench: &Bench<'_>,
        at: &mut (usize, Vec<f64>),
        number: usize,
        piece: Piece,
    ) -> Result<(), Error> {
        let from = at.0;
        *at = (from + samples_of(&piece, bench.rate_hz), piece.last());
        if at.0 as f64 > MOST_SAMPLES {
            let expected = format!("at most {MOST_SAMPLES:e} samples of the whole motion");
            return Err(Error::setting("sample_rate_hz", &expected, bench.rate_hz));
        }
        self.pieces.push((from, number, piece));
        Ok(())
    }
}

fn headline(parts: &[PartRecord], duration_s: f64, joints: usize) -> String {
    let plural = |n: usize, word: &str| format!("{n} {word}{}", if n == 1 { "" } else { "s" });
    format!(
        "{} of {}, {duration_s:.1} s: position, velocity and acceleration keep their limits at every instant",
        plural(parts.len(), "part"),
        plural(joints, "joint"),
    )
}
