//! Columns that are not what the log says they are.

use dynid_motion::UniformLog;
use dynid_motion::velocity::compare;
use dynid_rows::preflight::{Found, Rewiring, Wiring, WiringSearch};

use crate::finding::{FindingId, Findings, Fix, Severity};

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

/// Share of the efforts (root mean square) that a remedy may leave unexplained: what leaves more is no explanation.
const EXPLAINED: f64 = 0.2;

/// Share of the efforts below which what is left may as well be a law of friction that the model does not have: what comes in any amount
/// then improves it by chance, and is no error.
const BEARABLE: f64 = 0.1;
/// Under its right clock a log is explained by bodies nearly as well as by any numbers. A clock is no explanation where any numbers leave less
/// than this share of its misfit as logged.
const LOOSENED: f64 = 0.6;
/// Gravity this close to the direction stated is a base that is not level, rad; what is farther off is mounted another way.
const SLIGHT: f64 = 0.18;
/// Gravity this close to the direction stated differs in its size alone, rad.
const SAME_DIRECTION: f64 = 1e-6;

/// Findings of the search for what the log is to be read by; `false` if nothing tried explains the log. `velocities`: whether
/// velocities go with positions; `rate_hz`: of the log; `shown`: the clock that velocities show;
/// `gravity`: as stated.
pub(super) fn wiring(
    search: &WiringSearch,
    velocities: bool,
    (rate_hz, shown, gravity): (f64, Option<f64>, [f64; 3]),
    names: &[String],
    out: &mut Findings<'_>,
) -> bool {
    let share = |misfit: f64| 100.0 * (misfit / search.nothing).sqrt();
    if !search.found.is_empty() && search.misfit() > EXPLAINED * EXPLAINED * search.nothing {
        let tried: Vec<String> =
            search.found.iter().map(|f| describe(&f.change, names)).map(in_full).collect();
        let evidence = format!(
            "bodies that can exist leave {:.1} % of the efforts unexplained as the log is; of all that was tried (order, signs, units and zeros \
             of columns, direction of gravity, clock, delay) the best leaves {:.1} %, more than the {:.0} % of an explanation: {}",
            share(search.as_logged),
            share(search.misfit()),
            100.0 * EXPLAINED,
            tried.join(", and ")
        );
        let remedy = "see whether robot file and log are of the same robot and configuration, and whether something else acts on it; several \
                      columns may be wrong at once";
        out.add(FindingId::UnexplainedEffort, Severity::Error, None, evidence, remedy);
        return false;
    }
    // Efforts alone tell a clock to some per cent.
    let clock_told = search.wiring.clock == 1.0 || shown.is_some() || !clock(search.wiring.clock).is_empty();
    // The size of all efforts together is judged by what else is known of it.
    let sized = search.found.iter().any(|f| matches!(f.change, Rewiring::AllEffortScales(_)));
    let clear = clock_told && !sized && search.found.iter().all(|f| f.alternatives.is_empty());
    for (k, found) in search.found.iter().enumerate() {
        let (id, joint, what) = describe(&found.change, names);
        let id = match &found.change {
            Rewiring::Gravity(g) if angle(*g, gravity) < SAME_DIRECTION => FindingId::GravitySize,
            _ => id,
        };
        // Another clock severs inertia from gravity, so that it may stand for what the model lacks.
        let loosens = matches!(found.change, Rewiring::Clock(_))
            && shown.is_none()
            && search.unrestrained < LOOSENED * found.after;
        let mut evidence = format!(
            "bodies that can exist leave {:.3} % of the efforts unexplained as the log is, {:.3} % {what}{}",
            share(found.before),
            share(found.after),
            alternatives(found, names)
        );
        if loosens {
            evidence += &format!(
                "; numbers that no body can have leave {:.3} % as the log is",
                share(search.unrestrained)
            );
        }
        let remedy = match id {
            FindingId::ClockRate if loosens => {
                "if the rate of the log is right, something acts that the robot file does not hold, such as a gravity compensator (`spring`), a load, \
                 or motors that turn several joints; else state the unit of the time"
            }
            FindingId::JointPermutation => "assign the columns in this order",
            FindingId::EffortSign => "reverse the sign of the effort",
            FindingId::PositionSign => {
                "reverse the sign, or turn the joint's axis in the robot file if the log is right"
            }
            FindingId::Degrees => "state the unit of the position",
            FindingId::PositionZero => {
                "state the offset of the position, or the zero of the joint in the robot file"
            }
            FindingId::BaseTilt => {
                "state gravity in base axes (`gravity`): the robot is mounted another way than the file says"
            }
            FindingId::GravitySize => {
                "state gravity in base axes (`gravity`), m/s²: on Earth it is 9.81 long"
            }
            FindingId::ClockRate => "state the unit of the time",
            FindingId::Delay => {
                "state the delay (`conditioning.delay_samples`), or log motion and effort by one clock"
            }
            _ => "state the unit or the drive gain of the effort",
        };
        let unclear;
        let remedy = match clear || loosens {
            true => remedy,
            false => {
                unclear = format!("see what it is, since the log does not tell for sure, then: {remedy}");
                unclear.as_str()
            }
        };
        let slight = match &found.change {
            Rewiring::Gravity(g) => id == FindingId::BaseTilt && angle(*g, gravity) < SLIGHT,
            Rewiring::Clock(_) | Rewiring::Zero(..) | Rewiring::Delay(_) | Rewiring::EffortScale(..) => {
                found.before < BEARABLE * BEARABLE * search.nothing
            }
            _ => false,
        } || loosens;
        let severity = if slight { Severity::Warning } else { Severity::Error };
        let finding = out.add(id, severity, joint.as_deref(), evidence, remedy);
        if clear && !loosens && k + 1 == search.found.len() {
            finding.fixes = fixes(search, velocities, rate_hz);
        }
    }
    true
}

/// What the configuration has to say for a log to be read as found.
fn fixes(search: &WiringSearch, velocities: bool, rate_hz: f64) -> Vec<Fix> {
    let wiring = &search.wiring;
    let mut out = Vec::new();
    let plain = Wiring::identity(wiring.position.len());
    if wiring.position != plain.position || wiring.effort != plain.effort {
        out.push(Fix::Wiring { wiring: wiring.clone(), velocities });
    }
    if wiring.clock != 1.0 {
        out.push(Fix::Clock(wiring.clock));
    }
    out.extend(wiring.gravity.map(Fix::Gravity));
    if search.found.iter().any(|f| matches!(f.change, Rewiring::Delay(_))) {
        out.push(Fix::Delay(wiring.delay_s * rate_hz));
    }
    out
}

/// A difference in words that stand alone.
fn in_full((_, joint, what): (FindingId, Option<String>, String)) -> String {
    match joint.filter(|_| what.contains("its ")) {
        Some(joint) => format!("{what} (`{joint}`)"),
        None => what,
    }
}

/// Angle between two directions, rad.
fn angle(a: [f64; 3], b: [f64; 3]) -> f64 {
    let dot = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
    (dot(a, b) / (dot(a, a) * dot(b, b)).sqrt()).clamp(-1.0, 1.0).acos()
}

fn list(joints: &[usize], names: &[String]) -> String {
    joints.iter().map(|j| names[*j].as_str()).collect::<Vec<_>>().join(", ")
}

/// Identity of the finding, its joints, what is done.
fn describe(change: &Rewiring, names: &[String]) -> (FindingId, Option<String>, String) {
    let one = |j: &usize| Some(names[*j].clone());
    let pair = |a: &usize, b: &usize| Some(list(&[*a, *b], names));
    let swap = |what: &str, a: &usize, b: &usize| {
        format!("with the {what} of `{}` and `{}` exchanged", names[*a], names[*b])
    };
    let order = |what: &str, order: &[usize]| {
        format!("with the {what} taken from the columns of {} in this order", list(order, names))
    };
    match change {
        Rewiring::EffortSign(j) => (FindingId::EffortSign, one(j), "with its effort reversed".to_owned()),
        Rewiring::AllEffortSigns => (FindingId::EffortSign, None, "with all efforts reversed".to_owned()),
        Rewiring::PositionSign(j) => {
            (FindingId::PositionSign, one(j), "with its position reversed".to_owned())
        }
        Rewiring::BothSigns(j) => {
            (FindingId::PositionSign, one(j), "with its position and its effort reversed".to_owned())
        }
        Rewiring::EffortSwap(a, b) => (FindingId::JointPermutation, pair(a, b), swap("efforts", a, b)),
        Rewiring::PositionSwap(a, b) => (FindingId::JointPermutation, pair(a, b), swap("positions", a, b)),
        Rewiring::JointSwap(a, b) => {
            (FindingId::JointPermutation, pair(a, b), swap("positions and efforts", a, b))
        }
        Rewiring::EffortOrder(o) => (FindingId::JointPermutation, None, order("efforts", o)),
        Rewiring::PositionOrder(o) => (FindingId::JointPermutation, None, order("positions", o)),
        Rewiring::JointOrder(o) => (FindingId::JointPermutation, None, order("positions and efforts", o)),
        Rewiring::PositionUnit(j, factor) => (FindingId::Degrees, one(j), unit(*factor, "its position")),
        Rewiring::AllPositionUnits(factor) => (FindingId::Degrees, None, unit(*factor, "all positions")),
        Rewiring::EffortScale(j, factor) => {
            (FindingId::DriveGain, one(j), format!("with its effort multiplied by {factor}"))
        }
        Rewiring::AllEffortScales(factor) => {
            (FindingId::DriveGain, None, format!("with all efforts multiplied by {factor}"))
        }
        Rewiring::Zero(j, angle) => (
            FindingId::PositionZero,
            one(j),
            format!("with {:.1} degrees added to its position", angle.to_degrees()),
        ),
        Rewiring::Gravity(g) => (
            FindingId::BaseTilt,
            None,
            format!("with gravity ({:.2}, {:.2}, {:.2}) m/s² in base axes", g[0], g[1], g[2]),
        ),
        Rewiring::Clock(factor) => {
            (FindingId::ClockRate, None, format!("with times multiplied by {factor:.4e}{}", clock(*factor)))
        }
        Rewiring::Delay(s) if *s > 0.0 => {
            (FindingId::Delay, None, format!("with efforts {s:.3} s before the motion of the same row"))
        }
        Rewiring::Delay(s) => {
            (FindingId::Delay, None, format!("with efforts {:.3} s after the motion of the same row", -s))
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
        found.alternatives.iter().take(3).map(|(change, _)| in_full(describe(change, names))).collect();
    format!("; nearly as well {}", words.join(", or "))
}

/// The unit that a clock counts in, in words.
fn clock(factor: f64) -> &'static str {
    const UNITS: [(f64, &str); 4] = [
        (1e-3, " (milliseconds)"),
        (1e-6, " (microseconds)"),
        (1e-9, " (nanoseconds)"),
        (60.0, " (minutes)"),
    ];
    UNITS.iter().find(|(f, _)| (factor / f - 1.0).abs() < 1e-9).map_or("", |(_, word)| word)
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

    /// Seconds per second of the log's clock as the velocities show them; `None` where they disagree, or tell of a unit of
    /// their own.
    pub(super) fn clock(&self) -> Option<f64> {
        const UNITS: [f64; 3] =
            [180.0 / std::f64::consts::PI, 30.0 / std::f64::consts::PI, 0.5 / std::f64::consts::PI];
        let steady = |(scale, rest): &&(f64, f64)| *rest < REST * scale.abs();
        let mut scales: Vec<f64> = self.as_logged.iter().flatten().filter(steady).map(|(s, _)| *s).collect();
        if scales.len() < 2 || 2 * scales.len() < self.as_logged.iter().flatten().count() {
            return None;
        }
        scales.sort_by(f64::total_cmp);
        let middle = scales[scales.len() / 2];
        let near = |s: f64, to: f64| (s / to - 1.0).abs() < SCALE;
        let alike = scales.iter().filter(|s| near(**s, middle)).count();
        let unit = UNITS.iter().any(|u| near(middle, *u) || near(middle, 1.0 / u));
        (4 * alike >= 3 * scales.len() && middle > 0.0 && !unit)
            .then(|| if near(middle, 1.0) { 1.0 } else { 1.0 / middle })
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
        let shown = self.clock().filter(|c| *c != 1.0);
        if let (Some(shown), true) = (shown, wiring.clock == 1.0) {
            other_clock(shown, out);
        }
        for (j, measured) in own.iter().enumerate() {
            let Some((scale, rest)) = *measured else { continue };
            let by_clock = shown.is_some_and(|c| fits(&(scale * c, rest * c)));
            if by_clock || fits(&(scale, rest)) {
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
            out.add(FindingId::VelocityMismatch, Severity::Warning, Some(&name), evidence, remedy).fixes =
                fixes;
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

/// Velocities that are all off by the same factor, where the efforts do not say which of the two it is.
fn other_clock(shown: f64, out: &mut Findings<'_>) {
    let evidence = format!(
        "measured velocities are alike {:.4e} times the derivatives of their positions: the time is to be multiplied by {shown:.4e}{}, or \
         velocities are in another unit; the efforts do not tell",
        1.0 / shown,
        clock(shown)
    );
    let remedy = "see whether the time counts seconds, and state the unit of the one that is wrong";
    out.add(FindingId::ClockRate, Severity::Warning, None, evidence, remedy);
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
    out.add(FindingId::ClockRate, Severity::Warning, None, evidence, remedy).fixes =
        vec![Fix::Rate(mean * rate_hz)];
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Severity and fixes of a clock in minutes that leaves 5 of 11 % where free numbers leave `unrestrained` % as logged.
    fn of_clock(unrestrained: f64) -> (Severity, usize) {
        let squared = |percent: f64| (percent / 100.0_f64).powi(2);
        let change = Rewiring::Clock(60.0);
        let plain = Wiring::identity(1);
        let search = WiringSearch {
            wiring: plain.with(&change, &[false]),
            found: vec![Found {
                change,
                before: squared(11.0),
                after: squared(5.0),
                alternatives: Vec::new(),
            }],
            as_logged: squared(11.0),
            unrestrained: squared(unrestrained),
            nothing: 1.0,
        };
        let mut findings = Findings { log: "log.csv", number: 0, list: Vec::new() };
        let explained =
            wiring(&search, true, (100.0, None, [0.0, 0.0, -9.81]), &["j1".to_owned()], &mut findings);
        assert!(explained && findings.list.len() == 1);
        (findings.list[0].severity, findings.list[0].fixes.len())
    }

    #[test]
    fn a_clock_is_a_doubt_where_free_numbers_explain_the_log_better_than_bodies_under_it() {
        assert_eq!(
            of_clock(4.9),
            (Severity::Error, 1),
            "bodies under the right clock do as well as free numbers"
        );
        assert_eq!(of_clock(10.0), (Severity::Error, 1), "free numbers do not explain the log either");
        assert_eq!(of_clock(2.7), (Severity::Warning, 0));
    }
}
