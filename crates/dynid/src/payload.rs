//! Payloads from logs with and without them: mass, centre of mass and inertia with their intervals.

mod body;
mod difference;
mod record;
mod report;

pub use difference::Difference;
pub use record::{PayloadFile, PayloadRecord, Quantity};

use crate::config::{Config, PayloadConfig};
use crate::identify::identify;
use crate::pipeline::{Identification, Step};
use crate::run::Run;
use crate::{Error, trust};

/// An identification with payloads, and what it says about each of them.
#[derive(Debug)]
pub struct PayloadIdentification {
    /// The identification of robot and payloads together.
    pub identification: Run,
    /// One record per payload, in the order of the configuration.
    pub payloads: Vec<PayloadRecord>,
}

/// Identifies the payloads of a configuration. All ten parameters of every payload are unknown; what the configuration
/// states of them stands beside the result.
///
/// Robot and payloads are identified together: the columns of the link that carries a
/// payload count once more in the logs that carry it, robot parameters are shared by all logs, and the pseudo-inertia of
/// the payload is one more body that must be able to exist. That a log deviates in offset or friction is said by `own`.
///
/// # Errors
/// [`Error::Setting`] without a payload, or without a log that carries it and one that does not; those of [`identify`].
pub fn identify_payloads(
    config: &Config,
    progress: &mut dyn FnMut(Step),
) -> Result<PayloadIdentification, Error> {
    config.check()?;
    config.demand_inputs()?;
    if config.payload.is_empty() {
        return Err(Error::setting("payload", "a `[[payload]]` with a `name`", "none"));
    }
    for payload in &config.payload {
        if config.log.iter().all(|log| log.payload.as_ref() == Some(&payload.name)) {
            let expected = "a `[[log]]` without it beside those that carry it";
            return Err(Error::setting(&format!("payload.{}", payload.name), expected, "it in every log"));
        }
    }
    let unknown = |p: &PayloadConfig| PayloadConfig {
        name: p.name.clone(),
        link: p.link.clone(),
        rated_mass: p.rated_mass,
        ..PayloadConfig::default()
    };
    let run = Config { payload: config.payload.iter().map(unknown).collect(), ..config.clone() };
    let identification = identify(&run, progress)?;
    let payloads = config.payload.iter().map(|p| record::of(&identification, p)).collect();
    Ok(PayloadIdentification { identification, payloads })
}

/// What an identification found of the bodies that some of its logs carry, in the order of its settings; those that the settings know altogether
/// are none of it.
pub fn payload_records(id: &Identification) -> Vec<PayloadRecord> {
    let found = |name: &String| id.model.payloads().any(|(p, _)| p.name() == name);
    id.settings.payload.iter().filter(|p| found(&p.name)).map(|p| record::of(id, p)).collect()
}

/// Half width of the intervals in standard deviations.
fn quantile(id: &Identification) -> f64 {
    trust::interval_quantile(&id.fitted)
}
