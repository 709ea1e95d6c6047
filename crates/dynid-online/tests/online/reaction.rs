//! Changes are found, named and followed.

use crate::stream::{Stream, check_close, plain, white};
use dynid_online::{
    DetectionSettings, Estimator, FalseAlarms, Forgetting, Reaction, ReactionSettings, Settings,
};

const TRUTH: [f64; 5] = [10.0, -5.0, 6.0, 8.0, 5.0];

fn settings(detection: DetectionSettings) -> Settings {
    let mut settings = plain(5, 2, Forgetting::None);
    settings.scale = vec![10.0, 5.0, 6.0, 8.0, 5.0];
    settings.detection = Some(detection);
    settings.reaction = Some(ReactionSettings::default());
    settings
}

/// 5000 samples, a change, 3000 samples more: alarm and reaction with their samples, the error of the
/// estimate at the end.
fn run(
    settings: Settings,
    seed: u64,
    change: &[(usize, f64)],
    sigma: f64,
) -> (Vec<u64>, Vec<Reaction>, Vec<f64>) {
    let mut estimator = Estimator::new(settings).unwrap();
    let mut stream = Stream::new(seed, &TRUTH, 2, sigma);
    let (mut alarms, mut reactions) = (Vec::new(), Vec::new());
    for k in 0..8000 {
        if k == 5000 {
            change.iter().for_each(|(j, factor)| stream.truth[*j] *= factor);
        }
        let step = stream.feed(&mut estimator);
        if step.alarm {
            alarms.push(step.sample);
        }
        reactions.extend(step.reaction);
    }
    let error = estimator.x().iter().zip(&stream.truth).map(|(x, t)| x / t - 1.0).collect();
    (alarms, reactions, error)
}

#[test]
fn a_jump_is_found_and_its_parameter_named() {
    let wanted = white(FalseAlarms::Rate { rate: 0.001, samples: 1e6 });
    for detection in [wanted, DetectionSettings::default()] {
        for (seed, j) in (0..5).enumerate() {
            let (alarms, reactions, error) = run(settings(detection), seed as u64, &[(j, 0.85)], 0.5);
            assert_eq!(alarms.len(), 1, "{alarms:?}");
            let reaction = reactions[0];
            println!("parameter {j}: alarm {} samples after the change, {reaction:?}", alarms[0] - 5000);
            assert!((5000..5400).contains(&alarms[0]), "{alarms:?}");
            assert!(reaction.confirmed && reaction.parameter == Some(j), "{reaction:?}");
            assert!((reaction.jump / (-0.15 * TRUTH[j]) - 1.0).abs() < 0.3, "{reaction:?}");
            assert!(error.iter().all(|e| e.abs() < 0.05), "{error:?}");
        }
    }
}

/// Half a deviation raises the mean square by a quarter: just above what `κ = 1.5` can ever find, found by
/// `κ = 1.1`.
#[test]
fn small_jumps_need_a_small_ratio() {
    let wanted = FalseAlarms::Rate { rate: 0.001, samples: 1e6 };
    let patient = DetectionSettings { kappa: 1.1, ..white(wanted) };
    let sigma = 0.15 * TRUTH[4] / 0.5;
    let (alarms, reactions, _) = run(settings(patient), 3, &[(4, 0.85)], sigma);
    println!("alarms {alarms:?}, {reactions:?}");
    assert_eq!(alarms.len(), 1, "{alarms:?}");
    assert!((5000..8000).contains(&alarms[0]));
    assert_eq!(reactions[0].parameter, Some(4));
}

#[test]
fn a_change_of_many_parameters_is_named_after_none() {
    let wanted = white(FalseAlarms::Rate { rate: 0.001, samples: 1e6 });
    let change = [(0, 0.9), (1, 1.2), (2, 0.8), (3, 0.9)];
    let (alarms, reactions, error) = run(settings(wanted), 7, &change, 0.3);
    assert_eq!(alarms.len(), 1, "{alarms:?}");
    assert!(reactions[0].confirmed && reactions[0].parameter.is_none(), "{:?}", reactions[0]);
    assert!(error.iter().all(|e| e.abs() < 0.02), "{error:?}");
}

/// A threshold so low that alarms come all the time: nothing is opened, and the estimate stays that of all
/// samples.
#[test]
fn false_alarms_do_no_harm() {
    let mut nervous = settings(white(FalseAlarms::Threshold(1.0)));
    nervous.reaction =
        Some(ReactionSettings { samples: 20, level: 0.05, named_level: 1e-9, ..ReactionSettings::default() });
    let (alarms, reactions, _) = run(nervous, 8, &[], 1.0);
    let confirmed = reactions.iter().filter(|r| r.confirmed).count();
    println!("{} alarms, {confirmed} confirmed", alarms.len());
    assert!(alarms.len() > 50);
    // One in twenty is confirmed by chance; 4.75 binomial deviations more.
    let n = reactions.len() as f64;
    assert!((confirmed as f64) < 0.05 * n + 4.75 * (0.0475 * n).sqrt(), "{confirmed} of {n}");
    let mut with = Estimator::new(settings(white(FalseAlarms::Threshold(6.0)))).unwrap();
    let mut without = Estimator::new(plain(5, 2, Forgetting::None)).unwrap();
    let (mut a, mut b) = (Stream::new(9, &TRUTH, 2, 1.0), Stream::new(9, &TRUTH, 2, 1.0));
    let mut reactions = Vec::new();
    for _ in 0..20_000 {
        reactions.extend(a.feed(&mut with).reaction);
        b.feed(&mut without);
    }
    assert!(!reactions.is_empty() && reactions.iter().all(|r| !r.confirmed), "{reactions:?}");
    check_close("estimate", with.x(), without.x(), 1e-11);
}
