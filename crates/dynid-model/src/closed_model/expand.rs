//! Motion of all joints from that of the independent coordinates.

use super::{ClosedModel, PathError};
use crate::closed::{PoseError, PoseWorkspace};
use crate::dynamics::MotionBlock;

/// Poses of a motion that are tried on the way to its first one.
const LATER: usize = 64;

/// Motion of the tree over a block, packed without gaps, and how its efforts project onto the drives.
#[derive(Debug)]
pub(super) struct Expanded {
    pub(super) samples: usize,
    rates: usize,
    pub(super) q: Vec<f64>,
    pub(super) dq: Vec<f64>,
    pub(super) ddq: Vec<f64>,
    /// `effort[o] = Σ_r shares[(o * rates + r) * samples + s] t_r`.
    shares: Vec<f64>,
}

impl Expanded {
    /// Hands on the motion of the tree with gravity and channels of the block that it came from.
    ///
    /// `more`: channels beside those of the block, in place of channels of the same name.
    pub(super) fn with_block<T>(
        &self,
        motion: &MotionBlock<'_>,
        more: &[(&str, &[f64])],
        work: impl FnOnce(&MotionBlock<'_>) -> T,
    ) -> T {
        let channels: Vec<(&str, &[f64])> = more.iter().chain(motion.channels).copied().collect();
        let gravity: Option<Vec<f64>> = motion
            .gravity
            .map(|g| (0..3).flat_map(|c| g[c * motion.stride..][..self.samples].iter().copied()).collect());
        work(&MotionBlock {
            samples: self.samples,
            stride: self.samples,
            q: &self.q,
            dq: &self.dq,
            ddq: &self.ddq,
            gravity: gravity.as_deref(),
            channels: &channels,
            sign_width: motion.sign_width,
        })
    }

    /// How many numbers it holds.
    pub(super) fn numbers(&self) -> usize {
        self.q.len() + self.dq.len() + self.ddq.len() + self.shares.len()
    }

    /// Part of the effort of a rate that an output feels, one number per sample.
    pub(super) fn share(&self, output: usize, rate: usize) -> &[f64] {
        &self.shares[(output * self.rates + rate) * self.samples..][..self.samples]
    }

    /// Adds the part of a rate's column that an output feels.
    pub(super) fn add(&self, output: usize, rate: usize, from: &[f64], to: &mut [f64]) {
        for ((t, share), x) in to.iter_mut().zip(self.share(output, rate)).zip(from) {
            *t += share * x;
        }
    }
}

impl ClosedModel {
    /// Motion of all joints. Samples without a pose are not numbers.
    pub(super) fn expand(&self, motion: &MotionBlock<'_>) -> Expanded {
        self.expand_with(motion, |_, _, _, _| ())
    }

    /// Expands a motion of the drives; `visit(sample, motion so far, pose, fault)` sees every pose, with its velocity map.
    pub(super) fn expand_with(
        &self,
        motion: &MotionBlock<'_>,
        mut visit: impl FnMut(usize, &Expanded, &PoseWorkspace, Option<&PoseError>),
    ) -> Expanded {
        let (machine, samples) = (&self.machine, motion.samples);
        let (rates, positions) = (machine.mechanism().rates(), machine.mechanism().positions());
        let (d, outputs) = (machine.mobility(), self.outputs.len());
        let mut out = Expanded {
            samples,
            rates,
            q: vec![0.0; positions * samples],
            dq: vec![0.0; rates * samples],
            ddq: vec![0.0; rates * samples],
            shares: vec![0.0; outputs * rates * samples],
        };
        let mut work = machine.workspace();
        let mut drives = self.drives.clone();
        let (mut q, mut dq, mut ddq) = (vec![0.0; d], vec![0.0; d], vec![0.0; d]);
        let (mut all_dq, mut all_ddq) = (vec![0.0; rates], vec![0.0; rates]);
        let (mut unit, mut effort) = (vec![0.0; d], vec![0.0; outputs]);
        for sample in 0..samples {
            for k in 0..d {
                q[k] = motion.q[k * motion.stride + sample];
                dq[k] = motion.dq[k * motion.stride + sample];
                ddq[k] = motion.ddq[k * motion.stride + sample];
            }
            let mut found = self.next_pose(&mut work, &q);
            if found.is_err() && sample == 0 && self.round_about(&mut work, motion) {
                found = Ok(());
            }
            if let Err(fault) = found {
                let nan = |values: &mut [f64]| {
                    values.iter_mut().skip(sample).step_by(samples).for_each(|x| *x = f64::NAN);
                };
                [&mut out.q, &mut out.dq, &mut out.ddq, &mut out.shares].into_iter().for_each(|v| nan(v));
                visit(sample, &out, &work, Some(&fault));
                continue;
            }
            machine.motion(&mut work, (&dq, &ddq), &mut all_dq, &mut all_ddq);
            for (k, x) in work.positions().iter().enumerate() {
                out.q[k * samples + sample] = *x;
            }
            for (k, (v, a)) in all_dq.iter().zip(&all_ddq).enumerate() {
                out.dq[k * samples + sample] = *v;
                out.ddq[k * samples + sample] = *a;
            }
            if drives.are_independent() {
                for (k, row) in work.velocity_map().chunks_exact(d).enumerate() {
                    for (o, g) in row.iter().enumerate() {
                        out.shares[(o * rates + k) * samples + sample] = *g;
                    }
                }
            } else {
                drives.take(machine, &work);
                for (k, row) in work.velocity_map().chunks_exact(d).enumerate() {
                    unit.copy_from_slice(row);
                    drives.share(&unit, &mut effort);
                    for (o, e) in effort.iter().enumerate() {
                        out.shares[(o * rates + k) * samples + sample] = *e;
                    }
                }
            }
            visit(sample, &out, &work, None);
        }
        out
    }

    /// From the last pose, or from home where that fails.
    pub(super) fn next_pose(&self, work: &mut PoseWorkspace, independent: &[f64]) -> Result<(), PoseError> {
        if self.machine.reach(work, independent).is_ok() {
            return Ok(());
        }
        self.machine.go_home(work);
        self.machine.reach(work, independent)
    }

    /// Takes a workspace to the first pose of a motion where it cannot be reached straight from home: drive by drive in one of their cyclic
    /// orders, or by way of a later pose that can, from which the motion is followed back. False where neither succeeds.
    fn round_about(&self, work: &mut PoseWorkspace, motion: &MotionBlock<'_>) -> bool {
        let d = self.machine.mobility();
        let at = |sample: usize| (0..d).map(|k| motion.q[k * motion.stride + sample]).collect::<Vec<f64>>();
        let first = at(0);
        let home = self.machine.home_independent();
        let by_drives = |work: &mut PoseWorkspace, from: usize, forward: bool| {
            self.machine.go_home(work);
            let mut now = home.clone();
            (0..d).all(|k| {
                let drive = (from + if forward { k } else { d - k }) % d;
                now[drive] = first[drive];
                self.machine.reach(work, &now).is_ok()
            })
        };
        if (0..d).any(|from| by_drives(work, from, true) || by_drives(work, from, false)) {
            return true;
        }
        let step = motion.samples.div_ceil(LATER).max(1);
        (step..motion.samples).step_by(step).any(|later| {
            self.machine.go_home(work);
            self.machine.reach(work, &at(later)).is_ok()
                && (0..later).rev().all(|sample| self.machine.reach(work, &at(sample)).is_ok())
        })
    }

    /// Whether all poses of a motion can be reached, each from the one before or straight from home, as the model itself
    /// seeks them: states need not follow each other. The first one may also be reached drive by drive, or by way of a later one.
    ///
    /// # Errors
    /// [`PathError`] at the first sample without a pose, where all that the model computes is not a number.
    ///
    /// # Panics
    /// If the motion has other dimensions than the model.
    pub fn reachable(&self, motion: &MotionBlock<'_>) -> Result<(), PathError> {
        let mut first = None;
        self.expand_with(motion, |sample, _, _, fault| {
            if let (None, Some(fault)) = (&first, fault) {
                first = Some(PathError { sample, fault: fault.clone() });
            }
        });
        first.map_or(Ok(()), Err)
    }

    /// Follows a motion through all its poses, each from the one before.
    ///
    /// `visit(sample, pose)` sees every pose.
    ///
    /// # Errors
    /// [`PathError`] at the first sample whose pose is out of reach, singular or of another assembly mode, also on the
    /// straight way from the sample before.
    ///
    /// # Panics
    /// If the motion has other dimensions than the model.
    pub fn follow(
        &self,
        motion: &MotionBlock<'_>,
        mut visit: impl FnMut(usize, &PoseWorkspace),
    ) -> Result<(), PathError> {
        let mut work = self.machine.workspace();
        let mut q = vec![0.0; self.machine.mobility()];
        for sample in 0..motion.samples {
            for (k, x) in q.iter_mut().enumerate() {
                *x = motion.q[k * motion.stride + sample];
            }
            self.machine.reach(&mut work, &q).map_err(|fault| PathError { sample, fault })?;
            visit(sample, &work);
        }
        Ok(())
    }
}
