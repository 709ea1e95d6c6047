//! `dynid inspect`.

use std::fmt::Write;

use dynid::config::LogConfig;
use dynid::inspect::{
    ClearanceRow, Inspection, LogColumn, LogInspection, LoopsInspection, MotorRow, inspect, inspect_log,
};
use dynid::io::MappingSpec;
use dynid::io::log::Missing;
use dynid_terminal::message::{Failure, Notes, data, json};
use dynid_terminal::progress::Progress;

use super::{element_names, load_robot, table};
use crate::args::InspectArgs;

pub(crate) fn run(args: &InspectArgs) -> Result<u8, Failure> {
    if dynid::io::log::is_log(&args.robot.robot) {
        return log(args);
    }
    let robot = load_robot(&args.robot)?;
    let progress = Progress::new(args.print.quiet);
    progress.doing("finding base parameters");
    let inspection = inspect(&robot, element_names(args.elements.as_deref()).as_deref())?;
    drop(progress);
    match args.print.json {
        true => json(&inspection)?,
        false => {
            Notes::new(args.print.quiet).warnings(&inspection.warnings);
            data(&text(&inspection))?;
        }
    }
    Ok(0)
}

fn log(args: &InspectArgs) -> Result<u8, Failure> {
    let robot = &args.robot;
    let of_robots = [
        ("--elements", args.elements.is_some()),
        ("--floating-base", robot.floating_base),
        ("--couple-mimics", robot.couple_mimics),
        ("--lock", !robot.lock.is_empty()),
        ("--gravity", robot.gravity.is_some()),
    ];
    if let Some((flag, _)) = of_robots.into_iter().find(|(_, given)| *given) {
        let text = format!("{flag}: expected a robot file, found the log {}", robot.robot.display());
        return Err(Failure::Usage(text, "leave the flag out: a log has no such setting"));
    }
    let progress = Progress::new(args.print.quiet);
    progress.doing("reading");
    let config = LogConfig { path: robot.robot.clone(), ..LogConfig::default() };
    // Whatever is there is shown: no value is missed.
    let columns = MappingSpec { missing: Some(Missing::Drop), ..MappingSpec::default() };
    let found = inspect_log(&config, &columns)?;
    drop(progress);
    match args.print.json {
        true => json(&found)?,
        false => {
            Notes::new(args.print.quiet).warnings(&found.warnings);
            data(&text_of_log(&found))?;
        }
    }
    Ok(0)
}

fn text_of_log(found: &LogInspection) -> String {
    let length = found.duration_s.map_or_else(String::new, |s| format!(", {} s", table::number(Some(s))));
    let mut out = format!("{}: {} rows{length}\n", found.log, found.rows);
    for note in &found.notes {
        let _ = writeln!(out, "  {}: {} ({})", note.setting, note.value, note.reason);
    }
    let row = |c: &LogColumn| {
        vec![
            c.name.clone(),
            c.signal.clone().unwrap_or_else(|| "-".to_owned()),
            c.values.to_string(),
            table::number(c.rate_hz),
            table::number(c.longest_gap_s),
            c.out_of_order.map_or_else(|| "-".to_owned(), |n| n.to_string()),
            table::number(c.least),
            table::number(c.greatest),
        ]
    };
    let rows: Vec<Vec<String>> = found.columns.iter().map(row).collect();
    let header =
        ["column", "signal", "values", "rate Hz", "longest gap s", "out of order", "least", "greatest"];
    out.push('\n');
    out.push_str(&table::aligned(&header, &rows));
    if !found.texts.is_empty() {
        let _ = writeln!(out, "\ntexts: {}", found.texts.join(", "));
    }
    out
}

fn text(i: &Inspection) -> String {
    let mut out = String::new();
    let _ = writeln!(
        out,
        "{}: {} moving joints on `{}`, gravity {:?} m/s²\n",
        i.robot,
        i.joints.len(),
        i.base_link,
        i.gravity
    );
    let rows: Vec<Vec<String>> = i
        .joints
        .iter()
        .map(|j| {
            vec![
                j.number.to_string(),
                j.name.clone(),
                j.kind.to_string(),
                j.parent.clone(),
                j.link.clone(),
                table::number(j.mass),
                j.elements.join(","),
            ]
        })
        .collect();
    out.push_str(&table::aligned(&["#", "joint", "kind", "parent", "link", "mass kg", "elements"], &rows));
    if !i.motors.is_empty() {
        let flags = |m: &MotorRow| {
            let all = [(m.cubic, "cubic"), (m.damping, "damped"), (m.sensor, "sensor")];
            let on = all.into_iter().filter(|(on, _)| *on).map(|(_, word)| word);
            on.collect::<Vec<_>>().join(",")
        };
        let row = |m: &MotorRow| {
            let (ratio, elements) = (m.ratio.to_string(), m.elements.join(","));
            vec![m.number.to_string(), m.name.clone(), m.joint.clone(), ratio, flags(m), elements]
        };
        let rows: Vec<Vec<String>> = i.motors.iter().map(row).collect();
        out.push('\n');
        out.push_str(&table::aligned(&["#", "motor", "drives", "ratio", "spring", "elements"], &rows));
    }
    if !i.clearances.is_empty() {
        out.push_str(&clearances(&i.clearances));
    }
    if let Some(found) = &i.loops {
        out.push_str(&loops(found));
    }
    let (kept, dropped) = i.rank_gap;
    let gap = dropped.map_or_else(|| "full rank".to_owned(), |d| format!("gap {kept:.1e} to {d:.1e}"));
    let _ = writeln!(
        out,
        "\n{} base parameters out of {} standard ones ({gap}); numbers in symbols are those of the joints",
        i.base_parameter_count, i.standard_parameters
    );
    let width = i.base_parameters.iter().map(|b| b.name.chars().count()).max().unwrap_or(0);
    for (k, b) in i.base_parameters.iter().enumerate() {
        let pad = " ".repeat(width - b.name.chars().count());
        let _ = writeln!(out, "{:4}  {}{pad}  {}  [{}]", k + 1, b.name, b.expression, b.unit);
    }
    if !i.ties.is_empty() {
        let _ = writeln!(out, "\ntied: {}", i.ties.join(", "));
    }
    if !i.never_seen.is_empty() {
        let _ = writeln!(out, "\nnever seen in any effort: {}", i.never_seen.join(", "));
    }
    out
}

/// Closed loops.
fn loops(found: &LoopsInspection) -> String {
    let mut out = format!(
        "\nloops: {} free motions, driven by {}; {:.2} from a singular pose at home (0: singular, at most 1)\n",
        found.mobility,
        found.driven.join(", "),
        found.singularity_at_home
    );
    let rows: Vec<Vec<String>> = found
        .closures
        .iter()
        .map(|c| {
            let forces = if c.determined { "determined" } else { "shared out" };
            let conditions = c.conditions.to_string();
            vec![c.name.clone(), c.kind.to_string(), c.between.join(" - "), conditions, forces.to_owned()]
        })
        .collect();
    out.push_str(&table::aligned(&["loop", "kind", "between", "conditions", "forces"], &rows));
    let _ = writeln!(
        out,
        "{} base parameters if the forces in the loops were measured too",
        found.base_parameters_with_multipliers
    );
    out
}

/// Joints with clearance, and their journals at rest.
fn clearances(rows: &[ClearanceRow]) -> String {
    let mut out = String::from("\njoints with clearance (at rest: all joints at zero, under gravity)\n");
    let header = [
        "joint",
        "gap µm",
        "journal mm",
        "bearing mm",
        "law",
        "friction",
        "load N",
        "penetration µm",
        "stiffness N/m",
        "swing Hz",
        "sample Hz",
    ];
    let cells: Vec<Vec<String>> = rows
        .iter()
        .map(|c| {
            let size = |x: f64, scale: f64| format!("{}", (x * scale * 1e6).round() / 1e6);
            let mut row = vec![
                c.joint.clone(),
                size(c.gap, 1e6),
                size(c.journal_radius, 1e3),
                size(c.bearing_radius, 1e3),
                c.law.to_string(),
                c.friction.to_string(),
            ];
            row.extend(match &c.at_rest {
                None => ["none", "-", "-", "-", "-"].map(str::to_owned),
                Some(r) => [
                    format!("{:.3}", r.load),
                    format!("{:.3}", r.penetration * 1e6),
                    format!("{:.3e}", r.stiffness),
                    format!("{:.1}", r.swing_hz),
                    format!("{:.0}", r.sample_rate_hz.ceil()),
                ],
            });
            row
        })
        .collect();
    out.push_str(&table::aligned(&header, &cells));
    for c in rows {
        for remark in c.at_rest.iter().flat_map(|r| &r.remarks) {
            let _ = writeln!(out, "{}: {remark}", c.joint);
        }
    }
    out
}
