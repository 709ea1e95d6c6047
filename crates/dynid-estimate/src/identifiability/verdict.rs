//! From shares to verdicts.

/// Least achieved share of what is seen in the data.
const SEEN: f64 = 0.90;
/// Least structural limit of what is identifiable at all; also the limit above which nothing but noise is in the way.
const IDENTIFIABLE: f64 = 0.10;

/// What a value rests on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Verdict {
    /// The log removes at least 90 % of the prior variance.
    Seen,
    /// Neither the one nor the other: the prior decides at least part of the value.
    CarriedByPrior(Carried),
    /// No motion of this robot could remove 10 % of the prior variance.
    NotIdentifiable,
    /// The value is known: no log is asked.
    Given,
}

/// Why a value is carried by the prior.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Carried {
    /// The parameter acts only together with others (structural limit below 0.9): no motion separates them.
    OnlyInCombination,
    /// Another motion would reveal the parameter, the logged one does not.
    NotExcited,
    /// The logged motion would reveal it if there were less noise or more of it.
    TooNoisy,
}

/// The verdict from achieved share `s`, limit of the log `l` and structural limit `p`.
///
/// Seen if `s ≥ 0.9`; else not identifiable if `p < 0.1`; else carried by the prior: only in combination if `p < 0.9`,
/// too noisy if `l ≥ 0.9`, not excited otherwise. The last holds the rest where `p - s < 0.3` as well: with `p ≥ 0.9` and
/// `l < 0.9` it is the motion that keeps the share below 0.9.
pub fn verdict(achieved: f64, log_limit: f64, structural_limit: f64) -> Verdict {
    if achieved >= SEEN {
        Verdict::Seen
    } else if structural_limit < IDENTIFIABLE {
        Verdict::NotIdentifiable
    } else if structural_limit < SEEN {
        Verdict::CarriedByPrior(Carried::OnlyInCombination)
    } else if log_limit >= SEEN {
        Verdict::CarriedByPrior(Carried::TooNoisy)
    } else {
        Verdict::CarriedByPrior(Carried::NotExcited)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_of_verdicts() {
        use Carried::*;
        use Verdict::*;
        for (s, l, p, expected) in [
            (0.90, 0.95, 1.0, Seen),
            (0.8999, 0.8999, 0.8999, CarriedByPrior(OnlyInCombination)),
            (0.0, 0.0, 0.0999, NotIdentifiable),
            (0.0, 0.0, 0.1, CarriedByPrior(OnlyInCombination)),
            (0.5, 0.89, 0.95, CarriedByPrior(NotExcited)),
            (0.5, 0.90, 0.95, CarriedByPrior(TooNoisy)),
            (0.8, 0.85, 0.95, CarriedByPrior(NotExcited)),
        ] {
            assert_eq!(verdict(s, l, p), expected, "s {s}, l {l}, p {p}");
        }
    }
}
