//! Path constraints against brute force and central differences.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use crate::{plain_urdf, support};
use dynid_excitation::constraint::{
    Capsule, CapsulePairs, Capsules, CartesianLimits, ConstraintError, ConstraintKind, EffortLimits,
    FramePoint, PathConstraint, Region,
};
use dynid_model::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const SAMPLES: usize = 13;

/// Indy7, ER-16 and UR10, as far as the reference data is there.
fn robots() -> Vec<Mechanism> {
    let mut out = Vec::new();
    for file in ["robots/indy7.json", "robots/er16.json"] {
        out.extend(support::reference(file).map(|data| support::mechanism(&data)));
    }
    out.extend(plain_urdf::ur10());
    out
}

/// Motion of a robot that owns its samples: positions within ±`reach`.
struct Samples {
    count: usize,
    values: [Vec<f64>; 3],
}

impl Samples {
    fn random(mechanism: &Mechanism, reach: f64, count: usize, seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let values = [reach, 2.0, 5.0]
            .map(|range| (0..mechanism.rates() * count).map(|_| rng.random_range(-range..=range)).collect());
        Samples { count, values }
    }

    fn block(&self) -> MotionBlock<'_> {
        MotionBlock {
            samples: self.count,
            stride: self.count,
            q: &self.values[0],
            dq: &self.values[1],
            ddq: &self.values[2],
            gravity: None,
            channels: &[],
            sign_width: 0.3,
        }
    }

    fn pose(&self, sample: usize) -> Vec<f64> {
        self.values[0].chunks_exact(self.count).map(|c| c[sample]).collect()
    }
}

fn values(constraint: &dyn PathConstraint, motion: &Samples) -> Vec<f64> {
    let mut values = vec![f64::NAN; constraint.rows().len() * motion.count];
    constraint.values(&motion.block(), motion.count, &mut values);
    values
}

/// Largest difference between gradients and central differences of fourth order, relative to the row's largest entry.
fn gradient_error(constraint: &dyn PathConstraint, motion: &mut Samples, rates: usize) -> f64 {
    let samples = motion.count;
    // Every row and sample, in an order that is neither by row nor by sample.
    let mut wanted: Vec<(usize, usize)> =
        (0..constraint.rows().len()).flat_map(|r| (0..samples).map(move |s| (r, s))).collect();
    wanted.sort_by_key(|(r, s)| (7 * r + 5 * s) % 11);
    let mut found = vec![f64::NAN; 3 * rates * wanted.len()];
    constraint.gradients(&motion.block(), &wanted, &mut found);

    let h = 1e-4;
    let mut differences = vec![0.0; found.len()];
    for kind in 0..3 {
        for c in 0..rates {
            for (step, factor) in [(1.0, 8.0), (-1.0, -8.0), (2.0, -1.0), (-2.0, 1.0)] {
                let middle = motion.values[kind].clone();
                motion.values[kind][c * samples..][..samples].iter_mut().for_each(|x| *x += step * h);
                let moved = values(constraint, motion);
                motion.values[kind] = middle;
                for (k, (row, sample)) in wanted.iter().enumerate() {
                    differences[3 * rates * k + rates * kind + c] +=
                        factor * moved[row * samples + sample] / (12.0 * h);
                }
            }
        }
    }
    let rows = found.chunks_exact(3 * rates).zip(differences.chunks_exact(3 * rates));
    rows.map(|(found, expected)| {
        let scale = expected.iter().fold(1e-3_f64, |m, x| m.max(x.abs()));
        found.iter().zip(expected).fold(0.0_f64, |m, (f, e)| m.max((f - e).abs() / scale))
    })
    .fold(0.0, f64::max)
}

#[test]
fn efforts_are_those_of_the_regressor_and_have_their_gradients() {
    for mechanism in robots() {
        let n = mechanism.rates();
        let model = support::model(&mechanism, 0..n, true);
        let linear: Vec<f64> =
            model.parameters().prior().iter().enumerate().map(|(k, p)| p + 0.1 * (k % 5) as f64).collect();
        // The second output has no limit.
        let limits: Vec<Option<f64>> = (0..n).map(|o| (o != 1).then_some(20.0 + 10.0 * o as f64)).collect();
        let efforts = EffortLimits::new(&model, vec![], linear.clone(), &limits).unwrap();
        assert_eq!(efforts.rows().len(), n - 1);
        let mut motion = Samples::random(&mechanism, 3.0, SAMPLES, 1);
        let found = values(&efforts, &motion);
        let mut w = RegressorBlock::new(model.layout().clone(), SAMPLES);
        model.regressor(&motion.block(), &[], &mut w);
        for (row, output) in (0..n).filter(|o| *o != 1).enumerate() {
            assert_eq!(efforts.rows()[row].subject, model.outputs()[output].name);
            let scale = efforts.rows()[row].scale;
            for (s, e) in w.effort(output, &linear).iter().enumerate() {
                let error = (found[row * SAMPLES + s] * scale - e).abs();
                assert!(error <= 1e-12 * (1.0 + e.abs()) * 10.0, "{error:e}");
            }
        }
        let error = gradient_error(&efforts, &mut motion, n);
        println!("{}: efforts {error:e}", mechanism.name());
        assert!(error < 1e-9, "{}: {error:e}", mechanism.name());
    }
}

#[test]
fn many_wanted_gradients_are_those_of_single_ones() {
    let Some(mechanism) = support::reference("robots/er16.json").map(|d| support::mechanism(&d)) else {
        return;
    };
    let model = support::model(&mechanism, 0..0, true);
    let linear = vec![0.7; model.parameters().linear.len()];
    let efforts = EffortLimits::new(&model, vec![], linear, &[Some(3.0); 3]).unwrap();
    let motion = Samples::random(&mechanism, 3.0, 200, 2);
    let wanted: Vec<(usize, usize)> = (0..600).map(|k| (k % 3, (7 * k) % 200)).collect();
    let mut all = vec![0.0; 9 * wanted.len()];
    efforts.gradients(&motion.block(), &wanted, &mut all);
    for (one, expected) in wanted.iter().zip(all.chunks_exact(9)) {
        let mut found = vec![0.0; 9];
        efforts.gradients(&motion.block(), &[*one], &mut found);
        for (f, e) in found.iter().zip(expected) {
            assert!((f - e).abs() <= 1e-12 * (1.0 + e.abs()));
        }
    }
}

fn last_link(mechanism: &Mechanism) -> String {
    mechanism.bodies()[mechanism.bodies().len() - 1].name.clone()
}

fn regions() -> Vec<Region> {
    vec![
        Region::HalfSpace { normal: Vec3([1.0, 2.0, 2.0]), offset: -0.4 },
        Region::InsideBox { lower: Vec3([-1.0, -0.8, 0.1]), upper: Vec3([0.9, 1.1, 1.4]) },
        Region::OutsideCylinder { center: [0.1, -0.2], radius: 0.17 },
        Region::OutsideOrAboveColumn { center: [0.0, 0.05], radius: 0.3, height: 0.35 },
    ]
}

#[test]
fn distances_of_points_are_those_of_their_definition_and_have_their_gradients() {
    for mechanism in robots() {
        let at = Vec3([0.1, -0.05, 0.2]);
        let limits: Vec<(FramePoint, Region)> = regions()
            .into_iter()
            .map(|r| (FramePoint { frame: last_link(&mechanism), position: at }, r))
            .collect();
        let constraint = CartesianLimits::new(&mechanism, &limits).unwrap();
        let mut motion = Samples::random(&mechanism, 3.0, SAMPLES, 4);
        let found = values(&constraint, &motion);
        let dynamics = Dynamics::new(&mechanism);
        let mut work = dynamics.workspace();
        for s in 0..SAMPLES {
            let frames = dynamics.forward_kinematics(&motion.pose(s), &mut work);
            let frame = frames[frames.len() - 1];
            let [x, y, z] = (frame.rotation.mul_vec(at) + frame.translation).0;
            let column = (x.hypot(y - 0.05) - 0.3).max(z - 0.35);
            let expected = [
                (x + 2.0 * y + 2.0 * z) / 3.0 + 0.4,
                x + 1.0,
                0.9 - x,
                y + 0.8,
                1.1 - y,
                z - 0.1,
                1.4 - z,
                (x - 0.1).hypot(y + 0.2) - 0.17,
            ];
            for (row, expected) in expected.into_iter().enumerate() {
                let distance = constraint.rows()[row].scale * found[row * SAMPLES + s];
                assert!((distance - expected).abs() < 1e-13, "row {row}: {distance} {expected}");
            }
            let smooth = constraint.rows()[8].scale * found[8 * SAMPLES + s];
            assert!(smooth <= column + 1e-14 && smooth >= column - 0.01 * std::f64::consts::LN_2 - 1e-14);
        }
        let error = gradient_error(&constraint, &mut motion, mechanism.rates());
        println!("{}: distances {error:e}", mechanism.name());
        // The column's fifth derivative grows with the fourth power of its sharpness of 100 /m.
        assert!(error < 1e-8, "{}: {error:e}", mechanism.name());
    }
}

/// One capsule along every link from its joint to the next, and one on the ground.
fn capsules(mechanism: &Mechanism) -> Vec<Capsule> {
    let base = Capsule {
        frame: mechanism.base_link().into(),
        ends: [Vec3([0.0, 0.0, -0.2]), Vec3([0.0, 0.0, 0.1])],
        radius: 0.08,
    };
    let bodies = mechanism.bodies();
    let links = bodies.iter().enumerate().map(|(b, body)| {
        let next = bodies.iter().find(|c| c.parent == Some(b));
        let end = next.map_or(Vec3([0.05, 0.0, 0.15]), |c| c.joint.placement.translation);
        Capsule { frame: body.name.clone(), ends: [Vec3::zero(), end], radius: 0.05 }
    });
    std::iter::once(base).chain(links).collect()
}

fn ranges(mechanism: &Mechanism, reach: f64) -> Vec<(f64, f64)> {
    vec![(-reach, reach); mechanism.rates()]
}

/// Distance of two capsules by trying many points of both.
fn brute_force(segments: &[[Vec3<f64>; 2]; 2]) -> f64 {
    const STEPS: usize = 300;
    let point = |[a, b]: &[Vec3<f64>; 2], k: usize| (*b - *a).scale_add(k as f64 / STEPS as f64, *a);
    let mut least = f64::INFINITY;
    for i in 0..=STEPS {
        let p = point(&segments[0], i);
        for k in 0..=STEPS {
            least = least.min((p - point(&segments[1], k)).norm());
        }
    }
    least
}

/// Ends of all capsules at a pose.
fn placed(mechanism: &Mechanism, capsules: &[Capsule], q: &[f64]) -> Vec<[Vec3<f64>; 2]> {
    let dynamics = Dynamics::new(mechanism);
    let frames = dynamics.forward_kinematics(q, &mut dynamics.workspace());
    let of = |c: &Capsule| {
        let frame = mechanism.frame(&c.frame).unwrap();
        let at = frame.body.map_or(frame.placement, |b| frames[b].then(&frame.placement));
        c.ends.map(|p| at.rotation.mul_vec(p) + at.translation)
    };
    capsules.iter().map(of).collect()
}

#[test]
fn capsule_distances_are_those_of_brute_force_and_have_their_gradients() {
    for mechanism in robots() {
        let capsules = capsules(&mechanism);
        let constraint =
            Capsules::new(&mechanism, &capsules, &CapsulePairs::All, &ranges(&mechanism, 3.0)).unwrap();
        assert!(!constraint.pairs().is_empty());
        let mut motion = Samples::random(&mechanism, 3.0, SAMPLES, 6);
        let found = values(&constraint, &motion);
        let of_pairs: Vec<usize> = (0..constraint.rows().len())
            .filter(|r| !constraint.rows()[*r].subject.contains(", end"))
            .collect();
        assert_eq!(of_pairs.len(), constraint.pairs().len());
        for s in 0..SAMPLES {
            let segments = placed(&mechanism, &capsules, &motion.pose(s));
            for (row, (a, b)) in of_pairs.iter().zip(constraint.pairs()) {
                let radii = capsules[*a].radius + capsules[*b].radius;
                let expected = brute_force(&[segments[*a], segments[*b]]) - radii;
                let distance = 0.5 * found[row * SAMPLES + s];
                // Half a step of each segment is missed at most, at a right angle to a small distance.
                assert!(distance <= expected + 1e-13 && distance >= expected - 2e-3, "{distance} {expected}");
                // Further rows of the pair are no smaller.
                let next = (row + 1..constraint.rows().len()).take(4);
                for end in next.take_while(|r| !of_pairs.contains(r)) {
                    let [end, least] = [end, *row].map(|r| found[r * SAMPLES + s]);
                    // Where the closest point is an end, both are one distance, of some metres, from two formulas.
                    assert!(end >= least - 4.0 * f64::EPSILON, "{end} below {least} by {:e}", least - end);
                }
            }
        }
        let error = gradient_error(&constraint, &mut motion, mechanism.rates());
        println!(
            "{}: {} pairs of {}, {} rows, {error:e}",
            mechanism.name(),
            constraint.pairs().len(),
            capsules.len() * (capsules.len() - 1) / 2,
            constraint.rows().len()
        );
        assert!(error < 1e-8, "{}: {error:e}", mechanism.name());
    }
}

#[test]
fn pairs_left_out_never_touch() {
    for mechanism in robots() {
        for reach in [0.05, 0.6, 2.0] {
            let capsules = capsules(&mechanism);
            let ranges = ranges(&mechanism, reach);
            let kept = Capsules::new(&mechanism, &capsules, &CapsulePairs::All, &ranges).unwrap();
            let mut left_out = Vec::new();
            for a in 0..capsules.len() {
                // In a chain, neighbours follow each other.
                left_out
                    .extend((a + 2..capsules.len()).map(|b| (a, b)).filter(|p| !kept.pairs().contains(p)));
            }
            println!(
                "{} ±{reach}: {} kept, {} left out",
                mechanism.name(),
                kept.pairs().len(),
                left_out.len()
            );
            if left_out.is_empty() {
                continue;
            }
            let given = CapsulePairs::Given(left_out.clone());
            let all = Capsules::new(&mechanism, &capsules, &given, &ranges).unwrap();
            let motion = Samples::random(&mechanism, reach, 5000, 8);
            assert!(values(&all, &motion).iter().all(|v| *v > 0.0));
        }
    }
}

#[test]
fn every_value_and_gradient_is_finite_at_any_pose() {
    for mechanism in robots() {
        let n = mechanism.rates();
        let model = support::model(&mechanism, 0..0, false);
        let efforts =
            EffortLimits::new(&model, vec![], model.parameters().prior(), &vec![Some(1.0); n]).unwrap();
        // Origin of the first link, on the axis of the base.
        let mut limits: Vec<(FramePoint, Region)> = Vec::new();
        for frame in [mechanism.bodies()[0].name.clone(), last_link(&mechanism)] {
            let point = FramePoint { frame, position: Vec3::zero() };
            let on_axis = [
                Region::OutsideCylinder { center: [0.0; 2], radius: 0.1 },
                Region::OutsideOrAboveColumn { center: [0.0; 2], radius: 0.1, height: 1e4 },
            ];
            limits.extend(regions().into_iter().chain(on_axis).map(|r| (point.clone(), r)));
        }
        let cartesian = CartesianLimits::new(&mechanism, &limits).unwrap();
        // Two capsules in one place: closest points have no direction.
        let mut capsules = capsules(&mechanism);
        capsules.push(capsules[2].clone());
        let given = CapsulePairs::Given(vec![(0, 2), (2, capsules.len() - 1), (1, 3)]);
        let capsules = Capsules::new(&mechanism, &capsules, &given, &ranges(&mechanism, 3.0)).unwrap();
        for reach in [0.0, 3.0, 1e3, 1e9] {
            let motion = Samples::random(&mechanism, reach, SAMPLES, 5);
            for constraint in [&efforts as &dyn PathConstraint, &cartesian, &capsules] {
                assert!(values(constraint, &motion).iter().all(|v| v.is_finite()));
                let wanted: Vec<(usize, usize)> =
                    (0..constraint.rows().len()).flat_map(|r| (0..SAMPLES).map(move |s| (r, s))).collect();
                let mut out = vec![f64::NAN; 3 * n * wanted.len()];
                constraint.gradients(&motion.block(), &wanted, &mut out);
                assert!(out.iter().all(|v| v.is_finite()));
            }
        }
    }
}

#[test]
fn constraints_that_cannot_be_stated_are_refused() {
    let Some(mechanism) = support::reference("robots/er16.json").map(|d| support::mechanism(&d)) else {
        return;
    };
    let model = support::model(&mechanism, 0..0, false);
    let linear = model.parameters().prior();
    let error = EffortLimits::new(&model, vec![], linear.clone(), &[Some(1.0); 2]).unwrap_err();
    assert_eq!(error.to_string(), "2 effort limits, expected 3");
    let error = EffortLimits::new(&model, vec![], linear, &[Some(1.0), Some(-2.0), None]).unwrap_err();
    assert_eq!(error.to_string(), "effort limit of `j2` is -2, expected a positive number");

    let at = |frame: &str| FramePoint { frame: frame.into(), position: Vec3::zero() };
    let cylinder = Region::OutsideCylinder { center: [0.0; 2], radius: 0.1 };
    let error = CartesianLimits::new(&mechanism, &[(at("tool"), cylinder)]).unwrap_err();
    assert_eq!(error.to_string(), "no link is named `tool` (links: base, link1, link2, link3)");
    let plane = Region::HalfSpace { normal: Vec3::zero(), offset: 0.0 };
    assert!(matches!(
        CartesianLimits::new(&mechanism, &[(at("link3"), plane)]),
        Err(ConstraintError::Number { .. })
    ));

    let capsules = capsules(&mechanism);
    let given = CapsulePairs::Given(vec![(0, 9)]);
    let error = Capsules::new(&mechanism, &capsules, &given, &ranges(&mechanism, 1.0)).unwrap_err();
    assert_eq!(error, ConstraintError::Pair { pair: (0, 9), capsules: 4 });
    let backwards = [(1.0, -1.0); 3];
    let error = Capsules::new(&mechanism, &capsules, &CapsulePairs::All, &backwards).unwrap_err();
    assert_eq!(error.to_string(), "width of the position range of `j1` is -2, expected not negative");
    let column = CartesianLimits::new(&mechanism, &[(at("link3"), cylinder)]).unwrap();
    assert_eq!(column.rows()[0].kind, ConstraintKind::Cylinder);
}
