//! The program `dynid-studies`, to which `dynid study` hands over: every claim of a published paper beside what is measured here.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Command, FromArgMatches};
use dynid_studies::{RunSettings, StudyError, StudyRecord, run as run_study};
use dynid_terminal::message::{Failure, Notes, data, end};
use dynid_terminal::outputs;
use dynid_terminal::progress::Progress;
use dynid_terminal::study::{PROGRAM, StudyArgs, VERSION, list};

fn main() -> ExitCode {
    ExitCode::from(end(arguments().map(|args| run(&args))))
}

/// Arguments are those of `dynid study`.
fn arguments() -> Result<StudyArgs, clap::Error> {
    let program = StudyArgs::augment_args(Command::new(PROGRAM)).version(VERSION).about(
        "Published systems, every claim of their papers beside what is measured here; `dynid study` runs it.",
    );
    StudyArgs::from_arg_matches(&program.try_get_matches()?)
}

fn run(args: &StudyArgs) -> Result<u8, Failure> {
    if args.asks_for_list() {
        return list(args.print).map(|()| 0);
    }
    let published = args.published()?;
    let out = args.out.clone().unwrap_or_else(|| PathBuf::from(format!("dynid-study-{}", published.name)));
    let files = ["study.json", "report.html"].map(|name| out.join(name));
    let set = outputs::prepare_folder(&files, &[], args.force)?;
    let progress = Progress::new(args.print.quiet);
    let settings = RunSettings { quick: args.quick, seed: args.seed };
    let study =
        run_study(published.name, &settings, &mut |step| progress.counted(step.done, step.steps, step.step))
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
