//! From a tree and closures to a checked closed mechanism.

use dynid_linalg::Mat;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::closure::ClosureDescription;
use super::error::{ClosedError, ClosedWarning};
use super::factor::Factor;
use super::mechanism::ClosedMechanism;
use super::pose::PoseWorkspace;
use super::rows::Rows;
use super::singularity::smallest;
use crate::description::JointKind;
use crate::dynamics::tree::Tree;
use crate::mechanism::Mechanism;

/// Measure of singularity below which poses are refused (see [`ClosedMechanism::with_least_measure`]).
const LEAST_MEASURE: f64 = 1e-4;
/// Singular values below this share of the largest count as zero.
const RANK: f64 = 1e-9;
/// Closed configurations that the mobility is taken at, and how far they are from home (rad or lengths `L_c`).
const CONFIGURATIONS: usize = 5;
const SPREAD: f64 = 0.2;
/// Change of a coordinate at home that is worth a word.
const MOVED: f64 = 1e-3;
const CLOSED: f64 = 1e-12;
/// Largest gap where steps along all coordinates do not close the loops further.
const STRETCHED: f64 = 0.1;
/// Smallest part of a step towards a closed pose that is tried.
const SHORTEST: f64 = 1.0 / 1024.0;

pub(super) fn build(
    mechanism: Mechanism,
    closures: Vec<ClosureDescription>,
    driven: Option<&[String]>,
    home: &[(String, Vec<f64>)],
    least_measure: f64,
) -> Result<ClosedMechanism, ClosedError> {
    if mechanism.follows().is_some()
        && let Some(body) = mechanism.bodies().iter().find(|b| b.joint.mimic.is_some())
    {
        return Err(ClosedError::Mimic { joint: body.joint.name.clone() });
    }
    let tree = Tree::new(&mechanism);
    let rows = Rows::new(&tree, &mechanism, &closures)?;
    let length = mechanism.characteristic_length();
    let row_scale = rows.angular.iter().map(|angular| if *angular { length } else { 1.0 }).collect();
    let n = tree.rates;
    let (mut rate_scale, mut position_of, mut floats) = (vec![1.0; n], vec![0; n], vec![false; n]);
    for body in mechanism.bodies() {
        for k in 0..body.joint.rates() {
            let turns = match body.joint.kind {
                JointKind::Prismatic => false,
                JointKind::Floating => k >= 3,
                _ => true,
            };
            rate_scale[body.rate + k] = if turns { length } else { 1.0 };
            position_of[body.rate + k] = body.position;
            floats[body.rate + k] = body.joint.kind == JointKind::Floating;
        }
    }
    let mut machine = ClosedMechanism {
        home: home_positions(&mechanism, home)?,
        undetermined: vec![false; rows.len()],
        mode_rows: Vec::new(),
        mode: 0.0,
        driven: Vec::new(),
        independent: Vec::new(),
        dependent: Vec::new(),
        warnings: Vec::new(),
        mechanism,
        closures,
        tree,
        rows,
        length,
        row_scale,
        rate_scale,
        position_of,
        floats,
        least_measure,
    };
    if machine.closures.is_empty() {
        if let Some(body) = machine.mechanism.bodies().iter().find(|b| b.joint.kind == JointKind::Floating) {
            return Err(ClosedError::Floating { joint: body.joint.name.clone(), role: "driven" });
        }
        machine.driven = (0..n).collect();
        machine.independent.clone_from(&machine.driven);
        let home = machine.home.clone();
        return machine.settle(&[home], "driven");
    }
    let poses = machine.generic_poses()?;
    let rank = poses.iter().map(|q| machine.rank_at(q)).max().unwrap_or(0);
    if rank == n {
        return Err(ClosedError::Immobile { rows: rank, rates: n });
    }
    let mobility = n - rank;
    let stated = driven.map(|names| machine.rates_named(names, "driven")).transpose()?;
    machine.driven = match stated {
        Some(driven) => driven,
        None => {
            let candidates: Vec<usize> = (0..n).filter(|r| !machine.floats[*r]).collect();
            let chosen = machine.chosen(&poses, &candidates, mobility);
            let joints = chosen.iter().map(|r| machine.rate_name(*r)).collect();
            machine.warnings.push(ClosedWarning::DrivesChosen { joints });
            chosen
        }
    };
    let drives = machine.driven.len();
    if drives < mobility {
        let motion = machine.free_motion(&poses[0], &machine.driven);
        return Err(ClosedError::UnderActuated { drives, mobility, motion });
    }
    machine.independent = if drives == mobility {
        machine.driven.clone()
    } else {
        machine.warnings.push(ClosedWarning::OverActuated { drives, mobility });
        machine.chosen(&poses, &machine.driven.clone(), mobility)
    };
    machine.settle(&poses, "driven")
}

pub(super) fn with_independent(
    mut machine: ClosedMechanism,
    joints: &[String],
) -> Result<ClosedMechanism, ClosedError> {
    let found = joints.len();
    if found != machine.mobility() {
        return Err(ClosedError::IndependentCount { mobility: machine.mobility(), found });
    }
    machine.independent = machine.rates_named(joints, "independent")?;
    machine.warnings.retain(|w| !matches!(w, ClosedWarning::Redundant { .. }));
    let poses = machine.generic_poses()?;
    machine.settle(&poses, "independent")
}

fn home_positions(mechanism: &Mechanism, home: &[(String, Vec<f64>)]) -> Result<Vec<f64>, ClosedError> {
    let mut q = vec![0.0; mechanism.joint_positions()];
    for body in mechanism.bodies().iter().filter(|b| b.joint.kind == JointKind::Floating) {
        q[body.position + 6] = 1.0;
    }
    for (joint, values) in home {
        let body = &mechanism.bodies()[mechanism.joint_index(joint)?];
        let to = &mut q[body.position..body.position + body.joint.positions()];
        let norm = values.iter().skip(3).map(|x| x * x).sum::<f64>().sqrt();
        let unit = to.len() == 1 || (norm - 1.0).abs() < 1e-3;
        if values.len() != to.len() || values.iter().any(|x| !x.is_finite()) || !unit {
            return Err(ClosedError::Home {
                joint: joint.clone(),
                expected: to.len(),
                found: format!("{values:?}"),
            });
        }
        to.copy_from_slice(values);
        if to.len() == 7 {
            to[3..].iter_mut().for_each(|x| *x /= norm);
        }
    }
    Ok(q)
}

impl ClosedMechanism {
    /// Closes the loops of a mechanism.
    ///
    /// `driven`: names of the joints that drives act on; `None`: as many as needed are chosen. They are also the
    /// independent coordinates if there are as many of them as free motions; otherwise some of them are. `home`: positions of
    /// joints near a closed pose (seven numbers for a floating joint), 0 where nothing is said. With the independent joints
    /// held there, the others are solved for.
    ///
    /// # Errors
    /// [`ClosedError`].
    pub fn new(
        mechanism: Mechanism,
        closures: Vec<ClosureDescription>,
        driven: Option<&[String]>,
        home: &[(String, Vec<f64>)],
    ) -> Result<ClosedMechanism, ClosedError> {
        if closures.is_empty() {
            return Err(ClosedError::NoClosures);
        }
        build(mechanism, closures, driven, home, LEAST_MEASURE)
    }

    /// A tree as a mechanism without closures, whose joints are all driven and independent: what is known of forces inside
    /// mechanisms with loops is then known of it too.
    ///
    /// # Errors
    /// [`ClosedError::Mimic`] for joints that follow others, [`ClosedError::Floating`] for joints that float.
    pub fn open(mechanism: Mechanism) -> Result<ClosedMechanism, ClosedError> {
        build(mechanism, Vec::new(), None, &[], LEAST_MEASURE)
    }

    /// Returns the mechanism with other independent coordinates: a pose of the platform, say, in place of the drives.
    ///
    /// # Errors
    /// [`ClosedError::IndependentCount`], [`ClosedError::Dependent`], [`ClosedError::SingularHome`], and those of names.
    pub fn with_independent(self, joints: &[String]) -> Result<ClosedMechanism, ClosedError> {
        with_independent(self, joints)
    }

    fn rates_named(&self, joints: &[String], role: &'static str) -> Result<Vec<usize>, ClosedError> {
        let mut rates = Vec::with_capacity(joints.len());
        for joint in joints {
            let body = &self.mechanism.bodies()[self.mechanism.joint_index(joint)?];
            if body.joint.rates() != 1 {
                return Err(ClosedError::Floating { joint: joint.clone(), role });
            }
            if rates.contains(&body.rate) {
                return Err(ClosedError::NamedTwice { joint: joint.clone(), role });
            }
            rates.push(body.rate);
        }
        Ok(rates)
    }

    /// Fixes the dependent coordinates, the home pose and what is told of it.
    fn settle(mut self, poses: &[Vec<f64>], role: &'static str) -> Result<ClosedMechanism, ClosedError> {
        let n = self.tree.rates;
        self.dependent = (0..n).filter(|r| !self.independent.contains(r)).collect();
        let rank = |q: &Vec<f64>| rank_of(&smallest(&self.scaled(&self.jacobian_at(q), &self.dependent)).0);
        if poses.iter().all(|q| rank(q) < self.dependent.len()) {
            let motion = self.free_motion(&poses[0], &self.independent);
            return Err(ClosedError::Dependent { role, motion });
        }
        self.mode_rows = (0..self.rows.len()).collect();
        let stated = self.home.clone();
        let mut work = self.workspace();
        if self.newton(&mut work).is_none() {
            // Held where they were stated, the independent coordinates leave no way to close: all may move.
            self.home.clone_from(&poses[0]);
            work = self.workspace();
        }
        self.home.clone_from(&work.q);
        let found = self.singularity(&work);
        if found.measure < self.least_measure || found.measure.is_nan() {
            let (measure, motion, least) = (found.measure, found.motion, self.least_measure);
            return Err(ClosedError::SingularHome { role, measure, least, motion });
        }
        if let Some(closure) = self.rows.flipped(&work.world) {
            return Err(ClosedError::Flipped { closure: self.closures[closure].name.clone() });
        }
        self.find_redundancy(&mut work);
        self.mode = self.mode_of(&mut work);
        let moved = stated.iter().zip(&self.home).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        if moved > MOVED {
            self.warnings.push(ClosedWarning::HomeMoved { largest: moved });
        }
        Ok(self)
    }

    /// Rows that repeat others, and the multipliers that are thereby not determined.
    fn find_redundancy(&mut self, work: &mut PoseWorkspace) {
        let (m, n) = (self.rows.len(), self.tree.rates);
        let rank = self.dependent.len();
        if m == rank {
            return;
        }
        let null = work.factor.null_rows();
        self.undetermined = null.iter().map(|x| *x > RANK).collect();
        // Rows that are wanted most come first: those of largest part outside of the others.
        let mut order = Factor::default();
        let transposed = self.scaled(&work.jacobian, &self.dependent);
        order.reflect_all(n.max(m), m, |i, j| if i < rank { transposed[(j, i)] } else { 0.0 });
        let mut kept = order.pivots()[..rank].to_vec();
        kept.sort_unstable();
        self.mode_rows = kept;
        let mut closures: Vec<String> = Vec::new();
        for (row, _) in self.undetermined.iter().enumerate().filter(|(_, u)| **u) {
            let name = &self.closures[self.rows.owner[row]].name;
            if !closures.contains(name) {
                closures.push(name.clone());
            }
        }
        self.warnings.push(ClosedWarning::Redundant { rows: m, rank, closures });
    }

    /// Returns as many of the candidates as there are free motions, so that they determine the motion as well as may be.
    fn chosen(&self, poses: &[Vec<f64>], candidates: &[usize], mobility: usize) -> Vec<usize> {
        // Dependent coordinates are taken first, from what is no candidate; candidates left over are independent.
        let jacobian = poses.last().map(|q| self.jacobian_at(q)).unwrap_or_default();
        let others: Vec<usize> = (0..self.tree.rates).filter(|r| !candidates.contains(r)).collect();
        let mut directions: Vec<Vec<f64>> = Vec::new();
        let mut dependent: Vec<usize> = Vec::new();
        for group in [others.as_slice(), candidates] {
            let scaled = self.scaled(&jacobian, group);
            let column = |j: usize| -> Vec<f64> { scaled.col(j).to_vec() };
            let mut left: Vec<(usize, Vec<f64>)> =
                group.iter().enumerate().map(|(j, r)| (*r, column(j))).collect();
            while dependent.len() < self.tree.rates - mobility && !left.is_empty() {
                for (_, column) in &mut left {
                    directions.iter().for_each(|kept| remove(column, kept));
                }
                let size = |k: usize| left[k].1.iter().map(|x| x * x).sum::<f64>();
                let best = (0..left.len()).fold(0, |m, k| if size(k) > size(m) { k } else { m });
                let length = size(best).sqrt();
                if length < RANK {
                    break;
                }
                let (rate, column) = left.swap_remove(best);
                dependent.push(rate);
                directions.push(column.iter().map(|x| x / length).collect());
            }
        }
        candidates.iter().copied().filter(|r| !dependent.contains(r)).take(mobility).collect()
    }

    /// Closed configurations near the home position, the first next to it. All coordinates may move.
    fn generic_poses(&self) -> Result<Vec<Vec<f64>>, ClosedError> {
        let mut poses = vec![self.closed(&self.home)?];
        let mut rng = ChaCha8Rng::seed_from_u64(0x6c6f_6f70);
        for _ in 0..4 * CONFIGURATIONS {
            let mut q = poses[0].clone();
            let step: Vec<f64> = self
                .rate_scale
                .iter()
                .map(|scale| SPREAD * self.length / scale * rng.random_range(-1.0..=1.0))
                .collect();
            self.displace(&mut q, &step);
            if let Ok(q) = self.closed(&q) {
                poses.push(q);
            }
            if poses.len() > CONFIGURATIONS {
                break;
            }
        }
        Ok(poses)
    }

    /// The nearest closed pose, by Gauss-Newton steps of least norm on all coordinates, each shortened until it closes the
    /// loops further.
    fn closed(&self, q: &[f64]) -> Result<Vec<f64>, ClosedError> {
        let all: Vec<usize> = (0..self.tree.rates).collect();
        let mut q = q.to_vec();
        let mut residual = vec![0.0; self.rows.len()];
        let mut jacobian = self.residual_at(&q, &mut residual);
        let mut cut = RANK;
        for _ in 0..100 {
            let scaled: Vec<f64> = residual.iter().zip(&self.row_scale).map(|(r, s)| -r * s).collect();
            let gap = scaled.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            if gap <= CLOSED {
                return Ok(q);
            }
            let mut step = least_norm(&self.scaled(&jacobian, &all), &scaled, cut);
            let longest = step.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            let short = (0.5 * self.length / longest).min(1.0);
            for (x, scale) in step.iter_mut().zip(&self.rate_scale) {
                *x *= short / scale;
            }
            let size = |residual: &[f64]| -> f64 {
                residual.iter().zip(&self.row_scale).map(|(r, s)| (r * s).powi(2)).sum()
            };
            let before = size(&residual);
            let mut part = 1.0;
            let better = loop {
                let mut next = q.clone();
                self.displace(&mut next, &step.iter().map(|x| part * x).collect::<Vec<_>>());
                let jacobian = self.residual_at(&next, &mut residual);
                // Near round-off nothing falls any more.
                if size(&residual) <= before * (1.0 - 0.1 * part) || gap < 1e3 * CLOSED {
                    break Some((next, jacobian));
                }
                part *= 0.5;
                if part < SHORTEST {
                    break None;
                }
            };
            match better {
                Some(better) => {
                    (q, jacobian) = better;
                    cut = RANK;
                }
                None => {
                    // Nearly singular directions lead nowhere: without them.
                    self.residual_at(&q, &mut residual);
                    if cut > RANK {
                        break;
                    }
                    cut = STRETCHED;
                }
            }
        }
        let (closure, gap) = self.largest_gap(&residual);
        Err(ClosedError::NotClosed { closure, gap })
    }

    fn residual_at(&self, q: &[f64], residual: &mut [f64]) -> Vec<f64> {
        let mut jacobian = vec![0.0; self.rows.len() * self.tree.rates];
        let mut world = super::sweep::World::new(&self.tree);
        world.place(&self.tree, q);
        self.rows.evaluate(&world, q, residual, &mut jacobian);
        jacobian
    }

    fn jacobian_at(&self, q: &[f64]) -> Vec<f64> {
        self.residual_at(q, &mut vec![0.0; self.rows.len()])
    }

    fn rank_at(&self, q: &[f64]) -> usize {
        let all: Vec<usize> = (0..self.tree.rates).collect();
        rank_of(&smallest(&self.scaled(&self.jacobian_at(q), &all)).0)
    }

    /// A motion that is free while some rates are held.
    fn free_motion(&self, q: &[f64], held: &[usize]) -> super::NamedMotion {
        let others: Vec<usize> = (0..self.tree.rates).filter(|r| !held.contains(r)).collect();
        let (_, vector) = smallest(&self.scaled(&self.jacobian_at(q), &others));
        let rates: Vec<f64> = vector.iter().zip(&others).map(|(x, r)| x / self.rate_scale[*r]).collect();
        self.named_motion(&others, &rates)
    }
}

fn remove(column: &mut [f64], direction: &[f64]) {
    let along: f64 = column.iter().zip(direction).map(|(a, b)| a * b).sum();
    column.iter_mut().zip(direction).for_each(|(c, d)| *c -= along * d);
}

fn rank_of(values: &[f64]) -> usize {
    let largest = values.first().copied().unwrap_or(0.0);
    values.iter().filter(|v| **v > RANK * largest).count()
}

/// `A⁺ b`, without singular values below a share of the largest.
fn least_norm(matrix: &Mat, b: &[f64], cut: f64) -> Vec<f64> {
    let mut x = vec![0.0; matrix.ncols()];
    let Some(svd) = matrix.svd() else { return vec![f64::NAN; matrix.ncols()] };
    let (u, s, v) = (svd.u, svd.values, svd.v);
    let largest = s.iter().fold(0.0_f64, |m, x| m.max(*x));
    for k in 0..s.len() {
        if s[k] > cut * largest {
            let along = b.iter().enumerate().map(|(i, b)| u[(i, k)] * b).sum::<f64>() / s[k];
            x.iter_mut().enumerate().for_each(|(i, x)| *x += along * v[(i, k)]);
        }
    }
    x
}
