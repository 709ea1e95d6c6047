//! The report page.

use dynid_config::pages::settings_table;
use dynid_identify::Error;
use dynid_report as report;
use dynid_report::{Chart, ChartAxis, ChartCurve, CurveStyle, Fact, StudyTable, Value};
use dynid_servo::{Channel, ServoLog, Term};

use super::config::ServoConfig;
use super::record::{ServoFile, ServoParameterRecord, ServoVerdict};
use super::{ServoResult, simulated};

/// Points of a drawn curve.
const POINTS: usize = 600;

/// Time of a log that is drawn, s.
const SHOWN_S: f64 = 12.0;

impl ServoResult {
    /// The report as one HTML page.
    ///
    /// # Errors
    /// [`PageError`](dynid_config::fault::PageError).
    pub fn report(&self, file: &ServoFile) -> Result<String, Error> {
        let p = &file.provenance;
        let shown = self.validation.first().or(self.logs.first());
        let curves = shown.map(|log| simulated(&self.found, log));
        // Efforts are shown of the first log that measures any.
        let with_efforts = self.validation.iter().chain(&self.logs).find(|log| {
            let channels = [Channel::Effort, Channel::Current];
            (0..log.joints()).any(|j| channels.into_iter().any(|c| log.measured(c, j).is_some()))
        });
        let efforts = with_efforts.map(|log| simulated(&self.found, log).effort);
        let mut sections = Vec::with_capacity(file.joints.len());
        for (j, joint) in file.joints.iter().enumerate() {
            let slides = self.robot.mechanism.effort_units().get(j) == Some(&"N");
            let unit = if slides { "m" } else { "rad" };
            let mut charts = match (shown, &curves) {
                (Some(log), Some(curves)) => charts(log, &curves.reading[j], j, unit),
                _ => Vec::new(),
            };
            if let (Some(log), Some(efforts)) = (with_efforts, &efforts) {
                charts.extend(self.effort_chart(log, &efforts[j], j));
            }
            sections.push(section(file, j, joint, unit, charts));
        }
        dynid_config::fault::page(report::render_joints(&report::JointsReport {
            kind: "Drives from commands and positions".to_owned(),
            title: format!("Drives of {}", file.robot),
            verdict: report::Verdict {
                status: file.status.into(),
                headline: file.headline.clone(),
                ..report::Verdict::default()
            },
            warnings: file
                .warnings
                .iter()
                .map(|w| report::Warning { message: w.clone(), hint: String::new() })
                .collect(),
            robot: report::Robot {
                name: file.robot.clone(),
                file: Some(self.robot.path.display().to_string()),
                ..report::Robot::default()
            },
            introduction: introduction(file),
            counted: None,
            overview: Some(whole(file)),
            joints: sections,
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
                seed: None,
                settings: settings_table(
                    &p.settings,
                    &serde_json::to_value(ServoConfig::default()).unwrap_or_default(),
                ),
            },
        }))
    }
}

impl ServoResult {
    /// Measured effort of a joint beside that of the simulation, as the sensor would read it.
    fn effort_chart(&self, log: &ServoLog, effort: &[f64], j: usize) -> Option<Chart> {
        let joint = &self.found.values.joints[j];
        let slides = self.robot.mechanism.effort_units().get(j) == Some(&"N");
        let (channel, unit, scale, zero) = match log.measured(Channel::Effort, j) {
            Some(_) => (Channel::Effort, if slides { "N" } else { "N m" }, 1.0, joint.get(Term::EffortZero)),
            None => (Channel::Current, "A", joint.get(Term::TorqueConstant), joint.get(Term::CurrentZero)),
        };
        let measured = log.measured(channel, j)?;
        let read: Vec<f64> = effort.iter().map(|e| e / scale + zero).collect();
        let all = [("measured", measured), ("simulated", &read)];
        Some(chart(
            log,
            (format!("{} in {}", capitalised(channel.name()), log.name), String::new()),
            (channel.name(), unit),
            &all,
        ))
    }
}

fn capitalised(word: &str) -> String {
    let mut letters = word.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

fn introduction(file: &ServoFile) -> Vec<String> {
    let bodies = if file.bodies.is_empty() {
        "the bodies of the robot file"
    } else {
        "bodies that deviate from those of the robot file as far as held-out folds ask for it"
    };
    let soft = file.joints.iter().any(|j| of_gear(file, j).is_some());
    let gears = if soft {
        " Gears give way: a drive moves its rotor with all friction, and the link is moved by what the spring of its gear carries behind the backlash."
    } else {
        ""
    };
    let hangs = if file.fit.efforts.iter().any(|e| e.rms.is_some()) {
        "Efforts or currents were measured, and are met together with the positions, each weighted by its own noise."
    } else {
        "No effort was measured: everything in N m hangs on the masses of the robot file and on stated gains."
    };
    vec![
        format!(
            "The robot is simulated in closed loop along the logged commands: `τ = k_p (s u + z - q) - k_d v` behind a delay, against rotor \
             inertia, friction and {bodies}.{gears} The parameters are those whose simulation gives the measured positions."
        ),
        format!(
            "Intervals are those of a jackknife over blocks of time, widened by what a value moves by with the step of the simulation, \
             without a fold of the logs, under richer laws and under other stated gains. {hangs}"
        ),
    ]
}

fn text(value: impl Into<String>) -> Value {
    Value::Text(value.into())
}

/// What is told of the whole robot.
fn whole(file: &ServoFile) -> report::JointSection {
    let f = &file.fit;
    let rms = |v: &[f64]| (v.iter().map(|x| x * x).sum::<f64>() / v.len().max(1) as f64).sqrt();
    let horizons = StudyTable {
        caption: "Error of rollouts that begin from measured states again and again, RMS".to_owned(),
        head: std::iter::once("Horizon".to_owned()).chain(file.joints.iter().cloned()).collect(),
        rows: f
            .horizons
            .iter()
            .map(|h| {
                let name = h.horizon_s.map_or("whole log".to_owned(), |s| format!("{s} s"));
                std::iter::once(text(name)).chain(h.rms.iter().map(|x| Value::from(*x))).collect()
            })
            .chain([row("encoder's rounding", &f.floor), row("command as prediction", &f.command_rms)])
            .chain(f.robot_file_rms.iter().map(|r| row("robot file as it came", r)))
            .collect(),
    };
    let logs = f
        .by_log
        .iter()
        .map(|l| (l, "identification"))
        .chain(file.validation.iter().map(|l| (l, "validation")));
    let by_log = StudyTable {
        caption: "RMS by log, whole rollouts".to_owned(),
        head: ["Log", "Part"].into_iter().map(str::to_owned).chain(file.joints.iter().cloned()).collect(),
        rows: logs
            .map(|(l, part)| {
                let rms = l.rms.iter().map(|x| Value::from(*x));
                [text(l.log.clone()), text(part)].into_iter().chain(rms).collect()
            })
            .collect(),
    };
    let efforts = StudyTable {
        caption: "Measured efforts beside simulated ones".to_owned(),
        head: [
            "Joint",
            "Measured",
            "Unit",
            "Verdict",
            "RMS",
            "Explained, %",
            "Size over that of positions alone",
        ]
        .map(str::to_owned)
        .to_vec(),
        rows: f
            .efforts
            .iter()
            .map(|e| {
                vec![
                    text(e.joint.clone()),
                    text(e.channel.clone()),
                    text(e.unit.clone()),
                    text(e.verdict.word()),
                    Value::from(e.rms),
                    Value::from(100.0 * e.explained),
                    Value::from(e.ratio),
                ]
            })
            .collect(),
    };
    let trials = StudyTable {
        caption: "Additions to the law on held-out folds: error over that without it".to_owned(),
        head: ["Beside", "Addition", "Fold 1", "Fold 2", "Fold 3", "Taken"].map(str::to_owned).to_vec(),
        rows: file
            .law
            .trials
            .iter()
            .map(|t| {
                let beside = if t.beside.is_empty() { "-".to_owned() } else { t.beside.join(", ") };
                let mut row = vec![text(beside), text(t.addition.clone())];
                row.extend(t.ratios.iter().map(|r| Value::from(*r)));
                row.resize(5, Value::Undefined);
                row.push(text(if t.taken { "yes" } else { "no" }));
                row
            })
            .collect(),
    };
    let directions = StudyTable {
        caption: "Directions of encoders: error with the other direction over that with this one".to_owned(),
        head: ["Joint", "Direction", "Other"].map(str::to_owned).to_vec(),
        rows: file
            .law
            .directions
            .iter()
            .map(|d| vec![text(d.joint.clone()), Value::from(d.direction), Value::from(d.other)])
            .collect(),
    };
    let groups = StudyTable {
        caption: "Parameters that are known together only".to_owned(),
        head: ["Kind", "Members", "What would part them"].map(str::to_owned).to_vec(),
        rows: file
            .groups
            .iter()
            .map(|g| vec![text(g.kind.word()), text(g.members.join("; ")), text(g.remedy.clone())])
            .collect(),
    };
    let tables = [horizons, by_log, bodies(file), efforts, trials, body_trials(file), directions, groups]
        .into_iter()
        .filter(|t| !t.rows.is_empty())
        .collect();
    report::JointSection {
        name: "Whole robot".to_owned(),
        status: file.status.into(),
        state: String::new(),
        facts: vec![
            Fact::new("RMS over whole rollouts", 1e3 * rms(&f.rms), "mrad or mm"),
            Fact::new("command as prediction", 1e3 * rms(&f.command_rms), "mrad or mm"),
            Fact::new("RMS over the encoders' rounding", f.misfit, ""),
            Fact::new("law", law(file), ""),
            Fact::new("step of the simulation", file.simulation.step_s, "s"),
            Fact::new("fit", format!("{}, {} steps", f.ending, f.iterations), ""),
        ],
        notes: Vec::new(),
        tables,
        curves: None,
        surface: None,
        charts: Vec::new(),
    }
}

/// What was found of the bodies, parameter by parameter.
fn bodies(file: &ServoFile) -> StudyTable {
    let rows = file.bodies.iter().flat_map(|body| {
        body.parameters.iter().map(|p| {
            vec![
                text(body.link.clone()),
                text(p.name.clone()),
                Value::from(p.file),
                Value::from(p.value),
                Value::interval(p.interval),
                text(p.unit.clone()),
                text(if p.told { "yes" } else { "follows the robot file" }),
            ]
        })
    });
    StudyTable {
        caption: "Bodies about their joint frames".to_owned(),
        head: ["Link", "Parameter", "Robot file", "Found", "95 % interval", "Unit", "Told by the logs"]
            .map(str::to_owned)
            .to_vec(),
        rows: rows.collect(),
    }
}

fn body_trials(file: &ServoFile) -> StudyTable {
    StudyTable {
        caption:
            "Pull towards the bodies of the robot file on held-out folds: error over that with these bodies"
                .to_owned(),
        head: ["Pull", "Fold 1", "Fold 2", "Fold 3", "Taken"].map(str::to_owned).to_vec(),
        rows: file
            .law
            .bodies
            .iter()
            .map(|t| {
                let mut row = vec![Value::from(t.pull)];
                row.extend(t.ratios.iter().map(|r| Value::from(*r)));
                row.resize(4, Value::Undefined);
                row.push(text(if t.taken { "yes" } else { "no" }));
                row
            })
            .collect(),
    }
}

fn law(file: &ServoFile) -> String {
    let plain = "rotor inertia, viscous and Coulomb friction, delay";
    let gears = file.joints.iter().filter(|j| of_gear(file, j).is_some());
    let gears: Vec<&str> = gears.map(String::as_str).collect();
    let mut out = plain.to_owned();
    if !gears.is_empty() {
        out += &format!("; gears that give way: {}", gears.join(", "));
    }
    if !file.law.additions.is_empty() {
        out += &format!("; {}", file.law.additions.join(", "));
    }
    out
}

/// Compliance of a joint's gear that was found to give way.
fn of_gear<'a>(file: &'a ServoFile, joint: &str) -> Option<&'a ServoParameterRecord> {
    let is =
        |p: &&ServoParameterRecord| p.term == Term::Compliance.name() && p.joints.iter().any(|j| j == joint);
    file.parameters.iter().find(is)
}

fn row(name: &str, values: &[f64]) -> Vec<Value> {
    std::iter::once(text(name)).chain(values.iter().map(|x| Value::from(*x))).collect()
}

fn section(file: &ServoFile, j: usize, joint: &str, unit: &str, charts: Vec<Chart>) -> report::JointSection {
    let own: Vec<&ServoParameterRecord> =
        file.parameters.iter().filter(|p| p.joints.iter().any(|n| n == joint)).collect();
    let table = StudyTable {
        caption: "Parameters".to_owned(),
        head: [
            "Parameter",
            "Value",
            "95 % interval",
            "Unit",
            "Verdict",
            "Over the position gain",
            "Moves by",
        ]
        .map(str::to_owned)
        .to_vec(),
        rows: own.iter().map(|p| parameter(p)).collect(),
    };
    let worst = own
        .iter()
        .any(|p| matches!(p.verdict, ServoVerdict::Unstable | ServoVerdict::AtBound | ServoVerdict::NotSeen));
    let f = &file.fit;
    let mut facts = vec![
        Fact::new("RMS over whole rollouts", f.rms.get(j).copied(), unit),
        Fact::new("command as prediction", f.command_rms.get(j).copied(), unit),
        Fact::new("encoder's rounding", f.floor.get(j).copied(), unit),
    ];
    if let Some(gear) = of_gear(file, joint) {
        let stiffness = if unit == "m" { "N/m" } else { "N m/rad" };
        facts.push(Fact::new("stiffness of the gear", 1.0 / gear.value, stiffness));
    }
    report::JointSection {
        name: joint.to_owned(),
        status: if worst { report::Status::Warn } else { report::Status::Ok },
        state: String::new(),
        facts,
        notes: Vec::new(),
        tables: vec![table],
        curves: None,
        surface: None,
        charts,
    }
}

fn parameter(p: &ServoParameterRecord) -> Vec<Value> {
    let shared = if p.joints.len() > 1 { " (shared)" } else { "" };
    let interval = Value::interval(p.interval);
    let ratio = p.per_gain.map_or(Value::Undefined, |(r, h)| text(format!("{r:.5} ± {h:.5}")));
    let s = p.spread;
    let moves = [
        ("law", s.law),
        ("step", s.step),
        ("folds", s.folds),
        ("gain", s.gain),
        ("reading", s.reading),
        ("knowledge", s.knowledge),
    ];
    let moves: Vec<String> =
        moves.iter().filter(|(_, x)| *x > 0.0).map(|(name, x)| format!("{name} {x:.2e}")).collect();
    vec![
        text(p.term.clone() + shared),
        Value::from(p.value),
        interval,
        text(p.unit.clone()),
        text(p.verdict.word()),
        ratio,
        text(moves.join(", ")),
    ]
}

fn charts(log: &ServoLog, simulated: &[f64], j: usize, unit: &str) -> Vec<Chart> {
    let (command, position) = (&log.command[j], &log.position[j]);
    let less = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<f64>>();
    let (of_command, of_simulation) = (less(position, command), less(position, simulated));
    vec![
        chart(
            log,
            (
                format!("Position in {}", log.name),
                "One rollout from the first row, nothing corrected on the way.".to_owned(),
            ),
            ("position", unit),
            &[("command", command), ("measured", position), ("simulated", simulated)],
        ),
        chart(
            log,
            (
                "Errors of prediction".to_owned(),
                "Measured less command, and measured less simulated.".to_owned(),
            ),
            ("error", unit),
            &[("command as prediction", &of_command), ("simulation", &of_simulation)],
        ),
    ]
}

/// Values of the first part of a log over time.
fn chart(
    log: &ServoLog,
    (title, note): (String, String),
    (label, unit): (&str, &str),
    curves: &[(&str, &[f64])],
) -> Chart {
    let start = log.time[0];
    let rows: Vec<usize> = (0..log.rows()).filter(|k| log.time[*k] - start <= SHOWN_S).collect();
    let every = rows.len().div_ceil(POINTS).max(1);
    let curve = |(name, values): &(&str, &[f64])| ChartCurve {
        name: (*name).to_owned(),
        points: rows.iter().step_by(every).map(|k| [log.time[*k] - start, values[*k]]).collect(),
        style: CurveStyle::Line,
    };
    let axis = |label: &str, unit: &str| ChartAxis {
        label: label.to_owned(),
        unit: unit.to_owned(),
        logarithmic: false,
    };
    Chart {
        title,
        note,
        x: axis("time", "s"),
        y: axis(label, unit),
        equal_units: false,
        curves: curves.iter().map(curve).collect(),
    }
}
