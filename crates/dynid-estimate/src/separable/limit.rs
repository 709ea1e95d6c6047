//! What simpler model a shape parameter at its bound stands for.

/// An end of a shape parameter's range.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bound {
    /// The lower bound.
    Lower,
    /// The upper bound.
    Upper,
}

/// The limit model of a friction shape, by the symbol after the last dot of the parameter's name (`joint.fb`).
///
/// `fb`: slope of an arctangent; `w`: width of a hyperbolic tangent; `vs`: Stribeck speed; `phi2`, `alpha`: slope of a
/// sigmoid; `p`: exponent of a power law. `None` for other symbols and for bounds without a simpler model.
pub fn limit_model(name: &str, bound: Bound) -> Option<&'static str> {
    let symbol = name.rsplit('.').next()?;
    match (symbol, bound) {
        ("fb" | "phi2" | "alpha", Bound::Upper) | ("w", Bound::Lower) => Some("Coulomb friction"),
        ("fb" | "phi2" | "alpha", Bound::Lower) | ("w", Bound::Upper) => Some("viscous friction"),
        ("vs", Bound::Lower) => Some("Coulomb friction without a Stribeck peak in the sampled speeds"),
        ("vs", Bound::Upper) => Some("Coulomb friction with a peak wider than the sampled speeds"),
        ("p", Bound::Lower) => Some("nearly Coulomb friction"),
        _ => None,
    }
}
