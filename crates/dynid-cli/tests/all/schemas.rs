//! Results against their schemas, and the published schemas against those of the program.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::path::Path;

use dynid::schema::all;
use serde_json::Value;

use crate::{fleet, support::run};

/// Faults of a value against a schema: types, keys that are missing or that the schema does not know, values of lists and choices.
struct Checker<'a> {
    root: &'a Value,
    faults: Vec<String>,
}

impl Checker<'_> {
    fn check(&mut self, schema: &Value, value: &Value, at: &str) {
        if let Some(target) = schema["$ref"].as_str() {
            let target = target.strip_prefix('#').unwrap();
            return self.check(self.root.pointer(target).unwrap(), value, at);
        }
        if let Some(fixed) = schema.get("const").filter(|fixed| *fixed != value) {
            self.faults.push(format!("{at}: expected {fixed}, found {value}"));
        }
        if let Some(list) = schema["enum"].as_array().filter(|list| !list.contains(value)) {
            self.faults.push(format!("{at}: expected one of {list:?}, found {value}"));
        }
        for choices in ["anyOf", "oneOf"].into_iter().filter_map(|key| schema[key].as_array()) {
            let fits = |choice: &&Value| {
                let mut trial = Checker { root: self.root, faults: Vec::new() };
                trial.check(choice, value, at);
                trial.faults.is_empty()
            };
            if choices.iter().filter(fits).count() == 0 {
                self.faults.push(format!("{at}: none of {} choices fits {value:.200}", choices.len()));
            }
        }
        let kind = match value {
            Value::Null => "null",
            Value::Bool(_) => "boolean",
            Value::Number(n) if n.is_f64() => "number",
            Value::Number(_) => "integer",
            Value::String(_) => "string",
            Value::Array(_) => "array",
            Value::Object(_) => "object",
        };
        let is = |t: &Value| t == kind || (t == "number" && kind == "integer");
        let fits = match &schema["type"] {
            Value::Null => true,
            Value::Array(list) => list.iter().any(is),
            one => is(one),
        };
        if !fits {
            self.faults.push(format!("{at}: expected {}, found {kind}", schema["type"]));
        }
        if let Value::Array(list) = value {
            let heads = schema["prefixItems"].as_array().map_or(&[][..], Vec::as_slice);
            for (k, item) in list.iter().enumerate() {
                let schema = heads.get(k).unwrap_or(&schema["items"]);
                self.check(schema, item, &format!("{at}[{k}]"));
            }
        }
        let Value::Object(map) = value else { return };
        let known = schema["properties"].as_object();
        for key in schema["required"].as_array().into_iter().flatten().filter_map(Value::as_str) {
            if !map.contains_key(key) {
                self.faults.push(format!("{at}: `{key}` is missing"));
            }
        }
        for (key, item) in map {
            let place = format!("{at}.{key}");
            match (known.and_then(|known| known.get(key)), &schema["additionalProperties"]) {
                (Some(schema), _) => self.check(schema, item, &place),
                (None, others @ Value::Object(_)) => self.check(others, item, &place),
                (None, _) if known.is_some() => self.faults.push(format!("{place}: not in the schema")),
                _ => {}
            }
        }
    }
}

fn faults(name: &str, value: &Value) -> Vec<String> {
    let schemas = all();
    let text = &schemas.iter().find(|s| s.name == name).unwrap().text;
    let root: Value = serde_json::from_str(text).unwrap();
    let mut checker = Checker { root: &root, faults: Vec::new() };
    checker.check(&root, value, name);
    checker.faults
}

#[test]
fn published_schemas_are_those_of_the_program() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/schemas");
    for schema in all() {
        let path = folder.join(format!("{}.json", schema.name));
        if std::env::var_os("DYNID_WRITE_SCHEMAS").is_some() {
            std::fs::create_dir_all(&folder).unwrap();
            std::fs::write(&path, &schema.text).unwrap();
        }
        let published = std::fs::read_to_string(&path).unwrap_or_default();
        assert!(published == schema.text, "{}: run this test with DYNID_WRITE_SCHEMAS=1", path.display());
    }
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), all().len(), "a schema of no result");
}

#[test]
fn results_keep_to_their_schemas() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let file = |name: &str| root.join("examples/indy7").join(name).display().to_string();
    let (robot, train, valid) = (file("robot.toml"), file("train.csv.gz"), file("valid.csv.gz"));
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    run(at, &["identify", &robot, "--log", &train, "--validate", &valid, "--out", "out"], 0);
    run(at, &["reduce", &robot, "--log", &train, "--out", "a.factors"], 0);
    run(at, &["solve", "a.factors", "--out", "solved"], 0);
    run(at, &["export", "out/estimate.json", "--model", "model.json", "--robot", &robot], 0);
    run(at, &["design", &robot, "--starts", "1", "--period", "4", "--out", "design"], 0);
    run(
        at,
        &["next", &robot, "--after", "a.factors", "--want", "j3.Ia=5%", "--starts", "1", "--out", "next"],
        0,
    );
    let read = |name: &str| serde_json::from_slice::<Value>(&std::fs::read(at.join(name)).unwrap()).unwrap();
    let printed = |args: &[&str]| serde_json::from_slice::<Value>(&run(at, args, 0).stdout).unwrap();
    let (cell, solved) = ("out/estimate.json", "solved/estimate.json");
    let fleet = fleet::prepared().join("whole");
    let of_fleet =
        |name: &Path| serde_json::from_slice::<Value>(&std::fs::read(fleet.join(name)).unwrap()).unwrap();
    let robot_of_fleet = std::fs::read_dir(fleet.join("robots")).unwrap().map(|file| file.unwrap().path());
    let robot_of_fleet =
        robot_of_fleet.min_by_key(|path| (path.extension() != Some("json".as_ref()), path.clone()));
    let results = [
        ("fleet", of_fleet("fleet.json".as_ref())),
        ("estimate", of_fleet("type.json".as_ref())),
        ("estimate", of_fleet(&robot_of_fleet.unwrap())),
        ("estimate", read(cell)),
        ("estimate", read(solved)),
        ("model", read("model.json")),
        ("design", read("design/design.json")),
        ("next", read("next/next.json")),
        ("check", printed(&["check", &train, "--robot", &robot, "--json"])),
        ("diff", printed(&["diff", cell, solved, "--json"])),
        ("inspect", printed(&["inspect", &robot, "--json"])),
        ("validate", printed(&["validate", cell, "--log", &valid, "--json"])),
        ("backlash", printed(&["backlash", cell, "--log", &valid, "--json"])),
    ];
    for (name, value) in &results {
        let found = faults(name, value);
        assert!(found.is_empty(), "{name}:\n{}", found[..found.len().min(20)].join("\n"));
    }
    // A schema that nothing can fail is none.
    let mut changed = read(cell);
    changed["samples"] = "many".into();
    changed["parameters"][0].as_object_mut().unwrap().remove("verdict");
    changed["verdict"]["more"] = true.into();
    assert_eq!(faults("estimate", &changed).len(), 3, "{:?}", faults("estimate", &changed));
}
