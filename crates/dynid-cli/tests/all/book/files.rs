//! Files that pages show: each must parse as what it claims to be.

use std::path::Path;

use toml::{Table, Value};

use super::blocks::Block;
use super::root;

/// What is wrong with a block, with its place.
pub(super) fn fault(page: &str, block: &Block) -> Option<String> {
    let parsed = match block.info[0].as_str() {
        "toml" => toml(block),
        "json" => serde_json::from_str::<serde_json::Value>(&block.text).map(drop).map_err(|e| e.to_string()),
        "sh" if block.text.lines().any(|line| line.trim_start().starts_with("dynid ")) => {
            Err("commands of dynid belong into a `console` block, which is run".to_owned())
        }
        "console" | "sh" | "text" | "csv" | "html" => Ok(()),
        "rust" if page == "README.md" => Ok(()),
        // The tests of the package run them.
        "python" if ["README.md", "python.md", "commands/fleet-engines.md"].contains(&page) => Ok(()),
        "python" => Err("the Python of README.md, python.md and fleet-engines.md alone is run".to_owned()),
        "rust" => Err("only the README's Rust is compiled".to_owned()),
        other => Err(format!("`{other}` is no kind of block that is tested")),
    };
    parsed.err().map(|e| format!("{page}:{}: {e}", block.line))
}

fn toml(block: &Block) -> Result<(), String> {
    let (text, part) = (&block.text, block.has("part"));
    let name = "block.toml";
    let said = |e: dynid::Error| e.to_string();
    match block.info.get(1).map(String::as_str) {
        Some("run") if part => dynid::Config::parse(&completed_run(text)?, name).map(drop).map_err(said),
        Some("run") => dynid::Config::parse(text, name).map(drop).map_err(said),
        Some("design") => dynid::design::DesignConfig::parse(text, name).map(drop).map_err(said),
        Some("motion") => dynid::motions::MotionConfig::parse(text, name).map(drop).map_err(said),
        Some("friction") => dynid::FrictionConfig::parse(text, name).map(drop).map_err(said),
        Some("servo") => dynid::servo::ServoConfig::parse(text, name).map(drop).map_err(said),
        Some("simulate") => dynid::simulate::SimulateSettings::parse(text, name).map(drop).map_err(said),
        Some("robot") if part => robot(&completed_robot(text)?),
        Some("robot") => robot(text),
        _ => Err("`toml` needs a kind: run, design, motion, friction, servo, simulate or robot".to_owned()),
    }
}

fn robot(text: &str) -> Result<(), String> {
    let options = dynid::RobotOptions::default();
    dynid::Robot::parse(text, Path::new("block.toml"), &options).map(drop).map_err(|e| e.to_string())
}

/// An excerpt of a run configuration with the keys that every one has.
fn completed_run(text: &str) -> Result<String, String> {
    let mut table: Table = toml::from_str(text).map_err(|e| e.to_string())?;
    table.entry("robot").or_insert_with(|| Value::from("robot.urdf"));
    let log = table.entry("log").or_insert_with(|| Value::Array(vec![Value::Table(Table::new())]));
    for entry in log.as_array_mut().ok_or("`log` is no array")? {
        let entry = entry.as_table_mut().ok_or("a log is no table")?;
        entry.entry("path").or_insert_with(|| Value::from("log.csv"));
    }
    Ok(table.to_string())
}

/// An excerpt of a robot file, its `[element]` and `[law]` tables put into that of the Indy7.
fn completed_robot(text: &str) -> Result<String, String> {
    let part: Table = toml::from_str(text).map_err(|e| e.to_string())?;
    let whole = std::fs::read_to_string(root().join("robots/indy7.toml")).unwrap();
    let mut whole: Table = toml::from_str(&whole).map_err(|e| e.to_string())?;
    for (key, value) in part {
        if key != "element" && key != "law" {
            return Err(format!("an excerpt of a robot file holds elements and laws, not `{key}`"));
        }
        let tables = whole.entry(key).or_insert_with(|| Value::Table(Table::new()));
        let tables = tables.as_table_mut().ok_or("no table")?;
        tables.extend(value.as_table().ok_or("no table")?.clone());
    }
    Ok(whole.to_string())
}
