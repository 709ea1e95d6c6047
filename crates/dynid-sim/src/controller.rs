//! The robot's controller: feed-forward of a nominal model, position and velocity feedback, held between its ticks.

use dynid_model::RobotModel;

use crate::error::{SimError, demand, demand_length};

/// Settings of the controller.
#[derive(Debug, Clone, PartialEq)]
pub struct ControlSettings {
    /// Ticks per second. Default 1000.
    pub rate_hz: f64,
    /// Natural frequency of the position loop, Hz: `K_p = (2π f)² m` and `K_d = 2 ζ 2π f m` with `m` the largest
    /// diagonal entry of the nominal mass matrix along the reference; for a motor behind an elastic transmission of ratio `N`
    /// with that of its link over `N²` added. Default 5.
    pub bandwidth_hz: f64,
    /// Damping ratio ζ of the position loop. Default 1.
    pub damping: f64,
    /// Position gains per joint in place of those, N m/rad or N/m.
    pub position_gain: Option<Vec<f64>>,
    /// Velocity gains per joint in place of those, N m s/rad or N s/m.
    pub velocity_gain: Option<Vec<f64>>,
    /// Whether the nominal model's effort along the reference is fed forward; else feedback works alone. Default true.
    pub feed_forward: bool,
    /// Cut-off of the first-order low pass on differences of encoder readings, Hz. Default 100.
    pub velocity_cutoff_hz: f64,
    /// Time from a tick to the change of the drive's effort, ticks, whole or not. Default 0.
    pub delay_ticks: f64,
    /// Largest effort of each joint; infinite: none. Default: the limits of the mechanism, none for motors of elastic
    /// transmissions.
    pub effort_limit: Option<Vec<f64>>,
    /// Joints without a drive, by rate, besides links behind elastic transmissions, which never have one; of closed mechanisms
    /// drives that are switched off, by number. Default: none.
    pub passive: Vec<usize>,
}

impl Default for ControlSettings {
    fn default() -> Self {
        ControlSettings {
            rate_hz: 1000.0,
            bandwidth_hz: 5.0,
            damping: 1.0,
            position_gain: None,
            velocity_gain: None,
            feed_forward: true,
            velocity_cutoff_hz: 100.0,
            delay_ticks: 0.0,
            effort_limit: None,
            passive: Vec::new(),
        }
    }
}

impl ControlSettings {
    /// Whether a joint has no drive.
    pub(crate) fn is_passive(&self, model: &RobotModel, rate: usize) -> bool {
        self.passive.contains(&rate) || model.elastic_motor(rate).is_some()
    }

    pub(crate) fn check(&self, joints: usize) -> Result<(), SimError> {
        let positive = |x: f64| x.is_finite() && x > 0.0;
        demand(positive(self.rate_hz), "control rate", "a positive number", self.rate_hz)?;
        let low = self.bandwidth_hz > 0.0 && self.bandwidth_hz <= 0.1 * self.rate_hz;
        demand(low, "bandwidth", "above 0, at most a tenth of the control rate", self.bandwidth_hz)?;
        demand(positive(self.damping), "damping", "a positive number", self.damping)?;
        demand(
            positive(self.velocity_cutoff_hz),
            "velocity cut-off",
            "a positive number",
            self.velocity_cutoff_hz,
        )?;
        let few = (0.0..=1000.0).contains(&self.delay_ticks);
        demand(few, "control delay", "0 to 1000 ticks", self.delay_ticks)?;
        for (name, gains) in [("position gain", &self.position_gain), ("velocity gain", &self.velocity_gain)]
        {
            let Some(gains) = gains else { continue };
            demand_length(name, joints, gains.len())?;
            let good = gains.iter().all(|g| g.is_finite() && *g >= 0.0);
            demand(good, name, "finite numbers, none negative", format!("{gains:?}"))?;
        }
        if let Some(limits) = &self.effort_limit {
            demand_length("effort limit", joints, limits.len())?;
            let good = limits.iter().all(|l| *l >= 0.0);
            demand(good, "effort limit", "numbers, none negative", format!("{limits:?}"))?;
        }
        match self.passive.iter().find(|j| **j >= joints) {
            None => Ok(()),
            Some(j) => demand(false, "passive joint", "a joint of the robot", j),
        }
    }
}

/// Wanted position, velocity and acceleration of one joint.
pub type Wanted = [f64; 3];

/// The controller at work.
pub(crate) struct Controller<'a> {
    /// What the controller believes the robot to be.
    nominal: &'a mut dyn Nominal,
    settings: &'a ControlSettings,
    gains: Vec<(f64, f64)>,
    passive: Vec<bool>,
    limits: Vec<f64>,
    share: f64,
    /// Last reading and filtered velocity per joint.
    seen: Option<Vec<(f64, f64)>>,
    /// Ticks at which some effort was cut off.
    pub(crate) saturated: usize,
}

impl<'a> Controller<'a> {
    /// `inertia`: what every joint moves, for the gains.
    pub(crate) fn new(nominal: &'a mut dyn Nominal, settings: &'a ControlSettings, inertia: &[f64]) -> Self {
        let omega = std::f64::consts::TAU * settings.bandwidth_hz;
        let chosen = |given: &Option<Vec<f64>>, j: usize, default: f64| {
            given.as_ref().map_or(default, |gains| gains[j])
        };
        let gains = inertia
            .iter()
            .enumerate()
            .map(|(j, inertia)| {
                (
                    chosen(&settings.position_gain, j, omega * omega * inertia),
                    chosen(&settings.velocity_gain, j, 2.0 * settings.damping * omega * inertia),
                )
            })
            .collect();
        let limits = settings.effort_limit.clone().unwrap_or_else(|| nominal.effort_limits());
        let share = 1.0 - (-std::f64::consts::TAU * settings.velocity_cutoff_hz / settings.rate_hz).exp();
        let passive = nominal.passive(settings);
        Controller { nominal, settings, gains, passive, limits, share, seen: None, saturated: 0 }
    }

    /// Position and velocity gain of every drive.
    pub(crate) fn gains(&self) -> &[(f64, f64)] {
        &self.gains
    }

    /// Effort of the drives for a tick at a time.
    ///
    /// # Errors
    /// [`SimError`] where the reference cannot be followed.
    pub(crate) fn command(
        &mut self,
        reference: Reference<'_>,
        time: f64,
        reading: &[f64],
        channels: &[f64],
    ) -> Result<Vec<f64>, SimError> {
        let wanted = self.nominal.follow(reference, time)?;
        let seen = match self.seen.take() {
            None => reading.iter().zip(&wanted).map(|(q, w)| (*q, w[1])).collect(),
            Some(mut seen) => {
                for ((last, velocity), q) in seen.iter_mut().zip(reading) {
                    let difference = (q - *last) * self.settings.rate_hz;
                    *velocity += self.share * (difference - *velocity);
                    *last = *q;
                }
                seen
            }
        };
        let mut effort = if self.settings.feed_forward {
            self.nominal.effort(&wanted, channels)?
        } else {
            vec![0.0; wanted.len()]
        };
        let mut cut = false;
        for (j, e) in effort.iter_mut().enumerate() {
            if self.passive[j] {
                *e = 0.0;
                continue;
            }
            let (position, velocity) = self.gains[j];
            *e += position * (wanted[j][0] - seen[j].0) + velocity * (wanted[j][1] - seen[j].1);
            cut |= e.abs() > self.limits[j];
            *e = e.clamp(-self.limits[j], self.limits[j]);
        }
        self.saturated += usize::from(cut);
        self.seen = Some(seen);
        Ok(effort)
    }
}

/// Wanted motion of all drives at a time, s.
pub(crate) type Reference<'a> = &'a dyn Fn(f64) -> Vec<Wanted>;

/// What a controller believes its machine to be.
pub(crate) trait Nominal {
    fn drives(&self) -> usize;
    /// Names of channels that elements read.
    fn channels(&self) -> &[String];
    /// For every drive, whether it slides.
    fn slides(&self) -> Vec<bool>;
    /// For every drive, whether there is in fact none.
    fn passive(&self, settings: &ControlSettings) -> Vec<bool>;
    fn effort_limits(&self) -> Vec<f64>;
    /// Goes along the reference to a time and gives what is wanted there.
    fn follow(&mut self, reference: Reference<'_>, time: f64) -> Result<Vec<Wanted>, SimError>;
    /// Efforts of the drives for what was wanted last.
    fn effort(&mut self, wanted: &[Wanted], channels: &[f64]) -> Result<Vec<f64>, SimError>;
    /// For every drive the largest inertia that it moves alone, at some times.
    fn largest_inertia(&mut self, reference: Reference<'_>, times: &[f64]) -> Result<Vec<f64>, SimError>;
}
