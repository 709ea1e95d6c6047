//! Pages of all keys, made of the structs that read the files: names and types from the code, meanings from doc comments.

mod page;
mod source;

use std::path::Path;

use super::{demand_none, root};

/// Sources and root of a page.
struct Keys {
    page: &'static str,
    title: &'static str,
    /// What the page says before its tables.
    opening: &'static str,
    /// Struct that holds the keys at the top of a file.
    top: &'static str,
    /// Files and folders with the structs.
    sources: &'static [&'static str],
}

const PAGES: [Keys; 7] = [
    Keys {
        page: "run",
        title: "Keys of a run configuration",
        opening: "Read by `identify`, `check`, `compare`, `payload`, `gains` and `online`. An example with comments: \
                  [The run configuration](../files/run.md).",
        top: "Config",
        sources: &[
            "crates/dynid-config/src/config.rs",
            "crates/dynid-config/src/config",
            SETTINGS,
            PER_JOINT,
            KNOWN_FRICTION,
            MOTOR_SIDE,
            COLUMNS,
            COUPLING,
        ],
    },
    Keys {
        page: "design",
        title: "Keys of a design file",
        opening: "Read by `design`. An example with comments: [The design file](../files/design.md).",
        top: "DesignConfig",
        sources: &[
            "crates/dynid-experiments/src/design",
            "crates/dynid-config/src/config.rs",
            "crates/dynid-config/src/config",
            SETTINGS,
            PER_JOINT,
            KNOWN_FRICTION,
            "crates/dynid-excitation/src/criterion/mod.rs",
            COUPLING,
        ],
    },
    Keys {
        page: "motion",
        title: "Keys of a motion file",
        opening: "Read by `motion`. An example with comments: [motion](../commands/motion.md).",
        top: "MotionConfig",
        sources: &["crates/dynid-experiments/src/motions", PER_JOINT],
    },
    Keys {
        page: "friction",
        title: "Keys of a friction experiment",
        opening: "Read by `friction`. An example with comments: [The file of a friction experiment](../files/friction.md).",
        top: "FrictionConfig",
        sources: &["crates/dynid/src/friction", "crates/dynid-config/src/config.rs", MOTOR_SIDE, COLUMNS],
    },
    Keys {
        page: "servo",
        title: "Keys of drives from commands and positions",
        opening: "Read by `servo`. An example with comments: [servo](../commands/servo.md).",
        top: "ServoConfig",
        sources: &["crates/dynid-drives/src", PER_JOINT, COLUMNS],
    },
    Keys {
        page: "simulate",
        title: "Keys of a virtual experiment",
        opening: "Read by `simulate --config`. An example with comments: [simulate](../commands/simulate.md).",
        top: "SimulateSettings",
        sources: &["crates/dynid-experiments/src/simulate"],
    },
    Keys {
        page: "robot",
        title: "Keys of a robot file",
        opening: "Read wherever a robot file in TOML is. An example with comments: [The robot file](../files/robot.md). Keys of an \
                  element's settings: [Elements at joints](../theory/elements.md#shape-parameters), [Elastic joints](../theory/elastic.md), \
                  [Joints with clearance](../theory/clearance.md).",
        top: "RobotToml",
        sources: &["crates/dynid-robots/src/toml_robot"],
    },
];

const SETTINGS: &str = "crates/dynid-setup/src/settings";
const MOTOR_SIDE: &str = "crates/dynid-identify/src/estimate/reading.rs";
const COLUMNS: &str = "crates/dynid-logs/src/columns";
const COUPLING: &str = "crates/dynid-robots/src/toml_robot/schema.rs";
const PER_JOINT: &str = "crates/dynid-setup/src/per_joint.rs";
const KNOWN_FRICTION: &str = "crates/dynid-setup/src/known_friction.rs";

/// `DYNID_WRITE_KEYS=1 cargo test -p dynid-cli --test all keys_of_files` writes the pages anew.
#[test]
fn pages_of_the_keys_of_files_are_those_of_the_code() {
    let write = std::env::var_os("DYNID_WRITE_KEYS").is_some();
    let mut faults = Vec::new();
    for keys in &PAGES {
        let path = root().join("docs/book/src/keys").join(keys.page).with_extension("md");
        let text = text_of(keys, &root());
        if write {
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(&path, &text).unwrap();
        } else if std::fs::read_to_string(&path).ok().as_deref() != Some(&*text) {
            faults.push(format!(
                "{} is stale; DYNID_WRITE_KEYS=1 cargo test -p dynid-cli --test all keys_of_files writes it anew",
                path.display()
            ));
        }
    }
    demand_none(&faults);
}

fn text_of(keys: &Keys, root: &Path) -> String {
    let types = source::read(root, keys.sources);
    let body = page::tables(&types, keys.top);
    format!(
        "# {}\n\n<!-- Made of the code by the test `pages_of_the_keys_of_files_are_those_of_the_code`; not to be edited. -->\n\n{}\n\n{body}",
        keys.title, keys.opening
    )
}
