//! Structs and enums of Rust sources, as far as serde and doc comments tell of them.

use std::collections::BTreeMap;
use std::path::Path;

use quote::ToTokens;
use syn::{Attribute, Expr, Fields, ImplItem, Item, Lit, Meta, Stmt};

/// A type that a file's keys are read into.
pub(super) enum Kind {
    /// Keys of a table.
    Table(Vec<Key>),
    /// Names that a key takes, with their meaning.
    Names(Vec<(String, String)>),
    /// Forms that a value may have.
    Forms(Vec<(syn::Type, String)>),
}

pub(super) struct Key {
    pub(super) name: String,
    pub(super) of: syn::Type,
    pub(super) doc: String,
    /// As the code states it.
    pub(super) default: Option<String>,
}

pub(super) struct Type {
    pub(super) doc: String,
    pub(super) kind: Kind,
}

/// All types in files and folders of the repository, by name.
pub(super) fn read(root: &Path, sources: &[&str]) -> BTreeMap<String, Type> {
    let mut types = BTreeMap::new();
    let mut defaults = BTreeMap::new();
    for source in sources {
        for file in rust_files(&root.join(source)) {
            let parsed = syn::parse_file(&std::fs::read_to_string(&file).unwrap()).unwrap();
            for item in parsed.items {
                match item {
                    Item::Struct(s) if is_read(&s.attrs) => {
                        let Fields::Named(fields) = s.fields else { continue };
                        let case = serde(&s.attrs, "rename_all");
                        let keys = fields.named.into_iter().filter_map(|f| key(f, case.as_deref())).collect();
                        let doc = doc(&s.attrs);
                        types.entry(s.ident.to_string()).or_insert(Type { doc, kind: Kind::Table(keys) });
                    }
                    Item::Enum(e) if is_read(&e.attrs) => {
                        types.entry(e.ident.to_string()).or_insert(enumeration(e));
                    }
                    Item::Impl(i) if i.trait_.as_ref().is_some_and(|(path, _)| path.is_ident("Default")) => {
                        let name = i.self_ty.to_token_stream().to_string();
                        defaults.extend(i.items.iter().flat_map(stated).map(|(k, v)| ((name.clone(), k), v)));
                    }
                    _ => {}
                }
            }
        }
    }
    for ((name, key), value) in defaults {
        let Some(Type { kind: Kind::Table(keys), .. }) = types.get_mut(&name) else { continue };
        if let Some(key) = keys.iter_mut().find(|k| k.name == key) {
            key.default.get_or_insert(value);
        }
    }
    types
}

fn rust_files(path: &Path) -> Vec<std::path::PathBuf> {
    if path.is_file() {
        return vec![path.to_owned()];
    }
    let mut files: Vec<_> = std::fs::read_dir(path).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.retain(|file| file.extension().is_some_and(|e| e == "rs"));
    files.sort();
    files
}

/// Whether a file is read into the type.
fn is_read(attributes: &[Attribute]) -> bool {
    let mut derived = attributes.iter().filter(|a| a.path().is_ident("derive"));
    derived.any(|a| a.meta.to_token_stream().to_string().contains("Deserialize"))
}

fn key(field: syn::Field, case: Option<&str>) -> Option<Key> {
    let ident = field.ident.unwrap().to_string();
    if has_serde(&field.attrs, "skip") {
        return None;
    }
    let name = serde(&field.attrs, "rename").unwrap_or_else(|| cased(&ident, case));
    Some(Key { name, of: field.ty, doc: doc(&field.attrs), default: None })
}

fn enumeration(item: syn::ItemEnum) -> Type {
    let doc_of_all = doc(&item.attrs);
    let case = serde(&item.attrs, "rename_all");
    let untagged = has_serde(&item.attrs, "untagged");
    let (mut names, mut forms) = (Vec::new(), Vec::new());
    for variant in item.variants {
        match variant.fields {
            Fields::Unnamed(fields) if untagged => {
                forms.push((fields.unnamed.into_iter().next().unwrap().ty, doc(&variant.attrs)));
            }
            Fields::Unit => {
                let ident = variant.ident.to_string();
                let name = serde(&variant.attrs, "rename").unwrap_or_else(|| cased(&ident, case.as_deref()));
                names.push((name, doc(&variant.attrs)));
            }
            _ => {}
        }
    }
    Type { doc: doc_of_all, kind: if untagged { Kind::Forms(forms) } else { Kind::Names(names) } }
}

/// Numbers, texts and flags that `Default` states.
fn stated(item: &ImplItem) -> Vec<(String, String)> {
    let ImplItem::Fn(function) = item else { return Vec::new() };
    let Some(Stmt::Expr(Expr::Struct(made), None)) = function.block.stmts.last() else { return Vec::new() };
    let value = |expr: &Expr| match expr {
        Expr::Lit(lit) => match &lit.lit {
            Lit::Float(_) | Lit::Int(_) | Lit::Bool(_) => Some(lit.lit.to_token_stream().to_string()),
            _ => None,
        },
        Expr::Array(list) => {
            let text = list.to_token_stream().to_string();
            text.chars()
                .all(|c| "[]0123456789.,-e_ ".contains(c))
                .then(|| text.replace(" ,", ",").replace("[ ", "["))
        }
        _ => None,
    };
    made.fields
        .iter()
        .filter_map(|f| Some((f.member.to_token_stream().to_string(), value(&f.expr)?)))
        .collect()
}

/// Text of doc comments, in one line.
fn doc(attributes: &[Attribute]) -> String {
    let lines = attributes.iter().filter_map(|a| match &a.meta {
        Meta::NameValue(m) if m.path.is_ident("doc") => match &m.value {
            Expr::Lit(lit) => match &lit.lit {
                Lit::Str(text) => Some(text.value().trim().to_owned()),
                _ => None,
            },
            _ => None,
        },
        _ => None,
    });
    lines.take_while(|line| line != "# Errors").collect::<Vec<_>>().join(" ").trim().to_owned()
}

/// The text of `key = "text"` in a serde attribute.
fn serde(attributes: &[Attribute], key: &str) -> Option<String> {
    let text = serde_text(attributes);
    let (_, rest) = text.split_once(&format!("{key} = \""))?;
    Some(rest.split_once('"')?.0.to_owned())
}

fn has_serde(attributes: &[Attribute], word: &str) -> bool {
    serde_text(attributes).split([',', '(', ')', ' ']).any(|w| w == word)
}

fn serde_text(attributes: &[Attribute]) -> String {
    let of_serde = attributes.iter().filter(|a| a.path().is_ident("serde"));
    of_serde.map(|a| a.meta.to_token_stream().to_string()).collect::<Vec<_>>().join(" ")
}

fn cased(ident: &str, case: Option<&str>) -> String {
    let mut snake = String::new();
    for (i, c) in ident.chars().enumerate() {
        if c.is_uppercase() && i > 0 {
            snake.push('_');
        }
        snake.extend(c.to_lowercase());
    }
    match case {
        Some("kebab-case") => snake.replace('_', "-"),
        Some("lowercase") => snake.replace('_', ""),
        Some("snake_case") => snake,
        _ => ident.to_owned(),
    }
}
