//! Sobol points, shifted by a seed.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Degree, coefficients and first direction numbers of the primitive polynomials of dimensions 2 to 21.
///
/// Source: Joe & Kuo 2008, *Constructing Sobol sequences with better two-dimensional projections* (new-joe-kuo-6).
const DIRECTIONS: [(u32, u32, &[u32]); 20] = [
    (1, 0, &[1]),
    (2, 1, &[1, 3]),
    (3, 1, &[1, 3, 1]),
    (3, 2, &[1, 1, 1]),
    (4, 1, &[1, 1, 3, 3]),
    (4, 4, &[1, 3, 5, 13]),
    (5, 2, &[1, 1, 5, 5, 17]),
    (5, 4, &[1, 1, 5, 5, 5]),
    (5, 7, &[1, 1, 7, 11, 19]),
    (5, 11, &[1, 1, 5, 1, 1]),
    (5, 13, &[1, 1, 1, 3, 11]),
    (5, 14, &[1, 3, 5, 5, 31]),
    (6, 1, &[1, 3, 3, 9, 7, 49]),
    (6, 13, &[1, 1, 1, 15, 21, 21]),
    (6, 16, &[1, 3, 1, 13, 27, 49]),
    (6, 19, &[1, 1, 1, 15, 7, 5]),
    (6, 22, &[1, 3, 1, 15, 13, 25]),
    (6, 25, &[1, 1, 5, 5, 19, 61]),
    (7, 1, &[1, 3, 7, 11, 23, 15, 103]),
    (7, 4, &[1, 3, 7, 13, 13, 15, 69]),
];

const BITS: u32 = 32;

fn directions(dimension: usize) -> Option<[u32; BITS as usize]> {
    let mut v = [0_u32; BITS as usize];
    if dimension == 0 {
        v.iter_mut().enumerate().for_each(|(i, v)| *v = 1 << (BITS as usize - 1 - i));
        return Some(v);
    }
    let (degree, coefficients, first) = *DIRECTIONS.get(dimension - 1)?;
    let s = degree as usize;
    for i in 0..v.len() {
        if i < s {
            v[i] = first[i] << (BITS as usize - 1 - i);
            continue;
        }
        v[i] = v[i - s] ^ (v[i - s] >> degree);
        for k in 1..s {
            if coefficients >> (s - 1 - k) & 1 == 1 {
                v[i] ^= v[i - k];
            }
        }
    }
    Some(v)
}

/// The first `count` points of a Sobol sequence in `(0, 1)^dimensions`, shifted digit by digit by a seeded random number
/// per dimension. Dimensions beyond 21 are random numbers of the same seed.
pub(super) fn sobol(count: usize, dimensions: usize, seed: u64) -> Vec<Vec<f64>> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut points = vec![vec![0.0; dimensions]; count];
    for dimension in 0..dimensions {
        let shift: u32 = rng.random();
        let directions = directions(dimension);
        for (n, point) in points.iter_mut().enumerate() {
            let digits = match &directions {
                Some(v) => {
                    let gray = n ^ (n >> 1);
                    v.iter().enumerate().filter(|(i, _)| gray >> i & 1 == 1).fold(shift, |x, (_, v)| x ^ v)
                }
                None => rng.random(),
            };
            point[dimension] = (f64::from(digits) + 0.5) / 2.0_f64.powi(BITS as i32);
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Any elementary interval of a dimension's first `2^k` points holds exactly one of them.
    #[test]
    fn every_dimension_is_stratified() {
        let points = sobol(64, 24, 7);
        for dimension in 0..21 {
            let mut cells: Vec<usize> = points.iter().map(|p| (p[dimension] * 64.0) as usize).collect();
            cells.sort_unstable();
            assert_eq!(cells, (0..64).collect::<Vec<_>>(), "dimension {dimension}");
        }
        assert!(points.iter().flatten().all(|x| (0.0..1.0).contains(x)));
        assert_ne!(points, sobol(64, 24, 8));
    }

    /// The first two dimensions form a (0, m, 2)-net: every 8 × 8 cell of 64 points holds one.
    #[test]
    fn the_first_two_dimensions_are_a_net() {
        let mut cells: Vec<usize> =
            sobol(64, 2, 3).iter().map(|p| (p[0] * 8.0) as usize * 8 + (p[1] * 8.0) as usize).collect();
        cells.sort_unstable();
        assert_eq!(cells, (0..64).collect::<Vec<_>>());
    }
}
