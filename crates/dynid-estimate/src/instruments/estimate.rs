//! Instrumental-variable estimate from paired rows.

use crate::least_squares::{floors, merge_weighted};
use crate::linear::{GroupFit, LinearError, LinearEstimate, LinearMethod, LinearSettings, assemble};
use crate::oblique::Oblique;
use dynid_factor::Factor;
use dynid_factor::groups::ReducedGroup;

/// Settings of [`instrumental`].
#[derive(Debug, Clone, PartialEq)]
pub struct InstrumentSettings {
    /// Iteration of the variances, and which groups share one; settings of robust losses are not used.
    pub linear: LinearSettings,
    /// Strength below which instruments are called weak. Default 0.1.
    pub weak: f64,
}

impl Default for InstrumentSettings {
    fn default() -> Self {
        InstrumentSettings { linear: LinearSettings::default(), weak: 0.1 }
    }
}

/// Whether instruments see the regressor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Strength {
    /// Every combination of parameters.
    Strong,
    /// Some combination hardly: the estimate leans on few digits, and its variance understates.
    Weak,
    /// Some columns that the log excites not at all; they are dropped.
    Blind,
}

/// Estimate from instruments.
#[derive(Debug, Clone, PartialEq)]
pub struct InstrumentalEstimate {
    /// The estimate, as any other linear one. Its rows are `[Z A | Z A x + y - W x]` with `A = Z⁺W`: ordinary least squares on
    /// them gives the solution of `Zᵀ(W x - y) = 0`, its covariance `(ZᵀW)⁻¹ZᵀZ(WᵀZ)⁻¹`, its scores and its residuals back.
    pub linear: LinearEstimate,
    /// Smallest singular value of `Q_ZᵀQ_W` over the kept columns, 0 to 1.
    pub least_cosine: f64,
    /// Judged by [`InstrumentSettings::weak`].
    pub strength: Strength,
}

/// Solves `Zᵀ(W x - y) = 0` by QR of `Z`: `QᵀW x = Qᵀy`.
///
/// `paired`: factors of `[Z | W | y]` of all groups and time blocks, for `total` base columns. Rows of a group are divided by the
/// standard deviation `σ_j` of its residual, renewed in every pass as `σ_j² = rss_j/(N_j - ℓ_j)` with the leverage
/// `ℓ_j = tr W_j(ZᵀW)⁻¹Z_jᵀ/σ_j²`; with `Z = W` all passes are those of [`crate::linear::wls`]. Covariance for independent residuals
/// `(ZᵀW)⁻¹ZᵀZ(WᵀZ)⁻¹` of the weighted rows; [`LinearEstimate::jackknife`] solves again without each block.
///
/// Columns that the log or the instruments leave out are dropped and zero.
///
/// # Errors
/// [`LinearError::NoGroups`].
///
/// # Panics
/// If a group has an odd number of columns or one beyond `2 total`.
pub fn instrumental(
    paired: &[ReducedGroup],
    total: usize,
    settings: &InstrumentSettings,
) -> Result<InstrumentalEstimate, LinearError> {
    if paired.is_empty() {
        return Err(LinearError::NoGroups);
    }
    let factors: Vec<Factor> = paired.iter().map(|g| g.merged(2 * total)).collect();
    let classes = settings.linear.sharing.classes(paired);
    let wls = &settings.linear.wls;
    let mut variances = vec![1.0; factors.len()];
    let mut passes = 0;
    let (oblique, x, converged) = loop {
        let (oblique, x) = solved(&merge_weighted(&factors, &variances), total);
        let found = spread(&factors, &classes, &variances, &oblique, &x, wls.floor);
        passes += 1;
        let changed = found.iter().zip(&variances).map(|(g, v)| (g.variance - v).abs() / g.variance);
        let converged = changed.fold(0.0, f64::max) <= wls.tolerance;
        variances = found.iter().map(|g| g.variance).collect();
        if converged || passes >= wls.max_passes {
            let (oblique, x) = solved(&merge_weighted(&factors, &variances), total);
            break (oblique, x, converged);
        }
    };
    let groups = spread(&factors, &classes, &variances, &oblique, &x, wls.floor);
    let fits: Vec<GroupFit> = groups
        .into_iter()
        .zip(paired)
        .zip(&variances)
        .map(|((found, group), variance)| found.of(group, *variance))
        .collect();
    let (a, b) = oblique.fitted_rows(total, &x);
    let reduced = paired.iter().map(|group| fitted(group, total, &a, &b)).collect();
    let mut linear = assemble(LinearMethod::Instrumental, x, &oblique.kept, fits, reduced);
    (linear.passes, linear.converged, linear.paired) = (passes, converged, paired.to_vec());
    let strength = match oblique.strength {
        _ if oblique.kept.len() < oblique.excited => Strength::Blind,
        s if s < settings.weak => Strength::Weak,
        _ => Strength::Strong,
    };
    Ok(InstrumentalEstimate { linear, least_cosine: oblique.strength, strength })
}

fn solved(merged: &Factor, total: usize) -> (Oblique, Vec<f64>) {
    let oblique = Oblique::new(merged);
    let mut x = vec![0.0; total];
    for (c, value) in oblique.kept.iter().zip(oblique.solution().x) {
        x[*c] = value;
    }
    (oblique, x)
}

/// Rows of one paired group as least squares on them would see the instruments' estimate.
fn fitted(group: &ReducedGroup, total: usize, a: &dynid_linalg::Mat, b: &[f64]) -> ReducedGroup {
    let blocks = group.blocks.iter().map(|block| block.embed(2 * total, &group.columns).combined(a, b));
    ReducedGroup { columns: (0..total).collect(), blocks: blocks.collect(), ..*group }
}

/// What the residuals of a group say.
struct Found {
    variance: f64,
    leverage: f64,
    rss: f64,
    at_floor: bool,
    rows: usize,
}

impl Found {
    /// With the variance that the rows were weighted by.
    fn of(self, group: &ReducedGroup, variance: f64) -> GroupFit {
        GroupFit {
            log: group.log,
            output: group.output,
            scale: group.scale,
            variance,
            weight: 1.0 / variance.sqrt(),
            leverage: self.leverage,
            rss: self.rss,
            rows: self.rows,
            at_floor: self.at_floor,
            down_weighted: 0.0,
            rejected: 0.0,
            curvature: 1.0,
        }
    }
}

fn spread(
    factors: &[Factor],
    classes: &[usize],
    variances: &[f64],
    oblique: &Oblique,
    x: &[f64],
    floor: f64,
) -> Vec<Found> {
    let both: Vec<f64> = vec![0.0; x.len()].into_iter().chain(x.iter().copied()).collect();
    let own: Vec<(f64, f64)> = factors
        .iter()
        .zip(variances)
        .map(|(factor, variance)| (oblique.leverage(factor) / variance, factor.rss(&both)))
        .collect();
    let least = floors(factors, classes, floor);
    (0..factors.len())
        .map(|g| {
            let of_class = || (0..factors.len()).filter(|k| classes[*k] == classes[g]);
            let rss: f64 = of_class().map(|k| own[k].1).sum();
            let freedom: f64 = of_class().map(|k| factors[k].rows() as f64 - own[k].0).sum();
            let estimate = if freedom >= 0.5 { rss / freedom } else { variances[g] };
            Found {
                variance: estimate.max(least[g]),
                leverage: own[g].0,
                rss: own[g].1,
                at_floor: freedom < 0.5 || estimate <= least[g],
                rows: factors[g].rows(),
            }
        })
        .collect()
}
