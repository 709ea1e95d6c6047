//! What the logs themselves leave open: their pre-flight, rows that they share, the scale of their efforts.

use super::{Status, check, graded};
use crate::check::{CheckName, CheckResult};
use crate::effort_scale::{EffortScale, ScaleSource};
use crate::finding::Severity;
use crate::identification::Identification;
use crate::settings::Preflight;

/// Masses of the robot file speak for the scale of the efforts within this factor.
const FILE_AGREES: f64 = 1.25;
/// A ratio to a weighed mass this close to one is right, whatever its interval ...
const WEIGHED: f64 = 0.03;
/// ... and one that is farther off makes the parameters useless.
const FAR_OFF: f64 = 0.1;

/// Checks of the logs.
pub(super) fn checks(id: &Identification) -> Vec<CheckResult> {
    [Some(preflight(id)), recipe(id), repeated(id), seen_before(id), Some(scale(id))]
        .into_iter()
        .flatten()
        .collect()
}

fn preflight(id: &Identification) -> CheckResult {
    let named = |severity: Severity| {
        let of = id
            .findings
            .iter()
            .filter(|f| f.severity == severity && (severity == Severity::Error || f.counts()));
        let mut names: Vec<String> = of.map(|f| f.id.plain()).collect();
        names.sort();
        names.dedup();
        names
    };
    let examined = id.settings.preflight != Preflight::Off;
    let (errors, doubts) = (named(Severity::Error), named(Severity::Warning));
    let count = (errors.len() + doubts.len()) as f64;
    let (status, meaning) = if !examined {
        let meaning = "it was switched off: nobody looked whether columns, signs, units and gravity are what the log says";
        (Status::Warn, meaning.to_owned())
    } else if !errors.is_empty() {
        let meaning = format!("what the pre-flight found makes nonsense of any model: {}", errors.join(", "));
        (Status::Fail, meaning)
    } else if !doubts.is_empty() {
        (Status::Warn, format!("the pre-flight has doubts about the logs: {}", doubts.join(", ")))
    } else {
        (Status::Ok, "columns, signs, units, clock and gravity are what the logs say".to_owned())
    };
    check(status, CheckName::Preflight, examined.then_some(count), "", "no error, no warning", meaning)
}

/// What cannot be looked at again without the samples of the logs that taught a recipe.
fn recipe(id: &Identification) -> Option<CheckResult> {
    if id.row_fits.is_empty() {
        return None;
    }
    let failed = id.recipe_doubts.iter().any(|doubt| doubt.status == Status::Fail);
    let words: Vec<String> = id
        .recipe_doubts
        .iter()
        .map(|doubt| format!("[{}] {}: {}", doubt.status, doubt.name, doubt.meaning))
        .collect();
    let meaning = match &words[..] {
        [] => "the logs that taught it left no doubt about delay, mask and fit".to_owned(),
        words => {
            format!("the logs that taught it left doubts, which no factor can clear: {}", words.join("; "))
        }
    };
    let count = words.len() as f64;
    let status = graded(words.is_empty(), !failed);
    Some(check(status, CheckName::Recipe, Some(count), "", "no doubt", meaning))
}

fn repeated(id: &Identification) -> Option<CheckResult> {
    let found = &id.overlaps.training;
    let most = found.iter().map(|o| o.share).reduce(f64::max)?;
    let words: Vec<String> = found.iter().map(|o| o.words()).collect();
    Some(check(
        graded(false, !found.iter().any(|o| o.repeats())),
        CheckName::OwnLogs,
        Some(100.0 * most),
        "%",
        "no rows in common",
        format!("rows count more than once, so that all intervals are too narrow: {}", words.join("; ")),
    ))
}

fn seen_before(id: &Identification) -> Option<CheckResult> {
    let found = &id.overlaps.validation;
    let most = found.iter().map(|o| o.share).reduce(f64::max)?;
    let words: Vec<String> = found.iter().map(|o| o.words()).collect();
    Some(check(
        Status::Warn,
        CheckName::OwnValidation,
        Some(100.0 * most),
        "%",
        "no rows in common with training logs",
        format!("the model was fitted to rows that it is validated on: {}", words.join("; ")),
    ))
}

/// Joints with an effort of their position that the robot file does not hold: a spring that carries a link passes for mass of it.
fn carried(id: &Identification) -> String {
    let slow = id.cyclic.iter().filter(|c| c.found.may_be_a_spring()).map(|c| c.output);
    let mut outputs: Vec<usize> = slow.chain(id.slow.iter().map(|s| s.output)).collect();
    outputs.sort_unstable();
    outputs.dedup();
    let names = dynid_model::EffortModel::outputs(&id.model);
    let names: Vec<&str> = outputs.iter().map(|o| names[*o].name.as_str()).collect();
    match names.is_empty() {
        true => String::new(),
        false => format!(
            "; or a spring acts at `{}`, whose effort follows its position: what it carries counts among the masses",
            names.join("`, `")
        ),
    }
}

fn scale(id: &Identification) -> CheckResult {
    let found = &id.effort_scale;
    let name = CheckName::EffortScale;
    let assumption = found.assumption().unwrap_or_default();
    match found.source {
        ScaleSource::KnownMass => weighed(found),
        ScaleSource::Stated => {
            let beside = found.ratio.map_or_else(String::new, |r| {
                format!("; the bodies of the robot file ask for {:.2} of the efforts", 1.0 / r)
            });
            check(Status::Ok, name, found.ratio, "", "stated", assumption + &beside)
        }
        ScaleSource::RobotFile => {
            let ratio = found.ratio.unwrap_or(f64::NAN);
            let agrees = ratio.max(1.0 / ratio) <= FILE_AGREES;
            let meaning = match agrees {
                true => format!(
                    "efforts are {ratio:.2} times those of the bodies in the robot file, which speaks for their scale; {assumption}"
                ),
                false => format!(
                    "efforts are {ratio:.2} times those of the bodies in the robot file: either its masses are wrong or the unit or the torque \
                     constants of the efforts are, and then all masses, inertias and friction by the same factor{}; {assumption}; if the efforts are \
                     right, say so: `known_effort_scale = true`",
                    carried(id)
                ),
            };
            let limit = format!("within a factor of {FILE_AGREES} of the robot file's masses");
            check(graded(agrees, true), name, Some(ratio), "", &limit, meaning)
        }
        ScaleSource::None => {
            let meaning =
                format!("{assumption}; if the efforts are right, say so: `known_effort_scale = true`");
            check(Status::Warn, name, None, "", "a known mass, or masses in the robot file", meaning)
        }
    }
}

/// Against masses that were weighed.
fn weighed(found: &EffortScale) -> CheckResult {
    let (name, limit) = (CheckName::EffortScale, "1 within the interval");
    let each: Vec<String> = found
        .masses
        .iter()
        .map(|m| {
            let interval = m
                .interval
                .map_or_else(|| "not seen in the logs".to_owned(), |(a, b)| format!("{a:.3} to {b:.3} kg"));
            format!("`{}` weighs {} kg, identified {:.3} kg ({interval})", m.name, m.known, m.identified)
        })
        .collect();
    let each = each.join("; ");
    let (Some(ratio), Some((low, high))) = (found.ratio, found.interval) else {
        let meaning =
            format!("the logs do not show what was weighed, so that the scale stays an assumption: {each}");
        return check(Status::Warn, name, None, "", limit, meaning);
    };
    let right = (low..=high).contains(&1.0) || (ratio - 1.0).abs() < WEIGHED;
    let off = (low - 1.0).max(1.0 - high).max(0.0);
    let meaning = match right {
        true => format!("weighed masses bear it out: {each}"),
        false => format!(
            "efforts are {ratio:.3} times as large as they should be: {each}; multiply the drive gains (`current_gains`, or `scale` of the effort \
             columns) by {:.4}; until then all masses, inertias and friction are off by this factor",
            1.0 / ratio
        ),
    };
    check(graded(right, off < FAR_OFF), name, Some(ratio), "", limit, meaning)
}
