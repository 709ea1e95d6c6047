//! The reduction in double precision beside one with 32 digits.
#![expect(clippy::unwrap_used, reason = "in tests a panic is the report")]

use crate::extended::{DoubleDouble, ExtendedFactor};
use dynid_estimate::linear::ols;
use dynid_factor::FactorBuilder;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Reduces rows both ways.
fn both(rows: &[(Vec<f64>, f64)]) -> (dynid_factor::Factor, ExtendedFactor) {
    let columns = rows[0].0.len();
    let (mut plain, mut extended) = (FactorBuilder::new(columns), ExtendedFactor::new(columns));
    for (w, y) in rows {
        plain.push_row(w, *y).unwrap();
        extended.push(w.iter().chain([y]).map(|v| DoubleDouble::from(*v)));
    }
    (plain.finish(), extended)
}

/// A triangle moves by `ε` of the norm of its column for every rounding that its entries see; of random rows most cancel.
#[test]
fn entries_agree_with_those_of_32_digits() {
    const COLUMNS: usize = 5;
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    for count in [COLUMNS, 40, 4000] {
        let mut draw = || rng.random::<f64>() - 0.5;
        let rows: Vec<(Vec<f64>, f64)> =
            (0..count).map(|_| ((0..COLUMNS).map(|_| draw()).collect(), draw())).collect();
        let (plain, extended) = both(&rows);
        assert_eq!((plain.rows(), plain.height()), (count, COLUMNS));
        let size = (count as f64).sqrt();
        let close = |found: f64, expected: DoubleDouble| {
            let off = (expected - DoubleDouble::from(found)).abs().to_f64();
            assert!(off <= 20.0 * f64::EPSILON * size, "{count} rows: {found} is off by {off:.1e}");
        };
        let z = plain.z();
        for (i, z) in z.iter().enumerate() {
            (0..COLUMNS).for_each(|j| close(plain.r(i, j), extended.at(i, j)));
            close(*z, extended.at(i, COLUMNS));
        }
        close(plain.rho(), extended.at(COLUMNS, COLUMNS));
    }
}

/// An integer problem whose solution is known: `y = W x + r` with `Wᵀ r = 0` by construction, `r` being 1e12 times the smallest
/// parameter's share. Double precision amplifies the rounding of the efforts, `ε ‖y‖`, by the condition number and no more.
#[test]
fn small_shares_under_large_residuals() {
    let truth = [1.0, -3.0];
    let rows: Vec<(Vec<f64>, f64)> = [(1.0, 1.0), (2.0, -1.0), (3.0, -1.0), (4.0, 1.0)]
        .map(|(w, sign)| (vec![1.0, w], truth[0] + truth[1] * w + 1e12 * sign))
        .to_vec();
    let (plain, extended) = both(&rows);
    assert_eq!(extended.solve().x, truth);
    let found = ols(&plain);
    let most = 10.0 * f64::EPSILON * found.condition * plain.effort_norm();
    for (found, truth) in found.x.iter().zip(truth) {
        assert!((found - truth).abs() <= most, "{found} of {truth}, at most {most:.1e} off");
    }
}
