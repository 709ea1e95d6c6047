//! The configuration as a commented text.

use std::path::Path;

use dynid_logs::columns::{ColumnUse, TimeSource};
use dynid_logs::log::{DecimalMark, Missing};

use super::columns::names;
use super::toml_text::quoted;
use super::{DraftSettings, Reading, SHORTEST_TO_SPLIT, TRAINING_SHARE};
use crate::elements::DEFAULTS;
use crate::log::{Log, LogAxis};
use crate::logs::mapping_of;
use crate::robot::Robot;

/// Columns named in comments.
const SHOWN: usize = 8;

/// Lines of a text.
struct Page(String);

impl Page {
    fn line(&mut self, text: impl AsRef<str>) {
        self.0.push_str(text.as_ref());
        self.0.push('\n');
    }

    /// `key = value  # why`.
    fn entry(&mut self, key: &str, value: &str, why: &str) {
        let why = why.replace(['\n', '\r'], " ");
        self.line(if why.is_empty() {
            format!("{key} = {value}")
        } else {
            format!("{key} = {value}  # {why}")
        });
    }
}

/// The configuration of a robot and logs that were read so; `loaded`: the first log, if it could be read.
pub(super) fn write(
    settings: &DraftSettings,
    robot: &Robot,
    reading: &Reading,
    loaded: Option<&Log>,
) -> String {
    let mut page = Page(String::new());
    page.line(
        "# Configuration of a dynid run. What was found out has its reason beside it; change what is wrong.",
    );
    if !reading.open.is_empty() {
        page.line("# Lines with `..` wait for what the logs do not tell: fill them in and take the `#` in front away.");
    }
    page.line("");
    page.entry("robot", &quoted(&shown(&settings.robot, settings)), "");
    page.entry("out", "\"dynid-out\"", "folder for estimate.json, report.html and the updated robot file");
    page.line("");
    columns(&mut page, &robot.axes, reading, loaded);
    elements(&mut page, robot);
    logs(&mut page, settings, loaded);
    page.0
}

/// A path as the configuration has it.
fn shown(path: &Path, settings: &DraftSettings) -> String {
    let relative = match &settings.folder {
        None => path.to_owned(),
        Some(folder) => match path.strip_prefix(folder) {
            Ok(within) => within.to_owned(),
            Err(_) => std::path::absolute(path).unwrap_or_else(|_| path.to_owned()),
        },
    };
    relative.display().to_string()
}

fn columns(page: &mut Page, axes: &[LogAxis], reading: &Reading, loaded: Option<&Log>) {
    page.line("[columns]");
    for note in loaded.iter().flat_map(|l| &l.source.notes) {
        page.line(format!("# {}: {} ({})", note.setting, note.value, note.reason));
    }
    for question in &reading.open {
        page.line(format!("# {}", question.text));
        page.line(format!("# {}", question.line));
    }
    let spec = &reading.spec;
    if let Some(list) = &spec.names {
        let list: Vec<String> = list.iter().map(|n| quoted(n)).collect();
        page.entry("names", &format!("[{}]", list.join(", ")), "the log has no header");
    }
    if let Some(mark) = spec.decimal {
        let mark = if mark == DecimalMark::Comma { "\",\"" } else { "\".\"" };
        page.entry("decimal", mark, "");
    }
    if !spec.ignore.is_empty() {
        let list: Vec<String> = spec.ignore.iter().map(|n| quoted(n)).collect();
        page.entry("ignore", &format!("[{}]", list.join(", ")), "");
    }
    if spec.allow_unlogged {
        let held = loaded.map(|l| l.not_logged(axes).join(", ")).unwrap_or_default();
        page.entry("allow_unlogged", "true", &format!("held at zero: {held}"));
    }
    match loaded {
        Some(loaded) => signals(page, reading, loaded),
        None => page.line("# The other columns are found once these lines are filled in."),
    }
    page.line("");
}

fn signals(page: &mut Page, reading: &Reading, loaded: &Log) {
    let (spec, mapping) = (&reading.spec, mapping_of(loaded));
    let is_open = |key: &str| reading.open.iter().any(|q| q.key == key);
    match &mapping.time {
        TimeSource::Rate(hz) if spec.rate_hz.is_some() => {
            page.entry("rate_hz", &hz.to_string(), "no time column")
        }
        TimeSource::Columns(time) if !is_open("time") => {
            let list: Vec<String> = time.parts.iter().map(|p| quoted(&p.name)).collect();
            let why =
                loaded.source.notes.iter().find(|n| n.setting == "time").map_or("", |n| n.reason.as_str());
            match time.parts.as_slice() {
                [one] => {
                    page.entry("time", &format!("{{ columns = {}, {} }}", list[0], unit_of(one, TIME)), why)
                }
                parts => {
                    let scale: Vec<String> = parts.iter().map(|p| format!("{:?}", p.factor)).collect();
                    let value = format!(
                        "{{ columns = [{}], unit = \"s\", scale = [{}] }}",
                        list.join(", "),
                        scale.join(", ")
                    );
                    page.entry("time", &value, why);
                }
            }
        }
        _ => {}
    }
    let order = if numbered(&mapping.position, &mapping.joints) {
        format!("numbered columns, taken in the order {}", mapping.joints.join(", "))
    } else {
        mapping.joints.join(", ")
    };
    let why = reading.degrees.clone().unwrap_or(order);
    page.entry("position", &signal(&mapping.position, loaded, POSITION), &why);
    if let Some(velocity) = &mapping.velocity {
        page.entry(
            "velocity",
            &signal(velocity, loaded, VELOCITY),
            "a second source beside the positions; used by the pre-flight",
        );
    }
    if let Some(gains) = &spec.current_gains {
        let list: Vec<String> = gains.iter().map(|g| format!("{g:?}")).collect();
        let of = mapping
            .effort
            .iter()
            .flatten()
            .flatten()
            .map(|c| c.name.as_str())
            .take(SHOWN)
            .collect::<Vec<_>>();
        page.entry(
            "current_gains",
            &format!("[{}]", list.join(", ")),
            &format!("N m/A, of {}", of.join(" ")),
        );
    } else if let (Some(effort), false) = (&mapping.effort, is_open("current_gains")) {
        let why = "no unit is said: N m (N of sliding joints); the pre-flight judges the size";
        let stated = effort.iter().flatten().any(|c| c.factor != 1.0);
        page.entry("effort", &signal(effort, loaded, EFFORT), if stated { "" } else { why });
    }
    match spec.missing.unwrap_or(mapping.missing) {
        Missing::Error => {}
        policy => {
            let word = if policy == Missing::Drop { "\"drop\"" } else { "\"interpolate\"" };
            let why = loaded.source.notes.iter().find(|n| n.setting == "missing values");
            page.entry("missing", word, why.map_or("", |n| n.reason.as_str()));
        }
    }
}

/// Whether columns have numbers in place of the names of their joints.
fn numbered(columns: &[Option<ColumnUse>], joints: &[String]) -> bool {
    columns.iter().zip(joints).any(|(c, joint)| c.as_ref().is_some_and(|c| !c.name.contains(joint.as_str())))
}

/// Units by their factors.
type KnownUnits = &'static [(&'static str, f64)];
const DEGREE: f64 = std::f64::consts::PI / 180.0;
const TIME: KnownUnits = &[("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9)];
const POSITION: KnownUnits = &[("SI", 1.0), ("deg", DEGREE), ("rev", std::f64::consts::TAU), ("mm", 1e-3)];
const VELOCITY: KnownUnits = &[
    ("SI", 1.0),
    ("deg/s", DEGREE),
    ("rev/s", std::f64::consts::TAU),
    ("rpm", std::f64::consts::TAU / 60.0),
];
const EFFORT: KnownUnits = &[("SI", 1.0), ("mN m", 1e-3), ("kN m", 1e3)];

/// `unit = ".."`, or `unit = "s", scale = ..`.
fn unit_of(column: &ColumnUse, known: KnownUnits) -> String {
    match known.iter().find(|(_, factor)| *factor == column.factor) {
        Some((unit, _)) => format!("unit = \"{unit}\""),
        None => format!("unit = \"{}\", scale = {:?}", known[0].0, column.factor),
    }
}

/// A signal as the configuration states it: names alone where they are in SI.
fn signal(columns: &[Option<ColumnUse>], loaded: &Log, known: KnownUnits) -> String {
    let value = names(columns, mapping_of(loaded));
    let uses: Vec<&ColumnUse> = columns.iter().flatten().collect();
    if uses.iter().all(|c| c.factor == 1.0 && c.offset == 0.0) {
        // A unit in the brackets of a name is said already.
        return value;
    }
    let shared =
        uses.first().filter(|first| uses.iter().all(|c| c.factor == first.factor && c.offset == 0.0));
    if let Some((unit, _)) = shared.and_then(|c| known.iter().find(|(_, factor)| *factor == c.factor)) {
        return format!("{{ columns = {value}, unit = \"{unit}\" }}");
    }
    let list = |of: fn(&ColumnUse) -> f64, without: f64| {
        let numbers: Vec<String> =
            columns.iter().map(|c| format!("{:?}", c.as_ref().map_or(without, of))).collect();
        format!("[{}]", numbers.join(", "))
    };
    let offset = match uses.iter().any(|c| c.offset != 0.0) {
        true => format!(", offset = {}", list(|c| c.offset, 0.0)),
        false => String::new(),
    };
    format!("{{ columns = {value}, unit = \"SI\", scale = {}{offset} }}", list(|c| c.factor, 1.0))
}

fn elements(page: &mut Page, robot: &Robot) {
    page.line("[elements]");
    if robot.elements.defaults.is_empty() && robot.elements.per_joint.is_empty() {
        let list: Vec<String> = DEFAULTS.iter().map(|d| format!("\"{d}\"")).collect();
        page.entry("default", &format!("[{}]", list.join(", ")), "the robot file states none");
    } else {
        page.line("# The robot file states them.");
    }
    page.line("# friction = \"auto\"  # shapes beside them are found on held-out data");
    page.line("");
}

fn logs(page: &mut Page, settings: &DraftSettings, loaded: Option<&Log>) {
    let path = |k: usize| quoted(&shown(&settings.logs[k], settings));
    let count = settings.logs.len();
    let entry = |page: &mut Page, section: &str, k: usize, part: Option<(f64, f64, &str)>| {
        page.line(format!("[[{section}]]"));
        page.entry("path", &path(k), "");
        if let Some((from, to, why)) = part {
            page.entry("part", &format!("[{from:?}, {to:?}]"), why);
        }
        page.line("");
    };
    if count > 1 {
        for k in 0..count - 1 {
            entry(page, "log", k, None);
        }
        page.line("# The last log is kept: what the model predicts for it is the honest measure.");
        entry(page, "validation", count - 1, None);
        return;
    }
    let seconds = loaded.map(|l| l.log.time()).and_then(|t| Some(t.last()? - t.first()?));
    if seconds.is_some_and(|s| s < SHORTEST_TO_SPLIT) {
        page.line("# Too short to keep a part for validation: record another log for `[[validation]]`.");
        entry(page, "log", 0, None);
        return;
    }
    entry(page, "log", 0, Some((0.0, TRAINING_SHARE, "the first part is identified from")));
    entry(page, "validation", 0, Some((TRAINING_SHARE, 1.0, "the rest is predicted; another log is better")));
}
