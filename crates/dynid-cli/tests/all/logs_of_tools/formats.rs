//! One log in the formats of many tools.

use super::arm::{Arm, arm, nanoseconds};
use super::{one_command, two_commands};

#[track_caller]
fn says(said: &str, parts: &[&str]) {
    for part in parts {
        assert!(said.contains(part), "`{part}` is not in {said}");
    }
}

/// Series in alphabetical order, cells empty where a series has no sample; another topic has stamps of its own.
fn plot_juggler() -> String {
    let Arm { q, dq, tau, .. } = arm();
    let series = [("effort", tau), ("position", q), ("velocity", dq)];
    let names = ["elbow", "shoulder"]
        .map(|joint| series.map(|(signal, _)| format!("/joint_states/{joint}/{signal}")).join(","));
    let header = format!("__time,/camera/fps,/joint_states/header/stamp,{}", names.join(","));
    arm().rows(&header, |k, t| {
        let cells = [1, 0].map(|joint| series.map(|(_, list)| format!("{:.9}", list[joint][k])).join(","));
        let at = 1_700_000_000.0 + t;
        let other = format!("{:.6},30.000000000,,,,,,,\n", at + 0.003);
        let own = format!("{at:.6},,{at:.9},{}", cells.join(","));
        if k % 3 == 0 { other + &own } else { own }
    })
}

#[test]
fn plot_juggler_export() {
    let parts = ["PlotJuggler CSV export", "counts from 1970 in s", "drop, 667 of"];
    says(&one_command(&plot_juggler(), &[]), &parts);
    let said = two_commands(&plot_juggler(), &[]);
    says(&said, &["position = \"/joint_states/{joint}/position\"", "missing = \"drop\""]);
}

#[test]
fn plot_juggler_export_of_topics_with_stamps_of_their_own() {
    // Efforts come on a topic of their own, a third of a step later: no row has both. NaN stands beside empty cells.
    let Arm { q, tau, .. } = arm();
    let header = "__time,/joint_states/elbow/position,/joint_states/shoulder/position,/torques/elbow/effort,/torques/shoulder/effort";
    let step = 0.01 / 3.0;
    let between = |list: &[f64], k: usize| {
        let next = list.get(k + 1).copied().unwrap_or(list[k]);
        list[k] + (next - list[k]) / 3.0
    };
    let log = arm().rows(header, |k, t| {
        format!(
            "{:.6},{:.9},{:.9},nan,NaN\n{:.6},,,{:.9},{:.9}",
            t,
            q[1][k],
            q[0][k],
            t + step,
            between(&tau[1], k),
            between(&tau[0], k)
        )
    });
    let said = two_commands(&log, &[]);
    says(&said, &["missing = \"interpolate\"", "PlotJuggler"]);
}

/// Messages name their joints, which come in alphabetical order; a gripper publishes on the same topic.
fn ros2_topic_echo() -> String {
    let Arm { q, dq, tau, .. } = arm();
    arm().rows("", |k, t| {
        let stamp = nanoseconds(t);
        let (sec, nanosec) = (stamp / 1_000_000_000, stamp % 1_000_000_000);
        let pair = |list: &[Vec<f64>; 2]| format!("{},{}", list[1][k], list[0][k]);
        let arm = format!("{sec},{nanosec},base_link,elbow,shoulder,{},{},{}", pair(q), pair(dq), pair(tau));
        match k % 10 {
            0 => format!("{arm}\n{sec},{nanosec},,finger,0.02,0.0,0.0"),
            _ => arm,
        }
    })
}

#[test]
fn ros2_topic_echo_csv() {
    let said = two_commands(&ros2_topic_echo(), &[]);
    says(
        &said,
        &["ros2 topic echo --csv", "joint order: elbow, shoulder, finger", "position = \"position.{joint}\""],
    );
    one_command(&ros2_topic_echo(), &[]);
}

#[test]
fn rostopic_echo_p() {
    let Arm { q, dq, tau, .. } = arm();
    let fields =
        ["name", "position", "velocity", "effort"].map(|f| format!("field.{f}0,field.{f}1")).join(",");
    let header = format!("%time,field.header.seq,field.header.stamp,field.header.frame_id,{fields}");
    let log = arm().rows(&header, |k, t| {
        let stamp = nanoseconds(t);
        let pair = |list: &[Vec<f64>; 2]| format!("{},{}", list[1][k], list[0][k]);
        // The recorder receives messages up to 3 ms late.
        let received = stamp + 1_000_000 * (k as i64 % 4);
        format!("{received},{k},{stamp},,elbow,shoulder,{},{},{}", pair(q), pair(dq), pair(tau))
    });
    let parts = ["rostopic echo -p", "elbow, shoulder", "`field.header.stamp` in ns"];
    says(&one_command(&log, &[]), &parts);
    two_commands(&log, &[]);
}

#[test]
fn ur_rtde_recording() {
    // Motor currents under drive gains of 11.5 and 9 N m/A; the controller's own targets stand beside.
    let Arm { q, dq, tau, .. } = arm();
    let header = "timestamp actual_q_0 actual_q_1 actual_qd_0 actual_qd_1 actual_current_0 actual_current_1 target_current_0 target_current_1 runtime_state";
    let log = arm().rows(header, |k, t| {
        let current = [tau[0][k] / 11.5, tau[1][k] / 9.0];
        format!(
            "{:.3} {} {} {} {} {} {} {:.3} {:.3} 2",
            84_210.5 + t,
            q[0][k],
            q[1][k],
            dq[0][k],
            dq[1][k],
            current[0],
            current[1],
            current[0],
            current[1]
        )
    });
    says(&one_command(&log, &["--gains", "11.5,9"]), &["UR RTDE recording"]);
    says(&two_commands(&log, &["--gains", "11.5,9"]), &["current_gains = [11.5, 9.0]"]);
    super::refused(
        &log,
        &["identify", "robot.urdf", "--log", "log.csv", "--out", "out"],
        &["effort of `shoulder`, `elbow`"],
        "current_gains = [..]",
    );
}

#[test]
fn libfranka_log() {
    // Time in milliseconds without a unit, commands and external torques beside the measured signals.
    let Arm { q, dq, tau, .. } = arm();
    let group = |name: &str| format!("{name}[0],{name}[1]");
    let header = [
        "state.q",
        "state.q_d",
        "state.dq",
        "state.dq_d",
        "state.tau_J",
        "state.tau_ext_hat_filtered",
        "cmd.q_d",
        "cmd.tau_J_d",
    ]
    .map(group)
    .join(",");
    let log = arm().rows(&format!("time,success_rate,{header}"), |k, t| {
        let pair = |list: &[Vec<f64>; 2]| format!("{},{}", list[0][k], list[1][k]);
        let (q, dq, tau) = (pair(q), pair(dq), pair(tau));
        format!("{:.0},0.99,{q},{q},{dq},{dq},{tau},0.1,0.2,{q},{tau}", 1000.0 * t)
    });
    says(&one_command(&log, &[]), &["libfranka log", "`time` in ms"]);
    two_commands(&log, &[]);
}

#[test]
fn older_libfranka_log() {
    // Names that come twice, an empty column between state and commands.
    let Arm { q, dq, tau, .. } = arm();
    let group = |name: &str| format!("{name}[0], {name}[1]");
    let state = ["q", "q_d", "dq", "dq_d", "tau_J", "tau_ext_hat_filtered"].map(group).join(",");
    let sent = ["q_d", "dq_d", "tau_J_d"].map(group).join(",");
    let log = arm().rows(&format!("duration, success rate, {state},sent commands,{sent}"), |k, t| {
        let pair = |list: &[Vec<f64>; 2]| format!("{},{}", list[0][k], list[1][k]);
        let (q, dq, tau) = (pair(q), pair(dq), pair(tau));
        format!("{:.0},1,{q},{q},{dq},{dq},{tau},0,0,,{q},{dq},{tau}", 1000.0 * t)
    });
    says(&two_commands(&log, &[]), &["libfranka log"]);
}

#[test]
fn recording_with_lists_in_cells() {
    let Arm { q, dq, tau, .. } = arm();
    let log = arm().rows("type,timestamp,positions,velocities,torques", |k, t| {
        let list = |list: &[Vec<f64>; 2]| format!("\"[{}, {}]\"", list[0][k], list[1][k]);
        format!("STATE_MOTOR,{},{},{},{}", 4.956_964 + 1e6 * t, list(q), list(dq), list(tau))
    });
    let said = one_command(&log, &[]);
    says(&said, &["list cells", "positions, velocities, torques", "`timestamp` in us", "skipped columns"]);
    two_commands(&log, &[]);
}

#[test]
fn spreadsheet_with_semicolons_and_decimal_commas() {
    let header = "\u{feff}t;q_shoulder;q_elbow;dq_shoulder;dq_elbow;tau_shoulder;tau_elbow\r";
    let log = arm().rows(header, |k, t| format!("{t:.3};{}\r", arm().signals(k, ";")).replace('.', ","));
    says(&one_command(&log, &[]), &["decimal mark", "comma"]);
    two_commands(&log, &[]);
}

#[test]
fn nanoseconds_since_1970() {
    let header = "header.stamp,q1,q2,dq1,dq2,tau1,tau2";
    let log = arm().rows(header, |k, t| format!("{},{}", nanoseconds(t), arm().signals(k, ",")));
    says(&one_command(&log, &[]), &["`header.stamp` in ns, 100.0000 Hz", "counts from 1970"]);
    says(&two_commands(&log, &[]), &["time = { columns = \"header.stamp\", unit = \"ns\" }"]);
}

#[test]
fn seconds_and_nanoseconds_apart() {
    let header = "stamp.sec,stamp.nanosec,q1,q2,dq1,dq2,tau1,tau2";
    let log = arm().rows(header, |k, t| {
        let stamp = nanoseconds(t);
        format!("{},{},{}", stamp / 1_000_000_000, stamp % 1_000_000_000, arm().signals(k, ","))
    });
    says(&one_command(&log, &[]), &["`stamp.sec` + `stamp.nanosec`"]);
    two_commands(&log, &[]);
}

#[test]
fn numbers_without_a_header() {
    // Positions, velocities and efforts are told apart by their numbers.
    let log = arm().rows("", |k, t| format!("{t} {}", arm().signals(k, " ")));
    says(&one_command(&log, &[]), &["column2 column3", "one block of columns is the rate of another"]);
    two_commands(&log, &[]);
    // Positions and efforts alone are not: their names are asked for.
    let Arm { q, tau, .. } = arm();
    let log = arm().rows("", |k, t| format!("{t},{},{},{},{}", q[0][k], q[1][k], tau[0][k], tau[1][k]));
    let identify = ["identify", "robot.urdf", "--log", "log.csv", "--out", "out"];
    super::refused(
        &log,
        &identify,
        &["column names", "5 columns"],
        "names = [\"t\", \"q1\", \"q2\", .., \"tau1\", \"tau2\", ..]",
    );
    one_command(&log, &["--names", "t,q1,q2,tau1,tau2"]);
}

#[test]
fn empty_cells_and_nan_are_left_out_where_that_is_said() {
    let header = "t,q1,q2,dq1,dq2,tau1,tau2,note";
    let log = arm().rows(header, |k, t| match k % 200 {
        77 => format!("{t},{},ok", arm().signals(k, ",").replacen(&arm().q[1][k].to_string(), "NaN", 1)),
        78 => format!("{t},,,,,,,lost"),
        _ => format!("{t},{},ok", arm().signals(k, ",")),
    });
    let identify = ["identify", "robot.urdf", "--log", "log.csv", "--out", "out"];
    super::refused(&log, &identify, &["row 78", "column `q2`", "NaN"], "missing = \"drop\"");
    says(&one_command(&log, &["--missing", "drop"]), &["drop, 20 of 2001 rows left out"]);
    says(&two_commands(&log, &[]), &["missing = \"drop\""]);
}
