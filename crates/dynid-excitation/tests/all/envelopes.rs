//! Capsules about shapes and surfaces, and what of them can be kept apart.

use dynid_excitation::constraint::{Capsule, ConstraintKind, Plane, screen};
use dynid_excitation::envelope::{Envelope, Triangle, chain_capsules, chain_radius};
use dynid_model::Vec3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::plain_urdf;

/// How far a point is outside a capsule; the segment is walked in small steps.
fn outside(e: &Envelope, p: Vec3<f64>) -> f64 {
    const STEPS: usize = 2000;
    let at = |k: usize| (e.ends[1] - e.ends[0]).scale_add(k as f64 / STEPS as f64, e.ends[0]);
    (0..=STEPS).map(|k| (at(k) - p).norm()).fold(f64::INFINITY, f64::min) - e.radius
}

/// What walking the segment in steps may miss.
fn blur(e: &Envelope) -> f64 {
    let step = (e.ends[1] - e.ends[0]).norm() / 2000.0;
    step * step / e.radius + 1e-9
}

fn least_outside(capsules: &[Envelope], p: Vec3<f64>) -> f64 {
    capsules.iter().map(|e| outside(e, p) - blur(e)).fold(f64::INFINITY, f64::min)
}

/// Triangles of a tube of radius `r` along a path.
fn tube(path: &[Vec3<f64>], r: f64) -> Vec<Triangle> {
    const SIDES: usize = 16;
    let mut out = Vec::new();
    for leg in path.windows(2) {
        let along = leg[1] - leg[0];
        let along = along.scale(1.0 / along.norm());
        let other = if along.0[0].abs() < 0.6 { Vec3([1.0, 0.0, 0.0]) } else { Vec3([0.0, 1.0, 0.0]) };
        let u = along.cross(other);
        let u = u.scale(1.0 / u.norm());
        let v = along.cross(u);
        let rim = |center: Vec3<f64>, k: usize| {
            let a = std::f64::consts::TAU * k as f64 / SIDES as f64;
            center + u.scale(r * a.cos()) + v.scale(r * a.sin())
        };
        for k in 0..SIDES {
            let (a, b) = (rim(leg[0], k), rim(leg[0], k + 1));
            let (c, d) = (rim(leg[1], k), rim(leg[1], k + 1));
            out.extend([[a, b, c], [b, c, d]]);
        }
    }
    out
}

#[test]
fn capsules_hold_every_point_of_a_surface() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let bent = [[0.0, 0.0, 0.0], [0.0, 0.0, 0.6], [0.0, 0.4, 0.6], [0.3, 0.4, 0.6]].map(Vec3);
    let straight = [[0.1, 0.2, -0.3], [0.4, 0.6, 0.1]].map(Vec3);
    let flat: Vec<Triangle> = vec![[[0.0, 0.0, 0.0], [0.3, 0.0, 0.0], [0.0, 0.2, 0.0]].map(Vec3)];
    let cloud: Vec<Triangle> = (0..400)
        .map(|_| std::array::from_fn(|_| Vec3(std::array::from_fn(|_| rng.random_range(-0.2..0.3)))))
        .collect();
    for (name, surface) in
        [("bent", tube(&bent, 0.05)), ("straight", tube(&straight, 0.05)), ("flat", flat), ("cloud", cloud)]
    {
        let capsules = Envelope::of_surface(&surface);
        println!("{name}: {} capsules", capsules.len());
        assert!((1..=4).contains(&capsules.len()), "{name}");
        for triangle in &surface {
            for corner in triangle {
                assert!(least_outside(&capsules, *corner) <= 0.0, "{name}: {corner:?}");
            }
            // Points within the triangle too, whichever capsules hold its corners.
            for _ in 0..5 {
                let (a, b): (f64, f64) = (rng.random_range(0.0..1.0), rng.random_range(0.0..1.0));
                let (a, b) = if a + b > 1.0 { (1.0 - a, 1.0 - b) } else { (a, b) };
                let [p, q, r] = *triangle;
                let inside = p + (q - p).scale(a) + (r - p).scale(b);
                assert!(least_outside(&capsules, inside) <= 0.0, "{name}: {inside:?}");
            }
        }
    }
}

/// A straight tube needs one capsule, hardly larger than itself; a bent one more, which together are far smaller than one.
#[test]
fn capsules_are_slender() {
    let straight = [[0.1, 0.2, -0.3], [0.4, 0.6, 0.1]].map(Vec3);
    let length = (straight[1] - straight[0]).norm();
    let capsules = Envelope::of_surface(&tube(&straight, 0.05));
    assert_eq!(capsules.len(), 1);
    let tight = std::f64::consts::PI * 0.05_f64.powi(2) * (length + 4.0 / 3.0 * 0.05);
    // Axes are found to 2e-3 rad, which at the ends, 0.32 m away, is 1.3 % of the radius and 2.6 % of the volume.
    assert!(capsules[0].volume() <= 1.03 * tight, "{} {tight}", capsules[0].volume());
    let bent = tube(&[[0.0, 0.0, 0.0], [0.0, 0.0, 0.6], [0.0, 0.6, 0.6]].map(Vec3), 0.05);
    let several: f64 = Envelope::of_surface(&bent).iter().map(Envelope::volume).sum();
    // One capsule about an elbow is at least a tube about its three corners.
    let one = std::f64::consts::PI * 0.2_f64.powi(2) * 0.8;
    assert!(several < 0.4 * one, "{several} {one}");
}

#[test]
fn primitives_lie_within_their_capsules() {
    for (radius, length) in [(0.05, 0.5), (0.2, 0.1), (0.1, 0.1), (0.3, 1e-3)] {
        let e = [Envelope::of_cylinder(radius, length)];
        for k in 0..64 {
            let a = std::f64::consts::TAU * f64::from(k) / 64.0;
            for z in [-0.5 * length, 0.5 * length] {
                let rim = Vec3([radius * a.cos(), radius * a.sin(), z]);
                assert!(least_outside(&e, rim) <= 0.0, "{radius} {length}");
            }
        }
        let around =
            Envelope { ends: [Vec3([0.0, 0.0, -0.5 * length]), Vec3([0.0, 0.0, 0.5 * length])], radius };
        assert!(e[0].volume() <= around.volume() * (1.0 + 1e-12));
    }
    for size in [[0.1, 0.2, 0.3], [1.0, 0.02, 0.02], [0.5, 0.5, 0.01]] {
        let capsules = Envelope::of_box(size);
        for k in 0..8 {
            let corner = Vec3(std::array::from_fn(|c| if k >> c & 1 == 1 { 0.5 } else { -0.5 } * size[c]));
            assert!(least_outside(&capsules, corner) <= 0.0, "{size:?}");
        }
    }
    assert_eq!(Envelope::of_sphere(0.2), Envelope { ends: [Vec3::zero(); 2], radius: 0.2 });
    assert!(Envelope::of_surface(&[]).is_empty());
}

/// The UR10 along its chain: what is given up is near at poses that the screening did not draw.
#[test]
fn screening_gives_up_what_is_nearly_always_near() {
    let Some(mechanism) = plain_urdf::ur10() else { return };
    let radius = chain_radius(&mechanism).unwrap();
    let bodies = std::iter::once(None).chain((0..mechanism.bodies().len()).map(Some));
    let capsules: Vec<Capsule> = bodies.flat_map(|b| chain_capsules(&mechanism, b, radius)).collect();
    let ranges = vec![(-2.0, 2.0); mechanism.rates()];
    let up = Plane { kind: ConstraintKind::Floor, normal: Vec3([0.0, 0.0, 1.0]), height: 0.0 };
    let margin = 0.02;
    let screened = screen(&mechanism, &capsules, &[up], margin, &ranges, None).unwrap();
    assert!(!screened.pairs.is_empty() && !screened.always_near.is_empty(), "{screened:?}");
    let dynamics = dynid_model::Dynamics::new(&mechanism);
    let mut work = dynamics.workspace();
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let placed = |k: usize, end: usize, frames: &[dynid_model::Placement]| {
        let frame = mechanism.frame(&capsules[k].frame).unwrap();
        let local = frame.placement.rotation.mul_vec(capsules[k].ends[end]) + frame.placement.translation;
        frame.body.map_or(local, |b| frames[b].rotation.mul_vec(local) + frames[b].translation)
    };
    let total = capsules.len();
    let mut near = vec![0; screened.always_near.len()];
    for _ in 0..500 {
        let q: Vec<f64> = ranges.iter().map(|(low, high)| rng.random_range(*low..*high)).collect();
        let frames = dynamics.forward_kinematics(&q, &mut work);
        let gap = |a: usize, b: usize| {
            let e = Envelope { ends: [0, 1].map(|end| placed(b, end, &frames)), radius: 0.0 };
            let (from, to) = (placed(a, 0, &frames), placed(a, 1, &frames));
            let nearest = (0..=50)
                .map(|k| outside(&e, (to - from).scale_add(f64::from(k) / 50.0, from)))
                .fold(f64::INFINITY, f64::min);
            nearest - capsules[a].radius - capsules[b].radius
        };
        for (count, (a, b)) in near.iter_mut().zip(&screened.always_near) {
            *count += usize::from(gap(*a, *b) <= margin);
        }
        for (k, end) in &screened.planes[0].always_low {
            assert!(placed(*k, *end, &frames).0[2] <= radius + margin + 1e-9);
        }
    }
    // 95 of 100 poses of the screening: within three deviations of that on others.
    assert!(near.iter().all(|count| *count >= 460), "{near:?}");
    assert!(screened.pairs.iter().all(|(a, b)| *a < total && *b < total));
}
