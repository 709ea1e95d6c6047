//! The page of a motion.

use dynid_identify::estimate::short_name;
use dynid_identify::{Error, VERSION};
use dynid_motion::trajectory::Sampled;
use dynid_report as report;
use dynid_report::{Chart, ChartAxis, ChartCurve, CurveStyle, Fact, StudySection, StudyTable, Value};

use super::MotionRun;
use super::record::{LimitUse, MotionRecord, PartRecord};

/// Points per drawn curve.
const POINTS: usize = 1500;

impl MotionRun {
    /// The page as HTML: parts, limits and their use, positions, velocities and loads over time.
    ///
    /// # Errors
    /// [`PageError`](dynid_config::fault::PageError).
    pub fn report(&self) -> Result<String, Error> {
        let record = &self.record;
        let status = if record.warnings.is_empty() { report::Status::Ok } else { report::Status::Warn };
        let warning = |message: &String| report::Warning { message: message.clone(), hint: String::new() };
        let mut charts = vec![
            self.chart("position", "rad or m", |s, k| &s.q[k..]),
            self.chart("velocity", "rad/s or m/s", |s, k| &s.dq[k..]),
            self.chart("acceleration", "rad/s² or m/s²", |s, k| &s.ddq[k..]),
        ];
        if !self.channels.is_empty() {
            let curves = self.channels.iter().map(|(name, values)| self.curve(name, values));
            charts.push(chart("load", "N m or N", curves.collect()));
        }
        let introduction = "Position, velocity and acceleration keep their limits at every instant, between samples too. Efforts, the \
                            floor, surroundings and the robot's own links were not looked at.";
        let data = report::StudyReport {
            title: format!("Motion for {}", short_name(&record.robot)),
            verdict: report::Verdict {
                status,
                headline: record.headline.clone(),
                ..report::Verdict::default()
            },
            warnings: record.warnings.iter().map(warning).collect(),
            introduction: vec![introduction.to_owned()],
            rows: Vec::new(),
            sections: vec![
                StudySection {
                    title: "Parts".to_owned(),
                    facts: vec![
                        Fact::new("duration", record.duration_s, "s"),
                        Fact::new("rate", record.sample_rate_hz, "Hz"),
                    ],
                    tables: vec![parts(record)],
                    ..StudySection::default()
                },
                StudySection {
                    title: "Limits and their use".to_owned(),
                    tables: vec![limits(&record.limits)],
                    ..StudySection::default()
                },
                StudySection { title: "Motion".to_owned(), charts, ..StudySection::default() },
            ],
            provenance: report::Provenance {
                version: VERSION.to_owned(),
                inputs: record.provenance.inputs.iter().map(dynid_config::provenance::shown).collect(),
                ..report::Provenance::default()
            },
        };
        dynid_config::fault::page(report::render_kind("Motion", &data))
    }

    fn chart(&self, title: &str, unit: &str, of: fn(&Sampled, usize) -> &[f64]) -> Chart {
        let samples = self.sampled.samples();
        let curves = self
            .record
            .joints
            .iter()
            .enumerate()
            .map(|(k, joint)| self.curve(joint, &of(&self.sampled, k * samples)[..samples]));
        chart(title, unit, curves.collect())
    }

    /// A curve of few points: of every stretch of samples the least and the greatest value, so that no peak is lost.
    fn curve(&self, name: &str, values: &[f64]) -> ChartCurve {
        let time = &self.sampled.time;
        let stretch = values.len().div_ceil(POINTS / 2).max(1);
        let mut points = Vec::with_capacity(POINTS + 2);
        for (k, part) in values.chunks(stretch).enumerate() {
            let place = |of: fn(&f64, &f64) -> bool| {
                (0..part.len()).fold(0, |best, i| if of(&part[i], &part[best]) { i } else { best })
            };
            let (least, most) = (place(|a, b| a < b), place(|a, b| a > b));
            let mut ends = vec![least.min(most), least.max(most)];
            ends.dedup();
            points.extend(ends.into_iter().map(|i| [time[k * stretch + i], part[i]]));
        }
        ChartCurve { name: name.to_owned(), points, style: CurveStyle::Line }
    }
}

fn chart(title: &str, unit: &str, curves: Vec<ChartCurve>) -> Chart {
    let axis = |label: &str, unit: &str| ChartAxis {
        label: label.to_owned(),
        unit: unit.to_owned(),
        logarithmic: false,
    };
    Chart { title: title.to_owned(), x: axis("time", "s"), y: axis(title, unit), curves, ..Chart::default() }
}

fn parts(record: &MotionRecord) -> StudyTable {
    let row = |part: &PartRecord| {
        vec![
            Value::Count(part.number as u64),
            Value::Text(part.name.clone()),
            Value::Text(part.joint.clone().unwrap_or_default()),
            Value::Count(part.repeat as u64),
            Value::Number(part.from_s),
            Value::Number(part.to_s),
            Value::Count(part.passes.len() as u64),
            Value::Number(part.slowed),
        ]
    };
    let head =
        ["Number", "Part", "Joint", "Times", "From, s", "To, s", "Constant speeds", "Slower than asked for"];
    StudyTable {
        caption: "Number: column `part` of the table of samples; ways between parts have 0".to_owned(),
        head: head.map(str::to_owned).to_vec(),
        rows: record.parts.iter().map(row).collect(),
    }
}

fn limits(uses: &[LimitUse]) -> StudyTable {
    let row = |limit: &LimitUse| {
        vec![
            Value::Text(limit.joint.clone()),
            Value::Text(limit.quantity.to_string()),
            Value::Number(limit.lower),
            Value::Number(limit.upper),
            Value::Number(limit.least),
            Value::Number(limit.most),
            Value::Number(100.0 * limit.used),
        ]
    };
    let head = ["Joint", "Quantity", "Lower limit", "Upper limit", "Least", "Greatest", "Used, %"];
    StudyTable {
        caption: "Of positions: of half the range, about its middle".to_owned(),
        head: head.map(str::to_owned).to_vec(),
        rows: uses.iter().map(row).collect(),
    }
}
