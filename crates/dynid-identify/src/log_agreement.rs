//! Whether the logs of one identification agree: deviations of single logs, tested and measured in units of effort.

use dynid_estimate::log_deviations::{LogDeviations, OwnColumn, log_deviations};
use dynid_model::{EffortModel, RobotModel};
use serde::{Deserialize, Serialize};

use crate::fitting::Fitted;
use crate::problem::Problem;
use crate::settings::Own;
use crate::structure::Structure;

/// Deviations count from this share of the residual on; smaller ones do no harm, however certain they are.
const RELEVANT: f64 = 0.25;
/// Joints whose residual a log's own fit brings down by this share are named.
const BETTER_ALONE: f64 = 0.2;

/// What one log has more than the first, though the fit holds it the same.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct LogDeviation {
    /// Log.
    pub log: String,
    /// The log that it is compared with.
    pub than: String,
    /// Joint.
    pub joint: String,
    /// Parameter: `fo`, `fc` or `fv`.
    pub parameter: String,
    /// Deviation, in the parameter's unit.
    pub value: f64,
    /// Standard deviation of the deviation.
    pub std: f64,
    /// Unit.
    pub unit: String,
    /// RMS of what this deviation, for friction both together, adds to the effort of the log, N m or N.
    pub effect: f64,
    /// RMS of the residual that is left, N m or N.
    pub residual: f64,
    /// Beyond chance (1 % for all deviations together) and above a quarter of the residual.
    pub disagrees: bool,
}

/// Whether the logs are of one robot, beside offsets and friction.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct OneRobot {
    /// Chow's F over that of white residuals; around 1 where all logs share their parameters.
    pub f: f64,
    /// Value that 99 % of logs alike stay below.
    pub limit: f64,
    /// Logs and joints whose residual a fit of the log's own brings down by a fifth at least.
    pub better_alone: Vec<BetterAlone>,
}

/// A log that a fit of its own describes better, in the rows of one joint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct BetterAlone {
    /// Log.
    pub log: String,
    /// Joint.
    pub joint: String,
    /// RMS of the residual of the common fit.
    pub common: f64,
    /// RMS of the residual of the log's own fit.
    pub alone: f64,
    /// Unit of both.
    pub unit: String,
}

/// Agreement of the training logs of an identification.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct LogAgreement {
    /// Deviations in offset and friction that the fit does not hold, of all logs but the first.
    pub deviations: Vec<LogDeviation>,
    /// The rest; absent where it could not be told.
    pub one_robot: Option<OneRobot>,
}

/// Tests the training logs; `None` with a single log or too few time blocks. `scale`: factor on friction that a log has of its
/// own, 1 without.
pub(crate) fn test(problem: &Problem, fitted: &Fitted, scale: impl Fn(&str) -> f64) -> Option<LogAgreement> {
    let Problem { model, structure: Structure { base, .. }, plan, .. } = problem;
    let (terms, labels) = (&plan.log_terms, problem.labels());
    if labels.len() < 2 {
        return None;
    }
    let table = &model.parameters().linear;
    let name_of = |column: usize| table[base.kept[column]].name.as_str();
    let mut own = Vec::new();
    for (log, label) in labels.iter().enumerate().skip(1) {
        for (output, joint) in model.outputs().iter().enumerate() {
            for (symbol, kind) in [("fo", Own::Offset), ("fc", Own::Friction), ("fv", Own::Friction)] {
                let given = |l: &String| terms.deviations.contains(&(l.clone(), kind));
                // Where the first log is the one that deviates, the others are what it deviates from.
                if given(label) || given(&labels[0]) {
                    continue;
                }
                let wanted = format!("{}.{symbol}", joint.name);
                let column = (0..base.len()).find(|c| name_of(*c) == wanted);
                own.extend(column.map(|column| OwnColumn { log, output, column }));
            }
        }
    }
    let groups = &fitted.estimate.reduced;
    let found = log_deviations(groups, base.len(), &own)?;
    let mut deviations = deviations(&found, model, &labels, name_of, |c| table[base.kept[c]].unit);
    // Columns of friction are scaled in such logs.
    for d in deviations.iter_mut().filter(|d| d.parameter != "fo") {
        let scale = scale(&d.log);
        (d.value, d.std) = (scale * d.value, scale * d.std);
    }
    let one_robot = found.separate(fitted.inflation).map(|separate| OneRobot {
        f: separate.f,
        limit: separate.limit,
        better_alone: separate
            .rms
            .iter()
            .enumerate()
            .flat_map(|(log, outputs)| {
                outputs.iter().enumerate().map(move |(output, rms)| (log, output, rms))
            })
            .filter_map(|(log, output, rms)| {
                let (common, alone) = rms.filter(|(common, alone)| *alone < (1.0 - BETTER_ALONE) * common)?;
                let (log, output) = (labels[log].clone(), &model.outputs()[output]);
                let (joint, unit) = (output.name.clone(), output.unit.to_owned());
                Some(BetterAlone { log, joint, common, alone, unit })
            })
            .collect(),
    });
    Some(LogAgreement { deviations, one_robot })
}

fn deviations<'a>(
    found: &LogDeviations,
    model: &RobotModel,
    labels: &[String],
    name_of: impl Fn(usize) -> &'a str,
    unit_of: impl Fn(usize) -> &'static str,
) -> Vec<LogDeviation> {
    let limit = found.limit(found.deviations.len());
    let parameter = |column: usize| name_of(column).rsplit('.').next().unwrap_or_default().to_owned();
    let is_offset = |column: usize| parameter(column) == "fo";
    let mut out = Vec::with_capacity(found.deviations.len());
    // Those of one log and joint stand together.
    for of_joint in found.deviations.chunk_by(|a, b| (a.of.log, a.of.output) == (b.of.log, b.of.output)) {
        for d in of_joint {
            let of = d.of;
            let together =
                || of_joint.iter().filter(|other| is_offset(other.of.column) == is_offset(of.column));
            let columns: Vec<usize> = together().map(|o| o.of.column).collect();
            let effect = found.effect(of.log, of.output, &columns);
            let residual = found.residual(of.log, of.output).unwrap_or(0.0);
            let certain = together().any(|o| o.value.abs() > limit * o.std);
            out.push(LogDeviation {
                log: labels[of.log].clone(),
                than: labels[0].clone(),
                joint: model.outputs()[of.output].name.clone(),
                parameter: parameter(of.column),
                value: d.value,
                std: d.std,
                unit: unit_of(of.column).to_owned(),
                effect,
                residual,
                disagrees: certain && effect > RELEVANT * residual,
            });
        }
    }
    out
}

impl LogAgreement {
    /// Whether some log contradicts the others.
    pub fn contradicts(&self) -> bool {
        self.deviations.iter().any(|d| d.disagrees) || self.is_not_one_robot()
    }

    /// Whether more than offsets and friction differs.
    pub fn is_not_one_robot(&self) -> bool {
        self.one_robot.as_ref().is_some_and(|r| r.f > r.limit && !r.better_alone.is_empty())
    }

    /// Which logs contradict each other, by how much, and what mends it; in words.
    pub fn warnings(&self) -> Vec<String> {
        let mut out = Vec::new();
        let mut logs: Vec<&str> = self.deviations.iter().map(|d| d.log.as_str()).collect();
        logs.dedup();
        for log in logs {
            let of = |offset: bool| {
                let own = self.deviations.iter().filter(move |d| d.log == log && d.disagrees);
                own.filter(move |d| (d.parameter == "fo") == offset)
            };
            let (offset, friction) = (
                "`own = [\"offset\"]` in the `[[log]]` gives it offsets of its own",
                "`own = [\"friction\"]` in the `[[log]]` gives it friction of its own joint by joint, `own = [\"friction_scale\"]` \
                 one factor on all friction",
            );
            out.extend(words(log, "offset", of(true).collect(), "zero of its sensors", offset));
            out.extend(words(log, "friction", of(false).collect(), "colder or warmer gears", friction));
        }
        if let Some(rest) = self.one_robot.as_ref().filter(|_| self.is_not_one_robot()) {
            let joints: Vec<String> = rest
                .better_alone
                .iter()
                .map(|b| {
                    format!("`{}` in {} from {:.3} to {:.3} {}", b.joint, b.log, b.common, b.alone, b.unit)
                })
                .collect();
            out.push(format!(
                "beside offsets and friction the logs have different parameters: F = {:.1} where logs of one robot stay \
                 below {:.1}; a fit of its own brings down the residual of {}. Was something mounted (`[[payload]]`), has a log \
                 a delay of its own (`own = [\"delay\"]`), or is it another robot?",
                rest.f,
                rest.limit,
                joints.join(", ")
            ));
        }
        out
    }
}

/// One sentence on the deviations of a log in one thing; `None` without any.
fn words(log: &str, what: &str, found: Vec<&LogDeviation>, cause: &str, remedy: &str) -> Option<String> {
    let first = found.first()?;
    let parts: Vec<String> = found
        .iter()
        .map(|d| {
            let name = if d.parameter == "fo" { String::new() } else { format!("{} ", d.parameter) };
            format!("`{}` {name}by {:+.3} ± {:.3} {}", d.joint, d.value, d.std, d.unit)
        })
        .collect();
    let most = found.iter().map(|d| d.effect / d.residual.max(f64::MIN_POSITIVE)).fold(0.0, f64::max);
    Some(format!(
        "{log} and {} contradict each other in {what} ({cause}): {log} lies off at {}; up to {most:.1} times the residual. \
         {remedy}",
        first.than,
        parts.join(", ")
    ))
}
