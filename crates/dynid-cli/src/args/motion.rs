//! Arguments of `dynid motion`.

use std::path::PathBuf;

use clap::{Args, ValueEnum, ValueHint};
use dynid::io::trajectory::Playback;

use super::robot::joint_value;
use super::{ForceArgs, PrintArgs};

/// What plays a motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum PlaybackArg {
    /// MoveIt: `moveit_msgs/RobotTrajectory` (.moveit.yaml).
    Moveit,
    /// Universal Robots: a script with a `servoj` per sample (.ur.script).
    Ur,
    /// Franka: positions at 1 kHz for libfranka (.fci.csv).
    Fci,
    /// KUKA: positions at 1 kHz for the Fast Robot Interface (.fri.csv).
    Fri,
    /// MuJoCo: keyframes (.mujoco.xml).
    Mujoco,
}

impl PlaybackArg {
    pub(crate) fn of(self) -> Playback {
        match self {
            PlaybackArg::Moveit => Playback::MoveIt,
            PlaybackArg::Ur => Playback::UrScript,
            PlaybackArg::Fci => Playback::Fci,
            PlaybackArg::Fri => Playback::Fri,
            PlaybackArg::Mujoco => Playback::MuJoCo,
        }
    }
}

#[derive(Debug, Args)]
pub(crate) struct MotionArgs {
    /// Motion file (TOML), or with `--sweep` a robot file; `-`: standard input.
    #[arg(value_hint = ValueHint::FilePath)]
    pub(crate) input: PathBuf,
    /// Output folder (default: dynid-motion).
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub(crate) out: Option<PathBuf>,
    /// Sweep a joint of a robot file at the constant speeds of `--speeds`; repeat for several, one after the other.
    #[arg(long, value_name = "JOINT", requires = "speeds")]
    pub(crate) sweep: Vec<String>,
    /// Speeds of the sweeps, each forth and back, rad/s or m/s, comma separated.
    #[arg(
        long,
        value_name = "LIST",
        value_delimiter = ',',
        allow_negative_numbers = true,
        requires = "sweep"
    )]
    pub(crate) speeds: Vec<f64>,
    /// Positions within which the joints are swept, rad or m (default: their limits).
    #[arg(
        long,
        value_name = "LEAST,LARGEST",
        value_delimiter = ',',
        allow_hyphen_values = true,
        requires = "sweep"
    )]
    pub(crate) range: Vec<f64>,
    /// Write the motion also for what plays it, comma separated.
    #[arg(long, value_enum, value_name = "FORMAT,..", value_delimiter = ',')]
    pub(crate) also: Vec<PlaybackArg>,
    /// Rate of the samples, Hz (default: 500).
    #[arg(long, value_name = "HZ", allow_negative_numbers = true)]
    pub(crate) rate_hz: Option<f64>,
    /// Largest acceleration of all joints, rad/s² or m/s² (default: full speed in half a second).
    #[arg(long, value_name = "A", allow_negative_numbers = true)]
    pub(crate) acceleration: Option<f64>,
    /// Share of the robot file's limits that may be used (default: 1).
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true)]
    pub(crate) share: Option<f64>,
    /// Run parts that break a limit of speed or acceleration slower, in place of refusing them.
    #[arg(long)]
    pub(crate) slower: bool,
    /// Hold a joint at a position, rad or m.
    #[arg(long, value_name = "JOINT=POSITION", value_parser = joint_value)]
    pub(crate) lock: Vec<(String, f64)>,
    #[command(flatten)]
    pub(crate) force: ForceArgs,
    #[command(flatten)]
    pub(crate) print: PrintArgs,
}
