//! Corruptions of a clean log, several sizes each: found, rightly named, and put right by the corrected configuration.

#![expect(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "helpers of tests outside of test functions; what was found is said"
)]

use std::path::{Path, PathBuf};

use dynid::Config;
use dynid::check::{Check, Severity, check};
use dynid::config::LogConfig;
use dynid::identify;
use dynid::io::csv::{ReadOptions, read};
use dynid_testing::shared;

const JOINTS: usize = 6;

fn example(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../examples/indy7").join(name)
}

/// The example's log: columns `t`, `q_j1` .. `q_j6`, `tau_j1` .. `tau_j6`, and velocities made of the positions.
#[derive(Clone)]
struct Record {
    header: Vec<String>,
    columns: Vec<Vec<f64>>,
}

impl Record {
    fn clean() -> Self {
        let table = read(example("train.csv.gz"), &ReadOptions::default()).unwrap();
        let mut record = Record { header: table.header, columns: table.columns };
        for joint in 1..=JOINTS {
            let q = record.columns[joint].clone();
            // The mean slope over nine samples: encoder noise is not what is looked for.
            let slope = |k: usize| {
                let (a, b) = (k.saturating_sub(4), (k + 4).min(q.len() - 1));
                (q[b] - q[a]) / (record.columns[0][b] - record.columns[0][a])
            };
            let speed: Vec<f64> = (0..q.len()).map(slope).collect();
            record.header.push(format!("dq_j{joint}"));
            record.columns.push(speed);
        }
        record
    }

    fn rows(&self) -> usize {
        self.columns[0].len()
    }

    fn position(&mut self, joint: usize) -> &mut Vec<f64> {
        &mut self.columns[joint]
    }

    fn effort(&mut self, joint: usize) -> &mut Vec<f64> {
        &mut self.columns[JOINTS + joint]
    }

    fn velocity(&mut self, joint: usize) -> &mut Vec<f64> {
        &mut self.columns[2 * JOINTS + joint]
    }

    fn swap(&mut self, a: usize, b: usize) {
        self.columns.swap(a, b);
    }

    fn remove_rows(&mut self, range: std::ops::Range<usize>) {
        for column in &mut self.columns {
            column.drain(range.clone());
        }
    }

    fn write(&self, path: &Path) {
        let mut text = self.header.join(",") + "\n";
        for k in 0..self.rows() {
            let row: Vec<String> = self.columns.iter().map(|c| format!("{}", c[k])).collect();
            text += &(row.join(",") + "\n");
        }
        std::fs::write(path, text).unwrap();
    }
}

/// Repeatable numbers between -1 and 1.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

fn config(log: &Path) -> Config {
    Config {
        robot: example("robot.toml"),
        log: vec![LogConfig { path: log.to_owned(), ..LogConfig::default() }],
        ..Config::default()
    }
}

struct Case {
    name: String,
    id: &'static str,
    joint: Option<&'static str>,
    /// Whether the corrected configuration makes the finding go away; elsewhere identification takes care of it.
    mended: bool,
    corrupt: Box<dyn Fn(&mut Record)>,
}

fn case(
    name: impl Into<String>,
    id: &'static str,
    joint: Option<&'static str>,
    mended: bool,
    corrupt: impl Fn(&mut Record) + 'static,
) -> Case {
    Case { name: name.into(), id, joint, mended, corrupt: Box::new(corrupt) }
}

fn examine(config: &Config) -> Check {
    check(config, &mut |_| {}).unwrap()
}

/// Runs all cases; gives the corrected configuration of each.
fn run(cases: Vec<Case>) {
    let folder = tempfile::tempdir().unwrap();
    let clean = Record::clean();
    for (k, case) in cases.into_iter().enumerate() {
        let mut record = clean.clone();
        (case.corrupt)(&mut record);
        let path = folder.path().join(format!("{k}.csv"));
        record.write(&path);
        let config = config(&path);
        let found = examine(&config);
        let ours: Vec<_> = found.findings.iter().filter(|f| f.id.word() == case.id).collect();
        let all: Vec<String> =
            found.findings.iter().map(|f| format!("{} {:?}: {}", f.id, f.joint, f.evidence)).collect();
        assert!(!ours.is_empty(), "{}: no `{}` in {all:#?}", case.name, case.id);
        let named = |f: &&dynid::check::Finding| case.joint.is_none_or(|j| f.joint.as_deref() == Some(j));
        assert!(ours.iter().any(named), "{}: {all:#?}", case.name);
        let others: Vec<&String> = all
            .iter()
            .zip(&found.findings)
            .filter(|(_, f)| f.id.word() != case.id && f.severity != Severity::Info)
            .map(|(text, _)| text)
            .collect();
        println!("{}: {}; beside it {}", case.name, ours[0].evidence, others.len());
        assert!(others.len() <= 2, "{}: {others:#?}", case.name);
        if !case.mended {
            continue;
        }
        let corrected = folder.path().join(format!("{k}.toml"));
        std::fs::write(&corrected, found.corrected(&config, None).unwrap()).unwrap();
        let again = examine(&Config::read(&corrected).unwrap());
        let left: Vec<String> = again
            .findings
            .iter()
            .filter(|f| f.id.word() == case.id || f.severity == Severity::Error)
            .map(|f| format!("{} {:?}: {}", f.id, f.joint, f.evidence))
            .collect();
        assert!(left.is_empty(), "{}: after the remedy {left:#?}", case.name);
    }
}

#[test]
fn a_clean_log_has_no_findings() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("clean.csv");
    Record::clean().write(&path);
    let found = examine(&config(&path));
    assert!(found.findings.is_empty(), "{:#?}", found.findings);
    assert_eq!(found.worst(), None);
}

#[test]
fn signs_and_orders_of_columns() {
    let mut cases = vec![
        case("all efforts reversed", "effort_sign", None, true, |r| {
            (1..=JOINTS).for_each(|j| r.effort(j).iter_mut().for_each(|x| *x = -*x));
        }),
        case("columns of all joints in reverse", "joint_permutation", None, true, |r| {
            for (a, b) in [(1, 6), (2, 5), (3, 4)] {
                r.swap(a, b);
                r.swap(JOINTS + a, JOINTS + b);
                r.swap(2 * JOINTS + a, 2 * JOINTS + b);
            }
        }),
        case("efforts one joint on", "joint_permutation", None, true, |r| {
            r.columns[JOINTS + 1..=2 * JOINTS].rotate_left(1);
        }),
        case("two pairs of efforts", "joint_permutation", None, true, |r| {
            r.swap(JOINTS + 1, JOINTS + 2);
            r.swap(JOINTS + 4, JOINTS + 5);
        }),
    ];
    cases.extend(single_signs(&[(2, "j2")], &[(3, "j3")]));
    cases.extend(exchanges(&[(1, 2, "j1, j2"), (4, 5, "j4, j5")]));
    run(cases);
}

#[test]
#[ignore = "half a minute; the ordinary run takes some of the joints"]
fn signs_and_orders_of_other_joints() {
    let mut cases = single_signs(&[(1, "j1"), (3, "j3"), (5, "j5"), (6, "j6")], &[(2, "j2"), (4, "j4")]);
    cases.extend(exchanges(&[(2, 3, "j2, j3"), (3, 6, "j3, j6")]));
    run(cases);
}

type Joint = (usize, &'static str);

/// The effort of a joint reversed, or its motion.
fn single_signs(efforts: &[Joint], positions: &[Joint]) -> Vec<Case> {
    let mut cases = Vec::new();
    for (joint, name) in efforts.iter().copied() {
        cases.push(case(format!("effort of {name} reversed"), "effort_sign", Some(name), true, move |r| {
            r.effort(joint).iter_mut().for_each(|x| *x = -*x);
        }));
    }
    for (joint, name) in positions.iter().copied() {
        cases.push(case(
            format!("position of {name} reversed"),
            "position_sign",
            Some(name),
            true,
            move |r| {
                r.position(joint).iter_mut().for_each(|x| *x = -*x);
                r.velocity(joint).iter_mut().for_each(|x| *x = -*x);
            },
        ));
    }
    cases
}

/// Two joints exchanged, their efforts or all of them.
fn exchanges(pairs: &[(usize, usize, &'static str)]) -> Vec<Case> {
    let mut cases = Vec::new();
    for (a, b, names) in pairs.iter().copied() {
        cases.push(case(format!("efforts {names}"), "joint_permutation", Some(names), true, move |r| {
            r.swap(JOINTS + a, JOINTS + b);
        }));
        cases.push(case(format!("joints {names}"), "joint_permutation", Some(names), true, move |r| {
            r.swap(a, b);
            r.swap(JOINTS + a, JOINTS + b);
            r.swap(2 * JOINTS + a, 2 * JOINTS + b);
        }));
    }
    cases
}

#[test]
#[ignore = "ten seconds; the ordinary run takes a case of each kind"]
fn other_units_and_gains() {
    let mut cases = vec![
        case("all positions in degrees", "degrees", None, true, |r| {
            for j in 1..=JOINTS {
                r.position(j).iter_mut().for_each(|x| *x = x.to_degrees());
                r.velocity(j).iter_mut().for_each(|x| *x = x.to_degrees());
            }
        }),
        case("velocities in degrees", "velocity_mismatch", Some("j3"), true, |r| {
            (1..=JOINTS).for_each(|j| r.velocity(j).iter_mut().for_each(|x| *x = x.to_degrees()));
        }),
        case("a velocity reversed", "velocity_mismatch", Some("j4"), true, |r| {
            r.velocity(4).iter_mut().for_each(|x| *x = -*x);
        }),
        case("velocities of two joints", "velocity_mismatch", Some("j2"), false, |r| {
            r.swap(2 * JOINTS + 2, 2 * JOINTS + 5);
        }),
    ];
    for (joint, name) in [(2, "j2"), (4, "j4")] {
        cases.push(case(format!("{name} in degrees"), "degrees", Some(name), true, move |r| {
            r.position(joint).iter_mut().for_each(|x| *x = x.to_degrees());
            r.velocity(joint).iter_mut().for_each(|x| *x = x.to_degrees());
        }));
    }
    for scale in [1e3, 1e-3, 1e2] {
        cases.push(case(format!("all efforts times {scale}"), "drive_gain", None, true, move |r| {
            (1..=JOINTS).for_each(|j| r.effort(j).iter_mut().for_each(|x| *x *= scale));
        }));
    }
    for (joint, name, scale) in [(2, "j2", 1e3), (3, "j3", 10.0), (3, "j3", 0.1), (1, "j1", 1e3)] {
        cases.push(case(
            format!("effort of {name} times {scale}"),
            "drive_gain",
            Some(name),
            true,
            move |r| {
                r.effort(joint).iter_mut().for_each(|x| *x *= scale);
            },
        ));
    }
    run(cases);
}

#[test]
fn units_and_gains() {
    run(vec![
        case("velocities in degrees", "velocity_mismatch", Some("j3"), true, |r| {
            (1..=JOINTS).for_each(|j| r.velocity(j).iter_mut().for_each(|x| *x = x.to_degrees()));
        }),
        case("j2 in degrees", "degrees", Some("j2"), true, |r| {
            r.position(2).iter_mut().for_each(|x| *x = x.to_degrees());
            r.velocity(2).iter_mut().for_each(|x| *x = x.to_degrees());
        }),
        case("efforts times 1000", "drive_gain", None, true, |r| {
            (1..=JOINTS).for_each(|j| r.effort(j).iter_mut().for_each(|x| *x *= 1e3));
        }),
        case("effort of j3 times 10", "drive_gain", Some("j3"), true, |r| {
            r.effort(3).iter_mut().for_each(|x| *x *= 10.0);
        }),
    ]);
}

#[test]
fn clocks() {
    let mut cases = Vec::new();
    for share in [0.1, 0.25] {
        cases.push(case(format!("jitter of {share}"), "clock_jitter", None, false, move |r| {
            let mut numbers = Numbers(7);
            r.columns[0].iter_mut().for_each(|t| *t += 3f64.sqrt() * share * 0.005 * numbers.next());
        }));
    }
    for length in [5, 60, 400] {
        cases.push(case(format!("a gap of {length}"), "clock_gap", None, false, move |r| {
            r.remove_rows(2000..2000 + length);
        }));
    }
    for count in [1, 20] {
        cases.push(case(
            format!("{count} rows with an old time"),
            "clock_backwards",
            None,
            false,
            move |r| {
                for k in 0..count {
                    r.columns[0][500 + 200 * k] = r.columns[0][400 + 200 * k];
                }
            },
        ));
    }
    for factor in [0.98, 1.05] {
        cases.push(case(format!("a clock that runs {factor}"), "clock_rate", None, true, move |r| {
            r.columns[0].iter_mut().for_each(|t| *t *= factor);
        }));
    }
    for every in [2, 40] {
        cases.push(case(format!("every row {every} held"), "duplicate_samples", None, true, move |r| {
            for column in &mut r.columns[1..] {
                for k in (every..column.len()).step_by(every) {
                    column[k] = column[k - 1];
                }
            }
        }));
    }
    run(cases);
}

#[test]
fn faults_of_signals() {
    faulty_signals(&[200], &[0.8], &[(3, 1.0)], &[0.02]);
}

#[test]
#[ignore = "ten seconds; the ordinary run takes one size of each fault"]
fn faults_of_signals_of_other_sizes() {
    faulty_signals(&[40, 600], &[0.5, 0.95], &[(30, 0.3), (55, 2.0)], &[0.005, 0.3]);
}

/// Signals that stand still for some samples, are cut off at a share of their peak, have spikes (count, share) in effort and
/// spikes of some radians in position.
fn faulty_signals(frozen: &[usize], cut: &[f64], spikes: &[(usize, f64)], position_spikes: &[f64]) {
    let mut cases = vec![
        case("an effort that never changes", "frozen_signal", Some("j4"), false, |r| r.effort(4).fill(1.25)),
        case("a joint at rest", "idle_joint", Some("j6"), false, |r| r.position(6).fill(0.3)),
        case("a row of nonsense", "position_range", Some("j2"), true, |r| r.position(2)[3000] = 9e9),
        case("counts for angles", "position_range", Some("j2"), false, |r| {
            r.position(2).iter_mut().for_each(|q| *q = 4e9 + 1e8 * *q);
        }),
    ];
    for length in frozen.iter().copied() {
        cases.push(case(
            format!("position frozen for {length}"),
            "frozen_signal",
            Some("j2"),
            true,
            move |r| {
                let at = fast(&r.columns[2], length);
                let value = r.position(2)[at];
                r.position(2)[at..at + length].fill(value);
            },
        ));
        cases.push(case(
            format!("effort frozen for {length}"),
            "frozen_signal",
            Some("j3"),
            true,
            move |r| {
                let value = r.effort(3)[2500];
                r.effort(3)[2500..2500 + length].fill(value);
            },
        ));
    }
    for share in cut.iter().copied() {
        cases.push(case(format!("effort cut off at {share}"), "saturation", Some("j2"), true, move |r| {
            let limit = share * r.effort(2).iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            r.effort(2).iter_mut().for_each(|x| *x = x.clamp(-limit, limit));
        }));
    }
    for (count, size) in spikes.iter().copied() {
        cases.push(case(format!("{count} spikes of {size}"), "spikes", Some("j5"), false, move |r| {
            let peak = r.effort(5).iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            for k in 0..count {
                r.effort(5)[100 + 100 * k] += size * 4.0 * peak;
            }
        }));
    }
    for size in position_spikes.iter().copied() {
        cases.push(case(format!("position spikes of {size}"), "spikes", Some("j1"), true, move |r| {
            (0..5).for_each(|k| r.position(1)[300 + 700 * k] += size);
        }));
    }
    run(cases);
}

/// Where a joint keeps its speed for some samples.
fn fast(position: &[f64], length: usize) -> usize {
    let travel = |k: &usize| (position[k + length] - position[*k]).abs();
    (200..position.len() - 200 - length).max_by(|a, b| travel(a).total_cmp(&travel(b))).unwrap()
}

#[test]
fn delays_and_the_base() {
    let mut cases = Vec::new();
    for samples in [4, 8, 20] {
        cases.push(case(format!("motion late by {samples}"), "delay", None, true, move |r| {
            let rows = r.rows();
            for column in r.columns[JOINTS + 1..=2 * JOINTS].iter_mut() {
                column.copy_within(samples..rows, 0);
            }
            r.remove_rows(rows - samples..rows);
        }));
    }
    run(cases);
    // Gravity of the log against that of a configuration that says otherwise.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("clean.csv");
    Record::clean().write(&path);
    for degrees in [3.0_f64, 10.0, 30.0, 90.0] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let tilted = Config { gravity: Some([9.81 * sin, 0.0, -9.81 * cos]), ..config(&path) };
        let found = examine(&tilted);
        let tilt = found.findings.iter().find(|f| f.id.word() == "base_tilt");
        assert!(tilt.is_some(), "{degrees}: {:#?}", found.findings);
        let measured = found.logs[0].tilt_deg.unwrap();
        println!("tilt of {degrees}: {measured:?}");
        assert!((measured[0] - degrees).abs() < 1.0, "{degrees}: {measured:?}");
        let corrected = folder.path().join("corrected.toml");
        std::fs::write(&corrected, found.corrected(&tilted, None).unwrap()).unwrap();
        let again = examine(&Config::read(&corrected).unwrap());
        assert!(again.findings.is_empty(), "{degrees}: {:#?}", again.findings);
    }
}

#[test]
fn weak_excitation_is_said() {
    let cases = [700, 1100]
        .map(|rows| {
            case(format!("{rows} rows"), "weak_excitation", None, false, move |r| {
                let all = r.rows();
                r.remove_rows(rows..all);
            })
        })
        .into_iter()
        .collect();
    run(cases);
}

/// What is identified from a corrupted log with its corrected configuration is what the clean log gives, and without it the
/// log is refused.
#[test]
fn identification_refuses_nonsense_and_accepts_what_was_put_right() {
    let folder = tempfile::tempdir().unwrap();
    let clean = folder.path().join("clean.csv");
    Record::clean().write(&clean);
    let truth = identify(&config(&clean), &mut |_| {}).unwrap();
    assert!(truth.findings.is_empty());
    let mut record = Record::clean();
    record.swap(2, 3);
    record.swap(JOINTS + 2, JOINTS + 3);
    record.effort(5).iter_mut().for_each(|x| *x = -*x);
    let path = folder.path().join("wrong.csv");
    record.write(&path);
    let wrong = config(&path);
    let error = identify(&wrong, &mut |_| {}).unwrap_err();
    assert!(matches!(&error, dynid::Error::PreflightFault(_)), "{error}");
    assert!(error.hint().unwrap().contains("--fix"), "{error}");
    let warned = Config { preflight: dynid::config::Preflight::Warn, ..wrong.clone() };
    let warned = identify(&warned, &mut |_| {}).unwrap();
    assert!(warned.warnings.iter().any(|w| w.message.contains("joint permutation")), "{:?}", warned.warnings);
    let corrected = folder.path().join("right.toml");
    std::fs::write(&corrected, examine(&wrong).corrected(&wrong, None).unwrap()).unwrap();
    let right = identify(&Config::read(&corrected).unwrap(), &mut |_| {}).unwrap();
    for (a, b) in right.fit().x.iter().zip(&truth.fit().x) {
        assert!((a - b).abs() <= 1e-9 * (1.0 + b.abs()), "{a} against {b}");
    }
}

/// Rows to leave out are those of the file, whatever part of it is read and whatever is left out already.
#[test]
fn rows_are_those_of_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    let mut record = Record::clean();
    record.position(2)[3499] = 9e9;
    record.position(4)[4499] = 9e9;
    record.write(&path);
    let cut = |rows, part, leave_out| {
        let mut config = config(&path);
        config.log[0] = LogConfig { rows, part, leave_out, ..config.log[0].clone() };
        config
    };
    for config in [
        cut(Some((1001, 6001)), None, vec![(1200, 1300)]),
        cut(None, Some((0.3, 1.0)), vec![]),
        cut(Some((11, 5500)), Some((0.25, 0.95)), vec![(20, 40), (3000, 3010)]),
    ] {
        let found = examine(&config);
        let evidence: Vec<&str> = found
            .findings
            .iter()
            .filter(|f| f.id.word() == "position_range")
            .map(|f| f.evidence.as_str())
            .collect();
        assert_eq!(evidence.len(), 2, "{:#?}", found.findings);
        assert!(evidence[0].contains("row 3500") && evidence[1].contains("row 4500"), "{evidence:?}");
        let text = found.corrected(&config, None).unwrap();
        let again = Config::parse(&text, "corrected").unwrap();
        let ranges = &again.log[0].leave_out;
        assert!(ranges.contains(&(3500, 3500)) && ranges.contains(&(4500, 4500)), "{ranges:?}");
    }
}

/// One joint moves, the others tremble by some 1e-5 rad: there is nothing to tell columns by, and nothing is made up.
#[test]
fn single_joint_runs_of_a_gen3_raise_no_error() {
    let Some(data) = shared("data/kinova-gen3") else { return };
    let mut text = format!(
        "robot = \"{}/gen3.urdf\"\n[columns]\ntime = {{ columns = [\"Time\"], unit = \"ms\" }}\nposition = \"Position{{}}\"\n\
         velocity = \"Velocity{{}}\"\neffort = \"TorqueCur{{}}\"\n",
        data.display()
    );
    for k in 1..=7 {
        text += &format!("[[log]]\npath = \"{}/joint_{k}_trapez.csv.gz\"\n", data.display());
        if k == 5 {
            text += "rows = [1, 5846]\n";
        }
    }
    let found = examine(&Config::parse(&text, "test").unwrap());
    let errors: Vec<_> = found.findings.iter().filter(|f| f.severity == Severity::Error).collect();
    assert!(errors.is_empty(), "{errors:#?}");
    let idle = |k: usize| {
        let log = format!("joint_{k}_trapez.csv.gz");
        found.findings.iter().filter(|f| f.id.word() == "idle_joint" && f.log.ends_with(&log)).count()
    };
    assert_eq!((1..=7).map(idle).collect::<Vec<_>>(), [6; 7]);
}
