//! Friction laws from points of constant-speed tests made from the closed form.

use dynid_friction::steady_friction::{
    LawForm, SteadyError, SteadyPoint, SteadySettings, ViscousForm, analyse,
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// `F_c, F_s, v_s` and value at 0 °C with slope of `σ2, σ3, σ4`.
struct Truth {
    fc: f64,
    fs: f64,
    vs: f64,
    sigma: [(f64, f64); 3],
}

const J1: Truth = Truth {
    fc: 9.1,
    fs: 11.83,
    vs: 0.04,
    sigma: [(63.818, -1.00172), (1.0267, 0.013333), (0.7589, 0.004444)],
};
const J3: Truth = Truth {
    fc: 2.5,
    fs: 3.25,
    vs: 0.05,
    sigma: [(13.049, -0.19429), (1.1267, 0.013333), (0.7589, 0.004444)],
};
const TEMPERATURES: [f64; 7] = [19.0, 25.0, 30.0, 35.0, 40.0, 45.0, 51.0];

impl Truth {
    fn friction(&self, v: f64, t: f64) -> f64 {
        let [s2, s3, s4] = self.sigma.map(|(value, slope)| value + slope * t);
        self.fc
            + (self.fs - self.fc) * (-(v / self.vs).powi(2)).exp()
            + s2 * (1.0 - (-(s3 * v).powf(s4)).exp())
    }

    /// Points with noise of standard deviation `std`, which they state.
    fn points(&self, speeds: &[f64], temperatures: &[f64], std: f64, seed: u64) -> Vec<SteadyPoint> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let mut points = Vec::new();
        for t in temperatures {
            for v in speeds {
                // Joints warm up during a test; a single test is held at its temperature here.
                let temperature = if temperatures.len() > 1 { t + 0.5 * normal() } else { *t };
                points.push(SteadyPoint {
                    speed: *v,
                    temperature: Some(temperature),
                    friction: self.friction(*v, temperature) + std * normal(),
                    std,
                });
            }
        }
        points
    }
}

fn geometric(low: f64, high: f64, count: u32) -> Vec<f64> {
    (0..count).map(|k| low * (high / low).powf(f64::from(k) / f64::from(count - 1))).collect()
}

#[test]
fn the_curve_is_found_over_speed_and_temperature_and_lines_cover_the_truth() {
    for (truth, std) in [(&J1, 0.05), (&J3, 0.02)] {
        let (mut covered, mut all) = (0, 0);
        for seed in 0..8 {
            let found = analyse(
                &truth.points(&geometric(0.01, 2.4, 16), &TEMPERATURES, std, seed),
                &SteadySettings::default(),
            )
            .unwrap();
            assert_eq!(found.law.coefficients.len(), 9, "{:?}", found.law.form);
            let (mut worst, mut peak) = (0.0_f64, 0.0_f64);
            for t in (0..=32).map(|k| 19.0 + f64::from(k)) {
                for v in geometric(0.02, 2.4, 60) {
                    let exact = truth.friction(v, t);
                    worst = worst.max((found.law.friction(&[v], &[t])[0] - exact).abs());
                    peak = peak.max(exact);
                }
            }
            assert!(worst < 0.03 * peak, "seed {seed}: {worst} of {peak}");
            assert_eq!((found.levels.len(), found.lines.len()), (7, 3), "{:?}", found.notes);
            for (line, (value, slope)) in found.lines.iter().zip(truth.sigma) {
                let exact = value + 25.0 * slope;
                covered += usize::from((line.at(25.0) - exact).abs() < line.half_width(25.0));
                covered += usize::from((line.slope - slope).abs() < line.slope_half_width());
                all += 2;
            }
            for level in &found.levels {
                assert!(level.own_error.unwrap().rms < 2.0 * std, "{:?}", level.own_error);
            }
        }
        // 95 % intervals; 48 of them, of which about a third are independent.
        println!("covered {covered} of {all}");
        assert!(covered as f64 >= 0.8 * all as f64, "{covered} of {all}");
    }
}

#[test]
fn signs_of_the_speed_do_not_matter_and_the_result_is_the_same_again() {
    let points = J1.points(&geometric(0.01, 2.4, 16), &TEMPERATURES, 0.05, 3);
    let mirrored: Vec<SteadyPoint> =
        points.iter().map(|p| SteadyPoint { speed: -p.speed, friction: -p.friction, ..*p }).collect();
    let a = analyse(&points, &SteadySettings::default()).unwrap();
    let b = analyse(&points, &SteadySettings::default()).unwrap();
    let c = analyse(&mirrored, &SteadySettings::default()).unwrap();
    assert_eq!(a, b);
    for (x, y) in a.law.coefficients.iter().zip(&c.law.coefficients) {
        assert!((x.value - y.value).abs() <= 1e-6 * x.value.abs(), "{x:?} {y:?}");
    }
}

#[test]
fn one_temperature_has_no_slopes_and_says_so() {
    let found =
        analyse(&J1.points(&geometric(0.01, 2.4, 16), &[30.0], 0.02, 1), &SteadySettings::default()).unwrap();
    assert!(found.law.value("sigma2_slope").is_none() && found.lines.is_empty());
    assert!(found.notes.iter().any(|n| n.contains("held at zero")), "{:?}", found.notes);
    let error = (found.law.friction(&[1.0], &[30.0])[0] - J1.friction(1.0, 30.0)).abs();
    assert!(error < 0.1, "{error}");
}

#[test]
fn few_speeds_get_a_simple_law() {
    let found = analyse(&J1.points(&[0.3, 0.6, 1.0], &[30.0], 0.02, 1), &SteadySettings::default());
    // Three speeds carry two coefficients at best; AICc needs more points than that.
    assert!(matches!(found, Err(SteadyError::Unsupported(_))), "{found:?}");
    let found =
        analyse(&J1.points(&[0.3, 0.5, 0.7, 0.9, 1.1, 1.3], &[30.0], 0.5, 1), &SteadySettings::default())
            .unwrap();
    assert_eq!((found.law.form.stribeck, found.law.form.viscous), (false, ViscousForm::Linear));
    assert!(found.ladder.iter().any(|r| r.refused.as_ref().is_some_and(|w| w.contains("speeds"))));
    assert!(matches!(
        analyse(&J1.points(&[0.5], &[30.0], 0.1, 1), &SteadySettings::default()),
        Err(SteadyError::TooFew { found: 1, .. })
    ));
}

#[test]
fn without_slow_points_static_friction_is_not_estimable() {
    let found =
        analyse(&J1.points(&geometric(0.25, 2.4, 14), &TEMPERATURES, 0.05, 1), &SteadySettings::default())
            .unwrap();
    assert!(!found.law.form.stribeck, "{:?}", found.law);
    assert!(found.notes.iter().any(|n| n.contains("v_s are not estimable")), "{:?}", found.notes);
}

#[test]
fn missing_temperatures_are_said_and_a_constant_is_found() {
    let mut points = J3.points(&geometric(0.01, 2.4, 16), &[30.0], 0.02, 1);
    let back: Vec<SteadyPoint> =
        points.iter().map(|p| SteadyPoint { speed: -p.speed, friction: -p.friction, ..*p }).collect();
    points.extend(back);
    for p in &mut points {
        p.friction += 0.7;
        p.temperature = None;
    }
    let form = LawForm { stribeck: true, viscous: ViscousForm::Exponential, thermal: true, offset: true };
    let settings = SteadySettings { offset: true, form: Some(form), ..SteadySettings::default() };
    let found = analyse(&points, &settings).unwrap();
    assert!((found.law.value("fo").unwrap() - 0.7).abs() < 0.02, "{found:?}");
    assert!(found.notes[0].contains("no temperature"));
}
