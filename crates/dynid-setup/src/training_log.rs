//! What has to be known of a training log beside its signals, and the terms that logs ask for.

use crate::Error;
use crate::log::LogReference;
use crate::log_terms::{LogTerms, PayloadTerm, known_inertia};
use crate::robot::Robot;
use crate::settings::{LogSettings, Own, PayloadConfig, Route, Settings};

/// What has to be known of a training log beside its prepared signals.
#[derive(Debug, Clone)]
pub struct TrainingLog {
    /// Name in parameters and messages.
    pub label: String,
    /// Name, payload, what the log has of its own, period.
    pub settings: LogSettings,
    /// What the controller wanted where a trajectory file says so.
    pub reference: Option<LogReference>,
}

impl LogTerms {
    /// Terms of a run. Logs with something of their own deviate from those without; where all have it, from the first.
    ///
    /// # Errors
    /// [`Error::Setting`], [`Error::Unsupported`].
    pub fn of(settings: &Settings, logs: &[TrainingLog], robot: &Robot) -> Result<Self, Error> {
        let mut terms = LogTerms::default();
        for payload in &settings.payload {
            let body = carrier(payload, robot)?;
            let known = known_inertia(payload);
            if let Some(fault) = known.and_then(|inertia| inertia.physical_fault()) {
                let key = format!("payload.{}.inertia", payload.name);
                return Err(Error::setting(&key, "an inertia that a body can have", fault));
            }
            terms.payloads.push(PayloadTerm { config: payload.clone(), body, known });
        }
        terms.deviations = deviations(logs);
        let scaled = terms.deviations.iter().filter(|(_, own)| *own == Own::FrictionScale);
        terms.scales = scaled.map(|(log, _)| (log.clone(), 1.0)).collect();
        let no_factor = match settings.conditioning.route {
            _ if terms.scales.is_empty() => None,
            Route::Textbook => Some("on the textbook route: it searches no shape parameters"),
            _ if settings.elements.known.is_some() => Some("beside known friction, which it does not scale"),
            Route::Compact => None,
        };
        match no_factor {
            Some(why) => Err(Error::Unsupported(format!("`own = [\"friction_scale\"]` {why}"))),
            None => Ok(terms),
        }
    }
}

fn carrier(payload: &PayloadConfig, robot: &Robot) -> Result<usize, Error> {
    let mechanism = &robot.mechanism;
    let bodies = mechanism.bodies();
    let unsupported = |why: &str| Err(Error::Unsupported(format!("payload `{}`: {why}", payload.name)));
    if mechanism.follows().is_some() {
        return unsupported("it has no form for joints that follow others: do not couple mimic joints");
    }
    if bodies.is_empty() {
        return unsupported("where sensors measure the load of every joint no body acts on the drives");
    }
    let names: Vec<&str> = bodies.iter().map(|b| b.name.as_str()).collect();
    if names.contains(&payload.name.as_str()) {
        return Err(Error::setting("payload.name", "a name that no link has", &payload.name));
    }
    let Some(link) = &payload.link else {
        let ends: Vec<usize> =
            (0..bodies.len()).filter(|b| bodies.iter().all(|c| c.parent != Some(*b))).collect();
        return match ends[..] {
            [end] => Ok(end),
            _ => Err(Error::setting(
                &format!("payload.{}.link", payload.name),
                &format!("one of the links `{}`, since the robot has several ends", names.join("`, `")),
                "none",
            )),
        };
    };
    names.iter().position(|n| n == link).ok_or_else(|| {
        let expected = format!("a moving link: `{}`", names.join("`, `"));
        Error::setting(&format!("payload.{}.link", payload.name), &expected, link)
    })
}

/// Deviations of all logs, log by log.
fn deviations(logs: &[TrainingLog]) -> Vec<(String, Own)> {
    let mut out = Vec::new();
    for (k, log) in logs.iter().enumerate() {
        for own in [Own::Offset, Own::Friction, Own::FrictionScale] {
            let all = logs.iter().all(|l| l.settings.own.contains(&own));
            if log.settings.own.contains(&own) && !(all && k == 0) {
                out.push((log.label.clone(), own));
            }
        }
    }
    out
}
