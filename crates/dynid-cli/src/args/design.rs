//! Arguments of `dynid design`.

use std::path::PathBuf;

use clap::{Args, ValueEnum, ValueHint};
use dynid::design::next::Wanted;

use super::elements::with_elements;
use super::robot::joint_value;
use super::{ForceArgs, PlaybackArg, PrintArgs};

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum CriterionArg {
    /// Mean square of the relative standard deviations of the base parameters.
    RelativeStd,
    /// Condition number of the columns at unit length.
    UnitCondition,
    /// Condition number of the columns in SI units.
    Condition,
    /// w1 condition + w2 / smallest singular value.
    Mix,
    /// Mean variance.
    A,
    /// Determinant of the information.
    D,
    /// Smallest singular value.
    E,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum ColumnsArg {
    /// All base parameters: bodies, rotors, friction, offsets.
    All,
    /// Base parameters of the rigid bodies alone.
    Inertial,
}

/// What every designed motion is asked by: form, limits, search, where its files go.
#[derive(Debug, Args)]
pub(crate) struct DesignedArgs {
    /// Write the motion also for what plays it, comma separated.
    #[arg(long, value_enum, value_name = "FORMAT,..", value_delimiter = ',')]
    pub(crate) also: Vec<PlaybackArg>,
    /// Harmonics (default: 5; with drives 20).
    #[arg(long, value_name = "N")]
    pub(crate) harmonics: Option<usize>,
    /// Rate of commanded and recorded samples, Hz (default: 500; with drives 100).
    #[arg(long, value_name = "HZ", allow_negative_numbers = true)]
    pub(crate) rate_hz: Option<f64>,
    /// Let the motion start and end at speed instead of at rest.
    #[arg(long)]
    pub(crate) no_rest: bool,
    /// Come from the zero pose (or the nearest within the limits) and go back to it; `[trajectory] parking` names others.
    #[arg(long)]
    pub(crate) park: bool,
    /// Largest acceleration of all joints, rad/s² or m/s² (default: full speed in half a second).
    #[arg(long, value_name = "A", allow_negative_numbers = true)]
    pub(crate) acceleration: Option<f64>,
    /// Share of the robot file's limits that may be used (default: 1).
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true)]
    pub(crate) share: Option<f64>,
    /// Hold a joint at a position, rad or m.
    #[arg(long, value_name = "JOINT=POSITION", value_parser = joint_value)]
    pub(crate) lock: Vec<(String, f64)>,
    /// Let links go below the floor (default: the plane through the origin of the base, across gravity).
    #[arg(long)]
    pub(crate) no_floor: bool,
    /// Height of the floor above the origin of the base, m (default: 0).
    #[arg(long, value_name = "M", allow_negative_numbers = true, conflicts_with = "no_floor")]
    pub(crate) floor_height: Option<f64>,
    /// Let links of the robot come near each other.
    #[arg(long)]
    pub(crate) no_self_collision: bool,
    /// Least distance between links, and from the floor, m (default: 0.02).
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    pub(crate) margin: Option<f64>,
    /// Folder that holds packages, for `package://NAME/...` of meshes; repeat for several.
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub(crate) package_dir: Vec<PathBuf>,
    /// Random starts (default: 16).
    #[arg(long, value_name = "N")]
    pub(crate) starts: Option<usize>,
    /// Seed of the first start (default: 1).
    #[arg(long)]
    pub(crate) seed: Option<u64>,
    #[command(flatten)]
    pub(crate) force: ForceArgs,
    #[command(flatten)]
    pub(crate) print: PrintArgs,
}

#[derive(Debug, Args)]
pub(crate) struct DesignArgs {
    /// Configuration (TOML), or a robot file; `-`: standard input.
    #[arg(value_hint = ValueHint::FilePath)]
    pub(crate) input: PathBuf,
    /// Output folder (default: dynid-design).
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub(crate) out: Option<PathBuf>,
    /// Period, s (default: 20; with drives 10).
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    pub(crate) period: Option<f64>,
    /// Recorded periods (default: 1).
    #[arg(long, value_name = "N")]
    pub(crate) periods: Option<usize>,
    /// What is minimised (default: relative-std, without inertias in the robot file unit-condition).
    #[arg(long, value_enum)]
    pub(crate) criterion: Option<CriterionArg>,
    /// Parameters that count (default: all).
    #[arg(long, value_enum)]
    pub(crate) columns: Option<ColumnsArg>,
    /// Standard deviation of the effort's noise at all joints, N m or N; with drives of the positions, rad or m.
    #[arg(long, value_name = "STD", allow_negative_numbers = true)]
    pub(crate) noise: Option<f64>,
    /// Trajectory that is recorded as well, so that its information counts; repeat for several.
    #[arg(long, value_name = "TRAJECTORY.json", value_hint = ValueHint::FilePath)]
    pub(crate) earlier: Vec<PathBuf>,
    /// What `dynid servo` found, its servo.json: the log will hold commands and positions, no effort.
    #[arg(long, value_name = "SERVO.json", value_hint = ValueHint::FilePath)]
    pub(crate) drives: Option<PathBuf>,
    /// Elements at every joint, comma separated; `none`: rigid bodies alone.
    #[arg(long, value_name = "LIST", value_delimiter = ',', long_help = with_elements("Elements at every joint, comma separated; `none`: rigid bodies alone."))]
    pub(crate) elements: Option<Vec<String>>,
    /// Begin no start after this time, and end those that began, s (default: all run).
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    pub(crate) time_budget: Option<f64>,
    /// File that keeps finished starts, so that a run can be taken up again.
    #[arg(long, value_name = "FILE")]
    pub(crate) checkpoint: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) designed: DesignedArgs,
}

#[derive(Debug, Args)]
pub(crate) struct NextArgs {
    /// Configuration of a design (TOML), for limits, safety and form of the motion, or a robot file.
    #[arg(value_hint = ValueHint::FilePath)]
    pub(crate) input: PathBuf,
    /// Factor file of the logs so far (`dynid reduce` writes them); repeat for several.
    #[arg(long, required = true, value_name = "FACTORS", value_hint = ValueHint::FilePath)]
    pub(crate) after: Vec<PathBuf>,
    /// Parameter and half width of the 95 % interval that is wanted of it, in its unit or in per cent of its value; `*` in a name stands for
    /// any text; repeat for several.
    #[arg(long, required = true, value_name = "NAME=WIDTH", value_parser = str::parse::<Wanted>)]
    pub(crate) want: Vec<Wanted>,
    /// Longest record, s.
    #[arg(long, value_name = "S", default_value_t = 120.0, allow_negative_numbers = true)]
    pub(crate) longest: f64,
    /// Time that as many harmonics as `--harmonics` take in the slowest motion that is tried, s (default: 20).
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    pub(crate) period: Option<f64>,
    /// Output folder (default: dynid-next).
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub(crate) out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) designed: DesignedArgs,
}
