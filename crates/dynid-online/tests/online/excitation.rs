//! What the monitor sees, and what it keeps.

use crate::stream::{normals, plain, random};
use dynid_online::{Estimator, ExcitationMonitor, Forgetting, MonitorSettings, RowNoise};

/// Viscous and Coulomb friction and an inertia, one sample.
fn friction(speed: f64, acceleration: f64) -> [f64; 3] {
    [speed, speed.signum(), acceleration]
}

#[test]
fn one_speed_excites_neither_of_two_frictions() {
    let mut monitor = ExcitationMonitor::new(&[1.0; 3], 200, 1);
    let mut random = random(1);
    for k in 0..200 {
        let u = normals(&mut random, 2);
        let [a, b, c] = friction(if k % 2 == 0 { 0.5 } else { -0.5 }, u[0]);
        monitor.push(&[10.0 * a, 10.0 * b, 10.0 * c, u[1]]);
    }
    assert_eq!(monitor.frozen(), [true, true, false], "{:?}", monitor.information());
    for k in 0..200 {
        let u = normals(&mut random, 2);
        let [a, b, c] = friction(if k % 2 == 0 { 0.5 } else { -2.0 }, u[0]);
        monitor.push(&[10.0 * a, 10.0 * b, 10.0 * c, u[1]]);
    }
    assert_eq!(monitor.frozen(), [false, false, false], "{:?}", monitor.information());
}

/// Ten thousand samples at one speed, memory of 100: the frozen pair keeps its covariance, the rest forgets.
#[test]
fn frozen_parameters_keep_their_joint_covariance() {
    let run = |monitor: Option<MonitorSettings>| {
        let mut settings = plain(3, 1, Forgetting::Constant { lambda: 0.99 });
        settings.monitor = monitor;
        let mut estimator = Estimator::new(settings).unwrap();
        let mut random = random(2);
        let (mut kept, mut covariance) = (vec![0.0; 9], vec![0.0; 9]);
        for k in 0..11_000 {
            let u = normals(&mut random, 3);
            let speed = if k < 1000 { u[0] } else { 0.5 };
            let phi = friction(speed, u[1]);
            let effort = 3.0 * phi[0] + 2.0 * phi[1] + 0.5 * phi[2] + 0.1 * u[2];
            estimator.step(&phi, &[effort], RowNoise::Std(&[0.1])).unwrap();
            if k == 1499 {
                estimator.covariance(&mut kept);
            }
        }
        estimator.covariance(&mut covariance);
        (kept, covariance, estimator.x().to_vec())
    };
    let (_, plain_covariance, _) = run(None);
    assert!(plain_covariance[0] > 1e3, "{plain_covariance:?}");
    let settings = MonitorSettings { samples: 100, share: 1.0 };
    let (kept, covariance, x) = run(Some(settings));
    // Frozen since sample 1100 at the latest; samples since then can only have added information.
    for j in [0, 1] {
        assert!(covariance[4 * j] <= kept[4 * j] * (1.0 + 1e-9), "{covariance:?} {kept:?}");
    }
    // The inertia still forgets: about 50 samples' worth of information in it.
    assert!(covariance[8] > 0.01 / 200.0, "{covariance:?}");
    assert!((x[0] - 3.0).abs() < 1.0 && (x[2] - 0.5).abs() < 0.1, "{x:?}");
}

#[test]
fn without_excitation_nothing_is_forgotten() {
    let mut settings = plain(3, 1, Forgetting::Constant { lambda: 0.9 });
    settings.monitor = Some(MonitorSettings { samples: 20, share: 1.0 });
    let mut estimator = Estimator::new(settings).unwrap();
    let mut random = random(3);
    let mut feed = |estimator: &mut Estimator, size: f64| {
        let phi: Vec<f64> = normals(&mut random, 3).iter().map(|v| size * v).collect();
        estimator.step(&phi, &[phi.iter().sum()], RowNoise::Std(&[0.1])).unwrap()
    };
    for _ in 0..100 {
        feed(&mut estimator, 1.0);
    }
    for _ in 0..40 {
        feed(&mut estimator, 0.0);
    }
    let before = estimator.information().clone();
    for _ in 0..1000 {
        assert_eq!(feed(&mut estimator, 0.0).frozen, 3);
    }
    for (i, j) in [(0, 0), (0, 2), (1, 2), (2, 2)] {
        assert_eq!(estimator.information().r(i, j), before.r(i, j));
    }
}
