//! Friction that follows reactions.

use dynid_linalg::Mat;
use dynid_model::closed::ClosedMechanism;
use dynid_model::element::{JointElement, ReactionFriction, Stribeck};
use dynid_model::*;

use crate::golden::check_close;
use crate::robots::robot;

const SAMPLES: usize = 200;

/// A five-bar with friction in the pins of some rates, each of 12 mm radius.
fn model(rates: &[usize], name: &str) -> ClosedModel {
    let machine = robot(name).close();
    let elements: Vec<Box<dyn JointElement>> = rates
        .iter()
        .map(|rate| {
            Box::new(ReactionFriction { law: Stribeck::new(*rate), falls: false, viscous: false }) as _
        })
        .collect();
    ClosedModel::new(TreeModel::new(machine.mechanism().clone(), elements), machine)
}

fn load(machine: &ClosedMechanism, rate: usize, radius: f64) -> JointLoad {
    let body = machine.mechanism().rate_bodies()[rate];
    let components = [0, 1].map(|component| Reaction::Joint { body, component }).to_vec();
    JointLoad {
        rate,
        reactions: vec![LoadGroup { components, factor: radius }],
        weight: Vec::new(),
        constant: 0.0,
    }
}

fn loaded(rates: &[usize], linear: &[f64], linearised: bool) -> ClosedModel {
    let model = model(rates, "fivebar");
    let loads = rates.iter().map(|r| load(model.machine(), *r, 0.012)).collect();
    let reference = LoadReference { linear: linear.to_vec(), shape: Vec::new(), linearised };
    model.with_loads(loads, reference).unwrap()
}

/// Inertias of the file, then one coefficient a pin.
fn truth(model: &ClosedModel) -> Vec<f64> {
    let mut truth = model.tree().mechanism().inertia_vector();
    truth.extend((30..30 + model.parameters().linear.len()).map(|k| 0.1 + 0.02 * (k % 7) as f64));
    truth.truncate(model.parameters().linear.len());
    truth
}

fn efforts(model: &ClosedModel, motion: &MotionBlock<'_>, linear: &[f64]) -> Vec<f64> {
    let mut effort = vec![0.0; model.outputs().len() * motion.samples];
    model.efforts(motion, &[], linear, motion.samples, &mut effort);
    effort
}

fn columns(model: &ClosedModel, motion: &MotionBlock<'_>) -> Vec<Vec<f64>> {
    let mut block = RegressorBlock::new(model.layout().clone(), motion.samples);
    model.regressor(motion, &[], &mut block);
    let (n, layout) = (motion.samples, model.layout());
    let mut columns = vec![vec![0.0; layout.outputs() * n]; layout.parameters()];
    for output in 0..layout.outputs() {
        for (k, column) in layout.columns(output).iter().enumerate() {
            columns[*column][output * n..][..n].copy_from_slice(block.column(output, k));
        }
    }
    columns
}

/// Least change of parameters, relative to their size, that explains what is left.
fn fit(columns: &[Vec<f64>], left: &[f64], size: &[f64]) -> Vec<f64> {
    let w = Mat::from_fn(left.len(), columns.len(), |i, j| columns[j][i] * size[j]);
    let svd = w.svd().unwrap();
    let (u, s, v) = (svd.u, svd.values, svd.v);
    let mut change = vec![0.0; columns.len()];
    for k in (0..s.len()).filter(|k| s[*k] > 1e-9 * s[0]) {
        let along = left.iter().enumerate().map(|(i, l)| u[(i, k)] * l).sum::<f64>() / s[k];
        change.iter_mut().enumerate().for_each(|(j, c)| *c += along * v[(j, k)] * size[j]);
    }
    change
}

fn length(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Rounds until the residual stands still: parameters, residual relative to the friction, rounds.
fn identify(rates: &[usize], linearised: bool, rounds: usize) -> (Vec<f64>, Vec<f64>) {
    let plain = model(rates, "fivebar");
    let truth = truth(&plain);
    let size: Vec<f64> = truth.iter().map(|x| x.abs().max(1e-3)).collect();
    plain.random_motion(SAMPLES, 7).with_block(|motion| {
        let measured = efforts(&loaded(rates, &truth, false), motion, &truth);
        let mut rigid = truth.clone();
        rigid[40..].fill(0.0);
        let friction: Vec<f64> = measured
            .iter()
            .zip(efforts(&loaded(rates, &rigid, false), motion, &rigid))
            .map(|(a, b)| a - b)
            .collect();
        let mut x: Vec<f64> =
            truth.iter().enumerate().map(|(k, x)| x * if k % 2 == 0 { 1.2 } else { 0.8 }).collect();
        let mut residuals = Vec::new();
        for _ in 0..rounds {
            let model = loaded(rates, &x, linearised);
            let left: Vec<f64> =
                measured.iter().zip(efforts(&model, motion, &x)).map(|(m, e)| m - e).collect();
            residuals.push(length(&left) / length(&friction));
            let change = fit(&columns(&model, motion), &left, &size);
            x.iter_mut().zip(change).for_each(|(x, c)| *x += c);
        }
        (x, residuals)
    })
}

#[test]
fn friction_makes_hidden_combinations_visible() {
    let plain = model(&[0, 2], "fivebar");
    let truth = truth(&plain);
    plain.random_motion(SAMPLES, 7).with_block(|motion| {
        let exact = columns(&loaded(&[0, 2], &truth, true), motion);
        let frozen = columns(&loaded(&[0, 2], &truth, false), motion);
        // One coefficient for both pins.
        let tied = |columns: &[Vec<f64>]| {
            let mut tied = columns[..41].to_vec();
            tied[40].iter_mut().zip(&columns[41]).for_each(|(a, b)| *a += b);
            tied
        };
        // Eleven combinations of inertias and the coefficients; two more come with the loads.
        let rank = super::rank;
        assert_eq!([rank(&frozen[..40]), rank(&tied(&frozen)), rank(&frozen)], [11, 12, 13]);
        assert_eq!([rank(&exact[..40]), rank(&tied(&exact)), rank(&exact)], [13, 14, 15]);
        let rigid = robot("fivebar").model();
        let forces: Vec<Reaction> = [0, 2]
            .into_iter()
            .flat_map(|rate| load(rigid.machine(), rate, 1.0).reactions[0].components.clone())
            .collect();
        let seen = BaseParameters::with_reactions(&rigid, &forces, &[], &BaseSettings::default());
        assert_eq!(seen.len(), 13);
    });
}

#[test]
fn linearised_loads_recover_friction_and_all_that_is_seen() {
    let rates = [0, 2];
    let (found, residuals) = identify(&rates, true, 10);
    println!("linearised: residuals {residuals:?}");
    let truth = truth(&model(&rates, "fivebar"));
    check_close(&found[40..], &truth[40..], 1e-8, 0.0, "coefficients");
    let plain = model(&rates, "fivebar");
    plain.random_motion(SAMPLES, 8).with_block(|motion| {
        let exact = columns(&loaded(&rates, &truth, true), motion);
        let measured = efforts(&loaded(&rates, &truth, false), motion, &truth);
        let mut seen = vec![0.0; measured.len()];
        for (column, (f, t)) in exact.iter().zip(found.iter().zip(&truth)) {
            seen.iter_mut().zip(column).for_each(|(s, c)| *s += c * (f - t));
        }
        println!("combinations: {:.1e}", length(&seen) / length(&measured));
        assert!(length(&seen) < 1e-8 * length(&measured));
    });
}

#[test]
fn frozen_loads_settle_next_to_the_truth() {
    let rates = [0, 2];
    let (found, residuals) = identify(&rates, false, 10);
    let truth = truth(&model(&rates, "fivebar"));
    let off: Vec<f64> = found[40..].iter().zip(&truth[40..]).map(|(f, t)| f / t - 1.0).collect();
    println!("frozen: residuals {residuals:?}, coefficients off by {off:?}");
    let last = residuals[residuals.len() - 1];
    // What only the reactions see stays at the prior.
    assert!(off.iter().all(|o| (1e-6..2e-2).contains(&o.abs())), "{off:?}");
    assert!((1e-6..5e-2).contains(&last), "{last:e}");
    assert!((residuals[5] / last - 1.0).abs() < 1e-2, "settled after five rounds: {residuals:?}");
}

#[test]
fn the_linearised_regressor_is_the_derivative_of_the_effort() {
    // Friction in joints without drive acts on its own loads.
    for rates in [vec![0, 2], vec![0, 1, 2, 3]] {
        let plain = model(&rates, "fivebar");
        let truth = truth(&plain);
        plain.random_motion(20, 9).with_block(|motion| {
            let found = columns(&loaded(&rates, &truth, true), motion);
            let effort = efforts(&loaded(&rates, &truth, true), motion, &truth);
            check_close(
                &efforts(&loaded(&rates, &truth, false), motion, &truth),
                &effort,
                0.0,
                1e-11,
                "effort",
            );
            for (k, column) in found.iter().enumerate() {
                let at = |by: f64| {
                    let mut moved = truth.clone();
                    moved[k] += by;
                    efforts(&loaded(&rates, &moved, false), motion, &moved)
                };
                let h = 1e-4 * truth[k].abs().max(1e-2);
                let (more, less, more_2, less_2) = (at(h), at(-h), at(2.0 * h), at(-2.0 * h));
                let expected: Vec<f64> = (0..more.len())
                    .map(|i| (8.0 * (more[i] - less[i]) - (more_2[i] - less_2[i])) / (12.0 * h))
                    .collect();
                check_close(column, &expected, 1e-8, 1e-6, &format!("{rates:?} column {k}"));
            }
        });
    }
}

#[test]
fn friction_in_all_pins_settles() {
    let rates = [0, 1, 2, 3];
    for (name, rates) in [("fivebar", &rates[..]), ("fourbar", &rates[..3])] {
        for radius in [0.005, 0.02, 0.05] {
            let plain = model(rates, name);
            let mut linear = plain.tree().mechanism().inertia_vector();
            linear.resize(plain.parameters().linear.len(), 0.1);
            let loads = rates.iter().map(|r| load(plain.machine(), *r, radius)).collect();
            let reference = LoadReference { linear: linear.clone(), shape: Vec::new(), linearised: false };
            let loaded = plain.with_loads(loads, reference).unwrap();
            loaded.random_motion(SAMPLES, 3).with_block(|motion| {
                let (forces, change) = loaded.load_forces(motion);
                println!("{name}, mu r = {} mm: change {change:.1e}", 100.0 * radius);
                assert!(change <= 1e-12, "{name} {radius}: {change:e}");
                assert!(forces.iter().flatten().flatten().all(|f| f.is_finite() && *f >= 0.0));
            });
        }
    }
}
