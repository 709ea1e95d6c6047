//! The effort model of closed mechanisms: against single instants, differences, and other coordinates.

use dynid_model::closed::{ClosedDynamics, ClosedMechanism};
use dynid_model::element::{Coulomb, JointElement, ShapeSetting, Stribeck, Viscous};
use dynid_model::*;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::robot;
use crate::golden::check_close;

/// Independent coordinates within `spread` of home along a smooth path, with rates and accelerations of order one.
pub(crate) struct Motion {
    pub(crate) samples: usize,
    pub(crate) q: Vec<f64>,
    pub(crate) dq: Vec<f64>,
    pub(crate) ddq: Vec<f64>,
}

impl Motion {
    pub(crate) fn new(machine: &ClosedMechanism, samples: usize, spread: f64, rng: &mut impl Rng) -> Motion {
        let mut motion = Motion { samples, q: Vec::new(), dq: Vec::new(), ddq: Vec::new() };
        for home in machine.home_independent() {
            let phase: f64 = rng.random_range(0.0..6.0);
            for s in 0..samples {
                let t = s as f64 * 0.05 + phase;
                motion.q.push(home + spread * (t.sin() - phase.sin()));
                motion.dq.push(rng.random_range(-1.0..1.0));
                motion.ddq.push(rng.random_range(-2.0..2.0));
            }
        }
        motion
    }

    pub(crate) fn block(&self) -> MotionBlock<'_> {
        MotionBlock::plain(self.samples, &self.q, &self.dq, &self.ddq)
    }

    fn at(&self, values: &[f64], sample: usize) -> Vec<f64> {
        values.iter().skip(sample).step_by(self.samples).copied().collect()
    }
}

fn model(name: &str, elements: Vec<Box<dyn JointElement>>) -> Option<ClosedModel> {
    let machine = robot(name)?.close();
    Some(ClosedModel::new(TreeModel::new(machine.mechanism().clone(), elements), machine))
}

/// Friction at all joints that turn or slide, also those without a drive.
fn friction(machine: &ClosedMechanism) -> Vec<Box<dyn JointElement>> {
    let mut elements: Vec<Box<dyn JointElement>> = Vec::new();
    for rate in 0..machine.mechanism().rates() {
        elements.push(Box::new(Coulomb { rate }));
        elements.push(Box::new(Viscous { rate }));
    }
    elements.push(Box::new(Stribeck {
        vs: ShapeSetting { start: 0.7, lower: 0.1, upper: 2.0, held: false },
        delta: ShapeSetting { start: 1.5, lower: 0.5, upper: 2.0, held: false },
        rate: machine.driven()[0],
    }));
    elements.push(Box::new(Stribeck {
        vs: ShapeSetting { start: 0.9, lower: 0.1, upper: 2.0, held: false },
        ..Stribeck::new(machine.dependent()[0])
    }));
    elements
}

#[test]
fn blocks_are_instants() {
    for name in ["fourbar", "fivebar", "delta", "stewart"] {
        let Some(model) = model(name, Vec::new()) else { return };
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let motion = Motion::new(model.machine(), 9, 0.05, &mut rng);
        let phi = model.tree().mechanism().inertia_vector();
        let mut block = RegressorBlock::new(model.layout().clone(), motion.samples);
        model.regressor(&motion.block(), &[], &mut block);
        let outputs = model.outputs().len();
        let mut effort = vec![0.0; outputs * motion.samples];
        model.efforts(&motion.block(), &[], &phi, motion.samples, &mut effort);
        let mut dynamics = ClosedDynamics::new(model.machine().clone());
        for sample in 0..motion.samples {
            dynamics.reach(&motion.at(&motion.q, sample)).unwrap();
            let (dq, ddq) = dynamics.motion(&motion.at(&motion.dq, sample), &motion.at(&motion.ddq, sample));
            let expected = dynamics.inverse_dynamics((&dq, &ddq), None, &phi).drives;
            let found: Vec<f64> = (0..outputs).map(|o| block.effort(o, &phi)[sample]).collect();
            check_close(&found, &expected, 1e-11, 1e-11, &format!("{name}: W phi, sample {sample}"));
            check_close(
                &motion.at(&effort, sample),
                &expected,
                1e-11,
                1e-11,
                &format!("{name}: efforts, sample {sample}"),
            );
        }
    }
}

#[test]
fn efforts_in_other_coordinates_are_the_same_efforts() {
    let Some(parts) = robot("fivebar") else { return };
    let drives = parts.close();
    let task = drives.clone().with_independent(&["left_crank".into(), "left_distal".into()]).unwrap();
    assert!(!task.drives_are_independent());
    let elements = |m: &ClosedMechanism| -> Vec<Box<dyn JointElement>> {
        (0..m.mechanism().rates()).map(|rate| Box::new(Coulomb { rate }) as _).collect()
    };
    let tree = |m: &ClosedMechanism| TreeModel::new(m.mechanism().clone(), elements(m));
    let (by_drives, by_task) =
        (ClosedModel::new(tree(&drives), drives.clone()), ClosedModel::new(tree(&task), task));
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let motion = Motion::new(&drives, 20, 0.2, &mut rng);
    // The same motion, told by the other coordinates.
    let mut other = Motion { samples: 20, q: vec![0.0; 40], dq: vec![0.0; 40], ddq: vec![0.0; 40] };
    let mut dynamics = ClosedDynamics::new(drives);
    for s in 0..20 {
        dynamics.reach(&motion.at(&motion.q, s)).unwrap();
        let (dq, ddq) = dynamics.motion(&motion.at(&motion.dq, s), &motion.at(&motion.ddq, s));
        for k in 0..2 {
            other.q[20 * k + s] = dynamics.pose().positions()[k];
            (other.dq[20 * k + s], other.ddq[20 * k + s]) = (dq[k], ddq[k]);
        }
    }
    let linear: Vec<f64> = (0..by_drives.parameters().linear.len()).map(|k| 0.3 + (k as f64).sin()).collect();
    let efforts = |model: &ClosedModel, motion: &Motion| {
        let mut effort = vec![0.0; 40];
        model.efforts(&motion.block(), &[], &linear, 20, &mut effort);
        effort
    };
    check_close(&efforts(&by_task, &other), &efforts(&by_drives, &motion), 0.0, 1e-10, "efforts");
}

#[test]
fn derivatives_by_the_motion_are_those_of_differences() {
    for (name, other) in
        [("fourbar", None), ("fivebar", None), ("fivebar", Some(["left_crank", "left_distal"]))]
    {
        let Some(parts) = robot(name) else { return };
        let mut machine = parts.close();
        if let Some(joints) = other {
            machine = machine.with_independent(&joints.map(String::from)).unwrap();
        }
        let elements = friction(&machine);
        let model = ClosedModel::new(TreeModel::new(machine.mechanism().clone(), elements), machine);
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let motion = Motion::new(model.machine(), 6, 0.2, &mut rng);
        let (d, outputs) = (model.machine().mobility(), model.outputs().len());
        let linear: Vec<f64> = (0..model.parameters().linear.len()).map(|k| (k as f64).cos()).collect();
        let shape = model.parameters().shape_start();
        let mut weights = RegressorBlock::new(model.layout().clone(), 6);
        weights.set_samples(6);
        for output in 0..outputs {
            for k in 0..model.layout().columns(output).len() {
                weights.column_mut(output, k).fill_with(|| rng.random_range(-1.0..1.0));
            }
        }
        let asked: Vec<f64> = (0..outputs * 6).map(|_| rng.random_range(-1.0..1.0)).collect();
        let width = |block: &mut MotionBlock<'_>| block.sign_width = 0.1;
        let values = |motion: &Motion| -> [f64; 2] {
            let mut block = motion.block();
            width(&mut block);
            let mut effort = vec![0.0; outputs * 6];
            model.efforts(&block, &shape, &linear, 6, &mut effort);
            let mut w = RegressorBlock::new(model.layout().clone(), 6);
            model.regressor(&block, &shape, &mut w);
            let columns =
                (0..outputs).flat_map(|o| (0..model.layout().columns(o).len()).map(move |k| (o, k)));
            let sum = columns
                .map(|(o, k)| {
                    w.column(o, k).iter().zip(weights.column(o, k)).map(|(a, b)| a * b).sum::<f64>()
                })
                .sum();
            [effort.iter().zip(&asked).map(|(e, a)| e * a).sum(), sum]
        };
        let mut block = motion.block();
        width(&mut block);
        let mut found = [(); 2].map(|()| MotionAdjoint::new(d, d, 6));
        model.effort_adjoint(&block, &shape, &linear, 6, &asked, &mut found[0]);
        model.regressor_adjoint(&block, &shape, &weights, &mut found[1]);
        for (which, found) in found.iter().enumerate() {
            for channel in 0..3 {
                for k in 0..6 * d {
                    let moved = |by: f64| {
                        let mut m = Motion {
                            samples: 6,
                            q: motion.q.clone(),
                            dq: motion.dq.clone(),
                            ddq: motion.ddq.clone(),
                        };
                        [&mut m.q, &mut m.dq, &mut m.ddq][channel][k] += by;
                        values(&m)[which]
                    };
                    let h = 1e-5;
                    let expected =
                        (8.0 * (moved(h) - moved(-h)) - (moved(2.0 * h) - moved(-2.0 * h))) / (12.0 * h);
                    let found = [&found.q, &found.dq, &found.ddq][channel][k];
                    let scale = 1.0 + expected.abs();
                    assert!(
                        (found - expected).abs() < 2e-7 * scale,
                        "{name} {other:?} {which} {channel} {k}: {found} {expected}"
                    );
                }
            }
        }
    }
}

#[test]
fn shaped_columns_are_those_of_the_regressor() {
    let Some(parts) = robot("fivebar") else { return };
    let machine = parts.close();
    let elements = friction(&machine);
    let model = ClosedModel::new(TreeModel::new(machine.mechanism().clone(), elements), machine);
    let motion = Motion::new(model.machine(), 7, 0.2, &mut ChaCha8Rng::seed_from_u64(6));
    let shape = [0.7, 1.5, 0.9];
    let mut block = RegressorBlock::new(model.layout().clone(), 7);
    model.regressor(&motion.block(), &shape, &mut block);
    let mut values = vec![0.0; model.shaped_columns().len() * 7];
    let mut derivatives = vec![0.0; model.shape_dependence().len() * 7];
    model.shaped(&motion.block(), &shape, 7, &mut values, &mut derivatives);
    assert!(!values.is_empty() && !derivatives.is_empty());
    let at = |(output, column): (usize, usize), block: &RegressorBlock| {
        let k = model.layout().columns(output).iter().position(|c| *c == column).unwrap();
        block.column(output, k).to_vec()
    };
    for (k, place) in model.shaped_columns().iter().enumerate() {
        check_close(&values[7 * k..][..7], &at(*place, &block), 1e-14, 1e-13, "values");
    }
    for (k, (of, parameter)) in model.shape_dependence().iter().enumerate() {
        let moved = |by: f64| {
            let mut shape = shape;
            shape[*parameter] += by;
            let mut block = RegressorBlock::new(model.layout().clone(), 7);
            model.regressor(&motion.block(), &shape, &mut block);
            at(model.shaped_columns()[*of], &block)
        };
        let (more, less) = (moved(1e-5), moved(-1e-5));
        let expected: Vec<f64> = more.iter().zip(&less).map(|(a, b)| (a - b) / 2e-5).collect();
        check_close(&derivatives[7 * k..][..7], &expected, 1e-8, 1e-7, "derivatives");
    }
}
