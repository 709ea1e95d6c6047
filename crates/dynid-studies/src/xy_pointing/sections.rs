//! Sections of the report on simulation, identification and what goes beyond the paper.

use dynid::report::{StudySection, StudyTable, Value};

use super::data::Knowledge;
use super::faster::Excitations;
use super::fit::{Fits, SYMBOLS};
use super::noise::{LEVELS, NoiseStudy};
use super::parameters::{NAMES, PARAMETERS};
use super::plots;
use super::report::Contents;
use super::search::{Contestant, Searches};
use super::simulation::{Closeup, TOLERANCE};
use super::sweep::{Sweeps, Variant};
use crate::StudyError;
use crate::page::{table, text};
use crate::statistics::median;

/// From when to when close-ups go, s: the landing, and the swing later on.
const LANDING: [f64; 2] = [0.0, 0.012];
const SWING: [f64; 2] = [1.0, 1.15];

fn exponential(x: f64) -> Value {
    text(format!("{x:.2e}"))
}

impl Contents<'_> {
    pub(super) fn simulation_section(&self) -> Result<StudySection, StudyError> {
        let (landing, swing) = (Closeup::new(self.settings, LANDING)?, Closeup::new(self.settings, SWING)?);
        let clearance = self.settings.bearing.clearance;
        Ok(StudySection {
            title: "Clearance, simulated".into(),
            text: vec![format!(
                "Angles are prescribed, the journals move freely in clearances of {:.0} µm. They start in the centre, fall, land within \
                 some milliseconds and stay in contact; from then on they swing in their bearings at up to {:.0} Hz, and friction at \
                 constant sliding does not damp that.",
                1e6 * clearance,
                self.data.record.swing_hz
            )],
            charts: plots::journals(self.data, &landing, &swing, clearance),
            tables: vec![self.solution_table()],
            ..StudySection::default()
        })
    }

    fn solution_table(&self) -> StudyTable {
        let solutions = self.solutions;
        let (evaluations, error) = solutions.collocation;
        let mut rows = vec![vec![
            text(format!("implicit, steps for a tolerance of {TOLERANCE:.0e}")),
            text(evaluations.to_string()),
            exponential(error),
        ]];
        for (step, found) in &solutions.explicit {
            rows.push(vec![
                text(format!("Runge-Kutta, {step:.0e} s")),
                text(found.map_or("broke down".to_owned(), |f| f.0.to_string())),
                found.map_or_else(|| text("-"), |f| exponential(f.1)),
            ]);
        }
        table(
            &format!("The same {:.1} s by other methods", solutions.span),
            &["method", "evaluations", "difference of torques, N m rms"],
            rows,
        )
    }

    pub(super) fn search_section(&self) -> StudySection {
        let searches = self.searches;
        let names = NAMES.iter().enumerate().map(|(k, n)| format!("{} {n}", k + 1)).collect::<Vec<_>>();
        let system = &searches.system;
        let mut charts = plots::torques(self.data, searches);
        charts.push(plots::convergence(searches));
        for (pair, title) in [
            (&searches.clean, "Ratios of errors, without noise"),
            (&searches.noisy, "Ratios of errors, 1e-3 N m of noise"),
        ] {
            charts.push(plots::ratios(pair, system, &names.join(", "), title));
        }
        StudySection {
            title: "The paper's search".into(),
            text: vec![
                "Table 2 of the paper: 100 sources, 200 iterations, acceleration 0.5, limit 600; 13 unknowns with clearance, 11 without. \
                 What torques do not show ends anywhere within the search range, on either model: only whether both happen to end near \
                 or far decides its ratio."
                    .into(),
            ],
            tables: vec![self.table3(), self.contest_table(searches)],
            charts,
            ..StudySection::default()
        }
    }

    /// Table 3 redone.
    fn table3(&self) -> StudyTable {
        let searches = self.searches;
        let pair = &searches.noisy;
        let middle = |of: &dyn Fn(usize) -> f64| median((0..pair.clearance.results.len()).map(of).collect());
        let rows = (0..PARAMETERS).map(|k| {
            vec![
                text(NAMES[k]),
                Value::from(searches.system.0[k]),
                Value::from(middle(&|s| pair.clearance.results[s].point[k])),
                Value::from(middle(&|s| pair.ideal.results[s].point[k])),
                Value::from(middle(&|s| pair.ratios(s, &searches.system)[k])),
            ]
        });
        table(
            "Table 3 redone: medians over 5 seeds, torque noise of 1e-3 N m",
            &["", "system", "with clearance", "ideal", "ratio of errors"],
            rows.collect(),
        )
    }

    fn contest_table(&self, searches: &Searches) -> StudyTable {
        let row = |c: &Contestant| vec![text(c.name), exponential(c.median), exponential(c.base_error)];
        let rows = searches.contest.iter().chain([&searches.least_squares]).map(row).collect();
        table(
            "All searches of the toolkit on the noisy torque with 40100 evaluations, and least squares",
            &["", "mean absolute error, N m", "largest relative error of π1, π7, π8"],
            rows,
        )
    }

    pub(super) fn base_section(&self, fits: &Fits, noise: &NoiseStudy) -> StudySection {
        let [clearance, ideal, coulomb] = &fits.all;
        let values = (0..SYMBOLS.len()).map(|k| {
            vec![
                text(SYMBOLS[k]),
                Value::from(fits.truth[k]),
                Value::from(clearance.x[k]),
                Value::from(coulomb.x[k]),
                Value::from(coulomb.half[k]),
                Value::from(ideal.x[k]),
                Value::from(ideal.half[k]),
            ]
        });
        let strongest: Vec<_> = noise.spreads.iter().filter(|s| s.level == LEVELS[1]).collect();
        let spreads = (0..SYMBOLS.len()).map(|k| {
            let of = strongest.iter().flat_map(|s| {
                let first = if s.knowledge == Knowledge::Clearance { s.deviation[k] } else { s.bias[k] };
                let share = text(format!("{:.0} %", 100.0 * s.coverage[k]));
                [exponential(first), exponential(s.stated[k]), share]
            });
            std::iter::once(text(SYMBOLS[k])).chain(of).collect()
        });
        let heads = strongest.iter().flat_map(|s| {
            let first = match s.knowledge {
                Knowledge::Clearance => "clearance: deviation",
                Knowledge::Ideal => "ideal: bias",
                Knowledge::Coulomb => "Coulomb friction: bias",
            };
            [first, "stated deviation", "coverage"].map(str::to_owned)
        });
        let heads: Vec<String> = std::iter::once(String::new()).chain(heads).collect();
        let heads: Vec<&str> = heads.iter().map(String::as_str).collect();
        StudySection {
            title: "Base parameters by least squares".into(),
            text: vec![
                "π1 to π8 are what torques show; all else is decided by search ranges. Least squares gives them at once, with intervals. \
                 With clearance a ninth column is in the fit: mass 2 by itself, since the offset of journal 2 lengthens or shortens the \
                 distance between the axes by up to the clearance. Without it π8 would be off by mass times clearance."
                    .into(),
                format!(
                    "What knowledge of the clearance adds to Coulomb friction: the residual falls from {:.4} N m rms to the noise, \
                     intervals become about ten times narrower, and inertias, which the swing hides, become visible.",
                    coulomb.residual_rms()
                ),
            ],
            tables: vec![
                table(
                    "Without noise: values and half widths of 95 % intervals",
                    &["", "truth", "clearance", "Coulomb friction", "±", "ideal", "±"],
                    values.collect(),
                ),
                table(
                    &format!("{} realisations of 1e-3 N m of noise: standard deviations, and coverage of 95 % intervals", noise.realisations),
                    &heads,
                    spreads.collect(),
                ),
            ],
            ..StudySection::default()
        }
    }

    pub(super) fn beyond_section(&self, excitations: &Excitations, sweeps: &Sweeps) -> StudySection {
        let head: Vec<&str> =
            ["trajectory", "largest acceleration, rad/s²"].into_iter().chain(SYMBOLS).collect();
        let shown = excitations.shown.iter().map(|s| {
            let half = s.half.iter().map(|h| exponential(*h));
            [text(&s.name), Value::from(s.acceleration)].into_iter().chain(half).collect()
        });
        let row = |v: &Variant| {
            vec![
                text(&v.name),
                text(format!("{:.3}, {:.3}", 1e6 * v.penetration[0], 1e6 * v.penetration[1])),
                text(v.onsets.to_string()),
                Value::from(v.swing_hz),
                Value::from(v.ringing[0]),
                Value::from(100.0 * v.ideal[0]),
                Value::from(100.0 * v.ideal[1]),
                Value::from(100.0 * v.coulomb[1]),
                Value::from(v.residual),
            ]
        };
        let all = sweeps.clearance.iter().chain(&sweeps.roughness).chain(&sweeps.laws);
        StudySection {
            title: "Other trajectories, bearings and laws".into(),
            text: vec![
                "Friction biases the ideal model, not the offset of the journals; neither their clearance nor roughness nor law of \
                 contact changes that much. What they change is the swing, which is what remains when Coulomb friction is in the model."
                    .into(),
            ],
            tables: vec![
                table(
                    "Half widths of 95 % intervals at 1e-3 N m of noise, clearance model, 15.7 s",
                    &head,
                    shown.collect(),
                ),
                table(
                    "Other bearings",
                    &[
                        "",
                        "penetration 1, 2, µm",
                        "onsets",
                        "swing, Hz",
                        "swing in torque 1, N m rms",
                        "ideal, π7, %",
                        "π8, %",
                        "Coulomb friction, π8, %",
                        "its residual, N m rms",
                    ],
                    all.map(row).collect(),
                ),
            ],
            charts: plots::sweeps(sweeps),
            ..StudySection::default()
        }
    }
}
