//! Reading a log: the reader beside the `csv` crate with `str::parse`, on the same text.

use std::fmt::Write;
use std::fs;
use std::path::PathBuf;
use std::sync::OnceLock;

use divan::Bencher;
use divan::counter::BytesCount;
use dynid_logs::csv::{ReadOptions, read, write};

/// Rows of the log; 22 columns make about 20 MB of text.
const ROWS: usize = 100_000;
const COLUMNS: usize = 22;

fn main() {
    divan::main();
}

/// A log of smooth signals with nine decimals, plain and compressed, and the size of its text.
fn log() -> &'static (PathBuf, PathBuf, u64) {
    static LOG: OnceLock<(PathBuf, PathBuf, u64)> = OnceLock::new();
    LOG.get_or_init(|| {
        let folder = std::env::temp_dir().join(format!("dynid-logs-bench-{}", std::process::id()));
        fs::create_dir_all(&folder).expect("a folder for the log");
        let header: Vec<String> = (0..COLUMNS).map(|k| format!("q{k}")).collect();
        let value =
            |row: usize, column: usize| ((row as f64 * 0.01 + column as f64).sin() * 1e9).round() / 1e9;
        let columns: Vec<Vec<f64>> = (0..COLUMNS).map(|c| (0..ROWS).map(|r| value(r, c)).collect()).collect();
        let (plain, gzip) = (folder.join("log.csv"), folder.join("log.csv.gz"));
        write(&gzip, &header, &columns).expect("a compressed log");
        let mut text = header.join(",") + "\n";
        for row in 0..ROWS {
            for (k, column) in columns.iter().enumerate() {
                let end = if k + 1 == COLUMNS { '\n' } else { ',' };
                let _ = write!(text, "{:.9}{end}", column[row]);
            }
        }
        fs::write(&plain, &text).expect("a log");
        (plain, gzip, text.len() as u64)
    })
}

#[divan::bench]
fn reader(bencher: Bencher) {
    let (plain, _, bytes) = log();
    bencher.counter(BytesCount::new(*bytes)).bench(|| read(plain, &ReadOptions::default()));
}

#[divan::bench]
fn reader_gzip(bencher: Bencher) {
    let (_, gzip, bytes) = log();
    bencher.counter(BytesCount::new(*bytes)).bench(|| read(gzip, &ReadOptions::default()));
}

#[divan::bench]
fn csv_crate_and_std_parse(bencher: Bencher) {
    let (plain, _, bytes) = log();
    bencher.counter(BytesCount::new(*bytes)).bench(|| {
        let mut reader = csv::Reader::from_path(plain).expect("the log");
        let mut columns = vec![Vec::new(); COLUMNS];
        let mut record = csv::ByteRecord::new();
        while reader.read_byte_record(&mut record).expect("a row") {
            for (column, field) in columns.iter_mut().zip(&record) {
                let text = std::str::from_utf8(field).expect("text");
                column.push(text.parse::<f64>().expect("a number"));
            }
        }
        columns
    });
}
