//! Orthogonal reduction of the fixed columns of each group, done once.

use super::dense::{Columns, triangle};
use super::problem::{RowGroup, ShapedColumns};
use dynid_factor::factor::{Factor, FactorBuilder};
use dynid_linalg::{Mat, Reflectors};

/// What changing columns are put beside.
#[derive(Debug, Clone, Copy)]
pub(super) enum Target<'a> {
    /// The measured effort: the projection finds all linear parameters.
    Effort,
    /// What given linear parameters leave of it: the projection finds corrections, free of cancellation.
    Residual(&'a [f64]),
}

/// A group whose fixed columns `F = Q [R; 0]` are reduced. Row weights, if any, are part of it; the weight of the group
/// as a whole is not.
#[derive(Debug)]
pub(super) struct GroupReduction {
    root_weights: Option<Vec<f64>>,
    /// `R`: head rows × fixed columns.
    pub(super) head: Columns,
    kind: Kind,
}

#[derive(Debug)]
enum Kind {
    /// Without shaped columns: the effort is reduced as well.
    Constant(Factor),
    /// With shaped columns: `Q` as reflectors.
    Shaped(Reflectors),
}

/// Columns of a group after rotation by `Qᵀ`.
pub(super) struct Rotated {
    /// Head rows of: shaped columns, derivatives, target.
    pub(super) head: Columns,
    /// Triangle of what lies below, in the same columns.
    pub(super) below: Columns,
}

impl GroupReduction {
    /// `root_weights`: factor of every row, `√ω`, all 1 if absent.
    pub(super) fn new(group: &RowGroup, root_weights: Option<&[f64]>) -> Self {
        let (rows, fixed) = (group.rows(), group.fixed.len());
        let weighted = |i: usize, v: f64| root_weights.map_or(v, |w| w[i] * v);
        if group.shaped.is_empty() {
            let mut builder = FactorBuilder::new(fixed);
            builder
                .push_with(rows, |column, range, out| {
                    let source = if column < fixed { group.fixed_column(column) } else { &group.effort };
                    for (o, i) in out.iter_mut().zip(range) {
                        *o = weighted(i, source[i]);
                    }
                })
                .expect("values are finite: the problem was checked");
            let factor = builder.finish();
            let head = columns_of(factor.height(), fixed, |i, j| factor.r(i, j));
            return GroupReduction {
                root_weights: root_weights.map(<[f64]>::to_vec),
                head,
                kind: Kind::Constant(factor),
            };
        }
        let basis = Mat::from_fn(rows, fixed, |i, j| weighted(i, group.fixed_column(j)[i]));
        let basis = Reflectors::of(basis);
        let head = columns_of(basis.height(), fixed, |i, j| basis.r(i, j));
        GroupReduction { root_weights: root_weights.map(<[f64]>::to_vec), head, kind: Kind::Shaped(basis) }
    }

    /// Residual sum of squares that no parameter reaches, of a group without shaped columns.
    pub(super) fn constant_rss(&self) -> f64 {
        match &self.kind {
            Kind::Constant(factor) => factor.rho() * factor.rho(),
            Kind::Shaped(_) => 0.0,
        }
    }

    /// Rotated target of a group without shaped columns, head rows only.
    pub(super) fn constant_target(&self, group: &RowGroup, target: Target<'_>) -> Option<Vec<f64>> {
        let Kind::Constant(factor) = &self.kind else { return None };
        let mut z = factor.z();
        z.truncate(factor.height());
        if let Target::Residual(linear) = target {
            for (k, &column) in group.fixed.iter().enumerate() {
                dynid_linalg::vector::add_scaled(&mut z, -linear[column], self.head.column(k));
            }
        }
        Some(z)
    }

    /// Rotates shaped columns, derivatives and target of a group with shaped columns.
    pub(super) fn rotated(
        &self,
        group: &RowGroup,
        columns: &ShapedColumns,
        target: Target<'_>,
    ) -> Option<Rotated> {
        let Kind::Shaped(basis) = &self.kind else { return None };
        let rows = group.rows();
        let (shaped, dependent) = (group.shaped.len(), group.dependence.len());
        let width = shaped + dependent + 1;
        let mut all = vec![0.0; rows * width];
        for (k, out) in all.chunks_exact_mut(rows.max(1)).enumerate() {
            match k {
                _ if k < shaped => out.copy_from_slice(columns.value(k)),
                _ if k < shaped + dependent => out.copy_from_slice(columns.derivative(k - shaped)),
                _ => out.copy_from_slice(&remainder(group, columns, target)),
            }
            if let Some(weights) = &self.root_weights {
                out.iter_mut().zip(weights).for_each(|(v, w)| *v *= w);
            }
        }
        let height = basis.height();
        basis.apply_transposed(&mut all);
        let part = |from: usize, count: usize| columns_of(count, width, |i, j| all[j * rows + from + i]);
        Some(Rotated { head: part(0, height), below: triangle(part(height, rows - height)) })
    }
}

/// Effort less the known columns, and less the share of given linear parameters.
pub(super) fn remainder(group: &RowGroup, columns: &ShapedColumns, target: Target<'_>) -> Vec<f64> {
    let mut rest = group.effort.clone();
    for (k, column) in group.shaped.iter().enumerate() {
        let factor = match (column, target) {
            (None, _) => 1.0,
            (Some(_), Target::Effort) => continue,
            (Some(column), Target::Residual(linear)) => linear[*column],
        };
        dynid_linalg::vector::add_scaled(&mut rest, -factor, columns.value(k));
    }
    if let Target::Residual(linear) = target {
        for (k, &column) in group.fixed.iter().enumerate() {
            dynid_linalg::vector::add_scaled(&mut rest, -linear[column], group.fixed_column(k));
        }
    }
    rest
}

fn columns_of(rows: usize, count: usize, entry: impl Fn(usize, usize) -> f64) -> Columns {
    let mut out = Columns::zeros(rows, count);
    for j in 0..count {
        for (i, v) in out.column_mut(j).iter_mut().enumerate() {
            *v = entry(i, j);
        }
    }
    out
}
