//! Terms that belong to single logs, as elements gated by channels: payloads, deviations of offset and friction, factors on
//! friction.
//!
//! A gate is a channel that is 1 throughout the logs that a term belongs to and 0 in all others. Estimators therefore see
//! ordinary columns, and a model whose gates are 0 is that of the robot alone.

use dynid_model::element::{
    Coulomb, ElementRegistry, Gated, JointElement, Offset, Payload, Viscous, log_channel, payload_channel,
};
use dynid_model::{Inertia, KnownElement, Mat3, Mechanism, Vec3};
use dynid_motion::Log;

use crate::settings::{LogSettings, Own, PayloadConfig};

/// Elements that a plan has beside those of its joints, each in some logs only.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LogTerms {
    /// Payloads.
    pub payloads: Vec<PayloadTerm>,
    /// Deviations: log, and what deviates there.
    pub deviations: Vec<(String, Own)>,
    /// Logs with a factor on friction, and where a search of it starts.
    pub scales: Vec<(String, f64)>,
}

/// A payload on a body.
#[derive(Debug, Clone, PartialEq)]
pub struct PayloadTerm {
    /// What the configuration says.
    pub config: PayloadConfig,
    /// Body that carries it, in body order.
    pub body: usize,
    /// Known inertia, whose effort is taken off; without it the payload is estimated.
    pub known: Option<Inertia>,
}

impl LogTerms {
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.payloads.is_empty() && self.deviations.is_empty()
    }

    /// What does not belong to payloads.
    #[must_use]
    pub fn without_payloads(self) -> Self {
        LogTerms { payloads: Vec::new(), ..self }
    }

    /// Logs whose friction has a factor of its own, and where a search of it starts.
    pub fn scaled(&self) -> Vec<(String, f64)> {
        self.scales.clone()
    }

    /// Starts the search of a log's factor at a value.
    pub fn set_scale(&mut self, log: &str, value: f64) {
        self.scales.iter_mut().filter(|(name, _)| name == log).for_each(|(_, start)| *start = value);
    }

    /// A log with its gates. `label`: the training log whose own terms it has; `payload`: what it carries.
    #[must_use]
    pub fn with_gates(&self, log: Log, label: Option<&str>, payload: Option<&str>) -> Log {
        let of = |is: bool| if is { 1.0 } else { 0.0 };
        let mut log = log;
        let mut labels: Vec<&str> = self.deviations.iter().map(|(label, _)| label.as_str()).collect();
        labels.dedup();
        for own in labels {
            log = log.with_constant(log_channel(own), of(label == Some(own)));
        }
        for term in &self.payloads {
            let name = term.config.name.as_str();
            log = log.with_constant(payload_channel(name), of(payload == Some(name)));
        }
        log
    }

    /// The gates of a validation log.
    pub fn of_validation(&self, log: Log, settings: &LogSettings) -> Log {
        self.with_gates(log, settings.like.as_deref(), settings.payload.as_deref())
    }

    /// Elements with unknown parameters: payloads, then deviations. `per_rate`: names of the elements of every rate.
    pub fn elements(
        &self,
        mechanism: &Mechanism,
        per_rate: &[Vec<String>],
        registry: &ElementRegistry,
    ) -> Vec<Box<dyn JointElement>> {
        let mut out: Vec<Box<dyn JointElement>> = Vec::new();
        for term in self.payloads.iter().filter(|term| term.known.is_none()) {
            let payload = Payload::new(mechanism, term.body, &term.config.name);
            out.push(Box::new(payload.with_rated_mass(term.config.rated())));
        }
        for (log, own) in &self.deviations {
            for (rate, names) in per_rate.iter().enumerate() {
                let mut add = |element: Box<dyn JointElement>| out.push(Box::new(Gated::new(element, log)));
                match own {
                    Own::Offset if names.iter().any(|n| n == "offset") => add(Box::new(Offset { rate })),
                    Own::Friction if names.iter().any(|n| registry.is_friction(n)) => {
                        add(Box::new(Coulomb { rate }));
                        add(Box::new(Viscous { rate }));
                    }
                    _ => {}
                }
            }
        }
        out
    }

    /// Payloads whose effort is known.
    pub fn known(&self, mechanism: &Mechanism) -> Vec<KnownElement> {
        let known = self.payloads.iter().filter_map(|term| Some((term, term.known?)));
        known
            .map(|(term, inertia)| KnownElement {
                element: Box::new(Payload::new(mechanism, term.body, &term.config.name)),
                linear: inertia.0.to_vec(),
                shape: Vec::new(),
            })
            .collect()
    }
}

/// Inertia about the joint frame of a payload that is known altogether.
pub fn known_inertia(payload: &PayloadConfig) -> Option<Inertia> {
    let (mass, com, i) = (payload.mass?, payload.com?, payload.inertia?);
    let about_com = Mat3::from_rows([[i[0], i[1], i[2]], [i[1], i[3], i[4]], [i[2], i[4], i[5]]]);
    Some(Inertia::from_com(mass, Vec3(com), &about_com))
}
