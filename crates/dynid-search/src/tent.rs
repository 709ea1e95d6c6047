//! The chaotic tent map.

/// `c_{n+1} = 2γ c_n` for `c_n ≤ 1/2` and `2γ (1 - c_n)` otherwise.
///
/// For `1/2 < γ < 1` the sequence ends up in `[2γ(1 - γ), γ]`, so it is not uniform on (0, 1): with the usual `γ = 0.6` it
/// stays within 0.48 and 0.60. Source: equation 7 of the paper on the ER-16.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TentMap {
    /// `γ`, in (0, 1).
    pub slope: f64,
    /// The present number `c_n`, in (0, 1).
    pub value: f64,
}

impl TentMap {
    /// Goes on to the next number and returns it.
    pub fn advance(&mut self) -> f64 {
        let c = self.value;
        self.value = 2.0 * self.slope * if c <= 0.5 { c } else { 1.0 - c };
        self.value
    }
}
