//! Logs, the quality of the effort prediction on them, and the series drawn.

use std::sync::Arc;

use serde::Serialize;

use super::Fact;

/// What a log was used for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum LogRole {
    /// The parameters were estimated from it.
    #[default]
    Training,
    /// Held out; only predicted.
    Validation,
}

/// One log.
#[derive(Clone, Debug, Default, Serialize)]
pub struct LogReport {
    /// Name shown for it, e.g. the file's stem.
    pub name: String,
    /// What it was used for.
    pub role: LogRole,
    /// Samples read.
    pub samples: Option<u64>,
    /// Samples left after conditioning.
    pub samples_used: Option<u64>,
    /// Duration, s.
    pub duration_s: Option<f64>,
    /// Sampling rate, Hz.
    pub sample_rate_hz: Option<f64>,
    /// Further facts about the log.
    pub facts: Vec<Fact>,
    /// Per joint: quality of the predicted effort.
    pub quality: Vec<JointQuality>,
    /// Euclidean norm of the residual over that of the measured effort, all joints together, raw effort, %.
    pub relative_error_raw_percent: Option<f64>,
    /// Euclidean norm of the residual over that of the measured effort, with one filter over measured and predicted effort, %.
    pub relative_error_filtered_percent: Option<f64>,
    /// The effort to draw; `None` leaves the log out of the plots and of the residual statistics.
    pub series: Option<LogSeries>,
}

/// Quality of the predicted effort of one joint.
#[derive(Clone, Debug, Default, Serialize)]
pub struct JointQuality {
    /// Against the effort as it was logged.
    pub raw: Quality,
    /// Against the filtered effort, the prediction passed through the same filter.
    pub filtered: Quality,
    /// Quality as in `filtered`, on samples in which the joint moves.
    pub moving: Quality,
    /// Quality as in `filtered`, on samples in which the joint stands.
    pub standing: Quality,
    /// Share of the samples in which it stands, %.
    pub standing_percent: Option<f64>,
}

/// Measures of the residual `e = measured - predicted`.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Quality {
    /// Root mean square of `e`, in the joint's effort unit.
    pub rms: Option<f64>,
    /// RMS over the range (largest minus smallest) of the measured effort, %.
    pub nrmse_percent: Option<f64>,
    /// Coefficient of determination, `1 - sum e^2 / sum (measured - mean)^2`.
    pub r2: Option<f64>,
    /// Correlation coefficient between measured and predicted effort, -1 to 1.
    pub correlation: Option<f64>,
    /// `|e| / |measured|` in the Euclidean norm, %.
    pub relative_error_percent: Option<f64>,
}

/// Measured and predicted effort of one log.
///
/// Give every sample: the report decimates for drawing and takes residual statistics from all of them.
#[derive(Clone, Debug, Default, Serialize)]
pub struct LogSeries {
    /// Time of each sample, s; finite and not decreasing.
    pub time_s: Vec<f64>,
    /// Which effort this is, for the caption, e.g. `zero-phase low-pass at 15 Hz on both`; may be empty.
    pub description: String,
    /// Per joint.
    pub joints: Vec<JointSeries>,
}

/// Effort of one joint, one entry per entry of [`LogSeries::time_s`], in the joint's effort unit.
///
/// Long signals may be shared with whoever made the report.
///
/// A sample that is not finite is left out of the curve and of the statistics, and the number of such samples is
/// stated beside the plot.
#[derive(Clone, Debug, Default, Serialize)]
pub struct JointSeries {
    /// Measured effort.
    pub measured: Arc<Vec<f64>>,
    /// Effort predicted by the identified model; without it neither prediction nor residual is drawn.
    pub predicted: Option<Arc<Vec<f64>>>,
    /// Prediction to draw in place of [`JointSeries::predicted`], such as one that is steady while the joint stands. Residual
    /// statistics are those of `predicted`, the curves those of this. `None`: what is predicted is drawn.
    pub drawn: Option<Vec<f64>>,
    /// Whether the sample took part in the estimate; stretches that did not are shaded. `None`: all did.
    pub used: Option<Vec<bool>>,
}
