//! `dynid init`.

use std::io::{self, IsTerminal, Write};
use std::path::{Path, PathBuf};

use dynid::init::{Draft, DraftSettings, Question, draft};
use dynid::io::MappingSpec;
use dynid_terminal::message::{Failure, note};
use dynid_terminal::outputs::{self, is_stdout, marked_toml};

use super::apply_log_args;
use crate::args::InitArgs;

pub(crate) fn run(args: &InitArgs) -> Result<u8, Failure> {
    let to_stdout = is_stdout(&args.out);
    let inputs: Vec<&Path> = args.log.iter().chain([&args.robot]).map(PathBuf::as_path).collect();
    let outputs = outputs::prepare_files(&[("--out", args.out.as_path())], &inputs, args.force)?;
    let mut columns = MappingSpec::default();
    apply_log_args(&mut columns, &args.columns);
    let folder = args.out.parent().filter(|f| !to_stdout && !f.as_os_str().is_empty());
    let settings = DraftSettings {
        robot: args.robot.clone(),
        logs: args.log.clone(),
        columns,
        folder: folder.map(Path::to_owned),
    };
    let found = draft(&settings, &mut asked)?;
    outputs.write(0, marked_toml(&found.text).as_bytes())?;
    outputs.publish()?;
    if !args.quiet {
        tell(&found, &args.out, to_stdout);
    }
    Ok(u8::from(!found.open.is_empty()))
}

/// Asks on a terminal, again after what is no answer; elsewhere nobody answers.
fn asked(question: &Question) -> Option<String> {
    let stdin = io::stdin();
    if !stdin.is_terminal() || !io::stderr().is_terminal() {
        return None;
    }
    let mut err = io::stderr().lock();
    // A terminal that cannot be written to cannot ask.
    writeln!(err, "{}", question.text).ok()?;
    loop {
        write!(err, "  {} [Enter: leave open]: ", question.line).and_then(|()| err.flush()).ok()?;
        let mut answer = String::new();
        stdin.read_line(&mut answer).ok()?;
        if answer.trim().is_empty() || question.accepts(&answer) {
            return Some(answer);
        }
        writeln!(err, "  expected {}, found {}", question.expected, answer.trim()).ok()?;
    }
}

fn tell(found: &Draft, out: &Path, to_stdout: bool) {
    for line in &found.found {
        note(line);
    }
    if !to_stdout {
        note(&format!("written: {}", out.display()));
    }
    let config = if to_stdout { "FILE.toml".to_owned() } else { out.display().to_string() };
    if found.open.is_empty() {
        note(&format!("next: dynid check {config}"));
        return;
    }
    for question in &found.open {
        let at = found.text.lines().position(|line| line.strip_prefix("# ") == Some(question.line.as_str()));
        let place = at.map_or_else(String::new, |line| format!(" (line {})", line + 1));
        note(&format!("to fill in{place}: {}", question.line));
    }
    note(&format!("next: fill in these lines, then dynid check {config}"));
}
