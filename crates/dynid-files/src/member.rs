//! Paths that stand for a part of a file: `FILE#MEMBER`.

use std::path::{Path, PathBuf};

/// A file, and the member of it that is meant: an episode of a log, a model of a world.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileMember {
    /// File, or folder of a dataset.
    pub path: PathBuf,
    /// Member, such as the number of an episode, the path of a group, or topics.
    pub member: Option<String>,
}

impl FileMember {
    /// Takes `FILE#MEMBER` apart, unless there is a file of the whole name.
    pub fn of(path: &Path) -> Self {
        let whole = FileMember { path: path.to_owned(), member: None };
        let Some((file, member)) = path.to_str().and_then(|text| text.rsplit_once('#')) else { return whole };
        if path.exists() || file.is_empty() {
            return whole;
        }
        FileMember { path: file.into(), member: Some(member.to_owned()) }
    }
}
