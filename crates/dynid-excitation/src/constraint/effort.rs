//! Limits of efforts.

use std::ops::Deref;

use dynid_model::{EffortModel, MotionAdjoint, MotionBlock};

use super::gathered::Gathered;
use super::{ConstraintError, ConstraintKind, ConstraintRow, PathConstraint, finite, fixed_base, positive};

/// Rows whose gradients run side by side, few enough to stay in the cache.
const BATCH: usize = 256;

/// Efforts of a nominal model within `±limit`: rows `effort_o / limit_o` in `[-1, 1]`.
///
/// The effort is all that the model knows: rigid bodies, drives, friction. `M` points at the model: a reference, an `Arc`.
#[derive(Debug, Clone)]
pub struct EffortLimits<M> {
    model: M,
    shape: Vec<f64>,
    linear: Vec<f64>,
    /// Output of every row.
    outputs: Vec<usize>,
    rows: Vec<ConstraintRow>,
}

impl<M> EffortLimits<M>
where
    M: Deref + Send + Sync,
    M::Target: EffortModel,
{
    /// `shape`, `linear`: nominal parameters. `limits`: largest effort of every output, N m or N; `None`: no limit, and no
    /// row.
    ///
    /// Fails if a list has another length than the model's, a parameter is not finite, a limit not positive or a joint floats.
    pub fn new(
        model: M,
        shape: Vec<f64>,
        linear: Vec<f64>,
        limits: &[Option<f64>],
    ) -> Result<Self, ConstraintError> {
        let (positions, rates) = model.dimensions();
        fixed_base(positions, rates)?;
        let table = model.parameters();
        let lengths = [
            ("shape parameters", shape.len(), table.shape.len()),
            ("linear parameters", linear.len(), table.linear.len()),
            ("effort limits", limits.len(), model.outputs().len()),
        ];
        for (what, found, expected) in lengths {
            if found != expected {
                return Err(ConstraintError::Length { what, found, expected });
            }
        }
        for (parameter, value) in table.linear.iter().zip(&linear) {
            finite("value", &parameter.name, &[*value])?;
        }
        for (parameter, value) in table.shape.iter().zip(&shape) {
            finite("value", &parameter.name, &[*value])?;
        }
        let mut outputs = Vec::new();
        let mut rows = Vec::new();
        for (o, (output, limit)) in model.outputs().iter().zip(limits).enumerate() {
            let Some(limit) = *limit else { continue };
            positive("effort limit", &output.name, limit)?;
            outputs.push(o);
            rows.push(ConstraintRow {
                kind: ConstraintKind::Effort,
                subject: output.name.clone(),
                lower: -1.0,
                upper: 1.0,
                scale: limit,
                unit: output.unit,
            });
        }
        Ok(EffortLimits { model, shape, linear, outputs, rows })
    }
}

impl<M> PathConstraint for EffortLimits<M>
where
    M: Deref + Send + Sync,
    M::Target: EffortModel,
{
    fn rows(&self) -> &[ConstraintRow] {
        &self.rows
    }

    fn values(&self, motion: &MotionBlock<'_>, stride: usize, values: &mut [f64]) {
        let n = motion.samples;
        let mut effort = vec![0.0; self.model.outputs().len() * n];
        self.model.efforts(motion, &self.shape, &self.linear, n, &mut effort);
        for (r, (output, row)) in self.outputs.iter().zip(&self.rows).enumerate() {
            for (value, e) in values[r * stride..][..n].iter_mut().zip(&effort[output * n..]) {
                *value = e / row.scale;
            }
        }
    }

    fn gradients(&self, motion: &MotionBlock<'_>, wanted: &[(usize, usize)], out: &mut [f64]) {
        let (positions, rates) = self.model.dimensions();
        assert_eq!(out.len(), 3 * rates * wanted.len(), "length of the gradients");
        for (wanted, out) in wanted.chunks(BATCH).zip(out.chunks_mut(3 * rates * BATCH)) {
            let gathered = Gathered::new(motion, wanted.iter().map(|(_, sample)| *sample));
            let n = wanted.len();
            let mut weights = vec![0.0; self.model.outputs().len() * n];
            for (k, (row, _)) in wanted.iter().enumerate() {
                weights[self.outputs[*row] * n + k] = 1.0 / self.rows[*row].scale;
            }
            let mut adjoint = MotionAdjoint::new(positions, rates, n);
            gathered.with_block(motion, |block| {
                self.model.effort_adjoint(block, &self.shape, &self.linear, n, &weights, &mut adjoint);
            });
            let kinds = [&adjoint.q, &adjoint.dq, &adjoint.ddq];
            for (kind, from) in kinds.into_iter().enumerate() {
                for (c, from) in from.chunks_exact(n).enumerate() {
                    for (k, value) in from.iter().enumerate() {
                        out[3 * rates * k + rates * kind + c] = *value;
                    }
                }
            }
        }
    }
}
