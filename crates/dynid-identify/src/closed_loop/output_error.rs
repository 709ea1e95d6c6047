//! Closed-loop output error: rows of positions.

use dynid_estimate::instruments::Simulated;
use dynid_factor::groups::ReducedGroup;
use dynid_factor::rows::GroupResiduals;
use dynid_factor::{Factor, FactorBuilder};
use dynid_rows::conditioning::{ConditioningError, time_blocks};
use dynid_sim::{DrivenMotion, position_slopes};
use rayon::prelude::*;

use super::simulation::{Bench, Diverged, Driven, Moved};
use crate::Error;
use crate::fitting::RowResiduals;

/// A row of an output at a sample of a log: slopes by all base columns, and what they leave to explain.
struct Row<'a> {
    output: usize,
    sample: usize,
    slopes: &'a [f64],
    wanted: f64,
}

/// Simulations with noise that the mean displacement is taken from.
const SHAKEN: u64 = 8;

/// How noise of the encoders, fed back by the controller, displaces a robot on the average: per log and output.
pub(super) type Shake = Vec<Vec<Vec<f64>>>;

impl Bench<'_> {
    /// The mean displacement by noise as large as that of the logs. It would be zero in a linear loop; a joint that is shaken slips more
    /// easily through its friction.
    pub(super) fn shake(&self, factor: &Factor) -> Result<Result<Shake, Diverged>, Error> {
        let calm = match self.moved(factor)? {
            Ok(calm) => calm,
            Err(diverged) => return Ok(Err(diverged)),
        };
        let seeds: Vec<u64> = (1..=SHAKEN).collect();
        let runs: Vec<_> = seeds.into_par_iter().map(|seed| self.moved_with(factor, Some(seed))).collect();
        let mut mean: Shake =
            calm.logs.iter().map(|l| l.q.iter().map(|q| vec![0.0; q.len()]).collect()).collect();
        for run in runs {
            let shaken = match run? {
                Ok(shaken) => shaken,
                Err(diverged) => return Ok(Err(diverged)),
            };
            for ((mean, shaken), calm) in mean.iter_mut().zip(&shaken.logs).zip(&calm.logs) {
                for ((mean, shaken), calm) in mean.iter_mut().zip(&shaken.q).zip(&calm.q) {
                    for ((m, s), c) in mean.iter_mut().zip(shaken).zip(calm) {
                        *m += (s - c) / SHAKEN as f64;
                    }
                }
            }
        }
        Ok(Ok(mean))
    }

    /// Rows `K_p S x = K_p (q - q_s + S x_s)` of all samples, one factor per log, output and time block, for the parameters `x_s` that a factor
    /// of base columns determines. The position gain makes efforts of positions, which changes no estimate: every output has a
    /// variance of its own.
    ///
    /// `shake`: what noise displaces the robot by, taken off the measured positions.
    pub(super) fn positions(&self, factor: &Factor, shake: Option<&Shake>) -> Result<Simulated, Error> {
        match self.moved(factor)? {
            Ok(driven) => Ok(Simulated::Rows(self.position_groups(&driven, shake)?)),
            Err(diverged) => Ok(diverged.into()),
        }
    }

    fn position_groups(&self, driven: &Driven, shake: Option<&Shake>) -> Result<Vec<ReducedGroup>, Error> {
        let problem = self.closed.problem;
        let total = problem.structure.base.len();
        let settings = problem.settings.conditioning_settings();
        let textbook = || problem.settings.textbook_route().cutoff_hz;
        let kernel_hz = self.closed.conditioning.map_or_else(textbook, |c| c.kernel_hz);
        let mut groups = Vec::new();
        for (log, moved) in driven.logs.iter().enumerate() {
            let (length, blocks) = time_blocks(&problem.logs[log], kernel_hz, problem.logs.len(), &settings);
            let outputs = moved.q.len();
            let mut builders: Vec<FactorBuilder> = (0..outputs).map(|_| FactorBuilder::new(total)).collect();
            let mut done: Vec<Vec<Factor>> = vec![Vec::new(); outputs];
            let (mut open, mut fault) = (0, None);
            self.each_row((driven, shake), log, &mut |row| {
                let block = (row.sample / length).min(blocks - 1);
                while open < block {
                    done.iter_mut().zip(&mut builders).for_each(|(d, b)| d.push(b.take()));
                    open += 1;
                }
                if let Err(e) = builders[row.output].push_row(row.slopes, row.wanted) {
                    fault.get_or_insert((row.output, e));
                }
            })?;
            if let Some((output, source)) = fault {
                return Err(Error::Conditioning(ConditioningError::Rows { output, source }));
            }
            while open < blocks {
                done.iter_mut().zip(&mut builders).for_each(|(d, b)| d.push(b.take()));
                open += 1;
            }
            let of_output = |(output, blocks)| ReducedGroup {
                log,
                output,
                scale: 0,
                columns: (0..total).collect(),
                blocks,
            };
            groups.extend(done.into_iter().enumerate().map(of_output));
        }
        Ok(groups)
    }

    /// Residuals of these rows, linear about the parameters that a factor determines; `None` if the simulation diverges.
    pub(super) fn position_residuals(
        &self,
        factor: &Factor,
        shake: Option<&Shake>,
        x: &[f64],
    ) -> Result<Option<RowResiduals>, Error> {
        let Ok(driven) = self.moved(factor)? else { return Ok(None) };
        let mut all = Vec::new();
        for (log, moved) in driven.logs.iter().enumerate() {
            let empty = || GroupResiduals { samples: Vec::new(), residuals: Vec::new() };
            let mut of_outputs: Vec<GroupResiduals> = moved.q.iter().map(|_| empty()).collect();
            self.each_row((&driven, shake), log, &mut |row| {
                let explained: f64 = row.slopes.iter().zip(x).map(|(s, x)| s * x).sum();
                of_outputs[row.output].samples.push(row.sample);
                of_outputs[row.output].residuals.push(row.wanted - explained);
            })?;
            all.extend(of_outputs.into_iter().enumerate().map(|(output, r)| (log, output, r)));
        }
        Ok(Some(RowResiduals::of(all)))
    }

    /// Hands over the rows of a log, sample by sample; those in gaps of the clock are left out.
    fn each_row(
        &self,
        (driven, shake): (&Driven, Option<&Shake>),
        log: usize,
        visit: &mut dyn FnMut(Row<'_>),
    ) -> Result<(), Error> {
        let problem = self.closed.problem;
        let (prepared, kept) = (&problem.logs[log], &problem.structure.base.kept);
        let Moved { q, dq, ddq, gains } = &driven.logs[log];
        let channels: Vec<(&str, &[f64])> =
            prepared.channels.iter().map(|c| (c.name.as_str(), c.values.as_slice())).collect();
        let [position_gain, velocity_gain]: [Vec<f64>; 2] =
            [gains.iter().map(|g| g.0).collect(), gains.iter().map(|g| g.1).collect()];
        let motion = DrivenMotion {
            step_s: 1.0 / prepared.rate_hz,
            q,
            dq,
            ddq,
            channels: &channels,
            position_gain: &position_gain,
            velocity_gain: &velocity_gain,
            sign_width: self.table.sign_width,
        };
        let start = problem.structure.base.values(&driven.values);
        let outputs = q.len();
        let mut slopes = vec![0.0; kept.len()];
        let parameters = (&driven.values[..], &self.shape[..]);
        position_slopes(&problem.model, parameters, kept, &motion, &mut |sample, all| {
            if !prepared.usable[sample] {
                return;
            }
            for output in 0..outputs {
                let gain = position_gain[output];
                for (c, slope) in slopes.iter_mut().enumerate() {
                    *slope = gain * all[c * outputs + output];
                }
                let known: f64 = slopes.iter().zip(&start).map(|(s, x)| s * x).sum();
                let shaken = shake.map_or(0.0, |s| s[log][output][sample]);
                let off = prepared.position[output][sample] - shaken - q[output][sample];
                visit(Row { output, sample, slopes: &slopes, wanted: gain * off + known });
            }
        })?;
        Ok(())
    }
}
