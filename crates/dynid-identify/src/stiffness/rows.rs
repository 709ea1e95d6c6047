//! Sums of link and motor rows, and deformations, of all logs.

use dynid_clearance::deformation::{DeformationRows, Rows, Settings, SumRows};
use dynid_model::{EffortModel, MotionBlock, RegressorBlock, RobotModel};
use dynid_motion::SignalError;
use dynid_motion::difference::central;
use dynid_motion::filter::{butterworth, forward_backward};
use dynid_motion::mask::{self, dilate, near_reversal};
use dynid_motion::shift::shift;
use dynid_motion::signal::rms;
use dynid_rows::conditioning::PreparedLog;

use super::Spring;
use crate::Error;
use crate::identification::Identification;

/// Cut-off of all signals, Hz.
const CUTOFF_HZ: f64 = 10.0;
/// Rows kept per period of the cut-off.
const PER_PERIOD: f64 = 5.0;
/// Correlation of residuals that spreads bear, s.
const CORRELATED_S: f64 = 0.4;
/// Standard deviations of a prior that nobody stated are widened so: it decides only what the logs leave open.
const PRIOR: f64 = 10.0;
/// Share of the rms speed below which a joint counts as reversing, with so much to either side, s.
const REVERSAL: f64 = 0.1;
const ROUND_S: f64 = 0.1;

/// One log through its filter, away from edges and gaps.
struct Filtered {
    block: RegressorBlock,
    /// Per output: effort without what is known of it.
    effort: Vec<Vec<f64>>,
    /// Per elastic joint: deformation, speed of the link, sign of the motor's speed, position of the link.
    deformed: Vec<[Vec<f64>; 4]>,
    /// Per output: columns of friction.
    friction: Vec<Vec<usize>>,
    /// Per output and sample: 1 where the joint moves, 0 where it stands or reverses, since friction has any value there.
    sliding: Vec<Vec<f64>>,
    samples: usize,
}

impl Filtered {
    /// Column of a parameter in an output's rows; zero where it does not act there.
    fn column(&self, output: usize, parameter: usize) -> Vec<f64> {
        let place = self.block.layout().columns(output).iter().position(|c| *c == parameter);
        place.map_or_else(|| vec![0.0; self.samples], |k| self.block.column(output, k).to_vec())
    }
}

/// Rows of all logs.
pub(super) struct LogRows {
    pub(super) rows: Rows,
    pub(super) settings: Settings,
    /// Per elastic joint: torque of the spring as the fit of the robot's rows has it, N m.
    pub(super) springs: Vec<Vec<f64>>,
}

/// Rows of all logs, the links' records moved by a lag; `None` where no sample is left.
pub(super) fn rows(id: &Identification, springs: &[Spring], lag_s: f64) -> Result<Option<LogRows>, Error> {
    let model = &id.model;
    let filtered = |log| filtered(model, springs, log, lag_s);
    let logs = id.logs.iter().map(filtered).collect::<Result<Vec<_>, SignalError>>();
    let logs = logs.map_err(|e| Error::Conditioning(e.into()))?;
    let slowest = id.logs.iter().map(|l| l.rate_hz).fold(f64::INFINITY, f64::min);
    let cutoff = cutoff(slowest);
    let total: usize = logs.iter().map(|l| l.samples).sum();
    if total == 0 {
        return Ok(None);
    }
    let columns: Vec<usize> = (0..model.parameters().linear.len())
        .filter(|c| !springs.iter().any(|s| s.columns.contains(c)))
        .collect();
    let p = columns.len();
    let joined = |of: &dyn Fn(&Filtered) -> Vec<f64>| logs.iter().flat_map(of).collect::<Vec<f64>>();
    let column = |output: usize, column: usize| joined(&|l: &Filtered| l.column(output, column));
    let effort = |output: usize| joined(&|l: &Filtered| l.effort[output].clone());
    // Rows of efforts count where the joint moves.
    let sliding = |output: usize, mut x: Vec<f64>| {
        let counts = logs.iter().flat_map(|l| &l.sliding[output]);
        x.iter_mut().zip(counts).for_each(|(x, counts)| *x *= counts);
        x
    };
    let is_elastic = |output: &usize| springs.iter().any(|s| s.link == *output || s.motor == *output);
    let mut sums: Vec<SumRows> = (0..model.outputs().len())
        .filter(|o| !is_elastic(o) && !model.is_undriven(*o))
        .map(|o| {
            let regressor = columns.iter().map(|c| sliding(o, column(o, *c))).collect();
            SumRows { regressor, effort: sliding(o, effort(o)) }
        })
        .collect();
    let added = |a: Vec<f64>, b: Vec<f64>, times: f64| -> Vec<f64> {
        a.iter().zip(&b).map(|(a, b)| a + times * b).collect()
    };
    let mut joints = Vec::new();
    for (j, spring) in springs.iter().enumerate() {
        let both = |c: &usize| added(column(spring.link, *c), column(spring.motor, *c), spring.ratio);
        sums.push(SumRows {
            regressor: columns.iter().map(|c| sliding(spring.motor, both(c))).collect(),
            effort: sliding(spring.motor, added(effort(spring.link), effort(spring.motor), spring.ratio)),
        });
        // Friction behind the spring is a column of the hysteresis and of the lag.
        let load = |c: &usize| match logs.iter().any(|l| l.friction[spring.link].contains(c)) {
            true => vec![0.0; total],
            false => column(spring.link, *c),
        };
        let signal = |k: usize| joined(&|l: &Filtered| l.deformed[j][k].clone());
        let mut nuisances = vec![signal(1), signal(2)];
        for (k, log) in logs.iter().enumerate() {
            let before: usize = logs[..k].iter().map(|l| l.samples).sum();
            let mut zero = vec![0.0; total];
            zero[before..before + log.samples].fill(1.0);
            nuisances.push(zero);
        }
        let q = signal(3);
        joints.push(DeformationRows {
            load: columns.iter().map(load).collect(),
            nuisances,
            once_per_turn: vec![q.iter().map(|q| q.sin()).collect(), q.iter().map(|q| q.cos()).collect()],
            deformation: signal(0),
        });
    }
    let width = |c: usize| if id.stated[c].is_some() { 1.0 } else { PRIOR };
    let prior = columns.iter().map(|c| (id.prior.values[*c], width(*c) * id.prior.std[*c])).collect();
    let lag = (CORRELATED_S * PER_PERIOD * cutoff).ceil() as usize;
    let torque = |spring: &Spring| {
        let mut out = vec![0.0; total];
        for c in &spring.columns {
            let value = id.values()[*c];
            out.iter_mut().zip(column(spring.link, *c)).for_each(|(o, x)| *o -= value * x);
        }
        out
    };
    Ok(Some(LogRows {
        springs: springs.iter().map(torque).collect(),
        rows: Rows { parameters: p, sums, joints, prior },
        settings: Settings { lag, ..Settings::default() },
    }))
}

fn cutoff(rate_hz: f64) -> f64 {
    CUTOFF_HZ.min(0.1 * rate_hz)
}

fn filtered(
    model: &RobotModel,
    springs: &[Spring],
    log: &PreparedLog,
    lag_s: f64,
) -> Result<Filtered, SignalError> {
    let (rate, n) = (log.rate_hz, log.samples());
    let cutoff = cutoff(rate);
    let filter = butterworth(4, cutoff, rate)?;
    let margin = (2.0 * rate / cutoff).ceil() as usize;
    let mut bad: Vec<bool> = log.usable.iter().map(|u| !u).collect();
    bad = dilate(&bad, margin);
    mask::merge(&mut bad, &mask::edges(n, margin));
    let thin = ((rate / (PER_PERIOD * cutoff)) as usize).max(1);
    let kept: Vec<usize> = (0..n).step_by(thin).filter(|k| !bad[*k]).collect();
    let pick = |signal: &[f64]| kept.iter().map(|k| signal[*k]).collect::<Vec<f64>>();
    let mut position = log.position.clone();
    for spring in springs {
        position[spring.link] = shift(&position[spring.link], lag_s * rate)?.values;
    }
    let (mut q, mut dq, mut ddq) = (Vec::new(), Vec::new(), Vec::new());
    let mut speeds = Vec::new();
    for signal in &position {
        let smooth = forward_backward(&filter, signal)?;
        let speed = central(&smooth, rate)?;
        q.extend(pick(&smooth));
        dq.extend(pick(&speed));
        ddq.extend(pick(&central(&speed, rate)?));
        speeds.push(speed);
    }
    let sliding = |speed: &Vec<f64>| {
        let reversing =
            dilate(&near_reversal(speed, REVERSAL * rms(speed)), (ROUND_S * rate).ceil() as usize);
        kept.iter().map(|k| if reversing[*k] { 0.0 } else { 1.0 }).collect()
    };
    let sliding: Vec<Vec<f64>> = speeds.iter().map(sliding).collect();
    let deformed = springs
        .iter()
        .map(|spring| {
            let pairs = position[spring.motor].iter().zip(&position[spring.link]);
            let raw: Vec<f64> = pairs.map(|(motor, link)| motor / spring.ratio - link).collect();
            let towards: Vec<f64> =
                speeds[spring.motor].iter().map(|v| (v / spring.ratio).signum()).collect();
            Ok([
                pick(&forward_backward(&filter, &raw)?),
                pick(&speeds[spring.link]),
                pick(&forward_backward(&filter, &towards)?),
                pick(&forward_backward(&filter, &position[spring.link])?),
            ])
        })
        .collect::<Result<Vec<_>, SignalError>>()?;
    let effort = log.effort.iter().map(|e| Ok(pick(&forward_backward(&filter, e)?)));
    let mut effort = effort.collect::<Result<Vec<Vec<f64>>, SignalError>>()?;
    let samples = kept.len();
    let channels: Vec<(&str, Vec<f64>)> =
        log.channels.iter().map(|c| (c.name.as_str(), pick(&c.values))).collect();
    let channels: Vec<(&str, &[f64])> = channels.iter().map(|(name, x)| (*name, x.as_slice())).collect();
    let motion = MotionBlock { channels: &channels, ..MotionBlock::plain(samples, &q, &dq, &ddq) };
    let shape = model.parameters().shape_start();
    let mut block = RegressorBlock::new(model.layout().clone(), samples);
    model.regressor(&motion, &shape, &mut block);
    for (output, effort) in effort.iter_mut().enumerate() {
        effort.iter_mut().zip(block.offset(output)).for_each(|(e, known)| *e -= known);
    }
    let friction = (0..model.outputs().len())
        .map(|output| model.friction_columns(output, &shape, &motion).into_iter().map(|(c, _)| c).collect())
        .collect();
    Ok(Filtered { block, effort, deformed, friction, sliding, samples })
}
