//! Shape parameters fitted to rows of a log through kernels.

use crate::arm;
use dynid_estimate::separable::{SeparableSettings, ShapeVerdict};
use dynid_model::element::{JointElement, Offset, Stribeck, Viscous};
use dynid_model::{BaseParameters, BaseSettings, EffortModel, MotionBlock, RegressorBlock, RobotModel};
use dynid_motion::{JointSignals, Log};
use dynid_rows::conditioning::{ConditioningSettings, condition, prepare, refine};

/// A log of the six-joint arm with Stribeck friction in two joints, conditioned and fitted from starts far off.
#[test]
fn shapes_are_found_from_the_rows_of_a_log() {
    let samples = 36_000;
    let plain = arm::model();
    let elements: Vec<Box<dyn JointElement>> = (0..arm::JOINTS)
        .flat_map(|rate| -> Vec<Box<dyn JointElement>> {
            let others: [Box<dyn JointElement>; 2] = [Box::new(Viscous { rate }), Box::new(Offset { rate })];
            let coulomb: Box<dyn JointElement> = match rate {
                0 | 2 => Box::new(Stribeck::scaled(rate, 1.5)),
                _ => Box::new(dynid_model::element::Coulomb { rate }),
            };
            others.into_iter().chain([coulomb]).collect()
        })
        .collect();
    let model = RobotModel::new(plain.mechanism().clone(), elements);
    let truth = [0.12, 0.2];
    let base = BaseParameters::of(&model, model.mechanism(), &truth, &BaseSettings::default());
    let mut linear = vec![0.0; model.layout().parameters()];
    for (k, parameter) in model.parameters().linear.iter().enumerate() {
        linear[k] = match parameter.name.rsplit('.').next().unwrap() {
            "fc" => 4.0,
            "fs" => 9.0,
            "fv" => 3.0,
            "fo" => 0.5,
            _ => plain.parameters().prior().get(k).copied().unwrap_or(0.0),
        };
    }
    let (q, dq, ddq) = arm::motion(samples, 3);
    let mut block = RegressorBlock::new(model.layout().clone(), samples);
    let moving = MotionBlock::plain(samples, &q, &dq, &ddq);
    model.regressor(&moving, &truth, &mut block);
    let joints = (0..arm::JOINTS)
        .map(|joint| {
            let noise = arm::noise(joint, samples, 5, 0.0);
            JointSignals {
                name: format!("j{}", joint + 1),
                position: q[joint * samples..(joint + 1) * samples].to_vec(),
                velocity: None,
                effort: block.effort(joint, &linear).iter().zip(noise).map(|(e, n)| e + 0.3 * n).collect(),
            }
        })
        .collect();
    let time = (0..samples).map(|k| k as f64 / arm::RATE_HZ).collect();
    let log = Log::new("log", time, joints, vec![]).unwrap();
    let settings = ConditioningSettings { delay_samples: Some(0.0), ..ConditioningSettings::default() };
    let logs = [prepare(&log, &model, &settings).unwrap()];
    let start = model.parameters().shape_start();
    let mut choices = condition(&model, &start, &base.kept, &logs, &settings, &mut |_| {}).unwrap();
    // A joint with a shape keeps its low speeds.
    (choices.rung[0], choices.rung[2]) = (0, 0);
    let started = std::time::Instant::now();
    let estimate =
        refine(&model, &start, &base.kept, &logs, &choices, &settings, &SeparableSettings::default())
            .unwrap();
    let elapsed = started.elapsed();
    let deviations = estimate.jackknife_deviations().unwrap().shape;
    println!(
        "log of {samples} samples, kernel {:.1} Hz: vs {:?} ± {deviations:?} of {truth:?}, {} of {} starts, {} minima, κ {:.2}, rows {}, {elapsed:.2?}",
        choices.kernel_hz,
        estimate.shape,
        estimate.starts.reached,
        estimate.starts.outcomes.len(),
        estimate.starts.distinct,
        estimate.inflation,
        estimate.residuals.iter().map(Vec::len).sum::<usize>()
    );
    for (k, truth) in truth.iter().enumerate() {
        assert_eq!(estimate.findings[k].verdict, ShapeVerdict::Seen);
        let off = (estimate.shape[k] - truth).abs();
        assert!(off < 0.03 * truth, "shape {k}: {} of {truth}", estimate.shape[k]);
    }
}
