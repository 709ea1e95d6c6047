//! Streams of samples shared by the tests.

use dynid_online::{Forgetting, Settings};

/// Settings without change detection, prior deviations 10 about zero.
pub(crate) fn plain(columns: usize, rows: usize, forgetting: Forgetting) -> Settings {
    let mut settings = Settings::new(vec![0.0; columns], vec![10.0; columns], rows);
    settings.scale = vec![1.0; columns];
    settings.forgetting = forgetting;
    settings.detection = None;
    settings.reaction = None;
    settings
}

#[track_caller]
pub(crate) fn check_close(what: &str, found: &[f64], expected: &[f64], tolerance: f64) {
    assert_eq!(found.len(), expected.len(), "{what}: length");
    for (i, (f, e)) in found.iter().zip(expected).enumerate() {
        assert!((f - e).abs() <= tolerance * e.abs(), "{what}[{i}]: {f} against {e}");
    }
}
