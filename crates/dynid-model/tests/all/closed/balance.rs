//! Laws that hold for any closed mechanism, and descriptions of one mechanism that must agree.

use dynid_model::closed::ClosedDynamics;
use dynid_model::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{Parts, spec};
use crate::golden::check_close;
use crate::robots::robot;

const ALL: [&str; 5] = ["fourbar", "fivebar", "prr3", "delta", "stewart"];

struct Instant {
    q: Vec<f64>,
    dq: Vec<f64>,
    ddq: Vec<f64>,
}

/// Random states of a model.
fn instants(model: &ClosedModel, samples: usize) -> Vec<Instant> {
    model.random_motion(samples, 11).with_block(|block| {
        let at = |values: &[f64], s: usize| values.iter().skip(s).step_by(samples).copied().collect();
        (0..samples)
            .map(|s| Instant { q: at(block.q, s), dq: at(block.dq, s), ddq: at(block.ddq, s) })
            .collect()
    })
}

fn reach(dynamics: &mut ClosedDynamics, q: &[f64]) {
    if dynamics.reach(q).is_err() {
        *dynamics = ClosedDynamics::new(dynamics.machine().clone());
        dynamics.reach(q).unwrap();
    }
}

#[test]
fn reactions_along_axes_are_efforts_and_those_of_the_ground_carry_all() {
    for name in ALL {
        let stated = robot(name);
        let model = stated.model();
        let mut free = stated.description.clone();
        free.floating_base = true;
        let free = free.build().unwrap();
        let whole = Dynamics::new(&free);
        let mechanism = model.tree().mechanism();
        let tree = Dynamics::new(mechanism);
        let phi = mechanism.inertia_vector();
        let mut dynamics = ClosedDynamics::new(model.machine().clone());
        let mut worst = [0.0_f64; 2];
        for instant in instants(&model, 20) {
            reach(&mut dynamics, &instant.q);
            let (dq, ddq) = dynamics.motion(&instant.dq, &instant.ddq);
            let found = dynamics.inverse_dynamics((&dq, &ddq), None, &phi);
            let q = dynamics.pose().positions().to_vec();
            let at = tree.forward_kinematics(&q, &mut tree.workspace());

            // The robot on a platform that stands still: the wrench that holds the platform.
            let bodies = free.bodies();
            let root =
                bodies.iter().find(|b| b.joint.kind == JointKind::Floating && b.parent.is_none()).unwrap();
            let mut all = [vec![0.0; whole.positions()], vec![0.0; whole.rates()], vec![0.0; whole.rates()]];
            all[0][root.position + 6] = 1.0;
            for body in bodies {
                let Ok(own) = mechanism.joint_index(&body.joint.name) else { continue };
                let own = &mechanism.bodies()[own];
                let (p, n) = (own.joint.positions(), own.joint.rates());
                all[0][body.position..body.position + p].copy_from_slice(&q[own.position..own.position + p]);
                all[1][body.rate..body.rate + n].copy_from_slice(&dq[own.rate..own.rate + n]);
                all[2][body.rate..body.rate + n].copy_from_slice(&ddq[own.rate..own.rate + n]);
            }
            let state = State { q: &all[0], dq: &all[1], ddq: &all[2], gravity: None };
            let mut effort = vec![0.0; whole.rates()];
            whole.inverse_dynamics(&state, &free.inertia_vector(), &mut whole.workspace(), &mut effort);
            let needed = &effort[root.rate..root.rate + 6];

            let mut held = [0.0; 6];
            let driven = model.machine().driven();
            let wrenches: Vec<[f64; 6]> = (0..mechanism.bodies().len())
                .map(|k| dynamics.reaction_rows(k, (&dq, &ddq), None).wrench(&phi, &found.multipliers))
                .collect();
            // Rounding is that of the largest force: all of them come from one system of equations.
            let size = wrenches.iter().flatten().fold(0.0_f64, |m, x| m.max(x.abs()));
            for (index, (body, wrench)) in mechanism.bodies().iter().zip(&wrenches).enumerate() {
                let expected =
                    |rate: usize| driven.iter().position(|r| *r == rate).map_or(0.0, |k| found.drives[k]);
                let axis = body.joint.axis;
                let along = |part: &[f64]| axis.dot(Vec3([part[0], part[1], part[2]]));
                let efforts = match body.joint.kind {
                    JointKind::Floating => wrench.to_vec(),
                    JointKind::Prismatic => vec![along(&wrench[..3])],
                    _ => vec![along(&wrench[3..])],
                };
                for (k, effort) in efforts.iter().enumerate() {
                    worst[0] = worst[0].max((effort - expected(body.rate + k)).abs() / size);
                }
                if body.parent.is_none() {
                    let turned = |v: &[f64]| at[index].rotation.mul_vec(Vec3([v[0], v[1], v[2]]));
                    let (force, moment) = (turned(&wrench[..3]), turned(&wrench[3..]));
                    let moment = moment + at[index].translation.cross(force);
                    let both = force.0.into_iter().chain(moment.0);
                    held.iter_mut().zip(both).for_each(|(h, x)| *h += x);
                }
            }
            for (h, n) in held.iter().zip(needed) {
                worst[1] = worst[1].max((h - n).abs() / size);
            }
        }
        println!("{name}: along axes {:.1e}, ground {:.1e}", worst[0], worst[1]);
        assert!(worst.iter().all(|w| *w < 1e-11), "{name}: {worst:?}");
    }
}

#[test]
fn power_of_drives_is_the_change_of_energy() {
    for name in ALL {
        let model = robot(name).model();
        let mechanism = model.tree().mechanism();
        let tree = Dynamics::new(mechanism);
        let phi = mechanism.inertia_vector();
        let mut dynamics = ClosedDynamics::new(model.machine().clone());
        let mut worst = 0.0_f64;
        for Instant { q, dq, ddq } in instants(&model, 10) {
            let mut energy = |t: f64| {
                let at: Vec<f64> = (0..q.len()).map(|k| q[k] + t * (dq[k] + 0.5 * t * ddq[k])).collect();
                let rates: Vec<f64> = (0..q.len()).map(|k| dq[k] + t * ddq[k]).collect();
                reach(&mut dynamics, &at);
                let (all, _) = dynamics.motion(&rates, &ddq);
                let energy = tree.energy(dynamics.pose().positions(), &all, &phi, &mut tree.workspace());
                energy.kinetic + energy.potential
            };
            let h = 2e-5;
            let change = (8.0 * (energy(h) - energy(-h)) - (energy(2.0 * h) - energy(-2.0 * h))) / (12.0 * h);
            reach(&mut dynamics, &q);
            let (all, accelerations) = dynamics.motion(&dq, &ddq);
            let found = dynamics.inverse_dynamics((&all, &accelerations), None, &phi);
            let terms = found.drives.iter().zip(&dq).map(|(e, v)| e * v);
            let size: f64 = 1.0 + terms.clone().map(f64::abs).sum::<f64>();
            worst = worst.max((terms.sum::<f64>() - change).abs() / size);
        }
        println!("{name}: {worst:.1e}");
        assert!(worst < 1e-7, "{name}: {worst:e}");
    }
}

/// Efforts of a description over states told by the drives.
fn efforts(
    parts: &Parts,
    states: &[[Vec<f64>; 3]],
    inertias: impl Fn(&str, Vec<f64>) -> Vec<f64>,
) -> Vec<f64> {
    let machine = parts.close();
    let mechanism = machine.mechanism().clone();
    let phi: Vec<f64> = mechanism
        .bodies()
        .iter()
        .zip(mechanism.inertia_vector().chunks_exact(10))
        .flat_map(|(body, phi)| inertias(&body.joint.name, phi.to_vec()))
        .collect();
    let mut dynamics = ClosedDynamics::new(machine);
    let mut out = Vec::new();
    for [q, dq, ddq] in states {
        dynamics.reach(q).unwrap();
        let (dq, ddq) = dynamics.motion(dq, ddq);
        out.extend(dynamics.inverse_dynamics((&dq, &ddq), None, &phi).drives);
    }
    out
}

#[test]
fn descriptions_of_one_mechanism_agree() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let mut states = |parts: &Parts, spread: f64| -> Vec<[Vec<f64>; 3]> {
        let home = parts.close().home_independent();
        let mut some =
            |range: f64| home.iter().map(|_| rng.random_range(-range..range)).collect::<Vec<f64>>();
        (0..50)
            .map(|_| {
                let off = some(spread);
                [home.iter().zip(off).map(|(h, o)| h + o).collect(), some(2.0), some(5.0)]
            })
            .collect()
    };
    let massless = |name: &str, phi: Vec<f64>| {
        if name.starts_with("rod") || name == "coupler" { vec![0.0; 10] } else { phi }
    };
    let same = |_: &str, phi: Vec<f64>| phi;
    for (name, spread, variant, light) in [
        ("fourbar", 3.0, "spatial", false),
        ("fourbar", 3.0, "coupler_as_distance", true),
        ("delta", 0.3, "parallelogram", false),
        ("delta", 0.3, "rods_as_distances", true),
    ] {
        let Some(stated) = spec(&format!("robots/{name}.json")) else { return };
        let (base, other) = (Parts::new(&stated, None), Parts::new(&stated, Some(variant)));
        let states = states(&base, spread);
        let pair = if light {
            [efforts(&base, &states, massless), efforts(&other, &states, same)]
        } else {
            [efforts(&base, &states, same), efforts(&other, &states, same)]
        };
        let size = pair[0].iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let worst = pair[0].iter().zip(&pair[1]).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
        println!("{name}, {variant}: {:.1e}", worst / size);
        check_close(&pair[1], &pair[0], 0.0, 1e-10, variant);
    }
}

#[test]
fn a_block_is_its_samples() {
    for name in ALL {
        let model = robot(name).model();
        let conditions = 0..model.machine().conditions();
        let reactions = model
            .reactions(&conditions.map(|condition| Reaction::Multiplier { condition }).collect::<Vec<_>>());
        let blocks = |motion: &MotionBlock<'_>| {
            let mut effort = RegressorBlock::new(model.layout().clone(), motion.samples);
            let mut rows = RegressorBlock::new(reactions.layout().clone(), motion.samples);
            model.reaction_regressor(motion, &[], &reactions, &mut effort, &mut rows);
            [effort, rows]
        };
        model.random_motion(40, 1).with_block(|whole| {
            let together = blocks(whole);
            let mut pose = model.machine().workspace();
            for s in 0..whole.samples {
                let at =
                    |values: &[f64]| -> Vec<f64> { values.iter().skip(s).step_by(40).copied().collect() };
                let [q, dq, ddq] = [at(whole.q), at(whole.dq), at(whole.ddq)];
                let alone = blocks(&MotionBlock::plain(1, &q, &dq, &ddq));
                model.machine().go_home(&mut pose);
                model.machine().reach(&mut pose, &q).unwrap();
                // Poses close to rounding from either side; what is near a singular one magnifies that.
                let relative = 1e-13 / model.machine().singularity(&pose).measure.powi(2);
                assert!(relative < 1e-7);
                for (one, all) in alone.iter().zip(&together) {
                    for output in 0..one.layout().outputs() {
                        let columns = 0..one.layout().columns(output).len();
                        let [found, expected]: [Vec<f64>; 2] = [(one, 0), (all, s)]
                            .map(|(b, s)| columns.clone().map(|k| b.column(output, k)[s]).collect());
                        check_close(&found, &expected, 1e-14, relative, &format!("{name}, sample {s}"));
                    }
                }
            }
        });
    }
}
