//! Approach, record, return: trajectories one after the other.

use std::fmt;
use std::ops::Range;

use super::error::{Quantity, TrajectoryError, check_count};
use super::{MotionLimits, Point, QuinticSegment, Trajectory, held};

/// What a part of a motion is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// From the parking pose to the start of the record.
    Approach,
    /// What is recorded for identification.
    Record,
    /// Back to the parking pose.
    Return,
}

impl Phase {
    /// Name in files: `approach`, `record`, `return`.
    pub fn name(self) -> &'static str {
        match self {
            Phase::Approach => "approach",
            Phase::Record => "record",
            Phase::Return => "return",
        }
    }

    /// Number in tables, in order of time: 0, 1, 2.
    pub fn number(self) -> u8 {
        self as u8
    }
}

impl fmt::Display for Phase {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

struct Segment {
    phase: Phase,
    start: f64,
    trajectory: Box<dyn Trajectory>,
}

/// Trajectories one after the other, continuous in position, velocity and acceleration.
pub struct Sequence {
    segments: Vec<Segment>,
    coordinates: usize,
    duration: f64,
}

impl fmt::Debug for Sequence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let segments: Vec<(Phase, f64)> = self.segments.iter().map(|s| (s.phase, s.start)).collect();
        f.debug_struct("Sequence").field("segments", &segments).field("duration", &self.duration).finish()
    }
}

/// Jump that is taken for rounding, in parts of the greater of 1 and the value.
const SAME: f64 = 1e-9;

impl Sequence {
    /// Joins trajectories in the order given.
    ///
    /// # Errors
    /// [`TrajectoryError::Discontinuity`] if position, velocity or acceleration jumps between two of them by more than 1e-9
    /// (of the value, where that is greater than 1); also without a trajectory or with different numbers of coordinates.
    pub fn new(parts: Vec<(Phase, Box<dyn Trajectory>)>) -> Result<Self, TrajectoryError> {
        let Some(coordinates) = parts.first().map(|(_, t)| t.coordinates()) else {
            return Err(TrajectoryError::Value { name: "segments", expected: "at least 1", found: 0.0 });
        };
        let mut segments: Vec<Segment> = Vec::with_capacity(parts.len());
        let mut start = 0.0;
        for (phase, trajectory) in parts {
            check_count("coordinates of a segment", coordinates, trajectory.coordinates())?;
            if let Some(before) = segments.last() {
                let ends = end_of(&*before.trajectory);
                check_joint(segments.len(), start, &ends, &start_of(&*trajectory))?;
            }
            let duration = trajectory.duration();
            segments.push(Segment { phase, start, trajectory });
            start += duration;
        }
        Ok(Sequence { segments, coordinates, duration: start })
    }

    /// A record with the shortest quintic approach from rest at `parking` and back that keep the limits of each
    /// coordinate. The record's own limits are not checked here.
    ///
    /// # Errors
    /// Fails as [`QuinticSegment::shortest`] does.
    pub fn parked(
        parking: &[f64],
        record: Box<dyn Trajectory>,
        limits: &[MotionLimits],
    ) -> Result<Self, TrajectoryError> {
        check_count("parking pose", record.coordinates(), parking.len())?;
        let rest: Vec<Point> = parking.iter().map(|q| Point::rest(*q)).collect();
        let approach = QuinticSegment::shortest(&rest, &start_of(&*record), limits)?;
        let back = QuinticSegment::shortest(&end_of(&*record), &rest, limits)?;
        Self::new(vec![
            (Phase::Approach, Box::new(approach)),
            (Phase::Record, record),
            (Phase::Return, Box::new(back)),
        ])
    }

    /// A sequence with given durations, s; `None`: no approach, no return.
    ///
    /// # Errors
    /// Fails as [`QuinticSegment::new`] does.
    pub fn timed(
        approach: Option<(&[f64], f64)>,
        record: Box<dyn Trajectory>,
        back: Option<(&[f64], f64)>,
    ) -> Result<Self, TrajectoryError> {
        let rest = |pose: &[f64]| -> Result<Vec<Point>, TrajectoryError> {
            check_count("parking pose", record.coordinates(), pose.len())?;
            Ok(pose.iter().map(|q| Point::rest(*q)).collect())
        };
        let (start, end) = (start_of(&*record), end_of(&*record));
        let mut parts: Vec<(Phase, Box<dyn Trajectory>)> = Vec::new();
        if let Some((pose, duration)) = approach {
            parts.push((Phase::Approach, Box::new(QuinticSegment::new(&rest(pose)?, &start, duration)?)));
        }
        let last = match back {
            Some((pose, duration)) => Some(QuinticSegment::new(&end, &rest(pose)?, duration)?),
            None => None,
        };
        parts.push((Phase::Record, record));
        if let Some(last) = last {
            parts.push((Phase::Return, Box::new(last)));
        }
        Self::new(parts)
    }

    /// Phase at a time; before the start that of the first segment, after the end that of the last. Where two segments meet,
    /// the later one counts.
    pub fn phase(&self, time: f64) -> Phase {
        self.segment(time).phase
    }

    /// From the start of the first to the end of the last segment of a phase, s; `None` if there is none.
    pub fn span(&self, phase: Phase) -> Option<Range<f64>> {
        let of_phase = |s: &&Segment| s.phase == phase;
        let first = self.segments.iter().find(of_phase)?;
        let last = self.segments.iter().rev().find(of_phase)?;
        Some(first.start..last.start + last.trajectory.duration())
    }

    fn segment(&self, time: f64) -> &Segment {
        let after = self.segments.partition_point(|s| s.start <= time);
        &self.segments[after.max(1) - 1]
    }
}

fn start_of(trajectory: &dyn Trajectory) -> Vec<Point> {
    state(trajectory, 0.0)
}

fn end_of(trajectory: &dyn Trajectory) -> Vec<Point> {
    state(trajectory, trajectory.duration())
}

fn state(trajectory: &dyn Trajectory, time: f64) -> Vec<Point> {
    let mut out = vec![Point::default(); trajectory.coordinates()];
    trajectory.at(time, &mut out);
    out
}

fn check_joint(segment: usize, time: f64, before: &[Point], after: &[Point]) -> Result<(), TrajectoryError> {
    for (coordinate, (x, y)) in before.iter().zip(after).enumerate() {
        let pairs = [
            (Quantity::Position, x.position, y.position),
            (Quantity::Velocity, x.velocity, y.velocity),
            (Quantity::Acceleration, x.acceleration, y.acceleration),
        ];
        for (quantity, expected, found) in pairs {
            if (found - expected).abs() > SAME * expected.abs().max(1.0) {
                return Err(TrajectoryError::Discontinuity {
                    segment,
                    time,
                    coordinate,
                    quantity,
                    expected,
                    found,
                });
            }
        }
    }
    Ok(())
}

impl Trajectory for Sequence {
    fn coordinates(&self) -> usize {
        self.coordinates
    }

    fn duration(&self) -> f64 {
        self.duration
    }

    fn at(&self, time: f64, out: &mut [Point]) {
        let (inside, outside) = held(time, self.duration);
        let segment = self.segment(inside);
        // Segments start at rounded sums; at a joint the segment's own end, not a hair beyond it.
        segment.trajectory.at((inside - segment.start).min(segment.trajectory.duration()), out);
        if outside {
            for point in out {
                point.jerk = 0.0;
            }
        }
    }
}
