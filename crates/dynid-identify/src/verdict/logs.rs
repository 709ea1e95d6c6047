//! Several logs: whether they agree, and what single ones have of their own.

use dynid_model::element::scale_name;

use super::{Status, check, graded};
use crate::check::{CheckName, CheckResult};
use crate::identification::Identification;

/// Deviations that are shown at most.
const SHOWN: usize = 6;

/// Checks of a run with several logs; none with one.
pub(super) fn checks(id: &Identification) -> Vec<CheckResult> {
    agreement(id).into_iter().chain(own(id)).collect()
}

fn agreement(id: &Identification) -> Option<CheckResult> {
    let found = id.log_agreement.as_ref()?;
    let most =
        found.deviations.iter().filter(|d| d.disagrees).map(|d| d.effect / d.residual).reduce(f64::max);
    let contradicts = found.contradicts();
    Some(check(
        graded(!contradicts, true),
        CheckName::AgreementOfLogs,
        most.or(found.one_robot.as_ref().map(|r| r.f).filter(|_| contradicts)),
        "",
        "no deviation of a log above a quarter of the residual",
        match contradicts {
            false => "what the fit holds the same in all logs is the same, as far as they tell".to_owned(),
            true => "logs contradict each other in what the fit holds the same: see the warnings".to_owned(),
        },
    ))
}

/// What a log has of its own: name, value, the value without it, standard deviation, unit.
struct Own {
    name: String,
    value: f64,
    nothing: f64,
    std: f64,
    unit: String,
}

impl Own {
    /// Standard deviations off.
    fn off(&self) -> f64 {
        (self.value - self.nothing).abs() / self.std
    }

    fn words(&self) -> String {
        let Own { name, value, std, unit, .. } = self;
        match unit.as_str() {
            "1" => format!("{name} = {value:.3} ± {std:.3}"),
            _ => format!("{name} = {value:+.3} ± {std:.3} {unit}"),
        }
    }
}

fn own(id: &Identification) -> Option<CheckResult> {
    let columns = id.model.log_columns();
    let deviations = id.parameter_values(columns).into_iter().filter(|p| p.joint.is_some());
    let deviations = deviations.filter_map(|p| {
        Some(Own { name: p.name, value: p.unconstrained?, nothing: 0.0, std: p.std?, unit: p.unit })
    });
    let scales = id.log_scales().into_iter().filter_map(|s| {
        let name = scale_name(&s.log);
        Some(Own { name, value: s.value, nothing: 1.0, std: s.std?, unit: "1".to_owned() })
    });
    let values: Vec<Own> = deviations.chain(scales).collect();
    let mut clear: Vec<&Own> = values.iter().filter(|own| own.off() > 3.0).collect();
    clear.sort_by(|a, b| b.off().total_cmp(&a.off()));
    if values.is_empty() {
        return None;
    }
    let listed: Vec<String> = clear.iter().take(SHOWN).map(|own| own.words()).collect();
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
        CheckName::TermsOfLogs,
        Some(clear.len() as f64),
        &format!("of {}", values.len()),
        "beyond three standard deviations; for information",
        meaning,
    ))
}
