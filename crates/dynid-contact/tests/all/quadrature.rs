//! The closed forms of stiffness and work against the sums over asperities that they stand for.

use dynid_contact::{FractalContact, FractalLankaraniNikravesh, FractalSurface};

use super::{LOGARITHMIC, check_relative, fractal, geometric, roughness};

/// `∫ f(x) dx` over `ln x` by three-point Gauss-Legendre quadrature in panels; 0 over an empty range.
pub(super) fn over_logarithm(from: f64, to: f64, panels: usize, f: impl Fn(f64) -> f64) -> f64 {
    if to <= from {
        return 0.0;
    }
    let half = 0.5 * (to / from).ln() / panels as f64;
    let panel = |k: usize| {
        let middle = from.ln() + (2 * k + 1) as f64 * half;
        [(-0.6f64.sqrt(), 5.0 / 9.0), (0.0, 8.0 / 9.0), (0.6f64.sqrt(), 5.0 / 9.0)]
            .iter()
            .map(|(x, weight)| {
                let at = (middle + half * x).exp();
                half * weight * at * f(at)
            })
            .sum::<f64>()
    };
    (0..panels).map(panel).sum()
}

pub(super) fn stiffness(surface: &FractalSurface, largest: f64) -> f64 {
    let c = surface.constants();
    let density = |a: f64| surface.asperity(a).stiffness * surface.spot_density(a, largest);
    over_logarithm(c.second_limit, largest.min(c.first_limit), 400, density)
        + over_logarithm(c.first_limit, largest.min(c.critical_area), 400, density)
        + over_logarithm(c.critical_area, largest, 400, density)
}

fn works(surface: &FractalSurface, largest: f64) -> [f64; 2] {
    let c = surface.constants();
    let density = |a: f64| surface.asperity_of_real_area(a).work * surface.spot_density(a, largest);
    let plastic_top = largest.min(c.second_limit);
    let plastic_bottom = plastic_top * (-34.0 / (3.0 - c.dimension)).exp();
    [
        over_logarithm(c.critical_area, largest, 400, density)
            + over_logarithm(c.first_limit, largest.min(c.critical_area), 400, density),
        over_logarithm(c.second_limit, largest.min(c.first_limit), 400, density)
            + over_logarithm(plastic_bottom, plastic_top, 4000, density),
    ]
}

fn check(law: &FractalLankaraniNikravesh, penetration: f64) -> FractalContact {
    let found = law.state(penetration, 0.1);
    check_relative("K_m", found.stiffness, stiffness(law.surface(), found.largest_spot), 2e-3);
    let [elastic, plastic] = works(law.surface(), found.largest_spot);
    check_relative("W_e", found.elastic_work, elastic, 1e-9);
    check_relative("W_p", found.plastic_work, plastic, 1e-9);
    found
}

#[test]
fn stiffness_and_work_are_sums_over_asperities() {
    for d in [2.4, 2.555, 2.85].into_iter().chain(LOGARITHMIC) {
        let law = fractal(roughness(d), 1.5);
        for penetration in geometric(1e-12, 1e-4, 16) {
            check(&law, penetration);
        }
        let [plastic, second, first] = law.stage_penetrations();
        for inside in [0.5 * plastic, (plastic * second).sqrt(), (second * first).sqrt()]
            .into_iter()
            .filter(|x| x.is_finite())
        {
            check(&law, inside);
        }
    }
}

#[test]
fn work_is_smooth_where_a_power_becomes_a_logarithm() {
    for d in LOGARITHMIC {
        let work = |d: f64| {
            let law = fractal(roughness(d), 1.5);
            let state = law.state(1e-6, 0.1);
            [state.elastic_work, state.plastic_work]
        };
        let at = work(d);
        for shift in [1e-14, 1e-12, 1e-9] {
            for (k, expected) in at.into_iter().enumerate() {
                check_relative("work", 0.5 * (work(d + shift)[k] + work(d - shift)[k]), expected, 1e-11);
            }
        }
    }
}
