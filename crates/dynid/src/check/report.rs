//! The page of a pre-flight.

use dynid_motion::UniformLog;
use dynid_report as report;
use dynid_report::{Chart, ChartAxis, ChartCurve, CurveStyle, Fact, StudySection, StudyTable, Value};

use super::{Check, CheckedLog, FindingId, Severity};
use crate::estimate::short_name;
use crate::{Error, VERSION};

/// Points per drawn curve.
const POINTS: usize = 400;

/// Curves of a log for the page.
#[derive(Debug, Clone)]
pub(super) struct Trace {
    joints: Vec<JointTrace>,
}

/// Time and position, time and effort of a joint.
#[derive(Debug, Clone)]
struct JointTrace {
    name: String,
    position: Vec<[f64; 2]>,
    effort: Vec<[f64; 2]>,
}

impl Trace {
    pub(super) fn of(log: &UniformLog) -> Self {
        let step = (log.samples() / POINTS).max(1);
        let thin = |signal: &[f64]| -> Vec<[f64; 2]> {
            (0..signal.len()).step_by(step).map(|k| [log.time(k) - log.start, signal[k]]).collect()
        };
        Trace {
            joints: log
                .joints
                .iter()
                .map(|j| JointTrace {
                    name: j.name.clone(),
                    position: thin(&j.position),
                    effort: thin(&j.effort),
                })
                .collect(),
        }
    }
}

impl Check {
    /// What was found, in one line.
    pub fn headline(&self) -> String {
        let count = |severity: Severity| self.findings.iter().filter(|f| f.severity == severity).count();
        let (errors, warnings) = (count(Severity::Error), count(Severity::Warning));
        let plural = |n: usize, word: &str| format!("{n} {word}{}", if n == 1 { "" } else { "s" });
        // A log that no model was tried on is no log that passed.
        let untried: Vec<String> = self
            .findings
            .iter()
            .filter(|f| f.id == FindingId::NotExamined)
            .map(|f| short_name(&f.log))
            .collect();
        let untried = match untried.is_empty() {
            true => String::new(),
            false => {
                format!("; order, signs and units of the columns were not examined in {}", untried.join(", "))
            }
        };
        match (errors, warnings) {
            (0, 0) if untried.is_empty() => "Nothing speaks against identifying from these logs".to_owned(),
            (0, 0) => format!("Clock and signals are fine{untried}"),
            (0, w) => {
                format!(
                    "{}, none of which makes nonsense of an identification{untried}",
                    plural(w, "warning")
                )
            }
            (e, w) => format!(
                "{} that would make nonsense of an identification, {}{untried}",
                plural(e, "fault"),
                plural(w, "warning")
            ),
        }
    }

    /// The page as HTML.
    ///
    /// # Errors
    /// [`PageError`](crate::fault::PageError).
    pub fn report(&self) -> Result<String, Error> {
        let status = match self.worst() {
            Some(Severity::Error) => report::Status::Fail,
            Some(Severity::Warning) => report::Status::Warn,
            _ => report::Status::Ok,
        };
        let findings = self.findings.iter().map(|f| report::FindingRow {
            status: match f.severity {
                Severity::Error => report::Status::Fail,
                Severity::Warning => report::Status::Warn,
                Severity::Info => report::Status::Ok,
            },
            name: f.id.plain(),
            log: short_name(&f.log),
            joint: f.joint.clone().unwrap_or_default(),
            evidence: f.evidence.clone(),
            remedy: f.remedy.clone(),
        });
        let mut sections = vec![StudySection {
            title: "What was measured".to_owned(),
            tables: vec![table(&self.logs)],
            ..StudySection::default()
        }];
        sections.extend(self.logs.iter().zip(&self.traces).map(|(log, trace)| section(log, trace)));
        let inputs = self.inputs.iter().map(dynid_config::provenance::shown).collect();
        crate::fault::page(report::render_log_page(&report::LogPage {
            kind: "Pre-flight".to_owned(),
            title: format!(
                "Pre-flight of {}",
                self.logs.iter().map(|l| short_name(&l.log)).collect::<Vec<_>>().join(", ")
            ),
            robot: short_name(&self.robot),
            verdict: report::Verdict { status, headline: self.headline(), ..report::Verdict::default() },
            introduction: Vec::new(),
            findings: findings.collect(),
            sections,
            provenance: report::Provenance {
                version: VERSION.to_owned(),
                inputs,
                ..report::Provenance::default()
            },
        }))
    }
}

fn table(logs: &[CheckedLog]) -> StudyTable {
    let with_error = |pair: Option<[f64; 2]>| match pair {
        Some([value, error]) => Value::Text(format!("{value:.2} ± {error:.2}")),
        None => Value::Undefined,
    };
    let row = |log: &CheckedLog| {
        vec![
            Value::Text(short_name(&log.log)),
            Value::Count(log.rows as u64),
            Value::Number(log.rate_hz),
            Value::Number(log.duration_s),
            if log.jitter < 1e-6 { Value::Text("< 1e-6".to_owned()) } else { Value::Number(log.jitter) },
            log.unexplained.map(|u| 100.0 * u).into(),
            with_error(log.delay_samples),
            with_error(log.tilt_deg),
            log.condition.filter(|c| c.is_finite()).into(),
            log.excited.map_or(Value::Undefined, |[a, b]| Value::Text(format!("{a} of {b}"))),
        ]
    };
    let head = [
        "Log",
        "Rows",
        "Rate, Hz",
        "Duration, s",
        "Jitter, samples",
        "Unexplained, %",
        "Delay, samples",
        "Tilt, degrees",
        "Condition",
        "Parameters excited",
    ];
    StudyTable {
        caption: "Unexplained: share of the efforts (root mean square) that bodies which can exist, with Coulomb and viscous friction, leave open. Delay: of the motion behind the effort. Tilt: between the gravity that efforts show and the one stated. Condition: of the weighted regressor with unit columns".to_owned(),
        head: head.map(str::to_owned).to_vec(),
        rows: logs.iter().map(row).collect(),
    }
}

fn section(log: &CheckedLog, trace: &Trace) -> StudySection {
    let chart = |title: &str, unit: &str, of: fn(&JointTrace) -> &Vec<[f64; 2]>| Chart {
        title: title.to_owned(),
        x: ChartAxis { label: "time".to_owned(), unit: "s".to_owned(), logarithmic: false },
        y: ChartAxis { label: title.to_owned(), unit: unit.to_owned(), logarithmic: false },
        curves: trace
            .joints
            .iter()
            .map(|j| ChartCurve { name: j.name.clone(), points: of(j).clone(), style: CurveStyle::Line })
            .collect(),
        ..Chart::default()
    };
    StudySection {
        title: short_name(&log.log),
        facts: vec![Fact::new("file".to_owned(), log.log.clone(), "")],
        charts: vec![
            chart("position", "rad or m", |j| &j.position),
            chart("effort", "N m or N", |j| &j.effort),
        ],
        ..StudySection::default()
    }
}
