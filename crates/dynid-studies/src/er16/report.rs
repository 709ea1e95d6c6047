//! The study's report.

use dynid::report::{Fact, StudyReport, StudySection, Value};

use super::arm::{Arm, JOINTS};
use super::chain::ChainRow;
use super::excitation::Designed;
use super::figures;
use super::measurement::Measurement;
use super::search::{Searched, Searches, unknowns};
use super::separable::{FrictionComparison, Identified, objective_of};
use super::settings::Settings;
use super::{REVERSAL_RATE_HZ, STUDY};
use crate::page::{table, text};
use crate::statistics::median;
use crate::{StudyError, StudyRecord};

/// What the report is made of.
pub(super) struct Contents<'a> {
    pub(super) arm: &'a Arm,
    pub(super) settings: &'a Settings,
    pub(super) own: Option<&'a Designed>,
    pub(super) data: &'a Measurement,
    pub(super) searches: &'a Searches,
    pub(super) found: &'a Identified,
    pub(super) fast: &'a Measurement,
    pub(super) friction: &'a FrictionComparison,
    pub(super) chain: &'a [ChainRow],
}

impl Contents<'_> {
    pub(super) fn report(&self, record: &StudyRecord) -> Result<StudyReport, StudyError> {
        let introduction = [
            "Joints 1 to 3 of a 16 kg industrial arm, 15 base inertial parameters and five of friction per joint: offset, \
             Coulomb, viscous, and an arctangent whose slope enters nonlinearly. The paper minimises the mean absolute \
             error of torque by cuckoo search, an improved cuckoo search and a particle swarm.",
            "The paper prints neither the geometry of the arm nor the bounds of the search, and its printed trajectory \
             breaks its own limits. What stands in for them is a decision, listed in the study's `README.md`. The arm is \
             simulated with the parameters of the paper's Table 3 and torque noise of 4, 5 and 3 N m, so the truth is known.",
        ];
        let sections = vec![
            self.search_section(),
            self.torque_section(),
            self.friction_section(),
            self.parameter_section(),
            self.trajectory_section()?,
            self.chain_section(),
        ];
        Ok(record.page(STUDY, &introduction, sections))
    }

    fn truth(&self) -> Vec<f64> {
        self.settings.unknowns.iter().map(|u| u.value).collect()
    }

    fn search_section(&self) -> StudySection {
        let paper = &self.settings.paper;
        let truth = objective_of(self.arm, self.data, &self.truth());
        let separable = objective_of(self.arm, self.data, &self.found.unknowns);
        let three = |name: &str, printed: Option<[f64; JOINTS]>, ours: [f64; JOINTS]| {
            let mut row = vec![text(name)];
            row.extend((0..JOINTS).map(|j| printed.map_or_else(|| text("-"), |p| Value::from(p[j]))));
            row.extend(ours.map(Value::from));
            row
        };
        let predicted = self.arm.efforts(&self.data.block(), &self.found.unknowns);
        let of_separable = self.data.correlation(&self.data.torque, &predicted);
        let [ics, cs, pso] = self.searches.correlation;
        let correlation = table(
            "Correlation of measured and predicted torque, best of three runs (median over triples), the paper's Table 4",
            &["", "paper 1", "paper 2", "paper 3", "ours 1", "ours 2", "ours 3"],
            vec![
                three("PSO", Some(paper.correlation_pso), pso),
                three("CS", Some(paper.correlation_cs), cs),
                three("ICS", Some(paper.correlation_ics), ics),
                three("separable least squares", None, of_separable),
            ],
        );
        let row = |searched: &Searched, printed: f64| {
            let mut values = searched.values();
            values.sort_by(f64::total_cmp);
            let at = |share: f64| values[((values.len() - 1) as f64 * share).round() as usize];
            let of_three: Vec<f64> = searched.best_of_three().iter().map(|r| r.value).collect();
            vec![
                text(searched.name),
                Value::from(printed),
                Value::from(at(0.0)),
                Value::from(searched.median()),
                Value::from(at(1.0)),
                Value::from(median(of_three)),
                Value::from(searched.results[0].evaluations),
            ]
        };
        let level = |name: &str, value: f64| {
            vec![text(name), text("-"), text("-"), Value::from(value), text("-"), text("-"), text("-")]
        };
        let objectives = table(
            "Objective after 200 iterations, N m (the paper's data and noise are not known: only the order compares)",
            &["", "paper", "least", "median", "largest", "median of best of three", "evaluations"],
            vec![
                row(&self.searches.ics, paper.objective_ics),
                row(&self.searches.cs, paper.objective_cs),
                row(&self.searches.pso, paper.objective_pso),
                level("separable least squares", separable),
                level("truth", truth),
            ],
        );
        StudySection {
            title: "The searches".into(),
            text: vec![
                "ICS is cuckoo search with a chaotic step and an acceptance that lets small deteriorations pass. The separable \
                 solver eliminates the 27 linear parameters and searches the three slopes only."
                    .into(),
            ],
            tables: vec![correlation, objectives],
            charts: vec![figures::convergence(
                self.searches,
                &[("separable least squares", separable), ("truth", truth)],
            )],
            ..StudySection::default()
        }
    }

    fn torque_section(&self) -> StudySection {
        let best = self.searches.ics.best_of_three();
        let ics = best.first().map(|r| self.arm.efforts(&self.data.block(), &unknowns(self.arm, &r.point)));
        let separable = self.arm.efforts(&self.data.block(), &self.found.unknowns);
        let mut predicted: Vec<(&str, &[f64])> = Vec::new();
        if let Some(ics) = &ics {
            predicted.push(("ICS, best of three", ics));
        }
        predicted.push(("separable least squares", &separable));
        StudySection {
            title: "Measured and predicted torque".into(),
            charts: figures::torque(self.data, self.settings.search_rate_hz, &predicted),
            ..StudySection::default()
        }
    }

    fn friction_section(&self) -> StudySection {
        let truth = self.truth();
        let compared = self.friction;
        let of_linear = |j: usize, v: f64| {
            let bodies = 10 * self.arm.mechanism.bodies().len();
            let mut linear = compared.linear.clone();
            linear[..bodies].fill(0.0);
            figures::effort_at_velocity(&compared.linear_model, &[], &linear, j, v)
        };
        let laws: [(&str, figures::FrictionLaw<'_>); 3] = [
            ("truth", &|j, v| figures::friction_law(self.arm, &truth, j, v)),
            ("linear with offset", &of_linear),
            ("with arctangent", &|j, v| figures::friction_law(self.arm, &compared.unknowns, j, v)),
        ];
        let mut charts = figures::friction(self.fast, &laws);
        let errors: [(&str, &[f64]); 2] =
            [("linear with offset", &compared.with_offset), ("with arctangent", &compared.nonlinear)];
        charts.extend(figures::errors(self.fast, REVERSAL_RATE_HZ, &errors));
        StudySection {
            title: "Friction at reversal".into(),
            text: vec![
                "Both models are fitted by the same solver to the same 50 Hz data. What linear friction leaves are peaks where \
                 a joint turns back."
                    .into(),
            ],
            charts,
            ..StudySection::default()
        }
    }

    fn parameter_section(&self) -> StudySection {
        let ics = self.searches.ics.best_of_three().first().map(|r| unknowns(self.arm, &r.point));
        let rows = self
            .settings
            .unknowns
            .iter()
            .enumerate()
            .map(|(k, unknown)| {
                vec![
                    text(&unknown.name),
                    Value::from(unknown.value),
                    ics.as_ref().map_or_else(|| text("-"), |x| Value::from(x[k])),
                    Value::from(self.found.unknowns[k]),
                    self.found.deviations[k].map_or_else(|| text("-"), Value::from),
                ]
            })
            .collect();
        StudySection {
            title: "Parameters".into(),
            text: vec![
                "Friction coefficients of one joint trade off against each other (the arctangent is nearly a sign for steep \
                 slopes and nearly viscous for flat ones): compare torques, not single coefficients."
                    .into(),
            ],
            tables: vec![table(
                "Table 3: truth, ICS (best of three), separable least squares and its standard deviation",
                &["", "truth", "ICS", "separable", "deviation"],
                rows,
            )],
            ..StudySection::default()
        }
    }

    fn trajectory_section(&self) -> Result<StudySection, StudyError> {
        let mut drawn: Vec<(&str, &[Vec<f64>])> = vec![("reference", &self.settings.reference)];
        if let Some(own) = self.own {
            drawn.push(("designed", &own.rows));
        }
        Ok(StudySection {
            title: "Excitation".into(),
            facts: self.own.map_or_else(Vec::new, |own| {
                let starts: Vec<String> = own.starts.iter().map(|c| format!("{c:.1}")).collect();
                vec![
                    Fact::new("Condition number of the 15 inertial columns", own.condition, ""),
                    Fact::new("All starts", starts.join(", "), ""),
                ]
            }),
            charts: figures::paths(self.arm, self.settings, &drawn)?,
            ..StudySection::default()
        })
    }

    fn chain_section(&self) -> StudySection {
        let rows = self
            .chain
            .iter()
            .map(|r| {
                vec![
                    Value::from(r.rate_hz),
                    Value::from(r.equations as u64),
                    Value::from(r.true_states),
                    Value::from(r.processed),
                    Value::from(r.smoothed),
                ]
            })
            .collect();
        StudySection {
            title: "From noisy signals".into(),
            text: vec![
                "Positions with noise are differentiated in the frequency domain, torque is smoothed by three passes of the \
                 five-point cubic filter or left as it is; one period. Figures are medians over noise realisations of the summed \
                 mean error against the noise-free torque at 100 Hz."
                    .into(),
            ],
            tables: vec![table(
                "Error of the separable estimate, N m, by sample rate",
                &["rate, Hz", "equations", "true states", "processed states", "processed states, smoothed torque"],
                rows,
            )],
            ..StudySection::default()
        }
    }
}
