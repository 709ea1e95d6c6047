//! Several capsules about a surface, where one would be much larger than what it holds.

use dynid_model::Vec3;

use super::Envelope;
use super::bounding::{bounding_capsule, rough_volume, supports};

/// A triangle by its corners, m.
pub type Triangle = [Vec3<f64>; 3];

/// Most capsules about one surface.
const MOST: usize = 4;
/// A cut must save this share of the volume of all capsules.
const LEAST_GAIN: f64 = 0.12;
/// Shares of the extent at which cuts are tried.
const CUTS: [f64; 5] = [0.2, 0.35, 0.5, 0.65, 0.8];
/// Long triangles are cut into parts of this share of the extent, so that a cut can pass between them.
const FINENESS: f64 = 0.08;
/// Triangles beyond which none are cut further.
const ENOUGH: usize = 60_000;

/// Capsules that together hold every triangle, each triangle (or part of it) in one of them.
pub(super) fn surface_capsules(triangles: &[Triangle]) -> Vec<Envelope> {
    let Some(first) = Part::new(fine(triangles)) else { return Vec::new() };
    let mut parts = vec![first];
    while parts.len() < MOST {
        let whole: f64 = parts.iter().map(|p| p.capsule.volume()).sum();
        let cuts = parts.iter().enumerate().filter_map(|(k, part)| Some((k, part.best_cut()?)));
        let gain = |k: usize, halves: &[Part; 2]| {
            parts[k].capsule.volume() - halves.iter().map(|h| h.capsule.volume()).sum::<f64>()
        };
        let best = cuts.max_by(|a, b| gain(a.0, &a.1).total_cmp(&gain(b.0, &b.1)));
        match best {
            Some((k, halves)) if gain(k, &halves) > LEAST_GAIN * whole => {
                let [first, second] = halves;
                parts[k] = first;
                parts.push(second);
            }
            _ => break,
        }
    }
    parts.into_iter().map(|p| p.capsule).collect()
}

/// Triangles and the capsule about them.
struct Part {
    triangles: Vec<Triangle>,
    capsule: Envelope,
}

impl Part {
    fn new(triangles: Vec<Triangle>) -> Option<Part> {
        let points: Vec<Vec3<f64>> = triangles.iter().flatten().copied().collect();
        bounding_capsule(&points).map(|capsule| Part { triangles, capsule })
    }

    /// The cut by a plane that leaves the smallest two capsules.
    fn best_cut(&self) -> Option<[Part; 2]> {
        let along = self.capsule.ends[1] - self.capsule.ends[0];
        let length = along.norm();
        let mut normals = vec![Vec3([1.0, 0.0, 0.0]), Vec3([0.0, 1.0, 0.0]), Vec3([0.0, 0.0, 1.0])];
        if length > 0.0 {
            normals.push(along.scale(1.0 / length));
        }
        let mut best: Option<(f64, Vec<bool>)> = None;
        for normal in normals {
            let heights: Vec<f64> =
                self.triangles.iter().map(|t| t.iter().map(|p| normal.dot(*p)).sum::<f64>() / 3.0).collect();
            let low = heights.iter().fold(f64::INFINITY, |m, h| m.min(*h));
            let high = heights.iter().fold(f64::NEG_INFINITY, |m, h| m.max(*h));
            for share in CUTS {
                let at = low + share * (high - low);
                let above: Vec<bool> = heights.iter().map(|h| *h > at).collect();
                let volume: f64 = [true, false]
                    .map(|side| {
                        let points: Vec<Vec3<f64>> = self.side(&above, side).flatten().copied().collect();
                        rough_volume(&supports(&points))
                    })
                    .iter()
                    .sum();
                if best.as_ref().is_none_or(|b| volume < b.0) {
                    best = Some((volume, above));
                }
            }
        }
        let (_, above) = best?;
        let half = |side| Part::new(self.side(&above, side).copied().collect());
        Some([half(true)?, half(false)?])
    }

    fn side<'a>(&'a self, above: &'a [bool], side: bool) -> impl Iterator<Item = &'a Triangle> {
        self.triangles.iter().zip(above).filter(move |(_, a)| **a == side).map(|(t, _)| t)
    }
}

/// The same surface with triangles that are short against its extent.
fn fine(triangles: &[Triangle]) -> Vec<Triangle> {
    let corner = |pick: fn(f64, f64) -> f64, from: f64| {
        let points = triangles.iter().flatten();
        points.fold([from; 3], |m, p| std::array::from_fn(|c| pick(m[c], p.0[c])))
    };
    let (low, high) = (corner(f64::min, f64::INFINITY), corner(f64::max, f64::NEG_INFINITY));
    let longest = FINENESS * (Vec3(high) - Vec3(low)).norm();
    let mut waiting = triangles.to_vec();
    let mut out = Vec::with_capacity(waiting.len());
    while let Some(t) = waiting.pop() {
        let edge = |k: usize| (t[(k + 1) % 3] - t[k]).norm();
        let k = (0..3).max_by(|a, b| edge(*a).total_cmp(&edge(*b))).unwrap_or(0);
        if edge(k) <= longest || out.len() + waiting.len() >= ENOUGH {
            out.push(t);
            continue;
        }
        let (a, b, c) = (t[k], t[(k + 1) % 3], t[(k + 2) % 3]);
        let middle = (a + b).scale(0.5);
        waiting.push([a, middle, c]);
        waiting.push([middle, b, c]);
    }
    out
}
