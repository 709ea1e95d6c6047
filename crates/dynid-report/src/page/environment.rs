//! Templates and the filters they print numbers with.

use minijinja::syntax::SyntaxConfig;
use minijinja::value::{Value, ValueKind};
use minijinja::{Environment, UndefinedBehavior};

use crate::drawing::interval_svg;
use crate::number::{self, UNDEFINED};

pub(super) const PAGE: &str = "page.html";

/// Every name ends in `.html`, which switches automatic escaping on.
const TEMPLATES: [(&str, &str); 9] = [
    (PAGE, include_str!("../../template/page.html")),
    ("macros.html", include_str!("../../template/macros.html")),
    ("verdict.html", include_str!("../../template/verdict.html")),
    ("system.html", include_str!("../../template/system.html")),
    ("quality.html", include_str!("../../template/quality.html")),
    ("effort.html", include_str!("../../template/effort.html")),
    ("parameters.html", include_str!("../../template/parameters.html")),
    ("conditioning.html", include_str!("../../template/conditioning.html")),
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
    environment.add_filter("unit", |unit: &str| number::unit(unit));
    environment.add_filter("sort_key", sort_key);
    environment.add_filter("value_to_std", |value: &Value, std: &Value| beside_std(value, std).0);
    environment.add_filter("std_of", |std: &Value, value: &Value| beside_std(value, std).1);
    environment.add_filter("interval", |value: &Value, std: &Value| {
        Value::from_safe_string(match (real(value), real(std)) {
            (Some(value), Some(std)) => interval_svg(value, std),
            _ => String::new(),
        })
    });
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

/// What a column is sorted by; empty where the number is undefined.
fn sort_key(value: &Value) -> String {
    real(value).filter(|v| v.is_finite()).map_or_else(String::new, |v| format!("{v:e}"))
}

fn beside_std(value: &Value, std: &Value) -> (String, String) {
    match (real(value), real(std)) {
        (Some(value), Some(std)) => number::with_std(value, std),
        _ => (print(value, |v| number::significant(v, 4)), print(std, |v| number::significant(v, 2))),
    }
}
