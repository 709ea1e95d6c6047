//! Settings that need others to take effect.

use crate::Error;

/// A setting that is given, and what it needs.
pub struct Given<'a> {
    /// Name of the setting.
    pub key: &'a str,
    /// Whether it was given.
    pub given: bool,
    /// What it needs to take effect.
    pub needs: &'a str,
}

/// Fails at the first setting that is given although `found` is not what it needs.
pub fn refuse(found: &str, settings: &[Given<'_>]) -> Result<(), Error> {
    match settings.iter().find(|s| s.given) {
        Some(s) => Err(Error::setting(s.key, &format!("{} beside it", s.needs), found)),
        None => Ok(()),
    }
}
