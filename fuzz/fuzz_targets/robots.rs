//! Texts of robot files, each as what its first bytes look like and as xacro: an answer or an error.
#![no_main]

use dynid_robots::robot;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let Ok(text) = std::str::from_utf8(data) else { return };
    let name = if text.trim_start().starts_with('<') { "robot.xml" } else { "robot.toml" };
    drop(robot::parse(text, name));
    if name == "robot.xml" {
        drop(robot::parse(text, "robot.xacro"));
    }
});
