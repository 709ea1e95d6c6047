//! Numbers as an engineer would write them down.
//!
//! Plain ASCII (`-1.23e-5`), so that a number copied from the page is a number anywhere else.

/// What stands for an undefined number.
pub(crate) const UNDEFINED: &str = "-";
const NOT_FINITE: &str = "not finite";

/// `value` with `digits` significant digits: plain between 0.001 and 100000, else with an exponent.
pub(crate) fn significant(value: f64, digits: usize) -> String {
    if !value.is_finite() {
        return NOT_FINITE.to_owned();
    }
    if value == 0.0 {
        return "0".to_owned();
    }
    let exponent = exponent(value, digits);
    if (-3..5).contains(&exponent) {
        let decimals = (digits as i32 - 1 - exponent).max(0) as usize;
        format!("{value:.decimals$}")
    } else {
        format!("{value:.*e}", digits - 1)
    }
}

/// `value` and its standard deviation: the deviation to two digits, the value to the same place, at most eight
/// digits.
pub(crate) fn with_std(value: f64, std: f64) -> (String, String) {
    if !(value.is_finite() && std.is_finite() && std > 0.0) {
        return (significant(value, 4), significant(std, 2));
    }
    let place = exponent(std, 2) - 1;
    let largest = if value == 0.0 { exponent(std, 2) } else { exponent(value, 2).max(exponent(std, 2)) };
    let digits = (largest - place + 1).clamp(2, 8);
    if (-3..6).contains(&largest) {
        let decimals = (digits - 1 - largest).max(0) as usize;
        let std_text = if digits == 8 { significant(std, 2) } else { format!("{std:.decimals$}") };
        (unsigned_zero(format!("{value:.decimals$}")), std_text)
    } else {
        let value_digits = if value == 0.0 { 0 } else { (exponent(value, 2) - place).clamp(0, 7) };
        (format!("{value:.*e}", value_digits as usize), format!("{std:.1e}"))
    }
}

/// Ends of an interval to the same place, its half width having two digits.
pub(crate) fn interval(low: f64, high: f64) -> (String, String) {
    let half = 0.5 * (high - low);
    (with_std(low, half).0, with_std(high, half).0)
}

/// A share of a whole in percent, rounded down, so that 100 % is said of a whole alone.
pub(crate) fn share(share: f64) -> String {
    // A share that was computed may miss its whole per cent by rounding.
    if share.is_finite() {
        format!("{:.0} %", (100.0 * share.max(0.0) + 1e-9).floor())
    } else {
        NOT_FINITE.to_owned()
    }
}

/// All digits of `value` if they are at most six (a chosen 0.25 is not 0.2500), else four.
pub(crate) fn shortest(value: f64) -> String {
    let scientific = format!("{value:e}");
    let Some((mantissa, _)) = scientific.split_once('e') else { return significant(value, 4) };
    match mantissa.chars().filter(char::is_ascii_digit).count() {
        digits @ ..=6 if (-3..6).contains(&exponent(value, digits)) => value.to_string(),
        ..=6 => scientific,
        _ => significant(value, 4),
    }
}

/// A count with narrow spaces between groups of three digits.
pub(crate) fn count(value: u64) -> String {
    let digits = value.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) && digits.len() > 4 {
            text.push('\u{202f}');
        }
        text.push(digit);
    }
    text
}

/// `value` with a fixed number of decimals.
pub(crate) fn fixed(value: f64, decimals: usize) -> String {
    if value.is_finite() { unsigned_zero(format!("{value:.decimals$}")) } else { NOT_FINITE.to_owned() }
}

/// `kg m^2` as `kg m²`, never broken over two lines.
pub(crate) fn unit(unit: &str) -> String {
    unit.replace(' ', "\u{a0}")
        .replace("^-1", "⁻¹")
        .replace("^-2", "⁻²")
        .replace("^2", "²")
        .replace("^3", "³")
}

/// Decimal exponent of `value` after rounding to `digits`, so that 9.9996 counts as 10.
fn exponent(value: f64, digits: usize) -> i32 {
    let text = format!("{:.*e}", digits - 1, value);
    text.split_once('e').and_then(|(_, exponent)| exponent.parse().ok()).unwrap_or(0)
}

fn unsigned_zero(text: String) -> String {
    let is_zero = text.chars().all(|c| matches!(c, '-' | '0' | '.'));
    if is_zero { text.trim_start_matches('-').to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_digits_plain_or_with_an_exponent() {
        let cases = [
            (0.0, "0"),
            (1.0, "1.000"),
            (-12.3456, "-12.35"),
            (9.99996, "10.00"),
            (0.00123456, "0.001235"),
            (0.000999999, "0.001000"),
            (1.23456e-5, "1.235e-5"),
            (99_999.9, "1.000e5"),
            (54_321.2, "54321"),
            (f64::NAN, "not finite"),
        ];
        for (value, text) in cases {
            assert_eq!(significant(value, 4), text);
        }
    }

    #[test]
    fn the_deviation_sets_the_last_place() {
        let cases = [
            ((1.23456, 0.00123), ("1.2346", "0.0012")),
            ((-0.0123, 0.45), ("-0.01", "0.45")),
            ((-0.001, 0.45), ("0.00", "0.45")),
            ((1234.56, 120.0), ("1235", "120")),
            ((1.23456e-7, 1.2e-9), ("1.235e-7", "1.2e-9")),
            ((0.0, 0.031), ("0.000", "0.031")),
            ((1.0, 0.0), ("1.000", "0")),
            ((3.0, f64::INFINITY), ("3.000", "not finite")),
        ];
        for ((value, std), (value_text, std_text)) in cases {
            assert_eq!(with_std(value, std), (value_text.to_owned(), std_text.to_owned()));
        }
    }

    #[test]
    fn a_chosen_number_is_printed_as_chosen() {
        let cases = [
            (0.0, "0"),
            (0.25, "0.25"),
            (-15.0, "-15"),
            (500_000.0, "500000"),
            (3.2e-6, "3.2e-6"),
            (1e9, "1e9"),
            (std::f64::consts::PI, "3.142"),
            (f64::INFINITY, "not finite"),
        ];
        for (value, text) in cases {
            assert_eq!(shortest(value), text);
        }
    }

    #[test]
    fn an_interval_shows_two_digits_of_its_width() {
        let text = |low: &str, high: &str| (low.to_owned(), high.to_owned());
        assert_eq!(interval(0.415867, 0.432785), text("0.4159", "0.4328"));
        assert_eq!(interval(-12.0, 1.0), text("-12.0", "1.0"));
        assert_eq!(interval(0.0, 0.0), text("0", "0"));
    }

    #[test]
    fn a_share_is_never_rounded_up_to_the_whole() {
        for (value, text) in [(0.0, "0 %"), (-1e-17, "0 %"), (0.29, "29 %"), (0.9999, "99 %"), (1.0, "100 %")]
        {
            assert_eq!(share(value), text);
        }
    }

    #[test]
    fn counts_are_grouped_from_five_digits_on() {
        assert_eq!(count(9999), "9999");
        assert_eq!(count(1_234_567), "1\u{202f}234\u{202f}567");
    }
}
