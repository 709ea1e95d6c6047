//! Identities of factors on random rows, and what bad rows are answered.
#![expect(clippy::unwrap_used, reason = "in tests a panic is the report")]

use dynid_estimate::linear::{WlsSettings, ols, ols_values, wls};
use dynid_factor::rank::{base_columns, numerical_rank};
use dynid_factor::{Factor, FactorBuilder, FactorError};
use proptest::prelude::*;

#[derive(Debug, Clone)]
struct Rows {
    columns: usize,
    w: Vec<Vec<f64>>,
    y: Vec<f64>,
    x: Vec<f64>,
}

impl Rows {
    fn factor(&self, range: std::ops::Range<usize>, chunk: usize) -> Factor {
        let mut builder = FactorBuilder::with_chunk_rows(self.columns, chunk);
        for i in range {
            builder.push_row(&self.w[i], self.y[i]).unwrap();
        }
        builder.finish()
    }

    fn residuals(&self) -> Vec<f64> {
        let predict = |row: &[f64]| row.iter().zip(&self.x).map(|(w, x)| w * x).sum::<f64>();
        self.w.iter().zip(&self.y).map(|(row, y)| y - predict(row)).collect()
    }

    /// Sizes that rounding is relative to: of the residual, and of each column.
    fn sizes(&self) -> (f64, Vec<f64>) {
        let norms: Vec<f64> =
            (0..self.columns).map(|j| self.w.iter().map(|r| r[j] * r[j]).sum::<f64>().sqrt()).collect();
        let effort = self.y.iter().map(|v| v * v).sum::<f64>().sqrt();
        (effort + norms.iter().zip(&self.x).map(|(n, x)| n * x.abs()).sum::<f64>(), norms)
    }
}

/// 1 to 6 columns (some zero, some repeated, scales over 8 decades), 1 to 40 rows.
fn rows() -> impl Strategy<Value = Rows> {
    (1_usize..=6, 1_usize..=40).prop_flat_map(|(columns, count)| {
        let entries = prop::collection::vec(prop::collection::vec(-1.0..1.0_f64, columns), count);
        let scales = prop::collection::vec(prop_oneof![Just(0.0), 1e-4..1e4_f64], columns);
        let efforts = prop::collection::vec(-10.0..10.0_f64, count);
        let x = prop::collection::vec(-2.0..2.0_f64, columns);
        (entries, scales, efforts, x, any::<bool>()).prop_map(move |(mut w, scales, y, x, repeat)| {
            for row in &mut w {
                row.iter_mut().zip(&scales).for_each(|(v, s)| *v *= s);
                if repeat {
                    row[columns - 1] = row[0];
                }
            }
            Rows { columns, w, y, x }
        })
    })
}

proptest! {
    #[test]
    fn rss_and_score_equal_those_of_the_rows(rows in rows(), chunk in 1_usize..50) {
        let factor = rows.factor(0..rows.y.len(), chunk);
        let (size, norms) = rows.sizes();
        let residuals = rows.residuals();
        let rss: f64 = residuals.iter().map(|r| r * r).sum();
        prop_assert!((factor.rss(&rows.x) - rss).abs() <= 1e-11 * size * size);
        for (j, score) in factor.score(&rows.x).iter().enumerate() {
            let expected: f64 = rows.w.iter().zip(&residuals).map(|(row, r)| row[j] * r).sum();
            prop_assert!((score - expected).abs() <= 1e-11 * size * norms[j]);
        }
        prop_assert_eq!(factor.rows(), rows.y.len());
        prop_assert!(factor.height() <= rows.columns.min(rows.y.len()));
    }

    #[test]
    fn merge_scale_select_embed_and_centre_keep_the_loss(rows in rows(), cut in 0.0..1.0_f64) {
        let count = rows.y.len();
        let middle = (cut * count as f64) as usize;
        let (size, _) = rows.sizes();
        let whole = rows.factor(0..count, 64);
        let loss = whole.rss(&rows.x);
        let tolerance = 1e-11 * size * size;

        let merged = Factor::merge(&[&rows.factor(0..middle, 64), &rows.factor(middle..count, 64)]);
        prop_assert_eq!(merged.rows(), count);
        prop_assert!((merged.rss(&rows.x) - loss).abs() <= tolerance);

        prop_assert!((whole.scaled(-3.0).rss(&rows.x) - 9.0 * loss).abs() <= 9.0 * tolerance);

        let reversed: Vec<usize> = (0..rows.columns).rev().collect();
        let x_reversed: Vec<f64> = rows.x.iter().rev().copied().collect();
        prop_assert!((whole.select(&reversed).rss(&x_reversed) - loss).abs() <= tolerance);

        for positions in [(0..rows.columns).map(|c| 2 * c + 1).collect::<Vec<_>>(), reversed] {
            let total = 2 * rows.columns + 1;
            let mut x = vec![5.0; total];
            positions.iter().zip(&rows.x).for_each(|(&p, v)| x[p] = *v);
            let wide = whole.embed(total, &positions);
            prop_assert!((wide.rss(&x) - loss).abs() <= tolerance);
            prop_assert_eq!(wide.rows(), count);
        }

        let origin = vec![0.0; rows.columns];
        prop_assert!((whole.centred(&rows.x).rss(&origin) - loss).abs() <= tolerance);
    }

    /// The loss where a parameter is free is the least over it.
    #[test]
    fn a_freed_column_has_the_value_that_fits_best(rows in rows(), at in 0.0..1.0_f64) {
        let column = ((at * rows.columns as f64) as usize).min(rows.columns - 1);
        let whole = rows.factor(0..rows.y.len(), 16);
        let freed = whole.freed_of(&[column]);
        let (size, norms) = rows.sizes();
        let mut rest = rows.x.clone();
        rest.remove(column);
        let without = Rows { x: (0..rows.columns).map(|c| if c == column { 0.0 } else { rows.x[c] }).collect(), ..rows.clone() };
        let residuals = without.residuals();
        let loss: f64 = residuals.iter().map(|r| r * r).sum();
        let along: f64 = rows.w.iter().zip(&residuals).map(|(row, r)| row[column] * r).sum();
        let norm = norms[column];
        let (found, tolerance) = (freed.rss(&rest), 1e-10 * size * size);
        if norm > 0.0 {
            let least = loss - (along / norm).powi(2);
            prop_assert!((found - least).abs() <= tolerance, "{} {}", found, least);
        } else {
            prop_assert!(found <= loss + tolerance);
        }
        prop_assert_eq!(freed.columns(), rows.columns - 1);
        prop_assert_eq!(freed.rows(), rows.y.len() - 1);
    }

    #[test]
    fn least_squares_leaves_no_gradient_whatever_the_rank(rows in rows()) {
        let factor = rows.factor(0..rows.y.len(), 16);
        let solution = ols(&factor);
        prop_assert_eq!(ols_values(&factor), (solution.x.clone(), solution.rss));
        prop_assert!(solution.x.iter().all(|v| v.is_finite()));
        prop_assert_eq!(solution.kept.len(), solution.rank.rank);
        prop_assert_eq!(
            solution.rank.rank + solution.rank.dependent.len() + solution.rank.unexcited.len(),
            rows.columns
        );
        let solved = Rows { x: solution.x.clone(), ..rows };
        let (size, norms) = solved.sizes();
        for (g, norm) in factor.score(&solution.x).iter().zip(&norms) {
            prop_assert!(g.abs() <= 1e-9 * size * norm, "gradient {} for column norm {}", g, norm);
        }
        prop_assert!((factor.rss(&solution.x) - solution.rss).abs() <= 1e-9 * size * size);
    }

    #[test]
    fn kept_columns_regroup_the_dependent_ones(rows in rows()) {
        let factor = rows.factor(0..rows.y.len(), 16);
        let order: Vec<usize> = (0..rows.columns).collect();
        let base = base_columns(&factor, &order);
        prop_assert_eq!(base.kept.len(), numerical_rank(&factor).rank);
        let norms = factor.column_norms();
        for (j, &column) in base.dependent.iter().enumerate() {
            for row in &rows.w {
                let terms = base.kept.iter().enumerate().map(|(i, &c)| row[c] * base.regrouping[(i, j)]);
                let size: f64 = terms.clone().map(f64::abs).sum::<f64>() + norms[column];
                prop_assert!((row[column] - terms.sum::<f64>()).abs() <= 1e-8 * size);
            }
        }
    }
}

#[test]
fn leverages_sum_to_the_rank_with_dependent_and_unexcited_columns() {
    let rows = |offset: f64, noise: f64| {
        let mut builder = FactorBuilder::new(4);
        for k in 0..30 {
            let t = offset + f64::from(k);
            let (a, b) = (t.sin(), (0.7 * t).cos());
            builder.push_row(&[a, 1e3 * b, 0.0, a - b], 2.0 * a + noise * (5.3 * t).sin()).unwrap();
        }
        builder.finish()
    };
    let estimate = wls(&[rows(0.0, 0.1), rows(100.0, 10.0)], &WlsSettings::default());
    let leverage: f64 = estimate.groups.iter().map(|g| g.leverage).sum();
    assert!((leverage - 2.0).abs() < 1e-12, "{leverage}");
    assert_eq!(estimate.solution.rank.unexcited, [2]);
    assert_eq!(estimate.solution.dropped.len(), 2);
    assert!(estimate.converged);
}

#[test]
fn exact_and_silent_groups_stay_finite() {
    let mut exact = FactorBuilder::new(2);
    let mut silent = FactorBuilder::new(2);
    for k in 0..20 {
        let t = f64::from(k);
        exact.push_row(&[t.sin(), t.cos()], 3.0 * t.sin()).unwrap();
        silent.push_row(&[0.0, 0.0], 0.0).unwrap();
    }
    let estimate = wls(&[exact.finish(), silent.finish(), Factor::empty(2)], &WlsSettings::default());
    assert!((estimate.solution.x[0] - 3.0).abs() < 1e-12);
    assert!(estimate.groups.iter().all(|g| g.variance.is_finite() && g.variance > 0.0 && g.at_floor));
}

#[test]
fn bad_rows_are_named() {
    let mut builder = FactorBuilder::with_chunk_rows(2, 3);
    for k in 0..7 {
        builder.push_row(&[1.0, f64::from(k)], 0.0).unwrap();
    }
    let error = builder.push_block(&[1.0, 2.0, 3.0, f64::NAN], 2, &[0.0, 0.0]).unwrap_err();
    assert!(matches!(error, FactorError::NotFinite { row: 8, column: Some(1), .. }), "{error}");
    let error = builder.push_row(&[1.0, 2.0], f64::INFINITY).unwrap_err();
    assert_eq!(error.to_string(), "row 7, effort: expected a finite number, found inf");
    let error = builder.push_block(&[1.0, 2.0, 3.0], 2, &[0.0, 0.0]).unwrap_err();
    assert!(matches!(error, FactorError::BlockShape { expected: 4, found: 3, .. }), "{error}");
}
