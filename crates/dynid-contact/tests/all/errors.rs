//! Numbers that make no contact are refused, and named.

use dynid_contact::*;

use super::{STEEL, bearing, fractal, surface};

#[track_caller]
fn check<T: std::fmt::Debug>(result: Result<T, ContactError>, field: &str, said: &str) {
    let error = result.unwrap_err();
    assert_eq!(error.field(), field);
    let text = error.to_string();
    assert!(text.contains(&format!("`{field}`")) && text.contains(said), "{text}");
}

#[test]
fn surfaces_that_cannot_be_are_refused() {
    type Change = fn(&mut SurfaceSettings);
    let cases: [(Change, &str, &str); 15] = [
        (|s| s.roughness_um = 0.0, "roughness_um", "above 0 µm, found 0"),
        (|s| s.roughness_um = f64::NAN, "roughness_um", "found NaN"),
        (|s| s.roughness_um = 0.002, "roughness_um", "Ra in (3.00e-3, 1.47e4) µm, found D = 3.0"),
        (|s| s.roughness_um = 2e4, "roughness_um", "found D = 1.98"),
        (|s| s.roughness_um = 1.46e4, "roughness_um", "critical area a_c is a positive number, found inf"),
        (|s| s.friction = -0.1, "friction", "in [0, 0.9], found -0.1"),
        (|s| s.friction = 0.91, "friction", "in [0, 0.9], found 0.91"),
        (|s| s.softer.youngs_modulus = 0.0, "youngs_modulus", "above 0 Pa"),
        (|s| s.harder.poisson_ratio = 0.6, "poisson_ratio", "in (-1, 0.5], found 0.6"),
        (|s| s.softer.poisson_ratio = f64::INFINITY, "poisson_ratio", "found inf"),
        (|s| s.yield_strength = -1.0, "yield_strength", "above 0 Pa, found -1"),
        (|s| s.hardness_ratio = 0.0, "hardness_ratio", "above 0"),
        (|s| s.profile_constant = 1.0, "profile_constant", "above 1"),
        (|s| s.pressure_factor = PressureFactor::Given(-0.5), "pressure_factor", "above 0, found -0.5"),
        (|s| s.pressure_factor = PressureFactor::Given(f64::NAN), "pressure_factor", "found NaN"),
    ];
    for (change, field, said) in cases {
        let mut settings = SurfaceSettings::default();
        change(&mut settings);
        check(FractalSurface::new(settings), field, said);
    }
}

#[test]
fn bearings_that_cannot_be_are_refused() {
    check(JournalBearing::new(0.01, 0.01, 0.02), "bearing_radius", "above that of the journal");
    check(JournalBearing::new(f64::NAN, 0.01, 0.02), "bearing_radius", "found NaN");
    check(JournalBearing::new(0.01, 0.0, 0.02), "journal_radius", "above 0 m");
    check(JournalBearing::new(0.0101, 0.01, -0.02), "width", "above 0 m, found -0.02");
    check(bearing().with_clearance(0.0), "clearance", "above 0 m");
}

#[test]
fn settings_of_a_rough_contact_outside_their_range_are_refused() {
    type Change = fn(&mut FractalSettings);
    let cases: [(Change, &str, &str); 10] = [
        (|s| s.mass = 0.0, "mass", "above 0 kg"),
        (|s| s.area_ratio = 1.0, "area_ratio", "in (0, 1)"),
        (|s| s.area_ratio = 1e-12, "area_ratio", "plastic limit a_2"),
        (|s| s.restitution = 0.0, "restitution", "in (0, 1]"),
        (|s| s.restitution = 1.01, "restitution", "in (0, 1]"),
        (|s| s.force_index = 0.9, "force_index", "in [1, 2]"),
        (|s| s.force_index = 2.1, "force_index", "in [1, 2]"),
        (|s| s.work_ratio_limit = 0.0, "work_ratio_limit", "above 0"),
        (|s| s.impact_speed_floor = 0.0, "impact_speed_floor", "above 0 m/s"),
        (|s| s.mass = f64::INFINITY, "mass", "found inf"),
    ];
    for (change, field, said) in cases {
        let mut settings = FractalSettings::new(1.0);
        change(&mut settings);
        check(FractalLankaraniNikravesh::new(surface(0.8), bearing(), settings), field, said);
    }
}

#[test]
fn other_laws_refuse_what_they_cannot_take() {
    check(HertzStiffness::given(-1.0, 5e-5), "stiffness", "above 0 N/m^1.5");
    check(HertzStiffness::given(1.0, 0.0), "clearance", "above 0 m");
    let soft = Material { youngs_modulus: -1.0, ..STEEL[0] };
    check(HertzStiffness::of_bearing(bearing(), soft, STEEL[1]), "youngs_modulus", "above 0 Pa");
    let stiffness = HertzStiffness::given(1e9, 5e-5).unwrap();
    check(LankaraniNikravesh::new(stiffness, 1.5), "restitution", "in (0, 1]");
    let law = LankaraniNikravesh::new(stiffness, 0.9).unwrap();
    check(law.with_impact_speed_floor(0.0), "impact_speed_floor", "above 0 m/s");
    check(KelvinVoigt::new(0.0, 1.0, 5e-5), "stiffness", "above 0 N/m");
    check(KelvinVoigt::new(1.0, -1.0, 5e-5), "damping", "at least 0 N s/m");
    check(KelvinVoigt::new(1.0, 1.0, -5e-5), "clearance", "above 0 m");
    check(ContactLaw::from(fractal(0.8, 1.5)).with_clearance(f64::NAN), "clearance", "found NaN");
    check(ContactLaw::from(law).with_clearance(-1.0), "clearance", "found -1");
}

#[test]
fn friction_outside_its_range_is_refused() {
    check(SlidingFriction::new(-0.1, 1e-5, 1e-4), "coefficient", "at least 0");
    check(SlidingFriction::new(0.1, -1e-5, 1e-4), "v_0", "at least 0 m/s");
    check(SlidingFriction::new(0.1, 1e-4, 1e-4), "v_m", "above `v_0`");
    check(SlidingFriction::new(0.1, 1e-5, f64::INFINITY), "v_m", "found inf");
}

#[test]
fn surfaces_too_rough_for_the_bearing_are_refused() {
    let contact = |ra| FractalLankaraniNikravesh::new(surface(ra), bearing(), FractalSettings::new(1.0));
    assert!((contact(10.0).unwrap().stage_penetrations()[0] - 6.2e-8).abs() < 1e-9);
    check(contact(25.0), "area_ratio", "plastic limit a_2");
}
