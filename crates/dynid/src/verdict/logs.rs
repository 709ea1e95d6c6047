//! Several logs: whether they agree, and what single ones have of their own.

use super::{Status, check};
use crate::estimate::CheckResult;
use crate::identify::Identification;

/// Deviations that are shown at most.
const SHOWN: usize = 6;

/// Checks of a run with several logs; none with one.
pub(super) fn checks(id: &Identification) -> Vec<(Status, CheckResult)> {
    agreement(id).into_iter().chain(own(id)).collect()
}

fn agreement(id: &Identification) -> Option<(Status, CheckResult)> {
    let found = id.log_agreement.as_ref()?;
    let most =
        found.deviations.iter().filter(|d| d.disagrees).map(|d| d.effect / d.residual).reduce(f64::max);
    let contradicts = found.contradicts();
    Some(check(
        Status::of(!contradicts, true),
        "agreement of the training logs",
        most.or(found.one_robot.as_ref().map(|r| r.f).filter(|_| contradicts)),
        "",
        "no deviation of a log above a quarter of the residual",
        match contradicts {
            false => "what the fit holds the same in all logs is the same, as far as they tell".to_owned(),
            true => "logs contradict each other in what the fit holds the same: see the warnings".to_owned(),
        },
    ))
}

fn own(id: &Identification) -> Option<(Status, CheckResult)> {
    let columns = id.model.log_columns();
    let values: Vec<_> = id
        .parameter_values(columns)
        .into_iter()
        .filter(|p| p.joint.is_some())
        .filter_map(|p| Some((p.name, p.unconstrained?, p.std?, p.unit)))
        .collect();
    let mut clear: Vec<_> = values.iter().filter(|(_, value, std, _)| value.abs() > 3.0 * std).collect();
    clear.sort_by(|a, b| (b.1 / b.2).abs().total_cmp(&(a.1 / a.2).abs()));
    if values.is_empty() {
        return None;
    }
    let listed: Vec<String> = clear
        .iter()
        .take(SHOWN)
        .map(|(name, value, std, unit)| format!("{name} = {value:+.3} ± {std:.3} {unit}"))
        .collect();
    let more = clear.len().saturating_sub(SHOWN);
    let meaning = match (listed.is_empty(), more) {
        (true, _) => {
            "no log lies off by more than three standard deviations in what it has of its own".to_owned()
        }
        (_, 0) => listed.join("; "),
        _ => format!("{}; and {more} more", listed.join("; ")),
    };
    Some(check(
        Status::Ok,
        "terms of single logs",
        Some(clear.len() as f64),
        &format!("of {} deviations", values.len()),
        "beyond three standard deviations; for information",
        meaning,
    ))
}
