//! Arguments of commands about factors of logs.

use std::path::PathBuf;

use clap::{Args, ValueHint};

use super::{ForceArgs, PrintArgs, ReadingArgs};

/// Where factors go.
#[derive(Debug, Args)]
pub(crate) struct FactorsArgs {
    /// Factor file to write; `-`: standard output. With --manifest the folder of factors.
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
    /// Table of many logs, in place of --log: columns log, robot, start and numbers that hold for whole logs. Then --out is a folder; what is
    /// there is not made again.
    #[arg(long, value_name = "FILE.csv", value_hint = ValueHint::FilePath, conflicts_with_all = ["log", "rows"])]
    pub(crate) manifest: Option<PathBuf>,
    /// Every N-th log of the manifest, from the K-th on, for N processes that share the folder.
    #[arg(long, value_name = "K/N", value_parser = shard, requires = "manifest")]
    pub(crate) shard: Option<(usize, usize)>,
    /// Where a recipe is learned: give factors a column per effort for the rest of its delay, log by log, so that a fleet sees how delays differ
    /// and change.
    #[arg(long, conflicts_with = "manifest")]
    pub(crate) delays: bool,
    /// Where a recipe is learned: every log may carry something else on this link, so that a fleet tells what logs carry from what robots are.
    #[arg(long, value_name = "LINK", conflicts_with = "manifest")]
    pub(crate) payload: Option<String>,
    #[command(flatten)]
    pub(crate) reading: ReadingArgs,
    #[command(flatten)]
    pub(crate) to: FactorsArgs,
}

fn shard(text: &str) -> Result<(usize, usize), String> {
    let fault = || format!("expected K/N with 1 <= K <= N, found `{text}`");
    let (k, n) = text.split_once('/').ok_or_else(fault)?;
    match (k.parse(), n.parse()) {
        (Ok(k), Ok(n)) if 1 <= k && k <= n => Ok((k, n)),
        _ => Err(fault()),
    }
}

#[derive(Debug, Args)]
pub(crate) struct FleetArgs {
    /// Folder of factors, as `dynid reduce --manifest` fills it; repeat for several.
    #[arg(required = true, value_name = "FOLDER", value_hint = ValueHint::DirPath)]
    pub(crate) folders: Vec<PathBuf>,
    /// Parameters in which robots differ, by symbol or name (default: all of joints but the inertia of rotors).
    #[arg(long, value_name = "NAME,..", value_delimiter = ',')]
    pub(crate) between_robots: Option<Vec<String>>,
    /// Parameters in which logs of one robot differ (default: those in which robots differ).
    #[arg(long, value_name = "NAME,..", value_delimiter = ',')]
    pub(crate) between_logs: Option<Vec<String>>,
    /// Numbers of the manifest that parameters follow (default: all that every log states and that vary).
    #[arg(long, value_name = "NAME,..", value_delimiter = ',')]
    pub(crate) covariates: Option<Vec<String>>,
    /// Share of the robots named for a change that may have none, above 0 and below 1 (default: 0.05).
    #[arg(long, value_name = "SHARE", value_parser = share)]
    pub(crate) false_discoveries: Option<f64>,
    /// Robot that gets a page and a model of its own even if nothing is the matter; repeat for several.
    #[arg(long, value_name = "NAME")]
    pub(crate) robot: Vec<String>,
    /// A page and a model of every robot.
    #[arg(long, conflicts_with = "robot")]
    pub(crate) all_robots: bool,
    /// Folder for fleet.json, report.html, type.json, type.html, robots/NAME.html and robots/NAME.json.
    #[arg(long, value_name = "FOLDER", default_value = "dynid-fleet", value_hint = ValueHint::DirPath)]
    pub(crate) out: PathBuf,
    #[command(flatten)]
    pub(crate) force: ForceArgs,
    #[command(flatten)]
    pub(crate) print: PrintArgs,
}

fn share(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|x: &f64| *x > 0.0 && *x < 1.0);
    number.ok_or_else(|| format!("expected a share above 0 and below 1, found `{text}`"))
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
