//! What the programs of dynid share: arguments, messages, progress, output files, exit codes.
//!
//! Results go to stdout, everything else to stderr. Exit codes: 0 done, 1 ran but the verdict is negative, 2 bad input or usage.

pub mod args;
mod memory;
pub mod message;
pub mod outputs;
pub mod progress;
pub mod study;
