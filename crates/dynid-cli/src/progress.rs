//! A progress line for long work, on terminals only.

use std::io::IsTerminal;
use std::time::Duration;

use dynid::Step;
use dynid::design::DesignStep;
use dynid::estimators::conditioning::Stage;
use dynid::friction::FrictionStep;
use indicatif::{ProgressBar, ProgressStyle};

/// Shows what is being worked on; silent unless stderr is a terminal.
pub(crate) struct Progress(ProgressBar);

impl Progress {
    pub(crate) fn new(quiet: bool) -> Self {
        if quiet || !std::io::stderr().is_terminal() {
            return Progress(ProgressBar::hidden());
        }
        let bar = ProgressBar::new_spinner();
        if let Ok(style) = ProgressStyle::with_template("{spinner} [{elapsed}] {msg}") {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(120));
        Progress(bar)
    }

    pub(crate) fn step(&self, step: Step) {
        self.0.set_message(match step {
            Step::Read(file) => format!("reading {file}"),
            Step::Preflight => "examining logs".to_owned(),
            Step::Structure => "finding base parameters".to_owned(),
            Step::Conditioning(Stage::Kernel(k, n)) => format!("summing rows, kernel {} of {n}", k + 1),
            Step::Conditioning(Stage::Veto) => "choosing the kernel".to_owned(),
            Step::Conditioning(Stage::Mask) => "choosing the reversal mask".to_owned(),
            Step::Conditioning(Stage::Friction) => "choosing friction shapes".to_owned(),
            Step::Conditioning(Stage::Delay) => "estimating the delay".to_owned(),
            Step::Instruments => "simulating the closed loop".to_owned(),
            Step::Shapes => "searching shape parameters".to_owned(),
            Step::Fit => "fitting".to_owned(),
            Step::Consistency => "making bodies physical".to_owned(),
            Step::Trust => "judging parameters".to_owned(),
            Step::Validate(log) => format!("predicting {log}"),
        });
    }
}

impl Progress {
    pub(crate) fn examining(&self, log: &str) {
        self.0.set_message(format!("examining {log}"));
    }

    pub(crate) fn friction(&self, step: FrictionStep) {
        self.0.set_message(match step {
            FrictionStep::Read(file) => format!("reading {file}"),
            FrictionStep::Law(joint) => format!("fitting friction of {joint}"),
            FrictionStep::Presliding(joint) => format!("searching bristles of {joint}"),
        });
    }
}

/// Shows how far a design is; silent unless stderr is a terminal.
pub(crate) struct DesignProgress(ProgressBar);

impl DesignProgress {
    pub(crate) fn new(quiet: bool) -> Self {
        if quiet || !std::io::stderr().is_terminal() {
            return DesignProgress(ProgressBar::hidden());
        }
        let bar = ProgressBar::new(0);
        if let Ok(style) = ProgressStyle::with_template("{spinner} [{elapsed}] {bar:30} {pos}/{len} {msg}") {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(120));
        DesignProgress(bar)
    }

    pub(crate) fn fit(&self, done: usize, of: usize, what: &str) {
        self.0.set_length(of as u64);
        self.0.set_position(done as u64);
        self.0.set_message(what.to_owned());
    }

    pub(crate) fn step(&self, step: DesignStep) {
        match step {
            DesignStep::Starts { ended, of, best } => {
                self.0.set_length(of as u64);
                self.0.set_position(ended as u64);
                let best =
                    best.map_or_else(|| "none within all limits yet".to_owned(), |b| format!("best {b:.4}"));
                self.0.set_message(format!("starts, {best}"));
            }
            DesignStep::Forecast => self.0.set_message("predicting what the log will tell"),
            _ => self.0.set_message("finding base parameters"),
        }
    }
}

/// Shows how far a study is; silent unless stderr is a terminal.
pub(crate) struct StudyProgress(DesignProgress);

impl StudyProgress {
    pub(crate) fn new(quiet: bool) -> Self {
        StudyProgress(DesignProgress::new(quiet))
    }

    pub(crate) fn step(&self, step: &dynid_studies::Progress) {
        self.0.0.set_length(step.steps as u64);
        self.0.0.set_position(step.done as u64);
        self.0.0.set_message(step.step.clone());
    }
}

impl Drop for DesignProgress {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
