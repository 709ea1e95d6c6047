//! What speaks for the scale of the efforts, which no log tells by itself.
//!
//! Efforts in another unit, or by a wrong torque constant, ask for bodies and friction that are larger or smaller by the same factor and explain
//! the log just as well. A weighed mass settles it; the masses of the robot file speak for it or against it.

use std::collections::BTreeMap;

use dynid_factor::groups::ReducedGroup;
use dynid_model::{BaseParameters, EffortModel, MotionBlock, RegressorBlock, RobotModel};
use dynid_rows::conditioning::{ConditioningSettings, PreparedLog, predict};
use serde::{Deserialize, Serialize};

use crate::Error;
use crate::prior::Prior;
use crate::settings::MASSES;

/// Gravity counts from this share of what stated bodies weigh at their size on (root mean square over the joints).
pub(crate) const GRAVITY_SHARE: f64 = 0.02;
/// Standard gravity, m/s².
pub(crate) const G: f64 = 9.81;
/// Postures of a log that are looked at.
const POSTURES: usize = 500;

/// Where knowledge of the scale comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ScaleSource {
    /// Masses that were weighed (`known_mass`).
    KnownMass,
    /// The configuration says that the efforts are right (`known_effort_scale`).
    Stated,
    /// Bodies that the robot file states.
    RobotFile,
    /// Nothing: the scale is an assumption.
    None,
}

/// A known mass beside the identified one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct WeighedMass {
    /// Payload or link.
    pub name: String,
    /// Mass that is known, kg.
    pub known: f64,
    /// Mass as identified, kg.
    pub identified: f64,
    /// 95 % interval of the identified mass, kg; absent unless the logs see it.
    pub interval: Option<(f64, f64)>,
}

/// What speaks for the scale of the efforts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct EffortScale {
    /// Where knowledge of it comes from.
    pub source: ScaleSource,
    /// Efforts as logged over efforts as they should be, by the source or, where the configuration states the scale, by the robot file; absent
    /// where neither tells.
    pub ratio: Option<f64>,
    /// 95 % interval of the ratio; absent unless masses were weighed.
    pub interval: Option<(f64, f64)>,
    /// Known masses.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub masses: Vec<WeighedMass>,
}

impl Default for EffortScale {
    fn default() -> Self {
        EffortScale { source: ScaleSource::None, ratio: None, interval: None, masses: Vec::new() }
    }
}

impl EffortScale {
    /// From the masses that are known, what is said of the scale, and the ratio that the robot file shows.
    pub(crate) fn of(masses: Vec<WeighedMass>, stated: bool, by_file: Option<f64>) -> EffortScale {
        if !masses.is_empty() {
            // Each is an estimate of the same ratio; the narrowest interval tells most.
            let told = masses.iter().filter_map(|m| {
                let (low, high) = m.interval?;
                Some((m.identified / m.known, (low / m.known, high / m.known)))
            });
            let best = told.min_by(|a, b| (a.1.1 - a.1.0).total_cmp(&(b.1.1 - b.1.0)));
            let (ratio, interval) = (best.map(|b| b.0), best.map(|b| b.1));
            return EffortScale { source: ScaleSource::KnownMass, ratio, interval, masses };
        }
        let source = match (stated, by_file) {
            (true, _) => ScaleSource::Stated,
            (false, Some(_)) => ScaleSource::RobotFile,
            (false, None) => ScaleSource::None,
        };
        EffortScale { source, ratio: by_file, interval: None, masses }
    }

    /// The assumption that all masses, inertias and friction rest on, in a sentence; `None` where a weighed mass settled it.
    pub fn assumption(&self) -> Option<String> {
        const SETTLES: &str = "one weighed mass settles it: a payload in some of the logs (`[[payload]]`), its mass under `[known_mass]`";
        match self.source {
            ScaleSource::KnownMass if self.interval.is_some() => None,
            ScaleSource::KnownMass => Some(format!(
                "the scale of the efforts is assumed, since the logs do not show the known mass; {SETTLES}"
            )),
            ScaleSource::Stated => {
                Some("the scale of the efforts is right, as the configuration states".to_owned())
            }
            ScaleSource::RobotFile => Some(format!(
                "the scale of the efforts is assumed: no log tells it, the masses of the robot file speak for {:.2} of it; {SETTLES}",
                self.ratio.unwrap_or(f64::NAN)
            )),
            ScaleSource::None => Some(format!(
                "the scale of the efforts is assumed: no log tells it and the robot file states no masses that could; {SETTLES}"
            )),
        }
    }
}

/// Checks known masses: names of payloads or links of the model, positive numbers. Gives the column of each.
///
/// # Errors
/// [`Error::Setting`].
pub(crate) fn mass_columns(
    known: &BTreeMap<String, f64>,
    model: &RobotModel,
) -> Result<Vec<(String, usize, f64)>, Error> {
    let table = model.parameters();
    known
        .iter()
        .map(|(name, mass)| {
            let key = format!("known_mass.{name}");
            if !MASSES.contains(mass) {
                return Err(Error::setting(&key, "a positive number, 1e-6 to 1e6 kg", mass));
            }
            let payload = model.payloads().find(|(p, _)| p.name() == name).map(|(_, first)| first);
            let link = || model.mechanism().bodies().iter().position(|b| b.name == *name).map(|b| 10 * b);
            match payload.or_else(link).filter(|c| *c < table.linear.len()) {
                Some(column) => Ok((name.clone(), column, *mass)),
                None => {
                    let bodies = model.mechanism().bodies().iter().map(|b| b.name.as_str());
                    let names: Vec<&str> = model.payloads().map(|(p, _)| p.name()).chain(bodies).collect();
                    let expected =
                        format!("a payload whose mass is identified or a link: {}", names.join(", "));
                    Err(Error::setting(&key, &expected, name))
                }
            }
        })
        .collect()
}

fn rms(signals: &[Vec<f64>]) -> f64 {
    let count = signals.iter().map(Vec::len).sum::<usize>().max(1) as f64;
    (signals.iter().flatten().map(|x| x * x).sum::<f64>() / count).sqrt()
}

/// Identified over stated efforts of bodies on the training logs: of gravity, or where that does not act, of all their motion; `None` where the file
/// states no bodies.
///
/// # Errors
/// [`Error::Conditioning`] if states cannot be formed.
pub(crate) fn by_robot_file(
    model: &RobotModel,
    values: &[f64],
    prior: &Prior,
    logs: &[PreparedLog],
    state_hz: f64,
    settings: &ConditioningSettings,
) -> Result<Option<f64>, Error> {
    if !prior.states_bodies() {
        return Ok(None);
    }
    let bodies = 10 * prior.bodies.len();
    let alone = |values: &[f64]| -> Vec<f64> {
        values.iter().enumerate().map(|(c, x)| if c < bodies { *x } else { 0.0 }).collect()
    };
    let (found, stated) = (alone(values), alone(&prior.values));
    let (mut identified, mut expected) = (Vec::new(), Vec::new());
    for log in logs {
        identified.extend(at_rest(model, &found, log));
        expected.extend(at_rest(model, &stated, log));
    }
    let weight: f64 = prior.bodies.iter().map(|b| G * b.inertia.mass() * b.size).sum();
    if rms(&expected) <= GRAVITY_SHARE * weight {
        let shape = model.parameters().shape_start();
        (identified, expected) = (Vec::new(), Vec::new());
        for log in logs {
            identified.extend(predict(model, &shape, &found, log, state_hz, 0.0, settings)?);
            expected.extend(predict(model, &shape, &stated, log, state_hz, 0.0, settings)?);
        }
    }
    let ratio = rms(&identified) / rms(&expected);
    Ok((ratio.is_finite() && ratio > 0.0).then_some(ratio))
}

/// The same from factors of rows, where samples are gone: of what bodies do in all rows of the widest kernel.
pub(crate) fn by_robot_file_in_rows(
    base: &BaseParameters,
    values: &[f64],
    prior: &Prior,
    groups: &[ReducedGroup],
) -> Option<f64> {
    if !prior.states_bodies() {
        return None;
    }
    let bodies = 10 * prior.bodies.len();
    let alone = |values: &[f64]| -> Vec<f64> {
        let of_bodies = |(c, x): (usize, &f64)| if c < bodies { *x } else { 0.0 };
        base.values(&values.iter().enumerate().map(of_bodies).collect::<Vec<_>>())
    };
    let (found, stated) = (alone(values), alone(&prior.values));
    let squares = |x: &[f64]| -> f64 {
        let widest = groups.iter().filter(|g| g.scale == 0);
        widest
            .map(|g| g.merged(x.len()))
            .map(|f| f.r_matrix().times(x).iter().map(|e| e * e).sum::<f64>())
            .sum()
    };
    let ratio = (squares(&found) / squares(&stated)).sqrt();
    (ratio.is_finite() && ratio > 0.0).then_some(ratio)
}

/// Efforts that parameters ask for at rest in postures of a log, output by output.
fn at_rest(model: &RobotModel, values: &[f64], log: &PreparedLog) -> Vec<Vec<f64>> {
    let step = log.samples().div_ceil(POSTURES).max(1);
    let rows: Vec<usize> = (0..log.samples()).step_by(step).filter(|k| log.usable[*k]).collect();
    let n = rows.len();
    let q: Vec<f64> = log.position.iter().flat_map(|signal| rows.iter().map(|k| signal[*k])).collect();
    let still = vec![0.0; q.len()];
    let channels: Vec<(&str, Vec<f64>)> =
        log.channels.iter().map(|c| (c.name.as_str(), rows.iter().map(|k| c.values[*k]).collect())).collect();
    let channels: Vec<(&str, &[f64])> = channels.iter().map(|(name, x)| (*name, x.as_slice())).collect();
    let motion = MotionBlock { channels: &channels, ..MotionBlock::plain(n, &q, &still, &still) };
    let mut block = RegressorBlock::new(model.layout().clone(), n);
    model.regressor(&motion, &model.parameters().shape_start(), &mut block);
    (0..model.outputs().len()).map(|output| block.effort(output, values)).collect()
}
