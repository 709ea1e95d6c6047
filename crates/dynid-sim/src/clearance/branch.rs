//! On which smooth branch of its laws a contact is.

use dynid_model::contact::SlidingFriction;
use dynid_model::element::FrictionLine;

/// Branch of the friction's direction over the sliding speed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Sliding {
    Backward,
    BackwardRamp,
    Sticking,
    ForwardRamp,
    Forward,
}

impl Sliding {
    const ALL: [Sliding; 5] =
        [Sliding::Backward, Sliding::BackwardRamp, Sliding::Sticking, Sliding::ForwardRamp, Sliding::Forward];

    /// The branch of a speed.
    pub(super) fn at(friction: &SlidingFriction, v: f64) -> Self {
        let inside = |s: &Sliding| {
            let (low, high) = s.range(friction);
            low <= v && v <= high
        };
        Self::ALL.into_iter().find(inside).unwrap_or(Sliding::Sticking)
    }

    /// Speeds of the branch.
    pub(super) fn range(self, friction: &SlidingFriction) -> (f64, f64) {
        let (slow, fast) = (friction.v_0, friction.v_m);
        match self {
            Sliding::Backward => (f64::NEG_INFINITY, -fast),
            Sliding::BackwardRamp => (-fast, -slow),
            Sliding::Sticking => (-slow, slow),
            Sliding::ForwardRamp => (slow, fast),
            Sliding::Forward => (fast, f64::INFINITY),
        }
    }

    /// The next branch towards higher or lower speeds.
    pub(super) fn beyond(self, upwards: bool) -> Self {
        let place = Self::ALL.iter().position(|s| *s == self).unwrap_or(2);
        let next = if upwards { place + 1 } else { place.saturating_sub(1) };
        Self::ALL[next.min(4)]
    }

    /// Line of the branch, continued beyond its range.
    pub(super) fn line(self, friction: &SlidingFriction) -> FrictionLine {
        let slope = 1.0 / (friction.v_m - friction.v_0);
        match self {
            Sliding::Backward => FrictionLine { offset: -1.0, slope: 0.0 },
            Sliding::BackwardRamp => FrictionLine { offset: friction.v_0 * slope, slope },
            Sliding::Sticking => FrictionLine { offset: 0.0, slope: 0.0 },
            Sliding::ForwardRamp => FrictionLine { offset: -friction.v_0 * slope, slope },
            Sliding::Forward => FrictionLine { offset: 1.0, slope: 0.0 },
        }
    }
}

/// Whether a journal touches its bearing, and how.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Branch {
    Open,
    Closed {
        /// Normal speed at the start, m/s.
        impact_speed: f64,
        sliding: Sliding,
    },
    /// Still in the bearing's surface, which does not follow.
    Released {
        /// Normal speed at the start, m/s.
        impact_speed: f64,
    },
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn branches_are_lines_of_the_law_and_join() {
        let friction = SlidingFriction { coefficient: 0.1, v_0: 1e-5, v_m: 1e-4 };
        for v in [-3e-4, -7e-5, -2e-6, 0.0, 4e-5, 2e-3] {
            let line = Sliding::at(&friction, v).line(&friction);
            let (value, slope) = friction.direction(v);
            assert!((line.offset + line.slope * v - value).abs() < 1e-12, "{v}");
            assert!((line.slope - slope).abs() <= 1e-12 * slope, "{v}");
        }
        let mut branch = Sliding::Backward;
        for _ in 0..4 {
            let (_, high) = branch.range(&friction);
            let next = branch.beyond(true);
            let at = |s: Sliding| s.line(&friction).offset + s.line(&friction).slope * high;
            assert!((at(branch) - at(next)).abs() < 1e-12, "{branch:?}");
            assert_eq!(next.beyond(false), branch);
            branch = next;
        }
    }
}
