//! Whether the identified friction takes energy out of the motion.

use dynid_model::{EffortModel, FrictionPassivity as Found, Passivity};

use crate::caution::{self, Caution};
use crate::estimate::{FrictionPassivity, PassivityRecord};
use crate::identification::Identification;
use crate::trained_log::TrainedLog;

/// Least and greatest velocity of an output over all training logs; `None` if none moves it.
pub(crate) fn velocities(logs: &[TrainedLog], output: usize) -> Option<(f64, f64)> {
    let all = logs.iter().filter_map(|log| log.velocities[output]);
    let range = all.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
    range.filter(|(low, high)| low.is_finite() && high.is_finite() && low < high)
}

/// Largest power that friction feeds in, W.
fn fed(found: &Found) -> f64 {
    found.worst.map_or(0.0, |(_, power)| power)
}

impl Identification {
    /// Channels of the identified model at their least and at their greatest values of the training logs.
    pub fn held_channels(&self) -> Vec<Vec<(&str, f64)>> {
        let (model, _) = self.robot_alone();
        let names = model.channels();
        if names.is_empty() {
            return vec![Vec::new()];
        }
        let extreme = |name: &String, pick: fn(f64, f64) -> f64| {
            let channels = self.trained.iter().flat_map(|log| &log.channels).filter(|c| c.0 == *name);
            channels.flat_map(|c| [c.1, c.2]).reduce(pick).unwrap_or(0.0)
        };
        [f64::min, f64::max]
            .map(|pick| names.iter().map(|name| (name.as_str(), extreme(name, pick))).collect())
            .to_vec()
    }

    /// Passivity of the identified friction on the velocities that the training logs reach, joint by joint, at the worse of
    /// the coldest and the warmest state logged; joints without friction and those that no log moves are left out.
    pub fn friction_passivity(&self) -> Vec<PassivityRecord> {
        let (model, linear) = self.robot_alone();
        let shape = model.parameters().shape_start();
        let outputs = self.model.outputs().iter().enumerate();
        outputs
            .filter_map(|(rate, output)| {
                let known = self.plan.known_friction(&output.name).is_some();
                if !known
                    && !self.plan.per_rate[self.model.tree_rate(rate)]
                        .iter()
                        .any(|name| self.plan.registry().is_friction(name))
                {
                    return None;
                }
                let (low, high) = velocities(&self.trained, rate)?;
                let found = self
                    .held_channels()
                    .iter()
                    .map(|held| model.friction_passivity(rate, &shape, linear, (low, high), held))
                    .max_by(|a, b| fed(a).total_cmp(&fed(b)))?;
                let (passivity, intervals) = match found.passivity {
                    Passivity::Passive => (FrictionPassivity::Passive, Vec::new()),
                    Passivity::PassiveOn(intervals) => (FrictionPassivity::PassiveOn, intervals),
                    Passivity::NotPassive => (FrictionPassivity::NotPassive, Vec::new()),
                };
                Some(PassivityRecord {
                    joint: output.name.clone(),
                    velocity_range: (low, high),
                    passivity,
                    intervals,
                    worst_velocity: found.worst.map(|(v, _)| v),
                    worst_power: found.worst.map(|(_, power)| power),
                    // Errors of known friction may have any order.
                    static_below_coulomb: found.static_below_coulomb && !known,
                })
            })
            .collect()
    }

    /// Warnings about friction that drives the motion, and about static friction below Coulomb friction.
    pub(crate) fn friction_warnings(&self) -> Vec<Caution> {
        let records = self.friction_passivity();
        let mut out: Vec<Caution> = records
            .iter()
            .filter(|r| r.passivity != FrictionPassivity::Passive)
            .map(|r| {
                let remedy = match self.plan.known_friction(&r.joint) {
                    Some(_) => "The errors of its known friction outweigh it: look at both with doubt, or keep them positive \
                         (`friction_errors = \"nonnegative\"`)"
                        .to_owned(),
                    None => format!(
                        "{}, or ask for a simpler law (`--friction linear`)",
                        self.bound_on_friction(&r.joint)
                    ),
                };
                let message = format!(
                    "the identified friction of `{}` is {}; a simulator with it may not come to rest. {remedy}",
                    r.joint,
                    in_words(r, self.speed_unit(&r.joint)),
                );
                Caution::warn(caution::FRICTION, message, remedy)
            })
            .collect();
        let rising: Vec<&str> =
            records.iter().filter(|r| r.static_below_coulomb).map(|r| r.joint.as_str()).collect();
        if !rising.is_empty() {
            let message = format!(
                "static friction of `{}` is identified below Coulomb friction (`fs` < `fc`): friction rises from rest, which is \
                 no Stribeck effect, and `fs` and `vs` tell the shape of the law alone. Take a law that rises from rest \
                 (`--friction tanh`) or a simpler one (`--friction linear`), or bound `{}.fs` from below (`[[bound]]`)",
                rising.join("`, `"),
                rising[0]
            );
            let remedy = "a law that rises from rest, `friction = \"tanh\"`, or a simpler one, `friction = \"linear\"`, under `[elements]`";
            out.push(Caution::warn(caution::FRICTION, message, remedy));
        }
        out
    }

    /// The remedy that keeps the law: coefficients that must not be negative.
    fn bound_on_friction(&self, joint: &str) -> String {
        let (model, linear) = self.robot_alone();
        let table = &model.parameters().linear;
        let coefficient = |name: &str| match name.rsplit_once('.') {
            Some((owner, symbol)) => owner == joint && self.plan.registry().is_coefficient(symbol),
            None => false,
        };
        let negative = table.iter().zip(linear).filter(|(p, value)| **value < 0.0 && coefficient(&p.name));
        let names: Vec<String> = negative.map(|(p, _)| format!("`{}`", p.name)).collect();
        let what = match names.is_empty() {
            true => "its coefficients".to_owned(),
            false => format!("{} to at least 0", names.join(" and ")),
        };
        // Bounds are kept by the consistent estimate alone.
        let ask = if self.consistent.estimate.is_some() {
            "Bound"
        } else {
            "Ask for physical consistency and bound"
        };
        format!("{ask} {what} (`[[bound]]`)")
    }

    /// Unit of a joint's velocity.
    pub fn speed_unit(&self, joint: &str) -> &'static str {
        match self.model.outputs().iter().find(|o| o.name == joint) {
            Some(output) if output.unit == "N" => "m/s",
            _ => "rad/s",
        }
    }
}

/// Where the friction is passive, after "is".
pub(crate) fn in_words(record: &PassivityRecord, unit: &str) -> String {
    let range =
        |(low, high): (f64, f64)| format!("from {} to {} {unit}", three_digits(low), three_digits(high));
    let all = range(record.velocity_range);
    let worst = match (record.worst_velocity, record.worst_power) {
        (Some(v), Some(power)) => {
            format!("it drives the motion, most at {} {unit} with {} W", three_digits(v), three_digits(power))
        }
        _ => "it drives the motion".to_owned(),
    };
    match record.passivity {
        FrictionPassivity::Passive => format!("passive {all}, all that the training logs reach"),
        FrictionPassivity::PassiveOn => {
            let parts: Vec<String> = record.intervals.iter().copied().map(range).collect();
            format!(
                "passive {} alone; elsewhere {all}, the range of the training logs, {worst}",
                parts.join(" and ")
            )
        }
        FrictionPassivity::NotPassive => {
            format!("nowhere passive {all}, the range of the training logs: {worst}")
        }
    }
}

/// What there is to say about a law in its chart.
pub fn sentence(record: &PassivityRecord, unit: &str) -> String {
    let words = in_words(record, unit);
    let mut out = words[..1].to_uppercase() + &words[1..] + ".";
    if record.static_below_coulomb {
        out.push_str(" Static friction is identified below Coulomb friction.");
    }
    out
}

/// `x` rounded to three significant digits.
fn three_digits(x: f64) -> String {
    format!("{x:.2e}").parse::<f64>().map_or_else(|_| x.to_string(), |rounded| rounded.to_string())
}
