//! Arguments of `dynid simulate`.

use std::path::PathBuf;

use clap::{Args, ValueHint};

use super::{ForceArgs, PrintArgs, RobotArgs};

#[derive(Debug, Args)]
pub(crate) struct SimulateArgs {
    #[command(flatten)]
    pub(crate) robot: RobotArgs,
    /// Settings of the virtual log, TOML.
    #[arg(long, value_name = "FILE.toml", value_hint = ValueHint::FilePath)]
    pub(crate) config: Option<PathBuf>,
    /// Let a controller move the robot, with all imperfections (default: inverse dynamics of the trajectory).
    #[arg(long)]
    pub(crate) closed_loop: bool,
    /// Follow a trajectory file, approach and return included: coefficients (`dynid design` writes them) or a table with loads,
    /// `.csv` or `.csv.gz` (`dynid motion` writes them).
    #[arg(long, value_name = "TRAJECTORY", value_hint = ValueHint::FilePath)]
    pub(crate) follow: Option<PathBuf>,
    /// Tell drives the positions of the trajectory, as `dynid servo` found them in its servo.json: the log holds commands and positions, no effort.
    #[arg(long, value_name = "SERVO.json", value_hint = ValueHint::FilePath, conflicts_with_all = ["closed_loop", "fleet"])]
    pub(crate) drives: Option<PathBuf>,
    /// Length, s.
    #[arg(long, value_name = "S", allow_negative_numbers = true, conflicts_with = "follow")]
    pub(crate) duration: Option<f64>,
    /// Sample rate, Hz.
    #[arg(long, value_name = "HZ", allow_negative_numbers = true)]
    pub(crate) rate_hz: Option<f64>,
    /// Noise of the effort, share of its rms.
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true)]
    pub(crate) effort_noise: Option<f64>,
    /// Encoder resolution, bits per turn; 0: exact.
    #[arg(long, value_name = "BITS")]
    pub(crate) encoder_bits: Option<u32>,
    /// Noise of the logged offsets of journals in their bearings (joints with clearance), m.
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    pub(crate) journal_noise: Option<f64>,
    /// A fleet of so many robots with so many logs each, by inverse dynamics: --out is a folder for logs, manifest.csv and truth.json. What
    /// robots differ in is `[fleet]` of --config.
    #[arg(long, value_name = "ROBOTSxLOGS", value_parser = robots_and_logs, conflicts_with_all = ["clean", "truth", "closed_loop"])]
    pub(crate) fleet: Option<(usize, usize)>,
    /// Seed of trajectory and noise.
    #[arg(long)]
    pub(crate) seed: Option<u64>,
    /// Output log, CSV or CSV.gz; `-`: standard output. Of a fleet a folder.
    #[arg(long, value_name = "FILE.csv", value_hint = ValueHint::AnyPath)]
    pub(crate) out: PathBuf,
    /// Also write the true states and efforts.
    #[arg(long, value_name = "FILE.csv", value_hint = ValueHint::AnyPath)]
    pub(crate) clean: Option<PathBuf>,
    /// Also write the true parameters, JSON.
    #[arg(long, value_name = "FILE.json", value_hint = ValueHint::AnyPath)]
    pub(crate) truth: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) force: ForceArgs,
    #[command(flatten)]
    pub(crate) print: PrintArgs,
}

fn robots_and_logs(text: &str) -> Result<(usize, usize), String> {
    let fault = || format!("expected ROBOTSxLOGS such as 20x10, found `{text}`");
    let (robots, logs) = text.split_once('x').ok_or_else(fault)?;
    match (robots.parse(), logs.parse()) {
        (Ok(robots), Ok(logs)) if robots > 0 && logs > 0 => Ok((robots, logs)),
        _ => Err(fault()),
    }
}
