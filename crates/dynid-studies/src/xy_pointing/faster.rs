//! Row g: trajectories that show inertias.

use dynid::excitation::criterion::{Criterion, Measure};
use serde_json::json;

use super::data::{Data, Knowledge, rms};
use super::excitation::{Designed, Designs, designed};
use super::fit::Fitted;
use super::noise::MASS_SHARE;
use super::parameters::{BASE, MASS_2, Parameters};
use super::pointing::Pointing;
use super::settings::Settings;
use super::simulation::recorded;
use crate::{Row, RunSettings, StudyError};

/// Inertias that Table 1 hardly shows: π1, π2, π6.
const HIDDEN: [usize; 3] = [0, 1, 5];

/// A trajectory with what it shows.
#[derive(Debug)]
pub(super) struct Shown {
    pub(super) name: String,
    pub(super) acceleration: f64,
    /// Half widths of intervals at the data's noise, clearance model.
    pub(super) half: [f64; BASE],
    /// Errors of the ideal model and of the one with Coulomb friction, without noise.
    pub(super) ideal: [f64; BASE],
    pub(super) coulomb: [f64; BASE],
    /// What the journals' offsets add to the torque of joint 1, N m rms.
    pub(super) ringing: f64,
}

/// Table 1, the best by raw condition, and the best at a higher frequency.
#[derive(Debug)]
pub(super) struct Excitations {
    pub(super) truth: [f64; BASE],
    pub(super) shown: Vec<Shown>,
}

impl Excitations {
    pub(super) fn new(
        pointing: &Pointing,
        settings: &Settings,
        designs: &Designs,
        run: &RunSettings,
    ) -> Result<Self, StudyError> {
        let system = Parameters::of(pointing.mechanism())?;
        let truth = system.base(pointing.length());
        let slow = settings.base_frequency;
        let fast = settings.faster_frequency;
        let raw = Criterion::raw(Measure::Condition);
        let faster = designed(pointing, settings, run, fast, raw)?;
        let rows = |designed: &Option<Designed>| designed.as_ref().map(|d| d.rows.clone());
        let candidates = [
            ("Table 1".to_owned(), slow, Some(settings.trajectory.clone())),
            (format!("ours at {slow} rad/s"), slow, rows(&designs.raw)),
            (format!("ours at {fast} rad/s"), fast, rows(&faster)),
        ];
        let mut shown = Vec::new();
        for (name, base, rows) in candidates {
            let Some(rows) = rows else { continue };
            let record = recorded(settings, &settings.bearing, &rows, base)?;
            let data = Data::of(pointing, record, settings.data.discarded)?;
            let noisy = data.noisy(settings.data.torque_noise, run.seed)?;
            let mass = system.0[MASS_2];
            let fit = Fitted::new(&data, &noisy, Knowledge::Clearance, Some([mass, MASS_SHARE * mass]))?;
            let errors = |knowledge| Ok(Fitted::new(&data, &data.torque, knowledge, None)?.errors(&truth));
            let of = |knowledge| -> Result<_, StudyError> { errors(knowledge) };
            shown.push(Shown {
                name,
                acceleration: data
                    .counted(&data.record.ddq)
                    .iter()
                    .map(|a| a[0].abs().max(a[1].abs()))
                    .fold(0.0, f64::max),
                half: std::array::from_fn(|k| fit.half[k]),
                ideal: of(Knowledge::Ideal)?,
                coulomb: of(Knowledge::Coulomb)?,
                ringing: rms(data.ringing(0)),
            });
        }
        Ok(Excitations { truth, shown })
    }

    pub(super) fn row(&self) -> Row {
        let percent = |s: &Shown, k: usize| 100.0 * s.half[k] / self.truth[k].abs();
        let told = |s: &Shown| {
            format!(
                "{} π1 {:.2} %, π2 {:.0} %, π6 {:.1} %, π8 {:.3} %, ideal model off by {:.0} % in π1",
                s.name,
                percent(s, 0),
                percent(s, 1),
                percent(s, 5),
                percent(s, 7),
                100.0 * (s.ideal[0] / self.truth[0]).abs()
            )
        };
        let gain = |s: &Shown| {
            let of = |k: &usize| self.shown[0].half[*k] / s.half[*k];
            HIDDEN.iter().map(of).fold(f64::INFINITY, f64::min)
        };
        let gains: Vec<f64> = self.shown.iter().skip(1).map(gain).collect();
        Row::new(
            "g",
            "Trajectories designed for condition, within the same limits and as long as Table 1, show the inertias π1, π2 and π6 better, \
             which it hides; of the first moments π7 and π8 they show less: half widths of 95 % intervals at 1e-3 N m of noise",
            "intervals of π1, π2 and π6 narrower than on Table 1",
            json!({
                "truth": self.truth,
                "trajectories": self.shown.iter().map(|s| json!({
                    "name": s.name, "largest_acceleration": s.acceleration, "half_widths": s.half,
                    "errors_ideal": s.ideal, "errors_coulomb": s.coulomb, "ringing_rms": s.ringing,
                })).collect::<Vec<_>>(),
                "gain": gains,
            }),
            format!(
                "{}; narrower at least by {}",
                self.shown.iter().map(told).collect::<Vec<_>>().join("; "),
                gains.iter().map(|g| format!("{g:.2}")).collect::<Vec<_>>().join(" and ")
            ),
            gains.len() == 2 && gains.iter().all(|g| *g > 1.0),
        )
    }
}
