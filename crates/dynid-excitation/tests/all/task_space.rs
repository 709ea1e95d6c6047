//! A design in coordinates that are no joints: the pose of a planar 3-PRR platform.

use std::sync::Arc;

use crate::support::*;
use dynid_excitation::constraint::{ConstraintKind, ConstraintRow};
use dynid_excitation::criterion::{Criterion, Measure};
use dynid_excitation::*;
use dynid_model::scalar::{Dual, Scalar};

type D = Dual<9>;

pub(crate) const LENGTH: [f64; 3] = [0.600, 0.475, 0.604];
pub(crate) const JOINT: [f64; 3] = [0.280, 0.0, 0.280];

fn number(x: f64) -> D {
    D::from_f64(x)
}

/// What the sliders and legs do.
struct Legs {
    position: [D; 3],
    velocity: [D; 3],
    acceleration: [D; 3],
    sine: [D; 3],
    cosine: [D; 3],
    turn: [D; 3],
    turn_rate: [D; 3],
    height: [D; 3],
}

fn legs(state: &DualState<'_, 9>) -> Legs {
    let [x, y, theta] = [state.q[0], state.q[1], state.q[2]];
    let [vx, vy, w] = [state.dq[0], state.dq[1], state.dq[2]];
    let [ax, ay, dw] = [state.ddq[0], state.ddq[1], state.ddq[2]];
    let (s, c) = theta.sin_cos();
    let zero = number(0.0);
    let mut out = Legs {
        position: [zero; 3],
        velocity: [zero; 3],
        acceleration: [zero; 3],
        sine: [zero; 3],
        cosine: [zero; 3],
        turn: [zero; 3],
        turn_rate: [zero; 3],
        height: [zero; 3],
    };
    for i in 0..3 {
        let (l, p) = (number(LENGTH[i]), number(JOINT[i]));
        let h = y + p * s;
        let sine = h / l;
        // Outside its reach a leg has no angle; a margin keeps all functions finite there, limits exclude it.
        let inside = number(1.0) - sine * sine;
        let root = if inside.value > 1e-3 { inside.sqrt() } else { number(1e-3f64.sqrt()) };
        let cosine = if i == 2 { -root } else { root };
        let dh = vy + p * c * w;
        let ddh = ay + p * c * dw - p * s * w * w;
        let turn = dh / (l * cosine);
        let turn_rate = (ddh + l * sine * turn * turn) / (l * cosine);
        out.position[i] = x + p * c - l * cosine;
        out.velocity[i] = vx - p * s * w + l * sine * turn;
        out.acceleration[i] =
            ax - p * s * dw - p * c * w * w + l * cosine * turn * turn + l * sine * turn_rate;
        (out.sine[i], out.cosine[i], out.turn[i], out.turn_rate[i], out.height[i]) =
            (sine, cosine, turn, turn_rate, h);
    }
    out
}

/// Nine base columns of the three slider forces, by virtual work `τ = J_a⁻ᵀ Jᵀ (M q̈ + N)`.
fn regressor(state: DualState<'_, 9>, out: &mut [D]) {
    let legs = legs(&state);
    let (s, c) = state.q[2].sin_cos();
    let w = state.dq[2];
    let [ax, ay, dw] = [state.ddq[0], state.ddq[1], state.ddq[2]];
    let zero = number(0.0);
    // Generalised forces on (x, y, θ) per column: m_p μ1 μ2 μ3 σ I1 I2 I3 I_p.
    let mut forces = vec![[zero; 3]; 9];
    forces[0] = [ax, ay, zero];
    forces[4] = [-s * dw - c * w * w, c * dw - s * w * w, -s * ax + c * ay];
    forces[8] = [zero, zero, dw];
    let mut jacobian = [[zero; 3]; 3];
    for i in 0..3 {
        let (l, p) = (number(LENGTH[i]), number(JOINT[i]));
        let (sine, cosine) = (legs.sine[i], legs.cosine[i]);
        // Rates of leg angle and slider per unit rate of x, y, θ.
        let alpha = [zero, number(1.0) / (l * cosine), p * c / (l * cosine)];
        let slider = [number(1.0), l * sine * alpha[1], -p * s + l * sine * alpha[2]];
        jacobian[i] = slider;
        let (turn, turn_rate) = (legs.turn[i], legs.turn_rate[i]);
        let on_slider = -sine * turn_rate - cosine * turn * turn;
        let on_leg = -sine * legs.acceleration[i];
        for k in 0..3 {
            forces[1 + i][k] = slider[k] * on_slider + alpha[k] * on_leg;
            forces[5 + i][k] = alpha[k] * turn_rate;
        }
    }
    // Solve Jᵀ τ = F by Cramer's rule.
    let minor = |a: [D; 3], b: [D; 3]| {
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    };
    let dot = |a: [D; 3], b: [D; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let cofactors =
        [minor(jacobian[1], jacobian[2]), minor(jacobian[2], jacobian[0]), minor(jacobian[0], jacobian[1])];
    let determinant = dot(jacobian[0], cofactors[0]);
    for (column, force) in forces.iter().enumerate() {
        for row in 0..3 {
            out[row * 9 + column] = dot(cofactors[row], *force) / determinant;
        }
    }
}

fn row(kind: ConstraintKind, subject: &str, lower: f64, upper: f64) -> ConstraintRow {
    ConstraintRow { kind, subject: subject.into(), lower, upper, scale: 1.0, unit: "m" }
}

/// Sliders, their speeds and accelerations, leg heights, distances between sliders.
pub(crate) fn workspace() -> DualConstraint<9> {
    let inf = f64::INFINITY;
    let mut rows = Vec::new();
    for i in 1..=3 {
        rows.push(row(ConstraintKind::Box, &format!("slider {i}"), -1.0, 1.0));
        rows.push(row(ConstraintKind::Box, &format!("speed of slider {i}"), -1.0, 1.0));
        rows.push(row(ConstraintKind::Box, &format!("acceleration of slider {i}"), -1.0, 1.0));
        rows.push(row(ConstraintKind::HalfSpace, &format!("height of leg {i}"), 0.0, inf));
        rows.push(row(ConstraintKind::HalfSpace, &format!("reach of leg {i}"), 0.0, inf));
    }
    rows.push(row(ConstraintKind::HalfSpace, "sliders 1 and 2", 0.0, inf));
    rows.push(row(ConstraintKind::HalfSpace, "sliders 1 and 3", 0.0, inf));
    DualConstraint::new(
        rows,
        Arc::new(|state, out| {
            let legs = legs(&state);
            let times = |x: D, f: f64| x * number(f);
            for i in 0..3 {
                out[5 * i] = times(legs.position[i], 1.0 / 0.80);
                out[5 * i + 1] = times(legs.velocity[i], 1.0 / 0.65);
                out[5 * i + 2] = times(legs.acceleration[i], 1.0 / 6.0);
                out[5 * i + 3] = times(legs.height[i] - number(0.18), 2.0);
                out[5 * i + 4] = times(number(0.91 * LENGTH[i]) - legs.height[i], 2.0);
            }
            out[15] = times(legs.position[0] - legs.position[1] - number(0.06), 2.0);
            out[16] = times(legs.position[2] - legs.position[0] - number(0.20), 2.0);
        }),
    )
}

pub(crate) fn problem() -> Problem {
    let names = ["m_p", "mu1", "mu2", "mu3", "sigma", "I_L1", "I_L2", "I_L3", "I_p"];
    let columns =
        names.iter().map(|n| ColumnInfo { name: (*n).into(), unit: String::new(), nominal: None }).collect();
    // Loose bounds of the pose; what binds are the sliders. They set the scale of the search.
    let pose = |low: f64, high: f64, velocity: f64, acceleration: f64| MotionLimits {
        position: (low, high),
        velocity,
        acceleration,
        jerk: f64::INFINITY,
    };
    Problem {
        model: Box::new(DualModel::<9>::new(3, columns, Arc::new(regressor))),
        coordinates: vec!["x".into(), "y".into(), "theta".into()],
        limits: vec![pose(-0.5, 0.5, 1.0, 10.0), pose(0.18, 0.45, 1.0, 10.0), pose(-0.35, 0.35, 3.0, 30.0)],
        constraints: vec![Box::new(workspace())],
        base: std::f64::consts::TAU * 0.25,
        harmonics: 5,
        start: StartConditions { rest: true, ..Default::default() },
        criterion: Criterion::raw(Measure::ConditionAndSmallest { condition: 1.0, smallest: 10.0 }),
        output_weights: vec![1.0; 3],
        effective_samples: 80.0,
        prior: None,
        sign_width: DEFAULT_SIGN_WIDTH,
        samples: 100,
    }
}

#[test]
fn the_reference_trajectory_has_its_singular_values() {
    let Some(golden) = reference("golden/prr3_trajectory.json") else { return };
    let base = std::f64::consts::TAU * 0.25;
    // Velocity amplitudes.
    let coefficients: Vec<Vec<f64>> = rows(&golden["coefficients"])
        .iter()
        .map(|r| {
            let mut x = vec![r[0]];
            x.extend((1..=5).map(|k| r[k] / (base * k as f64)));
            x.extend((1..=5).map(|k| -r[5 + k] / (base * k as f64)));
            x
        })
        .collect();
    let mut problem = problem();
    problem.effective_samples = 400.0;
    let triangle = information(&problem, &coefficients, 400);
    let sigma = triangle.svd().unwrap().values;
    let wanted = numbers(&golden["base_singular_values"]);
    for (k, w) in wanted.iter().enumerate() {
        assert!((sigma[k] - w).abs() <= 1e-6 * wanted[0], "{k}: {} against {w}", sigma[k]);
    }
}

#[test]
fn designs_in_task_space_keep_all_limits_and_undercut_the_reference() {
    let problem = problem();
    let settings = Settings { starts: 4, report_samples: 80, ..Settings::default() };
    let Outcome::Found(found) = design(&problem, &settings, Vec::new(), &mut |_| {}).unwrap() else {
        panic!("no feasible design")
    };
    for start in &found.starts {
        println!("seed {} G {:.0} excess {:.1e}", start.seed, start.criterion.unwrap().exp(), start.excess);
    }
    assert!(limit_points(&problem, &found.coefficients, 100_000, 1e-6).is_empty());
    let best = found.best().criterion.unwrap().exp();
    assert!(best < 551.0, "{best}");
}
