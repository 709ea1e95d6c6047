//! The starts of the search.

use serde::Serialize;

use crate::data::{DesignReport, Starts};
use crate::drawing::{StripDot, strip_svg};

#[derive(Debug, Serialize)]
pub(super) struct StartsView {
    asked: Option<u64>,
    ran: usize,
    /// Starts that ended within all limits with a criterion.
    ended: usize,
    /// Starts that ended within 5 % of the best; `None` if it is not known what that is.
    near: Option<usize>,
    best_seed: Option<u64>,
    best: Option<f64>,
    median: Option<f64>,
    worst: Option<f64>,
    evaluations: Option<u64>,
    seed: Option<u64>,
    cut_short: bool,
    picture: String,
}

pub(super) fn starts(data: &DesignReport) -> StartsView {
    let starts = &data.starts;
    let mut ended: Vec<(f64, u64)> = starts
        .outcomes
        .iter()
        .filter(|s| s.feasible)
        .filter_map(|s| Some((s.criterion.filter(|c| c.is_finite())?, s.seed)))
        .collect();
    ended.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let best_seed = ended.first().map(|(_, seed)| *seed);
    let dots: Vec<StripDot> =
        ended.iter().map(|&(value, seed)| StripDot { seed, value, best: Some(seed) == best_seed }).collect();
    StartsView {
        asked: starts.asked,
        ran: starts.outcomes.len(),
        ended: ended.len(),
        near: starts.near_best.map(|limit| ended.iter().filter(|(c, _)| *c <= limit).count()),
        best_seed,
        best: ended.first().map(|(c, _)| *c),
        median: median(&ended),
        worst: ended.last().map(|(c, _)| *c),
        evaluations: data.evaluations,
        seed: data.seed,
        cut_short: cut_short(starts),
        picture: strip_svg("Criterion at the end of each start", &dots, starts.near_best),
    }
}

/// Fewer starts ran than were asked for.
pub(super) fn cut_short(starts: &Starts) -> bool {
    starts.asked.is_some_and(|asked| asked > starts.outcomes.len() as u64)
}

fn median(sorted: &[(f64, u64)]) -> Option<f64> {
    let at = |k: usize| sorted.get(k).map(|(c, _)| *c);
    let middle = sorted.len() / 2;
    if sorted.len() % 2 == 1 { at(middle) } else { Some(0.5 * (at(middle.checked_sub(1)?)? + at(middle)?)) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::DesignStart;

    #[test]
    fn only_feasible_starts_are_ranked() {
        let start = |seed, criterion, feasible| DesignStart { seed, criterion, feasible };
        let data = DesignReport {
            starts: Starts {
                asked: Some(6),
                near_best: Some(31.5),
                outcomes: vec![
                    start(1, Some(29.0), false),
                    start(2, Some(31.0), true),
                    start(3, Some(30.0), true),
                    start(4, None, true),
                    start(5, Some(34.0), true),
                ],
            },
            ..DesignReport::default()
        };
        let view = starts(&data);
        assert_eq!((view.ran, view.ended, view.near), (5, 3, Some(2)));
        assert_eq!((view.best, view.best_seed), (Some(30.0), Some(3)));
        assert_eq!((view.median, view.worst), (Some(31.0), Some(34.0)));
        assert!(view.cut_short);
        assert_eq!(median(&[]), None);
        assert_eq!(median(&[(1.0, 0), (2.0, 1)]), Some(1.5));
    }
}
