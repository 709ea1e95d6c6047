//! What of a robot's capsules can be kept apart and on one side of planes, and what cannot.
//!
//! A limit that (nearly) every pose breaks can be kept by no motion; one that no pose comes near costs time for nothing.
//! Poses drawn from the joint ranges tell the first; that a limit cannot be broken is proven (see `clearance`).

use dynid_model::{BodyPoint, ClosedModel, Dynamics, EffortModel, Mechanism, MotionBlock, Vec3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::capsule::{check_ranges, ends, not_neighbours};
use super::cartesian::Plane;
use super::clearance::Clearance;
use super::segment::{Segment, segment_distance};
use super::{Capsule, ConstraintError, finite};

/// Poses that are drawn.
const POSES: usize = 2000;
const SEED: u64 = 2;
/// Distance below which no proof is tried that capsules stay apart: it would hardly succeed, m.
const WORTH_A_PROOF: f64 = 0.02;
/// Share of poses that must have two links apart for a motion to be able to keep them so.
const LEAST_APART: f64 = 0.05;
/// Distance that rounding may make, m.
const ROUNDING: f64 = 1e-9;
/// Poses at which two points that are always at one place are compared.
const SAME_PLACE_POSES: usize = 3;

/// What can be kept, by index of the capsules.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Screening {
    /// Pairs that are to be kept apart: some poses may bring them within the margin, and not all do.
    pub pairs: Vec<(usize, usize)>,
    /// Pairs that are given up, because 95 of 100 poses or more have their links within the margin.
    pub always_near: Vec<(usize, usize)>,
    /// Number of pairs that provably never come within the margin.
    pub never_near: usize,
    /// Of every plane, what it means for the ends of capsules.
    pub planes: Vec<PlaneScreening>,
}

/// What a plane means for the ends of capsules, by index of the capsule and end (0 or 1).
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PlaneScreening {
    /// Ends that are to be kept above it by radius and margin. Of ends that are always at one place (where the capsules of
    /// two links meet) that of the largest radius stands for all.
    pub kept: Vec<(usize, usize)>,
    /// Ends that every pose has below that.
    pub always_low: Vec<(usize, usize)>,
}

/// Screens all pairs of capsules on bodies that are neither one nor joined by one joint, and the ends of capsules on moving
/// bodies against planes. `ranges`: as for [`Capsules::new`](super::Capsules::new); `closed`: the mechanism with its loops, whose poses
/// are drawn instead of any within the ranges.
///
/// Fails as [`Capsules::new`](super::Capsules::new).
pub fn screen(
    mechanism: &Mechanism,
    capsules: &[Capsule],
    planes: &[Plane],
    margin: f64,
    ranges: &[(f64, f64)],
    closed: Option<&ClosedModel>,
) -> Result<Screening, ConstraintError> {
    check_ranges(mechanism, ranges)?;
    finite("margin", "own links", &[margin])?;
    let points = ends(mechanism, capsules)?;
    let dynamics = Dynamics::new(mechanism);
    let clearance = Clearance::new(mechanism, &dynamics, ranges);
    let poses = Poses::new(&dynamics, &clearance, &points, closed);
    let mut out = Screening::default();
    for pairs in by_links(not_neighbours(mechanism, &points), capsules) {
        let radii = |(a, b): (usize, usize)| capsules[a].radius + capsules[b].radius + margin;
        let gaps: Vec<Vec<f64>> = pairs
            .iter()
            .map(|pair| {
                let segments = |s| [poses.segment(pair.0, s), poses.segment(pair.1, s)];
                let gap = |[a, b]: [Segment; 2]| segment_distance(&a, &b).distance - radii(*pair);
                (0..POSES).map(|s| gap(segments(s))).collect()
            })
            .collect();
        let near = hopeless(&gaps);
        for (k, pair) in pairs.into_iter().enumerate() {
            let (a, b) = pair;
            let least = gaps[k].iter().fold(f64::INFINITY, |m, x| m.min(*x));
            let ends = [2 * a, 2 * a + 1, 2 * b, 2 * b + 1].map(|p| points[p]);
            if near.contains(&k) {
                out.always_near.push(pair);
            } else if least > WORTH_A_PROOF && clearance.never_touch(&ends, radii(pair)) {
                out.never_near += 1;
            } else {
                out.pairs.push(pair);
            }
        }
    }
    for plane in planes {
        let mut own = PlaneScreening::default();
        for p in outermost(&poses, &points, capsules) {
            let (capsule, end) = (p / 2, p % 2);
            let lowest = plane.height + capsules[capsule].radius + margin;
            let (least, largest) = poses.range(|s| plane.normal.dot(poses.point(p, s)) - lowest);
            if largest <= ROUNDING {
                own.always_low.push((capsule, end));
            } else if !(least > 0.0 && clearance.never_below(points[p], plane.normal, lowest)) {
                own.kept.push((capsule, end));
            }
        }
        out.planes.push(own);
    }
    Ok(out)
}

/// Pairs of capsules, those of the same two links together.
fn by_links(pairs: Vec<(usize, usize)>, capsules: &[Capsule]) -> Vec<Vec<(usize, usize)>> {
    let mut out: Vec<Vec<(usize, usize)>> = Vec::new();
    let links = |(a, b): (usize, usize)| (&capsules[a].frame, &capsules[b].frame);
    for pair in pairs {
        match out.iter_mut().find(|group| links(group[0]) == links(pair)) {
            Some(group) => group.push(pair),
            None => out.push(vec![pair]),
        }
    }
    out
}

/// Indices of the capsule pairs of two links that are given up, those near most often first, until enough poses have the
/// others apart.
fn hopeless(gaps: &[Vec<f64>]) -> Vec<usize> {
    let mut left: Vec<usize> = (0..gaps.len()).collect();
    let near_in = |k: usize| gaps[k].iter().filter(|gap| **gap <= ROUNDING).count();
    let is_apart = |left: &[usize], s: usize| left.iter().all(|k| gaps[*k][s] > ROUNDING);
    let apart = |left: &[usize]| (0..POSES).filter(|s| is_apart(left, *s)).count();
    while apart(&left) < (LEAST_APART * POSES as f64) as usize {
        let Some(place) = (0..left.len()).max_by_key(|place| near_in(left[*place])) else { break };
        left.remove(place);
    }
    (0..gaps.len()).filter(|k| !left.contains(k)).collect()
}

/// Ends on moving bodies, without those that are always where an end of at least their radius is.
fn outermost(poses: &Poses, points: &[BodyPoint], capsules: &[Capsule]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..points.len()).filter(|p| points[*p].body.is_some()).collect();
    order.sort_by(|a, b| capsules[b / 2].radius.total_cmp(&capsules[a / 2].radius));
    let mut out: Vec<usize> = Vec::new();
    for p in order {
        let is_at = |other: &usize| {
            (0..SAME_PLACE_POSES).all(|s| (poses.point(*other, s) - poses.point(p, s)).norm() < ROUNDING)
        };
        if !out.iter().any(is_at) {
            out.push(p);
        }
    }
    out.sort_unstable();
    out
}

/// Mean place of points over poses drawn as for [`screen`], and the farthest that one of them gets from the base, m.
///
/// Fails as [`Capsules::new`](super::Capsules::new).
pub fn mean_place(
    mechanism: &Mechanism,
    points: &[BodyPoint],
    ranges: &[(f64, f64)],
    closed: Option<&ClosedModel>,
) -> Result<(Vec3<f64>, f64), ConstraintError> {
    check_ranges(mechanism, ranges)?;
    let dynamics = Dynamics::new(mechanism);
    let clearance = Clearance::new(mechanism, &dynamics, ranges);
    let poses = Poses::new(&dynamics, &clearance, points, closed);
    let (mut sum, mut reach) = (Vec3::zero(), 0.0_f64);
    for (p, s) in (0..points.len()).flat_map(|p| (0..POSES).map(move |s| (p, s))) {
        sum = sum + poses.point(p, s);
        reach = reach.max(poses.point(p, s).norm());
    }
    Ok((sum.scale(1.0 / (points.len() * POSES).max(1) as f64), reach))
}

/// Where points are at poses drawn from the ranges.
struct Poses {
    /// Component `c` of point `p` at pose `s` at `(3 p + c) POSES + s`.
    positions: Vec<f64>,
}

impl Poses {
    fn new(
        dynamics: &Dynamics,
        clearance: &Clearance<'_>,
        points: &[BodyPoint],
        closed: Option<&ClosedModel>,
    ) -> Self {
        let rates = dynamics.rates();
        let q = match closed {
            Some(closed) => {
                closed.random_motion(POSES, SEED).with_block(|motion| closed.joint_motion(motion).q)
            }
            None => {
                let mut rng = ChaCha8Rng::seed_from_u64(SEED);
                let mut q = vec![0.0; rates * POSES];
                for s in 0..POSES {
                    for (k, x) in clearance.random_pose(&mut rng).into_iter().enumerate() {
                        q[k * POSES + s] = x;
                    }
                }
                q
            }
        };
        let mut positions = vec![0.0; 3 * points.len() * POSES];
        let still = vec![0.0; rates * POSES];
        dynamics.points(&MotionBlock::plain(POSES, &q, &still, &still), points, POSES, &mut positions);
        Poses { positions }
    }

    fn point(&self, point: usize, pose: usize) -> Vec3<f64> {
        Vec3([0, 1, 2].map(|c| self.positions[(3 * point + c) * POSES + pose]))
    }

    fn segment(&self, capsule: usize, pose: usize) -> Segment {
        [self.point(2 * capsule, pose), self.point(2 * capsule + 1, pose)]
    }

    /// Least and largest value of a figure over all poses.
    fn range(&self, figure: impl Fn(usize) -> f64) -> (f64, f64) {
        let values = (0..POSES).map(figure);
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
    }
}
