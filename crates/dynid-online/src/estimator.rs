//! One sample after the other.

use alloc::vec;
use alloc::vec::Vec;
use core::fmt::Write;

use crate::change_detection::ChangeDetection;
use crate::drift::Drift;
use crate::error::{SampleError, SettingsError, StateError};
use crate::excitation_monitor::ExcitationMonitor;
use crate::forgetting::{
    BoundedCovariance, DirectionalForgetting, Forgetting, error_driven_factor, excess_error, relative_error,
};
use crate::innovation::Innovation;
use crate::memory::Memory;
use crate::reaction::{Reaction, TargetedReaction};
use crate::rows::{RowNoise, WeightedRows};
use crate::settings::Settings;
use crate::square_root::{SquareRoot, dot};
use crate::state::Fingerprint;
use dynid_words::Transfer;

/// Nothing is discounted once a diagonal entry of `R` is below this (parameters in scales): it would become
/// zero.
const LEAST_PIVOT: f64 = 1e-50;
/// First word of a saved state.
const STATE_VERSION: u64 = 1;

/// What change detection makes of a sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Watch {
    /// The row counts for change detection.
    Count,
    /// Change detection passes the row over.
    Pass,
    /// The sum starts again from zero.
    Restart,
}

/// What a sample did.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Number of the sample, from 0.
    pub sample: u64,
    /// Factor by which old information was discounted (along the sample's directions, for directional
    /// forgetting); 1 if nothing was.
    pub lambda: f64,
    /// Mean square of the whitened innovations: 1 on average while model and noise are right.
    pub normalised_square: f64,
    /// Cumulative sum of change detection after the sample; 0 on an alarm and without detection.
    pub statistic: f64,
    /// Whether the sample raised an alarm.
    pub alarm: bool,
    /// Whether the sample is held back until the reaction to an alarm is decided.
    pub held_back: bool,
    /// The reaction that the sample completed. The jump is in the parameter's unit.
    pub reaction: Option<Reaction>,
    /// Number of parameters that do not forget because nothing excites them.
    pub frozen: usize,
}

/// Recursive estimator of `y = Φ x + noise`, sample by sample.
///
/// Per sample: drift; innovations with the estimate so far; forgetting; the new rows; the new estimate;
/// change detection. After an alarm, samples are held back until the reaction is decided
/// ([`TargetedReaction`]).
///
/// Everything is allocated by [`Estimator::new`]. No state becomes non-finite whatever finite samples come.
///
/// ```
/// use dynid_online::{Estimator, Forgetting, RowNoise, Settings};
///
/// let mut settings = Settings::new(vec![0.0, 0.0], vec![10.0, 10.0], 1);
/// settings.forgetting = Forgetting::Constant { lambda: 0.99 };
/// let mut estimator = Estimator::new(settings)?;
/// for k in 0..100 {
///     let speed = (0.1 * k as f64).sin();
///     let effort = 2.0 * speed + 0.5 * speed.signum();
///     estimator.step(&[speed, speed.signum()], &[effort], RowNoise::Std(&[0.01]))?;
/// }
/// assert!((estimator.x()[0] - 2.0).abs() < 1e-4);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Estimator {
    settings: Settings,
    fingerprint: u64,
    memory: Memory,
    drift: Option<Drift>,
    directional: Option<DirectionalForgetting>,
    bounded: Option<BoundedCovariance>,
    monitor: Option<ExcitationMonitor>,
    detection: Option<ChangeDetection>,
    reaction: Option<TargetedReaction>,
    innovation: Innovation,
    samples: u64,
    /// Estimate in scales, and in the parameters' units.
    scaled: Vec<f64>,
    x: Vec<f64>,
    error: Vec<f64>,
    rows: WeightedRows,
    never_frozen: Vec<bool>,
    prior_std: Vec<f64>,
    scratch: Vec<f64>,
}

impl Estimator {
    /// Estimator before its first sample. Allocates all it needs; with change detection it takes some
    /// milliseconds.
    ///
    /// # Errors
    /// [`SettingsError`] of [`Settings::validate`].
    pub fn new(settings: Settings) -> Result<Self, SettingsError> {
        Self::prepare(settings, None)
    }

    /// Estimator that starts from what is known already, such as a log reduced to a factor, in place of the
    /// prior.
    ///
    /// `information` has its parameters in scales, and rows divided by their deviations; it should contain a
    /// prior where the log tells nothing. The estimate starts at its solution. Resets go back to the
    /// deviations of the settings, and with windows it always counts, as a prior does.
    ///
    /// # Errors
    /// [`SettingsError`] of [`Settings::validate`], and if `information` has other parameters or is singular.
    pub fn starting_from(settings: Settings, information: SquareRoot) -> Result<Self, SettingsError> {
        Self::prepare(settings, Some(information))
    }

    fn prepare(settings: Settings, information: Option<SquareRoot>) -> Result<Self, SettingsError> {
        settings.validate()?;
        let (p, m) = (settings.columns(), settings.rows);
        let in_scales =
            |list: &[f64]| -> Vec<f64> { list.iter().zip(&settings.scale).map(|(v, s)| v / s).collect() };
        let (mut start, prior_std) = (in_scales(&settings.start), in_scales(&settings.prior_std));
        let shares = |share: f64| -> Vec<f64> { prior_std.iter().map(|s| share / (s * s)).collect() };
        let root = information.unwrap_or_else(|| SquareRoot::from_prior(&start, &prior_std));
        if root.columns() != p {
            let what = "parameters of the information to start from";
            return Err(SettingsError::Length { what, expected: p, found: root.columns() });
        }
        if !root.solve(&mut start) || start.iter().any(|x| !x.is_finite()) {
            let what = "the information to start from is singular: add a prior";
            return Err(SettingsError::Combination { what });
        }
        let memory = Memory::new(&settings.forgetting, root, m);
        let drift = match &settings.forgetting {
            Forgetting::Drift { rate, interval } => {
                let variance: Vec<f64> = in_scales(rate).iter().map(|r| r * r * interval).collect();
                Some(Drift::new(&variance))
            }
            _ => None,
        };
        let directional = matches!(settings.forgetting, Forgetting::Directional { .. })
            .then(|| DirectionalForgetting::new(p, m));
        let mut fingerprint = Fingerprint::new();
        // Writing into a hash cannot fail.
        let _ = write!(fingerprint, "{settings:?}");
        let x = start.iter().zip(&settings.scale).map(|(x, scale)| x * scale).collect();
        Ok(Self {
            fingerprint: fingerprint.0,
            memory,
            drift,
            directional,
            bounded: settings.bounded_covariance.map(|share| BoundedCovariance::new(&shares(share))),
            monitor: settings.monitor.map(|s| ExcitationMonitor::new(&shares(s.share), s.samples, m)),
            detection: settings.detection.map(|s| ChangeDetection::new(&s, m)),
            reaction: settings.reaction.map(|s| TargetedReaction::new(&s, p, m)),
            innovation: Innovation::new(p, m),
            samples: 0,
            x,
            scaled: start,
            error: vec![0.0; m],
            rows: WeightedRows::new(&settings.scale, m),
            never_frozen: vec![false; p],
            prior_std,
            scratch: vec![0.0; 2 * p + 1],
            settings,
        })
    }

    /// Takes a sample of `m` rows, `1 ≤ m ≤ rows`.
    ///
    /// `regressor`: `m × p`, row by row, effort per parameter unit; `effort`: `m` entries.
    ///
    /// # Errors
    /// [`SampleError`]: lengths that do not fit, numbers that are not finite, noise that is none. The
    /// estimator is then as it was before.
    pub fn step(
        &mut self,
        regressor: &[f64],
        effort: &[f64],
        noise: RowNoise<'_>,
    ) -> Result<Step, SampleError> {
        self.step_where(regressor, effort, noise, |_| Watch::Count)
    }

    /// Takes a sample as [`Self::step`] does, with change detection as `watched` says of the sample's innovations; the estimate is updated by every sample.
    ///
    /// What rows ask of the estimate that those before did not tell ([`Innovation::leverage`]) shows in the errors of a model that is not
    /// quite right, though nothing has changed.
    ///
    /// # Errors
    /// Fails as [`Self::step`] does.
    pub fn step_where(
        &mut self,
        regressor: &[f64],
        effort: &[f64],
        noise: RowNoise<'_>,
        watched: impl FnOnce(&Innovation) -> Watch,
    ) -> Result<Step, SampleError> {
        let m = effort.len();
        self.rows.load(regressor, effort, noise)?;
        let frozen = self.monitor.as_ref().map_or(self.never_frozen.as_slice(), |m| m.frozen());
        if let (Some(drift), Memory::Recursive(root)) = (&mut self.drift, &mut self.memory) {
            drift.advance(root, frozen);
        }
        for (error, (y, phi)) in
            self.error.iter_mut().zip(effort.iter().zip(regressor.chunks_exact(self.x.len())))
        {
            *error = y - dot(phi, &self.x);
        }
        self.innovation.evaluate(self.memory.root(), &self.scaled, self.rows.get());
        if let Some(monitor) = &mut self.monitor {
            monitor.push(self.rows.get());
        }
        let held_back = self.reaction.as_ref().is_some_and(TargetedReaction::is_active);
        let (mut lambda, mut alarm, mut reaction) = (1.0, false, None);
        if held_back {
            reaction = self.hold_back();
        } else {
            lambda = self.forget(effort);
            self.memory.push(self.rows.get_mut());
            self.solve();
            let watched = watched(&self.innovation);
            if let Some(detection) = &mut self.detection {
                match watched {
                    Watch::Count => alarm = detection.push(self.innovation.whitened()),
                    Watch::Pass => {}
                    Watch::Restart => detection.restart(),
                }
            }
            if let (true, Some(reaction)) = (alarm, &mut self.reaction) {
                reaction.start();
            }
        }
        self.samples += 1;
        let u = self.innovation.whitened();
        Ok(Step {
            sample: self.samples - 1,
            lambda,
            normalised_square: u.iter().map(|u| u * u).sum::<f64>() / m as f64,
            statistic: self.detection.as_ref().map_or(0.0, ChangeDetection::statistic),
            alarm,
            held_back,
            reaction,
            frozen: self.monitor.as_ref().map_or(0, ExcitationMonitor::frozen_count),
        })
    }

    /// Forgets and returns the factor.
    fn forget(&mut self, effort: &[f64]) -> f64 {
        let m = effort.len();
        let lambda = match &self.settings.forgetting {
            Forgetting::Constant { lambda } | Forgetting::Directional { lambda, .. } => *lambda,
            Forgetting::ErrorDriven { alpha, beta, floor } => {
                error_driven_factor(relative_error(&self.error[..m], effort, *floor), *alpha, *beta)
            }
            Forgetting::NoiseNormalised { alpha, beta, dead_zone } => {
                error_driven_factor(excess_error(self.innovation.whitened(), *dead_zone), *alpha, *beta)
            }
            _ => 1.0,
        };
        let Memory::Recursive(root) = &mut self.memory else { return 1.0 };
        if lambda.is_nan() || lambda >= 1.0 || (0..self.x.len()).any(|j| root.row(j)[0] < LEAST_PIVOT) {
            return 1.0;
        }
        match (&self.settings.forgetting, &mut self.directional, &mut self.monitor) {
            (Forgetting::Directional { tolerance, .. }, Some(directional), _) => {
                directional.forget(root, self.rows.get(), lambda, *tolerance);
            }
            (_, _, Some(monitor)) => monitor.discount(root, lambda),
            _ => root.discount(lambda),
        }
        if let Some(bounded) = &mut self.bounded {
            bounded.hold(root, &self.scaled, lambda);
        }
        lambda
    }

    /// Gives the sample to the reaction, which it may complete.
    fn hold_back(&mut self) -> Option<Reaction> {
        let (Some(reaction), Memory::Recursive(root)) = (&mut self.reaction, &mut self.memory) else {
            return None;
        };
        if !reaction.push(self.rows.get()) {
            return None;
        }
        let inflation = self.detection.as_ref().map_or(1.0, ChangeDetection::inflation);
        let mut outcome = reaction.finish(root, inflation);
        outcome.jump *= self.settings.scale[outcome.best];
        self.solve();
        Some(outcome)
    }

    fn solve(&mut self) {
        let found = &mut self.scratch[..self.x.len()];
        if self.memory.root().solve(found) && found.iter().all(|x| x.is_finite()) {
            self.scaled.copy_from_slice(found);
            self.publish();
        }
    }

    fn publish(&mut self) {
        for (x, (scaled, scale)) in self.x.iter_mut().zip(self.scaled.iter().zip(&self.settings.scale)) {
            *x = scaled * scale;
        }
    }

    /// The estimate, in the parameters' units.
    pub fn x(&self) -> &[f64] {
        &self.x
    }

    /// Writes the standard deviation of each parameter, in its unit (`p` entries).
    ///
    /// They hold for row noise as stated and white; [`ChangeDetection::inflation`] says by how much variances
    /// fall short where it was learned.
    pub fn std(&mut self, out: &mut [f64]) {
        assert_eq!(out.len(), self.x.len(), "one deviation per parameter");
        let root = self.memory.root();
        let scratch = &mut self.scratch[..root.columns()];
        for (j, (std, scale)) in out.iter_mut().zip(&self.settings.scale).enumerate() {
            *std = libm::sqrt(root.variance(j, scratch)) * scale;
        }
    }

    /// Writes the covariance of the parameters, `p × p` row by row, in products of their units.
    pub fn covariance(&self, out: &mut [f64]) {
        let p = self.x.len();
        self.memory.root().covariance(out);
        for (place, value) in out.iter_mut().enumerate() {
            *value *= self.settings.scale[place / p] * self.settings.scale[place % p];
        }
    }

    /// Information, with the prior and with parameters in scales.
    pub fn information(&self) -> &SquareRoot {
        self.memory.root()
    }

    /// Settings.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Samples taken.
    pub fn samples(&self) -> u64 {
        self.samples
    }

    /// Errors `y - Φ x` of the last sample's prediction, in the unit of effort.
    pub fn prediction_error(&self) -> &[f64] {
        &self.error[..self.innovation.whitened().len()]
    }

    /// Innovations of the last sample.
    pub fn innovation(&self) -> &Innovation {
        &self.innovation
    }

    /// Change detection, if there is any.
    pub fn detection(&self) -> Option<&ChangeDetection> {
        self.detection.as_ref()
    }

    /// Excitation monitor, if there is one.
    pub fn monitor(&self) -> Option<&ExcitationMonitor> {
        self.monitor.as_ref()
    }

    /// Sets the covariance back to the prior's; the estimate stays. Samples held back are dropped.
    ///
    /// # Errors
    /// [`SettingsError::Combination`] with windows.
    pub fn reset(&mut self) -> Result<(), SettingsError> {
        let Memory::Recursive(root) = &mut self.memory else { return Err(WINDOW) };
        root.restart(&self.scaled, &self.prior_std);
        if let Some(reaction) = &mut self.reaction {
            reaction.stop();
        }
        if let Some(detection) = &mut self.detection {
            detection.restart();
        }
        Ok(())
    }

    /// Takes over what is known from elsewhere, with parameters in scales; samples held back are dropped and change detection
    /// starts again.
    ///
    /// # Errors
    /// [`SettingsError`] with windows, and unless `root` has as many parameters and determines them all.
    pub fn set_information(&mut self, root: &SquareRoot) -> Result<(), SettingsError> {
        let Memory::Recursive(own) = &mut self.memory else { return Err(WINDOW) };
        if root.columns() != own.columns() {
            let (what, expected, found) = ("parameters of the information", own.columns(), root.columns());
            return Err(SettingsError::Length { what, expected, found });
        }
        if !root.is_regular() {
            return Err(SettingsError::Combination { what: "information must determine every parameter" });
        }
        own.copy_from(root);
        if let Some(reaction) = &mut self.reaction {
            reaction.stop();
        }
        if let Some(detection) = &mut self.detection {
            detection.restart();
        }
        self.solve();
        Ok(())
    }

    /// Adds the standard deviation `std`, in the parameter's unit, to parameter `j` alone; the estimate
    /// stays.
    ///
    /// # Errors
    /// [`SettingsError`] with windows, for `j` beyond the last parameter, and unless `std` is finite and not
    /// negative.
    pub fn open(&mut self, j: usize, std: f64) -> Result<(), SettingsError> {
        let p = self.x.len();
        let Memory::Recursive(root) = &mut self.memory else { return Err(WINDOW) };
        if j >= p {
            let (what, expected, found) = ("parameter to open", "one that exists", j as f64);
            return Err(SettingsError::Number { what, index: j, expected, found });
        }
        let scaled = std / self.settings.scale[j];
        if !(0.0..1e30).contains(&scaled) {
            let (what, expected) = ("deviation to add", "up to 1e30 scales, not negative");
            return Err(SettingsError::Number { what, index: j, expected, found: std });
        }
        root.open(j, scaled * scaled, &mut self.scratch);
        Ok(())
    }

    /// The whole state as words of 64 bits, for any file format. Real numbers are their bits.
    ///
    /// An estimator that loads them continues with the same bits as one that was never interrupted. What
    /// [`Step`] and the accessors say of the last sample is not part of it. Allocates.
    pub fn save(&self) -> Vec<u64> {
        let mut words = Vec::new();
        self.clone().transfer(&mut Transfer::Save(&mut words));
        words
    }

    /// Takes over a state saved with the same settings. Allocates.
    ///
    /// # Errors
    /// [`StateError`]; the estimator is then as it was before.
    pub fn load(&mut self, words: &[u64]) -> Result<(), StateError> {
        let mut loaded = self.clone();
        let mut transfer = Transfer::load(words);
        if !loaded.transfer(&mut transfer) {
            return Err(StateError::OtherSettings);
        }
        if !transfer.complete() {
            return Err(StateError::Damaged);
        }
        loaded.publish();
        *self = loaded;
        Ok(())
    }

    /// Whether the words are of these settings; always when saving.
    fn transfer(&mut self, transfer: &mut Transfer<'_>) -> bool {
        let own = [STATE_VERSION, self.fingerprint];
        let mut found = own;
        found.iter_mut().for_each(|word| transfer.integer(word));
        transfer.counter(&mut self.samples);
        transfer.finites(&mut self.scaled);
        self.memory.transfer(transfer);
        if !self.memory.root().is_regular() {
            transfer.fail();
        }
        if let Some(bounded) = &mut self.bounded {
            bounded.transfer(transfer);
        }
        if let Some(monitor) = &mut self.monitor {
            monitor.transfer(transfer);
        }
        if let Some(detection) = &mut self.detection {
            detection.transfer(transfer);
        }
        if let Some(reaction) = &mut self.reaction {
            reaction.transfer(transfer);
        }
        found == own
    }
}

const WINDOW: SettingsError =
    SettingsError::Combination { what: "a window holds samples and the prior: its covariance cannot be set" };
