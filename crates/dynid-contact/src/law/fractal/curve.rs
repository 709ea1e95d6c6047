//! Stiffness and work of the asperities as functions of the largest spot.
//!
//! With `x = a_l/a_c = e^u`, each is a constant times powers of `x`, written so that the differences next to the limits of
//! the stages, and the logarithms into which some powers turn, keep all their digits.

use super::{Curved, FractalSettings};
use crate::bearing::JournalBearing;
use crate::error::ContactError;
use crate::surface::FractalSurface;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SpotCurve {
    clearance: f64,
    /// `u` at unlimited penetration.
    widest: f64,
    /// `u` at `a_1`.
    pub(super) first: f64,
    /// `u` at `a_2`.
    pub(super) second: f64,
    /// Penetrations at `a_2`, `a_1`, `a_c`.
    pub(super) penetrations: [f64; 3],
    /// `(D - 1)/2`.
    rank: f64,
    /// `(2 - D)/2`, `0.425 (2 - D)`, `0.263 (2 - D)`.
    powers: [f64; 3],
    /// Elastic, first and second stage of the stiffness, as factors of `expm1`.
    stiffness: [f64; 3],
    /// Whole second stage, and that with the whole first one.
    whole: [f64; 2],
    /// Work integrals from plastic to elastic.
    work: [WorkStage; 4],
    /// Work of the finished stages: plastic, and with the second elastic-plastic one; first elastic-plastic.
    plastic: f64,
    both_plastic: f64,
    first_elastic: f64,
    /// `(D-1)/2 φ^((3-D)/2) a_c^((D-1)/2)`: turns the integrals into work.
    density: f64,
    limit: f64,
}

/// `∫ w a^(-(D+1)/2) da` in a stage: `factor · (x^q - x_0^q)/q` from its lower end.
#[derive(Debug, Clone, Copy, PartialEq)]
struct WorkStage {
    factor: f64,
    q: f64,
}

impl WorkStage {
    /// Over the length `length` in `u` above the lower end, where `factor` holds.
    fn up_to(&self, length: f64) -> f64 {
        let span = if self.q == 0.0 { length } else { (self.q * length).exp_m1() / self.q };
        self.factor * span
    }
}

impl SpotCurve {
    pub(super) fn new(
        surface: &FractalSurface,
        bearing: &JournalBearing,
        settings: &FractalSettings,
    ) -> Result<Self, ContactError> {
        let c = surface.constants();
        let (d, a_c) = (c.dimension, c.critical_area);
        let largest = c.largest_share * bearing.real_area(f64::MAX, settings.area_ratio);
        let (first, second) = (6f64.ln() / (2.0 - d), 110f64.ln() / (2.0 - d));
        let widest = (largest / a_c).ln();
        let clearance = bearing.clearance();
        let penetration = |u: f64| {
            let reached = (2.0 * (u - widest)).exp();
            if reached < 1.0 { clearance * reached / (1.0 - reached) } else { f64::INFINITY }
        };
        if !penetration(second).is_finite() {
            return Err(ContactError::AllPlastic { largest, limit: c.second_limit });
        }
        let rank = 0.5 * (d - 1.0);
        let scale = a_c.powf(rank);
        let (h2, h34) = (c.h2 * scale, c.h3 * c.h4 * scale);
        let (six, six_low, hundred) = (6f64.powf(0.425), 6f64.powf(0.263), 110f64.powf(0.263));
        let work = work_stages(surface, first, second);
        let plastic = work[0].factor / work[0].q;
        let both_plastic = plastic + work[1].up_to(first - second);
        Ok(SpotCurve {
            clearance,
            widest,
            first,
            second,
            penetrations: [penetration(second), penetration(first), penetration(0.0)],
            rank,
            powers: [0.5 * (2.0 - d), 0.425 * (2.0 - d), 0.263 * (2.0 - d)],
            stiffness: [c.h1 * a_c.sqrt(), h2 * six / (1.0 - six), h34 * hundred / (six_low - hundred)],
            whole: [h34, h34 + h2],
            work,
            plastic,
            both_plastic,
            first_elastic: work[2].up_to(-first),
            density: rank * c.domain_extension.powf(0.5 * (3.0 - d)) * scale,
            limit: settings.work_ratio_limit,
        })
    }

    /// `u` at a penetration.
    pub(super) fn spot(&self, penetration: f64) -> f64 {
        let depth = penetration.max(0.0);
        self.widest + 0.5 * (depth / (self.clearance + depth)).ln()
    }

    /// `K_m`.
    pub(super) fn stiffness(&self, u: f64) -> Curved {
        let (stage, from, below) = if u > 0.0 {
            (0, 0.0, self.whole[1])
        } else if u > self.first {
            (1, self.first, self.whole[0])
        } else if u > self.second {
            (2, self.second, 0.0)
        } else {
            return Curved { value: 0.0, slope: 0.0 };
        };
        let (power, factor) = (self.powers[stage], self.stiffness[stage]);
        let grown = (power * (u - from)).exp_m1();
        let size = (self.rank * u).exp();
        let value = size * (below + factor * grown);
        Curved { value, slope: self.rank * value + size * (factor * power * (grown + 1.0)) }
    }

    /// `η`, whose slope is 0 at its limit.
    pub(super) fn work_ratio(&self, u: f64) -> Curved {
        let (stage, length, below) =
            if u > 0.0 { (self.work[3], u, self.first_elastic) } else { (self.work[2], u - self.first, 0.0) };
        let grown = stage.up_to(length);
        let elastic = below + grown;
        if elastic * self.limit <= self.both_plastic {
            return Curved { value: self.limit, slope: 0.0 };
        }
        let value = self.both_plastic / elastic;
        Curved { value, slope: -value * (stage.factor + stage.q * grown) / elastic }
    }

    /// `W_e` and `W_p`, J.
    pub(super) fn works(&self, u: f64) -> [f64; 2] {
        let elastic = if u > 0.0 {
            self.first_elastic + self.work[3].up_to(u)
        } else {
            self.work[2].up_to((u - self.first).max(0.0))
        };
        let plastic = if u > self.first {
            self.both_plastic
        } else if u > self.second {
            self.plastic + self.work[1].up_to(u - self.second)
        } else {
            self.plastic * (self.work[0].q * (u - self.second)).exp()
        };
        let size = self.density * (self.rank * u).exp();
        [size * elastic, size * plastic]
    }
}

/// The work of the asperities at the lower end of each stage (of the plastic one, which begins at area 0, at its upper end)
/// and its exponents `q`.
fn work_stages(surface: &FractalSurface, first: f64, second: f64) -> [WorkStage; 4] {
    let c = surface.constants();
    let (d, a_c) = (c.dimension, c.critical_area);
    let omega_c = surface.asperity_of_real_area(a_c).interference;
    let at = |coefficient: f64, q: f64, u: f64| WorkStage {
        factor: coefficient * a_c.powf(0.5 * (3.0 - d)) * (q * u).exp(),
        q,
    };
    let yielding = c.pressure_factor * c.hardness * omega_c;
    let elastic = 8.0 / 15.0 * c.combined_modulus * omega_c * omega_c / (std::f64::consts::PI * a_c).sqrt();
    [
        at(c.hardness * omega_c, 3.0 - d, second),
        at(2.8 / 3.0 / 2.263 * yielding, 3.526 - 1.263 * d, second),
        at(2.06 / 3.0 / 2.425 * yielding, 3.85 - 1.425 * d, first),
        at(elastic, 4.0 - 1.5 * d, 0.0),
    ]
}
