//! Files that nobody but this program writes: a first line with the SHA-256 of the rest tells whether they are what was written.

use std::path::Path;

use dynid_io::input;
use dynid_io::output::write_atomically;
use sha2::{Digest, Sha256};

use crate::Error;

/// First word of the first line.
const SEAL: &str = "sha256";

fn digest(text: &str) -> String {
    Sha256::digest(text.as_bytes()).iter().map(|b| format!("{b:02x}")).collect()
}

/// Writes a text with its seal; a reader sees the old file or the new one, never a part.
///
/// # Errors
/// [`Error::Output`].
pub(crate) fn write(path: &Path, text: &str) -> Result<(), Error> {
    Ok(write_atomically(path, format!("{SEAL} {}\n{text}", digest(text)).as_bytes())?)
}

/// Reads a sealed text; `None` if the file does not exist.
///
/// # Errors
/// [`Error::Read`]; [`Error::Checkpoint`] if the file is not what was written.
pub(crate) fn read(path: &Path) -> Result<Option<String>, Error> {
    let text = match input::read_text(path) {
        Ok(text) => text,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        Err(source) => return Err(Error::Read { file: path.to_owned(), source }),
    };
    let whole = text.split_once('\n').filter(|(seal, rest)| *seal == format!("{SEAL} {}", digest(rest)));
    match whole {
        Some((_, rest)) => Ok(Some(rest.to_owned())),
        None => Err(Error::Checkpoint {
            file: path.display().to_string(),
            message: "it is damaged, or of another version; delete it to begin anew".to_owned(),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_flipped_bit_is_told() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("state");
        assert_eq!(read(&path).unwrap(), None);
        write(&path, "{\"a\": 1}\n").unwrap();
        assert_eq!(read(&path).unwrap().unwrap(), "{\"a\": 1}\n");
        let bytes = std::fs::read(&path).unwrap();
        for place in 0..bytes.len() {
            for bit in 0..8 {
                let mut damaged = bytes.clone();
                damaged[place] ^= 1 << bit;
                std::fs::write(&path, damaged).unwrap();
                assert!(read(&path).is_err(), "byte {place}, bit {bit}");
            }
        }
    }
}
