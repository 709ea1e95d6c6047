//! Checks of runs that describe the closed loop of their logs.

use dynid_estimate::distribution::t_quantile;
use dynid_estimate::instruments::{Effect, Exogeneity, ExogeneityVerdict, IterationEnd, Strength};
use dynid_estimate::linear::LinearMethod;
use dynid_model::EffortModel;

use super::{Status, check};
use crate::check::{CheckName, CheckResult};
use crate::closed_loop::{LoopRun, Mismatch};
use crate::identification::Identification;
use crate::settings::Method;

/// Level of the test that is spoken of.
const LEVEL: f64 = 0.05;

/// Efforts along the measured motion are left this many times as large as by least squares, and this share of the effort more: the loop is
/// another one.
const OTHER_LOOP: (f64, f64) = (2.0, 0.002);
/// The same of a loop that may be another one. Noise of the positions makes the residual of least squares too small.
const DOUBTFUL_LOOP: (f64, f64) = (1.1, 0.002);

/// How the simulations of a fit went.
pub(super) fn instruments(id: &Identification) -> Option<CheckResult> {
    let run = id.simulations.as_ref()?;
    if matches!(id.settings.estimator.method, Method::Didim | Method::Cloe) {
        return Some(simulated_motion(id, run));
    }
    let cosine = run.strength.map(|(_, cosine)| cosine);
    let (status, meaning) = match (&run.end, run.strength) {
        (IterationEnd::Diverged { .. }, _) | (_, None) => not_simulated(id, run),
        (_, Some((Strength::Blind, _))) => (
            Status::Warn,
            "the simulated motion does not excite all that the measured one does: parameters are left out".to_owned(),
        ),
        (_, Some((Strength::Weak, _))) => (
            Status::Warn,
            "the simulated motion hardly resembles the measured one: reference, controller or model are wrong, and standard \
             deviations too small"
                .to_owned(),
        ),
        _ => settled(run),
    };
    let limit = "settled, smallest cosine between instruments and regressors at least 0.1";
    Some(check(status, CheckName::Instruments, cosine, "", limit, meaning))
}

/// Whether the motion that DIDIM or CLOE simulated is the measured one.
fn simulated_motion(id: &Identification, run: &LoopRun) -> CheckResult {
    let beyond = |(of_residual, of_effort): (f64, f64)| {
        let found = run.mismatch.iter().filter(|m| m.of_residual > of_residual && m.of_effort > of_effort);
        found.max_by(|a, b| a.of_effort.total_cmp(&b.of_effort))
    };
    let (status, meaning) = match (&run.end, beyond(OTHER_LOOP), beyond(DOUBTFUL_LOOP)) {
        (IterationEnd::Diverged { .. }, ..) => not_simulated(id, run),
        (_, Some(found), _) => (
            Status::Fail,
            format!(
                "{}; reference, gains or delay of `[instruments]` are not those of the log, and these parameters make up for it",
                left(id, found)
            ),
        ),
        (_, None, Some(found)) => (
            Status::Warn,
            format!(
                "{}: noise of the positions that least squares fitted, or a loop that is not quite that of the log (gains, delay, low \
                 pass on velocities, order of the reference)",
                left(id, found)
            ),
        ),
        _ => match far_from_instruments(id) {
            Some(words) => (Status::Warn, words),
            None => settled(run),
        },
    };
    let limit = "settled, efforts along the measured motion explained as by least squares: residual at most 1.1 times, or 0.2 % of the effort more; \
                 no parameter far from that of instruments";
    let ratio = Mismatch::worst(&run.mismatch).map(|m| m.of_residual);
    check(status, CheckName::Instruments, ratio, "", limit, meaning)
}

/// The base parameter furthest from its value by instruments, which need not know the loop well, if that is beyond chance (level 0.05 over all
/// parameters) and beyond the limit of a material bias.
fn far_from_instruments(id: &Identification) -> Option<String> {
    let found = id.comparison.as_ref()?.exogeneity.as_ref()?;
    let effects = found.effects.iter().filter(|e| e.std.1 > 0.0);
    let tests = effects.clone().count() as f64;
    let bound = t_quantile(1.0 - 0.5 * LEVEL / tests, found.blocks as f64 - 1.0)?;
    let value = |e: &Effect| id.fit().x[e.column];
    let distance = |e: &Effect| (value(e) - e.instruments).abs();
    let own = id.standard_deviations();
    // DIDIM has the noise of its efforts in common with instruments, so that the larger deviation bounds that of the distance; CLOE has its own.
    let std = |e: &Effect| match (id.fit().method == LinearMethod::Cloe, own[e.column].0.unwrap_or(0.0)) {
        (true, own) => own.hypot(e.std.1),
        (false, own) => own.max(e.std.1),
    };
    let far = effects.filter(|e| distance(e) > e.limit && distance(e) > bound * std(e));
    let worst = far.max_by(|a, b| (distance(a) / std(a)).total_cmp(&(distance(b) / std(b))))?;
    let parameter = &id.model.parameters().linear[id.base.kept[worst.column]];
    Some(format!(
        "`{}`, {:.4} {}, is {:.1} standard deviations from its value by instruments, {:.4}, which does not take the simulated motion for the true \
         one: the loop is not quite that of the log (gains, delay, low pass on velocities)",
        parameter.name,
        value(worst),
        parameter.unit,
        distance(worst) / std(worst),
        worst.instruments
    ))
}

fn left(id: &Identification, found: &Mismatch) -> String {
    format!(
        "of the measured effort of `{}` these parameters leave {:.1} times as much as least squares, {:.1} % of the effort more",
        id.model.outputs()[found.output].name,
        found.of_residual,
        100.0 * found.of_effort
    )
}

fn not_simulated(id: &Identification, run: &LoopRun) -> (Status, String) {
    let why = diverged(id, run);
    (Status::Fail, format!("{why}: the parameters shown are those of weighted least squares"))
}

fn settled(run: &LoopRun) -> (Status, String) {
    match run.end {
        IterationEnd::Settled => {
            (Status::Ok, format!("parameters and simulated motion settled after {} simulations", run.rounds))
        }
        _ => (
            Status::Warn,
            format!(
                "parameters still moved by {:.1e} after {} simulations",
                run.last_change.unwrap_or(f64::NAN),
                run.rounds
            ),
        ),
    }
}

/// Size of the difference between least squares and instruments.
pub(super) fn closed_loop_bias(id: &Identification) -> Option<CheckResult> {
    let comparison = id.comparison.as_ref()?;
    let found = comparison.exogeneity.as_ref();
    let by_instruments = id.fit().method == LinearMethod::Instrumental;
    // The comparison is between least squares and instruments: DIDIM and CLOE have a check of their own.
    let by_simulation = matches!(id.fit().method, LinearMethod::Didim | LinearMethod::Cloe);
    let status = match found.map(|f| f.verdict) {
        Some(ExogeneityVerdict::Exogenous | ExogeneityVerdict::Harmless) => Status::Ok,
        Some(ExogeneityVerdict::Material) if by_instruments || by_simulation => Status::Ok,
        _ => Status::Warn,
    };
    let worst = found.and_then(Exogeneity::worst).map(|e| e.ratio()).filter(|r| r.is_finite());
    let limit = "no base parameter of least squares further from that of instruments than its limit (1): two standard deviations, or \
                 1 % of the prior deviation";
    Some(check(status, CheckName::ClosedLoopBias, worst, "", limit, in_words(id)?))
}

/// What the comparison comes to, in a sentence or two.
pub(crate) fn in_words(id: &Identification) -> Option<String> {
    let comparison = id.comparison.as_ref()?;
    if let Some(run) = comparison.diverged() {
        return Some(format!("{}: least squares could not be compared with instruments", diverged(id, run)));
    }
    let Some(found) = &comparison.exogeneity else {
        return Some(
            "no parameter is left on which least squares and instruments could be compared".to_owned(),
        );
    };
    let test = match found.robust {
        Some(test) if test.p_value < LEVEL => {
            format!("the test rejects that both agree (p = {:.1e}), ", test.p_value)
        }
        Some(test) => format!("the test finds no disagreement (p = {:.2}), ", test.p_value),
        None => String::new(),
    };
    let parameter = |column: usize| &id.model.parameters().linear[id.base.kept[column]];
    let largest = found.worst().map(|e| {
        let p = parameter(e.column);
        format!(
            "`{}`, {:.4} {} by least squares and {:.4} by instruments, {:.2} of its limit",
            p.name,
            e.least_squares,
            p.unit,
            e.instruments,
            e.ratio()
        )
    });
    let largest = largest.unwrap_or_default();
    Some(match found.verdict {
        ExogeneityVerdict::Exogenous => {
            "the motion simulated along the reference gives the same regressor within a thousandth: there is no noise in it \
             that could bias least squares"
                .to_owned()
        }
        ExogeneityVerdict::Weak => format!(
            "the simulated motion hardly resembles the measured one (smallest cosine {:.2}): it cannot tell whether least squares is \
             biased",
            found.least_cosine
        ),
        ExogeneityVerdict::Harmless => {
            format!("{test}and differences are small; the largest is that of {largest}")
        }
        ExogeneityVerdict::Material => {
            let more = found.effects.iter().filter(|e| e.ratio() > 1.0).count();
            let cure = match id.fit().method {
                LinearMethod::Instrumental => "the parameters shown are those of instruments",
                LinearMethod::Didim | LinearMethod::Cloe => {
                    "the parameters shown are those of simulations, which know nothing of the former"
                }
                _ => "a lower cut-off or `method = \"iv\"` helps against the former",
            };
            format!(
                "{test}and least squares is off by more than its limit for {more} of {} base parameters, most for {largest}: position noise \
                 that the controller feeds back, or an error of the model; {cure}{}",
                found.effects.len(),
                if signs_in_doubt(id) {
                    ". Rows near reversal, where noise turns signs of velocities, are among those compared, which biases both: a \
                     `reversal_mask` leaves them out"
                } else {
                    ""
                }
            )
        }
    })
}

/// Whether rows are in at which noise decides the sign of a velocity.
fn signs_in_doubt(id: &Identification) -> bool {
    let without = |output: usize| id.conditioning.as_ref().is_none_or(|c| c.mask[output].is_none());
    (0..id.model.outputs().len()).any(|o| without(o) && !id.model.reversal_speeds(o).is_empty())
}

fn diverged(id: &Identification, run: &LoopRun) -> String {
    match run.end {
        IterationEnd::Diverged { distance, log, output } if distance.is_finite() => format!(
            "the simulation of {} left its reference by {distance:.2} (rad or m) at `{}` in round {}",
            id.logs.get(log).map_or("a log", |l| &l.name),
            id.model.outputs()[output].name,
            run.rounds
        ),
        _ => "the simulated control loop is not stable".to_owned(),
    }
}
