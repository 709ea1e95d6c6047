//! Regroupings as people write them.

use super::BaseParameters;
use crate::parameter::ParameterTable;

impl BaseParameters {
    /// Regrouping of every base parameter: `Izz1 + Ia1 + Iyy2 + 0.2025 (m3 + m4)`.
    ///
    /// Symbols are those of the table; terms with equal factors are grouped, factors carry six digits at most.
    pub fn expressions(&self, table: &ParameterTable) -> Vec<String> {
        (0..self.len())
            .map(|i| {
                let kept = (1.0, table.linear[self.kept[i]].symbol.as_str());
                let folded = self
                    .folded
                    .iter()
                    .zip(&self.factors)
                    .filter(|(_, factors)| factors[i] != 0.0)
                    .map(|(column, factors)| (factors[i], table.linear[*column].symbol.as_str()));
                linear_combination(std::iter::once(kept).chain(folded), 6, " ")
            })
            .collect()
    }
}

/// Relative difference up to which numbers are equal.
const TIE: f64 = 1e-9;

/// A sum of multiples of symbols as people write it: `mx2 + 0.45 (m3 + m4) - mz3`.
///
/// `terms`: factor and symbol, none of the factors zero. Factors carry `digits` significant digits at most; terms whose
/// factors then read alike stand in brackets together. Plain sums come first, then groups in the order met. `times`
/// stands between a factor and what it multiplies. Empty without terms.
pub fn linear_combination<'a>(
    terms: impl Iterator<Item = (f64, &'a str)>,
    digits: usize,
    times: &str,
) -> String {
    struct Group<'a> {
        factor: f64,
        size: String,
        symbols: Vec<&'a str>,
    }
    let mut groups: Vec<Group<'_>> = Vec::new();
    for (factor, symbol) in terms {
        let size = significant(factor.abs(), digits);
        let alike = |g: &&mut Group<'_>| {
            (g.factor < 0.0) == (factor < 0.0)
                && (g.size == size || (g.factor - factor).abs() <= TIE * factor.abs())
        };
        match groups.iter_mut().find(alike) {
            Some(group) => group.symbols.push(symbol),
            None => groups.push(Group { factor, size, symbols: vec![symbol] }),
        }
    }
    groups.sort_by_key(|g| g.size != "1");
    let mut text = String::new();
    for Group { factor, size, symbols } in groups {
        let negative = factor < 0.0;
        let sign = match (negative, text.is_empty()) {
            (false, true) => "",
            (true, true) => "-",
            (false, false) => " + ",
            (true, false) => " - ",
        };
        text.push_str(sign);
        let plain = size == "1";
        if !plain {
            text.push_str(&size);
            text.push_str(times);
        }
        if symbols.len() == 1 {
            text.push_str(symbols[0]);
        } else if plain {
            text.push_str(&symbols.join(if negative { " - " } else { " + " }));
        } else {
            text.push('(');
            text.push_str(&symbols.join(" + "));
            text.push(')');
        }
    }
    text
}

/// At most `digits` significant digits (whole numbers below a million keep all of theirs), without trailing zeros. Ties
/// round away from zero, also those that rounding has moved by up to 1e-9: equal lengths shall read alike.
pub fn significant(x: f64, digits: usize) -> String {
    let (x, last) = (x * (1.0 + TIE), digits.max(1) - 1);
    if x == 0.0 {
        return "0".to_owned();
    }
    let magnitude = x.abs().log10().floor() as i32;
    if !(-4..6).contains(&magnitude) {
        return format!("{x:.last$e}");
    }
    let decimals = (last as i32 - magnitude).max(0) as usize;
    let text = format!("{x:.decimals$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_equal_factors_and_signs() {
        let terms = [
            (1.0, "Izz1"),
            (1.0, "Ia1"),
            (1.0, "Iyy2"),
            (0.2025, "m3"),
            (0.2025, "m4"),
            (-0.45, "mz3"),
            (-1.0, "mz4"),
        ];
        assert_eq!(
            linear_combination(terms.into_iter(), 6, " "),
            "Izz1 + Ia1 + Iyy2 - mz4 + 0.2025 (m3 + m4) - 0.45 mz3"
        );
    }

    #[test]
    fn rounding_does_not_split_a_tie() {
        let (above, below) = (0.1835 * (1.0 + 1e-15), 0.1835 * (1.0 - 1e-15));
        for terms in [[(above, "m5"), (below, "m6")], [(below, "m5"), (above, "m6")]] {
            assert_eq!(linear_combination(terms.into_iter(), 3, "·"), "0.184·(m5 + m6)");
        }
    }

    #[test]
    fn factors_are_short() {
        assert_eq!(significant(0.20251225, 6), "0.202512");
        assert_eq!(significant(12.0, 6), "12");
        assert_eq!(significant(0.001575, 6), "0.001575");
        assert_eq!(significant(0.20251225, 3), "0.203");
    }

    #[test]
    fn a_sum_may_begin_with_any_sign_and_factor() {
        let terms = [(-0.45, "m3"), (-0.4502, "m4"), (2.0, "Ia1")];
        assert_eq!(linear_combination(terms.into_iter(), 3, "·"), "-0.45·(m3 + m4) + 2·Ia1");
        assert_eq!(linear_combination([].into_iter(), 3, "·"), "");
    }
}
