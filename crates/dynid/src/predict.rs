//! Efforts and regressors at given states.

use dynid_io::States;
use dynid_model::{BaseParameters, EffortModel, MotionBlock, RegressorBlock, RobotModel};

use crate::Error;

/// Channel-after-channel copy of a states table.
struct Flat {
    rows: usize,
    q: Vec<f64>,
    dq: Vec<f64>,
    ddq: Vec<f64>,
    gravity: Option<Vec<f64>>,
    channels: Vec<(String, Vec<f64>)>,
}

impl Flat {
    fn new(states: &States) -> Self {
        Flat {
            rows: states.rows,
            q: states.position.concat(),
            dq: states.velocity.concat(),
            ddq: states.acceleration.concat(),
            gravity: states.gravity.as_ref().map(|g| g.concat()),
            channels: states.channels.clone(),
        }
    }

    fn regressor(&self, model: &RobotModel) -> Result<RegressorBlock, Error> {
        for channel in model.channels() {
            if !self.channels.iter().any(|(name, _)| name == channel) {
                return Err(Error::StatesChannel { channel: channel.clone() });
            }
        }
        let channels: Vec<(&str, &[f64])> =
            self.channels.iter().map(|(name, values)| (name.as_str(), values.as_slice())).collect();
        let mut block = RegressorBlock::new(model.layout().clone(), self.rows);
        let motion = MotionBlock {
            samples: self.rows,
            stride: self.rows,
            q: &self.q,
            dq: &self.dq,
            ddq: &self.ddq,
            gravity: self.gravity.as_deref(),
            channels: &channels,
            sign_width: 0.0,
        };
        if let Some(closed) = model.closed() {
            closed.reachable(&motion).map_err(|e| Error::Pose {
                file: "states".to_owned(),
                row: e.sample + 1,
                fault: Box::new(e.fault),
            })?;
        }
        model.regressor(&motion, &model.parameters().shape_start(), &mut block);
        Ok(block)
    }
}

/// Effort of every output at every state, for given linear parameters; that of known elements included. Friction that remembers
/// the motion (LuGre) is in its steady state.
///
/// # Errors
/// [`Error::StatesChannel`]: the states lack a channel that the model reads, a temperature; [`Error::Pose`]: a mechanism with
/// loops cannot be in a state.
pub fn efforts(model: &RobotModel, values: &[f64], states: &States) -> Result<Vec<Vec<f64>>, Error> {
    let block = Flat::new(states).regressor(model)?;
    Ok((0..model.outputs().len()).map(|output| block.effort(output, values)).collect())
}

/// Regressor at every state: `rows[state][output][column]`, in standard columns or, with `base`, in base columns.
///
/// # Errors
/// As [`efforts`].
pub fn regressors(
    model: &RobotModel,
    base: Option<&BaseParameters>,
    states: &States,
) -> Result<Vec<Vec<Vec<f64>>>, Error> {
    let block = Flat::new(states).regressor(model)?;
    let layout = model.layout();
    let columns: Vec<usize> = base.map_or_else(|| (0..layout.parameters()).collect(), |b| b.kept.clone());
    let mut out = vec![vec![vec![0.0; columns.len()]; layout.outputs()]; states.rows];
    for output in 0..layout.outputs() {
        for (k, column) in layout.columns(output).iter().enumerate() {
            let Ok(position) = columns.binary_search(column) else { continue };
            for (state, value) in out.iter_mut().zip(block.column(output, k)) {
                state[output][position] = *value;
            }
        }
    }
    Ok(out)
}
