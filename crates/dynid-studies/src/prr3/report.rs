//! The study's report.

use dynid::estimators::load_friction::Prediction;
use dynid::motion::trajectory::Sampled;
use dynid::report::{StudyReport, StudySection, Value};

use super::beyond::{Shares, Upright};
use super::encoders::Encoders;
use super::excitation::Designs;
use super::fits::{self, Fits};
use super::knowable::{Knowable, told};
use super::machine::Machine;
use super::rank::Rank;
use super::settings::Settings;
use super::trajectory::Share;
use super::{STUDY, figures};
use crate::page::{table, text};
use crate::{StudyError, StudyRecord};

/// What the report is made of.
pub(super) struct Contents<'a> {
    pub(super) machine: &'a Machine,
    pub(super) settings: &'a Settings,
    pub(super) motion: &'a Sampled,
    pub(super) forces: &'a Prediction,
    pub(super) shares: &'a [Share],
    pub(super) rank: &'a Rank,
    pub(super) fits: &'a Fits,
    pub(super) knowable: &'a Knowable,
    pub(super) upright: &'a Upright,
    pub(super) weights: &'a Shares,
    pub(super) encoders: &'a Encoders,
    pub(super) designs: &'a Designs,
}

impl Contents<'_> {
    pub(super) fn report(&self, record: &StudyRecord) -> Result<StudyReport, StudyError> {
        let introduction = [
            "Three sliders on one guideway carry a platform on three legs. The paper identifies 13 inertial and 4 friction \
             parameters from the forces of the sliders by pattern search, with friction that follows the forces on the guideway; \
             these are Lagrange multipliers of the mechanism.",
            "No measured data are published. Data here are simulated with the paper's estimates for the truth; what is missing or \
             contradictory in the paper is decided in the study's `README.md`. Kinematics, dynamics and reactions are those of a \
             tree with three cut pins, Table 1 a linear map onto its parameters.",
        ];
        let sections = vec![
            self.table_section(),
            self.motion_section(),
            self.law_section()?,
            self.circle_section()?,
            self.friction_section(),
            self.search_section(),
            self.upright_section(),
            self.shares_section(),
            self.design_section()?,
        ];
        Ok(record.page(STUDY, &introduction, sections))
    }

    fn table_section(&self) -> StudySection {
        let (settings, names) = (self.settings, self.settings.names());
        let batch = &self.fits.noisy[0];
        let fitted = &batch.fits[0];
        let searched = fitted.searched.as_ref().map(|s| s.point.clone());
        let (lower, upper, truth, start) =
            (settings.lower(), settings.upper(), settings.truth(), settings.start());
        let rows = (0..truth.len()).map(|k| {
            let bound = |x: f64| if x.is_finite() { Value::from(x) } else { text("∞") };
            vec![
                text(names[k].0),
                text(names[k].1),
                bound(lower[k]),
                bound(upper[k]),
                Value::from(start[k]),
                Value::from(truth[k]),
                Value::from(searched.as_ref().map(|p| p[k])),
                Value::from(fitted.fit.theta[k]),
                Value::from(self.knowable.near.theta[k]),
            ]
        });
        let rests = self
            .knowable
            .verdicts
            .iter()
            .zip(&names)
            .map(|(verdict, (name, _))| vec![text(*name), text(told(verdict, &names))]);
        let base = (0..self.rank.base.nrows()).map(|i| {
            let term = |k: usize| match self.rank.base[(i, k)] {
                0.0 => None,
                1.0 => Some(format!("+ {}", names[k].0)),
                f => Some(format!("{} {} {}", if f < 0.0 { "-" } else { "+" }, f.abs(), names[k].0)),
            };
            let terms: Vec<String> = (0..self.rank.base.ncols()).filter_map(term).collect();
            let own = &self.knowable.base[i];
            let expression = terms.join(" ");
            vec![
                text(format!("b{}", i + 1)),
                text(expression.trim_start_matches("+ ")),
                Value::from(self.knowable.base_truth[i]),
                Value::from(own.value),
                Value::from(own.std.map(|s| 1.96 * s)),
            ]
        });
        let mut words = vec![
            "Data are the forces of one period with noise of 2 N. Single inertial parameters are not determined, whatever the method: \
             two directions change neither forces nor normal forces nor weights. Along them the column before the last is the nearest \
             to the design, with bodies that can exist."
                .to_owned(),
            "The paper's own estimates of the five masses are the design values and 1.00, 1.00, 1.00, 1.09 and 0.98 kg, about the first \
             mesh of a pattern search; two inertias are 1.25 times their design value."
                .to_owned(),
        ];
        words.extend(self.rank.free_in_words(settings).iter().map(|d| format!("Free: {d}.")));
        StudySection {
            title: "Table 1: what forces tell".into(),
            text: words,
            tables: vec![
                table(
                    "Parameters",
                    &[
                        "",
                        "unit",
                        "lower",
                        "upper",
                        "start",
                        "true",
                        "pattern search",
                        "least squares",
                        "nearest to design",
                    ],
                    rows.collect(),
                ),
                table("What the estimates of least squares rest on", &["", "verdict"], rests.collect()),
                table(
                    "Base parameters, least squares",
                    &["", "combination", "true", "estimate", "± 95 %"],
                    base.collect(),
                ),
            ],
            ..StudySection::default()
        }
    }

    fn motion_section(&self) -> StudySection {
        let mut charts = figures::motion(self.machine, self.motion);
        charts.extend(figures::encoders(&self.motion.time, &self.encoders.signals));
        StudySection {
            title: "Excitation".into(),
            text: vec![
                "The trajectory of identification, platform and sliders. Encoders have steps of 1 µm at 250 Hz; speeds and accelerations \
                 come from a zero-phase filter at 20 Hz and central differences. Encoders serve row e; all other rows use exact motion."
                    .into(),
            ],
            charts,
            ..StudySection::default()
        }
    }

    fn law_section(&self) -> Result<StudySection, StudyError> {
        let rows = |what: &str, batch: &fits::Batch| -> Vec<Vec<Value>> {
            let own = |f: &fits::Fitted| {
                vec![
                    text(what),
                    text(fits::name(f.model)),
                    Value::from(f.fit.rms),
                    Value::from(Some(f.searched_rms()).filter(|x| x.is_finite())),
                    Value::from(f.circle[0]),
                    Value::from(Some(f.circle[1]).filter(|x| x.is_finite())),
                ]
            };
            batch.fits.iter().map(own).collect()
        };
        let mut all = rows("none", &self.fits.clean);
        for batch in &self.fits.noisy {
            all.extend(rows(&format!("2 N, seed {}", batch.seed), batch));
        }
        let time = &self.motion.time;
        let mut charts = figures::fits(time, &self.fits.noisy[0])?;
        charts.extend(figures::residuals(time, &self.fits.clean)?);
        charts.extend(figures::normal_forces(time, self.forces, &self.upright.motion_forces));
        Ok(StudySection {
            title: "Three laws of friction".into(),
            text: vec![
                "Stribeck friction that follows the forces on the guideway (the truth), Coulomb and viscous friction that follow them, and \
                 Stribeck friction with their means. The constant law stands for constant friction, which the paper does not define."
                    .into(),
            ],
            tables: vec![table(
                "Residuals and errors on the circle, N rms",
                &["noise", "law", "least squares", "pattern search", "circle, least squares", "circle, pattern search"],
                all,
            )],
            charts,
            ..StudySection::default()
        })
    }

    fn circle_section(&self) -> Result<StudySection, StudyError> {
        let motion = super::trajectory::circle(&self.settings.circle, self.settings.trajectory.samples)?;
        let on = fits::OnCircle::new(self.fits)?;
        Ok(StudySection {
            title: "Another motion: a circle".into(),
            text: vec![
                "Parameters from the trajectory of identification predict the forces of a circle. The constant law keeps the mean normal \
                 forces of identification."
                    .into(),
            ],
            charts: figures::circle(&motion, &self.fits.circle.clean, &self.fits.noisy[0], &on),
            ..StudySection::default()
        })
    }

    fn friction_section(&self) -> StudySection {
        let rows = self.shares.iter().enumerate().map(|(k, s)| {
            vec![
                text((k + 1).to_string()),
                Value::from(s.total),
                Value::from(s.friction),
                Value::from(s.frictionless),
                Value::from(s.normal[0]),
                Value::from(s.normal[1]),
            ]
        });
        StudySection {
            title: "Friction's share".into(),
            text: vec![
                "Most of the force is friction, and most of that rests on the constant weight.".into(),
            ],
            tables: vec![table(
                "Forces along the trajectory, N",
                &[
                    "slider",
                    "force, rms",
                    "friction, rms",
                    "without friction, rms",
                    "largest in the plane",
                    "weight",
                ],
                rows.collect(),
            )],
            charts: figures::friction(&self.motion.time, self.forces),
            ..StudySection::default()
        }
    }

    fn search_section(&self) -> StudySection {
        let batch = &self.fits.noisy[0];
        let fitted = &batch.fits[0];
        let best = fitted.fit.sum_of_squares;
        let iterations: usize = fitted.fit.starts.iter().map(|s| s.iterations).sum();
        let mut rows = vec![
            vec![
                text("least squares within bounds"),
                Value::from(best),
                text(format!("{iterations} iterations")),
            ],
            vec![
                text("three parameters searched, the rest linear"),
                Value::from(batch.separated.sum_of_squares),
                text(format!("{} rounds of signs", batch.separated.rounds)),
            ],
        ];
        let mut searches = Vec::new();
        if let Some(found) = &fitted.searched {
            searches.push(("pattern search as published, mesh doubled after success", found));
        }
        searches.push(("pattern search, mesh at most 1", &batch.capped));
        for (name, found) in &searches {
            rows.push(vec![
                text(*name),
                Value::from(found.value),
                text(format!("{} evaluations", found.evaluations)),
            ]);
        }
        StudySection {
            title: "Pattern search and least squares".into(),
            text: vec![
                "Stribeck friction that varies, 2 N of noise, from the design values. Pattern search crawls along an ill-conditioned valley \
                 and ends on its limit of 34 000 evaluations; the published mesh, doubled after every success, is too wide most of the time, and one \
                 kept at 1 ends lower."
                    .into(),
            ],
            tables: vec![table("Sum of squared residuals", &["", "J, N²", ""], rows)],
            charts: vec![figures::convergence(&searches, best, iterations)],
            ..StudySection::default()
        }
    }
}
