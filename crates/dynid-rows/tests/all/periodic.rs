//! States of periodic logs against the true ones.
#![expect(clippy::unwrap_used, reason = "in tests a panic is the report")]

use crate::arm::{JOINTS, RATE_HZ, model};
use dynid_model::{BaseParameters, BaseSettings};
use dynid_motion::savitzky_golay::SavitzkyGolay;
use dynid_motion::trajectory::{Fourier, Point};
use dynid_motion::{JointSignals, Log, SignalError};
use dynid_rows::conditioning::{
    ConditioningError, ConditioningSettings, PreparedLog, Smoothing, States, TextbookRoute, prepare,
    textbook_rows,
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const PERIOD: f64 = 8.0;
const NOISE: f64 = 2e-5;

/// Four designed harmonics and a ninth that nobody designed; the last joint rests.
fn series() -> Vec<Fourier> {
    (0..JOINTS)
        .map(|j| {
            let x = 0.1 * (j + 1) as f64;
            let mut a = vec![0.5 - x, 0.3, -0.2 * x, 0.1, 0.0, 0.0, 0.0, 0.0, 1e-4];
            let mut b = vec![0.2, -x, 0.1, 0.05, 0.0, 0.0, 0.0, 0.0, -1e-4];
            if j + 1 == JOINTS {
                a.fill(0.0);
                b.fill(0.0);
            }
            Fourier::plain(std::f64::consts::TAU / PERIOD, 0.3, a, b).unwrap()
        })
        .collect()
}

fn truth(duration: f64) -> Vec<Vec<Point>> {
    let samples = (duration * RATE_HZ) as usize;
    series().iter().map(|s| (0..samples).map(|n| s.at(n as f64 / RATE_HZ)).collect()).collect()
}

fn prepared(duration: f64) -> PreparedLog {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let joints = truth(duration).into_iter().enumerate().map(|(j, points)| {
        let mut noisy = |x: f64| {
            let noise: f64 = StandardNormal.sample(&mut rng);
            x + NOISE * noise
        };
        JointSignals {
            name: format!("j{}", j + 1),
            effort: points.iter().map(|p| noisy(1e4 * p.acceleration + 3.0)).collect(),
            position: points.iter().map(|p| noisy(p.position)).collect(),
            velocity: None,
        }
    });
    let joints = joints.collect();
    let time = (0..(duration * RATE_HZ) as usize).map(|n| n as f64 / RATE_HZ).collect();
    let log = Log::new("run", time, joints, vec![]).unwrap();
    prepare(&log, &model(), &ConditioningSettings::default()).unwrap()
}

/// RMS errors of velocity and acceleration of the first joint away from the ends.
fn errors(states: &States, truth: &[Point]) -> (f64, f64) {
    let inside = 500..5500;
    let rms = |error: &dyn Fn(usize) -> f64| {
        (inside.clone().map(|n| error(n).powi(2)).sum::<f64>() / inside.len() as f64).sqrt()
    };
    let (velocity, acceleration) = (states.velocity(0), states.acceleration(0));
    (rms(&|n| velocity[n] - truth[n].velocity), rms(&|n| acceleration[n] - truth[n].acceleration))
}

#[test]
fn states_are_those_of_the_motion_though_period_and_harmonics_were_not_known() {
    // 3.2 periods, the stated one 0.3 % too long.
    let duration = 25.6;
    let (log, truth) = (prepared(duration), truth(duration));
    let periodic = log.clone().with_period(1.003 * PERIOD).unwrap();
    let motion = periodic.periodic.as_ref().unwrap();
    // Its standard error is some 1e-6 of the period.
    assert!((motion.period_s / PERIOD - 1.0).abs() < 5e-6, "{}", motion.period_s);
    assert_eq!(motion.periods, 3);
    assert_eq!(motion.harmonics, [9, 9, 9, 9, 9, 0]);
    for ratio in &motion.residual_ratio {
        assert!((ratio.unwrap() - 1.0).abs() < 0.1, "{ratio:?}");
    }
    assert_eq!(periodic.usable.iter().filter(|u| **u).count(), 6000);

    let settings = ConditioningSettings::default();
    let usual = errors(&States::new(&log, 20.0, &settings).unwrap(), &truth[0]);
    let states = States::new(&periodic, 20.0, &settings).unwrap();
    let exact = errors(&states, &truth[0]);
    // Nine harmonics of 6000 samples hold 18/6000 of the noise, and none beyond 1.1 Hz.
    assert!(exact.0 < 0.05 * usual.0 && exact.1 < 0.005 * usual.1, "{usual:?} {exact:?}");
    // What noise leaves in the velocity is what is said of it.
    let said = states.velocity_sigma[0];
    assert!(exact.0 < 3.0 * said && exact.0 > said / 3.0, "{} {said}", exact.0);
    assert_eq!(states.effort, States::new(&log, 20.0, &settings).unwrap().effort);
}

#[test]
fn gaps_do_not_count() {
    let mut log = prepared(25.6);
    for n in 2000..2200 {
        log.usable[n] = false;
        log.position.iter_mut().for_each(|q| q[n] += 0.3);
    }
    let motion = log.with_period(PERIOD).unwrap().periodic.unwrap();
    assert!((motion.period_s / PERIOD - 1.0).abs() < 5e-6);
    assert!(motion.residual_ratio.iter().all(|r| (r.unwrap() - 1.0).abs() < 0.1));
    assert_eq!(motion.harmonics[..5], [9; 5]);
}

#[test]
fn other_periods_are_refused() {
    let log = prepared(25.6);
    for period in [26.0, f64::NAN, -1.0, 0.0, 7.0 / RATE_HZ] {
        let error = log.clone().with_period(period).unwrap_err();
        assert!(matches!(error, ConditioningError::ShorterThanPeriod { .. }), "{period}: {error}");
    }
    let error = log.with_period(1.02 * PERIOD).unwrap_err();
    assert!(matches!(error, ConditioningError::OtherPeriod { .. }), "{error}");
}

#[test]
fn every_smoothing_has_the_velocity_noise_that_it_says() {
    let (log, truth) = (prepared(24.0).with_period(PERIOD).unwrap(), truth(24.0));
    let smoothings = [
        Smoothing::FivePoint { passes: 1 },
        Smoothing::FivePoint { passes: 6 },
        Smoothing::SavitzkyGolay(SavitzkyGolay::new(5, 3).unwrap()),
        Smoothing::SavitzkyGolay(SavitzkyGolay::new(15, 4).unwrap()),
    ];
    for smoothing in smoothings {
        let settings = ConditioningSettings { smoothing, ..ConditioningSettings::default() };
        let states = States::of_motion(&log, 10.0, &settings).unwrap();
        let (velocity, _) = errors(&states, &truth[0]);
        let ratio = velocity / states.velocity_sigma[0];
        // Slow motion leaves noise alone. The noise found has a few per cent of error, and errors of 5000 neighbouring velocities that
        // share their noise the like.
        assert!((ratio - 1.0).abs() < 0.1, "{smoothing:?}: {ratio}");
    }
    let exact = Smoothing::Frequency { harmonics: Some(9) };
    let settings = ConditioningSettings { smoothing: exact, ..ConditioningSettings::default() };
    let states = States::of_motion(&log, 10.0, &settings).unwrap();
    let (velocity, _) = errors(&states, &truth[0]);
    let ratio = velocity / states.velocity_sigma[0];
    // 18 amplitudes decide: their mean square has a relative deviation of √(2/18), most of it in the last few.
    assert!(ratio > 0.3 && ratio < 2.0, "{ratio}");
}

#[test]
fn series_end_at_the_harmonic_or_cut_off_that_is_asked_for() {
    let log = prepared(24.0).with_period(PERIOD).unwrap();
    let states = |harmonics, cutoff_hz| {
        let smoothing = Smoothing::Frequency { harmonics };
        let settings = ConditioningSettings { smoothing, ..ConditioningSettings::default() };
        States::of_motion(&log, cutoff_hz, &settings)
    };
    let asked = states(Some(4), 10.0).unwrap();
    // The corrected period differs from 8 s by far less than 1 in 1000.
    let cut = states(None, 4.01 / PERIOD).unwrap();
    assert_eq!(asked.velocity(0), cut.velocity(0));
    let more = states(Some(9), 10.0).unwrap();
    assert_ne!(asked.velocity(0), more.velocity(0));
    let fault = states(None, 0.5 / PERIOD).unwrap_err();
    assert!(
        matches!(fault, ConditioningError::Signal(SignalError::Setting { name: "harmonics", .. })),
        "{fault}"
    );
    let none = prepared(24.0);
    let smoothing = Smoothing::Frequency { harmonics: Some(4) };
    let route = TextbookRoute { smoothing, ..TextbookRoute::default() };
    let model = model();
    let base = BaseParameters::of(&model, model.mechanism(), &[], &BaseSettings::default());
    let settings = ConditioningSettings::default();
    let rows = |log: &PreparedLog| {
        textbook_rows(&model, &[], &base.kept, std::slice::from_ref(log), &route, &settings)
    };
    assert!(matches!(rows(&none), Err(ConditioningError::NoPeriod { .. })));
    assert!(rows(&log).is_ok());
}

#[test]
fn averages_have_less_noise_and_tell_it() {
    let log = prepared(26.0);
    let mean = log.clone().averaged(PERIOD, &ConditioningSettings::default().noise).unwrap();
    let told = mean.averaged.as_ref().unwrap();
    assert_eq!((told.periods, mean.samples()), (3, (PERIOD * RATE_HZ) as usize));
    for (deviation, noise) in told.position_deviation.iter().zip(&mean.position_noise) {
        // 4000 degrees of freedom: a deviation of 1.1 %. The floor of the spectrum has a few per cent.
        assert!((deviation / NOISE - 1.0).abs() < 0.05, "{deviation}");
        assert!((noise.sigma * 3.0_f64.sqrt() / NOISE - 1.0).abs() < 0.15, "{}", noise.sigma);
    }
    for ratio in &told.scatter_ratio {
        assert!((ratio.unwrap() - 1.0).abs() < 0.15, "{ratio:?}");
    }
    // Of a motion that does not repeat so the scatter says that the mean is no motion of the robot.
    let wrong = log.clone().averaged(PERIOD + 1.0, &ConditioningSettings::default().noise).unwrap();
    let ratios = wrong.averaged.unwrap().scatter_ratio;
    // The last joint stands, which repeats whatever the period.
    let (still, moving) = ratios.split_last().unwrap();
    assert!(moving.iter().all(|ratio| ratio.unwrap() > 1000.0) && still.unwrap() < 1.2, "{ratios:?}");
    let periodic = mean.with_period(PERIOD).unwrap();
    // Whole samples of a rate that is the median of rounded steps of the time.
    assert!((periodic.periodic.unwrap().period_s / PERIOD - 1.0).abs() < 1e-12);

    let noise = ConditioningSettings::default().noise;
    let fault = |period: f64| log.clone().averaged(period, &noise).unwrap_err();
    for period in [13.1, 30.0, 0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(fault(period), ConditioningError::FewPeriods { .. }), "{period}: {}", fault(period));
    }
    assert!(matches!(fault(PERIOD + 0.1 / RATE_HZ), ConditioningError::PeriodOffGrid { .. }));
}
