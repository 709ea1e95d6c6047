//! The robot alone: what was identified, laid out without what belongs to single logs.

use dynid_model::{EffortModel, Parameter, RobotModel, ShapeParameter};

use crate::Error;
use crate::identification::Identification;

impl Identification {
    /// The identified model without what belongs to single logs; `None` if nothing does.
    pub(super) fn without_logs(&self) -> Result<Option<(RobotModel, Vec<f64>)>, Error> {
        if self.plan.log_terms.is_empty() {
            return Ok(None);
        }
        let (model, values) = self.identified_model();
        let alone = self.plan.without_logs().model(self.model.mechanism())?;
        let (from, to) = (model.parameters(), alone.parameters());
        let value = |p: &Parameter| from.column(&p.name).map_or(0.0, |c| values[c]);
        let linear = to.linear.iter().map(value).collect();
        let start = |s: &ShapeParameter| from.shape_value(&s.name).unwrap_or(s.start);
        let shape: Vec<f64> = to.shape.iter().map(start).collect();
        Ok(Some((alone.with_shape(&shape), linear)))
    }

    /// The robot alone and its linear parameters: [`Identification::identified_model`] without what belongs to single logs.
    pub fn robot_alone(&self) -> (&RobotModel, &[f64]) {
        self.alone.as_ref().map_or_else(|| self.identified_model(), |(model, values)| (model, values))
    }
}
