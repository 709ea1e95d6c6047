//! The robot's controller: feed-forward of a nominal model, position and velocity feedback, held between its ticks.

use dynid_model::{EffortModel, RobotModel};

use crate::error::{SimError, demand, demand_length};
use crate::plant::{Plant, PlantWorkspace};

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
    /// Joints without a drive, by rate, besides links behind elastic transmissions, which never have one. Default: none.
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
#[derive(Debug)]
pub(crate) struct Controller<'a> {
    /// What the controller believes the robot to be.
    nominal: &'a Plant,
    settings: &'a ControlSettings,
    work: PlantWorkspace,
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
    /// `reference`: positions at some instants of the motion, for the gains.
    pub(crate) fn new(nominal: &'a Plant, settings: &'a ControlSettings, reference: &[Vec<f64>]) -> Self {
        let n = nominal.joints();
        let mut work = nominal.workspace();
        let mut inertia = vec![0.0_f64; n];
        for q in reference {
            let mass = nominal.mass_matrix(q, &mut work);
            inertia.iter_mut().enumerate().for_each(|(j, m)| *m = m.max(mass[j * (n + 1)]));
        }
        for motor in 0..n {
            if let Some((link, ratio)) = nominal.model().elastic_link(motor) {
                inertia[motor] += inertia[link] / (ratio * ratio);
            }
        }
        let omega = std::f64::consts::TAU * settings.bandwidth_hz;
        let chosen = |given: &Option<Vec<f64>>, j: usize, default: f64| {
            given.as_ref().map_or(default, |gains| gains[j])
        };
        let gains = (0..n)
            .map(|j| {
                (
                    chosen(&settings.position_gain, j, omega * omega * inertia[j]),
                    chosen(&settings.velocity_gain, j, 2.0 * settings.damping * omega * inertia[j]),
                )
            })
            .collect();
        let limits = settings.effort_limit.clone().unwrap_or_else(|| effort_limits(nominal.model()));
        let share = 1.0 - (-std::f64::consts::TAU * settings.velocity_cutoff_hz / settings.rate_hz).exp();
        let passive = (0..n).map(|j| settings.is_passive(nominal.model(), j)).collect();
        Controller { nominal, settings, work, gains, passive, limits, share, seen: None, saturated: 0 }
    }

    /// Effort of the drives for a tick.
    pub(crate) fn command(&mut self, wanted: &[Wanted], reading: &[f64], channels: &[f64]) -> Vec<f64> {
        let seen = match self.seen.take() {
            None => reading.iter().zip(wanted).map(|(q, w)| (*q, w[1])).collect(),
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
            let of = |k: usize| wanted.iter().map(|w| w[k]).collect::<Vec<f64>>();
            self.nominal.drive_effort([&of(0), &of(1), &of(2)], channels, &mut self.work)
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
        effort
    }
}

fn effort_limits(model: &RobotModel) -> Vec<f64> {
    let bodies = model.mechanism().bodies();
    let owners = model.mechanism().rate_bodies();
    let limit = |j: usize| owners.get(j).and_then(|b| bodies[*b].joint.limits.effort).filter(|l| *l > 0.0);
    (0..model.outputs().len()).map(|j| limit(j).unwrap_or(f64::INFINITY)).collect()
}
