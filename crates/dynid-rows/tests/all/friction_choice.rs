//! Friction shapes chosen on made-up logs whose friction is known.
#![expect(clippy::unwrap_used, reason = "in tests a panic is the report")]

use crate::arm::{self, JOINTS, NOISE, RATE_HZ, model, motion};
use dynid_model::{BaseParameters, BaseSettings, EffortModel, MotionBlock, RegressorBlock, RobotModel};
use dynid_motion::{JointSignals, Log};
use dynid_rows::conditioning::{
    Conditioning, ConditioningSettings, FrictionChoice, PreparedLog, ShapeKind, choose_friction, condition,
    prepare,
};

const ALL: [ShapeKind; 5] = [
    ShapeKind::ViscousMagnitude,
    ShapeKind::Stribeck,
    ShapeKind::Tanh,
    ShapeKind::Load,
    ShapeKind::MaxwellSlip,
];

struct Case {
    model: RobotModel,
    base: BaseParameters,
    settings: ConditioningSettings,
    logs: Vec<PreparedLog>,
    choices: Conditioning,
}

impl Case {
    /// A log with linear friction and `friction(joint, v, rigid effort)` on top; `way(joint)`: whether a joint turns to and fro.
    fn new(
        seconds: f64,
        seed: u64,
        kernel_hz: Option<f64>,
        friction: impl Fn(usize, f64, f64) -> f64,
        way: impl Fn(usize) -> bool,
    ) -> Case {
        let model = model();
        let base = BaseParameters::of(&model, model.mechanism(), &[], &BaseSettings::default());
        let settings = ConditioningSettings { kernel_hz, ..ConditioningSettings::default() };
        let samples = (seconds * RATE_HZ) as usize;
        let (mut q, mut dq, ddq) = motion(samples, seed);
        for joint in (0..JOINTS).filter(|j| !way(*j)) {
            let range = joint * samples..(joint + 1) * samples;
            let fastest = dq[range.clone()].iter().fold(0.0_f64, |a, v| a.max(v.abs()));
            for (k, i) in range.enumerate() {
                q[i] += 1.2 * fastest * k as f64 / RATE_HZ;
                dq[i] += 1.2 * fastest;
            }
        }
        let mut linear = model.parameters().prior();
        for (column, parameter) in model.parameters().linear.iter().enumerate() {
            match parameter.name.split('.').next_back() {
                Some("fc") => linear[column] = 5.0,
                Some("fv") => linear[column] = 4.0,
                _ => {}
            }
        }
        let rigid = model.parameters().prior();
        let mut block = RegressorBlock::new(model.layout().clone(), samples);
        let moving = MotionBlock::plain(samples, &q, &dq, &ddq);
        model.regressor(&moving, &[], &mut block);
        let joints = (0..JOINTS)
            .map(|joint| {
                let range = joint * samples..(joint + 1) * samples;
                let noise = arm::noise(joint, samples, 100 + seed, 0.0);
                let effort = block.effort(joint, &linear);
                let loads = block.effort(joint, &rigid);
                let more = dq[range.clone()].iter().zip(loads).map(|(v, load)| friction(joint, *v, load));
                JointSignals {
                    name: format!("j{}", joint + 1),
                    position: q[range].to_vec(),
                    velocity: None,
                    effort: effort.iter().zip(more).zip(noise).map(|((e, f), n)| e + f + n).collect(),
                }
            })
            .collect();
        let time = (0..samples).map(|k| k as f64 / RATE_HZ).collect();
        let log = Log::new(format!("log {seed}"), time, joints, vec![]).unwrap();
        let logs = vec![prepare(&log, &model, &settings).unwrap()];
        let choices = condition(&model, &[], &base.kept, &logs, &settings, &mut |_| {}).unwrap();
        Case { model, base, settings, logs, choices }
    }

    fn choose(&self, kinds: &[ShapeKind]) -> FrictionChoice {
        let kinds = vec![kinds.to_vec(); JOINTS];
        let Case { model, base, settings, logs, choices } = self;
        choose_friction(model, &[], &base.kept, logs, &kinds, None, choices, settings, &mut |_| {}).unwrap()
    }
}

/// Friction that falls by `size` noise deviations from rest, `v_s` 0.1 rad/s.
fn stribeck(joint: usize, v: f64, size: f64) -> f64 {
    size * NOISE[joint] * v.signum() * (-(v / 0.1).powi(2)).exp()
}

#[test]
fn stribeck_friction_is_found_where_it_is() {
    let with = [1, 4];
    let friction =
        |joint: usize, v: f64, _: f64| if with.contains(&joint) { stribeck(joint, v, 4.0) } else { 0.0 };
    let case = Case::new(40.0, 0, None, friction, |_| true);
    let found = case.choose(&ALL);
    for (joint, choice) in found.per_output.iter().enumerate() {
        println!("joint {}: {choice:?}", joint + 1);
        if !with.contains(&joint) {
            assert!(choice.accepted.is_empty(), "joint {}", joint + 1);
            assert!(!choice.rejected.is_empty());
            assert_eq!(found.conditioning.rung[joint], case.choices.rung[joint]);
            continue;
        }
        let [shape] = &choice.accepted[..] else { panic!("joint {}: {:?}", joint + 1, choice.accepted) };
        assert_eq!(shape.shape.kind, ShapeKind::Stribeck);
        assert!((0.08..0.125).contains(&shape.shape.value), "{:?}", shape.shape);
        assert!(shape.gain > 3.0 * shape.standard_error);
    }
    let error = |c: &Conditioning| (c.delay.samples).abs();
    assert!(error(&found.conditioning) < 0.1, "{:?}", found.conditioning.delay);
    assert_eq!(case.choose(&ALL), found, "the same bits again");
    let without = case.choose(&[ShapeKind::ViscousMagnitude]);
    assert!(without.per_output.iter().all(|o| o.accepted.is_empty()));
    assert_eq!(without.conditioning, case.choices, "nothing chosen, nothing changed");
}

#[test]
fn linear_friction_asks_for_no_shape() {
    let found = shapes_of_linear_friction(4);
    assert!(found.is_empty(), "{found:?}");
}

#[test]
#[ignore = "five seconds; the ordinary run takes four logs"]
fn linear_friction_of_many_logs_asks_for_no_shape() {
    let found = shapes_of_linear_friction(10);
    assert!(found.len() <= 1, "{found:?}");
}

/// Shapes that are found on so many logs of six joints without any.
fn shapes_of_linear_friction(logs: u64) -> Vec<String> {
    let of_log = |seed: u64| {
        let found = Case::new(20.0, seed, None, |_, _, _| 0.0, |_| true).choose(&ALL);
        let accepted = found.per_output.into_iter().flat_map(|choice| choice.accepted);
        accepted.map(|a| format!("log {seed}: {a:?}")).collect::<Vec<_>>()
    };
    (0..logs).flat_map(of_log).collect()
}

#[test]
fn friction_of_a_loaded_gear_is_found_where_it_is() {
    let with = 1;
    let friction = |joint: usize, v: f64, load: f64| {
        if joint == with { 0.1 * load.abs() * v.signum() } else { 0.0 }
    };
    let case = Case::new(40.0, 2, None, friction, |_| true);
    let found = case.choose(&ALL);
    for (joint, choice) in found.per_output.iter().enumerate() {
        println!("joint {}: {choice:?}", joint + 1);
        let kinds: Vec<ShapeKind> = choice.accepted.iter().map(|a| a.shape.kind).collect();
        assert_eq!(
            kinds,
            if joint == with { vec![ShapeKind::Load] } else { Vec::new() },
            "joint {}",
            joint + 1
        );
    }
    let inertial = case.model.mechanism().inertial_parameters();
    assert!(
        found.load[..inertial].iter().any(|x| *x != 0.0) && found.load[inertial..].iter().all(|x| *x == 0.0)
    );
}

#[test]
fn joints_that_turn_one_way_get_no_shape() {
    let case = Case::new(20.0, 3, None, |joint, v, _| stribeck(joint, v, 4.0), |joint| joint != 2);
    let found = case.choose(&ALL);
    assert!(found.per_output[2].accepted.is_empty() && found.per_output[2].rejected.is_empty());
    assert!(!found.per_output[1].rejected.is_empty() || !found.per_output[1].accepted.is_empty());
}

#[test]
fn a_log_too_short_for_held_out_blocks_asks_for_nothing() {
    let case = Case::new(3.0, 1, Some(1.0), |joint, v, _| stribeck(joint, v, 4.0), |_| true);
    let found = case.choose(&ALL);
    // The narrowest kernel (4 Hz) reaches 0.23 s to either side, a block is 0.375 s long: no row lies in one.
    assert!(found.per_output.iter().all(|c| c.blocks == 0 && c.accepted.is_empty() && c.rejected.is_empty()));
    assert_eq!(found.conditioning, case.choices);
}

/// Friction that gives way: a spring of 2 mrad in series with friction of `size` noise deviations.
fn slips(size: f64, with: &[usize]) -> impl Fn(usize, f64, f64) -> f64 {
    let springs = std::cell::RefCell::new([0.0_f64; JOINTS]);
    move |joint, v, _| {
        let spring = &mut springs.borrow_mut()[joint];
        *spring = (*spring + v / RATE_HZ / 0.002).clamp(-1.0, 1.0);
        if with.contains(&joint) { size * NOISE[joint] * *spring } else { 0.0 }
    }
}

#[test]
fn friction_that_gives_way_is_found_where_it_is() {
    let with = [0, 3];
    let case = Case::new(40.0, 5, None, slips(6.0, &with), |_| true);
    let found = case.choose(&ALL);
    for (joint, choice) in found.per_output.iter().enumerate() {
        println!("joint {}: {choice:?}", joint + 1);
        let springs: Vec<_> =
            choice.accepted.iter().filter(|t| t.shape.kind == ShapeKind::MaxwellSlip).collect();
        if !with.contains(&joint) {
            assert!(springs.is_empty() && !choice.has_spring(), "joint {}: {springs:?}", joint + 1);
            continue;
        }
        let [spring] = springs[..] else { panic!("joint {}: {:?}", joint + 1, choice.accepted) };
        assert!((0.001..0.004).contains(&spring.shape.value), "{:?}", spring.shape);
        assert!(spring.gain > 3.0 * spring.standard_error);
        assert_eq!((found.conditioning.rung[joint], found.conditioning.mask[joint]), (0, None), "no mask");
    }
}
