//! A six-joint arm with friction on an exciting motion, its rows filtered and thinned as a log's are.
#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use dynid_factor::rows::{GroupShape, MemoryRows, Rows};
use dynid_model::element::{Coulomb, JointElement, Offset, Viscous};
use dynid_model::{
    BaseParameters, BaseSettings, Description, EffortModel, Inertia, JointDescription, JointKind, Limits,
    LinkDescription, MotionBlock, Placement, RegressorBlock, RobotModel,
};
use dynid_motion::filter::{Sections, butterworth, forward_backward, pick};
use dynid_motion::trajectory::Fourier;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

pub(crate) const JOINTS: usize = 6;
pub(crate) const RATE_HZ: f64 = 250.0;
pub(crate) const CUT_OFF_HZ: f64 = 10.0;
const DECIMATION: usize = 10;
/// Standard deviation of the raw effort noise of each joint, N m.
pub(crate) const NOISE: [f64; JOINTS] = [2.0, 3.0, 1.5, 0.4, 0.3, 0.2];

pub(crate) fn model() -> RobotModel {
    let mut d = Description::new("arm");
    d.links.push(LinkDescription { name: "l0".into(), inertia: None });
    let tilt = [0.0, -1.571, 0.0, -1.571, 1.571, -1.571];
    for k in 1..=JOINTS {
        d.links.push(LinkDescription {
            name: format!("l{k}"),
            inertia: Some(Inertia([3.0, 0.1, 0.2, 0.3, 0.5, 0.01, 0.02, 0.6, 0.03, 0.7])),
        });
        d.joints.push(JointDescription {
            name: format!("j{k}"),
            parent: format!("l{}", k - 1),
            child: format!("l{k}"),
            kind: JointKind::Revolute,
            placement: Placement::from_xyz_rpy([0.03 * k as f64, 0.0, 0.25], [tilt[k - 1], 0.0, 0.0]),
            axis: [0.0, 0.0, 1.0],
            limits: Limits::default(),
            mimic: None,
        });
    }
    let elements = (0..JOINTS)
        .flat_map(|rate| -> [Box<dyn JointElement>; 3] {
            [Box::new(Viscous { rate }), Box::new(Coulomb { rate }), Box::new(Offset { rate })]
        })
        .collect();
    RobotModel::new(d.build().unwrap(), elements)
}

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

/// Positions, velocities and accelerations, joint after joint.
pub(crate) fn motion(samples: usize, stream: u64) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let mut rng = ChaCha8Rng::seed_from_u64(40);
    rng.set_stream(stream);
    let (mut q, mut dq, mut ddq) = (Vec::new(), Vec::new(), Vec::new());
    for joint in 0..JOINTS {
        let mut speeds = || (0..6).map(|_| 0.45 * normal(&mut rng)).collect::<Vec<f64>>();
        // Periods between 9 and 13 s that share no multiple within a log.
        let base = std::f64::consts::TAU / (9.0 + 0.73 * joint as f64);
        let motion = Fourier::velocity_amplitudes(base, 0.3, &speeds(), &speeds()).unwrap();
        for k in 0..samples {
            let point = motion.at(k as f64 / RATE_HZ);
            q.push(point.position);
            dq.push(point.velocity);
            ddq.push(point.acceleration);
        }
    }
    (q, dq, ddq)
}

/// Effort noise of a joint with correlation time `tau` in seconds (0: white).
pub(crate) fn noise(joint: usize, samples: usize, seed: u64, tau: f64) -> Vec<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(41 + joint as u64);
    rng.set_stream(seed);
    let pole = if tau > 0.0 { (-1.0 / (tau * RATE_HZ)).exp() } else { 0.0 };
    let mut state = normal(&mut rng);
    let draws = (0..samples).map(|_| {
        state = pole * state + (1.0 - pole * pole).sqrt() * normal(&mut rng);
        NOISE[joint] * state
    });
    draws.collect()
}

/// Filtered and thinned rows of one motion, effort without noise.
pub(crate) struct Arm {
    /// Parameters of the base columns behind the efforts.
    pub(crate) truth: Vec<f64>,
    samples: usize,
    filter: Sections,
    /// Raw regressor of all standard parameters, and the base columns among them.
    raw: RegressorBlock,
    kept: Vec<usize>,
    /// Per joint: base columns that act.
    acting: Vec<Vec<usize>>,
    /// Per joint: column-major regressor and effort.
    rows: Vec<(Vec<f64>, Vec<f64>)>,
}

impl Arm {
    pub(crate) fn new(seconds: f64) -> Arm {
        let model = model();
        let samples = (seconds * RATE_HZ) as usize;
        let (q, dq, ddq) = motion(samples, 0);
        let mut rng = ChaCha8Rng::seed_from_u64(39);
        let base = BaseParameters::of(&model, model.mechanism(), &[], &BaseSettings::default());
        let truth: Vec<f64> = base.kept.iter().map(|_| normal(&mut rng)).collect();
        let moving = MotionBlock::plain(samples, &q, &dq, &ddq);
        let mut block = RegressorBlock::new(model.layout().clone(), samples);
        model.regressor(&moving, &[], &mut block);
        let filter = butterworth(4, CUT_OFF_HZ, RATE_HZ).unwrap();
        let (mut acting, mut rows) = (Vec::new(), Vec::new());
        for joint in 0..JOINTS {
            let (mut names, mut regressor) = (Vec::new(), Vec::new());
            let mut effort = vec![0.0; samples.div_ceil(DECIMATION)];
            for (k, column) in model.layout().columns(joint).iter().enumerate() {
                let Ok(name) = base.kept.binary_search(column) else { continue };
                let thin = thinned(&filter, block.column(joint, k));
                effort.iter_mut().zip(&thin).for_each(|(e, w)| *e += w * truth[name]);
                names.push(name);
                regressor.extend(thin);
            }
            acting.push(names);
            rows.push((regressor, effort));
        }
        Arm { truth, samples, filter, raw: block, kept: base.kept, acting, rows }
    }

    /// Measured minus predicted raw effort of a joint of [`Self::log`] at an estimate of the base parameters.
    pub(crate) fn raw_residual(&self, joint: usize, seed: u64, tau: f64, x: &[f64]) -> Vec<f64> {
        let mut error = vec![0.0; self.raw.layout().parameters()];
        for (column, (x, truth)) in self.kept.iter().zip(x.iter().zip(&self.truth)) {
            error[*column] = x - truth;
        }
        let noise = noise(joint, self.samples, seed, tau);
        noise.iter().zip(self.raw.effort(joint, &error)).map(|(n, e)| n - e).collect()
    }

    /// One log: noise of correlation time `tau` (0: white) on the raw efforts, filtered and thinned with them, in blocks
    /// of a second.
    pub(crate) fn log(&self, seed: u64, tau: f64) -> MemoryRows {
        let per_block = (RATE_HZ as usize).div_ceil(DECIMATION);
        let mut out = MemoryRows::new();
        for joint in 0..JOINTS {
            let noise = noise(joint, self.samples, seed, tau);
            let (regressor, clean) = &self.rows[joint];
            let noise = thinned(&self.filter, &noise);
            let effort: Vec<f64> = clean.iter().zip(&noise).map(|(c, n)| c + n).collect();
            let blocks = effort.len() / per_block;
            let columns = self.acting[joint].clone();
            let group = out.add_group(GroupShape { log: 0, output: joint, scale: 0, columns, blocks });
            for block in 0..blocks {
                let range = block * per_block..(block + 1) * per_block;
                let samples: Vec<usize> = range.clone().map(|k| k * DECIMATION).collect();
                out.push(
                    group,
                    &Rows {
                        block,
                        samples: &samples,
                        regressor: &self.part(regressor, range.clone(), effort.len()),
                        stride: per_block,
                        effort: &effort[range],
                    },
                );
            }
        }
        out
    }

    fn part(&self, regressor: &[f64], range: std::ops::Range<usize>, stride: usize) -> Vec<f64> {
        regressor.chunks_exact(stride).flat_map(|column| column[range.clone()].iter().copied()).collect()
    }
}

fn thinned(filter: &Sections, signal: &[f64]) -> Vec<f64> {
    pick(&forward_backward(filter, signal).unwrap(), DECIMATION, 0)
}
