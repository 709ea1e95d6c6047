//! Start conditions hold for any unknowns; bounds on a grid hold between its samples.

use dynid_excitation::{MotionLimits, Parametrisation, StartConditions};
use dynid_motion::trajectory::FourierBasis;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const NONE: f64 = f64::INFINITY;

fn limits() -> Vec<MotionLimits> {
    let limit =
        |position, velocity, acceleration, jerk| MotionLimits { position, velocity, acceleration, jerk };
    vec![
        limit((-3.0, 3.0), 2.0, 3.0, NONE),
        limit((-0.2, 1.7), 0.1, NONE, 4.0),
        limit((0.5, 0.9), NONE, NONE, NONE),
    ]
}

/// What the map gives is found again; anything else is taken to where the map gives it.
#[test]
fn nearest_unknowns_are_those_of_the_map() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    for posed in [false, true] {
        let pose = posed.then(|| vec![0.3, 1.1, 0.55]);
        let start = StartConditions { rest: true, zero_jerk: true, pose };
        let map = Parametrisation::new(&limits(), 0.6, 5, &start);
        let mut draw = |n: usize| -> Vec<f64> { (0..n).map(|_| rng.random_range(-2.0..=2.0)).collect() };
        let z = draw(map.unknowns());
        let other: Vec<Vec<f64>> = (0..3).map(|_| draw(11)).collect();
        let of_other = map.nearest(&other);
        for (given, wanted) in [(map.coefficients(&z), &z), (map.coefficients(&of_other), &of_other)] {
            let found = map.nearest(&given);
            let worst = found.iter().zip(wanted).map(|(a, b)| (a - b).abs());
            // Unknowns of harmonics that limits hold small are large.
            let unit = wanted.iter().fold(1.0_f64, |m, x| m.max(x.abs()));
            assert!(worst.fold(0.0, f64::max) <= 1e-12 * unit, "{given:?}");
        }
    }
}

#[test]
fn start_conditions_hold_for_any_unknowns() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for base in [0.1, 0.6, 3.0] {
        for harmonics in [3, 5, 9] {
            for (rest, zero_jerk, posed) in [
                (true, false, false),
                (true, true, false),
                (true, true, true),
                (false, false, true),
                (false, true, true),
            ] {
                let pose = posed.then(|| vec![0.3, 1.1, 0.55]);
                let start = StartConditions { rest, zero_jerk, pose: pose.clone() };
                let map = Parametrisation::new(&limits(), base, harmonics, &start);
                let left =
                    2 * harmonics + 1 - 2 * usize::from(rest) - usize::from(zero_jerk) - usize::from(posed);
                assert_eq!(map.unknowns(), 3 * left);
                let basis = FourierBasis::new(base, harmonics, vec![0.0, std::f64::consts::TAU / base]);
                for _ in 0..50 {
                    let z: Vec<f64> = (0..map.unknowns()).map(|_| rng.random_range(-2.0..=2.0)).collect();
                    for (j, x) in map.coefficients(&z).iter().enumerate() {
                        let mut worst = 0.0_f64;
                        for (derivative, held) in [(0, posed), (1, rest), (2, rest), (3, zero_jerk)] {
                            let wanted =
                                if derivative == 0 { pose.as_ref().map_or(0.0, |p| p[j]) } else { 0.0 };
                            let mut values = [0.0; 2];
                            basis.evaluate(derivative, x, &mut values);
                            // Derivatives in units of what the amplitudes can add up to.
                            let reach: f64 =
                                basis.row(derivative, 0).iter().zip(x).map(|(b, x)| (b * x).abs()).sum();
                            if held {
                                let unit = reach.max(1.0);
                                worst = values.iter().fold(worst, |m, v| m.max((v - wanted).abs() / unit));
                            }
                        }
                        assert!(worst <= 1e-12, "{start:?} {harmonics}: {worst:e}");
                    }
                }
            }
        }
    }
}

#[test]
fn unknowns_reach_every_motion_that_meets_the_conditions() {
    let start = StartConditions { rest: true, zero_jerk: true, pose: Some(vec![0.0; 3]) };
    let map = Parametrisation::new(&limits(), 0.5, 5, &start);
    // Unit steps of all unknowns of a coordinate are independent: so many dimensions as there are unknowns.
    let columns = map.range(0).len();
    let image = dynid_linalg::Mat::from_fn(11, columns, |row, k| {
        let mut z = vec![0.0; map.unknowns()];
        z[k] = 1.0;
        map.coefficients(&z)[0][row]
    });
    let sigma = image.singular_values().unwrap();
    assert!(sigma[columns - 1] > 1e-3 * sigma[0], "{sigma:?}");
}

#[test]
fn trigonometric_polynomials_stay_below_the_bound_between_samples() {
    let (harmonics, samples) = (5, 100);
    let bound = FourierBasis::grid_factor(harmonics, samples).unwrap();
    assert!((bound - 1.01247).abs() < 1e-5);
    let grid = FourierBasis::on_period(1.0, harmonics, samples);
    let fine = FourierBasis::on_period(1.0, harmonics, 3100);
    let largest = |basis: &FourierBasis, x: &[f64], out: &mut Vec<f64>| {
        out.resize(basis.times().len(), 0.0);
        basis.evaluate(0, x, out);
        out.iter().fold(0.0_f64, |m, v| m.max(v.abs()))
    };
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let (mut out, mut worst) = (Vec::new(), 0.0_f64);
    for _ in 0..3000 {
        let x: Vec<f64> = (0..11).map(|_| rng.random_range(-1.0..=1.0)).collect();
        let ratio = largest(&fine, &x, &mut out) / largest(&grid, &x, &mut out);
        worst = worst.max(ratio);
    }
    println!("largest ratio {worst:.5} of {bound:.5}");
    assert!(worst <= bound && worst > 1.005, "{worst}");
    // Attained by the highest harmonic, its peaks halfway between two samples.
    let shift = 5.0 * std::f64::consts::PI / 100.0;
    let mut x = vec![0.0; 11];
    (x[5], x[10]) = (shift.sin(), shift.cos());
    let ratio = 1.0 / largest(&grid, &x, &mut out);
    assert!((ratio / bound - 1.0).abs() < 1e-12, "{ratio}");
}
