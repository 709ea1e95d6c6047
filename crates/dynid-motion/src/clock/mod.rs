//! The clock of a log: rows that step back, sample rate, jitter, gaps, and the uniform grid.

mod error;
mod row_by_row;

pub use error::ClockError;
pub use row_by_row::{GridRows, GridSamples};

use crate::log::{Channel, JointSignals, Log};
use crate::median::median;

/// How a clock is judged and a grid is laid.
#[derive(Debug, Clone, PartialEq)]
pub struct ClockSettings {
    /// Sample rate, Hz. Default `None`: 1 / median step.
    pub rate_hz: Option<f64>,
    /// Standard deviation of the ordinary steps, in samples, from which on the log is resampled. Default 1e-3.
    pub jitter_limit: f64,
    /// A step longer than this many samples is a gap. Default 2.5.
    pub gap_steps: f64,
    /// Largest tolerated share of rows that lie before an earlier row. Default 0.01.
    pub backward_limit: f64,
    /// Largest tolerated number of grid samples per row. Default 4.
    pub grid_limit: f64,
    /// Fewest rows that make a record. Default 16, more than the padding of the order 4 filter.
    pub min_rows: usize,
}

impl Default for ClockSettings {
    fn default() -> Self {
        Self {
            rate_hz: None,
            jitter_limit: 1e-3,
            gap_steps: 2.5,
            backward_limit: 0.01,
            grid_limit: 4.0,
            min_rows: 16,
        }
    }
}

/// A step longer than the gap limit.
#[derive(Debug, Clone, PartialEq)]
pub struct Gap {
    /// Row before the gap (of the log as recorded).
    pub row: usize,
    /// Time of that row, s.
    pub start: f64,
    /// Length of the step, s.
    pub duration: f64,
}

/// What was found about a clock.
#[derive(Debug, Clone, PartialEq)]
pub struct ClockReport {
    /// Rows of the log.
    pub rows: usize,
    /// Rows dropped because their time is not after every earlier one.
    pub dropped: usize,
    /// The first dropped row.
    pub first_dropped: Option<usize>,
    /// Sample rate, Hz.
    pub rate_hz: f64,
    /// Standard deviation of the ordinary steps, in samples.
    pub jitter: f64,
    /// Steps longer than the gap limit.
    pub gaps: Vec<Gap>,
    /// Whether the signals were interpolated on a new grid.
    pub resampled: bool,
    /// Grid samples that lie inside a gap.
    pub unusable: usize,
}

/// A log on a uniform grid: sample `n` belongs to `start + n / rate_hz`.
#[derive(Debug, Clone, PartialEq)]
pub struct UniformLog {
    /// Name of the log.
    pub name: String,
    /// Time of sample 0, s.
    pub start: f64,
    /// Sample rate, Hz.
    pub rate_hz: f64,
    /// Joint signals on the grid.
    pub joints: Vec<JointSignals>,
    /// Further channels on the grid.
    pub channels: Vec<Channel>,
    /// Per sample: false inside a gap, where values are only interpolated.
    pub usable: Vec<bool>,
    /// What was found about the clock.
    pub report: ClockReport,
}

impl UniformLog {
    /// Number of grid samples.
    pub fn samples(&self) -> usize {
        self.usable.len()
    }

    /// Time of a grid sample, s.
    pub fn time(&self, sample: usize) -> f64 {
        self.start + sample as f64 / self.rate_hz
    }
}

/// Judges the clock and puts the log on a uniform grid.
///
/// Rows whose time is not after every earlier time are dropped. With `jitter < jitter_limit`, no gap and no rate
/// forced away from the clock's own, the rows are used as they are; otherwise all signals are interpolated linearly
/// on the grid, and grid samples strictly inside a gap are flagged unusable.
pub fn uniform(log: &Log, settings: &ClockSettings) -> Result<UniformLog, ClockError> {
    check_settings(settings)?;
    let kept = increasing_rows(log, settings)?;
    let time: Vec<f64> = kept.iter().map(|&row| log.time()[row]).collect();
    let clock = judge(log, &kept, &time, settings)?;
    // Without a grid, rows are taken as they are.
    let grid = match clock.resampled {
        true => Some(lay_grid(log, &kept, &time, &clock, settings)?),
        false => None,
    };
    let usable: Vec<bool> = match &grid {
        Some(places) => places.iter().map(|place| place.usable).collect(),
        None => vec![true; kept.len()],
    };
    let unusable = usable.iter().filter(|u| !**u).count();
    let take = |values: &[f64]| -> Vec<f64> {
        match &grid {
            Some(places) => places.iter().map(|place| place.of(values, &kept)).collect(),
            None if kept.len() == values.len() => values.to_vec(),
            None => kept.iter().map(|row| values[*row]).collect(),
        }
    };
    Ok(UniformLog {
        name: log.name().to_owned(),
        start: time[0],
        rate_hz: clock.rate_hz,
        joints: log
            .joints()
            .iter()
            .map(|joint| JointSignals {
                name: joint.name.clone(),
                position: take(&joint.position),
                velocity: joint.velocity.as_deref().map(take),
                effort: take(&joint.effort),
            })
            .collect(),
        channels: log
            .channels()
            .iter()
            .map(|channel| Channel { name: channel.name.clone(), values: take(&channel.values) })
            .collect(),
        usable,
        report: ClockReport { unusable, ..clock },
    })
}

fn check_settings(settings: &ClockSettings) -> Result<(), ClockError> {
    let checks = [
        ("rate_hz", settings.rate_hz.unwrap_or(1.0), 0.0, "a positive finite number"),
        ("gap_steps", settings.gap_steps, 1.0, "a finite number of more than 1 sample"),
        ("grid_limit", settings.grid_limit, 1.0, "a finite number of more than 1 sample per row"),
    ];
    for (name, found, above, expected) in checks {
        if !(found > above && found.is_finite()) {
            return Err(ClockError::Setting { name, expected, found });
        }
    }
    Ok(())
}

fn increasing_rows(log: &Log, settings: &ClockSettings) -> Result<Vec<usize>, ClockError> {
    let time = log.time();
    let mut kept = Vec::with_capacity(time.len());
    let mut latest = f64::NEG_INFINITY;
    let mut backward = 0;
    let mut first_backward = 0;
    for (row, &t) in time.iter().enumerate() {
        if t > latest {
            kept.push(row);
            latest = t;
        } else if t < latest {
            if backward == 0 {
                first_backward = row;
            }
            backward += 1;
        }
    }
    let tolerated = (settings.backward_limit * time.len() as f64) as usize;
    if backward > tolerated {
        return Err(ClockError::Backwards {
            log: log.name().to_owned(),
            row: first_backward,
            found: backward,
            expected: tolerated,
            rows: time.len(),
        });
    }
    check_count(log, kept.len(), settings)?;
    Ok(kept)
}

fn check_count(log: &Log, found: usize, settings: &ClockSettings) -> Result<(), ClockError> {
    let expected = settings.min_rows.max(2);
    if found >= expected {
        return Ok(());
    }
    Err(ClockError::TooFewSamples { log: log.name().to_owned(), expected, found })
}

fn judge(
    log: &Log,
    kept: &[usize],
    time: &[f64],
    settings: &ClockSettings,
) -> Result<ClockReport, ClockError> {
    let steps: Vec<f64> = time.windows(2).map(|w| w[1] - w[0]).collect();
    let own_rate = 1.0 / median(&steps).unwrap_or(0.0);
    let rate_hz = settings.rate_hz.unwrap_or(own_rate);
    if !rate_hz.is_finite() {
        // Steps of denormal length: the time column is not in seconds.
        return Err(ClockError::Setting {
            name: "median step",
            expected: "a positive time in s whose inverse is a rate",
            found: 1.0 / own_rate,
        });
    }
    let longest = settings.gap_steps / rate_hz;
    let ordinary: Vec<f64> = steps.iter().copied().filter(|dt| *dt <= longest).collect();
    let gaps: Vec<Gap> = steps
        .iter()
        .enumerate()
        .filter(|(_, dt)| **dt > longest)
        .map(|(n, &duration)| Gap { row: kept[n], start: time[n], duration })
        .collect();
    let jitter = standard_deviation(&ordinary) * rate_hz;
    let forced = (rate_hz / own_rate - 1.0).abs() >= settings.jitter_limit;
    let rows = log.rows();
    let first_dropped = (kept.len() < rows)
        .then(|| kept.iter().enumerate().position(|(n, &row)| n != row).unwrap_or(kept.len()));
    Ok(ClockReport {
        rows,
        dropped: rows - kept.len(),
        first_dropped,
        rate_hz,
        jitter,
        resampled: jitter >= settings.jitter_limit || !gaps.is_empty() || forced,
        gaps,
        unusable: 0,
    })
}

fn standard_deviation(values: &[f64]) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (values.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / n).sqrt()
}

/// Where a grid sample lies between kept rows.
struct Place {
    row: usize,
    fraction: f64,
    usable: bool,
}

impl Place {
    fn of(&self, values: &[f64], kept: &[usize]) -> f64 {
        let here = values[kept[self.row]];
        if self.fraction == 0.0 {
            return here;
        }
        let next = values[kept[self.row + 1]];
        // Weighted sum, not `here + f (next - here)`: the difference of two finite values may overflow.
        (1.0 - self.fraction) * here + self.fraction * next
    }
}

/// A grid sample this close to a row (in samples) is that row.
const SAME: f64 = 1e-6;

fn lay_grid(
    log: &Log,
    kept: &[usize],
    time: &[f64],
    clock: &ClockReport,
    settings: &ClockSettings,
) -> Result<Vec<Place>, ClockError> {
    let rate = clock.rate_hz;
    let start = time[0];
    let wanted = (time[time.len() - 1] - start) * rate + 1.0;
    let allowed = settings.grid_limit * time.len() as f64;
    if wanted > allowed {
        let (row, duration) = longest_step(time);
        return Err(ClockError::GridTooLong {
            log: log.name().to_owned(),
            rate_hz: rate,
            row: kept[row],
            duration,
            found: wanted,
            expected: allowed,
            rows: log.rows(),
        });
    }
    let samples = (wanted + SAME) as usize;
    check_count(log, samples, settings)?;
    let mut row = 0;
    let places = (0..samples).map(|n| {
        let t = start + n as f64 / rate;
        while row + 2 < time.len() && time[row + 1] <= t {
            row += 1;
        }
        let step = time[row + 1] - time[row];
        let fraction = ((t - time[row]) / step).clamp(0.0, 1.0);
        let inside = (t - time[row]) * rate > SAME && (time[row + 1] - t) * rate > SAME;
        Place { row, fraction, usable: !(inside && step * rate > settings.gap_steps) }
    });
    Ok(places.collect())
}

fn longest_step(time: &[f64]) -> (usize, f64) {
    time.windows(2)
        .map(|w| w[1] - w[0])
        .enumerate()
        .fold((0, 0.0), |best, (row, dt)| if dt > best.1 { (row, dt) } else { best })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn log_of(time: Vec<f64>) -> Log {
        let position: Vec<f64> = time.iter().map(|t| 3.0 * t - 1.0).collect();
        let joint = JointSignals { name: "j".into(), effort: position.clone(), velocity: None, position };
        Log::new("run", time, vec![joint], vec![]).unwrap()
    }

    fn regular(rows: usize) -> Vec<f64> {
        (0..rows).map(|k| 0.5 + k as f64 * 0.002).collect()
    }

    #[test]
    fn a_regular_clock_is_used_as_it_is() {
        let log = log_of(regular(100));
        let grid = uniform(&log, &ClockSettings::default()).unwrap();
        assert!(!grid.report.resampled);
        assert!((grid.rate_hz - 500.0).abs() < 1e-9);
        assert_eq!(grid.joints, log.joints());
        assert_eq!(grid.samples(), 100);
    }

    #[test]
    fn rows_that_do_not_advance_are_dropped_and_counted() {
        let mut time = regular(300);
        time[50] = time[49];
        time[90] = time[80];
        let grid = uniform(&log_of(time), &ClockSettings::default()).unwrap();
        assert_eq!((grid.report.dropped, grid.report.first_dropped), (2, Some(50)));
        assert!(grid.report.resampled);
        assert_eq!(grid.samples(), 300);
        assert!(grid.usable.iter().all(|u| *u));
    }

    #[test]
    fn linear_motion_survives_jitter_and_gaps() {
        let mut time = regular(200);
        for (k, t) in time.iter_mut().enumerate() {
            *t += 0.0003 * ((k * 37 % 11) as f64 / 11.0);
        }
        time.drain(100..110);
        let grid = uniform(&log_of(time.clone()), &ClockSettings::default()).unwrap();
        assert_eq!(grid.report.gaps.len(), 1);
        assert_eq!(grid.report.gaps[0].row, 99);
        assert_eq!(grid.report.gaps[0].start, time[99]);
        assert!((9..=11).contains(&grid.report.unusable), "{}", grid.report.unusable);
        for n in 0..grid.samples() {
            let expected = 3.0 * grid.time(n) - 1.0;
            assert!((grid.joints[0].position[n] - expected).abs() < 1e-12);
        }
    }

    #[test]
    fn grid_samples_on_the_rows_around_a_gap_stay_usable() {
        let mut time = regular(100);
        time.drain(40..43);
        let grid = uniform(&log_of(time), &ClockSettings::default()).unwrap();
        let bad: Vec<usize> = (0..grid.samples()).filter(|&n| !grid.usable[n]).collect();
        assert_eq!(bad, [40, 41, 42]);
    }

    #[test]
    fn a_clock_that_restarts_names_its_first_row() {
        let mut time = regular(60);
        time.extend(regular(60));
        let error = uniform(&log_of(time), &ClockSettings::default()).unwrap_err();
        assert!(matches!(error, ClockError::Backwards { row: 60, found: 59, .. }), "{error}");
    }

    #[test]
    fn a_huge_gap_is_refused_before_memory_is_taken() {
        for jump in [1e3, 1e15, 1e300] {
            let mut time = regular(100);
            for t in &mut time[50..] {
                *t += jump;
            }
            time.dedup();
            let settings = ClockSettings { min_rows: 2, ..ClockSettings::default() };
            let error = uniform(&log_of(time), &settings).unwrap_err();
            assert!(
                matches!(error, ClockError::GridTooLong { row: 49, .. } | ClockError::TooFewSamples { .. }),
                "{error}"
            );
        }
    }

    #[test]
    fn a_stopped_clock_is_too_few_samples() {
        let error = uniform(&log_of(vec![1.0; 50]), &ClockSettings::default()).unwrap_err();
        assert!(matches!(error, ClockError::TooFewSamples { found: 1, .. }), "{error}");
    }

    #[test]
    fn a_forced_rate_resamples() {
        let settings = ClockSettings { rate_hz: Some(1000.0), ..ClockSettings::default() };
        let grid = uniform(&log_of(regular(100)), &settings).unwrap();
        assert_eq!(grid.samples(), 199);
        assert!((grid.joints[0].position[1] - (3.0 * 0.501 - 1.0)).abs() < 1e-12);
        let settings = ClockSettings { rate_hz: Some(-1.0), ..ClockSettings::default() };
        assert!(matches!(uniform(&log_of(regular(100)), &settings), Err(ClockError::Setting { .. })));
    }
}
