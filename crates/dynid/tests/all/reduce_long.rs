//! Logs that are reduced in windows, against the same logs as a whole.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;
use std::sync::OnceLock;

use dynid::Error;
use dynid::config::LogConfig;
use dynid::estimators::Mat;
use dynid::io::{LogFileError, MappingSpec};
use dynid::log::Log;
use dynid::motion::{Log as Recording, LogError, Portion};
use dynid::reduce::{ReducedLog, Reducer, Reduction, WindowSettings, reduce_log};

use crate::reduce::{learned, load, parts};

/// Rows of the part that is looked at, where it is not the whole log.
const PART: usize = 1500;

fn reducer(part_rows: usize, samples: usize) -> Reducer {
    let reducer = learned().reduction.recipe().clone().reducer().unwrap();
    reducer.with_windows(WindowSettings { part_rows, samples })
}

/// A log of 3000 rows at 200 Hz.
fn recording() -> &'static Recording {
    static RECORDING: OnceLock<Recording> = OnceLock::new();
    RECORDING.get_or_init(|| {
        let [first, ..] = parts();
        load(&first).log.slice(0..3000).unwrap()
    })
}

fn log(signals: Recording) -> Log {
    Log::new(reducer(PART, 1).robot(), signals).unwrap()
}

/// The recording, changed.
fn changed(change: impl FnOnce(&mut Portion)) -> Recording {
    let mut portion = Portion::of(recording().clone());
    change(&mut portion);
    portion.into_log("changed").unwrap()
}

/// A log whose last row repeats the stamp before: all rows that count are in its part, though it has more rows than that.
fn with_a_row_more() -> Recording {
    let whole = Portion::of(recording().clone());
    let mut more = whole.clone();
    more.append(&whole.part(2999..3000));
    more.into_log("more").unwrap()
}

/// Largest difference of the products of columns of all factors, in parts of the columns' norms.
#[track_caller]
pub(crate) fn apart(a: &ReducedLog, b: &ReducedLog) -> f64 {
    assert_eq!(a.groups.len(), b.groups.len());
    let mut largest = 0.0_f64;
    for (a, b) in a.groups.iter().zip(&b.groups) {
        assert_eq!((a.output, a.scale, &a.columns), (b.output, b.scale, &b.columns));
        assert_eq!(a.blocks.len(), b.blocks.len());
        for (a, b) in a.blocks.iter().zip(&b.blocks) {
            assert_eq!(a.rows(), b.rows());
            let (p, q) = (products(a), products(b));
            for i in 0..p.nrows() {
                for j in 0..p.ncols() {
                    let scale = (p[(i, i)] * p[(j, j)]).sqrt();
                    if scale > 0.0 {
                        largest = largest.max((p[(i, j)] - q[(i, j)]).abs() / scale);
                    }
                }
            }
        }
    }
    largest
}

/// Products of the columns and the effort of the rows behind a factor.
fn products(factor: &dynid::estimators::Factor) -> Mat {
    let r = factor.triangle();
    // What no column explains stands beside the triangle.
    let beside = |i, j| if i == j && i + 1 == r.ncols() { factor.rho().powi(2) } else { 0.0 };
    let product = |i, j| (0..r.nrows()).map(|k| r[(k, i)] * r[(k, j)]).sum::<f64>() + beside(i, j);
    Mat::from_fn(r.ncols(), r.ncols(), product)
}

/// What a log leaves if its rows come in portions.
fn in_portions(
    reducer: &Reducer,
    signals: &Recording,
    first: usize,
    each: usize,
) -> Result<ReducedLog, Error> {
    let whole = Portion::of(signals.clone());
    let rest: Vec<Portion> =
        (first..whole.rows()).step_by(each).map(|k| whole.part(k..(k + each).min(whole.rows()))).collect();
    let first = whole.part(0..first).into_log(signals.name())?;
    reducer.reduce_blocks(log(first), rest.into_iter().map(Ok))
}

#[test]
fn windows_leave_what_the_whole_log_leaves() {
    let signals = with_a_row_more();
    let whole = reducer(4000, 1).reduce(log(signals.clone())).unwrap();
    for samples in [100, 700, 2999] {
        let windows = reducer(3000, samples).reduce(log(signals.clone())).unwrap();
        let found = apart(&whole, &windows);
        println!("windows of {samples} samples: {found:e}");
        assert!(found < 1e-12, "{samples}: {found:e}");
        let (a, b) = (&whole.facts.log, &windows.facts.log);
        assert_eq!((a.samples, &a.moves, a.rate_hz), (b.samples, &b.moves, b.rate_hz));
        assert_eq!((&a.position_noise, &a.velocities), (&b.position_noise, &b.velocities));
        for (a, b) in whole.facts.efforts.iter().zip(&windows.facts.efforts) {
            assert_eq!(a.rows, b.rows);
            assert!((a.sum - b.sum).abs() <= 1e-12 * (a.rows as f64 * a.squares).sqrt());
        }
    }
}

/// Columns for the rest of delays are formed window by window too.
#[test]
fn windows_leave_columns_of_delays_as_the_whole_log_does() {
    let with_delays = |part_rows, samples| {
        let reducer = learned().reduction.recipe().clone().with_delays().reducer().unwrap();
        reducer.with_windows(WindowSettings { part_rows, samples })
    };
    let signals = with_a_row_more();
    let whole = with_delays(4000, 1).reduce(log(signals.clone())).unwrap();
    let columns = learned().reduction.recipe().columns.len();
    assert!(whole.groups.iter().all(|g| g.columns.last() == Some(&(columns + g.output))));
    let windows = with_delays(3000, 700).reduce(log(signals)).unwrap();
    let found = apart(&whole, &windows);
    assert!(found < 1e-12, "{found:e}");
}

#[test]
fn windows_of_a_log_with_gaps_jitter_and_spikes_leave_what_the_whole_leaves() {
    let mut more = Portion::of(with_a_row_more());
    for (k, t) in more.time.iter_mut().enumerate().take(3000) {
        *t += 0.0006 * ((k * 37 % 11) as f64 / 11.0);
    }
    more.time[2999] += 0.001;
    more.time[3000] = more.time[2999];
    for joint in &mut more.joints {
        joint.effort[1234] += 500.0;
        joint.effort[2200] -= 700.0;
        joint.position[1777] += 0.3;
    }
    let keep: Vec<bool> = (0..3001).map(|k| !(800..830).contains(&k) && !(1990..1994).contains(&k)).collect();
    let signals = more.into_log("rough").unwrap().retain(&keep).unwrap();
    let rows = signals.rows();
    let whole = reducer(4000, 1).reduce(log(signals.clone())).unwrap();
    for samples in [180, 900] {
        let windows = reducer(rows - 1, samples).reduce(log(signals.clone())).unwrap();
        let found = apart(&whole, &windows);
        assert!(found < 1e-12, "{samples}: {found:e}");
        let gaps = |log: &ReducedLog| log.facts.cautions.iter().any(|c| c.message.contains("2 gaps"));
        assert!(gaps(&whole) && gaps(&windows), "{:?}", windows.facts.cautions);
    }
}

#[test]
fn bits_do_not_depend_on_how_rows_are_portioned_nor_values_on_windows() {
    let expected = reducer(PART, 500).reduce(log(recording().clone())).unwrap();
    for (first, each) in [(2, 1), (7, 13), (1499, 2), (1500, 1500), (1501, 64), (2999, 1)] {
        let found = in_portions(&reducer(PART, 500), recording(), first, each).unwrap();
        assert!(found == expected, "{first}, then {each}");
    }
    let one = reducer(PART, usize::MAX / 2).reduce(log(recording().clone())).unwrap();
    let found = apart(&one, &expected);
    assert!(found < 1e-12, "{found:e}");
}

#[test]
fn a_log_that_is_no_longer_than_the_part_keeps_its_bits() {
    let whole = reducer(3000, 100).reduce(log(recording().clone())).unwrap();
    assert!(whole.facts.findings.iter().all(|f| f.id.word() != "not_examined"));
    for (first, each) in [(2, 5), (2000, 400), (3000, 1)] {
        assert!(in_portions(&reducer(3000, 100), recording(), first, each).unwrap() == whole);
    }
}

#[test]
fn the_part_that_is_looked_at_is_one_in_which_the_robot_moves_and_is_told() {
    // The robot stands at first.
    let still = changed(|log| {
        for joint in &mut log.joints {
            let (q, e) = (joint.position[1200], joint.effort[1200]);
            joint.position[..1200].fill(q);
            joint.effort[..1200].iter_mut().enumerate().for_each(|(k, x)| *x = e + 1e-3 * (k % 7) as f64);
        }
    });
    let found = reducer(600, 300).reduce(log(still)).unwrap();
    assert!(found.facts.log.moves.iter().all(|moves| *moves));
    let told = "of 3000 rows, those from 1201 to 1800";
    assert!(found.facts.findings.iter().any(|f| f.evidence.contains(told)), "{:?}", found.facts.findings);
}

#[test]
fn time_blocks_of_a_long_log_are_no_more_than_the_recipe_says() {
    let once = Portion::of(recording().clone());
    let mut often = once.clone();
    for round in 1..8 {
        let mut more = once.clone();
        more.time.iter_mut().for_each(|t| *t += 15.0 * f64::from(round));
        often.append(&more);
    }
    let signals = often.into_log("often").unwrap();
    let (least, most) = {
        let recipe = learned().reduction.recipe();
        ((200.0_f64.max(1000.0 / recipe.choices.kernel_hz)).ceil() as usize, recipe.blocks.most)
    };
    let whole = signals.rows() / least;
    assert!(whole > most && whole < 2 * most, "{whole} of {least} samples, {most} at most");
    let expected = signals.rows() / (2 * least);
    let found = reducer(PART, 5000).reduce(log(signals.clone())).unwrap();
    let merged = learned().reduction.recipe().blocks.merged;
    for group in &found.groups {
        assert_eq!(group.blocks.len(), ((expected + merged / 2) / merged).max(1));
    }
    let other = reducer(PART, 777).reduce(log(signals)).unwrap();
    let found = apart(&found, &other);
    assert!(found < 1e-12, "{found:e}");
}

#[test]
fn factors_of_windows_are_written_merged_and_solved_as_others() {
    let windows = reducer(PART, 500);
    let found = windows.reduce(log(recording().clone())).unwrap();
    let reduction = Reduction::of_reduced(&windows, vec![found]);
    let read = Reduction::from_bytes(&reduction.to_bytes(), "long").unwrap();
    assert_eq!(read.logs(), reduction.logs());
    let solved = read.solve([], &mut |_| {}).unwrap().estimate();
    assert!(solved.fit.filtered.relative_error.unwrap() < 1.0);
}

#[test]
fn broken_rows_are_refused_where_they_are() {
    let windows = || reducer(PART, 500);
    let whole = Portion::of(recording().clone());
    let fed = |change: &dyn Fn(&mut Portion)| {
        let mut rest = whole.part(1600..3000);
        change(&mut rest);
        let first = log(whole.part(0..1600).into_log("broken").unwrap());
        windows().reduce_blocks(first, [Ok(rest)]).unwrap_err()
    };
    let nan = fed(&|rest| rest.joints[2].effort[321] = f64::NAN);
    assert!(matches!(&nan, Error::Log(LogError::NotFinite { sample: 1921, .. })), "{nan}");
    let other = fed(&|rest| rest.joints.swap(0, 1));
    assert!(matches!(&other, Error::Log(LogError::OtherSignals { row: 1600, .. })), "{other}");
    let short = fed(&|rest| rest.joints[0].position.truncate(7));
    assert!(matches!(&short, Error::Log(LogError::Length { .. })), "{short}");
    let clock = |error: Error| match error {
        Error::Conditioning(fault) => fault.to_string(),
        other => panic!("{other}"),
    };
    let again = clock(fed(&|rest| rest.time.iter_mut().skip(700).for_each(|t| *t -= 8.0)));
    assert!(again.contains("first at row 2300") && again.contains("broken"), "{again}");
    let jump = clock(fed(&|rest| rest.time.iter_mut().skip(700).for_each(|t| *t += 1e9)));
    assert!(jump.contains("follows row 2299"), "{jump}");
}

/// The recording as a file, with what becomes of its text.
fn written(folder: &Path, name: &str, change: impl FnOnce(String) -> Vec<u8>) -> LogConfig {
    let signals = recording();
    let joints = signals.joints();
    let mut text = "t".to_owned();
    joints.iter().for_each(|joint| write!(text, ",q_{}", joint.name).unwrap());
    joints.iter().for_each(|joint| write!(text, ",tau_{}", joint.name).unwrap());
    text.push('\n');
    for (k, t) in signals.time().iter().enumerate() {
        write!(text, "{t}").unwrap();
        joints.iter().for_each(|joint| write!(text, ",{}", joint.position[k]).unwrap());
        joints.iter().for_each(|joint| write!(text, ",{}", joint.effort[k]).unwrap());
        text.push('\n');
    }
    let path = folder.join(name);
    std::fs::write(&path, change(text)).unwrap();
    LogConfig { path, ..LogConfig::default() }
}

fn compressed(text: &str) -> Vec<u8> {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    encoder.write_all(text.as_bytes()).unwrap();
    encoder.finish().unwrap()
}

#[test]
fn files_leave_what_their_numbers_leave() {
    let folder = tempfile::tempdir().unwrap();
    let windows = reducer(PART, 500);
    let expected = windows.reduce(log(recording().clone())).unwrap();
    for (name, is_compressed) in [("log.csv", false), ("log.csv.gz", true)] {
        let config =
            written(
                folder.path(),
                name,
                |text| if is_compressed { compressed(&text) } else { text.into_bytes() },
            );
        let found = reduce_log(&windows, &config, &MappingSpec::default(), None).unwrap();
        assert!(found.groups == expected.groups && found.key == expected.key);
        let [input] = &found.facts.inputs[..] else { panic!("one file") };
        assert_eq!(input.sha256, dynid::logs::sha256(&config.path).unwrap());
    }
}

#[test]
fn broken_files_are_refused_with_file_and_row() {
    let folder = tempfile::tempdir().unwrap();
    let windows = reducer(PART, 500);
    let refused = |name: &str, change: &dyn Fn(String) -> Vec<u8>| {
        let config = written(folder.path(), name, change);
        let error = reduce_log(&windows, &config, &MappingSpec::default(), None).unwrap_err();
        assert!(error.to_string().contains(name), "{error}");
        error
    };
    let line = |text: &str, number: usize, with: &str| {
        let mut lines: Vec<&str> = text.lines().collect();
        lines[number] = with;
        lines.join("\n").into_bytes()
    };
    let nan = refused("nan.csv", &|text| line(&text, 2500, "12.495,nan,0,0,0,0,0,0,0,0,0,0,0"));
    assert!(matches!(&nan, Error::LogFile(LogFileError::NotFinite { row: 2500, .. })), "{nan}");
    let short = refused("short.csv", &|text| line(&text, 2500, "12.495,1"));
    assert!(matches!(&short, Error::LogFile(LogFileError::FieldCount { row: 2500, .. })), "{short}");
    let cut = refused("cut.csv", &|text| text.as_bytes()[..text.len() - 30].to_vec());
    assert!(matches!(&cut, Error::LogFile(LogFileError::FieldCount { row: 3000, .. })), "{cut}");
    let cut = refused("cut.csv.gz", &|text| {
        let bytes = compressed(&text);
        bytes[..bytes.len() * 9 / 10].to_vec()
    });
    assert!(matches!(&cut, Error::LogFile(LogFileError::TruncatedGzip { .. })), "{cut}");
}
