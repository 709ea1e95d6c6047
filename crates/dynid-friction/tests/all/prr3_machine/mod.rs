//! The planar three-slider mechanism (Rosyid & El-Khasawneh 2020) in closed form: kinematics, dynamics with multipliers, trajectories.
//! The equations are in the chapter *Three sliders and a platform* of the book.
#![allow(
    dead_code,
    clippy::unwrap_used,
    reason = "shared by tests and a benchmark, which use different parts"
)]

use dynid_friction::load_friction::{DriveRows, Model, Problem, Record, Settings};
use dynid_linalg::Mat;
use dynid_search::Bounds;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::{PI, TAU};

pub(crate) const LEGS: [f64; 3] = [0.600, 0.475, 0.604];
pub(crate) const ARMS: [f64; 3] = [0.280, 0.0, 0.280];
pub(crate) const SHARES: [f64; 3] = [0.7, 0.2, 0.1];
pub(crate) const GRAVITY: f64 = 9.80665;
pub(crate) const INERTIAL: usize = 13;

/// Table 1, in its order.
pub(crate) const DESIGN: [f64; 13] = [
    6.2550, 11.1280, 9.0800, 13.3720, 30.3510, 2.6718, 1.8805, 3.6474, 7.2690, 0.9765, 0.5937, 1.3898, 2.3986,
];
pub(crate) const TRUTH: [f64; 17] = [
    7.2614, 12.1299, 10.0817, 14.4665, 31.3359, 3.3970, 2.4049, 3.6484, 8.2238, 1.2206, 0.7421, 1.5088,
    2.9509, 0.1449, 83.1797, 0.3016, 0.02,
];
const LOWER: [f64; 17] = [
    6.2550, 11.1280, 9.0800, 13.3720, 30.3510, 2.0039, 1.4104, 2.7355, 5.4517, 0.7323, 0.4453, 1.0424,
    1.7989, 0.0, 0.0, 0.0, 1e-4,
];
const UPPER: [f64; 13] = [
    9.3825, 16.6920, 13.6200, 20.0580, 45.5265, 4.0077, 2.8208, 5.4711, 10.9035, 1.4648, 0.8906, 2.0847,
    3.5979,
];

/// Bounds of Table 1.
pub(crate) fn bounds() -> Bounds {
    let upper = UPPER.into_iter().chain([f64::INFINITY; 4]).collect();
    Bounds::new(LOWER.to_vec(), upper).unwrap()
}

/// Design values and the start of friction.
pub(crate) fn start() -> Vec<f64> {
    DESIGN.into_iter().chain([0.1, 50.0, 0.2, 0.05]).collect()
}

/// Base parameters as rows.
pub(crate) fn base_matrix() -> Mat {
    let [l1, l2, l3] = LEGS;
    let rows: [&[(usize, f64)]; 9] = [
        &[(0, 3.0), (1, 1.0), (2, 1.0), (3, 1.0), (4, 1.0)],
        &[(5, 1.0), (0, -l1), (1, -l1)],
        &[(6, 1.0), (0, -l2), (2, -l2)],
        &[(7, 1.0), (0, -l3), (3, -l3)],
        &[(8, 1.0), (0, 0.56), (1, 0.28), (3, 0.28)],
        &[(9, 1.0), (0, -l1 * l1), (1, -l1 * l1)],
        &[(10, 1.0), (0, -l2 * l2), (2, -l2 * l2)],
        &[(11, 1.0), (0, -l3 * l3), (3, -l3 * l3)],
        &[(12, 1.0), (0, 0.1568), (1, 0.0784), (3, 0.0784)],
    ];
    let mut out = Mat::zeros(9, INERTIAL);
    for (i, row) in rows.into_iter().enumerate() {
        row.iter().for_each(|(k, v)| out[(i, *k)] = *v);
    }
    out
}

/// The four directions that change no effort without friction.
pub(crate) fn null_directions() -> [[f64; 13]; 4] {
    let [l1, l2, l3] = LEGS;
    let (a, b, c) = (l1 * l1, l2 * l2, l3 * l3);
    [
        [1.0, 0.0, 0.0, 0.0, -3.0, l1, l2, l3, -0.56, a, b, c, -0.1568],
        [0.0, 1.0, 0.0, 0.0, -1.0, l1, 0.0, 0.0, -0.28, a, 0.0, 0.0, -0.0784],
        [0.0, 0.0, 1.0, 0.0, -1.0, 0.0, l2, 0.0, 0.0, 0.0, b, 0.0, 0.0],
        [0.0, 0.0, 0.0, 1.0, -1.0, 0.0, 0.0, l3, -0.28, 0.0, 0.0, c, -0.0784],
    ]
}

/// A pose `(x, y, θ)` with its derivatives.
#[derive(Clone, Copy)]
pub(crate) struct Pose {
    pub(crate) q: [f64; 3],
    pub(crate) dq: [f64; 3],
    pub(crate) ddq: [f64; 3],
}

/// All twelve coordinates `(x_i, y_i, α_i, x, y, θ)` with derivatives.
pub(crate) struct State {
    pub(crate) q: [f64; 12],
    pub(crate) dq: [f64; 12],
    pub(crate) ddq: [f64; 12],
}

pub(crate) fn inverse_kinematics(pose: &Pose) -> State {
    let ([x, y, t], [dx, dy, dt], [ddx, ddy, ddt]) = (pose.q, pose.dq, pose.ddq);
    let (s, c) = t.sin_cos();
    let mut out = State { q: [0.0; 12], dq: [0.0; 12], ddq: [0.0; 12] };
    for i in 0..3 {
        let (l, xp) = (LEGS[i], ARMS[i]);
        let h = y + xp * s;
        let dh = dy + xp * c * dt;
        let ddh = ddy + xp * c * ddt - xp * s * dt * dt;
        let a = if i == 2 { PI - (h / l).asin() } else { (h / l).asin() };
        let (sa, ca) = a.sin_cos();
        let da = dh / (l * ca);
        let dda = (ddh + l * sa * da * da) / (l * ca);
        out.q[i] = x + xp * c - l * ca;
        out.dq[i] = dx - xp * s * dt + l * sa * da;
        out.ddq[i] = ddx - xp * s * ddt - xp * c * dt * dt + l * ca * da * da + l * sa * dda;
        (out.q[6 + i], out.dq[6 + i], out.ddq[6 + i]) = (a, da, dda);
        (out.q[9 + i], out.dq[9 + i], out.ddq[9 + i]) = (pose.q[i], pose.dq[i], pose.ddq[i]);
    }
    out
}

/// Inertial forces `M q'' + N`.
fn inertial_forces(state: &State, phi: &[f64; 13], g: f64) -> [f64; 12] {
    let (q, dq, ddq) = (&state.q, &state.dq, &state.ddq);
    let mut out = [0.0; 12];
    for i in 0..3 {
        let (m, mu, inertia) = (phi[0] + phi[1 + i], phi[5 + i], phi[9 + i]);
        let (sa, ca) = q[6 + i].sin_cos();
        let (da, dda) = (dq[6 + i], ddq[6 + i]);
        out[i] = m * ddq[i] - mu * sa * dda - mu * ca * da * da;
        out[3 + i] = m * ddq[3 + i] + mu * ca * dda - mu * sa * da * da + m * g;
        out[6 + i] = inertia * dda - mu * sa * ddq[i] + mu * ca * ddq[3 + i] + mu * g * ca;
    }
    let (m, moment, inertia) = (phi[4], phi[8], phi[12]);
    let (s, c) = q[11].sin_cos();
    let (dt, ddt) = (dq[11], ddq[11]);
    out[9] = m * ddq[9] - moment * s * ddt - moment * c * dt * dt;
    out[10] = m * ddq[10] + moment * c * ddt - moment * s * dt * dt + m * g;
    out[11] = inertia * ddt - moment * s * ddq[9] + moment * c * ddq[10] + moment * g * c;
    out
}

/// `B = ∂Γ/∂q` of the constraints.
fn constraint_rows(q: &[f64; 12]) -> [[f64; 12]; 9] {
    let mut b = [[0.0; 12]; 9];
    let (s, c) = q[11].sin_cos();
    for i in 0..3 {
        let (sa, ca) = q[6 + i].sin_cos();
        b[i][3 + i] = 1.0;
        let r = 3 + 2 * i;
        (b[r][i], b[r][6 + i], b[r][9], b[r][11]) = (-1.0, LEGS[i] * sa, 1.0, -ARMS[i] * s);
        (b[r + 1][3 + i], b[r + 1][6 + i], b[r + 1][10], b[r + 1][11]) =
            (-1.0, -LEGS[i] * ca, 1.0, ARMS[i] * c);
    }
    b
}

/// `W` (3 × 13), `Λ` (9 × 13) and slider speeds: `τ = W φ`, `λ = Λ φ`.
pub(crate) struct Rows {
    pub(crate) regressor: [[f64; 13]; 3],
    pub(crate) multipliers: [[f64; 13]; 9],
    pub(crate) speed: [f64; 3],
}

pub(crate) fn rows(pose: &Pose, g: f64) -> Rows {
    let state = inverse_kinematics(pose);
    let b = constraint_rows(&state.q);
    // B_pᵀ with a right-hand side per parameter.
    let mut system = [[0.0; 9 + 13]; 9];
    let forces: Vec<[f64; 12]> = (0..13)
        .map(|k| {
            let mut unit = [0.0; 13];
            unit[k] = 1.0;
            inertial_forces(&state, &unit, g)
        })
        .collect();
    for (i, row) in system.iter_mut().enumerate() {
        for (j, constraint) in b.iter().enumerate() {
            row[j] = constraint[3 + i];
        }
        for (k, force) in forces.iter().enumerate() {
            row[9 + k] = force[3 + i];
        }
    }
    eliminate(&mut system);
    let mut out = Rows {
        regressor: [[0.0; 13]; 3],
        multipliers: [[0.0; 13]; 9],
        speed: [state.dq[0], state.dq[1], state.dq[2]],
    };
    for k in 0..13 {
        for (multiplier, row) in out.multipliers.iter_mut().zip(&system) {
            multiplier[k] = row[9 + k];
        }
        for i in 0..3 {
            let pull: f64 = b.iter().zip(&system).map(|(b, row)| b[i] * row[9 + k]).sum();
            out.regressor[i][k] = forces[k][i] - pull;
        }
    }
    out
}

/// Gauss-Jordan with partial pivoting: the right-hand sides become the solution.
fn eliminate(system: &mut [[f64; 22]; 9]) {
    for c in 0..9 {
        let pivot = (c..9).max_by(|a, b| system[*a][c].abs().total_cmp(&system[*b][c].abs())).unwrap();
        system.swap(c, pivot);
        let scale = system[c][c];
        system[c].iter_mut().for_each(|v| *v /= scale);
        let row = system[c];
        for (r, other) in system.iter_mut().enumerate() {
            let factor = if r == c { 0.0 } else { other[c] };
            other.iter_mut().zip(&row).for_each(|(o, v)| *o -= factor * v);
        }
    }
}

/// Coefficients `q0, a1..a5, b1..b5` of x, y, θ of the identification.
pub(crate) const TRAJECTORY: [[f64; 11]; 3] = [
    [-0.0832, -0.0478, -0.0250, -0.0325, 0.0031, 0.1022, -0.0227, -0.0814, -0.0023, 0.0097, 0.03072],
    [0.3330, 0.0844, -0.0192, -0.0704, -0.0467, 0.0519, -0.0219, 0.0453, -0.0316, -0.0602, 0.05338],
    [-0.1682, 0.4291, -0.1077, -0.3291, -0.0431, 0.0508, 0.0107, 0.4551, -0.0708, -0.1497, -0.02194],
];

pub(crate) fn reference(t: f64) -> Pose {
    let mut pose = Pose { q: [0.0; 3], dq: [0.0; 3], ddq: [0.0; 3] };
    for (i, c) in TRAJECTORY.iter().enumerate() {
        pose.q[i] = c[0];
        for j in 1..=5 {
            let w = TAU * 0.25 * j as f64;
            let (s, k) = (w * t).sin_cos();
            let (a, b) = (c[j], c[5 + j]);
            pose.q[i] += a / w * s - b / w * k;
            pose.dq[i] += a * k + b * s;
            pose.ddq[i] += w * (b * k - a * s);
        }
    }
    pose
}

/// A full circle in 4 s.
pub(crate) fn circle(t: f64) -> Pose {
    let u = t / 4.0;
    let angle = TAU * u.powi(3) * (10.0 - 15.0 * u + 6.0 * u * u);
    let rate = TAU * 30.0 * (u * (1.0 - u)).powi(2) / 4.0;
    let growth = TAU * (60.0 * u - 180.0 * u * u + 120.0 * u.powi(3)) / 16.0;
    let (s, c) = angle.sin_cos();
    let r = 0.06;
    Pose {
        q: [-0.08 + r * c, 0.33 + r * s, -0.16],
        dq: [-r * rate * s, r * rate * c, 0.0],
        ddq: [-r * (growth * s + rate * rate * c), r * (growth * c - rate * rate * s), 0.0],
    }
}

/// Constant normal force rows `(m_s + m_Li + α_i m_p) g`.
pub(crate) fn weight(slider: usize) -> Vec<f64> {
    let mut w = vec![0.0; 13];
    (w[0], w[1 + slider], w[4]) = (GRAVITY, GRAVITY, SHARES[slider] * GRAVITY);
    w
}

/// The mechanism along a motion; `g` acts in its plane.
pub(crate) fn record(poses: &[Pose], g: f64) -> Record {
    let all: Vec<Rows> = poses.iter().map(|p| rows(p, g)).collect();
    let drive = |i: usize| DriveRows {
        regressor: Mat::from_fn(all.len(), 13, |t, k| all[t].regressor[i][k]),
        reactions: vec![Mat::from_fn(all.len(), 13, |t, k| all[t].multipliers[i][k])],
        weight: weight(i),
        speed: all.iter().map(|r| r.speed[i]).collect(),
    };
    Record::new((0..3).map(drive).collect()).unwrap()
}

/// `samples` samples over the 4 s of a trajectory, its end left out.
pub(crate) fn sampled(trajectory: fn(f64) -> Pose, samples: usize) -> Vec<Pose> {
    (0..samples).map(|i| trajectory(4.0 * i as f64 / samples as f64)).collect()
}

/// Efforts of Table 1 with the Stribeck law, and Gaussian noise.
pub(crate) fn efforts(record: &Record, noise: f64, seed: u64) -> Vec<Vec<f64>> {
    let zero = vec![vec![0.0; record.samples()]; 3];
    let machine = Problem::new(record.clone(), &zero, Settings::default()).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let clean = machine.predict(&TRUTH).unwrap();
    let mut noisy = |f: &f64| {
        let e: f64 = StandardNormal.sample(&mut rng);
        f + noise * e
    };
    clean.drives.iter().map(|d| d.effort.iter().map(&mut noisy).collect()).collect()
}

/// The experiment: 250 Hz over 4 s.
pub(crate) fn experiment(model: Model, noise: f64, seed: u64) -> Problem {
    let record = record(&sampled(reference, 1000), 0.0);
    let efforts = efforts(&record, noise, seed);
    Problem::new(record, &efforts, Settings { model, ..Settings::default() }).unwrap()
}
