//! Trajectories as tables of samples, read back.

use std::path::Path;

use dynid_files::excerpt::excerpt;
use dynid_motion::trajectory::{QuinticSpline, Sampled};

use super::TrajectoryFileError;
use crate::csv::{self, ReadOptions};

/// Columns that say where a sample belongs, and are no channel.
const PLACES: [&str; 2] = ["phase", "part"];

/// A trajectory as a table: `t, q_<joint>.., dq_<joint>.., ddq_<joint>..`, and channels.
#[derive(Debug, Clone, PartialEq)]
pub struct TrajectorySamples {
    /// Joints in the order of the columns.
    pub joints: Vec<String>,
    /// Between samples polynomials of degree 5.
    pub motion: QuinticSpline,
    /// Further columns by name (`load_<joint>`, `temperature_<joint>`), a value per sample.
    pub channels: Vec<(String, Vec<f64>)>,
}

impl TrajectorySamples {
    /// Reads a table, CSV or CSV.gz. Columns in any order: `t` (s, ascending), `q_<joint>`, `dq_<joint>`, `ddq_<joint>` (rad or m and
    /// their derivatives) of every joint; the columns `phase` and `part` are passed over, all others are channels.
    ///
    /// # Errors
    /// [`TrajectoryFileError::Table`] for a file that is no table of numbers, [`TrajectoryFileError::Field`] for a column that is
    /// missing, [`TrajectoryFileError::Trajectory`] for samples that are no motion.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, TrajectoryFileError> {
        let table = csv::read(path, &ReadOptions::default())?;
        let file = &table.source;
        let column = |name: &str| {
            table.column(name).ok_or_else(|| TrajectoryFileError::Field {
                file: file.clone(),
                field: name.to_owned(),
                expected: "a column of this name".to_owned(),
                found: format!("`{}`", excerpt(&table.header.join("`, `"))),
            })
        };
        let joints: Vec<String> =
            table.header.iter().filter_map(|name| name.strip_prefix("q_")).map(str::to_owned).collect();
        if joints.is_empty() {
            column("q_<joint>")?;
        }
        let all = |prefix: &str| -> Result<Vec<f64>, TrajectoryFileError> {
            let mut out = Vec::with_capacity(joints.len() * table.rows);
            for joint in &joints {
                out.extend(column(&format!("{prefix}_{joint}"))?);
            }
            Ok(out)
        };
        let sampled = Sampled { time: column("t")?.to_vec(), q: all("q")?, dq: all("dq")?, ddq: all("ddq")? };
        let motion = QuinticSpline::new(sampled)
            .map_err(|source| TrajectoryFileError::Trajectory { file: file.clone(), source })?;
        let is_motion = |name: &str| {
            name == "t"
                || PLACES.contains(&name)
                || ["q_", "dq_", "ddq_"].iter().any(|prefix| {
                    name.strip_prefix(prefix).is_some_and(|joint| joints.iter().any(|j| j == joint))
                })
        };
        let others = table.header.iter().zip(&table.columns).filter(|(name, _)| !is_motion(name));
        let channels = others.map(|(name, values)| (name.clone(), values.clone())).collect();
        Ok(TrajectorySamples { joints, motion, channels })
    }

    /// Whether a path is that of a table and not of coefficients: it ends in `.csv` or `.csv.gz`.
    pub fn is_table(path: &Path) -> bool {
        let name = path.to_string_lossy().to_lowercase();
        name.ends_with(".csv") || name.ends_with(".csv.gz")
    }
}
