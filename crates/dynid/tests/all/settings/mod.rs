//! Every key of every configuration takes effect or is refused with a reason.
//!
//! Keys are read off the parsers themselves, so that a new key without a case fails. A case is a setting, what stands beside it,
//! and whether the outcome then is another one or an error that names the key's reason.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

mod identification;
mod motion;
mod others;

use std::collections::{BTreeMap, BTreeSet};

/// What a key must do.
#[derive(Debug, Clone, Copy)]
enum Expect {
    /// The outcome is another one.
    Changes,
    /// An error that holds these words.
    Refused(&'static str),
}
use Expect::{Changes, Refused};

/// A configuration in parts; `{..}` of the base stands for them.
#[derive(Debug, Clone, Copy, Default)]
struct Text {
    /// Before all tables.
    top: &'static str,
    /// In the first `[[log]]`.
    log: &'static str,
    /// In the `[[validation]]`.
    valid: &'static str,
    /// Tables.
    tables: &'static str,
}

struct Case {
    key: &'static str,
    before: Text,
    after: Text,
    expect: Expect,
}

/// One key, alone.
fn top(key: &'static str, text: &'static str, expect: Expect) -> Case {
    Case { key, before: Text::default(), after: Text { top: text, ..Text::default() }, expect }
}

fn log(key: &'static str, text: &'static str, expect: Expect) -> Case {
    Case { key, before: Text::default(), after: Text { log: text, ..Text::default() }, expect }
}

fn valid(key: &'static str, text: &'static str, expect: Expect) -> Case {
    Case { key, before: Text::default(), after: Text { valid: text, ..Text::default() }, expect }
}

fn table(key: &'static str, text: &'static str, expect: Expect) -> Case {
    beside(key, "", text, expect)
}

/// One key beside others: the tables without and with it.
fn beside(key: &'static str, before: &'static str, after: &'static str, expect: Expect) -> Case {
    let tables = |tables| Text { tables, ..Text::default() };
    Case { key, before: tables(before), after: tables(after), expect }
}

/// A key that no parser knows.
const UNKNOWN: &str = "no_such_key";

/// Keys that a message about an unknown key lists.
fn listed(message: &str) -> Option<Vec<String>> {
    let known = message.split_once(&format!("unknown field `{UNKNOWN}`, expected "))?.1;
    let known = known.lines().next().unwrap();
    Some(known.split('`').skip(1).step_by(2).map(str::to_owned).collect())
}

/// All keys that a parser takes, tables within tables with points in between. `parse` returns the message of the fault.
fn keys(parse: &dyn Fn(&str) -> Option<String>) -> BTreeSet<String> {
    let mut out = BTreeSet::new();
    let mut tables: Vec<(String, Vec<String>)> = vec![(String::new(), Vec::new())];
    while let Some((table, siblings)) = tables.pop() {
        let headers = match table.as_str() {
            "" => vec![String::new()],
            name => {
                let root = name.split('.').next().unwrap();
                let own = [format!("[{name}]\n"), format!("[[{name}]]\n"), format!("[{name}.x]\n")];
                let within = own.iter().map(|own| format!("[[{root}]]\n{own}"));
                own.iter().cloned().chain(within).collect()
            }
        };
        let found = headers.iter().find_map(|h| listed(&parse(&format!("{h}{UNKNOWN} = 1\n"))?));
        match found {
            // Within a map from names to tables every key passes for a name.
            Some(found) if found != siblings => {
                let within =
                    |key: &String| if table.is_empty() { key.clone() } else { format!("{table}.{key}") };
                tables.extend(found.iter().map(|key| (within(key), found.clone())));
            }
            _ => drop(out.insert(table)),
        }
    }
    out
}

/// Runs all cases and tells every fault at once.
fn walk(name: &str, keys: &BTreeSet<String>, cases: &[Case], run: &dyn Fn(&Text) -> Result<String, String>) {
    let mut faults: Vec<String> = Vec::new();
    let mut known: BTreeMap<String, Result<String, String>> = BTreeMap::new();
    for key in keys {
        if !cases.iter().any(|case| case.key == *key) {
            faults.push(format!("{key}: no case"));
        }
    }
    for case in cases {
        if !keys.contains(case.key) {
            faults.push(format!("{}: a case, but no such key", case.key));
        }
        let before = known.entry(format!("{:?}", case.before)).or_insert_with(|| run(&case.before));
        let after = run(&case.after);
        let fault = match (case.expect, &after) {
            (Changes, Err(e)) if before.is_ok() => Some(format!("failed: {e}")),
            (Changes, after) if *before == *after => {
                let told = match after {
                    Ok(_) => String::new(),
                    Err(e) => format!(": both fail, {e}"),
                };
                Some(format!("changes nothing{told}"))
            }
            (Refused(words), Err(e)) if !e.contains(words) => Some(format!("refused otherwise: {e}")),
            (Refused(_), Ok(_)) => Some("not refused".to_owned()),
            _ => None,
        };
        faults.extend(fault.map(|f| format!("{}: {f} ({:?})", case.key, case.after)));
    }
    assert!(faults.is_empty(), "{name}:\n{}", faults.join("\n"));
}
