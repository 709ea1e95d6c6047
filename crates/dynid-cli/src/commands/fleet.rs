//! `dynid fleet`, and `dynid reduce --manifest`.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use dynid::fleet::{
    CarriedByLog, ChangeRecord, FactorStore, FleetFile, FleetSettings, FleetStep, Outcome, PayloadRecord,
    RobotRecord, StoreReading, fleet, manifest,
};
use dynid::{Identification, reduce};
use dynid_terminal::message::{Failure, Notes, data, json};
use dynid_terminal::outputs;
use dynid_terminal::progress::Progress;
use serde_json::json;

use super::{Reading, table};
use crate::args::{FleetArgs, ReduceArgs, command_line};

/// Failures that are printed; all are in the folder.
const PRINTED: usize = 20;

/// Reduces the logs of a manifest into a folder.
pub(super) fn reduce(args: &ReduceArgs, list: &Path) -> Result<u8, Failure> {
    if !reduce::is_factor_file(&args.input) {
        return Err(Failure::Usage(
            format!(
                "{}: expected a factor file beside --manifest, whose recipe is followed",
                args.input.display()
            ),
            "learn a recipe first, on logs that stand for all: `dynid reduce arm.urdf --log some.csv --out type.factors`",
        ));
    }
    let entries = manifest(list)?;
    let entries: Vec<_> = match args.shard {
        Some((k, n)) => entries.into_iter().skip(k - 1).step_by(n).collect(),
        None => entries,
    };
    let recipe = reduce::read(&args.input)?.recipe().clone();
    let Reading { columns, motor_side, .. } =
        Reading::recorded(&args.reading, Some(&recipe.reading), &args.input)?;
    let store = FactorStore::create(&args.to.out, recipe, StoreReading { columns, motor_side })?;
    let progress = Progress::new(args.to.print.quiet);
    let done = AtomicUsize::new(0);
    let outcomes = store.reduce(&entries, &|entry, _| {
        progress.counted(done.fetch_add(1, Ordering::Relaxed) + 1, entries.len(), entry.log.clone());
    })?;
    drop(progress);
    let count = |of: fn(&Outcome) -> bool| outcomes.iter().filter(|o| of(o)).count();
    let reduced = count(|o| matches!(o, Outcome::Reduced));
    let known = count(|o| matches!(o, Outcome::Known));
    let failures: Vec<_> =
        outcomes.iter().filter_map(|o| if let Outcome::Failed(f) = o { Some(f) } else { None }).collect();
    if args.to.print.json {
        json(&json!({ "logs": entries.len(), "reduced": reduced, "known": known, "failures": failures }))?;
    } else {
        let mut out =
            format!("{} logs: {reduced} reduced, {known} known, {} failed\n", entries.len(), failures.len());
        for failure in failures.iter().take(PRINTED) {
            out += &format!("  {} ({}): {}: {}\n", failure.log, failure.robot, failure.code, failure.message);
        }
        if failures.len() > PRINTED {
            out += &format!("  and {} more: FOLDER/*/*.failed.json\n", failures.len() - PRINTED);
        }
        data(&out)?;
    }
    Notes::new(args.to.print.quiet).tell("`dynid fleet FOLDER` fits the fleet");
    // The recipe must not be the reason why nothing is left.
    Ok(u8::from(failures.len() == entries.len()))
}

pub(crate) fn run(args: &FleetArgs) -> Result<u8, Failure> {
    let settings = FleetSettings {
        between_robots: args.between_robots.clone(),
        between_logs: args.between_logs.clone(),
        covariates: args.covariates.clone(),
        false_discoveries: args.false_discoveries.unwrap_or(FleetSettings::default().false_discoveries),
    };
    let inputs: Vec<&Path> = args.folders.iter().map(PathBuf::as_path).collect();
    let files = ["fleet.json", "report.html", "type.json", "type.html"].map(|name| args.out.join(name));
    let set = outputs::prepare_folder(&files, &inputs, args.force)?;
    let progress = Progress::new(args.print.quiet);
    let found = fleet(&args.folders, &settings, &mut |step| progress.fleet(step))?;
    let mut file = found.file();
    if let Some(unknown) = args.robot.iter().find(|name| file.robots.iter().all(|r| r.name != **name)) {
        return Err(Failure::Usage(
            format!("--robot {unknown}: expected a robot of the fleet, found none of this name"),
            "`fleet.json` lists the robots",
        ));
    }
    file.provenance.command_line = command_line();
    file.provenance.revision = option_env!("DYNID_REVISION").map(str::to_owned);
    let page = found.report(&file)?;
    let all: Vec<String> = file.robots.iter().map(|r| r.name.clone()).collect();
    let pages = found.robot_pages(&file, if args.all_robots { &all } else { &args.robot })?;
    progress.fleet(FleetStep::Models);
    let of_type = found.type_model(&file)?;
    let stamped = |model: &Identification| {
        let mut estimate = found.estimate(model);
        estimate.provenance.command_line.clone_from(&file.provenance.command_line);
        estimate.provenance.revision.clone_from(&file.provenance.revision);
        estimate
    };
    let estimate = stamped(&of_type);
    let type_page = dynid::report_page(&of_type, &estimate)?;
    let with_pages: Vec<&RobotRecord> =
        file.robots.iter().filter(|r| pages.iter().any(|(name, _)| *name == r.name)).collect();
    let models = found.robot_models(&file, &with_pages, &of_type)?;
    let of_robots: Vec<(PathBuf, String)> = (pages.into_iter().zip(&models))
        .flat_map(|((name, page), model)| {
            let at = |kind: &str| args.out.join("robots").join(format!("{}.{kind}", file_name(&name)));
            [(at("html"), page), (at("json"), stamped(model).to_json())]
        })
        .collect();
    let names: Vec<PathBuf> = of_robots.iter().map(|(path, _)| path.clone()).collect();
    let more = match names.is_empty() {
        true => None,
        false => Some(outputs::prepare_folder(&names, &inputs, args.force)?),
    };
    drop(progress);
    let text = file.to_json();
    for (number, bytes) in [&text, &page, &estimate.to_json(), &type_page].into_iter().enumerate() {
        set.write(number, bytes.as_bytes())?;
    }
    let mut written = set.publish()?;
    if let Some(more) = more {
        for (number, (_, bytes)) in of_robots.iter().enumerate() {
            more.write(number, bytes.as_bytes())?;
        }
        written.extend(more.publish()?);
    }
    let notes = Notes::new(args.print.quiet);
    notes.warnings(&file.warnings);
    data(&if args.print.json { text } else { summary(&file) })?;
    notes.written(&written);
    notes.tell("`dynid export` puts `type.json`, or the JSON of a robot, into a robot file");
    Ok(0)
}

/// Name of the files of a robot: letters, digits, `-`, `_` and `.` stay, others are written as their number.
fn file_name(robot: &str) -> String {
    let kept = |c: char| match c {
        c if c.is_alphanumeric() || "-_.".contains(c) => c.to_string(),
        c => format!("~{:x}", u32::from(c)),
    };
    robot.chars().map(kept).collect()
}

/// A change with two digits of its standard deviation, three decimals at least.
fn with_deviation(size: f64, sd: f64) -> String {
    let decimals = if sd > 0.0 { (1.0 - sd.log10().floor()).clamp(3.0, 9.0) as usize } else { 3 };
    format!("{size:+.decimals$} ± {sd:.decimals$}")
}

/// What logs carried, by the first parameter of their link: the mass where efforts tell it.
fn carried(payload: &PayloadRecord) -> String {
    let Some(first) = payload.parameters.first() else {
        return format!("carried on {}: no effort tells anything of it\n", payload.link);
    };
    let sorted = |of: fn(&CarriedByLog) -> f64| {
        let mut all: Vec<f64> = payload.logs.iter().map(of).collect();
        all.sort_by(f64::total_cmp);
        all
    };
    let (differences, sds) = (sorted(|log| log.difference[0]), sorted(|log| log.sd[0]));
    match (differences.first(), differences.last(), sds.get(sds.len() / 2)) {
        (Some(least), Some(most), Some(sd)) => format!(
            "carried on {}: {} of single logs {} to {} {} from the mean of all, ± {} each\n",
            payload.link,
            first.name,
            table::number(Some(*least)),
            table::number(Some(*most)),
            first.unit,
            table::number(Some(*sd)),
        ),
        _ => String::new(),
    }
}

fn summary(file: &FleetFile) -> String {
    let changed: Vec<(&RobotRecord, &ChangeRecord)> =
        file.robots.iter().flat_map(|r| r.changes.iter().map(move |c| (r, c))).collect();
    let mut out = String::new();
    if !changed.is_empty() {
        let row = |(r, c): &(&RobotRecord, &ChangeRecord)| {
            vec![
                r.name.clone(),
                c.parameter.clone(),
                c.kind.to_string(),
                with_deviation(c.size, c.sd),
                c.date.text.clone(),
                format!("{:.0e}", c.p),
            ]
        };
        let rows: Vec<Vec<String>> = changed.iter().map(row).collect();
        out += &table::aligned(&["changed", "parameter", "kind", "size", "when (interval), UTC", "p"], &rows);
        out += "\n";
    }
    for robot in file.robots.iter().filter(|r| !r.stands_out.is_empty()) {
        let how: Vec<String> =
            robot.stands_out.iter().map(|o| format!("{} by {:+.1} sd", o.parameter, o.deviation)).collect();
        out += &format!("out of the spread: {}: {}\n", robot.name, how.join(", "));
    }
    for event in &file.events {
        out += &format!("at once, {}: {} robots\n", event.text, event.robots.len());
    }
    for failure in file.failures.iter().take(PRINTED) {
        out += &format!("failed: {} ({}): {}\n", failure.log, failure.robot, failure.message);
    }
    out += &file.payload.as_ref().map(carried).unwrap_or_default();
    out + &format!("{}: {}\n", file.status, file.headline)
}
