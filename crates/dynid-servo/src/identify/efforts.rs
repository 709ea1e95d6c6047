//! Whether measured efforts are those of the drives that the positions tell, before a fit takes them.

use dynid_linalg::Mat;

use super::outliers;
use super::result::{EffortUse, EffortVerdict, Outliers, ServoError};
use crate::chain::Chain;
use crate::channel::{Channel, EffortAt};
use crate::free::ServoValues;
use crate::joint::Scheme;
use crate::log::ServoLog;
use crate::measured::Measured;
use crate::rollout::{Lost, Rollout, Simulated};
use crate::settings::ServoSettings;
use crate::term::Term;

/// Share of the variance of a measured effort that the simulated one must explain, scale and zero free.
const LEAST_EXPLAINED: f64 = 0.5;

/// Share of the variance from which the sign is right whatever side of zero a measured effort stays on: its zero may lie far off.
const SURE: f64 = 0.95;

/// Share of rows on each side of zero for an effort to go to both, and on one side for it to stay on the other.
const BOTH_SIDES: f64 = 0.05;
const ONE_SIDE: f64 = 0.005;

/// Rows by which measured efforts are tried ahead of positions, and behind them.
const AHEAD: isize = 2;
const BEHIND: isize = 4;

/// Simulated efforts and velocities of one joint beside what a channel measures of it, in the joint's direction.
struct Beside {
    joint: usize,
    channel: Channel,
    logs: Vec<OfLog>,
}

struct OfLog {
    /// Place of the log.
    log: usize,
    measured: Vec<f64>,
    effort: Vec<f64>,
    velocity: Vec<f64>,
    /// Rows that count.
    counted: Vec<bool>,
}

/// How a measured effort follows from the simulated one.
#[derive(Clone, Copy)]
struct Relation {
    /// Measured over simulated.
    scale: f64,
    /// Measured per velocity.
    damping: f64,
    zero: f64,
    /// Share of the variance that is explained.
    explained: f64,
}

/// What becomes of the measured efforts.
pub(super) struct Taken {
    /// Logs without the efforts that are none.
    pub(super) logs: Vec<ServoLog>,
    /// Readings that stand out alone.
    pub(super) outliers: Vec<Outliers>,
    /// What the logs still measure.
    pub(super) measured: Measured,
    /// Every effort with what became of it.
    pub(super) uses: Vec<EffortUse>,
    /// A start for the fit of all channels.
    pub(super) start: ServoValues,
}

/// Compares measured efforts with those of a fit to positions alone. `doubt`: by joint the relative error of the position gain that they were simulated with
/// beyond which something else is wrong.
///
/// # Errors
/// [`Lost`]; [`ServoError::Signal`] of a signal that is not finite.
pub(super) fn take(
    chains: &[Chain],
    logs: &[ServoLog],
    values: &ServoValues,
    scheme: Scheme,
    settings: &ServoSettings,
    doubt: &[f64],
) -> Result<Taken, ServoError> {
    let n = values.joints.len();
    let mut beside = Vec::new();
    for chain in chains {
        collect(chain, logs, values, scheme, settings, &mut beside)?;
    }
    let at_drive = settings.effort_at == EffortAt::Drive;
    let with_damping = |j: usize| at_drive && !settings.known_damping[j];
    let mut outliers = Vec::new();
    for b in &mut beside {
        let relation = b.relation(0, with_damping(b.joint));
        outliers.extend(b.leave_out(&relation)?);
    }
    let related = |lag: isize| -> Vec<Relation> {
        beside.iter().map(|b| b.relation(lag, with_damping(b.joint))).collect()
    };
    // One clock wrote all of them.
    let lag = (-AHEAD..=BEHIND)
        .map(|lag| (lag, related(lag).iter().map(|r| 1.0 - r.explained).sum::<f64>()))
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .map_or(0, |(lag, _)| lag);
    let relations = related(lag);
    let mut cleaned = logs.to_vec();
    for (o, rows) in &outliers {
        cleaned[o.log].leave_out(o.channel, o.joint, rows);
    }
    let mut out = Taken {
        logs: cleaned,
        outliers: outliers.into_iter().map(|(o, _)| o).collect(),
        measured: Measured::none(n),
        uses: Vec::new(),
        start: values.clone(),
    };
    let mut scales = vec![Vec::new(); n];
    // One kind of register reads all joints: where one shows that it has no sign, another that stays on one side of zero has none either.
    let unsigned = |b: &Beside, r: &Relation| r.explained < SURE && b.stays(lag);
    let registers: Vec<Channel> = beside
        .iter()
        .zip(&relations)
        .filter(|(b, r)| unsigned(b, r) && b.goes_both_ways(lag))
        .map(|(b, _)| b.channel)
        .collect();
    let period = logs.iter().map(ServoLog::period).fold(0.0, f64::max);
    for (b, r) in beside.iter().zip(&relations) {
        let (j, channel) = (b.joint, b.channel);
        let newtons = channel == Channel::Effort || settings.known_constant[j];
        let far = newtons && r.scale > 0.0 && r.scale.ln().abs() > doubt[j].max(CONFLICT).ln_1p();
        let verdict = match () {
            () if registers.contains(&channel) && unsigned(b, r) => EffortVerdict::Unsigned,
            () if r.explained < LEAST_EXPLAINED => EffortVerdict::Unlike,
            () if r.scale <= 0.0 => EffortVerdict::Against,
            () if far => EffortVerdict::OtherSize,
            () => EffortVerdict::Taken,
        };
        let ratio = newtons.then_some(r.scale);
        out.uses.push(EffortUse { joint: j, channel, verdict, ratio, explained: r.explained, rms: f64::NAN });
        if !verdict.is_taken() {
            for log in &mut out.logs {
                let of = if channel == Channel::Effort { &mut log.effort } else { &mut log.current };
                if let Some(values) = of.get_mut(j) {
                    values.clear();
                }
            }
            continue;
        }
        let joint = &mut out.start.joints[j];
        joint.set(Term::EffortDelay, lag as f64 * period);
        if channel == Channel::Effort {
            out.measured.effort[j] = true;
            joint.set(Term::EffortZero, joint.direction * r.zero);
        } else {
            out.measured.current[j] = true;
            let constant = if settings.known_constant[j] { joint.get(Term::TorqueConstant) } else { 1.0 };
            joint.set(Term::CurrentZero, joint.direction * r.zero / constant);
            if !settings.known_constant[j] {
                joint.set(Term::TorqueConstant, 1.0 / r.scale);
            }
        }
        if with_damping(j) {
            // What the positions tell is the sum of both.
            let in_newtons = if newtons { 1.0 } else { 1.0 / r.scale };
            let whole = joint.get(Term::Viscous) + joint.get(Term::VelocityGain);
            let damping = (-r.damping * in_newtons).max(0.0).min(whole);
            joint.set(Term::VelocityGain, damping);
            joint.set(Term::Viscous, whole - damping);
        }
        if newtons && at_drive {
            scales[j].push(r.scale);
        }
    }
    out.rescale(&scales, settings);
    Ok(out)
}

/// Relative difference of measured and simulated efforts below which neither is called wrong.
const CONFLICT: f64 = 0.25;

impl Taken {
    /// Gives gains and all that scales with them the size that measured efforts have.
    fn rescale(&mut self, scales: &[Vec<f64>], settings: &ServoSettings) {
        let mut all: Vec<f64> = scales.iter().flatten().copied().collect();
        all.sort_by(f64::total_cmp);
        let Some(middle) = all.get(all.len() / 2).copied() else { return };
        for (j, joint) in self.start.joints.iter_mut().enumerate() {
            if settings.known_gain[j] {
                continue;
            }
            let own = settings.own_gains.then(|| scales[j].first().copied()).flatten();
            let scale = if settings.own_gains { own.unwrap_or(1.0) } else { middle };
            let known = |term: Term| match term {
                Term::VelocityGain => settings.known_damping[j],
                Term::TorqueConstant => settings.known_constant[j] || !self.measured.current[j],
                Term::EffortLimit => true,
                _ => false,
            };
            for term in Term::ALL.into_iter().filter(|t| t.scales_with_effort() && !known(*t)) {
                joint.set(term, scale * joint.get(term));
            }
        }
    }
}

/// Simulates a chain along all logs.
fn collect(
    chain: &Chain,
    logs: &[ServoLog],
    values: &ServoValues,
    scheme: Scheme,
    settings: &ServoSettings,
    out: &mut Vec<Beside>,
) -> Result<(), Lost> {
    let rollout = Rollout::new(chain, scheme, &[]);
    let first = out.len();
    let channels = [Channel::Effort, Channel::Current];
    for channel in channels.into_iter().filter(|c| settings.channels.contains(c)) {
        for j in &chain.joints {
            if logs.iter().any(|log| log.measured(channel, *j).is_some()) {
                out.push(Beside { joint: *j, channel, logs: Vec::new() });
            }
        }
    }
    for (place, log) in logs.iter().enumerate() {
        let mut efforts = vec![vec![0.0; log.rows()]; chain.len()];
        let mut velocities = efforts.clone();
        rollout.run_with_efforts(values, log, |seen| match seen {
            Simulated::Row(row) => {
                velocities.iter_mut().zip(row.velocity).for_each(|(to, v)| to[row.row] = *v);
            }
            Simulated::Effort(seen) => efforts[seen.joint][seen.row] = seen.effort,
        })?;
        let counted = log.counted();
        for b in &mut out[first..] {
            let (Some(measured), Some(k)) =
                (log.measured(b.channel, b.joint), chain.joints.iter().position(|j| *j == b.joint))
            else {
                continue;
            };
            let direction = values.joints[b.joint].direction;
            let constant = match (b.channel, settings.known_constant[b.joint]) {
                (Channel::Current, true) => values.joints[b.joint].get(Term::TorqueConstant),
                _ => 1.0,
            };
            let measured = measured.iter().map(|m| direction * constant * m).collect();
            b.logs.push(OfLog {
                log: place,
                measured,
                effort: efforts[k].clone(),
                velocity: velocities[k].clone(),
                counted: counted.clone(),
            });
        }
    }
    Ok(())
}

impl Beside {
    /// Leaves out single readings that stand out of what a relation misses, so that they do not hide it; returns them with their rows.
    fn leave_out(&mut self, r: &Relation) -> Result<Vec<(Outliers, Vec<usize>)>, ServoError> {
        let mut out = Vec::new();
        for of in &mut self.logs {
            let simulated = of.effort.iter().zip(&of.velocity);
            let residual: Vec<f64> = of
                .measured
                .iter()
                .zip(simulated)
                .map(|(m, (e, v))| if m.is_nan() { 0.0 } else { m - r.scale * e - r.damping * v - r.zero })
                .collect();
            let rows = outliers::of(&residual, &of.measured, 0.0)
                .map_err(|source| ServoError::Signal { log: format!("log {}", of.log + 1), source })?;
            if !rows.is_empty() {
                rows.iter().for_each(|row| of.measured[*row] = f64::NAN);
                let (log, joint, channel) = (of.log, self.joint, self.channel);
                out.push((Outliers { log, joint, channel, rows: rows.len() }, rows));
            }
        }
        Ok(out)
    }

    /// Measured efforts, with simulated ones and velocities `lag` rows before.
    fn rows(&self, lag: isize) -> Vec<[f64; 3]> {
        let mut rows = Vec::new();
        for OfLog { measured, effort, velocity, counted, .. } in &self.logs {
            for row in (0..measured.len()).filter(|r| counted[*r] && !measured[*r].is_nan()) {
                let Some(at) = row.checked_add_signed(-lag).filter(|at| *at < effort.len()) else { continue };
                rows.push([measured[row], effort[at], velocity[at]]);
            }
        }
        rows
    }

    /// Whether the measured effort stays on one side of zero.
    fn stays(&self, lag: isize) -> bool {
        let rows = self.rows(lag);
        let most = ONE_SIDE * rows.len() as f64;
        let beyond = |side: f64| rows.iter().filter(|r| side * r[0] > 0.0).count() as f64;
        beyond(1.0) <= most || beyond(-1.0) <= most
    }

    /// Whether the simulated effort goes to both sides of zero.
    fn goes_both_ways(&self, lag: isize) -> bool {
        let rows = self.rows(lag);
        let least = BOTH_SIDES * rows.len() as f64;
        let size = (rows.iter().map(|r| r[1] * r[1]).sum::<f64>() / rows.len() as f64).sqrt();
        let beyond = |side: f64| rows.iter().filter(|r| side * r[1] > 0.2 * size).count() as f64;
        beyond(1.0) > least && beyond(-1.0) > least
    }

    /// Least squares of the measured effort by the simulated one, with `with_damping` the velocity, and a constant; `lag`: rows by which it
    /// lies behind.
    fn relation(&self, lag: isize, with_damping: bool) -> Relation {
        let mut rows = self.rows(lag);
        let count = (rows.len() as f64).max(1.0);
        let means = [0, 1, 2].map(|c| rows.iter().map(|r| r[c]).sum::<f64>() / count);
        rows.iter_mut().for_each(|r| r.iter_mut().zip(means).for_each(|(x, mean)| *x -= mean));
        let product = |a: usize, b: usize| rows.iter().map(|r| r[a] * r[b]).sum::<f64>();
        let columns = if with_damping { 2 } else { 1 };
        // A column that is constant gets no share.
        let ridge =
            |i: usize, j: usize| if i == j { 1e-12 * product(i + 1, i + 1) + f64::MIN_POSITIVE } else { 0.0 };
        let matrix = Mat::from_fn(columns, columns, |i, j| product(i + 1, j + 1) + ridge(i, j));
        let right: Vec<f64> = (0..columns).map(|i| product(0, i + 1)).collect();
        let x = match matrix.cholesky() {
            Some(factor) => factor.solve_vector(&right),
            None => vec![0.0; columns],
        };
        let (scale, damping) = (x[0], x.get(1).copied().unwrap_or(0.0));
        let (whole, gained) = (product(0, 0), x.iter().zip(&right).map(|(x, r)| x * r).sum::<f64>());
        let explained = if whole > 0.0 && gained.is_finite() { gained / whole } else { 0.0 };
        Relation { scale, damping, zero: means[0] - scale * means[1] - damping * means[2], explained }
    }
}
