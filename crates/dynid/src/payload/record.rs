//! What is found of a payload, and the file `payload.json`.

use dynid_estimate::identifiability::{excited_regrouping, posterior};
use dynid_linalg::Mat;
use dynid_model::Inertia;
use dynid_record::{ParameterVerdict, Status};
use serde::{Deserialize, Serialize};

use super::body::{Body, NAMES, about_com, urdf};
use super::difference::{Difference, difference};
use super::{PayloadIdentification, quantile};
use crate::advice;
use crate::config::PayloadConfig;
use crate::estimate::{
    CheckResult, ConsistencyRecord, LogScale, ParameterValue, Provenance, SCHEMA, Verdict,
};
use crate::pipeline::Identification;
use crate::prior::PAYLOAD_SIZE;
use crate::verdict::CheckName;

/// Checks of an identification that say what its logs are worth. The scale of the efforts is told by the stated mass.
const INPUTS: [CheckName; 2] = [CheckName::Preflight, CheckName::OwnLogs];

/// Share of the prior variance that the logs must remove for a value to count as seen.
const SEEN: f64 = 0.9;

/// A value with its uncertainty.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Quantity {
    /// Name.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Value of a body that can exist.
    pub value: f64,
    /// Value without constraints; absent if the mass without constraints is not positive.
    pub unconstrained: Option<f64>,
    /// Standard deviation, the prior's doubt included where the data leave room.
    pub std: f64,
    /// 95 % interval around the value without constraints; absent unless the value is seen in the data.
    pub interval: Option<(f64, f64)>,
    /// Share of the prior variance that the logs remove, 0 to 1.
    pub share: f64,
    /// `seen in the data` or `carried by the prior`.
    pub verdict: ParameterVerdict,
    /// Physical consistency moved the value by more than a standard deviation.
    pub at_boundary: bool,
}

/// A payload as identified.
#[derive(Debug, Clone, Serialize, Deserialize, schemars::JsonSchema)]
pub struct PayloadRecord {
    /// Name.
    pub name: String,
    /// Link that carries it. All coordinates are those of this link's joint frame.
    pub link: String,
    /// Mass.
    pub mass: Quantity,
    /// Centre of mass, three entries.
    pub com: Vec<Quantity>,
    /// Inertia about the centre of mass in the axes of the link: `Jxx, Jxy, Jxz, Jyy, Jyz, Jzz`.
    pub inertia: Vec<Quantity>,
    /// The ten standard parameters about the joint frame.
    pub parameters: Vec<ParameterValue>,
    /// Whether the ten parameters without constraints are those of a body that can exist.
    pub unconstrained_feasible: bool,
    /// The difference of two separate fits, as a check; absent where the logs do not allow it.
    pub difference: Option<Difference>,
    /// Mass that the configuration states, kg.
    pub stated_mass: Option<f64>,
    /// What it comes down to, in a sentence.
    pub sentence: String,
    /// A URDF link of the payload and the fixed joint that mounts it.
    pub urdf: String,
}

/// The file `payload.json`.
#[derive(Debug, Clone, Serialize, Deserialize, schemars::JsonSchema)]
pub struct PayloadFile {
    /// Layout version.
    pub schema: u32,
    /// Robot.
    pub robot: String,
    /// `ok`: mass and centre of mass of every payload are seen in the data, stated masses within their intervals; `warn`: masses
    /// are seen; `fail`: not even these, or not told from none, or the model behind them is not to be trusted.
    pub status: Status,
    /// What it comes down to, in words.
    #[serde(default)]
    pub headline: String,
    /// Payloads.
    pub payloads: Vec<PayloadRecord>,
    /// Deviations of single logs that were identified beside.
    pub log_parameters: Vec<ParameterValue>,
    /// Factors on the friction of single logs that were identified beside.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub log_scales: Vec<LogScale>,
    /// What consistency of robot and payloads together costs.
    pub consistency: Option<ConsistencyRecord>,
    /// What the identification of robot and payloads is worth.
    pub verdict: Verdict,
    /// Inputs and settings.
    pub provenance: Provenance,
}

/// The record of one payload. `run`: the configuration of the identification; `stated`: what was said about the payload.
pub(super) fn of(id: &Identification, stated: &PayloadConfig) -> PayloadRecord {
    let (payload, first) = id
        .model
        .payloads()
        .find(|(p, _)| p.name() == stated.name)
        .unwrap_or_else(|| unreachable!("every payload of the run is one of the model"));
    let ten = |values: &[f64]| Inertia(std::array::from_fn(|k| values[first + k]));
    let regrouping = advice::regrouping(&id.base);
    let (covariance, std) = covariance(id, &regrouping, first);
    let consistent = ten(id.values());
    let body = Body::new(&consistent, &covariance);
    let free = Some(ten(id.unconstrained_values())).filter(|i| i.mass() > 0.0);
    let about = free.map(|inertia| about_com(&inertia));
    let half_mass = 0.5 * stated.rated();
    let t = quantile(id);
    // Of what may weigh nothing there is no centre.
    let weighs = about.is_some_and(|a| a[0] > t * body.std[0]);
    let quantities: Vec<Quantity> = (0..10)
        .map(|k| {
            let prior = half_mass.powi(i32::from(!(1..4).contains(&k))) * PAYLOAD_SIZE.powi(degree(k));
            let share = (1.0 - (body.std[k] / prior).powi(2)).clamp(0.0, 1.0);
            let seen = share >= SEEN && (k == 0 || weighs);
            let unconstrained = about.map(|a| a[k]);
            let moved = unconstrained.map_or(f64::INFINITY, |u| (body.values[k] - u).abs());
            Quantity {
                name: NAMES[k].0.to_owned(),
                unit: NAMES[k].1.to_owned(),
                value: body.values[k],
                unconstrained,
                std: body.std[k],
                interval: unconstrained.filter(|_| seen).map(|u| (u - t * body.std[k], u + t * body.std[k])),
                share,
                verdict: match seen {
                    true => ParameterVerdict::SeenInData,
                    false => ParameterVerdict::CarriedByPrior,
                },
                at_boundary: moved > body.std[k].max(1e-9 * prior),
            }
        })
        .collect();
    let carries: Vec<Option<bool>> = id
        .log_settings
        .iter()
        .map(|(_, log)| match &log.payload {
            None => Some(false),
            Some(name) if *name == stated.name => Some(true),
            Some(_) => None,
        })
        .collect();
    let link = id.model.mechanism().bodies()[payload.body()].name.clone();
    let mut parameters = id.parameter_values(first..first + 10);
    // The posterior's deviations hold whether or not the data see a parameter alone.
    parameters.iter_mut().zip(&std).for_each(|(p, s)| p.std = p.std.or(Some(*s)));
    PayloadRecord {
        sentence: sentence(&stated.name, &quantities, stated),
        urdf: urdf(&stated.name, &link, &body.values),
        name: stated.name.clone(),
        link,
        mass: quantities[0].clone(),
        com: quantities[1..4].to_vec(),
        inertia: quantities[4..].to_vec(),
        parameters,
        unconstrained_feasible: ten(id.unconstrained_values()).physical_fault().is_none(),
        difference: difference(id, &regrouping, payload.body(), &carries),
        stated_mass: stated.mass,
    }
}

/// Power of the size in the prior of a value.
fn degree(k: usize) -> i32 {
    match k {
        0 => 0,
        1..=3 => 1,
        _ => 2,
    }
}

/// Covariance and standard deviations of ten parameters, data and prior put together.
fn covariance(id: &Identification, regrouping: &Mat, first: usize) -> (Mat, Vec<f64>) {
    let fit = id.fit();
    let after = posterior(
        &excited_regrouping(&fit.factor, &fit.solution.kept, regrouping),
        &fit.kept_x(),
        &id.fitted.white,
        0.0,
        id.fitted.covariance(),
        &id.prior.values,
        &id.prior.std,
    );
    let entry = |i: usize, j: usize| match &after {
        Some(after) => after.covariance[(first + i, first + j)],
        // Nothing but the prior where base parameters cannot be put together with it.
        None if i == j => id.prior.std[first + i].powi(2),
        None => 0.0,
    };
    (Mat::from_fn(10, 10, entry), (0..10).map(|k| entry(k, k).max(0.0).sqrt()).collect())
}

fn sentence(name: &str, found: &[Quantity], stated: &PayloadConfig) -> String {
    let mass = &found[0];
    let Some((low, high)) = mass.interval else {
        return format!(
            "the logs do not show the mass of `{name}`: what is said of it is prior knowledge (data {:.0} %)",
            100.0 * mass.share
        );
    };
    if low <= 0.0 {
        return format!(
            "the logs show no payload `{name}`: its mass is not told from none (95 % interval {low:.2e} to {high:.2e} kg); are logs with and \
             without it exchanged or the same, or is it too light?"
        );
    }
    let seen = |c: &Quantity| c.interval.map_or("not seen".to_owned(), |_| format!("{:.1}", 1e3 * c.value));
    let centre = match found[1..4].iter().any(|c| c.interval.is_some()) {
        true => format!(
            "its centre of mass at ({}) mm",
            found[1..4].iter().map(seen).collect::<Vec<_>>().join(", ")
        ),
        false => "of its centre of mass the logs show nothing".to_owned(),
    };
    let beside = stated.mass.map_or_else(String::new, |m| {
        let within = if (low..=high).contains(&m) { "within" } else { "outside of" };
        format!("; the stated {m} kg lie {within} the interval")
    });
    format!("`{name}` weighs {:.3} kg (95 % interval {low:.3} to {high:.3} kg), {centre}{beside}", mass.value)
}

impl PayloadIdentification {
    /// The file `payload.json`.
    pub fn file(&self) -> PayloadFile {
        let estimate = self.identification.estimate();
        let all = |of: &dyn Fn(&PayloadRecord) -> bool| self.payloads.iter().all(of);
        let mass = all(&|p| p.mass.interval.is_some_and(|(low, _)| low > 0.0));
        let centre = all(&|p| p.com.iter().all(|c| c.interval.is_some()));
        // A stated mass that the interval excludes says that the scale of the efforts is wrong, or the statement.
        let agrees = |p: &PayloadRecord| match (p.stated_mass, p.mass.interval) {
            (Some(stated), Some((low, high))) => (low..=high).contains(&stated),
            _ => true,
        };
        // What makes the logs doubtful makes their difference doubtful too.
        let doubted = |c: &CheckResult| c.status == Status::Warn && INPUTS.contains(&c.name);
        let doubtful = estimate.verdict.checks.iter().any(doubted);
        let status = match (estimate.verdict.status, mass, centre && all(&agrees) && !doubtful) {
            (Status::Fail, _, _) | (_, false, _) => Status::Fail,
            (_, true, true) => Status::Ok,
            (_, true, false) => Status::Warn,
        };
        let of_payload = |p: &ParameterValue| p.link.is_some();
        let sentences: Vec<&str> = self.payloads.iter().map(|p| p.sentence.as_str()).collect();
        let headline = match estimate.verdict.status {
            Status::Fail => {
                format!("what stands behind it is not to be trusted: {}", estimate.verdict.headline)
            }
            of_robot => format!(
                "{}. Robot and payloads together ({of_robot}): {}",
                sentences.join("; "),
                estimate.verdict.headline
            ),
        };
        PayloadFile {
            schema: SCHEMA,
            robot: estimate.robot,
            status,
            headline,
            payloads: self.payloads.clone(),
            log_parameters: estimate.log_parameters.into_iter().filter(|p| !of_payload(p)).collect(),
            log_scales: estimate.log_scales,
            consistency: estimate.consistency,
            verdict: estimate.verdict,
            provenance: estimate.provenance,
        }
    }
}

impl PayloadFile {
    /// The file's text.
    pub fn to_json(&self) -> String {
        let mut text = serde_json::to_string_pretty(self)
            .unwrap_or_else(|e| unreachable!("a record holds only plain data: {e}"));
        text.push('\n');
        text
    }
}
