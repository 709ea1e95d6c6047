//! ER-16: joints 1 to 3 of a 16 kg arm with nonlinear friction, identified by metaheuristic searches and by separable least
//! squares. See `README.md` in this folder.

mod arm;
mod chain;
mod dynamics;
mod excitation;
mod figures;
mod measurement;
mod reference;
mod report;
mod search;
mod separable;
mod settings;
mod signals;

use crate::record::{Drawn, drawn};
use crate::{Progress, RunSettings, Steps, StudyError, StudyRecord, StudyRun};
use arm::Arm;
use excitation::Columns;
use measurement::Measurement;
use settings::Settings;

/// What was published.
pub use dynid_terminal::study::ER16 as STUDY;

/// Rate of the data on which friction models are compared at reversal, Hz.
const REVERSAL_RATE_HZ: f64 = 50.0;

/// Rows that the seed enters.
const DRAWN: [Drawn; 10] = [
    drawn("5"),
    drawn("7"),
    drawn("8"),
    drawn("9"),
    drawn("10"),
    drawn("a"),
    drawn("b"),
    drawn("c"),
    drawn("d"),
    drawn("e"),
];

/// Runs the study.
///
/// # Errors
/// [`StudyError`]: faults of the embedded data or of the rooms below.
pub fn run(run: &RunSettings, progress: &mut dyn FnMut(Progress)) -> Result<StudyRun, StudyError> {
    let mut steps = Steps::new(progress, 8);
    let settings = Settings::read()?;
    let arm = Arm::new(&settings)?;
    let mut rows = dynamics::rows(&arm, &settings)?.to_vec();
    rows.push(signals::row()?);
    rows.push(excitation::printed_trajectory(&arm, &settings)?);

    steps.begin("designing trajectories");
    let own = excitation::designed(&arm, &settings, run, Columns::Inertial)?;
    let with_friction = excitation::designed(&arm, &settings, run, Columns::WithLinearFriction)?;
    rows.push(excitation::own_trajectory(own.as_ref()));
    rows.push(search::objective_row(&arm)?);

    let measure = |rate_hz| Measurement::new(&arm, &settings, &settings.reference, rate_hz, run.seed);
    let data = measure(settings.search_rate_hz)?;
    let searches = search::searches(&arm, &settings, &data, run, &mut steps)?;
    steps.begin("separable least squares");
    let found = separable::identify_plain(&arm, &data)?;
    let absolute = separable::identify_absolute(&arm, &data)?;
    let predicted = arm.efforts(&data.block(), &found.unknowns);
    rows.extend(search::rows(&searches, data.correlation(&data.torque, &predicted), &settings));
    let fast = measure(REVERSAL_RATE_HZ)?;
    let friction = separable::compare_friction(&arm, &fast)?;
    rows.push(separable::reversal_row(&fast, &friction));
    rows.push(separable::separable_row(&arm, &settings, &data, &found, &absolute)?);

    steps.begin("intervals and polish");
    rows.extend(separable::beyond(&arm, &settings, &data, &found, &absolute, &searches, run)?);
    rows.push(excitation::better_trajectory(own.as_ref(), with_friction.as_ref()));
    rows.push(separable::passivity_row(&arm, &friction.unknowns));
    steps.begin("the chain from noisy signals");
    let chain = chain::by_rate(&arm, &settings, run)?;

    let record = StudyRecord::new(STUDY.name, run, rows, &DRAWN);
    let report = report::Contents {
        arm: &arm,
        settings: &settings,
        own: own.as_ref(),
        data: &data,
        searches: &searches,
        found: &found,
        fast: &fast,
        friction: &friction,
        chain: &chain,
    }
    .report(&record)?;
    Ok(StudyRun { record, report })
}
