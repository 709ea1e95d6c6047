//! Tables of keys in Markdown.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use syn::{GenericArgument, PathArguments};

use super::source::{Key, Kind, Type};

/// A table of keys for a struct and for every struct below it, each under the places where it stands in a file.
pub(super) fn tables(types: &BTreeMap<String, Type>, top: &str) -> String {
    let mut sections: Vec<(String, Vec<String>)> = vec![(top.to_owned(), vec![String::new()])];
    let mut next = 0;
    while next < sections.len() {
        let (name, places) = sections[next].clone();
        if let Kind::Table(keys) = &types[&name].kind {
            for key in keys {
                for (below, many) in tables_in(&key.of, types) {
                    let path = [places[0].as_str(), &key.name]
                        .iter()
                        .filter(|p| !p.is_empty())
                        .copied()
                        .collect::<Vec<_>>();
                    let path = if many == Many::ByName {
                        format!("{}.NAME", path.join("."))
                    } else {
                        path.join(".")
                    };
                    match sections.iter_mut().find(|(name, _)| *name == below) {
                        Some((_, places)) if !places.contains(&path) => places.push(path),
                        Some(_) => {}
                        None => sections.push((below, vec![path])),
                    }
                }
            }
        }
        next += 1;
    }
    let mut text = String::new();
    for (name, places) in &sections {
        section(&mut text, types, name, places);
    }
    text.trim_end().to_owned() + "\n"
}

fn section(text: &mut String, types: &BTreeMap<String, Type>, name: &str, places: &[String]) {
    let heading = match places[0].as_str() {
        "" => "At the top".to_owned(),
        _ => places.iter().map(|p| format!("`{p}`")).collect::<Vec<_>>().join(", "),
    };
    let of = &types[name];
    let _ = write!(text, "## {heading}\n\n");
    if !of.doc.is_empty() && !places[0].is_empty() {
        let _ = write!(text, "{}\n\n", plain(&of.doc));
    }
    let Kind::Table(keys) = &of.kind else { return };
    let with_defaults = keys.iter().any(|k| k.default.is_some());
    text.push_str(if with_defaults {
        "| key | value | default | meaning |\n|---|---|---|---|\n"
    } else {
        "| key | value | meaning |\n|---|---|---|\n"
    });
    for key in keys {
        let default = key.default.as_ref().map(|d| format!("`{}`", d.replace('_', ""))).unwrap_or_default();
        let default = if with_defaults { format!(" {default} |") } else { String::new() };
        let _ = writeln!(
            text,
            "| `{}` | {} |{default} {} |",
            key.name,
            value(&key.of, types),
            plain(&meaning(key, types))
        );
    }
    text.push('\n');
}

/// Meaning of a key, with those of the names that it takes.
fn meaning(key: &Key, types: &BTreeMap<String, Type>) -> String {
    let Some(Kind::Names(names)) = last_name(&key.of).and_then(|n| Some(&types.get(&n)?.kind)) else {
        return key.doc.clone();
    };
    let told = names.iter().filter(|(_, doc)| !doc.is_empty());
    let told: Vec<String> =
        told.map(|(name, doc)| format!("`{name}`: {}", doc.trim_end_matches('.'))).collect();
    if told.is_empty() { key.doc.clone() } else { format!("{} {}.", key.doc, told.join("; ")) }
}

/// What a value looks like in a file.
fn value(of: &syn::Type, types: &BTreeMap<String, Type>) -> String {
    match of {
        syn::Type::Array(array) => {
            let syn::Expr::Lit(length) = &array.len else { return "list".to_owned() };
            format!(
                "list of {} {}",
                quote::ToTokens::to_token_stream(length),
                plural(&value(&array.elem, types))
            )
        }
        syn::Type::Tuple(tuple) => {
            format!("[{}]", tuple.elems.iter().map(|t| value(t, types)).collect::<Vec<_>>().join(", "))
        }
        syn::Type::Path(path) => {
            let last = path.path.segments.last().unwrap();
            let name = last.ident.to_string();
            let inner = arguments(&last.arguments);
            match name.as_str() {
                "Option" | "Spanned" | "Box" => value(&inner[0], types),
                "Vec" if !tables_in(&inner[0], types).is_empty() => "tables, below".to_owned(),
                "Vec" => format!("list of {}", plural(&value(&inner[0], types))),
                "BTreeMap" if is_table(&inner[1]) => "table of settings by name".to_owned(),
                "BTreeMap" => format!("by name: {}", value(&inner[1], types)),
                "f64" | "Number" => "number".to_owned(),
                "Angle" => "number or angle such as `\"90deg\"`".to_owned(),
                "usize" | "u64" | "u32" | "i64" => "whole number".to_owned(),
                "bool" => "`true`, `false`".to_owned(),
                "String" => "text".to_owned(),
                "PathBuf" => "path".to_owned(),
                "Position" => "number or list of numbers".to_owned(),
                "Schema" => "1".to_owned(),
                _ => match types.get(&name).map(|t| &t.kind) {
                    Some(Kind::Table(_)) => "table, below".to_owned(),
                    Some(Kind::Names(names)) if !names.is_empty() => {
                        names.iter().map(|(n, _)| format!("`\"{n}\"`")).collect::<Vec<_>>().join(", ")
                    }
                    Some(Kind::Forms(forms)) => {
                        forms.iter().map(|(t, _)| value(t, types)).collect::<Vec<_>>().join("; or ")
                    }
                    _ => "see the meaning".to_owned(),
                },
            }
        }
        _ => "see the meaning".to_owned(),
    }
}

/// Of a kind of value: `numbers`, `texts`; kinds that are no single word stay.
fn plural(kind: &str) -> String {
    if kind.contains(' ') || kind.contains('`') { kind.to_owned() } else { format!("{kind}s") }
}

fn is_table(of: &syn::Type) -> bool {
    last_name(of).is_some_and(|name| name == "Table")
}

#[derive(Clone, Copy, PartialEq)]
enum Many {
    One,
    ByName,
}

/// Structs with keys that a type leads to, and whether they stand by name.
fn tables_in(of: &syn::Type, types: &BTreeMap<String, Type>) -> Vec<(String, Many)> {
    match of {
        syn::Type::Array(array) => tables_in(&array.elem, types),
        syn::Type::Path(path) => {
            let last = path.path.segments.last().unwrap();
            let name = last.ident.to_string();
            let inner = arguments(&last.arguments);
            match types.get(&name).map(|t| &t.kind) {
                Some(Kind::Table(_)) => vec![(name, Many::One)],
                Some(Kind::Forms(forms)) => forms.iter().flat_map(|(t, _)| tables_in(t, types)).collect(),
                _ if name == "BTreeMap" => {
                    tables_in(&inner[1], types).into_iter().map(|(name, _)| (name, Many::ByName)).collect()
                }
                _ => inner.iter().flat_map(|t| tables_in(t, types)).collect(),
            }
        }
        _ => Vec::new(),
    }
}

/// Name of the type within `Option`, `Spanned` and the like.
fn last_name(of: &syn::Type) -> Option<String> {
    let syn::Type::Path(path) = of else { return None };
    let last = path.path.segments.last()?;
    match arguments(&last.arguments).first() {
        Some(inner) => last_name(inner),
        None => Some(last.ident.to_string()),
    }
}

fn arguments(of: &PathArguments) -> Vec<syn::Type> {
    let PathArguments::AngleBracketed(list) = of else { return Vec::new() };
    list.args
        .iter()
        .filter_map(|a| match a {
            GenericArgument::Type(t) => Some(t.clone()),
            _ => None,
        })
        .collect()
}

/// Doc comments as a cell: links of rustdoc lose their brackets, bars are escaped.
fn plain(doc: &str) -> String {
    let mut text = String::new();
    let mut rest = doc;
    while let Some((before, after)) = rest.split_once("[`") {
        text.push_str(before);
        let Some((name, after)) = after.split_once("`]") else { break };
        let _ = write!(text, "`{}`", name.trim_start_matches("crate::"));
        rest = match after.strip_prefix('(').and_then(|a| a.split_once(')')) {
            Some((_, after)) => after,
            None => after,
        };
    }
    text.push_str(rest);
    text.replace('|', "\\|")
}
