//! Models and constraints given as functions of dual numbers, for coordinates that are not joints of a tree.

use std::sync::Arc;

use dynid_linalg::Mat;
use dynid_model::scalar::Dual;
use dynid_model::{MotionAdjoint, MotionBlock};

use crate::constraint::{ConstraintRow, PathConstraint};
use crate::model::{ColumnInfo, ExcitationModel, Sensitivity};

/// Position, rate and acceleration of all coordinates at one instant as variables: derivatives are ordered
/// `[q; q̇; q̈]`, so `N` is three times the number of coordinates.
#[derive(Debug, Clone, Copy)]
pub struct DualState<'a, const N: usize> {
    /// Positions.
    pub q: &'a [Dual<N>],
    /// Rates.
    pub dq: &'a [Dual<N>],
    /// Accelerations.
    pub ddq: &'a [Dual<N>],
}

/// Writes the outputs of a function of the motion at a state: the entries of a [`DualModel`], the values of a
/// [`DualConstraint`].
pub type DualMap<const N: usize> = Arc<dyn Fn(DualState<'_, N>, &mut [Dual<N>]) + Send + Sync>;

/// A function of the motion at one instant with exact derivatives.
#[derive(Clone)]
struct DualFunction<const N: usize> {
    outputs: usize,
    map: DualMap<N>,
}

impl<const N: usize> DualFunction<N> {
    /// Calls `work(sample, outputs)` for the given samples.
    fn each(
        &self,
        motion: &MotionBlock<'_>,
        samples: impl Iterator<Item = usize>,
        mut work: impl FnMut(usize, &[Dual<N>]),
    ) {
        let n = N / 3;
        let zero = Dual { value: 0.0, derivative: [0.0; N] };
        let mut out = vec![zero; self.outputs];
        for sample in samples {
            let variables = |channel: &[f64], first: usize| -> Vec<Dual<N>> {
                (0..n).map(|c| Dual::variable(channel[c * motion.stride + sample], first + c)).collect()
            };
            let (q, dq, ddq) =
                (variables(motion.q, 0), variables(motion.dq, n), variables(motion.ddq, 2 * n));
            out.fill(zero);
            (self.map)(DualState { q: &q, dq: &dq, ddq: &ddq }, &mut out);
            work(sample, &out);
        }
    }
}

/// An observation matrix given as a function of dual numbers: output after output, column after column within.
#[derive(Clone)]
pub struct DualModel<const N: usize> {
    columns: Vec<ColumnInfo>,
    outputs: usize,
    function: DualFunction<N>,
}

impl<const N: usize> DualModel<N> {
    /// `map` writes `outputs × columns` entries, row by row.
    ///
    /// # Panics
    /// If `N` is not a multiple of three.
    pub fn new(outputs: usize, columns: Vec<ColumnInfo>, map: DualMap<N>) -> Self {
        assert!(N.is_multiple_of(3), "three derivatives per coordinate");
        let function = DualFunction { outputs: outputs * columns.len(), map };
        DualModel { columns, outputs, function }
    }
}

impl<const N: usize> ExcitationModel for DualModel<N> {
    fn coordinates(&self) -> usize {
        N / 3
    }

    fn outputs(&self) -> usize {
        self.outputs
    }

    fn columns(&self) -> &[ColumnInfo] {
        &self.columns
    }

    fn observe(&self, motion: &MotionBlock<'_>, w: &mut Mat) {
        let p = self.columns.len();
        self.function.each(motion, 0..motion.samples, |sample, entries| {
            for (k, entry) in entries.iter().enumerate() {
                w[(k / p * motion.samples + sample, k % p)] = entry.value;
            }
        });
    }

    fn adjoint(&self, motion: &MotionBlock<'_>, sensitivity: Sensitivity<'_>, out: &mut MotionAdjoint) {
        let (n, p, samples) = (N / 3, self.columns.len(), motion.samples);
        self.function.each(motion, 0..samples, |sample, entries| {
            for (k, entry) in entries.iter().enumerate() {
                let (row, column) = (k / p * samples + sample, k % p);
                let g = match sensitivity {
                    Sensitivity::Full(g) => g[(row, column)],
                    Sensitivity::Outer(terms) => terms.iter().map(|(u, v)| u[row] * v[column]).sum(),
                };
                for c in 0..n {
                    out.q[c * samples + sample] += g * entry.derivative[c];
                    out.dq[c * samples + sample] += g * entry.derivative[n + c];
                    out.ddq[c * samples + sample] += g * entry.derivative[2 * n + c];
                }
            }
        });
    }
}

/// Path constraints given as a function of dual numbers, one normalised value per row.
#[derive(Clone)]
pub struct DualConstraint<const N: usize> {
    rows: Vec<ConstraintRow>,
    function: DualFunction<N>,
}

impl<const N: usize> DualConstraint<N> {
    /// `map` writes one value per row.
    ///
    /// # Panics
    /// If `N` is not a multiple of three.
    pub fn new(rows: Vec<ConstraintRow>, map: DualMap<N>) -> Self {
        assert!(N.is_multiple_of(3), "three derivatives per coordinate");
        DualConstraint { function: DualFunction { outputs: rows.len(), map }, rows }
    }
}

impl<const N: usize> PathConstraint for DualConstraint<N> {
    fn rows(&self) -> &[ConstraintRow] {
        &self.rows
    }

    fn values(&self, motion: &MotionBlock<'_>, stride: usize, values: &mut [f64]) {
        self.function.each(motion, 0..motion.samples, |sample, rows| {
            for (r, row) in rows.iter().enumerate() {
                values[r * stride + sample] = row.value;
            }
        });
    }

    fn gradients(&self, motion: &MotionBlock<'_>, wanted: &[(usize, usize)], out: &mut [f64]) {
        let mut place = 0;
        self.function.each(motion, wanted.iter().map(|w| w.1), |_, rows| {
            let gradient = &rows[wanted[place].0].derivative;
            out[place * N..(place + 1) * N].copy_from_slice(gradient);
            place += 1;
        });
    }
}
