//! The command line of studies: `dynid study` reads it and hands over to the program `dynid-studies`, which reads it again.

use std::path::PathBuf;

use clap::{Args, ValueHint};

use crate::args::{ForceArgs, PrintArgs};
use crate::message::{Failure, data, json};

/// Name of the program that runs studies.
pub const PROGRAM: &str = "dynid-studies";

/// Version of that program with a digest of the sources that it is built from, where these are known: what `--version` says of it.
pub const VERSION: &str = match option_env!("DYNID_STUDIES_VERSION") {
    Some(version) => version,
    None => env!("CARGO_PKG_VERSION"),
};

/// Which study, and how it is run.
#[derive(Debug, Args)]
pub struct StudyArgs {
    /// Name of the study; `list` shows all.
    pub name: String,
    /// Folder for study.json and report.html (default: `dynid-study-NAME`).
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub out: Option<PathBuf>,
    /// Keep every row, shrink statistics: under a minute.
    #[arg(long)]
    pub quick: bool,
    /// Seed of everything random.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Which files may be replaced.
    #[command(flatten)]
    pub force: ForceArgs,
    /// What is printed.
    #[command(flatten)]
    pub print: PrintArgs,
}

/// A published system that a study identifies again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Published {
    /// Name on the command line.
    pub name: &'static str,
    /// What is studied.
    pub title: &'static str,
    /// Where it was published.
    pub source: &'static str,
}

/// Three joints of an industrial arm.
pub const ER16: Published = Published {
    name: "er16",
    title: "ER-16: nonlinear friction by improved cuckoo search, and by separable least squares",
    source: "dynamical identification of an industrial robot by an improved cuckoo search (believed Ding, Li, Li & Chao 2018)",
};

/// A harmonic drive of a space manipulator.
pub const HIT_JOINT: Published = Published {
    name: "hit-joint",
    title: "HIT joint: stiffness and damping of a harmonic drive, off line and while it runs",
    source: "Sun, Shi, Zhang, Wang & Liu, Parameters Identification Applied to Large Space Robotic Manipulators",
};

/// A collaborative arm.
pub const INDY7: Published = Published {
    name: "indy7",
    title: "Indy7: two-step identification with friction of speed and temperature",
    source: "Tadese, Pico, Seo & Moon 2022, Sensors 22, 9708",
};

/// A mechanism with loops.
pub const PRR3: Published = Published {
    name: "prr3",
    title: "3PRR mechanism: friction of sliders that follows the forces on their guideway",
    source: "Rosyid & El-Khasawneh, Applied Sciences 2020, 10(14), 4820",
};

/// A mechanism with clearance.
pub const XY_POINTING: Published = Published {
    name: "xy-pointing",
    title: "X-Y pointing mechanism: parameters of a mechanism whose joints have clearance",
    source: "Sun, Han, Li & Li, Robotics 2021, 10(1), 36",
};

/// All of them, in the order of their names.
pub const PUBLISHED: [Published; 5] = [ER16, HIT_JOINT, INDY7, PRR3, XY_POINTING];

impl StudyArgs {
    /// Whether the studies are to be listed.
    pub fn asks_for_list(&self) -> bool {
        self.name == "list"
    }

    /// The study that is named.
    ///
    /// # Errors
    /// There is none of this name.
    pub fn published(&self) -> Result<Published, Failure> {
        PUBLISHED.into_iter().find(|p| p.name == self.name).ok_or_else(|| {
            Failure::Usage(
                format!("no study `{}`; known: {}", self.name, PUBLISHED.map(|p| p.name).join(", ")),
                "`dynid study list` says what each is about",
            )
        })
    }
}

/// Prints what there is.
///
/// # Errors
/// Standard output cannot be written.
pub fn list(print: PrintArgs) -> Result<(), Failure> {
    if print.json {
        let study =
            |p: Published| serde_json::json!({ "study": p.name, "title": p.title, "source": p.source });
        return json(&PUBLISHED.map(study));
    }
    data(&PUBLISHED.map(|p| format!("{:12} {}\n{:12} {}\n", p.name, p.title, "", p.source)).concat())
}
