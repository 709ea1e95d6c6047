//! What to record next: the shortest further motion after which named parameters have the intervals that are wanted of them, given the factors
//! of all earlier logs.
//!
//! The motion is one period, not repeated: what a model leaves over at a place and speed comes back with a motion, so that later periods are no
//! independent witnesses of it. Its information, weighted as the fit of the logs weighs rows, is added to that of the logs,
//! `M = M_logs + M_motion`. The search makes the largest deviation of the wanted parameters, in units of what is wanted, as small as it can, at
//! several speeds, each for the time that the motion before asked for. What a motion gives is told by a rehearsal: its log without noise is
//! reduced by the recipe of the factors, so that kernels and masks take from it what they will take from the recorded one.

mod length;
mod record;
mod report;
mod robot;
mod wanted;

use std::sync::Arc;

use dynid_config::config::ElementsConfig;
use dynid_estimate::identifiability::Assessment;
use dynid_excitation::{Outcome, RobotExcitation};
use dynid_factor::Factor;
use dynid_identify::Error;
use dynid_identify::estimate::Status;
use dynid_identify::knowledge::{Knowledge, RowPrecision};
use dynid_identify::reduction::{Recipe, Reduction};
use dynid_identify::{Identification, verdict};
use dynid_linalg::Mat;
use dynid_model::EffortModel;

use super::config::{CriterionConfig, CriterionName, DesignConfig, SearchConfig, TrajectoryConfig};
use super::problem::{self, Subject};
use super::{DesignRun, DesignStep, finished};
use length::{Found, Lengths, Tried};
pub use record::{IntervalRecord, NextLog, NextRecord, TriedRecord};
use wanted::Goal;
pub use wanted::{Wanted, WantedState, Width};

/// Factor on the deviation of rows that tell nothing.
const NO_WEIGHT: f64 = 1e6;

/// What is asked of a next motion.
#[derive(Debug, Clone, PartialEq)]
pub struct NextSettings {
    /// Intervals that are wanted.
    pub wanted: Vec<Wanted>,
    /// Longest record, s. Default 120.
    pub longest_s: f64,
}

impl Default for NextSettings {
    fn default() -> Self {
        NextSettings { wanted: Vec::new(), longest_s: 120.0 }
    }
}

/// A motion to record next, and what it will tell.
pub struct NextRun {
    /// The configuration with what was chosen: period, harmonics, time between independent rows.
    pub config: DesignConfig,
    /// The motion, or why there is none; `None` if nothing has to be recorded, or no motion would help.
    pub design: Option<DesignRun>,
    /// Name of the robot.
    robot: String,
    known: Knowledge,
    goals: Vec<Goal>,
    /// What would be known after the motion.
    after: Option<Vec<Assessment>>,
    tried: Vec<Tried>,
    logs: Vec<NextLog>,
    /// Doubts about the forecast.
    warnings: Vec<String>,
    /// What is good to know.
    notes: Vec<String>,
}

/// Designs the shortest further motion after which parameters have the intervals that are wanted of them.
///
/// Of `config` robot, limits and search count, and of the trajectory the form: its harmonics over its period are the slowest motion that is
/// tried, beside faster ones. Criterion, elements, values and earlier trajectories have no effect, which the result says. `earlier`: factors of
/// all logs so far, by one recipe. Results do not depend on the number of threads.
///
/// # Errors
/// [`Error::Setting`] for nothing that is wanted, names that are no parameters, a longest record that is shorter than any motion, and a robot file that is not the robot of the
/// factors; what [`Reduction::solve`] and [`super::design`] refuse. A motion that does not reach all that is wanted is a result.
pub fn next(
    config: &DesignConfig,
    settings: &NextSettings,
    earlier: &Reduction,
    progress: &mut dyn FnMut(DesignStep),
) -> Result<NextRun, Error> {
    config.check()?;
    if !(settings.longest_s > 0.0 && settings.longest_s.is_finite()) {
        return Err(Error::setting("longest", "a time above zero, s", settings.longest_s));
    }
    if config.has_drives() {
        let expected =
            "none: factors are of logs with efforts; `dynid design` is for drives that log positions only";
        return Err(Error::setting(
            if config.drives.is_some() { "drives" } else { "servo" },
            expected,
            "one",
        ));
    }
    progress(DesignStep::Structure);
    let recipe = earlier.recipe();
    let solved = earlier.solve([], &mut |_| {})?;
    let known = solved.knowledge();
    let judged = verdict::judge(&solved);
    let mut warnings = Vec::new();
    if judged.status != Status::Ok {
        warnings.push(format!("the estimate of the logs so far is `{}`: {}", judged.status, judged.headline));
    }
    warnings.extend(row_warnings(&known, recipe));
    if known.lacking_s > settings.longest_s {
        warnings.push(format!(
            "the longest record is too short for intervals that time blocks bear out: logs and motion together lack {:.0} s",
            known.lacking_s
        ));
    }
    let mut run = NextRun {
        config: effective(config, &known),
        robot: recipe.robot.clone(),
        design: None,
        goals: wanted::goals(&settings.wanted, &known)?,
        logs: earlier.logs().iter().map(NextLog::of).collect(),
        after: None,
        tried: Vec::new(),
        known,
        warnings,
        notes: unused(config),
    };
    let Some(wanted) = combinations(&run.goals, &run.known) else { return Ok(run) };
    let robot = robot::robot(config, recipe, &solved.robot)?;
    problem::refuse(&robot)?;
    let criterion = length::criterion(&wanted);
    let subject = subject(solved, &run.known);
    let mut set = problem::problem_of(&robot, &run.config, subject, CriterionName::Intervals, criterion)?;
    let parking = problem::pose(&set, &run.config)?;
    let (known, config) = (&run.known, run.config.clone());
    let reducer = recipe.clone().without_preflight().reducer()?;
    let lengths =
        Lengths { config: &config, known, wanted, longest_s: settings.longest_s, reducer: &reducer };
    let (found, tried) = lengths.shortest(&mut set, progress)?;
    run.tried = tried;
    let outcome = match found {
        Err(infeasible) => Outcome::Infeasible(infeasible),
        Ok(found) => {
            let Found { design, period_s, harmonics, rows, cautions, .. } = found;
            let after = known.assess(&Factor::merge(&[known.information(), &rows]));
            lengths.pose(&mut set, period_s, harmonics);
            run.config.trajectory = TrajectoryConfig {
                period_s: Some(period_s),
                harmonics: Some(harmonics),
                periods: 1,
                ..config.trajectory.clone()
            };
            for goal in run.goals.iter_mut().filter(|g| g.is_open()) {
                if after[goal.parameter].posterior_std <= goal.deviation {
                    goal.state = WantedState::Reached;
                }
            }
            run.after = Some(after);
            if run.known.lacking_s >= period_s {
                run.notes.push(format!(
                    "logs and motion together are made as long as the time blocks behind standard deviations want: {:.0} s more",
                    run.known.lacking_s
                ));
            }
            run.warnings.extend(cautions.into_iter().map(|caution| caution.message));
            Outcome::Found(design)
        }
    };
    run.design = Some(finished((robot, None), set, &run.config, outcome, parking.as_deref(), progress)?);
    Ok(run)
}

/// The model that the logs gave, for a motion to be designed for.
fn subject(solved: Identification, known: &Knowledge) -> Subject {
    let values = solved.values().to_vec();
    let model = Arc::new(solved.model);
    let shape = model.parameters().shape_start();
    let excitation = Box::new(RobotExcitation::new(model.clone(), shape, &solved.base, Some(&values)));
    let noise = |row: &RowPrecision| match row.deviation {
        Some(deviation) if row.is_explained => deviation,
        // Rows that tell nothing weigh next to nothing.
        deviation => NO_WEIGHT * deviation.unwrap_or(1.0),
    };
    let noise = Some(known.rows.iter().map(noise).collect());
    match solved.nonlinear {
        Some((nonlinear, values)) => {
            Subject { model: Arc::new(nonlinear), nominal: Some(values), excitation, noise }
        }
        None => Subject { model, nominal: Some(values), excitation, noise },
    }
}

/// What a configuration says that has no effect, since a design's file is as good for a next motion.
fn unused(config: &DesignConfig) -> Vec<String> {
    let SearchConfig { checkpoint, time_budget_s, .. } = &config.search;
    let keys = [
        (
            "criterion",
            config.criterion != CriterionConfig::default(),
            "the wanted intervals are the criterion, the noise is that of the logs",
        ),
        ("earlier", !config.earlier.is_empty(), "factors of logs count in the place of trajectories"),
        ("elements", config.elements != ElementsConfig::default(), "the model is that of the factors"),
        ("values", !config.values.is_empty(), "the values are those of the factors"),
        (
            "trajectory.periods",
            config.trajectory.periods != 1,
            "one period is recorded, as long as it has to be",
        ),
        ("search.checkpoint", checkpoint.is_some(), "motions of several lengths are searched"),
        ("search.time_budget_s", time_budget_s.is_some(), "motions of several lengths are searched"),
    ];
    let told = |(key, _, why): (&str, bool, &str)| format!("`{key}` of the design has no effect here: {why}");
    keys.into_iter().filter(|(_, is_set, _)| *is_set).map(told).collect()
}

/// The configuration with what the factors say in the place of what a design takes from it.
fn effective(config: &DesignConfig, known: &Knowledge) -> DesignConfig {
    let criterion = CriterionConfig {
        name: Some(CriterionName::Intervals),
        correlation_time_s: known.row_spacing_s,
        ..CriterionConfig::default()
    };
    DesignConfig { criterion, ..config.clone() }
}

/// What is wanted of parameters that the logs so far do not give, as combinations of the base parameters; `None` if there is nothing to do.
fn combinations(goals: &[Goal], known: &Knowledge) -> Option<Mat> {
    let open = goals.iter().filter(|g| g.is_open());
    let rows: Vec<Vec<f64>> = open.filter_map(|g| known.combination(g.parameter, g.deviation)).collect();
    let columns = rows.first()?.len();
    Some(Mat::from_fn(rows.len(), columns, |i, j| rows[i][j]))
}

/// Outputs whose rows tell nothing, or whose noise no log says.
fn row_warnings(known: &Knowledge, recipe: &Recipe) -> Vec<String> {
    let mut out = Vec::new();
    for (row, output) in known.rows.iter().zip(&recipe.outputs) {
        let name = &output.name;
        if !row.is_explained {
            out.push(format!(
                "the model does not explain the effort of `{name}`: its rows count for nothing, in these logs and in further ones, until it does"
            ));
        } else if row.deviation.is_none() {
            out.push(format!("no log says anything of the noise of `{name}`: its rows count for nothing"));
        } else if row.is_assumed {
            out.push(format!(
                "no log has rows of `{name}`: its noise is taken to be as large a share of its efforts as that of the joint with the largest share"
            ));
        }
    }
    out
}
