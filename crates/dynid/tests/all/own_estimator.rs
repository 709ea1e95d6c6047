//! A linear estimator of a program's own, with everything that stands behind the others.

use std::path::Path;

use dynid::config::LogConfig;
use dynid::estimate::Estimate;
use dynid::estimators::groups::ReducedGroup;
use dynid::estimators::linear::{LinearMethod, LinearSettings, OwnEstimator, OwnFit, estimate};
use dynid::io::MappingSpec;
use dynid::settings::{Method, Settings};
use dynid::{Error, Robot, RobotOptions, pipeline};

/// Weighted least squares as a program might write it, by the estimator that there is.
fn by_hand(groups: &[ReducedGroup], columns: usize) -> Option<OwnFit> {
    let found = estimate(groups, None, columns, &LinearMethod::Wls, &LinearSettings::default()).ok()?;
    Some(OwnFit { variances: found.groups.iter().map(|g| g.variance).collect(), x: found.x })
}

fn identify(own: Option<OwnEstimator>, change: impl FnOnce(&mut Settings)) -> Result<Estimate, Error> {
    let example = |name: &str| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/indy7").join(name);
    let robot = Robot::load(&example("robot.toml"), &RobotOptions::default())?;
    let file = LogConfig { path: example("train.csv.gz"), ..LogConfig::default() };
    let log = dynid::logs::load(&file, &robot.axes, &MappingSpec::default(), None)?;
    let settings = Settings::default().with(|s| s.own_estimator = own).with(change);
    Ok(pipeline::identify(&robot, [log], &settings, &mut |_| {})?.estimate())
}

#[test]
fn the_same_estimator_by_hand_has_the_same_values_and_intervals() {
    let usual = identify(None, |_| ()).unwrap();
    let own = identify(Some(OwnEstimator::new("by hand", by_hand)), |_| ()).unwrap();
    assert_eq!(own.provenance.settings["own_estimator"], "by hand");
    for (a, b) in usual.base_parameters.iter().zip(&own.base_parameters) {
        let (Some(p), Some(q), Some(s), Some(t)) = (a.value, b.value, a.std, b.std) else {
            panic!("the log excites everything: {a:?}")
        };
        assert!((p - q).abs() < 1e-9 * s, "{}: {p} {q}", a.name);
        // Weights are found again without every block, which the usual jackknife leaves as they are.
        assert!((s / t - 1.0).abs() < 0.15, "{}: {s} {t}", a.name);
    }
    for (a, b) in usual.parameters.iter().zip(&own.parameters) {
        assert_eq!((&a.name, &a.verdict), (&b.name, &b.verdict));
    }
}

#[test]
fn a_biased_estimator_is_followed_and_not_put_right() {
    // Twice the values: the fit says what that costs, and the interval stands around the own value.
    let twice = |groups: &[ReducedGroup], columns: usize| {
        let fit = by_hand(groups, columns)?;
        Some(OwnFit { x: fit.x.iter().map(|x| 2.0 * x).collect(), ..fit })
    };
    let usual = identify(None, |_| ()).unwrap();
    let own = identify(Some(OwnEstimator::new("twice", twice)), |_| ()).unwrap();
    for (a, b) in usual.base_parameters.iter().zip(&own.base_parameters) {
        let (p, q) = (a.value.unwrap(), b.value.unwrap());
        assert!((q - 2.0 * p).abs() < 1e-9 * (1.0 + p.abs()), "{}: {p} {q}", a.name);
    }
    assert_eq!(own.verdict.status.word(), "fail", "{}", own.verdict.line);
}

#[test]
fn what_no_estimator_returns_is_refused() {
    let refused = |own: OwnEstimator| identify(Some(own), |_| ()).unwrap_err().to_string();
    let none = refused(OwnEstimator::new("silent", |_, _| None));
    assert!(none.contains("`silent` found no fit"), "{none}");
    let short =
        refused(OwnEstimator::new("short", |_, _| Some(OwnFit { x: vec![1.0], variances: Vec::new() })));
    assert!(short.contains("parameters of an own estimator"), "{short}");
    let nan = refused(OwnEstimator::new("nan", |groups, columns| {
        Some(OwnFit { x: vec![f64::NAN; columns], variances: vec![1.0; groups.len()] })
    }));
    assert!(nan.contains("finite numbers"), "{nan}");
    let negative = refused(OwnEstimator::new("negative", |groups, columns| {
        Some(OwnFit { x: vec![0.0; columns], variances: vec![-1.0; groups.len()] })
    }));
    assert!(negative.contains("positive numbers"), "{negative}");
    let beside =
        identify(Some(OwnEstimator::new("by hand", by_hand)), |s| s.estimator.method = Method::Huber);
    assert!(beside.unwrap_err().to_string().contains("none beside an own estimator"));
}
