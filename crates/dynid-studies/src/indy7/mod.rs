//! Indy7: friction of speed and temperature first, rigid bodies second. See `README.md` in this folder.

mod cyclic;
mod dynamics;
mod estimators;
mod excitation;
mod experiment;
mod friction;
mod identification;
mod one_shot;
mod reference;
mod report;
mod robot;
mod rows;
mod settings;
mod sweep;
mod validation;

use dynid::estimators::conditioning::PreparedLog;
use dynid::sim::Profile;

use crate::record::{Drawn, drawn};
use crate::{Progress, RunSettings, Steps, StudyError, StudyRecord, StudyRun};
use experiment::Experiment;
use identification::{Identified, OURS, PAPER, regression};
use robot::Indy7;
use rows::Four;
use settings::Settings;
use validation::{Ends, Realisation, Validation, known, log, realisation};

/// What was published.
pub use dynid_terminal::study::INDY7 as STUDY;

/// Joints of the arm.
const JOINTS: usize = 6;

/// A fault of this study's data or of the rooms below.
fn fault(error: impl std::fmt::Display) -> StudyError {
    StudyError::Data { file: "indy7", message: error.to_string() }
}

/// Rows that the seed enters.
const DRAWN: [Drawn; 10] = [
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
];

/// Runs the study.
///
/// # Errors
/// [`StudyError`]: faults of the embedded data or of the rooms below.
pub fn run(run: &RunSettings, progress: &mut dyn FnMut(Progress)) -> Result<StudyRun, StudyError> {
    let seeds: u64 = if run.quick { 1 } else { 10 };
    let mut steps = Steps::new(progress, 5 + seeds as usize);
    let settings = Settings::read()?;
    let arm = Indy7::new(&settings)?;
    steps.begin("dynamics and estimators against references");
    let mut rows = dynamics::rows(&arm, &settings)?;
    rows.extend(estimators::rows(&arm, &settings)?);

    steps.begin("designing trajectories");
    let designed = excitation::designed(&arm, &settings, run)?;
    rows.extend(excitation::rows(designed.as_ref()));
    let excitation = designed.as_ref().map_or(&settings.trajectories.excitation, |d| &d.rows);

    steps.begin("validation logs");
    let thermal = &settings.thermal;
    let (cold, hot) = rayon::join(
        || Validation::new(&arm, &settings, thermal.cold, run.seed),
        || Validation::new(&arm, &settings, thermal.hot, run.seed),
    );
    let ends = Ends { cold: cold?, hot: hot? };

    let mut realisations: Vec<Realisation> = Vec::new();
    for k in 0..seeds {
        steps.begin(&format!("friction experiment and identification {} of {seeds}", k + 1));
        realisations.push(realisation(&arm, &settings, excitation, &ends, run, run.seed + k)?);
    }
    let first = &realisations[0];
    rows.push(rows::friction_row(&settings, &first.friction));
    rows.push(rows::validation_row(&settings, &ends, first)?);
    rows.push(rows::one_shot_row(&realisations));
    rows.push(rows::missing_temperature_row(&arm, &settings, &ends, first)?);
    rows.push(rows::price_row(first));

    steps.begin("identification cold and hot");
    let conditions = Conditions::new(&arm, &settings, excitation, run.seed)?;
    let (four, realistic) = conditions.estimates(&arm, &settings, first)?;
    rows.extend(rows::robustness_rows(&arm, &four, &realistic));
    steps.begin("a record in which joints warm up");
    rows.push(drift(&arm, &settings, excitation, first, run.seed)?);

    let record = StudyRecord::new(STUDY.name, run, rows, &DRAWN);
    let report = report::Contents {
        arm: &arm,
        settings: &settings,
        excitation,
        ends: &ends,
        found: first,
        four: &four,
        conditions: &conditions,
    }
    .report(&record)?;
    Ok(StudyRun { record, report })
}

/// Logs of the excitation trajectory, cold and hot.
#[derive(Debug)]
struct Conditions {
    cold: PreparedLog,
    hot: PreparedLog,
}

impl Conditions {
    fn new(arm: &Indy7, settings: &Settings, excitation: &[Vec<f64>], seed: u64) -> Result<Self, StudyError> {
        let thermal = &settings.thermal;
        let (cold, hot) = rayon::join(
            || log(arm, settings, excitation, thermal.cold, seed + 100),
            || log(arm, settings, excitation, thermal.hot, seed + 101),
        );
        Ok(Conditions { cold: cold?, hot: hot? })
    }

    /// The paper's four estimates, and the same with bodies that can exist.
    fn estimates(
        &self,
        arm: &Indy7,
        settings: &Settings,
        found: &Realisation,
    ) -> Result<(Four, [Identified; 4]), StudyError> {
        let estimate = |hot: bool, friction: bool, constraints| -> Result<Identified, StudyError> {
            let known = if friction { known(&found.friction, settings, None)? } else { Vec::new() };
            let log = if hot { &self.hot } else { &self.cold };
            regression(arm, known, log, settings, constraints)
        };
        let four = Four {
            conventional: [estimate(false, false, PAPER)?, estimate(true, false, PAPER)?],
            proposed: [estimate(false, true, PAPER)?, estimate(true, true, PAPER)?],
        };
        let realistic = [
            estimate(false, false, OURS)?,
            estimate(true, false, OURS)?,
            estimate(false, true, OURS)?,
            estimate(true, true, OURS)?,
        ];
        Ok((four, realistic))
    }
}

/// Periods and sample rate of the record in which joints warm up.
const WARMING: (usize, f64) = (20, 250.0);

/// Row e.
fn drift(
    arm: &Indy7,
    settings: &Settings,
    excitation: &[Vec<f64>],
    found: &Realisation,
    seed: u64,
) -> Result<crate::Row, StudyError> {
    let (periods, rate_hz) = WARMING;
    let trajectory = experiment::repeated(excitation, periods)?;
    let thermal = &settings.thermal;
    let duration = trajectory.period() * periods as f64;
    let at = |t: f64| thermal.ambient + thermal.rise * -(-t / thermal.time_constant).exp_m1();
    let points = (0..=20).map(|k| duration * f64::from(k) / 20.0).map(|t| (t, at(t)));
    let warming = Experiment {
        trajectory: &trajectory,
        temperature: Profile::new(points.collect())?,
        ripple: true,
        rate_hz,
        seed: seed + 200,
    };
    let log = warming.prepared("warming up", arm, settings)?;
    let measured = regression(arm, known(&found.friction, settings, None)?, &log, settings, OURS)?;
    let start = thermal.ambient;
    let mut stated = Vec::new();
    for (joint, friction) in found.friction.iter().enumerate() {
        stated.extend(friction.known(joint, thermal.valid, Some(start))?);
    }
    let ignored = regression(arm, stated, &log, settings, OURS)?;
    Ok(rows::drift_row(arm, &measured, &ignored, [start, at(duration)]))
}
