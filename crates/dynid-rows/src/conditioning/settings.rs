//! Settings of the conditioning; every threshold with its default.

use dynid_motion::clock::ClockSettings;
use dynid_motion::cutoff::CutoffSettings;
use dynid_motion::savitzky_golay::SavitzkyGolay;
use dynid_motion::spectrum::NoiseSettings;
use dynid_motion::spikes::SpikeSettings;

/// How positions become position, velocity and acceleration.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Smoothing {
    /// Zero-phase Butterworth, then central differences twice (Gautier 1997). Of a log with a stated period the states are those
    /// of its Fourier series ([`super::PreparedLog::with_period`]).
    #[default]
    Butterworth,
    /// Cubics over five samples, so many passes ([`dynid_motion::smoothing::five_point_cubic`]), then central differences twice.
    FivePoint {
        /// Passes.
        passes: usize,
    },
    /// Polynomials over a window and their own derivatives (Savitzky & Golay 1964).
    SavitzkyGolay(SavitzkyGolay),
    /// Fourier series up to a harmonic, differentiated exactly (Swevers et al. 1997): an ideal low-pass over whole periods. Logs
    /// without a period, which only predictions may be of, pass the Butterworth at the same cut-off.
    Frequency {
        /// Last harmonic; `None`: the last one at or below the cut-off.
        harmonics: Option<usize>,
    },
}

/// How a log is brought from samples to regression rows. `None` means: found from the data.
#[derive(Debug, Clone, PartialEq)]
pub struct ConditioningSettings {
    /// Cut-off of the widest kernel, Hz. Default: found.
    pub kernel_hz: Option<f64>,
    /// Highest kernel cut-off tried on periodic logs where noise or band allow no higher one, Hz; at most the part of the sample
    /// rate that `cutoff` allows. Default 20: their states hold next to no noise, but rigid bodies end where the first
    /// resonances of an arm begin.
    pub periodic_kernel_hz: f64,
    /// Cut-off of the state filter, Hz. Default: found.
    pub state_hz: Option<f64>,
    /// Delay of the motion behind the logged effort, in samples. Default: found.
    pub delay_samples: Option<f64>,
    /// Reversal mask of every joint, as a share of the joint's rms speed; negative: no mask. Default: found.
    pub reversal_mask: Option<f64>,
    /// Rungs of the reversal ladder, ascending, at most 7. Default 0, 0.03, 0.06, 0.12, 0.25.
    pub ladder: Vec<f64>,
    /// Speeds below this many standard deviations of velocity noise count as reversal. Default 4.
    pub stick_sigma: f64,
    /// Time blocks for choices by held-out error. Default 8.
    pub folds: usize,
    /// A kernel whose held-out loss exceeds the best by this factor is rejected. Default 2.5.
    pub kernel_veto: f64,
    /// A joint keeps a mask only if this share of the samples in which it moves stays usable. Default 0.25.
    pub least_usable: f64,
    /// A stricter mask must gain this share of the loss. Default 0.002.
    pub mask_gain: f64,
    /// Least gain of a stricter mask in standard errors of the gain over time blocks: for all joints together, for one joint. The second is
    /// larger because many joints and rungs are tried. Default 1, 2.
    pub mask_sigma: (f64, f64),
    /// Mean and standard deviation of the prior on the delay, samples. Default 0.5, 1.
    pub delay_prior: (f64, f64),
    /// Choice of friction shapes.
    pub friction: FrictionSettings,
    /// Remove spikes. Default true.
    pub remove_spikes: bool,
    /// How positions become states. Default: Butterworth; the others belong to the textbook route.
    pub smoothing: Smoothing,
    /// Average logs with a stated period over their whole periods before everything else. Default false.
    pub average_periods: bool,
    /// Order of the state filter (Butterworth, run forward and backward). Default 4.
    pub state_order: usize,
    /// Length of the time blocks behind standard deviations, s; longer where there would be more than `most_blocks`. Default 1.
    pub block_s: f64,
    /// Most time blocks of a log, at least 1. Default: 64 per log, and 256 (or one per log) of all logs together.
    pub most_blocks: Option<usize>,
    /// Clock.
    pub clock: ClockSettings,
    /// Spikes in efforts.
    pub effort_spikes: SpikeSettings,
    /// Spikes in positions.
    pub position_spikes: SpikeSettings,
    /// Noise and band.
    pub noise: NoiseSettings,
    /// Limits of cut-offs.
    pub cutoff: CutoffSettings,
}

impl Default for ConditioningSettings {
    fn default() -> Self {
        ConditioningSettings {
            kernel_hz: None,
            periodic_kernel_hz: 20.0,
            state_hz: None,
            delay_samples: None,
            reversal_mask: None,
            ladder: vec![0.0, 0.03, 0.06, 0.12, 0.25],
            stick_sigma: 4.0,
            folds: 8,
            kernel_veto: 2.5,
            least_usable: 0.25,
            mask_gain: 0.002,
            mask_sigma: (1.0, 2.0),
            delay_prior: (0.5, 1.0),
            friction: FrictionSettings::default(),
            remove_spikes: true,
            smoothing: Smoothing::default(),
            average_periods: false,
            state_order: 4,
            block_s: 1.0,
            most_blocks: None,
            clock: ClockSettings::default(),
            effort_spikes: SpikeSettings::default(),
            position_spikes: SpikeSettings::position(),
            noise: NoiseSettings::default(),
            cutoff: CutoffSettings::default(),
        }
    }
}

/// When a friction shape is accepted.
#[derive(Debug, Clone, PartialEq)]
pub struct FrictionSettings {
    /// Share of the joint's held-out loss that its first shape must gain, less where the kind is expected. Default 0.01.
    pub first: f64,
    /// The same share of friction that gives way, over all rows. A filtered velocity turns a little early or late, which a short travel imitates: on
    /// logs without such friction up to 8 %. Default 0.1.
    pub spring: f64,
    /// How much a kind of first shape is expected at a joint: of `m` other joints, `n` with the kind, the odds against it are
    /// `(m - n + a) / (b n + c)`, and the gain must be `sqrt(2 ln(odds))` standard errors over time blocks, at least 0.3.
    /// Default `a`, `b`, `c` = 1.5, 4, 0.2: 2.0 errors for a joint alone, 2.6 for the first of six, 0.7 for its neighbours.
    pub expected: (f64, f64, f64),
    /// What a second shape must gain: standard errors over blocks, and share of the mean square. Default 2.5, 0.03.
    pub second: (f64, f64),
    /// Candidates tried on held-out blocks, after all were ranked by the loss on all rows. Default 6.
    pub tried: usize,
    /// Fewest time blocks with rows of a joint; with fewer nothing is chosen for it. Default 4.
    pub least_blocks: usize,
    /// Least gain for another rung of the mask ladder after the choice: standard errors of the gain, share of the loss.
    /// Default 1.4, 0.005.
    pub mask_again: (f64, f64),
}

impl Default for FrictionSettings {
    fn default() -> Self {
        FrictionSettings {
            first: 0.01,
            spring: 0.1,
            expected: (1.5, 4.0, 0.2),
            second: (2.5, 0.03),
            tried: 6,
            least_blocks: 4,
            mask_again: (1.4, 0.005),
        }
    }
}
