//! Arguments of commands about factors of logs.

use std::path::PathBuf;

use clap::{Args, ValueHint};

use super::{ForceArgs, PrintArgs, ReadingArgs};

/// Where factors go.
#[derive(Debug, Args)]
pub(crate) struct FactorsArgs {
    /// Factor file to write; `-`: standard output.
    #[arg(long, value_name = "FILE.factors", value_hint = ValueHint::AnyPath)]
    pub(crate) out: PathBuf,
    #[command(flatten)]
    pub(crate) force: ForceArgs,
    #[command(flatten)]
    pub(crate) print: PrintArgs,
}

#[derive(Debug, Args)]
pub(crate) struct ReduceArgs {
    /// Configuration or robot file, whose logs teach the recipe; or a factor file, whose recipe is followed.
    #[arg(value_hint = ValueHint::FilePath)]
    pub(crate) input: PathBuf,
    /// Log to reduce; repeat for several (default: those of the configuration).
    #[arg(long, value_name = "LOG", value_hint = ValueHint::FilePath)]
    pub(crate) log: Vec<PathBuf>,
    #[command(flatten)]
    pub(crate) reading: ReadingArgs,
    #[command(flatten)]
    pub(crate) to: FactorsArgs,
}

#[derive(Debug, Args)]
pub(crate) struct MergeArgs {
    /// Factor files; one of them may be `-`: standard input.
    #[arg(required = true, value_name = "FACTORS", value_hint = ValueHint::FilePath)]
    pub(crate) factors: Vec<PathBuf>,
    #[command(flatten)]
    pub(crate) to: FactorsArgs,
}

#[derive(Debug, Args)]
pub(crate) struct SolveArgs {
    /// Factor files, which are merged; one of them may be `-`: standard input.
    #[arg(required = true, value_name = "FACTORS", value_hint = ValueHint::FilePath)]
    pub(crate) factors: Vec<PathBuf>,
    /// Log to judge the result on; repeat for several. Without one nothing tells what the model does near reversals and at rest.
    #[arg(long = "validate", id = "log", value_name = "LOG", value_hint = ValueHint::FilePath)]
    pub(crate) validate: Vec<PathBuf>,
    #[command(flatten)]
    pub(crate) reading: ReadingArgs,
    /// Folder for estimate.json and report.html.
    #[arg(long, value_name = "FOLDER", default_value = "dynid-out", value_hint = ValueHint::DirPath)]
    pub(crate) out: PathBuf,
    #[command(flatten)]
    pub(crate) force: ForceArgs,
    #[command(flatten)]
    pub(crate) print: PrintArgs,
}
