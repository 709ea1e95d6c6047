//! The uniform grid of a live clock.

use crate::signal::{SignalError, check_positive};
use dynid_words::Transfer;

/// A step longer than this many samples is a gap.
const GAP_STEPS: f64 = 2.5;
/// A sample this near to a grid point, in samples, is taken as it is.
const ON_GRID: f64 = 1e-3;
/// So many samples in a row that lie before the latest one are a clock that was set back.
const SET_BACK: u64 = 16;

/// What was found about a live clock.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ClockCounts {
    /// Samples dropped because their time is not after the latest one.
    pub backward: u64,
    /// Steps longer than 2.5 samples.
    pub gaps: u64,
    /// Times that the clock was set back: 16 samples in a row before the latest one.
    pub set_back: u64,
}

/// A sample on the grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GridSample<'a> {
    /// Time, s.
    pub time: f64,
    /// Values.
    pub values: &'a [f64],
    /// The first of a run: there is a gap before it.
    pub first: bool,
}

/// Puts the samples of a live clock on a uniform grid that begins with the first sample of every run.
///
/// Samples within 1e-3 of a step of a grid point are used as they are, other grid points lie on the line between
/// neighbours. Samples that do not advance are dropped. A step longer than 2.5 samples ends the run, and so do 16 samples in a
/// row before the latest one, for the clock was set back.
#[derive(Debug, Clone)]
pub struct LiveGrid {
    step: f64,
    origin: f64,
    /// Next grid point of the run.
    next: u64,
    last_time: Option<f64>,
    last: Vec<f64>,
    between: Vec<f64>,
    in_a_row: u64,
    counts: ClockCounts,
}

impl LiveGrid {
    /// A grid of `rate_hz` for samples of `width` values.
    ///
    /// # Errors
    /// [`SignalError`] unless the rate is a positive number.
    pub fn new(rate_hz: f64, width: usize) -> Result<LiveGrid, SignalError> {
        check_positive("rate_hz", rate_hz)?;
        Ok(LiveGrid {
            step: 1.0 / rate_hz,
            origin: 0.0,
            next: 0,
            last_time: None,
            last: vec![0.0; width],
            between: vec![0.0; width],
            in_a_row: 0,
            counts: ClockCounts::default(),
        })
    }

    /// What was found about the clock so far.
    pub fn counts(&self) -> ClockCounts {
        self.counts
    }

    /// Time of the latest sample that was taken, s.
    pub fn latest(&self) -> Option<f64> {
        self.last_time
    }

    /// The next sample begins a run, whatever its time.
    pub fn interrupt(&mut self) {
        self.last_time = None;
        self.in_a_row = 0;
    }

    /// Takes a sample and hands on the grid points up to it.
    ///
    /// # Panics
    /// If there are not as many values as the grid is wide.
    pub fn push(&mut self, time: f64, values: &[f64], mut take: impl FnMut(GridSample<'_>)) {
        assert_eq!(values.len(), self.last.len(), "values of a sample");
        match self.last_time {
            Some(last) if time <= last => {
                self.counts.backward += 1;
                self.in_a_row += 1;
                if self.in_a_row < SET_BACK {
                    return;
                }
                self.counts.set_back += 1;
                self.begin(time, values, &mut take);
            }
            Some(last) if time - last > GAP_STEPS * self.step => {
                self.counts.gaps += 1;
                self.begin(time, values, &mut take);
            }
            Some(last) => {
                self.in_a_row = 0;
                self.fill(last, time, values, &mut take);
                self.last.copy_from_slice(values);
                self.last_time = Some(time);
            }
            None => self.begin(time, values, &mut take),
        }
    }

    fn begin(&mut self, time: f64, values: &[f64], take: &mut impl FnMut(GridSample<'_>)) {
        (self.origin, self.next, self.in_a_row) = (time, 1, 0);
        self.last_time = Some(time);
        self.last.copy_from_slice(values);
        take(GridSample { time, values, first: true });
    }

    /// Grid points after `last` and up to `time`.
    fn fill(&mut self, last: f64, time: f64, values: &[f64], take: &mut impl FnMut(GridSample<'_>)) {
        loop {
            let grid = self.origin + self.next as f64 * self.step;
            let after = (grid - time) / self.step;
            if after > ON_GRID {
                return;
            }
            self.next += 1;
            if after >= -ON_GRID {
                take(GridSample { time: grid, values, first: false });
                continue;
            }
            // A grid point just behind the sample before was taken with it.
            let part = (grid - last) / (time - last);
            for ((b, from), to) in self.between.iter_mut().zip(&self.last).zip(values) {
                *b = from + part * (to - from);
            }
            take(GridSample { time: grid, values: &self.between, first: false });
        }
    }

    /// Carries the state to or from a checkpoint.
    pub fn transfer(&mut self, transfer: &mut Transfer<'_>) {
        transfer.real(&mut self.origin);
        transfer.integer(&mut self.next);
        let mut started = self.last_time.is_some();
        let mut last = self.last_time.unwrap_or(0.0);
        transfer.flag(&mut started);
        transfer.real(&mut last);
        self.last_time = started.then_some(last);
        transfer.reals(&mut self.last);
        transfer.integer(&mut self.in_a_row);
        transfer.integer(&mut self.counts.backward);
        transfer.integer(&mut self.counts.gaps);
        transfer.integer(&mut self.counts.set_back);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(grid: &mut LiveGrid, samples: &[(f64, f64)]) -> Vec<(f64, f64, bool)> {
        let mut out = Vec::new();
        for (time, value) in samples {
            grid.push(*time, &[*value], |s| out.push((s.time, s.values[0], s.first)));
        }
        out
    }

    #[test]
    fn a_steady_clock_passes_as_it_is() {
        let mut grid = LiveGrid::new(100.0, 1).unwrap();
        let samples: Vec<(f64, f64)> =
            (0..50).map(|n| (3.0 + f64::from(n) / 100.0, f64::from(n).sin())).collect();
        let out = run(&mut grid, &samples);
        assert_eq!(out.len(), 50);
        for (n, (o, s)) in out.iter().zip(&samples).enumerate() {
            assert_eq!((o.1, o.2), (s.1, n == 0));
            assert!((o.0 - s.0).abs() < 1e-12);
        }
        assert_eq!(grid.counts(), ClockCounts::default());
    }

    #[test]
    fn jitter_and_single_losses_are_interpolated() {
        let mut grid = LiveGrid::new(10.0, 1).unwrap();
        let times = [0.0, 0.11, 0.19, 0.4, 0.52];
        let out = run(&mut grid, &times.map(|t| (t, 2.0 * t)));
        assert_eq!(out.len(), 6);
        for (n, (time, value, _)) in out.iter().enumerate() {
            assert!((time - 0.1 * n as f64).abs() < 1e-12 && (value - 2.0 * time).abs() < 1e-12);
        }
    }

    #[test]
    fn gaps_and_clocks_that_are_set_back_begin_a_run() {
        let mut grid = LiveGrid::new(10.0, 1).unwrap();
        let out = run(&mut grid, &[(0.0, 0.0), (0.1, 1.0), (0.1, 9.0), (0.05, 9.0), (0.2, 2.0), (0.6, 3.0)]);
        assert_eq!(out.iter().map(|o| o.2).collect::<Vec<_>>(), [true, false, false, true]);
        assert_eq!((grid.counts().backward, grid.counts().gaps), (2, 1));
        let again: Vec<(f64, f64)> = (0..20).map(|n| (0.1 + f64::from(n) / 50.0, 5.0)).collect();
        let out = run(&mut grid, &again);
        assert!(out[0].2 && (out[0].0 - again[15].0).abs() < 1e-12);
        assert_eq!((grid.counts().backward, grid.counts().set_back), (18, 1));
    }

    #[test]
    fn a_checkpoint_goes_on_with_the_same_bits() {
        let samples: Vec<(f64, f64)> = (0..40).map(|n| (f64::from(n) * 0.1003, f64::from(n).cos())).collect();
        let mut whole = LiveGrid::new(10.0, 1).unwrap();
        let all = run(&mut whole, &samples);
        let mut first = LiveGrid::new(10.0, 1).unwrap();
        let mut out = run(&mut first, &samples[..17]);
        let mut words = Vec::new();
        first.transfer(&mut Transfer::Save(&mut words));
        let mut second = LiveGrid::new(10.0, 1).unwrap();
        let mut load = Transfer::load(&words);
        second.transfer(&mut load);
        assert!(load.complete());
        out.extend(run(&mut second, &samples[17..]));
        assert_eq!(out, all);
    }
}
