//! A gravity compensator: a spring between a link and the body that carries it.

use std::f64::consts::PI;
use std::sync::{Arc, LazyLock};

use super::formula::{FormulaAtJoint, FormulaLaw, FormulaTerms};
use super::{JointElement, LinearTerm, ShapeSetting, ShapeTerm};

const LENGTH: [&str; 2] = ["m", "m"];

/// A coil or gas spring between a point at radius `br` on the link of a joint that turns and a point at distance `ba` from the axis on the body that
/// carries it:
///
/// ```text
/// (bf + bk L) ba br sin(q + bphi) / L,   L = √(ba² + br² - 2 ba br cos(q + bphi))
/// ```
///
/// `bf + bk L` is the force with which it pulls at the length `L`. Of a coil spring of rate `k`, free length `L0` and preload `F0`: `bk = k`,
/// `bf = F0 - k L0`; of a gas spring that pushes with `P - s L`: `bk = s`, `bf = -P`. `q + bphi` is the angle between the radii. The column of `bk` is
/// that of a pendulum: a motion tells it from first moments of the link only where gravity tilts against the joint.
pub(super) const LINEAR: [LinearTerm; 2] =
    [LinearTerm::new("bk", ["N/m", "N/m"]).at_least(0.0), LinearTerm::new("bf", ["N", "N"])];
/// Its geometry, known from drawings unless a setting frees it.
pub(super) const SHAPE: [ShapeTerm; 3] = [
    ShapeTerm::positive("ba", LENGTH, 0.02, 20.0).needed(),
    ShapeTerm::positive("br", LENGTH, 0.01, 10.0).needed(),
    ShapeTerm::signed("bphi", ["rad", "rad"], PI).needed(),
];

static LAW: LazyLock<Arc<FormulaLaw>> = LazyLock::new(|| {
    let moment = "ba * br * sin(q + bphi)";
    let formulas = [moment.to_owned(), format!("{moment} / sqrt(ba^2 + br^2 - 2 * ba * br * cos(q + bphi))")];
    let terms = FormulaTerms {
        columns: LINEAR.into_iter().zip(formulas).collect(),
        shape: SHAPE.to_vec(),
        is_friction: false,
    };
    match FormulaLaw::new(terms) {
        Ok(law) => Arc::new(law),
        Err(fault) => panic!("formulas of the balancer: {fault}"),
    }
});

/// The element at a joint.
///
/// Both radii enter alike, so the larger one is `ba`; were they equal, the spring could have no length.
pub(super) fn place(rate: usize, shape: &[ShapeSetting]) -> Result<Box<dyn JointElement>, String> {
    let range = |s: &ShapeSetting| if s.held { (s.start, s.start) } else { (s.lower, s.upper) };
    let (ground, link) = (&shape[0], &shape[1]);
    let ((least, _), (_, most)) = (range(ground), range(link));
    if most >= least {
        return Err(format!(
            "expected `br` below `ba` within all bounds (name the larger radius `ba`), found `br` up to {most} and `ba` from {least}"
        ));
    }
    if !ground.held && !link.held {
        return Err(
            "`ba` and `br` are both to be found, and efforts tell their ratio alone: state `ba`".to_owned()
        );
    }
    Ok(Box::new(FormulaAtJoint { rate, law: LAW.clone(), shape: shape.to_vec() }))
}
