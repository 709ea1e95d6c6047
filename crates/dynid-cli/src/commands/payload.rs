//! `dynid payload`.

use std::path::{Path, PathBuf};

use dynid::Config;
use dynid::payload::{PayloadFile, PayloadRecord, Quantity, identify_payloads};
use dynid::record::Status;
use dynid_terminal::message::{Failure, Notes, data};
use dynid_terminal::outputs::{self, marked_xml};
use dynid_terminal::progress::Progress;

use super::table;
use crate::args::PayloadArgs;

const DEFAULT_OUT: &str = "dynid-payload";

pub(crate) fn run(args: &PayloadArgs) -> Result<u8, Failure> {
    let config = Config::read(&args.input)?;
    let out = args.out.clone().unwrap_or_else(|| match &config.out {
        Some(folder) => folder.clone(),
        None => PathBuf::from(DEFAULT_OUT),
    });
    let mut files: Vec<PathBuf> = ["payload.json", "payload.html"].map(|name| out.join(name)).to_vec();
    files.extend(config.payload.iter().map(|p| out.join(format!("{}.urdf.part", file_name(&p.name)))));
    let logs = config.log.iter().chain(&config.validation).map(|log| log.path.as_path());
    let inputs: Vec<&Path> = logs.chain([args.input.as_path(), &config.robot]).collect();
    let set = outputs::prepare_folder(&files, &inputs, args.force)?;
    let progress = Progress::new(args.print.quiet);
    let found = identify_payloads(&config, &mut |step| progress.step(step))?;
    let file = found.file();
    let report = file.report()?;
    drop(progress);

    let text = file.to_json();
    let parts: Vec<String> = file.payloads.iter().map(|p| marked_xml(&p.urdf)).collect();
    for (number, text) in [&text, &report].into_iter().chain(&parts).enumerate() {
        set.write(number, text.as_bytes())?;
    }
    let written = set.publish()?;
    let notes = Notes::new(args.print.quiet);
    notes.warnings(&file.verdict.warnings);
    data(&if args.print.json { text } else { summary(&file) })?;
    notes.written(&written);
    Ok(u8::from(file.status == Status::Fail))
}

/// A name without what separates folders.
fn file_name(name: &str) -> String {
    name.replace(['/', '\\'], "_")
}

fn summary(file: &PayloadFile) -> String {
    let mut out: String = file.payloads.iter().map(payload).collect();
    if let Some(c) = &file.consistency {
        let chance = c.price_over_chance.map_or_else(String::new, |x| format!(", {x:.2} of chance"));
        out.push_str(&format!("price of feasibility: {:.2} residual variances{chance}\n", c.price));
    }
    for p in &file.log_parameters {
        let std = p.std.map_or_else(String::new, |s| format!(" ± {}", table::number(Some(s))));
        out.push_str(&format!("{} = {}{std} {}\n", p.name, table::number(Some(p.value)), p.unit));
    }
    out + &format!("{}: {}\n", file.status, file.headline)
}

fn payload(p: &PayloadRecord) -> String {
    let all = std::iter::once(&p.mass).chain(&p.com).chain(&p.inertia);
    let rows: Vec<Vec<String>> = all.map(row).collect();
    let head = ["quantity", "value", "unit", "std", "from", "to", "data %", "verdict"];
    let mut out = format!("{} on {} (joint frame, inertia about the centre of mass)\n", p.name, p.link);
    out.push_str(&table::aligned(&head, &rows));
    match &p.difference {
        Some(d) => out.push_str(&format!(
            "difference of two separate fits: {:.3} ± {:.3} kg, centre of mass {:.1} {:.1} {:.1} mm{}\n",
            d.mass,
            d.mass_std,
            1e3 * d.com[0],
            1e3 * d.com[1],
            1e3 * d.com[2],
            if d.feasible { "" } else { ", no body can have its inertia" }
        )),
        None => out.push_str("difference of two separate fits: the logs excite different parameters\n"),
    }
    out + &p.sentence + "\n"
}

fn row(q: &Quantity) -> Vec<String> {
    vec![
        q.name.clone(),
        table::number(Some(q.value)),
        q.unit.clone(),
        table::number(Some(q.std)),
        table::number(q.interval.map(|i| i.0)),
        table::number(q.interval.map(|i| i.1)),
        format!("{:.0}", 100.0 * q.share),
        if q.at_boundary { format!("{}, at the boundary", q.verdict) } else { q.verdict.to_string() },
    ]
}
