//! Logs: reading, finding columns, units, writing, states.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::fs;

use dynid_logs::columns::{MappingSpec, degrees_suspected};
use dynid_logs::csv::{self, ReadOptions};
use dynid_logs::{ColumnMapping, GuessOptions, Signals, StateJoint, Table, states};

fn table(text: &str, options: &ReadOptions) -> Table {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    fs::write(&path, text).unwrap();
    csv::read(&path, options).unwrap()
}

fn strings(list: &str) -> Vec<String> {
    list.split(',').map(str::to_owned).collect()
}

fn signals(text: &str, joints: &str, spec: &str) -> Signals {
    let table = table(text, &ReadOptions::default());
    let spec: MappingSpec = toml::from_str(spec).unwrap();
    let mapping = ColumnMapping::from_spec(&table.header, &strings(joints), &spec).unwrap();
    mapping.extract(&table).unwrap()
}

#[test]
fn delimiters_quotes_comments_and_line_ends() {
    for text in [
        "t,q1\n0,1.5\n1,-2e-3\n",
        "\u{feff}t;q1\r\n0;1.5\r\n1;-2e-3",
        "# made by hand\nt\tq1\n\n0\t1.5\n# middle\n1\t-2e-3\n",
        "  t   q1\n  0   1.5\n 1 -2e-3\n",
        "\"t\", \"q1\"\n\"0\", 1.5\n 1 ,\"-2e-3\"\n",
    ] {
        let table = table(text, &ReadOptions::default());
        assert_eq!(table.header, ["t", "q1"], "{text}");
        assert_eq!(table.columns, [[0.0, 1.0], [1.5, -2e-3]], "{text}");
    }
}

#[test]
fn the_digest_is_of_the_whole_file_however_much_of_it_is_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    let mut text = "t,q1\n".to_owned();
    for row in 0..100_000 {
        text += &format!("{row},{}\n", f64::from(row).sin());
    }
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    std::io::Write::write_all(&mut packed, text.as_bytes()).unwrap();
    for bytes in [text.into_bytes(), packed.finish().unwrap()] {
        fs::write(&path, &bytes).unwrap();
        for rows in [None, Some((1, 3))] {
            let table = csv::read(&path, &ReadOptions { rows, ..ReadOptions::default() }).unwrap();
            assert_eq!(table.sha256, dynid_files::digest::sha256(&bytes), "{rows:?}");
        }
    }
}

#[test]
fn ranges_ignored_columns_and_large_stamps() {
    let text =
        "stamp,mode,q1\n1700000000000000000,on,1\n1700000000010000000,off,2\n1700000000020000000,on,3\n";
    let options = ReadOptions { rows: Some((2, 3)), ignore: vec!["mode".into()], ..ReadOptions::default() };
    let table = table(text, &options);
    assert_eq!((table.rows, table.first_row), (2, 2));
    assert_eq!(table.header, ["stamp", "q1"]);
    assert_eq!(table.columns[1], [2.0, 3.0]);
    let spec: MappingSpec =
        toml::from_str("time = { columns = \"stamp\", unit = \"ns\" }\nallow_no_effort = true").unwrap();
    let signals =
        ColumnMapping::from_spec(&table.header, &strings("j"), &spec).unwrap().extract(&table).unwrap();
    // Nanoseconds since 1970 are 256 ns apart in f64.
    assert!(signals.time[0] == 0.0 && (signals.time[1] - 0.01).abs() <= 256e-9);
    assert!((signals.time_origin - 1_700_000_000.01).abs() < 1e-6);
}

#[test]
fn written_numbers_read_back_to_the_bit() {
    let folder = tempfile::tempdir().unwrap();
    let values =
        vec![0.1, -0.0, 1.0 / 3.0, 5e-324, 123_456_789.123, 1e11, -2.5e-7, 1e-5, 9007199254740991e-6];
    let columns = [values.clone(), values.iter().rev().copied().collect()];
    for name in ["out.csv", "out.csv.gz"] {
        let path = folder.path().join(name);
        csv::write(&path, &["a, b", "q\"1"], &columns).unwrap();
        let table = csv::read(&path, &ReadOptions::default()).unwrap();
        assert_eq!(table.header, ["a, b", "q\"1"]);
        for (found, expected) in table.columns.iter().zip(&columns) {
            assert!(found.iter().zip(expected).all(|(a, b)| a.to_bits() == b.to_bits()));
        }
        let raw = fs::read(&path).unwrap();
        assert_eq!(raw.starts_with(&[0x1f, 0x8b]), name.ends_with("gz"));
    }
    let bad = folder.path().join("bad.csv");
    let error = csv::write(&bad, &["q1"], &[vec![0.0, f64::NAN]]).unwrap_err();
    assert!(error.to_string().contains("row 2, column `q1`"), "{error}");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
}

#[test]
fn names_of_many_tools_are_found() {
    let joints = strings("shoulder,Elbow");
    for header in [
        "t,q1,q2,qd1,qd2,tau1,tau2",
        "Time,Position1,Position2,Velocity1,Velocity2,Torque1,Torque2",
        "timestamp,q_shoulder,q_elbow,dq_shoulder,dq_elbow,tau_shoulder,tau_elbow",
        "time,shoulder.position,elbow.position,shoulder.velocity,elbow.velocity,shoulder.effort,elbow.effort",
        "time[s],q[0],q[1],dq[0],dq[1],tau[0],tau[1]",
        "t,pos0,pos1,v0,v1,u0,u1",
        "t,qm1,qm2,shoulder_v,elbow_v,effort_1,effort_2,qm_des1,tau_des1",
        "t_s,q1_rad,q2_rad,dq1 (rad/s),dq2 (rad/s),tau1_Nm,tau2_Nm",
    ] {
        let header = strings(header);
        let m = ColumnMapping::guess(&header, &joints, &GuessOptions::default())
            .unwrap_or_else(|e| panic!("{header:?}: {e}"));
        let columns = |list: &[Option<dynid_logs::columns::ColumnUse>]| -> Vec<usize> {
            list.iter().map(|c| c.as_ref().unwrap().column).collect()
        };
        assert_eq!(columns(&m.position), [1, 2], "{header:?}");
        assert_eq!(columns(m.velocity.as_ref().unwrap()), [3, 4], "{header:?}");
        assert_eq!(columns(m.effort.as_ref().unwrap()), [5, 6], "{header:?}");
        assert_eq!(m.acceleration, None);
    }
}

#[test]
fn units_scales_and_offsets_end_in_si() {
    let s = signals(
        "time_ms,q1[deg],q2[mm],i1,i2,T1,T2,force\n0,180,1000,2,4,20,30,5\n500,-90,250,-1,1,20,30,6\n",
        "j,slide",
        "current_gains = [0.5, -10]\nchannels = { grip = { column = \"force\", scale = 2.0, offset = 1.0 } }",
    );
    assert_eq!(s.time, [0.0, 0.5]);
    assert!((s.position[0][0] - std::f64::consts::PI).abs() < 1e-15);
    assert_eq!(s.position[1], [1.0, 0.25]);
    assert_eq!(s.effort.unwrap(), [[1.0, -0.5], [-40.0, -10.0]]);
    assert_eq!(s.temperature.unwrap()[1], Some(vec![30.0, 30.0]));
    assert_eq!(s.channels, [("grip".to_owned(), vec![11.0, 13.0])]);

    let s = signals(
        "a,b,cur\n0,1,3\n1,2,4\n",
        "j1,finger",
        "rate_hz = 4\nallow_unlogged = true\n\
         position = { columns = { j1 = \"b\" }, unit = \"rev\", scale = { j1 = -0.5 }, offset = 1 }\n\
         effort = { columns = [\"cur\", \"\"], unit = [\"mA\", \"N m\"], scale = 100 }",
    );
    assert_eq!((s.time, s.joints, s.not_logged), (vec![0.0, 0.25], strings("j1"), strings("finger")));
    assert!((s.position[0][0] - (1.0 - std::f64::consts::PI)).abs() < 1e-15);
    let effort = s.effort.unwrap();
    assert!((effort[0][1] - 0.4).abs() < 1e-16 && effort.len() == 1);
}

#[test]
fn one_joint_needs_no_numbers_and_capital_t_beside_t_is_a_temperature() {
    let s = signals("t,q,dq,ddq,tau,T\n0,1,2,3,4,30\n", "axis", "");
    assert_eq!(
        (s.time, s.position, s.temperature),
        (vec![0.0], vec![vec![1.0]], Some(vec![Some(vec![30.0])]))
    );
    let s = signals("T,q,tau\n0,1,2\n", "axis", "");
    assert_eq!((s.time, s.temperature), (vec![0.0], None));
}

#[test]
fn degrees_where_radians_are_said() {
    let arm = [Some((-3.0, 3.0)), Some((-2.0, 2.0))];
    let evidence = degrees_suspected(&[vec![0.0, 100.0], vec![-90.0, 5.0]], &arm).unwrap();
    assert_eq!((evidence.joint, evidence.largest, evidence.limit), (1, 90.0, Some(2.0)));
    assert_eq!(degrees_suspected(&[vec![2.5], vec![-1.9]], &arm), None);
    // A damaged value makes no sense in degrees either.
    assert_eq!(degrees_suspected(&[vec![1e6], vec![0.0]], &arm), None);
    let free = [None, None];
    assert!(degrees_suspected(&[vec![40.0], vec![1.0]], &free).is_some());
    assert_eq!(degrees_suspected(&[vec![6.0], vec![1.0]], &free), None);
}

#[test]
fn states_by_name_by_number_and_floating() {
    let scalar = [StateJoint::Scalar("a".into()), StateJoint::Scalar("b".into())];
    for header in ["q_a,q_b,dq_a,dq_b,ddq_a,ddq_b", "q1,q2,qd1,qd2,qdd1,qdd2"] {
        let s = states::from_table(
            &table(&format!("{header},gx,gy,gz,tau1\n1,2,3,4,5,6,0,0,-9.81,7\n"), &ReadOptions::default()),
            &scalar,
        )
        .unwrap();
        assert_eq!(
            (&s.position, &s.velocity, &s.acceleration),
            (&vec![vec![1.0], vec![2.0]], &vec![vec![3.0], vec![4.0]], &vec![vec![5.0], vec![6.0]])
        );
        assert_eq!(s.gravity.unwrap()[2], [-9.81]);
    }
    let joints = [StateJoint::Floating("root".into()), StateJoint::Scalar("a".into())];
    let rates = |p: &str| ["vx", "vy", "vz", "wx", "wy", "wz"].map(|s| format!("{p}_root.{s}")).join(",");
    let header = format!(
        "q_root.x,q_root.y,q_root.z,q_root.qx,q_root.qy,q_root.qz,q_root.qw,q_a,{},dq_a,{},ddq_a",
        rates("dq"),
        rates("ddq")
    );
    let values: Vec<String> = (0..8)
        .map(|k| if k == 6 { "1.0002".into() } else { "0".into() })
        .chain((0..14).map(|k| k.to_string()))
        .collect();
    let s = states::from_table(
        &table(&format!("{header}\n{}\n", values.join(",")), &ReadOptions::default()),
        &joints,
    )
    .unwrap();
    assert_eq!((s.position.len(), s.velocity.len()), (8, 7));
    assert_eq!((s.position[6][0], s.acceleration[6][0]), (1.0, 13.0));
}
