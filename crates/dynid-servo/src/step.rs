//! One implicit step of a chain with drives and friction.
//!
//! Unknown is the velocity `v⁺` at the end of a step `h` from `(q, v)`:
//!
//! ```text
//! (M(m) + I_a)(v⁺ - v)/h + b(m, w) - τ(u, q_a, v_a) + F_v v_a + o + L s(v, v⁺) ∋ 0
//! m = q + h v/2,   v_a = (v + v⁺)/2,   q_a = q + h v_a/2,   q⁺ = q + h v_a
//! w = v + (v - v⁻) h/(2 h⁻),   L at (|v| + |v⁺|)/2
//! ```
//!
//! `v⁻` is the velocity a step `h⁻` before. All is taken in the middle, so that the error is of second order. The sign `s` is that of both velocities.
//! Where they differ, friction has the old sign for a share `α` of the step, in which the joint comes to rest, and the other one after that:
//! `s = (2α - 1) sign(v)`, with accelerations that are `k/h = 2L/μ` apart, `μ` the inertia that the joint alone would move,
//!
//! ```text
//! k α² - (|v| + k + |v⁺|) α + |v| = 0
//! ```
//!
//! With a sign width of 0 a joint that comes to rest in a step stays there, exactly, if friction can hold what is left without its own inertia; a
//! joint at rest has the set `[-1, 1]` for `s`.
//!
//! Without [`Scheme::middle`]: `w = v`, `L` and `s` at `v⁺`.
//!
//! Where gears give way, `q` holds the links and then the motors behind such gears: links have no drive and no friction of their own, motors no
//! bodies, and the effort of the gear, taken at `q_a` and `v_a`, stands with one sign at the motor and with the other at the link.

use crate::gear::{Carried, Layout};
use crate::joint::{Limited, LoadOf, Scheme, ServoJoint};
use crate::term::Term;

/// Rounds of the solver; beyond, the best found so far is taken and counted.
const ROUNDS: usize = 60;

/// Rounds after which only one joint a round changes between sticking and slipping. Changing all at once is faster and may
/// go in circles; the least index first does not (Bard 1974).
const FREE_ROUNDS: usize = 8;

/// Least change of a velocity, rad/s, that asks for another round.
const CHANGE: f64 = 1e-11;

/// Least inertia of a motor behind a gear that gives way, kg m² or kg: without any it would have no acceleration between the flanks.
const LEAST_ROTOR: f64 = 1e-9;

/// Numbers of one joint, unpacked.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Numbers {
    pub(crate) kp: f64,
    pub(crate) kd: f64,
    pub(crate) rotor: f64,
    pub(crate) viscous: f64,
    pub(crate) coulomb: f64,
    pub(crate) stiction: f64,
    pub(crate) stribeck: f64,
    pub(crate) load: f64,
    pub(crate) offset: f64,
    pub(crate) zero: f64,
    pub(crate) delay: f64,
    pub(crate) limit: f64,
    pub(crate) dead: f64,
    pub(crate) rate: f64,
    pub(crate) smoothing: f64,
    pub(crate) direction: f64,
    pub(crate) limited: Limited,
}

impl Numbers {
    pub(crate) fn of(joint: &ServoJoint) -> Self {
        Numbers {
            kp: joint.get(Term::PositionGain),
            kd: joint.get(Term::VelocityGain),
            rotor: joint.get(Term::RotorInertia),
            viscous: joint.get(Term::Viscous),
            coulomb: joint.get(Term::Coulomb),
            stiction: joint.get(Term::Stiction),
            stribeck: joint.get(Term::StribeckVelocity),
            load: joint.get(Term::LoadFriction),
            offset: joint.get(Term::Offset),
            zero: joint.get(Term::Zero),
            delay: joint.get(Term::Delay),
            limit: joint.get(Term::EffortLimit),
            dead: joint.get(Term::DeadBand),
            rate: joint.get(Term::RateLimit),
            smoothing: joint.get(Term::SmoothingTime),
            direction: joint.direction,
            limited: joint.limited,
        }
    }

    /// By coordinate those of what moves it: of a drive, or of none.
    pub(crate) fn by_coordinate(layout: &Layout, joints: &[Numbers]) -> Vec<Numbers> {
        let of = |c: usize| match layout.driven[c] {
            true if c >= layout.links => {
                let own = joints[layout.joint[c]];
                Numbers { rotor: own.rotor.max(LEAST_ROTOR), ..own }
            }
            true => joints[layout.joint[c]],
            false => Numbers::of(&ServoJoint::default()),
        };
        (0..layout.len()).map(of).collect()
    }

    /// Friction without load at a speed, and its slope over the speed.
    pub(crate) fn dry(&self, speed: f64) -> (f64, f64) {
        if self.stiction == 0.0 {
            return (self.coulomb, 0.0);
        }
        let x = speed / self.stribeck;
        let decay = (-x * x).exp();
        (self.coulomb + self.stiction * decay, -2.0 * x / self.stribeck * self.stiction * decay)
    }

    /// The drive's effort at a state.
    pub(crate) fn drive(&self, wanted: Wanted, q: f64, v: f64) -> Drive {
        let error = wanted.position + self.zero - q;
        let side = if error > self.dead {
            1.0
        } else if error < -self.dead {
            -1.0
        } else {
            0.0
        };
        let banded = if side == 0.0 { 0.0 } else { error - side * self.dead };
        let follow = self.kp * banded + wanted.effort;
        let damp = self.kd * (wanted.velocity - v);
        let acted = if self.limited == Limited::Whole { follow + damp } else { follow };
        let capped = if acted > self.limit {
            1.0
        } else if acted < -self.limit {
            -1.0
        } else {
            0.0
        };
        let free = if capped == 0.0 { 1.0 } else { 0.0 };
        let (effort, by_damping) = match self.limited {
            Limited::Whole => (if capped == 0.0 { acted } else { capped * self.limit }, free),
            Limited::Proportional => ((if capped == 0.0 { acted } else { capped * self.limit }) + damp, 1.0),
        };
        Drive { effort, banded, side, capped, by_error: free * self.kp * side.abs(), free, by_damping }
    }
}

/// What a drive is told, in the joint's own direction: position without the encoder's zero, velocity, effort.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Wanted {
    pub(crate) position: f64,
    pub(crate) velocity: f64,
    pub(crate) effort: f64,
}

/// Effort of a drive and its slopes.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Drive {
    pub(crate) effort: f64,
    /// Control error behind the dead band.
    pub(crate) banded: f64,
    /// Side of the dead band: -1, 0 (inside), 1.
    pub(crate) side: f64,
    /// Side of the limit: -1, 0 (below it), 1.
    pub(crate) capped: f64,
    /// Slope over the control error.
    pub(crate) by_error: f64,
    /// 1 where the control error acts, 0 at the limit.
    pub(crate) free: f64,
    /// 1 where the damping acts.
    pub(crate) by_damping: f64,
}

/// Memory and results of steps.
#[derive(Debug)]
pub(crate) struct Solver {
    n: usize,
    scheme: Scheme,
    /// Whether a joint slips, and which way; 0: it sticks. With a width of the sign: 1.
    pub(crate) side: Vec<f64>,
    /// Velocities at the end.
    pub(crate) next: Vec<f64>,
    /// Drives at the solution.
    pub(crate) drive: Vec<Drive>,
    /// What load friction grows with.
    pub(crate) carried: Vec<f64>,
    /// Drives as they are foreseen in the middle of the step, or at its beginning, for [`LoadOf::Drive`].
    pub(crate) before: Vec<Drive>,
    /// Steps that did not settle.
    pub(crate) unsettled: usize,
    /// What gears carry at the solution.
    pub(crate) gears: Vec<Carried>,
    residual: Vec<f64>,
    slope: Vec<f64>,
    /// Slopes of drives by the velocity of another coordinate, that they read.
    beside: Vec<f64>,
    change: Vec<f64>,
    /// Velocities that friction of one sign and of the other are apart by at the end of a step, per friction: of joints that turn.
    turning: Vec<f64>,
    pub(crate) tangent: Tangent,
}

/// Share of a step before a joint turns round, and its slopes.
struct Turn {
    share: f64,
    by_begin: f64,
    by_end: f64,
    by_level: f64,
}

/// What a step begins from.
pub(crate) struct Begin<'a> {
    /// By coordinate.
    pub(crate) joints: &'a [Numbers],
    pub(crate) layout: &'a Layout,
    /// Positions and velocities in the middle of the step, as they are foreseen.
    pub(crate) ahead: (&'a [f64], &'a [f64]),
    pub(crate) wanted: &'a [Wanted],
    pub(crate) mass: &'a [f64],
    pub(crate) bias: &'a [f64],
    pub(crate) q: &'a [f64],
    pub(crate) v: &'a [f64],
    pub(crate) h: f64,
}

impl Begin<'_> {
    /// Entry of the inertia of bodies and rotors.
    fn inertia(&self, row: usize, column: usize) -> f64 {
        let links = self.layout.links;
        let bodies = if row.max(column) < links { self.mass[row * links + column] } else { 0.0 };
        if row == column { bodies + self.joints[row].rotor } else { bodies }
    }
}

impl Solver {
    pub(crate) fn new(layout: &Layout, scheme: Scheme) -> Self {
        let n = layout.len();
        Solver {
            n,
            scheme,
            side: vec![0.0; n],
            next: vec![0.0; n],
            drive: vec![Drive::default(); n],
            carried: vec![0.0; n],
            before: vec![Drive::default(); n],
            unsettled: 0,
            gears: Vec::new(),
            residual: vec![0.0; n],
            slope: vec![0.0; n],
            beside: vec![0.0; n],
            change: vec![0.0; n],
            turning: vec![0.0; n],
            tangent: Tangent::new(n, layout.is_symmetric()),
        }
    }

    /// Residual without friction of the sign, and the diagonal of its slope beside the inertia, at velocities `self.next`.
    fn smooth(&mut self, b: &Begin<'_>) {
        let links = b.layout.links;
        let mean = |next: &[f64], c: usize| 0.5 * (b.v[c] + next[c]);
        let middle = |mean: f64, c: usize| b.q[c] + 0.5 * b.h * mean;
        for j in 0..self.n {
            let joint = &b.joints[j];
            let mut inertial = joint.rotor * (self.next[j] - b.v[j]);
            let mut bias = 0.0;
            if j < links {
                let row = &b.mass[j * links..][..links];
                for (k, mass) in row.iter().enumerate() {
                    inertial += mass * (self.next[k] - b.v[k]);
                }
                bias = b.bias[j];
            }
            let reads = b.layout.reads[j];
            let own = mean(&self.next, j);
            let read = if reads == j { own } else { mean(&self.next, reads) };
            let drive = joint.drive(b.wanted[j], middle(read, reads), read);
            self.residual[j] = inertial / b.h + bias - drive.effort + joint.viscous * own + joint.offset;
            let by_read = 0.25 * b.h * drive.by_error + 0.5 * drive.by_damping * joint.kd;
            (self.slope[j], self.beside[j]) = if reads == j { (by_read, 0.0) } else { (0.0, by_read) };
            self.slope[j] += 0.5 * joint.viscous;
            self.drive[j] = drive;
        }
        self.gears.clear();
        for gear in &b.layout.gears {
            let (motor, link) = (mean(&self.next, gear.motor), mean(&self.next, gear.link));
            let lead = middle(motor, gear.motor) - middle(link, gear.link);
            let carried = gear.carry(lead, motor - link);
            self.residual[gear.motor] += carried.effort;
            self.residual[gear.link] -= carried.effort;
            self.gears.push(carried);
        }
    }

    /// Friction of the sign between two velocities, and its slopes by that at the end and at the beginning.
    pub(crate) fn kink(&self, joint: &Numbers, j: usize, begin: f64) -> (f64, f64, f64) {
        let v = self.next[j];
        let (dry, dry_slope) = joint.dry(self.speed(j, begin));
        let level = dry + joint.load * self.carried[j].abs();
        let width = self.scheme.sign_width;
        if width > 0.0 {
            let sign = (v / width).tanh();
            let (ended, begun) = if self.scheme.middle { (0.5, 0.5 * begin.signum()) } else { (1.0, 0.0) };
            let by_end = level * (1.0 - sign * sign) / width + ended * dry_slope * v.signum() * sign;
            return (level * sign, by_end, begun * dry_slope * sign);
        }
        let side = self.side[j];
        if !self.scheme.middle || side == 0.0 {
            return (level * side, dry_slope * side * side, 0.0);
        }
        let was = if begin == 0.0 { 0.0 } else { begin.signum() };
        if !self.turns(j, begin) {
            return (level * side, 0.5 * dry_slope * side * side, 0.5 * dry_slope * was * side);
        }
        let Turn { share, by_begin, by_end, by_level } = self.turn(j, begin, level);
        let sign = (2.0 * share - 1.0) * was;
        // By the speeds |v| and |v⁺|, the level among them; the velocities have the signs `was` and `side`.
        let by_level = sign + 2.0 * level * by_level * was;
        let by = |share_by: f64| by_level * 0.5 * dry_slope + 2.0 * level * share_by * was;
        (level * sign, by(by_end) * side, by(by_begin) * was)
    }

    /// What friction of the sign gains per friction `L`.
    pub(crate) fn by_level(&self, joint: &Numbers, j: usize, begin: f64) -> f64 {
        if !self.turns(j, begin) {
            let width = self.scheme.sign_width;
            return if width > 0.0 { (self.next[j] / width).tanh() } else { self.side[j] };
        }
        let level = joint.dry(self.speed(j, begin)).0 + joint.load * self.carried[j].abs();
        let turn = self.turn(j, begin, level);
        (2.0 * turn.share - 1.0 + 2.0 * level * turn.by_level) * begin.signum()
    }

    /// Whether a joint slips the other way at the end of a step than at its beginning.
    fn turns(&self, j: usize, begin: f64) -> bool {
        self.scheme.middle && self.scheme.sign_width == 0.0 && self.side[j] * begin < 0.0
    }

    /// Speed at which friction is taken.
    pub(crate) fn speed(&self, j: usize, begin: f64) -> f64 {
        let end = self.next[j].abs();
        if self.scheme.middle { 0.5 * (begin.abs() + end) } else { end }
    }

    /// Share of the step before a joint turns, with slopes by speeds at the beginning and the end and by the friction; from `k`, see above.
    fn turn(&self, j: usize, begin: f64, level: f64) -> Turn {
        let (v, u, k) = (begin.abs(), self.next[j].abs(), level * self.turning[j]);
        let sum = v + k + u;
        // The other root of the equation is above one.
        let root = (sum * sum - 4.0 * k * v).max(1e-24 * sum * sum).sqrt();
        // 2v/(sum + root) is (sum - root)/2k without its loss of digits where friction is little.
        let share = 2.0 * v / (sum + root);
        // Slopes of k α² - sum α + v = 0.
        Turn {
            share,
            by_begin: (1.0 - share) / root,
            by_end: -share / root,
            by_level: self.turning[j] * share * (share - 1.0) / root,
        }
    }

    /// Finds `2 h/μ` of a joint at rest, `μ` the inertia that it alone would move, the others that slip yielding.
    fn find_turning(&mut self, b: &Begin<'_>, j: usize) {
        self.side[j] = 1.0;
        self.tangent.fill_inertia(b, &self.side);
        self.tangent.factor();
        self.side[j] = 0.0;
        self.change.fill(0.0);
        self.change[j] = 1.0;
        self.tangent.solve(&mut self.change, 1);
        self.turning[j] = 2.0 * self.change[j];
    }

    /// Most that a resting joint can hold.
    fn hold(&self, joint: &Numbers, j: usize) -> f64 {
        joint.dry(0.0).0 + joint.load * self.carried[j].abs()
    }

    /// Finds the velocities at the end of a step.
    pub(crate) fn step(&mut self, b: &Begin<'_>) {
        for j in 0..self.n {
            self.carried[j] = match self.scheme.load {
                LoadOf::Bodies => b.bias[b.layout.joint[j]],
                LoadOf::Drive => {
                    let c = b.layout.reads[j];
                    let (q, v) =
                        if self.scheme.middle { (b.ahead.0[c], b.ahead.1[c]) } else { (b.q[c], b.v[c]) };
                    self.before[j] = b.joints[j].drive(b.wanted[j], q, v);
                    self.before[j].effort
                }
            };
        }
        self.next.copy_from_slice(b.v);
        if self.scheme.sign_width > 0.0 { self.step_smooth(b) } else { self.step_with_rest(b) }
    }

    /// Newton's method with a smooth sign: a joint that would cross a steep part stops at zero first.
    fn step_smooth(&mut self, b: &Begin<'_>) {
        let width = self.scheme.sign_width;
        self.side.fill(1.0);
        for _ in 0..ROUNDS {
            self.smooth(b);
            for j in 0..self.n {
                let (friction, slope, _) = self.kink(&b.joints[j], j, b.v[j]);
                self.residual[j] += friction;
                self.slope[j] += slope.max(0.0);
            }
            self.solve_change(b);
            let mut largest = 0.0_f64;
            for j in 0..self.n {
                let (from, to) = (self.next[j], self.next[j] + self.change[j]);
                let crosses = from * to < 0.0 && from.abs() > 2.0 * width;
                self.next[j] = if crosses { 0.0 } else { to };
                largest = largest.max((self.next[j] - from).abs());
            }
            if largest <= CHANGE {
                self.finish(b);
                return;
            }
        }
        self.unsettled += 1;
        self.finish(b);
    }

    /// Newton's method among joints that slip, and a choice of those that stick.
    fn step_with_rest(&mut self, b: &Begin<'_>) {
        for j in 0..self.n {
            let v = b.v[j];
            // A link behind a gear that gives way has no friction: it never sticks.
            self.side[j] = if v > 0.0 || !b.layout.driven[j] {
                1.0
            } else if v < 0.0 {
                -1.0
            } else {
                0.0
            };
        }
        for round in 0..ROUNDS {
            self.smooth(b);
            for j in 0..self.n {
                let (friction, slope, _) = self.kink(&b.joints[j], j, b.v[j]);
                self.residual[j] += friction;
                // The falling part of Stribeck's curve, as far as the inertia outweighs it: cut off, the rounds would creep.
                let least = -0.5 * b.inertia(j, j) / b.h;
                self.slope[j] = (self.slope[j] + slope).max(least);
            }
            self.solve_change(b);
            let mut largest = 0.0_f64;
            for j in 0..self.n {
                largest = largest.max(self.change[j].abs());
                self.next[j] += self.change[j];
            }
            let one_by_one = round >= FREE_ROUNDS;
            let mut turned = false;
            for j in 0..self.n {
                let against = self.next[j] * self.side[j] < 0.0 && b.layout.driven[j];
                if against && !(turned && one_by_one) {
                    if self.turns(j, b.v[j]) {
                        // It does not turn after all.
                        self.side[j] = -self.side[j];
                    } else {
                        self.side[j] = 0.0;
                        self.next[j] = 0.0;
                    }
                    turned = true;
                }
            }
            if turned {
                continue;
            }
            self.smooth(b);
            for j in 0..self.n {
                if self.side[j] != 0.0 || (turned && one_by_one) {
                    continue;
                }
                let mut pushes = self.residual[j];
                let stops = self.scheme.middle && b.v[j] != 0.0;
                if stops {
                    // What stops the joint within the step is not what it is held against from then on.
                    self.find_turning(b, j);
                    pushes += 2.0 * b.v[j] / self.turning[j];
                }
                // A joint that friction has just stopped goes on only the other way.
                let goes_on = stops && -pushes * b.v[j] > 0.0;
                if pushes.abs() > self.hold(&b.joints[j], j) * (1.0 + 1e-12) && !goes_on {
                    self.side[j] = -pushes.signum();
                    turned = true;
                }
            }
            if !turned && largest <= CHANGE {
                self.finish(b);
                return;
            }
        }
        self.unsettled += 1;
        self.finish(b);
    }

    /// Change of velocities that the residual asks for; joints that stick have none.
    fn solve_change(&mut self, b: &Begin<'_>) {
        self.fill_tangent(b);
        for j in 0..self.n {
            self.change[j] = if self.side[j] == 0.0 { 0.0 } else { -self.residual[j] };
        }
        self.tangent.solve(&mut self.change, 1);
    }

    /// Drives and the true tangent at the solution.
    fn finish(&mut self, b: &Begin<'_>) {
        self.smooth(b);
        for j in 0..self.n {
            self.slope[j] += self.kink(&b.joints[j], j, b.v[j]).1;
        }
        self.fill_tangent(b);
    }

    fn fill_tangent(&mut self, b: &Begin<'_>) {
        let tangent = &mut self.tangent;
        tangent.fill_inertia(b, &self.side);
        for j in 0..self.n {
            tangent.add(j, j, self.slope[j], &self.side);
            if self.beside[j] != 0.0 {
                tangent.add(j, b.layout.reads[j], self.beside[j], &self.side);
            }
        }
        for (gear, carried) in b.layout.gears.iter().zip(&self.gears) {
            let slope = 0.25 * b.h * carried.by_lead + 0.5 * carried.by_rate;
            for (row, column, sign) in [
                (gear.motor, gear.motor, 1.0),
                (gear.link, gear.link, 1.0),
                (gear.motor, gear.link, -1.0),
                (gear.link, gear.motor, -1.0),
            ] {
                tangent.add(row, column, sign * slope, &self.side);
            }
        }
        tangent.factor();
    }
}

/// `(M + I_a)/h` and slopes of efforts, factored without pivoting: the inertia leads, rows of joints that stick are those of the identity. As `L D Lᵀ`, of which
/// the lower triangle is used alone, unless a drive reads another coordinate than its own: then as `L U`.
#[derive(Debug)]
pub(crate) struct Tangent {
    n: usize,
    symmetric: bool,
    /// Row-major.
    entries: Vec<f64>,
}

impl Tangent {
    fn new(n: usize, symmetric: bool) -> Self {
        Tangent { n, symmetric, entries: vec![0.0; n * n] }
    }

    fn fill_inertia(&mut self, b: &Begin<'_>, side: &[f64]) {
        let (n, links) = (self.n, b.layout.links);
        for (j, row) in self.entries.chunks_exact_mut(n).enumerate() {
            row.fill(0.0);
            if side[j] == 0.0 {
                row[j] = 1.0;
                continue;
            }
            if j < links {
                let most = if self.symmetric { j + 1 } else { links };
                for (k, to) in row[..most].iter_mut().enumerate() {
                    if side[k] != 0.0 {
                        *to = b.mass[j * links + k] / b.h;
                    }
                }
            }
            row[j] += b.joints[j].rotor / b.h;
        }
    }

    /// Adds a slope where both joints move.
    fn add(&mut self, row: usize, column: usize, slope: f64, side: &[f64]) {
        if side[row] != 0.0 && side[column] != 0.0 {
            self.entries[row * self.n + column] += slope;
        }
    }

    fn factor(&mut self) {
        let n = self.n;
        if !self.symmetric {
            for k in 0..n {
                let (above, below) = self.entries.split_at_mut((k + 1) * n);
                let pivot_row = &above[k * n + k..];
                for row in below.chunks_exact_mut(n) {
                    row[k] /= pivot_row[0];
                    let factor = row[k];
                    subtract(&mut row[k + 1..], factor, &pivot_row[1..]);
                }
            }
            return;
        }
        for j in 0..n {
            for k in 0..j {
                let mut sum = self.entries[j * n + k];
                for i in 0..k {
                    sum -= self.entries[j * n + i] * self.entries[k * n + i] * self.entries[i * n + i];
                }
                self.entries[j * n + k] = sum / self.entries[k * n + k];
            }
            let mut pivot = self.entries[j * n + j];
            for i in 0..j {
                pivot -= self.entries[j * n + i] * self.entries[j * n + i] * self.entries[i * n + i];
            }
            self.entries[j * n + j] = pivot;
        }
    }

    /// Solves for `columns` right-hand sides, row-major, in place.
    pub(crate) fn solve(&self, rhs: &mut [f64], columns: usize) {
        let (n, entries) = (self.n, &self.entries);
        for j in 0..n {
            let (above, own) = rhs.split_at_mut(j * columns);
            let own = &mut own[..columns];
            for k in 0..j {
                subtract(own, entries[j * n + k], &above[k * columns..][..columns]);
            }
        }
        for j in (0..n).rev() {
            let (own, below) = rhs[j * columns..].split_at_mut(columns);
            let pivot = 1.0 / entries[j * n + j];
            if self.symmetric {
                own.iter_mut().for_each(|x| *x *= pivot);
            }
            for k in j + 1..n {
                let entry = if self.symmetric { entries[k * n + j] } else { entries[j * n + k] };
                subtract(own, entry, &below[(k - j - 1) * columns..][..columns]);
            }
            if !self.symmetric {
                own.iter_mut().for_each(|x| *x *= pivot);
            }
        }
    }
}

fn subtract(to: &mut [f64], factor: f64, from: &[f64]) {
    if factor != 0.0 {
        to.iter_mut().zip(from).for_each(|(t, f)| *t -= factor * f);
    }
}
