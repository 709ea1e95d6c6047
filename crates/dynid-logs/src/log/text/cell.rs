//! What a cell of a log holds.

/// What a cell of a log holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Cell {
    /// Nothing, NaN, or a word that stands for no value.
    Missing,
    /// A number with a decimal point, or a whole one.
    Number,
    /// A number with a comma where others have a point; `grouped`: it may be one with thousands set apart (`1,234`).
    Comma {
        /// Whether the comma may set thousands apart.
        grouped: bool,
    },
    /// A number with both marks, such as `1.234,5`.
    BothMarks,
    /// So many numbers between brackets.
    List(usize),
    /// Anything else.
    Text,
}

/// Words for no value.
const MISSING: [&str; 7] = ["nan", "-nan", "na", "n/a", "#n/a", "null", "none"];

/// True if a cell says that there is no value.
pub(super) fn is_missing(field: &[u8]) -> bool {
    field.is_empty() || MISSING.iter().any(|word| field.eq_ignore_ascii_case(word.as_bytes()))
}

/// What a cell holds.
pub(super) fn classify(field: &[u8]) -> Cell {
    if is_missing(field) {
        return Cell::Missing;
    }
    let Ok(text) = std::str::from_utf8(field) else { return Cell::Text };
    if text.parse::<f64>().is_ok() {
        return Cell::Number;
    }
    if let Some(values) = list(text) {
        return if values.is_empty() { Cell::Missing } else { Cell::List(values.len()) };
    }
    with_commas(text).unwrap_or(Cell::Text)
}

/// A number that holds commas.
fn with_commas(text: &str) -> Option<Cell> {
    let (whole, fraction) = text.split_once(',')?;
    if fraction.contains(',') || text.contains('.') {
        let plain: String = text.chars().filter(|c| !matches!(c, ',' | '.')).collect();
        return plain.parse::<f64>().is_ok().then_some(Cell::BothMarks);
    }
    if !text.bytes().any(|b| b.is_ascii_digit()) || text.replacen(',', ".", 1).parse::<f64>().is_err() {
        return None;
    }
    let digits = whole.trim_start_matches(['+', '-']);
    let grouped = (1..=3).contains(&digits.len())
        && !digits.starts_with('0')
        && fraction.len() == 3
        && fraction.bytes().all(|b| b.is_ascii_digit());
    Some(Cell::Comma { grouped })
}

/// The numbers of a list such as `[0.1, 0.2]`, `(0.1 0.2)` or `[0.1; 0.2]`; values that are missing become NaN. `None`: no
/// such list.
pub(super) fn list(text: &str) -> Option<Vec<f64>> {
    let text = text.trim();
    let inner = text
        .strip_prefix('[')
        .and_then(|rest| rest.strip_suffix(']'))
        .or_else(|| text.strip_prefix('(').and_then(|rest| rest.strip_suffix(')')))?;
    let inner = inner.trim().trim_end_matches(',');
    if inner.is_empty() {
        return Some(Vec::new());
    }
    let parts: Vec<&str> = if inner.contains([',', ';']) {
        inner.split([',', ';']).map(str::trim).collect()
    } else {
        inner.split_whitespace().collect()
    };
    let number = |part: &str| match is_missing(part.as_bytes()) {
        true => Some(f64::NAN),
        false => part.parse::<f64>().ok(),
    };
    parts.into_iter().map(number).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_told_apart() {
        for (text, cell) in [
            ("", Cell::Missing),
            ("NaN", Cell::Missing),
            ("null", Cell::Missing),
            ("[]", Cell::Missing),
            ("-1.5e-3", Cell::Number),
            ("0,5", Cell::Comma { grouped: false }),
            ("-0,123", Cell::Comma { grouped: false }),
            ("1,5e-3", Cell::Comma { grouped: false }),
            ("1,234", Cell::Comma { grouped: true }),
            ("-12,345", Cell::Comma { grouped: true }),
            ("1234,567", Cell::Comma { grouped: false }),
            ("1.234,56", Cell::BothMarks),
            ("1,234,567", Cell::BothMarks),
            ("[0.1, 0.2]", Cell::List(2)),
            ("(1 2 3)", Cell::List(3)),
            ("[0.1, nan]", Cell::List(2)),
            ("on", Cell::Text),
            ("a,b", Cell::Text),
            (",", Cell::Text),
            ("[a, b]", Cell::Text),
            ("2023-11-14", Cell::Text),
        ] {
            assert_eq!(classify(text.as_bytes()), cell, "{text}");
        }
    }
}
