//! Command lines about the files of a run, as its user would type them.

use std::path::{Path, PathBuf};

/// Robot, logs and configuration of a run.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct RunFiles {
    /// Configuration; `None` if the run was put together without one.
    pub config: Option<PathBuf>,
    /// Robot file.
    pub robot: PathBuf,
    /// Training logs.
    pub logs: Vec<PathBuf>,
}

impl RunFiles {
    /// The configuration, or robot and logs, as arguments of a command that takes either.
    pub fn arguments(&self) -> String {
        match &self.config {
            Some(config) => word(config),
            None => {
                let logs = self.logs.iter().map(|log| format!(" --log {}", word(log)));
                word(&self.robot) + &logs.collect::<String>()
            }
        }
    }

    /// `dynid check` of the logs.
    pub fn check(&self) -> String {
        match &self.config {
            Some(config) => format!("dynid check {}", word(config)),
            None => {
                let logs: Vec<String> = self.logs.iter().map(|log| word(log)).collect();
                format!("dynid check {} --robot {}", logs.join(" "), word(&self.robot))
            }
        }
    }

    /// `dynid compare` of all estimators on the logs.
    pub fn compare(&self) -> String {
        format!("dynid compare {} --report compare.html", self.arguments())
    }

    /// `dynid design` of a motion for the robot.
    pub fn design(&self) -> String {
        format!("dynid design {}", word(&self.robot))
    }

    /// `dynid inspect` of the robot.
    pub fn inspect(&self) -> String {
        format!("dynid inspect {}", word(&self.robot))
    }
}

/// A path as one word of a shell.
fn word(path: &Path) -> String {
    let text = path.display().to_string();
    let plain = |c: char| c.is_alphanumeric() || "/._-+=:,@%".contains(c);
    if !text.is_empty() && text.chars().all(plain) {
        text
    } else {
        format!("'{}'", text.replace('\'', r"'\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_single_words() {
        let files = RunFiles {
            config: None,
            robot: "my arm.urdf".into(),
            logs: vec!["a.csv".into(), "it's.csv".into()],
        };
        assert_eq!(files.check(), r"dynid check a.csv 'it'\''s.csv' --robot 'my arm.urdf'");
        assert_eq!(files.arguments(), r"'my arm.urdf' --log a.csv --log 'it'\''s.csv'");
        let files = RunFiles { config: Some("run.toml".into()), ..files };
        assert_eq!(files.compare(), "dynid compare run.toml --report compare.html");
    }
}
