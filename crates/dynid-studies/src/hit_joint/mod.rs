//! The harmonic-drive joint of a space manipulator: stiffness and damping off line and on line. See `README.md` in this folder.

mod batch;
mod golden;
mod joint;
mod measurement;
mod offline;
mod online;
mod realisations;
mod reference;
mod report;
mod settings;
mod tracking;

use crate::record::{Drawn, drawn};
use crate::{Progress, RunSettings, Steps, StudyError, StudyRecord, StudyRun};
use joint::Extras;
use offline::Tables;
use online::Machine;
use realisations::{Realisation, clean, decimated, noisy};
use settings::Settings;
use tracking::Tracks;

/// What was published.
pub use dynid_terminal::study::HIT_JOINT as STUDY;

/// `k1, k2, b_in, b_inD, b_out, b_outC`.
const PARAMETERS: usize = 6;
/// Names of the parameters.
const NAMES: [&str; PARAMETERS] = ["k1", "k2", "b_in", "b_inD", "b_out", "b_outC"];
/// A value per parameter.
type Values = [f64; PARAMETERS];

/// A fault of this study's data or of the rooms below.
fn fault(error: impl std::fmt::Display) -> StudyError {
    StudyError::Data { file: "hit_joint", message: error.to_string() }
}

/// Rows that the seed enters.
const DRAWN: [Drawn; 15] = [
    Drawn {
        id: "5",
        cause: "One realisation of the noise in eleven to fourteen misses a limit (counted in this row), in most cases 1 % of b_out, whose \
                standard deviation is 0.6 to 0.7 %: the limit is one and a half of its deviations wide.",
    },
    drawn("6"),
    drawn("7"),
    drawn("8"),
    drawn("9"),
    drawn("10"),
    drawn("11"),
    drawn("a"),
    drawn("b"),
    drawn("c"),
    drawn("d"),
    drawn("e"),
    drawn("f"),
    drawn("g"),
    drawn("h"),
];

/// Runs the study.
///
/// # Errors
/// [`StudyError`]: faults of the embedded data or of the rooms below.
pub fn run(run: &RunSettings, progress: &mut dyn FnMut(Progress)) -> Result<StudyRun, StudyError> {
    let mut steps = Steps::new(progress, 6);
    let (realisations, streams, change_free) = if run.quick { (60, 2, 60) } else { (400, 10, 1000) };
    let settings = Settings::read()?;
    steps.begin("parts, batch and recursion against references");
    let mut rows = vec![golden::parts_row(&settings)?];
    rows.extend(golden::batch_rows(&settings)?);
    rows.push(golden::recursion_row(&settings)?);

    steps.begin("batch identification");
    let raw = clean(&settings, Extras::default())?;
    let measured = noisy(&settings, &raw, settings.noise.deformation, run.seed);
    let data = decimated(&settings, &measured);
    let tables = Tables::new(&settings, &data)?;
    let all = Realisation::many(&settings, &raw, run.seed, realisations)?;
    rows.push(batch::full_row(&settings, &tables, &data, &all)?);
    rows.extend(batch::nested_rows(&settings, &tables));
    rows.push(batch::single_speed_row(&settings, &raw, &data)?);
    rows.push(tracking::batch_row(&settings, &data, &tables.full.x)?);
    rows.push(batch::filtered_row(&settings, &all));
    rows.push(batch::total_row(&settings, &all));
    rows.push(batch::interval_row(&settings, &all));
    rows.push(batch::cyclic_row(&settings, run.seed)?);
    rows.push(batch::full_friction_row(&settings, run.seed)?);
    rows.push(batch::catalogue_row(&settings, &tables)?);

    steps.begin("a spring that softens");
    let machine = Machine::new(&settings)?;
    let tracks = Tracks::new(&settings, &machine, run.seed, streams)?;
    rows.push(tracking::tracking_row(&machine, &tracks));
    rows.push(tracking::reaction_row(&tracks));
    steps.begin("streams without a change");
    rows.push(tracking::false_alarm_row(&settings, &machine, run.seed, change_free)?);
    steps.begin("one direction for long");
    let (row, one_way) = tracking::one_way_row(&settings, &machine, run.seed)?;
    rows.push(row);

    steps.begin("report");
    let record = StudyRecord::new(STUDY.name, run, rows, &DRAWN);
    let report = report::Contents {
        settings: &settings,
        data: &data,
        tables: &tables,
        all: &all,
        tracks: &tracks,
        one_way: &one_way,
    }
    .report(&record)?;
    Ok(StudyRun { record, report })
}
