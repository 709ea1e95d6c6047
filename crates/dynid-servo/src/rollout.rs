//! Closed-loop simulation of a chain along a log's commands, with exact sensitivities.

mod sensed;

use std::ops::Range;

use crate::chain::{Chain, Equation};
use crate::deviation::{Body, DEVIATIONS};
use crate::free::{Free, ServoValues, Target};
use crate::gear::Layout;
use crate::joint::{LoadOf, Scheme};
use crate::log::{Command, ServoLog};
use crate::step::{Begin, Drive, Numbers, Solver, Wanted};
use crate::term::Term;
use sensed::Sensed;

/// Farthest that a simulated joint may go before the simulation counts as lost, rad or m.
const FAR: f64 = 1e3;

/// Slope of a position over any parameter, in SI units, beyond which a simulation counts as lost: a motion between flanks may be so much one of chance that
/// its slopes grow without end, and say nothing.
const STEEP: f64 = 1e8;

/// The simulated state of a chain at a row of the log.
#[derive(Debug, Clone, Copy)]
pub struct SimulatedRow<'a> {
    /// Row of the log.
    pub row: usize,
    /// Encoder readings of the chain's joints, not rounded.
    pub reading: &'a [f64],
    /// Velocities of the joints, where their encoders sit.
    pub velocity: &'a [f64],
    /// Efforts of the drives in the middle of the last step.
    pub effort: &'a [f64],
    /// Slopes of the readings over the free parameters of the chain, row-major: joints by [`Rollout::columns`].
    pub by_parameter: &'a [f64],
    /// Slopes of the efforts, alike.
    pub effort_by_parameter: &'a [f64],
    /// Slopes of the velocities, alike.
    pub velocity_by_parameter: &'a [f64],
}

/// The effort of one joint when a row's effort was measured, [`Term::EffortDelay`] before the row.
#[derive(Debug, Clone, Copy)]
pub struct SimulatedEffort<'a> {
    /// Row of the log.
    pub row: usize,
    /// Joint of the chain.
    pub joint: usize,
    /// Effort at [`Scheme::effort_at`], in the joint's direction: of the drive at that instant, of the bodies on the line between the middles of two steps.
    pub effort: f64,
    /// Slopes over the free parameters of the chain, by [`Rollout::columns`].
    pub by_parameter: &'a [f64],
}

/// What a simulation shows.
#[derive(Debug, Clone, Copy)]
pub enum Simulated<'a> {
    /// A row.
    Row(SimulatedRow<'a>),
    /// The effort of a joint at a row whose log measures it; not in step with the rows.
    Effort(SimulatedEffort<'a>),
}

/// A simulation that went out of bounds.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error(
    "the simulated motion leaves all bounds at row {row} of the log: gains, limits or delay make the loop unstable"
)]
pub struct Lost {
    /// Row of the log.
    pub row: usize,
}

/// A free parameter as a chain sees it.
#[derive(Debug, Clone)]
struct Column {
    /// Its place among all free parameters.
    place: usize,
    kind: Kind,
}

#[derive(Debug, Clone)]
enum Kind {
    /// A term of these joints of the chain.
    Term(Term, Vec<usize>),
    /// An entry of the chain's standard parameters.
    Inertia(usize),
    /// A number of the deviation of a body, whose entries begin there.
    Body(Body, usize, usize),
}

impl Column {
    /// Slopes of the parameters of the body whose deviation it is of.
    fn of_body(&self, values: &ServoValues) -> [f64; DEVIATIONS] {
        match &self.kind {
            Kind::Body(body, k, _) => body.slopes(&body.deviation(&values.body(body.body)))[*k],
            _ => [0.0; DEVIATIONS],
        }
    }

    /// Slope of an effort over the column, if it is one of inertias, from the effort's regressor.
    fn of_regressor(&self, of_body: &[f64; DEVIATIONS], regressor: &[f64]) -> Option<f64> {
        match &self.kind {
            Kind::Term(..) => None,
            Kind::Inertia(entry) => Some(regressor[*entry]),
            Kind::Body(_, _, first) => {
                Some(regressor[*first..].iter().zip(of_body).map(|(r, s)| r * s).sum())
            }
        }
    }
}

/// Simulates a chain along a log.
#[derive(Debug)]
pub struct Rollout<'a> {
    chain: &'a Chain,
    scheme: Scheme,
    columns: Vec<Column>,
    /// Places of the columns among all free parameters.
    places: Vec<usize>,
    of_inertias: bool,
    of_commands: bool,
}

impl<'a> Rollout<'a> {
    /// A simulation whose sensitivities are those of the free parameters that reach the chain; none: values alone.
    pub fn new(chain: &'a Chain, scheme: Scheme, free: &[Free]) -> Self {
        let mut columns = Vec::new();
        for (place, f) in free.iter().enumerate() {
            match &f.target {
                Target::Term { term, joints } => {
                    let local = |j: &usize| chain.joints.iter().position(|c| c == j);
                    let joints: Vec<usize> = joints.iter().filter_map(local).collect();
                    if !joints.is_empty() {
                        columns.push(Column { place, kind: Kind::Term(*term, joints) });
                    }
                }
                Target::Inertia(entry) => {
                    if let Some(local) = chain.inertias.iter().position(|e| e == entry) {
                        columns.push(Column { place, kind: Kind::Inertia(local) });
                    }
                }
                Target::Body(body, k) => {
                    let first = DEVIATIONS * body.body;
                    if let Some(local) = chain.inertias.iter().position(|e| *e == first) {
                        columns.push(Column { place, kind: Kind::Body(*body, *k, local) });
                    }
                }
            }
        }
        let of_inertias = columns.iter().any(|c| !matches!(c.kind, Kind::Term(..)));
        let commands = [Term::Delay, Term::RateLimit, Term::SmoothingTime];
        let of_commands = columns.iter().any(|c| matches!(&c.kind, Kind::Term(t, _) if commands.contains(t)));
        let places = columns.iter().map(|c| c.place).collect();
        Rollout { chain, scheme, columns, places, of_inertias, of_commands }
    }

    /// Places among all free parameters of those that reach the chain.
    pub fn columns(&self) -> &[usize] {
        &self.places
    }

    /// Place among [`Rollout::columns`] of a term of a joint of the chain.
    pub(crate) fn column_of(&self, term: Term, joint: usize) -> Option<usize> {
        let is = |c: &Column| matches!(&c.kind, Kind::Term(t, of) if *t == term && of.contains(&joint));
        self.columns.iter().position(is)
    }

    /// Simulates a log and shows every row; sensitivities are those that [`Rollout::new`] was asked for.
    ///
    /// # Errors
    /// [`Lost`]: numbers that are not finite or out of bounds.
    pub fn run(
        &self,
        values: &ServoValues,
        log: &ServoLog,
        mut see: impl FnMut(SimulatedRow<'_>),
    ) -> Result<Count, Lost> {
        self.run_with_efforts(values, log, |seen| {
            if let Simulated::Row(row) = seen {
                see(row);
            }
        })
    }

    /// As [`Rollout::run`], with the effort of every joint whose effort or current the log measures.
    ///
    /// # Errors
    /// As [`Rollout::run`].
    pub fn run_with_efforts(
        &self,
        values: &ServoValues,
        log: &ServoLog,
        mut see: impl FnMut(Simulated<'_>),
    ) -> Result<Count, Lost> {
        let mut count = Count::default();
        for segment in log.segments() {
            let mut run = Run::new(self, values, log);
            run.segment(segment, log, &mut see)?;
            count.steps += run.steps;
            count.unsettled += run.solver.unsettled;
        }
        Ok(count)
    }
}

/// Steps of a simulation.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Count {
    /// Steps.
    pub steps: usize,
    /// Steps whose friction did not settle within the rounds of the solver.
    pub unsettled: usize,
}

/// A command of one joint on its way through rate limit and smoothing.
struct Shaped {
    position: Command,
    velocity: Option<Command>,
    effort: Option<Command>,
    /// Rows at which the last look into each was made.
    at: [usize; 3],
    limited: f64,
    smoothed: f64,
}

struct Run<'a> {
    rollout: &'a Rollout<'a>,
    /// Number of joints.
    n: usize,
    p: usize,
    joints: Vec<Numbers>,
    layout: Layout,
    /// Numbers by coordinate.
    parts: Vec<Numbers>,
    commands: Vec<Shaped>,
    equation: Equation<'a>,
    solver: Solver,
    wanted: Vec<Wanted>,
    q: Vec<f64>,
    v: Vec<f64>,
    middle: Vec<f64>,
    /// Velocities in the middle of a step as they are foreseen.
    ahead: Vec<f64>,
    /// Accelerations of the step before.
    before: Vec<f64>,
    acceleration: Vec<f64>,
    reading: Vec<f64>,
    velocity: Vec<f64>,
    effort: Vec<f64>,
    sensed: Sensed,
    slopes: Slopes,
    /// Per column of a body's deviation: slopes of the ten parameters of that body.
    of_bodies: Vec<[f64; DEVIATIONS]>,
    steps: usize,
}

/// Slopes over the free parameters, row-major.
struct Slopes {
    /// By coordinate.
    q: Vec<f64>,
    v: Vec<f64>,
    wanted: Vec<f64>,
    drive: Vec<f64>,
    rhs: Vec<f64>,
    /// By joint.
    limited: Vec<f64>,
    smoothed: Vec<f64>,
    reading: Vec<f64>,
    velocity: Vec<f64>,
    effort: Vec<f64>,
    /// By coordinate, in the middle of the step.
    half: Vec<f64>,
    /// Of the velocities in the middle as they are foreseen, and of the accelerations of the step before.
    ahead: Vec<f64>,
    accelerated: Vec<f64>,
    /// Of one drive at the beginning of a step.
    before: Vec<f64>,
}

impl<'a> Run<'a> {
    fn new(rollout: &'a Rollout<'a>, values: &ServoValues, log: &ServoLog) -> Self {
        let chain = rollout.chain;
        let (n, p) = (chain.len(), rollout.columns.len());
        let hold = rollout.scheme.hold;
        let command = |of: &[Vec<f64>], j: usize| of.get(j).map(|c| Command::new(&log.time, c, hold));
        let shaped = |j: &usize| Shaped {
            position: {
                let taken: Vec<f64> = log.command[*j].iter().map(|u| values.joints[*j].taken(*u)).collect();
                Command::new(&log.time, &taken, hold)
            },
            velocity: command(&log.velocity_command, *j),
            effort: command(&log.feed_forward, *j),
            at: [0; 3],
            limited: 0.0,
            smoothed: 0.0,
        };
        let layout = Layout::new(&chain.joints, values);
        let joints: Vec<Numbers> = chain.joints.iter().map(|j| Numbers::of(&values.joints[*j])).collect();
        let m = layout.len();
        let (zeros, of_joints) = (|| vec![0.0; m * p], || vec![0.0; n * p]);
        Run {
            rollout,
            n,
            p,
            parts: Numbers::by_coordinate(&layout, &joints),
            joints,
            commands: chain.joints.iter().map(shaped).collect(),
            equation: Equation::new(chain, &values.inertias),
            solver: Solver::new(&layout, rollout.scheme),
            wanted: vec![Wanted::default(); m],
            q: vec![0.0; m],
            v: vec![0.0; m],
            middle: vec![0.0; m],
            ahead: vec![0.0; m],
            before: vec![0.0; m],
            acceleration: vec![0.0; m],
            reading: vec![0.0; n],
            velocity: vec![0.0; n],
            effort: vec![0.0; n],
            sensed: Sensed::new(rollout, values, log),
            slopes: Slopes {
                q: zeros(),
                v: zeros(),
                wanted: zeros(),
                drive: zeros(),
                rhs: zeros(),
                limited: of_joints(),
                smoothed: of_joints(),
                reading: of_joints(),
                velocity: of_joints(),
                effort: of_joints(),
                half: zeros(),
                ahead: zeros(),
                accelerated: zeros(),
                before: vec![0.0; p],
            },
            of_bodies: rollout.columns.iter().map(|c| c.of_body(values)).collect(),
            layout,
            steps: 0,
        }
    }

    fn segment(
        &mut self,
        rows: Range<usize>,
        log: &ServoLog,
        see: &mut impl FnMut(Simulated<'_>),
    ) -> Result<(), Lost> {
        self.begin(rows.start, log);
        self.show(rows.start, see);
        let senses = !self.sensed.is_idle();
        self.sensed.due.fill(rows.start);
        self.sensed.before = None;
        for row in rows.start + 1..rows.end {
            let (from, to) = (log.time[row - 1], log.time[row]);
            // A whole number of steps may come out a hair above itself.
            let steps = ((to - from) / self.rollout.scheme.step_s - 1e-6).ceil().max(1.0);
            let h = (to - from) / steps;
            for k in 0..steps as usize {
                let begin = from + k as f64 * h;
                self.step(begin, h);
                if senses {
                    self.sense((begin, h), rows.end, log, see);
                }
            }
            let steep = self.slopes.q.iter().any(|s| s.abs() > STEEP);
            if steep || !self.q.iter().chain(&self.v).all(|x| x.abs() < FAR) {
                return Err(Lost { row });
            }
            self.show(row, see);
        }
        if senses {
            // What was measured behind the last step.
            self.sense((f64::INFINITY, 0.0), rows.end, log, see);
        }
        Ok(())
    }

    /// At rest, or moving as the first readings do.
    fn begin(&mut self, row: usize, log: &ServoLog) {
        let given = log.start.as_ref().filter(|_| row == 0);
        let Run { rollout, p, joints, commands, layout, .. } = self;
        for (j, robot) in rollout.chain.joints.iter().enumerate() {
            let joint = &joints[j];
            let reading = given.map_or(log.position[*robot][row], |start| start[*robot]);
            let q = joint.direction * reading + joint.zero;
            let v = if given.is_some() { 0.0 } else { joint.direction * first_speed(log, *robot, row) };
            for c in [j, layout.motor[j]] {
                (self.q[c], self.v[c]) = (q, v);
            }
            let shaped = &mut commands[j];
            shaped.at = [row; 3];
            let first = joint.direction * shaped.position.mean(log.time[row], 1e-9, joint.delay, &mut 0).0;
            (shaped.limited, shaped.smoothed) = (first, first);
        }
        let slopes = &mut self.slopes;
        let Slopes { q, v, limited, smoothed, effort, accelerated, .. } = slopes;
        for all in [q, v, limited, smoothed, effort, accelerated] {
            all.fill(0.0);
        }
        for (c, column) in rollout.columns.iter().enumerate() {
            if let Kind::Term(Term::Zero, of) = &column.kind {
                of.iter().flat_map(|j| [*j, layout.motor[*j]]).for_each(|i| slopes.q[i * *p + c] = 1.0);
            }
        }
        self.effort.fill(0.0);
        self.before.fill(0.0);
        self.wind_gears();
    }

    /// Gears carry the bodies' effort at rest: the side of them that no encoder reads is moved. By the position alone, its slopes to first order in
    /// the compliance.
    fn wind_gears(&mut self) {
        let Run { rollout, n, p, layout, equation, slopes, .. } = self;
        if layout.gears.is_empty() {
            return;
        }
        let still = vec![0.0; *n];
        equation.values(&self.q[..*n], &still);
        if *p > 0 && rollout.of_inertias {
            equation.regressors(&self.q[..*n], &still, &still);
        }
        for gear in &layout.gears {
            let j = layout.joint[gear.motor];
            let carried = equation.bias[j];
            let lead = carried / gear.stiffness + carried.signum() * gear.play;
            // The other side of the encoder.
            let (at, sign) =
                if layout.sensor[j] == gear.motor { (gear.link, -1.0) } else { (gear.motor, 1.0) };
            self.q[at] += sign * lead;
            for (c, column) in rollout.columns.iter().enumerate() {
                let own = &equation.bias_regressor[j * equation.columns()..][..equation.columns()];
                slopes.q[at * *p + c] += sign
                    * match &column.kind {
                        Kind::Term(Term::Compliance, of) if of.contains(&j) => carried,
                        Kind::Term(Term::Backlash, of) if of.contains(&j) => 0.5 * carried.signum(),
                        Kind::Term(..) => 0.0,
                        _ => column.of_regressor(&self.of_bodies[c], own).unwrap_or(0.0) / gear.stiffness,
                    };
            }
        }
    }

    fn show(&mut self, row: usize, see: &mut impl FnMut(Simulated<'_>)) {
        let Run { rollout, p, joints, slopes, layout, .. } = self;
        for (j, joint) in joints.iter().enumerate() {
            let at = layout.sensor[j];
            self.reading[j] = joint.direction * (self.q[at] - joint.zero);
            self.velocity[j] = self.v[at];
            let (from, own) = (at * *p..(at + 1) * *p, j * *p..(j + 1) * *p);
            let to = &mut slopes.reading[own.clone()];
            to.iter_mut().zip(&slopes.q[from.clone()]).for_each(|(t, f)| *t = joint.direction * f);
            slopes.velocity[own].copy_from_slice(&slopes.v[from]);
        }
        for (c, column) in rollout.columns.iter().enumerate() {
            if let Kind::Term(Term::Zero, of) = &column.kind {
                of.iter().for_each(|j| slopes.reading[j * *p + c] -= joints[*j].direction);
            }
        }
        see(Simulated::Row(SimulatedRow {
            row,
            reading: &self.reading,
            velocity: &self.velocity,
            effort: &self.effort,
            by_parameter: &slopes.reading,
            effort_by_parameter: &slopes.effort,
            velocity_by_parameter: &slopes.velocity,
        }));
    }

    /// What the drives are told over a step.
    fn command(&mut self, t: f64, h: f64) {
        let Run { rollout, p, joints, commands, slopes, wanted, layout, .. } = self;
        for (j, (joint, shaped)) in joints.iter().zip(commands).enumerate() {
            let ask = |command: &Option<Command>, at: &mut usize| {
                command.as_ref().map_or(0.0, |c| joint.direction * c.mean(t, h, joint.delay, at).0)
            };
            let [_, at_velocity, at_effort] = &mut shaped.at;
            let velocity = ask(&shaped.velocity, at_velocity);
            let effort = ask(&shaped.effort, at_effort);
            let (mean, by_delay) = shaped.position.mean(t, h, joint.delay, &mut shaped.at[0]);
            let (mean, by_delay) = (joint.direction * mean, joint.direction * by_delay);
            let ahead = mean - shaped.limited;
            let most = joint.rate * h;
            let held = if ahead > most {
                1.0
            } else if ahead < -most {
                -1.0
            } else {
                0.0
            };
            let limited = if held == 0.0 { mean } else { shaped.limited + held * most };
            let share = if joint.smoothing > 0.0 { -(-h / joint.smoothing).exp_m1() } else { 1.0 };
            let smoothed = shaped.smoothed + share * (limited - shaped.smoothed);
            let position = if joint.smoothing > 0.0 { 0.5 * (shaped.smoothed + smoothed) } else { limited };
            if rollout.of_commands {
                let range = j * *p..(j + 1) * *p;
                let row = &mut slopes.limited[range.clone()];
                if held == 0.0 {
                    row.fill(0.0);
                }
                for (c, column) in rollout.columns.iter().enumerate() {
                    match &column.kind {
                        Kind::Term(Term::Delay, of) if held == 0.0 && of.contains(&j) => row[c] = by_delay,
                        Kind::Term(Term::RateLimit, of) if of.contains(&j) => row[c] += held * h,
                        _ => {}
                    }
                }
                let wanted = &mut slopes.wanted[layout.motor[j] * *p..][..*p];
                if joint.smoothing > 0.0 {
                    let faster = -(1.0 - share) * h / (joint.smoothing * joint.smoothing);
                    let smooth = &mut slopes.smoothed[range];
                    for (c, column) in rollout.columns.iter().enumerate() {
                        let mut next = smooth[c] + share * (row[c] - smooth[c]);
                        if matches!(&column.kind, Kind::Term(Term::SmoothingTime, of) if of.contains(&j)) {
                            next += faster * (limited - shaped.smoothed);
                        }
                        wanted[c] = 0.5 * (smooth[c] + next);
                        smooth[c] = next;
                    }
                } else {
                    wanted.copy_from_slice(row);
                }
            }
            (shaped.limited, shaped.smoothed) = (limited, smoothed);
            wanted[layout.motor[j]] = Wanted { position, velocity, effort };
        }
    }

    fn step(&mut self, t: f64, h: f64) {
        self.steps += 1;
        self.command(t, h);
        let (n, m) = (self.n, self.layout.len());
        for j in 0..m {
            self.middle[j] = self.q[j] + 0.5 * h * self.v[j];
            let gained = if self.rollout.scheme.middle { 0.5 * h * self.before[j] } else { 0.0 };
            self.ahead[j] = self.v[j] + gained;
        }
        self.equation.values(&self.middle[..n], &self.ahead[..n]);
        let begin = Begin {
            joints: &self.parts,
            layout: &self.layout,
            ahead: (&self.middle, &self.ahead),
            wanted: &self.wanted,
            mass: &self.equation.mass,
            bias: &self.equation.bias,
            q: &self.q,
            v: &self.v,
            h,
        };
        self.solver.step(&begin);
        for (effort, motor) in self.effort.iter_mut().zip(&self.layout.motor) {
            *effort = self.solver.drive[*motor].effort;
        }
        if self.p > 0 {
            self.sensitivities(h);
        }
        for j in 0..m {
            let next = self.solver.next[j];
            self.before[j] = (next - self.v[j]) / h;
            self.q[j] += 0.5 * h * (self.v[j] + next);
            self.v[j] = next;
        }
    }

    /// Differentiates the step that was just solved: the residual's slope at fixed `v⁺`, then the tangent.
    fn sensitivities(&mut self, h: f64) {
        let (n, m, p) = (self.n, self.layout.len(), self.p);
        for j in 0..m {
            self.acceleration[j] = (self.solver.next[j] - self.v[j]) / h;
        }
        let (middle, rates, accelerations) = (&self.middle[..n], &self.ahead[..n], &self.acceleration[..n]);
        let loaded = self.joints.iter().any(|j| j.load > 0.0) || self.has(Term::LoadFriction);
        let by_bodies = loaded && self.rollout.scheme.load == LoadOf::Bodies;
        self.equation.slopes(middle, rates, accelerations, by_bodies);
        if self.rollout.of_inertias {
            self.equation.regressors(middle, rates, accelerations);
        }
        let (equation, solver, layout) = (&self.equation, &self.solver, &self.layout);
        let in_middle = self.rollout.scheme.middle;
        let Slopes { q, v, wanted, drive, rhs, half, ahead, accelerated, effort, before: row_before, .. } =
            &mut self.slopes;
        for (half, (q, v)) in half.iter_mut().zip(q.iter().zip(v.iter())) {
            *half = q + 0.5 * h * v;
        }
        for (ahead, (v, a)) in ahead.iter_mut().zip(v.iter().zip(accelerated.iter())) {
            *ahead = if in_middle { v + 0.5 * h * a } else { *v };
        }
        let mean_of = |c: usize| 0.5 * (self.v[c] + solver.next[c]);
        for j in 0..m {
            let joint = &self.parts[j];
            let own = j * p..(j + 1) * p;
            let at = solver.drive[j];
            let mean = mean_of(j);
            let begin = self.v[j];
            let (link, driven, reads) = (layout.joint[j], layout.driven[j], layout.reads[j]);
            // Bodies are those of links.
            let bodies = if j < n { n } else { 0 };
            let sign = solver.by_level(joint, j, begin);
            let row = &mut drive[own.clone()];
            let quarter = 0.25 * h * at.by_error + 0.5 * at.by_damping * joint.kd;
            for (to, (i, read)) in row.iter_mut().zip(own.clone().zip(reads * p..)) {
                *to = at.by_error * (wanted[i] - q[read]) - quarter * v[read];
            }
            if driven {
                self.rollout.by_drive(link, &at, self.wanted[j].velocity - mean_of(reads), row);
            }
            let to = &mut rhs[own.clone()];
            let by_begin = 0.5 * joint.viscous + solver.kink(joint, j, begin).2;
            for c in 0..p {
                to[c] = by_begin * v[own.start + c] - row[c];
            }
            let over = joint.rotor / h;
            for (to, v) in to.iter_mut().zip(&v[own.clone()]) {
                *to -= over * v;
            }
            for k in 0..bodies {
                let inertia = equation.mass[j * n + k];
                let by_position = equation.by_position[j * n + k];
                let (by_rate, over) = (equation.by_rate[j * n + k], inertia / h);
                let (half, ahead, v) = (&half[k * p..][..p], &ahead[k * p..][..p], &v[k * p..][..p]);
                for c in 0..p {
                    to[c] += by_position * half[c] + by_rate * ahead[c] - over * v[c];
                }
            }
            let carried = solver.carried[j];
            let level = sign * joint.load * carried.signum();
            if level != 0.0 {
                match self.rollout.scheme.load {
                    LoadOf::Bodies => {
                        for k in 0..n {
                            let by_position = level * equation.bias_by_position[link * n + k];
                            let by_rate = level * equation.by_rate[link * n + k];
                            let (half, ahead) = (&half[k * p..][..p], &ahead[k * p..][..p]);
                            for c in 0..p {
                                to[c] += by_position * half[c] + by_rate * ahead[c];
                            }
                        }
                    }
                    LoadOf::Drive => {
                        let before = solver.before[j];
                        let row = &mut *row_before;
                        let (at, rate) = if in_middle { (&*half, &*ahead) } else { (&*q, &*v) };
                        for (to, (i, read)) in row.iter_mut().zip(own.clone().zip(reads * p..)) {
                            *to = before.by_error * (wanted[i] - at[read])
                                - before.by_damping * joint.kd * rate[read];
                        }
                        let lag = self.wanted[j].velocity - self.ahead[reads];
                        self.rollout.by_drive(link, &before, lag, row);
                        for c in 0..p {
                            to[c] += level * row[c];
                        }
                    }
                }
            }
            let speed = solver.speed(j, begin);
            let x = speed / joint.stribeck;
            let decay = (-x * x).exp();
            for (c, column) in self.rollout.columns.iter().enumerate() {
                match &column.kind {
                    Kind::Term(term, of) if driven && of.contains(&link) => {
                        to[c] += match term {
                            Term::RotorInertia => self.acceleration[j],
                            Term::Viscous => mean,
                            Term::Offset => 1.0,
                            Term::Coulomb => sign,
                            Term::Stiction => sign * decay,
                            Term::StribeckVelocity => {
                                sign * joint.stiction * decay * 2.0 * x * x / joint.stribeck
                            }
                            Term::LoadFriction => sign * carried.abs(),
                            _ => 0.0,
                        }
                    }
                    Kind::Term(..) => {}
                    Kind::Inertia(_) | Kind::Body(..) => {
                        let own = link * equation.columns()..(link + 1) * equation.columns();
                        let slope = |regressor: &[f64]| {
                            column.of_regressor(&self.of_bodies[c], &regressor[own.clone()]).unwrap_or(0.0)
                        };
                        if bodies > 0 {
                            to[c] += slope(&equation.regressor);
                        }
                        if self.rollout.scheme.load == LoadOf::Bodies {
                            to[c] += level * slope(&equation.bias_regressor);
                        }
                    }
                }
            }
        }
        for (gear, at) in layout.gears.iter().zip(&solver.gears) {
            let joint = layout.joint[gear.motor];
            let quarter = 0.25 * h * at.by_lead + 0.5 * at.by_rate;
            let rate = mean_of(gear.motor) - mean_of(gear.link);
            for (c, column) in self.rollout.columns.iter().enumerate() {
                let (motor, link) = (gear.motor * p + c, gear.link * p + c);
                let mut by = at.by_lead * (q[motor] - q[link]) + quarter * (v[motor] - v[link]);
                if let Kind::Term(term, of) = &column.kind
                    && of.contains(&joint)
                {
                    by += match term {
                        Term::Compliance => -at.twist * at.by_lead * gear.stiffness,
                        Term::GearDamping => at.side * at.side * rate,
                        Term::Backlash => -0.5 * at.side * at.by_lead,
                        _ => 0.0,
                    };
                }
                rhs[motor] += by;
                rhs[link] -= by;
            }
        }
        for (j, side) in solver.side.iter().enumerate() {
            if *side == 0.0 {
                rhs[j * p..(j + 1) * p].fill(0.0);
            }
        }
        solver.tangent.solve(rhs, p);
        for i in 0..m * p {
            let next = -rhs[i];
            accelerated[i] = (next - v[i]) / h;
            q[i] += 0.5 * h * (v[i] + next);
            v[i] = next;
        }
        for (j, motor) in layout.motor.iter().enumerate() {
            let at = solver.drive[*motor];
            let quarter = 0.25 * h * at.by_error + 0.5 * at.by_damping * self.joints[j].kd;
            let (drive, next) = (&drive[motor * p..][..p], &v[layout.sensor[j] * p..][..p]);
            let to = &mut effort[j * p..][..p];
            to.iter_mut().zip(drive.iter().zip(next)).for_each(|(t, (d, n))| *t = d - quarter * n);
        }
    }

    fn has(&self, wanted: Term) -> bool {
        self.rollout.columns.iter().any(|c| matches!(&c.kind, Kind::Term(term, _) if *term == wanted))
    }
}

impl Rollout<'_> {
    /// Adds what a drive's own parameters change of its effort at a fixed state; `lag`: commanded less actual velocity.
    fn by_drive(&self, j: usize, at: &Drive, lag: f64, row: &mut [f64]) {
        for (column, to) in self.columns.iter().zip(row) {
            let Kind::Term(term, of) = &column.kind else { continue };
            if !of.contains(&j) {
                continue;
            }
            *to += match term {
                Term::PositionGain => at.free * at.banded,
                Term::VelocityGain => at.by_damping * lag,
                Term::Zero => at.by_error,
                Term::DeadBand => -at.by_error * at.side,
                Term::EffortLimit => at.capped,
                _ => 0.0,
            };
        }
    }
}

/// Speed at the beginning of a segment; 0 where readings about it stay within two steps of the encoder.
///
/// Within a record the slope of a line through readings on both sides; at its beginning that of a parabola through the first ones.
fn first_speed(log: &ServoLog, joint: usize, row: usize) -> f64 {
    const AROUND: usize = 3;
    let rows = if row >= AROUND && row + AROUND < log.rows() {
        row - AROUND..row + AROUND + 1
    } else {
        row..(row + 2 * AROUND + 1).min(log.rows())
    };
    let (time, reading) = (&log.time[rows.clone()], &log.position[joint][rows.clone()]);
    let span = reading.iter().fold(0.0_f64, |m, x| m.max((x - reading[0]).abs()));
    let resolution = log.resolution.get(joint).copied().unwrap_or(0.0);
    if span <= 2.0 * resolution || rows.len() < 4 {
        return 0.0;
    }
    let n = time.len() as f64;
    let mean = time.iter().sum::<f64>() / n;
    let moment = |p: i32, q: &dyn Fn(usize) -> f64| -> f64 {
        (0..time.len()).map(|k| (time[k] - mean).powi(p) * q(k)).sum()
    };
    let one = |_: usize| 1.0;
    let (s2, s3, s4) = (moment(2, &one), moment(3, &one), moment(4, &one));
    let of_reading = |k: usize| reading[k] - reading[0];
    let (b0, b1, b2) = (moment(0, &of_reading), moment(1, &of_reading), moment(2, &of_reading));
    if rows.start < row {
        return b1 / s2;
    }
    // Normal equations of a parabola about the mean time, whose first moment is zero.
    let c2 = b2 - s2 * b0 / n;
    let (a11, a12, a22) = (s2, s3, s4 - s2 * s2 / n);
    let determinant = a11 * a22 - a12 * a12;
    if determinant <= 0.0 {
        return b1 / s2;
    }
    let slope = (b1 * a22 - c2 * a12) / determinant;
    let bend = (a11 * c2 - a12 * b1) / determinant;
    slope + 2.0 * bend * (time[0] - mean)
}
