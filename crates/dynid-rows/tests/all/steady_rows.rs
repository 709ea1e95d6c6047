//! Points of a friction experiment as rows of an effort model, alone and joined to the rows of a log.
#![expect(clippy::unwrap_used, reason = "in tests a panic is the report")]

use crate::arm;
use dynid_estimate::separable::{
    EffortBlock, EffortProblem, JoinedProblem, SeparableError, SeparableProblem, SeparableSettings,
    ShapedColumns, SteadyFrictionRow, SteadyRows, Weighting, fit,
};
use dynid_model::element::{Coulomb, JointElement, Offset, Stribeck, Viscous};
use dynid_model::{BaseParameters, BaseSettings, EffortModel, MotionBlock, RegressorBlock, RobotModel};

/// Joints with Stribeck friction, and their Stribeck speeds, rad/s.
const FALLING: [usize; 2] = [0, 2];
const TRUTH: [f64; 2] = [0.12, 0.2];
/// Joints of the experiment; the last has Coulomb friction.
const TESTED: [usize; 3] = [0, 2, 3];
const SPEEDS: [f64; 10] = [0.01, 0.03, 0.06, 0.1, 0.15, 0.25, 0.4, 0.8, 1.4, 2.2];

fn model() -> RobotModel {
    let elements = (0..arm::JOINTS)
        .flat_map(|rate| -> [Box<dyn JointElement>; 3] {
            let dry: Box<dyn JointElement> = match FALLING.contains(&rate) {
                true => Box::new(Stribeck::scaled(rate, 1.5)),
                false => Box::new(Coulomb { rate }),
            };
            [dry, Box::new(Viscous { rate }), Box::new(Offset { rate })]
        })
        .collect();
    RobotModel::new(arm::model().mechanism().clone(), elements)
}

/// Standard parameters: those of the bodies as described, and friction that differs from joint to joint.
fn linear(model: &RobotModel) -> Vec<f64> {
    let bodies = model.mechanism().inertia_vector();
    let table = &model.parameters().linear;
    let friction = |name: &str, joint: f64| match name {
        "fc" => 4.0 + joint,
        "fs" => 7.0 + 2.0 * joint,
        "fv" => 3.0 - 0.3 * joint,
        _ => 0.5,
    };
    let named = table[bodies.len()..].iter().map(|p| {
        let (joint, name) = p.name.split_once('.').unwrap();
        friction(name, joint[1..].parse().unwrap())
    });
    bodies.iter().copied().chain(named).collect()
}

fn value(model: &RobotModel, linear: &[f64], name: &str) -> f64 {
    linear[model.parameters().linear.iter().position(|p| p.name == name).unwrap()]
}

/// Points on the true curves, by their closed form. Deviations differ, as those of a test do.
fn points(model: &RobotModel, linear: &[f64]) -> Vec<SteadyFrictionRow> {
    let law = |joint: usize, v: f64| {
        let of = |name: &str| value(model, linear, &format!("j{}.{name}", joint + 1));
        let rise = FALLING
            .iter()
            .position(|j| *j == joint)
            .map_or(0.0, |k| (of("fs") - of("fc")) * (-(v / TRUTH[k]).powi(2)).exp());
        of("fc") + rise + of("fv") * v
    };
    let point = |output: usize, (k, v): (usize, &f64)| SteadyFrictionRow {
        output,
        speed: *v,
        temperature: 30.0,
        friction: law(output, *v),
        std: 0.01 * (1 + k % 3) as f64,
    };
    TESTED.iter().flat_map(|j| SPEEDS.iter().enumerate().map(|at| point(*j, at))).collect()
}

fn settings() -> SeparableSettings {
    SeparableSettings { weighting: Weighting::Equal, profile_points: 0, ..SeparableSettings::default() }
}

/// Without noise only rounding is left, some thousand times over in ill-conditioned columns.
#[track_caller]
fn check_close(found: &[f64], truth: &[f64], relative: f64) {
    assert_eq!(found.len(), truth.len());
    for (k, (x, t)) in found.iter().zip(truth).enumerate() {
        assert!((x - t).abs() <= relative * (1.0 + t.abs()), "{k}: {x} instead of {t}");
    }
}

#[test]
fn inertial_columns_and_offsets_cancel() {
    let model = model();
    let all: Vec<usize> = (0..model.parameters().linear.len()).collect();
    let rows = SteadyRows::new(&model, &all, &points(&model, &linear(&model)), 4).unwrap();
    let outputs: Vec<(usize, usize)> = rows.groups().iter().map(|g| (g.log, g.output)).collect();
    assert_eq!(outputs, TESTED.map(|j| (4, j)));
    let mut friction = 0;
    for group in rows.groups() {
        let n = SPEEDS.len();
        assert_eq!(group.block_rows, vec![1; n], "every point is a block of its own");
        for (column, values) in group.fixed.iter().zip(group.fixed_values.chunks_exact(n)) {
            let name = &model.parameters().linear[*column].name;
            let own = ["fc", "fv"].map(|f| format!("j{}.{f}", group.output + 1));
            if own.contains(name) {
                friction += 1;
                assert!(values.iter().all(|x| *x > 0.0), "{name}");
            } else {
                // Gravity and centrifugal forces of some N m leave their rounding.
                assert!(values.iter().all(|x| x.abs() < 1e-13), "{name}: {values:?}");
            }
        }
    }
    // Viscous friction of three joints, Coulomb friction of one: those of the others change with their shape.
    assert_eq!(friction, 4);
    assert!(matches!(SteadyRows::new(&model, &all, &[], 0), Err(SeparableError::NoRows)));
}

#[test]
fn points_alone_give_back_their_law() {
    let model = model();
    let truth = linear(&model);
    let of_law = |name: &str| {
        TESTED.iter().any(|j| ["fc", "fs", "fv"].iter().any(|f| name == format!("j{}.{f}", j + 1)))
    };
    let table = model.parameters().linear.iter().enumerate();
    let kept: Vec<usize> = table.filter(|(_, p)| of_law(&p.name)).map(|(k, _)| k).collect();
    let rows = SteadyRows::new(&model, &kept, &points(&model, &truth), 0).unwrap();
    let found = fit(&rows, &settings()).unwrap();
    check_close(&found.shape, &TRUTH, 1e-9);
    check_close(&found.linear, &kept.iter().map(|c| truth[*c]).collect::<Vec<f64>>(), 1e-9);
}

#[test]
fn joined_to_a_log_points_and_motion_give_back_everything() {
    let samples = 3000;
    let model = model();
    let truth = linear(&model);
    let base = BaseParameters::of(&model, model.mechanism(), &TRUTH, &BaseSettings::default());
    let (q, dq, ddq) = arm::motion(samples, 3);
    let motion = MotionBlock::plain(samples, &q, &dq, &ddq);
    let mut regressor = RegressorBlock::new(model.layout().clone(), samples);
    model.regressor(&motion, &TRUTH, &mut regressor);
    let effort: Vec<f64> = (0..arm::JOINTS).flat_map(|j| regressor.effort(j, &truth)).collect();
    let blocks = [EffortBlock { log: 0, motion, effort: &effort }];
    let log = EffortProblem::new(&model, &base.kept, &blocks).unwrap();
    let steady = SteadyRows::new(&model, &base.kept, &points(&model, &truth), 1).unwrap();
    let joined = JoinedProblem::new(vec![&log, &steady]);
    let logs: Vec<usize> = joined.groups().iter().map(|g| g.log).collect();
    assert_eq!(logs, [[0; 6].as_slice(), &[1; 3]].concat(), "groups of the first part come first");

    // Both parts fill their own groups.
    let shaped = |problem: &dyn SeparableProblem| {
        let mut out: Vec<ShapedColumns> = problem.groups().iter().map(ShapedColumns::new).collect();
        problem.shaped(&TRUTH, &mut out);
        out
    };
    assert_eq!(shaped(&joined), [shaped(&log), shaped(&steady)].concat());

    let found = fit(&joined, &settings()).unwrap();
    check_close(&found.shape, &TRUTH, 1e-8);
    check_close(&found.linear, &base.values(&truth), 1e-8);
}
