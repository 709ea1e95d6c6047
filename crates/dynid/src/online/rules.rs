//! From the configuration to the settings of the recursive estimator.

use dynid_estimate::online::{DetectionSettings, FalseAlarms, Forgetting, Settings, Whiteness};

use super::asked::Asked;
use super::learning::Learned;
use crate::config::ForgettingRule;

/// Published forgetting (Sun et al., Eq. 44 and below).
const ALPHA: f64 = 0.05;
const BETA: f64 = -4.68;
/// Efforts below this share of the largest count as this large in relative errors.
const EFFORT_FLOOR: f64 = 0.05;
/// Prediction errors beyond this many deviations forget, with `noise-normalised`.
const DEAD_ZONE: f64 = 3.0;
/// Directions that are excited by less than this share are not forgotten.
const DIRECTION_TOLERANCE: f64 = 1e-6;
/// Squares of innovations are clipped here. Rows are means over the kernel, so single outliers are small in them already.
const CLIP: f64 = 100.0;
/// Blocks of a window.
const BLOCKS: usize = 20;
/// What parameters wander in the memory, as a share of their prior deviation.
const WANDERING: f64 = 0.1;

/// Settings for `rows` outputs, rows `spacing_s` apart; `armed`: with change detection.
pub(super) fn settings(
    asked: &Asked,
    learned: &Learned,
    rows: usize,
    spacing_s: f64,
    armed: bool,
) -> Settings {
    let online = &asked.online;
    let lambda = (-spacing_s / online.memory_s).exp();
    let largest = learned.efforts.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    let samples = ((online.memory_s / spacing_s / BLOCKS as f64).ceil().max(1.0)) as usize * BLOCKS;
    let forgetting = match online.forgetting {
        ForgettingRule::None => Forgetting::None,
        ForgettingRule::Constant => Forgetting::Constant { lambda },
        ForgettingRule::Directional => Forgetting::Directional { lambda, tolerance: DIRECTION_TOLERANCE },
        ForgettingRule::ErrorDriven => {
            Forgetting::ErrorDriven { alpha: ALPHA, beta: BETA, floor: EFFORT_FLOOR * largest }
        }
        ForgettingRule::NoiseNormalised => {
            Forgetting::NoiseNormalised { alpha: ALPHA, beta: BETA, dead_zone: DEAD_ZONE }
        }
        ForgettingRule::Window => Forgetting::BlockWindow { samples, blocks: BLOCKS },
        ForgettingRule::Drift => Forgetting::Drift {
            rate: learned.prior_std.iter().map(|s| WANDERING * s / online.memory_s.sqrt()).collect(),
            interval: spacing_s,
        },
    };
    let discounts = matches!(
        online.forgetting,
        ForgettingRule::Constant | ForgettingRule::ErrorDriven | ForgettingRule::NoiseNormalised
    );
    let hours = online.false_alarm_hours * 3600.0 / spacing_s;
    let detection = DetectionSettings {
        false_alarms: FalseAlarms::Rate { rate: online.false_alarm_rate, samples: hours.max(1.0) },
        whiteness: Whiteness::Every(learned.innovations.every),
        clip: CLIP,
        ..DetectionSettings::default()
    };
    Settings {
        forgetting,
        bounded_covariance: discounts.then_some(1.0),
        detection: (armed && online.alarms).then_some(detection),
        reaction: None,
        ..Settings::new(learned.start.clone(), learned.prior_std.clone(), rows)
    }
}
