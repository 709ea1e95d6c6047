//! What all studies need to be held against independent implementations.

use dynid::model::{BodyPoint, Dynamics, Mechanism, MotionBlock, Vec3};
use serde::de::DeserializeOwned;

use crate::StudyError;

/// Order of a link's standard parameters in reference numbers, ours being `m, mx, my, mz, Ixx, Ixy, Ixz, Iyy, Iyz, Izz`.
pub(crate) const PARAMETER_ORDER: [usize; 10] = [4, 5, 6, 7, 8, 9, 1, 2, 3, 0];

/// Reference numbers of an embedded JSON file.
pub(crate) fn parse<T: DeserializeOwned>(file: &'static str, text: &str) -> Result<T, StudyError> {
    serde_json::from_str(text).map_err(|e| StudyError::Data { file, message: e.to_string() })
}

/// Largest error of the last frame's pose at one state: of its origin (m) and of the directions of its axes.
pub(crate) fn pose_error(
    mechanism: &Mechanism,
    state: &MotionBlock<'_>,
    rotation: &[[f64; 3]; 3],
    position: &[f64; 3],
) -> f64 {
    let body = mechanism.bodies().len().checked_sub(1);
    let at = |position: [f64; 3]| BodyPoint { body, position: Vec3(position) };
    let points = [at([0.0; 3]), at([1.0, 0.0, 0.0]), at([0.0, 1.0, 0.0]), at([0.0, 0.0, 1.0])];
    let mut out = [0.0; 12];
    Dynamics::new(mechanism).points(state, &points, 1, &mut out);
    let mut worst = 0.0_f64;
    for c in 0..3 {
        worst = worst.max((out[c] - position[c]).abs());
        for axis in 0..3 {
            let along = out[3 * (axis + 1) + c] - out[c];
            worst = worst.max((along - rotation[c][axis]).abs());
        }
    }
    worst
}
