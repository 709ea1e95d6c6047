//! Cut-off frequencies of regression kernel and states, from noise and band alone.

use crate::median::median;
use crate::spectrum::{PositionNoise, velocity_limit};

/// Limits within which cut-offs are sought.
#[derive(Debug, Clone, PartialEq)]
pub struct CutoffSettings {
    /// Kernel cut-off at most this many crossing frequencies. Default 1.5.
    pub crossings: f64,
    /// Kernel cut-off at most this part of the sample rate. Default 0.2.
    pub kernel_rate: f64,
    /// Candidates lie at or above this many excited bands. Default 4.
    pub bands: f64,
    /// Most candidates. Default 6.
    pub candidates: usize,
    /// State cut-off at most this part of the sample rate. Default 0.4.
    pub state_rate: f64,
    /// Noise power that states may have in the velocity, in parts of its signal power. Default 5.6e-5: four standard deviations of
    /// the noise are 3 % of the rms speed, the first step of masks about reversals.
    pub velocity_noise_power: f64,
    /// State cut-off where noise does not show in the velocity: at most this many kernel cut-offs, and this part of the sample
    /// rate, at which central differences show half of a velocity. Default 6, 0.3.
    pub quiet_states: (f64, f64),
}

impl Default for CutoffSettings {
    fn default() -> Self {
        Self {
            crossings: 1.5,
            kernel_rate: 0.2,
            bands: 4.0,
            candidates: 6,
            state_rate: 0.4,
            velocity_noise_power: 5.6e-5,
            quiet_states: (6.0, 0.3),
        }
    }
}

/// Highest kernel cut-off, with what it came from.
#[derive(Debug, Clone, PartialEq)]
pub struct KernelLimit {
    /// Noise limit of every joint, Hz.
    pub per_joint_hz: Vec<f64>,
    /// Median of the crossing frequencies of the joints that have one, Hz.
    pub crossing_hz: f64,
    /// Median over those joints of the cut-off below which noise is next to nothing in the velocity ([`velocity_limit`]), Hz.
    pub velocity_hz: f64,
    /// Median of the excited bands of those joints, Hz.
    pub excited_band_hz: f64,
    /// `min(median noise limit, crossings * crossing, kernel_rate * rate)`, Hz, but never below `bands` excited bands
    /// (as far as the sample rate allows): below, the kernel would take the motion away with the noise.
    pub limit_hz: f64,
}

/// Highest kernel cut-off that errors in variables, the crossing and the sample rate allow.
///
/// `noise`: one entry per joint. `None` if no joint moves (no entry has a crossing and an acceleration).
pub fn kernel_limit(noise: &[PositionNoise], rate_hz: f64, settings: &CutoffSettings) -> Option<KernelLimit> {
    let per_joint_hz: Vec<f64> = noise.iter().map(|n| n.noise_limit_hz).collect();
    let moving: Vec<(f64, f64, f64)> = noise
        .iter()
        .zip(&per_joint_hz)
        .filter(|(_, limit)| **limit > 0.0)
        .filter_map(|(n, limit)| Some((*limit, n.crossing_hz?, n.excited_band_hz)))
        .collect();
    let limits: Vec<f64> = moving.iter().map(|m| m.0.min(rate_hz)).collect();
    let crossings: Vec<f64> = moving.iter().map(|m| m.1).collect();
    let bands: Vec<f64> = moving.iter().map(|m| m.2).collect();
    let crossing_hz = median(&crossings)?;
    let excited_band_hz = median(&bands)?;
    let noise_hz = median(&limits)?.min(settings.crossings * crossing_hz);
    let limit_hz = noise_hz.max(settings.bands * excited_band_hz).min(settings.kernel_rate * rate_hz);
    let velocity = |n: &PositionNoise| {
        velocity_limit(n.velocity_variance, n.floor_psd, settings.velocity_noise_power).min(rate_hz)
    };
    let velocities: Vec<f64> = (noise.iter().zip(&per_joint_hz))
        .filter(|(n, limit)| **limit > 0.0 && n.crossing_hz.is_some())
        .map(|(n, _)| velocity(n))
        .collect();
    let velocity_hz = median(&velocities)?;
    Some(KernelLimit { per_joint_hz, crossing_hz, velocity_hz, excited_band_hz, limit_hz })
}

/// Kernel cut-offs to try, highest first: `hi, hi/2, hi/4 ...` down to `bands` excited bands; always at least `hi`.
pub fn kernel_candidates(limit: &KernelLimit, settings: &CutoffSettings) -> Vec<f64> {
    let lowest = settings.bands * limit.excited_band_hz;
    let halves = std::iter::successors(Some(limit.limit_hz), |f| Some(0.5 * f));
    let rest = halves.clone().skip(1).take_while(|f| *f >= lowest && *f > 0.0);
    halves.take(1).chain(rest).take(settings.candidates.max(1)).collect()
}

/// What noise lets states show: [`KernelLimit::crossing_hz`] and [`KernelLimit::velocity_hz`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StateLimit {
    /// Where noise and motion are equal in the positions, Hz.
    pub crossing_hz: f64,
    /// Where noise begins to show in the velocity, Hz.
    pub velocity_hz: f64,
}

impl KernelLimit {
    /// What noise lets states show.
    pub fn states(&self) -> StateLimit {
        StateLimit { crossing_hz: self.crossing_hz, velocity_hz: self.velocity_hz }
    }
}

/// State cut-off for a kernel cut-off, Hz: `min(crossings * crossing, 3 fe)`, or as high as noise does not show in the velocity, up to
/// `quiet_states`: signs of velocity and friction at low speed are the sharper. At least `2 fe`, at most `state_rate * rate`.
pub fn state_cutoff(kernel_hz: f64, limit: StateLimit, rate_hz: f64, settings: &CutoffSettings) -> f64 {
    let (kernels, rates) = settings.quiet_states;
    (settings.crossings * limit.crossing_hz)
        .min(3.0 * kernel_hz)
        .max(limit.velocity_hz.min(kernels * kernel_hz).min(rates * rate_hz))
        .max(2.0 * kernel_hz)
        .min(settings.state_rate * rate_hz)
}

/// Kernel cut-offs used together, widest kernel first: `fe, 2 fe, 4 fe` while at most `kernel_rate * rate` and
/// 1.5 state cut-offs; always at least `fe`.
pub fn kernel_scales(kernel_hz: f64, state_hz: f64, rate_hz: f64, settings: &CutoffSettings) -> Vec<f64> {
    let highest = (settings.kernel_rate * rate_hz).min(1.5 * state_hz);
    [2.0, 4.0].iter().map(|scale| scale * kernel_hz).take_while(|f| *f <= highest).fold(
        vec![kernel_hz],
        |mut scales, f| {
            scales.push(f);
            scales
        },
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spectrum::noise_limit;

    fn noise(limit: f64, crossing: Option<f64>, band: f64) -> PositionNoise {
        PositionNoise {
            floor_psd: 1e-12,
            sigma: 1e-5,
            crossing_hz: crossing,
            excited_band_hz: band,
            noise_limit_hz: limit,
            acceleration_variance: 1.0,
            velocity_variance: 1.0,
        }
    }

    #[test]
    fn joints_at_rest_do_not_move_the_limit() {
        let moving = noise(15.0, Some(20.0), 0.5);
        let rest = noise(0.0, None, 0.0);
        let settings = CutoffSettings::default();
        let alone = kernel_limit(&[moving], 500.0, &settings).unwrap();
        let both = kernel_limit(&[moving, rest, rest], 500.0, &settings).unwrap();
        assert_eq!(alone.limit_hz, both.limit_hz);
        assert_eq!(both.per_joint_hz[1], 0.0);
        assert!(kernel_limit(&[rest], 500.0, &settings).is_none());
        assert!(kernel_limit(&[], 500.0, &settings).is_none());
    }

    /// A record in which a joint creeps takes none of the band of another away, and adds its noise to it.
    #[test]
    fn records_of_slow_motion_do_not_pull_the_limit_down() {
        let fast =
            PositionNoise { noise_limit_hz: noise_limit(1.0, 1e-12, 5e-5), ..noise(0.0, Some(20.0), 0.5) };
        let slow = PositionNoise {
            acceleration_variance: 1e-8,
            velocity_variance: 1e-4,
            noise_limit_hz: noise_limit(1e-8, 1e-12, 5e-5),
            ..noise(0.0, Some(0.3), 0.05)
        };
        let pooled = |records: &[(f64, PositionNoise)]| PositionNoise::pooled(records, 5e-5).unwrap();
        assert_eq!(pooled(&[(30.0, fast)]), fast);
        let both = pooled(&[(30.0, fast), (30.0, slow)]);
        assert!((both.acceleration_variance / 0.5 - 1.0).abs() < 1e-6 && both.floor_psd == 1e-12);
        assert!((both.noise_limit_hz / fast.noise_limit_hz - 0.5_f64.powf(0.2)).abs() < 1e-6);
        assert!((both.crossing_hz.unwrap() - 20.0).abs() < 1e-5 && (both.excited_band_hz - 0.5).abs() < 1e-6);
        // Twice the same is once the same.
        let twice = pooled(&[(30.0, fast), (10.0, fast)]);
        assert!((twice.noise_limit_hz / fast.noise_limit_hz - 1.0).abs() < 1e-12);
        let still = PositionNoise { crossing_hz: None, acceleration_variance: 0.0, ..slow };
        assert_eq!(pooled(&[(1.0, still), (1.0, still)]).crossing_hz, None);
        assert!(PositionNoise::pooled(&[], 5e-5).is_none());
    }

    #[test]
    fn a_noiseless_log_is_limited_by_its_rate() {
        let clean = noise(f64::INFINITY, Some(250.0), 0.5);
        assert_eq!(kernel_limit(&[clean], 500.0, &CutoffSettings::default()).unwrap().limit_hz, 100.0);
    }

    #[test]
    fn noise_does_not_push_the_kernel_into_the_motion() {
        let settings = CutoffSettings::default();
        let limit = |band| kernel_limit(&[noise(0.7, Some(5.0), band)], 30.0, &settings).unwrap().limit_hz;
        assert_eq!(limit(0.1), 0.7);
        assert_eq!(limit(0.25), 1.0);
        assert_eq!(limit(3.0), 6.0);
    }

    #[test]
    fn candidates_halve_down_to_the_band() {
        let limit = KernelLimit {
            per_joint_hz: vec![],
            crossing_hz: 20.0,
            velocity_hz: 0.0,
            excited_band_hz: 0.6,
            limit_hz: 20.0,
        };
        let settings = CutoffSettings::default();
        assert_eq!(kernel_candidates(&limit, &settings), [20.0, 10.0, 5.0, 2.5]);
        let tight = KernelLimit { excited_band_hz: 9.0, ..limit.clone() };
        assert_eq!(kernel_candidates(&tight, &settings), [20.0]);
        let free = KernelLimit { excited_band_hz: 0.0, ..limit };
        assert_eq!(kernel_candidates(&free, &settings).len(), 6);
    }

    #[test]
    fn state_cutoff_and_scales_follow_the_kernel() {
        let settings = CutoffSettings::default();
        let states = |crossing_hz| StateLimit { crossing_hz, velocity_hz: 0.0 };
        assert_eq!(state_cutoff(10.0, states(100.0), 500.0, &settings), 30.0);
        assert_eq!(state_cutoff(10.0, states(16.0), 500.0, &settings), 24.0);
        assert_eq!(state_cutoff(10.0, states(2.0), 500.0, &settings), 20.0);
        assert_eq!(state_cutoff(20.0, states(90.0), 100.0, &settings), 40.0);
        let quiet = |velocity_hz| StateLimit { crossing_hz: 2.0, velocity_hz };
        assert_eq!(state_cutoff(10.0, quiet(45.0), 500.0, &settings), 45.0);
        assert_eq!(state_cutoff(10.0, quiet(450.0), 500.0, &settings), 60.0);
        assert_eq!(state_cutoff(10.0, quiet(450.0), 100.0, &settings), 30.0);
        assert_eq!(kernel_scales(10.0, 30.0, 500.0, &settings), [10.0, 20.0, 40.0]);
        assert_eq!(kernel_scales(10.0, 20.0, 500.0, &settings), [10.0, 20.0]);
        assert_eq!(kernel_scales(10.0, 20.0, 60.0, &settings), [10.0]);
    }
}
