//! What is known of a robot's drives, and what an identification is to find.

use crate::joint::{Hold, Limited, LoadOf, ServoJoint};
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
    /// Terms that are found besides, each for every joint: dead band, limits, smoothing.
    pub find: Vec<Term>,
    /// How additions are chosen.
    pub choice: Choice,
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
            own_gains: false,
            delay: Shared::Chain,
            known_delay: false,
            known_zero: vec![false; joints],
            find_direction: vec![false; joints],
            zero_std: 0.5,
            find: Vec::new(),
            choice: Choice::HeldOut,
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
}
