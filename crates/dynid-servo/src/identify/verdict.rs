//! Intervals, verdicts, and what is known together only.

use dynid_linalg::Mat;

use super::result::{GroupKind, ServoBody, ServoGroup, ServoParameter, ServoVerdict, Spread};
use crate::deviation::DEVIATIONS;
use crate::fit::{Deviations, Fitted, Place};
use crate::free::{Free, Target};
use crate::log::ServoLog;
use crate::settings::{QUANTILE, ServoSettings};
use crate::term::Term;

/// Parameters with intervals and verdicts. `open`: those that are known together only.
pub(super) fn parameters(
    free: &[Free],
    fitted: &Fitted,
    found: &Deviations,
    open: &[ServoGroup],
    (spreads, of_step): (&[Spread], f64),
    settings: &ServoSettings,
    logs: &[ServoLog],
) -> Vec<ServoParameter> {
    let period = logs.iter().map(ServoLog::period).fold(f64::INFINITY, f64::min);
    let one = |k: usize| {
        let (f, value, spread) = (&free[k], fitted.estimate[k], spreads[k]);
        let t = found.quantile[k];
        let std = found.jackknife[k];
        let half_width = std.map(|sd| {
            let parts = [t * sd, spread.law, of_step * spread.step, t * spread.folds, spread.gain];
            // Folds and jackknife measure the same thing: the larger counts.
            let own = parts[0].max(parts[3]);
            let others = [parts[1], parts[2], parts[4], spread.reading, QUANTILE * spread.knowledge];
            others.iter().fold(own * own, |sum, x| sum + x * x).sqrt()
        });
        let joint = f.joints().first().map(|j| &fitted.values.joints[*j]);
        let scale = match (f.as_term(), joint) {
            (Some(Term::Zero), _) => 10.0 / 3.0 * settings.zero_std,
            (Some(Term::Delay | Term::SmoothingTime | Term::EffortDelay), _) => value.abs().max(period),
            (Some(Term::Offset | Term::EffortZero), Some(joint)) => value.abs().max(joint.get(Term::Coulomb)),
            (Some(Term::CurrentZero), Some(joint)) => {
                value.abs().max(joint.get(Term::Coulomb) / joint.get(Term::TorqueConstant))
            }
            _ => value.abs(),
        };
        let of_prior = f.prior.is_some_and(|p| found.model[k].is_none_or(|m| m > p.std / 3.0));
        let verdict = match (fitted.places[k], half_width, std) {
            (Place::AtLower | Place::AtUpper, ..) => ServoVerdict::AtBound,
            (Place::Unseen, ..) => ServoVerdict::NotSeen,
            _ if of_prior => ServoVerdict::Prior,
            (Place::Inside, Some(half), Some(sd)) => {
                let moved = [spread.law, spread.step, spread.folds, spread.gain];
                if moved.iter().any(|s| *s > t * sd) {
                    ServoVerdict::Unstable
                } else if half <= 0.1 * scale {
                    ServoVerdict::Seen
                } else if half >= scale {
                    ServoVerdict::NotSeen
                } else {
                    ServoVerdict::Coarse
                }
            }
            _ => ServoVerdict::NotSeen,
        };
        // Numbers of bodies are no results: what they make of masses is.
        let is_result = f.as_term().is_some();
        let half_width = half_width.filter(|_| verdict != ServoVerdict::Prior || !is_result);
        let in_scale = f.as_term().is_some_and(Term::scales_with_effort)
            && open.iter().any(|g| g.kind == GroupKind::Scale && g.members.contains(&k));
        let interval = half_width.and_then(|half| {
            let relative = half / value.abs();
            let (lower, upper) = match in_scale {
                true if relative < 1.0 => (value / (1.0 + relative), value / (1.0 - relative)),
                true => (value / (1.0 + relative), f64::INFINITY),
                false => (value - half, value + half),
            };
            let upper = upper.min(f.upper);
            upper.is_finite().then_some((lower.max(f.lower), upper))
        });
        ServoParameter {
            free: f.clone(),
            value,
            half_width,
            interval,
            std,
            model_std: found.model[k],
            spread,
            per_gain: per_gain(free, fitted, found, k, t),
            verdict,
        }
    };
    (0..free.len()).map(one).collect()
}

/// A parameter over the position gain that it scales with, and the half width of that.
fn per_gain(free: &[Free], fitted: &Fitted, found: &Deviations, k: usize, t: f64) -> Option<(f64, f64)> {
    let term = free[k].as_term()?;
    if !term.scales_with_effort() || term == Term::PositionGain || found.covariance.nrows() == 0 {
        return None;
    }
    let joint = *free[k].joints().first()?;
    let is_gain = |f: &Free| f.as_term() == Some(Term::PositionGain) && f.joints().contains(&joint);
    let gain = free.iter().position(is_gain)?;
    let at = |k: usize| found.inside.iter().position(|i| *i == k);
    let (a, b) = (at(k)?, at(gain)?);
    let (value, kp) = (fitted.estimate[k], fitted.estimate[gain]);
    let c = &found.covariance;
    let ratio = value / kp;
    let variance = (c[(a, a)] - 2.0 * ratio * c[(a, b)] + ratio * ratio * c[(b, b)]) / (kp * kp);
    Some((ratio, t * variance.max(0.0).sqrt()))
}

/// Correlation from which parameters count as one.
const TOGETHER: f64 = 0.9;

/// Bodies that were free, from the numbers of their deviations among the `parameters`.
pub(super) fn bodies(parameters: &[ServoParameter], fitted: &Fitted, found: &Deviations) -> Vec<ServoBody> {
    let mut out = Vec::new();
    for (first, p) in parameters.iter().enumerate() {
        let Target::Body(body, 0) = p.free.target else { continue };
        let own = &parameters[first..first + DEVIATIONS];
        let slopes = body.slopes(&std::array::from_fn(|k| own[k].value));
        let at: Option<Vec<usize>> =
            (first..first + DEVIATIONS).map(|k| found.inside.iter().position(|i| *i == k)).collect();
        let covariance = |a: usize, b: usize| found.covariance[(a, b)] + found.by_knowledge[(a, b)];
        // Half widths of the numbers, with all that widens them, together as their covariance has it.
        let half_width = |c: usize| {
            let at = at.as_ref().filter(|_| found.covariance.nrows() > 0)?;
            let part = |k: usize| Some(slopes[k][c] * own[k].half_width? / covariance(at[k], at[k]).sqrt());
            let parts = (0..DEVIATIONS).map(part).collect::<Option<Vec<f64>>>()?;
            let line = |i: usize| (0..DEVIATIONS).map(|j| parts[j] * covariance(at[i], at[j])).sum::<f64>();
            Some((0..DEVIATIONS).map(|i| parts[i] * line(i)).sum::<f64>().max(0.0).sqrt())
        };
        let known = |c: usize| {
            let of = |k: usize| own[k].free.prior.map_or(0.0, |p| slopes[k][c] * p.std);
            (0..DEVIATIONS).map(|k| of(k).powi(2)).sum::<f64>().sqrt()
        };
        // Told by the readings, not by how the robot file's errors are thought to go together.
        let by_readings = |c: usize| {
            let Some(at) = &at else { return f64::INFINITY };
            let line = |i: usize| {
                (0..DEVIATIONS).map(|j| slopes[j][c] * found.by_readings[(at[i], at[j])]).sum::<f64>()
            };
            (0..DEVIATIONS).map(|i| slopes[i][c] * line(i)).sum::<f64>().max(0.0).sqrt()
        };
        let half_width: [Option<f64>; DEVIATIONS] = std::array::from_fn(half_width);
        let told = |c: usize| {
            let most = known(c) / 3.0;
            half_width[c].is_some_and(|half| half <= QUANTILE * most) && by_readings(c) <= most
        };
        out.push(ServoBody {
            body: body.body,
            stated: body.inertia(&[0.0; DEVIATIONS]),
            inertia: fitted.values.body(body.body),
            half_width,
            told: std::array::from_fn(told),
        });
    }
    out
}

/// Parameters whose estimates go together: `correlation` is that of the parameters `inside`. Numbers of bodies are no members.
pub(crate) fn groups(free: &[Free], inside: &[usize], correlation: &Mat) -> Vec<ServoGroup> {
    let m = inside.len();
    let mut group: Vec<usize> = (0..m).collect();
    for i in 0..m {
        for j in 0..i {
            let terms = [i, j].iter().all(|k| free[inside[*k]].as_term().is_some());
            if terms && correlation[(i, j)].abs() > TOGETHER && group[i] != group[j] {
                let (from, to) = (group[i].max(group[j]), group[i].min(group[j]));
                group.iter_mut().filter(|g| **g == from).for_each(|g| *g = to);
            }
        }
    }
    let mut out = Vec::new();
    for g in 0..m {
        let members: Vec<usize> = (0..m).filter(|i| group[*i] == g).map(|i| inside[i]).collect();
        if members.len() < 2 {
            continue;
        }
        let terms: Vec<Term> = members.iter().filter_map(|k| free[*k].as_term()).collect();
        let all = |of: &[Term]| terms.iter().all(|t| of.contains(t));
        let kind = match () {
            () if terms.contains(&Term::PositionGain) => GroupKind::Scale,
            () if all(&[
                Term::Delay,
                Term::RotorInertia,
                Term::SmoothingTime,
                Term::Viscous,
                Term::VelocityGain,
                Term::EffortDelay,
                Term::Compliance,
                Term::GearDamping,
            ]) =>
            {
                GroupKind::Lag
            }
            () if all(&[Term::Zero, Term::Offset]) => GroupKind::Posture,
            () if all(&[
                Term::Coulomb,
                Term::Stiction,
                Term::StribeckVelocity,
                Term::LoadFriction,
                Term::Viscous,
                Term::Offset,
            ]) =>
            {
                GroupKind::Friction
            }
            () => GroupKind::Other,
        };
        out.push(ServoGroup { kind, members });
    }
    out
}
