//! The grid of a log whose rows come one after the other.

use super::{ClockError, ClockReport, ClockSettings, Gap, SAME};

/// Rows that are used as they are may be off by this many samples; from the first one that is further off all are interpolated.
const OFF: f64 = 0.25;
/// Gaps that are kept one by one.
const MOST_GAPS: usize = 4096;

/// Samples of a uniform grid, column by column.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct GridSamples {
    /// One value per sample each.
    pub columns: Vec<Vec<f64>>,
    /// Per sample: false inside a gap, where values are only interpolated.
    pub usable: Vec<bool>,
}

/// Lays rows on the grid of their log as they come, in memory that does not grow with them.
///
/// Sample rate, and whether rows are interpolated, are told beforehand, by the clock of a part of the log ([`super::uniform`]). With the
/// report of the whole log the samples are those of [`super::uniform`], bit by bit. Rows that are used as they are stay so behind a gap, which
/// takes the nearest whole number of samples, and up to the first row that is 0.25 samples off its place behind the one before.
#[derive(Debug, Clone)]
pub struct GridRows {
    log: String,
    settings: ClockSettings,
    /// Rows that the log has at least.
    expected: usize,
    as_they_are: bool,
    /// A grid sample and its time, from which the grid counts.
    anchor: (usize, f64),
    samples: usize,
    report: ClockReport,
    gaps: usize,
    /// Rows whose time lies before an earlier one, and the first of them.
    backward: (usize, usize),
    /// The two rows laid last, the last one second.
    before: Option<Row>,
    last: Option<Row>,
    /// Ordinary steps: number, sum and sum of squares of their deviations, samples.
    steps: (f64, f64, f64),
}

#[derive(Debug, Clone)]
struct Row {
    time: f64,
    values: Vec<f64>,
}

/// A grid sample: a row of the portion, or one between two of them.
enum Sample {
    Row(usize),
    Between {
        /// `None`: the last row before the portion.
        before: Option<usize>,
        after: usize,
        fraction: f64,
        usable: bool,
    },
}

impl GridRows {
    /// The grid of a log. `known`: what a part of it told of the clock; `expected`: rows that the log has at least, against which the first
    /// backward steps and gaps are counted.
    pub fn new(log: &str, settings: &ClockSettings, known: &ClockReport, expected: usize) -> Self {
        let report = ClockReport {
            rows: 0,
            dropped: 0,
            first_dropped: None,
            gaps: Vec::new(),
            unusable: 0,
            ..known.clone()
        };
        GridRows {
            log: log.to_owned(),
            settings: settings.clone(),
            expected,
            as_they_are: !known.resampled,
            anchor: (0, 0.0),
            samples: 0,
            report,
            gaps: 0,
            backward: (0, 0),
            before: None,
            last: None,
            steps: (0.0, 0.0, 0.0),
        }
    }

    /// Lays the next rows: finite times, s, and one value per row in every column. How rows are portioned does not matter.
    ///
    /// # Errors
    /// [`ClockError::Backwards`] once more rows step back than tolerated; [`ClockError::GridTooLong`] for a gap of more samples than
    /// `grid_limit` times the expected rows, or for more samples of all than that per row.
    pub fn push(
        &mut self,
        time: &[f64],
        columns: &[&[f64]],
        out: &mut GridSamples,
    ) -> Result<(), ClockError> {
        let mut laid = Vec::with_capacity(time.len());
        // The last two rows of the portion that were laid.
        let (mut earlier, mut previous) = (None, None);
        for (row, &t) in time.iter().enumerate() {
            let number = self.report.rows;
            self.report.rows += 1;
            let latest = match (previous, &self.last) {
                (Some(row), _) => Some(time[row]),
                (None, last) => last.as_ref().map(|last| last.time),
            };
            match latest {
                Some(latest) if t <= latest => {
                    self.drop_row(number, t < latest)?;
                    continue;
                }
                None => self.anchor = (0, t),
                Some(latest) => self.lay(latest, t, previous, row, number, &mut laid)?,
            }
            if self.as_they_are {
                laid.push(Sample::Row(row));
                self.samples += 1;
            }
            (earlier, previous) = (previous, Some(row));
        }
        self.give(&laid, time.len(), columns, out);
        let hold = |row: usize| Row { time: time[row], values: columns.iter().map(|c| c[row]).collect() };
        if let Some(row) = previous {
            self.before = earlier.map(hold).or(self.last.take());
            self.last = Some(hold(row));
        }
        Ok(())
    }

    /// Lays what is left behind the last row, and tells of the clock.
    pub fn finish(mut self, out: &mut GridSamples) -> ClockReport {
        if let (false, Some(before), Some(last)) = (self.as_they_are, &self.before, &self.last) {
            let rate = self.report.rate_hz;
            let end = self.anchor.0 + ((last.time - self.anchor.1) * rate + 1.0 + SAME) as usize;
            let step = last.time - before.time;
            for n in self.samples..end {
                let t = self.anchor.1 + (n - self.anchor.0) as f64 / rate;
                let fraction = ((t - before.time) / step).clamp(0.0, 1.0);
                let usable = !inside_gap(t, before.time, last.time, rate, self.settings.gap_steps);
                for ((column, here), next) in out.columns.iter_mut().zip(&before.values).zip(&last.values) {
                    column.push(between(*here, *next, fraction));
                }
                out.usable.push(usable);
                self.report.unusable += usize::from(!usable);
            }
        }
        let (count, sum, squares) = self.steps;
        if count > 0.0 {
            let mean = sum / count;
            self.report.jitter = (squares / count - mean * mean).max(0.0).sqrt();
        }
        self.report.resampled = !self.as_they_are;
        self.report
    }

    /// Gaps so far; the report keeps the first ones.
    pub fn gaps(&self) -> usize {
        self.gaps
    }

    fn drop_row(&mut self, number: usize, is_backward: bool) -> Result<(), ClockError> {
        self.report.dropped += 1;
        self.report.first_dropped.get_or_insert(number);
        if is_backward {
            if self.backward.0 == 0 {
                self.backward.1 = number;
            }
            self.backward.0 += 1;
            let rows = self.report.rows.max(self.expected);
            let tolerated = (self.settings.backward_limit * rows as f64) as usize;
            if self.backward.0 > tolerated {
                return Err(ClockError::Backwards {
                    log: self.log.clone(),
                    row: self.backward.1,
                    found: self.backward.0,
                    expected: tolerated,
                    rows: self.report.rows,
                });
            }
        }
        Ok(())
    }

    /// Lays the samples between two rows: those from the first on and before the second.
    fn lay(
        &mut self,
        latest: f64,
        t: f64,
        before: Option<usize>,
        after: usize,
        number: usize,
        laid: &mut Vec<Sample>,
    ) -> Result<(), ClockError> {
        let rate = self.report.rate_hz;
        let step = (t - latest) * rate;
        let is_gap = step > self.settings.gap_steps;
        let ahead = if self.as_they_are {
            step
        } else {
            (t - self.anchor.1) * rate + 1.0 - (self.samples - self.anchor.0) as f64
        };
        let most = self.settings.grid_limit * self.expected as f64;
        let allowed = self.settings.grid_limit * self.report.rows.max(self.expected) as f64;
        if ahead > most || self.samples as f64 + ahead > allowed {
            return Err(ClockError::GridTooLong {
                log: self.log.clone(),
                rate_hz: rate,
                row: number - 1,
                duration: t - latest,
                found: self.samples as f64 + ahead,
                expected: allowed.min(self.samples as f64 + most),
                rows: self.report.rows,
            });
        }
        if is_gap {
            self.gaps += 1;
            if self.report.gaps.len() < MOST_GAPS {
                self.report.gaps.push(Gap { row: number - 1, start: latest, duration: t - latest });
            }
        } else {
            let off = step - 1.0;
            self.steps = (self.steps.0 + 1.0, self.steps.1 + off, self.steps.2 + off * off);
            if self.as_they_are && off.abs() > OFF {
                self.as_they_are = false;
                self.anchor = (self.samples - 1, latest);
            }
        }
        if self.as_they_are {
            let missing = if is_gap { step.round() as usize - 1 } else { 0 };
            laid.extend((1..=missing).map(|k| {
                let fraction = k as f64 / (missing + 1) as f64;
                Sample::Between { before, after, fraction, usable: false }
            }));
            self.samples += missing;
            self.report.unusable += missing;
            return Ok(());
        }
        loop {
            let at = self.anchor.1 + (self.samples - self.anchor.0) as f64 / rate;
            if at >= t {
                return Ok(());
            }
            let fraction = ((at - latest) / (t - latest)).clamp(0.0, 1.0);
            let usable = !inside_gap(at, latest, t, rate, self.settings.gap_steps);
            laid.push(Sample::Between { before, after, fraction, usable });
            self.samples += 1;
            self.report.unusable += usize::from(!usable);
        }
    }

    /// Values of samples that were laid.
    fn give(&self, laid: &[Sample], rows: usize, columns: &[&[f64]], out: &mut GridSamples) {
        out.columns.resize_with(columns.len(), Vec::new);
        // The usual portion is laid as it is.
        if laid.len() == rows && laid.iter().all(|sample| matches!(sample, Sample::Row(_))) {
            for (to, from) in out.columns.iter_mut().zip(columns) {
                to.extend_from_slice(from);
            }
            out.usable.resize(out.usable.len() + rows, true);
            return;
        }
        for (k, (to, from)) in out.columns.iter_mut().zip(columns).enumerate() {
            let here = |before: &Option<usize>| match (before, &self.last) {
                (Some(row), _) => from[*row],
                (None, Some(last)) => last.values[k],
                (None, None) => unreachable!("nothing lies before the first row"),
            };
            to.extend(laid.iter().map(|sample| match sample {
                Sample::Row(row) => from[*row],
                Sample::Between { before, after, fraction, .. } => {
                    between(here(before), from[*after], *fraction)
                }
            }));
        }
        out.usable.extend(laid.iter().map(|sample| !matches!(sample, Sample::Between { usable: false, .. })));
    }
}

fn between(here: f64, next: f64, fraction: f64) -> f64 {
    // Weighted sum: the difference of two finite values may overflow.
    if fraction == 0.0 { here } else { (1.0 - fraction) * here + fraction * next }
}

/// Whether a time lies strictly between two rows that are a gap apart.
fn inside_gap(t: f64, before: f64, after: f64, rate: f64, gap_steps: f64) -> bool {
    (t - before) * rate > SAME && (after - t) * rate > SAME && (after - before) * rate > gap_steps
}

#[cfg(test)]
mod tests {
    use super::super::uniform;
    use super::*;
    use crate::log::{JointSignals, Log};

    fn signal(time: &[f64]) -> Vec<f64> {
        time.iter().map(|t| (7.0 * t).sin()).collect()
    }

    fn streamed(time: &[f64], portion: usize, known: &ClockReport) -> (GridSamples, ClockReport) {
        let values = signal(time);
        let mut rows = GridRows::new("run", &ClockSettings::default(), known, time.len());
        let mut out = GridSamples::default();
        for (time, values) in time.chunks(portion).zip(values.chunks(portion)) {
            rows.push(time, &[values], &mut out).unwrap();
        }
        let report = rows.finish(&mut out);
        (out, report)
    }

    fn whole(time: &[f64]) -> crate::UniformLog {
        let position = signal(time);
        let joint = JointSignals { name: "j".into(), effort: position.clone(), velocity: None, position };
        let log = Log::new("run", time.to_vec(), vec![joint], vec![]).unwrap();
        uniform(&log, &ClockSettings::default()).unwrap()
    }

    #[test]
    fn samples_are_those_of_the_whole_log_however_rows_are_portioned() {
        let regular: Vec<f64> = (0..900).map(|k| 0.5 + f64::from(k) * 0.002).collect();
        let mut late = regular.clone();
        for (k, t) in late.iter_mut().enumerate() {
            *t += 0.0005 * ((k * 37 % 11) as f64 / 11.0);
        }
        let mut gaps = late.clone();
        gaps.drain(100..112);
        gaps.drain(400..404);
        let mut twice = gaps.clone();
        twice[50] = twice[49];
        twice[300] = twice[298];
        for time in [regular, late, gaps, twice] {
            let expected = whole(&time);
            for portion in [1, 2, 7, 256, 1000] {
                let (found, report) = streamed(&time, portion, &expected.report);
                assert_eq!(found.columns[0], expected.joints[0].position);
                assert_eq!(found.usable, expected.usable);
                assert_eq!(report.gaps, expected.report.gaps);
                assert_eq!(
                    (report.rows, report.dropped, report.first_dropped, report.unusable, report.resampled),
                    (
                        expected.report.rows,
                        expected.report.dropped,
                        expected.report.first_dropped,
                        expected.report.unusable,
                        expected.report.resampled
                    )
                );
                assert!((report.jitter - expected.report.jitter).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn a_gap_behind_a_regular_beginning_takes_whole_samples() {
        let mut time: Vec<f64> = (0..900).map(|k| f64::from(k) * 0.002).collect();
        let known = whole(&time).report;
        time.drain(500..520);
        let (found, report) = streamed(&time, 64, &known);
        assert_eq!(found.usable.len(), 900);
        assert!(found.usable.iter().enumerate().all(|(k, usable)| *usable != (500..520).contains(&k)));
        assert_eq!((report.unusable, report.gaps.len(), report.resampled), (20, 1, false));
        assert_eq!(found.columns[0][520..], signal(&time)[500..]);
    }

    #[test]
    fn another_rate_behind_a_regular_beginning_is_interpolated() {
        let mut time: Vec<f64> = (0..900).map(|k| f64::from(k) * 0.002).collect();
        let known = whole(&time).report;
        time.extend((0..450).map(|k| 1.8 + f64::from(k) * 0.004));
        let (found, report) = streamed(&time, 100, &known);
        assert!(report.resampled && report.unusable == 0);
        assert!((found.usable.len() as f64 - 1800.0).abs() < 4.0, "{}", found.usable.len());
        for (n, x) in found.columns[0].iter().enumerate() {
            assert!((x - (7.0 * n as f64 * 0.002).sin()).abs() < 2e-4, "{n}");
        }
    }

    #[test]
    fn a_clock_that_restarts_or_jumps_is_refused_where_it_does() {
        let regular: Vec<f64> = (0..900).map(|k| f64::from(k) * 0.002).collect();
        let known = whole(&regular).report;
        let mut rows = GridRows::new("run", &ClockSettings::default(), &known, 900);
        let mut out = GridSamples::default();
        rows.push(&regular, &[&regular], &mut out).unwrap();
        let again = rows.clone().push(&regular, &[&regular], &mut out).unwrap_err();
        assert!(matches!(again, ClockError::Backwards { row: 900, .. }), "{again}");
        let far = rows.push(&[1e6], &[&[0.0]], &mut out).unwrap_err();
        assert!(matches!(far, ClockError::GridTooLong { row: 899, .. }), "{far}");
    }
}
