//! Templates and the filters they print numbers with.

use minijinja::syntax::SyntaxConfig;
use minijinja::value::{Value, ValueKind};
use minijinja::{Environment, UndefinedBehavior};

use super::prose::{prose, sentence};
use super::words;
use crate::drawing::{interval_svg, meter_svg, pair_svg};
use crate::number::{self, UNDEFINED};

pub(super) const PAGE: &str = "page.html";
pub(super) const DESIGN_PAGE: &str = "design/page.html";
pub(super) const JOINTS_PAGE: &str = "joints/page.html";
pub(super) const LOG_PAGE: &str = "log/page.html";
pub(super) const STUDY_PAGE: &str = "study/page.html";

/// Every name ends in `.html`, which switches automatic escaping on.
const TEMPLATES: [(&str, &str); 34] = [
    ("shell.html", include_str!("../../template/shell.html")),
    (PAGE, include_str!("../../template/page.html")),
    ("macros.html", include_str!("../../template/macros.html")),
    ("verdict.html", include_str!("../../template/verdict.html")),
    ("warnings.html", include_str!("../../template/warnings.html")),
    ("cautions.html", include_str!("../../template/cautions.html")),
    ("first.html", include_str!("../../template/first.html")),
    ("picture.html", include_str!("../../template/picture.html")),
    ("trust.html", include_str!("../../template/trust.html")),
    ("files.html", include_str!("../../template/files.html")),
    ("consistency.html", include_str!("../../template/consistency.html")),
    ("precision.html", include_str!("../../template/precision.html")),
    ("searches.html", include_str!("../../template/searches.html")),
    ("essential.html", include_str!("../../template/essential.html")),
    ("system.html", include_str!("../../template/system.html")),
    ("quality.html", include_str!("../../template/quality.html")),
    ("effort.html", include_str!("../../template/effort.html")),
    ("parameters.html", include_str!("../../template/parameters.html")),
    ("friction.html", include_str!("../../template/friction.html")),
    ("conditioning.html", include_str!("../../template/conditioning.html")),
    (DESIGN_PAGE, include_str!("../../template/design/page.html")),
    ("design/trajectory.html", include_str!("../../template/design/trajectory.html")),
    ("design/intervals.html", include_str!("../../template/design/intervals.html")),
    ("design/forecast.html", include_str!("../../template/design/forecast.html")),
    ("design/parameters.html", include_str!("../../template/design/parameters.html")),
    ("design/limits.html", include_str!("../../template/design/limits.html")),
    ("design/motion.html", include_str!("../../template/design/motion.html")),
    ("design/paths.html", include_str!("../../template/design/paths.html")),
    ("design/starts.html", include_str!("../../template/design/starts.html")),
    (JOINTS_PAGE, include_str!("../../template/joints/page.html")),
    ("sections.html", include_str!("../../template/sections.html")),
    (LOG_PAGE, include_str!("../../template/log/page.html")),
    (STUDY_PAGE, include_str!("../../template/study/page.html")),
    ("provenance.html", include_str!("../../template/provenance.html")),
];

pub(super) fn environment() -> Result<Environment<'static>, minijinja::Error> {
    let mut environment = Environment::new();
    environment.set_undefined_behavior(UndefinedBehavior::SemiStrict);
    environment.set_syntax(SyntaxConfig::builder().trim_blocks(true).lstrip_blocks(true).build()?);
    for (name, source) in TEMPLATES {
        environment.add_template(name, source)?;
    }
    for (name, asset) in [
        ("style", include_str!("../../template/style.css")),
        ("plot_script", include_str!("../../template/plot.js")),
        ("robot_script", include_str!("../../template/robot.js")),
        ("table_script", include_str!("../../template/table.js")),
    ] {
        environment.add_global(name, Value::from_safe_string(asset.to_owned()));
    }
    environment.add_filter("number", |value: &Value| print(value, |v| number::significant(v, 4)));
    environment.add_filter("percent", |value: &Value, digits: usize| {
        print(value, |v| number::significant(v, digits))
    });
    environment
        .add_filter("fixed", |value: &Value, decimals: usize| print(value, |v| number::fixed(v, decimals)));
    environment.add_filter("milli", |value: &Value| print(value, |v| number::fixed(v * 1e3, 3)));
    environment.add_filter("count", |value: &Value| {
        u64::try_from(value.clone()).map_or_else(|_| UNDEFINED.to_owned(), number::count)
    });
    environment.add_filter("setting", setting);
    environment.add_filter("wordy", wordy);
    environment.add_filter("unit", |unit: &str| number::unit(unit));
    environment.add_filter("sort_key", sort_key);
    environment.add_filter("value_to_std", |value: &Value, std: &Value| beside_std(value, std).0);
    environment.add_filter("std_of", |std: &Value, value: &Value| beside_std(value, std).1);
    environment.add_filter("value_in_interval", value_in_interval);
    environment.add_filter("interval_ends", interval_ends);
    environment.add_filter("share", |value: &Value| print(value, number::share));
    environment.add_filter("prose", |text: &str| Value::from_safe_string(prose(text)));
    environment.add_filter("sentence", |text: &str| Value::from_safe_string(sentence(text)));
    environment.add_filter("interval", |value: &Value, half_width: &Value| {
        picture(real(value).zip(real(half_width)), |(value, half_width)| interval_svg(value, half_width))
    });
    environment.add_filter("meter", |value: &Value, full: f64, mark: &Value| {
        picture(real(value), |value| meter_svg(value, full, real(mark)))
    });
    environment.add_filter("pair", |upper: &Value, lower: &Value| {
        picture(real(upper).zip(real(lower)), |(upper, lower)| pair_svg(upper, lower))
    });
    words::add(&mut environment);
    Ok(environment)
}

/// The number, if it is one; integers count as numbers.
fn real(value: &Value) -> Option<f64> {
    if value.kind() == ValueKind::Number { f64::try_from(value.clone()).ok() } else { None }
}

fn print(value: &Value, form: impl Fn(f64) -> String) -> String {
    real(value).map_or_else(|| UNDEFINED.to_owned(), form)
}

/// A setting or fact of any kind.
fn setting(value: &Value) -> String {
    match value.kind() {
        ValueKind::Number if value.is_integer() => {
            u64::try_from(value.clone()).map_or_else(|_| value.to_string(), number::count)
        }
        ValueKind::Number => print(value, number::shortest),
        ValueKind::Bool => if value.is_true() { "yes" } else { "no" }.to_owned(),
        ValueKind::String => value.to_string(),
        _ => UNDEFINED.to_owned(),
    }
}

/// Columns of a table that hold sentences, which read from the left: every cell is text, one is longer than a number with
/// its error.
fn wordy(rows: &Value) -> Vec<usize> {
    let rows: Vec<Vec<Value>> = rows
        .try_iter()
        .into_iter()
        .flatten()
        .map(|row| row.try_iter().into_iter().flatten().collect())
        .collect();
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let cells = |column: usize| rows.iter().filter_map(move |row| row.get(column));
    let text = |cell: &Value| cell.as_str().map_or(0, |text| text.chars().count());
    let is_wordy = |column: &usize| {
        cells(*column).all(|c| c.kind() == ValueKind::String)
            && cells(*column).any(|c| text(c) > NUMBER_WITH_ERROR)
    };
    (0..columns).filter(is_wordy).collect()
}

/// Longest number with its error, characters.
const NUMBER_WITH_ERROR: usize = 24;

/// What a column is sorted by; empty where the number is undefined.
fn sort_key(value: &Value) -> String {
    real(value).filter(|v| v.is_finite()).map_or_else(String::new, |v| format!("{v:e}"))
}

fn picture<T>(numbers: Option<T>, draw: impl Fn(T) -> String) -> Value {
    Value::from_safe_string(numbers.map_or_else(String::new, draw))
}

fn ends(interval: &Value) -> Option<(f64, f64)> {
    let end = |index: usize| interval.get_item_by_index(index).ok().as_ref().and_then(real);
    Some((end(0)?, end(1)?))
}

/// The value to the place that the width of its interval asks for.
fn value_in_interval(value: &Value, interval: &Value) -> String {
    match (real(value), ends(interval)) {
        (Some(value), Some((low, high))) => number::with_std(value, 0.5 * (high - low)).0,
        _ => print(value, |v| number::significant(v, 4)),
    }
}

fn interval_ends(interval: &Value) -> String {
    ends(interval).map_or_else(
        || UNDEFINED.to_owned(),
        |(low, high)| {
            let (low, high) = number::interval(low, high);
            format!("{low} to {high}")
        },
    )
}

fn beside_std(value: &Value, std: &Value) -> (String, String) {
    match (real(value), real(std)) {
        (Some(value), Some(std)) => number::with_std(value, std),
        _ => (print(value, |v| number::significant(v, 4)), print(std, |v| number::significant(v, 2))),
    }
}
