//! Logs of commands and positions.

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
    /// Steps of the encoders; 0: not known.
    pub resolution: Vec<f64>,
    /// Readings at which the first rollout begins, in place of the first row.
    pub start: Option<Vec<f64>>,
    /// Rows at which a rollout begins anew, beside the first.
    pub breaks: Vec<usize>,
    /// Time behind the beginning of a rollout that no sum holds, s: the velocity it begins with is not measured, and a position loop forgets
    /// it. Not where [`ServoLog::start`] is given. Default 0.2.
    pub settle_s: f64,
}

/// Time in which position loops of robots forget where they began: two to four of their time constants `(k_d + F_v)/k_p`.
const SETTLE_S: f64 = 0.2;

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
        let settle_s = SETTLE_S;
        ServoLog { name: name.into(), time, command, position, resolution, settle_s, ..ServoLog::default() }
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
