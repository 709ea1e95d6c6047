//! Stored energy and its counterpart, the penetration under a load.

use super::FractalLankaraniNikravesh;

/// Positive nodes and weights of Gauss-Legendre quadrature with 16 points.
const GAUSS: [(f64, f64); 8] = [
    (0.095_012_509_837_637_44, 0.189_450_610_455_068_5),
    (0.281_603_550_779_258_9, 0.182_603_415_044_923_58),
    (0.458_016_777_657_227_37, 0.169_156_519_395_002_54),
    (0.617_876_244_402_643_7, 0.149_595_988_816_576_73),
    (0.755_404_408_355_003, 0.124_628_971_255_533_88),
    (0.865_631_202_387_831_8, 0.095_158_511_682_492_79),
    (0.944_575_023_073_232_6, 0.062_253_523_938_647_894),
    (0.989_400_934_991_649_9, 0.027_152_459_411_754_096),
];

/// Range in `ln δ` over which the energy is summed: below it lies less than `e^(-2·20)` of it, as the force grows at least
/// as fast as `δ`.
const REACH: f64 = 20.0;

/// Largest panel in `ln δ`; 16 points are then exact to rounding.
const PANEL: f64 = 2.0;

impl FractalLankaraniNikravesh {
    /// `∫ K_m δ^n dδ = ∫ K_m δ^(n+1) d ln δ`: over the logarithm the integrand is smooth between the limits of the stages.
    pub(in crate::law) fn stored_energy(&self, penetration: f64) -> f64 {
        let top = penetration.ln();
        let mut from = top - REACH;
        let mut energy = 0.0;
        for limit in self.curve.penetrations.into_iter().chain([penetration]) {
            let to = limit.ln().min(top);
            if to > from {
                let panels = ((to - from) / PANEL).ceil();
                let half = 0.5 * (to - from) / panels;
                for k in 0..panels as usize {
                    energy += half * self.panel_energy(from + (2 * k + 1) as f64 * half, half);
                }
                from = to;
            }
        }
        energy
    }

    fn panel_energy(&self, middle: f64, half: f64) -> f64 {
        let density = |log: f64| {
            let depth = log.exp();
            self.elastic(depth) * depth
        };
        GAUSS.iter().map(|(x, w)| w * (density(middle - half * x) + density(middle + half * x))).sum()
    }

    fn elastic(&self, penetration: f64) -> f64 {
        self.curve.stiffness(self.curve.spot(penetration)).value * self.power(penetration).0
    }

    /// Newton's method on logarithms, in which the force is nearly a straight line, kept inside a bracket.
    pub(in crate::law) fn static_penetration(&self, load: f64) -> f64 {
        let mut low = self.curve.penetrations[0];
        let mut high = self.bearing.clearance().max(2.0 * low);
        while self.elastic(high) < load {
            low = high;
            high *= 2.0;
        }
        let mut depth = high;
        for _ in 0..200 {
            let force = self.at(depth, f64::INFINITY);
            if force.elastic < load {
                low = depth;
            } else {
                high = depth;
            }
            let step = (load / force.elastic).ln() * force.elastic / (force.elastic_slope * depth);
            let mut next = depth * step.exp();
            if !(next >= low && next <= high) {
                next = 0.5 * (low + high);
            }
            let moved = (next - depth).abs();
            depth = next;
            if moved <= 2.0 * f64::EPSILON * depth {
                break;
            }
        }
        depth
    }
}
