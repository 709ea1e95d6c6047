//! Motion and effort signals: everything that needs the record alone.
//!
//! A [`Log`] is what was recorded; [`clock`] puts it on a uniform grid; [`spikes`] removes single outliers;
//! [`spectrum`] finds the sensor noise and the excited band, and [`cutoff`] the cut-off frequencies they allow;
//! [`filter`], [`difference`], [`kernel`] and [`shift`] form states, regression rows and delays; [`mask`] says which
//! samples may be used. [`turns`] takes out full turns, [`velocity`] judges a measured velocity, [`constant_speed`] finds constant-speed passes and pairs both directions,
//! [`trajectory`] holds the excitation trajectories. For motions that repeat:
//! [`repetition`] finds after what time, [`periods`] averages records, [`frequency`] differentiates them by their [`harmonics`], [`smoothing`] fits cubics,
//! [`savitzky_golay`] polynomials over any window, and [`response`] is what linear systems make of them.
//! [`faults`] finds what is wrong with a record. [`live`] forms states of a stream, sample by sample.
//!
//! Units: s, Hz, rad (or m), rad/s, N m (or N). Signals are slices of `f64` on a uniform grid of `rate_hz`.
//! Every function that takes data from outside checks that it is finite and returns a typed error if not, so that
//! no result holds a NaN (unless values are so large, beyond some 1e150, that their squares overflow).

pub mod clock;
pub mod constant_speed;
pub mod cutoff;
pub mod difference;
pub mod faults;
pub mod filter;
pub mod frequency;
pub mod harmonics;
pub mod kernel;
pub mod live;
pub mod log;
pub mod mask;
pub mod median;
pub mod periods;
pub mod repetition;
pub mod response;
pub mod savitzky_golay;
pub mod shift;
pub mod signal;
pub mod smoothing;
pub mod spectrum;
pub mod spikes;
pub mod temperature;
pub mod trajectory;
pub mod turns;
pub mod velocity;

pub use clock::{ClockError, ClockReport, ClockSettings, UniformLog};
pub use kernel::Kernel;
pub use log::{Channel, JointSignals, Log, LogError, Portion};
pub use signal::SignalError;
