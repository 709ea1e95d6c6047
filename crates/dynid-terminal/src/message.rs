//! Messages for people, and how a run ends.

use std::borrow::Cow;
use std::io::{self, Write};
use std::path::PathBuf;

/// Why a command ended early.
#[derive(Debug)]
pub enum Failure {
    /// Bad input, with a hint.
    Input(Box<dynid::Error>),
    /// Bad usage that the argument parser cannot see: what is wrong, what to do about it.
    Usage(String, &'static str),
    /// The reader of our output has gone: not an error.
    Closed,
    /// Output cannot be written.
    Output(io::Error),
}

impl<E: Into<dynid::Error>> From<E> for Failure {
    fn from(error: E) -> Self {
        Failure::Input(Box::new(error.into()))
    }
}

/// The exit code of a program: what became of its command line, and of the command.
///
/// Help and version are asked for and go to stdout; the parser's exit code of misuse is 2.
pub fn end(outcome: Result<Result<u8, Failure>, clap::Error>) -> u8 {
    match outcome {
        Ok(Ok(code)) => code,
        Ok(Err(failure)) => failure.report(),
        Err(error) => {
            let code = u8::try_from(error.exit_code()).unwrap_or(2);
            let _ = error.print();
            code
        }
    }
}

impl Failure {
    /// Tells the user and gives the exit code.
    pub fn report(self) -> u8 {
        let (text, hint) = match self {
            Failure::Closed => return 0,
            Failure::Input(error) => (error.to_string(), error.hint()),
            Failure::Usage(text, hint) => (text, Some(hint.to_owned())),
            Failure::Output(error) => (format!("output: {error}"), None),
        };
        let mut err = io::stderr().lock();
        // Nothing is left to be done if stderr itself is gone.
        let _ = writeln!(err, "error: {}", printable(&text));
        if let Some(hint) = hint {
            let _ = writeln!(err, "hint: {}", printable(&hint));
        }
        2
    }
}

/// Writes text to stdout; a reader that has gone is no error.
pub fn data(text: &str) -> Result<(), Failure> {
    bytes(text.as_bytes())
}

/// Writes bytes to stdout; a reader that has gone is no error.
pub fn bytes(bytes: &[u8]) -> Result<(), Failure> {
    match while_read(bytes) {
        Err(Failure::Closed) => Ok(()),
        written => written,
    }
}

/// Writes bytes to stdout.
///
/// # Errors
/// [`Failure::Closed`] once nobody reads any more.
fn while_read(bytes: &[u8]) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    let written = out.write_all(bytes).and_then(|()| out.flush());
    written
        .map_err(|e| if e.kind() == io::ErrorKind::BrokenPipe { Failure::Closed } else { Failure::Output(e) })
}

/// What a command tells beside its result, on stderr; nothing if it was asked to be quiet.
#[derive(Debug, Clone, Copy)]
pub struct Notes {
    quiet: bool,
}

impl Notes {
    /// Notes, or none if the user asked for quiet.
    pub fn new(quiet: bool) -> Self {
        Notes { quiet }
    }

    /// Tells a line.
    pub fn tell(self, text: &str) {
        if !self.quiet {
            note(text);
        }
    }

    /// Tells what a user should know of the result.
    pub fn warnings<'a>(self, warnings: impl IntoIterator<Item = &'a String>) {
        warnings.into_iter().for_each(|warning| self.tell(&format!("warning: {warning}")));
    }

    /// Tells which files appeared.
    pub fn written(self, files: &[PathBuf]) {
        files.iter().for_each(|file| self.tell(&format!("written: {}", file.display())));
    }
}

/// Writes a line for people to stderr.
pub fn note(text: &str) {
    // A closed stderr is the user's choice.
    let _ = writeln!(io::stderr().lock(), "{}", printable(text));
}

/// A text whose control characters, but for ends of lines and tabs, are written out: names of files may hold codes that terminals obey.
fn printable(text: &str) -> Cow<'_, str> {
    let is_code = |c: char| c.is_control() && c != '\n' && c != '\t';
    if !text.contains(is_code) {
        return Cow::Borrowed(text);
    }
    let shown = |c: char| if is_code(c) { c.escape_default().to_string() } else { c.to_string() };
    Cow::Owned(text.chars().map(shown).collect())
}

/// Prints a value as a line of JSON.
pub fn json(value: &impl serde::Serialize) -> Result<(), Failure> {
    data(&line(value)?)
}

/// Prints a value as a line of JSON to somebody who may go at any time.
///
/// # Errors
/// [`Failure::Closed`] once nobody reads any more.
pub fn json_while_read(value: &impl serde::Serialize) -> Result<(), Failure> {
    while_read(line(value)?.as_bytes())
}

fn line(value: &impl serde::Serialize) -> Result<String, Failure> {
    let text = serde_json::to_string(value).map_err(|e| Failure::Output(e.into()))?;
    Ok(text + "\n")
}
