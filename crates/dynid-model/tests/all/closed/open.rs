//! Trees as mechanisms without closures, and friction that follows the reactions in their joints.

use dynid_model::closed::{ClosedError, ClosedMechanism};
use dynid_model::element::{Coulomb, JointElement, ReactionFriction, RotorInertia, ShapeSetting, Stribeck};
use dynid_model::*;

use crate::random_tree::{check_close, tree};

const SAMPLES: usize = 40;

/// A tree of joints that turn or slide.
fn mechanism(seed: u64) -> Mechanism {
    let mut description = tree(5, seed);
    for (k, joint) in description.joints.iter_mut().enumerate() {
        joint.kind = if k % 2 == 0 { JointKind::Revolute } else { JointKind::Prismatic };
    }
    description.build().unwrap()
}

fn regressor(model: &dyn EffortModel, motion: &MotionBlock<'_>, shape: &[f64]) -> RegressorBlock {
    let mut out = RegressorBlock::new(model.layout().clone(), motion.samples);
    model.regressor(motion, shape, &mut out);
    out
}

fn efforts(model: &dyn EffortModel, motion: &MotionBlock<'_>, shape: &[f64], linear: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; model.outputs().len() * motion.samples];
    model.efforts(motion, shape, linear, motion.samples, &mut out);
    out
}

#[test]
fn without_closures_all_is_as_in_the_tree() {
    for seed in 1..6 {
        let mechanism = mechanism(seed);
        let rates = mechanism.rates();
        let elements = || -> Vec<Box<dyn JointElement>> {
            (0..rates)
                .flat_map(|rate| [Box::new(Coulomb { rate }) as _, Box::new(RotorInertia { rate }) as _])
                .collect()
        };
        let plain = TreeModel::new(mechanism.clone(), elements());
        let machine = ClosedMechanism::open(mechanism.clone()).unwrap();
        assert_eq!((machine.conditions(), machine.mobility()), (0, rates));
        let open = ClosedModel::new(TreeModel::new(mechanism.clone(), elements()), machine);
        let names =
            |model: &dyn EffortModel| model.outputs().iter().map(|o| o.name.clone()).collect::<Vec<_>>();
        assert_eq!(names(&plain), names(&open));
        let mut linear = mechanism.inertia_vector();
        linear.resize(plain.parameters().linear.len(), 0.3);
        open.random_motion(SAMPLES, seed).with_block(|motion| {
            open.follow(motion, |_, _| {}).unwrap();
            let (ours, theirs) = (regressor(&open, motion, &[]), regressor(&plain, motion, &[]));
            for output in 0..rates {
                check_close(&ours.effort(output, &linear), &theirs.effort(output, &linear), 1e-12, "x");
            }
            check_close(
                &efforts(&open, motion, &[], &linear),
                &efforts(&plain, motion, &[], &linear),
                1e-12,
                "x",
            );
            // Rows of wrenches, against the recursion.
            let dynamics = Dynamics::new(&mechanism);
            let list: Vec<Reaction> = (0..mechanism.bodies().len())
                .flat_map(|body| (0..6).map(move |component| Reaction::Joint { body, component }))
                .collect();
            let reactions = open.reactions(&list);
            let mut effort = RegressorBlock::new(open.layout().clone(), SAMPLES);
            let mut rows = RegressorBlock::new(reactions.layout().clone(), SAMPLES);
            open.reaction_regressor(motion, &[], &reactions, &mut effort, &mut rows);
            let (mut work, mut effort) = (dynamics.workspace(), vec![0.0; rates]);
            for s in 0..SAMPLES {
                let at = |x: &[f64]| -> Vec<f64> { (0..rates).map(|r| x[r * motion.stride + s]).collect() };
                let (q, dq, ddq) = (at(motion.q), at(motion.dq), at(motion.ddq));
                let state = State { q: &q, dq: &dq, ddq: &ddq, gravity: None };
                dynamics.inverse_dynamics(&state, &mechanism.inertia_vector(), &mut work, &mut effort);
                let wrenches: Vec<f64> =
                    (0..mechanism.bodies().len()).flat_map(|b| dynamics.joint_wrench(b, &work)).collect();
                let found: Vec<f64> = (0..list.len()).map(|k| rows.effort(k, &linear)[s]).collect();
                check_close(&found, &wrenches, 1e-11, "x");
            }
        });
    }
}

/// Friction in all joints, of the forces across their axes.
fn pressed(mechanism: &Mechanism, linear: &[f64], shape: &[f64], linearised: bool) -> ClosedModel {
    let setting = ShapeSetting { start: 0.5, lower: 0.1, upper: 2.0, held: false };
    let law = |rate| Stribeck { vs: setting, ..Stribeck::new(rate) };
    let elements: Vec<Box<dyn JointElement>> = (0..mechanism.rates())
        .map(|rate| Box::new(ReactionFriction { law: law(rate), falls: true, viscous: true }) as _)
        .collect();
    let tree = TreeModel::new(mechanism.clone(), elements);
    let bodies = mechanism.rate_bodies();
    let load = |rate: usize| JointLoad {
        rate,
        reactions: vec![LoadGroup {
            components: [0, 1, 2].map(|component| Reaction::Joint { body: bodies[rate], component }).to_vec(),
            factor: 0.02,
        }],
        weight: vec![(10 * bodies[rate], 0.1)],
        constant: 0.5,
    };
    let open = ClosedMechanism::open(mechanism.clone()).unwrap();
    let reference = LoadReference { linear: linear.to_vec(), shape: shape.to_vec(), linearised };
    ClosedModel::new(tree, open).with_loads((0..mechanism.rates()).map(load).collect(), reference).unwrap()
}

#[test]
fn the_linearised_regressor_of_a_tree_is_the_derivative_of_the_effort() {
    let mechanism = mechanism(3);
    let mut linear = mechanism.inertia_vector();
    (0..mechanism.rates()).for_each(|_| linear.extend([0.2, 0.35, 0.05]));
    let shape = vec![0.5; mechanism.rates()];
    let truth = |linear: &[f64]| pressed(&mechanism, linear, &shape, false);
    truth(&linear).random_motion(SAMPLES, 9).with_block(|motion| {
        let model = pressed(&mechanism, &linear, &shape, true);
        check_close(
            &efforts(&model, motion, &shape, &linear),
            &efforts(&truth(&linear), motion, &shape, &linear),
            1e-12,
            "x",
        );
        let rows = regressor(&model, motion, &shape);
        for (column, value) in linear.iter().enumerate() {
            let at = |by: f64| {
                let mut moved = linear.clone();
                moved[column] += by;
                efforts(&truth(&moved), motion, &shape, &moved)
            };
            let h = 1e-4 * value.abs().max(1e-2);
            let (more, less, more_2, less_2) = (at(h), at(-h), at(2.0 * h), at(-2.0 * h));
            let expected: Vec<f64> = (0..more.len())
                .map(|i| (8.0 * (more[i] - less[i]) - (more_2[i] - less_2[i])) / (12.0 * h))
                .collect();
            let mut found = vec![0.0; expected.len()];
            for output in 0..mechanism.rates() {
                if let Ok(place) = model.layout().columns(output).binary_search(&column) {
                    found[output * SAMPLES..][..SAMPLES].copy_from_slice(rows.column(output, place));
                }
            }
            check_close(&found, &expected, 1e-6, "x");
        }
    });
}

#[test]
fn joints_that_float_are_refused() {
    let mut description = tree(3, 1);
    description.floating_base = true;
    let refused = ClosedMechanism::open(description.build().unwrap());
    assert!(matches!(refused, Err(ClosedError::Floating { .. })), "{refused:?}");
}
