//! The pages: one of the fleet, one of every robot that asks for one.

use dynid_config::pages::settings_table;
use dynid_report as report;
use dynid_report::{Chart, ChartAxis, ChartCurve, CurveStyle, Fact, StudyTable, Value};

use super::FleetResult;
use super::record::{CarriedByLog, FleetFile, RobotRecord, RobotState};
use crate::Error;

/// Seconds of a day.
const DAY: f64 = 86_400.0;
/// Failures that the page lists.
const LISTED: usize = 200;
/// Logs whose payload the page lists, and parameters of each: mass and first moments where efforts tell them.
const HEAVIEST: (usize, usize) = (20, 4);

fn text(value: impl Into<String>) -> Value {
    Value::Text(value.into())
}

fn head(words: &[&str]) -> Vec<String> {
    words.iter().map(|w| (*w).to_owned()).collect()
}

fn table(caption: &str, words: &[&str], rows: Vec<Vec<Value>>) -> StudyTable {
    StudyTable { caption: caption.to_owned(), head: head(words), rows }
}

/// Three digits.
fn short(x: f64) -> String {
    if x == 0.0 || (1e-3..1e4).contains(&x.abs()) {
        let digits = (2 - x.abs().max(1e-3).log10().floor() as i32).clamp(0, 6) as usize;
        format!("{x:.digits$}")
    } else {
        format!("{x:.2e}")
    }
}

impl FleetResult {
    /// The page of the fleet as HTML.
    ///
    /// # Errors
    /// [`PageError`](crate::fault::PageError).
    pub fn report(&self, file: &FleetFile) -> Result<String, Error> {
        let named = file.robots.iter().enumerate().filter(|(_, r)| r.state != RobotState::Usual);
        let sections = named.map(|(r, _)| self.section(file, r)).collect();
        let headline = (file.headline.clone(), file.status.into());
        self.page(file, format!("Fleet of {}", file.robot_type), headline, self.overview(file), sections)
    }

    /// Names and pages of the robots that have changed or stand out, and of those that are asked for.
    ///
    /// # Errors
    /// [`PageError`](crate::fault::PageError).
    pub fn robot_pages(&self, file: &FleetFile, asked: &[String]) -> Result<Vec<(String, String)>, Error> {
        let wanted = |r: &RobotRecord| r.state != RobotState::Usual || asked.contains(&r.name);
        let pages = file.robots.iter().enumerate().filter(|(_, r)| wanted(r));
        pages
            .map(|(r, robot)| {
                let title = format!("{} of the fleet of {}", robot.name, file.robot_type);
                let section = self.section(file, r);
                let headline = (headline(robot), section.status);
                Ok((
                    robot.name.clone(),
                    self.page(file, title, headline, self.values(file, r), vec![section])?,
                ))
            })
            .collect()
    }

    fn page(
        &self,
        file: &FleetFile,
        title: String,
        (headline, status): (String, report::Status),
        overview: report::JointSection,
        joints: Vec<report::JointSection>,
    ) -> Result<String, Error> {
        let p = &file.provenance;
        crate::fault::page(report::render_joints(&report::JointsReport {
            kind: "Fleet".to_owned(),
            title,
            verdict: report::Verdict { status, headline, ..report::Verdict::default() },
            warnings: file
                .warnings
                .iter()
                .map(|w| report::Warning { message: w.clone(), hint: String::new() })
                .collect(),
            robot: report::Robot { name: file.robot_type.clone(), ..report::Robot::default() },
            introduction: introduction(),
            overview: Some(overview),
            joints,
            counted: Some(format!("{} robots, {} logs", file.robots.len(), self.fleet.logs.len())),
            provenance: report::Provenance {
                version: p.version.clone(),
                inputs: Vec::new(),
                seed: None,
                settings: settings_table(
                    &p.settings,
                    &serde_json::to_value(super::FleetSettings::default()).unwrap_or_default(),
                ),
            },
        }))
    }

    /// What is told of the whole fleet.
    fn overview(&self, file: &FleetFile) -> report::JointSection {
        let spreads = (file.parameters.iter())
            .filter(|p| p.between_robots.is_some() || p.between_logs.is_some())
            .map(|p| {
                vec![
                    text(p.name.clone()),
                    text(format!("{} ± {}", short(p.value), short(p.sd))),
                    text(p.unit.clone()),
                    Value::from(p.between_robots),
                    Value::from(p.between_logs),
                ]
            })
            .collect();
        let shared = (file.parameters.iter())
            .filter(|p| p.between_robots.is_none() && p.between_logs.is_none())
            .map(|p| {
                let seen = if p.seen { "seen" } else { "not seen" };
                vec![
                    text(p.name.clone()),
                    text(format!("{} ± {}", short(p.value), short(p.sd))),
                    text(p.unit.clone()),
                    text(seen),
                ]
            })
            .collect();
        let changes = (file.robots.iter())
            .flat_map(|r| r.changes.iter().map(move |c| (r, c)))
            .map(|(r, c)| {
                vec![
                    text(r.name.clone()),
                    text(c.parameter.clone()),
                    text(c.kind.word()),
                    text(format!("{} ± {}", short(c.size), short(c.sd))),
                    text(c.date.text.clone()),
                    Value::from(c.evidence),
                    text(format!("{:.1e}", c.p)),
                    text(c.hint.clone()),
                ]
            })
            .collect();
        let outliers = (file.robots.iter())
            .flat_map(|r| r.stands_out.iter().map(move |o| (r, o)))
            .map(|(r, o)| {
                vec![
                    text(r.name.clone()),
                    text(o.parameter.clone()),
                    Value::from(o.deviation),
                    text(format!("{:.1e}", o.p)),
                ]
            })
            .collect();
        let logs = (file.logs_to_look_at.iter())
            .map(|l| {
                let where_: Vec<String> = l
                    .parameters
                    .iter()
                    .take(4)
                    .map(|p| format!("{} by {:+.1} sd", p.parameter, p.deviation))
                    .collect();
                vec![text(l.log.clone()), text(l.robot.clone()), text(where_.join(", "))]
            })
            .collect();
        let slopes = (file.covariates.iter())
            .flat_map(|c| c.slopes.iter().map(move |s| (c, s)))
            .map(|(c, s)| {
                vec![
                    text(c.name.clone()),
                    text(s.parameter.clone()),
                    text(format!("{} ± {}", short(s.value), short(s.sd))),
                ]
            })
            .collect();
        let events =
            file.events.iter().map(|e| vec![text(e.text.clone()), text(e.robots.join(", "))]).collect();
        let failures = (file.failures.iter().take(LISTED))
            .map(|f| {
                vec![text(f.log.clone()), text(f.robot.clone()), text(f.code.word()), text(f.message.clone())]
            })
            .collect();
        let tables = [
            table(
                "Changes with time",
                &[
                    "Robot",
                    "Parameter",
                    "Kind",
                    "Size at the last log",
                    "When (interval), UTC",
                    "Evidence",
                    "p",
                    "Points to",
                ],
                changes,
            ),
            table("Changes of many robots at once", &["When, UTC", "Robots"], events),
            table(
                "Robots out of the spread of the fleet",
                &["Robot", "Parameter", "Deviation, sd between robots", "p"],
                outliers,
            ),
            table("Logs to look at", &["Log", "Robot", "Stands out in"], logs),
            table("Logs that failed", &["Log", "Robot", "Code", "What is wrong"], failures),
            self.map(file),
            self.carried(file),
            table(
                "Parameters that vary",
                &["Parameter", "Type", "Unit", "sd between robots", "sd between logs"],
                spreads,
            ),
            table("What parameters follow, per unit", &["Covariate", "Parameter", "Slope"], slopes),
            table("Parameters that all robots share", &["Parameter", "Type", "Unit", "Told by logs"], shared),
        ];
        report::JointSection {
            name: "Whole fleet".to_owned(),
            status: file.status.into(),
            facts: vec![
                Fact::new("robots", Value::Count(file.robots.len() as u64), ""),
                Fact::new("logs", Value::Count(self.fleet.logs.len() as u64), ""),
                Fact::new("logs that failed", Value::Count(file.failures.len() as u64), ""),
                Fact::new("logs there twice, counted once", Value::Count(file.repeated as u64), ""),
                Fact::new("recipe", text(file.recipe[..12].to_owned()), ""),
                Fact::new("sweeps", Value::Count(self.fit.settled.passes as u64), ""),
            ],
            tables: tables.into_iter().filter(|t| !t.rows.is_empty()).collect(),
            ..report::JointSection::default()
        }
    }

    /// What the logs that carried most carried.
    fn carried(&self, file: &FleetFile) -> StudyTable {
        let Some(payload) = &file.payload else { return table("", &[], Vec::new()) };
        let (most, parameters) = HEAVIEST;
        let mut logs: Vec<&CarriedByLog> = payload.logs.iter().collect();
        let first = |log: &CarriedByLog| log.difference.first().copied().unwrap_or(0.0);
        logs.sort_by(|a, b| first(b).total_cmp(&first(a)));
        let row = |log: &&CarriedByLog| {
            let values = log.difference.iter().zip(&log.sd).take(parameters);
            let values = values.map(|(value, sd)| text(format!("{} ± {}", short(*value), short(*sd))));
            [text(log.log.clone()), text(log.robot.clone())].into_iter().chain(values).collect()
        };
        let told = payload.parameters.iter().take(parameters);
        let head = ["Log".to_owned(), "Robot".to_owned()].into_iter();
        StudyTable {
            caption: format!(
                "Carried on {} beyond the mean of all logs: {} of {} that carried most, all are in fleet.json",
                payload.link,
                logs.len().min(most),
                logs.len()
            ),
            head: head.chain(told.map(|p| format!("{}, {}", p.name, p.unit))).collect(),
            rows: logs.iter().take(most).map(row).collect(),
        }
    }

    /// Robots against parameters: deviations from the type over the spread between robots.
    fn map(&self, file: &FleetFile) -> StudyTable {
        let mut heading = vec!["Robot".to_owned(), "State".to_owned(), "Logs".to_owned()];
        // What logs carry is no matter of the robot.
        let shown: Vec<usize> =
            (0..self.fleet.varying.len()).filter(|k| self.fleet.varying[*k].watched).collect();
        heading.extend(shown.iter().map(|k| self.name(*k)));
        let row =
            |r: &RobotRecord| {
                let mut row = vec![
                    text(r.name.clone()),
                    text(r.state.word().replace('_', " ")),
                    Value::Count(r.logs as u64),
                ];
                row.extend(shown.iter().map(|k| {
                    r.parameters[*k].deviation.map_or(Value::Undefined, |d| text(format!("{d:+.1}")))
                }));
                row
            };
        StudyTable {
            caption: "Robots: deviation from the type, in standard deviations between robots".to_owned(),
            head: heading,
            rows: file.robots.iter().map(row).collect(),
        }
    }

    /// Numbers of a robot.
    fn values(&self, file: &FleetFile, r: usize) -> report::JointSection {
        let robot = &file.robots[r];
        let rows = (robot.parameters.iter().enumerate())
            .map(|(k, p)| {
                vec![
                    text(p.name.clone()),
                    Value::from(p.value),
                    text(format!(
                        "{} to {}{}",
                        short(p.interval.0),
                        short(p.interval.1),
                        if p.cut_at_zero { ", cut at zero" } else { "" }
                    )),
                    text(self.unit(k)),
                    p.deviation.map_or(Value::Undefined, |d| text(format!("{d:+.1}"))),
                    Value::from(p.detectable),
                ]
            })
            .collect();
        report::JointSection {
            name: "Parameters".to_owned(),
            status: file.status.into(),
            tables: vec![table(
                "Parameters of the robot at the mean of the covariates",
                &[
                    "Parameter",
                    "Value",
                    "95 % interval",
                    "Unit",
                    "Deviation, sd between robots",
                    "Smallest step that would be found",
                ],
                rows,
            )],
            ..report::JointSection::default()
        }
    }

    /// A robot's state and time lines of what has changed or stands out; of the most deviating parameter otherwise.
    fn section(&self, file: &FleetFile, r: usize) -> report::JointSection {
        let robot = &file.robots[r];
        let mut shown: Vec<String> = robot
            .changes
            .iter()
            .map(|c| c.parameter.clone())
            .chain(robot.stands_out.iter().map(|o| o.parameter.clone()))
            .collect();
        if shown.is_empty() {
            let most = robot
                .parameters
                .iter()
                .max_by(|a, b| a.deviation.unwrap_or(0.0).abs().total_cmp(&b.deviation.unwrap_or(0.0).abs()));
            shown.extend(most.map(|p| p.name.clone()));
        }
        let mut seen = std::collections::BTreeSet::new();
        shown.retain(|name| seen.insert(name.clone()));
        let changes = (robot.changes.iter())
            .map(|c| {
                vec![
                    text(c.parameter.clone()),
                    text(c.kind.word()),
                    text(format!("{} ± {}", short(c.size), short(c.sd))),
                    text(c.date.text.clone()),
                    text(format!("{:.1e}", c.p)),
                    text(c.hint.clone()),
                ]
            })
            .collect::<Vec<_>>();
        let tables = vec![table(
            "Changes",
            &["Parameter", "Kind", "Size at the last log", "When (interval), UTC", "p", "Points to"],
            changes,
        )];
        let charts = shown.iter().take(4).filter_map(|name| self.time_line(r, name)).collect();
        report::JointSection {
            name: robot.name.clone(),
            status: if robot.state == RobotState::Usual { report::Status::Ok } else { report::Status::Warn },
            state: robot.state.word().replace('_', " "),
            facts: vec![
                Fact::new("logs", Value::Count(robot.logs as u64), ""),
                Fact::new(
                    "p of no change",
                    robot.p.map_or(text("history too short, or no dates"), |p| text(format!("{p:.1e}"))),
                    "",
                ),
            ],
            tables: tables.into_iter().filter(|t| !t.rows.is_empty()).collect(),
            charts,
            ..report::JointSection::default()
        }
    }

    /// A parameter log by log, the covariates taken out.
    fn time_line(&self, r: usize, name: &str) -> Option<Chart> {
        let k = (0..self.fleet.varying.len()).find(|k| self.name(*k) == name)?;
        let column = self.fleet.varying[k].column;
        let level = self.fit.robots[r].as_ref()?.values[column];
        let dated = self.drift.is_some();
        let mut logs: Vec<usize> =
            (0..self.fleet.logs.len()).filter(|l| self.fleet.logs[*l].robot == r).collect();
        logs.sort_by(|a, b| self.fleet.logs[*a].time_s.total_cmp(&self.fleet.logs[*b].time_s));
        let first = self.fleet.logs[*logs.first()?].time_s;
        let x =
            |at: usize, l: usize| if dated { (self.fleet.logs[l].time_s - first) / DAY } else { at as f64 };
        let points = |of: &dyn Fn(usize) -> f64| -> Vec<[f64; 2]> {
            logs.iter().enumerate().map(|(at, l)| [x(at, *l), of(*l)]).collect()
        };
        let value = |l: usize| level + self.fit.logs[l].deviation[k];
        let curve = |name: &str, style, points| ChartCurve { name: name.to_owned(), points, style };
        let unit = self.unit(k);
        Some(Chart {
            title: format!("{name} over time"),
            note: "A dot per log, with the effect of the covariates taken out; lines: twice its standard deviation either way; broken: the type.".to_owned(),
            x: match dated {
                true => ChartAxis { label: "time since the first log".to_owned(), unit: "d".to_owned(), logarithmic: false },
                false => ChartAxis { label: "log".to_owned(), ..ChartAxis::default() },
            },
            y: ChartAxis { label: name.to_owned(), unit, logarithmic: false },
            equal_units: false,
            curves: vec![
                curve("type", CurveStyle::Dashed, points(&|_| self.fit.values[column])),
                curve("lower", CurveStyle::Line, points(&|l| value(l) - 2.0 * self.fit.logs[l].deviation_sd[k])),
                curve("upper", CurveStyle::Line, points(&|l| value(l) + 2.0 * self.fit.logs[l].deviation_sd[k])),
                curve("log", CurveStyle::Dots, points(&value)),
            ],
        })
    }
}

/// A robot in a sentence.
fn headline(robot: &RobotRecord) -> String {
    let changes = robot.changes.iter().map(|c| format!("{} by {} ({})", c.parameter, short(c.size), c.kind));
    let outliers = robot
        .stands_out
        .iter()
        .map(|o| format!("{} by {:+.1} standard deviations", o.parameter, o.deviation));
    let list = |words: Vec<String>| words.join(", ");
    match robot.state {
        RobotState::Usual => format!("{}: like the others; no change was found.", robot.name),
        RobotState::StandsOut => {
            format!("{}: out of the spread of the fleet: {}.", robot.name, list(outliers.collect()))
        }
        RobotState::Changed => format!("{}: has changed: {}.", robot.name, list(changes.collect())),
        RobotState::SiteEvent => {
            format!("{}: has changed with many others at once: {}.", robot.name, list(changes.collect()))
        }
    }
}

fn introduction() -> Vec<String> {
    vec![
        "Every log was reduced by the same recipe. A mixed model fits all of them together: inertias are shared by the type, friction and \
         offsets differ between robots and scatter between the logs of a robot, and follow the numbers that the manifest states. A robot or a \
         log with few data leans on the others; one that stands out keeps its own estimate and does not widen the spread of the others."
            .to_owned(),
        "A change is a step or a ramp of one parameter against the scatter between the logs of the robot, with the covariates beside it. Of the \
         robots that are named at most the stated share has none. The scatter between logs is what it is: colour of the noise, motions, \
         model error and temperature that nobody stated are in it."
            .to_owned(),
    ]
}
