//! Contact laws against golden numbers, quadrature, differences and each other.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

mod energy;
mod errors;
mod golden;
mod quadrature;
mod slopes;

use dynid_contact::*;

const STEEL: [Material; 2] = [Material::STEEL; 2];

/// Roughness, µm, of a fractal dimension.
fn roughness(dimension: f64) -> f64 {
    (1.54 / (dimension - 1.0)).powf(1.0 / 0.045)
}

/// Dimensions at which an exponent of the work integrals vanishes.
const LOGARITHMIC: [f64; 3] = [4.0 / 1.5, 3.85 / 1.425, 3.526 / 1.263];

fn surface(roughness_um: f64) -> FractalSurface {
    FractalSurface::new(SurfaceSettings { roughness_um, ..SurfaceSettings::default() }).unwrap()
}

fn bearing() -> JournalBearing {
    JournalBearing::new(10.05e-3, 10e-3, 0.02).unwrap()
}

fn fractal(roughness_um: f64, force_index: f64) -> FractalLankaraniNikravesh {
    let settings = FractalSettings { force_index, ..FractalSettings::new(2.1391) };
    FractalLankaraniNikravesh::new(surface(roughness_um), bearing(), settings).unwrap()
}

/// One law of each kind, and rough ones of all force indices.
fn laws() -> Vec<ContactLaw> {
    let stiffness = HertzStiffness::of_bearing(bearing(), STEEL[0], STEEL[1]).unwrap();
    vec![
        fractal(0.8, 1.5).into(),
        fractal(0.8, 1.0).into(),
        fractal(roughness(LOGARITHMIC[0]), 1.2).into(),
        fractal(roughness(LOGARITHMIC[1] + 1e-9), 1.5).into(),
        fractal(roughness(LOGARITHMIC[2] - 1e-9), 1.0).into(),
        Hertz::new(stiffness).into(),
        LankaraniNikravesh::new(stiffness, 0.7).unwrap().into(),
        KelvinVoigt::new(1e8, 1e4, 5e-5).unwrap().into(),
    ]
}

/// From `low` to `high` in `count` steps of equal ratio.
fn geometric(low: f64, high: f64, count: usize) -> impl Iterator<Item = f64> {
    (0..=count).map(move |k| low * (high / low).powf(k as f64 / count as f64))
}

#[track_caller]
fn check_relative(what: &str, found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance * expected.abs(), "{what}: {found:e} against {expected:e}");
}

#[test]
fn force_is_a_number_at_any_penetration_and_speed_of_impact() {
    for law in laws() {
        for penetration in [0.0, f64::MIN_POSITIVE].into_iter().chain(geometric(1e-18, 1e-3, 400)) {
            for impact in [0.0, 1e-9, 1.0] {
                let f = law.at(penetration, impact);
                let parts = [f.elastic, f.damping, f.elastic_slope, f.damping_slope];
                let by_clearance = [f.elastic_by_clearance, f.damping_by_clearance];
                assert!(parts.iter().chain(&by_clearance).all(|x| x.is_finite()), "{penetration}: {f:?}");
                assert!(f.elastic >= 0.0 && f.damping >= 0.0 && f.elastic_slope >= 0.0, "{f:?}");
            }
            assert!(law.stored_energy(penetration).is_finite());
        }
        for penetration in [0.0, -1e-6, f64::NAN] {
            assert_eq!(law.at(penetration, 0.1), ContactForce::default());
            assert_eq!(law.stored_energy(penetration), 0.0);
        }
        assert_eq!(law.at(1e-6, 0.0), law.at(1e-6, law.impact_speed_floor()));
    }
}

#[test]
fn normal_force_never_pulls() {
    for law in laws() {
        let force = law.at(1e-6, 0.1);
        assert_eq!(force.normal_force(-1e6).max(0.0), force.normal_force(-1e6));
        assert_eq!(force.normal_force(0.0), force.elastic);
    }
}

#[test]
fn stiffness_of_a_rough_contact_is_continuous_and_grows() {
    for d in [2.4, 2.555].into_iter().chain(LOGARITHMIC) {
        let law = fractal(roughness(d), 1.5);
        let stiffness = |penetration: f64| law.state(penetration, 0.1).stiffness;
        let [plastic, second, first] = law.stage_penetrations();
        let mut last = 0.0;
        for penetration in geometric(plastic * 1.0001, 1e-3, 3000) {
            let next = stiffness(penetration);
            assert!(next > last, "D {d}, penetration {penetration:e}: {next:e} after {last:e}");
            last = next;
        }
        assert_eq!(stiffness(0.9999 * plastic), 0.0);
        assert!(stiffness(plastic * (1.0 + 1e-9)) < 1e-8 * stiffness(second.min(1e-3)));
        for limit in [second, first].into_iter().filter(|x| x.is_finite()) {
            check_relative("limit", stiffness(limit * (1.0 + 1e-10)), stiffness(limit * (1.0 - 1e-10)), 1e-9);
        }
    }
}

#[test]
fn force_index_one_is_stiffness_times_penetration() {
    let law = fractal(0.8, 1.0);
    for penetration in geometric(1e-9, 2e-5, 20) {
        let state = law.state(penetration, 0.05);
        let force = ContactLaw::from(law.clone()).at(penetration, 0.05);
        check_relative("elastic", force.elastic, state.stiffness * penetration, 1e-15);
        check_relative("damping", force.damping, state.asperity_damping + state.hysteresis_damping, 1e-14);
    }
}

#[test]
fn literal_hardness_ratio_makes_the_load_of_an_asperity_jump() {
    let jump = |pressure_factor| {
        let settings = SurfaceSettings { pressure_factor, ..SurfaceSettings::default() };
        let surface = FractalSurface::new(settings).unwrap();
        let area = surface.constants().critical_area;
        let load = |share: f64| surface.asperity_of_real_area(area * share).load;
        load(1.0) / load(1.0 + 1e-12)
    };
    assert!((jump(PressureFactor::Poisson) - 1.03).abs() < 0.01);
    assert!((jump(PressureFactor::HardnessRatio) - 5.0).abs() < 0.1);
}

#[test]
fn restitution_of_the_classical_law_is_that_of_the_drop_test() {
    for (restitution, effective) in [(0.9, 0.9132), (0.7, 0.7960), (0.5, 0.7252)] {
        let stiffness = HertzStiffness::given(1e9, 5e-5).unwrap();
        let law = ContactLaw::from(LankaraniNikravesh::new(stiffness, restitution).unwrap());
        let (start, step) = (0.1, 2e-7);
        let acceleration = |x: f64, v: f64| -law.at(x, start).normal_force(v);
        let (mut x, mut v) = (0.0, start);
        while x >= 0.0 {
            let (v1, a1) = (v, acceleration(x, v));
            let (v2, a2) = (v + 0.5 * step * a1, acceleration(x + 0.5 * step * v1, v + 0.5 * step * a1));
            let (v3, a3) = (v + 0.5 * step * a2, acceleration(x + 0.5 * step * v2, v + 0.5 * step * a2));
            let (v4, a4) = (v + step * a3, acceleration(x + step * v3, v + step * a3));
            x += step / 6.0 * (v1 + 2.0 * v2 + 2.0 * v3 + v4);
            v += step / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
        }
        assert!((-v / start - effective).abs() < 1e-4, "{restitution}: {}", -v / start);
    }
}

#[test]
fn validity_tells_what_the_spots_do() {
    let law = ContactLaw::from(fractal(0.8, 1.5));
    let inside = law.validity(4e-6);
    assert_eq!((inside.remarks(), inside.to_string().as_str()), (vec![], "inside the range of the law"));
    let spots = inside.spots.unwrap();
    assert!(
        spots.elastic && spots.first_elastoplastic && spots.second_elastoplastic && !spots.work_ratio_capped
    );
    check_relative("a_l/a_c", spots.largest_over_critical, 5.472715430418292, 1e-10);

    let remarks = law.validity(1e-8).remarks();
    assert_eq!(remarks.len(), 2, "{remarks:?}");
    assert!(remarks[0].contains("0.284 of the critical area") && remarks[1].contains("at its limit"));
    assert!(law.validity(0.0).to_string().contains("plastic"));
    assert!(law.validity(2e-5).to_string().contains("0.400 of the clearance"));
    assert_eq!(laws()[5].validity(1e-6).remarks(), Vec::<String>::new());
}
