//! Rows x and y: the clearance itself, with probes at the journals and from the torque alone.

use dynid::estimators::clearance::orbit::{self, OrbitEstimate, OrbitSample, OrbitSettings};
use dynid::estimators::clearance::swing::{self, SwingEstimate, SwingSettings};
use dynid::estimators::linear::ols;
use dynid::model::contact::SlidingFriction;
use dynid::model::{JournalPath, MotionBlock};
use dynid::report::{StudySection, Value};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use serde_json::json;

use super::data::{Data, Knowledge, factor, rms};
use super::knowable::{Knowable, NAMES, PARAMETERS, PROBE_NOISE, RATE_HZ, SLOW, Start, TORQUE_NOISE, fast};
use super::parameters::Parameters;
use super::pointing::Pointing;
use super::settings::Settings;
use super::tree::{RATES, translations, with_clearance};
use super::{JOINTS, fault};
use crate::page::{table, text};
use crate::{Row, RunSettings, StudyError};

/// By how much masses are overrated where a load is computed.
const MASS_ERROR: f64 = 1.05;
/// Quantile of normal deviates for 95 % of them.
const TWO_SIDED: f64 = 1.96;
/// Forces of the bearings on their journals in the journals' axes and what they carry, by a model whose joints have no
/// clearance: per joint and sample.
struct Loads {
    force: [Vec<[f64; 2]>; JOINTS],
    /// Force over mass carried, m/s².
    gravity: [Vec<f64>; JOINTS],
}

impl Loads {
    fn new(ideal: &Pointing, data: &Data) -> Result<Self, StudyError> {
        let tree = with_clearance()?;
        let n = data.samples;
        let centred = |of: &[Vec<f64>]| -> Vec<f64> {
            let rate =
                |rate: usize| of[data.first..].iter().map(move |s| if rate < JOINTS { s[rate] } else { 0.0 });
            (0..RATES).flat_map(rate).collect()
        };
        let [q, dq, ddq] = [&data.record.q, &data.record.dq, &data.record.ddq].map(|of| centred(of));
        let links = Parameters::of(ideal.mechanism())?;
        let effort = tree.efforts(&MotionBlock::plain(n, &q, &dq, &ddq), &tree.linear_of(&links));
        let masses: Vec<f64> = ideal.mechanism().bodies().iter().map(|b| b.inertia.mass()).collect();
        let force: [Vec<[f64; 2]>; JOINTS] = std::array::from_fn(|joint| {
            (0..n)
                .map(|s| {
                    let position = translations(joint).map(|rate| MASS_ERROR * effort[rate * n + s]);
                    let path = JournalPath { position, ..JournalPath::default() };
                    path.in_journal([q[joint * n + s], 0.0, 0.0]).position
                })
                .collect()
        });
        let gravity = std::array::from_fn(|joint| {
            let carried: f64 = masses[joint..].iter().sum::<f64>() * MASS_ERROR;
            force[joint].iter().map(|[x, y]| x.hypot(*y) / carried).collect()
        });
        Ok(Loads { force, gravity })
    }
}

/// What probes and torques give in one realisation of the noise.
#[derive(Debug)]
pub(super) struct Probed {
    pub(super) orbit: [OrbitEstimate; JOINTS],
}

/// The clearance from torques alone.
#[derive(Debug)]
pub(super) struct Unprobed {
    pub(super) swing: [SwingEstimate; JOINTS],
    /// Clearance by the law's penetration, m, with its deviation.
    pub(super) clearance: [[f64; 2]; JOINTS],
    /// Friction coefficient from Coulomb columns of an ideal model.
    pub(super) friction: [f64; JOINTS],
    /// Shortest offset whose swing the slow record could show, m.
    pub(super) slow_limit: f64,
}

/// Everything about the clearance itself.
#[derive(Debug)]
pub(super) struct Gaps {
    pub(super) probed: Vec<Probed>,
    /// With a law whose stiffness is 30 % off, once.
    pub(super) stiffer: Probed,
    pub(super) unprobed: Vec<Unprobed>,
    pub(super) knowable: Knowable,
    clearance: f64,
    friction: f64,
    /// Offsets of both journals, mean over the record, m.
    lengths: [f64; JOINTS],
}

/// Probes at the slow rate.
fn probe(
    settings: &Settings,
    data: &Data,
    loads: &Loads,
    random: &mut ChaCha8Rng,
) -> Result<Probed, StudyError> {
    let bearing = &settings.bearing;
    let sliding = SlidingFriction::new(bearing.friction, bearing.v_0, bearing.v_m).map_err(fault)?;
    let contacts = bearing.contacts()?;
    let orbit = (0..JOINTS)
        .map(|joint| {
            let offsets = data.counted(&data.record.journals[joint].offset);
            let samples: Vec<OrbitSample> = (0..data.samples)
                .step_by(SLOW)
                .map(|s| {
                    let mut noise = || -> f64 { StandardNormal.sample(random) };
                    let offset = offsets[s].map(|e| e + PROBE_NOISE * noise());
                    let speed = data.counted(&data.record.dq)[s][joint] * bearing.journal_radius;
                    OrbitSample {
                        offset,
                        load: loads.force[joint][s],
                        sliding: orbit::sliding_of(&sliding, speed),
                    }
                })
                .collect();
            orbit::estimate(&samples, &contacts[joint].law, &OrbitSettings::default()).map_err(fault)
        })
        .collect::<Result<Vec<_>, _>>()?;
    let orbit = orbit.try_into().map_err(|_| fault("one estimate per joint"))?;
    Ok(Probed { orbit })
}

/// Torques at the fast rate, without probes.
fn listen(
    settings: &Settings,
    data: &Data,
    loads: &Loads,
    random: &mut ChaCha8Rng,
) -> Result<Unprobed, StudyError> {
    let bearing = &settings.bearing;
    let n = data.samples;
    let mut torque = data.torque.clone();
    for joint in 0..JOINTS {
        let deviation = TORQUE_NOISE * rms(data.joint(&data.torque, joint).iter().copied());
        for value in &mut torque[joint * n..(joint + 1) * n] {
            let white: f64 = StandardNormal.sample(random);
            *value += deviation * white;
        }
    }
    let columns = data.base_columns(Knowledge::Coulomb);
    let fitted = ols(&factor(&columns, &torque)?);
    let mut residual = torque;
    for (column, x) in columns.iter().zip(&fitted.x) {
        residual.iter_mut().zip(column).for_each(|(r, w)| *r -= x * w);
    }
    let contacts = bearing.contacts()?;
    let settings = SwingSettings { friction: bearing.friction, ..SwingSettings::default() };
    let mut slow_limit = 0.0_f64;
    let (mut swings, mut clearance, mut friction) = (Vec::new(), [[0.0; 2]; JOINTS], [0.0; JOINTS]);
    for joint in 0..JOINTS {
        let own = &residual[joint * n..(joint + 1) * n];
        let gravity = &loads.gravity[joint];
        let found = swing::estimate(own, gravity, 1.0 / RATE_HZ, &settings).map_err(fault)?;
        let every = |x: &[f64]| x.iter().step_by(SLOW).copied().collect::<Vec<f64>>();
        let slow = swing::estimate(&every(own), &every(gravity), SLOW as f64 / RATE_HZ, &settings);
        slow_limit = slow_limit.max(slow.map_or(f64::INFINITY, |s| s.shortest));
        let load = loads.force[joint].iter().map(|[x, y]| x.hypot(*y)).sum::<f64>() / n as f64;
        let prior = OrbitSettings::default().stiffness_prior;
        let own =
            orbit::clearance_of_length(&contacts[joint].law, found.length, load, prior).map_err(fault)?;
        clearance[joint] = [own.value, own.std];
        let base = columns.len() - JOINTS + joint;
        let tangent = fitted.x[base] / (bearing.journal_radius * load);
        // M = μ R2 |F|/√(1 + μ²).
        friction[joint] = tangent / (1.0 - tangent * tangent).sqrt();
        swings.push(found);
    }
    let swing = swings.try_into().map_err(|_| fault("one swing per joint"))?;
    Ok(Unprobed { swing, clearance, friction, slow_limit })
}

impl Gaps {
    pub(super) fn new(ideal: &Pointing, settings: &Settings, run: &RunSettings) -> Result<Self, StudyError> {
        let (unit, centred) = ([[1.0; PARAMETERS]; JOINTS], Start::default());
        let record = fast(settings, &unit, &centred)?;
        let data = Data::of(ideal, record, settings.data.discarded)?;
        let loads = Loads::new(ideal, &data)?;
        let seed = |k: usize| ChaCha8Rng::seed_from_u64(run.seed.wrapping_add(1_000_003 * (k as u64 + 1)));
        let realisations = if run.quick { 8 } else { 40 };
        let probed = (0..realisations)
            .into_par_iter()
            .map(|k| probe(settings, &data, &loads, &mut seed(k)))
            .collect::<Result<_, _>>()?;
        let unprobed = (0..realisations)
            .into_par_iter()
            .map(|k| listen(settings, &data, &loads, &mut seed(k)))
            .collect::<Result<_, _>>()?;
        let mut stiff = unit;
        // Friction counts on the force of the law, which is not the stiffer one.
        stiff.iter_mut().for_each(|factors| (factors[1], factors[3]) = (1.3, 1.3));
        let stiff = Data::of(ideal, fast(settings, &stiff, &centred)?, settings.data.discarded)?;
        let stiffer = probe(settings, &stiff, &loads, &mut seed(0))?;
        let lengths = std::array::from_fn(|joint| {
            let offsets = data.counted(&data.record.journals[joint].offset);
            offsets.iter().map(|[x, y]| x.hypot(*y)).sum::<f64>() / offsets.len() as f64
        });
        Ok(Gaps {
            probed,
            stiffer,
            unprobed,
            knowable: Knowable::new(ideal, settings)?,
            clearance: settings.bearing.clearance,
            friction: settings.bearing.friction,
            lengths,
        })
    }

    pub(super) fn rows(&self) -> [Row; 3] {
        [self.probed_row(), self.unprobed_row(), self.knowable.row()]
    }

    /// Row x.
    fn probed_row(&self) -> Row {
        let all = || self.probed.iter().flat_map(|p| &p.orbit);
        let off = |found: f64, truth: f64| (found / truth - 1.0).abs();
        let gap = all().map(|o| off(o.clearance.value, self.clearance)).fold(0.0, f64::max);
        let friction = all().map(|o| off(o.friction.value, self.friction)).fold(0.0, f64::max);
        let stiffer_friction =
            self.stiffer.orbit.iter().map(|o| off(o.friction.value, self.friction)).fold(0.0, f64::max);
        let stiffer =
            self.stiffer.orbit.iter().map(|o| off(o.clearance.value, self.clearance)).fold(0.0, f64::max);
        let inside =
            |o: &&OrbitEstimate| (o.friction.value - self.friction).abs() <= TWO_SIDED * o.friction.std;
        let covered = all().filter(inside).count();
        let count = all().count();
        let seen = all().map(|o| o.stiffness_seen).fold(0.0, f64::max);
        let first = &self.probed[0].orbit;
        Row::new(
            "x",
            "With probes at the journals (1 µm of noise, 100 Hz), masses overrated by 5 % and a stiffness known to 30 %: clearance and \
             friction coefficient of both joints; the motion says nothing of the stiffness, since the load does not change",
            "both within 5 % in every realisation, also where the contact is 30 % stiffer than its law",
            json!({
                "clearance": gap, "friction": friction, "clearance_of_stiffer_contact": stiffer,
                "friction_of_stiffer_contact": stiffer_friction, "realisations": self.probed.len(),
                "friction_intervals_that_cover": covered, "of": count, "share_of_stiffness_seen": seen,
                "first": first.iter().map(|o| json!({
                    "clearance": [o.clearance.value, o.clearance.std], "friction": [o.friction.value, o.friction.std],
                    "length": [o.length.value, o.length.std], "correlation": o.correlation })).collect::<Vec<_>>(),
            }),
            format!(
                "clearance within {:.2} %, friction within {:.2} % in {} realisations ({covered} of {count} intervals of friction cover); \
                 {:.2} and {:.2} % with the stiffer contact; first realisation {:.2} ± {:.2} and {:.2} ± {:.2} µm, of which the length of the offset is known to \
                 {:.3} and {:.3} µm; stiffness: {:.1} % of its prior variance removed",
                100.0 * gap,
                100.0 * friction,
                self.probed.len(),
                100.0 * stiffer,
                100.0 * stiffer_friction,
                1e6 * first[0].clearance.value,
                1e6 * first[0].clearance.std,
                1e6 * first[1].clearance.value,
                1e6 * first[1].clearance.std,
                1e6 * first[0].length.std,
                1e6 * first[1].length.std,
                100.0 * seen,
            ),
            gap.max(friction).max(stiffer).max(stiffer_friction) <= 0.05,
        )
    }

    /// Row y.
    fn unprobed_row(&self) -> Row {
        let worst = |of: &dyn Fn(&Unprobed, usize) -> f64| -> [f64; JOINTS] {
            std::array::from_fn(|joint| self.unprobed.iter().map(|u| of(u, joint)).fold(0.0, f64::max))
        };
        let length = worst(&|u, k| (u.swing[k].length.value / self.lengths[k] - 1.0).abs());
        let gap = worst(&|u, k| (u.clearance[k][0] / self.clearance - 1.0).abs());
        let friction = worst(&|u, k| (u.friction[k] / self.friction - 1.0).abs());
        let found = self.unprobed.iter().flat_map(|u| &u.swing).filter(|s| s.found).count();
        let limit = self.unprobed.iter().map(|u| u.slow_limit).fold(f64::INFINITY, f64::min);
        let first = &self.unprobed[0];
        let largest = |of: [f64; JOINTS]| of.into_iter().fold(0.0, f64::max);
        Row::new(
            "y",
            "Without probes, torques with 1 % of noise: sampled at 1 kHz, the swing of the journals in their clearance shows in the residual \
             of a model without clearance, and its frequency gives the offset and so the clearance; at 100 Hz it cannot be seen. \
             Coulomb friction of that model over the load gives the friction coefficient",
            "swing found and clearance within 5 % in every realisation at 1 kHz; told that 100 Hz are too slow",
            json!({
                "length": length, "clearance": gap, "friction": friction, "found": found, "of": JOINTS * self.unprobed.len(),
                "shortest_at_100_hz": limit,
                "swing_hz": first.swing.each_ref().map(|s| s.frequency_hz),
                "amplitude": first.swing.each_ref().map(|s| s.amplitude),
                "first": first.clearance, "friction_first": first.friction,
            }),
            format!(
                "{found} of {} swings found ({:.2} and {:.2} Hz, {:.2e} and {:.2e} N m rms); offset within {:.2} and {:.2} %, clearance within {:.2} \
                 and {:.2} %, friction within {:.1} and {:.1} % (masses overrated by 5 %); at 100 Hz only offsets beyond {:.0} µm would show",
                JOINTS * self.unprobed.len(),
                first.swing[0].frequency_hz,
                first.swing[1].frequency_hz,
                first.swing[0].amplitude,
                first.swing[1].amplitude,
                100.0 * length[0],
                100.0 * length[1],
                100.0 * gap[0],
                100.0 * gap[1],
                100.0 * friction[0],
                100.0 * friction[1],
                1e6 * limit,
            ),
            found == JOINTS * self.unprobed.len() && largest(gap) <= 0.05 && limit > 1.5 * self.clearance,
        )
    }

    /// The report's section.
    pub(super) fn section(&self) -> StudySection {
        let micro = |[value, std]: [f64; 2]| Value::from(format!("{:.2} ± {:.2}", 1e6 * value, 1e6 * std));
        let (probed, stiffer) = (&self.probed[0].orbit, &self.stiffer.orbit);
        let orbit = |name: &str, of: &[OrbitEstimate; JOINTS]| {
            let mut cells = vec![text(name)];
            for found in of {
                cells.push(micro([found.clearance.value, found.clearance.std]));
                cells.push(micro([found.length.value, found.length.std]));
                cells.push(text(format!("{:.4} ± {:.4}", found.friction.value, found.friction.std)));
            }
            cells
        };
        let first = &self.unprobed[0];
        let mut swing = vec![text("torque at 1 kHz alone")];
        for joint in 0..JOINTS {
            let length = first.swing[joint].length;
            swing.push(micro(first.clearance[joint]));
            swing.push(micro([length.value, length.std]));
            swing.push(text(format!("{:.4}", first.friction[joint])));
        }
        let truth = (0..JOINTS).flat_map(|joint| {
            [1e6 * self.clearance, 1e6 * self.lengths[joint]]
                .map(|x| text(format!("{x:.2}")))
                .into_iter()
                .chain([text(format!("{:.4}", self.friction))])
        });
        let truth = std::iter::once(text("truth")).chain(truth).collect();
        let cases = ["probes and torque at 100 Hz", "torque at 100 Hz", "torque at 1 kHz"];
        let bounds = cases.iter().zip(&self.knowable.bounds).map(|(name, bounds)| {
            let percent = |p: usize| text(format!("{:.3} %", 100.0 * bounds[0][p].max(bounds[1][p])));
            std::iter::once(text(*name)).chain((0..PARAMETERS).map(percent)).collect()
        });
        StudySection {
            title: "The clearance itself".into(),
            text: vec![
                "A journal sits where load and contact balance: the angle between offset and load is that of friction, the length of the \
                 offset is clearance and penetration. The load hardly changes, so how the length is shared depends on a stiffness that \
                 only the law knows (to 30 %). In a clearance a journal is a pendulum as long as its offset: torques sampled fast enough \
                 tell that length by a frequency, without any probe, as long as something sets it swinging."
                    .into(),
                "How exact a fit of the whole simulation could be is another matter: it would take the swing's phase over a thousand \
                 periods at its word, which no real bearing keeps."
                    .into(),
            ],
            tables: vec![
                table(
                    "First realisation: clearance and offset in µm, friction coefficient (loads from masses 5 % too high)",
                    &["", "clearance 1", "offset 1", "friction 1", "clearance 2", "offset 2", "friction 2"],
                    vec![
                        truth,
                        orbit("probes at 100 Hz", probed),
                        orbit("the same, contact 30 % stiffer", stiffer),
                        swing,
                    ],
                ),
                table(
                    "Cramér-Rao bounds, the worse of both joints, link parameters and start unknown",
                    &["", NAMES[0], NAMES[1], NAMES[2], NAMES[3]],
                    bounds.collect(),
                ),
            ],
            ..StudySection::default()
        }
    }
}
