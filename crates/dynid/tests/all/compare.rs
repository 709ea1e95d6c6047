//! All estimators on the example's log.

use std::path::PathBuf;

use dynid::Config;
use dynid::compare::{FOLDS, compare};

#[test]
fn estimators_are_ranked_on_time_they_did_not_see() {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../examples/indy7/identify.toml");
    let config = Config::read(&path).unwrap();
    let mut fits = 0;
    let found = compare(&config, &mut |_, _, _| fits += 1).unwrap();
    assert!(fits >= FOLDS * found.estimators.len());
    let names: Vec<&str> = found.estimators.iter().map(|e| e.name.as_str()).collect();
    for name in ["textbook", "ols", "wls", "huber", "tukey", "ridge", "consistent", "separable", "search: de"]
    {
        assert!(names.contains(&name), "{name} is not in {names:?}");
    }
    assert!(!names.contains(&"tls") && !names.contains(&"iv"), "{names:?}");
    let errors: Vec<f64> = found.estimators.iter().map(|e| e.error.unwrap()).collect();
    assert!(errors.windows(2).all(|w| w[0] <= w[1]), "{errors:?}");
    let at = |name: &str| &found.estimators[names.iter().position(|n| *n == name).unwrap()];
    // Noise of 1 % on the effort and friction that the model has: the textbook route alone is worse.
    assert!(at("wls").error.unwrap() < 1.0, "{errors:?}");
    assert!(at("textbook").error.unwrap() > 1.5 * at("wls").error.unwrap(), "{errors:?}");
    let [behind, spread] = found.estimators[0].behind.unwrap();
    assert!(behind == 0.0 && spread == 0.0);
    assert!(found.estimators.iter().all(|e| e.joints.len() == 6 && e.failure.is_none()));
    assert!(found.report().unwrap().contains("Comparison of estimators"));
}

#[test]
#[ignore = "half a minute"]
fn the_same_errors_come_out_again() {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../examples/indy7/identify.toml");
    let config = Config::read(&path).unwrap();
    let [found, again] = [(), ()].map(|()| compare(&config, &mut |_, _, _| {}).unwrap());
    let same = |a: &dynid::compare::ComparedEstimator, b: &dynid::compare::ComparedEstimator| {
        a.name == b.name && a.error == b.error && a.joints == b.joints
    };
    assert!(found.estimators.iter().zip(&again.estimators).all(|(a, b)| same(a, b)));
}
