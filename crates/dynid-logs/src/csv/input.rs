//! Bytes of a log, decompressed if need be, within bounds.

use std::io::{self, BufReader, Read};
use std::path::Path;

use dynid_files::digest::Hashed;
use dynid_files::input::{self, Opened};
use flate2::read::MultiGzDecoder;

/// Buffer between the file and the decoder, bytes.
const BUFFER_BYTES: usize = 1 << 16;

/// What stops the reading of bytes.
pub(crate) enum InputFault {
    /// The operating system.
    Unreadable(io::Error),
    /// The gzip stream ends early.
    Truncated,
    /// The gzip stream is damaged.
    Damaged(io::Error),
    /// More text than allowed.
    TooLarge,
    /// Compressed harder than allowed.
    Bomb,
}

/// Bounds of the text.
#[derive(Clone, Copy)]
pub(crate) struct Bounds {
    pub(crate) max_bytes: u64,
    pub(crate) max_ratio: u64,
    pub(crate) ratio_grace: u64,
}

pub(crate) struct Input {
    stream: Stream,
    bounds: Bounds,
    text_bytes: u64,
}

/// A file with the bytes in front that were looked at: a pipe cannot be wound back.
struct Whole {
    front: Vec<u8>,
    file: Opened,
}

impl Read for Whole {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.front.len().min(buffer.len());
        let (own, rest) = buffer.split_at_mut(count);
        own.copy_from_slice(&self.front[..count]);
        // Both in one, so that whoever looks at the beginning of a text sees enough of it.
        let more = self.file.read(rest)?;
        self.front.drain(..count);
        Ok(count + more)
    }
}

enum Stream {
    Plain(Hashed<Whole>),
    Gzip(Box<MultiGzDecoder<Counted>>),
}

/// Counts the compressed bytes.
struct Counted {
    inner: BufReader<Hashed<Whole>>,
    bytes: u64,
}

impl Read for Counted {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let n = self.inner.read(buffer)?;
        self.bytes += n as u64;
        Ok(n)
    }
}

impl Input {
    /// Opens a file.
    pub(crate) fn open(path: &Path, bounds: Bounds) -> io::Result<Self> {
        let mut file = input::open(path)?;
        let mut front = Vec::with_capacity(2);
        (&mut file).take(2).read_to_end(&mut front)?;
        Ok(Self::of(front, file, bounds))
    }

    /// A file of which the bytes in front, two of them at least, were read; gzip is told by these.
    pub(crate) fn of(front: Vec<u8>, file: Opened, bounds: Bounds) -> Self {
        let is_gzip = front.starts_with(&[0x1f, 0x8b]);
        let file = Whole { front, file };
        let stream = if is_gzip {
            let inner = BufReader::with_capacity(BUFFER_BYTES, Hashed::new(file));
            Stream::Gzip(Box::new(MultiGzDecoder::new(Counted { inner, bytes: 0 })))
        } else {
            Stream::Plain(Hashed::new(file))
        };
        Input { stream, bounds, text_bytes: 0 }
    }

    /// Digest of all bytes of the file, those read so far and those behind them.
    pub(crate) fn digest(self) -> io::Result<String> {
        match self.stream {
            Stream::Plain(file) => file.finish(),
            Stream::Gzip(decoder) => decoder.into_inner().inner.into_inner().finish(),
        }
    }

    /// Reads text into the buffer; 0 at the end.
    pub(crate) fn read(&mut self, buffer: &mut [u8]) -> Result<usize, InputFault> {
        let n = loop {
            let result = match &mut self.stream {
                Stream::Plain(file) => file.read(buffer),
                Stream::Gzip(decoder) => decoder.read(buffer),
            };
            match (result, &self.stream) {
                (Ok(n), _) => break n,
                (Err(e), _) if e.kind() == io::ErrorKind::Interrupted => {}
                (Err(e), Stream::Plain(_)) => return Err(InputFault::Unreadable(e)),
                (Err(e), Stream::Gzip(_)) => {
                    return Err(match e.kind() {
                        io::ErrorKind::UnexpectedEof => InputFault::Truncated,
                        io::ErrorKind::InvalidInput | io::ErrorKind::InvalidData | io::ErrorKind::Other => {
                            InputFault::Damaged(e)
                        }
                        _ => InputFault::Unreadable(e),
                    });
                }
            }
        };
        self.text_bytes += n as u64;
        if self.text_bytes > self.bounds.max_bytes {
            return Err(InputFault::TooLarge);
        }
        if let Stream::Gzip(decoder) = &self.stream
            && self.text_bytes > self.bounds.ratio_grace
            && self.text_bytes / decoder.get_ref().bytes.max(1) >= self.bounds.max_ratio
        {
            return Err(InputFault::Bomb);
        }
        Ok(n)
    }
}
