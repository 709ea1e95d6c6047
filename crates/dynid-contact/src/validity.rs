//! Whether a contact law is used where it holds.

use std::fmt;

/// How far a contact is inside the range of its law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactValidity {
    /// `δ/c`; every law takes it for small.
    pub penetration_over_clearance: f64,
    /// Of the fractal law.
    pub spots: Option<SpotValidity>,
}

/// What the spots of a rough contact do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpotValidity {
    /// `a_l/a_c`: largest over critical area.
    pub largest_over_critical: f64,
    /// Some spots are elastic, `a_l > a_c`.
    pub elastic: bool,
    /// Some spots are in the first elastic-plastic stage, `a_l > a_1`.
    pub first_elastoplastic: bool,
    /// Some spots are in the second elastic-plastic stage, `a_l > a_2`; without them there is no force.
    pub second_elastoplastic: bool,
    /// Plastic over elastic work is above its limit, or there is no elastic work.
    pub work_ratio_capped: bool,
}

impl ContactValidity {
    /// Penetration over clearance above which a remark is made.
    pub const DEEP: f64 = 0.2;

    /// One sentence for each doubt; none inside the range.
    pub fn remarks(&self) -> Vec<String> {
        let mut remarks = Vec::new();
        if self.penetration_over_clearance > Self::DEEP {
            remarks.push(format!(
                "the penetration is {:.3} of the clearance, which the law takes for small (up to {})",
                self.penetration_over_clearance,
                Self::DEEP
            ));
        }
        let Some(spots) = self.spots else { return remarks };
        if !spots.second_elastoplastic {
            remarks.push("all contact spots are plastic: the law has no stiffness here".into());
        } else if !spots.elastic {
            remarks.push(format!(
                "the largest contact spot is {:.3} of the critical area: none is elastic",
                spots.largest_over_critical
            ));
        }
        if spots.work_ratio_capped {
            remarks.push("the ratio of plastic to elastic work is held at its limit".into());
        }
        remarks
    }
}

impl fmt::Display for ContactValidity {
    /// The remarks, or that there are none.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let remarks = self.remarks();
        if remarks.is_empty() {
            write!(f, "inside the range of the law")
        } else {
            write!(f, "{}", remarks.join("; "))
        }
    }
}
