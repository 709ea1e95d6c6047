//! The slenderest capsule about a set of points.
//!
//! For a given axis the least radius is that of the smallest circle about the points seen along it (Welzl 1991); a somewhat
//! larger radius may allow a shorter segment, since ends are round. Axes are tried on a grid of directions, and the best
//! ones refined.

use dynid_model::Vec3;

use super::Envelope;

/// Directions on a half sphere that are tried first.
const DIRECTIONS: usize = 60;
/// Of these, so many are refined.
const REFINED: usize = 3;
/// Points that stand for larger sets while axes are compared: those that lie farthest in so many directions.
const SUPPORTS: usize = 250;
/// Radii that are tried, in steps of the least one.
const RADII: usize = 12;
const RADIUS_STEP: f64 = 0.04;
/// First and last step of the refinement, rad.
const FIRST_STEP: f64 = 0.2;
const LAST_STEP: f64 = 2e-3;
/// What rounding may leave outside, m.
const ROUNDING: f64 = 1e-9;

/// The capsule of least volume that was found about all points. `None` without points.
pub(super) fn bounding_capsule(points: &[Vec3<f64>]) -> Option<Envelope> {
    let few = supports(points);
    let mut tried: Vec<(f64, Vec3<f64>)> =
        half_sphere(DIRECTIONS).map(|axis| (about(&few, axis).volume(), axis)).collect();
    tried.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (_, axis) = tried
        .into_iter()
        .take(REFINED)
        .map(|(volume, axis)| refined(&few, axis, volume))
        .min_by(|a, b| a.0.total_cmp(&b.0))?;
    points.first().map(|_| about(points, axis))
}

/// As [`bounding_capsule`], on few directions: to compare ways of cutting.
pub(super) fn rough_volume(points: &[Vec3<f64>]) -> f64 {
    if points.is_empty() {
        return 0.0;
    }
    half_sphere(DIRECTIONS / 3).map(|axis| about(points, axis).volume()).fold(f64::INFINITY, f64::min)
}

/// Points that lie farthest in many directions.
pub(super) fn supports(points: &[Vec3<f64>]) -> Vec<Vec3<f64>> {
    if points.len() <= SUPPORTS {
        return points.to_vec();
    }
    let mut chosen: Vec<usize> = half_sphere(SUPPORTS / 2)
        .flat_map(|axis| [axis, -axis])
        .filter_map(|axis| {
            (0..points.len()).max_by(|a, b| axis.dot(points[*a]).total_cmp(&axis.dot(points[*b])))
        })
        .collect();
    chosen.sort_unstable();
    chosen.dedup();
    chosen.into_iter().map(|k| points[k]).collect()
}

/// Directions spread evenly over a half sphere (Fibonacci's spiral), the axes of the frame first.
fn half_sphere(count: usize) -> impl Iterator<Item = Vec3<f64>> {
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let axes = [Vec3([1.0, 0.0, 0.0]), Vec3([0.0, 1.0, 0.0]), Vec3([0.0, 0.0, 1.0])];
    axes.into_iter().chain((0..count).map(move |k| {
        let z = (k as f64 + 0.5) / count as f64;
        let (across, angle) = ((1.0 - z * z).sqrt(), golden * k as f64);
        Vec3([across * angle.cos(), across * angle.sin(), z])
    }))
}

/// Turns an axis as long as that makes the capsule smaller.
fn refined(points: &[Vec3<f64>], mut axis: Vec3<f64>, mut volume: f64) -> (f64, Vec3<f64>) {
    let mut step = FIRST_STEP;
    while step > LAST_STEP {
        let [u, v] = across(axis);
        let better = [u, -u, v, -v].into_iter().find_map(|side| {
            let turned = unit(side.scale_add(step, axis));
            let found = about(points, turned).volume();
            (found < volume).then_some((found, turned))
        });
        match better {
            Some((found, turned)) => (volume, axis) = (found, turned),
            None => step *= 0.5,
        }
    }
    (volume, axis)
}

/// The best capsule with a given axis.
fn about(points: &[Vec3<f64>], axis: Vec3<f64>) -> Envelope {
    let [u, v] = across(axis);
    let flat: Vec<[f64; 2]> = points.iter().map(|p| [u.dot(*p), v.dot(*p)]).collect();
    let center = smallest_circle(&flat);
    let distances: Vec<f64> = flat.iter().map(|p| (p[0] - center[0]).hypot(p[1] - center[1])).collect();
    let least = distances.iter().fold(0.0, |m: f64, d| m.max(*d)) + ROUNDING;
    let heights: Vec<f64> = points.iter().map(|p| axis.dot(*p)).collect();
    let origin = u.scale(center[0]) + v.scale(center[1]);
    let with = |radius: f64| {
        // A point at distance ρ from the axis needs an end of the segment no farther than √(R² - ρ²) below or above.
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for (t, d) in heights.iter().zip(&distances) {
            let reach = (radius * radius - d * d).max(0.0).sqrt();
            low = low.min(t + reach);
            high = high.max(t - reach);
        }
        if low > high {
            (low, high) = (0.5 * (low + high), 0.5 * (low + high));
        }
        Envelope {
            ends: [axis.scale_add(low, origin), axis.scale_add(high, origin)],
            radius: radius + ROUNDING,
        }
    };
    let mut best = with(least);
    for k in 1..RADII {
        let other = with(least * (1.0 + RADIUS_STEP * k as f64));
        if other.volume() < best.volume() {
            best = other;
        }
    }
    best
}

fn unit(v: Vec3<f64>) -> Vec3<f64> {
    v.scale(1.0 / v.norm())
}

/// Two unit vectors across an axis and each other.
fn across(axis: Vec3<f64>) -> [Vec3<f64>; 2] {
    let least = (0..3).min_by(|a, b| axis.0[*a].abs().total_cmp(&axis.0[*b].abs())).unwrap_or(0);
    let mut other = Vec3::zero();
    other.0[least] = 1.0;
    let u = unit(axis.cross(other));
    [u, axis.cross(u)]
}

/// Centre of the smallest circle about points, by adding one after another.
fn smallest_circle(points: &[[f64; 2]]) -> [f64; 2] {
    let Some(first) = points.first() else { return [0.0; 2] };
    let outside = |c: &([f64; 2], f64), p: &[f64; 2]| (p[0] - c.0[0]).hypot(p[1] - c.0[1]) > c.1 + 1e-12;
    let mut circle = (*first, 0.0);
    for (i, p) in points.iter().enumerate() {
        if !outside(&circle, p) {
            continue;
        }
        circle = (*p, 0.0);
        for (j, q) in points[..i].iter().enumerate() {
            if !outside(&circle, q) {
                continue;
            }
            circle = by_diameter(p, q);
            for r in &points[..j] {
                if outside(&circle, r) {
                    circle = through(p, q, r);
                }
            }
        }
    }
    circle.0
}

fn by_diameter(p: &[f64; 2], q: &[f64; 2]) -> ([f64; 2], f64) {
    let center = [0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1])];
    (center, 0.5 * (p[0] - q[0]).hypot(p[1] - q[1]))
}

/// The circle through three points; of three on a line that of the two farthest from each other.
fn through(p: &[f64; 2], q: &[f64; 2], r: &[f64; 2]) -> ([f64; 2], f64) {
    let (b, c) = ([q[0] - p[0], q[1] - p[1]], [r[0] - p[0], r[1] - p[1]]);
    let twice = 2.0 * (b[0] * c[1] - b[1] * c[0]);
    let (bb, cc) = (b[0] * b[0] + b[1] * b[1], c[0] * c[0] + c[1] * c[1]);
    if twice.abs() <= 1e-14 * (bb + cc) {
        let pairs = [by_diameter(p, q), by_diameter(p, r), by_diameter(q, r)];
        return pairs.into_iter().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((*p, 0.0));
    }
    let from = [(c[1] * bb - b[1] * cc) / twice, (b[0] * cc - c[0] * bb) / twice];
    ([p[0] + from[0], p[1] + from[1]], from[0].hypot(from[1]))
}
