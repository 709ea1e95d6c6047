//! The report page of payloads, and their URDF.

use dynid_model::element::scale_name;
use dynid_report as report;
use dynid_report::{Fact, StudySection, StudyTable, Value};

use super::record::{PayloadFile, PayloadRecord, Quantity};
use crate::Error;
use crate::report_data::run_settings;

impl PayloadFile {
    /// The report as one HTML page.
    ///
    /// # Errors
    /// [`PageError`](crate::fault::PageError).
    pub fn report(&self) -> Result<String, Error> {
        let sentences: Vec<String> = self.payloads.iter().map(|p| p.sentence.clone()).collect();
        let p = &self.provenance;
        let page = report::StudyReport {
            title: format!("Payload of {}", self.robot),
            verdict: report::Verdict {
                status: self.status,
                headline: sentences.join("; "),
                sentences: vec![format!("Robot and payload together: {}", self.verdict.headline)],
                ..report::Verdict::default()
            },
            warnings: self
                .verdict
                .cautions
                .iter()
                .map(|c| report::Warning { message: format!("{}: {}", c.name, c.message), hint: c.remedy.clone() })
                .collect(),
            introduction: vec![
                "Robot and payload are identified together: the columns of the link that carries the payload count once \
                 more in the logs that carry it, and the payload is one more body that must be able to exist."
                    .to_owned(),
            ],
            rows: Vec::new(),
            sections: self.sections(),
            provenance: report::Provenance {
                version: p.version.clone(),
                inputs: p
                    .inputs
                    .iter()
                    .map(|i| report::InputFile {
                        path: i.path.clone(),
                        kind: i.kind.word().to_owned(),
                        sha256: Some(i.sha256.clone()),
                    })
                    .collect(),
                seed: Some(p.seed),
                settings: run_settings(p),
            },
        };
        crate::fault::page(report::render_kind("Payload", &page))
    }

    fn sections(&self) -> Vec<StudySection> {
        let mut sections: Vec<StudySection> = self.payloads.iter().map(section).collect();
        let mut facts = Vec::new();
        if let Some(c) = &self.consistency {
            facts.push(Fact::new("price of feasibility", c.price, "residual variances"));
            facts.extend(c.price_over_chance.map(|x| Fact::new("the same over chance", x, "")));
            facts.push(Fact::new("weight of the prior", c.prior_weight, "residual variances"));
        }
        let parameters = self.log_parameters.iter();
        let parameters = parameters
            .map(|p| vec![p.name.clone().into(), p.value.into(), number(p.std), p.unit.clone().into()]);
        let scales = self.log_scales.iter();
        let scales =
            scales.map(|s| vec![scale_name(&s.log).into(), s.value.into(), number(s.std), "1".into()]);
        let rows: Vec<Vec<Value>> = parameters.chain(scales).collect();
        let tables = match rows.is_empty() {
            true => Vec::new(),
            false => vec![StudyTable {
                caption: "What single logs have of their own, beside the others".to_owned(),
                head: ["parameter", "deviation or factor", "std", "unit"].map(str::to_owned).to_vec(),
                rows,
            }],
        };
        sections.push(StudySection {
            title: "Fit of robot and payload".to_owned(),
            facts,
            tables,
            ..StudySection::default()
        });
        sections
    }
}

fn number(x: Option<f64>) -> Value {
    x.map_or_else(|| "-".into(), Value::from)
}

fn section(p: &PayloadRecord) -> StudySection {
    let mut facts = vec![Fact::new("link that carries it", p.link.clone(), "")];
    facts.extend(p.stated_mass.map(|m| Fact::new("stated mass", m, "kg")));
    if let Some(d) = &p.difference {
        facts.push(Fact::new("mass by the difference of two separate fits", d.mass, "kg"));
        facts.push(Fact::new("its standard deviation", d.mass_std, "kg"));
        let [x, y, z] = d.com.map(|c| format!("{:.1}", 1e3 * c));
        facts.push(Fact::new("centre of mass by that difference", format!("{x}, {y}, {z}"), "mm"));
    }
    let feasible = if p.unconstrained_feasible { "a body can have them" } else { "no body can have them" };
    facts.push(Fact::new("ten parameters without constraints", feasible, ""));
    let rows = std::iter::once(&p.mass).chain(&p.com).chain(&p.inertia).map(row).collect();
    StudySection {
        title: format!("Payload {}", p.name),
        text: vec![format!(
            "Coordinates are those of the joint frame of {}; moments of inertia are about the centre of mass. Intervals are of 95 %, about the value without constraints.",
            p.link
        )],
        facts,
        tables: vec![StudyTable {
            caption: "Mass, centre of mass, inertia".to_owned(),
            head: ["quantity", "value", "unit", "std", "from", "to", "data, %", "verdict"]
                .map(str::to_owned)
                .to_vec(),
            rows,
        }],
        ..StudySection::default()
    }
}

fn row(q: &Quantity) -> Vec<Value> {
    let boundary = if q.at_boundary { ", at the boundary" } else { "" };
    vec![
        q.name.clone().into(),
        q.value.into(),
        q.unit.clone().into(),
        q.std.into(),
        number(q.interval.map(|i| i.0)),
        number(q.interval.map(|i| i.1)),
        (100.0 * q.share).into(),
        format!("{}{boundary}", q.verdict).into(),
    ]
}
