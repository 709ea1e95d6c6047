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
                let terms = self
                    .folded
                    .iter()
                    .zip(&self.factors)
                    .filter(|(_, factors)| factors[i] != 0.0)
                    .map(|(column, factors)| (factors[i], table.linear[*column].symbol.as_str()));
                expression(&table.linear[self.kept[i]].symbol, terms)
            })
            .collect()
    }
}

fn expression<'a>(kept: &str, terms: impl Iterator<Item = (f64, &'a str)>) -> String {
    let mut groups: Vec<(f64, Vec<&str>)> = Vec::new();
    for (factor, symbol) in terms {
        let same = |g: f64| (g - factor).abs() <= 1e-9 * factor.abs();
        match groups.iter_mut().find(|(g, _)| same(*g)) {
            Some((_, symbols)) => symbols.push(symbol),
            None => groups.push((factor, vec![symbol])),
        }
    }
    // Plain sums first, then factors in the order met.
    groups.sort_by_key(|(factor, _)| (factor.abs() - 1.0).abs() > 1e-9);
    let mut text = kept.to_owned();
    for (factor, symbols) in groups {
        text.push_str(if factor < 0.0 { " - " } else { " + " });
        let size = factor.abs();
        let plain = (size - 1.0).abs() <= 1e-9;
        if !plain {
            text.push_str(&digits(size));
            text.push(' ');
        }
        if symbols.len() == 1 {
            text.push_str(symbols[0]);
        } else if plain {
            let separator = if factor < 0.0 { " - " } else { " + " };
            text.push_str(&symbols.join(separator));
        } else {
            text.push('(');
            text.push_str(&symbols.join(" + "));
            text.push(')');
        }
    }
    text
}

/// At most six significant digits, without trailing zeros.
fn digits(x: f64) -> String {
    let magnitude = x.abs().log10().floor() as i32;
    if !(-4..6).contains(&magnitude) {
        return format!("{x:.5e}");
    }
    let decimals = (5 - magnitude).max(0) as usize;
    let text = format!("{x:.decimals$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_equal_factors_and_signs() {
        let terms =
            [(1.0, "Ia1"), (1.0, "Iyy2"), (0.2025, "m3"), (0.2025, "m4"), (-0.45, "mz3"), (-1.0, "mz4")];
        assert_eq!(
            expression("Izz1", terms.into_iter()),
            "Izz1 + Ia1 + Iyy2 - mz4 + 0.2025 (m3 + m4) - 0.45 mz3"
        );
    }

    #[test]
    fn factors_are_short() {
        assert_eq!(digits(0.20251225), "0.202512");
        assert_eq!(digits(12.0), "12");
        assert_eq!(digits(0.001575), "0.001575");
    }
}
