//! Which kept columns of an effort model are fixed, and which change with its shape parameters.

use super::problem::RowGroup;
use dynid_model::EffortModel;

/// Columns of one output.
#[derive(Debug, Clone, Default)]
pub struct OutputPlaces {
    /// `(position among the output's acting columns, kept column)`.
    pub fixed: Vec<(usize, usize)>,
    /// `(index into the model's shaped columns, kept column)`.
    pub shaped: Vec<(usize, usize)>,
    /// `(index into the model's shape dependence, index into shaped, shape parameter)`.
    pub dependence: Vec<(usize, usize, usize)>,
}

/// Places for all outputs. `kept`: base columns of the model, ascending.
pub fn places(model: &dyn EffortModel, kept: &[usize]) -> Vec<OutputPlaces> {
    let layout = model.layout();
    (0..layout.outputs())
        .map(|output| {
            let mut places = OutputPlaces::default();
            for (acting, column) in layout.columns(output).iter().enumerate() {
                let Ok(position) = kept.binary_search(column) else { continue };
                match model.shaped_columns().iter().position(|c| *c == (output, *column)) {
                    Some(shaped) => places.shaped.push((shaped, position)),
                    None => places.fixed.push((acting, position)),
                }
            }
            for (index, (shaped, parameter)) in model.shape_dependence().iter().enumerate() {
                if let Some(local) = places.shaped.iter().position(|s| s.0 == *shaped) {
                    places.dependence.push((index, local, *parameter));
                }
            }
            places
        })
        .collect()
}

impl OutputPlaces {
    /// A group of this output without rows.
    pub fn group(&self, log: usize, output: usize, scale: usize) -> RowGroup {
        RowGroup {
            log,
            output,
            scale,
            fixed: self.fixed.iter().map(|f| f.1).collect(),
            shaped: self.shaped.iter().map(|s| Some(s.1)).collect(),
            dependence: self.dependence.iter().map(|d| (d.1, d.2)).collect(),
            ..RowGroup::default()
        }
    }
}
