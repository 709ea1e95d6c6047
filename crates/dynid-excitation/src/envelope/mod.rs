//! Capsules about the links of a robot: from shapes, from surfaces, or along the chain of joints where nothing is known.

mod bounding;
mod chain;
mod surface;

pub use chain::{chain_capsules, chain_radius};
pub use surface::Triangle;

use dynid_model::Vec3;

/// All points within a radius of a segment, in the frame of what it holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Envelope {
    /// Ends of the segment, m.
    pub ends: [Vec3<f64>; 2],
    /// Radius, m.
    pub radius: f64,
}

impl Envelope {
    /// Volume, m³.
    pub fn volume(&self) -> f64 {
        let length = (self.ends[1] - self.ends[0]).norm();
        std::f64::consts::PI * self.radius * self.radius * (length + 4.0 / 3.0 * self.radius)
    }

    /// The capsule about a sphere: the sphere.
    pub fn of_sphere(radius: f64) -> Envelope {
        Envelope { ends: [Vec3::zero(); 2], radius }
    }

    /// The smallest capsule about a cylinder of a length along z that shares its axis.
    pub fn of_cylinder(radius: f64, length: f64) -> Envelope {
        const STEPS: usize = 100;
        let half = 0.5 * length;
        // Rims lie on the round ends: a segment shorter by `cut` on both sides takes the radius √(r² + cut²).
        let with = |k: usize| {
            let cut = half * k as f64 / STEPS as f64;
            let end = Vec3([0.0, 0.0, half - cut]);
            Envelope { ends: [-end, end], radius: radius.hypot(cut) }
        };
        let smaller = |a: Envelope, b: Envelope| if b.volume() < a.volume() { b } else { a };
        (1..=STEPS).map(with).fold(with(0), smaller)
    }

    /// Capsules about a box with these edge lengths.
    pub fn of_box(size: [f64; 3]) -> Vec<Envelope> {
        let corner =
            |k: usize| Vec3(std::array::from_fn(|c| if k >> c & 1 == 1 { 0.5 } else { -0.5 } * size[c]));
        const FACES: [[usize; 4]; 6] =
            [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
        let halves = FACES.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]);
        Self::of_surface(&halves.map(|t| t.map(corner)).collect::<Vec<Triangle>>())
    }

    /// Capsules that together hold all triangles: one, or up to four where that is much less than one. Empty without
    /// triangles.
    pub fn of_surface(triangles: &[Triangle]) -> Vec<Envelope> {
        surface::surface_capsules(triangles)
    }
}
