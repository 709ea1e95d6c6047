//! Checks of runs that describe the closed loop of their logs.

use dynid_estimate::instruments::{Exogeneity, ExogeneityVerdict, IterationEnd, Strength};
use dynid_estimate::linear::LinearMethod;
use dynid_model::EffortModel;

use super::{Status, check};
use crate::check::{CheckName, CheckResult};
use crate::identification::Identification;
use crate::instruments::InstrumentRun;

/// Level of the test that is spoken of.
const LEVEL: f64 = 0.05;

/// How the instruments of an instrumental-variable fit came about.
pub(super) fn instruments(id: &Identification) -> Option<CheckResult> {
    let run = id.instruments.as_ref()?;
    let cosine = run.strength.map(|(_, cosine)| cosine);
    let (status, meaning) = match (&run.end, run.strength) {
        (IterationEnd::Diverged { .. }, _) | (_, None) => (
            Status::Fail,
            format!("{}: the parameters shown are those of weighted least squares", diverged(id, run)),
        ),
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
        (IterationEnd::Limit, _) => (
            Status::Warn,
            format!(
                "parameters still moved by {:.1e} after {} simulations",
                run.last_change.unwrap_or(f64::NAN),
                run.rounds
            ),
        ),
        (IterationEnd::Settled, _) => (
            Status::Ok,
            format!("parameters and simulated motion settled after {} simulations", run.rounds),
        ),
    };
    let limit = "settled, smallest cosine between instruments and regressors at least 0.1";
    Some(check(status, CheckName::Instruments, cosine, "", limit, meaning))
}

/// Size of the difference between least squares and instruments.
pub(super) fn closed_loop_bias(id: &Identification) -> Option<CheckResult> {
    let comparison = id.comparison.as_ref()?;
    let found = comparison.exogeneity.as_ref();
    let by_instruments = id.fit().method == LinearMethod::Instrumental;
    let status = match found.map(|f| f.verdict) {
        Some(ExogeneityVerdict::Exogenous | ExogeneityVerdict::Harmless) => Status::Ok,
        Some(ExogeneityVerdict::Material) if by_instruments => Status::Ok,
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

fn diverged(id: &Identification, run: &InstrumentRun) -> String {
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
