//! What an identification is worth, in plain words.

mod inputs;
mod instruments;
mod logs;
mod remedy;

use dynid_estimate::consistent::{ConsistentEstimate, Status as ConsistentStatus};
use dynid_estimate::identifiability::Verdict as TrustVerdict;
use dynid_estimate::whiteness::InBandWhiteness;

use crate::agreement::{Agreement, explained_in_motion};
use crate::caution::{self, Caution};
pub use crate::check::CheckName;
use crate::check::CheckResult;
use crate::consistency::UNCONSTRAINED;
use crate::estimate::{BaseCounts, Verdict};
use crate::identification::Identification;
use crate::joint_stiffness::JointStiffness;
use crate::journal_doubt;
use crate::load_rounds::LoadRounds;
use dynid_record::Basis;
pub use dynid_record::Status;
pub(crate) use instruments::in_words as closed_loop_bias_in_words;

/// All is as it should be, tolerable, or neither.
fn graded(good: bool, tolerable: bool) -> Status {
    match (good, tolerable) {
        (true, _) => Status::Ok,
        (false, true) => Status::Warn,
        (false, false) => Status::Fail,
    }
}

fn check(
    status: Status,
    name: CheckName,
    value: Option<f64>,
    unit: &str,
    limit: &str,
    meaning: impl Into<String>,
) -> CheckResult {
    CheckResult {
        status,
        name,
        value,
        unit: unit.to_owned(),
        limit: limit.to_owned(),
        meaning: meaning.into(),
    }
}

/// Judges an identification.
///
/// A failure is: rank doubtful, most parameters not excited, or a prediction that explains less than half of the effort
/// on some joint that moves. A warning is anything that should make a user look.
pub fn judge(id: &Identification) -> Verdict {
    let mut checks = vec![excitation(id), rank_gap(id), condition(id), training_fit(id)];
    if !id.unseen().is_empty() {
        checks.push(validation_fit(id));
    }
    checks.extend(explained(id));
    checks.extend(residual(id));
    checks.extend(position(id));
    checks.extend(loads(id));
    checks.extend(clearance(id));
    checks.extend(delay(id));
    checks.extend(mask(id));
    checks.push(blocks(id));
    checks.extend(consistency(id));
    checks.extend(stiffness(id));
    checks.extend(whiteness(id));
    checks.extend(instruments::instruments(id));
    checks.extend(instruments::closed_loop_bias(id));
    checks.extend(logs::checks(id));
    checks.extend(inputs::checks(id));
    let ties = ties(id, &checks);
    checks.extend(ties);
    let status = checks.iter().map(|c| c.status).max().unwrap_or(Status::Ok);
    let (error, where_) = relative_error(id);
    let named = |level: Status| {
        let names = checks.iter().filter(|c| c.status == level).map(|c| c.name.word());
        names.collect::<Vec<_>>().join(", ")
    };
    let assumptions: Vec<String> = id.effort_scale.assumption().into_iter().collect();
    let reservation = match status {
        Status::Ok => match &assumptions[..] {
            [] => "All checks passed.".to_owned(),
            assumed => format!("All checks passed; {}.", assumed.join("; ")),
        },
        Status::Warn => format!("These checks call for a look: {}.", named(Status::Warn)),
        Status::Fail => {
            format!("It should not be used without a look at the failed checks: {}.", named(Status::Fail))
        }
    };
    let line =
        format!("{}; the model {where_} within {error:.1} % of the effort", id.counts().base_in_words());
    let warnings: Vec<Caution> =
        id.warnings.iter().cloned().chain(unphysical(id)).chain(id.friction_warnings()).collect();
    Verdict {
        status,
        headline: format!("{line}. {reservation}"),
        line,
        assumptions,
        cautions: cautions(id, &checks, &warnings),
        checks,
        warnings: warnings.into_iter().map(|w| w.message).collect(),
    }
}

/// Error over all joints of the worst log, percent, and on which logs it is one.
fn relative_error(id: &Identification) -> (f64, &'static str) {
    let worst = |errors: Vec<Option<f64>>| errors.into_iter().flatten().fold(f64::NAN, f64::max);
    let unseen = id.unseen();
    if unseen.is_empty() && !id.row_fits.is_empty() {
        let of_rows = id.row_fits.iter().map(|rows| rows.fit.relative_error);
        return (worst(of_rows.collect()), "reproduces the rows of the training logs");
    }
    let (logs, in_all, in_motion) = match unseen[..] {
        [] => {
            let motion = "reproduces the training logs where joints move";
            (id.training.iter().collect(), "reproduces the training logs", motion)
        }
        _ => (unseen, "predicts logs it has not seen", "predicts logs it has not seen where joints move"),
    };
    // Friction at rest is nothing that a model of the speed could tell.
    let rests = logs.iter().flat_map(|a| &a.standing_share).any(|share| *share > RESTS);
    match rests {
        true => (worst(logs.iter().map(|a| a.moving.relative_error).collect()), in_motion),
        false => (worst(logs.iter().map(|a| a.filtered.relative_error).collect()), in_all),
    }
}

/// Share of the samples at rest from which on the error of a log is that of the samples in motion.
const RESTS: f64 = 0.25;

/// Checks that did not pass and warnings, the worst first. A check that only sums up warnings, which stand for themselves, is
/// left out.
fn cautions(id: &Identification, checks: &[CheckResult], warnings: &[Caution]) -> Vec<Caution> {
    let told = |name: CheckName| match name {
        CheckName::Preflight => id.findings.iter().any(|f| f.warning().is_some()),
        _ => warnings.iter().any(|w| w.name == name.word()),
    };
    let open = checks.iter().filter(|c| c.status != Status::Ok && !told(c.name));
    let open = open.map(|c| Caution::of(c, remedy::of(id, c.name)));
    caution::ranked(open.chain(warnings.iter().cloned()).collect())
}

impl Identification {
    /// Validation logs that hold nothing of the training logs to speak of.
    pub fn unseen(&self) -> Vec<&Agreement> {
        let is_new = |(k, _): &(usize, &Agreement)| !self.overlaps.repeats(self.training.len() + k);
        self.validation.iter().enumerate().filter(is_new).map(|(_, log)| log).collect()
    }
}

/// Bodies whose split of base values into standard parameters no body could have.
fn unphysical(id: &Identification) -> impl Iterator<Item = Caution> {
    id.unphysical_bodies().into_iter().map(|(body, fault)| {
        let message = format!(
            "the identified body `{body}` {fault}: the split of what is seen into its ten parameters is not physical; \
             predictions are not affected, but a simulator may refuse the robot file"
        );
        let remedy = "ask for bodies that can exist: `consistency = \"pseudo-inertia\"` under `[estimator]`";
        Caution::warn(caution::BODY, message, remedy)
    })
}

/// Stiffness that no log tells is no fault of the model, whose joints are stiff ones then.
fn stiffness(id: &Identification) -> Option<CheckResult> {
    let told = id.stiffness.iter().filter(|s| s.stiffness.is_some()).count();
    let all = id.stiffness.len();
    let words: Vec<String> = id.stiffness.iter().map(JointStiffness::words).collect();
    let status = graded(id.stiffness.iter().all(JointStiffness::is_borne_out), true);
    let meaning = match status {
        Status::Ok => {
            format!("the deformation of the joints bears the stiffness of the fit out: {}", words.join("; "))
        }
        _ => format!(
            "rows of links behind springs tell no stiffness here, so joints are taken as stiff ones; by their deformation: {}; a stiffness \
             has the scale of the efforts: 5 % in a torque constant are 5 % in it",
            words.join("; ")
        ),
    };
    (all > 0).then(|| {
        let limit = format!("all {all} joints");
        check(status, CheckName::Stiffness, Some(told as f64), "", &limit, meaning)
    })
}

fn excitation(id: &Identification) -> CheckResult {
    let BaseCounts { all, excited: kept, .. } = id.counts().base;
    check(
        graded(kept == all, 2 * kept > all),
        CheckName::Excitation,
        Some(kept as f64),
        "",
        &format!("all {all} base parameters"),
        if kept == all {
            "the logs excite every parameter combination that this robot can reveal".to_owned()
        } else {
            match all - kept {
                1 => "the logs leave one combination unexcited; it keeps the robot file's value".to_owned(),
                n => format!("the logs leave {n} combinations unexcited; these keep the robot file's values"),
            }
        },
    )
}

fn rank_gap(id: &Identification) -> CheckResult {
    // Beyond the reciprocal of machine epsilon a gap says nothing more.
    let gap = id.base.gap.ratio().min(1.0 / f64::EPSILON);
    check(
        graded(gap >= 1e4, gap >= 1e2),
        CheckName::RankGap,
        gap.is_finite().then_some(gap),
        "",
        "at least 1e4",
        "how clearly the robot's geometry separates what can be identified from what cannot",
    )
}

fn condition(id: &Identification) -> CheckResult {
    let condition = id.condition_without_shapes();
    // It amplifies errors, and standard deviations know of it: no reason to throw a model away.
    check(
        graded(condition < 100.0, true),
        CheckName::Condition,
        condition.is_finite().then_some(condition),
        "",
        "below 100",
        "how strongly errors of the effort are amplified, columns of shape parameters left out; a better excitation trajectory \
         (`dynid design`) lowers it",
    )
}

fn fit_check(name: CheckName, agreements: &[&Agreement], where_: &str) -> CheckResult {
    let outputs = agreements.first().map_or(0, |a| a.moves.len());
    let worst = (0..outputs).flat_map(|output| explained_in_motion(agreements, output)).reduce(f64::min);
    let r2 = worst.unwrap_or(f64::NAN);
    check(
        graded(r2 >= 0.9, r2 >= 0.5),
        name,
        worst,
        "",
        "R² of every joint at least 0.9",
        format!(
            "share of the effort's variance explained on {where_} where the joint moves, worst joint{}",
            standing_apart(agreements)
        ),
    )
}

/// Share of the samples at rest from which on they are told apart.
const STANDS: f64 = 0.05;

/// What the error is where joints stand, of the joint that stands longest.
fn standing_apart(agreements: &[&Agreement]) -> String {
    let joints = agreements.iter().flat_map(|a| a.standing_share.iter().copied().zip(&a.standing.channels));
    let longest = joints.filter(|(share, _)| *share > STANDS).max_by(|a, b| a.0.total_cmp(&b.0));
    longest.map_or_else(String::new, |(share, standing)| {
        let error = standing.relative_error.map_or_else(String::new, |e| format!(", error there {e:.1} % of its effort"));
        format!(
            "; samples at rest (up to {:.0} % of a joint's{error}) are shown apart, since friction has any value there",
            100.0 * share
        )
    })
}

fn training_fit(id: &Identification) -> CheckResult {
    if !id.row_fits.is_empty() {
        return row_fit(id);
    }
    let training: Vec<&Agreement> = id.training.iter().collect();
    fit_check(CheckName::TrainingFit, &training, "the logs it was fitted to")
}

/// How well the rows of the training logs are explained, where these are all that is left of them.
fn row_fit(id: &Identification) -> CheckResult {
    let all = id.row_fits.iter().flat_map(|rows| {
        let joints = rows.fit.channels.iter().zip(dynid_model::EffortModel::outputs(&id.model));
        joints.filter_map(|(channel, output)| Some((channel.r2?, &rows.log, &output.name)))
    });
    let worst = all.min_by(|a, b| a.0.total_cmp(&b.0));
    let r2 = worst.map_or(f64::NAN, |(r2, ..)| r2);
    let place = worst.map_or_else(String::new, |(_, log, joint)| format!(": `{joint}` in `{log}`"));
    check(
        graded(r2 >= 0.9, r2 >= 0.5),
        CheckName::TrainingFit,
        worst.map(|(r2, ..)| r2),
        "",
        "R² of every joint at least 0.9",
        format!(
            "share of the variance explained in the rows of the logs (through the kernel, off reversals) that move the joint, worst log and \
             joint{place}"
        ),
    )
}

fn validation_fit(id: &Identification) -> CheckResult {
    fit_check(CheckName::ValidationFit, &id.unseen(), "logs it has not seen")
}

fn explained(id: &Identification) -> Option<CheckResult> {
    let outputs = dynid_model::EffortModel::outputs(&id.model);
    let poor: Vec<&str> =
        outputs.iter().zip(&id.explained).filter(|(_, e)| !**e).map(|(o, _)| o.name.as_str()).collect();
    (!poor.is_empty()).then(|| {
        check(
            Status::Warn,
            CheckName::Explained,
            Some(poor.len() as f64),
            "",
            "none: at least half of the effort of every joint explained, on logs that move it and on held-out folds",
            format!(
                "the effort of `{}` is mostly something else than this model (poor current sensing, friction at rest, a wrong \
                 column?): its rows count for nothing in the verdicts, so that what only they could show stays with the prior",
                poor.join("`, `")
            ),
        )
    })
}

fn residual(id: &Identification) -> Option<CheckResult> {
    let worst = id
        .residual_ratio
        .iter()
        .flatten()
        .copied()
        .fold(None, |m: Option<f64>, x| Some(m.map_or(x, |m| m.max(x))))?;
    Some(check(
        graded(worst < 2.0, true),
        CheckName::Residual,
        Some(worst),
        "",
        "below 2 on every joint",
        if worst < 2.0 {
            "what the model leaves over is sensor noise"
        } else {
            "the residual is larger than sensor noise: something acts that the model does not hold (friction shape, \
             elasticity, ripple); standard deviations do not cover it"
        },
    ))
}

/// What is left over that is a slow function of the position of a joint, if that is beyond chance.
fn position(id: &Identification) -> Option<CheckResult> {
    let outputs = dynid_model::EffortModel::outputs(&id.model);
    let worst = id.slow.iter().map(|s| s.found.share).reduce(f64::max)?;
    let named: Vec<String> = (id.slow.iter())
        .map(|s| {
            let (share, error) = (100.0 * s.found.share, 100.0 * s.found.standard_error);
            format!("`{}` ({share:.0} ± {error:.0} %)", outputs[s.output].name)
        })
        .collect();
    Some(check(
        Status::Warn,
        CheckName::Position,
        Some(100.0 * worst),
        "%",
        "below 20 % of the mean square residual on held-out parts of the motion, or within three standard errors",
        format!(
            "the residual of {} is a function of the joint's position: a gravity compensator, a spring, a cable, a gear that is not round, or an axis \
             that is not where the robot file has it; standard deviations do not cover it",
            named.join(", ")
        ),
    ))
}

/// Checks that tell whether the residual is noise: where one does not pass, what the model leaves out may speak against ties that
/// are right.
const OF_RESIDUAL: [CheckName; 5] = [
    CheckName::Residual,
    CheckName::Position,
    CheckName::Delay,
    CheckName::ReversalMask,
    CheckName::Whiteness,
];

/// Whether the logs bear out what ties say. `checks`: the others.
fn ties(id: &Identification, checks: &[CheckResult]) -> Option<CheckResult> {
    let found = id.tie_test.as_ref()?;
    let open = checks.iter().filter(|c| OF_RESIDUAL.contains(&c.name) && c.status != Status::Ok);
    let open: Vec<&str> = open.map(|c| c.name.word()).collect();
    let far: Vec<String> = (found.deviations.iter().take(3))
        .map(|d| format!("`{}` misses by {:.3e} ± {:.1e} {}", d.tie, d.value, d.std, d.unit))
        .collect();
    let meaning = match (found.is_borne_out(), far.is_empty()) {
        (true, _) => format!(
            "with all parameters free the residual falls no further than chance has it ({:.2} % of it), so the logs bear the ties out",
            100.0 * found.relief
        ),
        (false, empty) => format!(
            "with all parameters free {:.1} % of the residual goes, which is beyond chance: {}, and no interval covers that{}{}",
            100.0 * found.relief,
            // What goes with the ties for the most part is theirs.
            match open.is_empty() || found.relief > 0.5 {
                true => "the parts that are tied are not as the ties say".to_owned(),
                false => format!(
                    "the parts that are tied are not as the ties say, or what else the model leaves out ({}) passes for that",
                    open.join(", ")
                ),
            },
            if empty { "" } else { "; " },
            far.join("; ")
        ),
    };
    Some(check(
        graded(found.is_borne_out(), true),
        CheckName::Ties,
        Some(found.f / found.limit).filter(|x| x.is_finite()),
        "",
        "fall of the residual without the ties below its 1 % threshold (1)",
        meaning,
    ))
}

/// Whether the loads that friction follows came to rest.
fn loads(id: &Identification) -> Option<CheckResult> {
    let found = id.loads?;
    let settled = found.change <= LoadRounds::SETTLED;
    let meaning = match settled {
        true => format!(
            "friction follows loads, and loads the parameters: {} rounds brought both together",
            found.rounds
        ),
        false => format!(
            "friction follows loads, and loads the parameters: {} rounds did not bring them together, so columns and intervals are those \
             of other loads than the model predicts with",
            found.rounds
        ),
    };
    Some(check(
        graded(settled, found.change <= 1e-3),
        CheckName::Loads,
        Some(found.change).filter(|x| x.is_finite()),
        "",
        "relative change in the last round at most 1e-6",
        meaning,
    ))
}

/// What the logs tell of joints with clearance.
fn clearance(id: &Identification) -> Option<CheckResult> {
    let journals = id.model.journals()?;
    let moments = journals.journal_joints().zip(journals.coefficients()).filter(|(_, column)| {
        id.trust.parameters.get(*column).is_some_and(|p| p.assessment.verdict != TrustVerdict::Seen || p.wide)
    });
    let moments: Vec<String> = moments.map(|(joint, _)| joint.to_owned()).collect();
    journal_doubt::check(&id.journals, &moments)
}

fn delay(id: &Identification) -> Option<CheckResult> {
    let delay = &id.conditioning.as_ref()?.delay;
    if delay.given {
        return None;
    }
    let chi = delay.chi_squared.unwrap_or(0.0);
    Some(check(
        graded(!delay.at_limit && chi < 3.0, true),
        CheckName::Delay,
        Some(delay.samples),
        "samples",
        "off the limits of the search, joints in agreement (χ²/dof below 3)",
        if delay.at_limit {
            "the delay ran into the limit of the search: it is not a measurement".to_owned()
        } else if chi >= 3.0 {
            format!(
                "the joints disagree about the delay (χ²/dof {chi:.1}): a missing friction shape biases it"
            )
        } else {
            format!("lead of the logged effort before the motion, ± {:.2} samples (95 %)", delay.half_width)
        },
    ))
}

fn mask(id: &Identification) -> Option<CheckResult> {
    let trials = &id.conditioning.as_ref()?.mask_trials;
    let masked = || trials.iter().filter(|t| t.level.is_some());
    let least = masked().map(|t| t.loss).fold(f64::INFINITY, f64::min);
    let most = masked().map(|t| t.loss).fold(0.0, f64::max);
    if masked().count() < 2 {
        return None;
    }
    // Differences within two standard errors are chance.
    let chance = 2.0 * masked().map(|t| t.standard_error).fold(0.0, f64::max);
    let spread = 100.0 * (most / least - 1.0);
    // A ladder that scatters by half its loss tells nothing, chance or not.
    let good = spread <= 50.0 && most - least <= (0.05 * least).max(chance);
    Some(check(
        graded(good, true),
        CheckName::ReversalMask,
        Some(spread),
        "%",
        "below 5 %, or below 50 % and two standard errors",
        if spread <= 5.0 {
            "the result does not depend on how much of the motion near reversal is left out"
        } else if good {
            "held-out errors along the ladder differ by no more than chance"
        } else if most - least <= chance {
            "held-out errors scatter too much to tell how the result depends on the motion near reversal: the log is short"
        } else {
            "held-out error depends on how much of the motion near reversal is left out: low-speed friction is not \
             what the model says"
        },
    ))
}

fn blocks(id: &Identification) -> CheckResult {
    let fitted = &id.fitted;
    let rests_on = match fitted.basis {
        Basis::TimeBlocks => return time_blocks(id),
        Basis::Robots => {
            "standard deviations come from leaving out one robot at a time, so what differs between robots and what colours residuals is covered"
        }
        Basis::Fleet => {
            "standard deviations are those of the mixed model of the fleet: what logs say, and how robots of the type differ"
        }
    };
    let robots = fitted.robots;
    let enough = robots >= 20;
    let few = if enough { "" } else { "; so few robots tell little of how robots of the type differ" };
    let meaning = format!("{rests_on}{few}");
    check(graded(enough, true), CheckName::Robots, Some(robots as f64), "", "at least 20", meaning)
}

fn time_blocks(id: &Identification) -> CheckResult {
    let fitted = &id.fitted;
    let wanted = fitted.block_length.seconds;
    let short = wanted > 1.01 * fitted.block_s;
    let period = id.trained.iter().filter_map(|log| log.repeats_after_s).reduce(f64::min);
    let repeated = match (period, id.trained.iter().any(|log| log.same_motion_as.is_some())) {
        (Some(period), _) if fitted.repetition_unseen => format!(
            " (the motion repeats after {period:.1} s, which is not some whole time blocks: what the model leaves over and comes back with it does \
             not show, so intervals may be far too narrow)"
        ),
        (Some(period), _) => format!(
            " (the motion repeats after {period:.1} s, and what the model leaves over comes back with it: blocks of the same part of the period count as one)"
        ),
        (None, true) => {
            " (logs repeat the motion of others, and what the model leaves over comes back with it: blocks of the same part of it count as one)"
                .to_owned()
        }
        (None, false) => String::new(),
    };
    check(
        graded(id.blocks() >= 20 && !short && !fitted.repetition_unseen, true),
        CheckName::TimeBlocks,
        Some(id.blocks() as f64),
        "",
        "at least 20, each five correlation times of the residual long",
        if !fitted.is_robust() {
            "the logs are too short for standard deviations that survive coloured residuals; those shown assume white ones"
                .to_owned()
        } else if fitted.jackknife.is_none() {
            format!(
                "too few blocks for a jackknife: the standard deviations are those of white residuals times {:.1}, one factor for all \
                 parameters, which what the residuals of the blocks have in common asks for",
                fitted.inflation.sqrt()
            )
        } else if short {
            format!(
                "the residuals stay correlated for so long that independent blocks would take {wanted:.1} s each, found {:.1} s: \
                 the log is too short for honest intervals, those shown are somewhat too narrow",
                fitted.block_s
            )
        } else if id.blocks() >= 20 {
            "standard deviations come from leaving out one block of time at a time, so coloured residuals are covered"
                .to_owned()
        } else {
            "few blocks: the standard deviations are themselves uncertain".to_owned()
        } + &repeated,
    )
}

/// Consistency may cost this many times what chance makes of it before the robot file or the model contradicts the data.
const BEYOND_CHANCE: f64 = 10.0;

/// The price of consistency where nothing is held out: against what chance makes of as many parameters.
fn price_over_chance(id: &Identification, found: &ConsistentEstimate) -> CheckResult {
    let chance = id.fitted.inflation * id.fit().solution.kept.len() as f64;
    let over = if chance > 0.0 { found.price() / chance } else { 0.0 };
    let settled = is_settled(found);
    let meaning = if over <= 1.0 {
        "bodies that can exist, and friction that takes energy out, cost no more of the fit than chance does"
    } else {
        "bodies that can exist, or friction that takes energy out, are not what the logs say: the robot file, the model or the logs are wrong"
    };
    check(
        graded(over <= 1.0 && settled, over <= BEYOND_CHANCE),
        CheckName::PriceOfConsistency,
        Some(over),
        "times chance",
        "at most 1",
        meaning,
    )
}

/// A better fit by up to so many residual variances moves no value by more than 3 % of its standard deviation.
const NEGLIGIBLE_GAP: f64 = 1e-3;

/// Whether a better fit that could matter is ruled out: of a search that ends at rounding the certificate says by how little it may be off.
fn is_settled(found: &ConsistentEstimate) -> bool {
    found.status != ConsistentStatus::Stalled || found.gap <= NEGLIGIBLE_GAP
}

/// Held-out error may rise by this much before consistency counts as dear, percent.
const CHEAP: f64 = 2.0;
/// Beyond this the robot file or the model contradicts the data, percent.
const DEAR: f64 = 10.0;

fn consistency(id: &Identification) -> Option<CheckResult> {
    let found = id.consistent.estimate.as_ref()?;
    let held_out = &id.consistent.held_out;
    let rise = |free: Option<f64>, consistent: Option<f64>| match (free, consistent) {
        (Some(free), Some(consistent)) if free > 0.0 => Some(100.0 * (consistent / free - 1.0)),
        _ => None,
    };
    let folds = rise(held_out.relative(UNCONSTRAINED), held_out.relative(id.consistent.consistent()));
    let logs = id.validation_unconstrained.iter().zip(&id.validation);
    let logs =
        logs.filter_map(|(free, with)| rise(free.filtered.relative_error, with.filtered.relative_error));
    let validation = logs.reduce(f64::max);
    let cost = folds.into_iter().chain(validation).fold(f64::NEG_INFINITY, f64::max);
    if !cost.is_finite() {
        return Some(price_over_chance(id, found));
    }
    let rise = Some(cost);
    let each = match (folds, validation) {
        (Some(folds), Some(logs)) => {
            format!(" ({folds:+.1} % on held-out folds, {logs:+.1} % on validation logs)")
        }
        _ => String::new(),
    };
    let active = {
        let mut names: Vec<String> = found.active.iter().map(|a| format!("`{}`", a.name())).collect();
        names.dedup();
        names.join(", ")
    };
    Some(check(
        graded(cost <= CHEAP && is_settled(found), cost <= DEAR),
        CheckName::PriceOfConsistency,
        rise,
        "%",
        "error on held-out folds and on validation logs rises by at most 2 %",
        if found.status == ConsistentStatus::Unconstrained {
            "the parameters that fit best belong to bodies that can exist".to_owned()
        } else if !is_settled(found) {
            format!(
                "the parameters are consistent, but a better fit by up to {:.2e} residual variances is not ruled out",
                found.gap
            )
        } else if cost <= CHEAP {
            let held = if active.is_empty() { String::new() } else { format!("; held at a limit: {active}") };
            format!("bodies that can exist do about as well as any numbers{each}{held}")
        } else {
            let acting =
                if active.is_empty() { String::new() } else { format!(" where these limits act: {active}") };
            format!(
                "bodies that can exist do worse than numbers without constraints{each}: chance, or something in the model or \
                 in the log is wrong{acting}"
            )
        },
    ))
}

fn whiteness(id: &Identification) -> Option<CheckResult> {
    let tested: Vec<(usize, &InBandWhiteness)> = id
        .whiteness
        .iter()
        .flat_map(|log| log.iter().enumerate().filter_map(|(j, w)| w.as_ref().map(|w| (j, w))))
        .collect();
    let ratio = |w: &InBandWhiteness| w.distance / w.threshold;
    let (joint, worst) = tested.into_iter().max_by(|a, b| ratio(a.1).total_cmp(&ratio(b.1)))?;
    let robust = id.fitted.is_robust();
    Some(check(
        graded(!worst.rejected() || robust, true),
        CheckName::Whiteness,
        Some(ratio(worst)),
        "",
        "largest distance of the cumulative periodogram below its 5 % threshold (1), or robust intervals",
        if !worst.rejected() {
            "inside the band of the fit the residuals look like white noise".to_owned()
        } else {
            let joint = dynid_model::EffortModel::outputs(&id.model)[joint].name.clone();
            let shown = if robust { "; the ones shown are robust" } else { "" };
            format!(
                "the residual of `{joint}` is coloured, most at {:.2} Hz: standard deviations of plain least squares are not \
                 to be believed{shown}. Intervals cover noise, not errors of the model",
                worst.dominant_frequency
            )
        },
    ))
}
