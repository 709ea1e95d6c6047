//! Row 2: the contact of rough surfaces against an independent implementation.

use dynid::model::contact::{
    ContactLaw, FractalLankaraniNikravesh, FractalSurface, PressureFactor, SlidingFriction, SurfaceSettings,
};
use serde_json::json;

use super::bearing::Bearing;
use super::fault;
use super::reference::{self, ContactCase};
use crate::{Row, StudyError};

/// Panels of the quadrature in each stage of the asperities.
const PANELS: usize = 400;

/// Largest relative differences.
#[derive(Debug, Default)]
struct Differences {
    surface: f64,
    contact: f64,
    force: f64,
    friction: f64,
    quadrature: f64,
}

fn larger(worst: &mut f64, own: f64, wanted: f64) {
    let difference = (own - wanted).abs();
    // Zeros and numbers that are exactly equal.
    let relative = if difference == 0.0 { 0.0 } else { difference / wanted.abs() };
    *worst = worst.max(if relative.is_nan() { f64::INFINITY } else { relative });
}

fn law(case: &ContactCase, factor: PressureFactor) -> Result<FractalLankaraniNikravesh, StudyError> {
    let c = |name: &str| {
        case.constants.get(name).copied().ok_or_else(|| fault(format!("contact.json lacks `{name}`")))
    };
    Bearing {
        clearance: c("R1")? - c("R2")?,
        journal_radius: c("R2")?,
        width: c("b")?,
        roughness_um: c("Ra_um")?,
        youngs_modulus: c("E1")?,
        poisson_ratio: c("nu1")?,
        yield_strength: c("sig")?,
        hardness_ratio: c("K_H")?,
        profile_constant: c("gamma")?,
        area_ratio: c("lam")?,
        restitution: c("restitution")?,
        force_index: c("n")?,
        work_ratio_limit: c("eta_max")?,
        impact_speed_floor: c("v_min")?,
        friction: c("mu")?,
        v_0: 1e-5,
        v_m: 1e-4,
        smooth: false,
    }
    .fractal(c("M")?, factor)
}

/// Stiffness as the sum over asperities that its closed form stands for.
fn summed_stiffness(surface: &FractalSurface, largest: f64) -> f64 {
    let c = surface.constants();
    let density = |a: f64| surface.asperity(a).stiffness * surface.spot_density(a, largest);
    let stages = [c.second_limit, c.first_limit, c.critical_area, f64::INFINITY];
    let between = |ends: &[f64]| {
        let (from, to) = (ends[0], ends[1].min(largest));
        if to <= from {
            return 0.0;
        }
        let width = (to / from).ln() / PANELS as f64;
        let panel = |k: usize| {
            // Three-point Gauss-Legendre over the logarithm.
            let at = |x: f64| {
                let a = from * (width * (k as f64 + 0.5 + 0.5 * x)).exp();
                a * density(a)
            };
            let outer = 0.6f64.sqrt();
            width / 18.0 * (5.0 * at(-outer) + 8.0 * at(0.0) + 5.0 * at(outer))
        };
        (0..PANELS).map(panel).sum()
    };
    stages.windows(2).map(between).sum()
}

fn compare(case: &ContactCase, worst: &mut Differences) -> Result<(), StudyError> {
    let law_of = |factor| law(case, factor);
    let (own, literal) = (law_of(PressureFactor::Poisson)?, law_of(PressureFactor::HardnessRatio)?);
    let c = own.surface().constants();
    for (name, value) in [
        ("D", c.dimension),
        ("G_m", c.fractal_roughness),
        ("phi", c.domain_extension),
        ("k_mu", c.friction_factor),
        ("E_star", c.combined_modulus),
        ("H", c.hardness),
        ("a_c", c.critical_area),
        ("m", c.largest_share),
        ("h1", c.h1),
        ("h2", c.h2),
        ("h3", c.h3),
        ("h4", c.h4),
    ] {
        larger(&mut worst.surface, value, case.surface.get(name).copied().unwrap_or(f64::NAN));
    }
    let impact = case.constants.get("impact_speed").copied().unwrap_or(f64::NAN);
    for point in &case.points {
        let found = own.state(point.delta, impact);
        for (name, value) in [
            ("A_r", found.real_area),
            ("a_l", found.largest_spot),
            ("a_l_over_a_c", found.largest_spot / c.critical_area),
            ("K_m", found.stiffness),
            ("W_e", found.elastic_work),
            ("W_p", found.plastic_work),
            ("eta", found.work_ratio),
            ("C_n", found.asperity_damping),
            ("D_n", found.hysteresis_damping),
            ("K_m_quadrature", summed_stiffness(own.surface(), found.largest_spot)),
        ] {
            larger(&mut worst.contact, value, point.values.get(name).copied().unwrap_or(f64::NAN));
        }
        let summed = summed_stiffness(own.surface(), found.largest_spot);
        larger(&mut worst.quadrature, found.stiffness, summed);
        let force = ContactLaw::from(own.clone()).at(point.delta, impact);
        for given in &point.forces {
            larger(&mut worst.force, force.normal_force(given.delta_dot), given.force);
        }
    }
    for point in &case.literal {
        larger(&mut worst.contact, literal.state(point.delta, impact).stiffness, point.stiffness);
    }
    Ok(())
}

pub(super) fn row() -> Result<Row, StudyError> {
    let reference = reference::contact()?;
    let mut worst = Differences::default();
    for case in &reference.cases {
        compare(case, &mut worst)?;
    }
    for given in &reference.friction_c_d {
        let friction = SlidingFriction::new(0.1, given.v_0, given.v_m).map_err(fault)?;
        larger(&mut worst.friction, friction.direction(given.v_t).0.abs(), given.c_d);
    }
    for given in &reference.k_mu {
        let surface =
            FractalSurface::new(SurfaceSettings { friction: given.mu, ..SurfaceSettings::default() });
        larger(&mut worst.surface, surface.map_err(fault)?.constants().friction_factor, given.k_mu);
    }
    let points: usize = reference.cases.iter().map(|c| c.points.len()).sum();
    let Differences { surface, contact, force, friction, quadrature } = worst;
    Ok(Row::new(
        "2",
        "Contact of rough surfaces: constants of the surface, stiffness, work, damping and force at every penetration agree with an \
         independent implementation, its two readings of K too; the stiffness is the sum over asperities that it stands for",
        "1e-8 relative; stiffness 2e-3 of its quadrature",
        json!({ "cases": reference.cases.len(), "points": points, "surface": surface, "contact": contact,
                "force": force, "friction": friction, "quadrature": quadrature }),
        format!(
            "{points} points of {} contacts: surface {surface:.1e}, contact {contact:.1e}, force {force:.1e}, friction \
             {friction:.1e}; quadrature {quadrature:.1e}",
            reference.cases.len()
        ),
        [surface, contact, force, friction].into_iter().fold(0.0, f64::max) <= 1e-8 && quadrature <= 2e-3,
    ))
}
