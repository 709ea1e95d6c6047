//! The page of a comparison.

use dynid_report as report;
use dynid_report::{
    Chart, ChartAxis, ChartCurve, CurveStyle, Ranked, Ranking, StudySection, StudyTable, Value,
};

use super::{CompareStatus, ComparedEstimator, Comparison, JointError};
use crate::{Error, VERSION};

impl Comparison {
    /// The page as HTML.
    ///
    /// # Errors
    /// [`PageError`](crate::fault::PageError).
    pub fn report(&self) -> Result<String, Error> {
        let inputs = self.inputs.iter().map(dynid_config::provenance::shown).collect();
        let sections = vec![
            StudySection {
                title: "Errors on unseen time".to_owned(),
                tables: vec![self.table()],
                charts: vec![self.by_time()],
                rankings: vec![self.ranking()],
                ..StudySection::default()
            },
            StudySection {
                title: "Joint by joint".to_owned(),
                tables: vec![
                    self.joint_table("Root mean square of the held-out error, N m or N", |e| Some(e.rms)),
                    self.joint_table(
                        "The same where the joint moves (at least 3 % of its rms speed and four standard deviations of its noise)",
                        |e| e.rms_moving,
                    ),
                    self.joint_table(
                        "The same where it stands: friction has any value up to static friction there",
                        |e| e.rms_standing,
                    ),
                ],
                ..StudySection::default()
            },
        ];
        crate::fault::page(report::render_log_page(&report::LogPage {
            kind: "Comparison of estimators".to_owned(),
            title: format!(
                "{} estimators on {} log{}",
                self.estimators.len(),
                self.logs.len(),
                if self.logs.len() == 1 { "" } else { "s" }
            ),
            robot: self.robot.clone(),
            verdict: report::Verdict {
                status: match self.status() {
                    CompareStatus::Well => report::Status::Ok,
                    CompareStatus::Poorly => report::Status::Warn,
                    CompareStatus::NoneFitted => report::Status::Fail,
                },
                headline: self.headline(),
                ..report::Verdict::default()
            },
            introduction: vec![format!(
                "Each estimator was fitted to four fifths of every log and predicted the fifth that it had not seen, {} times. \
                 Prediction and effort pass one filter of {:.1} Hz. Kernel, reversal mask and delay are the same for all; \
                 friction shapes, weights and priors were found again each time.",
                self.folds, self.filter_hz
            )],
            findings: Vec::new(),
            sections,
            provenance: report::Provenance {
                version: VERSION.to_owned(),
                inputs,
                ..report::Provenance::default()
            },
        }))
    }

    fn table(&self) -> StudyTable {
        let with_error = |pair: Option<[f64; 2]>| match pair {
            Some([value, error]) => Value::Text(format!("{value:.3} ± {error:.3}")),
            None => Value::Undefined,
        };
        let row = |e: &ComparedEstimator| {
            vec![
                Value::Text(e.name.clone()),
                e.rank.map_or(Value::Undefined, |r| Value::Count(r as u64)),
                with_error(e.error.zip(e.standard_error).map(|(a, b)| [a, b])),
                with_error(e.behind),
                e.seconds.into(),
                Value::Text(e.failure.clone().unwrap_or_else(|| e.what.clone())),
            ]
        };
        let head = [
            "Estimator",
            "Rank",
            "Error, % of the effort",
            "Behind the best, %",
            "Time of a fit, s",
            "What it does",
        ];
        StudyTable {
            caption: "Mean over joints of the relative error on held-out time, mean and standard error over folds; differences are paired by fold".to_owned(),
            head: head.map(str::to_owned).to_vec(),
            rows: self.estimators.iter().map(row).collect(),
        }
    }

    fn joint_table(&self, caption: &str, figure: impl Fn(&JointError) -> Option<f64>) -> StudyTable {
        let mut head = vec!["Estimator".to_owned()];
        head.extend(self.joints.iter().cloned());
        let row = |e: &ComparedEstimator| {
            let cells =
                e.joints.iter().map(|j| j.and_then(|j| figure(&j)).map_or(Value::Undefined, Value::Number));
            std::iter::once(Value::Text(e.name.clone())).chain(cells).collect()
        };
        StudyTable {
            caption: caption.to_owned(),
            head,
            rows: self.estimators.iter().filter(|e| e.failure.is_none()).map(row).collect(),
        }
    }

    /// Held-out errors of all estimators that came to an end, the best first.
    fn ranking(&self) -> Ranking {
        let rows = self.estimators.iter().filter_map(|e| {
            Some(Ranked { name: e.name.clone(), value: e.error?, error: e.standard_error.unwrap_or(0.0) })
        });
        Ranking {
            title: "Held-out error of every estimator".to_owned(),
            note: "Strokes: one standard error over the folds to either side.".to_owned(),
            unit: "% of the effort".to_owned(),
            rows: rows.collect(),
        }
    }

    /// Held-out errors over the time that a fit takes, each with a standard error up and down.
    fn by_time(&self) -> Chart {
        let placed: Vec<(&str, [f64; 2], f64)> = (self.estimators.iter())
            .filter_map(|e| {
                let at = [e.seconds?.max(1e-4), e.error?];
                Some((e.name.as_str(), at, e.standard_error.unwrap_or(0.0)))
            })
            .collect();
        let bar = |(_, [at, error], spread): &(&str, [f64; 2], f64)| {
            [[*at, error - spread], [*at, error + spread], [f64::NAN, f64::NAN]]
        };
        let bars = ChartCurve {
            name: "one standard error up and down".to_owned(),
            points: placed.iter().flat_map(bar).collect(),
            style: CurveStyle::Line,
        };
        let named = placed.iter().map(|(name, at, _)| ChartCurve {
            name: (*name).to_owned(),
            points: vec![*at],
            style: CurveStyle::Named,
        });
        Chart {
            title: "Held-out error over the time of a fit".to_owned(),
            x: ChartAxis { label: "time of a fit".to_owned(), unit: "s".to_owned(), logarithmic: true },
            y: ChartAxis {
                label: "held-out error".to_owned(),
                unit: "% of the effort".to_owned(),
                logarithmic: false,
            },
            note: "Strokes: one standard error up and down.".to_owned(),
            curves: std::iter::once(bars).chain(named).collect(),
            ..Chart::default()
        }
    }
}
