//! What the data see of a parameter that acts only together with others, in words.

use dynid_linalg::Mat;
use dynid_model::base_parameters::{linear_combination, significant};

/// Terms below this share of the largest are left out.
const SHOWN: f64 = 0.03;
/// Significant digits of factors.
const DIGITS: usize = 3;
/// Relative difference up to which a factor is a stated length.
const SAME_LENGTH: f64 = 1e-4;

/// One base parameter that contains a given parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Combination {
    /// Index of the base parameter.
    pub base: usize,
    /// Share of the parameter in the prior variance of the base parameter, `K_ij² C0_jj / (K C0 Kᵀ)_ii`.
    pub share: f64,
    /// Parameter and factor of the terms worth showing, in column order with the base parameter's own column first: those
    /// with `|K_ij| √C0_jj` above 3 % of the largest.
    pub terms: Vec<(usize, f64)>,
    /// Whether smaller terms were left out.
    pub shortened: bool,
}

/// Base parameters that contain parameter `j`, the one in which it weighs most first (ties: the first base parameter).
///
/// `regrouping`: `K`, `r × p`; `prior_std`: `p` standard deviations; `kept`: column that base parameter `i` is named
/// after. Empty if the parameter never acts. Panics if shapes disagree.
pub fn visible_combinations(
    regrouping: &Mat,
    prior_std: &[f64],
    kept: &[usize],
    parameter: usize,
) -> Vec<Combination> {
    assert_eq!(prior_std.len(), regrouping.ncols(), "one standard deviation per parameter");
    assert_eq!(kept.len(), regrouping.nrows(), "one kept column per base parameter");
    let mut found: Vec<Combination> = (0..regrouping.nrows())
        .filter(|i| regrouping[(*i, parameter)] != 0.0)
        .map(|i| {
            let weight = |j: usize| (regrouping[(i, j)] * prior_std[j]).abs();
            let all = 0..prior_std.len();
            let variance: f64 = all.clone().map(|j| weight(j).powi(2)).sum();
            let least = SHOWN * all.clone().map(weight).fold(0.0, f64::max);
            let order = std::iter::once(kept[i]).chain(all.filter(|j| *j != kept[i]));
            let acting: Vec<usize> = order.filter(|j| weight(*j) > 0.0).collect();
            let terms: Vec<(usize, f64)> =
                acting.iter().filter(|j| weight(**j) > least).map(|j| (*j, regrouping[(i, *j)])).collect();
            Combination {
                base: i,
                share: weight(parameter).powi(2) / variance,
                shortened: terms.len() < acting.len(),
                terms,
            }
        })
        .collect();
    found.sort_by(|a, b| b.share.total_cmp(&a.share));
    found
}

impl Combination {
    /// The combination in symbols, `mx2 + 0.45·(m3 + m4)`; a trailing `+ …` stands for terms left out.
    ///
    /// `symbols`: one per parameter.
    pub fn expression(&self, symbols: &[&str]) -> String {
        let terms = self.terms.iter().map(|(j, factor)| (*factor, symbols[*j]));
        let text = linear_combination(terms, DIGITS, "·");
        if self.shortened { text + " + …" } else { text }
    }

    /// The sentence for a report: `the data see mx2 + 0.45·(m3 + m4) = 4.81 ± 0.02 kg m; the split follows the prior`.
    ///
    /// `measured`: value and half width of the whole base parameter if it is seen, else `None`, and the sentence says that
    /// not even the combination is. `unit`: that of the base parameter.
    pub fn sentence(&self, symbols: &[&str], measured: Option<(f64, f64)>, unit: &str) -> String {
        let expression = self.expression(symbols);
        match measured {
            Some((value, half_width)) => format!(
                "the data see {expression} = {} {unit}; the split follows the prior",
                with_half_width(value, half_width)
            ),
            None => format!("only {expression} acts on the effort, and these data do not determine it"),
        }
    }

    /// Factors that are lengths of the robot (or twice one, or its square), as `0.45 = distance joint 2-3`.
    ///
    /// `lengths`: length in m and its words. A factor has the first name that fits within 1e-4 of it.
    pub fn constants(&self, lengths: &[(f64, String)]) -> Vec<String> {
        let mut named: Vec<String> = Vec::new();
        for (_, factor) in &self.terms {
            let size = factor.abs();
            let is = |x: f64| (size - x).abs() <= SAME_LENGTH * x && x > 0.0;
            let number = significant(size, DIGITS);
            if number == "1" {
                continue;
            }
            let name = lengths
                .iter()
                .find(|(x, _)| is(*x))
                .map(|(_, words)| format!("{number} = {words}"))
                .or_else(|| {
                    let twice = lengths.iter().find(|(x, _)| is(2.0 * x));
                    twice.map(|(_, words)| format!("{number} = twice the {words}"))
                })
                .or_else(|| {
                    let square = lengths.iter().find(|(x, _)| is(x * x));
                    square.map(|(_, words)| format!("{number} = square of the {words}"))
                });
            named.extend(name.filter(|n| !named.contains(n)));
        }
        named
    }
}

/// `4.81 ± 0.02`: the half width with one significant digit (two if the first is a 1), the value with as many decimals.
pub fn with_half_width(value: f64, half_width: f64) -> String {
    if !(half_width.is_finite() && half_width > 0.0) {
        return significant(value, 6);
    }
    let magnitude = half_width.log10().floor() as i32;
    let two = half_width / 10f64.powi(magnitude) < 1.95;
    let decimals = usize::from(two) as i32 - magnitude;
    if !(0..=9).contains(&decimals) {
        return format!("{} ± {}", significant(value, 6), significant(half_width, 2));
    }
    let decimals = decimals as usize;
    format!("{value:.decimals$} ± {half_width:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_carry_the_digits_that_their_half_width_allows() {
        for (value, half_width, expected) in [
            (4.8123, 0.021, "4.81 ± 0.02"),
            (4.8123, 0.0149, "4.812 ± 0.015"),
            (-0.5, 0.1, "-0.50 ± 0.10"),
            (123.456, 7.0, "123 ± 7"),
            (123.456, 40.0, "123.456 ± 40"),
            (2.5, 0.0, "2.5"),
        ] {
            assert_eq!(with_half_width(value, half_width), expected);
        }
    }
}
