//! What the templates of a design's page see.

mod checks;
mod limits;
mod motion;
mod paths;
mod starts;

pub(super) use checks::check;
use minijinja::context;
use minijinja::value::{Serde, Value};
use serde::Serialize;

use super::picture::picture;
use crate::data::{DesignParameter, DesignQuality, DesignReport, Fact, IntervalForecast, RandomMotion};
use crate::error::ReportError;

/// Relative standard deviation above which a parameter is marked, %.
const WEAK_PERCENT: f64 = 30.0;

pub(super) fn context(data: &DesignReport) -> Result<Value, ReportError> {
    let parameters: Vec<ParameterView<'_>> = data.parameters.iter().map(parameter).collect();
    Ok(context! {
        title => data.title.as_str(),
        verdict => Serde(&data.verdict),
        warnings => Serde(&data.warnings),
        robot => Serde(&data.robot),
        joints => data.joints.len(),
        criterion => data.criterion.as_str(),
        criterion_meaning => data.criterion_meaning.as_str(),
        facts => Serde(facts(data)),
        quality => Serde(quality(&data.quality)),
        random => Serde(&data.random),
        comparison => Serde(data.random.as_ref().map(|random| comparison(&data.quality, random))),
        weak => parameters.iter().filter(|p| p.weak).count(),
        weak_percent => WEAK_PERCENT,
        wanted => Serde(data.intervals.iter().filter(|i| i.wanted.is_some()).map(interval).collect::<Vec<_>>()),
        others => Serde(data.intervals.iter().filter(|i| i.wanted.is_none()).map(interval).collect::<Vec<_>>()),
        has_motion => data.trajectory.is_some() || !data.limits.is_empty() || data.intervals.is_empty(),
        parameters => Serde(parameters),
        confounded => Serde(&data.confounded),
        seen_least => Serde(&data.seen_least),
        picture => Serde(data.picture.as_ref().map(picture).transpose()?.flatten()),
        acting => data.limits.iter().filter(|l| l.acts).count(),
        limit_count => data.limits.len(),
        limits => Serde(limits::limits(data)),
        motion => Serde(motion::motion(data)?),
        paths => Serde(paths::paths(data)),
        starts => Serde(starts::starts(data)),
        repeatable => !starts::cut_short(&data.starts),
        provenance => Serde(&data.provenance),
    })
}

fn facts(data: &DesignReport) -> Vec<Fact> {
    let mut facts = vec![
        Fact::new("Period", data.period_s, "s"),
        Fact::new("Harmonics", data.harmonics, ""),
        Fact::new("Periods recorded", data.periods_recorded, ""),
        Fact::new("Approach", data.approach_s, "s"),
        Fact::new("Return", data.return_s, "s"),
        Fact::new("Sample rate", data.sample_rate_hz, "Hz"),
    ];
    facts.extend(data.facts.iter().cloned());
    facts.extend(data.robot.facts.iter().cloned());
    facts
}

fn quality(quality: &DesignQuality) -> Vec<Fact> {
    let rounded = |value: Option<f64>| value.map(|v| crate::number::significant(v, 4));
    let fact = |name: &str, value| Fact::new(name, rounded(value).unwrap_or_else(|| "-".to_owned()), "");
    vec![
        fact("Criterion, exact", quality.criterion_exact),
        fact("Criterion on the search grid", quality.criterion_search),
        fact("Condition number, columns in SI units", quality.condition),
        fact("Condition number, columns of unit length", quality.condition_unit_norm),
        fact("Largest singular value σ₁", quality.sigma_largest),
        fact("Smallest singular value σₚ", quality.sigma_smallest),
    ]
}

/// One measure of random motion and of the design.
#[derive(Debug, Serialize)]
struct Comparison {
    name: &'static str,
    random: Option<f64>,
    designed: Option<f64>,
}

fn comparison(quality: &DesignQuality, random: &RandomMotion) -> [Comparison; 3] {
    let ratio = |name, random: Option<f64>| Comparison { name, random, designed: random.map(|_| 1.0) };
    [
        ratio("Standard deviations, arithmetic mean of ratios", random.mean_ratio),
        ratio("Standard deviations, geometric mean of ratios", random.geometric_ratio),
        Comparison {
            name: "Condition number, columns in SI units",
            random: random.condition,
            designed: quality.condition,
        },
    ]
}

/// An interval with its half widths in units of what is wanted, of others in units of today's.
#[derive(Debug, Serialize)]
struct IntervalView<'a> {
    #[serde(flatten)]
    interval: &'a IntervalForecast,
    before_share: Option<f64>,
    after_share: Option<f64>,
}

fn interval(interval: &IntervalForecast) -> IntervalView<'_> {
    let unit = interval.wanted.or(interval.before);
    let share = |width: Option<f64>| Some(width? / unit?).filter(|x| x.is_finite());
    IntervalView { interval, before_share: share(interval.before), after_share: share(interval.after) }
}

#[derive(Debug, Serialize)]
struct ParameterView<'a> {
    #[serde(flatten)]
    parameter: &'a DesignParameter,
    /// Relative standard deviation above [`WEAK_PERCENT`].
    weak: bool,
}

fn parameter(parameter: &DesignParameter) -> ParameterView<'_> {
    ParameterView { parameter, weak: parameter.relative_std_percent.is_some_and(|p| p > WEAK_PERCENT) }
}
