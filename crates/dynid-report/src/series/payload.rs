//! What the page's script gets for one log, or for one trajectory.

use serde::Serialize;

use super::decimation::Decimation;
use super::encoding::{EncodedTimes, EncodedValues, encode_times, encode_values};
use super::residual::residual;
use crate::data::{Joint, JointSeries, LogReport, LogSeries};

/// Points drawn per series. Each costs 2.7 bytes of page.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PointBudget {
    pub(super) per_series: usize,
}

impl PointBudget {
    /// About 1.6 MB of page for all series together.
    const TOTAL: usize = 600_000;
    /// Enough for a screen's width however many series there are.
    const LEAST: usize = 400;
    /// 40 s at 500 Hz in full.
    const MOST: usize = 20_000;
    /// Enough for smooth curves at a zoom of five.
    const MOST_SMOOTH: usize = 4000;

    /// Shares the page's points among the series of all logs.
    pub(crate) fn share(logs: &[LogReport]) -> Self {
        let series: usize =
            logs.iter().filter_map(|log| log.series.as_ref()).map(|series| 3 * series.joints.len()).sum();
        Self { per_series: (Self::TOTAL / series.max(1)).clamp(Self::LEAST, Self::MOST) }
    }

    /// For curves without noise.
    pub(super) fn share_smooth(series: usize) -> Self {
        Self { per_series: (Self::TOTAL / series.max(1)).clamp(Self::LEAST, Self::MOST_SMOOTH) }
    }
}

/// What is drawn over one common time, for the script.
#[derive(Debug, Serialize)]
pub(crate) struct PlotPayload<'a> {
    time: EncodedTimes,
    /// A step longer than this, s, is a gap in the log and breaks the curves.
    gap: f64,
    /// Samples behind one pair of points; absent if every sample is drawn.
    pub(crate) bucket: Option<usize>,
    panels: Vec<Panel<'a>>,
}

impl PlotPayload<'_> {
    /// Whether any stretch is shaded.
    pub(crate) fn shaded(&self) -> bool {
        self.panels.iter().any(|panel| !panel.shaded.is_empty())
    }
}

/// One plot.
#[derive(Debug, Serialize)]
pub(super) struct Panel<'a> {
    pub(super) name: &'a str,
    /// In the order drawn: the last one lies on top.
    pub(super) series: Vec<Curve>,
    /// Shaded stretches of time, s.
    pub(super) shaded: Vec<[f64; 2]>,
    /// Values marked by a line across; always inside the picture.
    pub(super) limits: Vec<f64>,
}

#[derive(Debug, Serialize)]
pub(super) struct Curve {
    /// What it is called when values are read out.
    pub(super) name: &'static str,
    /// Class of its line, by which it is shown and hidden.
    pub(super) kind: &'static str,
    pub(super) values: EncodedValues,
}

/// `joints` and `series.joints` have equal length and each series has the length of `series.time_s`.
pub(crate) fn log_payload<'a>(
    joints: &'a [Joint],
    series: &LogSeries,
    budget: PointBudget,
) -> PlotPayload<'a> {
    let decimation = Decimation::new(series.time_s.len(), budget.per_series);
    let panels = joints
        .iter()
        .zip(&series.joints)
        .map(|(joint, efforts)| joint_panel(joint, efforts, &series.time_s, decimation))
        .collect();
    payload(&series.time_s, decimation, panels)
}

pub(super) fn payload<'a>(time_s: &[f64], decimation: Decimation, panels: Vec<Panel<'a>>) -> PlotPayload<'a> {
    let times = decimation.times(time_s);
    PlotPayload {
        gap: 5.0 * median_step(&times),
        time: encode_times(&times),
        bucket: decimation.samples_per_bucket(),
        panels,
    }
}

fn joint_panel<'a>(
    joint: &'a Joint,
    efforts: &JointSeries,
    time_s: &[f64],
    decimation: Decimation,
) -> Panel<'a> {
    let curve = |name, samples: &[f64]| Curve {
        name,
        kind: name,
        values: encode_values(&decimation.values(samples)),
    };
    let mut series = vec![curve("measured", &efforts.measured)];
    if let Some(predicted) = efforts.drawn.as_ref().or(efforts.predicted.as_deref()) {
        series.push(curve("residual", &residual(&efforts.measured, predicted)));
        series.push(curve("predicted", predicted));
    }
    Panel {
        name: &joint.name,
        series,
        shaded: efforts.used.as_deref().map(|used| unused_stretches(time_s, used)).unwrap_or_default(),
        limits: Vec::new(),
    }
}

/// Median difference of neighbours, s; 0 for fewer than two times.
pub(crate) fn median_step(times: &[f64]) -> f64 {
    let mut steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    if steps.is_empty() {
        return 0.0;
    }
    let middle = steps.len() / 2;
    *steps.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// First and last time of each run of unused samples; runs closer than 1/2000 of the log are joined, being one
/// pixel.
fn unused_stretches(time_s: &[f64], used: &[bool]) -> Vec<[f64; 2]> {
    let duration = time_s.last().unwrap_or(&0.0) - time_s.first().unwrap_or(&0.0);
    let mut stretches: Vec<[f64; 2]> = Vec::new();
    for (&time, _) in time_s.iter().zip(used).filter(|(_, used)| !**used) {
        match stretches.last_mut() {
            Some(stretch) if time - stretch[1] <= duration / 2000.0 => stretch[1] = time,
            _ => stretches.push([time, time]),
        }
    }
    stretches
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_stretches_are_joined_and_far_ones_kept_apart() {
        let time: Vec<f64> = (0..10_000).map(f64::from).collect();
        let mut used = vec![true; 10_000];
        for i in [100, 103, 5000, 5001] {
            used[i] = false;
        }
        assert_eq!(unused_stretches(&time, &used), [[100.0, 103.0], [5000.0, 5001.0]]);
    }

    #[test]
    fn many_series_share_the_page() {
        let log = |joints: usize| LogReport {
            series: Some(LogSeries { joints: vec![JointSeries::default(); joints], ..LogSeries::default() }),
            ..LogReport::default()
        };
        assert_eq!(PointBudget::share(&[]).per_series, PointBudget::MOST);
        assert_eq!(PointBudget::share(&[log(5), log(5)]).per_series, 20_000);
        assert_eq!(PointBudget::share(&[log(7), log(7), log(6)]).per_series, 10_000);
        assert_eq!(PointBudget::share(&vec![log(32); 100]).per_series, PointBudget::LEAST);
    }
}
