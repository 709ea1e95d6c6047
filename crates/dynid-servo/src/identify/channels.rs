//! What is measured beside positions, and readings that are none: what joins the sum of squares, and what is left out of it.

use super::result::{EffortUse, GroupKind, Outliers, ServoError};
use super::verdict::groups;
use super::{Work, efforts, outliers};
use crate::channel::{Channel, EffortAt};
use crate::fit::{Fitted, GaussNewton, deviations, readings};
use crate::free::Free;
use crate::free::ServoValues;
use crate::joint::{Hold, Scheme};
use crate::rollout::Lost;
use crate::term::Term;

/// Share of a period that stands for an instant.
const INSTANT: f64 = 0.05;

/// Relative difference of losses up to which two readings of the efforts are met alike.
const ALIKE: f64 = 0.01;

/// Relative half width of an interval from which a scale that moves all its members together is moved by the least error of the model, too.
const OPEN_SCALE: f64 = 0.02;

impl Work<'_> {
    /// Leaves out readings that stand out alone of what a fit misses, of the channels from one on: too small for a spike of the reading itself, and no
    /// motion of a joint. Returns whether there are any.
    pub(super) fn leave_out(&mut self, fitted: &Fitted, from: usize) -> Result<bool, ServoError> {
        let n = fitted.values.joints.len();
        let simulated = readings(&self.problem(&[], self.scheme), &fitted.values)?;
        let before = self.outliers.len();
        for (slot, simulated) in simulated.iter().enumerate().skip(from * n) {
            let (channel, joint) = (self.channels[slot / n], slot % n);
            let mut rest = simulated.as_slice();
            for (l, log) in self.logs.iter_mut().enumerate() {
                let Some(measured) = log.measured(channel, joint) else { continue };
                let (own, others) = rest.split_at(measured.len());
                rest = others;
                let miss = |(m, s): (&f64, &f64)| if (m - s).is_nan() { 0.0 } else { m - s };
                let mut residual: Vec<f64> = measured.iter().zip(own).map(miss).collect();
                if let Some(rows) = log.left_out.get(joint).filter(|_| channel == Channel::Position) {
                    // What stands for a spike is no reading.
                    for row in rows.iter().filter(|row| **row > 0) {
                        residual[*row] = residual[row - 1];
                    }
                }
                let step = match channel {
                    Channel::Position => log.resolution.get(joint).copied().unwrap_or(0.0),
                    _ => 0.0,
                };
                let rows = outliers::of(&residual, measured, step)
                    .map_err(|source| ServoError::Signal { log: log.name.clone(), source })?;
                if !rows.is_empty() {
                    log.leave_out(channel, joint, &rows);
                    self.outliers.push(Outliers { log: l, joint, channel, rows: rows.len() });
                }
            }
        }
        Ok(self.outliers.len() > before)
    }

    /// Adds what was measured beside positions to the sum of squares, as far as it is wanted and makes sense; `fitted`: to positions alone.
    pub(super) fn take_channels(&mut self, free: &[Free], fitted: &mut Fitted) -> Result<(), ServoError> {
        let n = fitted.values.joints.len();
        let has = |c: &Channel| {
            self.settings.channels.contains(c)
                && (0..n).any(|j| self.logs.iter().any(|log| log.measured(*c, j).is_some()))
        };
        let wanted: Vec<Channel> = Channel::ALL.into_iter().filter(has).collect();
        if wanted.iter().any(|c| c.tells_effort()) {
            let doubt = self.doubt_of_gains(free, fitted);
            let taken =
                efforts::take(self.chains, &self.logs, &fitted.values, self.scheme, self.settings, &doubt)?;
            self.logs = taken.logs;
            self.outliers.extend(taken.outliers);
            self.measured = taken.measured;
            self.efforts = taken.uses;
            fitted.values = taken.start;
        }
        let left = |c: &Channel| match c {
            Channel::Effort => self.measured.effort.contains(&true),
            Channel::Current => self.measured.current.contains(&true),
            Channel::Position | Channel::Velocity => *c != Channel::Position,
        };
        self.channels.extend(wanted.into_iter().filter(left));
        Ok(())
    }

    /// A fit to all channels: efforts have a mean of the command over a period in them, or what it is at an instant, as they are met better. The first has
    /// slopes that lead to the second. Where both are met alike, what they make of the velocity gain differs all the same.
    pub(super) fn fit_channels(&mut self, free: &[Free], start: &ServoValues) -> Result<Fitted, Lost> {
        let mean = self.refit(free, start, self.scheme, &GaussNewton::default())?;
        let jumps = self.scheme.hold == Hold::Held && self.scheme.effort_at == EffortAt::Drive;
        if !jumps || !self.channels.iter().any(|c| c.tells_effort()) {
            return Ok(mean);
        }
        let instant = Scheme { effort_span_s: INSTANT * self.scheme.effort_span_s, ..self.scheme };
        let sharp = self.refit(free, &mean.values, instant, &GaussNewton::default());
        let sigma: Vec<f64> =
            mean.evaluation.variances(&|_| true).iter().map(|s| s.sqrt().max(1e-12)).collect();
        let loss = |f: &Fitted| f.evaluation.loss(&sigma, &|_| true);
        let Ok(sharp) = sharp else { return Ok(mean) };
        let ratio = loss(&sharp) / loss(&mean);
        if (ratio - 1.0).abs() < ALIKE {
            let moved = sharp.estimate.iter().zip(&mean.estimate).map(|(a, b)| (a - b).abs());
            self.by_span = free.iter().cloned().zip(moved).collect();
        }
        if ratio < 1.0 {
            self.scheme = instant;
            return Ok(sharp);
        }
        Ok(mean)
    }

    /// By joint, the relative error of its position gain that is beyond all doubt: twice what a stated one may have, five times the half width of the
    /// 95 % interval of one that positions tell; infinite where the scale of gain, rotor and friction is open, since the least error of the model moves it.
    fn doubt_of_gains(&self, free: &[Free], fitted: &Fitted) -> Vec<f64> {
        let found = deviations(&self.problem(free, self.scheme), fitted);
        let open = groups(free, &found.inside, &found.correlation);
        let of = |j: usize| {
            let gain = |f: &Free| f.as_term() == Some(Term::PositionGain) && f.joints().contains(&j);
            let Some(k) = free.iter().position(gain) else { return 2.0 * self.settings.gain_error };
            let half = |sd: f64| found.quantile[k] * sd / fitted.estimate[k].abs();
            let half = found.jackknife[k].map_or(f64::INFINITY, half);
            let open = open.iter().any(|g| g.kind == GroupKind::Scale && g.members.contains(&k));
            if open && half > OPEN_SCALE { f64::INFINITY } else { 5.0 * half }
        };
        (0..fitted.values.joints.len()).map(of).collect()
    }

    /// Every measured effort with what the last fit leaves of it.
    pub(super) fn explained(&self, fitted: &Fitted) -> Vec<EffortUse> {
        let n = fitted.values.joints.len();
        let squares = fitted.evaluation.mean_squares(&|_| true);
        let one = |e: &EffortUse| {
            let Some(c) = self.channels.iter().position(|c| *c == e.channel).filter(|_| e.verdict.is_taken())
            else {
                return *e;
            };
            let square = squares[c * n + e.joint];
            EffortUse {
                rms: square.sqrt(),
                explained: 1.0 - square / self.variance(e.channel, e.joint),
                ..*e
            }
        };
        self.efforts.iter().map(one).collect()
    }

    /// Variance of what a channel reads of a joint.
    fn variance(&self, channel: Channel, joint: usize) -> f64 {
        let logs = || self.logs.iter().filter_map(|log| log.measured(channel, joint));
        let all = || logs().flatten().filter(|x| !x.is_nan());
        let rows = all().count().max(1) as f64;
        let mean = all().sum::<f64>() / rows;
        all().map(|x| (x - mean) * (x - mean)).sum::<f64>() / rows
    }
}
