//! A recorded log: time, joint signals and further channels, checked once.

use std::ops::Range;

use crate::median::median;
use crate::signal::quantum;

/// Why rows do not form a log. Samples are counted from 0.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LogError {
    /// No joint was given.
    #[error("{log}: expected at least one joint, found none")]
    NoJoints {
        /// Name of the log.
        log: String,
    },
    /// Too few rows.
    #[error("{log}: expected at least {expected} rows, found {found}")]
    TooFewRows {
        /// Name of the log.
        log: String,
        /// Rows needed.
        expected: usize,
        /// Rows given.
        found: usize,
    },
    /// A signal does not have one value per row.
    #[error("{log}: {signal}: expected {expected} samples (one per time), found {found}")]
    Length {
        /// Name of the log.
        log: String,
        /// Name of the signal, for example `effort of elbow`.
        signal: String,
        /// Rows of the time column.
        expected: usize,
        /// Samples of the signal.
        found: usize,
    },
    /// A value is NaN or infinite.
    #[error("{log}: {signal}, sample {sample}: expected a finite number, found {found}")]
    NotFinite {
        /// Name of the log.
        log: String,
        /// Name of the signal.
        signal: String,
        /// Index of the first offending sample.
        sample: usize,
        /// Value of that sample.
        found: f64,
    },
    /// Two joints, or two channels, share a name.
    #[error("{log}: the name `{name}` is used more than once")]
    DuplicateName {
        /// Name of the log.
        log: String,
        /// The repeated name.
        name: String,
    },
    /// Rows with other signals than those before.
    #[error("{log}, behind row {row}: expected signals of {}, found {}", expected.join(", "), found.join(", "))]
    OtherSignals {
        /// Name of the log.
        log: String,
        /// Rows before.
        row: usize,
        /// Joints and channels of the rows before.
        expected: Vec<String>,
        /// Joints and channels of these.
        found: Vec<String>,
    },
    /// A slice asks for rows that do not exist.
    #[error("{log}: rows {start}..{end} asked for, the log has {rows}")]
    Range {
        /// Name of the log.
        log: String,
        /// First row asked for.
        start: usize,
        /// One past the last row asked for.
        end: usize,
        /// Rows of the log.
        rows: usize,
    },
}

/// Signals of one joint, one value per row.
#[derive(Debug, Clone, PartialEq)]
pub struct JointSignals {
    /// Joint name.
    pub name: String,
    /// Measured position, rad or m.
    pub position: Vec<f64>,
    /// Measured velocity, rad/s or m/s, if recorded.
    pub velocity: Option<Vec<f64>>,
    /// Measured or commanded effort, N m or N.
    pub effort: Vec<f64>,
}

impl JointSignals {
    /// Whether the joint moves: its peak-to-peak position exceeds both 4 resolution steps (smallest non-zero
    /// change between rows) and 12 standard deviations of the white noise seen in second differences.
    pub fn moves(&self) -> bool {
        moves(&self.position)
    }

    /// Whether the effort never changes.
    pub fn effort_is_constant(&self) -> bool {
        is_constant(&self.effort)
    }

    fn signals(&self) -> impl Iterator<Item = (&'static str, &[f64])> {
        let velocity = self.velocity.as_deref().map(|v| ("velocity", v));
        [("position", self.position.as_slice())]
            .into_iter()
            .chain(velocity)
            .chain([("effort", self.effort.as_slice())])
    }

    fn slice(&self, rows: Range<usize>) -> Self {
        Self {
            name: self.name.clone(),
            position: self.position[rows.clone()].to_vec(),
            velocity: self.velocity.as_ref().map(|v| v[rows.clone()].to_vec()),
            effort: self.effort[rows].to_vec(),
        }
    }
}

/// A further signal such as a temperature, one value per row.
#[derive(Debug, Clone, PartialEq)]
pub struct Channel {
    /// Channel name.
    pub name: String,
    /// Values in the channel's own unit.
    pub values: Vec<f64>,
}

impl Channel {
    /// Whether the channel never changes.
    pub fn is_constant(&self) -> bool {
        is_constant(&self.values)
    }
}

/// Consecutive rows of a log, which may be longer than memory. Nothing is checked before it is used.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Portion {
    /// Time stamps, s.
    pub time: Vec<f64>,
    /// Joint signals, one value per row.
    pub joints: Vec<JointSignals>,
    /// Further channels, one value per row.
    pub channels: Vec<Channel>,
}

impl Portion {
    /// All rows of a log.
    pub fn of(log: Log) -> Self {
        let (time, joints, channels) = log.into_parts();
        Portion { time, joints, channels }
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.time.len()
    }

    /// The rows as a log, checked.
    ///
    /// # Errors
    /// As [`Log::new`].
    pub fn into_log(self, name: impl Into<String>) -> Result<Log, LogError> {
        Log::new(name, self.time, self.joints, self.channels)
    }

    /// Refuses rows that are not such as follow others, and numbers that are not finite. `row`: rows before these, for messages.
    ///
    /// # Errors
    /// [`LogError::OtherSignals`], [`LogError::Length`], [`LogError::NotFinite`].
    pub fn check_behind(&self, earlier: &Portion, log: &str, row: usize) -> Result<(), LogError> {
        let names = |portion: &Portion| -> Vec<String> {
            let joints = portion.joints.iter().map(|j| (&j.name, j.velocity.is_some()));
            let joints = joints
                .map(|(name, velocity)| format!("{name}{}", if velocity { " with velocity" } else { "" }));
            joints.chain(portion.channels.iter().map(|c| c.name.clone())).collect()
        };
        let (expected, found) = (names(earlier), names(self));
        if expected != found {
            return Err(LogError::OtherSignals { log: log.to_owned(), row, expected, found });
        }
        let of_joints = self.joints.iter().flat_map(|joint| {
            joint.signals().map(|(kind, values)| (format!("{kind} of {}", joint.name), values))
        });
        let of_channels = self.channels.iter().map(|c| (c.name.clone(), c.values.as_slice()));
        for (signal, values) in
            [("time".to_owned(), self.time.as_slice())].into_iter().chain(of_joints).chain(of_channels)
        {
            if values.len() != self.rows() {
                let (log, expected, found) = (log.to_owned(), self.rows(), values.len());
                return Err(LogError::Length { log, signal, expected, found });
            }
            if let Some(k) = values.iter().position(|x| !x.is_finite()) {
                return Err(LogError::NotFinite {
                    log: log.to_owned(),
                    signal,
                    sample: row + k,
                    found: values[k],
                });
            }
        }
        Ok(())
    }

    /// Appends rows of the same signals.
    ///
    /// # Panics
    /// If there are other signals.
    pub fn append(&mut self, more: &Portion) {
        assert_eq!(
            (self.joints.len(), self.channels.len()),
            (more.joints.len(), more.channels.len()),
            "the same signals"
        );
        self.time.extend_from_slice(&more.time);
        for (joint, more) in self.joints.iter_mut().zip(&more.joints) {
            joint.position.extend_from_slice(&more.position);
            joint.effort.extend_from_slice(&more.effort);
            if let (Some(own), Some(more)) = (&mut joint.velocity, &more.velocity) {
                own.extend_from_slice(more);
            }
        }
        for (channel, more) in self.channels.iter_mut().zip(&more.channels) {
            channel.values.extend_from_slice(&more.values);
        }
    }

    /// Copy of a run of rows.
    ///
    /// # Panics
    /// If the run leaves the rows.
    #[must_use]
    pub fn part(&self, rows: Range<usize>) -> Portion {
        let channel = |c: &Channel| Channel { name: c.name.clone(), values: c.values[rows.clone()].to_vec() };
        Portion {
            time: self.time[rows.clone()].to_vec(),
            joints: self.joints.iter().map(|j| j.slice(rows.clone())).collect(),
            channels: self.channels.iter().map(channel).collect(),
        }
    }
}

/// A recorded log whose shapes and values have been checked: equal lengths, at least two rows, at least one joint,
/// every value finite, names distinct. The clock is not checked here; see [`crate::clock`].
#[derive(Debug, Clone, PartialEq)]
pub struct Log {
    name: String,
    time: Vec<f64>,
    joints: Vec<JointSignals>,
    channels: Vec<Channel>,
}

impl Log {
    /// Times, joints and channels.
    pub fn into_parts(self) -> (Vec<f64>, Vec<JointSignals>, Vec<Channel>) {
        (self.time, self.joints, self.channels)
    }

    /// Checks and takes the signals. `time` in s; fails as [`LogError`] says.
    pub fn new(
        name: impl Into<String>,
        time: Vec<f64>,
        joints: Vec<JointSignals>,
        channels: Vec<Channel>,
    ) -> Result<Self, LogError> {
        let log = Self { name: name.into(), time, joints, channels };
        log.check_shape()?;
        log.check_names()?;
        log.check_signal("time", &log.time)?;
        for joint in &log.joints {
            for (kind, values) in joint.signals() {
                log.check_signal(&format!("{kind} of {}", joint.name), values)?;
            }
        }
        for channel in &log.channels {
            log.check_signal(&channel.name, &channel.values)?;
        }
        Ok(log)
    }

    /// Name of the log, usually its file name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Time stamps, s.
    pub fn time(&self) -> &[f64] {
        &self.time
    }

    /// Joint signals in joint order.
    pub fn joints(&self) -> &[JointSignals] {
        &self.joints
    }

    /// Further channels.
    pub fn channels(&self) -> &[Channel] {
        &self.channels
    }

    /// Returns the log with a further channel that never changes.
    #[must_use]
    pub fn with_constant(mut self, channel: String, value: f64) -> Self {
        self.channels.push(Channel { name: channel, values: vec![value; self.time.len()] });
        self
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.time.len()
    }

    /// The rows of `range` as a log of the same name. Fails if the range leaves the log or holds fewer than two rows.
    pub fn slice(&self, range: Range<usize>) -> Result<Self, LogError> {
        if range.start > range.end || range.end > self.rows() {
            return Err(LogError::Range {
                log: self.name.clone(),
                start: range.start,
                end: range.end,
                rows: self.rows(),
            });
        }
        Self::new(
            self.name.clone(),
            self.time[range.clone()].to_vec(),
            self.joints.iter().map(|j| j.slice(range.clone())).collect(),
            self.channels
                .iter()
                .map(|c| Channel { name: c.name.clone(), values: c.values[range.clone()].to_vec() })
                .collect(),
        )
    }

    /// The rows for which `keep` holds as a log of the same name. Fails if fewer than two are left.
    ///
    /// # Panics
    /// Unless there is one entry per row.
    pub fn retain(&self, keep: &[bool]) -> Result<Self, LogError> {
        assert_eq!(keep.len(), self.rows(), "one entry per row");
        let take = |values: &[f64]| -> Vec<f64> {
            values.iter().zip(keep).filter(|(_, keep)| **keep).map(|(x, _)| *x).collect()
        };
        let joints = self.joints.iter().map(|j| JointSignals {
            name: j.name.clone(),
            position: take(&j.position),
            velocity: j.velocity.as_deref().map(take),
            effort: take(&j.effort),
        });
        let channels =
            self.channels.iter().map(|c| Channel { name: c.name.clone(), values: take(&c.values) });
        Self::new(self.name.clone(), take(&self.time), joints.collect(), channels.collect())
    }

    fn check_shape(&self) -> Result<(), LogError> {
        let log = || self.name.clone();
        if self.joints.is_empty() {
            return Err(LogError::NoJoints { log: log() });
        }
        if self.time.len() < 2 {
            return Err(LogError::TooFewRows { log: log(), expected: 2, found: self.time.len() });
        }
        Ok(())
    }

    fn check_names(&self) -> Result<(), LogError> {
        check_distinct(&self.name, self.joints.iter().map(|j| j.name.as_str()))?;
        check_distinct(&self.name, self.channels.iter().map(|c| c.name.as_str()))
    }

    fn check_signal(&self, signal: &str, values: &[f64]) -> Result<(), LogError> {
        if values.len() != self.time.len() {
            return Err(LogError::Length {
                log: self.name.clone(),
                signal: signal.to_owned(),
                expected: self.time.len(),
                found: values.len(),
            });
        }
        match values.iter().position(|x| !x.is_finite()) {
            Some(sample) => Err(LogError::NotFinite {
                log: self.name.clone(),
                signal: signal.to_owned(),
                sample,
                found: values[sample],
            }),
            None => Ok(()),
        }
    }
}

/// Whether a position moves; see [`JointSignals::moves`].
pub fn moves(position: &[f64]) -> bool {
    let (low, high) = extremes(position);
    let bend: Vec<f64> = position.windows(3).map(|w| (w[2] - 2.0 * w[1] + w[0]).abs()).collect();
    // The second difference of white noise of sd s has sd sqrt(6) s; 1.4826 turns a median into an sd.
    let noise = 1.4826 / 6f64.sqrt() * median(&bend).unwrap_or(0.0);
    high - low > (4.0 * quantum(position)).max(12.0 * noise)
}

fn check_distinct<'a>(log: &str, names: impl Iterator<Item = &'a str>) -> Result<(), LogError> {
    let mut seen = std::collections::BTreeSet::new();
    for name in names {
        if !seen.insert(name) {
            return Err(LogError::DuplicateName { log: log.to_owned(), name: name.to_owned() });
        }
    }
    Ok(())
}

fn extremes(signal: &[f64]) -> (f64, f64) {
    signal.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &x| (low.min(x), high.max(x)))
}

fn is_constant(signal: &[f64]) -> bool {
    signal.windows(2).all(|w| w[0] == w[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn joint(name: &str, position: Vec<f64>) -> JointSignals {
        let effort = vec![1.0; position.len()];
        JointSignals { name: name.into(), position, velocity: None, effort }
    }

    #[test]
    fn a_short_signal_is_named() {
        let mut elbow = joint("elbow", vec![0.0; 3]);
        elbow.effort.pop();
        let error = Log::new("run.csv", vec![0.0, 1.0, 2.0], vec![elbow], vec![]).unwrap_err();
        assert_eq!(error.to_string(), "run.csv: effort of elbow: expected 3 samples (one per time), found 2");
    }

    #[test]
    fn a_bad_value_is_named_with_its_sample() {
        let elbow = joint("elbow", vec![0.0, f64::NAN, 0.0]);
        let error = Log::new("run.csv", vec![0.0, 1.0, 2.0], vec![elbow], vec![]).unwrap_err();
        assert_eq!(
            error.to_string(),
            "run.csv: position of elbow, sample 1: expected a finite number, found NaN"
        );
    }

    #[test]
    fn empty_and_duplicated_logs_are_refused() {
        assert!(matches!(Log::new("a", vec![0.0, 1.0], vec![], vec![]), Err(LogError::NoJoints { .. })));
        let one = joint("j", vec![0.0]);
        assert!(matches!(
            Log::new("a", vec![0.0], vec![one], vec![]),
            Err(LogError::TooFewRows { found: 1, .. })
        ));
        let twice = vec![joint("j", vec![0.0; 2]), joint("j", vec![0.0; 2])];
        assert!(matches!(Log::new("a", vec![0.0, 1.0], twice, vec![]), Err(LogError::DuplicateName { .. })));
    }

    #[test]
    fn slices_keep_rows_together() {
        let time: Vec<f64> = (0..6).map(f64::from).collect();
        let channel = Channel { name: "temperature".into(), values: time.clone() };
        let log = Log::new("a", time.clone(), vec![joint("j", time)], vec![channel]).unwrap();
        let part = log.slice(2..5).unwrap();
        assert_eq!(part.time(), [2.0, 3.0, 4.0]);
        assert_eq!(part.joints()[0].position, [2.0, 3.0, 4.0]);
        assert_eq!(part.channels()[0].values, [2.0, 3.0, 4.0]);
        assert!(matches!(log.slice(4..9), Err(LogError::Range { end: 9, rows: 6, .. })));
        assert!(matches!(log.slice(2..3), Err(LogError::TooFewRows { .. })));
    }

    #[test]
    fn a_flickering_encoder_does_not_move_but_a_slow_ramp_does() {
        let lsb = 2.4e-5;
        let flicker = (0..500).map(|k| if k % 7 < 2 { lsb } else { 0.0 }).collect();
        let ramp = (0..500).map(|k| (f64::from(k) * 0.05).round() * lsb).collect();
        assert!(!joint("j", flicker).moves());
        assert!(joint("j", ramp).moves());
        assert!(!joint("j", vec![0.3; 10]).moves());
    }
}
