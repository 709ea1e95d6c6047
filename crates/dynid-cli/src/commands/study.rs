//! `dynid study`.

use std::path::PathBuf;

use dynid_studies::{RunSettings, StudyError, StudyRecord, list, run as run_study};

use crate::args::StudyArgs;
use crate::message::{Failure, Notes, data, json};
use crate::outputs;
use crate::progress::Progress;

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
    let set = outputs::prepare_folder(&files, &[], args.force)?;
    let progress = Progress::new(args.print.quiet);
    let settings = RunSettings { quick: args.quick, seed: args.seed };
    let study =
        run_study(&args.name, &settings, &mut |step| progress.counted(step.done, step.steps, step.step))
            .map_err(failure)?;
    drop(progress);
    let page = dynid::report::render_study(&study.report)
        .map_err(dynid::fault::PageError::from)
        .map_err(dynid::Error::from)?;
    let text = study.record.to_json();
    set.write(0, text.as_bytes())?;
    set.write(1, page.as_bytes())?;
    let written = set.publish()?;
    data(&if args.print.json { text } else { summary(&study.record) })?;
    Notes::new(args.print.quiet).written(&written);
    Ok(u8::from(!study.record.pass))
}

fn list_studies(args: &StudyArgs) -> Result<u8, Failure> {
    if args.print.json {
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

fn summary(record: &StudyRecord) -> String {
    let mut out = String::new();
    for row in &record.rows {
        let verdict = match row.pass {
            Some(true) => "ok",
            Some(false) => "FAIL",
            None => "-",
        };
        let seed = if row.depends_on_seed { " (depends on the seed)" } else { "" };
        out += &format!("[{verdict:>4}] {:>2}  {}{seed}\n", row.id, row.claim);
        out += &format!("           required: {}\n", row.required);
        out += &format!("           measured: {}\n", row.words);
        if let Some(cause) = &row.cause {
            out += &format!("           cause: {cause}\n");
        }
    }
    out + &format!("\n{}\n", record.verdict().headline)
}
