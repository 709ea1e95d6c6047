//! The mechanism with clearance: two translations of each journal besides the rotations.

use dynid::model::JournalPath;

use super::pointing::{Pointing, description};
use super::{JOINTS, fault};
use crate::StudyError;

/// Names of the joints.
pub(super) const NAMES: [&str; JOINTS] = ["j1", "j2"];
/// Rates of the tree: both rotations, then the translations of journal 1 and of journal 2.
pub(super) const RATES: usize = 3 * JOINTS;

/// Rates of the translations of a journal.
pub(super) fn translations(joint: usize) -> [usize; 2] {
    [JOINTS + 2 * joint, JOINTS + 2 * joint + 1]
}

/// The mechanism with clearance in both joints, without contact.
pub(super) fn with_clearance() -> Result<Pointing, StudyError> {
    Pointing::new(&description()?.with_clearance(&NAMES).map_err(fault)?, NAMES)
}

/// Angles of both joints and offsets of both journals in the axes of their links, with two derivatives.
#[derive(Debug, Clone, Copy)]
pub(super) struct ClearanceState {
    pub(super) q: [[f64; JOINTS]; 3],
    /// `e1x, e1y, e2x, e2y`, m.
    pub(super) e: [[f64; 2 * JOINTS]; 3],
}

impl ClearanceState {
    /// Positions, rates and accelerations of the tree.
    pub(super) fn tree(&self) -> [[f64; RATES]; 3] {
        let mut out = [[0.0; RATES]; 3];
        for joint in 0..JOINTS {
            let turn = self.q.map(|q| q[joint]);
            let [position, rate, acceleration] = self.e.map(|e| [e[2 * joint], e[2 * joint + 1]]);
            let path = JournalPath { position, rate, acceleration }.in_bearing(turn);
            for (derivative, centre) in [path.position, path.rate, path.acceleration].into_iter().enumerate()
            {
                out[derivative][joint] = turn[derivative];
                for (rate, value) in translations(joint).into_iter().zip(centre) {
                    out[derivative][rate] = value;
                }
            }
        }
        out
    }

    /// From the tree's efforts at one sample: torques, and forces on the journals in the axes of their links.
    pub(super) fn loads(&self, effort: &[f64]) -> [JointLoad; JOINTS] {
        std::array::from_fn(|joint| {
            let force =
                JournalPath { position: translations(joint).map(|r| effort[r]), ..JournalPath::default() };
            JointLoad {
                torque: effort[joint],
                force: force.in_journal([self.q[0][joint], 0.0, 0.0]).position,
            }
        })
    }
}

/// What a joint passes on.
#[derive(Debug, Clone, Copy)]
pub(super) struct JointLoad {
    /// N m, about the journal's centre.
    pub(super) torque: f64,
    /// On the journal, N.
    pub(super) force: [f64; 2],
}
