//! `dynid study`.

use std::path::PathBuf;

use dynid_studies::{RunSettings, StudyError, StudyRecord, list, run as run_study};

use crate::args::StudyArgs;
use crate::message::{Failure, data, json, note};
use crate::outputs;
use crate::progress::StudyProgress;

pub(crate) fn run(args: &StudyArgs) -> Result<u8, Failure> {
    if args.name == "list" {
        return list_studies(args);
    }
    if !list().iter().any(|s| s.name == args.name) {
        let known: Vec<&str> = list().iter().map(|s| s.name).collect();
        return Err(Failure::Usage(
            format!("no study `{}`; known: {}", args.name, known.join(", ")),
            "`dynid study list` says what each is about",
        ));
    }
    let out = args.out.clone().unwrap_or_else(|| PathBuf::from(format!("dynid-study-{}", args.name)));
    let files = ["study.json", "report.html"].map(|name| out.join(name));
    let set = outputs::prepare_folder(&files, &[])?;
    let progress = StudyProgress::new(args.quiet);
    let settings = RunSettings { quick: args.quick, seed: args.seed };
    let study = run_study(&args.name, &settings, &mut |step| progress.step(&step)).map_err(failure)?;
    drop(progress);
    let page = dynid::report::render_study(&study.report).map_err(dynid::Error::from)?;
    let text = study.record.to_json();
    set.write(0, text.as_bytes())?;
    set.write(1, page.as_bytes())?;
    set.publish()?;
    if !args.quiet {
        summary(&study.record);
        files.iter().for_each(|file| note(&format!("written: {}", file.display())));
    }
    if args.json {
        data(&text)?;
    }
    Ok(u8::from(!study.record.pass))
}

fn list_studies(args: &StudyArgs) -> Result<u8, Failure> {
    if args.json {
        let studies: Vec<_> = list()
            .iter()
            .map(|s| serde_json::json!({ "study": s.name, "title": s.title, "source": s.source }))
            .collect();
        json(&studies)?;
    } else {
        let text: String =
            list().iter().map(|s| format!("{:12} {}\n{:12} {}\n", s.name, s.title, "", s.source)).collect();
        data(&text)?;
    }
    Ok(0)
}

fn failure(error: StudyError) -> Failure {
    match error {
        StudyError::Dynid(error) => Failure::Input(error),
        other => Failure::Usage(other.to_string(), "this is a fault of the program, please report it"),
    }
}

fn summary(record: &StudyRecord) {
    for row in &record.rows {
        let verdict = match row.pass {
            Some(true) => "ok",
            Some(false) => "FAIL",
            None => "-",
        };
        let seed = if row.depends_on_seed { " (depends on the seed)" } else { "" };
        note(&format!("[{verdict:>4}] {:>2}  {}{seed}", row.id, row.claim));
        note(&format!("           required: {}", row.required));
        note(&format!("           measured: {}", row.words));
        if let Some(cause) = &row.cause {
            note(&format!("           cause: {cause}"));
        }
    }
    note(&format!("\n{}", record.verdict().headline));
}
