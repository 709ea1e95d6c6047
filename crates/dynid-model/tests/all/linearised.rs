//! Elements linearised about their shape parameters, against central differences of the elements themselves.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use dynid_model::element::{
    Arctangent, ExponentialViscous, JointElement, Linearised, LuGre, PowerLaw, ShapeSetting, Sigmoid,
    SigmoidOffset, Stribeck, StribeckViscous, TanhFriction,
};
use dynid_model::*;

const SAMPLES: usize = 40;

fn mechanism() -> Mechanism {
    let mut d = Description::new("pendulum");
    d.links.push(LinkDescription { name: "base".into(), inertia: None });
    d.links.push(LinkDescription { name: "arm".into(), inertia: None });
    d.joints.push(JointDescription {
        name: "j".into(),
        parent: "base".into(),
        child: "arm".into(),
        kind: JointKind::Revolute,
        placement: Placement::identity(),
        axis: [0.0, 0.0, 1.0],
        limits: Limits::default(),
        mimic: None,
    });
    d.build().unwrap()
}

fn free_shape(start: f64) -> ShapeSetting {
    ShapeSetting { start, lower: 0.5 * start, upper: 2.0 * start, held: false }
}

fn elements() -> Vec<Box<dyn JointElement>> {
    let mut free = Stribeck::new(0);
    free.delta.held = false;
    free.delta.start = 1.4;
    vec![
        Box::new(Arctangent::new(0)),
        Box::new(TanhFriction::new(0)),
        Box::new(Sigmoid::new(0)),
        Box::new(SigmoidOffset::new(0)),
        Box::new(Stribeck::new(0)),
        Box::new(free),
        Box::new(StribeckViscous { rate: 0, vs: free_shape(0.2), delta: free_shape(1.3) }),
        Box::new(PowerLaw::new(0)),
        Box::new(ExponentialViscous { temperature: Some(31.0), ..ExponentialViscous::new(0) }),
        Box::new(LuGre::new(0)),
    ]
}

fn block<'a>(dq: &'a [f64], zero: &'a [f64], sign_width: f64) -> MotionBlock<'a> {
    MotionBlock {
        samples: dq.len(),
        stride: dq.len(),
        q: zero,
        dq,
        ddq: zero,
        gravity: None,
        channels: &[],
        sign_width,
    }
}

fn speeds() -> Vec<f64> {
    (0..SAMPLES).map(|k| 0.8 * (0.37 * k as f64 + 0.2).sin() + 0.003).collect()
}

fn efforts(model: &RobotModel, motion: &MotionBlock<'_>, shape: &[f64], linear: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; motion.samples];
    model.efforts(motion, shape, linear, motion.samples, &mut out);
    out
}

/// One nonlinear element at a point, and the same linearised there with a change of its shape parameters.
struct Pair {
    plain: RobotModel,
    linear: Vec<f64>,
    shape: Vec<f64>,
    linearised: RobotModel,
    /// Linear parameters of the linearised model at the point: no change.
    at: Vec<f64>,
}

fn pairs() -> Vec<Pair> {
    elements()
        .into_iter()
        .zip(elements())
        .map(|(element, again)| {
            let plain = RobotModel::new(mechanism(), vec![element]);
            let shape = plain.parameters().shape_start();
            let mut linear = plain.parameters().prior();
            for (k, x) in linear.iter_mut().skip(10).enumerate() {
                *x = 3.0 + k as f64;
            }
            let own = linear[10..].to_vec();
            let linearised =
                Linearised::new(again, plain.joints(), shape.clone(), own, vec![true; shape.len()]);
            let linearised = RobotModel::new(mechanism(), vec![Box::new(linearised)]);
            let mut at = linear.clone();
            at.resize(linearised.parameters().linear.len(), 0.0);
            Pair { plain, linear, shape, linearised, at }
        })
        .collect()
}

#[test]
fn columns_of_changes_are_derivatives_of_the_effort() {
    let (dq, zero) = (speeds(), vec![0.0; SAMPLES]);
    let motion = block(&dq, &zero, 0.0);
    for pair in pairs() {
        let known = pair.linear.len();
        assert_eq!(pair.at.len() - known, pair.shape.len());
        assert!(pair.linearised.parameters().shape.is_empty());
        let here = efforts(&pair.plain, &motion, &pair.shape, &pair.linear);
        assert_eq!(here, efforts(&pair.linearised, &motion, &[], &pair.at));
        for (k, parameter) in pair.plain.parameters().shape.iter().enumerate() {
            let named = format!("{} (change)", parameter.name);
            let own = &pair.linearised.parameters().linear[known + k];
            assert_eq!(own.name, named);
            assert!(own.lower.unwrap() <= 0.0 && own.upper.unwrap() >= 0.0, "{named}");
            let step = 1e-6 * pair.shape[k].abs().max(1e-2);
            let moved = |sign: f64| {
                let mut shape = pair.shape.clone();
                shape[k] += sign * step;
                efforts(&pair.plain, &motion, &shape, &pair.linear)
            };
            let (up, down) = (moved(1.0), moved(-1.0));
            let mut with_change = pair.at.clone();
            with_change[known + k] = 1.0;
            let linear = efforts(&pair.linearised, &motion, &[], &with_change);
            let size = linear.iter().zip(&here).map(|(l, h)| (l - h).abs()).fold(1e-3, f64::max);
            for s in 0..SAMPLES {
                let difference = (up[s] - down[s]) / (2.0 * step);
                let error = (linear[s] - here[s] - difference).abs();
                assert!(error <= 1e-6 * size, "{named}: {} against {difference}", linear[s] - here[s]);
            }
        }
    }
}

#[test]
fn adjoint_of_changes_is_the_derivative_by_the_velocity() {
    let (dq, zero) = (speeds(), vec![0.0; SAMPLES]);
    for (pair, sign_width) in pairs().iter().flat_map(|p| [(p, 0.0), (p, 0.05)]) {
        let mut linear = pair.at.clone();
        for (k, x) in linear.iter_mut().skip(pair.linear.len()).enumerate() {
            *x = 0.7 - 0.4 * k as f64;
        }
        let mut out = MotionAdjoint::new(1, 1, SAMPLES);
        let ones = vec![1.0; SAMPLES];
        let motion = block(&dq, &zero, sign_width);
        pair.linearised.effort_adjoint(&motion, &[], &linear, SAMPLES, &ones, &mut out);
        let step = 1e-6;
        let moved = |sign: f64| {
            let dq: Vec<f64> = dq.iter().map(|v| v + sign * step).collect();
            efforts(&pair.linearised, &block(&dq, &zero, sign_width), &[], &linear)
        };
        let (up, down) = (moved(1.0), moved(-1.0));
        let size = out.dq.iter().fold(1e-3_f64, |m, x| m.max(x.abs()));
        for s in 0..SAMPLES {
            let difference = (up[s] - down[s]) / (2.0 * step);
            let name = &pair.linearised.parameters().linear[10].name;
            assert!(
                (out.dq[s] - difference).abs() <= 2e-6 * size,
                "{name} at {}: {} against {difference}",
                dq[s],
                out.dq[s]
            );
        }
    }
}

#[test]
fn held_shape_parameters_have_no_column() {
    let (dq, zero) = (speeds(), vec![0.0; SAMPLES]);
    let motion = block(&dq, &zero, 0.0);
    let own = |pair: &Pair| pair.linear[10..].to_vec();
    for (element, pair) in elements().into_iter().zip(pairs()) {
        let shape = pair.shape.clone();
        let held = vec![false; shape.len()];
        let element = Linearised::new(element, pair.plain.joints(), shape, own(&pair), held);
        let model = RobotModel::new(mechanism(), vec![Box::new(element)]);
        assert_eq!(model.parameters().linear, pair.plain.parameters().linear);
        let here = efforts(&pair.plain, &motion, &pair.shape, &pair.linear);
        assert_eq!(here, efforts(&model, &motion, &[], &pair.linear));
    }
    // The last of several alone.
    for (element, pair) in elements().into_iter().zip(pairs()).filter(|(_, pair)| pair.shape.len() > 1) {
        let known = pair.linear.len();
        let mut free = vec![false; pair.shape.len()];
        free[pair.shape.len() - 1] = true;
        let element = Linearised::new(element, pair.plain.joints(), pair.shape.clone(), own(&pair), free);
        let model = RobotModel::new(mechanism(), vec![Box::new(element)]);
        assert_eq!(
            model.parameters().linear[known..],
            pair.linearised.parameters().linear[pair.at.len() - 1..]
        );
        let mut all = pair.at.clone();
        *all.last_mut().unwrap() = 0.3;
        let last: Vec<f64> = all[..known].iter().copied().chain([0.3]).collect();
        let [few, many] = [(&model, &last), (&pair.linearised, &all)].map(|(model, linear)| {
            let mut out = MotionAdjoint::new(1, 1, SAMPLES);
            model.effort_adjoint(&motion, &[], linear, SAMPLES, &vec![1.0; SAMPLES], &mut out);
            (efforts(model, &motion, &[], linear), out.dq)
        });
        assert_eq!(few, many);
    }
}
