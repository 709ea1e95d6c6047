//! Whether the friction of a joint takes energy out of the motion.

use super::{PlacedElement, TreeModel};
use crate::dynamics::MotionBlock;
use crate::effort_model::EffortModel;
use crate::element::{ElementColumns, JointElement, ScaledPart};

/// Where friction takes energy out of the motion.
#[derive(Debug, Clone, PartialEq)]
pub enum Passivity {
    /// Everywhere in the range.
    Passive,
    /// On these intervals of velocity `(from, to)` alone, ascending, rad/s or m/s.
    PassiveOn(Vec<(f64, f64)>),
    /// Nowhere in the range.
    NotPassive,
}

/// The friction of one joint over a range of velocities.
#[derive(Debug, Clone, PartialEq)]
pub struct FrictionPassivity {
    /// Where `v (e(v) - e(0)) >= 0`.
    pub passivity: Passivity,
    /// Velocity at which most energy is fed in, and how much, `-v (e(v) - e(0))` in W; `None` where it is passive.
    pub worst: Option<(f64, f64)>,
    /// Static friction lies below Coulomb friction, `F_s < F_c`: passive, but no Stribeck effect.
    pub static_below_coulomb: bool,
}

/// Velocities looked at on each side of rest.
const GRID: usize = 4000;
/// Efforts against the motion that pass for rounding, as a share of the largest.
const ROUNDING: f64 = 1e-12;

impl TreeModel {
    /// Whether the friction elements of a joint together, known ones too, are passive, `v (e(v) - e(0)) >= 0`, for velocities from
    /// `range.0` to `range.1` (rad/s, m/s). The effort at rest is the offset of the joint and left out.
    ///
    /// Signs are looked at on 4000 velocities on each side of rest, denser towards rest, and intervals are located
    /// between them by bisection to the last digits. Channels such as a temperature are `held` at a value each. Rest itself needs no friction. Couplings of joints do not count.
    /// Where a joint has no friction, it is passive.
    ///
    /// # Panics
    /// If there is no such rate, `shape` or `linear` has the wrong length, the range is not finite and ascending, or a channel
    /// is missing.
    pub fn friction_passivity(
        &self,
        rate: usize,
        shape: &[f64],
        linear: &[f64],
        range: (f64, f64),
        held: &[(&str, f64)],
    ) -> FrictionPassivity {
        self.check_shapes(shape, Some(linear));
        let (lower, upper) = range;
        assert!(lower.is_finite() && upper.is_finite() && lower <= upper, "velocities {lower} .. {upper}");
        let friction = Friction::new(self, rate, shape, linear, held);
        // Speeds of each side, with the sign of the velocity.
        let sides = [(-1.0, (-upper).max(0.0), -lower), (1.0, lower.max(0.0), upper)];
        let mut intervals: Vec<(f64, f64)> = Vec::new();
        let mut worst: Option<(f64, f64)> = None;
        for (sign, near, far) in sides.into_iter().filter(|(_, near, far)| far > near) {
            let side = friction.side(sign, near, far);
            for (v, against) in side.speeds.iter().zip(&side.efforts) {
                let fed = -v * against;
                if *against < -side.rounding && worst.is_none_or(|(_, most)| fed > most) {
                    worst = Some((sign * v, fed));
                }
            }
            intervals.extend(side.passive(&friction));
        }
        intervals.iter_mut().for_each(|(a, b)| (*a, *b) = (a.min(*b), a.max(*b)));
        intervals.sort_by(|a, b| a.0.total_cmp(&b.0));
        intervals.dedup_by(|next, last| {
            let touches = next.0 == 0.0 && last.1 == 0.0;
            if touches {
                last.1 = next.1;
            }
            touches
        });
        let passivity = match intervals.is_empty() {
            _ if worst.is_none() => Passivity::Passive,
            true => Passivity::NotPassive,
            false => Passivity::PassiveOn(intervals),
        };
        FrictionPassivity { passivity, worst, static_below_coulomb: self.static_below_coulomb(rate, linear) }
    }

    /// Effort of the friction elements of a joint, known ones too, over velocities (rad/s, m/s), less that at rest, `e(v) - e(0)`, in N m or N;
    /// what [`TreeModel::friction_passivity`] looks at.
    ///
    /// # Panics
    /// If there is no such rate, `shape` or `linear` has the wrong length, or a channel is missing.
    pub fn friction_effort(
        &self,
        rate: usize,
        shape: &[f64],
        linear: &[f64],
        velocities: &[f64],
        held: &[(&str, f64)],
    ) -> Vec<f64> {
        self.check_shapes(shape, Some(linear));
        let friction = Friction::new(self, rate, shape, linear, held);
        friction.efforts(velocities).into_iter().map(|e| e - friction.at_rest).collect()
    }

    fn static_below_coulomb(&self, rate: usize, linear: &[f64]) -> bool {
        let value = |symbol: &str| {
            let name = format!("{}.{symbol}", self.joints[rate].name);
            self.parameters().column(&name).map(|c| linear[c])
        };
        matches!((value("fs"), value("fc")), (Some(fs), Some(fc)) if fs < fc)
    }
}

/// The law of a joint's friction elements.
struct Friction<'a> {
    model: &'a TreeModel,
    elements: Vec<Law<'a>>,
    rate: usize,
    held: &'a [(&'a str, f64)],
    at_rest: f64,
}

/// One friction element with its shape parameters and the values that its entries point at.
struct Law<'a> {
    element: &'a dyn JointElement,
    /// Rate and column of every entry.
    entries: &'a [(usize, usize)],
    shape: &'a [f64],
    linear: &'a [f64],
}

impl<'a> Law<'a> {
    /// The element, or those that it scales by log, as they are without a log of their own.
    fn of(placed: &'a PlacedElement, shape: &'a [f64], linear: &'a [f64]) -> Vec<Law<'a>> {
        let Some(scaled) = placed.element.scaled() else {
            return vec![Law { element: &*placed.element, entries: &placed.entries, shape, linear }];
        };
        let part = |part: &'a ScaledPart| Law {
            element: &*part.element,
            entries: &placed.entries[part.entries()],
            shape: part.shape(shape),
            linear,
        };
        scaled.parts().iter().map(part).collect()
    }
}

/// Friction of one direction of motion.
struct Side {
    sign: f64,
    /// Speed at which it begins; rest itself is none of `speeds`.
    near: f64,
    speeds: Vec<f64>,
    /// Effort against the motion less that at rest.
    efforts: Vec<f64>,
    rounding: f64,
}

impl<'a> Friction<'a> {
    fn new(
        model: &'a TreeModel,
        rate: usize,
        shape: &'a [f64],
        linear: &'a [f64],
        held: &'a [(&'a str, f64)],
    ) -> Self {
        let own = model.elements.iter().flat_map(|placed| Law::of(placed, placed.shape(shape), linear));
        let known = model.known.iter().flat_map(|k| Law::of(&k.placed, &k.shape, &k.linear));
        let of_joint = |law: &Law<'_>| law.element.is_friction() && law.element.rates() == [rate];
        let elements = own.chain(known).filter(of_joint).collect();
        let mut friction = Friction { model, elements, rate, held, at_rest: 0.0 };
        friction.at_rest = friction.efforts(&[0.0])[0];
        friction
    }

    fn efforts(&self, velocities: &[f64]) -> Vec<f64> {
        let n = velocities.len();
        let mut dq = vec![0.0; self.model.joints.len() * n];
        dq[self.rate * n..][..n].copy_from_slice(velocities);
        let held: Vec<Vec<f64>> = self.held.iter().map(|(_, x)| vec![*x; n]).collect();
        let channels: Vec<(&str, &[f64])> =
            self.held.iter().zip(&held).map(|((name, _), x)| (*name, x.as_slice())).collect();
        let motion = MotionBlock { channels: &channels, ..MotionBlock::plain(n, &[], &dq, &[]) };
        let mut effort = vec![0.0; n];
        for Law { element, entries, shape, linear } in &self.elements {
            let mut data = vec![0.0; entries.len() * n];
            let slots: Vec<usize> = (0..entries.len()).collect();
            let mut columns = ElementColumns { data: &mut data, slots: &slots, stride: n, samples: n };
            element.fill(&self.model.joints, &motion, shape, &mut columns);
            for ((_, column), values) in entries.iter().zip(data.chunks_exact(n)) {
                for (e, w) in effort.iter_mut().zip(values) {
                    *e += w * linear[*column];
                }
            }
        }
        effort
    }

    fn against(&self, sign: f64, speeds: &[f64]) -> Vec<f64> {
        let velocities: Vec<f64> = speeds.iter().map(|v| sign * v).collect();
        self.efforts(&velocities).into_iter().map(|e| sign * (e - self.at_rest)).collect()
    }

    fn side(&self, sign: f64, near: f64, far: f64) -> Side {
        let first = usize::from(near == 0.0);
        let speeds: Vec<f64> =
            (first..=GRID).map(|k| near + (far - near) * (k as f64 / GRID as f64).powi(3)).collect();
        let efforts = self.against(sign, &speeds);
        let largest = efforts.iter().fold(self.at_rest.abs(), |m, e| m.max(e.abs()));
        Side { sign, near, speeds, efforts, rounding: ROUNDING * largest }
    }
}

impl Side {
    /// Velocities `(nearest to rest, farthest)` of the passive intervals.
    fn passive(&self, friction: &Friction<'_>) -> Vec<(f64, f64)> {
        let holds = |effort: f64| effort >= -self.rounding;
        let mut out = Vec::new();
        let mut start = None;
        for (k, effort) in self.efforts.iter().enumerate() {
            match (start, holds(*effort)) {
                (None, true) if k == 0 => start = Some(self.near),
                (None, true) => start = Some(self.border(friction, k)),
                (Some(from), false) => {
                    out.push((self.sign * from, self.sign * self.border(friction, k)));
                    start = None;
                }
                _ => {}
            }
        }
        if let (Some(from), Some(last)) = (start, self.speeds.last()) {
            out.push((self.sign * from, self.sign * last));
        }
        out
    }

    /// Speed between grid points `k - 1` and `k` at which passivity begins or ends.
    fn border(&self, friction: &Friction<'_>, k: usize) -> f64 {
        let (mut a, mut b) = (self.speeds[k - 1], self.speeds[k]);
        let before = self.efforts[k - 1] >= -self.rounding;
        loop {
            let middle = 0.5 * (a + b);
            if middle <= a || middle >= b {
                return middle;
            }
            if (friction.against(self.sign, &[middle])[0] >= -self.rounding) == before {
                a = middle;
            } else {
                b = middle;
            }
        }
    }
}
