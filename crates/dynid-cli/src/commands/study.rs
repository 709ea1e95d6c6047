//! `dynid study`: hands over to the program `dynid-studies`.

use std::env::{self, consts::EXE_SUFFIX};
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;

use dynid_terminal::message::Failure;
use dynid_terminal::study::{PROGRAM, StudyArgs, VERSION, list};

/// How the program gets there.
const CURE: &str =
    "in a checkout `cargo build --release -p dynid-studies` builds it into target/release, beside dynid";

pub(crate) fn run(args: &StudyArgs) -> Result<u8, Failure> {
    if args.asks_for_list() {
        return list(args.print).map(|()| 0);
    }
    args.published()?;
    let program = find()?;
    demand_same_version(&program)?;
    // Behind the names of the program and of the command.
    let given: Vec<OsString> = env::args_os().skip(2).collect();
    become_it(Command::new(&program).args(given), &program)
}

/// The program beside this one, else on the path.
fn find() -> Result<PathBuf, Failure> {
    let name = format!("{PROGRAM}{EXE_SUFFIX}");
    let own = env::current_exe().ok().and_then(|dynid| Some(dynid.parent()?.to_owned()));
    let path = env::var_os("PATH").unwrap_or_default();
    let folders = own.iter().cloned().chain(env::split_paths(&path));
    folders.map(|folder| folder.join(&name)).find(|file| file.is_file()).ok_or_else(|| {
        let beside = own.map_or_else(|| "dynid".to_owned(), |folder| folder.display().to_string());
        Failure::Usage(
            format!("studies are run by the program {PROGRAM}, which is neither in {beside} nor on the path"),
            CURE,
        )
    })
}

/// Refuses a program of another version: it may know other arguments, or give other results.
fn demand_same_version(program: &Path) -> Result<(), Failure> {
    let output = Command::new(program).arg("--version").output().map_err(|e| unusable(program, &e))?;
    let told = String::from_utf8_lossy(&output.stdout);
    let found = match told.trim().strip_prefix(PROGRAM).unwrap_or(&told).trim() {
        "" => "none",
        found => found,
    };
    match found == VERSION {
        true => Ok(()),
        false => Err(Failure::Usage(
            format!("{}: expected version {VERSION}, as dynid is, found {found}", program.display()),
            CURE,
        )),
    }
}

fn unusable(program: &Path, error: &std::io::Error) -> Failure {
    Failure::Usage(format!("{}: {error}", program.display()), CURE)
}

/// Runs the program in the place of this one, so that streams, signals and exit code are its own.
#[cfg(unix)]
fn become_it(command: &mut Command, program: &Path) -> Result<u8, Failure> {
    use std::os::unix::process::CommandExt;
    Err(unusable(program, &command.exec()))
}

/// Runs the program on the streams of this one, and gives its exit code.
#[cfg(not(unix))]
fn become_it(command: &mut Command, program: &Path) -> Result<u8, Failure> {
    let status = command.status().map_err(|e| unusable(program, &e))?;
    Ok(status.code().and_then(|code| u8::try_from(code).ok()).unwrap_or(2))
}
