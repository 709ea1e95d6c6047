//! Joints 1 to 3 of the ER-16 with offset, Coulomb, viscous and arctangent friction (spec/er16.md).

use dynid_estimate::separable::{EffortBlock, SeparableEstimate};
use dynid_model::element::{Arctangent, Coulomb, JointElement, Offset, Viscous};
use dynid_model::{
    Description, EffortModel, Inertia, JointDescription, JointKind, Limits, LinkDescription, MotionBlock,
    Placement, RegressorBlock, RobotModel, ShapeParameter,
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde_json::Value;
use std::f64::consts::{FRAC_PI_2, TAU};

pub(crate) const JOINTS: usize = 3;
/// Time blocks of the motion.
const BLOCKS: usize = 10;

/// The arm, its motion and the truth of Table 3.
pub(crate) struct Er16 {
    pub(crate) model: RobotModel,
    pub(crate) kept: Vec<usize>,
    /// 15 base parameters, then `fo, fc, fv, fa, fb` per joint.
    pub(crate) truth: Vec<f64>,
    /// Per kept column: its place in the truth.
    places: Vec<usize>,
    samples: usize,
    q: Vec<f64>,
    dq: Vec<f64>,
    ddq: Vec<f64>,
}

fn model() -> RobotModel {
    let mut d = Description::new("er16");
    d.links.push(LinkDescription { name: "base".into(), inertia: None });
    let rows = [(0.0, 0.0, 0.45, 0.0), (0.17, -FRAC_PI_2, 0.0, -FRAC_PI_2), (0.7, 0.0, 0.0, 0.0)];
    for (k, (a, alpha, length, theta)) in rows.into_iter().enumerate() {
        let inertia = Some(Inertia([1.0, 0.1, 0.1, 0.1, 1.0, 0.0, 0.0, 1.0, 0.0, 1.0]));
        d.links.push(LinkDescription { name: format!("link{}", k + 1), inertia });
        d.joints.push(JointDescription {
            name: format!("j{}", k + 1),
            parent: if k == 0 { "base".into() } else { format!("link{k}") },
            child: format!("link{}", k + 1),
            kind: JointKind::Revolute,
            placement: Placement::rotate([1.0, 0.0, 0.0], alpha)
                .then(&Placement::translate(a, 0.0, 0.0))
                .then(&Placement::rotate([0.0, 0.0, 1.0], theta))
                .then(&Placement::translate(0.0, 0.0, length)),
            axis: [0.0, 0.0, 1.0],
            limits: Limits::default(),
            mimic: None,
        });
    }
    let elements = (0..JOINTS)
        .flat_map(|rate| -> [Box<dyn JointElement>; 4] {
            [
                Box::new(Offset { rate }),
                Box::new(Coulomb { rate }),
                Box::new(Viscous { rate }),
                Box::new(Arctangent::new(rate)),
            ]
        })
        .collect();
    RobotModel::new(d.build().unwrap(), elements)
}

/// Numbers of a table of samples × joints, joint after joint.
pub(crate) fn joint_after_joint(table: &Value) -> Vec<f64> {
    let rows: Vec<Vec<f64>> = table.as_array().unwrap().iter().map(crate::golden::vector).collect();
    (0..JOINTS).flat_map(|j| rows.iter().map(move |r| r[j]).collect::<Vec<f64>>()).collect()
}

impl Er16 {
    fn new(q: Vec<f64>, dq: Vec<f64>, ddq: Vec<f64>) -> Option<Self> {
        let robot = crate::golden::load("../robots/er16.json")?;
        let model = model();
        let base = robot["truth"]["base_names"].as_array().unwrap();
        let friction = ["fo", "fc", "fv", "fa"];
        let listed = base.iter().enumerate().map(|(place, name)| (place, name.as_str().unwrap().to_owned()));
        let listed = listed.chain((0..JOINTS).flat_map(|j| {
            friction.iter().enumerate().map(move |(k, name)| (15 + 5 * j + k, format!("{name}{}", j + 1)))
        }));
        let column = |symbol: &str| {
            let found = model.parameters().linear.iter().position(|p| p.symbol == symbol);
            found.unwrap_or_else(|| panic!("no parameter {symbol}"))
        };
        let mut columns: Vec<(usize, usize)> = listed.map(|(place, name)| (column(&name), place)).collect();
        columns.sort_unstable();
        let numbers = |name: &str| crate::golden::vector(&robot["truth"][name]);
        Some(Er16 {
            kept: columns.iter().map(|c| c.0).collect(),
            places: columns.iter().map(|c| c.1).collect(),
            truth: numbers("phi_base").into_iter().chain(numbers("friction")).collect(),
            model,
            samples: q.len() / JOINTS,
            q,
            dq,
            ddq,
        })
    }

    /// One period of the reference trajectory `inertial`.
    pub(crate) fn reference(samples: usize) -> Option<Self> {
        let robot = crate::golden::load("../robots/er16.json")?;
        let (mut q, mut dq, mut ddq) = (Vec::new(), Vec::new(), Vec::new());
        for row in robot["trajectories"]["inertial"]["coefficients"].as_array().unwrap() {
            let c = crate::golden::vector(row);
            for s in 0..samples {
                let t = TAU * s as f64 / samples as f64;
                let (mut position, mut velocity, mut acceleration) = (c[0], 0.0, 0.0);
                for k in 1..=5 {
                    let (a, b, w) = (c[k], c[5 + k], k as f64 * TAU * 0.05);
                    let (sin, cos) = (k as f64 * t).sin_cos();
                    position += a * sin + b * cos;
                    velocity += w * (a * cos - b * sin);
                    acceleration -= w * w * (a * sin + b * cos);
                }
                q.push(position);
                dq.push(velocity);
                ddq.push(acceleration);
            }
        }
        Er16::new(q, dq, ddq)
    }

    /// The motion of the golden set.
    pub(crate) fn golden(golden: &Value) -> Option<Self> {
        let of = |name: &str| joint_after_joint(&golden[name]);
        Er16::new(of("q"), of("qd"), of("qdd"))
    }

    /// Shape parameters with the bounds of the study.
    pub(crate) fn shape(&self) -> Vec<ShapeParameter> {
        let own = self.model.parameters().shape.iter();
        own.map(|p| ShapeParameter { start: 5.5, lower: 1.0, upper: 30.0, logarithmic: true, ..p.clone() })
            .collect()
    }

    fn motion(&self, from: usize, samples: usize) -> MotionBlock<'_> {
        MotionBlock {
            samples,
            stride: self.samples,
            q: &self.q[from..],
            dq: &self.dq[from..],
            ddq: &self.ddq[from..],
            gravity: None,
            channels: &[],
            sign_width: 0.0,
        }
    }

    /// Ten time blocks of one log.
    pub(crate) fn blocks<'a>(&'a self, effort: &'a [f64]) -> Vec<EffortBlock<'a>> {
        let length = self.samples.div_ceil(BLOCKS);
        (0..self.samples)
            .step_by(length)
            .map(|k| EffortBlock {
                log: 0,
                motion: self.motion(k, length.min(self.samples - k)),
                effort: &effort[k..],
            })
            .collect()
    }

    /// Efforts of a parameter vector in the order of the truth, joint after joint.
    pub(crate) fn efforts(&self, x: &[f64]) -> Vec<f64> {
        let shape: Vec<f64> = (0..JOINTS).map(|j| x[19 + 5 * j]).collect();
        let mut linear = vec![0.0; self.model.layout().parameters()];
        self.kept.iter().zip(&self.places).for_each(|(column, place)| linear[*column] = x[*place]);
        let mut block = RegressorBlock::new(self.model.layout().clone(), self.samples);
        self.model.regressor(&self.motion(0, self.samples), &shape, &mut block);
        (0..JOINTS).flat_map(|j| block.effort(j, &linear)).collect()
    }

    pub(crate) fn clean(&self) -> Vec<f64> {
        self.efforts(&self.truth)
    }

    /// Efforts with white noise of 4, 5 and 3 N m.
    pub(crate) fn noisy(&self, seed: u64) -> Vec<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let deviation = |k: usize| [4.0, 5.0, 3.0][k / self.samples];
        let clean = self.clean().into_iter().enumerate();
        clean
            .map(|(k, e)| {
                let draw: f64 = StandardNormal.sample(&mut rng);
                e + deviation(k) * draw
            })
            .collect()
    }

    /// The estimate in the order of the truth.
    pub(crate) fn vector(&self, estimate: &SeparableEstimate) -> Vec<f64> {
        let mut x = vec![0.0; self.truth.len()];
        self.places.iter().zip(&estimate.linear).for_each(|(place, v)| x[*place] = *v);
        estimate.shape.iter().enumerate().for_each(|(j, fb)| x[19 + 5 * j] = *fb);
        x
    }

    /// Largest deviation from the truth.
    pub(crate) fn error(&self, estimate: &SeparableEstimate) -> f64 {
        self.vector(estimate).iter().zip(&self.truth).map(|(x, t)| (x - t).abs()).fold(0.0, f64::max)
    }

    /// `F`: mean over samples of the sum of absolute residuals of the joints.
    pub(crate) fn loss_of(&self, x: &[f64], effort: &[f64]) -> f64 {
        let residuals = self.efforts(x).into_iter().zip(effort).map(|(e, y)| (e - y).abs());
        residuals.sum::<f64>() / self.samples as f64
    }

    pub(crate) fn loss(&self, estimate: &SeparableEstimate, effort: &[f64]) -> f64 {
        self.loss_of(&self.vector(estimate), effort)
    }
}
