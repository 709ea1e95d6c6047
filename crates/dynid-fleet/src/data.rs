//! What a fleet is made of: logs as factors, robots, and which parameters vary.

use dynid_factor::Factor;

/// A parameter that is not the same in all robots or all logs of the type.
#[derive(Debug, Clone, PartialEq)]
pub struct Coordinate {
    /// Its column.
    pub column: usize,
    /// Whether robots differ in it.
    pub between_robots: bool,
    /// Whether logs of one robot differ in it.
    pub between_logs: bool,
    /// Whether a change of it with time, and a log that is out of its spread, say something of the robot: not where logs are free to differ, as
    /// in what a robot carries.
    pub watched: bool,
    /// Coordinates of the same kind share their relative spread where there are fewer than [`FEW`] robots (viscous friction of all joints, say).
    pub kind: usize,
}

/// Fewer robots than this do not tell the spread of one coordinate.
pub const FEW: usize = 6;

/// Rows of one effort and one kernel of a log: what shares a noise variance.
#[derive(Debug, Clone, PartialEq)]
pub struct ChannelFactor {
    /// Index of the channel among those of the fleet.
    pub channel: usize,
    /// Columns of the whole problem that the factor's columns stand for, ascending.
    pub columns: Vec<usize>,
    /// The factor, unweighted.
    pub factor: Factor,
}

/// A log as factors.
#[derive(Debug, Clone, PartialEq)]
pub struct FleetLog {
    /// Index of its robot.
    pub robot: usize,
    /// Place of the log in the tree of merges; no two logs of a robot have the same.
    pub key: u64,
    /// Its middle, on the time axis of the fleet, s.
    pub time_s: f64,
    /// What is known of the log as a whole (temperature, load ...), one number per covariate of the fleet.
    pub covariates: Vec<f64>,
    /// Its factors.
    pub channels: Vec<ChannelFactor>,
}

/// Logs of robots of one type, as factors in the same columns.
#[derive(Debug, Clone, PartialEq)]
pub struct Fleet {
    /// Number `p` of columns.
    pub columns: usize,
    /// Number of channels.
    pub channels: usize,
    /// Per robot its place in the tree of merges; all different.
    pub robots: Vec<u64>,
    /// Number of covariates of a log.
    pub covariates: usize,
    /// Parameters that vary.
    pub varying: Vec<Coordinate>,
    /// Logs, in any order.
    pub logs: Vec<FleetLog>,
}

/// Why a fleet cannot be fitted.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FleetError {
    /// Too few robots with logs.
    #[error("{found} robots with logs: expected at least {expected}")]
    Robots {
        /// Least number.
        expected: usize,
        /// Robots that have logs.
        found: usize,
    },
    /// Something of the fleet refers to what it does not have, or occurs twice.
    #[error("{what}: expected {expected}, found {found}")]
    Shape {
        /// What it is.
        what: &'static str,
        /// What it may be.
        expected: String,
        /// What it is.
        found: String,
    },
    /// A number of a log is not finite.
    #[error("log {log}: expected a finite {what}, found {found}")]
    NotFinite {
        /// Index of the log.
        log: usize,
        /// Which number.
        what: &'static str,
        /// The number.
        found: f64,
    },
    /// A covariate that is the same in all logs.
    #[error("covariate {covariate} is {value} in all logs: nothing follows it")]
    Constant {
        /// Index of the covariate.
        covariate: usize,
        /// Its value.
        value: f64,
    },
    /// Parameters of the type that no log tells.
    #[error("no log of the fleet tells columns {columns:?}")]
    NotExcited {
        /// Their columns.
        columns: Vec<usize>,
    },
    /// A covariate that follows others, or the difference of robots or logs, so that its effect cannot be told.
    #[error("the effect of covariate {covariate} cannot be told from the other parameters of the type")]
    Confounded {
        /// Index of the covariate.
        covariate: usize,
    },
}

fn shape(what: &'static str, expected: impl ToString, found: impl ToString) -> FleetError {
    FleetError::Shape { what, expected: expected.to_string(), found: found.to_string() }
}

impl Fleet {
    /// Whether everything is as it has to be.
    ///
    /// # Errors
    /// All of [`FleetError`] but [`FleetError::NotExcited`] and [`FleetError::Confounded`].
    pub fn check(&self) -> Result<(), FleetError> {
        let mut taken = vec![false; self.columns];
        for coordinate in &self.varying {
            match taken.get_mut(coordinate.column) {
                None => {
                    return Err(shape(
                        "column of what varies",
                        format!("below {}", self.columns),
                        coordinate.column,
                    ));
                }
                Some(true) => return Err(shape("column of what varies", "each once", coordinate.column)),
                Some(free) => *free = true,
            }
        }
        let mut keys = self.robots.clone();
        keys.sort_unstable();
        if let Some(pair) = keys.windows(2).find(|pair| pair[0] == pair[1]) {
            return Err(shape("keys of the robots", "each once", pair[0]));
        }
        for (k, log) in self.logs.iter().enumerate() {
            self.check_log(k, log)?;
        }
        let by_robot = self.by_robot();
        for of_robot in &by_robot {
            if let Some(pair) = of_robot.windows(2).find(|p| self.logs[p[0]].key == self.logs[p[1]].key) {
                return Err(shape("keys of the logs of a robot", "each once", self.logs[pair[0]].key));
            }
        }
        let found = by_robot.iter().filter(|of_robot| !of_robot.is_empty()).count();
        if found < 2 {
            return Err(FleetError::Robots { expected: 2, found });
        }
        for covariate in 0..self.covariates {
            let value = self.logs[0].covariates[covariate];
            if self.logs.iter().all(|log| log.covariates[covariate] == value) {
                return Err(FleetError::Constant { covariate, value });
            }
        }
        Ok(())
    }

    fn check_log(&self, k: usize, log: &FleetLog) -> Result<(), FleetError> {
        if log.robot >= self.robots.len() {
            return Err(shape("robot of a log", format!("below {}", self.robots.len()), log.robot));
        }
        if log.covariates.len() != self.covariates {
            return Err(shape("number of covariates of a log", self.covariates, log.covariates.len()));
        }
        if !log.time_s.is_finite() {
            return Err(FleetError::NotFinite { log: k, what: "time", found: log.time_s });
        }
        if let Some(found) = log.covariates.iter().find(|value| !value.is_finite()) {
            return Err(FleetError::NotFinite { log: k, what: "covariate", found: *found });
        }
        for channel in &log.channels {
            if channel.channel >= self.channels {
                return Err(shape("channel of a log", format!("below {}", self.channels), channel.channel));
            }
            if channel.columns.len() != channel.factor.columns() {
                return Err(shape("columns of a channel", channel.factor.columns(), channel.columns.len()));
            }
            let ascends = channel.columns.windows(2).all(|pair| pair[0] < pair[1]);
            if !ascends || channel.columns.last().is_some_and(|last| *last >= self.columns) {
                return Err(shape(
                    "columns of a channel",
                    "ascending columns of the fleet",
                    format!("{:?}", channel.columns),
                ));
            }
        }
        Ok(())
    }

    /// Per robot, the indices of its logs in the order of their keys.
    pub fn by_robot(&self) -> Vec<Vec<usize>> {
        let mut out = vec![Vec::new(); self.robots.len()];
        for (k, log) in self.logs.iter().enumerate() {
            out[log.robot].push(k);
        }
        for of_robot in &mut out {
            of_robot.sort_by_key(|k| self.logs[*k].key);
        }
        out
    }

    /// Logs in an order that is the fleet's own, whatever order they came in: by the keys of robots, then by their own.
    pub fn ordered(&self) -> Vec<usize> {
        let by_robot = self.by_robot();
        let mut robots: Vec<usize> = (0..self.robots.len()).collect();
        robots.sort_unstable_by_key(|r| self.robots[*r]);
        robots.into_iter().flat_map(|r| by_robot[r].iter().copied()).collect()
    }

    /// Columns that all robots share, ascending.
    pub fn shared(&self) -> Vec<usize> {
        (0..self.columns).filter(|c| self.varying.iter().all(|v| v.column != *c)).collect()
    }
}
