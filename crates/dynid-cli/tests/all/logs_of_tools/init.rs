//! `dynid init`.

use super::arm::{Arm, arm};
use super::folder;
use crate::support::{TWO_LINKS, run};

fn plain() -> String {
    arm().rows("t,q1,q2,dq1,dq2,tau1,tau2", |k, t| format!("{t},{}", arm().signals(k, ",")))
}

#[test]
fn a_draft_is_commented_and_works() {
    let folder = folder(&plain());
    let at = folder.path();
    run(at, &["init", "robot.urdf", "log.csv"], 0);
    let text = std::fs::read_to_string(at.join("dynid.toml")).unwrap();
    for line in [
        "robot = \"robot.urdf\"",
        "time = { columns = \"t\", unit = \"s\" }",
        "position = \"q{}\"  # numbered columns, taken in the order shoulder, elbow",
        "effort = \"tau{}\"",
        "default = [\"coulomb\", \"viscous\", \"offset\", \"rotor\"]",
        "part = [0.0, 0.8]",
        "[[validation]]",
        "part = [0.8, 1.0]",
    ] {
        assert!(text.contains(line), "{line}: {text}");
    }
    run(at, &["check", "dynid.toml"], 0);
    // A file that exists is kept, unless told otherwise.
    std::fs::write(at.join("dynid.toml"), "mine").unwrap();
    let output = run(at, &["init", "robot.urdf", "log.csv"], 2);
    assert!(String::from_utf8_lossy(&output.stderr).contains("--force"));
    assert_eq!(std::fs::read_to_string(at.join("dynid.toml")).unwrap(), "mine");
    run(at, &["init", "robot.urdf", "log.csv", "--force"], 0);
    // Standard output holds the configuration and nothing else.
    let output = run(at, &["init", "robot.urdf", "log.csv", "--out", "-"], 0);
    assert_eq!(String::from_utf8_lossy(&output.stdout), text);
}

#[test]
fn of_several_logs_the_last_one_is_kept_and_paths_lead_there() {
    let folder = folder(&plain());
    let at = folder.path();
    std::fs::create_dir(at.join("runs")).unwrap();
    std::fs::write(at.join("runs/second.csv"), plain()).unwrap();
    run(at, &["init", "robot.urdf", "log.csv", "runs/second.csv", "--out", "runs/run.toml"], 0);
    let text = std::fs::read_to_string(at.join("runs/run.toml")).unwrap();
    assert!(text.contains("[[validation]]\npath = \"second.csv\"") && !text.contains("part ="), "{text}");
    // The two logs are one recording, which the pre-flight says.
    let output = run(at, &["check", "runs/run.toml"], 0);
    assert!(String::from_utf8_lossy(&output.stdout).contains("repeated_log"));
}

#[test]
fn degrees_are_written_with_their_reason() {
    let Arm { q, dq, tau, .. } = arm();
    let log = arm().rows("t,q1,q2,dq1,dq2,tau1,tau2", |k, t| {
        let degrees =
            |list: &[Vec<f64>; 2]| format!("{},{}", list[0][k].to_degrees(), list[1][k].to_degrees());
        format!("{t},{},{},{},{}", degrees(q), degrees(dq), tau[0][k], tau[1][k])
    });
    let said = super::two_commands(&log, &[]);
    assert!(said.contains("position = { columns = \"q{}\", unit = \"deg\" }"), "{said}");
    assert!(said.contains("velocity = { columns = \"dq{}\", unit = \"deg/s\" }"), "{said}");
}

#[test]
fn what_the_log_does_not_tell_is_left_open() {
    // Nobody answers: stdin is no terminal.
    for names in ["current_1,current_2", "i1,i2"] {
        gains_are_left_open(names);
    }
}

fn gains_are_left_open(names: &str) {
    let log = arm().rows(&format!("t,q1,q2,{names}"), |k, t| {
        let Arm { q, tau, .. } = arm();
        format!("{t},{},{},{},{}", q[0][k], q[1][k], tau[0][k] / 11.5, tau[1][k] / 9.0)
    });
    let folder = folder(&log);
    let at = folder.path();
    let output = run(at, &["init", "robot.urdf", "log.csv"], 1);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(said.contains("to fill in (line ") && said.contains("current_gains = [..]"), "{said}");
    let text = std::fs::read_to_string(at.join("dynid.toml")).unwrap();
    let open = "# current_gains = [..]  # N m/A of shoulder, elbow";
    assert!(text.contains(open) && text.contains("position = \"q{}\""), "{text}");
    // With the line filled in the file works.
    std::fs::write(at.join("dynid.toml"), text.replace(open, "current_gains = [11.5, 9.0]")).unwrap();
    run(at, &["identify", "dynid.toml", "--out", "out"], 0);
    super::near_the_truth(at);
}

#[test]
fn a_log_of_another_robot_is_refused() {
    let folder = folder("a;b\n1;2\n");
    let at = folder.path();
    std::fs::write(at.join("robot.urdf"), TWO_LINKS).unwrap();
    run(at, &["init", "robot.urdf", "gone.csv"], 2);
    run(at, &["init", "gone.urdf", "log.csv"], 2);
    // Neither time nor positions are found: both are asked for, and the rest waits.
    let output = run(at, &["init", "robot.urdf", "log.csv"], 1);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(said.contains("rate_hz = ..") && said.contains("position = \"..\""), "{said}");
}
