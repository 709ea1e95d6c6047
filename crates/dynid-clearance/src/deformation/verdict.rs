//! What a deformation tells of a compliance.

/// Loads of a fit over those of the efforts: outside, its deformation rows have pulled the load away.
const SLOPES: (f64, f64) = (0.7, 1.4);
/// Standard deviations that a compliance must have to be told, and to be told well.
const TOLD: f64 = 3.0;
const TOLD_WELL: f64 = 10.0;
/// Share of the load's variance that zero, lag and hysteresis must leave.
const OWN_SHARE: f64 = 0.05;

/// What is known of the compliance of one joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Evidence<'a> {
    /// `c`, rad/(N m).
    pub compliance: f64,
    /// `c` with errors once per turn beside it.
    pub once_per_turn: Option<f64>,
    /// Total standard deviation of `c`.
    pub std_total: f64,
    /// Standard deviation of `c` from the residuals alone, which white sensor noise bounds from below.
    pub std: f64,
    /// Load of this fit, N m.
    pub load: &'a [f64],
    /// Load of the motors' efforts alone, N m.
    pub load_of_efforts: &'a [f64],
    /// Standard deviation of the load of this fit after projection on the other columns, N m.
    pub load_alone: f64,
    /// Standard deviation of the noise of the raw deformation, rad.
    pub noise: f64,
    /// Raw samples.
    pub samples: usize,
}

/// What a log tells of the compliance of a joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Verdict {
    /// The load of the fit is not that of the motors' efforts: the deformation row has pulled it away.
    OtherLoad {
        /// Slope of the fit's load on that of the efforts; 1 where both agree.
        slope: f64,
    },
    /// The load does not change, so that nothing could deform.
    NoLoad,
    /// The spread is below what the sensors' noise allows.
    BelowNoise {
        /// Least standard deviation that the noise allows, rad/(N m).
        least: f64,
    },
    /// Zero, lag or hysteresis stand in for the load.
    Shared {
        /// Share of the load's variance that they leave.
        share: f64,
    },
    /// The compliance is not positive, or errors once per turn change its sign.
    Sign,
    /// The compliance is below three standard deviations.
    NotTold,
    /// Three to ten standard deviations.
    Coarse,
    /// Ten standard deviations or more.
    Told,
}

impl Verdict {
    /// Whether there is a stiffness to be used.
    pub fn is_told(self) -> bool {
        matches!(self, Verdict::Coarse | Verdict::Told)
    }

    /// Whether the estimate is no measurement at all.
    pub fn is_degenerate(self) -> bool {
        matches!(self, Verdict::OtherLoad { .. } | Verdict::NoLoad | Verdict::BelowNoise { .. })
    }
}

/// Verdict on the compliance of a joint, the first that applies.
pub fn judge(of: &Evidence<'_>) -> Verdict {
    let (own, shared) = moments(of.load, of.load_of_efforts);
    if shared.is_none() || of.load_alone <= 0.0 && own <= 0.0 {
        return Verdict::NoLoad;
    }
    let slope = shared.unwrap_or(0.0);
    if !(SLOPES.0..=SLOPES.1).contains(&slope) {
        return Verdict::OtherLoad { slope };
    }
    let share = of.load_alone.powi(2) / own;
    // Rounding leaves a constant load a share of nothing.
    if own.sqrt() <= 1e-9 * largest(of.load) {
        return Verdict::NoLoad;
    }
    let least = of.noise / (of.load_alone * (of.samples as f64).sqrt());
    if of.std < least {
        return Verdict::BelowNoise { least };
    }
    if share < OWN_SHARE {
        return Verdict::Shared { share };
    }
    if of.compliance <= 0.0 || of.once_per_turn.is_some_and(|c| c <= 0.0) {
        return Verdict::Sign;
    }
    match of.compliance / of.std_total {
        x if x >= TOLD_WELL => Verdict::Told,
        x if x >= TOLD => Verdict::Coarse,
        _ => Verdict::NotTold,
    }
}

fn largest(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |m, v| m.max(v.abs()))
}

/// Variance of `x`, and slope of `x` on `y`; none where `y` is constant.
fn moments(x: &[f64], y: &[f64]) -> (f64, Option<f64>) {
    let n = x.len().max(1) as f64;
    let mean = |v: &[f64]| v.iter().sum::<f64>() / n;
    let (mx, my) = (mean(x), mean(y));
    let own = x.iter().map(|v| (v - mx).powi(2)).sum::<f64>() / n;
    let of_y = y.iter().map(|v| (v - my).powi(2)).sum::<f64>() / n;
    let both = x.iter().zip(y).map(|(a, b)| (a - mx) * (b - my)).sum::<f64>() / n;
    (own, (of_y.sqrt() > 1e-9 * largest(y)).then(|| both / of_y))
}
