//! Rows of the tree's regressor, folded into rows of the drives.

use std::sync::Arc;

use super::expand::Expanded;
use crate::closed::ClosedMechanism;
use crate::effort_model::{EffortModel, RegressorBlock, RegressorLayout};
use crate::tree_model::TreeModel;

/// A column of the tree that goes into one of an output.
#[derive(Clone, Copy, Debug)]
pub(super) struct Term {
    pub(super) rate: usize,
    /// Which of the acting columns of the rate; of shaped columns and derivatives: its index.
    pub(super) column: usize,
}

/// Which columns of the tree an output's columns are sums of.
#[derive(Debug)]
pub(super) struct Fold {
    pub(super) layout: Arc<RegressorLayout>,
    /// Rates whose effort an output feels.
    rates: Vec<Vec<usize>>,
    /// Per output and acting column.
    pub(super) terms: Vec<Vec<Vec<Term>>>,
    /// Columns that change with shape parameters: `(output, linear column)`.
    pub(super) shaped: Vec<(usize, usize)>,
    shaped_terms: Vec<Vec<Term>>,
    /// `(index into shaped, shape parameter)`.
    pub(super) dependence: Vec<(usize, usize)>,
    dependence_terms: Vec<Vec<Term>>,
}

impl Fold {
    /// `further`: columns per output that get their values elsewhere, zero here.
    pub(super) fn new(tree: &TreeModel, machine: &ClosedMechanism, further: &[Vec<usize>]) -> Fold {
        let independent = machine.drives_are_independent();
        let rates: Vec<Vec<usize>> = machine
            .driven()
            .iter()
            .map(|own| {
                let feels = |r: &usize| !independent || r == own || machine.dependent().contains(r);
                (0..machine.mechanism().rates()).filter(feels).collect()
            })
            .collect();
        let layout = tree.layout();
        let mut columns: Vec<Vec<usize>> = Vec::with_capacity(rates.len());
        let mut terms = Vec::with_capacity(rates.len());
        for (output, rates) in rates.iter().enumerate() {
            let mut acting: Vec<usize> =
                rates.iter().flat_map(|r| layout.columns(*r).iter().copied()).collect();
            acting.extend(further.get(output).into_iter().flatten());
            acting.sort_unstable();
            acting.dedup();
            let mut own: Vec<Vec<Term>> = vec![Vec::new(); acting.len()];
            for rate in rates {
                for (k, column) in layout.columns(*rate).iter().enumerate() {
                    if let Ok(at) = acting.binary_search(column) {
                        own[at].push(Term { rate: *rate, column: k });
                    }
                }
            }
            columns.push(acting);
            terms.push(own);
        }
        let mut fold = Fold {
            layout: Arc::new(RegressorLayout::new(columns, layout.parameters())),
            rates,
            terms,
            shaped: Vec::new(),
            shaped_terms: Vec::new(),
            dependence: Vec::new(),
            dependence_terms: Vec::new(),
        };
        fold.shapes(tree);
        fold
    }

    fn shapes(&mut self, tree: &TreeModel) {
        for (output, rates) in self.rates.iter().enumerate() {
            for (index, (rate, column)) in tree.shaped_columns().iter().enumerate() {
                if !rates.contains(rate) {
                    continue;
                }
                let at = match self.shaped.iter().position(|s| *s == (output, *column)) {
                    Some(at) => at,
                    None => {
                        self.shaped.push((output, *column));
                        self.shaped_terms.push(Vec::new());
                        self.shaped.len() - 1
                    }
                };
                self.shaped_terms[at].push(Term { rate: *rate, column: index });
                for (d, (of, parameter)) in tree.shape_dependence().iter().enumerate() {
                    if *of != index {
                        continue;
                    }
                    let pair = (at, *parameter);
                    let place = match self.dependence.iter().position(|p| *p == pair) {
                        Some(place) => place,
                        None => {
                            self.dependence.push(pair);
                            self.dependence_terms.push(Vec::new());
                            self.dependence.len() - 1
                        }
                    };
                    self.dependence_terms[place].push(Term { rate: *rate, column: d });
                }
            }
        }
    }

    /// Rates whose effort an output feels.
    pub(super) fn rates(&self, output: usize) -> impl Iterator<Item = usize> {
        self.rates[output].iter().copied()
    }

    pub(super) fn regressor(&self, expanded: &Expanded, tree: &RegressorBlock, out: &mut RegressorBlock) {
        out.start(&self.layout, expanded.samples);
        for (output, terms) in self.terms.iter().enumerate() {
            for (k, terms) in terms.iter().enumerate() {
                let to = out.column_mut(output, k);
                to.fill(0.0);
                for term in terms {
                    expanded.add(output, term.rate, tree.column(term.rate, term.column), to);
                }
            }
            for rate in self.rates(output) {
                expanded.add(output, rate, tree.offset(rate), out.offset_mut(output));
            }
        }
    }

    pub(super) fn shaped_values(&self, expanded: &Expanded, tree: &[f64], stride: usize, out: &mut [f64]) {
        let outputs = self.shaped.iter().map(|s| s.0);
        fold_all(expanded, outputs.zip(&self.shaped_terms), tree, stride, out);
    }

    pub(super) fn shaped_derivatives(
        &self,
        expanded: &Expanded,
        tree: &[f64],
        stride: usize,
        out: &mut [f64],
    ) {
        let outputs = self.dependence.iter().map(|(s, _)| self.shaped[*s].0);
        fold_all(expanded, outputs.zip(&self.dependence_terms), tree, stride, out);
    }
}

fn fold_all<'a>(
    expanded: &Expanded,
    columns: impl Iterator<Item = (usize, &'a Vec<Term>)>,
    tree: &[f64],
    stride: usize,
    out: &mut [f64],
) {
    if out.is_empty() {
        return;
    }
    let n = expanded.samples;
    for (k, (output, terms)) in columns.enumerate() {
        let to = &mut out[k * stride..][..n];
        to.fill(0.0);
        for term in terms {
            expanded.add(output, term.rate, &tree[term.column * n..][..n], to);
        }
    }
}
