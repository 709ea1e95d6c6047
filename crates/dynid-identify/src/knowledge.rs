//! What the logs of an identification tell of its parameters, and what rows of further motion would add.
//!
//! With the information `M = RᵀR` of the rows so far (weighted by `1/σ`, deflated by the inflation `κ` of coloured residuals) and the
//! prior `x ~ N(x0, C0)`, the base parameters `β = K x` have the covariance
//!
//! ```text
//! C_β = (M + M_further + (K C0 Kᵀ)⁻¹)⁻¹
//! ```
//!
//! and standard parameter `j` the variance `c_j C_β c_jᵀ + h_j` with `c_j` what base parameters tell of it and `h_j` what no motion shows.
//! Intervals that an identification reports come from time blocks, not from `M`. A forecast therefore scales the interval of today:
//! `w_j(after) = w_j(today) s_j(after)/s_j(today)`.

use std::collections::BTreeMap;

use dynid_estimate::identifiability::{Assessment, Identifiability, Verdict, VisibleSpace};
use dynid_factor::Factor;
use dynid_factor::groups::ReducedGroup;
use dynid_linalg::Mat;
use dynid_model::EffortModel;

use crate::advice;
use crate::identification::Identification;
use crate::shape;
use crate::trust::interval_quantile;

/// What the logs of an identification tell of its parameters.
#[derive(Debug, Clone)]
pub struct Knowledge {
    /// Standard parameters, in column order.
    pub parameters: Vec<KnownParameter>,
    /// Per output: how its rows count.
    pub rows: Vec<RowPrecision>,
    /// Time that the logs lack for as many independent blocks as intervals want, s.
    pub lacking_s: f64,
    /// Time between independent rows of a joint that moves, s: a quarter of the period of the widest kernel's cut-off.
    pub row_spacing_s: f64,
    space: VisibleSpace,
    information: Factor,
    today: Identifiability,
    /// Per output and kernel: what rows are multiplied by.
    weights: BTreeMap<(usize, usize), f64>,
    /// Half width of an interval in standard deviations.
    quantile: f64,
}

/// A standard parameter by what logs tell of it.
#[derive(Debug, Clone, PartialEq)]
pub struct KnownParameter {
    /// Name; of the change of a shape parameter that of the shape parameter.
    pub name: String,
    /// Unit.
    pub unit: &'static str,
    /// Value found; of a shape parameter the one about which the model is linear.
    pub value: f64,
    /// Half width of its 95 % interval; `None` unless it is seen in the data.
    pub half_width: Option<f64>,
    /// What the logs see of it where it acts only together with others, in words.
    pub combination: Option<String>,
    /// Whether it follows from others or was given: no log is asked for it.
    pub is_given: bool,
}

/// How rows of an output count.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RowPrecision {
    /// Standard deviation of an independent row of the widest kernel, inflation included, N m or N; `None` where nothing says it.
    pub deviation: Option<f64>,
    /// Whether no log has rows of this output, so that the deviation is taken to be as large a share of its efforts as that of the
    /// output with the largest share.
    pub is_assumed: bool,
    /// Whether the model explains the effort. If not, its rows tell nothing of any parameter.
    pub is_explained: bool,
}

impl Identification {
    /// What its logs tell of its parameters.
    pub fn knowledge(&self) -> Knowledge {
        let regrouping = advice::regrouping(&self.base);
        let space = VisibleSpace::new(&regrouping, &self.prior.std);
        let information = self.fitted.information(&self.explained);
        let today = space.assess(&information, 1.0);
        let inflation = self.fitted.row_inflation(&self.explained);
        let quantile = interval_quantile(&self.fitted);
        let mut sums: BTreeMap<(usize, usize), (f64, f64)> = BTreeMap::new();
        for group in self.fit().groups.iter().filter(|g| g.rows > 0) {
            let (rows, precision) = sums.entry((group.output, group.scale)).or_default();
            *rows += group.rows as f64;
            *precision += group.rows as f64 * group.weight.powi(2);
        }
        let mut weights: BTreeMap<(usize, usize), f64> = (sums.iter())
            .map(|(key, (rows, precision))| (*key, (precision / rows / inflation[key.0]).sqrt()))
            .collect();
        let scales_hz =
            self.conditioning.as_ref().map_or_else(|| vec![self.kernel_hz], |c| c.scales_hz.clone());
        let rows = self.row_precisions(&scales_hz, &mut weights);
        Knowledge {
            parameters: self.known_parameters(quantile),
            rows,
            lacking_s: self.lacking_s(),
            row_spacing_s: 0.25 / self.kernel_hz,
            space,
            information,
            today,
            weights,
            quantile,
        }
    }

    /// How rows of every output count; weights of kernels that no log has rows of are added. The variance of a row goes with the cut-off
    /// of its kernel.
    fn row_precisions(
        &self,
        scales_hz: &[f64],
        weights: &mut BTreeMap<(usize, usize), f64>,
    ) -> Vec<RowPrecision> {
        let deviation = |weights: &BTreeMap<(usize, usize), f64>, output: usize| {
            let of_scale =
                |(k, hz): (usize, &f64)| Some((scales_hz[0] / hz).sqrt() / weights.get(&(output, k))?);
            scales_hz.iter().enumerate().find_map(of_scale).filter(|d| d.is_finite())
        };
        let share = (0..self.explained.len())
            .filter(|j| self.explained[*j] && self.effort_sizes[*j] > 0.0)
            .filter_map(|j| Some(deviation(weights, j)? / self.effort_sizes[j]))
            .fold(0.0, f64::max);
        (self.explained.iter().enumerate())
            .map(|(output, is_explained)| {
                let found = deviation(weights, output);
                let assumed = || Some(share * self.effort_sizes[output]).filter(|d| *d > 0.0);
                let row = found.or_else(assumed);
                for (k, hz) in scales_hz.iter().enumerate() {
                    if let Some(row) = row {
                        weights.entry((output, k)).or_insert((scales_hz[0] / hz).sqrt() / row);
                    }
                }
                RowPrecision { deviation: row, is_assumed: found.is_none(), is_explained: *is_explained }
            })
            .collect()
    }

    fn known_parameters(&self, quantile: f64) -> Vec<KnownParameter> {
        let shapes = self.shapes.as_ref().map(|found| found.model.parameters());
        let table = &self.model.parameters().linear;
        (table.iter().zip(&self.trust.parameters).zip(self.values()))
            .map(|((p, trust), value)| {
                let changed = shape::of_change(&p.name);
                let about = changed.and_then(|name| shapes?.shape_value(name));
                KnownParameter {
                    name: changed.unwrap_or(&p.name).to_owned(),
                    unit: p.unit,
                    value: about.unwrap_or(*value),
                    half_width: trust.std.map(|s| quantile * s),
                    combination: trust.combination.clone(),
                    is_given: trust.tie.is_some() || trust.assessment.verdict == Verdict::Given,
                }
            })
            .collect()
    }
}

impl Knowledge {
    /// Information of the rows so far, one column per base parameter.
    pub fn information(&self) -> &Factor {
        &self.information
    }

    /// Information of the rows so far and the prior, as rows `R` with one column per base parameter: `RᵀR = M + (K C0 Kᵀ)⁻¹`.
    pub fn with_prior(&self) -> Mat {
        let (rows, prior) = (self.information.r_matrix(), self.space.prior_information());
        let mut stacked = Mat::zeros(rows.nrows() + prior.nrows(), prior.ncols());
        stacked.set_rows(0, &rows);
        stacked.set_rows(rows.nrows(), &prior);
        stacked
    }

    /// Information of further rows that were reduced by the same recipe, each kernel's rows of an output as the fit weighs them on the average.
    pub fn of_rows(&self, further: &[ReducedGroup]) -> Factor {
        let total = self.information.columns();
        let weighted = |group: &ReducedGroup| {
            let weight = self.weights.get(&(group.output, group.scale))?;
            Some(group.merged(total).scaled(*weight))
        };
        let parts: Vec<Factor> = further.iter().filter_map(weighted).collect();
        match parts.is_empty() {
            true => Factor::empty(total),
            false => Factor::merge(&parts.iter().collect::<Vec<_>>()),
        }
    }

    /// What would be known of all standard parameters with some information.
    pub fn assess(&self, information: &Factor) -> Vec<Assessment> {
        self.space.assess(information, 1.0).parameters
    }

    /// What is known of the standard parameters now.
    pub fn today(&self) -> &[Assessment] {
        &self.today.parameters
    }

    /// Half width of the 95 % interval of a standard parameter that an assessment promises; `None` if it would not be seen in the data.
    pub fn half_width(&self, parameter: usize, after: &Assessment) -> Option<f64> {
        (after.verdict == Verdict::Seen).then(|| self.width_of_deviation(parameter) * after.posterior_std)
    }

    /// Largest standard deviation, as [`Assessment::posterior_std`], with which a parameter is seen in the data and has a half width of at
    /// most `half_width`.
    pub fn deviation_for(&self, parameter: usize, half_width: f64) -> f64 {
        /// Share of the prior variance that is left of what is seen at most, and a little less.
        const LEFT: f64 = 0.099;
        let seen = LEFT.sqrt() * self.today.parameters[parameter].prior_std;
        seen.min(half_width / self.width_of_deviation(parameter))
    }

    /// What base parameters tell of a standard parameter, in units of a deviation that is wanted of it: `f` such that the deviation is met
    /// where `f C_β fᵀ ≤ 1`. `None` if what no motion shows of the parameter is more than the wanted deviation.
    pub fn combination(&self, parameter: usize, deviation: f64) -> Option<Vec<f64>> {
        let a = &self.today.parameters[parameter];
        let room = deviation * deviation - a.hidden * a.prior_std * a.prior_std;
        (room > 0.0).then(|| {
            let unit = 1.0 / room.sqrt();
            self.space.seen_through(parameter).into_iter().map(|c| c * unit).collect()
        })
    }

    /// Half width of an interval per standard deviation of [`Assessment::posterior_std`].
    fn width_of_deviation(&self, parameter: usize) -> f64 {
        let std = self.today.parameters[parameter].posterior_std;
        match self.parameters[parameter].half_width {
            Some(width) if std > 0.0 && width > 0.0 => width / std,
            _ => self.quantile,
        }
    }
}
