//! Units of columns.

use std::f64::consts::{PI, TAU};

use super::{MappingError, Signal};

/// `value = factor · raw + offset` in SI (temperatures: °C).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Conversion {
    pub(super) factor: f64,
    pub(super) offset: f64,
    /// The raw value is a current, which a drive gain turns into an effort.
    pub(super) current: bool,
}

impl Conversion {
    pub(super) const IDENTITY: Conversion = Conversion { factor: 1.0, offset: 0.0, current: false };
}

/// The conversion of a unit (`SI`: none); case, blanks, `*` and `·` do not matter.
pub(super) fn conversion(signal: Signal, unit: &str, column: &str) -> Result<Conversion, MappingError> {
    let plain: String =
        unit.to_lowercase().chars().filter(|c| !matches!(c, ' ' | '*' | '·' | '.' | '^' | '_')).collect();
    let plain = plain.replace('²', "2").replace(['µ', 'μ'], "u").replace('°', "deg");
    if plain == "si" {
        return Ok(Conversion::IDENTITY);
    }
    let degree = PI / 180.0;
    let factor = match signal {
        Signal::Time => match plain.as_str() {
            "s" | "sec" | "seconds" => Some(1.0),
            "ms" => Some(1e-3),
            "us" => Some(1e-6),
            "ns" => Some(1e-9),
            _ => None,
        },
        Signal::Position => length_or_angle(&plain),
        Signal::Velocity => match plain.as_str() {
            "rpm" => Some(TAU / 60.0),
            "rads" => Some(1.0),
            "degs" => Some(degree),
            other => other.strip_suffix("/s").and_then(length_or_angle),
        },
        Signal::Acceleration => plain.strip_suffix("/s2").and_then(length_or_angle),
        Signal::Effort => match plain.as_str() {
            "nm" | "n" => Some(1.0),
            "mnm" => Some(1e-3),
            "knm" | "kn" => Some(1e3),
            "a" => return Ok(Conversion { current: true, ..Conversion::IDENTITY }),
            "ma" => return Ok(Conversion { factor: 1e-3, offset: 0.0, current: true }),
            _ => None,
        },
        Signal::Temperature => match plain.as_str() {
            "c" | "degc" => Some(1.0),
            "f" | "degf" => {
                return Ok(Conversion { factor: 5.0 / 9.0, offset: -160.0 / 9.0, ..Conversion::IDENTITY });
            }
            "k" => return Ok(Conversion { offset: -273.15, ..Conversion::IDENTITY }),
            _ => None,
        },
    };
    match factor {
        Some(factor) => Ok(Conversion { factor, ..Conversion::IDENTITY }),
        None => Err(MappingError::Unit {
            signal,
            column: column.to_owned(),
            unit: unit.to_owned(),
            expected: expected(signal),
        }),
    }
}

fn length_or_angle(unit: &str) -> Option<f64> {
    match unit {
        "rad" | "m" => Some(1.0),
        "deg" | "degree" | "degrees" => Some(PI / 180.0),
        "rev" | "turn" => Some(TAU),
        "mm" => Some(1e-3),
        _ => None,
    }
}

fn expected(signal: Signal) -> &'static str {
    match signal {
        Signal::Time => "s, ms, us, ns",
        Signal::Position => "rad, deg, rev, m, mm",
        Signal::Velocity => "rad/s, deg/s, rev/s, rpm, m/s, mm/s",
        Signal::Acceleration => "rad/s2, deg/s2, rev/s2, m/s2, mm/s2",
        Signal::Effort => "N m, mN m, kN m, N, kN, A, mA",
        Signal::Temperature => "degC, degF, K",
    }
}
