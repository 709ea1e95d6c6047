//! Rough surfaces as fractals: the constants of a contact and its single asperities.

use std::f64::consts::PI;

use crate::error::{ContactError, checked};
use crate::material::Material;
use crate::roughness::dimension;

/// The factor `K_p` of mean pressure of elastic-plastic asperities.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum PressureFactor {
    /// `0.454 + 0.41 ν` of the softer body (Kogut & Etsion), which keeps the load of an asperity continuous within a few per
    /// cent.
    #[default]
    Poisson,
    /// `K_p = K_H`, as the source literally reads (`literal_k`): the load jumps about fivefold at the critical area.
    HardnessRatio,
    /// A given number above 0.
    Given(f64),
}

/// What a [`FractalSurface`] is made from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceSettings {
    /// Roughness `Ra`, µm, in (0.0030, 14700).
    pub roughness_um: f64,
    /// Sliding friction coefficient `μ`, in [0, 0.9].
    pub friction: f64,
    /// The body that yields first.
    pub softer: Material,
    /// The harder body.
    pub harder: Material,
    /// Yield strength `σ_y` of the softer body, Pa, above 0.
    pub yield_strength: f64,
    /// `K_H` in `H = K_H σ_y`, above 0.
    pub hardness_ratio: f64,
    /// `K_p`.
    pub pressure_factor: PressureFactor,
    /// Profile constant `γ`, above 1.
    pub profile_constant: f64,
}

impl Default for SurfaceSettings {
    /// Steel on steel of 355 MPa: `Ra = 0.8` µm, `μ = 0.1`, `K_H = 2.8`, `K_p` of Poisson's ratio, `γ = 1.5`.
    fn default() -> Self {
        SurfaceSettings {
            roughness_um: 0.8,
            friction: 0.1,
            softer: Material::STEEL,
            harder: Material::STEEL,
            yield_strength: 355e6,
            hardness_ratio: 2.8,
            pressure_factor: PressureFactor::Poisson,
            profile_constant: 1.5,
        }
    }
}

/// Everything that follows from [`SurfaceSettings`], in SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct SurfaceConstants {
    /// `D = 1.54 Ra^-0.045 + 1`, `Ra` in µm.
    pub dimension: f64,
    /// `G = 10^(-5.26/Ra^0.045)` mm, here in m.
    pub fractal_roughness: f64,
    /// `φ > 1` with `φ^((3-D)/2) - (1 + φ^(-(D-1)/2))^((D-3)/(D-1)) = (3-D)/(D-1)`.
    pub domain_extension: f64,
    /// `k_μ = 1 - 0.228 μ` up to `μ = 0.3`, `0.932 exp(-1.58 (μ - 0.3))` beyond.
    pub friction_factor: f64,
    /// `E*`, Pa.
    pub combined_modulus: f64,
    /// `H = K_H σ_y`, Pa.
    pub hardness: f64,
    /// `K_p`.
    pub pressure_factor: f64,
    /// `ϕ = σ_y/E*`.
    pub yield_ratio: f64,
    /// Area `a_c = [2^(3D-11) (33 k_μ ϕ/40)² π^(4-D)/ln γ]^(1/(2-D)) G²` above which an asperity is elastic, m².
    pub critical_area: f64,
    /// Area `a_1 = 6^(1/(2-D)) a_c` between the elastic-plastic stages, m².
    pub first_limit: f64,
    /// Area `a_2 = 110^(1/(2-D)) a_c` below which an asperity is plastic, m².
    pub second_limit: f64,
    /// `m = (3-D)/(D-1) φ^(-(3-D)/2)`: share of the largest spot in the real area, `a_l = m A_r`.
    pub largest_share: f64,
    /// `h1` of the stiffness, negative.
    pub h1: f64,
    /// `h2` of the stiffness.
    pub h2: f64,
    /// `h3` of the stiffness.
    pub h3: f64,
    /// `h4` of the stiffness.
    pub h4: f64,
}

/// A rough contact as a fractal, with its constants at hand.
///
/// An asperity on the truncated area `a` has the interference
/// `ω(a) = 2^(4-D) G^(D-2) √(ln γ) π^((D-3)/2) a^((3-D)/2)` and the radius `R(a) = a/(2πω)`; small ones are the plastic ones.
///
/// Source: Sun et al. 2021 with Majumdar & Bhushan and Kogut & Etsion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FractalSurface {
    settings: SurfaceSettings,
    constants: SurfaceConstants,
}

/// How an asperity deforms.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AsperityStage {
    /// `a > a_c`.
    Elastic,
    /// `a_1 < a <= a_c`.
    FirstElastoplastic,
    /// `a_2 <= a <= a_1`.
    SecondElastoplastic,
    /// `a < a_2`.
    Plastic,
}

/// One asperity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Asperity {
    /// Stage of the asperity.
    pub stage: AsperityStage,
    /// Interference `ω`, m.
    pub interference: f64,
    /// Radius of curvature `R`, m.
    pub radius: f64,
    /// Interference `ω_c = (33 π k_μ ϕ/40)² R` at which it begins to yield, m.
    pub critical_interference: f64,
    /// Load `P`, N.
    pub load: f64,
    /// `dP/dω` along the fractal family, N/m; 0 for a plastic asperity, which the stiffness of the contact leaves out.
    pub stiffness: f64,
    /// Work `∫ P dω` at constant radius, J.
    pub work: f64,
}

/// Root of the equation of `φ`, divided by `3 - D` so that it keeps its digits where both sides vanish.
fn domain_extension(d: f64) -> f64 {
    let e = 3.0 - d;
    let excess = |phi: f64| {
        let grown = (0.5 * e * phi.ln()).exp_m1();
        let shrunk = (-e / (d - 1.0) * phi.powf(-0.5 * (d - 1.0)).ln_1p()).exp_m1();
        (grown - shrunk) / e - 1.0 / (d - 1.0)
    };
    let (mut low, mut high) = (1.0, 4.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if excess(middle) < 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

impl FractalSurface {
    /// Fails if a number is outside the range that [`SurfaceSettings`] gives for it, and if `D` lies so close to 2 that the
    /// critical area is no number.
    pub fn new(settings: SurfaceSettings) -> Result<Self, ContactError> {
        let s = &settings;
        let ra = checked("roughness_um", "Ra above 0 µm", s.roughness_um, s.roughness_um > 0.0)?;
        let d = dimension(ra);
        if !(d > 2.0 && d < 3.0) {
            return Err(ContactError::FractalDimension { roughness_um: ra, dimension: d });
        }
        let mu = checked("friction", "in [0, 0.9]", s.friction, (0.0..=0.9).contains(&s.friction))?;
        let sigma = checked("yield_strength", "above 0 Pa", s.yield_strength, s.yield_strength > 0.0)?;
        let k_h = checked("hardness_ratio", "above 0", s.hardness_ratio, s.hardness_ratio > 0.0)?;
        let gamma = checked("profile_constant", "above 1", s.profile_constant, s.profile_constant > 1.0)?;
        let k_p = match s.pressure_factor {
            PressureFactor::Poisson => 0.454 + 0.41 * s.softer.poisson_ratio,
            PressureFactor::HardnessRatio => k_h,
            PressureFactor::Given(value) => value,
        };
        let e_star = s.softer.combined_modulus(&s.harder)?;
        checked("pressure_factor", "above 0", k_p, k_p > 0.0)?;
        let g = 1e-3 * 10f64.powf(-5.26 / ra.powf(0.045));
        let k_mu = if mu <= 0.3 { 1.0 - 0.228 * mu } else { 0.932 * (-1.58 * (mu - 0.3)).exp() };
        let (ln_gamma, hardness, yield_ratio) = (gamma.ln(), k_h * sigma, sigma / e_star);
        let yielding = 33.0 * k_mu * yield_ratio / 40.0;
        let base = 2f64.powf(3.0 * d - 11.0) * yielding * yielding * PI.powf(4.0 - d) / ln_gamma;
        let critical_area = base.powf(1.0 / (2.0 - d)) * g * g;
        let phi = domain_extension(d);
        let spread = phi.powf(0.5 * (3.0 - d));
        let below = (d - 2.0) * (d - 3.0);
        let h1 = 2.0 * 2f64.sqrt() * (4.0 - d) * (d - 1.0) / (3.0 * PI.sqrt() * (3.0 - d) * (2.0 - d))
            * e_star
            * spread;
        let h2 = 1.38e-2 * (d - 1.0) * (17.0 * d - 74.0) / below
            * 2f64.powf(0.15 * d + 0.8)
            * g.powf(0.3 - 0.15 * d)
            * (spread * hardness * k_p)
            * (e_star / (k_mu * sigma)).powf(0.85)
            * critical_area.powf(0.85 - 0.425 * d)
            / (PI.powf(0.075 * d + 0.2) * ln_gamma.powf(0.075));
        let h3 = 3.29e-4 * (d - 1.0) * (263.0 * d - 1526.0) / below * (110f64.powf(0.263) - 6f64.powf(0.263));
        let h4 = 2f64.powf(0.474 * d + 0.945)
            * g.powf(0.948 - 0.474 * d)
            * (spread * hardness * k_p)
            * (e_star / (k_mu * sigma)).powf(0.526)
            * critical_area.powf(0.526 - 0.263 * d)
            / (PI.powf(0.237 * d - 0.448) * ln_gamma.powf(0.237));
        let constants = SurfaceConstants {
            dimension: d,
            fractal_roughness: g,
            domain_extension: phi,
            friction_factor: k_mu,
            combined_modulus: e_star,
            hardness,
            pressure_factor: k_p,
            yield_ratio,
            critical_area,
            first_limit: 6f64.powf(1.0 / (2.0 - d)) * critical_area,
            second_limit: 110f64.powf(1.0 / (2.0 - d)) * critical_area,
            largest_share: (3.0 - d) / ((d - 1.0) * spread),
            h1,
            h2,
            h3,
            h4,
        };
        constants.check()?;
        Ok(FractalSurface { settings, constants })
    }

    /// What it was made from.
    pub fn settings(&self) -> &SurfaceSettings {
        &self.settings
    }

    /// Constants of the surface.
    pub fn constants(&self) -> &SurfaceConstants {
        &self.constants
    }

    /// Density of spots of area `a`, `n(a) = (D-1)/2 φ^((3-D)/2) a_l^((D-1)/2) a^(-(D+1)/2)`, 1/m², for `0 < a <= a_l`.
    pub fn spot_density(&self, area: f64, largest: f64) -> f64 {
        let SurfaceConstants { dimension: d, domain_extension: phi, .. } = self.constants;
        0.5 * (d - 1.0) * phi.powf(0.5 * (3.0 - d)) * (largest / area).powf(0.5 * (d - 1.0)) / area
    }

    /// The stage of an asperity of the given area, m².
    pub fn stage(&self, area: f64) -> AsperityStage {
        if area > self.constants.critical_area {
            AsperityStage::Elastic
        } else if area > self.constants.first_limit {
            AsperityStage::FirstElastoplastic
        } else if area >= self.constants.second_limit {
            AsperityStage::SecondElastoplastic
        } else {
            AsperityStage::Plastic
        }
    }

    /// An asperity of the given area, m² (above 0), as the stiffness of the contact sums them: the area is the truncated one.
    pub fn asperity(&self, area: f64) -> Asperity {
        self.asperity_on(self.stage(area), area)
    }

    /// An asperity whose area is the real one, half the truncated one, as the work of the contact sums them: at `a_c` its
    /// interference is the critical one.
    pub fn asperity_of_real_area(&self, area: f64) -> Asperity {
        self.asperity_on(self.stage(area), 2.0 * area)
    }

    fn asperity_on(&self, stage: AsperityStage, truncated: f64) -> Asperity {
        let c = &self.constants;
        let d = c.dimension;
        let omega = 2f64.powf(4.0 - d)
            * c.fractal_roughness.powf(d - 2.0)
            * self.settings.profile_constant.ln().sqrt()
            * PI.powf(0.5 * (d - 3.0))
            * truncated.powf(0.5 * (3.0 - d));
        let radius = truncated / (2.0 * PI * omega);
        let critical = (33.0 * PI * c.friction_factor * c.yield_ratio / 40.0).powi(2) * radius;
        let yielding = c.pressure_factor * c.hardness * PI * radius * omega / 3.0;
        let (load, exponent, slope) = match stage {
            AsperityStage::Elastic => {
                let load = 4.0 / 3.0 * c.combined_modulus * radius.sqrt() * omega.powf(1.5);
                (load, 1.5, (4.0 - d) / (3.0 - d))
            }
            AsperityStage::FirstElastoplastic => {
                let load = 2.06 * yielding * (omega / critical).powf(0.425);
                (load, 1.425, (74.0 - 17.0 * d) / (20.0 * (3.0 - d)))
            }
            AsperityStage::SecondElastoplastic => {
                let load = 2.8 * yielding * (omega / critical).powf(0.263);
                (load, 1.263, (1526.0 - 263.0 * d) / (500.0 * (3.0 - d)))
            }
            AsperityStage::Plastic => (2.0 * PI * omega * radius * c.hardness, 1.0, 0.0),
        };
        Asperity {
            stage,
            interference: omega,
            radius,
            critical_interference: critical,
            load,
            stiffness: load / omega * slope,
            work: load * omega / (exponent + 1.0),
        }
    }
}

impl SurfaceConstants {
    fn check(&self) -> Result<(), ContactError> {
        let all = [
            ("critical area a_c", self.critical_area),
            ("stage limit a_2", self.second_limit),
            ("fractal roughness G", self.fractal_roughness),
            ("stiffness constant -h1", -self.h1),
            ("stiffness constant h2", self.h2),
            ("stiffness constant h4", self.h4),
        ];
        match all.into_iter().find(|(_, value)| !(value.is_normal() && *value > 0.0)) {
            Some((constant, found)) => {
                Err(ContactError::SurfaceConstant { constant, found, dimension: self.dimension })
            }
            None => Ok(()),
        }
    }
}
