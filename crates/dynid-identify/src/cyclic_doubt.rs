//! Whether cyclic efforts hold on a log that they were not found on.

use dynid_model::element::Cyclic;
use dynid_model::{EffortModel, RobotModel};
use dynid_rows::conditioning::{ConditioningSettings, PreparedLog};

use crate::Error;
use crate::agreement::{Agreement, Alignment, compare};
use crate::input_record::short_name;

/// Share by which the prediction of a joint must be worse with its cyclic efforts than without.
const WORSE: f64 = 0.02;

/// What to do about [`doubts`].
pub(crate) const REMEDY: &str = "the motor may stand elsewhere at the same joint angle: a belt that slipped, an encoder that began anew, another robot. Identify from \
                                 logs of one day and one zero, or leave cyclic efforts out with `friction = \"given\"` under `[elements]`";

/// Joints whose cyclic efforts make the prediction of a log worse, in words: there they have another phase or size.
///
/// `with`: the agreement of the log with the model, at the same alignment.
///
/// # Errors
/// [`Error::Conditioning`], [`Error::TooShort`].
pub fn doubts(
    (model, values): (&RobotModel, &[f64]),
    log: &PreparedLog,
    alignment: &Alignment,
    settings: &ConditioningSettings,
    with: &Agreement,
) -> Result<Vec<String>, Error> {
    let table = model.parameters();
    let columns = |joint: &str| {
        let terms = Cyclic::TORQUE.into_iter().chain(Cyclic::FRICTION);
        terms.filter_map(|term| table.column(&format!("{joint}.{}", term.symbol))).collect::<Vec<_>>()
    };
    let of_output: Vec<Vec<usize>> = model.outputs().iter().map(|output| columns(&output.name)).collect();
    if of_output.iter().all(Vec::is_empty) {
        return Ok(Vec::new());
    }
    let mut plain = values.to_vec();
    of_output.iter().flatten().for_each(|column| plain[*column] = 0.0);
    let without = compare(model, &plain, log, alignment, settings)?;
    let doubt = |(output, columns): (usize, &Vec<usize>)| {
        let rms = |agreement: &Agreement| agreement.moving.channels[output].rms;
        let (own, rest) = (rms(with)?, rms(&without)?);
        let worse = !columns.is_empty() && own > (1.0 + WORSE) * rest;
        worse.then(|| {
            format!(
                "{}: the cyclic efforts of `{}` make its prediction worse by {:.0} %: they have another phase or size there",
                short_name(&log.name),
                model.outputs()[output].name,
                100.0 * (own / rest - 1.0)
            )
        })
    };
    Ok(of_output.iter().enumerate().filter_map(doubt).collect())
}
