//! Lines of a log, a chunk of text at a time.

use dynid_files::excerpt::excerpt;

use super::error::LogFileError;
use super::input::{Input, InputFault};

/// Text read at once, bytes.
const CHUNK_BYTES: usize = 1 << 18;
/// Longest line, bytes (1 MiB).
const MAX_LINE_BYTES: usize = 1 << 20;

/// Lines without their ends, skipping blank lines and comments (`#`).
pub(crate) struct Lines {
    input: Input,
    file: String,
    buffer: Vec<u8>,
    /// Unread part of the buffer.
    from: usize,
    to: usize,
    ended: bool,
    line: usize,
    limits: (u64, u64),
}

impl Lines {
    pub(crate) fn new(input: Input, file: &str, max_bytes: u64, max_ratio: u64) -> Self {
        let buffer = vec![0; CHUNK_BYTES];
        let file = file.to_owned();
        Lines { input, file, buffer, from: 0, to: 0, ended: false, line: 0, limits: (max_bytes, max_ratio) }
    }

    /// Number of the line last returned.
    pub(crate) fn number(&self) -> usize {
        self.line
    }

    /// Digest of the whole file; what follows the line last returned is not looked at.
    pub(crate) fn digest(self) -> Result<String, LogFileError> {
        let file = self.file;
        self.input.digest().map_err(|error| LogFileError::Unreadable { file, error })
    }

    /// The next line that is neither blank nor a comment.
    pub(crate) fn next(&mut self) -> Result<Option<&[u8]>, LogFileError> {
        loop {
            let Some((from, to)) = self.next_range()? else { return Ok(None) };
            let first = self.buffer[from..to].iter().find(|b| !b.is_ascii_whitespace());
            if !matches!(first, None | Some(b'#')) {
                return Ok(Some(&self.buffer[from..to]));
            }
        }
    }

    fn next_range(&mut self) -> Result<Option<(usize, usize)>, LogFileError> {
        let mut searched = 0;
        loop {
            let unread = &self.buffer[self.from..self.to];
            let end = memchr::memchr(b'\n', &unread[searched..]).map(|k| searched + k);
            let length = match end {
                Some(length) => length,
                None if self.ended && unread.is_empty() => return Ok(None),
                None if self.ended => unread.len(),
                None => {
                    searched = unread.len();
                    self.fill()?;
                    continue;
                }
            };
            let from = self.from;
            self.from = (from + length + 1).min(self.to);
            self.line += 1;
            let carriage = usize::from(self.buffer[from..from + length].ends_with(b"\r"));
            return Ok(Some((from, from + length - carriage)));
        }
    }

    /// Moves the unread part to the front and reads on behind it.
    fn fill(&mut self) -> Result<(), LogFileError> {
        self.buffer.copy_within(self.from..self.to, 0);
        self.to -= self.from;
        self.from = 0;
        if self.to > MAX_LINE_BYTES {
            let (file, line) = (self.file.clone(), self.line + 1);
            return Err(LogFileError::LongLine { file, line, limit: MAX_LINE_BYTES });
        }
        if self.to == self.buffer.len() {
            self.buffer.resize(2 * self.buffer.len(), 0);
        }
        let n = self.input.read(&mut self.buffer[self.to..]).map_err(|fault| self.fault(fault))?;
        let start = (self.line == 0 && self.to == 0).then_some(());
        self.to += n;
        self.ended = n == 0;
        if start.is_some() {
            self.check_start()?;
        }
        if self.line == 0 && self.buffer[..self.to].contains(&0) {
            return Err(LogFileError::NotText { file: self.file.clone(), found: "binary data" });
        }
        Ok(())
    }

    fn check_start(&mut self) -> Result<(), LogFileError> {
        let start = &self.buffer[..self.to];
        let found = match start {
            [0xEF, 0xBB, 0xBF, ..] => {
                self.from = 3;
                return Ok(());
            }
            [0xFF, 0xFE, ..] | [0xFE, 0xFF, ..] => "UTF-16",
            [b'P', b'K', 3, 4, ..] => "a zip archive or spreadsheet",
            [0x28, 0xB5, 0x2F, 0xFD, ..] => "zstd-compressed data",
            [b'B', b'Z', b'h', ..] => "bzip2-compressed data",
            [0xFD, b'7', b'z', b'X', b'Z', ..] => "xz-compressed data",
            _ => return Ok(()),
        };
        Err(LogFileError::NotText { file: self.file.clone(), found })
    }

    fn fault(&self, fault: InputFault) -> LogFileError {
        let (file, line) = (self.file.clone(), self.line);
        match fault {
            InputFault::Unreadable(error) => LogFileError::Unreadable { file, error },
            InputFault::Truncated => LogFileError::TruncatedGzip { file, line },
            InputFault::Damaged(e) => {
                LogFileError::DamagedGzip { file, line, reason: excerpt(&e.to_string()) }
            }
            InputFault::TooLarge => LogFileError::TooLarge { file, limit: self.limits.0, line },
            InputFault::Bomb => LogFileError::Bomb { file, limit: self.limits.1, line },
        }
    }
}
