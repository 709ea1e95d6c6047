//! Cyclic efforts in words and records.

use std::f64::consts::TAU;

use dynid_model::EffortModel;

use crate::elements::cyclic_element;
use crate::estimate::CyclicEffort;
use crate::identification::Identification;

/// All that joints took, joint after joint.
pub(super) fn records(id: &Identification) -> Vec<CyclicEffort> {
    let of = |cyclic: &crate::JointCyclic| {
        let output = &id.model.outputs()[cyclic.output];
        CyclicEffort {
            joint: output.name.clone(),
            element: cyclic_element(cyclic.found.is_friction).0.to_owned(),
            cycles: cyclic.found.cycles,
            amplitude: cyclic.found.amplitude,
            unit: output.unit.to_owned(),
            gain: cyclic.found.gain,
            standard_error: cyclic.found.standard_error,
        }
    };
    id.cyclic.iter().map(of).collect()
}

/// Names of what a joint took, and why; `may_be_a_spring`: [`CyclicFinding::may_be_a_spring`](dynid_friction::cyclic::CyclicFinding::may_be_a_spring)
/// of one of them.
pub(super) fn in_words(efforts: &[CyclicEffort], may_be_a_spring: bool) -> (Vec<String>, String) {
    let order = |e: &CyclicEffort| match e.unit.as_str() {
        "N" => format!("every {:.4} mm", 1e3 * TAU / e.cycles),
        _ => format!("{:.2} a turn", e.cycles),
    };
    let names = efforts.iter().map(|e| format!("{} ({})", e.element, order(e))).collect();
    let gain = |e: &CyclicEffort| {
        let (amplitude, unit) = (e.amplitude, &e.unit);
        format!(
            "{} of {amplitude:.3} {unit} {:.1} ± {:.1} %",
            e.element,
            100.0 * e.gain,
            100.0 * e.standard_error
        )
    };
    let gains: Vec<String> = efforts.iter().map(gain).collect();
    let slow = match may_be_a_spring {
        true => {
            "; where a spring acts beside the joint, state it: `beside = [\"balancer\"]` or `beside = [\"spring\"]` in the robot file"
        }
        false => "",
    };
    (names, format!("mean square residual on held-out parts of the motion falls: {}{slow}", gains.join(", ")))
}
