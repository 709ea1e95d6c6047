//! Roughness of a surface and its fractal dimension.

/// Dimension of a roughness in µm.
pub(super) fn dimension(roughness_um: f64) -> f64 {
    1.54 * roughness_um.powf(-0.045) + 1.0
}

/// Roughness in µm of a dimension.
pub(super) fn roughness_of_dimension(dimension: f64) -> f64 {
    (1.54 / (dimension - 1.0)).powf(1.0 / 0.045)
}
