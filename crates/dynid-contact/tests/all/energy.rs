//! Stored energy and penetration at rest.

use dynid_contact::ContactLaw;

use super::quadrature::over_logarithm;
use super::{check_relative, fractal, geometric, laws};

/// Energy by many small panels between the limits of the stages.
fn energy(law: &ContactLaw, penetration: f64) -> f64 {
    let limits = match law {
        ContactLaw::Fractal(law) => law.stage_penetrations(),
        _ => [0.0; 3],
    };
    let mut from = penetration * (-22f64).exp();
    let mut sum = 0.0;
    for to in limits.into_iter().chain([penetration]) {
        let to = to.min(penetration);
        sum += over_logarithm(from, to, 2000, |x| law.at(x, 0.1).elastic);
        from = from.max(to);
    }
    sum
}

#[test]
fn stored_energy_is_the_integral_of_the_elastic_force() {
    for law in laws() {
        for penetration in geometric(1e-9, 1e-3, 12) {
            check_relative("energy", law.stored_energy(penetration), energy(&law, penetration), 1e-11);
        }
    }
}

#[test]
fn penetration_at_rest_carries_the_load() {
    for law in laws() {
        for load in geometric(1e-12, 1e9, 42) {
            let penetration = law.static_penetration(load);
            let force = law.at(penetration, 0.1);
            let unit = load + force.elastic_slope * penetration;
            assert!((force.elastic - load).abs() <= 64.0 * f64::EPSILON * unit, "{load:e}: {force:?}");
        }
        assert_eq!(law.static_penetration(0.0), 0.0);
        assert_eq!(law.static_penetration(-1.0), 0.0);
        assert_eq!(law.static_penetration(f64::INFINITY), f64::INFINITY);
    }
}

#[test]
fn penetrations_at_rest_are_those_of_the_pointing_mechanism() {
    let expected = [
        (1.0, 29.0, 52e-9, 0.5e-9),
        (1.0, 8.4, 22e-9, 0.5e-9),
        (1.5, 29.0, 4.3e-6, 0.05e-6),
        (1.5, 8.4, 2.2e-6, 0.05e-6),
    ];
    for (force_index, load, penetration, tolerance) in expected {
        let found = ContactLaw::from(fractal(0.8, force_index)).static_penetration(load);
        assert!((found - penetration).abs() <= tolerance, "{force_index}, {load} N: {found:e}");
    }
}
