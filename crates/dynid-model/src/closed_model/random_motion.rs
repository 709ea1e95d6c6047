//! Random states on the closed poses of a mechanism.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::ClosedModel;
use crate::closed::PoseWorkspace;
use crate::description::JointKind;
use crate::effort_model::EffortModel;
use crate::random_motion::{RandomMotion, channel_values};

/// Halvings of the way from home to a pose before it is given up.
const HALVINGS: usize = 12;
/// Least measure of singularity, as a share of that at home: poses that are next to singular would drown out all others.
const LEAST_MEASURE: f64 = 0.1;

impl ClosedModel {
    /// Random closed poses with random motion: independent positions inside the limits (±π and ±1 m about home where the file
    /// states none), rates in ±2, accelerations in ±5, channels and signals as [`RandomMotion::new`]. A pose that cannot be
    /// reached straight from home, is nearly singular or leaves the limits of another joint is moved half-way to home until it will do. The same
    /// seed gives the same numbers.
    pub(super) fn random_states(&self, samples: usize, seed: u64) -> RandomMotion {
        let machine = &self.machine;
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let d = machine.mobility();
        let mut uniform = |range: f64, count: usize| -> Vec<f64> {
            (0..count).map(|_| rng.random_range(-range..=range)).collect()
        };
        let (dq, ddq) = (uniform(2.0, d * samples), uniform(5.0, d * samples));
        let names = self.channels().iter().chain(self.signals());
        let channels = channel_values(names, |range| uniform(range, samples));

        let home = machine.home_independent();
        let owners = machine.mechanism().rate_bodies();
        let joint = |rate: usize| &machine.mechanism().bodies()[owners[rate]].joint;
        let ranges: Vec<(f64, f64)> = machine
            .independent()
            .iter()
            .zip(&home)
            .map(|(rate, at)| {
                let joint = joint(*rate);
                let reach = if joint.kind == JointKind::Prismatic { 1.0 } else { std::f64::consts::PI };
                match joint.limits.position {
                    Some((low, high)) if high > low && joint.kind != JointKind::Continuous => {
                        (low.max(at - 4.0 * reach), high.min(at + 4.0 * reach))
                    }
                    _ => (at - reach, at + reach),
                }
            })
            .collect();

        let mut work = machine.workspace();
        let least = LEAST_MEASURE * machine.singularity(&work).measure;
        // Limits that home itself breaks mean nothing here.
        let limits: Vec<(usize, (f64, f64))> = machine
            .dependent()
            .iter()
            .filter_map(|rate| Some((machine.position_of(*rate), joint(*rate).limits.position?)))
            .filter(|(k, range)| inside(machine.home()[*k], *range))
            .collect();
        let good = |pose: &PoseWorkspace| {
            limits.iter().all(|(k, range)| inside(pose.positions()[*k], *range))
                && machine.singularity(pose).measure >= least
        };
        let mut q = vec![0.0; d * samples];
        for sample in 0..samples {
            let mut target: Vec<f64> = ranges
                .iter()
                .map(|(low, high)| if high > low { rng.random_range(*low..=*high) } else { *low })
                .collect();
            let mut reached = false;
            for _ in 0..HALVINGS {
                machine.go_home(&mut work);
                reached = machine.reach(&mut work, &target).is_ok() && good(&work);
                if reached {
                    break;
                }
                target.iter_mut().zip(&home).for_each(|(t, h)| *t = 0.5 * (*t + h));
            }
            if !reached {
                target.clone_from(&home);
            }
            target.iter().enumerate().for_each(|(k, x)| q[k * samples + sample] = *x);
        }
        RandomMotion::from_parts(samples, [q, dq, ddq], channels)
    }
}

fn inside(x: f64, (low, high): (f64, f64)) -> bool {
    (low..=high).contains(&x)
}
