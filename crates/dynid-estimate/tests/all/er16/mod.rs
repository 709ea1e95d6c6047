//! The ER-16 problem : joints 1 to 3, 15 base parameters, five of friction per joint.
#![allow(dead_code, reason = "an example uses a part of it")]
#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use dynid_estimate::effort_objective::{EffortLoss, EffortObjective};
use dynid_model::element::{Arctangent, Coulomb, JointElement, Offset, Viscous};
use dynid_model::{
    BaseParameters, BaseSettings, Description, EffortModel, JointDescription, JointKind, Limits,
    LinkDescription, MotionBlock, Placement, RobotModel,
};
use dynid_motion::trajectory::Fourier;
use dynid_search::{Bounds, Objective};
pub(crate) use dynid_testing::reference;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde_json::Value;

pub(crate) fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

/// Numbers of a table of samples × joints, joint after joint.
pub(crate) fn joint_after_joint(table: &Value) -> Vec<f64> {
    let rows: Vec<Vec<f64>> = table.as_array().unwrap().iter().map(numbers).collect();
    (0..rows[0].len()).flat_map(|c| rows.iter().map(move |r| r[c])).collect()
}

/// Positions, velocities, accelerations, joint after joint.
pub(crate) struct Motion {
    pub(crate) samples: usize,
    pub(crate) q: Vec<f64>,
    pub(crate) dq: Vec<f64>,
    pub(crate) ddq: Vec<f64>,
}

impl Motion {
    /// From one row per sample.
    pub(crate) fn from_rows(q: &Value, dq: &Value, ddq: &Value) -> Motion {
        let columns = joint_after_joint;
        Motion { samples: q.as_array().unwrap().len(), q: columns(q), dq: columns(dq), ddq: columns(ddq) }
    }

    pub(crate) fn block(&self) -> MotionBlock<'_> {
        MotionBlock::plain(self.samples, &self.q, &self.dq, &self.ddq)
    }
}

pub(crate) struct Er16 {
    data: Value,
    pub(crate) model: RobotModel,
    /// Base columns of the model.
    pub(crate) kept: Vec<usize>,
    /// For every unknown of our objective: its place in the published order.
    pub(crate) order: Vec<usize>,
}

impl Er16 {
    pub(crate) fn load() -> Option<Er16> {
        let data = reference("robots/er16.json")?;
        let dh = |key: &str| numbers(&data["mdh"][key]);
        let (a, alpha, d, offset) = (dh("a"), dh("alpha"), dh("d"), dh("theta_offset"));
        let mut description = Description::new("er16");
        description.links.push(LinkDescription { name: "link0".into(), inertia: None });
        for k in 0..3 {
            description.links.push(LinkDescription { name: format!("link{}", k + 1), inertia: None });
            description.joints.push(JointDescription {
                name: format!("{}", k + 1),
                parent: format!("link{k}"),
                child: format!("link{}", k + 1),
                kind: JointKind::Revolute,
                placement: Placement::rotate([1.0, 0.0, 0.0], alpha[k])
                    .then(&Placement::translate(a[k], 0.0, d[k]))
                    .then(&Placement::rotate([0.0, 0.0, 1.0], offset[k])),
                axis: [0.0, 0.0, 1.0],
                limits: Limits::default(),
                mimic: None,
            });
        }
        let elements = (0..3).flat_map(|rate| -> [Box<dyn JointElement>; 4] {
            let arctangent = Box::new(Arctangent::new(rate));
            [Box::new(Offset { rate }), Box::new(Coulomb { rate }), Box::new(Viscous { rate }), arctangent]
        });
        let model = RobotModel::new(description.build().unwrap(), elements.collect());
        let rigid = RobotModel::new(model.mechanism().clone(), Vec::new());
        let base = BaseParameters::of(&rigid, rigid.mechanism(), &[], &BaseSettings::default());
        let table = model.parameters();
        let names: Vec<&str> =
            data["truth"]["base_names"].as_array().unwrap().iter().map(|n| n.as_str().unwrap()).collect();
        let mut order: Vec<usize> = base
            .kept
            .iter()
            .map(|c| names.iter().position(|n| *n == table.linear[*c].symbol).unwrap())
            .collect();
        let mut kept = base.kept.clone();
        let first = table.linear.len() - 12;
        kept.extend(first..first + 12);
        order.extend((0..3).flat_map(|j| (0..4).map(move |k| 15 + 5 * j + k)));
        order.extend((0..3).map(|j| 19 + 5 * j));
        Some(Er16 { data, model, kept, order })
    }

    /// From the published order of unknowns to that of the objective.
    pub(crate) fn ours(&self, published: &[f64]) -> Vec<f64> {
        self.order.iter().map(|k| published[*k]).collect()
    }

    pub(crate) fn published_truth(&self) -> Vec<f64> {
        let mut all = numbers(&self.data["truth"]["phi_base"]);
        all.extend(numbers(&self.data["truth"]["friction"]));
        all
    }

    pub(crate) fn truth(&self) -> Vec<f64> {
        self.ours(&self.published_truth())
    }

    pub(crate) fn bounds(&self) -> Bounds {
        let side = |key: &str| self.ours(&numbers(&self.data["search_bounds"][key]));
        Bounds::new(side("lower"), side("upper")).unwrap()
    }

    /// The reference trajectory `inertial`, 200 samples at 10 Hz.
    pub(crate) fn motion(&self) -> Motion {
        let rows = self.data["trajectories"]["inertial"]["coefficients"].as_array().unwrap();
        let (mut q, mut dq, mut ddq) = (Vec::new(), Vec::new(), Vec::new());
        for row in rows {
            let row = numbers(row);
            let base = 0.1 * std::f64::consts::PI;
            let series = Fourier::plain(base, row[0], row[1..6].to_vec(), row[6..11].to_vec()).unwrap();
            for k in 0..200 {
                let point = series.at(0.1 * k as f64);
                q.push(point.position);
                dq.push(point.velocity);
                ddq.push(point.acceleration);
            }
        }
        Motion { samples: 200, q, dq, ddq }
    }

    /// Efforts of the truth, joint after joint, with white noise of standard deviations 4, 5, 3 N m.
    pub(crate) fn efforts(&self, motion: &Motion, seed: u64) -> Vec<Vec<f64>> {
        let n = motion.samples;
        let truth = self.truth();
        let mut linear = vec![0.0; self.model.parameters().linear.len()];
        self.kept.iter().zip(&truth).for_each(|(c, v)| linear[*c] = *v);
        let mut clean = vec![0.0; 3 * n];
        self.model.efforts(&motion.block(), &truth[27..], &linear, n, &mut clean);
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let deviation = numbers(&self.data["simulation"]["torque_noise_std"]);
        let noisy = |(j, clean): (usize, &[f64])| {
            let noise = |e: &f64| e + deviation[j] * Distribution::<f64>::sample(&StandardNormal, &mut rng);
            clean.iter().map(noise).collect()
        };
        clean.chunks_exact(n).enumerate().map(noisy).collect()
    }

    pub(crate) fn objective<'a>(
        &'a self,
        motion: &'a Motion,
        efforts: &[Vec<f64>],
        weights: &[f64],
        loss: EffortLoss,
    ) -> EffortObjective<'a> {
        let efforts: Vec<&[f64]> = efforts.iter().map(Vec::as_slice).collect();
        EffortObjective::new(&self.model, motion.block(), &efforts, &self.kept, weights, loss).unwrap()
    }
}

pub(crate) fn value(objective: &dyn Objective, point: &[f64]) -> f64 {
    let mut value = [0.0];
    objective.evaluate(point, &mut value);
    value[0]
}

pub(crate) fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let n = sorted.len();
    0.5 * (sorted[(n - 1) / 2] + sorted[n / 2])
}
