//! How much robots and logs differ.

/// Weight of a coordinate that is left out of the spread: its own prior is this much weaker than the fleet's.
pub const LEFT_OUT: f64 = 1e-6;
/// Variances of the deviations, one entry per coordinate, and what single robots and logs make of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Variances {
    /// Between robots, squared units of the coordinates; 0: none.
    pub robots: Vec<f64>,
    /// Between logs of a robot.
    pub logs: Vec<f64>,
    /// Per robot and coordinate: the variance of its prior is that of the fleet over this weight.
    pub robot_weights: Vec<Vec<f64>>,
    /// Per log and coordinate, alike.
    pub log_weights: Vec<Vec<f64>>,
}

impl Variances {
    /// The same variances for so many robots and logs.
    pub fn new(robots: Vec<f64>, logs: Vec<f64>, number: (usize, usize)) -> Variances {
        let q = robots.len();
        let (robot_weights, log_weights) = (vec![vec![1.0; q]; number.0], vec![vec![1.0; q]; number.1]);
        Variances { robots, logs, robot_weights, log_weights }
    }

    /// Variance of every coordinate of a robot.
    pub(crate) fn of_robot(&self, robot: usize) -> Vec<f64> {
        self.robots.iter().zip(&self.robot_weights[robot]).map(|(d, w)| d / w).collect()
    }

    /// Variance of every coordinate of a log.
    pub(crate) fn of_log(&self, log: usize) -> Vec<f64> {
        self.logs.iter().zip(&self.log_weights[log]).map(|(d, w)| d / w).collect()
    }

    /// Both, one behind the other.
    pub(crate) fn joined(&self) -> Vec<f64> {
        self.robots.iter().chain(&self.logs).copied().collect()
    }

    /// The same weights with other variances.
    pub(crate) fn with(&self, joined: &[f64]) -> Variances {
        let (robots, logs) = joined.split_at(self.robots.len());
        Variances { robots: robots.to_vec(), logs: logs.to_vec(), ..self.clone() }
    }
}
