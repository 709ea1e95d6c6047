//! From logs that were reduced to a fleet.

use std::collections::{BTreeMap, BTreeSet};

use dynid_factor::Factor;
use dynid_files::digest::sha256_bytes;
use dynid_fleet::{ChannelFactor, Coordinate, Fleet, FleetError, FleetLog, LogHalves};
use dynid_identify::reduction::{LogFacts, Origin, ReducedLog, payload_columns};
use dynid_linalg::{AsView, Mat};
use dynid_model::Owner;

use super::{FleetFault, FleetSettings};
use crate::Error;
use crate::reduce::{Column, Recipe};

/// Logs that are looked at in halves, at most.
const HALVED: usize = 100;
/// Symbol of the inertia of a rotor, which robots of a type share.
const ROTOR: &str = "Ia";
/// Logs of a robot whose triangles differ by less than this share have the same motion.
const SAME_MOTION: f64 = 0.05;

/// Names of what a fleet counts.
#[derive(Debug)]
pub(super) struct Built {
    /// Columns of the fleet.
    pub(super) columns: Vec<Column>,
    /// Robots, in the order of the fleet's.
    pub(super) robots: Vec<String>,
    /// What is known of logs beside their factors, in the order of the fleet's.
    pub(super) facts: Vec<LogFacts>,
    /// Per log its start, s since 1970.
    pub(super) starts: Vec<Option<f64>>,
    /// Logs without a date.
    pub(super) undated: usize,
    /// Covariates, in the order of the fleet's.
    pub(super) covariates: Vec<String>,
    /// Per coordinate: whether it is never negative.
    pub(super) positive: Vec<bool>,
    /// Logs in halves, where the recipe lets logs differ in what they carry: enough of them to tell how far their values scatter.
    pub(super) halves: Vec<LogHalves>,
    /// What the user should know.
    pub(super) warnings: Vec<String>,
}

/// The fleet of logs, and its names.
pub(super) fn fleet(
    recipe: &Recipe,
    logs: Vec<ReducedLog>,
    settings: &FleetSettings,
) -> Result<(Fleet, Built), Error> {
    let origin = |log: &ReducedLog| log.facts.origin.clone().unwrap_or_default();
    let origins: Vec<Origin> = logs.iter().map(origin).collect();
    let names: BTreeSet<&String> = origins.iter().map(|o| &o.robot).collect();
    let robots: Vec<String> = names.into_iter().cloned().collect();
    let mut warnings = Vec::new();
    let covariates = covariates(&origins, settings, &mut warnings)?;
    let (varying, positive) = varying(recipe, settings)?;
    let columns = recipe.all_columns();
    let undated = origins.iter().filter(|o| o.start_s.is_none()).count();
    let of_log = |(log, origin): (&ReducedLog, &Origin)| {
        let channel = |g: &dynid_factor::groups::ReducedGroup| ChannelFactor {
            channel: recipe.channel(g),
            columns: g.columns.clone(),
            factor: Factor::merge(&g.blocks.iter().collect::<Vec<_>>()),
        };
        FleetLog {
            robot: robots.partition_point(|name| *name < origin.robot),
            // Hexadecimal, as every key.
            key: u64::from_str_radix(&log.key[..16], 16).unwrap_or_default(),
            time_s: origin.start_s.unwrap_or(0.0) + 0.5 * log.facts.log.duration_s,
            covariates: covariates
                .iter()
                .map(|name| origin.covariates.get(name).copied().unwrap_or(f64::NAN))
                .collect(),
            channels: log.groups.iter().filter(|g| g.rows() > 0).map(channel).collect(),
        }
    };
    let of_fleet: Vec<FleetLog> = logs.iter().zip(&origins).map(of_log).collect();
    let every = logs.len().div_ceil(HALVED).max(1);
    let halved = (0..logs.len()).step_by(every).filter(|_| recipe.payload().is_some());
    let halves = halved.filter_map(|log| halves(log, &logs[log], recipe)).collect();
    let facts: Vec<LogFacts> = logs.into_iter().map(|log| log.facts).collect();
    let key = |name: &String| u64::from_be_bytes(std::array::from_fn(|i| sha256_bytes(name.as_bytes())[i]));
    let fleet = Fleet {
        columns: columns.len(),
        channels: recipe.channels().len(),
        robots: robots.iter().map(key).collect(),
        covariates: covariates.len(),
        varying,
        logs: of_fleet,
    };
    warnings.extend(same_motion(&fleet, &robots));
    if fleet.varying.is_empty() {
        warnings.push(
            "no parameter of the recipe differs between robots or logs: nothing can stand out or change"
                .to_owned(),
        );
    }
    if undated > 0 {
        warnings.push(format!(
            "{undated} of {} logs state no start: changes with time were not looked for",
            facts.len()
        ));
    } else if covariates.is_empty() {
        warnings.push(
            "no temperature, load or age is stated for all logs: a change of these, or of a lubricant, explains a change of friction as well"
                .to_owned(),
        );
    }
    let starts = origins.iter().map(|o| o.start_s).collect();
    let built = Built { columns, robots, facts, starts, undated, covariates, positive, halves, warnings };
    Ok((fleet, built))
}

/// Coordinates that hold what logs carry.
pub(super) fn carried(fleet: &Fleet) -> Vec<usize> {
    (0..fleet.varying.len()).filter(|k| !fleet.varying[*k].watched).collect()
}

/// A log in two halves of its time blocks; `None` where one of them lacks rows that the log has.
fn halves(log: usize, reduced: &ReducedLog, recipe: &Recipe) -> Option<LogHalves> {
    let half = |second: bool| -> Option<Vec<ChannelFactor>> {
        let channel = |g: &dynid_factor::groups::ReducedGroup| {
            let (first, rest) = g.blocks.split_at(g.blocks.len() / 2);
            let own: Vec<&Factor> = if second { rest } else { first }.iter().collect();
            let rows: usize = own.iter().map(|f| f.rows()).sum();
            (rows > 0).then(|| ChannelFactor {
                channel: recipe.channel(g),
                columns: g.columns.clone(),
                factor: Factor::merge(&own),
            })
        };
        reduced.groups.iter().filter(|g| g.rows() > 0).map(channel).collect()
    };
    Some(LogHalves { log, halves: [half(false)?, half(true)?] })
}

/// Covariates that are taken.
fn covariates(
    origins: &[Origin],
    settings: &FleetSettings,
    warnings: &mut Vec<String>,
) -> Result<Vec<String>, Error> {
    let mut stated: BTreeMap<&String, (usize, f64, f64)> = BTreeMap::new();
    for (name, value) in origins.iter().flat_map(|o| &o.covariates) {
        let (count, least, most) = stated.entry(name).or_insert((0, f64::INFINITY, f64::NEG_INFINITY));
        (*count, *least, *most) = (*count + 1, least.min(*value), most.max(*value));
    }
    if let Some(wanted) = &settings.covariates {
        for name in wanted {
            let fault = |found: String| FleetFault::Setting {
                setting: "covariates",
                expected: "numbers that the manifest states for every log, and that differ".to_owned(),
                found,
            };
            match stated.get(name) {
                None => return Err(fault(name.clone()).into()),
                Some((count, ..)) if *count < origins.len() => {
                    return Err(fault(format!(
                        "{name}, which {} of {} logs do not state",
                        origins.len() - count,
                        origins.len()
                    ))
                    .into());
                }
                Some((_, least, most)) if least == most => {
                    return Err(fault(format!("{name}, which is {least} in all logs")).into());
                }
                Some(_) => {}
            }
        }
        return Ok(wanted.clone());
    }
    let mut out = Vec::new();
    for (name, (count, least, most)) in stated {
        if count < origins.len() {
            warnings
                .push(format!("`{name}` is stated for {count} of {} logs: it was left out", origins.len()));
        } else if least < most {
            out.push(name.clone());
        }
    }
    Ok(out)
}

/// Parameters that vary, and which of them are never negative.
fn varying(recipe: &Recipe, settings: &FleetSettings) -> Result<(Vec<Coordinate>, Vec<bool>), Error> {
    let parameters = recipe.parameters()?;
    let symbol = |name: &str| name.rsplit('.').next().unwrap_or_default().to_owned();
    let symbols: BTreeSet<String> = parameters.iter().map(|p| symbol(&p.name)).collect();
    let matches = |wanted: &str, name: &str| wanted == name || wanted == symbol(name);
    let listed = |setting: &'static str, wanted: &Option<Vec<String>>| -> Result<Option<Vec<bool>>, Error> {
        let Some(wanted) = wanted else { return Ok(None) };
        for one in wanted {
            if !parameters.iter().any(|p| matches(one, &p.name)) {
                let expected = format!(
                    "parameters or symbols of the recipe ({})",
                    symbols.iter().cloned().collect::<Vec<_>>().join(", ")
                );
                return Err(FleetFault::Setting { setting, expected, found: one.clone() }.into());
            }
        }
        Ok(Some(parameters.iter().map(|p| wanted.iter().any(|w| matches(w, &p.name))).collect()))
    };
    let usual = || {
        parameters.iter().map(|p| matches!(p.owner, Owner::Joint(_)) && symbol(&p.name) != ROTOR).collect()
    };
    let robots: Vec<bool> = listed("between_robots", &settings.between_robots)?.unwrap_or_else(usual);
    let logs = listed("between_logs", &settings.between_logs)?.unwrap_or_else(|| robots.clone());
    // What logs carry is their own, whatever else they differ in.
    let carried = recipe.payload().map(payload_columns).unwrap_or_default();
    let symbols: Vec<&String> = symbols.iter().collect();
    let (mut out, mut positive) = (Vec::new(), Vec::new());
    for (column, parameter) in parameters.iter().enumerate() {
        let is_carried = carried.contains(&parameter.name);
        if robots[column] || logs[column] || is_carried {
            let own = symbol(&parameter.name);
            out.push(Coordinate {
                column,
                between_robots: robots[column],
                between_logs: logs[column] || is_carried,
                watched: !is_carried,
                kind: symbols.iter().position(|s| **s == own).unwrap_or_default(),
            });
            positive.push(parameter.lower.is_some_and(|lower| lower >= 0.0));
        }
    }
    Ok((out, positive))
}

/// Rows that hold every column within its size, for what no log tells.
pub(super) fn prior(recipe: &Recipe) -> Mat {
    let columns = recipe.all_columns();
    let p = columns.len();
    Mat::from_fn(p, p + 1, |i, j| if i == j { columns[i].scale.recip() } else { 0.0 })
}

/// Robots whose logs all have the same motion.
fn same_motion(fleet: &Fleet, names: &[String]) -> Option<String> {
    let alike = |logs: &Vec<usize>| {
        let Some((first, others)) = logs.split_first().filter(|(_, others)| !others.is_empty()) else {
            return false;
        };
        others.iter().all(|other| {
            let (a, b) = (&fleet.logs[*first].channels, &fleet.logs[*other].channels);
            a.len() == b.len()
                && a.iter().zip(b).all(|(a, b)| {
                    let (a, b) = (a.factor.r_matrix(), b.factor.r_matrix());
                    a.nrows() == b.nrows() && (a.view() - b.view()).norm_l2() < SAME_MOTION * a.norm_l2()
                })
        })
    };
    let repeated: Vec<&String> =
        fleet.by_robot().iter().zip(names).filter(|(logs, _)| alike(logs)).map(|(_, name)| name).collect();
    let first = repeated.first()?;
    Some(format!(
        "{} robots ({first} ...) repeat one motion: what the model gets wrong in it is taken for the robot; let robots exchange motions",
        repeated.len()
    ))
}

/// What the fit says, with names.
pub(super) fn said(error: &FleetError, built: &Built) -> String {
    match error {
        FleetError::NotExcited { columns } => {
            let names: Vec<&str> = columns.iter().map(|c| built.columns[*c].name.as_str()).collect();
            format!("no log of the fleet tells {}", names.join(", "))
        }
        FleetError::Constant { covariate, value } => {
            format!("`{}` is {value} in all logs: nothing follows it", built.covariates[*covariate])
        }
        FleetError::Confounded { covariate } => {
            format!(
                "the effect of `{}` cannot be told from the other parameters of the type",
                built.covariates[*covariate]
            )
        }
        other => other.to_string(),
    }
}
