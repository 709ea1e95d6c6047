//! Motions of all joints that were worked out before: estimators ask for the same states again and again.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use super::expand::Expanded;
use super::reactions::ReactionShares;
use crate::dynamics::MotionBlock;

/// Most numbers that are kept (192 MB); beyond it all are dropped and kept anew.
const MOST: usize = 24 << 20;

/// A motion of all joints, and how reactions follow from efforts along it.
#[derive(Debug)]
pub(super) struct Path {
    pub(super) expanded: Expanded,
    /// `None` where no friction follows reactions.
    pub(super) shares: Option<ReactionShares>,
}

/// Paths by the motion that they came from. What is kept has the same bits as what is worked out anew.
#[derive(Debug, Default)]
pub(super) struct Paths {
    kept: Mutex<Kept>,
}

#[derive(Debug, Default)]
struct Kept {
    paths: HashMap<u64, (Vec<f64>, Arc<Path>)>,
    numbers: usize,
}

impl Paths {
    /// The path of a motion, worked out where it is not known. Motions with a gravity of their own are not kept.
    pub(super) fn of(
        &self,
        motion: &MotionBlock<'_>,
        coordinates: usize,
        find: impl FnOnce() -> Path,
    ) -> Arc<Path> {
        if motion.gravity.is_some() || motion.samples == 0 {
            return Arc::new(find());
        }
        let key: Vec<f64> = [motion.q, motion.dq, motion.ddq]
            .into_iter()
            .flat_map(|signal| (0..coordinates).flat_map(|k| &signal[k * motion.stride..][..motion.samples]))
            .copied()
            .collect();
        // Fowler-Noll-Vo over words.
        let hash = key.iter().fold(0xcbf2_9ce4_8422_2325_u64, |h, x| {
            (h ^ x.to_bits()).wrapping_mul(0x0100_0000_01b3).rotate_left(23)
        });
        let same = |kept: &[f64]| {
            kept.len() == key.len() && kept.iter().zip(&key).all(|(a, b)| a.to_bits() == b.to_bits())
        };
        if let Some((own, path)) = self.lock().paths.get(&hash)
            && same(own)
        {
            return path.clone();
        }
        let path = Arc::new(find());
        let numbers = key.len() + path.numbers();
        if numbers <= MOST {
            let mut kept = self.lock();
            if kept.numbers + numbers > MOST {
                *kept = Kept::default();
            }
            if let Some((own, old)) = kept.paths.insert(hash, (key, path.clone())) {
                kept.numbers -= own.len() + old.numbers();
            }
            kept.numbers += numbers;
        }
        path
    }

    /// A panic elsewhere leaves whole paths behind.
    fn lock(&self) -> std::sync::MutexGuard<'_, Kept> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Path {
    fn numbers(&self) -> usize {
        self.expanded.numbers() + self.shares.as_ref().map_or(0, ReactionShares::numbers)
    }
}
