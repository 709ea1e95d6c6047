//! Parameters of two models against each other.

use std::collections::BTreeMap;

use dynid_estimate::distribution::chi_squared_quantile;
use dynid_model::{BaseParameters, BaseSettings, EffortModel, RobotModel};
use dynid_record::{CarriedReason, ParameterVerdict, ShapeVerdict};
use serde::Serialize;

use crate::estimate::{BaseValue, Estimate};

/// Chance at which parameters that are the same are told to differ.
const LEVEL: f64 = 0.05;

/// A value that a model tells, with the half width of its 95 % interval; 0 where it is exact.
#[derive(Debug, Clone, Copy)]
struct Value {
    value: f64,
    half_width: f64,
}

/// A parameter of one model: its value, or why it tells none.
#[derive(Debug, Clone)]
struct Entry {
    unit: String,
    value: Result<Value, String>,
}

/// What one model tells of its parameters.
pub(super) struct Told {
    /// Standard and shape parameters in their order.
    single: Vec<(String, Entry)>,
    /// Combinations by what they are made of; the name of the parameter that stands for them.
    combined: Vec<(String, String, Entry)>,
    /// A parameter that is absent is not stated, rather than no part of the model.
    is_file: bool,
}

impl Told {
    pub(super) fn of_estimate(estimate: &Estimate) -> Self {
        let quantile = quantile(estimate);
        let single = estimate.parameters.iter().map(|p| {
            let seen = p.std.filter(|_| p.verdict == ParameterVerdict::SeenInData).zip(p.unconstrained);
            let value = seen.map(|(std, value)| Value { value, half_width: quantile * std });
            let why =
                p.reason.as_ref().map_or_else(|| p.verdict.to_string(), |r| format!("{}, {r}", p.verdict));
            (p.name.clone(), Entry { unit: p.unit.clone(), value: value.ok_or(why) })
        });
        let shapes = estimate.shape_parameters.iter().map(|s| {
            let seen = s.std.filter(|_| s.verdict == ShapeVerdict::SeenInData);
            let value = s.unconstrained.unwrap_or(s.value);
            let value = seen.map(|std| Value { value, half_width: quantile * std });
            (
                s.name.clone(),
                Entry { unit: s.unit.clone(), value: value.ok_or_else(|| s.verdict.to_string()) },
            )
        });
        let combined = estimate.base_parameters.iter().map(|b| {
            let value = b.value.zip(b.half_width);
            let value = value.map(|(value, half_width)| Value { value, half_width });
            let value = value.ok_or_else(|| CarriedReason::NotExcited.to_string());
            (b.expression.clone(), b.name.clone(), Entry { unit: b.unit.clone(), value })
        });
        Told { single: single.chain(shapes).collect(), combined: combined.collect(), is_file: false }
    }

    /// What a robot file states, its values combined as those of an estimate are. `model`: of the estimate.
    pub(super) fn of_file(stated: &BTreeMap<String, f64>, like: &Estimate, model: &RobotModel) -> Self {
        let exact = |value: f64| Value { value, half_width: 0.0 };
        let table = model.parameters();
        let entry = |name: &String, unit: &str| {
            let value = stated.get(name).map(|x| exact(*x)).ok_or_else(|| "not stated".to_owned());
            (name.clone(), Entry { unit: unit.to_owned(), value })
        };
        let linear = table.linear.iter().map(|p| entry(&p.name, p.unit));
        let shapes = table.shape.iter().map(|s| entry(&s.name, s.unit));
        let single = linear.chain(shapes).collect();
        Told { single, combined: combinations(stated, like, model), is_file: true }
    }
}

/// Combinations of a robot file's values, those of an estimate of which the file states every part.
fn combinations(
    stated: &BTreeMap<String, f64>,
    like: &Estimate,
    model: &RobotModel,
) -> Vec<(String, String, Entry)> {
    let table = model.parameters();
    let preferred = like.base_parameters.iter().filter_map(|b| table.column(&b.name)).collect();
    let settings = BaseSettings { preferred, ..BaseSettings::default() };
    let base = BaseParameters::of_model(model, &table.shape_start(), &settings);
    let values: Vec<Option<f64>> = table.linear.iter().map(|p| stated.get(&p.name).copied()).collect();
    let known: Vec<f64> = values.iter().map(|x| x.unwrap_or(0.0)).collect();
    let (matrix, columns) = (base.matrix(), table.linear.len());
    let all = base.kept.iter().zip(base.expressions(table)).zip(base.values(&known)).enumerate();
    all.filter_map(|(row, ((kept, expression), value))| {
        let parts = &matrix[row * columns..(row + 1) * columns];
        let whole = parts.iter().zip(&values).all(|(factor, value)| *factor == 0.0 || value.is_some());
        let of_estimate = |b: &&BaseValue| b.expression == expression;
        let unit = like.base_parameters.iter().find(of_estimate)?.unit.clone();
        let value = Ok(Value { value, half_width: 0.0 });
        whole.then(|| (expression, table.linear[*kept].name.clone(), Entry { unit, value }))
    })
    .collect()
}

/// Half width of a 95 % interval of an estimate in standard deviations.
fn quantile(estimate: &Estimate) -> f64 {
    let ratio = |b: &BaseValue| b.half_width.zip(b.std).filter(|(_, s)| *s > 0.0).map(|(h, s)| h / s);
    let known = estimate.base_parameters.iter().find_map(ratio);
    known.or_else(|| deviations(LEVEL)).unwrap_or(f64::INFINITY)
}

/// A parameter, or a combination of some, that both models tell.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct ParameterDiff {
    /// Name of a parameter; of a combination that of the parameter that stands for it.
    pub name: String,
    /// What a combination is made of, in symbols; absent for a single parameter.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub expression: Option<String>,
    /// Unit.
    pub unit: String,
    /// Value of the first model, without constraints.
    pub a: f64,
    /// Value of the second model, without constraints.
    pub b: f64,
    /// `b - a`.
    pub difference: f64,
    /// Half width of the 95 % interval of the difference.
    pub half_width: f64,
    /// `|b - a|` over the half width.
    pub ratio: Option<f64>,
    /// The difference is beyond its 95 % interval, as happens by chance to one of twenty.
    pub beyond_interval: bool,
    /// The difference is beyond what chance makes of all compared ones together, in one of twenty comparisons.
    pub differs: bool,
}

/// Outcome of a comparison of parameters.
#[derive(Debug, Clone, Default)]
pub(super) struct Compared {
    /// Parameters and combinations that both tell, in the order of the first model.
    pub(super) parameters: Vec<ParameterDiff>,
    /// Parameters that cannot be compared, with the reason.
    pub(super) not_compared: Vec<(String, String)>,
    /// Parameters that only the first model has.
    pub(super) only_in_a: Vec<String>,
    /// Parameters that only the second model has.
    pub(super) only_in_b: Vec<String>,
}

pub(super) fn compare(a: &Told, b: &Told) -> Compared {
    let mut out = Compared::default();
    for (name, of_a) in &a.single {
        match (b.single.iter().find(|(other, _)| other == name), &of_a.value) {
            (None, _) if b.is_file => out.not_compared.push((name.clone(), "not stated".to_owned())),
            (None, _) if a.is_file => {}
            (None, _) => out.only_in_a.push(name.clone()),
            (Some((_, of_b)), _) => match (&of_a.value, &of_b.value) {
                (Ok(x), Ok(y)) => out.parameters.push(pair(name, None, &of_a.unit, *x, *y)),
                (Err(why), _) | (_, Err(why)) => out.not_compared.push((name.clone(), why.clone())),
            },
        }
    }
    if !(a.is_file || b.is_file) {
        let missing = |(name, _): &&(String, Entry)| a.single.iter().all(|(other, _)| other != name);
        out.only_in_b = b.single.iter().filter(missing).map(|(name, _)| name.clone()).collect();
    }
    for (expression, name, of_a) in &a.combined {
        let single = out.parameters.iter().any(|p| p.name == *name && p.expression.is_none());
        let other = b.combined.iter().find(|(other, ..)| other == expression);
        if let (false, Some((.., of_b)), Ok(x)) = (single, other, &of_a.value)
            && let Ok(y) = &of_b.value
        {
            out.parameters.push(pair(name, Some(expression), &of_a.unit, *x, *y));
        }
    }
    let limit = limit_of_all(out.parameters.len());
    for p in &mut out.parameters {
        p.differs = p.beyond_interval && p.ratio.is_none_or(|ratio| ratio > limit);
    }
    out
}

fn pair(name: &str, expression: Option<&String>, unit: &str, a: Value, b: Value) -> ParameterDiff {
    let (difference, half_width) = (b.value - a.value, a.half_width.hypot(b.half_width));
    ParameterDiff {
        name: name.to_owned(),
        expression: expression.cloned(),
        unit: unit.to_owned(),
        a: a.value,
        b: b.value,
        difference,
        half_width,
        ratio: (half_width > 0.0).then(|| difference.abs() / half_width),
        beyond_interval: difference.abs() > half_width,
        differs: false,
    }
}

/// Half widths of a 95 % interval that chance keeps within for all of so many comparisons, in 95 of 100 cases (Bonferroni).
fn limit_of_all(count: usize) -> f64 {
    let of_all = deviations(LEVEL / count.max(1) as f64);
    of_all.zip(deviations(LEVEL)).map_or(f64::INFINITY, |(all, one)| all / one)
}

/// Standard deviations beyond which a normal variable lies, on either side, at a level.
fn deviations(level: f64) -> Option<f64> {
    chi_squared_quantile(1.0 - level, 1.0).map(f64::sqrt)
}
