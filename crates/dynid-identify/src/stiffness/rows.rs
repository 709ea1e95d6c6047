//! Sums of link and motor rows, and deformations, of all logs.

use dynid_clearance::deformation::{DeformationRows, Rows, Settings, SumRows};
use dynid_model::{EffortModel, MotionBlock, RegressorBlock, RobotModel};
use dynid_motion::SignalError;
use dynid_motion::mask::{dilate, near_reversal};
use dynid_motion::shift::shift;
use dynid_motion::signal::rms;
use dynid_rows::conditioning::PreparedLog;

use super::Spring;
use super::deformed::{Deformed, Sieve, Smooth, rows_hz};
use crate::Error;
use crate::identification::Identification;

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
    /// Per elastic joint.
    deformed: Vec<Deformed>,
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
        let signal = |of: fn(&Deformed) -> &Vec<f64>| joined(&|l: &Filtered| of(&l.deformed[j]).clone());
        let mut nuisances = vec![signal(|d| &d.speed), signal(|d| &d.towards)];
        for (k, log) in logs.iter().enumerate() {
            let before: usize = logs[..k].iter().map(|l| l.samples).sum();
            let mut zero = vec![0.0; total];
            zero[before..before + log.samples].fill(1.0);
            nuisances.push(zero);
        }
        let q = signal(|d| &d.position);
        joints.push(DeformationRows {
            load: columns.iter().map(load).collect(),
            nuisances,
            once_per_turn: vec![q.iter().map(|q| q.sin()).collect(), q.iter().map(|q| q.cos()).collect()],
            deformation: signal(|d| &d.deformation),
        });
    }
    let width = |c: usize| if id.stated[c].is_some() { 1.0 } else { PRIOR };
    let prior = columns.iter().map(|c| (id.prior.values[*c], width(*c) * id.prior.std[*c])).collect();
    let lag = (CORRELATED_S * rows_hz(slowest)).ceil() as usize;
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

fn filtered(
    model: &RobotModel,
    springs: &[Spring],
    log: &PreparedLog,
    lag_s: f64,
) -> Result<Filtered, SignalError> {
    let rate = log.rate_hz;
    let sieve = Sieve::new(log)?;
    let mut position = log.position.clone();
    for spring in springs {
        position[spring.link] = shift(&position[spring.link], lag_s * rate)?.values;
    }
    let smooth =
        position.iter().map(|signal| sieve.smooth(signal)).collect::<Result<Vec<_>, SignalError>>()?;
    let all = |of: fn(&Smooth) -> &Vec<f64>| -> Vec<f64> {
        smooth.iter().flat_map(|s| sieve.pick(of(s))).collect()
    };
    let (q, dq, ddq) = (all(|s| &s.position), all(|s| &s.speed), all(|s| &s.acceleration));
    let sliding = |smooth: &Smooth| {
        let reversing = dilate(
            &near_reversal(&smooth.speed, REVERSAL * rms(&smooth.speed)),
            (ROUND_S * rate).ceil() as usize,
        );
        sieve.kept.iter().map(|k| if reversing[*k] { 0.0 } else { 1.0 }).collect()
    };
    let sliding: Vec<Vec<f64>> = smooth.iter().map(sliding).collect();
    let deformed = springs
        .iter()
        .map(|spring| {
            let motor = (position[spring.motor].as_slice(), &smooth[spring.motor], spring.ratio);
            sieve.deformed(motor, (&position[spring.link], &smooth[spring.link]))
        })
        .collect::<Result<Vec<_>, SignalError>>()?;
    let mut effort =
        log.effort.iter().map(|e| sieve.filtered(e)).collect::<Result<Vec<Vec<f64>>, SignalError>>()?;
    let samples = sieve.kept.len();
    let channels: Vec<(&str, Vec<f64>)> =
        log.channels.iter().map(|c| (c.name.as_str(), sieve.pick(&c.values))).collect();
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
