//! Deformation of joints with encoders on both sides of their gears, as rows beside those of the efforts.
//!
//! Such joints are read at their motors, as stiff ones. Per log and joint, at the rows of [`Sieve`] and without their means over the log, which
//! take the zero of the encoders with them:
//!
//! ```text
//! δ = c T + τ q̇ + h s + b/2 tanh((T + F s)/T₀),    T = Σ load parameters of the recipe × their columns
//! ```
//!
//! `δ`: motor on the side of the joint less link, rad (m); `c` compliance, `τ` what is left of the lag of the link's record, `h` half the
//! width of a hysteresis that turns with the sign `s` of the motor's speed, `b` backlash that the load and friction behind it close on one flank or the other. The load is
//! the recipe's: robots of a type share their links, and a change of `c` is then one of the spring.

use std::ops::Range;

use dynid_factor::groups::ReducedGroup;
use dynid_factor::{Factor, FactorBuilder, FactorError};
use dynid_model::{EffortModel, MotionBlock, Owner, Parameter, RegressorBlock, RobotModel};
use dynid_motion::log::moves;
use dynid_motion::shift::shift;
use dynid_motion::spikes::{self, SpikeSettings};
use dynid_motion::{Channel, SignalError};
use dynid_robots::ElasticSpec;
use dynid_rows::conditioning::{ConditioningError, PreparedLog};
use serde::{Deserialize, Serialize};

use super::columns::{Column, Output};
use crate::Error;
use crate::estimate::ElasticRecord;
use crate::identification::Identification;
use crate::joint_stiffness::JointStiffness;
use crate::log::Log;
use crate::robot::Robot;
use crate::stiffness::{BEHIND_GEAR, Deformed, Sieve, Smooth, StiffJoint, at_motors};

/// Symbol of the compliance of a joint, `1/k`.
pub const COMPLIANCE: &str = "compliance";
/// Symbol of what is left of the lag of a link's record.
pub const LAG: &str = "lag";
/// Symbol of half the width of a hysteresis.
pub const HYSTERESIS: &str = "hysteresis";
/// Symbol of the backlash of a gear.
pub const BACKLASH: &str = "backlash";

/// Symbols of the parameters of a deformation, with their units where joints turn and where they slide; the backlash is the last.
const SYMBOLS: [(&str, [&str; 2]); 4] = [
    (COMPLIANCE, ["rad/(N m)", "m/N"]),
    (LAG, ["s", "s"]),
    (HYSTERESIS, ["rad", "m"]),
    (BACKLASH, ["rad", "m"]),
];
/// Place of the backlash.
const FLANKS: usize = SYMBOLS.len() - 1;
/// Load over which backlash passes from flank to flank, as a share of the rms load.
const FLANK: f64 = 0.02;
/// Samples whose loads are formed at a time.
const AT_ONCE: usize = 1 << 12;
/// Of the column of the backlash, `±1/2`, the other columns must leave so much (rms) in a log: the load then presses on either flank for a hundredth of
/// the time or more. Less is what the other columns have wrong.
const BOTH_FLANKS: f64 = 0.05;
/// Standard deviations by which a parameter may be another one in another robot of the type, as far as its first estimate tells.
const OTHERWISE: f64 = 3.0;

/// Joints that are read at their motors, and what deforms them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Springs {
    /// What the records of links are later than those of motors, s; columns hold the rest.
    pub lag_s: f64,
    /// Joints.
    pub joints: Vec<Spring>,
}

/// A joint that is read at its motor, and what deforms it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Spring {
    /// How its encoders are read.
    pub(super) elastic: ElasticRecord,
    /// Parameters whose efforts load it, with their values.
    load: Vec<(String, f64)>,
    /// Friction behind the spring, which presses on flanks too, N m (N): hysteresis over compliance.
    friction: f64,
    /// Load over which backlash passes from flank to flank, N m (N).
    flank: f64,
    /// Columns of its rows.
    pub columns: Vec<Column>,
}

/// Rows of a joint in a log.
struct DeformationRows {
    /// Without its mean.
    deformation: Vec<f64>,
    /// In the order of [`SYMBOLS`], without their means.
    columns: [Vec<f64>; 4],
    /// Load, with its mean.
    load: Vec<f64>,
}

impl Springs {
    /// Of joints that an identification took as stiff ones; `None` where it took none.
    ///
    /// # Errors
    /// [`Error::Conditioning`] where a signal cannot be filtered.
    pub(super) fn of(id: &Identification) -> Result<Option<Springs>, Error> {
        if id.stiff_joints.is_empty() {
            return Ok(None);
        }
        // One clock, as the stiffness was found by.
        let (sum, weight) = id.stiffness.iter().fold((0.0, 0.0), |(sum, weight), joint| {
            let (lag, std) = joint.lag_s;
            let own = std.max(f64::MIN_POSITIVE).powi(-2);
            (sum + own * lag, weight + own)
        });
        let joints = id.stiff_joints.iter().map(|joint| Spring::bare(id, joint)).collect();
        let mut springs = Springs { lag_s: if weight > 0.0 { sum / weight } else { 0.0 }, joints };
        let of_log = |log| springs.rows(&id.model, log);
        let rows = id.logs.iter().map(of_log).collect::<Result<Vec<_>, SignalError>>();
        let rows = rows.map_err(|e| Error::Conditioning(e.into()))?;
        for ((j, found), spring) in id.stiffness.iter().enumerate().zip(&mut springs.joints) {
            let loads = || rows.iter().flat_map(|log| &log[j].load);
            let squares: f64 = loads().map(|t| t * t).sum();
            let pressed = found.hysteresis.0.max(0.0) / found.compliance;
            spring.friction = if found.stiffness.is_some() { pressed } else { 0.0 };
            spring.flank = FLANK * (squares / loads().count().max(1) as f64).sqrt();
            let slides = id.model.joints().iter().any(|joint| joint.name == found.joint && joint.slides);
            spring.columns = columns(found, slides, 1.0 / id.delay_rate_hz);
        }
        Ok(Some(springs))
    }

    /// Whether they are of joints among the outputs, have all columns and make numbers.
    pub(super) fn fit(&self, outputs: &[Output]) -> bool {
        let fits = |spring: &Spring| {
            let joint = &spring.elastic.joint;
            let names = SYMBOLS.map(|(symbol, _)| format!("{joint}.{symbol}"));
            let sized = |column: &Column| column.scale.is_finite() && column.scale > 0.0;
            outputs.iter().any(|output| output.name == *joint)
                && spring.columns.iter().map(|column| &column.name).eq(&names)
                && spring.columns.iter().all(sized)
                && spring.load.iter().all(|(_, value)| value.is_finite())
                && spring.friction.is_finite()
                && spring.flank.is_finite()
        };
        // A lag of a minute is none.
        self.lag_s.abs() < 60.0 && self.joints.iter().all(fits)
    }

    fn specs(&self) -> Result<Vec<ElasticSpec>, Error> {
        self.joints.iter().map(|spring| spring.elastic.spec()).collect()
    }

    /// The robot whose logs have links and motors. `stiff`: the same with stiff joints.
    ///
    /// # Errors
    /// Fails as [`Robot::load`] does.
    pub(super) fn robot(&self, stiff: &Robot) -> Result<Robot, Error> {
        let specs = self.specs()?;
        stiff.changed(|file| file.elements.elastic = specs)
    }

    /// A log as its motors have it, its links among the channels.
    ///
    /// # Errors
    /// [`Error::Log`].
    pub(super) fn read_at_motors(&self, log: Log) -> Result<Log, Error> {
        at_motors(log, &self.specs()?, true)
    }

    /// Takes the links out of the channels of a log.
    pub(super) fn forget_links(&self, channels: &mut Vec<Channel>) {
        channels.retain(|c| self.joints.iter().all(|spring| c.name != channel(&spring.elastic.joint)));
    }

    /// All columns, joint by joint.
    pub fn columns(&self) -> impl Iterator<Item = &Column> {
        self.joints.iter().flat_map(|spring| &spring.columns)
    }

    /// Parameters of all columns.
    pub(super) fn parameters(&self) -> impl Iterator<Item = Parameter> {
        self.joints.iter().enumerate().flat_map(|(j, spring)| {
            spring.columns.iter().zip(SYMBOLS).map(move |(column, (symbol, units))| {
                let unit = if column.unit == units[0] { units[0] } else { units[1] };
                Parameter {
                    name: column.name.clone(),
                    symbol: format!("{symbol}{}", j + 1),
                    unit,
                    owner: Owner::Joint(spring.elastic.joint.clone()),
                    prior: None,
                    lower: (symbol != LAG).then_some(0.0),
                    upper: None,
                    fold_first: false,
                }
            })
        })
    }

    /// Rows of a log that was read at its motors, its links among the channels, joint by joint.
    fn rows(&self, model: &RobotModel, log: &PreparedLog) -> Result<Vec<DeformationRows>, SignalError> {
        let sieve = Sieve::new(log)?;
        let mut motion: Vec<Smooth> =
            log.position.iter().map(|position| sieve.smooth(position)).collect::<Result<_, SignalError>>()?;
        let mut deformed = Vec::with_capacity(self.joints.len());
        for spring in &self.joints {
            let at = output(model, &spring.elastic.joint);
            let name = channel(&spring.elastic.joint);
            let mut link = log.channels.iter().find(|c| c.name == name).map_or_else(
                // An identification has no links by now: but for the deformation its motors move as they do.
                || log.position[at].clone(),
                |channel| channel.values.clone(),
            );
            spikes::remove(&mut link, &SpikeSettings::position())?;
            let link = shift(&link, self.lag_s * log.rate_hz)?.values;
            let smooth = sieve.smooth(&link)?;
            let motor = (log.position[at].as_slice(), &motion[at], 1.0);
            deformed.push(sieve.deformed(motor, (&link, &smooth))?);
            // Loads follow the links.
            motion[at] = smooth;
        }
        let loads = self.loads(model, log, &motion);
        let one = |((spring, deformed), load): ((&Spring, Deformed), Vec<f64>)| {
            let flank = |(t, v): (&f64, &f64)| {
                let pressing = t + spring.friction * v.signum();
                0.5 * (pressing / spring.flank.max(f64::MIN_POSITIVE)).tanh()
            };
            let at = output(model, &spring.elastic.joint);
            let flanks: Vec<f64> = load.iter().zip(&motion[at].speed).map(flank).collect();
            let load = sieve.pick(&load);
            Ok(DeformationRows {
                columns: [
                    without_mean(load.clone()),
                    without_mean(deformed.speed),
                    without_mean(deformed.towards),
                    // A flank changes faster than the filter lets through.
                    without_mean(sieve.filtered(&flanks)?),
                ],
                deformation: without_mean(deformed.deformation),
                load,
            })
        };
        self.joints.iter().zip(deformed).zip(loads).map(one).collect()
    }

    /// Per joint its load at every sample of a log.
    fn loads(&self, model: &RobotModel, log: &PreparedLog, motion: &[Smooth]) -> Vec<Vec<f64>> {
        let samples = log.samples();
        let mut out: Vec<Vec<f64>> = self.joints.iter().map(|_| Vec::with_capacity(samples)).collect();
        let shape = model.parameters().shape_start();
        for from in (0..samples).step_by(AT_ONCE) {
            let part = from..(from + AT_ONCE).min(samples);
            let all = |of: fn(&Smooth) -> &Vec<f64>| -> Vec<f64> {
                motion.iter().flat_map(|s| &of(s)[part.clone()]).copied().collect()
            };
            let (q, dq, ddq) = (all(|s| &s.position), all(|s| &s.speed), all(|s| &s.acceleration));
            let channels: Vec<(&str, &[f64])> =
                log.channels.iter().map(|c| (c.name.as_str(), &c.values[part.clone()])).collect();
            let block_motion =
                MotionBlock { channels: &channels, ..MotionBlock::plain(part.len(), &q, &dq, &ddq) };
            let mut block = RegressorBlock::new(model.layout().clone(), part.len());
            model.regressor(&block_motion, &shape, &mut block);
            for (spring, out) in self.joints.iter().zip(&mut out) {
                out.extend(spring.load(model, &block, part.len()));
            }
        }
        out
    }

    /// Joints whose motors move in a log, and whose links do not by their encoders: these are dead, and tell no deformation.
    pub(super) fn dead<'a>(&'a self, model: &RobotModel, log: &PreparedLog) -> Vec<&'a str> {
        let is_dead = |joint: &&str| {
            let name = channel(joint);
            let link = log.channels.iter().find(|c| c.name == name);
            log.moves[output(model, joint)] && link.is_some_and(|link| !moves(&link.values))
        };
        self.joints.iter().map(|spring| spring.elastic.joint.as_str()).filter(is_dead).collect()
    }

    /// Factors of the deformations of a log in so many time blocks, each an output of its own behind the `outputs` of the model, their columns from
    /// `first` on.
    ///
    /// # Errors
    /// [`Error::Conditioning`] where a signal cannot be filtered.
    pub(super) fn groups(
        &self,
        model: &RobotModel,
        log: &PreparedLog,
        (outputs, first): (usize, usize),
        blocks: usize,
    ) -> Result<Vec<ReducedGroup>, Error> {
        let rows = self.rows(model, log).map_err(|e| Error::Conditioning(e.into()))?;
        let dead = self.dead(model, log);
        let mut at = first;
        let mut groups = Vec::with_capacity(rows.len());
        for (j, (rows, spring)) in rows.iter().zip(&self.joints).enumerate() {
            let p = if rows.on_both_flanks() { spring.columns.len() } else { FLANKS };
            let n = rows.deformation.len();
            let of_block = |b: usize| {
                factor(&rows.columns[..p], &rows.deformation, b * n / blocks..(b + 1) * n / blocks)
            };
            let blocks = (0..blocks).map(of_block).collect::<Result<Vec<_>, FactorError>>();
            let blocks = blocks.map_err(|source| {
                Error::Conditioning(ConditioningError::Rows { output: outputs + j, source })
            })?;
            let columns = (at..at + p).collect();
            if !dead.contains(&spring.elastic.joint.as_str()) {
                groups.push(ReducedGroup { log: 0, output: outputs + j, scale: 0, columns, blocks });
            }
            at += spring.columns.len();
        }
        Ok(groups)
    }
}

impl Spring {
    /// Without columns, and without a load of its backlash.
    fn bare(id: &Identification, joint: &StiffJoint) -> Spring {
        let table = id.model.parameters();
        let value = |name: &String| table.column(name).map(|c| (name.clone(), id.values()[c]));
        Spring {
            elastic: ElasticRecord::new(&joint.spec),
            load: joint.loads.iter().filter_map(value).collect(),
            friction: 0.0,
            flank: 0.0,
            columns: Vec::new(),
        }
    }

    fn load(&self, model: &RobotModel, block: &RegressorBlock, samples: usize) -> Vec<f64> {
        let output = output(model, &self.elastic.joint);
        let acting = block.layout().columns(output);
        let mut out = vec![0.0; samples];
        for (name, value) in &self.load {
            let column = model.parameters().column(name);
            if let Some(k) = acting.iter().position(|c| Some(*c) == column) {
                out.iter_mut().zip(block.column(output, k)).for_each(|(o, x)| *o += value * x);
            }
        }
        out
    }
}

impl DeformationRows {
    /// Whether the load presses on both flanks, in a way of its own.
    fn on_both_flanks(&self) -> bool {
        let [others @ .., flanks] = &self.columns;
        let own = factor(others, flanks, 0..flanks.len()).map_or(0.0, |f| f.rho().powi(2));
        own > BOTH_FLANKS.powi(2) * flanks.len() as f64
    }
}

/// Channel that holds the position of a link.
fn channel(joint: &str) -> String {
    format!("{joint}{BEHIND_GEAR}")
}

fn output(model: &RobotModel, joint: &str) -> usize {
    // A recipe is of the robot that it describes.
    model.outputs().iter().position(|o| o.name == *joint).unwrap_or_default()
}

fn without_mean(mut x: Vec<f64>) -> Vec<f64> {
    let mean = x.iter().sum::<f64>() / x.len().max(1) as f64;
    x.iter_mut().for_each(|x| *x -= mean);
    x
}

/// Factor of a run of rows.
fn factor(columns: &[Vec<f64>], deformation: &[f64], rows: Range<usize>) -> Result<Factor, FactorError> {
    let mut builder = FactorBuilder::new(columns.len());
    builder.push_with(rows.len(), |column, range, out| {
        let values = columns.get(column).map_or(deformation, Vec::as_slice);
        out.copy_from_slice(&values[rows.clone()][range]);
    })?;
    Ok(builder.finish())
}

/// Columns of a joint with their sizes.
fn columns(found: &JointStiffness, slides: bool, sample_s: f64) -> Vec<Column> {
    let (hysteresis, std) = found.hysteresis;
    let gap = (hysteresis.abs() + OTHERWISE * std).max(found.residual);
    let sizes = [found.compliance.abs() + OTHERWISE * found.compliance_std, sample_s, gap, gap];
    let column = |((symbol, units), size): ((&str, [&str; 2]), f64)| Column {
        name: format!("{}.{symbol}", found.joint),
        unit: units[usize::from(slides)].to_owned(),
        scale: size.max(f64::MIN_POSITIVE),
    };
    SYMBOLS.into_iter().zip(sizes).map(column).collect()
}
