//! Which column is whose, with which sign and scale.

/// A column that stands for a signal of a joint: `signal = factor · column`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Source {
    /// Joint whose column it is, as the log says.
    pub joint: usize,
    /// Factor.
    pub factor: f64,
}

/// Per joint, where its position and its effort come from.
#[derive(Debug, Clone, PartialEq)]
pub struct Wiring {
    /// Positions (with velocities and accelerations).
    pub position: Vec<Source>,
    /// Efforts.
    pub effort: Vec<Source>,
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
    /// Both belong to other joints, alike.
    JointOrder(Vec<usize>),
    /// The position of a joint has another unit: it is to be multiplied by this.
    PositionUnit(usize, f64),
    /// The positions of all joints that turn have another unit.
    AllPositionUnits(f64),
    /// The effort of a joint is to be multiplied by this.
    EffortScale(usize, f64),
}

impl Wiring {
    /// As the log says.
    pub fn identity(joints: usize) -> Self {
        let plain: Vec<Source> = (0..joints).map(|joint| Source { joint, factor: 1.0 }).collect();
        Wiring { position: plain.clone(), effort: plain }
    }

    /// Whether every column is taken as the log says.
    pub fn is_identity(&self) -> bool {
        *self == Wiring::identity(self.position.len())
    }

    /// With one more difference. `slides`: per joint, whether its position is a length, which has no unit of angle.
    pub fn with(&self, change: &Rewiring, slides: &[bool]) -> Wiring {
        let mut out = self.clone();
        let ordered = |list: &[Source], order: &[usize]| order.iter().map(|k| list[*k]).collect::<Vec<_>>();
        match change {
            Rewiring::EffortSign(j) => out.effort[*j].factor *= -1.0,
            Rewiring::AllEffortSigns => out.effort.iter_mut().for_each(|e| e.factor *= -1.0),
            Rewiring::PositionSign(j) => out.position[*j].factor *= -1.0,
            Rewiring::BothSigns(j) => {
                out.position[*j].factor *= -1.0;
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
            Rewiring::PositionUnit(j, factor) => out.position[*j].factor *= factor,
            Rewiring::AllPositionUnits(factor) => {
                for (p, _) in out.position.iter_mut().zip(slides).filter(|(_, slides)| !**slides) {
                    p.factor *= factor;
                }
            }
            Rewiring::EffortScale(j, factor) => out.effort[*j].factor *= factor,
        }
        out
    }
}
