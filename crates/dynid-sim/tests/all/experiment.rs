//! Whole experiments: the truth obeys the model, faults are what they say and keep to themselves.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use crate::arm::{self, arm, plant, slider};
use dynid_model::element::{
    Coulomb, ElementColumns, ElementWeights, JointElement, JointInfo, RotorInertia, Spring, Viscous,
};
use dynid_model::{EffortModel, MotionAdjoint, MotionBlock, Parameter, RegressorBlock};
use dynid_sim::*;

/// Viscous friction that falls with temperature: column `v (1 - 0.02 (T - 20))`.
#[derive(Debug)]
struct Lubricant {
    rate: usize,
}

impl JointElement for Lubricant {
    fn rates(&self) -> Vec<usize> {
        vec![self.rate]
    }
    fn parameters(&self, joints: &[JointInfo]) -> Vec<Parameter> {
        vec![joints[self.rate].parameter("lub", ["N m s/rad", "N s/m"], Some(0.0))]
    }
    fn entries(&self) -> Vec<(usize, usize)> {
        vec![(self.rate, 0)]
    }
    fn channels(&self, _: &[JointInfo]) -> Vec<String> {
        vec!["temperature".into()]
    }
    fn fill(&self, _: &[JointInfo], motion: &MotionBlock<'_>, _: &[f64], out: &mut ElementColumns<'_>) {
        let warm = motion.channel("temperature").unwrap();
        let v = motion.rate(self.rate);
        for ((to, v), t) in out.column(0).iter_mut().zip(v).zip(warm) {
            *to = v * (1.0 - 0.02 * (t - 20.0));
        }
    }
    fn adjoint(
        &self,
        _: &[JointInfo],
        motion: &MotionBlock<'_>,
        _: &[f64],
        weights: &ElementWeights<'_>,
        out: &mut MotionAdjoint,
    ) {
        let warm = motion.channel("temperature").unwrap();
        let to = &mut out.dq[self.rate * motion.samples..][..motion.samples];
        for ((to, w), t) in to.iter_mut().zip(weights.column(0)).zip(warm) {
            *to += w * (1.0 - 0.02 * (t - 20.0));
        }
    }
}

fn machine() -> Plant {
    let mut elements: Vec<Box<dyn JointElement>> = Vec::new();
    let mut values = Vec::new();
    for rate in 0..3 {
        elements.push(Box::new(Coulomb { rate }));
        elements.push(Box::new(Viscous { rate }));
        elements.push(Box::new(RotorInertia { rate }));
        values.extend([1.5, 2.0, 0.1]);
    }
    elements.push(Box::new(Lubricant { rate: 1 }));
    values.push(1.2);
    plant(arm(), elements, &values, 1e-3)
}

pub(super) fn reference(t: f64) -> Vec<Wanted> {
    (0..3)
        .map(|j| {
            let (w, phase) = (1.7 + 0.6 * j as f64, j as f64);
            let (s, c) = (w * t + phase).sin_cos();
            [0.2 + 0.7 * s, 0.7 * w * c, -0.7 * w * w * s]
        })
        .collect()
}

fn settings(imperfections: Imperfections) -> ExperimentSettings {
    ExperimentSettings {
        duration_s: 2.0,
        log_rate_hz: 500.0,
        imperfections,
        channels: vec![Profile::new(vec![(0.0, 20.0), (2.0, 35.0)]).unwrap()],
        ..Default::default()
    }
}

fn experiment(settings: &ExperimentSettings) -> ExperimentResult {
    run(&mut machine(), &machine(), &reference, settings).unwrap()
}

/// Largest difference between true effort and inverse dynamics of the true motion, relative to the largest effort.
fn disagreement(plant: &Plant, log: &VirtualLog) -> f64 {
    let rows = log.time.len();
    let flat = |s: &[Vec<f64>]| s.concat();
    let (q, dq, ddq) = (flat(&log.truth.q), flat(&log.truth.dq), flat(&log.truth.ddq));
    let names = plant.model().channels();
    let channels: Vec<(&str, &[f64])> =
        names.iter().zip(&log.channels).map(|(n, v)| (n.as_str(), v.as_slice())).collect();
    let motion = MotionBlock {
        samples: rows,
        stride: rows,
        q: &q,
        dq: &dq,
        ddq: &ddq,
        gravity: None,
        channels: &channels,
        sign_width: plant.sign_width(),
    };
    let mut block = RegressorBlock::new(plant.model().layout().clone(), rows);
    plant.model().regressor(&motion, plant.shape(), &mut block);
    let mut worst = 0.0_f64;
    let largest = log.truth.effort.concat().iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    for (j, effort) in log.truth.effort.iter().enumerate() {
        for (found, expected) in block.effort(j, plant.linear()).iter().zip(effort) {
            worst = worst.max((found - expected).abs() / largest);
        }
    }
    worst
}

#[test]
fn without_imperfections_the_log_is_the_truth_and_obeys_the_model() {
    let found = experiment(&settings(Imperfections::none()));
    let log = &found.log;
    assert!(found.imperfections.is_empty() && log.dropped_rows == 0 && found.saturated_ticks == 0);
    assert_eq!(log.time.len(), 1001);
    assert_eq!((&log.position, &log.effort), (&log.truth.q, &log.truth.effort));
    assert_eq!(log.velocity, log.truth.dq);
    assert!(disagreement(&machine(), log) < 1e-12);
    let scale = found.energy.drive_work.abs() + found.energy.element_work.abs();
    assert!(found.energy.residual().abs() < 1e-8 * scale, "{:?}", found.energy);
    for (t, (q, w)) in
        log.time.iter().zip(log.position[1].iter().zip(log.time.iter().map(|t| reference(*t)[1])))
    {
        assert!((q - w[0]).abs() < 5e-3, "off the reference at {t}");
    }
}

#[test]
fn the_truth_obeys_the_model_with_all_imperfections_and_delays() {
    let mut with =
        settings(Imperfections { ripple_share: 0.05, dropped_share: 0.02, ..Imperfections::default() });
    for (control, effort) in [(0.0, 0.3), (1.4, -0.7), (0.25, 2.5), (2.0, 0.125), (0.7, 0.0)] {
        with.control.delay_ticks = control;
        with.imperfections.effort_delay_samples = effort;
        let found = experiment(&with);
        let worst = disagreement(&machine(), &found.log);
        assert!(worst < 1e-12, "delays {control} and {effort}: {worst:e}");
        assert!(found.log.dropped_rows > 0 && found.log.time.len() == 1001 - found.log.dropped_rows);
    }
}

#[test]
fn the_same_seed_gives_the_same_bits() {
    let with = settings(Imperfections::default());
    let first = experiment(&with);
    assert_eq!(experiment(&with), first);
    assert_ne!(experiment(&ExperimentSettings { seed: 2, ..with }).log.effort, first.log.effort);
}

/// Switching off what does not feed back changes its own signal and nothing else.
#[test]
fn faults_keep_to_themselves() {
    let all = Imperfections { dropped_share: 0.0, ..Imperfections::default() };
    let base = experiment(&settings(all.clone())).log;
    let without = |change: &dyn Fn(&mut Imperfections)| {
        let mut some = all.clone();
        change(&mut some);
        experiment(&settings(some)).log
    };
    let found = without(&|i| i.clock_jitter_s = 0.0);
    assert_ne!(found.time, base.time);
    assert_eq!(VirtualLog { time: base.time.clone(), ..found }, base);
    let found = without(&|i| i.velocity_noise = 0.0);
    assert_ne!(found.velocity, base.velocity);
    assert_eq!(VirtualLog { velocity: base.velocity.clone(), ..found }, base);
    let found = without(&|i| i.outlier_share = 0.0);
    let touched = found.effort[0].iter().zip(&base.effort[0]).filter(|(a, b)| a != b).count();
    assert!(touched > 0 && touched < 10, "{touched} outliers in 1001 samples at one in a thousand");
    assert_eq!(VirtualLog { effort: base.effort.clone(), ..found }, base);
    let found = without(&|i| i.effort_noise_share = 0.0);
    assert_eq!(VirtualLog { effort: base.effort.clone(), ..found }, base);
    let found = without(&|i| i.dropped_share = 0.1);
    let at = |t: f64| base.time.iter().position(|x| *x == t).unwrap();
    assert!(found.dropped_rows > 60 && found.dropped_rows < 140);
    for (row, t) in found.time.iter().enumerate() {
        assert_eq!(found.effort[2][row], base.effort[2][at(*t)]);
        assert_eq!(found.truth.q[2][row], base.truth.q[2][at(*t)]);
    }
}

#[test]
fn noise_has_the_size_that_was_asked_for() {
    let mut with = settings(Imperfections {
        effort_noise_share: 0.03,
        effort_noise: vec![0.4; 3],
        encoder_noise: 1e-4,
        velocity_noise: 2e-3,
        clock_jitter_s: 1e-4,
        ..Imperfections::none()
    });
    with.duration_s = 20.0;
    let log = experiment(&with).log;
    let sd = |a: &[f64], b: &[f64]| {
        (a.iter().zip(b).map(|(x, y)| (x - y).powi(2)).sum::<f64>() / a.len() as f64).sqrt()
    };
    // 10 001 normal numbers: their standard deviation is off by 0.7 %.
    let close =
        |found: f64, expected: f64| assert!((found / expected - 1.0).abs() < 0.035, "{found} {expected}");
    for j in 0..3 {
        let rms = sd(&log.truth.effort[j], &vec![0.0; log.time.len()]);
        close(sd(&log.effort[j], &log.truth.effort[j]), (0.03 * rms).hypot(0.4));
        close(sd(&log.position[j], &log.truth.q[j]), 1e-4);
        close(sd(&log.velocity[j], &log.truth.dq[j]), 2e-3);
    }
    let even: Vec<f64> = (0..log.time.len()).map(|k| k as f64 / 500.0).collect();
    close(sd(&log.time, &even), 1e-4);
}

/// An effort that is `d` samples old stands beside a motion `d` samples later.
#[test]
fn delayed_efforts_belong_to_earlier_motion() {
    let at_once = experiment(&settings(Imperfections::none())).log;
    for whole in [3_i32, -2] {
        let delay = Imperfections { effort_delay_samples: f64::from(whole), ..Imperfections::none() };
        let late = experiment(&settings(delay)).log;
        let (older, newer) = if whole > 0 {
            (&at_once.effort[0], &late.effort[0])
        } else {
            (&at_once.truth.q[0], &late.truth.q[0])
        };
        assert_eq!(older[..900], newer[..900], "one signal stays");
        let (a, b) = if whole > 0 {
            (&at_once.truth.q[0], &late.truth.q[0])
        } else {
            (&at_once.effort[0], &late.effort[0])
        };
        let shift = whole.unsigned_abs() as usize;
        assert_eq!(a[shift..900 + shift], b[..900], "the other moves by {shift}");
    }
    // A fraction: the quarter of a row after a tick, by Taylor's series from the truth at the tick.
    let delay = Imperfections { effort_delay_samples: 0.25, ..Imperfections::none() };
    let late = experiment(&settings(delay)).log;
    let h = 0.25 / 500.0;
    for row in 0..900 {
        let t = &at_once.truth;
        let expected = t.q[1][row] + h * (t.dq[1][row] + 0.5 * h * t.ddq[1][row]);
        // Where friction turns over, acceleration jumps by up to 2 · 1.5 N m / 0.3 kg m² on the way.
        assert!((late.truth.q[1][row] - expected).abs() < 0.5 * h * h * 10.0);
    }
}

#[test]
fn efforts_stay_within_their_limits() {
    let mut with = settings(Imperfections::none());
    with.control.effort_limit = Some(vec![1.0, 25.0, f64::INFINITY]);
    let found = experiment(&with);
    let largest = |j: usize| found.log.effort[j].iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    assert!(found.saturated_ticks > 100 && largest(0) <= 1.0 && largest(1) <= 25.0);
    assert!(disagreement(&machine(), &found.log) < 1e-12);
}

/// A driven slider carries a passive one on a spring: unactuated, compliant, and the balance still closes.
#[test]
fn passive_joints_swing_on_their_springs() {
    use dynid_model::{Inertia, JointKind};
    let body = |m: f64| Inertia([m, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let x = [1.0, 0.0, 0.0];
    let build = || {
        let joints = [(JointKind::Prismatic, x, body(2.0)), (JointKind::Prismatic, x, body(0.5))];
        let elements: Vec<Box<dyn JointElement>> =
            vec![Box::new(Spring { rate: 1 }), Box::new(Viscous { rate: 1 })];
        plant(arm::chain(&joints, [0.0; 3]), elements, &[800.0, 0.0, 0.2], 1e-3)
    };
    let wanted =
        |t: f64| vec![[0.1 * (3.0 * t).sin(), 0.3 * (3.0 * t).cos(), -0.9 * (3.0 * t).sin()], [0.0; 3]];
    let mut with = settings(Imperfections::none());
    with.channels.clear();
    with.control.passive = vec![1];
    let found = run(&mut build(), &build(), &wanted, &with).unwrap();
    assert!(found.log.effort[1].iter().all(|e| *e == 0.0));
    let swing = found.log.position[1].iter().fold(0.0_f64, |m, q| m.max(q.abs()));
    // Quasi-static deflection: 0.5 kg · 0.9 m/s² / 800 N/m, about doubled by the swing.
    assert!((4e-4..2e-3).contains(&swing), "{swing}");
    assert!(disagreement(&build(), &found.log) < 1e-12);
    let scale = found.energy.drive_work.abs() + found.energy.element_work.abs();
    assert!(found.energy.residual().abs() < 1e-8 * scale, "{:?}", found.energy);
}

#[test]
fn settings_out_of_range_are_named() {
    let fails = |change: &dyn Fn(&mut ExperimentSettings)| {
        let mut s = settings(Imperfections::none());
        change(&mut s);
        run(&mut machine(), &machine(), &reference, &s).unwrap_err().to_string()
    };
    assert!(fails(&|s| s.log_rate_hz = 300.0).contains("log rate"));
    assert!(fails(&|s| s.duration_s = -1.0).contains("duration"));
    assert!(fails(&|s| s.tolerance = 0.0).contains("tolerance"));
    assert!(fails(&|s| s.channels.clear()).contains("temperature"));
    assert!(fails(&|s| s.control.bandwidth_hz = 400.0).contains("bandwidth"));
    assert!(fails(&|s| s.control.position_gain = Some(vec![1.0])).contains("expected 3 entries"));
    assert!(fails(&|s| s.control.passive = vec![3]).contains("passive"));
    assert!(fails(&|s| s.imperfections.outlier_share = 0.7).contains("outlier_share"));
    let short = |_: f64| vec![[0.0; 3]];
    let s = settings(Imperfections::none());
    assert!(matches!(run(&mut machine(), &machine(), &short, &s), Err(SimError::Length { .. })));
    let mut heavy = slider(1.0, vec![], &[], 1e-3);
    let s = ExperimentSettings { channels: vec![], ..s };
    let still = |_: f64| vec![[0.0; 3]];
    assert!(run(&mut heavy, &slider(1.0, vec![], &[], 1e-3), &still, &s).is_ok());
}

/// Experiments of a wrong model and a late controller are stable with the default gains.
#[test]
fn feedback_makes_up_for_a_wrong_model_and_a_late_command() {
    let truth = machine();
    let wrong = wrong_model(truth.linear(), 0.2, 3);
    assert_eq!(wrong, wrong_model(truth.linear(), 0.2, 3));
    let mut nominal_values = wrong;
    let mechanism = arm();
    let bodies = 10 * mechanism.bodies().len();
    let (inertias, elements) = nominal_values.split_at_mut(bodies);
    let inertias: Vec<_> =
        inertias.chunks_exact(10).map(|c| dynid_model::Inertia(c.try_into().unwrap())).collect();
    let mut parts: Vec<Box<dyn JointElement>> = Vec::new();
    for rate in 0..3 {
        parts.push(Box::new(Coulomb { rate }));
        parts.push(Box::new(Viscous { rate }));
        parts.push(Box::new(RotorInertia { rate }));
    }
    parts.push(Box::new(Lubricant { rate: 1 }));
    let nominal = plant(mechanism.with_inertias(&inertias), parts, elements, 1e-3);
    let mut with = settings(Imperfections::default());
    with.control.delay_ticks = 2.5;
    let found = run(&mut machine(), &nominal, &reference, &with).unwrap();
    for (j, q) in found.log.truth.q.iter().enumerate() {
        let worst = (0..1000.min(q.len()))
            .map(|k| (q[k] - reference(found.log.time[k])[j][0]).abs())
            .fold(0.0, f64::max);
        assert!(worst < 0.1, "joint {j} strays by {worst}");
    }
}
