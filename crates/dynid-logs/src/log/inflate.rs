//! Compressed bytes of files, of a bounded size.

use std::io::{self, Read};

/// Frames of zstd, up to one byte more than `limit`.
///
/// # Errors
/// They are broken.
pub(super) fn zstd(mut bytes: &[u8], limit: usize, out: &mut Vec<u8>) -> io::Result<()> {
    while !bytes.is_empty() && out.len() <= limit {
        let left = (limit + 1 - out.len()) as u64;
        let decoder = ruzstd::decoding::StreamingDecoder::new(&mut bytes).map_err(io::Error::other)?;
        decoder.take(left).read_to_end(out)?;
    }
    Ok(())
}

/// Frames of lz4, up to one byte more than `limit`.
///
/// # Errors
/// They are broken.
pub(super) fn lz4(bytes: &[u8], limit: usize, out: &mut Vec<u8>) -> io::Result<()> {
    lz4_flex::frame::FrameDecoder::new(bytes).take(limit as u64 + 1).read_to_end(out).map(|_| ())
}
