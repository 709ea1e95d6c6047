//! Between the state of a recursive estimator and factors of logs.

use dynid_online::SquareRoot;

use dynid_factor::Factor;

/// Recursive state with the information of a factor, parameters divided by `scale`, rows divided by `sigma`.
///
/// A factor of fewer rows than parameters gives a singular state. Panics unless `scale` has one entry per
/// column.
pub fn root_from_factor(factor: &Factor, scale: &[f64], sigma: f64) -> SquareRoot {
    let p = factor.columns();
    assert_eq!(scale.len(), p, "one scale per column");
    let mut root = SquareRoot::new(p);
    let z = factor.z();
    for (i, z) in z.iter().enumerate() {
        let mut row = vec![0.0; p + 1];
        for j in i..p {
            row[j] = factor.r(i, j) * scale[j] / sigma;
        }
        row[p] = z / sigma;
        root.push(&mut row);
    }
    let rho = factor.rho() / sigma;
    root.set_remainder(root.rss() + rho * rho, factor.rows() as f64);
    root
}

/// Factor with the information of a recursive state whose parameters are in units of `scale`.
///
/// `N` is the discounted number of rows, rounded. Rows of the state were divided by their deviations, so the
/// factor is weighted by `1/σ`. Panics unless `scale` has one entry per column.
pub fn factor_from_root(root: &SquareRoot, scale: &[f64]) -> Factor {
    let p = root.columns();
    assert_eq!(scale.len(), p, "one scale per column");
    let entry = |i: usize, j: usize| if j < p { root.r(i, j) / scale[j] } else { root.z(i) };
    Factor::from_triangle(p, entry, root.rss().sqrt(), root.weight().round() as usize)
}
