//! Planar 3PRR mechanism whose friction follows the forces on its guideway. See `README.md` in this folder.

mod beyond;
mod dynamics;
mod encoders;
mod excitation;
mod experiment;
mod figures;
mod fits;
mod friction;
mod knowable;
mod machine;
mod problem;
mod rank;
mod reference;
mod report;
mod sections;
mod settings;
mod trajectory;

use crate::record::{Drawn, drawn};
use crate::{Progress, RunSettings, Steps, StudyError, StudyRecord, StudyRun};
use beyond::{Shares, Upright};
use encoders::Encoders;
use excitation::Designs;
use fits::Fits;
use knowable::Knowable;
use machine::{Machine, Plane};
use rank::Rank;
use settings::Settings;

/// What was published.
pub use dynid_terminal::study::PRR3 as STUDY;

/// Noise, random poses (B2) and random starts (B5).
const DRAWN: [Drawn; 11] = [
    drawn("B2"),
    drawn("B5"),
    Drawn {
        id: "B8",
        cause: "The published pattern search doubles its mesh after every success and spends its 34 000 evaluations on meshes far too \
                wide: without noise it ends at 0.438 N, hardly below the 0.429 N that Coulomb and viscous friction leave at best. With \
                the mesh kept at 1 it ends at 0.201 N, and least squares at zero. That part does not depend on the seed.",
    },
    drawn("B9"),
    drawn("B11"),
    drawn("B11'"),
    drawn("a"),
    drawn("b"),
    drawn("c"),
    drawn("d"),
    drawn("e"),
];

/// A fault of this study's data or of the rooms below.
fn fault(error: impl std::fmt::Display) -> StudyError {
    StudyError::Data { file: "prr3", message: error.to_string() }
}

/// The larger; not a number if either is none.
fn worst(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}

/// Runs the study.
///
/// # Errors
/// [`StudyError`]: faults of the embedded data or of the rooms below.
pub fn run(run: &RunSettings, progress: &mut dyn FnMut(Progress)) -> Result<StudyRun, StudyError> {
    let mut steps = Steps::new(progress, 5);
    steps.begin("dynamics and trajectory against references");
    let settings = Settings::read()?;
    let machine = Machine::new(&settings)?;
    let motion = trajectory::identification_motion(&settings, settings.trajectory.samples)?;
    let forces = trajectory::true_forces(&machine, &settings, &motion, Plane::Horizontal)?;
    let shares = trajectory::shares(&forces);
    let rank = Rank::new(&machine, &settings)?;
    let mut rows = vec![
        dynamics::golden_row(&machine)?,
        dynamics::ways_row(&machine, &settings, run)?,
        friction::row(&machine, &settings)?,
        trajectory::row(&machine, &settings)?,
        rank.row(&settings),
        trajectory::friction_row(&shares),
    ];
    steps.begin("fitting three laws of friction");
    let fits = Fits::new(&machine, &settings, &rank, run)?;
    rows.extend(fits.rows());
    let knowable = Knowable::new(&settings, &rank, &fits)?;
    rows.push(knowable.row(&settings, &fits));
    rows.push(knowable::separated_row(&fits));
    steps.begin("beyond the paper");
    let upright = Upright::new(&machine, &settings, &fits, run)?;
    rows.push(upright.row());
    let weights = Shares::new(&machine, &settings, &fits, &rank)?;
    rows.push(weights.row());
    let encoders = Encoders::new(&machine, &settings, &fits, &rank, run)?;
    rows.push(encoders.row());
    steps.begin("designing trajectories");
    let designs = Designs::new(&machine, &settings, run)?;
    rows.push(designs.row());
    steps.begin("report");
    let record = StudyRecord::new(STUDY.name, run, rows, &DRAWN);
    let report = report::Contents {
        machine: &machine,
        settings: &settings,
        motion: &motion,
        forces: &forces,
        shares: &shares,
        rank: &rank,
        fits: &fits,
        knowable: &knowable,
        upright: &upright,
        weights: &weights,
        encoders: &encoders,
        designs: &designs,
    }
    .report(&record)?;
    Ok(StudyRun { record, report })
}
