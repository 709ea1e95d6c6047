//! The study's report.

use dynid::report::{StudyReport, StudySection, Value};

use super::data::Data;
use super::excitation::{Designed, Designs};
use super::faster::Excitations;
use super::fit::Fits;
use super::gap::Gaps;
use super::noise::NoiseStudy;
use super::parameters::PARAMETERS;
use super::pointing::Pointing;
use super::rank::{Identifiability, unidentifiable};
use super::search::Searches;
use super::settings::Settings;
use super::simulation::Solutions;
use super::sweep::Sweeps;
use super::trajectory::travel;
use super::{STUDY, figures, table as table3};
use crate::page::{table, text};
use crate::{StudyError, StudyRecord};

/// What the report is made of.
pub(super) struct Contents<'a> {
    pub(super) pointing: &'a Pointing,
    pub(super) settings: &'a Settings,
    pub(super) identifiability: &'a Identifiability,
    pub(super) designs: &'a Designs,
    pub(super) data: &'a Data,
    pub(super) solutions: &'a Solutions,
    pub(super) searches: &'a Searches,
    pub(super) fits: &'a Fits,
    pub(super) noise: &'a NoiseStudy,
    pub(super) excitations: &'a Excitations,
    pub(super) sweeps: &'a Sweeps,
    pub(super) gaps: &'a Gaps,
}

impl Contents<'_> {
    pub(super) fn report(&self, record: &StudyRecord) -> Result<StudyReport, StudyError> {
        let introduction = [
            "Two axes that cross, X over Y, with clearance in both joints: the journals are offset from the centres of their \
             bearings. The paper identifies 11 inertial parameters from torques on a Fourier trajectory.",
            "The paper gives neither the length between the axes nor the frequency of the trajectory. What stands in for them \
             is a decision, listed in the study's `README.md`. Joints with clearance are trees with two slides in front of \
             every joint.",
        ];
        let sections = vec![
            self.simulation_section()?,
            self.gaps.section(),
            self.search_section(),
            self.table_section(),
            self.base_section(self.fits, self.noise),
            self.beyond_section(self.excitations, self.sweeps),
            self.identifiability_section()?,
            self.trajectory_section()?,
        ];
        Ok(record.page(STUDY, &introduction, sections))
    }

    fn trajectory_section(&self) -> Result<StudySection, StudyError> {
        let designs = self.designs;
        let moves =
            |travel: &[f64]| text(travel.iter().map(|x| format!("{x:.4}")).collect::<Vec<_>>().join(", "));
        let mut drawn: Vec<(&str, &[Vec<f64>])> = vec![("Table 1", &self.settings.trajectory)];
        let mut conditions = vec![vec![
            text("Table 1"),
            Value::from(designs.printed[0]),
            Value::from(designs.printed[1]),
            moves(&travel(self.settings, &self.settings.trajectory)?),
            text("-"),
        ]];
        let ours: [(&str, &Option<Designed>); 2] =
            [("ours, unit columns", &designs.unit_norm), ("ours, raw columns", &designs.raw)];
        for (name, designed) in ours {
            let Some(designed) = designed else { continue };
            drawn.push((name, &designed.rows));
            let random: Vec<String> = designed.random.iter().map(|c| format!("{c:.3}")).collect();
            conditions.push(vec![
                text(name),
                Value::from(designed.conditions[0]),
                Value::from(designed.conditions[1]),
                moves(&designed.travel),
                text(random.join(", ")),
            ]);
        }
        Ok(StudySection {
            title: "Excitation".into(),
            text: vec![
                "Condition numbers of the 8 columns that ideal joints show. Raw ones mix units. Both trajectories of ours set out from \
                 Table 1; the last column tells where random starts end. Columns of unit length have lost their size: the best \
                 trajectory by them hardly moves joint 1, which raw condition numbers see."
                    .into(),
            ],
            tables: vec![table(
                "Condition numbers",
                &["", "raw", "unit columns", "travel of the joints, rad", "its own criterion from random starts"],
                conditions,
            )],
            charts: figures::motion(self.pointing, self.settings, &drawn)?,
            ..StudySection::default()
        })
    }

    fn identifiability_section(&self) -> Result<StudySection, StudyError> {
        let found = self.identifiability;
        let rows = found.base.iter().map(|entry| {
            let acts = if entry.acts { "yes" } else { "no" };
            vec![text(&entry.expression), Value::from(entry.value), text(acts)]
        });
        let values = [&found.trajectory, &found.random].map(|report| &report.singular_values);
        let singular = (0..PARAMETERS).map(|k| {
            let cell = |of: &Vec<f64>| text(of.get(k).map_or_else(String::new, |s| format!("{s:.1e}")));
            vec![text((k + 1).to_string()), cell(values[0]), cell(values[1])]
        });
        Ok(StudySection {
            title: "What ideal joints show".into(),
            text: vec![
                format!(
                    "None of {} can be told from the others by torques alone, however good the search: an optimiser's values for them \
                     are decided by its search range.",
                    unidentifiable(self.pointing, self.settings)?.join(", ")
                ),
                "The tool's base parameters of general links hold two first moments more than the paper's, which puts centres of mass \
                 on the axes X. Inertias are about joint frames here."
                    .into(),
            ],
            tables: vec![
                table(
                    "Base parameters",
                    &["combination", "value of the system", "among the paper's 8"],
                    rows.collect(),
                ),
                table(
                    "Singular values of the 11 parameters, columns of unit length",
                    &["number", "Table 1", "random motion"],
                    singular.collect(),
                ),
            ],
            ..StudySection::default()
        })
    }

    fn table_section(&self) -> StudySection {
        let rows = self.settings.table3.iter().map(|row| {
            let recomputed = table3::ratio(row);
            vec![
                text(&row.name),
                Value::from(row.system),
                Value::from(row.clearance),
                Value::from(row.ideal),
                Value::from(row.ratio),
                Value::from(recomputed),
                text(match (recomputed < 1.0, table3::matches_print(row)) {
                    (true, true) => "closer",
                    (false, true) => "farther",
                    (_, false) => "not as printed",
                }),
            ]
        });
        StudySection {
            title: "Table 3 of the paper".into(),
            text: vec![
                "As printed; values of Ls1 and m1 are interchanged there, which the ratios do not show. The ratio is the error with \
                 clearance over the error with ideal joints. Differences of single parameters say little where torques do not tell \
                 them apart."
                    .into(),
            ],
            tables: vec![table(
                "Printed values and ratios of errors",
                &["", "system", "with clearance", "ideal", "ratio, printed", "recomputed", ""],
                rows.collect(),
            )],
            ..StudySection::default()
        }
    }
}
