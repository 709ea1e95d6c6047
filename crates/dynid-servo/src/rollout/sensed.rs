//! Efforts of a simulation at the instants at which a log measures them.

use super::{Rollout, Run, Simulated, SimulatedEffort};
use crate::channel::{Channel, EffortAt};
use crate::free::ServoValues;
use crate::log::{Command, ServoLog};
use crate::step::Wanted;
use crate::term::Term;

/// Efforts on their way to the rows that measured them.
pub(super) struct Sensed {
    /// Time by which a joint's measured effort lies behind its row; `None`: not measured.
    delay: Vec<Option<f64>>,
    /// Next row of every joint.
    pub(super) due: Vec<usize>,
    /// Place of the delay among the columns.
    column: Vec<Option<usize>>,
    /// Rows at which the last look into each command was made.
    at: Vec<[usize; 3]>,
    /// Efforts of the bodies in the middle of the last step and of the one before, with their slopes, and the middle of that one.
    last: (Vec<f64>, Vec<f64>),
    earlier: (Vec<f64>, Vec<f64>),
    pub(super) before: Option<f64>,
    /// Slopes of one effort.
    row: Vec<f64>,
}

impl Sensed {
    pub(super) fn new(rollout: &Rollout<'_>, values: &ServoValues, log: &ServoLog) -> Self {
        let (n, p) = (rollout.chain.len(), rollout.columns.len());
        let zeros = || (vec![0.0; n], vec![0.0; n * p]);
        let delay = |j: &usize| {
            let any = [Channel::Effort, Channel::Current].into_iter().any(|c| log.measured(c, *j).is_some());
            any.then(|| values.joints[*j].get(Term::EffortDelay))
        };
        Sensed {
            delay: rollout.chain.joints.iter().map(delay).collect(),
            due: vec![0; n],
            column: (0..n).map(|j| rollout.column_of(Term::EffortDelay, j)).collect(),
            at: vec![[0; 3]; n],
            last: zeros(),
            earlier: zeros(),
            before: None,
            row: vec![0.0; p],
        }
    }

    pub(super) fn is_idle(&self) -> bool {
        self.delay.iter().all(Option::is_none)
    }

    /// The next row of a joint whose effort was measured before `until`, with the instant of that.
    fn next(&mut self, j: usize, until: f64, end: usize, log: &ServoLog) -> Option<(usize, f64)> {
        let delay = self.delay[j]?;
        let row = self.due[j];
        let at = log.time.get(row).filter(|_| row < end)? - delay;
        if at > until {
            return None;
        }
        self.due[j] += 1;
        Some((row, at))
    }

    /// Shows efforts of the bodies that were measured before the middle `now` of the last step: on the line from the middle before. Ahead of the
    /// first middle, and behind the last one, they are taken for constant.
    fn show_bodies(&mut self, now: f64, end: usize, log: &ServoLog, see: &mut impl FnMut(Simulated<'_>)) {
        let p = self.row.len();
        for joint in 0..self.delay.len() {
            while let Some((row, at)) = self.next(joint, now, end, log) {
                let inside = self.before.filter(|before| at > *before && now.is_finite());
                let share = inside.map_or(1.0, |before| (at - before) / (now - before));
                let (effort, before) = (self.last.0[joint], self.earlier.0[joint]);
                let own = joint * p..(joint + 1) * p;
                let slopes = self.last.1[own.clone()].iter().zip(&self.earlier.1[own]);
                for (to, (now, before)) in self.row.iter_mut().zip(slopes) {
                    *to = now + (1.0 - share) * (before - now);
                }
                if let (Some(column), Some(from)) = (self.column[joint], inside) {
                    self.row[column] -= (effort - before) / (now - from);
                }
                let effort = effort + (1.0 - share) * (before - effort);
                see(Simulated::Effort(SimulatedEffort { row, joint, effort, by_parameter: &self.row }));
            }
        }
        self.before = Some(now);
    }
}

impl Run<'_> {
    /// Shows the efforts that were measured up to the end of the step that was just made, `(begin, h)`; an infinite beginning: all that are left.
    pub(super) fn sense(
        &mut self,
        (begin, h): (f64, f64),
        end: usize,
        log: &ServoLog,
        see: &mut impl FnMut(Simulated<'_>),
    ) {
        if self.rollout.scheme.effort_at == EffortAt::Link {
            if begin.is_finite() {
                self.take_bodies();
            }
            self.sensed.show_bodies(begin + 0.5 * h, end, log, see);
            return;
        }
        for joint in 0..self.n {
            while let Some((row, at)) = self.sensed.next(joint, begin + h, end, log) {
                // Ahead of the first step and behind the last one the joint stands where that begins and ends.
                let past = if begin.is_finite() { (at - begin).clamp(0.0, h) } else { h };
                let effort = self.drive_at(joint, (at, past, h));
                see(Simulated::Effort(SimulatedEffort {
                    row,
                    joint,
                    effort,
                    by_parameter: &self.sensed.row,
                }));
            }
        }
    }

    /// Effort of a drive at an instant `past` the beginning of the last step; its slopes are left in `sensed.row`.
    fn drive_at(&mut self, j: usize, (at, past, h): (f64, f64, f64)) -> f64 {
        let Run { rollout, p, joints, commands, slopes, wanted, sensed, before, layout, .. } = self;
        let (motor, at_sensor) = (layout.motor[j], layout.sensor[j]);
        let (joint, shaped, span) = (&joints[j], &commands[j], rollout.scheme.effort_span_s);
        let mut told = wanted[motor];
        // A command that is shaped on its way has no jumps, and its mean over the step will do.
        let is_shaped = joint.rate.is_finite() || joint.smoothing > 0.0;
        let mut by_delay = 0.0;
        if !is_shaped {
            let [at_position, at_velocity, at_effort] = &mut sensed.at[j];
            let from = at - 0.5 * span;
            let ask = |command: &Option<Command>, pointer: &mut usize| {
                command.as_ref().map_or(0.0, |c| joint.direction * c.mean(from, span, joint.delay, pointer).0)
            };
            let (mean, by) = shaped.position.mean(from, span, joint.delay, at_position);
            by_delay = joint.direction * by;
            told = Wanted {
                position: joint.direction * mean,
                velocity: ask(&shaped.velocity, at_velocity),
                effort: ask(&shaped.effort, at_effort),
            };
        }
        // State and slopes are those of the end of the step; back from there with its acceleration.
        let (back, a) = (h - past, before[at_sensor]);
        let v = self.v[at_sensor] - back * a;
        let q = self.q[at_sensor] - back * (v + 0.5 * back * a);
        let drive = joint.drive(told, q, v);
        let damping = drive.by_damping * joint.kd;
        let own = at_sensor * *p..(at_sensor + 1) * *p;
        let rows = (&slopes.q[own.clone()], &slopes.v[own.clone()], &slopes.accelerated[own.clone()]);
        for (c, to) in sensed.row.iter_mut().enumerate() {
            let (by_q, by_v, by_a) = (rows.0[c], rows.1[c], rows.2[c]);
            let by_v = by_v - back * by_a;
            let by_q = by_q - back * (by_v + 0.5 * back * by_a);
            let by_told = if is_shaped { slopes.wanted[motor * *p + c] } else { 0.0 };
            *to = drive.by_error * (by_told - by_q) - damping * by_v;
        }
        rollout.by_drive(j, &drive, told.velocity - v, &mut sensed.row);
        if !is_shaped && let Some(column) = rollout.column_of(Term::Delay, j) {
            sensed.row[column] += drive.by_error * by_delay;
        }
        if let Some(column) = sensed.column[j] {
            sensed.row[column] += drive.by_error * (by_delay + v) + damping * a;
        }
        drive.effort
    }

    /// Keeps what the bodies took in the step that was just made: from the equation of motion, which has no rotor and no friction in it.
    fn take_bodies(&mut self) {
        let (n, p) = (self.n, self.p);
        let sensed = &mut self.sensed;
        std::mem::swap(&mut sensed.last, &mut sensed.earlier);
        let (effort, slopes) = &mut sensed.last;
        let equation = &self.equation;
        for j in 0..n {
            let row = &equation.mass[j * n..][..n];
            let inertial: f64 = row.iter().zip(&self.before).map(|(m, a)| m * a).sum();
            effort[j] = inertial + equation.bias[j];
            let to = &mut slopes[j * p..][..p];
            to.fill(0.0);
            for k in 0..n {
                let i = j * n + k;
                let (mass, by_position, by_rate) =
                    (equation.mass[i], equation.by_position[i], equation.by_rate[i]);
                for (c, to) in to.iter_mut().enumerate() {
                    let at = k * p + c;
                    *to += by_position * self.slopes.half[at]
                        + by_rate * self.slopes.ahead[at]
                        + mass * self.slopes.accelerated[at];
                }
            }
            for (c, column) in self.rollout.columns.iter().enumerate() {
                let own = &equation.regressor[j * equation.columns()..][..equation.columns()];
                to[c] += column.of_regressor(&self.of_bodies[c], own).unwrap_or(0.0);
            }
        }
    }
}
