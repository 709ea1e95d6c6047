//! Distances between capsules on the robot.
//!
//! A capsule is all that lies within a radius of a segment. The distance of two segments is differentiable wherever its
//! closest points are unique, and then its gradient is that of the distance of these two points held on their bodies
//! (envelope theorem, Danskin 1967). Between nearly parallel segments closest points jump from end to end; pairs that
//! come near that get the four distances of end points from the other segment as further rows, so that a search sees all
//! of them at once.

use dynid_model::{BodyPoint, Dynamics, Mechanism, MotionBlock, Vec3};

use super::cartesian::{add_along, distance_row, resolve};
use super::clearance::Clearance;
use super::segment::{Closest, Segment, dot, end_distance, segment_distance};
use super::{
    ConstraintError, ConstraintKind, ConstraintRow, DISTANCE_SCALE, PathConstraint, at_poses, finite,
    fixed_base, positive,
};

/// All points within `radius` of the segment between two points of a link.
#[derive(Debug, Clone, PartialEq)]
pub struct Capsule {
    /// Name of the link; a link that is fixed to the ground stands for an obstacle.
    pub frame: String,
    /// Ends of the segment in the frame of the link, m; a sphere if they are equal.
    pub ends: [Vec3<f64>; 2],
    /// Radius, m.
    pub radius: f64,
}

/// Which capsules are kept apart.
#[derive(Debug, Clone, PartialEq)]
pub enum CapsulePairs {
    /// All on bodies that are not the same and not joined by one joint, without those pairs that provably cannot touch
    /// within the joint ranges.
    All,
    /// These, by index.
    Given(Vec<(usize, usize)>),
}

/// What a row measures.
#[derive(Debug, Clone, Copy)]
enum Measure {
    Segments,
    /// One of the four of [`end_distance`].
    End(usize),
}

/// Capsules kept apart: rows `(distance of segments - radii) / 0.5 m ≥ 0`, negative where capsules overlap.
#[derive(Debug, Clone)]
pub struct Capsules {
    dynamics: Dynamics,
    /// Ends of capsule `k`: points `2 k` and `2 k + 1`.
    points: Vec<BodyPoint>,
    pairs: Vec<(usize, usize)>,
    /// Sum of the radii of every pair.
    radii: Vec<f64>,
    /// Pair and measure of every row.
    measures: Vec<(usize, Measure)>,
    rows: Vec<ConstraintRow>,
    /// Distance beyond which a lower bound stands for it, m.
    far: f64,
    /// Half the length of every segment, m.
    halves: Vec<f64>,
}

/// Distance beyond which own links count as far from each other, m: no row of a search looks farther.
const FAR: f64 = 0.5 * DISTANCE_SCALE;

impl Capsules {
    /// Keeps capsules apart. `ranges`: lowest and highest position of every coordinate, rad or m (infinite where there is
    /// no limit); they decide which pairs can touch and which can be parallel, and bound nothing.
    ///
    /// Fails if a frame or capsule does not exist, a radius is not positive, a number is not finite, `ranges` has not one
    /// ordered pair per coordinate or a joint floats.
    pub fn new(
        mechanism: &Mechanism,
        capsules: &[Capsule],
        pairs: &CapsulePairs,
        ranges: &[(f64, f64)],
    ) -> Result<Self, ConstraintError> {
        check_ranges(mechanism, ranges)?;
        let mut out = Self::empty(mechanism, capsules)?;
        let candidates = match pairs {
            CapsulePairs::All => not_neighbours(mechanism, &out.points),
            CapsulePairs::Given(pairs) => {
                check_pairs(pairs, capsules.len())?;
                pairs.clone()
            }
        };
        let dynamics = out.dynamics.clone();
        let clearance = Clearance::new(mechanism, &dynamics, ranges);
        for pair in candidates {
            let (a, b) = pair;
            let radii = capsules[a].radius + capsules[b].radius;
            let ends = [2 * a, 2 * a + 1, 2 * b, 2 * b + 1].map(|p| out.points[p]);
            if *pairs == CapsulePairs::All && clearance.never_touch(&ends, radii) {
                continue;
            }
            let names = [&capsules[a].frame, &capsules[b].frame];
            out.push(ConstraintKind::Capsule, pair, radii, names);
            out.add_ends(names, clearance.nearly_parallel(&ends, radii));
        }
        Ok(out)
    }

    /// Keeps pairs of capsules on the links of a robot at least `margin` apart, m: rows
    /// `(distance of segments - radii - margin) / 0.5 m ≥ 0`. Beyond 0.25 m a lower bound stands for the distance.
    ///
    /// Fails as [`Capsules::new`].
    pub fn own_links(
        mechanism: &Mechanism,
        capsules: &[Capsule],
        pairs: &[(usize, usize)],
        margin: f64,
    ) -> Result<Self, ConstraintError> {
        finite("margin", "own links", &[margin])?;
        check_pairs(pairs, capsules.len())?;
        let mut out = Self::empty(mechanism, capsules)?;
        out.far = FAR;
        for pair in pairs {
            let (a, b) = (&capsules[pair.0], &capsules[pair.1]);
            out.push(ConstraintKind::OwnLinks, *pair, a.radius + b.radius + margin, [&a.frame, &b.frame]);
        }
        Ok(out)
    }

    /// Capsules without pairs.
    fn empty(mechanism: &Mechanism, capsules: &[Capsule]) -> Result<Self, ConstraintError> {
        let points = ends(mechanism, capsules)?;
        let half = |ends: &[BodyPoint]| 0.5 * (ends[1].position - ends[0].position).norm();
        Ok(Capsules {
            dynamics: Dynamics::new(mechanism),
            halves: points.chunks_exact(2).map(half).collect(),
            points,
            pairs: Vec::new(),
            radii: Vec::new(),
            measures: Vec::new(),
            rows: Vec::new(),
            far: f64::INFINITY,
        })
    }

    fn push(&mut self, kind: ConstraintKind, pair: (usize, usize), radii: f64, names: [&String; 2]) {
        self.measures.push((self.pairs.len(), Measure::Segments));
        self.pairs.push(pair);
        self.radii.push(radii);
        self.rows.push(distance_row(kind, format!("{} and {}", names[0], names[1])));
    }

    /// Rows of the ends of the pair that was added last, if its segments can be nearly parallel.
    fn add_ends(&mut self, names: [&String; 2], nearly_parallel: bool) {
        let index = self.pairs.len() - 1;
        let subject = format!("{} and {}", names[0], names[1]);
        if nearly_parallel {
            for end in 0..4 {
                self.measures.push((index, Measure::End(end)));
                let subject = format!("{subject}, end {} of {}", end % 2 + 1, names[end / 2]);
                self.rows.push(distance_row(ConstraintKind::Capsule, subject));
            }
        }
    }

    /// Pairs that are kept apart, by index of the capsules.
    pub fn pairs(&self) -> &[(usize, usize)] {
        &self.pairs
    }

    /// What two capsules are apart at least, by the spheres about their segments, if that is far.
    fn far_gap(&self, row: usize, ends: &[Vec3<f64>]) -> Option<f64> {
        let pair = self.measures[row].0;
        let (a, b) = self.pairs[pair];
        let between = ends[2 * a] + ends[2 * a + 1] - ends[2 * b] - ends[2 * b + 1];
        let reach = self.far + self.radii[pair] + self.halves[a] + self.halves[b];
        let squared = 0.25 * dot(between, between);
        (squared > reach * reach).then(|| squared.sqrt() - reach + self.far)
    }

    fn measure(&self, row: usize, segment: impl Fn(usize) -> Segment) -> (usize, Closest) {
        let (pair, measure) = self.measures[row];
        let (a, b) = self.pairs[pair];
        let (first, second) = (segment(a), segment(b));
        let closest = match measure {
            Measure::Segments => segment_distance(&first, &second),
            Measure::End(end) => end_distance(&first, &second, end),
        };
        (pair, closest)
    }
}

/// A range per coordinate, none of them turned round.
pub(super) fn check_ranges(mechanism: &Mechanism, ranges: &[(f64, f64)]) -> Result<(), ConstraintError> {
    fixed_base(mechanism.positions(), mechanism.rates())?;
    let (found, expected) = (ranges.len(), mechanism.rates());
    if found != expected {
        return Err(ConstraintError::Length { what: "position ranges", found, expected });
    }
    for ((low, high), name) in ranges.iter().zip(mechanism.rate_names()) {
        if low > high || low.is_nan() || high.is_nan() {
            let (what, expected) = ("width of the position range", "not negative");
            return Err(ConstraintError::Number { what, subject: name, found: high - low, expected });
        }
    }
    Ok(())
}

fn check_pairs(pairs: &[(usize, usize)], count: usize) -> Result<(), ConstraintError> {
    match pairs.iter().find(|(a, b)| a == b || *a >= count || *b >= count) {
        Some(pair) => Err(ConstraintError::Pair { pair: *pair, capsules: count }),
        None => Ok(()),
    }
}

/// Ends of capsules on the bodies of a mechanism, two each.
pub(super) fn ends(mechanism: &Mechanism, capsules: &[Capsule]) -> Result<Vec<BodyPoint>, ConstraintError> {
    fixed_base(mechanism.positions(), mechanism.rates())?;
    let mut points = Vec::with_capacity(2 * capsules.len());
    for capsule in capsules {
        positive("radius of a capsule", &capsule.frame, capsule.radius)?;
        for end in capsule.ends {
            points.push(resolve(mechanism, &capsule.frame, end)?);
        }
    }
    Ok(points)
}

/// Pairs on bodies that are neither one nor joined by one joint.
pub(super) fn not_neighbours(mechanism: &Mechanism, points: &[BodyPoint]) -> Vec<(usize, usize)> {
    let parent = |body: Option<usize>| body.and_then(|b| mechanism.bodies()[b].parent);
    let joined = |a: Option<usize>, b: Option<usize>| {
        a == b || (a.is_some() && parent(a) == b) || (b.is_some() && parent(b) == a)
    };
    let count = points.len() / 2;
    (0..count)
        .flat_map(|a| (a + 1..count).map(move |b| (a, b)))
        .filter(|(a, b)| !joined(points[2 * a].body, points[2 * b].body))
        .collect()
}

impl PathConstraint for Capsules {
    fn rows(&self) -> &[ConstraintRow] {
        &self.rows
    }

    fn values(&self, motion: &MotionBlock<'_>, stride: usize, values: &mut [f64]) {
        let n = motion.samples;
        let mut positions = vec![0.0; 3 * self.points.len() * n];
        self.dynamics.points(motion, &self.points, n, &mut positions);
        let mut ends = vec![Vec3::zero(); self.points.len()];
        for s in 0..n {
            for (p, end) in ends.iter_mut().enumerate() {
                *end = Vec3([0, 1, 2].map(|c| positions[(3 * p + c) * n + s]));
            }
            for row in 0..self.rows.len() {
                let gap = self.far_gap(row, &ends).unwrap_or_else(|| {
                    let (pair, closest) = self.measure(row, |k| [ends[2 * k], ends[2 * k + 1]]);
                    closest.distance - self.radii[pair]
                });
                values[row * stride + s] = gap / DISTANCE_SCALE;
            }
        }
    }

    fn gradients(&self, motion: &MotionBlock<'_>, wanted: &[(usize, usize)], out: &mut [f64]) {
        let n = self.dynamics.rates();
        assert_eq!(out.len(), 3 * n * wanted.len(), "length of the gradients");
        out.fill(0.0);
        at_poses(&self.dynamics, &self.points, motion, wanted, |k, row, ends, jacobians| {
            let (pair, closest) = self.measure(row, |k| [ends[2 * k], ends[2 * k + 1]]);
            let (a, b) = self.pairs[pair];
            let gradient = &mut out[3 * n * k..][..n];
            for (capsule, share, sign) in [(a, closest.shares[0], 1.0), (b, closest.shares[1], -1.0)] {
                for (point, part) in [(2 * capsule, 1.0 - share), (2 * capsule + 1, share)] {
                    let jacobian = &jacobians[3 * n * point..][..3 * n];
                    add_along(jacobian, closest.direction.scale(sign * part / DISTANCE_SCALE), gradient);
                }
            }
        });
    }
}
