//! Which motion would help: what the next log should hold, for parameters that this one leaves to the prior.
//!
//! A library of short motions is run through the model's regressor, reduced to rows as the fit reduces a log, and added to
//! the present information `J`. What a motion `c` is worth to parameter `j` is `s_j(J + J_c) - s_j(J)`.

mod motions;
mod rows;

pub use motions::{Motion, MotionKind, MotionSettings};
pub use rows::FitRows;

use crate::identifiability::{Identifiability, Verdict, VisibleSpace};
use dynid_factor::Factor;
use dynid_model::{BaseParameters, EffortModel, RobotModel};
use rayon::prelude::*;

use rows::CandidateRows;

/// Least gain of a share that is worth a recommendation.
const LEAST_GAIN: f64 = 0.2;
/// A later motion of the library must gain this much more than an earlier one: simple motions come first.
const BETTER: f64 = 0.01;

/// What one motion would do for one parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Suggestion {
    /// Column of the parameter.
    pub parameter: usize,
    /// Index into [`Advice::motions`].
    pub motion: usize,
    /// Achieved share now.
    pub from: f64,
    /// Achieved share with the motion added to the logs.
    pub to: f64,
}

/// Why there is no advice at all.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum NoAdvice {
    /// The model reads channels, such as motor currents, which a motion alone does not give.
    Channels(Vec<String>),
    /// A joint has more than one coordinate (a floating base).
    FloatingJoint,
    /// Motors stand behind springs: the motions are those of stiff joints.
    ElasticJoints,
    /// Loops are closed, or friction follows reactions: the motions are those of arms.
    ClosedLoops,
}

/// What the logs at hand tell.
#[derive(Debug, Clone, Copy)]
pub struct Present<'a> {
    /// Visible space of the regrouping under the prior.
    pub space: &'a VisibleSpace,
    /// Factor of the weighted rows in base columns.
    pub information: &'a Factor,
    /// Variance inflation `κ`.
    pub inflation: f64,
    /// What [`VisibleSpace::assess`] makes of them.
    pub assessed: &'a Identifiability,
}

/// Motions that would help, and parameters that none of them helps.
#[derive(Debug, Clone, PartialEq)]
pub struct Advice {
    /// All motions tried.
    pub motions: Vec<Motion>,
    /// The best motion of every parameter for which one gains at least 0.2, in parameter order.
    pub suggestions: Vec<Suggestion>,
    /// Parameters that are not seen although some motion of the robot could gain 0.2, but none of those tried does.
    pub without: Vec<usize>,
    /// Why nothing was tried, if so.
    pub unavailable: Option<NoAdvice>,
}

/// Looks for motions that would raise the achieved share of parameters that are not seen in the data.
///
/// - `base`: base parameters of `model`; [`regrouping`] gives the matrix that [`VisibleSpace::new`] takes.
/// - `rows`: how the fit counts rows; the motions' rows are counted alike.
///
/// The motions are listed at [`MotionKind`]; pairs are joints of which one carries the other. Efforts are not checked
/// against limits. Candidates run in parallel; the result does not depend on the number of threads.
///
/// # Panics
/// If shapes disagree.
pub fn advise(
    model: &RobotModel,
    base: &BaseParameters,
    present: &Present<'_>,
    rows: &FitRows,
    settings: &MotionSettings,
) -> Advice {
    let mut advice =
        Advice { motions: Vec::new(), suggestions: Vec::new(), without: Vec::new(), unavailable: None };
    if !model.channels().is_empty() {
        advice.unavailable = Some(NoAdvice::Channels(model.channels().to_vec()));
        return advice;
    }
    if !model.coordinates().is_empty() {
        advice.unavailable = Some(NoAdvice::ElasticJoints);
        return advice;
    }
    if model.with_reactions().is_some() {
        advice.unavailable = Some(NoAdvice::ClosedLoops);
        return advice;
    }
    if model.mechanism().positions() != model.mechanism().rates() {
        advice.unavailable = Some(NoAdvice::FloatingJoint);
        return advice;
    }
    let wanting: Vec<usize> = (0..present.assessed.parameters.len())
        .filter(|j| {
            let a = &present.assessed.parameters[*j];
            a.verdict != Verdict::Seen && a.structural_limit - a.achieved >= LEAST_GAIN
        })
        .collect();
    if wanting.is_empty() {
        return advice;
    }
    advice.motions = motions::library(model.mechanism());
    let reduction = CandidateRows::new(model, base, rows, settings);
    let shares: Vec<Option<Vec<f64>>> = advice
        .motions
        .par_iter()
        .map(|motion| {
            let with = Factor::merge(&[present.information, &reduction.reduce(motion)?]);
            Some(present.space.shares(&with, present.inflation))
        })
        .collect();
    for parameter in wanting {
        let from = present.assessed.parameters[parameter].achieved;
        let mut best: Option<(usize, f64)> = None;
        for (motion, shares) in shares.iter().enumerate() {
            let Some(to) = shares.as_ref().map(|s| s[parameter]) else { continue };
            if best.is_none_or(|(_, share)| to > share + BETTER) {
                best = Some((motion, to));
            }
        }
        match best.filter(|(_, to)| to - from >= LEAST_GAIN) {
            Some((motion, to)) => {
                advice.suggestions.push(Suggestion { parameter, motion, from, to });
            }
            None => advice.without.push(parameter),
        }
    }
    advice
}

impl Advice {
    /// The suggestion for a parameter, as `fast motion of joints j4 and j5 together would raise Izz5 from 12 % to 94 %`;
    /// for a parameter that no motion tried helps, a sentence that says so; else `None`.
    ///
    /// `joints`: names of the rates; `symbol`: of the parameter.
    pub fn sentence(&self, parameter: usize, joints: &[String], symbol: &str) -> Option<String> {
        if let Some(s) = self.suggestions.iter().find(|s| s.parameter == parameter) {
            return Some(format!(
                "{} would raise {symbol} from {:.0} % to {:.0} %",
                self.motions[s.motion].words(joints),
                100.0 * s.from,
                100.0 * s.to
            ));
        }
        self.without.contains(&parameter).then(|| {
            format!("no motion of one or two neighbouring joints would raise {symbol} by 20 % or more")
        })
    }

    /// One sentence per motion that helps, most helpful first: `fast motion of joints j4 and j5 together would raise Izz5
    /// from 12 % to 94 % and mx5 from 40 % to 97 %`.
    ///
    /// `joints`: names of the rates; `symbols`: one per parameter.
    pub fn by_motion(&self, joints: &[String], symbols: &[&str]) -> Vec<String> {
        let mut used: Vec<(usize, Vec<&Suggestion>)> = Vec::new();
        for s in &self.suggestions {
            match used.iter_mut().find(|(m, _)| *m == s.motion) {
                Some((_, all)) => all.push(s),
                None => used.push((s.motion, vec![s])),
            }
        }
        used.sort_by_key(|(_, all)| std::cmp::Reverse(all.len()));
        used.into_iter()
            .map(|(motion, all)| {
                let raised: Vec<String> = all
                    .iter()
                    .map(|s| {
                        let symbol = symbols[s.parameter];
                        format!("{symbol} from {:.0} % to {:.0} %", 100.0 * s.from, 100.0 * s.to)
                    })
                    .collect();
                format!("{} would raise {}", self.motions[motion].words(joints), enumeration(&raised))
            })
            .collect()
    }
}

/// `a`, `a and b`, `a, b and c`.
fn enumeration(parts: &[String]) -> String {
    match parts {
        [] => String::new(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

/// Regrouping `K` of base parameters as a matrix, `base × parameters`.
pub fn regrouping(base: &BaseParameters) -> dynid_linalg::Mat {
    let flat = base.matrix();
    let columns = base.kept.len() + base.folded.len() + base.zero.len();
    dynid_linalg::Mat::from_fn(base.len(), columns, |i, j| flat[i * columns + j])
}
