//! Products and decompositions multiply back.

use dynid_linalg::{AsView, Mat, PivotedQr, QrRoom, Reflectors, multiply_into, pivots, right_singular};

/// Numbers between -1 and 1 without a pattern.
fn random(rows: usize, columns: usize, seed: u64) -> Mat {
    let mut state = seed;
    Mat::from_fn(rows, columns, |_, _| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    })
}

/// Rounding of products of small matrices with entries of the order of 1: some tens of roundings.
const ROUNDING: f64 = 100.0 * f64::EPSILON;

#[track_caller]
fn same(found: &Mat, expected: &Mat) {
    assert_eq!((found.nrows(), found.ncols()), (expected.nrows(), expected.ncols()));
    let off = (found - expected).norm_l2();
    assert!(off <= ROUNDING * (1.0 + expected.norm_l2()), "{off:e} between {found:?} and {expected:?}");
}

fn diagonal(values: &[f64]) -> Mat {
    Mat::from_fn(values.len(), values.len(), |i, j| if i == j { values[i] } else { 0.0 })
}

#[test]
fn products_sums_and_parts_are_those_of_their_entries() {
    let (a, b) = (random(5, 3, 1), random(3, 4, 2));
    let entry = |i: usize, j: usize| a.row(i).zip(b.col(j)).map(|(a, b)| a * b).sum::<f64>();
    let product = Mat::from_fn(5, 4, entry);
    same(&(&a * &b), &product);
    same(&(b.transpose() * a.transpose()), &product.transpose().to_mat());
    let mut flat = vec![f64::NAN; 20];
    let columns = |m: &Mat| m.col_iter().flatten().copied().collect::<Vec<f64>>();
    multiply_into(&mut flat, &columns(&a), &columns(&b), (5, 3, 4));
    same(&Mat::from_fn(5, 4, |i, j| flat[5 * j + i]), &product);
    assert_eq!(a.times(b.col(1)).len(), 5);
    same(&Mat::column(&a.times(b.col(1))), &product.columns(1..2).to_mat());

    same(&(&a + &a - &a * 3.0), &(&a * -1.0));
    let mut sum = a.clone();
    sum += &a * 2.0;
    sum -= a.view();
    sum *= 0.5;
    same(&sum, &a);
    let mut stacked = Mat::zeros(6, 3);
    stacked.set_rows(1, &a);
    assert_eq!(stacked.rows(1..6).to_mat(), a);
    stacked.truncate_columns(2);
    assert_eq!(stacked.rows(1..6).to_mat(), a.columns(0..2).to_mat());
    let length = a.col(2).iter().map(|x| x * x).sum::<f64>();
    assert!(
        (a.col_squares(2) - length).abs() <= ROUNDING && (a.col_norm(2) - length.sqrt()).abs() <= ROUNDING
    );
}

#[test]
fn decompositions_multiply_back() {
    let a = random(6, 4, 3);
    let gram = a.transpose() * &a;
    let cholesky = gram.cholesky().unwrap();
    same(&(cholesky.lower() * cholesky.lower().transpose()), &gram);
    let b = random(4, 2, 4);
    same(&(&gram * cholesky.solve(&b)), &b);
    assert_eq!(Mat::column(&cholesky.solve_vector(b.col(0))), cholesky.solve(&b.columns(0..1)));
    assert!((&gram * -1.0).cholesky().is_none(), "not positive definite");

    let eigen = gram.symmetric_eigen().unwrap();
    assert!(eigen.values.is_sorted());
    same(&(&eigen.vectors * diagonal(&eigen.values) * eigen.vectors.transpose()), &gram);
    for lu in [gram.lu(), gram.full_lu()] {
        same(&(&gram * lu.solve(&b)), &b);
        same(&(&gram * lu.inverse()), &Mat::identity(4, 4));
    }

    for svd in [a.svd().unwrap(), a.thin_svd().unwrap()] {
        assert!(svd.values.is_sorted_by(|x, y| x >= y));
        assert_eq!(svd.values.len(), 4);
        same(&(svd.u.columns(0..4) * diagonal(&svd.values) * svd.v.transpose()), &a);
    }
    let values = a.singular_values().unwrap();
    let squares: Vec<f64> = eigen.values.iter().rev().copied().collect();
    same(&diagonal(&values.iter().map(|s| s * s).collect::<Vec<_>>()), &diagonal(&squares));
    let (values, v) = right_singular(&gram).unwrap();
    same(&(&v * diagonal(&values) * v.transpose()), &gram);
}

#[test]
fn triangles_of_tall_and_wide_matrices() {
    for (rows, columns) in [(40, 20), (20, 20), (7, 20)] {
        let a = random(rows, columns, 5);
        let gram = a.transpose() * &a;
        let qr = a.qr();
        same(&(qr.q().columns(0..rows.min(columns)) * qr.r()), &a);
        let mut tall = Mat::zeros(rows + 3, columns);
        tall.set_rows(0, &a);
        QrRoom::new(rows + 3, columns).reduce(&mut tall, rows);
        let height = rows.min(columns);
        let r = Mat::from_fn(height, columns, |i, j| if i <= j { tall[(i, j)] } else { 0.0 });
        same(&(r.transpose() * &r), &gram);
        assert_eq!(tall.rows(rows..rows + 3).to_mat(), Mat::zeros(3, columns));

        let reflectors = Reflectors::of(a.clone());
        assert_eq!(reflectors.height(), height);
        let mut rotated: Vec<f64> = a.col_iter().flatten().copied().collect();
        reflectors.apply_transposed(&mut rotated);
        let of_r = Mat::from_fn(rows, columns, |i, j| if i < height { reflectors.r(i, j) } else { 0.0 });
        same(&Mat::from_fn(rows, columns, |i, j| rotated[rows * j + i]), &of_r);
    }
    let a = random(9, 4, 6);
    let b = random(9, 1, 7);
    let left = &b - &a * a.qr().solve_least_squares(&b);
    same(&(a.transpose() * left), &Mat::zeros(4, 1));

    let square = random(4, 4, 8);
    same(&(&square * square.pivoted_qr().solve(&random(4, 1, 9))), &random(4, 1, 9));
    let pivoted = PivotedQr::new(&a.rows(0..9));
    let (order, lengths) = pivots(square.clone());
    assert!(lengths.is_sorted_by(|x, y| x >= y));
    assert_eq!(
        {
            let mut all = order.clone();
            all.sort_unstable();
            all
        },
        [0, 1, 2, 3]
    );
    assert_eq!(pivoted.thin_q().ncols(), 4);
    assert!(
        (pivoted.r()[(0, 0)].abs() - (0..4).map(|j| a.col_norm(j)).fold(0.0, f64::max)).abs() <= ROUNDING
    );
    assert!(pivoted.r().norm_max() >= pivoted.r()[(3, 3)].abs());
}
