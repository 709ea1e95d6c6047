//! Pictures of a backward elimination.

use serde::Serialize;

use crate::data::{Pruning, PruningStep};
use crate::drawing::{PathMarks, PathPoint, ceiling, fewest, path_svg};

#[derive(Debug, Serialize)]
pub(super) struct PruningView<'a> {
    #[serde(flatten)]
    pruning: &'a Pruning,
    /// Parameters of the whole model.
    whole: u64,
    /// Number of parameters of the model of least held-out error.
    least_held_out: Option<u64>,
    /// The whole model's held-out error is more than a standard error above the least.
    whole_follows_noise: bool,
    /// Least number of parameters drawn.
    fewest: Option<u64>,
    held_out_picture: String,
    bic_picture: String,
}

pub(super) fn pruning(pruning: &Pruning) -> PruningView<'_> {
    let held_out = points(pruning, |s| Some((s.held_out?, s.held_out_standard_error.unwrap_or(0.0))));
    let bic = points(pruning, |s| Some((s.bic?, 0.0)));
    // One axis for both pictures: that of the held-out error, where there is one.
    let decisive = if held_out.is_empty() { &bic } else { &held_out };
    let fewest = ceiling(decisive).and_then(|top| fewest(decisive, top));
    let least = held_out.iter().min_by(|a, b| a.loss.total_cmp(&b.loss));
    let level = least.map(|p| p.loss + p.standard_error);
    let whole = held_out.iter().max_by_key(|p| p.parameters);
    let picture = |label: &str, points: &[PathPoint], marks: PathMarks| match (fewest, ceiling(points)) {
        (Some(fewest), Some(top)) => path_svg(label, points, fewest, top, marks),
        _ => String::new(),
    };
    PruningView {
        pruning,
        whole: pruning.path.iter().map(|s| s.parameters).max().unwrap_or(0),
        least_held_out: least.map(|p| p.parameters),
        whole_follows_noise: whole.zip(level).is_some_and(|(w, level)| w.loss > level),
        fewest,
        held_out_picture: picture(
            "Held-out error over the number of parameters",
            &held_out,
            PathMarks { chosen: pruning.essential, level },
        ),
        bic_picture: picture(
            "BIC over the number of parameters",
            &bic,
            PathMarks { chosen: pruning.least_bic, level: None },
        ),
    }
}

fn points(pruning: &Pruning, loss: impl Fn(&PruningStep) -> Option<(f64, f64)>) -> Vec<PathPoint> {
    let point = |s: &PruningStep| {
        let (loss, standard_error) = loss(s)?;
        (loss.is_finite() && standard_error.is_finite()).then_some(PathPoint {
            parameters: s.parameters,
            loss,
            standard_error,
        })
    };
    pruning.path.iter().filter_map(point).collect()
}
