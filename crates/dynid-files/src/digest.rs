//! SHA-256 of files, formed of the very bytes that were read.

use std::io::{self, Read};

use sha2::{Digest as _, Sha256};

/// A file that was read, with the digest of the bytes that were read.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize, schemars::JsonSchema)]
pub struct SourceFile {
    /// Path as given.
    pub path: String,
    /// SHA-256 of the bytes that were read, hexadecimal.
    pub sha256: String,
}

/// SHA-256 of bytes, hexadecimal.
pub fn sha256(bytes: &[u8]) -> String {
    hexadecimal(Sha256::new_with_prefix(bytes))
}

/// SHA-256 of bytes.
pub fn sha256_bytes(bytes: &[u8]) -> [u8; 32] {
    Sha256::digest(bytes).into()
}

/// SHA-256 of the bytes of a file, hexadecimal, in fixed memory.
///
/// # Errors
/// The operating system's.
pub fn sha256_of_file(path: &std::path::Path) -> io::Result<String> {
    Hashed::new(std::fs::File::open(path)?).finish()
}

fn hexadecimal(hasher: Sha256) -> String {
    hasher.finalize().iter().map(|b| format!("{b:02x}")).collect()
}

/// Hashes what passes through.
#[derive(Debug)]
pub struct Hashed<R> {
    inner: R,
    hasher: Sha256,
}

impl<R: Read> Hashed<R> {
    /// Hashes what is read of `inner` from here on.
    pub fn new(inner: R) -> Self {
        Hashed { inner, hasher: Sha256::new() }
    }

    /// Reads on to the end, and gives the digest of all bytes, hexadecimal.
    ///
    /// # Errors
    /// Those of the inner reader.
    pub fn finish(mut self) -> io::Result<String> {
        io::copy(&mut self, &mut io::sink())?;
        Ok(hexadecimal(self.hasher))
    }
}

impl<R: Read> Read for Hashed<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let n = self.inner.read(buffer)?;
        self.hasher.update(&buffer[..n]);
        Ok(n)
    }
}
