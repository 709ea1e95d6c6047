//! Tables written in the formats of other tools: CSV, Parquet, NumPy, and MCAP with joint states.

#[cfg(feature = "bags")]
mod mcap;
#[cfg(feature = "numpy")]
mod numpy;
#[cfg(feature = "parquet")]
mod parquet;

use std::path::Path;

use dynid_files::output::OutputError;

use crate::csv::RowWriter;

/// Numbers of a column.
#[derive(Clone, Debug, PartialEq)]
pub enum Column {
    /// NaN where there is no value.
    Float(Vec<f64>),
    /// Whole numbers with all their digits, such as stamps in nanoseconds.
    Whole(Vec<i64>),
}

impl Column {
    /// Number of rows.
    pub fn rows(&self) -> usize {
        match self {
            Column::Float(x) => x.len(),
            Column::Whole(x) => x.len(),
        }
    }
}

/// Format of a table, told by the end of its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TableFormat {
    /// `.csv`, `.csv.gz`: cells without a value are empty.
    Csv,
    /// `.parquet`: a column of doubles or of 64-bit whole numbers each; values that are missing are null.
    Parquet,
    /// `.npz`: an array each.
    Numpy,
    /// `.mcap`: joint states of ROS 2 in CDR on the topic `/joint_states`.
    Mcap,
}

impl TableFormat {
    /// The format of a name.
    pub fn of(path: &Path) -> Option<Self> {
        let name = path.file_name()?.to_str()?.to_lowercase();
        let ends = |ending: &str| name.ends_with(ending);
        Some(match () {
            () if ends(".csv") || ends(".csv.gz") => TableFormat::Csv,
            () if ends(".parquet") => TableFormat::Parquet,
            () if ends(".npz") => TableFormat::Numpy,
            () if ends(".mcap") => TableFormat::Mcap,
            () => return None,
        })
    }
}

/// Writes a table; its format is told by the end of its name.
///
/// # Errors
/// [`OutputError::Format`] for a name that tells none, for `.mcap`, which takes [`JointStates`], and for a format that this build cannot write;
/// [`OutputError::Shape`] for columns of other lengths than the first; [`OutputError::Unwritable`].
pub fn write(path: &Path, names: &[String], columns: &[Column]) -> Result<(), OutputError> {
    check_shape(path, names, columns)?;
    match TableFormat::of(path) {
        Some(TableFormat::Csv) => write_csv(path, names, columns),
        #[cfg(feature = "parquet")]
        Some(TableFormat::Parquet) => parquet::write(path, names, columns),
        #[cfg(feature = "numpy")]
        Some(TableFormat::Numpy) => numpy::write(path, names, columns),
        other => Err(no_format(path, other, "a table as .csv, .csv.gz, .parquet or .npz")),
    }
}

/// Positions, velocities and efforts of joints over time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JointStates {
    /// Names of the joints.
    pub joints: Vec<String>,
    /// Stamps, ns.
    pub stamps: Vec<i64>,
    /// Per joint, rad or m.
    pub position: Vec<Vec<f64>>,
    /// Per joint, rad/s or m/s; empty: not known.
    pub velocity: Vec<Vec<f64>>,
    /// Per joint, N m or N; empty: not known.
    pub effort: Vec<Vec<f64>>,
}

/// Writes joint states as MCAP: `sensor_msgs/msg/JointState` on `/joint_states`, stamped and received at the stamps.
///
/// # Errors
/// [`OutputError::Format`] for another name than `.mcap` and for a build that cannot write it; [`OutputError::Unwritable`].
pub fn write_joint_states(path: &Path, states: &JointStates) -> Result<(), OutputError> {
    match TableFormat::of(path) {
        #[cfg(feature = "bags")]
        Some(TableFormat::Mcap) => mcap::write(path, states),
        other => Err(no_format(path, other, "joint states as .mcap")),
    }
}

fn no_format(path: &Path, found: Option<TableFormat>, expected: &'static str) -> OutputError {
    let found = match found {
        None => "a name without such an end".to_owned(),
        Some(format) => format!("{format:?}, which does not hold that or is not written by this build"),
    };
    OutputError::Format { file: path.display().to_string(), expected, found }
}

fn check_shape(path: &Path, names: &[String], columns: &[Column]) -> Result<(), OutputError> {
    let file = || path.display().to_string();
    if names.len() != columns.len() {
        let (what, expected, found) = ("columns".to_owned(), names.len(), columns.len());
        return Err(OutputError::Shape { file: file(), what, expected, found });
    }
    let rows = columns.first().map_or(0, Column::rows);
    match names.iter().zip(columns).find(|(_, column)| column.rows() != rows) {
        None => Ok(()),
        Some((name, column)) => {
            let what = format!("rows of column `{name}`");
            Err(OutputError::Shape { file: file(), what, expected: rows, found: column.rows() })
        }
    }
}

fn write_csv(path: &Path, names: &[String], columns: &[Column]) -> Result<(), OutputError> {
    let mut writer = RowWriter::create(path, names)?;
    for row in 0..columns.first().map_or(0, Column::rows) {
        writer.cells(columns.iter().map(|column| match column {
            Column::Float(x) => crate::csv::OutCell::Float(x[row]),
            Column::Whole(x) => crate::csv::OutCell::Whole(x[row]),
        }))?;
    }
    writer.finish()
}

/// What the operating system says of a file that is written.
#[cfg(any(feature = "bags", feature = "numpy", feature = "parquet"))]
fn unwritable(path: &Path, error: impl std::fmt::Display) -> OutputError {
    OutputError::Unwritable {
        file: path.display().to_string(),
        error: std::io::Error::other(error.to_string()),
    }
}
