//! Settings and samples that are refused.

use crate::modes::all_modes;
use crate::stream::{Stream, plain};
use dynid_online::{
    DetectionSettings, Estimator, FalseAlarms, Forgetting, MonitorSettings, ReactionSettings, RowNoise,
    SampleError, Settings, SettingsError, Whiteness,
};

#[test]
fn a_refused_sample_changes_nothing() {
    for (name, settings) in all_modes(3, 2) {
        let mut estimator = Estimator::new(settings).unwrap();
        let mut stream = Stream::new(1, &[1.0, 2.0, -1.0], 2, 0.3);
        stream.feed_all(&mut estimator, 70);
        let before = (estimator.save(), estimator.x().to_vec());
        let phi = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
        let with = |place: usize, value: f64| {
            let mut list = phi;
            list[place] = value;
            list
        };
        let std = RowNoise::Std(&[0.3, 0.3]);
        let not_finite = |what, index| SampleError::NotFinite { what, index };
        let cases: Vec<(Result<_, _>, SampleError)> = vec![
            (estimator.step(&with(4, f64::NAN), &[1.0, 2.0], std), not_finite("regressor", 4)),
            (estimator.step(&with(0, f64::INFINITY), &[1.0, 2.0], std), not_finite("regressor", 0)),
            (estimator.step(&with(2, 1e200), &[1.0, 2.0], std), not_finite("regressor", 2)),
            (estimator.step(&phi, &[1.0, f64::NAN], std), not_finite("effort", 1)),
            (estimator.step(&phi, &[1e300, 2.0], std), not_finite("effort", 0)),
            (
                estimator.step(&phi, &[1.0, 2.0], RowNoise::Std(&[0.3, f64::NAN])),
                not_finite("row deviations", 1),
            ),
            (estimator.step(&phi, &[1.0, 2.0], RowNoise::Std(&[0.3, 0.0])), SampleError::Noise { row: 1 }),
            (estimator.step(&phi, &[1.0, 2.0], RowNoise::Std(&[-0.3, 1.0])), SampleError::Noise { row: 0 }),
            (
                estimator.step(&phi, &[1.0, 2.0], RowNoise::Covariance(&[1.0, 2.0, 2.0, 1.0])),
                SampleError::Noise { row: 1 },
            ),
            (estimator.step(&phi, &[], std), SampleError::Rows { most: 2, found: 0 }),
            (estimator.step(&phi, &[1.0; 3], std), SampleError::Rows { most: 2, found: 3 }),
            (
                estimator.step(&phi[..5], &[1.0, 2.0], std),
                SampleError::Length { what: "regressor", expected: 6, found: 5 },
            ),
            (
                estimator.step(&phi, &[1.0, 2.0], RowNoise::Std(&[1.0])),
                SampleError::Length { what: "row deviations", expected: 2, found: 1 },
            ),
            (
                estimator.step(&phi, &[1.0, 2.0], RowNoise::Covariance(&[1.0; 3])),
                SampleError::Length { what: "row covariance", expected: 4, found: 3 },
            ),
        ];
        for (found, expected) in cases {
            assert_eq!(found.unwrap_err(), expected, "{name}");
            assert!(!expected.to_string().is_empty());
        }
        assert_eq!((estimator.save(), estimator.x().to_vec()), before, "{name}");
    }
}

#[test]
fn extreme_but_finite_samples_leave_a_finite_state() {
    for (name, settings) in all_modes(3, 2) {
        let mut estimator = Estimator::new(settings).unwrap();
        let mut stream = Stream::new(2, &[1.0, 2.0, -1.0], 2, 0.3);
        for k in 0..400 {
            let (mut phi, mut effort) = stream.sample();
            let size = [1.0, 1e60, 1e-60, 1e-200, 1e74, 0.0][k % 6];
            phi.iter_mut().for_each(|v| *v *= size / 10.0);
            effort[k % 2] *= [1.0, 1e70, 1e-300][k % 3];
            let step = estimator.step(&phi, &effort, RowNoise::Std(&[1.0, 1.0]));
            let ok = step.is_ok_and(|s| s.normalised_square.is_finite() && s.statistic.is_finite());
            assert!(ok, "{name} {k}: {step:?}");
            assert!(estimator.x().iter().all(|x| x.is_finite()), "{name} {k}");
        }
        let mut std = [0.0; 3];
        estimator.std(&mut std);
        assert!(std.iter().all(|s| s.is_finite()), "{name} {std:?}");
    }
}

#[test]
fn settings_without_meaning_are_refused() {
    let base = || plain(2, 1, Forgetting::None);
    let refused = |change: &dyn Fn(&mut Settings)| {
        let mut settings = base();
        change(&mut settings);
        let error = Estimator::new(settings).unwrap_err();
        assert!(!error.to_string().is_empty());
        error
    };
    let name = |error: SettingsError| match error {
        SettingsError::Number { what, .. } | SettingsError::Length { what, .. } => what,
        SettingsError::Combination { .. } => "combination",
        _ => "other",
    };
    let number = |change: &dyn Fn(&mut Settings), expected: &str| assert_eq!(name(refused(change)), expected);
    number(&|s| s.start.clear(), "number of parameters");
    number(&|s| s.rows = 0, "rows per sample");
    number(&|s| s.prior_std = vec![1.0], "prior deviations");
    number(&|s| s.prior_std[1] = 0.0, "prior deviations");
    number(&|s| s.scale[0] = f64::NAN, "scales");
    number(&|s| s.start[0] = f64::INFINITY, "start");
    number(&|s| s.scale[0] = 1e-200, "prior deviation in scales");
    for lambda in [0.0, -1.0, 1.1, f64::NAN] {
        number(&|s| s.forgetting = Forgetting::Constant { lambda }, "λ");
        number(&|s| s.forgetting = Forgetting::Directional { lambda, tolerance: 0.0 }, "λ");
    }
    number(&|s| s.forgetting = Forgetting::ErrorDriven { alpha: 1.0, beta: -1.0, floor: 1.0 }, "α");
    number(&|s| s.forgetting = Forgetting::ErrorDriven { alpha: 0.1, beta: 1.0, floor: 1.0 }, "β");
    number(
        &|s| s.forgetting = Forgetting::ErrorDriven { alpha: 0.1, beta: -1.0, floor: 0.0 },
        "floor of efforts",
    );
    number(
        &|s| s.forgetting = Forgetting::NoiseNormalised { alpha: 0.1, beta: -1.0, dead_zone: 0.0 },
        "dead zone",
    );
    number(&|s| s.forgetting = Forgetting::Drift { rate: vec![1.0], interval: 1.0 }, "rates of drift");
    number(
        &|s| s.forgetting = Forgetting::Drift { rate: vec![1.0; 2], interval: 0.0 },
        "time between samples",
    );
    number(&|s| s.forgetting = Forgetting::BlockWindow { samples: 10, blocks: 3 }, "samples of the window");
    number(&|s| s.forgetting = Forgetting::RowWindow { samples: 10, blocks: 0 }, "blocks of the window");
    number(&|s| s.bounded_covariance = Some(-1.0), "least information");
    number(&|s| s.bounded_covariance = Some(1.0), "combination");
    number(
        &|s| {
            s.monitor = Some(MonitorSettings::default());
            s.forgetting = Forgetting::BlockWindow { samples: 10, blocks: 2 };
        },
        "combination",
    );
    number(&|s| s.reaction = Some(ReactionSettings::default()), "combination");
    number(
        &|s| {
            s.detection = Some(DetectionSettings::default());
            s.reaction = Some(ReactionSettings::default());
            s.forgetting = Forgetting::RowWindow { samples: 10, blocks: 2 };
        },
        "combination",
    );
    let detection = |change: &dyn Fn(&mut DetectionSettings), expected: &str| {
        number(
            &|s| {
                let mut detection = DetectionSettings::default();
                change(&mut detection);
                s.detection = Some(detection);
            },
            expected,
        );
    };
    detection(&|d| d.kappa = 1.0, "κ");
    detection(&|d| d.clip = 0.0, "clip");
    detection(&|d| d.false_alarms = FalseAlarms::RunLength(1.0), "run length");
    detection(&|d| d.false_alarms = FalseAlarms::Rate { rate: 1.0, samples: 10.0 }, "rate of false alarms");
    detection(&|d| d.false_alarms = FalseAlarms::Threshold(-1.0), "threshold");
    detection(&|d| d.whiteness = Whiteness::Every(0), "samples per sample used");
    detection(&|d| d.whiteness = Whiteness::Learned { samples: 10 }, "samples to learn from");
    let mut windowed =
        Estimator::new(plain(2, 1, Forgetting::BlockWindow { samples: 10, blocks: 2 })).unwrap();
    assert!(windowed.reset().is_err() && windowed.open(0, 1.0).is_err());
    let mut recursive = Estimator::new(base()).unwrap();
    assert!(recursive.open(2, 1.0).is_err() && recursive.open(0, f64::NAN).is_err());
}
