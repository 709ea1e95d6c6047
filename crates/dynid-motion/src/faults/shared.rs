//! Rows that two logs have in common.

use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash, Hasher};

use crate::log::{JointSignals, Log};
use crate::median::median;
use crate::signal::quantum;

/// Bits of noise that a stretch of rows must hold for two recordings not to agree in it by chance.
const BITS: f64 = 30.0;
/// Longest stretch that is compared, rows.
const LONGEST: usize = 16;
/// Deviations of noise that its values spread over.
const SPREAD: f64 = 3.5;

/// Rows of one log that an earlier one of the list holds too.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SharedRows {
    /// Place of the log.
    pub log: usize,
    /// Place of the earlier log.
    pub other: usize,
    /// Rows in motion that both have.
    pub rows: usize,
    /// Rows in motion of the log that has fewer of them.
    pub of: usize,
}

impl SharedRows {
    /// Share of the rows in motion of the log that has fewer of them.
    pub fn share(&self) -> f64 {
        self.rows as f64 / self.of.max(1) as f64
    }
}

/// Finds rows that logs share with earlier ones: positions and efforts of all joints agree to the resolution of the coarser log.
///
/// Times do not count: a copy may begin at another. Two recordings of one motion differ by their noise; where a row holds too little of it,
/// stretches of up to sixteen rows are compared. Rows in which nothing moves are left out. Two recordings of a simulation without noise are
/// the same rows. Time and memory grow with the rows of all logs together.
pub fn shared_rows(logs: &[&Log]) -> Vec<SharedRows> {
    let Some(first) = logs.first().filter(|_| logs.len() > 1) else { return Vec::new() };
    let names: Vec<&str> = first.joints().iter().map(|j| j.name.as_str()).collect();
    let named = |log: &Log, name: &str| log.joints().iter().position(|j| j.name == name);
    let common: Vec<&str> =
        names.into_iter().filter(|name| logs.iter().all(|log| named(log, name).is_some())).collect();
    if common.is_empty() {
        return Vec::new();
    }
    let joints: Vec<Vec<&JointSignals>> = logs
        .iter()
        .map(|log| common.iter().filter_map(|n| log.joints().iter().find(|j| j.name == **n)).collect())
        .collect();
    let coarsest = |signal: &dyn Fn(&JointSignals) -> f64, joint: usize| {
        joints.iter().map(|log| signal(log[joint])).fold(0.0, f64::max)
    };
    let grids: Vec<(f64, f64)> = (0..common.len())
        .map(|j| (coarsest(&|s| quantum(&s.position), j), coarsest(&|s| quantum(&s.effort), j)))
        .collect();
    let bits = |log: &Vec<&JointSignals>| -> f64 {
        log.iter()
            .zip(&grids)
            .map(|(s, (q, e))| noise_bits(&s.position, *q) + noise_bits(&s.effort, *e))
            .sum()
    };
    let least = joints.iter().map(bits).fold(f64::INFINITY, f64::min);
    let length = (BITS / least.max(1.0)).ceil().clamp(1.0, LONGEST as f64) as usize;

    let mut seen: HashMap<u64, usize> = HashMap::new();
    let mut moving = vec![0; logs.len()];
    let mut out = Vec::new();
    for (log, signals) in joints.iter().enumerate() {
        let stretches = stretches(signals, &grids, length);
        moving[log] = stretches.len();
        let mut with = vec![0; log];
        for key in &stretches {
            if let Some(other) = seen.get(key) {
                with[*other] += 1;
            }
        }
        let found = with.into_iter().enumerate().filter(|(_, rows)| *rows > 0);
        out.extend(found.map(|(other, rows)| SharedRows {
            log,
            other,
            rows,
            of: moving[log].min(moving[other]),
        }));
        stretches.into_iter().for_each(|key| {
            seen.entry(key).or_insert(log);
        });
    }
    out
}

/// Bits that white noise adds to a signal on a grid; none where the grid is as coarse as the noise.
fn noise_bits(signal: &[f64], grid: f64) -> f64 {
    let bend: Vec<f64> = signal.windows(3).map(|w| (w[2] - 2.0 * w[1] + w[0]).abs()).collect();
    // The second difference of white noise of sd s has sd sqrt(6) s; 1.4826 turns a median into an sd.
    let noise = 1.4826 / 6f64.sqrt() * median(&bend).unwrap_or(0.0);
    if grid > 0.0 && noise > 0.0 { (SPREAD * noise / grid).log2().max(0.0) } else { 0.0 }
}

/// Keys of all stretches of so many rows in which a joint moves.
fn stretches(joints: &[&JointSignals], grids: &[(f64, f64)], length: usize) -> Vec<u64> {
    let on = |x: f64, grid: f64| if grid > 0.0 { (x / grid).round() } else { x };
    let rows = joints.first().map_or(0, |j| j.position.len());
    let key = |row: usize| {
        let mut hasher = DefaultHasher::new();
        for (joint, (position, effort)) in joints.iter().zip(grids) {
            // Zero has two signs.
            (on(joint.position[row], *position) + 0.0).to_bits().hash(&mut hasher);
            let effort = joint.effort.get(row).map_or(0.0, |e| on(*e, *effort) + 0.0);
            effort.to_bits().hash(&mut hasher);
        }
        hasher.finish()
    };
    let moves = |row: usize| {
        row > 0
            && joints.iter().zip(grids).any(|(joint, (grid, _))| {
                on(joint.position[row], *grid) != on(joint.position[row - 1], *grid)
            })
    };
    let keys: Vec<u64> = (0..rows).map(key).collect();
    let moving: Vec<bool> = (0..rows).map(moves).collect();
    let stretch = |first: usize| {
        let range = first..first + length;
        moving[range.clone()].iter().any(|m| *m).then(|| {
            let mut hasher = DefaultHasher::new();
            keys[range].hash(&mut hasher);
            hasher.finish()
        })
    };
    (0..(rows + 1).saturating_sub(length)).filter_map(stretch).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A motion with noise of its own, rounded to so many decimals.
    fn recorded(seed: u64, rows: usize, decimals: i32) -> Log {
        let mut state = seed;
        let mut noise = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((state >> 33) as f64 / f64::from(1u32 << 31) - 0.5) * 0.4
        };
        let step = 10f64.powi(-decimals);
        let round = |x: f64| (x / step).round() * step;
        let time: Vec<f64> = (0..rows).map(|k| k as f64 * 0.004).collect();
        let position = time.iter().map(|t| round((3.0 * t).sin())).collect();
        let effort = time.iter().map(|t| round(5.0 * (3.0 * t).cos() + noise())).collect();
        let joint = JointSignals { name: "j".into(), position, velocity: None, effort };
        Log::new("log", time, vec![joint], Vec::new()).unwrap()
    }

    fn later(log: &Log, by: f64) -> Log {
        let time = log.time().iter().map(|t| t + by).collect();
        Log::new("later", time, log.joints().to_vec(), Vec::new()).unwrap()
    }

    #[test]
    fn a_copy_at_another_time_is_found_whole() {
        let log = recorded(1, 3000, 6);
        let found = shared_rows(&[&log, &later(&log, 100.0)]);
        assert_eq!(found.len(), 1);
        assert!(found[0].share() > 0.99, "{found:?}");
    }

    #[test]
    fn a_copy_with_fewer_decimals_is_found() {
        let log = recorded(1, 3000, 6);
        let mut rounded = log.joints().to_vec();
        let JointSignals { position, effort, .. } = &mut rounded[0];
        for x in position.iter_mut().chain(effort) {
            *x = (*x * 1e3).round() / 1e3;
        }
        let copy = Log::new("copy", log.time().to_vec(), rounded, Vec::new()).unwrap();
        let found = shared_rows(&[&log, &copy]);
        assert!(found[0].share() > 0.8, "{found:?}");
    }

    #[test]
    fn a_part_in_common_is_counted_against_the_shorter_log() {
        let log = recorded(1, 4000, 6);
        let part = log.slice(3000..4000).unwrap();
        let found = shared_rows(&[&log, &part]);
        assert!(found[0].share() > 0.98, "{found:?}");
        let (first, second) = (log.slice(0..2200).unwrap(), log.slice(1800..4000).unwrap());
        let share = shared_rows(&[&first, &second])[0].share();
        assert!((share - 400.0 / 2200.0).abs() < 0.02, "{share}");
    }

    #[test]
    fn two_recordings_of_one_motion_share_nothing() {
        for decimals in [2, 3, 6] {
            let (a, b) = (recorded(1, 5000, decimals), recorded(2, 5000, decimals));
            let shared: usize = shared_rows(&[&a, &b]).iter().map(|s| s.rows).sum();
            assert_eq!(shared, 0, "{decimals} decimals");
        }
    }
}
