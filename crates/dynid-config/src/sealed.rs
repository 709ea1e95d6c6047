//! Files that nobody but this program writes: their first member, the SHA-256 of the rest, tells whether they are what was written.

use std::path::Path;

use dynid_files::input;
use dynid_files::output::write_atomically;
use dynid_identify::Error;
use sha2::{Digest, Sha256};

fn digest(text: &str) -> String {
    Sha256::digest(text.as_bytes()).iter().map(|b| format!("{b:02x}")).collect()
}

/// The first member of an object with this digest.
fn seal(digest: &str) -> String {
    format!("{{\"sha256\":\"{digest}\",")
}

/// Writes a JSON object with its seal; a reader sees the old file or the new one, never a part.
///
/// # Errors
/// [`Error::Output`].
///
/// # Panics
/// Unless the text is an object.
pub fn write(path: &Path, text: &str) -> Result<(), Error> {
    let members = text.strip_prefix('{').unwrap_or_else(|| unreachable!("an object: {text}"));
    Ok(write_atomically(path, (seal(&digest(members)) + members).as_bytes())?)
}

/// Reads a sealed object; `None` if the file does not exist. `schema`: its member of this name.
///
/// # Errors
/// [`Error::Read`]; [`Error::Checkpoint`] if the file is not what was written.
pub fn read(path: &Path, schema: &str) -> Result<Option<String>, Error> {
    let text = match input::read_text(path) {
        Ok(text) => text,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        Err(source) => return Err(Error::Read { file: path.to_owned(), source }),
    };
    let length = seal(&digest("")).len();
    let whole = text.split_at_checked(length).filter(|(found, members)| *found == seal(&digest(members)));
    match whole {
        Some((_, members)) => Ok(Some(format!("{{{members}"))),
        None => {
            let found = serde_json::from_str::<serde_json::Value>(&text).unwrap_or_default();
            let message = match found["schema"].as_str().filter(|found| *found != schema) {
                Some(found) => format!("expected schema `{schema}`, found `{found}`"),
                None => "it is damaged; delete it to begin anew".to_owned(),
            };
            Err(Error::Checkpoint { file: path.display().to_string(), message })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_flipped_bit_is_told() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("state");
        assert_eq!(read(&path, "x").unwrap(), None);
        write(&path, "{\"a\": 1}\n").unwrap();
        assert_eq!(read(&path, "x").unwrap().unwrap(), "{\"a\": 1}\n");
        let bytes = std::fs::read(&path).unwrap();
        for place in 0..bytes.len() {
            for bit in 0..8 {
                let mut damaged = bytes.clone();
                damaged[place] ^= 1 << bit;
                std::fs::write(&path, damaged).unwrap();
                assert!(read(&path, "x").is_err(), "byte {place}, bit {bit}");
            }
        }
    }
}
