//! What logs tell of joints with clearance.

use dynid_model::{EffortModel, RobotModel};
use dynid_motion::signal::rms;
use dynid_rows::conditioning::{ConditioningSettings, PreparedLog, States};

use crate::Error;
use crate::check::{CheckName, CheckResult};
use crate::input_record::short_name;
use dynid_record::Status;

/// Offsets of probes beyond this part of the stated clearance, or below its inverse, are taken for another unit or another bearing.
const FAR: f64 = 2.0;
/// A load that falls below this part of its mean may leave its journal free.
const LOOSE: f64 = 0.1;

/// A journal over a log.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct JournalSeen {
    joint: String,
    log: String,
    /// Stated radial clearance, m.
    gap: f64,
    /// Median length of the offsets of probes, m; `None` without probes.
    offset: Option<f64>,
    /// Root mean square of what offsets add to the effort of the joint, and of the noise of that, N m.
    added: [f64; 2],
    /// Least load as a part of the mean one.
    least: f64,
}

/// Journals of a model over its logs; none where joints are ideal.
///
/// # Errors
/// [`Error::Conditioning`].
pub(crate) fn look(
    model: &RobotModel,
    logs: &[PreparedLog],
    state_hz: f64,
    settings: &ConditioningSettings,
) -> Result<Vec<JournalSeen>, Error> {
    let Some(journals) = model.journals() else { return Ok(Vec::new()) };
    let mut out = Vec::new();
    for log in logs {
        let states = States::of_motion(log, state_hz, settings)?;
        let seen = states.with_block(0..states.samples, &log.channels, &[], |motion| journals.look(motion));
        for (contact, mut journal) in journals.contacts().zip(seen) {
            let mean = journal.load.iter().sum::<f64>() / journal.load.len().max(1) as f64;
            let least = journal.load.iter().copied().fold(f64::INFINITY, f64::min);
            let middle = journal.offset.len() / 2;
            let offset = match journal.probed {
                true => Some(*journal.offset.select_nth_unstable_by(middle, f64::total_cmp).1),
                false => None,
            };
            out.push(JournalSeen {
                joint: model.outputs()[contact.rotation].name.clone(),
                log: short_name(&log.name),
                gap: contact.law.clearance(),
                offset,
                added: [rms(&journal.added), log.effort_noise[contact.rotation].sigma],
                least: if mean > 0.0 { least / mean } else { 0.0 },
            });
        }
    }
    Ok(out)
}

impl JournalSeen {
    /// What does not fit, in words.
    fn doubt(&self) -> Option<String> {
        let JournalSeen { joint, log, gap, offset, least, .. } = self;
        let micro = |x: f64| format!("{:.3} µm", 1e6 * x);
        match offset {
            Some(offset) if !(gap / FAR..=gap * FAR).contains(offset) => Some(format!(
                "{log}: probes see the journal of `{joint}` {} off its centre, where its bearing is stated to leave {}: another unit, another zero, \
                 or another bearing",
                micro(*offset),
                micro(*gap)
            )),
            None if *least < LOOSE => Some(format!(
                "{log}: the load on the journal of `{joint}` falls to {:.0} % of its mean: it need not rest in its bearing then, and nothing says \
                 where it is",
                100.0 * least
            )),
            _ => None,
        }
    }
}

/// The check; `None` where joints are ideal. `as_moment`: joints whose friction is seen as a moment alone.
pub(crate) fn check(seen: &[JournalSeen], as_moment: &[String]) -> Option<CheckResult> {
    let most = seen.iter().max_by(|a, b| (a.added[0] / a.added[1]).total_cmp(&(b.added[0] / b.added[1])))?;
    let doubts: Vec<String> = seen.iter().filter_map(JournalSeen::doubt).collect();
    let source = match seen.iter().filter(|s| s.offset.is_some()).count() {
        0 => {
            "no log has probes, so that journals count as resting in their bearings and what they swing stays in the residual"
        }
        n if n == seen.len() => "probes tell where the journals are",
        _ => "some logs have probes, in the others journals count as resting in their bearings",
    };
    let masses = match as_moment {
        [] => String::new(),
        joints => format!(
            "; the friction of {} is seen as a moment, as a coefficient no better than the masses that press (weigh the links, and state them: \
             `[[tie]] known = {{ \"LINK.m\" = 2.1 }}`)",
            joints.iter().map(|j| format!("`{j}`")).collect::<Vec<_>>().join(", ")
        ),
    };
    let meaning = match doubts.is_empty() {
        true => format!(
            "{source}; offsets add {:.2e} N m rms to the effort of `{}`, {:.1} times its noise{masses}",
            most.added[0],
            most.joint,
            most.added[0] / most.added[1]
        ),
        false => doubts.join("; "),
    };
    Some(CheckResult {
        name: CheckName::Clearance,
        status: if doubts.is_empty() { Status::Ok } else { Status::Warn },
        value: seen.iter().map(|s| s.least).reduce(f64::min).filter(|x| x.is_finite()),
        unit: String::new(),
        limit: format!(
            "least load at least {LOOSE} of the mean, or probes; offsets within a factor of {FAR} of the stated clearance"
        ),
        meaning,
    })
}
