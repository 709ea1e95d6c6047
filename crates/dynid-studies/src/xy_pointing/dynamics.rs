//! Row 1: dynamics with clearance against an independent implementation.

use dynid::model::MotionBlock;
use serde_json::json;

use super::parameters::Parameters;
use super::reference;
use super::tree::{ClearanceState, with_clearance};
use crate::{Row, StudyError};

pub(super) fn row() -> Result<Row, StudyError> {
    let tree = with_clearance()?;
    let states = reference::dynamics()?.states;
    let [mut torque, mut force, mut columns, mut product] = [0.0_f64; 4];
    for wanted in &states {
        let state =
            ClearanceState { q: [wanted.q, wanted.qd, wanted.qdd], e: [wanted.e, wanted.ed, wanted.edd] };
        let [q, dq, ddq] = state.tree();
        let motion = MotionBlock::plain(1, &q, &dq, &ddq);
        let loads = state.loads(&tree.efforts(&motion, &tree.linear_of(&Parameters(wanted.p))));
        let own = tree.theta_columns(&motion);
        for (joint, force_wanted) in [wanted.force1, wanted.force2].iter().enumerate() {
            torque = torque.max((loads[joint].torque - wanted.tau[joint]).abs());
            for (own, wanted) in loads[joint].force.iter().zip(force_wanted) {
                force = force.max((own - wanted).abs());
            }
            let mut sum = 0.0;
            for ((own, wanted), theta) in own.iter().zip(wanted.regressor[joint]).zip(wanted.theta) {
                columns = columns.max((own[joint] - wanted).abs());
                sum += own[joint] * theta;
            }
            product = product.max((sum - wanted.tau[joint]).abs());
        }
    }
    Ok(Row::new(
        "1",
        "Dynamics with offset journals: torques, joint forces, the 11 columns W and W θ agree with an independent implementation; \
         ours is the general tree with two slides in front of every joint",
        "1e-9",
        json!({ "states": states.len(), "torque": torque, "force": force, "columns": columns, "product": product }),
        format!(
            "{} states: {torque:.1e} N m, {force:.1e} N, columns {columns:.1e}, W θ {product:.1e} N m",
            states.len()
        ),
        torque.max(force).max(columns).max(product) <= 1e-9,
    ))
}
