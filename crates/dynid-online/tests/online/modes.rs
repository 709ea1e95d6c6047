//! Settings of every kind.

use crate::stream::{plain, white};
use dynid_online::{
    DetectionSettings, FalseAlarms, Forgetting, MonitorSettings, ReactionSettings, Settings, Whiteness,
};

/// Every kind of forgetting, with all that can be combined with it.
pub(crate) fn all_modes(p: usize, rows: usize) -> Vec<(&'static str, Settings)> {
    let kinds = [
        ("none", Forgetting::None),
        ("constant", Forgetting::Constant { lambda: 0.99 }),
        ("error-driven", Forgetting::ErrorDriven { alpha: 0.05, beta: -4.68, floor: 0.5 }),
        ("noise-normalised", Forgetting::NoiseNormalised { alpha: 0.05, beta: -4.68, dead_zone: 1.0 }),
        ("directional", Forgetting::Directional { lambda: 0.99, tolerance: 1e-6 }),
        ("drift", Forgetting::Drift { rate: vec![0.1; p], interval: 0.01 }),
        ("block window", Forgetting::BlockWindow { samples: 60, blocks: 6 }),
        ("row window", Forgetting::RowWindow { samples: 60, blocks: 6 }),
    ];
    let mut modes = Vec::new();
    for (name, forgetting) in kinds {
        let window = name.ends_with("window");
        let mut settings = plain(p, rows, forgetting.clone());
        modes.push((name, settings.clone()));
        settings.detection = Some(DetectionSettings {
            whiteness: Whiteness::Learned { samples: 50 },
            ..white(FalseAlarms::Threshold(3.0))
        });
        if !window {
            settings.reaction = Some(ReactionSettings { samples: 30, ..ReactionSettings::default() });
        }
        if !window && name != "directional" {
            settings.monitor = Some(MonitorSettings { samples: 25, share: 100.0 });
        }
        if matches!(name, "constant" | "error-driven" | "noise-normalised") {
            settings.bounded_covariance = Some(1.0);
        }
        modes.push((name, settings));
    }
    modes
}
