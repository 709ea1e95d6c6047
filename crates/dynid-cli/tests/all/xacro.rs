//! A robot in xacro through the commands: arguments behind `#`, results named after it, files that it includes in the provenance.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::support::run;

const ARM: &str = r#"<robot name="arm" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:arg name="prefix" default=""/>
  <xacro:include filename="parts.xacro"/>
  <link name="base"/>
  <xacro:segment name="$(arg prefix)upper" parent="base" mass="${heavy}" at="0 0 0.1"/>
  <xacro:segment name="$(arg prefix)lower" parent="$(arg prefix)upper" mass="${heavy / 2}" at="0 0 0.4"/>
</robot>
"#;
const PARTS: &str = r#"<robot xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:property name="heavy" value="4"/>
  <xacro:macro name="segment" params="name parent mass at">
    <link name="${name}"><inertial><origin xyz="0.02 0.01 0.2"/><mass value="${mass}"/>
      <inertia ixx="${mass * 0.04}" ixy="0" ixz="0" iyy="${mass * 0.03}" iyz="0" izz="${mass * 0.02}"/></inertial></link>
    <joint name="${name}_joint" type="revolute"><parent link="${parent}"/><child link="${name}"/><origin xyz="${at}"/><axis xyz="0 1 0"/>
      <limit lower="-2" upper="2" effort="80" velocity="3"/></joint>
  </xacro:macro>
</robot>
"#;

#[test]
fn a_robot_in_xacro_goes_through_the_commands() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::write(at.join("arm.urdf.xacro"), ARM).unwrap();
    fs::write(at.join("parts.xacro"), PARTS).unwrap();
    let robot = "arm.urdf.xacro#prefix:=left_";
    let printed = |args: &[&str]| String::from_utf8(run(at, args, 0).stdout).unwrap();
    assert!(printed(&["inspect", robot]).contains("left_upper_joint"));
    run(
        at,
        &["simulate", robot, "--duration", "10", "--rate-hz", "200", "--seed", "2", "--out", "log.csv"],
        0,
    );
    run(at, &["identify", robot, "--log", "log.csv", "--out", "out", "--quiet"], 0);
    run(at, &["export", "out/estimate.json", "--mjcf", "arm.xml"], 0);
    run(at, &["diff", robot, "out/estimate.json"], 0);
    run(at, &["check", "log.csv", "--robot", robot], 0);
    run(at, &["init", robot, "log.csv", "--out", "run.toml"], 0);
    assert!(
        fs::read_to_string(at.join("run.toml")).unwrap().contains("robot = \"arm.urdf.xacro#prefix:=left_\"")
    );

    let estimate: Value =
        serde_json::from_str(&fs::read_to_string(at.join("out/estimate.json")).unwrap()).unwrap();
    let inputs = estimate["provenance"]["inputs"].as_array().unwrap();
    let kinds: Vec<&str> = inputs.iter().map(|input| input["kind"].as_str().unwrap()).collect();
    assert_eq!(kinds, ["robot", "included", "log"]);
    // The result is plain, and every command takes it.
    let urdf = fs::read_to_string(at.join("out/arm.urdf")).unwrap();
    assert!(urdf.contains("<link name=\"left_upper\">") && !urdf.contains("xacro"), "{urdf}");
    assert!(printed(&["inspect", "out/arm.urdf"]).contains("left_lower_joint"));

    let refused = |robot: &str, parts: &[&str]| {
        let told = String::from_utf8(run(at, &["inspect", robot], 2).stderr).unwrap();
        parts.iter().for_each(|part| assert!(told.contains(part), "`{part}` is not in: {told}"));
    };
    refused(
        "arm.urdf.xacro#prefx:=left_",
        &["arm.urdf.xacro:1:1", "`prefx`; it has prefix", "hint: correct the name"],
    );
    refused("parts.xacro", &["definitions alone", "hint: name the file that includes it"]);
    fs::remove_file(at.join("parts.xacro")).unwrap();
    refused(robot, &["arm.urdf.xacro:3:3", "`parts.xacro` cannot be read", "hint: "]);
    assert!(Path::new(at).join("arm.xml").is_file());
}
