//! Temperatures of joints: plausibility.

use std::ops::RangeInclusive;

/// Temperatures that a joint may have, °C; kelvins are not among them.
pub const PLAUSIBLE: RangeInclusive<f64> = -40.0..=120.0;

/// Above the coldest laboratory in degrees Fahrenheit, and more than most joints reach in degrees Celsius.
const FAHRENHEIT: RangeInclusive<f64> = 59.0..=140.0;

/// What is doubtful about the temperatures of a channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TemperatureDoubt {
    /// A value that no joint has in degrees Celsius; above 220 it looks like kelvins.
    Implausible {
        /// Sample, from 0.
        sample: usize,
        /// Value.
        found: f64,
    },
    /// All values would be those of a laboratory in degrees Fahrenheit, and those of a very hot joint in degrees Celsius.
    LooksLikeFahrenheit {
        /// Least value.
        least: f64,
        /// Greatest value.
        greatest: f64,
    },
}

/// Looks at the temperatures of a joint, °C.
pub fn doubt(values: &[f64]) -> Option<TemperatureDoubt> {
    let implausible = values.iter().position(|t| !PLAUSIBLE.contains(t));
    if let Some(sample) = implausible {
        return Some(TemperatureDoubt::Implausible { sample, found: values[sample] });
    }
    let least = values.iter().copied().reduce(f64::min)?;
    let greatest = values.iter().copied().reduce(f64::max)?;
    let inside = FAHRENHEIT.contains(&least) && FAHRENHEIT.contains(&greatest);
    inside.then_some(TemperatureDoubt::LooksLikeFahrenheit { least, greatest })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kelvins_and_fahrenheit_are_told() {
        assert_eq!(doubt(&[20.0, 45.0]), None);
        assert_eq!(doubt(&[]), None);
        assert_eq!(doubt(&[20.0, 300.0]), Some(TemperatureDoubt::Implausible { sample: 1, found: 300.0 }));
        let warm = Some(TemperatureDoubt::LooksLikeFahrenheit { least: 68.0, greatest: 104.0 });
        assert_eq!(doubt(&[68.0, 104.0, 90.0]), warm);
        assert_eq!(doubt(&[25.0, 70.0]), None, "a joint that got hot");
    }
}
