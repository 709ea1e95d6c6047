//! Row B3: friction that follows the reactions, state by state.

use dynid::estimators::load_friction::{Model, Problem, Settings as Law};
use dynid::motion::trajectory::Sampled;
use serde_json::json;

use super::machine::{Machine, Plane, SLIDERS};
use super::settings::Settings;
use super::{fault, reference, worst};
use crate::{Row, StudyError};

/// States as a motion; each is reached from the one before.
fn motion(states: &[reference::FrictionState]) -> Sampled {
    let all = |of: &dyn Fn(&reference::FrictionState) -> [f64; 3]| -> Vec<f64> {
        (0..3).flat_map(|k| states.iter().map(move |s| of(s)[k])).collect()
    };
    Sampled {
        time: (0..states.len()).map(|k| k as f64).collect(),
        q: all(&|s| s.pose),
        dq: all(&|s| s.pose_d),
        ddq: all(&|s| s.pose_dd),
    }
}

pub(super) fn row(machine: &Machine, settings: &Settings) -> Result<Row, StudyError> {
    let reference = reference::friction()?;
    let record = machine.record(&motion(&reference.states), Plane::Horizontal)?;
    let truth = settings.truth();
    let (mut within, mut forces, mut normals) = (true, 0.0_f64, 0.0_f64);
    let mut take = |largest: &mut f64, found: f64, expected: f64| {
        let off = (found - expected).abs();
        within &= off <= reference.tolerance.abs + reference.tolerance.rel * expected.abs();
        *largest = worst(*largest, off);
    };
    let zero = vec![vec![0.0; reference.states.len()]; SLIDERS];
    for model in [Model::Stribeck, Model::CoulombViscous] {
        let problem = Problem::new(record.clone(), &zero, Law { model, ..Law::default() }).map_err(fault)?;
        let predicted = problem.predict(&truth).map_err(fault)?;
        for (k, drive) in predicted.drives.iter().enumerate() {
            for (s, state) in reference.states.iter().enumerate() {
                let expected = match model {
                    Model::Stribeck => state.tau_stribeck,
                    _ => state.tau_cv,
                };
                take(&mut forces, drive.effort[s], expected[k]);
                take(&mut forces, drive.frictionless[s], state.tau_frictionless[k]);
                take(&mut forces, record.drives()[k].speed[s], state.slider_velocity[k]);
                take(&mut normals, drive.normal[s], state.normal_z[k].abs());
                take(&mut normals, drive.constant_normal, state.normal_y[k]);
            }
        }
    }
    Ok(Row::new(
        "B3",
        "Friction of both varying laws, with the normal forces of the moving mechanism and of its weight",
        "forces and normal forces to 1e-8",
        json!({ "states": reference.states.len(), "forces": forces, "normal_forces": normals }),
        format!("{} states: forces {forces:.1e} N, normal forces {normals:.1e} N", reference.states.len()),
        within,
    ))
}
