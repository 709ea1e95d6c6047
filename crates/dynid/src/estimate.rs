//! The result file `estimate.json`: stable keys, added to but never renamed.

use std::path::Path;

use dynid_io::{CouplingForm, CouplingSpec, ElementSetting, ElementSpec, SettingValue};
use dynid_model::{
    Description, Inertia, JointDescription, JointKind, Limits, LinkDescription, Mat3, Mechanism, Mimic,
    Placement, RobotModel, Vec3,
};
use serde::{Deserialize, Serialize};
use serde_json::Value as Json;

use crate::Error;
use crate::elements::ElementPlan;

/// Version of the file's layout.
pub const SCHEMA: u32 = 1;

/// An identified model: what `identify` writes and `predict`, `validate` read.
#[derive(Debug, Clone, Serialize, Deserialize)]
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
    /// The same with columns scaled to unit length.
    pub condition_number_scaled: Option<f64>,
    /// Rank found in the logs against the structural rank.
    pub rank: RankStatus,
    /// Standard parameters: links, then elements. Their split follows the robot file where only combinations are seen.
    pub parameters: Vec<ParameterValue>,
    /// Base parameters.
    pub base_parameters: Vec<BaseValue>,
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
    /// Verdict in words and checks.
    pub verdict: Verdict,
    /// Choices of the conditioning, with reasons.
    pub conditioning: ConditioningRecord,
    /// What `predict` needs besides parameters.
    pub model: ModelRecord,
    /// Inputs and settings.
    pub provenance: Provenance,
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
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct RankStatus {
    /// Base parameters that some motion of this robot can reveal.
    pub structural: usize,
    /// Base parameters that these logs excite.
    pub excited: usize,
    /// Gap of the structural singular values.
    pub structural_gap: Option<f64>,
    /// Base parameters that these logs leave out.
    pub not_excited: Vec<String>,
    /// Standard parameters that no motion reveals.
    pub never_seen: Vec<String>,
}

/// One standard parameter.
#[derive(Debug, Clone, Serialize, Deserialize)]
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
    /// `seen in the data`, `carried by the prior` or `not identifiable`.
    pub verdict: String,
    /// For what is carried by the prior: `only in combination`, `not excited` or `too noisy`.
    #[serde(default)]
    pub reason: Option<String>,
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
    /// Value of the robot file.
    pub prior: Option<f64>,
}

/// One base parameter.
#[derive(Debug, Clone, Serialize, Deserialize)]
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
    pub verdict: Option<String>,
    /// Share of the prior variance that the logs remove, 0 to 1.
    #[serde(default)]
    pub share: Option<f64>,
    /// Standard deviation (jackknife over time blocks where there are at least 10, else white residuals).
    pub std: Option<f64>,
    /// Standard deviation for white residuals.
    pub std_white: Option<f64>,
    /// Relative standard deviation, percent; absent where the value is below two standard deviations.
    pub rel_std: Option<f64>,
}

/// Physical consistency.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct ConsistencyRecord {
    /// `pseudo-inertia` or `spatial-inertia`.
    pub form: String,
    /// `unconstrained` (no constraint matters), `optimal` or `stalled` (consistent, but the gap is above the tolerance).
    pub status: String,
    /// What consistency costs in fit: increase of the weighted sum of squares, in residual variances.
    pub price: f64,
    /// That increase over what the same number of parameters would take up by chance, `price / (variance inflation ·
    /// base parameters)`; around 1 is no more than noise.
    pub price_over_chance: Option<f64>,
    /// Weight of the distance from the robot file, as given or as large as held-out folds allow.
    pub prior_weight: f64,
    /// Weights tried, each with its squared held-out error relative to that without constraints (mean over joints).
    pub prior_trials: Vec<(f64, Option<f64>)>,
    /// No consistent parameters (with whitened sizes up to ten times these) have an objective lower by more than this.
    pub gap: f64,
    /// Iterations of the interior-point method.
    pub iterations: usize,
    /// Least eigenvalue of the links' pseudo-inertias in units of the prior's; at least 1e-6.
    pub least_eigenvalue: f64,
    /// Constraints that hold the estimate back, in words.
    pub active: Vec<String>,
    /// Figures of the parameters without constraints on the training logs; empty where they predict the same.
    pub training_unconstrained: Vec<LogFit>,
    /// The same on the validation logs.
    pub validation_unconstrained: Vec<LogFit>,
}

/// Errors on held-out folds of time of the training logs, rows as the fit sees them.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct HeldOutRecord {
    /// Number of folds.
    pub folds: usize,
    /// RMS per joint, in the effort's unit, without constraints.
    pub rms: Vec<Option<f64>>,
    /// Its standard error over the folds.
    pub rms_standard_error: Vec<Option<f64>>,
    /// RMS per joint of the physically consistent estimate.
    pub rms_consistent: Vec<Option<f64>>,
    /// `100 ‖residual‖ / ‖effort‖` over all joints without constraints, percent.
    pub relative_error: Option<f64>,
    /// The same of the physically consistent estimate, percent.
    pub relative_error_consistent: Option<f64>,
}

/// What the residuals say about the standard deviations.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct PrecisionRecord {
    /// By how much coloured residuals inflate the variances that white ones would give (median over base parameters).
    pub variance_inflation: f64,
    /// The same per joint.
    pub variance_inflation_per_joint: Vec<Option<f64>>,
    /// Number of time blocks behind the standard deviations.
    pub blocks: usize,
    /// Their length, s.
    pub block_s: f64,
    /// Length that the correlation of the residuals asks for, s.
    pub wanted_block_s: f64,
    /// Correlation time of the residuals, s: per training log and joint, log after log.
    #[serde(default)]
    pub correlation_s: Vec<Option<f64>>,
    /// Per training log and joint: test of whiteness inside the band of the kernel.
    pub whiteness: Vec<Vec<Option<WhitenessRecord>>>,
}

/// Cumulative periodogram test.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct WhitenessRecord {
    /// Largest distance from a straight line.
    pub distance: f64,
    /// Threshold at 5 %.
    pub threshold: f64,
    /// White noise is rejected.
    pub rejected: bool,
    /// Frequency of the largest peak, Hz.
    pub dominant_hz: f64,
}

/// Backward elimination of base parameters.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct PruningRecord {
    /// All models, from the whole one down to one parameter.
    pub path: Vec<PruningStep>,
    /// Number of parameters of the smallest model within one standard error of the least held-out error.
    pub essential: Option<usize>,
    /// Names of its parameters.
    pub essential_parameters: Vec<String>,
    /// Number of parameters of the model of least BIC.
    pub least_bic: usize,
    /// Number of parameters of the first model in which every parameter is significant.
    pub all_significant: Option<usize>,
    /// Threshold of that test.
    pub threshold: f64,
}

/// One model of a backward elimination.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct PruningStep {
    /// Number of parameters.
    pub parameters: usize,
    /// Parameter that goes next.
    pub next: String,
    /// Its test statistic, `value² / variance`.
    pub statistic: Option<f64>,
    /// Weighted residual sum of squares.
    pub rss: f64,
    /// Bayesian information criterion.
    pub bic: Option<f64>,
    /// Mean held-out squared error in residual variances.
    pub held_out: Option<f64>,
    /// Its standard error.
    pub held_out_standard_error: Option<f64>,
}

/// Per-joint agreement, in the effort's unit.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct FitValues {
    /// Root mean square error per joint.
    pub rms: Vec<Option<f64>>,
    /// RMS over the range of the measured effort, per joint.
    pub nrmse: Vec<Option<f64>>,
    /// Coefficient of determination per joint.
    pub r2: Vec<Option<f64>>,
    /// `100 ‖residual‖ / ‖effort‖` per joint, percent.
    pub relative_error_per_joint: Vec<Option<f64>>,
    /// The same over all joints, percent.
    pub relative_error: Option<f64>,
}

/// Fit on training logs.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct FitSummary {
    /// On raw effort.
    #[serde(flatten)]
    pub raw: FitValues,
    /// On equally filtered effort.
    pub filtered: FitValues,
    /// Cut-off of that filter (zero-phase Butterworth of order 4), Hz.
    pub filter_hz: f64,
}

/// Fit on one log.
#[derive(Debug, Clone, Serialize, Deserialize)]
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
    /// The same on filtered effort without aligning prediction and effort by the identified delay.
    pub filtered_unaligned: FitValues,
}

/// Verdict of a run.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Verdict {
    /// `ok`, `warn` or `fail`.
    pub status: String,
    /// One sentence.
    pub headline: String,
    /// Checks behind it.
    pub checks: Vec<CheckResult>,
    /// Warnings.
    pub warnings: Vec<String>,
}

/// One check.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct CheckResult {
    /// `ok`, `warn` or `fail`.
    pub status: String,
    /// Name.
    pub name: String,
    /// Value.
    pub value: Option<f64>,
    /// Unit.
    pub unit: String,
    /// What is expected.
    pub limit: String,
    /// What it means.
    pub meaning: String,
}

/// One choice of the conditioning.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Choice {
    /// Setting.
    pub name: String,
    /// Value.
    pub value: Json,
    /// Unit.
    pub unit: String,
    /// `found`, `given` or `default`.
    pub origin: String,
    /// Why.
    pub reason: String,
}

/// Choices and the evidence for them.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct ConditioningRecord {
    /// `compact` or `textbook`.
    pub route: String,
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
    /// RMS of the fit's own rows, per joint.
    pub row_rms: Vec<Option<f64>>,
    /// Residual against what sensor noise explains, per joint.
    pub residual_ratio: Vec<Option<f64>>,
}

/// Robot, elements and settings that predictions need.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct ModelRecord {
    /// Gravity, m/s².
    pub gravity: [f64; 3],
    /// Floating base under the root link.
    pub floating_base: bool,
    /// Mimic joints follow their leaders.
    pub couple_mimics: bool,
    /// Links: name, and the inertia of the robot file.
    pub links: Vec<LinkRecord>,
    /// Joints.
    pub joints: Vec<JointRecord>,
    /// Element names per effort.
    pub elements: Vec<Vec<String>>,
    /// Couplings.
    pub couplings: Vec<CouplingRecord>,
    /// Numeric settings of elements: joint, element, key, value.
    pub element_settings: Vec<(String, String, String, f64)>,
    /// Cut-off of the state filter, Hz.
    pub state_hz: f64,
    /// Cut-off of the widest kernel, Hz.
    pub kernel_hz: f64,
}

/// A link.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct LinkRecord {
    /// Name.
    pub name: String,
    /// Ten standard parameters, if the file states them.
    pub phi: Option<[f64; 10]>,
}

/// A joint.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct JointRecord {
    /// Name.
    pub name: String,
    /// Parent link.
    pub parent: String,
    /// Child link.
    pub child: String,
    /// Kind.
    pub kind: String,
    /// Pitch of a helical joint, m/rad.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pitch: Option<f64>,
    /// Rows of the rotation parent ← joint.
    pub rotation: [[f64; 3]; 3],
    /// Origin in the parent, m.
    pub translation: [f64; 3],
    /// Axis.
    pub axis: [f64; 3],
    /// Position limits.
    pub position_limits: Option<(f64, f64)>,
    /// Leader, ratio and offset of a mimic joint.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mimic: Option<(String, f64, f64)>,
}

/// A coupling.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct CouplingRecord {
    /// Motors.
    pub motors: Vec<String>,
    /// Joints.
    pub joints: Vec<String>,
    /// Matrix.
    pub matrix: Vec<Vec<f64>>,
    /// `strict` or `columns`.
    pub form: String,
}

/// Where a result comes from.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Provenance {
    /// Version of the program.
    pub version: String,
    /// Input files.
    pub inputs: Vec<InputRecord>,
    /// Settings of the run.
    pub settings: Json,
    /// Seed.
    pub seed: u64,
}

/// An input file.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct InputRecord {
    /// Path as given.
    pub path: String,
    /// `robot`, `log` or `validation`.
    pub kind: String,
    /// SHA-256 of its bytes.
    pub sha256: String,
}

impl Estimate {
    /// Reads an estimate file.
    ///
    /// # Errors
    /// [`Error::Read`], [`Error::EstimateFile`].
    pub fn read(path: &Path) -> Result<Self, Error> {
        let text = std::fs::read(path).map_err(|source| Error::Read { file: path.to_owned(), source })?;
        let fault = |message: String| Error::EstimateFile { file: path.display().to_string(), message };
        let estimate: Estimate = serde_json::from_slice(&text).map_err(|e| fault(e.to_string()))?;
        if estimate.schema != SCHEMA {
            return Err(fault(format!("expected schema {SCHEMA}, found {}", estimate.schema)));
        }
        Ok(estimate)
    }

    /// The file's text.
    pub fn to_json(&self) -> String {
        let mut text = serde_json::to_string_pretty(self)
            .unwrap_or_else(|e| unreachable!("an estimate holds only plain data: {e}"));
        text.push('\n');
        text
    }

    /// Rebuilds the effort model.
    ///
    /// # Errors
    /// [`Error::EstimateFile`] if the record contradicts itself.
    pub fn effort_model(&self, file: &Path) -> Result<RobotModel, Error> {
        let fault = |message: String| Error::EstimateFile { file: file.display().to_string(), message };
        let description = self.model.description(&self.robot).map_err(&fault)?;
        let mechanism = description.build().map_err(|e| fault(e.to_string()))?;
        let plan = self.model.plan();
        if plan.per_rate.len() != mechanism.rates() {
            return Err(fault(format!(
                "elements for {} efforts, the robot has {}",
                plan.per_rate.len(),
                mechanism.rates()
            )));
        }
        let elements = plan.build(&mechanism)?;
        let model = RobotModel::new(mechanism, elements);
        let expected = dynid_model::EffortModel::parameters(&model).linear.len();
        if expected != self.parameters.len() {
            return Err(fault(format!("{} parameters, the model has {expected}", self.parameters.len())));
        }
        Ok(model)
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

impl ModelRecord {
    /// Records a description and what acts at its joints.
    pub fn new(description: &Description, mechanism: &Mechanism, plan: &ElementPlan) -> Self {
        let links = description
            .links
            .iter()
            .map(|l| LinkRecord { name: l.name.clone(), phi: l.inertia.map(|i| i.0) })
            .collect();
        let joints = description.joints.iter().map(joint_record).collect();
        let couplings = plan
            .couplings
            .iter()
            .map(|c| CouplingRecord {
                motors: c.motors.clone(),
                joints: c.joints.clone(),
                matrix: c.matrix.clone(),
                form: match c.form {
                    CouplingForm::Strict => "strict".to_owned(),
                    CouplingForm::Columns => "columns".to_owned(),
                },
            })
            .collect();
        let element_settings = plan
            .settings()
            .iter()
            .filter_map(|s| match s.value {
                SettingValue::Number(x) => Some((s.joint.clone(), s.element.clone(), s.key.clone(), x)),
                _ => None,
            })
            .collect();
        ModelRecord {
            gravity: mechanism.gravity().0,
            floating_base: description.floating_base,
            couple_mimics: description.couple_mimics,
            links,
            joints,
            elements: plan.per_rate.clone(),
            couplings,
            element_settings,
            state_hz: 0.0,
            kernel_hz: 0.0,
        }
    }

    pub(crate) fn description(&self, name: &str) -> Result<Description, String> {
        let mut d = Description::new(name);
        d.gravity = self.gravity;
        d.floating_base = self.floating_base;
        d.couple_mimics = self.couple_mimics;
        d.links = self
            .links
            .iter()
            .map(|l| LinkDescription { name: l.name.clone(), inertia: l.phi.map(Inertia) })
            .collect();
        d.joints = self.joints.iter().map(joint_description).collect::<Result<_, _>>()?;
        Ok(d)
    }

    fn plan(&self) -> ElementPlan {
        let couplings = self
            .couplings
            .iter()
            .map(|c| CouplingSpec {
                motors: c.motors.clone(),
                joints: c.joints.clone(),
                matrix: c.matrix.clone(),
                form: if c.form == "columns" { CouplingForm::Columns } else { CouplingForm::Strict },
            })
            .collect();
        let settings = self
            .element_settings
            .iter()
            .map(|(joint, element, key, value)| ElementSetting {
                joint: joint.clone(),
                element: element.clone(),
                key: key.clone(),
                value: SettingValue::Number(*value),
            })
            .collect();
        let spec = ElementSpec { settings, ..ElementSpec::default() };
        ElementPlan::recorded(self.elements.clone(), couplings, spec)
    }
}

fn joint_record(j: &JointDescription) -> JointRecord {
    let (kind, pitch) = match j.kind {
        JointKind::Revolute => ("revolute", None),
        JointKind::Continuous => ("continuous", None),
        JointKind::Prismatic => ("prismatic", None),
        JointKind::Helical { pitch } => ("helical", Some(pitch)),
        JointKind::Floating => ("floating", None),
        JointKind::Fixed => ("fixed", None),
    };
    JointRecord {
        name: j.name.clone(),
        parent: j.parent.clone(),
        child: j.child.clone(),
        kind: kind.to_owned(),
        pitch,
        rotation: j.placement.rotation.rows(),
        translation: j.placement.translation.0,
        axis: j.axis,
        position_limits: j.limits.position,
        mimic: j.mimic.as_ref().map(|m| (m.of.clone(), m.ratio, m.offset)),
    }
}

fn joint_description(j: &JointRecord) -> Result<JointDescription, String> {
    let kind = match (j.kind.as_str(), j.pitch) {
        ("revolute", _) => JointKind::Revolute,
        ("continuous", _) => JointKind::Continuous,
        ("prismatic", _) => JointKind::Prismatic,
        ("helical", Some(pitch)) => JointKind::Helical { pitch },
        ("floating", _) => JointKind::Floating,
        ("fixed", _) => JointKind::Fixed,
        (other, _) => return Err(format!("joint `{}`: unknown kind `{other}`", j.name)),
    };
    Ok(JointDescription {
        name: j.name.clone(),
        parent: j.parent.clone(),
        child: j.child.clone(),
        kind,
        placement: Placement { rotation: Mat3::from_rows(j.rotation), translation: Vec3(j.translation) },
        axis: j.axis,
        limits: Limits { position: j.position_limits, ..Limits::default() },
        mimic: j.mimic.clone().map(|(of, ratio, offset)| Mimic { of, ratio, offset }),
    })
}
