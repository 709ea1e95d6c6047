//! The result file `estimate.json`: stable keys, added to but never renamed.

mod counts;
mod exported;
mod friction;
mod instruments;
mod log_fit;
mod loops;
mod model;
mod reading;
mod trust;

use std::path::Path;

use dynid_model::{EffortModel, LoadReference, RobotModel, ShapeParameter};
pub use dynid_record::{
    CarriedReason, ConsistencyForm, ConsistencyStatus, Origin, ParameterVerdict, ShapeVerdict, Status,
};
use serde::{Deserialize, Serialize};
use serde_json::Value as Json;

use crate::Error;
pub use crate::agreement::{FileFit, FitValues};
use crate::caution::Caution;
pub use crate::check::CheckResult;
use crate::effort_scale::EffortScale;
use crate::finding::{FindingId, Severity};
pub use crate::input_record::{InputKind, InputRecord, short_name};
use crate::joint_stiffness::JointStiffness;
use crate::log_agreement::LogAgreement;
use crate::overlap::Overlaps;
use crate::own_delay::OwnDelay;
use crate::searches::Searches;
use crate::settings::Route;
use crate::tie_test::TieTest;
pub use counts::{BaseCounts, ParameterCounts, ShapeCounts, StandardCounts};
pub use exported::{EXPORT_LOSS_LIMIT, ExportedJoint, ExportedLog, ExportedRecord, FrictionProjection};
pub use friction::{CyclicEffort, FrictionPassivity, FrictionTrial, PassivityRecord};
pub use instruments::{BiasVerdict, EffectRecord, ExogeneityRecord, InstrumentEnd, InstrumentRecord};
pub use log_fit::log_fit;
pub(crate) use log_fit::{by_motion, pool};
pub use loops::{ClosureKind, ClosureRecord, FrameRecord, LoopsRecord};
pub use model::{
    CouplingRecord, ElasticRecord, JointRecord, JointType, LinkRecord, ModelRecord, SettingRecord,
};
pub use reading::{MotorSide, ReadingRecord};
pub use trust::{
    ConsistencyRecord, HeldOutRecord, PrecisionRecord, PriorTrialRecord, PruningRecord, PruningStep,
    WhitenessRecord,
};

/// Version of the file's layout.
pub const SCHEMA: u32 = 1;

/// An identified model: what `identify` writes and `predict`, `validate` read.
#[derive(Debug, Clone, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Estimate {
    /// Layout version.
    pub schema: u32,
    /// Robot name.
    pub robot: String,
    /// Joints in the order of every per-joint list.
    pub joints: Vec<String>,
    /// Samples of all training logs on their uniform grids.
    pub samples: usize,
    /// Regression rows used.
    pub rows: usize,
    /// Condition number of the weighted base regressor in its own units.
    pub condition_number: Option<f64>,
    /// Condition number of the weighted base regressor with columns scaled to unit length.
    pub condition_number_scaled: Option<f64>,
    /// Condition number with scaled columns and without columns of shape parameters, which the check judges.
    #[serde(default)]
    pub condition_number_without_shapes: Option<f64>,
    /// Rank found in the logs against the structural rank.
    pub rank: RankStatus,
    /// How many parameters there are and how many the logs tell; absent from files of earlier versions.
    #[serde(default)]
    pub counts: ParameterCounts,
    /// Standard parameters: links, then elements. Their split follows the robot file where only combinations are seen.
    pub parameters: Vec<ParameterValue>,
    /// What belongs to single logs: payloads, and deviations of offset and friction named after their log. Predictions of
    /// the robot alone do without.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub log_parameters: Vec<ParameterValue>,
    /// Whether the training logs agree in what the fit holds the same; absent with one log.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub log_agreement: Option<LogAgreement>,
    /// Whether the logs bear the ties out; absent without ties that the logs would show.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ties: Option<TieTest>,
    /// Searches over all parameters; absent unless they were asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub searches: Option<Searches>,
    /// Delays of single logs, taken off their efforts.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub log_delays: Vec<OwnDelay>,
    /// Factors on the friction of single logs.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub log_scales: Vec<LogScale>,
    /// Stiffness of elastic joints as the deformation between their encoders tells it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub stiffness: Vec<JointStiffness>,
    /// Base parameters.
    pub base_parameters: Vec<BaseValue>,
    /// Parameters that enter the effort nonlinearly.
    #[serde(default)]
    pub shape_parameters: Vec<ShapeValue>,
    /// Whether the identified friction takes energy out of the motion; joints that move and have friction.
    #[serde(default)]
    pub friction_passivity: Vec<PassivityRecord>,
    /// Whether every link could be a physical body.
    pub feasible: bool,
    /// Physical consistency of the standard parameters and what it costs; absent if none was asked for.
    #[serde(default)]
    pub consistency: Option<ConsistencyRecord>,
    /// Errors on held-out folds of the training logs.
    #[serde(default)]
    pub held_out: HeldOutRecord,
    /// How the residuals bear on the precision.
    #[serde(default)]
    pub precision: PrecisionRecord,
    /// Least squares against instrumental variables; absent unless the configuration describes the closed loop.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exogeneity: Option<ExogeneityRecord>,
    /// Models with fewer base parameters.
    #[serde(default)]
    pub pruning: Option<PruningRecord>,
    /// Motions that would reveal what these logs do not, most helpful first, a sentence each.
    #[serde(default)]
    pub motions_that_would_help: Vec<String>,
    /// Fit on the training logs: raw effort; `filtered` the same through the filter at `filter_hz`.
    pub fit: FitSummary,
    /// Validation, log by log.
    pub validation: Vec<LogFit>,
    /// Robot files beside the identified model: what they state, and what they lose.
    #[serde(default)]
    pub exported: ExportedRecord,
    /// What the pre-flight of the training logs found, the remedies it took for granted included.
    #[serde(default)]
    pub preflight: Vec<FindingRecord>,
    /// Rows that logs share although each should be a recording of its own.
    #[serde(default, skip_serializing_if = "Overlaps::is_empty")]
    pub overlaps: Overlaps,
    /// What speaks for the scale of the efforts.
    #[serde(default)]
    pub effort_scale: EffortScale,
    /// Verdict in words and checks.
    pub verdict: Verdict,
    /// Choices of the conditioning, with reasons.
    pub conditioning: ConditioningRecord,
    /// What `predict` needs besides parameters.
    pub model: ModelRecord,
    /// Inputs and settings.
    pub provenance: Provenance,
}

/// A finding of the pre-flight ([`crate::preflight`]).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct FindingRecord {
    /// Which fault.
    pub id: FindingId,
    /// How much it matters.
    pub severity: Severity,
    /// Joint, if it is a joint's own.
    pub joint: Option<String>,
    /// Log file.
    pub log: String,
    /// What was measured.
    pub evidence: String,
}

impl From<&crate::finding::Finding> for FindingRecord {
    fn from(of: &crate::finding::Finding) -> Self {
        FindingRecord {
            id: of.id,
            severity: of.severity,
            joint: of.joint.clone(),
            log: of.log.clone(),
            evidence: of.evidence.clone(),
        }
    }
}

/// A log with a factor of its own on the friction of all joints.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct LogScale {
    /// Log.
    pub log: String,
    /// Friction in this log over that in the logs without such a factor.
    pub value: f64,
    /// Standard deviation of the factor, where the logs show it.
    pub std: Option<f64>,
    /// 95 % interval of the factor, where the logs show it.
    pub interval: Option<(f64, f64)>,
    /// What the logs say of it.
    pub verdict: ShapeVerdict,
    /// Why.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
}

/// Which standard parameters stand for the base values.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Split {
    /// Bodies that can exist, as robot files state them.
    #[default]
    Consistent,
    /// Base values exactly as fitted; not every link need be a body that can exist.
    Unconstrained,
}

/// Rank of the log.
#[derive(Debug, Clone, Serialize, Deserialize, schemars::JsonSchema)]
pub struct RankStatus {
    /// Columns that some motion of this robot can tell apart: base parameters, and one column per shape parameter.
    pub structural: usize,
    /// Columns of these that the logs excite.
    pub excited: usize,
    /// Gap of the structural singular values.
    pub structural_gap: Option<f64>,
    /// Base parameters that these logs leave out.
    pub not_excited: Vec<String>,
    /// Standard parameters that no motion reveals.
    pub never_seen: Vec<String>,
}

/// One standard parameter.
#[derive(Debug, Clone, Serialize, Deserialize, schemars::JsonSchema)]
pub struct ParameterValue {
    /// Name, `<link>.Izz` or `<joint>.fc`.
    pub name: String,
    /// Link it belongs to.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub link: Option<String>,
    /// Joint it belongs to.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub joint: Option<String>,
    /// Unit.
    pub unit: String,
    /// Value, physically consistent with the link's other parameters.
    pub value: f64,
    /// Value without constraints: base values as fitted, split as near as possible to the robot file.
    #[serde(default)]
    pub unconstrained: Option<f64>,
    /// Standard deviation of that, if the parameter is seen in the data.
    pub std: Option<f64>,
    /// Relative standard deviation, percent.
    pub rel_std: Option<f64>,
    /// 95 % interval around the unconstrained value, cut to where the parameter can lie; if seen in the data.
    #[serde(default)]
    pub interval: Option<(f64, f64)>,
    /// The interval is wide: beyond 30 % of the value or of the deviation that was thought possible beforehand.
    #[serde(default)]
    pub wide: bool,
    /// A constraint moved the value by more than a standard deviation.
    #[serde(default)]
    pub at_boundary: bool,
    /// Where the value comes from.
    pub verdict: ParameterVerdict,
    /// For what is carried by the prior: why.
    #[serde(default)]
    pub reason: Option<CarriedReason>,
    /// Share of the prior variance that the logs remove, 0 to 1.
    #[serde(default)]
    pub share: Option<f64>,
    /// Share that any motion of the robot could remove.
    #[serde(default)]
    pub possible_share: Option<f64>,
    /// What the data see of a parameter that acts only together with others.
    #[serde(default)]
    pub combination: Option<String>,
    /// The motion that would help.
    #[serde(default)]
    pub advice: Option<String>,
    /// How it follows from others, `j2.fc = j1.fc`; absent: it does not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tie: Option<String>,
    /// Value of the robot file.
    pub prior: Option<f64>,
}

/// One base parameter.
#[derive(Debug, Clone, Serialize, Deserialize, schemars::JsonSchema)]
pub struct BaseValue {
    /// Name of the kept parameter.
    pub name: String,
    /// Regrouping.
    pub expression: String,
    /// Unit.
    pub unit: String,
    /// Value as identified, without constraints; absent if the logs do not excite it.
    pub value: Option<f64>,
    /// Value of the physically consistent parameters.
    #[serde(default)]
    pub consistent_value: Option<f64>,
    /// 95 % half width.
    #[serde(default)]
    pub half_width: Option<f64>,
    /// `seen in the data` or `carried by the prior`.
    #[serde(default)]
    pub verdict: Option<ParameterVerdict>,
    /// Share of the prior variance that the logs remove, 0 to 1.
    #[serde(default)]
    pub share: Option<f64>,
    /// Standard deviation: jackknife over time blocks where there are at least 10; of 2 to 9 blocks that for white residuals times the root of
    /// the variance inflation; else that for white residuals.
    pub std: Option<f64>,
    /// Standard deviation for white residuals.
    pub std_white: Option<f64>,
    /// Relative standard deviation, percent; absent where the value is below two standard deviations.
    pub rel_std: Option<f64>,
}

/// One shape parameter: a Stribeck velocity, the slope of an arctangent.
#[derive(Debug, Clone, Serialize, Deserialize, schemars::JsonSchema)]
pub struct ShapeValue {
    /// Name, `<joint>.vs`.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Value, beside physically consistent linear parameters.
    pub value: f64,
    /// Value beside the linear parameters without constraints; absent: the same.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unconstrained: Option<f64>,
    /// Range that was searched.
    pub range: (f64, f64),
    /// How it follows from another, `j2.vs = j1.vs`; absent: it does not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tie: Option<String>,
    /// Standard deviation of the unconstrained value; absent if it was not estimated.
    #[serde(default)]
    pub std: Option<f64>,
    /// 95 % interval around the unconstrained value; one-sided ones end at a bound.
    #[serde(default)]
    pub interval: Option<(f64, f64)>,
    /// What the logs say of it.
    pub verdict: ShapeVerdict,
    /// Why, in words.
    #[serde(default)]
    pub reason: Option<String>,
}

/// Agreement in motion and at rest apart, on equally filtered effort.
///
/// A joint moves where `|v| ≥ max(4 σ_v, 3 % of its rms speed)`, `σ_v` the noise of its speed: below, the sign of the speed is chance.
#[derive(Debug, Clone, Default, Serialize, Deserialize, schemars::JsonSchema)]
pub struct ByMotion {
    /// On samples in which the joint moves.
    pub moving: FitValues,
    /// On samples in which it stands, where friction may have any value up to static friction.
    pub standing: FitValues,
    /// Share of the samples in which it stands, per joint.
    pub standing_share: Vec<f64>,
    /// Least speed that counts as motion, per joint, rad/s or m/s; the least of several logs.
    pub least_speed: Vec<f64>,
}

/// Fit on training logs.
#[derive(Debug, Clone, Serialize, Deserialize, schemars::JsonSchema)]
pub struct FitSummary {
    /// On raw effort.
    #[serde(flatten)]
    pub raw: FitValues,
    /// On equally filtered effort.
    pub filtered: FitValues,
    /// Cut-off of that filter (zero-phase Butterworth of order 4), Hz.
    pub filter_hz: f64,
    /// In motion and at rest apart.
    #[serde(default)]
    pub by_motion: ByMotion,
}

/// Fit on one log.
#[derive(Debug, Clone, Serialize, Deserialize, schemars::JsonSchema)]
pub struct LogFit {
    /// Log file.
    pub log: String,
    /// On raw effort.
    #[serde(flatten)]
    pub raw: FitValues,
    /// On equally filtered effort.
    pub filtered: FitValues,
    /// Cut-off of that filter, Hz.
    pub filter_hz: f64,
    /// Figures on filtered effort without aligning prediction and effort by the identified delay.
    pub filtered_unaligned: FitValues,
    /// In motion and at rest apart.
    #[serde(default)]
    pub by_motion: ByMotion,
}

/// Verdict of a run.
#[derive(Debug, Clone, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Verdict {
    /// The worst of the checks.
    pub status: Status,
    /// One sentence on the result, one on what it is worth.
    pub headline: String,
    /// The first of them alone: what the logs show, and how well the model predicts.
    #[serde(default)]
    pub line: String,
    /// What to look at before the result is used, the worst first, each with what mends it: checks that did not pass, and warnings.
    #[serde(default)]
    pub cautions: Vec<Caution>,
    /// What it takes for granted, since no log tells it, a sentence each.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub assumptions: Vec<String>,
    /// Checks behind it.
    pub checks: Vec<CheckResult>,
    /// Warnings.
    pub warnings: Vec<String>,
}

/// One choice of the conditioning.
#[derive(Debug, Clone, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Choice {
    /// Setting.
    pub name: String,
    /// Value.
    pub value: Json,
    /// Unit.
    pub unit: String,
    /// Where it comes from.
    pub origin: Origin,
    /// Why.
    pub reason: String,
}

/// Choices and the evidence for them.
#[derive(Debug, Clone, Serialize, Deserialize, schemars::JsonSchema)]
pub struct ConditioningRecord {
    /// Which way from samples to rows.
    pub route: Route,
    /// Choices.
    pub choices: Vec<Choice>,
    /// Delay of the motion behind the logged effort, samples.
    pub delay_samples: f64,
    /// Sample rate that the delay was found at, Hz.
    pub delay_rate_hz: f64,
    /// Half width of its 95 % interval, samples.
    pub delay_half_width: Option<f64>,
    /// Per joint: delay and standard error, samples.
    pub delay_per_joint: Vec<(f64, f64)>,
    /// Kernels tried: cut-off Hz, relative held-out loss with linear and with rich friction.
    pub kernel_trials: Vec<(f64, f64, f64)>,
    /// Reversal ladder: share of rms speed (absent: no mask), relative loss, its standard error, share of samples kept.
    pub mask_trials: Vec<(Option<f64>, f64, f64, f64)>,
    /// Friction shapes tried on held-out blocks.
    #[serde(default)]
    pub friction_trials: Vec<FrictionTrial>,
    /// Efforts that repeat with the position of a joint, as the residuals of a fit without them showed. The elements of the model hold them.
    #[serde(default)]
    pub cyclic_efforts: Vec<CyclicEffort>,
    /// RMS of the fit's own rows, per joint.
    pub row_rms: Vec<Option<f64>>,
    /// Residual against what sensor noise explains, per joint.
    pub residual_ratio: Vec<Option<f64>>,
}

/// Where a result comes from.
#[derive(Debug, Clone, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Provenance {
    /// Version of the program.
    pub version: String,
    /// Revision of its source; absent if it was not built from a repository, or the program that calls the library does not say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub revision: Option<String>,
    /// Arguments of the command line as given, the program's name first; empty if a program called the library.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub command_line: Vec<String>,
    /// Input files.
    pub inputs: Vec<InputRecord>,
    /// How the training logs were read, which `validate` and others follow; absent from files of earlier versions and of other
    /// commands.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reading: Option<ReadingRecord>,
    /// Settings of the run.
    pub settings: Json,
    /// Seed.
    pub seed: u64,
}

impl Default for Provenance {
    fn default() -> Self {
        Provenance {
            version: crate::VERSION.to_owned(),
            revision: None,
            command_line: Vec::new(),
            inputs: Vec::new(),
            reading: None,
            settings: Json::Null,
            seed: 0,
        }
    }
}

/// Whose entry a fault is in, as far as the lines before it tell: the last name.
fn of_what(text: &[u8], fault: &serde_json::Error) -> String {
    let text = String::from_utf8_lossy(text);
    let before: Vec<&str> = text.lines().take(fault.line()).collect();
    let named = |line: &&str| line.trim().strip_prefix("\"name\": \"").map(str::to_owned);
    let name = before.iter().rev().find_map(named).filter(|_| fault.is_data());
    let name = name.and_then(|rest| rest.split('"').next().map(str::to_owned));
    name.map_or_else(String::new, |name| format!(", after the name `{name}`"))
}

// Reading and writing are `#[inline]` so that they are compiled with those who do so: that code is a fifth of this room's, and takes
// no time of a run, so that glue compiles it at its own level.
impl Estimate {
    /// Reads an estimate file.
    ///
    /// # Errors
    /// [`Error::Read`], [`Error::EstimateFile`].
    #[inline]
    pub fn read(path: &Path) -> Result<Self, Error> {
        let text =
            dynid_files::input::read(path).map_err(|source| Error::Read { file: path.to_owned(), source })?;
        Estimate::parse(&text, &path.display().to_string())
    }

    /// An estimate from the bytes of its file, `file` in messages.
    ///
    /// # Errors
    /// [`Error::EstimateFile`].
    #[inline]
    pub fn parse(text: &[u8], file: &str) -> Result<Self, Error> {
        let fault = |message: String| Error::EstimateFile { file: file.to_owned(), message };
        let estimate: Estimate =
            serde_json::from_slice(text).map_err(|e| fault(format!("{e}{}", of_what(text, &e))))?;
        if estimate.schema != SCHEMA {
            return Err(fault(format!("expected schema {SCHEMA}, found {}", estimate.schema)));
        }
        Ok(estimate)
    }

    /// The file's text.
    #[inline]
    pub fn to_json(&self) -> String {
        let mut text = serde_json::to_string_pretty(self)
            .unwrap_or_else(|e| unreachable!("an estimate holds only plain data: {e}"));
        text.push('\n');
        text
    }

    /// The robot file that was identified, if the estimate names it.
    pub fn robot_file(&self) -> Option<&InputRecord> {
        self.provenance.inputs.iter().find(|i| i.kind == InputKind::Robot)
    }

    /// Rebuilds the effort model with the shape parameters that go with the linear ones of `split`; `file` stands in
    /// messages.
    ///
    /// # Errors
    /// [`Error::EstimateFile`] if the record contradicts itself or a shape parameter is not within its range.
    pub fn effort_model(&self, file: &Path, split: Split) -> Result<RobotModel, Error> {
        let fault = |message: String| Error::EstimateFile { file: file.display().to_string(), message };
        let description = self.model.description(&self.robot).map_err(&fault)?;
        let mechanism = description.build().map_err(|e| fault(e.to_string()))?;
        let closed = self.model.loops.as_ref().map(|l| l.close(&mechanism)).transpose().map_err(&fault)?;
        let plan = self.model.plan(&mechanism).map_err(|e| fault(e.to_string()))?;
        let plan = plan.with_loops(closed.map(std::sync::Arc::new));
        let efforts = plan.names(&mechanism).len();
        if plan.per_rate.len() != efforts {
            return Err(fault(format!(
                "elements for {} efforts, the robot has {}",
                plan.per_rate.len(),
                efforts
            )));
        }
        for law in &plan.known {
            law.check().map_err(|e| fault(format!("known friction of joint `{}`: {e}", law.joint)))?;
        }
        let model = plan.model(&mechanism)?;
        let table = model.parameters();
        let expected = table.linear.len();
        if expected != self.parameters.len() {
            return Err(fault(format!("{} parameters, the model has {expected}", self.parameters.len())));
        }
        let shape = self.shape(split, &table.shape).map_err(&fault)?;
        let reference = LoadReference { linear: self.values(split), shape, linearised: false };
        let model = model.with_shape(&reference.shape).with_load_reference(reference);
        model.map_err(|e| fault(e.to_string()))
    }

    /// Values of the shape parameters that go with a split; `Err` says what is wrong with them.
    fn shape(&self, split: Split, expected: &[ShapeParameter]) -> Result<Vec<f64>, String> {
        let names = |list: &mut dyn Iterator<Item = &String>| {
            let list: Vec<String> = list.map(|name| format!("`{name}`")).collect();
            if list.is_empty() { "none".to_owned() } else { list.join(", ") }
        };
        if !self.shape_parameters.iter().map(|s| &s.name).eq(expected.iter().map(|s| &s.name)) {
            return Err(format!(
                "expected the shape parameters {}, found {}",
                names(&mut expected.iter().map(|s| &s.name)),
                names(&mut self.shape_parameters.iter().map(|s| &s.name))
            ));
        }
        let within = |(found, model): (&ShapeValue, &ShapeParameter)| {
            let value = match split {
                Split::Unconstrained => found.unconstrained.unwrap_or(found.value),
                Split::Consistent => found.value,
            };
            if value >= model.lower && value <= model.upper {
                return Ok(value);
            }
            let ShapeParameter { name, unit, lower, upper, .. } = model;
            Err(format!("shape parameter `{name}`: expected {lower} to {upper} {unit}, found {value}"))
        };
        self.shape_parameters.iter().zip(expected).map(within).collect()
    }

    /// Values of all linear parameters.
    pub fn values(&self, split: Split) -> Vec<f64> {
        match split {
            Split::Unconstrained => {
                self.parameters.iter().map(|p| p.unconstrained.unwrap_or(p.value)).collect()
            }
            Split::Consistent => self.parameters.iter().map(|p| p.value).collect(),
        }
    }
}
