//! Geometry of a journal in its bearing.

use crate::error::{ContactError, checked};

/// A journal of radius `R2` and width `b` in a bearing of radius `R1 = R2 + c`.
///
/// At a penetration `δ` they touch over the half angle `ε`, `cos ε = c/(c + δ)`, that is over the length
/// `l = 2 R2 sin(ε/2)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JournalBearing {
    journal_radius: f64,
    clearance: f64,
    width: f64,
}

impl JournalBearing {
    /// From the radii of bearing and journal and the width of contact, m.
    ///
    /// Fails unless journal radius and width are above 0 and the bearing is larger than the journal.
    pub fn new(bearing_radius: f64, journal_radius: f64, width: f64) -> Result<Self, ContactError> {
        let wider = bearing_radius > journal_radius;
        checked("bearing_radius", "a radius in m above that of the journal", bearing_radius, wider)?;
        Self::with_gap(journal_radius, bearing_radius - journal_radius, width)
    }

    /// From journal radius, radial clearance and width, m, all above 0.
    pub fn with_gap(journal_radius: f64, clearance: f64, width: f64) -> Result<Self, ContactError> {
        checked("journal_radius", "above 0 m", journal_radius, journal_radius > 0.0)?;
        checked("clearance", "above 0 m", clearance, clearance > 0.0)?;
        checked("width", "above 0 m", width, width > 0.0)?;
        Ok(JournalBearing { journal_radius, clearance, width })
    }

    /// Returns the journal in a bearing of another clearance.
    ///
    /// Fails unless it is above 0.
    pub fn with_clearance(&self, clearance: f64) -> Result<Self, ContactError> {
        Self::with_gap(self.journal_radius, clearance, self.width)
    }

    /// `R1`, m.
    #[inline]
    pub fn bearing_radius(&self) -> f64 {
        self.journal_radius + self.clearance
    }

    /// `R2`, m.
    #[inline]
    pub fn journal_radius(&self) -> f64 {
        self.journal_radius
    }

    /// Radial clearance `c = R1 - R2`, m.
    #[inline]
    pub fn clearance(&self) -> f64 {
        self.clearance
    }

    /// Width `b`, m.
    #[inline]
    pub fn width(&self) -> f64 {
        self.width
    }

    /// `sin(ε/2) = √(δ/(2 (c + δ)))`, which loses nothing at small penetrations; 0 without penetration.
    fn half_sine(&self, penetration: f64) -> f64 {
        let depth = penetration.max(0.0);
        (0.5 * depth / (self.clearance + depth)).sqrt()
    }

    /// Length of contact `l`, m.
    pub fn contact_length(&self, penetration: f64) -> f64 {
        2.0 * self.journal_radius * self.half_sine(penetration)
    }

    /// Nominal area of contact `l b`, m².
    pub fn nominal_area(&self, penetration: f64) -> f64 {
        self.contact_length(penetration) * self.width
    }

    /// Real area of contact `A_r = λ l b`, m², for the share `λ` of the nominal area that touches.
    pub fn real_area(&self, penetration: f64, area_ratio: f64) -> f64 {
        area_ratio * self.nominal_area(penetration)
    }
}
