//! Files of logs, whatever their bytes: an answer or an error, the same as a whole and part by part.
#![no_main]

use std::path::PathBuf;
use std::sync::LazyLock;

use dynid_logs::LogOptions;
use dynid_logs::log::{self, Missing, Wanted};
use libfuzzer_sys::fuzz_target;

/// A file in memory, where the system has such a folder.
static FILE: LazyLock<PathBuf> = LazyLock::new(|| {
    let memory = PathBuf::from("/dev/shm");
    let folder = if memory.is_dir() { memory } else { std::env::temp_dir() };
    folder.join(format!("dynid-fuzz-{}", std::process::id()))
});

fuzz_target!(|data: &[u8]| {
    std::fs::write(&*FILE, data).expect("a file that can be written");
    let wanted = Wanted { columns: None, time: Vec::new(), missing: Missing::Drop };
    let mut options = LogOptions::default();
    options.read.max_bytes = 64 << 20;
    let Ok(log) = log::open(&*FILE, &options) else { return };
    let Ok((whole, _)) = log.read(&wanted) else { return };
    assert_eq!(whole.header.len(), whole.columns.len());
    assert!(whole.columns.iter().all(|column| column.len() == whole.rows));

    let log = log::open(&*FILE, &options).expect("it was opened before");
    let mut blocks = log.blocks(&wanted, 7).expect("it was read before");
    let mut rows = 0;
    while let Some(block) = blocks.next_block().expect("it was read before") {
        assert_eq!(block.header, whole.header);
        for (part, column) in block.columns.iter().zip(&whole.columns) {
            let own = &column[rows..rows + block.rows];
            assert!(part.iter().zip(own).all(|(a, b)| a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan()));
        }
        rows += block.rows;
    }
    assert_eq!(rows, whole.rows);
});
