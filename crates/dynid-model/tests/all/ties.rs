//! Models with tied parameters against the same models without, at parameters that obey the ties.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use crate::random_tree::{check_close, generator, numbers, tree};
use dynid_model::element::{JointElement, Offset, RotorInertia, Stribeck};
use dynid_model::ties::{Relation, TieError, Ties};
use dynid_model::*;

const SAMPLES: usize = 30;
const JOINTS: usize = 4;

fn mechanism(seed: u64) -> Mechanism {
    let mut description = tree(JOINTS, seed);
    description.joints.iter_mut().for_each(|joint| joint.kind = JointKind::Revolute);
    description.build().unwrap()
}

fn model(seed: u64) -> RobotModel {
    let elements = (0..JOINTS).flat_map(|rate| {
        let mut stribeck = Stribeck::new(rate);
        stribeck.delta.held = false;
        [
            Box::new(stribeck) as Box<dyn JointElement>,
            Box::new(Offset { rate }),
            Box::new(RotorInertia { rate }),
        ]
    });
    RobotModel::new(mechanism(seed), elements.collect())
}

/// Ties of all kinds: two equal bodies, a sum, a known value, multiples across joints, a shaped column that takes in a plain one,
/// one speed for three joints.
fn ties(table: &ParameterTable) -> Ties {
    let column = |name: &str| table.linear.iter().position(|p| p.symbol == name).unwrap();
    let relation = |terms: &[(&str, f64)], value: f64| Relation {
        terms: terms.iter().map(|(name, factor)| (column(name), *factor)).collect(),
        value,
        words: format!("{terms:?}"),
    };
    let bodies = ["m", "mx", "my", "mz", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz"];
    let mut linear: Vec<Relation> =
        bodies.iter().map(|p| relation(&[(&format!("{p}2"), 1.0), (&format!("{p}4"), -1.0)], 0.0)).collect();
    linear.push(relation(&[("m1", 1.0), ("m2", 1.0), ("m3", 1.0)], 9.5));
    linear.push(relation(&[("Ia3", 1.0)], 0.25));
    linear.push(relation(&[("fo1", 2.0), ("fo4", -1.0)], 0.0));
    let stribeck = |joint: usize| {
        let owner = &table.shape[2 * joint].name;
        let joint = owner.split('.').next().unwrap().to_owned();
        let of = |symbol: &str| table.column(&format!("{joint}.{symbol}")).unwrap();
        (of("fc"), of("fs"))
    };
    for joint in 1..3 {
        for (a, b) in [(stribeck(0).0, stribeck(joint).0), (stribeck(0).1, stribeck(joint).1)] {
            linear.push(Relation { terms: vec![(a, 1.0), (b, -1.0)], value: 0.0, words: "friction".into() });
        }
    }
    // A coefficient whose column changes with shapes follows from a plain one of the same joint.
    let (offset, fs) = (column("fo4"), stribeck(3).1);
    linear.push(Relation { terms: vec![(offset, 0.5), (fs, -1.0)], value: 0.0, words: "fs".into() });
    let shape: Vec<Relation> = [(0, 2, 1.0), (0, 4, 1.5), (1, 3, 1.0)]
        .map(|(a, b, ratio)| Relation { terms: vec![(a, ratio), (b, -1.0)], value: 0.0, words: "vs".into() })
        .to_vec();
    Ties::new(&linear, &shape).unwrap()
}

fn random(count: usize, seed: u64) -> Vec<f64> {
    let mut rng = generator(seed);
    (0..count).map(|_| numbers::<1>(&mut rng)[0]).collect()
}

/// Shape parameters within their bounds; those that follow hold rubbish, which no result may show.
fn shapes(model: &RobotModel, seed: u64) -> Vec<f64> {
    let table = &model.parameters().shape;
    let random = random(table.len(), seed);
    table.iter().zip(random).map(|(s, x)| s.start * (1.0 + 0.4 * x)).collect()
}

#[test]
fn tied_columns_give_the_efforts_of_the_whole_model() {
    for seed in 1..5 {
        let whole = model(seed);
        let ties = ties(whole.parameters());
        let tied = model(seed).with_ties(ties.clone()).unwrap();
        let shape = shapes(&tied, seed);
        let mut obeying = shape.clone();
        ties.complete_shape(&mut obeying);
        assert!((obeying[4] - 1.5 * obeying[0]).abs() < 1e-15);
        let linear = random(whole.parameters().linear.len(), seed + 50);
        let mut completed = linear.clone();
        ties.complete(&mut completed);
        tied.random_motion(SAMPLES, seed).with_block(|motion| {
            let mut rows = RegressorBlock::new(tied.layout().clone(), SAMPLES);
            tied.regressor(motion, &shape, &mut rows);
            let mut expected = vec![0.0; JOINTS * SAMPLES];
            whole.efforts(motion, &obeying, &completed, SAMPLES, &mut expected);
            let mut found = expected.clone();
            tied.efforts(motion, &shape, &linear, SAMPLES, &mut found);
            check_close(&found, &expected, 1e-14, "efforts");
            for output in 0..JOINTS {
                let own = rows.effort(output, &linear);
                check_close(&own, &expected[output * SAMPLES..][..SAMPLES], 1e-12, "columns");
                for dependent in ties.linear() {
                    assert!(!tied.layout().columns(output).contains(&dependent.index));
                }
            }
        });
    }
}

#[test]
fn shaped_columns_and_their_derivatives_are_those_of_the_regressor() {
    let tied = model(3).with_ties(ties(model(3).parameters())).unwrap();
    let shape = shapes(&tied, 3);
    let table = tied.parameters();
    assert_eq!((table.shape[2].lower, table.shape[2].upper), (table.shape[0].start, table.shape[0].start));
    let columns = |motion: &MotionBlock<'_>, shape: &[f64]| {
        let mut values = vec![0.0; tied.shaped_columns().len() * SAMPLES];
        tied.shaped(motion, shape, SAMPLES, &mut values, &mut []);
        values
    };
    tied.random_motion(SAMPLES, 3).with_block(|motion| {
        let mut rows = RegressorBlock::new(tied.layout().clone(), SAMPLES);
        tied.regressor(motion, &shape, &mut rows);
        let values = columns(motion, &shape);
        for (k, (output, column)) in tied.shaped_columns().iter().enumerate() {
            let place = tied.layout().columns(*output).iter().position(|c| c == column).unwrap();
            check_close(&values[k * SAMPLES..][..SAMPLES], rows.column(*output, place), 1e-13, "shaped");
        }
        let pairs = tied.shape_dependence();
        let mut slopes = vec![0.0; pairs.len() * SAMPLES];
        tied.shaped(motion, &shape, SAMPLES, &mut [], &mut slopes);
        for parameter in [0, 1, 5, 6, 7] {
            let step = 1e-6 * shape[parameter];
            let moved = |by: f64| {
                let mut shape = shape.clone();
                shape[parameter] += by;
                columns(motion, &shape)
            };
            let (above, below) = (moved(step), moved(-step));
            for k in 0..tied.shaped_columns().len() {
                let at = k * SAMPLES..(k + 1) * SAMPLES;
                let expected: Vec<f64> =
                    above[at.clone()].iter().zip(&below[at]).map(|(a, b)| (a - b) / (2.0 * step)).collect();
                let found = match pairs.iter().position(|p| *p == (k, parameter)) {
                    Some(d) => slopes[d * SAMPLES..][..SAMPLES].to_vec(),
                    None => vec![0.0; SAMPLES],
                };
                check_close(&found, &expected, 1e-7, "derivatives");
            }
        }
        assert!(pairs.iter().all(|(_, shape)| [0, 1, 5, 6, 7].contains(shape)), "{pairs:?}");
    });
}

#[test]
fn adjoints_are_those_of_the_whole_model() {
    let whole = model(4);
    let mut ties = ties(whole.parameters());
    // Offsets have no part in the adjoint of a regressor.
    let homogeneous = |d: &&dynid_model::ties::Dependent| d.constant == 0.0;
    let relations: Vec<Relation> = (ties.linear().iter().filter(homogeneous))
        .map(|d| Relation {
            terms: d.terms.iter().copied().chain([(d.index, -1.0)]).collect(),
            value: 0.0,
            words: String::new(),
        })
        .collect();
    ties = Ties::new(&relations, &[]).unwrap();
    let tied = model(4).with_ties(ties).unwrap();
    let (shape, linear) = (shapes(&tied, 4), random(whole.parameters().linear.len(), 9));
    let side = random(JOINTS * SAMPLES, 10);
    tied.random_motion(SAMPLES, 4).with_block(|motion| {
        let mut weights = RegressorBlock::new(tied.layout().clone(), SAMPLES);
        weights.set_samples(SAMPLES);
        for output in 0..JOINTS {
            for (k, column) in tied.layout().columns(output).to_vec().into_iter().enumerate() {
                let to = weights.column_mut(output, k);
                for (s, w) in to.iter_mut().enumerate() {
                    *w = side[output * SAMPLES + s] * linear[column];
                }
            }
        }
        let mut by_rows = MotionAdjoint::new(tied.dimensions().0, tied.dimensions().1, SAMPLES);
        tied.regressor_adjoint(motion, &shape, &weights, &mut by_rows);
        let mut by_efforts = MotionAdjoint::new(tied.dimensions().0, tied.dimensions().1, SAMPLES);
        tied.effort_adjoint(motion, &shape, &linear, SAMPLES, &side, &mut by_efforts);
        for (a, b) in
            [(&by_rows.q, &by_efforts.q), (&by_rows.dq, &by_efforts.dq), (&by_rows.ddq, &by_efforts.ddq)]
        {
            check_close(a, b, 1e-11, "adjoints");
        }
    });
}

#[test]
fn base_parameters_are_those_of_free_parameters() {
    let whole = model(2);
    let shape = whole.parameters().shape_start();
    let all = BaseParameters::of_model(&whole, &shape, &BaseSettings::default());
    let ties = ties(whole.parameters());
    let tied = model(2).with_ties(ties.clone()).unwrap();
    let base = BaseParameters::of_model(&tied, &shape, &BaseSettings::default());
    assert!(base.len() < all.len(), "{} of {}", base.len(), all.len());
    let of_free = |list: &[usize]| list.iter().all(|c| ties.of_column(*c).is_none());
    assert!(of_free(&base.kept) && of_free(&base.folded));
    assert!(ties.linear().iter().all(|d| base.zero.contains(&d.index)));
    assert!(base.gap.ratio() > 1e6, "{:?}", base.gap);
}

#[test]
fn a_known_part_of_unknown_form_is_refused() {
    let whole = model(1);
    let table = whole.parameters();
    let joint = table.shape[0].name.split('.').next().unwrap();
    let fs = table.column(&format!("{joint}.fs")).unwrap();
    let known = |shapes: &[usize]| {
        let shape: Vec<Relation> = (shapes.iter())
            .map(|k| Relation { terms: vec![(*k, 1.0)], value: table.shape[*k].start, words: String::new() })
            .collect();
        let linear = [Relation { terms: vec![(fs, 1.0)], value: 0.3, words: String::new() }];
        model(1).with_ties(Ties::new(&linear, &shape).unwrap())
    };
    let refused = known(&[]).unwrap_err();
    assert!(
        matches!(&refused, TieError::KnownShaped { parameter, constant: 0.3, .. } if parameter.ends_with(".fs"))
    );
    assert!(known(&[0, 1]).is_ok());
    // Values that no bound allows.
    let of = |a: usize, value: f64| Relation { terms: vec![(a, 1.0)], value, words: String::new() };
    let beyond = [of(0, 10.0 * table.shape[0].upper)];
    let refused = model(1).with_ties(Ties::new(&[], &beyond).unwrap()).unwrap_err();
    assert!(matches!(refused, TieError::ShapeRange { .. }), "{refused}");
    let ratio = [Relation { terms: vec![(0, 1.5), (2, -1.0)], value: 0.0, words: String::new() }];
    let tied = model(1).with_ties(Ties::new(&[], &ratio).unwrap()).unwrap();
    let (free, own) = (&tied.parameters().shape[0], &table.shape[2]);
    assert!((free.upper - own.upper / 1.5).abs() < 1e-15 && free.lower == table.shape[0].lower, "{free:?}");
}
