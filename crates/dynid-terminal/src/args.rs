//! What a command prints and what it may overwrite.

use clap::Args;

/// What is printed.
#[derive(Debug, Clone, Copy, Args)]
pub struct PrintArgs {
    /// Print JSON in place of text.
    #[arg(long)]
    pub json: bool,
    /// Print nothing but the result and errors: no progress, notes or warnings.
    #[arg(long, short)]
    pub quiet: bool,
}

/// Which files may be replaced.
#[derive(Debug, Clone, Copy, Args)]
pub struct ForceArgs {
    /// Replace files that are not known to come from dynid.
    #[arg(long)]
    pub force: bool,
}
