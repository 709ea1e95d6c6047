//! What must hold for every tree: all kinds of joints, anywhere, about any axis.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use crate::random_tree::{
    self, check_close, effort, generator, largest_term, motion, placement, regressor, sample, tree,
};
use dynid_model::scalar::{Dual, Lanes};
use dynid_model::*;

const TREES: u64 = 60;

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |m, x| m.max(x.abs()))
}

/// Trees of 1 to 9 joints.
fn trees() -> impl Iterator<Item = (u64, Mechanism)> {
    (0..TREES).map(|seed| (seed, tree(1 + seed as usize % 9, seed).build().unwrap()))
}

#[test]
fn regressor_times_parameters_is_inverse_dynamics() {
    for (seed, mechanism) in trees() {
        let (phi, m) = (mechanism.inertia_vector(), motion(&mechanism, seed));
        let y = regressor(&mechanism, &m);
        let product: Vec<f64> =
            y.chunks_exact(phi.len()).map(|row| row.iter().zip(&phi).map(|(w, p)| w * p).sum()).collect();
        check_close(
            &product,
            &effort(&mechanism, &m),
            1e-14 * largest_term(&mechanism, &y),
            &format!("tree {seed}"),
        );
    }
}

#[test]
fn blocks_give_the_numbers_of_single_samples() {
    // 11 samples: the last group of lanes overlaps the one before; 3: no group at all.
    for samples in [3, 11] {
        for (seed, mechanism) in trees() {
            let model = RobotModel::new(mechanism.clone(), vec![]);
            let (n, phi) = (mechanism.rates(), mechanism.inertia_vector());
            let mut block = RegressorBlock::new(model.layout().clone(), samples);
            let mut efforts = vec![0.0; n * samples];
            RandomMotion::new(&mechanism, &[], samples, seed).with_block(|motion| {
                model.regressor(motion, &[], &mut block);
                Dynamics::new(&mechanism).inverse_dynamics_block(motion, &phi, samples, &mut efforts);
                for s in 0..samples {
                    let m = sample(motion, s);
                    let y = regressor(&mechanism, &m);
                    check_close(
                        &dense(&block, s),
                        &y,
                        1e-14 * largest(&y),
                        &format!("tree {seed}, regressor"),
                    );
                    let found: Vec<f64> = (0..n).map(|k| efforts[k * samples + s]).collect();
                    let tolerance = 1e-14 * largest_term(&mechanism, &y);
                    check_close(&found, &effort(&mechanism, &m), tolerance, &format!("tree {seed}, effort"));
                }
            });
        }
    }
}

/// One sample of a block, row-major, zeros where nothing acts.
fn dense(block: &RegressorBlock, sample: usize) -> Vec<f64> {
    let (rows, width) = (block.layout().outputs(), block.layout().parameters());
    let mut y = vec![0.0; rows * width];
    for row in 0..rows {
        for (k, column) in block.layout().columns(row).iter().enumerate() {
            y[row * width + column] = block.column(row, k)[sample];
        }
    }
    y
}

/// Effort of any kind of number.
fn effort_of<S: Scalar>(mechanism: &Mechanism, [q, dq, ddq]: [&[S]; 3]) -> Vec<S> {
    let dynamics = Dynamics::new(mechanism);
    let phi: Vec<S> = mechanism.inertia_vector().into_iter().map(S::from_f64).collect();
    let mut effort = vec![S::zero(); dynamics.rates()];
    let state = State { q, dq, ddq, gravity: None };
    dynamics.inverse_dynamics(&state, &phi, &mut dynamics.workspace(), &mut effort);
    effort
}

fn regressor_of<S: Scalar>(mechanism: &Mechanism, [q, dq, ddq]: [&[S]; 3]) -> Vec<S> {
    let dynamics = Dynamics::new(mechanism);
    let mut y = vec![S::zero(); dynamics.rates() * dynamics.inertial_parameters()];
    dynamics.regressor(&State { q, dq, ddq, gravity: None }, &mut dynamics.workspace(), &mut y);
    y
}

#[test]
fn dual_numbers_carry_the_value_and_the_directional_derivative() {
    for (seed, mechanism) in trees() {
        let (m, along) = (motion(&mechanism, seed), motion(&mechanism, seed + 1000));
        let dual = |v: &[f64], d: &[f64]| -> Vec<Dual<1>> {
            v.iter().zip(d).map(|(v, d)| Dual { value: *v, derivative: [*d] }).collect()
        };
        let (q, dq, ddq) = (dual(&m.q, &along.q), dual(&m.dq, &along.dq), dual(&m.ddq, &along.ddq));
        let single = |v: &[f64]| -> Vec<Lanes<1, false>> { v.iter().map(|x| Lanes([*x])).collect() };
        let [q1, dq1, ddq1] = [&m.q, &m.dq, &m.ddq].map(|v| single(v));
        let shifted = |h: f64| {
            let move_by = |v: &[f64], d: &[f64]| v.iter().zip(d).map(|(v, d)| v + h * d).collect();
            random_tree::Motion {
                q: move_by(&m.q, &along.q),
                dq: move_by(&m.dq, &along.dq),
                ddq: move_by(&m.ddq, &along.ddq),
            }
        };
        let h = 1e-5;
        let check = |found: Vec<Dual<1>>,
                     same: Vec<Lanes<1, false>>,
                     of: &dyn Fn(&random_tree::Motion) -> Vec<f64>,
                     term: f64| {
            let values: Vec<f64> = found.iter().map(|d| d.value).collect();
            // The same operations on the same numbers: not one bit may differ.
            assert_eq!(values, same.iter().map(|l| l.0[0]).collect::<Vec<f64>>(), "tree {seed}");
            check_close(&values, &of(&m), 1e-14 * term, &format!("tree {seed}, value"));
            let difference: Vec<f64> =
                of(&shifted(h)).iter().zip(of(&shifted(-h))).map(|(a, b)| (a - b) / (2.0 * h)).collect();
            let derivatives: Vec<f64> = found.iter().map(|d| d.derivative[0]).collect();
            // Error of the difference: third derivative times h², and rounding over h.
            let tolerance = 1e-8 * (term + largest(&difference));
            check_close(&derivatives, &difference, tolerance, &format!("tree {seed}, derivative"));
        };
        let y = regressor(&mechanism, &m);
        check(
            effort_of(&mechanism, [&q, &dq, &ddq]),
            effort_of(&mechanism, [&q1, &dq1, &ddq1]),
            &|m| effort(&mechanism, m),
            largest_term(&mechanism, &y),
        );
        check(
            regressor_of(&mechanism, [&q, &dq, &ddq]),
            regressor_of(&mechanism, [&q1, &dq1, &ddq1]),
            &|m| regressor(&mechanism, m),
            largest(&y),
        );
    }
}

/// Time derivative of the positions: the rates, and for floating joints `ẋ = R v`, `quat' = ½ quat ⊗ (ω, 0)`.
fn position_rates(mechanism: &Mechanism, q: &[f64], dq: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; q.len()];
    for body in mechanism.bodies() {
        let (p, r) = (body.position, body.rate);
        if body.joint.kind != JointKind::Floating {
            out[p] = dq[r];
            continue;
        }
        let (u, w) = (Vec3([q[p + 3], q[p + 4], q[p + 5]]), q[p + 6]);
        let (v, omega) = (Vec3([dq[r], dq[r + 1], dq[r + 2]]), Vec3([dq[r + 3], dq[r + 4], dq[r + 5]]));
        let turned = v + u.cross(u.cross(v) + v.scale(w)).scale(2.0);
        let vector = (omega.scale(w) + u.cross(omega)).scale(0.5);
        out[p..p + 3].copy_from_slice(&turned.0);
        out[p + 3..p + 6].copy_from_slice(&vector.0);
        out[p + 6] = -0.5 * u.dot(omega);
    }
    out
}

#[test]
fn power_of_the_efforts_is_the_change_of_energy() {
    for (seed, mechanism) in trees() {
        let m = motion(&mechanism, seed);
        let (dynamics, phi) = (Dynamics::new(&mechanism), mechanism.inertia_vector());
        let power: f64 = effort(&mechanism, &m).iter().zip(&m.dq).map(|(t, v)| t * v).sum();
        let mut work = dynamics.workspace();
        let along = position_rates(&mechanism, &m.q, &m.dq);
        let mut energy = |h: f64| {
            let q: Vec<f64> = m.q.iter().zip(&along).map(|(x, d)| x + h * d).collect();
            let dq: Vec<f64> = m.dq.iter().zip(&m.ddq).map(|(x, d)| x + h * d).collect();
            let e = dynamics.energy(&q, &dq, &phi, &mut work);
            (e.kinetic + e.potential, e.kinetic.abs() + e.potential.abs())
        };
        let h = 1e-5;
        let change = (energy(h).0 - energy(-h).0) / (2.0 * h);
        let scale = power.abs() + 100.0 * energy(0.0).1;
        assert!((power - change).abs() <= 1e-8 * scale, "tree {seed}: {power} against {change}");
    }
}

#[test]
fn mass_matrix_is_symmetric_and_multiplies_accelerations() {
    for (seed, mechanism) in trees() {
        let (n, mut m) = (mechanism.rates(), motion(&mechanism, seed));
        let dynamics = Dynamics::new(&mechanism);
        let mass = dynamics.mass_matrix(&m.q, &mechanism.inertia_vector(), &mut dynamics.workspace());
        let scale = largest(&mass);
        for i in 0..n {
            for j in 0..i {
                assert!((mass[i * n + j] - mass[j * n + i]).abs() <= 1e-14 * scale, "tree {seed}: {i} {j}");
            }
        }
        let with = effort(&mechanism, &m);
        let product: Vec<f64> =
            mass.chunks_exact(n).map(|row| row.iter().zip(&m.ddq).map(|(a, b)| a * b).sum()).collect();
        m.ddq.fill(0.0);
        let without = effort(&mechanism, &m);
        let difference: Vec<f64> = with.iter().zip(&without).map(|(a, b)| a - b).collect();
        let tolerance = 1e-13 * (largest(&with) + largest(&without) + 5.0 * scale);
        check_close(&product, &difference, tolerance, &format!("tree {seed}"));
    }
}

#[test]
fn wrench_along_the_axis_is_the_effort() {
    for (seed, mechanism) in trees() {
        let m = motion(&mechanism, seed);
        let dynamics = Dynamics::new(&mechanism);
        let mut work = dynamics.workspace();
        let mut found = vec![0.0; dynamics.rates()];
        dynamics.inverse_dynamics(&m.state(), &mechanism.inertia_vector(), &mut work, &mut found);
        for (b, body) in mechanism.bodies().iter().enumerate() {
            let [fx, fy, fz, nx, ny, nz] = dynamics.joint_wrench(b, &work);
            let (force, moment) =
                (body.joint.axis.dot(Vec3([fx, fy, fz])), body.joint.axis.dot(Vec3([nx, ny, nz])));
            let expected = match body.joint.kind {
                JointKind::Prismatic => vec![force],
                JointKind::Helical { pitch } => vec![moment + pitch * force],
                JointKind::Floating => vec![fx, fy, fz, nx, ny, nz],
                _ => vec![moment],
            };
            let scale = largest(&[fx, fy, fz, nx, ny, nz]);
            check_close(
                &found[body.rate..][..expected.len()],
                &expected,
                1e-14 * scale,
                &format!("tree {seed}"),
            );
        }
    }
}

/// The tree with the frame of every link turned by a rotation.
fn turned(d: &Description, rotations: &[Placement]) -> Description {
    let mut out = d.clone();
    let of = |name: &str| rotations[d.links.iter().position(|l| l.name == name).unwrap()];
    for (link, rotation) in out.links.iter_mut().zip(rotations) {
        link.inertia = link.inertia.map(|i| i.in_frame(&rotation.inverse()));
    }
    for joint in &mut out.joints {
        let own = of(&joint.child);
        joint.placement = of(&joint.parent).inverse().then(&joint.placement).then(&own);
        joint.axis = own.rotation.tr_mul_vec(Vec3(joint.axis)).0;
    }
    out
}

#[test]
fn efforts_do_not_depend_on_the_axes_of_the_link_frames() {
    for seed in 0..TREES {
        let mut d = tree(8, seed);
        // Rates of a floating joint are in body axes: keep to joints whose coordinate is a scalar.
        d.joints
            .iter_mut()
            .filter(|j| j.kind == JointKind::Floating)
            .for_each(|j| j.kind = JointKind::Revolute);
        let mut rng = generator(seed + 500);
        let rotations: Vec<Placement> = (0..d.links.len())
            .map(|k| match k {
                0 => Placement::identity(),
                _ => Placement { translation: Vec3::zero(), ..placement(&mut rng) },
            })
            .collect();
        let (mechanism, other) = (d.build().unwrap(), turned(&d, &rotations).build().unwrap());
        let m = motion(&mechanism, seed);
        let tolerance = 1e-13 * largest_term(&mechanism, &regressor(&mechanism, &m));
        check_close(&effort(&other, &m), &effort(&mechanism, &m), tolerance, &format!("tree {seed}"));
    }
}

#[test]
fn every_coordinate_axis_gives_the_effort_of_a_joint_turned_to_z() {
    for (k, axis) in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].into_iter().enumerate() {
        for sign in [1.0, -1.0] {
            for kind in [JointKind::Revolute, JointKind::Prismatic, JointKind::Helical { pitch: 0.2 }] {
                let mut d = tree(5, 77);
                for joint in &mut d.joints {
                    (joint.kind, joint.axis) = (kind, axis.map(|x| sign * x));
                }
                // A rotation whose third column is the axis.
                let z = Vec3(axis).scale(sign);
                let x = Vec3([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]][k]);
                let rotation = Placement { rotation: Mat3([x, z.cross(x), z]), translation: Vec3::zero() };
                let mut rotations = vec![rotation; d.links.len()];
                rotations[0] = Placement::identity();
                let other = turned(&d, &rotations);
                assert!(other.joints.iter().all(|j| j.axis == [0.0, 0.0, 1.0]));
                let (mechanism, other) = (d.build().unwrap(), other.build().unwrap());
                let m = motion(&mechanism, 3);
                let tolerance = 1e-14 * largest_term(&mechanism, &regressor(&mechanism, &m));
                check_close(
                    &effort(&other, &m),
                    &effort(&mechanism, &m),
                    tolerance,
                    &format!("{axis:?} {sign}"),
                );
            }
        }
    }
}

#[test]
fn coupled_joints_give_the_folded_regressor_of_independent_ones() {
    for seed in 0..TREES {
        let mut d = tree(7, seed);
        let single: Vec<usize> = (0..7).filter(|k| d.joints[*k].kind != JointKind::Floating).collect();
        // A chain of two followers, and one that comes before its leader.
        let leader = |of: usize, ratio: f64, offset: f64| Mimic { of: format!("j{}", of + 1), ratio, offset };
        if single.len() < 5 {
            continue;
        }
        d.joints[single[1]].mimic = Some(leader(single[2], -0.5, 0.3));
        d.joints[single[2]].mimic = Some(leader(single[3], 2.0, -0.1));
        d.joints[single[0]].mimic = Some(leader(single[4], 0.7, 0.0));
        let free = d.build().unwrap();
        d.couple_mimics = true;
        let coupled = d.build().unwrap();
        assert_eq!(coupled.rates(), free.rates() - 3);
        let follows = coupled.follows().unwrap();
        let model = RobotModel::new(coupled.clone(), vec![]);
        let samples = 6;
        let mut block = RegressorBlock::new(model.layout().clone(), samples);
        RandomMotion::new(&coupled, &[], samples, seed).with_block(|motion| {
            model.regressor(motion, &[], &mut block);
            for s in 0..samples {
                let m = sample(motion, s);
                let y = regressor(&coupled, &m);
                check_close(&dense(&block, s), &y, 1e-14 * largest(&y), &format!("tree {seed}, block"));
                let phi = coupled.inertia_vector();
                let product: Vec<f64> =
                    y.chunks_exact(phi.len()).map(|r| r.iter().zip(&phi).map(|(w, p)| w * p).sum()).collect();
                let tolerance = 1e-14 * largest_term(&coupled, &y);
                check_close(&product, &effort(&coupled, &m), tolerance, &format!("tree {seed}, effort"));

                // Effort of the followers, carried to their leaders by virtual power.
                let all = spread(&free, &coupled, &m);
                let mut expected = vec![0.0; coupled.rates()];
                for (e, f) in effort(&free, &all).iter().zip(follows) {
                    expected[f.coordinate] += f.ratio * e;
                }
                check_close(
                    &effort(&coupled, &m),
                    &expected,
                    2.0 * tolerance,
                    &format!("tree {seed}, folded"),
                );
            }
        });
    }
}

/// Motion of every joint from motion of the independent coordinates.
fn spread(free: &Mechanism, coupled: &Mechanism, m: &random_tree::Motion) -> random_tree::Motion {
    let follows = coupled.follows().unwrap();
    // First position of every independent coordinate: floating joints have seven entries and six rates.
    let mut first = std::collections::HashMap::new();
    let mut next = 0;
    for body in coupled.bodies().iter().filter(|b| b.joint.mimic.is_none()) {
        first.insert(follows[body.rate].coordinate, next);
        next += body.joint.positions();
    }
    let mut all = random_tree::Motion { q: vec![], dq: vec![], ddq: vec![] };
    for body in free.bodies() {
        let f = follows[body.rate];
        let from = first[&f.coordinate];
        all.q.extend((0..body.joint.positions()).map(|k| f.ratio * m.q[from + k] + f.offset));
        for k in 0..body.joint.rates() {
            all.dq.push(f.ratio * m.dq[f.coordinate + k]);
            all.ddq.push(f.ratio * m.ddq[f.coordinate + k]);
        }
    }
    all
}

#[test]
fn nearest_parameters_have_the_base_values_and_stay_at_the_prior_if_they_can() {
    for seed in 0..12 {
        let mechanism = tree(4, seed).build().unwrap();
        let model = RobotModel::new(mechanism.clone(), vec![]);
        let base = BaseParameters::of(&model, &mechanism, &[], &BaseSettings::default());
        let prior = mechanism.inertia_vector();
        let scale: Vec<f64> = (0..prior.len()).map(|k| 0.1 + (k % 7) as f64).collect();
        let own = base.values(&prior);
        check_close(&base.nearest(&own, &prior, &scale), &prior, 1e-12 * largest(&prior), "unchanged prior");
        let beta: Vec<f64> = own.iter().enumerate().map(|(k, b)| b + (k as f64).sin()).collect();
        assert_eq!(base.values(&base.expanded(&beta)), beta, "tree {seed}: kept columns alone");
        let x = base.nearest(&beta, &prior, &scale);
        check_close(&base.values(&x), &beta, 1e-9 * largest(&beta).max(1.0), &format!("tree {seed}: K x"));
        for c in &base.zero {
            assert_eq!(x[*c], prior[*c], "parameters that never act keep their prior");
        }
        // Optimality: no move inside the null space of K brings x nearer to the prior.
        for (column, factors) in base.folded.iter().zip(&base.factors) {
            let pull = |c: usize| (x[c] - prior[c]) / (scale[c] * scale[c]);
            let gradient =
                pull(*column) - base.kept.iter().zip(factors).map(|(c, f)| f * pull(*c)).sum::<f64>();
            let size = pull(*column).abs()
                + base.kept.iter().zip(factors).map(|(c, f)| (f * pull(*c)).abs()).sum::<f64>();
            assert!(gradient.abs() <= 1e-9 * size.max(1.0), "tree {seed}, column {column}: {gradient:e}");
        }
    }
}
