//! Signals that stop changing although the machine does not.

use super::{Run, high_quantile, is_no_accident, runs};
use crate::signal::{quantum, rms};

/// Fewest equal samples that count.
const LEAST: usize = 8;
/// Shortest time that counts, s.
const SHORTEST_S: f64 = 0.03;
/// Samples that tell the speed on either side of a run.
const SIDE: usize = 4;
/// Share of its rms speed above which no joint stops or starts within a sample.
const SUDDEN: f64 = 0.25;

/// Second differences, as many times their 99 % quantile, that no ordinary start or stop has.
const BENDS: f64 = 3.0;

/// A step back to where the joint has gone meanwhile, in 99 % quantiles of all steps.
const JUMP: f64 = 3.0;

/// Runs of equal positions that begin or end at speed: a joint comes to rest over many samples, a sensor that hangs within
/// one.
pub fn frozen_position(position: &[f64], rate_hz: f64) -> Vec<Run> {
    let least = LEAST.max((SHORTEST_S * rate_hz).ceil() as usize);
    let steps: Vec<f64> = position.windows(2).map(|w| w[1] - w[0]).collect();
    let bends: Vec<f64> = steps.windows(2).map(|w| (w[1] - w[0]).abs()).collect();
    let sudden = (SUDDEN * rms(&steps)).max(3.0 * quantum(position)).max(BENDS * high_quantile(bends));
    let speed = |steps: Option<&[f64]>| {
        let steps = steps.unwrap_or_default();
        // A jump where the signal comes back is no speed: the smallest step of a side is.
        let smallest = steps.iter().map(|s| s.abs()).fold(f64::INFINITY, f64::min);
        if steps.is_empty() { 0.0 } else { smallest }
    };
    let jump = JUMP * high_quantile(steps.iter().map(|s| s.abs()).collect());
    runs(position, least)
        .into_iter()
        .filter(|run| {
            let end = run.first + run.length;
            let back = steps.get(end - 1).is_some_and(|step| step.abs() > jump.max(sudden));
            let before = run.first.checked_sub(SIDE).and_then(|from| steps.get(from..run.first));
            let after = steps.get(end..end + SIDE);
            back || speed(before) > sudden || speed(after) > sudden
        })
        .collect()
}

/// Runs of equal efforts that are longer than chance makes them, given how often efforts repeat otherwise. Those at the
/// largest or the smallest value are left to [`super::clipped`].
pub fn frozen_effort(effort: &[f64], rate_hz: f64) -> Vec<Run> {
    let least = LEAST.max((SHORTEST_S * rate_hz).ceil() as usize);
    let (low, high) =
        effort.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
    let long = runs(effort, least);
    let inside: usize = long.iter().map(|r| r.length - 1).sum();
    let equal = effort.windows(2).filter(|w| w[0] == w[1]).count();
    let pairs = effort.len().saturating_sub(1 + inside).max(1);
    let repeats = (equal - inside.min(equal)) as f64 / pairs as f64;
    long.into_iter()
        .filter(|r| effort[r.first] > low && effort[r.first] < high)
        .filter(|r| is_no_accident(r.length, repeats, effort.len()))
        .collect()
}
