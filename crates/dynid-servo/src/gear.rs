//! Gears with play and a spring between drive and link.

use crate::free::ServoValues;
use crate::joint::EncoderAt;
use crate::term::Term;

/// A gear that gives way: between the coordinate of its drive `θ` and that of its link `q` it carries
///
/// ```text
/// τ_g = k db(θ - q) + d (θ' - q')
/// ```
///
/// with the stiffness `k`, the damping `d` and a dead band `db` of half the backlash. Within the backlash it carries nothing.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Gear {
    /// Coordinate of the link.
    pub(crate) link: usize,
    /// Coordinate of the drive.
    pub(crate) motor: usize,
    pub(crate) stiffness: f64,
    pub(crate) damping: f64,
    /// Half of the backlash.
    pub(crate) play: f64,
}

/// What a gear carries and its slopes.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Carried {
    pub(crate) effort: f64,
    /// Twist behind the backlash.
    pub(crate) twist: f64,
    /// Flank in contact: -1, 0 (none), 1; 1 without backlash.
    pub(crate) side: f64,
    /// Slope over the lead of the drive.
    pub(crate) by_lead: f64,
    /// Slope over its rate.
    pub(crate) by_rate: f64,
}

impl Gear {
    /// What the gear carries where its drive is ahead of its link by `lead`, growing by `rate`.
    pub(crate) fn carry(&self, lead: f64, rate: f64) -> Carried {
        let side = if lead >= self.play {
            1.0
        } else if lead <= -self.play {
            -1.0
        } else {
            return Carried::default();
        };
        let twist = lead - side * self.play;
        let effort = self.stiffness * twist + self.damping * rate;
        Carried { effort, twist, side, by_lead: self.stiffness, by_rate: self.damping }
    }
}

/// Coordinates of a chain: those of its links, then those of the drives whose gears give way.
#[derive(Debug)]
pub(crate) struct Layout {
    /// Number of links.
    pub(crate) links: usize,
    /// Per joint of the chain, the coordinate that its drive moves.
    pub(crate) motor: Vec<usize>,
    /// Per joint, the coordinate that its encoder reads.
    pub(crate) sensor: Vec<usize>,
    /// Per coordinate, its joint.
    pub(crate) joint: Vec<usize>,
    /// Per coordinate, whether a drive moves it: else a gear does.
    pub(crate) driven: Vec<bool>,
    /// Per coordinate, the one that its drive reads; of links that no drive moves their own.
    pub(crate) reads: Vec<usize>,
    /// Gears that give way.
    pub(crate) gears: Vec<Gear>,
}

impl Layout {
    /// Of the joints of a chain, by their places among those of the robot.
    pub(crate) fn new(joints: &[usize], values: &ServoValues) -> Self {
        let links = joints.len();
        let own: Vec<usize> = (0..links).collect();
        let mut out = Layout {
            links,
            motor: own.clone(),
            sensor: own.clone(),
            driven: vec![true; links],
            reads: own.clone(),
            joint: own,
            gears: Vec::new(),
        };
        for (j, robot) in joints.iter().enumerate() {
            let of = &values.joints[*robot];
            let compliance = of.get(Term::Compliance);
            if compliance <= 0.0 {
                continue;
            }
            let motor = links + out.gears.len();
            (out.motor[j], out.driven[j]) = (motor, false);
            if of.encoder == EncoderAt::Motor {
                out.sensor[j] = motor;
            }
            out.joint.push(j);
            out.driven.push(true);
            out.reads.push(out.sensor[j]);
            let (damping, play) = (of.get(Term::GearDamping), 0.5 * of.get(Term::Backlash));
            out.gears.push(Gear { link: j, motor, stiffness: 1.0 / compliance, damping, play });
        }
        out
    }

    /// Number of coordinates.
    pub(crate) fn len(&self) -> usize {
        self.joint.len()
    }

    /// Whether every drive reads what it moves.
    pub(crate) fn is_symmetric(&self) -> bool {
        self.sensor == self.motor
    }
}
