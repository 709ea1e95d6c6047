//! How a robot file is read.

use std::path::PathBuf;

use clap::{Args, ValueHint};

/// How a robot file is read.
#[derive(Debug, Args)]
pub(crate) struct RobotArgs {
    /// Robot file: URDF, MJCF, SDF, each as xacro too (`FILE#name:=value`), or TOML with DH rows or bodies; `-`: standard input.
    #[arg(value_hint = ValueHint::FilePath)]
    pub(crate) robot: PathBuf,
    /// Put a floating joint under the root link.
    #[arg(long)]
    pub(crate) floating_base: bool,
    /// Let mimic joints follow their leaders (default: every joint is a coordinate of its own).
    #[arg(long)]
    pub(crate) couple_mimics: bool,
    /// Hold a joint at a position, rad or m.
    #[arg(long, value_name = "JOINT=POSITION", value_parser = joint_value)]
    pub(crate) lock: Vec<(String, f64)>,
    /// Gravity in base axes, m/s² (default: the robot file's, else 0,0,-9.81).
    #[arg(long, value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true)]
    pub(crate) gravity: Option<[f64; 3]>,
}

pub(super) fn joint_value(text: &str) -> Result<(String, f64), String> {
    let (joint, value) = text.split_once('=').ok_or("expected JOINT=POSITION")?;
    let value: f64 = value.parse().map_err(|_| format!("expected a number after `=`, found `{value}`"))?;
    if value.is_finite() { Ok((joint.to_owned(), value)) } else { Err("expected a finite number".to_owned()) }
}

pub(super) fn vector(text: &str) -> Result<[f64; 3], String> {
    let numbers: Vec<f64> = text
        .split(',')
        .map(|x| x.trim().parse().map_err(|_| format!("expected three numbers X,Y,Z, found `{text}`")))
        .collect::<Result<_, _>>()?;
    <[f64; 3]>::try_from(numbers)
        .ok()
        .filter(|v| v.iter().all(|x| x.is_finite()))
        .ok_or_else(|| format!("expected three finite numbers X,Y,Z, found `{text}`"))
}
