//! Rows h and i: other clearances, other surfaces, other laws of contact.

use dynid::sim::clearance::ContactEventKind;
use rayon::prelude::*;
use serde_json::json;

use super::JOINTS;
use super::bearing::Bearing;
use super::data::{Data, Knowledge, rms};
use super::fit::Fitted;
use super::parameters::{BASE, Parameters};
use super::pointing::Pointing;
use super::settings::Settings;
use super::simulation::published;
use crate::{Row, RunSettings, StudyError};

/// Clearances, m.
const CLEARANCES: [f64; 5] = [1e-5, 2e-5, 5e-5, 1e-4, 2e-4];
/// Roughness, µm.
const ROUGHNESS: [f64; 6] = [0.1, 0.2, 0.4, 0.8, 1.6, 3.2];

/// What identification makes of another bearing.
#[derive(Debug, Clone)]
pub(super) struct Variant {
    pub(super) name: String,
    pub(super) bearing: Bearing,
    /// Largest penetration of both journals, m.
    pub(super) penetration: [f64; JOINTS],
    pub(super) onsets: usize,
    pub(super) swing_hz: f64,
    /// What offsets of the journals add to the torques, N m rms.
    pub(super) ringing: [f64; JOINTS],
    /// Relative errors of π7 and π8: ideal joints, with Coulomb friction, with clearance.
    pub(super) ideal: [f64; 2],
    pub(super) coulomb: [f64; 2],
    pub(super) exact: [f64; 2],
    /// Residual with Coulomb friction, N m rms.
    pub(super) residual: f64,
}

fn variant(
    pointing: &Pointing,
    settings: &Settings,
    truth: &[f64; BASE],
    name: String,
    bearing: Bearing,
) -> Result<Variant, StudyError> {
    let data = Data::of(pointing, published(settings, &bearing)?, settings.data.discarded)?;
    let fit = |knowledge| Fitted::new(&data, &data.torque, knowledge, None);
    let errors = |fit: &Fitted| [6, 7].map(|k| fit.x[k] / truth[k] - 1.0);
    let (ideal, coulomb, exact) =
        (fit(Knowledge::Ideal)?, fit(Knowledge::Coulomb)?, fit(Knowledge::Clearance)?);
    let record = &data.record;
    Ok(Variant {
        name,
        bearing,
        penetration: std::array::from_fn(|j| record.journals[j].largest_penetration),
        onsets: record.events.iter().filter(|e| matches!(e.kind, ContactEventKind::Onset(_))).count(),
        swing_hz: record.swing_hz,
        ringing: std::array::from_fn(|j| rms(data.ringing(j))),
        ideal: errors(&ideal),
        coulomb: errors(&coulomb),
        exact: errors(&exact),
        residual: coulomb.residual_rms(),
    })
}

/// The mechanism with other bearings.
#[derive(Debug)]
pub(super) struct Sweeps {
    pub(super) clearance: Vec<Variant>,
    pub(super) roughness: Vec<Variant>,
    /// The law as published, exponent 1, and the unmodified law of smooth bodies.
    pub(super) laws: Vec<Variant>,
    gravity: f64,
}

impl Sweeps {
    pub(super) fn new(
        pointing: &Pointing,
        settings: &Settings,
        run: &RunSettings,
    ) -> Result<Self, StudyError> {
        let truth = Parameters::of(pointing.mechanism())?.base(pointing.length());
        let own = settings.bearing;
        let roughness = if run.quick { &ROUGHNESS[2..5] } else { &ROUGHNESS };
        let clearances =
            CLEARANCES.iter().map(|c| (format!("{:.0} µm", 1e6 * c), Bearing { clearance: *c, ..own }));
        let rough =
            roughness.iter().map(|ra| (format!("Ra = {ra} µm"), Bearing { roughness_um: *ra, ..own }));
        let laws = [
            ("rough, n = 1.5", own),
            ("rough, n = 1", Bearing { force_index: 1.0, ..own }),
            ("smooth, unmodified", Bearing { smooth: true, ..own }),
        ]
        .map(|(name, bearing)| (name.to_owned(), bearing));
        let all: Vec<(String, Bearing)> = clearances.chain(rough).chain(laws).collect();
        let mut found: Vec<Variant> = all
            .into_par_iter()
            .map(|(name, bearing)| variant(pointing, settings, &truth, name, bearing))
            .collect::<Result<_, _>>()?;
        let laws = found.split_off(CLEARANCES.len() + roughness.len());
        let roughness = found.split_off(CLEARANCES.len());
        Ok(Sweeps { clearance: found, roughness, laws, gravity: pointing.mechanism().gravity().norm() })
    }

    /// Swing of a pendulum as long as the clearance, Hz.
    pub(super) fn pendulum(&self, variant: &Variant) -> f64 {
        (self.gravity / variant.bearing.clearance).sqrt() / std::f64::consts::TAU
    }

    fn told(variant: &Variant) -> String {
        let [a, b] = variant.ideal.map(|e| 100.0 * e);
        format!("{}: {a:.2} and {b:.2} %", variant.name)
    }

    fn numbers(variant: &Variant) -> serde_json::Value {
        json!({
            "name": variant.name,
            "penetration": variant.penetration,
            "onsets": variant.onsets,
            "swing_hz": variant.swing_hz,
            "ringing_rms": variant.ringing,
            "ideal": variant.ideal,
            "coulomb": variant.coulomb,
            "clearance_model": variant.exact,
            "coulomb_residual_rms": variant.residual,
        })
    }

    /// Rows h and i.
    pub(super) fn rows(&self) -> [Row; 2] {
        let published = &self.laws[0];
        let apart =
            |v: &Variant| (0..2).map(|k| (v.ideal[k] / published.ideal[k] - 1.0).abs()).fold(0.0, f64::max);
        let swept = || self.clearance.iter().chain(&self.roughness);
        let exact = swept().chain(&self.laws).flat_map(|v| v.exact).map(f64::abs).fold(0.0, f64::max);
        let furthest = swept().map(apart).fold(0.0, f64::max);
        let swing =
            self.clearance.iter().map(|v| (v.swing_hz / self.pendulum(v) - 1.0).abs()).fold(0.0, f64::max);
        let sizes = Row::new(
            "h",
            "Friction, not the size of the clearance nor the roughness, biases the ideal model; journals swing as pendulums as long as \
             the clearance; the clearance model stays exact",
            "relative errors of π7 and π8 with ideal joints within 10 % of the published bearing's from 10 to 200 µm and for every \
             roughness; swing within 10 % of √(g/c); clearance model 1e-6",
            json!({
                "clearance": self.clearance.iter().map(Self::numbers).collect::<Vec<_>>(),
                "roughness": self.roughness.iter().map(Self::numbers).collect::<Vec<_>>(),
                "furthest": furthest, "swing": swing, "exact": exact,
            }),
            format!(
                "errors at {}; within {:.1} %; swing {:.0} to {:.0} Hz, within {:.1} %; clearance model {exact:.0e}",
                self.clearance.iter().map(Self::told).collect::<Vec<_>>().join(", "),
                100.0 * furthest,
                self.clearance.last().map_or(f64::NAN, |v| v.swing_hz),
                self.clearance.first().map_or(f64::NAN, |v| v.swing_hz),
                100.0 * swing,
            ),
            furthest <= 0.1 && swing <= 0.1 && exact <= 1e-6,
        );
        let stiff = &self.laws[1];
        let between = self.laws.iter().map(apart).fold(0.0, f64::max);
        let laws = Row::new(
            "i",
            "The law of contact hardly matters for what is identified: exponent 1 in place of 1.5 makes contact a hundred times stiffer \
             and lets journals bounce, the law of smooth bodies is another again",
            "relative errors of π7 and π8 with ideal joints within 10 % of each other; exponent 1: 8 onsets of contact",
            json!({ "laws": self.laws.iter().map(Self::numbers).collect::<Vec<_>>(), "furthest": between }),
            self.laws
                .iter()
                .map(|v| {
                    format!(
                        "{}, {} onsets, {:.3} µm, residual {:.4} N m",
                        Self::told(v),
                        v.onsets,
                        1e6 * v.penetration[0],
                        v.residual
                    )
                })
                .collect::<Vec<_>>()
                .join("; "),
            between <= 0.1 && stiff.onsets == 8,
        );
        [sizes, laws]
    }
}
