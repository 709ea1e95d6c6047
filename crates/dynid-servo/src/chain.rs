//! Rigid bodies of a robot on a fixed base, chain by chain, with the derivatives of their efforts.

use dynid_model::scalar::{Dual, Lanes};
use dynid_model::{Dynamics, DynamicsWorkspace, Mechanism, State, Vec3};

/// Accelerations that one pass of the recursion takes side by side.
const LANES: usize = 4;

/// Numbers without fused multiply-add, so that every processor gives the same bits.
type Wide = Lanes<LANES, false>;

/// Coordinates along which one pass differentiates: by their positions, then by their rates.
const SLOTS: usize = 4;

type Slope = Dual<{ 2 * SLOTS }>;

/// One of the trees that hang on the ground: none feels another.
#[derive(Debug, Clone)]
pub struct Chain {
    dynamics: Dynamics,
    /// Joints of the robot, one per rate of the chain.
    pub joints: Vec<usize>,
    /// Standard parameters of the chain's bodies that are numbers `inertias` of the robot's.
    pub(crate) inertias: Vec<usize>,
}

impl Chain {
    /// The chains of a robot.
    pub fn all(mechanism: &Mechanism) -> Vec<Chain> {
        let chains = mechanism.chains();
        let chain = |(part, joints): (Mechanism, Vec<usize>)| {
            let place = |name: &str| mechanism.bodies().iter().position(|b| b.joint.name == name);
            let bodies = part.bodies().iter().filter_map(|b| place(&b.joint.name));
            let inertias = bodies.flat_map(|b| 10 * b..10 * b + 10).collect();
            Chain { dynamics: Dynamics::new(&part), joints, inertias }
        };
        chains.into_iter().map(chain).collect()
    }

    /// Number of joints.
    pub fn len(&self) -> usize {
        self.joints.len()
    }

    /// Whether nothing moves.
    pub fn is_empty(&self) -> bool {
        self.joints.is_empty()
    }
}

/// Memory and results of a chain's equation of motion at one state.
#[derive(Debug)]
pub(crate) struct Equation<'a> {
    chain: &'a Chain,
    n: usize,
    inertias: Vec<f64>,
    wide: DynamicsWorkspace<Wide>,
    wide_inertias: Vec<Wide>,
    slope: DynamicsWorkspace<Slope>,
    slope_inertias: Vec<Slope>,
    plain: DynamicsWorkspace<f64>,
    wide_state: [Vec<Wide>; 3],
    wide_effort: Vec<Wide>,
    slope_state: [Vec<Slope>; 3],
    slope_effort: Vec<Slope>,
    zeros: Vec<f64>,
    /// Mass matrix, row-major.
    pub(crate) mass: Vec<f64>,
    /// Gravity, Coriolis and centrifugal efforts.
    pub(crate) bias: Vec<f64>,
    /// Slope of the efforts by positions, row-major.
    pub(crate) by_position: Vec<f64>,
    /// Slope of the efforts by rates.
    pub(crate) by_rate: Vec<f64>,
    /// Slope of `bias` by positions.
    pub(crate) bias_by_position: Vec<f64>,
    /// Regressor of the standard parameters, and that of `bias`, row-major.
    pub(crate) regressor: Vec<f64>,
    pub(crate) bias_regressor: Vec<f64>,
}

impl<'a> Equation<'a> {
    pub(crate) fn new(chain: &'a Chain, robot_inertias: &[f64]) -> Self {
        let (n, d) = (chain.len(), &chain.dynamics);
        let inertias: Vec<f64> = chain.inertias.iter().map(|k| robot_inertias[*k]).collect();
        let zero = |x: &f64| Dual { value: *x, derivative: [0.0; 2 * SLOTS] };
        Equation {
            chain,
            n,
            wide: d.workspace(),
            wide_inertias: inertias.iter().map(|x| Lanes([*x; LANES])).collect(),
            slope: d.workspace(),
            slope_inertias: inertias.iter().map(zero).collect(),
            plain: d.workspace(),
            wide_state: std::array::from_fn(|_| vec![Lanes([0.0; LANES]); n]),
            wide_effort: vec![Lanes([0.0; LANES]); n],
            slope_state: std::array::from_fn(|_| vec![zero(&0.0); n]),
            slope_effort: vec![zero(&0.0); n],
            zeros: vec![0.0; n],
            mass: vec![0.0; n * n],
            bias: vec![0.0; n],
            by_position: vec![0.0; n * n],
            by_rate: vec![0.0; n * n],
            bias_by_position: vec![0.0; n * n],
            regressor: vec![0.0; n * inertias.len()],
            bias_regressor: vec![0.0; n * inertias.len()],
            inertias,
        }
    }

    /// Mass matrix and bias at a state.
    pub(crate) fn values(&mut self, q: &[f64], v: &[f64]) {
        let n = self.n;
        let gravity = self.chain.dynamics.gravity();
        // Column 0 is the bias, column k + 1 that of the mass matrix for joint k.
        for first in (0..=n).step_by(LANES) {
            let bias_here = first == 0;
            let [wide_q, wide_v, wide_a] = &mut self.wide_state;
            for j in 0..n {
                wide_q[j] = Lanes([q[j]; LANES]);
                wide_v[j] = Lanes(std::array::from_fn(|l| if bias_here && l == 0 { v[j] } else { 0.0 }));
                wide_a[j] = Lanes(std::array::from_fn(|l| if first + l == j + 1 { 1.0 } else { 0.0 }));
            }
            let lane = |g: f64| Lanes(std::array::from_fn(|l| if bias_here && l == 0 { g } else { 0.0 }));
            let gravity = Some(Vec3(gravity.0.map(lane)));
            let state = State { q: wide_q, dq: wide_v, ddq: wide_a, gravity };
            let (wide, effort) = (&mut self.wide, &mut self.wide_effort);
            self.chain.dynamics.inverse_dynamics(&state, &self.wide_inertias, wide, effort);
            for l in 0..LANES.min(n + 1 - first) {
                for (j, e) in effort.iter().enumerate() {
                    match first + l {
                        0 => self.bias[j] = e.0[0],
                        k => self.mass[j * n + k - 1] = e.0[l],
                    }
                }
            }
        }
    }

    /// Slopes of `M(q) a + b(q, v)`; with `of_bias` those of `b` too.
    pub(crate) fn slopes(&mut self, q: &[f64], v: &[f64], a: &[f64], of_bias: bool) {
        self.slope_pass(q, v, a);
        for j in 0..self.n {
            for k in 0..self.n {
                self.bias_by_position[j * self.n + k] = 0.0;
            }
        }
        if of_bias {
            let keep = (self.by_position.clone(), self.by_rate.clone());
            let zeros = std::mem::take(&mut self.zeros);
            self.slope_pass(q, v, &zeros);
            self.zeros = zeros;
            self.bias_by_position.copy_from_slice(&self.by_position);
            (self.by_position, self.by_rate) = keep;
        }
    }

    fn slope_pass(&mut self, q: &[f64], v: &[f64], a: &[f64]) {
        let n = self.n;
        for first in (0..n).step_by(SLOTS) {
            let [slope_q, slope_v, slope_a] = &mut self.slope_state;
            let at = |j: usize, half: usize| {
                std::array::from_fn(|s| if s / SLOTS == half && first + s % SLOTS == j { 1.0 } else { 0.0 })
            };
            for j in 0..n {
                slope_q[j] = Dual { value: q[j], derivative: at(j, 0) };
                slope_v[j] = Dual { value: v[j], derivative: at(j, 1) };
                slope_a[j] = Dual { value: a[j], derivative: [0.0; 2 * SLOTS] };
            }
            let state = State { q: &*slope_q, dq: &*slope_v, ddq: &*slope_a, gravity: None };
            let (slope, effort) = (&mut self.slope, &mut self.slope_effort);
            self.chain.dynamics.inverse_dynamics(&state, &self.slope_inertias, slope, effort);
            for (j, e) in effort.iter().enumerate() {
                for s in 0..SLOTS.min(n - first) {
                    self.by_position[j * n + first + s] = e.derivative[s];
                    self.by_rate[j * n + first + s] = e.derivative[SLOTS + s];
                }
            }
        }
    }

    /// Regressors of `M(q) a + b(q, v)` and of `b`.
    pub(crate) fn regressors(&mut self, q: &[f64], v: &[f64], a: &[f64]) {
        let state = State { q, dq: v, ddq: a, gravity: None };
        self.chain.dynamics.regressor(&state, &mut self.plain, &mut self.regressor);
        let state = State { ddq: &self.zeros, ..state };
        self.chain.dynamics.regressor(&state, &mut self.plain, &mut self.bias_regressor);
    }

    /// Efforts `M(q) a + b(q, v)` of the bodies.
    pub(crate) fn efforts(&mut self, q: &[f64], v: &[f64], a: &[f64], out: &mut [f64]) {
        let state = State { q, dq: v, ddq: a, gravity: None };
        self.chain.dynamics.inverse_dynamics(&state, &self.inertias, &mut self.plain, out);
    }

    /// Columns of the regressor.
    pub(crate) fn columns(&self) -> usize {
        self.inertias.len()
    }
}
