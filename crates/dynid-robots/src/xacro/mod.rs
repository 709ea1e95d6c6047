//! xacro: robot files with macros, properties, conditions, included files and arguments, expanded to plain XML.
//!
//! What ROS's `xacro` does with the files of robots: `property` (computed when first used; lists, dictionaries and YAML by
//! `xacro.load_yaml`), `macro` with defaults and blocks, `if` / `unless`, `include` with `ns` and `optional`, `arg`, `insert_block`,
//! `element`, `attribute`, `call`, and `$(arg ..)`, `$(find ..)`, `$(env ..)`, `$(optenv ..)`, `$(eval ..)`, `$(cwd)`, `$(dirname)`.
//! Expressions are Python's arithmetic, comparisons, conditions, texts, lists, dictionaries, comprehensions, and the functions of `math`.
//! Functions of one's own (`lambda`), texts marked `f`, bits and sets are refused. Nothing of a file is run: work, depth and size
//! have bounds.

mod evaluate;
mod expand;
mod expression;
mod functions;
mod names;
mod packages;
mod symbols;
mod tags;
mod tree;
mod value;
mod yaml;

use std::path::Path;
use std::thread;

use dynid_files::SourceFile;
use dynid_files::excerpt::excerpt;

use crate::robot_error::{Place, RobotFileError};
use crate::xacro_fault::XacroFault;
use evaluate::Evaluation;
use names::{Failure, Names};
use value::Value;

/// Stack of an expansion, bytes: elements, macros and properties within each other are followed by recursion.
const STACK: usize = 64 << 20;

/// A file without macros.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Expanded {
    /// Plain XML.
    pub(crate) text: String,
    /// Files that were read besides the first one, in that order.
    pub(crate) included: Vec<SourceFile>,
}

/// Whether a text is to be expanded: its name ends in `.xacro`, or it has tags of xacro. Those in comments, which files that were expanded before
/// keep, are none.
pub(crate) fn is_xacro(text: &str, path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("xacro"))
        || (text.contains("<xacro:") && tree::has_tags(text))
}

/// Expands the text of a file; `arguments` is `name:=value,name:=value`, as it stands behind `#` in `FILE#ARGUMENTS`.
///
/// # Errors
/// [`RobotFileError::Xacro`]: the fault and its place; those of files that are included.
pub(crate) fn expand(text: &str, path: &Path, arguments: Option<&str>) -> Result<Expanded, RobotFileError> {
    let arguments = arguments.map_or(Ok(Vec::new()), split).map_err(|fault| RobotFileError::Xacro {
        at: Place::start(&path.display().to_string()).into(),
        fault: fault.into(),
    })?;
    let work = || expand::file(text, path, &arguments);
    // Where there are no threads the stack at hand must do.
    thread::scope(|scope| match thread::Builder::new().stack_size(STACK).spawn_scoped(scope, work) {
        Ok(thread) => thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)),
        Err(_) => expand::file(text, path, &arguments),
    })
}

/// Takes arguments apart. A value ends before a comma that another `name:=` follows.
fn split(text: &str) -> Result<Vec<(String, String)>, XacroFault> {
    let mut arguments: Vec<(String, String)> = Vec::new();
    for part in text.split(',') {
        match (part.split_once(":="), arguments.last_mut()) {
            (Some((name, value)), _) if is_name(name.trim()) => {
                arguments.push((name.trim().to_owned(), value.to_owned()));
            }
            (None, Some((_, value))) => {
                value.push(',');
                value.push_str(part);
            }
            _ => return Err(XacroFault::Arguments { found: excerpt(text) }),
        }
    }
    Ok(arguments)
}

/// Whether a text can name a property or an argument.
fn is_name(text: &str) -> bool {
    let starts = |c: char| c.is_alphabetic() || c == '_';
    text.starts_with(starts) && text.chars().all(|c| c.is_alphanumeric() || c == '_')
}

/// The value of an expression without names of its own, such as `pi / 2`.
fn constant(text: &str) -> Result<f64, String> {
    let expression = expression::parse(text)?;
    let value = Evaluation::new(&mut Nothing { depth: 0, spent: 0 }).value(&expression);
    match value.map(|value| value.number()) {
        Ok(Some(x)) => Ok(x),
        Ok(None) => Err(format!("expected a number, found `{}`", excerpt(text))),
        Err(Failure::Reason(reason)) => Err(reason),
        Err(Failure::Fault(fault)) => Err(fault.to_string()),
    }
}

/// Surroundings without names.
struct Nothing {
    depth: usize,
    spent: usize,
}

impl Names for Nothing {
    fn value(&mut self, _: &str) -> Result<Option<Value>, XacroFault> {
        Ok(None)
    }

    fn value_in(&mut self, _: usize, _: &str) -> Result<Option<Value>, XacroFault> {
        Ok(None)
    }

    fn argument(&mut self, name: &str) -> Result<Value, XacroFault> {
        Err(XacroFault::Argument { name: name.to_owned() })
    }

    fn yaml(&mut self, file: &str) -> Result<Value, XacroFault> {
        Err(XacroFault::File { file: file.to_owned(), reason: "it is not read within YAML".to_owned() })
    }

    fn path(&self, file: &str) -> String {
        file.to_owned()
    }

    fn enter(&mut self) -> Result<(), XacroFault> {
        self.depth += 1;
        match self.depth > expand::MAX_DEPTH {
            true => Err(XacroFault::TooMuch { what: "levels", limit: expand::MAX_DEPTH }),
            false => self.spend(1),
        }
    }

    fn leave(&mut self) {
        self.depth -= 1;
    }

    /// A scalar of a file, however it is written, makes few values: its length has a bound.
    fn spend(&mut self, values: usize) -> Result<(), XacroFault> {
        self.spent += values;
        match self.spent > value::MAX_WEIGHT {
            true => Err(XacroFault::TooMuch { what: "steps", limit: value::MAX_WEIGHT }),
            false => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::split;

    #[test]
    fn arguments_are_taken_apart() {
        let own = |text| split(text).unwrap();
        let pair = |a: &str, b: &str| (a.to_owned(), b.to_owned());
        assert_eq!(own("prefix:=left_"), [pair("prefix", "left_")]);
        assert_eq!(own("a:=1,b:=0 0 1,5, c:="), [pair("a", "1"), pair("b", "0 0 1,5"), pair("c", "")]);
        for bad in ["", "a", "a=1", "1a:=2", ":=2", "model"] {
            split(bad).unwrap_err();
        }
    }
}
