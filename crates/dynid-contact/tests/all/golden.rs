//! Golden numbers of the rough contact and of friction.

use dynid_contact::*;
use dynid_testing::golden;
use serde_json::Value;

use super::{check_relative, quadrature};

const RELATIVE: f64 = 1e-8;

fn number(of: &Value, name: &str) -> f64 {
    of[name].as_f64().unwrap()
}

fn list<'a>(of: &'a Value, name: &str) -> &'a [Value] {
    of[name].as_array().unwrap()
}

/// The law of a golden case, in its own constants or with `literal_k`.
fn law(case: &Value, literal: bool) -> FractalLankaraniNikravesh {
    let c = |name| number(&case["constants"], name);
    let surface = FractalSurface::new(SurfaceSettings {
        roughness_um: c("Ra_um"),
        friction: c("mu"),
        softer: Material { youngs_modulus: c("E1"), poisson_ratio: c("nu1") },
        harder: Material { youngs_modulus: c("E2"), poisson_ratio: c("nu2") },
        yield_strength: c("sig"),
        hardness_ratio: c("K_H"),
        pressure_factor: if literal { PressureFactor::HardnessRatio } else { PressureFactor::Poisson },
        profile_constant: c("gamma"),
    });
    let settings = FractalSettings {
        mass: c("M"),
        area_ratio: c("lam"),
        restitution: c("restitution"),
        force_index: c("n"),
        work_ratio_limit: c("eta_max"),
        impact_speed_floor: c("v_min"),
    };
    let bearing = JournalBearing::new(c("R1"), c("R2"), c("b")).unwrap();
    FractalLankaraniNikravesh::new(surface.unwrap(), bearing, settings).unwrap()
}

#[test]
fn constants_of_the_surface_agree() {
    let Some(golden) = golden("xy_contact.json") else { return };
    for case in list(&golden, "cases") {
        let law = law(case, false);
        let found = law.surface().constants();
        check_relative("K_p", found.pressure_factor, number(&case["constants"], "Kp"), RELATIVE);
        for (name, value) in [
            ("D", found.dimension),
            ("G_m", found.fractal_roughness),
            ("phi", found.domain_extension),
            ("k_mu", found.friction_factor),
            ("E_star", found.combined_modulus),
            ("H", found.hardness),
            ("a_c", found.critical_area),
            ("m", found.largest_share),
            ("h1", found.h1),
            ("h2", found.h2),
            ("h3", found.h3),
            ("h4", found.h4),
        ] {
            check_relative(name, value, number(case, name), RELATIVE);
        }
    }
}

#[test]
fn contact_agrees_at_every_penetration() {
    let Some(golden) = golden("xy_contact.json") else { return };
    for case in list(&golden, "cases") {
        let (law, literal) = (law(case, false), law(case, true));
        let impact = number(&case["constants"], "impact_speed");
        for point in list(case, "points") {
            let penetration = number(point, "delta");
            let found = law.state(penetration, impact);
            let critical = law.surface().constants().critical_area;
            for (name, value) in [
                ("A_r", found.real_area),
                ("a_l", found.largest_spot),
                ("a_l_over_a_c", found.largest_spot / critical),
                ("K_m", found.stiffness),
                ("W_e", found.elastic_work),
                ("W_p", found.plastic_work),
                ("eta", found.work_ratio),
                ("C_n", found.asperity_damping),
                ("D_n", found.hysteresis_damping),
            ] {
                check_relative(name, value, number(point, name), RELATIVE);
            }
            let summed = quadrature::stiffness(law.surface(), found.largest_spot);
            check_relative("quadrature of K_m", summed, number(point, "K_m_quadrature"), RELATIVE);
            let force = ContactLaw::from(law.clone()).at(penetration, impact);
            for given in list(point, "forces") {
                let found = force.normal_force(number(given, "delta_dot"));
                check_relative("F_n", found, number(given, "F_n"), RELATIVE);
            }
        }
        for point in list(case, "K_m_literal_K") {
            let found = literal.state(number(point, "delta"), impact).stiffness;
            check_relative("literal K_m", found, number(point, "K_m"), RELATIVE);
        }
    }
}

#[test]
fn friction_agrees() {
    let Some(golden) = golden("xy_contact.json") else { return };
    for given in list(&golden, "friction_c_d") {
        let friction = SlidingFriction::new(0.1, number(given, "v_0"), number(given, "v_m")).unwrap();
        let v = number(given, "v_t");
        let (direction, _) = friction.direction(v);
        check_relative("c_d", direction.abs(), number(given, "c_d"), RELATIVE);
        assert!(direction * v >= 0.0);
    }
    for given in list(&golden, "k_mu") {
        let settings = SurfaceSettings { friction: number(given, "mu"), ..SurfaceSettings::default() };
        let found = FractalSurface::new(settings).unwrap().constants().friction_factor;
        check_relative("k_mu", found, number(given, "k_mu"), RELATIVE);
    }
}
