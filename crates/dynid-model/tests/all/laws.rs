//! Laws of velocity: derivatives against central differences, closed forms, ends, a law of one's own.

use dynid_model::element::{
    AtJoint, JetMotion, JointElement, LinearTerm, ShapeTerm, Velocity, VelocityLaw, laws,
};
use dynid_model::scalar::{Dual, Function, FunctionOfTwo, Jet};
use dynid_model::*;

/// Friction that falls from `fs` at rest to `fc` as `1 / (1 + (v/vs)²)` (Hess & Soom 1990).
#[derive(Debug, Clone)]
struct HessSoom;

impl VelocityLaw<1, 2> for HessSoom {
    fn linear(&self) -> [LinearTerm; 2] {
        [LinearTerm::effort("fc").friction(), LinearTerm::effort("fs").friction()]
    }
    fn shape(&self) -> [ShapeTerm; 1] {
        [ShapeTerm::speed("vs", 0.001, 0.3)]
    }
    fn columns<S: Scalar>(&self, v: Velocity<S>, [vs]: [S; 1]) -> [S; 2] {
        let x = v.value() / vs;
        let falling = (S::one() + x * x).recip();
        [v.sign() * (S::one() - falling), v.sign() * falling]
    }
}

pub(super) fn pendulum(elements: Vec<Box<dyn JointElement>>) -> RobotModel {
    let mut d = Description::new("pendulum");
    d.links.extend(["l0", "l1"].map(|l| LinkDescription { name: l.into(), inertia: None }));
    d.joints.push(JointDescription {
        name: "j1".into(),
        parent: "l0".into(),
        child: "l1".into(),
        kind: JointKind::Revolute,
        placement: Placement::identity(),
        axis: [0.0, 0.0, 1.0],
        limits: Limits::default(),
        mimic: None,
    });
    RobotModel::new(d.build().unwrap_or_else(|e| panic!("{e}")), elements)
}

/// Columns of the only element, `[entry][sample]`, and their derivatives by shape, `[pair][sample]`.
fn columns(model: &RobotModel, v: &[f64], width: f64, shape: &[f64]) -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
    let n = v.len();
    let rest = vec![0.0; n];
    let motion = MotionBlock { sign_width: width, ..MotionBlock::plain(n, &rest, v, &rest) };
    let mut block = RegressorBlock::new(model.layout().clone(), n);
    model.regressor(&motion, shape, &mut block);
    let entries = model.layout().columns(0).len();
    let values = (10..entries).map(|k| block.column(0, k).to_vec()).collect();
    let mut derivatives = vec![0.0; n * model.shape_dependence().len()];
    model.shaped(&motion, shape, n, &mut [], &mut derivatives);
    let mut shaped = vec![0.0; n * model.shaped_columns().len()];
    let mut together = (shaped.clone(), vec![0.0; derivatives.len()]);
    model.shaped(&motion, shape, n, &mut shaped, &mut []);
    model.shaped(&motion, shape, n, &mut together.0, &mut together.1);
    assert_eq!(together, (shaped, derivatives.clone()), "asked for together as one by one");
    (values, derivatives.chunks_exact(n).map(<[f64]>::to_vec).collect())
}

#[test]
fn a_law_of_ones_own_has_values_derivatives_adjoints_and_jets() {
    let model = pendulum(vec![Box::new(AtJoint::new(0, HessSoom, 2.0))]);
    let table = model.parameters();
    assert_eq!((table.linear[10].name.as_str(), table.linear[11].name.as_str()), ("j1.fc", "j1.fs"));
    assert_eq!((table.shape[0].name.as_str(), table.shape[0].unit), ("j1.vs", "rad/s"));
    assert_eq!((table.shape[0].lower, table.shape[0].upper), (0.002, 0.6));
    let (vs, v) = (0.2, [-1.3, -0.2, 0.0, 0.05, 0.7]);
    for width in [0.0, 0.05] {
        let (values, derivatives) = columns(&model, &v, width, &[vs]);
        let sign = |v: f64| if width > 0.0 { (v / width).tanh() } else { element::sign(v) };
        let falling = |v: f64, vs: f64| 1.0 / (1.0 + (v / vs) * (v / vs));
        for (k, v) in v.into_iter().enumerate() {
            let fall = falling(v, vs);
            assert!((values[1][k] - sign(v) * fall).abs() < 1e-15);
            assert!((values[0][k] - sign(v) * (1.0 - fall)).abs() < 1e-15);
            let by_vs = sign(v) * fall * fall * 2.0 * v * v / (vs * vs * vs);
            assert!((derivatives[1][k] - by_vs).abs() < 1e-14, "{v}: {} {by_vs}", derivatives[1][k]);
            assert!((derivatives[0][k] + by_vs).abs() < 1e-14);
        }
        // By velocity, and by velocity of what linearises the law about its shape.
        let linear: Vec<f64> = (0..12).map(|k| if k < 10 { 0.0 } else { k as f64 - 8.5 }).collect();
        let rest = [0.0; 5];
        let motion = MotionBlock { sign_width: width, ..MotionBlock::plain(5, &rest, &v, &rest) };
        let mut out = MotionAdjoint::new(1, 1, 5);
        model.effort_adjoint(&motion, &[vs], &linear, 5, &[1.0; 5], &mut out);
        for (k, v) in v.into_iter().enumerate().filter(|(_, v)| *v != 0.0) {
            let effort = |v: f64| sign(v) * (1.5 + (2.5 - 1.5) * falling(v, vs));
            let h = 1e-6;
            let difference = (effort(v + h) - effort(v - h)) / (2.0 * h);
            assert!((out.dq[k] - difference).abs() < 1e-7 * (1.0 + difference.abs()), "{v}");
        }
    }
    let q = [Jet::default()];
    let dq = [Jet::new([0.3, 1.1, -0.4])];
    let motion = JetMotion { q: &q, dq: &dq, ddq: &q, channels: &[], sign_width: 0.0 };
    let mut out = [Jet::default(); 2];
    let element = AtJoint::new(0, HessSoom, 2.0);
    assert!(element.jets(model.joints(), &motion, &[vs], &mut out));
    // 1 / (1 + x²) over time, x = v/vs.
    let (x, xt, xtt) = (0.3 / vs, 1.1 / vs, -0.4 / vs);
    let f = 1.0 / (1.0 + x * x);
    let expected =
        [f, -2.0 * x * xt * f * f, f * f * (8.0 * x * x * xt * xt * f - 2.0 * (xt * xt + x * xtt))];
    for (found, expected) in out[1].derivatives().into_iter().zip(expected) {
        assert!((found - expected).abs() < 1e-12, "{found} {expected}");
    }
    assert_eq!(out[0].value + out[1].value, 1.0);
}

#[test]
fn held_shapes_have_no_derivatives_and_slow_exponents_none_that_is_infinite() {
    let rest = [-1e-300, 0.0, 1e-300, 5e-324];
    for delta in [0.5, 1.0, 1.4, 2.0] {
        let mut element = AtJoint::new(0, laws::Stribeck, 1.0);
        element.shape[1] = element::ShapeSetting { start: delta, lower: 0.4, upper: 2.0, held: false };
        let model = pendulum(vec![Box::new(element)]);
        let (values, derivatives) = columns(&model, &rest, 0.0, &[0.04, delta]);
        let all = values.iter().chain(&derivatives).flatten();
        assert!(all.clone().all(|x| x.is_finite()), "{delta}: {values:?} {derivatives:?}");
        assert!(derivatives.iter().all(|d| d[1] == 0.0));
    }
    let model = pendulum(vec![Box::new(AtJoint::new(0, laws::Stribeck, 1.0))]);
    assert_eq!(model.parameters().shape.len(), 1);
    assert_eq!(model.shape_dependence(), [(0, 0), (1, 0)]);
}

#[test]
fn exponents_of_one_and_two_are_those_of_the_powers() {
    // A loop of its own and the general one, told apart by the last bit of the exponent alone.
    for delta in [1.0_f64, 2.0] {
        let held = |value: f64| {
            let mut element = AtJoint::new(0, laws::Stribeck, 1.0);
            element.shape[1] = element::ShapeSetting::held(value);
            columns(&pendulum(vec![Box::new(element)]), &[-0.3, -0.01, 0.02, 0.5], 0.0, &[0.04])
        };
        let (a, b) = (held(delta), held(delta.next_up()));
        for (a, b) in a.0.iter().chain(&a.1).flatten().zip(b.0.iter().chain(&b.1).flatten()) {
            assert!((a - b).abs() <= 1e-13 * (1.0 + a.abs()), "{delta}: {a} {b}");
        }
    }
}

/// `sin(x)`, from outside of the crate.
#[derive(Debug, Clone, Copy)]
struct Sine;

impl Function for Sine {
    fn value(self, x: f64) -> f64 {
        x.sin()
    }
    fn slope(self, x: f64, _: f64) -> f64 {
        x.cos()
    }
    fn bend(self, _: f64, f: f64) -> f64 {
        -f
    }
}

/// `x^y` by logarithms.
#[derive(Debug, Clone, Copy)]
struct Raised;

impl FunctionOfTwo for Raised {
    fn value(self, x: f64, y: f64) -> f64 {
        x.powf(y)
    }
    fn by_first(self, x: f64, y: f64, f: f64) -> f64 {
        y * f / x
    }
    fn by_second(self, x: f64, _: f64, f: f64) -> f64 {
        f * x.ln()
    }
    fn bends(self, x: f64, y: f64, f: f64) -> [f64; 3] {
        [y * (y - 1.0) * f / (x * x), f / x * (1.0 + y * x.ln()), f * x.ln() * x.ln()]
    }
}

#[test]
fn functions_of_ones_own_follow_the_chain_rule() {
    let jet = |t: f64| Jet::new([0.4 + t + t * t, 1.0 + 2.0 * t, 2.0]);
    let other = |t: f64| Jet::new([1.2 - t * t, -2.0 * t, -2.0]);
    let at = |t: f64| jet(t).through(Sine) * jet(t).through_two(other(t), Raised) / other(t);
    let h = 1e-4;
    let (below, here, above) = (at(0.3 - h), at(0.3), at(0.3 + h));
    assert!((here.first - (above.value - below.value) / (2.0 * h)).abs() < 1e-6);
    assert!((here.second - (above.value - 2.0 * here.value + below.value) / (h * h)).abs() < 1e-5);
    let dual = |x: f64| Dual::<1>::variable(x, 0);
    let of = |x: Dual<1>| {
        let clamped = (x + Dual::from_f64(0.1)).at_least(0.0).at_most(5.0);
        clamped.root() + x.exponential() + (x * x).rise() + clamped.logarithm() + x.hyperbolic_tangent()
    };
    let (x, h) = (0.7, 1e-6);
    let difference = (of(dual(x + h)).value - of(dual(x - h)).value) / (2.0 * h);
    assert!((of(dual(x)).derivative[0] - difference).abs() < 1e-8);
}
