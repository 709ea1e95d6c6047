//! A joint behind a position-controlled drive, and how its motion is simulated.

use crate::channel::EffortAt;
use crate::term::Term;

/// What the effort limit of a drive acts on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Limited {
    /// The whole effort, as a limit of torque or current does: `sat(k_p e - k_d v)`.
    #[default]
    Whole,
    /// The part of the control error alone, as a limit of voltage does, whose back-EMF comes after it: `sat(k_p e) - k_d v`.
    Proportional,
}

/// What load friction grows with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum LoadOf {
    /// Gravity, Coriolis and centrifugal effort of the bodies, `|b(q, v)|`.
    Bodies,
    /// The effort of the drive at the beginning of a step.
    #[default]
    Drive,
}

/// What a command does between two samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Hold {
    /// It stays (zero-order hold).
    #[default]
    Held,
    /// It goes on a straight line to the next.
    Line,
}

/// Which side of a gear that gives way an encoder sits on: its drive follows commands there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum EncoderAt {
    /// On the motor, as in geared drives of industry.
    #[default]
    Motor,
    /// On the link, as the potentiometer of a hobby servo.
    Link,
}

/// A joint with its drive:
///
/// ```text
/// q = s x + z
/// τ = sat(k_p db(s u + z - q) + k_d (s w - v) + s f)
/// friction = F_v v + (F_c + (F_s - F_c) e^{-(v/v_s)²} + μ |load|) sign(v) + o
/// ```
///
/// with the encoder's position `x`, direction `s`, the command `u` after clamp, delay, rate limit and smoothing, the commanded
/// velocity `w` and effort `f` (0 if not logged) and the dead band `db`.
///
/// Where the gear gives way ([`Term::Compliance`] above 0) the drive moves a coordinate `θ` of its own with rotor inertia and friction, and the link `q` is
/// moved by what the gear carries: `τ_g = k db(θ - q) + d (θ' - q')` with a dead band of half the backlash (Spong 1987). The encoder, and the
/// drive's control error with it, is that of `θ` or `q`.
#[derive(Debug, Clone, PartialEq)]
pub struct ServoJoint {
    values: [f64; Term::COUNT],
    /// Direction `s` of encoder and command against the joint, +1 or -1.
    pub direction: f64,
    /// What the effort limit acts on.
    pub limited: Limited,
    /// Least and largest commanded reading that the drive takes: it clamps others. Infinite: it takes all.
    pub command_limits: (f64, f64),
    /// Where the encoder sits: matters for gears that give way.
    pub encoder: EncoderAt,
}

impl Default for ServoJoint {
    fn default() -> Self {
        ServoJoint {
            values: Term::ALL.map(Term::none),
            direction: 1.0,
            limited: Limited::Whole,
            command_limits: (f64::NEG_INFINITY, f64::INFINITY),
            encoder: EncoderAt::Motor,
        }
    }
}

impl ServoJoint {
    /// Value of a term.
    pub fn get(&self, term: Term) -> f64 {
        self.values[term as usize]
    }

    /// Sets a term.
    pub fn set(&mut self, term: Term, value: f64) {
        self.values[term as usize] = value;
    }

    /// Returns the joint with a term of this value.
    #[must_use]
    pub fn with(mut self, term: Term, value: f64) -> Self {
        self.set(term, value);
        self
    }

    /// Position of the joint for a reading of its encoder.
    pub fn position(&self, reading: f64) -> f64 {
        self.direction * reading + self.get(Term::Zero)
    }

    /// What the drive takes for a commanded reading.
    pub fn taken(&self, command: f64) -> f64 {
        let (low, high) = self.command_limits;
        command.max(low).min(high)
    }

    /// Reading of the encoder at a position of the joint.
    pub fn reading(&self, position: f64) -> f64 {
        self.direction * (position - self.get(Term::Zero))
    }
}

/// How motion is simulated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scheme {
    /// Longest step, s. Every interval between two samples is cut into equal ones. Default 5e-3.
    pub step_s: f64,
    /// Width `w` of the sign of velocities `tanh(v/w)`, rad/s; 0: joints stick. Default 0.
    pub sign_width: f64,
    /// Whether efforts that go with velocities are taken in the middle of a step, velocities extrapolated from the step before, and a joint that
    /// turns round within a step has friction of both signs in it: the error is then of second order. Else they are taken where the step begins or
    /// ends, and the error is of first order. Default true.
    pub middle: bool,
    /// What load friction grows with.
    pub load: LoadOf,
    /// What commands do between samples.
    pub hold: Hold,
    /// Where efforts are measured. Default: at the drive.
    pub effort_at: EffortAt,
    /// Time about its instant over which a measured effort of a drive has the mean of the command, s. A command that is held jumps from sample to sample,
    /// and so does the effort: an effort that was read at an instant has a short one, of which the fit sees little slope until it is close; one that
    /// is a mean over a period has that. Default 5e-3.
    pub effort_span_s: f64,
}

impl Default for Scheme {
    fn default() -> Self {
        Scheme {
            step_s: 5e-3,
            sign_width: 0.0,
            middle: true,
            load: LoadOf::default(),
            hold: Hold::default(),
            effort_at: EffortAt::default(),
            effort_span_s: 5e-3,
        }
    }
}
