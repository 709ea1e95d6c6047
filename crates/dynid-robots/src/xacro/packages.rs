//! Folders of ROS packages by their names.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};

use dynid_files::input;

/// Folders above a file in which packages are looked for.
const MAX_ABOVE: usize = 8;
/// Most entries of a folder that are looked at.
const MAX_ENTRIES: usize = 2_000;

/// The folder of a package: what the environment says (`ROS_PACKAGE_PATH`; `share` in `AMENT_PREFIX_PATH` and
/// `COLCON_PREFIX_PATH`), else the folder above `file` that is it, else one beside a folder above it.
pub(super) fn find(name: &str, file: &Path) -> Option<PathBuf> {
    let paths = |variable: &str| {
        let stated = env::var_os(variable).unwrap_or_default();
        env::split_paths(&stated).filter(|path| !path.as_os_str().is_empty()).collect::<Vec<_>>()
    };
    let installed = ["AMENT_PREFIX_PATH", "COLCON_PREFIX_PATH"].into_iter().flat_map(paths);
    let share = installed.map(|prefix| prefix.join("share").join(name)).find(|folder| folder.is_dir());
    if let Some(folder) =
        share.or_else(|| paths("ROS_PACKAGE_PATH").iter().find_map(|path| in_folder(path, name)))
    {
        return Some(folder);
    }
    let file = std::path::absolute(file).ok()?;
    file.ancestors().skip(1).take(MAX_ABOVE).find_map(|above| in_folder(above, name))
}

/// A package that a folder is, or that lies in it or in one of its folders.
fn in_folder(folder: &Path, name: &str) -> Option<PathBuf> {
    if is(folder, name) {
        return Some(folder.to_owned());
    }
    let own = folder.join(name);
    if own.is_dir() {
        return Some(own);
    }
    let entries = fs::read_dir(folder).ok()?.take(MAX_ENTRIES).flatten();
    let mut inner: Vec<PathBuf> = entries.map(|entry| entry.path()).filter(|path| path.is_dir()).collect();
    inner.sort();
    let below = inner.iter().map(|inner| inner.join(name)).find(|path| path.join("package.xml").is_file());
    inner.iter().find(|path| is(path, name)).cloned().or(below)
}

/// Whether the `package.xml` of a folder has a name.
fn is(folder: &Path, name: &str) -> bool {
    let Ok(text) = input::read_text(&folder.join("package.xml")) else { return false };
    let stated = text.split_once("<name>").and_then(|(_, rest)| rest.split_once("</name>"));
    stated.is_some_and(|(stated, _)| stated.trim() == name)
}
