//! How a log is read: which column is whose, with which sign, scale and zero, by which clock, under which gravity.

/// A column that stands for a signal of a joint: `signal = factor · column + offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Source {
    /// Joint whose column it is, as the log says.
    pub joint: usize,
    /// Factor.
    pub factor: f64,
    /// Offset, rad or m; zero for efforts.
    pub offset: f64,
}

impl Source {
    fn scaled(&mut self, factor: f64) {
        self.factor *= factor;
        self.offset *= factor;
    }
}

/// How a log is read: where the position and the effort of every joint come from, and what all joints share.
#[derive(Debug, Clone, PartialEq)]
pub struct Wiring {
    /// Positions (with velocities and accelerations).
    pub position: Vec<Source>,
    /// Efforts.
    pub effort: Vec<Source>,
    /// Gravity in base axes in place of the model's, m/s².
    pub gravity: Option<[f64; 3]>,
    /// Seconds per second of the log's clock.
    pub clock: f64,
    /// What the motion is later than the effort of the same row, s of the log's clock.
    pub delay_s: f64,
}

/// One difference from a wiring.
#[derive(Debug, Clone, PartialEq)]
pub enum Rewiring {
    /// The effort of a joint counts the other way.
    EffortSign(usize),
    /// All efforts count the other way.
    AllEffortSigns,
    /// The position of a joint counts the other way.
    PositionSign(usize),
    /// Position and effort of a joint count the other way.
    BothSigns(usize),
    /// The efforts of two joints are exchanged.
    EffortSwap(usize, usize),
    /// The positions of two joints are exchanged.
    PositionSwap(usize, usize),
    /// Positions and efforts of two joints are exchanged.
    JointSwap(usize, usize),
    /// Efforts belong to other joints: joint `j` has the column of joint `order[j]`.
    EffortOrder(Vec<usize>),
    /// Positions belong to other joints.
    PositionOrder(Vec<usize>),
    /// Positions and efforts both belong to other joints, alike.
    JointOrder(Vec<usize>),
    /// The position of a joint has another unit: it is to be multiplied by this.
    PositionUnit(usize, f64),
    /// The positions of all joints that turn have another unit.
    AllPositionUnits(f64),
    /// The effort of a joint is to be multiplied by this.
    EffortScale(usize, f64),
    /// All efforts are to be multiplied by this.
    AllEffortScales(f64),
    /// The position of a joint counts from another zero: this is to be added, rad.
    Zero(usize, f64),
    /// Gravity points elsewhere, m/s² in base axes.
    Gravity([f64; 3]),
    /// The clock counts another unit: times are to be multiplied by this.
    Clock(f64),
    /// The motion is later than the effort of the same row by so many seconds.
    Delay(f64),
}

impl Rewiring {
    /// Whether two differences are amounts of the same.
    pub(crate) fn is_like(&self, other: &Rewiring) -> bool {
        match (self, other) {
            (Rewiring::Zero(a, _), Rewiring::Zero(b, _)) => a == b,
            (Rewiring::Gravity(_), Rewiring::Gravity(_))
            | (Rewiring::Clock(_), Rewiring::Clock(_))
            | (Rewiring::Delay(_), Rewiring::Delay(_))
            | (Rewiring::AllEffortScales(_), Rewiring::AllEffortScales(_)) => true,
            _ => false,
        }
    }

    /// How much it takes to believe it: one cause for all joints comes before a fault of one joint, that before an exchange, that before a
    /// new order.
    pub(crate) fn cost(&self) -> u8 {
        match self {
            Rewiring::AllEffortSigns
            | Rewiring::AllEffortScales(_)
            | Rewiring::AllPositionUnits(_)
            | Rewiring::Gravity(_)
            | Rewiring::Clock(_)
            | Rewiring::Delay(_) => 0,
            Rewiring::EffortSign(_)
            | Rewiring::PositionSign(_)
            | Rewiring::PositionUnit(..)
            | Rewiring::EffortScale(..)
            | Rewiring::Zero(..) => 1,
            Rewiring::BothSigns(_)
            | Rewiring::EffortSwap(..)
            | Rewiring::PositionSwap(..)
            | Rewiring::JointSwap(..) => 2,
            Rewiring::EffortOrder(_) | Rewiring::PositionOrder(_) | Rewiring::JointOrder(_) => 3,
        }
    }
}

impl Wiring {
    /// The wiring that the log states.
    pub fn identity(joints: usize) -> Self {
        let plain: Vec<Source> =
            (0..joints).map(|joint| Source { joint, factor: 1.0, offset: 0.0 }).collect();
        Wiring { position: plain.clone(), effort: plain, gravity: None, clock: 1.0, delay_s: 0.0 }
    }

    /// With one more difference. `slides`: per joint, whether its position is a length, which has no unit of angle.
    pub fn with(&self, change: &Rewiring, slides: &[bool]) -> Wiring {
        let mut out = self.clone();
        let ordered = |list: &[Source], order: &[usize]| order.iter().map(|k| list[*k]).collect::<Vec<_>>();
        match change {
            Rewiring::EffortSign(j) => out.effort[*j].factor *= -1.0,
            Rewiring::AllEffortSigns => out.effort.iter_mut().for_each(|e| e.factor *= -1.0),
            Rewiring::PositionSign(j) => out.position[*j].scaled(-1.0),
            Rewiring::BothSigns(j) => {
                out.position[*j].scaled(-1.0);
                out.effort[*j].factor *= -1.0;
            }
            Rewiring::EffortSwap(a, b) => out.effort.swap(*a, *b),
            Rewiring::PositionSwap(a, b) => out.position.swap(*a, *b),
            Rewiring::JointSwap(a, b) => {
                out.position.swap(*a, *b);
                out.effort.swap(*a, *b);
            }
            Rewiring::EffortOrder(order) => out.effort = ordered(&self.effort, order),
            Rewiring::PositionOrder(order) => out.position = ordered(&self.position, order),
            Rewiring::JointOrder(order) => {
                out.position = ordered(&self.position, order);
                out.effort = ordered(&self.effort, order);
            }
            Rewiring::PositionUnit(j, factor) => out.position[*j].scaled(*factor),
            Rewiring::AllPositionUnits(factor) => {
                for (p, _) in out.position.iter_mut().zip(slides).filter(|(_, slides)| !**slides) {
                    p.scaled(*factor);
                }
            }
            Rewiring::EffortScale(j, factor) => out.effort[*j].factor *= factor,
            Rewiring::AllEffortScales(factor) => out.effort.iter_mut().for_each(|e| e.factor *= factor),
            Rewiring::Zero(j, offset) => out.position[*j].offset += offset,
            Rewiring::Gravity(gravity) => out.gravity = Some(*gravity),
            Rewiring::Clock(factor) => out.clock *= factor,
            Rewiring::Delay(seconds) => out.delay_s += seconds,
        }
        out
    }
}
