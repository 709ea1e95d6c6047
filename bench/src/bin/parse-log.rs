//! Time that reading a log takes by itself: `parse-log FILE` reads all numbers, block by block, and prints rows and seconds.

#![expect(clippy::print_stdout, reason = "a benchmark prints its figures")]

use std::error::Error;
use std::hint::black_box;
use std::path::PathBuf;
use std::time::Instant;

use dynid_logs::LogOptions;
use dynid_logs::log::{Missing, Wanted, open};

/// Rows of a block.
const ROWS: usize = 1 << 14;

fn main() -> Result<(), Box<dyn Error>> {
    let path = PathBuf::from(std::env::args().nth(1).ok_or("expected a log")?);
    let start = Instant::now();
    let mut options = LogOptions::default();
    options.read.max_bytes = u64::MAX;
    let wanted = Wanted { columns: None, time: vec![0], missing: Missing::Error };
    let mut blocks = open(path, &options)?.blocks(&wanted, ROWS)?;
    let mut rows = 0;
    while let Some(table) = blocks.next_block()? {
        rows += black_box(&table).rows;
    }
    blocks.finish()?;
    println!("{rows} rows {:.2} s", start.elapsed().as_secs_f64());
    Ok(())
}
