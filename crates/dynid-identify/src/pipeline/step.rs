//! What an identification is doing, for progress displays.

use std::fmt;

use dynid_rows::conditioning::Stage;

/// What is being worked on, for progress displays.
#[derive(Debug, Clone, PartialEq)]
pub enum Step {
    /// Reading a file.
    Read(String),
    /// Pre-flight of the logs.
    Preflight,
    /// Structural analysis.
    Structure,
    /// A step of the conditioning.
    Conditioning(Stage),
    /// Searching shape parameters.
    Shapes,
    /// Final fit with its covariance.
    Fit,
    /// Searches over all parameters.
    Searches,
    /// Simulations of the closed loop for instruments.
    Instruments,
    /// Physically consistent standard parameters.
    Consistency,
    /// Verdicts and motions that would help.
    Trust,
    /// Predicting a log.
    Validate(String),
}

impl fmt::Display for Step {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let words = match self {
            Step::Read(file) => return write!(f, "reading {file}"),
            Step::Validate(log) => return write!(f, "predicting {log}"),
            Step::Conditioning(Stage::Kernel(k, n)) => {
                return write!(f, "summing rows, kernel {} of {n}", k + 1);
            }
            Step::Preflight => "examining logs",
            Step::Structure => "finding base parameters",
            Step::Conditioning(Stage::Veto) => "choosing the kernel",
            Step::Conditioning(Stage::Mask) => "choosing the reversal mask",
            Step::Conditioning(Stage::Friction) => "choosing friction shapes",
            Step::Conditioning(Stage::Delay) => "estimating the delay",
            Step::Searches => "searching over all parameters",
            Step::Instruments => "simulating the closed loop",
            Step::Shapes => "searching shape parameters",
            Step::Fit => "fitting",
            Step::Consistency => "making bodies physical",
            Step::Trust => "judging parameters",
        };
        f.write_str(words)
    }
}
