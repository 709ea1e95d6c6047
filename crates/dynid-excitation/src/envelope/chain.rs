//! Capsules along the chain of joints: what can be said of a robot whose file has no shapes.

use dynid_model::{Mechanism, Vec3};

use crate::constraint::Capsule;

/// Radius of links in shares of the length of the chain: arms of 1 to 2 m come out at 55 to 100 mm.
const SLENDERNESS: f64 = 0.055;
/// Distance below which two points are one, m.
const SAME: f64 = 1e-6;

/// Radius of capsules along the chain, m: 0.055 of the length of the longest branch, the sum of the distances from joint to
/// joint. How far the first joint is from the base counts if nothing else does. `None` if all joints are at one place.
pub fn chain_radius(mechanism: &Mechanism) -> Option<f64> {
    let longest =
        if length(mechanism, false) > SAME { length(mechanism, false) } else { length(mechanism, true) };
    (longest > SAME).then_some(SLENDERNESS * longest)
}

/// Length of the longest branch, with or without the way from the base to its first joint.
fn length(mechanism: &Mechanism, with_base: bool) -> f64 {
    let bodies = mechanism.bodies();
    let of = |tip: usize| {
        let up = std::iter::successors(Some(tip), |b| bodies[*b].parent);
        let counted = up.filter(|b| with_base || bodies[*b].parent.is_some());
        counted.map(|b| bodies[b].joint.placement.translation.norm()).sum::<f64>()
    };
    (0..bodies.len()).map(of).fold(0.0, f64::max)
}

/// Capsules from the origin of a body (`None`: the base) to every joint that hangs on it; of the last body of a branch to
/// the farthest link that is fixed to it, else to twice its centre of mass. Empty where all these points are one.
pub fn chain_capsules(mechanism: &Mechanism, body: Option<usize>, radius: f64) -> Vec<Capsule> {
    let bodies = mechanism.bodies();
    let children = bodies.iter().filter(|b| b.parent == body);
    let mut ends: Vec<Vec3<f64>> = children.map(|b| b.joint.placement.translation).collect();
    if let (true, Some(b)) = (ends.is_empty(), body) {
        let fixed = bodies[b].fixed_links.iter().map(|l| l.placement.translation);
        let farthest = fixed.max_by(|a, b| a.norm().total_cmp(&b.norm())).filter(|x| x.norm() > SAME);
        let [mass, x, y, z] = [0, 1, 2, 3].map(|k| bodies[b].inertia.0[k]);
        let twice = Vec3([x, y, z]).scale(2.0 / mass);
        let by_mass = (mass > 0.0 && twice.norm() < length(mechanism, true)).then_some(twice);
        ends.extend(farthest.or(by_mass));
    }
    let frame = body.map_or_else(|| mechanism.base_link().to_owned(), |b| bodies[b].name.clone());
    ends.retain(|end| end.norm() > SAME);
    ends.dedup_by(|a, b| (*a - *b).norm() <= SAME);
    ends.into_iter().map(|end| Capsule { frame: frame.clone(), ends: [Vec3::zero(), end], radius }).collect()
}
