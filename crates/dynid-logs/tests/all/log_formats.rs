//! Logs as tools write them: what is found out, which columns they have, what is refused.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::fs;

use dynid_logs::columns::{EffortColumn, MappingSpec, TimeReading};
use dynid_logs::log::{self, LogFormat, Missing, Wanted};
use dynid_logs::{ColumnMapping, LogFileError, LogHeader, LogSource, Signals, Table};
use dynid_testing::shared;

fn strings(list: &str) -> Vec<String> {
    list.split(',').map(str::to_owned).collect()
}

fn open(text: &str, spec: &MappingSpec) -> Result<Box<dyn LogSource>, LogFileError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    fs::write(&path, text).unwrap();
    // The file stays open when its folder goes.
    log::open(&path, &spec.options(None))
}

fn header(text: &str) -> LogHeader {
    open(text, &MappingSpec::default()).unwrap().header()
}

fn whole(text: &str) -> Table {
    let all = Wanted { columns: None, time: vec![], missing: Missing::Drop };
    open(text, &MappingSpec::default()).unwrap().read(&all).unwrap().0
}

fn notes(text: &str) -> Vec<String> {
    let text = open(text, &MappingSpec::default()).unwrap();
    text.notes().iter().map(|n| format!("{}: {}", n.setting, n.value)).collect()
}

/// Signals of a log with the unit of its time.
fn understood(text: &str, joints: &str, spec: &str) -> Result<(Signals, Option<TimeReading>), String> {
    let spec: MappingSpec = toml::from_str(spec).unwrap();
    let log = open(text, &spec).map_err(|e| e.to_string())?;
    let joints = strings(joints);
    let efforts = vec![EffortColumn::Drive; joints.len()];
    let mut mapping =
        ColumnMapping::of_log(&log.header(), &joints, &efforts, &spec).map_err(|e| e.to_string())?;
    let (table, _) = log.read(&mapping.wanted()).map_err(|e| e.to_string())?;
    let time = mapping.settle_time(&table, false).map_err(|e| e.to_string())?;
    Ok((mapping.extract(&table).map_err(|e| e.to_string())?, time))
}

/// Rows at 100 Hz of a joint that moves by 1 rad/s.
fn rows(header: &str, row: impl Fn(usize) -> String) -> String {
    (0..50).fold(format!("{header}\n"), |out, k| out + &row(k) + "\n")
}

#[test]
fn formats_are_recognised_by_their_columns() {
    for (text, format) in [
        ("__time,/joint_states/a/position\n0,1\n", Some(LogFormat::PlotJuggler)),
        ("%time,field.header.stamp,field.name0,field.position0\n5,5,a,1\n", Some(LogFormat::RostopicEcho)),
        ("1700000000,5,,a,1,2,3\n1700000000,6,,a,1,2,3\n", Some(LogFormat::Ros2TopicEcho)),
        ("timestamp actual_q_0 actual_qd_0\n0.1 1 2\n", Some(LogFormat::Rtde)),
        ("time,success_rate,state.q[0],state.tau_J[0]\n1,1,1,1\n", Some(LogFormat::Libfranka)),
        (
            "duration, success rate, q[0],q_d[0],tau_J[0],sent commands,q_d[0]\n1,1,1,1,1,,1\n",
            Some(LogFormat::Libfranka),
        ),
        ("t,q1,tau1\n0,1,2\n", None),
    ] {
        assert_eq!(header(text).format, format, "{text}");
    }
}

#[test]
fn delimiters_marks_and_lists() {
    let table = whole("t;q1\n0,5;1,25\n1;-2,5e-1\n");
    assert_eq!(table.columns, [[0.5, 1.0], [1.25, -0.25]]);
    // In quotes between commas, and between blanks.
    assert_eq!(whole("t,q1\n\"0,5\",\"1,25\"\n").columns, [[0.5], [1.25]]);
    assert_eq!(whole("t q1\n0,5 1,25\n").columns, [[0.5], [1.25]]);
    assert_eq!(whole("sep=;\nt;q1\n0,5;1\n").columns, [[0.5], [1.0]]);
    // Names without a header, however the numbers are separated.
    for text in ["0,5;1,25;3\n", "0.5\t1.25\t3\n", "0.5,1.25,3\n", " 0,5 1,25 3\n"] {
        let table = whole(text);
        assert_eq!(table.header, ["column1", "column2", "column3"], "{text}");
        assert_eq!(table.columns, [[0.5], [1.25], [3.0]], "{text}");
    }
    let table = whole("mode,t,q\non,0,\"[1, 2]\"\noff,1,\"[3, nan]\"\non,2,[]\n");
    assert_eq!(table.header, ["t", "q[0]", "q[1]"]);
    assert_eq!(table.columns[1][..2], [1.0, 3.0]);
    assert!(table.columns[2][1].is_nan() && table.columns[1][2].is_nan());
    assert_eq!(whole("t,q\n0,(1 2)\n").columns, [[0.0], [1.0], [2.0]]);
    // A delimiter behind the last field.
    assert_eq!(whole("t,q1\n0,1,\n2,3,\n").header, ["t", "q1", "column3"]);
    assert_eq!(notes("mode;t;q1\non;0,5;1\n"), ["decimal mark: comma", "skipped columns: mode"]);
}

#[test]
fn a_row_reads_alike_on_both_ways() {
    // The quick way and the one field by field: quotes force the second.
    let mut plain = String::from("t,q1,q2,note,stamp\n");
    let mut quoted = plain.clone();
    for k in 0..200 {
        let x = f64::from(k);
        let cells = [x * 0.1, (x * 0.37).sin() * 1e3, -(x * 1.7).cos() / 7.0];
        let row = cells.map(|c| c.to_string());
        plain += &format!("{},x,{}\n", row.join(","), 1_700_000_000_000_000_001_i64 + i64::from(k));
        quoted +=
            &format!("\"{}\",x,\"{}\"\n", row.join("\",\""), 1_700_000_000_000_000_001_i64 + i64::from(k));
    }
    let read = |text: &str| {
        let wanted = Wanted { columns: Some(vec![0, 1, 2, 4]), time: vec![4], missing: Missing::Error };
        open(text, &MappingSpec::default()).unwrap().read(&wanted).unwrap().0
    };
    let (a, b) = (read(&plain), read(&quoted));
    assert_eq!(a.columns, b.columns);
    assert_eq!((a.origin[3], &a.columns[3][..3]), (1_700_000_000_000_000_001, &[0.0, 1.0, 2.0][..]));
}

#[test]
fn no_digit_of_a_stamp_is_lost() {
    let stamp = |k: usize| 1_700_000_000_123_456_789_i64 + 10_000_000 * k as i64 + (k % 3) as i64;
    let exact = |k: usize| (stamp(k) - stamp(0)) as f64 / 1e9;
    let position = |k: usize| 0.01 * k as f64;
    let nanoseconds = rows("clock,q,tau", |k| format!("{},{},1", stamp(k), position(k)));
    let (signals, time) = understood(&nanoseconds, "j", "time = \"clock\"").unwrap();
    assert_eq!(time.unwrap().unit, "ns");
    assert!(signals.time.iter().enumerate().all(|(k, t)| *t == exact(k)));
    assert!((signals.time_origin - 1_700_000_000.123_456_8).abs() < 1e-6);
    let seconds = rows("t,q,tau", |k| {
        format!("{}.{:09},{},1", stamp(k) / 1_000_000_000, stamp(k) % 1_000_000_000, position(k))
    });
    let (signals, time) = understood(&seconds, "j", "").unwrap();
    assert_eq!(time.unwrap().unit, "s");
    // Fractions below a second are rounded once: to some 1e-16 s.
    assert!(signals.time.iter().enumerate().all(|(k, t)| (t - exact(k)).abs() < 1e-15));
    let apart = rows("sec,nanosec,q,tau", |k| {
        format!("{},{},{},1", stamp(k) / 1_000_000_000, stamp(k) % 1_000_000_000, position(k))
    });
    let (signals, _) = understood(&apart, "j", "").unwrap();
    assert!(signals.time.iter().enumerate().all(|(k, t)| (t - exact(k)).abs() < 1e-15));
}

#[test]
fn the_mapping_goes_before_names() {
    // A column that is called like a time may be none, and any other may be one, of any size.
    let text = rows("t,clock,q,tau", |k| format!("7,{},{},1", 1e15 + 1e4 * k as f64, 0.01 * k as f64));
    let (signals, _) = understood(&text, "j", "time = { columns = \"clock\", unit = \"us\" }").unwrap();
    assert!((signals.time[49] - 0.49).abs() < 1e-12);
    // Sentinels in signals are refused, in columns that are not used they do not matter.
    let text = rows("t,q,tau,other", |k| format!("{},{},1,1e300", 0.01 * k as f64, 0.01 * k as f64));
    assert!(understood(&text, "j", "").is_ok());
    let error = understood(&text, "j", "effort = \"other\"").unwrap_err();
    assert!(error.contains("row 1 (line 2)") && error.contains("1e300"), "{error}");
    let text = rows("t,q,q_des,tau", |k| format!("{},{},x,1", 0.01 * k as f64, 0.01 * k as f64));
    assert!(understood(&text, "j", "").is_ok());
    let error = understood(&text, "j", "position = \"q_des\"").unwrap_err();
    assert!(error.contains("a number, found `x`"), "{error}");
}

#[test]
fn joints_of_messages_decide_the_order() {
    let echo = rows(
        "%time,field.header.stamp,field.name0,field.name1,field.position0,field.position1,field.effort0,field.effort1",
        |k| {
            let stamp = 10_000_000 * (k as i64 + 1);
            format!("{},{stamp},b,a,{},2,3,4", stamp + 1, 0.01 * k as f64)
        },
    );
    let (signals, time) = understood(&echo, "a,b", "").unwrap();
    assert_eq!((signals.position[0][9], signals.position[1][9]), (2.0, 0.09));
    assert_eq!(signals.effort.unwrap()[0][0], 4.0);
    assert_eq!(time.unwrap().unit, "ns");
    // The names of the file are known too.
    let stated = "position = [\"field.position1\", \"field.position0\"]";
    assert_eq!(understood(&echo, "a,b", stated).unwrap().0.position[0][9], 2.0);
    // Stamps that do not advance give way to those of the receiver.
    let still = echo.replace(",10000000,", ",0,");
    assert_eq!(header(&still).time, [1]);
    let never = rows("%time,field.header.stamp,field.name0,field.position0", |k| format!("{k},0,a,1"));
    assert_eq!(header(&never).time, [0]);
}

#[test]
fn patterns_and_lists_name_columns() {
    let text = rows("t,/js/a/pos,/js/b/pos,tau", |k| {
        format!("{},{},2,\"[5, 6]\"", 0.01 * k as f64, 0.01 * k as f64)
    });
    let spec = "position = \"/js/{joint}/pos\"\neffort = \"tau\"";
    let (signals, _) = understood(&text, "b,a", spec).unwrap();
    assert_eq!((signals.position[0][5], signals.position[1][5]), (2.0, 0.05));
    assert_eq!(signals.effort.unwrap(), [[5.0; 50], [6.0; 50]]);
    let error = understood(&text, "a", "position = \"/js/{joint}/pos\"\neffort = \"tau\"").unwrap_err();
    assert!(error.contains("expected 1") && error.contains("found 2"), "{error}");
}

#[test]
fn rows_without_a_value_follow_the_policy() {
    let text = rows("t,q,tau,unused", |k| {
        let cell = |missing: bool, x: f64| if missing { String::new() } else { x.to_string() };
        format!("{},{},{},", 0.01 * k as f64, cell(k == 7, 0.01 * k as f64), cell(k % 10 == 3, k as f64))
    });
    let error = understood(&text, "j", "").unwrap_err();
    assert!(error.contains("row 4 (line 5), column `tau`") && error.contains("``"), "{error}");
    let (signals, _) = understood(&text, "j", "missing = \"drop\"").unwrap();
    assert_eq!((signals.time.len(), signals.sparse.left_out), (44, 6));
    let kept = signals.rows.unwrap();
    assert!(!kept.contains(&7) && !kept.contains(&13) && kept.contains(&8));
    let (signals, _) = understood(&text, "j", "missing = \"interpolate\"").unwrap();
    assert_eq!((signals.time.len(), signals.sparse.left_out, signals.sparse.interpolated), (49, 1, 5));
    let effort = &signals.effort.unwrap()[0];
    assert!((effort[3] - 3.0).abs() < 1e-12);
    // Topics that share no row.
    let apart = rows("__time,/a/j/position,/b/j/effort", |k| match k % 2 {
        0 => format!("{},{},", 0.01 * k as f64, 0.01 * k as f64),
        _ => format!("{},,{k}", 0.01 * k as f64),
    });
    let error = understood(&apart, "j", "").unwrap_err();
    assert!(error.contains("/b/j/effort") && error.contains("found all signals in 0"), "{error}");
    let (signals, _) = understood(&apart, "j", "missing = \"interpolate\"").unwrap();
    let effort = &signals.effort.unwrap()[0];
    assert!(effort.iter().enumerate().all(|(k, e)| (e - (2 * k + 2) as f64).abs() < 1e-12), "{effort:?}");
    assert_eq!(signals.position[0][0], 0.02);
}

#[test]
fn commands_of_another_topic_are_held_and_measurements_interpolated() {
    // Efforts are commanded every fourth row, temperatures measured there; positions are the other rows.
    let text =
        rows("__time,/state/j/position,/controller/commands/j/effort,/state/j/temperature", |k| {
            match k % 4 {
                0 => format!("{},,{k},{}", 0.01 * k as f64, 20.0 + 0.1 * k as f64),
                _ => format!("{},{},,", 0.01 * k as f64, 0.01 * k as f64),
            }
        });
    let (signals, _) = understood(&text, "j", "missing = \"interpolate\"").unwrap();
    let (effort, temperature) =
        (&signals.effort.unwrap()[0], signals.temperature.unwrap()[0].clone().unwrap());
    let rows = signals.rows.unwrap();
    assert_eq!(rows[..4], [1, 2, 3, 5]);
    for ((row, effort), temperature) in rows.iter().zip(effort).zip(temperature) {
        assert_eq!(*effort, (row - row % 4) as f64, "row {row}");
        assert!((temperature - 20.0 - 0.1 * *row as f64).abs() < 1e-12, "row {row}");
    }
    assert_eq!((signals.sparse.held, signals.sparse.interpolated), (37, 36));
}

/// Columns of a robot in a log of its own kind, with what has to be stated.
fn columns_of(names: &[String], joints: &str, spec: &str) -> ColumnMapping {
    let header = LogHeader::of_names(names);
    let joints = strings(joints);
    let spec: MappingSpec = toml::from_str(spec).unwrap();
    ColumnMapping::of_log(&header, &joints, &vec![EffortColumn::Drive; joints.len()], &spec).unwrap()
}

#[test]
fn logs_of_arms_as_their_drivers_call_them() {
    let used = |list: &[Option<dynid_logs::columns::ColumnUse>]| -> Vec<String> {
        list.iter().flatten().map(|c| c.name.clone()).collect()
    };
    // KUKA iiwa: `LBRState` of the driver of its Fast Robot Interface, and the status message of Drake.
    for (before, position, effort, others) in [
        (
            "/lbr/state/",
            "measured_joint_position",
            "measured_torque",
            ["commanded_torque", "external_torque", "ipo_joint_position"],
        ),
        (
            "",
            "joint_position_measured",
            "joint_torque_measured",
            ["joint_position_commanded", "joint_torque_commanded", "joint_torque_external"],
        ),
    ] {
        let of = |field: &str| (0..7).map(|k| format!("{before}{field}[{k}]")).collect::<Vec<String>>();
        let mut names = vec!["time".to_owned()];
        names.extend([position, effort].iter().chain(&others).flat_map(|field| of(field)));
        let found = columns_of(&names, "a1,a2,a3,a4,a5,a6,a7", "");
        assert_eq!(used(&found.position), of(position));
        assert_eq!(used(&found.effort.unwrap()), of(effort));
    }
    // Kinova Gen3: feedback of actuators in degrees.
    let of = |field: &str| {
        (0..6).map(|k| format!("/base_feedback/actuators[{k}]/{field}")).collect::<Vec<String>>()
    };
    let mut names = vec!["time".to_owned()];
    names.extend(["position", "velocity", "torque", "current_motor"].iter().flat_map(|field| of(field)));
    let spec = "position = { columns = \"/base_feedback/actuators[{}]/position\", unit = \"deg\" }\n\
                velocity = { columns = \"/base_feedback/actuators[{}]/velocity\", unit = \"deg/s\" }\n\
                effort = \"/base_feedback/actuators[{}]/torque\"";
    let found = columns_of(&names, "joint_1,joint_2,joint_3,joint_4,joint_5,joint_6", spec);
    assert_eq!(used(&found.position), of("position"));
    assert_eq!(found.position[0].as_ref().unwrap().factor, std::f64::consts::PI / 180.0);
    assert_eq!(used(&found.effort.unwrap()), of("torque"));
    // OpenArm by LeRobot: positions, rates and torques beside each other in the state.
    let joints = ["joint_1", "joint_2"];
    let mut names = strings("timestamp,episode_index");
    names.extend(
        joints.iter().flat_map(|j| ["pos", "vel", "torque"].map(|s| format!("observation.state/{j}.{s}"))),
    );
    let text = rows(&names.join(","), |k| format!("{},0,{k},0,1,{k},0,2", 0.01 * k as f64));
    let log = open(&text, &MappingSpec::default()).unwrap();
    assert_eq!(log.header().format, Some(LogFormat::LeRobot));
    let efforts = [EffortColumn::Drive; 2];
    let found =
        ColumnMapping::of_log(&log.header(), &strings("joint_1,joint_2"), &efforts, &MappingSpec::default())
            .unwrap();
    for (list, signal) in
        [(&found.position, "pos"), (&found.velocity.unwrap(), "vel"), (&found.effort.unwrap(), "torque")]
    {
        assert_eq!(used(list), joints.map(|j| format!("observation.state/{j}.{signal}")));
    }
}

#[test]
fn headers_with_faults_are_refused() {
    let spec = |text: &str| toml::from_str::<MappingSpec>(text).unwrap();
    for (text, keys, parts) in [
        ("t,q1,q1\n0,1,2\n", "", vec!["`q1` in columns 2 and 3"]),
        ("t,q1\n0,1\n", "names = [\"a\", \"b\"]", vec!["without a header", "`t,q1`"]),
        ("0,1\n1,2\n", "names = [\"a\"]", vec!["expected 2 names", "found 1"]),
        ("t,q1\n0,1\n", "ignore = [\"mode\"]", vec!["`mode`"]),
        ("t;q1\n1,234;5,678\n", "", vec!["`t`", "`1,234`", "thousands"]),
        ("t;q1\n0.5;5,678\n", "", vec!["`5,678`", "`0.5`", "one decimal mark"]),
        ("t;q1\n1;1.234,5\n", "", vec!["`q1`", "`1.234,5`", "thousands"]),
        ("", "", vec!["empty file"]),
    ] {
        let error = open(text, &spec(keys)).map(|_| ()).unwrap_err();
        assert!(error.hint().is_some());
        for part in parts {
            assert!(error.to_string().contains(part), "`{part}`: {error}");
        }
    }
    // Said to be a decimal comma, it is one; said to be a point, the comma is no number.
    let text = rows("t;q;tau", |k| format!("{k};1,234;1"));
    assert_eq!(understood(&text, "j", "decimal = \",\"\nrate_hz = 100").unwrap().0.position[0][0], 1.234);
    let error = understood(&text, "j", "decimal = \".\"\nrate_hz = 100").unwrap_err();
    assert!(error.contains("`1,234`"), "{error}");
}

#[test]
fn a_recorded_log_with_lists_in_cells() {
    let Some(recorded) = shared("data/so101-sage/multisine_state_motor_as_recorded.csv.gz") else { return };
    let spec = MappingSpec::default();
    let log = log::open(&recorded, &spec.options(None)).unwrap();
    let joints = strings("a,b,c,d,e,f");
    let mut mapping =
        ColumnMapping::of_log(&log.header(), &joints, &[EffortColumn::Drive; 6], &spec).unwrap();
    let (table, _) = log.read(&mapping.wanted()).unwrap();
    let time = mapping.settle_time(&table, false).unwrap().unwrap();
    // Its README says 49.9 Hz and microseconds.
    assert_eq!(time.unit, "us");
    assert!((time.rate_hz - 49.9).abs() < 0.2, "{}", time.rate_hz);
    assert!(mapping.extract(&table).unwrap().effort.is_some_and(|e| e.len() == 6));
}
