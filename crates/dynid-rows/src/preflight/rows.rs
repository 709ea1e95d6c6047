//! Rows of a trial: the regressor along rewired positions, with every column of effort beside it.

use std::borrow::Cow;

use dynid_model::{EffortModel, MotionBlock, RegressorBlock, ShapeParameter};

use super::samples::Samples;
use super::wiring::{Source, Wiring};
use crate::conditioning::KeptColumns;
use dynid_factor::factor::{Factor, FactorBuilder, FactorError};

/// Standard deviation of an effort that a good model leaves, as a share of its own.
const RELATIVE_ERROR: f64 = 0.1;
/// Independent errors of a model per second.
const PER_SECOND: f64 = 4.0;
/// Rows stacked before a triangle is renewed.
const CHUNK_ROWS: usize = 256;

/// Factors of `[W | every effort]` for one wiring of positions, per output.
#[derive(Debug, Clone)]
pub(crate) struct TrialRows {
    /// Per output.
    factors: Vec<Factor>,
    columns: KeptColumns,
    joints: usize,
    /// Per column of effort: standard deviation over the record.
    spread: Vec<f64>,
    duration_s: f64,
    samples: usize,
}

/// Signals of joints as a wiring understands them, coordinate after coordinate.
struct Wired {
    q: Vec<f64>,
    dq: Vec<f64>,
    ddq: Vec<f64>,
}

impl Wired {
    fn new(samples: &Samples, wiring: &Wiring) -> Self {
        let take =
            |signal: fn(&super::samples::JointSamples) -> &Vec<f64>, per: f64, zero: f64| -> Vec<f64> {
                let of = |s: &Source| {
                    let (factor, offset) = (s.factor / per, zero * s.offset);
                    signal(&samples.joints[s.joint]).iter().map(move |x| factor * x + offset)
                };
                wiring.position.iter().flat_map(of).collect()
            };
        Wired {
            q: take(|j| &j.position, 1.0, 1.0),
            dq: take(|j| &j.velocity, wiring.clock, 0.0),
            ddq: take(|j| &j.acceleration, wiring.clock * wiring.clock, 0.0),
        }
    }

    fn block<'a>(
        &'a self,
        samples: usize,
        channels: &'a [(&'a str, &'a [f64])],
        gravity: Option<&'a [f64]>,
    ) -> MotionBlock<'a> {
        MotionBlock {
            samples,
            stride: samples,
            q: &self.q,
            dq: &self.dq,
            ddq: &self.ddq,
            gravity,
            channels,
            sign_width: 0.0,
        }
    }
}

/// Shape parameters under another clock: speeds at which friction changes go with the clock. They are starts that nothing is known of, and
/// where they are off, a clock must not win by putting them right.
fn under_clock<'a>(model: &dyn EffortModel, shape: &'a [f64], clock: f64) -> Cow<'a, [f64]> {
    let table = &model.parameters().shape;
    if clock == 1.0 || table.is_empty() {
        return Cow::Borrowed(shape);
    }
    let value = |(x, p): (&f64, &ShapeParameter)| match p.unit {
        "rad/s" | "m/s" => x / clock,
        "s/rad" | "s/m" => x * clock,
        _ => *x,
    };
    Cow::Owned(shape.iter().zip(table).map(value).collect())
}

/// Regressor of a model along wired positions, under the wiring's gravity.
pub(crate) fn regressor(
    model: &dyn EffortModel,
    shape: &[f64],
    samples: &Samples,
    wiring: &Wiring,
) -> RegressorBlock {
    let n = samples.len();
    let wired = Wired::new(samples, wiring);
    let channels: Vec<(&str, &[f64])> =
        samples.channels.iter().map(|c| (c.name.as_str(), c.values.as_slice())).collect();
    let constant: Option<Vec<f64>> =
        wiring.gravity.map(|g| g.iter().flat_map(|x| std::iter::repeat_n(*x, n)).collect());
    let mut block = RegressorBlock::new(model.layout().clone(), n);
    let shape = under_clock(model, shape, wiring.clock);
    model.regressor(&wired.block(n, &channels, constant.as_deref()), &shape, &mut block);
    block
}

impl TrialRows {
    /// Rows off reversal of every output along wired positions, with every effort beside them.
    ///
    /// # Errors
    /// [`FactorError`] where the regressor is not finite.
    pub(crate) fn new(
        model: &dyn EffortModel,
        shape: &[f64],
        kept: &[usize],
        samples: &Samples,
        wiring: &Wiring,
    ) -> Result<Self, FactorError> {
        let block = regressor(model, shape, samples, wiring);
        let columns = KeptColumns::new(model, kept);
        let efforts: Vec<&[f64]> = samples.joints.iter().map(|j| j.effort.as_slice()).collect();
        let factors = (0..samples.joints.len())
            .map(|output| {
                let parts = reduce(&block, &columns, samples, &wiring.position, output, &efforts, 1)?;
                Ok(Factor::merge(&parts.iter().collect::<Vec<_>>()))
            })
            .collect::<Result<Vec<_>, FactorError>>()?;
        Ok(TrialRows {
            factors,
            columns,
            joints: samples.joints.len(),
            spread: efforts.iter().map(|e| deviation(e)).collect(),
            duration_s: samples.duration_s,
            samples: samples.len(),
        })
    }

    /// Weighted factor of all base columns with the efforts of a wiring: residuals count in units of a tenth of the effort's
    /// standard deviation, four of them a second.
    pub(crate) fn weighted(&self, wiring: &Wiring) -> Factor {
        let parts: Vec<Factor> = (0..self.joints)
            .filter_map(|output| {
                let source = wiring.effort[output];
                let factor = self.output(output, source)?;
                let weight = self.weight(factor.rows(), self.spread[source.joint] * source.factor.abs())?;
                Some(factor.scaled(weight).embed(self.columns.total, &self.columns.global[output]))
            })
            .collect();
        match parts.is_empty() {
            true => Factor::empty(self.columns.total),
            false => Factor::merge(&parts.iter().collect::<Vec<_>>()),
        }
    }

    fn weight(&self, rows: usize, spread: f64) -> Option<f64> {
        row_weight(rows, spread, self.duration_s, self.samples)
    }

    /// Factor of one output's own columns with the effort of a source; `None` without rows.
    fn output(&self, output: usize, source: Source) -> Option<Factor> {
        let p = self.columns.local[output].len();
        let all = Some(&self.factors[output]).filter(|f| f.rows() > 0)?;
        let height = all.height();
        let r = |i: usize, k: usize| if i < height { all.r(i, k) } else { 0.0 };
        let effort = |i: usize| source.factor * r(i, p + source.joint);
        let entry = |i: usize, k: usize| if k < p { r(i, k) } else { effort(i) };
        let below = (p..height).map(|i| effort(i).powi(2)).sum::<f64>().sqrt();
        Some(Factor::from_triangle(p, entry, below, all.rows()))
    }
}

/// Root weight of the rows of an output; `None` for an effort that never changes.
pub(crate) fn row_weight(rows: usize, spread: f64, duration_s: f64, samples: usize) -> Option<f64> {
    let rows = rows as f64;
    let independent = rows.min(PER_SECOND * duration_s * rows / samples as f64);
    let deviation = RELATIVE_ERROR * spread * (rows / independent).sqrt();
    (deviation > 0.0).then(|| 1.0 / deviation)
}

/// Factors of the kept columns of one output with further columns beside them, per block, of the samples off reversal.
pub(crate) fn reduce(
    block: &RegressorBlock,
    columns: &KeptColumns,
    samples: &Samples,
    position: &[Source],
    output: usize,
    beside: &[&[f64]],
    blocks: usize,
) -> Result<Vec<Factor>, FactorError> {
    let own = columns.local[output].iter().map(|k| block.column(output, *k));
    let sources: Vec<&[f64]> = own.chain(beside.iter().copied()).collect();
    let sliding = &samples.joints[position[output].joint].sliding;
    (0..blocks)
        .map(|b| {
            let rows: Vec<usize> = (0..samples.len())
                .filter(|k| sliding[*k] && (blocks == 1 || samples.block[*k] == b))
                .collect();
            let mut builder = FactorBuilder::with_chunk_rows(sources.len(), CHUNK_ROWS);
            builder.push_with(rows.len(), |column, range, out| match sources.get(column) {
                None => out.fill(0.0),
                Some(source) => out.iter_mut().zip(&rows[range]).for_each(|(to, k)| *to = source[*k]),
            })?;
            Ok(builder.take())
        })
        .collect()
}

/// Standard deviation.
pub(crate) fn deviation(signal: &[f64]) -> f64 {
    let n = signal.len().max(1) as f64;
    let mean = signal.iter().sum::<f64>() / n;
    (signal.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n).sqrt()
}
