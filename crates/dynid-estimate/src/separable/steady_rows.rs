//! Friction measured in steady motion, as rows of an effort model.

use super::places::{OutputPlaces, places};
use super::problem::{RowGroup, SeparableProblem, ShapedColumns};
use super::settings::SeparableError;
use dynid_model::element::is_temperature;
use dynid_model::{EffortModel, MotionBlock, RegressorBlock, ShapeParameter};

/// Friction of one joint at one speed, half the difference of the efforts of both directions at equal positions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SteadyFrictionRow {
    /// Output of the model.
    pub output: usize,
    /// Speed, rad/s or m/s, positive.
    pub speed: f64,
    /// Temperature of the joint, °C; it is needed where an element reads it.
    pub temperature: f64,
    /// Friction, N m or N.
    pub friction: f64,
    /// Standard deviation of the friction, positive.
    pub std: f64,
}

/// Rows `[W(v) - W(-v)]/2 · linear = friction` of single joints in steady motion at `q = 0`: whatever does not change its
/// sign with the velocity (gravity, centrifugal forces, offsets) cancels in every column, so that friction alone is left.
/// Elements that remember are in their steady state.
///
/// One group per output with points. Rows are weighted by the inverse of their deviations, the median deviation
/// having weight 1, so that efforts keep their unit.
pub struct SteadyRows<'a> {
    model: &'a dyn EffortModel,
    outputs: Vec<OutputSteady>,
    linear: usize,
    parameters: Vec<ShapeParameter>,
    groups: Vec<RowGroup>,
}

impl std::fmt::Debug for SteadyRows<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("SteadyRows").field("parameters", &self.parameters).finish_non_exhaustive()
    }
}

/// Points of one output: velocities `v` of all, then `-v` of all.
struct OutputSteady {
    places: OutputPlaces,
    dq: Vec<f64>,
    rest: Vec<f64>,
    temperature: Vec<f64>,
    weights: Vec<f64>,
}

impl OutputSteady {
    fn new(
        model: &dyn EffortModel,
        output: usize,
        places: OutputPlaces,
        points: &[&SteadyFrictionRow],
    ) -> Self {
        let (positions, rates) = model.dimensions();
        let samples = 2 * points.len();
        let mut dq = vec![0.0; rates * samples];
        let velocities = points.iter().map(|p| p.speed).chain(points.iter().map(|p| -p.speed));
        dq[output * samples..][..samples].iter_mut().zip(velocities).for_each(|(to, v)| *to = v);
        let mut sorted: Vec<f64> = points.iter().map(|p| p.std).collect();
        sorted.sort_by(f64::total_cmp);
        let median = sorted.get(sorted.len() / 2).copied().unwrap_or(1.0);
        OutputSteady {
            places,
            dq,
            rest: vec![0.0; positions.max(rates) * samples],
            temperature: points.iter().chain(points).map(|p| p.temperature).collect(),
            weights: points.iter().map(|p| median / p.std).collect(),
        }
    }

    fn with_block<T>(&self, model: &dyn EffortModel, work: impl FnOnce(&MotionBlock<'_>) -> T) -> T {
        let samples = self.temperature.len();
        // Of other joints nothing moves: any value will do.
        let channels: Vec<(&str, &[f64])> =
            model.channels().iter().map(|name| (name.as_str(), self.temperature.as_slice())).collect();
        let plain = MotionBlock::plain(samples, &self.rest, &self.dq, &self.rest);
        work(&MotionBlock { channels: &channels, ..plain })
    }

    /// Weighted half difference of both directions.
    fn odd(&self, column: &[f64]) -> Vec<f64> {
        let (forward, backward) = column.split_at(self.weights.len());
        let both = forward.iter().zip(backward).zip(&self.weights);
        both.map(|((f, b), w)| 0.5 * w * (f - b)).collect()
    }
}

impl<'a> SteadyRows<'a> {
    /// Rows of `points`. `kept`: base columns of the model, ascending; `log`: index of the groups' log, one that no other
    /// group has. Start and bounds of the shape parameters are those of the model.
    ///
    /// # Errors
    /// [`SeparableError::NoRows`] without a point.
    ///
    /// # Panics
    /// If an output does not exist, a speed or deviation is not positive, or the model reads a channel that is no
    /// temperature.
    pub fn new(
        model: &'a dyn EffortModel,
        kept: &[usize],
        points: &[SteadyFrictionRow],
        log: usize,
    ) -> Result<Self, SeparableError> {
        assert!(points.iter().all(|p| p.speed > 0.0 && p.std > 0.0), "positive speeds and deviations");
        assert!(model.channels().iter().all(|c| is_temperature(c)), "channels besides temperatures");
        if points.is_empty() {
            return Err(SeparableError::NoRows);
        }
        let shape = model.parameters().shape_start();
        let (mut outputs, mut groups) = (Vec::new(), Vec::new());
        for (output, places) in places(model, kept).into_iter().enumerate() {
            let own: Vec<&SteadyFrictionRow> = points.iter().filter(|p| p.output == output).collect();
            if own.is_empty() {
                continue;
            }
            let mut group = places.group(log, output, 0);
            let steady = OutputSteady::new(model, output, places, &own);
            let mut regressor = RegressorBlock::new(model.layout().clone(), 2 * own.len());
            steady.with_block(model, |motion| model.regressor(motion, &shape, &mut regressor));
            let fixed = steady.places.fixed.iter();
            group.fixed_values =
                fixed.flat_map(|(acting, _)| steady.odd(regressor.column(output, *acting))).collect();
            let known = steady.odd(regressor.offset(output));
            let measured = own.iter().zip(&steady.weights).map(|(p, w)| w * p.friction);
            group.effort = measured.zip(known).map(|(y, known)| y - known).collect();
            group.block_rows = vec![1; own.len()];
            outputs.push(steady);
            groups.push(group);
        }
        Ok(SteadyRows {
            model,
            outputs,
            linear: kept.len(),
            parameters: model.parameters().shape.clone(),
            groups,
        })
    }
}

impl SeparableProblem for SteadyRows<'_> {
    fn linear(&self) -> usize {
        self.linear
    }
    fn shape(&self) -> &[ShapeParameter] {
        &self.parameters
    }
    fn groups(&self) -> &[RowGroup] {
        &self.groups
    }
    fn shaped(&self, shape: &[f64], out: &mut [ShapedColumns]) {
        let (shaped, dependent) = (self.model.shaped_columns().len(), self.model.shape_dependence().len());
        for (steady, out) in self.outputs.iter().zip(out) {
            let n = steady.temperature.len();
            let mut values = vec![0.0; shaped * n];
            let mut derivatives = vec![0.0; dependent * n];
            steady.with_block(self.model, |motion| {
                self.model.shaped(motion, shape, n, &mut values, &mut derivatives);
            });
            for (k, (index, _)) in steady.places.shaped.iter().enumerate() {
                out.value_mut(k).copy_from_slice(&steady.odd(&values[index * n..][..n]));
            }
            for (d, (index, ..)) in steady.places.dependence.iter().enumerate() {
                out.derivative_mut(d).copy_from_slice(&steady.odd(&derivatives[index * n..][..n]));
            }
        }
    }
}
