//! What sensors, drives and loggers do wrong.

use crate::error::{SimError, demand, demand_length};
use crate::plant::Ripple;

/// Imperfections of a virtual experiment. Each draws from a stream of its own (see [`crate::streams`]): switching one
/// off leaves the others as they were.
#[derive(Debug, Clone, PartialEq)]
pub struct Imperfections {
    /// Encoder resolution, bits per turn (per metre for sliding joints); 0: exact. Default 18.
    pub encoder_bits: u32,
    /// Standard deviation of encoder noise before rounding, rad or m. Default 5e-6.
    pub encoder_noise: f64,
    /// The same joint by joint, in place of it; joints past its end have the common one. Default: none.
    pub joint_encoder_noise: Vec<f64>,
    /// Standard deviation of noise of the logged velocity, rad/s or m/s. Default 1e-3. It matters only where velocity is
    /// logged.
    pub velocity_noise: f64,
    /// Noise of the logged effort as a share of each joint's rms effort. Default 0.02.
    pub effort_noise_share: f64,
    /// Standard deviation of further noise of the logged effort per joint, N m or N; joints past its end have none. Default:
    /// none.
    pub effort_noise: Vec<f64>,
    /// Amplitude of the torque ripple as a share of each joint's rms feed-forward effort. The drive delivers it, the
    /// logged effort does not show it. Default 0.01.
    pub ripple_share: f64,
    /// Repetitions of the ripple per turn of the joint. Default 50.
    pub ripple_cycles: f64,
    /// Ripple of every drive in place of such a one. Default: none given.
    pub ripple: Option<Vec<Ripple>>,
    /// Age of the logged effort relative to the logged motion, log samples, whole or not; negative: effort is newer.
    /// Default 0.3. The command that is held over a tick leads the motion by half a tick on top of that.
    pub effort_delay_samples: f64,
    /// Share of effort samples that are outliers. Default 1e-3.
    pub outlier_share: f64,
    /// Standard deviation of outliers in multiples of the joint's rms effort. Default 5.
    pub outlier_size: f64,
    /// Share of rows that are missing. Default 1e-3.
    pub dropped_share: f64,
    /// Standard deviation of the error of time stamps, s, clipped to a third of the sample period. Default 5e-5.
    pub clock_jitter_s: f64,
}

impl Default for Imperfections {
    fn default() -> Self {
        Imperfections {
            encoder_bits: 18,
            encoder_noise: 5e-6,
            joint_encoder_noise: Vec::new(),
            velocity_noise: 1e-3,
            effort_noise_share: 0.02,
            effort_noise: Vec::new(),
            ripple_share: 0.01,
            ripple_cycles: 50.0,
            ripple: None,
            effort_delay_samples: 0.3,
            outlier_share: 1e-3,
            outlier_size: 5.0,
            dropped_share: 1e-3,
            clock_jitter_s: 5e-5,
        }
    }
}

impl Imperfections {
    /// All off.
    pub fn none() -> Self {
        Imperfections {
            encoder_bits: 0,
            encoder_noise: 0.0,
            joint_encoder_noise: Vec::new(),
            velocity_noise: 0.0,
            effort_noise_share: 0.0,
            effort_noise: Vec::new(),
            ripple_share: 0.0,
            ripple_cycles: 50.0,
            ripple: None,
            effort_delay_samples: 0.0,
            outlier_share: 0.0,
            outlier_size: 5.0,
            dropped_share: 0.0,
            clock_jitter_s: 0.0,
        }
    }

    /// Names of those that are on.
    pub fn active(&self) -> Vec<&'static str> {
        [
            ("encoder_bits", self.encoder_bits > 0),
            ("encoder_noise", self.encoder_noise > 0.0 || self.joint_encoder_noise.iter().any(|s| *s > 0.0)),
            ("velocity_noise", self.velocity_noise > 0.0),
            ("effort_noise_share", self.effort_noise_share > 0.0),
            ("effort_noise", self.effort_noise.iter().any(|s| *s > 0.0)),
            ("ripple", self.has_ripple()),
            ("effort_delay", self.effort_delay_samples != 0.0),
            ("outliers", self.outlier_share > 0.0 && self.outlier_size > 0.0),
            ("dropped", self.dropped_share > 0.0),
            ("clock_jitter", self.clock_jitter_s > 0.0),
        ]
        .into_iter()
        .filter_map(|(name, on)| on.then_some(name))
        .collect()
    }

    fn has_ripple(&self) -> bool {
        match &self.ripple {
            Some(given) => given.iter().any(|r| r.amplitude != 0.0),
            None => self.ripple_share > 0.0,
        }
    }

    pub(crate) fn check(&self, joints: usize) -> Result<(), SimError> {
        if let Some(ripple) = &self.ripple {
            demand_length("drives with ripple", joints, ripple.len())?;
            let finite = |r: &Ripple| [r.amplitude, r.cycles, r.phase].iter().all(|x| x.is_finite());
            demand(ripple.iter().all(finite), "ripple", "finite numbers", format!("{ripple:?}"))?;
        }
        demand(self.encoder_bits <= 40, "encoder_bits", "at most 40", self.encoder_bits)?;
        for (name, x) in [
            ("encoder_noise", self.encoder_noise),
            ("velocity_noise", self.velocity_noise),
            ("effort_noise_share", self.effort_noise_share),
            ("ripple_share", self.ripple_share),
            ("ripple_cycles", self.ripple_cycles),
            ("outlier_size", self.outlier_size),
            ("clock_jitter_s", self.clock_jitter_s),
        ] {
            demand(x.is_finite() && x >= 0.0, name, "a finite number, not negative", x)?;
        }
        for x in &self.joint_encoder_noise {
            demand(x.is_finite() && *x >= 0.0, "joint_encoder_noise", "a finite number, not negative", x)?;
        }
        for x in &self.effort_noise {
            demand(x.is_finite() && *x >= 0.0, "effort_noise", "a finite number, not negative", x)?;
        }
        for (name, x) in [("outlier_share", self.outlier_share), ("dropped_share", self.dropped_share)] {
            demand((0.0..=0.5).contains(&x), name, "0 to 0.5", x)?;
        }
        let delay = self.effort_delay_samples;
        demand(delay.abs() <= 100.0, "effort_delay_samples", "-100 to 100", delay)
    }
}
