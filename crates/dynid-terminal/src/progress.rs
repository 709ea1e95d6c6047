//! The progress of long work: what is being done, for how long, and how far it is where that is known. On terminals only.

use std::io::IsTerminal;
use std::time::Duration;

use dynid::Step;
use dynid::design::DesignStep;
use dynid::fleet::FleetStep;
use dynid::friction::FrictionStep;
use dynid::servo::ServoStep;
use indicatif::{ProgressBar, ProgressStyle};

use crate::memory;

/// Work of which the end is not known.
const OPEN: &str = "{spinner} [{elapsed}] {msg}";
/// Work of so many steps.
const COUNTED: &str = "{spinner} [{elapsed}] {bar:30} {pos}/{len} {msg}";

/// Shows what is being worked on, in a line that goes with it; silent unless stderr is a terminal.
pub struct Progress(ProgressBar);

impl Progress {
    /// A line that is shown, unless the user asked for quiet.
    pub fn new(quiet: bool) -> Self {
        if quiet || !std::io::stderr().is_terminal() {
            return Progress(ProgressBar::hidden());
        }
        let bar = ProgressBar::new_spinner();
        restyle(&bar, OPEN);
        bar.enable_steady_tick(Duration::from_millis(120));
        Progress(bar)
    }

    /// The work in words.
    pub fn doing(&self, what: impl Into<String>) {
        self.0.set_message(what.into());
    }

    /// Steps done, of how many, and the work in words.
    pub fn counted(&self, done: usize, of: usize, what: impl Into<String>) {
        if self.0.length() != Some(of as u64) {
            self.0.set_length(of as u64);
            restyle(&self.0, COUNTED);
        }
        self.0.set_position(done as u64);
        self.doing(what);
    }

    /// A step of an identification; what the one before it freed goes back to the system first.
    pub fn step(&self, step: Step) {
        memory::give_back();
        self.doing(step.to_string());
    }

    /// A step of a friction experiment.
    pub fn friction(&self, step: FrictionStep) {
        self.doing(match step {
            FrictionStep::Read(file) => format!("reading {file}"),
            FrictionStep::Law(joint) => format!("fitting friction of {joint}"),
            FrictionStep::Presliding(joint) => format!("searching bristles of {joint}"),
        });
    }

    /// A step of a fleet.
    pub fn fleet(&self, step: FleetStep) {
        self.doing(step.to_string());
    }

    /// A step of a servo identification.
    pub fn servo(&self, step: ServoStep) {
        self.doing(match step {
            ServoStep::Read(file) => format!("reading {file}"),
            ServoStep::Fit => "fitting drives by simulation".to_owned(),
        });
    }

    /// A step of a design.
    pub fn design(&self, step: DesignStep) {
        match step {
            DesignStep::Starts { ended, of, .. } => self.counted(ended, of, step.to_string()),
            _ => self.doing(step.to_string()),
        }
    }
}

fn restyle(bar: &ProgressBar, template: &str) {
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
