//! The table of elements in the book, made of the registry.

use std::fmt::Write as _;

use dynid::model::element::{ElementKind, ElementRegistry, LinearTerm};

use super::root;

const PAGE: &str = "docs/book/src/theory/elements.md";
const BEGIN: &str = "<!-- table of elements: begin -->\n";
const END: &str = "<!-- table of elements: end -->\n";

/// Code in a table: a bar would end the cell.
fn code(text: &str) -> String {
    assert!(!text.contains('|'), "a bar ends a cell of a table: {text}");
    format!("`{text}`")
}

fn parameters(kind: &ElementKind) -> String {
    let unit = |unit: &str| if unit == "1" { "-".to_owned() } else { unit.to_owned() };
    let linear = |t: &LinearTerm| format!("{} ({})", code(t.symbol), unit(t.units[0]));
    let mut text = kind.linear.iter().map(linear).collect::<Vec<_>>().join(", ");
    let shape: Vec<String> = kind
        .shape
        .iter()
        .map(|t| {
            let held = match t.start.filter(|_| t.held) {
                _ if t.needed => ", held, to be stated".to_owned(),
                Some(x) => format!(", held at {x}"),
                None => String::new(),
            };
            format!("{} ({}{held})", code(t.symbol), unit(t.units[0]))
        })
        .collect();
    if !shape.is_empty() {
        let _ = write!(text, "; shape {}", shape.join(", "));
    }
    text
}

fn settings(kind: &ElementKind) -> String {
    let stated = kind.stated.iter().map(|s| match s.key == s.symbol {
        true => code(s.key),
        false => format!("{} = {}", code(s.key), code(s.symbol)),
    });
    let options = kind.options.iter().map(|o| code(o.key()));
    stated.chain(options).collect::<Vec<_>>().join(", ")
}

fn table() -> String {
    let mut out = String::from(
        "| element | effort it adds | parameters (units for turning joints) | settings beside shapes |\n|---|---|---|---|\n",
    );
    for kind in ElementRegistry::default().kinds() {
        let mut effort = code(kind.equation);
        if !kind.help.is_empty() {
            let _ = write!(effort, ": {}", kind.help);
        }
        if let Some(reference) = kind.reference {
            let _ = write!(effort, " ({reference})");
        }
        let _ =
            writeln!(out, "| {} | {effort} | {} | {} |", code(kind.name), parameters(kind), settings(kind));
    }
    out
}

/// `DYNID_WRITE_ELEMENTS=1 cargo test -p dynid-cli --test all table_of_elements` writes the table anew.
#[test]
fn table_of_elements_is_that_of_the_registry() {
    let path = root().join(PAGE);
    let page = std::fs::read_to_string(&path).unwrap();
    let (before, rest) = page.split_once(BEGIN).unwrap();
    let (found, after) = rest.split_once(END).unwrap();
    let expected = table();
    if std::env::var_os("DYNID_WRITE_ELEMENTS").is_some() {
        std::fs::write(&path, format!("{before}{BEGIN}{expected}{END}{after}")).unwrap();
        return;
    }
    let hint = "is stale; DYNID_WRITE_ELEMENTS=1 cargo test -p dynid-cli --test all table_of_elements writes it anew";
    assert!(found == expected, "{PAGE} {hint}");
}

#[test]
fn the_page_of_robot_files_names_every_element() {
    let page = std::fs::read_to_string(root().join("docs/book/src/files/robot.md")).unwrap();
    for name in ElementRegistry::default().names() {
        assert!(page.contains(&format!("`{name}`")), "{name} is missing in docs/book/src/files/robot.md");
    }
}
