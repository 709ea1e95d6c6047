//! Functions and methods that expressions may call, as Python has them.

use std::f64::consts::{E, PI, TAU};

use super::names::{Failure, Names};
use super::value::{MAX_LIST, Value, bounded_list, bounded_text, entries};
use crate::xacro_fault::XacroFault;

/// Functions of one number.
type OfOne = fn(f64) -> f64;

const OF_ONE: [(&str, OfOne); 20] = [
    ("acos", f64::acos),
    ("acosh", f64::acosh),
    ("asin", f64::asin),
    ("asinh", f64::asinh),
    ("atan", f64::atan),
    ("atanh", f64::atanh),
    ("cbrt", f64::cbrt),
    ("cos", f64::cos),
    ("cosh", f64::cosh),
    ("degrees", |x| x * (180.0 / PI)),
    ("exp", f64::exp),
    ("expm1", f64::exp_m1),
    ("fabs", f64::abs),
    ("log10", f64::log10),
    ("log1p", f64::ln_1p),
    ("log2", f64::log2),
    ("radians", |x| x * (PI / 180.0)),
    ("sin", f64::sin),
    ("sinh", f64::sinh),
    ("sqrt", f64::sqrt),
];

const OTHERS: [&str; 37] = [
    "abs",
    "abs_filename",
    "all",
    "any",
    "arg",
    "atan2",
    "bool",
    "ceil",
    "copysign",
    "dict",
    "dotify",
    "enumerate",
    "error",
    "fatal",
    "float",
    "floor",
    "fmod",
    "hypot",
    "int",
    "len",
    "list",
    "load_yaml",
    "log",
    "max",
    "message",
    "min",
    "pow",
    "range",
    "round",
    "sorted",
    "str",
    "sum",
    "tan",
    "tanh",
    "trunc",
    "tuple",
    "warning",
];

/// What a name stands for where no property has it.
pub(super) fn global(name: &str) -> Option<Value> {
    let function = OF_ONE.iter().map(|(own, _)| own).chain(&OTHERS).find(|own| **own == name);
    Some(match (name, function) {
        ("True" | "true", _) => Value::Bool(true),
        ("False" | "false", _) => Value::Bool(false),
        ("None", _) => Value::None,
        ("pi", _) => Value::Float(PI),
        ("e", _) => Value::Float(E),
        ("tau", _) => Value::Float(TAU),
        ("inf", _) => Value::Float(f64::INFINITY),
        ("nan", _) => Value::Float(f64::NAN),
        ("math" | "python" | "xacro", _) => Value::Library,
        (_, Some(function)) => Value::Function(function),
        _ => return None,
    })
}

fn number(value: &Value) -> Result<f64, String> {
    value.number().ok_or_else(|| format!("expected a number, found a {}", value.kind()))
}

fn whole(value: &Value) -> Result<i64, String> {
    value.whole().ok_or_else(|| format!("expected a whole number, found a {}", value.kind()))
}

/// Rounds to a whole number, which must fit 64 bits.
fn rounded(x: f64) -> Result<Value, String> {
    // Bounds are powers of two, so the comparison is exact.
    match x.abs() < 9.2e18 {
        true => Ok(Value::Int(x as i64)),
        false => Err(format!("expected a whole number of 64 bits, found {x}")),
    }
}

pub(super) fn call<N: Names>(name: &str, values: &[Value], names: &mut N) -> Result<Value, Failure> {
    if let Some((_, function)) = OF_ONE.iter().find(|(own, _)| *own == name) {
        let [value] = values else { return Err(count(name, 1, values).into()) };
        let x = number(value)?;
        let y = function(x);
        return match y.is_nan() && !x.is_nan() {
            true => Err(format!("`{name}` has no value at {x}").into()),
            false => Ok(Value::Float(y)),
        };
    }
    match (name, values) {
        ("arg", [name]) => Ok(names.argument(&name.to_string())?),
        ("load_yaml", [file]) => Ok(names.yaml(&file.to_string())?),
        ("abs_filename", [file]) => Ok(Value::text(names.path(&file.to_string()))),
        ("message" | "warning" | "error", _) => Ok(Value::text("")),
        ("fatal", _) => {
            let words: Vec<String> = values.iter().map(ToString::to_string).collect();
            Err(XacroFault::Expression { text: "xacro.fatal".to_owned(), reason: words.join(" ") }.into())
        }
        _ => Ok(plain(name, values)?),
    }
}

fn count(name: &str, expected: usize, values: &[Value]) -> String {
    format!("`{name}` takes {expected} values, found {}", values.len())
}

/// Functions of their values alone.
fn plain(name: &str, values: &[Value]) -> Result<Value, String> {
    Ok(match (name, values) {
        ("atan2", [y, x]) => Value::Float(number(y)?.atan2(number(x)?)),
        ("copysign", [x, y]) => Value::Float(number(x)?.copysign(number(y)?)),
        ("fmod", [x, y]) => Value::Float(number(x)? % number(y)?),
        ("hypot", values) => {
            let squares = values.iter().map(|x| number(x).map(|x| x * x)).sum::<Result<f64, String>>()?;
            match values {
                [x, y] => Value::Float(number(x)?.hypot(number(y)?)),
                _ => Value::Float(squares.sqrt()),
            }
        }
        ("pow", [x, y]) => Value::Float(number(x)?.powf(number(y)?)),
        ("tan", [x]) => Value::Float(number(x)?.tan()),
        ("tanh", [x]) => Value::Float(number(x)?.tanh()),
        ("log", [x]) => Value::Float(logarithm(number(x)?)?),
        ("log", [x, base]) => Value::Float(logarithm(number(x)?)? / logarithm(number(base)?)?),
        ("ceil", [x]) => rounded(number(x)?.ceil())?,
        ("floor", [x]) => rounded(number(x)?.floor())?,
        ("trunc", [x]) => rounded(number(x)?.trunc())?,
        ("abs", [x]) => match x.whole() {
            Some(n) => Value::Int(n.checked_abs().ok_or("expected a whole number of 64 bits")?),
            None => Value::Float(number(x)?.abs()),
        },
        ("round", [x]) => match x.whole() {
            Some(n) => Value::Int(n),
            None => rounded(number(x)?.round_ties_even())?,
        },
        ("round", [x, digits]) => {
            let digits =
                usize::try_from(whole(digits)?).map_err(|_| "expected digits behind the point")?.min(300);
            match x.whole() {
                Some(n) => Value::Int(n),
                // Decimal digits of the exact number, as Python rounds.
                None => {
                    let x = number(x)?;
                    Value::Float(format!("{x:.digits$}").parse().unwrap_or(x))
                }
            }
        }
        ("bool", [value]) => Value::Bool(value.is_true()),
        ("str", [value]) => bounded_text(value.to_string())?,
        ("float", [Value::Text(text)]) => match text.trim().parse() {
            Ok(x) => Value::Float(x),
            Err(_) => return Err(format!("expected a number, found `{text}`")),
        },
        ("float", [value]) => Value::Float(number(value)?),
        ("int", [Value::Text(text)]) => match text.trim().parse() {
            Ok(n) => Value::Int(n),
            Err(_) => return Err(format!("expected a whole number, found `{text}`")),
        },
        ("int", [value]) => match value.whole() {
            Some(n) => Value::Int(n),
            None => rounded(number(value)?.trunc())?,
        },
        ("len", [Value::Text(text)]) => Value::Int(text.chars().count() as i64),
        ("len", [value]) => Value::Int(entries(value)?.len() as i64),
        ("list" | "tuple", []) => Value::list(Vec::new()),
        ("list" | "tuple", [value]) => Value::list(entries(value)?),
        ("dict" | "dotify", [map @ Value::Map(_)]) => map.clone(),
        ("range", values) => range(values)?,
        ("sum", [value]) => {
            let entries = entries(value)?;
            match entries.iter().map(Value::whole).collect::<Option<Vec<i64>>>() {
                Some(all) => Value::Int(
                    all.iter().try_fold(0_i64, |a, b| a.checked_add(*b)).ok_or("a sum beyond 64 bits")?,
                ),
                None => Value::Float(entries.iter().map(number).sum::<Result<f64, String>>()?),
            }
        }
        ("all", [value]) => Value::Bool(entries(value)?.iter().all(Value::is_true)),
        ("any", [value]) => Value::Bool(entries(value)?.iter().any(Value::is_true)),
        ("enumerate", [value]) => {
            let entries = entries(value)?.into_iter().enumerate();
            Value::list(entries.map(|(k, entry)| Value::list(vec![Value::Int(k as i64), entry])).collect())
        }
        ("sorted", [value]) => {
            let mut entries = entries(value)?;
            let ordered = entries.iter().zip(entries.iter().skip(1)).all(|(a, b)| a.order(b).is_some());
            if !ordered {
                return Err("expected values that have an order".to_owned());
            }
            entries.sort_by(|a, b| a.order(b).unwrap_or(std::cmp::Ordering::Equal));
            Value::list(entries)
        }
        ("min", [list]) => extreme(name, &entries(list)?, true)?,
        ("max", [list]) => extreme(name, &entries(list)?, false)?,
        ("min", values) => extreme(name, values, true)?,
        ("max", values) => extreme(name, values, false)?,
        _ => return Err(format!("`{name}` does not take {} such values", values.len())),
    })
}

fn logarithm(x: f64) -> Result<f64, String> {
    if x > 0.0 { Ok(x.ln()) } else { Err(format!("`log` has no value at {x}")) }
}

fn range(values: &[Value]) -> Result<Value, String> {
    let (start, end, step) = match values {
        [end] => (0, whole(end)?, 1),
        [start, end] => (whole(start)?, whole(end)?, 1),
        [start, end, step] => (whole(start)?, whole(end)?, whole(step)?),
        _ => return Err("`range` takes one to three values".to_owned()),
    };
    if step == 0 {
        return Err("expected a step that is not zero".to_owned());
    }
    let next = |n: &i64| n.checked_add(step);
    let all =
        std::iter::successors(Some(start), next).take_while(|n| if step > 0 { *n < end } else { *n > end });
    bounded_list(all.take(MAX_LIST + 1).map(Value::Int))
}

fn extreme(name: &str, values: &[Value], least: bool) -> Result<Value, String> {
    let (first, others) = values.split_first().ok_or_else(|| format!("`{name}` of no values"))?;
    let mut best = first;
    for value in others {
        let order = value.order(best).ok_or_else(|| format!("`{name}` of values without an order"))?;
        if if least { order.is_lt() } else { order.is_gt() } {
            best = value;
        }
    }
    Ok(best.clone())
}

const OF_TEXT: [&str; 15] = [
    "capitalize",
    "count",
    "endswith",
    "find",
    "isdigit",
    "join",
    "lower",
    "lstrip",
    "replace",
    "rstrip",
    "split",
    "startswith",
    "strip",
    "title",
    "upper",
];
const OF_MAP: [&str; 4] = ["get", "items", "keys", "values"];
const OF_LIST: [&str; 2] = ["count", "index"];

pub(super) fn is_method(of: &Value, name: &str) -> bool {
    match of {
        Value::Text(_) => OF_TEXT.contains(&name),
        Value::Map(_) => OF_MAP.contains(&name),
        Value::List(_) => OF_LIST.contains(&name),
        _ => false,
    }
}

pub(super) fn call_method(of: &Value, name: &str, values: &[Value]) -> Result<Value, String> {
    Ok(match (of, name, values) {
        (Value::Map(_), "get", [key]) => of.entry(key).cloned().unwrap_or(Value::None),
        (Value::Map(_), "get", [key, otherwise]) => of.entry(key).unwrap_or(otherwise).clone(),
        (Value::Map(map), "items", []) => {
            Value::list(map.iter().map(|(k, v)| Value::list(vec![k.clone(), v.clone()])).collect())
        }
        (Value::Map(map), "keys", []) => Value::list(map.iter().map(|(k, _)| k.clone()).collect()),
        (Value::Map(map), "values", []) => Value::list(map.iter().map(|(_, v)| v.clone()).collect()),
        (Value::List(list), "count", [value]) => {
            Value::Int(list.iter().filter(|entry| entry.equals(value)).count() as i64)
        }
        (Value::List(list), "index", [value]) => match list.iter().position(|entry| entry.equals(value)) {
            Some(place) => Value::Int(place as i64),
            None => return Err(format!("the list has no entry `{value}`")),
        },
        (Value::Text(text), _, _) => return of_text(text, name, values),
        _ => return Err(format!("`{name}` does not take {} values", values.len())),
    })
}

fn of_text(text: &str, name: &str, values: &[Value]) -> Result<Value, String> {
    let set = |values: &[Value]| match values {
        [] => Ok(None),
        [Value::Text(set)] => Ok(Some(set.to_string())),
        _ => Err(format!("`{name}` takes a text")),
    };
    let is_of = |set: &Option<String>, c: char| set.as_ref().map_or(c.is_whitespace(), |set| set.contains(c));
    Ok(match (name, values) {
        ("lower", []) => Value::text(text.to_lowercase()),
        ("upper", []) => Value::text(text.to_uppercase()),
        ("capitalize", []) => {
            let mut rest = text.chars();
            let first: String = rest.next().into_iter().flat_map(char::to_uppercase).collect();
            Value::text(first + &rest.as_str().to_lowercase())
        }
        ("title", []) => {
            let mut inside = false;
            let mut own = String::new();
            for c in text.chars() {
                match inside {
                    true => own.extend(c.to_lowercase()),
                    false => own.extend(c.to_uppercase()),
                }
                inside = c.is_alphabetic();
            }
            Value::text(own)
        }
        ("isdigit", []) => Value::Bool(!text.is_empty() && text.chars().all(|c| c.is_ascii_digit())),
        ("strip", values) => {
            let set = set(values)?;
            Value::text(text.trim_matches(|c| is_of(&set, c)))
        }
        ("lstrip", values) => {
            let set = set(values)?;
            Value::text(text.trim_start_matches(|c| is_of(&set, c)))
        }
        ("rstrip", values) => {
            let set = set(values)?;
            Value::text(text.trim_end_matches(|c| is_of(&set, c)))
        }
        ("startswith", [Value::Text(start)]) => Value::Bool(text.starts_with(start.as_ref())),
        ("endswith", [Value::Text(end)]) => Value::Bool(text.ends_with(end.as_ref())),
        ("find", [Value::Text(part)]) => {
            let place = text.find(part.as_ref()).map(|at| text[..at].chars().count() as i64);
            Value::Int(place.unwrap_or(-1))
        }
        ("count", [Value::Text(part)]) if !part.is_empty() => {
            Value::Int(text.matches(part.as_ref()).count() as i64)
        }
        ("replace", [Value::Text(from), Value::Text(to)]) => bounded_text(text.replace(from.as_ref(), to))?,
        ("split", []) => Value::list(text.split_whitespace().map(Value::text).collect()),
        ("split", [Value::Text(by)]) if !by.is_empty() => {
            bounded_list(text.split(by.as_ref()).map(Value::text))?
        }
        ("join", [list]) => {
            let parts: Vec<String> = entries(list)?.iter().map(ToString::to_string).collect();
            bounded_text(parts.join(text))?
        }
        _ => return Err(format!("`{name}` does not take {} such values", values.len())),
    })
}

/// `'%s_%d' % values`, with a number of decimals for `%f` and no other widths.
pub(super) fn percent(text: &str, values: &Value) -> Result<Value, String> {
    let values = match values {
        Value::List(list) => list.to_vec(),
        other => vec![other.clone()],
    };
    let (mut own, mut rest) = (String::new(), text);
    let mut values = values.iter();
    while let Some((before, behind)) = rest.split_once('%') {
        own.push_str(before);
        if let Some(behind) = behind.strip_prefix('%') {
            own.push('%');
            rest = behind;
            continue;
        }
        let end = behind.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(behind.len());
        let kind = behind[end..].chars().next();
        let decimals = behind[..end].strip_prefix('.').map(str::parse::<usize>);
        let value = values.next().ok_or_else(|| format!("expected more values for `{text}`"))?;
        match (kind, decimals) {
            (Some('s'), None) if end == 0 => own.push_str(&value.to_string()),
            (Some('d' | 'i'), None) if end == 0 => {
                own.push_str(&rounded(number(value)?.trunc())?.to_string())
            }
            (Some('f'), None) if end == 0 => own.push_str(&format!("{:.6}", number(value)?)),
            (Some('f'), Some(Ok(digits))) if digits <= 30 => {
                own.push_str(&format!("{:.digits$}", number(value)?))
            }
            _ => return Err(format!("expected `%s`, `%d`, `%f` or `%.2f` in `{text}`")),
        }
        rest = &behind[end + 1..];
    }
    own.push_str(rest);
    bounded_text(own)
}
