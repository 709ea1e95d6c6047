//! Lines as they come.

use std::io::{self, Read};

/// Text read at once, bytes.
const CHUNK_BYTES: usize = 1 << 16;
/// Longest line, bytes (1 MiB).
const MAX_LINE_BYTES: usize = 1 << 20;

/// What a read of a [`LineSource`] ended with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LinesEnd {
    /// More may come.
    Open,
    /// The stream has ended.
    Ended,
}

/// Hands on whole lines, as many as one read of the stream completes, so that none waits for the next.
#[derive(Debug)]
pub struct LineSource<R> {
    input: R,
    buffer: Vec<u8>,
    held: usize,
    number: u64,
    /// The line under way is too long and is passed over.
    overlong: bool,
    overlong_lines: u64,
}

impl<R: Read> LineSource<R> {
    /// Lines of a stream.
    pub fn new(input: R) -> Self {
        LineSource {
            input,
            buffer: vec![0; CHUNK_BYTES],
            held: 0,
            number: 0,
            overlong: false,
            overlong_lines: 0,
        }
    }

    /// Lines longer than 1 MiB, which are passed over.
    pub fn overlong_lines(&self) -> u64 {
        self.overlong_lines
    }

    /// Waits for text and hands on the lines that it completes, without their ends, each with its number from 1. A last line
    /// without an end counts when the stream ends.
    ///
    /// # Errors
    /// What the stream says; interrupted reads are repeated.
    pub fn read(&mut self, mut take: impl FnMut(u64, &[u8])) -> io::Result<LinesEnd> {
        if self.held == self.buffer.len() {
            self.buffer.resize(2 * self.buffer.len(), 0);
        }
        let count = loop {
            match self.input.read(&mut self.buffer[self.held..]) {
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                result => break result?,
            }
        };
        let searched = self.held;
        self.held += count;
        let mut from = 0;
        let text = &self.buffer[..self.held];
        for end in memchr::memchr_iter(b'\n', &text[searched..]).map(|k| searched + k) {
            self.number += 1;
            if std::mem::take(&mut self.overlong) {
                self.overlong_lines += 1;
            } else {
                take(self.number, without_return(&text[from..end]));
            }
            from = end + 1;
        }
        if count == 0 && from < self.held {
            self.number += 1;
            if std::mem::take(&mut self.overlong) {
                self.overlong_lines += 1;
            } else {
                take(self.number, without_return(&text[from..]));
            }
            from = self.held;
        }
        self.buffer.copy_within(from..self.held, 0);
        self.held -= from;
        if self.held > MAX_LINE_BYTES {
            (self.overlong, self.held) = (true, 0);
        }
        Ok(if count == 0 { LinesEnd::Ended } else { LinesEnd::Open })
    }
}

fn without_return(line: &[u8]) -> &[u8] {
    line.strip_suffix(b"\r").unwrap_or(line)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A stream that gives its pieces one by one.
    struct Pieces(Vec<Vec<u8>>);

    impl Read for Pieces {
        fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
            if self.0.is_empty() {
                return Ok(0);
            }
            let piece = self.0.remove(0);
            let n = piece.len().min(to.len());
            to[..n].copy_from_slice(&piece[..n]);
            if n < piece.len() {
                self.0.insert(0, piece[n..].to_vec());
            }
            Ok(n)
        }
    }

    fn lines(pieces: &[&[u8]]) -> (Vec<(u64, String)>, u64) {
        let mut source = LineSource::new(Pieces(pieces.iter().map(|p| p.to_vec()).collect()));
        let mut out = Vec::new();
        while source
            .read(|n, line| out.push((n, String::from_utf8_lossy(line).into_owned())))
            .is_ok_and(|end| end == LinesEnd::Open)
        {}
        (out, source.overlong_lines())
    }

    #[test]
    fn lines_are_whole_however_they_come() {
        let expected: Vec<(u64, String)> =
            [(1, "a,b"), (2, ""), (3, "1,2"), (4, "3")].map(|(n, l)| (n, l.to_owned())).into();
        assert_eq!(lines(&[b"a,b\r\n\n1,2\n3"]).0, expected);
        assert_eq!(lines(&[b"a", b",b\r", b"\n\n1", b",2\n", b"3"]).0, expected);
        assert!(lines(&[]).0.is_empty());
    }

    #[test]
    fn lines_without_end_are_passed_over() {
        let long = vec![b'x'; MAX_LINE_BYTES + 100_000];
        let (found, overlong) = lines(&[b"a\n", &long, b"y\nb\n"]);
        assert_eq!(found.iter().map(|(_, l)| l.as_str()).collect::<Vec<_>>(), ["a", "b"]);
        assert_eq!((found[1].0, overlong), (3, 1));
    }
}
