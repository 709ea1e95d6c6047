//! A fleet of six-joint arms whose truth is known: robots that differ, logs that scatter, temperature and load, outliers, wear and faults.
#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::f64::consts::TAU;

use dynid_factor::FactorBuilder;
use dynid_fleet::{ChannelFactor, Coordinate, Fleet, FleetLog};
use dynid_model::element::{Coulomb, JointElement, Offset, Viscous};
use dynid_model::{
    BaseParameters, BaseSettings, Description, EffortModel, Inertia, JointDescription, JointKind, Limits,
    LinkDescription, MotionBlock, Placement, RegressorBlock, RobotModel,
};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

pub(crate) const JOINTS: usize = 6;
const RATE_HZ: f64 = 25.0;
const SECONDS: f64 = 10.0;
const NOISE: [f64; JOINTS] = [2.0, 3.0, 1.5, 0.4, 0.3, 0.2];
const COULOMB: [f64; JOINTS] = [12.0, 15.0, 8.0, 3.0, 2.0, 1.5];
const VISCOUS: [f64; JOINTS] = [10.0, 12.0, 7.0, 2.5, 2.0, 1.2];
/// Relative spread of Coulomb, viscous friction and offset between robots and between logs.
pub(crate) const SPREAD: [(f64, f64); 3] = [(0.20, 0.04), (0.25, 0.06), (0.10, 0.03)];
/// Viscous friction per kelvin, Coulomb friction per kilogram, relative.
const EFFECTS: (f64, f64) = (-0.01, 0.02);
pub(crate) const YEAR: f64 = 365.0 * 86_400.0;

/// What differs from a plain fleet.
#[derive(Clone, Copy)]
pub(crate) struct Plan {
    pub(crate) robots: usize,
    pub(crate) logs: usize,
    pub(crate) seed: u64,
    /// Robots that stand out by 8 standard deviations in one joint.
    pub(crate) outliers: usize,
    /// Share of logs that are broken in one joint by 15.
    pub(crate) broken: f64,
    pub(crate) wear: usize,
    pub(crate) faults: usize,
    /// Whether temperature and load act.
    pub(crate) covariates: bool,
}

/// A change that was put in.
#[derive(Debug, Clone)]
pub(crate) struct Truth {
    pub(crate) robot: usize,
    pub(crate) coordinate: usize,
    pub(crate) step: bool,
    /// Date, as a share of the year.
    pub(crate) at: f64,
}

pub(crate) struct Simulated {
    pub(crate) fleet: Fleet,
    pub(crate) theta: Vec<f64>,
    /// Per robot and log: parameters in all columns.
    pub(crate) robots: Vec<Vec<f64>>,
    pub(crate) logs: Vec<Vec<f64>>,
    /// Size of every coordinate.
    pub(crate) sizes: Vec<f64>,
    pub(crate) changes: Vec<Truth>,
    pub(crate) outliers: Vec<usize>,
    pub(crate) broken: Vec<usize>,
    pub(crate) arm: Arm,
}

fn normal(rng: &mut impl Rng) -> f64 {
    StandardNormal.sample(rng)
}

pub(crate) struct Arm {
    model: RobotModel,
    kept: Vec<usize>,
    /// Per coordinate (Coulomb, viscous, offset of joint 1, of joint 2 ...): its column among the kept ones.
    pub(crate) varying: Vec<usize>,
    inertias: Vec<f64>,
}

fn arm() -> Arm {
    let mut d = Description::new("arm");
    d.links.push(LinkDescription { name: "l0".into(), inertia: None });
    let tilt = [0.0, -1.571, 0.0, -1.571, 1.571, -1.571];
    for k in 1..=JOINTS {
        let m = 6.0 / k as f64;
        d.links.push(LinkDescription {
            name: format!("l{k}"),
            inertia: Some(Inertia([
                m,
                0.02 * m,
                -0.01 * m,
                0.1 * m,
                0.02 * m,
                0.0,
                0.001 * m,
                0.02 * m,
                0.0,
                0.01 * m,
            ])),
        });
        d.joints.push(JointDescription {
            name: format!("j{k}"),
            parent: format!("l{}", k - 1),
            child: format!("l{k}"),
            kind: JointKind::Revolute,
            placement: Placement::from_xyz_rpy([0.05, 0.0, 0.25], [tilt[k - 1], 0.0, 0.0]),
            axis: [0.0, 0.0, 1.0],
            limits: Limits::default(),
            mimic: None,
        });
    }
    let elements = (0..JOINTS)
        .flat_map(|rate| -> [Box<dyn JointElement>; 3] {
            [Box::new(Coulomb { rate }), Box::new(Viscous { rate }), Box::new(Offset { rate })]
        })
        .collect();
    let inertias: Vec<Inertia> = d.links.iter().filter_map(|l| l.inertia).collect();
    let model = RobotModel::new(d.build().unwrap(), elements);
    let base = BaseParameters::of(&model, model.mechanism(), &[], &BaseSettings::default());
    let table = &model.parameters().linear;
    let elements = 10 * JOINTS;
    let varying = (elements..table.len()).map(|c| base.kept.binary_search(&c).unwrap()).collect();
    let mut standard: Vec<f64> = inertias.iter().flat_map(|i| i.0).collect();
    standard.resize(table.len(), 0.0);
    let inertias = base.values(&standard);
    Arm { kept: base.kept, varying, inertias, model }
}

impl Arm {
    /// Base regressor of a motion of its own: per joint its columns, and column after column.
    fn rows(&self, rng: &mut ChaCha8Rng) -> Vec<(Vec<usize>, Vec<f64>)> {
        let samples = (RATE_HZ * SECONDS) as usize;
        let (mut q, mut dq, mut ddq) = (Vec::new(), Vec::new(), Vec::new());
        for _ in 0..JOINTS {
            let amplitude = rng.random_range(0.3..1.2);
            let waves: Vec<(f64, f64, f64)> = (0..4)
                .map(|_| {
                    (
                        TAU * rng.random_range(0.05..0.5),
                        rng.random_range(0.0..TAU),
                        amplitude * normal(rng) / 4.0,
                    )
                })
                .collect();
            let start = rng.random_range(-1.5..1.5);
            for k in 0..samples {
                let t = k as f64 / RATE_HZ;
                let at = |f: &dyn Fn(f64, f64) -> f64| {
                    waves.iter().map(|(w, phase, a)| a * f(*w, w * t + phase)).sum::<f64>()
                };
                q.push(start + at(&|_, x| x.sin()));
                dq.push(at(&|w, x| w * x.cos()));
                ddq.push(at(&|w, x| -w * w * x.sin()));
            }
        }
        let moving = MotionBlock::plain(samples, &q, &dq, &ddq);
        let mut block = RegressorBlock::new(self.model.layout().clone(), samples);
        self.model.regressor(&moving, &[], &mut block);
        let of_joint = |joint: usize| {
            let (mut names, mut columns) = (Vec::new(), Vec::new());
            for (k, column) in self.model.layout().columns(joint).iter().enumerate() {
                if let Ok(name) = self.kept.binary_search(column) {
                    names.push(name);
                    columns.extend_from_slice(block.column(joint, k));
                }
            }
            (names, columns)
        };
        (0..JOINTS).map(of_joint).collect()
    }

    /// Relative error of the efforts of a motion, of all joints by their noise.
    pub(crate) fn effort_error(&self, seed: u64, found: &[f64], truth: &[f64]) -> f64 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let (mut wrong, mut all) = (0.0, 0.0);
        for (joint, (names, columns)) in self.rows(&mut rng).into_iter().enumerate() {
            let n = columns.len() / names.len();
            for i in 0..n {
                let effort = |x: &[f64]| {
                    names.iter().enumerate().map(|(c, name)| columns[c * n + i] * x[*name]).sum::<f64>()
                };
                wrong += ((effort(found) - effort(truth)) / NOISE[joint]).powi(2);
                all += (effort(truth) / NOISE[joint]).powi(2);
            }
        }
        (wrong / all).sqrt()
    }
}

/// Half white, half of 0.1 s.
fn noise(rng: &mut ChaCha8Rng, samples: usize) -> Vec<f64> {
    let pole = (-1.0 / (0.1 * RATE_HZ)).exp();
    let mut state = normal(rng);
    let mut draw = || {
        state = pole * state + (1.0 - pole * pole).sqrt() * normal(rng);
        (state + normal(rng)) / 2.0_f64.sqrt()
    };
    (0..samples).map(|_| draw()).collect()
}

pub(crate) fn simulate(plan: &Plan) -> Simulated {
    let arm = arm();
    let p = arm.kept.len();
    let q = 3 * JOINTS;
    let nominal: Vec<f64> = (0..JOINTS).flat_map(|j| [COULOMB[j], VISCOUS[j], 0.1 * COULOMB[j]]).collect();
    let sizes: Vec<f64> = (0..JOINTS).flat_map(|j| [COULOMB[j], VISCOUS[j], COULOMB[j]]).collect();
    let mut theta = arm.inertias.clone();
    (0..q).for_each(|k| theta[arm.varying[k]] += nominal[k]);
    let mut rng = ChaCha8Rng::seed_from_u64(plan.seed);
    let mut left: Vec<usize> = (0..plan.robots).collect();
    let mut take = |rng: &mut ChaCha8Rng| left.swap_remove(rng.random_range(0..left.len()));
    let outliers: Vec<usize> = (0..plan.outliers).map(|_| take(&mut rng)).collect();
    let mut changes: Vec<Truth> = Vec::new();
    for n in 0..plan.wear + plan.faults {
        let step = n >= plan.wear;
        let joint = rng.random_range(0..JOINTS);
        let kind = if step { [0, 2][rng.random_range(0..2)] } else { rng.random_range(0..2) };
        let at = if step { rng.random_range(0.25..0.75) } else { rng.random_range(0.2..0.7) };
        changes.push(Truth { robot: take(&mut rng), coordinate: 3 * joint + kind, step, at });
    }
    let sizes_of_changes: Vec<f64> = (changes.iter())
        .map(|c| match c.step {
            true => {
                rng.random_range(0.2..0.4)
                    * if rng.random_bool(0.5) { 1.0 } else { -1.0 }
                    * COULOMB[c.coordinate / 3]
            }
            false => rng.random_range(0.3..0.6) * sizes[c.coordinate],
        })
        .collect();
    let mut robots = Vec::new();
    for r in 0..plan.robots {
        let mut x = theta.clone();
        let stands_out = outliers.contains(&r).then(|| rng.random_range(0..JOINTS));
        for k in 0..q {
            let sd = SPREAD[k % 3].0 * sizes[k];
            let draw = if stands_out == Some(k / 3) {
                8.0 * if normal(&mut rng) < 0.0 { -1.0 } else { 1.0 }
            } else {
                normal(&mut rng)
            };
            x[arm.varying[k]] += sd * draw;
        }
        robots.push(x);
    }
    let of_log = |index: usize| {
        let (r, l) = (index / plan.logs, index % plan.logs);
        let mut rng = ChaCha8Rng::seed_from_u64(plan.seed);
        rng.set_stream(1 + index as u64);
        let at = (l as f64 + rng.random_range(0.05..0.95)) / plan.logs as f64;
        let temperature = 25.0 + 8.0 * (TAU * at).sin() + normal(&mut rng);
        let changes_load = r % 5 == 0;
        let load = if changes_load && at > 0.3 + 0.4 * ((r / 5) as f64 * 0.37).fract() { 3.0 } else { 1.0 };
        let mut x = robots[r].clone();
        let broken = (rng.random_range(0.0..1.0) < plan.broken).then(|| rng.random_range(0..JOINTS));
        for k in 0..q {
            let draw = if broken == Some(k / 3) { 15.0 } else { normal(&mut rng) };
            x[arm.varying[k]] += SPREAD[k % 3].1 * sizes[k] * draw;
        }
        if plan.covariates {
            for joint in 0..JOINTS {
                x[arm.varying[3 * joint + 1]] += EFFECTS.0 * (temperature - 25.0) * VISCOUS[joint];
                x[arm.varying[3 * joint]] += EFFECTS.1 * (load - 1.0) * COULOMB[joint];
            }
        }
        for (change, size) in changes.iter().zip(&sizes_of_changes).filter(|(c, _)| c.robot == r) {
            let share = if change.step {
                f64::from(at >= change.at)
            } else {
                ((at - change.at) / (1.0 - change.at)).max(0.0)
            };
            x[arm.varying[change.coordinate]] += size * share;
        }
        let level = (0.4 * normal(&mut ChaCha8Rng::seed_from_u64(plan.seed ^ (77 + r as u64)))
            + 0.2 * normal(&mut rng))
        .exp();
        let channel = |(joint, (columns, regressor)): (usize, (Vec<usize>, Vec<f64>))| {
            let n = regressor.len() / columns.len();
            let mut effort = noise(&mut rng, n);
            effort.iter_mut().for_each(|e| *e *= NOISE[joint] * level);
            for (c, column) in columns.iter().enumerate() {
                effort.iter_mut().zip(&regressor[c * n..]).for_each(|(e, w)| *e += w * x[*column]);
            }
            let mut builder = FactorBuilder::with_chunk_rows(columns.len(), n);
            builder.push_block(&regressor, n, &effort).unwrap();
            ChannelFactor { channel: joint, columns, factor: builder.finish() }
        };
        let mut motion = ChaCha8Rng::seed_from_u64(plan.seed.wrapping_mul(31) + index as u64);
        let channels = arm.rows(&mut motion).into_iter().enumerate().map(channel).collect();
        let covariates = if plan.covariates { vec![temperature, load] } else { Vec::new() };
        (
            FleetLog { robot: r, key: index as u64, time_s: YEAR * at, covariates, channels },
            x,
            broken.is_some(),
        )
    };
    let made: Vec<(FleetLog, Vec<f64>, bool)> =
        (0..plan.robots * plan.logs).into_par_iter().map(of_log).collect();
    let broken = (0..made.len()).filter(|k| made[*k].2).collect();
    let (mut logs, mut truths) = (Vec::new(), Vec::new());
    for (log, x, _) in made {
        logs.push(log);
        truths.push(x);
    }
    let coordinate = |k: usize| Coordinate {
        column: arm.varying[k],
        between_robots: true,
        between_logs: true,
        watched: true,
        kind: k % 3,
    };
    let fleet = Fleet {
        columns: p,
        channels: JOINTS,
        robots: (0..plan.robots as u64).map(|r| r.wrapping_mul(0x9E37_79B9_7F4A_7C15)).collect(),
        covariates: if plan.covariates { 2 } else { 0 },
        varying: (0..q).map(coordinate).collect(),
        logs,
    };
    Simulated { fleet, theta, robots, logs: truths, sizes, changes, outliers, broken, arm }
}
