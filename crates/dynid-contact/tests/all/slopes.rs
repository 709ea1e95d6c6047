//! Slopes against differences.

use dynid_contact::{ContactForce, ContactLaw, SlidingFriction};

use super::{geometric, laws};

/// Step of the differences as a share of the argument.
const STEP: f64 = 2e-3;

/// Central difference, its error of second and fourth order removed.
fn derivative(at: f64, f: impl Fn(f64) -> f64) -> f64 {
    let central = |share: f64| (f(at * (1.0 + share)) - f(at * (1.0 - share))) / (2.0 * at * share);
    let [coarse, middle, fine] = [STEP, 0.5 * STEP, 0.25 * STEP].map(central);
    let second = |coarse: f64, fine: f64| fine + (fine - coarse) / 3.0;
    let (low, high) = (second(coarse, middle), second(middle, fine));
    high + (high - low) / 15.0
}

/// What acts at a penetration: between two points where it is the same, the force is smooth.
fn regime(law: &ContactLaw, penetration: f64) -> [bool; 4] {
    law.validity(penetration).spots.map_or([false; 4], |s| {
        [s.elastic, s.first_elastoplastic, s.second_elastoplastic, s.work_ratio_capped]
    })
}

#[track_caller]
fn check(what: &str, at: f64, scale: f64, found: f64, expected: f64) {
    let unit = found.abs() + scale / at;
    assert!((found - expected).abs() <= 1e-9 * unit, "{what} at {at:e}: {found:e} against {expected:e}");
}

type Part = fn(&ContactForce) -> f64;

#[test]
fn slopes_by_penetration_are_those_of_differences() {
    for law in laws() {
        let mut checked = 0;
        for penetration in geometric(1e-9, 2e-5, 120) {
            let shares = [1.0 - STEP, 1.0, 1.0 + STEP].map(|x| regime(&law, x * penetration));
            if shares[0] != shares[1] || shares[1] != shares[2] {
                continue;
            }
            checked += 1;
            let force = law.at(penetration, 0.05);
            let parts: [(&str, f64, f64, Part); 2] = [
                ("elastic", force.elastic, force.elastic_slope, |f| f.elastic),
                ("damping", force.damping, force.damping_slope, |f| f.damping),
            ];
            for (what, value, slope, part) in parts {
                let expected = derivative(penetration, |x| part(&law.at(x, 0.05)));
                check(what, penetration, value, slope, expected);
            }
        }
        assert!(checked > 110, "{checked}");
    }
}

#[test]
fn slopes_by_clearance_are_those_of_differences() {
    for law in laws() {
        let clearance = law.clearance();
        let other = |clearance: f64| law.with_clearance(clearance).unwrap();
        assert_eq!(other(2.0 * clearance).clearance(), 2.0 * clearance);
        assert_eq!(other(clearance).at(1e-6, 0.1), law.at(1e-6, 0.1));
        for penetration in geometric(1e-9, 2e-5, 60) {
            let laws = [1.0 - STEP, 1.0, 1.0 + STEP].map(|x| regime(&other(x * clearance), penetration));
            if laws[0] != laws[1] || laws[1] != laws[2] {
                continue;
            }
            let force = law.at(penetration, 0.05);
            let parts: [(&str, f64, f64, Part); 2] = [
                ("elastic", force.elastic, force.elastic_by_clearance, |f| f.elastic),
                ("damping", force.damping, force.damping_by_clearance, |f| f.damping),
            ];
            for (what, value, slope, part) in parts {
                let expected = derivative(clearance, |c| part(&other(c).at(penetration, 0.05)));
                check(what, clearance, value, slope, expected);
            }
        }
    }
}

#[test]
fn slope_of_friction_is_that_of_its_ramp() {
    let friction = SlidingFriction::default();
    for v in [3e-5_f64, -7e-5, 9e-5] {
        check("c_d", v.abs(), 1.0, friction.direction(v).1, derivative(v, |v| friction.direction(v).0));
    }
    for v in [0.0, 5e-6, -1e-5, 1e-4, -1.0] {
        assert_eq!(friction.direction(v).1, 0.0);
    }
    assert_eq!(friction.direction(-1.0).0, -1.0);
}
