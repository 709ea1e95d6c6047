//! Friction elements against golden curves, central differences and dual numbers.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use dynid_model::element::{
    Arctangent, Coulomb, Cyclic, ExponentialViscous, JointElement, LuGre, PowerLaw, ShapeSetting, Sigmoid,
    SigmoidOffset, Stribeck, StribeckViscous, TanhFriction, Viscous, ViscousMagnitude,
};
use dynid_model::*;
use dynid_testing::golden;
use serde_json::Value;

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

/// Joints in a row without mass that matters, with given elements.
fn model(joints: usize, elements: Vec<Box<dyn JointElement>>) -> RobotModel {
    let mut d = Description::new("row");
    d.links.push(LinkDescription { name: "base".into(), inertia: None });
    for k in 1..=joints {
        let inertia = Some(Inertia([1.0, 0.1, 0.1, 0.1, 1.0, 0.0, 0.0, 1.0, 0.0, 1.0]));
        d.links.push(LinkDescription { name: format!("link{k}"), inertia });
        d.joints.push(JointDescription {
            name: format!("j{k}"),
            parent: if k == 1 { "base".into() } else { format!("link{}", k - 1) },
            child: format!("link{k}"),
            kind: JointKind::Revolute,
            placement: Placement::translate(0.1, 0.0, 0.0),
            axis: [0.0, 0.0, 1.0],
            limits: Limits::default(),
            mimic: None,
        });
    }
    RobotModel::new(d.build().unwrap(), elements)
}

/// Motion of which speeds matter, the same for every joint, a little faster from joint to joint, and places, which run through a third of a turn.
struct Speeds {
    samples: usize,
    q: Vec<f64>,
    dq: Vec<f64>,
    rest: Vec<f64>,
}

impl Speeds {
    fn new(joints: usize, v: &[f64]) -> Self {
        let dq: Vec<f64> =
            (0..joints).flat_map(|j| v.iter().map(move |v| v * (1.0 + 0.1 * j as f64))).collect();
        let q = (0..dq.len()).map(|k| 0.4 + 2.0 * k as f64 / dq.len() as f64).collect();
        Speeds { samples: v.len(), rest: vec![0.0; dq.len()], q, dq }
    }

    fn block(&self, sign_width: f64) -> MotionBlock<'_> {
        MotionBlock {
            samples: self.samples,
            stride: self.samples,
            q: &self.q,
            dq: &self.dq,
            ddq: &self.rest,
            gravity: None,
            channels: &[],
            sign_width,
        }
    }
}

fn columns(model: &RobotModel, motion: &MotionBlock<'_>, shape: &[f64]) -> RegressorBlock {
    let mut block = RegressorBlock::new(model.layout().clone(), motion.samples);
    model.regressor(motion, shape, &mut block);
    block
}

fn free(start: f64) -> ShapeSetting {
    let ends = [0.5 * start, 2.0 * start];
    ShapeSetting { start, lower: ends[0].min(ends[1]), upper: ends[0].max(ends[1]), held: false }
}

#[test]
fn curves_are_those_of_the_catalogue() {
    let Some(g) = golden("mech_elements.json") else { return };
    let v = numbers(&g["v"]);
    let motion = Speeds::new(1, &v);
    let mut seen = Vec::new();
    for curve in g["curves"].as_array().unwrap() {
        let name = curve["element"].as_str().unwrap();
        let p = |key: &str| curve["parameters"][key].as_f64().unwrap();
        let mut elements: Vec<Box<dyn JointElement>> = Vec::new();
        let (values, shape) = match name {
            "arctan" => {
                elements.push(Box::new(Arctangent::new(0)));
                (vec![p("fa")], vec![p("fb")])
            }
            "tanh" => {
                elements.push(Box::new(TanhFriction::new(0)));
                (vec![p("fc")], vec![p("w")])
            }
            "sigmoid" => {
                elements.push(Box::new(Sigmoid::new(0)));
                (vec![p("p1")], vec![p("p2"), p("p3")])
            }
            "power" => {
                elements.push(Box::new(PowerLaw::new(0)));
                (vec![p("c")], vec![p("p")])
            }
            "exponential_viscous" => {
                let pair = |key: &str| numbers(&curve["parameters"][key]);
                let law = ExponentialViscous {
                    sigma3_slope: free(0.01),
                    sigma4_slope: free(0.01),
                    reference_temperature: 0.0,
                    temperature: Some(p("T")),
                    ..ExponentialViscous::new(0)
                };
                elements.push(Box::new(law));
                (pair("s2"), [pair("s3"), pair("s4")].concat())
            }
            "stribeck" => {
                elements.push(Box::new(Stribeck { delta: free(1.5), ..Stribeck::new(0) }));
                elements.push(Box::new(Viscous { rate: 0 }));
                (vec![p("fc"), p("fs"), p("fv")], vec![p("vs"), p("d")])
            }
            _ => continue,
        };
        seen.push(name);
        let model = model(1, elements);
        let mut linear = vec![0.0; 10];
        linear.extend(values);
        let motion = motion.block(0.0);
        let effort = columns(&model, &motion, &shape).effort(0, &linear);
        let mut direct = vec![0.0; v.len()];
        model.efforts(&motion, &shape, &linear, v.len(), &mut direct);
        let expected = numbers(&curve["effort"]);
        let scale = expected.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        for (k, e) in expected.iter().enumerate() {
            assert!((effort[k] - e).abs() <= 1e-12 * scale, "{name} at {}: {} against {e}", v[k], effort[k]);
            assert!((effort[k] - direct[k]).abs() <= 1e-13 * scale, "{name}: columns times linear");
        }
    }
    assert_eq!(seen, ["arctan", "tanh", "sigmoid", "stribeck", "stribeck", "exponential_viscous", "power"]);
}

/// Elements of every kind with free shape, some parameters held, linear elements between them.
fn all_elements() -> Vec<Box<dyn JointElement>> {
    vec![
        Box::new(Coulomb { rate: 2 }),
        Box::new(Stribeck { rate: 1, vs: free(0.3), delta: free(1.4) }),
        Box::new(Viscous { rate: 0 }),
        Box::new(Arctangent { rate: 0, fb: free(7.0) }),
        Box::new(Stribeck { vs: free(0.2), ..Stribeck::new(0) }),
        Box::new(Stribeck { rate: 3, vs: ShapeSetting::held(0.1), delta: free(0.8) }),
        Box::new(Arctangent { rate: 3, fb: ShapeSetting::held(4.0) }),
        Box::new(TanhFriction { rate: 1, w: free(0.15) }),
        Box::new(Sigmoid { rate: 2, phi2: free(9.0), phi3: free(0.026) }),
        Box::new(Sigmoid { rate: 3, phi2: ShapeSetting::held(12.0), phi3: free(-0.02) }),
        Box::new(SigmoidOffset { rate: 0, alpha: free(8.0), nu: free(0.03) }),
        Box::new(PowerLaw { rate: 2, p: free(0.7) }),
        Box::new(StribeckViscous { rate: 2, vs: free(0.3), delta: free(1.3) }),
        Box::new(ViscousMagnitude { rate: 1 }),
        Box::new(ExponentialViscous {
            sigma3: free(1.3),
            sigma3_slope: free(0.013),
            sigma4: free(0.8),
            sigma4_slope: free(-0.004),
            temperature: Some(31.0),
            ..ExponentialViscous::new(2)
        }),
        Box::new(ExponentialViscous {
            sigma4: free(1.7),
            temperature: Some(18.0),
            ..ExponentialViscous::new(1)
        }),
        Box::new(LuGre { kappa: free(700.0), rho: free(1.4), vs: free(0.2), delta: free(1.4), rate: 1 }),
        Box::new(LuGre::new(3)),
        Box::new(Cyclic::torque(0, free(5.0))),
        Box::new(Cyclic::friction(1, free(2.5))),
        Box::new(Cyclic::friction(2, ShapeSetting::held(3.0))),
    ]
}

const SPEEDS: [f64; 11] = [-2.1, -0.9, -0.31, -0.07, -0.004, 0.0, 0.003, 0.06, 0.27, 1.1, 1.9];

#[test]
fn shaped_columns_are_those_of_the_regressor() {
    let model = model(4, all_elements());
    let motion = Speeds::new(4, &SPEEDS);
    let shape = model.parameters().shape_start();
    let (n, stride) = (SPEEDS.len(), SPEEDS.len() + 3);
    for sign_width in [0.0, 0.05] {
        let block = motion.block(sign_width);
        let whole = columns(&model, &block, &shape);
        let mut values = vec![f64::NAN; model.shaped_columns().len() * stride];
        model.shaped(&block, &shape, stride, &mut values, &mut []);
        for (k, (output, column)) in model.shaped_columns().iter().enumerate() {
            let at = model.layout().columns(*output).iter().position(|c| c == column).unwrap();
            assert_eq!(whole.column(*output, at), &values[k * stride..][..n], "{output} {column}");
        }
        // Together as one by one.
        let bits = |numbers: &[f64]| numbers.iter().map(|x| x.to_bits()).collect::<Vec<u64>>();
        let mut alone = vec![f64::NAN; model.shape_dependence().len() * stride];
        let (mut both, mut slopes) = (vec![f64::NAN; values.len()], alone.clone());
        model.shaped(&block, &shape, stride, &mut [], &mut alone);
        model.shaped(&block, &shape, stride, &mut both, &mut slopes);
        assert_eq!((bits(&both), bits(&slopes)), (bits(&values), bits(&alone)));
    }
    assert!(model.shaped_columns().is_sorted());
    let held = model.parameters().column("j4.fa").unwrap();
    assert!(model.shaped_columns().iter().all(|(_, column)| *column != held), "a held shape changes nothing");
}

#[test]
fn derivatives_by_shape_are_those_of_central_differences() {
    let model = model(4, all_elements());
    let motion = Speeds::new(4, &SPEEDS);
    let shape = model.parameters().shape_start();
    let (n, width) = (SPEEDS.len(), model.shaped_columns().len());
    for sign_width in [0.0, 0.05] {
        let block = motion.block(sign_width);
        let pairs = model.shape_dependence();
        let mut derivatives = vec![f64::NAN; pairs.len() * n];
        model.shaped(&block, &shape, n, &mut [], &mut derivatives);
        for parameter in 0..shape.len() {
            let at = |change: f64| {
                let mut shape = shape.clone();
                shape[parameter] *= 1.0 + change;
                let mut values = vec![0.0; width * n];
                model.shaped(&block, &shape, n, &mut values, &mut []);
                values
            };
            let h = 1e-5;
            let (above, below) = (at(h), at(-h));
            for column in 0..width {
                let place = pairs.iter().position(|p| *p == (column, parameter));
                for s in 0..n {
                    let k = column * n + s;
                    let difference = (above[k] - below[k]) / (2.0 * h * shape[parameter]);
                    let found = place.map_or(0.0, |d| derivatives[d * n + s]);
                    let name = &model.parameters().shape[parameter].name;
                    let error = (found - difference).abs();
                    assert!(
                        error <= 1e-6 * (1.0 + difference.abs()),
                        "{name} {column} {s}: {found} {difference}"
                    );
                }
            }
        }
    }
}

#[test]
fn derivatives_by_speed_are_those_of_central_differences() {
    let model = model(4, all_elements());
    let shape = model.parameters().shape_start();
    let moving: Vec<f64> = SPEEDS.into_iter().filter(|v| *v != 0.0).collect();
    let n = moving.len();
    let linear: Vec<f64> = (0..model.parameters().linear.len())
        .map(|k| if k < 40 { 0.0 } else { 0.5 + 0.3 * (k % 5) as f64 })
        .collect();
    for sign_width in [0.0, 0.05] {
        let motion = Speeds::new(4, &moving);
        let weights = vec![1.0; 4 * n];
        let mut found = MotionAdjoint::new(4, 4, n);
        model.effort_adjoint(&motion.block(sign_width), &shape, &linear, n, &weights, &mut found);
        let at = |change: f64| {
            let moved: Vec<f64> = moving.iter().map(|v| v * (1.0 + change)).collect();
            let mut effort = vec![0.0; 4 * n];
            model.efforts(&Speeds::new(4, &moved).block(sign_width), &shape, &linear, n, &mut effort);
            effort
        };
        let h = 1e-5;
        let (above, below) = (at(h), at(-h));
        for k in 0..4 * n {
            let difference = (above[k] - below[k]) / (2.0 * h * motion.dq[k]);
            let error = (found.dq[k] - difference).abs();
            assert!(error <= 1e-6 * (1.0 + difference.abs()), "{k}: {} {difference}", found.dq[k]);
        }
    }
}

#[test]
fn ur10_form_is_the_panda_form_but_for_an_offset() {
    let motion = Speeds::new(1, &SPEEDS);
    // 459 s/rad: the steepest value identified for a UR10.
    for shape in [[9.0, 0.02], [459.0, -0.004], [1e6, 0.05]] {
        let forms: [Box<dyn JointElement>; 2] = [Box::new(Sigmoid::new(0)), Box::new(SigmoidOffset::new(0))];
        let efforts = forms
            .map(|form| columns(&model(1, vec![form]), &motion.block(0.0), &shape).column(0, 10).to_vec());
        let rest = 1.0 / (1.0 + (-shape[0] * shape[1]).exp());
        for (s, v) in SPEEDS.into_iter().enumerate() {
            let expected = 1.0 / (1.0 + (-shape[0] * (v + shape[1])).exp());
            assert!((efforts[1][s] - expected).abs() <= 1e-14, "{v}: {} {expected}", efforts[1][s]);
            assert!((efforts[1][s] - efforts[0][s] - rest).abs() <= 1e-14, "{v}");
            assert!(v != 0.0 || efforts[0][s] == 0.0, "zero at rest");
        }
    }
}

#[test]
fn settings_that_no_search_can_start_from_are_told() {
    assert!(free(0.3).check(true).is_ok());
    assert!(ShapeSetting::held(-0.3).check(false).is_ok());
    let faults = [
        ShapeSetting { start: 1.0, lower: 2.0, upper: 3.0, held: false }.check(true),
        ShapeSetting { start: f64::NAN, lower: 2.0, upper: 3.0, held: false }.check(true),
        ShapeSetting { start: 1.0, lower: 0.0, upper: 3.0, held: false }.check(true),
        ShapeSetting::held(0.0).check(true),
    ];
    for fault in faults {
        assert!(fault.is_err());
    }
}
