//! `dynid gains`.

use dynid::Config;
use dynid::gains::{GainsFile, JointGain, identify_gains};
use dynid::record::Status;
use dynid_terminal::message::{Failure, Notes, data, json};
use dynid_terminal::progress::Progress;

use super::table;
use crate::args::GainsArgs;

pub(crate) fn run(args: &GainsArgs) -> Result<u8, Failure> {
    let config = Config::read(&args.input)?;
    let progress = Progress::new(args.print.quiet);
    let found = identify_gains(&config, &mut |step| progress.step(step))?;
    let file = found.file();
    drop(progress);
    let notes = Notes::new(args.print.quiet);
    notes.warnings(&file.warnings);
    match args.print.json {
        true => json(&file)?,
        false => data(&summary(&file))?,
    }
    if let Some(hint) = one_scale(&file) {
        notes.tell(&hint);
    }
    Ok(u8::from(file.status == Status::Fail))
}

/// Where gains stay open: all drives together tell one scale, since the masses are the same for all.
fn one_scale(file: &GainsFile) -> Option<String> {
    let open: Vec<&str> = file.joints.iter().filter(|j| j.gain.is_none()).map(|j| j.joint.as_str()).collect();
    (!open.is_empty()).then(|| {
        format!(
            "no gain of {}: `dynid identify` of the same logs with `known_mass = {{ {:?} = {} }}`, and `[[payload]]` without `mass`, tells one scale of all drives",
            open.join(", "),
            file.payload,
            file.mass
        )
    })
}

fn summary(file: &GainsFile) -> String {
    let head =
        ["joint", "stated", "gain", "std", "from", "to", "unit", "t", "left %", "plain LS", "TLS", "verdict"];
    let rows: Vec<Vec<String>> = file.joints.iter().map(row).collect();
    format!(
        "payload {} of {} kg; known: {}\n{}",
        file.payload,
        file.mass,
        file.known,
        table::aligned(&head, &rows)
    )
}

fn row(j: &JointGain) -> Vec<String> {
    vec![
        j.joint.clone(),
        table::number(Some(j.stated)),
        table::number(j.gain),
        table::number(j.std),
        table::number(j.interval.map(|i| i.0)),
        table::number(j.interval.map(|i| i.1)),
        j.unit.clone(),
        format!("{:.1}", j.t),
        format!("{:.1}", 100.0 * j.share),
        table::number(j.plain_least_squares),
        table::number(j.total_least_squares),
        j.verdict.clone(),
    ]
}
