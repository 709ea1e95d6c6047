//! Closest points of line segments.
//!
//! The squared distance of two segments is a convex quadratic over the unit square, so its minimum lies inside, where
//! both lines are closest, or on an edge: the distance of an end point from the other segment.

use dynid_model::Vec3;

/// Squared sine below which two directions count as parallel; what an edge may then miss is 1e-7 of a length.
const PARALLEL: f64 = 1e-14;
/// Distance below which its direction is not defined, m.
const TOUCHING: f64 = 1e-12;

/// Closest points of two segments, as shares of the way from their first to their second ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Closest {
    pub(super) distance: f64,
    pub(super) shares: [f64; 2],
    /// Unit vector from the second to the first closest point; zero where they touch.
    pub(super) direction: Vec3<f64>,
}

/// A segment by its ends.
pub(super) type Segment = [Vec3<f64>; 2];

/// Inner product. That of [`Vec3`] rounds once per term, which costs a call where the instruction set of all processors has no such
/// instruction, and distances are formed by the million.
pub(super) fn dot(a: Vec3<f64>, b: Vec3<f64>) -> f64 {
    a.0[0] * b.0[0] + a.0[1] * b.0[1] + a.0[2] * b.0[2]
}

fn point_at([a, b]: &Segment, share: f64) -> Vec3<f64> {
    *a + (*b - *a).scale(share)
}

fn between(first: &Segment, second: &Segment, shares: [f64; 2]) -> Closest {
    let gap = point_at(first, shares[0]) - point_at(second, shares[1]);
    let distance = dot(gap, gap).sqrt();
    let direction = if distance > TOUCHING { gap.scale(1.0 / distance) } else { Vec3::zero() };
    Closest { distance, shares, direction }
}

/// Share of the point of a segment that is closest to a point.
fn nearest_share(segment: &Segment, point: Vec3<f64>) -> f64 {
    let along = segment[1] - segment[0];
    let squared = dot(along, along);
    if squared > 0.0 { (dot(point - segment[0], along) / squared).clamp(0.0, 1.0) } else { 0.0 }
}

/// An end point of one segment against the other segment: ends 0 and 1 of the first, then those of the second.
pub(super) fn end_distance(first: &Segment, second: &Segment, end: usize) -> Closest {
    between(first, second, end_shares(first, second, end))
}

fn end_shares(first: &Segment, second: &Segment, end: usize) -> [f64; 2] {
    let share = (end % 2) as f64;
    match end / 2 {
        0 => [share, nearest_share(second, first[end % 2])],
        _ => [nearest_share(first, second[end % 2]), share],
    }
}

/// Distance of two segments.
pub(super) fn segment_distance(first: &Segment, second: &Segment) -> Closest {
    let (d1, d2, gap) = (first[1] - first[0], second[1] - second[0], first[0] - second[0]);
    let (a, b, e) = (dot(d1, d1), dot(d1, d2), dot(d2, d2));
    let (c, f) = (dot(d1, gap), dot(d2, gap));
    let determinant = a * e - b * b;
    if determinant > PARALLEL * a * e {
        // The second share from the first: both from the determinant would miss the minimum between nearly parallel lines.
        let share = (b * f - c * e) / determinant;
        let shares = [share, (f + b * share) / e];
        if shares.iter().all(|s| (0.0..=1.0).contains(s)) {
            return between(first, second, shares);
        }
    }
    let mut best = ([0.0; 2], f64::INFINITY);
    for end in 0..4 {
        let shares = end_shares(first, second, end);
        let gap = point_at(first, shares[0]) - point_at(second, shares[1]);
        let squared = dot(gap, gap);
        if squared < best.1 {
            best = (shares, squared);
        }
    }
    between(first, second, best.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// The minimum of a convex function over the unit square: no descent along either share.
    #[track_caller]
    fn check_minimal(first: &Segment, second: &Segment) {
        let found = segment_distance(first, second);
        let gap = point_at(first, found.shares[0]) - point_at(second, found.shares[1]);
        assert!((gap.norm() - found.distance).abs() <= 1e-15);
        let slopes = [gap.dot(first[1] - first[0]), -gap.dot(second[1] - second[0])];
        for (share, slope) in found.shares.into_iter().zip(slopes) {
            assert!((0.0..=1.0).contains(&share));
            assert!(share == 0.0 || slope <= 1e-12, "{found:?} {slope}");
            assert!(share == 1.0 || slope >= -1e-12, "{found:?} {slope}");
        }
        let length = found.direction.norm();
        assert!((length - 1.0).abs() < 1e-14 || (length == 0.0 && found.distance <= TOUCHING));
    }

    #[test]
    fn closest_points_are_minimal() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        for k in 0..20_000 {
            let mut point = || Vec3(std::array::from_fn(|_| rng.random_range(-1.0..=1.0)));
            let (a, b, c, d) = (point(), point(), point(), point());
            let second = match k % 4 {
                // Parallel, nearly parallel, a point, anything.
                0 => [c, c + (b - a).scale(0.7)],
                1 => [c, c + (b - a).scale(-0.7) + d.scale(1e-6)],
                2 => [c, c],
                _ => [c, d],
            };
            check_minimal(&[a, b], &second);
            check_minimal(&second, &[a, b]);
        }
    }

    #[test]
    fn known_distances() {
        let z = |x: f64, y: f64, z: f64| Vec3([x, y, z]);
        let along = [z(0.0, 0.0, 0.0), z(1.0, 0.0, 0.0)];
        let distance = |second: Segment| segment_distance(&along, &second).distance;
        assert_eq!(distance([z(0.5, -1.0, 2.0), z(0.5, 1.0, 2.0)]), 2.0);
        assert_eq!(distance([z(4.0, 4.0, 0.0), z(4.0, 9.0, 0.0)]), 5.0);
        assert_eq!(distance([z(0.2, 0.5, 0.0), z(3.0, 0.5, 0.0)]), 0.5);
        assert_eq!(distance([z(0.5, -1.0, 0.0), z(0.5, 1.0, 0.0)]), 0.0);
        assert_eq!(distance([z(0.0, 3.0, 4.0), z(0.0, 3.0, 4.0)]), 5.0);
    }
}
