//! `servo.json`.

use std::collections::BTreeMap;
use std::path::Path;

use dynid_files::SourceFile;
use dynid_identify::Error;
use dynid_identify::estimate::{Provenance, SCHEMA};
use dynid_model::Inertia;
use dynid_model::inertia::{PARAMETER_NAMES, PARAMETER_UNITS};
use dynid_record::{Outcome, words};
use dynid_servo::fit::Ending;
use dynid_servo::identify::{
    EffortUse, GroupKind, MISFIT, ServoBody, ServoGroup, ServoParameter, TOLD_DIRECTION,
};
use dynid_servo::{Addition, Channel, EncoderAt, Free, Hold, LoadOf, Term};
use serde::{Deserialize, Serialize};

use super::config::{DriveConfig, ServoConfig};
use super::{ServoFault, ServoResult};

words! {
    /// What can be said of a parameter.
    ServoVerdict {
        /// The interval is narrower than a tenth, and nothing that should not matter moves the value out of it.
        Seen = "seen",
        /// The interval is known and wider.
        Coarse = "coarse",
        /// The value moves by more than its own interval with the law, the step, the fold of the logs, or a stated gain.
        Unstable = "unstable",
        /// What was known beforehand decides.
        Prior = "prior",
        /// The value stands at a bound and has no interval: the data would have it go on, which hints at a wrong model.
        AtBound = "at bound",
        /// The readings hardly depend on it.
        NotSeen = "not seen",
    }
}

words! {
    /// What makes some parameters act together.
    ServoGroupKind {
        /// They share one scale.
        Scale = "scale",
        /// They are lags.
        Lag = "lag",
        /// Zero and constant effort.
        Posture = "posture",
        /// Parts of friction.
        Friction = "friction",
        /// Others.
        Other = "other",
    }
}

words! {
    /// What a measured effort is beside that of a fit to positions alone.
    ServoEffortVerdict {
        /// It is that of the drive, and the fit takes it.
        Taken = "taken",
        /// The fit takes it, and its size is not what positions, masses and stated gains ask for.
        OtherSize = "other size",
        /// It runs against the drive, and is left out.
        Against = "other sign",
        /// It has no sign, and is left out.
        Unsigned = "no sign",
        /// The simulation explains less than half of its variance, and it is left out.
        Unlike = "unlike",
    }
}

/// The output of `dynid servo`.
#[derive(Debug, Clone, Serialize, Deserialize, schemars::JsonSchema)]
pub struct ServoFile {
    /// Layout version.
    pub schema: u32,
    /// Robot.
    pub robot: String,
    /// The result in a word: `pass`, `warn` where the model is wrong, a parameter is not told or none to a tenth, or measured efforts are not those of the drives, `fail` where it predicts no better than the
    /// command itself or misses a third of the motion, no parameter is told, or the fit did not settle.
    pub status: Outcome,
    /// The result in a sentence.
    pub headline: String,
    /// Joints, in the order of all lists by joint.
    pub joints: Vec<String>,
    /// Parameters that were found.
    pub parameters: Vec<ServoParameterRecord>,
    /// Bodies that were found; empty where they are those of the robot file.
    #[serde(default)]
    pub bodies: Vec<ServoBodyRecord>,
    /// Parameters that are known together only.
    pub groups: Vec<ServoGroupRecord>,
    /// The law.
    pub law: ServoLaw,
    /// How well it predicts.
    pub fit: ServoFit,
    /// Validation logs.
    pub validation: Vec<ServoLogFit>,
    /// How motion was simulated.
    pub simulation: ServoSimulation,
    /// Warnings.
    pub warnings: Vec<String>,
    /// Inputs and settings.
    pub provenance: Provenance,
}

/// A parameter that was found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct ServoParameterRecord {
    /// The term: `position_gain`, `rotor_inertia`, `viscous`, `coulomb`, `delay`, ...
    pub term: String,
    /// Joints that share it.
    pub joints: Vec<String>,
    /// Unit.
    pub unit: String,
    /// Value.
    pub value: f64,
    /// 95 % interval with all spreads, within what is possible; absent where there is none, or no upper end. Where a scale is open, it is that of the reciprocal, and
    /// reaches farther up than down.
    pub interval: Option<(f64, f64)>,
    /// Standard deviation by leaving out blocks of time.
    pub std: Option<f64>,
    /// Standard deviation by the model alone: right only if the model is, and absent where it is not.
    pub model_std: Option<f64>,
    /// What the value moves by when something is changed that should not matter.
    pub spread: ServoSpread,
    /// Value over the position gain of the joint, and half the width of its 95 % interval, where the gain was found.
    pub per_gain: Option<(f64, f64)>,
    /// Verdict.
    pub verdict: ServoVerdict,
}

/// What an estimate moves by.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct ServoSpread {
    /// Largest change under laws richer by one addition.
    pub law: f64,
    /// Change under half the step of the simulation; under twice the step where nothing but rounding is left of the readings.
    pub step: f64,
    /// Standard deviation over fits that leave a fold of the logs out.
    pub folds: f64,
    /// Largest change under stated gains that are wrong by their error.
    pub gain: f64,
    /// Change with the time over which efforts are read, a period or an instant, where the logs do not tell it.
    #[serde(default)]
    pub reading: f64,
    /// Standard deviation by what is known beforehand (zeros, gains, bodies), which may be off by its own.
    #[serde(default)]
    pub knowledge: f64,
}

/// A body that was found: a moving link and all that is welded to it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct ServoBodyRecord {
    /// Link.
    pub link: String,
    /// Its ten parameters about the joint frame: `m`, `mx`, `my`, `mz`, `Ixx`, `Ixy`, `Ixz`, `Iyy`, `Iyz`, `Izz`. Together they are a body that can exist.
    pub parameters: Vec<BodyParameterRecord>,
}

/// A parameter of a body.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct BodyParameterRecord {
    /// Name.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// What the robot file states, repaired if no body can have that.
    pub file: f64,
    /// What was found.
    pub value: f64,
    /// 95 % interval, with what the robot file may be off by; absent where there is none.
    pub interval: Option<(f64, f64)>,
    /// Whether the logs tell it: the interval is a third of what the robot file's error leaves, or less. What they do not tell follows the robot file.
    pub told: bool,
}

/// Bodies that were left free with one pull towards the robot file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct BodyTrialRecord {
    /// Factor by which the robot file was taken for surer than `body_error` says.
    pub pull: f64,
    /// Held-out error over that with the bodies of the robot file, by fold; `null`: the simulation got lost.
    pub ratios: Vec<Option<f64>>,
    /// Whether it was taken.
    pub taken: bool,
}

/// Parameters that are known together only.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct ServoGroupRecord {
    /// What makes them.
    pub kind: ServoGroupKind,
    /// Members, `term joint`.
    pub members: Vec<String>,
    /// What would part them.
    pub remedy: String,
}

/// What was added to rotor inertia, viscous and Coulomb friction, and what was tried.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct ServoLaw {
    /// Additions in use.
    pub additions: Vec<String>,
    /// Additions that were tried on held-out folds.
    pub trials: Vec<AdditionRecord>,
    /// Pulls towards the robot file that were tried where bodies were to be found.
    #[serde(default)]
    pub bodies: Vec<BodyTrialRecord>,
    /// Directions that were looked for.
    pub directions: Vec<DirectionRecord>,
}

/// An addition that was tried.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct AdditionRecord {
    /// What the law had already.
    pub beside: Vec<String>,
    /// The addition.
    pub addition: String,
    /// Held-out error over that without it, by fold; `null`: the simulation got lost; empty: it gains nothing on the logs that it is fitted to,
    /// or another was taken before.
    pub ratios: Vec<Option<f64>>,
    /// Whether it was taken.
    pub taken: bool,
}

/// A direction that was looked for.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct DirectionRecord {
    /// Joint.
    pub joint: String,
    /// Direction in use, 1 or -1.
    pub direction: f64,
    /// RMS with the other direction over that with this one; absent: the simulation got lost. Below 1.02 the logs do not tell the direction.
    pub other: Option<f64>,
}

/// How well the closed-loop simulation gives the measured positions. Lists go by joint, rad or m.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct ServoFit {
    /// RMS over whole rollouts of the training logs.
    pub rms: Vec<f64>,
    /// RMS of the command less the position: what a stiff drive would predict.
    pub command_rms: Vec<f64>,
    /// RMS with the numbers of the robot file; absent where no position gain is known to go with them.
    pub robot_file_rms: Option<Vec<f64>>,
    /// Standard deviation of the encoders' rounding.
    pub floor: Vec<f64>,
    /// RMS over floor, the median over joints; above 1.3 the model is wrong somewhere; absent: no encoder's step is known.
    pub misfit: Option<f64>,
    /// RMS by log.
    pub by_log: Vec<ServoLogFit>,
    /// Efforts and currents that logs measure.
    #[serde(default)]
    pub efforts: Vec<ServoEffortRecord>,
    /// RMS of rollouts that begin from measured states again and again.
    pub horizons: Vec<HorizonRecord>,
    /// Relative residual of the linear start.
    pub start_residual: Vec<f64>,
    /// How the fit ended: `converged`, `stalled` (no step helps any more, or hardly), `unfinished`.
    pub ending: String,
    /// Steps of the last fit.
    pub iterations: usize,
    /// Simulations of all logs, all fits together.
    pub evaluations: usize,
    /// Blocks of time behind the standard deviations.
    pub blocks: usize,
}

/// A measured effort or current of a joint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct ServoEffortRecord {
    /// Joint.
    pub joint: String,
    /// `effort` or `current`.
    pub channel: String,
    /// Unit.
    pub unit: String,
    /// What became of it.
    pub verdict: ServoEffortVerdict,
    /// Share of its variance that the simulation explains: the last fit where it is taken, else that to positions alone, scale and zero free.
    pub explained: f64,
    /// Measured over simulated effort of the fit to positions alone; absent for currents whose torque constant is not known.
    pub ratio: Option<f64>,
    /// RMS of measured less simulated; absent where it is left out.
    pub rms: Option<f64>,
}

/// RMS of one log.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct ServoLogFit {
    /// Log.
    pub log: String,
    /// RMS by joint; `null`: the simulation got lost.
    pub rms: Vec<Option<f64>>,
    /// RMS of the command less the position.
    pub command_rms: Vec<f64>,
}

/// Error over a horizon.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct HorizonRecord {
    /// Time after which a rollout begins anew, s; absent: never.
    pub horizon_s: Option<f64>,
    /// RMS by joint.
    pub rms: Vec<f64>,
}

/// How motion was simulated.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct ServoSimulation {
    /// Longest step, s.
    pub step_s: f64,
    /// RMS by which half the step moves the readings, over the residual's.
    pub half_step_share: f64,
    /// What a command does between samples: `held` or `line`.
    pub hold: String,
    /// What load friction grows with: `drive` or `bodies`.
    pub load: String,
    /// Steps whose friction did not settle, of all.
    pub unsettled: (usize, usize),
}

/// What an identification of drives was told, of its settings.
#[derive(Debug, Deserialize)]
pub struct Told {
    /// What was known of the drives.
    pub servo: DriveConfig,
    /// Joints that were held.
    pub lock: BTreeMap<String, f64>,
    /// Gravity, if it was stated.
    pub gravity: Option<[f64; 3]>,
}

impl ServoFile {
    /// Reads a file that `dynid servo` wrote, with its digest.
    ///
    /// # Errors
    /// [`Error::Read`]; [`ServoFault::File`] if it is none.
    pub fn read(path: &Path) -> Result<(Self, SourceFile), Error> {
        let bytes =
            dynid_files::input::read(path).map_err(|source| Error::Read { file: path.to_owned(), source })?;
        let name = path.display().to_string();
        let fault = |message: String| ServoFault::File { file: name.clone(), message };
        let file: ServoFile = serde_json::from_slice(&bytes).map_err(|e| fault(e.to_string()))?;
        if file.schema != SCHEMA {
            return Err(fault(format!("expected schema {SCHEMA}, found {}", file.schema)).into());
        }
        Ok((file, SourceFile { sha256: dynid_files::digest::sha256(&bytes), path: name }))
    }

    /// What the identification was told; `file` names the file in errors.
    ///
    /// # Errors
    /// [`ServoFault::File`].
    pub fn told(&self, file: &str) -> Result<Told, Error> {
        let fault = |e: serde_json::Error| ServoFault::File {
            file: file.to_owned(),
            message: format!("provenance.settings: {e}"),
        };
        Ok(Told::deserialize(&self.provenance.settings).map_err(fault)?)
    }

    /// The file as text.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }
}

/// Residual over the motion itself from which a simulation counts as one of something else.
const MOST_MISSED: f64 = 0.3;

fn words_of(additions: &[Addition]) -> Vec<String> {
    additions.iter().map(|a| a.name().to_owned()).collect()
}

fn finite(values: &[f64]) -> Vec<Option<f64>> {
    values.iter().map(|x| Some(*x).filter(|x| x.is_finite())).collect()
}

impl ServoResult {
    /// What the identification leaves behind.
    pub fn file(&self, config: &ServoConfig, left_out: &[String]) -> ServoFile {
        let f = &self.found;
        let names = self.robot.rate_names();
        let free: Vec<Free> = f.parameters.iter().map(|p| p.free.clone()).collect();
        let wrong = f.misfit.is_nan() || f.misfit > MISFIT;
        let parameters: Vec<ServoParameterRecord> =
            f.parameters.iter().map(|p| self.parameter(p, &names, wrong)).collect();
        // What sensors read without any effort, and when, is nobody's question.
        let of_sensor = |p: &&ServoParameterRecord| Term::named(&p.term).is_some_and(Term::is_of_sensor);
        let asked: Vec<ServoParameterRecord> = parameters.iter().filter(|p| !of_sensor(p)).cloned().collect();
        let (status, headline) = self.verdict(&asked);
        let mut warnings = self.warnings.clone();
        warnings.extend(self.doubts(&asked));
        warnings.extend(left_out.iter().cloned());
        let logs = |logs: &[dynid_servo::ServoLog], rms: &[Vec<f64>]| -> Vec<ServoLogFit> {
            logs.iter()
                .zip(rms)
                .map(|(log, rms)| ServoLogFit {
                    log: log.name.clone(),
                    rms: finite(rms),
                    command_rms: command_rms(log),
                })
                .collect()
        };
        ServoFile {
            schema: SCHEMA,
            robot: self.robot.file.description.name.clone(),
            status,
            headline,
            groups: f.groups.iter().map(|g| ServoGroupRecord::of(g, &free, &names)).collect(),
            joints: names,
            parameters,
            bodies: f.bodies.iter().map(|b| self.body(b)).collect(),
            law: ServoLaw {
                additions: words_of(&f.additions),
                trials: f
                    .trials
                    .iter()
                    .map(|t| AdditionRecord {
                        beside: words_of(&t.beside),
                        addition: t.addition.name().to_owned(),
                        ratios: finite(&t.ratios),
                        taken: t.taken,
                    })
                    .collect(),
                bodies: f
                    .body_trials
                    .iter()
                    .map(|t| BodyTrialRecord { pull: t.pull, ratios: finite(&t.ratios), taken: t.taken })
                    .collect(),
                directions: f
                    .directions
                    .iter()
                    .map(|d| DirectionRecord {
                        joint: self.robot.rate_names()[d.joint].clone(),
                        direction: d.direction,
                        other: Some(d.other).filter(|x| x.is_finite()),
                    })
                    .collect(),
            },
            fit: ServoFit {
                rms: f.rms.clone(),
                command_rms: f.command_rms.clone(),
                robot_file_rms: self.as_it_came.clone(),
                floor: f.floor.clone(),
                misfit: Some(f.misfit).filter(|m| m.is_finite()),
                by_log: logs(&self.logs, &f.rms_by_log),
                efforts: f.efforts.iter().map(|e| self.effort(e)).collect(),
                horizons: f
                    .horizons
                    .iter()
                    .map(|h| HorizonRecord {
                        horizon_s: Some(h.horizon_s).filter(|s| s.is_finite()),
                        rms: h.rms.clone(),
                    })
                    .collect(),
                start_residual: f.start_residual.clone(),
                ending: match f.ending {
                    Ending::Converged => "converged",
                    Ending::Stalled => "stalled",
                    Ending::Unfinished => "unfinished",
                }
                .to_owned(),
                iterations: f.iterations,
                evaluations: f.evaluations,
                blocks: f.blocks,
            },
            validation: logs(&self.validation, &self.validation_rms),
            simulation: ServoSimulation {
                step_s: f.scheme.step_s,
                half_step_share: f.step_share,
                hold: if f.scheme.hold == Hold::Held { "held" } else { "line" }.to_owned(),
                load: if f.scheme.load == LoadOf::Drive { "drive" } else { "bodies" }.to_owned(),
                unsettled: f.unsettled,
            },
            warnings,
            provenance: Provenance {
                inputs: self.inputs.clone(),
                settings: serde_json::to_value(config).unwrap_or_default(),
                ..Provenance::default()
            },
        }
    }

    fn parameter(&self, p: &ServoParameter, names: &[String], wrong: bool) -> ServoParameterRecord {
        use dynid_servo::identify::ServoVerdict as V;
        let term = p.free.as_term().unwrap_or(Term::Offset);
        let joints = p.free.joints();
        let units = self.robot.mechanism.effort_units();
        let slides = joints.first().is_some_and(|j| units.get(*j) == Some(&"N"));
        ServoParameterRecord {
            term: term.name().to_owned(),
            joints: joints.iter().map(|j| names[*j].clone()).collect(),
            unit: term.unit(slides).to_owned(),
            value: p.value,
            interval: p.interval,
            std: p.std,
            model_std: p.model_std.filter(|_| !wrong),
            spread: ServoSpread {
                law: p.spread.law,
                step: p.spread.step,
                folds: p.spread.folds,
                gain: p.spread.gain,
                reading: p.spread.reading,
                knowledge: p.spread.knowledge,
            },
            per_gain: p.per_gain,
            verdict: match p.verdict {
                V::Seen => ServoVerdict::Seen,
                V::Coarse => ServoVerdict::Coarse,
                V::Unstable => ServoVerdict::Unstable,
                V::Prior => ServoVerdict::Prior,
                V::AtBound => ServoVerdict::AtBound,
                V::NotSeen => ServoVerdict::NotSeen,
            },
        }
    }

    fn body(&self, body: &ServoBody) -> ServoBodyRecord {
        let parameter = |k: usize| BodyParameterRecord {
            name: PARAMETER_NAMES[k].to_owned(),
            unit: PARAMETER_UNITS[k].replace('²', "^2"),
            file: body.stated.0[k],
            value: body.inertia.0[k],
            interval: body.half_width[k].map(|half| {
                // Masses and moments of inertia are positive.
                let least = if matches!(k, 0 | 4 | 7 | 9) { 0.0 } else { f64::NEG_INFINITY };
                ((body.inertia.0[k] - half).max(least), body.inertia.0[k] + half)
            }),
            told: body.told[k],
        };
        ServoBodyRecord {
            link: self.robot.mechanism.bodies()[body.body].name.clone(),
            parameters: (0..PARAMETER_NAMES.len()).map(parameter).collect(),
        }
    }

    fn effort(&self, e: &EffortUse) -> ServoEffortRecord {
        use dynid_servo::identify::EffortVerdict as V;
        let slides = self.robot.mechanism.effort_units().get(e.joint) == Some(&"N");
        let unit = match (e.channel, slides) {
            (Channel::Current, _) => "A",
            (_, true) => "N",
            _ => "N m",
        };
        ServoEffortRecord {
            joint: self.robot.rate_names()[e.joint].clone(),
            channel: e.channel.name().to_owned(),
            unit: unit.to_owned(),
            verdict: match e.verdict {
                V::Taken => ServoEffortVerdict::Taken,
                V::OtherSize => ServoEffortVerdict::OtherSize,
                V::Against => ServoEffortVerdict::Against,
                V::Unsigned => ServoEffortVerdict::Unsigned,
                V::Unlike => ServoEffortVerdict::Unlike,
            },
            explained: e.explained,
            ratio: e.ratio,
            rms: Some(e.rms).filter(|x| x.is_finite()),
        }
    }

    fn verdict(&self, parameters: &[ServoParameterRecord]) -> (Outcome, String) {
        let f = &self.found;
        let mean = |v: &[f64]| (v.iter().map(|x| x * x).sum::<f64>() / v.len().max(1) as f64).sqrt();
        let (rms, command) = (mean(&f.rms), mean(&f.command_rms));
        let told = parameters.iter().filter(|p| p.verdict == ServoVerdict::Seen).count();
        let of = parameters.len();
        let floor = match f.misfit.is_nan() {
            true => "the encoders' rounding is not known".to_owned(),
            false => format!("{:.1} times the encoders' rounding", f.misfit),
        };
        let size = format!("{:.3} mrad or mm RMS over whole rollouts, {floor}", 1e3 * rms);
        let usable = |p: &&ServoParameterRecord| {
            matches!(p.verdict, ServoVerdict::Seen | ServoVerdict::Coarse | ServoVerdict::Unstable)
        };
        // Two steps of the encoder, or nothing that a number of the log would show.
        let still =
            self.motion().iter().zip(&f.floor).all(|(motion, floor)| *motion <= (2.0 * floor).max(1e-9));
        if still {
            return (
                Outcome::Fail,
                format!("no parameter is told by the logs, the joints hardly move: {size}"),
            );
        }
        if rms > MOST_MISSED * mean(&self.motion()) {
            let why = format!(
                "the simulation does not follow the motion: {size}; check signs (`direction`), units and gains"
            );
            return (Outcome::Fail, why);
        }
        if rms.is_nan() || rms >= command {
            let why = format!(
                "the simulation predicts no better than the command itself: {size}; check signs, units and gains"
            );
            return (Outcome::Fail, why);
        }
        if !parameters.iter().any(|p| usable(&p)) {
            return (Outcome::Fail, format!("no parameter is told by the logs: {size}"));
        }
        if f.ending == Ending::Unfinished {
            return (Outcome::Fail, format!("the fit did not settle within its rounds: {size}"));
        }
        let headline = format!("{told} of {of} parameters are told to a tenth; {size}");
        if f.misfit > MISFIT {
            let why = format!(
                "{headline}: the model is not the whole truth, and intervals have what it moves by in them"
            );
            return (Outcome::Warn, why);
        }
        let bad = |p: &&ServoParameterRecord| {
            !matches!(p.verdict, ServoVerdict::Seen | ServoVerdict::Coarse | ServoVerdict::Prior)
        };
        let odd = f.efforts.iter().any(|e| e.verdict != dynid_servo::identify::EffortVerdict::Taken);
        let warns = odd || told == 0 || parameters.iter().any(|p| bad(&p));
        let status = if warns { Outcome::Warn } else { Outcome::Pass };
        (status, headline)
    }

    /// Standard deviation of every joint's position over all training logs.
    fn motion(&self) -> Vec<f64> {
        let of = |j: usize| {
            let values = || self.logs.iter().flat_map(|log| log.position[j].iter());
            let rows = values().count().max(1) as f64;
            let mean = values().sum::<f64>() / rows;
            (values().map(|x| (x - mean) * (x - mean)).sum::<f64>() / rows).sqrt()
        };
        (0..self.settings.joints.len()).map(of).collect()
    }

    /// Measured efforts that are not those of the drives.
    fn doubts_of_efforts(&self) -> Vec<String> {
        use dynid_servo::identify::EffortVerdict as V;
        let f = &self.found;
        let names = self.robot.rate_names();
        let named = |verdict: V, more: &dyn Fn(&EffortUse) -> String| -> Vec<String> {
            let of = f.efforts.iter().filter(|e| e.verdict == verdict);
            of.map(|e| format!("{} of {}{}", e.channel.name(), names[e.joint], more(e))).collect()
        };
        let ratio = |e: &EffortUse| e.ratio.map_or(String::new(), |r| format!(" ({r:.2} times)"));
        let explained = |e: &EffortUse| format!(" ({:.0} % explained)", 100.0 * e.explained);
        let none = |_: &EffortUse| String::new();
        let all = [
            (
                named(V::OtherSize, &ratio),
                "are not the size that positions, masses of the robot file and stated gains ask for; one of these, the unit, the gear ratio or \
                 `effort_at` is wrong, and all that is in N m with it",
            ),
            (
                named(V::Against, &none),
                "run against the drives and are left out: turn them, `effort = { columns = ..., scale = -1 }`",
            ),
            (named(V::Unsigned, &none), "have no sign and are left out"),
            (
                named(V::Unlike, &explained),
                "are not what moves the joints and are left out: other columns, or too little motion",
            ),
        ];
        let told = all.into_iter().filter(|(names, _)| !names.is_empty());
        told.map(|(names, what)| format!("{} {what}", names.join(", "))).collect()
    }

    /// Gears that are as stiff as the rows can show.
    fn doubts_of_gears(&self, parameters: &[ServoParameterRecord]) -> Vec<String> {
        let stiff = |p: &&ServoParameterRecord| {
            p.term == Term::Compliance.name()
                && matches!(p.verdict, ServoVerdict::AtBound | ServoVerdict::NotSeen)
        };
        let mut stiff: Vec<String> = parameters.iter().filter(stiff).map(|p| p.joints.join(", ")).collect();
        // Asked, and with none that the rows could show, or with which the simulation gets lost.
        let names = self.robot.rate_names();
        let asked = |j: &usize| {
            let s = &self.settings;
            s.find.contains(&Term::Compliance) && !s.known_gear[*j].contains(&Term::Compliance)
        };
        let without = |j: &usize| self.found.values.joints[*j].get(Term::Compliance) == 0.0;
        stiff.extend((0..names.len()).filter(asked).filter(without).map(|j| names[j].clone()));
        let mut out = Vec::new();
        let soft = parameters.iter().any(|p| p.term == Term::Compliance.name());
        if soft && self.found.misfit > MISFIT {
            let other = match self.settings.joints.first().map(|j| j.encoder) {
                Some(EncoderAt::Link) => "motor",
                _ => "link",
            };
            out.push(format!(
                "with gears that give way the residual is {:.1} times the encoders' rounding: if encoders sit on the other side of the gears, say `encoder = \"{other}\"` in \
                 `[servo]`",
                self.found.misfit
            ));
        }
        if stiff.is_empty() {
            return out;
        }
        out.push(format!(
            "gears as stiff as the rows can show: {}; their links swing faster than half the rate of the rows, or hardly: move with steps or chirps, and log more often",
            stiff.join(", ")
        ));
        out
    }

    /// What is to be said of bodies that were to be found.
    fn doubts_of_bodies(&self) -> Vec<String> {
        let f = &self.found;
        let mut out = Vec::new();
        if !f.body_trials.is_empty() && f.bodies.is_empty() {
            out.push(
                "bodies are those of the robot file: others predict held-out parts no better".to_owned(),
            );
        }
        if !f.bodies.is_empty() {
            out.extend(f.body_repairs.iter().cloned());
        }
        out
    }

    /// What a reader has to know before using the numbers.
    fn doubts(&self, parameters: &[ServoParameterRecord]) -> Vec<String> {
        let f = &self.found;
        let mut out = Vec::new();
        let named = |verdict: ServoVerdict| -> Vec<String> {
            let of = |p: &&ServoParameterRecord| p.verdict == verdict;
            parameters.iter().filter(of).map(|p| format!("{} {}", p.term, p.joints.join(", "))).collect()
        };
        let bounds = named(ServoVerdict::AtBound);
        if !bounds.is_empty() {
            out.push(format!("at a bound, without an interval: {}", bounds.join("; ")));
        }
        let unstable = named(ServoVerdict::Unstable);
        if !unstable.is_empty() {
            out.push(format!(
                "move by more than their own interval with the law, the step, the part of the logs or a stated gain: {}",
                unstable.join("; ")
            ));
        }
        let names = self.robot.rate_names();
        let untold = f.directions.iter().filter(|d| d.other < TOLD_DIRECTION);
        let untold: Vec<&str> = untold.map(|d| names[d.joint].as_str()).collect();
        if !untold.is_empty() {
            out.push(format!(
                "the direction is not told by the logs, the other one meets them as well: {}",
                untold.join(", ")
            ));
        }
        for o in &f.outliers {
            let (log, joint, channel) = (&self.logs[o.log].name, &names[o.joint], o.channel.name());
            let rows = o.rows;
            out.push(format!(
                "{log}: {rows} readings of the {channel} of {joint} stand out alone of what the fit misses and are left out"
            ));
        }
        out.extend(self.doubts_of_gears(parameters));
        out.extend(self.doubts_of_efforts());
        out.extend(self.doubts_of_bodies());
        if f.step_share > 0.1 {
            out.push(format!(
                "half the step moves the simulation by {:.0} % of the residual: a smaller `step_s` would move the estimate",
                100.0 * f.step_share
            ));
        }
        let own = f.trials.iter().filter(|t| t.addition == Addition::OwnGains && !t.ratios.is_empty());
        let better = own.map(|t| t.ratios.iter().sum::<f64>() / t.ratios.len() as f64).fold(1.0, f64::min);
        if better < 0.98 {
            out.push(format!(
                "a position gain of its own for every joint would predict held-out parts {:.1} % better; if the drives differ, say `gains = \"own\"`",
                100.0 * (1.0 - better)
            ));
        }
        out
    }
}

/// Name of a parameter: its term and the joints that share it.
pub fn member(free: &Free, names: &[String]) -> String {
    let joints: Vec<&str> = free.joints().iter().map(|j| names[*j].as_str()).collect();
    format!("{} {}", free.as_term().map_or("inertia", Term::name), joints.join(", "))
}

impl ServoBodyRecord {
    /// The inertia about the joint frame; `None` if the parameters are not those of a body in their order.
    pub fn inertia(&self) -> Option<Inertia> {
        let named = self.parameters.iter().map(|p| p.name.as_str()).eq(PARAMETER_NAMES);
        named.then(|| Inertia(std::array::from_fn(|k| self.parameters[k].value)))
    }
}

impl ServoGroupRecord {
    /// A group of parameters of joints with these names.
    pub fn of(group: &ServoGroup, free: &[Free], names: &[String]) -> ServoGroupRecord {
        let (kind, remedy) = match group.kind {
            GroupKind::Scale => (
                ServoGroupKind::Scale,
                "their ratios are known, their common scale is not: state `position_gain`, log efforts or currents with a known \
                 `torque_constant`, or log the same motion with a known mass at the last link and move joints that lift it",
            ),
            GroupKind::Lag => (
                ServoGroupKind::Lag,
                "lags are alike below 5 Hz: move faster, with steps or chirps above 5 Hz",
            ),
            GroupKind::Posture => (
                ServoGroupKind::Posture,
                "record the joint in several postures, up to where gravity turns its sign",
            ),
            GroupKind::Friction => (
                ServoGroupKind::Friction,
                "record more speeds, from below 0.1 rad/s to the fastest, and loads of both signs",
            ),
            GroupKind::Other => (
                ServoGroupKind::Other,
                "move these joints apart from one another, at other speeds and postures",
            ),
        };
        ServoGroupRecord {
            kind,
            members: group.members.iter().map(|k| member(&free[*k], names)).collect(),
            remedy: remedy.to_owned(),
        }
    }
}

/// RMS of the command less the position, by joint.
fn command_rms(log: &dynid_servo::ServoLog) -> Vec<f64> {
    let rms = |(u, x): (&Vec<f64>, &Vec<f64>)| {
        (u.iter().zip(x).map(|(u, x)| (u - x) * (u - x)).sum::<f64>() / u.len() as f64).sqrt()
    };
    log.command.iter().zip(&log.position).map(rms).collect()
}
