//! Lists that must be as long as others.
use crate::error::ReportError;

/// Fails unless every time is finite and none is below the one before.
pub(super) fn time(place: &str, time_s: &[f64]) -> Result<(), ReportError> {
    let mut least = f64::NEG_INFINITY;
    for (sample, &found) in time_s.iter().enumerate() {
        if !found.is_finite() || found < least {
            return Err(ReportError::Time { place: place.to_owned(), sample, least, found });
        }
        least = found;
    }
    Ok(())
}

pub(super) fn per_joint(place: &str, found: usize, joints: usize) -> Result<(), ReportError> {
    if found == 0 { Ok(()) } else { length(place, found, joints) }
}

pub(super) fn length(place: &str, found: usize, expected: usize) -> Result<(), ReportError> {
    if found == expected {
        return Ok(());
    }
    Err(ReportError::Length { place: place.to_owned(), expected, found })
}
