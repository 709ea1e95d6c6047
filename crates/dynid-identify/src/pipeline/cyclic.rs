//! Efforts that repeat with the position of a joint, which the residuals of a fit show.

use dynid_estimate::separable::ShapeFinding;
use dynid_friction::cyclic::{CyclicFinding, CyclicRows, CyclicSettings, find_cyclic, find_slow};
use dynid_model::{EffortModel, ShapeParameter};
use dynid_motion::Kernel;
use dynid_rows::conditioning::{Conditioning, LogMotion, PreparedLog, motions, parts_of_motions};
use rayon::prelude::*;

use super::Step;
use super::model_fit::ModelFit;
use super::shapes::Before;
use crate::Error;
use crate::elements::cyclic_element;
use crate::joint_cyclic::{JointCyclic, JointSlow};
use crate::problem::Problem;
use crate::settings::Friction;
use crate::shape::{ShapeFit, Start};

/// Parts of the motion that an order is held out on; a period is at least half as many.
const PARTS: f64 = 20.0;

impl Problem {
    /// Adds the cyclic efforts that the residuals of a fit show, and fits again if there are any. Their orders are shape parameters from then on.
    ///
    /// # Errors
    /// Fails as [`Problem::fit`] does.
    pub(super) fn fit_cyclic(
        mut self,
        mut fit: ModelFit,
        progress: &mut dyn FnMut(Step),
    ) -> Result<(Problem, ModelFit), Error> {
        let found = match &fit.conditioning {
            Some(choices) if self.settings.elements.friction == Friction::Auto => find(&self, &fit, choices),
            _ => Vec::new(),
        };
        if found.is_empty() {
            fit.slow = slow(&self, &fit);
            return Ok((self, fit));
        }
        for JointCyclic { output, found } in &found {
            let joint = self.model.outputs()[*output].name.clone();
            self.plan.add_cyclic(self.model.tree_rate(*output), &joint, found);
        }
        let before = fit.shapes.take();
        self.rebuild()?;
        let start = beside(before.as_ref(), &self.model.parameters().shape);
        let start = Before::Found { friction: std::mem::take(&mut fit.friction), start };
        let (problem, fit) = self.fit_from(fit.conditioning.take(), start, progress)?;
        let slow = slow(&problem, &fit);
        Ok((problem, ModelFit { cyclic: found, slow, ..fit }))
    }
}

/// A search of shape parameters some of which a fit found already: the orders of cyclic efforts join them.
fn beside(found: Option<&ShapeFit>, parameters: &[ShapeParameter]) -> Start {
    let of = |s: &ShapeParameter| {
        let found = found?;
        let table = found.model.parameters();
        let place = table.shape.iter().position(|own| own.name == s.name)?;
        Some((table.shape[place].start, found.finding(place).clone()))
    };
    let known: Vec<Option<(f64, ShapeFinding)>> = parameters.iter().map(of).collect();
    let value = |(s, known): (&ShapeParameter, &Option<(f64, ShapeFinding)>)| {
        known.as_ref().map_or(s.start, |(value, _)| *value)
    };
    let values = parameters.iter().zip(&known).map(value).collect();
    Start::Beside(values, known.into_iter().map(|known| Some(known?.1)).collect())
}

/// What the residuals of joints hold of slow functions of the position, beyond chance.
fn slow(problem: &Problem, fit: &ModelFit) -> Vec<JointSlow> {
    let Some(choices) = &fit.conditioning else { return Vec::new() };
    let Problem { model, logs, .. } = problem;
    let parts = Parts::of(logs);
    let outputs: Vec<usize> = (0..model.outputs().len()).filter(|o| !model.is_undriven(*o)).collect();
    let found: Vec<Option<JointSlow>> = outputs
        .par_iter()
        .map(|output| {
            let rows = rows(*output, problem, fit, &parts, choices.kernel_hz);
            let found = find_slow(&rows, &CyclicSettings::default())?;
            Some(JointSlow { output: *output, found })
        })
        .collect();
    found.into_iter().flatten().collect()
}

/// Cyclic efforts of the joints that may take some.
fn find(problem: &Problem, fit: &ModelFit, choices: &Conditioning) -> Vec<JointCyclic> {
    let Problem { model, plan, logs, .. } = problem;
    let parts = Parts::of(logs);
    // An estimator of a program's own need not leave the least residual, which then follows the position as gravity does.
    let whole = CyclicSettings::default();
    let slow_orders = if problem.settings.own_estimator.is_some() { 0 } else { whole.slow_orders };
    let settings = CyclicSettings { slow_orders, ..whole };
    let may = |output: &usize| {
        let (rate, name) = (model.tree_rate(*output), &model.outputs()[*output].name);
        let own = &plan.per_rate[rate];
        let has = |f: bool| own.iter().any(|element| element == cyclic_element(f).0);
        // Equal joints have equal parameters, and turn at other places.
        let tied = plan.equal_joints(name).next().is_some();
        !own.is_empty() && !has(false) && !has(true) && !tied && !model.is_undriven(*output)
    };
    let outputs: Vec<usize> = (0..model.outputs().len()).filter(may).collect();
    let found: Vec<Vec<CyclicFinding>> = outputs
        .par_iter()
        .map(|output| find_cyclic(&rows(*output, problem, fit, &parts, choices.kernel_hz), &settings))
        .collect();
    let of_output = |(output, found): (&usize, Vec<CyclicFinding>)| {
        let output = *output;
        found.into_iter().map(move |found| JointCyclic { output, found })
    };
    outputs.iter().zip(found).flat_map(of_output).collect()
}

/// Which part of the motion a sample lies in: the same places of a motion that repeats are one part.
struct Parts {
    /// Per log: length of its blocks, samples, and the part that each block is.
    of_log: Vec<(f64, Vec<usize>)>,
    count: usize,
}

impl Parts {
    fn of(logs: &[PreparedLog]) -> Self {
        let rates: Vec<f64> = logs.iter().map(|log| log.rate_hz).collect();
        Self::of_motions(&motions(logs), &rates)
    }

    /// `motions`: in samples; `rates`: of the logs, Hz.
    fn of_motions(motions: &[LogMotion], rates: &[f64]) -> Self {
        let of_logs = || motions.iter().zip(rates);
        let seconds: f64 = of_logs().map(|(motion, rate)| motion.length / rate).sum();
        let blocks: Vec<usize> = of_logs()
            .map(|(motion, rate)| {
                let period = motion.repeats_after.map_or(f64::INFINITY, |samples| samples / rate);
                let block = (seconds / PARTS).min(2.0 * period / PARTS);
                (motion.length / rate / block).round().max(1.0) as usize
            })
            .collect();
        let of_block = parts_of_motions(motions, &blocks);
        let count = of_block.iter().flatten().max().map_or(0, |part| part + 1);
        // A period is a whole number of blocks, so that blocks of a log need not add up to it: the last takes the rest.
        let lengths = motions.iter().zip(&blocks).map(|(motion, blocks)| motion.parts(*blocks).1);
        Parts { of_log: lengths.zip(of_block).collect(), count }
    }

    fn at(&self, log: usize, sample: usize) -> usize {
        let (length, parts) = &self.of_log[log];
        parts[((sample as f64 / length) as usize).min(parts.len() - 1)]
    }
}

/// Rows of the widest kernel of one output, in all logs that move it.
fn rows(output: usize, problem: &Problem, fit: &ModelFit, parts: &Parts, kernel_hz: f64) -> CyclicRows {
    let logs = &problem.logs;
    let kernel_s = Kernel::standard_deviation_at(kernel_hz);
    let slides = problem.model.joints()[output].slides;
    let mut out = CyclicRows { parts: parts.count, kernel_s, slides, ..CyclicRows::default() };
    for (log, rows) in fit.residuals.of_output(output) {
        let prepared = &logs[log];
        if !prepared.moves[output] || prepared.held[output] {
            continue;
        }
        let (position, samples) = (&prepared.position[output], prepared.samples());
        let square: f64 = rows.residuals.iter().map(|r| r * r).sum();
        let weight = (rows.residuals.len() as f64 / square).sqrt();
        if !weight.is_finite() {
            continue;
        }
        // The mean speed under the kernel: encoder steps must not show.
        let reach = (out.kernel_s * prepared.rate_hz).ceil() as usize;
        for (sample, residual) in rows.samples.iter().zip(&rows.residuals) {
            let (first, last) = (sample.saturating_sub(reach), (sample + reach).min(samples - 1));
            let seconds = (last - first) as f64 / prepared.rate_hz;
            out.position.push(position[*sample]);
            out.velocity.push((position[last] - position[first]) / seconds);
            out.residual.push(*residual);
            out.weight.push(weight);
            out.part.push(parts.at(log, *sample));
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_place_of_every_period_is_in_the_same_part() {
        // 4.66 periods: no whole number of blocks.
        let motion = LogMotion { length: 23_300.0, repeats_after: Some(5_000.0), first: 0, lag: 0.0 };
        let parts = Parts::of_motions(&[motion], &[1000.0]);
        assert!(parts.count >= 10, "{}", parts.count);
        for place in (50..5_000).step_by(100) {
            for later in [5_000, 10_000, 15_000] {
                assert_eq!(parts.at(0, place), parts.at(0, place + later), "{place} and {later} later");
            }
        }
        let once = LogMotion { repeats_after: None, ..motion };
        let parts = Parts::of_motions(&[once], &[1000.0]);
        assert_eq!((parts.at(0, 0), parts.at(0, 12_000), parts.at(0, 23_299)), (0, 10, 19));
    }
}
