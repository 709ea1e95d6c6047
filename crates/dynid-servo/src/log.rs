//! Logs of commands and positions.

use dynid_motion::signal::SignalError;
use dynid_motion::spikes::{self, SpikeSettings};

use crate::channel::Channel;
use crate::joint::Hold;

/// Commands and encoder readings of all joints over one record.
#[derive(Debug, Clone, Default, PartialEq)]
#[non_exhaustive]
pub struct ServoLog {
    /// Name.
    pub name: String,
    /// Time of every row, s, growing.
    pub time: Vec<f64>,
    /// Commanded encoder positions, joint after joint, rad or m.
    pub command: Vec<Vec<f64>>,
    /// Commanded encoder velocities; empty: none.
    pub velocity_command: Vec<Vec<f64>>,
    /// Efforts that are fed forward; empty: none.
    pub feed_forward: Vec<Vec<f64>>,
    /// Encoder readings, joint after joint, rad or m.
    pub position: Vec<Vec<f64>>,
    /// Measured encoder velocities; empty, as a whole or for a joint: none.
    pub velocity: Vec<Vec<f64>>,
    /// Measured efforts, N m or N, positive with the encoder's direction; empty, as a whole or for a joint: none.
    pub effort: Vec<Vec<f64>>,
    /// Measured currents, A, alike.
    pub current: Vec<Vec<f64>>,
    /// Steps of the encoders; 0: not known.
    pub resolution: Vec<f64>,
    /// Readings at which the first rollout begins, in place of the first row.
    pub start: Option<Vec<f64>>,
    /// Rows at which a rollout begins anew, beside the first.
    pub breaks: Vec<usize>,
    /// Time behind the beginning of a rollout that no sum holds, s: the velocity it begins with is not measured, and a position loop forgets
    /// it. Not where [`ServoLog::start`] is given. Default 0.2.
    pub settle_s: f64,
    /// Time from which an encoder that stands still says less with every row, s: the error of its rounding is the same in all of them, and a long rest
    /// would outweigh all motion. Default infinite: every row counts alike.
    pub still_s: f64,
    /// Rows whose readings do not count, joint after joint; empty: none. [`ServoLog::leave_out_spikes`] finds them.
    pub left_out: Vec<Vec<usize>>,
}

/// Time in which position loops of robots forget where they began: two to four of their time constants `(k_d + F_v)/k_p`.
const SETTLE_S: f64 = 0.2;

/// Largest share of a signal that may stick out; beyond it is noise.
const MOST_SPIKES: f64 = 0.05;

/// Steps of an encoder within which it stands still: it may flicker between two.
const FLICKER: f64 = 1.5;

impl ServoLog {
    /// A log from its arrays; resolutions of encoders are the smallest steps of their readings, where all steps are multiples of it.
    ///
    /// # Panics
    /// If arrays differ in length.
    pub fn new(
        name: impl Into<String>,
        time: Vec<f64>,
        command: Vec<Vec<f64>>,
        position: Vec<Vec<f64>>,
    ) -> Self {
        assert_eq!(command.len(), position.len(), "joints of commands and positions");
        let whole = command.iter().chain(&position).all(|values| values.len() == time.len());
        assert!(whole, "rows of time, commands and positions");
        let resolution = position.iter().map(|x| resolution(x)).collect();
        ServoLog {
            name: name.into(),
            time,
            command,
            position,
            resolution,
            settle_s: SETTLE_S,
            still_s: f64::INFINITY,
            ..ServoLog::default()
        }
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.time.len()
    }

    /// Number of joints.
    pub fn joints(&self) -> usize {
        self.position.len()
    }

    /// Median time between rows, s.
    pub fn period(&self) -> f64 {
        let mut steps: Vec<f64> = self.time.windows(2).map(|w| w[1] - w[0]).collect();
        steps.sort_by(f64::total_cmp);
        steps.get(steps.len() / 2).copied().unwrap_or(0.0)
    }

    /// Replaces single readings of the encoders that stick out, such as those of a bus that failed, by the running median and leaves them out of all
    /// sums. Returns joints with how many.
    ///
    /// # Errors
    /// [`SignalError`] of a signal that is not finite.
    pub fn leave_out_spikes(&mut self) -> Result<Vec<(usize, usize)>, SignalError> {
        let settings = SpikeSettings { cap: MOST_SPIKES, ..SpikeSettings::position() };
        let mut out = Vec::new();
        self.resolution.resize(self.joints(), 0.0);
        for j in 0..self.joints() {
            let found = spikes::remove(&mut self.position[j], &settings)?;
            if found.removed {
                out.push((j, found.flagged.len()));
                self.leave_out(Channel::Position, j, &found.flagged);
                // The smallest step between readings was none of the encoder.
                self.resolution[j] = resolution(&self.position[j]);
            }
        }
        Ok(out)
    }

    /// Leaves readings of a joint out of all sums.
    pub(crate) fn leave_out(&mut self, channel: Channel, joint: usize, rows: &[usize]) {
        let n = self.joints();
        let values = match channel {
            Channel::Position => {
                self.left_out.resize(n, Vec::new());
                self.left_out[joint].extend(rows);
                return;
            }
            Channel::Velocity => &mut self.velocity[joint],
            Channel::Effort => &mut self.effort[joint],
            Channel::Current => &mut self.current[joint],
        };
        rows.iter().for_each(|row| values[*row] = f64::NAN);
    }

    /// What a channel reads of a joint, where it was logged.
    pub fn measured(&self, channel: Channel, joint: usize) -> Option<&[f64]> {
        let of = match channel {
            Channel::Position => &self.position,
            Channel::Velocity => &self.velocity,
            Channel::Effort => &self.effort,
            Channel::Current => &self.current,
        };
        of.get(joint).filter(|values| !values.is_empty()).map(Vec::as_slice)
    }

    /// Ranges of rows that one rollout covers.
    pub(crate) fn segments(&self) -> Vec<std::ops::Range<usize>> {
        let mut starts: Vec<usize> = std::iter::once(0).chain(self.breaks.iter().copied()).collect();
        starts.push(self.rows());
        starts.windows(2).map(|w| w[0]..w[1]).filter(|r| r.len() > 1).collect()
    }

    /// For every row, whether sums hold it.
    pub(crate) fn counted(&self) -> Vec<bool> {
        let mut out = vec![false; self.rows()];
        for segment in self.segments() {
            let given = segment.start == 0 && self.start.is_some();
            let from = if given { f64::NEG_INFINITY } else { self.time[segment.start] + self.settle_s };
            for row in segment {
                out[row] = self.time[row] >= from;
            }
        }
        out
    }

    /// Weight of every reading of an encoder: a rest of `L` rows, `n` of which take [`ServoLog::still_s`], counts as `n²/L` readings, and as one at
    /// least; 1 for all where the step of the encoder is not known; 0 for those that are left out.
    pub(crate) fn weights(&self, joint: usize) -> Vec<f64> {
        let readings = &self.position[joint];
        let mut out = vec![1.0; readings.len()];
        let step = self.resolution.get(joint).copied().unwrap_or(0.0);
        let rows = self.still_s / self.period();
        let mut first = if step > 0.0 && rows.is_finite() { 0 } else { readings.len() };
        while first < readings.len() {
            let (mut least, mut most) = (readings[first], readings[first]);
            let mut end = first + 1;
            while end < readings.len() {
                (least, most) = (least.min(readings[end]), most.max(readings[end]));
                if most - least > FLICKER * step {
                    break;
                }
                end += 1;
            }
            let length = (end - first) as f64;
            if length > rows {
                out[first..end].fill((rows / length).powi(2).max(1.0 / length));
            }
            first = end;
        }
        if let Some(rows) = self.left_out.get(joint) {
            rows.iter().for_each(|row| out[*row] = 0.0);
        }
        out
    }

    /// Standard deviation of an encoder's rounding, 0 if its step is not known.
    pub fn floor(&self, joint: usize) -> f64 {
        self.resolution.get(joint).copied().unwrap_or(0.0) / 12.0_f64.sqrt()
    }
}

/// Steps between readings, in steps of an encoder, beyond which the smallest step is taken for that of a printed number.
const MOST_STEPS: f64 = 1e3;

/// Departure of steps from multiples of the smallest one, as a share of it.
const DEPARTURE: f64 = 0.1;

/// Share of steps that must be multiples.
const MULTIPLES: f64 = 0.9;

/// Step of an encoder, 0 if its readings do not tell one.
fn resolution(readings: &[f64]) -> f64 {
    let least = dynid_motion::signal::quantum(readings);
    let mut steps: Vec<f64> = readings.windows(2).map(|w| (w[1] - w[0]).abs()).filter(|s| *s > 0.0).collect();
    if least <= 0.0 || steps.is_empty() {
        return 0.0;
    }
    let multiple = |s: &&f64| (*s / least - (*s / least).round()).abs() <= DEPARTURE;
    let multiples = steps.iter().filter(multiple).count() as f64;
    let whole = multiples >= MULTIPLES * steps.len() as f64;
    steps.sort_by(f64::total_cmp);
    // Printed digits make every step a multiple of something small.
    let told = whole && steps[steps.len() / 2] <= MOST_STEPS * least;
    if told { least } else { 0.0 }
}

/// A command of one joint as a function of time whose mean over any interval is exact, and smooth in a delay.
#[derive(Debug, Clone)]
pub(crate) struct Command {
    time: Vec<f64>,
    value: Vec<f64>,
    /// Integral from the first row.
    integral: Vec<f64>,
    hold: Hold,
}

impl Command {
    pub(crate) fn new(time: &[f64], value: &[f64], hold: Hold) -> Self {
        let mut integral = Vec::with_capacity(time.len());
        let mut sum = 0.0;
        for k in 0..time.len() {
            if k > 0 {
                let mean = match hold {
                    Hold::Held => value[k - 1],
                    Hold::Line => 0.5 * (value[k - 1] + value[k]),
                };
                sum += mean * (time[k] - time[k - 1]);
            }
            integral.push(sum);
        }
        Command { time: time.to_vec(), value: value.to_vec(), integral, hold }
    }

    /// Integral and value at a time; `at`: a row from which the search for it goes on.
    fn look(&self, t: f64, at: &mut usize) -> (f64, f64) {
        let last = self.time.len() - 1;
        if t < self.time[0] {
            return ((t - self.time[0]) * self.value[0], self.value[0]);
        }
        let mut k = (*at).min(last);
        while k > 0 && self.time[k] > t {
            k -= 1;
        }
        while k < last && self.time[k + 1] <= t {
            k += 1;
        }
        *at = k;
        let past = t - self.time[k];
        if k == last || self.hold == Hold::Held {
            return (self.integral[k] + past * self.value[k], self.value[k]);
        }
        let slope = (self.value[k + 1] - self.value[k]) / (self.time[k + 1] - self.time[k]);
        let here = self.value[k] + slope * past;
        (self.integral[k] + 0.5 * past * (self.value[k] + here), here)
    }

    /// Mean over `[from, from + span]` of the command `delay` earlier, and its slope over the delay.
    pub(crate) fn mean(&self, from: f64, span: f64, delay: f64, at: &mut usize) -> (f64, f64) {
        let (first, early) = self.look(from - delay, at);
        let mut ahead = *at;
        let (second, late) = self.look(from + span - delay, &mut ahead);
        ((second - first) / span, (early - late) / span)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_of_held_commands_are_exact() {
        let command = Command::new(&[0.0, 1.0, 2.0], &[1.0, 3.0, 5.0], Hold::Held);
        let mut at = 0;
        assert_eq!(command.mean(-1.0, 1.0, 0.0, &mut at).0, 1.0);
        assert_eq!(command.mean(0.5, 1.0, 0.0, &mut at), (2.0, -2.0));
        assert_eq!(command.mean(1.5, 2.0, 0.0, &mut at).0, 0.25 * 3.0 + 0.75 * 5.0);
        assert_eq!(command.mean(1.0, 1.0, 0.25, &mut at).0, 0.25 * 1.0 + 0.75 * 3.0);
        let command = Command::new(&[0.0, 1.0, 2.0], &[1.0, 3.0, 5.0], Hold::Line);
        assert_eq!(command.mean(0.0, 1.0, 0.0, &mut at), (2.0, -2.0));
        assert_eq!(command.mean(0.5, 1.0, 0.0, &mut at).0, 3.0);
    }
}
