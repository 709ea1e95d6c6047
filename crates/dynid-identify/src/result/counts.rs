//! The one place where parameters are counted.

use dynid_estimate::identifiability::Verdict;
use dynid_model::EffortModel;
use dynid_record::{ParameterVerdict, ShapeVerdict};

use crate::estimate::{BaseCounts, ParameterCounts, ShapeCounts, StandardCounts};
use crate::identification::Identification;
use crate::shape;

impl Identification {
    /// How many parameters there are, and how many the logs tell.
    pub fn counts(&self) -> ParameterCounts {
        let table = self.model.parameters();
        // The change of a shape parameter is a column of the fit, and counts as a shape parameter.
        let is_base = |k: &usize| shape::of_change(&table.linear[self.base.kept[*k]].name).is_none();
        let all = (0..self.base.len()).filter(is_base);
        let seen = |k: &usize| self.trust.base.get(*k).is_some_and(|a| a.verdict == Verdict::Seen);
        let base = BaseCounts {
            excited: self.fit().solution.kept.iter().filter(|k| is_base(k)).count(),
            seen: all.clone().filter(seen).count(),
            all: all.count(),
        };
        let parameters = self.robot_parameters();
        let of = |verdict: ParameterVerdict| parameters.iter().filter(|p| p.verdict == verdict).count();
        let shapes = self.robot_shapes();
        ParameterCounts {
            base,
            standard: StandardCounts {
                all: parameters.len(),
                seen: of(ParameterVerdict::SeenInData),
                not_identifiable: of(ParameterVerdict::NotIdentifiable),
                carried: of(ParameterVerdict::CarriedByPrior),
                given: of(ParameterVerdict::Given),
            },
            shape: ShapeCounts {
                all: shapes.len(),
                seen: shapes.iter().filter(|s| s.verdict == ShapeVerdict::SeenInData).count(),
            },
        }
    }
}
