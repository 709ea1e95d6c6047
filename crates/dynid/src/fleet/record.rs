//! `fleet.json`.

use std::collections::BTreeMap;

use dynid_estimate::distribution::t_quantile;
use dynid_fleet::drift::{History, Kind};
use dynid_fleet::{FEW, LEAST_HALVED, LogDifference, Noise};
use dynid_identify::reduction::{BACKLASH, COMPLIANCE, DELAY, HYSTERESIS, LAG};
use dynid_record::{Basis, Outcome, words};
use serde::{Deserialize, Serialize};

use super::failure::Failure;
use super::{FleetResult, changes_of, manifest};
use crate::estimate::{Provenance, SCHEMA};

/// Noise in the directions of the motion beyond this many times what lies between them hints at a wrong model.
const COLOURED: f64 = 30.0;
/// A parameter of the type whose prior gives more than this share of its standard deviation is not told by logs.
const FROM_PRIOR: f64 = 0.5;
/// Fewer robots than this are no sample of their type.
const SAMPLE: usize = 10;
/// A robot that moves a parameter of the type by more than its standard deviation is named.
const INFLUENCE: f64 = 1.0;

words! {
    /// What can be said of a robot.
    RobotState {
        /// Like the others, and no change.
        Usual = "usual",
        /// A parameter is out of the spread of the fleet.
        StandsOut = "stands_out",
        /// A parameter has changed.
        Changed = "changed",
        /// It has changed with many others at once: a matter of the site.
        SiteEvent = "site_event",
    }
}

words! {
    /// How a parameter changes.
    ChangeKind {
        /// At once.
        Step = "step",
        /// Evenly from a time on.
        Ramp = "ramp",
        /// Either explains the logs.
        Either = "either",
    }
}

impl From<Kind> for ChangeKind {
    fn from(kind: Kind) -> Self {
        match kind {
            Kind::Step => ChangeKind::Step,
            Kind::Ramp => ChangeKind::Ramp,
            Kind::Either => ChangeKind::Either,
        }
    }
}

/// The output of `dynid fleet`.
#[derive(Debug, Clone, Serialize, Deserialize, schemars::JsonSchema)]
pub struct FleetFile {
    /// Layout version.
    pub schema: u32,
    /// Type of the robots, as the recipe names it.
    pub robot_type: String,
    /// Whether the numbers may be used: `warn` with a reservation, which is among the warnings. Robots that change are no reservation.
    pub status: Outcome,
    /// The result in a sentence.
    pub headline: String,
    /// SHA-256 of the recipe.
    pub recipe: String,
    /// Parameters of the type.
    pub parameters: Vec<FleetParameter>,
    /// Numbers of the manifest that parameters follow.
    pub covariates: Vec<CovariateRecord>,
    /// Noise of the efforts.
    pub noise: Vec<ChannelRecord>,
    /// Robots, by name.
    pub robots: Vec<RobotRecord>,
    /// Logs that stand out from those of their robot.
    pub logs_to_look_at: Vec<LogRecord>,
    /// What logs carried, where the recipe lets them differ in it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub payload: Option<PayloadRecord>,
    /// Changes of many robots at once.
    pub events: Vec<EventRecord>,
    /// Logs that could not be reduced or read.
    pub failures: Vec<Failure>,
    /// Logs that were there twice and counted once.
    pub repeated: usize,
    /// Warnings.
    pub warnings: Vec<String>,
    /// Inputs and settings.
    pub provenance: Provenance,
}

/// A parameter of the type.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct FleetParameter {
    /// Name.
    pub name: String,
    /// Unit of the value and all that follows.
    pub unit: String,
    /// Value at the mean of the covariates.
    pub value: f64,
    /// Standard deviation of that, by leaving out one robot after the other; by the model where the others do not tell all parameters.
    pub sd: f64,
    /// Interval of 95 %.
    pub interval: (f64, f64),
    /// Whether logs tell it, and not what is held for possible beforehand.
    pub seen: bool,
    /// Standard deviation between robots; absent where all share it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub between_robots: Option<f64>,
    /// Standard deviation between logs of a robot; absent where they share it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub between_logs: Option<f64>,
}

/// A number that parameters follow.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct CovariateRecord {
    /// Name.
    pub name: String,
    /// Mean over the logs.
    pub mean: f64,
    /// Change of every varying parameter per unit of it.
    pub slopes: Vec<SlopeRecord>,
}

/// How a parameter follows a covariate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct SlopeRecord {
    /// Parameter.
    pub parameter: String,
    /// Change per unit of the covariate.
    pub value: f64,
    /// Standard deviation of that.
    pub sd: f64,
    /// Standard deviation of the robots' own slopes about it; absent where dates are not known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub between_robots: Option<f64>,
}

/// Noise of an effort behind a kernel, or of the deformation of a joint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct ChannelRecord {
    /// Joint or motor, or `deformation of` a joint with encoders on both sides of its gear.
    pub output: String,
    /// Kernel, Hz; absent for deformations.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kernel_hz: Option<f64>,
    /// Median over the logs of the standard deviation of a row, in the unit of the effort, rad (m) of deformations.
    pub sd: f64,
    /// Variance in the directions of the motion over that between them, 1 for white noise.
    pub colour: f64,
}

/// A robot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct RobotRecord {
    /// Name.
    pub name: String,
    /// What can be said of it.
    pub state: RobotState,
    /// Logs.
    pub logs: usize,
    /// Start of the first and the last log, s since 1970; absent without dates.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dates_s: Option<(f64, f64)>,
    /// Its varying parameters.
    pub parameters: Vec<RobotParameter>,
    /// Parameters that are out of the spread of the fleet.
    pub stands_out: Vec<OutlierRecord>,
    /// Changes with time, largest evidence first.
    pub changes: Vec<ChangeRecord>,
    /// Probability of the largest evidence in a robot without a change; absent where the history is too short.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub p: Option<f64>,
    /// By how many standard deviations it moves the parameter of the type that it moves most.
    pub influence: f64,
}

/// A varying parameter of a robot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct RobotParameter {
    /// Name.
    pub name: String,
    /// Value at the mean of the covariates; of a robot that has changed, at its last log.
    pub value: f64,
    /// Interval of 95 %.
    pub interval: (f64, f64),
    /// Whether the interval was cut at zero, below which the parameter makes no sense.
    pub cut_at_zero: bool,
    /// Deviation from the type over the spread between robots.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub deviation: Option<f64>,
    /// Smallest step at the middle of the logs that would have been found; absent where dates are not known or logs do not tell it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub detectable: Option<f64>,
}

/// A parameter out of the spread of the fleet.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct OutlierRecord {
    /// Parameter.
    pub parameter: String,
    /// Deviation from the type over the spread between robots.
    pub deviation: f64,
    /// Probability of that in a robot like the others.
    pub p: f64,
}

/// A change of a parameter.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct ChangeRecord {
    /// Parameter.
    pub parameter: String,
    /// How it changes.
    pub kind: ChangeKind,
    /// Change at the last log, in the unit of the parameter.
    pub size: f64,
    /// Standard deviation of that, if the pattern is right.
    pub sd: f64,
    /// Fall of minus twice the logarithm of the likelihood by it.
    pub evidence: f64,
    /// Probability of that in a robot without a change.
    pub p: f64,
    /// When: the middle between the logs of a step, the onset of a ramp.
    pub date: DatedRecord,
    /// What it points to.
    pub hint: String,
}

/// A date and its interval.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct DatedRecord {
    /// s since 1970.
    pub at_s: f64,
    /// Dates that explain the logs as well.
    pub from_s: f64,
    /// The last of them.
    pub to_s: f64,
    /// The same in words, UTC.
    pub text: String,
}

/// A log that stands out from those of its robot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct LogRecord {
    /// Log.
    pub log: String,
    /// Robot.
    pub robot: String,
    /// Where it stands out, most first.
    pub parameters: Vec<LogDeviation>,
}

/// How a log stands out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct LogDeviation {
    /// Parameter.
    pub parameter: String,
    /// Deviation from the robot over the scatter between logs.
    pub deviation: f64,
    /// Probability of that in a log like the others.
    pub p: f64,
}

/// What logs carried on a link.
///
/// Factors tell differences alone: what all logs carry is part of the link. Beyond a log `0` that carried nothing, log `l` carried the mass
/// `m_l - m_0`, and its centre is `(h_l - h_0)/(m_l - m_0)` in the frame of the joint that moves the link, `h` the first moments.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct PayloadRecord {
    /// Link.
    pub link: String,
    /// Parameters of the link that the efforts tell.
    pub parameters: Vec<CarriedParameter>,
    /// Logs, robot by robot in the order of time.
    pub logs: Vec<CarriedByLog>,
}

/// A parameter of a link that carries something.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct CarriedParameter {
    /// Name.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Standard deviation between logs.
    pub between_logs: f64,
}

/// What a log carried beyond the mean of all logs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct CarriedByLog {
    /// Log.
    pub log: String,
    /// Robot.
    pub robot: String,
    /// Per parameter: what it was in the log, less the mean over all logs.
    pub difference: Vec<f64>,
    /// Per parameter: standard deviation of that, as halves of logs tell it; of fewer than twenty such logs that of noise alone, and a warning says so.
    pub sd: Vec<f64>,
}

/// A change of many robots at once.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct EventRecord {
    /// First date, s since 1970.
    pub from_s: f64,
    /// Last date.
    pub to_s: f64,
    /// The dates in words, UTC.
    pub text: String,
    /// Robots.
    pub robots: Vec<String>,
}

impl FleetFile {
    /// The file as text.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }
}

impl FleetResult {
    /// What the fit leaves behind.
    pub fn file(&self) -> FleetFile {
        let (parameters, mut warnings) = (self.parameters(), self.built.warnings.clone());
        warnings.extend(self.doubts(&parameters));
        let robots: Vec<RobotRecord> = (0..self.fleet.robots.len()).map(|r| self.robot(r)).collect();
        let logs_to_look_at = self.logs_to_look_at();
        let event = |e: &dynid_fleet::drift::SiteEvent| EventRecord {
            from_s: e.from_s,
            to_s: e.to_s,
            text: format!("{} to {}", manifest::day(e.from_s), manifest::day(e.to_s)),
            robots: e.robots.iter().map(|r| self.built.robots[*r].clone()).collect(),
        };
        let events: Vec<EventRecord> = self.drift.iter().flat_map(|d| &d.events).map(event).collect();
        let count = |state| robots.iter().filter(|r| r.state == state).count();
        let mut headline = format!(
            "{} robots, {} logs: {} changed, {} out of the spread of the fleet, {} logs to look at, {} failed.",
            robots.len(),
            self.fleet.logs.len(),
            count(RobotState::Changed),
            robots.iter().filter(|r| !r.stands_out.is_empty()).count(),
            logs_to_look_at.len(),
            self.failures.len()
        );
        if !events.is_empty() {
            headline +=
                &format!(" {} times many robots changed at once: a matter of the site.", events.len());
        }
        let settings = serde_json::to_value(&self.settings).unwrap_or_default();
        FleetFile {
            schema: SCHEMA,
            robot_type: self.recipe.robot.clone(),
            status: if warnings.is_empty() { Outcome::Pass } else { Outcome::Warn },
            headline,
            recipe: self.recipe.hash(),
            parameters,
            covariates: self.covariates(),
            noise: self.noise(),
            robots,
            logs_to_look_at,
            payload: self.payload(),
            events,
            failures: self.failures.clone(),
            repeated: self.repeated,
            warnings,
            provenance: Provenance { settings, inputs: self.recipe.inputs.clone(), ..Provenance::default() },
        }
    }

    /// Name of coordinate `k`.
    pub(super) fn name(&self, k: usize) -> String {
        self.built.columns[self.fleet.varying[k].column].name.clone()
    }

    /// Unit of coordinate `k`.
    pub(super) fn unit(&self, k: usize) -> String {
        self.built.columns[self.fleet.varying[k].column].unit.clone()
    }

    fn parameters(&self) -> Vec<FleetParameter> {
        let fit = &self.fit;
        let robots = fit.robots.iter().flatten().count() as f64;
        let quantile = t_quantile(0.975, (robots - 1.0).max(1.0)).unwrap_or(f64::NAN);
        let of = |(c, column): (usize, &crate::reduce::Column)| {
            let variance = fit.jackknife.as_ref().unwrap_or(&fit.covariance)[(c, c)];
            let sd = variance.max(0.0).sqrt();
            let k = self.fleet.varying.iter().position(|v| v.column == c);
            let spread = |variances: &[f64], varies: fn(&dynid_fleet::Coordinate) -> bool| {
                k.filter(|k| varies(&self.fleet.varying[*k])).map(|k| variances[k].sqrt())
            };
            FleetParameter {
                name: column.name.clone(),
                unit: column.unit.clone(),
                value: fit.values[c],
                sd,
                interval: (fit.values[c] - quantile * sd, fit.values[c] + quantile * sd),
                seen: fit.covariance[(c, c)].sqrt() < FROM_PRIOR * column.scale,
                between_robots: spread(&fit.variances.robots, |v| v.between_robots),
                between_logs: spread(&fit.variances.logs, |v| v.between_logs),
            }
        };
        self.built.columns.iter().enumerate().map(of).collect()
    }

    fn covariates(&self) -> Vec<CovariateRecord> {
        let fit = &self.fit;
        let slope = |c: usize, k: usize| SlopeRecord {
            parameter: self.name(k),
            value: fit.slopes[c][k],
            sd: fit.slope_sds[c][k],
            between_robots: self.drift.as_ref().map(|d| d.slope_variances[c][k].sqrt()),
        };
        let of = |(c, name): (usize, &String)| CovariateRecord {
            name: name.clone(),
            mean: fit.covariate_means[c],
            slopes: (0..self.fleet.varying.len()).map(|k| slope(c, k)).collect(),
        };
        self.built.covariates.iter().enumerate().map(of).collect()
    }

    fn noise(&self) -> Vec<ChannelRecord> {
        let (channels, noise) = (self.recipe.channels(), &self.fit.noise);
        let mut sds: Vec<Vec<f64>> = vec![Vec::new(); self.fleet.channels];
        for (log, variances) in self.fleet.logs.iter().zip(&noise.variances) {
            let told = log.channels.iter().zip(variances).filter(|(_, v)| **v < Noise::SILENT);
            told.for_each(|(c, v)| sds[c.channel].push(v.sqrt()));
        }
        let of = |(channel, mut sds): (usize, Vec<f64>)| {
            sds.sort_by(f64::total_cmp);
            Some(ChannelRecord {
                output: channels[channel].0.clone(),
                kernel_hz: channels[channel].1,
                sd: *sds.get(sds.len() / 2)?,
                colour: noise.colours[channel],
            })
        };
        sds.into_iter().enumerate().filter_map(of).collect()
    }

    fn robot(&self, r: usize) -> RobotRecord {
        let fit = &self.fit;
        let q = self.fleet.varying.len();
        let history = self.drift.as_ref().map(|d| &d.robots[r]);
        let of_event = self.drift.iter().flat_map(|d| &d.events).any(|e| e.robots.contains(&r));
        let spread = |k: usize| Some(fit.variances.robots[k].sqrt()).filter(|sd| *sd > 0.0);
        // Every robot of a fleet has a log.
        let robot = self.robot_fit(r);
        let parameter = |k: usize| {
            let column = self.fleet.varying[k].column;
            let (value, sd) = robot.map_or((f64::NAN, f64::NAN), |x| {
                (x.values[column], x.covariance[(column, column)].max(0.0).sqrt())
            });
            let cut = self.built.positive[k] && value < 1.96 * sd;
            RobotParameter {
                name: self.name(k),
                value: if cut { value.max(0.0) } else { value },
                interval: (
                    if cut { 0.0 } else { value - 1.96 * sd },
                    (value + 1.96 * sd).max(0.0_f64.min(value)),
                ),
                cut_at_zero: cut,
                deviation: robot.and_then(|x| Some(x.deviation[k] / spread(k)?)),
                detectable: history.and_then(|h| h.detectable.get(k).copied()).filter(|d| d.is_finite()),
            }
        };
        let mut stands_out: Vec<OutlierRecord> = (self.robot_outliers.iter().filter(|o| o.unit == r))
            .map(|o| OutlierRecord {
                parameter: self.name(o.coordinate),
                deviation: robot
                    .zip(spread(o.coordinate))
                    .map_or(o.z, |(x, sd)| x.deviation[o.coordinate] / sd),
                p: o.p,
            })
            .collect();
        stands_out.sort_by(|a, b| b.deviation.abs().total_cmp(&a.deviation.abs()));
        let (p, changes) = match history.map(|h| &h.history) {
            Some(History::Changed { p, changes }) => {
                (Some(*p), changes.iter().map(|c| self.change(c)).collect())
            }
            Some(History::Unchanged { p }) => (Some(*p), Vec::new()),
            Some(History::TooShort { .. }) | None => (None, Vec::new()),
        };
        let state = match () {
            () if of_event => RobotState::SiteEvent,
            () if !changes.is_empty() => RobotState::Changed,
            () if !stands_out.is_empty() => RobotState::StandsOut,
            () => RobotState::Usual,
        };
        let own: Vec<usize> = (0..self.fleet.logs.len()).filter(|k| self.fleet.logs[*k].robot == r).collect();
        let starts: Option<Vec<f64>> = own.iter().map(|k| self.built.starts[*k]).collect();
        let dates_s = starts.map(|s| {
            (
                s.iter().copied().fold(f64::INFINITY, f64::min),
                s.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            )
        });
        RobotRecord {
            name: self.built.robots[r].clone(),
            state,
            logs: own.len(),
            dates_s,
            parameters: (0..q).map(parameter).collect(),
            stands_out,
            changes,
            p,
            influence: fit.influence[r],
        }
    }

    fn change(&self, change: &dynid_fleet::drift::Change) -> ChangeRecord {
        let parameter = self.name(change.coordinate);
        let symbol = parameter.rsplit('.').next().unwrap_or_default();
        let hint = match symbol {
            _ if change.of_all_joints() => format!(
                "{} joints change alike at once: temperature, lubricant or supply before wear",
                change.together
            ),
            "fo" => "an offset: zero or brake, cable, current sensor".to_owned(),
            DELAY => "the delay of the effort: drive, bus, or what logs them".to_owned(),
            COMPLIANCE | "k1" | "k2" => "the spring of the joint: crack or loose bolt of gear, belt or flange; or another load than before".to_owned(),
            BACKLASH => "play of the gear: wear of its teeth, a loose coupling or key; up to a third more than told where much friction lies behind the spring".to_owned(),
            HYSTERESIS => "friction behind the spring or in the gear: bearing or seal of the link, preload".to_owned(),
            LAG => "the record of the link: its encoder, bus, or what logs them; or viscous friction behind the spring".to_owned(),
            _ if self.built.covariates.is_empty() => {
                "friction: wear or damage; or temperature, lubricant or load, none of which is stated"
                    .to_owned()
            }
            _ => "friction: wear or damage of bearing, seal or gear".to_owned(),
        };
        let (at_s, from_s, to_s) = (change.time_s, change.from_s, change.to_s);
        let text = format!("{} ({} to {})", manifest::day(at_s), manifest::day(from_s), manifest::day(to_s));
        ChangeRecord {
            parameter,
            kind: change.kind.into(),
            size: change.size,
            sd: change.sd,
            evidence: change.evidence,
            p: change.p,
            date: DatedRecord { at_s, from_s, to_s, text },
            hint,
        }
    }

    fn logs_to_look_at(&self) -> Vec<LogRecord> {
        let fit = &self.fit;
        // Logs behind a change are told by the change, and so are the other parameters of a deformation, of which it is a part.
        let deformation = |k: usize| self.recipe.deformation_of(self.fleet.varying[k].column);
        let together =
            |a: usize, b: usize| a == b || deformation(a).is_some() && deformation(a) == deformation(b);
        let changed =
            |r: usize, k: usize| changes_of(self.drift.as_ref(), r).iter().any(|c| together(c.coordinate, k));
        let mut by_log: BTreeMap<usize, Vec<LogDeviation>> = BTreeMap::new();
        for o in &self.log_outliers {
            if !changed(self.fleet.logs[o.unit].robot, o.coordinate) {
                let sd = fit.variances.logs[o.coordinate].sqrt();
                let deviation = fit.logs[o.unit].deviation[o.coordinate] / sd.max(f64::MIN_POSITIVE);
                let parameter = self.name(o.coordinate);
                by_log.entry(o.unit).or_default().push(LogDeviation { parameter, deviation, p: o.p });
            }
        }
        let record = |(l, mut parameters): (usize, Vec<LogDeviation>)| {
            parameters.sort_by(|a, b| b.deviation.abs().total_cmp(&a.deviation.abs()));
            let robot = self.built.robots[self.fleet.logs[l].robot].clone();
            LogRecord { log: self.built.facts[l].log.name.clone(), robot, parameters }
        };
        let mut out: Vec<LogRecord> = by_log.into_iter().map(record).collect();
        out.sort_by(|a, b| b.parameters[0].deviation.abs().total_cmp(&a.parameters[0].deviation.abs()));
        out
    }

    fn payload(&self) -> Option<PayloadRecord> {
        let link = self.recipe.payload()?.to_owned();
        let parameter = |k: &usize| CarriedParameter {
            name: self.name(*k),
            unit: self.unit(*k),
            between_logs: self.fit.variances.logs[*k].sqrt(),
        };
        let mut order: Vec<usize> = (0..self.differences.len()).collect();
        let place = |l: &usize| (self.fleet.logs[*l].robot, self.fleet.logs[*l].time_s);
        order.sort_by(|a, b| {
            let ((robot, time), (other, later)) = (place(a), place(b));
            robot.cmp(&other).then(time.total_cmp(&later))
        });
        let of_log = |l: usize| {
            let LogDifference { value, sd } = self.differences[l].clone();
            let robot = self.built.robots[self.fleet.logs[l].robot].clone();
            CarriedByLog { log: self.built.facts[l].log.name.clone(), robot, difference: value, sd }
        };
        Some(PayloadRecord {
            link,
            parameters: self.carried.iter().map(parameter).collect(),
            logs: order.into_iter().map(of_log).collect(),
        })
    }

    /// What the numbers are to be read with.
    fn doubts(&self, parameters: &[FleetParameter]) -> Vec<String> {
        let fit = &self.fit;
        let mut out = Vec::new();
        let robots = fit.robots.iter().flatten().count();
        if robots < FEW {
            out.push(format!(
                "{robots} robots do not tell how robots of the type differ: the spread leans on 20 % between robots, and no robot is called out of it"
            ));
        } else if robots < SAMPLE {
            out.push(format!(
                "{robots} robots are few: intervals of the type hold if these stand for the others"
            ));
        }
        if fit.jackknife.is_none() {
            out.push(
                "one robot alone tells some parameters of the type: their intervals are those of the model"
                    .to_owned(),
            );
        }
        if !fit.settled.converged {
            out.push(format!(
                "the spreads had not settled after {} sweeps: one still changed by {:.1} %",
                fit.settled.passes,
                100.0 * fit.settled.change
            ));
        }
        let unseen: Vec<&str> = parameters.iter().filter(|p| !p.seen).map(|p| p.name.as_str()).collect();
        if !unseen.is_empty() {
            out.push(format!(
                "no log tells {}: their values are near zero because nothing says otherwise",
                unseen.join(", ")
            ));
        }
        let told = self.noise();
        for output in self.recipe.outputs.iter().filter(|o| told.iter().all(|c| c.output != o.name)) {
            out.push(format!("efforts of {} are zero in all logs: they tell nothing", output.name));
        }
        let all: Vec<usize> = (0..self.fleet.logs.len()).collect();
        let explained = self.pooled("all logs", &all, &fit.values, Basis::Robots).explained();
        for (output, _) in self.recipe.outputs.iter().zip(explained).filter(|(_, explained)| !explained) {
            out.push(format!(
                "the effort of {} is mostly something else than the model (poor current sensing, friction at rest, a wrong column?): its parameters, and changes of them, mean nothing",
                output.name
            ));
        }
        for channel in told.iter().filter(|c| c.colour > COLOURED) {
            out.push(format!(
                "{}{}: residuals hold {:.0} times as much of what the motion can explain as noise would: the model lacks something there",
                channel.output,
                channel.kernel_hz.map_or_else(String::new, |hz| format!(" ({hz:.1} Hz)")),
                channel.colour
            ));
        }
        if told.iter().any(|c| c.colour > COLOURED && c.kernel_hz.is_some())
            && self.recipe.payload().is_none()
        {
            out.push(
                "robots that do not always carry the same need a recipe that lets logs differ in it: `dynid reduce --payload LINK`".to_owned(),
            );
        }
        if !self.carried.is_empty() && self.built.halves.len() < LEAST_HALVED {
            out.push(format!(
                "deviations of what logs carried are those of noise alone: {} logs with rows in both halves of their time, expected {LEAST_HALVED} to tell how far they scatter beyond it",
                self.built.halves.len()
            ));
        }
        for (r, influence) in fit.influence.iter().enumerate().filter(|(_, i)| **i > INFLUENCE) {
            out.push(format!(
                "{} alone moves a parameter of the type by {influence:.1} standard deviations",
                self.built.robots[r]
            ));
        }
        let twos = self.failures.iter().filter(|f| f.code == super::FailureCode::TwoRobots).count();
        if twos > 0 {
            out.push(format!("{twos} logs are stated for two robots and were left out"));
        }
        out
    }
}
