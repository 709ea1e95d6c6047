//! Which capsules can touch, and which points can get below a plane, within the joint ranges.
//!
//! A distance changes at most by `Σ L_k |Δq_k|`, `L_k` the farthest that a unit step of coordinate `k`
//! can move a point of either (relative to the other). A box of positions of half widths `h` is therefore free of contact
//! if the distance at its middle exceeds `Σ L_k h_k`; else it is cut in two.

use dynid_model::{BodyPoint, Dynamics, DynamicsWorkspace, JointKind, Mechanism, Vec3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::DISTANCE_SCALE;
use super::segment::{Segment, segment_distance};

/// Poses tried for one pair before it counts as one that may touch.
const POSES: usize = 4000;
/// Random poses that show whether segments can be nearly parallel.
const SAMPLES: usize = 1000;
/// Cosine above which segments count as nearly parallel: 8°.
const NEARLY_PARALLEL: f64 = 0.99;

/// Questions about pairs of capsules over all positions within ranges.
pub(super) struct Clearance<'a> {
    mechanism: &'a Mechanism,
    dynamics: &'a Dynamics,
    ranges: Vec<(f64, f64)>,
}

/// Four points at a pose, as two segments.
struct Segments<'a> {
    dynamics: &'a Dynamics,
    work: DynamicsWorkspace<f64>,
    jacobians: Vec<f64>,
}

impl<'a> Segments<'a> {
    fn new(dynamics: &'a Dynamics) -> Self {
        Segments { dynamics, work: dynamics.workspace(), jacobians: vec![0.0; 12 * dynamics.rates()] }
    }

    fn at(&mut self, ends: &[BodyPoint; 4], q: &[f64]) -> [Segment; 2] {
        let mut at = [Vec3::zero(); 4];
        self.dynamics.point_jacobians(q, ends, &mut self.work, &mut at, &mut self.jacobians);
        [[at[0], at[1]], [at[2], at[3]]]
    }
}

impl<'a> Clearance<'a> {
    pub(super) fn new(mechanism: &'a Mechanism, dynamics: &'a Dynamics, ranges: &[(f64, f64)]) -> Self {
        // Turning joints without limits come round after one turn, unless something else follows the angle.
        let mut comes_round = vec![true; mechanism.rates()];
        for body in mechanism.bodies() {
            let turns = matches!(body.joint.kind, JointKind::Revolute | JointKind::Continuous);
            let (coordinate, ratio) = mechanism
                .follows()
                .map_or((body.rate, 1.0), |f| (f[body.rate].coordinate, f[body.rate].ratio));
            comes_round[coordinate] &= turns && ratio.abs() == 1.0;
        }
        let turn = (-std::f64::consts::PI, std::f64::consts::PI);
        let within = |((low, high), round): (&(f64, f64), bool)| {
            if round && (high - low >= std::f64::consts::TAU || !(high - low).is_finite()) {
                turn
            } else {
                (*low, *high)
            }
        };
        Clearance { mechanism, dynamics, ranges: ranges.iter().zip(comes_round).map(within).collect() }
    }

    /// True if it is proven that the segments never come closer than `radii`; `ends`: those of the first, then of the
    /// second.
    pub(super) fn never_touch(&self, ends: &[BodyPoint; 4], radii: f64) -> bool {
        let Some(reach) = self.reaches(&ends[..2], &ends[2..]) else { return false };
        let mut segments = Segments::new(self.dynamics);
        self.stays_positive(&reach, |q| {
            let [first, second] = segments.at(ends, q);
            segment_distance(&first, &second).distance - radii
        })
    }

    /// True if it is proven that a point never comes below `normal · x = height`; `normal` has unit length.
    pub(super) fn never_below(&self, point: BodyPoint, normal: Vec3<f64>, height: f64) -> bool {
        let ground = BodyPoint { body: None, position: Vec3::zero() };
        let Some(reach) = self.reaches(&[point], &[ground]) else { return false };
        let mut segments = Segments::new(self.dynamics);
        self.stays_positive(&reach, |q| normal.dot(segments.at(&[point; 4], q)[0][0]) - height)
    }

    /// True if it is proven that a distance stays positive, whose slopes along the coordinates are at most `reach`.
    fn stays_positive(&self, reach: &[f64], mut gap: impl FnMut(&[f64]) -> f64) -> bool {
        let middle_of = |(low, high): &(f64, f64)| 0.5 * (low + high);
        let mut middle: Vec<f64> = self.ranges.iter().map(middle_of).collect();
        let mut half: Vec<f64> = self.ranges.iter().map(|(low, high)| 0.5 * (high - low)).collect();
        for (k, reach) in reach.iter().enumerate() {
            if *reach == 0.0 {
                (middle[k], half[k]) = (0.0, 0.0);
            }
        }
        if middle.iter().chain(&half).any(|x| !x.is_finite()) {
            return false;
        }
        let mut boxes = vec![(middle, half)];
        for _ in 0..POSES {
            let Some((middle, half)) = boxes.pop() else { return true };
            let gap = gap(&middle);
            if gap <= 0.0 {
                return false;
            }
            let steps = || reach.iter().zip(&half).map(|(l, h)| l * h);
            if gap > steps().sum() {
                continue;
            }
            let Some((cut, _)) = steps().enumerate().max_by(|a, b| a.1.total_cmp(&b.1)) else { return false };
            for side in [-0.5, 0.5] {
                let (mut middle, mut half) = (middle.clone(), half.clone());
                middle[cut] += side * half[cut];
                half[cut] *= 0.5;
                boxes.push((middle, half));
            }
        }
        boxes.is_empty()
    }

    /// True if one of many random poses has the segments nearly parallel and not far from each other.
    pub(super) fn nearly_parallel(&self, ends: &[BodyPoint; 4], radii: f64) -> bool {
        // A stream of its own for every question: answers do not depend on the order of pairs.
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut segments = Segments::new(self.dynamics);
        (0..SAMPLES).any(|_| {
            let q = self.random_pose(&mut rng);
            let [first, second] = segments.at(ends, &q);
            let (u, v) = (first[1] - first[0], second[1] - second[0]);
            let lengths = u.norm() * v.norm();
            lengths > 0.0
                && u.dot(v).abs() > NEARLY_PARALLEL * lengths
                && segment_distance(&first, &second).distance < radii + DISTANCE_SCALE
        })
    }

    /// A pose drawn evenly from the ranges; half a turn to both sides where there is no limit.
    pub(super) fn random_pose(&self, rng: &mut ChaCha8Rng) -> Vec<f64> {
        let draw = |(low, high): &(f64, f64)| {
            let limit = |x: f64, instead: f64| if x.is_finite() { x } else { instead };
            let (low, high) = (limit(*low, -std::f64::consts::PI), limit(*high, std::f64::consts::PI));
            if low < high { rng.random_range(low..=high) } else { low }
        };
        self.ranges.iter().map(draw).collect()
    }

    /// For every coordinate: how far a unit step of it can move one of the points of one body relative to those of another,
    /// m/rad or m/m. `None` if a joint on the way slides without limit.
    fn reaches(&self, points: &[BodyPoint], others: &[BodyPoint]) -> Option<Vec<f64>> {
        let body = |points: &[BodyPoint]| self.ancestors(points.first().and_then(|p| p.body));
        let (first, second) = (body(points), body(others));
        let mut reaches = vec![0.0; self.ranges.len()];
        for (own, other, ends) in [(&first, &second, points), (&second, &first, others)] {
            let mut arm = ends.iter().map(|p| p.position.norm()).fold(0.0, f64::max);
            // Joints that carry both segments move neither relative to the other.
            for b in own.iter().take_while(|b| !other.contains(b)) {
                let body = &self.mechanism.bodies()[*b];
                let (coordinate, ratio, offset) =
                    self.mechanism.follows().map_or((body.rate, 1.0, 0.0), |f| {
                        let f = f[body.rate];
                        (f.coordinate, f.ratio, f.offset)
                    });
                let (low, high) = self.ranges[coordinate];
                let travel = (ratio * low + offset).abs().max((ratio * high + offset).abs());
                let (step, slide) = match body.joint.kind {
                    JointKind::Prismatic => (1.0, travel),
                    JointKind::Helical { pitch } => (arm + pitch.abs(), pitch.abs() * travel),
                    _ => (arm, 0.0),
                };
                if !slide.is_finite() {
                    return None;
                }
                reaches[coordinate] += ratio.abs() * step;
                arm += body.joint.placement.translation.norm() + slide;
            }
        }
        Some(reaches)
    }

    /// Bodies from this one to the root.
    fn ancestors(&self, body: Option<usize>) -> Vec<usize> {
        std::iter::successors(body, |b| self.mechanism.bodies()[*b].parent).collect()
    }
}
