//! Positions and Jacobians of points on bodies, and frames by name.

use crate::random_tree::{check_close, generator, numbers, placement, sample, tree};
use dynid_model::*;

fn points(mechanism: &Mechanism, seed: u64) -> Vec<BodyPoint> {
    let mut rng = generator(seed);
    let bodies = (0..mechanism.bodies().len()).map(Some);
    bodies.chain([None]).map(|body| BodyPoint { body, position: Vec3(numbers(&mut rng)) }).collect()
}

#[test]
fn points_move_with_the_frames_of_their_bodies() {
    for (seed, samples) in (0..40).zip([2, 7].into_iter().cycle()) {
        let mechanism = tree(1 + seed as usize % 9, seed).build().unwrap();
        let dynamics = Dynamics::new(&mechanism);
        let mut work = dynamics.workspace();
        let points = points(&mechanism, seed);
        let stride = samples + 1;
        let mut out = vec![f64::NAN; 3 * points.len() * stride];
        RandomMotion::new(&mechanism, &[], samples, seed).with_block(|block| {
            dynamics.points(block, &points, stride, &mut out);
            for s in 0..samples {
                let frames = dynamics.forward_kinematics(&sample(block, s).q, &mut work);
                for (p, point) in points.iter().enumerate() {
                    let frame = point.body.map_or(Placement::identity(), |b| frames[b]);
                    let expected = frame.rotation.mul_vec(point.position) + frame.translation;
                    let found = [0, 1, 2].map(|c| out[(3 * p + c) * stride + s]);
                    check_close(&found, &expected.0, 1e-13, &format!("tree {seed}, point {p}"));
                }
            }
        });
    }
}

#[test]
fn jacobians_are_the_derivatives_of_positions() {
    for seed in 0..40 {
        let mut d = tree(1 + seed as usize % 9, seed);
        for joint in d.joints.iter_mut().filter(|j| j.kind == JointKind::Floating) {
            joint.kind = JointKind::Helical { pitch: 0.3 };
        }
        if seed % 2 == 1 && d.joints.len() > 2 {
            d.couple_mimics = true;
            d.joints[1].mimic = Some(Mimic { of: "j1".into(), ratio: -0.7, offset: 0.2 });
        }
        let mechanism = d.build().unwrap();
        let dynamics = Dynamics::new(&mechanism);
        let mut work = dynamics.workspace();
        let (n, points) = (mechanism.rates(), points(&mechanism, seed));
        let mut q: Vec<f64> =
            RandomMotion::new(&mechanism, &[], 1, seed).with_block(|block| sample(block, 0).q);
        let mut at = |q: &[f64]| {
            let mut positions = vec![Vec3::zero(); points.len()];
            let mut jacobians = vec![f64::NAN; 3 * n * points.len()];
            dynamics.point_jacobians(q, &points, &mut work, &mut positions, &mut jacobians);
            (positions, jacobians)
        };
        let (_, jacobians) = at(&q);
        let h = 1e-5;
        for k in 0..n {
            let middle = q[k];
            q[k] = middle + h;
            let (above, _) = at(&q);
            q[k] = middle - h;
            let (below, _) = at(&q);
            q[k] = middle;
            for p in 0..points.len() {
                let expected = (above[p] - below[p]).scale(0.5 / h);
                let found = [0, 1, 2].map(|c| jacobians[(3 * p + c) * n + k]);
                // Third derivatives times h² / 6, positions of some metres.
                check_close(&found, &expected.0, 2e-9, &format!("tree {seed}, point {p}, rate {k}"));
            }
        }
    }
}

#[test]
fn rates_of_a_floating_joint_move_points_in_body_axes() {
    let mut d = tree(2, 1);
    d.joints[0].kind = JointKind::Revolute;
    d.floating_base = true;
    let mechanism = d.build().unwrap();
    let dynamics = Dynamics::new(&mechanism);
    let mut work = dynamics.workspace();
    let q = RandomMotion::new(&mechanism, &[], 1, 9).with_block(|block| sample(block, 0).q);
    let frame = dynamics.forward_kinematics(&q, &mut work)[0];
    let point = BodyPoint { body: Some(0), position: Vec3([0.1, -0.2, 0.3]) };
    let n = mechanism.rates();
    let (mut positions, mut jacobian) = ([Vec3::zero()], vec![0.0; 3 * n]);
    dynamics.point_jacobians(&q, &[point], &mut work, &mut positions, &mut jacobian);
    for k in 0..3 {
        let mut unit = Vec3::zero();
        unit.0[k] = 1.0;
        let column = |rate: usize| [0, 1, 2].map(|c| jacobian[c * n + rate]);
        check_close(&column(k), &frame.rotation.mul_vec(unit).0, 1e-14, "velocity");
        let turning = frame.rotation.mul_vec(unit.cross(point.position));
        check_close(&column(3 + k), &turning.0, 1e-14, "angular velocity");
    }
}

#[test]
fn frames_are_found_by_the_name_of_any_link() {
    let mut rng = generator(7);
    let mut d = tree(2, 2);
    for joint in &mut d.joints {
        joint.kind = JointKind::Revolute;
    }
    let [stand, tool, tip] = [0, 1, 2].map(|_| placement(&mut rng));
    for (parent, child, placement) in [("l0", "stand", stand), ("l2", "tool", tool), ("tool", "tip", tip)] {
        d.links.push(LinkDescription { name: child.into(), inertia: None });
        d.joints.push(JointDescription {
            name: format!("{child} joint"),
            parent: parent.into(),
            child: child.into(),
            kind: JointKind::Fixed,
            placement,
            axis: [0.0; 3],
            limits: Limits::default(),
            mimic: None,
        });
    }
    let mechanism = d.build().unwrap();
    let frame = |name: &str| mechanism.frame(name).unwrap();
    assert_eq!(frame("l0"), Frame { body: None, placement: Placement::identity() });
    assert_eq!(frame("stand"), Frame { body: None, placement: stand });
    assert_eq!(frame("l1"), Frame { body: Some(0), placement: Placement::identity() });
    assert_eq!(frame("tip"), Frame { body: Some(1), placement: tool.then(&tip) });
    let error = mechanism.frame("gripper").unwrap_err();
    let MechanismError::UnknownLink { name, known } = &error else { panic!("{error}") };
    assert_eq!(name, "gripper");
    assert_eq!(known, &["l0", "stand", "l1", "l2", "tool", "tip"]);
}
