//! Shape parameters of a recipe: as its logs found them, and the point about which the model is linear.

use dynid_estimate::separable::{self, ShapeFinding, ShapeVerdict, StartReport};
use dynid_model::{EffortModel, RobotModel};
use serde::{Deserialize, Serialize};

use super::ReductionError;
use crate::Error;
use crate::elements::ElementPlan;
use crate::shape::{self, ShapeFit};

/// Shape parameters and the point about which a model is linear.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Shapes {
    linear: Vec<f64>,
    shape: Vec<f64>,
    findings: Vec<Finding>,
}

/// What the logs of the recipe said of a shape parameter.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Finding {
    verdict: FindingVerdict,
    /// At its lower (`false`) or upper bound.
    at_upper_bound: Option<bool>,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum FindingVerdict {
    Seen,
    OneSided { lower: f64, upper: f64 },
    NotSeen,
    Held,
    NotJudged,
}

impl Shapes {
    pub(super) fn of(found: &ShapeFit) -> Self {
        let finding = |f: &ShapeFinding| Finding {
            verdict: match f.verdict {
                ShapeVerdict::Seen => FindingVerdict::Seen,
                ShapeVerdict::OneSided { lower, upper } => FindingVerdict::OneSided { lower, upper },
                ShapeVerdict::NotSeen => FindingVerdict::NotSeen,
                ShapeVerdict::Held => FindingVerdict::Held,
                ShapeVerdict::NotJudged => FindingVerdict::NotJudged,
            },
            at_upper_bound: f.at_bound.map(|bound| bound == separable::Bound::Upper),
        };
        Shapes {
            linear: found.linear.clone(),
            shape: found.model.parameters().shape_start(),
            findings: found.findings.iter().map(finding).collect(),
        }
    }

    /// The nonlinear model with these shapes, and the one that is linear about them.
    pub(super) fn fit(&self, plan: &ElementPlan, model: RobotModel) -> Result<(ShapeFit, RobotModel), Error> {
        let table = model.parameters();
        let shapes = table.shape.len();
        if self.shape.len() != shapes
            || self.findings.len() != shapes
            || self.linear.len() != table.linear.len()
        {
            let what = "shapes of another model".to_owned();
            return Err(ReductionError::Contradiction { what }.into());
        }
        let model = model.with_shape(&self.shape);
        let finding = |f: &Finding| ShapeFinding {
            verdict: match f.verdict {
                FindingVerdict::Seen => ShapeVerdict::Seen,
                FindingVerdict::OneSided { lower, upper } => ShapeVerdict::OneSided { lower, upper },
                FindingVerdict::NotSeen => ShapeVerdict::NotSeen,
                FindingVerdict::Held => ShapeVerdict::Held,
                FindingVerdict::NotJudged => ShapeVerdict::NotJudged,
            },
            profile: Vec::new(),
            at_bound: f
                .at_upper_bound
                .map(|upper| if upper { separable::Bound::Upper } else { separable::Bound::Lower }),
            limit: None,
        };
        let findings: Vec<ShapeFinding> = self.findings.iter().map(finding).collect();
        let starts = StartReport { outcomes: Vec::new(), reached: 0, distinct: 0 };
        let found = ShapeFit { model, linear: self.linear.clone(), findings, starts };
        let linearised = shape::linearised(plan, &found.model, &found.linear, &found.free())?;
        Ok((found, linearised))
    }
}
