//! Columns that are not what the log says they are.

use dynid_estimate::preflight::{Found, Rewiring, Wiring, WiringSearch};
use dynid_motion::UniformLog;
use dynid_motion::velocity::compare;

use super::finding::{Findings, Fix, Severity};

/// Deviation of a measured velocity's scale from 1 that is a fault of its own.
const SCALE: f64 = 0.1;
/// Rest of a measured velocity that is a fault, as a share of the derived one.
const REST: f64 = 0.3;
/// Deviation of all scales together from 1 that is the clock's.
const CLOCK: f64 = 0.004;
/// Range of a position below which nothing is said about its velocity, rad or m.
const LEAST_RANGE: f64 = 0.05;
/// Scales that differ by less than this agree.
const AGREE: f64 = 0.004;

/// Findings of the search for the right wiring. `velocities`: whether velocities go with positions.
pub(super) fn wiring(search: &WiringSearch, velocities: bool, names: &[String], out: &mut Findings<'_>) {
    for (k, found) in search.found.iter().enumerate() {
        let (id, joint, what) = describe(&found.change, names);
        let share = |misfit: f64| 100.0 * (misfit / search.nothing).sqrt();
        let evidence = format!(
            "bodies that can exist leave {:.3} % of the efforts unexplained as the log is, {:.3} % {what}{}",
            share(found.before),
            share(found.after),
            alternatives(found, names)
        );
        let remedy = match id {
            "joint_permutation" => "assign the columns in this order",
            "effort_sign" => "reverse the sign of the effort",
            "position_sign" => {
                "reverse the sign, or turn the joint's axis in the robot file if the log is right"
            }
            "degrees" => "state the unit of the position",
            _ => "state the unit or the drive gain of the effort",
        };
        let finding = out.add(id, Severity::Error, joint.as_deref(), evidence, remedy);
        if k + 1 == search.found.len() {
            finding.fixes = vec![Fix::Wiring { wiring: search.wiring.clone(), velocities }];
        }
    }
}

fn list(joints: &[usize], names: &[String]) -> String {
    joints.iter().map(|j| names[*j].as_str()).collect::<Vec<_>>().join(", ")
}

/// Identity of the finding, its joints, what is done.
fn describe(change: &Rewiring, names: &[String]) -> (&'static str, Option<String>, String) {
    let one = |j: &usize| Some(names[*j].clone());
    let pair = |a: &usize, b: &usize| Some(list(&[*a, *b], names));
    let swap = |what: &str, a: &usize, b: &usize| {
        format!("with the {what} of `{}` and `{}` exchanged", names[*a], names[*b])
    };
    let order = |what: &str, order: &[usize]| {
        format!("with the {what} taken from the columns of {} in this order", list(order, names))
    };
    match change {
        Rewiring::EffortSign(j) => ("effort_sign", one(j), "with its effort reversed".to_owned()),
        Rewiring::AllEffortSigns => ("effort_sign", None, "with all efforts reversed".to_owned()),
        Rewiring::PositionSign(j) => ("position_sign", one(j), "with its position reversed".to_owned()),
        Rewiring::BothSigns(j) => {
            ("position_sign", one(j), "with its position and its effort reversed".to_owned())
        }
        Rewiring::EffortSwap(a, b) => ("joint_permutation", pair(a, b), swap("efforts", a, b)),
        Rewiring::PositionSwap(a, b) => ("joint_permutation", pair(a, b), swap("positions", a, b)),
        Rewiring::JointSwap(a, b) => ("joint_permutation", pair(a, b), swap("positions and efforts", a, b)),
        Rewiring::EffortOrder(o) => ("joint_permutation", None, order("efforts", o)),
        Rewiring::PositionOrder(o) => ("joint_permutation", None, order("positions", o)),
        Rewiring::JointOrder(o) => ("joint_permutation", None, order("positions and efforts", o)),
        Rewiring::PositionUnit(j, factor) => ("degrees", one(j), unit(*factor, "its position")),
        Rewiring::AllPositionUnits(factor) => ("degrees", None, unit(*factor, "all positions")),
        Rewiring::EffortScale(j, factor) => {
            ("drive_gain", one(j), format!("with its effort multiplied by {factor}"))
        }
    }
}

fn unit(factor: f64, what: &str) -> String {
    match factor < 1.0 {
        true => format!("with {what} in degrees"),
        false => format!("with {what} in radians already, not in degrees"),
    }
}

fn alternatives(found: &Found, names: &[String]) -> String {
    if found.alternatives.is_empty() {
        return String::new();
    }
    let words: Vec<String> =
        found.alternatives.iter().take(3).map(|(change, _)| alternative(change, names)).collect();
    format!("; nearly as well {}", words.join(", or "))
}

fn alternative(change: &Rewiring, names: &[String]) -> String {
    let (_, joint, what) = describe(change, names);
    match joint.filter(|_| what.contains("its ")) {
        Some(joint) => format!("{what} (`{joint}`)"),
        None => what,
    }
}

/// What measured velocities of a log fit to.
pub(super) struct Velocities {
    /// Per joint: scale and rest against the joint's own column of positions; `None` without velocity or motion.
    as_logged: Vec<Option<(f64, f64)>>,
}

impl Velocities {
    /// Compares every velocity with the position of the same columns.
    pub(super) fn new(log: &UniformLog, moves: &[bool], cutoff_hz: f64) -> Self {
        let own = |j: usize| against(log, moves, cutoff_hz, (j, 1.0), j);
        Velocities { as_logged: (0..log.joints.len()).map(own).collect() }
    }

    /// Whether they are derivatives of the positions in the columns as they are: where positions are put right, velocities
    /// then go with them.
    pub(super) fn follow_positions(&self) -> bool {
        let told: Vec<bool> = self.as_logged.iter().flatten().map(fits).collect();
        2 * told.iter().filter(|fits| **fits).count() >= told.len()
    }

    /// Findings; `wiring`: what positions are taken for.
    pub(super) fn examine(
        &self,
        log: &UniformLog,
        moves: &[bool],
        cutoff_hz: f64,
        wiring: &Wiring,
        out: &mut Findings<'_>,
    ) {
        let n = log.joints.len();
        let source = |j: usize| match self.follow_positions() {
            true => (j, 1.0),
            false => (wiring.position[j].joint, wiring.position[j].factor),
        };
        let own: Vec<Option<(f64, f64)>> = match self.follow_positions() {
            true => self.as_logged.clone(),
            false => (0..n).map(|j| against(log, moves, cutoff_hz, source(j), j)).collect(),
        };
        clock_rate(&own, log.rate_hz, out);
        for (j, measured) in own.iter().enumerate() {
            let Some((scale, rest)) = *measured else { continue };
            if fits(&(scale, rest)) {
                continue;
            }
            let other = (0..n)
                .filter(|k| *k != j)
                .find(|k| against(log, moves, cutoff_hz, source(j), *k).is_some_and(|f| fits(&f)));
            let name = log.joints[j].name.clone();
            let mut evidence = format!(
                "the measured velocity is {scale:.4} times the derivative of the position and differs from that by {:.0} %",
                100.0 * rest
            );
            let mut fixes = Vec::new();
            if let Some(k) = other {
                evidence += &format!("; the velocity column of `{}` fits", log.joints[k].name);
            } else if rest < REST * scale.abs() {
                fixes.push(Fix::VelocityScale(j, 1.0 / scale));
                for (factor, words) in [
                    (-1.0, "its sign is reversed"),
                    (180.0 / std::f64::consts::PI, "it is in degrees per second"),
                ] {
                    if (scale / factor - 1.0).abs() < SCALE {
                        evidence += &format!(": {words}");
                    }
                }
            }
            let remedy = "identification differentiates positions and does not use this column; do not use it elsewhere before it is put right";
            out.add("velocity_mismatch", Severity::Warning, Some(&name), evidence, remedy).fixes = fixes;
        }
    }
}

fn fits((scale, rest): &(f64, f64)) -> bool {
    (scale - 1.0).abs() < SCALE && *rest < REST
}

/// Scale and rest of the velocity of a column against a position times a factor.
fn against(
    log: &UniformLog,
    moves: &[bool],
    cutoff_hz: f64,
    (source, factor): (usize, f64),
    of: usize,
) -> Option<(f64, f64)> {
    let measured = log.joints[of].velocity.as_deref()?;
    let position: Vec<f64> = log.joints[source].position.iter().map(|q| factor * q).collect();
    let (low, high) =
        position.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
    if !moves[source] || high - low < LEAST_RANGE {
        return None;
    }
    let found = compare(&position, measured, log.rate_hz, cutoff_hz).ok()?;
    Some((found.scale?, found.mismatch))
}

/// Velocities that are all off by the same small factor tell of the clock.
fn clock_rate(own: &[Option<(f64, f64)>], rate_hz: f64, out: &mut Findings<'_>) {
    let good: Vec<f64> = own.iter().flatten().filter(|f| fits(f)).map(|(scale, _)| *scale).collect();
    let mean = good.iter().sum::<f64>() / good.len().max(1) as f64;
    let agree = good.iter().all(|s| (s - mean).abs() < AGREE);
    if good.len() < 2 || !agree || (mean - 1.0).abs() <= CLOCK {
        return;
    }
    let evidence = format!(
        "measured velocities of {} joints are {mean:.4} times the derivatives of their positions, all alike within {:.2} %",
        good.len(),
        100.0 * AGREE
    );
    let remedy = "the clock, not the velocities: state the rate that rows really come at";
    out.add("clock_rate", Severity::Warning, None, evidence, remedy).fixes = vec![Fix::Rate(mean * rate_hz)];
}
