//! What a design leaves behind as JSON.

use dynid_excitation::constraint::{ConstraintKind, DISTANCE_SCALE};
use dynid_excitation::{Infeasible, LimitKind, LimitPoint, StartOutcome};
use dynid_identify::Error;
use dynid_identify::estimate::{InputKind, InputRecord, Provenance};
use dynid_record::Outcome;
use serde::Serialize;

use super::config::{CriterionName, DesignConfig};
use super::safety::SafetyRecord;
use super::{DesignRun, DesignedTrajectory, FollowedRecord};

/// Schema of `design.json`.
pub(super) const SCHEMA: &str = "dynid-design/1";
/// Starts within this share of the best count as equally good.
pub(super) const NEAR_BEST: f64 = 0.05;
/// Relative standard deviation above which a parameter is called poorly seen.
const POORLY_SEEN: f64 = 0.3;

/// `design.json`: keys are added, never renamed.
#[derive(Debug, Clone, Serialize, schemars::JsonSchema)]
pub struct DesignRecord {
    /// Schema and version.
    pub schema: &'static str,
    /// Robot file.
    pub robot: String,
    /// Joints in the order of every "per joint" list.
    pub joints: Vec<String>,
    /// The result in words.
    pub verdict: DesignVerdict,
    /// What was minimised.
    pub criterion: CriterionRecord,
    /// Form of the trajectory.
    pub trajectory: TrajectoryRecord,
    /// Condition number of the noise-weighted columns in SI units; `None` without a trajectory, like all below.
    pub condition_number: Option<f64>,
    /// Condition number of the columns at unit length.
    pub condition_number_scaled: Option<f64>,
    /// Largest and smallest singular value of the noise-weighted matrix.
    pub singular_values: Option<[f64; 2]>,
    /// Predicted standard deviations.
    pub parameters: Vec<ParameterForecast>,
    /// Pairs that the log will hardly tell apart.
    pub confounded: Vec<PairRecord>,
    /// Parameters that make up the direction seen least, with their shares.
    pub weakest: Vec<ShareRecord>,
    /// Every limit at its instant of largest use, most used first.
    pub limits: Vec<LimitRecord>,
    /// What is kept by default (floor, own links), and what is not checked.
    pub safety: SafetyRecord,
    /// Least distance between links that are kept apart, m: of 0.25 m and more a lower bound.
    pub least_distance_m: Option<f64>,
    /// Least height of links above the floor (or distance from the mounting plane), m.
    pub least_height_m: Option<f64>,
    /// Predicted gain over random motion within the same limits.
    pub random: Option<RandomRecord>,
    /// All starts.
    pub starts: Vec<StartRecord>,
    /// Why there is no trajectory.
    pub infeasible: Option<InfeasibleRecord>,
    /// Where the drives lead the robot, of designs for logs without efforts.
    pub followed: Option<FollowedRecord>,
    /// Noise that the forecast assumes, per joint: of efforts, N m or N; of designs for logs without them of positions, rad or m.
    pub noise: Vec<f64>,
    /// Where all this comes from.
    pub provenance: Provenance,
}

/// The result in words.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct DesignVerdict {
    /// Whether the motion may be run.
    pub status: Outcome,
    /// One sentence.
    pub headline: String,
    /// What to know before the motion is run.
    pub warnings: Vec<String>,
}

/// The criterion and its value.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct CriterionRecord {
    /// Name, as in the configuration.
    pub name: CriterionName,
    /// What the value means.
    pub meaning: &'static str,
    /// Value on the report's samples with exact signs.
    pub value: Option<f64>,
    /// Logarithm that was minimised.
    pub logarithm: Option<f64>,
}

/// Form of the trajectory.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct TrajectoryRecord {
    /// Period, s.
    pub period_s: f64,
    /// Harmonics.
    pub harmonics: usize,
    /// Recorded periods.
    pub periods: usize,
    /// Approach, s.
    pub approach_s: Option<f64>,
    /// Return, s.
    pub return_s: Option<f64>,
    /// Rate, Hz.
    pub sample_rate_hz: f64,
    /// Coefficients `[q0, a.., b..]` per joint, plain amplitudes.
    pub coefficients: Vec<Vec<f64>>,
}

/// Forecast of one base parameter.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct ParameterForecast {
    /// Name.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Nominal value.
    pub nominal: Option<f64>,
    /// Predicted standard deviation.
    pub std: f64,
    /// In shares of the nominal value.
    pub rel_std: Option<f64>,
}

/// A confounded pair.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct PairRecord {
    /// Names.
    pub names: [String; 2],
    /// Correlation.
    pub correlation: f64,
}

/// A name and a share.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct ShareRecord {
    /// Name.
    pub name: String,
    /// Share, 0 to 1.
    pub share: f64,
}

/// A limit at its instant of largest use.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct LimitRecord {
    /// What is limited.
    pub kind: String,
    /// Whose.
    pub subject: String,
    /// When, s after the start of a period.
    pub time_s: f64,
    /// Excess in units of the limit; 0 at the limit, negative within.
    pub excess: f64,
}

/// Against random motion.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct RandomRecord {
    /// Random trajectories.
    pub trajectories: usize,
    /// Arithmetic mean of the ratios of standard deviations, random over designed.
    pub mean_ratio: f64,
    /// Geometric mean.
    pub geometric_ratio: f64,
    /// Median condition number of the random ones.
    pub condition_number: f64,
}

/// One start.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct StartRecord {
    /// Seed.
    pub seed: u64,
    /// Criterion, as [`CriterionRecord::value`].
    pub value: Option<f64>,
    /// All limits hold.
    pub feasible: bool,
    /// Evaluations.
    pub evaluations: usize,
}

/// Why there is no trajectory.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct InfeasibleRecord {
    /// The start pose itself is outside.
    pub at_start: bool,
    /// Limits that stay broken, worst first.
    pub violations: Vec<LimitRecord>,
    /// The limit without which the rest can be met.
    pub blamed: Option<String>,
}

impl CriterionName {
    /// What its value means.
    pub fn meaning(self) -> &'static str {
        match self {
            CriterionName::RelativeStd => {
                "root of the mean squared relative standard deviation of the base parameters; values below 5 % of the \
                 largest of the same unit count as so large"
            }
            CriterionName::UnitCondition => "condition number of the noise-weighted columns at unit length",
            CriterionName::Condition => "condition number of the noise-weighted columns in SI units",
            CriterionName::Mix => "w1 condition + w2 / smallest singular value",
            CriterionName::A => "root of the mean variance of the base parameters, SI units",
            CriterionName::D => "geometric mean of the axes of the confidence ellipsoid, SI units",
            CriterionName::E => "longest axis of the confidence ellipsoid, SI units",
            CriterionName::Intervals => {
                "largest predicted half width of a wanted interval in units of what is wanted (a smooth maximum, a little above it)"
            }
        }
    }

    /// The figure that people know from the logarithm that is minimised; `columns`: number of parameters.
    fn figure(self, logarithm: f64, columns: usize) -> f64 {
        match self {
            CriterionName::RelativeStd | CriterionName::A => (logarithm.exp() / columns as f64).sqrt(),
            CriterionName::UnitCondition | CriterionName::Condition | CriterionName::Mix => logarithm.exp(),
            CriterionName::D => (logarithm / (2.0 * columns as f64)).exp(),
            CriterionName::E | CriterionName::Intervals => (0.5 * logarithm).exp(),
        }
    }
}

impl From<&LimitPoint> for LimitRecord {
    fn from(point: &LimitPoint) -> Self {
        LimitRecord {
            kind: point.kind.to_string(),
            subject: point.subject.clone(),
            time_s: point.time,
            excess: point.excess,
        }
    }
}

/// Share of the samples at an effort limit that is told.
const AT_LIMIT: f64 = 0.05;

/// What to know before commands are given to drives, in words.
fn doubts(followed: &FollowedRecord) -> Vec<String> {
    let mut out = Vec::new();
    let turned: Vec<&str> = followed
        .joints
        .iter()
        .filter(|j| j.direction != 1.0 || j.zero != 0.0)
        .map(|j| j.joint.as_str())
        .collect();
    if !turned.is_empty() {
        out.push(format!(
            "trajectories hold positions of the robot file's joints; commands.csv holds what the drives are told, direction (q - zero), \
             which is another number for {}",
            turned.join(", ")
        ));
    }
    for joint in followed.joints.iter().filter(|j| j.at_limit > AT_LIMIT) {
        out.push(format!(
            "the drive of `{}` is at its effort limit for {:.0} % of the motion, which then tells nothing but the limit: lower `acceleration` or \
             `share`",
            joint.joint,
            100.0 * joint.at_limit
        ));
    }
    for group in &followed.groups {
        out.push(format!("will be known together only: {}; {}", group.members.join(", "), group.remedy));
    }
    if !followed.unseen.is_empty() {
        out.push(format!("no reading will depend on {}", followed.unseen.join(", ")));
    }
    out
}

impl DesignRun {
    fn inputs(&self) -> Vec<InputRecord> {
        let mut inputs = self.robot.inputs();
        inputs.extend(self.set.safety.meshes.iter().map(|source| InputRecord::of(InputKind::Mesh, source)));
        inputs.extend(self.set.earlier.iter().map(|source| InputRecord::of(InputKind::Trajectory, source)));
        let drives = self.drives.iter().filter_map(|d| d.source.as_ref());
        inputs.extend(drives.map(|source| InputRecord::of(InputKind::Drives, source)));
        inputs
    }

    /// Everything as JSON keys.
    ///
    /// # Errors
    /// [`Error`] of the figures that the record is made of.
    pub fn record(&self, config: &DesignConfig) -> Result<DesignRecord, Error> {
        let set = &self.set;
        let designed = self.outcome.as_ref().ok();
        let forecast = designed.map(|d| &d.forecast);
        let logarithm = designed.and_then(|d| self.starts[d.best].criterion);
        let named = set.problem.model.columns();
        // Offsets and zeros are only there to be told apart from what drives are asked for.
        let counted = |c: &&dynid_excitation::ColumnInfo| self.drives.is_none() || c.nominal.is_some();
        let columns = named.iter().filter(counted).count();
        let leg = |leg: &Option<dynid_logs::trajectory::Leg>| leg.as_ref().map(|l| l.duration_s);
        let mut limits: Vec<LimitRecord> =
            designed.map_or_else(Vec::new, |d| d.uses.iter().map(LimitRecord::from).collect());
        limits.sort_by(|a, b| b.excess.total_cmp(&a.excess));
        Ok(DesignRecord {
            schema: SCHEMA,
            robot: config.robot.display().to_string(),
            joints: set.problem.coordinates.clone(),
            verdict: self.verdict(),
            criterion: CriterionRecord {
                name: set.criterion,
                meaning: match set.criterion {
                    CriterionName::RelativeStd if self.drives.is_some() => {
                        "root of the mean squared relative standard deviation of gains, rotor inertia, friction and delay, the drives' loops taken \
                         for linear"
                    }
                    other => other.meaning(),
                },
                value: logarithm.map(|l| set.criterion.figure(l, columns)),
                logarithm,
            },
            trajectory: TrajectoryRecord {
                period_s: config.form().period_s,
                harmonics: config.form().harmonics,
                periods: config.trajectory.periods,
                approach_s: designed.and_then(|d| leg(&d.motion.file.approach)),
                return_s: designed.and_then(|d| leg(&d.motion.file.back)),
                sample_rate_hz: config.form().sample_rate_hz,
                coefficients: designed.map_or_else(Vec::new, |d| d.coefficients.clone()),
            },
            condition_number: forecast.map(|f| f.condition),
            condition_number_scaled: forecast.map(|f| f.condition_unit_norm),
            singular_values: forecast.map(|f| [f.singular_values.0, f.singular_values.1]),
            parameters: forecast.map_or_else(Vec::new, |f| {
                f.columns
                    .iter()
                    .map(|c| ParameterForecast {
                        name: c.name.clone(),
                        unit: c.unit.clone(),
                        nominal: c.nominal,
                        std: c.std,
                        rel_std: c.relative_std,
                    })
                    .collect()
            }),
            confounded: forecast.map_or_else(Vec::new, |f| {
                f.confounded
                    .iter()
                    .map(|p| PairRecord { names: p.names.clone(), correlation: p.correlation })
                    .collect()
            }),
            weakest: forecast.map_or_else(Vec::new, |f| {
                f.weakest
                    .iter()
                    .map(|(name, share)| ShareRecord { name: name.clone(), share: *share })
                    .collect()
            }),
            limits,
            safety: set.safety.record.clone(),
            least_distance_m: self.least(designed, &[ConstraintKind::OwnLinks]),
            least_height_m: self.least(designed, &[ConstraintKind::Floor, ConstraintKind::Mounting]),
            random: forecast.and_then(|f| f.random.as_ref()).map(|r| RandomRecord {
                trajectories: r.trajectories,
                mean_ratio: r.mean_ratio,
                geometric_ratio: r.geometric_ratio,
                condition_number: r.condition,
            }),
            starts: self.starts.iter().map(|s| start_record(s, set.criterion, columns)).collect(),
            infeasible: self.outcome.as_ref().err().map(infeasible_record),
            followed: designed.and_then(|d| d.followed.clone()),
            noise: set.noise.clone(),
            provenance: provenance(config, self.inputs()),
        })
    }

    fn verdict(&self) -> DesignVerdict {
        let mut warnings: Vec<String> = self.robot.warnings.clone();
        warnings.extend(self.set.assumptions.iter().cloned());
        match &self.outcome {
            Err(infeasible) => {
                DesignVerdict { status: Outcome::Fail, headline: infeasible_headline(infeasible), warnings }
            }
            Ok(designed) => self.found_verdict(designed, warnings),
        }
    }

    fn found_verdict(&self, designed: &DesignedTrajectory, mut warnings: Vec<String>) -> DesignVerdict {
        for fault in &designed.motion.leg_faults {
            warnings.push(format!(
                "the {} breaks a limit ({} of {} by {}): its path is straight in joint space; choose another parking or \
                 start pose{}",
                fault.phase,
                fault.kind,
                fault.subject,
                match fault.scale.filter(|_| fault.kind != LimitKind::Path(ConstraintKind::Effort)) {
                    Some((scale, "m")) => format!("{:.0} mm", (1e3 * fault.excess * scale).max(1.0)),
                    Some((scale, unit)) => format!("{:.3} {unit}", fault.excess * scale),
                    None => format!("{:.1} %", 100.0 * fault.excess),
                },
                way_out(fault.kind, &fault.subject).map_or_else(String::new, |line| format!("; {line}"))
            ));
        }
        let rows = self.set.problem.constraints.iter().flat_map(|c| c.rows());
        let are_kept = rows.map(|row| row.kind).any(|kind| kind == ConstraintKind::Effort);
        let efforts: &[Option<f64>] = if are_kept { &self.set.effort_limits } else { &[] };
        let excesses = match (&self.drives, &designed.followed) {
            (Some(drives), Some(followed)) => drives.excesses(&self.set.problem.limits, efforts, followed),
            _ => Vec::new(),
        };
        let leaves = !excesses.is_empty();
        warnings.extend(excesses);
        if let Some(followed) = &designed.followed {
            warnings.extend(doubts(followed));
        }
        let poorly: Vec<&str> = designed
            .forecast
            .columns
            .iter()
            .filter(|c| c.relative_std.is_some_and(|r| r > POORLY_SEEN))
            .map(|c| c.name.as_str())
            .collect();
        if !poorly.is_empty() {
            warnings.push(format!(
                "{} of {} parameters will be known to no better than {:.0} % of their nominal values: {}",
                poorly.len(),
                designed.forecast.columns.len(),
                100.0 * POORLY_SEEN,
                poorly.join(", ")
            ));
        }
        if let Some(worst) = designed.broken.first() {
            return DesignVerdict {
                status: Outcome::Fail,
                headline: format!(
                    "{} of {} is broken by {:.1e} of its limit: do not run this motion",
                    worst.kind, worst.subject, worst.excess
                ),
                warnings,
            };
        }
        let near = self.near_best(designed);
        let sound = designed.motion.leg_faults.is_empty() && !leaves;
        let status = if sound { Outcome::Pass } else { Outcome::Warn };
        let of = match (&self.drives, leaves) {
            (None, _) => "all limits hold at every instant of the period",
            (Some(_), false) => {
                "all limits of the command hold at every instant of the period, those of position, speed, effort and place for the simulated robot too"
            }
            (Some(_), true) => {
                "all limits hold at every instant of the period for the command alone, the simulated robot breaks some (see the warnings)"
            }
        };
        let headline = format!(
            "{of}: {}; not checked: {}; {near} of {} starts ended within {:.0} % of \
             the best",
            self.kept().join(", "),
            self.set.safety.record.not_checked.join(", "),
            self.starts.len(),
            100.0 * NEAR_BEST
        );
        DesignVerdict { status, headline, warnings }
    }

    /// What limits are of, in words.
    fn kept(&self) -> Vec<String> {
        let problem = &self.set.problem;
        let mut kept: Vec<String> =
            ["positions", "speeds", "accelerations"].iter().map(|x| (*x).to_owned()).collect();
        if problem.limits.iter().any(|l| l.jerk.is_finite()) {
            kept.push("jerks".to_owned());
        }
        let rows = problem.constraints.iter().flat_map(|c| c.rows());
        let kinds: Vec<ConstraintKind> = rows.map(|row| row.kind).collect();
        let is_kept = |kind: &ConstraintKind| kinds.contains(kind);
        let regions = [
            ConstraintKind::HalfSpace,
            ConstraintKind::Box,
            ConstraintKind::Cylinder,
            ConstraintKind::Column,
        ];
        let named = [
            (is_kept(&ConstraintKind::Effort), "efforts"),
            (regions.iter().any(is_kept), "regions of [[keep]]"),
            (is_kept(&ConstraintKind::Capsule), "capsules of [[capsule]]"),
            (is_kept(&ConstraintKind::Singularity), "distance from singular poses"),
            (is_kept(&ConstraintKind::JointPosition), "positions of joints that follow"),
            (is_kept(&ConstraintKind::JointRate), "speeds of joints that follow"),
        ];
        kept.extend(named.iter().filter(|(is_kept, _)| *is_kept).map(|(_, name)| (*name).to_owned()));
        let safety = &self.set.safety.record;
        let margin = format!("{:.0} mm", 1e3 * safety.margin_m);
        kept.extend(
            safety.planes.iter().filter(|p| !p.links.is_empty()).map(|p| format!("{} ({margin})", p.name)),
        );
        if !safety.pairs.is_empty() {
            kept.push(format!("own links ({} pairs, {margin})", safety.pairs.len()));
        }
        kept
    }

    /// Least distance that limits of some kinds have along a designed trajectory, m.
    fn least(&self, designed: Option<&DesignedTrajectory>, kinds: &[ConstraintKind]) -> Option<f64> {
        let of_kind = |p: &&LimitPoint| matches!(p.kind, LimitKind::Path(kind) if kinds.contains(&kind));
        let points = designed?.uses.iter().filter(of_kind);
        let beyond = points.map(|p| -p.excess * DISTANCE_SCALE).reduce(f64::min)?;
        Some(self.set.safety.record.margin_m + beyond)
    }

    /// Starts whose figure is within a few per cent of the best.
    pub fn near_best(&self, designed: &DesignedTrajectory) -> usize {
        let columns = self.set.problem.model.columns().len();
        let figure = |s: &StartOutcome| s.criterion.map(|c| self.set.criterion.figure(c, columns));
        let Some(best) = figure(&self.starts[designed.best]) else { return 0 };
        let near =
            |s: &&StartOutcome| s.is_feasible() && figure(s).is_some_and(|x| x <= (1.0 + NEAR_BEST) * best);
        self.starts.iter().filter(near).count()
    }
}

fn start_record(start: &StartOutcome, name: CriterionName, columns: usize) -> StartRecord {
    StartRecord {
        seed: start.seed,
        value: start.criterion.map(|c| name.figure(c, columns)),
        feasible: start.is_feasible(),
        evaluations: start.evaluations,
    }
}

fn infeasible_record(infeasible: &Infeasible) -> InfeasibleRecord {
    InfeasibleRecord {
        at_start: infeasible.at_start,
        violations: infeasible.violations.iter().map(LimitRecord::from).collect(),
        blamed: infeasible.blamed.as_ref().map(|b| b.to_string()),
    }
}

fn infeasible_headline(infeasible: &Infeasible) -> String {
    let Some(v) = infeasible.violations.first() else {
        return "no start ended within all limits with every parameter visible, although the limits can be met, if only by \
                little motion: widen them, or try more starts"
            .to_owned();
    };
    let size = match (v.kind, v.scale) {
        _ if v.excess.is_infinite() => "has no pose".to_owned(),
        (LimitKind::Path(ConstraintKind::Effort), _) | (_, None) => {
            format!("{:.0} % over its limit", 100.0 * v.excess)
        }
        (
            LimitKind::Path(ConstraintKind::OwnLinks | ConstraintKind::Floor | ConstraintKind::Mounting),
            Some((scale, _)),
        ) => {
            format!("{:.0} mm short of the margin", (1e3 * v.excess * scale).max(1.0))
        }
        (_, Some((scale, unit))) => format!("{:.3} {unit} on the wrong side", v.excess * scale),
    };
    let worst = format!("{} of {} stays {size}, at {:.2} s", v.kind, v.subject, v.time);
    let said = match (infeasible.at_start, &infeasible.blamed) {
        (true, _) => format!("the start pose itself is not allowed: {worst}; write another `start_pose`"),
        (false, Some(blamed)) => {
            format!("no motion keeps all limits: {worst}; without the limit of {blamed} there is one")
        }
        (false, None) => format!("no motion keeps all limits: {worst}"),
    };
    match way_out(v.kind, &v.subject) {
        Some(line) => format!("{said}; {line}"),
        None => said,
    }
}

/// What to write where a limit that is kept by default is in the way.
pub(super) fn way_out(kind: LimitKind, subject: &str) -> Option<String> {
    match kind {
        LimitKind::Path(ConstraintKind::Floor) => Some(
            "`floor_height_m = -0.5` under [safety] states a floor 0.5 m below the origin of the base, `floor = false` none"
                .to_owned(),
        ),
        LimitKind::Path(ConstraintKind::Mounting) => {
            Some("`floor = false` under [safety] takes the plane away".to_owned())
        }
        LimitKind::Path(ConstraintKind::OwnLinks) => {
            let (a, b) = subject.split_once(" and ")?;
            Some(format!("`exempt = [[\"{a}\", \"{b}\"]]` under [safety] leaves this pair out"))
        }
        _ => None,
    }
}

/// Settings of a design that states nothing.
pub(super) fn default_settings() -> serde_json::Value {
    serde_json::to_value(DesignConfig::default()).unwrap_or_default()
}

fn provenance(config: &DesignConfig, inputs: Vec<InputRecord>) -> Provenance {
    let settings = serde_json::to_value(config).unwrap_or_default();
    Provenance { inputs, settings, seed: config.search.seed, ..Provenance::default() }
}
