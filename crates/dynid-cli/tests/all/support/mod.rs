//! What the tests of the program share.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::path::Path;
use std::process::Output;

use assert_cmd::Command;

/// A planar arm in the vertical plane, limits such that a simulated motion is lively.
pub(crate) const TWO_LINKS: &str = r#"<robot name="arm">
  <link name="base"/>
  <link name="upper_arm">
    <inertial>
      <origin xyz="0.01 0 0.2"/>
      <mass value="3"/>
      <inertia ixx="0.05" ixy="0" ixz="0" iyy="0.05" iyz="0" izz="0.01"/>
    </inertial>
  </link>
  <link name="forearm">
    <inertial>
      <origin xyz="0 0 0.15"/>
      <mass value="1.5"/>
      <inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.005"/>
    </inertial>
  </link>
  <joint name="shoulder" type="revolute">
    <origin xyz="0 0 0.4"/>
    <parent link="base"/>
    <child link="upper_arm"/>
    <axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" velocity="3" effort="100"/>
  </joint>
  <joint name="elbow" type="revolute">
    <origin xyz="0 0 0.35"/>
    <parent link="upper_arm"/>
    <child link="forearm"/>
    <axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" velocity="3" effort="100"/>
  </joint>
</robot>
"#;

/// The program.
pub(crate) fn dynid() -> Command {
    Command::cargo_bin("dynid").unwrap()
}

/// Text of `robots/indy7.toml`.
pub(crate) fn indy7() -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/indy7.toml")).unwrap()
}

/// Runs the program in a folder and expects an exit code.
#[track_caller]
pub(crate) fn run(folder: &Path, args: &[&str], code: i32) -> Output {
    let output = dynid().current_dir(folder).args(args).output().unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "dynid {}: {stderr}", args.join(" "));
    output
}
