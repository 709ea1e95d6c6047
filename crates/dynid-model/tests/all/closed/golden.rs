//! Golden numbers of closed mechanisms.

use dynid_model::closed::ClosedDynamics;
use dynid_model::{Dynamics, State};
use serde_json::Value;

use super::{Parts, spec};
use crate::golden::{check_close, flat, golden, numbers};

const ABSOLUTE: f64 = 1e-8;
const RELATIVE: f64 = 1e-9;

#[test]
fn efforts_multipliers_reactions_and_regressors_are_those_of_the_specification() {
    for name in ["fourbar", "fivebar", "delta", "stewart"] {
        let (Some(robot), Some(golden)) =
            (spec(&format!("robots/{name}.json")), golden(&format!("mech_{name}.json")))
        else {
            return;
        };
        states(&Parts::new(&robot, None), &golden, name);
        if let Some(variants) = golden["variants"].as_object() {
            for (variant, expected) in variants {
                states(&Parts::new(&robot, Some(variant)), expected, &format!("{name} {variant}"));
            }
        }
    }
}

fn states(parts: &Parts, golden: &Value, what: &str) {
    let machine = parts.close();
    let mechanism = machine.mechanism().clone();
    let phi = numbers(&golden["phi"]);
    let mut dynamics = ClosedDynamics::new(machine.clone());
    let tree = Dynamics::new(&mechanism);
    let mut work = tree.workspace();
    for (index, state) in golden["states"].as_array().unwrap().iter().enumerate() {
        let what = format!("{what}, state {index}");
        let [q, qd, qdd] = ["q", "qd", "qdd"].map(|k| numbers(&state[k]));
        dynamics.take(&q).unwrap();
        check_close(dynamics.pose().positions(), &q, 1e-11, 0.0, &format!("{what}: q"));
        let pick = |x: &[f64]| machine.independent().iter().map(|r| x[*r]).collect::<Vec<_>>();
        let (dq, ddq) = dynamics.motion(&pick(&qd), &pick(&qdd));
        check_close(&dq, &qd, 0.0, 1e-11, &format!("{what}: rates"));
        check_close(&ddq, &qdd, 0.0, 1e-11, &format!("{what}: accelerations"));
        check_close(dynamics.pose().bias(), &numbers(&state["bias"]), 1e-11, 1e-11, &format!("{what}: bias"));

        let found = dynamics.inverse_dynamics((&qd, &qdd), None, &phi);
        let close = |found: &[f64], key: &str| {
            check_close(found, &flat(&state[key]), ABSOLUTE, RELATIVE, &format!("{what}: {key}"));
        };
        let mut effort = vec![0.0; tree.rates()];
        let at = State { q: &q, dq: &qd, ddq: &qdd, gravity: None };
        tree.inverse_dynamics(&at, &phi, &mut work, &mut effort);
        close(&effort, "tree_effort");
        close(&found.drives, "effort");
        close(&found.multipliers, "multipliers");
        close(&energies(&tree, &at, &phi), "energy");
        if !state["constraint_jacobian"].is_null() {
            close(dynamics.pose().jacobian(), "constraint_jacobian");
        }
        let regressor = dynamics.regressor((&qd, &qdd), None);
        if !state["projected_regressor"].is_null() {
            close(&regressor.drives, "projected_regressor");
        }
        if !state["multiplier_regressor"].is_null() {
            close(&regressor.multipliers, "multiplier_regressor");
        }
        let product = |rows: &[f64]| -> Vec<f64> {
            rows.chunks_exact(phi.len()).map(|r| r.iter().zip(&phi).map(|(a, b)| a * b).sum()).collect()
        };
        check_close(&product(&regressor.drives), &found.drives, 0.0, 1e-11, &format!("{what}: W phi"));
        check_close(
            &product(&regressor.multipliers),
            &found.multipliers,
            1e-12,
            1e-11,
            &format!("{what}: L phi"),
        );

        for (body, expected) in state["reaction_wrench"].as_object().unwrap() {
            let index = mechanism.joint_index(body).unwrap();
            let rows = dynamics.reaction_rows(index, (&qd, &qdd), None);
            let wrench = rows.wrench(&phi, &found.multipliers);
            let what = format!("{what}: reaction of {body}");
            check_close(&wrench, &numbers(expected), ABSOLUTE, RELATIVE, &what);
            let by_regressor: Vec<f64> = (0..6)
                .map(|k| {
                    let row = rows.regressor_row(k, &regressor.multipliers);
                    row.iter().zip(&phi).map(|(a, b)| a * b).sum()
                })
                .collect();
            check_close(&by_regressor, &wrench, 1e-11, 1e-10, &format!("{what} by its regressor"));
        }
        if let Some(over) = state["over_actuated"].as_object() {
            let names: Vec<String> =
                over["actuated"].as_array().unwrap().iter().map(|n| n.as_str().unwrap().to_owned()).collect();
            let parts = Parts {
                driven: names,
                mechanism: mechanism.clone(),
                closures: machine.closures().to_vec(),
                home: parts.home.clone(),
            };
            let mut dynamics = ClosedDynamics::new(parts.close());
            dynamics.take(&q).unwrap();
            let found = dynamics.inverse_dynamics((&qd, &qdd), None, &phi);
            let expected = numbers(&over["least_norm_effort"]);
            check_close(&found.drives, &expected, ABSOLUTE, RELATIVE, &format!("{what}: over-actuated"));
        }
    }
}

fn energies(tree: &Dynamics, state: &State<'_, f64>, phi: &[f64]) -> [f64; 2] {
    let energy = tree.energy(state.q, state.dq, phi, &mut tree.workspace());
    [energy.kinetic, energy.potential]
}
