//! Merging over a fixed tree: the result depends on the set of parts, not on their order, grouping or number of threads.
//!
//! A node is a prefix of the keys, its value the triangle of its two sides stacked, the side of the lower keys first; an empty side passes the
//! other through unchanged. A part that is added changes the nodes above it only (Demmel, Grigori, Hoemmen and Langou 2012).

use dynid_linalg::{AsView, Mat};

use crate::triangle::triangle;

/// Parts below this number are merged on the thread that asks.
const ALONE: usize = 8;

/// The triangle of all parts, `R_ii ≥ 0`; `None` without parts.
///
/// `parts`: keys, ascending and all different, and matrices of the same width.
pub fn merge(parts: &[(u64, &Mat)]) -> Option<Mat> {
    debug_assert!(parts.windows(2).all(|pair| pair[0].0 < pair[1].0), "keys ascend");
    node(parts, u64::BITS)
}

/// Merges parts whose keys agree in all bits from `bits` on.
fn node(parts: &[(u64, &Mat)], bits: u32) -> Option<Mat> {
    match parts {
        [] => None,
        [(_, part)] => Some((*part).clone()),
        _ => {
            let bit = 1 << (bits - 1);
            let (low, high) = parts.split_at(parts.partition_point(|(key, _)| key & bit == 0));
            let (low, high) = if parts.len() < ALONE {
                (node(low, bits - 1), node(high, bits - 1))
            } else {
                rayon::join(|| node(low, bits - 1), || node(high, bits - 1))
            };
            match (low, high) {
                (Some(low), Some(high)) => Some(triangle(&[low.view(), high.view()])),
                (side, None) | (None, side) => side,
            }
        }
    }
}
