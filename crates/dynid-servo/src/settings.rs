//! What is known of a robot's drives, and what an identification is to find.

use std::collections::BTreeSet;

use crate::chain::Chain;
use crate::channel::{Channel, EffortAt};
use crate::free::Free;
use crate::joint::{Hold, Limited, LoadOf, ServoJoint};
use crate::measured::Measured;
use crate::term::Term;

/// Which joints share a number that is not known.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Shared {
    /// All joints.
    All,
    /// The joints of a chain.
    #[default]
    Chain,
    /// Every joint has its own.
    Own,
}

/// What a robot may have beside position gain, rotor inertia, viscous and Coulomb friction and delay. Each is taken for all joints or
/// for none.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Addition {
    /// A constant effort of every joint: gravity that the model lacks, cables, a spring.
    Offset,
    /// Zeros of the encoders that are not those of the robot file.
    Zero,
    /// Friction at rest above Coulomb friction, with a Stribeck velocity.
    Stiction,
    /// Friction that grows with the load of the gear.
    Load,
    /// A position gain of its own for every joint, in place of a shared one: tried, never taken by itself.
    OwnGains,
}

impl Addition {
    /// All additions, in the order in which ties are broken.
    pub const ALL: [Addition; 5] =
        [Addition::Offset, Addition::Stiction, Addition::Load, Addition::Zero, Addition::OwnGains];

    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Addition::Offset => "offset",
            Addition::Zero => "zero",
            Addition::Stiction => "stiction",
            Addition::Load => "load_friction",
            Addition::OwnGains => "own_gains",
        }
    }
}

/// How additions are chosen.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Choice {
    /// Those that held-out folds ask for.
    #[default]
    HeldOut,
    /// These.
    Given(Vec<Addition>),
}

/// Where the inertias of links come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Bodies {
    /// They are those of the robot file.
    #[default]
    File,
    /// They deviate from those of the robot file, as far as held-out folds ask for it.
    Found,
}

/// Standard deviations from what is known of it within which a zero must lie.
const ZERO_STDS: f64 = 3.0;

/// Standard deviations within which 95 % of a normal distribution lie.
pub(crate) const QUANTILE: f64 = 1.96;

/// Farthest that measured efforts may lie behind or ahead of positions, s.
const MOST_EFFORT_DELAY: f64 = 0.1;

/// What is known and what is asked.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct ServoSettings {
    /// Joints with all that is known of them; terms that are found start from here.
    pub joints: Vec<ServoJoint>,
    /// Per joint, whether its position gain is known.
    pub known_gain: Vec<bool>,
    /// Relative error that known gains may have, 95 %. Default 0.1.
    pub gain_error: f64,
    /// Per joint, whether its velocity gain is known. Where it is not, a measured effort of the drive tells it apart from viscous friction.
    pub known_damping: Vec<bool>,
    /// Per joint, whether its torque constant is known.
    pub known_constant: Vec<bool>,
    /// What the sum of squares holds beside positions, where logs measure it. Default: efforts and currents.
    pub channels: Vec<Channel>,
    /// Where efforts are measured. Default: at the drive.
    pub effort_at: EffortAt,
    /// Whether every joint has a position gain of its own where it is not known; else all share one. Default false, with what gains of their
    /// own would predict as a trial.
    pub own_gains: bool,
    /// Which joints share a delay that is not known. Default: those of a chain.
    pub delay: Shared,
    /// Whether the delay is known.
    pub known_delay: bool,
    /// Per joint, whether its zero is known: [`Addition::Zero`] leaves it.
    pub known_zero: Vec<bool>,
    /// Per joint, whether its direction is to be found: gravity tells it.
    pub find_direction: Vec<bool>,
    /// Standard deviation of zeros about those of the robot file, rad or m. Default 0.5.
    pub zero_std: f64,
    /// Terms of gears that are known, per joint: [`ServoSettings::find`] leaves them.
    pub known_gear: Vec<BTreeSet<Term>>,
    /// Terms that are found besides, each for every joint: dead band, limits, smoothing; compliance, damping and backlash of gears.
    pub find: Vec<Term>,
    /// How additions are chosen.
    pub choice: Choice,
    /// Where the inertias of links come from. Default: the robot file.
    pub bodies: Bodies,
    /// Relative error that masses of the robot file may have, 95 %, where bodies are found. Default 0.5.
    pub body_error: f64,
    /// What commands do between samples. Default: held.
    pub hold: Hold,
    /// What load friction grows with. Default: the drive's effort.
    pub load: LoadOf,
    /// Longest step of the simulation, s; `None`: the sample period, halved until it does not matter. Default `None`.
    pub step_s: Option<f64>,
    /// Blocks of the jackknife. Default 24.
    pub blocks: usize,
}

impl ServoSettings {
    /// Nothing known of so many joints.
    pub fn new(joints: usize) -> Self {
        ServoSettings {
            joints: vec![ServoJoint::default(); joints],
            known_gain: vec![false; joints],
            gain_error: 0.1,
            known_damping: vec![false; joints],
            known_constant: vec![false; joints],
            channels: vec![Channel::Effort, Channel::Current],
            effort_at: EffortAt::Drive,
            own_gains: false,
            delay: Shared::Chain,
            known_delay: false,
            known_zero: vec![false; joints],
            find_direction: vec![false; joints],
            zero_std: 0.5,
            known_gear: vec![BTreeSet::new(); joints],
            find: Vec::new(),
            choice: Choice::HeldOut,
            bodies: Bodies::File,
            body_error: 0.5,
            hold: Hold::Held,
            load: LoadOf::Drive,
            step_s: None,
            blocks: 24,
        }
    }

    /// Gives every joint a limit of this kind.
    #[must_use]
    pub fn limited(mut self, limited: Limited) -> Self {
        self.joints.iter_mut().for_each(|j| j.limited = limited);
        self
    }

    /// What a law leaves free: position gains that are not known, rotor inertia, viscous and Coulomb friction, delay, the terms that are found
    /// besides, and those of the additions.
    ///
    /// Where efforts are `measured`: their zeros, torque constants and velocity gains that are not known, their delay, and known position gains
    /// within the error that they may have. Gears are apart: [`ServoSettings::free_gears`].
    pub fn free(&self, chains: &[Chain], laws: &BTreeSet<Addition>, measured: &Measured) -> Vec<Free> {
        let s = self;
        let n = s.joints.len();
        let own = |term: Term| (0..n).map(move |j| Free::term(term, [j]));
        let mut out: Vec<Free> = Vec::new();
        let unknown: Vec<usize> = (0..n).filter(|j| !s.known_gain[*j]).collect();
        if laws.contains(&Addition::OwnGains) {
            out.extend(unknown.iter().map(|j| Free::term(Term::PositionGain, [*j])));
        } else if !unknown.is_empty() {
            out.push(Free::term(Term::PositionGain, unknown));
        }
        for term in [Term::RotorInertia, Term::Viscous, Term::Coulomb] {
            out.extend(own(term));
        }
        if !s.known_delay {
            match s.delay {
                Shared::All => out.push(Free::term(Term::Delay, 0..n)),
                Shared::Chain => {
                    out.extend(chains.iter().map(|c| Free::term(Term::Delay, c.joints.iter().copied())));
                }
                Shared::Own => out.extend(own(Term::Delay)),
            }
        }
        // Gears give way as far as a search finds it.
        for term in s.find.iter().filter(|t| !t.is_of_gear()) {
            out.extend(own(*term));
        }
        out.extend(s.of_measured(measured, laws.contains(&Addition::OwnGains)));
        for addition in laws {
            match addition {
                Addition::Offset => out.extend(own(Term::Offset)),
                Addition::Zero => {
                    // Thousands of rows with the same error outweigh any knowledge: what is known bounds the zero too.
                    let zero = |j: usize| {
                        let (known, most) = (s.joints[j].get(Term::Zero), ZERO_STDS * s.zero_std);
                        let free = Free::term(Term::Zero, [j]).known(known, s.zero_std);
                        Free { lower: known - most, upper: known + most, ..free }
                    };
                    out.extend((0..n).filter(|j| !s.known_zero[*j]).map(zero));
                }
                Addition::Stiction => {
                    out.extend(own(Term::Stiction));
                    out.extend(own(Term::StribeckVelocity).map(|f| Free { upper: 1.0, ..f }));
                }
                Addition::Load => out.extend(own(Term::LoadFriction)),
                Addition::OwnGains => {}
            }
        }
        out
    }

    /// What is asked of gears that give way already.
    pub fn free_gears(&self) -> Vec<Free> {
        let asked = |j: usize| {
            let soft = self.joints[j].get(Term::Compliance) > 0.0;
            let terms = self.find.iter().filter(move |t| soft && t.is_of_gear());
            terms.filter(move |t| !self.known_gear[j].contains(t)).map(move |t| Free::term(*t, [j]))
        };
        (0..self.joints.len()).flat_map(asked).collect()
    }

    /// What measured efforts ask for and tell.
    fn of_measured(&self, measured: &Measured, own_gains: bool) -> Vec<Free> {
        let s = self;
        let joints = || 0..s.joints.len();
        let told: Vec<usize> = joints().filter(|j| measured.any(*j)).collect();
        let mut out = Vec::new();
        if told.is_empty() {
            return out;
        }
        if s.effort_at == EffortAt::Drive {
            let damping = told.iter().filter(|j| !s.known_damping[**j]);
            out.extend(damping.map(|j| Free::term(Term::VelocityGain, [*j])));
        }
        let unknown: Vec<usize> =
            joints().filter(|j| measured.current[*j] && !s.known_constant[*j]).collect();
        // Equal drives have equal constants.
        if own_gains || s.known_gain.iter().any(|k| *k) {
            out.extend(unknown.iter().map(|j| Free::term(Term::TorqueConstant, [*j])));
        } else if !unknown.is_empty() {
            out.push(Free::term(Term::TorqueConstant, unknown));
        }
        for j in joints() {
            let newtons = measured.effort[j] || (measured.current[j] && s.known_constant[j]);
            if newtons && s.known_gain[j] && s.gain_error > 0.0 {
                let known = s.joints[j].get(Term::PositionGain);
                let gain = Free::term(Term::PositionGain, [j]);
                out.push(gain.known(known, known * s.gain_error / QUANTILE));
            }
        }
        let zero = |term: Term, of: &[bool]| -> Vec<Free> {
            joints().filter(|j| of[*j]).map(|j| Free::term(term, [j])).collect()
        };
        out.extend(zero(Term::EffortZero, &measured.effort));
        out.extend(zero(Term::CurrentZero, &measured.current));
        let delay = Free::term(Term::EffortDelay, told);
        out.push(Free { lower: -MOST_EFFORT_DELAY, upper: MOST_EFFORT_DELAY, ..delay });
        out
    }
}
