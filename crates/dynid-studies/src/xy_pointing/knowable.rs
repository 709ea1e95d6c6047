//! Row z: what can be known of the contacts at all.

use dynid::estimators::linear::ols;
use dynid::sim::clearance::{ClearanceRecord, ClearanceSettings, ClearanceStart, Driving, Method, simulate};
use rayon::prelude::*;
use serde_json::json;

use super::bearing::Bearing;
use super::data::{Data, Knowledge, factor, rms};
use super::pointing::Pointing;
use super::settings::Settings;
use super::trajectory::trajectory;
use super::{JOINTS, fault};
use crate::{Row, StudyError};

/// Parameters of a contact, relative: clearance, stiffness, damping, friction.
pub(super) const PARAMETERS: usize = 4;
/// Names of the parameters.
pub(super) const NAMES: [&str; PARAMETERS] = ["clearance", "stiffness", "damping", "friction"];
/// Changes by which their effects are found.
const CHANGES: [f64; PARAMETERS] = [2e-4, 1e-3, 1e-2, 1e-3];

/// Where the journals start, four numbers each: offset (m) and rate (m/s).
pub(super) type Start = [[f64; 4]; JOINTS];
/// Changes by which the effect of that is found.
const START_CHANGES: [f64; 4] = [1e-8, 1e-8, 1e-6, 1e-6];

/// The published motion at the fast rate with factors of every contact's parameters.
pub(super) fn fast(
    settings: &Settings,
    factors: &[[f64; PARAMETERS]; JOINTS],
    from: &Start,
) -> Result<ClearanceRecord, StudyError> {
    let trajectory = trajectory(settings.base_frequency, &settings.trajectory)?;
    let plants = factors.iter().map(|[clearance, ..]| {
        let bearing = Bearing { clearance: clearance * settings.bearing.clearance, ..settings.bearing };
        bearing.contacts()
    });
    let contacts: Vec<_> = plants.collect::<Result<_, _>>()?;
    // Joint `k` takes its contact from the bearings with its clearance.
    let own = contacts.into_iter().enumerate().filter_map(|(k, all)| all.into_iter().nth(k)).collect();
    let plant = Bearing::plant_of(own)?;
    let mut linear = plant.linear().to_vec();
    let first = linear.len() - 3 * JOINTS;
    for (values, [_, stiffness, damping, friction]) in linear[first..].chunks_exact_mut(3).zip(factors) {
        for (value, factor) in values.iter_mut().zip([stiffness, damping, friction]) {
            *value *= factor;
        }
    }
    let plant = plant.with_linear(linear).map_err(fault)?;
    let series = trajectory.series();
    let motion = |t: f64, q: &mut [f64], dq: &mut [f64], ddq: &mut [f64]| {
        for (joint, series) in series.iter().enumerate() {
            let at = series.at(t);
            (q[joint], dq[joint], ddq[joint]) = (at.position, at.velocity, at.acceleration);
        }
    };
    let count = (trajectory.period() * RATE_HZ).floor() as usize;
    let times: Vec<f64> = (0..=count).map(|k| k as f64 / RATE_HZ).collect();
    let settings = ClearanceSettings { method: Method::default(), channels: Vec::new() };
    let journals = from.iter().map(|[x, y, vx, vy]| ([*x, *y], [*vx, *vy])).collect();
    let start = ClearanceStart { journals, driven: None };
    simulate(plant, &start, Driving::Prescribed(&motion), &times, &settings).map_err(fault)
}

/// Least deviations of the parameters of both contacts that any unbiased estimator could reach, relative: with probes and
/// torque at the slow rate, with torque at the slow and at the fast rate.
#[derive(Debug)]
pub(super) struct Knowable {
    pub(super) bounds: [[[f64; PARAMETERS]; JOINTS]; 3],
}

impl Knowable {
    pub(super) fn new(ideal: &Pointing, settings: &Settings) -> Result<Self, StudyError> {
        let (unit, centred) = ([[1.0; PARAMETERS]; JOINTS], Start::default());
        // Pairs of runs, with what their difference is divided by.
        let mut wanted = Vec::new();
        for joint in 0..JOINTS {
            for (parameter, change) in CHANGES.into_iter().enumerate() {
                for change in [change, -change] {
                    let mut factors = unit;
                    factors[joint][parameter] += change;
                    wanted.push((factors, centred, change));
                }
            }
        }
        for joint in 0..JOINTS {
            for (place, change) in START_CHANGES.into_iter().enumerate() {
                for change in [change, -change] {
                    let mut start = centred;
                    start[joint][place] += change;
                    wanted.push((unit, start, change));
                }
            }
        }
        let records: Vec<ClearanceRecord> = wanted
            .par_iter()
            .map(|(factors, start, _)| fast(settings, factors, start))
            .collect::<Result<_, _>>()?;
        let data = Data::of(ideal, fast(settings, &unit, &centred)?, settings.data.discarded)?;
        let n = data.samples;
        let deviations: [f64; JOINTS] =
            std::array::from_fn(|joint| TORQUE_NOISE * rms(data.joint(&data.torque, joint).iter().copied()));
        // Link parameters are not known either, nor where the journals start.
        let nuisance = data.base_columns(Knowledge::Ideal);
        let mut bounds = [[[0.0; PARAMETERS]; JOINTS]; 3];
        for (case, (step, probes)) in [(SLOW, true), (SLOW, false), (1, false)].into_iter().enumerate() {
            let rows: Vec<usize> = (0..n).step_by(step).collect();
            let mut columns: Vec<Vec<f64>> = Vec::new();
            for (k, pair) in records.chunks_exact(2).enumerate() {
                let change = 2.0 * wanted[2 * k].2;
                let mut column = Vec::new();
                for (joint, deviation) in deviations.iter().enumerate() {
                    let of = |r: &ClearanceRecord, s: usize| r.effort[data.first + s][joint];
                    let slope = |s: &usize| (of(&pair[0], *s) - of(&pair[1], *s)) / change / deviation;
                    column.extend(rows.iter().map(slope));
                }
                for joint in (0..JOINTS).filter(|_| probes) {
                    for axis in 0..2 {
                        let of =
                            |r: &ClearanceRecord, s: usize| r.journals[joint].offset[data.first + s][axis];
                        column.extend(
                            rows.iter().map(|s| (of(&pair[0], *s) - of(&pair[1], *s)) / change / PROBE_NOISE),
                        );
                    }
                }
                columns.push(column);
            }
            let length = columns[0].len();
            for column in &nuisance {
                let mut own: Vec<f64> = (0..JOINTS)
                    .flat_map(|joint| rows.iter().map(move |s| column[joint * n + s] / deviations[joint]))
                    .collect();
                own.resize(length, 0.0);
                columns.push(own);
            }
            let solution = ols(&factor(&columns, &vec![0.0; length])?);
            let found = solution.standard_deviations(1.0);
            for joint in 0..JOINTS {
                for parameter in 0..PARAMETERS {
                    bounds[case][joint][parameter] =
                        found[joint * PARAMETERS + parameter].unwrap_or(f64::INFINITY);
                }
            }
        }
        Ok(Knowable { bounds })
    }

    /// Row z.
    pub(super) fn row(&self) -> Row {
        let [probes, slow, fast] = &self.bounds;
        let of = |bounds: &[[f64; PARAMETERS]; JOINTS], p: usize| bounds[0][p].max(bounds[1][p]);
        // Gap and friction can be known, and the fast torque tells of the gap what probes do.
        let pass = [0, 3].iter().all(|p| of(probes, *p) < 0.05) && of(fast, 0) < 0.05;
        let words = |bounds: &[[f64; PARAMETERS]; JOINTS]| {
            let parts: Vec<String> = NAMES
                .iter()
                .enumerate()
                .map(|(p, name)| format!("{name} {:.2} %", 100.0 * of(bounds, p)))
                .collect();
            parts.join(", ")
        };
        Row::new(
            "z",
            "What any unbiased estimator could know of clearance, stiffness, damping and friction from this motion if the simulation \
             were the truth, link parameters and the journals' start unknown (Cramér-Rao, relative): with probes at 100 Hz, torque \
             at 100 Hz, torque at 1 kHz",
            "clearance and friction below 5 % with probes, clearance also with torque at 1 kHz",
            json!({ "parameters": NAMES, "probes_100_hz": probes, "torque_100_hz": slow, "torque_1_khz": fast }),
            format!(
                "the worse joint, with probes: {}; torque at 100 Hz: {}; torque at 1 kHz: {}",
                words(probes),
                words(slow),
                words(fast)
            ),
            pass,
        )
    }
}

/// Rate of the fast record, Hz; every tenth of its samples makes the slow one.
pub(super) const RATE_HZ: f64 = 1000.0;

pub(super) const SLOW: usize = 10;

/// Noise of the probes, m, and of the torque, share of its rms.
pub(super) const PROBE_NOISE: f64 = 1e-6;

pub(super) const TORQUE_NOISE: f64 = 0.01;
