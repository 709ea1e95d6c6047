//! Rows of a motion, counted as the fit counts those of a log.

use dynid_factor::{Factor, FactorBuilder};
use dynid_model::element::is_gate;
use dynid_model::{BaseParameters, EffortModel, MotionBlock, RegressorBlock, RobotModel};
use dynid_motion::Kernel;
use dynid_motion::mask::{dilate, near_reversal};
use dynid_motion::signal::rms;

use crate::prior::typical_channels;

use super::motions::{Course, Motion, MotionSettings, Reach};

/// Rows are formed at cut-offs up to this, Hz; the motions hold nothing above.
const MOST_HZ: f64 = 8.0;
/// Samples per period of the cut-off.
const OVERSAMPLING: f64 = 16.0;
/// Share of the rms speed that counts as reversal at least, where an output has dry friction.
const LEAST_MASK: f64 = 0.03;

/// How the fit counts rows.
///
/// A row is the mean of regressor and effort under a kernel of cut-off `f`, a quarter of `1/f` apart; of several kernels
/// the widest that reaches no masked sample is used. Here rows of cut-offs above 8 Hz are formed at 8 Hz and weigh
/// `√(f/8)` times as much, the same information since the motions hold nothing above. The variance of a row grows with its
/// cut-off, `σ_j² f/f_widest`.
#[derive(Debug, Clone, PartialEq)]
pub struct FitRows {
    /// Cut-offs of the kernels, Hz, widest kernel (lowest cut-off) first; the filter's on the textbook route.
    pub scales_hz: Vec<f64>,
    /// Per output: standard deviation of the residual of the widest kernel's rows, N m or N. `None`: no such row, and
    /// rows of this output do not count in the motions either.
    pub sigma: Vec<Option<f64>>,
    /// Per output: reversal mask as a share of the rms speed; `None`: no mask. Outputs with dry friction are masked below
    /// 3 % even then: in friction at rest no model is to be trusted, so standing still gives no row.
    pub mask: Vec<Option<f64>>,
}

/// Reduces motions of one model to factors in its base columns.
pub(super) struct CandidateRows<'a> {
    model: &'a RobotModel,
    rows: &'a FitRows,
    duration_s: f64,
    reach: Vec<Reach>,
    /// Kernels at the cut-offs in use.
    kernels: Vec<Kernel>,
    rate_hz: f64,
    /// Per output: places of the base columns within the acting ones, and their numbers.
    local: Vec<Vec<usize>>,
    global: Vec<Vec<usize>>,
    /// Per output: takes the sign of a speed.
    dry: Vec<bool>,
    total: usize,
}

impl<'a> CandidateRows<'a> {
    pub(super) fn new(
        model: &'a RobotModel,
        base: &BaseParameters,
        rows: &'a FitRows,
        settings: &MotionSettings,
    ) -> Self {
        let layout = model.layout();
        assert!(
            rows.sigma.len() == layout.outputs() && rows.mask.len() == layout.outputs(),
            "one sigma and one mask per output"
        );
        let mut cutoffs: Vec<f64> = rows.scales_hz.iter().map(|f| f.min(MOST_HZ)).collect();
        cutoffs.dedup();
        let rate_hz = OVERSAMPLING * cutoffs.iter().copied().fold(0.0, f64::max);
        let (mut local, mut global) = (Vec::new(), Vec::new());
        for output in 0..layout.outputs() {
            let acting = layout.columns(output).iter().enumerate();
            let kept = acting.filter_map(|(k, column)| Some((k, base.kept.binary_search(column).ok()?)));
            let (l, g): (Vec<usize>, Vec<usize>) = kept.unzip();
            local.push(l);
            global.push(g);
        }
        CandidateRows {
            reach: Reach::of(model.mechanism(), settings),
            dry: dry_outputs(model),
            kernels: cutoffs.iter().filter_map(|f| Kernel::new(*f, rate_hz).ok()).collect(),
            model,
            rows,
            duration_s: settings.duration_s,
            rate_hz,
            local,
            global,
            total: base.len(),
        }
    }

    /// Factor of a motion, weighted by `1/σ_j`; `None` without any row.
    pub(super) fn reduce(&self, motion: &Motion) -> Option<Factor> {
        let widest = self.kernels.first()?;
        let samples = (self.duration_s * self.rate_hz).round() as usize;
        let [q, dq, ddq] = self.signals(motion, samples, widest.cutoff_hz());
        let mut values = typical_channels(self.model, samples);
        // Another log of the robot alone.
        values.iter_mut().filter(|(name, _)| is_gate(name)).for_each(|(_, gate)| gate.fill(0.0));
        let channels = named(&values);
        let block = MotionBlock { channels: &channels, ..MotionBlock::plain(samples, &q, &dq, &ddq) };
        let mut regressor = RegressorBlock::new(self.model.layout().clone(), samples);
        self.model.regressor(&block, &self.model.parameters().shape_start(), &mut regressor);
        let factors: Vec<Factor> =
            (0..self.local.len()).filter_map(|output| self.output_rows(output, &block, &regressor)).collect();
        (!factors.is_empty()).then(|| Factor::merge(&factors.iter().collect::<Vec<_>>()))
    }

    fn output_rows(
        &self,
        output: usize,
        motion: &MotionBlock<'_>,
        regressor: &RegressorBlock,
    ) -> Option<Factor> {
        let sigma = self.rows.sigma[output].filter(|s| s.is_finite() && *s > 0.0)?;
        let bad = self.masked(output, motion);
        let local = &self.local[output];
        let mut builder = FactorBuilder::with_chunk_rows(local.len(), 256);
        let mut taken = vec![false; motion.samples];
        for kernel in &self.kernels {
            let touched = dilate(&bad, kernel.half_width());
            let centres: Vec<usize> =
                kernel.centres(motion.samples).into_iter().filter(|c| !touched[*c] && !taken[*c]).collect();
            // Variance per row σ² f/f_widest, and f/f_row rows for each one formed.
            let weight = (self.rows.scales_hz[0] / kernel.cutoff_hz()).sqrt() / sigma;
            let filled = builder.push_with(centres.len(), |column, range, out| match local.get(column) {
                Some(k) => {
                    kernel.apply_block(regressor.column(output, *k), 0, &centres[range], out);
                    out.iter_mut().for_each(|x| *x *= weight);
                }
                None => out.fill(0.0),
            });
            filled.ok()?;
            for (c, taken) in taken.iter_mut().enumerate() {
                let inside = c >= kernel.half_width() && c + kernel.half_width() < motion.samples;
                *taken |= inside && !touched[c];
            }
        }
        (builder.rows() > 0).then(|| builder.finish().embed(self.total, &self.global[output]))
    }

    /// Samples of an output that are too near to a reversal.
    fn masked(&self, output: usize, motion: &MotionBlock<'_>) -> Vec<bool> {
        let mut bad = vec![false; motion.samples];
        let level = match self.rows.mask[output] {
            _ if self.dry[output] => self.rows.mask[output].unwrap_or(0.0).max(LEAST_MASK),
            Some(level) => level,
            None => return bad,
        };
        for speed in self.model.reversal_speeds(output) {
            let mut v = vec![0.0; motion.samples];
            for (rate, factor) in &speed {
                v.iter_mut().zip(motion.rate(*rate)).for_each(|(v, x)| *v += factor * x);
            }
            let threshold = level * rms(&v);
            let rests = self.dry[output];
            for ((b, near), v) in bad.iter_mut().zip(near_reversal(&v, threshold)).zip(&v) {
                *b |= near || (rests && *v == 0.0);
            }
        }
        bad
    }

    fn signals(&self, motion: &Motion, samples: usize, cutoff_hz: f64) -> [Vec<f64>; 3] {
        let mut signals = [const { Vec::new() }; 3];
        for (rate, reach) in self.reach.iter().enumerate() {
            let course = match motion.rates.iter().position(|r| *r == rate) {
                Some(member) => Course::new(motion.kind, reach, member, cutoff_hz),
                None => Course::rest(reach),
            };
            for s in 0..samples {
                let point = course.at(s as f64 / self.rate_hz);
                signals[0].push(point.position);
                signals[1].push(point.velocity);
                signals[2].push(point.acceleration);
            }
        }
        signals
    }
}

fn named(channels: &[(String, Vec<f64>)]) -> Vec<(&str, &[f64])> {
    channels.iter().map(|(name, values)| (name.as_str(), values.as_slice())).collect()
}

/// Outputs whose effort jumps when all speeds change their sign.
fn dry_outputs(model: &RobotModel) -> Vec<bool> {
    const CREEP: f64 = 1e-9;
    let n = model.mechanism().rates();
    // Two samples: creeping forward and backward.
    let dq: Vec<f64> = (0..n).flat_map(|_| [CREEP, -CREEP]).collect();
    let zero = vec![0.0; 2 * n];
    let values = typical_channels(model, 2);
    let channels = named(&values);
    let block = MotionBlock { channels: &channels, ..MotionBlock::plain(2, &zero, &dq, &zero) };
    let mut regressor = RegressorBlock::new(model.layout().clone(), 2);
    model.regressor(&block, &model.parameters().shape_start(), &mut regressor);
    (0..n)
        .map(|output| {
            (0..model.layout().columns(output).len()).any(|k| {
                let column = regressor.column(output, k);
                (column[0] - column[1]).abs() > 1e-3
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use dynid_model::element::{Coulomb, JointElement, Offset};
    use dynid_model::{
        BaseSettings, Description, Inertia, JointDescription, JointKind, Limits, LinkDescription, Placement,
    };

    use super::*;
    use crate::advice::MotionKind;

    fn pendulum(elements: Vec<Box<dyn JointElement>>) -> RobotModel {
        let mut d = Description::new("pendulum");
        d.gravity = [0.0, -9.81, 0.0];
        let inertia = Inertia([1.0, 0.3, 0.0, 0.0, 0.1, 0.0, 0.0, 0.1, 0.0, 0.1]);
        d.links.push(LinkDescription { name: "base".into(), inertia: None });
        d.links.push(LinkDescription { name: "arm".into(), inertia: Some(inertia) });
        d.joints.push(JointDescription {
            name: "j".into(),
            parent: "base".into(),
            child: "arm".into(),
            kind: JointKind::Revolute,
            placement: Placement::identity(),
            axis: [0.0, 0.0, 1.0],
            limits: Limits::default(),
            mimic: None,
        });
        RobotModel::new(d.build().unwrap(), elements)
    }

    /// Information `Σ w²` on a constant effort.
    fn offset_information(model: &RobotModel, scales_hz: &[f64], motion: &Motion) -> Option<f64> {
        let base = BaseParameters::of_model(model, &[], &BaseSettings::default());
        let rows = FitRows { scales_hz: scales_hz.to_vec(), sigma: vec![Some(0.5)], mask: vec![None] };
        let reduction = CandidateRows::new(model, &base, &rows, &MotionSettings::default());
        let offset = model.parameters().column("j.fo").unwrap();
        let place = base.kept.binary_search(&offset).unwrap();
        Some(reduction.reduce(motion)?.column_norms()[place].powi(2))
    }

    /// `4 f` rows a second of variance σ², over the time in which a whole kernel fits, also where `f` is above what rows
    /// are formed at.
    #[test]
    fn rows_count_as_in_a_fit() {
        let model = pendulum(vec![Box::new(Offset { rate: 0 })]);
        let slow = Motion { kind: MotionKind::Slow, rates: vec![0] };
        for hz in [2.0, 5.0, 8.0, 20.0] {
            let formed = f64::min(hz, MOST_HZ);
            let kernel = Kernel::new(formed, OVERSAMPLING * formed).unwrap();
            let whole = 10.0 - (2 * kernel.half_width() + 1) as f64 / (OVERSAMPLING * formed);
            let expected = 4.0 * hz * whole / 0.25;
            let found = offset_information(&model, &[hz], &slow).unwrap();
            // One row more or less of 4·10·formed.
            assert!(
                (found / expected - 1.0).abs() < 1.0 / (40.0 * formed - 40.0),
                "{hz}: {found} {expected}"
            );
        }
    }

    #[test]
    fn dry_friction_at_rest_gives_no_rows() {
        let rest = Motion { kind: MotionKind::Slow, rates: vec![] };
        let dry = pendulum(vec![Box::new(Offset { rate: 0 }), Box::new(Coulomb { rate: 0 })]);
        assert_eq!(offset_information(&dry, &[5.0], &rest), None);
        let smooth = pendulum(vec![Box::new(Offset { rate: 0 })]);
        assert!(offset_information(&smooth, &[5.0], &rest).is_some());
        // Narrower kernels add rows between reversals where the widest reaches one.
        let fast = Motion { kind: MotionKind::Fast, rates: vec![0] };
        let wide = offset_information(&dry, &[1.0], &fast);
        let both = offset_information(&dry, &[1.0, 4.0], &fast);
        assert!(both > wide, "{both:?} against {wide:?}");
    }
}
