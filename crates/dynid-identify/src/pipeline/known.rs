//! Doubts about known friction.

use dynid_model::Mechanism;
use dynid_model::element::temperature_channel;
use dynid_rows::conditioning::PreparedLog;

use crate::caution::{self, Caution};
use crate::elements::ElementPlan;
use crate::input_record::short_name;
use crate::known_friction::KnownFriction;

/// What helps where known friction does not reach.
const REMEDY: &str = "measure the friction of these joints over the temperatures of the logs: `dynid friction friction.toml`, then \
                      `known_friction = \"dynid-friction/friction.json\"` under `[elements]`";

/// What to know about the known friction of a run: joints that move without a law, and temperatures beyond the
/// range of one.
pub(super) fn warnings(plan: &ElementPlan, mechanism: &Mechanism, logs: &[PreparedLog]) -> Vec<Caution> {
    if plan.known.is_empty() {
        return Vec::new();
    }
    let names = plan.names(mechanism);
    let without: Vec<&str> = names
        .iter()
        .enumerate()
        .filter(|(rate, name)| !plan.per_rate[*rate].is_empty() && plan.known_friction(name).is_none())
        .map(|(_, name)| name.as_str())
        .collect();
    let mut out = Vec::new();
    if !without.is_empty() {
        out.push(format!(
            "no friction is known of `{}`: its coefficients are all of its friction, not errors",
            without.join("`, `")
        ));
    }
    out.extend(plan.known.iter().filter_map(stated_beyond));
    out.extend(logs.iter().flat_map(|log| logged_beyond(&plan.known, log)));
    cautions(out)
}

/// Doubts in words as cautions.
pub(super) fn cautions(doubts: Vec<String>) -> Vec<Caution> {
    doubts.into_iter().map(|message| Caution::warn(caution::KNOWN_FRICTION, message, REMEDY)).collect()
}

/// Temperatures of a log beyond the range of known friction that changes with them.
pub fn logged_beyond(known: &[KnownFriction], log: &PreparedLog) -> Vec<String> {
    known.iter().filter_map(|law| beyond(law, log)).collect()
}

fn range(law: &KnownFriction) -> Option<[f64; 2]> {
    law.temperature_range.filter(|_| law.is_thermal())
}

fn stated_beyond(law: &KnownFriction) -> Option<String> {
    let ([low, high], t) = range(law).zip(law.temperature)?;
    (!(low..=high).contains(&t)).then(|| {
        format!(
            "the stated temperature of `{}`, {t} °C, lies outside of the range of its known friction, {low:.1} to {high:.1} °C: \
             the nearer end counts",
            law.joint
        )
    })
}

fn beyond(law: &KnownFriction, log: &PreparedLog) -> Option<String> {
    let [low, high] = range(law).filter(|_| law.temperature.is_none())?;
    let name = temperature_channel(&law.joint);
    let values = &log.channels.iter().find(|c| c.name == name)?.values;
    let count = values.iter().filter(|t| !(low..=high).contains(*t)).count();
    (count > 0).then(|| {
        format!(
            "{}: {:.0} % of the temperatures of `{}` lie outside of the range of its known friction, {low:.1} to {high:.1} °C: \
             the nearer end counts there",
            short_name(&log.name),
            (100.0 * count as f64 / values.len() as f64).max(1.0),
            law.joint
        )
    })
}
