//! The effort model of a robot whose journals move in their bearings.

mod adjoint;
mod journals;

use std::sync::Arc;

use crate::closed_model::{LoadError, LoadReference};
use crate::dynamics::{MotionAdjoint, MotionBlock};
use crate::effort_model::{EffortModel, History, Output, RegressorBlock, RegressorLayout};
use crate::element::{ClearanceContact, journal_moment_channel};
use crate::mechanism::Mechanism;
use crate::parameter::ParameterTable;
use crate::random_motion::RandomMotion;
use crate::tree_model::TreeModel;
use journals::Journals;

/// Names of the channels that hold the offset of a journal's centre from that of its bearing, m, in axes that turn with the
/// journal's link: at position zero those of the translations of
/// [`Description::with_clearance`](crate::Description::with_clearance).
pub fn journal_channels(joint: &str) -> [String; 2] {
    ["x", "y"].map(|axis| format!("journal_{joint}_{axis}"))
}

/// Names of the channels that hold the first and second time derivative of a channel.
pub fn derivative_channels(channel: &str) -> [String; 2] {
    [format!("{channel}_rate"), format!("{channel}_acceleration")]
}

/// A robot whose journals move in their bearings, as an ideal robot sees it: the same outputs, rates and parameters, and beside them
///
/// ```text
/// effort = W · linear + [b(q, p) - b(q, 0)](reference),   W: of the ideal robot, with columns M_j for <joint>.mu
/// M_j = R2 c_d |F| / √(1 + (mu c_d)²)                     moment of friction per unit of mu ([`JournalFriction`](crate::element::JournalFriction))
/// ```
///
/// `b` are the efforts of the rigid bodies with journals at `p`, `F` the force on a journal that its bodies need: along its translations
/// no drive acts, so that the contact gives just that force, whatever its stiffness. Both are taken at reference parameters
/// ([`JournalModel::with_reference`]). `c_d` is the signed direction of friction at the sliding speed `ṗ·t + q̇ R2`.
///
/// Where a motion brings the offsets of a journal and their derivatives as channels ([`journal_channels`], [`derivative_channels`]), `p`
/// comes from them. Elsewhere the journal rests in its bearing: `p = c n`, `n = -R(-φ) F/|F|`, `tan φ = mu c_d`, with `F` at a
/// centred journal, which stays closed; its penetration, some parts of a hundred of the clearance `c`, is left out.
///
/// Degenerate: effort tells products of masses and `mu`, and offsets change efforts by parts of a thousand, so that masses, and with
/// them `mu`, are known as well as the reference says. Source: Sun, Han, Li & Li 2021, section 7 as written in the chapter *Joints with
/// clearance* of the book.
#[derive(Debug)]
pub struct JournalModel {
    ideal: TreeModel,
    /// Bodies alone, of the ideal robot and with translations of journals, the last of the rates.
    still: TreeModel,
    moving: TreeModel,
    journals: Vec<Journal>,
    /// Channels that a motion must bring.
    channels: Vec<String>,
    /// Linear parameters of the ideal robot.
    reference: Vec<f64>,
}

/// What a journal does over a block of samples.
#[derive(Debug, Clone, PartialEq)]
pub struct JournalLook {
    /// Whether its offset comes from the motion; else it rests in its bearing.
    pub probed: bool,
    /// Length of its offset, m.
    pub offset: Vec<f64>,
    /// Force on it, N.
    pub load: Vec<f64>,
    /// What the offsets of all journals add to the effort of its joint, N m.
    pub added: Vec<f64>,
}

/// How moments of friction go with inertial parameters ([`JournalModel::load_sums`]).
#[derive(Debug, Clone, PartialEq)]
pub struct LoadSums {
    /// Column of the coefficient of friction.
    pub mu: usize,
    /// `Σ M ∂M/∂φ_k`, per inertial parameter; over `Σ M²` the relative change of the coefficient that a change of the parameter asks for.
    pub change: Vec<f64>,
    /// `Σ M²`, (N m)².
    pub square: f64,
    /// `Σ M M_0` with the moments of the model's own reference; over `Σ M²` the coefficient that makes up for the other loads.
    pub product: f64,
}

#[derive(Debug)]
struct Journal {
    contact: ClearanceContact,
    /// Positions of the rotation and of the translations.
    rotation: usize,
    translations: [usize; 2],
    moment: String,
    /// Channels of the offset, its rate and its acceleration.
    offsets: [[String; 2]; 3],
    /// Column of the friction coefficient.
    mu: usize,
}

impl JournalModel {
    /// From the ideal robot, whose elements have a [`JournalFriction`](crate::element::JournalFriction) for each contact, and the robot
    /// with translations of the journals ([`Description::with_clearance`](crate::Description::with_clearance)). `contacts`: rates of the
    /// latter.
    ///
    /// # Errors
    /// [`LoadError::Joint`] for a contact without its friction; [`LoadError::Value`] for a reference of another length.
    ///
    /// # Panics
    /// If `moving` is not the mechanism of `ideal` with translations behind its rates, or a coordinate has no bodies.
    pub fn new(
        ideal: TreeModel,
        moving: Mechanism,
        contacts: Vec<ClearanceContact>,
        reference: LoadReference,
    ) -> Result<Self, LoadError> {
        assert!(ideal.coordinates().is_empty(), "journals beside coordinates without bodies");
        let (names, all) = (ideal.mechanism().rate_names(), moving.rate_names());
        assert_eq!(all[..names.len()], names, "rates of the robot without clearance come first");
        let moving = TreeModel::new(moving, Vec::new());
        let joints = moving.joints();
        let journal = |contact: ClearanceContact| {
            let joint = joints[contact.rotation].name.clone();
            let offsets = journal_channels(&joint);
            let [x, y] = offsets.each_ref().map(|name| derivative_channels(name));
            let ([x_rate, x_acceleration], [y_rate, y_acceleration]) = (x, y);
            let mu = ideal.parameters().column(&format!("{joint}.mu"));
            let fault = "a journal in its bearing, but no friction of it";
            Ok(Journal {
                rotation: joints[contact.rotation].position,
                translations: contact.translations.map(|rate| joints[rate].position),
                moment: journal_moment_channel(&joint),
                offsets: [offsets, [x_rate, y_rate], [x_acceleration, y_acceleration]],
                mu: mu.ok_or(LoadError::Joint { joint, fault })?,
                contact,
            })
        };
        let journals = contacts.into_iter().map(journal).collect::<Result<Vec<_>, _>>()?;
        let own = |name: &String| journals.iter().any(|journal| journal.moment == *name);
        let out = JournalModel {
            still: TreeModel::new(ideal.mechanism().clone(), Vec::new()),
            channels: ideal.channels().iter().filter(|name| !own(name)).cloned().collect(),
            reference: Vec::new(),
            journals,
            moving,
            ideal,
        };
        out.with_reference(reference)
    }

    /// Returns the model with bodies and friction of the journals at other parameters; their changes are frozen, so
    /// [`LoadReference::linearised`] has no effect, nor have shapes.
    ///
    /// # Errors
    /// [`LoadError::Value`] for a wrong length.
    pub fn with_reference(self, reference: LoadReference) -> Result<Self, LoadError> {
        let (expected, found) = (self.ideal.parameters().linear.len(), reference.linear.len());
        if expected != found {
            return Err(LoadError::Value {
                what: "linear parameters of the reference",
                expected: expected.to_string(),
                found: found.to_string(),
            });
        }
        Ok(JournalModel { reference: reference.linear, ..self })
    }

    /// The ideal robot.
    pub fn ideal(&self) -> &TreeModel {
        &self.ideal
    }

    /// Contacts of the journals, on rates with translations.
    pub fn contacts(&self) -> impl Iterator<Item = &ClearanceContact> {
        self.journals.iter().map(|journal| &journal.contact)
    }

    /// Joints with clearance.
    pub fn journal_joints(&self) -> impl Iterator<Item = &str> {
        self.journals.iter().map(|journal| self.moving.joints()[journal.contact.rotation].name.as_str())
    }

    /// Columns of the friction coefficients of the journals.
    pub fn coefficients(&self) -> impl Iterator<Item = usize> {
        self.journals.iter().map(|journal| journal.mu)
    }

    /// Channels that are read where a motion has them, all six of a journal or none: its offset along x and y, the rates, the
    /// accelerations.
    pub fn offset_channels(&self) -> impl Iterator<Item = &[[String; 2]; 3]> {
        self.journals.iter().map(|journal| &journal.offsets)
    }

    /// Forces on the journals in bearing axes over a block, N: x and y of each journal.
    ///
    /// # Panics
    /// Panics as [`EffortModel::efforts`] does.
    pub fn forces(&self, motion: &MotionBlock<'_>) -> Vec<Vec<f64>> {
        self.journals(motion).forces
    }

    /// What journals do over a block at the reference, one by one.
    ///
    /// # Panics
    /// Panics as [`EffortModel::efforts`] does.
    pub fn look(&self, motion: &MotionBlock<'_>) -> Vec<JournalLook> {
        let n = motion.samples;
        let all = self.journals(motion);
        let lengths = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x.hypot(*y)).collect();
        let each = self.journals.iter().zip(all.forces.chunks_exact(2)).zip(&all.probed);
        each.map(|((journal, force), probed)| {
            let [x, y] = journal.translations.map(|k| &all.motion.states[0][k * n..][..n]);
            JournalLook {
                probed: *probed,
                offset: lengths(x, y),
                load: lengths(&force[0], &force[1]),
                added: all.added[journal.contact.rotation * n..][..n].to_vec(),
            }
        })
        .collect()
    }

    /// How the moments of friction over a block go with the inertial parameters at other values, `reference` (all linear parameters):
    /// per journal sums over the samples, directions of friction and resting places held.
    ///
    /// # Panics
    /// If `reference` is too short; else as [`EffortModel::efforts`] does.
    pub fn load_sums(&self, motion: &MotionBlock<'_>, reference: &[f64]) -> Vec<LoadSums> {
        let own = self.journals(motion).moments;
        let journals = self.journals_at(motion, reference);
        let mut rows = RegressorBlock::new(self.moving.layout().clone(), motion.samples);
        self.moving.regressor(&journals.motion.block(), &[], &mut rows);
        let bodies = self.still.parameters().linear.len();
        let each =
            self.journals.iter().zip(own).zip(journals.moments.iter().zip(journals.forces.chunks_exact(2)));
        each.map(|((journal, own), (moments, force))| {
            let mut change = vec![0.0; bodies];
            for (rate, along) in journal.contact.translations.into_iter().zip(force) {
                for (k, parameter) in rows.layout().columns(rate).iter().enumerate() {
                    // Carriers of journals have no mass.
                    let Some(sum) = change.get_mut(*parameter) else { continue };
                    let column = rows.column(rate, k).iter().zip(along);
                    for ((w, f), (m, (x, y))) in
                        column.zip(moments.iter().zip(force[0].iter().zip(&force[1])))
                    {
                        let size = x * x + y * y;
                        *sum += if size > 0.0 { m * m * f * w / size } else { 0.0 };
                    }
                }
            }
            LoadSums {
                mu: journal.mu,
                change,
                square: moments.iter().map(|m| m * m).sum(),
                product: moments.iter().zip(own).map(|(m, own)| m * own).sum(),
            }
        })
        .collect()
    }

    /// Returns the journals around a changed model of the ideal robot, whose elements keep their columns.
    pub(crate) fn map_ideal(self, change: impl FnOnce(TreeModel) -> TreeModel) -> Self {
        JournalModel { ideal: change(self.ideal), ..self }
    }

    /// Hands on a motion with the moments of the journals' friction among its channels.
    fn with_moments<T>(
        &self,
        motion: &MotionBlock<'_>,
        journals: &Journals,
        work: impl FnOnce(&MotionBlock<'_>) -> T,
    ) -> T {
        let moments = self.journals.iter().zip(&journals.moments);
        let moments = moments.map(|(journal, moment)| (journal.moment.as_str(), moment.as_slice()));
        let channels: Vec<(&str, &[f64])> = moments.chain(motion.channels.iter().copied()).collect();
        work(&MotionBlock { channels: &channels, ..*motion })
    }
}

impl EffortModel for JournalModel {
    fn outputs(&self) -> &[Output] {
        self.ideal.outputs()
    }

    fn parameters(&self) -> &ParameterTable {
        self.ideal.parameters()
    }

    fn layout(&self) -> &Arc<RegressorLayout> {
        self.ideal.layout()
    }

    fn channels(&self) -> &[String] {
        &self.channels
    }

    fn signals(&self) -> &[String] {
        self.ideal.signals()
    }

    fn remember(
        &self,
        motion: &MotionBlock<'_>,
        step_s: f64,
        shape: &[f64],
        history: &mut History,
        stride: usize,
        out: &mut [f64],
    ) {
        let journals = self.journals(motion);
        self.with_moments(motion, &journals, |block| {
            self.ideal.remember(block, step_s, shape, history, stride, out);
        });
    }

    /// Random motion as [`RandomMotion::of`] makes it, journals at rest in their bearings.
    fn random_motion(&self, samples: usize, seed: u64) -> RandomMotion {
        RandomMotion::of(self, self.ideal.mechanism(), samples, seed)
    }

    fn dimensions(&self) -> (usize, usize) {
        self.ideal.dimensions()
    }

    fn reversal_speeds(&self, output: usize) -> Vec<Vec<(usize, f64)>> {
        self.ideal.reversal_speeds(output)
    }

    fn regressor(&self, motion: &MotionBlock<'_>, shape: &[f64], out: &mut RegressorBlock) {
        let journals = self.journals(motion);
        self.with_moments(motion, &journals, |block| self.ideal.regressor(block, shape, out));
        for (output, added) in journals.added.chunks_exact(motion.samples.max(1)).enumerate() {
            out.offset_mut(output).iter_mut().zip(added).for_each(|(to, x)| *to += x);
        }
    }

    fn shaped_columns(&self) -> &[(usize, usize)] {
        self.ideal.shaped_columns()
    }

    fn shape_dependence(&self) -> &[(usize, usize)] {
        self.ideal.shape_dependence()
    }

    fn shaped(
        &self,
        motion: &MotionBlock<'_>,
        shape: &[f64],
        stride: usize,
        values: &mut [f64],
        derivatives: &mut [f64],
    ) {
        let journals = self.journals(motion);
        self.with_moments(motion, &journals, |block| {
            self.ideal.shaped(block, shape, stride, values, derivatives);
        });
    }

    fn efforts(
        &self,
        motion: &MotionBlock<'_>,
        shape: &[f64],
        linear: &[f64],
        stride: usize,
        effort: &mut [f64],
    ) {
        let journals = self.journals(motion);
        self.with_moments(motion, &journals, |block| {
            self.ideal.efforts(block, shape, linear, stride, effort);
        });
        for (output, added) in journals.added.chunks_exact(motion.samples.max(1)).enumerate() {
            effort[output * stride..].iter_mut().zip(added).for_each(|(to, x)| *to += x);
        }
    }

    fn effort_adjoint(
        &self,
        motion: &MotionBlock<'_>,
        shape: &[f64],
        linear: &[f64],
        stride: usize,
        weights: &[f64],
        out: &mut MotionAdjoint,
    ) {
        let journals = self.journals(motion);
        self.with_moments(motion, &journals, |block| {
            self.ideal.effort_adjoint(block, shape, linear, stride, weights, out);
        });
        self.add_offset_adjoint(motion, &journals, (stride, weights), out);
    }

    fn regressor_adjoint(
        &self,
        motion: &MotionBlock<'_>,
        shape: &[f64],
        weights: &RegressorBlock,
        out: &mut MotionAdjoint,
    ) {
        let journals = self.journals(motion);
        self.with_moments(motion, &journals, |block| {
            self.ideal.regressor_adjoint(block, shape, weights, out);
        });
    }
}
